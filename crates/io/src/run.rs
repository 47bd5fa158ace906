//! Runs many frames into one folder. Each frame appears under its name when it is complete; an interrupted
//! run continues where it stopped; the folder gets its own name at the very end.

use super::files::{Truth, frame_name, write_frame, write_lidar, write_masks, write_spectra};
use super::follow;
use super::kept_run::KeptRun;
use super::manifest::{Axes, FrameRecord, Manifest, PerRadar, RunTrace, keep_radars};
use catseye::base::control::Control;
use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye::formats::stage::{
    MANIFEST, StagedDir, checksums, files_of, sha256_of_bytes, sha256_of_file, sync_file, sync_folder,
    sync_tree,
};
use catseye::road::glb;
use catseye::road::site::Site;
use catseye::scene::Scene;
use catseye::scene::gltf;
use catseye::scene::radar_toml::to_toml;
use catseye::scene::scenario::{Scenario, SitedScenario};
use catseye::simulate::products::Products;
use catseye::simulate::{Frame, Prepared, convergence};
use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

/// Function that draws the pictures of a frame into a folder.
pub type Pictures<'a> = &'a (dyn Fn(&SitedScenario, &Scene, &Frame, &Truth, &Path) -> Result<()> + Sync);

/// Function that adds files to a run's folder.
pub type Add<'a> = &'a dyn Fn(&Path) -> Result<()>;

/// Options of [`run`].
pub struct RunOptions<'a> {
    /// Kind of result in the folder's manifest; only a folder of the same kind is replaced.
    pub kind: &'static str,
    /// Whether an existing result is replaced.
    pub force: bool,
    /// Whether to measure how far each object's peak moves when the coherent sums are 16 times more accurate.
    pub convergence: bool,
    /// Largest number of frames that are made together, each with all its radars; default [`BATCH`] on a GPU, and one on the CPU,
    /// where no other number changes anything. Memory may allow fewer. The bytes do not depend on it.
    pub batch: Option<usize>,
    /// Run whose echoes the frames are made of; None traces them.
    pub from: Option<&'a KeptRun>,
    /// Rule by which `auto` chose the engine, where it had a choice.
    pub rule: Option<&'static str>,
    /// Text of the scenario file, kept in the manifest.
    pub source: Option<String>,
    /// Function that draws the pictures of a frame into its folder.
    pub pictures: Pictures<'a>,
    /// Function that is called with (frames done, frames among them found complete from an earlier run).
    pub progress: &'a dyn Fn(u32, u32),
    /// Function that adds files to the folder when all else is there, before it gets its name.
    pub add: Option<Add<'a>>,
}

/// Number of frames that share submissions on a GPU where no other number is given.
pub const BATCH: usize = 64;

/// The number of frames that are made together on this engine: what was asked for, or else [`BATCH`] on a GPU; one on the CPU.
pub fn batch_of(engine: &Engine, asked: Option<usize>) -> usize {
    match engine {
        Engine::Cpu(_) => 1,
        Engine::Gpu(_) => asked.unwrap_or(BATCH).max(1),
    }
}

/// Report on a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RunReport {
    /// Folder of the result.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// Number of frames that an interrupted run had left complete.
    pub resumed: u32,
    /// Number of frames of an interrupted run whose files had changed; they were made again.
    pub repaired: u32,
    /// Properties of the scene's meshes that may show in the frames, one line each.
    pub remarks: Vec<String>,
    /// Records of the frames.
    pub frames: Vec<FrameRecord>,
}

/// Data of a complete frame. It is written when all its files would survive a power failure.
#[derive(serde::Serialize, serde::Deserialize)]
struct Note {
    records: Vec<FrameRecord>,
    /// SHA-256 of its files, by path below the frame's folder.
    checksums: BTreeMap<String, String>,
}

