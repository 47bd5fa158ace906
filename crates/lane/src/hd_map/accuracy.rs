//! Counts how many vehicles were given the right lane, by kind of scene (Li, section 4.2 and table 1).

use super::{Assignment, Dropped};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Li's four kinds of scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SceneKind {
    /// A straight road.
    Straight,
    /// A curve.
    Curve,
    /// A ramp.
    Ramp,
    /// A road with an emergency bay.
    EmergencyBay,
}

impl SceneKind {
    /// All kinds, in the order of the document's table.
    pub const ALL: [SceneKind; 4] =
        [SceneKind::Straight, SceneKind::Curve, SceneKind::Ramp, SceneKind::EmergencyBay];

    /// The kind in words, as reports print it.
    pub fn name(self) -> &'static str {
        ["straight", "curve", "ramp", "emergency bay"][self as usize]
    }

    /// Number of vehicles and percentage right in Li, table 1, to print for comparison; never a result.
    pub fn document(self) -> (u32, f64) {
        [(187, 98.93), (192, 98.96), (55, 98.18), (9, 100.0)][self as usize]
    }
}

/// Why a vehicle was given a wrong lane or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The radar's error: from its true position the vehicle is given the right lane.
    Measurement,
    /// The map, the edges between its points, or the limits: the lane is wrong from the true position as
    /// well.
    Method,
    /// The lane is wrong, and no true position is known to tell why.
    Unexplained,
    /// There is no lane, as the position is outside the map or the road.
    Dropped,
    /// There is no lane, as a target, map or pose cannot be used.
    Unusable,
}

impl Cause {
    /// All causes, in the order in which reports print them.
    pub const ALL: [Cause; 5] =
        [Cause::Measurement, Cause::Method, Cause::Unexplained, Cause::Dropped, Cause::Unusable];

    /// The cause in words, as reports print it.
    pub fn name(self) -> &'static str {
        ["measurement", "method", "unexplained", "dropped", "unusable"][self as usize]
    }
}

/// Counts of vehicles in one kind of scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Number of vehicles that were given their lane.
    pub right: u32,
    /// Number of vehicles that were not, by cause, in the order of [`Cause::ALL`].
    pub wrong: [u32; 5],
}

impl Tally {
    /// Number of vehicles counted, right and wrong.
    pub fn counted(&self) -> u32 {
        self.right + self.wrong.iter().sum::<u32>()
    }

    /// Number of vehicles that were counted wrong for this cause.
    pub fn wrong_by(&self, cause: Cause) -> u32 {
        self.wrong[cause as usize]
    }

    /// Share of vehicles that are right, 0 to 1; None without a vehicle.
    pub fn accuracy(&self) -> Option<f64> {
        (self.counted() > 0).then(|| f64::from(self.right) / f64::from(self.counted()))
    }

    /// Confidence interval of 95 % for the true accuracy (Wilson 1927); None without a vehicle.
    pub fn interval95(&self) -> Option<[f64; 2]> {
        let (n, share) = (f64::from(self.counted()), self.accuracy()?);
        let z2 = 1.959_963_984_540_054_f64.powi(2);
        let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = (z2 * (share * (1.0 - share) / n + z2 / (4.0 * n * n))).sqrt() / (1.0 + z2 / n);
        Some([(middle - half).max(0.0), (middle + half).min(1.0)])
    }
}

/// The scan that represents a vehicle seen in many scans: of those that gave it the lane with the greatest
/// sum of probabilities (ties go to more scans, then to the first), the one with the highest probability. A
/// vehicle that never got a lane is represented by its last scan; without scans the result is None.
pub fn scan_of_pass(scans: &[Assignment]) -> Option<&Assignment> {
    let mut lanes: Vec<(i32, f64, u32, &Assignment, f64)> = Vec::new();
    for scan in scans {
        let Ok(place) = &scan.lane else { continue };
        let p = place.probability;
        match lanes.iter_mut().find(|l| l.0 == place.number) {
            Some((_, sum, count, surest, most)) => {
                *sum += p;
                *count += 1;
                if p > *most {
                    (*surest, *most) = (scan, p);
                }
            }
            None => lanes.push((place.number, p, 1, scan, p)),
        }
    }
    let mut best: Option<&(i32, f64, u32, &Assignment, f64)> = None;
    for lane in &lanes {
        if best.is_none_or(|b| (lane.1, lane.2) > (b.1, b.2)) {
            best = Some(lane);
        }
    }
    best.map(|l| l.3).or(scans.last())
}

