//! Smooth surfaces as grids of facets with the surface's normals, and the simple solids that vehicles and
//! people are put together from. Metres; fronts look outwards.

use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, curved_polygon, polygon};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A parametric surface.
pub type Surface<'a> = &'a dyn Fn(f64, f64) -> DVec3;

/// Step of the difference that gives normals, in parameters of order 1.
const STEP: f64 = 1e-6;

/// Unit normal, along df/du x df/dv; differences stay within `u` and `v`.
pub fn normal(f: Surface, (u, v): (f64, f64), us: (f64, f64), vs: (f64, f64)) -> DVec3 {
    let (u0, u1) = ((u - STEP).max(us.0), (u + STEP).min(us.1));
    let (v0, v1) = ((v - STEP).max(vs.0), (v + STEP).min(vs.1));
    (f(u1, v) - f(u0, v)).cross(f(u, v1) - f(u, v0)).normalize_or_zero()
}

/// Facets of f over the grid `us` x `vs`, with their fronts along df/du x df/dv, and with the surface's normals.
/// `material` says of a cell (its lower indices) what it is made of, or that it is left out. A row or column
/// that is a single point becomes a tip. With `closed` the last column is the first one.
pub fn grid(
    mesh: &mut Mesh,
    (us, vs): (&[f64], &[f64]),
    f: Surface,
    closed: bool,
    material: &dyn Fn(usize, usize) -> Option<u32>,
) {
    let (nu, nv) = (us.len(), vs.len());
    let column = |i: usize| if closed && i == nu - 1 { 0 } else { i };
    let (ru, rv) = ((us[0], us[nu - 1]), (vs[0], vs[nv - 1]));
    let places: Vec<Vec<DVec3>> =
        (0..nu).map(|i| vs.iter().map(|&v| f(us[column(i)], v) + DVec3::ZERO).collect()).collect();
    // On a seam in the plane y = 0 the surface goes on as its mirror image.
    let on_seam = |p: DVec3, n: DVec3| {
        if p.y == 0.0 { DVec3::new(n.x, 0.0, n.z).normalize_or_zero() } else { n }
    };
    let wrap = if closed { (ru.0 - 1.0, ru.1 + 1.0) } else { ru };
    let mut normals: Vec<Vec<DVec3>> = (0..nu)
        .map(|i| {
            let at = |j: usize| normal(f, (us[column(i)], vs[j]), wrap, rv);
            (0..nv).map(|j| if closed { at(j) } else { on_seam(places[i][j], at(j)) }).collect()
        })
        .collect();
    for (j, inner) in
        [(0, vs[0] + 1e-4 * (vs[1] - vs[0])), (nv - 1, vs[nv - 1] - 1e-4 * (vs[nv - 1] - vs[nv - 2]))]
    {
        if (1..nu).all(|i| places[i][j] == places[0][j]) {
            let n: DVec3 = (0..nu - 1).map(|i| normal(f, (us[i], inner), wrap, rv)).sum();
            (0..nu).for_each(|i| normals[i][j] = n.normalize_or_zero());
        }
    }
    for i in 0..nu - 1 {
        for j in 0..nv - 1 {
            let Some(material) = material(i, j) else { continue };
            let mut corners: Vec<(DVec3, DVec3)> = Vec::with_capacity(4);
            for (a, b) in [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] {
                let p = places[a][b];
                if corners.iter().all(|c| c.0 != p) {
                    corners.push((p, normals[a][b]));
                }
            }
            if corners.len() >= 3 {
                let (p, n): (Vec<DVec3>, Vec<DVec3>) = corners.into_iter().unzip();
                curved_polygon(mesh, &p, &n, material);
            }
        }
    }
}

/// `n` + 1 values from `a` to `b`; the ends are exact.
pub fn steps(a: f64, b: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| if i == n { b } else { a + (b - a) * i as f64 / n as f64 }).collect()
}

/// Catmull-Rom curve through `knots`, knot i at s = i; at the ends it starts towards the next one.
pub fn spline<const N: usize>(knots: &[[f64; N]], s: f64) -> [f64; N] {
    let last = knots.len() - 1;
    let i = (s.floor().max(0.0) as usize).min(last.saturating_sub(1));
    let x = s - i as f64;
    let slope = |k: usize, c: usize| match k {
        0 => knots[1][c] - knots[0][c],
        k if k == last => knots[k][c] - knots[k - 1][c],
        k => 0.5 * (knots[k + 1][c] - knots[k - 1][c]),
    };
    std::array::from_fn(|c| {
        let (p, q, m, n) = (knots[i][c], knots[i + 1][c], slope(i, c), slope(i + 1, c));
        if x == 0.0 {
            return p;
        }
        if x == 1.0 {
            return q;
        }
        let (x2, x3) = (x * x, x * x * x);
        p + m * x + (3.0 * (q - p) - 2.0 * m - n) * x2 + (2.0 * (p - q) + m + n) * x3
    })
}

