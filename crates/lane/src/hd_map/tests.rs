//! Synthetic roads: a two-way road of eight lanes, emergency lanes among them, straight, in a curve of
//! 500 m, with an exit ramp and with an emergency bay.

use super::accuracy::{AccuracyTable, Cause, SceneKind};
use super::*;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A small generator (SplitMix64) with a fixed seed.
pub(super) struct Draws(pub u64);

impl Draws {
    fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * ((self.word() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.word() % n as u64) as usize
    }

    fn normal(&mut self) -> f64 {
        let u = 1.0 - self.between(0.0, 1.0);
        (-2.0 * u.ln()).sqrt() * (TAU * self.between(0.0, 1.0)).cos()
    }
}

/// A plan of (length, curvature at the start, at the end), curvature positive to the left.
struct Axis {
    start_m: DVec2,
    heading_rad: f64,
    plan: Vec<[f64; 3]>,
}

impl Axis {
    fn straight(length_m: f64) -> Axis {
        Axis { start_m: DVec2::ZERO, heading_rad: 0.0, plan: vec![[length_m, 0.0, 0.0]] }
    }

    /// Position and heading, by Simpson's rule over steps of at most 2 m.
    fn at(&self, s_m: f64) -> (DVec2, f64) {
        let (mut p, mut heading, mut left_m) = (self.start_m, self.heading_rad, s_m);
        for &[length_m, k0, k1] in &self.plan {
            let run_m = left_m.min(length_m);
            let turned = |s: f64| k0 * s + (k1 - k0) * s * s / (2.0 * length_m);
            let steps = (run_m / 2.0).ceil().max(1.0);
            let h = run_m / steps;
            for i in 0..steps as usize {
                let s = i as f64 * h;
                let [a, b, c] = [s, s + h / 2.0, s + h].map(|s| DVec2::from_angle(heading + turned(s)));
                p += (a + 4.0 * b + c) * h / 6.0;
            }
            heading += turned(run_m);
            left_m -= run_m;
            if left_m <= 0.0 {
                break;
            }
        }
        (p, heading)
    }

    /// The point at s, and t to the left of the axis.
    fn point(&self, s_m: f64, t_m: f64) -> DVec2 {
        let (p, heading) = self.at(s_m);
        p + DVec2::from_angle(heading).perp() * t_m
    }
}

/// A world plane that touches the earth somewhere, x at an azimuth of its own.
const WORLD: RadarPose = RadarPose { position: Wgs84::new(30.515, 114.33, 27.0), azimuth_rad: 0.65 };

fn place_of(world_m: DVec2) -> Wgs84 {
    RadarFrame::new(&WORLD).unwrap().place(world_m.extend(0.0))
}

/// A radar over a point of the world plane.
fn pose_at(world_m: DVec2, heading_rad: f64) -> RadarPose {
    RadarPose::within(&WORLD, world_m.extend(8.0), heading_rad).unwrap()
}

fn lane(number: i32, kind: LaneKind, width_m: f64) -> Lane {
    Lane { number, kind, width_m: Width::Constant(width_m) }
}

/// Width of the lanes between the edges, without bays and exits.
const WIDTHS_M: [f64; 4] = [3.75, 3.75, 3.75, 3.0];
const CARRIAGEWAY_M: f64 = 14.25;
const MEDIAN_M: f64 = 1.0;

/// One carriageway on one side (-1 right, +1 left), with an extra lane outside the emergency lane.
fn carriageway(axis: &Axis, side: f64, stations_m: &[f64], extra: Option<Lane>) -> Carriageway {
    let first = if side < 0.0 { 0 } else { 10 };
    let mut lanes = vec![lane(first, LaneKind::Median, MEDIAN_M)];
    for (i, width_m) in WIDTHS_M.into_iter().enumerate() {
        let kind = if i == 3 { LaneKind::Emergency } else { LaneKind::Driving };
        lanes.push(lane(first + 1 + i as i32, kind, width_m));
    }
    let inner = |s| place_of(axis.point(s, side * MEDIAN_M));
    let outer = |s, extra_m| place_of(axis.point(s, side * (MEDIAN_M + CARRIAGEWAY_M + extra_m)));
    let mut stations: Vec<(f64, f64)> = stations_m.iter().map(|s| (*s, 0.0)).collect();
    if let Some(Lane { width_m: width @ Width::Along(list), .. }) = &extra {
        stations.retain(|(s, _)| list.iter().all(|[t, _]| t != s));
        stations.iter_mut().for_each(|(s, w)| *w = width.at_m(*s));
        stations.extend(list.iter().map(|[s, w]| (*s, *w)));
        // In order, and at a step the width before it first.
        stations.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    }
    lanes.extend(extra);
    lanes.push(lane(first + 6, LaneKind::Shoulder, 0.75));
    Carriageway {
        name: if side < 0.0 { "up" } else { "down" }.to_string(),
        inner_edge: stations_m.iter().map(|s| inner(*s)).collect(),
        outer_edge: stations.iter().map(|(s, w)| outer(*s, *w)).collect(),
        lanes,
    }
}

fn every(step_m: f64, to_m: f64) -> Vec<f64> {
    let n = (to_m / step_m).round() as usize;
    (0..=n).map(|i| to_m * i as f64 / n as f64).collect()
}

/// A scene: its map, its radar, and the stretches on which vehicles are drawn.
struct Road {
    map: HdMap,
    pose: RadarPose,
    /// Axis, from s, to s, lane number, from t, to t.
    stretches: Vec<(Axis, [f64; 2], i32, [f64; 2])>,
}