/// Runs all frames of the scenario on `engine` into `out`.
///
/// # Errors
/// Returns an error for a folder that holds something else, and the errors of frames and of writing. Complete
/// frames stay.
pub fn run(engine: &Engine, scenario: &Scenario, out: &Path, options: &RunOptions<'_>) -> Result<RunReport> {
    let site = Site::new(scenario)?;
    let (scenario, scene) = (&site.scenario, &site.scene);
    scenario.radars.iter().try_for_each(|r| engine.check_memory(r, 0))?;
    if let Some(from) = options.from {
        from.check(scenario)?;
    }
    let radars = scenario.radars.iter().map(to_toml).collect::<Result<Vec<_>>>()?;
    // All that determines the bytes, including the text of a calibration: a run with another one of these
    // must not continue this folder.
    let identity = sha256_of_bytes(
        format!(
            "{} {:?} {scenario:?} {radars:?} {} {:?} {:?}",
            env!("CARGO_PKG_VERSION"),
            engine.report(),
            options.convergence,
            options.from.map(|from| &from.source),
            scene
        )
        .as_bytes(),
    );
    let (staged, notes) = StagedDir::resumable(out, options.force, options.kind, &identity)?;
    let prepared = Prepared::new(scenario, scene)?;
    let prepared = prepared.making(Products::of_output(&scenario.output));
    let prepared = match options.from {
        Some(from) => prepared
            .recalling(Box::new(|which, index| from.trace(scenario, &scenario.radars[which].name, index))),
        None => prepared,
    };
    let remarks = prepared.remarks()?;
    let mut records = Vec::new();
    let mut sums = BTreeMap::new();
    // Written last: a frame with a note is complete if its files are still the same.
    let note_of = |index: u32| notes.join(format!("{}.json", frame_name(index)));
    let folder_of = |index: u32| staged.path().join(frame_name(index));
    let noted: Vec<Option<Note>> = (0..scenario.frames.count).map(|i| read_note(&note_of(i))).collect();
    let is_whole = |(index, note): (u32, &Option<Note>)| {
        note.as_ref().is_some_and(|n| checksums(folder_of(index)).is_ok_and(|found| found == n.checksums))
    };
    let whole: Vec<bool> = (0..).zip(&noted).map(is_whole).collect();
    let repaired = noted.iter().zip(&whole).filter(|(note, whole)| note.is_some() && !**whole).count() as u32;
    let mut resumed = 0;
    let mut ahead = FramesAhead {
        engine,
        prepared: &prepared,
        most: batch_of(engine, options.batch) * scenario.radars.len(),
        wanted: (0..scenario.frames.count)
            .filter(|index| !whole[*index as usize])
            .flat_map(|index| (0..scenario.radars.len()).map(move |which| (which, index)))
            .collect(),
        made: VecDeque::new(),
    };
    for ((index, note), is_whole) in (0..).zip(noted).zip(whole) {
        let (folder, note_path) = (folder_of(index), note_of(index));
        let keep = |note: Note, records: &mut Vec<FrameRecord>, sums: &mut BTreeMap<String, String>| {
            records.extend(note.records);
            let name = frame_name(index);
            sums.extend(note.checksums.into_iter().map(|(file, sum)| (format!("{name}/{file}"), sum)));
        };
        if let Some(note) = note.filter(|_| is_whole) {
            keep(note, &mut records, &mut sums);
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
            let frame = ahead.next()?;
            let truth = Truth::new(scenario, scene, &frame, site.road.as_ref());
            let dir = match scenario.radars.len() {
                1 => unfinished.clone(),
                _ => unfinished.join(&radar.name),
            };
            fs::create_dir_all(&dir).map_err(|e| Error::io(&dir, e))?;
            write_frame(&dir, &scenario.output, radar, &frame, &truth)?;
            if scenario.output.angle_spectra {
                write_spectra(&dir, engine, radar, &frame)?;
            }
            if scenario.output.masks {
                write_masks(&dir, scene, &frame, &truth)?;
            }
            // The frame has one lidar, whose points stand beside the folders of several radars.
            if scenario.output.lidar && which == 0 {
                write_lidar(&unfinished, scenario, scene, frame.time_s)?;
            }
            if scenario.output.plots {
                (options.pictures)(scenario, scene, &frame, &truth, &dir)?;
            }
            let moves = match options.convergence {
                true => convergence(engine, scenario, scene, which, index)?,
                false => Vec::new(),
            };
            record.push(FrameRecord::of(&radar.name, &frame, moves));
        }
        let note = Note { records: record, checksums: checksums(&unfinished)? };
        sync_tree(&unfinished)?;
        fs::rename(&unfinished, &folder).map_err(|e| Error::io(&folder, e))?;
        sync_folder(staged.path())?;
        let text = serde_json::to_string(&note).map_err(|e| Error::Failed(format!("note: {e}")))?;
        fs::write(&note_path, text).map_err(|e| Error::io(&note_path, e))?;
        sync_file(&note_path)?;
        keep(note, &mut records, &mut sums);
        (options.progress)(index + 1, resumed);
    }
    if scenario.output.scene {
        let path = staged.path().join("scene.glb");
        let glb = match &site.road {
            Some(truth) => glb::to_glb(scene, truth)?,
            None => gltf::to_glb(scene)?,
        };
        fs::write(&path, glb).map_err(|e| Error::io(&path, e))?;
    }
    if scenario.frames.count > 1 && scenario.output.points && scenario.output.tracks {
        follow::write(staged.path(), scenario)?;
    }
    Manifest {
        catseye: env!("CARGO_PKG_VERSION"),
        engine: engine.report(),
        engine_rule: options.rule,
        trace: Some(RunTrace::of(engine.tracing(), &records)),
        echoes_from: options.from.map(|from| from.source.clone()),
        seed: scenario.seed,
        scenario: options.source.clone(),
        scenario_name: scenario.name.clone(),
        radar: keep_radars(staged.path(), &scenario.radars)?,
        axes: PerRadar::of(&scenario.radars, |r| match scenario.output.angle_spectra {
            true => Axes::of(r).with_angles(r),
            false => Ok(Axes::of(r)),
        })?,
        import: Some(scene.import.clone()),
        remarks: remarks.clone(),
        frames: records.clone(),
    }
    .write(staged.path())?;
    if let Some(add) = options.add {
        add(staged.path())?;
    }
    let sums = with_the_rest(staged.path(), sums)?;
    let folder = staged.commit_with(sums)?;
    Ok(RunReport { folder, resumed, repaired, remarks, frames: records })
}

