//! Axes, heights and lanes from ASAM OpenDRIVE files (.xodr, version 1.4 to 1.8).
//!
//! A road is read in three steps. `planView` with the header's offset gives the axis; `elevationProfile`,
//! `superelevation` and `crossfall` give the surface; `laneOffset` and the lane sections give lanes with their widths
//! or borders, driving directions and road marks. Then the file is walked along the list of the standard's elements
//! (`opendrive_elements`): whatever is left out is named in a warning, one for each kind of thing, with the first
//! line and how many there are.
//!
//! The lengths of parametric cubics are held against the length that their geometry states. Geometries without
//! length are left out, and gaps of up to half a metre between geometries are closed; both with a warning.
//!
//! Superelevation and crossfall are angles there and slopes here: tan a is taken as a, which is 0.02 mm for each
//! metre of distance from the axis at 4 % and 0.3 mm at 10 %.

use crate::base::error::{BadInput, Result};
use crate::road::axis::{Course, RoadAxis, Start};
use crate::road::layout::{Base, Driven, InLane, Lane, LaneKind, Lateral, LineKind, Paint, Road, Side};
use crate::road::opendrive_elements::{Treatment, anywhere, element};
use crate::road::plan::LinePlan;
use crate::road::profile::{Piece, Profile};
use crate::scene::toml_file::read_text_of;
use glam::DVec2;
use roxmltree::{Document, Node};
use std::cell::RefCell;
use std::ops::Range;
use std::path::Path;

/// How far the end of an element of the plan may be from the beginning of the next by rounding alone, m.
const ROUNDING_M: f64 = 0.01;
/// Widest gap between two elements of the plan that is closed, m.
const GAP_M: f64 = 0.5;
/// How far two statements of one position along a road may differ at its beginning, m.
const JOINT_M: f64 = 0.05;
/// Shorter elements of the plan have no length, m.
const SHORTEST_M: f64 = 1e-6;
/// By how much the length of a curve may miss the stated one, as a part of it.
const LENGTH_MISS: f64 = 0.05;
/// By how much it may without a warning.
const LENGTH_ROUNDING: f64 = 0.01;

/// How far two statements of one position along a road may differ: files round their lengths.
fn joint(s_m: f64) -> f64 {
    JOINT_M.max(1e-4 * s_m)
}

/// A road of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadRoad {
    /// Axis and lanes.
    pub road: Road,
    /// Lines that a lane's own kind of line does not describe, because they change along the road, have a width of
    /// their own, or are two different ones.
    pub marks: Vec<Mark>,
    /// What was assumed, mended or left out: one line for each kind of thing, with file, line and element.
    pub warnings: Vec<String>,
}

/// A painted line of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The lane whose outer edge it marks: side and index; None for the centre lane.
    pub of_lane: Option<(Side, usize)>,
    /// Distance from that edge to the left, m.
    pub offset_m: f64,
    /// Solid, dashed or double.
    pub kind: LineKind,
    /// Where it begins and ends, m along the axis.
    pub span_m: Range<f64>,
    /// Width of the line, m, where it is stated.
    pub width_m: Option<f64>,
    /// Height of the paint over the road, m, where it is stated.
    pub thickness_m: Option<f64>,
    /// Lengths of dashes and gaps, m, where they are stated.
    pub dash_gap_m: Option<(f64, f64)>,
}

impl Mark {
    /// The line on its road; what the file does not state is that of `paint`. None where the lane has no surface.
    pub fn line(&self, road: &Road, paint: &Paint) -> Option<LinePlan> {
        let lane = match self.of_lane {
            Some((side, i)) => road.side(side).get(i),
            None => road.left.first().or(road.right.first()),
        };
        let under = lane?.surface.clone()?;
        let lateral = match self.of_lane {
            Some((side, i)) => {
                let edge = if side == Side::Left { InLane::Left } else { InLane::Right };
                Lateral { base: Base::Lane(side, i, edge), offset: Profile::constant(self.offset_m) }
            }
            None => {
                let offset = road.lane_offset.plus(&Profile::constant(self.offset_m), 1.0);
                Lateral { base: Base::Axis, offset }
            }
        };
        let mut paint = paint.clone();
        paint.width_m = self.width_m.unwrap_or(paint.width_m);
        paint.thickness_m = self.thickness_m.unwrap_or(paint.thickness_m);
        (paint.dash_m, paint.gap_m) = self.dash_gap_m.unwrap_or((paint.dash_m, paint.gap_m));
        let (kind, span_m, of_lane) = (self.kind, self.span_m.clone(), self.of_lane);
        Some(LinePlan { lateral, kind, paint, under, span_m, of_lane })
    }
}

/// One kind of thing that a file's reader has to say.
struct Note {
    kind: String,
    text: String,
    line: u32,
    count: usize,
}

struct Xml<'a> {
    file: &'a Path,
    doc: &'a Document<'a>,
    notes: RefCell<Vec<Note>>,
}

