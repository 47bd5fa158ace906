//! Physical constants and decibel conversions. SI throughout; radians inside.

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
