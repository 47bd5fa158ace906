//! A trained network with its classes: scores of runs, and predictions.

use crate::augment::Move;
use crate::class_aim::{Judged, likeliest, probabilities};
use crate::config::Config;
use crate::detect_task::DetectTask;
use crate::detection::Detected;
use crate::detector::Detector;
use crate::grid_task::GridTask;
use crate::joint::{Joint, smoothed};
use crate::network::Network;
use crate::point_task::PointTask;
use crate::pointnet::PointNet;
use crate::robustness::{RobustnessSet, SETS};
use crate::scan::Scan;
use crate::score::cell;
use crate::segnet::SegNet;
use crate::shipped::{self, Shipped};
use crate::source::Source;
use crate::standing::place_of;
use crate::task::{Aim, Task, Verdict, VerdictOf, judge};
use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
use burn::tensor::Device;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::{check_extension, csv, input, npy, stage};
use catseye::road::mask::CellClass;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Files of a trained network's folder.
pub const WEIGHTS: &str = "weights.bpk";
/// The training's TOML.
pub const CONFIG: &str = "config.toml";
/// Largest file of weights that is read, bytes.
const MOST_BYTES: u64 = 1 << 32;

/// A trained network.
pub struct Model {
    /// The training from which it comes.
    pub config: Config,
    trained: Trained,
    device: Device,
    /// Number of scans that are taken together.
    scans: usize,
}

enum Trained {
    Grids(GridTask, SegNet),
    Objects(DetectTask, Box<Detector>),
    Points(PointTask, Box<PointNet>),
}

/// What was judged of a network, by its kind.
#[derive(Debug, Clone, PartialEq)]
pub enum Evaluation {
    /// Of networks that give each cell or point a class.
    Classes(Judged),
    /// Of networks that predict objects.
    Objects(Detected),
}

impl Evaluation {
    /// What was judged of classes; None of a network that predicts objects.
    pub fn classes(self) -> Option<Judged> {
        match self {
            Evaluation::Classes(judged) => Some(judged),
            Evaluation::Objects(_) => None,
        }
    }

    /// Names of the classes that have figures.
    pub fn names(&self) -> &[String] {
        match self {
            Evaluation::Classes(judged) => judged.names(),
            Evaluation::Objects(detected) => detected.names(),
        }
    }

    /// The figure of each class by which trainings are compared: F1, or the average precision at an intersection over union of 0.5.
    pub fn figures(&self) -> Vec<Option<f64>> {
        match self {
            Evaluation::Classes(judged) => judged.figures(),
            Evaluation::Objects(detected) => detected.figures(),
        }
    }

    /// What was judged of objects; None of a network that gives classes.
    pub fn objects(self) -> Option<Detected> {
        match self {
            Evaluation::Classes(_) => None,
            Evaluation::Objects(detected) => Some(detected),
        }
    }
}

/// Reads weights into a network of the same shape.
///
/// # Errors
/// Returns an error if the file cannot be read, and `BadInput` if it holds the weights of another network.
pub fn load_weights<N: Module>(net: N, path: &Path) -> Result<N> {
    weights_of(net, path, input::read(path, "a file of weights", MOST_BYTES)?)
}

/// Puts weights into a network of the same shape; `path` is named in errors.
fn weights_of<N: Module>(net: N, path: &Path, bytes: Vec<u8>) -> Result<N> {
    let record = ModuleRecord::from_bytes(burn::tensor::Bytes::from_bytes_vec(bytes));
    record.and_then(|r| net.try_load_record(r)).map_err(|e| foreign(path, &e))
}

/// The complaint about a file that holds no such weights or states.
pub fn foreign(path: &Path, e: &RecordError) -> Error {
    let problem = format!("does not fit the network: {e}");
    BadInput::new(problem).file(path).remedy("train it again, or use the folder as catseye wrote it").into()
}

impl Model {
    /// Opens the folder that a training wrote, or where there is none of this name, the network of this name that comes with
    /// the program ([`crate::shipped`]). A relative folder is looked for in `base`.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder holds no trained network, or if there is neither such a folder nor such a network.
    pub fn open(base: &Path, place: &Path, device: &Device) -> Result<Model> {
        let dir = base.join(place);
        match place.to_str().and_then(shipped::find) {
            Some(network) if !dir.exists() => Model::shipped(network, device),
            _ => Model::load(&dir, device),
        }
    }