impl Xml<'_> {
    fn line(&self, node: Node) -> u32 {
        self.doc.text_pos_at(node.range().start).row
    }

    fn bad(&self, node: Node, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(self.file).line(self.line(node) as usize).key(node.tag_name().name())
    }

    /// Notes something that was assumed, mended or left out. `kind` says of which kind it is: what is of one kind
    /// becomes one line.
    fn warn(&self, node: Node, kind: impl Into<String>, text: impl Into<String>) {
        let (kind, name) = (kind.into(), node.tag_name().name());
        let kind = format!("{name} {kind}");
        let mut notes = self.notes.borrow_mut();
        match notes.iter_mut().find(|n| n.kind == kind) {
            Some(n) => n.count += 1,
            None => {
                let text = format!("{name}: {}", text.into());
                notes.push(Note { kind, text, line: self.line(node), count: 1 });
            }
        }
    }

    /// The warnings so far, one line each.
    fn take_warnings(&self) -> Vec<String> {
        let said = |n: Note| {
            let more =
                if n.count > 1 { format!(" ({} such, the first here)", n.count) } else { String::new() };
            format!("{}:{}: {}{more}", self.file.display(), n.line, n.text)
        };
        self.notes.take().into_iter().map(said).collect()
    }

    fn number_or(&self, node: Node, name: &str, default: Option<f64>) -> Result<f64> {
        let Some(text) = node.attribute(name) else {
            return default.ok_or_else(|| self.bad(node, format!("has no attribute {name}")).into());
        };
        let number = text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        number
            .ok_or_else(|| self.bad(node, format!("{name} is not a finite number")).value(shown(text)).into())
    }

    fn number(&self, node: Node, name: &str) -> Result<f64> {
        self.number_or(node, name, None)
    }

    /// One of the words that an attribute may have; None without the attribute.
    fn word<T: Copy>(&self, node: Node, name: &str, words: &[(&str, T)]) -> Result<Option<T>> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        if let Some((_, value)) = words.iter().find(|(w, _)| *w == text.trim()) {
            return Ok(Some(*value));
        }
        let allowed: Vec<&str> = words.iter().map(|(w, _)| *w).collect();
        let e = self.bad(node, format!("{name} is not a value of the standard")).value(shown(text));
        Err(e.allowed(allowed.join(", ")).remedy("correct or remove the attribute").into())
    }

    fn truth(&self, node: Node, name: &str) -> Result<bool> {
        let words = [("true", true), ("false", false), ("1", true), ("0", false)];
        Ok(self.word(node, name, &words)?.unwrap_or(false))
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
            if pieces.is_empty() && piece.s0_m > JOINT_M && piece.coefficients[0] != 0.0 {
                let text =
                    format!("the first begins at s = {} m; its first value applies before it", piece.s0_m);
                self.warn(n, "late", text);
            }
            pieces.push(piece);
        }
        if pieces.is_empty() { Ok(Profile::constant(0.0)) } else { Profile::cubics(pieces) }
    }

    /// Names what is in an element and is left out of the road, along the list of the standard's elements.
    fn walk(&self, node: Node, path: &str) {
        let Some(row) = element(path) else { return };
        let name = node.tag_name().name();
        for a in node.attributes().filter(|a| a.namespace().is_none()) {
            match row.attributes.iter().find(|(n, _)| *n == a.name()) {
                Some((_, Treatment::LeftOut(in_place))) => {
                    if !matches!(a.value().trim(), "false" | "0" | "none") {
                        let text = format!("{} is left out; {in_place}", a.name());
                        self.warn(node, format!("attribute {}", a.name()), text);
                    }
                }
                Some(_) => {}
                None => {
                    let attribute = shown(a.name());
                    let text = format!("the attribute {attribute} of {name} is not known, and is left out");
                    self.warn(node, format!("attribute {attribute}"), text);
                }
            }
        }
        for child in node.children().filter(Node::is_element) {
            self.child(child, path);
        }
    }

    fn child(&self, child: Node, path: &str) {
        let name = child.tag_name().name();
        let step = match name {
            "left" | "center" | "right" if path == "road/lanes/laneSection" => "side",
            name => name,
        };
        let path = if path.is_empty() { step.to_string() } else { format!("{path}/{step}") };
        match anywhere(name).or_else(|| element(&path).map(|e| e.treatment)) {
            Some(Treatment::Read) => self.walk(child, &path),
            Some(Treatment::NoEffect(_)) => {}
            Some(Treatment::LeftOut(in_place)) => {
                self.warn(child, "left out", format!("is left out; {in_place}"));
            }
            None => {
                let within = child.parent().map_or("", |p| p.tag_name().name());
                let text = format!("is not a known element of {within}, and is left out");
                self.warn(child, format!("in {within}"), text);
            }
        }
    }
}

