//! Axes, heights and lanes from ASAM OpenDRIVE files (.xodr, version 1.4 to 1.8).
//!
//! Read: `planView` (line, arc, spiral, poly3, paramPoly3), `elevationProfile`, `superelevation`, `laneOffset`,
//! `laneSection` with lanes' types, widths and first road marks. Not read: junctions' links, `shape`, `crossfall`,
//! borders, objects, signals.
//!
//! Superelevation is an angle there and a slope here: tan a is taken as a, which is 0.02 mm for each metre of
//! distance from the axis at 4 % and 0.3 mm at 10 %.

use crate::base::error::{BadInput, Result};
use crate::road::axis::{Course, RoadAxis, Start};
use crate::road::layout::{Driven, Lane, LaneKind, LineKind, Paint, Road};
use crate::road::profile::{Piece, Profile};
use crate::scene::toml_file::read_text_of;
use glam::DVec2;
use roxmltree::{Document, Node};
use std::path::Path;

/// Widest gap between the end of an element of the plan and the beginning of the next.
const JOINT_M: f64 = 0.05;

/// How far two statements of one place along a road may differ: files round their lengths.
fn joint(s_m: f64) -> f64 {
    JOINT_M.max(1e-4 * s_m)
}

struct Xml<'a> {
    file: &'a Path,
    doc: &'a Document<'a>,
}

impl Xml<'_> {
    fn bad(&self, node: Node, problem: impl Into<String>) -> BadInput {
        let line = self.doc.text_pos_at(node.range().start).row as usize;
        BadInput::new(problem).file(self.file).line(line).key(node.tag_name().name())
    }

    fn number_or(&self, node: Node, name: &str, default: Option<f64>) -> Result<f64> {
        let Some(text) = node.attribute(name) else {
            return default.ok_or_else(|| self.bad(node, format!("has no attribute {name}")).into());
        };
        let number = text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| {
            let shown: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
            self.bad(node, format!("{name} is not a finite number")).value(shown).into()
        })
    }

    fn number(&self, node: Node, name: &str) -> Result<f64> {
        self.number_or(node, name, None)
    }

    /// The cubic a + b u + c u² + d u³ of an element.
    fn cubic(&self, node: Node, s0_m: f64) -> Result<Piece> {
        let mut coefficients = [0.0; 4];
        for (c, name) in coefficients.iter_mut().zip(["a", "b", "c", "d"]) {
            *c = self.number(node, name)?;
        }
        Ok(Piece { s0_m, coefficients })
    }

    /// A chain of cubics, or zero.
    fn profile<'n>(&self, nodes: impl Iterator<Item = Node<'n, 'n>>) -> Result<Profile> {
        let mut pieces: Vec<Piece> = Vec::new();
        for n in nodes {
            let piece = self.cubic(n, self.number(n, "s")?)?;
            if pieces.last().is_some_and(|before| piece.s0_m < before.s0_m) {
                return Err(self.bad(n, "begins before the one before it").value(piece.s0_m).into());
            }
            pieces.push(piece);
        }
        if pieces.is_empty() { Ok(Profile::constant(0.0)) } else { Profile::cubics(pieces) }
    }
}

fn children<'a>(node: Node<'a, 'a>, path: &[&'static str]) -> Vec<Node<'a, 'a>> {
    let mut nodes = vec![node];
    for name in path {
        nodes = nodes.into_iter().flat_map(|n| n.children()).filter(|n| n.has_tag_name(*name)).collect();
    }
    nodes
}

/// Largest file, in bytes.
pub const MAX_BYTES: u64 = 16 << 20;

/// The roads of the file at `file`; see [`parse`].
///
/// # Errors
/// Returns an error for a file that cannot be read, of more than [`MAX_BYTES`], and the errors of [`parse`].
pub fn read(file: &Path) -> Result<Vec<Road>> {
    parse(file, &read_text_of(file, "an OpenDRIVE file", MAX_BYTES)?)
}

