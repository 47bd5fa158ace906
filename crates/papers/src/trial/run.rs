//! `catseye lane`: one method on one scenario, into one folder, resumable.

use super::compare::Rival;
use super::report::{Row, Trial};
use super::{
    Drive, Given, Watch, camera_fusion, hd_map, markers, range_doppler, road_shape, settings, signature, uwb,
};
use catseye::engine::{Engine, EngineReport};
use catseye::error::{BadInput, Error, Result};
use catseye::formats::stage::{StagedDir, sha256_of_bytes};
use catseye::scene::scenario::Scenario;
use catseye::scene::toml_file::read_text;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A method of [`catseye_lane`], as on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Impulse radar that looks down at metal plates (Kim 2020)
    Uwb,
    /// Rows of markers among the points (Feng 2019, section 5.1)
    Markers,
    /// Place in a marked lane from the range-Doppler map alone (Feng 2019, section 3.6)
    RangeDoppler,
    /// Map of static points, the place in it, code words (Feng 2019, section 4.3)
    Signature,
    /// Road edges by MUSIC and a clothoid filter (Miyake)
    RoadShape,
    /// Lane numbers by radar tracks and a map (Li 2022)
    HdMap,
    /// Camera near, radar tracks far (Sangeetha Lakshmi)
    CameraFusion,
}

impl Method {
    pub const ALL: [Method; 7] = [
        Method::Uwb,
        Method::Markers,
        Method::RangeDoppler,
        Method::Signature,
        Method::RoadShape,
        Method::HdMap,
        Method::CameraFusion,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Method::Uwb => "uwb",
            Method::Markers => "markers",
            Method::RangeDoppler => "range-doppler",
            Method::Signature => "signature",
            Method::RoadShape => "road-shape",
            Method::HdMap => "hd-map",
            Method::CameraFusion => "camera-fusion",
        }
    }

    /// Errors: a name that no method has.
    pub fn named(name: &str) -> Result<Method> {
        let known = || Method::ALL.map(Method::name).join(", ");
        Method::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            BadInput::new("is no lane method").key("method").value(name).allowed(known()).into()
        })
    }
}

/// The table `[lane]` of a scenario file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LaneTable {
    /// How often the drive is made, each time with another seed. Default 1.
    pub runs: Option<u32>,
    pub uwb: uwb::Settings,
    pub markers: markers::Settings,
    pub range_doppler: range_doppler::Settings,
    pub signature: signature::Settings,
    pub road_shape: road_shape::Settings,
    pub hd_map: hd_map::Settings,
    pub camera_fusion: camera_fusion::Settings,
}

impl LaneTable {
    /// Of a scenario file. Errors: keys and values that are not known or not allowed.
    pub fn load(path: &Path) -> Result<LaneTable> {
        let table: LaneTable = settings(path)?;
        let checked = [
            table.uwb.check(),
            table.markers.check(),
            table.range_doppler.check(),
            table.signature.check(),
            table.road_shape.check(),
            table.hd_map.check(),
            table.camera_fusion.check(),
        ];
        for check in checked {
            check.map_err(|e| match e {
                Error::Input(b) => BadInput { file: b.file.clone().or(Some(path.into())), ..*b }.into(),
                e => e,
            })?;
        }
        if table.runs.is_some_and(|n| !(1..=10_000).contains(&n)) {
            let n = table.runs.unwrap_or(0);
            return Err(BadInput::new("is no number of drives")
                .file(path)
                .key("lane.runs")
                .value(n)
                .allowed("1..=10000")
                .into());
        }
        Ok(table)
    }

    /// The method ready for a drive of a comparison, by variant: one, or one for each choice of sensors and light.
    ///
    /// Errors: what the scenario lacks for it, as bad input.
    pub(super) fn rivals(
        &self,
        method: Method,
        given: &Given<'_>,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<Vec<(String, Rival)>> {
        let only = |rival: Rival| vec![(String::new(), rival)];
        match method {
            Method::Uwb => uwb::rival(given, &self.uwb, drive, run).map(only),
            Method::Markers => markers::rival(given, &self.markers, drive, run).map(only),
            Method::RangeDoppler => range_doppler::rival(given, &self.range_doppler, drive, run).map(only),
            Method::Signature => signature::rival(given, &self.signature, drive, run).map(only),
            Method::RoadShape => {
                road_shape::rival(given, &self.road_shape, drive, run).map(|r| vec![("road edges".into(), r)])
            }
            Method::HdMap => hd_map::rival(given, &self.hd_map, drive, run).map(only),
            Method::CameraFusion => camera_fusion::rivals(given, &self.camera_fusion, drive, run),
        }
    }

    /// Drives the scenario and lets the method say what it finds.
    pub fn trial(&self, method: Method, given: &Given<'_>) -> Result<Trial> {
        match method {
            Method::Uwb => uwb::run(given, &self.uwb),
            Method::Markers => markers::run(given, &self.markers),
            Method::RangeDoppler => range_doppler::run(given, &self.range_doppler),
            Method::Signature => signature::run(given, &self.signature),
            Method::RoadShape => road_shape::run(given, &self.road_shape),
            Method::HdMap => hd_map::run(given, &self.hd_map),
            Method::CameraFusion => camera_fusion::run(given, &self.camera_fusion),
        }
    }
}

