//! What a radar can do, as its data sheet would say: computed from its waveform and its antennas.

use super::grating_lobes::{grating_lobes, unambiguous_half_rad};
use super::radar::Radar;
use super::waveform::{Multiplex, Waveform};
use crate::base::units::{C0, wavenumber};
use glam::DVec3;
use num_complex::Complex64;

/// The figures by which radars are compared. Everything is computed from the radar, so that a preset cannot claim what it is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadarFigures {
    /// Lowest and highest frequency that is sampled, Hz.
    pub band_hz: [f64; 2],
    /// Number of transmitters and of receivers.
    pub antennas: [usize; 2],
    /// Largest unambiguous range, m.
    pub max_range_m: f64,
    /// Range resolution c/2B with the band B that is sampled, m.
    pub range_resolution_m: f64,
    /// Largest |range rate| that looks like no other one, m/s: λ/4T_c where transmitters in turn or empty Doppler bands tell the folds
    /// apart, half of [`common_fold_mps`] but [`FASTEST_MPS`] at most where bursts of one slope do, else that of a row of the map. None for a radar that measures no Doppler shift, and for one whose several slopes tell
    /// range rates without folds.
    pub max_speed_mps: Option<f64>,
    /// Range-rate resolution λ/2T with the length T of a frame, or of a burst of it, m/s. None for a radar that measures no Doppler shift.
    pub speed_resolution_mps: Option<f64>,
    /// Half-power width of the beam at broadside in azimuth and elevation, all channels with the same weight, degrees. None where
    /// the array is too short to tell the angle.
    pub beam_deg: [Option<f64>; 2],
    /// Half the sector about boresight, in azimuth and elevation, in which the array confuses no two directions, degrees: 90 for
    /// elements half a wavelength apart. None where it measures none.
    pub unambiguous_deg: [Option<f64>; 2],
}

impl RadarFigures {
    /// The figures of a radar; those of its first ramp where it has several.
    ///
    /// # Example
    /// ```
    /// use catseye::scene::radar_figures::RadarFigures;
    /// use catseye::scene::radar_toml::preset;
    ///
    /// let figures = RadarFigures::of(&preset("demo77")?);
    /// assert_eq!(figures.antennas, [3, 4]);
    /// assert!((figures.range_resolution_m - 0.40).abs() < 0.01);
    /// // One transmitter after another, 16 us apart: the phases between them resolve range rates up to λ/4T_c.
    /// assert!(figures.max_speed_mps.is_some_and(|v| (v - 60.8).abs() < 0.1));
    /// // Twelve channels half a wavelength apart: a beam of 0.886 λ/L = 8.5°, and no grating lobe.
    /// assert!(figures.beam_deg[0].is_some_and(|width| (width - 8.5).abs() < 0.1));
    /// assert!(figures.unambiguous_deg[0].is_some_and(|half| (half - 90.0).abs() < 0.1));
    /// assert_eq!(figures.beam_deg[1], None);
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn of(radar: &Radar) -> RadarFigures {
        let lines = radar.lines();
        let other_end_hz = lines.first_hz + (lines.count as f64 - 1.0) * lines.step_hz;
        let is_doppler = radar.chirps > 1;
        let quarter_mps = |period_s: f64| 0.25 * radar.sample_wavelength_m() / period_s;
        // Other ramps between the turns leave folds of the loop that the turns do not tell apart.
        let (is_one_ramp, is_one_slope) = match &radar.waveform {
            Waveform::Fmcw(s) => {
                let slope = |i: usize| radar.part(i).slope_hz_per_s();
                (s.ramps.len() == 1, (1..s.ramps.len()).all(|i| slope(i) == slope(0)))
            }
            _ => (true, true),
        };
        let parts: Vec<Radar> = (0..radar.waveform.parts()).map(|i| radar.part(i)).collect();
        let max_speed_mps = match radar.multiplex {
            _ if radar.waveform.is_in_bursts() => FASTEST_MPS.min(0.5 * common_fold_mps(parts.iter())),
            Multiplex::Tdm | Multiplex::Bpm if is_one_ramp => quarter_mps(radar.chirp_period_s()),
            Multiplex::Ddm { bands } if bands > radar.tx.len() => quarter_mps(radar.loop_period_s()),
            _ => radar.max_velocity_mps(),
        };
        let beam_deg = [1, 2].map(|axis| {
            let places: Vec<f64> = radar
                .tx
                .iter()
                .flat_map(|t| radar.rx.iter().map(move |r| (t.position_m + r.position_m)[axis]))
                .collect();
            beam_width(&places, wavenumber(radar.sample_centre_hz())).map(f64::to_degrees)
        });
        let places: Vec<(DVec3, f64)> = radar
            .tx
            .iter()
            .flat_map(|t| radar.rx.iter().map(move |r| (t.position_m + r.position_m, 1.0)))
            .collect();
        let lobes = grating_lobes(&places, wavenumber(radar.sample_centre_hz()));
        let unambiguous_deg =
            [0, 1].map(|axis| beam_deg[axis].map(|_| unambiguous_half_rad(&lobes, axis).to_degrees()));
        RadarFigures {
            band_hz: [lines.first_hz.min(other_end_hz), lines.first_hz.max(other_end_hz)],
            antennas: [radar.tx.len(), radar.rx.len()],
            max_range_m: radar.max_range_m(),
            range_resolution_m: 0.5 * C0 / (lines.count as f64 * lines.step_hz.abs()),
            max_speed_mps: (is_doppler && is_one_slope).then_some(max_speed_mps),
            speed_resolution_mps: is_doppler.then(|| radar.velocity_cell_mps()),
            beam_deg,
            unambiguous_deg,
        }
    }
}

