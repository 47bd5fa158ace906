//! Pictures in the form of Feng 2019, fig. 5.1 to 5.4 and 4.13.

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::markers::looks::{MarkerLook, excess_db};
use crate::trial::markers::tally::{Tally, View, tally, truth_in_view};
use crate::trial::pictures::{DOT, FOUND, OTHER, SEEN, TRUE, lanes_chart};
use crate::trial::report::Step;
use catseye::error::Result;
use catseye::units::dbm_from_w;
use catseye_lane::markers::{Markers, MarkersOptions};
use catseye_plot::{
    Axis, Chart, ColourMap, Layer, Mark, Paint, Pen, Picture, Rgb, Scale, Symbol, class_colour, class_name,
    curve_pen, heat_map, noise_scale,
};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// Of classes and lines, apart for colour-blind readers (Okabe and Ito 2008).
const BLACK: Rgb = [0, 0, 0];
const PALE: Rgb = [190, 205, 220];
const RING: Mark = Mark::Ring { radius: 5.0 };
const SMALL: Mark = Mark::Dot { radius: 2.0 };
/// Frame of charts, pixels.
const BOX: (f64, f64) = (760.0, 520.0);

#[allow(clippy::too_many_arguments, reason = "all that a trial knows of a look")]
pub(super) fn pictures(
    given: &TrialContext<'_>,
    drive: &Drive<'_>,
    which: usize,
    look: &MarkerLook,
    seen: &[MarkerLook],
    options: &MarkersOptions,
    view: &View,
    steps: &[Step],
) -> Result<Vec<(String, Picture)>> {
    let mut out: Vec<(String, Picture)> = Vec::new();
    let mut put = |name: &str, chart: Chart| -> Result<()> {
        out.push((name.into(), chart.draw()?));
        Ok(())
    };
    put("fig_5_1_points", points(look, view))?;
    let map = given.kept(&format!("map{}", look.frame), || near_map(drive, which, look))?;
    if let Some(chart) = speed(&map, look) {
        put("fig_5_2_speed", chart)?;
    }
    let titled = |title: &str| format!("{title}, {:.2} s", look.time_s);
    let groups = edges(look, &look.steps.grouped, options);
    put(
        "fig_5_3a_groups",
        chosen(look, view, &titled("Points at the spacing {p1}"), &look.steps.grouped, groups, SEEN),
    )?;
    let dense = chosen(look, view, &titled("Denser points {p2}"), &look.steps.dense, Vec::new(), FOUND);
    put("fig_5_3b_dense", dense)?;
    let left = edges(look, &look.steps.left, options);
    put("fig_5_3c_left", chosen(look, view, &titled("Points left {p}"), &look.steps.left, left, OTHER))?;
    if look.steps.left.len() > 1 {
        put("fig_5_3e_hough", hough(look))?;
    }
    put("fig_5_4b_paths", paths(look, view, options))?;
    if options.rcs.is_some()
        && let Some(chart) = levels(look, options)
    {
        put("fig_5_4d_levels", chart)?;
    }
    let truth = truth_in_view(drive, look.time_s, view);
    let title = titled("Lanes followed over frames");
    put("lanes", with_key_room(lanes_chart(&title, &look.kept.points, &truth, &look.followed), view))?;
    put("fig_4_13_field", field(drive, seen))?;
    put("by_distance", by_distance(seen, view))?;
    if let Some(chart) = over_time(look.run, seen, steps) {
        put("offset", chart)?;
    }
    Ok(out)
}

/// The part of the level plane that is in view: x forward, y left.
fn plane(title: &str, view: &View) -> Chart {
    let reach = view.reach_m[1].max(10.0);
    let half = (reach * view.half_rad.sin()).min(0.35 * reach);
    let (x, y) = (Axis::new("x forward (m)", 0.0, reach), Axis::new("y left (m)", -half, half));
    Chart::new(title, x, y).equal_scale(BOX.0, BOX.1)
}

