//! Cells to points (CONVENTIONS eq. 15, 16, 20).
//!
//! A detected cell has a column, a row and a direction, each between cells of its grid. The row gives the range rate
//! (eq. 16), and the column the range after the Doppler shift is taken out of the beat (eq. 15), so that a point is
//! at the position of its target in the middle of the frame. Range and angles are transformed from the middle of the
//! array, where they are measured, to the sensor's origin (eq. 20). The cross section follows from the power by the radar
//! equation (eq. 9) with the gain of the antennas in that direction: it assumes a single path, without multipath.

use super::accuracy::{PointAccuracy, PointStd};
use super::ambiguity::Ambiguity;
use super::angle_ambiguity::ByFolds;
use crate::adc::synthesis::power_gain;
use crate::base::frames::{angles_from_direction, direction_from_angles};
use crate::base::units::{C0, db_from_power, dbm_from_w, w_from_dbm};
use crate::dsp::peaks::{Peak, place};
use crate::dsp::{RangeDoppler, Real};
use crate::scene::radar::Radar;
use crate::scene::waveform::Waveform;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// What stands for the SNR of a cube without noise, as a power ratio.
const SNR_WITHOUT_NOISE: f64 = 1e20;

/// A detected cell, placed between cells and in angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detected {
    /// Column and row of the map, with a fraction (eq. 18). The row may lie up to half a cell outside.
    pub range_bin: f64,
    /// Row of the peak, between cells.
    pub doppler_row: f64,
    /// What the folds that were found add to the row's range rate.
    pub unfolded_mps: f64,
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// |y|² of eq. 19 at its peak, W: of the cell.
    pub power_w: f64,
    /// What the peak between cells has over the cell, a power ratio.
    pub scalloping: f64,
    /// Noise estimate of eq. 17 in the cell, W: the mean over channels, before beamforming.
    pub noise_w: f64,
    /// Whether the range rate is certain.
    pub ambiguity: Ambiguity,
    /// The radar itself knows the range rate but for multiples of this; infinite: for none.
    pub modulo_mps: f64,
    /// Of azimuth and elevation, where the method knows better than eq. 117.
    pub angle_std_rad: Option<[f64; 2]>,
    /// Maps that place, power and noise are means of: 1 for one map.
    pub looks: u32,
    /// Whether the direction lies on the edge of the directions that are searched.
    pub at_search_edge: bool,
    /// Directions that it has by other folds of its range rate.
    pub by_folds: ByFolds,
}

/// A point of the cloud, sensor frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Range, m, at least half a resolution cell: nearer than that nothing is told from the radar itself
    /// ([`min_range_m`]).
    pub range_m: f64,
    /// Range rate, m/s, positive when receding. As measured it lies within ±`Radar::max_velocity_mps`; beyond that
    /// where the array, empty Doppler bands, another slope or the ego's speed said which fold it is in (`ambiguity`).
    pub range_rate_mps: f64,
    /// Azimuth, rad, positive to the left.
    pub azimuth_rad: f64,
    /// Elevation, rad, positive up.
    pub elevation_rad: f64,
    /// Position in the sensor frame, m.
    pub position_m: DVec3,
    /// Power after beamforming, at the peak between cells, dBm.
    pub power_dbm: f64,
    /// Power of the cell after beamforming over the noise of one channel's cell (eq. 20).
    pub snr_db: f64,
    /// Cross section, dBsm; infinite where the antennas have no gain.
    pub rcs_dbsm: f64,
    /// Standard deviations (eq. 115-117).
    pub std: PointStd,
    /// Standard deviation of the point's column, cells.
    pub beat_std_cells: f64,
    /// How the ambiguity of the range rate was decided.
    pub ambiguity: Ambiguity,
    /// The radar itself knows the range rate but for whole multiples of this, m/s; infinite: for none.
    pub modulo_mps: f64,
    /// The object whose echoes made it; 0 for none.
    pub object_id: u32,
    /// Class of that object; without an object `leakage`, `noise` or `weather`, and "" where no scene is known.
    pub class: String,
    /// Reflections of the echo that contributes most; 0 for none.
    pub bounces: u8,
    /// Whether it is off its object, because its echo was reflected by another one too (eq. 160).
    pub ghost: bool,
    /// Whether it is a side lobe of the object's echo, which is elsewhere in range, range rate or direction (eq. 160).
    pub side_lobe: bool,
    /// Whether it is out of place by a whole ambiguity of range rate, range or direction (eq. 160a).
    pub folded: bool,
    /// Whether its echo is beyond the sampled band of beat frequencies (eq. 160a).
    pub aliased: bool,
    /// Of the power that echoes bring to the point, what the object's bring (eq. 160), 0 to 1.
    pub share: f64,
    /// Whether the array could have confused the direction with others that are searched; None where it measures none.
    pub angle_ambiguity: Option<Ambiguity>,
    /// Azimuth and elevation of the directions that it may have instead, rad.
    pub other_angles_rad: Vec<[f64; 2]>,
    /// Whether the angular spectrum is largest on the edge of the directions that are searched: the azimuth or the
    /// elevation is then no measured direction, but a bound.
    pub at_search_edge: bool,
    /// What the other directions add to the deviations of azimuth and elevation, rad.
    pub others_std_rad: [f64; 2],
    /// Range, m, and range rate, m/s, by which the frame's first ramp alone places it, where several slopes made the point; None where
    /// these are the point's own, or that ramp does not show it.
    pub cell: Option<[f64; 2]>,
}

