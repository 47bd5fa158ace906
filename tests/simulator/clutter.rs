//! Clutter of ground and rain: its level against closed forms through the chain, its statistics, and that it belongs to places.

use catseye::base::control::Control;
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::{C0, power_from_db, w_from_dbm, wavenumber};
use catseye::em::clutter::kulemin;
use catseye::em::weather::{RainBackscatter, fog_attenuation_db_per_m, rain_attenuation_db_per_m};
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::geom::Geometry;
use catseye::geom::edge_table::EdgeTable;
use catseye::road::objects::ground;
use catseye::road::reflector::Reflector;
use catseye::scene::backscatter::{Backscatter, Ground};
use catseye::scene::radar::{Pattern, Radar, Sampling};
use catseye::scene::weather::Weather;
use catseye::scene::{Material, Scene, Shape, material, radar_toml};
use catseye::trace::air::Air;
use catseye::trace::cpu::{chains, echoes};
use catseye::trace::windows::around;
use catseye::trace::{Echo, TraceOptions};
use glam::{DQuat, DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

const HEIGHT_M: f64 = 0.6;
const SEEDS: u64 = 60;

/// One antenna each, one chirp, no noise.
fn radar() -> Radar {
    let mut r = radar_toml::preset("demo77").unwrap();
    r.tx.truncate(1);
    r.rx.truncate(1);
    (r.chirps, r.thermal_noise, r.sampling) = (1, false, Sampling::Iq);
    for a in r.tx.iter_mut().chain(&mut r.rx) {
        a.pattern = Pattern::CosinePower { azimuth_exponent: 3.0, elevation_exponent: 20.0 };
        a.position_m = DVec3::ZERO;
    }
    r
}

fn pose(height_m: f64) -> Pose<Sensor, World> {
    Pose::new(DQuat::IDENTITY, DVec3::Z * height_m)
}

fn road(spec: &str, lo: DVec2, hi: DVec2) -> Scene {
    let mut scene = Scene::default();
    add_road(&mut scene, spec, lo, hi);
    scene
}

fn add_road(scene: &mut Scene, spec: &str, lo: DVec2, hi: DVec2) {
    let backscatter = Some(Backscatter::parse(spec).unwrap());
    let m = scene.material_index(&Material { backscatter, ..material::by_name("concrete").unwrap() });
    scene.add_mesh("ground", "road", ground(lo, hi, 0.0, m), Pose::IDENTITY);
}

/// Width of a range bin, m.
fn bin_m(r: &Radar) -> f64 {
    r.sample_rate_hz * C0 / (2.0 * r.slope_hz_per_s().abs() * r.samples as f64)
}

fn hann(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.5 - 0.5 * (TAU * i as f64 / n as f64).cos()).collect()
}

/// |X|^2 in W of the range bins of the first chirp (CONVENTIONS eq. 14), by sums.
fn spectrum(radar: &Radar, cube: &AnyCube, bins: usize) -> Vec<f64> {
    let n = radar.samples;
    let x: Vec<Complex64> = match cube {
        AnyCube::F32(c) => c.to_f64().data[..n].to_vec(),
        AnyCube::F64(c) => c.data[..n].to_vec(),
    };
    let w = hann(n);
    let sum: f64 = w.iter().sum();
    (0..bins)
        .map(|r| {
            let turn = |i: usize| Complex64::cis(-TAU * (r * i % n) as f64 / n as f64);
            let s: Complex64 = (0..n).map(|i| x[i] * w[i] * turn(i)).sum();
            (s / sum).norm_sqr()
        })
        .collect()
}

/// Mean |X|^2 of a bin when `per_m` is the received power for each metre of range: its integral times the window's response.
fn expected(radar: &Radar, bin: usize, per_m: &dyn Fn(f64) -> f64) -> f64 {
    let (n, w) = (radar.samples, hann(radar.samples));
    let sum: f64 = w.iter().sum();
    let response = |off: f64| {
        let s: Complex64 = (0..n).map(|i| w[i] * Complex64::cis(TAU * off * i as f64 / n as f64)).sum();
        (s / sum).norm_sqr()
    };
    // Beyond three bins Hann's side lobes hold a thousandth of a thousandth.
    let steps = 96;
    let step = 6.0 / steps as f64;
    (0..steps)
        .map(|i| {
            let off = -3.0 + (i as f64 + 0.5) * step;
            let range = (bin as f64 + off) * bin_m(radar);
            response(off) * per_m(range) * step * bin_m(radar)
        })
        .sum()
}

