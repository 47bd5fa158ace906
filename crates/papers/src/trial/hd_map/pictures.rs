//! Scenes from above with the lanes that tracks were given, accuracy beside the document's, errors across.

use super::passes::Passes;
use super::report::{READINGS, Scene};
use crate::trial::drive::Drive;
use catseye_lane::hd_map::of_road::Stripes;
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Picture, Rgb, Symbol};

/// Colours of lanes by the last digit of their numbers.
const LANES: [Rgb; 10] = [
    [120, 120, 120],
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [148, 103, 189],
    [140, 86, 75],
    [60, 60, 60],
];
const LINE: Rgb = [175, 175, 175];
const WRONG: Rgb = [214, 39, 40];
const DOCUMENT: Rgb = [150, 150, 150];
const OURS: Rgb = [31, 119, 180];
const BEFORE: Rgb = [230, 159, 0];
/// A picture shows nothing farther off, m.
const FARTHEST_M: f64 = 220.0;

/// What is drawn of some groups of a scene, in the level frame of the vehicle that carries the radar.
#[derive(Default)]
pub struct Drawing {
    lines: Vec<Vec<[f64; 2]>>,
    outlines: Vec<[[f64; 2]; 4]>,
    /// Place and lane given; None: no lane.
    marks: Vec<([f64; 2], Option<i32>, bool)>,
}

impl Drawing {
    pub fn add(&mut self, passes: &Passes, lanes: &[Stripes], drive: &Drive<'_>) {
        let last = drive.frames().saturating_sub(1);
        if self.lines.is_empty() {
            let level = drive.level(drive.time_s(last));
            for stripe in lanes.iter().flat_map(|r| &r.stripes) {
                // Where the lane has a width; a gap elsewhere.
                let there = |i: usize| stripe.left_m[i].distance(stripe.right_m[i]) > 0.01;
                for line in [&stripe.left_m, &stripe.right_m] {
                    let place = |(i, p): (usize, &glam::DVec3)| match there(i) {
                        true => level.from_world(p.truncate()).to_array(),
                        false => [f64::NAN; 2],
                    };
                    self.lines.push(line.iter().enumerate().map(place).collect());
                }
            }
        }
        for pass in &passes.vehicles {
            self.outlines.push(pass.outline_m);
            for s in &pass.scans {
                let number = s.given[0].number();
                self.marks.push((s.at_m, number, number == Some(s.true_lane)));
            }
        }
    }

    fn chart(&self, name: &str) -> Option<Chart> {
        let places: Vec<[f64; 2]> =
            self.marks.iter().map(|m| m.0).chain(self.outlines.iter().flatten().copied()).collect();
        let near: Vec<[f64; 2]> = places.into_iter().filter(|p| p[0].hypot(p[1]) < FARTHEST_M).collect();
        if near.is_empty() {
            return None;
        }
        let bound = |k: usize, low: bool| {
            let v = near.iter().map(|p| p[k]);
            if low { v.fold(f64::INFINITY, f64::min) } else { v.fold(f64::NEG_INFINITY, f64::max) }
        };
        let x = Axis::new(
            "x forward of the radar's post (m)",
            bound(0, true).min(0.0) - 5.0,
            bound(0, false) + 10.0,
        );
        let y = Axis::new("y left (m)", bound(1, true).min(-20.0) - 4.0, bound(1, false).max(20.0) + 4.0);
        let title = format!("{name}: lanes that tracks were given");
        let mut chart = Chart::new(title, x, y).equal_scale(1000.0, 640.0);
        for line in &self.lines {
            chart.layers.push(Layer::Line { points: line.clone(), pen: Pen::solid(LINE, 1.0) });
        }
        for o in &self.outlines {
            let stroke = Some(Pen::solid([90, 90, 90], 1.0));
            chart.layers.push(Layer::Area { polygon: o.to_vec(), fill: Some((LINE, 0.35)), stroke });
        }
        let mut numbers: Vec<i32> = self.marks.iter().filter_map(|m| m.1).collect();
        numbers.sort_unstable();
        numbers.dedup();
        for n in &numbers {
            let points: Vec<[f64; 2]> = self.marks.iter().filter(|m| m.1 == Some(*n)).map(|m| m.0).collect();
            let colour = colour(*n);
            // The other carriageway's numbers have diamonds.
            let mark = if *n >= 10 { Mark::Diamond { radius: 3.5 } } else { Mark::Dot { radius: 2.8 } };
            chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
            chart.key(format!("lane {n}"), Symbol::Mark(mark, colour));
        }
        let wrong: Vec<[f64; 2]> = self.marks.iter().filter(|m| !m.2).map(|m| m.0).collect();
        let ring = Mark::Ring { radius: 6.0 };
        if !wrong.is_empty() {
            chart.layers.push(Layer::Marks { points: wrong, mark: ring, paint: Paint::Fixed(WRONG) });
            chart.key("wrong, or none", Symbol::Mark(ring, WRONG));
        }
        Some(chart)
    }
}

fn colour(number: i32) -> Rgb {
    LANES[number.rem_euclid(10) as usize]
}

