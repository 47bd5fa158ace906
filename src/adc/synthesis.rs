//! What each echo contributes to each channel: CONVENTIONS eq. 9-12, worked out once in f64 so that
//! an engine is left with a sum of phasors whose phase is quadratic in chirp and sample.
//!
//! **Front end.** The anti-alias filter is ideal and flat. "iq" passes beat frequencies in
//! 0..f_s, "real" passes |f_b| < f_s/2 (a real mixer cannot tell the sign). An echo's beat frequency
//! is taken at the middle of the frame and of the sampled part of the ramp, Doppler shift included,
//! at the phase centre. An echo outside is dropped whole, counted and its power reported; nothing
//! wraps round into the first range cells.

use super::front_end::channels;
use super::methods::Methods;
use super::noise::Noise;
use super::{Cube, CubePiece, DeviceCube};
use crate::base::error::{Error, Result};
use crate::base::frames::angles_from_direction;
use crate::base::tasks::{PART, Tasks, in_parts};
use crate::base::units::{C0, power_from_db, w_from_dbm};
use crate::gpu::{Access, Gpu, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::{Antenna, Radar, Sampling};
use crate::scene::waveform::{FrequencySamples, Multiplex, Waveform};
use crate::trace::{Echo, Echoes};
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// One echo in one channel. In √W and turns, with loop m and sample n counted from zero:
/// sample = amplitude · exp(2πj (a0 + a1 m + a2 m² + a3 m³ + n (b0 + b1 m + b2 m²) + n² (c + c1 m))).
///
/// This is eq. 12 with eq. 11 put in, without approximation where the delay is linear in m and in n. A bent path adds a3, b2,
/// c1 and its part of the others (eq. 142). Real sampling takes √2 Re of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PhasePolynomial {
    /// Amplitude, √W.
    pub amplitude: Complex64,
    /// Phase at the first sample of the first loop, turns.
    pub a0: f64,
    /// Linear in the loop, turns.
    pub a1: f64,
    /// Quadratic in the loop, turns.
    pub a2: f64,
    /// Cubic in the loop, turns.
    pub a3: f64,
    /// Linear in the sample, turns.
    pub b0: f64,
    /// Mixed in loop and sample, turns.
    pub b1: f64,
    /// Linear in the sample and quadratic in the loop, turns.
    pub b2: f64,
    /// Quadratic in the sample, turns.
    pub c: f64,
    /// Quadratic in the sample and linear in the loop, turns.
    pub c1: f64,
}

impl PhasePolynomial {
    /// Phase in turns, not wrapped.
    #[inline(always)]
    pub fn turns(&self, chirp: f64, sample: f64) -> f64 {
        let (m, n) = (chirp, sample);
        self.a0
            + m * (self.a1 + m * (self.a2 + m * self.a3))
            + n * (self.b0 + m * (self.b1 + m * self.b2) + n * (self.c + m * self.c1))
    }

    /// Expands the same polynomial about (chirp, sample) as origin.
    #[inline(always)]
    pub fn about(&self, chirp: f64, sample: f64) -> PhasePolynomial {
        let (m, n) = (chirp, sample);
        let c = self.c + m * self.c1;
        let b1 = self.b1 + 2.0 * m * self.b2;
        PhasePolynomial {
            amplitude: self.amplitude,
            a0: self.turns(m, n),
            a1: self.a1 + m * (2.0 * self.a2 + 3.0 * m * self.a3) + n * (b1 + n * self.c1),
            a2: self.a2 + 3.0 * m * self.a3 + n * self.b2,
            a3: self.a3,
            b0: self.b0 + m * (self.b1 + m * self.b2) + 2.0 * n * c,
            b1: b1 + 2.0 * n * self.c1,
            b2: self.b2,
            c,
            c1: self.c1,
        }
    }
}

/// The echoes of one frame: how many there were, which of them were left out, and how they were summed.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct EchoSummary {
    /// Number of echoes.
    pub echoes: u64,
    /// Of those, the ones whose path length changes. When there are none, one chirp of each
    /// transmitter is synthesised and copied to all loops, which is exact.
    pub moving: u64,
    /// Echoes that the anti-alias filter stopped, and the sum of their powers in channel 0. A face that lies too far for any echo of
    /// it to be received is not traced and counts as one, without its power.
    pub dropped: u64,
    /// Power of the echoes that fall out of the receiver's band, W.
    pub dropped_power_w: f64,
    /// Echoes that went into others of the same place and way.
    pub merged: u64,
    /// Echoes that were left out because all of them together cannot show, and the sum of their powers, mean over channels.
    pub left_out: u64,
    /// Power of the echoes that were left out, W.
    pub left_out_power_w: f64,
    /// Number of bounces that were traced; 0 where it is not known.
    pub bounces: u64,
    /// Power of the echoes, W: those of one chain in one range cell are added up with their phases.
    pub power_w: f64,
    /// Power of what one bounce more would have brought, W: an estimate, seldom 6 dB too low or 20 dB too high (CONVENTIONS eq. 68).
    pub cut_power_w: f64,
    /// Echoes that were left out because they are not finite.
    pub broken: u64,
    /// How the echoes were summed.
    pub synthesis: Methods,
}

