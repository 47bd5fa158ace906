//! Scenario files: what they mean, their mistakes, the templates and the schemas.

use catseye::base::error::{BadInput, Result};
use catseye::base::frames::Pose;
use catseye::formats::column::unit;
use catseye::scene::motion::{Channel, Joint};
use catseye::scene::scenario::{self, Builder, Builtin, Scenario, SceneSource};
use catseye::scene::{Mesh, Scene, Shape, gltf, material, radar_toml};
use catseye_io::recipe::Recipe;
use catseye_io::{dataset, rows};
use glam::DVec3;
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// A stand-in for the rooms that build roads and reflectors.
struct Stub;

fn triangle() -> Scene {
    let mut s = Scene::default();
    s.materials.push(material::by_name("steel").unwrap());
    let positions_m = vec![DVec3::ZERO, DVec3::Y, DVec3::Z];
    let mesh = Mesh { positions_m, triangles: vec![[0, 1, 2]], material: vec![0], ..Default::default() };
    s.add_mesh("sheet", "", mesh, Pose::IDENTITY);
    s
}

impl Builder for Stub {
    fn builtin(&self, name: Builtin) -> Result<Scene> {
        assert_eq!(name, Builtin::MarkedRoad);
        let mut s = Scene::default();
        s.materials.push(material::by_name("asphalt").unwrap());
        let positions_m = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        s.add_mesh(
            "road",
            "road",
            Mesh { positions_m, triangles: vec![[0, 1, 2]], material: vec![0], ..Default::default() },
            Pose::IDENTITY,
        );
        Ok(s)
    }
    fn road(&self, _: &Path, _: f64) -> Result<Scene> {
        Ok(Scene::default())
    }
    fn reflector(&self, spec: &str) -> Result<Scene> {
        if spec.starts_with("type1") {
            Ok(triangle())
        } else {
            Err(BadInput::new("is not a reflector").into())
        }
    }
    fn vehicle(&self, _: &str) -> Result<Scene> {
        Ok(triangle())
    }
    fn driven(&self, joints: Vec<Joint>, _: f64, _: Option<Arc<Channel<f64>>>) -> Vec<Joint> {
        joints
    }
}

fn parse(text: &str) -> Result<Scenario> {
    scenario::parse(Path::new("s.toml"), text)
}

fn complaint(text: &str) -> String {
    let e = parse(text).and_then(|s| s.build(&Stub).map(|_| ())).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    let e = e.to_string();
    assert!(!e.contains('\n'), "{e}");
    e
}

const BASE: &str = "name = \"t\"\nradar = \"demo77\"\n";

#[test]
fn templates_parse_without_error_and_match_their_presets() {
    let s = parse(scenario::template("scenario").unwrap()).unwrap();
    assert_eq!(s.radars, [radar_toml::preset("demo77").unwrap()]);
    let scene = s.build(&Stub).unwrap();
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["road", "corner", "marker"]);
    let mut r = radar_toml::parse(Path::new("r.toml"), scenario::template("radar").unwrap()).unwrap();
    r.name = "front77".into();
    assert_eq!(r, radar_toml::preset("front77").unwrap());
    let recipe = scenario::template("recipe").unwrap();
    catseye_io::recipe::Recipe::parse(Path::new("r.toml"), recipe, None).unwrap().draw(0).unwrap();
    assert!(scenario::template("scenari").unwrap_err().to_string().contains("did you mean 'scenario'?"));
}

