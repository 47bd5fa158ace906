//! Points from cubes: places, signs, absolute levels, labels, files.

use catseye::adc::Cube;
use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::noise::Noise;
use catseye::adc::synthesis::{Plan, point_echo};
use catseye::base::control::Control;
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::base::units::{C0, power_from_db};
use catseye::detect::accuracy::PointStd;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::{Bodies, Detected, Labeller, Point, files, label, locate, points};
use catseye::engine::{Engine, Precision};
use catseye::formats::csv::Table;
use catseye::scene::radar::*;
use catseye::scene::waveform::{Multiplex, Waveform};
use catseye::scene::{Object, Scene, Shape};
use catseye::trace::{Echo, Echoes};
use glam::DVec3;
use num_complex::Complex64;

fn antenna(y: f64, z: f64) -> Antenna {
    Antenna {
        position_m: DVec3::new(0.0, y, z),
        polarisation: Polarisation { v: Complex64::ONE, h: Complex64::ZERO },
        gain_dbi: 11.0,
        pattern: Pattern::CosinePower { azimuth_exponent: 1.5, elevation_exponent: 4.0 },
    }
}

/// 3 x 4 channels: eight in a row and four a half wavelength above.
fn radar() -> Radar {
    let half = 0.5 * C0 / 77e9;
    Radar {
        name: "test".into(),
        carrier_hz: 77e9,
        waveform: Waveform::chirp(1e9, 40e-6, 45e-6),
        multiplex: Multiplex::Tdm,
        adc_start_s: 0.0,
        sample_rate_hz: 6.4e6,
        samples: 256,
        chirps: 64,
        sampling: Sampling::Iq,
        tx: vec![antenna(0.0, 0.0), antenna(4.0 * half, 0.0), antenna(2.0 * half, half)],
        rx: (0..4).map(|i| antenna(f64::from(i) * half, 0.0)).collect(),
        tx_power_dbm: 12.0,
        noise_figure_db: 12.0,
        thermal_noise: true,
        front_end: Default::default(),
        mounting: Pose::IDENTITY,
        motion: None,
        processing: Processing {
            range_window: Window::Hann,
            doppler_window: Window::Hann,
            angle_window: Window::Rectangle,
            range_fft: 256,
            doppler_fft: 64,
            azimuth_bins: 65,
            azimuth_fov_rad: 60f64.to_radians(),
            elevation_bins: 17,
            elevation_fov_rad: 30f64.to_radians(),
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Ca, guard: [2, 2], train: [4, 8], pfa: 1e-6 },
            max_points: 50,
        },
    }
}

fn object(id: u32, class: &str) -> Object {
    Object {
        id,
        name: format!("object {id}"),
        class: class.into(),
        shape: Shape::Point { rcs_dbsm: 0.0 },
        pose: Pose::IDENTITY,
        velocity_mps: DVec3::ZERO,
        motion: None,
        radar: true,
    }
}

/// Seen from the world's origin.
fn bodies(objects: &[Object]) -> Bodies {
    Bodies::new(&Scene { objects: objects.to_vec(), ..Default::default() }, 0.0, &Pose::IDENTITY)
}

fn echo(range: f64, azimuth_deg: f64, elevation_deg: f64, rate: f64, dbsm: f64, id: u32) -> Echo {
    let u = direction_from_angles(azimuth_deg.to_radians(), elevation_deg.to_radians());
    point_echo(u * range, u * rate, power_from_db(dbsm), id)
}

fn cloud(radar: &Radar, list: Vec<Echo>, objects: &[Object]) -> Vec<Point> {
    let echoes = Echoes { list, ..Default::default() };
    let mut cube: Cube<f64> = synthesise(&Plan::new(radar, &echoes).unwrap(), Control::default()).unwrap();
    catseye::adc::cpu::noise::add(&mut cube, &Noise::thermal(radar, 3, 0).unwrap());
    let (_, found) = catseye::dsp::cpu::process(&cube, radar).unwrap();
    let mut cloud = locate::points(&Engine::Cpu(Precision::F64), radar, &mut [found], None).unwrap();
    label::label(radar, &mut cloud, &echoes, &bodies(objects)).unwrap();
    cloud
}