impl EchoSummary {
    /// What is known of a frame's echoes before anything is synthesised of them.
    pub fn of_echoes(echoes: &Echoes) -> EchoSummary {
        EchoSummary {
            echoes: echoes.list.len() as u64,
            dropped: echoes.beyond_reach,
            merged: echoes.merged,
            left_out: echoes.left_out,
            left_out_power_w: echoes.left_out_power_w,
            bounces: echoes.bounces as u64,
            power_w: echoes.power_w,
            cut_power_w: echoes.cut_power_w,
            broken: echoes.broken,
            ..Default::default()
        }
    }

    /// Adds up the statistics of one frame's echoes through two ramps.
    pub fn and(&self, other: &EchoSummary) -> EchoSummary {
        EchoSummary {
            echoes: self.echoes.max(other.echoes),
            moving: self.moving.max(other.moving),
            dropped: self.dropped.max(other.dropped),
            dropped_power_w: self.dropped_power_w.max(other.dropped_power_w),
            merged: self.merged.max(other.merged),
            left_out: self.left_out.max(other.left_out),
            left_out_power_w: self.left_out_power_w.max(other.left_out_power_w),
            bounces: self.bounces.max(other.bounces),
            power_w: self.power_w.max(other.power_w),
            cut_power_w: self.cut_power_w.max(other.cut_power_w),
            broken: self.broken.max(other.broken),
            synthesis: self.synthesis,
        }
    }
}

/// A set of the echoes of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// Echoes that are the same in every loop.
    Still,
    /// Echoes that move against the radar.
    Moving,
}

/// One transmitter received by one receiver in one slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TxRxPair {
    pub(super) tx: usize,
    pub(super) rx: usize,
    pub(super) slot: usize,
    /// Index of its amplitude among those of one echo: ways between equal antennas share it.
    pub(super) kind: usize,
    /// Sign of its code times the error of its channel.
    pub(super) factor: Complex64,
    /// Turns that the transmitter's phase code adds from loop to loop.
    pub(super) code_turns: f64,
}

/// The ways of one radar, ordered by slot, then transmitter, then receiver: for transmitters in turn one for each channel,
/// else several that add up to one.
fn ways(radar: &Radar, kind: &[usize]) -> Vec<TxRxPair> {
    let errors = match &radar.front_end.channels {
        Some(e) => channels::gains(e, radar.tx.len(), radar.rx.len()),
        None => Vec::new(),
    };
    let (n_tx, n_rx) = (radar.tx.len(), radar.rx.len());
    let mut list = Vec::new();
    for slot in 0..radar.slots() {
        for tx in 0..n_tx {
            let sign = radar.multiplex.weight(slot, tx);
            if sign == 0.0 {
                continue;
            }
            let code_turns = match radar.multiplex {
                // What is sent turns forwards, the mixer's output backwards (eq. 12).
                Multiplex::Ddm { bands } => -(tx as f64) / bands as f64,
                _ => 0.0,
            };
            list.extend((0..n_rx).map(|rx| {
                let pair = tx * n_rx + rx;
                let error = errors.get(pair).copied().unwrap_or(Complex64::ONE);
                TxRxPair { tx, rx, slot, kind: kind[pair], factor: sign * error, code_turns }
            }));
        }
    }
    list
}

/// The echoes of one frame as one radar receives them, as lines (eq. 12a). Made once, read by either engine.
///
/// A channel of a plan is one way from a transmitter to a receiver; [`Plan::fold`] adds those up that the
/// receiver hears at once.
pub struct Plan<'a> {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of channels.
    pub channels: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Whether the lines are real or complex; what is not mixed with the sweep is real, if at all, only after shaping.
    pub sampling: Sampling,
    /// What the front end did with the echoes.
    pub echo_summary: EchoSummary,
    pub(super) radar: &'a Radar,
    lines: FrequencySamples,
    pub(super) echoes: &'a [Echo],
    still: Vec<u32>,
    moving: Vec<u32>,
    pub(super) ways: Vec<TxRxPair>,
    /// conj(a0) of eq. 12, `[return, kind]`.
    pub(super) amplitudes: Vec<Complex64>,
    pub(super) kinds: usize,
    /// Σ|A|² over all echoes that are received, for each kind.
    power: Vec<f64>,
}

