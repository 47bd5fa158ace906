//! Assigns the number of its lane to each target, from a radar's targets and a map of the lanes' edges (Li,
//! Lei, Jin, Zhang and Zhao, ICCSCT 2022).
//!
//! * [`geodesy`] converts between WGS-84 and the radar's axes; [`map`] holds carriageways, their edges and
//!   lanes; [`assign`], or [`LocalMap`] for many scans, finds the lanes; [`accuracy`] counts vehicles, right
//!   and wrong.
//!
//! The document reads both edges on the line through the target perpendicular to the radar's axis
//! ([`Across::RadarAxis`]). Where the edges are parallel, the target divides that line in the same ratio as
//! the line perpendicular to the road. [`Across::RoadNormal`] takes the latter itself: it turns the axes
//! until forward is the road's own direction beside the target, so it also holds where a ramp turns across
//! the radar's axis and where a lane widens.

pub mod accuracy;
mod edge;
pub mod estimator;
pub mod file;
pub mod geodesy;
pub mod map;
pub mod of_road;
pub mod options;
#[cfg(test)]
mod tests;

pub use edge::EdgeRule;
pub use geodesy::{RadarFrame, RadarPose, Wgs84};
pub use map::{Carriageway, HdMap, Lane, LaneKind, Width};
pub use options::{HdMapOptions, from_json};

use crate::error::{self, LaneError};
use crate::numeric::erf;
use edge::Edge;
use glam::{DMat2, DVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::SQRT_2;
use std::fmt;

/// Least distance between two edges that hold a lane, m.
const MIN_GAP_M: f64 = 0.5;
/// Largest number of iterations that turn the axes to the road's normal.
const MAX_TURNS: u32 = 10;
const MAX_FULL_TURNS: u32 = 4;
/// Largest slope at which a line counts as the edge's normal: what is left changes lengths by its square.
const MAX_SLOPE: f64 = 1e-6;

/// The position of a vehicle that was seen, in the radar's level axes (x forward, y left).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Position (x forward, y left), m.
    pub position_m: DVec2,
    /// Covariance of the position, (x, y) in m². Zero where nothing is known of it.
    pub covariance_m2: DMat2,
}

impl Target {
    /// Makes a target from its position (m) and covariance (m²).
    pub const fn new(position_m: DVec2, covariance_m2: DMat2) -> Self {
        Target { position_m, covariance_m2 }
    }

    /// Makes a target from a distance over ground (m) and an azimuth (rad, positive to the left) with their
    /// standard deviations.
    pub fn polar(range_m: f64, azimuth_rad: f64, range_std_m: f64, azimuth_std_rad: f64) -> Self {
        let ahead = DVec2::from_angle(azimuth_rad);
        let turn = DMat2::from_cols(ahead, ahead.perp());
        let across_m = range_m * azimuth_std_rad;
        let own = DMat2::from_diagonal(DVec2::new(range_std_m * range_std_m, across_m * across_m));
        Target { position_m: ahead * range_m, covariance_m2: turn * own * turn.transpose() }
    }

    fn check(&self) -> Result<(), Dropped> {
        let [a, b, c, d] = self.covariance_m2.to_cols_array();
        if !self.position_m.is_finite() || !self.covariance_m2.is_finite() {
            return Err(Dropped::NotFinite);
        }
        // What rounding leaves of a singular covariance is allowed.
        let scale = a.abs().max(d.abs());
        let symmetric = (b - c).abs() <= 1e-9 * scale;
        if a < 0.0 || d < 0.0 || !symmetric || b * c > a * d + 1e-9 * scale * scale {
            return Err(Dropped::BadCovariance);
        }
        Ok(())
    }
}

/// Line across the road that is divided into lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Across {
    /// The line perpendicular to the radar's axis, as in Li.
    RadarAxis,
    /// The line perpendicular to the inner edge beside the target.
    #[default]
    RoadNormal,
}

/// Settings of the lane assignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Line across the road that is divided into lanes.
    pub across: Across,
    /// How an edge runs between its points.
    pub edge_rule: EdgeRule,
    /// Largest distance between chord and parabola at which an edge counts as dense and is followed by
    /// chords, m.
    pub dense_sagitta_m: f64,
    /// Share of the carriageway's width by which a target may lie inside the inner edge and still count as in
    /// the first lane (the document's alpha). None: the width of the map's median strip.
    pub alpha: Option<f64>,
    /// Share of the carriageway's width by which a target may lie outside the outer edge and still count as
    /// in the last lane, the emergency lane on a road that has one (the document's beta). None: the width of
    /// the map's shoulder strip.
    pub beta: Option<f64>,
    /// Standard deviation of the map's edges, m, added to that of the targets.
    pub map_std_m: f64,
    /// Share by which the distance between the edges may differ from the sum of the lanes' widths. Beyond it
    /// the map contradicts itself beside the target, as at a bay that no lane describes.
    pub width_tolerance: f64,
}

