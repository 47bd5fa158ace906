//! Values that no reader may take in silence, and what is said about them: one line of at most 300 characters with file, line
//! and key, in the file's words, without what stands in files of others; with `--json` an object, too.

use crate::common::{catseye, refused, text};
use catseye::road::site::Site;
use catseye::road::{opendrive, scene_toml};
use catseye::scene::radar_toml;
use catseye::scene::scenario::{self, Scenario};
use catseye_papers::study::file as study;
use std::path::Path;

const SCENARIO: &str = "name = \"x\"\nradar = \"front77\"\n";
const POINT: &str = "[[point]]\nposition_m = [9, 0, 0]\nrcs_dbsm = 0\n";

const ROAD: &str = r#"name = "x"
[[road]]
name = "a"
plan = [{ kind = "straight", length_m = 100 }]
right = [{ width_m = 3.5 }]
[[road.markers]]
reflector = "type1:width_m=0.16,height_m=0.004"
lateral = { lane = 1 }
spacing_m = 10
"#;

/// The complaint, whose form is checked.
fn complaint<T>(r: catseye::Result<T>) -> String {
    let Err(e) = r else { panic!("taken") };
    assert_eq!(e.exit_code(), 2, "{e}");
    let e = e.to_string();
    assert!(!e.contains('\n') && (e.chars().count() <= 300 || e.contains("no material")), "{e}");
    for word in [
        "usize",
        "u32",
        "u64",
        "i32",
        "i64",
        "f64",
        "invalid type",
        "invalid value",
        "struct ",
        "tuple",
        "sequence",
    ] {
        assert!(!e.contains(word), "'{word}' is no word for people: {e}");
    }
    e
}

fn of_scenario(text: &str) -> String {
    complaint(scenario::parse(Path::new("s.toml"), text))
}

fn of_road(text: &str) -> String {
    complaint(scene_toml::parse(Path::new("r.toml"), text))
}