impl<'a> Plan<'a> {
    /// Plans the synthesis of the lines that processing sees, except for pulses and codes, whose lines
    /// [`crate::adc::shaping`] turns into samples.
    ///
    /// # Errors
    /// Returns an error if an echo is not finite.
    pub fn new(radar: &'a Radar, echoes: &'a Echoes) -> Result<Plan<'a>> {
        Self::with_lines(radar, radar.lines(), echoes)
    }

    /// Plans the synthesis of frequency lines other than the radar's own.
    ///
    /// # Errors
    /// Returns an error if an echo is not finite.
    pub fn with_lines(radar: &'a Radar, lines: FrequencySamples, echoes: &'a Echoes) -> Result<Plan<'a>> {
        let filters = &radar.front_end.filters;
        let echo_summary = EchoSummary::of_echoes(echoes);
        let echoes = &echoes.list[..];
        if echoes.len() > u32::MAX as usize {
            return Err(Error::Failed(format!("the frame has {} echoes; the limit is 2^32", echoes.len())));
        }
        // Whether each is finite, and whether the receiver's filter passes it.
        let known = in_parts(echoes, |r| (is_finite(r), passes(radar, r)));
        if let Some(i) = known.iter().position(|(is_finite, _)| !is_finite) {
            return Err(Error::Failed(format!("echo {i} is not finite: {:?}", echoes[i])));
        }
        let levels = Levels::new(radar);
        let kinds = levels.pairs.len();
        let mut amplitudes = vec![Complex64::ZERO; kinds * echoes.len()];
        let parts = amplitudes.par_chunks_mut((kinds * PART).max(1)).zip(echoes.par_chunks(PART));
        parts.for_each_tasks(|(to, echoes)| {
            for (to, r) in to.chunks_exact_mut(kinds.max(1)).zip(echoes) {
                to.iter_mut().zip(levels.amplitudes(r)).for_each(|(to, a)| *to = a.conj());
            }
        });
        let ways = ways(radar, &levels.kind);
        let coded = ways.iter().any(|w| w.code_turns != 0.0);
        let mut plan = Plan {
            chirps: radar.chirps,
            channels: ways.len(),
            samples: lines.count,
            sampling: if lines.step_s > 0.0 { radar.sampling } else { Sampling::Iq },
            echo_summary,
            radar,
            lines,
            echoes,
            still: Vec::new(),
            moving: Vec::new(),
            ways,
            amplitudes,
            kinds,
            power: Vec::new(),
        };
        for (i, (r, (_, is_received))) in echoes.iter().zip(known).enumerate() {
            if !is_received {
                plan.echo_summary.dropped += 1;
                plan.echo_summary.dropped_power_w +=
                    plan.ways.first().map_or(0.0, |w| plan.amplitudes[i * kinds + w.kind].norm_sqr());
            } else if r.is_still() && !coded {
                plan.still.push(i as u32);
            } else {
                plan.moving.push(i as u32);
                plan.echo_summary.moving += u64::from(!r.is_still());
            }
        }
        // What a real filter passes it weakens.
        if !filters.is_off() {
            plan = plan.weighted(|r| filters.gain(beat_frequency_hz(radar, r)));
        }
        plan.add_powers();
        Ok(plan)
    }

    /// Multiplies the amplitude of each echo by `factor` of it.
    pub fn weighted(mut self, factor: impl Fn(&Echo) -> Complex64 + Sync) -> Plan<'a> {
        let kinds = self.kinds;
        self.amplitudes.par_chunks_mut(kinds.max(1)).zip(self.echoes).for_each(|(a, r)| {
            let f = factor(r);
            a.iter_mut().for_each(|a| *a *= f);
        });
        self.add_powers();
        self
    }

    fn add_powers(&mut self) {
        self.power = vec![0.0; self.kinds];
        for i in self.still.iter().chain(&self.moving) {
            let of = &self.amplitudes[*i as usize * self.kinds..][..self.kinds];
            self.power.iter_mut().zip(of).for_each(|(p, a)| *p += a.norm_sqr());
        }
    }

    /// Power of all echoes that are received in a channel, Σ|A|², W.
    pub fn power(&self, channel: usize) -> f64 {
        let way = &self.ways[channel];
        self.power[way.kind] * way.factor.norm_sqr()
    }

    /// Mean of [`Plan::power`] over channels, W.
    pub fn mean_power_w(&self) -> f64 {
        (0..self.channels).map(|c| self.power(c)).sum::<f64>() / self.channels.max(1) as f64
    }

    /// Power |A|² of each echo of `indices`, mean over channels, W.
    pub fn echo_powers_w<'p>(&'p self, indices: &'p [u32]) -> impl IndexedParallelIterator<Item = f64> + 'p {
        let mut share = vec![0.0; self.kinds];
        for way in &self.ways {
            share[way.kind] += way.factor.norm_sqr() / self.ways.len() as f64;
        }
        indices.par_iter().map(move |i| {
            let of = &self.amplitudes[*i as usize * self.kinds..][..self.kinds];
            of.iter().zip(&share).map(|(a, s)| s * a.norm_sqr()).sum()
        })
    }

    /// Power of the thermal noise in a cell of one channel's map, without windows, W. None without noise.
    pub fn noise_of_cell_w(&self) -> Option<f64> {
        let noise = Noise::thermal(self.radar, 0, 0)?;
        Some(2.0 * noise.sigma * noise.sigma / (self.chirps * self.samples) as f64)
    }

    /// Turns that the code of a channel's transmitter adds from loop to loop.
    pub fn code_turns(&self, channel: usize) -> f64 {
        self.ways[channel].code_turns
    }

    /// Ranges of neighbouring channels whose transmitters have the same code.
    pub fn channels_by_code(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.ways.chunk_by(|a, b| a.code_turns == b.code_turns).scan(0, |from, some| {
            *from += some.len();
            Some(*from - some.len()..*from)
        })
    }

    /// Indices of the set's echoes among those of the frame.
    pub fn set(&self, set: Set) -> &[u32] {
        match set {
            Set::Still => &self.still,
            Set::Moving => &self.moving,
        }
    }

    /// The phase polynomial of echo `index` in `channel`.
    pub fn coefficients(&self, index: u32, channel: usize) -> PhasePolynomial {
        self.channel(channel).coefficients(index)
    }

    /// A channel in which many echoes are evaluated: what they have in common is worked out once.
    pub fn channel(&self, channel: usize) -> Channel<'_> {
        let way = self.ways[channel];
        Channel {
            echoes: self.echoes,
            amplitudes: &self.amplitudes,
            kinds: self.kinds,
            way,
            tx_m: self.radar.tx[way.tx].position_m,
            rx_m: self.radar.rx[way.rx].position_m,
            polynomial: self.polynomial(way.slot),
        }
    }

    /// The same as an element at the phase centre would have it.
    pub(super) fn at_phase_centre(&self, channel: usize) -> Channel<'_> {
        Channel { tx_m: DVec3::ZERO, rx_m: DVec3::ZERO, ..self.channel(channel) }
    }

    /// Most by which a1 of an echo differs from that at the phase centre in any channel of the array, turns (eq. 144).
    pub(super) fn spread_over_array(&self, r: &Echo) -> f64 {
        let farthest = |list: &[Antenna]| list.iter().map(|a| a.position_m.length()).fold(0.0, f64::max);
        let rate = |u: DVec3, range: f64, v: DVec3, p: f64| {
            let (across, angle) = (v.reject_from_normalized(u).length(), p / (range - p).max(p));
            if p > 0.0 { angle * (across + 0.5 * angle * v.length()) } else { 0.0 }
        };
        let rate_mps = rate(r.departure, r.first_range_m, r.first_velocity_mps, farthest(&self.radar.tx))
            + rate(r.arrival, r.last_range_m, r.last_velocity_mps, farthest(&self.radar.rx));
        self.lines.first_hz * rate_mps / C0 * self.radar.loop_period_s()
    }

    pub(super) fn polynomial(&self, slot: usize) -> Polynomial {
        Polynomial::new(self.radar, &self.lines, slot)
    }

    /// Largest |c| in turns per sample² of some echoes: how fast the beat frequency drifts during a ramp.
    fn largest_drift(&self, moving: &[u32]) -> f64 {
        let most = |i: &u32| {
            let k = self.coefficients(*i, 0);
            k.c.abs() + self.chirps as f64 * k.c1.abs()
        };
        moving.iter().map(most).fold(0.0, f64::max)
    }

    /// Adds up the ways that the receiver hears at once: `[chirp, way, line]` to `[chirp, channel, line]`.
    pub fn fold<T>(&self, cube: Cube<T>) -> Cube<T>
    where
        T: Default + Copy + Send + Sync + std::ops::AddAssign,
    {
        let channels = self.radar.channels();
        if self.ways.len() == channels {
            return cube;
        }
        let n_rx = self.radar.rx.len();
        let mut sum = Cube::zeros(cube.chirps, channels, cube.samples);
        let rows = cube.data.par_chunks(cube.channels * cube.samples);
        sum.data.par_chunks_mut(channels * cube.samples).zip(rows).for_each_tasks(|(sum, rows)| {
            for (way, row) in self.ways.iter().zip(rows.chunks_exact(cube.samples)) {
                let at = (way.slot * n_rx + way.rx) * cube.samples;
                sum[at..at + cube.samples].iter_mut().zip(row).for_each(|(s, z)| {
                    s.re += z.re;
                    s.im += z.im;
                });
            }
        });
        sum
    }
}

