//! Contours as a task: a detector finds the objects before the radar, each with a class, a confidence and a quadrilateral.

use crate::augment::Move;
use crate::class_aim::balanced;
use crate::classes::Classes;
use crate::config::Config;
use crate::data::{Example, Features, GridKind, Input, Scan};
use crate::detection::{Detected, Detection, suppressed};
use crate::detector::{Detector, NUMBERS};
use crate::grid_task::stacked;
use crate::joint::ScaledGrid;
use crate::network::GridNetwork;
use crate::objects::Objects;
use crate::quad::Quad;
use crate::segnet::Shape;
use crate::source::{Source, sources};
use crate::task::{Aim, Task};
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::{Device, Tensor, TensorData};
use catseye::base::error::Result;
use catseye::road::mask::CellClass;
use glam::DVec2;
use std::path::PathBuf;

/// Predictions that are less sure are not told.
pub const LEAST_CONFIDENCE: f32 = 0.02;
/// Of two predictions of a class that share more (intersection over union) the less sure one is taken for the same object.
pub const SAME_OBJECT: f64 = 0.4;
/// Where the loss of a corner goes over from a parabola to a line, in units of the class.
const BEND: f64 = 0.1;
/// How much the mean loss of a corner's number weighs beside the loss of confidences for each object.
const CORNERS: f64 = 10.0;

/// The units of a corner's place ahead and across, m: about half of the length and of the width of such an object.
pub fn unit_m(class: CellClass) -> DVec2 {
    match class {
        CellClass::Lane => DVec2::new(20.0, 3.0),
        CellClass::GuardRail => DVec2::new(15.0, 0.5),
        CellClass::Vehicle => DVec2::new(2.5, 1.0),
        CellClass::Cyclist => DVec2::new(1.0, 0.5),
        CellClass::Pedestrian => DVec2::new(0.5, 0.5),
        CellClass::Marker | CellClass::Undefined => DVec2::ONE,
    }
}

/// Objects with contours. The outputs `[coarse cell, class and number]` have, for each class but the first, the logarithm of the odds that
/// an object of it has its middle in the cell, and its corners from the middle of the cell in units of the class.
pub struct ObjectAim {
    names: Vec<String>,
    units_m: Vec<DVec2>,
    cells: ScaledGrid,
}

/// What the outputs of some frames should be.
struct Targets {
    /// `[coarse cell, class and number]`.
    wanted: Vec<f32>,
    /// How much each of them counts, of the same shape; 0 where anything will do.
    weights: Vec<f32>,
    objects: usize,
}

impl ObjectAim {
    /// The aim of a network whose outputs lie on these coarse cells.
    pub fn new(classes: &Classes, cells: ScaledGrid) -> ObjectAim {
        let units_m = (1..classes.count()).map(|k| unit_m(classes.class(k))).collect();
        ObjectAim { names: classes.names(), units_m, cells }
    }

    fn width(&self) -> usize {
        self.units_m.len() * NUMBERS
    }

