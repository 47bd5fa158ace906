//! Coefficients of many echoes in many channels at once (CONVENTIONS eq. 9-12, 142): what the channels share of an echo is worked
//! out once, and the rest in vectors.

use super::synthesis::{Plan, Polynomial, excess_m};
use crate::simd::{Vectorised, vectorised};
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::ops::Range;

/// Echoes whose columns are filled by one task.
const PART: usize = 1024;

/// Coefficients of some echoes about the middle of frame and ramp, `[channel, echo]`. What they have of b1 and c beyond this is in
/// the warp.
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

/// Chirp and sample that coefficients are taken about.
pub fn origin(plan: &Plan) -> [f64; 2] {
    [(plan.chirps / 2) as f64, (plan.samples / 2) as f64]
}

impl GridEchoes {
    /// Room for `count` echoes in `channels` channels, all silent.
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

    /// `indices` into the returns of the plan, in some channels.
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
    /// What the way is longer to and from each element that the channels have, in their order; empty for others.
    tx: Vec<Vec<f64>>,
    rx: Vec<Vec<f64>>,
}

impl Part {
    fn new(plan: &Plan, indices: &[u32], (tx, rx): &(Vec<bool>, Vec<bool>)) -> Part {
        let echoes = || indices.iter().map(|i| &plan.echoes[*i as usize]);
        let n = indices.len();
        let room = |used: &[bool]| used.iter().map(|u| vec![0.0; if *u { n } else { 0 }]).collect();
        let mut part = Part {
            indices: indices.to_vec(),
            length: Vec::with_capacity(n),
            rate: Vec::with_capacity(n),
            acceleration: Vec::with_capacity(n),
            jerk: Vec::with_capacity(n),
            tx: room(tx),
            rx: room(rx),
        };
        for (i, r) in echoes().enumerate() {
            let [acceleration, jerk] = r.path_acceleration_and_jerk;
            part.length.push(r.path_length_m);
            part.rate.push(r.path_rate_mps);
            part.acceleration.push(acceleration);
            part.jerk.push(jerk);
            for (column, element) in part.tx.iter_mut().zip(&plan.radar.tx) {
                if let Some(to) = column.get_mut(i) {
                    *to = excess_m(r.departure, r.first_range_m, element.position_m);
                }
            }
            for (column, element) in part.rx.iter_mut().zip(&plan.radar.rx) {
                if let Some(to) = column.get_mut(i) {
                    *to = excess_m(r.arrival, r.last_range_m, element.position_m);
                }
            }
        }
        part
    }
}

impl Paths {
    /// Of `indices` into the returns of the plan, as some channels need them.
    fn new(plan: &Plan, indices: &[u32], channels: Range<usize>) -> Paths {
        let mut used = (vec![false; plan.radar.tx.len()], vec![false; plan.radar.rx.len()]);
        for way in &plan.ways[channels] {
            (used.0[way.tx], used.1[way.rx]) = (true, true);
        }
        Paths {
            parts: indices.par_chunks(PART).map(|part| Part::new(plan, part, &used)).collect(),
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
        (amplitude, a0, a1, a2, a3, b0, b1, b2).into_par_iter().enumerate().for_each(
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
    excess: [&'a [f64]; 2],
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
        let (tx, rx) = (&tx[..n], &rx[..n]);
        let (a1, a2, a3) = (&mut a1[..n], &mut a2[..n], &mut a3[..n]);
        let (b0, b1, b2) = (&mut b0[..n], &mut b1[..n], &mut b2[..n]);
        for i in 0..n {
            let path_m = length[i] + tx[i] + rx[i];
            let mut k = polynomial.coefficients(path_m, rate[i], Complex64::ZERO);
            polynomial.bend(&mut k, path_m, [acceleration[i], jerk[i]]);
            k.a1 += code_turns;
            let k = k.about(chirp, sample);
            a0[i] = k.a0 - (k.a0 + 0.5).floor();
            (a1[i], a2[i], a3[i]) = (k.a1, k.a2, k.a3);
            (b0[i], b1[i], b2[i]) = (k.b0, k.b1, k.b2);
        }
    }
}