impl Road {
    fn eight_lanes(axis: impl Fn() -> Axis, step_m: f64, to_m: f64, extra: Option<Lane>) -> Road {
        let stations = every(step_m, to_m);
        let carriageways =
            vec![carriageway(&axis(), -1.0, &stations, extra), carriageway(&axis(), 1.0, &stations, None)];
        let mut stretches = Vec::new();
        for (side, first) in [(-1.0, 1), (1.0, 11)] {
            let mut t = MEDIAN_M;
            for (i, width_m) in WIDTHS_M.into_iter().enumerate() {
                let ends = [side * t, side * (t + width_m)];
                stretches.push((axis(), [20.0, to_m - 20.0], first + i as i32, ends));
                t += width_m;
            }
        }
        Road { map: HdMap { carriageways }, pose: pose_at(DVec2::new(-5.0, -16.0), 0.03), stretches }
    }

    fn of(kind: SceneKind, step_m: f64) -> Road {
        let outer_t = -MEDIAN_M - CARRIAGEWAY_M;
        match kind {
            SceneKind::Straight => Road::eight_lanes(|| Axis::straight(300.0), step_m, 300.0, None),
            SceneKind::Curve => {
                let arc = || Axis {
                    start_m: DVec2::ZERO,
                    heading_rad: 0.0,
                    plan: vec![[300.0, 1.0 / 500.0, 1.0 / 500.0]],
                };
                Road::eight_lanes(arc, step_m, 300.0, None)
            }
            SceneKind::EmergencyBay => {
                let width_m = Width::Along(vec![[150.0, 0.0], [165.0, 3.5], [205.0, 3.5], [220.0, 0.0]]);
                let bay = Lane { number: 5, kind: LaneKind::Bay, width_m };
                let mut road = Road::eight_lanes(|| Axis::straight(300.0), step_m, 300.0, Some(bay));
                road.stretches.push((Axis::straight(300.0), [165.0, 205.0], 5, [outer_t, outer_t - 3.5]));
                road
            }
            SceneKind::Ramp => {
                let width_m = Width::Along(vec![[60.0, 0.0], [110.0, 3.75], [160.0, 3.75], [160.0, 0.0]]);
                let exit = Lane { number: 5, kind: LaneKind::Ramp, width_m };
                let mut road = Road::eight_lanes(|| Axis::straight(300.0), step_m, 300.0, Some(exit));
                road.stretches.push((Axis::straight(300.0), [110.0, 159.0], 5, [outer_t, outer_t - 3.75]));
                // It turns right through 87 degrees.
                let k = -1.0 / 120.0;
                let length_m = 210.0;
                let axis = || Axis {
                    start_m: DVec2::new(160.0, outer_t - 1.875),
                    heading_rad: 0.0,
                    plan: vec![[60.0, 0.0, k], [150.0, k, k]],
                };
                let edge = |t: f64| {
                    every(step_m.min(10.0), length_m).iter().map(|s| place_of(axis().point(*s, t))).collect()
                };
                road.map.carriageways.push(Carriageway {
                    name: "ramp".to_string(),
                    inner_edge: edge(1.875),
                    outer_edge: edge(-1.875),
                    lanes: vec![lane(21, LaneKind::Ramp, 3.75)],
                });
                // Where it has parted from the motorway.
                let vehicles = || (axis(), [45.0, length_m - 5.0], 21, [1.875, -1.875]);
                road.stretches.extend((0..4).map(|_| vehicles()));
                road
            }
        }
    }

    /// A vehicle: its lane, and where it is in the radar's axes. `across` draws its place in a lane as a
    /// distance from the lane's middle, given half the lane's width.
    fn vehicle(&self, draws: &mut Draws, across: impl Fn(&mut Draws, f64) -> f64) -> (i32, DVec2) {
        let (axis, [from, to], number, [t0, t1]) = &self.stretches[draws.below(self.stretches.len())];
        let t = 0.5 * (t0 + t1) + across(draws, 0.5 * (t1 - t0).abs());
        let world = axis.point(draws.between(*from, *to), t);
        let frame = RadarFrame::new(&self.pose).unwrap();
        (*number, frame.radar_m(&place_of(world)).truncate())
    }

    fn local(&self, settings: Settings) -> LocalMap {
        LocalMap::new(&self.map, &self.pose, settings).unwrap()
    }
}

fn exact(position_m: DVec2) -> Target {
    Target::new(position_m, DMat2::ZERO)
}

/// Anywhere in the lane, but not within 2 cm of its lines.
fn anywhere(draws: &mut Draws, half_m: f64) -> f64 {
    draws.between(-half_m + 0.02, half_m - 0.02)
}

/// As drivers do: 0.3 m about the middle, never with a wheel on the line.
fn keeping(draws: &mut Draws, half_m: f64) -> f64 {
    let most_m = (half_m - 0.9).max(0.0);
    (0.3 * draws.normal()).clamp(-most_m, most_m)
}

const SIGMA_M: f64 = 0.3;

/// What a radar says of a place: 0.3 m to the side, 0.15 m ahead.
fn noisy(draws: &mut Draws, p: DVec2) -> Target {
    let error = DVec2::new(0.15 * draws.normal(), SIGMA_M * draws.normal());
    Target::new(p + error, DMat2::from_diagonal(DVec2::new(0.15 * 0.15, SIGMA_M * SIGMA_M)))
}

#[test]
fn without_noise_every_vehicle_is_right() {
    for kind in SceneKind::ALL {
        let road = Road::of(kind, 25.0);
        let local = road.local(Settings::default());
        let mut draws = Draws(11);
        for _ in 0..2000 {
            let (number, p) = road.vehicle(&mut draws, anywhere);
            let place = local.place(&exact(p)).unwrap();
            assert_eq!((place.number, place.fit), (number, Fit::Inside), "{kind:?} {p} {place:?}");
            assert_eq!(place.probability, 1.0);
        }
    }
}

