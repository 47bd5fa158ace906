//! What of a road's labels lies around a place: lanes and lines cut to a circle, and the lane that a vehicle is in
//! (CONVENTIONS eq. 161).

use crate::road::labels::{LaneLabel, LineLabel, Polyline, RoadLabel, RoadTruth};
use crate::road::layout::{Driven, LaneKind, LineKind};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A piece of a lane. The three lines have as many points, each a section across the lane, in the order of the
/// road's axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneTruth {
    /// Name of the road.
    pub road: String,
    /// Unique in its road.
    pub number: i32,
    /// What the lane is for.
    pub kind: LaneKind,
    /// Which way it is driven, along the axis.
    pub driven: Driven,
    /// Left edge of the lane in the world, m.
    pub left_m: Polyline,
    /// Its middle.
    pub centre_m: Polyline,
    /// Its right edge.
    pub right_m: Polyline,
}

/// A piece of a painted line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneLine {
    /// Object that is the paint; 0 where the line is not painted.
    pub id: u32,
    /// Name of the road.
    pub road: String,
    /// Name of the line.
    pub name: String,
    /// Solid or dashed.
    pub kind: LineKind,
    /// Width of the paint, m.
    pub width_m: f64,
    /// Its middle, through the gaps of a dashed line, in the world.
    pub points_m: Polyline,
}

/// A place in a lane, seen along the way that the lane is driven (where both ways are, along the nearer to the heading).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LanePlace {
    /// Name of the road.
    pub road: String,
    /// Number of the lane.
    pub number: i32,
    /// What the lane is for.
    pub kind: LaneKind,
    /// Station along the road's axis, m.
    pub s_m: f64,
    /// Width of the lane there, m.
    pub width_m: f64,
    /// Distance from the middle of the lane, m, positive to the left.
    pub offset_m: f64,
    /// Angle to the direction of the lane, rad, positive to the left, within ±π.
    pub heading_rad: f64,
}

fn flat(p: &[f64; 3]) -> DVec2 {
    DVec2::new(p[0], p[1])
}

/// Between two points of a polyline at a place counted in points.
fn at(line: &[[f64; 3]], place: f64) -> [f64; 3] {
    let i = (place as usize).min(line.len().saturating_sub(2));
    let (a, b) = (DVec3::from_array(line[i]), DVec3::from_array(line[(i + 1).min(line.len() - 1)]));
    a.lerp(b, place - i as f64).to_array()
}

/// The stretches of a polyline that lie within `radius_m` of `centre`, in plan, where `there` holds for the segment,
/// as places counted in points.
fn stretches(
    line: &[[f64; 3]],
    centre: DVec2,
    radius_m: f64,
    there: impl Fn(usize) -> bool,
) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for (i, w) in line.windows(2).enumerate().filter(|(i, _)| there(*i)) {
        let (a, d) = (flat(&w[0]) - centre, flat(&w[1]) - flat(&w[0]));
        // |a + t d|² = r².
        let (dd, ad, aa) = (d.length_squared(), a.dot(d), a.length_squared() - radius_m * radius_m);
        let root = ad * ad - dd * aa;
        if root <= 0.0 || dd == 0.0 {
            continue;
        }
        let (t0, t1) = (((-ad - root.sqrt()) / dd).max(0.0), ((-ad + root.sqrt()) / dd).min(1.0));
        if t0 >= t1 {
            continue;
        }
        let (from, to) = (i as f64 + t0, i as f64 + t1);
        match out.last_mut().filter(|r| t0 == 0.0 && r.1 == i as f64) {
            Some(run) => run.1 = to,
            None => out.push((from, to)),
        }
    }
    out
}

/// The points of a polyline over a stretch.
fn cut(line: &[[f64; 3]], (from, to): (f64, f64)) -> Polyline {
    let mut out = vec![at(line, from)];
    let inner = (from.floor() as usize + 1..).take_while(|i| (*i as f64) < to);
    out.extend(inner.map(|i| line[i]));
    out.push(at(line, to));
    out
}

/// The lanes whose middle lies within `radius_m` of `centre` in plan, one entry for each stretch on which the lane has
/// a width.
pub fn lanes_near(truth: &RoadTruth, centre: DVec2, radius_m: f64) -> Vec<LaneTruth> {
    let lane = |road: &RoadLabel, l: &LaneLabel| {
        let wide = |i: usize| l.width_m[i] > 0.0 || l.width_m[i + 1] > 0.0;
        stretches(&l.centre_m, centre, radius_m, wide)
            .into_iter()
            .map(|run| LaneTruth {
                road: road.name.clone(),
                number: l.number,
                kind: l.kind,
                driven: l.driven,
                left_m: cut(&l.left_m, run),
                centre_m: cut(&l.centre_m, run),
                right_m: cut(&l.right_m, run),
            })
            .collect::<Vec<_>>()
    };
    truth.roads.iter().flat_map(|r| r.lanes.iter().flat_map(move |l| lane(r, l))).collect()
}

