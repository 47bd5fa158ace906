//! OpenDRIVE files against closed forms and the text of the standard, and a walk along the standard's elements.

use crate::base::error::Result;
use crate::road::axis::RoadPoint;
use crate::road::layout::{Driven, LaneKind, LineKind, Side};
use crate::road::opendrive::{ReadRoad, parse};
use crate::road::opendrive_elements::ELEMENTS;
use crate::road::{build, scene_toml};
use glam::DVec3;
use std::path::Path;

fn read(text: &str) -> Result<ReadRoad> {
    Ok(parse(Path::new("a.xodr"), text)?.swap_remove(0))
}

/// The lanes of a straight of 60 m.
fn straight(road: &str, lanes: &str) -> String {
    format!(
        "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/><road id=\"1\" length=\"60\" {road}><planView>\
         <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"60\"><line/></geometry></planView>\
         <lanes>{lanes}</lanes></road></OpenDRIVE>"
    )
}

fn section(s_m: f64, left: &str, right: &str) -> String {
    format!(
        "<laneSection s=\"{s_m}\"><left>{left}</left><center><lane id=\"0\"/></center><right>{right}</right>\
         </laneSection>"
    )
}

fn lane(id: i32, attributes: &str, content: &str) -> String {
    let kind = if attributes.contains("type=") { "" } else { "type=\"driving\"" };
    format!("<lane id=\"{id}\" {kind} {attributes}>{content}</lane>")
}

fn cubic(name: &str, s_m: f64, [a, b, c, d]: [f64; 4]) -> String {
    format!("<{name} sOffset=\"{s_m}\" a=\"{a}\" b=\"{b}\" c=\"{c}\" d=\"{d}\"/>")
}

fn wide(metres: f64) -> String {
    cubic("width", 0.0, [metres, 0.0, 0.0, 0.0])
}

/// The one warning that says so.
fn warned(r: &ReadRoad, expect: &str) {
    let found: Vec<_> = r.warnings.iter().filter(|w| w.contains(expect)).collect();
    assert!(found.len() == 1 && found[0].starts_with("a.xodr:"), "{expect} is not once in {:?}", r.warnings);
}

/// ASAM OpenDRIVE 1.8, 11.6.2: a border is the t of a lane's outer limit.
#[test]
fn borders_are_the_outer_limits_of_lanes() {
    let right = lane(-1, "", &wide(3.5)) + &lane(-2, "", &cubic("border", 0.0, [-6.5, 0.0, 0.0, 0.0]));
    let r = read(&straight("", &section(0.0, "", &right))).unwrap();
    assert_eq!(r.road.lane_edges_t_m(Side::Right, 1, 30.0), (-3.5, -6.5));
    warned(&r, "lane: has a border while other lanes");
    // Borders alone, with records of their own, a lane offset, and widths in the next section.
    let border = |at: f64, c| cubic("border", at, c);
    let left = lane(1, "", &border(0.0, [4.0, 0.05, 0.0, 0.0]))
        + &lane(2, "", &(border(0.0, [7.0, 0.0, 0.0, 0.0]) + &border(10.0, [7.0, 0.0, 0.01, -1e-4])));
    let offset = "<laneOffset s=\"0\" a=\"0.5\" b=\"0.01\" c=\"0\" d=\"0\"/>";
    let lanes =
        section(0.0, &left, &lane(-1, "", &wide(3.0))) + &section(40.0, &lane(1, "", &wide(3.25)), "");
    let r = read(&straight("", &format!("{offset}{lanes}"))).unwrap();
    for s in [0.0, 5.0, 10.0, 17.0, 39.0_f64] {
        let u = (s - 10.0).max(0.0);
        let outer = 7.0 + 0.01 * u * u - 1e-4 * u * u * u;
        let close = |got: (f64, f64), want: (f64, f64)| {
            assert!(
                (got.0 - want.0).abs() < 1e-12 && (got.1 - want.1).abs() < 1e-12,
                "{s}: {got:?} {want:?}"
            );
        };
        close(r.road.lane_edges_t_m(Side::Left, 0, s), (4.0 + 0.05 * s, 0.5 + 0.01 * s));
        close(r.road.lane_edges_t_m(Side::Left, 1, s), (outer, 4.0 + 0.05 * s));
    }
    assert_eq!((r.road.left[0].width.value(50.0), r.road.left[1].width.value(50.0)), (3.25, 0.0));
    assert_eq!(r.road.right[0].width.value(50.0), 0.0);
    // "If both are present, the application must use the information from the width elements."
    let both = wide(3.0) + &border(0.0, [-9.0, 0.0, 0.0, 0.0]);
    let r = read(&straight("", &section(0.0, "", &lane(-1, "", &both)))).unwrap();
    assert_eq!(r.road.right[0].width.value(30.0), 3.0);
    warned(&r, "the widths apply");
    // A border on the wrong side of the inner one is no lane.
    let crossed = lane(-1, "", &border(0.0, [3.0, 0.0, 0.0, 0.0]));
    let e = read(&straight("", &section(0.0, "", &crossed))).unwrap_err().to_string();
    assert!(e.contains("is not a lane width"), "{e}");
}

/// ASAM OpenDRIVE 1.8, 11.2: without `direction` the side and `rule` say which way a lane is driven.
#[test]
fn rule_and_direction_say_how_lanes_are_driven() {
    use Driven::{Backward, Both, Forward};
    for (rule, attributes, left, right) in [
        ("", "", Backward, Forward),
        ("rule=\"RHT\"", "", Backward, Forward),
        ("rule=\"LHT\"", "", Forward, Backward),
        ("rule=\"LHT\"", "direction=\"standard\"", Forward, Backward),
        ("rule=\"LHT\"", "direction=\"reversed\"", Backward, Forward),
        ("", "direction=\"reversed\"", Forward, Backward),
        ("", "direction=\"both\"", Both, Both),
        ("", "type=\"bidirectional\"", Both, Both),
    ] {
        let lanes = section(0.0, &lane(1, attributes, &wide(3.5)), &lane(-1, attributes, &wide(3.5)));
        let r = read(&straight(rule, &lanes)).unwrap();
        assert_eq!((r.road.left[0].driven, r.road.right[0].driven), (left, right), "{rule} {attributes}");
        assert_eq!(r.warnings, [""; 0]);
    }
    let lanes = |a: &str| section(0.0, "", &lane(-1, a, &wide(3.5)));
    let e = read(&straight("rule=\"left\"", &lanes(""))).unwrap_err().to_string();
    assert!(e.contains("a.xodr:1: road = left: rule") && e.contains("RHT, LHT"), "{e}");
    let e = read(&straight("", &lanes("direction=\"back\""))).unwrap_err().to_string();
    assert!(e.contains("lane = back") && e.contains("standard, reversed, both"), "{e}");
    let changed = section(0.0, "", &lane(-1, "", &wide(3.5)))
        + &section(20.0, "", &lane(-1, "direction=\"reversed\"", &wide(3.5)));
    warned(&read(&straight("", &changed)).unwrap(), "it keeps its first type");
}

