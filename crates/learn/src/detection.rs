//! How well predicted contours agree with true ones: which of them match, the average precision, and the mean intersection over union.

use crate::objects::Objects;
use crate::picture::precision_recall_picture;
use crate::quad::Quad;
use crate::score::{cell, column_name, figure};
use crate::task::Verdict;
use catseye::base::error::{Error, Result};
use catseye::formats::csv;
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Figures of the test set by class.
pub const DETECTION: &str = "detection.csv";

/// A predicted object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Its place in the list of classes.
    pub class: u8,
    /// How sure the network is, 0 to 1: the probability that such an object is there times that of its class.
    pub confidence: f32,
    /// Its contour.
    pub quad: Quad,
}

/// The intersections over union from which on a prediction counts as right.
pub const LEVELS: [f64; 3] = [0.5, 0.75, 0.9];

/// Takes the predictions of a class away that share more than `most` (intersection over union) with a surer one of the same class. What
/// remains stands in the order of confidence, equal ones in the order in which they came.
pub fn suppressed(mut found: Vec<Detection>, most: f64) -> Vec<Detection> {
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let mut kept: Vec<Detection> = Vec::new();
    for d in found {
        if kept.iter().all(|k| k.class != d.class || k.quad.iou(&d.quad) <= most) {
            kept.push(d);
        }
    }
    kept
}

/// What became of one prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Outcome {
    confidence: f32,
    /// For each level the intersection over union with the object that it found; None where it found none.
    matched: [Option<f64>; LEVELS.len()],
}

/// Predictions of one class with what became of them.
#[derive(Debug, Clone, PartialEq, Default)]
struct Tally {
    objects: usize,
    outcomes: Vec<Outcome>,
}

/// Predictions of many frames, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Detected {
    /// Names of the classes that have objects: all but the first of the network's list.
    classes: Vec<String>,
    tallies: Vec<Tally>,
    /// Sum of how well true contours fit their cells, and their number.
    fit: (f64, usize),
    misfits: usize,
}

/// A point of a curve of precision over recall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionPoint {
    /// The confidence from which on predictions count.
    pub confidence: f32,
    /// Share of the predictions that are right.
    pub precision: f64,
    /// Share of the objects that are found.
    pub recall: f64,
}

impl Detected {
    /// Nothing was judged yet. The first of a network's classes is the one without objects.
    pub fn new(classes: &[String]) -> Detected {
        let classes: Vec<String> = classes.iter().skip(1).cloned().collect();
        let tallies = vec![Tally::default(); classes.len()];
        Detected { classes, tallies, fit: (0.0, 0), misfits: 0 }
    }

    /// Names of the classes that have objects.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// Judges the predictions of one frame: the surest first, each takes the object of its class with which it shares most among those that
    /// no surer one took and with which it shares as much as the level asks for. A second prediction of one object is wrong.
    pub fn add(&mut self, truth: &Objects, found: &[Detection]) {
        self.fit.0 += truth.all().iter().map(|o| o.fit).sum::<f64>();
        self.fit.1 += truth.all().len();
        self.misfits += truth.misfits();
        for (place, tally) in self.tallies.iter_mut().enumerate() {
            let class = (place + 1) as u8;
            let there: Vec<&Quad> =
                truth.all().iter().filter(|o| o.class == class).map(|o| &o.quad).collect();
            let mut said: Vec<&Detection> = found.iter().filter(|d| d.class == class).collect();
            said.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
            let mut taken = vec![[false; LEVELS.len()]; there.len()];
            tally.objects += there.len();
            for d in said {
                let shared: Vec<f64> = there.iter().map(|q| q.iou(&d.quad)).collect();
                let matched = std::array::from_fn(|level| {
                    let free = (0..there.len()).filter(|k| !taken[*k][level] && shared[*k] >= LEVELS[level]);
                    let best = free.max_by(|a, b| shared[*a].total_cmp(&shared[*b]).then(b.cmp(a)))?;
                    taken[best][level] = true;
                    Some(shared[best])
                });
                tally.outcomes.push(Outcome { confidence: d.confidence, matched });
            }
        }
    }

    /// Number of true objects of a class.
    pub fn objects(&self, class: usize) -> usize {
        self.tallies[class].objects
    }

    /// Mean intersection over union of the true contours with the cells of their objects, and the number of parts that were left out
    /// because no quadrilateral fits them.
    pub fn truth_fit(&self) -> (Option<f64>, usize) {
        ((self.fit.1 > 0).then(|| self.fit.0 / self.fit.1 as f64), self.misfits)
    }

