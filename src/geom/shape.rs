//! How the surface over a facet is curved: its second fundamental form, from the normals at the facet's corners.

use super::smooth::is_curved;
use crate::scene::Mesh;
use glam::{DMat2, DMat3, DVec2};

/// Second fundamental form of the surface over a triangle as a symmetric tensor of its plane, 1/m, positive where it is convex to the
/// front: the change of the unit normal is the tensor times the step. None where the triangle is flat.
pub(super) fn shape(mesh: &Mesh, triangle: usize) -> Option<DMat3> {
    if !is_curved(mesh, triangle) {
        return None;
    }
    let normals = mesh.corner_normals(triangle)?;
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.positions_m[i as usize]);
    let front = (b - a).cross(c - a).normalize_or_zero();
    let x = (b - a).normalize_or_zero();
    let axes = [x, front.cross(x)];
    let sign = normals[0].dot(front).signum();
    let [n, to_b, to_c] = normals.map(|n| n * sign);
    let on_axes = |v: glam::DVec3| DVec2::new(axes[0].dot(v), axes[1].dot(v));
    let steps = DMat2::from_cols(on_axes(b - a), on_axes(c - a));
    let turns = DMat2::from_cols(on_axes(to_b - n), on_axes(to_c - n));
    let form = turns * steps.inverse();
    // Normals that are rounded or belong to no surface leave a part that turns about itself.
    let mixed = 0.5 * (form.x_axis.y + form.y_axis.x);
    let term = |p: glam::DVec3, q: glam::DVec3| DMat3::from_cols(p * q.x, p * q.y, p * q.z);
    let shape = term(axes[0], axes[0]) * form.x_axis.x
        + term(axes[1], axes[1]) * form.y_axis.y
        + (term(axes[0], axes[1]) + term(axes[1], axes[0])) * mixed;
    shape.is_finite().then_some(shape)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Of a cylinder along z one over its radius around it and nothing along it, from whichever side the triangle is wound.
    #[test]
    fn a_cylinder_is_curved_around_its_axis() {
        let radius = 0.3;
        let at = |angle: f64, z: f64| DVec3::new(radius * angle.cos(), radius * angle.sin(), z);
        let (p, normals): (Vec<DVec3>, Vec<DVec3>) = [(0.0, 0.0), (0.02, 0.01), (0.005, 0.05)]
            .map(|(angle, z): (f64, f64)| (at(angle, z), DVec3::new(angle.cos(), angle.sin(), 0.0)))
            .into_iter()
            .unzip();
        for (triangle, sign) in [([0, 1, 2], 1.0), ([0, 2, 1], -1.0)] {
            let mesh = Mesh {
                positions_m: p.clone(),
                normals: normals.clone(),
                triangles: vec![triangle],
                material: vec![0],
            };
            let s = shape(&mesh, 0).unwrap();
            let form = |d: DVec3| d.dot(s * d);
            assert!((form(DVec3::Y) - sign / radius).abs() < 1e-3 / radius, "{}", form(DVec3::Y));
            assert!(form(DVec3::Z).abs() < 1e-3 / radius, "{}", form(DVec3::Z));
        }
    }
}
