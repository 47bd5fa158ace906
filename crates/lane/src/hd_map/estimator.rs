//! The map method behind the interface of all lane methods. It gives the lane number of every track of a
//! look, which is Li's product, and the lane of the vehicle that carries the radar where that stands on a
//! road of the map.

use super::{Assignment, Carriageway, HdMap, LaneKind, LocalMap, RadarFrame, RadarPose, Settings, Target};
pub use crate::body::Body;
use crate::body::Step;
use crate::curve::fit_simplest;
use crate::error;
use crate::{LaneError, LaneEstimate, LaneEstimator, LaneTrack, Line, SensorInput};
use glam::{DMat2, DVec2};

/// Least standard deviation of a line, m, as its points are measured.
const LEAST_LINE_STD_M: f64 = 0.02;
/// Gain in squared deviations for which a line gets a further parameter (99.7 % of chi-square with one degree
/// of freedom).
const GAIN: f64 = 9.0;
/// Least speed at which a track tells its heading, m/s.
const LEAST_SPEED_MPS: f64 = 1.0;
/// Largest angle between a track's motion and a road that it follows, rad.
const ACROSS_ROAD_RAD: f64 = 0.5;

/// Settings of [`MapLanes`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How lanes are assigned.
    pub settings: Settings,
    /// Position of the radar in the vehicle's level frame, m; [`SensorInput::place`] is the radar's own pose
    /// on the earth.
    pub radar_at_m: [f64; 2],
    /// Yaw of the radar's boresight, rad, positive to the left.
    pub radar_yaw_rad: f64,
    /// Standard deviation of the radar's position on each axis, m.
    pub place_std_m: f64,
    /// Standard deviation of the radar's azimuth, rad.
    pub azimuth_std_rad: f64,
    /// Radius around the vehicle within which lines are stated, m.
    pub reach_m: f64,
    /// Size of the vehicles. Tracks are moved to the middle of such a vehicle, and the uncertainty of that
    /// step enters their covariance. None: tracks are used as they are.
    pub body: Option<Body>,
    /// Standard deviation of the angle between vehicles' axes and the direction of the road, rad.
    pub along_road_std_rad: f64,
    /// Standard deviation of a track's direction, rad, which tells a vehicle's axis where no road of the map
    /// does.
    pub direction_std_rad: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            settings: Settings::default(),
            radar_at_m: [0.0; 2],
            radar_yaw_rad: 0.0,
            place_std_m: 0.0,
            azimuth_std_rad: 0.0,
            reach_m: 100.0,
            body: Some(Body::CAR),
            along_road_std_rad: 2f64.to_radians(),
            direction_std_rad: 5f64.to_radians(),
        }
    }
}

/// Reads lanes from a map, given the radar's pose (method `hd-map`).
#[derive(Debug, Clone)]
pub struct MapLanes {
    map: HdMap,
    options: Options,
    /// The map in the axes of the radar at that pose; for a radar that stands still it is converted once.
    local: Option<(RadarPose, LocalMap)>,
}

impl MapLanes {
    /// The method's name, as on the command line.
    pub const METHOD: &'static str = "hd-map";

    /// Makes the estimator for a map.
    ///
    /// # Errors
    /// Returns an error for the first fault of the map or the first option or setting outside its range.
    pub fn new(map: HdMap, options: Options) -> Result<MapLanes, LaneError> {
        map.check()?;
        let o = &options;
        let good = |v: f64| v.is_finite() && v >= 0.0;
        let [x, y] = o.radar_at_m;
        error::settings(&[
            ("place_std_m", good(o.place_std_m)),
            ("azimuth_std_rad", good(o.azimuth_std_rad)),
            ("reach_m", good(o.reach_m)),
            ("along_road_std_rad", good(o.along_road_std_rad)),
            ("direction_std_rad", good(o.direction_std_rad)),
            ("radar_at_m", x.is_finite() && y.is_finite() && o.radar_yaw_rad.is_finite()),
        ])?;
        // Edges and settings are checked when a map is converted to a frame, wherever that is.
        let anywhere = RadarPose { position: map.carriageways[0].inner_edge[0], azimuth_rad: 0.0 };
        LocalMap::new(&map, &anywhere, options.settings)?;
        Ok(MapLanes { map, options, local: None })
    }

    /// The map of the lanes.
    pub fn map(&self) -> &HdMap {
        &self.map
    }

    /// Position of the radar in the vehicle's level frame, m.
    pub fn radar_at_m(&self) -> [f64; 2] {
        self.options.radar_at_m
    }

    fn at(&mut self, input: &SensorInput<'_>) -> Result<(RadarPose, &LocalMap), LaneError> {
        let Some(pose) = input.place else {
            return Err(LaneError::NotGiven { what: "the position of the radar on the earth".into() });
        };
        if self.local.as_ref().is_none_or(|(p, _)| *p != pose) {
            let local = LocalMap::new(&self.map, &pose, self.options.settings)?;
            self.local = Some((pose, local));
        }
        match &self.local {
            Some((_, local)) => Ok((pose, local)),
            None => Err(LaneError::refused("the map has no position")),
        }
    }

