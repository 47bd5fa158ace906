//! Other FMCW radars as the victim's antennas receive them (CONVENTIONS eq. 112).
//!
//! The sender's frequency is f_i + S_i u, u since its ramp's start; the victim mixes it with f₀ + St.
//! With equal slopes the difference is constant: a ghost. With others it crosses the band within
//! B/|S − S_i|, B the band's width: a burst in which the frequency runs through the band, which the range transform
//! spreads over all cells.

use super::synthesis::power_gain;
use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Sensor, World, polarisation_basis};
use crate::base::units::{C0, w_from_dbm};
use crate::scene::interferer::Interferer;
use crate::scene::radar::{Antenna, Radar};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Antennas of two radars are at least so far apart.
const NEAREST_M: f64 = 1e-3;

/// A wave that arrives at the victim from an interferer by one way.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Ways of one interferer share it, and with it their draws.
    pub interferer: u32,
    /// Frequency at the start of its ramp, Hz.
    pub start_hz: f64,
    /// Slope of its ramp, Hz/s.
    pub slope_hz_per_s: f64,
    /// Length of its ramp, s.
    pub ramp_time_s: f64,
    /// Time from ramp to ramp, s.
    pub period_s: f64,
    /// Start of its first ramp against the victim's; None where it is drawn anew for each frame.
    pub start_s: Option<f64>,
    /// Whether its oscillator runs through from ramp to ramp.
    pub coherent: bool,
    /// For each receiver the amplitude in √W, without the phase of the way, and the length of the way in m. The length
    /// is that of the wave received in the middle of the frame.
    pub receivers: Vec<(Complex64, f64)>,
    /// Rate of change of that length by the time of reception, m/s.
    pub path_rate_mps: f64,
}

/// Place and motion of the victim in the middle of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadarState {
    /// Pose of the victim in the world.
    pub pose: Pose<Sensor, World>,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
}

/// The interferer's wave on the straight way: power P_t G_t G_r λ²/(4πR)², times |p_r·p_t|². `place` is that of the
/// interferer.
///
/// # Errors
/// Returns an error if the interferer stands where a receiver stands.
pub fn direct(
    sender: &Interferer,
    number: u32,
    place: RadarState,
    radar: &Radar,
    at: RadarState,
) -> Result<Arrival> {
    let from = place.pose.translation_m;
    let nearest = std::iter::once(at.pose.translation_m)
        .chain(radar.rx.iter().map(|rx| at.pose.point(rx.position_m)))
        .map(|p| p.distance(from))
        .fold(f64::INFINITY, f64::min);
    if nearest < NEAREST_M {
        return Err(BadInput::new(format!("'{}' is at the position of '{}'", sender.name, radar.name))
            .key("interferer")
            .value(format!("{nearest:.2e} m apart"))
            .allowed(format!("at least {NEAREST_M} m"))
            .remedy("move one of the two (radars.mounting, interferer.position_m)")
            .into());
    }
    let scale = w_from_dbm(sender.power_dbm).sqrt() * radar.wavelength_m() / (4.0 * PI);
    let receivers = radar.rx.iter().map(|rx| {
        let way = at.pose.point(rx.position_m) - from;
        let length = way.length();
        let u = way / length;
        let sent = field(&sender.antenna, &place.pose, u);
        let got = field(rx, &at.pose, -u);
        (scale / length * sent.dot(&got), length)
    });
    let u = (at.pose.translation_m - from).normalize();
    Ok(arrival(sender, number, receivers.collect(), (at.velocity_mps - place.velocity_mps).dot(u)))
}

