//! The least radar cross section that a radar detects (Feng 2019, eq. 3.4 and 3.5):
//!
//! sigma_min = sigma_ref - (M_ref(R) - max(M_ground(R), M_noise + SNR)) + Comp,
//!
//! All terms are in decibels. The magnitudes M come from one of two sources, with the same formula:
//!
//! * *measured*: M_ref is a curve over range recorded with a reference reflector (given as points, or as the
//!   fits 20 lg(1/R^q1) + q2 of eq. 3.3 to its multipath peaks and troughs, whose mean is taken as in the
//!   document), M_noise is one number and M_ground a list of points on the same scale;
//!   document does), M_noise one number and M_ground points on the same scale;
//! * *radar equation*: M_ref is the received power of CONVENTIONS eq. (9) in dBm for the reference in free
//!   space, M_noise the thermal noise of eq. (13) in a cell of the range-Doppler map, widened by the windows,
//!   and M_ground the power of a patch of road one range cell deep and as wide as the given beam, with the
//!   given scattering coefficient.
//!
//! Comp is the two-way antenna gain towards the reference minus that towards the marker.

use super::parameter::{Values, number_of};
use super::view::View;
use catseye::base::error::Result;
use catseye::base::units::{BOLTZMANN, T0_K, db_from_power, dbm_from_w};
use catseye::dsp::window;
use catseye::scene::radar::{Radar, Window};
use std::f64::consts::PI;

/// Source of the magnitudes.
#[derive(Debug, Clone, PartialEq)]
pub enum Magnitudes {
    /// Magnitudes from a measured curve.
    Measured {
        /// Magnitude of the reference over range.
        reference: Curve,
        /// Magnitude of the noise, dB.
        noise_db: f64,
        /// Magnitude of the ground as (range in m, dB), ascending in range.
        ground: Option<Vec<[f64; 2]>>,
    },
    /// Magnitudes from the radar equation.
    RadarEquation {
        /// Noise in a cell of the map, dBm.
        noise_dbm: f64,
        /// Clutter of the ground; None where it is not considered.
        ground: Option<GroundClutter>,
    },
}

/// A curve of magnitude over range.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    /// Mean of two fits M = 20 lg(1/R^q1) + q2, each as (q1, q2).
    Fits([[f64; 2]; 2]),
    /// Points (range in m, dB), ascending; linear in lg R in between, constant beyond the ends.
    Points(Vec<[f64; 2]>),
}

impl Curve {
    /// Magnitude at a range, dB.
    pub fn at(&self, range_m: f64) -> f64 {
        match self {
            Curve::Fits(f) => {
                f.iter().map(|[q1, q2]| -20.0 * q1 * range_m.log10() + q2).sum::<f64>() / f.len() as f64
            }
            Curve::Points(p) => interpolated(p, range_m),
        }
    }
}

/// Interpolates linearly in lg R between the points, constant beyond the ends.
fn interpolated(points: &[[f64; 2]], range_m: f64) -> f64 {
    let i = points.partition_point(|p| p[0] <= range_m);
    match (i.checked_sub(1).map(|i| points[i]), points.get(i)) {
        (Some(a), Some(b)) => {
            let t = (range_m / a[0]).ln() / (b[0] / a[0]).ln();
            a[1] + t * (b[1] - a[1])
        }
        (Some(a), None) => a[1],
        (None, Some(b)) => b[1],
        (None, None) => f64::NAN,
    }
}

/// Clutter of a patch of road: cross section per area times range, beam width and cell depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundClutter {
    /// Backscatter per area, dB.
    pub sigma0_db: f64,
    /// Width of the beam, rad.
    pub beam_rad: f64,
    /// Depth of a range cell, m.
    pub cell_m: f64,
}

/// All data for sigma_min.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// The radar whose antennas, and for the radar equation whose power, count.
    pub radar: Radar,
    /// Source of the magnitudes.
    pub magnitudes: Magnitudes,
    /// Radar cross section of the reference, dBsm.
    pub reference_dbsm: f64,
    /// Height of the reference above the radar in the measurement, m.
    pub reference_rise_m: f64,
}

