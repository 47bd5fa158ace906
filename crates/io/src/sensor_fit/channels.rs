//! The channels' errors from one line, and the test whether an ideal radar would show the same.
//!
//! 1. Amplitude a of each channel at the line, through four-term Blackman–Harris windows over fast and slow time, without the phase that
//!    the line's Doppler shift gives to later slots. The codes of BPM are undone.
//! 2. Variance of a: the noise between Doppler cells, the largest residual of the line within four bins in range and eight in Doppler, side
//!    lobes of all other echoes (−92 dB), and −70 dB of the line itself.
//! 3. The line has to be at rest: a Doppler shift below half a bin, and a beat frequency that does not drift as that of a line one
//!    Doppler ambiguity away.
//! 4. One, two and three spherical waves from the line's range are fitted to a. The errors are significant where the residual of each is
//!    beyond the χ² quantile of [`FALSE_ALARM`].

use catseye::adc::Cube;
use catseye::base::units::{C0, db_from_power};
use catseye::scene::radar::Radar;
use catseye::scene::waveform::Multiplex;
use catseye_math::fft;
use glam::DVec3;
use num_complex::Complex64;
use serde::Serialize;
use std::f64::consts::TAU;

/// Errors of the channels, one value for each pair of transmitter and receiver that the cube shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelFit {
    /// Gain over the channels' mean power, dB.
    pub gain_db: Vec<f64>,
    /// Phase in the sense of `front_end.channels.phase_deg`, without that of the wave, degrees.
    pub phase_deg: Vec<f64>,
    /// Standard deviation of the gains, dB.
    pub gain_deviation_db: f64,
    /// Standard deviation of the phases, degrees.
    pub phase_deviation_deg: f64,
    /// Direction cosines to y and z of the wave that fits best.
    pub direction: [f64; 2],
    /// Whether an ideal radar would not show them.
    pub is_significant: bool,
    /// What decided.
    pub reason: String,
}

/// Four-term Blackman–Harris window, side lobes at −92 dB (Harris 1978).
pub fn blackman_harris(n: usize) -> Vec<f64> {
    let a = [0.35875, -0.48829, 0.14128, -0.01168];
    let at = |i: usize| TAU * (i as f64 + 0.5) / n as f64;
    (0..n).map(|i| a.iter().enumerate().map(|(k, a)| a * (k as f64 * at(i)).cos()).sum()).collect()
}

/// Σw²/(Σw)², the share of a noise variance that a windowed mean keeps.
pub fn noise_share(w: &[f64]) -> f64 {
    w.iter().map(|x| x * x).sum::<f64>() / w.iter().sum::<f64>().powi(2)
}

/// Probability that one effect is found where there is none but thermal noise.
pub const FALSE_ALARM: f64 = 1e-6;
/// Quantile of the normal distribution at [`FALSE_ALARM`].
pub const FALSE_ALARM_Z: f64 = 4.753;

/// Quantile of the sum of `count` exponentials of mean 1 at the false alarm probability (Wilson and Hilferty 1931).
pub fn gamma_quantile(count: f64) -> f64 {
    count * (1.0 - 1.0 / (9.0 * count) + FALSE_ALARM_Z / (3.0 * count.sqrt())).powi(3)
}

/// The maximum of `power` between `lo` and `hi`, by golden section.
pub fn golden(mut lo: f64, mut hi: f64, power: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..40 {
        let (a, b) = (hi - ratio * (hi - lo), lo + ratio * (hi - lo));
        if power(a) > power(b) { hi = b } else { lo = a }
    }
    0.5 * (lo + hi)
}

/// Σ w z e^{−j2πf(i − (n − 1)/2)} / Σw.
fn tone(z: &[Complex64], w: &[f64], f: f64) -> Complex64 {
    let centre = 0.5 * (z.len() as f64 - 1.0);
    let all = z.iter().zip(w).enumerate();
    all.map(|(i, (z, w))| z * w * Complex64::cis(-TAU * f * (i as f64 - centre))).sum::<Complex64>()
        / w.iter().sum::<f64>()
}

