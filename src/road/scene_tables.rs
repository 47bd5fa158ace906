//! The tables of a road scene file, as they stand in TOML.

use crate::road::layout::{Driven, InLane, LaneKind, LineKind, Side};
use crate::road::traffic::VEHICLES;
use crate::scene::drive::DriveTable;
use crate::scene::toml_file::At;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;

/// A road scene: roads with road furniture, reflectors and vehicles. Lengths are in metres, angles in
/// degrees; `s_m` is the arc length along a road's axis in plan, `t_m` the lateral distance from the axis,
/// positive to the left.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye road scene")]
pub struct SceneFile {
    /// Name of the scene, shown in results.
    pub name: String,
    /// Maximum distance of a facet from the curved surface that it approximates, m; default 0.005.
    #[schemars(range(min = 1e-5, max = 1.0))]
    pub sagitta_m: Option<f64>,
    /// Duration for which the motion of vehicles is computed, s; default 30. A scenario uses the
    /// duration of its frames instead.
    #[schemars(range(min = 0.0, max = 3600.0))]
    pub duration_s: Option<f64>,
    /// Materials defined in this scene, for use in surfaces, verges, rails, walls, fences and gantries.
    #[serde(default)]
    pub material: Vec<MaterialTable>,
    /// The roads of the scene, at least one; a road may begin at a road defined before it.
    #[schemars(length(min = 1))]
    pub road: Vec<RoadTable>,
}

/// A material defined in this scene: a modified entry of the material table, or a complete definition.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialTable {
    /// Name of the material; it must differ from all names in the material table.
    pub name: At<String>,
    /// Material of the table, with layers where it has some ("asphalt+water:0.0005"), that gives all values not stated here.
    pub like: Option<At<String>>,
    /// Relative permittivity [eps', eps'']; the loss eps'' is positive.
    pub eps_r: Option<At<[f64; 2]>>,
    /// Conductivity, S/m; without eps_r the material is a good conductor.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub conductivity_s_per_m: Option<f64>,
    /// Standard deviation of the surface height (RMS roughness), m; default 0, smooth.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness_rms_m: Option<f64>,
    /// Correlation length of the roughness, m.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub correlation_length_m: Option<f64>,
    /// Backscatter model: "oh", "kulemin:GROUND" or "gamma:DB", with options as in "gamma:-20,cross_db=-8".
    pub backscatter: Option<At<String>>,
    /// Lowest and highest frequency for which the values are valid, Hz.
    pub valid_hz: Option<At<[f64; 2]>>,
    /// Source of the values, shown in lists of materials.
    pub source: Option<String>,
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

/// Start of the axis: in the world, or at a position on a road defined before it in the file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartTable {
    /// Start of the axis, [forward, left, up] in the world, m; default the origin.
    pub position_m: Option<At<[f64; 3]>>,
    /// Name of a road defined before this one in the file, at which this road begins; alternative to
    /// `position_m`.
    pub road: Option<At<String>>,
    /// Station on the other road at which this road begins, m; default 0.
    pub s_m: Option<At<f64>>,
    /// Distance of the start from the other road's axis, m, positive to the left; default 0.
    pub t_m: Option<At<f64>>,
    /// Direction of the axis at its start, degrees to the left of the world's x axis or of the other road's
    /// direction.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub heading_deg: f64,
}

/// Shape of an element of the plan view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElementKind {
    /// A straight line.
    Straight,
    /// An arc of constant curvature.
    Arc,
    /// A clothoid: its curvature changes linearly with arc length.
    Clothoid,
}

/// An element of the plan view. Radii are positive to the left and negative to the right.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementTable {
    /// Shape of the element.
    pub kind: At<ElementKind>,
    /// Length of the element, m; an arc may give `angle_deg` instead.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub length_m: Option<At<f64>>,
    /// Radius of an arc, m; magnitude at least 0.1, negative to the right.
    pub radius_m: Option<At<f64>>,
    /// Angle of an arc, degrees, in place of its length.
    #[schemars(range(max = 3600.0), extend("exclusiveMinimum" = 0.0))]
    pub angle_deg: Option<At<f64>>,
    /// Radius at the start of a clothoid, m; default the radius at the end of the preceding element.
    pub from_radius_m: Option<At<f64>>,
    /// Radius at the end of a clothoid, m; default straight.
    pub to_radius_m: Option<At<f64>>,
}

/// A vertical curve between two grades: a parabola of length K |g1 - g2|.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradeTable {
    /// Station of the intersection of the two grade lines, m.
    pub s_m: At<f64>,
    /// Grade beyond that station, percent, positive uphill.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub grade_percent: f64,
    /// Length of the parabola for each percent of change in grade (K), m; 0 makes a kink.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub k_m_per_percent: f64,
}

