//! Classes as an aim: each cell or point gets one, learned by the cross entropy and judged by precision and recall.

use crate::classes::Classes;
use crate::curve::Curves;
use crate::data::Labels;
use crate::picture::{confusion_picture, curve_picture};
use crate::score::{Confusion, figure};
use crate::task::{Aim, Verdict};
use burn::nn::loss::{CrossEntropyLoss, CrossEntropyLossConfig};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Int, Tensor, TensorData};
use catseye::base::error::Result;
use std::path::Path;

/// Confusion matrix of the test set.
pub const CONFUSION: &str = "confusion.csv";
/// Precision over recall of the test set.
pub const CURVES: &str = "precision_recall.csv";
/// The picture of the latter.
pub const CURVES_PICTURE: &str = "precision_recall.png";

/// Each item gets a class; the outputs are scores `[item, class]`.
pub struct ClassAim {
    names: Vec<String>,
}

impl ClassAim {
    /// The aim of a network that tells these classes apart.
    pub fn new(classes: &Classes) -> ClassAim {
        ClassAim { names: classes.names() }
    }
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
    pub fn add_decided(
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

impl Verdict for Judged {
    const FIGURE: &'static str = "F1";

    fn names(&self) -> &[String] {
        self.confusion.classes()
    }

    fn figures(&self) -> Vec<Option<f64>> {
        (0..self.confusion.classes().len()).map(|k| self.confusion.f1(k)).collect()
    }

    fn write(&self, folder: &Path) -> Result<()> {
        self.curves.write_csv(&folder.join(CURVES))?;
        confusion_picture(&self.confusion)?.write(folder.join("confusion.png"), true)?;
        curve_picture(&self.curves)?.write(folder.join(CURVES_PICTURE), true)?;
        self.confusion.write_csv(&folder.join(CONFUSION))
    }

    fn card(&self) -> String {
        let test = &self.confusion;
        let mut text = "On the test set (`confusion.png`, `precision_recall.png`):\n\n\
                        | class | precision | recall | F1 | average precision |\n\
                        |---|---:|---:|---:|---:|\n"
            .to_string();
        for (k, class) in test.classes().iter().enumerate() {
            let [p, r, f] = [test.precision(k), test.recall(k), test.f1(k)].map(figure);
            let average = figure(self.curves.average_precision(k));
            text += &format!("| {class} | {p} | {r} | {f} | {average} |\n");
        }
        text
    }
}

/// Weights of classes by their numbers: their shares to the power of -balance, so scaled that the mean over all counted ones is 1.
pub(crate) fn balanced(counts: &[f64], balance: f64) -> Vec<f32> {
    let all: f64 = counts.iter().sum();
    // A class that is not there has the weight of one item.
    let share = |n: f64| n.max(1.0) / all.max(1.0);
    let raw: Vec<f64> = counts.iter().map(|n| share(*n).powf(-balance)).collect();
    let mean: f64 = raw.iter().zip(counts).map(|(w, n)| w * n / all.max(1.0)).sum();
    raw.iter().map(|w| (w / mean.max(f64::MIN_POSITIVE)) as f32).collect()
}

/// The weight of each class of labels.
fn class_weights(labels: impl Iterator<Item = Labels>, classes: usize, balance: f64) -> Vec<f32> {
    let mut counts = vec![0f64; classes];
    labels.for_each(|l| l.places().iter().for_each(|p| counts[usize::from(*p)] += 1.0));
    balanced(&counts, balance)
}

impl Aim for ClassAim {
    type Truth = Labels;
    type Verdict = Judged;
    type Loss = CrossEntropyLoss;

    /// A frame without a point teaches nothing.
    fn counts(&self, truth: &Labels) -> bool {
        !truth.places().is_empty()
    }

    fn loss(
        &self,
        truths: &mut dyn Iterator<Item = Labels>,
        balance: f64,
        device: &Device,
    ) -> CrossEntropyLoss {
        let weights = class_weights(truths, self.names.len(), balance);
        CrossEntropyLossConfig::new().with_weights(Some(weights)).init(device)
    }

    fn lost(&self, loss: &CrossEntropyLoss, outputs: Tensor<2>, truths: &[&Labels]) -> Tensor<1> {
        let truth: Vec<i32> = truths.iter().flat_map(|t| t.places()).map(|place| i32::from(*place)).collect();
        let truth = Tensor::<1, Int>::from_data(TensorData::from(truth.as_slice()), &outputs.device());
        loss.forward(outputs, truth)
    }

    fn verdict(&self) -> Judged {
        Judged::new(&self.names)
    }

    fn judge(&self, outputs: Tensor<2>, truth: &Labels, verdict: &mut Judged) {
        verdict.add(truth, &probabilities(outputs));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_classes_weigh_more() {
        use catseye::road::mask::Grid;
        let classes = Classes::named(&["undefined", "lane"].map(String::from)).unwrap();
        let grid = Grid { rows: 2, columns: 5, ahead_m: 1.0, across_m: 1.0 };
        let labels = Labels::new(&classes, &grid, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 1], 1).unwrap();
        let same = class_weights([labels.clone()].into_iter(), 2, 0.0);
        assert_eq!(same, [1.0, 1.0]);
        let full = class_weights([labels.clone()].into_iter(), 2, 1.0);
        assert!((full[0] - 0.625).abs() < 1e-6 && (full[1] - 2.5).abs() < 1e-6, "{full:?}");
        let half = class_weights([labels].into_iter(), 2, 0.5);
        assert!((half[1] / half[0] - 2.0).abs() < 1e-5);
    }
}
