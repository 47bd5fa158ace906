//! What takes a cross section: the engines of this library, or a method of a member above it.

use super::sweep::{Accuracy, Sweep};
use super::{Engine, EngineReport};
use crate::base::error::Result;
use crate::rcs::validity::Faces;
use crate::rcs::{BistaticAspect, RcsOptions, Scattering};
use crate::scene::Scene;

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