/// A value from a file for a message of one line.
fn shown(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(40).collect()
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

/// The road with the id `id` of the file at `file`, or its first road; `Err` of the ids where it has no such road.
/// See [`parse`].
///
/// # Errors
/// Returns an error for a file that cannot be read, of more than [`MAX_BYTES`], and the errors of [`parse`] as far as
/// they concern that road.
pub fn read(file: &Path, id: Option<&str>) -> Result<std::result::Result<ReadRoad, Vec<String>>> {
    let text = read_text_of(file, "an OpenDRIVE file", MAX_BYTES)?;
    network(file, &text, |xml, root, nodes| {
        let ids: Vec<String> = nodes.iter().filter_map(|n| n.attribute("id")).map(String::from).collect();
        let place = match id {
            Some(id) => nodes.iter().position(|n| n.attribute("id") == Some(id)),
            None => Some(0),
        };
        let Some(place) = place else { return Ok(Err(ids)) };
        if let (None, [first, _, ..]) = (id, nodes) {
            let count = nodes.len();
            let name = shown(first.attribute("id").unwrap_or_default());
            let text = format!(
                "'{name}' is the first of {count} roads, and only it is built; select a road with opendrive_road"
            );
            xml.warn(*first, "first", text);
        }
        let offset = of_file(xml, root)?;
        let read = road(xml, nodes[place], &offset)?;
        Ok(Ok(ReadRoad { warnings: xml.take_warnings(), ..read }))
    })
}

/// The roads of a file, named by their ids. Their lanes have OpenDRIVE's numbers, positive on the left; lanes of
/// one number in several sections are one lane, with no width where a section lacks it. Surfaces are asphalt
/// (grass for what is not driven).
///
/// # Errors
/// Returns an error, with the file and the line in it, if the text is not a road network that catseye can read.
pub fn parse(file: &Path, text: &str) -> Result<Vec<ReadRoad>> {
    network(file, text, |xml, root, nodes| {
        let offset = of_file(xml, root)?;
        let of_all = xml.take_warnings();
        let mut roads = Vec::new();
        for node in nodes {
            let read = road(xml, *node, &offset)?;
            roads.push(ReadRoad { warnings: [of_all.clone(), xml.take_warnings()].concat(), ..read });
        }
        Ok(roads)
    })
}

/// Opens the text and gives its root and its roads, of which there is at least one.
fn network<T>(file: &Path, text: &str, use_it: impl FnOnce(&Xml, Node, &[Node]) -> Result<T>) -> Result<T> {
    let options = roxmltree::ParsingOptions { allow_dtd: false, ..Default::default() };
    let doc = Document::parse_with_options(text, options).map_err(|e| {
        let e_text = e.to_string().replace('\n', " ");
        BadInput::new(format!("is not XML: {e_text}")).file(file).line(e.pos().row as usize)
    })?;
    let xml = Xml { file, doc: &doc, notes: RefCell::default() };
    let root = doc.root_element();
    if !root.has_tag_name("OpenDRIVE") {
        return Err(xml.bad(root, "is not OpenDRIVE").remedy("give an .xodr file").into());
    }
    let nodes: Vec<Node> = root.children().filter(|n| n.has_tag_name("road")).collect();
    if nodes.is_empty() {
        return Err(xml.bad(root, "has no road").into());
    }
    use_it(&xml, root, &nodes)
}

/// Where the header puts the origin of the file's coordinates.
struct Offset {
    at_m: DVec2,
    z_m: f64,
    turn_rad: f64,
}

/// What concerns the whole file: its header and what stands beside its roads.
fn of_file(xml: &Xml, root: Node) -> Result<Offset> {
    let mut offset = Offset { at_m: DVec2::ZERO, z_m: 0.0, turn_rad: 0.0 };
    for child in root.children().filter(|n| n.is_element() && !n.has_tag_name("road")) {
        xml.child(child, "");
        if !child.has_tag_name("header") {
            continue;
        }
        let (major, minor) =
            (xml.number_or(child, "revMajor", Some(1.0))?, xml.number_or(child, "revMinor", Some(4.0))?);
        if major != 1.0 || !(4.0..=8.0).contains(&minor) {
            xml.warn(child, "version", format!("version {major}.{minor} is read as if it were 1.4 to 1.8"));
        }
        for o in child.children().filter(|n| n.has_tag_name("offset")) {
            let number = |name| xml.number_or(o, name, Some(0.0));
            offset.at_m = DVec2::new(number("x")?, number("y")?);
            (offset.z_m, offset.turn_rad) = (number("z")?, number("hdg")?);
            if offset.at_m != DVec2::ZERO || offset.z_m != 0.0 || offset.turn_rad != 0.0 {
                let Offset { at_m, z_m, turn_rad } = &offset;
                let text = format!(
                    "the road is turned by {turn_rad} rad and then moved by [{}, {}, {z_m}] m, as the standard requires; remove the offset to keep the coordinates of planView",
                    at_m.x, at_m.y
                );
                xml.warn(o, "applied", text);
            }
        }
    }
    Ok(offset)
}

/// A lane section as far as it counts for one side of the road.
struct Section<'a> {
    node: Node<'a, 'a>,
    start_m: f64,
    end_m: f64,
}

/// The sections that count for a side, in their order.
fn sections<'a>(xml: &Xml, road: Node<'a, 'a>, side: &'static str, end_m: f64) -> Result<Vec<Section<'a>>> {
    let mut list: Vec<Section> = Vec::new();
    let mut last_m = f64::NEG_INFINITY;
    for node in children(road, &["lanes", "laneSection"]) {
        let start_m = xml.number(node, "s")?;
        if !(-JOINT_M..end_m + joint(end_m)).contains(&start_m) {
            let e = xml.bad(node, "begins outside the road").value(start_m);
            return Err(e.allowed(format!("s from 0 to {end_m} m")).into());
        }
        if start_m < last_m {
            return Err(xml.bad(node, "begins before the section before it").value(start_m).into());
        }
        last_m = start_m;
        // A section of a single side leaves the lanes of the others as they are.
        if xml.truth(node, "singleSide")? && children(node, &[side]).is_empty() {
            continue;
        }
        if let Some(before) = list.last_mut() {
            before.end_m = start_m;
            if start_m - before.start_m < SHORTEST_M {
                xml.warn(before.node, "short", "has no length, and is left out");
                list.pop();
            }
        }
        list.push(Section { node, start_m, end_m: f64::INFINITY });
    }
    if let Some(first) = list.first().filter(|s| s.start_m > JOINT_M) {
        let text =
            format!("the first one begins at s = {} m; its lanes apply before it as well", first.start_m);
        xml.warn(first.node, "late", text);
    }
    Ok(list)
}

