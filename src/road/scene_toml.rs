//! The TOML description of a road scene, for `catseye scene FILE.toml`: from its tables to a checked plan. Complaints
//! name the place in the file.

use crate::base::error::{Error, Result};
use crate::road::axis::{Course, GradeChange, RoadAxis, RoadPoint};
use crate::road::build::{MAX_ROW, places};
use crate::road::layout::{Base, Driven, InLane, Lane, LaneKind, Lateral, LineKind, Paint, Road, Side};
use crate::road::opendrive::{self, ReadRoad};
use crate::road::plan::{
    DEFAULT_DURATION_S, DEFAULT_SAGITTA_M, FencePlan, GantryPlan, LinePlan, RailPlan, RoadPlan, RowPlan,
    ScenePlan, Source, Spacing, ThingPlan, VergePlan, WallPlan,
};
use crate::road::profile::Profile;
use crate::road::reflector::Reflector;
use crate::road::scene_tables::{
    ElementKind, ElementTable, LateralTable, MaterialTable, ObjectTable, PaintTable, RoadTable, RowTable,
    SceneFile, Series, VehicleTable,
};
use crate::road::traffic::{VEHICLES, unknown};
use crate::scene::backscatter::Backscatter;
use crate::scene::drive::{self, Drive};
use crate::scene::material::{self, Given, Material};
use crate::scene::mesh_file::{self, ImportTable};
use crate::scene::toml_file::{At, Document, read_text};
use glam::DVec3;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

/// Reads and checks a file.
///
/// # Errors
/// Returns an error of one line with file, line, key, value and remedy if the file cannot be read or a value is not
/// allowed.
pub fn load(path: &Path) -> Result<ScenePlan> {
    parse(path, &read_text(path)?)
}

/// Parses a text as [`load`] does a file; `file` is named in errors, and glTF files are looked for in its folder.
///
/// # Errors
/// Returns the errors of [`load`].
pub fn parse(file: &Path, text: &str) -> Result<ScenePlan> {
    let doc = Document::parse(file, text)?;
    let f: SceneFile = doc.read()?;
    let materials = own_materials(&doc, &f.material)?;
    let mut roads: Vec<RoadPlan> = Vec::new();
    let mut warnings: Vec<String> = Vec::new();
    for t in &f.road {
        let (plan, of_road) = Reader { doc: &doc, t, roads: &roads, materials: &materials }.road()?;
        roads.push(plan);
        // Two roads may come from one file.
        for w in of_road {
            if !warnings.contains(&w) {
                warnings.push(w);
            }
        }
    }
    let sagitta_m = f.sagitta_m.unwrap_or(DEFAULT_SAGITTA_M);
    let duration_s = f.duration_s.unwrap_or(DEFAULT_DURATION_S);
    Ok(ScenePlan { name: f.name, sagitta_m, duration_s, materials, roads, warnings })
}

