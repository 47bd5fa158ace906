//! Lane estimates beside a run: what `catseye lane` wrote, drawn where the vehicle stands in each frame.

use catseye::base::error::{BadInput, Result, json_in_words};
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::stage::MANIFEST;
use catseye_io::files::PoseRecord;
use catseye_lane::LaneEstimate;
use catseye_lane::score::Score;
use glam::{DQuat, DVec3};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// File of a lane folder with one line for each look.
pub const ESTIMATES: &str = "estimates.jsonl";
/// Spacing of the points along a drawn line, m.
const STEP_M: f64 = 0.5;
/// Longest line that is drawn; what a method extends beyond says nothing any more, m.
const MOST_M: f64 = 500.0;
/// Height of the lines over the vehicle's origin on the road, m, so that they do not lie in its surface.
const ABOVE_M: f64 = 0.06;

/// One look of a drive.
#[derive(Debug, Deserialize)]
struct Look {
    run: u32,
    frame: u32,
    estimate: LaneEstimate,
    score: Score,
}

/// What of a lane folder's manifest a page needs.
#[derive(Deserialize)]
struct Manifest {
    seed: u64,
    #[serde(default)]
    command: String,
    /// Texts of the scenario files.
    #[serde(default)]
    scenarios: BTreeMap<String, String>,
}

/// The estimates of the drive that a run shows.
#[derive(Debug)]
pub struct Lanes {
    looks: BTreeMap<u32, Look>,
    /// The command that found them.
    pub method: String,
    /// What stands in the way of laying them over each other, for the page to tell.
    pub remark: Option<String>,
}

/// What of a run its estimates are compared with.
pub struct OfRun<'a> {
    pub seed: Option<u64>,
    /// Text of its scenario file, where it keeps it.
    pub scenario: Option<&'a str>,
    pub frames: &'a [(u32, f64)],
}

impl Lanes {
    /// Reads the estimates of a folder of `catseye lane`, or of its file `estimates.jsonl`, that belong to the drive of a run: that
    /// with the run's seed.
    ///
    /// # Errors
    /// Returns `BadInput` for files that are missing or cut short, for a folder in which no drive has the run's seed, and where no
    /// look is at a frame of the run.
    pub fn read(path: &Path, run: &OfRun<'_>) -> Result<Lanes> {
        let (file, folder) = match path.is_dir() {
            true => (path.join(ESTIMATES), Some(path.to_path_buf())),
            false => (path.to_path_buf(), path.parent().map(Path::to_path_buf)),
        };
        let remedy = "give a folder that `catseye lane METHOD` completed";
        if !file.is_file() {
            let bad = BadInput::new("is missing: the folder contains no lane estimates").file(&file);
            return Err(match below(path) {
                Some(one) => bad.remedy(format!("give one of its methods, as {}", one.display())),
                None => bad.remedy(remedy),
            }
            .into());
        }
        let manifest = match folder.map(|f| f.join(MANIFEST)).filter(|m| m.is_file()) {
            Some(path) => {
                Some(serde_json::from_slice::<Manifest>(&read(&path, "a manifest", LARGEST_TEXT)?).map_err(
                    |e| {
                        BadInput::new(format!("is not a manifest of lane estimates: {}", json_in_words(&e)))
                            .file(&path)
                            .remedy(remedy)
                    },
                )?)
            }
            None => None,
        };
        let text = read(&file, "lane estimates", LARGEST_TEXT)?;
        let mut looks = Vec::new();
        for (i, line) in text.split(|b| *b == b'\n').enumerate().filter(|(_, l)| !l.is_empty()) {
            let look: Look = serde_json::from_slice(line).map_err(|e| BadInput {
                line: Some(i + 1),
                ..BadInput::new(format!("is not a lane estimate: {}", json_in_words(&e)))
                    .file(&file)
                    .remedy(remedy)
            })?;
            looks.push(look);
        }
        // Drives count their seeds upwards from that of the scenario.
        let drive = match (&manifest, run.seed) {
            (Some(m), Some(seed)) => seed.wrapping_sub(m.seed),
            _ => 0,
        };
        let runs = looks.iter().map(|l| u64::from(l.run)).max().unwrap_or(0);
        if drive > runs {
            let bad = BadInput::new("has no drive with the run's seed").file(&file).key("seed");
            let first = manifest.as_ref().map_or(0, |m| m.seed);
            let allowed = format!("{first} to {}", first.saturating_add(runs));
            let bad = bad.value(run.seed.unwrap_or(0)).allowed(allowed);
            return Err(bad
                .remedy("simulate the scenario that the lanes were found in, with its own seed")
                .into());
        }
        let same = |t: &str| manifest.as_ref().is_none_or(|m| m.scenarios.values().any(|s| s == t));
        let mut remarks = Vec::new();
        if let Some(text) = run.scenario.filter(|t| !same(t)) {
            // Keys of [output] differ without harm, but a road would not.
            let name = text
                .lines()
                .find_map(|l| l.strip_prefix("name")?.trim_start().strip_prefix('='))
                .map_or("without a name", str::trim);
            remarks.push(format!(
                "the lanes were found in a scenario file whose text differs from that of the run ({name}); the differences are not listed"
            ));
        }
        let looks: BTreeMap<u32, Look> =
            looks.into_iter().filter(|l| u64::from(l.run) == drive).map(|l| (l.frame, l)).collect();
        if !run.frames.iter().any(|(i, _)| looks.contains_key(i)) {
            let bad = BadInput::new("has no estimate at a frame of the run").file(&file).key("frame");
            let told = |v: Vec<u32>| match (v.first(), v.last()) {
                (Some(a), Some(b)) => format!("{a} to {b}"),
                _ => "none".into(),
            };
            let bad = bad.value(told(looks.keys().copied().collect()));
            let bad = bad.allowed(told(run.frames.iter().map(|f| f.0).collect()));
            return Err(bad.remedy("give the run of the same scenario and number of frames").into());
        }
        // The first frame that both have tells whether their times are the same.
        if let Some((l, (_, t))) = run.frames.iter().find_map(|f| Some((looks.get(&f.0)?, f)))
            && (l.estimate.time_s - t).abs() > 1e-3
        {
            remarks.push(format!(
                "frame {} is at {} s in the lanes and at {t} s in the run",
                l.frame, l.estimate.time_s
            ));
        }
        let method = manifest.map_or_else(String::new, |m| m.command);
        let remark = (!remarks.is_empty()).then(|| remarks.join("; "));
        Ok(Lanes { looks, method, remark })
    }