#[test]
fn a_section_of_one_side_leaves_the_other() {
    let first = section(0.0, &lane(1, "", &wide(3.5)), &lane(-1, "", &wide(3.0)));
    let second = format!(
        "<laneSection s=\"20\" singleSide=\"true\"><right>{}{}</right></laneSection>",
        lane(-1, "", &wide(3.25)),
        lane(-2, "type=\"exit\"", &wide(2.0))
    );
    let r = read(&straight("", &(first.clone() + &second))).unwrap();
    for (s, left, right, second) in [(10.0, 3.5, 3.0, 0.0), (30.0, 3.5, 3.25, 2.0)] {
        let width = |side, i: usize| r.road.side(side)[i].width.value(s);
        assert_eq!(
            (width(Side::Left, 0), width(Side::Right, 0), width(Side::Right, 1)),
            (left, right, second)
        );
    }
    assert_eq!((r.road.right[1].kind, r.warnings.len()), (LaneKind::Ramp, 0));
    let whole = second.replace("singleSide=\"true\"", "singleSide=\"false\"");
    assert_eq!(read(&straight("", &(first + &whole))).unwrap().road.left[0].width.value(30.0), 0.0);
}

fn curve(length_m: f64, shape: &str) -> String {
    format!(
        "<OpenDRIVE><road id=\"1\" length=\"{length_m}\"><planView>\n\
         <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"{length_m}\">{shape}</geometry></planView>\
         <lanes>{}</lanes></road></OpenDRIVE>",
        section(0.0, "", &lane(-1, "", &wide(3.5)))
    )
}

#[test]
fn curves_have_the_length_of_their_geometry() {
    let bent = "aU=\"0\" bU=\"30\" cU=\"0.5\" dU=\"-1\" aV=\"0\" bV=\"0\" cV=\"6\" dV=\"-3\"";
    // Length of the normalized curve by the chain of its short chords.
    let at = |p: f64| DVec3::new(30.0 * p + 0.5 * p * p - p.powi(3), 6.0 * p * p - 3.0 * p.powi(3), 0.0);
    let n = 20_000;
    let long_m: f64 = (0..n).map(|i| at(f64::from(i) / 2e4).distance(at(f64::from(i + 1) / 2e4))).sum();
    assert!((long_m - 29.673).abs() < 1e-3, "{long_m}");
    let ends = |r: &ReadRoad, at_m: [f64; 2]| {
        let end = r.road.axis.at(r.road.axis.length_m()).position_m;
        assert!((end - DVec3::new(at_m[0], at_m[1], 0.0)).length() < 1e-9, "{end}");
    };
    for (range, warning) in [
        ("", Some("has no pRange; it is read as 'normalized'")),
        (
            "pRange=\"normalized\"",
            Some("the curve is 29.673 m long as normalized, but the geometry is 30.2 m long"),
        ),
        ("pRange=\"arcLength\"", Some("it is read as 'normalized', which fits")),
    ] {
        let r = read(&curve(30.2, &format!("<paramPoly3 {range} {bent}/>"))).unwrap();
        ends(&r, [29.5, 3.0]);
        match warning {
            Some(w) => warned(&r, w),
            None => assert_eq!(r.warnings, [""; 0]),
        }
        assert_eq!(r.road.axis.length_m(), 30.2);
    }
    let flat = "aU=\"0\" bU=\"1\" cU=\"0\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"0.001\" dV=\"0\"";
    for (range, warning) in [("", 1), ("pRange=\"arcLength\"", 0), ("pRange=\"normalized\"", 1)] {
        let r = read(&curve(30.0, &format!("<paramPoly3 {range} {flat}/>"))).unwrap();
        ends(&r, [30.0, 0.9]);
        assert_eq!(r.warnings.len(), warning, "{:?}", r.warnings);
    }
    for range in ["", "pRange=\"normalized\"", "pRange=\"arcLength\""] {
        let e = read(&curve(40.0, &format!("<paramPoly3 {range} {bent}/>"))).unwrap_err().to_string();
        assert!(e.contains("a.xodr:2: paramPoly3 = length 40 m") && e.contains("m as normalized and"), "{e}");
    }
    let e = read(&curve(30.0, &format!("<paramPoly3 pRange=\"p\" {flat}/>"))).unwrap_err().to_string();
    assert!(e.contains("normalized, arcLength"), "{e}");
}

fn chain(geometries: &[(f64, [f64; 2], f64)]) -> String {
    let list: String = (geometries.iter())
        .map(|(s, [x, y], l)| {
            format!("<geometry s=\"{s}\" x=\"{x}\" y=\"{y}\" hdg=\"0\" length=\"{l}\"><line/></geometry>\n")
        })
        .collect();
    format!(
        "<OpenDRIVE><road id=\"1\"><planView>\n{list}</planView><lanes>{}</lanes></road></OpenDRIVE>",
        section(0.0, "", &lane(-1, "", &wide(3.5)))
    )
}

