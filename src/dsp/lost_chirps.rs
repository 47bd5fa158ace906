//! Chirps of a cube whose samples were lost. A capture card that misses a packet writes zeros in its place, and zeros in slow time put side
//! lobes of every echo into all Doppler rows: with 3 of 180 chirps zero, one strong target of 3 points gave 60. Such chirps are found by their runs
//! of zeros and filled by linear prediction over slow time.
//!
//! Filling: in each range bin the echoes of a frame are a few complex exponentials over chirps, which obey a linear recurrence. Its coefficients
//! are fitted to the chirps that are there, forward and backward at once (modified covariance method: S. L. Marple, Digital Spectral Analysis,
//! section 8.5), and the missing values are those that leave the least squared error of prediction (A. Janssen, R. Veldhuis, L. Vries, IEEE
//! Trans. ASSP 34 (1986) 317, eq. 7).

use super::Real;
use catseye_math::Matrix;
use catseye_math::fft::{forward, inverse};
use num_complex::{Complex, Complex64};
use rayon::prelude::*;

/// Zeros in a row from which samples count as lost, where a zero is otherwise no value of the samples.
const LEAST_RUN: usize = 16;
/// Probability that the samples of a cube without losses hold such a run.
const FALSE_ALARM: f64 = 1e-6;
/// Largest order of the prediction: as many echoes in one range bin.
const MAX_ORDER: usize = 16;
/// Share of a channel's chirps beyond which nothing is filled.
const MOST_LOST: f64 = 0.3;
/// Added to the diagonal of normal equations, relative to their mean: rounding of f32.
const RIDGE: f64 = 1e-12;

/// The lost samples of a cube `[chirp, rx_virtual, sample]`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LostChirps {
    /// (chirp, channel) of each row of samples with a run of zeros, ascending; none of `silent` channels.
    pub rows: Vec<[usize; 2]>,
    /// Channels that are zero in every chirp.
    pub silent: Vec<usize>,
    /// Number of channels of the cube.
    channels: usize,
    /// Number of chirps of the cube.
    chirps: usize,
}

impl LostChirps {
    /// The lost samples of a cube of `shape` `[chirp, rx_virtual, sample]`. Integers of a weak recording are zero by chance: a run counts that
    /// the share of zeros elsewhere explains with less than one in a million.
    pub fn find<T: Real>(shape: [usize; 3], data: &[Complex<T>]) -> LostChirps {
        let [chirps, channels, samples] = shape;
        let mut found = LostChirps { channels, chirps, ..LostChirps::default() };
        let longest: Vec<(usize, usize)> = data.par_chunks_exact(samples.max(1)).map(zeros).collect();
        found.silent =
            (0..channels).filter(|c| (0..chirps).all(|m| longest[m * channels + c].0 == samples)).collect();
        if found.silent.len() == channels {
            return found;
        }
        let least = LEAST_RUN.min(samples);
        let rest = longest.iter().filter(|(run, _)| *run < least);
        let (rows, zeros) = rest.fold((0usize, 0usize), |(n, z), (_, count)| (n + 1, z + count));
        let share = zeros as f64 / (rows * samples).max(1) as f64;
        let by_chance = (FALSE_ALARM / data.len() as f64).ln() / share.ln();
        let least = if share > 0.0 { least.max(by_chance.ceil() as usize) } else { least };
        found.rows = (0..chirps)
            .flat_map(|m| (0..channels).map(move |c| [m, c]))
            .filter(|[m, c]| longest[m * channels + c].0 >= least && found.silent.binary_search(c).is_err())
            .collect();
        found
    }

    /// Adds what was found in further channels of the same chirps.
    pub fn append(&mut self, next: &LostChirps) {
        let first = self.channels;
        self.rows.extend(next.rows.iter().map(|[m, c]| [*m, c + first]));
        self.rows.sort_unstable();
        self.silent.extend(next.silent.iter().map(|c| c + first));
        self.channels += next.channels;
        self.chirps = next.chirps;
    }

    /// Number of chirps in which some channel has lost samples.
    pub fn chirps(&self) -> usize {
        let mut chirps: Vec<usize> = self.rows.iter().map(|r| r[0]).collect();
        chirps.dedup();
        chirps.len()
    }

