//! The method behind the interface of all lane estimators: scans of one radar ([`UwbLanes`]) or of a left and a right one
//! ([`UwbPairLanes`]), from any source.

use crate::lane::curve::{Clothoid, Fitted, Shape};
use crate::lane::uwb::{
    Event, EventKind, GateEcho, RangeAxis, RangeGate, Reason, Side, Uwb, UwbConfig, UwbPair, Verdict,
};
use crate::lane::{LaneEstimate, LaneEstimator, Line, Look, Measured, NoLane, Provenance};

/// As on the command line.
pub const METHOD: &str = "uwb";

/// The mean scan of a road without markers. Taken from each scan it leaves what is not always there: the mirror reflection of a
/// flat road under the radar is, and may be hundreds of times as strong as a marker beside it.
///
/// It holds while radar, height and road stay as they were.
#[derive(Debug, Clone, PartialEq)]
pub struct Background {
    mean: Vec<f64>,
}

impl Background {
    /// Of scans of equal length. Errors: no scans, other lengths, samples that are no numbers.
    pub fn of<'a>(scans: impl IntoIterator<Item = &'a [f64]>) -> Result<Background, Reason> {
        let mut mean: Vec<f64> = Vec::new();
        let mut count = 0.0;
        for scan in scans {
            if count == 0.0 {
                mean = vec![0.0; scan.len()];
            }
            if scan.len() != mean.len() {
                let (found, expected) = (scan.len(), mean.len());
                return Err(Reason::LengthMismatch { what: "samples of a scan", found, expected });
            }
            if let Some(i) = scan.iter().position(|v| !v.is_finite()) {
                return Err(Reason::NotFinite { what: "sample", index: Some(i) });
            }
            count += 1.0;
            mean.iter_mut().zip(scan).for_each(|(m, v)| *m += (v - *m) / count);
        }
        match mean.is_empty() {
            true => Err(Reason::Empty { what: "scans" }),
            false => Ok(Background { mean }),
        }
    }

    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The scan without the background. Errors: a scan of another length.
    pub fn taken_from(&self, scan: &[f64]) -> Result<Vec<f64>, Reason> {
        if scan.len() != self.mean.len() {
            let (found, expected) = (scan.len(), self.mean.len());
            return Err(Reason::LengthMismatch { what: "samples of a scan", found, expected });
        }
        Ok(scan.iter().zip(&self.mean).map(|(v, m)| v - m).collect())
    }
}

/// What one radar's scans mean.
#[derive(Debug, Clone, PartialEq)]
pub struct UwbOptions {
    /// Of the samples of [`Look::pulse`].
    pub axis: RangeAxis,
    pub gate: RangeGate,
    /// Taken from each scan first; None takes the scans as they are, as document K does.
    pub background: Option<Background>,
    pub config: UwbConfig,
    /// Of the line that the radar looks at.
    pub side: Side,
    /// Of the radar in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    /// Standard deviation of the lateral distance that [`UwbConfig::offset`] gives, m.
    pub offset_std_m: f64,
    /// Without it a single line does not tell where the vehicle is in its lane.
    pub lane_width_m: Option<f64>,
}

