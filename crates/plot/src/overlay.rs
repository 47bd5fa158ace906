//! Two results in one picture: the first drawn wide, the second on top of it.

use super::axis::Axis;
use super::birds_eye::{BirdsEye, FieldOfView, birds_eye_turned};
use super::canvas::{Pen, Picture};
use super::chart::{CURVE_COLOURS, ColourMap, Curve, Mark, Scale, finite_range, heat_map};
use super::family::{Family, pale};
use super::file::{in_file, places, rcs_rows};
use super::rcs::{RCS_LABEL, RcsRow, curve, degrees, distinct, gigahertz, name_by_difference, rcs_chart};
use catseye::base::error::{BadInput, Result};
use catseye::formats::csv::Table;
use std::path::Path;

/// The two as the legend names them.
const NAMES: [&str; 2] = ["A", "B"];
/// Most pairs of curves; those of further frequencies are left out, and the title says so.
const PAIRS: usize = CURVE_COLOURS.len();
const KINDS: &str =
    "two RCS tables (CSV with vv_dbsm), two tables of points or echoes (range_m and azimuth_deg)";

/// Draws the tables at `a` and `b` into one picture: RCS tables by [`rcs_overlay`], points and echoes by
/// [`points_overlay`].
///
/// # Errors
/// Returns `BadInput` for files that are not two tables of one of these kinds, and for tables with nothing to draw.
pub fn overlay_files(title: &str, a: &Path, b: &Path) -> Result<Picture> {
    let tables = [Table::read(a)?, Table::read(b)?];
    if tables.iter().all(|t| t.has("vv_dbsm")) {
        let [x, y] = [rcs_rows(&tables[0])?, rcs_rows(&tables[1])?];
        return rcs_overlay(title, &x, &y).map_err(|e| in_file(e, a));
    }
    match (places(&tables[0])?, places(&tables[1])?) {
        (Some(x), Some(y)) => points_overlay(title, &x, &y).map_err(|e| in_file(e, a)),
        (x, _) => {
            let file = if x.is_none() { a } else { b };
            Err(BadInput::new("these two tables cannot be drawn in one chart")
                .file(file)
                .allowed(KINDS)
                .into())
        }
    }
}

/// Points of two results from above, (x forward, y left) in m: rings for the first, crosses for the second.
///
/// # Errors
/// Returns `BadInput` for a picture that is too large.
pub fn points_overlay(title: &str, a: &[[f64; 2]], b: &[[f64; 2]]) -> Result<Picture> {
    let all = || a.iter().chain(b).chain(&[[0.0; 2]]);
    let ends = |i: usize| finite_range(all().map(|p| p[i])).unwrap_or((-10.0, 10.0));
    let ((x0, x1), (y0, y1)) = (ends(0), ends(1));
    let pad = 0.05 * (x1 - x0).max(y1 - y0).max(1.0);
    let limits_m = Some([[x0 - pad, y0 - pad], [x1 + pad, y1 + pad]]);
    let radars = [FieldOfView::default()];
    let (mut chart, turned) =
        birds_eye_turned(&BirdsEye { title, radars: &radars, limits_m, ..Default::default() });
    let marks = [Mark::Ring { radius: 5.0 }, Mark::Cross { radius: 3.5 }];
    for (i, points) in [a, b].into_iter().enumerate() {
        let shown: Vec<[f64; 2]> =
            points.iter().filter(|p| p[0].is_finite() && p[1].is_finite()).map(|p| turned(*p)).collect();
        chart.marks(format!("{} ({})", NAMES[i], points.len()), shown, marks[i], CURVE_COLOURS[i]);
    }
    chart.draw()
}