#[test]
fn the_rate_is_the_place_across_the_road() {
    // The largest error of the place across, in metres, where edges are given every 50 m in the curve.
    let road = Road::of(SceneKind::Curve, 50.0);
    let mut worst = [0.0_f64; 4];
    let rules = [
        Settings::default(),
        Settings { edge_rule: EdgeRule::Nearest, ..Settings::default() },
        Settings { across: Across::RadarAxis, ..Settings::default() },
        Settings { edge_rule: EdgeRule::Linear, ..Settings::default() },
    ];
    for (settings, worst) in rules.into_iter().zip(&mut worst) {
        let local = road.local(settings);
        let frame = RadarFrame::new(&road.pose).unwrap();
        let mut draws = Draws(5);
        for _ in 0..1000 {
            let (axis, ..) = &road.stretches[0];
            let (s, share) = (draws.between(20.0, 280.0), draws.between(0.01, 0.99));
            let t = -MEDIAN_M - share * CARRIAGEWAY_M;
            let p = frame.radar_m(&place_of(axis.point(s, t))).truncate();
            let place = local.place(&exact(p)).unwrap();
            *worst = worst.max((place.rate - share).abs() * CARRIAGEWAY_M);
        }
    }
    println!(
        "worst error across: normal {:.4}, three nearest {:.4}, radar axis {:.4}, linear {:.4} m",
        worst[0], worst[1], worst[2], worst[3]
    );
    // Half a chord of 50 m on 515 m: 0.61 m at the linear rule's worst, nothing of that with a parabola.
    assert!(worst[0] < 0.02 && worst[1] < 0.02, "{worst:?}");
    assert!(worst[2] < 0.15, "{worst:?}");
    assert!(worst[3] > 0.55 && worst[3] < 0.66, "{worst:?}");
}

/// Where the measured place lies in the wrong lane, per metre of road across: each line between lanes is
/// crossed either way, and a strip of `keep_m` outside still counts.
fn expected_wrong(widths: &[f64], keep_in_m: f64, keep_out_m: f64) -> f64 {
    // The mean of what a normal error of one carries beyond z.
    let beyond = |m: f64| {
        let z = m / SIGMA_M;
        SIGMA_M * ((-0.5 * z * z).exp() / TAU.sqrt() - z * 0.5 * (1.0 - erf(z / SQRT_2)))
    };
    // Each lane is as likely as any other.
    let mut sum = 0.0;
    for (i, w) in widths.iter().enumerate() {
        let inner = if i == 0 { beyond(keep_in_m) } else { beyond(0.0) };
        let outer = if i + 1 == widths.len() { beyond(keep_out_m) } else { beyond(0.0) };
        sum += (inner + outer) / w;
    }
    sum / widths.len() as f64
}

#[test]
fn with_noise_the_share_of_wrong_lanes_is_that_of_the_normal_law() {
    let road = Road::of(SceneKind::Straight, 50.0);
    for across in [Across::RoadNormal, Across::RadarAxis] {
        let local = road.local(Settings { across, ..Settings::default() });
        let mut draws = Draws(23);
        let n = 20_000;
        let mut wrong = 0;
        for _ in 0..n {
            let (number, p) = road.vehicle(&mut draws, |d, half| d.between(-half, half));
            let seen = local.place(&noisy(&mut draws, p));
            wrong += i32::from(seen.map(|l| l.number) != Ok(number));
        }
        let expected = expected_wrong(&WIDTHS_M, MEDIAN_M, 0.75);
        let share = f64::from(wrong) / f64::from(n);
        // Four standard deviations of a share, and what the heading of 0.03 rad changes.
        let bound = 4.0 * (expected * (1.0 - expected) / f64::from(n)).sqrt() + 0.001;
        println!("wrong anywhere in the lane: {share:.4}, by the normal law {expected:.4} ± {bound:.4}");
        assert!((share - expected).abs() < bound, "{share} {expected} {bound}");
    }
}

#[test]
fn probabilities_are_how_often_the_lane_is_right() {
    // Places even across the road and beyond it: then the probability of a lane is its posterior.
    for kind in [SceneKind::Straight, SceneKind::Curve] {
        let road = Road::of(kind, 25.0);
        let local = road.local(Settings::default());
        let frame = RadarFrame::new(&road.pose).unwrap();
        let mut draws = Draws(31);
        let lines = [1.0, 4.75, 8.5, 12.25, 15.25];
        let (mut hoped, mut spread, mut right) = (0.0, 0.0, 0.0);
        let mut low = [0.0; 3];
        for _ in 0..20_000 {
            let (s, t) = (draws.between(20.0, 280.0), draws.between(-2.0, 18.5));
            let p = frame.radar_m(&place_of(road.stretches[0].0.point(s, -t))).truncate();
            let Ok(place) = local.place(&noisy(&mut draws, p)) else { continue };
            if place.carriageway != 0 {
                continue;
            }
            let number = place.number as usize;
            let hit = f64::from(u8::from(t > lines[number - 1] && t <= lines[number]));
            hoped += place.probability;
            spread += place.probability * (1.0 - place.probability);
            right += hit;
            if place.probability < 0.8 {
                low = [low[0] + place.probability, low[1] + hit, low[2] + 0.25];
            }
            let (_, next) = place.next.unwrap();
            assert!(place.probability + next <= 1.0 + 1e-12);
        }
        println!("right {right} of hoped {hoped:.1} ± {:.1}", spread.sqrt());
        assert!((right - hoped).abs() < 4.0 * spread.sqrt(), "{right} {hoped}");
        // Those that are unsure say so rightly, too.
        assert!(low[2] > 200.0 && (low[1] - low[0]).abs() < 4.0 * f64::sqrt(low[2]), "{low:?}");
    }
}

