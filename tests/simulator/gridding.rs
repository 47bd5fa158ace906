//! Synthesis by gridding against the direct sum in f64.

use catseye::adc::Cube;
use catseye::adc::cpu::gridding::{COSTS, add, synthesise_with};
use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::grid_device::{DEVICE_COSTS, record_with};
use catseye::adc::grid_echoes::GridEchoes;
use catseye::adc::gridding::{Bell, Bells, Costs, ECHOES_KEPT, GridLayout, Line, TAPS, Warp};
use catseye::adc::methods::{Method, Methods};
use catseye::adc::schedule::{Shape, Term, groups};
use catseye::adc::synthesis::{PhasePolynomial, Plan, Set, point_echo};
use catseye::base::control::Control;
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::base::units::C0;
use catseye::gpu::Gpu;
use catseye::gpu::compare::{opened_for_tests, test_device_name, test_gpu};
use catseye::scene::radar::*;
use catseye::scene::radar_toml;
use catseye::scene::waveform::{Multiplex, Waveform};
use catseye::trace::Echoes;
use glam::DVec3;
use num_complex::{Complex32, Complex64};
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

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
        waveform: Waveform::chirp(1e9, 1.05 * samples as f64 / 12.8e6, 1.3 * samples as f64 / 12.8e6),
        multiplex: Multiplex::Tdm,
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
        front_end: Default::default(),
        mounting: Pose::IDENTITY,
        motion: None,
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
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Ca, guard: [0, 2], train: [0, 8], pfa: 1e-3 },
            max_points: 100,
        },
    }
}

/// The same ramp with another bandwidth.
fn swept(radar: &Radar, bandwidth_hz: f64) -> Waveform {
    Waveform::chirp(bandwidth_hz, radar.waveform.ramp().unwrap().time_s, radar.chirp_period_s())
}