/// Amplitudes of the pairs of transmitter and receiver, without the codes of BPM. DDM shows the first transmitter at rest.
fn decoded(amplitude: &[Complex64], radar: &Radar) -> (Vec<Complex64>, Vec<(usize, usize)>) {
    let n_rx = radar.rx.len();
    match radar.multiplex {
        Multiplex::Bpm => (0..radar.tx.len() * n_rx)
            .map(|v| {
                let (t, r) = (v / n_rx, v % n_rx);
                let all = (0..radar.slots()).map(|s| amplitude[s * n_rx + r] * radar.multiplex.weight(s, t));
                (all.sum::<Complex64>() / radar.slots() as f64, (t, r))
            })
            .unzip(),
        _ => amplitude.iter().enumerate().map(|(c, a)| (*a, (c / n_rx, c % n_rx))).unzip(),
    }
}

/// Shares of the power that a common amplitude of all pairs and the best spherical wave from `range_m` explain.
pub fn shares(amplitude: &[Complex64], radar: &Radar, range_m: f64) -> [f64; 2] {
    let (data, pairs) = decoded(amplitude, radar);
    let all = data.iter().map(|z| z.norm_sqr()).sum::<f64>();
    let common = data.iter().sum::<Complex64>().norm_sqr() / data.len() as f64 / all;
    if data.len() < 2 {
        // One channel does not show direction.
        return [1.0, 1.0];
    }
    let (_, rest) = Waves::new(radar, &pairs, range_m).fits(&data)[0];
    [common, 1.0 - rest / all]
}