fn is_finite(r: &Echo) -> bool {
    r.path_length_m.is_finite()
        && r.path_rate_mps.is_finite()
        && r.path_acceleration_and_jerk.iter().all(|b| b.is_finite())
        && r.departure.is_finite()
        && r.arrival.is_finite()
        && r.first_range_m.is_finite()
        && r.last_range_m.is_finite()
        && r.first_velocity_mps.is_finite()
        && r.last_velocity_mps.is_finite()
        && r.path_gain.iter().flatten().all(|s| s.is_finite())
}

/// The distinct (tx, rx) antenna pairs, positions apart, and the pair that each channel uses.
fn antenna_pairs(radar: &Radar) -> (Vec<(&Antenna, &Antenna)>, Vec<usize>) {
    let alike = |a: &Antenna, b: &Antenna| {
        a.gain_dbi == b.gain_dbi && a.polarisation == b.polarisation && a.pattern == b.pattern
    };
    let mut pairs: Vec<(&Antenna, &Antenna)> = Vec::new();
    let mut kind = Vec::with_capacity(radar.channels());
    for tx in &radar.tx {
        for rx in &radar.rx {
            let found = pairs.iter().position(|(t, r)| alike(t, tx) && alike(r, rx));
            kind.push(found.unwrap_or_else(|| {
                pairs.push((tx, rx));
                pairs.len() - 1
            }));
        }
    }
    (pairs, kind)
}

/// Amplitudes of echoes one by one (eq. 9).
pub struct Levels<'a> {
    pairs: Vec<(&'a Antenna, &'a Antenna)>,
    kind: Vec<usize>,
    /// √P_t λ/4π.
    scale: f64,
}

impl<'a> Levels<'a> {
    /// The levels of a radar.
    pub fn new(radar: &'a Radar) -> Self {
        let (pairs, kind) = antenna_pairs(radar);
        let scale = w_from_dbm(radar.tx_power_dbm).sqrt() * radar.wavelength_m() / (4.0 * PI);
        Levels { pairs, kind, scale }
    }