    /// Direction of the axis of a track's vehicle in the vehicle's level frame (rad), with its standard
    /// deviation: along the road that it is on, in its direction of motion. None for a track that hardly
    /// moves.
    fn axis(&self, at_m: DVec2, velocity_mps: DVec2) -> Option<(f64, f64)> {
        let o = &self.options;
        if !velocity_mps.is_finite() || velocity_mps.length() < LEAST_SPEED_MPS {
            return None;
        }
        let turn = DVec2::from_angle(o.radar_yaw_rad);
        let seen = DVec2::from_angle(-o.radar_yaw_rad).rotate(at_m - DVec2::from_array(o.radar_at_m));
        let towards = velocity_mps.normalize();
        let roads = self.local.iter().flat_map(|(_, local)| local.directions(seen)).map(|d| {
            let along = turn.rotate(d);
            along * along.dot(towards).signum()
        });
        let nearest = roads.max_by(|a, b| a.dot(towards).total_cmp(&b.dot(towards)));
        match nearest.filter(|d| d.dot(towards) > ACROSS_ROAD_RAD.cos()) {
            Some(road) => Some((road.to_angle(), o.along_road_std_rad)),
            None => Some((towards.to_angle(), o.direction_std_rad)),
        }
    }

    /// The step from a track to the middle of its vehicle. None where tracks are used as they are, or the
    /// vehicle's axis is unknown.
    fn step(&self, track: &LaneTrack) -> Option<Step> {
        let at = DVec2::from_array(track.at_m);
        let (heading_rad, heading_std_rad) = self.axis(at, DVec2::from_array(track.velocity_mps))?;
        let from = at - DVec2::from_array(self.options.radar_at_m);
        let across = (DVec2::from_array(track.std_m) * DVec2::from_angle(heading_rad).perp()).length();
        Some(self.options.body?.to_middle(from, heading_rad, heading_std_rad, across))
    }

    /// Position of the middle of a track's vehicle in the vehicle's level frame, m, by the map at the last
    /// look's pose.
    pub fn middle_m(&self, track: &LaneTrack) -> [f64; 2] {
        (DVec2::from_array(track.at_m) + self.step(track).map_or(DVec2::ZERO, |s| s.by_m)).to_array()
    }

    /// Converts a track of a look to a target in the radar's axes, moved to the middle of its vehicle, with
    /// the errors of that step and of the radar's own pose.
    pub fn target(&self, track: &LaneTrack) -> Target {
        let o = &self.options;
        let back = DMat2::from_angle(-o.radar_yaw_rad);
        let middle = DVec2::from_array(self.middle_m(track)) - DVec2::from_array(o.radar_at_m);
        let std = DVec2::from_array(track.std_m);
        let aside = middle.perp() * o.azimuth_std_rad;
        let turned = DMat2::from_cols(aside * aside.x, aside * aside.y);
        let body = self.step(track).map_or(DMat2::ZERO, |s| s.covariance_m2);
        let own = DMat2::from_diagonal(std * std + DVec2::splat(o.place_std_m.powi(2))) + turned + body;
        // Rounding leaves it symmetric only to the last digits.
        let c = back * own * back.transpose();
        let off = 0.5 * (c.x_axis.y + c.y_axis.x);
        Target::new(back * middle, DMat2::from_cols(DVec2::new(c.x_axis.x, off), DVec2::new(off, c.y_axis.y)))
    }

    /// Assigns a lane to each track of a look, in order (Li's product).
    ///
    /// # Errors
    /// Returns an error if the look has no pose of the radar, or if that pose is non-finite or not near the
    /// earth.
    pub fn targets(&mut self, input: &SensorInput<'_>) -> Result<Vec<Assignment>, LaneError> {
        self.at(input)?;
        let targets: Vec<Target> = input.tracks.iter().map(|t| self.target(t)).collect();
        Ok(self.at(input)?.1.assign(&targets))
    }

    /// Assigns a lane to a point of the vehicle's level frame (m) without error, for comparison with the
    /// truth.
    ///
    /// # Errors
    /// Returns an error if the look has no pose of the radar, or if that pose is non-finite or not near the
    /// earth. A point on no road of the map is no error here: the assignment then holds the reason.
    pub fn lane_at(&mut self, input: &SensorInput<'_>, at_m: [f64; 2]) -> Result<Assignment, LaneError> {
        let o = &self.options;
        let from = DVec2::from_array(at_m) - DVec2::from_array(o.radar_at_m);
        let target = Target::new(DMat2::from_angle(-o.radar_yaw_rad) * from, DMat2::ZERO);
        Ok(Assignment { target: 0, lane: self.at(input)?.1.place(&target) })
    }

