//! The radars that people own: their figures against data sheets, and targets at highway speeds through the whole chain.

use catseye::base::control::Control;
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::{Bodies, Point, label, locate};
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye::scene::radar::Radar;
use catseye::scene::radar_figures::RadarFigures;
use catseye::scene::radar_toml::preset;
use catseye::scene::{Scene, Shape};
use catseye::trace::TraceOptions;
use glam::DVec3;

/// What a data sheet or a preset's own file says: range, m; range resolution, m; speed to both sides, m/s; speed resolution, m/s; half-power
/// beams, degrees, 0 where the sheet tells none; half the field of view in azimuth, degrees.
struct Sheet {
    name: &'static str,
    antennas: [usize; 2],
    range_m: f64,
    range_cell_m: f64,
    speed_mps: f64,
    speed_cell_mps: f64,
    beam_deg: [f64; 2],
    view_deg: f64,
}

const fn sheet(
    name: &'static str,
    antennas: [usize; 2],
    [range_m, range_cell_m, speed_mps, speed_cell_mps]: [f64; 4],
    beam_deg: [f64; 2],
    view_deg: f64,
) -> Sheet {
    Sheet { name, antennas, range_m, range_cell_m, speed_mps, speed_cell_mps, beam_deg, view_deg }
}

/// No beams of TI's boards: their documents tell 2/N rad of a row of N, and here the raised channels weigh on the row's middle.
const SHEETS: [Sheet; 10] = [
    sheet("awr1843", [3, 4], [75.0, 0.99, 90.0, 0.24], [0.0; 2], 60.0),
    sheet("iwr6843", [3, 4], [60.0, 0.6, 90.0, 0.24], [0.0; 2], 60.0),
    sheet("iwr6843aop", [3, 4], [60.0, 0.6, 90.0, 0.24], [0.0; 2], 60.0),
    sheet("cascade77", [12, 16], [150.0, 0.89, 90.0, 0.235], [0.0; 2], 60.0),
    sheet("ars408-far", [2, 6], [250.0, 1.79, 400.0 / 3.6, 0.37 / 3.6], [2.2, 0.0], 9.0),
    sheet("ars408-near", [2, 6], [70.0, 0.39, 400.0 / 3.6, 0.43 / 3.6], [4.4, 0.0], 60.0),
    sheet("lrr77", [2, 8], [250.0, 1.07, 90.0, 0.18], [2.1, 0.0], 15.0),
    sheet("lrr77-bursts", [2, 8], [250.0, 0.535, 100.0, 0.383], [2.1, 0.0], 15.0),
    sheet("corner77", [3, 4], [100.0, 0.6, 90.0, 0.24], [8.5, 0.0], 70.0),
    sheet("imaging77", [12, 16], [300.0, 1.79, 90.0, 0.12], [2.1, 8.5], 60.0),
];

fn is_near(got: f64, want: f64, relative: f64) -> bool {
    (got - want).abs() <= relative * want
}

#[test]
fn figures_are_those_of_the_sheets() {
    for s in &SHEETS {
        let f = RadarFigures::of(&preset(s.name).unwrap());
        println!("{}: {f:.3?}", s.name);
        assert_eq!(f.antennas, s.antennas, "{}", s.name);
        // Cells go on behind the stated range, where filters would roll off.
        assert!(f.max_range_m >= 0.999 * s.range_m && f.max_range_m <= 1.45 * s.range_m, "{}", s.name);
        assert!(is_near(f.range_resolution_m, s.range_cell_m, 0.01), "{}: {}", s.name, f.range_resolution_m);
        assert!(is_near(f.max_speed_mps.unwrap(), s.speed_mps, 0.015), "{}: {:?}", s.name, f.max_speed_mps);
        assert!(is_near(f.speed_resolution_mps.unwrap(), s.speed_cell_mps, 0.03), "{}", s.name);
        for (got, want) in f.beam_deg.iter().zip(s.beam_deg).filter(|b| b.1 > 0.0) {
            assert!(is_near(got.unwrap(), want, 0.03), "{}: beam {got:?}, not {want}", s.name);
        }
    }
}