/// All pictures of a trial; those that have nothing to show are left out.
pub fn all(scenes: &[Scene]) -> Vec<(String, Picture)> {
    let mut charts: Vec<(String, Chart)> = Vec::new();
    for s in scenes {
        charts.extend(s.drawing.chart(&s.name).map(|c| (format!("scene_{}", s.name.replace(' ', "_")), c)));
    }
    charts.extend(accuracy(scenes).map(|c| ("accuracy".into(), c)));
    charts.extend(errors(scenes).map(|c| ("errors_across".into(), c)));
    charts.into_iter().filter_map(|(name, chart)| Some((name, chart.draw().ok()?))).collect()
}

fn bar(x: f64, half: f64, from: f64, to: f64) -> Vec<[f64; 2]> {
    vec![[x - half, from], [x + half, from], [x + half, to], [x - half, to]]
}

/// The share of vehicles in the right lane with its interval, beside the document's.
fn accuracy(scenes: &[Scene]) -> Option<Chart> {
    let known: Vec<&Scene> = scenes.iter().filter(|s| s.tally(0).counted() > 0).collect();
    let lowest =
        known.iter().filter_map(|s| s.tally(0).interval95()).map(|i| 100.0 * i[0]).reduce(f64::min)?;
    let names = known.iter().enumerate().map(|(i, s)| (i as f64 + 1.0, s.name.clone()));
    let n = known.len();
    let low = (0.1 * (lowest - 2.0)).floor() * 10.0;
    let low = low.clamp(0.0, 90.0);
    let x = Axis::new("scene", 0.4, n as f64 + 0.6).named(names);
    let y = Axis::new("vehicles in the right lane (%)", low, 102.0);
    let mut chart = Chart::new("Accuracy by scene, 95 % intervals", x, y);
    chart.width = 130.0 * (n as f64 + 1.0);
    let grey = Pen::solid([90, 90, 90], 1.0);
    for (i, s) in known.iter().enumerate() {
        let at = i as f64 + 1.0;
        let mut draw = |x: f64, value: f64, fill: Rgb| {
            let polygon = bar(x, 0.16, low, value);
            chart.layers.push(Layer::Area { polygon, fill: Some((fill, 0.85)), stroke: Some(grey) });
        };
        if let Some((_, percent)) = s.document {
            draw(at - 0.18, percent, DOCUMENT);
        }
        draw(at + 0.18, 100.0 * s.tally(0).accuracy()?, OURS);
        let [lower, upper] = s.tally(0).interval95()?.map(|p| 100.0 * p);
        let pen = Pen::solid([20, 20, 20], 1.5);
        chart.layers.push(Layer::Line { points: vec![[at + 0.18, lower], [at + 0.18, upper]], pen });
    }
    let area = |fill: Rgb| Symbol::Area { fill: (fill, 0.85), stroke: grey };
    if known.iter().any(|s| s.document.is_some()) {
        chart.key("document", area(DOCUMENT));
    }
    chart.key("here", area(OURS));
    Some(chart)
}

/// How far tracks lie from the middle of their vehicles, across.
fn errors(scenes: &[Scene]) -> Option<Chart> {
    const STEP_M: f64 = 0.1;
    const WIDEST_M: f64 = 2.5;
    let all: Vec<[f64; 2]> = scenes.iter().flat_map(|s| &s.errors).map(|e| e.across_m).collect();
    if all.is_empty() {
        return None;
    }
    let bins = (2.0 * WIDEST_M / STEP_M).round() as usize;
    let shares = |k: usize| -> Vec<f64> {
        let mut count = vec![0.0; bins];
        for e in &all {
            let at = ((e[k] + WIDEST_M) / STEP_M).floor();
            if (0.0..bins as f64).contains(&at) {
                count[at as usize] += 100.0 / all.len() as f64;
            }
        }
        count
    };
    let (tracked, moved) = (shares(0), shares(1));
    let most = tracked.iter().chain(&moved).copied().fold(0.0, f64::max);
    let x =
        Axis::new("across from the vehicle's middle, positive towards the radar (m)", -WIDEST_M, WIDEST_M);
    let y = Axis::new("share of scans (%)", 0.0, 1.1 * most.max(1.0));
    let mut chart = Chart::new("Tracks across their vehicles, all scenes", x, y);
    let outline = |v: &[f64]| -> Vec<[f64; 2]> {
        let edge = |i: usize| -WIDEST_M + STEP_M * i as f64;
        let top = |(i, h): (usize, &f64)| [[edge(i), *h], [edge(i + 1), *h]];
        let mut out = vec![[-WIDEST_M, 0.0]];
        out.extend(v.iter().enumerate().flat_map(top));
        out.push([WIDEST_M, 0.0]);
        out
    };
    let fill = Some((OURS, 0.45));
    chart.layers.push(Layer::Area { polygon: outline(&moved), fill, stroke: Some(Pen::solid(OURS, 1.2)) });
    let pen = Pen::solid(BEFORE, 2.0);
    chart.layers.push(Layer::Line { points: outline(&tracked), pen });
    chart.key(
        "moved to the middle of a car",
        Symbol::Area { fill: (OURS, 0.45), stroke: Pen::solid(OURS, 1.2) },
    );
    chart.key(READINGS[2], Symbol::Line(pen));
    Some(chart)
}
