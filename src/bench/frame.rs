//! W3: one frame of a road from the scene to points, against the same frame with more rays.

use super::{Outcome, Settings, Sheet, median, relative_l2};
use crate::adc::synthesis::{Levels, beat_frequency_hz};
use crate::cpu::adc::synthesis::Control;
use crate::detect::points;
use crate::dsp::PowerMap;
use crate::dsp::doa_beamform::Beamformer;
use crate::engine::{AnyCube, Engine};
use crate::error::{Error, Result};
use crate::frames::{Pose, Sensor, World};
use crate::geom::Geometry;
use crate::road::w3::{self, EGO_SPEED_MPS, RADAR_HEIGHT_M};
use crate::scene::radar::Radar;
use crate::scene::{Scene, material, radar_toml};
use crate::trace::launch::{Cell, Fan};
use crate::trace::{Return, Returns, TraceOptions};
use crate::units::db_from_power;
use glam::{DQuat, DVec3};
use serde_json::json;
use std::collections::BTreeMap;

/// Rays of the contract.
pub const RAYS: u64 = 1 << 20;
/// Rays of the moving form on processors: every moving echo is summed at every sample of the cube.
const RAYS_MOVING_ON_A_PROCESSOR: u64 = 1 << 16;
const RAYS_QUICK: u64 = 1 << 16;
const RAYS_QUICK_MOVING: u64 = 1 << 13;
/// The reference cuts each tube into so many along both sides: sixteen times the rays.
const FINER: usize = 4;
/// Loops of the frames that are compared: the fewest that the detector's window allows.
const LOOPS_COMPARED: usize = 16;
/// Tubes of the reference that are followed together.
const CHUNK: usize = 1 << 20;

/// Scene, radar and geometry of W3.
pub struct Frame {
    pub scene: Scene,
    pub radar: Radar,
    pub geometry: Geometry,
    pub pose: Pose<Sensor, World>,
    pub ego_mps: DVec3,
}

impl Frame {
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

    pub fn fan(&self, rays: u64) -> Fan {
        Fan::cover(&self.geometry, &self.radar, &self.pose, rays)
    }

    pub fn returns(&self, engine: &Engine, fan: &Fan) -> Result<Returns> {
        engine.returns(&self.geometry, fan, &self.pose, self.ego_mps, &TraceOptions::default())
    }
}

pub(super) fn w3(
    moving: bool,
    engine: &Engine,
    settings: &Settings,
    mut sheet: Sheet<'_>,
) -> Result<Outcome> {
    let on_hardware = sheet.threads.is_none();
    let rays = settings.rays.unwrap_or(match (settings.quick, moving) {
        (true, false) => RAYS_QUICK,
        (true, true) => RAYS_QUICK_MOVING,
        (false, true) if !on_hardware => RAYS_MOVING_ON_A_PROCESSOR,
        (false, _) => RAYS,
    });
    let frame = Frame::new(moving)?;
    let f = frame.radar.carrier_hz;
    sheet.stage("geometry", || Geometry::build(&frame.scene, 0.0, f))?;
    let fan = sheet.stage("launch", || Ok(frame.fan(rays)))?;
    let returns = sheet.stage("trace", || frame.returns(engine, &fan))?;
    sheet.count("triangles", frame.geometry.triangles.len());
    sheet.count("rays_asked_for", rays);
    sheet.count("rays", returns.rays);
    sheet.count("returns", returns.returns.len());
    let seed = settings.seed;
    let (cube, front_end) =
        sheet.stage("synthesis", || engine.cube(&frame.radar, &returns, seed, 0, Control::default()))?;
    sheet.count("returns_moving", front_end.moving);
    sheet.count("returns_filtered_out", front_end.dropped);
    let found = sheet.stage("range_doppler", || engine.range_doppler(&frame.radar, &cube))?;
    sheet.count("cells", found.cells.len());
    let peaks = points::peaks(&frame.radar, &found);
    let beam = Beamformer::new(&frame.radar)?;
    let power = sheet.stage("beamforming", || engine.angular_power(&beam, &found.snapshots, &peaks.1))?;
    let cloud = sheet.stage("points", || {
        let detected = points::detected(&found, &peaks, &beam, &power);
        Ok(points::points(&frame.radar, &detected, &returns, &frame.scene.objects))
    })?;
    sheet.count("points", cloud.len());
    drop((cube, found, power, cloud));

    (sheet.say)(&format!("  reference with {} times the rays", FINER * FINER));
    let mut radar = frame.radar.clone();
    radar.thermal_noise = false;
    radar.chirps = LOOPS_COMPARED;
    radar.processing.doppler_fft = LOOPS_COMPARED;
    let (got, _) = map(engine, &frame, &radar, &fan, 1)?;
    let (want, strongest) = map(engine, &frame, &radar, &fan, FINER)?;
    sheet.accuracy("reference_rays", fan.cells.len() * FINER * FINER);
    sheet.accuracy("map_relative_l2", relative_l2(got.data.iter().copied(), want.data.iter().copied()));
    compare(&mut sheet, &frame, &radar, &got, &want, &strongest);
    sheet.note(format!(
        "against the same tubes cut into {FINER} x {FINER}; maps without noise over {LOOPS_COMPARED} of {} loops{}; cells of the objects are those of their strongest echo",
        frame.radar.chirps,
        if moving { "" } else { ", which at rest are all alike" }
    ));
    if moving && rays < RAYS {
        sheet.note(format!(
            "{rays} rays instead of {RAYS}: the synthesis sums every moving echo at every sample, so that its time \
             grows with the returns"
        ));
    }
    Ok(sheet.finish())
}