#[test]
fn objects_are_placed_turned_and_labelled() {
    let s = parse(&format!(
        "{BASE}[scene]\nbuiltin = \"marked-road\"\n\
         [[object]]\nname = \"a\"\nreflector = \"type1:width_m=0.16\"\nposition_m = [10, 2, 0.5]\nyaw_deg = 180\n\
         [[object]]\nreflector = \"type1:width_m=0.16\"\nposition_m = [20, 0, 0]\nvelocity_mps = [-5, 0, 0]\nclass = \"marker\"\n\
         [[point]]\nposition_m = [1, 2, 3]\nrcs_dbsm = -7.5\n\
         [ego]\nposition_m = [1, 0, 0]\nyaw_deg = 90\nspeed_mps = 10\n[frames]\ncount = 3\ninterval_s = 0.1\n"
    ))
    .unwrap();
    let scene = s.build(&Stub).unwrap();
    assert_eq!(scene.objects.len(), 4);
    assert_eq!(scene.meshes.len(), 2, "the reflector is built once");
    let mut ids: Vec<u32> = scene.objects.iter().map(|o| o.id).collect();
    ids.dedup();
    assert_eq!(ids, [1, 2, 3, 4]);
    let a = scene.objects.iter().find(|o| o.name == "a").unwrap();
    assert_eq!(a.class, "reflector");
    // Left of the reflector is right of the world after half a turn.
    assert!((a.pose.point(DVec3::Y) - DVec3::new(10.0, 1.0, 0.5)).length() < 1e-12);
    let b = scene.objects.iter().find(|o| o.class == "marker").unwrap();
    assert_eq!((b.velocity_mps, b.name.as_str()), (DVec3::new(-5.0, 0.0, 0.0), "sheet"));
    let Shape::Mesh(m) = b.shape else { panic!() };
    assert_eq!(scene.materials[scene.meshes[m].material[0] as usize].name, "steel");
    let point = scene.objects.iter().find(|o| o.name == "point 1").unwrap();
    assert_eq!(point.shape, Shape::Point { rcs_dbsm: -7.5 });
    // Heading +y: after 0.2 s the vehicle has gone 2 m to the left.
    let ego = s.ego.free().unwrap().pose(s.frames.time_s(2));
    assert!((ego.translation_m - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-12);
    assert!((ego.direction(DVec3::X) - DVec3::Y).length() < 1e-12);
}

/// An ego vehicle on a road has no motion until the road is built: nothing drives straight on instead.
#[test]
fn an_ego_on_a_road_needs_the_road() {
    let text = "name = \"t\"\nradar = \"demo77\"\n[scene]\nroad = \"road.toml\"\n\
                [ego]\nspeed_mps = 20\n[ego.on_road]\ns_m = 10\n";
    let s = scenario::parse_with_road(Path::new("s.toml"), text, Some("road.toml")).unwrap();
    assert!(s.ego.free().is_none() && s.ego.on_road().unwrap().s_m == 10.0);
    let e = s.without_roads().unwrap_err();
    assert_eq!(e.exit_code(), 2);
    let e = e.to_string();
    assert!(e.contains("s.toml:") && e.contains("ego.on_road") && e.contains("Site"), "{e}");
}

#[test]
fn files_are_looked_for_beside_the_scenario() {
    let dir = tempfile::tempdir().unwrap();
    gltf::export(&triangle(), &dir.path().join("sheet.glb")).unwrap();
    std::fs::write(dir.path().join("mine.toml"), scenario::template("radar").unwrap()).unwrap();
    let text = "name = \"t\"\nradar = \"mine.toml\"\n[scene]\nfile = \"sheet.glb\"\nunit = \"cm\"\n\
                [[object]]\nfile = \"sheet.glb\"\nposition_m = [5, 0, 0]\nname = \"x\"\nmaterials = { steel = \"asphalt\" }\n";
    let path = dir.path().join("s.toml");
    std::fs::write(&path, text).unwrap();
    let s = Scenario::load(&path).unwrap();
    assert_eq!(s.radars[0].name, "my-radar");
    let scene = s.build(&Stub).unwrap();
    assert_eq!(scene.meshes[0].positions_m[1], DVec3::new(0.0, 0.01, 0.0));
    assert_eq!(scene.meshes[1].positions_m[1], DVec3::Y);
    assert_eq!(scene.materials[scene.meshes[1].material[0] as usize].name, "asphalt");
    assert_eq!(scene.objects[1].name, "x");
    assert_eq!(scene.import.triangles, 2);
}

/// An RCS table of 1 m towards x that turns the polarisation.
const TABLE: &str = "frequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm,\
    vv_re_m,vv_im_m,vh_re_m,vh_im_m,hv_re_m,hv_im_m,hh_re_m,hh_im_m\n\
    77e9,-10,0,,,,,0,0,1,0,1,0,0,0\n77e9,10,0,,,,,0,0,1,0,1,0,0,0\n";

#[test]
fn objects_may_scatter_as_a_table_says() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("t.csv"), TABLE).unwrap();
    let text = format!(
        "{BASE}[[object]]\nrcs_table = \"t.csv\"\nposition_m = [20, 1, 0.5]\nyaw_deg = 180\nroll_deg = 30\n\
         velocity_mps = [-3, 0, 0]\nclass = \"sign\"\n[[object]]\nrcs_table = \"t.csv\"\nposition_m = [9, 0, 0]\nname = \"b\"\n"
    );
    let path = dir.path().join("s.toml");
    std::fs::write(&path, &text).unwrap();
    let scene = Scenario::load(&path).unwrap().build(&Stub).unwrap();
    assert_eq!((scene.objects.len(), scene.tables.len()), (2, 1));
    let o = &scene.objects[0];
    assert_eq!((o.shape, o.name.as_str(), o.class.as_str()), (Shape::Table(0), "t", "sign"));
    assert_eq!((scene.objects[1].name.as_str(), o.velocity_mps), ("b", DVec3::X * -3.0));
    assert!(scene.import.notes.iter().any(|n| n.contains("has one elevation")), "{:?}", scene.import.notes);
    // Through glTF and back: the table goes along, the pose stays.
    let (glb, away) = (dir.path().join("s.glb"), dir.path().join("sub"));
    std::fs::create_dir(&away).unwrap();
    gltf::export(&scene, &glb).unwrap();
    gltf::export(&scene, &away.join("s.glb")).unwrap();
    for file in [glb, away.join("s.glb")] {
        let back = gltf::import(&file, &Default::default()).unwrap();
        assert_eq!(back.tables[0].sha256(), scene.tables[0].sha256());
        let b = &back.objects[0];
        assert_eq!((b.shape, b.id, b.class.as_str()), (Shape::Table(0), o.id, "sign"));
        assert!((b.pose.point(DVec3::ONE) - o.pose.point(DVec3::ONE)).length() < 1e-12);
    }
    std::fs::write(away.join("t.csv"), TABLE.replace("77e9,-10", "77e9,-9")).unwrap();
    assert!(
        gltf::export(&scene, &away.join("s.glb"))
            .unwrap_err()
            .to_string()
            .contains("another file has the name")
    );

    let both =
        format!("{BASE}[[object]]\nrcs_table = \"t.csv\"\nreflector = \"type1\"\nposition_m = [9, 0, 0]\n");
    assert!(
        complaint(&both).contains("s.toml:5: position_m") || complaint(&both).contains("exclude each other")
    );
    let unit = format!("{BASE}[[object]]\nrcs_table = \"t.csv\"\nposition_m = [9, 0, 0]\nunit = \"mm\"\n");
    assert!(complaint(&unit).contains("applies only to a mesh file"));
    let gone = format!("{BASE}[[object]]\nrcs_table = \"gone.csv\"\nposition_m = [9, 0, 0]\n");
    assert!(complaint(&gone).contains("gone.csv: no such file"));
}