impl Detection {
    /// Least detectable cross section sigma_min, dBsm, for a marker in `view` and the signal-to-noise ratio
    /// `snr_db`.
    pub fn sigma_min_dbsm(&self, view: &View, snr_db: f64) -> f64 {
        let range = view.range_m;
        let reference = (self.reference_rise_m / range).clamp(-1.0, 1.0).asin();
        let towards_reference = self.two_way_gain_db(0.0, reference);
        let towards_marker = self.two_way_gain_db(view.sensor_azimuth, view.sensor_elevation);
        let (magnitude, floor) = match &self.magnitudes {
            Magnitudes::Measured { reference, noise_db, ground } => {
                let ground = ground.as_ref().map_or(f64::NEG_INFINITY, |g| interpolated(g, range));
                (reference.at(range), ground.max(noise_db + snr_db))
            }
            Magnitudes::RadarEquation { noise_dbm, ground } => {
                let received = self.received_dbm(self.reference_dbsm, range) + towards_reference;
                let clutter = ground.map_or(f64::NEG_INFINITY, |g| {
                    let sigma = g.sigma0_db + db_from_power(range * g.beam_rad * g.cell_m);
                    self.received_dbm(sigma, range) + towards_marker
                });
                (received, clutter.max(noise_dbm + snr_db))
            }
        };
        self.reference_dbsm - (magnitude - floor) + towards_reference - towards_marker
    }

    /// Received power by the radar equation without antenna patterns, dBm.
    fn received_dbm(&self, rcs_dbsm: f64, range_m: f64) -> f64 {
        let r = &self.radar;
        let spread = r.wavelength_m().powi(2) / ((4.0 * PI).powi(3) * range_m.powi(4));
        r.tx_power_dbm + r.tx[0].gain_dbi + r.rx[0].gain_dbi + db_from_power(spread) + rcs_dbsm
    }

    /// Two-way gain of transmitter 0 and receiver 0 relative to their peaks, dB.
    fn two_way_gain_db(&self, azimuth: f64, elevation: f64) -> f64 {
        let gain = |a: &catseye::scene::radar::Antenna| a.pattern.power_gain(azimuth, elevation);
        db_from_power(gain(&self.radar.tx[0]) * gain(&self.radar.rx[0]))
    }
}

/// Mean thermal noise in a cell of the range-Doppler map, dBm: k T0 F f_s times the noise bandwidth of the
/// two windows (CONVENTIONS eq. 13, 14; the same for real and complex sampling).
///
/// # Errors
/// Returns an error if a window cannot be made.
pub fn noise_dbm(radar: &Radar) -> Result<f64> {
    let spread = |w: Window, n: usize| -> Result<f64> {
        let c = window::coefficients(w, n)?;
        let sum: f64 = c.iter().sum();
        Ok(c.iter().map(|x| x * x).sum::<f64>() / (sum * sum))
    };
    let p = &radar.processing;
    let factor = spread(p.range_window, radar.samples)? * spread(p.doppler_window, radar.chirps)?;
    Ok(dbm_from_w(BOLTZMANN * T0_K * radar.sample_rate_hz * factor) + radar.noise_figure_db)
}

