//! The plan of a road scene: roads, and what stands on them and beside them, in road coordinates. Names of
//! materials are specs of the table.

use crate::road::layout::{Lateral, LineKind, Paint, Road, Side};
use crate::road::reflector::Reflector;
use crate::scene::Scene;
use crate::scene::drive::Drive;
use std::ops::Range;

/// Default bound on how far a chord lies from the curve that it stands for.
pub const DEFAULT_SAGITTA_M: f64 = 0.005;
/// Default of how long vehicles are under way.
pub const DEFAULT_DURATION_S: f64 = 30.0;

/// A scene of roads.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlan {
    pub name: String,
    pub sagitta_m: f64,
    /// How long what moves is under way; then it stands still, unless it goes straight on.
    pub duration_s: f64,
    pub roads: Vec<RoadPlan>,
}

/// A road and what stands on it and beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadPlan {
    pub road: Road,
    pub lines: Vec<LinePlan>,
    pub verges: Vec<VergePlan>,
    pub rails: Vec<RailPlan>,
    pub walls: Vec<WallPlan>,
    pub fences: Vec<FencePlan>,
    pub gantries: Vec<GantryPlan>,
    pub rows: Vec<RowPlan>,
    pub things: Vec<ThingPlan>,
}

impl RoadPlan {
    /// A road with nothing on it.
    pub fn new(road: Road) -> Self {
        let (lines, verges, rails, walls) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (fences, gantries, rows, things) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        RoadPlan { road, lines, verges, rails, walls, fences, gantries, rows, things }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct LinePlan {
    pub lateral: Lateral,
    pub kind: LineKind,
    pub paint: Paint,
    /// Material of the road under it.
    pub under: String,
    pub span_m: Range<f64>,
}

/// A sheet of ground beside the outermost lane that falls over its first metre and goes on level.
#[derive(Debug, Clone, PartialEq)]
pub struct VergePlan {
    pub side: Side,
    pub width_m: f64,
    pub drop_m: f64,
    pub material: String,
    pub span_m: Range<f64>,
}

/// A W-beam as a sheet, with U-shaped posts behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct RailPlan {
    /// Of the back of the beam.
    pub lateral: Lateral,
    /// Where the traffic is.
    pub faces: Side,
    pub span_m: Range<f64>,
    /// Of the beam's upper edge.
    pub height_m: f64,
    /// 0 is without posts.
    pub post_spacing_m: f64,
    pub material: String,
}

/// A wall or kerb of rectangular section.
#[derive(Debug, Clone, PartialEq)]
pub struct WallPlan {
    pub class: &'static str,
    /// Of its middle.
    pub lateral: Lateral,
    pub span_m: Range<f64>,
    pub height_m: f64,
    pub thickness_m: f64,
    pub material: String,
}

/// Square posts with level bars.
#[derive(Debug, Clone, PartialEq)]
pub struct FencePlan {
    pub lateral: Lateral,
    pub span_m: Range<f64>,
    pub height_m: f64,
    pub post_spacing_m: f64,
    pub post_m: f64,
    pub bars: u32,
    pub bar_m: f64,
    pub material: String,
}

/// A beam over the road on two legs.
#[derive(Debug, Clone, PartialEq)]
pub struct GantryPlan {
    pub s_m: f64,
    pub from: Lateral,
    pub to: Lateral,
    pub clearance_m: f64,
    pub beam_m: f64,
    pub material: String,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Spacing {
    Even {
        spacing_m: f64,
        count: Option<usize>,
    },
    /// Each gap once.
    Gaps(Vec<f64>),
    /// A gap for each bit; after a word the gap `sync_m`, where there is one; over and over.
    Code {
        word: Vec<bool>,
        zero_m: f64,
        one_m: f64,
        sync_m: Option<f64>,
    },
}

/// A row of reflectors that share a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RowPlan {
    pub name: String,
    pub class: String,
    pub reflector: Reflector,
    pub lateral: Lateral,
    pub span_m: Range<f64>,
    pub spacing: Spacing,
    /// Distances count along the row itself; otherwise along the road's axis.
    pub along_row: bool,
    /// Of x against the direction of the road; turned on by `turn_rad` from one to the next.
    pub yaw_rad: f64,
    pub turn_rad: f64,
    pub pitch_rad: f64,
    pub roll_rad: f64,
    pub lift_m: f64,
    /// Follows the slope of the road; otherwise upright.
    pub lying: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    Reflector(Reflector),
    Vehicle(String),
    File(Scene),
}

/// One object at a place of the road.
#[derive(Debug, Clone, PartialEq)]
pub struct ThingPlan {
    pub name: String,
    /// "" leaves the classes of its parts.
    pub class: String,
    pub source: Source,
    pub s_m: f64,
    pub lateral: Lateral,
    pub yaw_rad: f64,
    pub pitch_rad: f64,
    pub roll_rad: f64,
    pub lift_m: f64,
    /// Along its own x.
    pub speed_mps: f64,
    /// Goes along the road; in place of that speed.
    pub drive: Option<Drive>,
    /// Against the direction of the road.
    pub against: bool,
    pub lying: bool,
}

impl ThingPlan {
    /// At time zero, along its own x.
    pub fn first_speed_mps(&self) -> f64 {
        self.drive.as_ref().map_or(self.speed_mps, |d| d.speed_mps(0.0))
    }
}