impl UwbOptions {
    fn check(&self) -> Result<(), Reason> {
        RangeGate::new(self.gate.min_m, self.gate.max_m)?;
        let above = |what: &'static str, value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(()),
            false if !value.is_finite() => Err(Reason::NotFinite { what, index: None }),
            false => Err(Reason::OutOfRange { what, value, allowed: "above 0 m" }),
        };
        above("standard deviation of the offset", self.offset_std_m)?;
        if let Some(w) = self.lane_width_m {
            above("lane width", w)?;
        }
        match self.at_m.iter().all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(Reason::NotFinite { what: "place of the radar", index: None }),
        }
    }

    /// Energy and strongest range of a scan, K (6).
    ///
    /// Errors: an empty scan, samples that are no numbers, samples that do not cover the gate.
    pub fn echo(&self, scan: &[f64]) -> Result<GateEcho, NoLane> {
        if scan.is_empty() {
            return Err(NoLane::Empty);
        }
        let wrong = scan.iter().filter(|v| !v.is_finite()).count();
        if wrong > 0 {
            return Err(NoLane::NotFinite { points: wrong });
        }
        match &self.background {
            None => self.gate.echo_real(scan, &self.axis).map_err(refused),
            Some(b) => {
                let rest = b.taken_from(scan).map_err(refused)?;
                self.gate.echo_real(&rest, &self.axis).map_err(refused)
            }
        }
    }

    /// The line, `offset_m` from the radar towards its side, from one spacing behind the radar to one ahead.
    fn line(&self, offset_m: f64, heading_rad: f64, confidence: f64) -> Line {
        let length_m = self.config.spacing_m;
        let y_m = self.at_m[1] + sign(self.side) * offset_m;
        let behind = glam::DVec2::from_angle(-heading_rad) * length_m;
        let curve = Clothoid {
            start_m: [self.at_m[0] - behind.x, y_m - behind.y],
            heading_rad: -heading_rad,
            curvature_per_m: 0.0,
            curvature_rate_per_m2: 0.0,
            length_m: 2.0 * length_m,
        };
        // Two markers, at the start and at the radar; beyond them the deviation grows.
        let variance = self.offset_std_m * self.offset_std_m;
        let mut covariance = [[0.0; 4]; 4];
        covariance[0][0] = variance;
        covariance[1][1] = 2.0 * variance / (length_m * length_m);
        (covariance[0][1], covariance[1][0]) = (-variance / length_m, -variance / length_m);
        let fitted = Fitted { curve, shape: Shape::Line, covariance, residual: 1.0 };
        Line { fitted, confidence, members: Vec::new() }
    }

    /// Of the vehicle against the line, positive left, by the trend of the offsets.
    fn heading(&self, uwb: &Uwb) -> Option<Measured> {
        let trend = uwb.offset_trend()?;
        let value = -sign(self.side) * trend.slope.atan();
        let n = trend.markers as f64;
        // Of a straight line through n markers one spacing apart, when their offsets have the stated deviation.
        let lever_m = self.config.spacing_m * ((n * n - 1.0) * n / 12.0).sqrt();
        Some(Measured { value, std: self.offset_std_m / lever_m })
    }
}

/// Positive to the left.
fn sign(side: Side) -> f64 {
    match side {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

fn refused(reason: Reason) -> NoLane {
    NoLane::Refused { why: reason.to_string() }
}

/// No vehicle is faster, m/s: a larger speed is a broken one.
const FASTEST_MPS: f64 = 150.0;

/// The bus speed of a look. Errors: none; one that no vehicle has.
fn speed(look: &Look<'_>) -> Result<f64, NoLane> {
    let value = look.speed_mps.ok_or(NoLane::NoSpeed)?.value;
    match value > FASTEST_MPS {
        true => {
            Err(NoLane::Refused { why: format!("speed is {value} m/s; allowed: up to {FASTEST_MPS} m/s") })
        }
        false => Ok(value),
    }
}

fn scan<'a>(look: &Look<'a>) -> Result<&'a [f64], NoLane> {
    look.pulse.ok_or_else(|| NoLane::NotGiven { what: "a scan of an impulse radar".into() })
}

/// Why there is no lane at present, from what has come so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Story {
    passes: usize,
    /// Right spacings in a row that the lane stands on.
    chain: usize,
    /// Distance at which the missing marker was due.
    left_at_m: Option<f64>,
}

impl Story {
    fn take(&mut self, event: &Event) {
        match &event.kind {
            EventKind::Marker(m) => {
                self.passes += 1;
                if m.verdict == Verdict::Lane {
                    (self.chain, self.left_at_m) = (self.chain + 1, None);
                }
            }
            EventKind::Departure(d) => (self.chain, self.left_at_m) = (0, Some(d.expected_m)),
            EventKind::Gap { .. } => *self = Story::default(),
            EventKind::Quiet | EventKind::Isolated(_) | EventKind::TooLong { .. } => {}
        }
    }

