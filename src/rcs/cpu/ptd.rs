//! Edge diffraction of first order: the fringe currents of all wedges, added to a physical-optics sum
//! (CONVENTIONS eq. 36-39).
//!
//! A host sum in f64 that serves both engines: a target has few edges. What it adds holds for edges of metal
//! that both the transmitter and the receiver see, and for fields that come to the edge straight from the
//! transmitter. Edges of dielectrics, edges lit by a bounce, corners (where two edges end) and what one edge
//! sends to another are left out. The last matters near grazing where E stands across the edges: a face of
//! extent d along a ray that grazes it at the angle α needs k d (1 − cos α) of 3 and more, else its far edge
//! lies in the penumbra of its near one.
//!
//! Measured on the plates and the box of the Austin suite (`crates/papers/tests/gates/austin.rs`, 5 to 10 GHz): beyond 40° from the
//! normal the lobes of a plate of 3 to 9 wavelengths are off by 1.1 to 2.1 dB rms in VV and 3.9 to 5.3 dB in
//! HH, against 13 to 27 and 9 to 12 dB of physical optics alone.
//!
//! Fringe currents radiate all round. Physical optics by (5) leaves out receivers behind a face, so towards
//! forward directions the two do not add up to the exact field.

use crate::base::frames::polarisation_basis;
use crate::base::matrix::Matrix2;
use crate::base::tasks::Tasks;
use crate::base::units::{wavelength_m, wavenumber};
use crate::em::wedge::Wedge;
use crate::geom::Geometry;
use crate::geom::edges::Edge;
use crate::rcs::closed_form::sinc;
use crate::rcs::{BistaticAspect, Distance, Scattering};
use crate::trace::beams::Port;
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::PI;

/// At finite range an edge is cut until the quadratic phase at a piece's ends is below this (radians),
const QUADRATIC_RAD: f64 = 0.1;
/// and half a piece is below this part of the range.
const HALF_OVER_RANGE: f64 = 0.005;
/// Visibility is tested this many times per wavelength of an edge,
const SAMPLES_PER_WAVELENGTH: f64 = 4.0;
/// but at most this often; between two tests that differ the boundary is bisected.
const MOST_SAMPLES: f64 = 16.0;
const BISECTIONS: usize = 16;
/// Visibility is tested from this many times `t_min_m` outside the edge.
const LIFT: f64 = 2.0;

impl Port {
    /// Unit vector from `p` to the station, and its distance.
    fn seen_from(&self, p: DVec3) -> (DVec3, f64) {
        match *self {
            Port::Far(u) => (u, f64::INFINITY),
            Port::At(q) => {
                let r = (q - p).length();
                ((q - p) / r, r)
            }
        }
    }

    /// Phase of a path to `p` over k and spreading, relative to the origin.
    fn path(&self, p: DVec3) -> (f64, f64) {
        match *self {
            Port::Far(u) => (u.dot(p), 1.0),
            Port::At(q) => {
                let (r, r0) = ((q - p).length(), q.length());
                (r0 - r, r0 / r)
            }
        }
    }
}

/// Computes S of the geometry's edges for each frequency and aspect (`[frequency, aspect]`), the same in both
/// conventions, to be added to the physical-optics sum. `edges` are those of `geom::edges::find`.
pub fn of_edges(
    geometry: &Geometry,
    edges: &[Edge],
    frequencies_hz: &[f64],
    aspects: &[BistaticAspect],
    distance: Distance,
) -> Vec<Scattering> {
    let cases: Vec<(f64, &BistaticAspect)> =
        frequencies_hz.iter().flat_map(|f| aspects.iter().map(move |l| (*f, l))).collect();
    cases
        .par_iter()
        .map_tasks(|(f, aspect)| {
            let s =
                edge_sum(geometry, edges, *f, distance.port(aspect.transmit), distance.port(aspect.receive));
            Scattering { every: s, last: s }
        })
        .collect()
}

