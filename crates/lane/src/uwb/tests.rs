use super::*;
use crate::error::LaneError;

/// SplitMix64.
struct Rng(u64);

impl Rng {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.uniform()
    }
    fn normal(&mut self) -> f64 {
        let r = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        r * (std::f64::consts::TAU * self.uniform()).cos()
    }
    /// Mean of `looks` exponential powers, mean 1 (Marsaglia and Tsang 2000, gamma).
    fn speckle(&mut self, looks: f64) -> f64 {
        if looks.is_infinite() {
            return 1.0;
        }
        let d = looks - 1.0 / 3.0;
        let c = 1.0 / (9.0 * d).sqrt();
        loop {
            let x = self.normal();
            let v = (1.0 + c * x).powi(3);
            if v > 0.0 && (1.0 - self.uniform()).ln() < 0.5 * x * x + d - d * v + d * v.ln() {
                return d * v / looks;
            }
        }
    }
}

/// How a plate's echo rises and falls along the road.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// A mirror: full over the plate, with an edge of a Fresnel zone.
    Mirror,
    /// A rough plate: the sum over its area of (H²/d²)³, the document's area argument.
    Area,
}

const SPACING_M: f64 = 8.0;
const PLATE_M: f64 = 3.0;
const HEIGHT_M: f64 = 1.32;
const FLOOR: f64 = 4.5;

/// A drive past plates. Energies in mW.
#[derive(Clone)]
struct Drive {
    seed: u64,
    shape: Shape,
    /// Lateral offset against distance.
    offset: fn(f64) -> f64,
    sway_m: f64,
    /// Plate centres and, when not a plate, lengths of other bodies.
    bodies: Vec<(f64, f64)>,
    speed_mps: (f64, f64),
    speed_noise: f64,
    speed_scale: f64,
    /// Speed as a whole number of km/h, as the document's tables show.
    whole_kmh: bool,
    looks: f64,
    scan_rate_hz: f64,
    length_m: f64,
}

struct Record {
    energies: Vec<f64>,
    ranges: Vec<f64>,
    times: Vec<f64>,
    speeds: Vec<f64>,
    road_m: Vec<f64>,
    offsets: Vec<f64>,
    body_times: Vec<f64>,
    over_plate: Vec<bool>,
}

fn plates(count: usize) -> Vec<(f64, f64)> {
    (0..count).map(|i| (10.0 + SPACING_M * i as f64, PLATE_M)).collect()
}

impl Drive {
    fn past(count: usize, offset: fn(f64) -> f64, seed: u64) -> Drive {
        Drive {
            seed,
            shape: Shape::Mirror,
            offset,
            sway_m: 0.1,
            bodies: plates(count),
            speed_mps: (20.0 / 3.6, 30.0 / 3.6),
            speed_noise: 0.02,
            speed_scale: 1.0,
            whole_kmh: true,
            looks: 400.0,
            scan_rate_hz: 20.0,
            length_m: 12.0 + SPACING_M * count as f64,
        }
    }

    fn perfect(mut self) -> Drive {
        self.sway_m = 0.0;
        self.speed_noise = 0.0;
        self.whole_kmh = false;
        self.looks = f64::INFINITY;
        self
    }

    fn echo(&self, along_m: f64, length_m: f64, offset_m: f64) -> f64 {
        let across = 1.0 / (1.0 + (offset_m / HEIGHT_M).powi(2));
        let along = match self.shape {
            Shape::Mirror => {
                let edge = |x: f64| 0.5 * (1.0 + (x / 0.15).tanh());
                edge(length_m / 2.0 - along_m) * edge(length_m / 2.0 + along_m)
            }
            Shape::Area => {
                let h2 = HEIGHT_M.powi(2) + offset_m.powi(2);
                let share = |from: f64, to: f64| {
                    let n = 60;
                    let step = (to - from) / n as f64;
                    (0..n)
                        .map(|i| {
                            let y = from + (i as f64 + 0.5) * step;
                            step * (h2 / (h2 + y * y)).powi(3)
                        })
                        .sum::<f64>()
                };
                let half = length_m / 2.0;
                // The gate ends 2.5 m ahead and behind.
                let (a, b) = ((along_m - half).clamp(-2.5, 2.5), (along_m + half).clamp(-2.5, 2.5));
                share(a, b) / share(-1.5, 1.5)
            }
        };
        2.1 * across * along
    }

    fn run(&self) -> Record {
        let mut rng = Rng(self.seed.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ 77);
        let dt = 1.0 / self.scan_rate_hz;
        let mean = rng.between(self.speed_mps.0, self.speed_mps.1);
        let turn = std::f64::consts::TAU;
        let (phase, sway_phase) = (turn * rng.uniform(), turn * rng.uniform());
        let wave_m = rng.between(25.0, 45.0);
        let strength: Vec<f64> = self
            .bodies
            .iter()
            .map(|_| if self.looks.is_infinite() { 1.0 } else { 1.0 + 0.08 * rng.normal() })
            .collect();
        let mut r = Record {
            energies: vec![],
            ranges: vec![],
            times: vec![],
            speeds: vec![],
            road_m: vec![],
            offsets: vec![],
            body_times: vec![],
            over_plate: vec![],
        };
        let (mut x, mut t, mut next) = (0.0, 0.0, 0);
        while x < self.length_m {
            let v = mean * (1.0 + 0.05 * (0.4 * t + phase).sin());
            let offset = (self.offset)(x) + self.sway_m * (turn * x / wave_m + sway_phase).sin();
            let mut e = FLOOR;
            let mut over = false;
            for (b, (centre, length)) in self.bodies.iter().enumerate() {
                let along = x - centre;
                if along.abs() < 6.0 {
                    e += strength[b] * self.echo(along, *length, offset);
                    over |= along.abs() <= length / 2.0;
                }
            }
            let mut speed = v * self.speed_scale * (1.0 + self.speed_noise * rng.normal());
            if self.whole_kmh {
                speed = (speed * 3.6).round() / 3.6;
            }
            r.energies.push(e * rng.speckle(self.looks));
            let noise = if self.looks.is_infinite() { 0.0 } else { 0.01 * rng.normal() };
            r.ranges.push(HEIGHT_M.hypot(offset) + noise);
            r.times.push(t);
            r.speeds.push(speed);
            r.road_m.push(x);
            r.offsets.push(offset);
            r.over_plate.push(over);
            while next < self.bodies.len() && self.bodies[next].0 < x + v * dt {
                r.body_times.push(t + (self.bodies[next].0 - x) / v);
                next += 1;
            }
            x += v * dt;
            t += dt;
        }
        r
    }
}

