//! `catseye export` on a run of `catseye simulate`: what stands at known places is found there in every format.

use crate::common::{catseye, refused, text};
use std::path::Path;

const SCENARIO: &str = r#"
name = "two points and a car that drives"
seed = 7
radar = "radar.toml"
[[point]]
position_m = [20, 3, 0.5]
rcs_dbsm = 10
class = "corner"
[[point]]
position_m = [35, -4, 0.5]
velocity_mps = [6, 0, 0]
rcs_dbsm = 10
class = "car"
[ego]
speed_mps = 10
[frames]
count = 2
interval_s = 0.1
[output]
plots = false
adc = false
"#;

fn run(dir: &Path, args: &[&str]) -> String {
    let out = catseye(dir, args);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

fn simulated() -> tempfile::TempDir {
    let t = tempfile::tempdir().unwrap();
    let radar = include_str!("../../../../scenes/presets/demo77.toml").replace("chirps = 128", "chirps = 32");
    std::fs::write(t.path().join("radar.toml"), radar).unwrap();
    std::fs::write(t.path().join("s.toml"), SCENARIO).unwrap();
    run(t.path(), &["simulate", "s.toml", "-o", "run", "--device", "cpu"]);
    t
}

#[test]
fn point_clouds_of_a_run() {
    let t = simulated();
    let report = run(t.path(), &["export", "run", "--format", "pcd", "-o", "clouds", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["sweeps"], 2);
    let manifest = std::fs::read(t.path().join("clouds/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let second = &manifest["sweeps"][1];
    assert_eq!(second["timestamp"], 100_000);
    assert_eq!(second["ego_pose"]["translation"][0], 1.0);
    let file = std::fs::read(t.path().join("clouds").join(second["filename"].as_str().unwrap())).unwrap();
    let at = file.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12;
    let points: Vec<&[u8]> = file[at..].chunks_exact(43).collect();
    let float = |p: &[u8], i: usize| f32::from_le_bytes(p[i..i + 4].try_into().unwrap());
    // Fields: x, y, z, dyn_prop, id, rcs, vx, vy, vx_comp, vy_comp. The corner stands, so only the radar's motion is seen.
    let mount = second["calibrated_sensor"]["translation"][0].as_f64().unwrap() as f32;
    let near = |x: f32| move |p: &&&[u8]| (float(p, 0) + 1.0 + mount - x).abs() < 0.5;
    let corner = points.iter().find(near(20.0)).expect("the corner");
    assert!(float(corner, 19) < -9.0 && float(corner, 27).abs() < 0.3, "{}", float(corner, 27));
    assert_eq!(corner[12], 1);
    // The car has driven 0.6 m; it goes away from the radar over the ground, and comes closer to it.
    let car = points.iter().find(near(35.6)).expect("the car");
    assert!(float(car, 19) < -3.0 && (float(car, 27) - 6.0).abs() < 0.4, "{}", float(car, 27));
    assert_eq!(car[12], 0);
    refused(t.path(), &["export", "run", "--format", "pcd", "-o", "clouds"], &["clouds", "--force"]);
    run(t.path(), &["export", "run", "--format", "pcd", "-o", "clouds", "--force"]);
}

#[cfg(all(feature = "hdf5", feature = "mcap", feature = "osi"))]
#[test]
fn every_format_gives_the_same_bytes_again() {
    let t = simulated();
    let formats = [
        ("radarscenes", "scenes", "scenes/sequence_1/radar_data.h5"),
        ("mcap", "run.mcap", "run.mcap"),
        ("osi", "run_sd.osi", "run_sd.osi"),
        ("tusimple", "lanes.json", "lanes.json"),
    ];
    for (format, output, file) in formats {
        let args = ["export", "run", "--format", format, "-o", output, "--force"];
        run(t.path(), &args);
        let first = std::fs::read(t.path().join(file)).unwrap();
        run(t.path(), &args);
        assert_eq!(std::fs::read(t.path().join(file)).unwrap(), first, "{format}");
        assert!(!first.is_empty(), "{format}");
    }
}

/// Names and bytes of all files in a folder.
fn files(folder: &Path) -> std::collections::BTreeMap<String, Vec<u8>> {
    let mut found = std::collections::BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            found.extend(files(&path).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            found.insert(name, std::fs::read(&path).unwrap());
        }
    }
    found
}

/// Data sets in folders: the same files again, the car where the truth has it, and one line for what is missing, which leaves
/// nothing behind.
#[test]
fn data_sets_of_a_run() {
    let t = simulated();
    let d = t.path();
    for format in ["nuscenes", "kitti"] {
        let export = |output| run(d, &["export", "run", "--format", format, "-o", output]);
        export(format);
        export("again");
        let first = files(&d.join(format));
        assert!(first.len() > 10 && first == files(&d.join("again")), "{format}");
        std::fs::remove_dir_all(d.join("again")).unwrap();
    }
    let tables = files(&d.join("nuscenes"));
    let table = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&tables[&format!("v1.0-catseye/{name}.json")]).unwrap()
    };
    let offset: serde_json::Value = serde_json::from_slice(&tables["manifest.json"]).unwrap();
    let offset = offset["world_offset_m"][0].as_f64().unwrap();
    // Both frames are key frames, the last one because it is the last. The corner has no category.
    let cars = table("sample_annotation");
    let places = [0, 1].map(|i| cars[i]["translation"][0].as_f64().unwrap() - offset);
    assert!((places[0] - 35.0).abs() < 1e-9 && (places[1] - 35.6).abs() < 1e-9, "{places:?}");
    assert_eq!((cars.as_array().unwrap().len(), table("sample").as_array().unwrap().len()), (2, 2));
    assert!(tables.keys().all(|name| !name.starts_with("sweeps/")), "{:?}", tables.keys());
    assert_eq!(
        String::from_utf8_lossy(&files(&d.join("kitti"))["ImageSets/trainval.txt"]),
        "000000\n000001\n"
    );

    let refused_export = |more: &[&str], words: &[&str]| {
        refused(d, &[&["export", "run", "-o", "x"], more].concat(), words);
        assert!(!d.join("x").exists(), "{more:?}");
        let hidden = std::fs::read_dir(d).unwrap().map(|e| e.unwrap().file_name());
        let left: Vec<_> = hidden.filter(|n| n.to_string_lossy().starts_with(".x")).collect();
        assert!(left.is_empty(), "{more:?}: {left:?}");
    };
    refused_export(&["--format", "coco"], &["mask_road.npy", "no such file", "masks = true"]);
    refused_export(
        &["--format", "nuscenes", "--key-interval-s", "-1"],
        &["key_interval_s = -1", "0 s or more"],
    );
    refused_export(&["--format", "nuscenes", "--key-interval-s", "inf"], &["key_interval_s", "0 s or more"]);
    refused_export(&["--format", "nuscenes", "--sequence", "../up"], &["scene", "../up", "letters"]);
    refused_export(&["--format", "kitti", "--camera-focal-px", "0"], &["focal_px = 0", "positive"]);
    refused_export(&["--format", "kitti", "--camera-size", "0x9"], &["camera size", "0 x 9", "1 pixel"]);
    std::fs::remove_file(d.join("run/frame_000001/points.csv")).unwrap();
    for format in ["nuscenes", "kitti"] {
        refused_export(&["--format", format], &["points.csv", "no such file", "points = true"]);
    }
    std::fs::remove_file(d.join("run/frame_000001/truth.json")).unwrap();
    for format in ["nuscenes", "kitti"] {
        refused_export(&["--format", format], &["truth.json", "no such file", "truth = true"]);
    }
}

/// Masks that are damaged, cut short, or of another size are refused by name.
#[test]
fn annotations_of_masks() {
    let t = simulated();
    let d = t.path();
    let masked = SCENARIO.replace("plots = false", "plots = false\nmasks = true");
    std::fs::write(d.join("s.toml"), masked).unwrap();
    run(d, &["simulate", "s.toml", "-o", "run", "--device", "cpu", "--force"]);
    run(d, &["export", "run", "--format", "coco", "-o", "coco"]);
    let found = files(&d.join("coco"));
    let road: serde_json::Value = serde_json::from_slice(&found["road/annotations.json"]).unwrap();
    // The moving car is one cell, in each of the two frames.
    let vehicles: Vec<_> =
        road["annotations"].as_array().unwrap().iter().filter(|a| a["category_id"] == 2).collect();
    assert!(vehicles.len() == 2 && vehicles.iter().all(|a| a["area"] == 1), "{vehicles:?}");
    assert_eq!(found.keys().filter(|n| n.ends_with(".png")).count(), 8);
    let mask = d.join("run/frame_000001/mask_markers.npy");
    let whole = std::fs::read(&mask).unwrap();
    let mut class = whole.clone();
    *class.last_mut().unwrap() = 9;
    let grid = std::fs::read(d.join("run/frame_000001/mask_road.npy")).unwrap();
    let cut = whole[..whole.len() - 100].to_vec();
    for (bytes, words) in
        [(class, ["9: ", "0 to 6"]), (grid, ["shape = [450, 300]", "[227, 227]"]), (cut, ["npy", ""])]
    {
        std::fs::write(&mask, bytes).unwrap();
        let words = [&["mask_markers"], &words[..]].concat();
        refused(d, &["export", "run", "--format", "coco", "-o", "x"], &words);
        assert!(!d.join("x").exists());
    }
}

#[test]
fn refused_in_one_line() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    refused(
        d,
        &["export", "nothing", "--format", "pcd", "-o", "x"],
        &["nothing", "no such file", "simulate"],
    );
    refused(d, &["export", "nothing", "--format", "xyz", "-o", "x"], &["xyz"]);
    // A folder that another command wrote.
    std::fs::create_dir(d.join("other")).unwrap();
    std::fs::write(d.join("other/manifest.json"), "{\"frames\": []}").unwrap();
    refused(d, &["export", "other", "--format", "pcd", "-o", "x"], &["no frames", "simulate"]);
    std::fs::write(d.join("other/manifest.json"), "{\"frames\": [1").unwrap();
    refused(d, &["export", "other", "--format", "pcd", "-o", "x"], &["manifest.json:1"]);
    assert!(!d.join("x").exists());
}
