//! How much of a box other boxes hide from a place: what nuScenes calls visibility and KITTI calls occlusion.

use super::SweepBox;
use super::class::road_user;
use glam::DVec3;

/// Places along each side of a face that are looked at.
const PLACES: usize = 12;

/// Share of the box number `at` that nothing hides from `eye_m` (world, m): of the solid angle of the faces that look towards the
/// eye, the part whose lines of sight meet no other road user's box, 0 to 1. Other things (rails, walls, ground) hide nothing,
/// since the boxes around them are far larger than they are. An eye inside the box sees all of it.
pub fn share_seen(boxes: &[SweepBox], at: usize, eye_m: DVec3) -> f64 {
    let b = &boxes[at];
    let half = 0.5 * b.size_m;
    let eye = b.rotation.inverse() * (eye_m - b.centre_m);
    let others: Vec<&SweepBox> = boxes
        .iter()
        .enumerate()
        .filter(|(i, other)| *i != at && road_user(&other.class).is_some())
        .map(|(_, other)| other)
        .collect();
    let (mut seen, mut all) = (0.0, 0.0);
    for axis in 0..3 {
        if eye[axis].abs() <= half[axis] {
            continue;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..PLACES * PLACES {
            let step = |k: usize| (2.0 * (k as f64 + 0.5) / PLACES as f64) - 1.0;
            let mut place = DVec3::ZERO;
            place[axis] = half[axis].copysign(eye[axis]);
            place[u] = half[u] * step(i / PLACES);
            place[v] = half[v] * step(i % PLACES);
            let way = eye - place;
            // Solid angle of this piece of the face.
            let angle = half[u] * half[v] * way[axis].abs() / way.length().powi(3);
            all += angle;
            let place_m = b.centre_m + b.rotation * place;
            if !others.iter().any(|other| meets(other, eye_m, place_m)) {
                seen += angle;
            }
        }
    }
    if all > 0.0 { seen / all } else { 1.0 }
}

/// Whether the straight way between two places goes through a box.
fn meets(b: &SweepBox, from_m: DVec3, to_m: DVec3) -> bool {
    let inside = |p: DVec3| b.rotation.inverse() * (p - b.centre_m);
    let (from, to) = (inside(from_m), inside(to_m));
    let half = 0.5 * b.size_m;
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for axis in 0..3 {
        let along = to[axis] - from[axis];
        if along == 0.0 {
            if from[axis].abs() >= half[axis] {
                return false;
            }
            continue;
        }
        let ends = [(-half[axis] - from[axis]) / along, (half[axis] - from[axis]) / along];
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
    }
    first < last
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn car(x: f64, y: f64, width: f64) -> SweepBox {
        SweepBox {
            id: 1,
            class: "car".into(),
            centre_m: DVec3::new(x, y, 0.0),
            size_m: DVec3::new(1.0, width, 2.0),
            rotation: DQuat::IDENTITY,
            velocity_mps: DVec3::ZERO,
            moving: false,
        }
    }

    #[test]
    fn a_nearer_car_hides_what_stands_behind_it() {
        let far = car(40.0, 0.0, 2.0);
        let seen = |nearer: SweepBox| share_seen(&[far.clone(), nearer], 0, DVec3::ZERO);
        assert_eq!(seen(car(20.0, 9.0, 2.0)), 1.0);
        assert_eq!(seen(car(20.0, 0.0, 2.0)), 0.0);
        // Behind it, and the wall beside the road, hide nothing.
        assert_eq!(seen(car(60.0, 0.0, 9.0)), 1.0);
        assert_eq!(seen(SweepBox { class: "wall".into(), ..car(20.0, 0.0, 9.0) }), 1.0);
        // Its right edge at y = 0 hides the left half.
        assert!((seen(car(20.0, 1.0, 2.0)) - 0.5).abs() < 1e-9);
        assert_eq!(share_seen(&[far], 0, DVec3::new(40.0, 0.0, 0.0)), 1.0);
    }

    /// Turning the whole scene changes nothing.
    #[test]
    fn shares_turn_with_the_scene() {
        let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_y(0.2);
        let place = DVec3::new(-3.0, 8.0, 1.0);
        let turned =
            |b: SweepBox| SweepBox { centre_m: place + turn * b.centre_m, rotation: turn * b.rotation, ..b };
        let boxes = [turned(car(40.0, 0.0, 2.0)), turned(car(20.0, 1.25, 2.0))];
        // Its corner at (20.5, 0.25) throws its shadow to y = 0.482 on the face at 39.5 m: three of twelve columns of places.
        let seen = share_seen(&boxes, 0, place);
        assert!((seen - 0.75).abs() < 2e-3, "{seen}");
    }
}
