//! Tests whether the vehicles of a drawn road overlap or stand bumper to bumper.

use catseye::base::error::Result;
use catseye::base::frames::Pose;
use catseye::road::axis::RoadPoint;
use catseye::road::plan::{ScenePlan, Source};
use catseye::road::traffic::vehicle;
use catseye::road::{site, truth_boxes};
use catseye::scene::material;
use catseye::scene::scenario::Scenario;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Kind that is assumed for the vehicle that carries the radar, and distance of its rear axle behind its
/// middle, m (`road/vehicle/car.rs`).
const EGO: (&str, f64) = ("sedan", 1.30);

/// Free road that every vehicle keeps before and behind it, m: half the least gap of a queue.
const GAP_M: f64 = 1.0;

/// A box that moves straight on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Footprint {
    centre_m: DVec3,
    /// Unit vectors along its axes, in the ground plane.
    axes: [DVec2; 2],
    half_m: DVec3,
    velocity_mps: DVec3,
}

impl Footprint {
    fn new<A, B>(pose: &Pose<A, B>, (lo, hi): (DVec3, DVec3), velocity_mps: DVec3) -> Footprint {
        let ahead = pose.direction(DVec3::X).truncate().normalize_or(DVec2::X);
        Footprint {
            centre_m: pose.point(0.5 * (lo + hi)),
            axes: [ahead, ahead.perp()],
            half_m: 0.5 * (hi - lo) + DVec3::X * GAP_M,
            velocity_mps,
        }
    }

    /// Whether the two overlap at a time (separating axes in plan; heights by their extent).
    fn meets(&self, other: &Footprint, time_s: f64) -> bool {
        let apart =
            (other.centre_m + other.velocity_mps * time_s) - (self.centre_m + self.velocity_mps * time_s);
        if apart.z.abs() > self.half_m.z + other.half_m.z {
            return false;
        }
        let reach = |f: &Footprint, axis: DVec2| {
            f.half_m.x * f.axes[0].dot(axis).abs() + f.half_m.y * f.axes[1].dot(axis).abs()
        };
        self.axes
            .iter()
            .chain(&other.axes)
            .all(|axis| apart.truncate().dot(*axis).abs() < reach(self, *axis) + reach(other, *axis))
    }
}

/// Least and greatest corner of the kinds of vehicles that were looked up.
#[derive(Debug, Clone, Default)]
pub struct Sizes(BTreeMap<String, (DVec3, DVec3)>);

impl Sizes {
    /// Takes over the entries of another.
    pub fn add(&mut self, other: Sizes) {
        if other.0.len() > self.0.len() {
            self.0.extend(other.0);
        }
    }

    fn of(&mut self, kind: &str) -> Result<(DVec3, DVec3)> {
        if let Some(found) = self.0.get(kind) {
            return Ok(*found);
        }
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for b in truth_boxes(&vehicle(kind, &material::by_name)?, 0.0) {
            let (centre, half) = (DVec3::from(b.centre_m), 0.5 * DVec3::from(b.size_m));
            let rotation = glam::DQuat::from_array(b.rotation_xyzw);
            for corner in 0..8 {
                let sign = |bit: i32| if corner & bit == 0 { -1.0 } else { 1.0 };
                let p = centre + rotation * (half * DVec3::new(sign(1), sign(2), sign(4)));
                bounds = (bounds.0.min(p), bounds.1.max(p));
            }
        }
        self.0.insert(kind.to_string(), bounds);
        Ok(bounds)
    }
}

/// Index of a road and of a vehicle on it, in the order of the file.
pub type VehicleAt = (usize, usize);

