//! What one kind of network learns, as far as a training has to know it.

use crate::augment::Move;
use crate::classes::Classes;
use crate::source::Source;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use catseye::base::error::Result;
use std::path::{Path, PathBuf};

/// A network with what it sees of frames, and its aim.
pub trait Task {
    /// The network.
    type Net: Module;
    /// One frame of one radar.
    type Example;
    /// All that the network sees of a frame.
    type Seen;
    /// What its outputs should come to.
    type Aim: Aim;

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
    fn given(&self, example: &Self::Example, moved: &Move) -> (Self::Seen, <Self::Aim as Aim>::Truth);

    /// What the outputs are judged by.
    fn aim(&self) -> &Self::Aim;

    /// The outputs of the network, a row for each item that the aim judges, the frames one below the other. At least one frame must have
    /// an item.
    fn outputs(&self, net: &Self::Net, seen: &[&Self::Seen], device: &Device) -> Tensor<2>;

    /// What the network is and sees, in sentences.
    fn words(&self) -> String;
}

/// What the network of a task is judged by in one frame.
pub type TruthOf<T> = <<T as Task>::Aim as Aim>::Truth;

/// What was judged of the network of a task.
pub type VerdictOf<T> = <<T as Task>::Aim as Aim>::Verdict;

/// What the outputs of a network should come to: the loss by which it learns, and the figures by which it is judged. Classes of cells and
/// of points are one aim, contours of objects another.
pub trait Aim {
    /// What the network is judged by in one frame. It never sees it.
    type Truth;
    /// What was judged so far.
    type Verdict: Verdict;
    /// The loss for a training set.
    type Loss;

    /// Whether a frame holds anything that can be learned or judged.
    fn counts(&self, truth: &Self::Truth) -> bool;

    /// The loss for the truths of a training set, in which rare classes weigh more: `balance` from 0, all items the same, to 1, all
    /// classes.
    fn loss(
        &self,
        truths: &mut dyn Iterator<Item = Self::Truth>,
        balance: f64,
        device: &Device,
    ) -> Self::Loss;

    /// The loss of outputs `[item, number]` of some frames, a tensor of one value.
    fn lost(&self, loss: &Self::Loss, outputs: Tensor<2>, truths: &[&Self::Truth]) -> Tensor<1>;

    /// Nothing was judged yet.
    fn verdict(&self) -> Self::Verdict;

    /// Judges the outputs of one frame, `[item, number]`.
    fn judge(&self, outputs: Tensor<2>, truth: &Self::Truth, verdict: &mut Self::Verdict);
}

/// Figures of a network by class.
pub trait Verdict {
    /// What the figure is called by which epochs are compared: "F1".
    const FIGURE: &'static str;

    /// Names of the classes that have figures.
    fn names(&self) -> &[String];

    /// The figure of each class, None where the frames do not tell it.
    fn figures(&self) -> Vec<Option<f64>>;

    /// The mean of the figures that there are, 0 without any.
    fn mean(&self) -> f64 {
        let all: Vec<f64> = self.figures().into_iter().flatten().collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// Writes tables and pictures of the test set into a folder.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written or a picture cannot be drawn.
    fn write(&self, folder: &Path) -> Result<()>;

    /// The part of a model card that tells the test set, in Markdown.
    fn card(&self) -> String;
}

/// Judges what a network says of frames whose truth is known. The network is one without gradients.
pub fn judge<T: Task>(
    task: &T,
    net: &T::Net,
    device: &Device,
    given: impl IntoIterator<Item = (T::Seen, TruthOf<T>)>,
    verdict: &mut VerdictOf<T>,
) {
    for (seen, truth) in given {
        if task.aim().counts(&truth) {
            task.aim().judge(task.outputs(net, &[&seen], device), &truth, verdict);
        }
    }
}
