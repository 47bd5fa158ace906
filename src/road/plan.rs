//! The plan of a road scene: roads, and what stands on them and beside them, in road coordinates. Names of
//! materials are specs of the table and of the plan's own ones.

use crate::base::error::Result;
use crate::road::layout::{Lateral, LineKind, Paint, Road, Side};
use crate::road::reflector::Reflector;
use crate::scene::drive::Drive;
use crate::scene::{Material, Scene, material};
use std::ops::Range;

/// Default bound on how far a chord lies from the curve that it stands for.
pub const DEFAULT_SAGITTA_M: f64 = 0.005;
/// Default of how long vehicles are under way.
pub const DEFAULT_DURATION_S: f64 = 30.0;

/// A scene of roads.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlan {
    /// Name of the scene.
    pub name: String,
    /// How far facets may lie off curves, m.
    pub sagitta_m: f64,
    /// How long what moves is under way; then it stands still, unless it goes straight on.
    pub duration_s: f64,
    /// Materials of its own, of which surfaces may be.
    pub materials: Vec<Material>,
    /// Its roads.
    pub roads: Vec<RoadPlan>,
    /// What was assumed or left out of its files, one line each.
    pub warnings: Vec<String>,
}

impl ScenePlan {
    /// The material of a spec: one of the plan's own, or of the table.
    ///
    /// # Errors
    /// Returns the errors of [`material::parse_spec`].
    pub fn material(&self, spec: &str) -> Result<Material> {
        material::parse_spec_among(spec, &self.materials)
    }
}

/// A road and what stands on it and beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadPlan {
    /// Axis and lanes.
    pub road: Road,
    /// Painted lines.
    pub lines: Vec<LinePlan>,
    /// Ground beside it.
    pub verges: Vec<VergePlan>,
    /// Guard rails.
    pub rails: Vec<RailPlan>,
    /// Walls and kerbs.
    pub walls: Vec<WallPlan>,
    /// Fences.
    pub fences: Vec<FencePlan>,
    /// Gantries.
    pub gantries: Vec<GantryPlan>,
    /// Rows of reflectors.
    pub rows: Vec<RowPlan>,
    /// Single objects.
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

/// A painted line.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePlan {
    /// Where it runs.
    pub lateral: Lateral,
    /// Solid or dashed.
    pub kind: LineKind,
    /// How it is painted.
    pub paint: Paint,
    /// Material of the road under it.
    pub under: String,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Side and index of a lane whose outer edge it marks: there is no line where that lane is too narrow for it, and
    /// at the edge of the pavement it is painted inside.
    pub of_lane: Option<(Side, usize)>,
}

/// A sheet of ground beside the outermost lane that falls over its first metre and goes on level.
#[derive(Debug, Clone, PartialEq)]
pub struct VergePlan {
    /// The side of the road on which it lies.
    pub side: Side,
    /// Width, m.
    pub width_m: f64,
    /// How far it falls, m.
    pub drop_m: f64,
    /// Material of the ground.
    pub material: String,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
}

/// A W-beam as a sheet, with U-shaped posts behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct RailPlan {
    /// Lateral position of the back of the beam.
    pub lateral: Lateral,
    /// Side on which the traffic is.
    pub faces: Side,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Height of the beam's upper edge, m.
    pub height_m: f64,
    /// Distance between posts, m; 0 is without posts.
    pub post_spacing_m: f64,
    /// Material of the rail.
    pub material: String,
}

/// A wall or kerb of rectangular section.
#[derive(Debug, Clone, PartialEq)]
pub struct WallPlan {
    /// Class of the object.
    pub class: &'static str,
    /// Lateral position of the wall's centre line.
    pub lateral: Lateral,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Height, m.
    pub height_m: f64,
    /// Thickness, m.
    pub thickness_m: f64,
    /// Material of the wall.
    pub material: String,
}

/// A fence of square posts with horizontal bars.
#[derive(Debug, Clone, PartialEq)]
pub struct FencePlan {
    /// Where it runs.
    pub lateral: Lateral,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Height, m.
    pub height_m: f64,
    /// Distance from post to post, m.
    pub post_spacing_m: f64,
    /// Width of a post, m.
    pub post_m: f64,
    /// Number of bars.
    pub bars: u32,
    /// Width of a bar, m.
    pub bar_m: f64,
    /// Material of the fence.
    pub material: String,
}

/// A gantry: a beam across the road on two legs.
#[derive(Debug, Clone, PartialEq)]
pub struct GantryPlan {
    /// Place along the axis, m.
    pub s_m: f64,
    /// Where one leg stands.
    pub from: Lateral,
    /// Where the other leg stands.
    pub to: Lateral,
    /// Height under the beam, m.
    pub clearance_m: f64,
    /// Height of the beam, m.
    pub beam_m: f64,
    /// Material of the gantry.
    pub material: String,
}

/// Gaps between the reflectors of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Spacing {
    /// All gaps are alike.
    Even {
        /// Gap, m.
        spacing_m: f64,
        /// Number of reflectors; None to the end of the span.
        count: Option<usize>,
    },
    /// Each gap stands once in this list, m.
    Gaps(Vec<f64>),
    /// A gap for each bit; after a word the gap `sync_m`, where there is one; over and over.
    Code {
        /// Bits of the word.
        word: Vec<bool>,
        /// Gap of a 0, m.
        zero_m: f64,
        /// Gap of a 1, m.
        one_m: f64,
        /// Gap after a word, m.
        sync_m: Option<f64>,
    },
}

/// A row of reflectors that share a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RowPlan {
    /// Name of the row.
    pub name: String,
    /// Class of its objects.
    pub class: String,
    /// The reflector.
    pub reflector: Reflector,
    /// Where the row runs.
    pub lateral: Lateral,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Gaps between the reflectors.
    pub spacing: Spacing,
    /// Distances count along the row itself; otherwise along the road's axis.
    pub along_row: bool,
    /// Yaw of x against the direction of the road, rad; turned on by `turn_rad` from one to the next.
    pub yaw_rad: f64,
    /// Turn about the vertical, rad.
    pub turn_rad: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Height over the road, m.
    pub lift_m: f64,
    /// Follows the slope of the road; otherwise upright.
    pub lying: bool,
}

/// What an object is made from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A reflector of the library.
    Reflector(Reflector),
    /// A vehicle of the library.
    Vehicle {
        /// Its name in the library.
        kind: String,
        /// dBsm: its echo is that of a point in its middle with this cross section, and the radar sees through its body.
        rcs_dbsm: Option<f64>,
    },
    /// The scene of a file.
    File(Scene),
}

/// One object at a place of the road.
#[derive(Debug, Clone, PartialEq)]
pub struct ThingPlan {
    /// Name of the object.
    pub name: String,
    /// "" leaves the classes of its parts.
    pub class: String,
    /// What it is made from.
    pub source: Source,
    /// Place along the axis, m.
    pub s_m: f64,
    /// Lateral place.
    pub lateral: Lateral,
    /// Turn about the vertical against the axis, rad.
    pub yaw_rad: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Height over the road, m.
    pub lift_m: f64,
    /// Speed along its own x axis, m/s.
    pub speed_mps: f64,
    /// How it goes along the road, in place of that speed.
    pub drive: Option<Drive>,
    /// Whether it goes against the direction of the road.
    pub against: bool,
    /// Whether it follows the slopes of the road.
    pub lying: bool,
}

impl ThingPlan {
    /// Speed at time zero along the thing's own x axis, m/s.
    pub fn first_speed_mps(&self) -> f64 {
        self.drive.as_ref().map_or(self.speed_mps, |d| d.speed_mps(0.0))
    }
}
