//! One frame from the scene to points, stage by stage, as W3, W7, W8, W9, W12 and W13 time it.

use super::agreement::{self, Limits};
use super::sheet::{Outcome, Settings, Sheet};
use catseye::adc::cpu::synthesis::Control;
use catseye::detect::{Bodies, label, locate};
use catseye::engine::Engine;
use catseye::error::Result;
use catseye::frames::{Pose, Sensor, World};
use catseye::geom::{Geometry, curved};
use catseye::road::w3::{self, EGO_SPEED_MPS, RADAR_HEIGHT_M};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::Scenario;
use catseye::scene::{Scene, material, radar_toml};
use catseye::simulate::{radar_pose, trace_options};
use catseye::trace::{Echoes, TraceOptions};
use catseye::units::wavenumber;
use glam::{DQuat, DVec3};
use std::borrow::Cow;

/// What a frame is made of.
pub struct Frame {
    /// What stands there, as it is given.
    pub scene: Scene,
    /// The radar.
    pub radar: Radar,
    /// Pose of the radar in the world.
    pub pose: Pose<Sensor, World>,
    /// Velocity of the radar in the world, m/s.
    pub ego_mps: DVec3,
    /// How waves are followed.
    pub options: TraceOptions,
    /// Middle of the frame, s.
    pub time_s: f64,
    /// Half the time over which paths may bend, s; 0 where all of them change at a steady rate.
    pub reach_s: f64,
    /// Most triangles that curved surfaces are cut into.
    pub facets: usize,
}

impl Frame {
    /// W3 at rest or moving; its paths change at steady rates.
    ///
    /// # Errors
    /// A scene or radar that cannot be made.
    pub fn w3(moving: bool) -> Result<Frame> {
        let mut radar = radar_toml::preset("front77")?;
        let at = DVec3::new(0.0, 0.0, RADAR_HEIGHT_M);
        radar.mounting = Pose::new(DQuat::IDENTITY, at);
        Ok(Frame {
            scene: w3::w3(moving, &material::by_name)?,
            pose: Pose::new(DQuat::IDENTITY, at),
            ego_mps: if moving { DVec3::X * EGO_SPEED_MPS } else { DVec3::ZERO },
            options: TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() },
            radar,
            time_s: 0.0,
            reach_s: 0.0,
            facets: 0,
        })
    }

    /// The first frame of a scenario's first radar in this scene, as `catseye simulate` makes it.
    ///
    /// # Errors
    /// Weather at a frequency for which it is not known.
    pub fn of(scenario: &Scenario, scene: Scene) -> Result<Frame> {
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
        Ok(Frame { scene, radar, pose, ego_mps, options, time_s, reach_s, facets })
    }

    /// The scene with its curved surfaces cut as finely as an accuracy in dB asks for.
    ///
    /// # Errors
    /// Surfaces that cannot be cut.
    pub fn refined(&self, accuracy_db: f64) -> Result<Cow<'_, Scene>> {
        let sagitta_m = curved::sagitta_m(accuracy_db, wavenumber(self.radar.carrier_hz));
        curved::refined_within(&self.scene, sagitta_m, self.facets)
    }

    /// A scene placed as it is at the time of the frame.
    ///
    /// # Errors
    /// A scene that cannot be placed.
    pub fn geometry(&self, scene: &Scene) -> Result<Geometry> {
        Geometry::of_frame(scene, self.time_s, self.radar.carrier_hz, self.reach_s)
    }

    /// The echoes of the frame.
    pub fn echoes(&self, engine: &Engine, geometry: &Geometry, options: &TraceOptions) -> Echoes {
        engine.echoes(geometry, &self.radar, &self.pose, self.ego_mps, options)
    }
}

/// Times the stages of a frame, then compares it with the same frame at a stricter accuracy.
pub(super) fn run(
    frame: &Frame,
    limits: &Limits,
    engine: &Engine,
    settings: &Settings,
    mut sheet: Sheet<'_>,
) -> Result<Outcome> {
    let radar = &frame.radar;
    let refined = sheet.stage("refine", || frame.refined(frame.options.accuracy_db))?;
    sheet.count("virtual_channels", radar.virtual_channels());
    sheet.count("chirps", radar.chirps);
    sheet.count("samples", radar.samples);
    sheet.count("triangles", frame.scene.triangle_count());
    sheet.count("triangles_refined", refined.triangle_count());
    let geometry = sheet.stage("geometry", || frame.geometry(&refined))?;
    // Faces are made once and kept with the geometry.
    sheet.stage("faces", || Ok(geometry.find_faces()))?;
    sheet.count("faces", geometry.faces().faces.len());
    let echoes = sheet.stage("trace", || Ok(frame.echoes(engine, &geometry, &frame.options)))?;
    let (cube, front_end) = sheet
        .stage("synthesis", || engine.cube(radar, &echoes, &[], settings.seed, 0, Control::default()))?;
    sheet.count("echoes", echoes.list.len());
    sheet.count("echoes_moving", front_end.moving);
    sheet.count("echoes_dropped", front_end.dropped);
    let mut found = vec![sheet.stage("range_doppler", || engine.range_doppler(radar, &cube))?];
    sheet.count("cells", found[0].cells.len());
    let own_mps = frame.pose.inverse().direction(frame.ego_mps);
    let mut cloud = sheet.stage("angles", || locate::points(engine, radar, &mut found, Some(own_mps)))?;
    sheet.stage("labels", || {
        let bodies = Bodies::new(&frame.scene, frame.time_s, &frame.pose);
        label::label(radar, &mut cloud, &echoes, &bodies);
        Ok(())
    })?;
    sheet.count("points", cloud.len());
    drop((cube, found, cloud, geometry, refined));
    agreement::compare(frame, &echoes, limits, engine, &mut sheet)?;
    Ok(sheet.finish())
}

pub(super) fn w3(moving: bool, engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    run(&Frame::w3(moving)?, &Limits { loops: 16 }, engine, settings, sheet)
}