#[test]
fn gaps_are_closed_and_elements_without_length_left_out() {
    let whole = read(&chain(&[(0.0, [0.0, 0.0], 60.0), (60.0, [60.0, 0.0], 40.0)])).unwrap();
    assert_eq!(whole.warnings, [""; 0]);
    let zero = [
        (0.0, [0.0, 0.0], 0.0),
        (0.0, [0.0, 0.0], 60.0),
        (60.0, [60.0, 0.0], 0.0),
        (60.0, [60.0, 0.0], 40.0),
        (100.0, [100.0, 0.0], 0.0),
    ];
    let r = read(&chain(&zero)).unwrap();
    assert_eq!(r.road, whole.road);
    warned(&r, "has no length, and is left out (3 such, the first here)");
    assert!(r.warnings[0].starts_with("a.xodr:2: geometry: "));
    // Continuous across the gap: the chord of a short step is as long as the step.
    let closed = |r: &ReadRoad, end_m: [f64; 2]| {
        let axis = &r.road.axis;
        let mut s = 0.0;
        while s < axis.length_m() - 0.02 {
            let step = axis.at(s + 0.01).position_m.distance(axis.at(s).position_m);
            assert!((step - 0.01).abs() < 1e-9, "{s}: {step}");
            s += 0.01;
        }
        let end = axis.at(axis.length_m()).position_m;
        assert!(end.distance(DVec3::new(end_m[0], end_m[1], 0.0)) < 1e-9, "{end}");
    };
    for gap in [0.02, 0.08, 0.2, 0.5] {
        let r = read(&chain(&[(0.0, [0.0, 0.0], 60.0), (60.0 + gap, [60.0 + gap, 0.0], 40.0)])).unwrap();
        closed(&r, [100.0 + gap, 0.0]);
        assert!((r.road.axis.length_m() - 100.0 - gap).abs() < 1e-9);
        warned(&r, "is closed with a straight");
        for [x, y] in [[60.0, gap], [60.0, -gap], [60.0 - gap, 0.0], [60.0 + gap, 0.0]] {
            let r = read(&chain(&[(0.0, [0.0, 0.0], 60.0), (60.0, [x, y], 40.0)])).unwrap();
            closed(&r, [100.0, 0.0]);
            warned(&r, &format!("moved by {gap:.3} m"));
        }
    }
    // A second gap back undoes the first.
    let there_and_back = [(0.0, [0.0, 0.0], 60.0), (60.0, [60.0, 0.1], 20.0), (80.0, [80.0, 0.0], 20.0)];
    closed(&read(&chain(&there_and_back)).unwrap(), [100.0, 0.0]);
    let e = read(&chain(&[(0.0, [0.0, 0.0], 60.0), (60.0, [60.0, 0.6], 40.0)])).unwrap_err().to_string();
    assert!(e.contains("a.xodr:3: geometry = 0.600 m off") && e.contains("up to 0.5 m"), "{e}");
    let e = read(&chain(&[(0.0, [0.0, 0.0], 0.0)])).unwrap_err().to_string();
    assert!(e.contains("no planView with a geometry that has a length"), "{e}");
}

/// ASAM OpenDRIVE 1.8, 8.5: x = x' cos h - y' sin h + dx, y = x' sin h + y' cos h + dy, z = z' + dz.
#[test]
fn the_headers_offset_moves_the_road() {
    let text = straight("", &section(0.0, "", &lane(-1, "", &wide(3.5))));
    let header =
        "<header revMajor=\"1\" revMinor=\"7\"><offset x=\"100\" y=\"-20\" z=\"3\" hdg=\"0.3\"/></header>";
    let r = read(&text.replace("<header revMajor=\"1\" revMinor=\"7\"/>", header)).unwrap();
    let (sin, cos) = 0.3_f64.sin_cos();
    let p = r.road.axis.world(RoadPoint { s_m: 40.0, t_m: 2.0, h_m: 0.0 });
    let expected = DVec3::new(40.0 * cos - 2.0 * sin + 100.0, 40.0 * sin + 2.0 * cos - 20.0, 3.0);
    assert!(p.distance(expected) < 1e-12, "{p} {expected}");
    warned(&r, "offset: the road is turned by 0.3 rad");
}

/// OpenDRIVE 1.4, 5.3.6.2: a positive crossfall falls away from the axis; superelevation comes on top.
#[test]
fn crossfall_falls_away_from_the_axis() {
    let lanes = section(0.0, &lane(1, "", &wide(3.5)), &lane(-1, "", &wide(3.5)));
    let file = |profile: &str| {
        straight("", &lanes).replace("<lanes>", &format!("<lateralProfile>{profile}</lateralProfile><lanes>"))
    };
    let fall = |side: &str, a: f64| format!("<crossfall {side} s=\"0\" a=\"{a}\" b=\"0\" c=\"0\" d=\"0\"/>");
    let tilt = "<superelevation s=\"0\" a=\"0.01\" b=\"0\" c=\"0\" d=\"0\"/>";
    for (profile, left, right) in [
        (fall("", 0.02), -0.02, -0.02),
        (fall("side=\"both\"", 0.02), -0.02, -0.02),
        (fall("side=\"left\"", 0.02), -0.02, 0.0),
        (fall("side=\"right\"", 0.02), 0.0, -0.02),
        (fall("side=\"left\"", 0.02) + &fall("side=\"right\"", -0.03), -0.02, 0.03),
        (format!("{tilt}{}", fall("side=\"both\"", 0.02)), -0.01, -0.03),
    ] {
        let r = read(&file(&profile)).unwrap();
        let z = |t_m| r.road.axis.world(RoadPoint { s_m: 30.0, t_m, h_m: 0.0 }).z;
        assert!((z(3.0) - 3.0 * left).abs() < 1e-12 && (z(-3.0) - 3.0 * right).abs() < 1e-12, "{profile}");
        assert_eq!(r.warnings, [""; 0]);
    }
    let e = read(&file(&fall("side=\"middle\"", 0.02))).unwrap_err().to_string();
    assert!(e.contains("left, right, both"), "{e}");
}

