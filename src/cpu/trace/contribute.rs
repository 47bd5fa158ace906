//! From a chain of facets to physical-optics echoes (CONVENTIONS eq. 4-7).

use super::rays::{Chain, follow};
use crate::frames::{Pose, Sensor, World, polarisation_basis};
use crate::geom::Geometry;
use crate::trace::ends::{Ends, STEEP, end_axis};
use crate::trace::launch::{Cell, Fan, Tube};
use crate::trace::points::point_returns;
use crate::trace::{Convention, MAX_BOUNCES, Return, Returns, TraceOptions, drop_weak};
use crate::units::wavenumber;
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;

/// A complex vector in space.
#[derive(Debug, Clone, Copy)]
pub struct CVec {
    pub re: DVec3,
    pub im: DVec3,
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
    fn add(self, o: CVec) -> Self {
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
    At(DVec3),
}

/// Whether the incident wave spreads from a point or is plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spreading {
    Plane,
    Spherical,
}

/// What one bounce radiates to the receiver.
#[derive(Debug, Clone, Copy)]
pub struct Contribution {
    pub bounce: usize,
    pub is_last: bool,
    pub point: DVec3,
    /// Unit vector from the point to the receiver.
    pub to_receiver: DVec3,
    /// Unfolded length from the tube's origin to the point.
    pub length_in_m: f64,
    /// Point to receiver; 0 for one at infinity.
    pub length_out_m: f64,
    /// S[rx][tx] in m without the path's phase and without the two sincs of eq. 6, over R_t (spherical
    /// waves) and R_r (receivers at finite distance).
    pub s: [[Complex64; 2]; 2],
    /// Arguments of those sincs: half the phase across the footprint along each edge of the tube.
    pub x: [f64; 2],
    /// Phase per metre along each edge of the footprint, rad/m.
    pub gradient: [f64; 2],
    pub normal: DVec3,
}

impl Contribution {
    /// S with the sincs.
    pub fn integrated(&self) -> [[Complex64; 2]; 2] {
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
            CVec::along(e_perp, r_perp * e.dot(e_perp)).add(CVec::along(e_out, r_par * e.dot(e_in)))
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
            let mut s = [[Complex64::ZERO; 2]; 2];
            for tx in 0..2 {
                let (e, r) = (field[tx], reflected[tx]);
                let h_total = e.crossed_from(dir).add(r.crossed_from(out_dir));
                let j = h_total.crossed_from(n);
                let e_total = e.add(r);
                let m = e_total.crossed_from(-n);
                // eta J + M x s, of which only the part across s is seen by v and h.
                let f = j.add(m.crossed_from(-to_receiver));
                let minus_j = Complex64::new(0.0, -amplitude);
                s[0][tx] = minus_j * f.dot(v);
                s[1][tx] = minus_j * f.dot(h);
            }
            emit(Contribution {
                bounce: b,
                is_last: b + 1 == chain.len && chain.left,
                point: p,
                to_receiver,
                length_in_m: length,
                length_out_m: length_out,
                s,
                x: along.map(|a| 0.5 * a),
                gradient: [0, 1].map(|i| along[i].abs() / foot[i].length()),
                normal: n,
            });
        }
        field = reflected;
        edge = edge.map(|e| e + n * (-2.0 * n.dot(e)));
        dir = out_dir;
    }
}

#[inline]
pub fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