#[test]
fn accuracy_by_kind_of_scene() {
    for (drivers, most_wrong) in [("keeping their lane", 0.005), ("anywhere in their lane", 0.11)] {
        let mut table = AccuracyTable::default();
        for kind in SceneKind::ALL {
            let road = Road::of(kind, 25.0);
            let local = road.local(Settings::default());
            let mut draws = Draws(47);
            for _ in 0..5000 {
                let place = if most_wrong < 0.01 { keeping } else { anywhere };
                let (number, p) = road.vehicle(&mut draws, place);
                let both = local.assign(&[noisy(&mut draws, p), exact(p)]);
                table.record(kind, number, &both[0], Some(&both[1]));
            }
            let tally = table.tally(kind);
            assert_eq!((tally.counted(), tally.wrong_by(Cause::Method)), (5000, 0));
            assert!(tally.accuracy().unwrap() > 1.0 - most_wrong, "{kind:?} {tally:?}");
            assert_eq!(tally.wrong_by(Cause::Unusable), 0);
        }
        println!("vehicles {drivers}, 0.3 m to the side:\n{table}");
    }
}

#[test]
fn where_the_edges_are_parallel_both_lines_across_agree() {
    // The document's similar triangles.
    let road = Road::of(SceneKind::Straight, 50.0);
    for heading in [-1.0, -0.4, 0.0, 0.3, 1.1] {
        let pose = pose_at(DVec2::new(140.0, -8.0), heading);
        let [normal, axis] = [Across::RoadNormal, Across::RadarAxis].map(|across| {
            LocalMap::new(&road.map, &pose, Settings { across, ..Settings::default() }).unwrap()
        });
        let frame = RadarFrame::new(&pose).unwrap();
        let mut draws = Draws(3);
        for _ in 0..100 {
            let at = DVec2::new(draws.between(60.0, 240.0), draws.between(-15.0, -1.5));
            let p = frame.radar_m(&place_of(at)).truncate();
            let (a, b) = (normal.place(&exact(p)).unwrap(), axis.place(&exact(p)).unwrap());
            assert!((a.rate - b.rate).abs() < 1e-5, "{a:?} {b:?}");
            assert!((b.gap_m * heading.cos() - CARRIAGEWAY_M).abs() < 0.01);
            assert!((a.gap_m - CARRIAGEWAY_M).abs() < 1e-3);
        }
    }
}

#[test]
fn in_a_curve_the_radar_axis_is_off_by_a_closed_form() {
    // t (W - t) tan²θ / 2R, θ between the line across and the radius.
    let radius_m = 120.0;
    let width_m = 12.0;
    let ring = |r: f64| {
        (0..=800)
            .map(|i| {
                let a = -FRAC_PI_2 + 1.3 * f64::from(i) / 800.0;
                place_of(DVec2::new(0.0, radius_m) + r * DVec2::from_angle(a))
            })
            .collect::<Vec<_>>()
    };
    let way = Carriageway {
        name: "bend".to_string(),
        inner_edge: ring(radius_m),
        outer_edge: ring(radius_m + width_m),
        lanes: vec![lane(1, LaneKind::Driving, width_m)],
    };
    let map = HdMap { carriageways: vec![way] };
    let pose = pose_at(DVec2::ZERO, 0.0);
    let frame = RadarFrame::new(&pose).unwrap();
    let settings = Settings { across: Across::RadarAxis, ..Settings::default() };
    let axis = LocalMap::new(&map, &pose, settings).unwrap();
    let normal = LocalMap::new(&map, &pose, Settings::default()).unwrap();
    for (theta, t) in [(0.2, 6.0), (0.5, 3.0), (0.5, 6.0), (0.7, 9.0)] {
        let at = DVec2::new(0.0, radius_m) + (radius_m + t) * DVec2::from_angle(theta - FRAC_PI_2);
        let p = exact(frame.radar_m(&place_of(at)).truncate());
        let off_m = (axis.place(&p).unwrap().rate - normal.place(&p).unwrap().rate) * width_m;
        let expected_m = t * (width_m - t) * f64::tan(theta).powi(2) / (2.0 * radius_m);
        assert!((normal.place(&p).unwrap().rate * width_m - t).abs() < 1e-3);
        assert!((off_m - expected_m).abs() < 0.15 * expected_m, "{theta} {t}: {off_m} {expected_m}");
    }
}

#[test]
fn the_answer_does_not_depend_on_where_the_radar_looks() {
    for kind in SceneKind::ALL {
        let road = Road::of(kind, 10.0);
        let local = road.local(Settings::default());
        let mut draws = Draws(71);
        for _ in 0..200 {
            let (_, p) = road.vehicle(&mut draws, anywhere);
            let spot = RadarFrame::new(&road.pose).unwrap().place(p.extend(-8.0));
            let azimuth_rad = draws.between(-PI, PI);
            let turned = RadarPose { azimuth_rad, ..road.pose };
            let q = RadarFrame::new(&turned).unwrap().radar_m(&spot).truncate();
            let other = LocalMap::new(&road.map, &turned, Settings::default()).unwrap();
            let (a, b) = (local.place(&exact(p)).unwrap(), other.place(&exact(q)).unwrap());
            assert_eq!(a.number, b.number);
            assert!((a.rate - b.rate).abs() < 1e-5, "{a:?} {b:?}");
        }
    }
}

#[test]
fn a_ramp_across_the_radars_axis_needs_the_normal() {
    let road = Road::of(SceneKind::Ramp, 25.0);
    let settings = Settings { across: Across::RadarAxis, ..Settings::default() };
    let [normal, axis] = [Settings::default(), settings].map(|s| road.local(s));
    let (ramp, _, number, _) = road.stretches.last().unwrap();
    let frame = RadarFrame::new(&road.pose).unwrap();
    let (mut right, mut tried) = ([0, 0], 0);
    let mut draws = Draws(9);
    for _ in 0..500 {
        // The last 60 m, at 58 to 85 degrees to the radar's axis.
        let world = ramp.point(draws.between(145.0, 205.0), draws.between(-1.6, 1.6));
        let p = exact(frame.radar_m(&place_of(world)).truncate());
        tried += 1;
        for (count, local) in right.iter_mut().zip([&normal, &axis]) {
            *count += i32::from(local.place(&p).map(|l| l.number) == Ok(*number));
        }
    }
    println!("ramp at 58 to 85 degrees: normal {} of {tried}, radar's axis {}", right[0], right[1]);
    assert_eq!(right[0], tried);
    assert!(right[1] < tried);
}