    /// Largest factor over the channels from an echo of 1/m in the antennas' main directions to its amplitude, √W.
    pub fn full_gain(&self) -> f64 {
        let gain = |(t, x): &(&Antenna, &Antenna)| power_from_db(t.gain_dbi + x.gain_dbi).sqrt();
        self.scale * self.pairs.iter().map(gain).fold(0.0, f64::max)
    }

    /// a of eq. 9 without its e^{-jkL} for each kind of antenna pair, √W.
    fn amplitudes<'b>(&'b self, r: &'b Echo) -> impl Iterator<Item = Complex64> + 'b {
        self.pairs.iter().map(|(t, x)| self.scale * pair_amplitude(r, t, x))
    }

    /// Amplitude a of eq. 9 without its e^{-jkL}, √W: its square is the power of this echo alone, mean over channels;
    /// its phase is that of channel 0.
    pub fn amplitude(&self, r: &Echo) -> Complex64 {
        let all: Vec<Complex64> = self.amplitudes(r).collect();
        let power: f64 = self.kind.iter().map(|k| all[*k].norm_sqr()).sum();
        let mean = (power / self.kind.len().max(1) as f64).sqrt();
        self.kind.first().map_or(Complex64::ZERO, |k| Complex64::from_polar(mean, all[*k].arg()))
    }
}

impl Levels<'_> {
    /// Amplitude of an echo if all antennas had the polarisation of the largest entry of its path_gain, √W, mean of the
    /// powers over channels.
    pub fn unpolarised(&self, r: &Echo) -> f64 {
        let gain = |(tx, rx): &(&Antenna, &Antenna)| power_gain(tx, r.departure) * power_gain(rx, r.arrival);
        let all: Vec<f64> = self.pairs.iter().map(gain).collect();
        let mean = self.kind.iter().map(|k| all[*k]).sum::<f64>() / self.kind.len().max(1) as f64;
        self.scale * mean.sqrt() * crate::trace::strength(r)
    }
}

/// √(G_t G_r) p_rᵀ [S/(R_t R_r)] p_t of eq. 9, in 1/m.
fn pair_amplitude(r: &Echo, tx: &Antenna, rx: &Antenna) -> Complex64 {
    let gain = power_gain(tx, r.departure) * power_gain(rx, r.arrival);
    let (t, s) = (&tx.polarisation, &r.path_gain);
    let v = s[0][0] * t.v + s[0][1] * t.h;
    let h = s[1][0] * t.v + s[1][1] * t.h;
    gain.sqrt() * (rx.polarisation.v * v + rx.polarisation.h * h)
}

/// Power gain over isotropic of `antenna` towards `direction` in the sensor frame.
pub fn power_gain(antenna: &Antenna, direction: DVec3) -> f64 {
    let (azimuth, elevation) = angles_from_direction(direction);
    crate::base::units::power_from_db(antenna.gain_dbi) * antenna.pattern.power_gain(azimuth, elevation)
}

/// Length of a channel's path, m (eq. 9): from the element to the first scatterer and from the last one back, exact for
/// spherical waves, in the middle of the frame.
pub fn channel_path_m(radar: &Radar, r: &Echo, tx: usize, rx: usize) -> f64 {
    r.path_length_m
        + excess_m(r.departure, r.first_range_m, radar.tx[tx].position_m)
        + excess_m(r.arrival, r.last_range_m, radar.rx[rx].position_m)
}

/// |P − p| − |P| for P = range · direction, free of cancellation.
#[inline]
pub(super) fn excess_m(direction: DVec3, range: f64, p: DVec3) -> f64 {
    let point = direction * range;
    let sum = (point - p).length() + range;
    if sum > 0.0 { (p.length_squared() - 2.0 * point.dot(p)) / sum } else { 0.0 }
}

/// First and second derivative of [`excess_m`] as P moves straight with `velocity` (CONVENTIONS eq. 144), m/s and m/s².
#[inline]
pub(super) fn excess_change(direction: DVec3, range: f64, velocity: DVec3, p: DVec3) -> [f64; 2] {
    let from_p = direction * range - p;
    let distance = from_p.length();
    if distance == 0.0 || range == 0.0 {
        return [0.0; 2];
    }
    let (along, squared) = (velocity.dot(direction), velocity.length_squared());
    let along_p = velocity.dot(from_p) / distance;
    let acceleration = (squared - along_p * along_p) / distance - (squared - along * along) / range;
    [along_p - along, acceleration]
}

/// One channel of a plan.
pub struct Channel<'a> {
    echoes: &'a [Echo],
    amplitudes: &'a [Complex64],
    kinds: usize,
    way: TxRxPair,
    tx_m: DVec3,
    rx_m: DVec3,
    polynomial: Polynomial,
}

impl Channel<'_> {
    /// The phase polynomial of echo `index`.
    #[inline]
    pub fn coefficients(&self, index: u32) -> PhasePolynomial {
        let r = &self.echoes[index as usize];
        let path_m = r.path_length_m
            + excess_m(r.departure, r.first_range_m, self.tx_m)
            + excess_m(r.arrival, r.last_range_m, self.rx_m);
        let amplitude = self.way.factor * self.amplitudes[index as usize * self.kinds + self.way.kind];
        let [tx_mps, tx_mps2] = excess_change(r.departure, r.first_range_m, r.first_velocity_mps, self.tx_m);
        let [rx_mps, rx_mps2] = excess_change(r.arrival, r.last_range_m, r.last_velocity_mps, self.rx_m);
        let [acceleration, jerk] = r.path_acceleration_and_jerk;
        let bend = [acceleration + (tx_mps2 + rx_mps2), jerk];
        let mut c = self.polynomial.coefficients(path_m, r.path_rate_mps + (tx_mps + rx_mps), amplitude);
        if bend != [0.0; 2] {
            self.polynomial.bend(&mut c, path_m, bend);
        }
        c.a1 += self.way.code_turns;
        c
    }
}

