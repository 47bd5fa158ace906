//! Echoes whose directions turn during a frame: each channel against a direct sum in f64 over the exact places of the target and of
//! the channel's own elements at each sample (CONVENTIONS eq. 144).

use catseye::adc::synthesis::Plan;
use catseye::base::frames::Pose;
use catseye::base::units::C0;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::scene::motion::{Joint, Motion};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Scene, Shape, material};
use catseye::simulate::{radar_pose, simulate};
use catseye::trace::{Echo, Echoes};
use glam::{DQuat, DVec3};
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

/// 12 virtual channels of half a wavelength, 20 ms.
fn scenario(ego: &str) -> SitedScenario {
    let text = format!("name = \"s\"\nradar = \"front77\"\n[ego]\n{ego}\n");
    let mut s = scenario::parse(Path::new("s.toml"), &text).unwrap().without_roads().unwrap();
    let radar = &mut s.radars[0];
    radar.thermal_noise = false;
    let half = 0.5 * radar.wavelength_m();
    let (tx, rx) = (radar.tx[0].clone(), radar.rx[0].clone());
    let row = |of: &catseye::scene::radar::Antenna, count: usize, step: f64| {
        let middle = 0.5 * (count as f64 - 1.0);
        (0..count)
            .map(|i| catseye::scene::radar::Antenna {
                position_m: DVec3::Y * (step * (i as f64 - middle)),
                ..of.clone()
            })
            .collect::<Vec<_>>()
    };
    radar.tx = row(&tx, 3, 4.0 * half);
    radar.rx = row(&rx, 4, half);
    (radar.chirps, radar.samples) = ((0.02 / radar.loop_period_s()) as usize, 48);
    (radar.processing.doppler_fft, radar.processing.range_fft) = (radar.chirps.next_power_of_two(), 64);
    s
}

/// One point target, and something beside it.
fn scene(at: DVec3, velocity_mps: DVec3) -> Scene {
    let mut scene = Scene::default();
    let metal = scene.material_index(&material::by_name("pec").unwrap());
    let far = catseye::road::shape::cuboid(DVec3::splat(0.1), DVec3::new(-90.0, 0.0, 0.0), metal);
    scene.add_mesh("far", "", far, Pose::IDENTITY);
    let shape = Shape::Point { rcs_dbsm: 0.0 };
    scene.add_object("point", "", shape, Pose::new(DQuat::IDENTITY, at), velocity_mps);
    scene
}

/// Delay of what is received at `t`: from where the transmitter was then over where the target was then.
fn delay_s(target: &dyn Fn(f64) -> DVec3, tx: &dyn Fn(f64) -> DVec3, rx: DVec3, t: f64) -> f64 {
    let (mut back, mut out) = (0.0, 0.0);
    for _ in 0..6 {
        back = (target(t - back) - rx).length() / C0;
        out = (target(t - back) - tx(t - back - out)).length() / C0;
    }
    back + out
}

/// Largest phase errors of the samples of one frame, rad: of any channel, and of any channel against the mean of all.
struct Off {
    phase: f64,
    between: f64,
}

fn off(radar: &Radar, s: &SitedScenario, target: &dyn Fn(f64) -> DVec3, cube: &[Complex64]) -> Off {
    let slope = radar.slope_hz_per_s();
    let lines = radar.lines();
    let mut errors = Vec::with_capacity(cube.len());
    let samples = [0, lines.count / 2, lines.count - 1];
    for m in 0..radar.chirps {
        for (k, tx) in radar.tx.iter().enumerate() {
            for (q, rx) in radar.rx.iter().enumerate() {
                for n in samples {
                    let ramp = lines.start_s + n as f64 * lines.step_s;
                    let t = radar.chirp_start_s(m, k) + ramp;
                    let place = |p: DVec3| move |t: f64| radar_pose(radar, &s.ego, t).0.point(p);
                    let tau = delay_s(target, &place(tx.position_m), place(rx.position_m)(t), t);
                    let turns = (lines.first_hz + n as f64 * lines.step_hz) * tau - 0.5 * slope * tau * tau;
                    let at = ((m * radar.tx.len() + k) * radar.rx.len() + q) * lines.count + n;
                    errors.push(cube[at] * Complex64::cis(-TAU * (turns - turns.floor())));
                }
            }
        }
    }
    // The phase of the amplitude is the same everywhere: that of the middle chirp.
    let per_chirp = radar.channels() * samples.len();
    let middle: Complex64 = errors[radar.chirps / 2 * per_chirp..][..per_chirp].iter().sum();
    let mut off = Off { phase: 0.0, between: 0.0 };
    for chirp in errors.chunks(per_chirp) {
        for n in 0..samples.len() {
            let all = || chirp.iter().skip(n).step_by(samples.len());
            let mean: Complex64 = all().map(|z| z / z.norm()).sum();
            for z in all() {
                off.phase = off.phase.max((z * middle.conj()).arg().abs());
                off.between = off.between.max((z * mean.conj()).arg().abs());
            }
        }
    }
    off
}