/// The roads of a file, named by their ids. Their lanes have OpenDRIVE's numbers, positive on the left; lanes of
/// one number in several sections are one lane, with no width where a section lacks it. Surfaces are asphalt
/// (grass for what is not driven).
///
/// # Errors
/// Returns an error, with the file and the line in it, if the text is not a road network that catseye can read.
pub fn parse(file: &Path, text: &str) -> Result<Vec<Road>> {
    let options = roxmltree::ParsingOptions { allow_dtd: false, ..Default::default() };
    let doc = Document::parse_with_options(text, options).map_err(|e| {
        let e_text = e.to_string().replace('\n', " ");
        BadInput::new(format!("is not XML: {e_text}")).file(file).line(e.pos().row as usize)
    })?;
    let xml = Xml { file, doc: &doc };
    let root = doc.root_element();
    if !root.has_tag_name("OpenDRIVE") {
        return Err(xml.bad(root, "is not OpenDRIVE").remedy("give an .xodr file").into());
    }
    let mut roads = Vec::new();
    for node in children(root, &["road"]) {
        roads.push(road(&xml, node)?);
    }
    if roads.is_empty() {
        return Err(xml.bad(root, "has no road").into());
    }
    Ok(roads)
}

fn road(xml: &Xml, node: Node<'_, '_>) -> Result<Road> {
    let name = node.attribute("id").ok_or_else(|| xml.bad(node, "has no attribute id"))?.to_string();
    let axis = axis(xml, node)?;
    let lane_offset = xml.profile(children(node, &["lanes", "laneOffset"]).into_iter())?;
    let sections = children(node, &["lanes", "laneSection"]);
    let mut starts = Vec::with_capacity(sections.len());
    for s in &sections {
        starts.push(xml.number(*s, "s")?);
    }
    let end_m = axis.length_m();
    if let Some(i) = (0..starts.len()).find(|i| !(-JOINT_M..end_m + joint(end_m)).contains(&starts[*i])) {
        let e = xml.bad(sections[i], "begins outside the road").value(starts[i]);
        return Err(e.allowed(format!("s from 0 to {end_m} m")).into());
    }
    if let Some(i) = (1..starts.len()).find(|i| starts[*i] < starts[i - 1]) {
        return Err(xml.bad(sections[i], "begins before the section before it").value(starts[i]).into());
    }
    let mut road = Road {
        name,
        axis,
        lane_offset,
        left: Vec::new(),
        right: Vec::new(),
        centre_line: LineKind::None,
        paint: Paint {
            width_m: 0.12,
            dash_m: 6.0,
            gap_m: 12.0,
            thickness_m: 0.002,
            material: "paint-white".into(),
        },
    };
    if let Some(centre) = children(node, &["lanes", "laneSection", "center", "lane"]).first() {
        road.centre_line = mark(*centre);
    }
    for (side, sign) in [("left", 1), ("right", -1)] {
        let mut numbers = Vec::new();
        for lane in children(node, &["lanes", "laneSection", side, "lane"]) {
            let id = xml.number(lane, "id")?;
            if id.fract() != 0.0 || id * f64::from(sign) < 1.0 || id.abs() > 1000.0 {
                return Err(xml.bad(lane, format!("is no number of a lane on the {side}")).value(id).into());
            }
            numbers.push(id as i32);
        }
        numbers.sort_unstable_by_key(|n| n.abs());
        numbers.dedup();
        for number in numbers {
            let lane = lane(xml, node, &starts, side, number)?;
            if sign > 0 { road.left.push(lane) } else { road.right.push(lane) }
        }
    }
    road.check().map_err(|e| match e {
        crate::base::error::Error::Input(b) => {
            let at = xml.bad(node, "");
            crate::base::error::Error::Input(Box::new(BadInput { file: at.file, line: at.line, ..*b }))
        }
        e => e,
    })?;
    Ok(road)
}

/// The lane of that number through all sections.
fn lane(xml: &Xml, road: Node<'_, '_>, starts: &[f64], side: &'static str, number: i32) -> Result<Lane> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut kind = None;
    let mut line = LineKind::None;
    for (i, section) in children(road, &["lanes", "laneSection"]).into_iter().enumerate() {
        let end = starts.get(i + 1).copied().unwrap_or(f64::INFINITY);
        let mut found = None;
        for l in children(section, &[side, "lane"]) {
            if xml.number(l, "id")? == f64::from(number) {
                found = Some(l);
            }
        }
        let widths = found.map_or(Vec::new(), |l| children(l, &["width"]));
        if widths.is_empty() {
            pieces.push(Piece { s0_m: starts[i], coefficients: [0.0; 4] });
        }
        for w in widths {
            let offset_m = xml.number(w, "sOffset")?;
            if offset_m < 0.0 {
                return Err(xml.bad(w, "sOffset is negative").value(offset_m).allowed("0 and more").into());
            }
            let s0_m = starts[i] + offset_m;
            if s0_m < end {
                pieces.push(xml.cubic(w, s0_m)?);
            }
        }
        if let (Some(l), None) = (found, kind) {
            kind = Some(lane_kind(l.attribute("type").unwrap_or("none")));
            line = mark(l);
        }
    }
    pieces.sort_by(|a, b| a.s0_m.total_cmp(&b.s0_m));
    let kind = kind.unwrap_or(LaneKind::Verge);
    let surface = if kind.is_drivable() || kind == LaneKind::Sidewalk { "asphalt" } else { "grass" };
    Ok(Lane {
        number,
        kind,
        driven: if number > 0 { Driven::Backward } else { Driven::Forward },
        width: Profile::cubics(pieces)?,
        surface: Some(surface.into()),
        line,
    })
}