/// Power that comes from all azimuths for each metre of range, W/m: P G^2 lambda^2 sigma0 / ((4 pi)^3 R^4) over R dR dphi.
fn road_w_per_m(radar: &Radar, sigma0: &dyn Fn(f64) -> f64, range_m: f64) -> f64 {
    let sin = HEIGHT_M / range_m;
    let steps = 400;
    let step = PI / steps as f64;
    let pattern = &radar.tx[0].pattern;
    let gains: f64 = (0..steps)
        .map(|i| pattern.power_gain(-0.5 * PI + (i as f64 + 0.5) * step, -sin.asin()).powi(2) * step)
        .sum();
    let peak = power_from_db(radar.tx[0].gain_dbi + radar.rx[0].gain_dbi);
    let lambda = radar.wavelength_m();
    w_from_dbm(radar.tx_power_dbm) * peak * gains * lambda * lambda * sigma0(sin)
        / ((4.0 * PI).powi(3) * range_m.powi(3))
}

/// Quantile of chi^2 / dof by Wilson and Hilferty, for a normal quantile z.
fn chi2_quantile(dof: f64, z: f64) -> f64 {
    let v = 2.0 / (9.0 * dof);
    (1.0 - v + z * v.sqrt()).powi(3)
}

/// Means over seeds against closed forms: exponential powers, so 2n P / mean is chi^2 with 2n degrees. Of the bins at most `allowed` lie
/// outside their 99 % interval; every third bin has its own scatterers, and their mean lies within its.
fn compare(name: &str, seen: &[f64], want: &[f64], first: usize, seeds: u64, allowed: usize) {
    let dof = 2.0 * seeds as f64;
    let (lo, hi) = (chi2_quantile(dof, -2.5758), chi2_quantile(dof, 2.5758));
    let ratios: Vec<f64> = seen.iter().zip(want).map(|(s, w)| s / w).collect();
    let outside: Vec<(usize, f64)> = ratios
        .iter()
        .enumerate()
        .filter(|(_, r)| !(lo..=hi).contains(*r))
        .map(|(i, r)| (i + first, *r))
        .collect();
    let own: Vec<f64> = ratios.iter().copied().step_by(3).collect();
    let mean = own.iter().sum::<f64>() / own.len() as f64;
    let half = 2.5758 / (seeds as f64 * own.len() as f64).sqrt();
    println!(
        "{name}: {} bins, mean ratio {mean:.4} +- {half:.4}, outside {lo:.3}..{hi:.3}: {outside:?}",
        ratios.len()
    );
    assert!(outside.len() <= allowed, "{name}: {outside:?}");
    assert!((mean - 1.0).abs() < half, "{name}: {mean} +- {half}");
}

/// alpha = 0.01 for each bin: of 56 half a bin is expected outside, more than 4 in one run of ten thousand were they independent.
#[test]
fn road_clutter_falls_as_its_closed_form() {
    let radar = radar();
    let engine = Engine::Cpu(Precision::F32);
    let (first, bins) = (24, 80);
    let far = 1.5 * bins as f64 * bin_m(&radar);
    type Law = Box<dyn Fn(f64) -> f64>;
    let laws: [(&str, Law); 2] = [
        ("gamma:-15", Box::new(|sin| power_from_db(-15.0) * sin)),
        ("kulemin:snow", Box::new(|sin| kulemin(Ground::Snow, 77e9, sin))),
    ];
    for (spec, sigma0) in laws {
        let scene = road(spec, DVec2::new(-1.0, -far), DVec2::new(far, far));
        let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
        let mut sum = vec![0.0; bins];
        let mut rays = 0;
        for seed in 0..SEEDS {
            let options = TraceOptions {
                seed,
                rays: 20_000,
                bandwidth_hz: radar.bandwidth_hz(),
                amplitude_floor: 0.0,
                ..Default::default()
            };
            let echoes = engine.echoes(&geometry, &radar, &pose(HEIGHT_M), DVec3::ZERO, &options);
            rays += echoes.rays;
            let (cube, _) = engine.cube(&radar, &echoes, &[], seed, 0, Control::default()).unwrap();
            spectrum(&radar, &cube, bins).iter().zip(&mut sum).for_each(|(p, s)| *s += p / SEEDS as f64);
        }
        println!("{spec}: {} echoes a frame, bins of {:.3} m", rays / SEEDS, bin_m(&radar));
        let want: Vec<f64> =
            (first..bins).map(|b| expected(&radar, b, &|r| road_w_per_m(&radar, &*sigma0, r))).collect();
        compare(spec, &sum[first..], &want, first, SEEDS, 4);
    }
}