/// One cross section of a limb: height, half widths along x and y, and its centre's x.
pub type Ring = [f64; 4];

/// A closed smooth body about the z axis, through elliptic rings in rising order of height. The first and
/// last ring are the ends of round caps: their own half widths are not used, and they close at a point.
pub fn limb(mesh: &mut Mesh, rings: &[Ring], segments: usize, rows: usize, material: u32) {
    let last = rings.len() - 1;
    let tip = |k: usize, towards: usize| [rings[k][0], 0.0, 0.0, rings[towards][3]];
    let place = |u: f64, v: f64| {
        // Within a cap the half widths follow an ellipse; between them a smooth curve.
        let span = (last - 2) as f64;
        let cap = |k: usize, from: usize, w: f64| {
            let [z1, rx, ry, cx] = rings[from];
            let (sin, cos) = (FRAC_PI_2 * w).sin_cos();
            let z = z1 + (rings[k][0] - z1) * sin;
            if w >= 1.0 { tip(k, from) } else { [z, rx * cos, ry * cos, cx] }
        };
        let [z, rx, ry, cx] = if v <= 1.0 {
            cap(0, 1, 1.0 - v)
        } else if v >= 1.0 + span {
            cap(last, last - 1, v - 1.0 - span)
        } else {
            spline(&rings[1..last], v - 1.0)
        };
        let (sin, cos) = (TAU * u).sin_cos();
        DVec3::new(cx + rx * cos, ry * sin, z)
    };
    // Quarters of the turn by symmetry, so that the body is its own mirror image to the bit.
    let mirrored = |u: f64, v: f64| {
        if u > 0.5 {
            let p = place(1.0 - u, v);
            DVec3::new(p.x, -p.y, p.z)
        } else if u == 0.5 || u == 0.0 {
            let p = place(u, v);
            DVec3::new(p.x, 0.0, p.z)
        } else {
            place(u, v)
        }
    };
    let mut vs = Vec::new();
    for k in 0..last {
        vs.extend(steps(k as f64, (k + 1) as f64, rows).into_iter().take(rows));
    }
    vs.push(last as f64);
    grid(mesh, (&steps(0.0, 1.0, segments), &vs), &mirrored, true, &|_, _| Some(material));
}

/// A ball drawn out along z.
pub fn ovoid(mesh: &mut Mesh, centre: DVec3, half: DVec3, segments: usize, rows: usize, material: u32) {
    let mut part = Mesh::default();
    let rings = [[-half.z, 0.0, 0.0, 0.0], [0.0, half.x, half.y, 0.0], [half.z, 0.0, 0.0, 0.0]];
    limb_of_two_caps(&mut part, &rings, segments, rows, material);
    append(mesh, &part, &Pose::<Target, Target>::new(DQuat::IDENTITY, centre));
}

fn limb_of_two_caps(mesh: &mut Mesh, rings: &[Ring; 3], segments: usize, rows: usize, material: u32) {
    let [_, rx, ry, _] = rings[1];
    let half = rings[2][0];
    let place = |u: f64, v: f64| {
        let (sin, cos) = (TAU * u).sin_cos();
        let (up, out) = (FRAC_PI_2 * v).sin_cos();
        let out = if v.abs() == 1.0 { 0.0 } else { out };
        DVec3::new(rx * out * cos, ry * out * sin, half * up)
    };
    let us = steps(0.0, 1.0, segments);
    grid(mesh, (&us, &steps(-1.0, 1.0, 2 * rows)), &place, true, &|_, _| Some(material));
}

/// Height of a bar's domed ends over its radius.
const DOME: f64 = 0.4;
/// Rows of facets of a dome.
const DOME_ROWS: usize = 2;

