//! Workload W8: a flat road between hills of 180,000 triangles, with the posts and cars of W3.

use super::terrain;
use super::w3::{self, CAR_M, POST_M, SIDES};
use crate::base::error::Result;
use crate::base::frames::Pose;
use crate::road::materials::MaterialLookup;
use crate::road::objects::standing_box;
use crate::scene::{Scene, Shape};
use glam::{DQuat, DVec3};

/// Middle of the terrain, so that it reaches from x = -10 to 110 m as the ground of W3 does.
pub const CENTRE_X_M: f64 = 50.0;

/// Terrain of asphalt, 120 x 120 m, flat within 4 m of the x axis and with hills of up to 1 m beside it; W3's 52 posts,
/// which stand on it, and W3's three cars, of steel, which drive forward at 10, 5 and 15 m/s.
///
/// # Errors
/// Returns an error for a material that `materials` does not have.
pub fn w8(materials: MaterialLookup) -> Result<Scene> {
    w8_cut(terrain::W8_QUADS, materials)
}

/// [`w8`] with its terrain cut into 2 x `quads`² triangles; posts stand at the height that the hills have in their place,
/// which a coarse terrain has at its vertices only.
///
/// # Errors
/// Returns an error for a material that `materials` does not have.
pub fn w8_cut(quads: u32, materials: MaterialLookup) -> Result<Scene> {
    let mut scene = Scene::default();
    let asphalt = scene.material_index(&materials("asphalt")?);
    let steel = scene.material_index(&materials("steel")?);
    scene.meshes.push(terrain::w8(quads, asphalt));
    let middle = Pose::new(DQuat::IDENTITY, DVec3::X * CENTRE_X_M);
    scene.add_object("terrain", "road", Shape::Mesh(0), middle, DVec3::ZERO);
    let post = w3::share(&mut scene, standing_box(POST_M, steel));
    let car = w3::share(&mut scene, standing_box(CAR_M, steel));
    for side in SIDES {
        w3::add_posts(&mut scene, post, side, |x, y| terrain::w8_height_m(x - CENTRE_X_M, y));
    }
    w3::add_cars(&mut scene, car, true);
    scene.import.triangles = scene.triangle_count();
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::truth_boxes;
    use crate::scene::Material;

    #[test]
    fn hills_posts_and_cars() {
        let any = |name: &str| Ok(Material { name: name.into(), ..Material::pec() });
        let s = w8(&any).unwrap();
        assert_eq!(s.triangle_count(), 180_000 + (52 + 3) * 12);
        assert_eq!(s.objects.len(), 1 + 52 + 3);
        let coarse = w8_cut(20, &any).unwrap();
        assert_eq!(coarse.triangle_count(), 800 + (52 + 3) * 12);
        assert_eq!(coarse.objects, s.objects);
        let boxes = truth_boxes(&s, 0.0);
        let ground = boxes.iter().find(|b| b.name == "terrain").unwrap();
        assert!((ground.centre_m[0] - 50.0).abs() < 1e-9 && (ground.size_m[0] - 120.0).abs() < 1e-9);
        // Beside the road the posts stand at heights of their own.
        let posts: Vec<f64> = boxes.iter().filter(|b| b.class == "post").map(|b| b.centre_m[2]).collect();
        assert!(
            posts.iter().any(|z| (z - 0.375).abs() > 0.05) && posts.iter().all(|z| (z - 0.375).abs() < 1.0)
        );
        assert_eq!(boxes.iter().find(|b| b.name == "car 3").unwrap().velocity_mps, [15.0, 0.0, 0.0]);
    }
}