    /// Opens a network that comes with the program.
    ///
    /// # Errors
    /// Returns the errors of its file and its weights, which a test opens.
    pub fn shipped(network: &Shipped, device: &Device) -> Result<Model> {
        let dir = Path::new(network.name);
        let config = Config::parse(&dir.join(CONFIG), network.config.to_string())?;
        Model::of(config, &dir.join(WEIGHTS), network.weights.to_vec(), device)
    }

    /// Opens the folder that a training wrote.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder holds no trained network.
    pub fn load(dir: &Path, device: &Device) -> Result<Model> {
        if !dir.join(CONFIG).is_file() || !dir.join(WEIGHTS).is_file() {
            let bad = BadInput::new("does not contain a trained network").file(dir);
            let names = shipped::names();
            let remedy = format!(
                "give a folder that catseye learn train wrote, or the name of a shipped network: {names}"
            );
            return Err(bad.remedy(remedy).into());
        }
        let config = Config::read(&dir.join(CONFIG))?;
        let weights = dir.join(WEIGHTS);
        let bytes = input::read(&weights, "a file of weights", MOST_BYTES)?;
        Model::of(config, &weights, bytes, device)
    }

    /// The network of a training with its weights; `weights` is the file that errors name.
    fn of(config: Config, weights: &Path, bytes: Vec<u8>, device: &Device) -> Result<Model> {
        let device = device.clone().without_autodiff();
        let trained = match &config.network {
            Network::Grids(network) => {
                let task = GridTask::new(&config, network, config.grid()?)?;
                let net = weights_of(task.net(0, &device).valid(), weights, bytes)?;
                Trained::Grids(task, net)
            }
            Network::Objects(network) => {
                let task = DetectTask::new(&config, network, config.grid()?)?;
                let net = weights_of(task.net(0, &device).valid(), weights, bytes)?;
                Trained::Objects(task, Box::new(net))
            }
            Network::Points(network) => {
                let task = PointTask::new(&config, network)?;
                let net = weights_of(task.net(0, &device).valid(), weights, bytes)?;
                Trained::Points(task, Box::new(net))
            }
        };
        Ok(Model { config, trained, device, scans: 1 })
    }

    /// The task of a network that gives each cell of a grid a class; None for another network.
    pub fn grids(&self) -> Option<&GridTask> {
        match &self.trained {
            Trained::Grids(task, _) => Some(task),
            Trained::Objects(..) | Trained::Points(..) => None,
        }
    }

    /// What a network that gives each cell of a grid a class says of a scan, `[cell, class]`; empty for another network.
    pub fn cell_probabilities(&self, scan: &Scan) -> Vec<f32> {
        match &self.trained {
            Trained::Grids(task, net) => {
                probabilities(task.outputs(net, &[&task.seen_of(scan)], &self.device))
            }
            Trained::Objects(..) | Trained::Points(..) => Vec::new(),
        }
    }

    /// Takes so many scans of a radar together, 1 to 100: the joint probability of the last ones in each cell, after which gaps of lanes
    /// are closed and their outliers taken away. The frames of a scene must follow each other.
    ///
    /// # Errors
    /// Returns `BadInput` for another number, and for a detector or a network of points: what these say of a scan, a later one does not
    /// say of the same cells.
    pub fn with_scans(mut self, scans: usize) -> Result<Model> {
        let bad = |problem: &str, allowed: &str| {
            BadInput::new(problem).key("--scans").value(scans).allowed(allowed.to_string())
        };
        if !(1..=100).contains(&scans) {
            return Err(bad("is out of range", "1 to 100").into());
        }
        let alone = match self.trained {
            Trained::Grids(..) => None,
            Trained::Objects(..) => Some("a detector uses one scan"),
            Trained::Points(..) => Some("a network of points uses one scan"),
        };
        if let Some(problem) = alone.filter(|_| scans > 1) {
            return Err(bad(problem, "1").remedy("leave it out").into());
        }
        self.scans = scans;
        Ok(self)
    }

