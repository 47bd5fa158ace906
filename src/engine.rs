//! The only place that chooses between the engines: every stage of the chain once, on whichever was
//! opened.

mod auto;
mod chain;
pub mod devices;
pub mod memory;
pub mod reach;
pub mod solver;
mod stage;
pub mod stages;
pub mod sweep;
mod tracing;

pub use crate::trace::tracing::Tracing;
pub use auto::Purpose;
pub use chain::{FrameInput, MadeFrame};
pub use stage::{Extent, Stage, StageCounts};
pub use tracing::Look;
pub(crate) use tracing::{is_deep_enough, reckon_powers};

use crate::adc::{self, Cube};
use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::direction_from_angles;
use crate::base::matrix;
use crate::base::units::{power_from_db, wavenumber};
use crate::dsp;
use crate::geom::convex::is_convex;
use crate::geom::dielectrics::{self, Obstacle};
use crate::geom::{Geometry, Surface, curved, edges, overlaps, surfaces_at};
use crate::gpu::{Gpu, GpuCounts, Kernel, Profile, Want, adapters, selftest};
use crate::rcs::cpu::beam_sum::{self, FrequencyPoint};
use crate::rcs::cpu::ptd;
use crate::rcs::{
    self, Aspect, BistaticAspect, Diffraction, Distance, Impassable, RayGrid, RcsOptions, Scattering, po_sum,
};
use crate::scene::Scene;
use crate::trace::beams::BeamOptions;
use crate::trace::cpu::refract::Media;
use crate::trace::{
    beam_ahead, beam_clip, closest, line_ahead, line_gather, line_shadow, line_sides, line_split, scan,
};
use crate::trace::{view_ahead, view_gather, view_hide, view_target};
use rayon::prelude::*;

/// The row of every shader in `shaders/`.
pub fn all_kernels() -> Vec<&'static Kernel> {
    vec![
        &selftest::KERNEL,
        &closest::KERNEL,
        &scan::KERNEL,
        &beam_clip::KERNEL,
        &beam_ahead::KERNEL,
        &view_target::KERNEL,
        &view_hide::KERNEL,
        &view_gather::KERNEL,
        &line_ahead::KERNEL,
        &line_split::KERNEL,
        &line_sides::KERNEL,
        &line_shadow::KERNEL,
        &line_gather::KERNEL,
        &view_ahead::KERNEL,
        &po_sum::KERNEL,
        &rcs::beam_sum::KERNEL,
        &adc::synthesis::KERNEL,
        &adc::grid_spread::KERNEL,
        &adc::grid_fft::KERNEL,
        &adc::grid_lines::KERNEL,
        &adc::noise::KERNEL,
        &adc::convert::KERNEL,
        &dsp::keystone::KERNEL,
        &dsp::zero_doppler::KERNEL,
        &dsp::fft::KERNEL,
        &dsp::fft_any::KERNEL,
        &dsp::fft_radix8::KERNEL,
        &dsp::fft_radix16::KERNEL,
        &dsp::fft_chirp::KERNEL,
        &dsp::power::KERNEL,
        &dsp::cfar_ca::KERNEL,
        &dsp::cfar_go_so::KERNEL,
        &dsp::cfar_os::KERNEL,
        &dsp::cfar_noise::KERNEL,
        &dsp::peaks::KERNEL,
        &dsp::snapshot::KERNEL,
        &dsp::doa_beamform::KERNEL,
        &dsp::doa_spectrum::KERNEL,
    ]
}

/// Precision of cube, FFT and detection on the cpu engine; geometry, phase and fields are always f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Double precision.
    F64,
}

/// An engine that is ready to work.
pub enum Engine {
    /// This machine's processor.
    Cpu(Precision),
    /// An adapter through wgpu.
    Gpu(Box<Gpu>),
}

/// What the manifest says about the engine.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EngineReport {
    /// `cpu` or `gpu`.
    pub engine: &'static str,
    /// Precision of cube, transforms and detection.
    pub precision: Precision,
    /// "cpu" or the adapter's name.
    pub adapter: String,
    /// Driver of the adapter, empty on the cpu.
    pub driver: String,
    /// Version of the driver, empty on the cpu.
    pub driver_info: String,
    /// Where the beams of frames are followed.
    pub trace: Tracing,
}