    /// What the page draws of a frame whose vehicle has this pose; null where no look is at this frame.
    pub fn frame(&self, index: u32, ego: &PoseRecord) -> Value {
        let Some(Look { estimate: e, score, .. }) = self.looks.get(&index) else { return Value::Null };
        let lines: Vec<Value> = e
            .lines
            .iter()
            .filter(|l| l.fitted.curve.length_m.is_finite())
            .map(|l| {
                let mut curve = l.fitted.curve;
                curve.length_m = curve.length_m.min(MOST_M);
                let placed = curve.sample(STEP_M).into_iter().flat_map(|p| world(ego, [p.x, p.y]));
                json!({ "confidence": l.confidence, "points": super::pack::f32s(placed.map(|x| x as f32)) })
            })
            .collect();
        json!({
            "lines": lines,
            "method": e.provenance.method,
            "no_lane": e.no_lane.as_ref().map(|w| w.to_string()),
            "mirror": e.mirror,
            "confidence": e.confidence,
            "offset_m": e.offset_m.map(|m| m.value),
            "heading_rad": e.heading_rad.map(|m| m.value),
            "curvature_per_m": e.curvature_per_m.map(|m| m.value),
            "offset_error_m": score.offset_error_m,
            "heading_error_rad": score.heading_error_rad,
            "curvature_error_per_m": score.curvature_error_per_m,
            "precision": score.precision,
            "recall": score.recall,
        })
    }
}

/// Whether a path can hold lane estimates by its name or its files.
pub fn is_lanes(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "jsonl") || path.join(ESTIMATES).is_file()
}

/// The first folder below that holds estimates: a comparison has one for each method.
fn below(path: &Path) -> Option<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(path)
        .ok()?
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.join(ESTIMATES).is_file())
        .collect();
    found.sort();
    found.into_iter().next()
}

