//! Two corner reflectors 17 m ahead, 3 m apart, seen by five receivers (Miyake, figures 1 and 2): spectra of MUSIC, Bi-SVD and
//! the beamformer and the directions of ESPRIT, from one snapshot through the whole chain. Prints what a Bi-SVD update costs beside
//! a full decomposition. Writes `two_corners.png`, or the file that is named.

use catseye::base::control::Control;
use catseye::base::frames::{Pose, Sensor, World};
use catseye::dsp::cpu::doa_spectrum::spectra;
use catseye::dsp::doa_beamform::Grid;
use catseye::dsp::doa_bisvd::{costs, times};
use catseye::dsp::doa_estimate::{Cells, Estimator, Method, Options, Smoothing, SourceNumber};
use catseye::dsp::doa_manifold::Manifold;
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::road::reflector::Reflector;
use catseye::scene::{Scene, material, radar_toml};
use catseye::trace::TraceOptions;
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;

const RANGE_M: f64 = 17.0;
const APART_M: f64 = 3.0;

fn main() -> catseye::Result<()> {
    let file = std::env::args().nth(1).unwrap_or("two_corners.png".into());
    let radar = radar_toml::preset("fmcw76")?.part(0);
    let engine = Engine::open("cpu", Precision::F32)?;
    // The corners' apexes at 17 m, their axes level and towards the radar.
    let half = (0.5 * APART_M / RANGE_M).asin();
    let corner = Reflector::parse("trihedral:leg_m=0.1")?.to_scene(&material::by_name)?;
    let mut scene = Scene::default();
    let first = scene.add_meshes(&corner);
    for azimuth in [half, -half] {
        let at = DVec3::new(RANGE_M * azimuth.cos(), RANGE_M * azimuth.sin(), 0.0);
        let pose = Pose::from_yaw_pitch_roll(at, PI + azimuth, 0.5f64.sqrt().atan(), 0.0);
        scene.add_mesh("corner", "reflector", scene.meshes[first].clone(), pose);
    }
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
    let pose: Pose<Sensor, World> = Pose::IDENTITY;
    let options = TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() };
    let echoes = engine.trace(&geometry, &radar, &pose, DVec3::ZERO, &options)?;
    let (cube, _) = engine.cube(&radar, &echoes, &[], 1, 0, Control::default())?;
    let found = engine.range_doppler(&radar, &cube)?;
    let snapshot: Vec<Complex64> = found.snapshots.of(0).to_vec();
    println!("strongest cell at {:.2} m", f64::from(found.cells[0].range) * radar.range_bin_m());

    let mut wide = radar.clone();
    (wide.processing.azimuth_bins, wide.processing.azimuth_fov_rad) = (801, 40f64.to_radians());
    let grid = Grid::new(&wide)?;
    let cells = Cells { snapshots: 1, data: &snapshot, noise_w: None };
    let estimator = |method| {
        let options = Options {
            method,
            sources: SourceNumber::Given(2),
            smoothing: Smoothing::Subarray([1, 4]),
            forward_backward: Some(true),
            ..Default::default()
        };
        Estimator::new(Manifold::of_radar(&radar)?, grid.clone(), options)
    };
    let mut chart = Chart::new(
        "two corners at 17 m, 3 m apart, five receivers, one snapshot",
        Axis::new("azimuth (deg)", -40.0, 40.0),
        Axis::new("spectrum over its peak (dB)", -50.0, 5.0),
    );
    (chart.width, chart.height) = (760.0, 420.0);
    for azimuth in [half, -half] {
        let a = azimuth.to_degrees();
        let pen = Pen::dashed([150, 150, 150], 1.0, [2.0, 4.0]);
        chart.layers.push(Layer::Line { points: vec![[a, -50.0], [a, 5.0]], pen });
        if azimuth > 0.0 {
            chart.key("true directions", Symbol::Line(pen));
        }
    }
    for (label, method, pen) in [
        ("beamformer", Method::Bartlett, Pen::solid([90, 90, 90], 1.4)),
        ("MUSIC", Method::Music, Pen::solid([213, 94, 0], 1.6)),
        ("Bi-SVD", Method::BiSvd { forgetting: 0.9 }, Pen::dashed([0, 114, 178], 1.4, [7.0, 4.0])),
    ] {
        let spectrum = estimator(method)?.spectra(&cells, |t, f| Ok(spectra::<f64>(t, f)))?;
        let peak = spectrum.iter().copied().fold(0.0, f64::max);
        let points =
            grid.azimuth_rad.iter().zip(&spectrum).map(|(a, p)| [a.to_degrees(), 10.0 * (p / peak).log10()]);
        chart.layers.push(Layer::Line { points: points.collect(), pen });
        chart.key(label, Symbol::Line(pen));
    }
    let esprit = estimator(Method::Esprit)?.estimate_cells(&cells, |t, f| Ok(spectra::<f64>(t, f)))?;
    let pen = Pen::solid([0, 158, 115], 2.0);
    for s in &esprit[0] {
        println!("ESPRIT: {:.2} deg (true {:.2})", s.azimuth_rad.to_degrees(), half.to_degrees());
        let a = s.azimuth_rad.to_degrees();
        chart.layers.push(Layer::Line { points: vec![[a, -50.0], [a, -35.0]], pen });
    }
    chart.key("ESPRIT", Symbol::Line(pen));

    // Costs of one update with N = 5, L = 2 (the document: 928 against 3335 multiplications, 45 % less time).
    let stream: Vec<Complex64> = (0..20_000)
        .flat_map(|t| {
            let turn = move |c: usize, sign: f64| {
                Complex64::cis(sign * PI * half.sin() * c as f64 + f64::from(t) * (0.7 + 0.9 * sign))
            };
            (0..5).map(move |c| turn(c, 1.0) + turn(c, -1.0))
        })
        .collect();
    println!("{:?}", costs(&stream, 5, 2, 0.9)?);
    println!("{:?}", times(&stream, 5, 2, 0.9)?);
    println!("{}", chart.draw()?.write(file, true)?.display());
    Ok(())
}