/// A lane, next to the preceding lane or to the axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LaneTable {
    /// Number that identifies the lane in other keys and in labels; default 1, 2, ... on the right and 11,
    /// 12, ... on the left, from the axis outwards.
    pub number: Option<At<i32>>,
    /// Type of the lane; default driving.
    pub kind: Option<LaneKind>,
    /// Driving direction; default forward on the right of the axis and backward on the left.
    pub driven: Option<Driven>,
    /// Width of the lane, m, 0 to 1000: one number, or pairs [station, width] with linear interpolation.
    pub width_m: At<Series>,
    /// Radar material of the lane, or "none" for no surface; default the road's material for drivable lanes
    /// and sidewalks, grass for others.
    pub surface: Option<At<String>>,
    /// Painted line on the lane's outer edge, away from the axis.
    #[serde(default)]
    pub line: LineKind,
}

/// Dimensions and material of painted lines.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PaintTable {
    /// Width of a line, m.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0))]
    pub width_m: At<f64>,
    /// Length of a dash of a dashed line, m.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 1e-3))]
    pub dash_m: At<f64>,
    /// Length of the gap between two dashes, m.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0))]
    pub gap_m: At<f64>,
    /// Height of the paint above the road, m.
    #[schemars(range(min = 1e-4, max = 0.05))]
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

/// A lateral position: from the axis, in a lane, or from the edge of the drivable lanes.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LateralTable {
    /// Distance from the axis, m, positive to the left: one number, or pairs [station, distance].
    pub t_m: Option<At<Series>>,
    /// Number of the lane that the position refers to.
    pub lane: Option<At<i32>>,
    /// Reference in the lane, seen along the axis; default its centre.
    pub side: Option<At<InLane>>,
    /// Reference to the outer edge of the outermost drivable lane on this side.
    pub edge: Option<At<Side>>,
    /// Distance from that reference, m, positive to the left; default 0.
    pub offset_m: Option<At<Series>>,
}

/// A painted line along the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineTable {
    /// Lateral position of the line: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// Type of the line.
    pub kind: LineKind,
    /// Start station, m; 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// End station, m; greater than `from_m`, at most the road's length, which is the default.
    pub to_m: Option<At<f64>>,
    /// Dimensions and material of this line; default the road's paint.
    pub paint: Option<PaintTable>,
    /// Radar material of the road under the line; default the road's.
    pub under: Option<At<String>>,
}

/// A verge: a strip of ground beside the outermost lane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VergeTable {
    /// Side of the axis.
    pub side: Side,
    /// Width of the verge from the outermost lane outwards, m.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0))]
    pub width_m: f64,
    /// Drop over the first metre, m; default 0.12.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub drop_m: Option<f64>,
    /// Radar material; default grass.
    pub material: Option<At<String>>,
    /// Start station, m; 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// End station, m; greater than `from_m`, at most the road's length, which is the default.
    pub to_m: Option<At<f64>>,
}

/// A W-beam guard rail.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RailTable {
    /// Lateral position of the back of the rail's beam.
    pub lateral: At<LateralTable>,
    /// Side of the traffic, towards which the rail faces; default towards the axis.
    pub faces: Option<Side>,
    /// Start station, m; 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// End station, m; greater than `from_m`, at most the road's length, which is the default.
    pub to_m: Option<At<f64>>,
    /// Height of the rail's upper edge, m; default 0.75.
    #[schemars(range(min = 0.35, max = 10.0))]
    pub height_m: Option<f64>,
    /// Distance between posts, m; default 4; 0 means no posts.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub post_spacing_m: Option<At<f64>>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A sound wall, or a kerb.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallTable {
    /// Lateral position of the wall's centre line.
    pub lateral: At<LateralTable>,
    /// Start station, m; 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// End station, m; greater than `from_m`, at most the road's length, which is the default.
    pub to_m: Option<At<f64>>,
    /// Height, m; default 3 (kerb 0.12).
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub height_m: Option<f64>,
    /// Thickness, m; default 0.2 (kerb 0.15).
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub thickness_m: Option<f64>,
    /// Radar material; default concrete. For a wall with a metal face use "aluminium".
    pub material: Option<At<String>>,
}

