//! What a cube of I and Q samples says of the front end that made it.
//!
//! The unit u is that of the samples (counts, or √W). Noise is told from the scene by third differences over slow time,
//! d = (x₃ − 3x₂ + 3x₁ − x₀)/√20: they keep the variance of noise that is new in every chirp, take away what stands still, and lower a line
//! that turns by φ a chirp by (2 sin φ/2)⁶/20 in power. Spectra over fast time are taken with a Hann window w and divided by √Σw², so that
//! noise of variance σ² a sample has the power σ² in every bin.

use super::channels::{
    ChannelFit, FALSE_ALARM, blackman_harris, channels, gamma_quantile, golden, noise_share, shares,
};
use catseye::adc::Cube;
use catseye::base::error::{BadInput, Result};
use catseye::base::units::{C0, db_from_power};
use catseye::scene::front_end::{IqImbalance, QuantiserKind};
use catseye::scene::radar::{Radar, Sampling};
use catseye::scene::waveform::Waveform;
use catseye_math::fft;
use num_complex::{Complex, Complex64};
use serde::Serialize;
use std::f64::consts::{LN_2, PI, TAU};
use std::path::Path;

/// Fewest chirps of a cube that can be fitted.
pub const LEAST_CHIRPS: usize = 8;
/// Fewest samples of a chirp.
pub const LEAST_SAMPLES: usize = 32;
/// Longest delay that counts as leakage inside the radar, s; what comes later is an echo, 0.75 m away or more.
pub const LONGEST_LEAK_S: f64 = 5e-9;
/// Bins next to the constant that no line, image or sideband is sought in.
const NEAR: usize = 4;
/// Beat frequencies that count as spill-over, in bins. Below them a line cannot be told from the constant.
const LEAK_BINS: (f64, f64) = (0.7, 4.0);

/// The quantiser that the levels of the samples show.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Steps {
    /// Distance of neighbouring levels, u.
    pub step: f64,
    /// Whether zero is a level or a threshold.
    pub kind: QuantiserKind,
    /// Fewest bits whose range holds all samples.
    pub least_bits: u32,
    /// Largest modulus of a part, u.
    pub largest: f64,
    /// Share of parts at the lowest or the highest level that occurs: far above that of their neighbours where the converter clips.
    pub share_at_ends: f64,
}

/// Spill-over: a line that stands still, 0.7 to 4 range bins away.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leak {
    /// Beat frequency, bins.
    pub bin: f64,
    /// Amplitude in each channel, u.
    pub amplitude: Vec<f64>,
    /// Root mean square of the amplitudes, u.
    pub rms: f64,
    /// Standard deviation of the amplitudes, u.
    pub deviation: f64,
    /// Delay at the radar's slope, s.
    pub delay_s: f64,
    /// |Σa|²/(K Σ|a|²): 1 where all channels have the same amplitude and phase, as leakage does (CONVENTIONS eq. 107).
    pub common_share: f64,
    /// The same share of the spherical wave from this range that fits best.
    pub wave_share: f64,
    /// Whether it is leakage, and no echo: a delay of at most 5 ns, a common share of at least 0.9, and no wave leaves less than half of
    /// what the common amplitude leaves.
    pub is_significant: bool,
}

/// The strongest line that stands still, away from the constant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Beat frequency, bins.
    pub bin: f64,
    /// Amplitude in each channel, real and imaginary part, u.
    pub amplitude: Vec<[f64; 2]>,
    /// Power of the line over that of the noise in one sample, dB.
    pub over_noise_db: f64,
    /// Phase from channel to channel of the wave that fits best, degrees; 0 where the line is taken to stand at the boresight.
    pub progression_deg: f64,
    /// Gain of each channel over their mean power, dB.
    pub gain_db: Vec<f64>,
    /// Phase of each channel in the sense of `front_end.channels.phase_deg`, without the progression, degrees.
    pub phase_deg: Vec<f64>,
}

/// Imbalance of I and Q, from lines and their images.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Imbalance {
    /// Amplitude of Q over that of I, dB.
    pub gain_db: f64,
    /// Lag of Q behind its quarter of a turn, degrees.
    pub phase_deg: f64,
    /// Power of the image over that of its line, dB.
    pub image_db: f64,
    /// Standard error of the image's amplitude over the line's, from the scatter of channels and lines.
    pub standard_error: f64,
    /// Whether the image is beyond the noise and is that of its line, and no other echo.
    pub is_significant: bool,
    /// Power of the image cells that the line does not explain, over that of the noise.
    pub rest_over_noise: f64,
    /// Whether the lines move; images of lines that stand still hide among clutter.
    pub from_moving: bool,
    /// Number of cells.
    pub cells: usize,
}

/// Noise beside the strongest line, over a band of offsets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sideband {
    /// First offset, bins.
    pub from: usize,
    /// End of the offsets, bins; it is not part of them.
    pub to: usize,
    /// Mean power a bin beyond the floor, over the line's, dB; None where it is not beyond the floor on both sides alike.
    pub excess_db: Option<f64>,
    /// The excess of the higher side, at least three standard errors, in the same measure, dB.
    pub bound_db: f64,
}