fn diffuse_of(geometry: &Geometry, at: &Pose<Sensor, World>, options: &TraceOptions) -> Vec<Echo> {
    let options = TraceOptions { amplitude_floor: 0.0, ..*options };
    let all = echoes::echoes(geometry, &around(at), at, DVec3::ZERO, &options);
    let coherent = all.list.len() - all.rays as usize;
    all.list[coherent..].to_vec()
}

/// A road that a wall shades in part has the same scatterers whether lines or polygons find what is seen of it.
#[test]
fn lines_sample_what_polygons_sample() {
    let mut scene = road("gamma:-15", DVec2::new(1.0, -8.0), DVec2::new(30.0, 8.0));
    let wall = Reflector::parse("plate:width_m=3,height_m=1").unwrap();
    let stands = Pose::from_yaw_pitch_roll(DVec3::new(9.0, 1.0, 0.6), std::f64::consts::PI, 0.0, 0.0);
    wall.add_to(&mut scene, &material::by_name, ("wall", ""), stands, DVec3::ZERO).unwrap();
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let (at, faces) = (pose(1.5), geometry.faces());
    let options = TraceOptions { rays: 5_000, bounces: 2, amplitude_floor: 0.0, ..Default::default() };
    let windows = around(&at);
    let beams = echoes::FrameBeams::new(&geometry, at.translation_m, &options);
    let chains = chains::follow(faces, &EdgeTable::new(faces), &windows, &beams.options);
    let by_lines = echoes::from_lines(&geometry, (&chains, &windows), &at, DVec3::ZERO, &options);
    let sorted = |mut list: Vec<Echo>| {
        list.sort_by(|a, b| a.path_length_m.total_cmp(&b.path_length_m));
        list
    };
    let coherent = by_lines.list.len() - by_lines.rays as usize;
    let [got, want] = [by_lines.list[coherent..].to_vec(), diffuse_of(&geometry, &at, &options)].map(sorted);
    assert!(got.len() == want.len() && got.len() > 2_000, "{} and {}", got.len(), want.len());
    for (a, b) in got.iter().zip(&want) {
        assert!((a.path_length_m - b.path_length_m).abs() < 1e-9);
        assert!((a.path_gain[0][0] - b.path_gain[0][0]).norm() < 1e-9 * b.path_gain[0][0].norm());
    }
}

fn field(list: &[Echo], k: f64, rx: usize, tx: usize) -> Complex64 {
    list.iter().map(|r| r.path_gain[rx][tx] * Complex64::cis(-k * r.path_length_m)).sum()
}

