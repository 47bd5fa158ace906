//! A scenario frame by frame, and the truth of its road, both in the form of lane estimators: in the
//! vehicle's level frame, x forward, y left, the origin on the road under the vehicle's reference point.

use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::detect::points::Point;
use catseye::detect::tracker::Track;
use catseye::engine::Engine;
use catseye::road::labels::{LaneLabel, Polyline, RoadLabel, RoadTruth};
use catseye::road::site::Site;
use catseye::scene::radar::Radar;
use catseye::scene::waveform::Waveform;
use catseye::simulate::{Frame, Prepared};
use catseye_lane::score::TrueLanes;
use catseye_lane::{LanePoint, LaneTrack};
use glam::{DVec2, DVec3};

/// Least standard deviation of a point's azimuth, rad: arrays are not calibrated better.
const LEAST_AZIMUTH_STD_RAD: f64 = 1e-3;
/// Distance beyond which a line is not one of the vehicle's lane, m.
const WIDEST_LANE_M: f64 = 8.0;

/// A scenario that is driven.
pub struct Drive<'a> {
    /// Scene and road of the scenario.
    pub site: &'a Site,
    engine: &'a Engine,
    prepared: Prepared<'a>,
}

/// Position and motion of the vehicle in the world's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Position, m.
    pub at_m: DVec2,
    /// Heading from the world's x axis, rad.
    pub heading_rad: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Yaw rate, rad/s, positive to the left.
    pub yaw_rate_rad_per_s: f64,
}

impl Level {
    /// Converts a point of the world to the level frame, m.
    pub fn from_world(&self, p: DVec2) -> DVec2 {
        DVec2::from_angle(-self.heading_rad).rotate(p - self.at_m)
    }

    /// Converts a point of the level frame to the world, m.
    pub fn to_world(&self, p: DVec2) -> DVec2 {
        self.at_m + DVec2::from_angle(self.heading_rad).rotate(p)
    }
}

impl<'a> Drive<'a> {
    /// Prepares the drive of a scenario.
    ///
    /// # Errors
    /// Returns an error if a surface cannot be cut.
    pub fn new(site: &'a Site, engine: &'a Engine) -> Result<Drive<'a>> {
        Ok(Drive { site, engine, prepared: Prepared::new(&site.scenario, &site.scene)? })
    }

    /// Computes frame `index` of radar number `which` through the whole chain.
    ///
    /// # Errors
    /// Returns the errors of the frame's computation.
    pub fn frame(&self, which: usize, index: u32) -> Result<Frame> {
        self.prepared.frame(self.engine, which, index, Control::default())
    }

    /// The engine.
    pub fn engine(&self) -> &'a Engine {
        self.engine
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.site.scenario.frames.count
    }

    /// Time of a frame, s.
    pub fn time_s(&self, index: u32) -> f64 {
        self.site.scenario.frames.time_s(index)
    }

    /// One of the radars.
    pub fn radar(&self, which: usize) -> &Radar {
        &self.site.scenario.radars[which]
    }

    /// Position and motion of the vehicle at a time.
    pub fn level(&self, time_s: f64) -> Level {
        level(&self.site.scenario.ego.at(time_s))
    }

    /// The true lines of the road on which the vehicle drives, and its lane, at that time; lines are to be
    /// found between the distances `range_m` (m). Empty where the scene has no road.
    pub fn truth(&self, time_s: f64, range_m: [f64; 2]) -> TrueLanes {
        match &self.site.road {
            Some(road) => true_lanes(road, &self.level(time_s), range_m),
            None => TrueLanes { range_m, ..TrueLanes::default() },
        }
    }

    /// The truth as of [`Drive::truth`], with the rows of markers as the lines.
    pub fn truth_of_rows(&self, time_s: f64, range_m: [f64; 2]) -> TrueLanes {
        let lines = self.rows(time_s).into_iter().map(|(_, row)| row).filter(|r| r.len() > 1).collect();
        with_own(TrueLanes { lines, ..self.truth(time_s, range_m) })
    }

    /// The truth as of [`Drive::truth`], with the outer edges of the drivable lanes beside each other as the lines, and the
    /// offset from the middle between them.
    pub fn truth_of_region(&self, time_s: f64, range_m: [f64; 2]) -> TrueLanes {
        match &self.site.road {
            Some(road) => lane_region(road, &self.level(time_s), range_m),
            None => TrueLanes { range_m, ..TrueLanes::default() },
        }
    }

    /// Rows of markers with their names, in the level frame at that time, m.
    pub fn rows(&self, time_s: f64) -> Vec<(String, Vec<[f64; 2]>)> {
        let level = self.level(time_s);
        let place = |p: [f64; 3]| level.from_world(DVec2::new(p[0], p[1])).to_array();
        let rows = self.site.road.iter().flat_map(|r| &r.marker_rows);
        rows.map(|r| (r.name.clone(), r.markers.iter().map(|m| place(m.position_m)).collect())).collect()
    }

    /// Positions of all markers in the level frame at that time, m.
    pub fn markers(&self, time_s: f64) -> Vec<[f64; 2]> {
        self.rows(time_s).into_iter().flat_map(|(_, row)| row).collect()
    }

    /// Points of a frame in the form of lane estimators. Points without an angle are left out.
    pub fn points(&self, frame: &Frame) -> Vec<LanePoint> {
        frame.points.iter().filter_map(|p| lane_point(self.radar(frame.radar), p)).collect()
    }
}

