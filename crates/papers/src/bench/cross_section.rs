//! W1 and W2: sweeps of a reflector's cross section by exact beams, compared with beams in f64 and a dense
//! grid of rays.

use super::sheet::{Outcome, Settings, Sheet};
use catseye::base::error::Result;
use catseye::base::units::{DEFAULT_FREQUENCY_HZ, dbsm_from_amplitude};
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RayGrid, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Scene, material};

/// Levels below the sweep's peak down to which errors are examined, dB.
pub const BELOW_PEAK_DB: f64 = 30.0;

/// A reflector and the directions from which it is seen.
pub struct ReflectorSweep {
    /// Text that names the reflector and its parameters.
    pub spec: &'static str,
    /// Directions to the radar.
    pub aspects: Vec<Aspect>,
    /// Rays per wavelength of the reference grid, and of a denser one.
    reference: [f64; 2],
    /// Step in directions at which each of the two references is computed.
    every: [usize; 2],
}

fn aspects(elevation_deg: &[f64], azimuth_deg: &[f64]) -> Vec<Aspect> {
    elevation_deg
        .iter()
        .flat_map(|e| {
            azimuth_deg.iter().map(|a| Aspect { azimuth: a.to_radians(), elevation: e.to_radians() })
        })
        .collect()
}

/// The `count` values `first`, `first + step`, ....
fn steps(first: f64, step: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| first + step * i as f64).collect()
}

/// The sweep of W1: 451 directions, 46 when `quick`.
pub fn trihedral(quick: bool) -> ReflectorSweep {
    let azimuth = if quick { steps(-45.0, 1.0, 46) } else { steps(-45.0, 0.1, 451) };
    ReflectorSweep {
        spec: "trihedral:leg_m=0.1",
        aspects: aspects(&[0.5f64.sqrt().atan().to_degrees()], &azimuth),
        reference: [40.0, 80.0],
        every: if quick { [3, 15] } else { [15, 150] },
    }
}

/// The sweep of W2: 8,211 directions, 231 when `quick`.
pub fn type1(quick: bool) -> ReflectorSweep {
    let (elevation, azimuth) = match quick {
        true => (steps(0.0, 0.5, 11), steps(-40.0, 4.0, 21)),
        false => (steps(0.0, 0.1, 51), steps(-40.0, 0.5, 161)),
    };
    ReflectorSweep {
        spec: "type1:width_m=0.16,height_m=0.004,length_m=0",
        aspects: aspects(&elevation, &azimuth),
        reference: [160.0, 320.0],
        // Numbers without a common factor with 161 and 21, so that all azimuths have their turn.
        every: if quick { [10, 80] } else { [150, 1500] },
    }
}

impl ReflectorSweep {
    /// Builds the scene of the reflector.
    ///
    /// # Errors
    /// Returns an error if the text names no reflector or has an invalid parameter.
    pub fn scene(&self) -> Result<Scene> {
        Reflector::parse(self.spec)?.to_scene(&material::by_name)
    }

    /// The directions for a transmitter and receiver at one place.
    pub fn looks(&self) -> Vec<BistaticAspect> {
        self.aspects.iter().map(|a| BistaticAspect::monostatic(*a)).collect()
    }

    /// Options of the solver: only the convention "every".
    pub fn options() -> RcsOptions {
        RcsOptions { last: false, ..Default::default() }
    }
}

fn vv_db(s: &Scattering) -> f64 {
    dbsm_from_amplitude(s.every[0][0].norm())
}

/// Worst and mean difference of the levels where the reference is above `floor_db`, dB, and the number of
/// such levels.
fn compare(got: &[Scattering], reference: &[Scattering], floor_db: f64) -> (f64, f64, usize) {
    let strong = got.iter().zip(reference).filter(|(_, r)| vv_db(r) >= floor_db);
    let errors: Vec<f64> = strong.map(|(g, r)| (vv_db(g) - vv_db(r)).abs()).collect();
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    (errors.iter().copied().fold(0.0, f64::max), mean, errors.len())
}

pub(super) fn w1(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    run(&trihedral(settings.quick), engine, sheet)
}

pub(super) fn w2(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    run(&type1(settings.quick), engine, sheet)
}

