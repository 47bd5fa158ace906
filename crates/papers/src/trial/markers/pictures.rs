//! Pictures in the form of Feng 2019, fig. 5.1 to 5.4 and 4.13.

use crate::trial::kit::*;
use crate::trial::markers::looks::{MarkerLook, excess_db, tally_within};
use crate::trial::markers::tally::{View, truth_in_view};
use catseye::base::units::dbm_from_w;
use catseye_lane::markers::{MarkerSearch, Markers};
use catseye_plot::class_name;

/// Colours of classes and lines that colour-blind readers can distinguish (Okabe and Ito 2008).
const BLACK: Rgb = [0, 0, 0];
const PALE: Rgb = [190, 205, 220];
const RING: Mark = Mark::Ring { radius: 5.0 };
const SMALL: Mark = Mark::Dot { radius: 2.0 };
/// Frame of charts, pixels.
const BOX: (f64, f64) = (760.0, 520.0);

pub(super) fn pictures(
    given: &TrialContext<'_>,
    (drive, which): (&Drive<'_>, usize),
    look: &MarkerLook,
    seen: &[MarkerLook],
    options: &MarkerSearch,
    view: &View,
) -> Result<Vec<(String, Picture)>> {
    let titled = |title: &str| format!("{title}, {:.2} s", look.time_s());
    let subset = |title: &str, of: &[usize], edged: bool, colour: Rgb| {
        let edges = if edged { edges(look, of, options) } else { Vec::new() };
        Some(chosen(look, view, &titled(title), of, edges, colour))
    };
    let steps = &look.steps;
    let map = given.kept(&format!("map{}", look.step.frame), || near_map(drive, which, look))?;
    let truth = truth_in_view(drive, look.time_s(), view);
    let lanes =
        lanes_chart(&titled("Lanes tracked over frames"), &look.kept.points, &truth, &look.step.estimate);
    let charts = [
        ("fig_5_1_points", Some(points(look, view))),
        ("fig_5_2_speed", speed(&map, look)),
        ("fig_5_3a_groups", subset("Points at the spacing {p1}", &steps.grouped, true, SEEN)),
        ("fig_5_3b_dense", subset("Denser points {p2}", &steps.dense, false, FOUND)),
        ("fig_5_3c_left", subset("Points left {p}", &steps.left, true, OTHER)),
        ("fig_5_3e_hough", (steps.left.len() > 1).then(|| hough(look))),
        ("fig_5_4b_paths", Some(paths(look, view, options))),
        ("fig_5_4d_levels", options.rcs.as_ref().and_then(|_| levels(look, options))),
        ("lanes", Some(with_key_room(lanes, view))),
        ("fig_4_13_field", Some(field(drive, seen))),
        ("by_distance", Some(by_distance(seen, view))),
        ("offset", over_time(look.step.run, seen)),
    ];
    let drawn = charts.into_iter().filter_map(|(name, chart)| Some((name, chart?)));
    drawn.map(|(name, chart)| Ok((name.into(), chart.draw()?))).collect()
}

/// Chart of the part of the level plane that is in view: x forward, y left.
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
    chart.marks(format!("{label} ({})", points.len()), points, mark, colour);
}

fn markers(chart: &mut Chart, look: &MarkerLook) {
    if !look.markers.is_empty() {
        let label = format!("true markers in view ({})", look.markers.len());
        chart.marks(label, look.every_marker.clone(), Mark::Diamond { radius: 3.0 }, TRUE);
    }
}

/// Fig. 5.1: all points, by what made them.
fn points(look: &MarkerLook, view: &View) -> Chart {
    let mut chart = plane(&format!("Points of one scan, {:.2} s", look.time_s()), view);
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
    /// Levels in dBm, one row for each range rate.
    dbm: Vec<f32>,
}

/// Farthest range of fig. 5.2, m.
const NEAR_M: f64 = 15.0;

