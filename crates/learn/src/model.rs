//! A trained network with its classes: scores of runs, and predictions.

use crate::config::Config;
use crate::data::{Classes, Features, Labels, frames_of};
use crate::score::Confusion;
use crate::segnet::SegNet;
use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
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
/// Panics if the list is empty or the grids are of different sizes, which [`Features::read`] never gives.
pub fn stacked(features: &[&Features], device: &Device) -> Tensor<4> {
    let [planes, rows, columns] = features[0].shape();
    let values: Vec<f32> = features.iter().flat_map(|f| f.values()).copied().collect();
    Tensor::from_data(TensorData::new(values, [features.len(), planes, rows, columns]), device)
}

/// The class with the largest score in each cell of each picture, the first of equal ones, `[picture, row, column]`.
pub fn decided(scores: Tensor<4>) -> Vec<u8> {
    let [pictures, classes, rows, columns] = scores.dims();
    let cells = rows * columns;
    let data = scores.into_data();
    let values = data.as_slice::<f32>().unwrap_or_default();
    let mut out = vec![0u8; pictures * cells];
    for (at, place) in out.iter_mut().enumerate() {
        let of = |class: usize| values[(at / cells * classes + class) * cells + at % cells];
        *place = (1..classes).fold(0, |best, k| if of(k) > of(best) { k } else { best }) as u8;
    }
    out
}

/// Counts what a network says of grids whose labels are known. The network is one without gradients.
pub fn judge(net: &SegNet, device: &Device, given: &[(&Features, &Labels)], confusion: &mut Confusion) {
    for (features, labels) in given {
        let found = decided(net.forward(stacked(&[*features], device)));
        labels.places().iter().zip(&found).for_each(|(t, p)| confusion.add((*t).into(), (*p).into()));
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

    /// Scores what the network says of runs with masks.
    ///
    /// # Errors
    /// Returns the errors of [`frames_of`], [`Features::read`] and [`Labels::read`].
    pub fn evaluate(&self, runs: &[PathBuf]) -> Result<Confusion> {
        let d = &self.config.data;
        let mut confusion = Confusion::new(&self.classes.names());
        for run in runs {
            for frame in frames_of(run, d.grid)? {
                let features = self.features(&frame)?;
                let labels = Labels::read(&frame, d.grid, &self.classes, d.scale.value)?;
                judge(&self.net, &self.device, &[(&features, &labels)], &mut confusion);
            }
        }
        Ok(confusion)
    }

    /// Writes what the network says of a run, whose masks it does not look at: uint8 `[frame, row, column]`, the numbers of
    /// [`CellClass`](catseye::road::mask::CellClass), at the scale of the training. Returns the number of frames.
    ///
    /// # Errors
    /// Returns `BadInput` if the run holds no grids or the file exists and `force` is false, and an error if it cannot be written.
    pub fn predict(&self, run: &Path, out: &Path, force: bool) -> Result<usize> {
        let staged = stage::StagedFile::new(out, force)?;
        let frames = frames_of(run, self.config.data.grid)?;
        let (mut cells, mut size) = (Vec::new(), [0, 0]);
        for frame in &frames {
            let features = self.features(frame)?;
            let [_, rows, columns] = features.shape();
            size = [rows, columns];
            let found = decided(self.net.forward(stacked(&[&features], &self.device)));
            cells.extend(found.iter().map(|place| self.classes.class((*place).into()) as u8));
        }
        npy::write(staged.path(), &[frames.len(), size[0], size[1]], &cells)?;
        staged.commit()?;
        Ok(frames.len())
    }

    fn features(&self, frame: &Path) -> Result<Features> {
        Features::read(frame, self.config.data.grid, self.config.network.input, self.config.data.scale.value)
    }
}