/// JSON schemas of radar and scenario files, the table `[lane]` with them: (file name in `schema/`, text).
pub fn schemas() -> [(&'static str, String); 2] {
    catseye::scene::scenario::schemas(|g| g.subschema_for::<LaneTable>())
}

/// How to run.
pub struct RunOptions<'a> {
    pub force: bool,
    /// In place of the scenario's.
    pub runs: Option<u32>,
    pub frames: Option<u32>,
    pub seed: Option<u64>,
    pub watch: Watch<'a>,
}

/// What a run left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    pub folder: PathBuf,
    pub method: String,
    pub title: String,
    pub rows: Vec<Row>,
    pub notes: Vec<String>,
}

/// The folder's `manifest.json`.
#[derive(Serialize)]
struct Manifest<'a> {
    catseye: &'a str,
    engine: EngineReport,
    command: &'a str,
    seed: u64,
    runs: u32,
    /// Texts of the scenario files.
    scenarios: BTreeMap<String, String>,
    /// That one look took the estimator, on the machine that ran it: median and worst, by method.
    seconds_per_look: BTreeMap<String, [f64; 2]>,
}

/// A folder under construction for a command over some scenario files, and where its finished frames are kept.
pub(super) struct Workshop {
    staged: StagedDir,
    pub keep: PathBuf,
}

impl Workshop {
    pub fn open(
        command: &str,
        paths: &[&Path],
        engine: &Engine,
        out: &Path,
        o: &RunOptions<'_>,
    ) -> Result<Self> {
        // Whatever decides on the bytes: another one of these does not go on where this stopped.
        let mut identity = format!(
            "{} {command} {:?} {:?} {:?} {:?}",
            env!("CARGO_PKG_VERSION"),
            engine.report(),
            o.runs,
            o.frames,
            o.seed
        );
        for path in paths {
            identity += &read_text(path)?;
        }
        let (staged, keep) =
            StagedDir::resumable(out, o.force, "lane", &sha256_of_bytes(identity.as_bytes()))?;
        Ok(Workshop { staged, keep })
    }

    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Adds the manifest and gives the folder its name.
    pub fn finish(
        self,
        engine: &Engine,
        command: &str,
        (seed, runs): (u64, u32),
        paths: &[&Path],
        trials: &[(String, &Trial)],
    ) -> Result<PathBuf> {
        let dir = self.staged.path();
        let mut scenarios = BTreeMap::new();
        for path in paths {
            let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            scenarios.insert(name, read_text(path)?);
        }
        let mut seconds: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (name, trial) in trials {
            seconds.entry(name.clone()).or_default().extend(trial.steps.iter().map(|s| s.seconds));
        }
        let middle = |mut v: Vec<f64>| {
            v.sort_by(f64::total_cmp);
            [v.get(v.len() / 2).copied().unwrap_or(0.0), v.last().copied().unwrap_or(0.0)]
        };
        let manifest = Manifest {
            catseye: env!("CARGO_PKG_VERSION"),
            engine: engine.report(),
            command,
            seed,
            runs,
            scenarios,
            seconds_per_look: seconds.into_iter().map(|(k, v)| (k, middle(v))).collect(),
        };
        let text =
            serde_json::to_vec_pretty(&manifest).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        let path = dir.join("manifest.json");
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
        self.staged.commit()
    }
}

/// The scenario of a file with what the caller changes.
pub(super) fn scenario(path: &Path, o: &RunOptions<'_>) -> Result<Scenario> {
    let mut scenario = Scenario::load(path)?;
    if let Some(n) = o.frames {
        scenario.frames.count = n;
    }
    if let Some(seed) = o.seed {
        scenario.seed = seed;
    }
    Ok(scenario)
}

/// Runs a method on a scenario file into `out`. An interrupted run goes on when the same is asked for again.
///
/// Errors: those of the files; a scenario that the method cannot take, with what it lacks.
pub fn run(
    engine: &Engine,
    method: Method,
    path: &Path,
    out: &Path,
    o: &RunOptions<'_>,
) -> Result<RunReport> {
    let table = LaneTable::load(path)?;
    let scenario = scenario(path, o)?;
    let runs = o.runs.or(table.runs).unwrap_or(1);
    let command = format!("lane {}", method.name());
    let shop = Workshop::open(&command, &[path], engine, out, o)?;
    let given =
        Given { scenario: &scenario, path, engine, runs, keep: Some(shop.keep.clone()), watch: o.watch };
    let trial = table.trial(method, &given)?;
    trial.write(shop.path())?;
    let trials = [(method.name().to_string(), &trial)];
    let folder = shop.finish(engine, &command, (scenario.seed, runs), &[path], &trials)?;
    Ok(RunReport { folder, method: trial.method, title: trial.title, rows: trial.rows, notes: trial.notes })
}
