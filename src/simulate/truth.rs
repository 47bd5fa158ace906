//! `truth.json`: what is true of one frame, beside what the radar made of it.

use super::Frame;
use super::lidar::lidar_pose;
use super::thermal_floor::thermal_floor_w;
use crate::adc::synthesis::{Levels, passes};
use crate::base::units::{dbm_from_w, wavenumber};
use crate::detect::bodies::{Bodies, Sight};
use crate::detect::label::object_of;
use crate::engine::Stage;
use crate::road::actors::is_ground;
use crate::road::free_space::{FreeSpace, free_space};
use crate::road::labels::RoadTruth;
use crate::road::near::{LaneLine, LanePlace, LaneTruth, lane_at, lanes_near, lines_near};
use crate::road::{TruthBox, actor_truth, truth_boxes};
use crate::scene::Scene;
use crate::scene::radar::Radar;
use crate::scene::scenario::SitedScenario;
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// Lanes, lines and free space are given this far from the radar.
pub const REACH_M: f64 = 150.0;

/// Position, rotation and motion of a frame of reference in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseRecord {
    /// Position in the world, m.
    pub position_m: [f64; 3],
    /// Quaternion x, y, z, w: rotates from the frame to the world.
    pub rotation_xyzw: [f64; 4],
    /// Velocity in the world, m/s.
    pub velocity_mps: [f64; 3],
    /// Angular velocity in the world, rad/s, right-handed about its direction.
    pub spin_rad_per_s: [f64; 3],
}

/// An actor: a car with its wheels, a reflector, a rail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActorTruth {
    /// Box around all parts along the axes of the first; id, name, class and motion are those of the first part.
    #[serde(flatten)]
    pub whole: TruthBox,
    /// Ids of its objects, the first part first.
    pub parts: Vec<u32>,
    /// How much of it the radar sees.
    #[serde(flatten)]
    pub seen: Visibility,
    /// How much of it is hidden, and outside of the radar's view.
    #[serde(flatten)]
    pub sight: Sight,
}

/// Echoes of an actor in this frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Visibility {
    /// Whether its strongest cell lies above the thermal noise of a cell.
    pub visible: bool,
    /// Echoes of it in the receiver's band.
    pub returns: usize,
    /// Power of the coherent sum of its echoes in the cell of range and range rate where it is largest, mean over channels; None
    /// without echoes.
    pub power_dbm: Option<f64>,
    /// Numbers of its points; None, and no keys in the file, where the frame was made without points.
    #[serde(flatten)]
    pub counts: Option<PointCounts>,
}

/// Points of an actor in a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointCounts {
    /// Points that are labelled with one of its objects and are in place: no ghost, side lobe, folded or aliased point.
    pub points: usize,
    /// Points that are ghosts of it.
    pub ghosts: usize,
    /// Points in the side lobes of its echoes.
    #[serde(default)]
    pub side_lobes: usize,
    /// Points of it that are out of place by a whole ambiguity.
    #[serde(default)]
    pub folded: usize,
    /// Points of its echoes from beyond the sampled band.
    #[serde(default)]
    pub aliased: usize,
}

impl PointCounts {
    fn and(self, other: PointCounts) -> PointCounts {
        PointCounts {
            points: self.points + other.points,
            ghosts: self.ghosts + other.ghosts,
            side_lobes: self.side_lobes + other.side_lobes,
            folded: self.folded + other.folded,
            aliased: self.aliased + other.aliased,
        }
    }
}

impl Visibility {
    /// Nothing seen, of a frame with points or without.
    pub fn unseen(frame: &Frame) -> Visibility {
        let counts = (frame.ran.of(Stage::Labels) > 0).then(PointCounts::default);
        Visibility { counts, ..Visibility::default() }
    }

    /// Combines what two radars see: counts are added, and the stronger power is taken.
    pub fn and(self, other: Visibility) -> Visibility {
        Visibility {
            visible: self.visible || other.visible,
            returns: self.returns + other.returns,
            power_dbm: [self.power_dbm, other.power_dbm].into_iter().flatten().reduce(f64::max),
            counts: [self.counts, other.counts].into_iter().flatten().reduce(PointCounts::and),
        }
    }
}