/// The painted lines within `radius_m` of `centre` in plan.
pub fn lines_near(truth: &RoadTruth, centre: DVec2, radius_m: f64) -> Vec<LaneLine> {
    let line = |road: &RoadLabel, l: &LineLabel| {
        stretches(&l.points_m, centre, radius_m, |_| true)
            .into_iter()
            .map(|run| LaneLine {
                id: l.id,
                road: road.name.clone(),
                name: l.name.clone(),
                kind: l.kind,
                width_m: l.width_m,
                points_m: cut(&l.points_m, run),
            })
            .collect::<Vec<_>>()
    };
    truth.roads.iter().flat_map(|r| r.lines.iter().flat_map(move |l| line(r, l))).collect()
}

/// Where along a polyline the point nearest to `p` in plan lies, counted in points, and how far to the left of the line
/// `p` is there.
fn foot(line: &[[f64; 3]], p: DVec2) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64, f64)> = None;
    for (i, w) in line.windows(2).enumerate() {
        let (a, d) = (flat(&w[0]), flat(&w[1]) - flat(&w[0]));
        if d == DVec2::ZERO {
            continue;
        }
        let t = ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        let off = p - a - t * d;
        if best.is_none_or(|b| off.length() < b.0) {
            best = Some((off.length(), i as f64 + t, d.normalize().perp_dot(off)));
        }
    }
    // Before the beginning and beyond the end there is no lane.
    best.filter(|(distance, _, left)| *distance <= left.abs() * (1.0 + 1e-9) + 1e-9).map(|b| (b.1, b.2))
}

