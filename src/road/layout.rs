//! What a road is made of across: lanes from the axis outwards, painted lines, and places given by lane or edge.

use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::Pose;
use crate::road::axis::{RoadAxis, RoadPoint, pose_on};
use crate::road::profile::Profile;
use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Type of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LaneKind {
    /// A driving lane.
    Driving,
    /// Hard shoulder, an emergency lane.
    Emergency,
    /// An emergency bay: a lane whose width increases from zero and returns to zero.
    Bay,
    /// A ramp: entry, exit, or a lane that widens into one.
    Ramp,
    /// A shoulder.
    Shoulder,
    /// A bicycle lane.
    Bicycle,
    /// A parking lane.
    Parking,
    /// A sidewalk.
    Sidewalk,
    /// A median between two carriageways.
    Median,
    /// Ground beside the road.
    Verge,
}

impl LaneKind {
    /// Whether a vehicle may stand on the lane.
    pub fn is_drivable(self) -> bool {
        !matches!(self, LaneKind::Sidewalk | LaneKind::Median | LaneKind::Verge)
    }
}

/// Driving direction of a lane relative to the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Driven {
    /// In the direction of the axis.
    Forward,
    /// Opposite to the direction of the axis.
    Backward,
    /// Both directions.
    Both,
}

/// Type of a painted line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LineKind {
    /// No line.
    #[default]
    None,
    /// Solid.
    Solid,
    /// Dashed.
    Dashed,
    /// Two solid lines, separated by their width.
    Double,
}

/// A side of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// To its left.
    Left,
    /// To its right.
    Right,
}

impl Side {
    /// Sign of t on this side.
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }
}

/// Reference in a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InLane {
    /// Its left edge.
    Left,
    /// Its middle.
    #[default]
    Centre,
    /// Its right edge.
    Right,
}

/// One lane.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// Unique in its road.
    pub number: i32,
    /// What it is for.
    pub kind: LaneKind,
    /// Which way it is driven.
    pub driven: Driven,
    /// Width along s, m; where it is zero there is no lane.
    pub width: Profile,
    /// Radar material of its surface; None leaves a hole.
    pub surface: Option<String>,
    /// Painted on its edge away from the axis.
    pub line: LineKind,
}

/// Dimensions and material of painted lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Paint {
    /// Width of a line, m.
    pub width_m: f64,
    /// Length of a dash, m.
    pub dash_m: f64,
    /// Length of a gap, m.
    pub gap_m: f64,
    /// Height of the paint over the road.
    pub thickness_m: f64,
    /// Radar material of the paint, without the road under it.
    pub material: String,
}

/// A lateral place that follows the road.
#[derive(Debug, Clone, PartialEq)]
pub struct Lateral {
    /// What the offset counts from.
    pub base: Base,
    /// Added to it, positive to the left.
    pub offset: Profile,
}

/// Place from which a lateral offset counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Base {
    /// The axis.
    Axis,
    /// The outer edge of the outermost lane that is drivable.
    Edge(Side),
    /// Index into the lanes of a side.
    Lane(Side, usize, InLane),
}

impl Lateral {
    /// A place so far to the left of the axis, m.
    pub fn axis(t_m: f64) -> Lateral {
        Lateral { base: Base::Axis, offset: Profile::constant(t_m) }
    }
}

/// An axis with its lanes.
#[derive(Debug, Clone, PartialEq)]
pub struct Road {
    /// Name of the road.
    pub name: String,
    /// Its axis.
    pub axis: RoadAxis,
    /// Distance from the axis at which the lanes begin, to its left, m.
    pub lane_offset: Profile,
    /// Lanes to the left of the axis, from the axis outwards.
    pub left: Vec<Lane>,
    /// Lanes to the right, from the axis outwards.
    pub right: Vec<Lane>,
    /// Line along the axis.
    pub centre_line: LineKind,
    /// Dimensions and material of painted lines.
    pub paint: Paint,
}