fn run(sweep: &ReflectorSweep, engine: &Engine, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let scene = sheet.stage("scene", || sweep.scene())?;
    let (looks, options) = (sweep.looks(), ReflectorSweep::options());
    // Device start and compilation of shaders are not part of a sweep.
    sheet.stage("warm-up", || engine.rcs(&scene, &[DEFAULT_FREQUENCY_HZ], &looks[..1], &options))?;
    sheet.count("directions", looks.len());
    sheet.count("triangles", scene.triangle_count());
    let found = sheet.stage("sweep", || engine.rcs(&scene, &[DEFAULT_FREQUENCY_HZ], &looks, &options))?;

    // Two references: the beams in f64, and a dense grid of rays, which shares nothing with them.
    let thin = |every: usize| -> (Vec<Aspect>, Vec<Scattering>) {
        // From the middle of the first stretch, so that neither end of the sweep is special.
        sweep.aspects.iter().copied().zip(found.iter().copied()).skip(every / 2).step_by(every).unzip()
    };
    let peak = found.iter().map(vv_db).fold(f64::NEG_INFINITY, f64::max);
    let floor = peak - BELOW_PEAK_DB;
    let truth = Engine::Cpu(Precision::F64).rcs(&scene, &[DEFAULT_FREQUENCY_HZ], &looks, &options)?;
    let (worst, mean, compared) = compare(&found, &truth, floor);
    (sheet.say)("  grid of rays on the cpu");
    let geometry = Geometry::build(&scene, 0.0, DEFAULT_FREQUENCY_HZ)?;
    let grid = |aspects: &[Aspect], rays_per_wavelength| {
        let grid = RayGrid { bounces: 3, rays_per_wavelength, distance: Distance::Infinite };
        catseye::rcs::cpu::po_sum::by_rays(&geometry, aspects, &grid)
    };
    let (some, got) = thin(sweep.every[0]);
    let (rays_worst, rays_mean, rays_compared) = compare(&got, &grid(&some, sweep.reference[0]), floor);
    let (few, got) = thin(sweep.every[1]);
    let (dense_worst, _, dense_compared) = compare(&got, &grid(&few, sweep.reference[1]), floor);
    sheet.accuracy("worst_db", worst);
    sheet.accuracy("mean_db", mean);
    sheet.accuracy("directions_compared", compared);
    sheet.accuracy("peak_dbsm", peak);
    sheet.accuracy("rays_worst_db", rays_worst);
    sheet.accuracy("rays_mean_db", rays_mean);
    sheet.accuracy("rays_compared", rays_compared);
    sheet.accuracy("rays_per_wavelength", sweep.reference[0]);
    sheet.note(format!(
        "VV, convention every, within {BELOW_PEAK_DB} dB of the peak, against beams in f64; a grid of {} rays per wavelength          differs by at most {rays_worst:.3} dB ({rays_compared} directions), one of {} by {dense_worst:.3} dB ({dense_compared})",
        sweep.reference[0], sweep.reference[1]
    ));
    Ok(sheet.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contracts_directions() {
        let (w1, w2) = (trihedral(false), type1(false));
        assert_eq!((w1.aspects.len(), w2.aspects.len()), (451, 8211));
        let deg = |a: &Aspect| (a.azimuth.to_degrees(), a.elevation.to_degrees());
        let near = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-4;
        assert!(near(deg(&w1.aspects[0]), (-45.0, 35.2644)) && near(deg(&w1.aspects[450]), (0.0, 35.2644)));
        assert!(near(deg(&w2.aspects[0]), (-40.0, 0.0)) && near(deg(&w2.aspects[8210]), (40.0, 5.0)));
    }

    #[test]
    fn errors_are_seen_near_the_peak_only() {
        let s = |x: f64| {
            let mut s = Scattering::default();
            s.every[0][0] = x.into();
            s
        };
        let (worst, mean, n) = compare(&[s(1.0), s(2.0), s(0.5)], &[s(1.0), s(1.0), s(1e-4)], -20.0);
        assert!((worst - 20.0 * 2f64.log10()).abs() < 1e-12 && (mean - 0.5 * worst).abs() < 1e-12);
        assert_eq!(n, 2);
    }
}