/// The published places of the boards: the cascade's 86 in azimuth and four rows, the boards' eight and four, the package's square.
#[test]
fn boards_have_the_published_virtual_arrays() {
    let places = |name: &str| {
        let r = preset(name).unwrap();
        let half = 0.5 * r.wavelength_m();
        let mut out: Vec<(i64, i64)> = Vec::new();
        for t in &r.tx {
            out.extend(r.rx.iter().map(|x| {
                let p = (t.position_m + x.position_m) / half * 2.0;
                assert!((p - p.round()).length() < 1e-9, "{name}: {p}");
                (p.z as i64, p.y.round() as i64)
            }));
        }
        out.sort_unstable();
        out.dedup();
        out
    };
    let row = |from: i64, n: i64| (0..n).map(move |i| from + 2 * i).collect::<Vec<_>>();
    let at = |all: &[(i64, i64)], z: i64| all.iter().filter(|p| p.0 == z).map(|p| p.1).collect::<Vec<_>>();
    for name in ["awr1843", "iwr6843"] {
        let all = places(name);
        assert_eq!((at(&all, 0), at(&all, 2), all.len()), (row(-7, 8), row(-3, 4), 12), "{name}");
    }
    let cascade = places("cascade77");
    // Twice half wavelengths; the middle of 0..=85 lies half a step beside that of the phase centres.
    assert_eq!(at(&cascade, 0), row(-85, 86));
    let mut rows: Vec<i64> = cascade.iter().map(|p| p.0).collect();
    rows.dedup();
    assert_eq!(rows, [0, 2, 8, 12]);
    let aop = places("iwr6843aop");
    assert_eq!(aop.len(), 12);
    let counts: Vec<usize> = [-3, -1, 1, 3].map(|z| at(&aop, z).len()).to_vec();
    assert_eq!(counts, [4, 4, 2, 2]);
}

/// Points of targets of 20 dBsm at (range, azimuth in degrees, range rate), each with the number of its target, by the whole chain.
/// `own_mps` is what the radar knows of its own velocity; targets move against the radar.
fn points(radar: &Radar, targets: &[(f64, f64, f64)], own_mps: Option<DVec3>) -> Vec<Point> {
    let pose = Pose::from_yaw_pitch_roll(DVec3::new(0.0, 0.0, 0.5), 0.0, 0.0, 0.0);
    let mut scene = Scene::default();
    for (range, azimuth, rate) in targets {
        let u = pose.direction(direction_from_angles(azimuth.to_radians(), 0.0));
        let place = Pose::from_yaw_pitch_roll(pose.translation_m + u * *range, 0.0, 0.0, 0.0);
        scene.add_object("corner", "reflector", Shape::Point { rcs_dbsm: 20.0 }, place, u * *rate);
    }
    let engine = Engine::Cpu(Precision::F32);
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    let echoes = engine.trace(&geometry, radar, &pose, DVec3::ZERO, &TraceOptions::default()).unwrap();
    let (cube, _) = engine.cube(radar, &echoes, &[], 9, 2, Control::default()).unwrap();
    let mut found = engine.maps(radar, &cube).unwrap();
    let mut points = locate::points(&engine, radar, &mut found, own_mps).unwrap();
    label::label(radar, &mut points, &echoes, &Bodies::new(&scene, 0.0, &pose)).unwrap();
    points
}

/// The strongest point of each target is in its cell of range, direction and range rate, with the sign of the latter and the right level.
fn check(s: &Sheet, radar: &Radar, targets: &[(f64, f64, f64)], state: &[Ambiguity]) {
    let points = points(radar, targets, None);
    let f = RadarFigures::of(radar);
    let beam_deg = f.beam_deg[0].unwrap();
    for (i, (range, azimuth, rate)) in targets.iter().enumerate() {
        let of = points.iter().filter(|p| p.object_id == i as u32 + 1);
        let p = of.max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm));
        let p = p.unwrap_or_else(|| panic!("{}: no point at {range} m, {azimuth} deg, {rate} m/s", s.name));
        let said = format!(
            "{}: {range:.1} m, {azimuth:.2} deg, {rate} m/s: {:.2} m, {:.2} deg, {:.2} m/s, {:.1} dBsm, {:?}",
            s.name,
            p.range_m,
            p.azimuth_rad.to_degrees(),
            p.range_rate_mps,
            p.rcs_dbsm,
            p.ambiguity
        );
        println!("{said}");
        assert!((p.range_m - range).abs() < f.range_resolution_m, "{said}");
        // A tenth of the beam, which is wider aside.
        let widened = beam_deg / azimuth.to_radians().cos();
        assert!((p.azimuth_rad.to_degrees() - azimuth).abs() < 0.1 * widened, "{said}");
        assert!((p.range_rate_mps - rate).abs() < f.speed_resolution_mps.unwrap(), "{said}");
        assert!(state.contains(&p.ambiguity), "{said}");
        // What walks through its cell at 80 m/s loses a little; between cells nothing is lost (eq. 18).
        assert!(p.rcs_dbsm > 18.5 && p.rcs_dbsm < 20.5, "{said}");
    }
}