/// A repeatable spread of echoes of random phase and of powers over 40 dB.
pub fn many(count: usize, ranges: [f64; 2], speed: f64) -> Echoes {
    let word = |i: usize, j: usize| {
        catseye::base::rng::philox4x32_10([i as u32, j as u32, 0, 11], [1, 2])[0] as f64 / 4_294_967_296.0
    };
    let echo = |i: usize| {
        let range = ranges[0] + (ranges[1] - ranges[0]) * word(i, 0);
        let u = direction_from_angles(word(i, 1) - 0.5, 0.3 * (word(i, 2) - 0.5));
        let mut r = point_echo(u * range, DVec3::ZERO, 1.0, 1);
        r.arrival = direction_from_angles(word(i, 3) - 0.5, 0.3 * (word(i, 4) - 0.5));
        r.last_range_m = range * (0.5 + word(i, 5));
        r.path_rate_mps = 4.0 * speed * (word(i, 6) - 0.5);
        let a = Complex64::from_polar(10f64.powf(-2.0 * word(i, 7)) / range, 6.3 * word(i, 8));
        r.path_gain = [[a, Complex64::ZERO], [Complex64::ZERO, a]];
        r
    };
    Echoes { list: (0..count).map(echo).collect(), ..Default::default() }
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

fn gridded(radar: &Radar, all: &Echoes) -> (Cube<f32>, Methods) {
    synthesise_with(&Plan::new(radar, all).unwrap(), &NEVER_DIRECT, Control::default()).unwrap()
}

fn check(name: &str, radar: &Radar, all: &Echoes) -> Methods {
    check_within(2e-5, name, radar, all)
}

/// −80 dB of the peak: what holds however echoes conspire.
const ALWAYS: f64 = 1e-4;

fn check_within(most: f64, name: &str, radar: &Radar, all: &Echoes) -> Methods {
    let (got, methods) = gridded(radar, all);
    let plan = Plan::new(radar, all).unwrap();
    let truth = synthesise::<f64>(&plan, Control::default()).unwrap();
    let (worst, l2) = errors(&got, &truth);
    let direct = errors(&synthesise::<f32>(&plan, Control::default()).unwrap(), &truth);
    println!("{name}: worst {worst:.1e}, L2 {l2:.1e} (direct f32 {:.1e}), {methods:?}", direct.0);
    let claimed = [methods.still, methods.moving]
        .iter()
        .map(|m| if let Method::Gridded(g) = m { g.error } else { 0.0 })
        .fold(0.0, f64::max);
    assert!(claimed > 0.0, "{name} was not gridded");
    assert!(worst < most, "{name}: {worst}");
    assert!(l2 < claimed.max(0.2 * most), "{name}: {l2}, claimed {claimed}");
    methods
}

#[test]
fn agrees_with_the_direct_sum() {
    for (samples, chirps) in [(512, 1), (300, 16), (64, 33), (17, 5), (250, 128)] {
        for sampling in [Sampling::Iq, Sampling::Real] {
            let radar = Radar { sampling, ..radar(chirps, samples) };
            let ranges = if samples < 50 { [0.1, 0.6] } else { [2.0, 12.0] };
            check(&format!("still, {samples} samples"), &radar, &many(150, ranges, 0.0));
            check(&format!("moving, {samples} samples"), &radar, &many(150, ranges, 20.0));
        }
    }
    // Both together, which meet in one cube.
    let (radar, mut all) = (radar(32, 200), many(100, [2.0, 30.0], 15.0));
    all.list.extend(many(120, [2.0, 30.0], 0.0).list);
    let methods = check("both", &radar, &all);
    assert!(matches!((methods.still, methods.moving), (Method::Gridded(_), Method::Gridded(_))));
}

/// Cells of range that echoes pass through during a frame, from a fraction to far more than the scenes of
/// the issue; wide bands; fast targets.
/// Paths that bend, some a little and some as next to a car that drives by: within -60 dB of the direct sum, by blocks that are
/// as short as each part needs.
#[test]
fn agrees_when_paths_bend() {
    let radar = radar(192, 200);
    let mut all = many(600, [4.0, 50.0], 12.0);
    for (i, r) in all.list.iter_mut().enumerate() {
        let a = 100.0 / f64::from(1 + i as u32 % 60);
        r.path_acceleration_and_jerk = [if i % 3 == 0 { -a } else { a }, 30.0 * a];
    }
    let curved = synthesise::<f64>(&Plan::new(&radar, &all).unwrap(), Control::default()).unwrap();
    let bent = check_within(1e-3, "bent", &radar, &all);
    for r in &mut all.list {
        r.path_acceleration_and_jerk = [0.0; 2];
    }
    let straight = check("straight", &radar, &all);
    let blocks = |m: Methods| if let Method::Gridded(g) = m.moving { g.blocks } else { 0 };
    assert!(blocks(bent) > blocks(straight), "{bent:?} {straight:?}");
    // Without the bend the sum is another one.
    let (flat, _) = gridded(&radar, &all);
    assert!(errors(&flat, &curved).0 > 0.1);
}

#[test]
fn agrees_however_far_echoes_migrate() {
    let base = radar(128, 256);
    let frame = base.frame_time_s();
    let cell = 0.5 * C0 / base.bandwidth_hz();
    for cells in [0.01, 1.0, 3.0, 10.0] {
        check(&format!("{cells} cells"), &base, &many(120, [5.0, 30.0], cells * cell / frame));
    }
    let wide = Radar {
        waveform: Waveform::chirp(2.46e9, 10e-6, base.chirp_period_s()),
        sample_rate_hz: 40e6,
        ..base.clone()
    };
    check("2.46 GHz at 60 m/s", &wide, &many(120, [2.0, 20.0], 60.0));
    let low = Radar { carrier_hz: 8.7e9, waveform: swept(&base, 1.5e9), ..base.clone() };
    check("1.5 GHz at 8.7 GHz", &low, &many(120, [2.0, 20.0], 30.0));
    // All echoes recede: neither a1 nor b1 has mean zero.
    let mut receding = many(120, [5.0, 30.0], 10.0);
    receding.list.iter_mut().for_each(|r| r.path_rate_mps += 60.0);
    check("receding", &base, &receding);
}

#[test]
fn agrees_in_the_near_field() {
    let mut radar = radar(32, 128);
    radar.waveform = swept(&radar, 4e9);
    radar.rx = (0..5).map(|i| antenna(0.0, 0.075 * f64::from(i), 0.02 * f64::from(i % 2))).collect();
    check("near field", &radar, &many(100, [0.8, 1.5], 5.0));
    check("near field at rest", &radar, &many(100, [0.8, 1.5], 0.0));
}

#[test]
fn few_and_equal_echoes() {
    let radar = radar(24, 100);
    for speed in [0.0, 10.0] {
        check("one", &radar, &many(1, [3.0, 30.0], speed));
        let one = many(1, [3.0, 30.0], speed).list.remove(0);
        check_within(ALWAYS, "equal", &radar, &Echoes { list: vec![one; 30_000], ..Default::default() });
        // Silent echoes beside one that is received.
        let mut silent = many(50, [3.0, 30.0], speed);
        for r in &mut silent.list[1..] {
            r.path_gain = [[Complex64::ZERO; 2]; 2];
        }
        check("silent", &radar, &silent);
    }
    let (cube, methods) = gridded(&radar, &many(0, [3.0, 30.0], 0.0));
    assert_eq!(methods, Methods::default());
    assert!(cube.data.len() == 24 * 6 * 100 && cube.data.iter().all(|z| z.norm() == 0.0));
}

/// More echoes than coefficients are kept of at a time.
#[test]
fn portions_add_up() {
    let radar = radar(3, 16);
    let count = ECHOES_KEPT / 6 + 7000;
    let mut all = many(4000, [2.0, 30.0], 20.0);
    while all.list.len() < count {
        all.list.extend_from_within(..4000.min(count - all.list.len()));
    }
    check_within(ALWAYS, "portions", &radar, &all);
}

#[test]
fn the_cheaper_way_is_taken() {
    let radar = radar(64, 256);
    let methods = |count, speed| {
        let all = many(count, [2.0, 30.0], speed);
        synthesise_with(&Plan::new(&radar, &all).unwrap(), &COSTS, Control::default()).unwrap().1
    };
    assert_eq!(methods(5, 0.0), Methods::default());
    assert_eq!(methods(5, 10.0), Methods::default());
    let (still, moving) = (methods(5000, 0.0), methods(5000, 10.0));
    assert!(still.moving == Method::Direct && moving.still == Method::Direct);
    let (Method::Gridded(s), Method::Gridded(m)) = (still.still, moving.moving) else {
        panic!("{still:?} {moving:?}")
    };
    assert!((s.blocks, s.lines) == (1, 1) && m.blocks > 1 && m.lines > m.taps);
    // Few moving echoes are summed directly beside many at rest.
    let mut all = many(5000, [2.0, 30.0], 0.0);
    all.list.extend(many(3, [2.0, 30.0], 10.0).list);
    let plan = Plan::new(&radar, &all).unwrap();
    let (cube, mixed) = synthesise_with(&plan, &COSTS, Control::default()).unwrap();
    assert!(mixed.moving == Method::Direct && mixed.still != Method::Direct);
    assert!(errors(&cube, &synthesise::<f64>(&plan, Control::default()).unwrap()).0 < 2e-5);
    // As text, for reports.
    let text = serde_json::to_string(&mixed).unwrap();
    assert!(
        text.contains(r#""moving":"direct""#) && text.contains(r#""gridded":{"grids":1,"blocks":1"#),
        "{text}"
    );
}

#[test]
fn the_same_bytes_with_any_number_of_threads() {
    let radar = radar(40, 150);
    let mut all = many(9000, [2.0, 30.0], 15.0);
    all.list.extend(many(9000, [2.0, 30.0], 0.0).list);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| gridded(&radar, &all))
    };
    let (one, methods) = run(1);
    assert!(methods.still != Method::Direct && methods.moving != Method::Direct);
    for threads in [2, 5] {
        let (cube, m) = run(threads);
        assert!(m == methods);
        assert!(bytemuck::cast_slice::<_, u32>(&cube.data) == bytemuck::cast_slice::<_, u32>(&one.data));
    }
}

