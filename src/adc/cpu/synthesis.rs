//! Direct sum of all echoes at every sample (CONVENTIONS eq. 9-12).
//!
//! f64 is the truth: phasors from the exact phase at the start of every 256 samples, turned by a
//! second-order rotation in between (rounding below 1e-10 rad). f32 starts from the exact phase in
//! the middle of each block of at most 32 samples and goes both ways from there with the
//! three-term recurrence of cosine and sine; its error stays below -80 dB of the peak.
//!
//! The order of every sum is fixed, so the same bytes come out whatever the number of threads.

use crate::adc::Cube;
use crate::adc::synthesis::{Plan, Set};
use crate::base::control::Control;
use crate::base::error::{Error, Result};
use crate::base::simd::{Vectorised, lanes, vectorised};
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Echoes that are worked on together: their coefficients stay in the second-level cache.
const TILE: usize = 1024;
/// Samples between exact phases of the f64 sum.
const SEGMENT: usize = 256;
/// Neighbouring echoes in one vector.
pub(super) const LANES: usize = 8;
/// Most samples on either side of an exact phase in the f32 sum.
const HALF: usize = 16;
/// Above this the drift of the frequency within a block of the f32 sum is followed, turns. From block to block it always is.
const DRIFT_SEEN: f64 = 1e-6;
/// Up to this it is followed to first order well enough, turns; blocks are made shorter beyond.
const DRIFT_FIRST_ORDER: f64 = 8e-4;

/// Precision of the sum: f64 or f32.
pub trait Precision: Copy + Default + Send + Sync + 'static {
    /// Rounds a sum of f64 to this precision.
    fn round(z: Complex64) -> Complex<Self>;
    #[doc(hidden)]
    fn add(tile: &Tile, chirp: usize, samples: Range<usize>, sum: &mut [Complex64]);
}

impl Precision for f64 {
    fn round(z: Complex64) -> Complex<f64> {
        z
    }
    fn add(tile: &Tile, chirp: usize, samples: Range<usize>, sum: &mut [Complex64]) {
        vectorised(Rotation { tile, chirp, start: samples.start, sum })
    }
}

impl Precision for f32 {
    fn round(z: Complex64) -> Complex<f32> {
        Complex::new(z.re as f32, z.im as f32)
    }
    fn add(tile: &Tile, chirp: usize, samples: Range<usize>, sum: &mut [Complex64]) {
        vectorised(Recurrence { tile, chirp, start: samples.start, sum })
    }
}

/// The cube of one frame without noise, √W.
///
/// # Errors
/// Returns an error only if `control` is cancelled.
pub fn synthesise<T: Precision>(plan: &Plan, control: Control) -> Result<Cube<T>> {
    synthesise_some(plan, plan.set(Set::Still), plan.set(Set::Moving), control)
}

/// Synthesises as [`synthesise`] only some of the echoes at rest and of those that move.
///
/// # Errors
/// Returns an error if `control` is cancelled.
pub fn synthesise_some<T: Precision>(
    plan: &Plan,
    still: &[u32],
    moving: &[u32],
    control: Control,
) -> Result<Cube<T>> {
    let (chirps, channels, samples) = (plan.chirps, plan.channels, plan.samples);
    let mut cube = Cube::<T>::zeros(chirps, channels, samples);
    let total = (chirps * channels) as u64;
    let done = AtomicU64::new(0);
    let cancelled = || control.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
    for channel in 0..channels {
        let row = still_row::<T>(plan, still, channel, &cancelled);
        let tiles: Vec<Tile> =
            moving.par_chunks(TILE).map_tasks(|indices| Tile::new(plan, indices, channel)).collect();
        cube.data.par_chunks_mut(channels * samples).enumerate().for_each_tasks(|(chirp, loop_)| {
            let out = &mut loop_[channel * samples..][..samples];
            out.par_chunks_mut(SEGMENT).enumerate().for_each_tasks(|(i, out)| {
                if cancelled() {
                    return;
                }
                let at = i * SEGMENT..i * SEGMENT + out.len();
                let mut sum = row[at.clone()].to_vec();
                for tile in &tiles {
                    T::add(tile, chirp, at.clone(), &mut sum);
                }
                for (o, z) in out.iter_mut().zip(&sum) {
                    *o = T::round(sampled(plan.sampling, *z));
                }
            });
            let rows = done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Some(progress) = control.progress {
                progress(rows, total);
            }
        });
        if cancelled() {
            return Err(Error::Failed("synthesis was cancelled".into()));
        }
    }
    Ok(cube)
}

