//! What is known of a built road: lanes, lines, edges, free space, markers. Everything in world coordinates,
//! metres, at time zero, to a micrometre.

use crate::road::layout::{Driven, LaneKind, LineKind};
use serde::{Deserialize, Serialize};

/// A line in the world.
pub type Polyline = Vec<[f64; 3]>;

/// The labels of a scene file, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RoadTruth {
    /// Name of the scene.
    pub name: String,
    /// Its roads.
    pub roads: Vec<RoadLabel>,
    /// Its rows of markers.
    pub marker_rows: Vec<MarkerRowLabel>,
}

/// What is known of a road.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoadLabel {
    /// Name of the road.
    pub name: String,
    /// Length of its axis, m.
    pub length_m: f64,
    /// The arc length of each point of the polylines of lanes, edges and axis.
    pub s_m: Vec<f64>,
    /// The axis.
    pub axis_m: Polyline,
    /// Curvature of the axis at each point, positive to the left.
    pub curvature_per_m: Vec<f64>,
    /// Left edge of the outermost drivable lanes, m.
    pub left_edge_m: Polyline,
    /// Its right edge.
    pub right_edge_m: Polyline,
    /// Lanes from the left edge to the right.
    pub lanes: Vec<LaneLabel>,
    /// Its painted lines.
    pub lines: Vec<LineLabel>,
    /// Outlines of the drivable surface, counter-clockwise from above; what stands on it is not cut out.
    pub free_space_m: Vec<Polyline>,
}

/// What is known of a lane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneLabel {
    /// Number of the lane.
    pub number: i32,
    /// What it is for.
    pub kind: LaneKind,
    /// Which way it is driven.
    pub driven: Driven,
    /// Width at each `s_m` of the road, m; zero where the lane is not there.
    pub width_m: Vec<f64>,
    /// Its left edge.
    pub left_m: Polyline,
    /// Its middle.
    pub centre_m: Polyline,
    /// Its right edge.
    pub right_m: Polyline,
}

/// What is known of a painted line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LineLabel {
    /// Id of the object that is the paint.
    pub id: u32,
    /// Name of the line.
    pub name: String,
    /// Solid or dashed.
    pub kind: LineKind,
    /// Width of the paint, m.
    pub width_m: f64,
    /// The middle of the line, through its gaps.
    pub points_m: Polyline,
}

/// What is known of a row of markers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerRowLabel {
    /// Name of the row.
    pub name: String,
    /// Name of its road.
    pub road: String,
    /// Spec of the reflector.
    pub reflector: String,
    /// The code word that the gaps spell, over and over.
    pub word: Option<String>,
    /// Its markers.
    pub markers: Vec<MarkerLabel>,
}

/// What is known of a marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerLabel {
    /// Number of its object.
    pub id: u32,
    /// Along the axis, m.
    pub s_m: f64,
    /// Position in the world, m.
    pub position_m: [f64; 3],
    /// Position in the code word of the bit that the gap behind this marker spells.
    pub bit: Option<usize>,
}
