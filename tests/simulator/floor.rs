//! `trace.floor_db`: echoes far under the noise are left out, and nothing that shows.

use catseye::adc::noise::Noise;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::road::site;
use catseye::scene::scenario::{self, Scenario};
use catseye::simulate::{Frame, simulate, trace_options};
use num_complex::Complex64;
use std::path::Path;

fn frame(floor: &str) -> (Scenario, Frame) {
    let text = format!(
        "name = \"floor\"\nseed = 3\nradar = \"recipes/small_radar.toml\"\n[scene]\nroad = \"road/road_model_straight.toml\"\n\
         [ego]\nposition_m = [2, -1.75, 0]\nspeed_mps = 12\n[trace]\nbounces = 2\nfacets = 0\n{floor}"
    );
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/s.toml");
    let s = scenario::parse(&place, &text).unwrap();
    let built = site::Site::new(&s).unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F64), &built.scenario, &built.scene, 0).unwrap();
    (s, frame)
}

/// Largest power in a cell of the map of one channel without windows.
fn most_in_a_cell(chirps: &[&[Complex64]]) -> f64 {
    let turn = |i: usize, n: usize| Complex64::cis(-std::f64::consts::TAU * (i % n) as f64 / n as f64);
    let (m, n) = (chirps.len(), chirps[0].len());
    let spectra: Vec<Vec<Complex64>> = chirps
        .iter()
        .map(|c| (0..n).map(|k| c.iter().enumerate().map(|(i, z)| z * turn(i * k, n)).sum()).collect())
        .collect();
    let cell = |k: usize, d: usize| -> f64 {
        let sum: Complex64 = spectra.iter().enumerate().map(|(i, s)| s[k] * turn(i * d, m)).sum();
        sum.norm_sqr() / ((m * n) as f64).powi(2)
    };
    (0..n).flat_map(|k| (0..m).map(move |d| (k, d))).map(|(k, d)| cell(k, d)).fold(0.0, f64::max)
}

/// Noise is the same in both, so that the difference of the maps is what was left out.
#[test]
fn what_is_left_out_stays_under_the_noise() {
    let (s, all) = frame("");
    let (_, some) = frame("floor_db = -30");
    let (many, few) = (all.echoes.list.len(), some.echoes.list.len());
    assert!(few * 4 < many * 3, "{few} of {many}");
    let (AnyCube::F64(all_cube), AnyCube::F64(some_cube)) = (&all.cube, &some.cube) else { unreachable!() };
    let radar = &s.radars[0];
    let rest: Vec<Complex64> = all_cube.data.iter().zip(&some_cube.data).map(|(a, b)| a - b).collect();
    let one_channel: Vec<&[Complex64]> = rest.chunks_exact(radar.samples).step_by(radar.channels()).collect();
    let sigma = Noise::thermal(radar, 0, 0).unwrap().sigma;
    let noise = 2.0 * sigma * sigma / (radar.samples * radar.chirps) as f64;
    let under_db = 10.0 * (most_in_a_cell(&one_channel) / noise).log10();
    println!("{few} of {many} echoes; the others are {under_db:.1} dB over a cell's noise");
    // One echo is 35 dB under this noise at most (30 dB under that of all channels, windows included); in the worst cell of
    // this road, along a kerb, many add up to 14.5 dB under it.
    assert!(under_db < -12.0, "{under_db}");
    assert_eq!(all.points.len(), some.points.len());
    for (a, b) in all.points.iter().zip(&some.points) {
        // Weak ones move by a share of what noise moves them by.
        let moved = (a.range_m - b.range_m).abs() / a.std.range_m;
        assert!(moved < 0.2 && (a.snr_db - b.snr_db).abs() < 0.5, "{a:?} {b:?}");
    }
}

#[test]
fn without_noise_or_floor_all_echoes_stay() {
    let (mut s, _) = frame("floor_db = -30");
    assert!(trace_options(&s, 0, 0).unwrap().least > 0.0);
    s.radars[0].thermal_noise = false;
    assert_eq!(trace_options(&s, 0, 0).unwrap().least, 0.0);
    s.radars[0].thermal_noise = true;
    s.trace.floor_db = None;
    assert_eq!(trace_options(&s, 0, 0).unwrap().least, 0.0);
}
