//! Workload W3: a synthetic road of boxes with fixed numbers, for timing and comparison.

use crate::base::error::Result;
use crate::base::frames::{Pose, Target, World};
use crate::road::materials::MaterialLookup;
use crate::road::objects::{ground, standing_box};
use crate::road::shape::cuboid;
use crate::scene::{Mesh, Scene, Shape};
use glam::{DVec2, DVec3};

/// Height of the radar over the ground; it stands at x = y = 0.
pub const RADAR_HEIGHT_M: f64 = 0.5;
/// Speed of the ego in the moving form.
pub const EGO_SPEED_MPS: f64 = 10.0;
/// Names that the scene asks the lookup for.
pub const MATERIALS: [&str; 2] = ["asphalt", "steel"];

/// Size of a post.
pub(super) const POST_M: DVec3 = DVec3::new(0.10, 0.06, 0.75);
/// Size of a car.
pub(super) const CAR_M: DVec3 = DVec3::new(4.5, 1.8, 1.5);
/// Name of a side of the road, and the sign of y there.
pub(super) const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];

fn at(x: f64, y: f64, z: f64) -> Pose<Target, World> {
    Pose::new(glam::DQuat::IDENTITY, DVec3::new(x, y, z))
}

/// Puts a mesh into the scene that several objects may share.
pub(super) fn share(scene: &mut Scene, mesh: Mesh) -> Shape {
    scene.meshes.push(mesh);
    Shape::Mesh(scene.meshes.len() - 1)
}

/// The 26 posts of one side, standing at the height of the ground, m, over a place (x, y).
pub(super) fn add_posts(
    scene: &mut Scene,
    post: Shape,
    (name, side): (&str, f64),
    ground_m: impl Fn(f64, f64) -> f64,
) {
    for i in 0..26 {
        let (x, y) = (4.0 * f64::from(i), side * 7.65);
        scene.add_object(&format!("post {name} {i}"), "post", post, at(x, y, ground_m(x, y)), DVec3::ZERO);
    }
}

/// The three cars, at rest or each at its own speed.
pub(super) fn add_cars(scene: &mut Scene, car: Shape, moving: bool) {
    for (i, (x, y, speed)) in
        [(20.0, 0.0, 10.0), (35.0, 3.5, 5.0), (60.0, -3.5, 15.0)].into_iter().enumerate()
    {
        let velocity = if moving { DVec3::X * speed } else { DVec3::ZERO };
        scene.add_object(&format!("car {}", i + 1), "car", car, at(x, y, 0.2), velocity);
    }
}

/// Ground 120 x 40 m (x from -10 to 110, centred on y = 0); two rails (beam 100 x 0.08 x 0.31 m from
/// x = 0 at y = ±7.5, centre at z = 0.6); 26 posts a side every 4 m from x = 0 (0.10 x 0.06 x 0.75 m,
/// y = ±7.65); 60 markers (boxes 0.16 x 0.10 x 0.04 m at y = ±1.75, x from 4 m every 3.3 m); three cars,
/// boxes of 4.5 x 1.8 x 1.5 m with their floor 0.2 m up, centred at (20, 0), (35, 3.5), (60, -3.5). With
/// `moving` the cars drive forward at 10, 5 and 15 m/s, otherwise nothing moves. Ground asphalt, the
/// rest steel.
///
/// # Errors
/// Returns an error for a material that `materials` does not have.
pub fn w3(moving: bool, materials: MaterialLookup) -> Result<Scene> {
    let mut scene = Scene::default();
    let asphalt = scene.material_index(&materials("asphalt")?);
    let steel = scene.material_index(&materials("steel")?);
    let plane = ground(DVec2::new(-10.0, -20.0), DVec2::new(110.0, 20.0), 0.0, asphalt);
    scene.add_mesh("ground", "road", plane, Pose::IDENTITY);
    let beam = share(&mut scene, cuboid(DVec3::new(100.0, 0.08, 0.31), DVec3::ZERO, steel));
    let post = share(&mut scene, standing_box(POST_M, steel));
    let marker = share(&mut scene, standing_box(DVec3::new(0.16, 0.10, 0.04), steel));
    let car = share(&mut scene, standing_box(CAR_M, steel));

    for (name, side) in SIDES {
        let beam_at = at(50.0, side * 7.5, 0.6);
        scene.add_object(&format!("rail {name}"), "guard_rail", beam, beam_at, DVec3::ZERO);
        add_posts(&mut scene, post, (name, side), |_, _| 0.0);
        for i in 0..30 {
            let name = format!("marker {name} {i}");
            let pose = at(4.0 + 3.3 * f64::from(i), side * 1.75, 0.0);
            scene.add_object(&name, "marker", marker, pose, DVec3::ZERO);
        }
    }
    add_cars(&mut scene, car, moving);
    scene.import.triangles = scene.triangle_count();
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::truth_boxes;
    use crate::scene::Material;

    fn any_material(name: &str) -> Result<Material> {
        assert!(MATERIALS.contains(&name));
        Ok(Material { name: name.into(), ..Material::pec() })
    }

    #[test]
    fn the_contracts_numbers() {
        let s = w3(true, &any_material).unwrap();
        assert_eq!(s.objects.len(), 1 + 2 + 52 + 60 + 3);
        assert_eq!(s.triangle_count(), 2 + (2 + 52 + 60 + 3) * 12);
        let boxes = truth_boxes(&s, 0.0);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12);
        let find = |name: &str| boxes.iter().find(|b| b.name == name).unwrap();
        assert!(
            near(find("ground").centre_m, [50.0, 0.0, 0.0])
                && near(find("ground").size_m, [120.0, 40.0, 0.0])
        );
        assert!(near(find("rail right").centre_m, [50.0, -7.5, 0.6]));
        assert!(near(find("post left 25").centre_m, [100.0, 7.65, 0.375]));
        assert!(near(find("marker right 29").centre_m, [4.0 + 29.0 * 3.3, -1.75, 0.02]));
        let c = find("car 3");
        assert!(near(c.centre_m, [60.0, -3.5, 0.95]) && near(c.velocity_mps, [15.0, 0.0, 0.0]));
        let still = w3(false, &any_material).unwrap();
        assert!(still.objects.iter().all(|o| o.velocity_mps == DVec3::ZERO));
        assert_eq!(still.meshes, s.meshes);
        let mut ids: Vec<u32> = s.objects.iter().map(|o| o.id).collect();
        ids.dedup();
        assert_eq!(ids, (1..=118).collect::<Vec<u32>>());
    }
}
