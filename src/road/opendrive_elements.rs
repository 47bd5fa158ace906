//! The elements and attributes of OpenDRIVE 1.4 to 1.8 that a road may hold, and what is done with each. A file is
//! walked along this list, so that nothing in it is passed over in silence: what the list lacks is named in a
//! warning as well.

/// What is done with an element or attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Treatment {
    /// It is read; values that cannot be followed are refused or named in a warning where they are read.
    Read,
    /// It changes no lane, surface or body; with the reason.
    NoEffect(&'static str),
    /// It is left out with a warning that says what is done in its place.
    LeftOut(&'static str),
}

use Treatment::{LeftOut, NoEffect, Read};

/// One element of the standard.
#[derive(Debug, Clone, Copy)]
pub struct Element {
    /// Its names from the root, with `side` for left, center and right.
    pub path: &'static str,
    /// What is done with it; of what is not read, neither attributes nor children count.
    pub treatment: Treatment,
    /// What is done with its attributes.
    pub attributes: &'static [(&'static str, Treatment)],
}

const fn read(path: &'static str, attributes: &'static [(&'static str, Treatment)]) -> Element {
    Element { path, treatment: Read, attributes }
}

const fn no_effect(path: &'static str, reason: &'static str) -> Element {
    Element { path, treatment: NoEffect(reason), attributes: &[] }
}

const fn left_out(path: &'static str, in_place: &'static str) -> Element {
    Element { path, treatment: LeftOut(in_place), attributes: &[] }
}

const NAME: Treatment = NoEffect("a name");
const RULES: Treatment = NoEffect("a rule for drivers");
const TRAFFIC: &str = "a rule for drivers";
const LINKS: &str = "which lanes and roads follow; only one road is read";
const CUBIC: &[(&str, Treatment)] = &[("s", Read), ("a", Read), ("b", Read), ("c", Read), ("d", Read)];
const OFFSET_CUBIC: &[(&str, Treatment)] =
    &[("sOffset", Read), ("a", Read), ("b", Read), ("c", Read), ("d", Read)];

/// The elements in the order of the standard.
pub const ELEMENTS: &[Element] = &[
    read(
        "header",
        &[
            ("revMajor", Read),
            ("revMinor", Read),
            ("name", NAME),
            ("version", NAME),
            ("date", NAME),
            ("vendor", NAME),
            ("north", NoEffect("a bound of the file's coordinates")),
            ("south", NoEffect("a bound of the file's coordinates")),
            ("east", NoEffect("a bound of the file's coordinates")),
            ("west", NoEffect("a bound of the file's coordinates")),
        ],
    ),
    no_effect("header/geoReference", "the map projection of the world's metres"),
    read("header/offset", &[("x", Read), ("y", Read), ("z", Read), ("hdg", Read)]),
    no_effect("header/license", "the licence of the file"),
    no_effect("header/defaultRegulations", TRAFFIC),
    left_out("junction", "its area and connecting roads are not built; only the one road is built"),
    left_out("station", "its platforms are not built; add their objects with [[road.object]] or walls"),
    no_effect("controller", "switches of traffic lights"),
    no_effect("junctionGroup", LINKS),
    read(
        "road",
        &[
            ("name", NAME),
            ("length", Read),
            ("id", Read),
            ("junction", NoEffect("the junction of which the road is a part")),
            ("rule", Read),
        ],
    ),
    no_effect("road/link", LINKS),
    no_effect("road/type", "the class of the road and its speed limit"),
    read("road/planView", &[]),
    read("road/planView/geometry", &[("s", Read), ("x", Read), ("y", Read), ("hdg", Read), ("length", Read)]),
    read("road/planView/geometry/line", &[]),
    read("road/planView/geometry/spiral", &[("curvStart", Read), ("curvEnd", Read)]),
    read("road/planView/geometry/arc", &[("curvature", Read)]),
    read("road/planView/geometry/poly3", &[("a", Read), ("b", Read), ("c", Read), ("d", Read)]),
    read(
        "road/planView/geometry/paramPoly3",
        &[
            ("aU", Read),
            ("bU", Read),
            ("cU", Read),
            ("dU", Read),
            ("aV", Read),
            ("bV", Read),
            ("cV", Read),
            ("dV", Read),
            ("pRange", Read),
        ],
    ),
    read("road/elevationProfile", &[]),
    read("road/elevationProfile/elevation", CUBIC),
    read("road/lateralProfile", &[]),
    read("road/lateralProfile/superelevation", CUBIC),
    read(
        "road/lateralProfile/crossfall",
        &[("side", Read), ("s", Read), ("a", Read), ("b", Read), ("c", Read), ("d", Read)],
    ),
    left_out("road/lateralProfile/shape", "the road is flat across, with its superelevation and crossfall"),
    left_out(
        "road/lateralProfile/crossSectionSurface",
        "the road is flat across, with its superelevation and crossfall",
    ),
    read("road/lanes", &[]),
    read("road/lanes/laneOffset", CUBIC),
    read("road/lanes/laneSection", &[("s", Read), ("singleSide", Read)]),
    read("road/lanes/laneSection/side", &[]),
    read(
        "road/lanes/laneSection/side/lane",
        &[
            ("id", Read),
            ("type", Read),
            ("level", Read),
            ("direction", Read),
            ("advisory", RULES),
            ("dynamicLaneDirection", LeftOut("the lane keeps its direction for the whole run")),
            ("dynamicLaneType", LeftOut("the lane keeps its type for the whole run")),
            ("roadWorks", LeftOut("the lane is built as if there were no road works")),
        ],
    ),
    no_effect("road/lanes/laneSection/side/lane/link", LINKS),
    read("road/lanes/laneSection/side/lane/border", OFFSET_CUBIC),
    read("road/lanes/laneSection/side/lane/width", OFFSET_CUBIC),
    read(
        "road/lanes/laneSection/side/lane/roadMark",
        &[
            ("sOffset", Read),
            ("type", Read),
            ("weight", Read),
            ("color", Read),
            ("material", Read),
            ("width", Read),
            ("height", Read),
            ("laneChange", RULES),
        ],
    ),
    left_out(
        "road/lanes/laneSection/side/lane/roadMark/sway",
        "the line keeps its distance from the lane's edge",
    ),
    read("road/lanes/laneSection/side/lane/roadMark/type", &[("name", NAME), ("width", Read)]),
    read(
        "road/lanes/laneSection/side/lane/roadMark/type/line",
        &[
            ("length", Read),
            ("space", Read),
            ("tOffset", Read),
            ("sOffset", Read),
            ("width", Read),
            ("rule", RULES),
            ("color", Read),
        ],
    ),
    read("road/lanes/laneSection/side/lane/roadMark/explicit", &[]),
    read(
        "road/lanes/laneSection/side/lane/roadMark/explicit/line",
        &[("length", Read), ("tOffset", Read), ("sOffset", Read), ("width", Read), ("rule", RULES)],
    ),
    left_out(
        "road/lanes/laneSection/side/lane/material",
        "the surface is asphalt, or grass beside the road; give surface in [[road]]",
    ),
    no_effect("road/lanes/laneSection/side/lane/visibility", "the sight distance of a driver"),
    no_effect("road/lanes/laneSection/side/lane/speed", TRAFFIC),
    no_effect("road/lanes/laneSection/side/lane/access", TRAFFIC),
    read("road/lanes/laneSection/side/lane/height", &[("sOffset", Read), ("inner", Read), ("outer", Read)]),
    no_effect("road/lanes/laneSection/side/lane/rule", TRAFFIC),
    left_out("road/objects", "it is not built; add its objects with [[road.object]], rails and walls"),
    left_out("road/signals", "neither signs nor their posts are built; add them with [[road.object]]"),
    left_out("road/surface", "the surface is smooth except for the roughness of its material"),
    left_out("road/railroad", "no rails are built"),
];

/// The row of a path, where there is one.
pub fn element(path: &str) -> Option<&'static Element> {
    ELEMENTS.iter().find(|e| e.path == path)
}

/// What is done with the elements that every other may hold.
pub fn anywhere(name: &str) -> Option<Treatment> {
    match name {
        "userData" => Some(NoEffect("data of a program, outside the standard")),
        "dataQuality" => Some(NoEffect("the way in which the data were measured")),
        "include" => Some(LeftOut("the file that it names is not read; copy its elements into this one")),
        _ => None,
    }
}
