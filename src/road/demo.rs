//! The built-in marked road: what `catseye demo` shows.
//!
//! A straight carriageway of two lanes, 100 m along x from x = 0, both lanes driven towards +x. Rows of
//! low-profile reflectors on its three lane lines look back at the traffic; guard rails run along
//! both sides.

use crate::base::error::Result;
use crate::base::frames::Pose;
use crate::road::labels::{LaneLabel, LineLabel, MarkerLabel, MarkerRowLabel, RoadLabel, RoadTruth};
use crate::road::layout::{Driven, LaneKind, LineKind};
use crate::road::materials::MaterialLookup;
use crate::road::objects::{CarMaterials, ground, passenger_car, u_post, verge, w_beam};
use crate::road::reflector::Reflector;
use crate::scene::{Scene, Shape};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Length of the road, m.
pub const ROAD_LENGTH_M: f64 = 100.0;
/// Width of a lane, m.
pub const LANE_WIDTH_M: f64 = 3.5;
/// The lane lines, left to right.
pub const LANE_LINES_Y_M: [f64; 3] = [LANE_WIDTH_M, 0.0, -LANE_WIDTH_M];
/// Centres of the lanes, left to right; the ego drives in the right one.
pub const LANE_CENTRES_Y_M: [f64; 2] = [0.5 * LANE_WIDTH_M, -0.5 * LANE_WIDTH_M];
/// Half the paved width: two lanes and a metre of shoulder on each side.
pub const PAVED_HALF_WIDTH_M: f64 = 4.5;
/// Back of the guard rails' beams.
pub const RAIL_Y_M: f64 = 5.0;
/// Height of the rail's middle, m.
pub const RAIL_CENTRE_HEIGHT_M: f64 = 0.6;
/// Distance from post to post, m.
pub const POST_SPACING_M: f64 = 4.0;
/// Distance from marker to marker, m.
pub const MARKER_SPACING_M: f64 = 5.0;
/// The reflector of the markers: sample GH10 of Feng 2019, table 4.1. It is 2.6 wavelengths high, where
/// physical optics is good to about 2 dB; lower ones are not.
pub const MARKER: &str = "type1:width_m=0.16,height_m=0.01,length_m=0.117";
/// Thickness of the road marking that carries the reflectors, which keeps their bottom plates out of
/// the plane of the road.
pub const MARKER_LIFT_M: f64 = 0.002;
/// Names that the scene asks the lookup for.
pub const MATERIALS: [&str; 6] = ["pec", "steel", "asphalt", "grass", "glass", "rubber"];

