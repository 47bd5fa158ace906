use super::*;
use catseye::base::rng::Draws;
use glam::DVec2;

#[derive(Clone, Copy, Debug)]
struct Truth {
    offset: f64,
    heading: f64,
    curvature: f64,
    start: f64,
    speed: f64,
}

const STRAIGHT: Truth = Truth { offset: 0.0, heading: 0.0, curvature: 0.0, start: 10.0, speed: 10.0 };

struct Noise {
    scale: f64,
    missing: f64,
    extra: f64,
}

const PERFECT: Noise = Noise { scale: 0.0, missing: 0.0, extra: 0.0 };
const REAL: Noise = Noise { scale: 1.0, missing: 0.1, extra: 0.1 };

/// The road walked in steps of a centimetre: another way to the same cells.
fn cells(t: &Truth, s: &LaneSettings, noise: &Noise, seed: u32) -> Vec<Cell> {
    let mut d = Draws::new(seed, 7);
    let (range_std_m, range_rate_std_mps) = (0.1, 0.045);
    let mut out = Vec::new();
    let phase = [d.uniform() * s.left_spacing_m, d.uniform() * s.right_spacing_m];
    for (row, spacing) in [(0, s.left_spacing_m), (1, s.right_spacing_m)] {
        let side = if row == 0 { 0.5 } else { -0.5 } * s.lane_width_m;
        let (mut place, mut along) = (DVec2::ZERO, 0.0f64);
        let mut next = phase[row] - spacing * (s.far_m / spacing).ceil();
        // Behind the radar the road is straight.
        let step = 0.01;
        let mut u = 0.0;
        while next < 0.0 {
            let p = DVec2::new(next, side);
            push(&mut out, t, s, p, noise, &mut d);
            next += spacing;
        }
        while u < 4.0 * s.far_m && along.abs() < s.max_turn_rad {
            if u >= next {
                let p =
                    place + (next - u) * DVec2::from_angle(along) + side * DVec2::from_angle(along).perp();
                push(&mut out, t, s, p, noise, &mut d);
                next += spacing;
            }
            let bend = if u >= t.start { t.curvature * step } else { 0.0 };
            place += step * DVec2::from_angle(along + 0.5 * bend);
            along += bend;
            u += step;
        }
    }
    let extra = (noise.extra * out.len() as f64).round() as usize;
    for _ in 0..extra {
        out.push(Cell {
            range_m: s.near_m + d.uniform() * (s.far_m - s.near_m),
            range_rate_mps: -t.speed * (1.0 - 0.5 * d.uniform()),
            range_std_m,
            range_rate_std_mps,
        });
    }
    out
}

fn push(out: &mut Vec<Cell>, t: &Truth, s: &LaneSettings, p: DVec2, noise: &Noise, d: &mut Draws) {
    let (dx, dy) = (p.x, p.y - t.offset);
    let range = (dx * dx + dy * dy + s.radar_height_m.powi(2)).sqrt();
    let rate = -t.speed * (dx * t.heading.cos() + dy * t.heading.sin()) / range;
    let draws = [d.uniform(), d.normal(), d.normal()];
    let ahead = dx * t.heading.cos() + dy * t.heading.sin();
    if range < s.near_m || range > s.far_m || ahead < 0.0 || draws[0] < noise.missing {
        return;
    }
    out.push(Cell {
        range_m: range + 0.1 * noise.scale * draws[1],
        range_rate_mps: rate + 0.045 * noise.scale * draws[2],
        range_std_m: 0.1,
        range_rate_std_mps: 0.045,
    });
}

const KNOWN: Speed = Speed::Known { mps: 10.0, std_mps: 0.02 };