fn road(xml: &Xml, node: Node<'_, '_>, offset: &Offset) -> Result<ReadRoad> {
    let name = node.attribute("id").ok_or_else(|| xml.bad(node, "has no attribute id"))?.to_string();
    xml.walk(node, "road");
    let axis = axis(xml, node, offset)?;
    let end_m = axis.length_m();
    let lane_offset = xml.profile(children(node, &["lanes", "laneOffset"]).into_iter())?;
    let left_hand = xml.word(node, "rule", &[("RHT", false), ("LHT", true)])?.unwrap_or(false);
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
    let mut marks = Vec::new();
    let centre: Vec<(Range<f64>, Node)> = (sections(xml, node, "center", end_m)?.iter())
        .filter_map(|s| {
            Some((s.start_m..s.end_m.min(end_m), *children(s.node, &["center", "lane"]).first()?))
        })
        .collect();
    road.centre_line = lines(xml, &centre, None, &mut marks)?;
    for (side, of, forward) in [("left", Side::Left, left_hand), ("right", Side::Right, !left_hand)] {
        let sections = sections(xml, node, side, end_m)?;
        let mut numbers = Vec::new();
        for section in &sections {
            let mut here = Vec::new();
            for lane in children(section.node, &[side, "lane"]) {
                let id = xml.number(lane, "id")?;
                if id.fract() != 0.0 || id * of.sign() < 1.0 || id.abs() > 1000.0 {
                    return Err(xml
                        .bad(lane, format!("is not a number of a lane on the {side}"))
                        .value(id)
                        .into());
                }
                let number = id as i32;
                if here.contains(&number) {
                    let e = xml.bad(lane, "two lanes of the section have this number").value(number);
                    return Err(e.remedy("give each lane a number of its own").into());
                }
                here.push(number);
            }
            numbers.extend(here);
        }
        numbers.sort_unstable_by_key(|n| n.abs());
        numbers.dedup();
        let across = Across { xml, sections, side, sign: of.sign(), forward, end_m };
        // Where the lanes so far end.
        let mut edge = road.lane_offset.clone();
        for (i, number) in numbers.into_iter().enumerate() {
            let mut lane = across.lane(number, &edge)?;
            edge = edge.plus(&lane.width, of.sign());
            let found: Vec<(Range<f64>, Node)> = across.found(number).collect();
            lane.line = lines(xml, &found, Some((of, i)), &mut marks)?;
            if of == Side::Left { road.left.push(lane) } else { road.right.push(lane) }
        }
    }
    road.check().map_err(|e| match e {
        crate::base::error::Error::Input(b) => {
            let at = xml.bad(node, "");
            crate::base::error::Error::Input(Box::new(BadInput { file: at.file, line: at.line, ..*b }))
        }
        e => e,
    })?;
    for lane in children(node, &["lanes", "laneSection"]).into_iter().flat_map(|s| s.descendants()) {
        tilted(xml, &road, lane)?;
    }
    Ok(ReadRoad { road, marks, warnings: Vec::new() })
}

/// Names what would lift or level a single lane: the surface is one plane on each side of the axis.
fn tilted(xml: &Xml, road: &Road, node: Node) -> Result<()> {
    let flat = |p: &Profile| *p == Profile::constant(0.0);
    let is_flat = flat(road.axis.cross_slope()) && road.axis.right_slope().is_none_or(flat);
    if node.has_tag_name("lane") && !is_flat && xml.truth(node, "level")? {
        xml.warn(node, "level", "level = \"true\" is left out; the lane is tilted with the road");
    }
    if node.has_tag_name("height") {
        let (inner_m, outer_m) = (xml.number(node, "inner")?, xml.number(node, "outer")?);
        if inner_m != 0.0 || outer_m != 0.0 {
            xml.warn(
                node,
                "height",
                "is left out; the lane is in the plane of the road; describe a kerb in [[road.kerb]]",
            );
        }
    }
    Ok(())
}

/// The lanes of a side.
struct Across<'a> {
    xml: &'a Xml<'a>,
    sections: Vec<Section<'a>>,
    side: &'static str,
    sign: f64,
    /// Whether its traffic goes along the axis.
    forward: bool,
    end_m: f64,
}

impl<'a> Across<'a> {
    fn lane_of(&self, section: &Section<'a>, number: i32) -> Option<Node<'a, 'a>> {
        let is_it =
            |l: &Node| l.attribute("id").and_then(|t| t.trim().parse().ok()) == Some(f64::from(number));
        children(section.node, &[self.side, "lane"]).into_iter().find(is_it)
    }

    /// The lane's elements, and where they count.
    fn found(&self, number: i32) -> impl Iterator<Item = (Range<f64>, Node<'a, 'a>)> {
        self.sections
            .iter()
            .filter_map(move |s| Some((s.start_m..s.end_m.min(self.end_m), self.lane_of(s, number)?)))
    }

