//! Phase noise and jitter on a cube without noise (CONVENTIONS eq. 100-104).
//!
//! An echo of delay τ = f_b/S is to be multiplied by e^{j(φ(t) − φ(t − τ))}. With e^{−jφ(t)} = Σ E_ν e^{2πjνt}
//! its line at ν is the record x moved by ν/S, times E_ν e^{2πjνt}. All echoes together get it from three
//! transforms: disperse x by e^{jπf²/S}, which moves each tone by its own delay, multiply by φ's factor, itself dispersed,
//! and take the dispersion back. This is the removal of nonlinearity of the sweep in FMCW SAR (Meta,
//! Hoogeboom and Ligthart, IEEE Trans. GRS 45, 2007, 3519) the other way round, without approximation but for the
//! record's ends, where x must be known a little farther: `Chain::margin`.
//!
//! The Doppler shift counts as delay here: at 30 m/s and 25 MHz/µs as 9 cm of range.

use crate::adc::Cube;
use crate::adc::cpu::precision::{narrow, wide};
use crate::adc::cpu::synthesis::Precision;
use crate::adc::front_end::phase_noise::{Stretch, fast_length, line, reach, stretches};
use crate::adc::front_end::timing::Timing;
use crate::adc::front_end::{Chain, TAPER, jitter};
use crate::base::error::{Error, Result};
use crate::base::tasks::Tasks;
use crate::scene::front_end::PhaseNoise;
use crate::scene::radar::Sampling;
use catseye_math::Real;
use catseye_math::fft::Fft;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::{Arc, OnceLock};

/// The oscillator and the clock of one frame.
pub struct Oscillator<'a> {
    chain: &'a Chain,
    seed: u64,
    frame: u32,
    margin: usize,
    samples: usize,
    /// None when all is off.
    grid: Option<Grid>,
    /// φ of each stretch of ramps, drawn when the first of them comes.
    stretches: Vec<(Stretch, OnceLock<Vec<f64>>)>,
}

impl<'a> Oscillator<'a> {
    /// Prepares the oscillator for rows of `row` samples with a margin of `margin` at either end.
    ///
    /// # Errors
    /// Returns an error for a margin as long as the row, or a sweep too slow for phase noise.
    pub fn new(chain: &'a Chain, row: usize, margin: usize, seed: u64, frame: u32) -> Result<Self> {
        let (s, timing) = (&chain.settings, &chain.timing);
        if row <= 2 * margin {
            return Err(Error::Failed(format!("a margin of {margin} samples in rows of {row} samples")));
        }
        let samples = row - 2 * margin;
        let mut o = Oscillator { chain, seed, frame, margin, samples, grid: None, stretches: Vec::new() };
        if s.phase_noise.is_none() && s.chirp_jitter_rms_s.is_none() && s.aperture_jitter_rms_s.is_none() {
            return Ok(o);
        }
        let reach = if s.phase_noise.is_some() { reach(timing) } else { 0 };
        if reach > 2 * samples {
            return Err(Error::Failed(format!(
                "phase noise: the {:e} Hz swept while sampling are too few for a sample rate of {:e} Hz",
                timing.slope_hz_per_s.abs() * samples as f64 / timing.sample_rate_hz,
                timing.sample_rate_hz
            )));
        }
        let grid = Grid::new(timing, samples, margin, reach, s.phase_noise.is_some());
        if s.phase_noise.is_some() {
            let cut = stretches(timing, samples, 2 * grid.n, 2 * grid.n);
            o.stretches = cut.into_iter().map(|s| (s, OnceLock::new())).collect();
        }
        o.grid = Some(grid);
        Ok(o)
    }

