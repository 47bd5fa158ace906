//! Associates tracks with true vehicles, for the score only; the estimator does not know of it.

use crate::trial::hd_map::traffic::{COUNTED, Group};
use crate::trial::kit::*;
use catseye::road::actor_truth;
use catseye::road::actors::{base_class, is_vehicle};
use catseye_lane::hd_map::Assignment;
use catseye_lane::hd_map::estimator::MapLanes;
use catseye_lane::hd_map::of_road::Stripes;

/// Largest distances along and across a vehicle's box (m), and largest difference from its speed (m/s), of a
/// track that belongs to it.
const ALONG_M: f64 = 3.0;
const ACROSS_M: f64 = 2.5;
const SPEED_MPS: f64 = 6.0;

/// One track of a vehicle at one time.
#[derive(Debug, Clone)]
pub struct Scan {
    pub frame: u32,
    /// Assigned lanes: as set, by the document's rule, and without the step to the vehicle's middle.
    pub given: [Assignment; 3],
    /// Assignment of the vehicle's true position by the same map.
    pub from_truth: Assignment,
    pub true_lane: i32,
    /// Distance of the track from the vehicle's middle, across, towards the radar, m: as tracked, and moved
    /// to the middle.
    pub across_m: [f64; 2],
    /// Distance of the track ahead of the vehicle's middle, m: as tracked, and moved to the middle.
    pub along_m: [f64; 2],
    pub range_m: f64,
    /// Angle between the line of sight and the vehicle's axis, rad, 0 to π/2.
    pub aspect_rad: f64,
    /// Position of the track, moved to the middle, in the level frame, m.
    pub at_m: [f64; 2],
}

/// A vehicle that passed.
#[derive(Debug, Clone)]
pub struct Pass {
    /// Identifier of its first part in the scene.
    pub id: u32,
    pub name: String,
    pub class: String,
    pub counts: bool,
    /// Number of frames in which it was on a lane.
    pub there: u32,
    pub scans: Vec<Scan>,
    /// Outline from above at the last of them, in the level frame, m.
    pub outline_m: [[f64; 2]; 4],
}

/// All vehicles of a group.
pub struct Passes {
    all_count: bool,
    pub vehicles: Vec<Pass>,
    /// Number of tracks that belong to no vehicle, and of those among them that were assigned a lane.
    pub strays: [u32; 2],
}

impl Passes {
    pub fn new(group: &Group) -> Passes {
        Passes { all_count: group.plan.is_none(), vehicles: Vec::new(), strays: [0; 2] }
    }

    /// Processes a look and the assignments of its tracks.
    pub fn look(
        &mut self,
        now: &Now<'_>,
        lanes: &[Stripes],
        look: &SensorInput<'_>,
        own: &mut MapLanes,
        (given, varied): (&[Assignment], &[Vec<Assignment>; 2]),
    ) {
        let (scene, level) = (&now.drive.site.scene, &now.level);
        let boxes: Vec<_> = actor_truth(scene, look.time_s)
            .into_iter()
            .filter(|(_, t)| is_vehicle(&t.class))
            .map(|(outline, t)| {
                let at = DVec2::new(t.centre_m[0], t.centre_m[1]);
                let lane = lanes.iter().find_map(|l| l.lane_at(at));
                (outline, t, at, lane)
            })
            .collect();
        for (outline, t, _, lane) in &boxes {
            // Of ROAD/VEHICLE or ROAD/VEHICLE/PART.
            let name = t.name.split('/').nth(1).unwrap_or(&t.name);
            let pass = match self.vehicles.iter().position(|p| p.id == t.id) {
                Some(i) => &mut self.vehicles[i],
                None => {
                    let counts = self.all_count || name.starts_with(COUNTED);
                    self.vehicles.push(Pass {
                        id: t.id,
                        name: name.into(),
                        class: base_class(&t.class).into(),
                        counts,
                        there: 0,
                        scans: Vec::new(),
                        outline_m: [[0.0; 2]; 4],
                    });
                    self.vehicles.last_mut().expect("one was pushed")
                }
            };
            pass.there += u32::from(lane.is_some());
            pass.outline_m = outline.outline_m().map(|p| level.from_world(DVec2::from_array(p)).to_array());
        }
        for (k, track) in look.tracks.iter().enumerate() {
            let (at, velocity) = (DVec2::from_array(track.at_m), DVec2::from_array(track.velocity_mps));
            let nearest = boxes
                .iter()
                .filter_map(|(_, t, centre, lane)| {
                    let axes = DVec2::from_angle(t.yaw_rad - level.heading_rad);
                    let off = at - level.from_world(*centre);
                    let along = (off.dot(axes).abs() - 0.5 * t.size_m[0]).max(0.0);
                    let across = (off.perp_dot(axes).abs() - 0.5 * t.size_m[1]).max(0.0);
                    let own = DVec2::new(t.velocity_mps[0], t.velocity_mps[1]);
                    let speed = (velocity.dot(axes)
                        - DVec2::from_angle(-level.heading_rad).rotate(own).dot(axes))
                    .abs();
                    let near = along <= ALONG_M && across <= ACROSS_M && speed <= SPEED_MPS;
                    near.then_some((along.hypot(across), t, *centre, axes, lane))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, t, centre, axes, lane)) = nearest else {
                self.strays[0] += 1;
                self.strays[1] += u32::from(given[k].number().is_some());
                continue;
            };
            let Some((true_lane, _)) = lane else { continue };
            let centre = level.from_world(centre);
            let middle = own.middle_m(track);
            let Ok(from_truth) = own.lane_at(look, centre.to_array()) else { continue };
            let radar = own.radar_at_m();
            let side = axes.perp().dot(DVec2::from_array(radar) - centre).signum();
            let off = |p: [f64; 2]| DVec2::from_array(p) - centre;
            let sight = (centre - DVec2::from_array(radar)).normalize_or(DVec2::X);
            if let Some(pass) = self.vehicles.iter_mut().find(|p| p.id == t.id) {
                let index = pass.scans.len();
                let numbered = |a: &Assignment| Assignment { target: index, lane: a.lane.clone() };
                let other = |v: &Vec<Assignment>| v.get(k).map_or_else(|| numbered(&given[k]), &numbered);
                pass.scans.push(Scan {
                    frame: now.frame,
                    given: [numbered(&given[k]), other(&varied[0]), other(&varied[1])],
                    from_truth,
                    true_lane: *true_lane,
                    across_m: [track.at_m, middle].map(|p| side * off(p).dot(axes.perp())),
                    along_m: [track.at_m, middle].map(|p| off(p).dot(axes)),
                    range_m: (centre - DVec2::from_array(radar)).length(),
                    aspect_rad: sight.perp_dot(axes).abs().atan2(sight.dot(axes).abs()),
                    at_m: middle,
                });
            }
        }
    }
}
