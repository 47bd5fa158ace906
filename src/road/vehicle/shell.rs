//! The closed outer skin of a car, van or cab: level sections whose outlines are arcs, stacked to a smooth
//! surface, with wheel houses cut into its sides and recesses into its ends.

use super::surface::{Surface, grid, mirror, normal, spline, steps};
use crate::road::shape::{curved_polygon, polygon, weld};
use crate::scene::Mesh;
use glam::{DVec2, DVec3};

/// One level section, symmetric about y = 0: two ends, two sides, four corners, all of them arcs that run
/// into each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Height, m.
    pub z: f64,
    /// x of the foremost and of the rearmost point.
    pub front: f64,
    /// Rear end, m.
    pub rear: f64,
    /// Half the width, m.
    pub half_width: f64,
    /// Radii of the arcs: front, rear, side, front corners, rear corners.
    pub radii: [f64; 5],
}

impl Level {
    fn knot(&self) -> [f64; 9] {
        let [a, b, c, d, e] = self.radii;
        [self.z, self.front, self.rear, self.half_width, a, b, c, d, e]
    }
}

/// Levels `from` to `to` are one smooth surface; between bands there is a crease.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// First level.
    pub from: usize,
    /// Last level.
    pub to: usize,
    /// Rows of facets between them.
    pub rows: usize,
}

/// A wheel house over the axle at `x_m`: the arch is half an ellipse from floor to floor, `half_m` to either
/// side and up to `top_m` over the road; and its inner wall's y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arch {
    /// Place of the axle, m.
    pub x_m: f64,
    /// Half the length, m.
    pub half_m: f64,
    /// Height, m.
    pub top_m: f64,
    /// The inner wall's y, m.
    pub inner_y_m: f64,
}

/// A rectangle of an end, pressed in: columns (of the half, 0 in the middle of that end), rows of the first
/// band, depth, and how much of the outline is left at the bottom of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recess {
    /// Whether it is in the rear end.
    pub rear: bool,
    /// Columns from and to.
    pub columns: (usize, usize),
    /// Rows from and to.
    pub rows: (usize, usize),
    /// Depth, m.
    pub depth_m: f64,
    /// Share of the outline that is left at the bottom.
    pub narrowing: f64,
    /// 0 is a flat bottom, 1 a bowl.
    pub bowl: f64,
    /// Material of the bottom.
    pub material: u32,
}

/// Where a cell is: its band, and its place along the half outline: 0..1 the front arc, 1..2 the front
/// corner, 2..3 the side, 3..4 the rear corner, 4..5 the rear arc.
pub type Zone<'a> = &'a dyn Fn(usize, f64, f64) -> u32;

/// All that makes a shell.
pub struct Shell<'a> {
    /// Levels from the floor up.
    pub levels: &'a [Level],
    /// Smooth parts of the surface.
    pub bands: &'a [Band],
    /// Wheel houses.
    pub arches: &'a [Arch],
    /// Pressed rectangles.
    pub recesses: &'a [Recess],
    /// Material of a cell: band, place along the outline, height.
    pub zone: Zone<'a>,
    /// Material of the floor.
    pub floor: u32,
    /// Material of the wheel houses.
    pub wheel_house: u32,
}

/// Cells of the half outline on the arcs of front, corner, corner and rear, and on the side between arches.
const ENDS: usize = 8;
const CORNER: usize = 5;
const DOORS: usize = 4;
const ARCH: usize = 10;

/// x of the ends of the side's arc, front and rear.
fn side_ends(knot: &[f64; 9]) -> (f64, f64) {
    (outline(knot, 2.0, 0.0).x, outline(knot, 3.0, 1.0).x)
}