    /// Loops from `first_loop` on, without the margins. The cube must fit the chain.
    ///
    /// # Errors
    /// Returns an error for a margin as long as the row, or a sweep too slow for phase noise.
    pub fn block<T: Precision + Real>(&self, cube: Cube<T>, first_loop: usize) -> Result<Cube<T>> {
        let row = self.samples + 2 * self.margin;
        if cube.samples != row {
            return Err(Error::Failed(format!("rows of {} samples in place of {row}", cube.samples)));
        }
        if self.grid.is_none() && self.margin == 0 {
            return Ok(cube);
        }
        let mut out = Cube::<T>::zeros(cube.chirps, cube.channels, self.samples);
        let Some(grid) = &self.grid else {
            for (o, row) in out.data.chunks_mut(self.samples).zip(cube.data.chunks(row)) {
                o.copy_from_slice(&row[self.margin..self.margin + self.samples]);
            }
            return Ok(out);
        };
        let slots = self.chain.timing.slots;
        let rows = cube.channels / slots;
        let job = Job { grid, chain: self.chain, seed: self.seed, frame: self.frame };
        let first_ramp = first_loop * slots;
        out.data
            .par_chunks_mut(rows * self.samples)
            .zip(cube.data.par_chunks(rows * row))
            .enumerate()
            .for_each_init_tasks(
                || Scratch::new(grid),
                |scratch, (i, (to, from))| {
                    let ramp = first_ramp + i;
                    job.ramp(ramp, self.around(ramp), from, to, scratch);
                },
            );
        Ok(out)
    }

    /// φ around a ramp; None when there is no phase noise.
    fn around(&self, ramp: usize) -> Option<Around<'_>> {
        let noise = self.chain.settings.phase_noise.as_ref()?;
        let number = self.stretches.partition_point(|(s, _)| s.ramps.end <= ramp);
        let (stretch, phase) = self.stretches.get(number)?;
        let draw = || draw(noise, &self.chain.timing, stretch, self.seed, self.frame, number);
        Some(Around { phase: phase.get_or_init(draw), first: stretch.first[ramp - stretch.ramps.start] })
    }
}

/// φ at every half sample of a stretch, radians.
fn draw(
    p: &PhaseNoise,
    timing: &Timing,
    stretch: &Stretch,
    seed: u64,
    frame: u32,
    number: usize,
) -> Vec<f64> {
    let m = stretch.length;
    let spacing_hz = 2.0 * timing.sample_rate_hz / m as f64;
    let mut lines = vec![Complex64::ZERO; m];
    for (i, z) in lines.iter_mut().enumerate() {
        let k = if 2 * i > m { i as i64 - m as i64 } else { i as i64 };
        // Offsets up to f_s/2: a quarter of the grid's rate to either side.
        if k != 0 && 4 * k.unsigned_abs() as usize <= m {
            *z = line(p, spacing_hz, k, seed, frame, number);
        }
    }
    catseye_math::fft::inverse(m).process(&mut lines);
    lines.into_iter().map(|z| z.re).collect()
}

/// Transforms of one row. Frequencies are counted in bins of f_s/n; the second grid has twice the rate.
struct Grid {
    n: usize,
    samples: usize,
    margin: usize,
    reach: usize,
    /// Lowest beat frequency of the band, in bins.
    low: i64,
    is_real: bool,
    /// For each place of the first grid's transform: its frequency in bins, its place in the second grid, and its
    /// factor there.
    enter: Vec<(i64, usize, Complex64)>,
    /// e^{jπf²/S} on the second grid, in the order of its transform, for offsets; its inverse for beat
    /// frequencies.
    disperse_noise: Vec<Complex64>,
    gather: Vec<Complex64>,
    bin_hz: f64,
    short: Arc<dyn Fft<f64>>,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Grid {
    /// `has_noise`: with dispersion, for phase noise.
    fn new(timing: &Timing, samples: usize, margin: usize, reach: usize, has_noise: bool) -> Grid {
        let n = fast_length((samples + 2 * margin).max(samples + 2 * reach + TAPER));
        let falling = timing.slope_hz_per_s < 0.0;
        let is_real = timing.sampling == Sampling::Real;
        let bins = n as i64;
        // What leaks out of the band below its first cell, or moves faster than it is far away, still
        // counts as near: a thirty-second of the band.
        let below = if is_real { 0 } else { bins / 32 };
        let low = if falling { below - bins + 1 } else { -below };
        let bin_hz = timing.sample_rate_hz / n as f64;
        let disperse = |bin: i64| {
            let f = bin as f64 * bin_hz;
            let turns = 0.5 * f * f / timing.slope_hz_per_s;
            Complex64::cis(TAU * (turns - turns.round()))
        };
        let enter = (0..bins).map(|k| {
            let bin = signed(k, low, bins);
            let mut factor = Complex64::from(1.0 / n as f64);
            if is_real {
                // Of a real record the half with the beat's sign, twice: Re of it is the record.
                factor *= match (2 * bin.abs()).cmp(&bins) {
                    _ if bin == 0 => 1.0,
                    Ordering::Less => 2.0,
                    Ordering::Equal => 1.0,
                    Ordering::Greater => 0.0,
                };
            }
            if has_noise {
                factor *= disperse(bin);
            }
            (bin, bin.rem_euclid(2 * bins) as usize, factor)
        });
        let gather = |i| disperse(signed(i, low - bins / 2, 2 * bins)).conj() / (2 * bins) as f64;
        Grid {
            n,
            samples,
            margin,
            reach,
            low,
            is_real,
            enter: enter.collect(),
            disperse_noise: (0..2 * bins).map(|i| disperse(signed(i, -bins, 2 * bins))).collect(),
            gather: (0..2 * bins).map(gather).collect(),
            bin_hz,
            short: catseye_math::fft::forward(n),
            forward: catseye_math::fft::forward(2 * n),
            inverse: catseye_math::fft::inverse(2 * n),
        }
    }

    /// Frequency of place `i` of the second grid's transform, Hz.
    fn freq_hz(&self, i: usize) -> f64 {
        let n = self.n as i64;
        signed(i as i64, self.low - n / 2, 2 * n) as f64 * self.bin_hz
    }
}

/// The number in low..low + n that equals `i` modulo n.
fn signed(i: i64, low: i64, n: i64) -> i64 {
    (i - low).rem_euclid(n) + low
}

/// φ around a ramp: `phase`, periodic, with the ramp's first sample at `first`.
#[derive(Clone, Copy)]
struct Around<'a> {
    phase: &'a [f64],
    first: usize,
}