impl Point {
    /// The flag of the label that says that the point is not on its object, by its column's name; "" for none.
    pub fn flag(&self) -> &'static str {
        match (self.ghost, self.side_lobe, self.folded, self.aliased) {
            (true, ..) => "ghost",
            (_, true, ..) => "side_lobe",
            (_, _, true, _) => "folded",
            (.., true) => "aliased",
            (false, false, false, false) => "",
        }
    }

    /// Whether no flag of the label says that the point is out of place: it is where the echo of its object is.
    pub fn is_in_place(&self) -> bool {
        self.flag().is_empty()
    }
}

/// Range rate of a row, which may be fractional, wrapped to the unambiguous interval (eq. 16).
pub fn range_rate_mps(radar: &Radar, doppler_row: f64) -> f64 {
    let rows = radar.doppler_rows();
    // Zero Doppler stands in row M/2, rounded down; a single row tells nothing.
    let zero = (rows / 2) as f64;
    let row = if rows < 2 { zero } else { doppler_row.rem_euclid(rows as f64) };
    (row - zero) * radar.velocity_bin_mps()
}

/// Range of a bin, which may be fractional, in the middle of the frame: what the range rate adds to it (`PointAccuracy::coupling_s`)
/// is taken out (eq. 15).
pub fn range_m(radar: &Radar, range_bin: f64, range_rate_mps: f64, coupling_s: f64) -> f64 {
    radar.first_range_m() + range_bin * radar.range_bin_m() - range_rate_mps * coupling_s
}

/// What a range rate of eq. 16, and the sine of an angle, are multiplied with at a range. A ramp of slope S comes back by 2R/c later, at a
/// frequency that is S 2R/c lower than what is sent then (eq. 16a): the wavelength is that much longer than the radar's own.
pub(super) fn wavelength_ratio(radar: &Radar, range_m: f64) -> f64 {
    let later_hz = match radar.waveform {
        Waveform::Fmcw(_) => radar.slope_hz_per_s() * 2.0 * range_m / C0,
        _ => 0.0,
    };
    1.0 / (1.0 - later_hz / radar.sample_centre_hz())
}

/// √(G_t G_r) of the array towards (azimuth, elevation), mean over channels.
fn array_gain(radar: &Radar, azimuth: f64, elevation: f64) -> f64 {
    let u = direction_from_angles(azimuth, elevation);
    let mean = |list: &[crate::scene::radar::Antenna]| {
        list.iter().map(|a| power_gain(a, u).sqrt()).sum::<f64>() / list.len() as f64
    };
    mean(&radar.tx) * mean(&radar.rx)
}

/// Range and angles from the sensor's origin of what is measured from the middle of the array, `centre_m`. An angle that is not measured
/// stays, and what the middle is off along it does not count.
pub(super) fn from_origin(
    range_m: f64,
    [azimuth_rad, elevation_rad]: [f64; 2],
    std: &PointStd,
    centre_m: DVec3,
) -> (f64, f64, f64) {
    let u = direction_from_angles(azimuth_rad, elevation_rad);
    let p = u * range_m + centre_m;
    let range = range_m + u.dot(centre_m);
    if range <= 0.0 || centre_m == DVec3::ZERO {
        return (range_m, azimuth_rad, elevation_rad);
    }
    match (std.azimuth_rad.is_some(), std.elevation_rad.is_some()) {
        (true, true) => {
            let (azimuth, elevation) = angles_from_direction(p);
            (p.length(), azimuth, elevation)
        }
        // A row measures the component along it.
        (true, false) => {
            let sine = ((u.y * range_m + centre_m.y) / range / elevation_rad.cos()).clamp(-1.0, 1.0);
            let azimuth = sine.asin();
            let behind = azimuth_rad.abs() > 0.5 * PI;
            (range, if behind { PI.copysign(azimuth) - azimuth } else { azimuth }, elevation_rad)
        }
        (false, true) => (range, azimuth_rad, ((u.z * range_m + centre_m.z) / range).clamp(-1.0, 1.0).asin()),
        (false, false) => (range, azimuth_rad, elevation_rad),
    }
}

