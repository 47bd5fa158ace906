//! Powers of sources in known directions, and the least standard deviation of their angles
//! (CONVENTIONS eq. 97).

use super::doa_manifold::{Manifold, Matrix};
use num_complex::Complex64;

/// Least-squares fit of sources in given directions to a covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Source covariance A+ R A+^H; its diagonal holds the powers in W, noise included.
    pub sources: Matrix,
    /// Mean power per channel that no source explains: tr(P R)/(N - M), in W. Zero for as many
    /// sources as channels.
    pub noise_w: f64,
}

/// Fits the powers of sources to the covariance R of all channels; A has their steering vectors as columns.
pub fn fit(a: &Matrix, r: &Matrix) -> Fit {
    let (n, m) = (a.nrows(), a.ncols());
    let mut gram = a.adjoint() * a;
    // Directions that look alike share their power instead of dividing by nothing.
    for i in 0..m {
        gram[(i, i)] += 1e-10 * n as f64;
    }
    let plus = gram.inverse() * a.adjoint();
    let sources = &plus * r * plus.adjoint();
    let explained = a * (&plus * r);
    let left: f64 = (0..n).map(|i| (r[(i, i)] - explained[(i, i)]).re).sum();
    let noise_w = if n > m { (left / (n - m) as f64).max(0.0) } else { 0.0 };
    Fit { sources, noise_w }
}

/// Standard deviations in rad, `[azimuth, elevation]` of each source, that no unbiased estimator can
/// undercut (Stoica & Nehorai, IEEE Trans. ASSP-37, 720, 1989; conditional bound): sigma^2/(2T)
/// {Re[(D^H P D) o S^T]}^-1. Infinite where the array cannot tell; zero for an axis that is not asked
/// for.
///
/// `axes`: whether azimuth and elevation are unknown. `sources`: their covariance S in W.
///
/// # Example
/// One source on a line of N receivers half a wavelength apart: σ² = 6/(SNR T N(N² − 1) π² cos² θ), SNR per channel.
/// With 8 receivers, 20 dB and one snapshot the bound is 0.21° at 20°.
///
/// ```
/// use catseye::dsp::{doa_crb::standard_deviations, doa_manifold::{Manifold, Matrix}};
/// use glam::DVec3;
/// use num_complex::Complex64;
/// use std::f64::consts::PI;
///
/// let line = (0..8).map(|i| DVec3::Y * 2e-3 * f64::from(i)).collect();
/// let array = Manifold::receivers(line, 4e-3)?;
/// let (azimuth_rad, snr) = (20f64.to_radians(), 100.0);
/// let power = Matrix::from_fn(1, 1, |_, _| Complex64::from(snr));
/// let [azimuth_std_rad, _] = standard_deviations(&array, &[(azimuth_rad, 0.0)], [true, false], &power, 1.0, 1)[0];
/// let closed_form_rad = (6.0 / (snr * 8.0 * 63.0 * (PI * azimuth_rad.cos()).powi(2))).sqrt();
/// assert!((azimuth_std_rad / closed_form_rad - 1.0).abs() < 1e-6);
/// assert!((azimuth_std_rad.to_degrees() - 0.21).abs() < 0.01);
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn standard_deviations(
    manifold: &Manifold,
    directions: &[(f64, f64)],
    axes: [bool; 2],
    sources: &Matrix,
    noise_w: f64,
    snapshots: usize,
) -> Vec<[f64; 2]> {
    let asked: Vec<usize> = (0..2).filter(|k| axes[*k]).collect();
    let size = asked.len() * directions.len();
    let mut out = vec![[0.0; 2]; directions.len()];
    if size == 0 {
        return out;
    }
    let a = manifold.matrix(directions);
    let columns: Vec<Vec<Complex64>> = directions
        .iter()
        .flat_map(|(az, el)| {
            let d = manifold.derivatives(*az, *el);
            asked.iter().map(|k| d[*k].clone()).collect::<Vec<_>>()
        })
        .collect();
    let d = Matrix::from_fn(a.nrows(), size, |c, p| columns[p][c]);
    let q = a.thin_q();
    let free = &d - &q * (q.adjoint() * &d);
    let h = d.adjoint() * free;
    let source = |p: usize| p / asked.len();
    let information =
        |i: usize, j: usize| 2.0 * snapshots as f64 * (h[(i, j)] * sources[(source(j), source(i))]).re;
    // Scaled to a unit diagonal, so that sources of any powers and axes of any sharpness invert alike.
    let scale: Vec<f64> = (0..size).map(|i| information(i, i).sqrt()).collect();
    let even = Matrix::from_fn(size, size, |i, j| Complex64::from(information(i, j) / (scale[i] * scale[j])));
    let inverse = even.inverse();
    for p in 0..size {
        let gain = inverse[(p, p)].re;
        let variance = noise_w * gain / (scale[p] * scale[p]);
        // What is singular but for rounding says nothing.
        let known = scale[p] > 0.0 && gain > 0.0 && gain < 1e12;
        out[source(p)][asked[p % asked.len()]] = if known { variance.sqrt() } else { f64::INFINITY };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::doa_covariance::covariance;
    use glam::DVec3;

    const LAMBDA: f64 = 0.004;

    fn line(n: usize) -> Manifold {
        Manifold::receivers((0..n).map(|i| DVec3::Y * (0.5 * LAMBDA * i as f64)).collect(), LAMBDA).unwrap()
    }

    #[test]
    fn one_source_has_the_textbook_bound() {
        // var(phase per element) = 6 sigma^2/(T P N (N^2 - 1)); phase = pi sin(azimuth).
        let (n, snr, t, az) = (8usize, 50.0, 20, 0.4f64);
        let p = Matrix::from_fn(1, 1, |_, _| Complex64::from(snr));
        let got = standard_deviations(&line(n), &[(az, 0.0)], [true, false], &p, 1.0, t)[0];
        let nf = n as f64;
        let phase = (6.0 / (t as f64 * snr * nf * (nf * nf - 1.0))).sqrt();
        let want = phase / (std::f64::consts::PI * az.cos());
        assert!((got[0] / want - 1.0).abs() < 1e-6 && got[1] == 0.0);
    }

    #[test]
    fn a_line_cannot_tell_both_angles() {
        let p = Matrix::from_fn(1, 1, |_, _| Complex64::ONE);
        let got = standard_deviations(&line(6), &[(0.2, 0.1)], [true, true], &p, 1.0, 1)[0];
        assert!(got[0].is_infinite() && got[1].is_infinite(), "{got:?}");
    }

    #[test]
    fn powers_and_noise_of_known_directions() {
        let m = line(6);
        let at = [(0.3, 0.0), (-0.2, 0.0)];
        let a = m.matrix(&at);
        let s = [Complex64::new(2.0, 0.0), Complex64::new(0.0, 0.5)];
        let x: Vec<Complex64> = (0..6).map(|c| a[(c, 0)] * s[0] + a[(c, 1)] * s[1]).collect();
        let f = fit(&a, &covariance(&x, 6));
        assert!((f.sources[(0, 0)].re - 4.0).abs() < 1e-8 && (f.sources[(1, 1)].re - 0.25).abs() < 1e-8);
        assert!(f.noise_w < 1e-9);
    }
}