    fn of_channel(&self, channel: usize) -> Vec<usize> {
        self.rows.iter().filter(|r| r[1] == channel).map(|r| r[0]).collect()
    }

    /// Whether so many chirps of a channel are lost, or so few are there, that its rows are left as they are.
    fn is_beyond_repair(&self, channel: usize) -> bool {
        let lost = self.of_channel(channel);
        lost.len() as f64 > MOST_LOST * self.chirps as f64 || order(self.chirps, &lost).is_none()
    }

    /// What a user has to know, one line each: lost chirps, whether they are filled, channels without samples.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.silent.len() == self.channels && self.channels > 0 {
            lines.push("all samples of the frame are zero".to_string());
            return lines;
        }
        let list = |of: &[usize]| {
            let few: Vec<String> = of.iter().take(8).map(usize::to_string).collect();
            few.join(", ") + if of.len() > 8 { ", ..." } else { "" }
        };
        if !self.rows.is_empty() {
            let mut chirps: Vec<usize> = self.rows.iter().map(|r| r[0]).collect();
            chirps.dedup();
            let left: Vec<usize> = (0..self.channels).filter(|c| self.is_beyond_repair(*c)).collect();
            let then = match left.len() {
                0 => "they are replaced by a prediction from the chirps beside them".to_string(),
                n if n == self.channels => {
                    "they are too many to be replaced, which causes side lobes over Doppler".into()
                }
                _ => format!(
                    "they are replaced from the chirps beside them, but channels {} have lost too many",
                    list(&left)
                ),
            };
            lines.push(format!(
                "{} of {} chirps hold runs of zeros, as lost packets leave them (chirps {}): {then}",
                chirps.len(),
                self.chirps,
                list(&chirps)
            ));
        }
        if !self.silent.is_empty() {
            lines.push(format!(
                "the samples of channels {} are zero in every chirp: directions are estimated as if these channels had received nothing",
                list(&self.silent)
            ));
        }
        lines
    }

    /// Fills the lost rows of `data`, `[chirp, rx_virtual, sample]`, of the cube in which they were found. Rows of channels of which more than
    /// three in ten are lost stay as they are.
    pub fn fill<T: Real>(&self, data: &mut [Complex<T>]) {
        let mut concerned: Vec<usize> = self.rows.iter().map(|r| r[1]).collect();
        concerned.sort_unstable();
        concerned.dedup();
        concerned.retain(|c| !self.is_beyond_repair(*c));
        if concerned.is_empty() {
            return;
        }
        let samples = data.len() / (self.chirps * self.channels);
        let row =
            |m: usize, c: usize| (m * self.channels + c) * samples..(m * self.channels + c + 1) * samples;
        let (ahead, back) = (forward::<f64>(samples), inverse::<f64>(samples));
        for c in concerned {
            let lost = self.of_channel(c);
            let is_real = (0..self.chirps).all(|m| data[row(m, c)].iter().all(|z| z.im == T::zero()));
            // Range bins of the chirps, [bin][chirp].
            let mut bins = vec![Complex64::default(); samples * self.chirps];
            for m in (0..self.chirps).filter(|m| lost.binary_search(m).is_err()) {
                let mut line: Vec<Complex64> =
                    data[row(m, c)].iter().map(|z| Complex64::new(z.re.wide(), z.im.wide())).collect();
                ahead.process(&mut line);
                line.iter().enumerate().for_each(|(k, z)| bins[k * self.chirps + m] = *z);
            }
            bins.par_chunks_exact_mut(self.chirps).for_each(|x| fill(x, &lost));
            for m in &lost {
                let mut line: Vec<Complex64> = (0..samples).map(|k| bins[k * self.chirps + m]).collect();
                back.process(&mut line);
                for (out, z) in data[row(*m, c)].iter_mut().zip(line) {
                    let z = z / samples as f64;
                    *out = Complex::new(T::of(z.re), if is_real { T::zero() } else { T::of(z.im) });
                }
            }
        }
    }
}

/// The longest run of zeros, and how many zeros there are.
fn zeros<T: Real>(row: &[Complex<T>]) -> (usize, usize) {
    let (mut longest, mut run, mut count) = (0, 0, 0);
    for z in row {
        let is_zero = z.re == T::zero() && z.im == T::zero();
        run = if is_zero { run + 1 } else { 0 };
        count += usize::from(is_zero);
        longest = longest.max(run);
    }
    (longest, count)
}

