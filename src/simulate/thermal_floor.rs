//! What thermal noise leaves in a cell of the range-Doppler map.

use crate::adc::noise::Noise;
use crate::dsp::window::coefficients;
use crate::scene::radar::Radar;

/// Mean thermal noise in a cell of the map, W: windows widen the noise bandwidth. None without thermal noise.
pub fn thermal_floor_w(radar: &Radar) -> Option<f64> {
    let noise = Noise::thermal(radar, 0, 0)?;
    let spread = |w, n: usize| -> Option<f64> {
        let c = coefficients(w, n).ok()?;
        let sum: f64 = c.iter().sum();
        Some(c.iter().map(|x| x * x).sum::<f64>() / (sum * sum))
    };
    let p = &radar.processing;
    // A real sample has half the variance of a complex one, and its spectrum is doubled.
    Some(
        2.0 * noise.sigma
            * noise.sigma
            * spread(p.range_window, radar.samples)?
            * spread(p.doppler_window, radar.chirps)?,
    )
}
