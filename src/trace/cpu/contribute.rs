//! From a chain of facets to physical-optics echoes (CONVENTIONS eq. 4-7).
//!
//! Grids of rays are what exact beams are checked against, so the fields here have formulas of their own and
//! share none with `field`.

use super::rays::Chain;
use crate::base::matrix::Matrix2;
use crate::base::units::wavenumber;
use crate::geom::Geometry;
use crate::trace::launch::Tube;
use glam::DVec3;
use num_complex::Complex64;

/// A complex vector in space.
#[derive(Debug, Clone, Copy)]
struct CVec {
    re: DVec3,
    im: DVec3,
}

impl CVec {
    fn real(v: DVec3) -> Self {
        CVec { re: v, im: DVec3::ZERO }
    }
    #[inline]
    fn dot(&self, v: DVec3) -> Complex64 {
        Complex64::new(self.re.dot(v), self.im.dot(v))
    }
    /// `v` times a complex number.
    #[inline]
    fn along(v: DVec3, z: Complex64) -> Self {
        CVec { re: v * z.re, im: v * z.im }
    }
    #[inline]
    fn plus(self, o: CVec) -> Self {
        CVec { re: self.re + o.re, im: self.im + o.im }
    }
    /// `v` x self.
    #[inline]
    fn crossed_from(self, v: DVec3) -> Self {
        CVec { re: v.cross(self.re), im: v.cross(self.im) }
    }
}

/// Where the echo is received.
#[derive(Debug, Clone, Copy)]
pub enum Receiver {
    /// Unit vector from the target towards a receiver at infinity.
    Far(DVec3),
    /// A receiver at this place, m.
    At(DVec3),
}

/// Whether the incident wave spreads from a point or is plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spreading {
    /// A plane wave.
    Plane,
    /// A wave from a point.
    Spherical,
}

/// What one bounce radiates to the receiver.
#[derive(Debug, Clone, Copy)]
pub struct Contribution {
    /// Whether its chain ends here.
    pub is_last: bool,
    /// Where it radiates from, m.
    pub point: DVec3,
    /// Unit vector from the point to the receiver.
    pub to_receiver: DVec3,
    /// Unfolded length from the tube's origin to the point.
    pub length_in_m: f64,
    /// Point to receiver; 0 for one at infinity.
    pub length_out_m: f64,
    /// `S[rx][tx]` in m without the path's phase and without the two sincs of eq. 6, over R_t (spherical
    /// waves) and R_r (receivers at finite distance).
    pub s: Matrix2,
    /// Arguments of those sincs: half the phase across the footprint along each edge of the tube.
    pub x: [f64; 2],
}

impl Contribution {
    /// S with the sincs.
    pub fn integrated(&self) -> Matrix2 {
        let pattern = sinc(self.x[0]) * sinc(self.x[1]);
        self.s.map(|row| row.map(|z| z * pattern))
    }
}

/// Calls `emit` for each bounce of `chain` that radiates to the receiver. `launch_basis` is the (V, H)
/// pair of the incident wave; `receive_basis` gives that of the receiver from the unit vector towards it.
#[allow(clippy::too_many_arguments)] // the physics has these inputs; a struct would only rename them
#[inline]
pub fn radiate(
    geometry: &Geometry,
    tube: &Tube,
    chain: &Chain,
    spreading: Spreading,
    receiver: Receiver,
    monostatic: bool,
    launch_basis: (DVec3, DVec3),
    receive_basis: impl Fn(DVec3) -> (DVec3, DVec3),
    mut emit: impl FnMut(Contribution),
) {
    let k = wavenumber(geometry.freq_hz);
    let mut dir = tube.dir;
    let mut edge = tube.edge;
    let mut field = [CVec::real(launch_basis.0), CVec::real(launch_basis.1)];
    let mut from = tube.origin_m;
    let mut length = 0.0;
    for b in 0..chain.len {
        let tri = &geometry.triangles[chain.triangle[b] as usize];
        let p = chain.point[b];
        length += (p - from).length();
        from = p;
        // Sheets are two-sided: the normal stands on the lit side.
        let n = if dir.dot(tri.normal) < 0.0 { tri.normal } else { -tri.normal };
        let cos_i = -dir.dot(n);
        let surface = &geometry.surfaces[tri.surface as usize];
        let (r_perp, r_par) = surface.reflection(k, cos_i);
        let out_dir = dir + n * (2.0 * cos_i);
        let across = dir.cross(n);
        let sin_i = across.length();
        let e_perp = if sin_i > 1e-9 { across / sin_i } else { n.any_orthonormal_vector() };
        let (e_in, e_out) = (dir.cross(e_perp), out_dir.cross(e_perp));
        let reflected = field.map(|e| {
            CVec::along(e_perp, r_perp * e.dot(e_perp)).plus(CVec::along(e_out, r_par * e.dot(e_in)))
        });

        let (to_receiver, length_out) = match receiver {
            Receiver::Far(s) => (s, 0.0),
            Receiver::At(o) => {
                let d = o - p;
                (d / d.length(), d.length())
            }
        };
        // The axis itself shows that the radar sees the first facet.
        let seen = n.dot(to_receiver) > 0.0
            && ((b == 0 && monostatic)
                || !geometry.bvh.any_hit(
                    &geometry.triangles,
                    p,
                    to_receiver,
                    tri.patch,
                    if length_out > 0.0 { length_out } else { f64::INFINITY },
                ));
        if seen {
            let grow = match spreading {
                Spreading::Plane => 1.0,
                Spreading::Spherical => length,
            };
            let foot = edge.map(|e| (e + dir * (n.dot(e) / cos_i)) * grow);
            let w = (dir - to_receiver) * k;
            let area = foot[0].cross(foot[1]).length();
            let along = foot.map(|f| w.dot(f));
            let mut amplitude = area * k / (4.0 * std::f64::consts::PI);
            if spreading == Spreading::Spherical {
                amplitude /= length;
            }
            if length_out > 0.0 {
                amplitude /= length_out;
            }
            let (v, h) = receive_basis(to_receiver);
            let minus_j = Complex64::new(0.0, -amplitude);
            let mut s = [[Complex64::ZERO; 2]; 2];
            for tx in 0..2 {
                let (e, r) = (field[tx], reflected[tx]);
                let h_total = e.crossed_from(dir).plus(r.crossed_from(out_dir));
                let j = h_total.crossed_from(n);
                let m = e.plus(r).crossed_from(-n);
                // eta J + M x s, of which only the part across s is seen by v and h.
                let f = j.plus(m.crossed_from(-to_receiver));
                s[0][tx] = minus_j * f.dot(v);
                s[1][tx] = minus_j * f.dot(h);
            }
            emit(Contribution {
                is_last: b + 1 == chain.len && chain.left,
                point: p,
                to_receiver,
                length_in_m: length,
                length_out_m: length_out,
                s,
                x: along.map(|a| 0.5 * a),
            });
        }
        field = reflected;
        edge = edge.map(|e| e + n * (-2.0 * n.dot(e)));
        dir = out_dir;
    }
}

/// sin x / x, 1 at zero.
#[inline]
pub fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}
