//! Pictures: maps with the fitted curves, the road from above, errors over the given values.

use crate::trial::kit::*;
use crate::trial::range_doppler::looks::{MapPicture, RadarLook, errors};
use crate::trial::range_doppler::settings::Settings;
use catseye_lane::range_doppler::{Foreseen, LaneFromMap};

const LEFT: Rgb = [255, 127, 80];
const RIGHT: Rgb = [120, 220, 255];
/// Colour of markers behind the radar.
const BEHIND: Rgb = [222, 180, 120];
const WHITE: Rgb = [255, 255, 255];

pub(super) fn draw(trial: &mut Trial, s: &Settings, made: &[RadarLook]) -> Result<()> {
    for m in made.iter().filter(|m| m.seen.map.is_some()) {
        let (file, title) = match m.case {
            Some(i) => (s.case[i].name.clone(), s.case[i].title()),
            None => {
                let t = m.step.estimate.time_s;
                (format!("look_{:04}", m.step.frame), format!("{t:.2} s into the drive"))
            }
        };
        if let Some(map) = &m.seen.map {
            trial.pictures.push((format!("map_{file}"), map_chart(&title, map, m, s).draw()?));
        }
        let lanes = lanes_chart(&title, &m.seen.points, &m.step.truth, &m.step.estimate);
        trial.pictures.push((format!("road_{file}"), lanes.draw()?));
    }
    match s.case.is_empty() {
        true => drive(trial, made),
        false => sweeps(trial, s, made),
    }
}

/// The fitted rows as curves in the map; broken where they turn back.
fn curves(lane: &LaneFromMap, s: &Settings) -> [Vec<[f64; 2]>; 2] {
    let lane_ahead = s.lane_ahead();
    let line = |c: Vec<Foreseen>| c.iter().map(|m| [m.range_m, m.range_rate_mps]).collect();
    [true, false].map(|is_left| line(lane.curve(is_left, 0.1, &lane_ahead)))
}

/// The map of Fig. 3.21 and 3.22 with true markers, detections and fitted curves.
fn map_chart(title: &str, map: &MapPicture, m: &RadarLook, s: &Settings) -> Chart {
    let x = Axis::new("range (m)", map.range_m[0].max(0.0), map.range_m[1]);
    let y = Axis::new("range rate (m/s), positive receding", map.range_rate_mps[0], map.range_rate_mps[1]);
    let mut chart = Chart::new(title, x, y).sized(680.0, 440.0);
    chart.grid = false;
    let values: Vec<f64> = map.dbm.iter().map(|v| f64::from(*v)).collect();
    chart.scale = Some(noise_scale(&values));
    let [x, y] = [map.range_m, map.range_rate_mps].map(|v| (v[0], v[1]));
    chart.layers.push(Layer::Cells { x, y, rows: map.rows, columns: map.columns, values });
    let inside = |p: &[f64; 2]| p[1] >= y.0 && p[1] <= y.1;
    let points = m.seen.points.iter().map(|p| [p.range_m, p.range_rate_mps]).filter(inside).collect();
    chart.marks("points", points, Mark::Ring { radius: 4.0 }, WHITE);
    if let Some(lane) = &m.look.lane {
        let rows = [(LEFT, "left row, fitted"), (RIGHT, "right row, fitted")];
        for (curve, (colour, name)) in curves(lane, s).into_iter().zip(rows) {
            chart.named_line(name, curve, Pen::solid(colour, 1.6));
        }
    }
    chart
}

/// Range rates of all markers, those behind the radar as diamonds (Fig. 3.22 b and d, 3.23, 3.24), and the fitted curves.
fn rates_chart(title: &str, m: &RadarLook, s: &Settings) -> Chart {
    let v = m.speed_mps.abs().max(0.1);
    let x = Axis::new("range (m)", 0.0, s.far_m);
    let y = Axis::new("range rate (m/s), positive receding", -1.1 * v, 1.1 * v);
    let mut chart = Chart::new(title, x, y).sized(560.0, 400.0);
    let of = |behind: bool| m.markers.iter().filter(|k| k.1 == behind).map(|k| k.0).collect::<Vec<_>>();
    let (dot, diamond) = (Mark::Dot { radius: 4.0 }, Mark::Diamond { radius: 3.5 });
    chart.dots(of(true), diamond, BEHIND);
    chart.marks("markers", of(false), dot, TRUE);
    chart.key("behind", Symbol::Mark(diamond, BEHIND));
    let strong = m.seen.points.iter().filter(|p| p.snr_db >= s.min_snr_db);
    let points =
        strong.map(|p| [p.range_m, p.range_rate_mps]).filter(|p| p[1].abs() < 1.1 * v && p[0] < s.far_m);
    chart.marks("points", points.collect(), Mark::Dot { radius: 1.6 }, SEEN);
    if let Some(lane) = &m.look.lane {
        let rows = [(FOUND, "left fitted"), (OTHER, "right fitted")];
        for (curve, (colour, name)) in curves(lane, s).into_iter().zip(rows) {
            chart.named_line(name, curve, Pen::solid(colour, 1.2));
        }
    }
    chart
}

