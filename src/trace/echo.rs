//! The echoes that come out of a scene.

use crate::base::convention::MAX_BOUNCES;
use crate::base::matrix::Matrix2;
use crate::base::tasks::{Tasks, in_parts};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// One echo, seen from the radar's phase centre, at the frame time. The received complex amplitude
/// in sqrt(W) of a channel is
/// sqrt(Pt) (lambda / 4 pi) sqrt(Gt Gr) e_rx^T path_gain e_tx exp(-j k path_length) (CONVENTIONS eq. 9).
#[derive(Debug, Clone, PartialEq)]
pub struct Echo {
    /// Length of the path from the radar over all scatterers and back, m.
    pub path_length_m: f64,
    /// Time derivative of the path's length, m/s; the range rate is half of it, positive when receding.
    pub path_rate_mps: f64,
    /// Second and third derivative of the path's length, m/s² and m/s³, chosen such that the path is right in the
    /// middle, at the start and at the end of the frame (CONVENTIONS eq. 141).
    pub path_acceleration_and_jerk: [f64; 2],
    /// Unit vector to the first scatterer, sensor frame.
    pub departure: DVec3,
    /// Length from the transmitter to the first place that the echo touches, m.
    pub first_range_m: f64,
    /// Rate of the vector departure · first_range_m, m/s in the sensor frame, which turns with the radar (CONVENTIONS
    /// eq. 144).
    pub first_velocity_mps: DVec3,
    /// Unit vector to the last scatterer, sensor frame.
    pub arrival: DVec3,
    /// Length from the last place that the echo touches to the receiver, m.
    pub last_range_m: f64,
    /// Rate of the vector arrival · last_range_m, m/s in the sensor frame.
    pub last_velocity_mps: DVec3,
    /// `S[rx][tx] / (R_t R_r)` in 1/m, bases (V, H) of `arrival` and `departure`; index 0 is V. R_t is
    /// the unfolded length to the last scatterer, R_r = last_range_m.
    pub path_gain: Matrix2,
    /// Ids of the objects in the order in which they are met; zero after the last.
    pub chain: [u32; MAX_BOUNCES],
    /// Number of bounces.
    pub bounces: u8,
    /// Places of the bounces between the first and the last, sensor frame, m; empty unless they were asked for
    /// ([`super::TraceOptions::places`]) and there are more than two bounces.
    pub between_m: Box<[DVec3]>,
}

impl Echo {
    /// Half the length of the path, m.
    pub fn range_m(&self) -> f64 {
        0.5 * self.path_length_m
    }
    /// Half the rate of the path's length, m/s, positive when receding.
    pub fn range_rate_mps(&self) -> f64 {
        0.5 * self.path_rate_mps
    }
    /// Whether the path's length does not change, at every element of the array.
    pub fn is_still(&self) -> bool {
        self.path_rate_mps == 0.0
            && self.path_acceleration_and_jerk == [0.0; 2]
            && self.first_velocity_mps == DVec3::ZERO
            && self.last_velocity_mps == DVec3::ZERO
    }
    /// Where the path touches something, in the order met, in the middle of the frame, sensor frame, m. The places between the first
    /// and the last are known only where they were asked for ([`super::TraceOptions::places`]); None where one is not known.
    pub fn places_m(&self) -> Option<Vec<DVec3>> {
        let ends = [self.departure * self.first_range_m, self.arrival * self.last_range_m];
        let between = usize::from(self.bounces).saturating_sub(2);
        match self.bounces {
            0 => Some(Vec::new()),
            1 => Some(vec![ends[0]]),
            _ if self.between_m.len() == between => Some([&ends[..1], &self.between_m, &ends[1..]].concat()),
            _ => None,
        }
    }
    /// The echo of the same path backwards.
    pub fn reversed(&self) -> Echo {
        let n = self.bounces as usize;
        let mut chain = self.chain;
        chain[..n].reverse();
        let [[vv, vh], [hv, hh]] = self.path_gain;
        Echo {
            departure: self.arrival,
            first_range_m: self.last_range_m,
            first_velocity_mps: self.last_velocity_mps,
            arrival: self.departure,
            last_range_m: self.first_range_m,
            last_velocity_mps: self.first_velocity_mps,
            path_gain: [[vv, hv], [vh, hh]],
            chain,
            between_m: self.between_m.iter().rev().copied().collect(),
            ..self.clone()
        }
    }
    /// The object that scattered last.
    pub fn object_id(&self) -> u32 {
        self.chain[(self.bounces as usize).saturating_sub(1)]
    }
}

/// Largest entry of the matrix, in amplitude (1/m).
pub fn strength(r: &Echo) -> f64 {
    r.path_gain.iter().flatten().map(|z| z.norm_sqr()).fold(0.0, f64::max).sqrt()
}

/// Copies of the echoes that are not below `floor` times the strongest, in amplitude.
pub fn strong(echoes: &[&Echo], floor: f64) -> Vec<Echo> {
    let strengths = in_parts(echoes, |r| strength(r));
    let strongest = strengths.iter().copied().fold(0.0, f64::max);
    let kept = echoes.iter().zip(strengths).filter(|(_, s)| *s > floor * strongest);
    // Their memory is touched by all threads.
    kept.map(|(r, _)| *r).collect::<Vec<_>>().into_par_iter().map_tasks(Echo::clone).collect()
}

/// All echoes of one frame, in a fixed order (the same bytes whatever the number of threads).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Echoes {
    /// The echoes.
    pub list: Vec<Echo>,
    /// Number of samples of diffuse surfaces among them, before weak ones were dropped.
    pub rays: u64,
    /// Number of faces that were left out because the receiver hears nothing from so far (`TraceOptions::reach_m`).
    pub beyond_reach: u64,
    /// Number of echoes that were added to others of the same place and way ([`super::merge`]).
    pub merged: u64,
    /// Number of echoes that were left out because all of them together cannot show (`adc::budget`).
    pub left_out: u64,
    /// Sum of the powers of those in a channel, mean over channels, W.
    pub left_out_power_w: f64,
    /// Estimates of what one bounce more would have returned of each beam that `TraceOptions::bounces` ended; they are
    /// no echoes of the frame.
    pub cut: Vec<Echo>,
    /// Number of bounces that were followed.
    pub bounces: usize,
    /// Power of the echoes in a channel, mean over channels, and of `cut`, W: those of one chain in one range cell are added up
    /// with their phases (`adc::budget::power_w`).
    pub power_w: f64,
    /// Power of what one bounce more would have returned, W: an estimate, seldom 6 dB too low or 20 dB too high (CONVENTIONS eq. 68).
    pub cut_power_w: f64,
    /// Number of echoes that were left out because their amplitude or motion is not a finite number. Each is a fault of
    /// the mesh or of catseye.
    pub broken: u64,
    /// Whether a device followed the beams; else the host did, in f64.
    pub on_device: bool,
    /// Why the device of an engine that traces there left the frame to the host; None where it did not.
    pub fallback: Option<Cow<'static, str>>,
}