/// The facets of a roof: no facet spans its ridge, also where the ridge is inside a lane.
#[test]
fn facets_of_a_roof_end_at_its_ridge() {
    let lanes = section(0.0, &lane(1, "", &wide(3.5)), &lane(-1, "", &wide(3.5)));
    let profile = "<lateralProfile><crossfall s=\"0\" a=\"0.02\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile>\
                   <lanes><laneOffset s=\"0\" a=\"1\" b=\"-0.04\" c=\"0\" d=\"0\"/>";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.xodr"), straight("", &lanes).replace("<lanes>", profile)).unwrap();
    let text = "name = \"x\"\n[[road]]\nname = \"r\"\nopendrive = \"a.xodr\"\n";
    let plan = scene_toml::parse(&folder.path().join("r.toml"), text).unwrap();
    let (scene, _) = build::build(&plan).unwrap();
    let mut area_m2 = 0.0;
    for o in &scene.objects {
        let crate::scene::Shape::Mesh(m) = o.shape else { continue };
        let mesh = &scene.meshes[m];
        for t in &mesh.triangles {
            let corners = t.map(|v| o.pose.point(mesh.positions_m[v as usize]));
            for p in corners {
                assert!((p.z + 0.02 * p.y.abs()).abs() < 1e-5, "{p}");
            }
            let [a, b, c] = corners.map(|p| p.y);
            assert!(a.min(b).min(c) * a.max(b).max(c) > -1e-5, "{corners:?}");
            let [a, b, c] = corners.map(|p| p.truncate());
            area_m2 += 0.5 * (b - a).perp_dot(c - a);
        }
    }
    assert!((area_m2 - 60.0 * 7.0).abs() < 1e-3, "{area_m2}");
}

#[test]
fn marks_are_painted_where_they_are() {
    let marked = |marks: &str| {
        let right = lane(-1, "", &(wide(3.5) + marks)) + &lane(-2, "", &wide(3.5));
        read(&straight("", &section(0.0, &lane(1, "", &wide(3.5)), &right))).unwrap()
    };
    assert_eq!(marked("<roadMark sOffset=\"0\" type=\"broken\"/>").road.right[0].line, LineKind::Dashed);
    let r = marked(
        "<roadMark sOffset=\"0\" type=\"solid\" width=\"0.25\"/><roadMark sOffset=\"20\" type=\"broken\"/>\
         <roadMark sOffset=\"45\" type=\"none\"/>",
    );
    let shown: Vec<_> = r.marks.iter().map(|m| (m.kind, m.span_m.clone(), m.width_m)).collect();
    assert_eq!(shown, [(LineKind::Solid, 0.0..20.0, Some(0.25)), (LineKind::Dashed, 20.0..45.0, None)]);
    assert_eq!((r.road.right[0].line, r.warnings.len()), (LineKind::None, 0));
    // From the inside outwards; on the right outwards is to the right.
    let r = marked("<roadMark sOffset=\"0\" type=\"solid broken\" width=\"0.1\"/>");
    let shown: Vec<_> = r.marks.iter().map(|m| (m.kind, m.offset_m)).collect();
    assert_eq!(shown, [(LineKind::Solid, 0.1), (LineKind::Dashed, -0.1)]);
    let r = marked(
        "<roadMark sOffset=\"0\" type=\"custom\"><type name=\"x\" width=\"0.15\"><line length=\"4\" space=\"8\" \
         tOffset=\"0.2\" sOffset=\"3\"/></type></roadMark>",
    );
    let m = &r.marks[0];
    assert_eq!((m.kind, m.dash_gap_m, m.offset_m), (LineKind::Dashed, Some((4.0, 8.0)), 0.2));
    assert_eq!((m.span_m.clone(), m.width_m, r.warnings.len()), (3.0..60.0, Some(0.15), 0));
    for (attributes, expect) in [
        ("type=\"botts dots\"", "type 'botts dots'"),
        ("type=\"solid\" color=\"yellow\"", "color 'yellow'"),
        ("type=\"solid\" weight=\"bold\"", "weight 'bold'"),
        ("type=\"solid\" width=\"-1\"", "width = -1 m"),
    ] {
        warned(&marked(&format!("<roadMark sOffset=\"0\" {attributes}/>")), expect);
    }
}

#[test]
fn what_is_assumed_of_lanes_is_named() {
    let right = |content: &str| straight("", &section(0.0, "", &lane(-1, "", content)));
    warned(&read(&right("")).unwrap(), "has neither width nor border");
    let late = cubic("width", 5.0, [3.0, 0.1, 0.0, 0.0]);
    let r = read(&right(&late)).unwrap();
    warned(&r, "its first value applies before");
    assert_eq!((r.road.right[0].width.value(2.0), r.road.right[0].width.value(15.0)), (3.0, 4.0));
    warned(&read(&right(&(wide(3.0) + &cubic("width", 80.0, [9.0; 4])))).unwrap(), "after the end");
    let back = cubic("width", 9.0, [3.0, 0.0, 0.0, 0.0]) + &wide(3.0);
    assert!(read(&right(&back)).unwrap_err().to_string().contains("before the one before it"));
    let restricted = section(0.0, "", &lane(-1, "type=\"restricted\"", &wide(3.0)));
    warned(&read(&straight("", &restricted)).unwrap(), "type 'restricted'");
    let twice = lane(-1, "", &wide(3.0)) + &lane(-1, "", &wide(2.0));
    let e = read(&straight("", &section(0.0, "", &twice))).unwrap_err().to_string();
    assert!(e.contains("two lanes of the section have this number"), "{e}");
    warned(&read(&straight("", &section(7.0, "", &lane(-1, "", &wide(3.0))))).unwrap(), "begins at s = 7 m");
}