fn sampled(sampling: Sampling, z: Complex64) -> Complex64 {
    match sampling {
        Sampling::Iq => z,
        Sampling::Real => Complex64::new(std::f64::consts::SQRT_2 * z.re, 0.0),
    }
}

/// The echoes that are the same in every loop, summed tile by tile so that threads share the work.
fn still_row<T: Precision>(
    plan: &Plan,
    still: &[u32],
    channel: usize,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Vec<Complex64> {
    let mut row = vec![Complex64::ZERO; plan.samples];
    // A bounded number of partial rows at a time.
    for some in still.chunks(64 * TILE) {
        let parts: Vec<Vec<Complex64>> = some
            .par_chunks(TILE)
            .map_tasks(|indices| {
                let mut part = vec![Complex64::ZERO; plan.samples];
                if !cancelled() {
                    let tile = Tile::new(plan, indices, channel);
                    for (i, segment) in part.chunks_mut(SEGMENT).enumerate() {
                        let at = i * SEGMENT..i * SEGMENT + segment.len();
                        T::add(&tile, 0, at, segment);
                    }
                }
                part
            })
            .collect();
        for part in parts {
            row.iter_mut().zip(part).for_each(|(a, b)| *a += b);
        }
    }
    row
}

/// Coefficients of up to `TILE` echoes in one channel, one array each, padded with silent echoes
/// to whole vectors.
#[doc(hidden)]
pub struct Tile {
    re: Vec<f64>,
    im: Vec<f64>,
    a0: Vec<f64>,
    a1: Vec<f64>,
    a2: Vec<f64>,
    a3: Vec<f64>,
    b0: Vec<f64>,
    b1: Vec<f64>,
    b2: Vec<f64>,
    c: Vec<f64>,
    c1: Vec<f64>,
    largest_drift: f64,
}

impl Tile {
    fn new(plan: &Plan, indices: &[u32], channel: usize) -> Tile {
        let n = indices.len().next_multiple_of(LANES);
        let mut t = Tile {
            re: vec![0.0; n],
            im: vec![0.0; n],
            a0: vec![0.0; n],
            a1: vec![0.0; n],
            a2: vec![0.0; n],
            a3: vec![0.0; n],
            b0: vec![0.0; n],
            b1: vec![0.0; n],
            b2: vec![0.0; n],
            c: vec![0.0; n],
            c1: vec![0.0; n],
            largest_drift: 0.0,
        };
        for (i, index) in indices.iter().enumerate() {
            let k = plan.coefficients(*index, channel);
            (t.re[i], t.im[i]) = (k.amplitude.re, k.amplitude.im);
            (t.a0[i], t.a1[i], t.a2[i]) = (k.a0, k.a1, k.a2);
            (t.b0[i], t.b1[i], t.c[i]) = (k.b0, k.b1, k.c);
            (t.a3[i], t.b2[i], t.c1[i]) = (k.a3, k.b2, k.c1);
            t.largest_drift = t.largest_drift.max(k.c.abs() + plan.chirps as f64 * k.c1.abs());
        }
        t
    }

    fn len(&self) -> usize {
        self.re.len()
    }

    /// Phase at sample n of loop m, its slope there and half the change of the slope from sample to sample, in turns.
    #[inline(always)]
    fn phase<const FMA: bool>(&self, i: usize, m: f64, n: f64) -> (f64, f64, f64) {
        let c = madd64::<FMA>(m, self.c1[i], self.c[i]);
        let b = madd64::<FMA>(m, madd64::<FMA>(m, self.b2[i], self.b1[i]), self.b0[i]);
        let a2 = madd64::<FMA>(m, self.a3[i], self.a2[i]);
        let a = madd64::<FMA>(m, madd64::<FMA>(m, a2, self.a1[i]), self.a0[i]);
        let slope = madd64::<FMA>(2.0 * n, c, b);
        (madd64::<FMA>(n, madd64::<FMA>(n, c, b), a), slope, c)
    }
}

#[inline(always)]
fn madd64<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// The f64 sum over one segment.
struct Rotation<'a> {
    tile: &'a Tile,
    chirp: usize,
    start: usize,
    sum: &'a mut [Complex64],
}