/// A cube in the precision of its engine.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyCube {
    /// In single precision.
    F32(Cube<f32>),
    /// In double precision.
    F64(Cube<f64>),
}

impl AnyCube {
    /// The cube in single precision.
    pub fn into_f32(self) -> Cube<f32> {
        match self {
            AnyCube::F32(c) => c,
            AnyCube::F64(c) => c.to_f32(),
        }
    }
}

/// Looks between two reports of progress on the cpu engine, and at least on a device.
const ASPECTS_PER_BATCH: usize = 1024;
/// On a device, which is waited for six times in each batch: looks between two reports at most, and so many pairs of looks and faces where that
/// is fewer.
const ASPECTS_ON_DEVICE: [usize; 2] = [1 << 14, 1 << 18];

/// Whether paths of several bounces may touch curved surfaces, which the host follows, whatever the engine is.
pub(crate) fn takes_host(scene: &Scene, bounces: usize) -> bool {
    bounces > 1 && scene.meshes.iter().any(curved::has_curved) && !is_convex(scene)
}

impl Engine {
    /// Looks between two reports of progress of a sweep over so many faces.
    fn aspects_per_batch(&self, faces: usize) -> usize {
        let [most, times_faces] = ASPECTS_ON_DEVICE;
        match self {
            Engine::Cpu(_) => ASPECTS_PER_BATCH,
            Engine::Gpu(_) => (times_faces / faces.max(1)).clamp(ASPECTS_PER_BATCH, most),
        }
    }
}

fn not_a_number(aspect: &Aspect) -> Error {
    Error::Failed(format!(
        "the cross section at azimuth {:.4} deg, elevation {:.4} deg is not a number",
        aspect.azimuth.to_degrees(),
        aspect.elevation.to_degrees()
    ))
}

/// The material of a face through which waves pass at one of the frequencies, if there is any.
fn passed(geometry: &Geometry, frequencies: &[FrequencyPoint]) -> Option<String> {
    let faces = geometry.faces();
    frequencies.iter().find_map(|t| {
        let media = Media::of(faces, t.surfaces, t.wavenumber)?;
        let face = faces.faces.iter().find(|f| media.passes(f))?;
        Some(geometry.materials[face.surface as usize].name.clone())
    })
}

/// S of a sphere that waves enter, by its series; None where no curved body is entered.
///
/// # Errors
/// Returns an error for any other curved body that waves enter: waves inside it are not followed.
pub(crate) fn curved_dielectric(
    scene: &Scene,
    frequencies_hz: &[f64],
    surfaces: &[Vec<Surface>],
    aspects: &[BistaticAspect],
    options: &RcsOptions,
) -> Result<Option<Vec<Scattering>>> {
    let mut out = Vec::with_capacity(frequencies_hz.len() * aspects.len());
    let mut entered = 0;
    for (f, surfaces) in frequencies_hz.iter().zip(surfaces) {
        let mut doubts = dielectrics::doubts(scene, surfaces, wavenumber(*f));
        doubts.retain(|d| matches!(d.obstacle, Obstacle::Curved { .. }));
        let Some(first) = doubts.first() else { continue };
        entered += 1;
        let bad = |problem: String| {
            let name = &scene.objects[first.object].name;
            BadInput::new(problem).key(format!("object '{name}'"))
        };
        let series = match dielectrics::lone_sphere(scene, &doubts) {
            Some((centre, radius_m, material)) => {
                rcs::sphere::series(&surfaces[material as usize], radius_m, *f)?.map(|s| (s, centre))
            }
            None => None,
        };
        let Some((series, centre)) = series else {
            return Err(bad(first.line(scene))
                .allowed("one sphere alone, by its series (Mie)")
                .remedy("use flat faces or a metal, or model a thin wall as a layer on 'air'")
                .into());
        };
        if let Distance::At(range_m) = options.distance {
            return Err(bad(
                "a sphere that waves enter is computed with its series, which holds for plane waves only"
                    .into(),
            )
            .key("range_m")
            .value(range_m)
            .allowed("inf")
            .remedy("use a plane wave")
            .into());
        }
        out.extend(rcs::sphere::scattering(&series, centre, *f, aspects));
    }
    match entered {
        0 => Ok(None),
        n if n == frequencies_hz.len() => Ok((!aspects.is_empty()).then_some(out)),
        n => Err(BadInput::new("waves enter the sphere at some of these frequencies only")
            .key("frequency_hz")
            .value(format!("{n} of {}", frequencies_hz.len()))
            .allowed("frequencies at all of which it is opaque, or at none")
            .remedy("compute the frequencies in separate runs")
            .into()),
    }
}

