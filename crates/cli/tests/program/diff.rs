//! `catseye diff`: alike, within a tolerance, beyond it with the place named, other kinds, damage.

use crate::common::{catseye, refused, text};
use catseye::formats::npy;
use num_complex::Complex32;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// What the program says of two results that are alike.
fn alike(dir: &Path, args: &[&str]) {
    let out = catseye(dir, &[&["diff"], args].concat());
    let said = text(&out.stdout);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {said}{}", text(&out.stderr));
    assert!(said.starts_with("equal (kind '"), "{said}");
}

/// What the program finds where two results differ: exit code 1, a table that says all of `parts`, and the object of `--json`.
fn differs(dir: &Path, args: &[&str], parts: &[&str]) -> Value {
    let out = catseye(dir, &[&["diff"], args].concat());
    let (said, complaint) = (text(&out.stdout), text(&out.stderr));
    assert_eq!(out.status.code(), Some(1), "{args:?}: {said}{complaint}");
    assert!(complaint.starts_with("error: the results differ"), "{complaint}");
    for p in parts {
        assert!(said.contains(p), "{args:?}: '{p}' is not in: {said}");
    }
    let out = catseye(dir, &[&["diff", "--json"], args].concat());
    assert_eq!(out.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["alike"], false);
    report
}

fn what(report: &Value) -> Vec<&str> {
    report["differences"].as_array().unwrap().iter().map(|d| d["what"].as_str().unwrap()).collect()
}

fn done(dir: &Path, args: &[&str]) {
    let out = catseye(dir, args);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
}

/// Writes `to` as `from` is, with one text in place of another.
fn edited(dir: &Path, from: &str, to: &str, old: &str, new: &str) {
    let content = fs::read_to_string(dir.join(from)).unwrap();
    assert!(content.contains(old), "{from} has no {old}");
    fs::write(dir.join(to), content.replacen(old, new, 1)).unwrap();
}

fn copied(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for e in fs::read_dir(from).unwrap() {
        let path = e.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copied(&path, &target);
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}

#[test]
fn tables_of_cross_sections() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let plate = "plate:width_m=0.1,height_m=0.1";
    done(d, &["rcs", plate, "--azimuth-deg", "-2:2:1", "-o", "a.csv", "--device", "cpu"]);
    alike(d, &["a.csv", "a.csv"]);
    edited(d, "a.csv", "near.csv", "-2,0,-0.182812", "-2,0,-0.1");
    alike(d, &["a.csv", "near.csv"]);
    differs(d, &["a.csv", "near.csv", "--tolerance-db", "0.05"], &["vv_dbsm", "azimuth -2 deg", "0.05 dB"]);
    edited(d, "a.csv", "far.csv", "-2,0,-0.182812", "-2,0,0.1");
    let report = differs(d, &["a.csv", "far.csv"], &["vv_dbsm", "line 13 (azimuth -2 deg, elevation 0 deg)"]);
    let found = &report["differences"][0];
    assert!((found["apart"].as_f64().unwrap() - 0.282812).abs() < 1e-9, "{found}");
    assert_eq!((found["file"].as_str(), found["places"].as_u64()), (Some("a.csv"), Some(1)));
    // Levels that do not count, until they do; NaN counts everywhere.
    edited(d, "a.csv", "deep.csv", "-2,0,-0.182812,-inf", "-2,0,-0.182812,-70");
    alike(d, &["a.csv", "deep.csv"]);
    differs(d, &["a.csv", "deep.csv", "--above-db", "inf"], &["vh_dbsm", "-inf"]);
    edited(d, "a.csv", "nan.csv", "-2,0,-0.182812", "-2,0,nan");
    alike(d, &["nan.csv", "nan.csv"]);
    differs(d, &["nan.csv", "a.csv"], &["vv_dbsm", "NaN"]);
    // A row less, and phases where they are asked for.
    let rows = fs::read_to_string(d.join("a.csv")).unwrap();
    fs::write(d.join("short.csv"), rows.trim_end().rsplit_once('\n').unwrap().0).unwrap();
    assert_eq!(what(&differs(d, &["a.csv", "short.csv"], &["azimuth 2 deg"])), ["missing in B"]);
    assert_eq!(what(&differs(d, &["short.csv", "a.csv"], &["azimuth 2 deg"])), ["extra in B"]);
    edited(d, "a.csv", "turned.csv", "0,-2.5684435330257713", "0,2.5684435330257713");
    alike(d, &["a.csv", "turned.csv"]);
    differs(d, &["a.csv", "turned.csv", "--phase-deg", "5"], &["vv phase", "180 deg"]);

    refused(d, &["diff", "a.csv", "gone.csv"], &["gone.csv", "no such file"]);
    refused(
        d,
        &["diff", "a.csv", "a.csv", "--tolerance-db", "-1"],
        &["tolerance_db = -1", "allowed: 0 or more"],
    );
    edited(d, "a.csv", "broken.csv", "-2,0,-0.182812", "-2,0,none");
    refused(d, &["diff", "a.csv", "broken.csv"], &["broken.csv:13", "vv_dbsm", "not a number"]);
    fs::write(d.join("x.txt"), "x").unwrap();
    refused(d, &["diff", "a.csv", "x.txt"], &["x.txt", "allowed: a folder"]);
}