#[test]
fn lists_have_their_length() {
    let preset = include_str!("../../../../scenes/presets/demo77.toml");
    let radar = |from: &str, to: &str| {
        assert!(preset.contains(from), "{from}");
        complaint(radar_toml::parse(Path::new("d.toml"), &preset.replacen(from, to, 1)))
    };
    let study_text = include_str!("../../../../scenes/presets/template_study.toml");
    let study =
        |more: &str| complaint(study::parse(Path::new("y.toml"), &format!("{study_text}\n{more}"), true));
    for (e, expect) in [
        (
            of_scenario(&format!("{SCENARIO}[[point]]\nposition_m = [1, 2, 3, 9]\nrcs_dbsm = 0\n")),
            "s.toml:4: point[0].position_m = [1, 2, 3, 9]: has 4 elements; allowed: a list of 3",
        ),
        (
            of_scenario(&format!("{SCENARIO}{POINT}velocity_mps = [1]\n")),
            "s.toml:6: point[0].velocity_mps = [1]: has 1 element; allowed: a list of 3",
        ),
        (
            of_scenario(&format!("{SCENARIO}{POINT}[ego]\nposition_m = [0, 0, 0, 0, 0]\n")),
            "s.toml:7: ego.position_m = [0, 0, 0, 0, 0]: has 5 elements",
        ),
        (
            of_scenario(&format!("{SCENARIO}{POINT}[weather]\nwind_mps = [1, 2, 3, 4]\n")),
            "s.toml:7: weather.wind_mps = [1, 2, 3, 4]: has 4 elements",
        ),
        (
            of_scenario(&format!(
                "name = \"x\"\n{POINT}[radar]\n{}",
                preset.replace("\n[", "\n[radar.").replace("[radar.[", "[[radar.").replacen(
                    "position_m = [",
                    "position_m = [7, ",
                    1
                )
            )),
            ": has 4 elements; allowed: a list of 3",
        ),
        (radar("position_m = [", "position_m = [7, "), ": has 4 elements; allowed: a list of 3"),
        (
            of_road(&ROAD.replace("width_m = 3.5", "width_m = [[0, 3], [50, 3, 9]]")),
            "r.toml:5: road[0].right[0].width_m",
        ),
        (of_road(&ROAD.replace("plan =", "start = { position_m = [1, 2, 3, 4] }\nplan =")), "has 4 elements"),
        (study("[[fact]]\ntext = \"x\"\nwithin = { rcs_dbsm = [1, 2, 3] }\n"), "y.toml:"),
    ] {
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
    // A list of any length is one still.
    assert!(
        scene_toml::parse(Path::new("r.toml"), &ROAD.replace("3.5", "[[0, 3], [9, 3], [50, 4]]")).is_ok()
    );
}

#[test]
fn kinds_of_values_are_told_in_words() {
    let frames = |count: &str| of_scenario(&format!("{SCENARIO}{POINT}[frames]\ncount = {count}\n"));
    for (e, expect) in [
        (frames("-1"), "frames.count = -1: is out of range; allowed: a whole number from 0 to 4294967295"),
        (
            frames("1.5"),
            "frames.count = 1.5: is a number with a decimal point or exponent; allowed: a whole number",
        ),
        (frames("true"), "frames.count = true: is true or false; allowed: a whole number"),
        (frames("\"3\""), "frames.count = \"3\": is text; allowed: a whole number"),
        (frames("[3]"), "frames.count = [3]: is a list; allowed: a whole number"),
        (frames("99999999999"), "frames.count = 99999999999: is out of range"),
        (frames("99999999999999999999999999999999999999999999"), "s.toml:7: "),
        (frames("{ a = 1 }"), "frames.count"),
        (
            of_scenario(&format!("{SCENARIO}{POINT}[ego]\nspeed_mps = true\n")),
            "ego.speed_mps = true: is true or false; allowed: a number",
        ),
        (
            of_scenario(&format!("{SCENARIO}point = 3\n")),
            "point = 3: is a whole number; allowed: a list in brackets",
        ),
        (of_scenario(&format!("{SCENARIO}ego = \"fast\"\n")), "ego = \"fast\": is text; allowed: a table"),
        (of_scenario(&format!("{SCENARIO}seed = 18446744073709551616\n{POINT}")), "seed"),
        (of_road(&ROAD.replace("3.5", "\"wide\"")), "allowed: a number or a list of pairs [s, value]"),
    ] {
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
}

#[test]
fn a_missing_file_is_told_where_it_is_named() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let at = |text: String| {
        std::fs::write(d.join("s.toml"), text).unwrap();
        complaint(Scenario::load(&d.join("s.toml")))
    };
    for (text, line, key, gone) in [
        (format!("name = \"x\"\n\nradar = \"gone.toml\"\n{POINT}"), 3, "radar", "gone.toml"),
        (
            format!("name = \"x\"\n{POINT}[[radars]]\nname = \"a\"\nradar = \"gone.toml\"\n"),
            7,
            "radars[0].radar",
            "gone.toml",
        ),
        (format!("{SCENARIO}[scene]\nfile = \"sub/gone.glb\"\n"), 4, "scene.file", "sub/gone.glb"),
        (format!("{SCENARIO}[scene]\nroad = \"gone.toml\"\n"), 4, "scene.road", "gone.toml"),
        (
            format!("{SCENARIO}[[object]]\nfile = \"gone.glb\"\nposition_m = [9, 0, 0]\n"),
            4,
            "object[0].file",
            "gone.glb",
        ),
        (
            format!("{SCENARIO}[[object]]\nrcs_table = \"gone.csv\"\nposition_m = [9, 0, 0]\n"),
            4,
            "object[0].rcs_table",
            "gone.csv",
        ),
    ] {
        let e = at(text);
        let place = format!("{}:{line}: {key} = \"{gone}\": ", d.join("s.toml").display());
        assert!(
            e.starts_with(&place) && e.contains(&format!("{}: no such file", d.join(gone).display())),
            "{e}"
        );
    }
    let road =
        |from: &str, to: &str| complaint(scene_toml::parse(&d.join("r.toml"), &ROAD.replace(from, to)));
    let e = road("plan = [{ kind = \"straight\", length_m = 100 }]", "opendrive = \"gone.xodr\"");
    assert!(e.contains("r.toml:4: road[0].opendrive = \"gone.xodr\": ") && e.contains("no such file"), "{e}");
    let study_text = include_str!("../../../../scenes/presets/template_study.toml");
    assert!(study_text.contains("target = \""));
    let broken = study_text.lines().map(|l| match l.starts_with("target = ") {
        true => "target = \"gone.glb\"\n".to_string(),
        false => format!("{l}\n"),
    });
    let e = complaint(study::parse(&d.join("y.toml"), &broken.collect::<String>(), true));
    assert!(
        e.contains("y.toml:") && e.contains("set.target = \"gone.glb\": ") && e.contains("no such file"),
        "{e}"
    );
}

#[test]
fn counts_that_do_not_fit() {
    let counted = |n: &str| ROAD.to_string() + &format!("count = {n}\n");
    let e = of_road(&counted("1000000000"));
    assert_eq!(
        e,
        "r.toml:10: road[0].markers[0].count = 1000000000: is more than the road has room for at this spacing; \
         allowed: 0..=11; remove count to fill the road"
    );
    assert!(scene_toml::parse(Path::new("r.toml"), &counted("11")).is_ok());
    assert!(of_road(&counted("12")).contains("allowed: 0..=11"));
    assert!(of_road(&counted("-3")).contains("is out of range; allowed: a whole number from 0"));
}

#[test]
fn opendrive_lengths_agree() {
    let file = |length: &str, geometry: &str, section: &str| {
        format!(
            "<OpenDRIVE><road id=\"1\" length=\"{length}\"><planView>\n{geometry}</planView><lanes>\
             <laneSection s=\"{section}\"><right><lane id=\"-1\" type=\"driving\">\
             <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes></road></OpenDRIVE>"
        )
    };
    let line = |s: f64, length: f64| {
        format!("<geometry s=\"{s}\" x=\"{s}\" y=\"0\" hdg=\"0\" length=\"{length}\"><line/></geometry>\n")
    };
    let read = |text: &str| opendrive::parse(Path::new("a.xodr"), text);
    let whole = line(0.0, 60.0) + &line(60.0, 40.0);
    assert!(read(&file("100", &whole, "0")).is_ok());
    assert!(read(&file("100.009", &whole, "0")).is_ok(), "rounded");
    for (text, expect) in [
        (
            file("500", &whole, "0"),
            "a.xodr:1: road = length 500 m: the stated length differs from the end of the geometry, 100 m",
        ),
        (file("-100", &whole, "0"), "road = length -100 m"),
        (file("100", &whole, "250"), "laneSection = 250: begins outside the road"),
        (file("100", &whole, "-5"), "laneSection = -5: begins outside the road"),
        (file("100", &(line(0.0, 60.0) + &line(60.0, -40.0)), "0"), "a.xodr:3: geometry"),
        (file("110", &(line(0.0, 60.0) + &line(70.0, 40.0)), "0"), "a.xodr:3: geometry = 70: s is not where"),
    ] {
        let e = complaint(read(&text));
        assert!(e.contains(expect), "{e}\n not {expect}");
    }
}

#[test]
fn a_radar_stands_neither_under_the_road_nor_in_a_body() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    std::fs::write(
        d.join("r.toml"),
        ROAD.to_string() + "[[road.vehicle]]\nkind = \"hatchback\"\nlateral = { lane = 1 }\ns_m = 40\n",
    )
    .unwrap();
    let site = |ego: &str, frames: &str| {
        let text = format!("{SCENARIO}[scene]\nroad = \"r.toml\"\n[ego]\n{ego}\n[frames]\n{frames}\n");
        Site::new(&scenario::parse(&d.join("s.toml"), &text).unwrap())
    };
    site("position_m = [2, -1.75, 0]", "count = 1").unwrap();
    let e = complaint(site("position_m = [2, -1.75, -3]", "count = 1"));
    assert!(
        e.contains("under object '") && e.contains("radar 'front77'") && e.contains("ego.position_m"),
        "{e}"
    );
    // Not yet in the first frame.
    let e = complaint(site("position_m = [2, -1.75, 0]\nspeed_mps = 36", "count = 2\ninterval_s = 1"));
    assert!(
        e.contains("inside object '")
            && e.ends_with("move the vehicle or the radar's mounting")
            && e.contains("in frame 1"),
        "{e}"
    );
    let e = complaint(site("position_m = [38, -1.75, 0]", "count = 1"));
    assert!(e.contains("inside object '") && e.contains("in frame 0"), "{e}");
    // Under a bridge there is a road beneath, and over it nothing at all.
    std::fs::write(
        d.join("b.toml"),
        ROAD.to_string()
            + "[[road]]\nname = \"bridge\"\nstart = { position_m = [0, 0, 6] }\n\
             plan = [{ kind = \"straight\", length_m = 50 }]\nright = [{ width_m = 3.5 }]\n",
    )
    .unwrap();
    let text = format!("{SCENARIO}[scene]\nroad = \"b.toml\"\n[ego]\nposition_m = [2, -1.75, 0]\n");
    assert!(Site::new(&scenario::parse(&d.join("s.toml"), &text).unwrap()).is_ok());
    std::fs::write(d.join("s.toml"), text.replace("0]\n", "-3]\n")).unwrap();
    refused(
        d,
        &["simulate", "s.toml", "-o", "o", "--device", "cpu"],
        &["s.toml: ego.position_m", "under object '"],
    );
    assert!(!d.join("o").exists());
}

