//! Grids as a task: SegNet gives each cell before the radar a class.

use crate::augment::Move;
use crate::class_aim::ClassAim;
use crate::classes::Classes;
use crate::config::Config;
use crate::data::{Example, Features, GridKind, Input, Labels, Scan};
use crate::joint::ScaledGrid;
use crate::network::GridNetwork;
use crate::segnet::{SegNet, Shape};
use crate::source::{Source, sources};
use crate::task::Task;
use burn::tensor::{Device, Tensor, TensorData};
use catseye::base::error::Result;
use std::path::PathBuf;

/// Classes of cells.
pub struct GridTask {
    kind: GridKind,
    scale: usize,
    input: Input,
    shape: Shape,
    classes: Classes,
    aim: ClassAim,
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

impl GridTask {
    /// The task of a training.
    ///
    /// # Errors
    /// Returns the errors of [`Config::classes`].
    pub fn new(config: &Config, network: &GridNetwork, kind: GridKind) -> Result<GridTask> {
        let classes = config.classes()?;
        let scale = config.data.scale.as_ref().map_or(1, |s| s.value);
        let (input, shape) = (network.input, network.shape(classes.count()));
        Ok(GridTask { kind, scale, input, shape, aim: ClassAim::new(&classes), classes })
    }

    /// The grid that is learned.
    pub fn kind(&self) -> GridKind {
        self.kind
    }

    /// The cells that get a class.
    pub fn cells(&self) -> ScaledGrid {
        ScaledGrid::new(&self.kind.grid(), self.scale)
    }

    /// What the network sees of a frame, whose mask is not looked at.
    ///
    /// # Errors
    /// Returns the errors of [`Source::points`].
    pub fn seen(&self, source: &Source) -> Result<Features> {
        Ok(self.seen_of(&Scan::new(&source.points(self.kind)?)))
    }

    /// What the network sees of a scan.
    pub fn seen_of(&self, scan: &Scan) -> Features {
        Features::new(self.input, scan, self.scale)
    }
}

impl Task for GridTask {
    type Net = SegNet;
    type Example = Example;
    type Seen = Features;
    type Aim = ClassAim;

    fn classes(&self) -> &Classes {
        &self.classes
    }

    fn net(&self, seed: u32, device: &Device) -> SegNet {
        SegNet::new(self.shape, seed, device)
    }

    fn find(&self, folders: &[PathBuf]) -> Result<Vec<Source>> {
        sources(folders, self.kind)
    }

    fn read(&self, source: &Source) -> Result<Example> {
        Example::read(source, self.kind)
    }

    fn given(&self, example: &Example, moved: &Move) -> (Features, Labels) {
        (example.features(self.input, self.scale, moved), example.labels(&self.classes, self.scale, moved))
    }

    fn aim(&self) -> &ClassAim {
        &self.aim
    }

    fn outputs(&self, net: &SegNet, seen: &[&Features], device: &Device) -> Tensor<2> {
        let scores = net.forward(stacked(seen, device));
        let [pictures, classes, rows, columns] = scores.dims();
        scores.permute([0, 2, 3, 1]).reshape([pictures * rows * columns, classes])
    }

    fn words(&self) -> String {
        let shape = &self.shape;
        format!(
            "A SegNet of {} layers, {} channels and {} x {} kernels that gives each cell of the {} grid a class. It sees the input \
             {:?}, at a scale of {}.",
            shape.layers,
            shape.channels,
            shape.kernel,
            shape.kernel,
            self.kind.name(),
            self.input,
            self.scale
        )
    }
}
