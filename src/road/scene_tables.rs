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
    /// Name of the scene, shown in results.
    pub name: String,
    /// Greatest distance of a facet from the curve that it stands for, m; from 1e-5 to 1, default 0.005.
    pub sagitta_m: Option<At<f64>>,
    /// How long the motion of vehicles is computed, s; from 0 to 3600, default 30. A scenario takes as long
    /// as its frames last.
    pub duration_s: Option<At<f64>>,
    /// Materials of the scene's own, which surfaces, verges, rails, walls, fences and gantries may name.
    #[serde(default)]
    pub material: Vec<MaterialTable>,
    /// The roads of the scene, at least one; a road may begin at one that stands before it.
    pub road: Vec<RoadTable>,
}

/// A material of the scene's own: a row of the table that is changed, or one that is given whole.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialTable {
    /// Its name, which no row of the table has.
    pub name: At<String>,
    /// A material of the table, with layers where it has some ("asphalt+water:0.0005"), from which it has what is not given here.
    pub like: Option<At<String>>,
    /// Relative permittivity [eps', eps''], the loss eps'' positive.
    pub eps_r: Option<At<[f64; 2]>>,
    /// Conductivity, S/m; without eps_r it is that of a good conductor.
    pub conductivity_s_per_m: Option<At<f64>>,
    /// Standard deviation of the surface's height, m; from 0 (smooth, the default) to 1.
    pub roughness_rms_m: Option<At<f64>>,
    /// Correlation length of the roughness, m; from 0 to 1000.
    pub correlation_length_m: Option<At<f64>>,
    /// How it scatters back: "oh", "kulemin:GROUND" or "gamma:DB", with options as in "gamma:-20,cross_db=-8".
    pub backscatter: Option<At<String>>,
    /// Lowest and highest frequency for which the values hold, Hz.
    pub valid_hz: Option<At<[f64; 2]>>,
    /// Where the values come from, for lists of materials.
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

/// Where and how the axis begins: in the world, or at a place of a road that stands before it in the file.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartTable {
    /// Where the axis begins, [forward, left, up] in the world, m; default the origin.
    pub position_m: Option<At<[f64; 3]>>,
    /// Name of a road that stands before this one in the file, at which this one begins in place of
    /// `position_m`.
    pub road: Option<At<String>>,
    /// Station on that other road where this one begins, m; default 0.
    pub s_m: Option<At<f64>>,
    /// Distance from that other road's axis at which this one begins, m, positive to the left; default 0.
    pub t_m: Option<At<f64>>,
    /// Direction of the axis at its beginning, degrees to the left of the world's x axis or of the other
    /// road's direction; from -360 to 360.
    #[serde(default)]
    pub heading_deg: At<f64>,
}

/// The shape of an element of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElementKind {
    /// A straight line.
    Straight,
    /// An arc of constant curvature.
    Arc,
    /// A curve whose curvature changes evenly along it.
    Clothoid,
}

/// An element of the plan. Radii are positive to the left and negative to the right.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementTable {
    /// Shape of the element.
    pub kind: At<ElementKind>,
    /// Length of the element, m, more than 0; an arc may have `angle_deg` in its place.
    pub length_m: Option<At<f64>>,
    /// Radius of an arc, m; at least 0.1, negative to the right.
    pub radius_m: Option<At<f64>>,
    /// Angle through which an arc turns, degrees, more than 0 and less than 3600, in place of its length.
    pub angle_deg: Option<At<f64>>,
    /// Radius at the beginning of a clothoid, m; default that at the end of the element before.
    pub from_radius_m: Option<At<f64>>,
    /// Radius at the end of a clothoid, m; straight by default.
    pub to_radius_m: Option<At<f64>>,
}

/// Where two grades meet, with a parabola of length K |g1 - g2| between them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradeTable {
    /// Station of the point where the lines of the two grades meet, m.
    pub s_m: At<f64>,
    /// Grade beyond that point, percent, positive uphill; from -100 to 100.
    pub grade_percent: At<f64>,
    /// Length of the parabola for each percent by which the grade changes, m; 0 makes a kink.
    #[serde(default)]
    pub k_m_per_percent: At<f64>,
}

/// A lane, beside the one before it or beside the axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LaneTable {
    /// Number by which other keys and labels name the lane; default 1, 2, ... on the right and 11, 12, ... on
    /// the left, from the axis outwards.
    pub number: Option<At<i32>>,
    /// What the lane is for; default driving.
    pub kind: Option<LaneKind>,
    /// Direction in which the lane is driven; default forward on the right of the axis and backward on the
    /// left.
    pub driven: Option<Driven>,
    /// Width of the lane, m, from 0 to 1000: one number, or pairs [station, width] with straight lines
    /// between.
    pub width_m: At<Series>,
    /// Radar material of the lane, or "none" for no surface; default the road's for drivable lanes and
    /// sidewalks, otherwise grass.
    pub surface: Option<At<String>>,
    /// Line that is painted on the lane's edge away from the axis.
    #[serde(default)]
    pub line: LineKind,
}

