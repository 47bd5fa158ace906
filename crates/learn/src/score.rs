//! How well predicted classes agree with the truth: the confusion matrix and what follows from it.

use catseye::base::error::{Error, Result};
use catseye::formats::csv;
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Counts of cells by their true and their predicted class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Confusion {
    classes: Vec<String>,
    /// `[true class, predicted class]`.
    counts: Vec<u64>,
}

impl Confusion {
    /// An empty matrix for these classes.
    pub fn new(classes: &[String]) -> Confusion {
        Confusion { classes: classes.to_vec(), counts: vec![0; classes.len() * classes.len()] }
    }

    /// Names of the classes in their order.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// Counts one cell. Both numbers are places in the list of classes.
    pub fn add(&mut self, truth: usize, predicted: usize) {
        self.counts[truth * self.classes.len() + predicted] += 1;
    }

    /// Number of cells of a true class that got a predicted class.
    pub fn count(&self, truth: usize, predicted: usize) -> u64 {
        self.counts[truth * self.classes.len() + predicted]
    }

    /// Share of the cells predicted as this class that are of it; None where none was predicted.
    pub fn precision(&self, class: usize) -> Option<f64> {
        let predicted: u64 = (0..self.classes.len()).map(|t| self.count(t, class)).sum();
        (predicted > 0).then(|| self.count(class, class) as f64 / predicted as f64)
    }

    /// Share of the cells of this class that were predicted as such; None where the truth holds none.
    pub fn recall(&self, class: usize) -> Option<f64> {
        let there: u64 = (0..self.classes.len()).map(|p| self.count(class, p)).sum();
        (there > 0).then(|| self.count(class, class) as f64 / there as f64)
    }

    /// Harmonic mean of precision and recall, 2 TP/(2 TP + FP + FN); None where the class is neither there nor predicted.
    pub fn f1(&self, class: usize) -> Option<f64> {
        let hits = self.count(class, class);
        let all: u64 = (0..self.classes.len()).map(|k| self.count(class, k) + self.count(k, class)).sum();
        (all > 0).then(|| 2.0 * hits as f64 / all as f64)
    }

    /// Mean of F1 over the classes that have one; 0 for an empty matrix.
    pub fn mean_f1(&self) -> f64 {
        let all: Vec<f64> = (0..self.classes.len()).filter_map(|k| self.f1(k)).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// F1 of each class in words: `undefined 0.98, lane 0.91`.
    pub fn words(&self) -> String {
        let one = |k: usize| format!("{} {}", self.classes[k], figure(self.f1(k)));
        (0..self.classes.len()).map(one).collect::<Vec<_>>().join(", ")
    }

    /// Writes the matrix as CSV: a row for each true class, with a column for each predicted class, precision, recall and F1.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let io = |e| Error::io(path, e);
        let mut header: Vec<String> = vec!["true_class".into()];
        header.extend(self.classes.iter().map(|c| format!("predicted_{}", column_name(c))));
        header.extend(["precision", "recall", "f1"].map(String::from));
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let file = BufWriter::new(File::create(path).map_err(io)?);
        let mut table = csv::Writer::new(file, &[], &header).map_err(io)?;
        for k in 0..self.classes.len() {
            let mut row: Vec<String> = vec![self.classes[k].clone()];
            row.extend((0..self.classes.len()).map(|p| self.count(k, p).to_string()));
            row.extend([self.precision(k), self.recall(k), self.f1(k)].map(cell));
            table.row(row.iter().map(|c| c as &dyn Display)).map_err(io)?;
        }
        table.finish().map_err(io)?;
        Ok(())
    }
}

/// A class as a part of a column's name: "guard rail" is `guard_rail`.
pub fn column_name(class: &str) -> String {
    class.replace(' ', "_")
}

/// A figure as a cell of a table, empty where there is none.
pub fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:.6}"))
}

/// A figure for people.
pub fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "none".into(), |v| format!("{v:.3}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix by hand: 8 of 10 cells of class a hit, 2 taken for b; 3 of 4 of class b hit, 1 taken for a; no cell of class c.
    #[test]
    fn figures_by_hand() {
        let classes = ["a", "b", "c"].map(String::from);
        let mut m = Confusion::new(&classes);
        for (truth, predicted, times) in [(0, 0, 8), (0, 1, 2), (1, 1, 3), (1, 0, 1)] {
            (0..times).for_each(|_| m.add(truth, predicted));
        }
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        near(m.precision(0), 8.0 / 9.0);
        near(m.recall(0), 0.8);
        near(m.f1(0), 16.0 / 19.0);
        near(m.precision(1), 0.6);
        near(m.recall(1), 0.75);
        near(m.f1(1), 6.0 / 9.0);
        assert_eq!((m.precision(2), m.recall(2), m.f1(2)), (None, None, None));
        near(Some(m.mean_f1()), 0.5 * (16.0 / 19.0 + 6.0 / 9.0));
        let t = tempfile::tempdir().unwrap();
        let path = t.path().join("confusion.csv");
        m.write_csv(&path).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "true_class,predicted_a,predicted_b,predicted_c,precision,recall,f1");
        assert_eq!(lines[1], "a,8,2,0,0.888889,0.800000,0.842105");
        assert_eq!(lines[3], "c,0,0,0,,,");
    }
}
