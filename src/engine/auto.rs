//! Which engine `auto` opens: a fixed rule by what it is opened for, so that bytes do not depend on timing.

use super::{Engine, Precision, passed};
use crate::base::error::Result;
use crate::base::units::wavenumber;
use crate::em::layers::Backing;
use crate::geom::upload::surface_words;
use crate::geom::{Geometry, Surface, curved, surfaces_at};
use crate::gpu::adapters;
use crate::rcs::cpu::beam_sum::FrequencyPoint;
use crate::scene::Scene;

/// What an engine is opened for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Purpose {
    /// Cross sections, ray casts, and whatever is not one of the others.
    General,
    /// Cross sections of targets through which waves pass; only the cpu engine follows those waves.
    Penetrable,
    /// Cross sections of targets with layers that are too thick for the tables in which the gpu engine keeps reflections.
    ThickLayers,
    /// Frames of scenes, from tracing to points: runs, datasets, lane methods.
    Frames,
    /// Processing of cubes that are there.
    Cubes,
}

impl Purpose {
    /// The rule of `auto` on a machine with a hardware GPU: whether the GPU is taken, and why.
    ///
    /// Measured once, on 16 processors beside an H100 and an H200 (November 2026): sweeps of cross sections (W2), ray casts (W6) and transforms of
    /// cubes of some megasamples (W4) are faster on the GPU. Frames are not: 1,000 frames of 128 points take 6.1 s there and 2.9 s on the
    /// processors, 640 of small_road 16.2 and 4.9 s, 40 of the template recipe 20.0 and 16.8 s; of single frames W3 and W7 take 1.3 to
    /// 1.6 times as long on the GPU, while W9 and W13 take 0.8 to 0.9 times as long.
    pub fn rule(self) -> (bool, &'static str) {
        match self {
            Purpose::General => (true, "auto selects the GPU for cross sections and rays"),
            Purpose::Penetrable => (
                false,
                "auto selects the processors for cross sections of targets through which waves pass, which the GPU does not trace",
            ),
            Purpose::ThickLayers => (
                false,
                "auto selects the processors for cross sections of targets with thick layers, which the GPU does not tabulate",
            ),
            Purpose::Cubes => (true, "auto selects the GPU for cubes"),
            Purpose::Frames => (
                false,
                "auto selects the processors for frames of scenes, which trace them faster than a GPU (--device gpu selects the GPU)",
            ),
        }
    }

    /// The purpose of taking cross sections of a scene, by its materials at these frequencies (Hz) alone: what the gpu engine
    /// refuses for its materials is known before any engine is opened.
    ///
    /// # Errors
    /// Returns an error for a material without a value at a frequency, and for a scene of which no geometry can be built.
    pub fn of_target(scene: &Scene, frequencies_hz: &[f64], accuracy_db: f64) -> Result<Purpose> {
        let surfaces = frequencies_hz.iter().map(|f| surfaces_at(scene, *f)).collect::<Result<Vec<_>>>()?;
        let highest_hz = frequencies_hz.iter().copied().fold(f64::NAN, f64::max);
        let is_metal = |s: &Surface| s.stack.layers.is_empty() && s.stack.backing == Backing::Pec;
        // Neither rule can hold for bare metal, and a geometry is built for the others alone.
        if !highest_hz.is_finite() || surfaces.iter().flatten().all(is_metal) {
            return Ok(Purpose::General);
        }
        let scene = curved::refined_scene(scene, curved::sagitta_m(accuracy_db, wavenumber(highest_hz)))?;
        let geometry = Geometry::build(&scene, 0.0, highest_hz)?;
        let frequencies: Vec<FrequencyPoint> = frequencies_hz
            .iter()
            .zip(&surfaces)
            .map(|(f, surfaces)| FrequencyPoint { wavenumber: wavenumber(*f), surfaces })
            .collect();
        if passed(&geometry, &frequencies).is_some() {
            return Ok(Purpose::Penetrable);
        }
        let is_tabulated = |(f, s): (&f64, &Vec<Surface>)| surface_words(s, *f).is_ok();
        match frequencies_hz.iter().zip(&surfaces).all(is_tabulated) {
            true => Ok(Purpose::General),
            false => Ok(Purpose::ThickLayers),
        }
    }
}

