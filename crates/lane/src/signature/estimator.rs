//! Localization in a signature map behind the interface of all lane methods, and the lane there.

use super::locate::{LocateSettings, Location, Search, locate};
use super::map::{Pose, ScanPoint, SignatureMap};
use super::row::{RowOptions, RowReader};
use crate::curve::{Fitted, fit_simplest};
use crate::error::{self, LaneError};
use crate::markers::speed_from_rest;
use crate::numeric::{spread, wrapped};
use crate::standing::StandingGate;
use crate::{LaneEstimate, LaneEstimator, LanePoint, Line, Measured, SensorInput};
use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// The method's name, as on the command line.
pub const METHOD: &str = "signature";

/// Test for stationary points, from the vehicle's own motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticTest {
    /// Position of the radar on the vehicle, m.
    pub radar_m: [f64; 2],
    /// Largest deviation of a stationary point's range rate, in standard deviations.
    pub sigmas: f64,
    /// Error of stationary points' range rates beyond their noise, m/s.
    pub tolerance_mps: f64,
    /// Standard deviation of the yaw rate where none is given, rad/s.
    pub yaw_rate_std_rad_per_s: f64,
    /// Width of the interval in which range rates are unambiguous, m/s; None if they are not folded.
    pub fold_mps: Option<f64>,
}

impl Default for StaticTest {
    fn default() -> Self {
        StaticTest {
            radar_m: [0.0; 2],
            sigmas: 3.5,
            tolerance_mps: 0.05,
            yaw_rate_std_rad_per_s: 0.1,
            fold_mps: None,
        }
    }
}

fn is_sound(p: &LanePoint) -> bool {
    [p.at_m[0], p.at_m[1], p.std_m[0], p.std_m[1], p.range_m, p.azimuth_rad, p.range_rate_mps]
        .iter()
        .all(|x| x.is_finite() && x.abs() < 1e6)
        && p.range_m > 0.0
}

impl StaticTest {
    /// Tells which points are stationary, given the vehicle's speed and yaw rate. Non-finite points are not.
    pub fn standing(&self, points: &[LanePoint], speed: Measured, yaw_rate: Option<Measured>) -> Vec<bool> {
        let yaw = yaw_rate
            .filter(|y| y.value.is_finite() && y.std.is_finite())
            .unwrap_or(Measured { value: 0.0, std: self.yaw_rate_std_rad_per_s });
        let gate = StandingGate {
            sigmas: self.sigmas,
            tolerance_mps: self.tolerance_mps,
            fold_mps: self.fold_mps,
            ..StandingGate::of_vehicle(speed, yaw, DVec2::from_array(self.radar_m))
        };
        let rests = |p: &LanePoint| {
            let range_rate = Measured { value: p.range_rate_mps, std: p.range_rate_std_mps };
            gate.passes(p.azimuth_rad, p.std_m[1] / p.range_m.max(0.1), range_rate)
        };
        points.iter().map(|p| is_sound(p) && rests(p)).collect()
    }
}

/// Converts a lane point to a point of the map's scan, seen from the radar with the vehicle's axes. Its
/// motion is judged beforehand.
pub fn scan_point(p: &LanePoint) -> ScanPoint {
    ScanPoint {
        range_m: p.range_m,
        azimuth_rad: p.azimuth_rad,
        range_std_m: p.std_m[0].max(1e-3),
        azimuth_std_rad: (p.std_m[1] / p.range_m.max(0.1)).max(1e-4),
        range_rate_mps: None,
    }
}

/// A line beside the vehicle: its distance to the left, its direction, its index in the map, and the line
/// itself.
type Beside = (f64, f64, usize, Line);

/// A lane of the map: indices of its lines, in the direction in which they were given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapLane {
    /// Number of the lane.
    pub number: i32,
    /// Index of the line to its right.
    pub right: usize,
    /// Index of the line to its left.
    pub left: usize,
}

/// Known lines of the road in the map's coordinates.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MapLanes {
    /// Points of each line, m.
    pub lines_m: Vec<Vec<[f64; 2]>>,
    /// Standard deviation of the surveyed lines across them, m.
    pub std_m: f64,
    /// The lanes between the lines.
    pub lanes: Vec<MapLane>,
}