/// A fence of square posts with horizontal bars.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FenceTable {
    /// Lateral position of the fence's centre line: from the axis, in a lane, or from the edge of the
    /// drivable lanes.
    pub lateral: At<LateralTable>,
    /// Start station, m; 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// End station, m; greater than `from_m`, at most the road's length, which is the default.
    pub to_m: Option<At<f64>>,
    /// Height of the fence, m; default 1.2.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub height_m: Option<f64>,
    /// Distance between posts, m; default 2.5.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub post_spacing_m: Option<At<f64>>,
    /// Side of a post's square cross-section, m; default 0.08.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub post_m: Option<f64>,
    /// Number of horizontal bars; default 3.
    #[schemars(range(min = 1, max = 100))]
    pub bars: Option<u32>,
    /// Side of a bar's square cross-section, m; default 0.04.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub bar_m: Option<f64>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A gantry: a beam across the road on two legs.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GantryTable {
    /// Station of the gantry, m; 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of one leg; `to` is that of the other.
    pub from: At<LateralTable>,
    /// Lateral position of the other leg.
    pub to: At<LateralTable>,
    /// Clearance: height of the beam's lower side above the road, m; default 5.5.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub clearance_m: Option<f64>,
    /// Side of the beam's square cross-section, m; default 0.8.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub beam_m: Option<f64>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A code word in the gaps between markers.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CodeTable {
    /// Code word of zeros and ones, as in "1011"; it is repeated along the row.
    pub word: At<String>,
    /// Gap between two reflectors that encodes 0, m.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub zero_m: f64,
    /// Gap between two reflectors that encodes 1, m; it must differ from `zero_m`.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub one_m: At<f64>,
    /// Gap between two words, m; it must differ from the other two gaps; default no such gap.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub sync_m: Option<f64>,
}

/// A row of identical reflectors.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RowTable {
    /// Name of the row in labels; default its class and its number in the file, as in "marker row 1".
    pub name: Option<String>,
    /// Class of the reflectors in labels; default marker. With another class, such as "pole", the labels list
    /// no markers.
    pub class: Option<String>,
    /// Reflector kind and parameters, as in `catseye rcs`: "type1:width_m=0.16,height_m=0.004".
    pub reflector: At<String>,
    /// Lateral position of the row: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// Station of the first reflector, m; default 0.
    pub from_m: Option<At<f64>>,
    /// Last possible station of a reflector, m; default the end of the road.
    pub to_m: Option<At<f64>>,
    /// Spacing of the reflectors, m; alternative to `gaps_m` and `code`.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub spacing_m: Option<At<f64>>,
    /// Number of reflectors at `spacing_m`, at most as many as fit on the road; by default they fill the
    /// road.
    pub count: Option<At<u32>>,
    /// Distances between successive reflectors, m; alternative to `spacing_m`.
    #[schemars(inner(range(min = 1e-6, max = 1e6)))]
    pub gaps_m: Option<Vec<f64>>,
    /// Code word that is encoded in the distances between reflectors; alternative to `spacing_m`.
    pub code: Option<CodeTable>,
    /// true: the distances are measured along the row itself, which is longer or shorter than the axis in
    /// bends; false (default): along the axis.
    #[serde(default)]
    pub along_row: bool,
    /// Angle of the boresight to the left of the road's direction, degrees; default 180, towards traffic in
    /// the road's direction.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: Option<f64>,
    /// Yaw increment from each reflector to the next, degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub turn_deg: f64,
    /// Pitch, degrees, positive nose down; at -90 a plate faces up.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll, degrees, positive left side up.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Height of the reflector's origin above the road, m; default 0.002 for markers, 0 for
    /// others.
    #[schemars(range(min = -10.0, max = 100.0))]
    pub lift_m: Option<f64>,
    /// true: the reflector's z axis is vertical even where the road slopes; default false for markers, true
    /// for others.
    pub upright: Option<bool>,
}

/// A reflector, a manhole or a mesh file at a position on the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectTable {
    /// Name of the object in labels; default its number in the file, as in "object 1".
    pub name: Option<String>,
    /// Class in labels; default the class in the file, "manhole" for manholes, and "reflector" for other
    /// reflectors.
    pub class: Option<String>,
    /// Reflector kind and parameters, as in `catseye rcs`; alternative to `file`.
    pub reflector: Option<At<String>>,
    /// A .glb, .gltf, .stl or .obj file in the folder of this file or below it; alternative to `reflector`.
    pub file: Option<At<String>>,
    /// Unit of length of the file: m (default for glTF; required for STL and OBJ), cm, mm, in or ft.
    pub unit: Option<At<String>>,
    /// Up axis of the file: y (default for glTF; required for STL and OBJ) or z.
    pub up: Option<At<String>>,
    /// Animations of the file that are played: all (default), none, or the name of one.
    pub animation: Option<At<String>>,
    /// Crease angle: edges at which adjacent facets turn by more than this are creases, degrees (default 30; with 0 every facet is flat).
    pub smooth_deg: Option<At<f64>>,
    /// Radar material of surfaces whose material is missing or unknown.
    pub default_material: Option<At<String>>,
    /// Map from the file's material names to radar materials of the table.
    #[serde(default)]
    pub materials: BTreeMap<String, At<String>>,
    /// Station of the object's origin, m; 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of the object's origin: from the axis, in a lane, or from the edge of the drivable
    /// lanes.
    pub lateral: At<LateralTable>,
    /// Angle of the object's x axis to the left of the road's direction, degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch, degrees, positive nose down.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll, degrees, positive left side up.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Height of the object's origin above the road, m.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 1000.0))]
    pub lift_m: f64,
    /// Constant speed along the object's x axis, m/s.
    #[serde(default)]
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub speed_mps: f64,
    /// true: the object's z axis is vertical even where the road slopes; false: it is perpendicular to the road.
    #[serde(default)]
    pub upright: bool,
}

