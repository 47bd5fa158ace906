//! Marker passes, their period, and the lane, scan by scan: Kim section 3.2.

use super::centre::{Centre, Sample, centroid_m, level_m, matched_m, time_at};
use super::{MarkerOdometer, OdometerReading, OffsetCurve, OffsetTrend, Threshold, offset_from_range_m};
use crate::error::{LaneError, checked};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Source of the lateral offset of a pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OffsetSource {
    /// No offset is estimated.
    None,
    /// The slant range of the strongest echo, for a radar at this height.
    Range {
        /// Height of the radar above the road, m.
        height_m: f64,
    },
    /// The mean energy of the pass, converted by this curve.
    Energy(OffsetCurve),
}

/// Settings of [`Uwb`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UwbConfig {
    /// Distance from one plate's start to the next one's, L_s, m.
    pub spacing_m: f64,
    /// Length of a plate, L_l, m.
    pub plate_length_m: f64,
    /// Energy above which a scan shows a marker.
    pub threshold_energy: f64,
    /// Energy at or below which scans must stay for `hold_m` to end a pass.
    pub release_energy: f64,
    /// Largest difference of the distance of two passes from the spacing, m, at which they belong together;
    /// scans far apart widen it. It is best set to the largest error of drives past known markers, with a
    /// margin.
    pub max_spacing_error_m: f64,
    /// Road at or below the release level that ends a pass, m; shorter dips are bridged.
    pub hold_m: f64,
    /// Least distance from the last marker of the lane at which a pass is a marker, m.
    pub least_distance_m: f64,
    /// Definition of the centre of a pass.
    pub centre: Centre,
    /// Number of successive correct spacings that confirm a lane.
    pub confirm_spacings: usize,
    /// Number of successive missed markers that raise the departure warning.
    pub misses_to_warn: usize,
    /// Number of markers in the offset trend.
    pub trend_markers: usize,
    /// Source of the lateral offset of a pass.
    pub offset: OffsetSource,
}

