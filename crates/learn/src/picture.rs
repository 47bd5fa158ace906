//! Pictures of how well classes are told apart.

use crate::curve::Curves;
use crate::score::{Confusion, figure};
use catseye::base::error::Result;
use catseye_plot::{Axis, ColourMap, Curve, Picture, Scale, heat_map, lines};

/// The confusion matrix: the share of each true class that got each predicted class, true classes from top to bottom.
///
/// # Errors
/// Returns an error if the picture cannot be drawn.
pub fn confusion_picture(m: &Confusion) -> Result<Picture> {
    let n = m.classes().len();
    let share = |truth: usize, predicted: usize| {
        let all: u64 = (0..n).map(|p| m.count(truth, p)).sum();
        m.count(truth, predicted) as f64 / all as f64
    };
    // Row 0 is drawn lowest.
    let values = (0..n).rev().flat_map(|t| (0..n).map(move |p| share(t, p))).collect();
    let last = (0.0, (n - 1) as f64);
    let scale = Scale::new(ColourMap::Viridis, "share of the true class", 0.0, 1.0);
    let mut chart =
        heat_map("Confusion of the test set", ("predicted", last), ("true", last), (n, n), values, scale);
    let named = |k: usize| m.classes()[k].clone();
    let recall = |k: usize| format!("{}: {}", named(k), figure(m.recall(k)));
    chart.x = chart.x.named((0..n).map(|k| (k as f64, named(k))));
    chart.y = chart.y.named((0..n).map(|k| (k as f64, recall(n - 1 - k))));
    chart.draw()
}

/// Precision over recall of each class that the truth holds.
///
/// # Errors
/// Returns an error if the picture cannot be drawn.
pub fn curve_picture(c: &Curves) -> Result<Picture> {
    let curve = |k: usize| {
        let points = c.curve(k).iter().map(|p| [p.recall, p.precision]).collect();
        (format!("{}, average precision {}", c.classes()[k], figure(c.average_precision(k))), points)
    };
    precision_recall_picture("Precision and recall of the test set", (0..c.classes().len()).map(curve))
}

/// Curves of precision over recall, each with what it is called and its points (recall, precision). Empty ones are left out.
///
/// # Errors
/// Returns an error if the picture cannot be drawn.
pub fn precision_recall_picture(
    title: &str,
    curves: impl Iterator<Item = (String, Vec<[f64; 2]>)>,
) -> Result<Picture> {
    let drawn = curves.filter(|c| !c.1.is_empty());
    let curves: Vec<Curve> = drawn.map(|(label, points)| Curve { label, points }).collect();
    let mut chart = lines(title, "recall", "precision", &curves);
    (chart.x, chart.y) = (Axis::new("recall", 0.0, 1.0), Axis::new("precision", 0.0, 1.0));
    chart.draw()
}