#[test]
#[ignore = "prints the figures of the notes"]
fn figures() {
    let s = LaneSettings::default();
    type Make = Box<dyn Fn(u32, &mut Draws) -> Truth>;
    let runs: Vec<(&str, Make)> = vec![
        (
            "straight, offset -1.5..1.5",
            Box::new(|_, d| Truth { offset: 3.0 * d.uniform() - 1.5, ..STRAIGHT }),
        ),
        (
            "straight, offset, heading 0..60",
            Box::new(|_, d| Truth {
                offset: 3.0 * d.uniform() - 1.5,
                heading: (60.0 * d.uniform()).to_radians(),
                ..STRAIGHT
            }),
        ),
        (
            "bend 5..500 m, start 5..20, offset, heading +-5",
            Box::new(|i, d| Truth {
                offset: 2.0 * d.uniform() - 1.0,
                heading: (10.0 * d.uniform() - 5.0).to_radians(),
                curvature: if i % 2 == 0 { 1.0 } else { -1.0 } / (5.0 * 100f64.powf(d.uniform())),
                start: 5.0 + 15.0 * d.uniform(),
                ..STRAIGHT
            }),
        ),
    ];
    let from = std::env::var("FROM").map_or(0, |v| v.parse().unwrap());
    for (name, make) in &runs[from..] {
        for (noise_name, noise) in [("perfect", PERFECT), ("noisy", REAL)] {
            for speed in [KNOWN, Speed::FromMap] {
                for equal in [false, true] {
                    let s = if equal { LaneSettings { right_spacing_m: 1.5, ..s } } else { s };
                    let mut d = Draws::new(1, 1);
                    let (mut e2, mut nees, mut n, mut refused, mut known, mut wrong, mut gross) =
                        ([0.0; 4], [0.0; 3], 0.0, 0, 0, 0, 0);
                    let (mut radius, mut radii, mut time) = (0.0, 0.0, 0.0f64);
                    for i in 0..24 {
                        let t = make(i, &mut d);
                        let c = cells(&t, &s, &noise, i);
                        let clock = std::time::Instant::now();
                        let r = lane_from_map(&c, speed, &s);
                        time = time.max(clock.elapsed().as_secs_f64());
                        let Ok(r) = r else {
                            refused += 1;
                            continue;
                        };
                        if r.sign == Sign::Known {
                            known += 1;
                        }
                        let est = [r.offset_m, r.heading_rad, r.curvature_per_m];
                        let tru = [t.offset, t.heading, t.curvature];
                        let err =
                            |f: f64| -> Vec<f64> { (0..3).map(|k| est[k].value - f * tru[k]).collect() };
                        let sum = |e: &[f64]| (0..3).map(|k| (e[k] / est[k].std).powi(2)).sum::<f64>();
                        let (a, b) = (err(1.0), err(-1.0));
                        let is_flip = sum(&b) < sum(&a);
                        if is_flip && r.sign == Sign::Known {
                            wrong += 1;
                        }
                        let e = if is_flip && (equal || r.sign == Sign::Unknown) { b } else { a };
                        if sum(&e) > 40.0 {
                            gross += 1;
                            if std::env::var("SHOW").is_ok() {
                                println!(
                                    "   {i} {t:?} -> {est:?} start {:?} other {:?} {:?} odds {}",
                                    r.curve_start_m, r.other, r.sign, r.sign_log_odds
                                );
                            }
                            continue;
                        }
                        n += 1.0;
                        for k in 0..3 {
                            e2[k] += e[k] * e[k];
                            nees[k] += (e[k] / est[k].std).powi(2);
                        }
                        e2[3] += (r.speed_mps.value - t.speed).powi(2);
                        if let Some([m, ..]) = r.radius_m() {
                            radii += 1.0;
                            radius += (m * t.curvature.abs() - 1.0).abs();
                        }
                    }
                    let rms = e2.map(|x| (x / n).sqrt());
                    println!(
                        "{name} | {noise_name} | {} | {} | \
                         offset {:.3} m heading {:.3} deg curv {:.5} v {:.4} | nees {:.2} {:.2} {:.2} | \
                         radius {radii} rel {:.3} | refused {refused} gross {gross} known {known} wrong {wrong} | \
                         worst {:.0} ms",
                        if speed == KNOWN { "v known" } else { "v map" },
                        if equal { "equal" } else { "unequal" },
                        rms[0],
                        rms[1].to_degrees(),
                        rms[2],
                        rms[3],
                        nees[0] / n,
                        nees[1] / n,
                        nees[2] / n,
                        radius / radii,
                        1e3 * time
                    );
                }
            }
        }
    }
}