#[test]
fn reports_progress_and_can_be_cancelled() {
    let radar = radar(40, 100);
    let all = many(2000, [2.0, 30.0], 15.0);
    let plan = Plan::new(&radar, &all).unwrap();
    let (most, cancel) = (AtomicU64::new(0), AtomicBool::new(false));
    let progress = |done: u64, total: u64| {
        assert_eq!(total, 40 * 6);
        most.fetch_max(done, Ordering::Relaxed);
    };
    let control = Control { progress: Some(&progress), cancel: Some(&cancel) };
    synthesise_with(&plan, &COSTS, control).unwrap();
    assert_eq!(most.load(Ordering::Relaxed), 240);
    cancel.store(true, Ordering::Relaxed);
    assert!(synthesise_with(&plan, &COSTS, control).unwrap_err().to_string().contains("cancelled"));
}

/// Echoes of no radar in particular, `law` giving b1, c and a2 from a1.
fn terms(count: usize, seed: u32, turns: [f64; 2], law: [f64; 6], off: f64) -> Vec<Term> {
    let word = |i: usize, j: u32| {
        catseye::base::rng::philox4x32_10([i as u32, j, seed, 5], [3, 4])[0] as f64 / 4_294_967_296.0 - 0.5
    };
    let term = |i: usize| {
        let a1 = turns[1] * word(i, 1);
        let polynomial = PhasePolynomial {
            amplitude: Complex64::from_polar(1.0, 6.0 * word(i, 0)),
            a0: word(i, 2),
            a1,
            a2: law[4] + law[5] * a1,
            b0: turns[0] * word(i, 3),
            b1: law[0] + law[1] * a1 + off * word(i, 4),
            c: law[2] + law[3] * a1,
            ..Default::default()
        };
        Term { polynomial, last_a1: [a1, polynomial.a2, 0.0], array_a1: 0.0, power_w: 1.0 }
    };
    (0..count).map(term).collect()
}