#[test]
fn outputs_are_named_after_what_is_written() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    std::fs::write(d.join("s.toml"), ROAD).unwrap();
    for args in [
        &["rcs", "sphere", "-o", "o.xlsx"][..],
        &["rcs", "sphere", "--azimuth-deg", "0:9:1", "--plot", "o.jpg"],
        &["rcs", "sphere", "-o", "o.png"],
        &["plot", "t.csv", "-o", "o.jpg"],
        &["reflector", "plate", "-o", "o.gltf"],
        &["reflector", "plate", "-o", "o.glb", "--preview", "o.svg"],
        &["scene", "s.toml", "-o", "o.gltf"],
        &["init", "radar", "-o", "o.json"],
        &["calibrate", "--radar", "front77", "--azimuth-deg", "0", "-o", "o.npy"],
        &["calibrate", "--radar", "front77", "--azimuth-deg", "0", "-o", "o.csv", "--plot", "o.jpeg"],
        &["export", "run", "--format", "mcap", "-o", "o.bag"],
    ] {
        let name = args.iter().rfind(|a| a.starts_with("o.")).unwrap();
        refused(d, args, &[name, "allowed: "]);
        assert!(!d.join(name).exists() && !d.join("o.glb").exists() && !d.join("o.csv").exists());
    }
}