/// Least of the two distances to the truth and to its mirror image, in standard deviations.
fn sigmas(r: &LaneFromMap, t: &Truth, mirror: bool) -> f64 {
    let f = if mirror { -1.0 } else { 1.0 };
    [(r.offset_m, t.offset), (r.heading_rad, t.heading), (r.curvature_per_m, t.curvature)]
        .iter()
        .map(|(e, v)| ((e.value - f * v) / e.std).abs())
        .fold(0.0, f64::max)
}

#[test]
fn exact_cells_give_the_lane_back() {
    let s = LaneSettings::default();
    for (offset, degrees, curvature) in
        [(1.5, 0.0, 0.0), (-1.0, 30.0, 0.0), (0.4, 60.0, 0.0), (0.5, -3.0, 1.0 / 15.0), (-0.5, 0.0, -0.005)]
    {
        let t = Truth { offset, heading: f64::to_radians(degrees), curvature, ..STRAIGHT };
        let r = lane_from_map(&cells(&t, &s, &PERFECT, 3), KNOWN, &s).unwrap();
        assert_eq!(r.sign, Sign::Known, "{t:?}");
        assert!((r.offset_m.value - offset).abs() < 0.02, "{t:?} {r:?}");
        assert!((r.heading_rad.value - t.heading).abs() < 0.005, "{t:?} {r:?}");
        assert!((r.curvature_per_m.value - curvature).abs() < 0.002, "{t:?} {r:?}");
    }
}

#[test]
fn errors_keep_to_their_standard_deviations() {
    let s = LaneSettings::default();
    let mut d = Draws::new(2, 1);
    let (mut chi2, mut n) = (0.0, 0.0);
    for i in 0..12 {
        let t =
            Truth { offset: 3.0 * d.uniform() - 1.5, heading: (60.0 * d.uniform()).to_radians(), ..STRAIGHT };
        let r = lane_from_map(&cells(&t, &s, &REAL, 100 + i), KNOWN, &s).unwrap();
        assert!(sigmas(&r, &t, false) < 4.5, "{t:?} {r:?}");
        chi2 += ((r.offset_m.value - t.offset) / r.offset_m.std).powi(2);
        chi2 += ((r.heading_rad.value - t.heading) / r.heading_rad.std).powi(2);
        n += 2.0;
        assert!(r.offset_m.std < 0.06 && r.heading_rad.std < 0.02);
    }
    // Correlated pairs: a mean of 12 of them, 1 ± 4·sqrt(2 / 12) at most.
    assert!(chi2 / n > 0.1 && chi2 / n < 2.7, "{}", chi2 / n);
}

#[test]
fn equal_spacings_give_sizes_only() {
    let s = LaneSettings { right_spacing_m: 1.5, ..LaneSettings::default() };
    let t = Truth { offset: -0.8, heading: 0.2, ..STRAIGHT };
    let r = lane_from_map(&cells(&t, &s, &REAL, 5), KNOWN, &s).unwrap();
    assert_eq!((r.sign, r.sign_log_odds), (Sign::Unknown, 0.0));
    assert!(r.offset_m.value > 0.0 && r.heading_rad.value < 0.0);
    assert!(sigmas(&r, &t, true) < 4.5, "{r:?}");
    // The map of the mirrored lane is the same map: the same answer to the bit.
    let m = Truth { offset: 0.8, heading: -0.2, ..STRAIGHT };
    let mut a = cells(&t, &s, &PERFECT, 5);
    a.reverse();
    assert_eq!(lane_from_map(&a, KNOWN, &s), lane_from_map(&cells(&t, &s, &PERFECT, 5), KNOWN, &s));
    let r = lane_from_map(&cells(&m, &s, &REAL, 5), KNOWN, &s).unwrap();
    assert!(sigmas(&r, &m, false) < 4.5, "{r:?}");
}

#[test]
fn unequal_spacings_tell_the_side() {
    let s = LaneSettings::default();
    for offset in [-0.6, 0.6] {
        let t = Truth { offset, ..STRAIGHT };
        let r = lane_from_map(&cells(&t, &s, &REAL, 8), KNOWN, &s).unwrap();
        assert_eq!(r.sign, Sign::Known);
        assert!(sigmas(&r, &t, false) < 4.5, "{r:?}");
    }
}

