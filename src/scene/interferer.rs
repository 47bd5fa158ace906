//! Other FMCW radars in the scene: what the TOML says, checked.

use super::motion::{Joint, Motion};
use super::place_reader::PlaceReader;
use super::radar::{Antenna, Pattern, Polarisation, Radar};
use super::toml_file::At;
use super::trajectory::TrajectoryTable;
use crate::base::error::Result;
use crate::base::frames::{Pose, Sensor, World};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A radar that only sends: ramps without an end.
#[derive(Debug, Clone, PartialEq)]
pub struct Interferer {
    /// Name of the radar.
    pub name: String,
    /// Frequency at the ramp's start, Hz.
    pub start_hz: f64,
    /// Falling when negative.
    pub slope_hz_per_s: f64,
    /// Duration of a ramp, s.
    pub ramp_time_s: f64,
    /// Time from ramp to ramp, s; the interferer is silent after the ramp.
    pub period_s: f64,
    /// Time at which a ramp starts, s, against the middle of the frame; drawn for each frame when None.
    pub start_s: Option<f64>,
    /// Whether each ramp starts with the same phase; otherwise a phase is drawn for each.
    pub coherent: bool,
    /// Transmit power, dBm.
    pub power_dbm: f64,
    /// Its antenna, in the origin of its own frame.
    pub antenna: Antenna,
    /// Its pose at time zero.
    pub pose: Pose<Sensor, World>,
    /// Velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// How it moves when not straight on at that velocity.
    pub motion: Option<Arc<Motion>>,
}

impl Interferer {
    /// Pose of the interferer, and its velocity in m/s, at a time from the middle of frame 0.
    pub fn at(&self, time_s: f64) -> (Pose<Sensor, World>, DVec3) {
        match &self.motion {
            None => {
                let at = self.pose.translation_m + self.velocity_mps * time_s;
                (Pose::new(self.pose.rotation, at), self.velocity_mps)
            }
            Some(motion) => {
                let now = motion.at(time_s);
                (Pose::new(now.rotation, now.translation_m), now.velocity_mps)
            }
        }
    }

    /// What a radar's first transmitter sends, or None when it sends no linear ramps.
    pub fn of_radar(radar: &Radar, pose: Pose<Sensor, World>, velocity_mps: DVec3) -> Option<Interferer> {
        let ramp = radar.waveform.ramp()?;
        let antenna = radar.tx.first()?;
        let shifted = Pose::new(pose.rotation, pose.point(antenna.position_m));
        Some(Interferer {
            name: radar.name.clone(),
            start_hz: radar.start_hz(),
            slope_hz_per_s: radar.slope_hz_per_s(),
            ramp_time_s: ramp.time_s,
            period_s: ramp.period_s,
            start_s: None,
            coherent: true,
            power_dbm: radar.tx_power_dbm,
            antenna: Antenna { position_m: DVec3::ZERO, ..antenna.clone() },
            pose: shifted,
            velocity_mps,
            motion: None,
        })
    }
}

/// An interfering FMCW radar.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InterfererTable {
    /// Name of the radar.
    pub name: String,
    /// Centre frequency of the sweep, Hz.
    #[schemars(range(min = 1e8, max = 3e12))]
    pub carrier_hz: At<f64>,
    /// Bandwidth swept during `ramp_time_s`, Hz, negative for a falling ramp.
    pub bandwidth_hz: At<f64>,
    /// Duration of a ramp, s.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub ramp_time_s: f64,
    /// Time from the start of one ramp to the start of the next, s.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub chirp_period_s: At<f64>,
    /// Start time of one of its ramps relative to the middle of the frame, s; default random.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub start_s: Option<f64>,
    /// true: all ramps start with the same phase; default false: each ramp starts with a random phase.
    #[serde(default)]
    pub coherent: bool,
    /// Transmit power, dBm.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub power_dbm: f64,
    /// Antenna gain, dBi.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub gain_dbi: f64,
    /// Polarisation: V, H, +45, -45, RHCP or LHCP (default V).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarisation: Option<At<String>>,
    /// Exponent n of the power pattern cos(azimuth)^n cos(elevation)^m; isotropic without both exponents.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub azimuth_exponent: Option<f64>,
    /// Exponent m of the power pattern over elevation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub elevation_exponent: Option<f64>,
    /// Position at the middle of frame 0, [forward, left, up] in the world, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<At<[f64; 3]>>,
    /// Yaw of the boresight, degrees, positive to the left; 180 looks back along the road. With a trajectory it is relative to the heading.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch, degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll, degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Velocity in the world, m/s.
    #[serde(default)]
    pub velocity_mps: At<[f64; 3]>,
    /// Trajectory of the interferer with its heading, in place of position and velocity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<TrajectoryTable>,
}

