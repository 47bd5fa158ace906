//! The UWB method behind the interface of all lane estimators, with scans of one radar ([`UwbLanes`]) or of a
//! left and a right one ([`UwbLanes::pair`]), from any source.

use crate::curve::{Clothoid, Fitted, Shape};
use crate::error::{LaneError, checked, finite};
use crate::side::Side;
use crate::uwb::{Event, EventKind, GateEcho, RangeAxis, RangeGate, Uwb, UwbConfig, Verdict};
use crate::{LaneEstimate, LaneEstimator, Line, Measured, SensorInput};

/// The method's name, as on the command line.
pub const METHOD: &str = "uwb";

/// The mean scan of a road without markers. Subtracted from each scan, it removes what is always there: the
/// mirror reflection of a flat road under the radar, which may be hundreds of times as strong as a marker
/// beside it.
///
/// It is valid as long as radar, height and road stay the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Background {
    mean: Vec<f64>,
}

impl Background {
    /// Averages scans of equal length.
    ///
    /// # Errors
    /// Returns an error if there is no scan, if lengths differ, or if a sample is non-finite.
    pub fn of<'a>(scans: impl IntoIterator<Item = &'a [f64]>) -> Result<Background, LaneError> {
        let mut mean: Vec<f64> = Vec::new();
        let mut count = 0.0;
        for scan in scans {
            if count == 0.0 {
                mean = vec![0.0; scan.len()];
            }
            if scan.len() != mean.len() {
                let (found, expected) = (scan.len(), mean.len());
                return Err(LaneError::Lengths { what: "samples of a scan", found, expected });
            }
            if let Some(i) = scan.iter().position(|v| !v.is_finite()) {
                return Err(LaneError::NotANumber { what: "sample", index: Some(i) });
            }
            count += 1.0;
            mean.iter_mut().zip(scan).for_each(|(m, v)| *m += (v - *m) / count);
        }
        match mean.is_empty() {
            true => Err(LaneError::Missing { what: "scans" }),
            false => Ok(Background { mean }),
        }
    }

    /// Mean scan, one value per sample.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Subtracts the background from a scan.
    ///
    /// # Errors
    /// Returns an error if the scan has another length.
    pub fn taken_from(&self, scan: &[f64]) -> Result<Vec<f64>, LaneError> {
        if scan.len() != self.mean.len() {
            let (found, expected) = (scan.len(), self.mean.len());
            return Err(LaneError::Lengths { what: "samples of a scan", found, expected });
        }
        Ok(scan.iter().zip(&self.mean).map(|(v, m)| v - m).collect())
    }
}

/// What [`UwbLanes`] works with for one radar, as [`super::Tuning`] makes it.
#[derive(Debug, Clone, PartialEq)]
pub struct UwbSetup {
    /// Range axis of the samples of [`SensorInput::pulse`].
    pub axis: RangeAxis,
    /// Ranges over which echoes are summed.
    pub gate: RangeGate,
    /// Background that is subtracted from each scan first; None takes the scans as they are, as Kim does.
    pub background: Option<Background>,
    /// Settings of the search for markers.
    pub config: UwbConfig,
    /// Side of the line that the radar observes.
    pub side: Side,
    /// Position of the radar in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    /// Standard deviation of the lateral distance that [`UwbConfig::offset`] gives, m.
    pub offset_std_m: f64,
    /// Width of the lane, m. Without it a single line does not tell the vehicle's position in its lane.
    pub lane_width_m: Option<f64>,
}

impl UwbSetup {
    fn check(&self) -> Result<(), LaneError> {
        RangeGate::new(self.gate.min_m, self.gate.max_m)?;
        checked("standard deviation of the offset", self.offset_std_m, self.offset_std_m > 0.0, "above 0 m")?;
        if let Some(w) = self.lane_width_m {
            checked("lane width", w, w > 0.0, "above 0 m")?;
        }
        finite("position of the radar", self.at_m[0] + self.at_m[1]).map(|_| ())
    }

    /// Energy and strongest range of a scan, Kim (6).
    ///
    /// # Errors
    /// Returns an error for an empty scan, non-finite samples, a scan of another length than the background,
    /// or samples that do not cover the gate.
    pub fn echo(&self, scan: &[f64]) -> Result<GateEcho, LaneError> {
        if scan.is_empty() {
            return Err(LaneError::Empty);
        }
        let wrong = scan.iter().filter(|v| !v.is_finite()).count();
        if wrong > 0 {
            return Err(LaneError::NotFinite { points: wrong });
        }
        match &self.background {
            None => self.gate.echo(scan, &self.axis),
            Some(b) => self.gate.echo(&b.taken_from(scan)?, &self.axis),
        }
    }

