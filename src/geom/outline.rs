//! The outline of polygons that lie side by side in a plane: what of their sides no neighbour shares.

use glam::DVec2;
use std::collections::HashMap;

/// Directed sides of the union of polygons that do not overlap, inside on the left, straight runs in one
/// piece. Corners nearer to one another than `tolerance` are one. Sides that two polygons share, in part
/// or whole, are inside the union and left out.
pub fn outline<'a>(polygons: impl IntoIterator<Item = &'a [DVec2]>, tolerance: f64) -> Vec<[DVec2; 2]> {
    let mut corners = Welder::new(tolerance);
    let mut sides: Vec<[u32; 2]> = Vec::new();
    let mut count = 0;
    for polygon in polygons {
        let ids: Vec<u32> = polygon.iter().map(|p| corners.weld(*p)).collect();
        let from = sides.len();
        let mut twice_area = 0.0;
        for i in 0..ids.len() {
            let (a, b) = (ids[i], ids[(i + 1) % ids.len()]);
            twice_area += (polygon[i] - polygon[0]).perp_dot(polygon[(i + 1) % ids.len()] - polygon[0]);
            if a != b {
                sides.push([a, b]);
            }
        }
        if twice_area < 0.0 {
            sides[from..].iter_mut().for_each(|s| s.reverse());
        }
        count += 1;
    }
    let points = corners.points;
    if count > 1 {
        sides = split(&sides, &points, tolerance);
    }
    let key = |[a, b]: [u32; 2]| (a.min(b), a.max(b));
    let mut net: HashMap<(u32, u32), i32> = HashMap::with_capacity(sides.len());
    for s in &sides {
        *net.entry(key(*s)).or_default() += if s[0] < s[1] { 1 } else { -1 };
    }
    sides.retain(|s| {
        let left = net.entry(key(*s)).or_default();
        let sign = if s[0] < s[1] { 1 } else { -1 };
        let stays = *left * sign > 0;
        if stays {
            *left -= sign;
        }
        stays
    });
    joined(&sides, &points, tolerance)
}

/// Gives points nearer than a distance to one another one number.
struct Welder {
    cell: f64,
    near: f64,
    points: Vec<DVec2>,
    grid: HashMap<[i64; 2], Vec<u32>>,
}

impl Welder {
    fn new(near: f64) -> Welder {
        Welder { cell: 4.0 * near, near, points: Vec::new(), grid: HashMap::new() }
    }

    fn weld(&mut self, p: DVec2) -> u32 {
        // As near to a border as `near`, the twin may lie across it.
        let [x, y] = p.to_array().map(|x| {
            let (lo, hi) = ((x - self.near) / self.cell, (x + self.near) / self.cell);
            lo.floor() as i64..=hi.floor() as i64
        });
        for i in x.clone() {
            for j in y.clone() {
                let found = self
                    .grid
                    .get(&[i, j])
                    .and_then(|c| c.iter().find(|&&k| self.points[k as usize].distance(p) <= self.near));
                if let Some(&k) = found {
                    return k;
                }
            }
        }
        let k = self.points.len() as u32;
        self.points.push(p);
        self.grid.entry(p.to_array().map(|x| (x / self.cell).floor() as i64)).or_default().push(k);
        k
    }
}

/// The sides, cut where another corner lies on them.
fn split(sides: &[[u32; 2]], points: &[DVec2], tolerance: f64) -> Vec<[u32; 2]> {
    // Candidates come from the order along the axis in which a side is shorter.
    let order: [Vec<u32>; 2] = [0, 1].map(|axis| {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by(|&a, &b| points[a as usize][axis].total_cmp(&points[b as usize][axis]));
        order
    });
    let mut out = Vec::with_capacity(sides.len());
    let mut on: Vec<(f64, u32)> = Vec::new();
    for &[a, b] in sides {
        let (p, q) = (points[a as usize], points[b as usize]);
        let along = q - p;
        let axis = if along.x.abs() < along.y.abs() { 0 } else { 1 };
        let length = along.length();
        let (lo, hi) = (p[axis].min(q[axis]) - tolerance, p[axis].max(q[axis]) + tolerance);
        let first = order[axis].partition_point(|&k| points[k as usize][axis] < lo);
        on.clear();
        for &k in &order[axis][first..] {
            let d = points[k as usize] - p;
            if points[k as usize][axis] > hi {
                break;
            }
            let at = d.dot(along) / length;
            let beside = (d.perp_dot(along) / length).abs();
            if k != a && k != b && beside <= tolerance && at > 0.0 && at < length {
                on.push((at, k));
            }
        }
        on.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut from = a;
        for &(_, k) in &on {
            out.push([from, k]);
            from = k;
        }
        out.push([from, b]);
    }
    out
}