#[test]
fn a_point_in_the_middle_of_its_cell_has_its_level() {
    let radar = radar();
    let range = 100.0 * radar.range_bin_m();
    let all = cloud(&radar, vec![echo(range, 0.0, 0.0, 0.0, 20.0, 1)], &[object(1, "post")]);
    let p = &all[0];
    println!("{p:?}");
    assert!((p.range_m - range).abs() < 0.003 && p.range_rate_mps.abs() < 0.01);
    assert!(p.azimuth_rad.abs() < 0.003 && p.elevation_rad.abs() < 0.01);
    assert!((p.position_m - DVec3::new(range, 0.0, 0.0)).length() < 0.3);
    // 12 dBm + 2 x 11 dBi + 20 lg lambda + 20 dBsm - 30 lg 4pi - 40 lg R
    let hand = 12.0 + 22.0 + 20.0 * radar.wavelength_m().log10() + 20.0
        - 30.0 * (4.0 * std::f64::consts::PI).log10()
        - 40.0 * range.log10();
    assert!((p.power_dbm - hand).abs() < 0.05, "{} {hand}", p.power_dbm);
    assert!((p.rcs_dbsm - 20.0).abs() < 0.05);
    // Noise: -174 dBm/Hz + 12 dB, 6.4 MHz over 256 x 64 samples, and 1.76 dB for each Hann window.
    let noise = -173.975 + 12.0 + 10.0 * (6.4e6 / (256.0 * 64.0) * 1.5 * 1.5f64).log10();
    assert!((p.snr_db - (hand - noise)).abs() < 0.4, "{} {}", p.snr_db, hand - noise);
    assert_eq!((p.object_id, p.class.as_str()), (1, "post"));
}

#[test]
fn signs_and_places() {
    let radar = radar();
    for (range, azimuth, elevation, rate) in [
        (15.3, 20.0, 8.0, 4.7),
        (15.3, -20.0, 8.0, -4.7),
        (22.1, 35.0, -8.0, 6.1),
        (22.1, -35.0, -8.0, -6.1),
        (11.04, 0.0, 0.0, 3.33),
    ] {
        let all = cloud(&radar, vec![echo(range, azimuth, elevation, rate, 10.0, 4)], &[object(4, "car")]);
        let p = &all[0];
        println!(
            "{range} m {azimuth} {elevation} deg {rate} m/s: {:.3} m {:.2} {:.2} deg {:.3} m/s {:.2} dBsm",
            p.range_m,
            p.azimuth_rad.to_degrees(),
            p.elevation_rad.to_degrees(),
            p.range_rate_mps,
            p.rcs_dbsm
        );
        // The Doppler shift is worth v f_c / S = 3.1 mm per m/s: 10 to 19 mm here without eq. 15's second term.
        assert!((p.range_m - range).abs() < 0.006);
        assert!((p.range_rate_mps - rate).abs() < 0.03);
        assert!((p.azimuth_rad.to_degrees() - azimuth).abs() < 0.7);
        assert!((p.elevation_rad.to_degrees() - elevation).abs() < 1.5);
        // Scalloping of two Hann windows is 1.42 dB each at worst.
        assert!(p.rcs_dbsm < 10.1 && p.rcs_dbsm > 7.0);
        assert_eq!(p.object_id, 4);
    }
}

/// Departure and arrival differ: through three transmitters and four receivers such an echo looks like no direction of
/// its own, and the point that the chain makes of it is still its object's.
#[test]
fn labels_know_both_ends_of_a_path() {
    let radar = radar();
    for (out_deg, back_deg) in [(-30.0, 12.0), (12.0, -30.0), (45.0, 5.0), (-8.0, 50.0)] {
        let mut e = echo(20.0, out_deg, 0.0, 0.0, 25.0, 2);
        e.arrival = direction_from_angles(f64::to_radians(back_deg), 0.0);
        e.chain[1] = 4;
        e.bounces = 2;
        let all = cloud(&radar, vec![e], &[object(2, "wall"), object(4, "car")]);
        let p = &all[0];
        println!("{out_deg} {back_deg}: {:.1} deg, {} {}", p.azimuth_rad.to_degrees(), p.object_id, p.share);
        assert_eq!((p.object_id, p.class.as_str(), p.bounces), (4, "car", 2));
        assert!((p.range_m - 20.0).abs() < 0.1 && p.share == 1.0);
    }
}

/// Beams point where the echo is, the search ends before: the spectrum rises to its end.
#[test]
fn directions_at_the_end_of_the_search_are_marked() {
    let mut radar = radar();
    for method in [AngleMethod::Bartlett, AngleMethod::Music, AngleMethod::Ml] {
        radar.processing.angle = AngleSettings { method, sources: Sources::Given(1), ..Default::default() };
        for (azimuth_deg, elevation_deg, outside) in [
            (0.0, 5.0, false),
            (20.0, -10.0, false),
            (0.0, 40.0, true),
            (72.0, 0.0, true),
            (-10.0, -38.0, true),
        ] {
            let all = cloud(
                &radar,
                vec![echo(20.0, azimuth_deg, elevation_deg, 0.0, 30.0, 1)],
                &[object(1, "post")],
            );
            let p = &all[0];
            println!(
                "{method:?} {azimuth_deg} {elevation_deg}: {:.3} {:.3} {}",
                p.azimuth_rad.to_degrees(),
                p.elevation_rad.to_degrees(),
                p.at_search_edge
            );
            assert_eq!(p.at_search_edge, outside);
            let off = (p.azimuth_rad.to_degrees() - azimuth_deg).abs()
                + (p.elevation_rad.to_degrees() - elevation_deg).abs();
            assert_eq!(off > 5.0, outside, "{off}");
        }
    }
}

