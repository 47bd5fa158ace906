//! Where the beams of frames are followed: on the engine's device, or on the host.

use super::{Engine, reach};
use crate::adc::budget::{power_w, unpolarised_w};
use crate::base::convention::Convention;
use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::units::{power_from_db, wavenumber};
use crate::geom::Geometry;
use crate::geom::edge_table::EdgeTable;
use crate::gpu::Gpu;
use crate::scene::radar::Radar;
use crate::trace::beams::Frame;
use crate::trace::cpu::echoes::FrameBeams;
use crate::trace::cpu::shine::clip_shining;
use crate::trace::cpu::{echoes, volume};
use crate::trace::line_tracer::{self, Followed, Sight};
use crate::trace::tracing::Tracing;
use crate::trace::view_clipper::{self, Beams, Traced};
use crate::trace::windows::windows;
use crate::trace::{Echoes, TraceOptions, merge};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

impl Engine {
    /// Where beams of frames are followed.
    pub fn tracing(&self) -> Tracing {
        match self {
            Engine::Gpu(gpu) if gpu.traces_on_host() => Tracing::Host,
            Engine::Gpu(gpu) if gpu.traces_by_lines() => Tracing::Lines,
            Engine::Gpu(_) => Tracing::Device,
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
            (Engine::Cpu(_), Tracing::Device | Tracing::Lines) => {
                Err(BadInput::new("the cpu engine has no device that traces")
                    .key("trace")
                    .value(tracing.word())
                    .allowed("host on the cpu engine")
                    .remedy("select an adapter (--device gpu, or part of its name), or trace on the host")
                    .into())
            }
            (Engine::Gpu(gpu), tracing) => {
                let gpu = gpu.with_tracing_on_host(tracing == Tracing::Host);
                Ok(Engine::Gpu(Box::new(gpu.with_lines(tracing == Tracing::Lines))))
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
    ///
    /// # Example
    /// A point 30 m in front of a radar that drives towards it at 10 m/s: an echo with a path of 60 m that gets
    /// shorter by 20 m every second.
    ///
    /// ```
    /// use catseye::base::frames::Pose;
    /// use catseye::engine::{Engine, Precision};
    /// use catseye::geom::Geometry;
    /// use catseye::scene::{Scene, Shape, radar_toml::preset};
    /// use catseye::trace::TraceOptions;
    /// use glam::{DQuat, DVec3};
    ///
    /// let radar = preset("demo77")?;
    /// let mut scene = Scene::default();
    /// let pose = Pose::new(DQuat::IDENTITY, DVec3::new(30.0, 0.0, 0.0));
    /// let id = scene.add_object("post", "post", Shape::Point { rcs_dbsm: 0.0 }, pose, DVec3::ZERO);
    /// let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
    /// let (velocity_mps, options) = (DVec3::new(10.0, 0.0, 0.0), TraceOptions::default());
    /// let engine = Engine::open("cpu", Precision::F32)?;
    /// let echoes = engine.trace(&geometry, &radar, &Pose::IDENTITY, velocity_mps, &options)?;
    /// assert_eq!((echoes.list.len(), echoes.list[0].object_id()), (1, id));
    /// let echo = &echoes.list[0];
    /// assert!((echo.path_length_m - 60.0).abs() < 1e-9 && (echo.range_rate_mps() + 10.0).abs() < 1e-9);
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn trace(
        &self,
        geometry: &Geometry,
        radar: &Radar,
        pose: &Pose<Sensor, World>,
        velocity_mps: DVec3,
        options: &TraceOptions,
    ) -> Result<Echoes> {
        let look = Look { geometry, radar, pose: *pose, velocity_mps, options: *options };
        let made = self.trace_all(&[look]).pop();
        made.unwrap_or_else(|| Err(Error::Failed("no frame was traced".into())))
    }

    /// [`Engine::trace`] of many frames, to the bit as each alone and in their order. Those whose beams the device follows share its
    /// submissions.
    ///
    /// # Errors
    /// Each frame has the error of [`Engine::trace`].
    pub fn trace_all(&self, looks: &[Look<'_>]) -> Vec<Result<Echoes>> {
        let gpu = match self {
            Engine::Gpu(gpu) if self.tracing() != Tracing::Host => &**gpu,
            _ => return looks.par_iter().map(|look| Ok(self.echoes_of(look))).collect(),
        };
        match traced_together(gpu, looks) {
            Ok(all) => all.into_iter().map(Ok).collect(),
            Err(e) if looks.len() == 1 => vec![Err(e)],
            // An error is that of a frame.
            Err(_) => looks.iter().flat_map(|look| self.trace_all(std::slice::from_ref(look))).collect(),
        }
    }

    fn echoes_of(&self, look: &Look<'_>) -> Echoes {
        self.echoes(look.geometry, look.radar, &look.pose, look.velocity_mps, &look.options)
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
        let look = Look { geometry, radar, pose: *pose, velocity_mps, options: *options };
        let mut bounces = options.bounces;
        loop {
            let options = look.options_to(bounces);
            let mut all = echoes::echoes(geometry, &windows, pose, velocity_mps, &options);
            look.reckon_powers(&mut all);
            if look.is_deep_enough(&all) {
                look.complete(&mut all);
                return all;
            }
            bounces = all.bounces + 1;
        }
    }
}

/// Echoes of frames whose beams the device follows together, one bounce deeper where what the limit of bounces cuts off would show.
fn traced_together(gpu: &Gpu, looks: &[Look<'_>]) -> Result<Vec<Echoes>> {
    let all_windows: Vec<Vec<Frame>> = looks.par_iter().map(|look| windows(look.radar, &look.pose)).collect();
    let mut frames = Together {
        made: looks.iter().map(|_| None).collect(),
        refused: vec![None; looks.len()],
        bounces: looks.iter().map(|look| look.options.bounces).collect(),
    };
    loop {
        let left: Vec<usize> = (0..looks.len()).filter(|i| frames.made[*i].is_none()).collect();
        if left.is_empty() {
            return Ok(frames.made.into_iter().flatten().collect());
        }
        let options: Vec<TraceOptions> =
            left.iter().map(|i| looks[*i].options_to(frames.bounces[*i])).collect();
        let beams = left.par_iter().zip(&options);
        let made_beams = || -> Vec<FrameBeams<'_>> {
            let beams =
                beams.map(|(i, o)| FrameBeams::new(looks[*i].geometry, looks[*i].pose.translation_m, o));
            beams.collect()
        };
        // A frame that was refused is not tried again with more bounces: its echoes come from one clipper.
        let able = |i: usize| frames.refused[i].is_none() && looks[i].options.convention != Convention::Last;
        let most = left.iter().zip(&options).filter(|(i, _)| able(**i)).map(|(_, o)| o.bounces).max();
        // The device compiles while the host prepares the scenes.
        let kernels = match most {
            None => &[],
            Some(_) if gpu.traces_by_lines() => line_tracer::kernels(),
            Some(most) => view_clipper::kernels(most),
        };
        let (ready, beams) = rayon::join(|| gpu.prepare(kernels), made_beams);
        ready?;
        if gpu.traces_by_lines() {
            let able: Vec<bool> = left.iter().map(|i| able(*i)).collect();
            let of_left: Vec<&Look<'_>> = left.iter().map(|i| &looks[*i]).collect();
            let windows: Vec<&[Frame]> = left.iter().map(|i| &all_windows[*i][..]).collect();
            let new = traced_by_lines(gpu, &of_left, &windows, &options, &beams, &able)?;
            frames.keep(looks, &left, new);
            continue;
        }
        let on_device = left.iter().zip(&beams).filter(|(i, _)| able(**i)).map(|(i, beams)| Beams {
            faces: beams.faces(),
            windows: &all_windows[*i],
            options: &beams.options,
            ends: beams.ends,
        });
        let mut traced = view_clipper::clip_all(gpu, &on_device.collect::<Vec<_>>())?.into_iter();
        let traced: Vec<Option<Traced>> =
            left.iter().map(|i| if able(*i) { traced.next() } else { None }).collect();
        let new =
            (left.par_iter().zip(&options).zip(&beams).zip(traced)).map(|(((i, options), beams), traced)| {
                let look = &looks[*i];
                let (clipped, why) = match traced {
                    Some(Traced::Whole(clipped)) => (clipped, None),
                    other => {
                        let why = if let Some(Traced::Refused(why)) = other { Some(why) } else { None };
                        let (faces, windows) = (beams.faces(), &all_windows[*i]);
                        (clip_shining(faces, windows, &beams.options, beams.ends, beams.shine), why)
                    }
                };
                let mut all = beams.echoes(clipped, &look.pose, look.velocity_mps, options);
                look.reckon_powers(&mut all);
                (all, why)
            });
        let new = new.collect();
        frames.keep(looks, &left, new);
    }
}

/// Echoes of a frame, and why the device left it to the host.
type Made = (Echoes, Option<&'static str>);

/// Frames that are traced together.
struct Together {
    made: Vec<Option<Echoes>>,
    refused: Vec<Option<&'static str>>,
    bounces: Vec<usize>,
}

impl Together {
    /// Keeps the echoes of some frames where they are followed deep enough, and follows the others one bounce deeper.
    fn keep(&mut self, looks: &[Look<'_>], left: &[usize], new: Vec<Made>) {
        for (i, (mut all, why)) in left.iter().copied().zip(new) {
            self.refused[i] = self.refused[i].or(why);
            let look = &looks[i];
            if look.is_deep_enough(&all) {
                let on_device = self.refused[i].is_none() && look.options.convention != Convention::Last;
                (all.on_device, all.fallback) = (on_device, self.refused[i].map(Cow::Borrowed));
                self.made[i] = Some(all);
            } else {
                self.bounces[i] = all.bounces + 1;
            }
        }
        looks.par_iter().zip(&mut self.made).enumerate().for_each(|(i, (look, made))| {
            if let (Some(all), true) = (made, left.contains(&i)) {
                look.complete(all);
            }
        });
    }
}

/// Echoes of frames of which the device follows those that it is able to, by lines; and why it left a frame to the host.
fn traced_by_lines(
    gpu: &Gpu,
    looks: &[&Look<'_>],
    windows: &[&[Frame]],
    options: &[TraceOptions],
    beams: &[FrameBeams<'_>],
    able: &[bool],
) -> Result<Vec<Made>> {
    let tables: Vec<Option<EdgeTable>> =
        beams.par_iter().zip(able).map(|(beams, able)| able.then(|| EdgeTable::new(beams.faces()))).collect();
    let sights: Vec<Sight<'_>> = (beams.iter().zip(windows).zip(&tables))
        .filter_map(|((beams, windows), table)| {
            let (faces, options) = (beams.faces(), &beams.options);
            Some(Sight { faces, table: table.as_ref()?, windows, options })
        })
        .collect();
    let mut followed = line_tracer::follow_all(gpu, &sights)?.into_iter();
    let followed: Vec<Option<Followed>> =
        able.iter().map(|able| if *able { followed.next() } else { None }).collect();
    let all = looks.par_iter().zip(windows).zip(options).zip(beams).zip(followed);
    let echoes = all.map(|((((look, windows), options), beams), followed)| {
        let (mut all, why) = match followed {
            Some(Followed::Whole(chains)) => {
                (beams.echoes_from_lines(chains, windows, &look.pose, look.velocity_mps, options), None)
            }
            other => {
                let why = if let Some(Followed::Refused(why)) = other { Some(why) } else { None };
                let clipped = clip_shining(beams.faces(), windows, &beams.options, beams.ends, beams.shine);
                (beams.echoes(clipped, &look.pose, look.velocity_mps, options), why)
            }
        };
        look.reckon_powers(&mut all);
        (all, why)
    });
    Ok(echoes.collect())
}

/// Reckons the power of a frame's echoes, and of what one bounce more would bring, as this radar receives them, where the options ask for it.
pub(crate) fn reckon_powers(radar: &Radar, options: &TraceOptions, all: &mut Echoes) {
    if options.least_cut.is_some() {
        all.power_w = power_w(radar, &all.list);
        all.cut_power_w = unpolarised_w(radar, &all.cut);
    }
}

/// Whether what the limit of bounces cuts off does not show, or no deeper limit is allowed.
pub(crate) fn is_deep_enough(options: &TraceOptions, all: &Echoes) -> bool {
    let bearable = power_from_db(options.accuracy_db) - 1.0;
    all.bounces >= options.most_bounces || all.cut_power_w <= bearable * all.power_w
}

/// A radar that looks at a scene.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// The scene at the middle of the frame.
    pub geometry: &'a Geometry,
    /// The radar.
    pub radar: &'a Radar,
    /// Where it is.
    pub pose: Pose<Sensor, World>,
    /// Its velocity in the world, m/s.
    pub velocity_mps: DVec3,
    /// What to follow and what to keep.
    pub options: TraceOptions,
}

impl Look<'_> {
    /// The same options for so many bounces, within the reach of the radar.
    fn options_to(&self, bounces: usize) -> TraceOptions {
        let rate_mps = reach::fastest_path_mps(self.geometry, self.velocity_mps, bounces);
        let reach_m = self.options.reach_m.min(reach::reach_m(self.radar, rate_mps));
        TraceOptions { reach_m, bounces, ..self.options }
    }

    fn reckon_powers(&self, all: &mut Echoes) {
        reckon_powers(self.radar, &self.options, all);
    }

    fn is_deep_enough(&self, all: &Echoes) -> bool {
        is_deep_enough(&self.options, all)
    }

    /// Adds what the air returns, takes away what it weakens, and adds up echoes of one place.
    fn complete(&self, all: &mut Echoes) {
        let Look { geometry, radar, pose, velocity_mps, options } = self;
        if let Some(air) = &options.air {
            all.list.extend(volume::echoes(geometry, radar, pose, *velocity_mps, air, options));
            air.attenuate(&mut all.list);
        }
        if options.merge {
            all.merged = merge::merge(&mut all.list, wavenumber(geometry.freq_hz), geometry.reach_s);
        }
    }
}