/// Windows of `order` + 1 chirps that hold none of `lost`.
fn whole_windows(n: usize, lost: &[usize], order: usize) -> Vec<usize> {
    (0..n.saturating_sub(order)).filter(|w| !lost.iter().any(|l| (*w..=w + order).contains(l))).collect()
}

/// The largest order of prediction for which windows without a gap are at least twice as many as the coefficients.
fn order(n: usize, lost: &[usize]) -> Option<usize> {
    (1..=MAX_ORDER.min(n / 3)).rev().find(|p| whole_windows(n, lost, *p).len() >= 2 * p)
}

/// Fills the values `lost` of one range bin over chirps.
fn fill(x: &mut [Complex64], lost: &[usize]) {
    let n = x.len();
    let power: f64 = x.iter().map(|z| z.norm_sqr()).sum::<f64>();
    let Some(order) = order(n, lost).filter(|_| power > 0.0) else { return };
    let windows = whole_windows(n, lost, order);
    // Forward: x[w+p] = sum_k a_k x[w+p-k]; backward: conj x[w] = sum_k a_k conj x[w+k].
    let mut normal = Matrix::zeros(order, order);
    let mut right = vec![Complex64::default(); order];
    for w in windows {
        let forward = |k: usize| x[w + order - k];
        let backward = |k: usize| x[w + k].conj();
        for (i, r) in right.iter_mut().enumerate() {
            let (f, b) = (forward(i + 1).conj(), backward(i + 1).conj());
            *r += f * forward(0) + b * backward(0);
            for j in 0..order {
                normal[(i, j)] += f * forward(j + 1) + b * backward(j + 1);
            }
        }
    }
    let a = solved(normal, &right);
    // Error of prediction e = c * x with c = (1, -a); its squares over all windows with a gap, in both directions, are least.
    let c: Vec<Complex64> = std::iter::once(Complex64::from(1.0)).chain(a.iter().map(|a| -a)).collect();
    let g = lost.len();
    let mut normal = Matrix::zeros(g, g);
    let mut right = vec![Complex64::default(); g];
    for w in 0..n - order {
        let inside: Vec<(usize, usize)> = lost
            .iter()
            .enumerate()
            .filter(|(_, l)| (w..=w + order).contains(l))
            .map(|(i, l)| (i, l - w))
            .collect();
        if inside.is_empty() {
            continue;
        }
        // The coefficient of x[w + i]: forward, and backward with the conjugate taken of the whole equation.
        for coefficient in
            [|c: &[Complex64], i: usize| c[c.len() - 1 - i], |c: &[Complex64], i: usize| c[i].conj()]
        {
            let known: Complex64 = (0..=order)
                .filter(|i| !inside.iter().any(|(_, at)| at == i))
                .map(|i| coefficient(&c, i) * x[w + i])
                .sum();
            for (i, at) in &inside {
                let f = coefficient(&c, *at).conj();
                right[*i] -= f * known;
                for (j, other) in &inside {
                    normal[(*i, *j)] += f * coefficient(&c, *other);
                }
            }
        }
    }
    for (l, z) in lost.iter().zip(solved(normal, &right)) {
        x[*l] = if z.is_finite() { z } else { Complex64::default() };
    }
}