    /// The course of the line by the last markers; None where they gave no offset.
    fn course(&self, uwb: &Uwb) -> Option<Course> {
        let mut last = uwb.offsets_since();
        let (since_m, offset_m) = last.next()?;
        let before = last.next().map(|(road_m, offset_m)| (road_m - since_m, offset_m));
        Some(Course::of(offset_m, since_m, before, self.offset_std_m, self.config.spacing_m))
    }

    /// The line that the radar has seen: from the marker before the last one to where the next one is due, or
    /// to the radar if that is farther. Nothing is known beyond; after the last marker the standard deviation
    /// grows.
    fn line(&self, course: &Course, confidence: f64) -> Line {
        let y_m = self.at_m[1] + self.side.sign() * course.at_radar_m();
        let heading_rad = self.side.sign() * course.slope.atan();
        let behind = glam::DVec2::from_angle(heading_rad) * (course.apart_m + course.since_m);
        let curve = Clothoid {
            start_m: [self.at_m[0] - behind.x, y_m - behind.y],
            heading_rad,
            curvature_per_m: 0.0,
            curvature_rate_per_m2: 0.0,
            length_m: course.apart_m + self.config.spacing_m.max(course.since_m),
        };
        let mut covariance = [[0.0; 4]; 4];
        covariance[0][0] = course.variance(-course.apart_m);
        covariance[1][1] = course.slope_variance;
        let across = course.covariance - course.apart_m * course.slope_variance;
        (covariance[0][1], covariance[1][0]) = (across, across);
        let fitted = Fitted { curve, shape: Shape::Line, covariance, residual: 1.0 };
        Line { fitted, confidence, members: Vec::new() }
    }

    /// Heading of the vehicle relative to the line, rad, positive to the left; None before two markers.
    fn heading(&self, course: &Course) -> Option<Measured> {
        let value = -self.side.sign() * course.slope.atan();
        course.two.then(|| Measured { value, std: course.slope_variance.sqrt() })
    }

    /// Distance of the line from the vehicle's reference point towards the radar's side, m.
    fn beside_vehicle(&self, course: &Course) -> Measured {
        let turn = course.slope.atan();
        let from_radar_m = course.at_radar_m() + self.side.sign() * self.at_m[1];
        let value = from_radar_m * turn.cos() - self.at_m[0] * turn.sin();
        Measured { value, std: course.variance(course.since_m - self.at_m[0]).sqrt() }
    }
}

/// Standard deviation of a vehicle's heading relative to its lane before markers tell it, rad: a degree,
/// which is 0.24 m/s to the side at 50 km/h.
const HEADING_STD_RAD: f64 = 0.0175;

/// A straight line by the last two markers and the prior of vehicles' headings; more markers lie too far back
/// for a vehicle that sways. Offsets are towards the line.
#[derive(Debug, Clone, Copy)]
struct Course {
    /// Offset at the last marker, m.
    offset_m: f64,
    /// Road since the last marker, m.
    since_m: f64,
    /// Distance from the marker before, or from where it would be, m.
    apart_m: f64,
    /// Slope, metres of offset per metre of road.
    slope: f64,
    /// Whether two markers determined it.
    two: bool,
    offset_variance: f64,
    slope_variance: f64,
    covariance: f64,
}

impl Course {
    /// Makes the course from the offset at the last marker, the road since, and the offset at the marker
    /// before with the road from there: the most probable line when each offset has the standard deviation
    /// `std_m`.
    fn of(last_m: f64, since_m: f64, before: Option<(f64, f64)>, std_m: f64, spacing_m: f64) -> Course {
        let (variance, turn) = (std_m * std_m, HEADING_STD_RAD * HEADING_STD_RAD);
        let alone = Course {
            offset_m: last_m,
            since_m,
            apart_m: spacing_m,
            slope: 0.0,
            two: false,
            offset_variance: variance,
            slope_variance: turn,
            covariance: 0.0,
        };
        let Some((apart_m, before_m)) = before else { return alone };
        // The marker before measures last - slope x apart, with the variances of both.
        let surprise = last_m - before_m;
        let spread = 2.0 * variance + apart_m * apart_m * turn;
        let (gain, slope_gain) = (variance / spread, apart_m * turn / spread);
        Course {
            offset_m: last_m - gain * surprise,
            apart_m,
            slope: slope_gain * surprise,
            two: true,
            offset_variance: variance * (1.0 - gain),
            slope_variance: turn * (1.0 - slope_gain * apart_m),
            covariance: gain * apart_m * turn,
            ..alone
        }
    }

