use super::super::map::MapSettings;
use super::*;
use catseye::base::rng::Draws;

/// A road of 200 m with markers, or with few posts beside them.
fn road(gaps: impl Fn(usize, &mut Draws) -> f64, posts: usize, seed: u32) -> Vec<DVec2> {
    let mut d = Draws::new(seed, 2);
    let mut out = Vec::new();
    for y in [-1.75, 1.75] {
        let (mut x, mut i) = (-10.0 + d.uniform(), 0);
        while x < 250.0 {
            out.push(DVec2::new(x, y));
            x += gaps(i, &mut d);
            i += 1;
        }
    }
    for _ in 0..posts {
        let side = if d.uniform() < 0.5 { -1.0 } else { 1.0 };
        out.push(DVec2::new(250.0 * d.uniform(), side * (5.0 + 3.0 * d.uniform())));
    }
    out
}

fn scan(road: &[DVec2], from: &Pose, d: &mut Draws, missing: f64, extra: f64) -> Vec<ScanPoint> {
    let mut out = Vec::new();
    for p in road {
        let v = DVec2::from_angle(-from.heading_rad).rotate(*p - from.place());
        let draws = [d.uniform(), d.normal(), d.normal()];
        if v.length() < 40.0 && v.length() > 2.0 && v.to_angle().abs() < 1.0 && draws[0] >= missing {
            out.push((v.length() + 0.1 * draws[1], v.to_angle() + 0.01 * draws[2]));
        }
    }
    for _ in 0..(extra * out.len() as f64).round() as usize {
        out.push((2.0 + 38.0 * d.uniform(), 2.0 * d.uniform() - 1.0));
    }
    out.into_iter()
        .map(|(range_m, azimuth_rad)| ScanPoint {
            range_m,
            azimuth_rad,
            range_std_m: 0.1,
            azimuth_std_rad: 0.01,
            range_rate_mps: None,
        })
        .collect()
}

fn mapped(road: &[DVec2], seed: u32) -> SignatureMap {
    let mut d = Draws::new(seed, 3);
    let mut map = SignatureMap::new(MapSettings { near_m: 2.0, ..Default::default() }).unwrap();
    for i in 0..200 {
        let pose = Pose { x_m: f64::from(i), y_m: 0.1, heading_rad: 0.0 };
        let points = scan(road, &pose, &mut d, 0.1, 0.1);
        map.add_scan(pose, [0.02, 0.02, 0.001], None, &points).unwrap();
    }
    map.prune(3, 0.5);
    map
}

fn settings() -> LocateSettings {
    LocateSettings { near_m: 2.0, ..Default::default() }
}

const ROUTE: Search = Search::Route { beside_m: 1.2, turn_rad: 0.1 };

fn random_pose(d: &mut Draws) -> Pose {
    Pose {
        x_m: 10.0 + 170.0 * d.uniform(),
        y_m: 1.6 * d.uniform() - 0.8,
        heading_rad: 0.16 * d.uniform() - 0.08,
    }
}

/// (rms of x, y in m, rms of heading in rad, mean chi², worst distance in m, unique, time of a call).
fn runs(road: &[DVec2], n: usize, missing: f64, extra: f64) -> ([f64; 5], usize, f64) {
    let map = mapped(road, 1);
    let mut d = Draws::new(9, 4);
    let (mut sum, mut worst, mut unique, mut time) = ([0.0; 4], 0.0f64, 0, 0.0);
    for _ in 0..n {
        let truth = random_pose(&mut d);
        let points = scan(road, &truth, &mut d, missing, extra);
        let clock = std::time::Instant::now();
        let l = locate(&map, &points, &ROUTE, &settings()).unwrap();
        time += clock.elapsed().as_secs_f64() / n as f64;
        unique += usize::from(l.rivals.is_empty());
        // Of periodic roads the pose of the list that is nearest to the truth.
        let all = l.rivals.iter().map(|r| r.pose).chain([l.pose]);
        let near = |p: &Pose| p.place().distance(truth.place());
        let p = all.min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
        let e = DVec3::new(p.x_m - truth.x_m, p.y_m - truth.y_m, p.heading_rad - truth.heading_rad);
        sum[0] += e.x * e.x;
        sum[1] += e.y * e.y;
        sum[2] += e.z * e.z;
        sum[3] += e.dot(DMat3::from_cols_array_2d(&l.covariance).inverse() * e);
        worst = worst.max(e.truncate().length());
    }
    let m = sum.map(|x| x / n as f64);
    ([m[0].sqrt(), m[1].sqrt(), m[2].sqrt(), m[3], worst], unique, time)
}

