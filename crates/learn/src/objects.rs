//! Objects as what a detector is judged by: each connected part of a class in a mask, and the quadrilateral that fits it best.
//!
//! Nothing turns objects into what a network sees:
//!
//! ```compile_fail
//! use catseye_learn::data::{Features, Input};
//! use catseye_learn::objects::Objects;
//! fn leak(objects: &Objects) -> Features {
//!     Features::new(Input::A, objects, 1)
//! }
//! ```

use crate::classes::Classes;
use crate::quad::{Quad, hull};
use catseye::road::mask::Grid;
use glam::DVec2;

/// Parts of fewer cells are left out: cut-off corners at the edge of a grid. Of the road grid that is 0.4 m².
pub const LEAST_CELLS: usize = 24;
/// Parts that share less with their quadrilateral (intersection over union) are left out: lanes that bend far or fork.
pub const LEAST_FIT: f64 = 0.5;

/// One true object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object {
    /// Its place in the list of classes.
    pub class: u8,
    /// Its contour.
    pub quad: Quad,
    /// Intersection over union of the contour with the cells of the object.
    pub fit: f64,
}

/// The true objects of one frame. A detector is judged by them and never sees them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Objects {
    found: Vec<Object>,
    /// Parts that no quadrilateral fits.
    misfits: usize,
}

impl Objects {
    /// The objects of a mask of [`CellClass`](catseye::road::mask::CellClass) numbers `[row, column]`: the parts of each listed class but
    /// the first, cells that share an edge being of one part.
    pub fn new(classes: &Classes, grid: &Grid, mask: &[u8]) -> Objects {
        let mut objects = Objects::default();
        for class in 1..classes.count() {
            let number = classes.class(class) as u8;
            for part in parts(grid, mask, number) {
                match fitted(grid, &part) {
                    Some((quad, fit)) if fit >= LEAST_FIT => {
                        objects.found.push(Object { class: class as u8, quad, fit });
                    }
                    _ => objects.misfits += 1,
                }
            }
        }
        objects
    }

    /// Objects with these contours, as places of classes and quadrilaterals.
    pub fn of(objects: impl IntoIterator<Item = (u8, Quad)>) -> Objects {
        let found = objects.into_iter().map(|(class, quad)| Object { class, quad, fit: 1.0 }).collect();
        Objects { found, misfits: 0 }
    }

    /// All of them.
    pub fn all(&self) -> &[Object] {
        &self.found
    }

    /// Number of parts that no quadrilateral fits.
    pub fn misfits(&self) -> usize {
        self.misfits
    }

    /// The same seen in a mirror, left for right.
    pub fn mirrored(&self) -> Objects {
        let found = self.found.iter().map(|o| Object { quad: o.quad.mirrored(), ..*o }).collect();
        Objects { found, misfits: self.misfits }
    }
}

/// The connected parts of a class of at least [`LEAST_CELLS`] cells, each as a list of its cells in the order of the mask.
fn parts(grid: &Grid, mask: &[u8], class: u8) -> Vec<Vec<usize>> {
    let mut seen = vec![false; mask.len()];
    let mut found = Vec::new();
    for start in 0..mask.len() {
        if seen[start] || mask[start] != class {
            continue;
        }
        seen[start] = true;
        let mut part = vec![start];
        let mut next = 0;
        while next < part.len() {
            let (row, column) = (part[next] / grid.columns, part[next] % grid.columns);
            next += 1;
            let around = [
                (row > 0).then(|| (row - 1, column)),
                (row + 1 < grid.rows).then_some((row + 1, column)),
                (column > 0).then(|| (row, column - 1)),
                (column + 1 < grid.columns).then_some((row, column + 1)),
            ];
            for (r, c) in around.into_iter().flatten() {
                let cell = r * grid.columns + c;
                if !seen[cell] && mask[cell] == class {
                    seen[cell] = true;
                    part.push(cell);
                }
            }
        }
        if part.len() >= LEAST_CELLS {
            part.sort_unstable();
            found.push(part);
        }
    }
    found
}

/// How many cells of a part lie in a quadrilateral, by sums along its rows.
struct Counter<'a> {
    grid: &'a Grid,
    first_row: usize,
    /// `[row, column]`: cells of the part before a column.
    before: Vec<u32>,
    cells: usize,
}

