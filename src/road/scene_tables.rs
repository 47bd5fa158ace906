//! The tables of a road scene file, as they stand in TOML.

use crate::road::layout::{Driven, InLane, LaneKind, LineKind, Side};
use crate::road::traffic::VEHICLES;
use crate::scene::drive::DriveTable;
use crate::scene::toml_file::At;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;

/// Roads with what stands on them. Lengths in metres, angles in degrees; `s_m` is the arc length along a road's
/// axis in plan, `t_m` the distance from the axis, positive to the left.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye road scene")]
pub struct SceneFile {
    /// Shown in results.
    pub name: String,
    /// Greatest distance of a facet from the curve that it stands for; default 0.005.
    pub sagitta_m: Option<At<f64>>,
    /// How long vehicles are under way; default 30. A scenario takes as long as its frames last.
    pub duration_s: Option<At<f64>>,
    pub road: Vec<RoadTable>,
}

/// A number, or pairs [s, value] with straight lines between, constant before the first and behind the last.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series(pub Vec<[f64; 2]>);

impl<'de> Deserialize<'de> for Series {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Series;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or a list of pairs [s, value]")
            }
            fn visit_f64<E>(self, x: f64) -> Result<Series, E> {
                Ok(Series(vec![[0.0, x]]))
            }
            fn visit_i64<E>(self, x: i64) -> Result<Series, E> {
                Ok(Series(vec![[0.0, x as f64]]))
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Series, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = seq.next_element::<[f64; 2]>()? {
                    pairs.push(pair);
                }
                Ok(Series(pairs))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl JsonSchema for Series {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Series".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let pair = generator.subschema_for::<[f64; 2]>();
        schemars::json_schema!({ "anyOf": [{ "type": "number" }, { "type": "array", "items": pair, "minItems": 1 }] })
    }
}

/// Where and how the axis begins: in the world, or at a place of a road that stands before it in the file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartTable {
    /// [forward, left, up] in the world; default the origin.
    pub position_m: Option<At<[f64; 3]>>,
    /// Name of the other road.
    pub road: Option<At<String>>,
    /// Where on the other road.
    pub s_m: Option<At<f64>>,
    pub t_m: Option<At<f64>>,
    /// From world x, or from the other road's direction, to the left.
    #[serde(default)]
    pub heading_deg: At<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElementKind {
    Straight,
    Arc,
    Clothoid,
}

/// An element of the plan. Radii are positive to the left and negative to the right.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementTable {
    pub kind: At<ElementKind>,
    pub length_m: Option<At<f64>>,
    /// Radius of an arc.
    pub radius_m: Option<At<f64>>,
    /// Turn of an arc, in place of its length; positive.
    pub angle_deg: Option<At<f64>>,
    /// Radius at the beginning of a clothoid; default that of the element before.
    pub from_radius_m: Option<At<f64>>,
    /// Radius at the end of a clothoid; default straight.
    pub to_radius_m: Option<At<f64>>,
}

/// Where two grades meet, with a parabola of length K |g1 - g2| between them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradeTable {
    /// Station of the point where the lines of the two grades meet.
    pub s_m: At<f64>,
    /// The grade behind it, positive uphill.
    pub grade_percent: At<f64>,
    /// Metres of curve for each percent of change; default 0, a kink.
    #[serde(default)]
    pub k_m_per_percent: At<f64>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LaneTable {
    /// Default 1, 2, ... on the right and 11, 12, ... on the left, from the axis outwards.
    pub number: Option<At<i32>>,
    /// Default driving.
    pub kind: Option<LaneKind>,
    /// Default forward on the right of the axis and backward on the left.
    pub driven: Option<Driven>,
    pub width_m: At<Series>,
    /// Radar material, or "none"; default the road's.
    pub surface: Option<At<String>>,
    /// Painted on its edge away from the axis; default none.
    #[serde(default)]
    pub line: LineKind,
}

/// How lines are painted.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PaintTable {
    pub width_m: At<f64>,
    pub dash_m: At<f64>,
    pub gap_m: At<f64>,
    /// Height of the paint over the road.
    pub thickness_m: At<f64>,
    /// Radar material of the paint.
    pub material: At<String>,
}

impl Default for PaintTable {
    fn default() -> Self {
        PaintTable {
            width_m: 0.12.into(),
            dash_m: 6.0.into(),
            gap_m: 12.0.into(),
            thickness_m: 0.002.into(),
            material: "paint-white".to_string().into(),
        }
    }
}

