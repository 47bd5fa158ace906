//! What the samples of a cube that somebody brings say about it: counts of a converter, clipping, channels and chirps that are copies.
//! Each gives one line for the user; nothing is changed.

use super::Real;
use num_complex::Complex;
use rayon::prelude::*;

/// Share of parts at full scale from which a cube is clipped, and their least number.
const CLIPPED_SHARE: f64 = 1e-3;
const CLIPPED_PARTS: usize = 16;

/// A step of a converter of 12 bits, as a share of its range: that of counts in another unit is not known.
const SCALED_STEP: f64 = 1.0 / 2048.0;

/// Whether all samples are whole numbers and some are beyond one: counts, whatever the type that holds them.
pub fn are_counts<T: Real>(data: &[Complex<T>]) -> bool {
    let is_whole = |z: &Complex<T>| z.re.fract() == T::zero() && z.im.fract() == T::zero();
    data.par_iter().all(is_whole) && data.iter().any(|z| z.re.abs() > T::one() || z.im.abs() > T::one())
}

/// Whether some real parts, and whether some imaginary parts are not zero.
pub fn parts<T: Real>(data: &[Complex<T>]) -> [bool; 2] {
    [data.iter().any(|z| z.re != T::zero()), data.iter().any(|z| z.im != T::zero())]
}

/// Lines about the samples of one frame `[chirp, rx_virtual, sample]`.
pub fn lines<T: Real>(shape: [usize; 3], data: &[Complex<T>]) -> Vec<String> {
    let mut lines = Vec::new();
    lines.extend(clipped(data));
    if are_unsigned_words(data) {
        lines
            .push("the samples look like unsigned 16-bit words of signed counts (--words unsigned16)".into());
    }
    lines.extend(copied_channels(shape, data));
    lines.extend(copied_chirps(shape, data));
    lines
}

/// Parts of samples that stand at the largest magnitude. A cube is clipped where these are more than twice as many as the parts within the
/// hundredth below: a tone that fits is there arccos(0.99)/π = 4.5 % of its time and within half a permille of its peak 1 %, and noise comes to
/// the lower values more often. Below 100 steps a hundredth is less than a step, and nothing is said.
fn clipped<T: Real>(data: &[Complex<T>]) -> Option<String> {
    let parts = || data.par_iter().flat_map_iter(|z| [z.re.wide(), z.im.wide()]);
    let largest = parts().map(f64::abs).reduce(|| 0.0, f64::max);
    if largest <= 0.0 || !largest.is_finite() {
        return None;
    }
    let at = |level: f64| parts().filter(|x| *x >= level).count() + parts().filter(|x| *x <= -level).count();
    // Two's complement has one more below zero.
    let step = if are_counts(data) { 1.0 } else { largest * SCALED_STEP };
    let full = at(largest - 1.5 * step);
    let below = at(largest * 0.99 - 1.5 * step) - full;
    let share = full as f64 / (2 * data.len()) as f64;
    let is_many = full >= CLIPPED_PARTS && share >= CLIPPED_SHARE;
    // As many stand at the end as in the last hundredth before it: no tone and no noise does that.
    (is_many && full > 2 * below.max(1) && largest >= 100.0 * step).then(|| {
        format!(
            "{:.2} % of the real and imaginary parts of the samples are at their largest magnitude, {largest}: the converter was driven beyond its range, which causes false echoes",
            100.0 * share
        )
    })
}

/// Unsigned words of signed counts gather at both ends of 16 bits and leave its middle empty, unless the converter is driven to its ends.
fn are_unsigned_words<T: Real>(data: &[Complex<T>]) -> bool {
    const MIDDLE: f64 = 32768.0;
    /// So many values about the middle are empty.
    const GAP: f64 = 4096.0;
    if !are_counts(data) {
        return false;
    }
    let (mut below, mut above, mut low, mut high) = (0usize, 0usize, 0.0f64, 65536.0f64);
    for x in data.iter().flat_map(|z| [z.re.wide(), z.im.wide()]) {
        match x {
            0.0..MIDDLE => (below, low) = (below + 1, low.max(x)),
            MIDDLE..65536.0 => (above, high) = (above + 1, high.min(x)),
            _ => return false,
        }
    }
    let all = below + above;
    below * 10 > all && above * 10 > all && high - low > GAP
}