/// Makes a point without a label from what was detected (eq. 15, 16, 20). Its cross section is the one that the
/// antennas' polarisation sees.
pub fn point(radar: &Radar, d: &Detected, accuracy: &PointAccuracy) -> Point {
    let rate = range_rate_mps(radar, d.doppler_row) + d.unfolded_mps;
    let range = range_m(radar, d.range_bin, rate, accuracy.coupling_s);
    let longer = wavelength_ratio(radar, range.max(0.0));
    let rate = rate * longer;
    let mut resolved = accuracy.angle_lobes.resolve([d.azimuth_rad, d.elevation_rad], d.power_w, d.noise_w);
    let seen = resolved.angles_rad;
    let gain = array_gain(radar, seen[0], seen[1]).powi(2);
    let power_w = d.power_w * d.scalloping;
    let rcs = power_w * (4.0 * PI).powi(3) * range.powi(4)
        / (w_from_dbm(radar.tx_power_dbm) * gain * radar.wavelength_m().powi(2));
    let snr = if d.noise_w > 0.0 { d.power_w / d.noise_w } else { SNR_WITHOUT_NOISE };
    let averaged = snr * f64::from(d.looks);
    let mut std = accuracy.std(averaged, seen[0], seen[1]);
    if radar.processing.keystone && radar.migration_ambiguities().count() == 1 {
        // The keystone transform held the body by the rate of its row: what was added smears it (eq. 89a).
        let smear_m = (d.unfolded_mps * radar.burst_time_s()).abs();
        std.range_m = std.range_m.hypot(smear_m / 12f64.sqrt());
    }
    if let Some([azimuth, elevation]) = d.angle_std_rad {
        let known = |s: f64| s.is_finite() && s > 0.0;
        std.azimuth_rad = std.azimuth_rad.map(|s| if known(azimuth) { azimuth } else { s });
        std.elevation_rad = std.elevation_rad.map(|s| if known(elevation) { elevation } else { s });
    }
    let measures_angle = std.azimuth_rad.is_some() || std.elevation_rad.is_some();
    resolved =
        resolved.with_ambiguities(&d.by_folds, &accuracy.angle_lobes, [std.azimuth_rad, std.elevation_rad]);
    // A lobe that may be wrong is part of the deviation.
    let [by_azimuth, by_elevation] = resolved.variance.map(f64::sqrt);
    std.azimuth_rad = std.azimuth_rad.map(|s| s.hypot(by_azimuth));
    std.elevation_rad = std.elevation_rad.map(|s| s.hypot(by_elevation));
    let measured = [std.azimuth_rad.is_some(), std.elevation_rad.is_some()];
    let [azimuth_rad, elevation_rad] = stretched(resolved.angles_rad, measured, longer);
    let (range_m, azimuth_rad, elevation_rad) =
        from_origin(range, [azimuth_rad, elevation_rad], &std, accuracy.centre_m);
    Point {
        range_m,
        range_rate_mps: rate,
        azimuth_rad,
        elevation_rad,
        position_m: direction_from_angles(azimuth_rad, elevation_rad) * range_m,
        power_dbm: dbm_from_w(power_w),
        snr_db: db_from_power(d.power_w / d.noise_w),
        rcs_dbsm: db_from_power(rcs),
        std,
        beat_std_cells: accuracy.range.std_cells(averaged * accuracy.elements.len() as f64),
        ambiguity: d.ambiguity,
        modulo_mps: d.modulo_mps * longer,
        object_id: 0,
        class: String::new(),
        bounces: 0,
        ghost: false,
        side_lobe: false,
        folded: false,
        aliased: false,
        share: 0.0,
        angle_ambiguity: measures_angle.then_some(resolved.state),
        other_angles_rad: resolved.others_rad,
        at_search_edge: d.at_search_edge,
        others_std_rad: [by_azimuth, by_elevation],
        cell: None,
    }
}

/// Angles (azimuth, elevation) by a wavelength that is longer by a factor near 1: the array measures the sines of those that are `measured`.
pub(super) fn stretched([azimuth, elevation]: [f64; 2], measured: [bool; 2], longer: f64) -> [f64; 2] {
    let sine = |angle: f64| (angle.sin() * longer).clamp(-1.0, 1.0).asin();
    let up = if measured[1] { sine(elevation) } else { elevation };
    if !measured[0] || azimuth.abs() >= FRAC_PI_2 {
        return [azimuth, up];
    }
    let y = azimuth.sin() * elevation.cos() * longer / up.cos().max(f64::MIN_POSITIVE);
    [y.clamp(-1.0, 1.0).asin(), up]
}

/// The minimum range at which something can be separated from the radar itself: half a resolution cell. What the map shows
/// nearer than that, or at a negative range, is leakage, a constant of the mixer or noise, and no point.
pub fn min_range_m(radar: &Radar) -> f64 {
    let lines = radar.lines();
    C0 / (4.0 * lines.step_hz.abs() * lines.count as f64)
}

/// The peaks of the map for the cells of `found` in their order, at most
/// `Processing::max_points`, and their range rates, which the beamformer asks for.
pub fn peaks<T: Real>(
    radar: &Radar,
    found: &RangeDoppler<T>,
    accuracy: &PointAccuracy,
) -> (Vec<Peak>, Vec<f64>) {
    let by = [accuracy.doppler.response.as_ref(), accuracy.range.response.as_ref()];
    found
        .cells
        .iter()
        .take(radar.processing.max_points)
        .map(|cell| {
            let peak = place(&found.map, *cell, by);
            (peak, range_rate_mps(radar, peak.doppler))
        })
        .unzip()
}
