//! Coefficients of many echoes in many channels at once (CONVENTIONS eq. 9-12, 142, 144): what the channels share of an echo is worked
//! out once, and the rest in vectors.

use super::synthesis::{Plan, Polynomial, excess_change, excess_m};
use crate::base::simd::{Vectorised, vectorised};
use crate::base::tasks::Tasks;
use crate::scene::radar::Antenna;
use glam::DVec3;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::ops::Range;

/// Echoes whose columns are filled by one task.
const PART: usize = 1024;

/// Coefficients of some echoes about the middle of frame and ramp, `[channel, echo]`. Their b1 and c are the
/// differences from the warp.
#[derive(Debug, Clone, Default)]
pub struct GridEchoes {
    /// Number of echoes.
    pub count: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Amplitudes at the middle, `[channel, echo]`, √W.
    pub amplitude: Vec<Complex32>,
    /// Turns, within half a turn.
    pub a0: Vec<f64>,
    /// Linear in the chirp, turns (eq. 12).
    pub a1: Vec<f64>,
    /// Quadratic in the chirp, turns.
    pub a2: Vec<f64>,
    /// Cubic in the chirp, turns.
    pub a3: Vec<f64>,
    /// Linear in the sample, turns.
    pub b0: Vec<f64>,
    /// Mixed in chirp and sample, turns.
    pub b1: Vec<f64>,
    /// Linear in the sample and quadratic in the chirp, turns.
    pub b2: Vec<f64>,
}

/// The chirp and the sample about which coefficients are taken.
pub fn origin(plan: &Plan) -> [f64; 2] {
    [(plan.chirps / 2) as f64, (plan.samples / 2) as f64]
}

impl GridEchoes {
    /// An array with room for `count` echoes in `channels` channels, all silent.
    pub fn silent(count: usize, channels: usize) -> GridEchoes {
        let total = count * channels;
        let column = || vec![0.0; total];
        GridEchoes {
            count,
            channels,
            amplitude: vec![Complex32::ZERO; total],
            a0: column(),
            a1: column(),
            a2: column(),
            a3: column(),
            b0: column(),
            b1: column(),
            b2: column(),
        }
    }

    /// Computes the coefficients of the plan's echoes with these `indices`, in some channels.
    pub fn new(plan: &Plan, indices: &[u32], channels: Range<usize>) -> GridEchoes {
        let mut echoes = GridEchoes::silent(indices.len(), channels.len());
        Paths::new(plan, indices, channels.clone()).fill(plan, channels, &mut echoes);
        echoes
    }
}

/// Paths of some echoes to the elements of the array.
struct Paths {
    parts: Vec<Part>,
    count: usize,
}

/// Columns of up to [`PART`] echoes.
struct Part {
    indices: Vec<u32>,
    length: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
    jerk: Vec<f64>,
    /// Excess of the way to and from each element that the channels have, in their order; empty for others.
    tx: Vec<Excess>,
    rx: Vec<Excess>,
}

/// Length of the way to an element less that to the phase centre, m, with its first and second derivative.
#[derive(Default)]
struct Excess {
    length: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Excess {
    /// Computes the excesses of all elements in use, for ways with these directions, ranges and velocities.
    fn of(elements: &[Antenna], used: &[bool], ways: &[(DVec3, f64, DVec3)]) -> Vec<Excess> {
        let of = |(element, used): (&Antenna, &bool)| {
            let p = element.position_m;
            let mut excess = Excess::default();
            if *used {
                excess.length = ways.iter().map(|(u, r, _)| excess_m(*u, *r, p)).collect();
                (excess.rate, excess.acceleration) =
                    ways.iter().map(|(u, r, v)| <(f64, f64)>::from(excess_change(*u, *r, *v, p))).unzip();
            }
            excess
        };
        elements.iter().zip(used).map(of).collect()
    }
}

impl Part {
    fn new(plan: &Plan, indices: &[u32], (tx, rx): &(Vec<bool>, Vec<bool>)) -> Part {
        let echoes = || indices.iter().map(|i| &plan.echoes[*i as usize]);
        let out: Vec<_> = echoes().map(|r| (r.departure, r.first_range_m, r.first_velocity_mps)).collect();
        let back: Vec<_> = echoes().map(|r| (r.arrival, r.last_range_m, r.last_velocity_mps)).collect();
        Part {
            indices: indices.to_vec(),
            length: echoes().map(|r| r.path_length_m).collect(),
            rate: echoes().map(|r| r.path_rate_mps).collect(),
            acceleration: echoes().map(|r| r.path_acceleration_and_jerk[0]).collect(),
            jerk: echoes().map(|r| r.path_acceleration_and_jerk[1]).collect(),
            tx: Excess::of(&plan.radar.tx, tx, &out),
            rx: Excess::of(&plan.radar.rx, rx, &back),
        }
    }
}

impl Paths {
    /// Collects the paths of the plan's echoes with these `indices`, as these channels need them.
    fn new(plan: &Plan, indices: &[u32], channels: Range<usize>) -> Paths {
        let mut used = (vec![false; plan.radar.tx.len()], vec![false; plan.radar.rx.len()]);
        for way in &plan.ways[channels] {
            (used.0[way.tx], used.1[way.rx]) = (true, true);
        }
        Paths {
            parts: indices.par_chunks(PART).map_tasks(|part| Part::new(plan, part, &used)).collect(),
            count: indices.len(),
        }
    }