/// A closed round bar from `a` to `b` whose ends bulge beyond them by 0.4 of its radius: flat ends would be mirrors that return more
/// than anything else wherever they face the radar.
pub fn bar(mesh: &mut Mesh, a: DVec3, b: DVec3, radius_m: f64, segments: usize, material: u32) {
    let first = mesh.triangles.len();
    tube(mesh, (a, radius_m), (b, radius_m), segments, material);
    // The flat ends come last.
    let side = first + 2 * segments;
    mesh.triangles.truncate(side);
    mesh.material.truncate(side);
    let axis = (b - a).normalize();
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    for (end, away) in [(a, -axis), (b, axis)] {
        // Place and normal on an ellipsoid's half, from its rim (row 0) to its tip.
        let at = |i: usize, row: usize| {
            let (sin, cos) = (TAU * (i % segments) as f64 / segments as f64).sin_cos();
            let out = x * cos + y * sin;
            if row == DOME_ROWS {
                return (end + away * (DOME * radius_m), away);
            }
            let (up, across) = (FRAC_PI_2 * row as f64 / DOME_ROWS as f64).sin_cos();
            (
                end + radius_m * across * out + away * (DOME * radius_m * up),
                (out * across + away * (up / DOME)).normalize(),
            )
        };
        for i in 0..segments {
            let (i, j) = if away == axis { (i, i + 1) } else { (i + 1, i) };
            for row in 0..DOME_ROWS {
                let mut corners = vec![at(i, row), at(j, row), at(j, row + 1)];
                if row + 1 < DOME_ROWS {
                    corners.push(at(i, row + 1));
                }
                let (p, n): (Vec<DVec3>, Vec<DVec3>) = corners.into_iter().unzip();
                curved_polygon(mesh, &p, &n, material);
            }
        }
    }
}

/// A closed ring about the y axis whose section is an ellipse: its middle's radius, and the section's half widths along the radius
/// and along y.
pub fn hoop(mesh: &mut Mesh, radius_m: f64, half: DVec2, (segments, rows): (usize, usize), material: u32) {
    let at = |i: usize, j: usize| {
        let (sin, cos) = (TAU * (i % segments) as f64 / segments as f64).sin_cos();
        let out = DVec3::new(cos, 0.0, sin);
        let (up, across) = (TAU * (j % rows) as f64 / rows as f64).sin_cos();
        let place = out * (radius_m + half.x * across) + DVec3::Y * half.y * up;
        (place, (out * (across / half.x) + DVec3::Y * (up / half.y)).normalize())
    };
    for i in 0..segments {
        for j in 0..rows {
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            curved_polygon(mesh, &corners.map(|c| c.0), &corners.map(|c| c.1), material);
        }
    }
}

/// A closed cone's part from radius to radius, with flat ends, which belong inside of other bodies.
pub fn tube(mesh: &mut Mesh, (a, ra): (DVec3, f64), (b, rb): (DVec3, f64), segments: usize, material: u32) {
    let axis = (b - a).normalize();
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    let out = |i: usize| {
        let (sin, cos) = (TAU * (i % segments) as f64 / segments as f64).sin_cos();
        x * cos + y * sin
    };
    let lean = (ra - rb) / (b - a).length();
    let n = |i: usize| (out(i) + axis * lean).normalize();
    for i in 0..segments {
        let (p, q) = (out(i), out(i + 1));
        let corners = [a + ra * p, a + ra * q, b + rb * q, b + rb * p];
        curved_polygon(mesh, &corners, &[n(i), n(i + 1), n(i + 1), n(i)], material);
    }
    let ring = |c: DVec3, r: f64| (0..segments).map(move |i| c + r * out(i)).collect::<Vec<_>>();
    polygon(mesh, &ring(b, rb), material);
    polygon(mesh, &ring(a, ra).into_iter().rev().collect::<Vec<_>>(), material);
}

/// A closed box with its edges along the axes.
pub fn block(mesh: &mut Mesh, lo: DVec3, hi: DVec3, material: u32) {
    let part = crate::road::shape::cuboid(hi - lo, 0.5 * (lo + hi), material);
    append(mesh, &part, &Pose::<Target, Target>::IDENTITY);
}

/// Turns an outline of (radius, y) points about the y axis; the outline runs so that outside lies to its
/// left, seen with y to the right and the radius up. Facets are round; an outline that ends on the axis
/// closes there.
pub fn turned(mesh: &mut Mesh, outline: &[DVec2], segments: usize, material: u32) {
    let part = crate::road::shape::revolve_z(outline, segments, 0.0, true, material);
    // z to y, x to z, y to x: a turn, no mirror.
    let pose = Pose::<Target, Target>::new(
        DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y)),
        DVec3::ZERO,
    );
    append(mesh, &part, &pose);
}