fn lane_kind(kind: &str) -> LaneKind {
    match kind {
        "driving" | "bidirectional" | "bus" | "taxi" | "HOV" | "tram" => LaneKind::Driving,
        "stop" => LaneKind::Emergency,
        "entry" | "exit" | "onRamp" | "offRamp" | "connectingRamp" | "mwyEntry" | "mwyExit" | "slipLane" => {
            LaneKind::Ramp
        }
        "shoulder" => LaneKind::Shoulder,
        "biking" => LaneKind::Bicycle,
        "parking" => LaneKind::Parking,
        "sidewalk" | "walking" | "curb" => LaneKind::Sidewalk,
        "median" => LaneKind::Median,
        _ => LaneKind::Verge,
    }
}

fn mark(lane: Node<'_, '_>) -> LineKind {
    match lane.children().find(|n| n.has_tag_name("roadMark")).and_then(|n| n.attribute("type")) {
        Some("solid") => LineKind::Solid,
        Some("broken") => LineKind::Dashed,
        Some("solid solid") => LineKind::Double,
        _ => LineKind::None,
    }
}

fn axis(xml: &Xml, road: Node<'_, '_>) -> Result<RoadAxis> {
    let mut elements: Vec<(Start, Course)> = Vec::new();
    // Where the next geometry begins: the sum of the lengths so far.
    let mut s_m = 0.0;
    let mut ahead: Option<RoadAxis> = None;
    for g in children(road, &["planView", "geometry"]) {
        let length_m = xml.number(g, "length")?;
        let given_m = xml.number_or(g, "s", Some(s_m))?;
        if (given_m - s_m).abs() > joint(s_m) {
            let e = xml.bad(g, "s is not where the geometry before it ends").value(given_m);
            return Err(e.allowed(format!("s = {s_m}")).into());
        }
        let at_m = DVec2::new(xml.number(g, "x")?, xml.number(g, "y")?);
        let start = Start { at_m, heading_rad: xml.number(g, "hdg")? };
        let shape = g.children().find(|n| n.is_element() && !n.has_tag_name("userData"));
        let shape = shape.ok_or_else(|| xml.bad(g, "has no shape"))?;
        let course = match shape.tag_name().name() {
            "line" => Course::Straight { length_m },
            "arc" => Course::Arc { length_m, curvature_per_m: xml.number(shape, "curvature")? },
            "spiral" => Course::Clothoid {
                length_m,
                from_per_m: xml.number(shape, "curvStart")?,
                to_per_m: xml.number(shape, "curvEnd")?,
            },
            "poly3" => {
                let v = xml.cubic(shape, 0.0)?.coefficients;
                Course::Cubic { length_m, u: [0.0, 1.0, 0.0, 0.0], v, p_end: reach(v, length_m) }
            }
            "paramPoly3" => {
                let (mut u, mut v) = ([0.0; 4], [0.0; 4]);
                for (list, axis) in [(&mut u, "U"), (&mut v, "V")] {
                    for (c, name) in list.iter_mut().zip(["a", "b", "c", "d"]) {
                        *c = xml.number(shape, &format!("{name}{axis}"))?;
                    }
                }
                let normalized = shape.attribute("pRange") == Some("normalized");
                Course::Cubic { length_m, u, v, p_end: if normalized { 1.0 } else { length_m } }
            }
            other => return Err(xml.bad(g, format!("has a shape '{other}' that is not known")).into()),
        };
        let alone = RoadAxis::placed(&[(start, course)], Profile::constant(0.0)).map_err(|e| match e {
            crate::base::error::Error::Input(b) => xml.bad(g, b.problem).into(),
            e => e,
        })?;
        if let Some(before) = ahead {
            let gap = (before.at(before.length_m()).position_m - alone.at(0.0).position_m).length();
            if gap > JOINT_M {
                let e = xml
                    .bad(g, "does not begin where the one before it ends")
                    .value(format!("{gap:.3} m off"));
                return Err(e.allowed(format!("up to {JOINT_M} m")).into());
            }
        }
        ahead = Some(alone);
        elements.push((start, course));
        s_m += length_m;
    }
    if elements.is_empty() {
        return Err(xml.bad(road, "has no planView with a geometry").into());
    }
    let plan_m = s_m;
    let length_m = xml.number_or(road, "length", Some(plan_m))?;
    if (length_m - plan_m).abs() > joint(plan_m) {
        return Err(xml
            .bad(road, format!("the road is to be that long, and its geometry ends at {plan_m} m"))
            .value(format!("length {length_m} m"))
            .allowed(format!("{plan_m} m"))
            .remedy("complete planView, or correct the road's length")
            .into());
    }
    let height = xml.profile(children(road, &["elevationProfile", "elevation"]).into_iter())?;
    let roll = xml.profile(children(road, &["lateralProfile", "superelevation"]).into_iter())?;
    Ok(RoadAxis::placed(&elements, height)?.with_cross_slope(roll))
}