/// A lateral place: from the axis, in a lane, or from the edge of the drivable lanes.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LateralTable {
    /// From the axis, positive to the left.
    pub t_m: Option<At<Series>>,
    /// Number of a lane.
    pub lane: Option<At<i32>>,
    /// Where in the lane, seen along the axis; default its centre.
    pub side: Option<At<InLane>>,
    /// The outer edge of the outermost drivable lane.
    pub edge: Option<At<Side>>,
    /// From the lane or edge, positive to the left.
    pub offset_m: Option<At<Series>>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineTable {
    pub lateral: At<LateralTable>,
    pub kind: LineKind,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
    pub paint: Option<PaintTable>,
    /// Radar material of the road under it; default the road's.
    pub under: Option<At<String>>,
}

/// A sheet of ground beside the outermost lane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VergeTable {
    pub side: Side,
    pub width_m: At<f64>,
    /// How far it falls over its first metre; default 0.12.
    pub drop_m: Option<At<f64>>,
    /// Default grass.
    pub material: Option<At<String>>,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
}

/// A W-beam guard rail.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RailTable {
    /// Lateral position of the back of the rail's beam.
    pub lateral: At<LateralTable>,
    /// The side of the traffic; default towards the axis.
    pub faces: Option<Side>,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
    /// Height of the rail's upper edge; default 0.75.
    pub height_m: Option<At<f64>>,
    /// Default 4; 0 is without posts.
    pub post_spacing_m: Option<At<f64>>,
    /// Default steel.
    pub material: Option<At<String>>,
}

/// A sound wall, or a kerb.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallTable {
    /// Lateral position of the wall's middle.
    pub lateral: At<LateralTable>,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
    /// Default 3 (kerb 0.12).
    pub height_m: Option<At<f64>>,
    /// Default 0.2 (kerb 0.15).
    pub thickness_m: Option<At<f64>>,
    /// Default concrete; a metal-faced wall is "aluminium".
    pub material: Option<At<String>>,
}

/// Square posts with level bars.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FenceTable {
    pub lateral: At<LateralTable>,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
    /// Default 1.2.
    pub height_m: Option<At<f64>>,
    /// Default 2.5.
    pub post_spacing_m: Option<At<f64>>,
    /// Edge of a post; default 0.08.
    pub post_m: Option<At<f64>>,
    /// Default 3.
    pub bars: Option<At<u32>>,
    /// Edge of a bar; default 0.04.
    pub bar_m: Option<At<f64>>,
    /// Default steel.
    pub material: Option<At<String>>,
}

/// A beam over the road on two legs.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GantryTable {
    pub s_m: At<f64>,
    /// Lateral position of the gantry's legs: from here to `to`.
    pub from: At<LateralTable>,
    pub to: At<LateralTable>,
    /// Height of the beam's lower side over the road; default 5.5.
    pub clearance_m: Option<At<f64>>,
    /// Edge of the beam's square section; default 0.8.
    pub beam_m: Option<At<f64>>,
    /// Default steel.
    pub material: Option<At<String>>,
}

/// A code word in the gaps between markers.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CodeTable {
    /// Zeros and ones, as in "1011".
    pub word: At<String>,
    /// Gap that is a zero.
    pub zero_m: At<f64>,
    /// Gap that is a one.
    pub one_m: At<f64>,
    /// Gap between a word and the next; default none.
    pub sync_m: Option<At<f64>>,
}

/// A row of reflectors of one kind.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RowTable {
    pub name: Option<String>,
    /// Default marker; others ("pole") are no markers in the labels.
    pub class: Option<String>,
    /// As in `catseye rcs`: "type1:width_m=0.16,height_m=0.004".
    pub reflector: At<String>,
    pub lateral: At<LateralTable>,
    /// Station of the first one; default 0.
    pub from_m: Option<At<f64>>,
    /// None stands behind it; default the end of the road.
    pub to_m: Option<At<f64>>,
    pub spacing_m: Option<At<f64>>,
    pub count: Option<At<u32>>,
    /// In place of the spacing.
    pub gaps_m: Option<At<Vec<f64>>>,
    /// In place of the spacing.
    pub code: Option<CodeTable>,
    /// Whether these distances count along the row itself, which differs from the road's axis in bends. Default false: along the axis.
    #[serde(default)]
    pub along_row: bool,
    /// Yaw of its boresight against the direction of the road; default 180, towards traffic that comes along
    /// it.
    pub yaw_deg: Option<At<f64>>,
    /// Turn from one to the next.
    #[serde(default)]
    pub turn_deg: At<f64>,
    /// Positive nose down; a plate with -90 looks up.
    #[serde(default)]
    pub pitch_deg: At<f64>,
    /// Positive left side up.
    #[serde(default)]
    pub roll_deg: At<f64>,
    /// Height of its origin over the road; default 0.002 for markers, otherwise 0.
    pub lift_m: Option<At<f64>>,
    /// Whether z is straight up also where the road slopes; default false for markers, otherwise true.
    pub upright: Option<bool>,
}