/// Tests the line of beat frequency `bin`. `is_boresight`: it is the only echo of its cell, and at the boresight. `knows_antennas`: the
/// radar's antennas are those of the cube.
pub fn channels(
    cube: &Cube<f64>,
    bin: f64,
    radar: &Radar,
    noise_variance: f64,
    is_boresight: bool,
    knows_antennas: bool,
) -> Option<ChannelFit> {
    let (m, k, n) = (cube.chirps, cube.channels, cube.samples);
    if k < 2 || radar.channels() != k || radar.rows() != m {
        return None;
    }
    let (fast, slow) = (blackman_harris(n), blackman_harris(m));
    let mean = |from: usize, to: usize| -> Vec<Vec<Complex64>> {
        let w = blackman_harris(to - from);
        let sum = w.iter().sum::<f64>();
        let mut rows = vec![vec![Complex64::ZERO; n]; k];
        for i in from..to {
            for (c, row) in rows.iter_mut().enumerate() {
                row.iter_mut().zip(cube.row(i, c)).for_each(|(s, z)| *s += z * (w[i - from] / sum));
            }
        }
        rows
    };
    let peak = |rows: &[Vec<Complex64>]| {
        golden(bin - 0.7, bin + 0.7, |b| rows.iter().map(|r| tone(r, &fast, b / n as f64).norm_sqr()).sum())
    };
    let still = mean(0, m);
    let bin = peak(&still);
    let drift = 2.0 * (peak(&mean(m / 2, m)) - peak(&mean(0, m / 2)));
    let s: Vec<Vec<Complex64>> =
        (0..k).map(|c| (0..m).map(|i| tone(cube.row(i, c), &fast, bin / n as f64)).collect()).collect();
    let f = golden(-1.5 / m as f64, 1.5 / m as f64, |f| s.iter().map(|s| tone(s, &slow, f).norm_sqr()).sum());
    let amplitude: Vec<Complex64> = s.iter().map(|s| tone(s, &slow, f)).collect();
    let power = amplitude.iter().map(|a| a.norm_sqr()).sum::<f64>() / k as f64;
    // Doppler spectrum of what the line leaves, over all channels.
    let mut doppler = vec![0.0; m];
    let along = fft::forward::<f64>(m);
    let square = slow.iter().map(|w| w * w).sum::<f64>();
    for (s, a) in s.iter().zip(&amplitude) {
        let centre = 0.5 * (m as f64 - 1.0);
        let mut x: Vec<Complex64> = (s.iter().zip(&slow).enumerate())
            .map(|(i, (s, w))| (s - a * Complex64::cis(TAU * f * (i as f64 - centre))) * w)
            .collect();
        along.process(&mut x);
        doppler.iter_mut().zip(&x).for_each(|(d, x)| *d += x.norm_sqr() / square / k as f64);
    }
    let thermal = noise_variance * noise_share(&fast);
    let mut far: Vec<f64> = (0..m).filter(|d| *d.min(&(m - d)) > 8).map(|d| doppler[d]).collect();
    far.sort_unstable_by(f64::total_cmp);
    let local = if far.len() < 8 { thermal } else { far[far.len() / 2].max(thermal) };
    let near = (0..m).filter(|d| *d.min(&(m - d)) <= 8).map(|d| doppler[d]).fold(0.0, f64::max);
    let centre = 0.5 * (n as f64 - 1.0);
    let mut beside = 0.0f64;
    let rest: Vec<Vec<Complex64>> = (still.iter())
        .map(|r| {
            let a = tone(r, &fast, bin / n as f64);
            let of = |(i, z): (usize, &Complex64)| {
                z - a * Complex64::cis(TAU * bin / n as f64 * (i as f64 - centre))
            };
            r.iter().enumerate().map(of).collect()
        })
        .collect();
    for step in -8..=8 {
        let b = (bin + 0.5 * f64::from(step)) / n as f64;
        beside = beside.max(rest.iter().map(|r| tone(r, &fast, b).norm_sqr()).sum::<f64>() / k as f64);
    }
    let share = noise_share(&slow);
    // A residual at the level of the noise is the noise itself.
    let beyond = |x: f64, noise: f64| (x - 17.0 * noise).max(0.0);
    let all_power = cube.data.iter().map(|z| z.norm_sqr()).sum::<f64>() / cube.data.len() as f64;
    let mut variance = local * share
        + beyond(near, local) * share
        + beyond(beside, local * share)
        + all_power * 10f64.powf(-9.2)
        + power * 1e-7;
    let snr = power * k as f64 / (local * share).max(f64::MIN_POSITIVE);
    let n_rx = radar.rx.len();
    let slots = radar.slots();
    let turned: Vec<Complex64> = (amplitude.iter().enumerate())
        .map(|(c, a)| a * Complex64::cis(-TAU * f * (c / n_rx) as f64 / slots as f64))
        .collect();
    let (data, pairs) = decoded(&turned, radar);
    if radar.multiplex == Multiplex::Bpm {
        variance /= slots as f64;
    }
    let bands = if let Multiplex::Ddm { bands } = radar.multiplex { bands as f64 } else { 1.0 };
    let bin_hz = radar.sample_rate_hz / n as f64;
    let slope = radar.slope_hz_per_s().abs();
    let ambiguity = m as f64 * slope * n as f64 / radar.sample_rate_hz / radar.sample_centre_hz() / bands;
    // Cramér–Rao of each half's beat frequency, twice that for the window.
    let drift_deviation = 2.0 * 2f64.sqrt() * 2.0 * 6f64.sqrt() / (TAU * (0.5 * snr).sqrt());
    let waves = Waves::new(radar, &pairs, C0 * bin * bin_hz / slope / 2.0);
    let fits = if is_boresight { vec![waves.boresight(&data)] } else { waves.fits(&data) };
    let best = &fits[0].0;
    let turned: Vec<Complex64> =
        (0..data.len()).map(|i| data[i] / waves.at(i, best.u) / best.amplitude.arg_unit()).collect();
    let mean_square = data.iter().map(|z| z.norm_sqr()).sum::<f64>() / data.len() as f64;
    let relative = (0.5 * variance / mean_square).sqrt();
    let mut out = ChannelFit {
        gain_db: (turned.iter())
            .map(|z| db_from_power(z.norm_sqr().max(1e-12 * mean_square) / mean_square))
            .collect(),
        phase_deg: turned.iter().map(|z| -z.arg().to_degrees()).collect(),
        gain_deviation_db: 20.0 / 10f64.ln() * relative,
        phase_deviation_deg: relative.to_degrees(),
        direction: best.u,
        is_significant: false,
        reason: String::new(),
    };
    let alike = |x: &[catseye::scene::radar::Antenna]| {
        let same = |a: &catseye::scene::radar::Antenna| {
            a.gain_dbi == x[0].gain_dbi && a.pattern == x[0].pattern && a.polarisation == x[0].polarisation
        };
        x.iter().all(same)
    };
    out.reason = if (f * m as f64).abs() > 0.5 {
        format!("the line moves by {:.2} Doppler bins", f * m as f64)
    } else if !is_boresight && 5.0 * drift_deviation > 0.5 * ambiguity {
        "it cannot be resolved whether the line is static or moves by a Doppler ambiguity".into()
    } else if !is_boresight && drift.abs() > 0.5 * ambiguity {
        format!("the line moves by a Doppler ambiguity: its beat frequency drifts by {drift:.2} bins")
    } else if !is_boresight && !knows_antennas {
        "the antennas' positions are unknown; give the radar, or the boresight".into()
    } else if !(alike(&radar.tx) && alike(&radar.rx)) {
        "the antennas differ in gain, pattern or polarisation, so the echo's direction decides the gains"
            .into()
    } else {
        let mut reason = None;
        for (count, (_, residual)) in fits.iter().enumerate() {
            let free = data.len() as f64 - 0.5 * waves.parameters(count + 1, is_boresight);
            if free < 1.0 {
                if count < 2 && !is_boresight {
                    reason = Some("too few channels to separate errors from two echoes in one cell".into());
                }
                break;
            }
            if residual / variance <= gamma_quantile(free) {
                reason = Some(match count {
                    0 => "one wave explains all channels within their deviation".to_string(),
                    _ => format!("{} echoes in one cell explain all channels", count + 1),
                });
                break;
            }
        }
        out.is_significant = reason.is_none();
        reason.unwrap_or_else(|| "no sum of up to three waves explains the channels".into())
    };
    Some(out)
}