impl UwbConfig {
    /// Default settings for plates of this spacing and length. The release level lies midway between floor
    /// and threshold, the largest spacing error is a third of a plate, dips up to half a plate (or half a
    /// gap) are bridged, one right spacing makes a lane and one missed marker raises the warning.
    ///
    /// # Errors
    /// Returns an error if a setting is non-finite or outside its range.
    pub fn new(spacing_m: f64, plate_length_m: f64, threshold: &Threshold) -> Result<Self, LaneError> {
        let config = UwbConfig {
            spacing_m,
            plate_length_m,
            threshold_energy: threshold.energy,
            release_energy: threshold.release_energy(0.5)?,
            max_spacing_error_m: plate_length_m / 3.0,
            hold_m: (plate_length_m / 2.0).min((spacing_m - plate_length_m) / 2.0),
            least_distance_m: spacing_m / 2.0,
            centre: Centre::Matched,
            confirm_spacings: 1,
            misses_to_warn: 1,
            trend_markers: 4,
            offset: OffsetSource::None,
        };
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<(), LaneError> {
        let UwbConfig { spacing_m: l_s, plate_length_m: l_l, .. } = *self;
        checked("marker spacing", l_s, l_s > 0.0, "above 0 m")?;
        checked("plate length", l_l, l_l > 0.0 && l_l < l_s, "above 0 m, below the marker spacing")?;
        checked("threshold", self.threshold_energy, self.threshold_energy >= 0.0, "0 or more")?;
        let fits = self.release_energy >= 0.0 && self.release_energy <= self.threshold_energy;
        checked("release level", self.release_energy, fits, "0 to the threshold")?;
        let error_m = self.max_spacing_error_m;
        let fits = error_m > 0.0 && error_m <= l_s / 2.0;
        checked("largest spacing error", error_m, fits, "above 0 m, at most half the marker spacing")?;
        let fits = self.hold_m > 0.0 && self.hold_m < l_s - l_l;
        checked("hold distance", self.hold_m, fits, "above 0 m, below the gap between plates")?;
        let fits = self.least_distance_m >= 0.0 && self.least_distance_m <= l_s - error_m;
        let allowed = "0 m to the marker spacing less the largest error";
        checked("least distance", self.least_distance_m, fits, allowed)?;
        let within = |n: usize| (1..=1000).contains(&n);
        let confirm = self.confirm_spacings;
        checked("spacings that make a lane", confirm as f64, within(confirm), "1 to 1000")?;
        let misses = self.misses_to_warn;
        checked("missed markers that warn", misses as f64, within(misses), "1 to 1000")?;
        let trend = self.trend_markers;
        checked("markers in the trend", trend as f64, trend >= 2 && within(trend), "2 to 1000")?;
        if let OffsetSource::Range { height_m } = self.offset {
            checked("height of the radar", height_m, height_m > 0.0, "above 0 m")?;
        }
        Ok(())
    }

    /// Largest spacing error where scans lie `step_m` apart. Rise and fall of a pass are known to within a
    /// scan, which a spacing inherits from both its ends (3.5 standard deviations are a scan); steps up to
    /// [`WITHIN_ERROR`] of a plate are included in the given error.
    fn largest_error_m(&self, step_m: f64) -> f64 {
        let within_m = WITHIN_ERROR * self.plate_length_m;
        let more = (step_m * step_m - within_m * within_m).max(0.0);
        more.sqrt().hypot(self.max_spacing_error_m).min(0.5 * self.spacing_m)
    }

    /// Distance to the scan before below which a scan shows no new road, m.
    fn least_step_m(&self) -> f64 {
        self.plate_length_m / 1024.0
    }
}

/// Share of a plate: 20 scans a second at 30 km/h past plates of 3 m, the fastest of Kim.
const WITHIN_ERROR: f64 = 0.15;

/// One stretch of energies above the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MarkerPass {
    /// Time at which the radar passed the centre, s.
    pub time_s: f64,
    /// Position of the centre along the road by the speed input, m.
    pub distance_m: f64,
    /// Rise through the release level, m along the road.
    pub start_m: f64,
    /// Fall through the release level, m along the road.
    pub end_m: f64,
    /// Largest energy of the pass.
    pub peak_energy: f64,
    /// Mean energy over the plate's middle two thirds, around the centre.
    pub mean_energy: f64,
    /// Number of scans above the threshold.
    pub scans: usize,
    /// Root mean square of the strongest echo's range over those scans, m, when ranges were given.
    pub range_m: Option<f64>,
    /// Lateral distance to the marker, m, from [`UwbConfig::offset`].
    pub lateral_offset_m: Option<f64>,
}

/// The distance from an earlier marker to this one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spacing {
    /// Estimated distance to the earlier marker, m: L~_s of Kim (12) summed over the scans; it spans
    /// `intervals` spacings.
    pub estimate_m: f64,
    /// Number of spacings that it spans: above 1 when markers were missed.
    pub intervals: usize,
    /// Estimated minus true distance, m.
    pub error_m: f64,
}

/// Result of the period check of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// No earlier pass lies one spacing back. It may still start a lane.
    Unpaired,
    /// The pass is one spacing after an earlier pass, but these are too few for a lane yet.
    Paired,
    /// The pass is a marker of the lane.
    Lane,
    /// The pass is too close to the lane's last marker.
    TooNear,
}

/// A pass with the result of its period check.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MarkerReport {
    /// The pass.
    pub pass: MarkerPass,
    /// Result of the period check.
    pub verdict: Verdict,
    /// Spacing to the marker with which it was paired.
    pub spacing: Option<Spacing>,
    /// Distance to the pass just before, m, whatever it was.
    pub from_previous_m: Option<f64>,
}

/// A lane whose next marker is missing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Departure {
    /// Distance along the road of the lane's last marker, m.
    pub last_marker_m: f64,
    /// Position along the road where the last of the missing markers was due, m.
    pub expected_m: f64,
    /// Distance from there to this warning, m.
    pub delay_m: f64,
    /// Highest energy since the last marker's pass ended.
    pub peak_energy: f64,
    /// Trend of the offset up to the last marker: a positive slope leads away from this line into the lane.
    pub trend: Option<OffsetTrend>,
}

