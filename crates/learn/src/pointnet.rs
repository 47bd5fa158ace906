//! PointNet (Qi, Su, Mo and Guibas, CVPR 2017) and PointNet++ (Qi, Yi, Su and Guibas, NIPS 2017) for classes of points.
//!
//! PointNet puts every point through the same perceptrons, takes the maximum over the frame, and judges each point by its own features
//! beside this one. PointNet++ samples centroids and does so in groups around them, step by step, and brings what it learned
//! back to the points by interpolation. Where the points lie decides the groups, so they are made before the network runs
//! ([`PointFeatures`]); frames of a batch stand one below the other, and nothing is padded.

use crate::cloud::{Level, PointFeatures, Sight};
use crate::groups::NEIGHBOURS;
use crate::layers::{Dense, Maker, Norm, through};
use burn::module::{Module, Param};
use burn::tensor::{Device, Int, Tensor, TensorData};

/// How large a network is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointShape {
    /// Values of a point.
    pub width: usize,
    /// Channels between layers.
    pub channels: usize,
    /// Steps of sampling and grouping; 0 is PointNet.
    pub steps: usize,
    /// Number of classes.
    pub classes: usize,
}

/// The network.
#[derive(Module, Debug)]
pub struct PointNet {
    /// Normalises the features.
    input: Norm,
    /// Of PointNet: every point by itself.
    local: Vec<Dense>,
    /// Of PointNet: every point before the maximum over the frame.
    whole: Vec<Dense>,
    /// Of PointNet++: members of groups before the maximum over each.
    groups: Vec<Vec<Dense>>,
    /// Of PointNet++: points with what was interpolated, the last step first.
    back: Vec<Vec<Dense>>,
    head: Vec<Dense>,
    /// `[class, channel]`.
    classify: Param<Tensor<2>>,
    bias: Param<Tensor<1>>,
}

fn numbers(values: Vec<usize>, device: &Device) -> Tensor<1, Int> {
    let values: Vec<i32> = values.into_iter().map(|v| v as i32).collect();
    Tensor::from_data(TensorData::from(values.as_slice()), device)
}

/// The rows of frames that stand one below the other: numbers within each frame, shifted by the rows of those above.
fn shifted<'a>(frames: impl Iterator<Item = (&'a [usize], usize)>) -> Vec<usize> {
    let (mut above, mut all) = (0, Vec::new());
    for (rows, held) in frames {
        all.extend(rows.iter().map(|r| above + r));
        above += held;
    }
    all
}

/// The maximum of each channel over groups of `size` rows that follow each other, `[group, channel]`.
fn largest(x: Tensor<2>, size: usize) -> Tensor<2> {
    let [rows, channels] = x.dims();
    let grouped: Tensor<3> = x.reshape([rows / size, size, channels]);
    grouped.max_dim(1).reshape([rows / size, channels])
}

impl PointNet {
    /// A network whose weights follow from the seed.
    pub fn new(shape: PointShape, seed: u32, device: &Device) -> PointNet {
        let mut make = Maker::new(seed, device);
        let PointShape { width, channels: c, steps, classes } = shape;
        // What stands beside what is brought back to a step: features of the points, or of its centroids.
        let own = |step: usize| if step == 0 { width } else { c };
        let flat = steps == 0;
        PointNet {
            input: make.input(width),
            local: if flat { make.stack(&[width, c, c]) } else { Vec::new() },
            whole: if flat { make.stack(&[c, 2 * c, 4 * c]) } else { Vec::new() },
            groups: (0..steps).map(|s| make.stack(&[2 + own(s), c, c])).collect(),
            back: (0..steps).rev().map(|s| make.stack(&[c + own(s), c, c])).collect(),
            head: make.stack(&[if flat { 5 * c } else { c }, c]),
            classify: make.kernel([classes, c]),
            bias: make.zeros(classes),
        }
    }