/// How lines are painted.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PaintTable {
    /// Width of a line, m; more than 0, at most 1000.
    pub width_m: At<f64>,
    /// Length of a dash of a dashed line, m; more than 0.001, at most 1000.
    pub dash_m: At<f64>,
    /// Length of the gap between two dashes, m; more than 0, at most 1000.
    pub gap_m: At<f64>,
    /// Height of the paint over the road, m; from 0.0001 to 0.05.
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
    /// Distance from the axis, m, positive to the left: one number, or pairs [station, distance].
    pub t_m: Option<At<Series>>,
    /// Number of the lane in which the place lies.
    pub lane: Option<At<i32>>,
    /// Where in the lane, seen along the axis; default its centre.
    pub side: Option<At<InLane>>,
    /// The outer edge of the outermost drivable lane on this side.
    pub edge: Option<At<Side>>,
    /// Distance from that place in the lane or from that edge, m, positive to the left; default 0.
    pub offset_m: Option<At<Series>>,
}

/// A painted line along the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineTable {
    /// Lateral position of the line: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// How the line is painted.
    pub kind: LineKind,
    /// Station where it begins, m; from 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// Station where it ends, m; beyond `from_m`, at most and by default the road's length.
    pub to_m: Option<At<f64>>,
    /// How this line is painted; default the road's paint.
    pub paint: Option<PaintTable>,
    /// Radar material of the road under the line; default the road's.
    pub under: Option<At<String>>,
}

/// A sheet of ground beside the outermost lane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VergeTable {
    /// The side of the axis on which the sheet lies.
    pub side: Side,
    /// Width of the sheet from the outermost lane outwards, m; more than 0, at most 1000.
    pub width_m: At<f64>,
    /// How far it falls over its first metre, m; from 0 to 10, default 0.12.
    pub drop_m: Option<At<f64>>,
    /// Radar material; default grass.
    pub material: Option<At<String>>,
    /// Station where it begins, m; from 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// Station where it ends, m; beyond `from_m`, at most and by default the road's length.
    pub to_m: Option<At<f64>>,
}

/// A W-beam guard rail.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RailTable {
    /// Lateral position of the back of the rail's beam.
    pub lateral: At<LateralTable>,
    /// The side on which the traffic is, which the rail's face looks at; default towards the axis.
    pub faces: Option<Side>,
    /// Station where it begins, m; from 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// Station where it ends, m; beyond `from_m`, at most and by default the road's length.
    pub to_m: Option<At<f64>>,
    /// Height of the rail's upper edge, m; from 0.35 to 10, default 0.75.
    pub height_m: Option<At<f64>>,
    /// Distance between posts, m; default 4, and 0 means no posts.
    pub post_spacing_m: Option<At<f64>>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A sound wall, or a kerb.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallTable {
    /// Lateral position of the wall's middle.
    pub lateral: At<LateralTable>,
    /// Station where it begins, m; from 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// Station where it ends, m; beyond `from_m`, at most and by default the road's length.
    pub to_m: Option<At<f64>>,
    /// Height, m; default 3 (kerb 0.12).
    pub height_m: Option<At<f64>>,
    /// Thickness, m; default 0.2 (kerb 0.15).
    pub thickness_m: Option<At<f64>>,
    /// Radar material; default concrete. A wall with a metal face is "aluminium".
    pub material: Option<At<String>>,
}

/// Square posts with level bars.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FenceTable {
    /// Lateral position of the fence's middle: from the axis, in a lane, or from the edge of the drivable
    /// lanes.
    pub lateral: At<LateralTable>,
    /// Station where it begins, m; from 0 to the road's length, default 0.
    pub from_m: Option<At<f64>>,
    /// Station where it ends, m; beyond `from_m`, at most and by default the road's length.
    pub to_m: Option<At<f64>>,
    /// Height of the fence, m; default 1.2.
    pub height_m: Option<At<f64>>,
    /// Distance between posts, m; default 2.5.
    pub post_spacing_m: Option<At<f64>>,
    /// Edge of a post's square section, m; default 0.08.
    pub post_m: Option<At<f64>>,
    /// Number of level bars, from 1 to 100; default 3.
    pub bars: Option<At<u32>>,
    /// Edge of a bar's square section, m; default 0.04.
    pub bar_m: Option<At<f64>>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A beam over the road on two legs.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GantryTable {
    /// Station where the gantry crosses the road, m; from 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of one leg; `to` is that of the other.
    pub from: At<LateralTable>,
    /// Lateral position of the other leg.
    pub to: At<LateralTable>,
    /// Height of the beam's lower side over the road, m; default 5.5.
    pub clearance_m: Option<At<f64>>,
    /// Edge of the beam's square section, m; default 0.8.
    pub beam_m: Option<At<f64>>,
    /// Radar material; default steel.
    pub material: Option<At<String>>,
}

