//! How sure a point is: standard deviations of range, range rate and angles from its SNR
//! (CONVENTIONS eq. 115–117).
//!
//! Not only the bound but what the chain does: a windowed transform, a peak between three cells, a beamformer. The bound of Cramér and Rao for one tone (Rife and Boorstyn, IEEE Trans. IT-20
//! (1974) 591) is the limit for a rectangular window and an ideal search for the peak.

use super::angle_ambiguity::AngleLobes;
use crate::dsp::peaks::{Interpolator, parabola};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Offsets from the middle of the cell over which an axis is averaged.
const OFFSETS: usize = 32;

/// A spectral axis of the map: what noise and the interpolation of eq. 18 do to a peak's place.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisAccuracy {
    /// √(2 SNR) times the standard deviation, in cells, of the least-squares fit of a tone under this
    /// window; with a rectangle, the bound of Cramér and Rao (eq. 115).
    pub fit: f64,
    /// Standard deviation of the place between three cells, root mean square over offsets (eq. 116).
    pub peak: f64,
    /// What it is off without noise, root mean square over offsets, in cells.
    pub bias: f64,
    /// What the parabola is off under this window, which is taken out; None where that cannot be.
    pub response: Option<Interpolator>,
    /// Distance from the middle of the data to the window's centroid, in values: half a value under a periodic window.
    pub late: f64,
}

impl AxisAccuracy {
    /// `window`: as long as the data, in any scale, with a positive sum; `bins`: length of the
    /// transform, not less than the data. A transform of one bin measures nothing: all infinite.
    ///
    /// # Example
    /// Under a rectangular window the fit of a tone reaches the bound of Cramér and Rao, √6/2π cells over the root of
    /// the SNR in the cell. Under a Hann window it is less accurate, and so is the parabola through three cells.
    ///
    /// ```
    /// use catseye::detect::accuracy::AxisAccuracy;
    /// use catseye::dsp::window::coefficients;
    /// use catseye::scene::radar::Window;
    ///
    /// let snr = 100.0_f64;
    /// let fit_cells = |axis: &AxisAccuracy| axis.fit / (2.0 * snr).sqrt();
    /// let rectangle = AxisAccuracy::new(&coefficients(Window::Rectangle, 256)?, 256);
    /// let bound_cells = 6f64.sqrt() / (std::f64::consts::TAU * snr.sqrt());
    /// assert!((fit_cells(&rectangle) / bound_cells - 1.0).abs() < 1e-4);
    /// let hann = AxisAccuracy::new(&coefficients(Window::Hann, 256)?, 256);
    /// assert!(fit_cells(&hann) > bound_cells && hann.std_cells(snr) > fit_cells(&hann));
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn new(window: &[f64], bins: usize) -> AxisAccuracy {
        let count = window.len() as f64;
        let sum: f64 = window.iter().sum();
        let centre = window.iter().enumerate().map(|(n, w)| w * n as f64).sum::<f64>() / sum;
        let moment = |power: i32| -> f64 {
            window.iter().enumerate().map(|(n, w)| w.powi(power) * (n as f64 - centre).powi(2)).sum()
        };
        let energy: f64 = window.iter().map(|w| w * w).sum();
        if bins < 2 || count < 2.0 || sum <= 0.0 {
            let (fit, peak, bias) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
            return AxisAccuracy { fit, peak, bias, response: None, late: 0.0 };
        }
        let fit = bins as f64 / TAU * (moment(2) * sum * sum / energy).sqrt() / moment(1);
        let length = bins as f64;
        let transform = |taper: &dyn Fn(f64) -> f64, cells: f64| -> Complex64 {
            window
                .iter()
                .enumerate()
                .map(|(n, w)| taper(*w) * Complex64::cis(TAU * cells * (n as f64 - centre) / length))
                .sum()
        };
        // Covariance of the noise of two cells, over that of one.
        let noise = [0.0, 1.0, 2.0].map(|cells| transform(&|w| w * w, cells) / energy);
        let cells: Vec<(f64, [Complex64; 3])> = (0..OFFSETS)
            .map(|i| (i as f64 + 0.5) / OFFSETS as f64 - 0.5)
            .map(|offset| (offset, [-1.0, 0.0, 1.0].map(|cell| transform(&|w| w, offset - cell))))
            .collect();
        // Variance times 2 SNR, and the square of the offset's own error.
        let placed = |response: Option<&Interpolator>| -> (f64, f64) {
            let (mut variance, mut squared) = (0.0, 0.0);
            for (offset, x) in &cells {
                let offset = *offset;
                let [before, at, after] = x.map(|z| z.norm_sqr());
                let found =
                    response.map_or_else(|| parabola(before, at, after).0, |r| r.peak(before, at, after).0);
                squared += (found - offset).powi(2);
                // d(offset)/d ln P of each cell; the logarithm of a cell moves by 2 Re(e/X).
                let turn = response.map_or(1.0, |r| r.slope(offset));
                let (a, c) = ((before / at).ln(), (after / at).ln());
                let bend = (a + c) * (a + c) / turn;
                let slope = [c / bend, (a - c) / bend, -a / bend];
                let weight: [Complex64; 3] = [0, 1, 2].map(|k| 2.0 * slope[k] / x[k]);
                // With circular noise, var Re(Σ g e) = ½ Σ g g* E[e e*]; SNR is that of the middle cell.
                for k in 0..3usize {
                    for l in 0..3 {
                        let e = noise[k.abs_diff(l)];
                        let e = if k > l { e.conj() } else { e };
                        variance += (weight[k] * weight[l].conj() * e).re * at;
                    }
                }
            }
            (variance / OFFSETS as f64, squared / OFFSETS as f64)
        };
        let plain = placed(None);
        // Cells beside a tone may be empty, as those of a rectangle without padding: noise there moves the place much.
        let ((variance, squared), response) = match Interpolator::new(window, bins) {
            Ok(r) => match placed(Some(&r)) {
                by if by.0 <= 4.0 * plain.0 => (by, Some(r)),
                _ => (plain, Some(r.of_heights())),
            },
            Err(_) => (plain, None),
        };
        AxisAccuracy {
            fit,
            peak: variance.sqrt(),
            bias: squared.sqrt(),
            response,
            late: centre - 0.5 * (count - 1.0),
        }
    }