/// A vehicle or a person on the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleTable {
    /// Name of the vehicle in labels; default its kind and its number in the file, as in "van 1".
    pub name: Option<String>,
    /// Kind of vehicle or person from the library.
    #[schemars(extend("enum" = VEHICLES))]
    pub kind: At<String>,
    /// Radar cross section of an isotropic point at its centre that scatters instead of its shape, dBsm. Its
    /// body is then transparent to the radar, while labels, masks and lidar show it as before. Default: its
    /// shape scatters.
    #[schemars(range(min = -200.0, max = 200.0))]
    pub rcs_dbsm: Option<f64>,
    /// Station of its centre, m; 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of its centre: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// Heading relative to the driving direction of its lane (outside lanes, to the road's direction),
    /// degrees, positive to the left.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub heading_deg: At<f64>,
    /// Constant speed, m/s; it follows the road, or drives straight on if it has a heading.
    #[serde(default)]
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub speed_mps: At<f64>,
    /// Speed and lateral motion over time, in place of a constant speed.
    pub drive: Option<DriveTable>,
}

/// A road: its axis, its lanes and its objects.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadTable {
    /// Name of the road, unique in the file.
    pub name: At<String>,
    #[serde(default)]
    pub start: StartTable,
    /// Plan view of the axis: consecutive elements from its beginning. Alternative to `opendrive`.
    pub plan: Option<At<Vec<ElementTable>>>,
    /// OpenDRIVE file in the folder of this file or below it, in place of start, plan, grades, cross slope
    /// and lane offset; it also gives the lanes, unless left or right are given.
    pub opendrive: Option<At<String>>,
    /// Id of the road in the OpenDRIVE file; default its first road.
    pub opendrive_road: Option<At<String>>,
    /// Grade at the beginning, percent, positive uphill.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub grade_percent: f64,
    /// Changes of grade, ordered by station.
    #[serde(default)]
    pub grade: Vec<GradeTable>,
    /// Cross slope, percent, positive where the left side is higher: one number, or pairs [station, slope];
    /// default 0.
    pub cross_slope_percent: Option<At<Series>>,
    /// Lateral offset of the lanes from the axis, m, positive to the left: one number, or pairs [station, offset]; default 0.
    pub lane_offset_m: Option<At<Series>>,
    /// Radar material of the lanes, or "none" for no surface; default asphalt.
    pub surface: Option<At<String>>,
    /// Lanes to the left of the axis, from the axis outwards.
    #[serde(default)]
    pub left: Vec<LaneTable>,
    /// Lanes to the right of the axis, from the axis outwards.
    #[serde(default)]
    pub right: Vec<LaneTable>,
    /// Painted line between the left and the right lanes.
    #[serde(default)]
    pub centre_line: LineKind,
    /// Dimensions and material of the painted lines.
    #[serde(default)]
    pub paint: PaintTable,
    /// Further painted lines.
    #[serde(default)]
    pub line: Vec<LineTable>,
    /// Verges: strips of ground beside the outermost lane.
    #[serde(default)]
    pub verge: Vec<VergeTable>,
    /// W-beam guard rails.
    #[serde(default)]
    pub rail: Vec<RailTable>,
    /// Sound walls.
    #[serde(default)]
    pub wall: Vec<WallTable>,
    /// Kerbs.
    #[serde(default)]
    pub kerb: Vec<WallTable>,
    /// Fences of square posts with horizontal bars.
    #[serde(default)]
    pub fence: Vec<FenceTable>,
    /// Gantries: beams across the road on two legs.
    #[serde(default)]
    pub gantry: Vec<GantryTable>,
    /// Rows of identical reflectors.
    #[serde(default)]
    pub markers: Vec<RowTable>,
    /// Single reflectors, manholes and mesh files at positions on the road.
    #[serde(default)]
    pub object: Vec<ObjectTable>,
    /// Vehicles and people from the library.
    #[serde(default)]
    pub vehicle: Vec<VehicleTable>,
}