/// Adds the mirror image of a mesh in the plane y = 0.
pub fn mirror(mesh: &mut Mesh) {
    let (n, t) = (mesh.positions_m.len() as u32, mesh.triangles.len());
    mesh.normals.resize(n as usize, DVec3::ZERO);
    let flip = |p: &DVec3| DVec3::new(p.x, if p.y == 0.0 { 0.0 } else { -p.y }, p.z);
    mesh.positions_m.extend(mesh.positions_m.clone().iter().map(flip));
    mesh.normals.extend(mesh.normals.clone().iter().map(flip));
    for i in 0..t {
        let [a, b, c] = mesh.triangles[i];
        mesh.triangles.push([n + a, n + c, n + b]);
        mesh.material.push(mesh.material[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_m2, is_watertight, volume_m3};
    use std::f64::consts::PI;

    #[test]
    fn solids_are_closed_and_of_their_volume() {
        let mut ball = Mesh::default();
        ovoid(&mut ball, DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.1, 0.2, 0.3), 48, 16, 0);
        assert!(is_watertight(&ball));
        let v = 4.0 / 3.0 * PI * 0.006;
        let found: f64 = volume_m3(&ball);
        assert!((found / v - 1.0).abs() < 0.01, "{found} {v}");
        // The corners are on the ellipsoid, the normals are its own.
        for (p, n) in ball.positions_m.iter().zip(&ball.normals) {
            let q = (*p - DVec3::new(1.0, 2.0, 3.0)) / DVec3::new(0.1, 0.2, 0.3);
            assert!((q.length() - 1.0).abs() < 1e-12);
            let exact = (q / DVec3::new(0.1, 0.2, 0.3)).normalize();
            assert!((*n - exact).length() < 1e-3, "{n} {exact}");
        }
        let mut tapered = Mesh::default();
        tube(&mut tapered, (DVec3::ZERO, 0.2), (DVec3::new(0.3, 0.4, 0.0), 0.1), 32, 0);
        assert!(is_watertight(&tapered));
        let v = PI * 0.5 / 3.0 * (0.04 + 0.02 + 0.01);
        assert!((volume_m3(&tapered) / v - 1.0).abs() < 0.01);
        let (from, to) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, 0.6, 0.3));
        let mut rod = Mesh::default();
        bar(&mut rod, from, to, 0.05, 96, 0);
        assert!(is_watertight(&rod));
        // A cylinder and two halves of an ellipsoid.
        let v = PI * 0.0025 * (0.5 + 4.0 / 3.0 * 0.4 * 0.05);
        assert!((volume_m3(&rod) / v - 1.0).abs() < 0.01, "{} {v}", volume_m3(&rod));
        // No facet mirrors along the rod but the tips' own.
        let axis = (to - from).normalize();
        let steep = |t: usize| rod.corner_normals(t).unwrap().iter().any(|n| n.dot(axis).abs() < 0.97);
        assert!((0..rod.triangles.len()).all(steep));
        let mut ring = Mesh::default();
        hoop(&mut ring, 0.3, DVec2::new(0.02, 0.01), (64, 24), 0);
        assert!(is_watertight(&ring));
        let v = TAU * 0.3 * PI * 0.02 * 0.01;
        assert!((volume_m3(&ring) / v - 1.0).abs() < 0.02, "{} {v}", volume_m3(&ring));
        let mut leg = Mesh::default();
        let rings =
            [[-0.5, 0.0, 0.0, 0.0], [-0.45, 0.04, 0.05, 0.0], [0.0, 0.07, 0.08, 0.02], [0.06, 0.0, 0.0, 0.0]];
        limb(&mut leg, &rings, 16, 4, 0);
        assert!(is_watertight(&leg) && volume_m3(&leg) > 0.0);
        let mut wheel = Mesh::default();
        let outline = [(0.0, -0.1), (0.3, -0.1), (0.3, 0.1), (0.0, 0.1)].map(|(r, y)| DVec2::new(r, y));
        turned(&mut wheel, &outline, 64, 0);
        assert!(is_watertight(&wheel));
        assert!((volume_m3(&wheel) / (PI * 0.09 * 0.2) - 1.0).abs() < 0.01);
        let y = wheel.positions_m.iter().map(|p| p.y.abs()).fold(0.0, f64::max);
        assert!((y - 0.1).abs() < 1e-12 && area_m2(&wheel) > 0.0);
    }

    #[test]
    fn the_spline_goes_through_its_knots_and_keeps_lines() {
        let knots = [[0.0, 1.0], [1.0, 3.0], [2.0, 5.0], [3.0, 7.0]];
        for s in [0.0, 0.25, 1.0, 1.7, 2.0, 2.9, 3.0] {
            let p = spline(&knots, s);
            assert!((p[0] - s).abs() < 1e-14 && (p[1] - 1.0 - 2.0 * s).abs() < 1e-14);
        }
    }
}