    /// Standard deviation of a peak's place in cells (eq. 116): noise and interpolation, taken as
    /// independent. `snr`: power ratio in the cell, times the number of channels whose power is
    /// averaged. To first order in the noise: from about 13 dB on.
    pub fn std_cells(&self, snr: f64) -> f64 {
        (self.peak / (2.0 * snr).sqrt()).hypot(self.bias)
    }
}

/// What an unknown (infinite) deviation does through a factor: nothing through none.
fn times(factor: f64, std: f64) -> f64 {
    if factor == 0.0 { 0.0 } else { factor * std }
}

/// A channel of the array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// p_tx + p_rx, sensor frame.
    pub position_m: DVec3,
    /// Beamformer's weight, any scale.
    pub weight: f64,
    /// Transmitter's turn, from 0.
    pub slot: usize,
}

/// All that the standard deviations of a radar's points depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct PointAccuracy {
    /// Accuracy along range.
    pub range: AxisAccuracy,
    /// Accuracy along Doppler.
    pub doppler: AxisAccuracy,
    /// Width of a range bin, m.
    pub range_bin_m: f64,
    /// Width of a Doppler bin, m/s.
    pub velocity_bin_mps: f64,
    /// f_c/S + t̄, s: what range takes from range rate (eq. 15).
    pub coupling_s: f64,
    /// Virtual elements of the array.
    pub elements: Vec<Element>,
    /// Wavenumber 2π/λ, rad/m.
    pub wavenumber: f64,
    /// Time from one transmitter's chirp to the next one's.
    pub chirp_period_s: f64,
    /// Steps of the beamformer's grid in sines of azimuth and elevation; 0 for an axis of one beam.
    pub sine_step: [f64; 2],
    /// What the parabola over beams is off without noise, in sines: [`beam_floor`].
    pub sine_floor: [f64; 2],
    /// Middle of the array, from which ranges and directions are measured: the mean of (p_tx + p_rx)/2, m.
    pub centre_m: DVec3,
    /// Directions that the array confuses.
    pub angle_lobes: AngleLobes,
}

