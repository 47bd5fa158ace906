//! Whether a radar stands where one can stand: not under the road, not inside a body.

use crate::base::error::{BadInput, Result};
use crate::scene::scenario::SitedScenario;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;
use std::f64::consts::PI;

/// How deep in a body a radar has to be, m: it may be mounted on one, and in its skin.
const DEPTH_M: f64 = 0.05;
/// Bodies that are longer are halls and tunnels, in which a vehicle may be.
const LONGEST_BODY_M: f64 = 25.0;

/// Checks where the radars of a scenario stand.
///
/// # Errors
/// Returns an error if in the first or the last frame a radar is inside a body that does not move with its vehicle, or
/// right under a surface that faces up with nothing beneath.
pub fn check(scenario: &SitedScenario, scene: &Scene) -> Result<()> {
    let last = scenario.frames.count.saturating_sub(1);
    for frame in if last == 0 { vec![0] } else { vec![0, last] } {
        let time_s = scenario.frames.time_s(frame);
        for radar in &scenario.radars {
            let at = scenario.ego.pose(time_s).point(radar.on_vehicle(time_s).translation_m);
            let velocity_mps = scenario.ego.at(time_s).velocity_mps;
            let Some(problem) = wrong(scene, at, velocity_mps, time_s) else { continue };
            return Err(BadInput::new(format!("radar '{}' is {problem} in frame {frame}", radar.name))
                .key("ego.position_m and the radar's mounting")
                .value(format!("[{:.2}, {:.2}, {:.2}] in the world", at.x, at.y, at.z))
                .remedy("move the vehicle or the radar's mounting")
                .into());
        }
    }
    Ok(())
}

/// What is wrong with a radar at a place.
fn wrong(scene: &Scene, at: DVec3, velocity_mps: DVec3, time_s: f64) -> Option<String> {
    // (height over the radar, seen from behind, object) of the nearest surface above.
    let mut above: Option<(f64, bool, usize)> = None;
    let mut beneath = false;
    for (i, o) in scene.objects.iter().enumerate() {
        let Shape::Mesh(m) = o.shape else { continue };
        let mesh = &scene.meshes[m];
        let now = o.at(time_s);
        let (rotation, place) = (now.rotation.inverse(), now.translation_m);
        let (local, up) = (rotation * (at - place), rotation * DVec3::Z);
        // What goes along with the vehicle is the vehicle.
        let own = velocity_mps != DVec3::ZERO && (now.velocity_mps - velocity_mps).length() < 1e-6;
        if !own && inside(mesh, local) {
            return Some(format!("inside object '{}' ({})", o.name, o.class));
        }
        for t in &mesh.triangles {
            let corners = t.map(|v| mesh.positions_m[v as usize]);
            let Some((height_m, behind)) = crossing(corners, local, up) else { continue };
            beneath |= height_m < 1e-4;
            if height_m >= 1e-4 && above.is_none_or(|(least, ..)| height_m < least) {
                above = Some((height_m, behind, i));
            }
        }
    }
    match above {
        Some((height_m, true, i)) if !beneath => {
            let o = &scene.objects[i];
            Some(format!("{height_m:.3} m under object '{}' ({})", o.name, o.class))
        }
        _ => None,
    }
}

/// Whether a place is inside a mesh, and farther than [`DEPTH_M`] from its surface along its axes.
fn inside(mesh: &Mesh, at: DVec3) -> bool {
    let Some((low, high)) = mesh.positions_m.iter().fold(None, |b: Option<(DVec3, DVec3)>, p| {
        Some(b.map_or((*p, *p), |(low, high)| (low.min(*p), high.max(*p))))
    }) else {
        return false;
    };
    if (high - low).max_element() > LONGEST_BODY_M || at.cmplt(low).any() || at.cmpgt(high).any() {
        return false;
    }
    let around = [DVec3::ZERO, DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    around.iter().all(|d| winding(mesh, at + DEPTH_M * d) > 0.75)
}

/// How often the surface goes round a place: 1 inside a closed body, 0 outside (A. Jacobson et al., 2013; solid angles after
/// A. van Oosterom and J. Strackee, 1983).
fn winding(mesh: &Mesh, at: DVec3) -> f64 {
    let half = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions_m[v as usize] - at);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let down = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(down)
    };
    mesh.triangles.iter().map(half).sum::<f64>() / (2.0 * PI)
}

/// Where the line through a place along `up` crosses a triangle, and whether going up it comes from behind.
fn crossing([a, b, c]: [DVec3; 3], at: DVec3, up: DVec3) -> Option<(f64, bool)> {
    let (e, f) = (b - a, c - a);
    let normal = e.cross(f);
    let slope = normal.dot(up);
    if slope.abs() <= 1e-9 * normal.length() {
        return None;
    }
    let q = (at - a).cross(up);
    let (u, v) = (-f.dot(q) / slope, e.dot(q) / slope);
    let hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    hit.then(|| ((a - at).dot(normal) / slope, slope > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Mesh {
        let positions_m =
            (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Mesh { positions_m, triangles, ..Default::default() }
    }

    #[test]
    fn a_cube_holds_its_middle() {
        let c = cube();
        assert!((winding(&c, DVec3::splat(0.4)) - 1.0).abs() < 1e-9);
        assert!(winding(&c, DVec3::new(0.4, 0.4, 1.2)).abs() < 1e-9);
        assert!(inside(&c, DVec3::splat(0.4)));
        // On its skin, and just behind it.
        assert!(!inside(&c, DVec3::new(0.4, 0.5, 0.99)) && !inside(&c, DVec3::new(0.4, 0.5, 1.01)));
        // Seen from inside, a room.
        let room = Mesh { triangles: c.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect(), ..c };
        assert!(!inside(&room, DVec3::splat(0.4)));
    }

    #[test]
    fn lines_cross_triangles_from_both_sides() {
        let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(crossing(t, DVec3::new(0.2, 0.2, -2.0), DVec3::Z), Some((2.0, true)));
        assert_eq!(crossing(t, DVec3::new(0.2, 0.2, 3.0), DVec3::Z), Some((-3.0, true)));
        assert_eq!(crossing([t[0], t[2], t[1]], DVec3::new(0.2, 0.2, -2.0), DVec3::Z), Some((2.0, false)));
        assert_eq!(crossing(t, DVec3::new(0.9, 0.9, -2.0), DVec3::Z), None);
        assert_eq!(crossing(t, DVec3::new(0.2, 0.2, -2.0), DVec3::X), None);
    }
}
