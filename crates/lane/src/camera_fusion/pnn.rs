//! Choice of the road model by a probabilistic neural network (Specht 1990; Sangeetha Lakshmi section 4.2).

use super::reconstruct::RoadModel;
use crate::error::{LaneError, positive};
use crate::numeric::wrapped;
use catseye::base::rng::Draws;

/// The network's two inputs in the document: the slope of the lane line at the end of the camera's part and
/// that at the start of the radar's part. Both are angles from the vehicle's x axis, positive to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Slope of the near part at its end, rad.
    pub near_slope_rad: f64,
    /// Slope of the far part at its start, rad.
    pub far_slope_rad: f64,
}

/// Settings of [`generate_bends`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BendSettings {
    /// Largest turn of a road that counts as straight, rad.
    pub straight_rad: f64,
    /// Least and largest turn of a curve, rad.
    pub curve_rad: [f64; 2],
    /// Least and largest turn of a right-angle bend, rad.
    pub right_angle_rad: [f64; 2],
    /// Largest share of the turn by which the camera's part may end behind the turn's start, and by which the
    /// radar's part may start before its end.
    pub cut_share: f64,
    /// Standard deviation of the vehicle's own angle to its lane, rad.
    pub car_rad: f64,
    /// Standard deviation of the near part's measured slope, rad.
    pub near_noise_rad: f64,
    /// Standard deviation of the far part's measured slope, rad.
    pub far_noise_rad: f64,
    /// Whether turns are stratified over each model's range, one to each part of it, which suits few training
    /// bends; otherwise they are drawn anywhere in the range.
    pub even: bool,
}

impl Default for BendSettings {
    fn default() -> Self {
        let deg = f64::to_radians;
        BendSettings {
            straight_rad: deg(4.0),
            curve_rad: [deg(10.0), deg(60.0)],
            right_angle_rad: [deg(80.0), deg(100.0)],
            cut_share: 0.1,
            car_rad: deg(1.0),
            near_noise_rad: deg(0.3),
            far_noise_rad: deg(1.0),
            even: false,
        }
    }
}

/// Draws `count` bends with their models. The five models take turns, so that a multiple of five holds each
/// equally often.
pub fn generate_bends(settings: &BendSettings, count: usize, seed: u64) -> Vec<(Bend, RoadModel)> {
    let s = settings;
    let mut draws = Draws::new(seed as u32 ^ (seed >> 32) as u32, 0xbe9d);
    let each = count.div_ceil(5).max(1) as f64;
    let mut out: Vec<(Bend, RoadModel)> = Vec::new();
    for (i, model) in RoadModel::ALL.into_iter().cycle().take(count).enumerate() {
        let drawn = draws.uniform();
        let place = if s.even { ((i / 5) as f64 + drawn) / each } else { drawn };
        let in_range = |[a, b]: [f64; 2]| a + (b - a) * place;
        let turn = match model {
            RoadModel::Straight => in_range([-s.straight_rad, s.straight_rad]),
            RoadModel::RightAngleRight => -in_range(s.right_angle_rad),
            RoadModel::CurveRight => -in_range(s.curve_rad),
            RoadModel::CurveLeft => in_range(s.curve_rad),
            RoadModel::RightAngleLeft => in_range(s.right_angle_rad),
        };
        let near = turn * s.cut_share * draws.uniform();
        let far = turn * (1.0 - s.cut_share * draws.uniform());
        out.push((Bend { near_slope_rad: near, far_slope_rad: far }, model));
    }
    for (bend, _) in &mut out {
        let car = s.car_rad * draws.normal();
        bend.near_slope_rad = wrapped(bend.near_slope_rad + car + s.near_noise_rad * draws.normal());
        bend.far_slope_rad = wrapped(bend.far_slope_rad + car + s.far_noise_rad * draws.normal());
    }
    out
}

/// A probabilistic neural network with two inputs, one Gaussian unit for each training bend, five sums and
/// five outputs: 2-15-5-5 with fifteen bends.
///
/// The document scales inputs to unit length. That keeps only the ratio of the two slopes and no longer tells
/// a curve from a right angle (a near slope of zero makes both (0, 1)); here the slopes are not scaled.
#[derive(Debug, Clone, PartialEq)]
pub struct Pnn {
    patterns: Vec<(Bend, RoadModel)>,
    /// Standard deviation of the Gaussians, rad.
    pub smoothing_rad: f64,
    /// Share of the training bends that are classified correctly by the others (leave-one-out).
    pub left_out_share: f64,
}

/// The network's answer for one bend.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The likeliest road model.
    pub model: RoadModel,
    /// Probabilities in the order of [`RoadModel::ALL`], with equal priors.
    pub probability: [f64; 5],
    /// Distance to the nearest training bend divided by the smoothing; above about 4 the network has not seen
    /// such a bend.
    pub strangeness: f64,
}