/// The warnings of a scene's files come out of its plan and its scene, and only those of the road that is used.
#[test]
fn warnings_reach_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let one = |id: u32, extra: &str| {
        let file = straight("", &section(0.0, "", &lane(-1, "", &wide(3.5))));
        let from = file.find("<road").unwrap();
        let road = file[from..file.find("</OpenDRIVE>").unwrap()]
            .replace("id=\"1\" length", &format!("id=\"{id}\" length"));
        road.replace("</road>", &format!("{extra}</road>"))
    };
    let text = format!(
        "<OpenDRIVE>{}{}</OpenDRIVE>",
        one(1, "<objects><object/></objects>"),
        one(2, "<signals/><surface/>")
    );
    std::fs::write(folder.path().join("a.xodr"), text).unwrap();
    let scene = |road: &str| {
        let text = format!("name = \"x\"\n[[road]]\nname = \"r\"\nopendrive = \"a.xodr\"\n{road}");
        let plan = scene_toml::parse(&folder.path().join("r.toml"), &text).unwrap();
        let (scene, _) = build::build(&plan).unwrap();
        assert_eq!(scene.warnings, plan.warnings);
        scene.warnings
    };
    let first = scene("opendrive_road = \"1\"\n");
    assert!(first.len() == 1 && first[0].contains("a.xodr:1: objects: is left out"), "{first:?}");
    let second = scene("opendrive_road = \"2\"\n");
    assert!(
        second.len() == 2 && second[0].contains("signals") && second[1].contains("surface"),
        "{second:?}"
    );
    let default = scene("");
    assert!(default[0].contains("is the first of 2 roads, and only it is built"), "{default:?}");
}

/// Each of the elements that are read, with all attributes, and nothing that is warned about.
const BASE: &str = r#"<OpenDRIVE>
<header revMajor="1" revMinor="7" name="m"><offset x="0.0" y="0.0" z="0.0" hdg="0.0"/></header>
<road name="r" id="1" length="100" junction="-1" rule="RHT">
<planView>
<geometry s="0" x="0" y="0" hdg="0" length="20"><line/></geometry>
<geometry s="20" x="20" y="0" hdg="0" length="20"><spiral curvStart="0" curvEnd="0"/></geometry>
<geometry s="40" x="40" y="0" hdg="0" length="20"><arc curvature="0"/></geometry>
<geometry s="60" x="60" y="0" hdg="0" length="20"><poly3 a="0" b="0" c="0" d="0"/></geometry>
<geometry s="80" x="80" y="0" hdg="0.00" length="20.0"><paramPoly3 aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0" pRange="arcLength"/></geometry>
</planView>
<elevationProfile><elevation s="0" a="0" b="0.0" c="0.0" d="0.0"/><elevation s="50" a="0" b="0" c="0" d="0"/></elevationProfile>
<lateralProfile><superelevation s="0" a="0" b="0" c="0" d="0"/><superelevation s="50" a="0.01" b="0" c="0" d="0"/><crossfall side="both" s="0" a="0" b="0" c="0" d="0"/><crossfall side="left" s="50" a="0.02" b="0" c="0" d="0"/></lateralProfile>
<lanes><laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="30" a="0.1" b="0" c="0" d="0"/>
<laneSection s="0" singleSide="false"><left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane><lane id="2" type="driving"><border sOffset="0" a="9" b="0" c="0" d="0"/><border sOffset="10" a="9" b="0" c="0" d="0.0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving" level="false" direction="standard"><width sOffset="0" a="3.25" b="0" c="0" d="0"/><width sOffset="10" a="3.0" b="0" c="0" d="0"/>
<roadMark sOffset="5" type="solid" weight="standard" color="standard" material="standard" width="0.12" height="0.003" laneChange="none"/></lane><lane id="-2" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/><roadMark sOffset="0" type="custom"><type name="t" width="0.2"><line length="3" space="6" tOffset="0" sOffset="0" width="0.2" rule="none" color="white"/><line length="3" space="6" tOffset="1" sOffset="0" rule="none" color="white"/></type><explicit><line length="30" tOffset="-1" sOffset="2" width="0.3" rule="none"/></explicit></roadMark></lane></right></laneSection>
<laneSection s="70"><left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left><center><lane id="0"/></center><right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection>
</lanes>
</road>
</OpenDRIVE>"#;