/// The interferer's wave by way of a body at `body_m` with the velocity `body_mps` that scatters σ into all directions
/// and keeps V and H as an isotropic point target does: power P_t G_t G_r λ² σ/((4π)³ R₁² R₂²).
pub fn scattered(
    sender: &Interferer,
    number: u32,
    place: RadarState,
    radar: &Radar,
    at: RadarState,
    body: (DVec3, DVec3, f64),
) -> Arrival {
    let (body_m, body_mps, sigma_m2) = body;
    let out = body_m - place.pose.translation_m;
    let (r1, u1) = (out.length(), out.normalize());
    let scale = w_from_dbm(sender.power_dbm).sqrt() * radar.wavelength_m() / (4.0 * PI)
        * (sigma_m2 / (4.0 * PI)).sqrt();
    let sent = gain(&sender.antenna, &place.pose, u1);
    let receivers = radar.rx.iter().map(|rx| {
        let back = body_m - at.pose.point(rx.position_m);
        let r2 = back.length();
        let got = gain(rx, &at.pose, back / r2);
        let (t, r) = (&sender.antenna.polarisation, &rx.polarisation);
        (scale * sent * got / (r1 * r2) * (r.v * t.v + r.h * t.h), r1 + r2)
    });
    let u2 = (body_m - at.pose.translation_m).normalize();
    let rate = (body_mps - place.velocity_mps).dot(u1) + (body_mps - at.velocity_mps).dot(u2);
    arrival(sender, number, receivers.collect(), rate)
}

fn arrival(s: &Interferer, interferer: u32, receivers: Vec<(Complex64, f64)>, path_rate_mps: f64) -> Arrival {
    Arrival {
        interferer,
        start_hz: s.start_hz,
        slope_hz_per_s: s.slope_hz_per_s,
        ramp_time_s: s.ramp_time_s,
        period_s: s.period_s,
        start_s: s.start_s,
        coherent: s.coherent,
        receivers,
        path_rate_mps,
    }
}

/// √G of an antenna towards the world's direction `u`.
fn gain(antenna: &Antenna, pose: &Pose<Sensor, World>, u: DVec3) -> f64 {
    power_gain(antenna, pose.inverse().direction(u)).sqrt()
}

/// √G times the polarisation in the world's axes, for a wave that leaves towards `u` or comes from there.
fn field(antenna: &Antenna, pose: &Pose<Sensor, World>, u: DVec3) -> Field {
    let local = pose.inverse().direction(u);
    let (v, h) = polarisation_basis(local);
    let (v, h) = (pose.direction(v), pose.direction(h));
    let p = &antenna.polarisation;
    let g = power_gain(antenna, local).sqrt();
    let part = |v: f64, h: f64| g * (p.v * v + p.h * h);
    Field([part(v.x, h.x), part(v.y, h.y), part(v.z, h.z)])
}

struct Field([Complex64; 3]);

impl Field {
    fn dot(&self, o: &Field) -> Complex64 {
        self.0.iter().zip(&o.0).map(|(a, b)| a * b).sum()
    }
}

/// Duration of a burst of interference, s: a band `band_hz` wide over the difference of the slopes.
///
/// # Example
/// A receiver with ±10 MHz of bandwidth sweeps 30 MHz/µs. A sender that falls as steeply crosses its band in a third
/// of a microsecond, one with nearly the same slope stays in it for the whole ramp.
///
/// ```
/// use catseye::adc::interference::burst_s;
///
/// assert!((burst_s(20e6, 30e12, -30e12) - 0.333e-6).abs() < 1e-9);
/// assert!((burst_s(20e6, 30e12, 29e12) - 20e-6).abs() < 1e-12);
/// ```
pub fn burst_s(band_hz: f64, slope_hz_per_s: f64, other_hz_per_s: f64) -> f64 {
    band_hz / (slope_hz_per_s - other_hz_per_s).abs()
}

/// Range at which an interferer of equal slope appears whose ramp is received `late_s` after the victim's starts and
/// begins `higher_hz` above it: R = (c/2)(late − higher/S), m.
///
/// # Example
/// A ramp of the same slope that is received one microsecond after the radar's own starts appears as a body at 150 m.
///
/// ```
/// use catseye::adc::interference::ghost_range_m;
///
/// assert!((ghost_range_m(30e12, 1e-6, 0.0) - 149.9).abs() < 0.1);
/// // A start 3 MHz higher is as good as 0.1 us earlier.
/// assert!((ghost_range_m(30e12, 1e-6, 3e6) - ghost_range_m(30e12, 0.9e-6, 0.0)).abs() < 1e-9);
/// ```
pub fn ghost_range_m(slope_hz_per_s: f64, late_s: f64, higher_hz: f64) -> f64 {
    0.5 * C0 * (late_s - higher_hz / slope_hz_per_s)
}