impl Road {
    /// Checks the lanes.
    ///
    /// # Errors
    /// Returns an error for numbers that come twice, or a width below zero somewhere on the road.
    pub fn check(&self) -> Result<()> {
        let mut numbers: Vec<i32> = self.lanes().map(|(_, _, l)| l.number).collect();
        numbers.sort_unstable();
        if let Some(w) = numbers.windows(2).find(|w| w[0] == w[1]) {
            return Err(BadInput::new("two lanes of the road have this number")
                .key(format!("lanes of road '{}'", self.name))
                .value(w[0])
                .remedy("give each lane a number of its own")
                .into());
        }
        let end = self.axis.length_m();
        let right = self.axis.right_slope().map(|p| (p, "cross slope", 1.0, 1.0));
        for (profile, what, most, steepest) in [
            (self.axis.height(), "height", 1e5, 10.0),
            (self.axis.cross_slope(), "cross slope", 1.0, 1.0),
            (&self.lane_offset, "offset of the lanes", 1000.0, f64::INFINITY),
        ]
        .into_iter()
        .chain(right)
        {
            profile.check_gentle(end, most, steepest).map_err(|e| match e {
                Error::Input(b) => Error::from((*b).key(format!("{what} of road '{}'", self.name))),
                e => e,
            })?;
        }
        for (_, _, lane) in self.lanes() {
            let places = lane.width.breaks_m().chain((0..=200).map(|i| end * f64::from(i) / 200.0));
            for s in places.filter(|s| (0.0..=end).contains(s)) {
                let w = lane.width.value(s);
                if !(-1e-6..=1000.0).contains(&w) {
                    return Err(BadInput::new("is not a lane width")
                        .key(format!("lane {} of road '{}' at s = {s:.3} m", lane.number, self.name))
                        .value(w)
                        .allowed("0..=1000 m")
                        .into());
                }
            }
        }
        let places = self.stations_m(0.0, end, (1e-4 * end).max(0.05));
        for (side, i, lane) in self.lanes() {
            let edge = |s: f64| self.edge_t_m(side, i, true, s);
            self.check_turns(&format!("lane {}", lane.number), &edge, &places)?;
        }
        Ok(())
    }

    /// Checks that a line beside the axis does not fold over itself.
    ///
    /// # Errors
    /// Returns an error if the line t(s) comes nearer to the centre of a curve than a fiftieth of its radius at one of
    /// the places: what runs along it would fold over itself.
    pub fn check_turns(&self, what: &str, t_m: &dyn Fn(f64) -> f64, places_m: &[f64]) -> Result<()> {
        for s in places_m {
            // Elements meet with a step of curvature: both sides count.
            for curvature in [s - 1e-6, s + 1e-6].map(|s| self.axis.at(s).curvature_per_m) {
                let t = t_m(*s);
                if curvature * t > 0.98 {
                    return Err(BadInput::new("reaches beyond the centre of the curve")
                        .key(format!("{what} of road '{}' at s = {s:.3} m", self.name))
                        .value(format!("{:.3} m from the axis", t.abs()))
                        .allowed(format!("less than {:.3} m", 0.98 / curvature.abs()))
                        .remedy("give a larger radius or a narrower road")
                        .into());
                }
            }
        }
        Ok(())
    }

    /// Lanes of a side, from the axis outwards.
    pub fn side(&self, side: Side) -> &[Lane] {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }

    /// All lanes with their side and index there, from the left edge to the right.
    pub fn lanes(&self) -> impl Iterator<Item = (Side, usize, &Lane)> {
        let left = self.left.iter().enumerate().rev().map(|(i, l)| (Side::Left, i, l));
        left.chain(self.right.iter().enumerate().map(|(i, l)| (Side::Right, i, l)))
    }

    /// Distance t of the edge of a side's lane `index` towards the axis (`outer` false) or away from it, m.
    pub fn edge_t_m(&self, side: Side, index: usize, outer: bool, s_m: f64) -> f64 {
        let n = index + usize::from(outer);
        let width: f64 = self.side(side)[..n].iter().map(|l| l.width.value(s_m).max(0.0)).sum();
        self.lane_offset.value(s_m) + side.sign() * width
    }