fn near(_: f64) -> f64 {
    0.3
}
fn far(_: f64) -> f64 {
    1.2
}
/// Leaves to the left between plates 4 and 5 (centres at 34 m and 42 m).
fn leaving(x: f64) -> f64 {
    0.3 + 3.2 * ((x - 35.5) / 6.0).clamp(0.0, 1.0)
}

/// About 6000 scans without markers.
fn bare_road(seed: u64) -> Vec<f64> {
    let mut d = Drive::past(0, near, seed);
    d.length_m = 6000.0 * 10.0 / 3.6 / 20.0;
    d.speed_mps = (10.0 / 3.6, 10.0 / 3.6);
    d.run().energies
}

fn config() -> UwbConfig {
    UwbConfig::new(SPACING_M, PLATE_M, &Threshold::maximum(&bare_road(1)).unwrap()).unwrap()
}

fn estimate(config: &UwbConfig, r: &Record) -> LaneEstimate {
    Uwb::estimate(config.clone(), &r.energies, &r.ranges, &r.times, &r.speeds).unwrap()
}

/// Errors and counts over many drives of one kind.
#[derive(Default)]
struct Tally {
    errors_m: Vec<f64>,
    markers: usize,
    detected: usize,
    spacings: usize,
    right: usize,
    false_passes: usize,
    departures: usize,
    scans_over_plate: usize,
    scans_seen: usize,
}

impl Tally {
    fn add(&mut self, c: &UwbConfig, r: &Record) -> LaneEstimate {
        let run = estimate(c, r);
        let s = score_run(&run, &r.body_times, 0.3, SPACING_M, c.max_spacing_error_m).unwrap();
        self.markers += s.markers;
        self.detected += s.detected;
        self.spacings += s.spacings;
        self.right += s.spacings_right;
        self.false_passes += s.false_passes;
        self.errors_m.extend(s.spacing_errors_m);
        let end_m = *run.distance_m.last().unwrap();
        // Those at the end of the row of plates are right.
        self.departures += run.departures().filter(|(_, d)| d.expected_m < end_m - 8.0).count();
        for (e, over) in r.energies.iter().zip(&r.over_plate) {
            self.scans_over_plate += usize::from(*over);
            self.scans_seen += usize::from(*over && *e > c.threshold_energy);
        }
        run
    }
    fn rate(&self) -> f64 {
        self.detected as f64 / self.markers as f64
    }
    fn spacing_rate(&self) -> f64 {
        self.right as f64 / self.spacings as f64
    }
}

fn drives(runs: u64, make: impl Fn(u64) -> Drive, c: &UwbConfig) -> Tally {
    let mut t = Tally::default();
    for seed in 0..runs {
        t.add(c, &make(seed).run());
    }
    t
}

/// Passes rejected for want of a period.
fn isolated(run: &LaneEstimate) -> usize {
    run.events.iter().filter(|e| matches!(e.kind, EventKind::Isolated(_))).count()
}

const KIM: MarkedLane =
    MarkedLane { height_m: 1.32, lane_width_m: 3.5, car_width_m: 1.9, spacing_m: 8.0, plate_length_m: 3.0 };

#[test]
fn gate_follows_the_formula_not_the_printed_value() {
    let g = RangeGate::from_marked_lane(&KIM).unwrap();
    assert_eq!(g.min_m, 1.32);
    // 1.6² + 2.5² + 1.32² = 10.5524.
    assert!((g.max_m - 10.5524_f64.sqrt()).abs() < 1e-12);
    assert!((g.max_m - 3.65).abs() > 0.4);
    for bad in [
        MarkedLane { height_m: 0.0, ..KIM },
        MarkedLane { car_width_m: 3.6, ..KIM },
        MarkedLane { plate_length_m: 8.0, ..KIM },
        MarkedLane { spacing_m: f64::NAN, ..KIM },
        MarkedLane { lane_width_m: f64::INFINITY, ..KIM },
    ] {
        let why = RangeGate::from_marked_lane(&bad).unwrap_err().to_string();
        assert!(why.len() > 15 && !why.contains('\n'), "{why}");
    }
    assert!(RangeGate::new(2.0, 2.0).is_err() && RangeGate::new(-1.0, 2.0).is_err());
    let w = g.widened(0.1).unwrap();
    assert!((g.min_m - w.min_m - 0.1).abs() < 1e-12 && (w.max_m - g.max_m - 0.1).abs() < 1e-12);
    assert!(g.widened(2.0).unwrap().min_m == 0.0 && g.widened(-0.1).is_err());
}

#[test]
fn energy_is_the_sum_over_the_gate() {
    let axis = RangeAxis { start_m: 0.5, step_m: 0.25 };
    let gate = RangeGate::new(1.0, 2.0).unwrap();
    // Samples at 0.5, 0.75, ..., 2.5; the gate holds those from index 2 to 6.
    let scan = [9.0, 9.0, 1.0, -2.0, 3.0, 1.0, 0.5, 9.0, 9.0];
    let e = gate.echo(&scan, &axis).unwrap();
    assert_eq!(e.energy, 1.0 + 4.0 + 9.0 + 1.0 + 0.25);
    // Parabola through 4, 9, 1 at 1.25, 1.5, 1.75 m: 0.5 (4 - 1) / (4 - 18 + 1) of a step.
    assert!((e.strongest_range_m.unwrap() - (1.5 - 0.25 * 1.5 / 13.0)).abs() < 1e-12);
    assert_eq!(gate.echo(&[0.0; 9], &axis).unwrap().strongest_range_m, None);

    assert!(matches!(gate.echo(&scan[..5], &axis), Err(LaneError::Refused { .. })));
    assert!(matches!(gate.echo(&[], &axis), Err(LaneError::Missing { .. })));
    let mut nan = scan;
    nan[4] = f64::NAN;
    assert_eq!(
        gate.echo(&nan, &axis),
        Err(LaneError::NotANumber { what: "power of range sample", index: Some(4) })
    );
    nan[4] = 1e200;
    assert!(gate.echo(&nan, &axis).is_err());
    assert!(gate.echo(&scan, &RangeAxis { step_m: 0.0, ..axis }).is_err());
    assert!(gate.echo(&scan, &RangeAxis { start_m: f64::NAN, ..axis }).is_err());
    let narrow = RangeGate { min_m: 1.3, max_m: 1.4 };
    assert!(matches!(narrow.echo(&scan, &axis), Err(LaneError::TooFew { .. })));
    // The wave's samples of the impulse radar: 0.6 m to 10.4 m.
    let axis = RangeAxis::from_time(4e-9, 23.328e9).unwrap();
    assert!((axis.start_m - 0.5996).abs() < 1e-4 && (axis.step_m - 6.4256e-3).abs() < 1e-6);
    assert!(RangeAxis::from_time(0.0, 0.0).is_err());
}