/// JSON schema of the file: (file name in `schema/`, text).
pub fn schema() -> (&'static str, String) {
    let schema = schemars::schema_for!(SceneFile);
    ("road_scene.schema.json", serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n")
}

/// A complaint of another room with the place in this file.
fn placed(doc: &Document<'_>, span: &Range<usize>, e: Error) -> Error {
    match e {
        Error::Input(b) => {
            let problem = match (&b.key, &b.value) {
                (Some(k), Some(v)) => format!("{k} = {v}: {}", b.problem),
                (Some(k), None) => format!("{k}: {}", b.problem),
                (None, Some(v)) => format!("{v}: {}", b.problem),
                (None, None) => b.problem.clone(),
            };
            let mut here = doc.bad(span, problem);
            (here.allowed, here.remedy, here.allowed_whole) = (b.allowed, b.remedy, b.allowed_whole);
            here.into()
        }
        e => e,
    }
}

/// The materials that the file says itself.
fn own_materials(doc: &Document<'_>, tables: &[MaterialTable]) -> Result<Vec<Material>> {
    let mut made: Vec<Material> = Vec::new();
    for t in tables {
        let name = t.name.value.trim();
        let bad = |problem: &str, remedy: &str| doc.bad(&t.name.span, problem).remedy(remedy);
        if name.is_empty() || name.contains('+') || name != t.name.value || name == "none" {
            let e = bad("is not a name for a material", "give letters, digits, spaces and hyphens");
            return Err(e.allowed("a name without + and without spaces around it, other than none").into());
        }
        if material::by_name(name).is_ok() || made.iter().any(|m| m.name == name) {
            let known = bad(
                "is the name of an existing material",
                "choose another name, and give like = \"the existing one\"",
            );
            return Err(known.into());
        }
        let pair = |at: &Option<At<[f64; 2]>>, good: fn([f64; 2]) -> bool, allowed: &str| {
            let Some(a) = at else { return Ok(None) };
            if a.value.iter().all(|v| v.is_finite()) && good(a.value) {
                return Ok(Some(a.value));
            }
            let e = doc.bad(&a.span, "is not a valid pair of numbers").value(format!("{:?}", a.value));
            Err(Error::from(e.allowed(allowed.to_string())))
        };
        let base = t
            .like
            .as_ref()
            .map(|l| material::parse_spec_among(&l.value, &made).map_err(|e| placed(doc, &l.span, e)));
        let law =
            t.backscatter.as_ref().map(|b| Backscatter::parse(&b.value).map_err(|e| placed(doc, &b.span, e)));
        let given = Given {
            eps_r: pair(
                &t.eps_r,
                |[re, loss]| re > 0.0 && loss >= 0.0,
                "eps' above 0, eps'' (loss) 0 or more",
            )?,
            conductivity_s_per_m: t.conductivity_s_per_m,
            roughness_rms_m: t.roughness_rms_m,
            correlation_length_m: t.correlation_length_m,
            backscatter: law.transpose()?,
            valid_hz: pair(&t.valid_hz, |[lo, hi]| lo >= 0.0 && lo < hi, "lowest and highest frequency, Hz")?
                .map(|[lo, hi]| (lo, hi)),
            source: t.source.clone(),
        };
        let m = given.over(name, base.transpose()?, "given in the road scene").ok_or_else(|| {
            let e = bad("has no electrical properties", "give like = \"asphalt\", or eps_r");
            e.allowed("at least one of like, eps_r, conductivity_s_per_m")
        })?;
        made.push(m);
    }
    Ok(made)
}

/// What reads a road.
struct Reader<'a> {
    doc: &'a Document<'a>,
    t: &'a RoadTable,
    /// Those that stand before it in the file.
    roads: &'a [RoadPlan],
    /// Materials of the file's own.
    materials: &'a [Material],
}