#[test]
fn a_mesh_in_millimetres_is_a_question() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let mut scene =
        catseye::road::target::load("plate:width_m=0.2,height_m=0.1", &Default::default()).unwrap().scene;
    scene.meshes.iter_mut().flat_map(|m| &mut m.positions_m).for_each(|p| *p *= 1000.0);
    std::fs::write(d.join("p.glb"), catseye::scene::gltf::to_glb(&scene).unwrap()).unwrap();
    refused(
        d,
        &["rcs", "p.glb", "--device", "cpu"],
        &["p.glb: unit: the mesh is 2", "0.001 m to 100 m", "--unit mm"],
    );
    for unit in ["mm", "m"] {
        let out = catseye(d, &["rcs", "p.glb", "--device", "cpu", "--unit", unit, "--accuracy-db", "3"]);
        assert_eq!(out.status.code(), Some(0), "{unit}: {}", text(&out.stderr));
    }
    let object = |more: &str| {
        let text = format!("{SCENARIO}[[object]]\nfile = \"p.glb\"\nposition_m = [9, 0, 0]\n{more}");
        Site::new(&scenario::parse(&d.join("s.toml"), &text).unwrap())
    };
    assert!(complaint(object("")).contains("unit = \"mm\""));
    assert!(object("unit = \"mm\"\n").is_ok());
    // A part of a road may have its unit, too.
    let on_road = |more: &str| {
        let object = format!("[[road.object]]\nfile = \"p.glb\"\ns_m = 5\nlateral = {{ lane = 1 }}\n{more}");
        scene_toml::parse(&d.join("r.toml"), &format!("{ROAD}{object}"))
    };
    assert!(on_road("unit = \"mm\"\n").is_ok());
    assert!(complaint(on_road("unit = \"yd\"\n")).contains("r.toml:14: road[0].object[0].unit = \"yd\""));
    // A whole scene may be long.
    let text = format!("{SCENARIO}[scene]\nfile = \"p.glb\"\n");
    assert!(scenario::parse(&d.join("s.toml"), &text).unwrap().build(&catseye::road::Library).is_ok());
}