#[test]
fn the_speed_comes_from_the_map() {
    let s = LaneSettings::default();
    let t = Truth { offset: 0.5, heading: 0.5, speed: 13.0, ..STRAIGHT };
    let c = cells(&t, &s, &REAL, 4);
    let edge = speed_from_edge(&c).unwrap().value;
    assert!(edge > 0.9 * 13.0 && edge < 1.02 * 13.0, "{edge}");
    let r = lane_from_map(&c, Speed::FromMap, &s).unwrap();
    assert!((r.speed_mps.value - 13.0).abs() < 4.5 * r.speed_mps.std, "{r:?}");
    assert!(r.speed_mps.std < 0.1 && sigmas(&r, &t, false) < 4.5, "{r:?}");
}

#[test]
fn a_sharp_bend_ahead_gives_its_radius() {
    let s = LaneSettings::default();
    for (radius, start) in [(8.0, 12.0), (-30.0, 6.0)] {
        let t = Truth { offset: 0.3, curvature: 1.0 / radius, start, ..STRAIGHT };
        let r = lane_from_map(&cells(&t, &s, &REAL, 6), KNOWN, &s).unwrap();
        let [m, low, high] = r.radius_m().unwrap();
        assert!((m - f64::abs(radius)).abs() < 0.1 * f64::abs(radius), "{r:?}");
        assert!(low < m && m < high);
        assert!((r.curve_start_m.value - start).abs() < 1.0 && r.curve_start_m.observed, "{r:?}");
    }
}

#[test]
fn what_is_not_observable_is_said() {
    let s = LaneSettings::default();
    let straight = lane_from_map(&cells(&STRAIGHT, &s, &REAL, 9), KNOWN, &s).unwrap();
    assert!(!straight.curve_start_m.observed && straight.radius_m().is_none(), "{straight:?}");
    assert!(straight.offset_m.observed && straight.heading_rad.observed);
    // Rows seen far ahead only: their angles to the motion are as small as the rates' errors.
    let far = LaneSettings { near_m: 30.0, far_m: 60.0, ..s };
    let slow = Truth { speed: 3.0, offset: 0.7, ..STRAIGHT };
    let known = Speed::Known { mps: 3.0, std_mps: 0.1 };
    let r = lane_from_map(&cells(&slow, &far, &REAL, 9), known, &far).unwrap();
    assert!(!r.offset_m.observed, "{r:?}");
    assert!(r.sign == Sign::Unknown || sigmas(&r, &slow, false) < 5.0, "{r:?}");
}

#[test]
fn arcs_show_every_marker_in_view() {
    let mut d = Draws::new(12, 3);
    for i in 0..400 {
        let along = if i % 2 == 0 { Along::Middle } else { Along::Row };
        let s = LaneSettings { along, far_m: 15.0 + 30.0 * d.uniform(), ..LaneSettings::default() };
        let side = if d.uniform() < 0.5 { 1.0 } else { -1.0 };
        let curvature = side / (5.0 * 40f64.powf(d.uniform()));
        let p = [3.0 * d.uniform() - 1.5, d.uniform() - 0.5, curvature, 30.0 * d.uniform(), 0.3, 0.7, 10.0];
        for (is_left, phase) in [(true, p[LEFT]), (false, p[RIGHT])] {
            let mut shown = Vec::new();
            s.row_between(&p, is_left, phase, [p[START], f64::INFINITY], |m| shown.push(m.u));
            let mut expected = Vec::new();
            let spacing = s.spacing_m(is_left);
            let mut u = phase + ((p[START] - phase) / spacing).ceil() * spacing;
            while u <= s.end_m(is_left, p[CURVATURE], p[START]) {
                let at = s.row_m(is_left, u, p[CURVATURE], p[START]) - DVec2::new(0.0, p[OFFSET]);
                let range = at.length().hypot(s.radar_height_m);
                let ahead = at.dot(DVec2::from_angle(p[HEADING]));
                if range >= s.near_m && range <= s.far_m && ahead >= range * s.half_view_rad.cos() {
                    expected.push(u);
                }
                u += spacing;
            }
            assert_eq!(shown, expected, "{p:?} {is_left}");
            // The way along the arc is its slope.
            let (u, step) = (p[START] + 3.0, 1e-4);
            let at = |u: f64| s.row_m(is_left, u, p[CURVATURE], p[START]);
            let slope = (at(u + step) - at(u - step)) / (2.0 * step);
            let way = s.way(is_left, u, p[CURVATURE], p[START]);
            assert!(way.distance(slope) < 1e-6, "{way} {slope}");
        }
    }
}