impl Reader<'_> {
    /// A complaint of another room with the place in this file.
    fn at(&self, span: &Range<usize>, e: Error) -> Error {
        placed(self.doc, span, e)
    }

    fn missing(&self, span: &Range<usize>, key: &str, remedy: &str) -> Error {
        self.doc.bad(span, format!("{key} is missing")).remedy(remedy).into()
    }

    fn series(&self, at: &At<Series>) -> Result<Profile> {
        Profile::linear(&at.value.0).map_err(|e| self.at(&at.span, e))
    }

    /// The error of a value that is not allowed where it stands.
    fn refuse<T>(&self, span: &Range<usize>, problem: impl Into<String>, remedy: &str) -> Result<T> {
        Err(self.doc.bad(span, problem).remedy(remedy).into())
    }

    /// Errors when so many steps from `span_m`'s beginning to its end are more than [`MAX_ROW`].
    fn few(&self, at: &Range<usize>, span_m: &Range<f64>, step_m: f64, what: &str) -> Result<()> {
        let count = (span_m.end - span_m.start) / step_m;
        if count <= MAX_ROW as f64 {
            return Ok(());
        }
        let e = self.doc.bad(at, format!("makes {count:.0} {what}"));
        Err(e.allowed(format!("up to {MAX_ROW}")).remedy("use larger distances or a shorter span").into())
    }

    /// A material's name or spec that exists, or the default.
    fn material(&self, at: &Option<At<String>>, default: &str) -> Result<String> {
        let Some(a) = at else { return Ok(default.into()) };
        material::parse_spec_among(&a.value, self.materials).map_err(|e| self.at(&a.span, e))?;
        Ok(a.value.clone())
    }

    /// A path below the folder of this file.
    fn beside(&self, name: &At<String>) -> Result<PathBuf> {
        let relative = Path::new(&name.value);
        if relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
            return self.doc.beside(name);
        }
        let e = self.doc.bad(&name.span, "leaves the folder of the scene file");
        Err(e.allowed("a name below that folder").remedy("copy the file beside the scene file").into())
    }

    /// The road of an OpenDRIVE file, when one is named.
    fn opendrive(&self) -> Result<Option<ReadRoad>> {
        let t = self.t;
        let Some(name) = &t.opendrive else {
            if let Some(r) = &t.opendrive_road {
                return self.refuse(&r.span, "needs opendrive", "give the name of the file");
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
            return self.refuse(span, "is also given by the OpenDRIVE file", "remove it or opendrive");
        }
        let path = self.beside(name)?;
        let id = t.opendrive_road.as_ref();
        match (opendrive::read(&path, id.map(|i| i.value.as_str()))?, id) {
            (Ok(read), _) => Ok(Some(read)),
            (Err(ids), Some(id)) => {
                let e = self.doc.bad(&id.span, "is not a road of the OpenDRIVE file").allowed(ids.join(", "));
                Err(e.into())
            }
            (Err(_), None) => self.refuse(&name.span, "has no road", "give another file"),
        }
    }

    fn axis(&self) -> Result<RoadAxis> {
        let t = self.t;
        let Some(plan) = &t.plan else {
            let remedy = "list the elements of the axis, or give opendrive";
            return Err(self.missing(&t.name.span, "plan", remedy));
        };
        let start = &t.start;
        let heading = start.heading_deg.to_radians();
        let (position, heading) = match (&start.road, &start.position_m) {
            (Some(name), Some(p)) => {
                return self.refuse(
                    &p.span,
                    format!("the road also begins at '{}'", name.value),
                    "give position_m or road with s_m and t_m",
                );
            }
            (Some(name), None) => {
                let known = self.roads.iter().find(|r| r.road.name == name.value).ok_or_else(|| {
                    let names: Vec<&str> = self.roads.iter().map(|r| r.road.name.as_str()).collect();
                    let e = self.doc.bad(&name.span, "no earlier road has this name");
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
                    return self.refuse(&s.span, "needs start.road", "add start.road");
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
        let mut changes = Vec::new();
        for g in &t.grade {
            changes.push(GradeChange {
                s_m: self.doc.in_range(&g.s_m, 0.0..=axis.length_m(), "metres along the road")?,
                grade: 0.01 * g.grade_percent,
                k_m_per_percent: g.k_m_per_percent,
            });
        }
        let first = 0.01 * t.grade_percent;
        let span = t.grade.first().map_or(&plan.span, |g| &g.s_m.span);
        let axis = axis.with_grades(first, &changes).map_err(|e| self.at(span, e))?;
        let Some(slope) = &t.cross_slope_percent else { return Ok(axis) };
        if let Some(p) = slope.value.0.iter().find(|p| p[1].is_nan() || p[1].abs() > 100.0) {
            let e = self.doc.bad(&slope.span, format!("{} % is out of range", p[1]));
            return Err(e
                .allowed("-100..=100")
                .remedy("give percent, positive when the left side is higher")
                .into());
        }
        let pairs: Vec<[f64; 2]> = slope.value.0.iter().map(|p| [p[0], 0.01 * p[1]]).collect();
        let profile = Profile::linear(&pairs).map_err(|e| self.at(&slope.span, e))?;
        Ok(axis.with_cross_slope(profile))
    }

    fn element(&self, e: &ElementTable, before: f64) -> Result<Course> {
        let span = &e.kind.span;
        let only = |key: &str, at: &Option<At<f64>>, of: &str| match at {
            Some(a) => {
                Err(Error::from(self.doc.bad(&a.span, format!("{key} is a key of {of}")).remedy("remove it")))
            }
            None => Ok(()),
        };
        let curvature = |a: &At<f64>| -> Result<f64> {
            if a.value.is_finite() && a.value.abs() >= 0.1 {
                return Ok(1.0 / a.value);
            }
            Err(self
                .doc
                .bad(&a.span, "is not a radius")
                .allowed("0.1 m and more, negative to the right")
                .into())
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
        let length = e.length_m.as_ref().map(|l| l.value);
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
                    (None, Some(a)) => a.value.to_radians() / k.abs(),
                    (Some(_), Some(a)) => {
                        return self.refuse(
                            &a.span,
                            "angle_deg and length_m exclude each other",
                            "keep one of them",
                        );
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
                let e = self.doc.bad(&l.width_m.span, format!("{} is not a lane width", p[1]));
                return Err(e.allowed("0..=1000").remedy("give metres").into());
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
        let paint = Paint {
            width_m: p.width_m.value,
            dash_m: p.dash_m.value,
            gap_m: p.gap_m.value,
            thickness_m: p.thickness_m.value,
            material: p.material.value.clone(),
        };
        let spec = format!("{under}+{}:{}", paint.material, paint.thickness_m);
        let span = if p.material.span.is_empty() { under_span } else { &p.material.span };
        material::parse_spec_among(&spec, self.materials).map_err(|e| self.at(span, e))?;
        Ok(paint)
    }

    /// The whole road, and what was assumed or left out of its file.
    fn road(&self) -> Result<(RoadPlan, Vec<String>)> {
        let t = self.t;
        if t.name.value.is_empty() || self.roads.iter().any(|r| r.road.name == t.name.value) {
            return self.refuse(
                &t.name.span,
                "is empty, or the name of another road",
                "give each road a name of its own",
            );
        }
        let surface = match &t.surface {
            Some(s) if s.value == "none" => None,
            s => Some(self.material(s, "asphalt")?),
        };
        let here = |e| self.at(&t.name.span, e);
        let paint = self.paint(&t.paint, surface.as_deref().unwrap_or("asphalt"), &t.name.span)?;
        let mut given = self.opendrive()?;
        let warnings = given.as_mut().map_or_else(Vec::new, |g| std::mem::take(&mut g.warnings));
        let mut marks = Vec::new();
        let (left, right) = (self.lanes(Side::Left, &surface)?, self.lanes(Side::Right, &surface)?);
        let road = match given {
            Some(ReadRoad { mut road, marks: of_file, .. }) => {
                if !(left.is_empty() && right.is_empty()) {
                    (road.left, road.right, road.centre_line) = (left, right, t.centre_line);
                } else {
                    marks = of_file;
                    let given = |l: &&mut Lane| t.surface.is_some() && l.kind.is_drivable();
                    for lane in road.left.iter_mut().chain(&mut road.right).filter(given) {
                        lane.surface.clone_from(&surface);
                    }
                }
                Road { name: t.name.value.clone(), paint, ..road }
            }
            None => Road {
                name: t.name.value.clone(),
                axis: self.axis()?,
                lane_offset: t
                    .lane_offset_m
                    .as_ref()
                    .map_or(Ok(Profile::constant(0.0)), |o| self.series(o))?,
                left,
                right,
                centre_line: t.centre_line,
                paint,
            },
        };
        road.check().map_err(here)?;
        if road.centre_line == LineKind::Dashed || road.lanes().any(|(.., l)| l.line == LineKind::Dashed) {
            let at = if t.paint.dash_m.span.is_empty() { &t.name.span } else { &t.paint.dash_m.span };
            let period_m = road.paint.dash_m + road.paint.gap_m;
            self.few(at, &(0.0..road.axis.length_m()), period_m, "dashes")?;
        }
        let mut plan = RoadPlan::new(road);
        let under = surface.as_deref().unwrap_or("asphalt");
        for l in &t.line {
            let under = self.material(&l.under, under)?;
            let paint = l.paint.as_ref().map(|p| self.paint(p, &under, &l.lateral.span)).transpose()?;
            let paint = paint.unwrap_or_else(|| plan.road.paint.clone());
            let span_m = self.span(&plan.road, &l.from_m, &l.to_m)?;
            if l.kind == LineKind::Dashed {
                let at = l.paint.as_ref().map_or(&l.lateral.span, |p| &p.dash_m.span);
                self.few(at, &span_m, paint.dash_m + paint.gap_m, "dashes")?;
            }
            let lateral = self.lateral(&plan.road, &l.lateral)?;
            plan.lines.push(LinePlan { lateral, kind: l.kind, paint, under, span_m, of_lane: None });
        }
        // What the scene file states of its paint counts before what the road's file does.
        let own = |at: &At<f64>| !at.span.is_empty();
        for mut mark in marks {
            if own(&t.paint.width_m) {
                mark.width_m = None;
            }
            if own(&t.paint.thickness_m) {
                mark.thickness_m = None;
            }
            if own(&t.paint.dash_m) || own(&t.paint.gap_m) {
                mark.dash_gap_m = None;
            }
            let Some(line) = mark.line(&plan.road, &plan.road.paint) else { continue };
            if line.kind == LineKind::Dashed {
                let at = t.opendrive.as_ref().map_or(&t.name.span, |o| &o.span);
                self.few(at, &line.span_m, line.paint.dash_m + line.paint.gap_m, "dashes")?;
            }
            plan.lines.push(line);
        }
        for v in &t.verge {
            plan.verges.push(VergePlan {
                side: v.side,
                width_m: v.width_m,
                drop_m: v.drop_m.unwrap_or(0.12),
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
        Ok((plan, warnings))
    }

    fn barriers(&self, plan: &mut RoadPlan) -> Result<()> {
        let t = self.t;
        for r in &t.rail {
            let lateral = self.lateral(&plan.road, &r.lateral)?;
            let span_m = self.span(&plan.road, &r.from_m, &r.to_m)?;
            if let Some(p) = r.post_spacing_m.as_ref().filter(|p| p.value > 0.0) {
                self.few(&p.span, &span_m, p.value, "posts")?;
            }
            let towards = if plan.road.t_m(&lateral, span_m.start) > 0.0 { Side::Right } else { Side::Left };
            plan.rails.push(RailPlan {
                lateral,
                faces: r.faces.unwrap_or(towards),
                span_m,
                height_m: r.height_m.unwrap_or(0.75),
                post_spacing_m: r.post_spacing_m.as_ref().map_or(4.0, |p| p.value),
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
                    height_m: w.height_m.unwrap_or(height),
                    thickness_m: w.thickness_m.unwrap_or(thickness),
                    material: self.material(&w.material, "concrete")?,
                });
            }
        }
        for f in &t.fence {
            let span_m = self.span(&plan.road, &f.from_m, &f.to_m)?;
            if let Some(p) = &f.post_spacing_m {
                self.few(&p.span, &span_m, p.value, "posts")?;
            }
            plan.fences.push(FencePlan {
                lateral: self.lateral(&plan.road, &f.lateral)?,
                span_m,
                height_m: f.height_m.unwrap_or(1.2),
                post_spacing_m: f.post_spacing_m.as_ref().map_or(2.5, |p| p.value),
                post_m: f.post_m.unwrap_or(0.08),
                bars: f.bars.unwrap_or(3),
                bar_m: f.bar_m.unwrap_or(0.04),
                material: self.material(&f.material, "steel")?,
            });
        }
        for g in &t.gantry {
            plan.gantries.push(GantryPlan {
                s_m: self.place(&plan.road, &g.s_m)?,
                from: self.lateral(&plan.road, &g.from)?,
                to: self.lateral(&plan.road, &g.to)?,
                clearance_m: g.clearance_m.unwrap_or(5.5),
                beam_m: g.beam_m.unwrap_or(0.8),
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
        Err(self
            .doc
            .bad(&at, "does not end beyond its start")
            .remedy("give a to_m larger than from_m")
            .into())
    }

    fn lateral(&self, road: &Road, at: &At<LateralTable>) -> Result<Lateral> {
        let t = &at.value;
        let count = [t.t_m.is_some(), t.lane.is_some(), t.edge.is_some()].iter().filter(|x| **x).count();
        if count != 1 {
            let e = self.doc.bad(&at.span, "needs exactly one of t_m, lane and edge");
            return Err(e
                .allowed("one of t_m, lane, edge")
                .remedy("give it as in { lane = 1, side = \"left\" }")
                .into());
        }
        if let (Some(s), None) = (&t.side, &t.lane) {
            return self.refuse(&s.span, "needs lane", "add lane, or remove it");
        }
        if let (Some(o), Some(_)) = (&t.offset_m, &t.t_m) {
            return self.refuse(&o.span, "offset_m and t_m exclude each other", "add offset_m to t_m");
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
        let ways = [r.spacing_m.is_some(), r.gaps_m.is_some(), r.code.is_some()];
        if ways.iter().filter(|x| **x).count() != 1 {
            let e =
                self.doc.bad(&r.reflector.span, "the row needs exactly one of spacing_m, gaps_m and code");
            return Err(e
                .allowed("one of spacing_m, gaps_m, code")
                .remedy("give it as in spacing_m = 2")
                .into());
        }
        if let (Some(c), None) = (&r.count, &r.spacing_m) {
            return self.refuse(&c.span, "needs spacing_m", "remove it");
        }
        let spacing = match (&r.spacing_m, &r.gaps_m, &r.code) {
            (_, _, Some(c)) => {
                if c.word.value.is_empty() || !c.word.value.bytes().all(|b| matches!(b, b'0' | b'1')) {
                    let e = self.doc.bad(&c.word.span, "is not a code word").allowed("zeros and ones");
                    return Err(e.remedy("give it as in \"1011\"").into());
                }
                let (zero_m, one_m, sync_m) = (c.zero_m, c.one_m.value, c.sync_m);
                if zero_m == one_m || sync_m == Some(zero_m) || sync_m == Some(one_m) {
                    return self.refuse(
                        &c.one_m.span,
                        "gaps of two meanings are alike",
                        "give zero_m, one_m and sync_m different lengths",
                    );
                }
                let word = c.word.value.bytes().map(|b| b == b'1').collect();
                Spacing::Code { word, zero_m, one_m, sync_m }
            }
            (_, Some(gaps_m), _) => Spacing::Gaps(gaps_m.clone()),
            (Some(s), ..) => {
                let spacing_m = s.value;
                let wanted = r.count.as_ref().map_or(f64::INFINITY, |c| f64::from(c.value) * spacing_m);
                let span_m = self.span(road, &r.from_m, &r.to_m)?;
                let end = span_m.end.min(span_m.start + wanted);
                self.few(&s.span, &(span_m.start..end), spacing_m, "reflectors")?;
                Spacing::Even { spacing_m, count: r.count.as_ref().map(|c| c.value as usize) }
            }
            (None, None, None) => Spacing::Gaps(Vec::new()),
        };
        let class = r.class.clone().unwrap_or_else(|| "marker".into());
        let is_marker = class == "marker";
        let lift = if is_marker { 0.002 } else { 0.0 };
        let plan = RowPlan {
            name: r.name.clone().unwrap_or_else(|| format!("{class} row {}", i + 1)),
            reflector: self.reflector(&r.reflector)?,
            lateral: self.lateral(road, &r.lateral)?,
            span_m: self.span(road, &r.from_m, &r.to_m)?,
            spacing,
            along_row: r.along_row,
            yaw_rad: r.yaw_deg.map_or(std::f64::consts::PI, f64::to_radians),
            turn_rad: r.turn_deg.to_radians(),
            pitch_rad: r.pitch_deg.to_radians(),
            roll_rad: r.roll_deg.to_radians(),
            lift_m: r.lift_m.unwrap_or(lift),
            lying: !r.upright.unwrap_or(!is_marker),
            class,
        };
        if let Some(count) = &r.count {
            let fit = places(road, &plan).map_err(|e| self.at(&count.span, e))?.len();
            if fit < count.value as usize {
                let e = self.doc.bad(&count.span, "is more than the road has room for at this spacing");
                return Err(e.allowed(format!("0..={fit}")).remedy("remove count to fill the road").into());
            }
        }
        Ok(plan)
    }

    fn object(&self, road: &Road, o: &ObjectTable, i: usize) -> Result<ThingPlan> {
        let import = ImportTable {
            unit: &o.unit,
            up: &o.up,
            animation: &o.animation,
            smooth_deg: &o.smooth_deg,
            default_material: &o.default_material,
            materials: &o.materials,
        };
        if let (Some(span), None) = (import.first_span(), &o.file) {
            return self.refuse(span, "applies only to a mesh file", "remove it");
        }
        let (source, class) = match (&o.reflector, &o.file) {
            (Some(r), None) => {
                let r = self.reflector(r)?;
                let class = if r.kind().name.starts_with("manhole") { "manhole" } else { "reflector" };
                (Source::Reflector(r), class)
            }
            (None, Some(f)) => {
                let path = self.beside(f)?;
                let options = import.options_of(self.doc, f)?;
                (Source::File(mesh_file::import_sized(&path, &options, 1e-3..=1e3)?), "")
            }
            _ => {
                let e = self.doc.bad(&o.s_m.span, "the object needs exactly one of reflector and file");
                return Err(e.allowed("one of reflector, file").into());
            }
        };
        Ok(ThingPlan {
            name: o.name.clone().unwrap_or_else(|| format!("object {}", i + 1)),
            class: o.class.clone().unwrap_or_else(|| class.into()),
            source,
            s_m: self.place(road, &o.s_m)?,
            lateral: self.lateral(road, &o.lateral)?,
            yaw_rad: o.yaw_deg.to_radians(),
            pitch_rad: o.pitch_deg.to_radians(),
            roll_rad: o.roll_deg.to_radians(),
            lift_m: o.lift_m,
            speed_mps: o.speed_mps,
            drive: None,
            against: false,
            lying: !o.upright,
        })
    }

    fn vehicle(&self, road: &Road, v: &VehicleTable, i: usize) -> Result<ThingPlan> {
        if !VEHICLES.contains(&v.kind.value.as_str()) {
            return Err(unknown(self.doc.bad(&v.kind.span, ""), &v.kind.value).into());
        }
        let lateral = self.lateral(road, &v.lateral)?;
        let back = match lateral.base {
            Base::Lane(side, i, _) => road.side(side)[i].driven == Driven::Backward,
            _ => false,
        };
        let rcs_dbsm = v.rcs_dbsm;
        let (heading, speed) = (v.heading_deg.value.to_radians(), v.speed_mps.value);
        let drive = match &v.drive {
            Some(d) if speed != 0.0 || heading != 0.0 => {
                let (span, key) = match speed != 0.0 {
                    true => (&v.speed_mps.span, "speed_mps"),
                    false => (&v.heading_deg.span, "heading_deg"),
                };
                let e = self.doc.bad(span, format!("{key} and drive exclude each other"));
                let there = format!("drive has speed_mps = {} and heading_error_deg", d.speed_mps.value);
                return Err(e.remedy(format!("keep the value in drive: {there}")).into());
            }
            Some(d) => Some(drive::build(self.doc, d)?),
            // What is turned goes its own way.
            None if speed != 0.0 && heading == 0.0 => Some(Drive::steady(speed)),
            None => None,
        };
        Ok(ThingPlan {
            name: v.name.clone().unwrap_or_else(|| format!("{} {}", v.kind.value, i + 1)),
            class: String::new(),
            source: Source::Vehicle { kind: v.kind.value.clone(), rcs_dbsm },
            s_m: self.place(road, &v.s_m)?,
            lateral,
            yaw_rad: heading + if back { std::f64::consts::PI } else { 0.0 },
            pitch_rad: 0.0,
            roll_rad: 0.0,
            lift_m: 0.0,
            speed_mps: if drive.is_some() { 0.0 } else { speed },
            drive,
            against: back,
            lying: true,
        })
    }
}