#[test]
fn an_inline_radar_keeps_its_lines() {
    // The tables of the radar, moved below [radar].
    let inline: String = scenario::template("radar")
        .unwrap()
        .lines()
        .map(|l| {
            let l = l.replacen("[[", "[[radar.", 1);
            let l =
                if l.starts_with('[') && !l.starts_with("[[") { l.replacen('[', "[radar.", 1) } else { l };
            if l.starts_with("name") { format!("[radar]\n{l}\n") } else { l + "\n" }
        })
        .collect();
    let text = format!("name = \"t\"\n[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = 0\n{inline}");
    let s = parse(&text).unwrap();
    assert_eq!((s.radars[0].name.as_str(), s.radars[0].channels()), ("my-radar", 12));
    let line = text.lines().position(|l| l.starts_with("samples")).unwrap() + 1;
    let e = complaint(&text.replace("samples = 512", "samples = 1"));
    assert!(e.starts_with(&format!("s.toml:{line}: radar.receiver.samples = 1: is out of range")), "{e}");
    let e = complaint(&text.replace("samples = 512", "sampels = 1"));
    assert!(e.starts_with(&format!("s.toml:{line}: radar.receiver.sampels: unknown key")), "{e}");
}

#[test]
fn mistakes_are_one_line_with_the_remedy() {
    let point = "[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = 0\n";
    for (text, expect) in [
        (String::new(), "s.toml:1: name: is missing"),
        ("name = \"x\"".into(), "radar: the scenario has no radar"),
        (
            "name = \"x\"\nradar = \"front78\"".into(),
            "s.toml:2: radar = \"front78\": is neither a preset nor a radar file",
        ),
        (
            "name = \"x\"\nradar = \"gone.toml\"".into(),
            "s.toml:2: radar = \"gone.toml\": gone.toml: no such file",
        ),
        (
            "name = \"x\"\nradar = 3".into(),
            "s.toml:2: radar = 3: is a whole number; allowed: the name of a preset",
        ),
        (BASE.into(), "the scenario is empty"),
        (format!("{BASE}[sceen]\n"), "s.toml:3: sceen: unknown key"),
        (format!("{BASE}[scene]\nbuiltin = \"marked-raod\"\n"), "did you mean 'marked-road'?"),
        (
            format!("{BASE}[scene]\nbuiltin = \"w3\"\nfile = \"x.glb\"\n"),
            "s.toml:4: scene.builtin = \"w3\": builtin, road and file exclude each other",
        ),
        (
            format!("{BASE}[scene]\nunit = \"mm\"\n"),
            "s.toml:4: scene.unit = \"mm\": applies only to a mesh file",
        ),
        (
            format!("{BASE}[scene]\nfile = \"x.glb\"\nunit = \"mile\"\n"),
            "s.toml:5: scene.unit = \"mile\": is not a unit of length; allowed: m, cm",
        ),
        (
            format!("{BASE}[scene]\nfile = \"x.glb\"\nup = \"x\"\n"),
            "s.toml:5: scene.up = \"x\": is not an up axis",
        ),
        (
            format!("{BASE}[scene]\nfile = \"x.glb\"\ndefault_material = \"stel\"\n"),
            "s.toml:5: scene.default_material = \"stel\": no material is named",
        ),
        (
            format!("{BASE}[scene]\nfile = \"x.glb\"\nmaterials = {{ a = \"stel\" }}\n"),
            "did you mean 'steel'?",
        ),
        (
            format!("{BASE}[scene]\nfile = \"x.glb\"\n"),
            "s.toml:4: scene.file = \"x.glb\": x.glb: no such file",
        ),
        (
            format!("{BASE}[[point]]\nposition_m = [9, 0]\nrcs_dbsm = 0\n"),
            "s.toml:4: point[0].position_m = [9, 0]: has 2 elements; allowed: a list of 3",
        ),
        (
            format!("{BASE}[[point]]\nposition_m = [9, nan, 0]\nrcs_dbsm = 0\n"),
            "must be three finite numbers",
        ),
        (
            format!("{BASE}[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = inf\n"),
            "s.toml:5: point[0].rcs_dbsm = inf: is out of range",
        ),
        (format!("{BASE}[[point]]\nposition_m = [9, 0, 0]\n"), "point[0].rcs_dbsm: is missing"),
        (
            format!("{BASE}[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = 0\nvelocity_mps = [2e5, 0, 0]\n"),
            "is too fast",
        ),
        (format!("{BASE}[[object]]\nposition_m = [9, 0, 0]\n"), "the object is missing"),
        (
            format!("{BASE}[[object]]\nposition_m = [9, 0, 0]\nfile = \"x.glb\"\nreflector = \"x\"\n"),
            "file, reflector, vehicle and rcs_table exclude each other",
        ),
        (
            format!("{BASE}[[object]]\nposition_m = [9, 0, 0]\nreflector = \"x\"\nunit = \"mm\"\n"),
            "applies only to a mesh file",
        ),
        (
            format!("{BASE}[[object]]\nposition_m = [9, 0, 0]\nreflector = \"typo\"\n"),
            "s.toml:5: object[0].reflector = \"typo\": is not a reflector",
        ),
        (
            format!("{BASE}{point}[ego]\nspeed_kmh = 30\n"),
            "allowed: position_m, yaw_deg, speed_mps, on_road, drive, trajectory; did you mean 'speed_mps'?",
        ),
        (format!("{BASE}{point}[frames]\ncount = 0\n"), "frames.count = 0: is out of range; allowed: 1..="),
        (
            format!("{BASE}{point}[trace]\nbounces = 9\n"),
            "trace.bounces = 9: is out of range; allowed: 1..=8",
        ),
        (
            format!("{BASE}{point}[trace]\nbounces = 5\nmost_bounces = 2\n"),
            "trace.most_bounces = 2: is out of range; allowed: 5..=8",
        ),
        (
            format!("{BASE}{point}[trace]\nmost_bounces = 9\n"),
            "trace.most_bounces = 9: is out of range; allowed: 1..=8",
        ),
        (format!("{BASE}{point}[trace]\nconvention = \"first\"\n"), "allowed: every, last"),
        (
            format!("{BASE}{point}[output]\nadc = 1\n"),
            "s.toml:7: output.adc = 1: is a whole number; allowed: true or false",
        ),
        (
            format!("{BASE}seed = -1\n{point}"),
            "s.toml:3: seed = -1: is out of range; allowed: a whole number from 0",
        ),
    ] {
        let e = complaint(&text);
        assert!(e.contains(expect), "{text}\n gave {e}\n not {expect}");
    }
}