    /// Adds what the outputs of a frame should be. The cell that holds the middle of an object should say that it is there. Its eight
    /// neighbours need not say that it is not, and all nine should say where its corners are. Where two objects of a class want the same
    /// cell, the one whose middle is nearer has it.
    fn aimed(&self, truth: &Objects, class_weights: &[f32], targets: &mut Targets) {
        let (cells, width) = (self.cells.rows * self.cells.columns, self.width());
        let start = targets.wanted.len();
        targets.wanted.resize(start + cells * width, 0.0);
        for _ in 0..cells {
            for weight in class_weights {
                targets.weights.push(*weight);
                targets.weights.extend([0.0; NUMBERS - 1]);
            }
        }
        let mut nearest = vec![f64::INFINITY; cells * self.units_m.len()];
        for object in truth.all() {
            let middle = object.quad.middle_m();
            let Some(home) = self.cells.cell(middle) else { continue };
            targets.objects += 1;
            let (row, column) = (home / self.cells.columns, home % self.cells.columns);
            let class = usize::from(object.class) - 1;
            let (unit, weight) = (self.units_m[class], class_weights[class]);
            for r in row.saturating_sub(1)..(row + 2).min(self.cells.rows) {
                for c in column.saturating_sub(1)..(column + 2).min(self.cells.columns) {
                    let cell = r * self.cells.columns + c;
                    let (at, owner) =
                        (start + cell * width + class * NUMBERS, cell * self.units_m.len() + class);
                    let from = self.cells.middle_m(cell);
                    if cell == home {
                        (targets.wanted[at], targets.weights[at]) = (1.0, weight);
                    } else if targets.wanted[at] == 0.0 {
                        targets.weights[at] = 0.0;
                    }
                    let apart = from.distance(middle);
                    if apart >= nearest[owner] {
                        continue;
                    }
                    nearest[owner] = apart;
                    for (k, corner) in object.quad.corners().iter().enumerate() {
                        let off = (*corner - from) / unit;
                        let place = at + 1 + 2 * k;
                        (targets.wanted[place], targets.wanted[place + 1]) = (off.x as f32, off.y as f32);
                        (targets.weights[place], targets.weights[place + 1]) = (weight, weight);
                    }
                }
            }
        }
    }

    /// The objects that outputs `[coarse cell, class and number]` of one frame tell, the surest first.
    pub fn found(&self, outputs: Tensor<2>) -> Vec<Detection> {
        let [cells, width] = outputs.dims();
        let odds = sigmoid(outputs.clone()).into_data().try_to_vec::<f32>().unwrap_or_default();
        let numbers = outputs.into_data().try_to_vec::<f32>().unwrap_or_default();
        let mut found = Vec::new();
        for cell in 0..cells {
            let from = self.cells.middle_m(cell);
            for (class, unit) in self.units_m.iter().enumerate() {
                let at = cell * width + class * NUMBERS;
                let Some(confidence) = odds.get(at).copied().filter(|c| *c >= LEAST_CONFIDENCE) else {
                    continue;
                };
                let corner = |k: usize| {
                    let off = DVec2::new(numbers[at + 1 + 2 * k].into(), numbers[at + 2 + 2 * k].into());
                    from + off * *unit
                };
                if let Some(quad) = Quad::of(std::array::from_fn(corner)) {
                    found.push(Detection { class: (class + 1) as u8, confidence, quad });
                }
            }
        }
        suppressed(found, SAME_OBJECT)
    }
}

impl Aim for ObjectAim {
    type Truth = Objects;
    type Verdict = Detected;
    /// The weight of each class that has objects.
    type Loss = Vec<f32>;

    /// A road without objects teaches that there are none.
    fn counts(&self, _: &Objects) -> bool {
        true
    }

    fn loss(&self, truths: &mut dyn Iterator<Item = Objects>, balance: f64, _: &Device) -> Vec<f32> {
        let mut counts = vec![0.0; self.units_m.len()];
        truths.for_each(|t| t.all().iter().for_each(|o| counts[usize::from(o.class) - 1] += 1.0));
        balanced(&counts, balance)
    }

    /// The binary cross entropy of confidences for each object, and the smooth L1 of corners.
    fn lost(&self, loss: &Vec<f32>, outputs: Tensor<2>, truths: &[&Objects]) -> Tensor<1> {
        let mut targets = Targets { wanted: Vec::new(), weights: Vec::new(), objects: 0 };
        truths.iter().for_each(|t| self.aimed(t, loss, &mut targets));
        let [cells, _] = outputs.dims();
        let (shape, device) = ([cells, self.units_m.len(), NUMBERS], outputs.device());
        let tensor = |values: Vec<f32>| Tensor::<3>::from_data(TensorData::new(values, shape), &device);
        let corners = corners_weight(&targets.weights);
        let (outputs, wanted, weights) =
            (outputs.reshape(shape), tensor(targets.wanted), tensor(targets.weights));
        let part = |t: &Tensor<3>, from: usize, to: usize| t.clone().slice([0..cells, 0..shape[1], from..to]);
        let (z, t) = (part(&outputs, 0, 1), part(&wanted, 0, 1));
        // −t ln p − (1 − t) ln(1 − p) of p = 1/(1 + e^−z), in a form that never overflows.
        let entropy = relu(z.clone()) - z.clone() * t + z.abs().neg().exp().log1p();
        let entropy = (entropy * part(&weights, 0, 1)).sum().div_scalar(targets.objects.max(1) as f64);
        let off = (part(&outputs, 1, NUMBERS) - part(&wanted, 1, NUMBERS)).abs();
        let near = off.clone().clamp_max(BEND);
        let smooth = near.clone() * near.clone() * (0.5 / BEND) + off - near;
        let smooth = (smooth * part(&weights, 1, NUMBERS)).sum().div_scalar(corners);
        entropy + smooth.mul_scalar(CORNERS)
    }