    /// The lane of that number through all sections, beside lanes that end at t = `inner`.
    fn lane(&self, number: i32, inner: &Profile) -> Result<Lane> {
        let xml = self.xml;
        let mut pieces: Vec<Piece> = Vec::new();
        let mut first: Option<(LaneKind, Driven, &str)> = None;
        for section in &self.sections {
            let none = Piece { s0_m: section.start_m, coefficients: [0.0; 4] };
            let Some(l) = self.lane_of(section, number) else {
                pieces.push(none);
                continue;
            };
            let word = l.attribute("type").unwrap_or("none");
            let (kind, driven) = (self.kind(l, word), self.driven(l, word)?);
            match first {
                None => first = Some((kind, driven, word)),
                Some((k, d, w)) if (k, d) != (kind, driven) => {
                    let text = format!(
                        "lane {number} changes from {w} ({}) to {} ({}); it keeps its first type",
                        way(d),
                        shown(word),
                        way(driven)
                    );
                    xml.warn(l, format!("change of {number}"), text);
                }
                Some(_) => {}
            }
            let (widths, borders) = (self.chain(section, l, "width")?, self.chain(section, l, "border")?);
            match (widths, borders) {
                (Some(widths), borders) => {
                    if borders.is_some() {
                        let text =
                            "has borders as well as widths; the widths apply, as the standard requires";
                        xml.warn(l, "twice", text);
                    }
                    pieces.extend(widths);
                }
                (None, Some(borders)) => {
                    let lanes = children(section.node, &[self.side, "lane"]);
                    if lanes.iter().any(|o| !children(*o, &["width"]).is_empty()) {
                        let text = "has a border while other lanes of the section have widths; it extends from them to its border";
                        xml.warn(l, "mixed", text);
                    }
                    let border = Profile::cubics(borders)?;
                    let width = border.plus(inner, -1.0);
                    let scaled = |s0_m: f64| Piece {
                        s0_m,
                        coefficients: width.from_here(s0_m).map(|c| self.sign * c),
                    };
                    pieces.push(scaled(section.start_m));
                    let inside = |s: &f64| *s > section.start_m && *s < section.end_m;
                    pieces.extend(width.breaks_m().filter(inside).map(scaled));
                }
                (None, None) => {
                    xml.warn(l, "no width", "has neither width nor border; its width is zero");
                    pieces.push(none);
                }
            }
        }
        let (kind, driven, _) = first.unwrap_or((LaneKind::Verge, Driven::Forward, ""));
        let surface = if kind.is_drivable() || kind == LaneKind::Sidewalk { "asphalt" } else { "grass" };
        let (width, line) = (Profile::cubics(pieces)?, LineKind::None);
        Ok(Lane { number, kind, driven, width, surface: Some(surface.into()), line })
    }

    /// The cubics of a lane in a section, from its beginning on; None where it has none of that name.
    fn chain(&self, section: &Section, lane: Node<'a, 'a>, name: &'static str) -> Result<Option<Vec<Piece>>> {
        let xml = self.xml;
        let mut pieces: Vec<Piece> = Vec::new();
        for w in children(lane, &[name]) {
            let offset_m = xml.number(w, "sOffset")?;
            if offset_m < 0.0 {
                return Err(xml.bad(w, "sOffset is negative").value(offset_m).allowed("0 or more").into());
            }
            let piece = xml.cubic(w, section.start_m + offset_m)?;
            if pieces.last().is_some_and(|before| piece.s0_m < before.s0_m) {
                return Err(xml.bad(w, "begins before the one before it").value(offset_m).into());
            }
            if piece.s0_m >= section.end_m.min(self.end_m + joint(self.end_m)) {
                xml.warn(w, "beyond", "begins after the end of its section, and is left out");
                continue;
            }
            if pieces.is_empty() && offset_m > SHORTEST_M {
                let text = format!(
                    "the first one begins {offset_m} m into its section; its first value applies before"
                );
                xml.warn(w, "late", text);
                let coefficients = [piece.coefficients[0], 0.0, 0.0, 0.0];
                pieces.push(Piece { s0_m: section.start_m, coefficients });
            }
            pieces.push(piece);
        }
        Ok((!pieces.is_empty()).then_some(pieces))
    }

    fn driven(&self, lane: Node, word: &str) -> Result<Driven> {
        let words = [("standard", Some(self.forward)), ("reversed", Some(!self.forward)), ("both", None)];
        let standard = if word == "bidirectional" { None } else { Some(self.forward) };
        Ok(match self.xml.word(lane, "direction", &words)?.unwrap_or(standard) {
            Some(true) => Driven::Forward,
            Some(false) => Driven::Backward,
            None => Driven::Both,
        })
    }

    fn kind(&self, lane: Node, word: &str) -> LaneKind {
        match word {
            "driving" | "bidirectional" | "bus" | "taxi" | "HOV" | "tram" => LaneKind::Driving,
            "stop" => LaneKind::Emergency,
            "entry" | "exit" | "onRamp" | "offRamp" | "connectingRamp" | "mwyEntry" | "mwyExit"
            | "slipLane" => LaneKind::Ramp,
            "shoulder" => LaneKind::Shoulder,
            "biking" => LaneKind::Bicycle,
            "parking" => LaneKind::Parking,
            "sidewalk" | "walking" | "curb" => LaneKind::Sidewalk,
            "median" => LaneKind::Median,
            "none" => LaneKind::Verge,
            other => {
                let other = shown(other);
                let text = format!(
                    "type '{other}' has no corresponding kind of lane; it becomes grass beside the road"
                );
                self.xml.warn(lane, format!("type {other}"), text);
                LaneKind::Verge
            }
        }
    }
}

fn way(driven: Driven) -> &'static str {
    match driven {
        Driven::Forward => "along the axis",
        Driven::Backward => "against the axis",
        Driven::Both => "both ways",
    }
}

/// The road marks of a lane. Returns the kind of line where one kind marks it all along; other marks go to `marks`.
fn lines(
    xml: &Xml,
    lanes: &[(Range<f64>, Node)],
    of_lane: Option<(Side, usize)>,
    marks: &mut Vec<Mark>,
) -> Result<LineKind> {
    let mut own: Vec<Mark> = Vec::new();
    for (span, lane) in lanes {
        let nodes: Vec<Node> = lane.children().filter(|n| n.has_tag_name("roadMark")).collect();
        let mut starts = Vec::new();
        for n in &nodes {
            let s_m = span.start + xml.number_or(*n, "sOffset", Some(0.0))?;
            if starts.last().is_some_and(|before| s_m < *before) {
                return Err(xml.bad(*n, "begins before the one before it").value(s_m - span.start).into());
            }
            starts.push(s_m);
        }
        for (i, n) in nodes.iter().enumerate() {
            let end_m = starts.get(i + 1).map_or(span.end, |s| s.min(span.end));
            for mark in painted(xml, *n, starts[i]..end_m, of_lane)? {
                let goes_on = |m: &&mut Mark| {
                    (m.span_m.end - mark.span_m.start).abs() < SHORTEST_M
                        && Mark { span_m: mark.span_m.clone(), ..(**m).clone() } == mark
                };
                match own.iter_mut().find(goes_on) {
                    Some(m) => m.span_m.end = mark.span_m.end,
                    None => own.push(mark),
                }
            }
        }
    }
    if let ([m], Some((first, _)), Some((last, _))) = (own.as_slice(), lanes.first(), lanes.last()) {
        let whole = lanes.windows(2).all(|w| w[0].0.end == w[1].0.start)
            && (m.span_m.start - first.start).abs() < SHORTEST_M
            && (m.span_m.end - last.end).abs() < SHORTEST_M;
        let plain =
            m.offset_m == 0.0 && m.width_m.is_none() && m.thickness_m.is_none() && m.dash_gap_m.is_none();
        if whole && plain {
            return Ok(m.kind);
        }
    }
    marks.extend(own);
    Ok(LineKind::None)
}

