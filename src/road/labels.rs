//! What is known of a built road: lanes, lines, edges, free space, markers. Everything in world coordinates,
//! metres, at time zero, to a micrometre.

use crate::road::layout::{Driven, LaneKind, LineKind};
use serde::{Deserialize, Serialize};

/// A line in the world.
pub type Polyline = Vec<[f64; 3]>;

/// The labels of a scene file, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RoadTruth {
    pub name: String,
    pub roads: Vec<RoadLabel>,
    pub marker_rows: Vec<MarkerRowLabel>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoadLabel {
    pub name: String,
    pub length_m: f64,
    /// The arc length of each point of the polylines of lanes, edges and axis.
    pub s_m: Vec<f64>,
    pub axis_m: Polyline,
    /// Curvature of the axis at each point, positive to the left.
    pub curvature_per_m: Vec<f64>,
    /// Of the outermost drivable lanes.
    pub left_edge_m: Polyline,
    pub right_edge_m: Polyline,
    /// From the left edge to the right.
    pub lanes: Vec<LaneLabel>,
    pub lines: Vec<LineLabel>,
    /// Outlines of the drivable surface, counter-clockwise from above; what stands on it is not cut out.
    pub free_space_m: Vec<Polyline>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneLabel {
    pub number: i32,
    pub kind: LaneKind,
    pub driven: Driven,
    /// At each `s_m` of the road; zero where the lane is not there.
    pub width_m: Vec<f64>,
    pub left_m: Polyline,
    pub centre_m: Polyline,
    pub right_m: Polyline,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LineLabel {
    /// Id of the object that is the paint.
    pub id: u32,
    pub name: String,
    pub kind: LineKind,
    pub width_m: f64,
    /// The middle of the line, through its gaps.
    pub points_m: Polyline,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerRowLabel {
    pub name: String,
    pub road: String,
    /// Spec of the reflector.
    pub reflector: String,
    /// The code word that the gaps spell, over and over.
    pub word: Option<String>,
    pub markers: Vec<MarkerLabel>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerLabel {
    pub id: u32,
    pub s_m: f64,
    pub position_m: [f64; 3],
    /// Position in the code word of the bit that the gap behind this marker spells.
    pub bit: Option<usize>,
}