/// The complaint about what waves pass through, made of `material`.
fn impassable(why: Impassable, material: &str, distance: Distance) -> Error {
    match why {
        Impassable::NoBody => {
            BadInput::new("waves inside cannot be traced: a body is not closed, it touches or contains another, or a sheet lies on or in it")
                .key(format!("bodies of '{material}'"))
                .remedy("weld its vertices, leave a gap to the other body, or give one of the two a metal")
                .into()
        }
        Impassable::NearPort => {
            let range_m = match distance {
                Distance::At(r) => r,
                Distance::Infinite => f64::INFINITY,
            };
            BadInput::new(format!("waves pass through objects of '{material}'"))
                .key("range_m")
                .value(range_m)
                .allowed("inf")
                .remedy("use a plane wave, or give the part a metal")
                .into()
        }
    }
}

impl Engine {
    /// `auto`: a hardware GPU, else the cpu; `cpu`; `gpu`: a hardware GPU or an error; anything else: the
    /// adapter that has it in its name.
    ///
    /// # Errors
    /// Returns an error if there is no such adapter or it fails its self-test, for `f64` with a GPU, or for limits of
    /// memory in which no work can begin.
    ///
    /// # Example
    /// The cpu engine needs no adapter and is the reference for the others. Shaders compute in f32, so f64 is the
    /// cpu's alone.
    ///
    /// ```
    /// use catseye::engine::{Engine, Precision};
    ///
    /// let engine = Engine::open("cpu", Precision::F64)?;
    /// assert_eq!(engine.report().engine, "cpu");
    /// assert!(engine.describe().starts_with("cpu"));
    /// assert!(Engine::open("no such adapter", Precision::F32).is_err());
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn open(device: &str, precision: Precision) -> Result<Engine> {
        crate::base::machine::check_limits()?;
        let gpu = match device {
            "cpu" => None,
            "auto" if precision == Precision::F64 => None,
            "auto" => match adapters().iter().any(|a| a.is_hardware) {
                true => Some(Gpu::open(Want::Hardware)?),
                false => None,
            },
            "gpu" => Some(Gpu::open(Want::Hardware)?),
            "" => {
                return Err(BadInput::new("no device is given")
                    .key("device")
                    .allowed("auto, cpu, gpu, part of an adapter's name")
                    .remedy("`catseye devices` lists the adapters")
                    .into());
            }
            name => Some(Gpu::open(Want::Named(name))?),
        };
        match gpu {
            None => Ok(Engine::Cpu(precision)),
            Some(_) if precision == Precision::F64 => Err(BadInput::new("a GPU computes in f32 only")
                .key("precision")
                .value("f64")
                .allowed("f32 on a gpu")
                .remedy("use --device cpu")
                .into()),
            Some(gpu) => Ok(Engine::Gpu(Box::new(gpu))),
        }
    }

    /// What the manifest says about it.
    pub fn report(&self) -> EngineReport {
        match self {
            Engine::Cpu(precision) => EngineReport {
                engine: "cpu",
                precision: *precision,
                adapter: "cpu".into(),
                driver: "rayon".into(),
                driver_info: format!("{} threads", rayon::current_num_threads()),
                trace: self.tracing(),
            },
            Engine::Gpu(gpu) => {
                let r = gpu.report();
                EngineReport {
                    engine: "gpu",
                    precision: Precision::F32,
                    adapter: r.name.clone(),
                    driver: r.driver.clone(),
                    driver_info: r.driver_info.clone(),
                    trace: self.tracing(),
                }
            }
        }
    }

    /// What the device's submissions did since it was opened; None for the cpu engine.
    pub fn device_counts(&self) -> Option<GpuCounts> {
        match self {
            Engine::Cpu(_) => None,
            Engine::Gpu(gpu) => Some(gpu.counts()),
        }
    }