impl Counter<'_> {
    fn new<'a>(grid: &'a Grid, part: &[usize]) -> Counter<'a> {
        let (first_row, last_row) = (part[0] / grid.columns, part[part.len() - 1] / grid.columns);
        let width = grid.columns + 1;
        let mut before = vec![0u32; (last_row - first_row + 1) * width];
        for cell in part {
            before[(cell / grid.columns - first_row) * width + cell % grid.columns + 1] = 1;
        }
        for row in before.chunks_exact_mut(width) {
            for k in 1..width {
                row[k] += row[k - 1];
            }
        }
        Counter { grid, first_row, before, cells: part.len() }
    }

    /// Intersection over union of a quadrilateral with the part's cells. Each row counts by the width that the quadrilateral has in the
    /// middle of what it covers of the row, which is its area there but for corners within the row.
    fn iou(&self, quad: &Quad) -> f64 {
        let (g, width) = (self.grid, self.grid.columns + 1);
        let (deep_m, wide_m) = (g.ahead_m / g.rows as f64, g.across_m / g.columns as f64);
        let ends = quad.corners().iter().map(|c| c.x);
        let (near, far) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let mut inside = 0.0;
        for (k, row) in self.before.chunks_exact(width).enumerate() {
            let start = (self.first_row + k) as f64 * deep_m;
            let (from, to) = (start.max(near), (start + deep_m).min(far));
            let Some((right, left)) = (from < to).then(|| across(quad, 0.5 * (from + to))).flatten() else {
                continue;
            };
            // Columns run from left to right; cells left of a place, the one at the place in part.
            let held = |y: f64| {
                let c = ((0.5 - y / g.across_m) * g.columns as f64).clamp(0.0, g.columns as f64);
                let whole = (c as usize).min(g.columns - 1);
                let (a, b) = (f64::from(row[whole]), f64::from(row[whole + 1]));
                a + (b - a) * (c - whole as f64)
            };
            inside += (held(right) - held(left)) * (to - from) / deep_m;
        }
        let cell_m2 = deep_m * wide_m;
        let both = inside * cell_m2;
        both / (self.cells as f64 * cell_m2 + quad.area_m2() - both).max(f64::MIN_POSITIVE)
    }
}

/// Where a line across at x enters and leaves a quadrilateral, y to the right and to the left, m.
fn across(quad: &Quad, x: f64) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let corners = quad.corners();
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        if (a.x - x) * (b.x - x) <= 0.0 && a.x != b.x {
            let y = a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x);
            (low, high) = (low.min(y), high.max(y));
        }
    }
    (low <= high).then_some((low, high))
}

/// The rectangle of least area around a convex polygon: one of its sides lies on one of the polygon's (Freeman and Shapira 1975).
fn least_rectangle(hull: &[DVec2]) -> Option<Quad> {
    let sides = hull.iter().zip(hull.iter().cycle().skip(1));
    let boxes = sides.filter_map(|(a, b)| {
        let u = (*b - *a).try_normalize()?;
        let spread = |along: DVec2| {
            let range = hull.iter().map(|p| along.dot(*p));
            range.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), d| (lo.min(d), hi.max(d)))
        };
        let ((u0, u1), (v0, v1)) = (spread(u), spread(u.perp()));
        Quad::of([(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(s, t)| u * s + u.perp() * t))
    });
    boxes.min_by(|a, b| a.area_m2().total_cmp(&b.area_m2()))
}

