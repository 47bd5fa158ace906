//! Window coefficients in f64, for both engines.
//!
//! Rectangle, Hann, Hamming and Blackman are *periodic* (DFT-even): their transform on the N-point
//! grid is one, three or five lines exactly, and they equal SciPy's `sym=False`. Dolph-Chebyshev is
//! *symmetric*, because its equal side lobes exist only so (SciPy's `chebwin` with `sym=True`).
//! Sources: Harris, Proc. IEEE 66 (1978) 51; Dolph, Proc. IRE 34 (1946) 335.

use crate::base::error::{BadInput, Result};
use crate::scene::radar::Window;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// `n` coefficients, the largest near 1, not normalised.
///
/// # Errors
/// Returns an error for `n` = 0, or a Dolph-Chebyshev side-lobe level that is not a positive finite number of dB.
///
/// # Example
/// What a window costs: Hann's has a noise bandwidth of 1.5 cells, so 1.76 dB of SNR. A Dolph-Chebyshev window of 60
/// dB keeps all side lobes of its transform 60 dB below the main lobe.
///
/// ```
/// use catseye::dsp::window::coefficients;
/// use catseye::scene::radar::Window;
/// use num_complex::Complex64;
///
/// let hann = coefficients(Window::Hann, 256)?;
/// let (sum, energy) = (hann.iter().sum::<f64>(), hann.iter().map(|w| w * w).sum::<f64>());
/// assert!((256.0 * energy / (sum * sum) - 1.5).abs() < 1e-12);
/// let chebyshev = coefficients(Window::DolphChebyshev { side_lobe_db: 60.0 }, 64)?;
/// let transform = |cells: f64| -> Complex64 {
///     let phase = |i: usize| -std::f64::consts::TAU * cells * i as f64 / 64.0;
///     chebyshev.iter().enumerate().map(|(i, w)| Complex64::from_polar(*w, phase(i))).sum()
/// };
/// let db = |cells: f64| 20.0 * (transform(cells).norm() / transform(0.0).norm()).log10();
/// assert!((30..320).all(|tenth| db(f64::from(tenth) / 10.0) < -59.99));
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn coefficients(window: Window, n: usize) -> Result<Vec<f64>> {
    if n == 0 {
        return Err(BadInput::new("a window needs at least one point").key("window").into());
    }
    if n == 1 {
        return Ok(vec![1.0]);
    }
    match window {
        Window::DolphChebyshev { side_lobe_db } => dolph_chebyshev(n, side_lobe_db),
        _ => Ok((0..n).map(|i| cosine_sum(window, i as f64 / n as f64)).collect()),
    }
}

/// The window weights of antenna elements at `positions` (any unit, any order): a general window
/// for irregular spacings. The window's support is the aperture plus half a mean spacing at each
/// end, so that the outermost elements keep a weight, and each element takes the value at its
/// normalised position; Dolph-Chebyshev is interpolated linearly between the coefficients of a
/// uniform array with as many elements as there are distinct positions (exact when the array is
/// uniform). Elements in one place all get 1.
///
/// # Errors
/// Returns an error for a window that cannot be sampled anywhere, or for places that are not finite.
pub fn at_positions(window: Window, positions: &[f64]) -> Result<Vec<f64>> {
    let mut distinct = positions.to_vec();
    distinct.sort_by(f64::total_cmp);
    let aperture = match (distinct.first(), distinct.last()) {
        (Some(a), Some(b)) => b - a,
        _ => return Ok(Vec::new()),
    };
    distinct.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * aperture);
    let (start, count) = (distinct[0], distinct.len());
    if count < 2 {
        return Ok(vec![1.0; positions.len()]);
    }
    let spacing = aperture / (count - 1) as f64;
    if let Window::DolphChebyshev { .. } = window {
        let w = coefficients(window, count)?;
        return Ok(positions
            .iter()
            .map(|p| {
                let x = ((p - start) / spacing).clamp(0.0, (count - 1) as f64);
                let i = (x as usize).min(count - 2);
                w[i] + (x - i as f64) * (w[i + 1] - w[i])
            })
            .collect());
    }
    Ok(positions
        .iter()
        .map(|p| cosine_sum(window, (p - start + 0.5 * spacing) / (aperture + spacing)))
        .collect())
}