/// Runs of sides on one line made one side.
fn joined(sides: &[[u32; 2]], points: &[DVec2], tolerance: f64) -> Vec<[DVec2; 2]> {
    let mut leaving: HashMap<u32, Option<usize>> = HashMap::with_capacity(sides.len());
    let mut arriving = leaving.clone();
    for (i, s) in sides.iter().enumerate() {
        // Corners at which more than one side begins or ends stay.
        leaving.entry(s[0]).and_modify(|x| *x = None).or_insert(Some(i));
        arriving.entry(s[1]).and_modify(|x| *x = None).or_insert(Some(i));
    }
    let at = |k: u32| points[k as usize];
    let goes_on = |i: usize| -> Option<usize> {
        let [a, b] = sides[i];
        arriving.get(&b).copied().flatten()?;
        let next = leaving.get(&b).copied().flatten()?;
        let c = sides[next][1];
        let along = at(c) - at(a);
        let straight = (at(b) - at(a)).dot(at(c) - at(b)) > 0.0
            && (at(b) - at(a)).perp_dot(along).abs() <= tolerance * along.length();
        straight.then_some(next)
    };
    let next: Vec<Option<usize>> = (0..sides.len()).map(goes_on).collect();
    let mut is_next = vec![false; sides.len()];
    next.iter().flatten().for_each(|&i| is_next[i] = true);
    let mut out = Vec::new();
    for i in (0..sides.len()).filter(|&i| !is_next[i]) {
        let mut last = i;
        while let Some(n) = next[last] {
            last = n;
        }
        out.push([at(sides[i][0]), at(sides[last][1])]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn length(sides: &[[DVec2; 2]]) -> f64 {
        sides.iter().map(|[a, b]| a.distance(*b)).sum()
    }

    /// The parts of a convex polygon on both sides of a line.
    fn cut(p: &[DVec2], at: DVec2, normal: DVec2) -> [Vec<DVec2>; 2] {
        [1.0, -1.0].map(|sign| {
            let d = |p: DVec2| sign * normal.dot(p - at);
            let mut out = Vec::new();
            for i in 0..p.len() {
                let (a, b) = (p[i], p[(i + 1) % p.len()]);
                if d(a) >= 0.0 {
                    out.push(a);
                }
                if d(a) * d(b) < 0.0 {
                    out.push(a + (b - a) * (d(a) / (d(a) - d(b))));
                }
            }
            out
        })
    }

    #[test]
    fn an_l_of_two_boxes_has_six_sides() {
        let rect = |x0: f64, y0: f64, x1: f64, y1: f64| {
            [DVec2::new(x0, y0), DVec2::new(x1, y0), DVec2::new(x1, y1), DVec2::new(x0, y1)]
        };
        let (a, b) = (rect(0.0, 0.0, 3.0, 1.0), rect(0.0, 1.0, 1.0, 2.0));
        let sides = outline([&a[..], &b[..]], 1e-9);
        assert_eq!(sides.len(), 6);
        assert!((length(&sides) - 10.0).abs() < 1e-12);
        let area: f64 = sides.iter().map(|[p, q]| 0.5 * p.perp_dot(*q)).sum();
        assert!((area - 4.0).abs() < 1e-12);
    }

    proptest! {
        /// However a rectangle is cut, its own four sides are left.
        #[test]
        fn cuts_inside_leave_no_trace(cuts in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0, 0.0f64..7.0), 0..7)) {
            let mut parts =
                vec![vec![DVec2::new(-2.0, -1.0), DVec2::new(2.0, -1.0), DVec2::new(2.0, 1.0), DVec2::new(-2.0, 1.0)]];
            for (i, (x, y, angle)) in cuts.iter().enumerate() {
                // Every second cut goes through one part only: corners on the sides of neighbours.
                let whole = i % 2 == 0;
                let at = DVec2::new(2.0 * x, *y);
                let mut next = Vec::new();
                for p in parts {
                    let [a, b] = cut(&p, at, DVec2::from_angle(*angle));
                    if (whole || next.len() == i) && a.len() > 2 && b.len() > 2 {
                        next.extend([a, b]);
                    } else {
                        next.push(p);
                    }
                }
                parts = next;
            }
            for (i, p) in parts.iter_mut().enumerate() {
                if i % 3 == 0 {
                    p.reverse();
                }
            }
            let sides = outline(parts.iter().map(|p| &p[..]), 1e-9);
            prop_assert!((length(&sides) - 12.0).abs() < 1e-7, "{} sides, {}", sides.len(), length(&sides));
            prop_assert_eq!(sides.len(), 4);
        }
    }
}
