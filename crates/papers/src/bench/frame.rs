//! W3: one frame of a road from the scene to points, against the same frame with a stricter accuracy.

use super::sheet::{Outcome, Settings, Sheet, median, relative_l2};
use catseye::adc::cpu::synthesis::Control;
use catseye::adc::noise::Noise;
use catseye::adc::synthesis::{Levels, beat_frequency_hz};
use catseye::detect::{Bodies, label, locate};
use catseye::dsp::PowerMap;
use catseye::engine::Engine;
use catseye::error::Result;
use catseye::frames::{Pose, Sensor, World};
use catseye::geom::Geometry;
use catseye::road::w3::{self, EGO_SPEED_MPS, RADAR_HEIGHT_M};
use catseye::scene::radar::Radar;
use catseye::scene::{Scene, material, radar_toml};
use catseye::trace::{Echo, Echoes, TraceOptions};
use catseye::units::db_from_power;
use glam::{DQuat, DVec3};
use serde_json::json;
use std::collections::BTreeMap;

/// Accuracy of the coherent sums, dB: what a scenario has when it says nothing.
const ACCURACY_DB: f64 = 0.2;
/// The reference allows a sixteenth of the error: phases across a stretch of a quarter.
const FINER: f64 = 16.0;
/// Loops of the frames that are compared: the fewest that the detector's window allows.
const LOOPS_COMPARED: usize = 16;

/// Scene, radar and geometry of W3.
pub struct Frame {
    /// The road.
    pub scene: Scene,
    /// The radar.
    pub radar: Radar,
    /// The road at the time of the frame.
    pub geometry: Geometry,
    /// Pose of the radar in the world.
    pub pose: Pose<Sensor, World>,
    /// Velocity of the radar in the world, m/s.
    pub ego_mps: DVec3,
}

impl Frame {
    /// The frame at rest or moving.
    ///
    /// # Errors
    /// A scene or radar that cannot be made.
    pub fn new(moving: bool) -> Result<Frame> {
        let scene = w3::w3(moving, &material::by_name)?;
        let mut radar = radar_toml::preset("front77")?;
        let at = DVec3::new(0.0, 0.0, RADAR_HEIGHT_M);
        radar.mounting = Pose::new(DQuat::IDENTITY, at);
        Ok(Frame {
            geometry: Geometry::build(&scene, 0.0, radar.carrier_hz)?,
            scene,
            radar,
            pose: Pose::new(DQuat::IDENTITY, at),
            ego_mps: if moving { DVec3::X * EGO_SPEED_MPS } else { DVec3::ZERO },
        })
    }

    /// The echoes of the frame at an accuracy in dB.
    pub fn echoes(&self, engine: &Engine, accuracy_db: f64) -> Echoes {
        let options =
            TraceOptions { accuracy_db, bandwidth_hz: self.radar.bandwidth_hz(), ..Default::default() };
        engine.echoes(&self.geometry, &self.radar, &self.pose, self.ego_mps, &options)
    }
}

pub(super) fn w3(
    moving: bool,
    engine: &Engine,
    settings: &Settings,
    mut sheet: Sheet<'_>,
) -> Result<Outcome> {
    let frame = Frame::new(moving)?;
    let f = frame.radar.carrier_hz;
    sheet.stage("geometry", || Geometry::build(&frame.scene, 0.0, f))?;
    // Faces are made once and kept with the geometry.
    sheet.stage("faces", || Ok(frame.geometry.find_faces()))?;
    frame.geometry.faces();
    let echoes = sheet.stage("trace", || Ok(frame.echoes(engine, ACCURACY_DB)))?;
    sheet.count("triangles", frame.geometry.triangles.len());
    sheet.count("faces", frame.geometry.faces().faces.len());
    sheet.count("returns", echoes.list.len());
    let seed = settings.seed;
    let (cube, front_end) =
        sheet.stage("synthesis", || engine.cube(&frame.radar, &echoes, &[], seed, 0, Control::default()))?;
    sheet.count("returns_moving", front_end.moving);
    sheet.count("returns_filtered_out", front_end.dropped);
    let mut found = vec![sheet.stage("range_doppler", || engine.range_doppler(&frame.radar, &cube))?];
    sheet.count("cells", found[0].cells.len());
    let mut cloud = sheet.stage("angles", || locate::points(engine, &frame.radar, &mut found, None))?;
    sheet.stage("labels", || {
        let bodies = Bodies::new(&frame.scene, 0.0, &frame.pose);
        label::label(&frame.radar, &mut cloud, &echoes, &bodies);
        Ok(())
    })?;
    sheet.count("points", cloud.len());
    drop((cube, found, cloud));

    (sheet.say)("  reference with phases of a quarter");
    let mut radar = frame.radar.clone();
    radar.thermal_noise = false;
    radar.chirps = LOOPS_COMPARED;
    radar.processing.doppler_fft = LOOPS_COMPARED;
    let (got, _) = map(engine, &frame, &radar, ACCURACY_DB)?;
    let (want, strongest) = map(engine, &frame, &radar, ACCURACY_DB / FINER)?;
    sheet.accuracy("accuracy_db", ACCURACY_DB);
    sheet.accuracy("map_relative_l2", relative_l2(got.data.iter().copied(), want.data.iter().copied()));
    compare(&mut sheet, &frame, &radar, &got, &want, &strongest);
    sheet.note(format!(
        "against the same frame with an accuracy {FINER} times stricter; maps without noise over {LOOPS_COMPARED} of {} loops{}; cells of the objects are those of their strongest echo",
        frame.radar.chirps,
        if moving { "" } else { ", which at rest are all alike" }
    ));
    Ok(sheet.finish())
}

