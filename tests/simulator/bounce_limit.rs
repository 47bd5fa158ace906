//! What the limit of bounces cuts off is said, and followed where it matters (CONVENTIONS eq. 68).

use catseye::adc::budget::power_w;
use catseye::base::control::Control;
use catseye::base::frames::Pose;
use catseye::base::units::db_from_power;
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::road::reflector::Reflector;
use catseye::scene::radar::Radar;
use catseye::scene::{Scene, material, radar_toml, scenario};
use catseye::simulate::{Prepared, simulate_with};
use catseye::trace::{Echoes, TraceOptions};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::PI;
use std::path::Path;

const RANGE_M: f64 = 20.0;

fn seen(spec: &str, turn: [f64; 2], options: &TraceOptions) -> Echoes {
    seen_by(&radar_toml::preset("front77").unwrap(), spec, turn, options)
}

fn seen_by(radar: &Radar, spec: &str, [yaw, pitch]: [f64; 2], options: &TraceOptions) -> Echoes {
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * RANGE_M, PI + yaw, pitch, 0.0);
    let body = Reflector::parse(spec).unwrap();
    body.add_to(&mut scene, &material::by_name, (spec, ""), pose, DVec3::ZERO).unwrap();
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    Engine::Cpu(Precision::F64).echoes(&geometry, radar, &Pose::IDENTITY, DVec3::ZERO, options)
}

fn within(bounces: usize, most_bounces: usize) -> TraceOptions {
    TraceOptions { bounces, most_bounces, least_cut: Some(0.0), ..Default::default() }
}

/// A corner's three bounces, cut after two, are missed by what they bring. The level that is said is that of a disc of each beam's
/// size that goes on whole where its middle does: 3.6 dB over the corner, of whose face only the hexagon in the middle returns three bounces.
#[test]
fn a_corner_cut_after_two_bounces_says_what_is_missing() {
    for turn in [[0.0, 0.62], [0.2, 0.5], [-0.25, 0.7]] {
        let cut = seen("trihedral:leg_m=0.1", turn, &within(2, 0));
        let whole = seen("trihedral:leg_m=0.1", turn, &within(3, 0));
        let (said, missing) = (db_from_power(cut.cut_power_w), db_from_power(whole.power_w));
        println!("{turn:?}: {said:.2} dBW said, {missing:.2} missing");
        assert!((said - missing).abs() < 5.0, "{turn:?}: {said} {missing}");
        assert!(cut.cut_power_w > 10.0 * cut.power_w && whole.cut_power_w < 1e-2 * whole.power_w);
        let chain: Vec<u32> = cut.cut[0].chain[..3].to_vec();
        assert_eq!((cut.cut[0].bounces, chain), (3, vec![1; 3]));
        assert!((cut.cut[0].range_m() - RANGE_M).abs() < 0.2 && cut.cut[0].departure.x > 0.99);
    }
}

/// What is missing does not go by what the antennas are blind to: a bounce turns polarisation, and the next one may be the one that
/// they hear.
#[test]
fn blind_antennas_are_told_too() {
    let copolar = radar_toml::preset("front77").unwrap();
    let plain = seen_by(&copolar, "trihedral:leg_m=0.1", [0.2, 0.5], &within(2, 0)).cut_power_w;
    let half = 0.5f64.sqrt();
    let [zero, one] = [Complex64::ZERO, Complex64::new(1.0, 0.0)];
    for (tx, rx) in [
        ([one, zero], [zero, one]),
        ([half.into(), Complex64::new(0.0, half)], [half.into(), Complex64::new(0.0, half)]),
    ] {
        let mut radar = copolar.clone();
        for (antennas, [v, h]) in [(&mut radar.tx, tx), (&mut radar.rx, rx)] {
            antennas.iter_mut().for_each(|a| (a.polarisation.v, a.polarisation.h) = (v, h));
        }
        let cut = seen_by(&radar, "trihedral:leg_m=0.1", [0.2, 0.5], &within(2, 0)).cut_power_w;
        assert!((cut / plain - 1.0).abs() < 1e-9, "{cut} {plain}");
    }
}

/// What leaves a plate meets nothing more.
#[test]
fn nothing_is_cut_off_a_plate() {
    let found = seen("plate:width_m=0.3,height_m=0.2", [0.0, 0.0], &within(1, 0));
    assert!(found.power_w > 0.0 && found.cut.is_empty() && found.cut_power_w == 0.0, "{}", found.cut.len());
    let quiet = seen("trihedral:leg_m=0.1", [0.0; 2], &TraceOptions { least_cut: None, ..within(1, 8) });
    assert_eq!((quiet.bounces, quiet.cut.len(), quiet.cut_power_w), (1, 0, 0.0));
}

/// Where one bounce more would show it is followed, and no further.
#[test]
fn a_corner_is_followed_until_what_is_left_is_below_the_accuracy() {
    let corner = |bounces, most| seen("trihedral:leg_m=0.1", [0.1, 0.6], &within(bounces, most));
    let (three, followed) = (corner(3, 0), corner(1, 8));
    assert_eq!((followed.bounces, &followed.list), (3, &three.list));
    assert_eq!(corner(1, 2).bounces, 2);
    assert_eq!(corner(2, 1).bounces, 2);
    // Merging what is one place changes nothing but rounding.
    let power = power_w(&radar_toml::preset("front77").unwrap(), &three.list);
    assert!((power / three.power_w - 1.0).abs() < 1e-9, "{power} {}", three.power_w);
}

/// Each frame goes as deep as it has to by itself, whichever are asked for first, here where nothing of the corner shows before the third
/// bounce; a number that the scenario gives holds.
#[test]
fn frames_go_as_deep_as_each_has_to() {
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::new(RANGE_M, 0.0, 0.5), PI + 0.1, 0.6, 0.0);
    let spec = "trihedral:leg_m=0.1";
    let body = Reflector::parse(spec).unwrap();
    body.add_to(&mut scene, &material::by_name, (spec, ""), pose, DVec3::ZERO).unwrap();
    let engine = Engine::Cpu(Precision::F64);
    let text = "name = \"deep\"\nradar = \"front77\"\n[frames]\ncount = 3\n[ego]\nspeed_mps = 5\n\
                [[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n";
    let parse = |text: &str| scenario::parse(Path::new("s.toml"), text).unwrap().without_roads().unwrap();
    let mut deep = parse(text);
    assert_eq!((deep.trace.bounces, deep.trace.most_bounces), (3, 8));
    deep.trace.bounces = 1;
    let one = Prepared::new(&deep, &scene).unwrap();
    let later: Vec<Echoes> = [2, 0, 1].map(|i| one.echoes(&engine, 0, i).unwrap().echoes).into();
    assert!(
        later.iter().all(|e| e.bounces == 3),
        "{:?}",
        later.iter().map(|e| e.bounces).collect::<Vec<_>>()
    );
    let other = Prepared::new(&deep, &scene).unwrap();
    assert_eq!(other.echoes(&engine, 0, 1).unwrap().echoes, later[2]);
    let alone = simulate_with(&engine, &deep, &scene, (0, 1), Control::default()).unwrap();
    assert_eq!((alone.echoes.list, alone.echo_summary.bounces), (later[2].list.clone(), 3));
    let fixed = parse(&format!("{text}[trace]\nbounces = 2\n"));
    let fixed = Prepared::new(&fixed, &scene).unwrap().echoes(&engine, 0, 0).unwrap().echoes;
    assert!(fixed.bounces == 2 && fixed.cut_power_w > fixed.power_w);
}
