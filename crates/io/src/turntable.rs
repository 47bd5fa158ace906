//! A simulated turntable run: a corner reflector at a fixed distance, with the radar turned from angle to
//! angle, through synthesis and both transforms to a calibration (Feng 2019, section 2.2.4).

use catseye::base::control::Control;
use catseye::base::error::{BadInput, Result};
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::wavenumber;
use catseye::detect::points;
use catseye::dsp::doa_calibration::{Calibration, TurntableOptions};
use catseye::dsp::doa_manifold::Manifold;
use catseye::dsp::multiplex::decode;
use catseye::engine::Engine;
use catseye::geom::{Geometry, curved};
use catseye::scene::Scene;
use catseye::scene::radar::{Cfar, CfarKind, Radar};
use catseye::scene::waveform::Multiplex;
use catseye::trace::TraceOptions;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Position of the reflector, and the angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Turntable {
    /// Distance of the reflector, m.
    pub range_m: f64,
    /// Azimuths of the reflector in the sensor's frame, ascending, degrees.
    pub azimuth_deg: Vec<f64>,
    /// Elevations of the reflector in the sensor's frame, degrees.
    pub elevation_deg: Vec<f64>,
    /// Seed of the noise.
    pub seed: u64,
    /// Options of the measurement.
    pub options: TurntableOptions,
}

/// Number of chirps of one position, as nothing moves.
const CHIRPS: usize = 16;

/// Measures the calibration of `radar` with its front end and noise as they are. `target` is turned so that
/// its x axis points at the radar, with its origin `range_m` away. `watch` is called after each angle.
///
/// # Errors
/// Returns an error for a reflector that is not seen or nearer than the array is long, and the errors of
/// [`Calibration::from_turntable`].
pub fn run(
    engine: &Engine,
    radar: &Radar,
    target: &Scene,
    table: &Turntable,
    watch: &mut dyn FnMut(),
) -> Result<Calibration> {
    for (key, axis) in [("azimuth_deg", &table.azimuth_deg), ("elevation_deg", &table.elevation_deg)] {
        if axis.is_empty() || !axis.windows(2).all(|w| w[0] < w[1]) {
            return Err(BadInput::new("the angles of a turntable must ascend")
                .key(key)
                .remedy("sort them")
                .into());
        }
    }
    let longest = radar.tx.iter().chain(&radar.rx).map(|a| a.position_m.length()).fold(0.0, f64::max);
    if !(table.range_m > 4.0 * longest && table.range_m < radar.max_range_m()) {
        return Err(BadInput::new("the distance of the reflector is out of range")
            .key("range_m")
            .value(table.range_m)
            .allowed(format!("above {:.3}, below {:.1}", 4.0 * longest, radar.max_range_m()))
            .into());
    }
    let mut short = radar.part(0);
    let bands = match radar.multiplex {
        Multiplex::Ddm { bands } => bands,
        _ => 1,
    };
    short.chirps = CHIRPS.next_multiple_of(bands);
    short.processing.doppler_fft = short.chirps;
    short.processing.remove_static = false;
    short.processing.keystone = false;
    // Whatever detector the radar has: the reflector stands out by far.
    let bins = short.range_bins();
    let guard = 2.min(bins.saturating_sub(1) / 4);
    let train = 16.min((bins.saturating_sub(1) / 2).saturating_sub(guard)).max(1);
    short.processing.cfar =
        Cfar { kind: CfarKind::Ca, guard: [0, guard], train: [0, train], pfa: radar.processing.cfar.pfa };
    // The reflector at the origin of the world, looking along -x at a radar that stands there.
    let mut scene = target.clone();
    let turn: Pose<World, World> =
        Pose::from_yaw_pitch_roll(DVec3::new(table.range_m, 0.0, 0.0), PI, 0.0, 0.0);
    for o in &mut scene.objects {
        o.pose = Pose::new(turn.rotation * o.pose.rotation, turn.point(o.pose.translation_m));
    }
    let sagitta_m = curved::sagitta_m(0.2, wavenumber(radar.carrier_hz));
    let geometry = Geometry::build(&*curved::refined_scene(&scene, sagitta_m)?, 0.0, radar.carrier_hz)?;
    let options = TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() };
    let reach = 2.0 + 0.01 * table.range_m;
    let mut snapshots = Vec::with_capacity(table.azimuth_deg.len() * table.elevation_deg.len());
    for e in &table.elevation_deg {
        for a in &table.azimuth_deg {
            // The radar turned so that +x of the world lies at (a, e) of its own frame.
            let pose: Pose<Sensor, World> = Pose::new(
                (glam::DQuat::from_rotation_z(a.to_radians())
                    * glam::DQuat::from_rotation_y(-e.to_radians()))
                .inverse(),
                DVec3::ZERO,
            );
            let returns = engine.trace(&geometry, &short, &pose, DVec3::ZERO, &options)?;
            let frame = snapshots.len() as u32;
            let (cube, _) = engine.cube(&short, &returns, &[], table.seed, frame, Control::default())?;
            let found = engine.range_doppler(&short, &cube)?;
            let near = |i: &usize| {
                let r = points::range_m(&short, found.cells[*i].range as f64, 0.0, 0.0);
                (r - table.range_m).abs() < reach
            };
            let Some(at) = (0..found.cells.len()).find(near) else {
                return Err(BadInput::new("the reflector is not detected")
                    .key(format!("azimuth {a} deg, elevation {e} deg"))
                    .remedy("move the reflector nearer, use a larger one, or reduce the angles")
                    .into());
            };
            let snapshot: Vec<Complex64> = found.snapshots.of(at).to_vec();
            snapshots.push(decode(&short, &snapshot, 0.0).channels);
            watch();
        }
    }
    Calibration::from_turntable(
        &Manifold::of_radar(radar)?,
        table.azimuth_deg.clone(),
        table.elevation_deg.clone(),
        Some(table.range_m),
        &snapshots,
        &table.options,
    )
}