#[test]
fn arrays() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let cube: Vec<Complex32> = (0..24).map(|i| Complex32::new(i as f32, -1.0)).collect();
    npy::write(d.join("a.npy"), &[2, 3, 4], &cube).unwrap();
    let with = |name: &str, at: usize, z: Complex32| {
        let mut other = cube.clone();
        other[at] = z;
        npy::write(d.join(name), &[2, 3, 4], &other).unwrap();
    };
    with("b.npy", 18, Complex32::new(18.01, -1.0));
    alike(d, &["a.npy", "a.npy"]);
    alike(d, &["a.npy", "b.npy"]);
    let parts = ["largest difference / peak", "index [1, 1, 2]", "18.01"];
    differs(d, &["a.npy", "b.npy", "--relative", "1e-4"], &parts);
    with("c.npy", 18, Complex32::new(22.0, -1.0));
    let report = differs(d, &["a.npy", "c.npy"], &["relative L2", "index [1, 1, 2]"]);
    assert_eq!(what(&report), ["largest difference / peak", "relative L2"]);
    with("nan.npy", 5, Complex32::new(f32::NAN, 0.0));
    alike(d, &["nan.npy", "nan.npy"]);
    differs(d, &["a.npy", "nan.npy"], &["not finite", "index [0, 1, 1]"]);
    npy::write(d.join("s.npy"), &[4, 3, 2], &cube).unwrap();
    differs(d, &["a.npy", "s.npy"], &["shape", "[2,3,4]", "[4,3,2]"]);
    // Classes have to be equal.
    npy::write(d.join("m.npy"), &[3], &[1u8, 2, 3]).unwrap();
    npy::write(d.join("n.npy"), &[3], &[1u8, 2, 4]).unwrap();
    differs(d, &["m.npy", "n.npy", "--relative", "0.5"], &["values", "index [2]"]);
    differs(d, &["m.npy", "a.npy"], &["shape"]);
    let bytes = fs::read(d.join("a.npy")).unwrap();
    fs::write(d.join("cut.npy"), &bytes[..bytes.len() - 3]).unwrap();
    refused(d, &["diff", "a.npy", "cut.npy"], &["cut.npy", "192 bytes, the file holds 189"]);
}

const POINTS: &str = "range_m,range_rate_mps,azimuth_deg,power_dbm,snr_db,class\n\
    10,1,0,-60,20,car\n10.2,1,0,-61,19,car\n30,-2,10,-80,,post\n";

