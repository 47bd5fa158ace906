//! Sphere, faceted.

use super::kind::{Builder, Kind, SAGITTA, kind_of, length};
use crate::base::error::Result;
use crate::scene::Mesh;
use glam::DVec3;
use serde::Deserialize;
use std::collections::HashMap;

/// A geodesic sphere at the origin: the faces of an icosahedron, each cut into n² triangles whose
/// corners are projected onto the sphere.
///
/// It carries the sphere's normals, so cross sections cut it as finely as their accuracy asks, from however
/// few facets (`geom::curved`).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Sphere {
    /// Radius, m.
    pub radius_m: f64,
    /// Greatest depth of a facet below the sphere through its corners.
    pub sagitta_m: f64,
}

/// The sphere in the registry.
pub static KIND: Kind = Kind {
    name: "sphere",
    summary: "sphere",
    pose: "centred at the origin",
    params: &[length("radius_m", 0.05, "radius"), SAGITTA],
    ..kind_of::<Sphere>()
};

impl Sphere {
    /// Number of facets.
    pub fn triangles(&self) -> f64 {
        20.0 * self.subdivision().powi(2)
    }

    /// Number of steps along an edge of the icosahedron. The largest facet is the one in the middle
    /// of a face, where the projection stretches by circumradius over inradius of the icosahedron.
    fn subdivision(&self) -> f64 {
        // Circumradius of a flat facet on the unit icosahedron, times the stretch 1 / 0.794654.
        let c = 0.607_062 / 0.794_654;
        // A facet of circumradius r has the sagitta r²/(2 R) + r⁴/(8 R³), of which R - sqrt(R² - r²)
        // is the sum.
        let s = (0.999 * self.sagitta_m / self.radius_m).min(0.5);
        (c / (s * (2.0 - s)).sqrt()).ceil().max(2.0)
    }
}

/// Unit icosahedron: corners and faces, counter-clockwise from outside.
fn icosahedron() -> ([DVec3; 12], [[usize; 3]; 20]) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize();
    let corners = [
        v(-1.0, g, 0.0),
        v(1.0, g, 0.0),
        v(-1.0, -g, 0.0),
        v(1.0, -g, 0.0),
        v(0.0, -1.0, g),
        v(0.0, 1.0, g),
        v(0.0, -1.0, -g),
        v(0.0, 1.0, -g),
        v(g, 0.0, -1.0),
        v(g, 0.0, 1.0),
        v(-g, 0.0, -1.0),
        v(-g, 0.0, 1.0),
    ];
    // Every triple of corners at the shortest mutual distance is a face.
    let mut faces = [[0; 3]; 20];
    let mut count = 0;
    let near = |a: usize, b: usize| corners[a].dot(corners[b]) > 0.4;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                    faces[count] = if outward { [a, b, c] } else { [a, c, b] };
                    count += 1;
                }
            }
        }
    }
    (corners, faces)
}

impl Builder for Sphere {
    fn check(&self, kind: &Kind) -> Result<()> {
        kind.check_triangles(self.triangles())
    }

    fn mesh(&self) -> Mesh {
        let n = self.subdivision() as u32;
        let (corners, faces) = icosahedron();
        let mut mesh = Mesh::default();
        // A vertex is known by its weights on the corners, so that faces share it to the bit.
        let mut known: HashMap<[(usize, u32); 3], u32> = HashMap::new();
        for face in faces {
            let mut vertex = |i: u32, j: u32| {
                let mut key = [(face[0], n - i - j), (face[1], i), (face[2], j)];
                for k in &mut key {
                    if k.1 == 0 {
                        *k = (usize::MAX, 0);
                    }
                }
                key.sort_unstable();
                *known.entry(key).or_insert_with(|| {
                    let p: DVec3 =
                        key.iter().filter(|k| k.1 > 0).map(|k| corners[k.0] * f64::from(k.1)).sum();
                    mesh.positions_m.push(p.normalize());
                    mesh.positions_m.len() as u32 - 1
                })
            };
            for i in 0..n {
                for j in 0..n - i {
                    let (a, b, c) = (vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
                    mesh.triangles.push([a, b, c]);
                    if i + j + 1 < n {
                        mesh.triangles.push([b, vertex(i + 1, j + 1), c]);
                    }
                }
            }
        }
        mesh.material = vec![0; mesh.triangles.len()];
        mesh.normals = mesh.positions_m.clone();
        for p in &mut mesh.positions_m {
            *p *= self.radius_m;
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};
    use std::f64::consts::PI;

    #[test]
    fn volume_sagitta_and_normals() {
        for (radius_m, sagitta_m) in [(0.05, 1e-4), (0.05, 1.5573e-5), (1.0, 0.01), (0.01, 1.0)] {
            let s = Sphere { radius_m, sagitta_m };
            let m = s.mesh();
            let n = s.subdivision() as usize;
            assert_eq!((m.triangles.len(), m.positions_m.len()), (20 * n * n, 10 * n * n + 2));
            assert!(is_watertight(&m));
            // Facets lie between the sphere and one smaller by their sagitta.
            let share = volume_m3(&m) / (4.0 / 3.0 * PI * radius_m.powi(3));
            assert!(share < 1.0 && share > (1.0 - sagitta_m / radius_m).max(0.5f64.cbrt()).powi(3));
            let rho = m.positions_m[0].length();
            assert!((rho - radius_m).abs() < 1e-15);
            let mut deepest = 0.0f64;
            for t in 0..m.triangles.len() {
                let a = area_vector_m2(&m, t).normalize();
                let d = a.dot(m.positions_m[m.triangles[t][0] as usize]);
                assert!(d > 0.0, "normal points inwards");
                deepest = deepest.max(rho - d);
            }
            assert!(deepest <= sagitta_m * (1.0 + 1e-9), "{deepest} > {sagitta_m}");
            assert!(n == 2 || deepest > 0.7 * sagitta_m, "finer than needed: {deepest} of {sagitta_m}");
        }
    }
}
