//! Many frames into one folder. Each frame appears under its name when it is complete; an interrupted
//! run goes on where it stopped; the folder gets its own name at the very end.

use super::files::{Truth, frame_name, write_frame};
use super::follow;
use super::frame::{Frame, convergence, simulate_with};
use super::manifest::{Axes, FrameRecord, Manifest, PerRadar};
use crate::cpu::adc::synthesis::Control;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::formats::stage::{StagedDir, sha256_of_bytes};
use crate::road::{Library, lane_lines};
use crate::scene::Scene;
use crate::scene::radar_toml::to_toml;
use crate::scene::scenario::{Scenario, SceneSource};
use std::fs;
use std::path::{Path, PathBuf};

/// Draws the pictures of a frame into a folder.
pub type Pictures<'a> = &'a dyn Fn(&Scenario, &Scene, &Frame, &Truth, &Path) -> Result<()>;

/// How to run.
pub struct RunOptions<'a> {
    pub force: bool,
    /// Measure how far each object's peak moves when the coherent sums are 16 times more accurate.
    pub convergence: bool,
    /// The text of the scenario file, kept in the manifest.
    pub source: Option<String>,
    /// Draws the pictures of a frame into its folder.
    pub pictures: Pictures<'a>,
    /// Called with (frames done, of them found complete from an earlier run).
    pub progress: &'a dyn Fn(u32, u32),
}

/// What a run left.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RunReport {
    pub folder: PathBuf,
    /// Frames that an interrupted run had left complete.
    pub resumed: u32,
    pub frames: Vec<FrameRecord>,
}

/// Runs all frames of the scenario on `engine` into `out`.
pub fn run(engine: &Engine, scenario: &Scenario, out: &Path, options: &RunOptions<'_>) -> Result<RunReport> {
    let scene = scenario.build(&Library)?;
    let radars = scenario.radars.iter().map(to_toml).collect::<Result<Vec<_>>>()?;
    // Everything that decides on the bytes: another one of these must not continue this folder.
    let identity = sha256_of_bytes(
        format!(
            "{} {:?} {scenario:?} {radars:?} {} {:?}",
            env!("CARGO_PKG_VERSION"),
            engine.report(),
            options.convergence,
            scene
        )
        .as_bytes(),
    );
    let (staged, notes) = StagedDir::resumable(out, options.force, &identity)?;
    let lanes = match &scenario.scene {
        SceneSource::Builtin(b) => lane_lines(*b),
        SceneSource::File { .. } => Vec::new(),
    };
    let mut records = Vec::new();
    let mut resumed = 0;
    for index in 0..scenario.frames.count {
        let folder = staged.path().join(frame_name(index));
        // Its part of the manifest; written first, so that a folder with its name is complete.
        let note = notes.join(format!("{}.json", frame_name(index)));
        if let Some(record) = folder.is_dir().then(|| read_record(&note)).flatten() {
            records.extend(record);
            resumed += 1;
            (options.progress)(index + 1, resumed);
            continue;
        }
        let unfinished = staged.path().join(format!("{}.unfinished", frame_name(index)));
        for old in [&folder, &unfinished] {
            if old.exists() {
                fs::remove_dir_all(old).map_err(|e| Error::io(old, e))?;
            }
        }
        fs::create_dir(&unfinished).map_err(|e| Error::io(&unfinished, e))?;
        let mut record = Vec::with_capacity(scenario.radars.len());
        for (which, radar) in scenario.radars.iter().enumerate() {
            let frame = simulate_with(engine, scenario, &scene, which, index, Control::default())?;
            let truth = Truth::new(scenario, &scene, &frame, &lanes);
            let dir = match scenario.radars.len() {
                1 => unfinished.clone(),
                _ => unfinished.join(&radar.name),
            };
            fs::create_dir_all(&dir).map_err(|e| Error::io(&dir, e))?;
            write_frame(&dir, &scenario.output, radar, &frame, &truth)?;
            if scenario.output.plots {
                (options.pictures)(scenario, &scene, &frame, &truth, &dir)?;
            }
            let moves = match options.convergence {
                true => convergence(engine, scenario, &scene, which, index)?,
                false => Vec::new(),
            };
            record.push(FrameRecord::of(&radar.name, &frame, moves));
        }
        let text = serde_json::to_string(&record).map_err(|e| Error::Failed(format!("record: {e}")))?;
        fs::write(&note, text).map_err(|e| Error::io(&note, e))?;
        fs::rename(&unfinished, &folder).map_err(|e| Error::io(&folder, e))?;
        records.extend(record);
        (options.progress)(index + 1, resumed);
    }
    if scenario.frames.count > 1 && scenario.output.points && scenario.output.tracks {
        follow::write(staged.path(), scenario)?;
    }
    Manifest {
        catseye: env!("CARGO_PKG_VERSION"),
        engine: engine.report(),
        seed: scenario.seed,
        scenario: options.source.clone(),
        scenario_name: scenario.name.clone(),
        radar: PerRadar::of(&scenario.radars, to_toml)?,
        axes: PerRadar::of(&scenario.radars, |r| Ok(Axes::of(r)))?,
        import: Some(scene.import.clone()),
        frames: records.clone(),
        checksums: Default::default(),
    }
    .write(staged.path())?;
    let folder = staged.commit()?;
    Ok(RunReport { folder, resumed, frames: records })
}

fn read_record(note: &Path) -> Option<Vec<FrameRecord>> {
    serde_json::from_slice(&fs::read(note).ok()?).ok()
}