impl Pnn {
    /// Trains the network with at least two bends of each model. The smoothing is chosen by leave-one-out on
    /// these bends alone: of 61 widths from 0.3 to 60 degrees, the one with the largest mean log probability
    /// of the true model (a count of fifteen hits has too many ties to choose by).
    ///
    /// # Errors
    /// Returns an error if a model has fewer than two bends or a slope is non-finite.
    pub fn train(bends: &[(Bend, RoadModel)]) -> Result<Pnn, LaneError> {
        if bends.iter().any(|(b, _)| !(b.near_slope_rad.is_finite() && b.far_slope_rad.is_finite())) {
            return Err(LaneError::not_finite("a slope"));
        }
        for model in RoadModel::ALL {
            let got = bends.iter().filter(|b| b.1 == model).count();
            if got < 2 {
                return Err(LaneError::too_few("training bends of one road model", got, 2));
            }
        }
        let mut pnn = Pnn { patterns: bends.to_vec(), smoothing_rad: 0.0, left_out_share: 0.0 };
        let mut best = f64::NEG_INFINITY;
        for i in 0..=60 {
            let smoothing_rad = 0.3f64.to_radians() * 200f64.powf(f64::from(i) / 60.0);
            let (mut sum, mut right) = (0.0, 0);
            for (k, (bend, model)) in bends.iter().enumerate() {
                let log = pnn.log_densities(bend, smoothing_rad, Some(k));
                let most = log.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let total = most + log.iter().map(|l| (l - most).exp()).sum::<f64>().ln();
                // A floor keeps one odd bend from deciding alone.
                sum += (log[*model as usize] - total).max(1e-3f64.ln());
                right += usize::from(log[*model as usize] == most);
            }
            if sum > best {
                best = sum;
                (pnn.smoothing_rad, pnn.left_out_share) = (smoothing_rad, right as f64 / bends.len() as f64);
            }
        }
        Ok(pnn)
    }

    /// Log of each model's mean Gaussian density, up to a common constant.
    fn log_densities(&self, bend: &Bend, smoothing_rad: f64, without: Option<usize>) -> [f64; 5] {
        let exponent = |b: &Bend| {
            let d = wrapped(bend.near_slope_rad - b.near_slope_rad)
                .hypot(wrapped(bend.far_slope_rad - b.far_slope_rad));
            -0.5 * (d / smoothing_rad).powi(2)
        };
        RoadModel::ALL.map(|model| {
            let terms: Vec<f64> = (self.patterns.iter().enumerate())
                .filter(|(k, p)| p.1 == model && Some(*k) != without)
                .map(|(_, p)| exponent(&p.0))
                .collect();
            let most = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            most + (terms.iter().map(|t| (t - most).exp()).sum::<f64>() / terms.len() as f64).ln()
        })
    }

    /// Chooses the most likely model; among equals the first in the document's order.
    ///
    /// # Errors
    /// Returns an error if a slope is non-finite or the smoothing is not positive.
    pub fn choose(&self, bend: &Bend) -> Result<Choice, LaneError> {
        if !(bend.near_slope_rad.is_finite() && bend.far_slope_rad.is_finite()) {
            return Err(LaneError::not_finite("a slope"));
        }
        positive("the smoothing", self.smoothing_rad)?;
        let log = self.log_densities(bend, self.smoothing_rad, None);
        let most = log.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = log.iter().map(|l| (l - most).exp()).sum();
        let probability = log.map(|l| (l - most).exp() / sum);
        let best = log.iter().position(|l| *l == most).unwrap_or(0);
        let nearest = self.patterns.iter().map(|(b, _)| {
            wrapped(bend.near_slope_rad - b.near_slope_rad)
                .hypot(wrapped(bend.far_slope_rad - b.far_slope_rad))
        });
        let strangeness = nearest.fold(f64::INFINITY, f64::min) / self.smoothing_rad;
        Ok(Choice { model: RoadModel::ALL[best], probability, strangeness })
    }