/// All that was estimated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Shape `[chirp, channel, sample]`.
    pub shape: [usize; 3],
    /// None where the samples stand on no grid of levels.
    pub quantiser: Option<Steps>,
    /// Constant of I and Q in each channel, u.
    pub dc: Vec<[f64; 2]>,
    /// Standard deviation of the channels' mean constant, u.
    pub dc_deviation: f64,
    /// What the mean constant has to exceed: noise, side lobes of echoes and echoes beside it, u.
    pub dc_limit: f64,
    /// Spill-over, where it stands out.
    pub leak: Option<Leak>,
    /// Variance of the noise of a complex sample, the quantiser's included, u².
    pub noise_variance: f64,
    /// The quantiser's part of it, Δ²/6, u².
    pub quantiser_variance: f64,
    /// Noise floor of each bin, u².
    pub floor: Vec<f64>,
    /// Bins whose floor is within 3 dB of the median: neither echoes nor the filters' edges.
    pub quiet: Vec<usize>,
    /// Slope of the floor over the quiet bins, dB a bin.
    pub floor_slope_db: f64,
    /// None where no line stands out.
    pub line: Option<Line>,
    /// Errors of the channels from that line; None for one channel, or without a line.
    pub channels: Option<ChannelFit>,
    /// The strongest line, at rest or moving, whose sides show phase noise: bin and power over that of the noise in one sample, dB.
    pub phase_noise_line: Option<[f64; 2]>,
    /// None where there is no line whose image can be seen.
    pub imbalance: Option<Imbalance>,
    /// Sidebands of the line over bands of offsets.
    #[serde(rename = "skirts")]
    pub sidebands: Vec<Sideband>,
    /// Modulus of the noise's correlation between channels over the quiet bins, `[channel, channel]`.
    pub correlation: Vec<f64>,
    /// What such a correlation is by chance, 1/√n.
    pub chance_correlation: f64,
}

impl Imbalance {
    /// K₁ and K₂ of y = K₁x + K₂x* (CONVENTIONS eq. 109).
    pub fn factors(&self) -> (Complex64, Complex64) {
        IqImbalance { gain_db: self.gain_db, phase_rad: self.phase_deg.to_radians() }.factors()
    }
}

impl Leak {
    fn scale(&mut self, by: f64) {
        self.amplitude.iter_mut().for_each(|a| *a *= by);
        self.rms *= by;
    }
}

impl Fit {
    /// Thermal noise: what is left without the quantiser's, u².
    pub fn thermal_variance(&self) -> f64 {
        (self.noise_variance - self.quantiser_variance).max(0.0)
    }

    /// Mean constant of the channels, u.
    pub fn mean_dc(&self) -> Complex64 {
        let sum: Complex64 = self.dc.iter().map(|d| Complex64::new(d[0], d[1])).sum();
        sum / self.dc.len() as f64
    }

    /// Largest and mean correlation of the noise of two channels; None for one channel.
    pub fn correlations(&self) -> Option<[f64; 2]> {
        let k = self.shape[1];
        let off: Vec<f64> = (0..k)
            .flat_map(|a| (0..a).map(move |b| (a, b)))
            .map(|(a, b)| self.correlation[a * k + b])
            .collect();
        let largest = off.iter().copied().fold(0.0, f64::max);
        (k > 1).then(|| [largest, off.iter().sum::<f64>() / off.len() as f64])
    }
}

/// The cube without its constant and the line beside it.
fn without(cube: &Cube<f64>, still: &Still, dc: &[Complex64], leak: Option<&Leak>) -> Cube<f64> {
    let n = cube.samples;
    let ones = vec![Complex64::ONE; n];
    let model: Vec<Vec<Complex64>> = (dc.iter().zip(&still.rows))
        .map(|(dc, row)| {
            let line = leak.map(|l| (l.bin, still.at(row, l.bin) - dc * still.at(&ones, l.bin)));
            let at = |i: usize| {
                dc + line.map_or(Complex64::ZERO, |(b, a)| a * Complex64::cis(TAU * b * i as f64 / n as f64))
            };
            (0..n).map(at).collect()
        })
        .collect();
    let mut out = cube.clone();
    for (row, data) in out.data.chunks_mut(n).enumerate() {
        data.iter_mut().zip(&model[row % cube.channels]).for_each(|(z, m)| *z -= m);
    }
    out
}

/// How a cube is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FitOptions {
    /// The strongest line at rest is a single reflector at the boresight, so that all of its phases are the channels'.
    pub is_boresight: bool,
    /// The radar's antennas are those of the cube, and not assumed.
    pub knows_antennas: bool,
}

/// Checks that a cube can be fitted.
///
/// # Errors
/// Returns `BadInput`, which names `path`, for too few chirps or samples, a non-finite sample, or a cube without any change.
pub fn check(path: &Path, cube: &Cube<f64>) -> Result<()> {
    let shape = [cube.chirps, cube.channels, cube.samples];
    let bad = |problem: &str| BadInput::new(problem.to_string()).file(path);
    if cube.chirps < LEAST_CHIRPS || cube.samples < LEAST_SAMPLES || cube.channels == 0 {
        return Err(bad("the cube is too small for a fit")
            .key("shape")
            .value(format!("{shape:?}"))
            .allowed(format!(
                "[chirp, channel, sample] of at least {LEAST_CHIRPS} chirps and {LEAST_SAMPLES} samples"
            ))
            .remedy("record more chirps, or name the axes with --axes")
            .into());
    }
    if let Some(i) = cube.data.iter().position(|z| !z.is_finite()) {
        let e = bad("NaN or infinite value").key(format!("sample {i}"));
        return Err(e.allowed("finite numbers").into());
    }
    let first = cube.data[0];
    if cube.data.iter().all(|z| *z == first) {
        let e = bad("all samples are the same").value(format!("{first}"));
        return Err(e.remedy("record with the receiver switched on").into());
    }
    Ok(())
}