    fn verdict(&self) -> Detected {
        Detected::new(&self.names)
    }

    fn judge(&self, outputs: Tensor<2>, truth: &Objects, verdict: &mut Detected) {
        verdict.add(truth, &self.found(outputs));
    }
}

/// The sum of the weights of all corners, 1 where there are none.
fn corners_weight(weights: &[f32]) -> f64 {
    let of_corners = weights.chunks_exact(NUMBERS).flat_map(|w| &w[1..]);
    let sum: f64 = of_corners.map(|w| f64::from(*w)).sum();
    if sum > 0.0 { sum } else { 1.0 }
}

/// One frame with its objects.
pub struct DetectExample {
    example: Example,
    /// Of the frame as it is, since fitting takes longer than moving.
    objects: Objects,
}

/// Objects on grids.
pub struct DetectTask {
    kind: GridKind,
    scale: usize,
    input: Input,
    shape: Shape,
    classes: Classes,
    aim: ObjectAim,
}

impl DetectTask {
    /// The task of a training.
    ///
    /// # Errors
    /// Returns the errors of [`Config::classes`].
    pub fn new(config: &Config, network: &GridNetwork, kind: GridKind) -> Result<DetectTask> {
        let classes = config.classes()?;
        let scale = config.data.scale.as_ref().map_or(1, |s| s.value);
        let (input, shape) = (network.input, network.shape(classes.count() - 1));
        let aim = ObjectAim::new(&classes, ScaledGrid::new(&kind.grid(), scale << shape.layers));
        Ok(DetectTask { kind, scale, input, shape, classes, aim })
    }

    /// What the network sees of a frame, whose mask is not looked at.
    ///
    /// # Errors
    /// Returns the errors of [`Source::points`].
    pub fn seen(&self, source: &Source) -> Result<Features> {
        Ok(Features::new(self.input, &Scan::new(&source.points(self.kind)?), self.scale))
    }
}

impl Task for DetectTask {
    type Net = Detector;
    type Example = DetectExample;
    type Seen = Features;
    type Aim = ObjectAim;

    fn classes(&self) -> &Classes {
        &self.classes
    }

    fn net(&self, seed: u32, device: &Device) -> Detector {
        Detector::new(self.shape, seed, device)
    }

    fn find(&self, folders: &[PathBuf]) -> Result<Vec<Source>> {
        sources(folders, self.kind)
    }

    fn read(&self, source: &Source) -> Result<DetectExample> {
        let example = Example::read(source, self.kind)?;
        let objects = example.objects(&self.classes, &Move::NONE);
        Ok(DetectExample { example, objects })
    }

    fn given(&self, e: &DetectExample, moved: &Move) -> (Features, Objects) {
        let objects = match (moved.stays(), moved.mirrors()) {
            (true, false) => e.objects.clone(),
            (true, true) => e.objects.mirrored(),
            // What comes into the grid or leaves it changes contours.
            (false, _) => e.example.objects(&self.classes, moved),
        };
        (e.example.features(self.input, self.scale, moved), objects)
    }

    fn aim(&self) -> &ObjectAim {
        &self.aim
    }