/// The solution of normal equations; zeros where they have none.
fn solved(mut normal: Matrix, right: &[Complex64]) -> Vec<Complex64> {
    let n = right.len();
    let mean: f64 = (0..n).map(|i| normal[(i, i)].re).sum::<f64>() / n.max(1) as f64;
    if mean.is_nan() || mean <= 0.0 {
        return vec![Complex64::default(); n];
    }
    for i in 0..n {
        normal[(i, i)] += RIDGE * mean;
    }
    let inverse = normal.inverse();
    (0..n).map(|i| (0..n).map(|j| inverse[(i, j)] * right[j]).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;

    const SHAPE: [usize; 3] = [60, 2, 64];

    /// Two echoes of 60 and 40 dB over the noise of a sample, rounded to f32.
    fn cube(noise: f64) -> Vec<Complex<f32>> {
        let [chirps, channels, samples] = SHAPE;
        let mut draw = random_normals(chirps * channels * samples * 2);
        let mut out = Vec::new();
        for m in 0..chirps {
            for c in 0..channels {
                for s in 0..samples {
                    let tone = |a: f64, range: f64, doppler: f64, angle: f64| {
                        Complex64::from_polar(a, range * s as f64 + doppler * m as f64 + angle * c as f64)
                    };
                    let z = tone(1.0, 0.7, 0.9, 1.0) + tone(0.1, 0.72, -1.7, -0.4);
                    let n = Complex64::new(draw.pop().unwrap_or(0.0), draw.pop().unwrap_or(0.0)) * noise;
                    let z = z + n;
                    out.push(Complex::new(z.re as f32, z.im as f32));
                }
            }
        }
        out
    }

    fn random_normals(n: usize) -> Vec<f64> {
        let mut draws = Draws::new(7, 0);
        (0..n).map(|_| draws.normal()).collect()
    }

    #[test]
    fn lost_chirps_are_found_and_predicted() {
        let [_, channels, samples] = SHAPE;
        let truth = cube(1e-3);
        assert_eq!(LostChirps::find(SHAPE, &truth).lines(), Vec::<String>::new());
        let mut data = truth.clone();
        // A packet that ends within a chirp, one at the end of the frame, and two chirps in a row.
        let at = |m: usize, c: usize| (m * channels + c) * samples;
        data[at(7, 1) + 20..at(8, 0) + 17].fill(Complex::default());
        data[at(40, 0)..at(42, 0)].fill(Complex::default());
        data[at(59, 1)..].fill(Complex::default());
        let lost = LostChirps::find(SHAPE, &data);
        let rows = vec![[7, 1], [8, 0], [40, 0], [40, 1], [41, 0], [41, 1], [59, 1]];
        assert_eq!((lost.rows.clone(), lost.silent.clone(), lost.chirps()), (rows, vec![], 5));
        assert!(lost.lines()[0].contains("5 of 60 chirps"), "{:?}", lost.lines());
        lost.fill(&mut data);
        let error: f64 = lost
            .rows
            .iter()
            .flat_map(|[m, c]| at(*m, *c)..at(*m, *c) + samples)
            .map(|i| f64::from((data[i] - truth[i]).norm_sqr()))
            .sum::<f64>()
            / (lost.rows.len() * samples) as f64;
        // The noise of the true samples, 2e-6, and that of the prediction, which is no more than twice as much.
        assert!(error < 3.0 * 2e-6, "{error:e}");
        assert!(data.iter().zip(&truth).filter(|(a, b)| a != b).count() <= lost.rows.len() * samples);
    }

    #[test]
    fn what_is_no_loss_stays() {
        // Counts of a weak recording: a third are zero.
        let counts: Vec<Complex<f32>> = cube(1e-3)
            .iter()
            .zip(random_normals(SHAPE.iter().product()))
            .map(|(_, n)| Complex::new((0.9 * n).round() as f32, 0.0))
            .collect();
        assert_eq!(LostChirps::find(SHAPE, &counts).rows, Vec::<[usize; 2]>::new());
        // A channel that is off is said, and not filled.
        let mut off = cube(1e-3);
        off.chunks_exact_mut(64).skip(1).step_by(2).for_each(|r| r.fill(Complex::default()));
        let lost = LostChirps::find(SHAPE, &off);
        assert_eq!((lost.rows.len(), lost.silent.clone()), (0, vec![1]));
        assert!(lost.lines()[0].contains("channels 1 are zero"));
        let nothing = LostChirps::find(SHAPE, &vec![Complex::<f32>::default(); 60 * 128]);
        assert_eq!(nothing.lines(), ["all samples of the frame are zero"]);
        // Beyond repair: every other chirp.
        let mut half = cube(1e-3);
        half.chunks_exact_mut(128).step_by(2).for_each(|r| r.fill(Complex::default()));
        let lost = LostChirps::find(SHAPE, &half);
        let before = half.clone();
        lost.fill(&mut half);
        assert!(lost.lines()[0].contains("too many") && before == half);
        // Two chirps predict nothing.
        let mut two = cube(1e-3)[..2 * 128].to_vec();
        two[128..].fill(Complex::default());
        let lost = LostChirps::find([2, 2, 64], &two);
        assert!(lost.rows.len() == 2 && lost.lines()[0].contains("too many"), "{:?}", lost.lines());
    }
}