/// Estimates the front end of a cube of I and Q that `radar` recorded.
///
/// # Errors
/// Returns the errors of [`check`], and `BadInput`, which names `path`, for a radar of another shape or kind, or a cube whose chirps
/// repeat.
pub fn fit(path: &Path, cube: &Cube<f64>, radar: &Radar, options: FitOptions) -> Result<Fit> {
    check(path, cube)?;
    let shape = [cube.chirps, cube.channels, cube.samples];
    let bad = |problem: &str| BadInput::new(problem.to_string()).file(path);
    let expected = [radar.rows(), radar.channels(), radar.samples];
    if shape != expected || radar.rows() != radar.chirps {
        return Err(bad("the radar does not fit the cube")
            .key("shape")
            .value(format!("{shape:?}"))
            .allowed(format!("{expected:?}: [chirp, rx_virtual, sample]"))
            .remedy("give the radar that recorded it with --radar, or leave --radar out")
            .into());
    }
    if radar.sampling != Sampling::Iq || !matches!(radar.waveform, Waveform::Fmcw { .. }) {
        return Err(bad("only chirps with I and Q can be fitted")
            .key("--radar")
            .value(&radar.name)
            .allowed("waveform.kind = \"fmcw\" and receiver.sampling = \"iq\"")
            .into());
    }
    let quantiser = steps(&cube.data);
    let noise = NoiseRows::new(cube);
    let floor = noise.floor();
    let median_floor = median(floor.clone());
    let quiet: Vec<usize> = (0..floor.len())
        .filter(|i| floor[*i] > 0.5 * median_floor && floor[*i] < 2.0 * median_floor)
        .collect();
    if median_floor <= 0.0 || quiet.len() < 8 {
        let problem = if median_floor <= 0.0 {
            "the chirps repeat without noise"
        } else {
            "the noise floor is not level"
        };
        return Err(bad(problem)
            .key("noise")
            .value(format!("{} bins within 3 dB of their median", quiet.len()))
            .allowed("at least 8 bins with noise")
            .remedy("record more chirps of a scene that does not fill the range")
            .into());
    }
    let noise_variance = quiet.iter().map(|i| floor[*i]).sum::<f64>() / quiet.len() as f64;
    let still = Still::new(cube);
    let map = Map::new(cube);
    let bin_s = radar.sample_rate_hz / radar.samples as f64 / radar.slope_hz_per_s().abs();
    let (mut dc, mut leak) = still.constant_and_leak(noise_variance, bin_s, radar);
    let imbalance = imbalance(cube, &dc, noise_variance, &map.floor);
    if let Some(i) = imbalance.as_ref().filter(|i| i.is_significant && leak.is_some()) {
        // The image of the spill-over stands as near to the constant as the line itself.
        let (k1, k2) = i.factors();
        let unmixed = still.unmixed(k1, k2);
        (dc, leak) = unmixed.constant_and_leak(noise_variance, bin_s, radar);
        dc.iter_mut().for_each(|z| *z = k1 * *z + k2 * z.conj());
        leak.iter_mut().for_each(|l| l.scale(k1.norm()));
    }
    let (dc_deviation, dc_limit) = still.constant_limit(&dc, leak.as_ref(), noise_variance);
    let rest = without(cube, &still, &dc, leak.as_ref());
    let none = vec![Complex64::ZERO; cube.channels];
    let line = Still::new(&rest).strongest(&none, leak.as_ref(), noise_variance, options.is_boresight);
    let channels = line.as_ref().and_then(|l| {
        channels(&rest, l.bin, radar, noise_variance, options.is_boresight, options.knows_antennas)
    });
    let strongest = map.strongest(noise_variance);
    let sidebands =
        strongest.map_or_else(Vec::new, |l| sidebands(l, &map, &quiet, noise_variance, radar.rx.len()));
    let phase_noise_line = strongest.map(|l| l.1);
    let (correlation, looks) = noise.correlation(&quiet);
    Ok(Fit {
        shape,
        quantiser,
        dc: dc.iter().map(|z| [z.re, z.im]).collect(),
        dc_deviation,
        dc_limit,
        leak,
        noise_variance,
        quantiser_variance: quantiser.map_or(0.0, |q| q.step * q.step / 6.0),
        floor_slope_db: slope(&quiet, &floor),
        floor,
        quiet,
        line,
        channels,
        phase_noise_line,
        imbalance,
        sidebands,
        correlation,
        chance_correlation: (looks as f64).powf(-0.5),
    })
}

/// Hann window of N samples without its zeros, w = sin²(π(n + ½)/N).
pub fn hann(n: usize) -> Vec<f64> {
    (0..n).map(|i| (0.5 * TAU * (i as f64 + 0.5) / n as f64).sin().powi(2)).collect()
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_unstable_by(f64::total_cmp);
    match x.len() {
        0 => 0.0,
        n if n % 2 == 1 => x[n / 2],
        n => 0.5 * (x[n / 2 - 1] + x[n / 2]),
    }
}

/// Level in dB over bins, by least squares.
fn slope(bins: &[usize], floor: &[f64]) -> f64 {
    let n = bins.len() as f64;
    let mean_x = bins.iter().sum::<usize>() as f64 / n;
    let level = |i: &usize| db_from_power(floor[*i]);
    let mean_y = bins.iter().map(level).sum::<f64>() / n;
    let (mut xy, mut xx) = (0.0, 0.0);
    for i in bins {
        let x = *i as f64 - mean_x;
        xy += x * (level(i) - mean_y);
        xx += x * x;
    }
    if xx > 0.0 { xy / xx } else { 0.0 }
}

/// The grid on which I and Q stand: the common measure of all distances of neighbouring values.
fn steps(data: &[Complex64]) -> Option<Steps> {
    let mut values: Vec<f64> = data.iter().flat_map(|z| [z.re, z.im]).collect();
    values.sort_unstable_by(f64::total_cmp);
    let (lowest, highest) = (values[0], values[values.len() - 1]);
    let ends = values.iter().filter(|v| **v == lowest || **v == highest).count();
    let share_at_ends = ends as f64 / values.len() as f64;
    values.dedup();
    let largest = lowest.abs().max(highest.abs());
    // Single precision keeps 24 bits of a level.
    let blur = 4.0 * largest * 2f64.powi(-24);
    let gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > blur).collect();
    let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    // Numbers that are no levels come as close as their rounding.
    if !smallest.is_finite() || smallest < 16.0 * blur {
        return None;
    }
    let mut measure = smallest;
    for gap in &gaps {
        // Euclid with a remainder that rounding may leave.
        let (mut a, mut b) = (*gap, measure);
        loop {
            let rest = (a - b * (a / b).round()).abs();
            if rest <= 4.0 * blur.max(1e-9 * smallest) {
                break;
            }
            (a, b) = (b, rest);
            if b < 16.0 * blur {
                return None;
            }
        }
        measure = b;
    }
    // Each gap is rounded; the whole range is rounded but once.
    let span = values[values.len() - 1] - values[0];
    let step = span / (span / measure).round().max(1.0);
    let fraction = (largest / step).rem_euclid(1.0);
    let is_tread = !(0.25..0.75).contains(&fraction);
    // Codes go from −2^(bits−1) to 2^(bits−1) − 1.
    let (low, high) = match is_tread {
        true => ((lowest / step).round(), (highest / step).round()),
        false => ((lowest / step).floor(), (highest / step).floor()),
    };
    let least_bits = (1..=53).find(|b| {
        let most = 2f64.powi(b - 1);
        -most <= low && high < most
    })? as u32;
    let kind = if is_tread { QuantiserKind::MidTread } else { QuantiserKind::MidRise };
    Some(Steps { step, kind, least_bits, largest, share_at_ends })
}