/// Some of them as columns of one channel.
fn columns(terms: &[Term], echoes: &[u32]) -> GridEchoes {
    let mut e = GridEchoes::silent(echoes.len(), 1);
    for (to, i) in echoes.iter().enumerate() {
        let p = &terms[*i as usize].polynomial;
        e.amplitude[to] = Complex32::new(p.amplitude.re as f32, p.amplitude.im as f32);
        (e.a0[to], e.a1[to], e.a2[to], e.a3[to]) = (p.a0, p.a1, p.a2, p.a3);
        (e.b0[to], e.b1[to], e.b2[to]) = (p.b0, p.b1, p.b2);
    }
    e
}

/// What [`groups`] lets be left out of the sum, as a share of the power.
const ALLOWED: f64 = 1e-10;

/// Echoes on the grids that are chosen for them, against the polynomial itself.
fn check_polynomial(chirps: usize, samples: usize, terms: &[Term]) {
    let shape = Shape { chirps, samples, channels: 1 };
    let mut cube = Cube::zeros(chirps, 1, samples);
    let mut gridded = vec![false; terms.len()];
    for group in groups(&shape, terms, ALLOWED, &NEVER_DIRECT) {
        let layout = group.layout.expect("a grid");
        group.echoes.iter().for_each(|i| gridded[*i as usize] = true);
        add(Sampling::Iq, &layout, &columns(terms, &group.echoes), &mut cube);
    }
    assert!(gridded.iter().all(|g| *g));
    let (worst, peak) = polynomial_error(&cube, terms);
    assert!(worst < 5e-5 * peak, "{}", worst / peak);
}

/// Largest error of a cube of one channel against the polynomials, and the peak.
fn polynomial_error(cube: &Cube<f32>, terms: &[Term]) -> (f64, f64) {
    let (chirps, samples) = (cube.chirps, cube.samples);
    let (mut worst, mut peak) = (0.0f64, 0.0f64);
    for (i, z) in cube.data.iter().enumerate() {
        let (m, n) =
            ((i / samples) as f64 - (chirps / 2) as f64, (i % samples) as f64 - (samples / 2) as f64);
        let of = |p: &PhasePolynomial| {
            let turns = p.turns(m, n);
            p.amplitude * Complex64::cis(TAU * (turns - turns.round()))
        };
        let truth: Complex64 = terms.iter().map(|t| of(&t.polynomial)).sum();
        worst = worst.max((Complex64::new(z.re.into(), z.im.into()) - truth).norm());
        peak = peak.max(truth.norm());
    }
    (worst, peak)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    /// Aliases of any order, negative frequencies, any proportion between the terms.
    #[test]
    fn any_polynomial(
        size in (1usize..40, 1usize..90),
        seed: u32,
        turns in (0.0..6.0f64, 0.0..6.0f64),
        law in proptest::array::uniform6(-1.0..1.0f64),
        off in 0.0..1e-9f64,
    ) {
        let law = [1e-3 * law[0], 1e-3 * law[1], 1e-4 * law[2], 1e-4 * law[3], 1e-9 * law[4], 1e-9 * law[5]];
        check_polynomial(size.0, size.1, &terms(40, seed, [turns.0, turns.1], law, off));
    }
}

/// Echoes whose terms follow no common law cannot be gridded well, and that is noticed: what follows one stays on grids.
#[test]
fn unrelated_terms_are_summed_directly() {
    let shape = Shape { chirps: 32, samples: 128, channels: 1 };
    let mut all = terms(50, 1, [3.0, 3.0], [1e-4, 1e-3, 1e-6, 1e-6, 0.0, 0.0], 0.0);
    let directly = |all: &[Term]| {
        let of = groups(&shape, all, ALLOWED, &NEVER_DIRECT);
        of.into_iter().filter(|g| g.layout.is_none()).flat_map(|g| g.echoes).collect::<Vec<u32>>()
    };
    assert!(directly(&all).is_empty());
    // The drift within a chirp, which no number of blocks makes smaller.
    for (i, t) in all.iter_mut().enumerate().take(10) {
        t.polynomial.c += if i % 2 == 0 { 1e-4 } else { -1e-4 };
    }
    let ten = directly(&all);
    assert!((0..10).all(|i| ten.contains(&i)), "{ten:?}");
}