/// Right and wrong vehicles for each kind of scene; `Display` prints a table with the document's figures
/// beside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AccuracyTable {
    /// Tallies in the order of [`SceneKind::ALL`].
    tallies: [Tally; 4],
}

impl AccuracyTable {
    /// Counts one vehicle. `from_truth` is the assignment of its true position where that is known. Returns
    /// the cause if the lane is wrong.
    pub fn record(
        &mut self,
        scene: SceneKind,
        true_number: i32,
        seen: &Assignment,
        from_truth: Option<&Assignment>,
    ) -> Option<Cause> {
        let tally = &mut self.tallies[scene as usize];
        let cause = match &seen.lane {
            Ok(place) if place.number == true_number => {
                tally.right += 1;
                return None;
            }
            Err(Dropped::NotFinite | Dropped::BadCovariance | Dropped::Map(_)) => Cause::Unusable,
            Err(_) => Cause::Dropped,
            Ok(_) => match from_truth.map(Assignment::number) {
                Some(number) if number == Some(true_number) => Cause::Measurement,
                Some(_) => Cause::Method,
                None => Cause::Unexplained,
            },
        };
        tally.wrong[cause as usize] += 1;
        Some(cause)
    }

    /// The tally of one kind of scene.
    pub fn tally(&self, scene: SceneKind) -> &Tally {
        &self.tallies[scene as usize]
    }

    /// Adds the counts of another table.
    pub fn add(&mut self, other: &AccuracyTable) {
        for (mine, theirs) in self.tallies.iter_mut().zip(&other.tallies) {
            mine.right += theirs.right;
            for (a, b) in mine.wrong.iter_mut().zip(theirs.wrong) {
                *a += b;
            }
        }
    }
}