    /// Number of Gaussian units.
    pub fn patterns(&self) -> usize {
        self.patterns.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right(pnn: &Pnn, bends: &[(Bend, RoadModel)]) -> usize {
        bends.iter().filter(|(b, m)| pnn.choose(b).is_ok_and(|c| c.model == *m)).count()
    }

    /// The document's experiment, 15 bends to learn and 100 to judge, over 200 seeds.
    #[test]
    fn accuracy_over_seeds() {
        for (name, settings, patterns, least) in [
            ("15 even bends", BendSettings { even: true, ..Default::default() }, 15, 95.0),
            ("15 drawn bends", BendSettings::default(), 15, 93.0),
            ("50 drawn bends", BendSettings::default(), 50, 96.0),
            (
                "15 even bends, 20 % cut",
                BendSettings { cut_share: 0.2, even: true, ..Default::default() },
                15,
                80.0,
            ),
            (
                "15 even bends, no noise",
                BendSettings {
                    near_noise_rad: 0.0,
                    far_noise_rad: 0.0,
                    car_rad: 0.0,
                    even: true,
                    ..Default::default()
                },
                15,
                95.0,
            ),
        ] {
            let mut hits: Vec<usize> = (0..200)
                .map(|seed| {
                    let pnn = Pnn::train(&generate_bends(&settings, patterns, 2 * seed)).unwrap();
                    assert_eq!(pnn.patterns(), patterns);
                    right(&pnn, &generate_bends(&BendSettings { even: false, ..settings }, 100, 2 * seed + 1))
                })
                .collect();
            hits.sort_unstable();
            let mean = hits.iter().sum::<usize>() as f64 / 200.0;
            println!(
                "{name}: mean {mean:.1} of 100, median {}, 5 % {}, least {}, most {}",
                hits[100], hits[10], hits[0], hits[199]
            );
            assert!(mean > least, "{name} {mean}");
        }
    }

    /// Inputs of unit length, as printed, lose what tells a curve from a right angle.
    #[test]
    fn unit_length_inputs_fail() {
        let unit = |bends: Vec<(Bend, RoadModel)>| -> Vec<(Bend, RoadModel)> {
            bends
                .into_iter()
                .map(|(b, m)| {
                    let n = b.near_slope_rad.hypot(b.far_slope_rad);
                    (Bend { near_slope_rad: b.near_slope_rad / n, far_slope_rad: b.far_slope_rad / n }, m)
                })
                .collect()
        };
        let s = BendSettings::default();
        let hits: usize = (0..100)
            .map(|seed| {
                right(
                    &Pnn::train(&unit(generate_bends(&s, 15, 2 * seed))).unwrap(),
                    &unit(generate_bends(&s, 100, 2 * seed + 1)),
                )
            })
            .sum();
        println!("unit length: {:.1} of 100", hits as f64 / 100.0);
        assert!(hits < 80 * 100);
    }

    #[test]
    fn probabilities_mirror_and_add_up() {
        let mut bends = generate_bends(&BendSettings::default(), 50, 3);
        let mirror = |m: RoadModel| match m {
            RoadModel::Straight => RoadModel::Straight,
            RoadModel::CurveLeft => RoadModel::CurveRight,
            RoadModel::CurveRight => RoadModel::CurveLeft,
            RoadModel::RightAngleLeft => RoadModel::RightAngleRight,
            RoadModel::RightAngleRight => RoadModel::RightAngleLeft,
        };
        let turned = |b: &Bend| Bend { near_slope_rad: -b.near_slope_rad, far_slope_rad: -b.far_slope_rad };
        let mirrored: Vec<_> = bends.iter().map(|(b, m)| (turned(b), mirror(*m))).collect();
        bends.extend(mirrored);
        let pnn = Pnn::train(&bends).unwrap();
        for (b, _) in generate_bends(&BendSettings::default(), 200, 4) {
            let (c, d) = (pnn.choose(&b).unwrap(), pnn.choose(&turned(&b)).unwrap());
            assert!((c.probability.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for m in RoadModel::ALL {
                assert!((c.probability[m as usize] - d.probability[mirror(m) as usize]).abs() < 1e-9);
            }
        }
        let strange = pnn.choose(&Bend { near_slope_rad: 2.0, far_slope_rad: -2.0 }).unwrap();
        assert!(
            strange.strangeness > 4.0 && strange.probability.iter().all(|p| p.is_finite()),
            "{strange:?}"
        );
    }

    #[test]
    fn hostile_training() {
        let bends = generate_bends(&BendSettings::default(), 15, 1);
        assert!(Pnn::train(&[]).is_err() && Pnn::train(&bends[..9]).is_err());
        let mut bad = bends.clone();
        bad[3].0.far_slope_rad = f64::NAN;
        assert!(Pnn::train(&bad).is_err());
        let pnn = Pnn::train(&bends).unwrap();
        assert!(pnn.choose(&Bend { near_slope_rad: f64::INFINITY, far_slope_rad: 0.0 }).is_err());
        assert_eq!(generate_bends(&BendSettings::default(), 0, 1).len(), 0);
        assert_eq!(bends, generate_bends(&BendSettings::default(), 15, 1));
        // All in one place: no width tells them apart, and yet there is an answer and no panic.
        let same: Vec<_> =
            bends.iter().map(|(_, m)| (Bend { near_slope_rad: 0.0, far_slope_rad: 0.0 }, *m)).collect();
        let c = Pnn::train(&same).unwrap().choose(&Bend { near_slope_rad: 0.0, far_slope_rad: 0.0 }).unwrap();
        assert!(c.probability.iter().all(|p| (p - 0.2).abs() < 1e-12));
    }
}