    /// Precision over recall of a class at one of [`LEVELS`], the surest prediction first; predictions of the same confidence are one
    /// point. Empty where the truth holds no object of the class.
    pub fn curve(&self, class: usize, level: usize) -> Vec<DetectionPoint> {
        let tally = &self.tallies[class];
        if tally.objects == 0 {
            return Vec::new();
        }
        let mut outcomes: Vec<&Outcome> = tally.outcomes.iter().collect();
        outcomes.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        let (mut hits, mut found) = (0, 0);
        outcomes
            .chunk_by(|a, b| a.confidence == b.confidence)
            .map(|same| {
                hits += same.iter().filter(|o| o.matched[level].is_some()).count();
                found += same.len();
                DetectionPoint {
                    confidence: same[0].confidence,
                    precision: hits as f64 / found as f64,
                    recall: hits as f64 / tally.objects as f64,
                }
            })
            .collect()
    }

    /// Average precision of a class at one of [`LEVELS`]: the area below the curve whose precision at each recall is the largest at this
    /// recall or a higher one (all points, as PASCAL VOC does it since 2010). None where the truth holds no object of the class.
    pub fn average_precision(&self, class: usize, level: usize) -> Option<f64> {
        let curve = self.curve(class, level);
        if self.tallies[class].objects == 0 {
            return None;
        }
        let (mut sum, mut best) = (0.0, 0.0f64);
        for k in (0..curve.len()).rev() {
            best = best.max(curve[k].precision);
            let before = if k == 0 { 0.0 } else { curve[k - 1].recall };
            sum += best * (curve[k].recall - before);
        }
        Some(sum)
    }

    /// Mean intersection over union of the predictions of a class that match an object by half; None where none does.
    pub fn mean_iou(&self, class: usize) -> Option<f64> {
        let shared: Vec<f64> = self.tallies[class].outcomes.iter().filter_map(|o| o.matched[0]).collect();
        (!shared.is_empty()).then(|| shared.iter().sum::<f64>() / shared.len() as f64)
    }
}

/// AP50, AP75, AP90 and mean intersection over union of a class in table 5.7 of Feng (2019), who calls the lane a road.
pub fn of_document(class: &str) -> Option<[f64; 4]> {
    match class {
        "lane" => Some([0.76, 0.20, 0.02, 0.66]),
        "vehicle" => Some([0.73, 0.08, 0.01, 0.60]),
        _ => None,
    }
}

impl Detected {
    /// AP50, AP75, AP90 and mean intersection over union of a class.
    pub fn row(&self, class: usize) -> [Option<f64>; 4] {
        let [a, b, c] = std::array::from_fn(|level| self.average_precision(class, level));
        [a, b, c, self.mean_iou(class)]
    }

    fn write_tables(&self, folder: &Path) -> Result<()> {
        let writer = |path: &Path, header: &[&str]| {
            let io = |e| Error::io(path, e);
            csv::Writer::new(BufWriter::new(File::create(path).map_err(io)?), &[], header).map_err(io)
        };
        let path = folder.join(DETECTION);
        let io = |e| Error::io(&path, e);
        let mut table = writer(&path, &["class", "objects", "ap50", "ap75", "ap90", "mean_iou"])?;
        for (k, name) in self.classes.iter().enumerate() {
            let [a, b, c, iou] = self.row(k).map(cell);
            let row: [&dyn Display; 6] = [&column_name(name), &self.objects(k), &a, &b, &c, &iou];
            table.row(row).map_err(io)?;
        }
        table.finish().map_err(io)?;
        let path = folder.join("precision_recall.csv");
        let io = |e| Error::io(&path, e);
        let mut table = writer(&path, &["class", "confidence", "precision", "recall"])?;
        for (k, name) in self.classes.iter().enumerate() {
            for p in self.curve(k, 0) {
                let values = [p.confidence.into(), p.precision, p.recall].map(|v| cell(Some(v)));
                let row: [&dyn Display; 4] = [&column_name(name), &values[0], &values[1], &values[2]];
                table.row(row).map_err(io)?;
            }
        }
        table.finish().map_err(io)?;
        Ok(())
    }
}

impl Verdict for Detected {
    const FIGURE: &'static str = "AP50";

    fn names(&self) -> &[String] {
        &self.classes
    }

    fn figures(&self) -> Vec<Option<f64>> {
        (0..self.classes.len()).map(|k| self.average_precision(k, 0)).collect()
    }

    fn write(&self, folder: &Path) -> Result<()> {
        self.write_tables(folder)?;
        let curve = |k: usize| {
            let label =
                format!("{}, average precision {}", self.classes[k], figure(self.average_precision(k, 0)));
            (label, self.curve(k, 0).iter().map(|p| [p.recall, p.precision]).collect())
        };
        let title = "Precision and recall at an intersection over union of 0.5";
        precision_recall_picture(title, (0..self.classes.len()).map(curve))?
            .write(folder.join("precision_recall.png"), true)?;
        Ok(())
    }