/// A place of the vehicle's level frame (x ahead, y left, the origin on the road under its reference point) in the world, m.
fn world(ego: &PoseRecord, [x, y]: [f64; 2]) -> [f64; 3] {
    let ahead = DQuat::from_array(ego.rotation_xyzw) * DVec3::X;
    let (sin, cos) = ahead.y.atan2(ahead.x).sin_cos();
    let [ox, oy, oz] = ego.position_m;
    [ox + cos * x - sin * y, oy + sin * x + cos * y, oz + ABOVE_M]
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::error::Error;

    fn look(run: u32, frame: u32, time_s: f64) -> String {
        let curve = json!({ "start_m": [5.0, 1.5], "heading_rad": 0.0, "curvature_per_m": 0.0, "curvature_rate_per_m2": 0.0, "length_m": 1.0 });
        let covariance = [[0.0; 4]; 4];
        let line = json!({ "fitted": { "curve": curve, "shape": "line", "covariance": covariance, "residual": 0.0 }, "confidence": 0.75, "members": [] });
        let estimate = json!({ "time_s": time_s, "lines": [line], "lane_number": null, "width_m": null,
            "offset_m": { "value": 0.25, "std": 0.1 }, "heading_rad": null, "curvature_per_m": null, "confidence": 0.75, "no_lane": null,
            "provenance": { "method": "markers", "given": 9, "used": 5 } });
        let score = json!({ "precision": 1.0, "recall": 0.5, "f1": null, "lateral_m": [null, null, null, null], "offset_error_m": 0.125,
            "heading_error_rad": null, "curvature_error_per_m": null, "lane_right": null });
        json!({ "run": run, "frame": frame, "estimate": estimate, "score": score }).to_string() + "\n"
    }

    fn folder(text: &str) -> tempfile::TempDir {
        let t = tempfile::tempdir().unwrap();
        std::fs::write(t.path().join(ESTIMATES), text).unwrap();
        let manifest =
            json!({ "seed": 50, "command": "lane markers", "scenarios": { "a.toml": "name = \"a\"\n" } });
        std::fs::write(t.path().join(MANIFEST), manifest.to_string()).unwrap();
        t
    }

    fn told(path: &Path, seed: u64, frames: &[(u32, f64)]) -> String {
        match Lanes::read(path, &OfRun { seed: Some(seed), scenario: None, frames }) {
            Err(Error::Input(e)) => e.to_string(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn lines_stand_where_the_vehicle_stands() {
        let t = folder(&(look(0, 1, 0.1) + &look(1, 1, 0.1)));
        let run = OfRun { seed: Some(51), scenario: Some("name = \"a\"\n"), frames: &[(1, 0.1)] };
        let lanes = Lanes::read(t.path(), &run).unwrap();
        assert_eq!((lanes.method.as_str(), lanes.remark.as_deref()), ("lane markers", None));
        assert_eq!(lanes.looks[&1].run, 1);
        // At (10, 20, 3), turned to the left by a right angle, and rolled, which the level frame is not.
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2) * DQuat::from_rotation_x(0.2);
        let ego = PoseRecord {
            position_m: [10.0, 20.0, 3.0],
            rotation_xyzw: turn.to_array(),
            velocity_mps: [0.0; 3],
            spin_rad_per_s: [0.0; 3],
        };
        let frame = lanes.frame(1, &ego);
        let want = [[8.5, 25.0, 3.06], [8.5, 25.5, 3.06], [8.5, 26.0, 3.06]];
        assert_eq!(
            frame["lines"][0]["points"],
            super::super::pack::f32s(want.into_iter().flatten().map(|x| x as f32))
        );
        assert_eq!((&frame["offset_error_m"], &frame["heading_error_rad"]), (&json!(0.125), &Value::Null));
        assert_eq!(lanes.frame(2, &ego), Value::Null);
        // The file alone is as good as its folder.
        assert!(Lanes::read(&t.path().join(ESTIMATES), &run).is_ok());
    }

    #[test]
    fn what_does_not_belong_together_is_told_of() {
        let t = folder(&look(0, 1, 0.1));
        let frames = [(1, 0.1)];
        let seed = told(t.path(), 99, &frames);
        assert!(seed.contains("seed") && seed.contains("99") && seed.contains("50 to 50"), "{seed}");
        let none = told(t.path(), 50, &[(7, 0.7)]);
        assert!(none.contains("frame") && none.contains("7 to 7") && none.contains("1 to 1"), "{none}");
        let run = OfRun { seed: Some(50), scenario: Some("name = \"b\"\n"), frames: &frames };
        assert!(Lanes::read(t.path(), &run).unwrap().remark.unwrap().contains("\"b\""));
        let cut = look(0, 1, 0.1) + &look(0, 2, 0.2)[..40];
        std::fs::write(t.path().join(ESTIMATES), cut).unwrap();
        let cut = told(t.path(), 50, &frames);
        assert!(cut.contains("estimates.jsonl:2") && cut.contains("catseye lane"), "{cut}");
        let empty = tempfile::tempdir().unwrap();
        assert!(told(empty.path(), 50, &frames).contains("contains no lane estimates"));
        std::fs::create_dir(empty.path().join("1_markers")).unwrap();
        std::fs::write(empty.path().join("1_markers").join(ESTIMATES), look(0, 1, 0.1)).unwrap();
        assert!(
            told(empty.path(), 50, &frames).contains("1_markers"),
            "a comparison leads to one of its methods"
        );
    }
}