    /// Fills the columns of these channels about the middle of frame and ramp.
    fn fill(&self, plan: &Plan, channels: Range<usize>, to: &mut GridEchoes) {
        if self.count == 0 {
            return;
        }
        let [chirp, sample] = origin(plan);
        let count = self.count;
        // Each part of each column of a channel is filled by one task.
        let parts = |v| <[f64]>::chunks_mut(v, count).flat_map(|c| c.chunks_mut(PART)).collect::<Vec<_>>();
        let (a0, a1, a2, a3) = (parts(&mut to.a0), parts(&mut to.a1), parts(&mut to.a2), parts(&mut to.a3));
        let (b0, b1, b2) = (parts(&mut to.b0), parts(&mut to.b1), parts(&mut to.b2));
        let amplitude: Vec<_> = to.amplitude.chunks_mut(count).flat_map(|c| c.chunks_mut(PART)).collect();
        (amplitude, a0, a1, a2, a3, b0, b1, b2).into_par_iter().enumerate().for_each_tasks(
            |(task, (amplitude, a0, a1, a2, a3, b0, b1, b2))| {
                let way = &plan.ways[channels.start + task / self.parts.len()];
                let part = &self.parts[task % self.parts.len()];
                for (to, i) in amplitude.iter_mut().zip(&part.indices) {
                    let a = way.factor * plan.amplitudes[*i as usize * plan.kinds + way.kind];
                    *to = Complex32::new(a.re as f32, a.im as f32);
                }
                vectorised(Fill {
                    polynomial: &plan.polynomial(way.slot),
                    code_turns: way.code_turns,
                    about: [chirp, sample],
                    part,
                    excess: [&part.tx[way.tx], &part.rx[way.rx]],
                    a: [a0, a1, a2, a3],
                    b: [b0, b1, b2],
                });
            },
        );
    }
}

struct Fill<'a> {
    polynomial: &'a Polynomial,
    code_turns: f64,
    about: [f64; 2],
    part: &'a Part,
    excess: [&'a Excess; 2],
    a: [&'a mut [f64]; 4],
    b: [&'a mut [f64]; 3],
}

impl Vectorised for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let Fill { polynomial, code_turns, about: [chirp, sample], part, excess, a, b } = self;
        let ([a0, a1, a2, a3], [b0, b1, b2], [tx, rx]) = (a, b, excess);
        let n = a0.len();
        // One length for all, so that no index is checked in the loop.
        let (length, rate) = (&part.length[..n], &part.rate[..n]);
        let (acceleration, jerk) = (&part.acceleration[..n], &part.jerk[..n]);
        let (tx_m, tx_mps, tx_mps2) = (&tx.length[..n], &tx.rate[..n], &tx.acceleration[..n]);
        let (rx_m, rx_mps, rx_mps2) = (&rx.length[..n], &rx.rate[..n], &rx.acceleration[..n]);
        let (a1, a2, a3) = (&mut a1[..n], &mut a2[..n], &mut a3[..n]);
        let (b0, b1, b2) = (&mut b0[..n], &mut b1[..n], &mut b2[..n]);
        for i in 0..n {
            let path_m = length[i] + tx_m[i] + rx_m[i];
            let rate_mps = rate[i] + (tx_mps[i] + rx_mps[i]);
            let mut k = polynomial.coefficients(path_m, rate_mps, Complex64::ZERO);
            polynomial.bend(&mut k, path_m, [acceleration[i] + (tx_mps2[i] + rx_mps2[i]), jerk[i]]);
            k.a1 += code_turns;
            let k = k.about(chirp, sample);
            a0[i] = k.a0 - (k.a0 + 0.5).floor();
            (a1[i], a2[i], a3[i]) = (k.a1, k.a2, k.a3);
            (b0[i], b1[i], b2[i]) = (k.b0, k.b1, k.b2);
        }
    }
}