/// The lines that a road mark paints between two positions.
fn painted(xml: &Xml, node: Node, span_m: Range<f64>, of_lane: Option<(Side, usize)>) -> Result<Vec<Mark>> {
    if span_m.end - span_m.start < 1e-3 {
        return Ok(Vec::new());
    }
    let metres = |node: Node, name: &'static str, low: f64, high: f64| -> Result<Option<f64>> {
        if node.attribute(name).is_none() {
            return Ok(None);
        }
        let m = xml.number(node, name)?;
        if m > low && m <= high {
            return Ok(Some(m));
        }
        // Zero stands for what is not stated.
        if m != 0.0 {
            xml.warn(
                node,
                name,
                format!("{name} = {m} m is out of {low}..{high} m; the value of the road's paint is used"),
            );
        }
        Ok(None)
    };
    for (name, plain) in [("color", ["standard", "white"]), ("material", ["standard", "paint"])] {
        if let Some(word) = node.attribute(name).filter(|w| !plain.contains(w)) {
            let text = format!("{name} '{}' is left out; the line has the road's paint", shown(word));
            xml.warn(node, name, text);
        }
    }
    let width_m = metres(node, "width", 0.0, 10.0)?;
    if node.attribute("weight") == Some("bold") && width_m.is_none() {
        xml.warn(node, "weight", "weight 'bold' has no width; the line has the width of the road's paint");
    }
    let thickness_m = metres(node, "height", 1e-4, 0.05)?;
    let plain = Mark {
        of_lane,
        offset_m: 0.0,
        kind: LineKind::Solid,
        span_m: span_m.clone(),
        width_m,
        thickness_m,
        dash_gap_m: None,
    };
    let detailed = detailed(xml, node, &plain, &metres)?;
    if !detailed.is_empty() {
        return Ok(detailed);
    }
    let one = |kind| Mark { kind, ..plain.clone() };
    // Of two different lines the first is the inner one, or the left one of the centre lane.
    let outwards = of_lane.map_or(-1.0, |(side, _)| side.sign());
    let two = |inner, outer| {
        let width_m = width_m.unwrap_or(0.12);
        let at = |kind, sign: f64| Mark {
            offset_m: sign * outwards * width_m,
            width_m: Some(width_m),
            ..one(kind)
        };
        vec![at(inner, -1.0), at(outer, 1.0)]
    };
    use LineKind::{Dashed, Double, Solid};
    Ok(match node.attribute("type").map(str::trim) {
        None | Some("none") => Vec::new(),
        Some("solid") => vec![one(Solid)],
        Some("broken") => vec![one(Dashed)],
        Some("solid solid") => vec![one(Double)],
        Some("broken broken") => two(Dashed, Dashed),
        Some("solid broken") => two(Solid, Dashed),
        Some("broken solid") => two(Dashed, Solid),
        Some(other) => {
            let other = shown(other);
            let text = format!("type '{other}' is left out; no line is painted or built");
            xml.warn(node, format!("type {other}"), text);
            Vec::new()
        }
    })
}

/// Reads an attribute in metres between two limits; None without it.
type Metres<'a> = dyn Fn(Node, &'static str, f64, f64) -> Result<Option<f64>> + 'a;

/// The lines of a road mark that states them one by one.
fn detailed(xml: &Xml, node: Node, plain: &Mark, metres: &Metres<'_>) -> Result<Vec<Mark>> {
    let mut marks = Vec::new();
    for (name, is_explicit) in [("type", false), ("explicit", true)] {
        for group in node.children().filter(|n| n.has_tag_name(name)) {
            let group_m = if is_explicit { None } else { metres(group, "width", 0.0, 10.0)? };
            for l in group.children().filter(|n| n.has_tag_name("line")) {
                let number = |name| xml.number_or(l, name, Some(0.0));
                let (length_m, space_m) = (number("length")?, number("space")?);
                let start_m = plain.span_m.start + number("sOffset")?.max(0.0);
                let mut end_m = plain.span_m.end;
                if is_explicit {
                    end_m = end_m.min(start_m + length_m);
                }
                if let Some(word) = l.attribute("color").filter(|w| !["standard", "white"].contains(w)) {
                    let text = format!("color '{}' is left out; the line has the road's paint", shown(word));
                    xml.warn(l, "color", text);
                }
                let dashed = !is_explicit && space_m > 0.0;
                if dashed && !(length_m >= 0.01 && space_m >= 0.01) || end_m - start_m < 1e-3 {
                    let text = "has dashes or gaps of less than 1 cm, or no length, and is left out";
                    xml.warn(l, "short", text);
                    continue;
                }
                marks.push(Mark {
                    kind: if dashed { LineKind::Dashed } else { LineKind::Solid },
                    offset_m: number("tOffset")?,
                    span_m: start_m..end_m,
                    width_m: metres(l, "width", 0.0, 10.0)?.or(group_m).or(plain.width_m),
                    dash_gap_m: dashed.then_some((length_m, space_m)),
                    ..plain.clone()
                });
            }
        }
    }
    Ok(marks)
}