    /// Scores of the classes, `[point, class]`: the points of the frames one below the other, each in the order of its list. Frames
    /// without points add no row; at least one must have a point.
    ///
    /// On a device with gradients channels are normalised by their own mean and variance, else by the running ones.
    pub fn forward(&self, sight: &Sight, frames: &[&PointFeatures], device: &Device) -> Tensor<2> {
        let frames: Vec<&PointFeatures> = frames.iter().filter(|f| f.points() > 0).copied().collect();
        let values: Vec<f32> = frames.iter().flat_map(|f| &f.values).copied().collect();
        let shape = [values.len() / sight.width(), sight.width()];
        let x = self.input.forward(Tensor::from_data(TensorData::new(values, shape), device));
        let x = if self.groups.is_empty() { self.flat(x, &frames) } else { self.stepped(x, sight, &frames) };
        let x = through(&self.head, x).matmul(self.classify.val().transpose());
        let x = x + self.bias.val().unsqueeze::<2>();
        let rows = shifted(frames.iter().map(|f| (f.rows.as_slice(), f.points())));
        x.select(0, numbers(rows, device))
    }

    /// PointNet: features of each point beside those of its frame.
    fn flat(&self, x: Tensor<2>, frames: &[&PointFeatures]) -> Tensor<2> {
        let device = x.device();
        let local = through(&self.local, x);
        let wide = through(&self.whole, local.clone());
        // Shorter frames repeat their points, which leaves their maximum as it is.
        let longest = frames.iter().map(|f| f.points()).max().unwrap_or(1);
        let (mut above, mut held, mut owner) = (0, Vec::new(), Vec::new());
        for (k, frame) in frames.iter().enumerate() {
            held.extend((0..longest).map(|row| above + row % frame.points()));
            owner.extend(std::iter::repeat_n(k, frame.points()));
            above += frame.points();
        }
        let whole = largest(wide.select(0, numbers(held, &device)), longest);
        Tensor::cat(vec![local, whole.select(0, numbers(owner, &device))], 1)
    }