impl fmt::Display for AccuracyTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "scene          vehicles  right  accuracy  95 % interval   document      wrong by cause"
        )?;
        for scene in SceneKind::ALL {
            let tally = self.tally(scene);
            write!(f, "{:<14} {:>8} {:>6}", scene.name(), tally.counted(), tally.right)?;
            match (tally.accuracy(), tally.interval95()) {
                (Some(share), Some([low, high])) => {
                    write!(f, "  {:>6.2} %  {:>5.1} to {:>5.1} %", 100.0 * share, 100.0 * low, 100.0 * high)?;
                }
                _ => write!(f, "         -                -")?,
            }
            let (vehicles, percent) = scene.document();
            write!(f, "  {percent:>6.2} % of {vehicles:<4}")?;
            let causes: Vec<String> = Cause::ALL
                .into_iter()
                .filter(|c| tally.wrong_by(*c) > 0)
                .map(|c| format!("{} {}", c.name(), tally.wrong_by(c)))
                .collect();
            writeln!(f, "{}", if causes.is_empty() { "-".to_string() } else { causes.join(", ") })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fit, LaneKind, LanePlace};
    use super::*;
    use crate::error::LaneError;

    fn given(number: i32) -> Assignment {
        let lane = Ok(LanePlace {
            carriageway: 0,
            number,
            kind: LaneKind::Driving,
            rate: 0.5,
            fit: Fit::Inside,
            station_m: 0.0,
            gap_m: 10.0,
            across_std_m: 0.0,
            probability: 1.0,
            next: None,
            overlap: false,
        });
        Assignment { target: 0, lane }
    }

    fn dropped(why: Dropped) -> Assignment {
        Assignment { target: 0, lane: Err(why) }
    }

    #[test]
    fn each_cause_has_its_place() {
        let mut table = AccuracyTable::default();
        let s = SceneKind::Curve;
        assert_eq!(table.record(s, 2, &given(2), None), None);
        assert_eq!(table.record(s, 2, &given(2), Some(&given(3))), None);
        assert_eq!(table.record(s, 2, &given(3), Some(&given(2))), Some(Cause::Measurement));
        assert_eq!(table.record(s, 2, &given(3), Some(&given(3))), Some(Cause::Method));
        let off = dropped(Dropped::Median { beyond_m: 2.0 });
        assert_eq!(table.record(s, 2, &given(3), Some(&off)), Some(Cause::Method));
        assert_eq!(table.record(s, 2, &given(3), None), Some(Cause::Unexplained));
        assert_eq!(table.record(s, 2, &off, Some(&given(2))), Some(Cause::Dropped));
        for why in [
            Dropped::NotFinite,
            Dropped::BadCovariance,
            Dropped::Map(LaneError::refused("the radar's pose is not finite or not near the earth")),
        ] {
            assert_eq!(table.record(s, 2, &dropped(why), None), Some(Cause::Unusable));
        }
        let tally = *table.tally(s);
        assert_eq!((tally.counted(), tally.right, tally.wrong), (10, 2, [1, 2, 1, 1, 3]));
        assert_eq!(tally.accuracy(), Some(0.2));
        assert_eq!(table.tally(SceneKind::Ramp).accuracy(), None);
        assert_eq!(table.tally(SceneKind::Ramp).interval95(), None);
        let mut twice = table;
        twice.add(&table);
        assert_eq!(twice.tally(s).counted(), 20);
        let text = table.to_string();
        assert_eq!(text.lines().count(), 5);
        assert!(text.contains("method 2, unexplained 1, dropped 1, unusable 3"), "{text}");
        assert!(text.lines().all(|l| l.len() < 140));
    }

    #[test]
    fn a_vehicle_seen_often_is_spoken_for_by_its_likeliest_lane() {
        let scan = |number, probability| {
            let mut a = given(number);
            a.lane.as_mut().unwrap().probability = probability;
            a
        };
        let off = || dropped(Dropped::BeyondMap);
        assert_eq!(scan_of_pass(&[]), None);
        assert_eq!(scan_of_pass(&[dropped(Dropped::NoRoom), off()]), Some(&off()));
        let scans = [off(), scan(2, 0.9), scan(3, 0.6), scan(3, 0.7), off()];
        assert_eq!(scan_of_pass(&scans), Some(&scans[3]));
        // Without errors in a strip there is no probability: the scans count.
        let scans = [scan(2, 0.0), scan(3, 0.0), scan(3, 0.0)];
        assert_eq!(scan_of_pass(&scans).unwrap().number(), Some(3));
        let scans = [scan(2, 0.5), scan(3, 0.5)];
        assert_eq!(scan_of_pass(&scans).unwrap().number(), Some(2));
    }

    #[test]
    fn the_interval_is_wilsons() {
        // Newcombe 1998, table I: 81 of 263 gives 0.2553 to 0.3662, 0 of 20 gives 0 to 0.1611.
        let tally = |right, wrong| Tally { right, wrong: [wrong, 0, 0, 0, 0] };
        for (t, [low, high]) in [(tally(81, 182), [0.2553, 0.3662]), (tally(0, 20), [0.0, 0.1611])] {
            let [a, b] = t.interval95().unwrap();
            assert!((a - low).abs() < 5e-5 && (b - high).abs() < 5e-5, "{a} {b}");
        }
    }

    #[test]
    fn the_documents_shares_are_whole_vehicles() {
        for scene in SceneKind::ALL {
            let (vehicles, percent) = scene.document();
            let right = (f64::from(vehicles) * percent / 100.0).round();
            assert!((100.0 * right / f64::from(vehicles) - percent).abs() < 0.005, "{scene:?}");
        }
    }
}