/// A carriageway of lanes 1 to 4 along x, inner edge at y = 0, for limits.
fn plain(strips: bool) -> (HdMap, RadarPose) {
    let mut lanes: Vec<Lane> = WIDTHS_M
        .into_iter()
        .zip(1..)
        .map(|(w, n)| lane(n, if n == 4 { LaneKind::Emergency } else { LaneKind::Driving }, w))
        .collect();
    if strips {
        lanes.insert(0, lane(0, LaneKind::Median, 1.0));
        lanes.push(lane(9, LaneKind::Shoulder, 0.5));
    }
    let edge = |y: f64| vec![place_of(DVec2::new(0.0, y)), place_of(DVec2::new(200.0, y))];
    let way = Carriageway {
        name: "plain".to_string(),
        inner_edge: edge(0.0),
        outer_edge: edge(-CARRIAGEWAY_M),
        lanes,
    };
    (HdMap { carriageways: vec![way] }, pose_at(DVec2::ZERO, 0.0))
}

#[test]
fn lanes_by_cumulated_widths_and_limits() {
    let (map, pose) = plain(true);
    let local = LocalMap::new(&map, &pose, Settings::default()).unwrap();
    let at = |t: f64| local.place(&exact(DVec2::new(80.0, -t)));
    // Just inside each line.
    for (t, number) in
        [(0.001, 1), (3.749, 1), (3.751, 2), (7.499, 2), (7.501, 3), (11.249, 3), (11.251, 4), (14.249, 4)]
    {
        let place = at(t).unwrap();
        assert_eq!((place.number, place.fit), (number, Fit::Inside));
        assert!((place.rate - t / CARRIAGEWAY_M).abs() < 1e-5);
        assert!((place.station_m - 80.0).abs() < 1e-3);
    }
    // Taken in from the strips, with no chance to be there when the place is exact.
    for (t, number, fit) in [(-0.5, 1, Fit::FromMedian), (14.7, 4, Fit::FromShoulder)] {
        let place = at(t).unwrap();
        assert_eq!((place.number, place.fit, place.probability), (number, fit, 0.0));
    }
    let Err(Dropped::Median { beyond_m }) = at(-1.2) else { panic!("{:?}", at(-1.2)) };
    assert!((beyond_m - 1.2).abs() < 1e-3);
    let Err(Dropped::Roadside { beyond_m }) = at(15.0) else { panic!("{:?}", at(15.0)) };
    assert!((beyond_m - 0.75).abs() < 1e-3);
    // Limits of one's own, as shares of the width.
    let own = Settings { alpha: Some(0.1), beta: Some(0.0), ..Settings::default() };
    let local = LocalMap::new(&map, &pose, own).unwrap();
    assert_eq!(local.place(&exact(DVec2::new(80.0, 1.4))).map(|l| l.number), Ok(1));
    assert!(local.place(&exact(DVec2::new(80.0, 1.5))).is_err());
    assert!(local.place(&exact(DVec2::new(80.0, -14.3))).is_err());
    // A map without strips takes in nothing.
    let (bare, _) = plain(false);
    let found = assign(&bare, &pose, &[exact(DVec2::new(80.0, 0.01)), exact(DVec2::new(80.0, -0.01))]);
    assert!(matches!(found[0].lane, Err(Dropped::Median { .. })));
    assert_eq!(found[1].number(), Some(1));
    assert_eq!(found[1].target, 1);
}

#[test]
fn on_a_line_the_rate_decides_for_the_outer_lane() {
    // Edges exactly at 0 and -16, four lanes of 4 m, in the radar's own axes.
    let edge = |y: f64| Edge::new([DVec2::new(0.0, y), DVec2::new(100.0, y)].into_iter()).unwrap();
    let lanes = (1..=4).map(|n| lane(n, LaneKind::Driving, 4.0)).collect();
    let way = Carriageway { name: String::new(), inner_edge: vec![], outer_edge: vec![], lanes };
    let local = LocalMap {
        map: HdMap { carriageways: vec![way] },
        settings: Settings::default(),
        edges: vec![[edge(0.0), edge(-16.0)]],
    };
    for (t, number) in [(0.0, 1), (4.0, 2), (8.0, 3), (12.0, 4), (16.0, 4)] {
        assert_eq!(local.place(&exact(DVec2::new(50.0, -t))).map(|l| l.number), Ok(number));
    }
    // On the line with an error the two lanes are even; in the middle two sigma hold 95.45 %.
    let seen = |t: f64, std_m: f64| {
        let target = Target::new(DVec2::new(50.0, -t), DMat2::from_diagonal(DVec2::new(9.0, std_m * std_m)));
        local.place(&target).unwrap()
    };
    let place = seen(4.0, 0.3);
    assert!((place.probability - 0.5).abs() < 1e-12);
    assert!((place.next.unwrap().1 - 0.5).abs() < 1e-12 && place.next.unwrap().0 == 1);
    assert!((seen(6.0, 1.0).probability - 0.954_499_736_103_642).abs() < 1e-12);
    assert!((seen(6.0, 1.0).across_std_m - 1.0).abs() < 1e-12);
    // An error ahead is none across a road that runs ahead, and the map's own error adds.
    let sure = LocalMap { settings: Settings { map_std_m: 0.4, ..Settings::default() }, ..local.clone() };
    let target = Target::new(DVec2::new(50.0, -6.0), DMat2::from_diagonal(DVec2::new(9.0, 0.09)));
    assert!((sure.place(&target).unwrap().across_std_m - 0.5).abs() < 1e-12);
}