/// Powers of one cell over seeds are exponential (Kolmogorov and Smirnov, alpha = 0.01, the mean from the closed form); VV and HH
/// correlate as the material says, VH with neither, and cells not with one another (within 3 standard deviations).
#[test]
fn speckle_of_a_cell() {
    let k = wavenumber(77e9);
    let mut scene = Scene::default();
    let spec = "gamma:-12,cross_db=-7,correlation=0.6";
    for y in [-1.0, 0.0] {
        add_road(&mut scene, spec, DVec2::new(20.0, y), DVec2::new(21.0, y + 1.0));
    }
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let at = pose(1.5);
    // Integral of sigma0 / (4 pi r^4) over one of them.
    let steps = 50;
    let mean: f64 = (0..steps * steps)
        .map(|i| {
            let (x, y) = (20.0 + ((i % steps) as f64 + 0.5) / 50.0, ((i / steps) as f64 + 0.5) / 50.0);
            let r2 = x * x + y * y + 1.5 * 1.5;
            power_from_db(-12.0) * 1.5 / r2.sqrt() / (4.0 * PI * r2 * r2) / (steps * steps) as f64
        })
        .sum();
    let n = 2000;
    let mut fields: Vec<[Complex64; 4]> = Vec::with_capacity(n);
    for seed in 0..n as u64 {
        let all = diffuse_of(&geometry, &at, &TraceOptions { seed, rays: 60, ..Default::default() });
        let of = |id: u32| all.iter().filter(|r| r.chain[0] == id).cloned().collect::<Vec<_>>();
        let (a, b) = (of(1), of(2));
        if seed == 0 {
            println!("{} and {} scatterers in the two cells", a.len(), b.len());
            assert!(a.len() >= 10 && b.len() >= 10);
        }
        fields.push([field(&a, k, 0, 0), field(&a, k, 1, 1), field(&a, k, 1, 0), field(&b, k, 0, 0)]);
        assert_eq!(field(&a, k, 1, 0), field(&a, k, 0, 1));
    }
    for (i, level) in [1.0, 1.0, power_from_db(-7.0), 1.0].into_iter().enumerate() {
        let mut p: Vec<f64> = fields.iter().map(|f| f[i].norm_sqr() / (mean * level)).collect();
        p.sort_by(f64::total_cmp);
        let d = p
            .iter()
            .enumerate()
            .map(|(j, x)| {
                let cdf = 1.0 - (-x).exp();
                (cdf - j as f64 / n as f64).abs().max(((j + 1) as f64 / n as f64 - cdf).abs())
            })
            .fold(0.0, f64::max);
        println!("{i}: mean {:.4}, D {d:.4}", p.iter().sum::<f64>() / n as f64);
        assert!(d < 1.63 / (n as f64).sqrt(), "{i}: {d}");
    }
    let correlation = |a: usize, b: usize| {
        let of = |f: &[Complex64; 4]| f[a] * f[b].conj();
        let power = |i: usize| fields.iter().map(|f| f[i].norm_sqr()).sum::<f64>();
        (fields.iter().map(of).sum::<Complex64>() / (power(a) * power(b)).sqrt()).norm()
    };
    let sd = 1.0 / (n as f64).sqrt();
    let copolar = correlation(0, 1);
    println!("correlations: {copolar:.3} {:.3} {:.3}", correlation(0, 2), correlation(0, 3));
    assert!((copolar - 0.6).abs() < 3.0 * sd * (1.0 - 0.36), "{copolar}");
    // The modulus of nothing is Rayleigh.
    assert!(correlation(0, 2) < 3.0 * sd && correlation(1, 2) < 3.0 * sd && correlation(0, 3) < 3.0 * sd);
}

/// Places of the scatterers in the frame of the body that they belong to, rounded to a hundredth of a millimetre, with S.
fn places(list: &[Echo], at: &Pose<Sensor, World>, body: &Pose<Sensor, World>) -> Vec<([i64; 3], Complex64)> {
    let back = body.inverse();
    let mut all: Vec<([i64; 3], Complex64)> = list
        .iter()
        .map(|r| {
            let p = back.point(at.point(r.departure * r.first_range_m));
            let key = p.to_array().map(|x| (x * 1e5).round() as i64);
            // The law is a sine of the grazing angle, which falls with range.
            (key, r.path_gain[0][0] * r.first_range_m.powf(2.5))
        })
        .collect();
    all.sort_by_key(|a| a.0);
    all
}

/// Share of the first places that stand among the second, within the rounding, with an S that differs by less than 2 %.
fn shared(a: &[([i64; 3], Complex64)], b: &[([i64; 3], Complex64)]) -> f64 {
    let found = a.iter().filter(|(p, s)| {
        let from = b.partition_point(|(q, _)| q[0] < p[0] - 1);
        b[from..].iter().take_while(|(q, _)| q[0] <= p[0] + 1).any(|(q, t)| {
            (q[1] - p[1]).abs() <= 1 && (q[2] - p[2]).abs() <= 1 && (s - t).norm() < 0.02 * s.norm()
        })
    });
    found.count() as f64 / a.len() as f64
}

