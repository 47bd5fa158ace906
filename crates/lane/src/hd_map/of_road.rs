//! Maps of roads that were built here: the edges of their lanes, surveyed with an error and placed on the
//! earth.

use super::geodesy::{RadarFrame, RadarPose};
use super::{Carriageway, HdMap, Lane, LaneKind, Width};
use catseye::road::axis::RoadPoint;
use catseye::road::labels::{Polyline, RoadLabel};
use catseye::road::layout::{Driven, LaneKind as Built, Road, Side};
use glam::{DVec2, DVec3};

/// Distance before a step of a width at which a station is placed, m.
const BEFORE_STEP_M: f64 = 5e-4;
/// Least change of width over that distance that counts as a step, m.
const STEP_M: f64 = 0.01;
/// Points closer than this are surveyed as one, m.
const ONE_POINT_M: f64 = 0.01;
/// Two lines closer than this bound no lane, m.
const NO_WIDTH_M: f64 = 1e-6;

/// The lanes of one road at stations along it, in world coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Stripes {
    /// Name of the carriageway.
    pub name: String,
    /// Lanes and strips from the left edge to the right.
    pub stripes: Vec<Stripe>,
}

/// One lane or strip of a carriageway.
#[derive(Debug, Clone, PartialEq)]
pub struct Stripe {
    /// Number of the lane.
    pub number: i32,
    /// Kind of lane with which the road was built.
    pub kind: Built,
    /// Direction in which it is driven.
    pub driven: Driven,
    /// Points of its left edge, one for each station, m.
    pub left_m: Vec<DVec3>,
    /// Points of its right edge, one for each station, m.
    pub right_m: Vec<DVec3>,
}

impl Stripes {
    /// Samples a road at even stations, `spacing_m` apart or less, and at all places where a width changes
    /// its course.
    pub fn of_road(road: &Road, spacing_m: f64) -> Stripes {
        let end = road.axis.length_m();
        let mut stations = even(0.0, end, spacing_m);
        for b in road.breaks_m() {
            let wide = |s: f64| road.lanes().map(|(_, _, l)| l.width.value(s).max(0.0)).collect::<Vec<_>>();
            let step = wide(b - BEFORE_STEP_M).iter().zip(wide(b)).any(|(a, b)| (a - b).abs() > STEP_M);
            let before = step.then_some(b - BEFORE_STEP_M);
            stations.extend(before.into_iter().chain([b]).filter(|s| *s > 0.0 && *s < end));
        }
        stations.sort_by(f64::total_cmp);
        stations.dedup_by(|b, a| *b - *a < 0.1 * BEFORE_STEP_M);
        let along = |side: Side, index: usize, outer: bool| -> Vec<DVec3> {
            let at = |s: f64| RoadPoint { s_m: s, t_m: road.edge_t_m(side, index, outer, s), h_m: 0.0 };
            stations.iter().map(|s| road.axis.world(at(*s))).collect()
        };
        let stripe = |(side, i, lane): (Side, usize, &catseye::road::layout::Lane)| {
            let (inner, outer) = (along(side, i, false), along(side, i, true));
            let (left_m, right_m) = if side == Side::Left { (outer, inner) } else { (inner, outer) };
            Stripe { number: lane.number, kind: lane.kind, driven: lane.driven, left_m, right_m }
        };
        Stripes { name: road.name.clone(), stripes: road.lanes().map(stripe).collect() }
    }

    /// Samples a road from its labels. Labels do not hold steps of a width: these become slopes.
    pub fn of_label(label: &RoadLabel, spacing_m: f64) -> Stripes {
        let places: Vec<(usize, f64)> = (0..label.s_m.len().saturating_sub(1))
            .flat_map(|i| {
                let part = even(0.0, label.s_m[i + 1] - label.s_m[i], spacing_m);
                let whole = part[part.len() - 1].max(NO_WIDTH_M);
                let last = i + 2 == label.s_m.len();
                let n = if last { part.len() } else { part.len() - 1 };
                part.into_iter().take(n).map(move |s| (i, s / whole)).collect::<Vec<_>>()
            })
            .collect();
        let along = |line: &Polyline| -> Vec<DVec3> {
            let at = |(i, share): &(usize, f64)| {
                DVec3::from_array(line[*i]).lerp(DVec3::from_array(line[*i + 1]), *share)
            };
            places.iter().map(at).collect()
        };
        let stripes = label
            .lanes
            .iter()
            .map(|l| Stripe {
                number: l.number,
                kind: l.kind,
                driven: l.driven,
                left_m: along(&l.left_m),
                right_m: along(&l.right_m),
            })
            .collect();
        Stripes { name: label.name.clone(), stripes }
    }

    /// Number and kind of the lane in which a point lies; None beside all lanes. It is read directly from the
    /// lines, without map or ratio.
    pub fn lane_at(&self, p: DVec2) -> Option<(i32, Built)> {
        let inside = |s: &&Stripe| {
            (1..s.left_m.len()).any(|i| {
                let corners =
                    [s.right_m[i - 1], s.right_m[i], s.left_m[i], s.left_m[i - 1]].map(|c| c.truncate());
                let around = |k: usize| (corners[(k + 1) % 4] - corners[k]).perp_dot(p - corners[k]) >= 0.0;
                corners[2].distance(corners[1]).max(corners[3].distance(corners[0])) > NO_WIDTH_M
                    && (0..4).all(around)
            })
        };
        self.stripes.iter().find(inside).map(|s| (s.number, s.kind))
    }

