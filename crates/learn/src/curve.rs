//! Precision over recall: how both change with the probability from which on a cell counts as found.

use crate::score::{cell, column_name};
use catseye::base::error::{Error, Result};
use catseye::formats::csv;
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Steps of the threshold between 0 and 1.
const STEPS: usize = 200;

/// Counts of cells by the probability that a network gives to one class.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Tally {
    /// Cells of the class.
    hits: Vec<u64>,
    /// All others.
    others: Vec<u64>,
}

/// The curves of all classes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Curves {
    classes: Vec<String>,
    tallies: Vec<Tally>,
}

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Probability from which on a cell counts as found.
    pub threshold: f64,
    /// Share of the found cells that are of the class; 1 where none is found.
    pub precision: f64,
    /// Share of the class's cells that are found.
    pub recall: f64,
}

impl Curves {
    /// Curves without a cell.
    pub fn new(classes: &[String]) -> Curves {
        let tally = Tally { hits: vec![0; STEPS + 1], others: vec![0; STEPS + 1] };
        Curves { classes: classes.to_vec(), tallies: vec![tally; classes.len()] }
    }

    /// Names of the classes in their order.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// Counts one cell: its true class and the probability of each.
    pub fn add(&mut self, truth: usize, probabilities: impl IntoIterator<Item = f32>) {
        for (class, (p, tally)) in probabilities.into_iter().zip(&mut self.tallies).enumerate() {
            let step = (f64::from(p).clamp(0.0, 1.0) * STEPS as f64) as usize;
            let counts = if class == truth { &mut tally.hits } else { &mut tally.others };
            counts[step] += 1;
        }
    }

    /// The curve of a class, the highest threshold first; empty where the truth holds no cell of it.
    pub fn curve(&self, class: usize) -> Vec<CurvePoint> {
        let tally = &self.tallies[class];
        let all: u64 = tally.hits.iter().sum();
        if all == 0 {
            return Vec::new();
        }
        let (mut hits, mut found) = (0, 0);
        (0..=STEPS)
            .rev()
            .map(|step| {
                hits += tally.hits[step];
                found += tally.hits[step] + tally.others[step];
                CurvePoint {
                    threshold: step as f64 / STEPS as f64,
                    precision: if found == 0 { 1.0 } else { hits as f64 / found as f64 },
                    recall: hits as f64 / all as f64,
                }
            })
            .collect()
    }

    /// Average precision: the sum over thresholds of precision times the recall that the threshold adds; None without a curve.
    pub fn average_precision(&self, class: usize) -> Option<f64> {
        let curve = self.curve(class);
        let first = curve.first()?;
        let steps = curve.windows(2).map(|w| w[1].precision * (w[1].recall - w[0].recall));
        Some(first.precision * first.recall + steps.sum::<f64>())
    }

    /// Writes the curves as CSV: class, threshold, precision and recall.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let io = |e| Error::io(path, e);
        let file = BufWriter::new(File::create(path).map_err(io)?);
        let mut table =
            csv::Writer::new(file, &[], &["class", "threshold", "precision", "recall"]).map_err(io)?;
        for (class, name) in self.classes.iter().enumerate() {
            for p in self.curve(class) {
                let row = [
                    column_name(name),
                    cell(Some(p.threshold)),
                    cell(Some(p.precision)),
                    cell(Some(p.recall)),
                ];
                table.row(row.iter().map(|c| c as &dyn Display)).map_err(io)?;
            }
        }
        table.finish().map_err(io)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three cells of class b with 0.9, 0.6 and 0.2, and two of class a with 0.7 and 0.1 for b.
    #[test]
    fn a_curve_by_hand() {
        let mut c = Curves::new(&["a", "b"].map(String::from));
        for (truth, p) in [(1, 0.9f32), (1, 0.6), (1, 0.2), (0, 0.7), (0, 0.1)] {
            c.add(truth, [1.0 - p, p]);
        }
        let curve = c.curve(1);
        let at = |threshold: f64| *curve.iter().find(|p| p.threshold <= threshold).unwrap();
        let near = |p: CurvePoint, precision: f64, recall: f64| {
            assert!((p.precision - precision).abs() < 1e-12 && (p.recall - recall).abs() < 1e-12, "{p:?}");
        };
        near(at(0.95), 1.0, 0.0);
        near(at(0.8), 1.0, 1.0 / 3.0);
        near(at(0.65), 0.5, 1.0 / 3.0);
        near(at(0.5), 2.0 / 3.0, 2.0 / 3.0);
        near(at(0.15), 0.75, 1.0);
        near(at(0.0), 0.6, 1.0);
        let ap = (1.0 + 2.0 / 3.0 + 0.75) / 3.0;
        assert!((c.average_precision(1).unwrap() - ap).abs() < 1e-12);
        let none = Curves::new(&["a", "b"].map(String::from));
        assert_eq!((none.average_precision(0), none.curve(0).len()), (None, 0));
    }
}
