//! The TOML description of a road scene, for `catseye scene FILE.toml`.

use crate::error::{BadInput, Error, Result};
use crate::frames::Pose;
use crate::road::axis::{Course, GradeChange, RoadAxis, RoadPoint};
use crate::road::build::{
    DEFAULT_SAGITTA_M, FencePlan, GantryPlan, LinePlan, RailPlan, RoadPlan, RowPlan, ScenePlan, Source,
    Spacing, ThingPlan, VEHICLES, VergePlan, WallPlan,
};
use crate::road::layout::{Base, Driven, InLane, Lane, LaneKind, Lateral, LineKind, Paint, Road, Side};
use crate::road::opendrive;
use crate::road::profile::Profile;
use crate::road::reflector::Reflector;
use crate::scene::gltf::{self, ImportOptions};
use crate::scene::material;
use crate::scene::toml_file::{Above, At, Document, read_text};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

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
    /// Of an arc.
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
    /// Of the point where the two grades' lines meet.
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
    /// Of the back of its beam.
    pub lateral: At<LateralTable>,
    /// The side of the traffic; default towards the axis.
    pub faces: Option<Side>,
    pub from_m: Option<At<f64>>,
    pub to_m: Option<At<f64>>,
    /// Of its upper edge; default 0.75.
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
    /// Of its middle.
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
    /// Of its legs.
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
    /// Of the first one; default 0.
    pub from_m: Option<At<f64>>,
    /// None stands behind it; default the end of the road.
    pub to_m: Option<At<f64>>,
    pub spacing_m: Option<At<f64>>,
    pub count: Option<At<u32>>,
    /// In place of the spacing.
    pub gaps_m: Option<At<Vec<f64>>>,
    /// In place of the spacing.
    pub code: Option<CodeTable>,
    /// Of its boresight against the direction of the road; default 180, towards traffic that comes along it.
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
    /// Of its origin over the road; default 0.002 for markers, otherwise 0.
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
    /// A .glb or .gltf file below the folder of this file.
    pub file: Option<At<String>>,
    pub s_m: At<f64>,
    pub lateral: At<LateralTable>,
    /// Of its x axis against the direction of the road.
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
    pub kind: At<String>,
    /// Of its middle.
    pub s_m: At<f64>,
    pub lateral: At<LateralTable>,
    /// Against the direction in which its lane is driven (of the road outside lanes), positive to the left.
    #[serde(default)]
    pub heading_deg: At<f64>,
    #[serde(default)]
    pub speed_mps: At<f64>,
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

/// Reads and checks a file. Errors: one line with file, line, key, value and remedy.
pub fn load(path: &Path) -> Result<ScenePlan> {
    parse(path, &read_text(path)?)
}

/// The same from a text; `file` is named in errors, and glTF files are looked for in its folder.
pub fn parse(file: &Path, text: &str) -> Result<ScenePlan> {
    let doc = Document::parse(file, text)?;
    let f: SceneFile = doc.read()?;
    let sagitta_m = match &f.sagitta_m {
        Some(s) => doc.in_range(s, 1e-5..=1.0, "metres, as in 0.005")?,
        None => DEFAULT_SAGITTA_M,
    };
    if f.road.is_empty() {
        return Err(BadInput::new("the scene has no road")
            .file(file)
            .key("road")
            .remedy("add a [[road]] with name, plan and lanes")
            .into());
    }
    let mut roads: Vec<RoadPlan> = Vec::new();
    for t in &f.road {
        let plan = Reader { doc: &doc, t, roads: &roads }.road()?;
        roads.push(plan);
    }
    Ok(ScenePlan { name: f.name, sagitta_m, roads })
}

/// JSON schema of the file: (file name in `schema/`, text).
pub fn schema() -> (&'static str, String) {
    let schema = schemars::schema_for!(SceneFile);
    ("road_scene.schema.json", serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n")
}

struct Reader<'a> {
    doc: &'a Document<'a>,
    t: &'a RoadTable,
    roads: &'a [RoadPlan],
}