/// A reflector, a manhole, or a glTF file at a place of the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectTable {
    pub name: Option<String>,
    /// Default: what the file says; "manhole" for manholes, "reflector" for others.
    pub class: Option<String>,
    pub reflector: Option<At<String>>,
    /// A .glb, .gltf, .stl or .obj file below the folder of this file.
    pub file: Option<At<String>>,
    /// Unit of the file: m (default of glTF; STL and OBJ need it), cm, mm, in or ft.
    pub unit: Option<At<String>>,
    /// Axis of the file that points up: y (default of glTF; STL and OBJ need it) or z.
    pub up: Option<At<String>>,
    /// Animations of the file that move it: all (default), none, or one by its name.
    pub animation: Option<At<String>>,
    /// For surfaces of the file whose material is missing or unknown.
    pub default_material: Option<At<String>>,
    /// Material of the file = material of the table.
    #[serde(default)]
    pub materials: BTreeMap<String, At<String>>,
    pub s_m: At<f64>,
    pub lateral: At<LateralTable>,
    /// Yaw of its x axis against the direction of the road.
    #[serde(default)]
    pub yaw_deg: At<f64>,
    #[serde(default)]
    pub pitch_deg: At<f64>,
    #[serde(default)]
    pub roll_deg: At<f64>,
    #[serde(default)]
    pub lift_m: At<f64>,
    /// Along its x axis.
    #[serde(default)]
    pub speed_mps: At<f64>,
    #[serde(default)]
    pub upright: bool,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleTable {
    pub name: Option<String>,
    /// What goes there: a vehicle or a person of the library.
    #[schemars(extend("enum" = VEHICLES))]
    pub kind: At<String>,
    /// Station of its middle.
    pub s_m: At<f64>,
    pub lateral: At<LateralTable>,
    /// Against the direction in which its lane is driven (of the road outside lanes), positive to the left.
    #[serde(default)]
    pub heading_deg: At<f64>,
    /// It follows the road; with a heading it goes straight on in that.
    #[serde(default)]
    pub speed_mps: At<f64>,
    /// How it goes along the road, in place of a steady speed.
    pub drive: Option<DriveTable>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadTable {
    pub name: At<String>,
    #[serde(default)]
    pub start: StartTable,
    /// The axis in plan.
    pub plan: Option<At<Vec<ElementTable>>>,
    /// An OpenDRIVE file below the folder of this file, in place of start, plan, grades, cross slope and lane
    /// offset; its lanes too, unless left or right are given.
    pub opendrive: Option<At<String>>,
    /// Id of the road in that file; default its first.
    pub opendrive_road: Option<At<String>>,
    /// Grade at the beginning, positive uphill.
    #[serde(default)]
    pub grade_percent: At<f64>,
    #[serde(default)]
    pub grade: Vec<GradeTable>,
    /// Positive when the left side is higher; default 0.
    pub cross_slope_percent: Option<At<Series>>,
    /// Where the lanes begin, to the left of the axis; default 0.
    pub lane_offset_m: Option<At<Series>>,
    /// Radar material of its lanes; default asphalt.
    pub surface: Option<At<String>>,
    /// Lanes to the left of the axis, from it outwards.
    #[serde(default)]
    pub left: Vec<LaneTable>,
    /// Lanes to the right of the axis, from it outwards.
    #[serde(default)]
    pub right: Vec<LaneTable>,
    /// Painted where the lanes of both sides meet.
    #[serde(default)]
    pub centre_line: LineKind,
    #[serde(default)]
    pub paint: PaintTable,
    #[serde(default)]
    pub line: Vec<LineTable>,
    #[serde(default)]
    pub verge: Vec<VergeTable>,
    #[serde(default)]
    pub rail: Vec<RailTable>,
    #[serde(default)]
    pub wall: Vec<WallTable>,
    #[serde(default)]
    pub kerb: Vec<WallTable>,
    #[serde(default)]
    pub fence: Vec<FenceTable>,
    #[serde(default)]
    pub gantry: Vec<GantryTable>,
    #[serde(default)]
    pub markers: Vec<RowTable>,
    #[serde(default)]
    pub object: Vec<ObjectTable>,
    #[serde(default)]
    pub vehicle: Vec<VehicleTable>,
}