#[test]
fn histogram_counts_every_value_once() {
    let h = Histogram::with_edges(&[0.0, 0.5, 1.0, 2.0, 2.0], vec![0.0, 0.5, 1.0, 1.5, 2.0]).unwrap();
    assert_eq!(h.edges, [0.0, 0.5, 1.0, 1.5, 2.0]);
    assert_eq!((h.counts, h.outside), (vec![1, 1, 1, 2], [0, 0]));
    let h = Histogram::with_edges(&[-1.0, 0.0, 1.0, 3.0], vec![0.0, 1.0, 2.0]).unwrap();
    assert_eq!((h.counts, h.outside), (vec![1, 1], [1, 1]));
    assert!(Histogram::with_edges(&[], vec![0.0, 1.0]).is_err());
    assert!(Histogram::with_edges(&[1.0, f64::NAN], vec![0.0, 1.0]).is_err());
    assert!(Histogram::with_edges(&[1.0], vec![1.0, 1.0]).is_err());
    assert!(Histogram::with_edges(&[1.0], vec![1.0]).is_err());
}

#[test]
fn threshold_false_alarms_are_as_stated() {
    let seen = bare_road(1);
    assert!((5900..6100).contains(&seen.len()));
    let t = Threshold::maximum(&seen).unwrap();
    assert_eq!(exceedance_rate(&seen, t.energy), Ok(0.0));
    assert!((t.floor_energy / FLOOR - 1.0).abs() < 4.0 * 0.05 / (seen.len() as f64).sqrt());
    assert_eq!(t.release_energy(1.0), Ok(t.energy));
    assert!(t.release_energy(1.5).is_err());

    // 400 thresholds of 200 scans each, 200 new scans each: the count over them has mean 80000 / 201; its
    // spread is that of 400 nearly geometric counts of mean and deviation about 1.
    let mut rng = Rng(5);
    let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.speckle(400.0)).collect() };
    let mut over = 0.0;
    for _ in 0..400 {
        let (old, new) = (draw(200), draw(200));
        let t = Threshold::maximum(&old).unwrap();
        over += exceedance_rate(&new, t.energy).unwrap() / 400.0 / t.false_alarm_probability;
    }
    // Five deviations: 2^0.5 / 400^0.5 = 0.07.
    assert!((over - 1.0).abs() < 0.35, "{over}");
}

#[test]
fn extreme_value_threshold_reaches_beyond_the_scans() {
    // Exponential energies: the quantile of 1e-5 is ln 1e5 and the tail's shape zero. Hosking and Wallis give
    // the variances 4/3, 7/3 and covariance -4/3 (over 300 excesses) of shape and scale there; with y =
    // ln(0.05 / 1e-5) the quantile moves by y²/2 and y of them.
    let (mut mean, mut square) = (0.0, 0.0);
    let runs = 100;
    for seed in 0..runs {
        let mut rng = Rng(seed);
        let e: Vec<f64> = (0..6000).map(|_| -(1.0 - rng.uniform()).ln()).collect();
        let t = Threshold::extreme_value(&e, 1e-5).unwrap();
        let error = t.energy / 1e5_f64.ln() - 1.0;
        mean += error / runs as f64;
        square += error * error / runs as f64;
        let ThresholdMethod::ExtremeValue { shape, excesses } = t.method else { panic!() };
        assert_eq!(excesses, 300);
        assert!(shape.abs() < 5.0 * (4.0 / 3.0 / 300.0_f64).sqrt(), "{shape}");
    }
    let y = 5000_f64.ln();
    let h = y * y / 2.0;
    let expected = ((h * h * 4.0 + y * y * 7.0 - 2.0 * h * y * 4.0) / 3.0 / 300.0).sqrt() / 1e5_f64.ln();
    println!(
        "extreme value, exponential, 1e-5: mean error {mean:.3}, rms {:.3}, theory {expected:.3}",
        square.sqrt()
    );
    assert!(mean.abs() < 4.0 * expected / (runs as f64).sqrt());
    // The quantile is convex in the shape: the second order adds about a tenth.
    assert!((0.7..1.5).contains(&(square.sqrt() / expected)));
    // Speckle of 400 looks: share of two million new scans above the threshold for 1e-4.
    let mut share = 0.0;
    for seed in 0..10 {
        let mut rng = Rng(900 + seed);
        let e: Vec<f64> = (0..6000).map(|_| rng.speckle(400.0)).collect();
        let t = Threshold::extreme_value(&e, 1e-4).unwrap().energy;
        share += (0..200_000).filter(|_| rng.speckle(400.0) > t).count() as f64 / 2e6;
    }
    println!("extreme value, speckle, asked 1e-4: {share:.2e}");
    assert!((0.3e-4..3e-4).contains(&share));
    // Excesses at the mean places of evenly spread ones: shape -1 and scale 1, so the quantile is 1 - p /
    // share.
    let even: Vec<f64> = (0..1000).map(|i| (f64::from(i) - 949.0).max(0.0) / 51.0).collect();
    let t = Threshold::extreme_value(&even, 0.01).unwrap();
    let ThresholdMethod::ExtremeValue { shape, .. } = t.method else { panic!() };
    assert!((shape + 1.0).abs() < 1e-12 && (t.energy - 0.8).abs() < 1e-12, "{t:?}");
    assert!(Threshold::extreme_value(&[1.0; 99], 1e-4).is_err());
    assert!(Threshold::extreme_value(&[1.0; 6000], 1e-4).is_err());
    assert!(Threshold::extreme_value(&bare_road(1), 0.2).is_err());
    for bad in [vec![], vec![1.0, -1.0], vec![f64::NAN]] {
        assert!(Threshold::maximum(&bad).is_err());
    }
}