#[test]
fn the_pattern_belongs_to_the_place() {
    let k = wavenumber(77e9);
    let scene = road("gamma:-15", DVec2::new(2.0, -20.0), DVec2::new(80.0, 20.0));
    let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
    let of = |x: f64, seed, frame| {
        let at: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, DVec3::new(x, 0.0, HEIGHT_M));
        (diffuse_of(&geometry, &at, &TraceOptions { seed, frame, rays: 30_000, ..Default::default() }), at)
    };
    let (here, at) = of(0.0, 1, 0);
    // Another frame at the same place is the same to the bit; another seed is not.
    assert_eq!(here, of(0.0, 1, 7).0);
    assert_ne!(here, of(0.0, 2, 0).0);
    let own = places(&here, &at, &Pose::IDENTITY);
    assert_eq!(shared(&own, &own), 1.0);
    let mut last = 1.0;
    for step in [0.01, 0.1, 1.0, 5.0] {
        let (there, at) = of(step, 1, 0);
        let other = places(&there, &at, &Pose::IDENTITY);
        let both = shared(&other, &own);
        println!("{step} m on: {} echoes, {:.4} of them known", there.len(), both);
        assert!(both <= last && both > 1.0 - 0.6 * step.max(0.03), "{step}: {both}");
        last = both;
    }
    // A range cell's field a millimetre on is that of the same scatterers on their new paths.
    let cell = |list: &[Echo], x: f64| -> Vec<Echo> {
        let inside = |r: &&Echo| (20.0..20.5).contains(&(r.departure.x * r.first_range_m + x));
        list.iter().filter(inside).cloned().collect()
    };
    let before = cell(&here, 0.0);
    let moved: Complex64 = before
        .iter()
        .map(|r| {
            let d = (r.departure * r.first_range_m - DVec3::X * 1e-3).length();
            r.path_gain[0][0] * Complex64::cis(-2.0 * k * d)
        })
        .sum();
    let after = field(&cell(&of(1e-3, 1, 0).0, 1e-3), k, 0, 0);
    assert!((after - moved).norm() < 0.05 * moved.norm(), "{after} {moved}");
}

/// On a body that moves and turns, the pattern does.
#[test]
fn the_pattern_moves_with_its_body() {
    let mut scene = Reflector::parse("plate:width_m=0.8,height_m=0.6")
        .unwrap()
        .to_scene(&|_| Ok(Material { roughness_rms_m: 3e-4, ..Material::pec() }))
        .unwrap();
    let at: Pose<Sensor, World> = Pose::new(DQuat::from_rotation_z(PI), DVec3::new(9.0, 0.0, 0.2));
    let mut seen = |place: DVec3, turn: f64| {
        let o = &mut scene.objects[0];
        (o.pose.translation_m, o.pose.rotation) = (place, DQuat::from_rotation_z(turn));
        let body = Pose::new(o.pose.rotation, place);
        let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
        let options = TraceOptions { rays: 2000, ..Default::default() };
        places(&diffuse_of(&geometry, &at, &options), &at, &body)
    };
    let first = seen(DVec3::ZERO, 0.0);
    for (place, turn) in [(DVec3::new(0.02, -0.5, 0.0), 0.0), (DVec3::new(0.0, 0.1, 0.05), 0.01)] {
        let next = seen(place, turn);
        let both = shared(&next, &first);
        println!("{} scatterers, {both:.3} known", next.len());
        assert!(both > 0.95, "{both}");
    }
}

fn rainy(rate: f64) -> Weather {
    Weather { rain_mm_per_h: rate, ..Default::default() }
}

/// A point that is nothing, so that the scene is not empty.
fn empty(rcs_dbsm: f64, range_m: f64) -> Geometry {
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * range_m, 0.0, 0.0, 0.0);
    scene.add_object("post", "post", Shape::Point { rcs_dbsm }, pose, DVec3::ZERO);
    Geometry::build(&scene, 0.0, 77e9).unwrap()
}

/// dP/dR = P lambda^2 eta / ((4 pi)^3 R^2) times the integral of G^2 over the directions, less what rain takes both ways.
#[test]
fn rain_clutter_falls_as_its_closed_form() {
    let radar = radar();
    let engine = Engine::Cpu(Precision::F32);
    let (rate, first, bins) = (25.0, 20, 80);
    let geometry = empty(-200.0, 5.0);
    let air = Air::of(&rainy(rate), radar.carrier_hz).unwrap();
    let mut sum = vec![0.0; bins];
    for seed in 0..SEEDS {
        let options = TraceOptions { seed, rays: 20_000, amplitude_floor: 0.0, air, ..Default::default() };
        let echoes = engine.echoes(&geometry, &radar, &pose(0.0), DVec3::ZERO, &options);
        let (cube, _) = engine.cube(&radar, &echoes, &[], seed, 0, Control::default()).unwrap();
        spectrum(&radar, &cube, bins).iter().zip(&mut sum).for_each(|(p, s)| *s += p / SEEDS as f64);
    }
    // cos^6 of azimuth over a half turn, cos^41 of elevation: G^2 cos(el).
    let beta = |n: i32| {
        let steps = 4000;
        (0..steps).map(|i| (PI * ((i as f64 + 0.5) / steps as f64 - 0.5)).cos().powi(n)).sum::<f64>() * PI
            / steps as f64
    };
    let solid = beta(6) * beta(41);
    let peak = power_from_db(radar.tx[0].gain_dbi + radar.rx[0].gain_dbi);
    let eta = RainBackscatter::of(radar.carrier_hz, 20.0, rate).unwrap().eta_per_m;
    let loss = rain_attenuation_db_per_m(radar.carrier_hz, rate)[0];
    let per_m = |r: f64| {
        w_from_dbm(radar.tx_power_dbm) * peak * radar.wavelength_m().powi(2) * eta * solid
            / ((4.0 * PI).powi(3) * r * r)
            * power_from_db(-2.0 * loss * r)
    };
    let want: Vec<f64> = (first..bins).map(|b| expected(&radar, b, &per_m)).collect();
    println!("{rate} mm/h: eta {eta:.3e} 1/m, {:.2} dB/km one way", 1e3 * loss);
    compare("rain", &sum[first..], &want, first, SEEDS, 4);
}