    /// PointNet++: down to the last centroids and back.
    fn stepped(&self, x: Tensor<2>, sight: &Sight, frames: &[&PointFeatures]) -> Tensor<2> {
        let device = x.device();
        let levels = |step: usize| frames.iter().map(move |f| &f.levels[step]);
        // Rows of a frame before a step.
        let held = |step: usize, frame: &PointFeatures| match step {
            0 => frame.points(),
            _ => frame.levels[step - 1].centroids,
        };
        let mut known = vec![x];
        for (step, group) in self.groups.iter().enumerate() {
            let of = |f: &&PointFeatures| held(step, f);
            let members = shifted(frames.iter().map(|f| (f.levels[step].members.as_slice(), of(f))));
            let offsets: Vec<f32> = levels(step).flat_map(|l: &Level| &l.offsets).copied().collect();
            let offsets = Tensor::from_data(TensorData::new(offsets, [members.len(), 2]), &device);
            let before = known[step].clone().select(0, numbers(members, &device));
            let grouped = through(group, Tensor::cat(vec![offsets, before], 1));
            known.push(largest(grouped, sight.samples));
        }
        let mut x = known[self.groups.len()].clone();
        for (back, step) in self.back.iter().zip((0..self.groups.len()).rev()) {
            let near =
                shifted(frames.iter().map(|f| (f.levels[step].near.as_slice(), f.levels[step].centroids)));
            let weights: Vec<f32> = levels(step).flat_map(|l: &Level| &l.weights).copied().collect();
            let (rows, channels) = (near.len() / NEIGHBOURS, x.dims()[1]);
            let weights: Tensor<3> =
                Tensor::from_data(TensorData::new(weights, [rows, NEIGHBOURS, 1]), &device);
            let three: Tensor<3> = x.select(0, numbers(near, &device)).reshape([rows, NEIGHBOURS, channels]);
            let between: Tensor<2> = (three * weights).sum_dim(1).reshape([rows, channels]);
            x = through(back, Tensor::cat(vec![between, known[step].clone()], 1));
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{Cloud, Feature, MeasuredPoint, Step};
    use catseye::base::rng::Draws;
    use glam::DVec2;

    fn sight(steps: &[f64]) -> Sight {
        Sight {
            features: vec![Feature::Amplitude, Feature::Counts],
            circles_m: vec![2.0],
            threshold_m: 0.5,
            steps: steps.iter().zip([9, 4, 2]).map(|(r, n)| Step { radius_m: *r, centroids: n }).collect(),
            samples: 4,
        }
    }

    fn cloud(seed: u32, count: usize) -> Cloud {
        let mut d = Draws::new(seed, 9);
        let mut point = || MeasuredPoint {
            at_m: DVec2::new(60.0 * d.uniform(), 20.0 * d.uniform() - 10.0),
            amplitude: d.uniform(),
            range_rate_mps: 0.0,
        };
        Cloud { points: (0..count).map(|_| point()).collect() }
    }

    fn scores(net: &PointNet, sight: &Sight, clouds: &[&Cloud]) -> Vec<f32> {
        let seen: Vec<PointFeatures> = clouds.iter().map(|c| PointFeatures::new(sight, c)).collect();
        let seen: Vec<&PointFeatures> = seen.iter().collect();
        net.forward(sight, &seen, &Device::flex()).to_data().try_to_vec::<f32>().unwrap()
    }

    /// What is said of a point does not depend, to the bit, on where it stands in the list, and not on the other frames of a batch.
    #[test]
    fn points_may_be_listed_in_any_order() {
        for steps in [&[][..], &[8.0], &[8.0, 16.0, 32.0]] {
            let sight = sight(steps);
            let shape = PointShape { width: sight.width(), channels: 6, steps: steps.len(), classes: 3 };
            let net = PointNet::new(shape, 3, &Device::flex());
            let c = cloud(1, 23);
            let one = scores(&net, &sight, &[&c]);
            assert_eq!(one.len(), 23 * 3);
            assert!(one.iter().all(|v| v.is_finite()) && one[..3] != one[3..6]);
            let mut order: Vec<usize> = (0..23).collect();
            crate::data::shuffle(&mut order, &mut Draws::new(4, 4));
            let mixed = Cloud { points: order.iter().map(|k| c.points[*k]).collect() };
            let other = scores(&net, &sight, &[&mixed]);
            for (place, from) in order.iter().enumerate() {
                assert_eq!(other[3 * place..3 * place + 3], one[3 * from..3 * from + 3], "{steps:?} {place}");
            }
            let (small, empty) = (cloud(2, 2), Cloud::default());
            let batch = scores(&net, &sight, &[&small, &empty, &c]);
            assert_eq!(batch.len(), 25 * 3);
            for (a, b) in batch[6..].iter().zip(&one) {
                assert!((a - b).abs() < 1e-4, "{steps:?}: {a} {b}");
            }
        }
    }

    /// A point far away changes what PointNet says of the others, which see the whole frame.
    #[test]
    fn the_frame_is_seen_as_a_whole() {
        let sight = sight(&[]);
        let shape = PointShape { width: sight.width(), channels: 8, steps: 0, classes: 2 };
        let net = PointNet::new(shape, 3, &Device::flex());
        let mut c = cloud(5, 6);
        let before = scores(&net, &sight, &[&c]);
        c.points.push(MeasuredPoint { at_m: DVec2::new(60.0, -60.0), amplitude: 1.0, range_rate_mps: 0.0 });
        assert_ne!(before, scores(&net, &sight, &[&c])[..12]);
    }

    #[test]
    fn weights_follow_from_the_seed() {
        let bytes = |seed| {
            let shape = PointShape { width: 4, channels: 4, steps: 2, classes: 2 };
            PointNet::new(shape, seed, &Device::flex()).into_record().into_bytes().unwrap().to_vec()
        };
        assert_eq!(bytes(7), bytes(7));
        assert_ne!(bytes(7), bytes(8));
    }
}