impl Around<'_> {
    fn at(&self, half_samples: i64) -> f64 {
        self.phase[(self.first as i64 + half_samples).rem_euclid(self.phase.len() as i64) as usize]
    }
}

/// Work of one thread. The last four hold for all rows of a ramp.
struct Scratch {
    row: Vec<Complex64>,
    wide: Vec<Complex64>,
    sum: Vec<Complex64>,
    fft: Vec<Complex64>,
    /// e^{−jφ}, dispersed.
    delayed: Vec<Complex64>,
    /// e^{jφ} at the samples.
    own: Vec<Complex64>,
    /// Delay of each sample, s.
    late_s: Vec<f64>,
    /// e^{−2πjfδ} of a late ramp.
    turn: Vec<Complex64>,
}

impl Scratch {
    fn new(g: &Grid) -> Scratch {
        let lengths = [&g.short, &g.forward, &g.inverse].map(|f| f.get_inplace_scratch_len());
        let zeros = |n: usize| vec![Complex64::ZERO; n];
        Scratch {
            row: zeros(g.n),
            wide: zeros(2 * g.n),
            sum: zeros(g.samples),
            fft: zeros(lengths.into_iter().max().unwrap_or(0)),
            delayed: zeros(2 * g.n),
            own: Vec::new(),
            late_s: Vec::new(),
            turn: Vec::new(),
        }
    }
}

struct Job<'a> {
    grid: &'a Grid,
    chain: &'a Chain,
    seed: u64,
    frame: u32,
}

