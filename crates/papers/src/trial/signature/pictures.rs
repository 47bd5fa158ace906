//! Pictures of the map, of the place over the drive, and of a row with its bits.

use crate::trial::kit::*;
use crate::trial::signature::looks::{Located, RowPicture, stds};
use crate::trial::signature::settings::bits;
use catseye_lane::signature::map::SignatureMap;

const SMALL: Mark = Mark::Dot { radius: 1.6 };
const BIG: Mark = Mark::Dot { radius: 3.4 };
const DOT: Mark = Mark::Dot { radius: 3.0 };
const WIDE: Mark = Mark::Dot { radius: 5.5 };
const DARK: Rgb = [40, 40, 40];

pub(super) fn all(
    map: &SignatureMap,
    road: Option<&RoadTruth>,
    way: &[[f64; 2]],
    places: &[Located],
    rows: &[Option<RowPicture>],
    shown: Option<&(Vec<LanePoint>, Step)>,
) -> Result<Vec<(String, Picture)>> {
    let mut out = vec![("map".to_string(), of_map(map, road, way, places).draw()?)];
    if places.iter().any(|p| p.error.is_some()) {
        out.push(("place_error".into(), of_errors(places)?));
    }
    for (i, row) in rows.iter().enumerate() {
        if let Some(row) = row {
            out.push((format!("row_{i}"), of_row(row)?));
        }
    }
    if let Some((points, step)) = shown {
        let chart = lanes_chart("Lane from the position in the map", points, &step.truth, &step.estimate);
        out.push(("lane".into(), chart.draw()?));
    }
    Ok(out)
}

/// The accumulated map (Feng 2019, fig. 4.16) with what is true of the road.
fn of_map(map: &SignatureMap, road: Option<&RoadTruth>, way: &[[f64; 2]], places: &[Located]) -> Chart {
    let points: Vec<[f64; 2]> = map.landmarks().iter().map(|l| l.position_m).collect();
    let axis = |label: &str, k: usize| {
        let (lo, hi) = finite_range(points.iter().chain(way).map(|p| p[k])).unwrap_or((0.0, 1.0));
        Axis::new(label, lo - 4.0, hi + 4.0)
    };
    let title = "Static points along a drive, and other drives located in them";
    let mut chart = Chart::new(title, axis("x (m)", 0), axis("y (m)", 1)).equal_scale(1300.0, 700.0);
    let grey = Pen::solid(TRUE, 1.0);
    if let Some(road) = road {
        for lane in road.roads.iter().flat_map(|r| &r.lanes) {
            for line in [&lane.left_m, &lane.right_m] {
                chart.line(line.iter().map(|p| [p[0], p[1]]).collect(), grey);
            }
        }
        let markers = road.marker_rows.iter().flat_map(|r| &r.markers);
        chart.dots(markers.map(|m| [m.position_m[0], m.position_m[1]]).collect(), BIG, TRUE);
    }
    chart.key("true lines", Symbol::Line(grey));
    chart.key("true markers", Symbol::Mark(BIG, TRUE));
    chart.marks("landmarks", points, SMALL, SEEN);
    chart.named_line("mapped drive", way.to_vec(), Pen::solid(DARK, 1.5));
    let found = places.iter().filter_map(|p| p.place.as_ref()).map(|p| [p.vehicle.x_m, p.vehicle.y_m]);
    chart.marks("estimated positions, all runs", found.collect(), SMALL, FOUND);
    chart
}

