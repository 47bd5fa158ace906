//! A trained network with its classes: scores of runs, and predictions.

use crate::augment::Move;
use crate::config::Config;
use crate::curve::Curves;
use crate::data::{Classes, Example, Features, Labels, Scan};
use crate::score::Confusion;
use crate::segnet::SegNet;
use crate::source::{Source, sources};
use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor, TensorData};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::{input, npy, stage};
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
    classes: Classes,
    net: SegNet,
    device: Device,
}

/// Joins grids of one size into one tensor, `[picture, plane, row, column]`.
///
/// # Panics
/// Panics if the list is empty or the grids are of different sizes, which one model never gives.
pub fn stacked(features: &[&Features], device: &Device) -> Tensor<4> {
    let [planes, rows, columns] = features[0].shape();
    let values: Vec<f32> = features.iter().flat_map(|f| f.values()).copied().collect();
    Tensor::from_data(TensorData::new(values, [features.len(), planes, rows, columns]), device)
}

/// The probability of each class in each cell, `[picture, class, row, column]`.
pub fn probabilities(scores: Tensor<4>) -> Vec<f32> {
    softmax(scores, 1).into_data().try_to_vec::<f32>().unwrap_or_default()
}

/// The likeliest class of each cell of one picture, the first of equal ones, of probabilities `[class, cell]`.
pub fn likeliest(probabilities: &[f32], classes: usize) -> impl Iterator<Item = usize> {
    let cells = probabilities.len() / classes.max(1);
    (0..cells).map(move |cell| {
        let of = |class: usize| probabilities[class * cells + cell];
        (1..classes).fold(0, |best, k| if of(k) > of(best) { k } else { best })
    })
}

/// How well a network tells the classes apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Cells by their true and their likeliest class.
    pub confusion: Confusion,
    /// Precision over recall.
    pub curves: Curves,
}

impl Judged {
    /// Nothing was judged yet.
    pub fn new(classes: &[String]) -> Judged {
        Judged { confusion: Confusion::new(classes), curves: Curves::new(classes) }
    }

    /// Counts the cells of one picture: their true classes, and the probabilities `[class, cell]`.
    pub fn add(&mut self, labels: &Labels, probabilities: &[f32]) {
        let cells = labels.places().len();
        for (cell, truth) in labels.places().iter().enumerate() {
            self.curves.add((*truth).into(), probabilities.iter().skip(cell).step_by(cells).copied());
        }
        let found = likeliest(probabilities, probabilities.len() / cells);
        labels.places().iter().zip(found).for_each(|(t, p)| self.confusion.add((*t).into(), p));
    }
}

/// Judges what a network says of grids whose labels are known. The network is one without gradients.
pub fn judge(
    net: &SegNet,
    device: &Device,
    given: impl IntoIterator<Item = (Features, Labels)>,
    judged: &mut Judged,
) {
    for (features, labels) in given {
        judged.add(&labels, &probabilities(net.forward(stacked(&[&features], device))));
    }
}

/// Reads weights into a network of the same shape.
///
/// # Errors
/// Returns an error if the file cannot be read, and `BadInput` if it holds the weights of another network.
pub fn load_weights(net: SegNet, path: &Path) -> Result<SegNet> {
    let bytes = input::read(path, "a file of weights", MOST_BYTES)?;
    let record = ModuleRecord::from_bytes(burn::tensor::Bytes::from_bytes_vec(bytes));
    record.and_then(|r| net.try_load_record(r)).map_err(|e| foreign(path, &e))
}

/// The complaint about a file that holds no such weights or states.
pub fn foreign(path: &Path, e: &RecordError) -> Error {
    let problem = format!("does not fit the network: {e}");
    BadInput::new(problem).file(path).remedy("train it again, or take the folder as catseye wrote it").into()
}

impl Model {
    /// Opens the folder that a training wrote.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder holds no trained network.
    pub fn load(dir: &Path, device: &Device) -> Result<Model> {
        if !dir.join(CONFIG).is_file() || !dir.join(WEIGHTS).is_file() {
            let bad = BadInput::new("holds no trained network").file(dir);
            return Err(bad.remedy("give a folder that catseye learn train wrote").into());
        }
        let config = Config::read(&dir.join(CONFIG))?;
        let device = device.clone().without_autodiff();
        let net = SegNet::new(config.shape(), config.training.seed, &device).valid();
        let net = load_weights(net, &dir.join(WEIGHTS))?;
        Ok(Model { classes: config.classes()?, config, net, device })
    }

    /// Scores what the network says of runs and datasets with masks.
    ///
    /// # Errors
    /// Returns the errors of [`sources`] and [`Example::read`].
    pub fn evaluate(&self, runs: &[PathBuf]) -> Result<Judged> {
        let d = &self.config.data;
        let mut judged = Judged::new(&self.classes.names());
        for source in sources(runs, d.grid)? {
            let example = Example::read(&source, d.grid)?;
            let features = example.features(self.config.network.input, d.scale.value, &Move::NONE);
            let labels = example.labels(&self.classes, d.scale.value, &Move::NONE);
            judge(&self.net, &self.device, [(features, labels)], &mut judged);
        }
        Ok(judged)
    }

    /// Writes what the network says of a run, whose masks it does not look at: uint8 `[frame, row, column]`, the numbers of
    /// [`CellClass`](catseye::road::mask::CellClass), at the scale of the training. Returns the number of frames.
    ///
    /// # Errors
    /// Returns `BadInput` if the run holds no grids or the file exists and `force` is false, and an error if it cannot be written.
    pub fn predict(&self, run: &Path, out: &Path, force: bool) -> Result<usize> {
        let staged = stage::StagedFile::new(out, force)?;
        let frames = sources(&[run.to_path_buf()], self.config.data.grid)?;
        let (mut cells, mut size) = (Vec::new(), [0, 0]);
        for frame in &frames {
            let features = self.features(frame)?;
            let [_, rows, columns] = features.shape();
            size = [rows, columns];
            let p = probabilities(self.net.forward(stacked(&[&features], &self.device)));
            cells.extend(likeliest(&p, self.classes.count()).map(|place| self.classes.class(place) as u8));
        }
        npy::write(staged.path(), &[frames.len(), size[0], size[1]], &cells)?;
        staged.commit()?;
        Ok(frames.len())
    }

    fn features(&self, frame: &Source) -> Result<Features> {
        let d = &self.config.data;
        let scan = Scan::new(&frame.points(d.grid)?);
        Ok(Features::new(self.config.network.input, &scan, d.scale.value))
    }
}