/// The trapezium between straight lines through the left and the right edges of a part, by least squares, from its near to its far end.
fn trapezium(grid: &Grid, part: &[usize]) -> Option<Quad> {
    let half_m = 0.5 * grid.across_m / grid.columns as f64;
    let mut rows: Vec<(f64, f64, f64)> = Vec::new();
    for of in part.chunk_by(|a, b| a / grid.columns == b / grid.columns) {
        let place = |cell: usize| grid.middle_m(cell / grid.columns, cell % grid.columns);
        let (left, right) = (place(of[0]), place(of[of.len() - 1]));
        rows.push((left[0], left[1] + half_m, right[1] - half_m));
    }
    let n = rows.len() as f64;
    let mean_x = rows.iter().map(|r| r.0).sum::<f64>() / n;
    let spread = rows.iter().map(|r| (r.0 - mean_x).powi(2)).sum::<f64>().max(f64::MIN_POSITIVE);
    let line = |of: &dyn Fn(&(f64, f64, f64)) -> f64| {
        let mean = rows.iter().map(of).sum::<f64>() / n;
        let slope = rows.iter().map(|r| (r.0 - mean_x) * (of(r) - mean)).sum::<f64>() / spread;
        move |x: f64| mean + slope * (x - mean_x)
    };
    let (left, right) = (line(&|r| r.1), line(&|r| r.2));
    let deep_m = 0.5 * grid.ahead_m / grid.rows as f64;
    let (near, far) = (rows.first()?.0 - deep_m, rows.last()?.0 + deep_m);
    let at = |x: f64, y: f64| DVec2::new(x, y);
    Quad::of([at(near, left(near)), at(near, right(near)), at(far, right(far)), at(far, left(far))])
}