/// A code word in the gaps between markers.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CodeTable {
    /// The code word, zeros and ones, as in "1011"; it is repeated along the row.
    pub word: At<String>,
    /// Gap between two reflectors that means 0, m.
    pub zero_m: At<f64>,
    /// Gap between two reflectors that means 1, m; it differs from `zero_m`.
    pub one_m: At<f64>,
    /// Gap between one word and the next, m, which differs from the other two; without it there is none.
    pub sync_m: Option<At<f64>>,
}

/// A row of reflectors of one kind.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RowTable {
    /// Name of the row in labels; default its class and its place in the file, as in "marker row 1".
    pub name: Option<String>,
    /// Class of the reflectors in labels; default marker. Another class, as in "pole", makes no markers in
    /// the labels.
    pub class: Option<String>,
    /// Reflector and its sizes, as in `catseye rcs`: "type1:width_m=0.16,height_m=0.004".
    pub reflector: At<String>,
    /// Lateral position of the row: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// Station of the first reflector, m; default 0.
    pub from_m: Option<At<f64>>,
    /// Station beyond which no reflector stands, m; default the end of the road.
    pub to_m: Option<At<f64>>,
    /// Distance from one reflector to the next, m, more than 0; a row has either this, `gaps_m` or `code`.
    pub spacing_m: Option<At<f64>>,
    /// Number of reflectors at `spacing_m`, at most what the road has room for; by default they fill the
    /// road.
    pub count: Option<At<u32>>,
    /// Distances from each reflector to the next in turn, m, more than 0, in place of `spacing_m`.
    pub gaps_m: Option<At<Vec<f64>>>,
    /// Code word whose digits are the distances between reflectors, in place of `spacing_m`.
    pub code: Option<CodeTable>,
    /// Whether these distances are measured along the row itself, which is longer or shorter than the axis in
    /// bends, or along the axis (default).
    #[serde(default)]
    pub along_row: bool,
    /// Angle of the boresight to the left of the road's direction, degrees; default 180, towards traffic that
    /// comes along it.
    pub yaw_deg: Option<At<f64>>,
    /// Further yaw from each reflector to the next, degrees.
    #[serde(default)]
    pub turn_deg: At<f64>,
    /// Pitch, degrees, positive nose down; a plate with -90 looks up.
    #[serde(default)]
    pub pitch_deg: At<f64>,
    /// Roll, degrees, positive left side up.
    #[serde(default)]
    pub roll_deg: At<f64>,
    /// Height of the reflector's origin over the road, m; from -10 to 100, default 0.002 for markers,
    /// otherwise 0.
    pub lift_m: Option<At<f64>>,
    /// Whether the reflector's z axis is vertical also where the road slopes; default false for markers,
    /// otherwise true.
    pub upright: Option<bool>,
}

/// A reflector, a manhole, or a glTF file at a place of the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectTable {
    /// Name of the object in labels; default its place in the file, as in "object 1".
    pub name: Option<String>,
    /// Class in labels; default what the file says, "manhole" for manholes, and "reflector" for other
    /// reflectors.
    pub class: Option<String>,
    /// Reflector and its sizes, as in `catseye rcs`; an object has either this or `file`.
    pub reflector: Option<At<String>>,
    /// A .glb, .gltf, .stl or .obj file in the folder of this file or below it.
    pub file: Option<At<String>>,
    /// Unit of length of the file: m (default of glTF; STL and OBJ need it), cm, mm, in or ft.
    pub unit: Option<At<String>>,
    /// Axis of the file that points up: y (default of glTF; STL and OBJ need it) or z.
    pub up: Option<At<String>>,
    /// Animations of the file that move it: all (default), none, or the name of one.
    pub animation: Option<At<String>>,
    /// Edges of the file's meshes whose facets turn by more than this are creases, degrees (default 30; 0 takes every facet as flat).
    pub smooth_deg: Option<At<f64>>,
    /// Radar material for surfaces of the file whose material is missing or unknown.
    pub default_material: Option<At<String>>,
    /// Radar material of catseye's table for each material of the file, by its name there.
    #[serde(default)]
    pub materials: BTreeMap<String, At<String>>,
    /// Station of the object's origin, m; from 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of the object's origin: from the axis, in a lane, or from the edge of the drivable
    /// lanes.
    pub lateral: At<LateralTable>,
    /// Angle of its x axis to the left of the road's direction, degrees; from -360 to 360.
    #[serde(default)]
    pub yaw_deg: At<f64>,
    /// Pitch, degrees, positive nose down; from -360 to 360.
    #[serde(default)]
    pub pitch_deg: At<f64>,
    /// Roll, degrees, positive left side up; from -360 to 360.
    #[serde(default)]
    pub roll_deg: At<f64>,
    /// Height of the object's origin over the road, m; from -100 to 1000.
    #[serde(default)]
    pub lift_m: At<f64>,
    /// Constant speed along its x axis, m/s; from -1000 to 1000.
    #[serde(default)]
    pub speed_mps: At<f64>,
    /// Whether the object's z axis is vertical also where the road slopes; otherwise it leans with the road.
    #[serde(default)]
    pub upright: bool,
}

