//! `catseye lane` from outside: what it refuses, what it leaves, that it goes on where it stopped and repeats to the byte.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn catseye(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_catseye"));
    command.args(args).args(["--quiet", "--device", "cpu"]).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn refused(args: &[&str]) -> String {
    let out = catseye(args);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {}{}", text(&out.stdout), text(&out.stderr));
    let message = text(&out.stderr);
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    message
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// A marked lane, a radar with few chirps, two frames.
fn scenario(dir: &Path, lane: &str) -> PathBuf {
    let road = root().join("scenes/road/road_lane_3m.toml");
    fs::copy(road, dir.join("road.toml")).unwrap();
    let radar = fs::read_to_string(root().join("scenes/presets/feng77.toml")).unwrap();
    let radar =
        radar.replace("chirps = 1024", "chirps = 128").replace("doppler_fft = 2048", "doppler_fft = 128");
    fs::write(dir.join("radar.toml"), radar).unwrap();
    let path = dir.join("scenario.toml");
    let text = format!(
        "name = \"small\"\nseed = 4\nradar = \"radar.toml\"\n[scene]\nroad = \"road.toml\"\n\
         [ego]\nspeed_mps = 10\non_road = {{ lane = 1, s_m = 10 }}\n\
         [frames]\ncount = 2\ninterval_s = 0.05\n[trace]\nbounces = 1\nrays = 2000\n{lane}"
    );
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn bad_calls_are_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let o = out.to_str().unwrap();
    let good = scenario(dir.path(), "");
    let good = good.to_str().unwrap();
    let e = refused(&["lane", "marker", good, "-o", o]);
    assert!(e.contains("marker") && e.contains("markers") && e.contains("camera-fusion"), "{e}");
    let e = refused(&["lane", "markers", good, good, "-o", o]);
    assert!(e.contains("one scenario"), "{e}");
    let e = refused(&["lane", "markers", good, "-o", o, "--runs", "0"]);
    assert!(e.contains("--runs"), "{e}");
    let e = refused(&["lane", "markers", "nowhere.toml", "-o", o]);
    assert!(e.contains("nowhere.toml"), "{e}");
    // A key that no method has, with its line; a value out of its range.
    let e = refused(&[
        "lane",
        "markers",
        scenario(dir.path(), "[lane.markers]\nspacing = [2]\n").to_str().unwrap(),
        "-o",
        o,
    ]);
    assert!(e.contains("scenario.toml:16") && e.contains("spacing"), "{e}");
    let e = refused(&[
        "lane",
        "markers",
        scenario(dir.path(), "[lane.markers]\nspacing_m = [-2]\n").to_str().unwrap(),
        "-o",
        o,
    ]);
    assert!(e.contains("lane.markers.spacing_m") && e.contains("-2"), "{e}");
    assert!(!out.exists());
}

/// A method that finds no radar it can take: the line names the scenario's file, the method, the radars there are, which it takes and what to
/// do; and each cell of a comparison says the same without the file.
#[test]
fn a_missing_radar_is_told_with_file_method_and_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let o = out.to_str().unwrap();
    let chirps = scenario(dir.path(), "");
    let pulses = dir.path().join("pulses.toml");
    let text = fs::read_to_string(&chirps).unwrap().replace("\"radar.toml\"", "\"uwb9\"");
    fs::write(&pulses, text).unwrap();
    for (method, path) in [
        ("uwb", &chirps),
        ("markers", &pulses),
        ("range-doppler", &pulses),
        ("signature", &pulses),
        ("road-shape", &pulses),
        ("hd-map", &pulses),
        ("camera-fusion", &pulses),
    ] {
        let path = path.to_str().unwrap();
        let e = refused(&["lane", method, path, "-o", o]);
        let problem = format!("the method {method} cannot use any radar of the scenario; allowed: a");
        for part in [path, ": radar = ", " channel", &problem, "; use radar = \""] {
            assert!(e.contains(part), "{method}: '{part}' is not in: {e}");
        }
    }
    assert!(!out.exists());
    let made = catseye(&["lane", "compare", pulses.to_str().unwrap(), "-o", o, "--frames", "1", "--json"]);
    assert!(made.status.success(), "{}", self::text(&made.stderr));
    let report: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    let table = report["notes"][0].as_str().unwrap();
    for method in ["markers", "range-doppler", "signature", "hd-map", "camera-fusion"] {
        let said = format!(
            "not possible: radar = uwb9 (pulse, 1 channel): the method {method} cannot use any radar"
        );
        assert!(table.contains(&said), "{method}: {table}");
    }
}

/// A scenario that is not what a method takes in another way than by its radars has its file in the line, too.
#[test]
fn what_a_scenario_lacks_is_told_with_its_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bare.toml");
    let text = "name = \"bare\"\nradar = \"demo77\"\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\n\
                [ego]\nspeed_mps = 10\n[frames]\ncount = 2\ninterval_s = 0.05\n";
    fs::write(&path, text).unwrap();
    let (path, out) = (path.to_str().unwrap(), dir.path().join("out"));
    for method in ["markers", "signature", "hd-map", "camera-fusion"] {
        let e = refused(&["lane", method, path, "-o", out.to_str().unwrap()]);
        assert!(e.contains(path), "{method}: {e}");
    }
}