/// A third difference over four chirps from `m`, of unit gain for noise.
fn third_difference(cube: &Cube<f64>, m: usize, channel: usize) -> Vec<Complex64> {
    let r = |i: usize| cube.row(m + i, channel);
    let (x0, x1, x2, x3) = (r(0), r(1), r(2), r(3));
    let scale = 20f64.powf(-0.5);
    (0..cube.samples).map(|n| ((x3[n] - x0[n]) + 3.0 * (x1[n] - x2[n])) * scale).collect()
}

/// Noise of I and Q: third differences over chirps that no two of them share, so that the values are independent. Unit u.
pub fn noise_samples(cube: &Cube<f64>) -> Vec<f64> {
    let mut out = Vec::with_capacity(cube.data.len() / 2);
    for m in (0..cube.chirps - 3).step_by(4) {
        for channel in 0..cube.channels {
            out.extend(third_difference(cube, m, channel).iter().flat_map(|z| [z.re, z.im]));
        }
    }
    out
}

/// Spectra of the third differences.
struct NoiseRows {
    channels: usize,
    samples: usize,
    /// `[first chirp, channel, bin]`.
    spectra: Vec<Complex64>,
}

impl NoiseRows {
    fn new(cube: &Cube<f64>) -> NoiseRows {
        let window = hann(cube.samples);
        let scale = window.iter().map(|w| w * w).sum::<f64>().powf(-0.5);
        let transform = fft::forward::<f64>(cube.samples);
        let mut spectra = Vec::with_capacity((cube.chirps - 3) * cube.channels * cube.samples);
        for m in 0..cube.chirps - 3 {
            for channel in 0..cube.channels {
                let mut row = third_difference(cube, m, channel);
                row.iter_mut().zip(&window).for_each(|(z, w)| *z *= w * scale);
                transform.process(&mut row);
                spectra.extend(row);
            }
        }
        NoiseRows { channels: cube.channels, samples: cube.samples, spectra }
    }

    fn rows(&self) -> usize {
        self.spectra.len() / self.channels / self.samples
    }

    /// Median over chirps and channels over ln 2: the mean of exponentially distributed power, whatever a few cells hold.
    fn floor(&self) -> Vec<f64> {
        let bin = |i: usize| self.spectra[i..].iter().step_by(self.samples).map(|z| z.norm_sqr()).collect();
        (0..self.samples).map(|i| median(bin(i)) / LN_2).collect()
    }

    /// Modulus of the correlation of each two channels over `bins`, and the number of independent values. Each third bin alone: a Hann
    /// window joins neighbours.
    fn correlation(&self, bins: &[usize]) -> (Vec<f64>, usize) {
        let k = self.channels;
        let apart: Vec<usize> = bins.iter().copied().filter(|b| b % 3 == 0).collect();
        let bins = if apart.is_empty() { bins } else { &apart };
        let mut sums = vec![Complex64::ZERO; k * k];
        let mut looks = 0;
        for row in (0..self.rows()).step_by(4) {
            for bin in bins {
                let at = |c: usize| self.spectra[(row * k + c) * self.samples + bin];
                looks += 1;
                for a in 0..k {
                    for b in 0..k {
                        sums[a * k + b] += at(a) * at(b).conj();
                    }
                }
            }
        }
        let power = |c: usize| sums[c * k + c].re.max(f64::MIN_POSITIVE);
        let all = (0..k * k).map(|i| sums[i].norm() / (power(i / k) * power(i % k)).sqrt());
        (all.collect(), looks.max(1))
    }
}

/// What stands still: the mean over chirps through a Blackman–Harris window, which keeps moving lines 92 dB down.
struct Still {
    /// Share of the noise's variance that the mean keeps.
    share: f64,
    /// A row for each channel.
    rows: Vec<Vec<Complex64>>,
    window: Vec<f64>,
}

impl Still {
    fn new(cube: &Cube<f64>) -> Still {
        Still {
            share: noise_share(&blackman_harris(cube.chirps)),
            rows: still_rows(cube),
            window: hann(cube.samples),
        }
    }

    /// x of rows y = K₁x + K₂x*.
    fn unmixed(&self, k1: Complex64, k2: Complex64) -> Still {
        let of = |y: &Complex64| (k1.conj() * y - k2 * y.conj()) / (k1.norm_sqr() - k2.norm_sqr());
        let rows = self.rows.iter().map(|r| r.iter().map(of).collect()).collect();
        Still { share: self.share, rows, window: self.window.clone() }
    }

    /// The windowed mean of `row` turned back by `bin`.
    fn at(&self, row: &[Complex64], bin: f64) -> Complex64 {
        let step = -TAU * bin / row.len() as f64;
        let sum: Complex64 = row
            .iter()
            .zip(&self.window)
            .enumerate()
            .map(|(n, (z, w))| z * w * Complex64::cis(step * n as f64))
            .sum();
        sum / self.window.iter().sum::<f64>()
    }