impl Default for Settings {
    /// The road's normal, guarded parabolas, chords where they are within a centimetre, limits from the map's
    /// strips, and a map without error whose widths agree within 15 %.
    fn default() -> Self {
        Settings {
            across: Across::default(),
            edge_rule: EdgeRule::default(),
            dense_sagitta_m: 0.01,
            alpha: None,
            beta: None,
            map_std_m: 0.0,
            width_tolerance: 0.15,
        }
    }
}

impl Settings {
    fn check(&self) -> Result<(), LaneError> {
        let good = |v: f64| v.is_finite() && v >= 0.0;
        error::settings(&[
            ("dense_sagitta_m", good(self.dense_sagitta_m)),
            ("alpha", good(self.alpha.unwrap_or(0.0))),
            ("beta", good(self.beta.unwrap_or(0.0))),
            ("map_std_m", good(self.map_std_m)),
            ("width_tolerance", good(self.width_tolerance)),
        ])
    }
}

/// Whether the target lies on the lane that it was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The target lies between the edges of the carriageway.
    Inside,
    /// The target lies within alpha inside the inner edge and is taken for the first lane.
    FromMedian,
    /// The target lies within beta outside the outer edge and is taken for the last lane.
    FromShoulder,
}

/// The lane that a target was assigned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LanePlace {
    /// Index into the map's carriageways.
    pub carriageway: usize,
    /// Number of the lane in the map.
    pub number: i32,
    /// What the lane is for.
    pub kind: LaneKind,
    /// Ratio (y_target - y_inner) / (y_outer - y_inner): 0 on the inner edge, 1 on the outer (Li, eq. 5).
    pub rate: f64,
    /// Whether the target lies on the lane.
    pub fit: Fit,
    /// Distance along the inner edge from its first point, m.
    pub station_m: f64,
    /// Distance between the edges along the line across, m.
    pub gap_m: f64,
    /// Standard deviation of the target's position across the road, along the same line, m.
    pub across_std_m: f64,
    /// Probability that the target's true position is between the lines of this lane, for a normal error. It
    /// is below one half for a target that was taken in from a strip.
    pub probability: f64,
    /// Number and probability of the next likely lane of this carriageway.
    pub next: Option<(i32, f64)>,
    /// Whether another carriageway of the map holds the target, too: roads that cross or share their ends.
    pub overlap: bool,
}

/// Why a target got no lane.
#[derive(Debug, Clone, PartialEq)]
pub enum Dropped {
    /// The position or covariance is non-finite.
    NotFinite,
    /// The covariance has a negative variance or is not a covariance matrix.
    BadCovariance,
    /// No carriageway has both edges beside the target.
    BeyondMap,
    /// The edges meet or cross beside the target, or no lane has a width there.
    NoRoom,
    /// The target is between edges whose distance differs from the sum of the lanes' widths.
    Mismatch {
        /// Distance of the edges beside the target, m.
        gap_m: f64,
        /// Sum of the lanes' widths there, m.
        lanes_m: f64,
    },
    /// The target lies farther inside the inner edge than alpha allows.
    Median {
        /// How far inside the inner edge the target lies, m.
        beyond_m: f64,
    },
    /// The target lies farther outside the outer edge than beta allows.
    Roadside {
        /// How far outside the outer edge the target lies, m.
        beyond_m: f64,
    },
    /// The map, pose or settings cannot be used.
    Map(LaneError),
}

impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Dropped::NotFinite => write!(f, "the target's position or covariance is not finite"),
            Dropped::BadCovariance => write!(f, "the target's covariance is not positive definite"),
            Dropped::BeyondMap => write!(f, "no carriageway of the map has both edges beside the target"),
            Dropped::NoRoom => write!(f, "the carriageway has no width beside the target"),
            Dropped::Mismatch { gap_m, lanes_m } => {
                write!(
                    f,
                    "the edges are {gap_m:.2} m apart beside the target, the lanes measure {lanes_m:.2} m"
                )
            }
            Dropped::Median { beyond_m } => {
                write!(f, "the target is {beyond_m:.2} m inside the inner edge, more than alpha allows")
            }
            Dropped::Roadside { beyond_m } => {
                write!(f, "the target is {beyond_m:.2} m outside the outer edge, more than beta allows")
            }
            Dropped::Map(fault) => write!(f, "{fault}"),
        }
    }
}

impl std::error::Error for Dropped {}