type V64 = [f64; 4];

/// (a + jb)(c + jd).
#[inline(always)]
fn turn64<const FMA: bool>(a: &V64, b: &V64, c: &V64, d: &V64) -> (V64, V64) {
    let bd = lanes!(4, l => b[l] * d[l]);
    let bc = lanes!(4, l => b[l] * c[l]);
    (lanes!(4, l => madd64::<FMA>(a[l], c[l], -bd[l])), lanes!(4, l => madd64::<FMA>(a[l], d[l], bc[l])))
}

impl Vectorised for Rotation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let mut acc = [[[0.0f64; 4]; 2]; SEGMENT];
        let acc = &mut acc[..self.sum.len()];
        let (m, n) = (self.chirp as f64, self.start as f64);
        for g in (0..self.tile.len()).step_by(4) {
            let (mut zr, mut zi, mut wr, mut wi, mut qr, mut qi) =
                ([0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]);
            for l in 0..4 {
                let (phase, slope, c) = self.tile.phase::<FMA>(g + l, m, n);
                let cis = |turns: f64| ((turns - turns.round()) * TAU).sin_cos();
                let (s, k) = cis(phase);
                let (re, im) = (self.tile.re[g + l], self.tile.im[g + l]);
                (zr[l], zi[l]) = (re * k - im * s, re * s + im * k);
                // From n to n + 1 the phase grows by slope + c, and that step by 2c each time.
                (wi[l], wr[l]) = cis(slope + c);
                (qi[l], qr[l]) = cis(2.0 * c);
            }
            let drifts = self.tile.c[g..g + 4].iter().chain(&self.tile.c1[g..g + 4]).any(|c| *c != 0.0);
            for a in acc.iter_mut() {
                a[0] = lanes!(4, l => a[0][l] + zr[l]);
                a[1] = lanes!(4, l => a[1][l] + zi[l]);
                (zr, zi) = turn64::<FMA>(&zr, &zi, &wr, &wi);
                if drifts {
                    (wr, wi) = turn64::<FMA>(&wr, &wi, &qr, &qi);
                }
            }
        }
        for (s, a) in self.sum.iter_mut().zip(acc) {
            s.re += (a[0][0] + a[0][1]) + (a[0][2] + a[0][3]);
            s.im += (a[1][0] + a[1][1]) + (a[1][2] + a[1][3]);
        }
    }
}

/// The f32 sum over one segment.
struct Recurrence<'a> {
    tile: &'a Tile,
    chirp: usize,
    start: usize,
    sum: &'a mut [Complex64],
}

type V = [f32; LANES];

#[inline(always)]
pub(super) fn madd<const FMA: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// Turns to a fraction of a turn in units of 2⁻³², wrapping. Exact to half a unit for
/// |turns| < 2¹⁸: the sum has one unit as its last place.
#[inline(always)]
pub(super) fn fixed(turns: f64) -> u32 {
    (turns + 1_572_864.0).to_bits() as u32
}

/// A small part of a turn to units of 2⁻³².
#[inline(always)]
fn to_fixed(turns: f32) -> u32 {
    (turns * 4_294_967_296.0) as i32 as u32
}

/// Of an even or odd quadrant, with the sign bit turned.
#[inline(always)]
fn pick(quadrant: u32, even: f32, odd: f32, sign: u32) -> f32 {
    let mask = (quadrant & 1).wrapping_neg();
    f32::from_bits(((odd.to_bits() & mask) | (even.to_bits() & !mask)) ^ sign)
}