/// An object of class `marker`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerTruth {
    /// Number of the object.
    pub id: u32,
    /// Place of the marker's origin in the world, m.
    pub position_m: [f64; 3],
    /// The row that it stands in.
    pub row: Option<String>,
    /// The code word that the gaps of its row spell.
    pub word: Option<String>,
    /// Position in the word of the bit that the gap behind it spells.
    pub bit: Option<usize>,
}

/// Content of `truth.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Number of the frame.
    pub frame: u32,
    /// Middle of the frame, from the middle of frame 0.
    pub time_s: f64,
    /// Pose of the vehicle.
    pub ego: PoseRecord,
    /// Pose of the radar.
    pub radar: PoseRecord,
    /// Pose of the lidar, where the scenario asks for its points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lidar: Option<PoseRecord>,
    /// Boxes of all objects in the world, in the order of the scene; those without `part` are whole objects.
    pub boxes: Vec<TruthBox>,
    /// All actors except the ground.
    pub actors: Vec<ActorTruth>,
    /// Lanes within [`REACH_M`] of the radar, where the road is known; the next three have the same extent.
    pub lanes: Vec<LaneTruth>,
    /// Lines of the lanes ahead.
    pub lane_lines: Vec<LaneLine>,
    /// The lane that the ego's origin is in.
    pub ego_lane: Option<LanePlace>,
    /// Free space ahead, where the scenario asks for it.
    pub free_space: Option<FreeSpace>,
    /// Every marker.
    pub markers: Vec<MarkerTruth>,
}

impl Truth {
    /// `scene` is what the frame was made from; `road` its labels, where there are any.
    pub fn new(scenario: &SitedScenario, scene: &Scene, frame: &Frame, road: Option<&RoadTruth>) -> Truth {
        let ego = scenario.ego.pose(frame.time_s);
        let moving = scenario.ego.at(frame.time_s);
        let spin_rad_per_s = moving.spin_rad_per_s.to_array();
        let at = frame.pose.translation_m.truncate();
        let ahead = |rotation: glam::DQuat| {
            let x = rotation * DVec3::X;
            x.y.atan2(x.x)
        };
        let radar = &scenario.radars[frame.radar];
        let seen = visibility(radar, frame, scene);
        let bodies = Bodies::new(scene, frame.time_s, &frame.pose);
        let actors = actor_truth(scene, frame.time_s)
            .into_iter()
            .filter(|(_, whole)| !is_ground(&whole.class))
            .map(|(b, whole)| ActorTruth {
                sight: bodies.sight(whole.id, radar),
                seen: seen.get(&whole.id).copied().unwrap_or(Visibility::unseen(frame)),
                parts: b.parts.iter().map(|i| scene.objects[*i].id).collect(),
                whole,
            });
        Truth {
            frame: frame.index,
            time_s: frame.time_s,
            ego: PoseRecord {
                position_m: ego.translation_m.to_array(),
                rotation_xyzw: ego.rotation.to_array(),
                velocity_mps: moving.velocity_mps.to_array(),
                spin_rad_per_s,
            },
            radar: PoseRecord {
                position_m: frame.pose.translation_m.to_array(),
                rotation_xyzw: frame.pose.rotation.to_array(),
                velocity_mps: frame.velocity_mps.to_array(),
                spin_rad_per_s,
            },
            lidar: scenario.output.lidar.then(|| {
                let (pose, velocity_mps) = lidar_pose(&scenario.lidar, &scenario.ego, frame.time_s);
                PoseRecord {
                    position_m: pose.translation_m.to_array(),
                    rotation_xyzw: pose.rotation.to_array(),
                    velocity_mps: velocity_mps.to_array(),
                    spin_rad_per_s,
                }
            }),
            boxes: truth_boxes(scene, frame.time_s),
            actors: actors.collect(),
            lanes: lanes_of(frame, road),
            lane_lines: road.map_or_else(Vec::new, |r| lines_near(r, at, REACH_M)),
            ego_lane: road.and_then(|r| lane_at(r, ego.translation_m, ahead(ego.rotation))),
            free_space: road
                .map(|r| free_space(r, scene, frame.time_s, at, ahead(frame.pose.rotation), REACH_M)),
            markers: markers(scene, frame.time_s, road),
        }
    }
}