    fn at_radar_m(&self) -> f64 {
        self.offset_m + self.slope * self.since_m
    }

    /// Variance of the offset at `beyond_m` after the last marker, m².
    fn variance(&self, beyond_m: f64) -> f64 {
        self.offset_variance + beyond_m * (2.0 * self.covariance + beyond_m * self.slope_variance)
    }
}

/// Largest speed of a vehicle, m/s; a larger one is an error.
const FASTEST_MPS: f64 = 150.0;

/// Bus speed of a look, m/s. Fails if there is none or if it is larger than any vehicle's.
fn speed(input: &SensorInput<'_>) -> Result<f64, LaneError> {
    let value = input.speed_mps.ok_or(LaneError::NoSpeed)?.value;
    match value > FASTEST_MPS {
        true => Err(LaneError::refused(format!("speed is {value} m/s; allowed: up to {FASTEST_MPS} m/s"))),
        false => Ok(value),
    }
}

/// Number of samples in all scans of a look.
fn given(input: &SensorInput<'_>) -> usize {
    input.scans.iter().map(|s| s.samples.len()).sum::<usize>() + input.pulse.map_or(0, <[f64]>::len)
}

/// Processes all scans of a look in order and returns the result of the last.
fn all_scans(
    input: &SensorInput<'_>,
    mut take: impl FnMut(&SensorInput<'_>) -> Result<LaneEstimate, LaneError>,
) -> LaneEstimate {
    let mut last = None;
    for s in input.scans {
        let own = SensorInput {
            time_s: s.time_s,
            speed_mps: s.speed_mps,
            pulse: Some(&s.samples),
            ..SensorInput::default()
        };
        last = Some(take(&own));
    }
    let answer = match last {
        Some(answer) if input.pulse.is_none() => answer,
        _ => take(input),
    };
    let mut estimate =
        answer.unwrap_or_else(|why| LaneEstimate::none(METHOD, input.time_s, given(input), why));
    (estimate.time_s, estimate.provenance.given) = (input.time_s, given(input));
    estimate
}

/// History of passes, which tells why there is no lane at present.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct PassHistory {
    passes: usize,
    /// Number of successive right spacings on which the lane rests.
    chain: usize,
    /// Distance at which the missing marker was due, m.
    left_at_m: Option<f64>,
    /// Number of passes that did not end within a spacing, since the last that did.
    endless: usize,
}

impl PassHistory {
    fn take(&mut self, event: &Event) {
        match &event.kind {
            EventKind::Marker(m) => {
                (self.passes, self.endless) = (self.passes + 1, 0);
                if m.verdict == Verdict::Lane {
                    (self.chain, self.left_at_m) = (self.chain + 1, None);
                }
            }
            EventKind::Departure(d) => (self.chain, self.left_at_m) = (0, Some(d.expected_m)),
            EventKind::Gap { .. } => *self = PassHistory::default(),
            EventKind::TooLong { .. } => self.endless += 1,
            EventKind::Quiet | EventKind::Isolated(_) => {}
        }
    }

    fn why_not(&self, spacing_m: f64) -> String {
        match (self.left_at_m, self.passes) {
            _ if self.endless > 0 => format!(
                "no plates at the spacing of {spacing_m} m: energies exceed the threshold for a longer distance; the gate contains something other than plates, or the threshold is for another road"
            ),
            (Some(at), _) => {
                format!("no plates at the spacing of {spacing_m} m: the one expected at {at:.1} m is missing")
            }
            (None, 0) => {
                format!("no plates at the spacing of {spacing_m} m: no energy exceeds the threshold")
            }
            (None, n) => {
                format!(
                    "no plates at the spacing of {spacing_m} m: {n} passes over metal, but none at this spacing after another"
                )
            }
        }
    }