trait ArgUnit {
    /// e^{j arg z}.
    fn arg_unit(self) -> Complex64;
}

impl ArgUnit for Complex64 {
    fn arg_unit(self) -> Complex64 {
        Complex64::cis(self.arg())
    }
}

#[derive(Debug, Clone, Copy)]
struct Wave {
    amplitude: Complex64,
    u: [f64; 2],
}

/// Spherical waves from one range at the pairs of antennas.
struct Waves {
    pairs: Vec<(DVec3, DVec3)>,
    wavenumber: f64,
    range_m: f64,
    /// Axes over which the array extends: 0 for y, 1 for z.
    axes: Vec<usize>,
}

impl Waves {
    fn new(radar: &Radar, pairs: &[(usize, usize)], range_m: f64) -> Waves {
        let pairs: Vec<(DVec3, DVec3)> =
            pairs.iter().map(|(t, r)| (radar.tx[*t].position_m, radar.rx[*r].position_m)).collect();
        let extends = |axis: usize| {
            let at = |p: &(DVec3, DVec3)| (p.0 + p.1)[axis + 1];
            pairs.iter().any(|p| (at(p) - at(&pairs[0])).abs() > 1e-6)
        };
        let axes = (0..2).filter(|a| extends(*a)).collect();
        Waves { wavenumber: TAU / radar.sample_wavelength_m(), range_m: range_m.max(0.1), axes, pairs }
    }