/// Outline of a half section (y >= 0): point of the arcs at `t` (see [`Zone`]); on the side it is the one
/// that lies the share `along` of the way from its front end.
fn outline(knot: &[f64; 9], t: f64, along: f64) -> DVec3 {
    let [z, front, rear, w, rf, rr, rs, cf, cr] = *knot;
    // Everything about the middle, in which the side's arc has its centre.
    let mid = 0.5 * (front + rear);
    let side = DVec2::new(0.0, w - rs);
    // Corner circle inside both the end's circle and the side's.
    let corner = |half: f64, end_r: f64, r: f64| {
        let end = DVec2::new(half - end_r, 0.0);
        let (p, q) = (end_r - r, rs - r);
        let line = side - end;
        let d = line.length();
        let along = (d * d + p * p - q * q) / (2.0 * d);
        let off = (p * p - along * along).max(0.0).sqrt();
        let (e, n) = (line / d, line.perp() / d);
        let (a, b) = (end + along * e + off * n, end + along * e - off * n);
        (end, if a.x > b.x { a } else { b })
    };
    // The quarter towards +x; `t` 0 in the middle of the end, 2 where the side begins.
    let quarter = |half: f64, end_r: f64, r: f64, t: f64| {
        let (end, c) = corner(half, end_r, r);
        let (from, to) = ((c - end).to_angle(), (c - side).to_angle());
        if t <= 1.0 {
            end + end_r * DVec2::from_angle(from * t)
        } else {
            c + r * DVec2::from_angle(from + (to - from) * (t - 1.0))
        }
    };
    let half = 0.5 * (front - rear);
    let p = if t <= 2.0 {
        quarter(half, rf, cf, t)
    } else if t >= 3.0 {
        let p = quarter(half, rr, cr, 5.0 - t);
        DVec2::new(-p.x, p.y)
    } else {
        let (a, b) = (quarter(half, rf, cf, 2.0).x, -quarter(half, rr, cr, 2.0).x);
        let x = a + (b - a) * along;
        DVec2::new(x, side.y + (rs * rs - x * x).sqrt())
    };
    let y = if t == 0.0 || t == 5.0 { 0.0 } else { p.y };
    DVec3::new(mid + p.x, y, z)
}

