//! What one kind of network learns, as far as a training has to know it.

use crate::augment::Move;
use crate::classes::Classes;
use crate::data::Labels;
use crate::source::Source;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use catseye::base::error::Result;
use std::path::PathBuf;

/// A network with what it sees of frames and what it is judged by. An item is a cell of a grid, or a point.
pub trait Task {
    /// The network.
    type Net: Module;
    /// One frame of one radar.
    type Example;
    /// All that the network sees of a frame.
    type Seen;

    /// The classes that it tells apart.
    fn classes(&self) -> &Classes;

    /// A network whose weights follow from the seed.
    fn net(&self, seed: u32, device: &Device) -> Self::Net;

    /// All frames of some folders of runs and datasets.
    ///
    /// # Errors
    /// Returns `BadInput` if a folder is missing, or holds no frames of this kind.
    fn find(&self, folders: &[PathBuf]) -> Result<Vec<Source>>;

    /// Reads a frame with its truth.
    ///
    /// # Errors
    /// Returns `BadInput` if a part of the frame is missing or wrong.
    fn read(&self, source: &Source) -> Result<Self::Example>;

    /// What the network sees of a frame that is moved, and what it is judged by.
    fn given(&self, example: &Self::Example, moved: &Move) -> (Self::Seen, Labels);

    /// Scores of the classes, `[item, class]`, the frames one below the other. At least one frame must have an item.
    fn scores(&self, net: &Self::Net, seen: &[&Self::Seen], device: &Device) -> Tensor<2>;

    /// What the network is and sees, in sentences.
    fn words(&self) -> String;
}