/// The convex quadrilateral that fits a part of a mask best, and its intersection over union with the part's cells. It begins with the
/// better one of the least rectangle and the trapezium of the edges, whose corners then move as long as that helps, by 1 m at first
/// and by a quarter of a cell at last.
fn fitted(grid: &Grid, part: &[usize]) -> Option<(Quad, f64)> {
    let half = 0.5 * DVec2::new(grid.ahead_m / grid.rows as f64, grid.across_m / grid.columns as f64);
    // The ends of each row are all that the hull can touch.
    let mut rim = Vec::new();
    for of in part.chunk_by(|a, b| a / grid.columns == b / grid.columns) {
        for cell in [of[0], of[of.len() - 1]] {
            let middle = DVec2::from_array(grid.middle_m(cell / grid.columns, cell % grid.columns));
            let signs = [DVec2::new(-1.0, -1.0), DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0), DVec2::ONE];
            rim.extend(signs.map(|s| middle + s * half));
        }
    }
    let counter = Counter::new(grid, part);
    let starts = [least_rectangle(&hull(&rim)), trapezium(grid, part)];
    let rated = starts.into_iter().flatten().map(|q| (q, counter.iou(&q)));
    let (mut best, mut fit) = rated.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut step_m = 1.0;
    while step_m >= 0.5 * half.min_element() {
        let mut better = false;
        for corner in 0..4 {
            for along in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
                let mut corners = *best.corners();
                corners[corner] += along * step_m;
                let Some(tried) = Quad::of(corners) else { continue };
                let iou = counter.iou(&tried);
                // Less than this is what counting of cells makes.
                if iou > fit + 1e-4 {
                    (best, fit, better) = (tried, iou, true);
                }
            }
        }
        if !better {
            step_m *= 0.5;
        }
    }
    Some((best, fit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::road::mask::CellClass;

    fn at(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    fn classes() -> Classes {
        Classes::named(&["undefined", "lane", "vehicle"].map(String::from)).unwrap()
    }

    /// Cells whose middle satisfies a condition are of a class.
    fn draw(mask: &mut [u8], class: CellClass, is_in: impl Fn(DVec2) -> bool) {
        let g = Grid::ROAD;
        for (cell, value) in mask.iter_mut().enumerate() {
            if is_in(DVec2::from_array(g.middle_m(cell / g.columns, cell % g.columns))) {
                *value = class as u8;
            }
        }
    }

    fn blank() -> Vec<u8> {
        vec![0; Grid::ROAD.cells()]
    }

    fn apart(found: &Quad, wanted: &Quad) -> f64 {
        let pairs = found.corners().iter().zip(wanted.corners());
        pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
    }

    #[test]
    fn a_rectangle_and_a_trapezium_come_back_within_a_cell() {
        let cell_m = 60.0 / 450.0;
        let rectangle = Quad::of([at(10.0, 1.0), at(10.0, -0.8), at(14.5, -0.8), at(14.5, 1.0)]).unwrap();
        let trapezium = Quad::of([at(2.0, 4.0), at(2.0, -3.0), at(50.0, 0.5), at(50.0, 6.0)]).unwrap();
        for (wanted, class) in [(rectangle, CellClass::Vehicle), (trapezium, CellClass::Lane)] {
            let mut mask = blank();
            draw(&mut mask, class, |p| across(&wanted, p.x).is_some_and(|(lo, hi)| lo <= p.y && p.y <= hi));
            let found = Objects::new(&classes(), &Grid::ROAD, &mask);
            let [object] = found.all() else { panic!("{found:?}") };
            assert_eq!(u16::from(object.class), class as u16);
            assert!(apart(&object.quad, &wanted) < 1.5 * cell_m, "{object:?} {wanted:?}");
            assert!(object.fit > 0.95 && object.quad.iou(&wanted) > 0.95, "{object:?}");
        }
    }

    /// A car that stands aslant, which the grid makes ragged.
    #[test]
    fn a_tilted_rectangle_comes_back() {
        for degrees in [15.0f64, 30.0, 45.0, 70.0] {
            let u = DVec2::from_angle(degrees.to_radians());
            let middle = at(30.0, -5.0);
            let mut mask = blank();
            draw(&mut mask, CellClass::Vehicle, |p| {
                let d = p - middle;
                u.dot(d).abs() <= 2.25 && u.perp_dot(d).abs() <= 0.9
            });
            let corner = |(s, t): (f64, f64)| middle + u * s * 2.25 + u.perp() * t * 0.9;
            let wanted = Quad::of([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(corner)).unwrap();
            let found = Objects::new(&classes(), &Grid::ROAD, &mask);
            let [object] = found.all() else { panic!("{found:?}") };
            assert!(object.quad.iou(&wanted) > 0.85, "{degrees}: {}", object.quad.iou(&wanted));
        }
    }

    /// Two cars are two objects and the lane around them one; specks are none, and a ring, which no quadrilateral fits, is told.
    #[test]
    fn parts_are_objects_of_their_own() {
        let mut mask = blank();
        draw(&mut mask, CellClass::Lane, |p| p.y.abs() < 3.5);
        for x in [20.0, 40.0] {
            draw(&mut mask, CellClass::Vehicle, |p| (p.x - x).abs() < 2.0 && p.y.abs() < 0.9);
        }
        draw(&mut mask, CellClass::Vehicle, |p| (p.x - 30.0).abs() < 0.2 && (p.y - 10.0).abs() < 0.2);
        let found = Objects::new(&classes(), &Grid::ROAD, &mask);
        let of = |class| found.all().iter().filter(move |o| o.class == class).count();
        assert_eq!((of(1), of(2), found.misfits()), (1, 2, 0));
        assert!(found.all()[0].fit > 0.9);
        let mut ring = blank();
        draw(&mut ring, CellClass::Lane, |p| ((p - at(30.0, 0.0)).length() - 15.0).abs() < 1.0);
        let found = Objects::new(&classes(), &Grid::ROAD, &ring);
        assert_eq!((found.all().len(), found.misfits()), (0, 1));
        // A bend of 200 m, with a quadrilateral that fits it less than a straight one.
        let mut bend = blank();
        draw(&mut bend, CellClass::Lane, |p| (p.distance(at(0.0, 200.0)) - 200.0).abs() < 3.5);
        let found = Objects::new(&classes(), &Grid::ROAD, &bend);
        let fit = found.all()[0].fit;
        assert!((0.8..0.9).contains(&fit), "{fit}");
    }

    #[test]
    fn a_mirror_moves_contours_as_it_moves_cells() {
        let (mut mask, mut other) = (blank(), blank());
        draw(&mut mask, CellClass::Vehicle, |p| (p - at(20.0, 4.0)).abs().cmple(at(2.0, 1.05)).all());
        draw(&mut other, CellClass::Vehicle, |p| (p - at(20.0, -4.0)).abs().cmple(at(2.0, 1.05)).all());
        let [a, b] = [mask, other].map(|m| Objects::new(&classes(), &Grid::ROAD, &m));
        assert!(a.mirrored().all()[0].quad.iou(&b.all()[0].quad) > 0.97);
        assert_eq!(a.mirrored().mirrored(), a);
    }
}
