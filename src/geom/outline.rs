//! The outline of polygons that lie side by side in a plane: what of their sides no neighbour shares.

use super::hash::FastMap;
use glam::DVec2;

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
    if count > 1 {
        sides = split(&sides, &corners.points, tolerance);
    }
    net(sides, &corners.points, tolerance)
}

/// The outline that directed sides enclose, inside on the left, in whatever order and parts they come: as [`outline`] has it. Where it
/// does not close, its ends are joined by straight lines, the nearest first: the waves of an open line would have no bound.
pub fn enclosing(sides: &[[DVec2; 2]], tolerance: f64) -> Vec<[DVec2; 2]> {
    let mut corners = Welder::new(tolerance);
    let mut welded: Vec<[u32; 2]> = sides.iter().map(|s| s.map(|p| corners.weld(p))).collect();
    welded.retain(|[a, b]| a != b);
    close(&mut welded, &corners.points);
    net(split(&welded, &corners.points, tolerance), &corners.points, tolerance)
}

/// Adds sides so that as many arrive at each corner as leave it.
fn close(sides: &mut Vec<[u32; 2]>, points: &[DVec2]) {
    let mut leaving = vec![0i32; points.len()];
    for [a, b] in sides.iter() {
        leaving[*a as usize] += 1;
        leaving[*b as usize] -= 1;
    }
    let open = |sign: i32| (0..points.len()).filter(|i| leaving[*i] * sign > 0).collect::<Vec<_>>();
    let (ends, starts) = (open(-1), open(1));
    let mut ways: Vec<(f64, usize, usize)> = Vec::new();
    for from in ends {
        ways.extend(starts.iter().map(|to| (points[from].distance_squared(points[*to]), from, *to)));
    }
    ways.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    for (_, from, to) in ways {
        while leaving[from] < 0 && leaving[to] > 0 {
            sides.push([from as u32, to as u32]);
            leaving[from] += 1;
            leaving[to] -= 1;
        }
    }
}

/// What is left of directed sides where they run to and fro, straight runs in one piece.
fn net(mut sides: Vec<[u32; 2]>, points: &[DVec2], tolerance: f64) -> Vec<[DVec2; 2]> {
    let key = |[a, b]: [u32; 2]| (a.min(b), a.max(b));
    let mut net: FastMap<(u32, u32), i32> =
        FastMap::with_capacity_and_hasher(sides.len(), Default::default());
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
    joined(&sides, points, tolerance)
}

/// Convex polygons that make up what directed sides enclose, inside on the left: one where that is convex, else slabs between the heights of
/// its corners.
pub fn convex_parts(sides: &[[DVec2; 2]]) -> Vec<Vec<DVec2>> {
    if let Some(whole) = convex_loop(sides) {
        return vec![whole];
    }
    let mut heights: Vec<f64> = sides.iter().flatten().map(|p| p.y).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let mut parts = Vec::new();
    let mut crossing: Vec<(f64, [DVec2; 2], i32)> = Vec::new();
    for slab in heights.windows(2) {
        crossing.clear();
        for [a, b] in sides.iter().filter(|[a, b]| a.y.min(b.y) <= slab[0] && a.y.max(b.y) >= slab[1]) {
            let at = |y: f64| DVec2::new(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0), y);
            let ends = [at(slab[0]), at(slab[1])];
            // What lies to the right of a side that leads down is inside.
            crossing.push((0.5 * (ends[0].x + ends[1].x), ends, if b.y < a.y { 1 } else { -1 }));
        }
        crossing.sort_by(|p, q| p.0.total_cmp(&q.0).then(q.2.cmp(&p.2)));
        let (mut depth, mut from) = (0, None::<[DVec2; 2]>);
        for (_, ends, enters) in &crossing {
            depth += enters;
            match from {
                None if depth > 0 => from = Some(*ends),
                Some([low, high]) if depth <= 0 => {
                    let mut part = vec![low, ends[0], ends[1], high];
                    part.dedup();
                    if part.len() > 2 {
                        parts.push(part);
                    }
                    from = None;
                }
                _ => {}
            }
        }
    }
    parts
}

/// The corners of a convex polygon from its sides in any order; None where they are not those of one.
fn convex_loop(sides: &[[DVec2; 2]]) -> Option<Vec<DVec2>> {
    let mut corners = Vec::with_capacity(sides.len());
    let mut side = sides.first()?;
    loop {
        corners.push(side[0]);
        let mut following = sides.iter().filter(|s| s[0] == side[1]);
        let next = following.next().filter(|_| following.next().is_none())?;
        if (side[1] - side[0]).perp_dot(next[1] - next[0]) < 0.0 || corners.len() > sides.len() {
            return None;
        }
        side = next;
        if side == &sides[0] {
            break;
        }
    }
    (corners.len() == sides.len()).then_some(corners)
}

/// Up to so many points are looked through one by one, which is quicker than any table.
const FEW: usize = 32;