/// Cosine and sine of a phase in units of 2⁻³² turn; error below 2e-7.
#[inline(always)]
pub(super) fn cis<const FMA: bool>(p: &[u32; LANES]) -> (V, V) {
    let quadrant: [u32; LANES] = lanes!(LANES, l => p[l].wrapping_add(1 << 29) >> 30);
    let x = lanes!(LANES, l => p[l].wrapping_sub(quadrant[l] << 30) as i32 as f32 * (std::f32::consts::TAU / 4_294_967_296.0));
    let x2 = lanes!(LANES, l => x[l] * x[l]);
    // Taylor to x^9 and x^8: below 2e-9 and 3e-8 at pi/4.
    let s = lanes!(LANES, l => madd::<FMA>(x2[l], 1.0 / 362_880.0, -1.0 / 5040.0));
    let s = lanes!(LANES, l => madd::<FMA>(x2[l], s[l], 1.0 / 120.0));
    let s = lanes!(LANES, l => madd::<FMA>(x2[l], s[l], -1.0 / 6.0));
    let s = lanes!(LANES, l => madd::<FMA>(x2[l] * x[l], s[l], x[l]));
    let c = lanes!(LANES, l => madd::<FMA>(x2[l], 1.0 / 40_320.0, -1.0 / 720.0));
    let c = lanes!(LANES, l => madd::<FMA>(x2[l], c[l], 1.0 / 24.0));
    let c = lanes!(LANES, l => madd::<FMA>(x2[l], c[l], -0.5));
    let c = lanes!(LANES, l => madd::<FMA>(x2[l], c[l], 1.0));
    // Odd quadrants swap; the sign bits follow from the quadrant's bits.
    let cos = lanes!(LANES, l => pick(quadrant[l], c[l], s[l], ((quadrant[l] + 1) & 2) << 30));
    let sin = lanes!(LANES, l => pick(quadrant[l], s[l], c[l], (quadrant[l] & 2) << 30));
    (cos, sin)
}

impl Vectorised for Recurrence<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FMA: bool>(self) {
        let tile = self.tile;
        let n = tile.len();
        // Phase and half the phase step, in 2^-32 turns, at the middle of the segment.
        let middle = (self.start + self.sum.len() / 2) as f64;
        let mut phase = [0u32; TILE];
        let mut half_step = [0u32; TILE];
        let mut drift = [0f32; TILE];
        let (mut re, mut im) = ([0f32; TILE], [0f32; TILE]);
        for i in 0..n {
            let (p, s, c) = tile.phase::<FMA>(i, self.chirp as f64, middle);
            (phase[i], half_step[i]) = (fixed(p), fixed(0.5 * s));
            drift[i] = c as f32;
            (re[i], im[i]) = (tile.re[i] as f32, tile.im[i] as f32);
        }
        let mut half = HALF;
        while half > 1 && tile.largest_drift * (half * half) as f64 > DRIFT_FIRST_ORDER {
            half /= 2;
        }
        let drifts = tile.largest_drift * (half * half) as f64 > DRIFT_SEEN;
        let half_length = self.sum.len() / 2;
        for (block, sum) in self.sum.chunks_mut(2 * half).enumerate() {
            // Twice the distance from the segment's middle to the block's, which lies between two samples.
            let twice = (4 * block * half + 2 * half) as i32 - 2 * half_length as i32 - 1;
            let echoes = TileEchoes {
                n,
                twice,
                phase: &phase,
                half_step: &half_step,
                drift: &drift,
                re: &re,
                im: &im,
            };
            let mut acc = Sums([[[0.0; LANES]; 4]; HALF]);
            let acc = &mut acc.0[..half];
            if drifts {
                echoes.add::<FMA, true>(acc);
            } else {
                echoes.add::<FMA, false>(acc);
            }
            for (k, a) in acc.iter().enumerate() {
                // Loops where they stand: `map` of an array and operators of complex numbers may be compiled as calls for each sample.
                let mut of = [0.0f64; 4];
                for (sum, lanes) in of.iter_mut().zip(a) {
                    // Halves are added to halves: vectors, and no chain of eight additions.
                    let four = lanes!(4, l => lanes[l] as f64 + lanes[l + 4] as f64);
                    *sum = (four[0] + four[2]) + (four[1] + four[3]);
                }
                let [xc, ys, yc, xs] = of;
                if let Some(after) = sum.get_mut(half + k) {
                    (after.re, after.im) = (after.re + (xc - ys), after.im + (yc + xs));
                }
                if let Some(before) = sum.get_mut(half - 1 - k) {
                    (before.re, before.im) = (before.re + (xc + ys), before.im + (yc - xs));
                }
            }
        }
    }
}