    /// Scores what the network says of runs and datasets with truth: masks for grids and objects, labels of points for points.
    ///
    /// # Errors
    /// Returns the errors of [`Task::find`] and [`Task::read`].
    pub fn evaluate(&self, runs: &[PathBuf]) -> Result<Evaluation> {
        Ok(match &self.trained {
            Trained::Grids(task, net) if self.scans == 1 => {
                Evaluation::Classes(evaluate(task, net, &self.device, runs)?)
            }
            Trained::Grids(task, net) => {
                let mut judged = Judged::new(&task.classes().names());
                let mut joined = Joined::new(task, self.scans);
                for source in task.find(runs)? {
                    let (seen, labels) = task.given(&task.read(&source)?, &Move::NONE);
                    let single = probabilities(task.outputs(net, &[&seen], &self.device));
                    let (p, found) = joined.say(&source, &single)?;
                    judged.add_decided(&labels, &p, found.into_iter().map(usize::from));
                }
                Evaluation::Classes(judged)
            }
            Trained::Objects(task, net) => Evaluation::Objects(evaluate(task, net, &self.device, runs)?),
            Trained::Points(task, net) => Evaluation::Classes(evaluate(task, net, &self.device, runs)?),
        })
    }

    /// Scores what the network says of so many made-up scans of each set of table 5.6 of Feng (2019).
    ///
    /// # Errors
    /// Returns `BadInput` for a detector or a network of points, and for a network that knows no lanes.
    pub fn robustness(&self, pictures: u32, seed: u32) -> Result<Vec<(RobustnessSet, Judged)>> {
        let names = &self.config.data.classes.value;
        let lane = CellClass::Lane.name();
        let Trained::Grids(task, net) = &self.trained else {
            let bad = BadInput::new(
                "the sets of table 5.6 need classes of cells, which this network does not predict",
            );
            return Err(bad.key("network.kind").allowed("segnet").into());
        };
        if !names.iter().any(|n| n == lane) {
            let bad =
                BadInput::new("the sets of table 5.6 need the class lane, which this network does not have");
            return Err(bad.key("data.classes").value(names.join(", ")).into());
        }
        let judged = |set: RobustnessSet| {
            let mut judged = Judged::new(&task.classes().names());
            let given = (0..pictures).map(|k| task.given(&set.example(task.kind(), seed, k), &Move::NONE));
            judge(task, net, &self.device, given, &mut judged);
            (set, judged)
        };
        Ok(SETS.into_iter().map(judged).collect())
    }

    /// Writes what the network says of a run or a dataset, whose truth it does not look at, and returns the number of frames.
    ///
    /// Of grids a `.npy` file, uint8 `[frame, row, column]`, the numbers of [`CellClass`], at the
    /// scale of the training. Of points a `.csv` table with a row for each point: `frame`, `radar` (empty where a frame has one),
    /// `point` (its row in the frame's table, from 0), `class` and the `probability` of this class. Of a detector a `.csv` table with a
    /// row for each object: `frame`, `radar`, `class`, `confidence`, and the corners `x1_m`, `y1_m` to `x4_m`, `y4_m` in the level
    /// axes of the radar.
    ///
    /// # Errors
    /// Returns `BadInput` if the run holds no grids or points, the file is of the wrong kind, or it exists and `force` is false, and an
    /// error if it cannot be written.
    pub fn predict(&self, run: &Path, out: &Path, force: bool) -> Result<usize> {
        let runs = [run.to_path_buf()];
        match &self.trained {
            Trained::Grids(task, net) => {
                check_extension(out, &["npy"])?;
                let staged = stage::StagedFile::new(out, force)?;
                let frames = task.find(&runs)?;
                let (mut cells, mut size) = (Vec::new(), [0, 0]);
                let mut joined = Joined::new(task, self.scans);
                for frame in &frames {
                    let seen = task.seen(frame)?;
                    let [_, rows, columns] = seen.shape();
                    size = [rows, columns];
                    let p = probabilities(task.outputs(net, &[&seen], &self.device));
                    let found: Vec<u8> = match self.scans {
                        1 => likeliest(&p, task.classes().count()).map(|f| f.0 as u8).collect(),
                        _ => joined.say(frame, &p)?.1,
                    };
                    cells.extend(found.iter().map(|place| task.classes().class((*place).into()) as u8));
                }
                npy::write(staged.path(), &[frames.len(), size[0], size[1]], &cells)?;
                staged.commit()?;
                Ok(frames.len())
            }
            Trained::Objects(task, net) => {
                check_extension(out, &["csv"])?;
                let staged = stage::StagedFile::new(out, force)?;
                let frames = task.find(&runs)?;
                self.write_objects(task, net, &frames, staged.path())?;
                staged.commit()?;
                Ok(frames.len())
            }
            Trained::Points(task, net) => {
                check_extension(out, &["csv"])?;
                let staged = stage::StagedFile::new(out, force)?;
                let frames = task.find(&runs)?;
                self.write_points(task, net, &frames, staged.path())?;
                staged.commit()?;
                Ok(frames.len())
            }
        }
    }

