//! Synthesis by gridding against the direct sum in f64.

use catseye::adc::Cube;
use catseye::adc::gridding::{Costs, DEVICE_COSTS, Method, Methods, record_with};
use catseye::adc::synthesis::{Plan, point_echo};
use catseye::cpu::adc::gridding::{COSTS, synthesise_with};
use catseye::cpu::adc::synthesis::{Control, synthesise};
use catseye::frames::{Pose, direction_from_angles};
use catseye::gpu::compare::test_gpu;
use catseye::scene::radar::*;
use catseye::scene::radar_toml;
use catseye::trace::Returns;
use catseye::units::C0;
use glam::DVec3;
use num_complex::Complex64;

fn antenna(x: f64, y: f64, z: f64) -> Antenna {
    Antenna {
        position_m: DVec3::new(x, y, z),
        polarisation: Polarisation { v: Complex64::ONE, h: Complex64::ZERO },
        gain_dbi: 10.0,
        pattern: Pattern::CosinePower { azimuth_exponent: 2.0, elevation_exponent: 6.0 },
    }
}

/// 77 GHz, 1 GHz in 40 µs, 2 TX in turn each 55 µs, 3 RX.
fn radar(chirps: usize, samples: usize) -> Radar {
    let half = 0.5 * C0 / 77e9;
    Radar {
        name: "test".into(),
        carrier_hz: 77e9,
        bandwidth_hz: 1e9,
        ramp_time_s: 1.05 * samples as f64 / 12.8e6,
        chirp_period_s: 1.3 * samples as f64 / 12.8e6,
        adc_start_s: 0.5e-6,
        sample_rate_hz: 12.8e6,
        samples,
        chirps,
        sampling: Sampling::Iq,
        tx: vec![antenna(0.0, 0.0, 0.0), antenna(0.0, 3.0 * half, half)],
        rx: vec![antenna(0.0, 0.0, 0.0), antenna(0.0, half, 0.0), antenna(0.0, 2.0 * half, 0.0)],
        tx_power_dbm: 12.0,
        noise_figure_db: 12.0,
        thermal_noise: true,
        mounting: Pose::IDENTITY,
        processing: Processing {
            range_window: Window::Rectangle,
            doppler_window: Window::Rectangle,
            angle_window: Window::Rectangle,
            range_fft: 512,
            doppler_fft: 16,
            azimuth_bins: 64,
            azimuth_fov_rad: 1.0,
            elevation_bins: 1,
            elevation_fov_rad: 0.3,
            cfar: Cfar { kind: CfarKind::Ca, guard: [0, 2], train: [0, 8], pfa: 1e-3 },
            max_points: 100,
        },
    }
}

/// A repeatable spread of echoes of random phase and of powers over 40 dB.
fn many(count: usize, ranges: [f64; 2], speed: f64) -> Returns {
    let word = |i: usize, j: usize| {
        catseye::rng::philox4x32_10([i as u32, j as u32, 0, 11], [1, 2])[0] as f64 / 4_294_967_296.0
    };
    let echo = |i: usize| {
        let range = ranges[0] + (ranges[1] - ranges[0]) * word(i, 0);
        let u = direction_from_angles(word(i, 1) - 0.5, 0.3 * (word(i, 2) - 0.5));
        let mut r = point_echo(u * range, DVec3::ZERO, 1.0, 1);
        r.arrival = direction_from_angles(word(i, 3) - 0.5, 0.3 * (word(i, 4) - 0.5));
        r.last_range_m = range * (0.5 + word(i, 5));
        r.path_rate_mps = 4.0 * speed * (word(i, 6) - 0.5);
        let a = Complex64::from_polar(10f64.powf(-2.0 * word(i, 7)) / range, 6.3 * word(i, 8));
        r.spread = [[a, Complex64::ZERO], [Complex64::ZERO, a]];
        r
    };
    Returns { returns: (0..count).map(echo).collect(), rays: 0 }
}

/// Worst error over the peak, and relative L2.
fn errors(got: &Cube<f32>, truth: &Cube<f64>) -> (f64, f64) {
    assert_eq!(got.data.len(), truth.data.len());
    let got = got.to_f64();
    let peak = truth.data.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let worst = got.data.iter().zip(&truth.data).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let l2 = got.data.iter().zip(&truth.data).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>();
    assert!(worst.is_finite());
    (worst / peak, (l2 / truth.data.iter().map(|z| z.norm_sqr()).sum::<f64>()).sqrt())
}

/// A direct sum that is too dear: everything is gridded that can be.
const NEVER_DIRECT: Costs = Costs { direct: 1e9, ..COSTS };

fn gridded(radar: &Radar, list: &Returns) -> (Cube<f32>, Methods) {
    synthesise_with(&Plan::new(radar, list).unwrap(), &NEVER_DIRECT, Control::default()).unwrap()
}