impl Shell<'_> {
    /// The skin as a closed mesh, a mirror image of itself.
    ///
    /// None where the levels' arcs do not meet, or an arch does not fit on the side.
    pub fn mesh(&self) -> Option<Mesh> {
        let mut mesh = Mesh::default();
        let columns = self.columns()?;
        for (b, band) in self.bands.iter().enumerate() {
            let top = (band.to - band.from) as f64;
            let skin = self.skin(b);
            let rows = steps(0.0, top, band.rows);
            let foot = |t: f64| if b == 0 { self.arch_at(&skin, t, top) } else { 0.0 };
            // Rows over a wheel house begin on its arch.
            let warped = |t: f64, v: f64| match foot(t) {
                // Ends are met exactly, so that neighbours share their corners.
                s if s == 0.0 || v == top => skin(t, v),
                s => skin(t, s + (top - s) * v / top),
            };
            let recessed = |i: usize, j: usize| {
                b == 0 && self.recesses.iter().any(|r| r.cells(columns.len() - 1).holds(i, j))
            };
            let mid = |x: &[f64], i: usize| 0.5 * (x[i] + x[i + 1]);
            let zone = |i: usize, j: usize| {
                let t = mid(&columns, i);
                let z = warped(t, mid(&rows, j)).z;
                (!recessed(i, j)).then(|| (self.zone)(b, t, z))
            };
            // Along the outline from the front, then up: that way round the fronts look outwards.
            if b == 0 && !self.arches.is_empty() {
                self.side(&mut mesh, &columns, &rows, &warped, &skin, &zone);
            } else {
                grid(&mut mesh, (&columns, &rows), &skin, false, &zone);
            }
            if b == 0 {
                for r in self.recesses {
                    r.press(&mut mesh, &columns, &rows, &skin);
                }
            }
        }
        for arch in self.arches {
            self.house(&mut mesh, arch, &columns)?;
        }
        mirror(&mut mesh);
        self.close(&mut mesh, &columns);
        let mesh = weld(mesh);
        mesh.positions_m.iter().all(|p| p.is_finite()).then_some(mesh)
    }

    /// The surface of a band.
    fn skin(&self, band: usize) -> impl Fn(f64, f64) -> DVec3 + use<> {
        let knots_of =
            |b: &Band| -> Vec<[f64; 9]> { self.levels[b.from..=b.to].iter().map(Level::knot).collect() };
        let knots = knots_of(&self.bands[band]);
        let first = knots_of(&self.bands[0]);
        let (foot, head) = (first[0], first[first.len() - 1]);
        let (front, rear) = side_ends(&foot);
        // Places along the side between which the columns stand upright in the first band: the wheel houses.
        let outer = |sign: f64| {
            let ends = self.arches.iter().map(|a| a.x_m + sign * a.half_m);
            ends.reduce(|p, q| if sign * p > sign * q { p } else { q }).unwrap_or(0.5 * (front + rear))
        };
        let (upright, until) = (outer(1.0), outer(-1.0));
        let along = move |t: f64, knot: &[f64; 9]| {
            let (a, b) = side_ends(knot);
            let x = front + (rear - front) * (t - 2.0);
            let x = if x > upright {
                x + (a - front) * (x - upright) / (front - upright)
            } else if x < until {
                x + (b - rear) * (until - x) / (until - rear)
            } else {
                x
            };
            (x - a) / (b - a)
        };
        move |t: f64, s: f64| {
            let knot = spline(&knots, s);
            let on_side = t > 2.0 && t < 3.0;
            let share = if on_side { along(t, if band == 0 { &knot } else { &head }) } else { t - 2.0 };
            outline(&knot, t, share)
        }
    }

    fn first(&self) -> impl Fn(f64, f64) -> DVec3 + use<> {
        self.skin(0)
    }

    /// Places of the columns along the half outline, among them the ends of each arch.
    fn columns(&self) -> Option<Vec<f64>> {
        let skin = self.first();
        let (a, b) = (skin(2.0, 0.0), skin(3.0, 0.0));
        let t_of = |x: f64| 2.0 + (a.x - x) / (a.x - b.x);
        let mut side = vec![2.0];
        let mut arches = self.arches.to_vec();
        arches.sort_by(|p, q| q.x_m.total_cmp(&p.x_m));
        for arch in &arches {
            let (from, to) = (t_of(arch.x_m + arch.half_m), t_of(arch.x_m - arch.half_m));
            let before = *side.last()?;
            if !(from > before && to < 3.0) {
                return None;
            }
            side.extend(steps(before, from, DOORS).into_iter().skip(1));
            for k in 1..ARCH {
                let angle = std::f64::consts::PI * k as f64 / ARCH as f64;
                side.push(t_of(arch.x_m + arch.half_m * angle.cos()));
            }
            side.push(to);
        }
        let before = *side.last()?;
        side.extend(steps(before, 3.0, DOORS).into_iter().skip(1));
        if side.windows(2).any(|p| p[1] <= p[0]) {
            return None;
        }
        let mut all = steps(0.0, 1.0, ENDS);
        all.extend(steps(1.0, 2.0, CORNER).into_iter().skip(1));
        all.extend(side.into_iter().skip(1));
        all.extend(steps(3.0, 4.0, CORNER).into_iter().skip(1));
        all.extend(steps(4.0, 5.0, ENDS).into_iter().skip(1));
        Some(all)
    }

    /// Which arch a column stands over, its ends included.
    fn over(&self, t: f64) -> Option<&Arch> {
        let p = self.first()(t, 0.0);
        let on_side = (2.0..=3.0).contains(&t);
        self.arches.iter().find(|a| on_side && (p.x - a.x_m).abs() < a.half_m - 1e-9)
    }

    /// Row coordinate at which a column begins: on the arch, or at the bottom.
    fn arch_at(&self, skin: Surface, t: f64, top: f64) -> f64 {
        let Some(a) = self.over(t) else { return 0.0 };
        let floor = self.levels[self.bands[0].from].z;
        let outside = |s: f64| {
            let p = skin(t, s);
            ((p.x - a.x_m) / a.half_m).hypot((p.z - floor) / (a.top_m - floor)) > 1.0
        };
        let (mut lo, mut hi) = (0.0, top);
        for _ in 0..60 {
            let mid = 0.5 * (lo + hi);
            if outside(mid) { hi = mid } else { lo = mid }
        }
        hi
    }

    /// The first band with its arches: places by `warped`, normals of the unbent surface.
    fn side(
        &self,
        mesh: &mut Mesh,
        columns: &[f64],
        rows: &[f64],
        warped: Surface,
        skin: Surface,
        zone: &dyn Fn(usize, usize) -> Option<u32>,
    ) {
        let top = rows[rows.len() - 1];
        let vertex: Vec<Vec<(DVec3, DVec3)>> = columns
            .iter()
            .map(|&t| {
                let s0 = self.arch_at(skin, t, top);
                rows.iter()
                    .map(|&v| {
                        let p = warped(t, v) + DVec3::ZERO;
                        let s = s0 + (top - s0) * v / top;
                        let n = normal(skin, (t, s), (0.0, 5.0), (0.0, top));
                        let n = if p.y == 0.0 { DVec3::new(n.x, 0.0, n.z).normalize_or_zero() } else { n };
                        (p, n)
                    })
                    .collect()
            })
            .collect();
        for i in 0..columns.len() - 1 {
            for j in 0..rows.len() - 1 {
                let Some(material) = zone(i, j) else { continue };
                let c = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(a, b)| vertex[a][b]);
                curved_polygon(mesh, &c.map(|c| c.0), &c.map(|c| c.1), material);
            }
        }
    }

    /// Columns over an arch with the two at its ends, and the places of its edge.
    fn edge(&self, arch: &Arch, columns: &[f64]) -> Option<Vec<DVec3>> {
        let skin = self.first();
        let top = (self.bands[0].to - self.bands[0].from) as f64;
        let inner: Vec<usize> = (0..columns.len()).filter(|&i| self.over(columns[i]) == Some(arch)).collect();
        let (from, to) = (inner.first()?.checked_sub(1)?, inner.last()? + 1);
        Some(
            (from..=to)
                .map(|i| {
                    let s = self.arch_at(&skin, columns[i], top);
                    skin(columns[i], s) + DVec3::ZERO
                })
                .collect(),
        )
    }

    /// The wheel house on the left: a round roof and the inner wall down to the floor.
    fn house(&self, mesh: &mut Mesh, arch: &Arch, columns: &[f64]) -> Option<()> {
        let edge = self.edge(arch, columns)?;
        let floor_z = self.levels[self.bands[0].from].z;
        let inner: Vec<DVec3> = edge.iter().map(|p| DVec3::new(p.x, arch.inner_y_m, p.z)).collect();
        let foot: Vec<DVec3> = edge.iter().map(|p| DVec3::new(p.x, arch.inner_y_m, floor_z)).collect();
        let height = arch.top_m - floor_z;
        let inwards = |p: DVec3| {
            DVec3::new((arch.x_m - p.x) / arch.half_m.powi(2), 0.0, (floor_z - p.z) / height.powi(2))
                .normalize()
        };
        for i in 0..edge.len() - 1 {
            let (p, q) = (edge[i], edge[i + 1]);
            let corners = [q, p, inner[i], inner[i + 1]];
            curved_polygon(mesh, &corners, &corners.map(inwards), self.wheel_house);
            let mut wall = vec![foot[i], foot[i + 1], inner[i + 1], inner[i]];
            wall.dedup();
            if wall.first() == wall.last() {
                wall.pop();
            }
            polygon(mesh, &wall, self.wheel_house);
        }
        Some(())
    }

    /// Floor and roof, flat, between both sides.
    fn close(&self, mesh: &mut Mesh, columns: &[f64]) {
        let skin = self.first();
        // Outline of the floor: its points by falling x, with all y of one x together from the outside in.
        let mut levels: Vec<(f64, Vec<f64>)> = Vec::new();
        let mut add = |x: f64, y: f64| match levels.last_mut() {
            Some((last, ys)) if *last == x => ys.push(y),
            _ => levels.push((x, vec![y])),
        };
        let bottom = self.levels[self.bands[0].from].z;
        let arch_ends: Vec<(usize, usize, f64)> = self
            .arches
            .iter()
            .filter_map(|a| {
                let inside: Vec<usize> =
                    (0..columns.len()).filter(|&i| self.over(columns[i]) == Some(a)).collect();
                Some((inside.first()? - 1, inside.last()? + 1, a.inner_y_m))
            })
            .collect();
        let top = (self.bands[0].to - self.bands[0].from) as f64;
        for (i, &t) in columns.iter().enumerate() {
            let p = skin(t, self.arch_at(&skin, t, top)) + DVec3::ZERO;
            match arch_ends.iter().find(|(a, b, _)| (*a..=*b).contains(&i)) {
                None => add(p.x, p.y),
                Some((a, _, y)) if i == *a => {
                    add(p.x, p.y);
                    add(p.x, *y);
                }
                Some((_, b, y)) if i == *b => {
                    add(p.x, *y);
                    add(p.x, p.y);
                }
                Some((.., y)) => add(p.x, *y),
            }
        }
        for pair in levels.windows(2) {
            // Into the next strip the outline goes on from its last y, out of this one from its first.
            let outer = |ys: &[f64], from: usize| if from == 0 { ys[ys.len() - 1] } else { ys[0] };
            let (front, rear) = (&pair[0], &pair[1]);
            // A level with two y is met in full by the strip on its wider side.
            let side = |level: &(f64, Vec<f64>), from: usize| {
                let y = outer(&level.1, from);
                let mut ys: Vec<f64> = level.1.iter().copied().filter(|v| *v <= y).collect();
                ys.sort_by(f64::total_cmp);
                let mut all: Vec<f64> = ys.iter().rev().map(|v| -v).collect();
                all.extend(ys);
                all.dedup_by(|a, b| *a == *b);
                all.into_iter().map(|v| DVec3::new(level.0, v + 0.0, bottom)).collect::<Vec<_>>()
            };
            let (a, b) = (side(front, 0), side(rear, 1));
            strip(mesh, &a, &b, self.floor);
        }
        let last = self.bands.len() - 1;
        let band = &self.bands[last];
        let (top_skin, height) = (self.skin(last), (band.to - band.from) as f64);
        let points: Vec<DVec3> = columns.iter().map(|&t| top_skin(t, height) + DVec3::ZERO).collect();
        let material = (self.zone)(last, 2.5, self.levels[band.to].z);
        for (p, q) in points.iter().zip(&points[1..]) {
            let pair = |p: &DVec3| if p.y == 0.0 { vec![*p] } else { vec![DVec3::new(p.x, -p.y, p.z), *p] };
            // Looking up: the strip the other way round.
            strip(mesh, &pair(q), &pair(p), material);
        }
    }
}