/// What [`Signature`] works with besides its map.
#[derive(Debug, Clone, PartialEq)]
pub struct SignatureSetup {
    /// Test for stationary points.
    pub at_rest: StaticTest,
    /// Settings of the first search and of every search after the position is lost.
    pub search: LocateSettings,
    /// Half width of the strip beside the mapped route in the first search, m.
    pub beside_m: f64,
    /// Largest angle to the route in the first search, rad.
    pub turn_rad: f64,
    /// A rough first pose of the radar (as from GNSS), with half the side of the square (m) to search; None:
    /// along the whole route.
    pub rough: Option<(Pose, f64)>,
    /// Settings of the searches near the last position.
    pub track: LocateSettings,
    /// Half the side of the square that is searched near the last position, m.
    pub track_half_m: f64,
    /// Largest turn that is searched near the last place, rad.
    pub track_turn_rad: f64,
    /// Least probability among the poses found at which a position is stated.
    pub least_probability: f64,
    /// Number of failed looks after which the position is searched everywhere again.
    pub lost_after: u32,
    /// Distances behind and ahead of the vehicle between which lines are stated, m.
    pub reach_m: [f64; 2],
    /// Standard deviations of the map itself in x, y (m) and heading (rad), common to all looks; they are
    /// included in the covariance of positions.
    pub map_std: [f64; 3],
    /// Rows of markers whose code words are decoded.
    pub rows: Vec<RowOptions>,
}

impl Default for SignatureSetup {
    fn default() -> Self {
        let search = LocateSettings { near_m: 3.0, floor_std_m: 0.05, ..LocateSettings::default() };
        SignatureSetup {
            at_rest: StaticTest::default(),
            search,
            beside_m: 2.0,
            turn_rad: 0.1,
            rough: None,
            track: LocateSettings { candidates: 2, step_m: 0.3, ..search },
            track_half_m: 0.6,
            track_turn_rad: 0.035,
            least_probability: 0.9,
            lost_after: 4,
            reach_m: [5.0, 40.0],
            map_std: [0.0; 3],
            rows: Vec::new(),
        }
    }
}

/// The vehicle's position in the map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapPosition {
    /// Time of the position, s.
    pub time_s: f64,
    /// Pose of the vehicle's reference point.
    pub vehicle: Pose,
    /// Covariance of x, y (m) and heading (rad).
    pub covariance: [[f64; 3]; 3],
    /// Location of the radar, with its rivals.
    pub radar: Location,
    /// Whether only the surroundings of the last position were searched.
    pub tracked: bool,
}

/// Localizes the vehicle in a signature map without GNSS, states the lane lines that are known there, and
/// reads the codewords of marker rows beside it. It takes points from any source.
pub struct Signature {
    map: SignatureMap,
    lanes: MapLanes,
    options: SignatureSetup,
    last: Option<MapPosition>,
    failed: u32,
    time_s: Option<f64>,
    speed: Option<Measured>,
    rows: Vec<RowReader>,
}

impl Signature {
    /// Makes the estimator. `lanes` may be empty: then only positions and codewords are stated.
    ///
    /// # Errors
    /// Returns an error for the first option or setting outside its range.
    pub fn new(map: SignatureMap, lanes: MapLanes, options: SignatureSetup) -> Result<Signature, LaneError> {
        let reach = options.reach_m;
        let rules: [(&'static str, bool); 8] = [
            ("map_std", options.map_std.iter().all(|s| (0.0..=100.0).contains(s))),
            ("beside_m", options.beside_m >= 0.0 && options.beside_m <= 20.0),
            ("turn_rad", options.turn_rad >= 0.0 && options.turn_rad <= 3.2),
            ("track_half_m", options.track_half_m > 0.0 && options.track_half_m <= 20.0),
            ("track_turn_rad", options.track_turn_rad >= 0.0 && options.track_turn_rad <= 1.0),
            ("least_probability", (0.0..=1.0).contains(&options.least_probability)),
            ("reach_m", reach.iter().all(|r| (1.5..=500.0).contains(r))),
            ("lanes", lanes.is_sound()),
        ];
        error::settings(&rules)?;
        // A straight stretch may have its ends alone.
        let dense = |line: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            let line: Vec<DVec2> = line.iter().copied().map(DVec2::from_array).collect();
            let mut out = spread(&line, STEP_M);
            out.extend(line.last().filter(|p| out.last().is_none_or(|q| q.distance(**p) > 1e-3)));
            out.iter().map(DVec2::to_array).collect()
        };
        let lanes = MapLanes { lines_m: lanes.lines_m.iter().map(dense).collect(), ..lanes };
        let rows = options.rows.iter().map(|r| RowReader::new(r.clone())).collect::<Result<_, _>>()?;
        Ok(Signature { map, lanes, options, last: None, failed: 0, time_s: None, speed: None, rows })
    }

