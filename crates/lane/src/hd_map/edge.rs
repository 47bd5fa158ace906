//! Intersects a line across the road with an edge that is given by points (Li, section 3.3).

use glam::DVec2;

/// How an edge runs between its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EdgeRule {
    /// A straight line between neighbours.
    Linear,
    /// The parabola through the three points nearest along the road (Li, eq. 9).
    Nearest,
    /// The parabola with the neighbour on whose side the edge bends less; at the ends of the edge with a
    /// neighbour no more than one point farther in. It is straight where the two sides bend opposite ways or
    /// the edge bends back beyond both. On a smooth edge it is as good as `Nearest`; at corners, as of a bay,
    /// it does not overshoot.
    #[default]
    Guarded,
}

/// Points closer than this to the one before are left out, m.
const SAME_POINT_M: f64 = 1e-3;

/// The points of an edge in the plane of the radar's axes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Edge {
    points_m: Vec<DVec2>,
    /// Distance from the first point along the chords, m.
    stations_m: Vec<f64>,
}

/// Where the line across the road meets the edge, seen from the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Distance from the target to the left of the requested forward direction, m.
    pub lateral_m: f64,
    /// Slope of the edge there, left over forward.
    pub slope: f64,
    /// Distance along the edge's chords from its first point, m.
    pub station_m: f64,
}

impl Edge {
    /// Makes an edge; None for fewer than two distinct points.
    pub fn new(points_m: impl Iterator<Item = DVec2>) -> Option<Self> {
        let mut edge = Edge { points_m: Vec::new(), stations_m: Vec::new() };
        let mut station_m = 0.0;
        for p in points_m {
            if let Some(last) = edge.points_m.last() {
                let step_m = (p - *last).length();
                if step_m < SAME_POINT_M {
                    continue;
                }
                station_m += step_m;
            }
            edge.points_m.push(p);
            edge.stations_m.push(station_m);
        }
        (edge.points_m.len() >= 2).then_some(edge)
    }