/// A corner at half the range at both sides; one that comes at 40 m/s, one that leaves, traffic that meets at 80 m/s.
#[test]
fn corners_and_highway_speeds_are_found_with_the_right_sign() {
    for s in &SHEETS {
        let radar = preset(s.name).unwrap();
        let side_deg = 20f64.min(0.6 * s.view_deg);
        let targets = [
            (0.5 * s.range_m, side_deg, 0.0),
            (0.55 * s.range_m, -side_deg, 0.0),
            (0.35 * s.range_m, 0.0, -40.0),
            (0.4 * s.range_m, 0.5 * side_deg, 40.0),
            (0.3 * s.range_m, -0.5 * side_deg, -80.0),
        ];
        check(s, &radar, &targets, &[Ambiguity::Resolved]);
    }
}

/// Every speed from -80 to 80 m/s, in one frame of each radar that tells them with few channels.
#[test]
fn speeds_up_to_80_mps_are_told() {
    for s in SHEETS.iter().filter(|s| s.antennas[0] < 12) {
        let radar = preset(s.name).unwrap();
        let targets: Vec<(f64, f64, f64)> = (-8..=8)
            .map(|i| {
                (
                    s.range_m * (0.5 + 0.025 * f64::from(i)),
                    0.03 * s.view_deg * f64::from(i),
                    10.0 * f64::from(i),
                )
            })
            .collect();
        check(s, &radar, &targets, &[Ambiguity::Resolved]);
    }
}

/// A slower profile of the same board, 30 us from chirp to chirp, folds -40 m/s to 25: the point says so, and the ego's own speed puts what
/// stands where it belongs.
#[test]
fn the_egos_speed_places_what_stands() {
    let text = catseye::scene::radar_toml::PRESETS.iter().find(|p| p.0 == "awr1843").unwrap().1;
    let slow = text.replacen("chirp_period_s = 10.8e-6", "chirp_period_s = 30e-6", 1);
    assert_ne!(slow, text);
    let radar = catseye::scene::radar_toml::parse(std::path::Path::new("slow.toml"), &slow).unwrap();
    // λ/2T_c = 64.9 m/s.
    let span_mps = 0.5 * radar.sample_wavelength_m() / 30e-6;
    let strongest = |own_mps: Option<DVec3>| {
        let found = points(&radar, &[(30.0, 5.0, -40.0)], own_mps);
        found.into_iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap()
    };
    let p = strongest(None);
    assert_eq!(p.ambiguity, Ambiguity::Ambiguous);
    assert!((p.range_rate_mps - (span_mps - 40.0)).abs() < 0.1, "{}", p.range_rate_mps);
    // The wavelength of a ramp that comes back from 30 m is a little longer (eq. 16a).
    let longer = 1.0 + radar.slope_hz_per_s() * 2.0 * p.range_m / 299_792_458.0 / radar.sample_centre_hz();
    assert!((p.modulo_mps - span_mps * longer).abs() < 1e-8 * span_mps, "{}", p.modulo_mps);
    // At 5 deg what stands comes at cos 5 deg of the ego's speed.
    let p = strongest(Some(DVec3::X * 40.0 / 5f64.to_radians().cos()));
    assert_eq!(p.ambiguity, Ambiguity::EgoSpeed);
    assert!((p.range_rate_mps + 40.0).abs() < 0.1, "{}", p.range_rate_mps);
}