/// Channels with the same samples as another one, while there are others: without noise an echo ahead is alike in all.
fn copied_channels<T: Real>([chirps, channels, samples]: [usize; 3], data: &[Complex<T>]) -> Option<String> {
    let row = |m: usize, c: usize| &data[(m * channels + c) * samples..(m * channels + c + 1) * samples];
    let is_zero = |c: usize| (0..chirps).all(|m| row(m, c).iter().all(|z| z.norm_sqr() == T::zero()));
    let same = |a: usize, b: usize| (0..chirps).all(|m| row(m, a) == row(m, b));
    let used: Vec<usize> = (0..channels).filter(|c| !is_zero(*c)).collect();
    let first_of = |c: usize| used.iter().copied().find(|a| same(*a, c)).unwrap_or(c);
    let copies: Vec<(usize, usize)> =
        used.iter().map(|c| (*c, first_of(*c))).filter(|(c, a)| c != a).collect();
    let (copy, of) = copies.first()?;
    let kinds = used.len() - copies.len();
    (kinds > 1).then(|| {
        format!(
            "{} of {channels} channels repeat the samples of another one, such as channel {copy} those of {of}: directions are wrong",
            copies.len()
        )
    })
}

/// Chirps with the same samples as the one before, while others differ: without noise and motion all are alike.
fn copied_chirps<T: Real>([chirps, channels, samples]: [usize; 3], data: &[Complex<T>]) -> Option<String> {
    let row = |m: usize| &data[m * channels * samples..(m + 1) * channels * samples];
    let is_zero = |m: usize| row(m).iter().all(|z| z.norm_sqr() == T::zero());
    let copies: Vec<usize> = (1..chirps).filter(|m| row(*m) == row(m - 1) && !is_zero(*m)).collect();
    let first = *copies.first()?;
    (copies.len() + 1 < chirps).then(|| {
        format!("{} of {chirps} chirps repeat the samples of the chirp before them, the first is chirp {first}, which causes false range rates", copies.len())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;
    use std::f64::consts::TAU;

    const SHAPE: [usize; 3] = [16, 4, 64];

    /// A tone with noise, in counts.
    fn counts(amplitude: f64, most: f64) -> Vec<Complex<f32>> {
        let mut draws = Draws::new(3, 0);
        let [chirps, channels, samples] = SHAPE;
        (0..chirps * channels * samples)
            .map(|i| {
                let (m, c, n) = (i / samples / channels, i / samples % channels, i % samples);
                let phase = TAU * (0.113 * n as f64 + 0.07 * m as f64 + 0.21 * c as f64);
                let part =
                    |x: f64, noise: f64| (amplitude * x + noise).round().clamp(-most - 1.0, most) as f32;
                Complex::new(part(phase.cos(), 8.0 * draws.normal()), part(phase.sin(), 8.0 * draws.normal()))
            })
            .collect()
    }

    fn said(data: &[Complex<f32>], part: &str) {
        let lines = lines(SHAPE, data);
        assert!(lines.len() == 1 && lines[0].contains(part), "{lines:?}");
    }

    #[test]
    fn whole_recordings_give_no_line() {
        let none: [String; 0] = [];
        for (amplitude, most) in [(3000.0, 32767.0), (0.0, 32767.0), (20.0, 32767.0), (32700.0, 32767.0)] {
            assert_eq!(lines(SHAPE, &counts(amplitude, most)), none, "{amplitude}");
        }
        assert!(are_counts(&counts(30.0, 32767.0)) && parts(&counts(30.0, 32767.0)) == [true; 2]);
        // Without noise: a target ahead that stands, one aside, and nothing at all.
        let still = |angle: f64| -> Vec<Complex<f32>> {
            let z = |i: usize| {
                Complex::from_polar(1.0, 0.7 * (i % 64) as f32 + angle as f32 * (i / 64 % 4) as f32)
            };
            (0..16 * 4 * 64).map(z).collect()
        };
        for data in [still(0.0), still(0.3), vec![Complex::default(); 4096]] {
            assert_eq!(lines(SHAPE, &data), none);
            assert!(!are_counts(&data));
        }
    }

    #[test]
    fn what_is_wrong_with_a_recording_is_said() {
        said(&counts(60_000.0, 8191.0), "are at their largest magnitude, 8192");
        let scaled: Vec<Complex<f32>> = counts(60_000.0, 8191.0).iter().map(|z| z * 1e-9f32).collect();
        said(&scaled, "largest magnitude");
        let word = |x: f32| if x < 0.0 { x + 65536.0 } else { x };
        let words: Vec<Complex<f32>> =
            counts(300.0, 32767.0).iter().map(|z| Complex::new(word(z.re), word(z.im))).collect();
        said(&words, "--words unsigned16");
        let mut copied = counts(300.0, 32767.0);
        for m in 0..16 {
            let at = m * 256;
            copied.copy_within(at..at + 64, at + 128);
        }
        said(&copied, "1 of 4 channels repeat the samples of another one, such as channel 2 those of 0");
        let mut frozen = counts(300.0, 32767.0);
        for m in 10..16 {
            frozen.copy_within(9 * 256..10 * 256, m * 256);
        }
        said(&frozen, "6 of 16 chirps repeat the samples of the chirp before them, the first is chirp 10");
        let real: Vec<Complex<f32>> =
            counts(300.0, 32767.0).iter().map(|z| Complex::new(z.re, 0.0)).collect();
        assert_eq!(parts(&real), [true, false]);
    }
}