    /// One right spacing may be chance, many are not.
    fn confidence(&self) -> f64 {
        let n = self.chain.max(1) as f64;
        n / (n + 1.0)
    }
}

/// A radar and the state from its scans so far.
#[derive(Debug, Clone)]
struct Radar {
    options: UwbSetup,
    uwb: Uwb,
    story: PassHistory,
}

impl Radar {
    fn new(options: UwbSetup) -> Result<Radar, LaneError> {
        options.check()?;
        Ok(Radar { uwb: Uwb::new(options.config.clone())?, options, story: PassHistory::default() })
    }
}

/// Finds the lane by one radar and one line, or by a left and a right radar of the same kind.
/// [`SensorInput::pulse`] and each of [`SensorInput::scans`] hold one scan, or the left scan followed by the
/// right one, equally long.
#[derive(Debug, Clone)]
pub struct UwbLanes {
    /// One radar, or left and right.
    radars: Vec<Radar>,
    lane_width_m: Option<f64>,
    event: Option<Event>,
}

impl UwbLanes {
    /// Makes the estimator for one radar.
    ///
    /// # Errors
    /// Returns an error for the first option that is out of range or contradicts another.
    pub fn new(options: UwbSetup) -> Result<UwbLanes, LaneError> {
        let lane_width_m = options.lane_width_m;
        Ok(UwbLanes { radars: vec![Radar::new(options)?], lane_width_m, event: None })
    }

    /// Makes the estimator for a left and a right radar.
    ///
    /// # Errors
    /// Returns an error for an option out of range or in contradiction to another, for a right radar that is
    /// left of the left one, or for a missing lane width.
    pub fn pair(left: UwbSetup, right: UwbSetup) -> Result<UwbLanes, LaneError> {
        let width_m = left.lane_width_m.or(right.lane_width_m);
        let width_m = width_m.ok_or(LaneError::Missing { what: "lane width" })?;
        let span_m = left.at_m[1] - right.at_m[1];
        let radars = vec![
            Radar::new(UwbSetup { side: Side::Left, ..left })?,
            Radar::new(UwbSetup { side: Side::Right, ..right })?,
        ];
        checked(
            "distance between the radars",
            span_m,
            (0.0..=width_m).contains(&span_m),
            "0 m to the lane width",
        )?;
        Ok(UwbLanes { radars, lane_width_m: Some(width_m), event: None })
    }

    /// Event of the last scan, of two radars the right one's; None when the scan was refused.
    pub fn event(&self) -> Option<&Event> {
        self.event.as_ref()
    }

    /// The first radar's state: passes, odometer, trend, distance.
    pub fn core(&self) -> &Uwb {
        &self.radars[0].uwb
    }

    fn taken(&mut self, input: &SensorInput<'_>) -> Result<LaneEstimate, LaneError> {
        self.event = None;
        let samples =
            input.pulse.ok_or_else(|| LaneError::NotGiven { what: "a scan of an impulse radar".into() })?;
        let count = self.radars.len();
        if samples.is_empty() {
            return Err(LaneError::Empty);
        }
        if samples.len() % count != 0 {
            return Err(LaneError::refused(format!(
                "{} samples cannot be divided into two scans",
                samples.len()
            )));
        }
        let scans = samples.chunks(samples.len() / count);
        let echoes: Vec<GateEcho> =
            self.radars.iter().zip(scans).map(|(r, scan)| r.options.echo(scan)).collect::<Result<_, _>>()?;
        let speed_mps = speed(input)?;
        // If either scan is refused, neither is taken.
        for (r, e) in self.radars.iter().zip(&echoes) {
            r.uwb.check_scan(e.energy, e.strongest_range_m, input.time_s, speed_mps)?;
        }
        for (r, e) in self.radars.iter_mut().zip(echoes) {
            let event = r.uwb.push_with_range(e.energy, e.strongest_range_m, input.time_s, speed_mps)?;
            r.story.take(&event);
            self.event = Some(event);
        }
        let last = &self.radars[count - 1];
        // From right to left.
        let there: Vec<&Radar> = self.radars.iter().rev().filter(|r| r.uwb.lane_present()).collect();
        if there.is_empty() {
            return Err(LaneError::refused(last.story.why_not(last.options.config.spacing_m)));
        }
        // Without an offset the lane is present, but its position is unknown.
        let (mut lines, mut headings, mut asides) = (Vec::new(), Vec::new(), [None; 2]);
        for r in &there {
            let Some(course) = r.options.course(&r.uwb) else { continue };
            lines.push(r.options.line(&course, r.story.confidence()));
            headings.extend(r.options.heading(&course));
            asides[r.options.side.index()] = Some(r.options.beside_vehicle(&course));
        }
        let heading_rad = match count {
            1 => headings.first().copied(),
            _ => Measured::mean(headings.iter().copied()),
        };
        let beside = |line: Measured, towards: f64| {
            let value = towards * (0.5 * self.lane_width_m? - line.value);
            Some(Measured { value, std: line.std })
        };
        let (offset_m, width_m) = match asides {
            [Some(l), Some(r)] => {
                let std = l.std.hypot(r.std);
                let offset_m = Measured { value: 0.5 * (r.value - l.value), std: 0.5 * std };
                (Some(offset_m), Some(Measured { value: l.value + r.value, std }))
            }
            [Some(l), None] => (beside(l, 1.0), None),
            [None, Some(r)] => (beside(r, -1.0), None),
            [None, None] => (None, None),
        };
        let doubt = there.iter().fold(1.0, |doubt, r| doubt * (1.0 - r.story.confidence()));
        let mut out = LaneEstimate::empty(METHOD, input.time_s, samples.len());
        out.provenance.used = self.radars.iter().map(|r| r.story.chain).sum();
        (out.lines, out.width_m, out.offset_m, out.heading_rad) = (lines, width_m, offset_m, heading_rad);
        out.confidence = if count == 1 { last.story.confidence() } else { 1.0 - doubt };
        Ok(out)
    }
}

