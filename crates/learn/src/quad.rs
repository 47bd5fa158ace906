//! Quadrilaterals on the road: the eight parameters of an object's contour (Feng 2019, figure 5.19), and how far two of them agree.

use glam::DVec2;

/// A convex quadrilateral in the level axes of a radar (x forward, y left), m. Its corners follow each other counter-clockwise seen from
/// above; the first is the near left one, where x − y is least. Two corners may be the same, which makes a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad([DVec2; 4]);

/// Twice the signed area of the triangle of three points, positive where they turn counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// The convex hull of some points, counter-clockwise, without points in the middle of an edge (Andrew's monotone chain). Fewer than
/// three points come back where all lie on one line.
pub fn hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut chain: Vec<DVec2> = Vec::new();
    let half = |chain: &mut Vec<DVec2>, points: &mut dyn Iterator<Item = DVec2>, floor: usize| {
        for p in points {
            while chain.len() >= floor + 2 && turn(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
    };
    half(&mut chain, &mut sorted.iter().copied(), 0);
    let floor = chain.len();
    half(&mut chain, &mut sorted.iter().rev().copied(), floor);
    chain
}

/// The area of a polygon whose corners are counter-clockwise, m².
pub fn area(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}

/// The part of a polygon that lies in a convex one (Sutherland and Hodgman 1974). Both are counter-clockwise.
pub fn clipped(polygon: &[DVec2], by: &[DVec2]) -> Vec<DVec2> {
    let mut kept = polygon.to_vec();
    for (from, to) in by.iter().zip(by.iter().cycle().skip(1)).filter(|(a, b)| a != b) {
        let whole = std::mem::take(&mut kept);
        for (a, b) in whole.iter().zip(whole.iter().cycle().skip(1)) {
            let (left_a, left_b) = (turn(*from, *to, *a), turn(*from, *to, *b));
            if left_a >= 0.0 {
                kept.push(*a);
            }
            // The edge crosses the line where the signs differ.
            if left_a * left_b < 0.0 {
                kept.push(*a + (*b - *a) * (left_a / (left_a - left_b)));
            }
        }
    }
    kept
}

impl Quad {
    /// The quadrilateral with these corners, in any order. Four corners of which one lies within the triangle of the others become that
    /// triangle. None where they span no area or are not finite.
    pub fn of(corners: [DVec2; 4]) -> Option<Quad> {
        if corners.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let around = hull(&corners);
        let first = (0..around.len()).min_by(|a, b| {
            let key = |k: usize| around[k].x - around[k].y;
            key(*a).total_cmp(&key(*b))
        })?;
        let quad = Quad(std::array::from_fn(|k| around[(first + k.min(around.len() - 1)) % around.len()]));
        (quad.area_m2() > 1e-9).then_some(quad)
    }

    /// The corners, m.
    pub fn corners(&self) -> &[DVec2; 4] {
        &self.0
    }

    /// The area, m².
    pub fn area_m2(&self) -> f64 {
        area(&self.0)
    }

    /// The middle: the mean of the corners, m. It lies within the quadrilateral.
    pub fn middle_m(&self) -> DVec2 {
        self.0.iter().sum::<DVec2>() / 4.0
    }

    /// Intersection over union of two quadrilaterals, 0 to 1.
    pub fn iou(&self, other: &Quad) -> f64 {
        let both = area(&clipped(&self.0, &other.0)).max(0.0);
        both / (self.area_m2() + other.area_m2() - both)
    }

    /// The same seen in a mirror, left for right.
    pub fn mirrored(&self) -> Quad {
        // A mirrored one spans the same area, so it is one.
        Quad::of(self.0.map(|c| DVec2::new(c.x, -c.y))).unwrap_or(*self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    fn rectangle(at: [f64; 2], size: [f64; 2], turned_rad: f64) -> Quad {
        let turn = DVec2::from_angle(turned_rad);
        let corner =
            |(u, v): (f64, f64)| DVec2::from(at) + turn.rotate(0.5 * DVec2::new(u * size[0], v * size[1]));
        Quad::of([(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)].map(corner)).unwrap()
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }

    /// Squares that overlap by half, touch, lie in each other, and a square with itself turned by 45 degrees: the common octagon has
    /// 2 (√2 − 1) of its area.
    #[test]
    fn intersection_over_union_of_squares() {
        let unit = rectangle([0.0, 0.0], [1.0, 1.0], 0.0);
        near(unit.iou(&unit), 1.0);
        near(unit.iou(&rectangle([0.5, 0.0], [1.0, 1.0], 0.0)), 1.0 / 3.0);
        near(unit.iou(&rectangle([0.5, 0.5], [1.0, 1.0], 0.0)), 1.0 / 7.0);
        near(unit.iou(&rectangle([1.0, 0.0], [1.0, 1.0], 0.0)), 0.0);
        near(unit.iou(&rectangle([3.0, 0.0], [1.0, 1.0], 0.3)), 0.0);
        near(unit.iou(&rectangle([0.1, -0.1], [0.5, 0.5], 0.0)), 0.25);
        let turned = rectangle([0.0, 0.0], [1.0, 1.0], FRAC_PI_4);
        let octagon = 2.0 * (2f64.sqrt() - 1.0);
        near(unit.iou(&turned), octagon / (2.0 - octagon));
        near(octagon / (2.0 - octagon), 0.5f64.sqrt());
        near(turned.iou(&unit), unit.iou(&turned));
    }

    /// A triangle is half of the square whose corners it takes, also as a clipping shape.
    #[test]
    fn triangles_are_quadrilaterals_with_a_double_corner() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec2::new(x, y));
        let whole = Quad::of(square).unwrap();
        let inner = Quad::of([square[0], square[1], square[2], DVec2::new(1.5, 0.5)]).unwrap();
        near(inner.area_m2(), 2.0);
        near(whole.iou(&inner), 0.5);
        near(inner.iou(&whole), 0.5);
        assert!(Quad::of([DVec2::ZERO, DVec2::X, 2.0 * DVec2::X, 3.0 * DVec2::X]).is_none());
        assert!(Quad::of([DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::NAN]).is_none());
    }

    /// The corners begin near left, whatever their order was, and a mirror puts them so again.
    #[test]
    fn corners_have_an_order() {
        let q = rectangle([20.0, 1.0], [10.0, 4.0], 0.0);
        let at = |x, y| DVec2::new(x, y);
        assert_eq!(q.corners(), &[at(15.0, 3.0), at(15.0, -1.0), at(25.0, -1.0), at(25.0, 3.0)]);
        assert_eq!(q.mirrored().corners(), &[at(15.0, 1.0), at(15.0, -3.0), at(25.0, -3.0), at(25.0, 1.0)]);
        near(q.area_m2(), 40.0);
        assert_eq!(q.middle_m(), at(20.0, 1.0));
    }
}
