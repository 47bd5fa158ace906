//! Error of faceted spheres against Mie in 50 directions, over the number of facets: as they are, and with the normals
//! of the sphere, by which they are cut. Writes `curved_spheres.png`, or the file that is named.

use catseye::base::units::{DEFAULT_FREQUENCY_HZ, dbsm_from_amplitude, wavenumber};
use catseye::engine::{Engine, Precision};
use catseye::geom::curved::{refined_scene, sagitta_m};
use catseye::rcs::closed_form::mie_sphere;
use catseye::rcs::{Aspect, BistaticAspect, RcsOptions};
use catseye::road::reflector::Reflector;
use catseye::scene::{Scene, material};
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};

const RADIUS_M: f64 = 0.05;

fn sphere(sagitta_m: f64) -> catseye::Result<Scene> {
    let spec = format!("sphere:radius_m={RADIUS_M},sagitta_m={sagitta_m}");
    Reflector::parse(&spec)?.to_scene(&material::by_name)
}

/// Root of the mean square, and worst, of the differences in dB.
fn errors(scene: &Scene, accuracy_db: f64) -> catseye::Result<[f64; 2]> {
    let exact = dbsm_from_amplitude(mie_sphere(RADIUS_M, DEFAULT_FREQUENCY_HZ)?.norm());
    // A spiral of even steps of height over the sphere.
    let looks: Vec<BistaticAspect> = (0..50)
        .map(|i| Aspect {
            azimuth: 2.399_963 * f64::from(i),
            elevation: ((f64::from(i) + 0.5) / 25.0 - 1.0).asin(),
        })
        .map(BistaticAspect::monostatic)
        .collect();
    let options = RcsOptions { accuracy_db, bounces: 1, last: false, ..Default::default() };
    let swept = Engine::open("cpu", Precision::F64)?.rcs(scene, &[DEFAULT_FREQUENCY_HZ], &looks, &options)?;
    let off: Vec<f64> = swept.iter().map(|s| dbsm_from_amplitude(s.every[0][0].norm()) - exact).collect();
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    Ok([rms, off.iter().fold(0.0, |w, d| d.abs().max(w))])
}

fn main() -> catseye::Result<()> {
    let file = std::env::args().nth(1).unwrap_or("curved_spheres.png".into());
    let mut curves: [Vec<[f64; 2]>; 4] = Default::default();
    let mut add = |first: usize, facets: usize, found: [f64; 2]| {
        println!(
            "{} {facets} facets: rms {:.3} dB, worst {:.3} dB",
            ["flat", "cut"][first / 2],
            found[0],
            found[1]
        );
        for (i, db) in found.into_iter().enumerate() {
            curves[first + i].push([(facets as f64).log10(), db.log10()]);
        }
    };
    for sagitta in [2e-3, 1e-3, 5e-4, 2.5e-4, 1.2e-4, 6e-5, 3e-5, 1.5e-5] {
        let mut flat = sphere(sagitta)?;
        flat.meshes.iter_mut().for_each(|m| m.normals.clear());
        add(0, flat.triangle_count(), errors(&flat, 0.1)?);
    }
    let coarse = sphere(2e-3)?;
    let few = coarse.triangle_count();
    let mut last = 0;
    for accuracy_db in [8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.12, 0.06] {
        let limit = sagitta_m(accuracy_db, wavenumber(DEFAULT_FREQUENCY_HZ));
        let facets = refined_scene(&coarse, limit)?.triangle_count();
        if facets > last {
            add(2, facets, errors(&coarse, accuracy_db)?);
            last = facets;
        }
    }
    let mut chart = Chart::new(
        "Sphere of 0.1 m, 77 GHz: error against Mie, 50 directions",
        Axis::new("number of facets (log10)", 2.0, 5.0),
        Axis::new("error in dB (log10)", -2.0, 1.5),
    );
    (chart.width, chart.height) = (640.0, 400.0);
    let labels = [
        "flat facets, rms".to_string(),
        "flat facets, worst".into(),
        format!("{few} facets with normals, cut: rms"),
        "the same, worst".into(),
    ];
    for (i, (points, label)) in curves.into_iter().zip(labels).enumerate() {
        let colour = [[200, 80, 40], [30, 90, 180]][i / 2];
        let pen = if i % 2 == 0 { Pen::solid(colour, 2.0) } else { Pen::dashed(colour, 1.4, [6.0, 4.0]) };
        chart.key(label, Symbol::Line(pen));
        chart.layers.push(Layer::Line { points, pen });
    }
    println!("{}", chart.draw()?.write(file, true)?.display());
    Ok(())
}