#[test]
fn the_outer_edge_is_the_one_across_from_the_inner() {
    // The outer edge turns and comes back on the other side, nearer to the target than its own piece.
    let line = |points: &[[f64; 2]]| Edge::new(points.iter().map(|p| DVec2::from_array(*p))).unwrap();
    let outer = line(&[[0.0, -10.0], [100.0, -10.0], [120.0, 0.0], [100.0, 10.5], [0.0, 10.5]]);
    let lanes = vec![lane(1, LaneKind::Driving, 10.0)];
    let way = Carriageway { name: String::new(), inner_edge: vec![], outer_edge: vec![], lanes };
    let local = LocalMap {
        map: HdMap { carriageways: vec![way] },
        settings: Settings { alpha: Some(0.1), ..Settings::default() },
        edges: vec![[line(&[[0.0, 0.0], [100.0, 0.0]]), outer]],
    };
    let place = local.place(&exact(DVec2::new(50.0, 0.9))).unwrap();
    assert_eq!(place.fit, Fit::FromMedian);
    assert!((place.rate + 0.09).abs() < 1e-12 && (place.gap_m - 10.0).abs() < 1e-12);
}

#[test]
fn an_error_ahead_counts_where_the_road_runs_aside() {
    let dir = DVec2::from_angle(0.6);
    let edge = |t: f64| {
        Edge::new([-50.0, 150.0].into_iter().map(|s| DVec2::new(0.0, -10.0) + dir * s - dir.perp() * t))
            .unwrap()
    };
    let lanes = vec![lane(1, LaneKind::Driving, 5.0), lane(2, LaneKind::Driving, 5.0)];
    let way = Carriageway { name: String::new(), inner_edge: vec![], outer_edge: vec![], lanes };
    let local = |across| LocalMap {
        map: HdMap { carriageways: vec![way.clone()] },
        settings: Settings { across, ..Settings::default() },
        edges: vec![[edge(0.0), edge(10.0)]],
    };
    let p = DVec2::new(0.0, -10.0) + dir * 40.0 - dir.perp() * 4.0;
    let target = Target::new(p, DMat2::from_cols_array(&[0.25, 0.05, 0.05, 0.09]));
    let [a, b] = [Across::RoadNormal, Across::RadarAxis].map(|c| local(c).place(&target).unwrap());
    let across = dir.perp();
    let std_m = across.dot(target.covariance_m2 * across).sqrt();
    assert!((a.across_std_m - std_m).abs() < 1e-12);
    assert!((b.across_std_m - std_m / 0.6_f64.cos()).abs() < 1e-12);
    // Both lines give one answer: rate and probability.
    assert!((a.rate - 0.4).abs() < 1e-12 && (b.rate - 0.4).abs() < 1e-12);
    assert!((a.probability - b.probability).abs() < 1e-12);
}

#[test]
fn polar_errors_turn_with_the_azimuth() {
    let t = Target::polar(100.0, FRAC_PI_2, 0.2, 0.003);
    assert!(t.position_m.abs_diff_eq(DVec2::new(0.0, 100.0), 1e-12));
    let [xx, xy, _, yy] = t.covariance_m2.to_cols_array();
    assert!((xx - 0.09).abs() < 1e-12 && xy.abs() < 1e-12 && (yy - 0.04).abs() < 1e-12);
    assert_eq!(Target::polar(80.0, 0.4, 0.2, 0.003).check(), Ok(()));
    assert_eq!(Target::polar(80.0, 0.4, 0.2, 0.0).check(), Ok(()));
}

#[test]
fn bays_and_exits_are_lanes_where_they_have_a_width() {
    let road = Road::of(SceneKind::EmergencyBay, 50.0);
    let local = road.local(Settings::default());
    let frame = RadarFrame::new(&road.pose).unwrap();
    let at = |s: f64, t: f64| local.place(&exact(frame.radar_m(&place_of(DVec2::new(s, -t))).truncate()));
    // Beside the emergency lane: roadside, then the bay, then roadside again.
    assert!(matches!(at(120.0, 17.0), Err(Dropped::Roadside { .. })));
    assert_eq!(at(180.0, 17.0).map(|l| (l.number, l.kind)), Ok((5, LaneKind::Bay)));
    assert!(matches!(at(260.0, 17.0), Err(Dropped::Roadside { .. })));
    // Half open in the taper; the lanes inside keep their widths there.
    assert_eq!(at(157.5, 16.9).map(|l| l.number), Ok(5));
    assert_eq!(at(157.5, 15.2).map(|l| l.number), Ok(4));
    assert_eq!(at(180.0, 12.3).map(|l| l.number), Ok(4));
    // The shoulder belongs to the emergency lane, and beside the bay to the bay.
    assert_eq!(at(120.0, 15.8).map(|l| (l.number, l.fit)), Ok((4, Fit::FromShoulder)));
    assert_eq!(at(180.0, 19.3).map(|l| (l.number, l.fit)), Ok((5, Fit::FromShoulder)));
    // On the other carriageway lanes are counted from the inside out as well.
    assert_eq!([-2.0, -6.0, -10.0, -14.0].map(|t| at(180.0, t).unwrap().number), [11, 12, 13, 14]);
    assert_eq!([2.0, 6.0, 10.0, 14.0].map(|t| at(180.0, t).unwrap().number), [1, 2, 3, 4]);
    // Median strips belong to the first lane on their side.
    assert_eq!([0.5, -0.5].map(|t| at(100.0, t).unwrap().number), [1, 11]);
}

