//! Which tubes to send. A tube is a cell of the wavefront: a rectangle of a plane wave, or a
//! rectangle in azimuth and sine of elevation (equal areas are equal solid angles) of a spherical one.
//! Tubes tile what can be seen of the scene; `rays` follows their axes.

use crate::frames::{Pose, Sensor, World, direction_from_angles, polarisation_basis};
use crate::geom::Geometry;
use crate::scene::radar::Radar;
use crate::units::wavelength_m;
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::f64::consts::TAU;

/// Number and size of the tiles, at most `spacing` wide, that fill `extent` exactly: edges along the
/// axes then fall between tiles. The numbers are even, so that no axis of a tube lies in the middle, where
/// symmetric targets have their seams.
fn tiles(extent: [f64; 2], spacing: f64) -> ([u32; 2], [f64; 2]) {
    let count = extent.map(|x| 2 * (0.5 * x / spacing).ceil().clamp(1.0, 1e9) as u32);
    // A target seen edge-on has no extent: keep the tile's area positive.
    (count, [0, 1].map(|k| (extent[k] / count[k] as f64).max(1e-3 * spacing)))
}

/// A ray with the edges of its tube. For spherical waves `edge` is per metre of path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tube {
    pub origin_m: DVec3,
    /// Unit vector.
    pub dir: DVec3,
    pub edge: [DVec3; 2],
}

/// A regular grid of parallel tubes across `dir`. Cell (i, j) starts at `corner + i step[0] + j step[1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneGrid {
    pub dir: DVec3,
    /// Axis of the tube (0, 0), outside the target.
    pub first_m: DVec3,
    pub step: [DVec3; 2],
    pub count: [u32; 2],
    /// `first_m` lies this far before the plane through the phase reference.
    pub lead_m: f64,
}

impl PlaneGrid {
    /// Tubes of `1/rays_per_wavelength` that cover the projection of `geometry` along `dir`; phases are
    /// referred to the target's origin.
    pub fn cover(geometry: &Geometry, dir: DVec3, rays_per_wavelength: f64) -> PlaneGrid {
        let (u, v) = polarisation_basis(dir);
        let spacing = wavelength_m(geometry.freq_hz) / rays_per_wavelength;
        let mut lo = [f64::INFINITY; 3];
        let mut hi = [f64::NEG_INFINITY; 3];
        for p in geometry.triangles.iter().flat_map(|t| t.corners()) {
            for (k, x) in [p.dot(u), p.dot(v), p.dot(dir)].into_iter().enumerate() {
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
        let (count, step) = tiles([hi[0] - lo[0], hi[1] - lo[1]], spacing);
        let start = [lo[0] + 0.5 * step[0], lo[1] + 0.5 * step[1]];
        let lead_m = -lo[2] + 0.1 * (hi[2] - lo[2]) + 10.0 * geometry.t_min_m;
        PlaneGrid {
            dir,
            first_m: u * start[0] + v * start[1] - dir * lead_m,
            step: [u * step[0], v * step[1]],
            count,
            lead_m,
        }
    }

    pub fn len(&self) -> u64 {
        self.count[0] as u64 * self.count[1] as u64
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    pub fn tube(&self, i: u32, j: u32) -> Tube {
        Tube {
            origin_m: self.first_m + self.step[0] * i as f64 + self.step[1] * j as f64,
            dir: self.dir,
            edge: self.step,
        }
    }
}

/// A rectangle of directions from a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    pub azimuth: f64,
    pub sin_elevation: f64,
    pub d_azimuth: f64,
    pub d_sin: f64,
}

impl Cell {
    /// The same cell moved so that its axis is the middle of one of its borders: axis 0 is azimuth, 1 sine
    /// of elevation; side 0 is the lower one.
    pub fn border(&self, axis: usize, side: usize) -> Cell {
        let half = if side == 0 { -0.5 } else { 0.5 };
        let mut c = *self;
        match axis {
            0 => c.azimuth += half * self.d_azimuth,
            _ => c.sin_elevation += half * self.d_sin,
        }
        c
    }

    /// Axis and edges per metre, in the axes of the fan.
    #[inline]
    pub fn axis_and_edges(&self) -> (DVec3, [DVec3; 2]) {
        let (sa, ca) = self.azimuth.sin_cos();
        let s = self.sin_elevation;
        let c = (1.0 - s * s).sqrt();
        (
            DVec3::new(c * ca, c * sa, s),
            [
                DVec3::new(-c * sa, c * ca, 0.0) * self.d_azimuth,
                DVec3::new(-s / c * ca, -s / c * sa, 1.0) * self.d_sin,
            ],
        )
    }
}

/// Tubes from one point in the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fan {
    pub origin_m: DVec3,
    /// From the axes in which azimuth and elevation of the cells are meant to the world's.
    pub rotation: DQuat,
    pub cells: Vec<Cell>,
}

impl Fan {
    #[inline]
    pub fn tube(&self, index: usize) -> Tube {
        self.tube_of(&self.cells[index])
    }

