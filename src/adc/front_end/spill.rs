//! What goes from transmitter to receiver without an object: leakage inside the radar, and the cover before
//! it (CONVENTIONS eq. 107). Both stand still against the radar and are the same in every ramp.

use super::timing::Timing;
use crate::adc::synthesis::power_gain;
use crate::base::units::{C0, power_from_db, w_from_dbm};
use crate::scene::front_end::FrontEndSettings;
use crate::scene::radar::Radar;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// A path by which a transmitter's wave spills into the receivers.
#[derive(Debug, Clone, PartialEq)]
pub struct Spill {
    /// For each channel the amplitude a of eq. 9 without its e^{−jkL}, √W, and the delay, s.
    pub channels: Vec<(Complex64, f64)>,
}

impl Spill {
    /// Phasor conj(a₀) e^{jφ} of eq. 12 at `ramp_time_s` after the ramp's start, √W.
    pub fn tone(&self, timing: &Timing, channel: usize, ramp_time_s: f64) -> Complex64 {
        let (a, tau) = self.channels[channel];
        let s = timing.slope_hz_per_s;
        let turns = timing.start_hz * tau + s * tau * (ramp_time_s - 0.5 * tau);
        a.conj() * Complex64::cis(TAU * (turns - turns.round()))
    }
}

/// The paths of a radar with this front end.
pub fn spills(radar: &Radar, settings: &FrontEndSettings) -> Vec<Spill> {
    let power = w_from_dbm(radar.tx_power_dbm);
    let mut out = Vec::new();
    if let Some(l) = &settings.leakage {
        let a = (power * power_from_db(-l.isolation_db)).sqrt();
        out.push(Spill { channels: vec![(Complex64::from(a), l.delay_s); radar.channels()] });
    }
    if let Some(b) = &settings.bumper {
        // The fields turn round, as on a conductor (eq. 4).
        let r = -power_from_db(b.reflection_db).sqrt();
        let scale = power.sqrt() * radar.wavelength_m() / (4.0 * PI);
        let mut channels = Vec::with_capacity(radar.channels());
        for tx in &radar.tx {
            for rx in &radar.rx {
                // From the transmitter to the receiver's image in the cover.
                let image =
                    DVec3::new(2.0 * b.distance_m - rx.position_m.x, rx.position_m.y, rx.position_m.z);
                let way = image - tx.position_m;
                let length = way.length();
                let out = way / length;
                // It comes back to the receiver from the mirrored direction.
                let back = DVec3::new(out.x, -out.y, -out.z);
                let gain = (power_gain(tx, out) * power_gain(rx, back)).sqrt();
                let (t, s) = (&tx.polarisation, &rx.polarisation);
                let a = scale * gain * r / length * (s.v * t.v + s.h * t.h);
                channels.push((a, length / C0));
            }
        }
        out.push(Spill { channels });
    }
    out
}