    /// A constant and one line near it, by weighted least squares at the frequency that leaves least. Without a line that stands out the
    /// constant alone.
    fn constant_and_leak(
        &self,
        noise_variance: f64,
        bin_s: f64,
        radar: &Radar,
    ) -> (Vec<Complex64>, Option<Leak>) {
        let n = self.rows[0].len();
        let means: Vec<Complex64> = self.rows.iter().map(|r| self.at(r, 0.0)).collect();
        let ones = vec![Complex64::ONE; n];
        // For each frequency: what the line takes of the windowed power, constant and amplitude of each channel.
        let solve = |bin: f64| -> (f64, Vec<[Complex64; 2]>) {
            let cross = self.at(&ones, bin);
            let det = 1.0 - cross.norm_sqr();
            let mut gain = 0.0;
            let of = |row: &Vec<Complex64>, mean: &Complex64| {
                let b = self.at(row, bin);
                let line = (b - cross * mean) / det;
                [mean - cross.conj() * line, line]
            };
            let all: Vec<[Complex64; 2]> = self.rows.iter().zip(&means).map(|(r, m)| of(r, m)).collect();
            gain += all.iter().map(|x| x[1].norm_sqr()).sum::<f64>() * det;
            (gain, all)
        };
        let steps = ((LEAK_BINS.1 - LEAK_BINS.0) / 0.01).round() as usize;
        let bins: Vec<f64> = (0..=steps).map(|i| LEAK_BINS.0 + 0.01 * i as f64).collect();
        let gains: Vec<f64> = bins.iter().map(|b| solve(*b).0).collect();
        let best = (0..gains.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b])).unwrap_or(0);
        // At an end of the interval it is the flank of something else.
        if best > 0 && best + 1 < gains.len() {
            let bin = golden(bins[best - 1], bins[best + 1], |b| solve(b).0);
            let (_, all) = solve(bin);
            let amplitude: Vec<f64> = all.iter().map(|x| x[1].norm()).collect();
            let mean_square = amplitude.iter().map(|a| a * a).sum::<f64>() / amplitude.len() as f64;
            // 20 dB over what the noise leaves of such an amplitude, and the larger part of what stands here.
            let by_chance = noise_variance * self.share / n as f64 * 4.0;
            if mean_square > 100.0 * by_chance {
                let delay_s = bin * bin_s;
                let lines: Vec<Complex64> = all.iter().map(|x| x[1]).collect();
                let [common_share, wave_share] = shares(&lines, radar, 0.5 * C0 * delay_s);
                let leak = Leak {
                    bin,
                    amplitude,
                    rms: mean_square.sqrt(),
                    deviation: (0.5 * by_chance).sqrt(),
                    delay_s,
                    common_share,
                    wave_share,
                    is_significant: delay_s <= LONGEST_LEAK_S
                        && common_share >= 0.9
                        && 1.0 - common_share <= 2.0 * (1.0 - wave_share) + 17.0 * by_chance / mean_square,
                };
                return (all.iter().map(|x| x[0]).collect(), Some(leak));
            }
        }
        (means, None)
    }

    /// Standard deviation of the mean constant, and what it has to exceed: the noise at [`FALSE_ALARM`], the side lobes of what stands
    /// further away, and twice what the constant and one line leave within four bins.
    fn constant_limit(&self, dc: &[Complex64], leak: Option<&Leak>, noise_variance: f64) -> (f64, f64) {
        let n = self.rows[0].len();
        let k = self.rows.len() as f64;
        let variance = noise_variance * self.share * noise_share(&self.window);
        // The line beside the constant takes part of it.
        let det = leak.map_or(1.0, |l| 1.0 - self.at(&vec![Complex64::ONE; n], l.bin).norm_sqr());
        let deviation = (variance / det.max(1e-3) / k).sqrt();
        let rms = |bin: f64| {
            let all = self.rows.iter().map(|r| self.at(r, bin).norm_sqr());
            (all.sum::<f64>() / k - 17.0 * variance).max(0.0).sqrt()
        };
        // Side lobes of the Hann window: 1/(πx(x² − 1)).
        let lobes: f64 = (4..n - 4)
            .map(|i| {
                let x = i.min(n - i) as f64;
                rms(i as f64) / (PI * x * (x * x - 1.0))
            })
            .sum();
        let line = leak.map(|l| l.bin);
        let ones = vec![Complex64::ONE; n];
        let mut rest = 0.0f64;
        for step in -7..=7 {
            let bin = 0.5 * f64::from(step);
            let mut sum = 0.0;
            for (row, dc) in self.rows.iter().zip(dc) {
                let mut left = self.at(row, bin) - dc * self.at(&ones, bin);
                if let Some(line) = line {
                    let amplitude =
                        (self.at(row, line) - dc * self.at(&ones, line)) * self.at(&ones, bin - line);
                    left -= amplitude;
                }
                sum += left.norm_sqr();
            }
            rest = rest.max((sum / k - 17.0 * variance).max(0.0).sqrt());
        }
        (deviation, deviation * (-FALSE_ALARM.ln()).sqrt() + lobes + 2.0 * rest)
    }

    fn strongest(
        &self,
        dc: &[Complex64],
        leak: Option<&Leak>,
        noise_variance: f64,
        is_boresight: bool,
    ) -> Option<Line> {
        let n = self.rows[0].len();
        let rows: Vec<Vec<Complex64>> =
            self.rows.iter().zip(dc).map(|(r, d)| r.iter().map(|z| z - d).collect()).collect();
        let power = |bin: f64| rows.iter().map(|r| self.at(r, bin).norm_sqr()).sum::<f64>();
        let from = NEAR.max(leak.map_or(0, |l| (l.bin + 3.0).ceil() as usize));
        let best =
            (from..n.saturating_sub(NEAR)).max_by(|a, b| power(*a as f64).total_cmp(&power(*b as f64)))?;
        // Golden section over the main lobe.
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        let (mut lo, mut hi) = (best as f64 - 1.0, best as f64 + 1.0);
        for _ in 0..48 {
            let (a, b) = (hi - ratio * (hi - lo), lo + ratio * (hi - lo));
            if power(a) > power(b) { hi = b } else { lo = a }
        }
        let bin = 0.5 * (lo + hi);
        let all: Vec<Complex64> = rows.iter().map(|r| self.at(r, bin)).collect();
        let mean_square = all.iter().map(|z| z.norm_sqr()).sum::<f64>() / all.len() as f64;
        let by_chance = 1.5 * noise_variance * self.share / n as f64;
        if mean_square < 30.0 * by_chance {
            return None;
        }
        let turn = if is_boresight { 0.0 } else { progression(&all) };
        let straight: Vec<Complex64> =
            all.iter().enumerate().map(|(k, z)| z * Complex64::cis(-turn * k as f64)).collect();
        let mean = straight.iter().map(|z| z / z.norm().max(f64::MIN_POSITIVE)).sum::<Complex64>();
        let common = Complex64::cis(mean.arg());
        Some(Line {
            bin,
            amplitude: all.iter().map(|z| [z.re, z.im]).collect(),
            over_noise_db: db_from_power(mean_square / noise_variance),
            progression_deg: turn.to_degrees(),
            gain_db: all
                .iter()
                .map(|z| db_from_power(z.norm_sqr().max(1e-12 * mean_square) / mean_square))
                .collect(),
            // Channels are multiplied by e^{−jψ} (CONVENTIONS eq. 108).
            phase_deg: straight.iter().map(|z| -(z * common.conj()).arg().to_degrees()).collect(),
        })
    }
}