/// Gives points nearer than a distance to one another one number.
struct Welder {
    cell: f64,
    near: f64,
    points: Vec<DVec2>,
    /// Index of the points by the cell in which they lie, once they are more than a few.
    grid: FastMap<[i64; 2], Vec<u32>>,
}

impl Welder {
    fn new(near: f64) -> Welder {
        Welder { cell: 4.0 * near, near, points: Vec::new(), grid: FastMap::default() }
    }

    fn weld(&mut self, p: DVec2) -> u32 {
        self.find(p).unwrap_or_else(|| {
            let new = self.points.len();
            self.points.push(p);
            let unlisted = match new {
                0..FEW => 0..0,
                FEW => 0..new + 1,
                _ => new..new + 1,
            };
            for k in unlisted {
                let cell = self.points[k].to_array().map(|x| (x / self.cell).floor() as i64);
                self.grid.entry(cell).or_default().push(k as u32);
            }
            new as u32
        })
    }

    fn find(&self, p: DVec2) -> Option<u32> {
        let is_near = |k: &u32| self.points[*k as usize].distance(p) <= self.near;
        if self.points.len() <= FEW {
            return (0..self.points.len() as u32).find(is_near);
        }
        // As near to a border as `near`, the twin may lie across it.
        let [x, y] = p.to_array().map(|x| {
            let (lo, hi) = ((x - self.near) / self.cell, (x + self.near) / self.cell);
            lo.floor() as i64..=hi.floor() as i64
        });
        let mut cells = x.flat_map(|i| y.clone().map(move |j| [i, j]));
        cells.find_map(|c| self.grid.get(&c)?.iter().copied().find(is_near))
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
    // Of each corner: how many sides begin or end there, and one of them.
    let mut leaving = vec![(0, 0); points.len()];
    let mut arriving = leaving.clone();
    for (i, s) in sides.iter().enumerate() {
        for (list, end) in [(&mut leaving, s[0]), (&mut arriving, s[1])] {
            let (count, side) = &mut list[end as usize];
            (*count, *side) = (*count + 1, i);
        }
    }
    // Corners at which more than one side begins or ends stay.
    let only = |list: &[(u32, usize)], k: u32| Some(list[k as usize]).filter(|x| x.0 == 1).map(|x| x.1);
    let at = |k: u32| points[k as usize];
    let goes_on = |i: usize| -> Option<usize> {
        let [a, b] = sides[i];
        only(&arriving, b)?;
        let next = only(&leaving, b)?;
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

    /// A square with a square hole, a corner cut off, and a triangle.
    #[test]
    fn parts_make_up_what_sides_enclose() {
        let p = DVec2::new;
        let ring = |corners: &[DVec2]| -> Vec<[DVec2; 2]> {
            (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]).collect()
        };
        let outer = ring(&[p(0.0, 0.0), p(3.0, 0.0), p(4.0, 1.0), p(4.0, 4.0), p(0.0, 4.0)]);
        let hole = ring(&[p(1.0, 1.0), p(1.0, 2.0), p(2.0, 2.5), p(2.0, 1.0)]);
        let triangle = ring(&[p(5.0, 0.3), p(6.0, 0.5), p(5.5, 3.0)]);
        let all = [outer.clone(), hole, triangle.clone()].concat();
        let area = |corners: &[DVec2]| {
            (0..corners.len())
                .map(|i| 0.5 * corners[i].perp_dot(corners[(i + 1) % corners.len()]))
                .sum::<f64>()
        };
        let want: f64 = all.iter().map(|[a, b]| 0.5 * a.perp_dot(*b)).sum();
        let parts = convex_parts(&all);
        assert!((parts.iter().map(|c| area(c)).sum::<f64>() - want).abs() < 1e-12);
        for part in &parts {
            assert!(part.len() > 2 && convex_loop(&ring(part)).is_some(), "{part:?}");
        }
        assert_eq!(convex_parts(&outer), [outer.iter().map(|s| s[0]).collect::<Vec<_>>()]);
        assert_eq!(convex_parts(&triangle).len(), 1);
        assert!(convex_parts(&[]).is_empty());
    }

    /// Sides in parts and in any order, one of them there twice and back, one missing.
    #[test]
    fn what_does_not_close_is_closed() {
        let p = DVec2::new;
        let parts = [
            [p(2.0, 1.0), p(0.0, 1.0)],
            [p(0.0, 0.0), p(0.5, 0.0)],
            [p(0.5, 0.0), p(0.5, 3.0)],
            [p(0.5, 0.0), p(2.0, 0.0)],
            [p(0.5, 3.0), p(0.5, 0.0)],
            [p(0.0, 1.0), p(0.0, 0.0)],
        ];
        let mut sides = enclosing(&parts, 1e-9);
        sides.sort_by(|a, b| a[0].to_array().partial_cmp(&b[0].to_array()).unwrap());
        let corners = [p(0.0, 0.0), p(0.0, 1.0), p(2.0, 0.0), p(2.0, 1.0)];
        let next = [2, 0, 3, 1];
        assert_eq!(sides, [0, 1, 2, 3].map(|i| [corners[i], corners[next[i]]]));
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
