//! W8-curve: how the time and memory of W8's frame grow with the number of triangles of its terrain.

use super::scenario;
use super::sheet::{Outcome, Settings, Sheet, Stage, once, peak_memory};
use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::engine::Engine;
use serde_json::{Map, Value, json};

/// Name of each size, its quads along each side of the terrain, and whether quick runs have it.
const SIZES: [(&str, u32, bool); 6] = [
    ("frame_1e4", 70, true),
    ("frame_3e4", 122, true),
    ("frame_1e5", 224, true),
    ("frame_3e5", 388, true),
    ("frame_1e6", 707, false),
    ("frame_2e6", 1000, false),
];

/// Least number of triangles from which the exponent is taken: what does not depend on them is then small.
const FROM_TRIANGLES: usize = 100_000;

/// One size of the curve.
struct Point {
    triangles: usize,
    /// Its stages in order.
    stages: Vec<Stage>,
    echoes: usize,
    peak_bytes: Option<u64>,
}

impl Point {
    /// Runs the stages of one frame once; all that they allocate is released at the end.
    fn of(quads: u32, engine: &Engine, seed: u64) -> Result<Point> {
        let frame = scenario::terrain(quads)?;
        let (geometry, placing) = once("geometry", || frame.geometry(&frame.scene))?;
        let ((), faces) = once("faces", || {
            geometry.find_faces();
            Ok(())
        })?;
        let (echoes, trace) =
            once("trace", || frame.echoes(engine, &geometry, &frame.options, frame.budget))?;
        let (_, synthesis) =
            once("synthesis", || engine.cube(&frame.radar, &echoes, &[], seed, 0, Control::default()))?;
        Ok(Point {
            triangles: frame.scene.triangle_count(),
            stages: vec![placing, faces, trace, synthesis],
            echoes: echoes.list.len(),
            peak_bytes: peak_memory(),
        })
    }

    /// The sum of all stages.
    fn sum(&self, name: &'static str) -> Stage {
        let cores = self.stages.iter().map(|s| s.core_seconds);
        let seconds = self.stages.iter().map(|s| s.seconds).sum();
        Stage { name, seconds, core_seconds: cores.sum(), runs: 1, tasks: None, device: None }
    }

    fn row(&self) -> Value {
        let mut row = Map::new();
        row.insert("triangles".into(), self.triangles.into());
        for s in self.stages.iter().chain([&self.sum("sum")]) {
            row.insert(s.name.into(), json!({ "core_s": s.core_seconds, "s": s.seconds }));
        }
        row.insert("echoes".into(), self.echoes.into());
        row.insert("peak_memory_bytes".into(), self.peak_bytes.into());
        row.into()
    }
}

/// Slope of log(y) over log(x) between two points (x, y); None where it is non-finite.
fn slope(from: (f64, f64), to: (f64, f64)) -> Option<f64> {
    let slope = (to.1 / from.1).ln() / (to.0 / from.0).ln();
    slope.is_finite().then_some(slope)
}

/// Slopes of the core-seconds and of n log n, between the first of `points` that has [`FROM_TRIANGLES`] and the last.
fn exponents(points: &[(usize, Option<f64>)]) -> [Option<f64>; 2] {
    let from = points.iter().find(|p| p.0 >= FROM_TRIANGLES);
    let Some((from, to)) = from.zip(points.last()) else { return [None; 2] };
    let [n, m] = [from.0 as f64, to.0 as f64];
    let taken = from.1.zip(to.1).and_then(|(a, b)| slope((n, a), (m, b)));
    [taken, slope((n, n * n.ln()), (m, m * m.ln()))]
}

pub(super) fn w8_curve(engine: &Engine, settings: &Settings, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let (mut rows, mut core) = (Vec::new(), Vec::new());
    for (name, quads, _) in SIZES.into_iter().filter(|s| s.2 || !settings.quick) {
        let before = sheet.profile();
        let point = Point::of(quads, engine, settings.seed)?;
        sheet.add_kernels(before);
        let sum = point.sum(name);
        core.push((point.triangles, sum.core_seconds));
        sheet.add(sum);
        rows.push(point.row());
    }
    sheet.count("curve", rows);
    let [exponent, of_n_log_n] = exponents(&core);
    sheet.count("exponent", exponent);
    sheet.count("exponent_of_n_log_n", of_n_log_n);
    sheet.note("one run of each size, which only has to finish: nothing is compared with a better frame");
    sheet.note(
        "the exponent is that of the core-seconds from 1e5 triangles to the most; a GPU's time is not in it",
    );
    sheet.note(
        "the peak of memory is that of the process so far, so workloads before this one and smaller sizes are in it",
    );
    Ok(sheet.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_what_they_are_called() {
        for (name, quads, _) in SIZES {
            let want: f64 = name.trim_start_matches("frame_").parse().unwrap();
            let have = f64::from(2 * quads * quads);
            assert!((have / want - 1.0).abs() < 0.025, "{name}: {have}");
        }
    }

    #[test]
    fn slopes_of_powers() {
        let points = |power: f64| {
            let at = |n: usize| (n, Some(3.0 * (n as f64).powf(power)));
            [at(10_000), at(100_000), at(300_000), at(2_000_000)]
        };
        let [taken, n_log_n] = exponents(&points(1.5));
        assert!((taken.unwrap() - 1.5).abs() < 1e-12);
        assert!(n_log_n.unwrap() > 1.05 && n_log_n.unwrap() < 1.1, "{n_log_n:?}");
        assert_eq!(exponents(&points(1.5)[..1]), [None; 2]);
        // One point has no slope, and a system that does not tell the time has none of it.
        assert_eq!(exponents(&points(1.5)[..2]), [None; 2]);
        let [untold, known] = exponents(&[(100_000, None), (300_000, None)]);
        assert!(untold.is_none() && known.is_some());
    }

    #[test]
    fn a_coarse_frame_has_all_stages() {
        let engine = Engine::Cpu(catseye::engine::Precision::F32);
        let point = Point::of(20, &engine, 1).unwrap();
        assert!(point.triangles == 800 + 55 * 12 && point.echoes > 0);
        let row = point.row();
        for key in ["geometry", "faces", "trace", "synthesis", "sum"] {
            assert!(row[key]["s"].as_f64().unwrap() > 0.0, "{key}");
        }
        let sum = point.sum("all").seconds;
        assert!((row["sum"]["s"].as_f64().unwrap() - sum).abs() < 1e-12);
    }
}