/// The signal-to-noise ratio of a setting.
pub fn snr_db(values: &Values) -> Option<f64> {
    number_of(values, "snr_db")
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::scene::radar_toml::preset;

    fn on_axis(range_m: f64) -> View {
        View {
            azimuth: 0.0,
            elevation: 0.0,
            range_m,
            foot_azimuth: 0.0,
            foot_elevation: 0.0,
            foot_range_m: range_m,
            height_m: 0.0,
            sensor_azimuth: 0.0,
            sensor_elevation: 0.0,
        }
    }

    #[test]
    fn by_hand_from_the_radar_equation() {
        // A marker on the axis whose power equals noise times the ratio: no reference is left in it.
        let radar = preset("feng77").unwrap();
        let noise = noise_dbm(&radar).unwrap();
        let d = Detection {
            magnitudes: Magnitudes::RadarEquation { noise_dbm: noise, ground: None },
            reference_dbsm: 14.4,
            reference_rise_m: 0.2,
            radar: radar.clone(),
        };
        let lambda = 299_792_458.0 / 78.23e9;
        let least = |r: f64| {
            noise + 10.0 - 12.0 - 24.0 - 10.0 * (lambda * lambda / ((4.0 * PI).powi(3) * r.powi(4))).log10()
        };
        for r in [5.0, 30.0, 60.0] {
            assert!((d.sigma_min_dbsm(&on_axis(r), 10.0) - least(r)).abs() < 1e-9);
        }
        // 7 degrees up: cos^36 once on transmit and once on receive.
        let tilted = View { sensor_elevation: 7f64.to_radians(), ..on_axis(30.0) };
        let loss = -20.0 * 36.0 * 7f64.to_radians().cos().log10();
        assert!((d.sigma_min_dbsm(&tilted, 10.0) - least(30.0) - loss).abs() < 1e-9);
        // Noise: k T0 F f_s over 2048 x 1024 samples is -173.98 + 13 + 77.96 - 63.22 dBm with flat
        // windows. The noise bandwidth of a Dolph-Chebyshev window grows from 1.39 to 1.73 bins between 50 and 80
        // dB (Harris 1978, table 1), some 0.11 for each 10 dB: 2.07 and 2.41 for 111 and 141.5 dB, 7.0 dB.
        let flat = -173.975 + 13.0 + 10.0 * 62.5e6f64.log10() - 10.0 * (2048.0f64 * 1024.0).log10();
        assert!((6.0..8.0).contains(&(noise - flat)), "{noise} {flat}");
        // Ground louder than the noise takes over.
        let clutter = GroundClutter { sigma0_db: -20.0, beam_rad: 0.2, cell_m: 0.1 };
        let loud = Detection {
            magnitudes: Magnitudes::RadarEquation { noise_dbm: noise, ground: Some(clutter) },
            ..d
        };
        let expected = -20.0 + 10.0 * (5.0f64 * 0.2 * 0.1).log10();
        assert!((loud.sigma_min_dbsm(&on_axis(5.0), 10.0) - expected).abs() < 1e-9);
    }

    #[test]
    fn by_hand_from_measured_curves() {
        let mut radar = preset("feng77").unwrap();
        for a in radar.tx.iter_mut().chain(&mut radar.rx) {
            a.pattern = catseye::scene::radar::Pattern::Isotropic;
        }
        let fits = Curve::Fits([[1.62, 14.8], [4.18, 21.06]]);
        // Mean of -20 q1 lg R + q2 at 10 m: (-32.4 + 14.8 - 83.6 + 21.06) / 2.
        assert!((fits.at(10.0) + 40.07).abs() < 1e-9);
        let d = Detection {
            radar,
            magnitudes: Magnitudes::Measured {
                reference: fits,
                noise_db: -107.0,
                ground: Some(vec![[1.0, -50.0], [100.0, -150.0]]),
            },
            reference_dbsm: 14.4,
            reference_rise_m: 0.2,
        };
        // At 10 m the ground is -100 and the floor -97.
        assert!((d.sigma_min_dbsm(&on_axis(10.0), 10.0) - (14.4 - (-40.07 + 97.0))).abs() < 1e-9);
        // At 2 m the ground is louder.
        let ground = -50.0 - 50.0 * 2f64.log10();
        let reference = (-20.0 * (1.62 + 4.18) * 2f64.log10() + 35.86) / 2.0;
        assert!((d.sigma_min_dbsm(&on_axis(2.0), 10.0) - (14.4 - (reference - ground))).abs() < 1e-9);
        assert_eq!(interpolated(&[[1.0, 3.0], [2.0, 5.0]], 0.5), 3.0);
        assert_eq!(interpolated(&[[1.0, 3.0], [2.0, 5.0]], 9.0), 5.0);
    }
}
