//! `[lidar]` of a scenario: an ideal lidar on the vehicle, where it stands and in which directions it looks.

use super::radar_toml::{MountingTable, mounting};
use super::toml_file::{At, Document};
use crate::base::error::Result;
use crate::base::frames::{Pose, Sensor, Vehicle};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// Most rays of a scan, so that its table stays within the memory of one frame.
const MOST_RAYS: u64 = 2_000_000;
/// Place of a lidar that is given no other: above the roof of a passenger car, from the rear-axle centre, m.
const ROOF_M: DVec3 = DVec3::new(0.95, 0.0, 1.85);
/// A circle that is closed to this share of a step has no second ray in its first direction.
const CLOSED: f64 = 1e-9;

/// An ideal lidar; `output.lidar` (in recipes `keep.lidar`) writes its points. It scans all directions of a
/// regular pattern at the middle of the frame.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LidarTable {
    /// Number of channels (elevations).
    #[schemars(range(min = 1, max = 512))]
    pub channels: u32,
    /// Elevations of the lowest and the highest channel, degrees, positive up. The others are evenly spaced
    /// between them; a single channel has the first.
    pub elevation_deg: At<[f64; 2]>,
    /// First and last azimuth, degrees, positive to the left; a full circle ends one step before its start.
    pub azimuth_deg: At<[f64; 2]>,
    /// Azimuth step, degrees.
    #[schemars(range(min = 1e-3, max = 360.0))]
    pub azimuth_step_deg: At<f64>,
    /// Maximum range, m; surfaces at this distance or farther give no point.
    #[schemars(range(min = 0.1, max = 1e4))]
    pub max_range_m: f64,
    /// Pose on the vehicle; default above the roof, 0.95 m ahead of the rear-axle centre and 1.85 m above it.
    pub mounting: Option<MountingTable>,
}

impl Default for LidarTable {
    fn default() -> Self {
        LidarTable {
            channels: 32,
            elevation_deg: [-30.0, 10.0].into(),
            azimuth_deg: [-180.0, 180.0].into(),
            azimuth_step_deg: 0.4.into(),
            max_range_m: 100.0,
            mounting: None,
        }
    }
}

/// An ideal lidar that has been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Lidar {
    /// Elevation of each channel, from the lowest, rad, positive up.
    pub elevations_rad: Vec<f64>,
    /// Azimuths, in rising order, rad, positive to the left.
    pub azimuths_rad: Vec<f64>,
    /// Maximum range, m; surfaces at this distance or farther give no point.
    pub max_range_m: f64,
    /// Pose in the vehicle.
    pub mounting: Pose<Sensor, Vehicle>,
}

/// Checks the table of a lidar.
///
/// # Errors
/// Returns `BadInput` with file, line, key and range for a value that is out of its range, for two angles that are not in
/// rising order, and for more than two million rays.
pub fn build(doc: &Document<'_>, t: &LidarTable) -> Result<Lidar> {
    let channels = t.channels;
    let elevation_deg = rising(doc, &t.elevation_deg, 90.0, channels == 1)?;
    let azimuth_deg = rising(doc, &t.azimuth_deg, 360.0, true)?;
    let width_deg = azimuth_deg[1] - azimuth_deg[0];
    if width_deg > 360.0 {
        return Err(doc
            .bad(&t.azimuth_deg.span, "spans more than 360 degrees")
            .allowed("two azimuths with a difference of up to 360 degrees")
            .remedy("give [-180, 180] for a full circle")
            .into());
    }
    let step_deg = t.azimuth_step_deg.value;
    let steps = (width_deg / step_deg + CLOSED).floor();
    // A full circle that the steps close would otherwise look twice in its first direction.
    let is_closed = steps > 0.0 && 360.0 - steps * step_deg < CLOSED * step_deg.max(1.0);
    let azimuths = steps as u32 + u32::from(!is_closed);
    if u64::from(azimuths) * u64::from(channels) > MOST_RAYS {
        return Err(doc
            .bad(&t.azimuth_step_deg.span, "the lidar has too many rays")
            .allowed(format!("up to {MOST_RAYS} rays (channels times azimuths)"))
            .remedy("give a larger step or fewer channels")
            .into());
    }
    let rise_deg = (elevation_deg[1] - elevation_deg[0]) / f64::from(channels.max(2) - 1);
    Ok(Lidar {
        elevations_rad: (0..channels)
            .map(|i| (elevation_deg[0] + f64::from(i) * rise_deg).to_radians())
            .collect(),
        azimuths_rad: (0..azimuths)
            .map(|i| (azimuth_deg[0] + f64::from(i) * step_deg).to_radians())
            .collect(),
        max_range_m: t.max_range_m,
        mounting: match &t.mounting {
            Some(table) => mounting(doc, table)?,
            None => Pose::new(glam::DQuat::IDENTITY, ROOF_M),
        },
    })
}