/// Mean over chirps through a Blackman–Harris window, a row for each channel, u.
pub fn still_rows(cube: &Cube<f64>) -> Vec<Vec<Complex64>> {
    let mut rows = vec![vec![Complex64::ZERO; cube.samples]; cube.channels];
    let window = blackman_harris(cube.chirps);
    let sum = window.iter().sum::<f64>();
    for (m, w) in window.iter().enumerate() {
        for (c, row) in rows.iter_mut().enumerate() {
            row.iter_mut().zip(cube.row(m, c)).for_each(|(to, z)| *to += z * (w / sum));
        }
    }
    rows
}

/// Range-Doppler map through Blackman–Harris windows, with unit gain for noise.
struct Map {
    /// Mean over channels, `[doppler, bin]`.
    power: Vec<f64>,
    /// `[bin, doppler, channel]`.
    cells: Vec<Complex<f32>>,
    /// Doppler cells that no line of any range comes near.
    clean: Vec<usize>,
    channels: usize,
    samples: usize,
    /// Noise of each bin in Doppler cells that no line of any range comes near; empty where there are too few.
    floor: Vec<f64>,
}

impl Map {
    fn new(cube: &Cube<f64>) -> Map {
        let (m, k, n) = (cube.chirps, cube.channels, cube.samples);
        let (slow, fast) = (blackman_harris(m), blackman_harris(n));
        let square = |w: &[f64]| w.iter().map(|x| x * x).sum::<f64>();
        let scale = (square(&slow) * square(&fast)).powf(-0.5);
        let (along_fast, along_slow) = (fft::forward::<f64>(n), fft::forward::<f64>(m));
        let mut cells = vec![Complex::<f32>::ZERO; k * m * n];
        let mut power = vec![0.0; m * n];
        let mut map = vec![Complex64::ZERO; m * n];
        let mut column = vec![Complex64::ZERO; m];
        for c in 0..k {
            for (chirp, w) in slow.iter().enumerate() {
                let row = &mut map[chirp * n..(chirp + 1) * n];
                for (i, (to, z)) in row.iter_mut().zip(cube.row(chirp, c)).enumerate() {
                    *to = z * (w * fast[i] * scale);
                }
                along_fast.process(row);
            }
            for i in 0..n {
                (0..m).for_each(|d| column[d] = map[d * n + i]);
                along_slow.process(&mut column);
                for d in 0..m {
                    let p = column[d].norm_sqr();
                    cells[(i * m + d) * k + c] = Complex::new(column[d].re as f32, column[d].im as f32);
                    power[d * n + i] += p / k as f64;
                }
            }
        }
        let middle = |mut x: Vec<f32>| {
            let at = x.len() / 2;
            f64::from(*x.select_nth_unstable_by(at, f32::total_cmp).1) / LN_2
        };
        let powers = |c: &[Complex<f32>]| c.iter().map(|z| z.norm_sqr()).collect::<Vec<f32>>();
        let all: Vec<f64> = (0..n).map(|i| middle(powers(&cells[i * m * k..(i + 1) * m * k]))).collect();
        let mut is_clean = vec![true; m];
        for d in 0..m {
            if (0..n).any(|i| power[d * n + i] > 17.0 * all[i]) {
                (0..11).for_each(|by| is_clean[(d + m + by - 5) % m] = false);
            }
        }
        let clean: Vec<usize> = (0..m).filter(|d| is_clean[*d]).collect();
        let floor = match clean.len() >= 8 {
            true => (0..n)
                .map(|i| {
                    let of = |d: &usize| powers(&cells[(i * m + d) * k..(i * m + d + 1) * k]);
                    middle(clean.iter().flat_map(of).collect())
                })
                .collect(),
            false => Vec::new(),
        };
        Map { power, cells, clean, channels: k, samples: n, floor }
    }