/// Strong echoes and those that bend more get more blocks, and blocks are not made for what is weak.
#[test]
fn blocks_go_where_the_error_is() {
    let shape = Shape { chirps: 512, samples: 256, channels: 4 };
    let mut all = terms(20_000, 2, [3.0, 3.0], [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], 0.0);
    for (i, t) in all.iter_mut().enumerate() {
        t.polynomial.a2 = if i % 2 == 0 { 2e-7 } else { -2e-7 };
        t.power_w = if i < 40 { 1e4 } else { 1.0 };
        if i >= 10_000 {
            t.polynomial.a2 *= 0.01;
        }
    }
    let of = groups(&shape, &all, 1e-9, &COSTS);
    let blocks = |i: u32| {
        let group = of.iter().find(|g| g.echoes.contains(&i)).unwrap();
        group.layout.as_ref().map_or(usize::MAX, |l| l.blocks())
    };
    println!(
        "{:?}",
        of.iter()
            .map(|g| (g.echoes.len(), g.layout.as_ref().map(|l| (l.blocks(), l.lines))))
            .collect::<Vec<_>>()
    );
    assert!(
        blocks(0) > blocks(100) && blocks(100) > blocks(15_000),
        "{} {} {}",
        blocks(0),
        blocks(100),
        blocks(15_000)
    );
    let left_out: f64 = of.iter().map(|g| g.error_w).sum();
    let all_w: f64 = all.iter().map(|t| t.power_w).sum();
    assert!(left_out < 1.5e-9 * all_w, "{}", left_out / all_w);
    assert_eq!(of.iter().map(|g| g.echoes.len()).sum::<usize>(), all.len());
}

/// Blocks of two chirps keep any bend: two values of m² lie on a straight line.
#[test]
fn two_chirps_keep_a_bend() {
    let (chirps, samples) = (16, 64);
    let mut all = terms(40, 5, [3.0, 3.0], [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], 0.0);
    for (i, t) in all.iter_mut().enumerate() {
        t.polynomial.a2 = if i % 2 == 0 { 2e-3 } else { -2e-3 };
        t.polynomial.b2 = 1e-3 * t.polynomial.a2;
    }
    let warp = Warp { b1: Line { slope: 1e-3, offset: 0.0 }, ..Warp::default() };
    let layout = GridLayout::moving((chirps, samples), 2, [-1.6, 1.6], warp, &Bells::new(samples, &COSTS));
    let mut cube = Cube::zeros(chirps, 1, samples);
    add(Sampling::Iq, &layout, &columns(&all, &(0..40).collect::<Vec<u32>>()), &mut cube);
    let (worst, peak) = polynomial_error(&cube, &all);
    assert!(worst < 2e-5 * peak, "{}", worst / peak);
}

/// A few echoes that are far from all others do not shift the warp, so that the others need no more blocks.
#[test]
fn outliers_do_not_shift_the_warp() {
    let shape = Shape { chirps: 256, samples: 256, channels: 4 };
    let mut all = terms(5000, 6, [3.0, 1.0], [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], 0.0);
    let blocks = |all: &[Term]| {
        let of = groups(&shape, all, 1e-9, &COSTS);
        of.iter().find(|g| g.echoes.contains(&1000)).unwrap().layout.as_ref().map(|l| l.blocks())
    };
    let lawful = blocks(&all);
    for t in &mut all[..100] {
        t.polynomial.a2 += 3e-4 * (1.0 + t.polynomial.a1);
        t.polynomial.b1 += 1e-5;
        t.last_a1 = [t.polynomial.a1, t.polynomial.a2, 0.0];
    }
    assert!(lawful.is_some());
    assert_eq!(blocks(&all), lawful);
}

/// Points along a road as a moving radar meets them, with paths that are right to the cubic in time: strong ones far between weak ones.
fn roadside(radar: &Radar, count: usize, speed_mps: f64, brake_mps2: f64, ranges: [f64; 2]) -> Echoes {
    let word = |i: usize, j: u32| {
        catseye::base::rng::philox4x32_10([i as u32, j, 7, 11], [5, 6])[0] as f64 / 4_294_967_296.0
    };
    let echo = |i: usize| {
        let x = ranges[0] + (ranges[1] - ranges[0]) * word(i, 0).powi(2);
        let y = 20.0 * (word(i, 1) - 0.5);
        let at = DVec3::new(x, y + y.signum(), 3.0 * (word(i, 2) - 0.3));
        // A third of them drives along with the radar.
        let own = if i.is_multiple_of(3) { speed_mps * word(i, 3) } else { 0.0 };
        let ahead = |t: f64| {
            let v = own - speed_mps;
            2.0 * (at + DVec3::X * (v * t + 0.5 * brake_mps2 * t * t)).length()
        };
        let reach = 0.5 * radar.frame_time_s();
        let mut r = point_echo(at, DVec3::X * (own - speed_mps), 1.0, 1);
        let (l0, rate) = (ahead(0.0), r.path_rate_mps);
        let (before, after) = (ahead(-reach), ahead(reach));
        r.path_acceleration_and_jerk = [
            (before + after - 2.0 * l0) / (reach * reach),
            3.0 * (after - before - 2.0 * rate * reach) / reach.powi(3),
        ];
        let a = Complex64::from_polar(10f64.powf(-3.0 * word(i, 4)) / at.length_squared(), 6.3 * word(i, 5));
        r.path_gain = [[a, Complex64::ZERO], [Complex64::ZERO, a]];
        r
    };
    Echoes { list: (0..count).map(echo).collect(), ..Default::default() }
}

