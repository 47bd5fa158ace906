//! Solvers, which take cross sections: the engines of this library, or a method of a member above it. The accuracy of an engine is measured
//! here and, where it can be, reached.

use super::sweep::{Accuracy, Sweep};
use super::{Engine, EngineReport, curved_dielectric, takes_host};
use crate::base::error::Result;
use crate::base::units::{power_from_db, wavenumber};
use crate::geom::convex::is_convex;
use crate::geom::dielectrics;
use crate::geom::remarks::of_bodies;
use crate::geom::{curved, overlaps, surfaces_at};
use crate::rcs::validity::Faces;
use crate::rcs::{BistaticAspect, Distance, Ground, RcsOptions, Scattering};
use crate::scene::{Scene, mesh_file};

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
    /// Number of bounces that were followed.
    pub bounces: usize,
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
            let (scattering, bounces) = (Vec::new(), self.options.bounces);
            return Ok(SweepResult { aspects, scattering, accuracy: Accuracy::NoEcho, bounces });
        }
        self.check_for(scene)?;
        solver.remarks(scene, self).iter().for_each(|line| warn(line));
        let (options, accuracy) = solver.settle(scene, self, &aspects, warn)?;
        let scattering = solver.scattering(scene, &self.frequencies_hz, &aspects, &options, watch)?;
        Ok(SweepResult { aspects, scattering, accuracy, bounces: options.bounces })
    }
}

/// Largest change from one run to the other in dB, against the largest entry of the look, or 30 dB below the largest of all where that is
/// more.
fn change_db(before: &[Scattering], after: &[Scattering]) -> f64 {
    let largest = |s: &Scattering| s.every.iter().flatten().map(|z| z.norm()).fold(0.0, f64::max);
    let floor = power_from_db(-30.0).sqrt() * after.iter().map(largest).fold(0.0, f64::max);
    let one = |(a, b): (&Scattering, &Scattering)| {
        let moved = a.every.iter().flatten().zip(b.every.iter().flatten()).map(|(x, y)| (x - y).norm());
        let (moved, level) = (moved.fold(0.0, f64::max), largest(b).max(floor));
        if moved > 0.0 { 20.0 * (1.0 + moved / level).log10() } else { 0.0 }
    };
    before.iter().zip(after).map(one).fold(0.0, f64::max)
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
        let freq_hz = sweep.frequencies_hz.iter().copied().fold(f64::INFINITY, f64::min);
        // A material without a value is an error of the run.
        let mut lines = of_bodies(scene, freq_hz, true).unwrap_or_default();
        lines.extend(mesh_file::unit_line(scene));
        if matches!(self, Engine::Gpu(_)) && takes_host(scene, sweep.options.bounces) {
            lines.push(
                "device: the host's processors trace paths of several bounces over curved surfaces in f64; the adapter does not"
                    .into(),
            );
        }
        let (single, _) = overlaps::without_doubles(scene);
        if is_series(&single, &sweep.frequencies_hz) {
            return lines;
        }
        lines.extend(
            Faces::of(&single)
                .validity(&sweep.frequencies_hz, &sweep.transmit, sweep.receive.is_some(), &sweep.options)
                .lines(),
        );
        lines
    }

    fn is_faster_in_parallel(&self) -> bool {
        // Calls of one look each would leave threads of the cpu idle.
        matches!(self, Engine::Cpu(_))
    }
}

/// Whether a scene is taken by the series of a sphere.
fn is_series(scene: &Scene, frequencies_hz: &[f64]) -> bool {
    frequencies_hz.first().is_some_and(|f| {
        surfaces_at(scene, *f).is_ok_and(|surfaces| {
            dielectrics::lone_sphere(scene, &dielectrics::doubts(scene, &surfaces, wavenumber(*f))).is_some()
        })
    })
}

impl Engine {
    /// Gives `options` the least number of bounces, from its own on by twos, that is within the accuracy of its largest.
    fn deepened(
        &self,
        scene: &Scene,
        frequencies_hz: &[f64],
        aspects: &[BistaticAspect],
        options: &mut RcsOptions,
        warn: &mut dyn FnMut(&str),
    ) -> Result<()> {
        let most = options.most_bounces;
        if most <= options.bounces {
            return Ok(());
        }
        // A ground is another thing to see.
        if options.ground == Ground::None && is_convex(scene) {
            options.bounces = 1;
            return Ok(());
        }
        let with = |bounces: usize, options: &RcsOptions| {
            let options = RcsOptions { bounces, last: false, ..options.clone() };
            self.rcs(scene, frequencies_hz, aspects, &options)
        };
        // Against the most that is followed: what a few more bring says nothing of what still more would, as in a duct.
        let deepest = with(most, options)?;
        let mut bounces = options.bounces;
        while bounces < most {
            if change_db(&with(bounces, options)?, &deepest) <= options.accuracy_db {
                options.bounces = bounces;
                return Ok(());
            }
            bounces += 2;
        }
        options.bounces = most;
        let before = with(most - 1, options)?;
        let change = change_db(&before, &deepest);
        if change > options.accuracy_db {
            warn(&format!(
                "bounces: at most {most} are traced, and the last of them still changed the cross section by {change:.2} dB; the result does not contain further bounces"
            ));
        }
        Ok(())
    }

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
        if is_series(scene, &sweep.frequencies_hz) {
            return Ok((taken, Accuracy::Series));
        }
        // What no run can follow is an error before the first.
        let surfaces =
            sweep.frequencies_hz.iter().map(|f| surfaces_at(scene, *f)).collect::<Result<Vec<_>>>()?;
        curved_dielectric(scene, &sweep.frequencies_hz, &surfaces, &[], &sweep.options)?;
        let step = aspects.len().div_ceil(CONVERGENCE_ASPECTS);
        let some: Vec<BistaticAspect> = aspects.iter().copied().step_by(step).collect();
        self.deepened(scene, &sweep.frequencies_hz, &some, &mut taken, warn)?;
        let is_curved = scene.meshes.iter().any(curved::has_curved);
        let (tries, step_down) = match (taken.distance, is_curved) {
            (Distance::Infinite, false) => return Ok((taken, Accuracy::Exact)),
            (Distance::Infinite, true) => (1, 1.0),
            (Distance::At(_), false) => (CONVERGENCE_TRIES, 8.0),
            (Distance::At(_), true) => (CONVERGENCE_TRIES, 2.0),
        };
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