/// Computes `S[rx][tx]` in metres of all edges, referred to the origin (eq. 36 to 39). Ports at finite range must stand
/// off the edges.
pub fn edge_sum(geometry: &Geometry, edges: &[Edge], freq_hz: f64, transmit: Port, receive: Port) -> Matrix2 {
    let k = wavenumber(freq_hz);
    let mut s = [[Complex64::ZERO; 2]; 2];
    for edge in edges {
        let wedge = Wedge { tangent: edge.tangent(), into: edge.into, normal: edge.normal, n: edge.n };
        let samples = (SAMPLES_PER_WAVELENGTH * edge.length_m() / wavelength_m(freq_hz)).ceil();
        for (from, to) in visible(geometry, edge, &wedge, samples.clamp(1.0, MOST_SAMPLES), transmit, receive)
        {
            add_stretch(&mut s, k, &wedge, from, to, transmit, receive);
        }
    }
    s
}

/// Adds the stretch of an edge between two points, cut in halves until (38) holds for each piece.
fn add_stretch(
    s: &mut Matrix2,
    k: f64,
    wedge: &Wedge,
    from: DVec3,
    to: DVec3,
    transmit: Port,
    receive: Port,
) {
    let centre = 0.5 * (from + to);
    let length = (to - from).length();
    let half = 0.5 * length;
    let ends = [transmit, receive].map(|st| st.seen_from(centre));
    let curvature: f64 = ends.iter().map(|(d, r)| (1.0 - d.dot(wedge.tangent).powi(2)) / r).sum();
    let nearest = ends[0].1.min(ends[1].1);
    // The first test also ends the recursion for a station on the edge itself.
    if half > 1e-9 * nearest.min(1.0)
        && (0.5 * k * half * half * curvature > QUADRATIC_RAD || half > HALF_OVER_RANGE * nearest)
    {
        add_stretch(s, k, wedge, from, centre, transmit, receive);
        add_stretch(s, k, wedge, centre, to, transmit, receive);
        return;
    }
    let (d_t, d_r) = (ends[0].0, ends[1].0);
    let dyad = wedge.fringe(-d_t, d_r);
    let (path_t, path_r) = (transmit.path(centre), receive.path(centre));
    // Linear phase in closed form; the quadratic one by its mean and, to first order, its rest, without which
    // the ends of an edge would carry a wrong phase.
    let x = half * k * (d_t + d_r).dot(wedge.tangent);
    let quadratic = -0.5 * k * half * half * curvature;
    let phase = k * (path_t.0 + path_r.0) + quadratic / 3.0;
    let pattern = Complex64::new(sinc(x), quadratic * (second_moment(x) - sinc(x) / 3.0));
    let factor = pattern * Complex64::from_polar(length * path_t.1 * path_r.1 / (4.0 * PI), phase);
    let (tx, rx) = (polarisation_basis(d_t), polarisation_basis(d_r));
    for (j, p) in [tx.0, tx.1].into_iter().enumerate() {
        let field = dyad * p;
        s[0][j] += factor * rx.0.dot(field);
        s[1][j] += factor * rx.1.dot(field);
    }
}

/// Mean of t² e^{jxt} over −1 … 1.
fn second_moment(x: f64) -> f64 {
    if x.abs() < 0.3 {
        let x2 = x * x;
        return 1.0 / 3.0 - x2 * (1.0 / 10.0 - x2 * (1.0 / 168.0 - x2 / 6480.0));
    }
    let (s, c) = x.sin_cos();
    (s + 2.0 * (c - s / x) / x) / x
}