#[test]
fn labels_follow_range_rate_and_azimuth() {
    let radar = radar();
    let objects = [object(1, "car"), object(2, "car"), object(3, "post"), object(4, "marker")];
    let list = vec![
        echo(20.0, 0.0, 0.0, 0.0, 10.0, 1),
        // Same range, other range rate.
        echo(20.0, 0.0, 0.0, 3.0, 10.0, 2),
        // Same range and rate, other azimuth.
        echo(20.0, 40.0, 0.0, 0.0, 12.0, 3),
        echo(25.0, 0.0, 0.0, 0.0, 0.0, 4),
    ];
    let echoes = Echoes { list, ..Default::default() };
    let bodies = bodies(&objects);
    let labeller = Labeller::new(&radar, &echoes, &bodies).unwrap();
    let at = |range: f64, azimuth: f64, rate: f64| {
        let d = Detected {
            range_bin: (range + rate * radar.carrier_hz / radar.slope_hz_per_s()) / radar.range_bin_m(),
            doppler_row: 32.0 + rate / radar.velocity_bin_mps(),
            azimuth_rad: f64::to_radians(azimuth),
            elevation_rad: 0.0,
            power_w: 1e-13,
            scalloping: 1.0,
            noise_w: 1e-15,
            unfolded_mps: 0.0,
            ambiguity: Ambiguity::Unresolved,
            modulo_mps: f64::INFINITY,
            angle_std_rad: None,
            looks: 1,
            at_search_edge: false,
            by_folds: Default::default(),
        };
        labeller.label(&points::point(&radar, &d, &locate::accuracy(&radar).unwrap())).object_id
    };
    assert_eq!(at(20.0, 0.0, 0.0), 1);
    assert_eq!(at(20.0, 0.0, 3.0), 2);
    assert_eq!(at(20.1, 38.0, 0.1), 3);
    assert_eq!(at(25.05, 1.0, 0.0), 4);
    assert_eq!(at(22.0, 0.0, 0.0), 0);
    // An alias: 3 m/s seen one ambiguity away.
    let p = Point { range_rate_mps: 3.0 - 2.0 * radar.max_velocity_mps(), ..sample_point() };
    assert_eq!(labeller.label(&Point { range_m: 20.0, azimuth_rad: 0.0, ..p }).object_id, 2);
    assert_eq!(bodies.class(3), "post");
    assert_eq!(bodies.class(0), "");
}

#[test]
fn label_is_the_object_with_most_power_and_surfaces_yield() {
    let radar = radar();
    let objects = [object(1, "road"), object(2, "car"), object(3, "post")];
    let mut by_ground = echo(20.0, 0.0, 0.0, 0.0, 12.0, 1);
    by_ground.chain[1] = 2;
    by_ground.bounces = 2;
    let class = |id: u32| objects.iter().find(|o| o.id == id).map_or("", |o| o.class.as_str());
    assert_eq!(label::object_of(&by_ground, class), 2);
    assert_eq!(label::object_of(&echo(20.0, 0.0, 0.0, 0.0, 12.0, 1), class), 1);
    let p =
        Point { range_m: 20.0, range_rate_mps: 0.0, azimuth_rad: 0.0, elevation_rad: 0.0, ..sample_point() };
    let bodies = bodies(&objects);
    let of = |list: Vec<Echo>| {
        Labeller::new(&radar, &Echoes { list, ..Default::default() }, &bodies).unwrap().label(&p)
    };
    let best = |list: Vec<Echo>| of(list).object_id;
    assert_eq!(best(vec![by_ground.clone(), echo(20.0, 0.0, 0.0, 0.0, 11.0, 3)]), 2);
    assert_eq!(best(vec![by_ground, echo(20.0, 0.0, 0.0, 0.0, 13.0, 3)]), 3);
    // Two echoes of the road in opposite phase carry nothing.
    let quarter = 0.25 * radar.wavelength_m();
    let road = vec![echo(20.0, 0.0, 0.0, 0.0, 20.0, 1), echo(20.0 + quarter, 0.0, 0.0, 0.0, 20.0, 1)];
    assert_eq!(best([road, vec![echo(20.0, 0.0, 0.0, 0.0, 0.0, 3)]].concat()), 3);
    assert_eq!(best(Vec::new()), 0);
    // 10 dB and 7 dB: a share of 1/(1 + 10^-0.3); the second has two bounces.
    let mut double = echo(20.0, 0.0, 0.0, 0.0, 7.0, 3);
    double.bounces = 2;
    let got = of(vec![echo(20.0, 0.0, 0.0, 0.0, 10.0, 2), double.clone()]);
    assert_eq!((got.object_id, got.bounces, got.ghost), (2, 1, false));
    assert!((got.share - 1.0 / (1.0 + 10f64.powf(-0.3))).abs() < 1e-9, "{got:?}");
    assert_eq!(of(vec![double]).bounces, 2);
}