/// What a point target loses in the samples.
#[test]
fn a_point_fades_by_the_recommendations() {
    let radar = radar();
    let engine = Engine::Cpu(Precision::F64);
    let range = 60.0 * bin_m(&radar);
    let geometry = empty(10.0, range);
    let peak = |weather: &Weather| {
        let mut air = Air::of(weather, radar.carrier_hz).unwrap();
        // The rain's own echoes would come on top.
        air.iter_mut().for_each(|a| a.rain = None);
        let options = TraceOptions { air, ..Default::default() };
        let echoes = engine.echoes(&geometry, &radar, &pose(0.0), DVec3::ZERO, &options);
        let (cube, _) = engine.cube(&radar, &echoes, &[], 0, 0, Control::default()).unwrap();
        spectrum(&radar, &cube, 64)[60]
    };
    let dry = peak(&Weather::default());
    let f = radar.carrier_hz;
    let fog = |m: f64, t: f64| fog_attenuation_db_per_m(f, t, m);
    for (weather, db_per_m) in [
        (rainy(10.0), rain_attenuation_db_per_m(f, 10.0)[0]),
        (Weather { liquid_g_per_m3: 0.5, temperature_c: 5.0, ..Default::default() }, fog(0.5, 5.0)),
        (
            Weather { liquid_g_per_m3: 0.05, ..rainy(50.0) },
            fog(0.05, 20.0) + rain_attenuation_db_per_m(f, 50.0)[0],
        ),
    ] {
        let lost = -10.0 * (peak(&weather) / dry).log10();
        println!("{lost:.4} dB over {range:.2} m, {:.3} dB/km", 1e3 * db_per_m);
        assert!((lost - 2.0 * range * db_per_m).abs() < 0.01, "{lost}");
    }
}

/// Looking up, one sees drops come: their mean rate and its spread are those of the backscatter's own sum.
#[test]
fn rain_falls() {
    let radar = radar();
    let engine = Engine::Cpu(Precision::F32);
    let up: Pose<Sensor, World> = Pose::from_yaw_pitch_roll(DVec3::ZERO, 0.0, -0.5 * PI, 0.0);
    let air = Air::of(&rainy(10.0), radar.carrier_hz).unwrap();
    let options = TraceOptions { rays: 20_000, amplitude_floor: 0.0, air, ..Default::default() };
    let all = engine.echoes(&empty(-200.0, 5.0), &radar, &up, DVec3::ZERO, &options);
    // Nearly straight up.
    let rates: Vec<f64> = all
        .list
        .iter()
        .filter(|r| r.chain[0] == 0 && r.departure.x > 0.995)
        .map(|r| r.range_rate_mps() / r.departure.x)
        .collect();
    let n = rates.len() as f64;
    let mean = rates.iter().sum::<f64>() / n;
    let sd = (rates.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n).sqrt();
    let (fall, spread) = RainBackscatter::of(radar.carrier_hz, 20.0, 10.0).unwrap().fall_mps();
    println!("{n} drops: {mean:.3} m/s +- {sd:.3}, {fall:.3} +- {spread:.3} in the sum");
    assert!(n > 300.0 && (mean + fall).abs() < 4.0 * spread / n.sqrt() + 0.02, "{mean} {fall}");
    assert!((sd / spread - 1.0).abs() < 0.1, "{sd} {spread}");
}
