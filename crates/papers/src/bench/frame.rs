//! One frame and its inputs, as timed by W3, W7, W8, W8-curve, W9, W12 and W13.

use catseye::adc::budget::{Budget, trim};
use catseye::base::error::Result;
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::wavenumber;
use catseye::engine::Engine;
use catseye::geom::{Geometry, curved};
use catseye::road::w3::{self, EGO_SPEED_MPS, RADAR_HEIGHT_M};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::SitedScenario;
use catseye::scene::{Scene, material, radar_toml};
use catseye::simulate::{budget, noise_budget, radar_pose, trace_options};
use catseye::trace::{Echoes, TraceOptions};
use glam::{DQuat, DVec3};
use std::borrow::Cow;

/// The inputs of one frame.
pub struct Frame {
    /// The scene as given, before curved surfaces are cut.
    pub scene: Scene,
    /// The radar.
    pub radar: Radar,
    /// Pose of the radar in the world.
    pub pose: Pose<Sensor, World>,
    /// Velocity of the radar in the world, m/s.
    pub ego_mps: DVec3,
    /// Options of ray tracing.
    pub options: TraceOptions,
    /// Rules by which weak echoes are left out.
    pub budget: Budget,
    /// Time of the middle of the frame, s.
    pub time_s: f64,
    /// Half the time over which path lengths may curve, s; 0 where all of them change at a steady rate.
    pub reach_s: f64,
    /// Largest number of triangles into which curved surfaces are cut.
    pub facets: usize,
}

impl Frame {
    /// The frame of W3, at rest or moving; its path lengths change at steady rates.
    ///
    /// # Errors
    /// Returns an error if the scene or the radar cannot be made.
    pub fn w3(moving: bool) -> Result<Frame> {
        let mut radar = radar_toml::preset("front77")?;
        let at = DVec3::new(0.0, 0.0, RADAR_HEIGHT_M);
        radar.mounting = Pose::new(DQuat::IDENTITY, at);
        Ok(Frame {
            scene: w3::w3(moving, &material::by_name)?,
            pose: Pose::new(DQuat::IDENTITY, at),
            ego_mps: if moving { DVec3::X * EGO_SPEED_MPS } else { DVec3::ZERO },
            options: TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() },
            budget: noise_budget(&radar),
            radar,
            time_s: 0.0,
            reach_s: 0.0,
            facets: 0,
        })
    }

    /// The first frame of a scenario's first radar in `scene`, as `catseye simulate` makes it.
    ///
    /// # Errors
    /// Returns an error for weather at a frequency for which it is not known.
    pub fn of(scenario: &SitedScenario, scene: Scene) -> Result<Frame> {
        let radar = scenario.radars[0].clone();
        let time_s = scenario.frames.time_s(0);
        let (pose, ego_mps) = radar_pose(&radar, &scenario.ego, time_s);
        let reach_s = 0.5 * radar.frame_time_s();
        let sway = |dt: f64| {
            let (then, _) = radar_pose(&radar, &scenario.ego, time_s + dt);
            then.translation_m - (pose.translation_m + ego_mps * dt)
        };
        let options =
            TraceOptions { radar_sway_m: [sway(-reach_s), sway(reach_s)], ..trace_options(scenario, 0, 0)? };
        let facets = scenario.trace.facets as usize;
        let budget = budget(scenario, 0);
        Ok(Frame { scene, radar, pose, ego_mps, options, budget, time_s, reach_s, facets })
    }

    /// The scene with its curved surfaces cut as finely as `accuracy_db` requires.
    ///
    /// # Errors
    /// Returns an error if a surface cannot be cut.
    pub fn refined(&self, accuracy_db: f64) -> Result<Cow<'_, Scene>> {
        curved::sized_within(&self.scene, accuracy_db, wavenumber(self.radar.carrier_hz), self.facets)
    }

    /// The geometry of `scene` at the time of the frame.
    ///
    /// # Errors
    /// Returns an error if the scene cannot be placed.
    pub fn geometry(&self, scene: &Scene) -> Result<Geometry> {
        Geometry::of_frame(scene, self.time_s, self.radar.carrier_hz, self.reach_s)
    }

    /// Traces the echoes of the frame.
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn echoes(
        &self,
        engine: &Engine,
        geometry: &Geometry,
        options: &TraceOptions,
        budget: Budget,
    ) -> Result<Echoes> {
        let mut echoes = engine.trace(geometry, &self.radar, &self.pose, self.ego_mps, options)?;
        trim(&self.radar, &mut echoes, budget);
        Ok(echoes)
    }
}