#[test]
fn points() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::write(d.join("a.csv"), POINTS).unwrap();
    alike(d, &["a.csv", "a.csv"]);
    // In another order.
    let mut lines: Vec<&str> = POINTS.lines().collect();
    lines.swap(1, 3);
    fs::write(d.join("b.csv"), lines.join("\n")).unwrap();
    alike(d, &["a.csv", "b.csv"]);
    edited(d, "b.csv", "c.csv", "10.2,1,0,-61", "10.205,1,0,-61.05");
    alike(d, &["a.csv", "c.csv"]);
    edited(d, "b.csv", "c.csv", "10.2,1,0,-61", "10.22,1,0,-61.2");
    let report = differs(d, &["a.csv", "c.csv"], &["range_m", "power_dbm", "line 3", "0.2 dB"]);
    assert_eq!(what(&report), ["power_dbm", "range_m"]);
    edited(d, "b.csv", "c.csv", "post", "truck");
    assert_eq!(what(&differs(d, &["a.csv", "c.csv"], &["post", "truck"])), ["class"]);
    // Not the same point any more, unless that is allowed.
    edited(d, "b.csv", "c.csv", "30,-2,10", "31,-2,10");
    let report = differs(d, &["a.csv", "c.csv"], &["30.000 m, -2.000 m/s, 10.000 deg", "31.000 m"]);
    assert_eq!(what(&report), ["extra in B", "missing in B"]);
    alike(d, &["a.csv", "c.csv", "--match-m", "1.5", "--tolerance-m", "1"]);
    fs::write(d.join("c.csv"), lines[..3].join("\n")).unwrap();
    assert_eq!(what(&differs(d, &["a.csv", "c.csv"], &["missing in B"])), ["missing in B", "rows"]);
    refused(d, &["diff", "a.csv", "c.csv", "--match-m", "inf"], &["match_m", "finite"]);
    fs::write(d.join("c.csv"), POINTS.replace(",snr_db", "")).unwrap();
    refused(d, &["diff", "a.csv", "c.csv"], &["c.csv:2", "wrong number of values"]);
}

#[test]
fn runs() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::write(
        d.join("s.toml"),
        "name = 's'\nradar = 'demo77'\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\n[frames]\ncount = 2\n\
         interval_s = 0.05\n[ego]\nspeed_mps = 5\n[output]\nplots = false\n",
    )
    .unwrap();
    done(d, &["simulate", "s.toml", "-o", "a", "--device", "cpu", "--quiet"]);
    alike(d, &["a", "a"]);
    alike(d, &["a/frame_000000", "a/frame_000000"]);
    let fresh = || {
        let _ = fs::remove_dir_all(d.join("b"));
        copied(&d.join("a"), &d.join("b"));
    };
    // Times and versions are no figures, counts are.
    fresh();
    edited(d, "a/manifest.json", "b/manifest.json", "\"trace_s\": ", "\"trace_s\": 9");
    edited(d, "b/manifest.json", "b/manifest.json", "\"catseye\": \"0", "\"catseye\": \"7");
    alike(d, &["a", "b"]);
    edited(d, "a/manifest.json", "b/manifest.json", "\"returns\": ", "\"returns\": 9");
    assert_eq!(what(&differs(d, &["a", "b"], &["manifest.json", "frames[0].returns"])), ["frames[].returns"]);
    // Each file by its kind.
    fresh();
    let adc = d.join("b/frame_000001/adc.npy");
    let mut cube = npy::read::<Complex32>(&adc).unwrap();
    cube.data[5] *= 1.0 + 1e-7;
    npy::write(&adc, &cube.shape, &cube.data).unwrap();
    alike(d, &["a", "b"]);
    cube.data[5] *= 40.0;
    npy::write(&adc, &cube.shape, &cube.data).unwrap();
    fs::remove_file(d.join("b/frame_000000/points.csv")).unwrap();
    let truth = "b/frame_000001/truth.json";
    edited(d, truth, truth, "\"time_s\": 0.05", "\"time_s\": 0.06");
    let parts = ["frame_000001/adc.npy", "index [0, 0, 5]", "frame_000000/points.csv", "there", "time_s"];
    let report = differs(d, &["a", "b"], &parts);
    assert!(what(&report).contains(&"file"), "{report}");
    let few = catseye(d, &["diff", "a", "b", "--max-rows", "1"]);
    assert!(text(&few.stdout).contains("… and "), "{}", text(&few.stdout));

    refused(d, &["diff", "a", "s.toml"], &["s.toml"]);
    refused(d, &["diff", "a", "a/frame_000000/adc.npy"], &["'array'", "a is of the kind 'run'", "one kind"]);
    fs::create_dir(d.join("empty")).unwrap();
    refused(d, &["diff", "a", "empty"], &["empty: is not a result"]);
    fs::write(d.join(truth), "{").unwrap();
    refused(d, &["diff", "a", "b"], &["truth.json", "damaged"]);
}

