//! Grids of tubes over a target, the independent check of exact beams. A tube is a cell of the wavefront: a
//! rectangle of a plane wave, or a rectangle in azimuth and sine of elevation (equal areas are equal solid
//! angles) of a spherical one. Tubes tile what can be seen of the target; rays follow their axes.

use crate::base::frames::polarisation_basis;
use crate::base::units::wavelength_m;
use crate::geom::Geometry;
use glam::{DQuat, DVec3};

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
    /// Where the ray starts, m.
    pub origin_m: DVec3,
    /// Direction of the ray, a unit vector.
    pub dir: DVec3,
    /// Edges of the tube.
    pub edge: [DVec3; 2],
}

/// A regular grid of parallel tubes across `dir`. Cell (i, j) starts at `corner + i step[0] + j step[1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneGrid {
    /// Direction of all rays.
    pub dir: DVec3,
    /// Axis of the tube (0, 0), outside the target.
    pub first_m: DVec3,
    /// Steps to the next cell along both axes, m.
    pub step: [DVec3; 2],
    /// Number of cells along both axes.
    pub count: [u32; 2],
    /// Distance of `first_m` before the plane through the phase reference, m.
    pub lead_m: f64,
}

impl PlaneGrid {
    /// Tubes with an edge of 1/`rays_per_wavelength` wavelengths that cover the projection of `geometry` along `dir`;
    /// phases are referred to the target's origin.
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

    /// Number of cells.
    pub fn len(&self) -> u64 {
        self.count[0] as u64 * self.count[1] as u64
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The tube of a cell.
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
    /// Azimuth of its middle, rad.
    pub azimuth: f64,
    /// Sine of the elevation of its middle.
    pub sin_elevation: f64,
    /// Width in azimuth, rad.
    pub d_azimuth: f64,
    /// Width in the sine of elevation.
    pub d_sin: f64,
}

impl Cell {
    /// Axis of the cell's tube, and its edges for each metre of path, in the axes of the fan.
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
    /// Where the rays start, m.
    pub origin_m: DVec3,
    /// Rotation from the axes in which azimuth and elevation of the cells are meant to those of the world.
    pub rotation: DQuat,
    /// Cells of the fan.
    pub cells: Vec<Cell>,
}

impl Fan {
    /// The tube of the cell of this index.
    #[inline]
    pub fn tube(&self, index: usize) -> Tube {
        self.tube_of(&self.cells[index])
    }

    /// The tube of a cell.
    #[inline]
    pub fn tube_of(&self, cell: &Cell) -> Tube {
        let (dir, edge) = cell.axis_and_edges();
        Tube { origin_m: self.origin_m, dir: self.rotation * dir, edge: edge.map(|e| self.rotation * e) }
    }

    /// A regular grid over the target's bounding sphere, with `rays_per_wavelength` at the distance of its centre.
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