/// Two angles in rising order, degrees; `equal` says whether they may be the same.
fn rising(doc: &Document<'_>, at: &At<[f64; 2]>, most_deg: f64, equal: bool) -> Result<[f64; 2]> {
    let [first, last] = at.value;
    // A value that is not a number fails both comparisons.
    let inside = first >= -most_deg && last <= most_deg;
    if inside && (first < last || (equal && first == last)) {
        return Ok(at.value);
    }
    Err(doc
        .bad(&at.span, "are not two angles in rising order")
        .allowed(format!("two angles from -{most_deg} to {most_deg} degrees, the lower one first"))
        .remedy("give them as in [-30, 10]")
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[derive(Deserialize, JsonSchema)]
    struct File {
        #[serde(default)]
        lidar: LidarTable,
    }

    fn read(keys: &str) -> Result<Lidar> {
        let text = format!("[lidar]\n{keys}\n");
        let doc = Document::parse(Path::new("s.toml"), &text)?;
        let file: File = doc.read()?;
        build(&doc, &file.lidar)
    }

    #[test]
    fn patterns_are_regular() {
        let all = read("").unwrap();
        assert_eq!((all.elevations_rad.len(), all.azimuths_rad.len(), all.max_range_m), (32, 900, 100.0));
        let near = |a: f64, b: f64| assert!((a.to_degrees() - b).abs() < 1e-12, "{} {b}", a.to_degrees());
        near(all.elevations_rad[0], -30.0);
        near(all.elevations_rad[31], 10.0);
        // The circle ends a step before its start.
        near(all.azimuths_rad[899], 179.6);
        assert_eq!(all.mounting.translation_m, DVec3::new(0.95, 0.0, 1.85));
        let front =
            read("channels = 1\nelevation_deg = [2, 2]\nazimuth_deg = [-60, 60]\nazimuth_step_deg = 0.1")
                .unwrap();
        assert_eq!((front.elevations_rad.len(), front.azimuths_rad.len()), (1, 1201));
        near(front.azimuths_rad[1200], 60.0);
        near(front.elevations_rad[0], 2.0);
        // A step that does not close the circle keeps its last ray.
        assert_eq!(read("azimuth_step_deg = 7").unwrap().azimuths_rad.len(), 52);
        let placed = read("[lidar.mounting]\nposition_m = [1, 2, 3]\nyaw_deg = 90").unwrap().mounting;
        assert!((placed.direction(DVec3::X) - DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn hostile_values_are_placed() {
        for (keys, key) in [
            ("channels = 0", "lidar.channels"),
            ("channels = 513", "lidar.channels"),
            ("elevation_deg = [10, -30]", "lidar.elevation_deg"),
            ("elevation_deg = [5, 5]", "lidar.elevation_deg"),
            ("elevation_deg = [-91, 5]", "lidar.elevation_deg"),
            ("elevation_deg = [nan, 5]", "lidar.elevation_deg"),
            ("elevation_deg = [0, inf]", "lidar.elevation_deg"),
            ("azimuth_deg = [-300, 300]", "lidar.azimuth_deg"),
            ("azimuth_deg = [0, nan]", "lidar.azimuth_deg"),
            ("azimuth_step_deg = 0", "lidar.azimuth_step_deg"),
            ("azimuth_step_deg = -1", "lidar.azimuth_step_deg"),
            ("azimuth_step_deg = nan", "lidar.azimuth_step_deg"),
            ("azimuth_step_deg = 0.001", "lidar.azimuth_step_deg"),
            ("max_range_m = 0", "lidar.max_range_m"),
            ("max_range_m = inf", "lidar.max_range_m"),
            ("[lidar.mounting]\nposition_m = [nan, 0, 0]", "lidar.mounting.position_m"),
            ("[lidar.mounting]\npitch_deg = 1e9", "lidar.mounting.pitch_deg"),
            ("chanels = 3", "chanels"),
        ] {
            let e = read(keys).unwrap_err();
            let text = e.to_string();
            assert!(e.exit_code() == 2 && text.contains(key) && text.contains("s.toml:"), "{keys}: {text}");
        }
    }
}
