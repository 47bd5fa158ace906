//! Curvature of a wave's front, as reflections at curved surfaces change it and the way along a ray tube does (Deschamps 1972).

use glam::DMat3;
use glam::DVec3;
use num_complex::Complex64;

/// The wave's front about one ray: its curvature as a symmetric tensor across the ray, 1/m, positive where it spreads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front {
    curvature: DMat3,
    /// How many times wider the ray tube has become, and the lines of focus that it has passed.
    wider: f64,
    foci: u32,
    /// Where a ray beside this one is now, against where the mirrored frame of planes would have it: offsets across the ray.
    offset: DMat3,
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Front {
    /// A plane wave.
    pub fn plane() -> Front {
        Front { curvature: DMat3::ZERO, wider: 1.0, foci: 0, offset: DMat3::IDENTITY }
    }

    /// A wave along a unit vector from a point that is `range_m` away.
    pub fn from_point(along: DVec3, range_m: f64) -> Front {
        let curvature = (DMat3::IDENTITY - outer(along, along)) * (1.0 / range_m);
        Front { curvature, ..Front::plane() }
    }

    /// The wave that leaves a surface along `leaves`; `normal` is that on the lit side, and `shape` the second fundamental form there,
    /// positive where the lit side is convex. Nothing where the surface is flat.
    pub fn reflect(&mut self, normal: DVec3, leaves: DVec3, shape: Option<DMat3>) {
        let turn = DMat3::IDENTITY - outer(normal, normal) * 2.0;
        self.curvature = turn * self.curvature * turn;
        self.offset = turn * self.offset * turn;
        let cos_i = leaves.dot(normal);
        if let Some(shape) = shape {
            // From across the ray to along the surface.
            let onto = DMat3::IDENTITY - outer(leaves, normal) * (1.0 / cos_i);
            self.curvature += onto.transpose() * shape * onto * (2.0 * cos_i);
        }
    }

    /// Goes on along the ray. A tube is taken for no narrower, along either axis, than the share `narrowest` of what it was.
    pub fn advance(&mut self, way_m: f64, narrowest: f64) {
        let grown = DMat3::IDENTITY + self.curvature * way_m;
        let area = grown.determinant();
        // Eigenvalues are one along the ray and two across it.
        let sum = grown.x_axis.x + grown.y_axis.y + grown.z_axis.z - 1.0;
        let root = (0.25 * sum * sum - area).max(0.0).sqrt();
        let across = [0.5 * sum - root, 0.5 * sum + root];
        self.foci += across.iter().filter(|a| **a < 0.0).count() as u32;
        self.wider *= across.iter().map(|a| a.abs().max(narrowest)).product::<f64>();
        self.offset = grown * self.offset;
        if area != 0.0 {
            self.curvature *= grown.inverse();
        }
    }

    /// How many times wider the tube has become.
    pub fn wider(&self) -> f64 {
        self.wider
    }

    /// Offset across the ray of a neighbour whose offset was this before the first reflection, as planes in the surfaces' place mirror it.
    pub fn offset(&self, before: DVec3) -> DVec3 {
        self.offset * before
    }

    /// j for each line of focus: the turn of the phase there.
    pub fn turn(&self) -> Complex64 {
        Complex64::i().powu(self.foci)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Behind a sphere the front of a plane wave has the radii of geometric optics, a cos/2 and a/(2 cos).
    #[test]
    fn a_sphere_spreads_a_plane_wave() {
        let (a, angle) = (0.3, 0.7f64);
        let normal = DVec3::Z;
        let leaves = DVec3::new(angle.sin(), 0.0, angle.cos());
        let shape = (DMat3::IDENTITY - outer(normal, normal)) * (1.0 / a);
        let mut front = Front::plane();
        front.reflect(normal, leaves, Some(shape));
        front.advance(2.0, 0.0);
        let of = |rho: f64| (rho + 2.0) / rho;
        let want = of(0.5 * a * angle.cos()) * of(0.5 * a / angle.cos());
        assert!((front.wider() / want - 1.0).abs() < 1e-12, "{} {want}", front.wider());
        assert_eq!(front.turn(), Complex64::ONE);
        // Inside it the tube passes two lines of focus.
        let mut front = Front::plane();
        front.reflect(normal, leaves, Some(shape * -1.0));
        front.advance(2.0, 0.0);
        let want = (1.0 - 2.0 / (0.5 * a * angle.cos())) * (1.0 - 2.0 / (0.5 * a / angle.cos()));
        assert!((front.wider() / want - 1.0).abs() < 1e-12);
        assert_eq!(front.turn(), -Complex64::ONE);
    }

    /// From a point nothing changes at a plane.
    #[test]
    fn a_plane_changes_no_front() {
        let along = DVec3::new(0.6, 0.0, -0.8);
        let mut front = Front::from_point(along, 3.0);
        front.reflect(DVec3::Z, DVec3::new(0.6, 0.0, 0.8), None);
        front.advance(2.0, 0.0);
        assert!((front.wider() - (5.0f64 / 3.0).powi(2)).abs() < 1e-12);
    }
}