/// The first two vehicles, in the order of the file, that overlap or are closer than in a queue at the middle
/// of a frame. The first of the pair is None for the vehicle of the scenario, which comes before all.
///
/// # Errors
/// Returns an error for a vehicle whose motion or outline cannot be made.
pub fn first_clash(
    plan: &ScenePlan,
    scenario: &Scenario,
    sizes: &mut Sizes,
) -> Result<Option<(Option<VehicleAt>, VehicleAt)>> {
    let (lo, hi) = sizes.of(EGO.0)?;
    let ahead = DVec3::X * EGO.1;
    let ego = site::ego_on(scenario, plan)?;
    let size = (lo + ahead, hi + ahead);
    let ego = Footprint::new(&ego.pose(0.0), size, ego.at(0.0).velocity_mps);
    let mut known: Vec<(Option<VehicleAt>, Footprint)> = vec![(None, ego)];
    for (i, r) in plan.roads.iter().enumerate() {
        let vehicles = r.things.iter().filter_map(|t| match &t.source {
            Source::Vehicle { kind, .. } => Some((t, kind)),
            _ => None,
        });
        for (j, (t, kind)) in vehicles.enumerate() {
            let place = RoadPoint { s_m: t.s_m, t_m: r.road.t_m(&t.lateral, t.s_m), h_m: t.lift_m };
            let pose = r.road.axis.pose(place, t.yaw_rad, t.lying);
            let new = Footprint::new(&pose, sizes.of(kind)?, t.first_speed_mps() * pose.direction(DVec3::X));
            let frames = 0..scenario.frames.count;
            let clash = known
                .iter()
                .find(|(_, old)| frames.clone().any(|k| old.meets(&new, scenario.frames.time_s(k))));
            if let Some((other, _)) = clash {
                return Ok(Some((*other, (i, j))));
            }
            known.push((Some((i, j)), new));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::frames::{Vehicle, World};

    fn boxed(x: f64, y: f64, yaw: f64, speed: f64) -> Footprint {
        let pose: Pose<Vehicle, World> = Pose::from_yaw_pitch_roll(DVec3::new(x, y, 0.0), yaw, 0.0, 0.0);
        let half = DVec3::new(2.0, 1.0, 0.75);
        Footprint::new(
            &pose,
            (-half + DVec3::X * GAP_M, half - DVec3::X * GAP_M),
            pose.direction(DVec3::X) * speed,
        )
    }

    /// Against points of one box that lie in the other.
    #[test]
    fn boxes_meet_as_their_points_do() {
        let inside = |f: &Footprint, p: DVec2| {
            let d = p - f.centre_m.truncate();
            d.dot(f.axes[0]).abs() <= f.half_m.x && d.dot(f.axes[1]).abs() <= f.half_m.y
        };
        let a = boxed(0.0, 0.0, 0.3, 0.0);
        let (mut met, mut cases) = (0, 0);
        for i in 0..20 {
            for j in 0..20 {
                let b =
                    boxed(-5.0 + 0.5 * f64::from(i), -4.0 + 0.4 * f64::from(j), 0.37 * f64::from(i + j), 0.0);
                let sampled = (0..=40).any(|u| {
                    (0..=20).any(|v| {
                        let at = |f: &Footprint| {
                            f.centre_m.truncate()
                                + f.axes[0] * f.half_m.x * (f64::from(u) / 20.0 - 1.0)
                                + f.axes[1] * f.half_m.y * (f64::from(v) / 10.0 - 1.0)
                        };
                        inside(&a, at(&b)) || inside(&b, at(&a))
                    })
                });
                // Sampling can miss a corner that just touches.
                assert!(a.meets(&b, 0.0) || !sampled);
                cases += usize::from(a.meets(&b, 0.0) != sampled);
                met += usize::from(sampled);
            }
        }
        assert!(met > 50 && cases < 8, "{met} {cases}");
    }

    #[test]
    fn motion_and_height_count() {
        let (a, b) = (boxed(0.0, 0.0, 0.0, 20.0), boxed(30.0, 0.0, 0.0, 10.0));
        assert!(!a.meets(&b, 2.5) && a.meets(&b, 3.0) && !a.meets(&b, 3.5));
        let bridge = Footprint { centre_m: DVec3::Z * 6.0, ..a };
        assert!(!a.meets(&bridge, 0.0));
    }
}
