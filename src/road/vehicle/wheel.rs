//! Wheels: tyre, rim and brake disc, turning about the y axis, with their outer side towards +y.

use super::part::Paint;
use super::surface::{bar, turned};
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, polygon};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::TAU;

/// A wheel's dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheel {
    /// Radius, m.
    pub radius_m: f64,
    /// Width, m.
    pub width_m: f64,
    /// Radius of the rim, where the tyre sits on it, m.
    pub rim_m: f64,
    /// Number of spokes.
    pub spokes: usize,
    /// Facets around.
    pub segments: usize,
    /// Paint of the rim.
    pub rim: Paint,
}

impl Wheel {
    /// The wheel of a car or motorcycle, lengths in m.
    pub const fn alloy(radius_m: f64, width_m: f64, rim_m: f64) -> Wheel {
        Wheel { radius_m, width_m, rim_m, spokes: 5, segments: 32, rim: Paint::Aluminium }
    }

    /// The wheel of a lorry, lengths in m.
    pub const fn steel(radius_m: f64, width_m: f64, rim_m: f64) -> Wheel {
        Wheel { radius_m, width_m, rim_m, spokes: 8, segments: 36, rim: Paint::Steel }
    }

    /// Closed bodies: tyre, rim with the brake disc at its bottom, hub, and spokes in the rim's mouth.
    pub fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        let (r, w, rim) = (self.radius_m, 0.5 * self.width_m, self.rim_m);
        let wall = r - rim;
        // Section of the tyre, outside to the right when seen with y to the right and the radius up: tread
        // with rounded shoulders, side walls, and the seat on the rim.
        let section = [
            (rim, -0.80 * w),
            (rim, 0.80 * w),
            (rim + 0.35 * wall, 0.97 * w),
            (rim + 0.75 * wall, 0.98 * w),
            (r - 0.05 * wall, 0.80 * w),
            (r, 0.45 * w),
            (r, -0.45 * w),
            (r - 0.05 * wall, -0.80 * w),
            (rim + 0.75 * wall, -0.98 * w),
            (rim + 0.35 * wall, -0.97 * w),
            (rim, -0.80 * w),
        ];
        let points: Vec<DVec2> = section.iter().rev().map(|&(r, y)| DVec2::new(r, y)).collect();
        turned(&mut mesh, &points, self.segments, Paint::Tyre as u32);
        // The rim, a bowl of metal from its lip down to the brake disc, just within the tyre's seat.
        let lip = rim - 0.002;
        let section = [
            (0.0, -0.33 * w),
            (0.82 * rim, -0.33 * w),
            (0.90 * rim, -0.11 * w),
            (0.94 * rim, 0.60 * w),
            (lip, 0.76 * w),
            (lip, 0.78 * w),
            (0.92 * rim, 0.60 * w),
            (0.88 * rim, -0.10 * w),
            (0.80 * rim, -0.30 * w),
            (0.0, -0.30 * w),
        ];
        let points: Vec<DVec2> = section.iter().map(|&(r, y)| DVec2::new(r, y)).collect();
        let first = mesh.triangles.len();
        turned(&mut mesh, &points, self.segments, self.rim as u32);
        for t in first..mesh.triangles.len() {
            let flat = mesh.triangles[t].iter().all(|&i| mesh.positions_m[i as usize].y == -0.30 * w);
            if flat {
                mesh.material[t] = Paint::Steel as u32;
            }
        }
        for k in 0..self.spokes {
            let turn = DQuat::from_rotation_y(TAU * k as f64 / self.spokes as f64);
            append(&mut mesh, &self.spoke(), &Pose::<Target, Target>::new(turn, DVec3::ZERO));
        }
        let hub = 0.22 * rim;
        bar(&mut mesh, DVec3::Y * -0.05 * w, DVec3::Y * 0.66 * w, hub, 16, self.rim as u32);
        mesh
    }

    /// A closed bar along z from the hub to the lip, wider at the hub.
    fn spoke(&self) -> Mesh {
        let (rim, w) = (self.rim_m, 0.5 * self.width_m);
        let (a, b) = (0.18 * rim, 0.915 * rim);
        let (wa, wb) = (0.14 * rim, 0.09 * rim);
        let ring = |z: f64, half: f64, lo: f64, hi: f64| {
            [(-half, lo), (half, lo), (half, hi), (-half, hi)].map(|(x, y)| DVec3::new(x, y, z))
        };
        let (p, q) = (ring(a, wa, 0.30 * w, 0.62 * w), ring(b, wb, 0.35 * w, 0.58 * w));
        let mut mesh = Mesh::default();
        for i in 0..4 {
            let j = (i + 1) % 4;
            polygon(&mut mesh, &[p[i], p[j], q[j]], self.rim as u32);
            polygon(&mut mesh, &[p[i], q[j], q[i]], self.rim as u32);
        }
        polygon(&mut mesh, &q, self.rim as u32);
        polygon(&mut mesh, &[p[3], p[2], p[1], p[0]], self.rim as u32);
        mesh
    }
}