fn level(now: &catseye::scene::motion::Moving) -> Level {
    let ahead = now.rotation * DVec3::X;
    let heading = DVec2::new(ahead.x, ahead.y).normalize_or(DVec2::X);
    Level {
        at_m: now.translation_m.truncate(),
        heading_rad: heading.y.atan2(heading.x),
        speed_mps: now.velocity_mps.truncate().dot(heading),
        yaw_rate_rad_per_s: now.spin_rad_per_s.z,
    }
}

/// Converts a radar's point to the vehicle's level frame by the radar's mounting; None where it has no measured
/// angle.
pub fn lane_point(radar: &Radar, p: &Point) -> Option<LanePoint> {
    let azimuth_std_rad = p.std.azimuth_rad.filter(|_| !p.at_search_edge)?.max(LEAST_AZIMUTH_STD_RAD);
    let at = radar.mounting.point(p.position_m);
    let from = at - radar.mounting.translation_m;
    let ground_m = from.truncate().length();
    Some(LanePoint {
        at_m: [at.x, at.y],
        std_m: [p.std.range_m, ground_m * azimuth_std_rad],
        range_rate_mps: p.range_rate_mps,
        range_rate_std_mps: p.std.range_rate_mps,
        range_m: p.range_m,
        azimuth_rad: from.y.atan2(from.x),
        rcs_dbsm: p.rcs_dbsm,
        snr_db: p.snr_db,
        power_dbm: Some(p.power_dbm).filter(|p| p.is_finite()),
    })
}

/// Index of the first radar of a scenario that is not an impulse radar: those have methods of their own.
pub fn point_radar(radars: &[Radar]) -> Option<usize> {
    radars.iter().position(|r| !matches!(r.waveform, Waveform::Pulse { .. }))
}

/// Mounting of a radar on its vehicle: position in the level frame, m, and direction of its boresight, rad.
pub fn mount(radar: &Radar) -> (DVec2, f64) {
    let ahead = radar.mounting.rotation * DVec3::X;
    (radar.mounting.translation_m.truncate(), ahead.y.atan2(ahead.x))
}

/// Longest piece of a line, m.
const PIECE_M: f64 = 0.5;

/// Points of a line with extra ones between its corners: a straight stretch may have only its ends.
fn dense(line: &Polyline) -> Vec<DVec2> {
    let corners: Vec<DVec2> = line.iter().map(|p| DVec2::new(p[0], p[1])).collect();
    let mut out = Vec::new();
    for w in corners.windows(2) {
        let n = (w[0].distance(w[1]) / PIECE_M).ceil().clamp(1.0, 1e5) as usize;
        out.extend((0..n).map(|i| w[0].lerp(w[1], i as f64 / n as f64)));
    }
    out.extend(corners.last());
    out
}

