//! What the air between does to echoes: attenuation along their paths (CONVENTIONS eq. 151, 152).

use super::echo::Echo;
use crate::base::error::{BadInput, Result};
use crate::em::weather::{
    FOG_HZ, RAIN_HZ, RainBackscatter, fog_attenuation_db_per_m, rain_attenuation_db_per_m,
};
use crate::scene::weather::Weather;
use glam::DVec3;

/// The air at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Loss of V and H on one way, dB/m.
    pub loss_db_per_m: [f64; 2],
    /// Scattering by rain; None in dry air.
    pub rain: Option<Rain>,
}

/// Number of classes of fall velocity, which scatter back alike.
pub const FALLS: usize = 64;

/// What drops scatter back, and how they move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rain {
    /// Cross section of a volume, 1/m (m² for each m³).
    pub eta_per_m: f64,
    /// Fall velocities downwards, m/s; each stands for an equal share of `eta_per_m`.
    pub fall_mps: [f64; FALLS],
    /// Velocity of the wind in the world, m/s.
    pub wind_mps: DVec3,
}

impl Air {
    /// Computes the air's loss and rain at a frequency; None in dry air.
    ///
    /// # Errors
    /// Returns an error if the formulas do not hold at that frequency.
    pub fn of(weather: &Weather, freq_hz: f64) -> Result<Option<Air>> {
        if weather.is_dry_air() {
            return Ok(None);
        }
        let (lo, hi) = (RAIN_HZ.0.max(FOG_HZ.0), RAIN_HZ.1.min(FOG_HZ.1));
        if !(lo..=hi).contains(&freq_hz) {
            return Err(BadInput::new("weather cannot be computed at this radar's frequency")
                .key("weather")
                .value(format!("{:.4} GHz", freq_hz / 1e9))
                .allowed(format!("{:.0}..{:.0} GHz", lo / 1e9, hi / 1e9))
                .remedy("remove the table")
                .into());
        }
        let rain = match weather.rain_mm_per_h {
            0.0 => [0.0; 2],
            rate => rain_attenuation_db_per_m(freq_hz, rate),
        };
        let fog = fog_attenuation_db_per_m(freq_hz, weather.temperature_c, weather.liquid_g_per_m3);
        let drops = match weather.rain_mm_per_h {
            0.0 => None,
            rate => {
                let back = RainBackscatter::of(freq_hz, weather.temperature_c, rate)?;
                let fall = |i: usize| back.fall_quantile_mps((i as f64 + 0.5) / FALLS as f64);
                let fall_mps = std::array::from_fn(fall);
                Some(Rain { eta_per_m: back.eta_per_m, fall_mps, wind_mps: weather.wind_mps })
            }
        };
        Ok(Some(Air { loss_db_per_m: rain.map(|r| r + fog), rain: drops }))
    }

    /// Multiplies each echo by the loss that the air has on its path, half of it for the polarisation that was sent and
    /// half for the one received.
    pub fn attenuate(&self, echoes: &mut [Echo]) {
        let [v, h] = self.loss_db_per_m;
        for r in echoes {
            let amplitude = |db_per_m: f64| 10f64.powf(-db_per_m * r.path_length_m / 20.0);
            let (vv, hh, mixed) = (amplitude(v), amplitude(h), amplitude(0.5 * (v + h)));
            for (rx, row) in r.path_gain.iter_mut().enumerate() {
                for (tx, z) in row.iter_mut().enumerate() {
                    *z *= if rx != tx {
                        mixed
                    } else if rx == 0 {
                        vv
                    } else {
                        hh
                    };
                }
            }
        }
    }
}
