//! How far a receiver hears: what lies farther need not be traced.

use crate::adc::synthesis::passes_filter;
use crate::base::units::C0;
use crate::geom::Geometry;
use crate::scene::radar::Radar;
use crate::scene::waveform::Waveform;
use glam::DVec3;

/// Range from which an echo can still pass the receiver, m: half the length of the longest path, when no path changes
/// its length faster than `path_rate_mps`. It is infinite for codes and single tones, which are received whatever their
/// delay. Of several ramps the one that hears farthest counts.
///
/// A path over a place p is at least 2 |p - radar| long, so that nothing farther than this takes part in an echo that is received, nor
/// stands in the way of one.
pub fn reach_m(radar: &Radar, path_rate_mps: f64) -> f64 {
    let of_part = |i: usize| longest_path_m(&radar.part(i), path_rate_mps);
    0.5 * (0..radar.waveform.parts()).map(of_part).fold(0.0, f64::max)
}

/// Bound on the rate of the length of any path of so many bounces, m/s: twice what it would be if the radar and the
/// fastest places of the scene all moved along it.
pub fn fastest_path_mps(geometry: &Geometry, radar_mps: DVec3, bounces: usize) -> f64 {
    let moves = |b: &crate::geom::Body| b.velocity_mps != DVec3::ZERO || b.spin_rad_per_s != DVec3::ZERO;
    let moving: Vec<bool> = geometry.bodies.iter().map(moves).collect();
    // Faces have the corners of all triangles, which are made only where rays are cast.
    let faces = geometry.faces();
    let fastest = faces
        .faces
        .iter()
        .filter(|f| moving[f.body as usize])
        .flat_map(|f| {
            faces.corners(f).iter().map(|p| geometry.bodies[f.body as usize].velocity_at(*p).length())
        })
        .fold(0.0, f64::max);
    // The way back over the first plane is a bounce on top.
    2.0 * (2.0 * radar_mps.length() + 2.0 * (bounces + 1) as f64 * fastest)
}

/// As [`reach_m`], of one ramp and there and back.
fn longest_path_m(radar: &Radar, path_rate_mps: f64) -> f64 {
    match &radar.waveform {
        Waveform::Fmcw(_) => {
            // The beat is f rate / c - slope length / c, both stretched by the motion, which here takes all it can.
            let lines = radar.lines();
            let middle_hz = lines.first_hz + 0.5 * (lines.count as f64 - 1.0) * lines.step_hz;
            let doppler_hz = middle_hz.abs() * path_rate_mps / (C0 - 0.5 * path_rate_mps);
            let walk = 1.0 - path_rate_mps / (C0 - 0.5 * path_rate_mps);
            let beat_hz_per_m = radar.slope_hz_per_s().abs() * walk / (C0 + 0.5 * path_rate_mps);
            let longest = (highest_beat_hz(radar) + doppler_hz) / beat_hz_per_m * (1.0 + 1e-9);
            if beat_hz_per_m > 0.0 && longest.is_finite() { longest } else { f64::INFINITY }
        }
        Waveform::Pulse { shape, .. } => {
            let (before, _) = shape.extent_s();
            let end_s = radar.adc_start_s + radar.samples as f64 / radar.sample_rate_hz;
            C0 * (end_s + before) + 0.5 * path_rate_mps * radar.frame_time_s()
        }
        Waveform::Stepped { .. } | Waveform::Coded { .. } => f64::INFINITY,
    }
}

/// Beat frequency of either sign above which the receiver hears nothing.
fn highest_beat_hz(radar: &Radar) -> f64 {
    // A high-pass only takes from low beats; without it there is one edge on each side.
    let mut radar = radar.clone();
    radar.front_end.filters.high_pass = None;
    let received = |beat_hz: f64| passes_filter(&radar, beat_hz) || passes_filter(&radar, -beat_hz);
    let (mut low, mut high) = (0.0, radar.sample_rate_hz);
    while received(high) {
        (low, high) = (high, 2.0 * high);
        if high > radar.carrier_hz {
            return f64::INFINITY;
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if received(middle) { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::synthesis::{passes, point_echo};
    use crate::scene::front_end::Butterworth;
    use crate::scene::radar::Sampling;
    use crate::scene::radar_toml::preset;

    /// The farthest echo that passes, of all range rates up to the bound, is just within the reach.
    fn check(radar: &Radar, path_rate_mps: f64) {
        let reach = reach_m(radar, path_rate_mps);
        let passes = |range_m: f64, share: f64| {
            let rate = DVec3::X * (0.5 * path_rate_mps * share);
            passes(radar, &point_echo(DVec3::X * range_m, rate, 1.0, 1))
        };
        let shares = || (-20..=20).map(|s| f64::from(s) / 20.0);
        assert!(shares().any(|s| passes(reach * (1.0 - 1e-3), s)), "{} hears {reach} m", radar.name);
        for i in 1..=1000 {
            let range = reach * (1.0 + 1e-6 * f64::from(i * i));
            assert!(shares().all(|s| !passes(range, s)), "{} hears {range} m, not {reach}", radar.name);
        }
    }

    #[test]
    fn nothing_is_heard_from_beyond_the_reach() {
        let mut radar = preset("front77").unwrap();
        let ideal = reach_m(&radar, 0.0);
        // f_s c / (2 slope)
        assert!((ideal / (12.8e6 * C0 / 2.0 / 25e12) - 1.0).abs() < 1e-8, "{ideal}");
        for rate in [0.0, 100.0, 1e4] {
            check(&radar, rate);
        }
        radar.sampling = Sampling::Real;
        assert!((reach_m(&radar, 0.0) / ideal - 0.5).abs() < 1e-8);
        check(&radar, 200.0);
        let filter = |order, corner_hz| Some(Butterworth { order, corner_hz });
        (radar.front_end.filters.low_pass, radar.front_end.filters.high_pass) =
            (filter(5, 6e6), filter(2, 1e5));
        check(&radar, 200.0);
        assert!(reach_m(&radar, 0.0) > 2.0 * ideal);
        if let Waveform::Fmcw(s) = &mut radar.waveform {
            s.ramps.iter_mut().for_each(|r| r.bandwidth_hz = -r.bandwidth_hz);
        }
        check(&radar, 200.0);
        check(&preset("uwb9").unwrap(), 200.0);
    }

    #[test]
    fn the_ramp_that_hears_farthest_counts_and_codes_are_always_heard() {
        let mut radar = preset("front77").unwrap();
        let one = reach_m(&radar, 50.0);
        if let Waveform::Fmcw(s) = &mut radar.waveform {
            let mut slow = s.ramps[0];
            slow.bandwidth_hz *= 0.5;
            s.ramps.push(slow);
        }
        assert!(reach_m(&radar, 50.0) > 1.9 * one);
        radar.waveform = Waveform::Coded { code: vec![1, -1, 1], chip_rate_hz: 1e9, period_s: 1e-6 };
        assert_eq!(reach_m(&radar, 50.0), f64::INFINITY);
    }
}