/// Checks an interferer that was read as part of a document; `key` is that of its table.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub(super) fn build(places: &mut PlaceReader<'_, '_>, key: &str, t: &InterfererTable) -> Result<Interferer> {
    let doc = places.doc;
    let carrier_hz = t.carrier_hz.value;
    let bandwidth_hz = doc.in_range(
        &t.bandwidth_hz,
        -carrier_hz..=carrier_hz,
        "swept bandwidth in hertz, as in 0.5e9; negative falls",
    )?;
    let (ramp_time_s, period_s) = (t.ramp_time_s, t.chirp_period_s.value);
    if period_s < ramp_time_s * (1.0 - 1e-9) {
        return Err(doc
            .bad(&t.chirp_period_s.span, "is shorter than the ramp")
            .allowed(format!("at least ramp_time_s = {ramp_time_s:e}"))
            .remedy("lengthen the period or shorten the ramp")
            .into());
    }
    let polarisation = match &t.polarisation {
        None => Polarisation::V,
        Some(p) => Polarisation::from_name(&p.value).ok_or_else(|| {
            doc.bad(&p.span, "is not a polarisation")
                .allowed(Polarisation::NAMES.map(|(n, _)| n).join(", "))
                .remedy("use V for up, H for left, +45 for the direction between them")
        })?,
    };
    let pattern = match (t.azimuth_exponent, t.elevation_exponent) {
        (None, None) => Pattern::Isotropic,
        (azimuth, elevation) => Pattern::CosinePower {
            azimuth_exponent: azimuth.unwrap_or(0.0),
            elevation_exponent: elevation.unwrap_or(0.0),
        },
    };
    let (position_m, velocity_mps, trajectory) =
        places.of(key, &t.name, (&t.position_m, &t.velocity_mps, &t.trajectory), &t.carrier_hz.span)?;
    let [yaw, pitch, roll] = [t.yaw_deg, t.pitch_deg, t.roll_deg].map(f64::to_radians);
    let pose = Pose::from_yaw_pitch_roll(position_m, yaw, pitch, roll);
    let motion = trajectory.map(|t| {
        let own = std::iter::once(Joint::Fixed(pose.rotation, DVec3::ZERO));
        Arc::new(Motion { joints: own.chain(t.motion.joints.iter().cloned()).collect() })
    });
    Ok(Interferer {
        name: t.name.clone(),
        start_hz: carrier_hz - 0.5 * bandwidth_hz,
        slope_hz_per_s: bandwidth_hz / ramp_time_s,
        ramp_time_s,
        period_s,
        start_s: t.start_s,
        coherent: t.coherent,
        power_dbm: t.power_dbm,
        antenna: Antenna { position_m: DVec3::ZERO, polarisation, gain_dbi: t.gain_dbi, pattern },
        pose,
        velocity_mps,
        motion,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::toml_file::Document;

    const TEXT: &str = r#"name = "oncoming"
carrier_hz = 77e9
bandwidth_hz = -0.5e9
ramp_time_s = 25e-6
chirp_period_s = 30e-6
power_dbm = 10
gain_dbi = 12
polarisation = "H"
azimuth_exponent = 4
position_m = [60, 3, 0.5]
yaw_deg = 180
velocity_mps = [-20, 0, 0]
"#;

    fn read(text: &str) -> Result<Interferer> {
        let doc = Document::parse("i.toml", text)?;
        build(&mut PlaceReader::new(&doc, 0.0), "interferer[0]", &doc.read()?)
    }

    #[test]
    fn is_read() {
        let i = read(TEXT).unwrap();
        assert_eq!((i.start_hz, i.slope_hz_per_s), (77.25e9, -2e13));
        assert!((i.pose.direction(DVec3::X) + DVec3::X).length() < 1e-12);
        assert_eq!((i.coherent, i.start_s), (false, None));
    }

    #[test]
    fn is_checked() {
        for (from, to, says) in [
            ("30e-6", "20e-6", "i.toml:5: chirp_period_s = 20e-6: is shorter than the ramp"),
            ("\"H\"", "\"X\"", "is not a polarisation"),
            ("[60, 3, 0.5]", "[60, nan, 0.5]", "position_m"),
            ("ramp_time_s = 25e-6", "ramp_time_s = 0", "ramp_time_s = 0"),
            ("power_dbm = 10", "power_dbm = 1e3", "power_dbm = 1e3"),
            ("gain_dbi", "gain_dbx", "did you mean 'gain_dbi'?"),
        ] {
            let e = read(&TEXT.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(e.contains(says), "{e}");
        }
    }
}