/// Standard deviations of one point. Angles are None where the array cannot tell them.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct PointStd {
    /// Standard deviation of the range, m.
    pub range_m: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_mps: f64,
    /// Standard deviation of the azimuth, rad.
    pub azimuth_rad: Option<f64>,
    /// Standard deviation of the elevation, rad.
    pub elevation_rad: Option<f64>,
}

impl PointAccuracy {
    /// Standard deviations at an SNR in one channel's cell (power ratio, `Point::snr_db`) and a
    /// direction. They hold for one body that is alone in its cell.
    pub fn std(&self, snr: f64, azimuth_rad: f64, elevation_rad: f64) -> PointStd {
        let averaged = snr * self.elements.len() as f64;
        let range_rate_mps = self.doppler.std_cells(averaged) * self.velocity_bin_mps;
        let [azimuth_rad, elevation_rad] = self.angle_std(snr, range_rate_mps, azimuth_rad, elevation_rad);
        PointStd {
            range_m: (self.range.std_cells(averaged) * self.range_bin_m)
                .hypot(times(self.coupling_s, range_rate_mps)),
            range_rate_mps,
            azimuth_rad,
            elevation_rad,
        }
    }

    /// Eq. 117. With g the change of a channel's phase with (azimuth, elevation) less its weighted mean:
    /// G = Σ w g gᵀ, covariance G⁻¹ (Σ w² g gᵀ) G⁻¹/(2 SNR), and (G⁻¹ Σ w g φ)² for the phases φ
    /// that an error of range rate leaves between transmitters, and the squares of what the grid of
    /// beams costs.
    fn angle_std(&self, snr: f64, rate_std: f64, azimuth: f64, elevation: f64) -> [Option<f64>; 2] {
        let (sa, ca) = azimuth.sin_cos();
        let (se, ce) = elevation.sin_cos();
        let by_azimuth = DVec3::new(-ce * sa, ce * ca, 0.0);
        let by_elevation = DVec3::new(-se * ca, -se * sa, ce);
        let slope = |e: &Element| {
            self.wavenumber * DVec2::new(by_azimuth.dot(e.position_m), by_elevation.dot(e.position_m))
        };
        let total: f64 = self.elements.iter().map(|e| e.weight).sum();
        let mean: DVec2 = self.elements.iter().map(|e| e.weight * slope(e)).sum::<DVec2>() / total;
        // (G, noise, turn): their entries aa, ae, ee and the two of the vector.
        let (mut g, mut n, mut turn) = ([0.0; 3], [0.0; 3], DVec2::ZERO);
        for e in &self.elements {
            let d = slope(e) - mean;
            for (i, product) in [d.x * d.x, d.x * d.y, d.y * d.y].into_iter().enumerate() {
                g[i] += e.weight * product;
                n[i] += e.weight * e.weight * product;
            }
            let phase = times(2.0 * self.wavenumber * self.chirp_period_s * e.slot as f64, rate_std);
            turn += e.weight * d * phase;
        }
        // Rows of G⁻¹ for the angles that the array can tell: a thousandth of a turn over the array.
        let told = |x: f64| x > total * 4e-5;
        let determinant = g[0] * g[2] - g[1] * g[1];
        let rows = if told(g[0]) && told(g[2]) && determinant > 1e-6 * g[0] * g[2] {
            let i = 1.0 / determinant;
            [Some(DVec2::new(g[2] * i, -g[1] * i)), Some(DVec2::new(-g[1] * i, g[0] * i))]
        } else if g[0] >= g[2] {
            [told(g[0]).then(|| DVec2::new(1.0 / g[0], 0.0)), None]
        } else {
            [None, told(g[2]).then(|| DVec2::new(0.0, 1.0 / g[2]))]
        };
        // Each angle is looked for with the other left on the grid, off by up to half a step: where
        // G couples them, that moves it.
        let coupled = |own: f64, step: f64| if told(own) { g[1] / own * step / 12f64.sqrt() } else { 0.0 };
        let floor = [
            (self.sine_floor[0] / (ca * ce)).hypot(coupled(g[0], self.sine_step[1] / ce)),
            (self.sine_floor[1] / ce).hypot(coupled(g[2], self.sine_step[0] / ca)),
        ];
        [0, 1].map(|i| {
            rows[i].map(|r| {
                let noise = (r.x * r.x * n[0] + 2.0 * r.x * r.y * n[1] + r.y * r.y * n[2]) / (2.0 * snr);
                (noise + r.dot(turn).powi(2)).sqrt().hypot(floor[i])
            })
        })
    }
}