/// Kind of event of one scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum EventKind {
    /// Nothing new happened.
    Quiet,
    /// A pass is complete.
    Marker(MarkerReport),
    /// A pass found no partner one spacing before or after it: a manhole cover or the like.
    Isolated(MarkerPass),
    /// The lane departure warning is raised.
    Departure(Departure),
    /// Energies stayed above the release level for a whole spacing from `start_m`: no plate. Passes start
    /// again below that level.
    TooLong {
        /// Where the energies rose, m along the road.
        start_m: f64,
    },
    /// Two scans lay farther apart than a plate is long; the search restarts.
    Gap {
        /// Road between the two scans, m.
        step_m: f64,
    },
}

/// The event of one scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Event {
    /// Time of the scan at which it was known, s.
    pub time_s: f64,
    /// Distance along the road of that scan, m.
    pub distance_m: f64,
    /// Whether the lane is present after this scan.
    pub lane_present: bool,
    /// Kind of the event.
    pub kind: EventKind,
}

/// Results of a whole drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LaneEstimate {
    /// Reports of all passes in order.
    pub markers: Vec<MarkerReport>,
    /// All events but [`EventKind::Quiet`] and [`EventKind::Marker`], in order.
    pub events: Vec<Event>,
    /// For each scan whether the lane was known to be present after it.
    pub lane_present: Vec<bool>,
    /// Distance by the speed input at each scan, m.
    pub distance_m: Vec<f64>,
    /// Distance by counted markers at the end of the drive.
    pub odometer: Option<OdometerReading>,
}

impl LaneEstimate {
    /// The departure warnings of the drive.
    pub fn departures(&self) -> impl Iterator<Item = (&Event, &Departure)> {
        self.events.iter().filter_map(|e| match &e.kind {
            EventKind::Departure(d) => Some((e, d)),
            _ => None,
        })
    }
}

#[derive(Debug, Clone, Copy)]
struct OpenPass {
    /// Position of the first scan above the threshold, m.
    first_m: f64,
    /// Position of the last scan above the release level, m.
    last_m: f64,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    pass: MarkerPass,
    /// Number of successive spacings that end here.
    chain: usize,
    /// Position where that row began, m.
    chain_start_m: f64,
    has_next: bool,
}

/// Finds the lane scan by scan. State and time per scan are bounded.
#[derive(Debug, Clone)]
pub struct Uwb {
    config: UwbConfig,
    /// Time, speed and distance of the last scan, in s, m/s and m.
    last: Option<(f64, f64, f64)>,
    samples: VecDeque<Sample>,
    open: Option<OpenPass>,
    /// Whether a pass that is too long is going on.
    blocked: bool,
    candidates: Vec<Candidate>,
    previous_m: Option<f64>,
    /// Position of the last marker of the lane while it is present, m.
    lane_marker_m: Option<f64>,
    /// Position of the last marker of a lane that the last warning ended, m.
    left_marker_m: Option<f64>,
    /// Distance between the last two scans, m.
    step_m: f64,
    quiet_peak: f64,
    offsets: VecDeque<(f64, f64)>,
    odometer: MarkerOdometer,
    pending: VecDeque<EventKind>,
}

impl Uwb {
    /// Makes a detector that has taken no scan yet.
    ///
    /// # Errors
    /// Returns an error if a setting is non-finite, outside its range or in contradiction to another.
    pub fn new(config: UwbConfig) -> Result<Self, LaneError> {
        config.check()?;
        let odometer = MarkerOdometer::new(config.spacing_m, config.max_spacing_error_m)?;
        Ok(Uwb {
            config,
            last: None,
            samples: VecDeque::new(),
            open: None,
            blocked: false,
            candidates: Vec::new(),
            previous_m: None,
            lane_marker_m: None,
            left_marker_m: None,
            step_m: 0.0,
            quiet_peak: 0.0,
            offsets: VecDeque::new(),
            odometer,
            pending: VecDeque::new(),
        })
    }