fn with_key_room(mut chart: Chart, view: &View) -> Chart {
    let half = 0.4 * view.reach_m[1].max(10.0);
    (chart.y.lo, chart.y.hi) = (-half, half);
    (chart.x.lo, chart.x.hi) = (0.0, view.reach_m[1].max(10.0));
    chart.equal_scale(BOX.0, BOX.1)
}

fn places(look: &MarkerLook, of: impl IntoIterator<Item = usize>) -> Vec<[f64; 2]> {
    of.into_iter().filter_map(|i| look.kept.points.get(i)).map(|p| p.at_m).collect()
}

fn dots(chart: &mut Chart, points: Vec<[f64; 2]>, mark: Mark, colour: Rgb, label: &str) {
    if points.is_empty() {
        return;
    }
    chart.key(format!("{label} ({})", points.len()), Symbol::Mark(mark, colour));
    chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
}

fn markers(chart: &mut Chart, look: &MarkerLook) {
    let mark = Mark::Diamond { radius: 3.0 };
    if look.markers.is_empty() {
        return;
    }
    chart.key(format!("true markers in view ({})", look.markers.len()), Symbol::Mark(mark, TRUE));
    chart.layers.push(Layer::Marks { points: look.every_marker.clone(), mark, paint: Paint::Fixed(TRUE) });
}

/// Fig. 5.1: all points, by what made them.
fn points(look: &MarkerLook, view: &View) -> Chart {
    let mut chart = plane(&format!("Points of one scan, {:.2} s", look.time_s), view);
    markers(&mut chart, look);
    let mut classes: Vec<&str> = look.kept.classes.iter().map(String::as_str).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in &classes {
        let of = (0..look.kept.points.len()).filter(|i| look.kept.classes[*i] == *class);
        let (colour, name) = (class_colour(class), class_name(class));
        dots(&mut chart, places(look, of), DOT, colour, &name);
    }
    chart
}

/// The near part of a range-Doppler map.
#[derive(Serialize, Deserialize)]
pub(super) struct NearMap {
    range_m: [f64; 2],
    rate_mps: [f64; 2],
    columns: usize,
    /// dBm, one row for each rate.
    dbm: Vec<f32>,
}

/// Farthest range of fig. 5.2, m.
const NEAR_M: f64 = 15.0;

fn near_map(drive: &Drive<'_>, which: usize, look: &MarkerLook) -> Result<NearMap> {
    let frame = drive.frame(which, look.frame)?;
    let radar = drive.radar(which);
    let mut out = NearMap { range_m: [0.0; 2], rate_mps: [0.0; 2], columns: 0, dbm: Vec::new() };
    let Some(map) = frame.maps.first().map(|m| &m.map) else { return Ok(out) };
    let (bin, step) = (radar.range_bin_m(), radar.velocity_bin_mps());
    let columns = ((NEAR_M / bin) as usize).clamp(1, map.range_bins);
    let zero = (map.doppler_bins / 2) as f64;
    let rate = |row: f64| (row - zero) * step;
    let speed = look.true_speed_mps.abs().max(2.0);
    let rows: Vec<usize> =
        (0..map.doppler_bins).filter(|r| (-1.5 * speed..=0.5 * speed).contains(&rate(*r as f64))).collect();
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(out) };
    out.range_m = [radar.first_range_m() - 0.5 * bin, radar.first_range_m() + (columns as f64 - 0.5) * bin];
    out.rate_mps = [rate(*first as f64 - 0.5), rate(*last as f64 + 0.5)];
    out.columns = columns;
    for r in rows {
        let row = &map.data[r * map.range_bins..][..columns];
        out.dbm.extend(row.iter().map(|p| dbm_from_w(*p).max(-250.0) as f32));
    }
    Ok(out)
}