#[test]
fn matched_centre_has_the_least_error() {
    let centres = [Centre::Maximum, Centre::Centroid, Centre::Edges, Centre::Matched];
    let mut sums = [0.0; 4];
    for shape in [Shape::Mirror, Shape::Area] {
        for (name, offset) in [("0.3 m", near as fn(f64) -> f64), ("1.2 m", far)] {
            for (k, centre) in centres.into_iter().enumerate() {
                let c = UwbConfig { centre, ..config() };
                let make = |seed| Drive { shape, ..Drive::past(6, offset, seed) };
                let noisy = drives(200, make, &c);
                let perfect = drives(200, |s| make(s).perfect(), &c);
                let (p, q) =
                    (spacing_errors(&perfect.errors_m).unwrap(), spacing_errors(&noisy.errors_m).unwrap());
                println!(
                    "{shape:?} {name} {centre:?}: perfect mean {:.3} worst {:.3} m; noisy mean {:.3} \
                     rms {:.3} worst {:.3} bias {:.3} m; markers {:.4}, spacings {:.4}, false {}, false departures {}",
                    p.mean_m,
                    p.worst_m,
                    q.mean_m,
                    q.rms_m,
                    q.worst_m,
                    q.bias_m,
                    noisy.rate(),
                    noisy.spacing_rate(),
                    noisy.false_passes,
                    noisy.departures,
                );
                sums[k] += q.rms_m;
                assert_eq!(perfect.rate(), 1.0);
                if centre == Centre::Matched {
                    // Without noise the error is that of sampling: below a half of a scan's 0.42 m.
                    assert!(p.worst_m < 0.21 && p.bias_m.abs() < 0.01);
                }
            }
        }
    }
    assert!(sums[3] < sums[0] && sums[3] < sums[1] && sums[3] < sums[2], "{sums:?}");
}

#[test]
fn four_scenarios_ten_runs_each() {
    let c = config();
    println!("threshold {:.3}, release {:.3}", c.threshold_energy, c.release_energy);
    for shape in [Shape::Mirror, Shape::Area] {
        // Scenario 1: nothing may look like a lane.
        let mut passes = 0;
        for seed in 0..10 {
            let mut d = Drive::past(0, near, 50 + seed);
            d.length_m = 60.0;
            let run = estimate(&c, &d.run());
            passes += run.markers.len();
            assert!(run.lane_present.iter().all(|p| !p));
        }
        println!("{shape:?} scenario 1: {passes} passes");
        assert!(passes <= 2);
        for (name, offset, least) in [("2", near as fn(f64) -> f64, 0.99), ("3", far, 0.9)] {
            let slow = |seed| {
                let mut d = Drive { shape, sway_m: 0.0, ..Drive::past(250, offset, 70 + seed) };
                d.speed_mps = (10.0 / 3.6, 10.0 / 3.6);
                d
            };
            let histogram = drives(1, slow, &c);
            let document = UwbConfig { centre: Centre::Maximum, ..c.clone() };
            let document = drives(10, |s| Drive { shape, ..Drive::past(5, offset, s) }, &document);
            let d = spacing_errors(&document.errors_m).unwrap();
            println!(
                "{shape:?} scenario {name} with the scan of greatest energy: spacings {:.3}, mean {:.3} m, \
                 worst {:.3} m",
                document.spacing_rate(),
                d.mean_m,
                d.worst_m
            );
            let runs = drives(10, |s| Drive { shape, ..Drive::past(5, offset, s) }, &c);
            let e = spacing_errors(&runs.errors_m).unwrap();
            println!(
                "{shape:?} scenario {name}: histogram {:.3} of {} scans, runs: scans {:.3}, markers {:.3}, \
                 spacings {:.3}, mean {:.3} m, worst {:.3} m, false {}, false departures {}",
                histogram.scans_seen as f64 / histogram.scans_over_plate as f64,
                histogram.scans_over_plate,
                runs.scans_seen as f64 / runs.scans_over_plate as f64,
                runs.rate(),
                runs.spacing_rate(),
                e.mean_m,
                e.worst_m,
                runs.false_passes,
                runs.departures
            );
            assert!(runs.rate() >= least && runs.spacing_rate() >= least - 0.1);
            assert!(e.worst_m < 2.0 * c.max_spacing_error_m);
        }
        // Scenario 4: five plates, off the lane before the fifth.
        let mut delays = vec![];
        for seed in 0..10 {
            let run = estimate(&c, &Drive { shape, ..Drive::past(5, leaving, 20 + seed) }.run());
            let marker = run.markers.iter().rfind(|m| m.verdict == Verdict::Lane).unwrap();
            let (event, d) = run.departures().last().unwrap();
            assert_eq!(d.last_marker_m, marker.pass.distance_m);
            assert!(!event.lane_present && !run.lane_present.last().unwrap());
            // Within the speed's error of the fifth plate's place.
            assert!((d.expected_m - 42.0).abs() < 2.0, "{d:?}");
            assert!(d.peak_energy <= c.threshold_energy);
            delays.push(d.delay_m);
        }
        let worst = delays.iter().copied().fold(0.0, f64::max);
        println!("{shape:?} scenario 4: warning {worst:.2} m past the fifth plate's place at most");
        assert!(worst < c.max_spacing_error_m + 0.5);
    }
}

