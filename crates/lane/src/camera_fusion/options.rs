//! Options of the method camera-fusion: the table `[lane.camera_fusion]` of a scenario, and the same keys in
//! JSON and in Python.

use super::camera::Camera;
use super::estimator::{CameraFusion, FusionSetup, METHOD};
use super::recognise::RecogniseSettings;
use crate::LaneEstimator;
use crate::body::Body;
use crate::limits;
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::Radar;
use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Light conditions of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// Noon with a clear sky.
    Clear,
    /// A moonless night outside towns, with low beams.
    Night,
    /// Daytime fog with the visibility `fog_visibility_m`.
    Fog,
    /// The sun low ahead at `glare_elevation_deg`.
    Glare,
}

impl Condition {
    /// Name of the condition in files.
    pub fn name(self) -> &'static str {
        ["clear", "night", "fog", "glare"][self as usize]
    }
}

/// The camera; no other part of a scenario describes it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraTable {
    /// Width of the image, pixels.
    #[schemars(range(min = 64, max = 4096))]
    pub width_px: u32,
    /// Height of the image, pixels.
    #[schemars(range(min = 64, max = 4096))]
    pub height_px: u32,
    /// Focal length, pixels.
    #[schemars(range(min = 20.0, max = 2e4))]
    pub focal_px: f64,
    /// Position in the vehicle frame, m; z is the height above the road.
    pub position_m: [f64; 3],
    /// Yaw angle, degrees, positive to the left.
    #[schemars(range(min = -60.0, max = 60.0))]
    pub yaw_deg: f64,
    /// Pitch angle, degrees, positive nose down.
    #[schemars(range(min = -30.0, max = 60.0))]
    pub pitch_deg: f64,
    /// Roll angle, degrees, positive left side up.
    #[schemars(range(min = -30.0, max = 30.0))]
    pub roll_deg: f64,
}

impl Default for CameraTable {
    /// A camera behind the windscreen with a horizontal view of 49 degrees.
    fn default() -> Self {
        CameraTable {
            width_px: 640,
            height_px: 400,
            focal_px: 700.0,
            position_m: [1.5, 0.0, 1.4],
            yaw_deg: 0.0,
            pitch_deg: 3.0,
            roll_deg: 0.0,
        }
    }
}

impl CameraTable {
    /// The camera in the form that estimators take.
    pub fn camera(&self) -> Camera {
        Camera {
            width_px: self.width_px as usize,
            height_px: self.height_px as usize,
            focal_px: DVec2::splat(self.focal_px),
            centre_px: DVec2::new(0.5 * f64::from(self.width_px), 0.5 * f64::from(self.height_px)),
            position_m: DVec3::from_array(self.position_m),
            yaw_rad: self.yaw_deg.to_radians(),
            pitch_rad: self.pitch_deg.to_radians(),
            roll_rad: self.roll_deg.to_radians(),
        }
    }
}

/// The method's name in the keys of its table.
const TABLE: &str = "camera_fusion";

/// Settings of the method camera-fusion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Settings")]
pub struct CameraFusionOptions {
    /// The camera.
    pub camera: CameraTable,
    /// Light conditions. The table shows the estimates of the first condition; all are compared, for each
    /// sensor alone and for both together.
    pub conditions: Vec<Condition>,
    /// Distances of the near and the far side of the trapezoid in which lines are sought, ahead of the
    /// vehicle's origin, m.
    pub seen_m: [f64; 2],
    /// Half width of that trapezoid, m.
    #[schemars(range(min = 1.0, max = 50.0))]
    pub half_width_m: f64,
    /// Lane width where the camera does not detect both lines, m.
    #[schemars(range(min = 1.5, max = 10.0))]
    pub lane_width_m: f64,
    /// Time window of tracks in one recognition, s (t of Sangeetha Lakshmi). The next window begins half of
    /// it later.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub period_s: f64,
    /// true: tracks are moved from the side of the car that the radar detects to its centre.
    pub to_middle: bool,
    /// Time of the first recognition, s.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub first_s: f64,
    /// Number of units in the network's second layer, which equals the number of training bends.
    #[schemars(range(min = 10, max = 1000))]
    pub network_units: u32,
    /// Minimum and maximum distance from the vehicle at which lines are scored, m.
    pub range_m: [f64; 2],
    /// Standard deviation of the speed on the vehicle bus, m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_std_mps: f64,
    /// Quantisation step of the speed on the vehicle bus, m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_step_mps: f64,
    /// Standard deviation of the yaw rate on the vehicle bus, degrees/s.
    #[schemars(range(min = 0.0, max = 30.0))]
    pub yaw_rate_std_deg_per_s: f64,
    /// Standard deviation of the camera's pitch from image to image, degrees; unknown to the estimator.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub pitch_std_deg: f64,
    /// Meteorological visibility in the condition `fog`, m.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub fog_visibility_m: f64,
    /// Elevation of the sun in the condition `glare`, degrees.
    #[schemars(range(min = 1.0, max = 60.0))]
    pub glare_elevation_deg: f64,
    /// Stray light of the windscreen in the condition `glare`, relative to that of a healthy eye.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub glare_stray: f64,
}