/// Cross sections of two tables against what varies: VV and HH of one frequency, VV of several; with two angles a map of
/// B − A in VV.
///
/// # Errors
/// Returns `BadInput` for tables that hold a single direction and frequency together, and for directions of both the
/// transmitter and a receiver elsewhere.
pub fn rcs_overlay(title: &str, a: &[RcsRow], b: &[RcsRow]) -> Result<Picture> {
    let placed = |r: &&RcsRow| (r.frequency_hz + r.azimuth_deg + r.elevation_deg).is_finite();
    let mut rows: Vec<RcsRow> = a.iter().filter(placed).copied().collect();
    let of_a = rows.len();
    rows.extend(b.iter().filter(placed));
    let mut title = title.to_string();
    let who = name_by_difference(&mut rows, &mut title)?;
    let frequencies = distinct(rows.iter().map(|r| r.frequency_hz));
    let azimuths = distinct(rows.iter().map(|r| r.azimuth_deg));
    let elevations = distinct(rows.iter().map(|r| r.elevation_deg));
    if frequencies.len().max(azimuths.len()).max(elevations.len()) < 2 {
        return Err(BadInput::new("a single direction cannot be drawn as a chart")
            .remedy("compare sweeps of the azimuth, the elevation or the frequency")
            .into());
    }
    for (name, list) in [("azimuth", &azimuths), ("elevation", &elevations)] {
        if let [only] = list[..] {
            title += &format!(", {who}{name} {}°", degrees(only));
        }
    }
    let (first, second) = rows.split_at(of_a);
    if azimuths.len() > 1 && elevations.len() > 1 {
        title += &format!(", VV, {} GHz", gigahertz(frequencies[0]));
        return difference_map(&title, who, (&azimuths, &elevations), frequencies[0], [first, second]);
    }
    let (label, of): (String, fn(&RcsRow) -> f64) = match (azimuths.len() > 1, elevations.len() > 1) {
        (true, _) => (format!("{who}azimuth (deg), positive left"), |r| r.azimuth_deg),
        (_, true) => (format!("{who}elevation (deg)"), |r| r.elevation_deg),
        _ => ("frequency (GHz)".into(), |r| r.frequency_hz * 1e-9),
    };
    let sweeps_frequency = azimuths.len() == 1 && elevations.len() == 1;
    type Channel = (&'static str, fn(&RcsRow) -> f64);
    let channels: [Channel; 2] = [("VV", |r| r.vv_dbsm), ("HH", |r| r.hh_dbsm)];
    let mut pairs: Vec<[Curve; 2]> = Vec::new();
    let mut pair = |label: &str, keep: &dyn Fn(&RcsRow) -> bool, value: fn(&RcsRow) -> f64| {
        let one = |i: usize, rows: &[RcsRow]| {
            let points = rows.iter().filter(|r| keep(r)).map(|r| [of(r), value(r)]);
            curve(&format!("{label}, {}", NAMES[i]), points)
        };
        pairs.push([one(0, first), one(1, second)]);
    };
    if sweeps_frequency || frequencies.len() == 1 {
        channels.iter().for_each(|(name, value)| pair(name, &|_| true, *value));
    } else {
        for f in frequencies.iter().take(PAIRS) {
            pair(&format!("VV, {} GHz", gigahertz(*f)), &|r| r.frequency_hz == *f, channels[0].1);
        }
        if frequencies.len() > PAIRS {
            title += &format!(", the first {PAIRS} of {} frequencies", frequencies.len());
        }
    }
    let axis = Axis::new(label, 0.0, 1.0);
    let axis = if sweeps_frequency { axis } else { axis.degrees() };
    let title = title.trim_start_matches(", ");
    let pens = (0..2 * pairs.len()).map(|i| match i % 2 {
        0 => Pen::solid(pale(CURVE_COLOURS[i / 2 % PAIRS]), 4.0),
        _ => Pen::solid(CURVE_COLOURS[i / 2 % PAIRS], 1.2),
    });
    let pens = pens.collect();
    rcs_chart(title, axis, &Family::with_pens(pairs.into_iter().flatten().collect(), pens)).draw()
}

/// VV of the second less that of the first over both angles, dB; what only one has is blank.
fn difference_map(
    title: &str,
    who: &str,
    (azimuths, elevations): (&[f64], &[f64]),
    frequency_hz: f64,
    tables: [&[RcsRow]; 2],
) -> Result<Picture> {
    let place = |all: &[f64], v: f64| all.partition_point(|x| *x < v);
    let map = |rows: &[RcsRow]| {
        let mut map = vec![f64::NAN; azimuths.len() * elevations.len()];
        for r in rows.iter().filter(|r| r.frequency_hz == frequency_hz) {
            map[place(elevations, r.elevation_deg) * azimuths.len() + place(azimuths, r.azimuth_deg)] =
                r.vv_dbsm;
        }
        map
    };
    let [a, b] = tables.map(map);
    let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
    let (lo, hi) = finite_range(apart.iter().copied()).unwrap_or((0.0, 0.0));
    // Equal tables are white all over.
    let most = lo.abs().max(hi.abs()).max(1e-3);
    let ends = |v: &[f64]| finite_range(v.iter().copied()).unwrap_or((0.0, 1.0));
    let mut chart = heat_map(
        title.trim_start_matches(", "),
        (&format!("{who}azimuth (deg), positive left"), ends(azimuths)),
        (&format!("{who}elevation (deg)"), ends(elevations)),
        (elevations.len(), azimuths.len()),
        apart,
        Scale::new(ColourMap::BlueWhiteRed, format!("B − A, {RCS_LABEL}").replace("dBsm", "dB"), -most, most),
    );
    chart.x = chart.x.degrees();
    chart.y = chart.y.degrees();
    chart.draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(azimuths: &[f64], elevations: &[f64], level: impl Fn(f64, f64) -> f64) -> Vec<RcsRow> {
        let all = elevations.iter().flat_map(|el| azimuths.iter().map(move |az| (*az, *el)));
        let row = |(azimuth_deg, elevation_deg)| RcsRow {
            frequency_hz: 77e9,
            azimuth_deg,
            elevation_deg,
            vv_dbsm: level(azimuth_deg, elevation_deg),
            hh_dbsm: f64::NEG_INFINITY,
            ..Default::default()
        };
        all.map(row).collect()
    }

    /// Pixels of this colour.
    fn pixels(picture: &Picture, colour: [u8; 3]) -> usize {
        let png = picture.png().unwrap();
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        image.pixels().filter(|p| p.0 == colour).count()
    }

    #[test]
    fn the_second_lies_on_the_first() {
        let sweep: Vec<f64> = (-20..=20).map(f64::from).collect();
        let a = rows(&sweep, &[0.0], |az, _| -0.02 * az * az);
        let same = rcs_overlay("plate", &a, &a).unwrap();
        let b = rows(&sweep, &[0.0], |az, _| -0.02 * az * az + if az == 5.0 { -3.0 } else { 0.0 });
        let other = rcs_overlay("plate", &a, &b).unwrap();
        // Where the second leaves the first, more of the wide stroke of the first is bare.
        let wide = pale(CURVE_COLOURS[0]);
        assert!(pixels(&same, wide) > 100);
        assert!(
            pixels(&other, wide) > pixels(&same, wide),
            "{} {}",
            pixels(&other, wide),
            pixels(&same, wide)
        );
        assert!(pixels(&same, CURVE_COLOURS[0]) > 50);
    }

    #[test]
    fn two_angles_make_a_map_of_the_difference() {
        let (az, el): (Vec<f64>, Vec<f64>) =
            ((-5..=5).map(f64::from).collect(), (0..=5).map(f64::from).collect());
        let a = rows(&az, &el, |az, el| az + el);
        let louder = rows(&az, &el, |a, e| a + e + if (a, e) == (2.0, 1.0) { 6.0 } else { 0.0 });
        let red = Scale::new(ColourMap::BlueWhiteRed, "", -6.0, 6.0).colour(6.0).unwrap();
        let equal = rcs_overlay("", &a, &a).unwrap();
        let picture = rcs_overlay("", &a, &louder).unwrap();
        // A cell beside the end of the colour bar, which both have.
        assert!(pixels(&picture, red) > pixels(&equal, red) + 200);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let one = rows(&[0.0], &[0.0], |_, _| 1.0);
        let e = rcs_overlay("", &one, &one).unwrap_err().to_string();
        assert!(e.contains("single direction"), "{e}");
        assert!(points_overlay("", &[], &[]).is_ok());
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a.csv", "b.csv"].map(|n| dir.path().join(n));
        std::fs::write(&a, "range_m,azimuth_deg\n10,0\n20,5\n").unwrap();
        std::fs::write(&b, "x\n1\n").unwrap();
        let e = overlay_files("", &a, &b).unwrap_err().to_string();
        assert!(e.contains("b.csv") && e.contains("cannot be drawn in one chart"), "{e}");
        assert!(overlay_files("", &a, &a).is_ok());
    }
}