    /// The map in which positions are found.
    pub fn map(&self) -> &SignatureMap {
        &self.map
    }

    /// Position at the last look; None where it gave none.
    pub fn place(&self) -> Option<&MapPosition> {
        self.last.as_ref().filter(|_| self.failed == 0)
    }

    /// The readers of marker rows.
    pub fn rows(&self) -> &[RowReader] {
        &self.rows
    }

    fn expected(&self, last: &MapPosition, dt_s: f64, speed: Measured, yaw_rate: Option<Measured>) -> Pose {
        let v = &last.vehicle;
        let turn = yaw_rate.map_or(0.0, |y| y.value) * dt_s;
        let way = DVec2::from_angle(v.heading_rad + 0.5 * turn) * speed.value * dt_s;
        Pose { x_m: v.x_m + way.x, y_m: v.y_m + way.y, heading_rad: v.heading_rad + turn }
    }

    fn radar_of(&self, vehicle: &Pose) -> Pose {
        let arm =
            DVec2::from_angle(vehicle.heading_rad).rotate(DVec2::from_array(self.options.at_rest.radar_m));
        Pose { x_m: vehicle.x_m + arm.x, y_m: vehicle.y_m + arm.y, ..*vehicle }
    }

    fn locate(
        &mut self,
        input: &SensorInput<'_>,
        points: &[ScanPoint],
        speed: Measured,
        dt_s: f64,
    ) -> Result<MapPosition, LaneError> {
        let o = &self.options;
        let yaw = input.yaw_rate_rad_per_s.filter(|y| y.value.is_finite());
        let near = self.last.as_ref().filter(|_| self.failed < o.lost_after && dt_s >= 0.0);
        let (location, tracked) = match near {
            Some(last) => {
                let pose = self.radar_of(&self.expected(last, dt_s, speed, yaw));
                // What was not seen since may have drifted.
                let half_m = o.track_half_m * f64::from(1 + self.failed);
                let search = Search::Near { pose, half_m, turn_rad: o.track_turn_rad };
                (locate(&self.map, points, &search, &o.track)?, true)
            }
            None => {
                let search = match o.rough {
                    Some((pose, half_m)) => Search::Near { pose, half_m, turn_rad: o.turn_rad },
                    None => Search::Route { beside_m: o.beside_m, turn_rad: o.turn_rad },
                };
                (locate(&self.map, points, &search, &o.search)?, false)
            }
        };
        let arm = DVec2::from_angle(location.pose.heading_rad).rotate(DVec2::from_array(o.at_rest.radar_m));
        let vehicle = Pose {
            x_m: location.pose.x_m - arm.x,
            y_m: location.pose.y_m - arm.y,
            heading_rad: location.pose.heading_rad,
        };
        // The vehicle's position turns about the radar with the heading.
        let to = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(arm.y, -arm.x, 1.0));
        let covariance = to * DMat3::from_cols_array_2d(&location.covariance) * to.transpose()
            + DMat3::from_diagonal(DVec3::from_array(o.map_std.map(|s| s * s)));
        Ok(MapPosition {
            time_s: input.time_s,
            vehicle,
            covariance: covariance.to_cols_array_2d(),
            radar: location,
            tracked,
        })
    }
}