/// Speed noise alone: each scan's step errs by sigma v dt, independent: a random walk W of variance sigma² v
/// dt a metre. A centre is the mean of W over the window's ends u, so a spacing has the variance of L_s - E|u
/// - u'| metres. The ends lie 0.5 +- 0.2 plates off, evenly: E|u - u'| = (0.5 + 0.2 / 3) L_l.
#[test]
fn speed_noise_gives_the_expected_spacing_error() {
    let c = config();
    let (sigma, v) = (0.1, 7.0);
    let mut errors = vec![];
    for seed in 0..100 {
        let d = Drive { speed_mps: (v, v), ..Drive::past(11, near, seed).perfect() };
        let e = |d: Drive| {
            score_run(&estimate(&c, &d.run()), &d.run().body_times, 0.3, SPACING_M, 1.0)
                .unwrap()
                .spacing_errors_m
        };
        let clean = e(d.clone());
        let noisy = e(Drive { speed_noise: sigma, ..d });
        assert_eq!(clean.len(), noisy.len());
        errors.extend(noisy.iter().zip(&clean).map(|(a, b)| a - b));
    }
    let rms = spacing_errors(&errors).unwrap().rms_m;
    let expected = sigma * ((SPACING_M - (0.5 + 0.2 / 3.0) * PLATE_M) * v / 20.0_f64).sqrt();
    println!("speed noise: rms {rms:.4} m, expected {expected:.4} m");
    // 1000 spacings: 2.2 % deviation; places between scans are smoothed a little more.
    assert!((rms / expected - 1.0).abs() < 0.1, "{rms} {expected}");
    // A scale error of the speed goes into the spacing as it is.
    let r = Drive { speed_scale: 1.03, ..Drive::past(20, near, 3).perfect() }.run();
    let s = score_run(&estimate(&c, &r), &r.body_times, 0.3, SPACING_M, 1.0).unwrap();
    assert!((spacing_errors(&s.spacing_errors_m).unwrap().bias_m - 0.03 * SPACING_M).abs() < 0.02);
}

#[test]
fn manholes_have_no_period() {
    let c = config();
    // Round and square covers of 0.65 m and 0.8 m; their echo is above the threshold.
    for length in [0.65, 0.8] {
        for seed in 0..10 {
            let mut d = Drive::past(0, near, seed);
            d.bodies = vec![(20.0, length), (43.5, length)];
            d.length_m = 70.0;
            d.looks = 4000.0;
            let run = estimate(&c, &d.run());
            assert_eq!(run.markers.len(), 2, "{seed}");
            assert!(
                run.markers
                    .iter()
                    .all(|m| m.verdict == Verdict::Unpaired && m.pass.peak_energy > c.threshold_energy)
            );
            assert_eq!(isolated(&run), 2);
            assert!(run.lane_present.iter().all(|p| !p) && run.departures().count() == 0);
        }
    }
    // A cover midway between two plates, and one near a plate, leave the lane as it is.
    for at in [10.0 + 4.0 * SPACING_M + 4.0, 10.0 + 3.0 * SPACING_M + 2.9] {
        let mut d = Drive::past(8, near, 4);
        d.looks = 4000.0;
        let clean = estimate(&c, &d.run());
        d.bodies.push((at, 0.7));
        d.bodies.sort_by(|a, b| a.0.total_cmp(&b.0));
        let run = estimate(&c, &d.run());
        let lanes = |run: &LaneEstimate| run.markers.iter().filter(|m| m.verdict == Verdict::Lane).count();
        assert_eq!(lanes(&run), lanes(&clean));
        assert_eq!(run.departures().count(), clean.departures().count());
    }
    // Two covers just a spacing apart are a lane by the document's rule; asking for two spacings rejects
    // them.
    let mut d = Drive::past(0, near, 1);
    d.bodies = vec![(20.0, 0.7), (28.0, 0.7)];
    d.length_m = 60.0;
    d.looks = 4000.0;
    let r = d.run();
    assert!(estimate(&c, &r).lane_present.iter().any(|p| *p));
    let strict = UwbConfig { confirm_spacings: 2, ..c };
    assert!(estimate(&strict, &r).lane_present.iter().all(|p| !p));
    let plates = estimate(&strict, &Drive::past(5, near, 1).run());
    let verdicts: Vec<_> = plates.markers.iter().map(|m| m.verdict).collect();
    use Verdict::*;
    assert_eq!(verdicts, [Unpaired, Paired, Lane, Lane, Lane]);
}

/// Energies of a drive at 6 m/s and 20 scans a second: `high` where `over` holds, else 4.5.
fn drawn(length_m: f64, high: f64, over: impl Fn(f64) -> bool) -> LaneEstimate {
    let n = (length_m / 0.3) as usize;
    let energies: Vec<f64> = (0..n).map(|i| if over(0.3 * i as f64) { high } else { FLOOR }).collect();
    let times: Vec<f64> = (0..n).map(|i| 0.05 * i as f64).collect();
    Uwb::estimate(config(), &energies, &[], &times, &vec![6.0; n]).unwrap()
}

#[test]
fn dips_are_bridged_and_near_passes_set_aside() {
    let plate = |x: f64, at: f64, length: f64| (x - at).abs() <= length / 2.0;
    // A dip of 1 m in the plate at 18 m; one of 1.6 m, beyond the 1.5 m that are bridged, parts a plate.
    let dip = |gap: f64| {
        move |x: f64| (0..4).any(|i| plate(x, 10.0 + 8.0 * f64::from(i), 3.0)) && !plate(x, 18.0, gap)
    };
    let whole = drawn(60.0, 6.5, dip(1.0));
    assert_eq!(whole.markers.len(), 4);
    assert!((whole.markers[1].pass.distance_m - 18.0).abs() < 0.2);
    assert!((whole.markers[1].pass.end_m - whole.markers[1].pass.start_m - 3.0).abs() < 0.5);
    assert_eq!(drawn(60.0, 6.5, dip(1.9)).markers.len(), 5);
    // Below the threshold and above the release level no pass begins.
    let c = config();
    assert!(drawn(60.0, (c.threshold_energy + c.release_energy) / 2.0, dip(0.1)).markers.is_empty());
    // A cover 3.5 m behind the third plate.
    let run = drawn(60.0, 6.5, |x| dip(0.0)(x) || plate(x, 29.5, 0.7));
    let verdicts: Vec<_> = run.markers.iter().map(|m| m.verdict).collect();
    use Verdict::*;
    assert_eq!(verdicts, [Unpaired, Lane, Lane, TooNear, Lane]);
    assert_eq!(isolated(&run), 1);
    // A body shorter than the window is placed within its own length and a scan.
    assert!((run.markers[3].from_previous_m.unwrap() - 3.5).abs() < 0.7 / 2.0 + 0.3);
    assert!(run.markers[3].spacing.is_none());
    // Exactly one warning, the largest error past the fifth plate's place or up to one scan later.
    let warned: Vec<_> = run.departures().collect();
    assert_eq!(warned.len(), 1);
    assert!((1.0..1.31).contains(&warned[0].1.delay_m) && (warned[0].1.expected_m - 42.0).abs() < 0.2);
    assert!((warned[0].0.distance_m - warned[0].1.expected_m - warned[0].1.delay_m).abs() < 1e-9);
}