/// Error of some samples all over the cube against the direct f64 sum, dB of Σ|A|²; and how they were summed.
fn sampled_error_db(radar: &Radar, all: &Echoes) -> (f64, Methods) {
    let plan = Plan::new(radar, all).unwrap();
    let (got, methods) = synthesise_with(&plan, &NEVER_DIRECT, Control::default()).unwrap();
    let word = |i: usize, j: u32| {
        catseye::base::rng::philox4x32_10([i as u32, j, 1, 3], [7, 8])[0] as f64 / 4_294_967_296.0
    };
    let some: Vec<u32> = plan.set(Set::Moving).iter().chain(plan.set(Set::Still)).copied().collect();
    let (mut sum, mut count) = (0.0, 0);
    for channel in [0, plan.channels / 2, plan.channels - 1] {
        let of = plan.channel(channel);
        let terms: Vec<PhasePolynomial> = some.iter().map(|i| of.coefficients(*i)).collect();
        let ends = [0, plan.chirps - 1].into_iter().flat_map(|m| [(m, 0), (m, plan.samples - 1)]);
        let within = (0..120).map(|i| {
            let at = |j, n: usize| (word(i, j) * n as f64) as usize;
            (at(0, plan.chirps), at(1, plan.samples))
        });
        for (m, n) in ends.chain(within) {
            let mut truth = Complex64::ZERO;
            for k in &terms {
                let turns = k.turns(m as f64, n as f64);
                truth += k.amplitude * Complex64::cis(TAU * (turns - turns.round()));
            }
            if plan.sampling == Sampling::Real {
                truth = Complex64::new(std::f64::consts::SQRT_2 * truth.re, 0.0);
            }
            let z = got.row(m, channel)[n];
            sum += (Complex64::new(z.re.into(), z.im.into()) - truth).norm_sqr() / plan.power(channel);
            count += 1;
        }
    }
    (10.0 * (sum / f64::from(count)).log10(), methods)
}

/// The samples of nine frames, of radars and motions unlike one another, within -80 dB of Σ|A|² of the direct f64 sum.
#[test]
fn nine_frames_are_within_80_db() {
    let preset = |name: &str| radar_toml::preset(name).unwrap();
    let awr = Radar {
        chirps: 128,
        samples: 256,
        waveform: Waveform::chirp(770e6, 25.6e-6, 40e-6),
        sample_rate_hz: 10e6,
        ..preset("demo77")
    };
    let half = 0.5 * C0 / 77e9;
    let grid = Radar {
        tx: (0..12).map(|i| antenna(0.0, 16.0 * half * f64::from(i % 4), half * f64::from(i / 4))).collect(),
        rx: (0..16).map(|i| antenna(0.0, half * f64::from(i), 0.0)).collect(),
        ..radar(64, 256)
    };
    let mut near = radar(64, 256);
    near.waveform = swept(&near, 4e9);
    let bands = Radar { multiplex: Multiplex::Ddm { bands: 4 }, ..radar(128, 256) };
    let far = [3.0, 90.0];
    let cases = [
        ("front77", preset("front77"), 20.0, 0.0, far),
        ("demo77", preset("demo77"), 15.0, 0.0, far),
        ("feng77", preset("feng77"), 15.0, 0.0, [3.0, 55.0]),
        ("fmcw76", preset("fmcw76"), 25.0, 0.0, far),
        ("like an AWR1843", awr, 14.0, 0.0, [1.0, 45.0]),
        ("12 x 16 elements", grid, 20.0, 0.0, far),
        ("near field", near, 3.0, 0.0, [0.4, 3.0]),
        ("bands of Doppler", bands, 12.0, 0.0, far),
        ("braking", preset("front77"), 20.0, 9.0, far),
    ];
    for (name, mut radar, speed, brake, ranges) in cases {
        radar.front_end = Default::default();
        let all = roadside(&radar, 1500, speed, brake, ranges);
        let (error_db, methods) = sampled_error_db(&radar, &all);
        println!("{name}: {error_db:.1} dB, {:?}", methods.moving);
        let Method::Gridded(g) = methods.moving else { panic!("{name}: {methods:?}") };
        assert!(error_db < -80.0, "{name}: {error_db}");
        assert!(error_db < 20.0 * g.error.log10() + 12.0, "{name}: {error_db} dB, predicted {}", g.error);
    }
}