/// Value at `t` in 0..1 of a window that is a sum of cosines.
fn cosine_sum(window: Window, t: f64) -> f64 {
    let c = |m: f64| (TAU * m * t).cos();
    match window {
        Window::Hann => 0.5 - 0.5 * c(1.0),
        Window::Hamming => 0.54 - 0.46 * c(1.0),
        Window::Blackman => 0.42 - 0.5 * c(1.0) + 0.08 * c(2.0),
        Window::Rectangle | Window::DolphChebyshev { .. } => 1.0,
    }
}

/// The window whose transform is T_{n-1}(x0 cos(w/2)), by sampling that at n points and
/// transforming back.
fn dolph_chebyshev(n: usize, side_lobe_db: f64) -> Result<Vec<f64>> {
    if !(side_lobe_db.is_finite() && side_lobe_db > 0.0) {
        return Err(BadInput::new("a Dolph-Chebyshev window needs a side-lobe level")
            .key("side_lobe_db")
            .value(side_lobe_db)
            .allowed("a positive number of dB below the main lobe")
            .into());
    }
    let order = (n - 1) as f64;
    let x0 = (10f64.powf(side_lobe_db / 20.0).acosh() / order).cosh();
    let even = n.is_multiple_of(2);
    let mut p: Vec<Complex64> = (0..n)
        .map(|k| {
            let x = PI * k as f64 / n as f64;
            // Half a sample of delay centres an even window between its two middle points.
            chebyshev(n - 1, x0 * x.cos()) * if even { Complex64::cis(x) } else { Complex64::new(1.0, 0.0) }
        })
        .collect();
    catseye_math::fft::forward(n).process(&mut p);
    // p[1] (even) or p[0] (odd) lies in the middle of the window; the second half mirrors the first.
    let half: Vec<f64> = if even { &p[1..=n / 2] } else { &p[..=n / 2] }.iter().map(|z| z.re).collect();
    let mirrored = half.iter().skip(usize::from(!even)).rev();
    let w: Vec<f64> = mirrored.chain(&half).copied().collect();
    let peak = w.iter().copied().fold(0.0, f64::max);
    Ok(w.iter().map(|v| v / peak).collect())
}