/// Kept from straddling cache lines.
#[repr(align(64))]
struct Sums([[V; 4]; HALF]);

/// (k + ½)².
const SQUARES: [f32; HALF] = {
    let mut o = [0.0; HALF];
    let mut k = 0;
    while k < HALF {
        o[k] = (k as f32 + 0.5) * (k as f32 + 0.5);
        k += 1;
    }
    o
};

struct TileEchoes<'a> {
    n: usize,
    twice: i32,
    phase: &'a [u32; TILE],
    half_step: &'a [u32; TILE],
    drift: &'a [f32; TILE],
    re: &'a [f32; TILE],
    im: &'a [f32; TILE],
}

impl TileEchoes<'_> {
    /// For samples at ±(k + ½) from the middle of the block, the four sums of x cos, y sin, y cos
    /// and x sin of (k + ½)θ, where x + jy is the phasor in the middle and θ the phase step: both
    /// samples follow from them.
    #[inline(always)]
    fn add<const FMA: bool, const DRIFT: bool>(&self, acc: &mut [[V; 4]]) {
        let offset = 0.5 * self.twice as f32;
        let groups = self.n / LANES;
        for g in 0..groups {
            let at = g * LANES;
            let drift = lanes!(LANES, l => self.drift[at + l]);
            let mut half_step: [u32; LANES] = lanes!(LANES, l => self.half_step[at + l]);
            let mut phase: [u32; LANES] = lanes!(LANES, l => self.phase[at + l]);
            for l in 0..LANES {
                phase[l] = phase[l].wrapping_add(half_step[l].wrapping_mul(self.twice as u32));
                phase[l] = phase[l].wrapping_add(to_fixed(offset * offset * drift[l]));
                half_step[l] = half_step[l].wrapping_add(to_fixed(offset * drift[l]));
            }
            let (pc, ps) = cis::<FMA>(&phase);
            let (mut c, mut s) = cis::<FMA>(&half_step);
            let (re, im) = (lanes!(LANES, l => self.re[at + l]), lanes!(LANES, l => self.im[at + l]));
            let x = lanes!(LANES, l => madd::<FMA>(re[l], pc[l], -(im[l] * ps[l])));
            let y = lanes!(LANES, l => madd::<FMA>(re[l], ps[l], im[l] * pc[l]));
            // 2 cos θ without the loss of digits of the plain form at small θ.
            let two = lanes!(LANES, l => madd::<FMA>(-4.0 * s[l], s[l], 2.0));
            let (mut c_before, mut s_before) = (c, lanes!(LANES, l => -s[l]));
            let tau = std::f32::consts::TAU;
            let (xd, yd) =
                (lanes!(LANES, l => -tau * drift[l] * y[l]), lanes!(LANES, l => tau * drift[l] * x[l]));
            for (k, a) in acc.iter_mut().enumerate() {
                let (xk, yk) = if DRIFT {
                    let o2 = SQUARES[k];
                    (
                        lanes!(LANES, l => madd::<FMA>(xd[l], o2, x[l])),
                        lanes!(LANES, l => madd::<FMA>(yd[l], o2, y[l])),
                    )
                } else {
                    (x, y)
                };
                a[0] = lanes!(LANES, l => madd::<FMA>(xk[l], c[l], a[0][l]));
                a[1] = lanes!(LANES, l => madd::<FMA>(yk[l], s[l], a[1][l]));
                a[2] = lanes!(LANES, l => madd::<FMA>(yk[l], c[l], a[2][l]));
                a[3] = lanes!(LANES, l => madd::<FMA>(xk[l], s[l], a[3][l]));
                let c_next = lanes!(LANES, l => madd::<FMA>(two[l], c[l], -c_before[l]));
                let s_next = lanes!(LANES, l => madd::<FMA>(two[l], s[l], -s_before[l]));
                (c_before, s_before, c, s) = (c, s, c_next, s_next);
            }
        }
    }
}
