//! Which engine `auto` opens: a fixed rule by what it is opened for, so that bytes do not depend on timing.

use super::{Engine, Precision};
use crate::base::error::Result;
use crate::gpu::adapters;

/// What an engine is opened for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Cross sections, ray casts, and whatever is not one of the others.
    General,
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
            Purpose::General => (true, "auto takes the GPU for cross sections and rays"),
            Purpose::Cubes => (true, "auto takes the GPU for cubes"),
            Purpose::Frames => (
                false,
                "auto takes the processors for frames of scenes, which trace them faster than a GPU (--device gpu takes that)",
            ),
        }
    }
}

impl Engine {
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
        let has_choice =
            device == "auto" && precision == Precision::F32 && adapters().iter().any(|a| a.is_hardware);
        if !has_choice {
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

    #[test]
    fn named_engines_follow_no_rule() {
        for work in [Purpose::General, Purpose::Frames, Purpose::Cubes] {
            let (engine, rule) = Engine::open_for("cpu", Precision::F64, work).unwrap();
            assert!(matches!(engine, Engine::Cpu(Precision::F64)) && rule.is_none());
            // Without a hardware GPU there is nothing to choose.
            let (engine, rule) = Engine::open_for("auto", Precision::F32, work).unwrap();
            let has_gpu = adapters().iter().any(|a| a.is_hardware);
            assert_eq!(rule.is_some(), has_gpu);
            assert_eq!(matches!(engine, Engine::Gpu(_)), has_gpu && work.rule().0);
        }
    }
}