    /// Whether the lane is present: from the scan that completes the first right spacings until the departure
    /// warning.
    pub fn lane_present(&self) -> bool {
        self.lane_marker_m.is_some()
    }

    /// Road since the first scan by the speed input, m.
    pub fn distance_m(&self) -> f64 {
        self.last.map_or(0.0, |l| l.2)
    }

    /// Distance by counted markers; `None` before the first lane marker.
    pub fn odometer(&self) -> Option<OdometerReading> {
        self.odometer.reading(self.distance_m())
    }

    /// Trend of the offsets of the lane's last markers; `None` with fewer than two.
    pub fn offset_trend(&self) -> Option<OffsetTrend> {
        OffsetTrend::fit(&self.offsets.iter().copied().collect::<Vec<_>>()).ok()
    }

    /// Pairs of road since each of the lane's last markers and the offset there, m, the last marker first.
    pub fn offsets_since(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.offsets.iter().rev().map(|o| (self.distance_m() - o.0, o.1))
    }

    /// Takes one scan: its energy in the gate, its time (s) and the vehicle's speed (m/s). Times must rise
    /// and speeds must not be negative. A refused scan leaves the state unchanged. When one scan brings two
    /// events, the second is returned with the next scan.
    ///
    /// # Errors
    /// Returns an error if a value is non-finite or negative, or if the time does not rise.
    pub fn push(&mut self, scan_energy: f64, time_s: f64, speed_mps: f64) -> Result<Event, LaneError> {
        self.push_with_range(scan_energy, None, time_s, speed_mps)
    }

    /// Takes a scan as [`Uwb::push`] does, with the range (m) of the gate's strongest echo for
    /// [`OffsetSource::Range`].
    ///
    /// # Errors
    /// Returns an error as [`Uwb::push`] does, or if the range is not positive.
    pub fn push_with_range(
        &mut self,
        scan_energy: f64,
        range_m: Option<f64>,
        time_s: f64,
        speed_mps: f64,
    ) -> Result<Event, LaneError> {
        let (step_m, distance_m) = self.check_scan(scan_energy, range_m, time_s, speed_mps)?;
        self.last = Some((time_s, speed_mps, distance_m));
        let since_used = self.samples.back().map(|s| distance_m - s.distance_m);
        if since_used.is_none_or(|d| d >= self.config.least_step_m()) {
            if since_used.is_some_and(|d| d > self.config.plate_length_m) {
                self.restart(step_m);
            }
            self.step_m = since_used.unwrap_or(0.0);
            self.samples.push_back(Sample { time_s, distance_m, energy: scan_energy, range_m });
            self.take_sample();
        }
        let kind = self.pending.pop_front().unwrap_or(EventKind::Quiet);
        Ok(Event { time_s, distance_m, lane_present: self.lane_present(), kind })
    }

    /// Step and distance to this scan (m), or the reason why it is refused.
    pub(super) fn check_scan(
        &self,
        scan_energy: f64,
        range_m: Option<f64>,
        time_s: f64,
        speed_mps: f64,
    ) -> Result<(f64, f64), LaneError> {
        checked("scan energy", scan_energy, scan_energy >= 0.0, "0 or more")?;
        checked("speed", speed_mps, speed_mps >= 0.0, "0 m/s or more")?;
        checked("scan time", time_s, self.last.is_none_or(|l| time_s > l.0), "after the scan before")?;
        if let Some(r) = range_m {
            checked("range of the strongest echo", r, r > 0.0, "above 0 m")?;
        }
        let step_m = self.last.map_or(0.0, |(t, v, _)| (v + speed_mps) / 2.0 * (time_s - t));
        let distance_m = checked("distance", self.distance_m() + step_m, true, "")?;
        Ok((step_m, distance_m))
    }

    /// Returns the events that no scan has returned yet. A pass that the end of the record cuts off is
    /// dropped.
    pub fn finish(&mut self) -> Vec<Event> {
        let Some((time_s, _, distance_m)) = self.last else {
            return Vec::new();
        };
        if let (Some(open), Some(back)) = (self.open.take(), self.samples.back())
            && back.distance_m > open.last_m
        {
            self.close(open);
        }
        let lane_present = self.lane_present();
        let pending = std::mem::take(&mut self.pending);
        pending.into_iter().map(|kind| Event { time_s, distance_m, lane_present, kind }).collect()
    }