/// What a parabola through the logarithm of three beams, `step` apart in sine along y or z (`axis` 1 or
/// 2), is off without noise: root mean square over offsets, in sines. 0 for one beam (`step` not
/// positive).
pub fn beam_floor(elements: &[Element], wavenumber: f64, axis: usize, step: f64) -> f64 {
    if step.is_nan() || step <= 0.0 {
        return 0.0;
    }
    let power = |sine: f64| {
        let y: Complex64 =
            elements.iter().map(|e| e.weight * Complex64::cis(wavenumber * sine * e.position_m[axis])).sum();
        y.norm_sqr()
    };
    let mut squared = 0.0;
    for i in 0..OFFSETS {
        let offset = (i as f64 + 0.5) / OFFSETS as f64 - 0.5;
        let [before, at, after] = [-1.0, 0.0, 1.0].map(|cell| power((cell - offset) * step));
        let (a, c) = ((before / at).ln(), (after / at).ln());
        let found = if a + c < 0.0 { (0.5 * (a - c) / (a + c)).clamp(-0.5, 0.5) } else { 0.0 };
        squared += (found - offset).powi(2);
    }
    step * (squared / OFFSETS as f64).sqrt()
}

/// The bound of Cramér and Rao on the frequency of one tone in cells of a transform as long as the
/// data: √6/(2π) √(N²/(N² − 1)) / √SNR, SNR in the cell (eq. 115).
pub fn tone_bound_cells(samples: usize, snr: f64) -> f64 {
    let n = samples as f64;
    (6.0 / snr).sqrt() / TAU / (1.0 - 1.0 / (n * n)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::window::coefficients;
    use crate::scene::radar::Window;

    #[test]
    fn a_rectangle_reaches_the_bound() {
        for n in [2usize, 16, 257] {
            let axis = AxisAccuracy::new(&vec![0.3; n], n);
            let got = axis.fit / (2.0 * 50.0f64).sqrt();
            assert!((got / tone_bound_cells(n, 50.0) - 1.0).abs() < 1e-12, "{n}");
        }
        // Long Hann windows: the sums are integrals over −½..½, ∫w = 1/2, ∫w² = 3/8 and those below.
        let hann = AxisAccuracy::new(&coefficients(Window::Hann, 4096).unwrap(), 4096);
        let (w2, w4) = moments();
        let expected = (w4 * 0.25 / 0.375f64).sqrt() / w2 / TAU;
        assert!((hann.fit / expected - 1.0).abs() < 1e-3, "{} {expected}", hann.fit);
    }

    /// ∫x²w and ∫x²w² of Hann over −½..½.
    fn moments() -> (f64, f64) {
        let p2 = std::f64::consts::PI.powi(2);
        (1.0 / 24.0 - 1.0 / (4.0 * p2), 1.0 / 32.0 - 15.0 / (64.0 * p2))
    }

    #[test]
    fn three_cells_are_never_better_than_the_fit_by_much() {
        for window in [
            Window::Rectangle,
            Window::Hann,
            Window::Hamming,
            Window::Blackman,
            Window::DolphChebyshev { side_lobe_db: 60.0 },
        ] {
            let w = coefficients(window, 128).unwrap();
            for bins in [128, 256, 512] {
                let a = AxisAccuracy::new(&w, bins);
                println!("{window:?} {bins}: fit {:.4} peak {:.4} bias {:.1e}", a.fit, a.peak, a.bias);
                assert!(a.peak.is_finite() && a.peak > 0.9 * a.fit, "{window:?} {bins}");
                let by_parabola = window == Window::Rectangle && bins == 128;
                assert!(a.bias < if by_parabola { 0.13 } else { 1e-3 }, "{window:?} {bins}: {}", a.bias);
            }
        }
        assert!(AxisAccuracy::new(&[1.0], 1).std_cells(100.0).is_infinite());
    }

    fn accuracy(elements: Vec<Element>) -> PointAccuracy {
        let w = coefficients(Window::Hann, 64).unwrap();
        let axis = AxisAccuracy::new(&w, 64);
        PointAccuracy {
            range: axis.clone(),
            doppler: axis,
            range_bin_m: 0.15,
            velocity_bin_mps: 0.1,
            coupling_s: 3e-3,
            elements,
            wavenumber: TAU / 3.9e-3,
            chirp_period_s: 50e-6,
            sine_step: [0.0; 2],
            sine_floor: [0.0; 2],
            centre_m: DVec3::ZERO,
            angle_lobes: AngleLobes { lobes: vec![], fov_rad: [0.0; 2], noise_share: 1.0 },
        }
    }

    fn row(n: usize, along: DVec3) -> Vec<Element> {
        (0..n).map(|i| Element { position_m: along * (i as f64), weight: 1.0, slot: 0 }).collect()
    }

    #[test]
    fn a_uniform_row_has_the_textbook_bound() {
        // var(sin) = 6/(SNR N (N² − 1) (kd)²), SNR of one channel (Van Trees 2002, eq. 8.109 for one source).
        let (n, d, snr) = (8usize, 1.95e-3, 30.0);
        let a = accuracy(row(n, DVec3::Y * d));
        for azimuth in [0.0, 0.6, -1.0] {
            let s = a.std(snr, azimuth, 0.0);
            let m = n as f64;
            let sine = (6.0 / (snr * m * (m * m - 1.0))).sqrt() / (a.wavenumber * d);
            let expected = sine / azimuth.cos();
            assert!((s.azimuth_rad.unwrap() / expected - 1.0).abs() < 1e-12);
            assert_eq!(s.elevation_rad, None);
        }
        let upright = accuracy(row(n, DVec3::Z * d)).std(snr, 0.0, 0.0);
        assert!(upright.azimuth_rad.is_none() && upright.elevation_rad.is_some());
        // A slanted row tells one angle, a cross both.
        let slanted = accuracy(row(n, (DVec3::Y + DVec3::Z) * d)).std(snr, 0.0, 0.0);
        assert!(slanted.azimuth_rad.is_some() != slanted.elevation_rad.is_some());
        let mut cross = row(n, DVec3::Y * d);
        cross.extend(row(n, DVec3::Z * d));
        let cross = accuracy(cross).std(snr, 0.2, 0.1);
        assert!(cross.azimuth_rad.is_some() && cross.elevation_rad.is_some());
        let lone = accuracy(row(1, DVec3::Y)).std(snr, 0.0, 0.0);
        assert_eq!((lone.azimuth_rad, lone.elevation_rad), (None, None));
    }

    #[test]
    fn range_takes_its_share_of_the_rate() {
        let mut a = accuracy(row(4, DVec3::Y * 2e-3));
        a.coupling_s = 0.0;
        let plain = a.std(1e3, 0.0, 0.0);
        a.coupling_s = 10.0;
        let coupled = a.std(1e3, 0.0, 0.0);
        assert!((coupled.range_m - plain.range_m.hypot(10.0 * plain.range_rate_mps)).abs() < 1e-12);
        // Transmitters in turn: the error of rate turns their phases.
        let still = plain.azimuth_rad.unwrap();
        a.elements.iter_mut().enumerate().for_each(|(i, e)| e.slot = i);
        assert!(a.std(1e3, 0.0, 0.0).azimuth_rad.unwrap() > still);
    }
}