/// Index of the piece of a line, by its first corner, that is nearest to a point, and its distance.
fn nearest_piece(line: &Polyline, at: DVec2) -> Option<(usize, f64)> {
    let distance = |i: usize| {
        let (a, b) = (DVec2::new(line[i][0], line[i][1]), DVec2::new(line[i + 1][0], line[i + 1][1]));
        let along = ((at - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        a.lerp(b, along).distance(at)
    };
    (0..line.len().checked_sub(1)?).map(|i| (i, distance(i))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Polylines of points in order, split where there is none.
pub fn stretches(places: impl Iterator<Item = Option<DVec2>>) -> Vec<Vec<[f64; 2]>> {
    let mut out: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
    for place in places {
        match (place, out.last_mut()) {
            (Some(p), Some(open)) => open.push(p.to_array()),
            _ => out.push(Vec::new()),
        }
    }
    out.retain(|l| l.len() > 1);
    out
}

/// The stretches of a line within reach: a road that comes back gives more than one.
fn line_in(level: &Level, line: &Polyline, reach_m: f64) -> Vec<Vec<[f64; 2]>> {
    let near = |p: DVec2| Some(level.from_world(p)).filter(|q| q.length() <= reach_m);
    stretches(dense(line).into_iter().map(near))
}

/// The truth with only the lines of the vehicle's own lane, right before left.
pub fn own_alone(all: &TrueLanes) -> TrueLanes {
    let own = all.own.map(|i| i.and_then(|i| all.lines.get(i)));
    let second = usize::from(own[0].is_some());
    let lines = own.iter().copied().flatten().cloned().collect();
    TrueLanes { lines, own: [own[0].map(|_| 0), own[1].map(|_| second)], ..all.clone() }
}

/// Where a polyline passes the y axis nearest to the origin: (y in m, direction in rad).
fn beside(line: &[[f64; 2]]) -> Option<(f64, f64)> {
    line.windows(2)
        .filter_map(|w| {
            let (a, b) = (w[0], w[1]);
            if (a[0] <= 0.0) == (b[0] <= 0.0) {
                return None;
            }
            let t = a[0] / (a[0] - b[0]);
            let y = a[1] + t * (b[1] - a[1]);
            let direction = (b[1] - a[1]).atan2(b[0] - a[0]);
            Some((y, direction))
        })
        .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
}

/// Finds the lines to the right and left of the vehicle among `lines`, which are sorted from right to left.
fn with_own(mut t: TrueLanes) -> TrueLanes {
    let place = |l: &Vec<[f64; 2]>| beside(l).map_or(f64::INFINITY, |(y, _)| y);
    t.lines.sort_by(|a, b| place(a).total_cmp(&place(b)));
    let y: Vec<f64> = t.lines.iter().map(place).collect();
    let left = y.iter().position(|y| *y > 0.0 && *y < WIDEST_LANE_M);
    let right = y.iter().rposition(|y| *y <= 0.0 && *y > -WIDEST_LANE_M);
    t.own = [right, left];
    t
}

/// The road whose axis is nearest to the vehicle.
fn nearest_road<'r>(road: &'r RoadTruth, level: &Level) -> Option<&'r RoadLabel> {
    let distance =
        |line: &Polyline| nearest_piece(line, level.at_m).map_or(f64::INFINITY, |(_, distance)| distance);
    road.roads.iter().min_by(|a, b| distance(&a.axis_m).total_cmp(&distance(&b.axis_m)))
}

/// Largest gap between lanes beside each other, m.
const TOUCHING_M: f64 = 0.1;

/// The outer edges of the drivable lanes beside each other that hold the vehicle's lane, at each station of the nearest
/// road; lanes of other roads that join it are not in it. Where the vehicle's lane is not there, neither is the region.
pub fn lane_region(road: &RoadTruth, level: &Level, range_m: [f64; 2]) -> TrueLanes {
    let own = true_lanes(road, level, range_m);
    let out = TrueLanes { lines: Vec::new(), own: [None; 2], offset_m: None, ..own.clone() };
    let (Some(label), Some(number)) = (nearest_road(road, level), own.lane_number) else { return out };
    let at = |line: &Polyline, i: usize| line.get(i).map(|p| DVec2::new(p[0], p[1]));
    let mut pieces: [Vec<Polyline>; 2] = [vec![Vec::new()], vec![Vec::new()]];
    for i in 0..label.s_m.len() {
        let there: Vec<&LaneLabel> = label
            .lanes
            .iter()
            .filter(|l| l.kind.is_drivable() && l.width_m.get(i).is_some_and(|w| *w > 0.0))
            .collect();
        let Some(vehicle) = there.iter().find(|l| l.number == number) else {
            pieces.iter_mut().for_each(|p| p.push(Vec::new()));
            continue;
        };
        let touches = |a: &Polyline, b: &Polyline| {
            at(a, i).zip(at(b, i)).is_some_and(|(p, q)| p.distance(q) < TOUCHING_M)
        };
        let (mut left, mut right) = (*vehicle, *vehicle);
        // No road has more lanes beside each other than lanes.
        for _ in 0..there.len() {
            left = there.iter().find(|l| touches(&l.right_m, &left.left_m)).unwrap_or(&left);
            right = there.iter().find(|l| touches(&l.left_m, &right.right_m)).unwrap_or(&right);
        }
        for (piece, line) in pieces.iter_mut().zip([&right.right_m, &left.left_m]) {
            if let (Some(open), Some(p)) = (piece.last_mut(), line.get(i)) {
                open.push(*p);
            }
        }
    }
    let lines: Vec<Vec<[f64; 2]>> = pieces
        .iter()
        .flatten()
        .filter(|p| p.len() > 1)
        .flat_map(|p| line_in(level, p, range_m[1] + 20.0))
        .collect();
    let mut t = with_own(TrueLanes { lines, ..out });
    // The region may be wider than a lane can be.
    let y: Vec<Option<f64>> = t.lines.iter().map(|l| beside(l).map(|b| b.0)).collect();
    t.own = [
        y.iter().rposition(|y| y.is_some_and(|y| y <= 0.0)),
        y.iter().position(|y| y.is_some_and(|y| y > 0.0)),
    ];
    if let [Some(r), Some(l)] = t.own.map(|i| i.and_then(|i| y[i])) {
        t.offset_m = Some(-0.5 * (l + r));
    }
    t
}

/// The lines of the lanes of the road nearest to the vehicle, and its own lane.
pub fn true_lanes(road: &RoadTruth, level: &Level, range_m: [f64; 2]) -> TrueLanes {
    let reach_m = range_m[1] + 20.0;
    let Some(label) = nearest_road(road, level) else {
        return TrueLanes { range_m, ..TrueLanes::default() };
    };
    // Neighbours share a line; a missing lane has none.
    let mut lines: Vec<Vec<[f64; 2]>> = Vec::new();
    for lane in &label.lanes {
        for line in [&lane.left_m, &lane.right_m] {
            for part in line_in(level, line, reach_m) {
                if !lines.iter().any(|l| l.len() == part.len() && close(l, &part)) {
                    lines.push(part);
                }
            }
        }
    }
    // The lane that the vehicle stands in.
    let near = |line: &Polyline| -> Option<(usize, f64, f64)> {
        let at = |i: usize| level.from_world(DVec2::new(line[i][0], line[i][1]));
        let (i, _) = nearest_piece(line, level.at_m)?;
        let (a, b) = (at(i), at(i + 1));
        let along = (b - a).normalize_or(DVec2::X);
        // Positive when the vehicle is to its left.
        Some((i, along.perp_dot(-a), along.y.atan2(along.x)))
    };
    let mut t = with_own(TrueLanes { lines, range_m, ..TrueLanes::default() });
    for lane in &label.lanes {
        let Some((i, left_m, direction)) = near(&lane.centre_m) else { continue };
        let width_m = lane.width_m.get(i).copied().unwrap_or(0.0);
        if width_m > 0.5 && left_m.abs() <= 0.5 * width_m {
            let curvature = label.curvature_per_m.get(i).copied().unwrap_or(0.0);
            let with = direction.cos() >= 0.0;
            t.lane_number = Some(lane.number);
            t.offset_m = Some(if with { left_m } else { -left_m });
            t.heading_rad = Some(if with { -direction } else { turned(-direction) });
            // Of the lane's middle, by its distance from the axis.
            let axis = near(&label.axis_m).map_or(0.0, |(_, l, _)| l) - left_m;
            let own = curvature / (1.0 - curvature * axis);
            t.curvature_per_m = Some(if with { own } else { -own });
        }
    }
    t
}

fn turned(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle_rad + TAU).rem_euclid(TAU) - PI
}

fn close(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    a.iter().zip(b).all(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-3)
}

/// Converts a track of the tracker's world plane to the vehicle's level frame.
pub fn lane_track(level: &Level, track: &Track) -> LaneTrack {
    let [x, y, vx, vy] = track.estimate.state.to_array();
    let c = &track.estimate.covariance;
    let back = DVec2::from_angle(-level.heading_rad);
    let std = |axis: DVec2| {
        let spread =
            axis.x * axis.x * c.x_axis.x + 2.0 * axis.x * axis.y * c.x_axis.y + axis.y * axis.y * c.y_axis.y;
        spread.max(0.0).sqrt()
    };
    let ahead = DVec2::from_angle(level.heading_rad);
    LaneTrack {
        id: track.id,
        at_m: level.from_world(DVec2::new(x, y)).to_array(),
        std_m: [std(ahead), std(ahead.perp())],
        velocity_mps: back.rotate(DVec2::new(vx, vy)).to_array(),
    }
}