#[test]
fn the_grid_is_right_about_a_lane_that_it_holds() {
    let s = LaneSettings::default();
    for (offset, heading, curvature, start) in
        [(0.75, 0.0, 0.0, 10.0), (0.375, 8f64.to_radians(), 0.064, 8.0), (1.125, -0.5, -0.032, 16.0)]
    {
        let t = Truth { offset, heading, curvature, start, ..STRAIGHT };
        let cells = cells(&t, &s, &REAL, 17);
        let fit = Fit::new(&cells, KNOWN, &s).unwrap();
        let lanes = fit.grid(&fit.speeds);
        let is_near = |p: &Vector| {
            (p[OFFSET] - offset).abs() < 0.4
                && (p[HEADING] - heading).abs() < 0.08
                && (p[CURVATURE] - curvature).abs() < 0.005 + 0.5 * f64::abs(curvature)
        };
        assert!(lanes.iter().take(8).any(is_near), "{t:?} {lanes:?}");
    }
}

#[test]
fn hostile_input() {
    let s = LaneSettings::default();
    let good = cells(&STRAIGHT, &s, &REAL, 1);
    let few = |r: Result<LaneFromMap, LaneError>| matches!(r, Err(LaneError::TooFew { .. }));
    assert!(few(lane_from_map(&[], KNOWN, &s)));
    assert!(few(lane_from_map(&good[..1], KNOWN, &s)));
    let nan: Vec<Cell> = good.iter().map(|c| Cell { range_m: f64::NAN, ..*c }).collect();
    assert!(few(lane_from_map(&nan, KNOWN, &s)));
    let unsure: Vec<Cell> = good.iter().map(|c| Cell { range_rate_std_mps: 0.0, ..*c }).collect();
    assert!(few(lane_from_map(&unsure, KNOWN, &s)));
    let infinite: Vec<Cell> = good.iter().map(|c| Cell { range_rate_mps: f64::INFINITY, ..*c }).collect();
    assert!(few(lane_from_map(&infinite, KNOWN, &s)));
    let still: Vec<Cell> = good.iter().map(|c| Cell { range_rate_mps: 0.0, ..*c }).collect();
    assert!(matches!(lane_from_map(&still, Speed::FromMap, &s), Err(LaneError::Refused { .. })));
    let zero = Speed::Known { mps: 0.0, std_mps: 0.0 };
    assert_eq!(lane_from_map(&good, zero, &s), Err(too_slow(0.0)));
    let nan = Speed::Known { mps: f64::NAN, std_mps: 0.0 };
    assert_eq!(lane_from_map(&good, nan, &s), Err(LaneError::Setting { name: "speed" }));
    for bad in [
        LaneSettings { lane_width_m: -1.0, ..s },
        LaneSettings { left_spacing_m: f64::NAN, ..s },
        LaneSettings { min_radius_m: 1.0, ..s },
        LaneSettings { curve_start: CurveStart::UpTo(f64::INFINITY), ..s },
        LaneSettings { detection_probability: 1.0, ..s },
    ] {
        assert!(matches!(lane_from_map(&good, KNOWN, &bad), Err(LaneError::Setting { .. })));
    }
    // One cell over and over, and cells all over the map, draw no lane.
    let same =
        vec![Cell { range_m: 10.0, range_rate_mps: -5.0, range_std_m: 0.1, range_rate_std_mps: 0.045 }; 30];
    let _ = lane_from_map(&same, KNOWN, &s);
    let mut d = Draws::new(1, 5);
    let clutter: Vec<Cell> = (0..40)
        .map(|_| Cell { range_m: 40.0 * d.uniform(), range_rate_mps: -10.0 * d.uniform(), ..same[0] })
        .collect();
    assert!(matches!(lane_from_map(&clutter, KNOWN, &s), Err(LaneError::Unexplained { .. })));
    assert!(matches!(speed_from_edge(&good[..2]), Err(LaneError::Refused { .. })));
    assert_eq!(too_slow(0.0).to_string(), "at 0.000 m/s the range rates do not determine the lane");
}