fn check(name: &str, radar: &Radar, list: &Returns) -> Methods {
    let (got, methods) = gridded(radar, list);
    let plan = Plan::new(radar, list).unwrap();
    let truth = synthesise::<f64>(&plan, Control::default()).unwrap();
    let (worst, l2) = errors(&got, &truth);
    let direct = errors(&synthesise::<f32>(&plan, Control::default()).unwrap(), &truth);
    println!("{name}: worst {worst:.1e}, L2 {l2:.1e} (direct f32 {:.1e}), {methods:?}", direct.0);
    let claimed = [methods.still, methods.moving]
        .iter()
        .map(|m| if let Method::Gridded(g) = m { g.error } else { 0.0 })
        .fold(0.0, f64::max);
    assert!(claimed > 0.0, "{name} was not gridded");
    assert!(worst < 2e-5, "{name}: {worst}");
    assert!(l2 < 3.0 * claimed, "{name}: {l2}, claimed {claimed}");
    methods
}

#[test]
fn agrees_with_the_direct_sum() {
    for (samples, chirps) in [(512, 1), (300, 16), (64, 33), (17, 5), (250, 128)] {
        let radar = radar(chirps, samples);
        check(&format!("still, {samples} samples"), &radar, &many(200, [2.0, 30.0], 0.0));
        check(&format!("moving, {samples} samples"), &radar, &many(200, [2.0, 30.0], 20.0));
    }
}

/// `cargo test --release --test gridding -- --ignored --nocapture speed`
#[test]
#[ignore = "a measurement"]
fn speed() {
    let mut radar = radar_toml::preset("front77").unwrap();
    radar.chirps = 256;
    println!(
        "{} x {} x {}, loop {:.0} us, {:.2} GHz",
        radar.chirps,
        radar.channels(),
        radar.samples,
        1e6 * radar.loop_period_s(),
        1e-9 * radar.bandwidth_hz
    );
    for (count, speed) in
        [(5172, 0.0), (124_138, 0.0), (5172, 12.5), (20_000, 12.5), (124_138, 12.5), (5172, 60.0)]
    {
        let list = many(count, [2.0, 60.0], speed);
        let plan = Plan::new(&radar, &list).unwrap();
        let (mut best, mut core, mut methods) = (f64::INFINITY, f64::INFINITY, Methods::default());
        for _ in 0..5 {
            let (t, c) = (std::time::Instant::now(), core_seconds());
            methods = synthesise_with(&plan, &COSTS, Control::default()).unwrap().1;
            (best, core) = (best.min(t.elapsed().as_secs_f64()), core.min(core_seconds() - c));
        }
        println!("{} echoes, {} moving: {:?}", plan.front_end.echoes, plan.front_end.moving, methods);
        println!("  {:.1} ms, {:.1} core-ms", 1e3 * best, 1e3 * core);
    }
}

/// The same for the direct sum, per echo and sample.
#[test]
#[ignore = "a measurement"]
fn speed_direct() {
    let mut radar = radar_toml::preset("front77").unwrap();
    radar.chirps = 64;
    let list = many(2048, [2.0, 60.0], 12.5);
    let plan = Plan::new(&radar, &list).unwrap();
    let mut core = f64::INFINITY;
    for _ in 0..4 {
        let c = core_seconds();
        synthesise::<f32>(&plan, Control::default()).unwrap();
        core = core.min(core_seconds() - c);
    }
    println!("direct {:.3} ns", 1e9 * core / (2048.0 * 64.0 * 12.0 * 512.0));
}

/// Time of all threads of this process, from Linux.
fn core_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

fn on_gpu(radar: &Radar, list: &Returns, costs: &Costs) -> (Cube<f32>, Methods, f64) {
    let plan = Plan::new(radar, list).unwrap();
    let mut recorder = test_gpu().recorder("gridding");
    let (cube, methods) = record_with(&plan, test_gpu(), &mut recorder, costs).unwrap();
    let pending = cube.read(&mut recorder);
    let mut done = recorder.submit().unwrap();
    let seconds = done.seconds();
    (cube.take(&mut done, pending), methods, seconds)
}

#[test]
fn gpu_agrees_with_the_direct_sum() {
    let costs = Costs { direct: 1e9, ..DEVICE_COSTS };
    for (samples, chirps) in [(512, 1), (300, 16), (64, 33), (17, 5), (1500, 7)] {
        for speed in [0.0, 20.0] {
            let radar = radar(chirps, samples);
            let list = many(200, [2.0, 30.0], speed);
            let (got, methods, _) = on_gpu(&radar, &list, &costs);
            let truth = synthesise::<f64>(&Plan::new(&radar, &list).unwrap(), Control::default()).unwrap();
            let (worst, l2) = errors(&got, &truth);
            println!(
                "{samples} samples, {chirps} chirps, {speed} m/s: worst {worst:.1e}, L2 {l2:.1e}, {methods:?}"
            );
            assert!(worst < 2e-5 && l2 < 2e-5);
        }
    }
}

#[test]
fn kernels_are_what_their_rows_say() {
    use catseye::adc::{grid_fft, grid_lines, grid_spread};
    for kernel in [&grid_spread::KERNEL, &grid_fft::KERNEL, &grid_lines::KERNEL] {
        catseye::gpu::layout::check_kernel(kernel).unwrap();
    }
}