/// Fig. 5.2: the map near the radar, and the speed that points at rest give.
fn speed(map: &NearMap, look: &MarkerLook) -> Option<Chart> {
    let rows = map.dbm.len().checked_div(map.columns)?;
    if rows < 2 {
        return None;
    }
    let dbm: Vec<f64> = map.dbm.iter().map(|d| f64::from(*d)).collect();
    let scale = noise_scale(&dbm);
    let axes = (
        ("range (m)", (map.range_m[0], map.range_m[1])),
        ("range rate (m/s)", (map.rate_mps[0], map.rate_mps[1])),
    );
    let title = format!("Speed from what stands, {:.2} s", look.time_s);
    let mut chart = heat_map(&title, axes.0, axes.1, (rows, map.columns), dbm, scale);
    (chart.width, chart.height) = (640.0, 440.0);
    chart.grid = false;
    let mut line = |v: f64, pen: Pen, label: String| {
        chart.layers.push(Layer::Line { points: vec![[map.range_m[0], -v], [map.range_m[1], -v]], pen });
        chart.key(label, Symbol::Line(pen));
    };
    line(
        look.true_speed_mps,
        Pen::solid([255, 255, 255], 2.0),
        format!("true {:.3} m/s", look.true_speed_mps),
    );
    if let Some(m) = look.steps.motion {
        let v = m.velocity_mps[0];
        line(v, Pen::dashed(FOUND, 2.0, [8.0, 6.0]), format!("from the points {v:.3} m/s"));
    }
    Some(chart)
}

/// Pairs of these points at the spacing of any pattern.
fn edges(look: &MarkerLook, of: &[usize], options: &MarkersOptions) -> Vec<[[f64; 2]; 2]> {
    let at = places(look, of.iter().copied());
    let mut out = Vec::new();
    for (k, a) in at.iter().enumerate() {
        for b in &at[k + 1..] {
            let d = (a[0] - b[0]).hypot(a[1] - b[1]);
            if options.patterns.first().is_some_and(|o| (d - o.spacing_m).abs() < o.tolerance_m) {
                out.push([*a, *b]);
            }
        }
    }
    out
}

/// Some of the points at rest, with lines between them.
fn chosen(
    look: &MarkerLook,
    view: &View,
    title: &str,
    of: &[usize],
    edges: Vec<[[f64; 2]; 2]>,
    colour: Rgb,
) -> Chart {
    let mut chart = plane(title, view);
    markers(&mut chart, look);
    let pen = Pen::solid(colour, 1.0);
    for e in edges {
        chart.layers.push(Layer::Line { points: e.to_vec(), pen });
    }
    dots(&mut chart, places(look, look.steps.at_rest.iter().copied()), SMALL, PALE, "at rest");
    dots(&mut chart, places(look, of.iter().copied()), DOT, colour, "chosen");
    chart
}

/// Fig. 5.3e: how many of the points left lie on each line x cos + y sin = r.
fn hough(look: &MarkerLook) -> Chart {
    let at = places(look, look.steps.left.iter().copied());
    let reach = at.iter().map(|p| p[0].hypot(p[1])).fold(5.0, f64::max);
    let (rows, columns, cell) = ((2.0 * reach / 0.25).ceil() as usize, 180, 0.25);
    let mut votes = vec![0.0; rows * columns];
    for p in &at {
        for c in 0..columns {
            let n = DVec2::from_angle((c as f64 + 0.5).to_radians());
            let r = ((n.dot(DVec2::from_array(*p)) + reach) / cell) as usize;
            if r < rows {
                votes[r * columns + c] += 1.0;
            }
        }
    }
    let most = votes.iter().copied().fold(1.0, f64::max);
    let title = format!("Hough transform of {} points left: {most} on one line at most", at.len());
    let scale = Scale::new(ColourMap::Viridis, "points", 0.0, most);
    let high = -reach + rows as f64 * cell;
    let mut chart = heat_map(
        &title,
        ("angle of the normal (deg)", (0.0, 180.0)),
        ("distance (m)", (-reach, high)),
        (rows, columns),
        votes,
        scale,
    );
    (chart.width, chart.height) = (640.0, 440.0);
    chart
}