/// Error of the place over the way: along, across, heading.
fn of_errors(places: &[Located]) -> Result<Picture> {
    let far = places.iter().map(|p| p.way_m).fold(1.0, f64::max);
    let parts = [
        ("along the road (m)", 0, 1.0),
        ("across the road (m)", 1, 1.0),
        ("heading (deg)", 2, 180.0 / std::f64::consts::PI),
    ];
    let mut pictures = Vec::new();
    for (name, k, scale) in parts {
        let values = places.iter().filter_map(|p| Some((p.error?[k] * scale).abs()));
        let most = values.fold(0.0, f64::max);
        let reach = if most > 0.0 { (1.25 * most).max(0.1 * scale.min(5.0)) } else { 1.0 };
        let mut chart = Chart::new("", Axis::new("way (m)", 0.0, far), Axis::new(name, -reach, reach))
            .sized(760.0, 190.0);
        let thin = Pen::solid(SEEN, 1.0);
        let (red, dashed) = (Pen::solid(FOUND, 1.8), Pen::dashed(FOUND, 1.0, [4.0, 3.0]));
        let runs = places.iter().map(|p| p.run).max().unwrap_or(0);
        for run in (0..=runs).rev() {
            let points = |of: &dyn Fn(&Located) -> Option<f64>| -> Vec<[f64; 2]> {
                let of_run = places.iter().filter(|p| p.run == run);
                of_run.map(|p| [p.way_m, of(p).unwrap_or(f64::NAN)]).collect()
            };
            let line = points(&|p| Some(p.error?[k] * scale));
            if run == 0 {
                let std = |p: &Located| {
                    let place = p.place.as_ref()?;
                    Some(match k {
                        2 => place.covariance[2][2].max(0.0).sqrt() * scale,
                        _ => stds(place)[k],
                    })
                };
                for sign in [-2.0, 2.0] {
                    chart.line(points(&|p| Some(sign * std(p)?)), dashed);
                }
            }
            chart.line(line, if run == 0 { red } else { thin });
        }
        if k == 0 {
            chart.title = "Position error over the drive".into();
            chart.key("run 0", Symbol::Line(red));
            chart.key("its 2σ", Symbol::Line(dashed));
            if runs > 0 {
                chart.key("other runs", Symbol::Line(thin));
            }
        }
        pictures.push(chart.draw()?);
    }
    Ok(Picture::sheet(&pictures, 1))
}

/// A row's points, and the word that was read with its markers.
fn of_row(row: &RowPicture) -> Result<Picture> {
    let name = &row.table.name;
    let points = &row.picked.points;
    let (zero, one) = (Pen::solid(SEEN, 6.0), Pen::solid(FOUND, 6.0));
    let (from, to) = (points.first().map_or(0.0, |p| p.s_m), points.last().map_or(1.0, |p| p.s_m));
    let begin = row.reading.begin_m.first().copied().flatten();
    let mut bit_layers: Vec<Layer> = Vec::new();
    let mut expected: Vec<[f64; 2]> = Vec::new();
    if let (Some(alphabet), Some(begin)) = (row.table.alphabet(), begin) {
        let word = &row.reading.word;
        let period = alphabet.period_m(word);
        let first = begin - ((begin - from) / period).ceil() * period;
        let markers = alphabet.markers(word, first, to + 1e-6).unwrap_or_default();
        let is_gaps = row.table.gaps.is_some();
        let per_word = word.len() + usize::from(row.table.gaps.is_some_and(|g| g.sync_m.is_some()));
        for (i, m) in markers.iter().enumerate() {
            expected.push([m.0, m.1]);
            let Some(bit) = word.get(i % per_word) else { continue };
            let pen = if *bit { one } else { zero };
            let end = match (is_gaps, markers.get(i + 1)) {
                (true, Some(n)) => n.0 - 0.15,
                (true, None) => continue,
                (false, _) => m.0 + 0.45,
            };
            let start = if is_gaps { m.0 + 0.15 } else { m.0 - 0.45 };
            let y = if *bit { 0.75 } else { 0.55 };
            bit_layers.push(Layer::Line { points: vec![[start, y], [end, y]], pen });
        }
    }
    let title = format!("Row {name}: read {}, log odds {:.1}", bits(&row.reading.word), row.reading.log_odds);
    let x = Axis::new("along the row (m)", from - 1.0, to + 1.0);
    let mut chart = Chart::new(title, x, Axis::new("beside its line (m)", -0.6, 0.95)).sized(1100.0, 300.0);
    chart.layers.extend(bit_layers);
    chart.dots(expected, WIDE, OTHER);
    chart.marks("points of the row", points.iter().map(|p| [p.s_m, p.t_m]).collect(), DOT, DARK);
    chart.key("markers of the word", Symbol::Mark(WIDE, OTHER));
    chart.key("zero", Symbol::Line(zero));
    chart.key("one", Symbol::Line(one));
    chart.draw()
}