#[test]
fn a_missed_marker_is_bridged_when_asked() {
    let mut d = Drive::past(8, near, 2);
    d.bodies.remove(4);
    let r = d.run();
    let c = config();
    let strict = estimate(&c, &r);
    assert_eq!(strict.departures().count(), 2);
    assert_eq!(strict.odometer.unwrap().spacings, 7);
    let lenient = estimate(&UwbConfig { misses_to_warn: 2, ..c }, &r);
    // The run ends before the second marker after the row is due.
    assert_eq!(lenient.departures().count(), 0);
    assert!(
        lenient.markers.iter().any(|m| m.spacing.is_some_and(|s| s.intervals == 2 && s.error_m.abs() < 0.6))
    );
    assert_eq!(lenient.odometer.unwrap().spacings, 7);
    assert_eq!(isolated(&lenient), 0);
}

#[test]
fn odometer_holds_against_a_wrong_speed() {
    let c = UwbConfig { misses_to_warn: 2, ..config() };
    for (shape, scale) in [(Shape::Mirror, 1.03), (Shape::Mirror, 0.96), (Shape::Area, 1.03)] {
        let mut d = Drive { speed_scale: scale, shape, ..Drive::past(400, near, 9) };
        // A tenth of the plates is worn off, never two in a row.
        let mut i = 0;
        d.bodies.retain(|_| {
            i += 1;
            i % 10 != 5
        });
        let r = d.run();
        let mut uwb = Uwb::new(c.clone()).unwrap();
        let (mut worst, mut drift, mut certain) = (0.0_f64, 0.0, true);
        for k in 0..r.energies.len() {
            uwb.push(r.energies[k], r.times[k], r.speeds[k]).unwrap();
            // Up to the last plate.
            if let Some(o) = uwb.odometer().filter(|_| r.road_m[k] < 10.0 + 399.0 * SPACING_M) {
                worst = worst.max((o.distance_m - (r.road_m[k] - 10.0)).abs());
                drift = o.speed_distance_m - (r.road_m[k] - 10.0);
                certain &= o.certain;
            }
        }
        println!(
            "{shape:?} odometer, speed scale {scale}: worst error {worst:.2} m over 3192 m, speed alone \
             {drift:.1} m"
        );
        assert!(worst < 1.0 && drift.abs() > 80.0 && certain, "{worst} {drift}");
    }
    let mut o = MarkerOdometer::new(8.0, 1.0).unwrap();
    assert_eq!(o.reading(1.0), None);
    assert_eq!(
        (o.mark(2.0), o.mark(10.2), o.mark(14.0), o.mark(26.1)),
        (Ok(true), Ok(true), Ok(false), Ok(true))
    );
    let r = o.reading(28.0).unwrap();
    assert_eq!((r.spacings, r.certain), (3, true));
    assert!((r.distance_m - 25.9).abs() < 1e-9 && (r.drift_m - 0.1).abs() < 1e-9);
    assert_eq!(o.mark(26.1 + 75.5), Ok(true));
    assert!(!o.reading(110.0).unwrap().certain);
    assert!(o.mark(f64::NAN).is_err() && o.mark(0.0).is_err() && o.reading(f64::INFINITY).is_none());
    assert!(MarkerOdometer::new(8.0, 5.0).is_err());
}

#[test]
fn offset_from_range_and_energy() {
    for x in [0.0, 0.3, 1.2, 2.0] {
        let got = offset_from_range_m(HEIGHT_M.hypot(x), HEIGHT_M).unwrap();
        assert!((got - x).abs() < 1e-7);
    }
    assert_eq!(offset_from_range_m(1.0, HEIGHT_M), Ok(0.0));
    assert!(offset_from_range_m(f64::NAN, 1.0).is_err() && offset_from_range_m(1.0, 0.0).is_err());

    let curve = OffsetCurve::new(vec![[0.0, 7.0], [1.0, 6.0], [2.0, 4.0]]).unwrap();
    for (e, x) in [(8.0, 0.0), (7.0, 0.0), (6.5, 0.5), (6.0, 1.0), (5.0, 1.5), (4.0, 2.0), (1.0, 2.0)] {
        assert!((curve.offset_m(e).unwrap() - x).abs() < 1e-12, "{e}");
    }
    assert!(curve.offset_m(f64::NAN).is_err());
    for bad in [
        vec![],
        vec![[0.0, 1.0]],
        vec![[0.0, 1.0], [1.0, 2.0]],
        vec![[1.0, 2.0], [1.0, 1.0]],
        vec![[0.0, f64::NAN], [1.0, 1.0]],
    ] {
        assert!(OffsetCurve::new(bad).is_err());
    }

    // A drift of 0.02 m per metre away from the line.
    let drift = |x: f64| 0.3 + 0.02 * x;
    let truth = |r: &Record, t: f64| r.offsets[r.times.partition_point(|s| *s < t).min(r.times.len() - 1)];
    for source in [
        OffsetSource::Range { height_m: HEIGHT_M },
        OffsetSource::Energy(
            OffsetCurve::new(
                (0..30)
                    .map(|i| 0.1 * f64::from(i))
                    .map(|x| [x, FLOOR + 2.1 / (1.0 + (x / HEIGHT_M).powi(2))])
                    .collect(),
            )
            .unwrap(),
        ),
    ] {
        let c = UwbConfig { offset: source.clone(), ..config() };
        let mut errors = vec![];
        let mut slopes = vec![];
        for seed in 0..50 {
            let d = Drive { sway_m: 0.0, ..Drive::past(6, drift, seed) };
            let r = d.run();
            let mut uwb = Uwb::new(c.clone()).unwrap();
            for k in 0..r.energies.len() {
                let range = Some(r.ranges[k]);
                let event = uwb.push_with_range(r.energies[k], range, r.times[k], r.speeds[k]).unwrap();
                if let EventKind::Marker(m) = event.kind {
                    errors.push(m.pass.lateral_offset_m.unwrap() - truth(&r, m.pass.time_s));
                }
                if r.road_m[k] < 56.0
                    && let Some(t) = uwb.offset_trend().filter(|t| t.markers == 4)
                {
                    slopes.push(t.slope);
                }
            }
        }
        let e = spacing_errors(&errors).unwrap();
        let slope = slopes.iter().sum::<f64>() / slopes.len() as f64;
        let name = if matches!(source, OffsetSource::Range { .. }) { "range" } else { "energy" };
        println!(
            "offset from {name}: mean error {:.3} worst {:.3} bias {:.3} m, slope {slope:.4}",
            e.mean_m, e.worst_m, e.bias_m
        );
        let (limit, slope_limit) = if name == "range" { (0.03, 0.004) } else { (0.3, 0.008) };
        assert!(e.mean_m < limit && (slope - 0.02).abs() < slope_limit, "{e:?} {slope}");
    }
}