    /// Time since the engine was opened in which its device had work, s; None for the cpu engine.
    pub fn device_busy_s(&self) -> Option<f64> {
        match self {
            Engine::Cpu(_) => None,
            Engine::Gpu(gpu) => Some(gpu.busy_seconds()),
        }
    }

    /// The same engine, which from now on counts and times the kernels of its device. The cpu engine has none.
    pub fn with_profiling(self) -> Engine {
        match self {
            Engine::Cpu(precision) => Engine::Cpu(precision),
            Engine::Gpu(gpu) => Engine::Gpu(Box::new(gpu.with_profiling())),
        }
    }

    /// What each kernel did since [`Engine::with_profiling`]; None without it and for the cpu engine.
    pub fn profile(&self) -> Option<Profile> {
        match self {
            Engine::Cpu(_) => None,
            Engine::Gpu(gpu) => gpu.profile(),
        }
    }

    /// One line for people: engine, adapter, driver.
    pub fn describe(&self) -> String {
        let r = self.report();
        match self {
            Engine::Cpu(_) => format!("cpu ({}, {:?})", r.driver_info, r.precision).to_lowercase(),
            Engine::Gpu(_) => {
                let beams = match r.trace {
                    Tracing::Host => "; beams on the host",
                    Tracing::Device => "",
                    Tracing::Lines => "; beams by lines",
                };
                format!("gpu: {} ({} {}){beams}", r.adapter, r.driver, r.driver_info)
            }
        }
    }

    /// S of the scene's objects by exact beams, phases referred to the world's origin, for each frequency
    /// and each aspect (`[frequency, aspect]`). What beams meet does not depend on frequency and is found once.
    ///
    /// Through sheets and bodies of dielectric waves are followed from plane waves and by the cpu engine alone (CONVENTIONS eq. 70-75). Paths
    /// of several bounces by way of curved surfaces are followed by the host in f64 on either engine ([`solver::Solver::remarks`] says so).
    ///
    /// # Errors
    /// Returns an error for a material or a scattering table without a value at a frequency, for options that are out
    /// of range, or for a body that is not closed or touches another.
    ///
    /// # Example
    /// Flat facets seen from infinity have no discretisation error, so that a plate agrees with its closed form in
    /// amplitude and phase, on its main lobe and on the side lobes.
    ///
    /// ```
    /// use catseye::base::frames::direction_from_angles;
    /// use catseye::engine::{Engine, Precision};
    /// use catseye::rcs::{Aspect, BistaticAspect, RcsOptions, closed_form::po_plate};
    /// use catseye::road::reflector::Reflector;
    /// use catseye::scene::material;
    ///
    /// let plate = Reflector::parse("plate:width_m=0.1,height_m=0.05")?.to_scene(&material::by_name)?;
    /// let aspects = [0.0f64, 0.7, 1.6, 5.0]
    ///     .map(|deg| BistaticAspect::monostatic(Aspect { azimuth: deg.to_radians(), elevation: 0.0 }));
    /// let engine = Engine::open("cpu", Precision::F32)?;
    /// let found = engine.rcs(&plate, &[77e9], &aspects, &RcsOptions::default())?;
    /// let exact = |a: &BistaticAspect| po_plate(0.1, 0.05, 77e9, direction_from_angles(a.transmit.azimuth, 0.0));
    /// let peak_m = exact(&aspects[0]).norm();
    /// for (s, aspect) in found.iter().zip(&aspects) {
    ///     let (s_vv, s_hv) = (s.every[0][0], s.every[1][0]);
    ///     assert!((s_vv - exact(aspect)).norm() < 1e-6 * peak_m && s_hv.norm() < 1e-6 * peak_m);
    /// }
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn rcs(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
    ) -> Result<Vec<Scattering>> {
        self.scattering_at(scene, frequencies_hz, aspects, options, 1.0, &|_| ())
    }