fn near_map(drive: &Drive<'_>, which: usize, look: &MarkerLook) -> Result<NearMap> {
    let frame = drive.frame(which, look.step.frame)?;
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
    let title = format!("Speed from static points, {:.2} s", look.time_s());
    let [range, rate] = [map.range_m, map.rate_mps].map(|v| (v[0], v[1]));
    let cells = (rows, map.columns);
    let mut chart = heat_map(&title, ("range (m)", range), ("range rate (m/s)", rate), cells, dbm, scale)
        .sized(640.0, 440.0);
    let mut line = |v: f64, pen: Pen, label: String| {
        chart.named_line(label, vec![[range.0, -v], [range.1, -v]], pen);
    };
    let v = look.true_speed_mps;
    line(v, Pen::solid([255, 255, 255], 2.0), format!("true {v:.3} m/s"));
    if let Some(m) = look.steps.motion {
        let v = m.velocity_mps[0];
        line(v, Pen::dashed(FOUND, 2.0, [8.0, 6.0]), format!("from the points {v:.3} m/s"));
    }
    Some(chart)
}

/// Pairs of these points at the spacing of any pattern.
fn edges(look: &MarkerLook, of: &[usize], options: &MarkerSearch) -> Vec<[[f64; 2]; 2]> {
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
    edges.iter().for_each(|e| chart.line(e.to_vec(), Pen::solid(colour, 1.0)));
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
    let angle = ("angle of the normal (deg)", (0.0, 180.0));
    let distance = ("distance (m)", (-reach, -reach + rows as f64 * cell));
    heat_map(&title, angle, distance, (rows, columns), votes, scale).sized(640.0, 440.0)
}

/// Fig. 5.4b: edges, paths, and the lines that came of them.
fn paths(look: &MarkerLook, view: &View, options: &MarkerSearch) -> Chart {
    let mut chart = plane(&format!("Paths and lines, {:.2} s", look.time_s()), view);
    markers(&mut chart, look);
    let green = Pen::solid(OTHER, 1.0);
    edges(look, &look.steps.at_rest, options).iter().for_each(|e| chart.line(e.to_vec(), green));
    chart.key("at the spacing", Symbol::Line(green));
    let black = Pen::solid(BLACK, 2.0);
    for path in look.steps.paths.iter().filter(|p| p.len() > 2) {
        chart.line(places(look, path.iter().copied()), black);
    }
    chart.key("paths", Symbol::Line(black));
    let dashed = Pen::dashed(SEEN, 2.0, [3.0, 3.0]);
    for path in &look.steps.by_hough {
        chart.line(places(look, path.iter().copied()), dashed);
    }
    if !look.steps.by_hough.is_empty() {
        chart.key("rows from Hough", Symbol::Line(dashed));
    }
    dots(&mut chart, places(look, look.steps.at_rest.iter().copied()), SMALL, PALE, "at rest");
    let members = look.single.lines.iter().flat_map(|l| l.members.clone());
    dots(&mut chart, places(look, members), RING, FOUND, "members of lines");
    chart
}

/// Fig. 5.4d: levels seen and expected over distance.
fn levels(look: &MarkerLook, options: &MarkerSearch) -> Option<Chart> {
    let lines = excess_db(look, &Markers::new(options.clone()));
    let (lo, hi) = finite_range(lines.iter().flatten().flat_map(|(_, a, b)| [*a, *b]))?;
    let far = lines.iter().flatten().map(|l| l.0).fold(0.0, f64::max);
    let title = format!("Cross sections of the markers, {:.2} s", look.time_s());
    let x = Axis::new("distance (m)", 0.0, far + 2.0);
    let mut chart = Chart::new(title, x, Axis::new("cross section (dBsm)", lo - 3.0, hi + 3.0).to_ticks(8));
    for (k, line) in lines.iter().enumerate() {
        let colour = curve_pen(k).colour;
        let (seen, expected) = line.iter().map(|(r, a, b)| ([*r, *a], [*r, *b])).unzip();
        dots(&mut chart, seen, DOT, colour, &format!("line {} seen", k + 1));
        dots(&mut chart, expected, Mark::Diamond { radius: 4.0 }, colour, "expected");
    }
    Some(chart)
}