#[test]
fn datasets() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let recipes = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/recipes");
    let recipe = fs::read_to_string(recipes.join("tiny.toml")).unwrap();
    let recipe = recipe.replace("format = \"zarr\"", "format = \"frames\"").replace("\"zstd", "\"none\" #");
    assert!(recipe.contains("format = \"frames\""), "{recipe}");
    fs::write(d.join("r.toml"), &recipe).unwrap();
    fs::copy(recipes.join("tiny_radar.toml"), d.join("tiny_radar.toml")).unwrap();
    done(d, &["dataset", "r.toml", "-o", "a", "--device", "cpu", "--quiet"]);
    alike(d, &["a", "a"]);
    copied(&d.join("a"), &d.join("b"));
    alike(d, &["a", "b"]);
    fs::remove_file(d.join("b/shards/000001.json")).unwrap();
    assert_eq!(what(&differs(d, &["a", "b"], &["frame_000002", "its shard"])), ["frame", "frame"]);
    let csv = d.join("b/frame_000000/points.csv");
    fs::write(&csv, fs::read_to_string(&csv).unwrap() + "\n").unwrap();
    refused(d, &["diff", "a", "b"], &["frame_000000/points.csv", "bytes"]);
    // Points half a decibel stronger.
    let stronger = recipe.replace("rcs_dbsm = { uniform = [0, 10] }", "rcs_dbsm = { uniform = [0.5, 10.5] }");
    assert_ne!(stronger, recipe);
    fs::write(d.join("r.toml"), stronger).unwrap();
    done(d, &["dataset", "r.toml", "-o", "c", "--device", "cpu", "--quiet"]);
    let report = differs(d, &["a", "c", "--max-rows", "200"], &["/adc", "/returns", "relative L2"]);
    assert!(report["files"].as_u64().unwrap() > 12 * 5, "{report}");
    alike(d, &["a", "a", "--tolerance-db", "0", "--relative", "0", "--tolerance-m", "0", "--match-m", "0"]);
}

#[test]
fn studies() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    done(d, &["init", "study", "-o", "s.toml"]);
    edited(d, "s.toml", "s.toml", "step = 0.5", "step = 5");
    done(d, &["study", "s.toml", "-o", "a", "--device", "cpu", "--quiet"]);
    alike(d, &["a", "a"]);
    alike(d, &["a/my-study.csv", "a/my-study.csv"]);
    copied(&d.join("a"), &d.join("b"));
    let table = "b/my-study.csv";
    edited(d, table, table, "5,H 4 mm,-2.1", "5,H 4 mm,-2.2");
    edited(d, "b/manifest.json", "b/manifest.json", "\"ours\": 5.6", "\"ours\": 5.7");
    alike(d, &["a", "b", "--tolerance-db", "0.11"]);
    edited(d, table, table, "5,H 4 mm,-2.2", "5,H 4 mm,-2.5");
    edited(d, "b/manifest.json", "b/manifest.json", "\"ours\": 5.7", "\"ours\": 5.9");
    let report = differs(d, &["a", "b"], &["rcs_dbsm", "line 8", "studies[0].facts[0].ours"]);
    assert_eq!(report["kind"], "study");
    assert_eq!(what(&report), ["studies[].facts[].ours", "rcs_dbsm"]);
    refused(d, &["diff", "a/my-study.csv", "a/manifest.json"], &["'study table'", "one kind"]);
}

