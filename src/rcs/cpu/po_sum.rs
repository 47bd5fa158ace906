//! Sum of the physical-optics contributions of all tubes, in f64, in a fixed order.

use crate::base::frames::{direction_from_angles, polarisation_basis};
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::geom::Geometry;
use crate::rcs::{Aspect, Distance, RayGrid, Scattering};
use crate::trace::cpu::contribute::{Receiver, Spreading, radiate};
use crate::trace::cpu::rays::follow;
use crate::trace::launch::{Fan, PlaneGrid, Tube};
use num_complex::Complex64;
use rayon::prelude::*;

/// Computes S of the geometry for each aspect (monostatic) with a grid of rays.
pub fn by_rays(geometry: &Geometry, aspects: &[Aspect], options: &RayGrid) -> Vec<Scattering> {
    if geometry.triangles.is_empty() {
        return vec![Scattering::default(); aspects.len()];
    }
    aspects.par_iter().map_tasks(|a| scattering(geometry, *a, options)).collect()
}

fn scattering(geometry: &Geometry, aspect: Aspect, options: &RayGrid) -> Scattering {
    let k = wavenumber(geometry.freq_hz);
    let u = direction_from_angles(aspect.azimuth, aspect.elevation);
    let one = |tube: &Tube, receiver, spreading, to_phase: &dyn Fn(f64, f64, glam::DVec3) -> f64| {
        // At infinity this is the basis of the aspect for every tube.
        let basis = polarisation_basis(-tube.dir);
        let mut sum = Scattering::default();
        let chain = follow(geometry, tube, options.bounces, true);
        radiate(geometry, tube, &chain, spreading, receiver, true, basis, polarisation_basis, |c| {
            let phase = -k * to_phase(c.length_in_m, c.length_out_m, c.point);
            let (s, cis) = (c.integrated(), Complex64::cis(phase));
            let radiated = s.map(|row| row.map(|z| z * cis));
            let none = Default::default();
            sum.add(&Scattering { every: radiated, last: if c.is_last { radiated } else { none } });
        });
        sum
    };
    match options.distance {
        Distance::Infinite => {
            let grid = PlaneGrid::cover(geometry, -u, options.rays_per_wavelength);
            let rows: Vec<Scattering> = (0..grid.count[1])
                .into_par_iter()
                .map_tasks(|j| {
                    let mut row = Scattering::default();
                    for i in 0..grid.count[0] {
                        // The wave's phase is zero on the plane through the origin.
                        row.add(&one(&grid.tube(i, j), Receiver::Far(u), Spreading::Plane, &|l_in, _, p| {
                            l_in - grid.lead_m - u.dot(p)
                        }));
                    }
                    row
                })
                .collect();
            total(&rows, 1.0)
        }
        Distance::At(r0) => {
            let fan = Fan::grid(geometry, u * r0, options.rays_per_wavelength);
            let blocks: Vec<Scattering> = (0..fan.cells.len().div_ceil(1024))
                .into_par_iter()
                .map_tasks(|b| {
                    let mut sum = Scattering::default();
                    for i in b * 1024..((b + 1) * 1024).min(fan.cells.len()) {
                        sum.add(&one(
                            &fan.tube(i),
                            Receiver::At(fan.origin_m),
                            Spreading::Spherical,
                            &|l_in, l_out, _| l_in + l_out - 2.0 * r0,
                        ));
                    }
                    sum
                })
                .collect();
            total(&blocks, r0 * r0)
        }
    }
}

fn total(parts: &[Scattering], scale: f64) -> Scattering {
    let mut sum = Scattering::default();
    for p in parts {
        sum.add(p);
    }
    for m in [&mut sum.every, &mut sum.last] {
        for z in m.iter_mut().flatten() {
            *z *= scale;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::base::units::dbsm_from_amplitude;
    use crate::scene::{Material, Mesh, Scene};
    use glam::DVec3;

    fn geometry(faces: &[[DVec3; 3]]) -> Geometry {
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        let mesh = Mesh {
            positions_m: faces.iter().flatten().copied().collect(),
            triangles: (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material: vec![0; faces.len()],
            ..Mesh::default()
        };
        scene.add_mesh("target", "", mesh, Pose::IDENTITY);
        Geometry::build(&scene, 0.0, 77e9).unwrap()
    }

    fn p(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn trihedral_boresight() {
        let a = 0.1;
        let r = a * 0.5f64.sqrt();
        let (o, l, rr, t) = (p(0., 0., 0.), p(r, r, 0.), p(r, -r, 0.), p(0., 0., a));
        let g = geometry(&[[o, rr, l], [o, l, t], [o, t, rr]]);
        let aspect = Aspect { azimuth: 0.0, elevation: (0.5f64.sqrt()).atan() };
        let options = RayGrid { bounces: 3, rays_per_wavelength: 10.0, distance: Distance::Infinite };
        let s = by_rays(&g, &[aspect], &options)[0];
        let db = |z: Complex64| dbsm_from_amplitude(z.norm());
        println!("every {:?} last {:?}", s.every.map(|r| r.map(db)), s.last.map(|r| r.map(db)));
        assert!((db(s.last[0][0]) - 14.414).abs() < 0.05);
        assert!((db(s.every[0][0]) - 14.53).abs() < 0.05);
    }

    #[test]
    fn dihedral() {
        let (h, w) = (0.05, 0.1 * 0.5f64.sqrt());
        let (a, b) = (p(0., 0., -h), p(0., 0., h));
        let (la, lb, ra, rb) = (p(w, w, -h), p(w, w, h), p(w, -w, -h), p(w, -w, h));
        let g = geometry(&[[a, b, lb], [a, lb, la], [a, rb, b], [a, ra, rb]]);
        let options = RayGrid { bounces: 3, rays_per_wavelength: 10.0, distance: Distance::Infinite };
        let s = by_rays(&g, &[Aspect { azimuth: 0.0, elevation: 0.0 }], &options)[0];
        let db = |z: Complex64| dbsm_from_amplitude(z.norm());
        println!("every {:?} last {:?}", s.every.map(|r| r.map(db)), s.last.map(|r| r.map(db)));
        println!("{:?}", s.last);
    }
}