    fn own_lane(&mut self, input: &SensorInput<'_>) -> Result<LaneEstimate, LaneError> {
        let o = self.options;
        let own = DMat2::from_angle(-o.radar_yaw_rad) * -DVec2::from_array(o.radar_at_m);
        let spread = o.place_std_m.powi(2) + (own.length() * o.azimuth_std_rad).powi(2);
        let target = Target::new(own, DMat2::from_diagonal(DVec2::splat(spread)));
        let (pose, local) = self.at(input)?;
        let place = local.place(&target).map_err(LaneError::refused)?;
        if place.fit != super::Fit::Inside {
            return Err(LaneError::refused("the vehicle is beside the lanes of the map"));
        }
        let Some(frame) = RadarFrame::new(&pose) else {
            return Err(LaneError::refused("the radar's pose is not finite or not near the earth"));
        };
        let turn = DMat2::from_angle(o.radar_yaw_rad);
        let here = |p: &super::Wgs84| turn * frame.radar_m(p).truncate() + DVec2::from_array(o.radar_at_m);
        let std = o.settings.map_std_m.max(LEAST_LINE_STD_M);
        let mut lines = Vec::new();
        for way in &self.map.carriageways {
            for points in boundaries(way, here) {
                if let Some(mut line) = line(&points, std, o.reach_m) {
                    line.fitted.covariance[0][0] += spread;
                    line.fitted.covariance[1][1] += o.azimuth_std_rad.powi(2);
                    line.confidence = place.probability;
                    lines.push(line);
                }
            }
        }
        if lines.is_empty() {
            return Err(LaneError::refused("no line of the map has two points within reach"));
        }
        let mut estimate = LaneEstimate::of_lines(Self::METHOD, input.time_s, input.tracks.len(), lines);
        estimate.lane_number = Some(place.number);
        estimate.confidence = place.probability;
        Ok(estimate)
    }
}

impl LaneEstimator for MapLanes {
    fn method(&self) -> &'static str {
        Self::METHOD
    }

    /// Estimates the vehicle's own lane and the lines of all carriageways within reach. For lanes of other
    /// vehicles see [`MapLanes::targets`].
    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        self.own_lane(input)
            .unwrap_or_else(|why| LaneEstimate::none(Self::METHOD, input.time_s, input.tracks.len(), why))
    }
}

/// The lines between and beside the lanes and strips of a carriageway: points offset from those of its inner
/// edge, where at least one of the two lanes that they separate has a width.
fn boundaries(way: &Carriageway, here: impl Fn(&super::Wgs84) -> DVec2) -> Vec<Vec<DVec2>> {
    let inner: Vec<DVec2> = way.inner_edge.iter().map(&here).collect();
    let outer: Vec<DVec2> = way.outer_edge.iter().map(&here).collect();
    let n = inner.len();
    // Sign of a normal that points towards the outer edge.
    let outwards = |i: usize, normal: DVec2| {
        let near = outer.iter().min_by(|a, b| a.distance(inner[i]).total_cmp(&b.distance(inner[i])));
        near.map_or(1.0, |q| normal.dot(*q - inner[i]).signum())
    };
    let mut stations = vec![0.0; n];
    for i in 1..n {
        stations[i] = stations[i - 1] + inner[i].distance(inner[i - 1]);
    }
    let medians = |s: f64| -> f64 {
        way.lanes.iter().filter(|l| l.kind == LaneKind::Median).map(|l| l.width_m.at_m(s)).sum()
    };
    let mut out = vec![Vec::new(); way.lanes.len() + 1];
    for i in 0..n {
        let (a, b) = (inner[i.saturating_sub(1)], inner[(i + 1).min(n - 1)]);
        let normal = (b - a).normalize_or(DVec2::X).perp();
        let normal = normal * outwards(i, normal);
        let mut across_m = -medians(stations[i]);
        let mut before = 0.0;
        for (k, line) in out.iter_mut().enumerate() {
            let width = way.lanes.get(k).map_or(0.0, |l| l.width_m.at_m(stations[i]));
            if before > 0.0 || width > 0.0 {
                line.push(inner[i] + normal * across_m);
            }
            across_m += width;
            before = width;
        }
    }
    out
}

/// Fits a curve to those points of a line that lie within reach, in the direction in which the vehicle looks.
fn line(points: &[DVec2], std_m: f64, reach_m: f64) -> Option<Line> {
    // One point more on each side, so that the line covers the whole reach.
    let near = |i: &usize| points[*i].length() <= reach_m;
    let first = (0..points.len()).find(near)?.saturating_sub(1);
    let last = ((0..points.len()).rfind(near)? + 1).min(points.len().checked_sub(1)?);
    let mut part = points[first..=last].to_vec();
    if part.last()?.x < part.first()?.x {
        part.reverse();
    }
    let fitted = fit_simplest(&part, &vec![std_m; part.len()], GAIN)?;
    Some(Line { fitted, confidence: 0.0, members: Vec::new() })
}