/// What a pull request shows: the same verdict as Markdown, with distances of what is alike too, and both in one picture.
#[test]
fn markdown_and_pictures() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let plate = "plate:width_m=0.1,height_m=0.1";
    done(d, &["rcs", plate, "--azimuth-deg", "-2:2:1", "-o", "a.csv", "--device", "cpu"]);
    let markdown = |args: &[&str], code: i32| {
        let out = catseye(d, &[&["diff", "--markdown"], args].concat());
        assert_eq!(out.status.code(), Some(code), "{args:?}: {}", text(&out.stderr));
        text(&out.stdout)
    };
    let png = |name: &str| fs::read(d.join(name)).unwrap().starts_with(b"\x89PNG");
    let said = markdown(&["a.csv", "a.csv", "--plot", "same.png"], 0);
    assert!(said.starts_with("Within the tolerance: "), "{said}");
    assert!(said.contains("| vv\\_dbsm | 5 | 0 dB | 0 dB | 0.1 dB | 0 |  |"), "{said}");
    assert!(png("same.png"));
    // One angle differs by 0.282812 dB, within a wide tolerance and outside the usual one.
    edited(d, "a.csv", "far.csv", "-2,0,-0.182812", "-2,0,0.1");
    let row = "| vv\\_dbsm | 5 | 0.2828 dB | 0 dB | 0.5 dB | 0 | line 13 (azimuth -2 deg, elevation 0 deg) |";
    let said = markdown(&["a.csv", "far.csv", "--tolerance-db", "0.5"], 0);
    assert!(said.contains(row), "{said}");
    let said = markdown(&["a.csv", "far.csv", "--plot", "far.png"], 1);
    assert!(said.starts_with("**Outside the tolerance**: "), "{said}");
    assert!(said.contains("| 0.2828 dB | 0 dB | 0.1 dB | 1 | line 13"), "{said}");
    assert!(said.contains("| a.csv | vv\\_dbsm | 1 | -0.1828 | 0.1 | 0.2828 dB |"), "{said}");
    assert!(png("far.png") && fs::read(d.join("far.png")).unwrap() != fs::read(d.join("same.png")).unwrap());
    // NaN on one side is endlessly far.
    edited(d, "a.csv", "nan.csv", "-2,0,-0.182812", "-2,0,nan");
    assert!(markdown(&["a.csv", "nan.csv"], 1).contains("| vv\\_dbsm | 5 | not finite | 0 dB |"));
    // Another grid has no row in common: nothing passes unseen.
    done(d, &["rcs", plate, "--azimuth-deg", "-1.5:1.5:1", "-o", "grid.csv", "--device", "cpu"]);
    let said = markdown(&["a.csv", "grid.csv"], 1);
    assert!(said.contains("missing in B") && said.contains("extra in B"), "{said}");
    // The object of --json has the same figures.
    let report = differs(d, &["a.csv", "far.csv"], &[]);
    let vv = &report["quantities"][0];
    assert_eq!(
        (vv["what"].as_str(), vv["places"].as_u64(), vv["beyond"].as_u64()),
        (Some("vv_dbsm"), Some(5), Some(1))
    );
    assert!((vv["largest"].as_f64().unwrap() - 0.282812).abs() < 1e-9 && vv["median"] == 0.0, "{vv}");
    // Points, whose distances are those of the matched ones; and names that Markdown would read as its own.
    fs::write(d.join("p|<b>.csv"), POINTS).unwrap();
    fs::write(d.join("q.csv"), POINTS.replace("10.2,1,0,-61", "10.22,1,0,-61.2")).unwrap();
    let said = markdown(&["p|<b>.csv", "q.csv", "--plot", "points.png"], 1);
    assert!(said.contains("A is p\\|&lt;b>.csv, B is q.csv."), "{said}");
    assert!(said.contains("| power\\_dbm | 3 | 0.2 dB | 0 dB | 0.1 dB | 1 | line 3 |"), "{said}");
    assert!(png("points.png"));

    let head = fs::read_to_string(d.join("a.csv")).unwrap();
    let head: Vec<&str> = head.lines().take_while(|l| !l.starts_with("7")).collect();
    fs::write(d.join("empty.csv"), head.join("\n") + "\n").unwrap();
    refused(d, &["diff", "a.csv", "empty.csv", "--markdown"], &["empty.csv", "no rows"]);
    refused(d, &["diff", "a.csv", "a.csv", "--markdown", "--json"], &["--markdown", "--json or --markdown"]);
    refused(d, &["diff", "a.csv", "a.csv", "--plot", "far.png"], &["far.png", "--force"]);
    refused(d, &["diff", "a.csv", "a.csv", "--plot", "a.csv"], &["a.csv", "png"]);
    done(d, &["rcs", plate, "-o", "one.csv", "--device", "cpu"]);
    refused(d, &["diff", "one.csv", "one.csv", "--plot", "one.png"], &["one.csv", "single direction"]);
}