/// The result for one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Index of the target in the input.
    pub target: usize,
    /// The lane, or why there is none.
    pub lane: Result<LanePlace, Dropped>,
}

impl Assignment {
    /// Number of the lane, or None where there is none.
    pub fn number(&self) -> Option<i32> {
        self.lane.as_ref().ok().map(|l| l.number)
    }
}

/// Assigns lanes with the default [`Settings`]: one assignment for each target, in order. If the map or the
/// pose cannot be used, every target gets that reason.
pub fn assign(map: &HdMap, pose: &RadarPose, targets: &[Target]) -> Vec<Assignment> {
    match LocalMap::new(map, pose, Settings::default()) {
        Ok(local) => local.assign(targets),
        Err(fault) => (0..targets.len())
            .map(|target| Assignment { target, lane: Err(Dropped::Map(fault.clone())) })
            .collect(),
    }
}

/// A map in the axes of one radar, prepared for many scans.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalMap {
    map: HdMap,
    settings: Settings,
    /// Inner and outer edge of each carriageway.
    edges: Vec<[Edge; 2]>,
}

impl LocalMap {
    /// Converts a map to the axes of a radar at `pose`.
    ///
    /// # Errors
    /// Returns an error for the first fault of the settings, the map or the pose, or for an edge with fewer
    /// than two distinct points.
    pub fn new(map: &HdMap, pose: &RadarPose, settings: Settings) -> Result<Self, LaneError> {
        settings.check()?;
        map.check()?;
        let frame = RadarFrame::new(pose)
            .ok_or(LaneError::refused("the radar's pose is not finite or not near the earth"))?;
        let edge = |way: &Carriageway, places: &[Wgs84]| {
            Edge::new(places.iter().map(|p| frame.radar_m(p).truncate())).ok_or(LaneError::refused(format!(
                "an edge of carriageway `{}` has fewer than two distinct points",
                way.name.clone()
            )))
        };
        let edges = map
            .carriageways
            .iter()
            .map(|way| Ok([edge(way, &way.inner_edge)?, edge(way, &way.outer_edge)?]))
            .collect::<Result<_, LaneError>>()?;
        Ok(LocalMap { map: map.clone(), settings, edges })
    }

    /// Assigns lanes: one assignment for each target, in order.
    pub fn assign(&self, targets: &[Target]) -> Vec<Assignment> {
        targets.iter().enumerate().map(|(target, t)| Assignment { target, lane: self.place(t) }).collect()
    }

    /// Finds the lane of one target. Of the carriageways that hold it, the one with the highest probability
    /// counts; otherwise those that take it in from a strip; otherwise the reason of the one whose edge is
    /// nearest is returned.
    ///
    /// # Errors
    /// Returns the reason why the target has no lane.
    pub fn place(&self, target: &Target) -> Result<LanePlace, Dropped> {
        target.check()?;
        let mut found: Option<LanePlace> = None;
        let mut holders = 0;
        let mut reason = (f64::INFINITY, Dropped::BeyondMap);
        for way in 0..self.edges.len() {
            match self.place_on(way, target) {
                Ok(new) => {
                    holders += usize::from(new.fit == Fit::Inside);
                    let merit = |l: &LanePlace| (l.fit == Fit::Inside, l.probability);
                    if found.is_none_or(|old| merit(&new) > merit(&old)) {
                        found = Some(new);
                    }
                }
                Err(why) => {
                    let off_m = match why {
                        Dropped::Median { beyond_m } | Dropped::Roadside { beyond_m } => beyond_m,
                        Dropped::Mismatch { .. } => -1.0,
                        Dropped::NoRoom => f64::MAX,
                        _ => continue,
                    };
                    if off_m < reason.0 {
                        reason = (off_m, why);
                    }
                }
            }
        }
        match found {
            Some(place) => Ok(LanePlace { overlap: holders > 1, ..place }),
            None => Err(reason.1),
        }
    }

    /// Directions of the carriageways that hold a position, along their inner edges.
    pub fn directions(&self, position_m: DVec2) -> impl Iterator<Item = DVec2> {
        let target = Target::new(position_m, DMat2::ZERO);
        let holds =
            move |way: &usize| self.place_on(*way, &target).is_ok_and(|place| place.fit == Fit::Inside);
        (0..self.edges.len()).filter(holds).map(move |way| self.edges[way][0].heading_near(position_m))
    }