fn sample_point() -> Point {
    Point {
        range_m: 10.0,
        range_rate_mps: -1.5,
        azimuth_rad: 0.5,
        elevation_rad: -0.25,
        position_m: DVec3::new(1.0, 2.0, 3.0),
        power_dbm: -100.25,
        snr_db: 20.0,
        rcs_dbsm: f64::INFINITY,
        object_id: 7,
        class: "car, small".into(),
        bounces: 2,
        ghost: true,
        side_lobe: true,
        folded: false,
        aliased: false,
        share: 0.75,
        angle_ambiguity: None,
        other_angles_rad: vec![],
        at_search_edge: true,
        others_std_rad: [0.0; 2],
        cell: None,
        std: PointStd { range_m: 0.01, range_rate_mps: 0.02, azimuth_rad: Some(0.03), elevation_rad: None },
        beat_std_cells: 0.1,
        ambiguity: Ambiguity::Resolved,
        modulo_mps: f64::INFINITY,
    }
}

#[test]
fn tables_hold_what_the_contract_says() {
    let bytes = files::write_points(Vec::new(), &[sample_point()]).unwrap();
    let table = Table::parse("points.csv", String::from_utf8(bytes).unwrap()).unwrap();
    assert_eq!(
        table.header.join(","),
        "range_m,range_rate_mps,azimuth_deg,elevation_deg,x_m,y_m,z_m,power_dbm,snr_db,rcs_dbsm,object_id,class,\
         range_std_m,range_rate_std_mps,azimuth_std_deg,elevation_std_deg,ambiguity,bounces,ghost,share,\
         range_rate_modulo_mps,at_search_edge,side_lobe,folded,aliased,angle_ambiguity,other_angles_deg"
    );
    let p = sample_point();
    for (column, value) in [
        ("range_m", p.range_m),
        ("range_rate_mps", p.range_rate_mps),
        ("azimuth_deg", p.azimuth_rad.to_degrees()),
        ("elevation_deg", p.elevation_rad.to_degrees()),
        ("x_m", 1.0),
        ("y_m", 2.0),
        ("z_m", 3.0),
        ("power_dbm", p.power_dbm),
        ("snr_db", p.snr_db),
        ("rcs_dbsm", p.rcs_dbsm),
        ("object_id", 7.0),
        ("bounces", 2.0),
        ("ghost", 1.0),
        ("share", 0.75),
        ("at_search_edge", 1.0),
        ("side_lobe", 1.0),
    ] {
        assert_eq!(table.numbers(column).unwrap(), [value], "{column}");
    }
    for (column, value) in
        [("range_std_m", 0.01), ("range_rate_std_mps", 0.02), ("azimuth_std_deg", 0.03f64.to_degrees())]
    {
        assert_eq!(table.numbers(column).unwrap(), [value], "{column}");
    }
    assert_eq!(table.text("elevation_std_deg").unwrap(), [""]);
    assert_eq!(table.text("ambiguity").unwrap(), ["resolved"]);
    assert_eq!(table.text("class").unwrap(), ["car, small"]);

    let radar = radar();
    let mut r = echo(50.0, 0.0, 0.0, -3.0, 10.0, 5);
    r.chain[1] = 9;
    r.bounces = 2;
    let list = Echoes { list: vec![r], rays: 1, ..Default::default() };
    let bytes = files::write_echoes(Vec::new(), &radar, &list).unwrap();
    let table = Table::parse("returns.csv", String::from_utf8(bytes).unwrap()).unwrap();
    assert_eq!(
        table.header.join(","),
        "range_m,range_rate_mps,azimuth_deg,elevation_deg,power_dbm,chain,bounces"
    );
    assert_eq!(table.text("chain").unwrap(), ["5 9"]);
    assert_eq!(table.numbers("bounces").unwrap(), [2.0]);
    assert_eq!(table.numbers("range_rate_mps").unwrap(), [-3.0]);
    // 12 + 22 + 10 dB, lambda 3.8934 mm, 50 m: as in `adc.rs` with 2 dB more gain.
    assert!((table.numbers("power_dbm").unwrap()[0] + 105.1286).abs() < 0.01);
}
