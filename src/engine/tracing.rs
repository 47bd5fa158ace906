//! Where the beams of frames are followed: on the engine's device, or on the host.

use super::{Engine, reach};
use crate::adc::budget::{power_w, unpolarised_w};
use crate::base::convention::Convention;
use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::units::{power_from_db, wavenumber};
use crate::geom::Geometry;
use crate::geom::faces::Faces;
use crate::gpu::Gpu;
use crate::scene::radar::Radar;
use crate::trace::beams::{BeamOptions, Frame};
use crate::trace::cpu::beams::{self, Ends};
use crate::trace::cpu::{echoes, volume};
use crate::trace::tracing::Tracing;
use crate::trace::view_clipper::{self, Traced};
use crate::trace::windows::windows;
use crate::trace::{Echoes, TraceOptions, merge};
use glam::DVec3;
use std::cell::Cell;

impl Engine {
    /// Where beams of frames are followed.
    pub fn tracing(&self) -> Tracing {
        match self {
            Engine::Gpu(gpu) if !gpu.traces_on_host() => Tracing::Device,
            _ => Tracing::Host,
        }
    }

    /// The same engine, which follows the beams of frames there. The gpu engine takes its device where nothing is said; the host is faster
    /// than a software driver.
    ///
    /// # Errors
    /// Returns an error for the device of a cpu engine, which has none.
    pub fn with_tracing(self, tracing: Tracing) -> Result<Engine> {
        match (self, tracing) {
            (Engine::Cpu(_), Tracing::Device) => Err(BadInput::new(
                "the cpu engine has no device that traces",
            )
            .key("trace")
            .value("device")
            .allowed("host on the cpu engine")
            .remedy("name an adapter by the device (--device gpu, or part of its name), or trace on the host")
            .into()),
            (Engine::Gpu(gpu), tracing) => {
                Ok(Engine::Gpu(Box::new(gpu.with_tracing_on_host(tracing == Tracing::Host))))
            }
            (cpu, Tracing::Host) => Ok(cpu),
        }
    }

    /// Echoes of a frame at the radar's pose, moving with `velocity_mps` (world), with its beams followed where [`Engine::tracing`] says.
    /// What lies so far that `radar` cannot hear it is left out.
    ///
    /// The device has no way for [`Convention::Last`], which takes the host. What else the device refuses takes the host too, and
    /// [`Echoes::fallback`] says why.
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn trace(
        &self,
        geometry: &Geometry,
        radar: &Radar,
        pose: &Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Result<Echoes> {
        let able = options.convention != Convention::Last;
        let gpu = match self {
            Engine::Gpu(gpu) if able && self.tracing() == Tracing::Device => &**gpu,
            _ => return Ok(self.echoes(geometry, radar, pose, velocity_mps, options)),
        };
        let windows = windows(radar, pose);
        let refused = Cell::new(None);
        let of = |options: &TraceOptions| {
            let clip = |faces: &Faces, beams: &BeamOptions, ends: Option<Ends<'_>>| {
                clipped(gpu, &refused, faces, &windows, beams, ends)
            };
            echoes::echoes_by(geometry, clip, pose, velocity_mps, options)
        };
        let mut all = deep_enough(geometry, radar, velocity_mps, options, of)?;
        (all.on_device, all.fallback) = (refused.get().is_none(), refused.get());
        complete(&mut all, geometry, radar, pose, velocity_mps, options);
        Ok(all)
    }

    /// [`Engine::trace`] on the host in f64, whatever the engine is and whatever [`Engine::tracing`] says: the truth beside which the device
    /// stands, and what closed forms are held against.
    pub fn echoes(
        &self,
        geometry: &Geometry,
        radar: &Radar,
        pose: &Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Echoes {
        let windows = windows(radar, pose);
        let of = |options: &TraceOptions| {
            Ok::<_, std::convert::Infallible>(echoes::echoes(geometry, &windows, pose, velocity_mps, options))
        };
        let mut all = match deep_enough(geometry, radar, velocity_mps, options, of) {
            Ok(all) => all,
            Err(never) => match never {},
        };
        complete(&mut all, geometry, radar, pose, velocity_mps, options);
        all
    }
}

/// What beams meet by the device; by the host in f64 once `refused` holds a reason, which the device gives here.
fn clipped(
    gpu: &Gpu,
    refused: &Cell<Option<&'static str>>,
    faces: &Faces,
    windows: &[Frame],
    beams: &BeamOptions,
    ends: Option<Ends<'_>>,
) -> Result<beams::Clipped, Error> {
    // A frame that was refused is not tried again with more bounces: its echoes come from one clipper.
    if refused.get().is_none() {
        match view_clipper::clip_windows(gpu, faces, windows, beams, ends)? {
            Traced::Whole(clipped) => return Ok(clipped),
            Traced::Refused(why) => refused.set(Some(why)),
        }
    }
    Ok(beams::clip_windows(faces, windows, beams, ends))
}

/// Echoes by `of` within the reach of the radar, one bounce deeper as long as what the limit of bounces cuts off would show.
fn deep_enough<E>(
    geometry: &Geometry,
    radar: &Radar,
    velocity_mps: DVec3,
    options: &TraceOptions,
    of: impl Fn(&TraceOptions) -> Result<Echoes, E>,
) -> Result<Echoes, E> {
    let of_depth = |bounces: usize| {
        let rate_mps = reach::fastest_path_mps(geometry, velocity_mps, bounces);
        let reach_m = options.reach_m.min(reach::reach_m(radar, rate_mps));
        let mut all = of(&TraceOptions { reach_m, bounces, ..*options })?;
        if options.least_cut.is_some() {
            all.power_w = power_w(radar, &all.list);
            all.cut_power_w = unpolarised_w(radar, &all.cut);
        }
        Ok(all)
    };
    let mut all = of_depth(options.bounces)?;
    let bearable = power_from_db(options.accuracy_db) - 1.0;
    while all.bounces < options.most_bounces && all.cut_power_w > bearable * all.power_w {
        all = of_depth(all.bounces + 1)?;
    }
    Ok(all)
}

/// Adds what the air returns, takes away what it weakens, and adds up echoes of one place.
fn complete(
    all: &mut Echoes,
    geometry: &Geometry,
    radar: &Radar,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) {
    if let Some(air) = &options.air {
        all.list.extend(volume::echoes(geometry, radar, pose, velocity_mps, air, options));
        air.attenuate(&mut all.list);
    }
    if options.merge {
        all.merged = merge::merge(&mut all.list, wavenumber(geometry.freq_hz), geometry.reach_s);
    }
}