#[test]
fn the_trend_is_a_line_of_least_squares() {
    let t = OffsetTrend::fit(&[(0.0, 0.3), (8.0, 0.5), (16.0, 0.7)]).unwrap();
    assert!((t.slope - 0.025).abs() < 1e-12 && (t.offset_m - 0.7).abs() < 1e-12);
    assert!(t.slope_error.unwrap() < 1e-9);
    assert!(OffsetTrend::fit(&[(0.0, 1.0)]).is_err() && OffsetTrend::fit(&[(1.0, 1.0), (1.0, 2.0)]).is_err());
    assert!(OffsetTrend::fit(&[(0.0, f64::NAN), (1.0, 2.0)]).is_err());
}

#[test]
fn batch_equals_stream_and_units_do_not_matter() {
    let c = config();
    for seed in 0..20 {
        let mut r = Drive::past(7, far, seed).run();
        let batch = estimate(&c, &r);
        let mut uwb = Uwb::new(c.clone()).unwrap();
        let mut markers = vec![];
        for k in 0..r.energies.len() {
            let e = uwb.push(r.energies[k], r.times[k], r.speeds[k]).unwrap();
            assert_eq!((e.lane_present, e.distance_m), (batch.lane_present[k], batch.distance_m[k]));
            if let EventKind::Marker(m) = e.kind {
                markers.push(m.pass.distance_m);
            }
        }
        assert_eq!(markers, batch.markers.iter().map(|m| m.pass.distance_m).collect::<Vec<_>>());
        // Watts instead of milliwatts, and a later clock.
        let watts = UwbConfig {
            threshold_energy: c.threshold_energy / 1024.0,
            release_energy: c.release_energy / 1024.0,
            ..c.clone()
        };
        r.energies.iter_mut().for_each(|e| *e /= 1024.0);
        r.times.iter_mut().for_each(|t| *t += 64.0);
        let other = estimate(&watts, &r);
        assert_eq!(other.markers.len(), batch.markers.len());
        for (a, b) in other.markers.iter().zip(&batch.markers) {
            assert!((a.pass.distance_m - b.pass.distance_m).abs() < 1e-6 && a.verdict == b.verdict);
            assert!((a.pass.time_s - 64.0 - b.pass.time_s).abs() < 1e-6);
        }
    }
}

