//! Corner S (trihedral, legs 0.10 m, 14.5 dBsm) 0.35 m over asphalt, driven up to from 40 m to 3 m by a radar 0.15 m high
//! (Feng 2019, figure 3.1): received power at its cell against distance, with noise, with what the asphalt returns, and between the two
//! envelopes of the two-ray field. Corner and asphalt are meshes of one scene, traced and processed as any. Writes `corner_drive.png`, or the file that is named.

use catseye::base::control::Control;
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::{db_from_power, dbm_from_w, power_from_db, w_from_dbm, wavenumber};
use catseye::em::fresnel::{rayleigh_factor, reflection};
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::road::objects::ground;
use catseye::road::reflector::Reflector;
use catseye::scene::radar::{Radar, Window};
use catseye::scene::{Scene, material, radar_toml};
use catseye::trace::{Echoes, TraceOptions};
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

const RADAR_M: f64 = 0.15;
const TARGET_M: f64 = 0.35;
const STEP_M: f64 = 0.05;

/// Largest power of the map within half a metre of `range_m`, and the median beyond 50 m, in W.
fn level(
    engine: &Engine,
    radar: &Radar,
    echoes: &Echoes,
    range_m: f64,
    frame: u32,
) -> catseye::Result<[f64; 2]> {
    let (cube, _) = engine.cube(radar, echoes, &[], 1, frame, Control::default())?;
    let map = engine.range_doppler(radar, &cube)?.map;
    let bin = |r: f64| (r / radar.range_bin_m()).round() as usize;
    let rows = 0..map.doppler_bins;
    let near = rows.clone().flat_map(|d| (bin(range_m - 0.5)..=bin(range_m + 0.5)).map(move |r| (d, r)));
    let top = near.map(|(d, r)| map.at(d, r)).fold(0.0, f64::max);
    let mut far: Vec<f64> = rows
        .flat_map(|d| (bin(50.0)..map.range_bins).map(move |r| (d, r)))
        .map(|(d, r)| map.at(d, r))
        .collect();
    far.sort_by(f64::total_cmp);
    Ok([top, far[far.len() / 2]])
}

fn main() -> catseye::Result<()> {
    let file = std::env::args().nth(1).unwrap_or("corner_drive.png".into());
    let mut radar = radar_toml::preset("feng77")?;
    // A short frame: nothing moves in it. Each position is one.
    radar.chirps = 16;
    radar.processing.doppler_fft = 16;
    radar.processing.doppler_window = Window::Rectangle;
    radar.processing.range_window = Window::Hann;
    radar.tx.truncate(1);
    radar.rx.truncate(1);
    let engine = Engine::open("cpu", Precision::F32)?;
    let asphalt = material::by_name("asphalt")?;
    let mut road = Scene::default();
    let m = road.material_index(&asphalt);
    let plane = ground(DVec2::new(-5.0, -10.0), DVec2::new(70.0, 10.0), 0.0, m);
    road.add_mesh("road", "road", plane, Pose::IDENTITY);
    let empty = Geometry::build(&road, 0.0, radar.carrier_hz)?;
    let pose: Pose<Sensor, World> = Pose::from_yaw_pitch_roll(DVec3::Z * RADAR_M, 0.0, 0.0, 0.0);
    let corner = Reflector::parse("trihedral:leg_m=0.1")?;
    corner.add_to(&mut road, &material::by_name, ("corner", "marker"), Pose::IDENTITY, DVec3::ZERO)?;
    // The corner's axis of symmetry is level and looks at the radar.
    let tilt = 0.5f64.sqrt().atan();

    let k = wavenumber(radar.carrier_hz);
    let (mut seen, mut noise, mut clutter) = (Vec::new(), Vec::new(), Vec::new());
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    let steps = ((40.0 - 3.0) / STEP_M) as u32;
    for i in 0..=steps {
        let d = 3.0 + f64::from(i) * STEP_M;
        let range = d.hypot(RADAR_M);
        let options = TraceOptions { bandwidth_hz: radar.bandwidth_hz(), rays: 20_000, ..Default::default() };
        if i % 5 == 0 {
            let echoes = engine.trace(&empty, &radar, &pose, DVec3::ZERO, &options)?;
            clutter.push([d, dbm_from_w(level(&engine, &radar, &echoes, range, i)?[0])]);
        }
        road.objects[1].pose = Pose::from_yaw_pitch_roll(DVec3::new(d, 0.0, TARGET_M), PI, tilt, 0.0);
        let geometry = Geometry::build(&road, 0.0, radar.carrier_hz)?;
        let echoes = engine.trace(&geometry, &radar, &pose, DVec3::ZERO, &options)?;
        let [top, floor] = level(&engine, &radar, &echoes, range, i)?;
        seen.push([d, dbm_from_w(top)]);
        noise.push([d, dbm_from_w(floor)]);
        // Free space times (1 +- |rho|)^4, rho at the grazing angle of the mirror path.
        let grazing = (RADAR_M + TARGET_M).atan2(d);
        let eps = asphalt.eps_r(radar.carrier_hz)?;
        let smooth = reflection(eps, grazing.sin()).1.norm();
        let rho = smooth * rayleigh_factor(k, asphalt.roughness_rms_m, grazing.sin());
        let gain = power_from_db(radar.tx[0].gain_dbi);
        let free = w_from_dbm(radar.tx_power_dbm)
            * gain
            * gain
            * radar.wavelength_m().powi(2)
            * power_from_db(14.531)
            / ((4.0 * PI).powi(3) * range.powi(4));
        upper.push([d, dbm_from_w(free) + db_from_power((1.0 + rho).powi(4))]);
        lower.push([d, dbm_from_w(free) + db_from_power((1.0 - rho).powi(4))]);
    }
    let mut chart = Chart::new(
        "corner S 0.35 m over asphalt, radar 0.15 m, feng77, VV",
        Axis::new("distance (m)", 0.0, 40.0),
        Axis::new("power in its cell (dBm)", -140.0, -30.0),
    );
    (chart.width, chart.height) = (760.0, 420.0);
    for (label, points, pen) in [
        ("noise", noise, Pen::solid([170, 170, 170], 1.0)),
        ("asphalt alone, within 0.5 m", clutter, Pen::solid([0, 158, 115], 1.0)),
        ("two-ray envelopes", upper, Pen::dashed([90, 90, 90], 1.2, [6.0, 4.0])),
        ("", lower, Pen::dashed([90, 90, 90], 1.2, [6.0, 4.0])),
        ("corner S", seen, Pen::solid([213, 94, 0], 1.2)),
    ] {
        chart.layers.push(Layer::Line { points, pen });
        if !label.is_empty() {
            chart.key(label, Symbol::Line(pen));
        }
    }
    println!("{}", chart.draw()?.write(file, true)?.display());
    Ok(())
}
