//! Radar cross section against angle or frequency.

use super::axis::Axis;
use super::canvas::Picture;
use super::chart::{Chart, ColourMap, Curve, Layer, Scale, Symbol, finite_range, heat_map};
use super::family::{Family, left_out};
use super::polar::{polar, polar_family};
use super::range_doppler::decibel_limits;
use catseye::base::error::{BadInput, Result};
use catseye::rcs::polarisation::Derived;

/// One direction of an RCS table. The first letter is the received polarisation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RcsRow {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Azimuth, degrees.
    pub azimuth_deg: f64,
    /// Elevation, degrees.
    pub elevation_deg: f64,
    /// Vertical received, vertical sent, dBsm.
    pub vv_dbsm: f64,
    /// Vertical received, horizontal sent, dBsm.
    pub vh_dbsm: f64,
    /// Horizontal received, vertical sent, dBsm.
    pub hv_dbsm: f64,
    /// Horizontal received, horizontal sent, dBsm.
    pub hh_dbsm: f64,
    /// In the pairs of [`Derived::ALL`], each in the order of [`Derived::names`], dBsm; None for a pair that was not asked for.
    pub derived_dbsm: [Option<[f64; 4]>; 2],
    /// (azimuth, elevation) of a receiver that stands elsewhere.
    pub receive_deg: Option<[f64; 2]>,
}

impl RcsRow {
    /// Level in a polarisation by its number: VV, HH, VH, HV, then those of each derived pair. NaN where there is none.
    fn dbsm(&self, polarisation: usize) -> f64 {
        match polarisation {
            0 => self.vv_dbsm,
            1 => self.hh_dbsm,
            2 => self.vh_dbsm,
            3 => self.hv_dbsm,
            i => self.derived_dbsm[(i - 4) / 4].map_or(f64::NAN, |levels| levels[i % 4]),
        }
    }
}

/// Numbers and names of the polarisations that rows have.
fn polarisations(rows: &[RcsRow]) -> Vec<(usize, String)> {
    // As in tables, `p45m45`, but with signs.
    let name = |n: &str| match n.split_at_checked(3) {
        Some((rx, tx)) => {
            [rx, tx].map(|p| format!("{}45°", if p.starts_with('p') { "+" } else { "−" })).join("/")
        }
        None => n.to_uppercase(),
    };
    let own = ["VV", "HH", "VH", "HV"].into_iter().map(String::from);
    let derived = Derived::ALL.iter().flat_map(|d| d.names()).map(name);
    let has = |i: &usize| *i < 4 || rows.iter().any(|r| r.derived_dbsm[(i - 4) / 4].is_some());
    own.chain(derived).enumerate().filter(|(i, _)| has(i)).collect()
}

/// How an RCS table is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RcsStyle {
    /// Polar for an azimuth sweep of 120 degrees or more, else lines; a map for two angles.
    #[default]
    Auto,
    /// Around a circle.
    Polar,
    /// Over the angle.
    Lines,
}

pub(super) const RCS_LABEL: &str = "RCS (dBsm)";
/// Dynamic range of a line chart; what lies lower is cross-polarisation that symmetry forbids.
const SPAN_DB: f64 = 60.0;

/// Curves of (azimuth in degrees, RCS in dBsm) on a disc: 0 up, positive azimuth left.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn rcs_polar(title: &str, curves: &[Curve]) -> Result<Picture> {
    polar(title, RCS_LABEL, curves)
}

/// Curves of (angle in degrees, RCS in dBsm). The axis spans at most 60 dB; curves that lie under it altogether are
/// left out, and the legend names them.
///
/// # Errors
/// A picture that is too large, or nothing that can be drawn.
pub fn rcs_lines(title: &str, angle_label: &str, curves: &[Curve]) -> Result<Picture> {
    rcs_chart(title, Axis::new(angle_label, 0.0, 1.0).degrees(), &Family::new(curves.to_vec())).draw()
}