/// The scene, at rest but for one car; classes `road`, `verge`, `guard_rail`, `post`, `marker`,
/// `manhole`, `car`. Fails only when the lookup lacks one of [`MATERIALS`].
///
/// # Errors
/// Returns an error for a material that `materials` does not have.
pub fn marked_road(materials: MaterialLookup) -> Result<Scene> {
    let mut scene = Scene::default();
    let mut index = |name: &str| materials(name).map(|m| scene.material_index(&m));
    let (steel, asphalt, grass) = (index("steel")?, index("asphalt")?, index("grass")?);
    let car = CarMaterials { body: steel, glass: index("glass")?, tyre: index("rubber")? };

    let (half, end) = (PAVED_HALF_WIDTH_M, ROAD_LENGTH_M);
    let paved = ground(DVec2::new(0.0, -half), DVec2::new(end, half), 0.0, asphalt);
    scene.add_mesh("road", "road", paved, Pose::IDENTITY);
    scene.add_mesh("verge left", "verge", verge((0.0, end), half, 20.0, grass), Pose::IDENTITY);
    scene.add_mesh("verge right", "verge", verge((0.0, end), -half, -20.0, grass), Pose::IDENTITY);

    scene.meshes.push(w_beam(end, steel));
    let beam = Shape::Mesh(scene.meshes.len() - 1);
    scene.meshes.push(u_post(0.10, 0.06, 0.75, steel));
    let post = Shape::Mesh(scene.meshes.len() - 1);
    let posts = (end / POST_SPACING_M).floor() as usize;
    for (name, side) in [("left", 1.0), ("right", -1.0)] {
        // The beam's own +y is its traffic side.
        let yaw = if side > 0.0 { PI } else { 0.0 };
        let at = DVec3::new(0.5 * end, side * RAIL_Y_M, RAIL_CENTRE_HEIGHT_M);
        let pose = Pose::from_yaw_pitch_roll(at, yaw, 0.0, 0.0);
        scene.add_object(&format!("rail {name}"), "guard_rail", beam, pose, DVec3::ZERO);
        for i in 0..=posts {
            // Behind the beam, open to the coming traffic, foot in the verge.
            let at = DVec3::new(POST_SPACING_M * i as f64, side * (RAIL_Y_M + 0.06), -0.12);
            let pose = Pose::from_yaw_pitch_roll(at, PI, 0.0, 0.0);
            scene.add_object(&format!("post {name} {i}"), "post", post, pose, DVec3::ZERO);
        }
    }

    let marker = Reflector::parse(MARKER)?;
    let mut marker_shape = None;
    for (name, y) in ["left", "middle", "right"].iter().zip(LANE_LINES_Y_M) {
        for i in 1..=(end / MARKER_SPACING_M).floor() as usize {
            // Apex at the back, boresight (+x of the target frame) turned to the coming traffic.
            let at = DVec3::new(MARKER_SPACING_M * i as f64, y, MARKER_LIFT_M);
            let pose = Pose::from_yaw_pitch_roll(at, PI, 0.0, 0.0);
            let name = format!("marker {name} {i}");
            match marker_shape {
                Some(shape) => {
                    scene.add_object(&name, "marker", shape, pose, DVec3::ZERO);
                }
                None => {
                    marker.add_to(&mut scene, materials, (&name, "marker"), pose, DVec3::ZERO)?;
                    marker_shape = scene.objects.last().map(|o| o.shape);
                }
            }
        }
    }

    let at = |x: f64, y: f64| Pose::from_yaw_pitch_roll(DVec3::new(x, y, 0.0), 0.0, 0.0, 0.0);
    let manhole = Reflector::parse("manhole-round:material=steel")?;
    manhole.add_to(
        &mut scene,
        materials,
        ("manhole", "manhole"),
        at(23.0, LANE_CENTRES_Y_M[1]),
        DVec3::ZERO,
    )?;

    scene.meshes.push(passenger_car(car));
    let car = Shape::Mesh(scene.meshes.len() - 1);
    let forward = DVec3::new(14.0, 0.0, 0.0);
    scene.add_object("car overtaking", "car", car, at(33.0, LANE_CENTRES_Y_M[0]), forward);
    scene.add_object("car standing", "car", car, at(62.0, LANE_CENTRES_Y_M[1]), DVec3::ZERO);
    scene.import.triangles = scene.triangle_count();
    Ok(scene)
}