impl LaneEstimator for Signature {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        let given = input.points.len();
        let none = |why| LaneEstimate::none(METHOD, input.time_s, given, why);
        // The way since the last look, with the speed of both.
        let known =
            input.speed_mps.filter(|s| s.value.is_finite() && s.std.is_finite() && s.value.abs() < 200.0);
        let sound: Vec<LanePoint> = input.points.iter().filter(|p| is_sound(p)).copied().collect();
        let speed = known.or_else(|| speed_from_rest(&sound));
        let dt_s = self.time_s.map_or(0.0, |t| input.time_s - t);
        let dt_s = if dt_s.is_finite() { dt_s } else { f64::NAN };
        let failed = |me: &mut Signature, why| {
            me.failed = me.failed.saturating_add(1);
            LaneEstimate::none(METHOD, input.time_s, given, why)
        };
        let Some(speed) = speed else {
            let why = match (given, sound.len()) {
                (0, _) => LaneError::Empty,
                (_, 0) => LaneError::NotFinite { points: given },
                _ => LaneError::NoSpeed,
            };
            return failed(self, why);
        };
        let before = self.speed.map_or(speed.value, |s| s.value);
        let way = Measured { value: 0.5 * (before + speed.value), std: speed.std };
        if input.time_s.is_finite() {
            self.time_s = Some(input.time_s);
            self.speed = Some(speed);
        }
        let stands = self.options.at_rest.standing(input.points, speed, input.yaw_rate_rad_per_s);
        let members: Vec<usize> = (0..given).filter(|i| stands[*i]).collect();
        let scan: Vec<ScanPoint> = members.iter().map(|i| scan_point(&input.points[*i])).collect();
        if dt_s.is_finite() {
            let radar_m = self.options.at_rest.radar_m;
            for row in &mut self.rows {
                row.add(dt_s, way, input.yaw_rate_rad_per_s, radar_m, &scan);
            }
        }
        if given == 0 {
            return failed(self, LaneError::Empty);
        }
        if sound.is_empty() {
            return failed(self, LaneError::NotFinite { points: given });
        }
        if scan.is_empty() {
            return failed(self, LaneError::NothingAtRest);
        }
        if self.map.landmarks().is_empty() {
            return failed(self, LaneError::NotGiven { what: "a signature map with landmarks".into() });
        }
        let place = match self.locate(input, &scan, way, dt_s) {
            Ok(place) => place,
            Err(why) => {
                if let Some(last) = self.last.take() {
                    // The position moves on with the vehicle.
                    let vehicle = if dt_s.is_finite() {
                        self.expected(&last, dt_s, way, input.yaw_rate_rad_per_s)
                    } else {
                        last.vehicle
                    };
                    self.last = vehicle.is_finite().then_some(MapPosition { vehicle, ..last });
                }
                return failed(self, why);
            }
        };
        let likely = place.radar.probability;
        if likely < self.options.least_probability {
            let rivals = place.radar.rivals.len();
            // Which of them is right is unknown: the next look searches everywhere again.
            self.last = None;
            let why =
                format!("{rivals} other positions fit about as well, the best with probability {likely:.2}");
            return failed(self, LaneError::refused(why));
        }
        self.failed = 0;
        let out = self.lanes.estimate(&place, input.time_s, self.options.reach_m);
        self.last = Some(place);
        match out {
            None if self.lanes.lines_m.is_empty() => {
                none(LaneError::NotGiven { what: "lane lines in the map".into() })
            }
            None => none(LaneError::refused("no lane line of the map is beside the vehicle")),
            Some(mut e) => {
                e.provenance.given = given;
                for line in &mut e.lines {
                    line.members.clone_from(&members);
                }
                e.provenance.used = members.len();
                e.confidence = likely;
                e
            }
        }
    }
}

/// Spacing of points along a line, m.
const STEP_M: f64 = 1.0;
/// Least decrease of the sum of squares for a further parameter of the curve.
const GAIN: f64 = 6.0;
/// Largest distance to the side of a line that bounds the vehicle's lane, m.
const WIDEST_M: f64 = 8.0;

/// Where a line passes beside the vehicle: its distance along the vehicle's y axis (m), and its direction
/// relative to the vehicle (rad).
fn beside(line: &[DVec2]) -> Option<(f64, f64)> {
    line.windows(2)
        .filter(|w| (w[0].x <= 0.0) != (w[1].x <= 0.0))
        .map(|w| {
            let part = w[0].x / (w[0].x - w[1].x);
            (w[0].y + part * (w[1].y - w[0].y), (w[1] - w[0]).to_angle())
        })
        .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
}

impl MapLanes {
    fn is_sound(&self) -> bool {
        self.std_m.is_finite()
            && self.std_m >= 0.0
            && self.lines_m.iter().flatten().flatten().all(|x| x.is_finite() && x.abs() < 1e7)
            && self.lanes.iter().all(|l| l.right.max(l.left) < self.lines_m.len())
    }