#[test]
fn standstill_gap_and_long_metal() {
    let c = config();
    let high = 2.0 * c.threshold_energy;
    // A stop over a plate for an hour brings nothing and takes no room.
    let mut r = Drive::past(6, near, 8).run();
    let moving = estimate(&c, &r);
    let stop = r.road_m.iter().position(|x| *x > 26.0).unwrap();
    let (t, n) = (r.times[stop], 72_000);
    let at = stop + 1;
    r.times[at..].iter_mut().for_each(|t| *t += 3600.1);
    r.times.splice(at..at, (1..=n).map(|i| t + 0.05 * f64::from(i)));
    r.speeds.splice(at..at, (0..n).map(|_| 0.0));
    r.energies.splice(at..at, (0..n).map(|_| 9.0));
    r.ranges.clear();
    let mut uwb = Uwb::new(c.clone()).unwrap();
    let mut markers = 0;
    for k in 0..r.energies.len() {
        markers += usize::from(matches!(
            uwb.push(r.energies[k], r.times[k], r.speeds[k]).unwrap().kind,
            EventKind::Marker(_)
        ));
        assert!(uwb.held() < 80);
    }
    assert_eq!(markers, moving.markers.len());

    // A metal bridge deck of 30 m.
    let mut uwb = Uwb::new(c.clone()).unwrap();
    let mut long = 0;
    for i in 0..400 {
        let e = if (100..200).contains(&i) { high } else { FLOOR };
        match uwb.push(e, 0.05 * f64::from(i), 6.0).unwrap().kind {
            EventKind::TooLong { start_m } => {
                long += 1;
                assert!((start_m - 30.0).abs() < 0.31);
            }
            EventKind::Quiet => {}
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(long, 1);

    // Scans lost for 5 m in a lane.
    let r = Drive::past(8, near, 3).run();
    let mut uwb = Uwb::new(c).unwrap();
    let mut gaps = 0;
    for k in (0..r.energies.len()).filter(|k| !(30.0..35.0).contains(&r.road_m[*k])) {
        let e = uwb.push(r.energies[k], r.times[k], r.speeds[k]).unwrap();
        if let EventKind::Gap { step_m } = e.kind {
            gaps += 1;
            assert!(step_m > 4.0 && !e.lane_present);
        }
    }
    assert_eq!(gaps, 1);
}

#[test]
fn hostile_input_gives_a_reason() {
    let c = config();
    let mut uwb = Uwb::new(c.clone()).unwrap();
    assert!(uwb.finish().is_empty() && uwb.odometer().is_none());
    uwb.push(5.0, 1.0, 3.0).unwrap();
    for (e, t, v) in [
        (f64::NAN, 2.0, 1.0),
        (f64::INFINITY, 2.0, 1.0),
        (-1.0, 2.0, 1.0),
        (1.0, f64::NAN, 1.0),
        (1.0, 1.0, 1.0),
        (1.0, 0.0, 1.0),
        (1.0, 2.0, f64::NAN),
        (1.0, 2.0, -1.0),
        (1.0, 1e300, 1e300),
    ] {
        let why = uwb.push(e, t, v).unwrap_err().to_string();
        assert!(why.len() > 10 && !why.contains('\n'), "{why}");
        assert_eq!(uwb.distance_m(), 0.0);
    }
    assert!(uwb.push_with_range(1.0, Some(f64::NAN), 2.0, 1.0).is_err());
    let e = uwb.push(5.0, 2.0, 3.0).unwrap();
    assert_eq!((e.distance_m, e.kind), (3.0, EventKind::Quiet));

    let one = Uwb::estimate(c.clone(), &[9.0], &[], &[0.0], &[5.0]).unwrap();
    assert!(one.markers.is_empty() && one.lane_present == [false]);
    let still =
        Uwb::estimate(c.clone(), &[9.0; 50], &[], &(0..50).map(f64::from).collect::<Vec<_>>(), &[0.0; 50]);
    assert!(still.unwrap().markers.is_empty());
    assert!(Uwb::estimate(c.clone(), &[], &[], &[], &[]).is_err());
    assert!(Uwb::estimate(c.clone(), &[1.0; 3], &[], &[0.0; 2], &[1.0; 3]).is_err());
    assert!(Uwb::estimate(c.clone(), &[1.0; 2], &[1.0], &[0.0, 1.0], &[1.0; 2]).is_err());
    assert_eq!(
        Uwb::estimate(c.clone(), &[1.0; 2], &[], &[0.0, 0.0], &[1.0; 2]).unwrap_err().to_string(),
        "scan 1: scan time is 0; allowed: after the scan before"
    );
    for bad in [
        UwbConfig { spacing_m: f64::NAN, ..c.clone() },
        UwbConfig { plate_length_m: 9.0, ..c.clone() },
        UwbConfig { release_energy: 99.0, ..c.clone() },
        UwbConfig { max_spacing_error_m: 5.0, ..c.clone() },
        UwbConfig { hold_m: 0.0, ..c.clone() },
        UwbConfig { least_distance_m: 7.5, ..c.clone() },
        UwbConfig { confirm_spacings: 0, ..c.clone() },
        UwbConfig { misses_to_warn: 0, ..c.clone() },
        UwbConfig { trend_markers: 1, ..c.clone() },
        UwbConfig { offset: OffsetSource::Range { height_m: -1.0 }, ..c.clone() },
    ] {
        assert!(Uwb::new(bad.clone()).is_err(), "{bad:?}");
    }
    assert!(spacing_errors(&[]).is_err() && spacing_errors(&[f64::NAN]).is_err());
    assert!(score_run(&one, &[1.0, 0.5], 0.3, 8.0, 1.0).is_err());
    assert_eq!(score_run(&one, &[], 0.3, 8.0, 1.0).unwrap().marker_rate(), None);

    // Any numbers at all: no panic, bounded state, finite results.
    for seed in 0..200 {
        let mut rng = Rng(seed);
        let centre = [Centre::Maximum, Centre::Centroid, Centre::Edges, Centre::Matched][seed as usize % 4];
        let offset = OffsetSource::Range { height_m: 1.0 };
        let mut uwb = Uwb::new(UwbConfig { centre, misses_to_warn: 3, offset, ..c.clone() }).unwrap();
        let mut t = 0.0;
        for _ in 0..3000 {
            t += 10_f64.powf(rng.between(-6.0, 0.0));
            let mut wild = || match (rng.uniform() * 12.0) as usize {
                0 => f64::NAN,
                1 => f64::MAX,
                2 => 1e-308,
                3 => 0.0,
                _ => 10.0 * rng.uniform(),
            };
            let (e, range, v) = (wild(), wild(), wild());
            if let Ok(event) = uwb.push_with_range(e, Some(range), t, v.min(1e6)) {
                assert!(event.distance_m.is_finite());
                if let EventKind::Marker(m) = event.kind {
                    let p = m.pass;
                    assert!(p.distance_m.is_finite() && p.time_s.is_finite() && p.mean_energy.is_finite());
                    assert!(p.distance_m >= p.start_m - 1e-9 && p.distance_m <= p.end_m + 1e-9, "{p:?}");
                }
            }
            assert!(uwb.held() < 8000);
        }
        uwb.finish();
    }
}

#[test]
fn one_scan_is_cheap() {
    let c = config();
    let r = Drive::past(2000, near, 1).run();
    let mut uwb = Uwb::new(c).unwrap();
    let start = std::time::Instant::now();
    let mut closing = vec![];
    for k in 0..r.energies.len() {
        let scan = std::time::Instant::now();
        if let EventKind::Marker(_) = uwb.push(r.energies[k], r.times[k], r.speeds[k]).unwrap().kind {
            closing.push(scan.elapsed().as_secs_f64());
        }
    }
    closing.sort_by(f64::total_cmp);
    let close = closing[closing.len() / 2];
    let mean = start.elapsed().as_secs_f64() / r.energies.len() as f64;
    println!(
        "push: mean {:.2} us, median when a pass ends {:.0} us, {} scans",
        mean * 1e6,
        close * 1e6,
        r.energies.len()
    );
    let row = vec![0.1; 1536];
    let axis = RangeAxis::from_time(4e-9, 23.328e9).unwrap();
    let gate = RangeGate::from_marked_lane(&KIM).unwrap();
    let start = std::time::Instant::now();
    let sum: f64 = (0..1000).map(|_| gate.echo(&row, &axis).unwrap().energy).sum();
    println!("echo of 1536 samples: {:.2} us ({sum:.0})", start.elapsed().as_secs_f64() * 1e3);
    assert!(mean < 1e-3);
}