impl Job<'_> {
    fn ramp<T: Precision + Real>(
        &self,
        ramp: usize,
        around: Option<Around<'_>>,
        from: &[Complex<T>],
        to: &mut [Complex<T>],
        s: &mut Scratch,
    ) {
        let g = self.grid;
        let settings = &self.chain.settings;
        if let Some(a) = around {
            self.delayed_factor(a, s);
            s.own = (0..g.samples).map(|n| Complex64::cis(a.at(2 * n as i64))).collect();
        }
        if let Some(rms) = settings.chirp_jitter_rms_s {
            let late_s = jitter::chirp_start_s(rms, self.seed, self.frame, ramp);
            let turn =
                |(bin, ..): &(i64, usize, Complex64)| Complex64::cis(-TAU * *bin as f64 * g.bin_hz * late_s);
            s.turn = g.enter.iter().map(turn).collect();
        }
        if let Some(rms) = settings.aperture_jitter_rms_s {
            let late = |n| jitter::aperture_s(rms, self.seed, self.frame, ramp, n);
            s.late_s = (0..g.samples).map(late).collect();
        }
        let long = g.samples + 2 * g.margin;
        for (from, to) in from.chunks(long).zip(to.chunks_mut(g.samples)) {
            self.spectrum(from, s);
            if around.is_some() {
                g.inverse.process_with_scratch(&mut s.wide, &mut s.fft);
                s.wide.iter_mut().zip(&s.delayed).for_each(|(z, f)| *z *= f);
                g.forward.process_with_scratch(&mut s.wide, &mut s.fft);
                s.wide.iter_mut().zip(&g.gather).for_each(|(z, d)| *z *= d);
            }
            self.clock(s);
            for (n, o) in to.iter_mut().enumerate() {
                let z = s.sum[n] * s.own.get(n).copied().unwrap_or(Complex64::ONE);
                *o = narrow(if g.is_real { Complex64::from(z.re) } else { z });
            }
        }
    }

    /// e^{−jφ}, made periodic outside the part that the record's echoes see, and dispersed.
    fn delayed_factor(&self, a: Around<'_>, s: &mut Scratch) {
        let g = self.grid;
        let length = 2 * g.n as i64;
        // Echoes see φ from the longest delay before the first sample to the last one.
        let (from, to) = (-4 * g.reach as i64, 2 * g.samples as i64);
        let rest = (length - (to - from)) as f64;
        for (q, f) in s.delayed.iter_mut().enumerate() {
            let at = signed(q as i64 - 2 * g.margin as i64, from, length);
            let phase = if at < to {
                a.at(at)
            } else {
                let share = smooth(((at - to) as f64 + 0.5) / rest);
                (1.0 - share) * a.at(at) + share * a.at(at - length)
            };
            *f = Complex64::cis(-phase);
        }
        g.forward.process_with_scratch(&mut s.delayed, &mut s.fft);
        let scale = 1.0 / length as f64;
        s.delayed.iter_mut().zip(&g.disperse_noise).for_each(|(z, d)| *z *= d * scale);
        g.inverse.process_with_scratch(&mut s.delayed, &mut s.fft);
    }

    /// Transform of a row with its margins faded out, on the grid of twice the rate: into `wide`.
    fn spectrum<T: Real>(&self, from: &[Complex<T>], s: &mut Scratch) {
        let g = self.grid;
        s.row.fill(Complex64::ZERO);
        for (r, z) in s.row.iter_mut().zip(from) {
            *r = wide(*z);
        }
        let fade = g.margin.min(TAPER);
        for i in 0..fade {
            let w = smooth((i as f64 + 0.5) / fade as f64);
            s.row[i] *= w;
            s.row[from.len() - 1 - i] *= w;
        }
        g.short.process_with_scratch(&mut s.row, &mut s.fft);
        if !s.turn.is_empty() {
            s.row.iter_mut().zip(&s.turn).for_each(|(z, t)| *z *= t);
        }
        s.wide.fill(Complex64::ZERO);
        for (z, (_, place, factor)) in s.row.iter().zip(&g.enter) {
            s.wide[*place] = z * factor;
        }
    }

    /// Computes the samples in `sum`, each at its own instant, from the transform in `wide`: to second order in 2πf δ.
    fn clock(&self, s: &mut Scratch) {
        let g = self.grid;
        if s.late_s.is_empty() {
            g.inverse.process_with_scratch(&mut s.wide, &mut s.fft);
            for (n, z) in s.sum.iter_mut().enumerate() {
                *z = s.wide[2 * (n + g.margin)];
            }
            return;
        }
        s.sum.fill(Complex64::ZERO);
        let mut derivative = s.wide.clone();
        for order in 0..3 {
            s.wide.copy_from_slice(&derivative);
            g.inverse.process_with_scratch(&mut s.wide, &mut s.fft);
            for (n, z) in s.sum.iter_mut().enumerate() {
                let late = s.late_s[n];
                *z += s.wide[2 * (n + g.margin)] * [1.0, late, 0.5 * late * late][order];
            }
            for (i, z) in derivative.iter_mut().enumerate() {
                *z *= Complex64::new(0.0, TAU * g.freq_hz(i));
            }
        }
    }
}

/// Rises from 0 to 1 with three smooth derivatives at the ends.
fn smooth(u: f64) -> f64 {
    let s = (FRAC_PI_2 * u).sin();
    (FRAC_PI_2 * s * s).sin().powi(2)
}