    /// Distances t of the left and right edge of a lane, m.
    pub fn lane_edges_t_m(&self, side: Side, index: usize, s_m: f64) -> (f64, f64) {
        let (inner, outer) = (self.edge_t_m(side, index, false, s_m), self.edge_t_m(side, index, true, s_m));
        match side {
            Side::Left => (outer, inner),
            Side::Right => (inner, outer),
        }
    }

    /// Width of the drivable lanes with a surface that follow outwards on a lane without a gap.
    pub fn paved_beyond_m(&self, side: Side, index: usize, s_m: f64) -> f64 {
        let beyond = &self.side(side)[index + 1..];
        let paved = beyond.iter().take_while(|l| l.kind.is_drivable() && l.surface.is_some());
        paved.map(|l| l.width.value(s_m).max(0.0)).sum()
    }

    /// Number of lanes of a side up to the outermost drivable one.
    pub fn drivable(&self, side: Side) -> usize {
        self.side(side).iter().rposition(|l| l.kind.is_drivable()).map_or(0, |i| i + 1)
    }

    /// Distance t of a lateral place at station `s_m`, m.
    pub fn t_m(&self, lateral: &Lateral, s_m: f64) -> f64 {
        let base = match lateral.base {
            Base::Axis => 0.0,
            Base::Edge(side) => match self.drivable(side) {
                0 => self.lane_offset.value(s_m),
                n => self.edge_t_m(side, n - 1, true, s_m),
            },
            Base::Lane(side, index, place) => {
                let (left, right) = self.lane_edges_t_m(side, index, s_m);
                match place {
                    InLane::Left => left,
                    InLane::Centre => 0.5 * (left + right),
                    InLane::Right => right,
                }
            }
        };
        base + lateral.offset.value(s_m)
    }

    /// The greatest |t| of all lanes.
    pub fn reach_m(&self) -> f64 {
        let end = self.axis.length_m();
        let marks = self.breaks_m().into_iter().chain([0.0, end]).filter(|s| (0.0..=end).contains(s));
        let widest = |s: f64| {
            let reach = |side| match self.side(side).len() {
                0 => self.lane_offset.value(s).abs(),
                n => self.edge_t_m(side, n - 1, true, s).abs(),
            };
            reach(Side::Left).max(reach(Side::Right))
        };
        marks.map(widest).fold(0.0, f64::max)
    }

    /// Stations at which widths and offsets change their course, m.
    pub fn breaks_m(&self) -> Vec<f64> {
        let widths = self.lanes().flat_map(|(_, _, l)| l.width.breaks_m()).collect::<Vec<_>>();
        widths.into_iter().chain(self.lane_offset.breaks_m()).collect()
    }

    /// Stations between which every edge of a lane is straight to within `sagitta_m`.
    pub fn stations_m(&self, from_m: f64, to_m: f64, sagitta_m: f64) -> Vec<f64> {
        let end = self.axis.length_m();
        let width =
            |l: &Lane| l.width.breaks_m().map(|s| l.width.value(s.clamp(0.0, end))).fold(0.0, f64::max);
        let widest = self.lanes().map(|(_, _, l)| width(l)).fold(0.0, f64::max);
        let mut marks = self.axis.stations_m(from_m, to_m, sagitta_m, self.reach_m(), widest);
        add_marks(&mut marks, self.breaks_m());
        let mut out = vec![marks[0]];
        for w in marks.windows(2) {
            let bend = |p: &Profile| p.bend(w[0], w[1]);
            let bend: f64 =
                self.lanes().map(|(_, _, l)| bend(&l.width)).sum::<f64>() + bend(&self.lane_offset);
            let n = ((w[1] - w[0]) * (bend / 8.0 / sagitta_m).sqrt()).ceil().clamp(1.0, 1e6);
            out.extend((1..=n as usize).map(|i| w[0] + (w[1] - w[0]) * i as f64 / n));
        }
        out
    }
}

/// Adds places that lie between the first and the last to a sorted list.
pub fn add_marks(stations: &mut Vec<f64>, marks: impl IntoIterator<Item = f64>) {
    let (first, last) = (stations[0], stations[stations.len() - 1]);
    stations.extend(marks.into_iter().filter(|s| *s > first + 1e-6 && *s < last - 1e-6));
    stations.sort_by(f64::total_cmp);
    stations.dedup_by(|b, a| *b - *a < 1e-6);
}

