//! Physical constants and decibel conversions. SI throughout; radians inside.
//!
//! The radar equation (CONVENTIONS eq. 9) in these units, for a point of 10 dBsm at 50 m, 12 dBm of transmitted power
//! and antennas of 10 dBi:
//!
//! ```
//! use catseye::base::units::{dbm_from_w, power_from_db, w_from_dbm, wavelength_m};
//! use std::f64::consts::PI;
//!
//! let (power_w, gain, rcs_m2, range_m) = (w_from_dbm(12.0), power_from_db(10.0), power_from_db(10.0), 50.0_f64);
//! let lambda_m = wavelength_m(77e9);
//! assert!((lambda_m * 1e3 - 3.893).abs() < 1e-3);
//! let received_w = power_w * (gain * lambda_m).powi(2) * rcs_m2 / ((4.0 * PI).powi(3) * range_m.powi(4));
//! assert!((dbm_from_w(received_w) + 107.13).abs() < 0.01);
//! ```

/// Speed of light in vacuum, m/s (exact, SI).
pub const C0: f64 = 299_792_458.0;
/// Boltzmann constant, J/K (exact, SI).
pub const BOLTZMANN: f64 = 1.380_649e-23;
/// Reference temperature of the noise figure, K (IEEE Std 686).
pub const T0_K: f64 = 290.0;
/// Vacuum permittivity, F/m (CODATA 2018).
pub const EPS0: f64 = 8.854_187_812_8e-12;
/// The frequency that a command assumes when none is given, Hz.
pub const DEFAULT_FREQUENCY_HZ: f64 = 77e9;

/// Free-space wavelength in metres.
pub fn wavelength_m(freq_hz: f64) -> f64 {
    C0 / freq_hz
}

/// Wavenumber 2 pi / lambda in rad/m.
pub fn wavenumber(freq_hz: f64) -> f64 {
    std::f64::consts::TAU * freq_hz / C0
}

/// Power ratio to decibels. Zero gives -inf.
pub fn db_from_power(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Decibels to power ratio.
pub fn power_from_db(db: f64) -> f64 {
    10f64.powf(db / 10.0)
}

/// Watts to dBm.
pub fn dbm_from_w(power_w: f64) -> f64 {
    10.0 * power_w.log10() + 30.0
}

/// dBm to watts.
pub fn w_from_dbm(power_dbm: f64) -> f64 {
    10f64.powf((power_dbm - 30.0) / 10.0)
}

/// Radar cross section in dBsm from a scattering amplitude |S| in metres: sigma = 4 pi |S|^2
/// (CONVENTIONS eq. 3).
///
/// # Example
/// An isotropic scatterer of 1 m² has |S| = 1/√(4π) m, and ten times the amplitude is 20 dB more.
///
/// ```
/// use catseye::base::units::dbsm_from_amplitude;
///
/// let amplitude_m = (4.0 * std::f64::consts::PI).sqrt().recip();
/// assert!(dbsm_from_amplitude(amplitude_m).abs() < 1e-12);
/// assert!((dbsm_from_amplitude(10.0 * amplitude_m) - 20.0).abs() < 1e-12);
/// ```
pub fn dbsm_from_amplitude(s_abs_m: f64) -> f64 {
    db_from_power(4.0 * std::f64::consts::PI * s_abs_m * s_abs_m)
}

/// Level in dB below which a number says only that nothing is left: the rounding of f64 sums.
pub const LEAST_DB: f64 = -200.0;

/// A level in dB for people: `< -200` for what vanishes (-inf too), else with so many decimals.
pub fn level_text(db: f64, decimals: usize) -> String {
    if db < LEAST_DB { format!("< {LEAST_DB:.0}") } else { format!("{db:.decimals$}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vanishing_levels_are_said_in_words() {
        assert_eq!(level_text(-347.2, 3), "< -200");
        assert_eq!(level_text(db_from_power(0.0), 3), "< -200");
        assert_eq!(level_text(-199.96, 1), "-200.0");
        assert_eq!(level_text(-12.3456, 3), "-12.346");
        assert_eq!(level_text(f64::NAN, 1), "NaN");
    }
}