/// Level in channel 0 (W) and cell of an object's strongest echo.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Strongest {
    power_w: f64,
    doppler: usize,
    range: usize,
}

/// The cell cut into `n` x `n`.
fn cut(c: Cell, n: usize) -> impl Iterator<Item = Cell> {
    let (d_azimuth, d_sin) = (c.d_azimuth / n as f64, c.d_sin / n as f64);
    let at = move |i: usize| i as f64 - 0.5 * (n as f64 - 1.0);
    (0..n * n).map(move |i| Cell {
        azimuth: c.azimuth + at(i % n) * d_azimuth,
        sin_elevation: c.sin_elevation + at(i / n) * d_sin,
        d_azimuth,
        d_sin,
    })
}

/// The map of a fan whose tubes are cut into `n` x `n`, followed in parts so that any number of rays fits
/// the memory; and the strongest echo of each object.
fn map(
    engine: &Engine,
    frame: &Frame,
    radar: &Radar,
    fan: &Fan,
    n: usize,
) -> Result<(PowerMap<f64>, BTreeMap<u32, Strongest>)> {
    let levels = Levels::new(radar);
    let mut strongest = BTreeMap::new();
    let mut sum: Option<AnyCube> = None;
    for cells in fan.cells.chunks(CHUNK / (n * n)) {
        let part = Fan { cells: cells.iter().flat_map(|c| cut(*c, n)).collect(), ..*fan };
        let returns = frame.returns(engine, &part)?;
        for r in &returns.returns {
            let power_w = levels.amplitude(r).norm_sqr();
            let best =
                strongest.entry(r.object_id()).or_insert(Strongest { power_w: 0.0, doppler: 0, range: 0 });
            if power_w > best.power_w {
                let (doppler, range) = cell(radar, r);
                *best = Strongest { power_w, doppler, range };
            }
        }
        let (cube, _) = engine.cube(radar, &returns, 0, 0, Control::default())?;
        match (&mut sum, cube) {
            (None, cube) => sum = Some(cube),
            (Some(AnyCube::F32(s)), AnyCube::F32(c)) => {
                s.data.iter_mut().zip(c.data).for_each(|(s, c)| *s += c)
            }
            (Some(AnyCube::F64(s)), AnyCube::F64(c)) => {
                s.data.iter_mut().zip(c.data).for_each(|(s, c)| *s += c)
            }
            _ => return Err(Error::Failed("cubes of two precisions".into())),
        }
    }
    let cube = sum.ok_or_else(|| Error::Failed("no rays".into()))?;
    Ok((engine.range_doppler(radar, &cube)?.map, strongest))
}

/// (row, column) of an echo.
fn cell(radar: &Radar, r: &Return) -> (usize, usize) {
    let rows = radar.processing.doppler_fft as f64;
    let bin = beat_frequency_hz(radar, r) / radar.sample_rate_hz * radar.processing.range_fft as f64;
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
    let mut classes: BTreeMap<&str, Vec<(f64, &str, f64)>> = BTreeMap::new();
    for (id, s) in strongest {
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