impl LaneEstimator for UwbLanes {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        all_scans(input, |scan| self.taken(scan))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PulseScan;
    use crate::uwb::{OffsetSource, Threshold};

    const STEP_M: f64 = 0.5;

    /// One sample in the gate beside a plate at this range, and another where there is none. Energies of the bare road are 0 to 1.
    fn lanes() -> UwbLanes {
        let threshold = Threshold::maximum(&[0.0, 1.0]).unwrap();
        let config = UwbConfig {
            offset: OffsetSource::Range { height_m: 1.32 },
            ..UwbConfig::new(8.0, 3.0, &threshold).unwrap()
        };
        UwbLanes::new(UwbSetup {
            axis: RangeAxis { start_m: 1.0, step_m: 0.01 },
            gate: RangeGate::new(1.3, 2.0).unwrap(),
            background: None,
            config,
            side: Side::Right,
            at_m: [2.0, -0.95],
            offset_std_m: 0.1,
            lane_width_m: Some(3.5),
        })
        .unwrap()
    }

    /// Scans along a road with plates of 3 m from 2 m on, 8 m apart, at 10 m/s; the line comes nearer by `slope`.
    fn scans(to_m: f64, slope: f64, end_m: f64) -> Vec<PulseScan> {
        (0..(to_m / STEP_M) as usize)
            .map(|i| {
                let way_m = i as f64 * STEP_M;
                let mut samples = vec![0.0; 120];
                if (way_m - 2.0).rem_euclid(8.0) <= 3.0 && (2.0..end_m).contains(&way_m) {
                    let range_m = 1.32f64.hypot(1.0 - slope * way_m);
                    samples[((range_m - 1.0) / 0.01).round() as usize] = 3.0;
                }
                PulseScan {
                    time_s: way_m / 10.0,
                    speed_mps: Some(Measured { value: 10.0, std: 0.1 }),
                    samples,
                }
            })
            .collect()
    }