/// Eq. 11 in eq. 12a as a polynomial, for one slot. With τ = a + b m + d n: b the change of delay
/// from loop to loop, d from line to line.
pub(super) struct Polynomial {
    /// Slope of the sweep that the echo is mixed with, Hz/s; zero when it is not mixed.
    slope: f64,
    /// Step of the frequency from line to line, Hz; `line` is that of the time, s.
    step: f64,
    line: f64,
    loop_: f64,
    /// Time of the first line of the frame, s.
    start: f64,
    /// Frequency of that line, Hz.
    f: f64,
}

impl Polynomial {
    fn new(radar: &Radar, lines: &FrequencySamples, slot: usize) -> Polynomial {
        Polynomial {
            slope: if lines.dechirped { lines.step_hz / lines.step_s } else { 0.0 },
            step: lines.step_hz,
            line: lines.step_s,
            loop_: radar.loop_period_s(),
            start: radar.chirp_start_s(0, slot) + lines.start_s,
            f: lines.first_hz,
        }
    }

    #[inline(always)]
    pub(super) fn coefficients(&self, path_m: f64, rate: f64, amplitude: Complex64) -> PhasePolynomial {
        let Polynomial { slope, step, line, loop_, start, f } = *self;
        let stretch = 1.0 / (C0 + 0.5 * rate);
        let beta = rate * stretch;
        let a = path_m * stretch + beta * start;
        let (b, d) = (beta * loop_, beta * line);
        PhasePolynomial {
            amplitude,
            a0: f * a - 0.5 * slope * a * a,
            a1: f * b - slope * a * b,
            a2: -0.5 * slope * b * b,
            b0: f * d + step * a - slope * a * d,
            b1: step * b - slope * b * d,
            c: step * d - 0.5 * slope * d * d,
            ..PhasePolynomial::default()
        }
    }

    /// Adds what a bent path does (eq. 142): to first order in the bend, which is a few millimetres, and to second order in the place
    /// in the ramp.
    #[inline(always)]
    pub(super) fn bend(&self, c: &mut PhasePolynomial, path_m: f64, [second, third]: [f64; 2]) {
        let Polynomial { slope, step, line, loop_: l, start: s, f } = *self;
        let turns = (f - slope * path_m / C0) / C0;
        let step = step / C0;
        // Length, and its rate, as polynomials in the loop's number.
        let length = [
            s * s * (0.5 * second + s * third / 6.0),
            l * s * (second + 0.5 * s * third),
            l * l * 0.5 * (second + s * third),
            l * l * l * third / 6.0,
        ];
        let rate = [s * (second + 0.5 * s * third), l * (second + s * third), 0.5 * l * l * third];
        c.a0 += turns * length[0];
        c.a1 += turns * length[1];
        c.a2 += turns * length[2];
        c.a3 += turns * length[3];
        c.b0 += turns * line * rate[0] + step * length[0];
        c.b1 += turns * line * rate[1] + step * length[1];
        c.b2 += turns * line * rate[2] + step * length[2];
        // The change of the rate from line to line, in the middle of the loop.
        let change = [0.5 * line * line * (second + s * third), 0.5 * line * line * l * third];
        c.c += turns * change[0] + step * line * rate[0];
        c.c1 += turns * change[1] + step * line * rate[1];
    }
}

/// Beat frequency of an echo at the middle of the frame and of the samples, Hz: the turns from line to line times
/// the sample rate. Negative for falling frequencies, and when the Doppler shift outweighs the delay.
///
/// # Example
/// The beat of a static point is S·2R/c; a range rate adds its Doppler shift 2v/λ.
///
/// ```
/// use catseye::adc::synthesis::{beat_frequency_hz, point_echo};
/// use catseye::base::units::C0;
/// use catseye::scene::radar_toml::preset;
/// use glam::DVec3;
///
/// let radar = preset("demo77")?;
/// let at_m = DVec3::new(50.0, 0.0, 0.0);
/// let beat_hz = |range_rate_mps: f64| {
///     beat_frequency_hz(&radar, &point_echo(at_m, DVec3::X * range_rate_mps, 1.0, 1))
/// };
/// let expected_hz = radar.slope_hz_per_s() * 2.0 * 50.0 / C0;
/// assert!((beat_hz(0.0) / expected_hz - 1.0).abs() < 1e-9);
/// let doppler_hz = 2.0 * 20.0 / radar.wavelength_m();
/// assert!(((beat_hz(20.0) - beat_hz(0.0)) / doppler_hz - 1.0).abs() < 1e-3);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn beat_frequency_hz(radar: &Radar, r: &Echo) -> f64 {
    let lines = radar.lines();
    let middle = 0.5 * (lines.count as f64 - 1.0);
    let stretch = 1.0 / (C0 + 0.5 * r.path_rate_mps);
    let (tau, d) = (r.path_length_m * stretch, r.path_rate_mps * stretch * lines.step_s);
    let slope = if lines.dechirped { lines.step_hz / lines.step_s } else { 0.0 };
    let turns = (lines.first_hz + middle * lines.step_hz) * d + (lines.step_hz - slope * d) * tau;
    turns * radar.sample_rate_hz
}