    #[inline]
    pub fn tube_of(&self, cell: &Cell) -> Tube {
        let (dir, edge) = cell.axis_and_edges();
        Tube { origin_m: self.origin_m, dir: self.rotation * dir, edge: edge.map(|e| self.rotation * e) }
    }

    /// A regular grid over the target's bounding sphere, `rays_per_wavelength` at its centre's distance.
    pub fn grid(geometry: &Geometry, origin_m: DVec3, rays_per_wavelength: f64) -> Fan {
        let (centre, radius) = geometry.bounding_sphere_m();
        let look = centre - origin_m;
        let distance = look.length().max(radius);
        let rotation = DQuat::from_rotation_arc(DVec3::X, look.normalize_or(DVec3::X));
        let step = wavelength_m(geometry.freq_hz) / rays_per_wavelength / distance;
        let half = (radius / distance).min(1.0).asin();
        // Only cells over the target's own bounds.
        let mut lo = [half; 2];
        let mut hi = [-half; 2];
        for p in geometry.triangles.iter().flat_map(|t| t.corners()) {
            let d = (rotation.inverse() * (p - origin_m)).normalize_or(DVec3::X);
            for (k, x) in [d.y.atan2(d.x), d.z].into_iter().enumerate() {
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
        let (count, step) = tiles([hi[0] - lo[0], hi[1] - lo[1]], step);
        let mut cells = Vec::with_capacity(count[0] as usize * count[1] as usize);
        for j in 0..count[1] {
            for i in 0..count[0] {
                let sin_elevation = lo[1] + (0.5 + j as f64) * step[1];
                if sin_elevation.abs() < 0.999 {
                    let azimuth = lo[0] + (0.5 + i as f64) * step[0];
                    cells.push(Cell { azimuth, sin_elevation, d_azimuth: step[0], d_sin: step[1] });
                }
            }
        }
        Fan { origin_m, rotation, cells }
    }
}

/// Widest tube, as the quadratic phase ½k h² (2/R) that is left out across half of it (rad).
const QUADRATIC_PHASE: f64 = 0.25;
/// Finest tube across an outline, in wavelengths: below it the footprint's integral hardly gains.
const FINEST: f64 = 1.0 / 8.0;
/// So many times finer across outlines that run along an axis: there all tubes err to the same side, and
/// finer ones cost little as they may be long.
const ALIGNED: f64 = 16.0;
/// Facets are cut until they look smaller than this, so that their bounds in angle are tight.
const LOOK: f64 = 0.1;
/// Plane patches of at least this size serve as mirrors in which other objects are looked for.
const MIRROR_M2: f64 = 10.0;
/// Mirrors taken, the largest first.
const MIRRORS: usize = 4;
/// Directions in which the antennas' two-way gain is below this share of the peak are left out.
const GAIN_FLOOR: f64 = 1e-9;

/// What is asked of the tubes over one part of the scene.
#[derive(Debug, Clone, Copy)]
struct Demand {
    azimuth: [f64; 2],
    sin: [f64; 2],
    /// A piece of an outline; None for a piece of a surface.
    outline: Option<Outline>,
    finest: f64,
    widest: f64,
}

/// A straight piece of an edge in (azimuth, sine of elevation).
#[derive(Debug, Clone, Copy)]
struct Outline {
    from: [f64; 2],
    /// Unit vector across.
    normal: [f64; 2],
    /// Extent of the whole object of which this is a part.
    extent: [f64; 2],
}

impl Demand {
    /// The largest tube allowed here when objects are resolved by `density` tubes across. Within a surface
    /// the integral over a tube is exact up to the quadratic phase; at an outline a tube is wholly in or
    /// wholly out.
    fn limit(&self, density: f64) -> [f64; 2] {
        let Some(o) = &self.outline else { return [self.widest; 2] };
        let across = o.extent.map(|x| (x / density).clamp(self.finest, self.widest));
        [0, 1].map(|i| {
            let other = 1 - i;
            let aligned = o.normal[other].abs() * self.widest < across[other];
            let fine = if aligned { across[i] / ALIGNED } else { across[i] };
            (fine / o.normal[i].abs().max(1e-9)).min(self.widest)
        })
    }

    /// Whether the bounds hold all of a cell.
    fn covers(&self, azimuth: [f64; 2], sin: [f64; 2]) -> bool {
        let turned = |turn: f64| self.azimuth[0] + turn <= azimuth[0] && self.azimuth[1] + turn >= azimuth[1];
        self.sin[0] <= sin[0] && self.sin[1] >= sin[1] && [-TAU, 0.0, TAU].into_iter().any(turned)
    }

    fn meets(&self, cell: &Cell, azimuth: [f64; 2], sin: [f64; 2]) -> bool {
        if self.sin[0] >= sin[1] || self.sin[1] <= sin[0] {
            return false;
        }
        [-TAU, 0.0, TAU].iter().any(|turn| {
            self.azimuth[0] + turn < azimuth[1]
                && self.azimuth[1] + turn > azimuth[0]
                && self.outline.is_none_or(|o| {
                    let d = [cell.azimuth - turn - o.from[0], cell.sin_elevation - o.from[1]];
                    let away = (d[0] * o.normal[0] + d[1] * o.normal[1]).abs();
                    away <= 0.5
                        * (cell.d_azimuth * o.normal[0].abs() + cell.d_sin * o.normal[1].abs() + self.finest)
                })
        })
    }
}

impl Fan {
    /// Tubes from the radar over everything in its view. Tubes across the edges of an object that can be
    /// seen from the radar, directly or in the mirror of the largest planes, are as many times finer than
    /// the object as makes about `rays` in all; fewer when the finest useful tubes need fewer.
    pub fn cover(geometry: &Geometry, radar: &Radar, pose: &Pose<Sensor, World>, rays: u64) -> Fan {
        let planner = Planner::new(geometry, radar, pose);
        // The count grows with the square of the density above a floor: secant steps on the square.
        let floor = planner.count(1.0) as f64;
        let budget = rays as f64;
        let mut density: f64 = 8.0;
        for _ in 0..4 {
            let n = planner.count(density) as f64;
            let gain = ((budget - floor).max(1.0) / (n - floor).max(1.0)).sqrt();
            density = (density * gain.clamp(0.1, 10.0)).clamp(1.0, 4096.0);
            if (gain - 1.0).abs() < 0.03 {
                break;
            }
        }
        let cells = planner.cells(density);
        Fan { origin_m: pose.translation_m, rotation: DQuat::IDENTITY, cells }
    }
}

/// Cells below this size are refined by one thread each (rad).
const PART: f64 = 0.05;

/// Number of a demand, and its limit at the density in use.
type Limited = (u32, [f64; 2]);

/// A cell on its way, as [`Planner::split`] takes it.
struct Part {
    cell: Cell,
    covered: bool,
    inside: Vec<Limited>,
}

/// A plane in which the scene is seen again.
#[derive(Debug, Clone, Copy)]
struct Mirror {
    normal: DVec3,
    offset_m: f64,
    patch: u32,
}

impl Mirror {
    fn image(&self, p: DVec3) -> DVec3 {
        p - self.normal * (2.0 * (self.normal.dot(p) - self.offset_m))
    }
}

/// Border of a patch.
struct Edge {
    ends: [DVec3; 2],
    body: u32,
    patch: u32,
}

/// All sides of triangles but those inside a plane patch, each once, in the order of the triangles.
fn edges(geometry: &Geometry) -> Vec<Edge> {
    let mut seen: HashMap<(u32, [[u64; 3]; 2]), usize> = HashMap::new();
    let mut found: Vec<(Edge, bool)> = Vec::new();
    for t in &geometry.triangles {
        let c = t.corners();
        for ends in [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]] {
            // To a nanometre: corners of neighbours are computed by different sums.
            let mut key = ends.map(|p| (p * 1e9).round().to_array().map(|x| x as i64 as u64));
            key.sort_unstable();
            match seen.entry((t.body, key)) {
                Entry::Occupied(e) => {
                    let (edge, inner) = &mut found[*e.get()];
                    *inner = edge.patch == t.patch;
                }
                Entry::Vacant(e) => {
                    e.insert(found.len());
                    found.push((Edge { ends, body: t.body, patch: t.patch }, false));
                }
            }
        }
    }
    found.into_iter().filter(|(_, inner)| !inner).map(|(e, _)| e).collect()
}

/// Whether `p`, which is an image if there is a mirror, is to be seen from `origin`.
fn can_see(geometry: &Geometry, origin: DVec3, p: DVec3, mirror: Option<&Mirror>) -> bool {
    let reach = (p - origin).length();
    let dir = (p - origin) / reach;
    let clear = |from: DVec3, dir, skip, length: f64| {
        !geometry.bvh.any_hit(&geometry.triangles, from, dir, skip, length * (1.0 - 1e-6) - 1e-4)
    };
    let Some(m) = mirror else { return clear(origin, dir, u32::MAX, reach) };
    let Some(hit) = geometry.bvh.closest_hit(&geometry.triangles, origin, dir, u32::MAX, reach) else {
        return false;
    };
    geometry.triangles[hit.triangle as usize].patch == m.patch
        && clear(origin + dir * hit.t, dir - m.normal * (2.0 * dir.dot(m.normal)), m.patch, reach - hit.t)
}

/// Adds the pieces of an edge seen from `origin`, cut until they are straight in the angles; those that
/// are hidden altogether are left out.
fn outline(
    ends: [DVec3; 2],
    origin: DVec3,
    k: f64,
    extent: &dyn Fn(&Demand) -> [f64; 2],
    sees: &dyn Fn(DVec3) -> bool,
    out: &mut Vec<Demand>,
    depth: u32,
) {
    let angles = |p: DVec3| {
        let r = p - origin;
        [r.y.atan2(r.x), r.z / r.length()]
    };
    let [a, b] = ends;
    let middle = 0.5 * (a + b);
    let along = b - a;
    let t = ((origin - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let nearest = (a + along * t - origin).length();
    if nearest <= 0.0 || nearest.is_nan() {
        return;
    }
    let finest = FINEST * TAU / k / nearest;
    let from = angles(a);
    let near = |mut q: [f64; 2]| {
        q[0] -= TAU * ((q[0] - from[0]) / TAU).round();
        q
    };
    let (to, mid) = (near(angles(b)), near(angles(middle)));
    let d = [to[0] - from[0], to[1] - from[1]];
    let length = d[0].hypot(d[1]);
    let normal = if length > 0.0 { [-d[1] / length, d[0] / length] } else { [1.0, 0.0] };
    let sag = ((mid[0] - from[0]) * normal[0] + (mid[1] - from[1]) * normal[1]).abs();
    if (length > 0.5 * LOOK || sag > 0.25 * finest) && depth < 16 {
        for half in [[a, middle], [middle, b]] {
            outline(half, origin, k, extent, sees, out, depth + 1);
        }
        return;
    }
    if ![0.02, 0.26, 0.5, 0.74, 0.98].iter().any(|t| sees(a + along * *t)) {
        return;
    }
    let bounds = |i: usize| [from[i].min(to[i]) - 0.5 * finest, from[i].max(to[i]) + 0.5 * finest];
    let mut demand =
        Demand { azimuth: bounds(0), sin: bounds(1), outline: None, finest, widest: widest(k, nearest) };
    demand.outline = Some(Outline { from, normal, extent: extent(&demand) });
    out.push(demand);
}

/// The angle across half of which the quadratic phase ½k h² (2/R) reaches its limit.
fn widest(k: f64, range_m: f64) -> f64 {
    2.0 * (QUADRATIC_PHASE / (k * range_m)).sqrt()
}

struct Planner<'a> {
    radar: &'a Radar,
    pose: Pose<Sensor, World>,
    demands: Vec<Demand>,
}

impl<'a> Planner<'a> {
    fn new(geometry: &Geometry, radar: &'a Radar, pose: &Pose<Sensor, World>) -> Self {
        let origin = pose.translation_m;
        let k = TAU / wavelength_m(geometry.freq_hz);
        let mut by_body: Vec<Vec<usize>> = vec![Vec::new(); geometry.bodies.len()];
        for (i, t) in geometry.triangles.iter().enumerate() {
            by_body[t.body as usize].push(i);
        }
        // Mirrors: the planes with most area.
        let mut area = vec![(0.0f64, 0usize); geometry.patches as usize];
        for (i, t) in geometry.triangles.iter().enumerate() {
            let a = &mut area[t.patch as usize];
            *a = (a.0 + t.area_m2(), i);
        }
        area.retain(|a| a.0 >= MIRROR_M2);
        area.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        area.truncate(MIRRORS);
        let edges = edges(geometry);
        let mirrors = area.iter().map(|&(_, i)| {
            let t = &geometry.triangles[i];
            Mirror { normal: t.normal, offset_m: t.normal.dot(t.v0), patch: t.patch }
        });

        let mut demands = Vec::new();
        for mirror in std::iter::once(None).chain(mirrors.map(Some)) {
            for (index, body) in by_body.iter().enumerate() {
                let mut parts: Vec<Demand> = Vec::new();
                for &i in body {
                    let t = &geometry.triangles[i];
                    // A plane is not looked for in its own mirror.
                    if mirror.is_some_and(|m| m.patch == t.patch) {
                        continue;
                    }
                    let corners = t.corners().map(|p| mirror.map_or(p, |m| m.image(p)));
                    cut(corners, origin, k, &mut parts, 0);
                }
                if parts.is_empty() {
                    continue;
                }
                let bounds = |f: fn(&Demand) -> [f64; 2]| {
                    parts
                        .iter()
                        .map(f)
                        .fold([f64::INFINITY, f64::NEG_INFINITY], |b, x| [b[0].min(x[0]), b[1].max(x[1])])
                };
                let (azimuth, sin) = (bounds(|p| p.azimuth), bounds(|p| p.sin));
                // How large the body looks at each place along it: a rail is long but thin.
                let across = Extent::new(azimuth, parts.iter().map(|p| (p.azimuth, p.sin)));
                let along = Extent::new(sin, parts.iter().map(|p| (p.sin, p.azimuth)));
                let extent = |d: &Demand| [along.at(d.sin), across.at(d.azimuth)];
                for e in edges
                    .iter()
                    .filter(|e| e.body as usize == index && mirror.is_none_or(|m| m.patch != e.patch))
                {
                    let ends = e.ends.map(|p| mirror.map_or(p, |m| m.image(p)));
                    let sees = |p: DVec3| can_see(geometry, origin, p, mirror.as_ref());
                    outline(ends, origin, k, &extent, &sees, &mut demands, 0);
                }
                // What the plane of the road shows of itself in a mirror adds nothing.
                let floor = azimuth[1] - azimuth[0] > 1.0 && sin[1] - sin[0] > 0.5;
                if mirror.is_none() || !floor {
                    demands.extend(parts);
                }
            }
        }
        Planner { radar, pose: *pose, demands }
    }

    fn count(&self, density: f64) -> u64 {
        let count = |part: &Part| {
            let mut n = 0;
            self.split(part.cell, part.covered, &part.inside, 0.0, &mut |_, _, _| n += 1);
            n
        };
        self.parts(density).par_iter().map(count).sum()
    }

    fn cells(&self, density: f64) -> Vec<Cell> {
        let cells = |part: &Part| {
            let mut cells = Vec::new();
            self.split(part.cell, part.covered, &part.inside, 0.0, &mut |c, _, _| cells.push(c));
            cells
        };
        self.parts(density).par_iter().flat_map_iter(cells).collect()
    }

    /// Cells of moderate size, in order, for the threads to share.
    fn parts(&self, density: f64) -> Vec<Part> {
        let all: Vec<Limited> =
            (0..self.demands.len() as u32).map(|i| (i, self.demands[i as usize].limit(density))).collect();
        let mut parts = Vec::new();
        let whole = Cell { azimuth: 0.0, sin_elevation: 0.0, d_azimuth: TAU, d_sin: 2.0 };
        self.split(whole, false, &all, PART, &mut |cell, covered, inside| {
            parts.push(Part { cell, covered, inside: inside.to_vec() })
        });
        parts
    }

    /// Halves the cell along the axis that is too wide for some demand in it; emits it when none is, or
    /// when both sides are below `stop`. `above` are the demands that may still ask for something here,
    /// `covered` tells that a surface fills the cell.
    fn split(
        &self,
        cell: Cell,
        mut covered: bool,
        above: &[Limited],
        stop: f64,
        emit: &mut impl FnMut(Cell, bool, &[Limited]),
    ) {
        let a = [cell.azimuth - 0.5 * cell.d_azimuth, cell.azimuth + 0.5 * cell.d_azimuth];
        let s = [cell.sin_elevation - 0.5 * cell.d_sin, cell.sin_elevation + 0.5 * cell.d_sin];
        let mut limit = [LOOK; 2];
        let mut inside = Vec::with_capacity(above.len());
        let mut surface = covered;
        for &(i, l) in above {
            let d = &self.demands[i as usize];
            if !d.meets(&cell, a, s) {
                continue;
            }
            let satisfied = cell.d_azimuth <= l[0] && cell.d_sin <= l[1];
            if d.outline.is_none() {
                surface = true;
                covered |= d.covers(a, s);
            }
            if !satisfied || (d.outline.is_none() && !covered) {
                limit = [limit[0].min(l[0]), limit[1].min(l[1])];
                inside.push((i, l));
            }
        }
        if !surface {
            return;
        }
        let excess = [cell.d_azimuth / limit[0], cell.d_sin / limit[1]];
        if excess[0] <= 1.0 && excess[1] <= 1.0 {
            if stop > 0.0 || self.in_view(&cell) {
                emit(cell, covered, &inside);
            }
            return;
        }
        if cell.d_azimuth < stop && cell.d_sin < stop {
            emit(cell, covered, &inside);
            return;
        }
        let mut half = [cell, cell];
        if excess[0] >= excess[1] {
            for (h, sign) in half.iter_mut().zip([-0.25, 0.25]) {
                h.d_azimuth *= 0.5;
                h.azimuth += sign * cell.d_azimuth;
            }
        } else {
            for (h, sign) in half.iter_mut().zip([-0.25, 0.25]) {
                h.d_sin *= 0.5;
                h.sin_elevation += sign * cell.d_sin;
            }
        }
        for h in half {
            self.split(h, covered, &inside, stop, emit);
        }
    }

    fn in_view(&self, cell: &Cell) -> bool {
        let d = direction_from_angles(cell.azimuth, cell.sin_elevation.clamp(-1.0, 1.0).asin());
        let (az, el) = crate::frames::angles_from_direction(self.pose.rotation.inverse() * d);
        self.radar.tx.iter().any(|t| t.pattern.power_gain(az, el) > GAIN_FLOOR)
    }
}

/// Extent of a body across one angle, as a function of the other.
struct Extent {
    range: [f64; 2],
    bins: Vec<[f64; 2]>,
}

impl Extent {
    const BINS: usize = 64;

    fn new(range: [f64; 2], parts: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> Self {
        let mut e = Extent { range, bins: vec![[f64::INFINITY, f64::NEG_INFINITY]; Self::BINS] };
        for (along, across) in parts {
            for b in e.span(along) {
                e.bins[b] = [e.bins[b][0].min(across[0]), e.bins[b][1].max(across[1])];
            }
        }
        e
    }

    fn span(&self, along: [f64; 2]) -> std::ops::RangeInclusive<usize> {
        let width = (self.range[1] - self.range[0]).max(1e-12);
        let bin = |x: f64| (((x - self.range[0]) / width * Self::BINS as f64) as usize).min(Self::BINS - 1);
        bin(along[0])..=bin(along[1])
    }

    fn at(&self, along: [f64; 2]) -> f64 {
        self.span(along).map(|b| self.bins[b][1] - self.bins[b][0]).fold(0.0, f64::max)
    }
}

/// Adds the bounds in angle of a triangle seen from `origin`, cut until they are tight.
fn cut(v: [DVec3; 3], origin: DVec3, k: f64, out: &mut Vec<Demand>, depth: u32) {
    let r = v.map(|p| p - origin);
    let edges = [r[1] - r[0], r[2] - r[1], r[0] - r[2]];
    let longest =
        (0..3).max_by(|&i, &j| edges[i].length_squared().total_cmp(&edges[j].length_squared())).unwrap_or(0);
    let nearest = nearest_distance(&r);
    if edges[longest].length() > LOOK * nearest && depth < 18 && nearest > 0.0 {
        let (a, b, c) = (v[longest], v[(longest + 1) % 3], v[(longest + 2) % 3]);
        let m = 0.5 * (a + b);
        cut([a, m, c], origin, k, out, depth + 1);
        cut([m, b, c], origin, k, out, depth + 1);
        return;
    }
    if nearest <= 0.0 {
        return;
    }
    let az0 = r[0].y.atan2(r[0].x);
    let mut azimuth = [az0, az0];
    let mut sin = [f64::INFINITY, f64::NEG_INFINITY];
    for p in r {
        // Continuous across +-pi.
        let mut a = p.y.atan2(p.x);
        a -= TAU * ((a - az0) / TAU).round();
        azimuth = [azimuth[0].min(a), azimuth[1].max(a)];
        let s = p.z / p.length();
        sin = [sin[0].min(s), sin[1].max(s)];
    }
    // Small triangles curve little in these coordinates; a tenth of their size covers it.
    let pad = [0.1 * (azimuth[1] - azimuth[0]) + 1e-9, 0.1 * (sin[1] - sin[0]) + 1e-9];
    let lambda = TAU / k;
    out.push(Demand {
        azimuth: [azimuth[0] - pad[0], azimuth[1] + pad[0]],
        sin: [sin[0] - pad[1], sin[1] + pad[1]],
        outline: None,
        finest: FINEST * lambda / nearest,
        widest: widest(k, nearest),
    });
}

/// Smallest distance from the origin to a corner or edge midpoint (a bound is not needed: it steers effort).
fn nearest_distance(r: &[DVec3; 3]) -> f64 {
    let mids = [0.5 * (r[0] + r[1]), 0.5 * (r[1] + r[2]), 0.5 * (r[2] + r[0])];
    r.iter().chain(&mids).map(|p| p.length()).fold(f64::INFINITY, f64::min)
}