    fn one(s: &PulseScan) -> SensorInput<'_> {
        SensorInput {
            time_s: s.time_s,
            speed_mps: s.speed_mps,
            pulse: Some(&s.samples),
            ..SensorInput::default()
        }
    }

    #[test]
    fn scans_between_looks_are_taken_as_looks_are() {
        let all = scans(40.0, 0.0, 100.0);
        let (mut apart, mut together) = (lanes(), lanes());
        let mut last = None;
        for (k, group) in all.chunks(7).enumerate() {
            for s in group {
                last = Some(apart.estimate(&one(s)));
            }
            let time_s = group[group.len() - 1].time_s;
            // The look's own scan may be one of them, or come by itself.
            let own = if k % 2 == 0 { group.len() } else { group.len() - 1 };
            let own_look =
                group.get(own).map(one).unwrap_or(SensorInput { time_s, ..SensorInput::default() });
            let answer = together.estimate(&SensorInput { scans: &group[..own], ..own_look });
            let mut wanted = last.clone().unwrap();
            assert_eq!(answer.provenance.given, 120 * group.len());
            wanted.provenance.given = answer.provenance.given;
            assert_eq!(answer, wanted, "{k}");
        }
        assert!(last.unwrap().no_lane.is_none());
        let none = lanes().estimate(&SensorInput { time_s: 1.0, ..SensorInput::default() });
        assert!(matches!(none.no_lane, Some(LaneError::NotGiven { .. })), "{none:?}");
    }

    #[test]
    fn a_gate_that_something_else_fills_is_told() {
        let mut uwb = lanes();
        let mut why = Vec::new();
        for mut s in scans(30.0, 0.0, 100.0) {
            s.samples[90] = 5.0;
            why.push(uwb.estimate(&one(&s)).no_lane.map(|w| w.to_string()).unwrap_or_default());
        }
        assert!(why[0].contains("no energy exceeds the threshold"), "{}", why[0]);
        assert!(why[why.len() - 1].contains("something other than plates"), "{}", why[why.len() - 1]);
    }

    /// The slope of a line that comes nearer by 2 % follows from the two last markers as far as their
    /// standard deviations allow; the line ends where the next one is due.
    #[test]
    fn a_line_is_stated_as_far_as_it_was_seen() {
        let mut uwb = lanes();
        let last = scans(45.5, 0.02, 100.0).iter().map(|s| uwb.estimate(&one(s))).last().unwrap();
        // Last scan at 45 m, last middle at 43.5 m less the pass that is not complete: 35.5 m.
        let line = &last.lines[0].fitted;
        let end = line.curve.at(line.curve.length_m).at_m;
        assert!((line.curve.length_m - 17.5).abs() < 0.3, "{}", line.curve.length_m);
        assert!((end.x - 2.0).abs() < 0.1, "{end}");
        // Offsets 0.45 m and 0.29 m at 27.5 and 35.5 m.
        let slope = line.curve.heading_rad.tan();
        let spread = 2.0 * 0.01 + 64.0 * HEADING_STD_RAD * HEADING_STD_RAD;
        assert!((slope - 64.0 * HEADING_STD_RAD.powi(2) / spread * 0.02).abs() < 2e-3, "{slope}");
        let std = |x_m: f64| line.lateral_std_m(line.curve.foot(glam::DVec2::new(x_m, -1.2)).s_m);
        assert!(std(-7.5) < std(-3.0) && std(-3.0) < std(2.0) && std(2.0) > 0.14, "{}", std(2.0));
        let offset = last.offset_m.unwrap();
        assert!((offset.std - std(0.0)).abs() < 5e-3, "{} {}", offset.std, std(0.0));
        // Right of the radar by 0.1 m, which stands 0.95 m right of the middle, in a lane of 3.5 m.
        assert!((offset.value - (0.1 + 0.95 - 1.75)).abs() < 3.0 * offset.std, "{offset:?}");
    }

    /// Against the normal equations.
    #[test]
    fn the_course_is_the_most_probable_line() {
        let (std, apart, last, before) = (0.07, 9.0, 0.5, 0.9);
        let c = Course::of(last, 3.0, Some((apart, before)), std, 8.0);
        let (w, h) = (1.0 / (std * std), 1.0 / (HEADING_STD_RAD * HEADING_STD_RAD));
        let (a, b, d) = (2.0 * w, -apart * w, apart * apart * w + h);
        let det = a * d - b * b;
        let (r, s) = (w * (last + before), -apart * w * before);
        assert!((c.offset_m - (d * r - b * s) / det).abs() < 1e-12);
        assert!((c.slope - (a * s - b * r) / det).abs() < 1e-12);
        assert!((c.offset_variance - d / det).abs() < 1e-12 && (c.slope_variance - a / det).abs() < 1e-12);
        assert!((c.covariance + b / det).abs() < 1e-12);
        let alone = Course::of(last, 3.0, None, std, 8.0);
        assert!(!alone.two && alone.offset_m == last && alone.slope == 0.0 && alone.apart_m == 8.0);
        assert!((alone.variance(4.0) - (std * std + 16.0 / h)).abs() < 1e-12);
    }
}
