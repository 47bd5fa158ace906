//! Scales of the keystone transform (CONVENTIONS eq. 89).

use crate::scene::radar::Radar;

/// Frequency of each line over the carrier, in the order of the samples.
pub fn scale(radar: &Radar) -> Vec<f64> {
    let lines = radar.lines();
    (0..lines.count).map(|n| (lines.first_hz + n as f64 * lines.step_hz) / radar.carrier_hz).collect()
}
