//! One frame from the scene to points, stage by stage, then compared with more accurate ones.

use super::agreement::{self, Limits};
use super::frame::Frame;
use super::sheet::{Outcome, Settings, Sheet};
use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::detect::{Bodies, label, locate};
use catseye::engine::Engine;

/// Times the stages of a frame, then compares it with the same frame at a stricter accuracy.
pub(super) fn run(
    frame: &Frame,
    limits: &Limits,
    engine: &Engine,
    settings: &Settings,
    mut sheet: Sheet<'_>,
) -> Result<Outcome> {
    let radar = &frame.radar;
    let refined = sheet.frame_stage("refine", || frame.refined(frame.options.accuracy_db))?;
    sheet.count("virtual_channels", radar.virtual_channels());
    sheet.count("chirps", radar.chirps);
    sheet.count("samples", radar.samples);
    sheet.count("triangles", frame.scene.triangle_count());
    sheet.count("triangles_refined", refined.triangle_count());
    let geometry = sheet.frame_stage("geometry", || frame.geometry(&refined))?;
    // Faces are made once and kept with the geometry.
    sheet.frame_stage("faces", || Ok(geometry.find_faces()))?;
    sheet.count("faces", geometry.faces().faces.len());
    let echoes =
        sheet.frame_stage("trace", || frame.echoes(engine, &geometry, &frame.options, frame.budget))?;
    let (cube, front_end) = sheet.frame_stage("synthesis", || {
        engine.cube(radar, &echoes, &[], settings.seed, 0, Control::default())
    })?;
    sheet.count("echoes", echoes.list.len());
    sheet.count("echoes_moving", front_end.moving);
    sheet.count("echoes_dropped", front_end.dropped);
    sheet.count("echoes_merged", front_end.merged);
    sheet.count("echoes_left_out", front_end.left_out);
    let mut found = vec![sheet.frame_stage("range_doppler", || engine.range_doppler(radar, &cube))?];
    sheet.count("cells", found[0].cells.len());
    let own_mps = frame.pose.inverse().direction(frame.ego_mps);
    let mut cloud =
        sheet.frame_stage("angles", || locate::points(engine, radar, &mut found, Some(own_mps)))?;
    sheet.frame_stage("labels", || {
        let bodies = Bodies::new(&frame.scene, frame.time_s, &frame.pose);
        label::label(radar, &mut cloud, &echoes, &bodies)?;
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