    /// Number of real parameters of `count` waves.
    fn parameters(&self, count: usize, is_boresight: bool) -> f64 {
        if is_boresight { 2.0 } else { (count * (2 + self.axes.len())) as f64 }
    }

    fn at(&self, i: usize, u: [f64; 2]) -> Complex64 {
        let x = (1.0 - u[0] * u[0] - u[1] * u[1]).max(0.0).sqrt();
        let target = self.range_m * DVec3::new(x, u[0], u[1]);
        let (t, r) = self.pairs[i];
        let path = (target - t).length() + (target - r).length() - 2.0 * self.range_m;
        Complex64::cis(self.wavenumber * path)
    }

    fn vector(&self, u: [f64; 2]) -> Vec<Complex64> {
        (0..self.pairs.len()).map(|i| self.at(i, u)).collect()
    }

    fn project(&self, data: &[Complex64], u: [f64; 2]) -> Complex64 {
        let all = self.vector(u).into_iter().zip(data);
        all.map(|(m, z)| m.conj() * z).sum::<Complex64>() / data.len() as f64
    }

    fn boresight(&self, data: &[Complex64]) -> (Wave, f64) {
        let wave = Wave { amplitude: self.project(data, [0.0; 2]), u: [0.0; 2] };
        (wave, self.residual(data, &[wave]).iter().map(|z| z.norm_sqr()).sum())
    }

    fn residual(&self, data: &[Complex64], waves: &[Wave]) -> Vec<Complex64> {
        let model = |i: usize| waves.iter().map(|w| w.amplitude * self.at(i, w.u)).sum::<Complex64>();
        data.iter().enumerate().map(|(i, z)| z - model(i)).collect()
    }

    /// First wave and residual energy of the fits with one, two and three waves.
    fn fits(&self, data: &[Complex64]) -> Vec<(Wave, f64)> {
        let energy = |w: &[Wave]| self.residual(data, w).iter().map(|z| z.norm_sqr()).sum::<f64>();
        let mut waves: Vec<Wave> = Vec::new();
        let mut out = Vec::new();
        for _ in 0..3 {
            let rest = self.residual(data, &waves);
            // The strongest waves of the residual, and each earlier wave split in two.
            let mut starts: Vec<Vec<Wave>> = Vec::new();
            for u in self.peaks(&rest, 4) {
                let mut all = waves.clone();
                all.push(Wave { amplitude: self.project(&rest, u), u });
                starts.push(all);
            }
            for i in 0..waves.len() {
                for axis in &self.axes {
                    let mut all = waves.clone();
                    let by = 0.3 / (self.pairs.len() as f64).max(2.0);
                    all[i].amplitude *= 0.5;
                    let mut other = all[i];
                    all[i].u[*axis] -= by;
                    other.u[*axis] += by;
                    all.push(other);
                    starts.push(all);
                }
            }
            let refined = starts.into_iter().map(|s| self.refine(data, s));
            if let Some(best) = refined.min_by(|a, b| energy(a).total_cmp(&energy(b))) {
                waves = best;
            }
            let first = out.first().map_or(waves[0], |(w, _)| *w);
            out.push((first, energy(&waves)));
        }
        out
    }