#[test]
fn nothing_is_carried_on_beyond_the_map() {
    let (map, pose) = plain(true);
    let found = assign(&map, &pose, &[-0.1, 0.1, 199.9, 200.1, 1e4].map(|x| exact(DVec2::new(x, -5.0))));
    assert_eq!([0, 1, 2, 3, 4].map(|i| found[i].number()), [None, Some(2), Some(2), None, None]);
    assert_eq!(found[4].lane, Err(Dropped::BeyondMap));
    // The shorter of the two edges decides.
    let mut short = map;
    short.carriageways[0].outer_edge[1] = place_of(DVec2::new(120.0, -CARRIAGEWAY_M));
    let found = assign(&short, &pose, &[119.0, 121.0].map(|x| exact(DVec2::new(x, -5.0))));
    assert_eq!([0, 1].map(|i| found[i].number()), [Some(2), None]);
}

#[test]
fn edges_that_contradict_the_widths_are_refused() {
    // The outer edge goes round the bay, and no lane stands for it.
    let mut road = Road::of(SceneKind::EmergencyBay, 50.0);
    road.map.carriageways[0].lanes.retain(|l| l.kind != LaneKind::Bay);
    let frame = RadarFrame::new(&road.pose).unwrap();
    let at = |settings, s: f64| {
        road.local(settings).place(&exact(frame.radar_m(&place_of(DVec2::new(s, -7.0))).truncate()))
    };
    let Err(Dropped::Mismatch { gap_m, lanes_m }) = at(Settings::default(), 180.0) else { panic!() };
    assert!((gap_m - 17.75).abs() < 0.01 && lanes_m == CARRIAGEWAY_M);
    assert_eq!(at(Settings::default(), 100.0).map(|l| l.number), Ok(2));
    // Unless that much is allowed: then the lanes are stretched to fill the space.
    let wide = Settings { width_tolerance: 0.3, ..Settings::default() };
    assert_eq!(at(wide, 180.0).map(|l| l.number), Ok(2));
    // A loop whose outer edge ends early: across the loop there is another piece of it.
    let ring = |r: f64, turn: f64| {
        let point = |i| place_of(DVec2::new(100.0, 0.0) + r * DVec2::from_angle(turn * f64::from(i) / 40.0));
        (0..=40).map(point).collect::<Vec<_>>()
    };
    let way = Carriageway {
        name: "loop".to_string(),
        inner_edge: ring(40.0, 4.7),
        outer_edge: ring(44.0, 4.0),
        lanes: vec![lane(21, LaneKind::Ramp, 4.0)],
    };
    let map = HdMap { carriageways: vec![way] };
    let frame = RadarFrame::new(&road.pose).unwrap();
    for (angle, right) in [(0.3, true), (2.0, true), (3.9, true), (4.3, false)] {
        let world = DVec2::new(100.0, 0.0) + 42.0 * DVec2::from_angle(angle);
        let found = assign(&map, &road.pose, &[exact(frame.radar_m(&place_of(world)).truncate())]);
        assert_eq!(found[0].number() == Some(21), right, "{angle} {found:?}");
    }
}

#[test]
fn roads_that_cross_are_marked() {
    let (mut map, pose) = plain(true);
    let edge = |x: f64| vec![place_of(DVec2::new(x, -100.0)), place_of(DVec2::new(x, 100.0))];
    map.carriageways.push(Carriageway {
        name: "bridge".to_string(),
        inner_edge: edge(100.0),
        outer_edge: edge(104.0),
        lanes: vec![lane(31, LaneKind::Driving, 4.0)],
    });
    let found = assign(&map, &pose, &[102.0, 110.0].map(|x| exact(DVec2::new(x, -5.0))));
    assert!(found[0].lane.as_ref().unwrap().overlap);
    assert!(!found[1].lane.as_ref().unwrap().overlap);
}

#[test]
fn hostile_input_has_a_reason() {
    let (map, pose) = plain(true);
    assert!(assign(&map, &pose, &[]).is_empty());
    let p = DVec2::new(80.0, -5.0);
    let dropped = |t: Target| assign(&map, &pose, &[t]).remove(0).lane.unwrap_err();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(dropped(exact(DVec2::new(bad, 0.0))), Dropped::NotFinite);
        assert_eq!(dropped(exact(DVec2::new(1.0, bad))), Dropped::NotFinite);
        assert_eq!(dropped(Target::new(p, DMat2::from_diagonal(DVec2::splat(bad)))), Dropped::NotFinite);
        let odd = RadarPose { azimuth_rad: bad, ..pose };
        assert_eq!(
            assign(&map, &odd, &[exact(p)])[0].lane,
            Err(Dropped::Map(LaneError::refused("the radar's pose is not finite or not near the earth")))
        );
        for (name, settings) in [
            ("alpha", Settings { alpha: Some(bad), ..Settings::default() }),
            ("beta", Settings { beta: Some(-1.0), ..Settings::default() }),
            ("width_tolerance", Settings { width_tolerance: bad, ..Settings::default() }),
            ("map_std_m", Settings { map_std_m: bad, ..Settings::default() }),
            ("dense_sagitta_m", Settings { dense_sagitta_m: bad, ..Settings::default() }),
        ] {
            assert_eq!(LocalMap::new(&map, &pose, settings), Err(LaneError::Setting { name }));
        }
    }
    for c in [[-1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0], [1.0, 2.0, 2.0, 1.0], [1.0, 0.5, 0.0, 1.0]] {
        assert_eq!(dropped(Target::new(p, DMat2::from_cols_array(&c))), Dropped::BadCovariance);
    }
    for far in [1e9, -1e9, 1e160, f64::MAX] {
        assert!(
            assign(&map, &pose, &[exact(DVec2::new(far, 0.0)), exact(DVec2::new(0.0, far))])
                .iter()
                .all(|a| a.lane.is_err())
        );
    }
    assert!(assign(&map, &pose, &[Target::new(p, DMat2::from_diagonal(DVec2::splat(1e308)))]).len() == 1);
    // Maps that hold nothing, an edge of one point (given twice), edges that meet.
    let with = |change: &dyn Fn(&mut Carriageway)| {
        let mut map = map.clone();
        change(&mut map.carriageways[0]);
        assign(&map, &pose, &[exact(p)]).remove(0).lane.unwrap_err()
    };
    assert_eq!(
        assign(&HdMap::default(), &pose, &[exact(p)])[0].lane,
        Err(Dropped::Map(LaneError::refused("the map contains no carriageway")))
    );
    let short =
        Dropped::Map(LaneError::refused("an edge of carriageway `plain` has fewer than two distinct points"));
    assert_eq!(with(&|w| w.inner_edge.truncate(1)), short);
    assert_eq!(with(&|w| w.outer_edge.clear()), short);
    assert_eq!(with(&|w| w.outer_edge[1] = w.outer_edge[0]), short);
    assert_eq!(with(&|w| w.outer_edge = w.inner_edge.clone()), Dropped::NoRoom);
    // Each reason is one sentence.
    for why in [short, Dropped::NoRoom, Dropped::BeyondMap, Dropped::Roadside { beyond_m: 1.0 }] {
        assert!(!why.to_string().contains('\n') && why.to_string().len() > 20);
    }
}