#[test]
fn random_gaps_give_the_place_without_gnss() {
    let road = road(|_, d| if d.uniform() < 0.5 { 1.5 } else { 2.0 }, 20, 5);
    let n = 20;
    let (m, unique, _) = runs(&road, n, 0.1, 0.1);
    assert_eq!(unique, n);
    assert!(m[4] < 0.2, "{m:?}");
    // The map's errors are shared by the points, so chi² may lie over its mean of 3; 3 + 4·sqrt(6 / 20) =
    // 5.2.
    assert!(m[3] > 0.8 && m[3] < 6.0, "{m:?}");
}

#[test]
fn even_spacings_are_ambiguous_by_their_period() {
    let road = road(|_, _| 2.0, 0, 5);
    let map = mapped(&road, 1);
    let mut d = Draws::new(4, 4);
    let truth = Pose { x_m: 100.3, y_m: 0.2, heading_rad: 0.02 };
    let points = scan(&road, &truth, &mut d, 0.1, 0.0);
    let l = locate(&map, &points, &ROUTE, &LocateSettings { candidates: 200, ..settings() }).unwrap();
    // The map's own errors make the places a little unlike; many stay possible all the same.
    assert!(l.rivals.len() >= 5 && l.probability < 0.9, "{} {}", l.rivals.len(), l.probability);
    // By whole spacings, all of them.
    for r in &l.rivals {
        let beside = (0.5 * r.along_m).round() * 2.0 - r.along_m;
        assert!(beside.abs() < 0.15 && r.along_m.abs() > 1.8, "{r:?}");
    }
    assert!(l.period_m().unwrap() < 20.0, "{:?}", l.period_m());
    // Across the road, and modulo the period along it, the place is known.
    assert!((l.pose.y_m - 0.2).abs() < 0.1);
    let along = (l.pose.x_m - truth.x_m).rem_euclid(2.0);
    assert!(along.min(2.0 - along) < 0.1, "{along}");
    // A rough pose within half a period settles it.
    let near =
        Search::Near { pose: Pose { x_m: 100.0, y_m: 0.0, heading_rad: 0.0 }, half_m: 0.8, turn_rad: 0.05 };
    let l = locate(&map, &points, &near, &settings()).unwrap();
    assert!(l.pose.place().distance(truth.place()) < 0.2);
}

#[test]
fn another_road_is_refused() {
    let map = mapped(&road(|_, d| if d.uniform() < 0.5 { 1.5 } else { 2.0 }, 20, 5), 1);
    let mut d = Draws::new(8, 4);
    let points: Vec<ScanPoint> = (0..40)
        .map(|_| ScanPoint {
            range_m: 5.0 + 30.0 * d.uniform(),
            azimuth_rad: 1.8 * d.uniform() - 0.9,
            range_std_m: 0.05,
            azimuth_std_rad: 0.003,
            range_rate_mps: None,
        })
        .collect();
    assert!(matches!(locate(&map, &points, &ROUTE, &settings()), Err(LaneError::Unexplained { .. })));
}