    fn write_objects(&self, task: &DetectTask, net: &Detector, frames: &[Source], path: &Path) -> Result<()> {
        let io = |e| Error::io(path, e);
        let file = BufWriter::new(File::create(path).map_err(io)?);
        let mut header: Vec<String> = ["frame", "radar", "class", "confidence"].map(String::from).to_vec();
        header.extend((1..=4).flat_map(|k| [format!("x{k}_m"), format!("y{k}_m")]));
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let mut table = csv::Writer::new(file, &[], &header).map_err(io)?;
        let names = task.classes().names();
        for frame in frames {
            let (number, radar) = frame.name();
            let outputs = task.outputs(net, &[&task.seen(frame)?], &self.device);
            for d in task.aim().found(outputs) {
                let numbers = d.quad.corners().iter().flat_map(|c| [c.x, c.y]).map(|v| cell(Some(v)));
                let numbers: Vec<String> =
                    std::iter::once(cell(Some(d.confidence.into()))).chain(numbers).collect();
                let mut row: Vec<&dyn Display> = vec![&number, &radar, &names[usize::from(d.class)]];
                row.extend(numbers.iter().map(|n| n as &dyn Display));
                table.row(row).map_err(io)?;
            }
        }
        table.finish().map_err(io)?;
        Ok(())
    }

    fn write_points(&self, task: &PointTask, net: &PointNet, frames: &[Source], path: &Path) -> Result<()> {
        let io = |e| Error::io(path, e);
        let file = BufWriter::new(File::create(path).map_err(io)?);
        let header = ["frame", "radar", "point", "class", "probability"];
        let mut table = csv::Writer::new(file, &[], &header).map_err(io)?;
        let names = task.classes().names();
        for frame in frames {
            let seen = task.seen(frame)?;
            if seen.points() == 0 {
                continue;
            }
            let p = probabilities(task.outputs(net, &[&seen], &self.device));
            let (number, radar) = frame.name();
            for (point, (place, share)) in likeliest(&p, names.len()).enumerate() {
                let row: [&dyn Display; 5] =
                    [&number, &radar, &point, &names[place], &cell(Some(share.into()))];
                table.row(row).map_err(io)?;
            }
        }
        table.finish().map_err(io)?;
        Ok(())
    }
}

/// Scans that are taken together, of each radar those of its scene.
struct Joined<'a> {
    task: &'a GridTask,
    most: usize,
    scene: usize,
    radars: BTreeMap<String, Joint>,
}

impl<'a> Joined<'a> {
    fn new(task: &'a GridTask, most: usize) -> Joined<'a> {
        Joined { task, most, scene: 0, radars: BTreeMap::new() }
    }

    /// Adds what a network says of one frame, `[cell, class]`; gives the joint probabilities and the classes that are decided by them.
    fn say(&mut self, source: &Source, single: &[f32]) -> Result<(Vec<f32>, Vec<u8>)> {
        if source.scene != self.scene {
            self.radars.clear();
            self.scene = source.scene;
        }
        let (classes, cells) = (self.task.classes(), self.task.cells());
        let new = || Joint::new(cells, classes.count(), self.most);
        let joint = self.radars.entry(source.name().1).or_insert_with(new);
        let p = joint.add(place_of(source)?, single);
        let found: Vec<u8> = likeliest(&p, classes.count()).map(|f| f.0 as u8).collect();
        let lane = (0..classes.count()).find(|k| classes.class(*k) == CellClass::Lane);
        let found = match lane {
            Some(lane) => smoothed(&found, cells.rows, cells.columns, lane as u8),
            None => found,
        };
        Ok((p, found))
    }
}

fn evaluate<T: Task>(task: &T, net: &T::Net, device: &Device, runs: &[PathBuf]) -> Result<VerdictOf<T>> {
    let mut judged = task.aim().verdict();
    for source in task.find(runs)? {
        let given = task.given(&task.read(&source)?, &Move::NONE);
        judge(task, net, device, [given], &mut judged);
    }
    Ok(judged)
}