pub(super) fn rcs_chart(title: &str, x: Axis, family: &Family) -> Chart {
    let curves = &family.curves;
    let all = || curves.iter().flat_map(|c| c.points.iter());
    let (x0, x1) = finite_range(all().map(|p| p[0])).unwrap_or((0.0, 1.0));
    let (min, max) = finite_range(all().map(|p| p[1])).unwrap_or((-40.0, 0.0));
    let lowest = min.max(max - SPAN_DB).min(max - 3.0);
    let y = Axis::new(RCS_LABEL, lowest, max + 0.3).to_ticks(8);
    let bottom = y.lo;
    let x = Axis { degrees: x.degrees, ..Axis::new(x.label, x0, x1) };
    let mut chart = Chart::new(title, x, y);
    let shown: Vec<usize> =
        (0..curves.len()).filter(|i| curves[*i].points.iter().any(|p| p[1] >= bottom)).collect();
    chart.keys = family.keys(&shown, bottom, RCS_LABEL);
    for i in family.drawn(shown) {
        // A zero amplitude is a point far below, not a gap.
        let points = curves[i]
            .points
            .iter()
            .map(|p| [p[0], if p[1].is_nan() { p[1] } else { p[1].max(bottom - 1e3) }]);
        chart.layers.push(Layer::Line { points: points.collect(), pen: family.pens[i] });
    }
    chart
}

/// RCS over azimuth and elevation, `rcs_dbsm` as `[elevation, azimuth]`; axes evenly spaced.
/// `who`: whose angles they are. `limits_dbsm`: ends of the colours.
fn rcs_map_chart(
    title: &str,
    who: &str,
    azimuth_deg: &[f64],
    elevation_deg: &[f64],
    rcs_dbsm: Vec<f64>,
    (lo, hi): (f64, f64),
) -> Chart {
    let ends = |v: &[f64]| finite_range(v.iter().copied()).unwrap_or((0.0, 1.0));
    let mut chart = heat_map(
        title,
        (&format!("{who}azimuth (deg), positive left"), ends(azimuth_deg)),
        (&format!("{who}elevation (deg)"), ends(elevation_deg)),
        (elevation_deg.len(), azimuth_deg.len()),
        rcs_dbsm,
        Scale::new(ColourMap::Viridis, RCS_LABEL, lo, hi),
    );
    chart.x = chart.x.degrees();
    chart.y = chart.y.degrees();
    chart
}

/// The picture of a whole table: every polarisation at every frequency, as curves against the angle that varies, or
/// against the frequency where only that does; for a sweep of both angles a sheet of maps in the same colours. What is more than 60 dB (on a disc
/// 50 dB) under the largest value altogether is left out, and the legend names it. The title names what does not vary.
/// Angles are the receiver's where only those vary.
///
/// # Errors
/// `BadInput` when the table holds one direction only, or none, or directions of both the transmitter and a receiver
/// elsewhere.
pub fn rcs_picture(title: &str, rows: &[RcsRow], style: RcsStyle) -> Result<Picture> {
    let placed = |r: &&RcsRow| (r.frequency_hz + r.azimuth_deg + r.elevation_deg).is_finite();
    let mut rows: Vec<RcsRow> = rows.iter().filter(placed).copied().collect();
    let mut title = title.to_string();
    let who = name_by_difference(&mut rows, &mut title)?;
    let frequencies = distinct(rows.iter().map(|r| r.frequency_hz));
    let azimuths = distinct(rows.iter().map(|r| r.azimuth_deg));
    let elevations = distinct(rows.iter().map(|r| r.elevation_deg));
    if rows.len() < 2 || frequencies.len().max(azimuths.len()).max(elevations.len()) < 2 {
        return Err(BadInput::new("a single direction cannot be drawn as a chart")
            .remedy("sweep the azimuth, the elevation or the frequency, e.g. --azimuth-deg -45:45:0.1")
            .into());
    }
    let azimuth_sweep = azimuths.len() > 1;
    if azimuth_sweep && elevations.len() > 1 {
        return rcs_maps(&title, who, &rows, [&frequencies, &azimuths, &elevations]);
    }
    if let [only] = frequencies[..] {
        title += &format!(", {} GHz", gigahertz(only));
    }
    for (name, list) in [("azimuth", &azimuths), ("elevation", &elevations)] {
        if let [only] = list[..] {
            title += &format!(", {who}{name} {}°", degrees(only));
        }
    }
    let title = title.trim_start_matches(", ");
    let (numbers, names): (Vec<usize>, Vec<String>) = polarisations(&rows).into_iter().unzip();
    if !azimuth_sweep && elevations.len() == 1 {
        let points = |i: usize| rows.iter().map(move |r| [r.frequency_hz * 1e-9, r.dbsm(i)]);
        let curves = numbers.iter().zip(&names).map(|(i, name)| curve(name, points(*i)));
        let axis = Axis::new("frequency (GHz)", 0.0, 1.0);
        return rcs_chart(title, axis, &Family::new(curves.collect())).draw();
    }
    let angle = |r: &RcsRow| if azimuth_sweep { r.azimuth_deg } else { r.elevation_deg };
    // Rows of each frequency, looked up once.
    let mut of_frequency = vec![Vec::new(); frequencies.len()];
    for r in &rows {
        of_frequency[frequencies.partition_point(|f| *f < r.frequency_hz)].push(*r);
    }
    let labels = frequencies.iter().map(|f| format!("{} GHz", gigahertz(*f))).collect();
    let family = Family::grid(names, labels, |p, f| {
        curve("", of_frequency[f].iter().map(|r| [angle(r), r.dbsm(numbers[p])]))
    });
    let sweep = if azimuth_sweep { &azimuths } else { &elevations };
    let wide = azimuth_sweep && sweep[sweep.len() - 1] - sweep[0] >= 120.0;
    if style == RcsStyle::Polar || (style == RcsStyle::Auto && wide) {
        return polar_family(title, RCS_LABEL, &family);
    }
    let label = match azimuth_sweep {
        true => format!("{who}azimuth (deg), positive left"),
        false => format!("{who}elevation (deg)"),
    };
    rcs_chart(title, Axis::new(label, 0.0, 1.0).degrees(), &family).draw()
}