/// Fig. 5.4b: edges, paths, and the lines that came of them.
fn paths(look: &MarkerLook, view: &View, options: &MarkersOptions) -> Chart {
    let mut chart = plane(&format!("Paths and lines, {:.2} s", look.time_s), view);
    markers(&mut chart, look);
    let green = Pen::solid(OTHER, 1.0);
    for e in edges(look, &look.steps.at_rest, options) {
        chart.layers.push(Layer::Line { points: e.to_vec(), pen: green });
    }
    chart.key("at the spacing", Symbol::Line(green));
    let black = Pen::solid(BLACK, 2.0);
    for path in look.steps.paths.iter().filter(|p| p.len() > 2) {
        chart.layers.push(Layer::Line { points: places(look, path.iter().copied()), pen: black });
    }
    chart.key("paths", Symbol::Line(black));
    let dashed = Pen::dashed(SEEN, 2.0, [3.0, 3.0]);
    for path in &look.steps.by_hough {
        chart.layers.push(Layer::Line { points: places(look, path.iter().copied()), pen: dashed });
    }
    if !look.steps.by_hough.is_empty() {
        chart.key("rows by Hough", Symbol::Line(dashed));
    }
    dots(&mut chart, places(look, look.steps.at_rest.iter().copied()), SMALL, PALE, "at rest");
    let members = look.single.lines.iter().flat_map(|l| l.members.clone());
    dots(&mut chart, places(look, members), RING, FOUND, "members of lines");
    chart
}

/// Fig. 5.4d: levels seen and expected over distance.
fn levels(look: &MarkerLook, options: &MarkersOptions) -> Option<Chart> {
    let lines = excess_db(look, &Markers::new(options.clone()));
    let all = || lines.iter().flatten().flat_map(|(_, a, b)| [*a, *b]).filter(|x| x.is_finite());
    let (lo, hi) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let far = lines.iter().flatten().map(|l| l.0).fold(0.0, f64::max);
    if lo > hi {
        return None;
    }
    let title = format!("Levels of the markers, {:.2} s", look.time_s);
    let x = Axis::new("distance (m)", 0.0, far + 2.0);
    let mut chart = Chart::new(title, x, Axis::new("cross section (dBsm)", lo - 3.0, hi + 3.0).to_ticks(8));
    for (k, line) in lines.iter().enumerate() {
        let colour = curve_pen(k).colour;
        dots(
            &mut chart,
            line.iter().map(|(r, a, _)| [*r, *a]).collect(),
            DOT,
            colour,
            &format!("line {} seen", k + 1),
        );
        let hollow = Mark::Diamond { radius: 4.0 };
        dots(&mut chart, line.iter().map(|(r, _, b)| [*r, *b]).collect(), hollow, colour, "expected");
    }
    Some(chart)
}

/// Fig. 4.13: the rows from above, the vehicle's way, and what the looks of the first run found.
fn field(drive: &Drive<'_>, seen: &[MarkerLook]) -> Chart {
    let world = |s: &MarkerLook, p: [f64; 2]| drive.level(s.time_s).to_world(DVec2::from_array(p)).to_array();
    let first: Vec<&MarkerLook> = seen.iter().filter(|s| s.run == seen[0].run).collect();
    let true_markers: Vec<[f64; 2]> = drive
        .site
        .road
        .iter()
        .flat_map(|r| &r.marker_rows)
        .flat_map(|r| &r.markers)
        .map(|m| [m.position_m[0], m.position_m[1]])
        .collect();
    let way: Vec<[f64; 2]> = first.iter().map(|s| drive.level(s.time_s).at_m.to_array()).collect();
    let members: Vec<[f64; 2]> = first
        .iter()
        .flat_map(|s| {
            let of = s.single.lines.iter().flat_map(|l| l.members.clone());
            places(s, of).into_iter().map(|p| world(s, p)).collect::<Vec<_>>()
        })
        .collect();
    let all: Vec<&[f64; 2]> = true_markers.iter().chain(&way).chain(&members).collect();
    let span = |k: usize| {
        let (lo, hi) =
            all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        (lo - 3.0, hi + 3.0)
    };
    let ((x0, x1), (y0, y1)) = (span(0), span(1));
    let mut chart = Chart::new(
        "The field, and what the drive found",
        Axis::new("x (m)", x0, x1),
        Axis::new("y (m)", y0, y1),
    )
    .equal_scale(BOX.0, 620.0);
    dots(&mut chart, true_markers, Mark::Diamond { radius: 2.5 }, TRUE, "markers");
    dots(&mut chart, members, SMALL, FOUND, "members of lines, all looks");
    let blue = Pen::solid(SEEN, 2.0);
    chart.layers.push(Layer::Line { points: way.clone(), pen: blue });
    dots(&mut chart, way, DOT, SEEN, "vehicle at each look");
    chart
}

