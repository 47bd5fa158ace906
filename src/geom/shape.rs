//! How the surface over a facet is curved: its second fundamental form, from the normals at the facet's corners.

use super::smooth::is_curved;
use crate::scene::Mesh;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Second fundamental form of the surface over a triangle as a symmetric tensor of its plane, 1/m, positive where it is convex to the
/// front: the change of the unit normal is the tensor times the step. None where the triangle is flat.
pub(super) fn shape(mesh: &Mesh, triangle: usize) -> Option<DMat3> {
    if !is_curved(mesh, triangle) {
        return None;
    }
    let corners = mesh.triangles[triangle].map(|i| mesh.positions_m[i as usize]);
    Form::new(corners, mesh.corner_normals(triangle)?)?.tensor()
}

/// The same of principal curvatures without their signs, and none where there is no form.
pub(super) fn bend(corners: [DVec3; 3], normals: [DVec3; 3]) -> DMat3 {
    let bend =
        Form::new(corners, normals).and_then(|form| Form { form: absolute(form.form), ..form }.tensor());
    bend.unwrap_or(DMat3::ZERO)
}

/// Second fundamental form along two axes of a triangle's plane.
struct Form {
    axes: [DVec3; 2],
    form: DMat2,
}

impl Form {
    fn new(corners: [DVec3; 3], normals: [DVec3; 3]) -> Option<Form> {
        let [a, b, c] = corners;
        let front = (b - a).cross(c - a).try_normalize()?;
        let x = (b - a).try_normalize()?;
        let axes = [x, front.cross(x)];
        let sign = normals[0].dot(front).signum();
        let [n, to_b, to_c] = normals.map(|n| n * sign);
        let on_axes = |v: DVec3| DVec2::new(axes[0].dot(v), axes[1].dot(v));
        let steps = DMat2::from_cols(on_axes(b - a), on_axes(c - a));
        let turns = DMat2::from_cols(on_axes(to_b - n), on_axes(to_c - n));
        let form = turns * steps.inverse();
        // Normals that are rounded or belong to no surface leave a part that turns about itself.
        let mixed = 0.5 * (form.x_axis.y + form.y_axis.x);
        let form = DMat2::from_cols(DVec2::new(form.x_axis.x, mixed), DVec2::new(mixed, form.y_axis.y));
        Some(Form { axes, form })
    }

    fn tensor(&self) -> Option<DMat3> {
        let [x, y] = self.axes;
        let term = |p: DVec3, q: DVec3| DMat3::from_cols(p * q.x, p * q.y, p * q.z);
        let tensor = term(x, x) * self.form.x_axis.x
            + term(y, y) * self.form.y_axis.y
            + (term(x, y) + term(y, x)) * self.form.x_axis.y;
        tensor.is_finite().then_some(tensor)
    }
}

/// The root of a symmetric matrix' square.
fn absolute(form: DMat2) -> DMat2 {
    let square = form * form;
    let root = form.determinant().abs();
    let trace = (square.x_axis.x + square.y_axis.y + 2.0 * root).sqrt();
    match trace > 0.0 {
        true => (square + DMat2::IDENTITY * root) * trace.recip(),
        false => DMat2::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// A saddle's curvatures lose their signs along its own directions, and nothing else does.
    #[test]
    fn curvatures_lose_their_signs() {
        for (p, q, turn) in [(3.0, -0.5, 0.4), (-2.0, -7.0, 1.2), (0.0, 4.0, 2.0), (0.0, 0.0, 0.0)] {
            let axes = DMat2::from_angle(turn);
            let of = |p, q| axes * DMat2::from_diagonal(DVec2::new(p, q)) * axes.transpose();
            let off = absolute(of(p, q)) - of(f64::abs(p), f64::abs(q));
            assert!(off.to_cols_array().iter().all(|x| x.abs() < 1e-12), "{p} {q}");
        }
    }
}