    /// Processes a whole drive at once, as [`Uwb::push_with_range`] does scan by scan. `ranges_m` is empty or
    /// holds one value per scan; NaN means no range.
    ///
    /// # Errors
    /// Returns an error for an invalid setting, no scan, lists of different lengths, or the first invalid
    /// scan.
    pub fn estimate(
        config: UwbConfig,
        energies: &[f64],
        ranges_m: &[f64],
        times_s: &[f64],
        speeds_mps: &[f64],
    ) -> Result<LaneEstimate, LaneError> {
        let n = energies.len();
        if n == 0 {
            return Err(LaneError::Missing { what: "scan energies" });
        }
        for (what, found) in [("scan times", times_s.len()), ("speeds", speeds_mps.len())] {
            if found != n {
                return Err(LaneError::Lengths { what, found, expected: n });
            }
        }
        if !ranges_m.is_empty() && ranges_m.len() != n {
            return Err(LaneError::Lengths { what: "ranges", found: ranges_m.len(), expected: n });
        }
        let mut uwb = Uwb::new(config)?;
        let mut result = LaneEstimate {
            markers: Vec::new(),
            events: Vec::new(),
            lane_present: Vec::with_capacity(n),
            distance_m: Vec::with_capacity(n),
            odometer: None,
        };
        let sort = |event: Event, result: &mut LaneEstimate| match event.kind {
            EventKind::Quiet => {}
            EventKind::Marker(report) => result.markers.push(report),
            _ => result.events.push(event),
        };
        for i in 0..n {
            let range_m = ranges_m.get(i).copied().filter(|r| !r.is_nan());
            let event = uwb
                .push_with_range(energies[i], range_m, times_s[i], speeds_mps[i])
                .map_err(|r| LaneError::refused(format!("scan {i}: {r}")))?;
            result.lane_present.push(event.lane_present);
            result.distance_m.push(event.distance_m);
            sort(event, &mut result);
        }
        for event in uwb.finish() {
            sort(event, &mut result);
        }
        result.odometer = uwb.odometer();
        Ok(result)
    }