    fn outputs(&self, net: &Detector, seen: &[&Features], device: &Device) -> Tensor<2> {
        let outputs = net.forward(stacked(seen, device));
        let [pictures, numbers, rows, columns] = outputs.dims();
        outputs.permute([0, 2, 3, 1]).reshape([pictures * rows * columns, numbers])
    }

    fn words(&self) -> String {
        let (shape, cells) = (&self.shape, &self.aim.cells);
        format!(
            "A detector of {} layers, {} channels and {} x {} kernels that predicts for each of {} x {} coarse cells of the {} grid and \
             for each class whether an object has its middle there, and its four corners. It sees the input {:?}, at a scale of {}.",
            shape.layers,
            shape.channels,
            shape.kernel,
            shape.kernel,
            cells.rows,
            cells.columns,
            self.kind.name(),
            self.input,
            self.scale
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aim() -> ObjectAim {
        let classes = Classes::of_objects(&["undefined", "lane", "vehicle"].map(String::from)).unwrap();
        ObjectAim::new(&classes, ScaledGrid::new(&GridKind::Road.grid(), 32))
    }

    fn quad(x: f64, y: f64, long: f64, wide: f64) -> Quad {
        let at = |u: f64, v: f64| DVec2::new(x + 0.5 * u * long, y + 0.5 * v * wide);
        Quad::of([at(1.0, 1.0), at(1.0, -1.0), at(-1.0, 1.0), at(-1.0, -1.0)]).unwrap()
    }

    fn tensor(aim: &ObjectAim, values: Vec<f32>) -> Tensor<2> {
        let cells = aim.cells.rows * aim.cells.columns;
        Tensor::from_data(TensorData::new(values, [cells, aim.width()]), &Device::flex())
    }

    /// What a network should say is understood as what was there, and costs nothing but what is left of the confidences.
    #[test]
    fn wanted_outputs_tell_the_objects() {
        let aim = aim();
        let truth = Objects::of([
            (1, quad(28.0, 1.0, 50.0, 7.0)),
            (2, quad(20.0, 2.0, 4.5, 1.8)),
            (2, quad(45.0, -1.5, 4.5, 1.8)),
        ]);
        let mut targets = Targets { wanted: Vec::new(), weights: Vec::new(), objects: 0 };
        aim.aimed(&truth, &[1.0, 1.0], &mut targets);
        assert_eq!((targets.objects, targets.wanted.len()), (3, 15 * 10 * 18));
        let mut outputs = targets.wanted.clone();
        for of in outputs.chunks_exact_mut(NUMBERS) {
            of[0] = 40.0 * of[0] - 20.0;
        }
        let found = aim.found(tensor(&aim, outputs.clone()));
        assert_eq!(found.len(), 3);
        for o in truth.all() {
            let best = found.iter().filter(|d| d.class == o.class).map(|d| d.quad.iou(&o.quad));
            assert!(best.fold(0.0, f64::max) > 0.9999);
        }
        let loss = |values: Vec<f32>| {
            f64::from(aim.lost(&vec![1.0, 1.0], tensor(&aim, values), &[&truth]).into_scalar::<f32>())
        };
        assert!(loss(outputs.clone()) < 1e-5);
        // All corners off by a unit: that far out the smooth L1 is 1 less half of the bend.
        let off = outputs.iter().enumerate().map(|(k, v)| if k % NUMBERS == 0 { *v } else { v + 1.0 });
        assert!((loss(off.collect()) - CORNERS * (1.0 - 0.5 * BEND)).abs() < 1e-4);
        // Without any opinion each confidence costs ln 2: all but the neighbours, which may say anything.
        let blank = outputs.iter().enumerate().map(|(k, v)| if k % NUMBERS == 0 { 0.0 } else { *v });
        let free = targets.weights.iter().step_by(NUMBERS).filter(|w| **w == 0.0).count();
        let wanted = (300 - free) as f64 * 2f64.ln() / 3.0;
        assert!(free == 24 && (loss(blank.collect()) - wanted).abs() < 1e-3, "{free}");
    }
}