#[test]
fn whatever_the_map_looks_like_the_answer_is_in_bounds() {
    let mut draws = Draws(101);
    let mut lanes_found = 0;
    for _ in 0..300 {
        let line = |draws: &mut Draws| -> Vec<Wgs84> {
            let mut p = DVec2::new(draws.between(-50.0, 50.0), draws.between(-20.0, 20.0));
            (0..2 + draws.below(8))
                .map(|_| {
                    p += DVec2::new(draws.between(-10.0, 60.0), draws.between(-25.0, 25.0));
                    place_of(p)
                })
                .collect()
        };
        let lanes = (0..1 + draws.below(4))
            .map(|n| {
                let width_m = match draws.below(2) {
                    0 => Width::Constant(draws.between(0.5, 5.0)),
                    _ => Width::Along(vec![[draws.between(0.0, 90.0), 0.0], [90.0, draws.between(1.0, 4.0)]]),
                };
                Lane { number: n as i32, kind: LaneKind::Driving, width_m }
            })
            .collect();
        let way = Carriageway {
            name: String::new(),
            inner_edge: line(&mut draws),
            outer_edge: line(&mut draws),
            lanes,
        };
        let map = HdMap { carriageways: vec![way] };
        for across in [Across::RoadNormal, Across::RadarAxis] {
            for edge_rule in [EdgeRule::Linear, EdgeRule::Nearest, EdgeRule::Guarded] {
                // Such edges seldom agree with the widths.
                let settings = Settings {
                    across,
                    edge_rule,
                    alpha: Some(0.1),
                    beta: Some(0.2),
                    width_tolerance: 1e6,
                    ..Settings::default()
                };
                let local = LocalMap::new(&map, &pose_at(DVec2::ZERO, 0.2), settings).unwrap();
                for _ in 0..20 {
                    let std_m = draws.between(0.0, 3.0);
                    let p = DVec2::new(draws.between(-50.0, 300.0), draws.between(-60.0, 60.0));
                    let target = Target::new(p, DMat2::from_diagonal(DVec2::splat(std_m * std_m)));
                    let Ok(place) = local.place(&target) else { continue };
                    lanes_found += 1;
                    assert!((-0.1..=1.2).contains(&place.rate), "{place:?}");
                    assert!((0.0..=1.0).contains(&place.probability), "{place:?}");
                    assert!(place.gap_m.is_finite() && place.station_m.is_finite());
                    assert_eq!(local.place(&target), Ok(place));
                }
            }
        }
    }
    assert!(lanes_found > 1000, "{lanes_found}");
}

#[test]
#[ignore = "prints how the accuracy falls with the noise"]
fn accuracy_against_noise() {
    for kind in SceneKind::ALL {
        let road = Road::of(kind, 25.0);
        let local = road.local(Settings::default());
        for std_m in [0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5] {
            let mut right = [0; 2];
            let mut draws = Draws(7);
            for _ in 0..5000 {
                for (right, most) in right.iter_mut().zip([keeping, anywhere as fn(&mut Draws, f64) -> f64]) {
                    let (number, p) = road.vehicle(&mut draws, most);
                    let seen = exact(p + DVec2::new(0.0, std_m * draws.normal()));
                    *right += i32::from(local.place(&seen).map(|l| l.number) == Ok(number));
                }
            }
            let share = right.map(|r| f64::from(r) / 50.0);
            println!("{}: {std_m} m: keeping {:.2} %, anywhere {:.2} %", kind.name(), share[0], share[1]);
        }
    }
}

#[test]
#[ignore = "prints times"]
fn times() {
    for kind in SceneKind::ALL {
        let road = Road::of(kind, 25.0);
        let mut draws = Draws(1);
        let targets: Vec<Target> = (0..30)
            .map(|_| {
                let (_, p) = road.vehicle(&mut draws, keeping);
                noisy(&mut draws, p)
            })
            .collect();
        let points: usize =
            road.map.carriageways.iter().map(|w| w.inner_edge.len() + w.outer_edge.len()).sum();
        let local = road.local(Settings::default());
        let n = 2000;
        let clock = std::time::Instant::now();
        for _ in 0..n {
            std::hint::black_box(assign(std::hint::black_box(&road.map), &road.pose, &targets));
        }
        let whole = clock.elapsed() / n;
        let clock = std::time::Instant::now();
        for _ in 0..n {
            std::hint::black_box(std::hint::black_box(&local).assign(&targets));
        }
        println!(
            "{}: {points} points, 30 targets: assign {whole:?}, LocalMap::assign {:?}",
            kind.name(),
            clock.elapsed() / n
        );
    }
    let frame = RadarFrame::new(&WORLD).unwrap();
    assert!(frame.radar_m(&WORLD.position).abs_diff_eq(DVec3::ZERO, 1e-9));
}