/// The labels of [`marked_road`]; `scene` is that, or begins with it. Its lane lines are rows of markers, without paint.
pub fn truth(scene: &Scene) -> RoadTruth {
    const AXIS: &str = "marked road";
    let line = |y: f64| vec![[0.0, y, 0.0], [ROAD_LENGTH_M, y, 0.0]];
    let lane = |number: i32, kind, left: f64, right: f64| LaneLabel {
        number,
        kind,
        driven: Driven::Forward,
        width_m: vec![left - right; 2],
        left_m: line(left),
        centre_m: line(0.5 * (left + right)),
        right_m: line(right),
    };
    let [left, middle, right] = LANE_LINES_Y_M;
    let half = PAVED_HALF_WIDTH_M;
    let names = ["left", "middle", "right"];
    let painted = |(name, y): (&str, f64)| LineLabel {
        id: 0,
        name: name.into(),
        kind: LineKind::None,
        width_m: 0.0,
        points_m: line(y),
    };
    let outline = [(0.0, -half), (ROAD_LENGTH_M, -half), (ROAD_LENGTH_M, half), (0.0, half)];
    let road = RoadLabel {
        name: AXIS.into(),
        length_m: ROAD_LENGTH_M,
        s_m: vec![0.0, ROAD_LENGTH_M],
        axis_m: line(0.0),
        curvature_per_m: vec![0.0; 2],
        left_edge_m: line(half),
        right_edge_m: line(-half),
        lanes: vec![
            lane(1, LaneKind::Shoulder, half, left),
            lane(2, LaneKind::Driving, left, middle),
            lane(3, LaneKind::Driving, middle, right),
            lane(4, LaneKind::Shoulder, right, -half),
        ],
        lines: names.into_iter().zip(LANE_LINES_Y_M).map(painted).collect(),
        free_space_m: vec![outline.map(|(x, y)| [x, y, 0.0]).to_vec()],
    };
    let row = |name: &str| {
        let mine = scene.objects.iter().filter(|o| o.name.starts_with(&format!("marker {name} ")));
        let marker = |o: &crate::scene::Object| MarkerLabel {
            id: o.id,
            s_m: o.pose.translation_m.x,
            position_m: o.pose.translation_m.to_array(),
            bit: None,
        };
        MarkerRowLabel {
            name: name.into(),
            road: AXIS.into(),
            reflector: MARKER.into(),
            word: None,
            markers: mine.map(marker).collect(),
        }
    };
    RoadTruth { name: AXIS.into(), roads: vec![road], marker_rows: names.map(row).to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::truth_boxes;
    use crate::scene::Material;

    fn any_material(name: &str) -> Result<Material> {
        assert!(MATERIALS.contains(&name), "{name} is missing from MATERIALS");
        Ok(Material { name: name.into(), ..Material::pec() })
    }

    #[test]
    fn objects_classes_and_counts() {
        let s = marked_road(&any_material).unwrap();
        let count = |class: &str| s.objects.iter().filter(|o| o.class == class).count();
        let expected = [
            ("road", 1),
            ("verge", 2),
            ("guard_rail", 2),
            ("post", 52),
            ("marker", 60),
            ("manhole", 1),
            ("car", 2),
        ];
        for (class, n) in expected {
            assert_eq!(count(class), n, "{class}");
        }
        assert_eq!(s.objects.len(), expected.iter().map(|e| e.1).sum::<usize>());
        let mut ids: Vec<u32> = s.objects.iter().map(|o| o.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!((ids.len(), ids[0]), (s.objects.len(), 1));
        let mut names: Vec<&str> = s.objects.iter().map(|o| o.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), s.objects.len());
        assert_eq!(s.objects.iter().filter(|o| o.velocity_mps != DVec3::ZERO).count(), 1);
        assert_eq!(s.meshes.len(), 8, "posts, beams, markers and cars share their meshes");
        assert_eq!(s.import.triangles, s.triangle_count());
        assert!((1_000..20_000).contains(&s.triangle_count()), "{}", s.triangle_count());
        let used = |i: u32| s.meshes.iter().any(|m| m.material.contains(&i));
        assert!((0..s.materials.len() as u32).all(used) && s.materials.len() == MATERIALS.len());
    }

    #[test]
    fn labels_are_those_of_the_scene() {
        let s = marked_road(&any_material).unwrap();
        let t = truth(&s);
        assert_eq!(t.marker_rows.iter().map(|r| r.markers.len()).collect::<Vec<_>>(), [20; 3]);
        for (row, y) in t.marker_rows.iter().zip(LANE_LINES_Y_M) {
            for (i, m) in row.markers.iter().enumerate() {
                let o = s.object_by_id(m.id).unwrap();
                assert_eq!((o.class.as_str(), o.pose.translation_m.to_array()), ("marker", m.position_m));
                assert_eq!((m.position_m[1], m.s_m), (y, MARKER_SPACING_M * (i + 1) as f64));
            }
        }
        // The cars drive in the middle of lanes.
        for (name, number) in [("car overtaking", 2), ("car standing", 3)] {
            let o = s.objects.iter().find(|o| o.name == name).unwrap();
            let lane = crate::road::near::lane_at(&t, o.pose.translation_m, 0.0).unwrap();
            assert_eq!((lane.number, lane.offset_m, lane.heading_rad), (number, 0.0, 0.0));
        }
    }

    #[test]
    fn markers_look_at_the_ego_and_nothing_overlaps_the_rails() {
        let s = marked_road(&any_material).unwrap();
        for o in s.objects.iter().filter(|o| o.class == "marker" || o.class == "post") {
            assert!((o.pose.direction(DVec3::X) + DVec3::X).length() < 1e-12);
            assert!((o.pose.direction(DVec3::Z) - DVec3::Z).length() < 1e-12);
        }
        let boxes = truth_boxes(&s, 0.0);
        for b in boxes.iter().filter(|b| b.class == "marker") {
            // The opening lies in front of the apex, towards the ego.
            let o = s.object_by_id(b.id).unwrap();
            assert!(b.centre_m[0] < o.pose.translation_m.x);
            assert!(LANE_LINES_Y_M.iter().any(|y| (y - b.centre_m[1]).abs() < 1e-9));
        }
        for b in boxes.iter().filter(|b| b.class == "guard_rail") {
            // 83 mm of profile on the traffic side of the back plane.
            assert!((b.centre_m[1].abs() - (RAIL_Y_M - 0.0415)).abs() < 1e-9);
        }
        for b in boxes.iter().filter(|b| b.class == "post") {
            assert!(b.centre_m[1].abs() - 0.5 * b.size_m[1] > RAIL_Y_M);
        }
        let (lo, hi) = s.bounds_m(0.0).unwrap();
        assert!(lo.x >= -0.1 && hi.x <= 100.1 && hi.y == 20.0 && lo.y == -20.0);
    }
}