/// Level in channel 0 (W) and cell of an object's strongest echo.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Strongest {
    power_w: f64,
    doppler: usize,
    range: usize,
}

/// The map of the frame at an accuracy; and the strongest echo of each object.
fn map(
    engine: &Engine,
    frame: &Frame,
    radar: &Radar,
    accuracy_db: f64,
) -> Result<(PowerMap<f64>, BTreeMap<u32, Strongest>)> {
    let levels = Levels::new(radar);
    let mut strongest = BTreeMap::new();
    let echoes = frame.echoes(engine, accuracy_db);
    for r in &echoes.list {
        let power_w = levels.amplitude(r).norm_sqr();
        let best = strongest.entry(r.object_id()).or_insert(Strongest { power_w: 0.0, doppler: 0, range: 0 });
        if power_w > best.power_w {
            let (doppler, range) = cell(radar, r);
            *best = Strongest { power_w, doppler, range };
        }
    }
    let (cube, _) = engine.cube(radar, &echoes, &[], 0, 0, Control::default())?;
    Ok((engine.range_doppler(radar, &cube)?.map, strongest))
}

/// (row, column) of an echo.
fn cell(radar: &Radar, r: &Echo) -> (usize, usize) {
    let rows = radar.processing.doppler_fft as f64;
    let bin = beat_frequency_hz(radar, r).abs() / radar.sample_rate_hz * radar.processing.range_fft as f64;
    let row = (r.range_rate_mps() / radar.velocity_bin_mps() + 0.5 * rows).round().rem_euclid(rows);
    (row as usize, bin.round().clamp(0.0, radar.range_bins() as f64 - 1.0) as usize)
}

/// Level changes of the objects' cells, by class.
fn compare(
    sheet: &mut Sheet<'_>,
    frame: &Frame,
    radar: &Radar,
    got: &PowerMap<f64>,
    want: &PowerMap<f64>,
    strongest: &BTreeMap<u32, Strongest>,
) {
    // A peak under the noise of a whole frame's cell is none: single precision alone may move it.
    let noise_w = Noise::thermal(&frame.radar, 0, 0)
        .map_or(0.0, |n| 2.0 * n.sigma * n.sigma / (frame.radar.samples * frame.radar.chirps) as f64);
    let mut classes: BTreeMap<&str, Vec<(f64, &str, f64)>> = BTreeMap::new();
    for (id, s) in strongest.iter().filter(|(_, s)| want.at(s.doppler, s.range) > noise_w) {
        if let Some(o) = frame.scene.object_by_id(*id) {
            let change = db_from_power(got.at(s.doppler, s.range) / want.at(s.doppler, s.range));
            classes.entry(&o.class).or_default().push((
                change,
                &o.name,
                s.range as f64 * radar.range_bin_m(),
            ));
        }
    }
    let mut all: Vec<f64> = classes.values().flatten().map(|c| c.0.abs()).collect();
    let within = |list: &[f64]| list.iter().filter(|c| **c <= 1.0).count();
    sheet.accuracy("objects", all.len());
    sheet.accuracy("objects_within_1_db", within(&all));
    sheet.accuracy("objects_within_0_1_db", all.iter().filter(|c| **c <= 0.1).count());
    sheet.accuracy("objects_worst_db", all.iter().copied().fold(0.0, f64::max));
    sheet.accuracy("objects_median_db", median(&mut all));
    let by_class: serde_json::Map<_, _> = classes
        .iter()
        .map(|(class, list)| {
            let mut sizes: Vec<f64> = list.iter().map(|c| c.0.abs()).collect();
            let worst = list.iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            let entry = json!({
                "objects": list.len(),
                "within_1_db": within(&sizes),
                "median_db": median(&mut sizes),
                "worst_db": worst.map(|w| w.0),
                "worst": worst.map(|w| format!("{} at {:.1} m", w.1, w.2)),
            });
            (class.to_string(), entry)
        })
        .collect();
    sheet.accuracy("classes", by_class);
}