/// The bell's polynomial, its transform by quadrature, and images of a coarse grid.
#[test]
fn bells() {
    for oversampling in [1.375, 1.5, 2.0, 2.75] {
        let bell = Bell::new(oversampling);
        let mut worst = 0.0f64;
        for i in 0..=1000 {
            let d = f64::from(i) / 1000.0;
            let s = 1.0 - d * d;
            let sum = bell.polynomial.iter().rev().fold(0.0, |sum, c| sum * s + f64::from(*c));
            worst = worst.max((sum - bell.at(d)).abs());
        }
        assert!(worst < 5e-7, "{worst}");
        for f in [0.0, 0.1, 0.36, 0.7, 1.3] {
            let half = TAPS as f64 / 2.0;
            let n = 20_000;
            let step = 2.0 * half / n as f64;
            let at = |i: usize| -half + (i as f64 + 0.5) * step;
            let sum: f64 = (0..n).map(|i| bell.at(at(i) / half) * (TAU * f * at(i)).cos() * step).sum();
            assert!((sum - bell.transform(f)).abs() < 1e-7, "{f}: {sum} {}", bell.transform(f));
        }
        let images = bell.aliasing(oversampling);
        assert!(images < if oversampling < 1.4 { 1.5e-5 } else { 1.05e-5 }, "{oversampling}: {images}");
    }
}

/// `cargo test --release -p catseye --test simulator gridding -- --ignored --nocapture speed`
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
        1e-9 * radar.bandwidth_hz()
    );
    for (count, speed) in
        [(5172, 0.0), (124_138, 0.0), (5172, 12.5), (20_000, 12.5), (124_138, 12.5), (5172, 60.0)]
    {
        let all = many(count, [2.0, 60.0], speed);
        let plan = Plan::new(&radar, &all).unwrap();
        let (mut best, mut core, mut methods) = (f64::INFINITY, f64::INFINITY, Methods::default());
        for _ in 0..5 {
            let (t, c) = (std::time::Instant::now(), core_seconds());
            methods = synthesise_with(&plan, &COSTS, Control::default()).unwrap().1;
            (best, core) = (best.min(t.elapsed().as_secs_f64()), core.min(core_seconds() - c));
        }
        println!("{} echoes, {} moving: {:?}", plan.echo_summary.echoes, plan.echo_summary.moving, methods);
        println!("  {:.1} ms, {:.1} core-ms", 1e3 * best, 1e3 * core);
    }
}

/// The same for the direct sum, per echo and sample.
#[test]
#[ignore = "a measurement"]
fn speed_direct() {
    let mut radar = radar_toml::preset("front77").unwrap();
    radar.chirps = 64;
    let all = many(2048, [2.0, 60.0], 12.5);
    let plan = Plan::new(&radar, &all).unwrap();
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

fn on_gpu(gpu: &Gpu, radar: &Radar, all: &Echoes, costs: &Costs) -> (Cube<f32>, Methods, f64) {
    let plan = Plan::new(radar, all).unwrap();
    let mut recorder = gpu.recorder("gridding");
    let (cube, methods) = record_with(&plan, gpu, &mut recorder, costs).unwrap();
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
            let all = many(200, [2.0, 30.0], speed);
            let (got, methods, _) = on_gpu(test_gpu(), &radar, &all, &costs);
            let truth = synthesise::<f64>(&Plan::new(&radar, &all).unwrap(), Control::default()).unwrap();
            let (worst, l2) = errors(&got, &truth);
            println!(
                "{samples} samples, {chirps} chirps, {speed} m/s: worst {worst:.1e}, L2 {l2:.1e}, {methods:?}"
            );
            assert!(worst < 2e-5 && l2 < 2e-5);
        }
    }
}