    /// How far S moves, in dB, when cells at finite range have a quarter of the phase that the accuracy allows, and facets of curved
    /// surfaces a quarter of the sagitta that it allows, or of the scene's largest where that is less: the largest |dS| / |S| among the co-polar
    /// values within 30 dB of their peak. None when there is no echo.
    ///
    /// # Errors
    /// Returns an error if `scene` cannot be followed by the method, a material has no value at a frequency, or the
    /// engine fails.
    pub fn rcs_convergence_db(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
    ) -> Result<Option<f64>> {
        let options = RcsOptions { last: false, ..options.clone() };
        let found = self.rcs(scene, frequencies_hz, aspects, &options)?;
        let finer = self.scattering_at(scene, frequencies_hz, aspects, &options, 4.0, &|_| ())?;
        let mut worst: Option<f64> = None;
        for i in 0..2 {
            let peak = finer.iter().map(|s| s.every[i][i].norm()).fold(0.0, f64::max);
            for (a, b) in found.iter().zip(&finer).map(|(a, b)| (a.every[i][i], b.every[i][i])) {
                if peak > 0.0 && b.norm() > power_from_db(-30.0).sqrt() * peak {
                    let db = 20.0 * (1.0 + (a - b).norm() / b.norm()).log10();
                    worst = Some(worst.map_or(db, |w| w.max(db)));
                }
            }
        }
        Ok(worst)
    }