    /// Estimates the lines around a position and the lane there. None where no line lies beside the vehicle.
    pub fn estimate(&self, place: &MapPosition, time_s: f64, reach_m: [f64; 2]) -> Option<LaneEstimate> {
        let v = &place.vehicle;
        let back = DVec2::from_angle(-v.heading_rad);
        let c = DMat3::from_cols_array_2d(&place.covariance);
        let across = DVec3::from((DVec2::from_angle(v.heading_rad).perp(), 0.0));
        // Variance across, of the heading, and of both together, of the vehicle.
        let (vy, vh, vyh) = (across.dot(c * across), c.z_axis.z, across.dot(c.z_axis));
        if !(vy >= 0.0 && vh >= 0.0 && vyh.is_finite()) {
            return None;
        }
        let std_m = self.std_m.max(1e-3);
        let mut lines: Vec<(f64, f64, usize, Line)> = Vec::new();
        for (i, line) in self.lines_m.iter().enumerate() {
            let far = reach_m[0].max(reach_m[1]) + 2.0;
            // The stretch that passes beside the vehicle.
            let mut parts: Vec<Vec<DVec2>> = vec![Vec::new()];
            for p in line {
                let q = back.rotate(DVec2::from_array(*p) - v.place());
                match q.x >= -reach_m[0] && q.length() < far {
                    true => parts.last_mut().into_iter().for_each(|l| l.push(q)),
                    false if parts.last().is_some_and(|l| !l.is_empty()) => parts.push(Vec::new()),
                    false => {}
                }
            }
            let found = parts.into_iter().filter_map(|p| Some((beside(&p)?, p)));
            let Some(((y, direction), mut part)) = found.min_by(|a, b| a.0.0.abs().total_cmp(&b.0.0.abs()))
            else {
                continue;
            };
            let with = direction.cos() >= 0.0;
            if !with {
                part.reverse();
            }
            let Some(mut fitted) = fit_simplest(&part, &vec![std_m; part.len()], GAIN) else { continue };
            // A fit through many points of one survey is no more certain than the survey; the pose's error is
            // added.
            let fit_var = (std_m * fitted.residual.max(1.0)).powi(2);
            let arm = fitted.curve.start_m[0];
            let mut covariance = [[0.0; 4]; 4];
            covariance[1][1] = vh + 1e-8;
            // The start moves by −(δy + arm δθ) where the pose moves by δ; its direction turns by −δθ.
            covariance[0][1] = vyh + arm * vh;
            covariance[0][0] = vy + fit_var + arm * arm * vh + 2.0 * arm * vyh;
            covariance[1][0] = covariance[0][1];
            covariance[2][2] = fitted.covariance[2][2];
            covariance[3][3] = fitted.covariance[3][3];
            fitted.covariance = covariance;
            let heading = if with { direction } else { wrapped(direction + std::f64::consts::PI) };
            // Square to the line.
            let y = y * direction.cos().abs();
            lines.push((
                y,
                heading,
                i,
                Line { fitted, confidence: place.radar.probability, members: Vec::new() },
            ));
        }
        lines.sort_by(|a, b| a.0.total_cmp(&b.0));
        let left = lines.iter().position(|l| l.0 > 0.0);
        let right = left.unwrap_or(lines.len()).checked_sub(1);
        let [right, left] = [right, left].map(|k| k.map(|k| &lines[k]).filter(|l| l.0.abs() < WIDEST_M));
        if right.is_none() && left.is_none() {
            return None;
        }
        let beside_std = vy.sqrt().hypot(std_m);
        let (mut width_m, mut offset_m, mut lane_number) = (None, None, None);
        if let (Some(r), Some(l)) = (right, left) {
            width_m = Some(Measured { value: l.0 - r.0, std: std_m * 2f64.sqrt() });
            offset_m = Some(Measured { value: -0.5 * (l.0 + r.0), std: beside_std });
            let is_own = |m: &&MapLane| (m.right, m.left) == (r.2, l.2) || (m.right, m.left) == (l.2, r.2);
            lane_number = self.lanes.iter().find(is_own).map(|m| m.number);
        }
        let own: Vec<_> = [right, left].into_iter().flatten().collect();
        let mean =
            |of: &dyn Fn(&Beside) -> f64| own.iter().map(|l| of(l)).sum::<f64>() / own.len().max(1) as f64;
        let heading_rad = Some(Measured { value: -mean(&|l| l.1), std: vh.sqrt() });
        let curve = |l: &Fitted| l.curve.at(l.curve.foot(DVec2::ZERO).s_m).curvature_per_m;
        let curve_std = mean(&|l| l.3.fitted.covariance[2][2].sqrt()).max(1e-4);
        let curvature_per_m = Some(Measured { value: mean(&|l| curve(&l.3.fitted)), std: curve_std });
        Some(LaneEstimate {
            lane_number,
            width_m,
            offset_m,
            heading_rad,
            curvature_per_m,
            confidence: place.radar.probability,
            lines: lines.into_iter().map(|l| l.3).collect(),
            ..LaneEstimate::empty(METHOD, time_s, 0)
        })
    }
}
