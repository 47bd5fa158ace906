//! Scenes from above with the lanes that tracks were given, accuracy beside the document's, errors across.

use crate::trial::hd_map::scene::{READINGS, Scene};
use crate::trial::kit::*;

const DOCUMENT: Rgb = [150, 150, 150];
const OURS: Rgb = [31, 119, 180];
const BEFORE: Rgb = [230, 159, 0];

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
            let (left, right) = (x - 0.16, x + 0.16);
            let polygon = vec![[left, low], [right, low], [right, value], [left, value]];
            chart.area(polygon, (fill, 0.85), Some(grey));
        };
        if let Some((_, percent)) = s.document {
            draw(at - 0.18, percent, DOCUMENT);
        }
        draw(at + 0.18, 100.0 * s.tally(0).accuracy()?, OURS);
        let [lower, upper] = s.tally(0).interval95()?.map(|p| 100.0 * p);
        chart.line(vec![[at + 0.18, lower], [at + 0.18, upper]], Pen::solid([20, 20, 20], 1.5));
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
    let (fill, stroke) = ((OURS, 0.45), Pen::solid(OURS, 1.2));
    chart.area(outline(&moved), fill, Some(stroke));
    chart.key("moved to the middle of a car", Symbol::Area { fill, stroke });
    chart.named_line(READINGS[2], outline(&tracked), Pen::solid(BEFORE, 2.0));
    Some(chart)
}