    /// Bin and power over noise, dB, of the strongest cell away from the constant, with all that is within four bins of it.
    fn strongest(&self, noise_variance: f64) -> Option<(usize, [f64; 2])> {
        let n = self.samples;
        let m = self.power.len() / n;
        let cells = (0..m * n).filter(|i| (2 * NEAR..n - 2 * NEAR).contains(&(i % n)));
        let best = cells.max_by(|a, b| self.power[*a].total_cmp(&self.power[*b]))?;
        let (d, i) = (best / n, best % n);
        let (mut sum, mut moment) = (0.0, 0.0);
        for by in 0..9 {
            for j in i - 4..=i + 4 {
                let p = (self.power[(d + m + by - 4.min(m)) % m * n + j] - noise_variance).max(0.0);
                sum += p;
                moment += p * j as f64;
            }
        }
        let is_line = self.power[best] > 100.0 * noise_variance;
        is_line.then(|| (best, [moment / sum, db_from_power(sum / (m * n) as f64 / noise_variance)]))
    }

    /// Noise in the clean Doppler cells of a range bin, of each slot of `n_rx` receivers: along the amplitudes of the channels in the
    /// cell `line`, and the mean across them. Phase noise is along them, thermal noise is not.
    fn along_and_across(&self, line: usize, bin: usize, n_rx: usize) -> Vec<[f64; 2]> {
        let (k, n) = (self.channels, self.samples);
        let m = self.power.len() / n;
        let at = |d: usize, i: usize| &self.cells[(i * m + d) * k..(i * m + d + 1) * k];
        let steering = at(line / n, line % n);
        let mut out = Vec::with_capacity(self.clean.len() * k / n_rx);
        for d in &self.clean {
            for (a, x) in steering.chunks(n_rx).zip(at(*d, bin).chunks(n_rx)) {
                let norm: f32 = a.iter().map(|z| z.norm_sqr()).sum();
                let all: f32 = x.iter().map(|z| z.norm_sqr()).sum();
                let dot: Complex<f32> = a.iter().zip(x).map(|(a, x)| a.conj() * x).sum();
                let along = dot.norm_sqr() / norm;
                out.push([f64::from(along), f64::from(all - along) / (n_rx as f64 - 1.0).max(1.0)]);
            }
        }
        out
    }
}

/// Phase from channel to channel, rad, of the plane wave that fits best; 0 for two channels or fewer, which it would fit exactly.
fn progression(all: &[Complex64]) -> f64 {
    if all.len() < 3 {
        return 0.0;
    }
    let steps = 64 * all.len();
    let score = |turn: f64| -> f64 {
        all.iter()
            .enumerate()
            .map(|(k, z)| z * Complex64::cis(-turn * k as f64))
            .sum::<Complex64>()
            .norm_sqr()
    };
    let turns = (0..steps).map(|i| TAU * (i as f64 / steps as f64 - 0.5));
    turns.max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(0.0)
}

/// Standard errors that an image has to exceed: √(−ln [`FALSE_ALARM`]) of a complex normal number, and a part more because the scatter of
/// few blocks is uncertain.
pub const SIGNIFICANT_IMAGE: f64 = 4.5;

/// Smallest image over its line that the windows resolve, in amplitude.
pub const SMALLEST_IMAGE: f64 = 1e-4;

/// Sums over the cells of a line and of its image.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    cross: Complex64,
    power: f64,
    image: f64,
    noise: f64,
    count: usize,
}

impl Block {
    /// Power of the image that the line does not explain.
    fn rest(&self) -> f64 {
        (self.image - self.cross.norm_sqr() / self.power).max(0.0)
    }

    /// Whether no more is left than noise, with windows that make four cells out of one, and −80 dB of the line.
    fn is_pure(&self) -> bool {
        let count = self.count as f64 / 4.0;
        self.rest() <= self.noise * gamma_quantile(count.max(1.0)) / count + 1e-8 * self.power
    }
}