    /// [`Engine::rcs`] that tells `watch` how many aspects were finished since it last did, with the phases that decide the accuracy divided
    /// by `finer`.
    fn scattering_at(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
        finer: f64,
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Scattering>> {
        if options.height_m == 0.0 {
            return self.scattering_over_ground(scene, frequencies_hz, aspects, options, finer, watch);
        }
        let (raised, below) = options.raised(scene);
        let mut found =
            self.scattering_over_ground(&raised, frequencies_hz, aspects, &below, finer, watch)?;
        for (s, aspect) in found.iter_mut().zip(aspects.iter().cycle()) {
            s.scale([aspect.transmit, aspect.receive].map(|a| options.distance_ratio(a)).iter().product());
        }
        Ok(found)
    }

    /// [`Engine::scattering_at`] of bodies at the height at which they are.
    fn scattering_over_ground(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
        finer: f64,
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Scattering>> {
        rcs::ground::scattering(scene, frequencies_hz, aspects, options, |s, f, l, o| {
            // Each aspect is computed several times, with its images.
            let share = aspects.len() as f64 / l.len() as f64;
            let done = std::sync::Mutex::new(0.0);
            self.scattering_of_bodies(s, f, l, o, finer, &|n| {
                let mut sum = done.lock().unwrap_or_else(|e| e.into_inner());
                let before = *sum as u64;
                *sum += n as f64 * share;
                watch(*sum as u64 - before);
            })
        })
    }

    /// [`Engine::scattering_at`] of bodies in free space.
    fn scattering_of_bodies(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
        finer: f64,
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Scattering>> {
        let highest = frequencies_hz.iter().copied().fold(f64::NAN, f64::max);
        if !highest.is_finite() || aspects.is_empty() {
            return Ok(Vec::new());
        }
        let (scene, _) = overlaps::without_doubles(scene);
        let scene = &*scene;
        let surfaces = frequencies_hz.iter().map(|f| surfaces_at(scene, *f)).collect::<Result<Vec<_>>>()?;
        if let Some(found) = curved_dielectric(scene, frequencies_hz, &surfaces, aspects, options)? {
            watch(aspects.len() as u64);
            return Ok(found);
        }
        let doubts = dielectrics::doubts(scene, &surfaces[0], wavenumber(frequencies_hz[0]));
        let scene = &*dielectrics::with_flat_walls(scene, &doubts);
        let mut sagitta_m = curved::sagitta_m(options.accuracy_db, wavenumber(highest));
        if finer > 1.0 {
            // Facets that are finer than the accuracy asks for have to be cut, too, or nothing would be compared.
            sagitta_m = sagitta_m.min(curved::largest_sagitta_m(scene)) / finer;
        }
        let geometry = Geometry::build(&*curved::refined_scene(scene, sagitta_m)?, 0.0, highest)?;
        let frequencies: Vec<FrequencyPoint> = frequencies_hz
            .iter()
            .zip(&surfaces)
            .map(|(f, surfaces)| FrequencyPoint { wavenumber: wavenumber(*f), surfaces })
            .collect();
        let passed = passed(&geometry, &frequencies);
        if let Some(material) = &passed {
            self.check_passed(material, options.distance)?;
        }
        let mut beams = BeamOptions::new(options.bounces, options.accuracy_db, options.last);
        beams.tau /= finer;
        beams.facets_reflect = true;
        let mut by_aspect: Vec<Vec<Scattering>> = Vec::with_capacity(aspects.len());
        let on_device = match self {
            Engine::Gpu(gpu) if !takes_host(scene, options.bounces) => Some(gpu),
            _ => None,
        };
        for batch in aspects.chunks(self.aspects_per_batch(geometry.faces().faces.len())) {
            by_aspect.extend(match on_device {
                None => beam_sum::by_beams(&geometry, &frequencies, batch, options.distance, &beams)
                    .map_err(|why| {
                        impassable(why, passed.as_deref().unwrap_or_default(), options.distance)
                    })?,
                Some(gpu) => {
                    rcs::beam_sum::by_beams(gpu, &geometry, &frequencies, batch, options.distance, &beams)?
                }
            });
            watch(batch.len() as u64);
        }
        if passed.is_none() {
            // Beams that pass have it already.
            let forward = |a: &BistaticAspect| {
                let [t, r] = [a.transmit, a.receive].map(|a| direction_from_angles(a.azimuth, a.elevation));
                (t.dot(r) < 0.0)
                    .then(|| beam_sum::behind(&geometry, &frequencies, a, options.distance, &beams))
            };
            let all: Vec<Option<Vec<Scattering>>> = aspects.par_iter().map(forward).collect();
            for (sums, more) in by_aspect.iter_mut().zip(all) {
                sums.iter_mut().zip(more.into_iter().flatten()).for_each(|(s, more)| s.add(&more));
            }
        }
        let edges = match options.diffraction {
            Diffraction::None => None,
            Diffraction::Ptd => {
                let edges = edges::find(&geometry, edges::SMOOTH_RAD);
                Some(ptd::of_edges(&geometry, &edges, frequencies_hz, aspects, options.distance))
            }
        };
        let mut out = Vec::with_capacity(frequencies_hz.len() * aspects.len());
        for (i, f) in frequencies_hz.iter().enumerate() {
            for (aspect, s) in aspects.iter().zip(&by_aspect) {
                let mut s = s[i];
                s.add(&rcs::point_sum(&geometry, *aspect, *f, options.distance)?);
                if let Some(edges) = &edges {
                    s.add(&edges[out.len()]);
                }
                if !s.every.iter().flatten().all(|z| z.is_finite()) {
                    return Err(not_a_number(&aspect.transmit));
                }
                if !options.last {
                    s.last = matrix::UNKNOWN;
                }
                out.push(s);
            }
        }
        Ok(out)
    }

    /// Returns an error where waves pass through something, on the gpu engine or at a finite distance: only the cpu
    /// engine follows them, and only from plane waves.
    fn check_passed(&self, material: &str, distance: Distance) -> Result<()> {
        let bad = |key: &str| {
            BadInput::new(format!("waves pass through objects of '{material}'")).key(key.to_string())
        };
        if let Engine::Gpu(_) = self {
            return Err(bad("device").value("gpu").allowed("cpu").remedy("use --device cpu").into());
        }
        match distance {
            Distance::Infinite => Ok(()),
            Distance::At(_) => Err(impassable(Impassable::NearPort, material, distance)),
        }
    }

    /// S for each aspect by a grid of rays.
    ///
    /// # Errors
    /// Returns an error if the adapter fails, or if a scattering table has no value at the frequency.
    pub fn rcs_rays(
        &self,
        geometry: &Geometry,
        aspects: &[Aspect],
        options: &RayGrid,
    ) -> Result<Vec<Scattering>> {
        let mut found = match self {
            Engine::Cpu(_) => crate::rcs::cpu::po_sum::by_rays(geometry, aspects, options),
            Engine::Gpu(gpu) => po_sum::by_rays(gpu, geometry, aspects, options)?,
        };
        for (s, a) in found.iter_mut().zip(aspects) {
            s.add(&rcs::point_sum(
                geometry,
                BistaticAspect::monostatic(*a),
                geometry.freq_hz,
                options.distance,
            )?);
        }
        match found.iter().position(|s| !s.is_finite()) {
            None => Ok(found),
            Some(i) => Err(not_a_number(&aspects[i])),
        }
    }
}