/// Shares of markers detected and found, over distance.
fn by_distance(seen: &[MarkerLook], view: &View) -> Chart {
    const RING_M: f64 = 2.5;
    let n = (view.reach_m[1] / RING_M).ceil() as usize;
    let mut curves: [Vec<[f64; 2]>; 3] = Default::default();
    for k in 0..n {
        let reach = [k as f64 * RING_M, (k + 1) as f64 * RING_M];
        let ring = View { reach_m: [reach[0].max(view.reach_m[0]), reach[1].min(view.reach_m[1])], ..*view };
        let mut sum = Tally::default();
        for s in seen {
            let markers: Vec<[f64; 2]> =
                s.markers.iter().copied().filter(|m| ring.holds(DVec2::from_array(*m))).collect();
            sum.add(&tally(&s.single, &s.kept.points, &markers, &s.every_marker, &ring, WITHIN_M));
        }
        let middle = 0.5 * (reach[0] + reach[1]);
        for (c, v) in curves.iter_mut().zip([sum.detected_share(), sum.recall(), sum.precision()]) {
            if let Some(v) = v {
                c.push([middle, 100.0 * v]);
            }
        }
    }
    let mut chart = Chart::new(
        "Markers over distance",
        Axis::new("distance (m)", 0.0, view.reach_m[1]),
        Axis::new("share (%)", 0.0, 105.0),
    );
    let names = ["with a point within 0.3 m", "in a line (recall)", "members that are markers (precision)"];
    for ((c, name), colour) in curves.into_iter().zip(names).zip([TRUE, SEEN, FOUND]) {
        let pen = Pen::solid(colour, 2.0);
        chart.layers.push(Layer::Line { points: c, pen });
        chart.key(name, Symbol::Line(pen));
    }
    chart
}

const WITHIN_M: f64 = 0.3;

/// The offset over the drive of one run: true, of each look, and followed.
fn over_time(run: u32, seen: &[MarkerLook], steps: &[Step]) -> Option<Chart> {
    let steps: Vec<&Step> = steps.iter().filter(|s| s.run == run).collect();
    if steps.len() < 2 {
        return None;
    }
    let truth: Vec<[f64; 2]> =
        steps.iter().filter_map(|s| Some([s.estimate.time_s, s.truth.offset_m?])).collect();
    let alone: Vec<[f64; 2]> = seen
        .iter()
        .filter(|s| s.run == run)
        .filter_map(|s| Some([s.time_s, s.single.offset_m?.value]))
        .collect();
    let followed: Vec<[f64; 2]> =
        steps.iter().filter_map(|s| Some([s.estimate.time_s, s.estimate.offset_m?.value])).collect();
    let all = || truth.iter().chain(&alone).chain(&followed).map(|p| p[1]);
    let (lo, hi) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    if lo > hi {
        return None;
    }
    let end = steps.last()?.estimate.time_s;
    let mut chart = Chart::new(
        "Place in the lane",
        Axis::new("time (s)", steps[0].estimate.time_s, end),
        Axis::new("offset from the middle (m), positive left", lo - 0.1, hi + 0.1),
    );
    let grey = Pen::solid(TRUE, 2.0);
    chart.layers.push(Layer::Line { points: truth, pen: grey });
    chart.key("true", Symbol::Line(grey));
    dots(&mut chart, alone, DOT, SEEN, "each look");
    let red = Pen::solid(FOUND, 1.5);
    chart.layers.push(Layer::Line { points: followed, pen: red });
    chart.key("followed", Symbol::Line(red));
    Some(chart)
}