/// The shape of a geometry.
fn course(xml: &Xml, g: Node<'_, '_>, length_m: f64) -> Result<Course> {
    let known = ["line", "arc", "spiral", "poly3", "paramPoly3"];
    let shapes = || g.children().filter(|n| n.is_element() && anywhere(n.tag_name().name()).is_none());
    let shape = shapes().find(|n| known.contains(&n.tag_name().name())).or_else(|| shapes().next());
    let shape = shape.ok_or_else(|| xml.bad(g, "has no shape"))?;
    if shapes().filter(|n| known.contains(&n.tag_name().name())).count() > 1 {
        return Err(xml
            .bad(g, "has two shapes")
            .allowed("one of line, spiral, arc, poly3, paramPoly3")
            .into());
    }
    Ok(match shape.tag_name().name() {
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
            Course::Cubic { length_m, u, v, p_end: p_end(xml, shape, (u, v), length_m)? }
        }
        other => return Err(xml.bad(g, format!("has an unknown shape '{}'", shown(other))).into()),
    })
}

/// The last parameter of a parametric cubic: 1 or the length, whichever makes a curve of that length.
fn p_end(xml: &Xml, shape: Node, (u, v): ([f64; 4], [f64; 4]), length_m: f64) -> Result<f64> {
    let speed = |p: f64| {
        let d = |c: [f64; 4]| c[1] + p * (2.0 * c[2] + 3.0 * p * c[3]);
        d(u).hypot(d(v))
    };
    let ranges = [("normalized", 1.0), ("arcLength", length_m)].map(|(name, end)| {
        let long_m = simpson(&speed, end);
        (name, end, long_m, (long_m - length_m).abs())
    });
    let words = [("normalized", 0), ("arcLength", 1)];
    let stated = xml.word(shape, "pRange", &words)?;
    let fits = |i: usize| ranges[i].3 <= LENGTH_MISS * length_m;
    let nearer = usize::from(ranges[1].3 < ranges[0].3);
    let chosen = match stated {
        Some(i) if fits(i) => {
            let (name, _, long_m, miss_m) = ranges[i];
            if miss_m > LENGTH_ROUNDING * length_m {
                let text = format!(
                    "the curve is {long_m:.3} m long as {name}, but the geometry is {length_m} m long; s is stretched evenly along the curve"
                );
                xml.warn(shape, "stretched", text);
            }
            i
        }
        Some(i) if fits(1 - i) => {
            let ((said, _, there_m, _), (name, ..)) = (ranges[i], ranges[1 - i]);
            let text = format!(
                "pRange '{said}' gives a curve of {there_m:.3} m, but the geometry is {length_m} m long; it is read as '{name}', which fits"
            );
            xml.warn(shape, "pRange", text);
            1 - i
        }
        None if fits(nearer) => {
            let (name, _, long_m, _) = ranges[nearer];
            let text = format!(
                "has no pRange; it is read as '{name}', whose curve is {long_m:.3} m long, while the geometry is {length_m} m long"
            );
            xml.warn(shape, "pRange", text);
            nearer
        }
        _ => {
            let lengths = ranges.map(|(name, _, long_m, _)| format!("{long_m:.3} m as {name}"));
            let e = xml
                .bad(shape, format!("is a curve of {}", lengths.join(" and ")))
                .value(format!("length {length_m} m"));
            return Err(e
                .allowed(format!("a length within {} % of one of them", 100.0 * LENGTH_MISS))
                .remedy("correct the coefficients, or the length of the geometry")
                .into());
        }
    };
    Ok(ranges[chosen].1)
}