/// The stretches of an edge that see both stations, as pairs of end points.
fn visible(
    geometry: &Geometry,
    edge: &Edge,
    wedge: &Wedge,
    samples: f64,
    transmit: Port,
    receive: Port,
) -> Vec<(DVec3, DVec3)> {
    let [a, b] = edge.ends_m;
    // A little outside the metal, so that a station in the plane of a face sees the far edge over the near one.
    let out = edge.normal[0] + edge.normal[1] - edge.into[0] - edge.into[1];
    let lift = out.normalize_or_zero() * (LIFT * geometry.t_min_m);
    let sees = |s: f64, station: &Port| {
        let p = a.lerp(b, s);
        let (d, r) = station.seen_from(p);
        wedge.is_outside(d) && !geometry.bvh.any_hit(&geometry.triangles, p + lift, d, edge.patch[0], r)
    };
    let is_seen = |s: f64| sees(s, &transmit) && (receive == transmit || sees(s, &receive));
    let n = samples as usize;
    let at = |i: usize| (i as f64 + 0.5) / samples;
    let mut stretches = Vec::new();
    let (mut seen, mut start) = (is_seen(at(0)), 0.0);
    for i in 1..n {
        let now = is_seen(at(i));
        if now == seen {
            continue;
        }
        let (mut lo, mut hi) = (at(i - 1), at(i));
        for _ in 0..BISECTIONS {
            let mid = 0.5 * (lo + hi);
            if is_seen(mid) == seen { lo = mid } else { hi = mid }
        }
        let boundary = 0.5 * (lo + hi);
        if seen {
            stretches.push((a.lerp(b, start), a.lerp(b, boundary)));
        }
        (seen, start) = (now, boundary);
    }
    if seen {
        stretches.push((a.lerp(b, start), b));
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::base::frames::direction_from_angles;
    use crate::geom::edges::{SMOOTH_RAD, find};
    use crate::scene::{Material, Mesh, Scene};

    const F: f64 = 77e9;

    fn geometry(faces: &[[DVec3; 3]]) -> Geometry {
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        let mesh = Mesh {
            positions_m: faces.iter().flatten().copied().collect(),
            triangles: (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material: vec![0; faces.len()],
            normals: Vec::new(),
        };
        scene.add_mesh("target", "", mesh, Pose::IDENTITY);
        Geometry::build(&scene, 0.0, F).unwrap()
    }

    fn p(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// Plate with normal +x at distance x, width along y, height along z.
    fn plate(x: f64, w: f64, h: f64) -> [[DVec3; 3]; 2] {
        let v = |y: f64, z: f64| p(x, 0.5 * y * w, 0.5 * z * h);
        [[v(-1., -1.), v(1., -1.), v(1., 1.)], [v(-1., -1.), v(1., 1.), v(-1., 1.)]]
    }

    fn worst(a: Matrix2, b: Matrix2) -> f64 {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
    }

    /// Far away the finite range becomes the plane wave, and near by the pieces become a fine sum.
    #[test]
    fn finite_range() {
        let g = geometry(&plate(0.0, 0.1, 0.06));
        let edges = find(&g, SMOOTH_RAD);
        let u = direction_from_angles(0.6, 0.3);
        let far = edge_sum(&g, &edges, F, Port::Far(u), Port::Far(u));
        let size = far[0][0].norm();
        let mut last = f64::INFINITY;
        for r in [1e3, 1e5] {
            let here = edge_sum(&g, &edges, F, Port::At(u * r), Port::At(u * r));
            let error = worst(here, far) / size;
            assert!(error < 0.02 * last, "{r}: {error}");
            last = error;
        }
        assert!(last < 1e-3, "{last}");
        // Bistatic, two ranges, against ten thousand points an edge.
        let (t, r) = (p(0.9, 0.2, 0.3), p(0.5, -0.4, 0.1));
        let (k, mut sum) = (wavenumber(F), [[Complex64::ZERO; 2]; 2]);
        for e in &edges {
            let wedge = Wedge { tangent: e.tangent(), into: e.into, normal: e.normal, n: e.n };
            let n = 10_000;
            for i in 0..n {
                let c = e.ends_m[0].lerp(e.ends_m[1], (f64::from(i) + 0.5) / f64::from(n));
                let (dt, dr) = ((t - c).normalize(), (r - c).normalize());
                let (lt, lr) = ((t - c).length(), (r - c).length());
                let d = wedge.fringe(-dt, dr);
                let a = e.length_m() / f64::from(n) * t.length() * r.length() / (lt * lr * 4.0 * PI);
                let z = Complex64::from_polar(a, -k * (lt + lr - t.length() - r.length()));
                let (tx, rx) = (polarisation_basis(dt), polarisation_basis(dr));
                for (row, q) in sum.iter_mut().zip([rx.0, rx.1]) {
                    for (s, v) in row.iter_mut().zip([tx.0, tx.1]) {
                        *s += z * q.dot(d * v);
                    }
                }
            }
        }
        let here = edge_sum(&g, &edges, F, Port::At(t), Port::At(r));
        let size = sum.iter().flatten().map(|z| z.norm()).fold(0.0, f64::max);
        let error = worst(here, sum) / size;
        println!("finite range: {error:.2e} of {size:.2e} m");
        assert!(error < 0.01, "{error} {here:?} {sum:?}");
        for x in [1e-3, 0.2999, 0.3001, 4.0f64] {
            let n = 20_000;
            let t = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let sum: f64 = (0..n).map(|i| t(i).powi(2) * (x * t(i)).cos()).sum();
            assert!((second_moment(x) - sum / f64::from(n)).abs() < 1e-8, "{x}");
        }
    }

    /// A plate before another hides part of its edges: as if the edges ended there.
    #[test]
    fn hidden_parts_are_left_out() {
        let (w, h) = (0.1, 0.06);
        let mut faces = plate(0.0, w, h).to_vec();
        let screen = plate(0.5, 0.2, 0.2).map(|t| t.map(|v| v + p(0.0, 0.1 + 0.0123, 0.0)));
        faces.extend(screen);
        let g = geometry(&faces);
        let back: Vec<Edge> =
            find(&g, SMOOTH_RAD).into_iter().filter(|e| e.ends_m[0].x.abs() < 1e-9).collect();
        assert_eq!(back.len(), 4);
        let radar = Port::Far(DVec3::X);
        let here = edge_sum(&g, &back, F, radar, radar);
        // The screen covers y > 0.0123 for a radar on the axis.
        let cut: Vec<Edge> = back
            .iter()
            .filter_map(|e| {
                let mut e = *e;
                for v in &mut e.ends_m {
                    v.y = v.y.min(0.0123);
                }
                (e.length_m() > 0.0 && (e.ends_m[0].y - 0.0123).abs() + (e.ends_m[1].y - 0.0123).abs() > 1e-9)
                    .then_some(e)
            })
            .collect();
        assert_eq!(cut.len(), 3);
        let alone = geometry(&plate(0.0, w, h));
        let expected = edge_sum(&alone, &cut, F, radar, radar);
        let error = worst(here, expected) / expected[0][0].norm();
        assert!(error < 1e-4, "{error}");
        let whole = edge_sum(&alone, &back, F, radar, radar);
        assert!(worst(here, whole) / expected[0][0].norm() > 0.1);
    }

    /// The fringe wave of a plate's edges does not change when plate and radar turn together.
    #[test]
    fn turns_with_the_target() {
        let g = geometry(&plate(0.02, 0.1, 0.06));
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.9, -0.3);
        let turned = geometry(&plate(0.02, 0.1, 0.06).map(|t| t.map(|v| turn * v)));
        let (e, f) = (find(&g, SMOOTH_RAD), find(&turned, SMOOTH_RAD));
        let u = direction_from_angles(0.8, 0.25);
        let s = edge_sum(&g, &e, F, Port::Far(u), Port::Far(u));
        let t = edge_sum(&turned, &f, F, Port::Far(turn * u), Port::Far(turn * u));
        // Take both to the same pair of vectors.
        let (v, h) = polarisation_basis(turn * u);
        let (tv, th) = polarisation_basis(u);
        let m = [[(turn * tv).dot(v), (turn * th).dot(v)], [(turn * tv).dot(h), (turn * th).dot(h)]];
        let mut back = [[Complex64::ZERO; 2]; 2];
        for (i, row) in back.iter_mut().enumerate() {
            for (j, z) in row.iter_mut().enumerate() {
                for a in 0..2 {
                    for b in 0..2 {
                        *z += m[a][i] * t[a][b] * m[b][j];
                    }
                }
            }
        }
        assert!(worst(back, s) < 1e-9 * s[0][0].norm(), "{back:?} {s:?}");
    }

    /// A plate face on, by hand: at φ′ = φ = π/2 the current of a half-plane's two sides is −1 along E on edges
    /// along E and +1 on edges across it (Michaeli's closed form; l'Hôpital in μ), so that
    /// S_vv = −S_hh = 2 (w − h)/4π, real where the plate holds the origin.
    #[test]
    fn face_on_by_hand() {
        let (w, h) = (0.1, 0.06);
        let g = geometry(&plate(0.0, w, h));
        let edges = find(&g, SMOOTH_RAD);
        let s = edge_sum(&g, &edges, F, Port::Far(DVec3::X), Port::Far(DVec3::X));
        let by_hand = 2.0 * (w - h) / (4.0 * PI);
        assert!((s[0][0] - by_hand).norm() < 1e-9 && (s[1][1] + by_hand).norm() < 1e-9, "{s:?} {by_hand}");
        assert!(s[0][1].norm() < 1e-12 && s[1][0].norm() < 1e-12);
    }
}