impl Default for CameraFusionOptions {
    fn default() -> Self {
        CameraFusionOptions {
            camera: CameraTable::default(),
            conditions: vec![Condition::Clear, Condition::Night, Condition::Fog, Condition::Glare],
            seen_m: [6.0, 35.0],
            half_width_m: 6.0,
            lane_width_m: 3.5,
            period_s: 2.0,
            to_middle: true,
            first_s: 2.0,
            network_units: 15,
            range_m: [6.0, 60.0],
            speed_std_mps: 0.05,
            speed_step_mps: 0.01,
            yaw_rate_std_deg_per_s: 0.2,
            pitch_std_deg: 0.1,
            fog_visibility_m: 25.0,
            glare_elevation_deg: 12.0,
            glare_stray: 10.0,
        }
    }
}

impl CameraFusionOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        limits::check_bounds(TABLE, self)?;
        let [x, y, z] = self.camera.position_m;
        limits::check(
            TABLE,
            &[
                ("camera.position_m[0]", x, -10.0, 10.0, "as in [1.5, 0, 1.4]"),
                ("camera.position_m[1]", y, -5.0, 5.0, "as in [1.5, 0, 1.4]"),
                ("camera.position_m[2]", z, 0.2, 10.0, "as in [1.5, 0, 1.4]"),
            ],
        )?;
        for (key, [a, b]) in [("seen_m", self.seen_m), ("range_m", self.range_m)] {
            if !(0.0 < a && a < b && b <= 300.0) {
                let bad = limits::wrong(TABLE, key, format!("[{a}, {b}]")).remedy("as in [6, 35]");
                return Err(bad.allowed("0 < near < far <= 300 m").into());
            }
        }
        if self.conditions.is_empty() {
            return Err(limits::wrong(TABLE, "conditions", "[]")
                .allowed("one or more of clear, night, fog, glare")
                .remedy("as in [\"clear\", \"night\", \"fog\", \"glare\"]")
                .into());
        }
        Ok(())
    }

    /// What the estimator works with.
    pub fn setup(&self) -> FusionSetup {
        FusionSetup {
            seen_m: self.seen_m,
            half_width_m: self.half_width_m,
            recognise: RecogniseSettings { lane_width_m: self.lane_width_m, ..RecogniseSettings::default() },
            period_s: self.period_s,
            pitch_std_rad: self.pitch_std_deg.to_radians(),
            units: self.network_units as usize,
            body: self.to_middle.then_some(Body::CAR),
            ..FusionSetup::new(self.camera.camera())
        }
    }

    /// Makes the estimator with a radar in the front bumper.
    ///
    /// # Errors
    /// Returns the errors of [`Self::estimator_with`].
    pub fn estimator(&self) -> Result<CameraFusion> {
        made(self.setup())
    }

    /// Makes the estimator for a radar.
    ///
    /// # Errors
    /// Returns an error if the camera's image does not hold the trapezoid or an option is invalid.
    pub fn estimator_with(&self, radar: &Radar) -> Result<CameraFusion> {
        let radar_at_m = radar.mounting.translation_m.truncate();
        made(FusionSetup { radar_at_m, ..self.setup() })
    }
}

fn made(setup: FusionSetup) -> Result<CameraFusion> {
    CameraFusion::new(setup).map_err(|e| {
        let remedy = "change camera or seen_m so that the trapezoid is in the image";
        BadInput::new(e.to_string()).key("lane.camera_fusion").remedy(remedy).into()
    })
}

/// Makes the estimator from options as JSON, with a radar in the front bumper. The keys of a trial
/// (`conditions`, `range_m` and the like) are allowed and have no effect on it.
///
/// # Errors
/// Returns an error for options that are unknown or outside their ranges, or if the camera's image does not
/// hold the trapezoid.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: CameraFusionOptions = limits::read_json(METHOD, options)?;
    options.check()?;
    Ok(Box::new(options.estimator()?))
}