#[test]
fn defaults() {
    let s = parse(&format!("{BASE}[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = 0\n")).unwrap();
    assert_eq!(s.scene, SceneSource::Builtin(Builtin::Empty));
    assert_eq!((s.seed, s.frames.count, s.trace.bounces), (0, 1, 3));
    assert!(s.output.adc && s.output.plots);
}

/// CATSEYE_WRITE_SCHEMA=1 writes the files instead, after the keys were changed on purpose.
#[test]
fn committed_schemas_are_those_of_the_code() {
    for (name, text) in catseye_papers::trial::schemas() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("schema").join(name);
        if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &text).unwrap();
            continue;
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == text, "{name} is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
        let schema: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(schema["additionalProperties"], false, "{name}");
        assert!(schema["properties"]["name"].is_object(), "{name}");
    }
}

/// The tables of datasets, of which `points` and `returns` are points.csv and returns.csv as well, and those of runs: names, types, units and meanings of
/// their columns, from which docs/reference/tables.md is made.
#[test]
fn the_committed_schema_of_tables_is_that_of_the_code() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut recipe = Recipe::load(&root.join("scenes/recipes/template.toml"), None).unwrap();
    recipe.keep.returns = true;
    recipe.keep.lidar = true;
    let mut specs = rows::table_specs(&recipe, &dataset::drawn_scene(&recipe, 0).unwrap());
    specs.extend(rows::run_table_specs());
    let mut tables = serde_json::to_value(&specs).unwrap();
    for column in tables.as_array_mut().unwrap().iter_mut().flat_map(|t| t["columns"].as_array_mut().unwrap())
    {
        assert!(column["about"].is_string(), "{column} says nothing");
        column["unit"] = unit(column["name"].as_str().unwrap()).into();
    }
    let (path, text) =
        (root.join("schema/tables.json"), serde_json::to_string_pretty(&tables).unwrap() + "\n");
    if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
        return std::fs::write(&path, &text).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == text, "tables.json is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    /// Random edits of a valid file: a scenario, or one line.
    #[test]
    fn edits_never_panic(at in 0usize..3000, cut in 0usize..40, put in "[ -~\n]{0,20}") {
        let text = scenario::template("scenario").unwrap();
        let at = at.min(text.len());
        let end = (at + cut).min(text.len());
        let edited = format!("{}{put}{}", &text[..at], &text[end..]);
        if let Err(e) = parse(&edited) {
            prop_assert!(!e.to_string().contains('\n'), "{}", e);
        }
    }

    #[test]
    fn ego_moves_straight(yaw in -360.0f64..360.0, speed in -50.0f64..50.0, t in 0.0f64..10.0) {
        let s = parse(&format!("{BASE}[ego]\nyaw_deg = {yaw}\nspeed_mps = {speed}\n")).unwrap();
        let pose = s.ego.free().unwrap().pose(t);
        let (p, d) = (pose.translation_m, pose.direction(DVec3::X));
        prop_assert!((p - d * speed * t).length() < 1e-9);
    }
}