    fn why_not(&self, spacing_m: f64) -> String {
        match (self.left_at_m, self.passes) {
            (Some(at), _) => {
                format!("no plates at the spacing of {spacing_m} m: the one due at {at:.1} m did not come")
            }
            (None, 0) => format!("no plates at the spacing of {spacing_m} m: no pass over the threshold"),
            (None, n) => {
                format!(
                    "no plates at the spacing of {spacing_m} m: {n} passes over metal, none a spacing after another"
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

/// One radar and one line. [`Look::pulse`] is its scan.
#[derive(Debug, Clone)]
pub struct UwbLanes {
    options: UwbOptions,
    uwb: Uwb,
    story: Story,
    event: Option<Event>,
}

impl UwbLanes {
    /// Refuses options that contradict each other.
    pub fn new(options: UwbOptions) -> Result<UwbLanes, Reason> {
        options.check()?;
        let uwb = Uwb::new(options.config.clone())?;
        Ok(UwbLanes { options, uwb, story: Story::default(), event: None })
    }

    /// What the last look brought; None when it was refused.
    pub fn event(&self) -> Option<&Event> {
        self.event.as_ref()
    }

    /// The estimator itself: odometer, trend, distance.
    pub fn core(&self) -> &Uwb {
        &self.uwb
    }

    fn taken(&mut self, look: &Look<'_>) -> Result<LaneEstimate, NoLane> {
        let o = &self.options;
        let scan = scan(look)?;
        let echo = o.echo(scan)?;
        let speed_mps = speed(look)?;
        let event = self
            .uwb
            .push_with_range(echo.energy, echo.strongest_range_m, look.time_s, speed_mps)
            .map_err(refused)?;
        self.story.take(&event);
        self.event = Some(event);
        if !self.uwb.lane_present() {
            return Err(NoLane::Refused { why: self.story.why_not(o.config.spacing_m) });
        }
        let confidence = self.story.confidence();
        let offset = self.uwb.lateral_offset_m();
        let heading_rad = offset.and_then(|_| o.heading(&self.uwb));
        let turn = heading_rad.map_or(0.0, |h| h.value);
        // Without an offset the lane is there, and nobody knows where.
        let lines: Vec<Line> = offset.iter().map(|d| o.line(*d, turn, confidence)).collect();
        let offset_m = offset.zip(o.lane_width_m).map(|(d, width_m)| {
            let line_m = o.at_m[1] + sign(o.side) * d;
            Measured { value: -(line_m - sign(o.side) * 0.5 * width_m), std: o.offset_std_m }
        });
        Ok(found(look, scan.len(), self.story.chain, lines, offset_m, None, heading_rad, confidence))
    }
}

impl LaneEstimator for UwbLanes {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, look: &Look<'_>) -> LaneEstimate {
        self.event = None;
        let given = look.pulse.map_or(0, <[f64]>::len);
        self.taken(look).unwrap_or_else(|why| LaneEstimate::none(METHOD, look.time_s, given, why))
    }
}

#[expect(clippy::too_many_arguments, reason = "the fields of one struct, two callers")]
fn found(
    look: &Look<'_>,
    given: usize,
    used: usize,
    lines: Vec<Line>,
    offset_m: Option<Measured>,
    width_m: Option<Measured>,
    heading_rad: Option<Measured>,
    confidence: f64,
) -> LaneEstimate {
    LaneEstimate {
        time_s: look.time_s,
        lines,
        lane_number: None,
        width_m,
        offset_m,
        heading_rad,
        curvature_per_m: None,
        confidence,
        no_lane: None,
        mirror: false,
        provenance: Provenance { method: METHOD.into(), given, used },
    }
}

/// A left and a right radar of the same kind. [`Look::pulse`] holds the left one's scan and then the right one's, equally long.
#[derive(Debug, Clone)]
pub struct UwbPairLanes {
    /// Left, right.
    options: [UwbOptions; 2],
    pair: UwbPair,
    stories: [Story; 2],
    events: Option<[Event; 2]>,
}

impl UwbPairLanes {
    /// Refuses options that contradict each other, a right radar that is left of the left one, and a missing lane width.
    pub fn new(left: UwbOptions, right: UwbOptions) -> Result<UwbPairLanes, Reason> {
        left.check()?;
        right.check()?;
        let width_m = left.lane_width_m.or(right.lane_width_m).ok_or(Reason::Empty { what: "lane width" })?;
        let span_m = left.at_m[1] - right.at_m[1];
        let pair = UwbPair::new(left.config.clone(), right.config.clone(), span_m, width_m)?;
        Ok(UwbPairLanes {
            options: [UwbOptions { side: Side::Left, ..left }, UwbOptions { side: Side::Right, ..right }],
            pair,
            stories: [Story::default(); 2],
            events: None,
        })
    }

    /// What the last look brought, left and right; None when it was refused.
    pub fn events(&self) -> Option<&[Event; 2]> {
        self.events.as_ref()
    }

    pub fn core(&self) -> &UwbPair {
        &self.pair
    }

    fn taken(&mut self, look: &Look<'_>) -> Result<LaneEstimate, NoLane> {
        let both = scan(look)?;
        if both.is_empty() {
            return Err(NoLane::Empty);
        }
        if both.len() % 2 == 1 {
            return Err(NoLane::Refused { why: format!("{} samples are not two scans", both.len()) });
        }
        let (left, right) = both.split_at(both.len() / 2);
        let echoes = [self.options[0].echo(left)?, self.options[1].echo(right)?];
        let speed_mps = speed(look)?;
        let event = self
            .pair
            .push(echoes.map(|e| e.energy), echoes.map(|e| e.strongest_range_m), look.time_s, speed_mps)
            .map_err(refused)?;
        self.stories[0].take(&event.left);
        self.stories[1].take(&event.right);
        self.events = Some([event.left, event.right]);
        let sides = [&self.pair.left, &self.pair.right];
        let there = sides.map(Uwb::lane_present);
        if !there.contains(&true) {
            let why = self.stories[1].why_not(self.options[1].config.spacing_m);
            return Err(NoLane::Refused { why });
        }
        let mut lines = Vec::new();
        let mut headings = Vec::new();
        // From right to left.
        for i in [1, 0].into_iter().filter(|i| there[*i]) {
            let (o, uwb, story) = (&self.options[i], sides[i], &self.stories[i]);
            let Some(offset) = uwb.lateral_offset_m() else { continue };
            let heading = o.heading(uwb);
            lines.push(o.line(offset, heading.map_or(0.0, |h| h.value), story.confidence()));
            headings.extend(heading);
        }
        let weight: f64 = headings.iter().map(|h| h.std.powi(-2)).sum();
        let heading_rad = (!headings.is_empty()).then(|| Measured {
            value: headings.iter().map(|h| h.value * h.std.powi(-2)).sum::<f64>() / weight,
            std: weight.powf(-0.5),
        });
        let std = self.options[0].offset_std_m.hypot(self.options[1].offset_std_m);
        let middle_m = 0.5 * (self.options[0].at_m[1] + self.options[1].at_m[1]);
        let (mut offset_m, mut width_m) = (None, None);
        if let Some(place) = event.place {
            let alone = if lines.len() == 2 { 0.5 * std } else { self.options[0].offset_std_m };
            offset_m = Some(Measured { value: place.offset_left_m - middle_m, std: alone });
            width_m = (lines.len() == 2).then_some(Measured { value: place.lane_width_m, std });
        }
        let confidence = (0..2)
            .filter(|i| there[*i])
            .map(|i| self.stories[i].confidence())
            .fold(1.0, |missing, c| missing * (1.0 - c));
        let used = self.stories.iter().map(|s| s.chain).sum();
        Ok(found(look, both.len(), used, lines, offset_m, width_m, heading_rad, 1.0 - confidence))
    }
}

impl LaneEstimator for UwbPairLanes {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, look: &Look<'_>) -> LaneEstimate {
        self.events = None;
        let given = look.pulse.map_or(0, <[f64]>::len);
        self.taken(look).unwrap_or_else(|why| LaneEstimate::none(METHOD, look.time_s, given, why))
    }
}