/// Just beside the facets their planes go on this far.
const MARGIN_M: f64 = 0.2;

/// The facets of a road's surface, for what lies on it.
pub struct Deck<'a> {
    road: &'a Road,
    stations: &'a [f64],
    /// Triangles between each station and the next.
    cells: Vec<Vec<[DVec3; 3]>>,
}

impl<'a> Deck<'a> {
    /// The deck of a road, from its stations and the cells between them.
    pub fn new(road: &'a Road, stations: &'a [f64], cells: Vec<Vec<[DVec3; 3]>>) -> Deck<'a> {
        Deck { road, stations, cells }
    }

    /// Height of the facets near `s_m` at a place in plan, and their normal there; within 0.2 m (`MARGIN_M`) of the facets
    /// those of the nearest, in its plane, and None farther off.
    pub fn facet(&self, s_m: f64, at_m: DVec2) -> Option<(f64, DVec3)> {
        let i = self.stations.partition_point(|s| *s <= s_m).saturating_sub(1);
        // (distance, height, normal)
        let nearest = |k: usize, within_m: f64| {
            let mut nearest: Option<(f64, f64, DVec3)> = None;
            for [a, b, c] in self.cells.get(k).into_iter().flatten() {
                let flat = |p: &DVec3| p.truncate();
                let (u, v, p) = (flat(b) - flat(a), flat(c) - flat(a), at_m - flat(a));
                let det = u.perp_dot(v);
                let (x, y) = (p.perp_dot(v) / det, u.perp_dot(p) / det);
                // Distances from the three sides, positive outside.
                let off = (-x * det / v.length())
                    .max(-y * det / u.length())
                    .max((x + y - 1.0) * det / (v - u).length())
                    .max(0.0);
                if off <= within_m && nearest.is_none_or(|n| off < n.0) {
                    let z = a.z + x * (b.z - a.z) + y * (c.z - a.z);
                    nearest = Some((off, z, (*b - *a).cross(*c - *a).normalize_or(DVec3::Z)));
                }
            }
            nearest
        };
        // Beside the facets only those of the same stretch count: sides of slivers point at all that is ahead.
        let inside = [i, i.wrapping_sub(1), i + 1].into_iter().find_map(|k| nearest(k, 1e-9));
        inside.or_else(|| nearest(i, MARGIN_M)).map(|(_, z, normal)| (z, normal))
    }

    /// The point of the facets at (s, t) and their normal there; off the facets those of the exact surface.
    pub fn ground(&self, s_m: f64, t_m: f64) -> (DVec3, DVec3) {
        let exact = self.road.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
        match self.facet(s_m, exact.truncate()) {
            Some((z, normal)) => (exact.truncate().extend(z), normal),
            None => (exact, self.road.axis.normal(s_m, t_m)),
        }
    }

    /// The pose of what lies at (s, t), `lift_m` over the facets, with x turned by `yaw_rad` from the axis;
    /// upright when it does not lie.
    pub fn pose(
        &self,
        s_m: f64,
        t_m: f64,
        lift_m: f64,
        yaw_rad: f64,
        lying: bool,
    ) -> Pose<crate::base::frames::Target, crate::base::frames::World> {
        let (at, normal) = self.ground(s_m, t_m);
        let up = if lying { normal } else { DVec3::Z };
        pose_on(at + lift_m * up, up, self.road.axis.at(s_m).heading_rad + yaw_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::axis::Course;

    fn lane(number: i32, width: Profile, kind: LaneKind) -> Lane {
        Lane {
            number,
            kind,
            driven: Driven::Forward,
            width,
            surface: Some("asphalt".into()),
            line: LineKind::None,
        }
    }

    fn road() -> Road {
        Road {
            name: "r".into(),
            axis: RoadAxis::new(DVec3::ZERO, 0.0, &[Course::Straight { length_m: 100.0 }]).unwrap(),
            lane_offset: Profile::constant(0.0),
            left: vec![lane(11, Profile::constant(3.0), LaneKind::Driving)],
            right: vec![
                lane(1, Profile::constant(3.5), LaneKind::Driving),
                lane(
                    2,
                    Profile::linear(&[[20.0, 0.0], [40.0, 3.0], [60.0, 3.0], [80.0, 0.0]]).unwrap(),
                    LaneKind::Bay,
                ),
                lane(3, Profile::constant(2.0), LaneKind::Verge),
            ],
            centre_line: LineKind::None,
            paint: Paint {
                width_m: 0.12,
                dash_m: 6.0,
                gap_m: 12.0,
                thickness_m: 0.002,
                material: "paint-white".into(),
            },
        }
    }

    #[test]
    fn edges_are_sums_of_widths() {
        let r = road();
        r.check().unwrap();
        assert_eq!(r.lane_edges_t_m(Side::Left, 0, 5.0), (3.0, 0.0));
        assert_eq!(r.lane_edges_t_m(Side::Right, 1, 30.0), (-3.5, -5.0));
        let t = |base, s| r.t_m(&Lateral { base, offset: Profile::constant(0.25) }, s);
        assert_eq!(t(Base::Edge(Side::Right), 10.0), -3.25);
        assert_eq!(t(Base::Edge(Side::Right), 50.0), -6.25);
        assert_eq!(t(Base::Edge(Side::Left), 50.0), 3.25);
        assert_eq!(t(Base::Lane(Side::Right, 0, InLane::Centre), 50.0), -1.5);
        assert_eq!(t(Base::Axis, 50.0), 0.25);
        assert_eq!(r.reach_m(), 8.5);
        assert_eq!(r.stations_m(0.0, 100.0, 0.005), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(r.lanes().map(|(_, _, l)| l.number).collect::<Vec<_>>(), [11, 1, 2, 3]);
    }

    #[test]
    fn contradictions_are_refused() {
        let mut r = road();
        r.right[2].number = 11;
        assert!(r.check().unwrap_err().to_string().contains("two lanes"));
        let mut r = road();
        r.right[1].width = Profile::linear(&[[0.0, 1.0], [50.0, -1.0]]).unwrap();
        assert!(r.check().unwrap_err().to_string().contains("is not a lane width"));
    }

    #[test]
    fn lanes_do_not_fold() {
        let mut r = road();
        let arc = |curvature_per_m| Course::Arc { length_m: 10.0, curvature_per_m };
        let axis =
            |k| RoadAxis::new(DVec3::ZERO, 0.0, &[Course::Straight { length_m: 90.0 }, arc(k)]).unwrap();
        r.axis = axis(0.2);
        r.check().unwrap();
        r.axis = axis(-0.2);
        let e = r.check().unwrap_err().to_string();
        assert!(
            e.contains("lane 3 of road 'r'")
                && e.contains("beyond the centre")
                && e.contains("less than 4.900 m"),
            "{e}"
        );
    }

    #[test]
    fn ground_is_the_facet_and_not_the_surface() {
        let mut r = road();
        let change = crate::road::axis::GradeChange { s_m: 50.0, grade: -0.1, k_m_per_percent: 5.0 };
        r.axis = r.axis.with_grades(0.1, &[change]).unwrap();
        let corner = |s_m, t_m| r.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
        let (a, b, c, d) = (corner(0.0, -3.5), corner(100.0, -3.5), corner(100.0, 3.0), corner(0.0, 3.0));
        let stations = [0.0, 100.0];
        let deck = Deck::new(&r, &stations, vec![vec![[a, b, c], [a, c, d]]]);
        let (p, n) = deck.ground(50.0, 1.0);
        assert!((p - DVec3::new(50.0, 1.0, 0.0)).length() < 1e-12 && (n - DVec3::Z).length() < 1e-12);
        let (q, _) = deck.ground(50.0, 20.0);
        assert!((q.z - 2.5).abs() < 1e-12, "the surface beside: {q}");
        let pose = deck.pose(50.0, 1.0, 0.002, 0.5, true);
        assert!((pose.translation_m - DVec3::new(50.0, 1.0, 0.002)).length() < 1e-12);
    }
}