/// The same bytes again, also when it was interrupted; other files are there as promised.
#[test]
fn a_run_leaves_its_files_and_repeats() {
    let dir = tempfile::tempdir().unwrap();
    let path = scenario(dir.path(), "[lane.markers]\nlevels = false\n");
    let path = path.to_str().unwrap();
    let run = |name: &str| {
        let out = dir.path().join(name);
        let o = catseye(&["lane", "markers", path, "-o", out.to_str().unwrap()]);
        assert!(o.status.success(), "{}", text(&o.stderr));
        out
    };
    let (a, b) = (run("a"), run("b"));
    for name in ["report.md", "report.json", "estimates.jsonl", "scores.csv"] {
        let (x, y) = (fs::read(a.join(name)).unwrap(), fs::read(b.join(name)).unwrap());
        assert!(!x.is_empty() && x == y, "{name}");
    }
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(a.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["seed"], 4);
    assert!(manifest["seconds_per_look"]["markers"][0].as_f64().unwrap() > 0.0);
    let lines = fs::read_to_string(a.join("estimates.jsonl")).unwrap();
    assert_eq!(lines.lines().count(), 2);
    // A result is not written over.
    let e = refused(&["lane", "markers", path, "-o", a.to_str().unwrap()]);
    assert!(e.contains("--force"), "{e}");
}

/// A scene with no road: the markers' method says what it lacks; the comparison says it of each method.
#[test]
fn a_comparison_says_what_a_scenario_lacks() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bare.toml");
    let text = "name = \"bare\"\nradar = \"demo77\"\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\n\
                [ego]\nspeed_mps = 10\n[frames]\ncount = 2\ninterval_s = 0.05\n";
    fs::write(&path, text).unwrap();
    let out = dir.path().join("out");
    let o = catseye(&["lane", "compare", path.to_str().unwrap(), "-o", out.to_str().unwrap(), "--json"]);
    assert!(o.status.success(), "{}", self::text(&o.stderr));
    let report: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    let table = report["notes"][0].as_str().unwrap();
    for method in ["uwb", "markers", "range-doppler", "signature", "road-shape", "hd-map", "camera-fusion"] {
        let named = |row: &str| row.split('|').nth(2).is_some_and(|cell| cell.trim().starts_with(method));
        assert!(table.lines().any(named), "{method}: {table}");
    }
    assert!(table.contains("not possible"), "{table}");
    // No method invents a lane where there is one point. A network, which programs with `learn` have, knows roads alone and says one.
    for row in table.lines().skip(2).filter(|row| !row.contains("| segmentation")) {
        let cell = row.split('|').nth(3).unwrap_or("").trim();
        assert!(
            cell.starts_with("not possible") || cell.parse::<f64>().is_ok_and(|found| found == 0.0),
            "{row}"
        );
    }
    assert!(out.join("compare.csv").is_file());
}

/// The third road of the comparison with coarse radars, fewer echoes and one look a drive: every method takes it, and each run has another
/// seed.
#[test]
fn the_third_road_is_compared_and_its_seeds_change() {
    let dir = tempfile::tempdir().unwrap();
    let write = |from: &str, to: &str, changes: &[(&str, &str)]| {
        let mut text = fs::read_to_string(root().join("scenes").join(from)).unwrap();
        for (old, new) in changes {
            assert!(text.contains(old), "{from}: {old}");
            text = text.replace(old, new);
        }
        fs::write(dir.path().join(to), text).unwrap();
    };
    write("lane/uwb9_scan.toml", "uwb9_scan.toml", &[]);
    write("road/road_compare_truck.toml", "road.toml", &[("length_m = 320", "length_m = 110")]);
    // A quarter of the band, the samples and the chirps.
    let coarse = [
        ("bandwidth_hz = 2.46e9", "bandwidth_hz = 0.615e9"),
        ("sample_rate_hz = 62.5e6", "sample_rate_hz = 15.625e6"),
        ("samples = 2048", "samples = 512"),
        ("chirps = 512", "chirps = 128"),
        ("doppler_fft = 1024", "doppler_fft = 128"),
    ];
    write("lane/compare_front.toml", "compare_front.toml", &coarse);
    let small = [
        ("../road/road_compare_truck.toml", "road.toml"),
        ("bounces = 2", "bounces = 1"),
        ("rays = 20_000", "rays = 200"),
        ("facets = 4_000", "facets = 200"),
        ("plate_class = \"plate\"", "plate_class = \"plate\"\nquiet_scans = 40"),
        ("map_frames = 20", "map_frames = 2"),
        ("[\"clear\", \"night\", \"fog\", \"glare\"]", "[\"clear\"]"),
    ];
    write("lane/compare_truck.toml", "truck.toml", &small);
    let path = dir.path().join("truck.toml");
    let out = dir.path().join("out");
    let args = ["lane", "compare", path.to_str().unwrap(), "-o", out.to_str().unwrap(), "--json"];
    let o = catseye(&[&args[..], &["--seed", "5", "--runs", "2", "--frames", "1"]].concat());
    assert!(o.status.success(), "{}", self::text(&o.stderr));
    let report: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    let table = report["notes"][0].as_str().unwrap();
    assert!(!table.contains("cannot") && table.lines().count() > 8, "{table}");
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["seed"], 5);
    // A receiver of satellites has noise of its own in each run.
    let looks = fs::read_to_string(out.join("1_hd-map/estimates.jsonl")).unwrap();
    let estimates: Vec<serde_json::Value> = looks
        .lines()
        .map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap()["estimate"]["offset_m"].clone())
        .collect();
    assert!(
        estimates.len() == 2 && estimates[0].is_object() && estimates[0] != estimates[1],
        "{estimates:?}"
    );
}