/// The same echoes with directions that stay as in the middle of the frame.
fn unturned(list: &[Echo]) -> Echoes {
    let fixed = |r: &Echo| Echo {
        first_velocity_mps: r.departure * r.departure.dot(r.first_velocity_mps),
        last_velocity_mps: r.arrival * r.arrival.dot(r.last_velocity_mps),
        ..r.clone()
    };
    Echoes { list: list.iter().map(fixed).collect(), ..Default::default() }
}

fn compare(name: &str, s: &SitedScenario, at: DVec3, velocity_mps: DVec3) -> [Off; 3] {
    let scene = scene(at, velocity_mps);
    let radar = &s.radars[0];
    let target = |t: f64| at + velocity_mps * t;
    let samples = |engine: &Engine| {
        let frame = simulate(engine, s, &scene, 0).unwrap();
        let cube: Vec<Complex64> = match frame.samples().unwrap() {
            AnyCube::F64(cube) => cube.data.clone(),
            AnyCube::F32(cube) => {
                cube.data.iter().map(|z| Complex64::new(z.re.into(), z.im.into())).collect()
            }
        };
        (frame.echoes, cube)
    };
    let (echoes, exact) = samples(&Engine::Cpu(Precision::F64));
    let (_, fast) = samples(&Engine::Cpu(Precision::F32));
    let fixed = unturned(&echoes.list);
    let fixed = catseye::adc::cpu::synthesis::synthesise::<f64>(
        &Plan::new(radar, &fixed).unwrap(),
        catseye::base::control::Control::default(),
    )
    .unwrap();
    let all = [exact, fast, fixed.data].map(|cube| off(radar, s, &target, &cube));
    for (what, o) in ["f64", "f32", "with the directions of the middle"].iter().zip(&all) {
        println!("{name}, {what}: {:.4} rad off, {:.4} between channels", o.phase, o.between);
    }
    all
}

/// A target crosses at 36 m/s: the phase between channels follows its direction through the frame.
#[test]
fn channels_follow_a_crossing_target() {
    let s = scenario("speed_mps = 0");
    for (range, azimuth) in [(10.0, 0.0f64), (14.0, 0.35), (20.0, -0.2)] {
        let u = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let mount = radar_pose(&s.radars[0], &s.ego, 0.0).0.translation_m;
        let at = mount + u * range;
        let name = format!("{range} m, {azimuth} rad");
        let [exact, fast, fixed] = compare(&name, &s, at, DVec3::Y * 36.0);
        assert!(exact.between < 0.005 && fast.between < 0.02, "{name}");
        assert!(exact.phase < 0.02 && fast.phase < 0.02, "{name}");
        assert!(fixed.between > 0.2, "{name}");
    }
}

/// The radar passes a target that stands, and turns as it does.
#[test]
fn channels_follow_what_a_turning_radar_passes() {
    let mut s = scenario("speed_mps = 0");
    s.ego.motion = Some(Arc::new(Motion {
        joints: vec![
            Joint::Spin { axis: DVec3::Z, rate_rad_per_s: 0.6, angle_rad: 0.1 },
            Joint::Line(DVec3::new(3.0, 20.0, 0.0)),
        ],
    }));
    let [exact, fast, fixed] = compare("turning", &s, DVec3::new(16.0, 2.0, 0.5), DVec3::ZERO);
    assert!(exact.between < 0.02 && fast.between < 0.02 && fixed.between > 0.3);
}