    /// Direction of the segment that is closest to a point.
    pub fn heading_near(&self, p: DVec2) -> DVec2 {
        let mut best = (f64::INFINITY, DVec2::X);
        for w in self.points_m.windows(2) {
            let along = w[1] - w[0];
            let share = ((p - w[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let distance2 = (p - w[0] - along * share).length_squared();
            if distance2 < best.0 {
                best = (distance2, along);
            }
        }
        best.1.normalize_or(DVec2::X)
    }

    /// Finds where the line through `target_m` perpendicular to `forward` meets the edge; of several places
    /// the one nearest to `near_m` to the left of the target. None where the edge has no such place: it is
    /// never extrapolated.
    ///
    /// The chord is kept where it lies within `dense_m` of the parabola all along the segment.
    pub fn cross(
        &self,
        target_m: DVec2,
        forward: DVec2,
        near_m: f64,
        rule: EdgeRule,
        dense_m: f64,
    ) -> Option<Crossing> {
        let left = forward.perp();
        let seen = |i: usize| {
            let d = self.points_m[i] - target_m;
            (d.dot(forward), d.dot(left))
        };
        let mut best: Option<(f64, usize)> = None;
        let mut p = seen(0);
        for i in 1..self.points_m.len() {
            let q = seen(i);
            // A segment along the line across has no single intersection; its ends belong to its neighbours.
            let across = (p.0 <= 0.0 && q.0 >= 0.0) || (p.0 >= 0.0 && q.0 <= 0.0);
            if across && (q.0 - p.0).abs() > SAME_POINT_M {
                let lateral_m = p.1 - p.0 * (q.1 - p.1) / (q.0 - p.0);
                let off_m = (lateral_m - near_m).abs();
                if best.is_none_or(|(b, _)| off_m < b) {
                    best = Some((off_m, i - 1));
                }
            }
            p = q;
        }
        let (_, i) = best?;
        let (p, q) = (seen(i), seen(i + 1));
        let (step, rise) = (q.0 - p.0, q.1 - p.1);
        let chord = rise / step;
        let bend = match rule {
            EdgeRule::Linear => 0.0,
            EdgeRule::Nearest => self.bend_of_nearest(i, seen),
            EdgeRule::Guarded => self.guarded_bend(i, seen),
        };
        let sagitta_m = bend.abs() * step * step / 4.0;
        let bend = if sagitta_m <= dense_m { 0.0 } else { bend };
        // Newton's form of the polynomial through the three points, at the target's forward distance.
        let share = -p.0 / step;
        Some(Crossing {
            lateral_m: p.1 - p.0 * chord + bend * p.0 * q.0,
            slope: chord - bend * (p.0 + q.0),
            station_m: self.stations_m[i] + share * (self.stations_m[i + 1] - self.stations_m[i]),
        })
    }

    /// Second divided difference about a point; the end points have none.
    fn bend_at(&self, point: usize, seen: impl Fn(usize) -> (f64, f64)) -> Option<f64> {
        (point >= 1 && point + 1 < self.points_m.len())
            .then(|| second_difference([seen(point - 1), seen(point), seen(point + 1)]))
            .flatten()
    }

    /// Bend of segment i with that neighbour which is nearer to where the segment meets the line across.
    fn bend_of_nearest(&self, i: usize, seen: impl Fn(usize) -> (f64, f64)) -> f64 {
        let [before, after] = [i, i + 1].map(|point| self.bend_at(point, &seen));
        match (before, after) {
            (Some(b), Some(_)) if seen(i - 1).0.abs() <= seen(i + 2).0.abs() => b,
            (_, Some(a)) => a,
            (Some(b), None) => b,
            (None, None) => 0.0,
        }
    }

    /// The smaller bend of the two points of segment i; at an end of the edge, of the two points next to it.
    fn guarded_bend(&self, i: usize, seen: impl Fn(usize) -> (f64, f64)) -> f64 {
        let last = self.points_m.len() - 2;
        if last == 0 {
            return 0.0;
        }
        let first = i.clamp(1, last.max(2) - 1);
        let (Some(b), Some(a)) = (self.bend_at(first, &seen), self.bend_at((first + 1).min(last), &seen))
        else {
            return 0.0;
        };
        if b * a <= 0.0 {
            return 0.0;
        }
        let bend = if b.abs() <= a.abs() { b } else { a };
        // A segment between two corners, as the long side of a bay: the edge bends back on both sides.
        let back = |point: Option<usize>| {
            point
                .and_then(|p| self.bend_at(p, &seen))
                .is_some_and(|b| b * bend < 0.0 && b.abs() > 0.5 * bend.abs())
        };
        if back(first.checked_sub(1)) && back(Some(first + 2)) { 0.0 } else { bend }
    }
}

/// Second divided difference of three points in the order of the road. None where they do not advance
/// monotonically: there the edge is no function of the distance ahead.
fn second_difference([a, b, c]: [(f64, f64); 3]) -> Option<f64> {
    let (to, on) = (b.0 - a.0, c.0 - b.0);
    (to * on > 0.0 && to.abs().min(on.abs()) > SAME_POINT_M)
        .then(|| ((c.1 - b.1) / on - (b.1 - a.1) / to) / (c.0 - a.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(points: &[[f64; 2]]) -> Edge {
        Edge::new(points.iter().map(|p| DVec2::from_array(*p))).unwrap()
    }

    fn lateral(e: &Edge, x_m: f64, rule: EdgeRule) -> Option<f64> {
        e.cross(DVec2::new(x_m, 0.0), DVec2::X, 0.0, rule, 0.0).map(|c| c.lateral_m)
    }

    #[test]
    fn a_parabola_is_found_exactly_by_three_points_and_not_by_two() {
        let f = |x: f64| 2.0 + 0.1 * x + x * x / 1000.0;
        // Uneven steps.
        let xs = [0.0, 30.0, 70.0, 100.0, 160.0, 200.0];
        let e = edge(&xs.map(|x| [x, f(x)]));
        for x in [0.0, 3.0, 30.0, 55.0, 100.0, 131.0, 199.0, 200.0] {
            for rule in [EdgeRule::Nearest, EdgeRule::Guarded] {
                assert!((lateral(&e, x, rule).unwrap() - f(x)).abs() < 1e-12, "{x}");
                let slope = e.cross(DVec2::new(x, 0.0), DVec2::X, 0.0, rule, 0.0).unwrap().slope;
                assert!((slope - (0.1 + x / 500.0)).abs() < 1e-12, "{x}");
            }
        }
        // The chord of 60 m is off by h²/4 of the second difference, 0.9 m.
        assert!((lateral(&e, 130.0, EdgeRule::Linear).unwrap() - f(130.0) - 0.9).abs() < 1e-12);
    }

    #[test]
    fn it_is_lagranges_formula() {
        let p = [[0.0, 1.0], [40.0, 3.0], [100.0, 2.0]];
        let e = edge(&p);
        let lagrange = |x: f64| -> f64 {
            (0..3)
                .map(|i| {
                    (0..3).filter(|j| *j != i).fold(p[i][1], |v, j| v * (x - p[j][0]) / (p[i][0] - p[j][0]))
                })
                .sum()
        };
        for x in [1.0, 20.0, 60.0, 99.0] {
            assert!((lateral(&e, x, EdgeRule::Nearest).unwrap() - lagrange(x)).abs() < 1e-12);
        }
    }

    #[test]
    fn dense_points_are_joined_by_chords() {
        let f = |x: f64| x * x / 1000.0;
        let e = edge(&[0.0, 20.0, 40.0, 60.0].map(|x| [x, f(x)]));
        // Chord and parabola differ by 20²/4000 = 0.1 m in the middle of a segment.
        let at = |dense_m| e.cross(DVec2::new(30.0, 0.0), DVec2::X, 0.0, EdgeRule::Guarded, dense_m).unwrap();
        assert!((at(0.099).lateral_m - f(30.0)).abs() < 1e-12);
        assert!((at(0.101).lateral_m - f(30.0) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn corners_are_kept_by_the_guarded_rule_alone() {
        // An edge that steps aside by 3.5 m over 15 m.
        let e = edge(&[
            [0.0, 0.0],
            [80.0, 0.0],
            [100.0, 0.0],
            [115.0, 3.5],
            [155.0, 3.5],
            [170.0, 0.0],
            [200.0, 0.0],
            [230.0, 0.0],
        ]);
        for (x, y) in
            [(90.0, 0.0), (107.5, 1.75), (135.0, 3.5), (165.0, 3.5 / 3.0), (185.0, 0.0), (215.0, 0.0)]
        {
            assert!((lateral(&e, x, EdgeRule::Guarded).unwrap() - y).abs() < 1e-12, "{x}");
        }
        assert!((lateral(&e, 107.5, EdgeRule::Nearest).unwrap() - 1.75).abs() > 0.2);
        // The first and the last segment have one neighbour each, and still no corner bends them.
        let bent = edge(&[[0.0, 0.0], [50.0, 0.0], [60.0, 9.0], [70.0, 18.0]]);
        assert_eq!(lateral(&bent, 25.0, EdgeRule::Guarded), Some(0.0));
        // A step has no bend, before or behind.
        let step = edge(&[[0.0, 3.0], [50.0, 3.0], [50.0, 0.0], [90.0, 0.0], [120.0, 0.0]]);
        assert_eq!([25.0, 70.0].map(|x| lateral(&step, x, EdgeRule::Guarded)), [Some(3.0), Some(0.0)]);
    }

    #[test]
    fn on_a_circle_the_parabolas_error_is_of_fourth_order() {
        // Points 40 m apart on a circle of 300 m, looked at along the tangent of the middle of a segment:
        // the chord is off by 0.67 m there; over h³/R² the parabola has no error left on average.
        let circle =
            |a: f64| DVec2::new(0.0, 300.0) + 300.0 * DVec2::from_angle(a - std::f64::consts::FRAC_PI_2);
        let e = Edge::new((-4..=5).map(|i| circle((f64::from(i) - 0.5) * 40.0 / 300.0))).unwrap();
        let at = |rule| e.cross(DVec2::ZERO, DVec2::X, 0.0, rule, 0.0).unwrap().lateral_m;
        assert!((at(EdgeRule::Linear) - 0.666).abs() < 0.01, "{}", at(EdgeRule::Linear));
        assert!(at(EdgeRule::Guarded).abs() < 0.02, "{}", at(EdgeRule::Guarded));
        assert!(at(EdgeRule::Nearest).abs() < 0.02);
    }

    #[test]
    fn nothing_beyond_the_ends() {
        let e = edge(&[[10.0, 0.0], [50.0, 1.0], [90.0, 0.0]]);
        for x in [9.999, 90.001, -40.0, 1e9, f64::NAN] {
            assert_eq!(lateral(&e, x, EdgeRule::Guarded), None);
        }
        assert!(lateral(&e, 10.0, EdgeRule::Guarded).is_some());
        assert!(lateral(&e, 90.0, EdgeRule::Guarded).is_some());
    }

    #[test]
    fn of_two_places_the_near_one_counts() {
        // A hairpin: ahead along y = 0, back along y = 20.
        let e = edge(&[[0.0, 0.0], [50.0, 0.0], [60.0, 10.0], [50.0, 20.0], [0.0, 20.0]]);
        let at = |near_m| {
            let c = e.cross(DVec2::new(25.0, 5.0), DVec2::X, near_m, EdgeRule::Guarded, 0.0).unwrap();
            (c.lateral_m, c.station_m)
        };
        assert_eq!(at(0.0).0, -5.0);
        assert_eq!(at(0.0).1, 25.0);
        assert_eq!(at(12.0).0, 15.0);
        assert!(e.heading_near(DVec2::new(20.0, 18.0)).abs_diff_eq(-DVec2::X, 1e-12));
    }

    #[test]
    fn edges_without_two_points_are_none() {
        assert_eq!(Edge::new(std::iter::empty()), None);
        assert_eq!(Edge::new([DVec2::ONE; 3].into_iter()), None);
        assert_eq!(edge(&[[0.0, 0.0], [0.0, 0.0], [5.0, 0.0]]).points_m.len(), 2);
    }
}