#[test]
fn hostile_input() {
    let map = mapped(&road(|_, _| 2.0, 0, 5), 1);
    let good = ScanPoint {
        range_m: 10.0,
        azimuth_rad: 0.1,
        range_std_m: 0.1,
        azimuth_std_rad: 0.01,
        range_rate_mps: None,
    };
    let bad = ScanPoint { azimuth_rad: f64::NAN, ..good };
    let s = settings();
    assert!(matches!(locate(&map, &[], &ROUTE, &s), Err(LaneError::TooFew { found: 0, .. })));
    assert!(matches!(locate(&map, &[good, bad, bad, bad], &ROUTE, &s), Err(LaneError::TooFew { .. })));
    let empty = SignatureMap::new(MapSettings::default()).unwrap();
    assert_eq!(locate(&empty, &[good; 5], &ROUTE, &s), Err(empty_map()));
    let lost =
        Search::Near { pose: Pose { x_m: f64::NAN, y_m: 0.0, heading_rad: 0.0 }, half_m: 1.0, turn_rad: 0.1 };
    assert_eq!(locate(&map, &[good; 5], &lost, &s), Err(bad_pose()));
    let wide = Search::Route { beside_m: 1e5, turn_rad: 3.0 };
    assert!(matches!(locate(&map, &[good; 5], &wide, &s), Err(LaneError::Refused { .. })));
    let far =
        Search::Near { pose: Pose { x_m: 1e6, y_m: 0.0, heading_rad: 0.0 }, half_m: 1.0, turn_rad: 0.1 };
    assert!(matches!(locate(&map, &[good; 5], &far, &s), Err(LaneError::Unexplained { .. })));
    assert!(locate(&map, &[good; 5], &ROUTE, &LocateSettings { step_m: 0.0, ..s }).is_err());
}

#[test]
#[ignore = "prints the figures of the notes"]
fn figures() {
    for (name, road) in [
        ("random gaps 1.5/2.0 m, 20 posts", road(|_, d| if d.uniform() < 0.5 { 1.5 } else { 2.0 }, 20, 5)),
        ("random gaps 1.5/2.0 m, no posts", road(|_, d| if d.uniform() < 0.5 { 1.5 } else { 2.0 }, 0, 5)),
        ("1.5 m left and right, 20 posts", road(|_, _| 1.5, 20, 5)),
    ] {
        for (missing, extra) in [(0.0, 0.0), (0.1, 0.1), (0.3, 0.3)] {
            let (m, unique, time) = runs(&road, 40, missing, extra);
            println!(
                "{name} | missing {missing} extra {extra} | \
                 x {:.3} y {:.3} m heading {:.3} deg | chi2 {:.2} of 3 | \
                 worst {:.3} m | unique {unique}/40 | {:.0} ms",
                m[0],
                m[1],
                m[2].to_degrees(),
                m[3],
                m[4],
                1e3 * time
            );
        }
    }
}

/// Of scans on a road of even rows: (unique, unique and wrong, best is wrong).
fn honesty(road: &[DVec2], n: usize, missing: f64, extra: f64) -> [usize; 3] {
    let map = mapped(road, 1);
    let mut d = Draws::new(9, 4);
    let mut out = [0; 3];
    for _ in 0..n {
        let truth = random_pose(&mut d);
        let points = scan(road, &truth, &mut d, missing, extra);
        let l = locate(&map, &points, &ROUTE, &settings()).unwrap();
        let is_wrong = l.pose.place().distance(truth.place()) > 0.5;
        out[0] += usize::from(l.rivals.is_empty());
        out[1] += usize::from(l.rivals.is_empty() && is_wrong);
        out[2] += usize::from(is_wrong);
    }
    out
}

#[test]
#[ignore = "prints the figures of the notes"]
fn honesty_figures() {
    for (name, road) in [
        ("1.5 m left and right, 20 posts", road(|_, _| 1.5, 20, 5)),
        ("2 m left and right, no posts", road(|_, _| 2.0, 0, 5)),
    ] {
        for (missing, extra) in [(0.0, 0.0), (0.1, 0.1), (0.3, 0.3)] {
            let [unique, wrong, any] = honesty(&road, 40, missing, extra);
            println!(
                "{name} | missing {missing} extra {extra} | unique {unique}, of these wrong {wrong}; wrong {any}"
            );
        }
    }
}