/// K₂/K₁* = Σ Y(−d, −i) Y(d, i) / Σ |Y(d, i)|² over the cells of strong lines, and from it g e^{jψ} = (1 − ρ)/(1 + ρ) (CONVENTIONS
/// eq. 109).
fn imbalance(cube: &Cube<f64>, dc: &[Complex64], noise_variance: f64, floor: &[f64]) -> Option<Imbalance> {
    let (m, n) = (cube.chirps, cube.samples);
    let (slow, fast) = (blackman_harris(m), blackman_harris(n));
    let square = |w: &[f64]| w.iter().map(|x| x * x).sum::<f64>();
    let scale = (square(&slow) * square(&fast)).powf(-0.5);
    let (along_fast, along_slow) = (fft::forward::<f64>(n), fft::forward::<f64>(m));
    // Both signs of a bin that lies within a window's main lobe of 0 or of half the rate would be one place.
    let is_apart = |i: usize, of: usize, least: usize| {
        let i = i.min(of - i);
        i >= least && (of - 2 * i) / 2 >= least.min(of / 8)
    };
    // Σ Y(−)Y and Σ|Y|² of blocks: one for each channel and neighbourhood in range, of lines that stand or move.
    let mut blocks = [Vec::<Block>::new(), Vec::new()];
    // Side lobes of all lines, at −92 dB.
    let all_power = cube.data.iter().map(|z| z.norm_sqr()).sum::<f64>() / cube.data.len() as f64;
    let lobes = 0.25 * (m * n) as f64 * all_power * 10f64.powf(-9.2);
    for (channel, dc) in dc.iter().enumerate() {
        let mut map = vec![Complex64::ZERO; m * n];
        for chirp in 0..m {
            let row = &mut map[chirp * n..(chirp + 1) * n];
            for (i, (to, z)) in row.iter_mut().zip(cube.row(chirp, channel)).enumerate() {
                *to = (z - dc) * (slow[chirp] * fast[i] * scale);
            }
            along_fast.process(row);
        }
        let mut column = vec![Complex64::ZERO; m];
        for i in 0..n {
            for d in 0..m {
                column[d] = map[d * n + i];
            }
            along_slow.process(&mut column);
            for d in 0..m {
                map[d * n + i] = column[d];
            }
        }
        let mut sums = vec![[Block::default(); 2]; n.div_ceil(4)];
        for d in 0..m {
            let moves = is_apart(d, m, 4);
            if !moves && d.min(m - d) >= 3 {
                continue;
            }
            for i in (0..n).filter(|i| is_apart(*i, n, NEAR)) {
                let (line, image) = (map[d * n + i], map[(m - d) % m * n + (n - i)]);
                let power = line.norm_sqr();
                if power > 300.0 * noise_variance && power > 30.0 * image.norm_sqr() {
                    let s = &mut sums[i / 4][usize::from(moves)];
                    s.cross += image * line;
                    s.power += power;
                    s.image += image.norm_sqr();
                    s.noise += lobes + floor.get(n - i).map_or(noise_variance, |f| f.max(noise_variance));
                    s.count += 1;
                }
            }
        }
        for (kind, list) in blocks.iter_mut().enumerate() {
            list.extend(sums.iter().map(|s| s[kind]).filter(|s| s.count > 0));
        }
    }
    let power = |list: &[Block]| list.iter().map(|b| b.power).sum::<f64>();
    let from_moving = power(&blocks[1]) > 1000.0 * noise_variance;
    let all = &blocks[usize::from(from_moving)];
    if power(all) < 1000.0 * noise_variance {
        return None;
    }
    // Blocks whose image is another echo are left out, where others are left.
    let pure: Vec<Block> = all.iter().copied().filter(Block::is_pure).collect();
    let blocks = if power(&pure) < 1000.0 * noise_variance { all.clone() } else { pure };
    let total = power(&blocks);
    let mut whole = Block::default();
    for b in &blocks {
        whole.cross += b.cross;
        whole.power += b.power;
        whole.image += b.image;
        whole.noise += b.noise;
        whole.count += b.count;
    }
    let ratio = whole.cross / total;
    // Two Blackman–Harris windows make some four cells out of one.
    let of_noise = 4.0 * whole.noise / whole.count as f64 / total;
    let count = blocks.len() as f64;
    let of_scatter = match blocks.len() {
        0 | 1 => 0.0,
        _ => {
            blocks.iter().map(|b| (b.cross - ratio * b.power).norm_sqr()).sum::<f64>() / (total * total)
                * count
                / (count - 1.0)
        }
    };
    let standard_error = of_noise.max(of_scatter).sqrt();
    let q = (1.0 - ratio) / (1.0 + ratio);
    Some(Imbalance {
        gain_db: db_from_power(q.norm_sqr()),
        phase_deg: q.arg().to_degrees(),
        image_db: db_from_power(ratio.norm_sqr()),
        standard_error,
        is_significant: whole.is_pure()
            && ratio.norm() > SMALLEST_IMAGE
            && ratio.norm() > SIGNIFICANT_IMAGE * standard_error,
        rest_over_noise: whole.rest() / whole.noise,
        from_moving,
        cells: whole.count,
    })
}

/// Standard errors that both sides of a line have to exceed: one side alone does at 3·10⁻⁷ (normal), the common floor makes them alike.
pub const SIGNIFICANT_SIDEBAND: f64 = 5.0;

/// Noise on both sides of the line beyond the floor, in bands of offsets that double. With several receivers it is the noise along the
/// line's amplitudes beyond that across them; with one, the noise beyond that of the quiet bins.
fn sidebands(
    (line, [bin, over_noise_db]): (usize, [f64; 2]),
    map: &Map,
    quiet: &[usize],
    noise_variance: f64,
    n_rx: usize,
) -> Vec<Sideband> {
    let n = map.samples;
    if map.floor.is_empty() {
        return Vec::new();
    }
    let quiet_level = quiet.iter().map(|i| map.floor[*i]).sum::<f64>() / quiet.len() as f64;
    // Median of the mean of n_rx − 1 exponentials (Wilson and Hilferty 1931).
    let across_median = (1.0 - 1.0 / (9.0 * (n_rx as f64 - 1.0).max(1.0))).powi(3);
    let centre = bin.round() as i64;
    let line_power = noise_variance * catseye::base::units::power_from_db(over_noise_db);
    let mut out = Vec::new();
    // The main lobe of the window has four bins.
    let mut from = 5;
    while 2 * from <= n / 2 {
        let to = 2 * from;
        // Excess, its standard deviation, and the number of bins of one side.
        let side = |sign: i64| -> (f64, f64, usize) {
            let bins: Vec<usize> = (from as i64..to as i64)
                .map(|j| centre + sign * j)
                .filter(|i| (NEAR as i64..(n - NEAR) as i64).contains(i))
                .map(|i| i as usize)
                .collect();
            let cells: Vec<[f64; 2]> =
                bins.iter().flat_map(|i| map.along_and_across(line, *i, n_rx)).collect();
            if cells.is_empty() {
                return (0.0, 0.0, 0);
            }
            let along = median(cells.iter().map(|c| c[0]).collect()) / LN_2;
            let across = match n_rx {
                1 => quiet_level,
                _ => median(cells.iter().map(|c| c[1]).collect()) / across_median,
            };
            // A median of n values is off by 1/(ln 2 √n) of its exponential's mean; two windows make four cells out of one, and the level
            // across is less certain than that along by no more than √2.
            let count = cells.len() as f64 / 4.0;
            let error = 2f64.sqrt() * across / LN_2 / count.max(1.0).sqrt();
            ((along - across) / n_rx as f64, error / n_rx as f64, bins.len())
        };
        let ((low, low_error, below), (high, high_error, above)) = (side(-1), side(1));
        if below + above > 0 {
            // A sideband is on both sides of its line; what is on one is an echo.
            let is_whole = below == to - from && above == to - from;
            let (less, more) = (low.min(high), low.max(high));
            let error = low_error.max(high_error);
            let is_seen = is_whole && less > SIGNIFICANT_SIDEBAND * error && more < 4.0 * less;
            out.push(Sideband {
                from,
                to,
                excess_db: is_seen.then(|| db_from_power(0.5 * (less + more) / line_power)),
                bound_db: db_from_power(more.max(SIGNIFICANT_SIDEBAND * error) / line_power),
            });
        }
        from = to;
    }
    out
}