/// Triangles between two rows of points by rising y, the front row `a` at the greater x: looking down.
fn strip(mesh: &mut Mesh, a: &[DVec3], b: &[DVec3], material: u32) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < a.len() || j + 1 < b.len() {
        let step_a = j + 1 == b.len() || (i + 1 < a.len() && a[i + 1].y <= b[j + 1].y);
        if step_a {
            polygon(mesh, &[b[j], a[i + 1], a[i]], material);
            i += 1;
        } else {
            polygon(mesh, &[a[i], b[j], b[j + 1]], material);
            j += 1;
        }
    }
}

struct Cells {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Cells {
    fn holds(&self, i: usize, j: usize) -> bool {
        (self.columns.0..self.columns.1).contains(&i) && (self.rows.0..self.rows.1).contains(&j)
    }
}

impl Recess {
    fn cells(&self, count: usize) -> Cells {
        let (a, b) = self.columns;
        let columns = if self.rear { (count - b, count - a) } else { (a, b) };
        Cells { columns, rows: self.rows }
    }

    /// Walls and bottom. One that reaches to the middle goes on in its mirror image.
    fn press(&self, mesh: &mut Mesh, columns: &[f64], rows: &[f64], skin: Surface) {
        let cells = self.cells(columns.len() - 1);
        let (us, vs) = (&columns[cells.columns.0..=cells.columns.1], &rows[cells.rows.0..=cells.rows.1]);
        let (u0, u1, v0, v1) = (us[0], us[us.len() - 1], vs[0], vs[vs.len() - 1]);
        let seam = [u0, u1].into_iter().find(|u| *u == 0.0 || *u == 5.0);
        let (uc, vc) = (seam.unwrap_or(0.5 * (u0 + u1)), 0.5 * (v0 + v1));
        let bottom = |u: f64, v: f64| {
            let (p, q) = (uc + (u - uc) * self.narrowing, vc + (v - vc) * self.narrowing);
            let off = |x: f64, c: f64, half: f64| ((x - c) / half).powi(2);
            let half_u = if seam.is_some() { u1 - u0 } else { 0.5 * (u1 - u0) };
            let rim = (0.5 * (off(u, uc, half_u) + off(v, vc, 0.5 * (v1 - v0)))).min(1.0);
            let n = normal(skin, (p, q), (0.0, 5.0), (rows[0], rows[rows.len() - 1]));
            let in_middle = seam == Some(p);
            let n = if in_middle { DVec3::new(n.x, 0.0, n.z).normalize() } else { n };
            skin(p, q) - n * self.depth_m * (1.0 - self.bowl * rim)
        };
        let (nu, nv) = (us.len() - 1, vs.len() - 1);
        grid(mesh, (us, vs), &bottom, false, &|_, _| Some(self.material));
        let mut wall = |a: (f64, f64), b: (f64, f64)| {
            let at = |f: Surface, p: (f64, f64)| f(p.0, p.1) + DVec3::ZERO;
            let (p, q, r, s) = (at(skin, a), at(skin, b), at(&bottom, b), at(&bottom, a));
            polygon(mesh, &[p, q, r], self.material);
            polygon(mesh, &[p, r, s], self.material);
        };
        for i in 0..nu {
            wall((us[i], v0), (us[i + 1], v0));
            wall((us[i + 1], v1), (us[i], v1));
        }
        for j in 0..nv {
            if seam != Some(u1) {
                wall((u1, vs[j]), (u1, vs[j + 1]));
            }
            if seam != Some(u0) {
                wall((u0, vs[j + 1]), (u0, vs[j]));
            }
        }
    }
}