/// All echoes of a frame at the radar `pose` moving with `velocity_mps` (world): the tubes of `fan` and
/// the point targets. The same returns in the same order whatever the number of threads.
///
/// Along one edge of its footprint the integral of a tube is the difference of two end terms (eq. 6a), and
/// where the next tube goes on over the same facets its end term is the same: both are left out. What
/// stays are the outlines of what is lit, and the places of stationary phase.
pub fn returns(
    geometry: &Geometry,
    fan: &Fan,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Returns {
    const BLOCK: usize = 1024;
    let to_sensor = pose.rotation.inverse();
    let k = wavenumber(geometry.freq_hz);
    let see_exit = options.convention == Convention::Last;
    let blocks: Vec<Vec<Return>> = (0..fan.cells.len().div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let mut out = Vec::new();
            for i in block * BLOCK..((block + 1) * BLOCK).min(fan.cells.len()) {
                let tube = fan.tube(i);
                let chain = follow(geometry, &tube, options.bounces, see_exit);
                let mut borders = Borders { geometry, fan, cell: &fan.cells[i], see_exit, found: [None; 4] };
                let basis = |d_world: DVec3| {
                    let (v, h) = polarisation_basis(to_sensor * d_world);
                    (pose.rotation * v, pose.rotation * h)
                };
                radiate(
                    geometry,
                    &tube,
                    &chain,
                    Spreading::Spherical,
                    Receiver::At(fan.origin_m),
                    true,
                    basis(tube.dir),
                    |to_receiver| basis(-to_receiver),
                    |c| {
                        if see_exit && !c.is_last {
                            return;
                        }
                        let axis = end_axis(c.normal);
                        let steep = c.gradient[axis] > STEEP * k;
                        let goes_on = |side| steep && borders.go_on(&chain, c.bounce, axis, side);
                        let Some(ends) = Ends::of([0, 1].map(goes_on)) else {
                            return;
                        };
                        let mut r = echo(geometry, &tube, &chain, &c, velocity_mps, to_sensor);
                        let across = sinc(c.x[1 - axis]);
                        r.spread = r.spread.map(|row| row.map(|z| z * across));
                        ends.emit(r, c.x[axis], k, &mut out);
                    },
                );
            }
            out
        })
        .collect();
    let mut all: Vec<Return> = blocks.into_iter().flatten().collect();
    all.extend(point_returns(geometry, fan.origin_m, velocity_mps, to_sensor));
    drop_weak(&mut all, options.amplitude_floor);
    Returns { returns: all, rays: fan.cells.len() as u64 }
}

/// Rays along the borders of a tube, followed when asked for.
struct Borders<'a> {
    geometry: &'a Geometry,
    fan: &'a Fan,
    cell: &'a Cell,
    see_exit: bool,
    /// Two sides of each axis.
    found: [Option<Chain>; 4],
}

impl Borders<'_> {
    /// Whether the ray in the middle of a border meets the same patches as the axis up to `bounce`, and
    /// its last point sees the radar too.
    fn go_on(&mut self, axis_chain: &Chain, bounce: usize, axis: usize, side: usize) -> bool {
        let geometry = self.geometry;
        let chain = self.found[2 * axis + side].get_or_insert_with(|| {
            let tube = self.fan.tube_of(&self.cell.border(axis, side));
            follow(geometry, &tube, axis_chain.len, self.see_exit)
        });
        let patch = |c: &Chain, b: usize| geometry.triangles[c.triangle[b] as usize].patch;
        if chain.len <= bounce || (0..=bounce).any(|b| patch(chain, b) != patch(axis_chain, b)) {
            return false;
        }
        // With "last", both have to leave after the same facet.
        if self.see_exit && (chain.len != axis_chain.len || chain.left != axis_chain.left) {
            return false;
        }
        let back = self.fan.origin_m - chain.point[bounce];
        let distance = back.length();
        bounce == 0
            || !geometry.bvh.any_hit(
                &geometry.triangles,
                chain.point[bounce],
                back / distance,
                patch(chain, bounce),
                distance,
            )
    }
}

fn echo(
    geometry: &Geometry,
    tube: &Tube,
    chain: &Chain,
    c: &Contribution,
    radar_velocity: DVec3,
    to_sensor: glam::DQuat,
) -> Return {
    let mut ids = [0; MAX_BOUNCES];
    let mut dir = tube.dir;
    let mut rate = -radar_velocity.dot(dir);
    let mut from = chain.point[0];
    for (b, id) in ids.iter_mut().enumerate().take(c.bounce + 1) {
        let tri = &geometry.triangles[chain.triangle[b] as usize];
        let body = &geometry.bodies[tri.body as usize];
        *id = body.id;
        let next =
            if b == c.bounce { c.to_receiver } else { (chain.point[b + 1] - chain.point[b]).normalize() };
        rate += body.velocity_mps.dot(dir - next);
        dir = next;
        from = chain.point[b];
    }
    debug_assert_eq!(from, c.point);
    rate += radar_velocity.dot(c.to_receiver);
    Return {
        path_length_m: c.length_in_m + c.length_out_m,
        path_rate_mps: rate,
        departure: to_sensor * tube.dir,
        first_range_m: (chain.point[0] - tube.origin_m).length(),
        arrival: to_sensor * -c.to_receiver,
        last_range_m: c.length_out_m,
        spread: c.s,
        chain: ids,
        bounces: c.bounce as u8 + 1,
    }
}