/// What comes of a change of the file.
#[derive(Clone, Copy, PartialEq)]
enum Comes {
    /// Other lanes, another surface, other lines.
    Change,
    /// A warning with these words.
    Warning(&'static str),
    /// Nothing at all, with the reason in the list of elements.
    Nothing,
}

use Comes::{Change, Nothing, Warning};

const LANE: &str = "road/lanes/laneSection/side/lane";

/// The standard's elements and attributes (ASAM OpenDRIVE 1.4 to 1.8, UML classes t_header and t_road with what
/// they hold), each with a change of [`BASE`] and what has to come of it. `~` stands for [`LANE`].
const STANDARD: &[(&str, &str, &str, Comes)] = &[
    ("header@revMajor", "revMajor=\"1\"", "revMajor=\"2\"", Warning("version 2.7")),
    ("header@revMinor", "revMinor=\"7\"", "revMinor=\"99\"", Warning("version 1.99")),
    ("header@name", "name=\"m\"", "name=\"n\"", Nothing),
    ("header@version", "name=\"m\"", "version=\"1\"", Nothing),
    ("header@date", "name=\"m\"", "date=\"1\"", Nothing),
    ("header@vendor", "name=\"m\"", "vendor=\"1\"", Nothing),
    ("header@north", "name=\"m\"", "north=\"1\"", Nothing),
    ("header@south", "name=\"m\"", "south=\"1\"", Nothing),
    ("header@east", "name=\"m\"", "east=\"1\"", Nothing),
    ("header@west", "name=\"m\"", "west=\"1\"", Nothing),
    ("header/geoReference", "</header>", "<geoReference>+proj=utm</geoReference></header>", Nothing),
    ("header/license", "</header>", "<license name=\"x\"/></header>", Nothing),
    ("header/defaultRegulations", "</header>", "<defaultRegulations/></header>", Nothing),
    ("header/offset@x", "x=\"0.0\"", "x=\"5\"", Change),
    ("header/offset@y", "y=\"0.0\"", "y=\"5\"", Change),
    ("header/offset@z", "z=\"0.0\"", "z=\"5\"", Change),
    ("header/offset@hdg", "hdg=\"0.0\"", "hdg=\"1\"", Change),
    ("junction", "</OpenDRIVE>", "<junction id=\"1\"/></OpenDRIVE>", Warning("junction: is left out")),
    ("station", "</OpenDRIVE>", "<station id=\"1\"/></OpenDRIVE>", Warning("station: is left out")),
    ("controller", "</OpenDRIVE>", "<controller id=\"1\"/></OpenDRIVE>", Nothing),
    ("junctionGroup", "</OpenDRIVE>", "<junctionGroup id=\"1\"/></OpenDRIVE>", Nothing),
    ("road@name", "name=\"r\"", "name=\"q\"", Nothing),
    ("road@id", "id=\"1\" length", "id=\"9\" length", Change),
    ("road@length", "length=\"100\"", "length=\"100.2\"", Warning("states a length of 100.2 m")),
    ("road@junction", "junction=\"-1\"", "junction=\"3\"", Nothing),
    ("road@rule", "RHT", "LHT", Change),
    ("road/link", "<planView>", "<link><predecessor/></link><planView>", Nothing),
    ("road/type", "<planView>", "<type s=\"0\" type=\"rural\"><speed max=\"9\"/></type><planView>", Nothing),
    (
        "road/planView",
        "length=\"20.0\">",
        "length=\"20.0\"><wave/>",
        Warning("wave: is not a known element of geometry"),
    ),
    ("road/planView/geometry@s", "s=\"20\"", "s=\"20.2\"", Warning("states s = 20.2 m")),
    ("road/planView/geometry@x", "x=\"80\"", "x=\"80.1\"", Warning("the gap is closed")),
    ("road/planView/geometry@y", "s=\"0\" x=\"0\" y=\"0\"", "s=\"0\" x=\"0\" y=\"0.1\"", Change),
    ("road/planView/geometry@hdg", "hdg=\"0.00\"", "hdg=\"0.2\"", Change),
    ("road/planView/geometry@length", "length=\"20\"><line", "length=\"19.9\"><line", Change),
    ("road/planView/geometry/line", "<line/>", "<arc curvature=\"0.001\"/>", Change),
    ("road/planView/geometry/spiral@curvStart", "curvStart=\"0\"", "curvStart=\"0.001\"", Change),
    ("road/planView/geometry/spiral@curvEnd", "curvEnd=\"0\"", "curvEnd=\"0.001\"", Change),
    ("road/planView/geometry/arc@curvature", "curvature=\"0\"", "curvature=\"0.001\"", Change),
    ("road/planView/geometry/poly3@a", "<poly3 a=\"0\"", "<poly3 a=\"0.1\"", Change),
    ("road/planView/geometry/poly3@b", "<poly3 a=\"0\" b=\"0\"", "<poly3 a=\"0\" b=\"0.01\"", Change),
    (
        "road/planView/geometry/poly3@c",
        "c=\"0\" d=\"0\"/></geometry>",
        "c=\"1e-4\" d=\"0\"/></geometry>",
        Change,
    ),
    ("road/planView/geometry/poly3@d", "d=\"0\"/></geometry>", "d=\"1e-5\"/></geometry>", Change),
    ("road/planView/geometry/paramPoly3@aU", "aU=\"0\"", "aU=\"0.1\"", Change),
    ("road/planView/geometry/paramPoly3@bU", "bU=\"1\"", "bU=\"0.995\"", Change),
    ("road/planView/geometry/paramPoly3@cU", "cU=\"0\"", "cU=\"1e-4\"", Change),
    ("road/planView/geometry/paramPoly3@dU", "dU=\"0\"", "dU=\"1e-6\"", Change),
    ("road/planView/geometry/paramPoly3@aV", "aV=\"0\"", "aV=\"0.1\"", Change),
    ("road/planView/geometry/paramPoly3@bV", "bV=\"0\"", "bV=\"0.01\"", Change),
    ("road/planView/geometry/paramPoly3@cV", "cV=\"0\"", "cV=\"1e-3\"", Change),
    ("road/planView/geometry/paramPoly3@dV", "dV=\"0\"", "dV=\"1e-5\"", Change),
    (
        "road/planView/geometry/paramPoly3@pRange",
        "\"arcLength\"",
        "\"normalized\"",
        Warning("pRange 'normalized'"),
    ),
    (
        "road/elevationProfile",
        "<elevationProfile>",
        "<elevationProfile><x/>",
        Warning("x: is not a known element of elev"),
    ),
    ("road/elevationProfile/elevation@s", "elevation s=\"50\" a=\"0\"", "elevation s=\"60\" a=\"0\"", Change),
    ("road/elevationProfile/elevation@a", "elevation s=\"50\" a=\"0\"", "elevation s=\"50\" a=\"1\"", Change),
    ("road/elevationProfile/elevation@b", "b=\"0.0\"", "b=\"0.1\"", Change),
    ("road/elevationProfile/elevation@c", "c=\"0.0\"", "c=\"0.001\"", Change),
    ("road/elevationProfile/elevation@d", "d=\"0.0\"/><elev", "d=\"1e-5\"/><elev", Change),
    (
        "road/lateralProfile",
        "<lateralProfile>",
        "<lateralProfile><x/>",
        Warning("x: is not a known element of lateral"),
    ),
    ("road/lateralProfile/superelevation@s", "<superelevation s=\"50\"", "<superelevation s=\"40\"", Change),
    ("road/lateralProfile/superelevation@a", "a=\"0.01\"", "a=\"0.03\"", Change),
    ("road/lateralProfile/superelevation@b", "a=\"0.01\" b=\"0\"", "a=\"0.01\" b=\"0.001\"", Change),
    (
        "road/lateralProfile/superelevation@c",
        "a=\"0.01\" b=\"0\" c=\"0\"",
        "a=\"0.01\" b=\"0\" c=\"1e-5\"",
        Change,
    ),
    (
        "road/lateralProfile/superelevation@d",
        "d=\"0\"/><crossfall side=\"both\"",
        "d=\"1e-6\"/><crossfall side=\"both\"",
        Change,
    ),
    ("road/lateralProfile/crossfall@side", "side=\"left\"", "side=\"right\"", Change),
    ("road/lateralProfile/crossfall@s", "\"left\" s=\"50\"", "\"left\" s=\"60\"", Change),
    ("road/lateralProfile/crossfall@a", "a=\"0.02\"", "a=\"0.03\"", Change),
    ("road/lateralProfile/crossfall@b", "a=\"0.02\" b=\"0\"", "a=\"0.02\" b=\"0.001\"", Change),
    (
        "road/lateralProfile/crossfall@c",
        "a=\"0.02\" b=\"0\" c=\"0\"",
        "a=\"0.02\" b=\"0\" c=\"1e-5\"",
        Change,
    ),
    (
        "road/lateralProfile/crossfall@d",
        "d=\"0\"/></lateralProfile>",
        "d=\"1e-6\"/></lateralProfile>",
        Change,
    ),
    (
        "road/lateralProfile/shape",
        "</lateralP",
        "<shape s=\"0\" t=\"0\" a=\"0\" b=\"1\" c=\"0\" d=\"0\"/></lateralP",
        Warning("shape: is left out"),
    ),
    (
        "road/lateralProfile/crossSectionSurface",
        "</lateralP",
        "<crossSectionSurface/></lateralP",
        Warning("crossSectionSurface: is left out"),
    ),
    ("road/lanes", "<lanes>", "<lanes><x/>", Warning("x: is not a known element of lanes")),
    ("road/lanes/laneOffset@s", "laneOffset s=\"30\"", "laneOffset s=\"40\"", Change),
    ("road/lanes/laneOffset@a", "a=\"0.1\"", "a=\"0.2\"", Change),
    ("road/lanes/laneOffset@b", "a=\"0.1\" b=\"0\"", "a=\"0.1\" b=\"0.01\"", Change),
    ("road/lanes/laneOffset@c", "a=\"0.1\" b=\"0\" c=\"0\"", "a=\"0.1\" b=\"0\" c=\"1e-4\"", Change),
    ("road/lanes/laneOffset@d", "d=\"0\"/>\n<laneSection", "d=\"1e-6\"/>\n<laneSection", Change),
    ("road/lanes/laneSection@s", "laneSection s=\"70\"", "laneSection s=\"60\"", Change),
    (
        "road/lanes/laneSection@singleSide",
        "<laneSection s=\"70\"><left><lane id=\"1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></left>",
        "<laneSection s=\"70\" singleSide=\"true\">",
        Change,
    ),
    ("road/lanes/laneSection/side", "<left>", "<left><x/>", Warning("x: is not a known element of left")),
    ("~@id", "id=\"2\"", "id=\"3\"", Change),
    ("~@type", "id=\"2\" type=\"driving\"", "id=\"2\" type=\"shoulder\"", Change),
    ("~@level", "level=\"false\"", "level=\"true\"", Warning("level = \"true\" is left out")),
    ("~@direction", "direction=\"standard\"", "direction=\"both\"", Change),
    ("~@advisory", "level=\"false\"", "advisory=\"inner\"", Nothing),
    (
        "~@dynamicLaneDirection",
        "level=\"false\"",
        "dynamicLaneDirection=\"true\"",
        Warning("dynamicLaneDirection is"),
    ),
    ("~@dynamicLaneType", "level=\"false\"", "dynamicLaneType=\"true\"", Warning("dynamicLaneType is")),
    ("~@roadWorks", "level=\"false\"", "roadWorks=\"true\"", Warning("roadWorks is")),
    (
        "~/link",
        "<roadMark sOffset=\"5\"",
        "<link><successor id=\"1\"/></link><roadMark sOffset=\"5\"",
        Nothing,
    ),
    ("~/border@sOffset", "border sOffset=\"10\" a=\"9\"", "border sOffset=\"20\" a=\"9\"", Change),
    ("~/border@a", "border sOffset=\"10\" a=\"9\"", "border sOffset=\"10\" a=\"9.1\"", Change),
    (
        "~/border@b",
        "border sOffset=\"10\" a=\"9\" b=\"0\"",
        "border sOffset=\"10\" a=\"9\" b=\"0.01\"",
        Change,
    ),
    ("~/border@c", "c=\"0\" d=\"0.0\"/></lane>", "c=\"1e-4\" d=\"0\"/></lane>", Change),
    ("~/border@d", "d=\"0.0\"/></lane>", "d=\"1e-6\"/></lane>", Change),
    ("~/width@sOffset", "width sOffset=\"10\"", "width sOffset=\"20\"", Change),
    ("~/width@a", "a=\"3.0\"", "a=\"3.1\"", Change),
    ("~/width@b", "a=\"3.0\" b=\"0\"", "a=\"3.0\" b=\"0.01\"", Change),
    ("~/width@c", "a=\"3.0\" b=\"0\" c=\"0\"", "a=\"3.0\" b=\"0\" c=\"1e-4\"", Change),
    ("~/width@d", "a=\"3.0\" b=\"0\" c=\"0\" d=\"0\"", "a=\"3.0\" b=\"0\" c=\"0\" d=\"1e-6\"", Change),
    ("~/roadMark@sOffset", "roadMark sOffset=\"5\"", "roadMark sOffset=\"6\"", Change),
    ("~/roadMark@type", "type=\"solid\"", "type=\"broken\"", Change),
    (
        "~/roadMark@weight",
        "weight=\"standard\" color=\"standard\" material=\"standard\" width=\"0.12\"",
        "weight=\"bold\"",
        Warning("weight 'bold'"),
    ),
    ("~/roadMark@color", "color=\"standard\"", "color=\"yellow\"", Warning("color 'yellow'")),
    ("~/roadMark@material", "material=\"standard\"", "material=\"tape\"", Warning("material 'tape'")),
    ("~/roadMark@width", "width=\"0.12\"", "width=\"0.15\"", Change),
    ("~/roadMark@height", "height=\"0.003\"", "height=\"0.004\"", Change),
    ("~/roadMark@laneChange", "laneChange=\"none\"", "laneChange=\"both\"", Nothing),
    (
        "~/roadMark/sway",
        "<type name=\"t\"",
        "<sway ds=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/><type name=\"t\"",
        Warning("sway: is left out"),
    ),
    ("~/roadMark/type@name", "name=\"t\"", "name=\"u\"", Nothing),
    ("~/roadMark/type@width", "name=\"t\" width=\"0.2\"", "name=\"t\" width=\"0.3\"", Change),
    ("~/roadMark/type/line@length", "length=\"3\"", "length=\"4\"", Change),
    ("~/roadMark/type/line@space", "space=\"6\"", "space=\"7\"", Change),
    ("~/roadMark/type/line@tOffset", "tOffset=\"1\"", "tOffset=\"0.9\"", Change),
    ("~/roadMark/type/line@sOffset", "sOffset=\"0\" width=\"0.2\"", "sOffset=\"1\" width=\"0.2\"", Change),
    ("~/roadMark/type/line@width", "sOffset=\"0\" width=\"0.2\"", "sOffset=\"0\" width=\"0.3\"", Change),
    (
        "~/roadMark/type/line@rule",
        "rule=\"none\" color=\"white\"",
        "rule=\"caution\" color=\"white\"",
        Nothing,
    ),
    ("~/roadMark/type/line@color", "color=\"white\"", "color=\"red\"", Warning("color 'red'")),
    ("~/roadMark/explicit", "<explicit>", "<explicit><x/>", Warning("x: is not a known element of explicit")),
    ("~/roadMark/explicit/line@length", "length=\"30\"", "length=\"31\"", Change),
    ("~/roadMark/explicit/line@tOffset", "tOffset=\"-1\"", "tOffset=\"-0.9\"", Change),
    ("~/roadMark/explicit/line@sOffset", "sOffset=\"2\"", "sOffset=\"3\"", Change),
    ("~/roadMark/explicit/line@width", "width=\"0.3\"", "width=\"0.4\"", Change),
    ("~/roadMark/explicit/line@rule", "width=\"0.3\" rule=\"none\"", "width=\"0.3\" rule=\"x\"", Nothing),
    (
        "~/material",
        "<roadMark sOffset=\"5\"",
        "<material sOffset=\"0\" friction=\"1\"/><roadMark sOffset=\"5\"",
        Warning("material: is left out"),
    ),
    (
        "~/visibility",
        "<roadMark sOffset=\"5\"",
        "<visibility sOffset=\"0\"/><roadMark sOffset=\"5\"",
        Nothing,
    ),
    (
        "~/speed",
        "<roadMark sOffset=\"5\"",
        "<speed sOffset=\"0\" max=\"9\"/><roadMark sOffset=\"5\"",
        Nothing,
    ),
    ("~/access", "<roadMark sOffset=\"5\"", "<access sOffset=\"0\"/><roadMark sOffset=\"5\"", Nothing),
    ("~/rule", "<roadMark sOffset=\"5\"", "<rule sOffset=\"0\"/><roadMark sOffset=\"5\"", Nothing),
    (
        "~/height@sOffset",
        "<roadMark sOffset=\"5\"",
        "<height sOffset=\"1\" inner=\"0\" outer=\"0\"/><roadMark sOffset=\"5\"",
        Nothing,
    ),
    (
        "~/height@inner",
        "<roadMark sOffset=\"5\"",
        "<height sOffset=\"0\" inner=\"0.1\" outer=\"0\"/><roadMark sOffset=\"5\"",
        Warning("height: is left out"),
    ),
    (
        "~/height@outer",
        "<roadMark sOffset=\"5\"",
        "<height sOffset=\"0\" inner=\"0\" outer=\"0.1\"/><roadMark sOffset=\"5\"",
        Warning("height: is left out"),
    ),
    (
        "road/objects",
        "</road>",
        "<objects><object id=\"1\"/></objects></road>",
        Warning("objects: is left out"),
    ),
    (
        "road/signals",
        "</road>",
        "<signals><signal id=\"1\"/></signals></road>",
        Warning("signals: is left out"),
    ),
    ("road/surface", "</road>", "<surface><CRG/></surface></road>", Warning("surface: is left out")),
    ("road/railroad", "</road>", "<railroad/></road>", Warning("railroad: is left out")),
    // Anywhere.
    ("userData", "</road>", "<userData code=\"1\"/></road>", Nothing),
    ("dataQuality", "</planView>", "<dataQuality/></planView>", Nothing),
    ("include", "</lanes>", "<include file=\"b.xodr\"/></lanes>", Warning("include: is left out")),
    // What no version of the standard has.
    ("unknown", "</road>", "<bump height=\"1\"/></road>", Warning("bump: is not a known element of road")),
    (
        "unknown",
        "</lanes>",
        "<laneSektion s=\"90\"/></lanes>",
        Warning("laneSektion: is not a known element of lanes"),
    ),
    ("unknown", "</OpenDRIVE>", "<bump/></OpenDRIVE>", Warning("bump: is not a known element of OpenDRIVE")),
    ("unknown", "level=\"false\"", "lefel=\"false\"", Warning("the attribute lefel of lane is not known")),
    ("unknown", "junction=\"-1\"", "juncton=\"1\"", Warning("the attribute juncton of road is not known")),
];

#[test]
fn nothing_of_the_standard_is_passed_over_in_silence() {
    let base = read(BASE).unwrap();
    let own = |w: &&String| w.contains("lane: has a border while");
    assert!(base.warnings.iter().all(|w| own(&w)), "{:?}", base.warnings);
    for (what, from, to, comes) in STANDARD {
        assert!(BASE.contains(from), "{what}: {from}");
        let r = read(&BASE.replacen(from, to, 1)).unwrap_or_else(|e| panic!("{what}: {e}"));
        let same = r.road == base.road && r.marks == base.marks;
        let others: Vec<_> = r.warnings.iter().filter(|w| !own(w)).collect();
        match comes {
            Change => assert!(!same, "{what} changes nothing"),
            Warning(words) => assert!(others.iter().any(|w| w.contains(words)), "{what}: {others:?}"),
            Nothing => assert!(same && others.is_empty(), "{what}: {others:?}"),
        }
    }
    let tested = |name: &str| STANDARD.iter().any(|(what, ..)| what.replace('~', LANE) == name);
    for e in ELEMENTS {
        let alone = e.attributes.is_empty() && !tested(e.path);
        let parts = STANDARD.iter().any(|(what, ..)| what.replace('~', LANE).starts_with(e.path));
        assert!(!alone || parts, "{} is without a test", e.path);
        for (a, _) in e.attributes {
            assert!(tested(&format!("{}@{a}", e.path)), "{}@{a} is without a test", e.path);
        }
    }
}