/// Fig. 4.13: the rows from above, the vehicle's way, and what the looks of the first run found.
fn field(drive: &Drive<'_>, seen: &[MarkerLook]) -> Chart {
    let first: Vec<&MarkerLook> = seen.iter().filter(|s| s.step.run == seen[0].step.run).collect();
    let rows = drive.site.road.iter().flat_map(|r| &r.marker_rows);
    let true_markers: Vec<[f64; 2]> =
        rows.flat_map(|r| &r.markers).map(|m| [m.position_m[0], m.position_m[1]]).collect();
    let way: Vec<[f64; 2]> = first.iter().map(|s| drive.level(s.time_s()).at_m.to_array()).collect();
    let mut members: Vec<[f64; 2]> = Vec::new();
    for s in &first {
        let level = drive.level(s.time_s());
        let of = places(s, s.single.lines.iter().flat_map(|l| l.members.clone()));
        members.extend(of.into_iter().map(|p| level.to_world(DVec2::from_array(p)).to_array()));
    }
    let axis = |label: &str, k: usize| {
        let all = true_markers.iter().chain(&way).chain(&members).map(|p| p[k]);
        let (lo, hi) = finite_range(all).unwrap_or((0.0, 1.0));
        Axis::new(label, lo - 3.0, hi + 3.0)
    };
    let title = "The field and the detections of the drive";
    let mut chart = Chart::new(title, axis("x (m)", 0), axis("y (m)", 1)).equal_scale(BOX.0, 620.0);
    dots(&mut chart, true_markers, Mark::Diamond { radius: 2.5 }, TRUE, "markers");
    dots(&mut chart, members, SMALL, FOUND, "members of lines, all frames");
    chart.line(way.clone(), Pen::solid(SEEN, 2.0));
    dots(&mut chart, way, DOT, SEEN, "vehicle in each frame");
    chart
}

/// Shares of markers detected and found, over distance.
fn by_distance(seen: &[MarkerLook], view: &View) -> Chart {
    const RING_M: f64 = 2.5;
    let n = (view.reach_m[1] / RING_M).ceil() as usize;
    let mut curves: [Vec<[f64; 2]>; 3] = Default::default();
    for k in 0..n {
        let reach = [k as f64 * RING_M, (k + 1) as f64 * RING_M];
        let sum = tally_within(seen, &view.ring(reach), WITHIN_M);
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
        Axis::new("share (%)", 0.0, 100.0),
    );
    let names = ["with a point within 0.3 m", "in a line (recall)", "members that are markers (precision)"];
    for ((c, name), colour) in curves.into_iter().zip(names).zip([TRUE, SEEN, FOUND]) {
        chart.named_line(name, c, Pen::solid(colour, 2.0));
    }
    chart
}

const WITHIN_M: f64 = 0.3;

/// The offset over the drive of one run: true, of each look, and followed.
fn over_time(run: u32, seen: &[MarkerLook]) -> Option<Chart> {
    let seen: Vec<&MarkerLook> = seen.iter().filter(|s| s.step.run == run).collect();
    let (first, last) = (seen.first()?.time_s(), seen.last()?.time_s());
    let points = |of: &dyn Fn(&MarkerLook) -> Option<f64>| -> Vec<[f64; 2]> {
        seen.iter().filter_map(|s| Some([s.time_s(), of(s)?])).collect()
    };
    let truth = points(&|s| s.step.truth.offset_m);
    let alone = points(&|s| Some(s.single.offset_m?.value));
    let followed = points(&|s| Some(s.step.estimate.offset_m?.value));
    let all = truth.iter().chain(&alone).chain(&followed).map(|p| p[1]);
    let (lo, hi) = finite_range(all).filter(|_| seen.len() > 1)?;
    let y = Axis::new("offset from the middle (m), positive left", lo - 0.1, hi + 0.1);
    let mut chart = Chart::new("Position in the lane", Axis::new("time (s)", first, last), y);
    chart.named_line("true", truth, Pen::solid(TRUE, 2.0));
    dots(&mut chart, alone, DOT, SEEN, "each look");
    chart.named_line("followed", followed, Pen::solid(FOUND, 1.5));
    Some(chart)
}
