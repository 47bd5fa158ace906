//! A trained network with its classes: scores of runs, and predictions.

use crate::augment::Move;
use crate::config::Config;
use crate::curve::Curves;
use crate::data::Labels;
use crate::grid_task::GridTask;
use crate::joint::{Joint, smoothed};
use crate::network::Network;
use crate::point_task::PointTask;
use crate::pointnet::PointNet;
use crate::robustness::{RobustnessSet, SETS};
use crate::scan::Scan;
use crate::score::{Confusion, cell};
use crate::segnet::SegNet;
use crate::shipped::{self, Shipped};
use crate::source::Source;
use crate::standing::place_of;
use crate::task::Task;
use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};
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
    Points(PointTask, Box<PointNet>),
}

/// The probability of each class of each item, `[item, class]`.
pub fn probabilities(scores: Tensor<2>) -> Vec<f32> {
    softmax(scores, 1).into_data().try_to_vec::<f32>().unwrap_or_default()
}

/// The likeliest class of each item, the first of equal ones, and its probability, of probabilities `[item, class]`.
pub fn likeliest(probabilities: &[f32], classes: usize) -> impl Iterator<Item = (usize, f32)> {
    probabilities.chunks_exact(classes.max(1)).map(|of| {
        let best = (1..of.len()).fold(0, |best, k| if of[k] > of[best] { k } else { best });
        (best, of[best])
    })
}

/// How well a network tells the classes apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Cells or points by their true and their likeliest class.
    pub confusion: Confusion,
    /// Precision over recall.
    pub curves: Curves,
}

impl Judged {
    /// Nothing was judged yet.
    pub fn new(classes: &[String]) -> Judged {
        Judged { confusion: Confusion::new(classes), curves: Curves::new(classes) }
    }

    /// Counts the items of one frame: their true classes, and the probabilities `[item, class]`.
    pub fn add(&mut self, labels: &Labels, probabilities: &[f32]) {
        let found = likeliest(probabilities, self.curves.classes().len());
        self.add_decided(labels, probabilities, found.map(|f| f.0));
    }

    /// The same where the classes were decided otherwise than by the largest probability.
    fn add_decided(
        &mut self,
        labels: &Labels,
        probabilities: &[f32],
        found: impl IntoIterator<Item = usize>,
    ) {
        let classes = self.curves.classes().len();
        for (truth, of) in labels.places().iter().zip(probabilities.chunks_exact(classes)) {
            self.curves.add((*truth).into(), of.iter().copied());
        }
        labels.places().iter().zip(found).for_each(|(t, p)| self.confusion.add((*t).into(), p));
    }
}

/// Judges what a network says of frames whose labels are known. The network is one without gradients.
pub fn judge<T: Task>(
    task: &T,
    net: &T::Net,
    device: &Device,
    given: impl IntoIterator<Item = (T::Seen, Labels)>,
    judged: &mut Judged,
) {
    for (seen, labels) in given {
        if !labels.places().is_empty() {
            judged.add(&labels, &probabilities(task.scores(net, &[&seen], device)));
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
    BadInput::new(problem).file(path).remedy("train it again, or take the folder as catseye wrote it").into()
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
            let bad = BadInput::new("holds no trained network").file(dir);
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
            Network::Points(network) => {
                let task = PointTask::new(&config, network)?;
                let net = weights_of(task.net(0, &device).valid(), weights, bytes)?;
                Trained::Points(task, Box::new(net))
            }
        };
        Ok(Model { config, trained, device, scans: 1 })
    }

    /// The task of a network of grids; None for a network of points.
    pub fn grids(&self) -> Option<&GridTask> {
        match &self.trained {
            Trained::Grids(task, _) => Some(task),
            Trained::Points(..) => None,
        }
    }

    /// What a network of grids says of a scan, `[cell, class]`; empty for a network of points.
    pub fn cell_probabilities(&self, scan: &Scan) -> Vec<f32> {
        match &self.trained {
            Trained::Grids(task, net) => {
                probabilities(task.scores(net, &[&task.seen_of(scan)], &self.device))
            }
            Trained::Points(..) => Vec::new(),
        }
    }

    /// Takes so many scans of a radar together, 1 to 100: the joint probability of the last ones in each cell, after which gaps of lanes
    /// are closed and their outliers taken away. The frames of a scene must follow each other.
    ///
    /// # Errors
    /// Returns `BadInput` for another number, and for a network of points, which a later scan does not see again.
    pub fn with_scans(mut self, scans: usize) -> Result<Model> {
        let bad = |problem: &str, allowed: &str| {
            BadInput::new(problem).key("--scans").value(scans).allowed(allowed.to_string())
        };
        if !(1..=100).contains(&scans) {
            return Err(bad("is out of range", "1 to 100").into());
        }
        if scans > 1 && matches!(self.trained, Trained::Points(..)) {
            return Err(bad("a network of points looks at one scan", "1").remedy("leave it out").into());
        }
        self.scans = scans;
        Ok(self)
    }

    /// Scores what the network says of runs and datasets with truth: masks for grids, labels of points for points.
    ///
    /// # Errors
    /// Returns the errors of [`Task::find`] and [`Task::read`].
    pub fn evaluate(&self, runs: &[PathBuf]) -> Result<Judged> {
        match &self.trained {
            Trained::Grids(task, net) if self.scans == 1 => evaluate(task, net, &self.device, runs),
            Trained::Grids(task, net) => {
                let mut judged = Judged::new(&task.classes().names());
                let mut joined = Joined::new(task, self.scans);
                for source in task.find(runs)? {
                    let (seen, labels) = task.given(&task.read(&source)?, &Move::NONE);
                    let single = probabilities(task.scores(net, &[&seen], &self.device));
                    let (p, found) = joined.say(&source, &single)?;
                    judged.add_decided(&labels, &p, found.into_iter().map(usize::from));
                }
                Ok(judged)
            }
            Trained::Points(task, net) => evaluate(task, net, &self.device, runs),
        }
    }

    /// Scores what the network says of so many made-up scans of each set of table 5.6 of Feng (2019).
    ///
    /// # Errors
    /// Returns `BadInput` for a network of points, and for one that knows no lanes.
    pub fn robustness(&self, pictures: u32, seed: u32) -> Result<Vec<(RobustnessSet, Judged)>> {
        let names = &self.config.data.classes.value;
        let lane = CellClass::Lane.name();
        let Trained::Grids(task, net) = &self.trained else {
            let bad =
                BadInput::new("the sets of table 5.6 are scans of grids, and this is a network of points");
            return Err(bad.key("network.kind").allowed("segnet").into());
        };
        if !names.iter().any(|n| n == lane) {
            let bad = BadInput::new("the sets of table 5.6 are of lanes, which this network does not know");
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
    /// `point` (its row in the frame's table, from 0), `class` and the `probability` of this class.
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
                    let p = probabilities(task.scores(net, &[&seen], &self.device));
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
            let p = probabilities(task.scores(net, &[&seen], &self.device));
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

fn evaluate<T: Task>(task: &T, net: &T::Net, device: &Device, runs: &[PathBuf]) -> Result<Judged> {
    let mut judged = Judged::new(&task.classes().names());
    for source in task.find(runs)? {
        let given = task.given(&task.read(&source)?, &Move::NONE);
        judge(task, net, device, [given], &mut judged);
    }
    Ok(judged)
}