/// Frames in the order in which they are written, made some at a time.
struct FramesAhead<'a> {
    engine: &'a Engine,
    prepared: &'a Prepared<'a>,
    /// Largest number that are made together.
    most: usize,
    /// Radars and numbers of those that are not made yet.
    wanted: VecDeque<(usize, u32)>,
    made: VecDeque<Result<Frame>>,
}

impl FramesAhead<'_> {
    fn next(&mut self) -> Result<Frame> {
        if self.made.is_empty() {
            let some: Vec<(usize, u32)> = self.wanted.iter().take(self.most).copied().collect();
            self.made = self.prepared.frames(self.engine, &some, Control::default()).into();
            self.wanted.drain(..self.made.len());
        }
        self.made.pop_front().unwrap_or_else(|| Err(Error::Failed("no frame is left to be made".into())))
    }
}

fn read_note(path: &Path) -> Option<Note> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Checksums of the frames and of the files beside them. The frames are not read again: what was written
/// counts.
fn with_the_rest(dir: &Path, mut sums: BTreeMap<String, String>) -> Result<BTreeMap<String, String>> {
    for name in files_of(dir)? {
        if name != MANIFEST && !sums.contains_key(&name) {
            sums.insert(name.clone(), sha256_of_file(dir.join(name))?);
        }
    }
    Ok(sums)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::engine::Precision;
    use catseye::scene::radar_toml;
    use catseye::scene::scenario;

    const SCENARIO: &str = "name = \"s\"\nseed = 7\n\
        [[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\nclass = \"car\"\n\
        [frames]\ncount = 2\ninterval_s = 0.1\n[output]\nadc = false\nrange_doppler = false\n";

    /// An ideal array's calibration over the field of view, and one that differs in a digit.
    fn calibration(radar: &catseye::scene::radar::Radar) -> String {
        use catseye::dsp::doa_calibration::{Calibration, TurntableOptions};
        let manifold = catseye::dsp::doa_manifold::Manifold::of_radar(radar).unwrap();
        let azimuth_deg: Vec<f64> = (-14..=14).map(|i| 5.0 * f64::from(i)).collect();
        let snapshots: Vec<Vec<num_complex::Complex64>> =
            azimuth_deg.iter().map(|a| manifold.steering(a.to_radians(), 0.0)).collect();
        let c = Calibration::from_turntable(
            &manifold,
            azimuth_deg,
            vec![0.0],
            None,
            &snapshots,
            &TurntableOptions::default(),
        );
        let mut bytes = Vec::new();
        c.unwrap().write(&mut bytes, &[]).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// What a radar reads beside its file is in the run's folder, and an interrupted run goes on only with the same.
    #[test]
    fn calibrations_are_kept_and_compared() {
        let t = tempfile::tempdir().unwrap();
        let preset =
            include_str!("../../../scenes/presets/demo77.toml").replace("chirps = 128", "chirps = 16");
        let text = calibration(&radar_toml::parse(Path::new("r.toml"), &preset).unwrap());
        let with = preset.replace(
            "azimuth_bins",
            "angle = { method = \"ml\", sources = 1, calibration_file = \"deep/cal.csv\" }\nazimuth_bins",
        );
        fs::create_dir(t.path().join("deep")).unwrap();
        let start = |names: &[&str], text: &str, stop: bool| {
            fs::write(t.path().join("deep/cal.csv"), text).unwrap();
            let mut radars = String::new();
            for name in names {
                let file = format!("{name}.toml");
                fs::write(t.path().join(&file), &with).unwrap();
                radars += &format!("[[radars]]\nname = \"{name}\"\nradar = \"{file}\"\n");
            }
            let scenario = match names {
                [one] => format!("radar = \"{one}.toml\"\n{SCENARIO}"),
                _ => format!("{SCENARIO}{radars}"),
            };
            let scenario = scenario::parse(&t.path().join("s.toml"), &scenario).unwrap();
            let out = t.path().join(names.join("-"));
            let options = RunOptions {
                kind: "run",
                force: true,
                convergence: false,
                batch: None,
                from: None,
                rule: None,
                source: None,
                pictures: &|_, _, frame, _, _| match (stop, frame.index) {
                    (true, 1) => Err(Error::Failed("stopped".into())),
                    _ => Ok(()),
                },
                progress: &|_, _| (),
                add: None,
            };
            run(&Engine::Cpu(Precision::F64), &scenario, &out, &options).map(|r| (r, scenario))
        };
        assert!(start(&["one"], &text, true).is_err());
        // The same text goes on, another does not.
        let other = format!("# measured again\n{text}");
        let (report, scenario) = start(&["one"], &text, false).unwrap();
        assert_eq!((report.resumed, report.frames.len()), (1, 2));
        assert!(start(&["one"], &text, true).is_err());
        let (report, _) = start(&["one"], &other, false).unwrap();
        assert_eq!(report.resumed, 0);
        assert_eq!(fs::read_to_string(report.folder.join("calibration.csv")).unwrap(), other);
        // The manifest's radar is read beside the copy.
        let manifest = |folder: &Path| -> serde_json::Value {
            serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap()
        };
        let kept = manifest(&report.folder);
        assert!(kept["checksums"]["calibration.csv"].is_string());
        assert_eq!(kept["remarks"], serde_json::json!([]));
        let file = report.folder.join("radar.toml");
        let mut back = radar_toml::parse(&file, kept["radar"].as_str().unwrap()).unwrap();
        let read = back.processing.angle.calibration.take().unwrap();
        assert_eq!((read.path, read.text), (report.folder.join("calibration.csv"), other));
        let mut radar = scenario.radars[0].clone();
        radar.processing.angle.calibration = None;
        assert_eq!(to_toml(&back).unwrap(), to_toml(&radar).unwrap());
        // Two radars have one each.
        let (report, _) = start(&["left", "right"], &text, false).unwrap();
        let kept = manifest(&report.folder);
        for name in ["left", "right"] {
            let copy = format!("calibration_{name}.csv");
            assert_eq!(fs::read_to_string(report.folder.join(&copy)).unwrap(), text);
            assert!(kept["radar"][name].as_str().unwrap().contains(&copy), "{kept}");
        }
    }
}