/// Whether the receiver hears an echo: an ideal anti-alias filter for what is mixed with the sweep; for pulses it is in time
/// for the samples at some time of the frame; with codes and single tones it always is.
pub fn passes(radar: &Radar, r: &Echo) -> bool {
    match &radar.waveform {
        Waveform::Fmcw(_) => passes_filter(radar, beat_frequency_hz(radar, r)),
        Waveform::Pulse { shape, .. } => {
            let (before, after) = shape.extent_s();
            let delay = r.path_length_m / C0;
            let walk = 0.5 * r.path_rate_mps.abs() * radar.frame_time_s() / C0;
            let end = radar.adc_start_s + radar.samples as f64 / radar.sample_rate_hz;
            (radar.adc_start_s - after - walk..=end + before + walk).contains(&delay)
        }
        // A tone's echo is a constant, whatever its delay: delays fold at one over the step.
        Waveform::Stepped { .. } | Waveform::Coded { .. } => true,
    }
}

/// Whether the anti-alias filter passes this beat frequency: the ideal one, or whatever a real one does not stop altogether.
pub fn passes_filter(radar: &Radar, beat_hz: f64) -> bool {
    let fs = radar.sample_rate_hz;
    let filters = &radar.front_end.filters;
    if filters.low_pass.is_some() {
        return !filters.stops(radar.sampling, fs, beat_hz);
    }
    match radar.sampling {
        Sampling::Iq if radar.step_hz() < 0.0 => beat_hz > -fs && beat_hz <= 0.0,
        Sampling::Iq => (0.0..fs).contains(&beat_hz),
        Sampling::Real => beat_hz.abs() < 0.5 * fs,
    }
}

/// The echo of an isotropic scatterer in free space, with the radar at rest in the origin of the
/// sensor frame: σ in m², position in m, velocity in m/s (CONVENTIONS eq. 3, 7).
pub fn point_echo(position_m: DVec3, velocity_mps: DVec3, sigma_m2: f64, object: u32) -> Echo {
    let range = position_m.length();
    let u = position_m / range;
    let s = Complex64::from((sigma_m2 / (4.0 * PI)).sqrt() / (range * range));
    let mut chain = [0; crate::trace::MAX_BOUNCES];
    chain[0] = object;
    Echo {
        path_length_m: 2.0 * range,
        path_rate_mps: 2.0 * velocity_mps.dot(u),
        path_acceleration_and_jerk: [0.0; 2],
        departure: u,
        first_range_m: range,
        first_velocity_mps: velocity_mps,
        arrival: u,
        last_range_m: range,
        last_velocity_mps: velocity_mps,
        path_gain: [[s, Complex64::ZERO], [Complex64::ZERO, s]],
        chain,
        bounces: 1,
        between_m: Box::default(),
    }
}

gpu_struct! {
    /// Uniform of `shaders/adc/synthesis.wgsl`.
    pub struct SynthesisParams {
        pub chirps: u32,
        pub copies: u32,
        pub channels: u32,
        pub samples: u32,
        pub echoes: u32,
        pub chirp_origin: i32,
        pub sample_origin: i32,
        pub accumulate: u32,
        pub is_real: u32,
    }
}