impl Reader<'_> {
    /// A complaint of another room with the place in this file.
    fn at(&self, span: &Range<usize>, e: Error) -> Error {
        match e {
            Error::Input(b) => {
                let problem = match (&b.key, &b.value) {
                    (Some(k), Some(v)) => format!("{k} = {v}: {}", b.problem),
                    (Some(k), None) => format!("{k}: {}", b.problem),
                    (None, Some(v)) => format!("{v}: {}", b.problem),
                    (None, None) => b.problem.clone(),
                };
                let mut here = self.doc.bad(span, problem);
                (here.allowed, here.remedy) = (b.allowed, b.remedy);
                here.into()
            }
            e => e,
        }
    }

    fn missing(&self, span: &Range<usize>, key: &str, remedy: &str) -> Error {
        self.doc.bad(span, format!("{key} is missing")).remedy(remedy).into()
    }

    fn series(&self, at: &At<Series>) -> Result<Profile> {
        Profile::linear(&at.value.0).map_err(|e| self.at(&at.span, e))
    }

    /// A length that is more than zero, or `default`.
    fn length(&self, at: &Option<At<f64>>, default: f64) -> Result<f64> {
        match at {
            Some(a) => self.doc.in_range(a, Above { low: 0.0, high: 1e6 }, "give metres"),
            None => Ok(default),
        }
    }

    fn angle(&self, at: &At<f64>) -> Result<f64> {
        Ok(self.doc.in_range(at, -360.0..=360.0, "give degrees")?.to_radians())
    }

    fn speed(&self, at: &At<f64>) -> Result<f64> {
        self.doc.in_range(at, -1000.0..=1000.0, "give metres per second")
    }

    /// A material's name or spec that exists, or the default.
    fn material(&self, at: &Option<At<String>>, default: &str) -> Result<String> {
        let Some(a) = at else { return Ok(default.into()) };
        material::parse_spec(&a.value).map_err(|e| self.at(&a.span, e))?;
        Ok(a.value.clone())
    }

    /// A path below the folder of this file.
    fn beside(&self, name: &At<String>) -> Result<PathBuf> {
        let relative = Path::new(&name.value);
        if relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
            return Ok(self.doc.file().parent().unwrap_or(Path::new("")).join(relative));
        }
        let e = self.doc.bad(&name.span, "leaves the folder of the scene file");
        Err(e.allowed("a name below that folder").remedy("copy the file beside the scene file").into())
    }

    /// The road of an OpenDRIVE file, when one is named.
    fn opendrive(&self) -> Result<Option<Road>> {
        let t = self.t;
        let Some(name) = &t.opendrive else {
            if let Some(r) = &t.opendrive_road {
                return Err(self.doc.bad(&r.span, "is without opendrive").remedy("name the file").into());
            }
            return Ok(None);
        };
        let twice = [
            t.plan.as_ref().map(|p| &p.span),
            t.start.position_m.as_ref().map(|p| &p.span),
            t.start.road.as_ref().map(|p| &p.span),
            t.grade.first().map(|g| &g.s_m.span),
            t.cross_slope_percent.as_ref().map(|c| &c.span),
            t.lane_offset_m.as_ref().map(|l| &l.span),
        ];
        if let Some(span) = twice.into_iter().flatten().next() {
            let e = self.doc.bad(span, "is given by the OpenDRIVE file as well");
            return Err(e.remedy("take it out, or opendrive").into());
        }
        let path = self.beside(name)?;
        let mut roads = opendrive::parse(&path, &read_text(&path)?)?;
        let Some(id) = &t.opendrive_road else { return Ok(Some(roads.swap_remove(0))) };
        let ids: Vec<String> = roads.iter().map(|r| r.name.clone()).collect();
        roads.into_iter().find(|r| r.name == id.value).map(Some).ok_or_else(|| {
            self.doc.bad(&id.span, "is no road of the OpenDRIVE file").allowed(ids.join(", ")).into()
        })
    }

    fn axis(&self) -> Result<RoadAxis> {
        let t = self.t;
        let Some(plan) = &t.plan else {
            return Err(self.missing(&t.name.span, "plan", "list the elements of the axis, or give opendrive"));
        };
        let start = &t.start;
        let heading = self.angle(&start.heading_deg)?;
        let (position, heading) = match (&start.road, &start.position_m) {
            (Some(name), Some(p)) => {
                let e = self.doc.bad(&p.span, format!("the road begins at '{}' as well", name.value));
                return Err(e.remedy("give position_m or road with s_m and t_m").into());
            }
            (Some(name), None) => {
                let known = self.roads.iter().find(|r| r.road.name == name.value).ok_or_else(|| {
                    let names: Vec<&str> = self.roads.iter().map(|r| r.road.name.as_str()).collect();
                    let e = self.doc.bad(&name.span, "no road before this one has that name");
                    if names.is_empty() { e } else { e.allowed(names.join(", ")) }
                })?;
                let s_m =
                    start.s_m.as_ref().map_or(Ok(0.0), |s| self.doc.finite(s, "metres along that road"))?;
                let t_m = start.t_m.as_ref().map_or(Ok(0.0), |t| self.doc.finite(t, "metres to the left"))?;
                let at = known.road.axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
                (at, known.road.axis.at(s_m).heading_rad + heading)
            }
            (None, p) => {
                if let Some(s) = start.s_m.as_ref().or(start.t_m.as_ref()) {
                    return Err(self.doc.bad(&s.span, "is without a road").remedy("add start.road").into());
                }
                (p.as_ref().map_or(Ok(DVec3::ZERO), |p| self.doc.vector(p))?, heading)
            }
        };
        let mut courses = Vec::new();
        let mut curvature = 0.0;
        for e in &plan.value {
            let course = self.element(e, curvature)?;
            curvature = match course {
                Course::Arc { curvature_per_m, .. } => curvature_per_m,
                Course::Clothoid { to_per_m, .. } => to_per_m,
                _ => 0.0,
            };
            courses.push(course);
        }
        let axis = RoadAxis::new(position, heading, &courses).map_err(|e| self.at(&plan.span, e))?;
        let percent = |at: &At<f64>| -> Result<f64> {
            Ok(0.01 * self.doc.in_range(at, -100.0..=100.0, "percent, positive uphill")?)
        };
        let mut changes = Vec::new();
        for g in &t.grade {
            changes.push(GradeChange {
                s_m: self.doc.in_range(&g.s_m, 0.0..=axis.length_m(), "metres along the road")?,
                grade: percent(&g.grade_percent)?,
                k_m_per_percent: self.doc.in_range(
                    &g.k_m_per_percent,
                    0.0..=1e6,
                    "metres for each percent",
                )?,
            });
        }
        let first = percent(&t.grade_percent)?;
        let span = t.grade.first().map_or(&plan.span, |g| &g.s_m.span);
        let axis = axis.with_grades(first, &changes).map_err(|e| self.at(span, e))?;
        let Some(slope) = &t.cross_slope_percent else { return Ok(axis) };
        if let Some(p) = slope.value.0.iter().find(|p| p[1].is_nan() || p[1].abs() > 100.0) {
            let e = self.doc.bad(&slope.span, format!("{} % is out of range", p[1]));
            return Err(e
                .allowed("-100..=100")
                .remedy("percent, positive when the left side is higher")
                .into());
        }
        let pairs: Vec<[f64; 2]> = slope.value.0.iter().map(|p| [p[0], 0.01 * p[1]]).collect();
        let profile = Profile::linear(&pairs).map_err(|e| self.at(&slope.span, e))?;
        Ok(axis.with_cross_slope(profile))
    }

    fn element(&self, e: &ElementTable, before: f64) -> Result<Course> {
        let span = &e.kind.span;
        let only = |key: &str, at: &Option<At<f64>>, of: &str| match at {
            Some(a) => Err(Error::from(
                self.doc.bad(&a.span, format!("{key} is a key of {of}")).remedy("take it out"),
            )),
            None => Ok(()),
        };
        let curvature = |a: &At<f64>| -> Result<f64> {
            if a.value.is_finite() && a.value.abs() >= 0.1 {
                return Ok(1.0 / a.value);
            }
            Err(self.doc.bad(&a.span, "is no radius").allowed("0.1 m and more, negative to the right").into())
        };
        let needed = || self.missing(span, "length_m", "give the length of the element");
        if e.kind.value != ElementKind::Arc {
            only("radius_m", &e.radius_m, "an arc")?;
            only("angle_deg", &e.angle_deg, "an arc")?;
        }
        if e.kind.value != ElementKind::Clothoid {
            only("from_radius_m", &e.from_radius_m, "a clothoid")?;
            only("to_radius_m", &e.to_radius_m, "a clothoid")?;
        }
        let length = e.length_m.as_ref().map(|_| self.length(&e.length_m, 0.0)).transpose()?;
        Ok(match e.kind.value {
            ElementKind::Straight => Course::Straight { length_m: length.ok_or_else(needed)? },
            ElementKind::Arc => {
                let r = e
                    .radius_m
                    .as_ref()
                    .ok_or_else(|| self.missing(span, "radius_m", "give the arc's radius"))?;
                let k = curvature(r)?;
                let length_m = match (length, &e.angle_deg) {
                    (Some(l), None) => l,
                    (None, Some(a)) => {
                        self.doc.in_range(a, Above { low: 0.0, high: 3600.0 }, "degrees")?.to_radians()
                            / k.abs()
                    }
                    (Some(_), Some(a)) => {
                        return Err(self
                            .doc
                            .bad(&a.span, "the arc has a length as well")
                            .remedy("keep one")
                            .into());
                    }
                    (None, None) => return Err(needed()),
                };
                Course::Arc { length_m, curvature_per_m: k }
            }
            ElementKind::Clothoid => Course::Clothoid {
                length_m: length.ok_or_else(needed)?,
                from_per_m: e.from_radius_m.as_ref().map_or(Ok(before), curvature)?,
                to_per_m: e.to_radius_m.as_ref().map_or(Ok(0.0), curvature)?,
            },
        })
    }

    fn lanes(&self, side: Side, default: &Option<String>) -> Result<Vec<Lane>> {
        let (tables, base, driven) = match side {
            Side::Left => (&self.t.left, 11, Driven::Backward),
            Side::Right => (&self.t.right, 1, Driven::Forward),
        };
        let mut lanes = Vec::new();
        for (i, l) in tables.iter().enumerate() {
            if let Some(p) = l.width_m.value.0.iter().find(|p| !(0.0..=1000.0).contains(&p[1])) {
                let e = self.doc.bad(&l.width_m.span, format!("{} is no width of a lane", p[1]));
                return Err(e.allowed("0..=1000").remedy("metres").into());
            }
            let kind = l.kind.unwrap_or(LaneKind::Driving);
            let surface = match &l.surface {
                Some(s) if s.value == "none" => None,
                Some(_) => Some(self.material(&l.surface, "")?),
                None if kind.is_drivable() || kind == LaneKind::Sidewalk => default.clone(),
                None => Some("grass".into()),
            };
            lanes.push(Lane {
                number: l.number.as_ref().map_or(base + i as i32, |n| n.value),
                kind,
                driven: l.driven.unwrap_or(driven),
                width: self.series(&l.width_m)?,
                surface,
                line: l.line,
            });
        }
        Ok(lanes)
    }

    fn paint(&self, p: &PaintTable, under: &str, under_span: &Range<usize>) -> Result<Paint> {
        let length = |at: &At<f64>| self.doc.in_range(at, Above { low: 0.0, high: 1000.0 }, "give metres");
        let paint = Paint {
            width_m: length(&p.width_m)?,
            dash_m: length(&p.dash_m)?,
            gap_m: length(&p.gap_m)?,
            thickness_m: self.doc.in_range(&p.thickness_m, 1e-4..=0.05, "metres over the road")?,
            material: p.material.value.clone(),
        };
        let spec = format!("{under}+{}:{}", paint.material, paint.thickness_m);
        let span = if p.material.span.is_empty() { under_span } else { &p.material.span };
        material::parse_spec(&spec).map_err(|e| self.at(span, e))?;
        Ok(paint)
    }

    fn road(&self) -> Result<RoadPlan> {
        let t = self.t;
        if t.name.value.is_empty() || self.roads.iter().any(|r| r.road.name == t.name.value) {
            let e = self.doc.bad(&t.name.span, "is empty, or the name of another road");
            return Err(e.remedy("give each road a name of its own").into());
        }
        let surface = match &t.surface {
            Some(s) if s.value == "none" => None,
            s => Some(self.material(s, "asphalt")?),
        };
        let here = |e| self.at(&t.name.span, e);
        let paint = self.paint(&t.paint, surface.as_deref().unwrap_or("asphalt"), &t.name.span)?;
        let given = self.opendrive()?;
        let (left, right) = (self.lanes(Side::Left, &surface)?, self.lanes(Side::Right, &surface)?);
        let road = match given {
            Some(mut road) => {
                if !(left.is_empty() && right.is_empty()) {
                    (road.left, road.right, road.centre_line) = (left, right, t.centre_line);
                } else if t.surface.is_some() {
                    for lane in road.left.iter_mut().chain(&mut road.right).filter(|l| l.kind.is_drivable()) {
                        lane.surface.clone_from(&surface);
                    }
                }
                Road { name: t.name.value.clone(), paint, ..road }
            }
            None => Road {
                name: t.name.value.clone(),
                axis: self.axis()?,
                lane_offset: t.lane_offset_m.as_ref().map_or(Ok(Profile::constant(0.0)), |o| self.series(o))?,
                left,
                right,
                centre_line: t.centre_line,
                paint,
            },
        };
        road.check().map_err(here)?;
        let mut plan = RoadPlan {
            lines: Vec::new(),
            verges: Vec::new(),
            rails: Vec::new(),
            walls: Vec::new(),
            fences: Vec::new(),
            gantries: Vec::new(),
            rows: Vec::new(),
            things: Vec::new(),
            road,
        };
        let under = surface.as_deref().unwrap_or("asphalt");
        for l in &t.line {
            let under = self.material(&l.under, under)?;
            let paint = l.paint.as_ref().map(|p| self.paint(p, &under, &l.lateral.span)).transpose()?;
            plan.lines.push(LinePlan {
                lateral: self.lateral(&plan.road, &l.lateral)?,
                kind: l.kind,
                paint: paint.unwrap_or_else(|| plan.road.paint.clone()),
                under,
                span_m: self.span(&plan.road, &l.from_m, &l.to_m)?,
            });
        }
        for v in &t.verge {
            plan.verges.push(VergePlan {
                side: v.side,
                width_m: self.doc.in_range(&v.width_m, Above { low: 0.0, high: 1000.0 }, "give metres")?,
                drop_m: v
                    .drop_m
                    .as_ref()
                    .map_or(Ok(0.12), |d| self.doc.in_range(d, 0.0..=10.0, "give metres"))?,
                material: self.material(&v.material, "grass")?,
                span_m: self.span(&plan.road, &v.from_m, &v.to_m)?,
            });
        }
        self.barriers(&mut plan)?;
        for (i, r) in t.markers.iter().enumerate() {
            let row = self.row(&plan.road, r, i)?;
            plan.rows.push(row);
        }
        for (i, o) in t.object.iter().enumerate() {
            let thing = self.object(&plan.road, o, i)?;
            plan.things.push(thing);
        }
        for (i, v) in t.vehicle.iter().enumerate() {
            let thing = self.vehicle(&plan.road, v, i)?;
            plan.things.push(thing);
        }
        Ok(plan)
    }

    fn barriers(&self, plan: &mut RoadPlan) -> Result<()> {
        let t = self.t;
        for r in &t.rail {
            let lateral = self.lateral(&plan.road, &r.lateral)?;
            let span_m = self.span(&plan.road, &r.from_m, &r.to_m)?;
            let towards = if plan.road.t_m(&lateral, span_m.start) > 0.0 { Side::Right } else { Side::Left };
            plan.rails.push(RailPlan {
                lateral,
                faces: r.faces.unwrap_or(towards),
                span_m,
                height_m: r
                    .height_m
                    .as_ref()
                    .map_or(Ok(0.75), |h| self.doc.in_range(h, 0.35..=10.0, "give metres"))?,
                post_spacing_m: match &r.post_spacing_m {
                    Some(p) if p.value == 0.0 => 0.0,
                    p => self.length(p, 4.0)?,
                },
                material: self.material(&r.material, "steel")?,
            });
        }
        for (class, tables, height, thickness) in [("wall", &t.wall, 3.0, 0.2), ("kerb", &t.kerb, 0.12, 0.15)]
        {
            for w in tables {
                plan.walls.push(WallPlan {
                    class,
                    lateral: self.lateral(&plan.road, &w.lateral)?,
                    span_m: self.span(&plan.road, &w.from_m, &w.to_m)?,
                    height_m: self.length(&w.height_m, height)?,
                    thickness_m: self.length(&w.thickness_m, thickness)?,
                    material: self.material(&w.material, "concrete")?,
                });
            }
        }
        for f in &t.fence {
            plan.fences.push(FencePlan {
                lateral: self.lateral(&plan.road, &f.lateral)?,
                span_m: self.span(&plan.road, &f.from_m, &f.to_m)?,
                height_m: self.length(&f.height_m, 1.2)?,
                post_spacing_m: self.length(&f.post_spacing_m, 2.5)?,
                post_m: self.length(&f.post_m, 0.08)?,
                bars: f.bars.as_ref().map_or(Ok(3), |b| self.doc.in_range(b, 1..=100, "level bars"))?,
                bar_m: self.length(&f.bar_m, 0.04)?,
                material: self.material(&f.material, "steel")?,
            });
        }
        for g in &t.gantry {
            plan.gantries.push(GantryPlan {
                s_m: self.place(&plan.road, &g.s_m)?,
                from: self.lateral(&plan.road, &g.from)?,
                to: self.lateral(&plan.road, &g.to)?,
                clearance_m: self.length(&g.clearance_m, 5.5)?,
                beam_m: self.length(&g.beam_m, 0.8)?,
                material: self.material(&g.material, "steel")?,
            });
        }
        Ok(())
    }

    fn place(&self, road: &Road, at: &At<f64>) -> Result<f64> {
        self.doc.in_range(at, 0.0..=road.axis.length_m(), "metres along the road")
    }

    fn span(&self, road: &Road, from: &Option<At<f64>>, to: &Option<At<f64>>) -> Result<Range<f64>> {
        let end = road.axis.length_m();
        let span = from.as_ref().map_or(Ok(0.0), |a| self.place(road, a))?
            ..to.as_ref().map_or(Ok(end), |a| self.place(road, a))?;
        if span.end - span.start > 1e-6 {
            return Ok(span);
        }
        let at = to.as_ref().or(from.as_ref()).map_or(0..0, |a| a.span.clone());
        Err(self.doc.bad(&at, "ends where it begins, or before").remedy("give a to_m beyond from_m").into())
    }

    fn lateral(&self, road: &Road, at: &At<LateralTable>) -> Result<Lateral> {
        let t = &at.value;
        let count = [t.t_m.is_some(), t.lane.is_some(), t.edge.is_some()].iter().filter(|x| **x).count();
        if count != 1 {
            let e = self.doc.bad(&at.span, "says its place not at all, or twice");
            return Err(e
                .allowed("one of t_m, lane, edge")
                .remedy("for example { lane = 1, side = \"left\" }")
                .into());
        }
        if let (Some(s), None) = (&t.side, &t.lane) {
            return Err(self.doc.bad(&s.span, "is without a lane").remedy("add lane, or take it out").into());
        }
        if let (Some(o), Some(_)) = (&t.offset_m, &t.t_m) {
            return Err(self.doc.bad(&o.span, "t_m is given as well").remedy("add it to t_m").into());
        }
        let offset = t.offset_m.as_ref().or(t.t_m.as_ref());
        let offset = offset.map_or(Ok(Profile::constant(0.0)), |o| self.series(o))?;
        let base = match (&t.lane, &t.edge) {
            (Some(number), _) => {
                let found = road.lanes().find(|(_, _, l)| l.number == number.value);
                let (side, i, _) = found.ok_or_else(|| {
                    let known: Vec<String> = road.lanes().map(|(_, _, l)| l.number.to_string()).collect();
                    self.doc
                        .bad(&number.span, "the road has no lane of this number")
                        .allowed(known.join(", "))
                })?;
                Base::Lane(side, i, t.side.as_ref().map_or(InLane::Centre, |s| s.value))
            }
            (None, Some(edge)) => Base::Edge(edge.value),
            (None, None) => Base::Axis,
        };
        Ok(Lateral { base, offset })
    }

    fn reflector(&self, at: &At<String>) -> Result<Reflector> {
        let r = Reflector::parse(&at.value).map_err(|e| self.at(&at.span, e))?;
        for name in r.further_materials().iter().chain([&r.material]) {
            material::parse_spec(name).map_err(|e| self.at(&at.span, e))?;
        }
        Ok(r)
    }

    fn row(&self, road: &Road, r: &RowTable, i: usize) -> Result<RowPlan> {
        let gap = |at: &At<f64>| self.doc.in_range(at, Above { low: 0.0, high: 1e6 }, "give metres");
        let ways = [r.spacing_m.is_some(), r.gaps_m.is_some(), r.code.is_some()];
        if ways.iter().filter(|x| **x).count() != 1 {
            let e = self.doc.bad(&r.reflector.span, "says its distances not at all, or twice");
            return Err(e
                .allowed("one of spacing_m, gaps_m, code")
                .remedy("for example spacing_m = 2")
                .into());
        }
        if let (Some(c), None) = (&r.count, &r.spacing_m) {
            return Err(self.doc.bad(&c.span, "is without spacing_m").remedy("take it out").into());
        }
        let spacing = match (&r.spacing_m, &r.gaps_m, &r.code) {
            (_, _, Some(c)) => {
                if c.word.value.is_empty() || !c.word.value.bytes().all(|b| matches!(b, b'0' | b'1')) {
                    let e = self.doc.bad(&c.word.span, "is no code word").allowed("zeros and ones");
                    return Err(e.remedy("for example \"1011\"").into());
                }
                let (zero_m, one_m) = (gap(&c.zero_m)?, gap(&c.one_m)?);
                let sync_m = c.sync_m.as_ref().map(gap).transpose()?;
                if zero_m == one_m || sync_m == Some(zero_m) || sync_m == Some(one_m) {
                    let e = self.doc.bad(&c.one_m.span, "gaps of two meanings are alike");
                    return Err(e.remedy("give zero_m, one_m and sync_m different lengths").into());
                }
                let word = c.word.value.bytes().map(|b| b == b'1').collect();
                Spacing::Code { word, zero_m, one_m, sync_m }
            }
            (_, Some(g), _) => {
                if let Some(x) = g.value.iter().find(|x| !(**x > 0.0 && **x < 1e6)) {
                    let e = self.doc.bad(&g.span, format!("{x} is no gap")).allowed("more than 0");
                    return Err(e.remedy("give metres").into());
                }
                Spacing::Gaps(g.value.clone())
            }
            (Some(s), ..) => {
                Spacing::Even { spacing_m: gap(s)?, count: r.count.as_ref().map(|c| c.value as usize) }
            }
            (None, None, None) => Spacing::Gaps(Vec::new()),
        };
        let class = r.class.clone().unwrap_or_else(|| "marker".into());
        let is_marker = class == "marker";
        let lift = if is_marker { 0.002 } else { 0.0 };
        Ok(RowPlan {
            name: r.name.clone().unwrap_or_else(|| format!("{class} row {}", i + 1)),
            reflector: self.reflector(&r.reflector)?,
            lateral: self.lateral(road, &r.lateral)?,
            span_m: self.span(road, &r.from_m, &r.to_m)?,
            spacing,
            yaw_rad: r.yaw_deg.as_ref().map_or(Ok(std::f64::consts::PI), |y| self.angle(y))?,
            turn_rad: self.angle(&r.turn_deg)?,
            pitch_rad: self.angle(&r.pitch_deg)?,
            roll_rad: self.angle(&r.roll_deg)?,
            lift_m: r
                .lift_m
                .as_ref()
                .map_or(Ok(lift), |l| self.doc.in_range(l, -10.0..=100.0, "give metres"))?,
            lying: !r.upright.unwrap_or(!is_marker),
            class,
        })
    }

    fn object(&self, road: &Road, o: &ObjectTable, i: usize) -> Result<ThingPlan> {
        let (source, class) = match (&o.reflector, &o.file) {
            (Some(r), None) => {
                let r = self.reflector(r)?;
                let class = if r.kind().name.starts_with("manhole") { "manhole" } else { "reflector" };
                (Source::Reflector(r), class)
            }
            (None, Some(f)) => {
                let path = self.beside(f)?;
                (Source::File(gltf::import(&path, &ImportOptions::default())?), "")
            }
            _ => {
                let e = self.doc.bad(&o.s_m.span, "the object is nothing, or two things");
                return Err(e.allowed("one of reflector, file").into());
            }
        };
        Ok(ThingPlan {
            name: o.name.clone().unwrap_or_else(|| format!("object {}", i + 1)),
            class: o.class.clone().unwrap_or_else(|| class.into()),
            source,
            s_m: self.place(road, &o.s_m)?,
            lateral: self.lateral(road, &o.lateral)?,
            yaw_rad: self.angle(&o.yaw_deg)?,
            pitch_rad: self.angle(&o.pitch_deg)?,
            roll_rad: self.angle(&o.roll_deg)?,
            lift_m: self.doc.in_range(&o.lift_m, -100.0..=1000.0, "give metres")?,
            speed_mps: self.speed(&o.speed_mps)?,
            lying: !o.upright,
        })
    }

    fn vehicle(&self, road: &Road, v: &VehicleTable, i: usize) -> Result<ThingPlan> {
        if !VEHICLES.contains(&v.kind.value.as_str()) {
            let e = self.doc.bad(&v.kind.span, "is not a kind of vehicle").allowed(VEHICLES.join(", "));
            return Err(match crate::error::nearest(&v.kind.value, VEHICLES) {
                Some(n) => e.remedy(format!("did you mean '{n}'?")),
                None => e,
            }
            .into());
        }
        let lateral = self.lateral(road, &v.lateral)?;
        let back = match lateral.base {
            Base::Lane(side, i, _) => road.side(side)[i].driven == Driven::Backward,
            _ => false,
        };
        Ok(ThingPlan {
            name: v.name.clone().unwrap_or_else(|| format!("{} {}", v.kind.value, i + 1)),
            class: String::new(),
            source: Source::Vehicle(v.kind.value.clone()),
            s_m: self.place(road, &v.s_m)?,
            lateral,
            yaw_rad: self.angle(&v.heading_deg)? + if back { std::f64::consts::PI } else { 0.0 },
            pitch_rad: 0.0,
            roll_rad: 0.0,
            lift_m: 0.0,
            speed_mps: self.speed(&v.speed_mps)?,
            lying: true,
        })
    }
}

