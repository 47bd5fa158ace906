//! Echoes far under the noise are left out, and nothing that shows: by the budget, by `trace.floor_db`, and not with `trace.exact`.

use catseye::adc::budget::Budget;
use catseye::adc::noise::Noise;
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::road::site;
use catseye::scene::scenario::{self, SitedScenario};
use catseye::simulate::{Frame, budget, simulate, trace_options};
use num_complex::Complex64;
use std::path::Path;

fn frame(floor: &str) -> (SitedScenario, Frame) {
    let text = format!(
        "name = \"floor\"\nseed = 3\nradar = \"recipes/small_radar.toml\"\n[scene]\nroad = \"road/road_model_straight.toml\"\n\
         [ego]\nposition_m = [2, -1.75, 0]\nspeed_mps = 12\n[trace]\nbounces = 2\nfacets = 0\n{floor}"
    );
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/s.toml");
    let s = scenario::parse(&place, &text).unwrap();
    let built = site::Site::new(&s).unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F64), &built.scenario, &built.scene, 0).unwrap();
    (built.scenario, frame)
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

/// What the echoes of a frame that lack in another add up to in the worst cell of one channel's map, dB over the noise of a cell; both
/// with the same noise. Points have to be the same within `share` of what noise moves them by.
fn worst_cell_db(s: &SitedScenario, all: &Frame, some: &Frame, share: f64) -> f64 {
    let (Some(AnyCube::F64(all_cube)), Some(AnyCube::F64(some_cube))) = (&all.cube, &some.cube) else {
        unreachable!()
    };
    let radar = &s.radars[0];
    let rest: Vec<Complex64> = all_cube.data.iter().zip(&some_cube.data).map(|(a, b)| a - b).collect();
    let one_channel: Vec<&[Complex64]> = rest.chunks_exact(radar.samples).step_by(radar.channels()).collect();
    let sigma = Noise::thermal(radar, 0, 0).unwrap().sigma;
    let noise = 2.0 * sigma * sigma / (radar.samples * radar.chirps) as f64;
    assert_eq!(all.points.len(), some.points.len());
    for (a, b) in all.points.iter().zip(&some.points) {
        let moved = (a.range_m - b.range_m).abs() / a.std.range_m;
        assert!(moved < share && (a.snr_db - b.snr_db).abs() < 0.5, "{a:?} {b:?}");
    }
    10.0 * (most_in_a_cell(&one_channel) / noise).log10()
}

#[test]
fn a_floor_leaves_out_what_stays_under_the_noise() {
    let (s, all) = frame("exact = true");
    let (_, some) = frame("floor_db = -30");
    let (many, few) = (all.echoes.list.len(), some.echoes.list.len());
    assert!(few * 4 < many * 3, "{few} of {many}");
    let under_db = worst_cell_db(&s, &all, &some, 0.2);
    println!("{few} of {many} echoes; the others are {under_db:.1} dB over a cell's noise");
    // One echo is 35 dB under this noise at most (30 dB under that of all channels, windows included); in the worst cell of
    // this road, along a kerb, many add up.
    assert!(under_db < -12.0, "{under_db}");
}

/// Without a word of it in the scenario: in sum 10 dB under the noise of a cell after all channels.
#[test]
fn the_budget_leaves_out_what_cannot_show() {
    let (_, all) = frame("exact = true");
    let (s, some) = frame("");
    let (many, few) = (all.echoes.list.len(), some.echoes.list.len());
    let echo_summary = some.echo_summary;
    assert_eq!(few as u64 + echo_summary.merged + echo_summary.left_out, many as u64);
    assert!(echo_summary.merged > 0 && echo_summary.left_out > 0, "{echo_summary:?}");
    assert_eq!((all.echo_summary.merged, all.echo_summary.left_out), (0, 0));
    let Budget::Sum(most_w) = budget(&s, 0) else { panic!("{:?}", budget(&s, 0)) };
    assert!(echo_summary.left_out_power_w <= most_w && echo_summary.left_out_power_w > 0.3 * most_w);
    // What is 10 dB under the noise moves a point by 0.32 of what noise does.
    let under_db = worst_cell_db(&s, &all, &some, 0.32);
    println!(
        "{few} of {many} echoes, {} merged; the others are {under_db:.1} dB over a cell's noise",
        echo_summary.merged
    );
    // Of one channel, whose noise is that of all of them and more.
    let channels_db = 10.0 * (s.radars[0].virtual_channels() as f64).log10();
    assert!(under_db < -10.0 - channels_db + 3.0, "{under_db}");
}

/// Without noise the budget is a share of all.
#[test]
fn what_may_be_left_out() {
    let (mut s, _) = frame("floor_db = -30");
    assert!(trace_options(&s, 0, 0).unwrap().least > 0.0);
    assert!(matches!(budget(&s, 0), Budget::Each(_)));
    s.radars[0].thermal_noise = false;
    assert_eq!(trace_options(&s, 0, 0).unwrap().least, 0.0);
    assert_eq!(budget(&s, 0), Budget::Nothing);
    s.trace.floor_db = None;
    assert!(matches!(budget(&s, 0), Budget::Share(_)));
    s.radars[0].thermal_noise = true;
    assert_eq!(trace_options(&s, 0, 0).unwrap().least, 0.0);
    assert!(matches!(budget(&s, 0), Budget::Sum(_)) && trace_options(&s, 0, 0).unwrap().merge);
    s.trace.exact = true;
    assert!(budget(&s, 0) == Budget::Nothing && !trace_options(&s, 0, 0).unwrap().merge);
}

#[test]
fn a_floor_and_every_echo_contradict() {
    let text = "name = \"floor\"\nradar = \"demo77\"\n[[point]]\nposition_m = [10, 0, 0]\nrcs_dbsm = 0\n[trace]\nexact = true\nfloor_db = -30\n";
    let e = scenario::parse(Path::new("s.toml"), text).unwrap_err().to_string();
    assert!(e.contains("s.toml:8") && e.contains("trace.floor_db") && e.contains("exact"), "{e}");
}