gpu_struct! {
    /// A `PhasePolynomial` about the middle of frame and ramp as the shader reads it.
    pub struct DeviceEcho {
        pub amplitude: [f32; 2],
        pub a0: u32,
        pub a1: u32,
        pub half_step: u32,
        pub b1: f32,
        pub a2: f32,
        pub c: f32,
        pub a3: f32,
        pub b2: f32,
        pub c1: f32,
        pub pad: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/synthesis",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/adc/synthesis.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(SynthesisParams::LAYOUT),
    storage: &[Access::Read, Access::ReadWrite],
    structs: &[DeviceEcho::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 2e-5,
        reason: "cosine and sine 3e-7, recurrence over 8 steps 64 eps = 4e-6, first order in the drift \
                 of the frequency up to 1.3e-5; sums of up to 1e5 echoes of random phase 1e-5",
    },
};

/// Samples of one thread of the shader.
const BLOCK: u64 = 16;
/// Largest |c| (k + ½)² in turns that the shader follows well enough to first order.
const LARGEST_DRIFT: f64 = 8e-4;

/// 2⁻³² turns, wrapping.
pub(super) fn fixed_turns(turns: f64) -> u32 {
    ((turns - turns.floor()) * 4_294_967_296.0).round() as u64 as u32
}

/// Echoes that one thread walks over, and copies of a row that it writes for each of 16 samples, stay
/// together below [`LOOP_LIMIT`](crate::gpu::LOOP_LIMIT).
const ECHOES_PER_DISPATCH: usize = 16_384;
const CHIRPS_PER_PIECE: usize = 2048;

impl Plan<'_> {
    fn origin(&self) -> (i32, i32) {
        ((self.chirps / 2) as i32, (self.samples / 2) as i32)
    }

    fn echo(&self, index: u32, channel: usize) -> DeviceEcho {
        let (m, n) = self.origin();
        let k = self.coefficients(index, channel).about(f64::from(m), f64::from(n));
        DeviceEcho {
            amplitude: [k.amplitude.re as f32, k.amplitude.im as f32],
            a0: fixed_turns(k.a0),
            a1: fixed_turns(k.a1),
            half_step: fixed_turns(0.5 * k.b0),
            b1: k.b1 as f32,
            a2: k.a2 as f32,
            c: k.c as f32,
            a3: k.a3 as f32,
            b2: k.b2 as f32,
            c1: k.c1 as f32,
            pad: 0,
        }
    }

    fn dispatch(&self, recorder: &mut Recorder, cube: &DeviceCube, set: Set, echoes: &[u32], first: bool) {
        let mut list = vec![DeviceEcho::default(); self.channels * echoes.len()];
        if !echoes.is_empty() {
            list.par_chunks_mut(echoes.len()).enumerate().for_each_tasks(|(channel, list)| {
                list.par_iter_mut()
                    .zip(echoes)
                    .with_min_len(1024)
                    .for_each_tasks(|(echo, i)| *echo = self.echo(*i, channel));
            });
        }
        let buffer = recorder.upload("echoes", &list);
        let (m, n) = self.origin();
        for piece in &cube.pieces {
            let rows = match set {
                Set::Still => 1,
                Set::Moving => piece.chirps,
            };
            let params = SynthesisParams {
                chirps: rows as u32,
                copies: (piece.chirps - rows) as u32,
                channels: self.channels as u32,
                samples: self.samples as u32,
                echoes: echoes.len() as u32,
                chirp_origin: piece.first_chirp as i32 - m,
                sample_origin: -n,
                accumulate: u32::from(!first),
                is_real: u32::from(self.sampling == Sampling::Real),
            };
            // Blocks of a row after row along x and y, channels along z.
            let groups = (rows as u64 * (self.samples as u64).div_ceil(BLOCK)).div_ceil(64);
            let y = groups.div_ceil(65_535).max(1);
            let threads = Threads::Workgroups([groups.div_ceil(y) as u32, y as u32, self.channels as u32]);
            recorder.dispatch(&KERNEL, &params, &[&buffer, &piece.data], threads);
        }
    }

    /// Records the synthesis of the cube without noise, in pieces of whole chirps that each fit a
    /// binding. Fails when the beat frequency drifts so fast that the shader's blocks of 16 samples are
    /// too long, or when one chirp exceeds a binding.
    ///
    /// # Errors
    /// Returns an error if the beat frequency of an echo drifts too fast for the shader, or if one chirp does not fit a
    /// binding of the adapter.
    pub fn record(&self, gpu: &Gpu, recorder: &mut Recorder) -> Result<DeviceCube> {
        self.record_some(gpu, recorder, &self.still, &self.moving)
    }

    /// Records as [`Self::record`] only some of the echoes at rest and of those that move.
    ///
    /// # Errors
    /// Returns the errors of [`Self::record`].
    pub fn record_some(
        &self,
        gpu: &Gpu,
        recorder: &mut Recorder,
        still: &[u32],
        moving: &[u32],
    ) -> Result<DeviceCube> {
        let drift = self.largest_drift(moving) * 7.5 * 7.5;
        if drift > LARGEST_DRIFT {
            return Err(Error::Failed(format!(
                "the beat frequency drifts by {drift:.1e} turns within 8 samples, the shader allows {LARGEST_DRIFT:.0e}; \
                 use --device cpu or a higher sample rate"
            )));
        }
        let limit = gpu.max_binding_bytes() as usize;
        let chirp_bytes = self.channels * self.samples * size_of::<[f32; 2]>();
        let echo_bytes = self.channels * size_of::<DeviceEcho>();
        let per_piece = (limit / chirp_bytes.max(1)).min(CHIRPS_PER_PIECE);
        let per_upload = (limit / echo_bytes.max(1)).min(ECHOES_PER_DISPATCH);
        if per_piece == 0 || per_upload == 0 {
            return Err(Error::Failed(format!(
                "one chirp of {} channels x {} samples does not fit the {limit} bytes of a binding of this adapter",
                self.channels, self.samples
            )));
        }
        let pieces = (0..self.chirps)
            .step_by(per_piece)
            .map(|first_chirp| {
                let chirps = per_piece.min(self.chirps - first_chirp);
                let data = recorder.buffer("cube", chirps * self.channels * self.samples);
                CubePiece { first_chirp, chirps, data }
            })
            .collect();
        let cube = DeviceCube { chirps: self.chirps, channels: self.channels, samples: self.samples, pieces };
        // The first dispatch writes every sample, also when there is nothing at rest.
        self.dispatch(recorder, &cube, Set::Still, &still[..per_upload.min(still.len())], true);
        for echoes in still[per_upload.min(still.len())..].chunks(per_upload) {
            self.dispatch(recorder, &cube, Set::Still, echoes, false);
        }
        for echoes in moving.chunks(per_upload) {
            self.dispatch(recorder, &cube, Set::Moving, echoes, false);
        }
        Ok(cube)
    }
}
