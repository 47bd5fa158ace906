//! How results converge: a grid of rays against exact beams over its density, and the error that is reached
//! against the one that is allowed. Writes `convergence_grid.png` and `convergence_asked.png` into the folder
//! that is named, or into the present one.

use catseye::adc::budget::Budget;
use catseye::base::units::wavenumber;
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RayGrid, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Scene, material};
use catseye::trace::TraceOptions;
use catseye_papers::bench::frame::Frame;
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};
use num_complex::Complex64;
use std::path::Path;

const FREQUENCY_HZ: f64 = 77e9;

fn scene(spec: &str) -> catseye::Result<Scene> {
    Reflector::parse(spec)?.to_scene(&material::by_name)
}

fn aspects(elevation_deg: f64, n: usize) -> Vec<Aspect> {
    (0..n)
        .map(|i| Aspect {
            azimuth: (-20.0 + 40.0 * (i as f64 + 0.37) / n as f64).to_radians(),
            elevation: elevation_deg.to_radians(),
        })
        .collect()
}

/// Root mean square of |dS| / |S| in VV over the looks within 30 dB of the peak, in dB.
fn error_db(found: &[Scattering], truth: &[Scattering]) -> f64 {
    let vv = |s: &Scattering| s.every[0][0];
    let peak = truth.iter().map(|s| vv(s).norm()).fold(0.0, f64::max);
    let errors: Vec<f64> = found
        .iter()
        .zip(truth)
        .filter(|(_, t)| vv(t).norm() > peak / 30.0)
        .map(|(f, t)| ((vv(f) - vv(t)).norm() / vv(t).norm()).powi(2))
        .collect();
    let rms = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
    20.0 * (1.0 + rms).log10()
}

fn grids(engine: &Engine) -> catseye::Result<Chart> {
    let mut chart = Chart::new(
        "Grid of rays against exact beams, rms over azimuth",
        Axis::new("lg (rays per wavelength)", 0.0, 1.7),
        Axis::new("lg (error / 1 dB)", -4.0, 1.5),
    );
    for (i, (label, spec, elevation)) in [
        ("trihedral, legs 0.1 m, 35.3 deg", "trihedral:leg_m=0.1", 35.264),
        ("trihedral, 5 deg", "trihedral:leg_m=0.1", 5.0),
        ("type 1, H 4 mm, 1 deg", "type1:width_m=0.16,height_m=0.004", 1.0),
    ]
    .into_iter()
    .enumerate()
    {
        let scene = scene(spec)?;
        let aspects = aspects(elevation, 12);
        let looks: Vec<BistaticAspect> = aspects.iter().map(|a| BistaticAspect::monostatic(*a)).collect();
        let truth = engine.rcs(&scene, &[FREQUENCY_HZ], &looks, &RcsOptions::default())?;
        let geometry = Geometry::build(&scene, 0.0, FREQUENCY_HZ)?;
        let mut points = Vec::new();
        for density in [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0] {
            let grid = RayGrid { rays_per_wavelength: density, bounces: 3, distance: Distance::Infinite };
            let found = engine.rcs_rays(&geometry, &aspects, &grid)?;
            points.push([f64::log10(density), error_db(&found, &truth).log10()]);
        }
        line(&mut chart, label, points, i);
    }
    Ok(chart)
}

fn asked(engine: &Engine) -> catseye::Result<Chart> {
    const ALLOWED_DB: [f64; 9] = [2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005];
    let mut chart = Chart::new(
        "Error that is reached against the error that is allowed",
        Axis::new("lg (allowed / 1 dB)", -2.5, 0.5),
        Axis::new("lg (reached / 1 dB)", -4.5, 0.5),
    );
    let pen = Pen::dashed([120, 120, 120], 1.0, [4.0, 4.0]);
    chart.layers.push(Layer::Line { points: vec![[-2.5, -2.5], [0.5, 0.5]], pen });
    chart.key("allowed", Symbol::Line(pen));
    for (i, (label, spec, elevation, distance, finest)) in [
        ("type 1, H 4 mm, from 3 m", "type1:width_m=0.16,height_m=0.004", 1.0, Distance::At(3.0), 2e-4),
        ("sphere, radius 50 mm", "sphere:radius_m=0.05,sagitta_m=0.002", 20.0, Distance::Infinite, 0.01),
    ]
    .into_iter()
    .enumerate()
    {
        let scene = scene(spec)?;
        let looks: Vec<BistaticAspect> =
            aspects(elevation, 12).iter().map(|a| BistaticAspect::monostatic(*a)).collect();
        let of = |accuracy_db| {
            let options = RcsOptions { accuracy_db, distance, last: false, ..Default::default() };
            engine.rcs(&scene, &[FREQUENCY_HZ], &looks, &options)
        };
        let truth = of(finest)?;
        let mut points = Vec::new();
        for db in ALLOWED_DB.into_iter().filter(|db| *db > 2.0 * finest) {
            points.push([db.log10(), error_db(&of(db)?, &truth).log10()]);
        }
        line(&mut chart, label, points, i);
    }
    // Objects of a street: the sum of each one's echoes.
    let frame = Frame::w3(false)?;
    let geometry = frame.geometry(&frame.scene)?;
    let k = wavenumber(FREQUENCY_HZ);
    let of = |accuracy_db| -> catseye::Result<Vec<Complex64>> {
        let options = TraceOptions { accuracy_db, ..frame.options };
        let mut sums = vec![Complex64::ZERO; frame.scene.objects.len() + 1];
        for r in frame.echoes(engine, &geometry, &options, Budget::Nothing)?.list {
            sums[r.object_id() as usize] += r.path_gain[0][0] * Complex64::cis(-k * r.path_length_m);
        }
        Ok(sums)
    };
    let truth = of(2e-4)?;
    let mut points = Vec::new();
    for db in ALLOWED_DB {
        let found = of(db)?;
        let mut errors: Vec<f64> = found
            .iter()
            .zip(&truth)
            .filter(|(_, t)| t.norm() > 1e-6)
            .map(|(f, t)| 20.0 * (1.0 + (f - t).norm() / t.norm()).log10())
            .collect();
        errors.sort_by(f64::total_cmp);
        points.push([db.log10(), errors[errors.len() * 9 / 10].log10()]);
    }
    line(&mut chart, "street W3, 9 of 10 objects below", points, 2);
    Ok(chart)
}

fn line(chart: &mut Chart, label: &str, points: Vec<[f64; 2]>, i: usize) {
    let pen = Pen::solid([[0, 114, 178], [213, 94, 0], [0, 158, 115]][i], 1.6);
    chart.layers.push(Layer::Line { points, pen });
    chart.key(label, Symbol::Line(pen));
}

fn main() -> catseye::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or(".".into());
    let engine = Engine::open("cpu", Precision::F32)?;
    for (name, chart) in [("grid", grids(&engine)?), ("asked", asked(&engine)?)] {
        let file = Path::new(&folder).join(format!("convergence_{name}.png"));
        println!("{}", chart.draw()?.write(file, true)?.display());
    }
    Ok(())
}