/// Chebyshev polynomial of the first kind, for any real argument.
pub(crate) fn chebyshev(order: usize, x: f64) -> f64 {
    let m = order as f64;
    if x.abs() <= 1.0 {
        (m * x.acos()).cos()
    } else {
        let sign = if x < 0.0 && order % 2 == 1 { -1.0 } else { 1.0 };
        sign * (m * x.abs().acosh()).cosh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |W(f)|^2 relative to f = 0, with f in bins of an n-point transform.
    fn response(w: &[f64], f: f64) -> f64 {
        let n = w.len() as f64;
        let sum: Complex64 =
            w.iter().enumerate().map(|(i, v)| v * Complex64::cis(-TAU * f * i as f64 / n)).sum();
        (sum / w.iter().sum::<f64>()).norm_sqr()
    }

    fn width_3db(w: &[f64]) -> f64 {
        let (mut lo, mut hi) = (0.0, 2.0);
        for _ in 0..60 {
            let mid = 0.5 * (lo + hi);
            if response(w, mid) > 0.5 { lo = mid } else { hi = mid }
        }
        2.0 * lo
    }

    /// The highest response outside the main lobe, in dB.
    fn side_lobe(w: &[f64], first_null: f64) -> f64 {
        let last = (w.len() / 2) as f64;
        let steps = ((last - first_null) * 40.0) as usize;
        let best = (0..=steps)
            .map(|i| response(w, first_null + (last - first_null) * i as f64 / steps as f64))
            .fold(0.0, f64::max);
        10.0 * best.log10()
    }

    #[test]
    fn centroids_are_those_of_the_coefficients() {
        let all = [
            Window::Rectangle,
            Window::Hann,
            Window::Hamming,
            Window::Blackman,
            Window::DolphChebyshev { side_lobe_db: 50.0 },
        ];
        for window in all {
            for n in [1usize, 2, 63, 128] {
                let w = coefficients(window, n).unwrap();
                let mean =
                    w.iter().enumerate().map(|(i, w)| i as f64 * w).sum::<f64>() / w.iter().sum::<f64>();
                assert!((window.centroid(n) - mean).abs() < 1e-9, "{window:?} {n}: {mean}");
            }
        }
    }

    #[test]
    fn widths_and_side_lobes() {
        for (window, width, null, lobe) in [
            (Window::Rectangle, 0.886, 1.0, -13.26),
            (Window::Hann, 1.441, 2.0, -31.47),
            (Window::Hamming, 1.303, 2.0, -42.68),
            (Window::Blackman, 1.644, 3.0, -58.1),
        ] {
            let w = coefficients(window, 512).unwrap();
            assert!((width_3db(&w) - width).abs() < 2e-3, "{window:?} width {}", width_3db(&w));
            let got = side_lobe(&w, null);
            assert!((got - lobe).abs() < 0.06, "{window:?} side lobe {got}");
        }
    }

    #[test]
    fn cosine_windows_are_periodic() {
        for window in [Window::Hann, Window::Hamming, Window::Blackman] {
            for n in [7, 8, 256] {
                let w = coefficients(window, n).unwrap();
                for i in 1..n {
                    assert!((w[i] - w[n - i]).abs() < 1e-14);
                }
            }
        }
        // Three lines exactly.
        assert!(response(&coefficients(Window::Hann, 64).unwrap(), 2.0) < 1e-30);
    }

    #[test]
    fn dolph_chebyshev_is_its_definition() {
        for (n, db) in
            [(2, 30.0), (3, 40.0), (5, 25.0), (8, 30.0), (64, 60.0), (65, 80.0), (1023, 100.0), (4096, 70.0)]
        {
            let w = coefficients(Window::DolphChebyshev { side_lobe_db: db }, n).unwrap();
            assert_eq!(w.len(), n);
            let x0 = (10f64.powf(db / 20.0).acosh() / (n - 1) as f64).cosh();
            let steps = 400.min(20 * n);
            for i in 0..=steps {
                let f = 0.5 * n as f64 * i as f64 / steps as f64;
                let want = chebyshev(n - 1, x0 * (PI * f / n as f64).cos()) / 10f64.powf(db / 20.0);
                let got = response(&w, f).sqrt();
                // Relative to the main lobe; the side lobes lie at 10^(-db/20).
                assert!(
                    (got - want.abs()).abs() < 1e-3 * 10f64.powf(-db / 20.0),
                    "n {n} f {f}: {got} {want}"
                );
            }
            for i in 0..n {
                assert!((w[i] - w[n - 1 - i]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn dolph_chebyshev_side_lobes() {
        for (n, db) in [(16, 30.0), (33, 50.0), (256, 80.0)] {
            let w = coefficients(Window::DolphChebyshev { side_lobe_db: db }, n).unwrap();
            let x0 = (10f64.powf(db / 20.0).acosh() / (n - 1) as f64).cosh();
            // First null: x0 cos(pi f / n) = cos(pi / (2 (n - 1))).
            let null = n as f64 / PI * ((PI / (2.0 * (n - 1) as f64)).cos() / x0).acos();
            let got = side_lobe(&w, null);
            assert!((got + db).abs() < 0.1, "{n}: {got}");
        }
    }

    #[test]
    fn known_chebwin() {
        // By hand for n = 3: W = w0 + 2 w1 cos(w) is T2(x0 cos(w/2)) = x0^2 (1 + cos w) - 1.
        let x0 = (100f64.acosh() / 2.0).cosh();
        let w = coefficients(Window::DolphChebyshev { side_lobe_db: 40.0 }, 3).unwrap();
        assert!((w[0] - 0.5 * x0 * x0 / (x0 * x0 - 1.0)).abs() < 1e-12 && w[1] == 1.0);
    }

    #[test]
    fn windows_over_positions() {
        let uniform: Vec<f64> = (0..8).map(|i| 0.3 + 0.001 * i as f64).collect();
        let cheb = Window::DolphChebyshev { side_lobe_db: 30.0 };
        let w = at_positions(cheb, &uniform).unwrap();
        for (a, b) in w.iter().zip(coefficients(cheb, 8).unwrap()) {
            assert!((a - b).abs() < 1e-9);
        }
        let w = at_positions(Window::Hann, &[0.0, 3.0, 1.0, 2.0]).unwrap();
        assert!(w[0] > 0.1 && (w[0] - w[1]).abs() < 1e-12 && w[2] > w[0]);
        assert_eq!(at_positions(Window::Hann, &[1.0, 1.0]).unwrap(), [1.0, 1.0]);
        assert!(at_positions(Window::Hann, &[]).unwrap().is_empty());
    }

    #[test]
    fn bad_windows_are_errors() {
        assert!(coefficients(Window::Hann, 0).is_err());
        for db in [0.0, -3.0, f64::NAN, f64::INFINITY] {
            assert!(coefficients(Window::DolphChebyshev { side_lobe_db: db }, 9).is_err());
        }
    }
}