/// How far u runs until the curve v(u) is `length_m` long.
fn reach(v: [f64; 4], length_m: f64) -> f64 {
    let speed = |p: f64| (v[1] + p * (2.0 * v[2] + 3.0 * p * v[3])).hypot(1.0);
    // Simpson's rule; no curve is shorter than its run along u.
    let arc = |end: f64| {
        const N: usize = 1000;
        let h = end / N as f64;
        let weight = |i: usize| if i == 0 || i == N { 1.0 } else { 2.0 * (1 + i % 2) as f64 };
        (0..=N).map(|i| weight(i) * speed(h * i as f64)).sum::<f64>() * h / 3.0
    };
    let (mut low, mut high) = (0.0, length_m);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if arc(mid) < length_m { low = mid } else { high = mid }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::axis::RoadPoint;
    use crate::road::layout::Side;
    use glam::DVec3;

    const FILE: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="6"/>
  <road id="7" length="160" junction="-1">
    <planView>
      <geometry s="0" x="10" y="-5" hdg="0" length="100"><line/></geometry>
      <geometry s="100" x="110" y="-5" hdg="0" length="60"><spiral curvStart="0" curvEnd="0.01"/></geometry>
    </planView>
    <elevationProfile>
      <elevation s="0" a="2" b="0.01" c="0" d="0"/>
      <elevation s="80" a="2.8" b="0.01" c="-0.0002" d="1e-6"/>
    </elevationProfile>
    <lateralProfile><superelevation s="0" a="0.03" b="0" c="0" d="0"/></lateralProfile>
    <lanes>
      <laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
      <laneSection s="0">
        <left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark type="solid"/></lane></left>
        <center><lane id="0" type="none"><roadMark type="broken"/></lane></center>
        <right><lane id="-1" type="driving"><width sOffset="0" a="3.25" b="0.01" c="0" d="0"/></lane></right>
      </laneSection>
      <laneSection s="50">
        <left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
        <center><lane id="0" type="none"/></center>
        <right>
          <lane id="-2" type="exit"><width sOffset="0" a="0" b="0" c="0.003" d="0"/><width sOffset="30" a="2.7" b="0" c="0" d="0"/></lane>
          <lane id="-1" type="driving"><width sOffset="0" a="3.75" b="0" c="0" d="0"/></lane>
        </right>
      </laneSection>
    </lanes>
  </road>
</OpenDRIVE>"#;

    #[test]
    fn axis_and_lanes_are_the_files() {
        let roads = parse(Path::new("a.xodr"), FILE).unwrap();
        let r = &roads[0];
        assert_eq!(
            (r.name.as_str(), r.left.len(), r.right.len(), r.centre_line),
            ("7", 1, 2, LineKind::Dashed)
        );
        assert_eq!(r.axis.length_m(), 160.0);
        assert!((r.axis.at(80.0).position_m - DVec3::new(90.0, -5.0, 2.8)).length() < 1e-12);
        let z = 2.8 + 0.01 * 80.0 - 0.0002 * 6400.0 + 1e-6 * 512_000.0;
        assert!((r.axis.at(160.0).position_m.z - z).abs() < 1e-12);
        assert!((r.axis.at(160.0).heading_rad - 0.3).abs() < 1e-12);
        assert!((r.axis.at(40.0).cross_slope - 0.03).abs() < 1e-15);
        assert_eq!(r.lane_edges_t_m(Side::Left, 0, 20.0), (4.0, 0.5));
        assert_eq!(r.right[0].width.value(20.0), 3.45);
        assert_eq!(r.right[1].width.value(49.0), 0.0);
        assert!(
            (r.right[1].width.value(70.0) - 0.003 * 400.0).abs() < 1e-12
                && r.right[1].width.value(100.0) == 2.7
        );
        assert_eq!((r.right[1].kind, r.right[1].number), (LaneKind::Ramp, -2));
        assert_eq!((r.left[0].line, r.left[0].driven), (LineKind::Solid, Driven::Backward));
        let p = r.axis.world(RoadPoint { s_m: 20.0, t_m: 4.0, h_m: 0.0 });
        assert!((p - DVec3::new(30.0, -1.0, 2.2 + 0.12)).length() < 1e-12);
    }

    #[test]
    fn cubic_shapes_are_curves_of_their_length() {
        let poly = r#"<poly3 a="0" b="0" c="0.002" d="0.00001"/>"#;
        // The same curve as a parametric cubic over its run.
        let text = |shape: &str, length: f64| {
            FILE.replace(
                r#"length="60"><spiral curvStart="0" curvEnd="0.01"/>"#,
                &format!(r#"length="{length}">{shape}"#),
            )
        };
        let a = &parse(Path::new("a.xodr"), &text(poly, 60.0)).unwrap()[0].axis;
        let end = a.at(160.0).position_m.truncate() - DVec2::new(110.0, -5.0);
        assert!((end.y - (0.002 * end.x * end.x + 0.00001 * end.x.powi(3))).abs() < 1e-9, "{end}");
        // Length of the chain of short chords.
        let n = 20_000;
        let at = |i: i32| a.at(100.0 + 60.0 * f64::from(i) / f64::from(n)).position_m.truncate();
        let length: f64 = (0..n).map(|i| (at(i + 1) - at(i)).length()).sum();
        assert!((length - 60.0).abs() < 1e-6, "{length}");
        let x = end.x;
        let parametric = format!(
            r#"<paramPoly3 pRange="normalized" aU="0" bU="{x}" cU="0" dU="0" aV="0" bV="0" cV="{}" dV="{}"/>"#,
            0.002 * x * x,
            0.00001 * x.powi(3)
        );
        let b = &parse(Path::new("a.xodr"), &text(&parametric, 60.0)).unwrap()[0].axis;
        for s in [110.0, 131.0, 159.0] {
            assert!((a.at(s).position_m - b.at(s).position_m).length() < 1e-8, "{s}");
            assert!((a.at(s).curvature_per_m - b.at(s).curvature_per_m).abs() < 1e-10);
        }
    }

    #[test]
    fn broken_files_are_refused_with_their_line() {
        let complaint = |from: &str, to: &str| {
            let e = parse(Path::new("a.xodr"), &FILE.replace(from, to)).unwrap_err().to_string();
            assert!(!e.contains('\n') && e.starts_with("a.xodr:"), "{e}");
            e
        };
        assert!(complaint("</road>", "</raod>").contains("is not XML"));
        assert!(complaint("OpenDRIVE>", "OpenDriv>").contains("is not OpenDRIVE"));
        assert!(
            complaint("hdg=\"0\" length=\"100\"", "hdg=\"x\" length=\"100\"")
                .contains("a.xodr:6: geometry = x: hdg is not a finite number")
        );
        assert!(
            complaint("x=\"110\"", "x=\"111\"")
                .contains("a.xodr:7: geometry = 1.000 m off: does not begin where")
        );
        assert!(
            complaint("length=\"100\"><line", "length=\"-1\"><line").contains("its length is not positive")
        );
        assert!(complaint("<line/>", "<wave/>").contains("a shape 'wave'"));
        assert!(complaint("id=\"-2\"", "id=\"2\"").contains("is no number of a lane on the right"));
        assert!(complaint("a=\"2.7\"", "a=\"-2.7\"").contains("is no width of a lane"));
        // Bends without measure took memory without measure.
        assert!(complaint("d=\"1e-6\"", "d=\"1e66\"").contains("height of road '7'"));
        assert!(complaint("a=\"0.03\"", "a=\"1e9\"").contains("cross slope of road '7'"));
        assert!(complaint("<road id=\"7\"", "<rode id=\"7\"").contains("is not XML"));
    }
}
