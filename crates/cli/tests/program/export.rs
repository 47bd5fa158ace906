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