/// A value over another with bars of two standard deviations and the truth as a line.
fn over(title: &str, x: &str, y: &str, points: &[[f64; 3]], truth: Vec<[f64; 2]>) -> Chart {
    let range = |values: Vec<f64>| {
        let (lo, hi) = finite_range(values).unwrap_or((0.0, 1.0));
        let pad = (0.06 * (hi - lo)).max(1e-3);
        (lo - pad, hi + pad)
    };
    let xs = range(points.iter().map(|p| p[0]).chain(truth.iter().map(|t| t[0])).collect());
    let bars: Vec<[f64; 2]> = points.iter().map(|p| [p[1] - 2.0 * p[2], p[1] + 2.0 * p[2]]).collect();
    let ys = range(bars.iter().flatten().copied().chain(truth.iter().map(|t| t[1])).collect());
    let mut chart = Chart::new(title, Axis::new(x, xs.0, xs.1), Axis::new(y, ys.0, ys.1));
    chart.named_line("true", truth, Pen::solid(TRUE, 2.0));
    for (p, [low, high]) in points.iter().zip(bars) {
        chart.line(vec![[p[0], low], [p[0], high]], Pen::solid(SEEN, 1.0));
    }
    let places = points.iter().map(|p| [p[0], p[1]]).collect();
    chart.marks("estimate, 2σ", places, Mark::Dot { radius: 2.5 }, SEEN);
    chart
}

fn drive(trial: &mut Trial, made: &[RadarLook]) -> Result<()> {
    let first: Vec<&RadarLook> = made.iter().filter(|m| m.step.run == 0).collect();
    if first.len() < 2 {
        return Ok(());
    }
    let degrees = 1f64.to_degrees();
    let charts = [
        ("offset", "offset of the radar (m)", 0, 1.0),
        ("heading", "heading of its motion (deg)", 1, degrees),
    ];
    for (file, label, k, factor) in charts {
        // A lane whose sign is open is drawn with the true one.
        let point = |m: &&RadarLook| {
            let (l, e, r) = (m.look.lane.as_ref()?, errors(m)?, m.radar?);
            let std = if k == 0 { l.offset_m.std } else { l.heading_rad.std };
            Some([m.step.estimate.time_s, factor * (r[k] + e[k]), factor * std])
        };
        let points: Vec<[f64; 3]> = first.iter().filter_map(point).collect();
        let truth = first.iter().filter_map(|m| Some([m.step.estimate.time_s, factor * m.radar?[k]]));
        let chart = over("First drive", "time (s)", label, &points, truth.collect());
        trial.pictures.push((format!("{file}_over_time"), chart.draw()?));
    }
    let bend: Vec<[f64; 3]> = first
        .iter()
        .filter_map(|m| {
            let k = m.look.lane.as_ref()?.curvature_per_m;
            Some([m.step.estimate.time_s, k.value, k.std])
        })
        .collect();
    let truth = first.iter().filter_map(|m| Some([m.step.estimate.time_s, m.step.truth.curvature_per_m?]));
    let label = "curvature of the bend ahead (1/m)";
    let mut chart = over("First drive", "time (s)", label, &bend, truth.collect());
    if let Some(key) = chart.keys.first_mut() {
        key.label = "true, at the position of the vehicle".into();
    }
    trial.pictures.push(("curvature_over_time".into(), chart.draw()?));
    Ok(())
}

fn sweeps(trial: &mut Trial, s: &Settings, made: &[RadarLook]) -> Result<()> {
    let mut charts = Vec::new();
    for m in made.iter().filter(|m| m.step.run == 0 && m.seen.map.is_some()) {
        let Some(case) = m.case.map(|i| &s.case[i]) else { continue };
        charts.push(rates_chart(&case.title(), m, s).draw()?);
    }
    if !charts.is_empty() {
        trial.pictures.push(("range_rates".into(), Picture::sheet(&charts, 2)));
    }
    let set = |m: &RadarLook| m.case.map(|i| &s.case[i]);
    let of = |what: &dyn Fn(&RadarLook) -> Option<[f64; 3]>| made.iter().filter_map(what).collect::<Vec<_>>();
    let line = |p: &[[f64; 3]]| {
        let (lo, hi) = finite_range(p.iter().map(|p| p[0])).unwrap_or((0.0, 1.0));
        vec![[lo, lo], [hi, hi]]
    };
    let offsets = of(&|m| {
        let (e, r, l) = (errors(m)?, m.radar?, m.look.lane.as_ref()?);
        Some([r[0], r[0] + e[0], l.offset_m.std])
    });
    let headings = of(&|m| {
        let (e, r, l) = (errors(m)?, m.radar?, m.look.lane.as_ref()?);
        Some([r[1].to_degrees(), (r[1] + e[1]).to_degrees(), l.heading_rad.std.to_degrees()])
    });
    let curvatures = of(&|m| {
        let (case, l) = (set(m).filter(|c| c.radius_m != 0.0)?, m.look.lane.as_ref()?);
        let k = l.curvature_per_m;
        let value = if m.look.estimate.mirror { k.value.abs().copysign(case.radius_m) } else { k.value };
        Some([1.0 / case.radius_m, value, k.std])
    });
    let all = [
        ("offsets", "offset of the radar (m)", offsets),
        ("headings", "heading (deg)", headings),
        ("curvatures", "curvature of the bend (1/m)", curvatures),
    ];
    for (file, what, points) in all {
        let spread = finite_range(points.iter().map(|p| p[0])).map_or(0.0, |(lo, hi)| hi - lo);
        if points.len() > 2 && spread > 1e-6 {
            let truth = line(&points);
            let chart =
                over("All looks", &format!("set: {what}"), &format!("estimated: {what}"), &points, truth);
            trial.pictures.push((file.into(), chart.draw()?));
        }
    }
    Ok(())
}
