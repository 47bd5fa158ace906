//! Scales of the keystone transform (CONVENTIONS eq. 89).

use crate::scene::radar::Radar;

/// Instantaneous frequency of each sample over the carrier: (f_0 + S t_n)/f_c. A chirp whose samples are
/// taken in falling order has these in falling order, too.
pub fn scale(radar: &Radar) -> Vec<f64> {
    (0..radar.samples)
        .map(|n| {
            let t = radar.adc_start_s + n as f64 / radar.sample_rate_hz;
            (radar.start_hz() + radar.slope_hz_per_s() * t) / radar.carrier_hz
        })
        .collect()
}
