//! Fields along a chain of facets (CONVENTIONS eq. 4, 5).

use crate::base::frames::{Pose, Sensor, World, polarisation_basis};
use crate::base::matrix::Matrix2;
use crate::geom::Surface;
use glam::DVec3;
use num_complex::Complex64;

/// A complex vector in space.
#[derive(Debug, Clone, Copy)]
pub struct CVec {
    /// Real part.
    pub re: DVec3,
    /// Imaginary part.
    pub im: DVec3,
}

impl CVec {
    /// A real vector.
    pub fn real(v: DVec3) -> Self {
        CVec { re: v, im: DVec3::ZERO }
    }
    /// Scalar product with a real vector.
    #[inline]
    pub fn dot(&self, v: DVec3) -> Complex64 {
        Complex64::new(self.re.dot(v), self.im.dot(v))
    }
    /// Product of the two vectors without a conjugate.
    #[inline]
    pub fn times(&self, o: &CVec) -> Complex64 {
        Complex64::new(self.re.dot(o.re) - self.im.dot(o.im), self.re.dot(o.im) + self.im.dot(o.re))
    }
    /// The vector times a complex number.
    #[inline]
    pub fn scaled(&self, z: Complex64) -> CVec {
        CVec { re: self.re * z.re - self.im * z.im, im: self.re * z.im + self.im * z.re }
    }
    /// `v` times a complex number.
    #[inline]
    pub fn along(v: DVec3, z: Complex64) -> Self {
        CVec { re: v * z.re, im: v * z.im }
    }
    /// The sum of two.
    #[inline]
    pub fn plus(self, o: CVec) -> Self {
        CVec { re: self.re + o.re, im: self.im + o.im }
    }
    /// `v` x self.
    #[inline]
    pub fn crossed_from(self, v: DVec3) -> Self {
        CVec { re: v.cross(self.re), im: v.cross(self.im) }
    }
}

/// The fields V and H that a radar sends into `dir` (world), of amplitude one; by them it receives, too.
pub fn sent(pose: &Pose<Sensor, World>, dir: DVec3) -> [CVec; 2] {
    let (v, h) = polarisation_basis(pose.rotation.inverse() * dir);
    [v, h].map(|e| CVec::real(pose.rotation * e))
}

/// A wave that a facet reflects, for two transmit polarisations.
#[derive(Debug, Clone, Copy)]
pub struct Bounce {
    /// Unit normal on the lit side.
    pub normal: DVec3,
    /// Direction of the wave that arrives.
    pub dir_in: DVec3,
    /// Direction of the wave that leaves.
    pub dir_out: DVec3,
    /// Field that arrives, for both transmit polarisations.
    pub field: [CVec; 2],
    /// Field that leaves, for both transmit polarisations.
    pub reflected: [CVec; 2],
}

impl Bounce {
    /// The bounce of a wave on a facet with this normal and surface.
    #[inline]
    pub fn new(field: [CVec; 2], dir: DVec3, normal: DVec3, surface: &Surface, wavenumber: f64) -> Bounce {
        let cos_i = -dir.dot(normal);
        let (r_perp, r_par) = surface.reflection(wavenumber, cos_i);
        let dir_out = dir + normal * (2.0 * cos_i);
        let across = dir.cross(normal);
        let sin_i = across.length();
        let e_perp = if sin_i > 1e-9 { across / sin_i } else { normal.any_orthonormal_vector() };
        let (e_in, e_out) = (dir.cross(e_perp), dir_out.cross(e_perp));
        let of = |e: CVec| {
            CVec::along(e_perp, r_perp * e.dot(e_perp)).plus(CVec::along(e_out, r_par * e.dot(e_in)))
        };
        let reflected = [of(field[0]), of(field[1])];
        Bounce { normal, dir_in: dir, dir_out, field, reflected }
    }

    /// Matrix `[rx][tx]` of what the facet's physical-optics currents radiate towards the unit vector `s`, seen by the
    /// receive vectors `v` and `h`: eta J + M x s, of which only the part across `s` counts. Times -j k A / 4 pi it is
    /// the scattered amplitude of an area A.
    #[inline]
    pub fn radiated(&self, s: DVec3, v: DVec3, h: DVec3) -> Matrix2 {
        self.received(s, &[CVec::real(v), CVec::real(h)])
    }

    /// [`Bounce::radiated`] with receive vectors that are complex: by way of a mirror, reciprocity makes them the fields that V and
    /// H would bring here.
    #[inline]
    pub fn received(&self, s: DVec3, by: &[CVec; 2]) -> Matrix2 {
        let of = |tx: usize| {
            let (e, r) = (self.field[tx], self.reflected[tx]);
            let h_total = e.crossed_from(self.dir_in).plus(r.crossed_from(self.dir_out));
            let j = h_total.crossed_from(self.normal);
            let m = e.plus(r).crossed_from(-self.normal);
            let f = j.plus(m.crossed_from(-s));
            [f.times(&by[0]), f.times(&by[1])]
        };
        let (from_v, from_h) = (of(0), of(1));
        [[from_v[0], from_h[0]], [from_v[1], from_h[1]]]
    }
}