/// The nearest height of any road's axis at a place in plan; None where no road runs.
pub fn height_m(truth: &RoadTruth, p: DVec2) -> Option<f64> {
    let of = |line: &[[f64; 3]]| {
        let nearest = line.windows(2).map(|w| {
            let (a, d) = (flat(&w[0]), flat(&w[1]) - flat(&w[0]));
            let t = ((p - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            ((p - a - t * d).length(), w[0][2] + t * (w[1][2] - w[0][2]))
        });
        nearest.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let nearest = truth.roads.iter().filter_map(|r| of(&r.axis_m));
    nearest.min_by(|a, b| a.0.total_cmp(&b.0)).map(|n| n.1)
}

/// The lane that a vehicle's origin stands over, and where in it (eq. 161); None off the lanes. Where lanes lie over
/// each other it is the one nearest in height; where they overlap, the one whose middle is nearest.
pub fn lane_at(truth: &RoadTruth, position_m: DVec3, heading_rad: f64) -> Option<LanePlace> {
    let p = position_m.truncate();
    let mut best: Option<((f64, f64), LanePlace)> = None;
    for road in &truth.roads {
        for lane in &road.lanes {
            let Some((place, left)) = foot(&lane.centre_m, p) else { continue };
            let (a, b) = (flat(&at(&lane.left_m, place)), flat(&at(&lane.right_m, place)));
            let width_m = a.distance(b);
            if left.abs() > 0.5 * width_m || width_m <= 0.0 {
                continue;
            }
            let i = (place as usize).min(lane.centre_m.len() - 2);
            let along = flat(&lane.centre_m[i + 1]) - flat(&lane.centre_m[i]);
            let wrap = |x: f64| x - TAU * (x / TAU).round();
            let mut heading = wrap(heading_rad - along.y.atan2(along.x));
            let back = match lane.driven {
                Driven::Forward => false,
                Driven::Backward => true,
                Driven::Both => heading.abs() > FRAC_PI_2,
            };
            if back {
                heading = wrap(heading - PI);
            }
            let s_m = road.s_m[i] + (place - i as f64) * (road.s_m[i + 1] - road.s_m[i]);
            // Lanes of one road lie at about one height; a metre apart is another storey.
            let storey = (at(&lane.centre_m, place)[2] - position_m.z).abs().round();
            let rank = (storey, left.abs());
            if best.as_ref().is_none_or(|(r, _)| rank < *r) {
                let offset_m = if back { -left } else { left };
                let (road, number, kind) = (road.name.clone(), lane.number, lane.kind);
                best = Some((
                    rank,
                    LanePlace { road, number, kind, s_m, width_m, offset_m, heading_rad: heading },
                ));
            }
        }
    }
    best.map(|b| b.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A road of two lanes along a quarter circle of `radius` to the left from the origin, heading +x.
    fn bend(radius: f64) -> RoadTruth {
        let n = 200;
        let arc = |t: f64| -> Polyline {
            (0..=n)
                .map(|i| {
                    let a = FRAC_PI_2 * f64::from(i) / f64::from(n);
                    [(radius - t) * a.sin(), radius - (radius - t) * a.cos(), 0.1]
                })
                .collect()
        };
        let lane = |number, driven, left: f64, right: f64| LaneLabel {
            number,
            kind: LaneKind::Driving,
            driven,
            width_m: vec![left - right; n as usize + 1],
            left_m: arc(left),
            centre_m: arc(0.5 * (left + right)),
            right_m: arc(right),
        };
        let road = RoadLabel {
            name: "bend".into(),
            length_m: FRAC_PI_2 * radius,
            s_m: (0..=n).map(|i| FRAC_PI_2 * radius * f64::from(i) / f64::from(n)).collect(),
            axis_m: arc(0.0),
            curvature_per_m: vec![1.0 / radius; n as usize + 1],
            left_edge_m: arc(4.0),
            right_edge_m: arc(-4.0),
            lanes: vec![lane(1, Driven::Backward, 4.0, 0.0), lane(2, Driven::Forward, 0.0, -4.0)],
            lines: vec![LineLabel {
                id: 7,
                name: "middle".into(),
                kind: LineKind::Dashed,
                width_m: 0.12,
                points_m: arc(0.0),
            }],
            free_space_m: Vec::new(),
        };
        RoadTruth { name: "t".into(), roads: vec![road], marker_rows: Vec::new() }
    }

    #[test]
    fn lanes_end_on_the_circle() {
        let t = bend(200.0);
        let centre = DVec2::new(30.0, 0.0);
        let lanes = lanes_near(&t, centre, 50.0);
        assert_eq!(lanes.iter().map(|l| l.number).collect::<Vec<_>>(), [1, 2]);
        for l in &lanes {
            assert!(l.left_m.len() == l.right_m.len() && l.left_m.len() == l.centre_m.len());
            let far = |p: &[f64; 3]| flat(p).distance(centre);
            // It begins with the road, inside, and ends on the circle.
            assert!(far(&l.centre_m[0]) < 31.0);
            assert!((far(&l.centre_m[l.centre_m.len() - 1]) - 50.0).abs() < 1e-9);
            assert!(l.centre_m.iter().all(|p| far(p) < 50.0 + 1e-9));
            for (a, b) in l.left_m.iter().zip(&l.right_m) {
                assert!((flat(a).distance(flat(b)) - 4.0).abs() < 0.01);
            }
        }
        let lines = lines_near(&t, centre, 50.0);
        assert_eq!((lines.len(), lines[0].id, lines[0].kind), (1, 7, LineKind::Dashed));
        assert!(lanes_near(&t, DVec2::new(-100.0, 0.0), 50.0).is_empty());
        // A circle that the bend leaves and enters again.
        let twice = lanes_near(&t, DVec2::new(0.0, 200.0), 200.5);
        assert_eq!(twice.iter().map(|l| l.number).collect::<Vec<_>>(), [1]);
        let chord = lines_near(&t, DVec2::new(200.0, 0.0), 150.0);
        assert_eq!(chord.len(), 1);
    }

    #[test]
    fn a_lane_without_width_is_not_there() {
        let mut t = bend(200.0);
        for i in 50..=100 {
            t.roads[0].lanes[0].width_m[i] = 0.0;
        }
        let lanes = lanes_near(&t, DVec2::ZERO, 1000.0);
        assert_eq!(lanes.iter().map(|l| l.number).collect::<Vec<_>>(), [1, 1, 2]);
        assert_eq!(lanes[0].centre_m.len(), 51);
    }

    #[test]
    fn ego_in_its_lane() {
        let t = bend(200.0);
        // 30 degrees along the bend, half a metre left of the middle of the right lane (t = -2), turned by 0.1.
        let a = 30f64.to_radians();
        let place = |t: f64| DVec3::new((200.0 - t) * a.sin(), 200.0 - (200.0 - t) * a.cos(), 0.0);
        let p = lane_at(&t, place(-1.5), a + 0.1).unwrap();
        assert_eq!((p.number, p.road.as_str()), (2, "bend"));
        assert!((p.offset_m - 0.5).abs() < 0.01 && (p.width_m - 4.0).abs() < 0.01, "{p:?}");
        assert!((p.heading_rad - 0.1).abs() < 0.01 && (p.s_m - a * 200.0).abs() < 0.01, "{p:?}");
        // The other lane is driven the other way: left and right change places.
        let p = lane_at(&t, place(2.5), a + std::f64::consts::PI - 0.1).unwrap();
        assert_eq!(p.number, 1);
        assert!((p.offset_m + 0.5).abs() < 0.01 && (p.heading_rad + 0.1).abs() < 0.01, "{p:?}");
        assert_eq!(lane_at(&t, place(5.0), a), None);
        assert_eq!(lane_at(&t, DVec3::new(-1.0, -2.0, 0.0), 0.0), None);
        assert_eq!(height_m(&t, place(3.0).truncate()), Some(0.1));
    }
}
