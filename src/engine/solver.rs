//! Solvers, which take cross sections: the engines of this library, or a method of a member above it. The accuracy of an engine is measured
//! here and, where it can be, reached.

use super::sweep::{Accuracy, Sweep};
use super::{Engine, EngineReport};
use crate::base::error::Result;
use crate::geom::curved;
use crate::rcs::validity::Faces;
use crate::rcs::{BistaticAspect, Distance, RcsOptions, Scattering};
use crate::scene::Scene;

/// Looks that are taken again more finely for the estimate of convergence.
const CONVERGENCE_ASPECTS: usize = 25;
/// Times that cells are made smaller before the accuracy counts as out of reach.
const CONVERGENCE_TRIES: usize = 4;

/// A method that gives the scattering matrix of a scene's objects. [`Sweep::take`], the command `rcs` and studies ask for nothing more, so
/// that another method, such as a full-wave one, takes the place of [`Engine`] in them.
pub trait Solver: Sync {
    /// The method and what it runs on, as manifests name it.
    fn report(&self) -> EngineReport;

    /// S of the scene's objects in metres, phases referred to the world's origin, for each frequency and each aspect
    /// (`[frequency, aspect]`). `watch` hears how many aspects were finished since it last did.
    ///
    /// # Errors
    /// `BadInput` for a scene or for options that the method cannot take; failures of the method.
    fn scattering(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Scattering>>;

    /// The options with which the method reaches the accuracy that `sweep` asks for, and the accuracy that it then has. `warn` hears when
    /// it stays behind. By default nothing is measured and the options are the sweep's own.
    ///
    /// # Errors
    /// Those of [`Solver::scattering`].
    fn settle(
        &self,
        _scene: &Scene,
        sweep: &Sweep,
        _aspects: &[BistaticAspect],
        _warn: &mut dyn FnMut(&str),
    ) -> Result<(RcsOptions, Accuracy)> {
        Ok((sweep.options.clone(), Accuracy::Unknown))
    }

    /// Where the method's validity ends for this sweep, one sentence each; by default it says nothing.
    fn remarks(&self, _scene: &Scene, _sweep: &Sweep) -> Vec<String> {
        Vec::new()
    }

    /// Whether several calls from several threads take less time than one after another.
    fn is_faster_in_parallel(&self) -> bool {
        false
    }
}

/// What a sweep gave.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepResult {
    /// For each of `transmit` all of `receive`.
    pub aspects: Vec<BistaticAspect>,
    /// `[frequency, aspect]`.
    pub scattering: Vec<Scattering>,
    /// The accuracy that was reached.
    pub accuracy: Accuracy,
}

impl Sweep {
    /// S of the scene over this sweep, by a solver. An [`Engine`] makes cells at finite range smaller until the change that a stricter run
    /// makes is within `accuracy_db`, and only tells how far facets of curved surfaces, which would grow too many, are from it. `warn` hears
    /// what may be wrong with the result as soon as it is known, `watch` how many aspects were finished since it last did.
    ///
    /// # Errors
    /// Those of [`Sweep::check`] and of the solver; a radar inside the target.
    pub fn take(
        &self,
        solver: &dyn Solver,
        scene: &Scene,
        warn: &mut dyn FnMut(&str),
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<SweepResult> {
        self.check()?;
        let aspects = self.aspects();
        if self.frequencies_hz.is_empty() || aspects.is_empty() {
            return Ok(SweepResult { aspects, scattering: Vec::new(), accuracy: Accuracy::NoEcho });
        }
        self.check_for(scene)?;
        solver.remarks(scene, self).iter().for_each(|line| warn(line));
        let (options, accuracy) = solver.settle(scene, self, &aspects, warn)?;
        let scattering = solver.scattering(scene, &self.frequencies_hz, &aspects, &options, watch)?;
        Ok(SweepResult { aspects, scattering, accuracy })
    }
}

impl Solver for Engine {
    fn report(&self) -> EngineReport {
        Engine::report(self)
    }

    fn scattering(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &RcsOptions,
        watch: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Scattering>> {
        self.scattering_at(scene, frequencies_hz, aspects, options, 1.0, watch)
    }

    fn settle(
        &self,
        scene: &Scene,
        sweep: &Sweep,
        aspects: &[BistaticAspect],
        warn: &mut dyn FnMut(&str),
    ) -> Result<(RcsOptions, Accuracy)> {
        self.converged(scene, sweep, aspects, warn)
    }

    fn remarks(&self, scene: &Scene, sweep: &Sweep) -> Vec<String> {
        Faces::of(scene).validity(&sweep.frequencies_hz, &sweep.transmit, &sweep.options).lines()
    }

    fn is_faster_in_parallel(&self) -> bool {
        // Calls of one look each would leave threads of the cpu idle.
        matches!(self, Engine::Cpu(_))
    }
}

impl Engine {
    /// The options with which the sweep reaches its accuracy.
    fn converged(
        &self,
        scene: &Scene,
        sweep: &Sweep,
        aspects: &[BistaticAspect],
        warn: &mut dyn FnMut(&str),
    ) -> Result<(RcsOptions, Accuracy)> {
        let wanted_db = sweep.options.accuracy_db;
        let mut taken = sweep.options.clone();
        let is_curved = scene.meshes.iter().any(curved::has_curved);
        let (tries, step_down) = match (taken.distance, is_curved) {
            (Distance::Infinite, false) => return Ok((taken, Accuracy::Exact)),
            (Distance::Infinite, true) => (1, 1.0),
            (Distance::At(_), false) => (CONVERGENCE_TRIES, 8.0),
            (Distance::At(_), true) => (CONVERGENCE_TRIES, 2.0),
        };
        let step = aspects.len().div_ceil(CONVERGENCE_ASPECTS);
        let some: Vec<BistaticAspect> = aspects.iter().copied().step_by(step).collect();
        let mut accuracy = Accuracy::NoEcho;
        for i in 0..tries {
            accuracy = match self.rcs_convergence_db(scene, &sweep.frequencies_hz, &some, &taken) {
                Ok(Some(db)) => Accuracy::Measured(db),
                Ok(None) => Accuracy::NoEcho,
                // Facets of a quarter of the sagitta are four times as many, which a gpu may not hold.
                Err(e) if is_curved => {
                    warn(&format!("the accuracy was not measured: {e}"));
                    accuracy = if accuracy.db().is_some() { accuracy } else { Accuracy::Unknown };
                    break;
                }
                Err(e) => return Err(e),
            };
            if i + 1 == tries || accuracy.db().is_none_or(|db| db <= wanted_db) {
                break;
            }
            taken.accuracy_db /= step_down;
        }
        if let Some(db) = accuracy.db().filter(|db| *db > wanted_db) {
            warn(&format!("the accuracy of {wanted_db} dB was not reached: {db:.4} dB"));
        }
        Ok((taken, accuracy))
    }
}