#[test]
fn what_stl_does_not_state_is_asked_for_by_its_keys() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let plate = catseye::road::target::load("plate:width_m=0.2,height_m=0.1", &Default::default()).unwrap();
    for name in ["p.stl", "p.obj"] {
        let written = catseye::scene::mesh_file::write(&plate.scene, Path::new(name), None).unwrap();
        std::fs::write(d.join(name), written.bytes).unwrap();
    }
    let keys = "unit = \"mm\"\nup = \"z\"\ndefault_material = \"steel\"\n";
    let scene = |name: &str, keys: &str| {
        let text = format!("{SCENARIO}[[object]]\nfile = \"{name}\"\nposition_m = [9, 0, 0]\n{keys}");
        let scenario = scenario::parse(&d.join("s.toml"), &text)?;
        scenario.build(&catseye::road::Library)
    };
    let e = complaint(scene("p.stl", ""));
    assert!(
        e.contains("s.toml:4: object[0].file = \"p.stl\": states no unit, no up axis and no material"),
        "{e}"
    );
    assert!(e.contains("add unit = \"mm\"") && e.contains("default_material = \"pec\""), "{e}");
    assert!(complaint(scene("p.obj", "unit = \"mm\"\n")).contains("states no up axis; add up = \"z\""));
    for (name, material) in [("p.stl", "steel"), ("p.obj", "pec")] {
        let s = scene(name, keys).unwrap();
        let (low, high) = s.bounds_m(0.0).unwrap();
        assert!(((high - low).max_element() - 0.2).abs() < 1e-6 && s.materials[0].name == material, "{name}");
    }
    let on_road = |keys: &str| {
        let object = format!("[[road.object]]\nfile = \"p.stl\"\ns_m = 5\nlateral = {{ lane = 1 }}\n{keys}");
        scene_toml::parse(&d.join("r.toml"), &format!("{ROAD}{object}"))
    };
    assert!(complaint(on_road("")).contains("r.toml:11: road[0].object[0].file = \"p.stl\": states no unit"));
    assert!(on_road(keys).is_ok());
    let of_study = |keys: &str| {
        let text = format!(
            "name = \"x\"\ntitle = \"x\"\n[set]\ntarget = \"p.stl\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 1]\n{keys}"
        );
        study::parse(&d.join("study.toml"), &text, false)
    };
    assert!(complaint(of_study("")).contains("study.toml:4: set.target = \"p.stl\": states no unit"));
    assert!(of_study(&format!("[import]\n{keys}")).is_ok());
}

#[test]
fn pictures_of_what_is_no_number() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let head = "frequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm\n";
    let row = |az: u32, db: &str| format!("77e9,{az},0,{db},{db},{db},{db}\n");
    std::fs::write(d.join("all.csv"), format!("{head}{}{}", row(0, "nan"), row(1, "nan"))).unwrap();
    std::fs::write(d.join("some.csv"), format!("{head}{}{}{}", row(0, "1"), row(1, "nan"), row(2, "-inf")))
        .unwrap();
    refused(d, &["plot", "all.csv"], &["all.csv", "no number"]);
    assert!(!d.join("all.png").exists());
    let out = catseye(d, &["plot", "some.csv", "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("some.csv: 4 values are not numbers"), "{}", text(&out.stderr));
    let said: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(said["values_left_out"], serde_json::json!([4]));
}

#[test]
fn contents_of_other_files_are_not_repeated() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    std::fs::write(d.join("shadow"), "root:hush=hush:1\nname = [hush\n").unwrap();
    std::fs::write(d.join("settings.conf"), "name = \"hush\"\nwaveform = \"hush\"\n").unwrap();
    for file in ["shadow", "settings.conf"] {
        for args in [
            &["simulate", file, "-o", "o"][..],
            &["scene", file, "-o", "o.glb"],
            &["study", file, "-o", "o"],
            &["dataset", file, "-o", "o"],
            &["calibrate", "--radar", file, "--azimuth-deg", "0", "-o", "o.csv"],
            &["plot", file],
        ] {
            let out = catseye(d, args);
            assert_eq!(out.status.code(), Some(2), "{args:?}");
            let said = text(&out.stderr) + &text(&out.stdout);
            assert!(said.contains(file) && !said.contains("hush"), "{args:?}: {said}");
        }
    }
}