    fn card(&self) -> String {
        let mut text = "On the test set (`detection.csv`, `precision_recall.png`):\n\n| class | objects | AP50 | AP75 | AP90 | mIoU |\n\
                        |---|---:|---:|---:|---:|---:|\n"
            .to_string();
        for (k, class) in self.classes.iter().enumerate() {
            let [a, b, c, iou] = self.row(k).map(figure);
            text += &format!("| {class} | {} | {a} | {b} | {c} | {iou} |\n", self.objects(k));
        }
        let (fit, misfits) = self.truth_fit();
        text += &format!(
            "\nThe true contours share {} (mean intersection over union) with the cells of their objects; {misfits} objects that no \
             quadrilateral fits are left out.\n",
            figure(fit)
        );
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// A square of 1 m whose near right corner is at (x, y).
    fn square(x: f64, y: f64) -> Quad {
        let at = |u: f64, v: f64| DVec2::new(x + u, y + v);
        Quad::of([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]).unwrap()
    }

    fn said(confidence: f32, quad: Quad) -> Detection {
        Detection { class: 1, confidence, quad }
    }

    fn judged() -> Detected {
        Detected::new(&["undefined", "vehicle"].map(String::from))
    }

    /// Five objects in two frames. By confidence: right, right, wrong, right, wrong, right: precisions 1, 1, 2/3, 3/4, 3/5, 4/6 at recalls
    /// 0.2, 0.4, 0.4, 0.6, 0.6, 0.8; the envelope is 1, 1, 3/4, 2/3, and so AP = 0.2 (1 + 1 + 3/4 + 2/3).
    #[test]
    fn average_precision_by_hand() {
        let mut d = judged();
        let objects = |n: usize| Objects::of((0..n).map(|k| (1, square(10.0 * k as f64, 0.0))));
        // The second prediction of the first object is wrong.
        d.add(
            &objects(3),
            &[said(0.7, square(0.0, 0.1)), said(0.9, square(0.0, 0.0)), said(0.6, square(10.0, 0.25))],
        );
        d.add(
            &objects(2),
            &[said(0.8, square(0.0, 0.0)), said(0.5, square(50.0, 0.0)), said(0.4, square(10.0, 0.05))],
        );
        let ap = |level| d.average_precision(0, level).unwrap();
        assert!((ap(0) - 0.2 * (2.0 + 0.75 + 2.0 / 3.0)).abs() < 1e-12, "{}", ap(0));
        // A shift by a quarter shares 0.75/1.25 = 0.6 and is right by half alone: 1, 1, 2/3, 2/4, 2/5, 3/6.
        assert!((ap(1) - 0.2 * (2.0 + 0.5)).abs() < 1e-12, "{}", ap(1));
        // A shift by 0.05 shares 0.95/1.05 = 0.905.
        assert!((ap(2) - ap(1)).abs() < 1e-12);
        let mean = (1.0 + 1.0 + 0.6 + 0.95 / 1.05) / 4.0;
        assert!((d.mean_iou(0).unwrap() - mean).abs() < 1e-12);
        assert_eq!((d.objects(0), d.curve(0, 0).len()), (5, 6));
    }

    /// Of two objects a prediction takes the one with which it shares most, and a less sure one gets the other.
    #[test]
    fn predictions_take_what_is_free() {
        let mut d = judged();
        let truth = Objects::of([(1, square(0.0, 0.0)), (1, square(0.0, 0.3))]);
        d.add(&truth, &[said(0.9, square(0.0, 0.2)), said(0.8, square(0.0, 0.25))]);
        assert_eq!(d.average_precision(0, 0), Some(1.0));
        // Another class finds nothing, and equal confidences are one point.
        let mut d = judged();
        d.add(&truth, &[said(0.5, square(0.0, 0.0)), said(0.5, square(9.0, 0.0))]);
        assert_eq!(d.curve(0, 0), [DetectionPoint { confidence: 0.5, precision: 0.5, recall: 0.5 }]);
        let mut d = judged();
        d.add(&truth, &[Detection { class: 2, ..said(0.9, square(0.0, 0.0)) }]);
        assert_eq!((d.average_precision(0, 0), d.mean_iou(0)), (Some(0.0), None));
        d = judged();
        d.add(&Objects::default(), &[said(0.5, square(0.0, 0.0))]);
        assert_eq!(d.average_precision(0, 0), None);
    }

    #[test]
    fn the_surest_of_what_overlaps_remains() {
        let other = Detection { class: 2, ..said(0.3, square(0.0, 0.0)) };
        let all = vec![
            said(0.5, square(0.0, 0.2)),
            said(0.9, square(0.0, 0.0)),
            said(0.4, square(5.0, 0.0)),
            other,
        ];
        let kept: Vec<f32> = suppressed(all.clone(), 0.5).iter().map(|d| d.confidence).collect();
        assert_eq!(kept, [0.9, 0.4, 0.3]);
        assert_eq!(suppressed(all, 0.7).len(), 4);
    }
}