/// The pose in the world of a place on a road of the plan, x along the road: where to put an ego vehicle.
///
/// Errors: an unknown road.
pub fn pose_on_road(
    plan: &ScenePlan,
    road: &str,
    s_m: f64,
    t_m: f64,
) -> Result<Pose<crate::frames::Target, crate::frames::World>> {
    let found = plan.roads.iter().find(|r| r.road.name == road).ok_or_else(|| {
        let names: Vec<&str> = plan.roads.iter().map(|r| r.road.name.as_str()).collect();
        BadInput::new("is not a road of the scene").key("road").value(road).allowed(names.join(", "))
    })?;
    Ok(found.road.axis.pose(RoadPoint { s_m, t_m, h_m: 0.0 }, 0.0, true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::build::build;
    use crate::road::glb;
    use crate::road::labels::RoadTruth;
    use crate::road::shape::area_vector_m2;
    use crate::scene::{Scene, Shape};
    use std::collections::HashSet;

    const FILES: [(&str, &str); 17] = [
        ("crest", include_str!("../../scenes/road/road_crest.toml")),
        ("eight_lanes", include_str!("../../scenes/road/road_eight_lanes.toml")),
        ("eight_lanes_bay", include_str!("../../scenes/road/road_eight_lanes_bay.toml")),
        ("eight_lanes_curve", include_str!("../../scenes/road/road_eight_lanes_curve.toml")),
        ("eight_lanes_ramp", include_str!("../../scenes/road/road_eight_lanes_ramp.toml")),
        ("everything", include_str!("../../scenes/road/road_everything.toml")),
        ("lane_3m", include_str!("../../scenes/road/road_lane_3m.toml")),
        ("lane_3m_bend", include_str!("../../scenes/road/road_lane_3m_bend.toml")),
        ("metal_plates", include_str!("../../scenes/road/road_metal_plates.toml")),
        ("model_left_curve", include_str!("../../scenes/road/road_model_left_curve.toml")),
        ("model_right_angle_left", include_str!("../../scenes/road/road_model_right_angle_left.toml")),
        ("model_right_angle_right", include_str!("../../scenes/road/road_model_right_angle_right.toml")),
        ("model_right_curve", include_str!("../../scenes/road/road_model_right_curve.toml")),
        ("model_straight", include_str!("../../scenes/road/road_model_straight.toml")),
        ("sound_wall", include_str!("../../scenes/road/road_sound_wall.toml")),
        ("test_field", include_str!("../../scenes/road/road_test_field.toml")),
        ("walled_bend", include_str!("../../scenes/road/road_walled_bend.toml")),
    ];

    fn made(text: &str) -> (ScenePlan, Scene, RoadTruth) {
        let plan = parse(Path::new("a.toml"), text).unwrap();
        let (scene, truth) = build(&plan, &material::parse_spec).unwrap();
        (plan, scene, truth)
    }

    fn file(name: &str) -> (ScenePlan, Scene, RoadTruth) {
        made(FILES.iter().find(|f| f.0 == name).unwrap().1)
    }

    fn count(scene: &Scene, class: &str) -> usize {
        scene.objects.iter().filter(|o| o.class == class).count()
    }

    #[test]
    fn all_files_build_and_come_back_from_gltf() {
        for (name, text) in FILES {
            let (_, scene, truth) = made(text);
            let names: HashSet<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
            assert_eq!(names.len(), scene.objects.len(), "{name}");
            assert!(scene.objects.iter().all(|o| !o.class.is_empty()), "{name}");
            for (m, mesh) in scene.meshes.iter().enumerate() {
                for t in 0..mesh.triangles.len() {
                    assert!(area_vector_m2(mesh, t).length() > 1e-10, "{name} mesh {m} triangle {t}");
                }
            }
            assert!(scene.triangle_count() < 60_000, "{name}: {}", scene.triangle_count());
            let bytes = glb::to_glb(&scene, &truth).unwrap();
            let back = gltf::import_bytes(&bytes, Path::new("x.glb"), None, &ImportOptions::default()).unwrap();
            assert_eq!(back.meshes.len(), scene.meshes.len(), "{name}");
            for (m, (a, b)) in scene.meshes.iter().zip(&back.meshes).enumerate() {
                assert_eq!(a.material, b.material, "{name} mesh {m}");
                for (t, (p, q)) in corners(a).into_iter().zip(corners(b)).enumerate() {
                    assert_eq!(p.0, q.0, "{name} mesh {m} triangle {t}");
                    assert_eq!(p.1.is_some(), q.1.is_some(), "{name} mesh {m} triangle {t}");
                    let normals = p.1.into_iter().flatten().zip(q.1.into_iter().flatten());
                    assert!(normals.into_iter().all(|(n, k)| (n - k).length() < 1e-6), "{name} mesh {m} triangle {t}");
                }
            }
            assert_eq!(back.materials, scene.materials, "{name}");
            assert_eq!(back.objects.len(), scene.objects.len());
            for (a, b) in scene.objects.iter().zip(&back.objects) {
                assert_eq!((a.id, &a.name, &a.class, a.shape), (b.id, &b.name, &b.class, b.shape), "{name}");
                assert!((a.velocity_mps - b.velocity_mps).length() < 1e-12, "{name} {}", a.name);
                assert!((a.pose.translation_m - b.pose.translation_m).length() < 1e-9);
                assert!((a.pose.rotation.dot(b.pose.rotation).abs() - 1.0).abs() < 1e-12);
            }
            assert_eq!(back.import.degenerate_triangles_dropped, 0, "{name}");
            assert_eq!(glb::truth_of(&bytes).unwrap(), Some(truth), "{name}");
            println!(
                "{name}: {} objects, {} triangles, {} bytes",
                scene.objects.len(),
                scene.triangle_count(),
                bytes.len()
            );
        }
    }

    /// Corners and normals of each triangle: vertices may be numbered in another way.
    fn corners(m: &crate::scene::Mesh) -> Vec<([DVec3; 3], Option<[DVec3; 3]>)> {
        let at = |t: usize| m.triangles[t].map(|i| m.positions_m[i as usize]);
        (0..m.triangles.len()).map(|t| (at(t), m.corner_normals(t))).collect()
    }

    /// Straight down from `p`, the heights of the faces that look up, and their objects' classes.
    fn below(scene: &Scene, x: f64, y: f64) -> Vec<(f64, String)> {
        let mut hits = Vec::new();
        for o in &scene.objects {
            let Shape::Mesh(m) = o.shape else { continue };
            let mesh = &scene.meshes[m];
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| o.pose.point(mesh.positions_m[i as usize]));
                let flat = |p: DVec3| p.truncate();
                let (u, v, p) = (flat(b - a), flat(c - a), glam::DVec2::new(x, y) - flat(a));
                let det = u.perp_dot(v);
                if det <= 1e-12 {
                    continue;
                }
                let (i, j) = (p.perp_dot(v) / det, u.perp_dot(p) / det);
                if i >= -1e-9 && j >= -1e-9 && i + j <= 1.0 + 1e-9 {
                    hits.push((a.z + i * (b.z - a.z) + j * (c.z - a.z), o.class.clone()));
                }
            }
        }
        hits
    }

    #[test]
    fn paint_lies_on_the_road_and_the_road_has_no_holes() {
        let (plan, scene, truth) = file("everything");
        let axis = &plan.roads[0].road.axis;
        // The wear of the test: every 7 m, every 0.37 m across.
        let mut s_m = 3.3;
        while s_m < axis.length_m() {
            let mut t_m = -6.2;
            while t_m < 6.4 {
                let p = axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
                let hits = below(&scene, p.x, p.y);
                let road: Vec<f64> = hits.iter().filter(|h| h.1 == "road").map(|h| h.0).collect();
                assert!(!road.is_empty() && road.iter().all(|z| (z - road[0]).abs() < 1e-4), "{s_m} {t_m} {hits:?}");
                assert!((road[0] - p.z).abs() < 0.011, "{} {}", road[0], p.z);
                for (z, _) in hits.iter().filter(|h| h.1 == "lane_line") {
                    assert!((z - road[0] - 0.0015).abs() < 2e-4, "{s_m} {t_m} {}", z - road[0]);
                }
                t_m += 0.37;
            }
            s_m += 7.0;
        }
        for l in &truth.roads[0].lines {
            for p in &l.points_m[1..l.points_m.len() - 1] {
                let hits = below(&scene, p[0], p[1]);
                assert!(hits.iter().any(|h| h.1 != "lane_line" && (p[2] - h.0 - 0.0015).abs() < 2e-4), "{} {p:?} {hits:?}", l.name);
            }
        }
    }

    #[test]
    fn markers_stand_on_the_facets_and_spell_their_word() {
        let (plan, scene, truth) = file("everything");
        assert_eq!(truth.marker_rows.len(), 2, "poles are no markers");
        let row = &truth.marker_rows[0];
        assert_eq!(row.word.as_deref(), Some("1011"));
        let gaps: Vec<f64> = row.markers.windows(2).map(|w| w[1].s_m - w[0].s_m).collect();
        for (gap, m) in gaps.iter().zip(&row.markers) {
            let expected = m.bit.map_or(3.0, |b| if b == 1 { 1.5 } else { 2.0 });
            assert!((gap - expected).abs() < 1e-6);
        }
        assert_eq!(row.markers[..6].iter().map(|m| m.bit).collect::<Vec<_>>(), [Some(0), Some(1), Some(2), Some(3), None, Some(0)]);
        let axis = &plan.roads[0].road.axis;
        for m in &row.markers {
            let o = scene.object_by_id(m.id).unwrap();
            assert_eq!(o.class, "marker");
            assert!((o.pose.translation_m - DVec3::from_array(m.position_m)).length() < 1e-6);
            let p = o.pose.translation_m;
            let road = below(&scene, p.x, p.y).iter().filter(|h| h.1 == "road").map(|h| h.0).fold(f64::MIN, f64::max);
            assert!((p.z - road - 0.002).abs() < 1e-4, "{} over {road}", p.z);
            let q = axis.project(p);
            assert!((q.s_m - m.s_m).abs() < 1e-3 && (q.t_m + 3.25).abs() < 1e-3, "{q:?}");
            // Boresight back along the road.
            let ahead = axis.at(m.s_m).heading_rad;
            let x = o.pose.direction(DVec3::X);
            assert!((x.truncate().normalize() + glam::DVec2::from_angle(ahead)).length() < 2e-3);
        }
        let meshes: HashSet<String> = row.markers.iter().map(|m| format!("{:?}", scene.object_by_id(m.id).unwrap().shape)).collect();
        assert_eq!(meshes.len(), 1, "a row shares its mesh");
        let turn = &truth.marker_rows[1].markers;
        assert_eq!(turn.len(), 12);
        let heading = |i: usize| {
            let x = scene.object_by_id(turn[i].id).unwrap().pose.direction(DVec3::X);
            x.y.atan2(x.x)
        };
        assert!((heading(1) - heading(0) - 15f64.to_radians()).abs() < 2e-3, "both stand on the straight");
    }

    #[test]
    fn lanes_lines_and_traffic_of_the_eight_lane_roads() {
        let (_, scene, truth) = file("eight_lanes");
        let road = &truth.roads[0];
        let numbers: Vec<i32> = road.lanes.iter().map(|l| l.number).collect();
        assert_eq!(numbers, [14, 13, 12, 11, 10, 0, 1, 2, 3, 4]);
        assert_eq!(road.lines.len(), 8);
        assert_eq!(road.free_space_m.len(), 2, "the median parts the carriageways");
        // Counter-clockwise: the shoelace formula is positive.
        for outline in &road.free_space_m {
            let next = outline.iter().cycle().skip(1);
            let area: f64 = outline.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum();
            assert!((area - 400.0 * (3.0 * 3.75 + 3.0)).abs() < 1e-6, "{area}");
        }
        let y = |n: i32| road.lanes.iter().find(|l| l.number == n).unwrap().centre_m[0][1];
        assert_eq!((y(1), y(12), y(4)), (-1.0 - 1.875, 1.0 + 1.5 * 3.75, -1.0 - 3.0 * 3.75 - 1.5));
        let oncoming = scene.objects.iter().find(|o| o.name.ends_with("passenger-car 4")).unwrap();
        assert!((oncoming.velocity_mps - DVec3::new(-31.0, 0.0, 0.0)).length() < 1e-12);
        assert_eq!((count(&scene, "guard_rail"), count(&scene, "post"), count(&scene, "car")), (4, 4 * 101, 4));
        // The dashes of a line: 6 m of paint in 18.
        let line = scene.objects.iter().find(|o| o.name == "motorway/line of lane 1").unwrap();
        let Shape::Mesh(m) = line.shape else { panic!() };
        let area: f64 = (0..scene.meshes[m].triangles.len()).map(|t| area_vector_m2(&scene.meshes[m], t).z).sum();
        // 22 whole dashes and 4 m of another.
        assert!((area - 0.12 * (22.0 * 6.0 + 4.0)).abs() < 1e-4, "{area}");
        // All of the pavement is two flat sheets, in as few facets as can be.
        let paved: usize = scene
            .objects
            .iter()
            .filter(|o| o.class == "road")
            .map(|o| match o.shape {
                Shape::Mesh(m) => scene.meshes[m].triangles.len(),
                _ => 0,
            })
            .sum();
        assert_eq!(paved, 4);

        let (_, _, bay) = file("eight_lanes_bay");
        let lane = bay.roads[0].lanes.iter().find(|l| l.number == 5).unwrap();
        let widest = lane.width_m.iter().copied().fold(0.0, f64::max);
        assert_eq!((lane.width_m[0], widest), (0.0, 3.5));
        let line = bay.roads[0].lines.iter().find(|l| l.name.ends_with("lane 5")).unwrap();
        // Begins where the lane is twice as wide as the paint: 0.24 m of 3.5 m over 15 m.
        assert!((line.points_m[0][0] - (150.0 + 15.0 * 0.24 / 3.5)).abs() < 1e-6, "{:?}", line.points_m[0]);
    }

    #[test]
    fn rails_and_walls_look_at_the_road() {
        for (name, class, side) in [("sound_wall", "guard_rail", 1.0), ("eight_lanes_curve", "guard_rail", 0.0), ("walled_bend", "wall", 0.0)] {
            let (plan, scene, _) = file(name);
            let axis = &plan.roads[0].road.axis;
            for o in scene.objects.iter().filter(|o| o.class == class) {
                let Shape::Mesh(m) = o.shape else { panic!() };
                let mesh = &scene.meshes[m];
                let mut towards = [0.0, 0.0];
                for t in 0..mesh.triangles.len() {
                    let c = mesh.triangles[t].map(|i| mesh.positions_m[i as usize]).iter().sum::<DVec3>() / 3.0;
                    let p = axis.project(o.pose.point(c));
                    let left = glam::DVec2::from_angle(axis.at(p.s_m).heading_rad).perp();
                    let n = o.pose.direction(area_vector_m2(mesh, t)).truncate().dot(left);
                    towards[usize::from(n > 0.0)] += n.abs();
                }
                if class == "wall" {
                    assert!((towards[0] - towards[1]).abs() < 0.02 * towards[0], "a wall is closed: {towards:?}");
                } else {
                    assert!(towards[0].min(towards[1]) < 1e-6, "a rail is a sheet: {towards:?}");
                    assert!(side == 0.0 || towards[1] > 1.0, "the right one looks left");
                }
            }
        }
        let (plan, scene, _) = file("sound_wall");
        let wall = scene.objects.iter().find(|o| o.class == "wall").unwrap();
        let Shape::Mesh(m) = wall.shape else { panic!() };
        assert!(crate::road::shape::is_watertight(&scene.meshes[m]));
        let v = crate::road::shape::volume_m3(&scene.meshes[m]);
        assert!((v - 150.0 * 0.2 * 3.05).abs() < 1e-3, "{v}");
        // Beams as long as the road where it is straight.
        assert!(scene.objects.iter().filter(|o| o.class == "guard_rail").all(|o| match o.shape {
            Shape::Mesh(m) => scene.meshes[m].triangles.len() == 14,
            _ => false,
        }));
        let car = |name: &str| scene.objects.iter().find(|o| o.name.ends_with(name)).unwrap().pose.translation_m;
        assert!((car("passenger-car 1") - DVec3::new(67.0, -1.875, 0.0)).length() < 1e-9);
        assert_eq!(plan.roads[0].road.axis.length_m(), 150.0);
    }

    #[test]
    fn plates_lie_every_eight_metres() {
        let (_, scene, truth) = file("metal_plates");
        let row = &truth.marker_rows[0];
        assert_eq!(row.markers.len(), 14);
        let boxes = crate::road::truth_boxes(&scene, 0.0);
        for (i, m) in row.markers.iter().enumerate() {
            let o = scene.object_by_id(m.id).unwrap();
            assert!((o.pose.direction(DVec3::X) - DVec3::Z).length() < 1e-12, "looks up");
            assert!((o.pose.direction(DVec3::Z).x.abs() - 1.0).abs() < 1e-12, "lies along the road");
            let b = boxes.iter().find(|b| b.id == m.id).unwrap();
            let at = DVec3::from_array(b.centre_m);
            assert!((at - DVec3::new(10.0 + 8.0 * i as f64, -3.5, 0.002)).length() < 1e-6, "{at}");
            assert!((b.size_m[2] - 3.0).abs() < 1e-6 && (b.size_m[1] - 0.15).abs() < 1e-6);
        }
        assert_eq!(count(&scene, "manhole"), 2);
    }

    #[test]
    fn bad_files_are_refused_in_one_line() {
        let base = "name = \"x\"\n[[road]]\nname = \"r\"\nplan = [{ kind = \"straight\", length_m = 100 }]\nright = [{ width_m = 3.5 }]\n";
        let complaint = |text: &str| {
            let e = parse(Path::new("a.toml"), text).and_then(|p| build(&p, &material::parse_spec)).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            let e = e.to_string();
            assert!(!e.contains('\n'), "{e}");
            e
        };
        assert!(parse(Path::new("a.toml"), base).is_ok());
        let with = |extra: &str| complaint(&format!("{base}{extra}"));
        let changed = |from: &str, to: &str| complaint(&base.replace(from, to));
        for (got, expect) in [
            (changed("width_m = 3.5", "width_m = -3.5"), "a.toml:5: road[0].right[0].width_m = -3.5: -3.5 is no width of a lane"),
            (changed("width_m = 3.5", "width_m = [[0, 1], [-5, 2]]"), "runs backwards"),
            (changed("width_m = 3.5", "widht_m = 3.5"), "did you mean 'width_m'?"),
            (changed("width_m = 3.5", "width_m = 3.5, surface = \"asfalt\""), "did you mean 'asphalt'?"),
            (changed("length_m = 100", "length_m = -100"), "road[0].plan[0].length_m = -100: is out of range"),
            (changed("length_m = 100", "length_m = 100, radius_m = 50"), "radius_m is a key of an arc"),
            (changed("\"straight\"", "\"arc\""), "radius_m is missing"),
            (changed("\"straight\"", "\"spiral\""), "is not one of the choices; allowed: straight, arc, clothoid"),
            (changed("kind = \"straight\", length_m = 100", "kind = \"arc\", radius_m = 0.01, length_m = 3"), "is no radius"),
            (with("grade_percent = 5\ngrade = [{ s_m = 10, grade_percent = -5, k_m_per_percent = 10 }]"), "its curve overlaps the one before or leaves the road"),
            (with("[[road.rail]]\nlateral = { t_m = 3, lane = 1 }"), "says its place not at all, or twice"),
            (with("[[road.rail]]\nlateral = { lane = 7 }"), "the road has no lane of this number; allowed: 1"),
            (with("[[road.rail]]\nlateral = { t_m = 3 }\nfrom_m = 50\nto_m = 20"), "a.toml:9: road[0].rail[0].to_m = 20: ends where it begins, or before"),
            (with("[[road.rail]]\nlateral = { t_m = 3 }\nto_m = 200"), "is out of range; allowed: 0..=100"),
            (with("[[road.rail]]\nlateral = { t_m = 3 }\npost_spacing_m = 0.0001"), "needs too many objects"),
            (with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type11\"\nspacing_m = 2"), "did you mean 'type1'?"),
            (with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\""), "one of spacing_m, gaps_m, code"),
            (with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\nspacing_m = 0"), "is out of range; allowed: more than 0"),
            (with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\ncode = { word = \"12\", zero_m = 1, one_m = 2 }"), "is no code word"),
            (with("[[road.markers]]\nlateral = { t_m = 0 }\nreflector = \"type1\"\ncode = { word = \"1\", zero_m = 1, one_m = 1 }"), "gaps of two meanings are alike"),
            (with("[[road.vehicle]]\nkind = \"passenger-cra\"\ns_m = 5\nlateral = { lane = 1 }"), "did you mean 'passenger-car'?"),
            (with("[[road.object]]\nfile = \"../x.glb\"\ns_m = 5\nlateral = { lane = 1 }"), "leaves the folder of the scene file"),
            (with("[[road]]\nname = \"r\"\nplan = []"), "is empty, or the name of another road"),
            (with("[[road]]\nname = \"q\"\nplan = [{ kind = \"straight\", length_m = 10 }]\nright = [{ width_m = 3 }]"), "the surface of road 'q' lies in that of road 'r'"),
            (with("opendrive = \"../a.xodr\""), "is given by the OpenDRIVE file as well"),
            (changed("plan = [{ kind = \"straight\", length_m = 100 }]", "opendrive = \"../a.xodr\""), "leaves the folder of the scene file"),
            (changed("plan = [{ kind = \"straight\", length_m = 100 }]", "opendrive = \"no.xodr\""), "no.xodr: no such file"),
            (changed("plan = [{ kind = \"straight\", length_m = 100 }]", ""), "plan is missing"),
            (with("[[road]]\nname = \"q\"\nstart = { road = \"s\" }\nplan = []"), "no road before this one has that name; allowed: r"),
            (complaint("name = \"x\"\nroad = []"), "the scene has no road"),
        ] {
            assert!(got.contains(expect), "got {got}\nexpected {expect}");
        }
    }

    #[test]
    fn schema_names_the_units() {
        let (_, text) = schema();
        assert!(text.contains("cross_slope_percent") && text.contains("from_radius_m") && text.contains("Series"));
    }
}