/// Maps on one sheet at most; a note tells how many there would be.
const MOST_MAPS: usize = 16;

/// A map over both angles of each polarisation at each frequency, a row of the sheet to a frequency where there are several.
fn rcs_maps(
    title: &str,
    who: &str,
    rows: &[RcsRow],
    [frequencies, azimuths, elevations]: [&[f64]; 3],
) -> Result<Picture> {
    let named = polarisations(rows);
    let levels = |i: usize| rows.iter().map(move |r| r.dbsm(i));
    let top = finite_range(named.iter().flat_map(|(i, _)| levels(*i))).map_or(0.0, |(_, max)| max);
    let bottom = top - SPAN_DB;
    let (mut shown, mut hidden): (Vec<_>, Vec<_>) =
        named.into_iter().partition(|(i, _)| levels(*i).any(|x| x >= bottom));
    if shown.is_empty() {
        shown.push(hidden.remove(0));
    }
    let all: Vec<f64> = shown.iter().flat_map(|(i, _)| levels(*i)).collect();
    let limits = decibel_limits(&all, 25.0, SPAN_DB);
    let of = |f: f64, polarisation: usize| {
        let mut map = vec![f64::NAN; azimuths.len() * elevations.len()];
        let at = |all: &[f64], v: f64| all.partition_point(|x| *x < v);
        for r in rows.iter().filter(|r| r.frequency_hz == f) {
            map[at(elevations, r.elevation_deg) * azimuths.len() + at(azimuths, r.azimuth_deg)] =
                r.dbsm(polarisation);
        }
        map
    };
    let pairs = frequencies.iter().flat_map(|f| shown.iter().map(move |s| (*f, s)));
    let count = frequencies.len() * shown.len();
    let mut notes: Vec<_> =
        left_out(hidden.into_iter().map(|(_, name)| name).collect(), bottom, RCS_LABEL).into_iter().collect();
    let mut maps = Vec::new();
    for (f, (polarisation, name)) in pairs.take(MOST_MAPS) {
        let title = format!("{title}, {name}, {} GHz", gigahertz(f));
        let title = title.trim_start_matches(", ");
        let mut chart = rcs_map_chart(title, who, azimuths, elevations, of(f, *polarisation), limits);
        // What holds for the sheet stands over its first map.
        chart.keys = std::mem::take(&mut notes);
        if maps.is_empty() && count > MOST_MAPS {
            chart.key(format!("the first {MOST_MAPS} of {count} maps"), Symbol::Note);
        }
        maps.push(chart.draw()?);
    }
    let columns = if frequencies.len() > 1 { shown.len().min(4) } else { 2 };
    Ok(match maps.len() {
        1 => maps.remove(0),
        _ => Picture::sheet(&maps, columns),
    })
}