/// A vehicle or a person on the road.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleTable {
    /// Name of the vehicle in labels; default its kind and its place in the file, as in "van 1".
    pub name: Option<String>,
    /// What goes there: a vehicle or a person of the library.
    #[schemars(extend("enum" = VEHICLES))]
    pub kind: At<String>,
    /// Cross section, dBsm, of a point in its middle that scatters in its place, alike in all directions; the radar then sees
    /// through its body, which labels, masks and lidar show as before; from -200 to 200. Default: its shape scatters.
    pub rcs_dbsm: Option<At<f64>>,
    /// Station of its middle, m; from 0 to the road's length.
    pub s_m: At<f64>,
    /// Lateral position of its middle: from the axis, in a lane, or from the edge of the drivable lanes.
    pub lateral: At<LateralTable>,
    /// Angle of its heading to the left of the direction in which its lane is driven (outside lanes, of the
    /// road's direction), degrees.
    #[serde(default)]
    pub heading_deg: At<f64>,
    /// Constant speed, m/s; it follows the road, or goes straight on if it has a heading.
    #[serde(default)]
    pub speed_mps: At<f64>,
    /// How it goes along the road over time, in place of a constant speed.
    pub drive: Option<DriveTable>,
}

/// A road: its axis, its lanes, and what stands on it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadTable {
    /// Name of the road, which no other road of the file has.
    pub name: At<String>,
    #[serde(default)]
    pub start: StartTable,
    /// The axis in plan: elements one after another, from the beginning. A road has either this or
    /// `opendrive`.
    pub plan: Option<At<Vec<ElementTable>>>,
    /// An OpenDRIVE file in the folder of this file or below it, in place of start, plan, grades, cross slope
    /// and lane offset; its lanes are taken too, unless left or right are given.
    pub opendrive: Option<At<String>>,
    /// Id of the road in that file; default its first road.
    pub opendrive_road: Option<At<String>>,
    /// Grade at the beginning, percent, positive uphill; from -100 to 100.
    #[serde(default)]
    pub grade_percent: At<f64>,
    /// Changes of grade, in the order of their stations.
    #[serde(default)]
    pub grade: Vec<GradeTable>,
    /// Cross slope, percent, positive when the left side is higher: one number, or pairs [station, slope];
    /// default 0.
    pub cross_slope_percent: Option<At<Series>>,
    /// Where the lanes begin, m to the left of the axis: one number, or pairs [station, offset]; default 0.
    pub lane_offset_m: Option<At<Series>>,
    /// Radar material of its lanes, or "none" for no surface; default asphalt.
    pub surface: Option<At<String>>,
    /// Lanes to the left of the axis, from it outwards.
    #[serde(default)]
    pub left: Vec<LaneTable>,
    /// Lanes to the right of the axis, from it outwards.
    #[serde(default)]
    pub right: Vec<LaneTable>,
    /// Line that is painted where the lanes of both sides meet.
    #[serde(default)]
    pub centre_line: LineKind,
    /// How the lines of the road are painted.
    #[serde(default)]
    pub paint: PaintTable,
    /// Further painted lines.
    #[serde(default)]
    pub line: Vec<LineTable>,
    /// Sheets of ground beside the outermost lane.
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
    /// Fences of square posts with level bars.
    #[serde(default)]
    pub fence: Vec<FenceTable>,
    /// Gantries: beams over the road on two legs.
    #[serde(default)]
    pub gantry: Vec<GantryTable>,
    /// Rows of reflectors, each of one kind.
    #[serde(default)]
    pub markers: Vec<RowTable>,
    /// Reflectors, manholes and mesh files at places of the road.
    #[serde(default)]
    pub object: Vec<ObjectTable>,
    /// Vehicles and people of the library.
    #[serde(default)]
    pub vehicle: Vec<VehicleTable>,
}