    /// Directions of the largest maxima of |mᴴz|² on a grid.
    fn peaks(&self, data: &[Complex64], count: usize) -> Vec<[f64; 2]> {
        let side = match self.axes.len() {
            0 => return vec![[0.0; 2]],
            1 => 512usize,
            _ => 48,
        };
        let at = |i: usize| -0.999 + 1.998 * i as f64 / (side - 1) as f64;
        let mut all: Vec<([f64; 2], f64)> = Vec::new();
        let rows = if self.axes.len() == 2 { side } else { 1 };
        for row in 0..rows {
            for column in 0..side {
                let mut u = [0.0; 2];
                u[self.axes[0]] = at(column);
                if rows > 1 {
                    u[1] = at(row);
                }
                if u[0] * u[0] + u[1] * u[1] < 1.0 {
                    all.push((u, self.project(data, u).norm_sqr()));
                }
            }
        }
        all.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
        let apart = 6.0 / side as f64;
        let mut out: Vec<[f64; 2]> = Vec::new();
        for (u, _) in all {
            if out.iter().all(|o| (o[0] - u[0]).abs().max((o[1] - u[1]).abs()) > apart) {
                out.push(u);
            }
            if out.len() == count {
                break;
            }
        }
        out
    }

    /// Levenberg–Marquardt over amplitudes and directions.
    fn refine(&self, data: &[Complex64], mut waves: Vec<Wave>) -> Vec<Wave> {
        let each = 2 + self.axes.len();
        let size = each * waves.len();
        let mut damping = 1e-3;
        let energy = |w: &[Wave]| self.residual(data, w).iter().map(|z| z.norm_sqr()).sum::<f64>();
        let mut now = energy(&waves);
        for _ in 0..60 {
            let rest = self.residual(data, &waves);
            let mut columns: Vec<Vec<Complex64>> = Vec::with_capacity(size);
            for w in &waves {
                let v = self.vector(w.u);
                columns.push(v.clone());
                columns.push(v.iter().map(|z| Complex64::I * z).collect());
                for axis in &self.axes {
                    let mut u = w.u;
                    u[*axis] += 1e-6;
                    let moved = self.vector(u);
                    columns.push(moved.iter().zip(&v).map(|(a, b)| w.amplitude * (a - b) * 1e6).collect());
                }
            }
            let dot = |a: &[Complex64], b: &[Complex64]| {
                a.iter().zip(b).map(|(a, b)| (a.conj() * b).re).sum::<f64>()
            };
            let right: Vec<f64> = columns.iter().map(|c| dot(c, &rest)).collect();
            let normal: Vec<Vec<f64>> =
                columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
            let mut is_better = false;
            while damping < 1e9 {
                let mut a = normal.clone();
                (0..size).for_each(|i| a[i][i] *= 1.0 + damping);
                let step = solve(a, right.clone());
                let mut next = waves.clone();
                for (w, x) in next.iter_mut().zip(step.chunks(each)) {
                    w.amplitude += Complex64::new(x[0], x[1]);
                    for (axis, x) in self.axes.iter().zip(&x[2..]) {
                        w.u[*axis] = (w.u[*axis] + x.clamp(-0.1, 0.1)).clamp(-1.0, 1.0);
                    }
                }
                let then = energy(&next);
                if then < now {
                    let is_done = now - then < 1e-10 * now;
                    (waves, now) = (next, then);
                    damping = (0.2 * damping).max(1e-12);
                    is_better = !is_done;
                    break;
                }
                damping *= 5.0;
            }
            if !is_better {
                break;
            }
        }
        waves
    }
}

/// Gaussian elimination with row pivots; a singular direction has no step.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|x, y| a[*x][i].abs().total_cmp(&a[*y][i].abs())).unwrap_or(i);
        a.swap(i, pivot);
        b.swap(i, pivot);
        if a[i][i].abs() < f64::MIN_POSITIVE {
            continue;
        }
        let (top, below) = a.split_at_mut(i + 1);
        for (row, a) in below.iter_mut().enumerate() {
            let by = a[i] / top[i][i];
            a[i..].iter_mut().zip(&top[i][i..]).for_each(|(x, y)| *x -= by * y);
            b[i + 1 + row] -= by * b[i];
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let rest = (i + 1..n).map(|c| a[i][c] * x[c]).sum::<f64>();
        x[i] = if a[i][i].abs() < f64::MIN_POSITIVE { 0.0 } else { (b[i] - rest) / a[i][i] };
    }
    x
}