impl Engine {
    /// Whether [`Engine::open_for`] follows a rule for this device and precision, so that its purpose matters.
    pub fn has_choice(device: &str, precision: Precision) -> bool {
        device == "auto" && precision == Precision::F32 && adapters().iter().any(|a| a.is_hardware)
    }

    /// [`Engine::open`] for some work: `auto` follows [`Purpose::rule`] where the machine has a hardware GPU, and then tells the rule. Any
    /// other name opens what it names, for all stages.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::open`].
    pub fn open_for(
        device: &str,
        precision: Precision,
        purpose: Purpose,
    ) -> Result<(Engine, Option<&'static str>)> {
        if !Engine::has_choice(device, precision) {
            return Ok((Engine::open(device, precision)?, None));
        }
        let (takes_gpu, rule) = purpose.rule();
        let device = if takes_gpu { "gpu" } else { "cpu" };
        Ok((Engine::open(device, precision)?, Some(rule)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compare::opened_for_tests;
    use crate::rcs::{Aspect, BistaticAspect, RcsOptions};
    use crate::road::reflector::Reflector;
    use crate::scene::material;

    #[test]
    fn named_engines_follow_no_rule() {
        for work in
            [Purpose::General, Purpose::Penetrable, Purpose::ThickLayers, Purpose::Frames, Purpose::Cubes]
        {
            let (engine, rule) = Engine::open_for("cpu", Precision::F64, work).unwrap();
            assert!(matches!(engine, Engine::Cpu(Precision::F64)) && rule.is_none());
            // Without a hardware GPU there is nothing to choose.
            let (engine, rule) = Engine::open_for("auto", Precision::F32, work).unwrap();
            let has_gpu = adapters().iter().any(|a| a.is_hardware);
            assert_eq!(rule.is_some(), has_gpu);
            assert_eq!(matches!(engine, Engine::Gpu(_)), has_gpu && work.rule().0);
        }
    }
    /// What the rule sends to the processors is what the gpu engine refuses, and nothing else.
    #[test]
    fn targets_that_the_gpu_refuses_go_to_the_processors() {
        let gpu = Engine::Gpu(Box::new(opened_for_tests()));
        let ahead = [BistaticAspect::monostatic(Aspect { azimuth: 0.1, elevation: 0.05 })];
        for (spec, frequencies_hz, purpose) in [
            ("plate:width_m=0.02,height_m=0.02", &[77e9][..], Purpose::General),
            ("sphere:radius_m=0.005", &[77e9], Purpose::General),
            ("plate:width_m=0.02,height_m=0.02,material=asphalt", &[77e9], Purpose::General),
            ("plate:width_m=0.02,height_m=0.02,material=pec+ice:0.001", &[77e9], Purpose::General),
            ("plate:width_m=0.02,height_m=0.02,material=air+glass:0.004", &[77e9], Purpose::Penetrable),
            ("type1:width_m=0.03,height_m=0.01,fill=ice", &[76e9, 77e9], Purpose::Penetrable),
            ("plate:width_m=0.02,height_m=0.02,material=pec+air:2", &[77e9], Purpose::ThickLayers),
        ] {
            let scene = Reflector::parse(spec).unwrap().to_scene(&material::parse_spec).unwrap();
            assert_eq!(Purpose::of_target(&scene, frequencies_hz, 0.1).unwrap(), purpose, "{spec}");
            let found = gpu.rcs(&scene, frequencies_hz, &ahead, &RcsOptions::default());
            assert_eq!(found.is_ok(), purpose.rule().0, "{spec}: {:?}", found.err());
            if let Err(e) = found {
                assert!(e.to_string().contains("--device cpu"), "{e}");
            }
        }
        // Scenes without materials, and sweeps of nothing.
        assert_eq!(Purpose::of_target(&Scene::default(), &[77e9], 0.1).unwrap(), Purpose::General);
        assert_eq!(Purpose::of_target(&Scene::default(), &[], 0.1).unwrap(), Purpose::General);
    }
}