/// Of rows with receivers elsewhere: where the receiver is, when it stays, stands in the title; when it moves, its
/// angles take the place of the transmitter's. Gives whose angles those of the rows are, for labels.
pub(super) fn name_by_difference(rows: &mut [RcsRow], title: &mut String) -> Result<&'static str> {
    let angles = |of: &dyn Fn(&RcsRow, usize) -> f64| [0, 1].map(|i| distinct(rows.iter().map(|r| of(r, i))));
    let transmit = angles(&|r, i| [r.azimuth_deg, r.elevation_deg][i]);
    let receive = angles(&|r, i| r.receive_deg.map_or(f64::NAN, |a| a[i]));
    let place = |a: &[Vec<f64>; 2]| match a {
        [az, el] if az.len() == 1 && el.len() == 1 => {
            Some(format!("azimuth {}°, elevation {}°", degrees(az[0]), degrees(el[0])))
        }
        _ => None,
    };
    match (place(&transmit), place(&receive)) {
        _ if receive.iter().all(Vec::is_empty) => Ok(""),
        (_, Some(at)) => {
            *title += &format!(", receiver at {at}");
            Ok("transmitter ")
        }
        (Some(at), None) => {
            *title += &format!(", transmitter at {at}");
            for r in rows {
                [r.azimuth_deg, r.elevation_deg] = r.receive_deg.unwrap_or([f64::NAN; 2]);
            }
            Ok("receiver ")
        }
        (None, None) => Err(BadInput::new(
            "directions of both the transmitter and the receiver cannot be drawn in one chart",
        )
        .remedy("give one of them a single direction")
        .into()),
    }
}

/// An angle for a title.
pub(super) fn degrees(angle_deg: f64) -> String {
    ((angle_deg * 1e3).round() / 1e3 + 0.0).to_string().replace('-', "−")
}

pub(super) fn curve(label: &str, points: impl Iterator<Item = [f64; 2]>) -> Curve {
    let mut points: Vec<[f64; 2]> = points.collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Curve { label: label.into(), points }
}

pub(super) fn gigahertz(f_hz: f64) -> f64 {
    (f_hz * 1e-6).round() * 1e-3
}

pub(super) fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut v: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    v.sort_by(f64::total_cmp);
    v.dedup();
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bistatic_table_is_drawn_over_the_angles_that_vary() {
        let row = |azimuth_deg: f64, rx: f64| RcsRow {
            frequency_hz: 77e9,
            azimuth_deg,
            receive_deg: Some([rx, 0.0]),
            vv_dbsm: -0.1 * rx,
            ..Default::default()
        };
        let mut title = "plate".to_string();
        let mut rows = [row(60.0, -70.0), row(60.0, -60.0)];
        assert_eq!(name_by_difference(&mut rows, &mut title).unwrap(), "receiver ");
        assert_eq!(title, "plate, transmitter at azimuth 60°, elevation 0°");
        assert_eq!([rows[0].azimuth_deg, rows[1].azimuth_deg], [-70.0, -60.0]);
        let mut title = String::new();
        assert_eq!(
            name_by_difference(&mut [row(0.0, -2.5), row(1.0, -2.5)], &mut title).unwrap(),
            "transmitter "
        );
        assert_eq!(title, ", receiver at azimuth −2.5°, elevation 0°");
        let e = rcs_picture("", &[row(0.0, 1.0), row(1.0, 2.0)], RcsStyle::Auto).unwrap_err();
        assert!(e.to_string().contains("both the transmitter and the receiver"), "{e}");
    }

    #[test]
    fn curves_that_are_not_drawn_are_named() {
        let flat = |label: &str, v: f64| Curve { label: label.into(), points: vec![[0.0, v], [1.0, v]] };
        let curves = [flat("VV", 3.0), flat("HV", f64::NEG_INFINITY), flat("HH", -12.0)];
        let chart = rcs_chart("", Axis::new("", 0.0, 1.0), &Family::new(curves.to_vec()));
        assert_eq!(chart.layers.len(), 2);
        assert_eq!(chart.unfounded_keys(), Vec::<&str>::new());
        assert!(
            chart.keys[2].label.starts_with("left out, below −") && chart.keys[2].label.ends_with(": HV")
        );
    }
}
