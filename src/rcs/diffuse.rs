//! Diffuse cross section of rough surfaces: the incoherent companion of the physical-optics sum
//! (CONVENTIONS eq. 27). First bounce, far field, monostatic.

use super::Aspect;
use crate::base::frames::{direction_from_angles, polarisation_basis};
use crate::base::tasks::Tasks;
use crate::base::units::wavenumber;
use crate::em::roughness::Lobe;
use crate::geom::Geometry;
use crate::trace::launch::PlaneGrid;
use rayon::prelude::*;

/// Mean cross section, m², that the visible rough facets add in power to the coherent one, for each aspect: [V sent, H
/// sent], all received polarisations together. The strength of the lobe is what the roughness takes from the coherent
/// reflection; smooth materials add nothing.
pub fn mean_m2(
    geometry: &Geometry,
    aspects: &[Aspect],
    lobe: Lobe,
    rays_per_wavelength: f64,
) -> Vec<[f64; 2]> {
    if geometry.triangles.is_empty() || geometry.surfaces.iter().all(|s| s.roughness_rms_m == 0.0) {
        return vec![[0.0; 2]; aspects.len()];
    }
    aspects.iter().map(|a| one(geometry, *a, lobe, rays_per_wavelength)).collect()
}

fn one(geometry: &Geometry, aspect: Aspect, lobe: Lobe, rays_per_wavelength: f64) -> [f64; 2] {
    let k = wavenumber(geometry.freq_hz);
    let dir = -direction_from_angles(aspect.azimuth, aspect.elevation);
    let basis = polarisation_basis(-dir);
    let grid = PlaneGrid::cover(geometry, dir, rays_per_wavelength);
    let cell_m2 = grid.step[0].cross(grid.step[1]).length();
    let rows: Vec<[f64; 2]> = (0..grid.count[1])
        .into_par_iter()
        .map_tasks(|j| {
            let mut row = [0.0; 2];
            for i in 0..grid.count[0] {
                let tube = grid.tube(i, j);
                let Some(hit) = geometry.bvh.closest_hit(
                    &geometry.triangles,
                    tube.origin_m,
                    dir,
                    u32::MAX,
                    f64::INFINITY,
                ) else {
                    continue;
                };
                let triangle = &geometry.triangles[hit.triangle as usize];
                let cos_i = dir.dot(triangle.normal).abs();
                let [perp, par] = geometry.surfaces[triangle.surface as usize].diffuse_share(k, cos_i);
                let across = dir.cross(triangle.normal);
                let e_perp = across.normalize_or(basis.1);
                for (sum, sent) in row.iter_mut().zip([basis.0, basis.1]) {
                    let on_perp = sent.dot(e_perp).powi(2);
                    let share = on_perp * perp + (1.0 - on_perp) * par;
                    // The cell covers cell / cos of the facet.
                    *sum += cell_m2 / cos_i * lobe.backscatter_sigma0(share, cos_i);
                }
            }
            row
        })
        .collect();
    rows.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::Pose;
    use crate::road::reflector::Reflector;
    use crate::scene::{Material, Scene};
    use glam::{DQuat, DVec3};
    use std::f64::consts::PI;

    fn rough(spec: &str, roughness_rms_m: f64) -> Geometry {
        let scene = Reflector::parse(spec)
            .unwrap()
            .to_scene(&|_| Ok(Material { roughness_rms_m, ..Material::pec() }))
            .unwrap();
        Geometry::build(&scene, 0.0, 77e9).unwrap()
    }

    fn at(geometry: &Geometry, azimuth_deg: f64) -> [f64; 2] {
        let aspect = Aspect { azimuth: azimuth_deg.to_radians(), elevation: 0.0 };
        mean_m2(geometry, &[aspect], Lobe::Lambert, 4.0)[0]
    }

    /// A plate of area A: 4 A D cos^2, D what eq. 27 takes from the coherent power.
    #[test]
    fn plate() {
        let (h, k) = (2e-4, wavenumber(77e9));
        let g = rough("plate:width_m=0.06,height_m=0.05", h);
        for azimuth_deg in [0.0f64, 35.0, 60.0] {
            let c = azimuth_deg.to_radians().cos();
            let share = 1.0 - (-4.0 * (k * h * c).powi(2)).exp();
            let expect = 4.0 * 0.06 * 0.05 * share * c * c;
            for sigma in at(&g, azimuth_deg) {
                assert!((sigma / expect - 1.0).abs() < 1e-9, "{azimuth_deg}: {sigma} {expect}");
            }
        }
        assert_eq!(at(&rough("plate:width_m=0.06,height_m=0.05", 0.0), 0.0), [0.0; 2]);
    }

    /// A white sphere of Lambert's law returns 8/3 pi a^2.
    #[test]
    fn white_sphere() {
        let a = 0.03;
        let g = rough("sphere:radius_m=0.03", 0.02);
        for sigma in at(&g, 20.0) {
            assert!((sigma / (8.0 / 3.0 * PI * a * a) - 1.0).abs() < 5e-3, "{sigma}");
        }
    }

    /// What stands behind is not seen.
    #[test]
    fn hidden_facets() {
        let material = Material { roughness_rms_m: 1e-3, ..Material::pec() };
        let lookup = |_: &str| Ok(material.clone());
        let mut scene = Scene::default();
        for (spec, x) in
            [("plate:width_m=0.04,height_m=0.04", 0.0), ("plate:width_m=0.02,height_m=0.02", -0.1)]
        {
            let pose = Pose::new(DQuat::IDENTITY, DVec3::new(x, 0.0, 0.0));
            let r = Reflector::parse(spec).unwrap();
            r.add_to(&mut scene, &lookup, ("plate", ""), pose, DVec3::ZERO).unwrap();
        }
        let both = at(&Geometry::build(&scene, 0.0, 77e9).unwrap(), 0.0);
        let front = at(&rough("plate:width_m=0.04,height_m=0.04", 1e-3), 0.0);
        assert!((both[0] / front[0] - 1.0).abs() < 1e-9, "{both:?} {front:?}");
    }
}