#[test]
fn errors_are_json_with_json() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    std::fs::write(d.join("s.toml"), format!("{SCENARIO}{POINT}[frames]\ncount = 0\n")).unwrap();
    for (args, code, key) in [
        (&["simulate", "s.toml", "-o", "o", "--json"][..], 2, Some("frames.count")),
        (&["rcs", "sphere", "--json", "--frequency-hz", "0"], 2, Some("--frequency-hz")),
        (&["rcs", "sphere", "--json", "--nonsense"], 2, None),
        (&["rcs", "--json"], 2, None),
        (&["reflector", "plat", "-o", "o.glb", "--json"], 2, None),
    ] {
        let out = catseye(d, args);
        assert_eq!(out.status.code(), Some(code), "{args:?}");
        let said: serde_json::Value = serde_json::from_slice(&out.stdout).expect("one object on stdout");
        let e = &said["error"];
        let message = e["message"].as_str().unwrap();
        assert_eq!(e["exit_code"], code);
        assert!(text(&out.stderr).contains(message), "{args:?}: {said}");
        if let Some(key) = key {
            assert!(e["key"].as_str().unwrap().contains(key) && e["problem"].is_string(), "{said}");
        }
    }
    let out = catseye(d, &["simulate", "s.toml", "-o", "o", "--json"]);
    let e: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((e["error"]["line"].as_u64(), e["error"]["value"].as_str()), (Some(7), Some("0")));
    assert!(e["error"]["file"].as_str().unwrap().ends_with("s.toml") && e["error"]["allowed"].is_string());
}

/// serde takes a list of a table's values for the table, and an empty list for one whose values all have defaults.
#[test]
fn a_list_is_no_table() {
    let says = |e: String, key: &str| {
        assert!(e.contains(&format!("{key} = []: is a list; allowed: a table")), "{e}")
    };
    says(of_road(&ROAD.replace("name = \"a\"\n", "name = \"a\"\npaint = []\n")), "road[0].paint");
    for key in ["ego", "frames", "trace", "output", "weather"] {
        says(of_scenario(&format!("{SCENARIO}{key} = []\n{POINT}")), key);
    }
    let e = of_scenario(&format!("{SCENARIO}frames = [3, 0.1]\n{POINT}"));
    assert!(e.contains("frames = [3, 0.1]: is a list; allowed: a table"), "{e}");
}

/// A file that is no TOML may hold what its reader is not to see.
#[test]
fn a_line_that_is_no_toml_is_not_repeated() {
    let e = of_scenario("root:x:0:0:secret:/root\n");
    assert!(e.contains("s.toml:1: is not TOML") && !e.contains("secret"), "{e}");
    let e = of_scenario("name = \"x\"\npassword = secret\n");
    assert!(e.contains("s.toml:2: password: is not TOML") && !e.contains("secret"), "{e}");
}

/// Meshes that stand in each other are there once: beams would cross all of them.
#[test]
fn coincident_instances_are_one() {
    use catseye::geom::Geometry;
    let one =
        catseye::road::target::load("plate:width_m=0.2,height_m=0.1", &Default::default()).unwrap().scene;
    let count = |scene: &catseye::scene::Scene| Geometry::build(scene, 0.0, 77e9).unwrap().triangles.len();
    let mut many = one.clone();
    for i in 0..1000 {
        let mut o = one.objects[0].clone();
        o.id = 10 + i;
        many.objects.push(o);
    }
    assert_eq!(count(&many), count(&one));
    // Side by side, or moving otherwise, they are others.
    many.objects[1].pose.translation_m.x += 1.0;
    many.objects[2].velocity_mps.x = 1.0;
    assert_eq!(count(&many), 3 * count(&one));
}