fn axis(xml: &Xml, road: Node<'_, '_>, offset: &Offset) -> Result<RoadAxis> {
    let mut elements: Vec<(Start, Course)> = Vec::new();
    // Where the next geometry begins: the sum of the lengths so far.
    let mut s_m = 0.0;
    let mut ahead: Option<RoadAxis> = None;
    // How far the geometries from here on are moved to close the gaps before them.
    let mut moved_m = DVec2::ZERO;
    let turn = DVec2::from_angle(offset.turn_rad);
    for g in children(road, &["planView", "geometry"]) {
        let length_m = xml.number(g, "length")?;
        let at_m = offset.at_m + turn.rotate(DVec2::new(xml.number(g, "x")?, xml.number(g, "y")?));
        let start = Start { at_m, heading_rad: xml.number(g, "hdg")? + offset.turn_rad };
        if (0.0..SHORTEST_M).contains(&length_m) {
            xml.warn(g, "short", "has no length, and is left out");
            continue;
        }
        let given_m = xml.number_or(g, "s", Some(s_m))?;
        let course = course(xml, g, length_m)?;
        let placed = |start, course| {
            RoadAxis::placed(&[(start, course)], Profile::constant(0.0)).map_err(|e| match e {
                crate::base::error::Error::Input(b) => xml.bad(g, b.problem).into(),
                e => e,
            })
        };
        let alone = placed(start, course)?;
        let jump = ahead.as_ref().map_or(DVec2::ZERO, |before: &RoadAxis| {
            (alone.at(0.0).position_m - before.at(before.length_m()).position_m).truncate()
        });
        let gap_m = jump.length();
        if (given_m - s_m).abs() > joint(s_m).max(GAP_M) {
            let e = xml.bad(g, "s is not where the geometry before it ends").value(given_m);
            return Err(e.allowed(format!("s = {s_m}")).into());
        }
        if gap_m > GAP_M {
            let e =
                xml.bad(g, "does not begin where the one before it ends").value(format!("{gap_m:.3} m off"));
            return Err(e.allowed(format!("up to {GAP_M} m")).into());
        }
        let heading = ahead.as_ref().map_or(0.0, |before| before.at(before.length_m()).heading_rad);
        let onwards = jump.dot(DVec2::from_angle(heading));
        if gap_m > ROUNDING_M && (given_m - s_m - gap_m).abs() <= ROUNDING_M && onwards > 0.9 * gap_m {
            // Nothing but a straight is missing.
            let text = format!("a gap of {gap_m:.3} m before it is closed with a straight");
            xml.warn(g, "gap closed", text);
            let from = Start { at_m: start.at_m - jump + moved_m, heading_rad: jump.to_angle() };
            elements.push((from, Course::Straight { length_m: gap_m }));
            s_m += gap_m;
        } else if gap_m > ROUNDING_M {
            moved_m -= jump;
            let text = format!(
                "begins {gap_m:.3} m away from the end of the one before it; the gap is closed, and the rest of the road is moved by {:.3} m",
                moved_m.length()
            );
            xml.warn(g, "gap", text);
        }
        if (given_m - s_m).abs() > joint(s_m) {
            let text =
                format!("states s = {given_m} m; it begins at {s_m} m, the sum of the lengths before it");
            xml.warn(g, "s", text);
        }
        ahead = Some(alone);
        elements.push((Start { at_m: start.at_m + moved_m, ..start }, course));
        s_m += length_m;
    }
    if elements.is_empty() {
        return Err(xml.bad(road, "has no planView with a geometry that has a length").into());
    }
    let plan_m = s_m;
    let length_m = xml.number_or(road, "length", Some(plan_m))?;
    if (length_m - plan_m).abs() > joint(plan_m).max(GAP_M) {
        return Err(xml
            .bad(road, format!("the stated length differs from the end of the geometry, {plan_m} m"))
            .value(format!("length {length_m} m"))
            .allowed(format!("{plan_m} m"))
            .remedy("complete planView, or correct the road's length")
            .into());
    }
    if (length_m - plan_m).abs() > joint(plan_m) {
        xml.warn(
            road,
            "length",
            format!("states a length of {length_m} m; it ends with planView at {plan_m} m"),
        );
    }
    let height = xml.profile(children(road, &["elevationProfile", "elevation"]).into_iter())?;
    let height = height.plus(&Profile::constant(offset.z_m), 1.0);
    let roll = xml.profile(children(road, &["lateralProfile", "superelevation"]).into_iter())?;
    let axis = RoadAxis::placed(&elements, height)?;
    let crossfall = children(road, &["lateralProfile", "crossfall"]);
    if crossfall.is_empty() {
        return Ok(axis.with_cross_slope(roll));
    }
    // A crossfall falls away from the axis, whose slopes count to the left.
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for c in crossfall {
        let words = [("left", (true, false)), ("right", (false, true)), ("both", (true, true))];
        let (is_left, is_right) = xml.word(c, "side", &words)?.unwrap_or((true, true));
        left.extend(is_left.then_some(c));
        right.extend(is_right.then_some(c));
    }
    let (left, right) = (xml.profile(left.into_iter())?, xml.profile(right.into_iter())?);
    Ok(axis.with_cross_slopes(roll.plus(&left, -1.0), roll.plus(&right, 1.0)))
}

/// The integral of a speed from 0 to `end` by Simpson's rule.
fn simpson(speed: &dyn Fn(f64) -> f64, end: f64) -> f64 {
    const N: usize = 1000;
    let h = end / N as f64;
    let weight = |i: usize| if i == 0 || i == N { 1.0 } else { 2.0 * (1 + i % 2) as f64 };
    (0..=N).map(|i| weight(i) * speed(h * i as f64)).sum::<f64>() * h / 3.0
}

/// How far u runs until the curve v(u) is `length_m` long.
fn reach(v: [f64; 4], length_m: f64) -> f64 {
    let speed = |p: f64| (v[1] + p * (2.0 * v[2] + 3.0 * p * v[3])).hypot(1.0);
    // No curve is shorter than its run along u.
    let (mut low, mut high) = (0.0, length_m);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if simpson(&speed, mid) < length_m { low = mid } else { high = mid }
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
        <left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark type="solid"/></lane></left>
        <center><lane id="0" type="none"><roadMark type="broken"/></lane></center>
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
        let r = &roads[0].road;
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
        let a = &parse(Path::new("a.xodr"), &text(poly, 60.0)).unwrap()[0].road.axis;
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
        let b = &parse(Path::new("a.xodr"), &text(&parametric, 60.0)).unwrap()[0].road.axis;
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
        assert!(complaint("<line/>", "<wave/>").contains("unknown shape 'wave'"));
        assert!(complaint("id=\"-2\"", "id=\"2\"").contains("is not a number of a lane on the right"));
        assert!(complaint("a=\"2.7\"", "a=\"-2.7\"").contains("is not a lane width"));
        // Bends without measure took memory without measure.
        assert!(complaint("d=\"1e-6\"", "d=\"1e66\"").contains("height of road '7'"));
        assert!(complaint("a=\"0.03\"", "a=\"1e9\"").contains("cross slope of road '7'"));
        assert!(complaint("<road id=\"7\"", "<rode id=\"7\"").contains("is not XML"));
    }
}