    fn place_on(&self, way: usize, target: &Target) -> Result<LanePlace, Dropped> {
        let Settings { across, edge_rule: rule, dense_sagitta_m: dense, alpha, beta, .. } = self.settings;
        let [inner, outer] = &self.edges[way];
        let p = target.position_m;
        let meet = |edge: &Edge, forward, near_m| {
            edge.cross(p, forward, near_m, rule, dense).ok_or(Dropped::BeyondMap)
        };
        let mut forward = match across {
            Across::RadarAxis => DVec2::X,
            Across::RoadNormal => inner.heading_near(p),
        };
        let mut inside = meet(inner, forward, 0.0)?;
        if across == Across::RoadNormal {
            let mut part = 1.0;
            for turn in 0..MAX_TURNS {
                if inside.slope.abs() < MAX_SLOPE {
                    break;
                }
                // At a corner of the edge the slope jumps: halving the turns ends between its two sides.
                if turn >= MAX_FULL_TURNS {
                    part *= 0.5;
                }
                forward =
                    forward.rotate(DVec2::from_angle(part * inside.slope.atan())).normalize_or(DVec2::X);
                inside = meet(inner, forward, 0.0)?;
            }
        }
        let outside = meet(outer, forward, inside.lateral_m)?;

        let gap = outside.lateral_m - inside.lateral_m;
        let gap_m = gap.abs();
        if gap_m < MIN_GAP_M {
            return Err(Dropped::NoRoom);
        }
        let rate = -inside.lateral_m / gap;
        if !rate.is_finite() {
            return Err(Dropped::BeyondMap);
        }
        let station_m = inside.station_m;
        let carriageway = &self.map.carriageways[way];
        let lanes = || carriageway.between_edges();
        let total_m: f64 = lanes().map(|l| l.width_m.at_m(station_m)).sum();
        if total_m <= 0.0 {
            return Err(Dropped::NoRoom);
        }
        let strip = |kind| carriageway.strip_m(kind, station_m) / total_m;
        let alpha = alpha.unwrap_or_else(|| strip(LaneKind::Median));
        let beta = beta.unwrap_or_else(|| strip(LaneKind::Shoulder));
        if rate < -alpha {
            return Err(Dropped::Median { beyond_m: -rate * gap_m });
        }
        if rate > 1.0 + beta {
            return Err(Dropped::Roadside { beyond_m: (rate - 1.0) * gap_m });
        }
        let square_m = gap_m / inside.slope.hypot(1.0);
        if (square_m - total_m).abs() > self.settings.width_tolerance * total_m {
            return Err(Dropped::Mismatch { gap_m: square_m, lanes_m: total_m });
        }
        let fit = match rate {
            r if r < 0.0 => Fit::FromMedian,
            r if r > 1.0 => Fit::FromShoulder,
            _ => Fit::Inside,
        };

        // An error ahead moves the target across a road that does not run straight ahead.
        let aside = forward.perp() - inside.slope * forward;
        let variance_m2 = aside.dot(target.covariance_m2 * aside) + self.settings.map_std_m.powi(2);
        if !variance_m2.is_finite() {
            return Err(Dropped::BadCovariance);
        }
        let std = variance_m2.max(0.0).sqrt();
        // Cumulative widths over their sum (Li, eq. 3 and 4), and what lies below them.
        let mut chosen: Option<(&Lane, f64)> = None;
        let mut next: Option<(i32, f64)> = None;
        let mut sum_m = 0.0;
        let mut low = side_of(-rate * gap_m, std);
        for lane in lanes() {
            let from = sum_m / total_m;
            let width_m = lane.width_m.at_m(station_m);
            if width_m <= 0.0 {
                continue;
            }
            sum_m += width_m;
            let high = side_of((sum_m / total_m - rate) * gap_m, std);
            let probability = (0.5 * (high - low)).clamp(0.0, 1.0);
            low = high;
            // The first lane takes all below it, and each next one that begins at or below the target.
            let mut other = Some((lane.number, probability));
            if chosen.is_none() || rate >= from {
                other = chosen.replace((lane, probability)).map(|(l, p)| (l.number, p));
            }
            if let Some(o) = other
                && next.is_none_or(|n| o.1 > n.1)
            {
                next = Some(o);
            }
        }
        let (lane, probability) = chosen.ok_or(Dropped::NoRoom)?;
        Ok(LanePlace {
            carriageway: way,
            number: lane.number,
            kind: lane.kind,
            rate,
            fit,
            station_m,
            gap_m,
            across_std_m: std,
            probability,
            next,
            overlap: false,
        })
    }
}

/// How much likelier a normal error lies below a value than above it, -1 to 1. Without an error the value 0
/// gives -1, so that a target on a line counts outwards.
fn side_of(value_m: f64, std_m: f64) -> f64 {
    match std_m > 0.0 {
        true => erf(value_m / (std_m * SQRT_2)),
        false if value_m > 0.0 => 1.0,
        false => -1.0,
    }
}