/// The lanes around a frame's radar.
pub fn lanes_of(frame: &Frame, road: Option<&RoadTruth>) -> Vec<LaneTruth> {
    road.map_or_else(Vec::new, |r| lanes_near(r, frame.pose.translation_m.truncate(), REACH_M))
}

fn markers(scene: &Scene, time_s: f64, road: Option<&RoadTruth>) -> Vec<MarkerTruth> {
    let rows = road.into_iter().flat_map(|r| &r.marker_rows);
    let known: HashMap<u32, _> =
        rows.flat_map(|r| r.markers.iter().map(move |m| (m.id, (r, m.bit)))).collect();
    let of = |o: &crate::scene::Object| {
        let row = known.get(&o.id);
        MarkerTruth {
            id: o.id,
            position_m: o.at(time_s).translation_m.to_array(),
            row: row.map(|(r, _)| r.name.clone()),
            word: row.and_then(|(r, _)| r.word.clone()),
            bit: row.and_then(|(_, bit)| *bit),
        }
    };
    scene.objects.iter().filter(|o| o.class == "marker").map(of).collect()
}

/// What came back from each object, by its id: from a whole with all of its parts, from any other part alone. Objects
/// without echoes and points are left out.
pub fn visibility(radar: &Radar, frame: &Frame, scene: &Scene) -> BTreeMap<u32, Visibility> {
    let (mut head, mut class) = (HashMap::new(), HashMap::new());
    for parts in crate::road::actors::actors(&scene.objects) {
        for i in &parts {
            let o = &scene.objects[*i];
            head.insert(o.id, scene.objects[parts[0]].id);
            class.insert(o.id, o.class.as_str());
        }
    }
    let k = wavenumber(radar.sample_centre_hz());
    let levels = Levels::new(radar);
    let (range_m, rate_mps) = (radar.range_bin_m(), radar.velocity_bin_mps());
    let cell = |x: f64, bin: f64| if bin.is_finite() && bin > 0.0 { (x / bin).round() as i64 } else { 0 };
    // An echo counts for its whole, and for the part that it came from.
    let counts = |object: u32| {
        let whole = head.get(&object).copied();
        let part = Some(object).filter(|id| whole.is_some_and(|whole| whole != *id));
        whole.into_iter().chain(part)
    };
    // (object, range cell, rate cell) and the amplitude of each echo.
    let mut echoes: Vec<((u32, i64, i64), Complex64)> = frame
        .echoes
        .list
        .par_iter()
        .filter(|r| passes(radar, r))
        .flat_map_iter(|r| {
            let place = (cell(r.range_m(), range_m), cell(r.range_rate_mps(), rate_mps));
            let amplitude = levels.amplitude(r) * Complex64::cis(-k * r.path_length_m);
            counts(object_of(r, |id| class.get(&id).copied().unwrap_or("")))
                .map(move |id| ((id, place.0, place.1), amplitude))
        })
        .collect();
    // Stable, so that sums repeat.
    echoes.par_sort_by_key(|e| e.0);
    let floor_w = thermal_floor_w(radar).unwrap_or(0.0);
    let mut out = BTreeMap::<u32, Visibility>::new();
    for run in echoes.chunk_by(|a, b| a.0 == b.0) {
        let power_w = run.iter().map(|e| e.1).sum::<Complex64>().norm_sqr();
        let seen = out.entry(run[0].0.0).or_insert(Visibility::unseen(frame));
        seen.returns += run.len();
        seen.visible |= power_w > floor_w;
        let power_dbm = dbm_from_w(power_w);
        if power_dbm.is_finite() && seen.power_dbm.is_none_or(|p| power_dbm > p) {
            seen.power_dbm = Some(power_dbm);
        }
    }
    for p in &frame.points {
        for id in counts(p.object_id) {
            let seen = out.entry(id).or_insert(Visibility::unseen(frame));
            let counts = seen.counts.get_or_insert_default();
            let n = match (p.ghost, p.side_lobe, p.folded, p.aliased) {
                (true, ..) => &mut counts.ghosts,
                (_, true, ..) => &mut counts.side_lobes,
                (_, _, true, _) => &mut counts.folded,
                (.., true) => &mut counts.aliased,
                (false, false, false, false) => &mut counts.points,
            };
            *n += 1;
        }
    }
    out
}