    /// The carriageways with edges on the earth. `plane` is the frame of the world's axes on the earth;
    /// `error_m` returns the error of the next surveyed point across the road, m.
    pub fn carriageways(&self, plane: &RadarFrame, error_m: &mut dyn FnMut() -> f64) -> Vec<Carriageway> {
        let mut out = Vec::new();
        let mut first = 0;
        while first < self.stripes.len() {
            let driven = self.stripes[first].driven;
            let end = first + self.stripes[first..].iter().take_while(|s| s.driven == driven).count();
            let group: Vec<&Stripe> = match driven {
                // The inner edge is the left one in the direction of driving.
                Driven::Backward => self.stripes[first..end].iter().rev().collect(),
                _ => self.stripes[first..end].iter().collect(),
            };
            let name =
                if out.is_empty() { self.name.clone() } else { format!("{} {}", self.name, out.len() + 1) };
            out.extend(carriageway(name, group, driven == Driven::Backward, plane, error_m));
            first = end;
        }
        out
    }
}

/// Equally spaced values from `from` to `to`, both included, at most `spacing_m` apart.
fn even(from: f64, to: f64, spacing_m: f64) -> Vec<f64> {
    let n = ((to - from) / spacing_m.max(0.1)).ceil().clamp(1.0, 1e6) as usize;
    (0..=n).map(|i| from + (to - from) * i as f64 / n as f64).collect()
}

fn kind(built: Built) -> LaneKind {
    match built {
        Built::Driving | Built::Bicycle | Built::Parking => LaneKind::Driving,
        Built::Emergency => LaneKind::Emergency,
        Built::Bay => LaneKind::Bay,
        Built::Ramp => LaneKind::Ramp,
        Built::Median => LaneKind::Median,
        Built::Shoulder | Built::Verge | Built::Sidewalk => LaneKind::Shoulder,
    }
}

fn carriageway(
    name: String,
    mut group: Vec<&Stripe>,
    mut inner_is_right: bool,
    plane: &RadarFrame,
    error_m: &mut dyn FnMut() -> f64,
) -> Option<Carriageway> {
    let strip = |s: &&Stripe| matches!(kind(s.kind), LaneKind::Median | LaneKind::Shoulder);
    // Where traffic keeps left, the median is on the other side.
    if kind(group.last()?.kind) == LaneKind::Median && kind(group[0].kind) != LaneKind::Median {
        group.reverse();
        inner_is_right = !inner_is_right;
    }
    let between: Vec<&Stripe> = group.iter().copied().filter(|s| !strip(s)).collect();
    let (head, tail) = (between.first()?, between.last()?);
    let sides = |s: &Stripe, i: usize| match inner_is_right {
        true => (s.right_m[i], s.left_m[i]),
        false => (s.left_m[i], s.right_m[i]),
    };
    let width = |s: &Stripe, i: usize| s.left_m[i].distance(s.right_m[i]);
    let used: Vec<usize> = (0..head.left_m.len())
        .filter(|i| sides(head, *i).0.distance(sides(tail, *i).1) > NO_WIDTH_M)
        .collect();
    let (mut inner_edge, mut outer_edge, mut stations) = (Vec::new(), Vec::new(), Vec::new());
    let mut last: Option<DVec3> = None;
    let mut way_m = 0.0;
    let mut errors = [0.0; 2];
    for i in &used {
        let (a, b) = (sides(head, *i).0, sides(tail, *i).1);
        let outwards = (b - a).normalize_or_zero();
        let step_m = last.map_or(f64::INFINITY, |l| l.distance(a));
        if step_m > ONE_POINT_M {
            errors = [error_m(), error_m()];
        }
        way_m += if step_m.is_finite() { step_m } else { 0.0 };
        last = Some(a);
        stations.push(way_m);
        inner_edge.push(plane.place(a + outwards * errors[0]));
        outer_edge.push(plane.place(b + outwards * errors[1]));
    }
    let lanes = group.iter().filter_map(|s| {
        let widths: Vec<f64> = used.iter().map(|i| width(s, *i)).collect();
        let most = widths.iter().copied().fold(0.0, f64::max);
        let even = widths.iter().all(|w| (w - most).abs() < 1e-3);
        let small = |w: f64| if w < NO_WIDTH_M { 0.0 } else { w };
        let width_m = match even {
            true => Width::Constant(most),
            false => Width::Along(stations.iter().zip(&widths).map(|(s, w)| [*s, small(*w)]).collect()),
        };
        (most > NO_WIDTH_M).then_some(Lane { number: s.number, kind: kind(s.kind), width_m })
    });
    let lanes: Vec<Lane> = lanes.collect();
    (used.len() > 1).then_some(Carriageway { name, inner_edge, outer_edge, lanes })
}

/// Makes the map of some roads. `anchor` is where the world's origin lies and its x axis points; `error_m` is
/// as for [`Stripes::carriageways`]. None for an anchor that is non-finite or not near the earth.
pub fn map(roads: &[Stripes], anchor: &RadarPose, error_m: &mut dyn FnMut() -> f64) -> Option<HdMap> {
    let plane = RadarFrame::new(anchor)?;
    Some(HdMap { carriageways: roads.iter().flat_map(|r| r.carriageways(&plane, error_m)).collect() })
}
