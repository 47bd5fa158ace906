//! A point and a corner reflector 0.35 m over a conducting plane, seen from 0.15 m: the nulls of the point are
//! the two-ray formula's, those of the corner are split in two. Writes `two_ray.png`, or the file that is named.

use catseye::base::frames::Pose;
use catseye::base::units::{dbsm_from_amplitude, wavelength_m};
use catseye::engine::{Engine, Precision};
use catseye::rcs::{Aspect, BistaticAspect, Distance, Ground, RcsOptions};
use catseye::road::reflector::Reflector;
use catseye::scene::{Material, material};
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};
use glam::DVec3;

const FREQUENCY_HZ: f64 = 77e9;
const RADAR_M: f64 = 0.15;
const TARGET_M: f64 = 0.35;

/// HH over the plane, dBsm, as if in free space at that distance.
fn curve(spec: &str, pitch: f64, ground: &Ground, ranges_m: &[f64]) -> catseye::Result<Vec<[f64; 2]>> {
    let mut scene = Reflector::parse(spec)?.to_scene(&material::by_name)?;
    scene.objects[0].pose = Pose::from_yaw_pitch_roll(DVec3::Z * TARGET_M, 0.0, pitch, 0.0);
    let engine = Engine::open("cpu", Precision::F32)?;
    let mut points = Vec::new();
    for &d in ranges_m {
        let aspect = Aspect { azimuth: 0.0, elevation: RADAR_M.atan2(d) };
        let options = RcsOptions {
            distance: Distance::At(d.hypot(RADAR_M)),
            ground: ground.clone(),
            accuracy_db: 0.05,
            last: false,
            ..Default::default()
        };
        let s = engine.rcs(&scene, &[FREQUENCY_HZ], &[BistaticAspect::monostatic(aspect)], &options)?[0];
        points.push([d, dbsm_from_amplitude(s.every[1][1].norm())]);
    }
    Ok(points)
}

fn main() -> catseye::Result<()> {
    let file = std::env::args().nth(1).unwrap_or("two_ray.png".into());
    let pec = Ground::Plane(Material::pec());
    // Even steps of 1/d are even steps of the difference of the two ways.
    let n = 2000;
    let ranges: Vec<f64> =
        (0..=n).map(|i| 1.0 / (1.0 / 60.0 + (1.0 / 3.0 - 1.0 / 60.0) * i as f64 / n as f64)).collect();
    // The corner's axis of symmetry is level.
    let tilt = 0.5f64.sqrt().atan();
    let corner = "trihedral:leg_m=0.1";
    let point = curve("point:rcs_dbsm=14.531", 0.0, &pec, &ranges)?;
    let meshed = curve(corner, tilt, &pec, &ranges)?;
    let alone = curve(corner, tilt, &Ground::None, &ranges)?;
    let mut chart = Chart::new(
        "0.35 m over a conducting plane, radar 0.15 m, 77 GHz, HH",
        Axis::new("distance (m)", 0.0, 60.0),
        Axis::new("effective RCS (dBsm)", -25.0, 30.0),
    );
    (chart.width, chart.height) = (760.0, 400.0);
    for order in 1..=6 {
        let d = 2.0 * RADAR_M * TARGET_M / (order as f64 * wavelength_m(FREQUENCY_HZ));
        let pen = Pen::dashed([150, 150, 150], 1.0, [2.0, 4.0]);
        chart.layers.push(Layer::Line { points: vec![[d, -25.0], [d, 30.0]], pen });
        if order == 1 {
            chart.key("two-ray nulls", Symbol::Line(pen));
        }
    }
    for (label, points, pen) in [
        ("corner alone", alone, Pen::dashed([90, 90, 90], 1.2, [6.0, 4.0])),
        ("point, 14.5 dBsm", point, Pen::solid([0, 114, 178], 1.2)),
        ("corner, legs 0.1 m", meshed, Pen::solid([213, 94, 0], 1.6)),
    ] {
        chart.layers.push(Layer::Line { points, pen });
        chart.key(label, Symbol::Line(pen));
    }
    println!("{}", chart.draw()?.write(file, true)?.display());
    Ok(())
}