    /// Number of items kept in memory.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.samples.len() + self.candidates.len() + self.pending.len() + self.offsets.len()
    }

    /// After a gap the phase of the markers is not trusted.
    fn restart(&mut self, step_m: f64) {
        self.samples.clear();
        self.open = None;
        self.blocked = false;
        self.candidates.clear();
        self.previous_m = None;
        (self.lane_marker_m, self.left_marker_m) = (None, None);
        self.quiet_peak = 0.0;
        self.offsets.clear();
        self.pending.push_back(EventKind::Gap { step_m });
    }

    fn take_sample(&mut self) {
        let Some(&now) = self.samples.back() else { return };
        let (threshold, release) = (self.config.threshold_energy, self.config.release_energy);
        match &mut self.open {
            Some(open) => {
                if now.energy > release {
                    open.last_m = now.distance_m;
                }
                let open = *open;
                if now.distance_m - open.last_m >= self.config.hold_m {
                    self.open = None;
                    self.close(open);
                } else if open.last_m - open.first_m > self.config.spacing_m {
                    self.open = None;
                    self.blocked = true;
                    self.pending.push_back(EventKind::TooLong { start_m: open.first_m });
                }
            }
            None => {
                self.quiet_peak = self.quiet_peak.max(now.energy);
                if now.energy <= release {
                    self.blocked = false;
                }
                if now.energy > threshold && !self.blocked {
                    self.open = Some(OpenPass { first_m: now.distance_m, last_m: now.distance_m });
                }
            }
        }
        self.check_departure(now.distance_m);
        self.expire_candidates(now.distance_m);
        let oldest_m = self.open.map_or(now.distance_m, |o| o.first_m) - 1.5 * self.config.plate_length_m;
        while self.samples.front().is_some_and(|s| s.distance_m < oldest_m) {
            self.samples.pop_front();
        }
    }

    fn close(&mut self, open: OpenPass) {
        let release = self.config.release_energy;
        let samples = self.samples.make_contiguous();
        // Back from the first scan above the threshold to the rise through the release level.
        let mut first = samples.partition_point(|s| s.distance_m < open.first_m);
        while first > 0 && samples[first - 1].energy > release {
            first -= 1;
        }
        let last = samples.partition_point(|s| s.distance_m <= open.last_m).saturating_sub(1);
        if first > last {
            return;
        }
        let crossing = |a: &Sample, b: &Sample| {
            let rise = b.energy - a.energy;
            let share = if rise == 0.0 { 0.5 } else { ((release - a.energy) / rise).clamp(0.0, 1.0) };
            a.distance_m + share * (b.distance_m - a.distance_m)
        };
        let before = first.checked_sub(1).and_then(|i| samples.get(i));
        let start_m = before.map_or(samples[first].distance_m, |s| crossing(s, &samples[first]));
        let end_m = samples.get(last + 1).map_or(samples[last].distance_m, |s| crossing(&samples[last], s));

        let over = samples[first..=last].iter().filter(|s| s.energy > self.config.threshold_energy);
        let (mut scans, mut peak) = (0, samples[first]);
        let (mut ranges, mut range_squares) = (0_u32, 0.0);
        for s in over {
            scans += 1;
            if s.energy > peak.energy {
                peak = *s;
            }
            if let Some(r) = s.range_m {
                ranges += 1;
                range_squares += r * r;
            }
        }
        let range_m = Some((range_squares / f64::from(ranges)).sqrt()).filter(|r| r.is_finite());
        let ends_m = [start_m, end_m];
        let distance_m = match self.config.centre {
            Centre::Maximum => peak.distance_m,
            Centre::Edges => (start_m + end_m) / 2.0,
            Centre::Centroid => centroid_m(samples, first, last, release, ends_m),
            Centre::Matched => matched_m(samples, ends_m, self.config.plate_length_m),
            Centre::Level => {
                let levels = [release, self.config.threshold_energy];
                level_m(samples, levels, ends_m, self.config.plate_length_m)
            }
        };
        // All scans there, also those below the threshold: a selection by energy would raise the mean.
        let (mut count, mut mean_energy) = (0_u32, 0.0);
        for s in
            samples.iter().filter(|s| (s.distance_m - distance_m).abs() <= self.config.plate_length_m / 3.0)
        {
            count += 1;
            mean_energy += (s.energy - mean_energy) / f64::from(count);
        }
        if count == 0 {
            mean_energy = peak.energy;
        }
        let lateral_offset_m = match &self.config.offset {
            OffsetSource::None => None,
            OffsetSource::Range { height_m } => range_m.and_then(|r| offset_from_range_m(r, *height_m).ok()),
            OffsetSource::Energy(curve) => curve.offset_m(mean_energy).ok(),
        };
        let pass = MarkerPass {
            time_s: time_at(samples, distance_m),
            distance_m,
            start_m,
            end_m,
            peak_energy: peak.energy,
            mean_energy,
            scans,
            range_m,
            lateral_offset_m,
        };
        let fallen = &samples[last + 1..];
        self.quiet_peak = fallen.iter().fold(0.0, |m, s| m.max(s.energy));
        self.judge(pass);
    }

    /// Checks the period of a pass.
    fn judge(&mut self, pass: MarkerPass) {
        let at_m = pass.distance_m;
        let spacing_m = self.config.spacing_m;
        let from_previous_m = self.previous_m.map(|p| at_m - p);
        self.previous_m = Some(at_m);
        let spacing = |from_m: f64, intervals: usize| {
            let estimate_m = at_m - from_m;
            Spacing { estimate_m, intervals, error_m: estimate_m - intervals as f64 * spacing_m }
        };
        let limit_m = self.config.largest_error_m(self.step_m);

        let mut report = MarkerReport { pass, verdict: Verdict::Unpaired, spacing: None, from_previous_m };
        let mut candidate = Candidate { pass, chain: 0, chain_start_m: at_m, has_next: false };
        // A missed marker is no evidence against those after it: where the next one stands in the row of a
        // lane that a warning ended, the lane is present again.
        let most = self.config.misses_to_warn + usize::from(self.lane_marker_m.is_none());
        let on_lane = self.lane_marker_m.or(self.left_marker_m).and_then(|m| {
            let intervals = ((at_m - m) / spacing_m).round().max(1.0);
            let s = spacing(m, intervals as usize);
            (intervals <= most as f64 && s.error_m.abs() < limit_m).then_some((m, s))
        });
        if let Some((marker_m, s)) = on_lane {
            report.verdict = Verdict::Lane;
            report.spacing = Some(s);
            if let Some(c) = self.candidates.iter_mut().find(|c| c.pass.distance_m == marker_m) {
                c.has_next = true;
            }
            // Enough for a lane, so that the chain continues if this marker is lost.
            candidate.chain = self.config.confirm_spacings;
            self.join_lane(&pass);
        } else if self.lane_marker_m.is_some_and(|m| at_m - m < self.config.least_distance_m) {
            report.verdict = Verdict::TooNear;
        } else {
            let error = |c: &Candidate| (at_m - c.pass.distance_m - spacing_m).abs();
            let best = self.candidates.iter_mut().min_by(|a, b| error(a).total_cmp(&error(b)));
            if let Some(before) = best.filter(|c| error(c) < limit_m) {
                before.has_next = true;
                let start = before.pass;
                report.spacing = Some(spacing(start.distance_m, 1));
                report.verdict = Verdict::Paired;
                candidate.chain = before.chain + 1;
                candidate.chain_start_m = before.chain_start_m;
                if self.lane_marker_m.is_none() && candidate.chain >= self.config.confirm_spacings {
                    report.verdict = Verdict::Lane;
                    self.offsets.clear();
                    // The row's first marker starts the odometer; those in between follow from the count.
                    let _ = self.odometer.mark(candidate.chain_start_m);
                    self.join_lane(&start);
                    self.join_lane(&pass);
                }
            }
        }
        self.candidates.push(candidate);
        self.pending.push_back(EventKind::Marker(report));
    }

    fn join_lane(&mut self, pass: &MarkerPass) {
        (self.lane_marker_m, self.left_marker_m) = (Some(pass.distance_m), None);
        // A marker that the odometer already knows or that does not fit its count is left out there; the lane
        // is independent of it.
        let _ = self.odometer.mark(pass.distance_m);
        if let Some(offset_m) = pass.lateral_offset_m {
            self.offsets.push_back((pass.distance_m, offset_m));
            if self.offsets.len() > self.config.trend_markers {
                self.offsets.pop_front();
            }
        }
    }

    /// Warns when the radar is the largest error past the place of a missing marker, and no pass is going on.
    fn check_departure(&mut self, now_m: f64) {
        let Some(last_marker_m) = self.lane_marker_m else { return };
        let expected_m = last_marker_m + self.config.misses_to_warn as f64 * self.config.spacing_m;
        if self.open.is_some() || now_m < expected_m + self.config.largest_error_m(self.step_m) {
            return;
        }
        self.pending.push_front(EventKind::Departure(Departure {
            last_marker_m,
            expected_m,
            delay_m: now_m - expected_m,
            peak_energy: self.quiet_peak,
            trend: self.offset_trend(),
        }));
        self.left_marker_m = self.lane_marker_m.take();
    }

    /// Drops passes whose partner can no longer come.
    fn expire_candidates(&mut self, now_m: f64) {
        let c = &self.config;
        let reach_m = c.spacing_m + c.largest_error_m(self.step_m) + c.plate_length_m + c.hold_m;
        let pending = &mut self.pending;
        self.candidates.retain(|c| {
            let keep = now_m - c.pass.distance_m <= reach_m;
            if !keep && c.chain == 0 && !c.has_next {
                pending.push_back(EventKind::Isolated(c.pass));
            }
            keep
        });
    }
}