/// Cut into pieces of chirps and groups of channels by a small binding, the cube is the same; and a run repeats to
/// the bit.
#[test]
fn gpu_agrees_when_paths_bend() {
    let gpu = test_gpu();
    let radar = radar(96, 128);
    let mut all = many(200, [4.0, 40.0], 12.0);
    for (i, r) in all.list.iter_mut().enumerate() {
        r.path_acceleration_and_jerk = [100.0 / f64::from(1 + i as u32 % 40), 1000.0];
    }
    let plan = Plan::new(&radar, &all).unwrap();
    let truth = synthesise::<f64>(&plan, Control::default()).unwrap();
    for (name, costs, within) in [
        ("gridded", Costs { direct: 1e9, ..DEVICE_COSTS }, 1e-3),
        ("direct", Costs { direct: 0.0, ..DEVICE_COSTS }, 1e-4),
    ] {
        let (got, methods, _) = on_gpu(gpu, &radar, &all, &costs);
        let (worst, l2) = errors(&got, &truth);
        println!("{name}: worst {worst:.1e}, L2 {l2:.1e}, {methods:?}");
        assert!(worst < within, "{name}: {worst}");
    }
}

#[test]
fn gpu_pieces_are_the_whole() {
    let radar = radar(40, 100);
    let mut all = many(800, [2.0, 20.0], 15.0);
    all.list.extend(many(700, [2.0, 20.0], 0.0).list);
    let costs = Costs { direct: 1e9, ..DEVICE_COSTS };
    let (whole, methods, _) = on_gpu(test_gpu(), &radar, &all, &costs);
    assert!(methods.still != Method::Direct && methods.moving != Method::Direct);
    let bits = |cube: &Cube<f32>| bytemuck::cast_slice::<_, u32>(&cube.data).to_vec();
    assert!(bits(&on_gpu(test_gpu(), &radar, &all, &costs).0) == bits(&whole));
    let truth = synthesise::<f64>(&Plan::new(&radar, &all).unwrap(), Control::default()).unwrap();
    assert!(errors(&whole, &truth).1 < 2e-5);
    let Method::Gridded(g) = methods.moving else { panic!("{methods:?}") };
    // Of one channel; the whole cube has 192,000 bytes.
    let grid = g.blocks * g.lines * 256 * 8;
    println!("{methods:?}: {grid} bytes");
    for bytes in [(5 * grid / 2) as u64, 150_000.max(grid as u64 + 100)] {
        let small = opened_for_tests();
        let small = small.with_poisoned_buffers().with_binding_limit(bytes);
        let (pieces, methods, _) = on_gpu(&small, &radar, &all, &costs);
        assert!(methods.still != Method::Direct && methods.moving != Method::Direct, "{methods:?}");
        assert!(errors(&pieces, &truth).1 < 2e-5);
    }
}

/// Echoes that crowd into one cell would be added up in a row by one thread: they go the direct way.
#[test]
fn gpu_leaves_crowds_to_the_direct_sum() {
    let radar = radar(4, 32);
    let one = many(1, [1.0, 3.0], 5.0).list.remove(0);
    let all = Echoes { list: vec![one; 3000], ..Default::default() };
    let (cube, methods, _) = on_gpu(test_gpu(), &radar, &all, &Costs { direct: 1e9, ..DEVICE_COSTS });
    assert_eq!(methods, Methods::default());
    let truth = synthesise::<f64>(&Plan::new(&radar, &all).unwrap(), Control::default()).unwrap();
    assert!(errors(&cube, &truth).0 < ALWAYS);
}

#[test]
fn kernels_are_what_their_rows_say() {
    use catseye::adc::{grid_fft, grid_lines, grid_spread};
    for kernel in [&grid_spread::KERNEL, &grid_fft::KERNEL, &grid_lines::KERNEL] {
        catseye::gpu::layout::check_kernel(kernel).unwrap();
    }
}

#[test]
#[ignore = "a measurement"]
fn speed_gpu() {
    let mut radar = radar_toml::preset("front77").unwrap();
    radar.chirps = 256;
    println!("{}", test_device_name());
    for (count, speed) in [(5172, 0.0), (124_138, 0.0), (5172, 12.5), (20_000, 12.5)] {
        let all = many(count, [2.0, 60.0], speed);
        let (mut whole, mut device, mut methods) = (f64::INFINITY, f64::INFINITY, Methods::default());
        for _ in 0..3 {
            let t = std::time::Instant::now();
            let (_, m, seconds) = on_gpu(test_gpu(), &radar, &all, &DEVICE_COSTS);
            methods = m;
            (whole, device) = (whole.min(t.elapsed().as_secs_f64()), device.min(seconds));
        }
        println!("{count} echoes at {speed} m/s: {methods:?}");
        println!("  {:.1} ms, on the device {:.1} ms", 1e3 * whole, 1e3 * device);
    }
}