/// Speed along the line of sight that no body is taken to exceed, m/s: two cars that meet at 180 km/h each.
pub const FASTEST_MPS: f64 = 100.0;

/// The smallest range rate besides zero that all bursts fold onto zero, to a resolution cell of each, m/s: range rates that far apart look
/// alike to all of them. Infinite where there is none up to ten times [`FASTEST_MPS`].
pub fn common_fold_mps<'a>(bursts: impl Iterator<Item = &'a Radar> + Clone) -> f64 {
    let fold_mps = |r: &Radar| 2.0 * r.max_velocity_mps();
    let Some(first) = bursts.clone().next().map(fold_mps) else { return f64::INFINITY };
    let is_common = |v: &f64| {
        bursts.clone().all(|r| {
            let off = v - fold_mps(r) * (v / fold_mps(r)).round();
            off.abs() <= r.velocity_cell_mps()
        })
    };
    let mut folds = (1u32..).map(|q| f64::from(q) * first).take_while(|v| *v <= 10.0 * FASTEST_MPS);
    folds.find(is_common).unwrap_or(f64::INFINITY)
}

/// Width between the half powers of the beam that channels at `places_m` form at broadside, rad.
fn beam_width(places_m: &[f64], wavenumber: f64) -> Option<f64> {
    let n = places_m.len() as f64;
    let power = |sine: f64| {
        let sum: Complex64 = places_m.iter().map(|p| Complex64::cis(wavenumber * sine * p)).sum();
        (sum / n).norm_sqr()
    };
    let ends =
        places_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let span_m = ends.1 - ends.0;
    if span_m <= 0.0 {
        return None;
    }
    // Two places alone fall to half the power after a quarter of a turn, and more of them no sooner than after an eighth.
    let step = std::f64::consts::PI / (16.0 * wavenumber * span_m);
    let mut inside = 0.0;
    while power(inside + step) > 0.5 {
        inside += step;
        if inside >= 1.0 {
            return None;
        }
    }
    let mut outside = inside + step;
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if power(middle) > 0.5 { inside = middle } else { outside = middle }
    }
    (inside < 1.0).then(|| 2.0 * inside.asin())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::radar_toml::preset;
    use std::f64::consts::PI;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b} within {relative}");
    }

    /// Two places d apart: cos²(kds/2) is half at kds = π/2. A long row: 0.886 λ/L of its N d = L.
    #[test]
    fn beams_have_the_width_of_closed_forms() {
        let k = 2.0 * PI;
        close(beam_width(&[-1.0, 1.0], k).unwrap(), 2.0 * 0.125f64.asin(), 1e-9);
        let row: Vec<f64> = (0..200).map(|i| 0.5 * f64::from(i)).collect();
        close(beam_width(&row, k).unwrap(), 0.885_893 / 100.0, 1e-4);
        assert_eq!(beam_width(&[0.0, 0.0], k), None);
        assert_eq!(beam_width(&[0.0, 0.1], k), None);
    }

    #[test]
    fn figures_follow_from_the_waveform() {
        let radar = preset("front77").unwrap();
        let f = RadarFigures::of(&radar);
        assert_eq!(f.antennas, [3, 4]);
        close(f.range_resolution_m, C0 / 2e9, 1e-12);
        close(f.max_range_m, 512.0 * C0 / 2e9, 1e-12);
        close(f.max_speed_mps.unwrap(), radar.sample_wavelength_m() / (4.0 * 55e-6), 1e-12);
        close(f.speed_resolution_mps.unwrap(), radar.sample_wavelength_m() / (2.0 * 256.0 * 165e-6), 1e-12);
        // 12 elements half a wavelength apart; a row tells no elevation.
        close(f.beam_deg[0].unwrap(), (0.886f64 / 6.0).to_degrees(), 0.01);
        assert_eq!((f.beam_deg[1], f.unambiguous_deg[1]), (None, None));
        // Their lobe is at the end of all sines: 2 λ_s/λ, sampled at less than the carrier or more.
        assert!(f.unambiguous_deg[0].unwrap() > 80.0);
        // One pulse a scan measures no Doppler shift.
        assert_eq!(RadarFigures::of(&preset("uwb9").unwrap()).max_speed_mps, None);
        // A rising and a falling slope tell the range rate without folds.
        assert_eq!(RadarFigures::of(&preset("fmcw76").unwrap()).max_speed_mps, None);
    }
}
