//! The command line as a user meets it: exit codes, one-line errors, files, resuming.

use crate::common::{catseye, done, refused, text};
use catseye::road::reflector::{Reflector, Value, kinds};
use catseye::scene::radar_toml;
use std::path::Path;
use std::process::Command;

const SMALL: &str = r#"
name = "two points"
seed = 7
radar = "radar.toml"
[[point]]
position_m = [20, 3, 0.5]
velocity_mps = [-5, 0, 0]
rcs_dbsm = 10
class = "corner"
[[point]]
position_m = [35, -4, 0.5]
velocity_mps = [6, 0, 0]
rcs_dbsm = 10
class = "corner"
[frames]
count = 2
interval_s = 0.1
[output]
plots = false
"#;

fn small_radar() -> String {
    include_str!("../../../../scenes/presets/demo77.toml").replace("chirps = 128", "chirps = 32")
}

fn scenario(dir: &Path) {
    std::fs::write(dir.join("radar.toml"), small_radar()).unwrap();
    std::fs::write(dir.join("s.toml"), SMALL).unwrap();
}

#[test]
fn wrong_input_is_one_line_and_code_2() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    refused(d, &["rcs", "trihedra"], &["trihedra", "did you mean 'trihedral'"]);
    refused(d, &["rcs", "plate:width_m=-1"], &["plate:width_m", "-1"]);
    refused(d, &["rcs", "sphere", "--azimuth-deg", "0:1e9:1e-3"], &["--azimuth-deg", "too many"]);
    refused(d, &["rcs", "sphere", "--frequency-hz", "0"], &["--frequency-hz"]);
    refused(d, &["rcs", "sphere", "--range-m", "0.001"], &["--range-m"]);
    refused(d, &["rcs", "sphere", "--accuracy-db", "0"], &["--accuracy-db", "1e-4..=3"]);
    refused(d, &["rcs", "missing.glb"], &["missing.glb", "no such file"]);
    refused(d, &["rcs", "sphere", "--device", "voodoo2"], &["device", "voodoo2"]);
    refused(d, &["rcs", "sphere", "--nonsense"], &["--nonsense"]);
    refused(d, &["rcs", "sphere:material=unobtainium"], &["unobtainium", "aluminium"]);
    let e = refused(
        d,
        &["rcs", "a.glb", "--default-material", "unobtainium"],
        &["--default-material", "aluminium"],
    );
    assert!(!e.contains("give --default-material"), "{e}");
    refused(d, &["rcs", "a.glb", "--material", "Stahl=steal"], &["--material", "did you mean 'steel'"]);
    for frames in ["-1", "0"] {
        refused(
            d,
            &["simulate", "s.toml", "--frames", frames],
            &["--frames", frames, "allowed: a whole number, 1 or more"],
        );
    }
    refused(d, &["simulate", "s.toml", "--seed", "-3"], &["--seed = '-3'", "0 or more"]);
    refused(d, &["simulate", "missing.toml", "-o", "x"], &["missing.toml"]);
    refused(d, &["init", "novel"], &["novel"]);
    std::fs::write(d.join("s.toml"), "name = \"x\"\nradar = \"front77\"\n[frames]\ncuont = 3\n").unwrap();
    refused(d, &["simulate", "s.toml", "-o", "x"], &["s.toml:4", "cuont", "count"]);
    std::fs::write(d.join("bad.npy"), b"not an array").unwrap();
    refused(d, &["process", "bad.npy", "--radar", "front77", "-o", "x"], &["bad.npy"]);
    assert!(!d.join("x").exists());
    let left: Vec<_> = std::fs::read_dir(d).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "nothing half-written: {left:?}");
}

#[test]
fn a_table_is_written_once_and_reads_back() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let args = [
        "rcs",
        "plate:width_m=0.05,height_m=0.05",
        "--azimuth-deg",
        "-10:10:1",
        "-o",
        "p.csv",
        "--plot",
        "p.png",
    ];
    done(d, &args);
    let table = std::fs::read_to_string(d.join("p.csv")).unwrap();
    let rows: Vec<&str> = table.lines().filter(|l| !l.starts_with('#')).collect();
    assert_eq!(rows.len(), 22);
    assert!(
        rows[0].starts_with("frequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm,vv_re_m")
    );
    // 4 pi (A / lambda)^2 on boresight.
    let middle: Vec<f64> = rows[11].split(',').map(|x| x.parse().unwrap()).collect();
    let lambda = 299_792_458.0 / 77e9;
    let hand = 10.0 * (4.0 * std::f64::consts::PI * (0.05f64 * 0.05 / lambda).powi(2)).log10();
    assert_eq!(middle[1], 0.0);
    assert!((middle[3] - hand).abs() < 0.01, "{} {hand}", middle[3]);
    assert!(table.contains("# convention: every") && table.contains("last VV"));
    refused(d, &args, &["p.csv", "--force"]);
    done(d, &["plot", "p.csv", "-o", "again.png"]);
    let json = done(d, &["rcs", "plate", "--json", "--azimuth-deg", "-3,4"]);
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["rows"].as_array().unwrap().len(), 2);
    assert_eq!(value["rows"][0]["azimuth_deg"], -3.0);
}

#[test]
fn a_plot_has_every_polarisation_and_frequency_in_three_formats() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let plot = |name: &str| {
        let target = "dihedral:width_m=0.05,height_m=0.05";
        let sweep = ["--azimuth-deg=-30:30:1", "--frequency-hz", "76e9,81e9", "--polarisation", "circular"];
        let turned = ["--roll-deg", "20", "-o", "p.csv", "--force", "--plot", name];
        done(d, &[&["rcs", target][..], &sweep, &turned].concat());
        std::fs::read(d.join(name)).unwrap()
    };
    assert!(plot("p.png").starts_with(b"\x89PNG"));
    assert!(plot("p.pdf").starts_with(b"%PDF-"));
    let svg = String::from_utf8(plot("p.svg")).unwrap();
    for name in ["76 GHz", "81 GHz", "VV", "HH", "VH", "HV", "RR", "RL", "LR", "LL"] {
        assert!(svg.contains(&format!("aria-label=\"{name}\"")), "{name}");
    }
    // The table has the same polarisations.
    done(d, &["plot", "p.csv", "-o", "again.svg"]);
    assert!(std::fs::read_to_string(d.join("again.svg")).unwrap().contains("\"LL\""));
    refused(
        d,
        &["rcs", "plate", "--azimuth-deg", "0:9:1", "--plot", "p.jpg"],
        &["p.jpg", ".png, .svg, .pdf"],
    );
}

#[test]
fn a_reflector_file_has_the_same_cross_section() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    done(d, &["reflector", "trihedral", "--leg-m", "0.06", "-o", "t.glb"]);
    assert_eq!(&std::fs::read(d.join("t.png")).unwrap()[1..4], b"PNG");
    refused(d, &["reflector", "trihedral", "--leg-m", "0.06", "-o", "t.glb"], &["t.glb", "--force"]);
    let level = |target: &str| -> f64 {
        let json = done(d, &["rcs", target, "--elevation-deg", "35.2644", "--json"]);
        let v: serde_json::Value = serde_json::from_str(&json).unwrap();
        v["rows"][0]["vv_dbsm"].as_f64().unwrap()
    };
    assert!((level("t.glb") - level("trihedral:leg_m=0.06")).abs() < 0.01);
}

#[test]
fn a_reflector_comes_back_from_stl_and_obj() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let level = |target: &[&str]| -> f64 {
        let look = ["--elevation-deg", "30", "--azimuth-deg", "4", "--json"];
        let args = [&["rcs"], target, &look, &["--accuracy-db", "0.02"]].concat();
        let v: serde_json::Value = serde_json::from_str(&done(d, &args)).unwrap();
        v["rows"][0]["vv_dbsm"].as_f64().unwrap()
    };
    for (kind, unit) in [
        ("trihedral:leg_m=0.06", None),
        ("type1:width_m=0.16,height_m=0.01", None),
        ("sphere:radius_m=0.02", Some("in")),
    ] {
        let expected = level(&[kind]);
        for (file, material) in [("r.stl", &["--default-material", "pec"][..]), ("r.obj", &[])] {
            let mut args = vec!["reflector", kind, "-o", file, "--force"];
            args.extend(unit.iter().flat_map(|u| ["--unit", u]));
            let out = catseye(d, &args);
            assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
            let unit = unit.unwrap_or("mm");
            let said = text(&out.stderr);
            assert!(said.contains(&format!("{file} is in {unit} with x forward, y left and z up")), "{said}");
            let back = level(&[&[file, "--unit", unit, "--up", "z"], material].concat());
            // STL has no normals: of a sphere it keeps the facets.
            let tolerance = if kind.starts_with("sphere") && file == "r.stl" { 0.05 } else { 0.01 };
            assert!((back - expected).abs() < tolerance, "{kind} as {file}: {back} and {expected}");
        }
    }
    assert!(!std::fs::read(d.join("r.stl")).unwrap().starts_with(b"solid"));
    refused(d, &["reflector", "plate", "-o", "p.glb", "--unit", "mm"], &["--unit = mm", "glTF is in metres"]);
    refused(d, &["reflector", "plate", "-o", "p.stl", "--unit", "yd"], &["unit = yd", "mm"]);
    refused(d, &["reflector", "point", "-o", "p.stl"], &["p.stl", "no surface", ".glb"]);
    // What the files do not state is asked for, all of it at once.
    let ask = [
        "r.stl: states no unit, no up axis and no material; add --unit mm",
        "--up z",
        "--default-material pec",
    ];
    refused(d, &["rcs", "r.stl"], &ask);
    refused(
        d,
        &["rcs", "r.stl", "--unit", "mm", "--default-material", "pec"],
        &["states no up axis; add --up z"],
    );
    refused(d, &["rcs", "r.obj", "--up", "z"], &["r.obj: states no unit; add --unit mm (m, cm, in, ft)"]);
}

/// The picture of the same body in another format is kept, and nothing is half written where one that was asked for is in the way.
#[test]
fn a_reflector_in_two_formats_has_one_picture() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let made = |args: &[&str]| {
        let done = catseye(d, args);
        assert_eq!(done.status.code(), Some(0), "{args:?}: {}", text(&done.stderr));
        text(&done.stderr)
    };
    made(&["reflector", "trihedral:leg_m=0.1", "-o", "c.stl"]);
    let picture = std::fs::read(d.join("c.png")).unwrap();
    let said = made(&["reflector", "trihedral:leg_m=0.2", "-o", "c.glb"]);
    assert!(said.contains("c.png exists and is left unchanged"), "{said}");
    assert_eq!(std::fs::read(d.join("c.png")).unwrap(), picture);
    refused(
        d,
        &["reflector", "trihedral", "-o", "other.glb", "--preview", "c.png"],
        &["c.png", "exists already", "--force"],
    );
    assert!(!d.join("other.glb").exists());
}

#[test]
fn a_file_name_is_no_kind_of_reflector() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    std::fs::write(d.join("part.step"), "ISO-10303-21;").unwrap();
    std::fs::write(d.join("bare"), "x").unwrap();
    refused(
        d,
        &["rcs", "part.step"],
        &["part.step: meshes of this file type cannot be read", ".glb, .gltf, .stl, .obj"],
    );
    refused(d, &["rcs", "bare"], &["bare: meshes of this file type cannot be read"]);
    for name in ["nosuch.glb", "nosuch.stl", "nosuch.step", "folder/nosuch"] {
        refused(d, &["rcs", name], &[&format!("{name}: no such file")]);
    }
    refused(d, &["rcs", "typ1:width_m=0.16"], &["unknown kind of reflector", "did you mean 'type1'"]);
}

#[test]
fn frames_points_and_signs() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    assert!(done(d, &["simulate", "s.toml", "--dry-run"]).contains("2 frames"));
    done(d, &["simulate", "s.toml", "-o", "out"]);
    refused(d, &["simulate", "s.toml", "-o", "out"], &["out", "--force"]);
    for file in ["adc.npy", "range_doppler.npy", "points.csv", "returns.csv", "truth.json"] {
        assert!(d.join("out/frame_000001").join(file).is_file(), "{file}");
    }
    assert!(!d.join(".out.unfinished").exists());
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(d.join("out/manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["frames"].as_array().unwrap().len(), 2);
    assert_eq!(manifest["seed"], 7);
    assert_eq!(manifest["checksums"]["frame_000000/adc.npy"].as_str().unwrap().len(), 64);

    // One approaches on the left, one recedes on the right.
    let points = std::fs::read_to_string(d.join("out/frame_000000/points.csv")).unwrap();
    let rows: Vec<Vec<&str>> = points.lines().skip(1).map(|l| l.split(',').collect()).collect();
    let near = |x: f64| {
        rows.iter()
            .map(|r| {
                (
                    r[1].parse::<f64>().unwrap(),
                    r[2].parse::<f64>().unwrap(),
                    r[4].parse::<f64>().unwrap(),
                    r[11],
                )
            })
            .find(|p| (p.2 - (x - 3.6)).abs() < 1.0)
            .unwrap_or_else(|| panic!("no point near {x}: {points}"))
    };
    let (approaching, receding) = (near(20.0), near(35.0));
    assert!(approaching.0 < -4.0 && approaching.1 > 5.0 && approaching.3 == "corner", "{approaching:?}");
    assert!(receding.0 > 5.0 && receding.1 < -4.0 && receding.3 == "corner", "{receding:?}");

    // The cube alone gives the same map.
    done(d, &["process", "out/frame_000000/adc.npy", "--radar", "radar.toml", "-o", "again"]);
    let same = |f: &str| std::fs::read(d.join(f)).unwrap();
    assert!(same("again/range_doppler.npy") == same("out/frame_000000/range_doppler.npy"));
    refused(
        d,
        &["process", "out/frame_000000/adc.npy", "--radar", "front77", "-o", "no"],
        &["adc.npy", "shape", "[32, 12, 256]"],
    );
}

/// Keys of `[output]` that are off unless they are asked for: the threshold beside the map, and the scene once a run.
#[test]
fn thresholds_and_the_scene_are_written_on_request() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    let text = std::fs::read_to_string(d.join("s.toml")).unwrap();
    let object =
        "[[object]]\nreflector = \"type1\"\nposition_m = [12, 1, 0]\nvelocity_mps = [-2, 0, 0]\n[frames]";
    let asked = text
        .replace(
            "plots = false",
            "plots = false\ncfar_threshold = true\nangle_spectra = true\nreturn_places = true\nscene = true",
        )
        .replace("[frames]", object);
    std::fs::write(d.join("asked.toml"), asked).unwrap();
    done(d, &["simulate", "s.toml", "-o", "plain"]);
    assert!(!d.join("plain/scene.glb").exists() && !d.join("plain/frame_000000/cfar_threshold.npy").exists());
    done(d, &["simulate", "asked.toml", "-o", "out"]);
    let read = |name: &str| catseye::formats::npy::read_f32(d.join("out/frame_000000").join(name)).unwrap();
    let (map, level) = (read("range_doppler.npy"), read("cfar_threshold.npy"));
    assert_eq!(map.shape, level.shape);
    let above = map.data.iter().zip(&level.data).filter(|(p, t)| p > t).count();
    let rows = std::fs::read_to_string(d.join("out/frame_000000/points.csv")).unwrap().lines().count() - 1;
    assert!(rows > 0 && above >= rows && above < map.data.len() / 20, "{above} cells for {rows} points");
    // Each point stands where the spectrum of its cell is largest, to a step of the search.
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(d.join("out/manifest.json")).unwrap()).unwrap();
    let azimuth_deg: Vec<f64> = serde_json::from_value(manifest["axes"]["azimuth_deg"].clone()).unwrap();
    let spectra = read("angle_spectra.npy");
    let frame = d.join("out/frame_000000");
    let cells = catseye::formats::csv::Table::read(frame.join("angle_cells.csv")).unwrap();
    assert_eq!(spectra.shape, [cells.len(), 1, azimuth_deg.len()]);
    let points = catseye::formats::csv::Table::read(frame.join("points.csv")).unwrap();
    let column = |t: &catseye::formats::csv::Table, name: &str| t.numbers(name).unwrap();
    let (range_m, rate_mps) = (column(&cells, "range_m"), column(&cells, "range_rate_mps"));
    for ((range, rate), azimuth) in column(&points, "range_m")
        .iter()
        .zip(column(&points, "range_rate_mps"))
        .zip(column(&points, "azimuth_deg"))
    {
        let i = (0..cells.len())
            .find(|i| (range_m[*i] - range).abs() < 1e-9 && (rate_mps[*i] - rate).abs() < 1e-9);
        let row = &spectra.data[i.unwrap() * azimuth_deg.len()..][..azimuth_deg.len()];
        let top = (0..row.len()).max_by(|a, b| row[*a].total_cmp(&row[*b])).unwrap();
        let step = azimuth_deg[(top + 1).min(row.len() - 1)] - azimuth_deg[top.saturating_sub(1)];
        assert!((azimuth_deg[top] - azimuth).abs() < 0.5 * step, "{azimuth}: {}", azimuth_deg[top]);
    }
    let gridless = "angle = { method = \"esprit\", sources = 1 }\nazimuth_bins";
    std::fs::write(d.join("esprit.toml"), small_radar().replace("azimuth_bins", gridless)).unwrap();
    let text = std::fs::read_to_string(d.join("asked.toml")).unwrap().replace("radar.toml", "esprit.toml");
    std::fs::write(d.join("no.toml"), text).unwrap();
    refused(
        d,
        &["simulate", "no.toml", "-o", "no"],
        &["no.toml", "output.angle_spectra", "without a spectrum", "music"],
    );
    // A method that looks for sources has its own spectrum, with the same peak in the cell of each of its points.
    let music = "angle = { method = \"music\", sources = 1 }\nazimuth_bins";
    std::fs::write(d.join("music.toml"), small_radar().replace("azimuth_bins", music)).unwrap();
    let text = std::fs::read_to_string(d.join("asked.toml")).unwrap().replace("radar.toml", "music.toml");
    std::fs::write(d.join("m.toml"), text).unwrap();
    done(d, &["simulate", "m.toml", "-o", "m", "--frames", "1"]);
    let values = catseye::formats::npy::read_f32(d.join("m/frame_000000/angle_spectra.npy")).unwrap();
    // At least 1 by its meaning; single precision may round a value just below.
    assert!(!values.data.is_empty() && values.data.iter().all(|v| *v >= 1.0 - 1e-6));
    let m_points = catseye::formats::csv::Table::read(d.join("m/frame_000000/points.csv")).unwrap();
    let tops: Vec<f64> = values
        .data
        .chunks_exact(azimuth_deg.len())
        .map(|row| azimuth_deg[(0..row.len()).max_by(|a, b| row[*a].total_cmp(&row[*b])).unwrap()])
        .collect();
    for azimuth in column(&m_points, "azimuth_deg") {
        assert!(tops.iter().any(|top| (top - azimuth).abs() < 2.0), "{azimuth}: {tops:?}");
    }
    // The places of each echo make up its path, out from the radar and back to it.
    let places = read("return_places.npy");
    let returns = catseye::formats::csv::Table::read(frame.join("returns.csv")).unwrap();
    let (ranges, bounces) = (column(&returns, "range_m"), column(&returns, "bounces"));
    let [rows, most, 3] = places.shape[..] else { panic!("{:?}", places.shape) };
    assert_eq!((rows, most), (ranges.len(), bounces.iter().fold(0.0, |a: f64, b| a.max(*b)) as usize));
    for ((row, range), bounces) in places.data.chunks_exact(3 * most).zip(ranges).zip(bounces) {
        let (met, none) = row.split_at(3 * bounces as usize);
        let mut at = [0.0; 3];
        let mut length = 0.0;
        for place in met.chunks_exact(3).chain([&[0.0; 3][..]]) {
            let next = [0, 1, 2].map(|k| f64::from(place[k]));
            length += (0..3).map(|k| (next[k] - at[k]).powi(2)).sum::<f64>().sqrt();
            at = next;
        }
        // Places are in single precision.
        assert!((0.5 * length - range).abs() < 1e-5 * range && none.iter().all(|v| v.is_nan()), "{row:?}");
    }
    // It is the scene that the frames were traced in, and the manifest knows it.
    let scene = catseye::scene::gltf::import(&d.join("out/scene.glb"), &Default::default()).unwrap();
    let mut speeds: Vec<f64> = scene.objects.iter().map(|o| o.velocity_mps.x).collect();
    speeds.sort_by(f64::total_cmp);
    assert_eq!(speeds, [-5.0, -2.0, 6.0]);
    done(d, &["verify", "out"]);
}

#[test]
fn an_interrupted_run_goes_on_and_gives_the_same_bytes() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    done(d, &["simulate", "s.toml", "-o", "whole"]);
    // As a run leaves it that was killed in its second frame.
    done(d, &["simulate", "s.toml", "-o", "part"]);
    let bytes = |f: &str| std::fs::read(d.join(f)).unwrap();
    for file in ["frame_000000/adc.npy", "frame_000001/adc.npy", "frame_000001/points.csv"] {
        assert!(bytes(&format!("whole/{file}")) == bytes(&format!("part/{file}")), "{file}");
    }
    std::fs::remove_dir_all(d.join("part")).unwrap();
    // Killed while it runs, wherever that is; then the same command again.
    let mut child = Command::new(env!("CARGO_BIN_EXE_catseye"))
        .current_dir(d)
        .args(["simulate", "s.toml", "-o", "part", "--frames", "12", "--quiet"])
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let partial = d.join(".part.unfinished/result/frame_000001");
    while !partial.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let _ = child.kill();
    child.wait().unwrap();
    let json = done(d, &["simulate", "s.toml", "-o", "part", "--frames", "12", "--json", "--force"]);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len(), 12);
    for file in ["frame_000000/adc.npy", "frame_000001/points.csv"] {
        assert!(bytes(&format!("whole/{file}")) == bytes(&format!("part/{file}")), "{file}");
    }
}

/// A loss of power may leave files of finished frames empty; such a frame is made again, and the checksums are those of what was
/// made.
#[test]
fn a_finished_frame_that_changed_is_made_again() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    let run = ["simulate", "s.toml", "-o", "part", "--frames", "40", "--json"];
    done(d, &["simulate", "s.toml", "-o", "whole"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_catseye"))
        .current_dir(d)
        .args(run)
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // A note that is there may still be empty, so the one after the third frame's is waited for.
    let note = d.join(".part.unfinished/notes/frame_000003.json");
    while !note.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let _ = child.kill();
    child.wait().unwrap();
    let frames = d.join(".part.unfinished/result");
    std::fs::write(frames.join("frame_000000/adc.npy"), "").unwrap();
    std::fs::remove_file(frames.join("frame_000001/truth.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&done(d, &run)).unwrap();
    assert_eq!(report["repaired"], 2);
    assert!(report["resumed"].as_u64().unwrap() >= 1, "{report}");
    let bytes = |f: &str| std::fs::read(d.join(f)).unwrap();
    for file in ["frame_000000/adc.npy", "frame_000001/points.csv"] {
        assert!(bytes(&format!("whole/{file}")) == bytes(&format!("part/{file}")), "{file}");
    }
    let manifest: serde_json::Value = serde_json::from_slice(&bytes("part/manifest.json")).unwrap();
    for (file, sum) in manifest["checksums"].as_object().unwrap() {
        let found = catseye::formats::stage::sha256_of_file(d.join("part").join(file)).unwrap();
        assert_eq!(sum.as_str(), Some(found.as_str()), "{file}");
    }
}

/// The second of two that write the same folder is told who writes it; what the first leaves is whole.
#[test]
fn two_processes_do_not_write_one_folder() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    let mut first = Command::new(env!("CARGO_BIN_EXE_catseye"))
        .current_dir(d)
        .args(["simulate", "s.toml", "-o", "out", "--frames", "400", "--quiet"])
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while !d.join(".out.unfinished/result/frame_000000").exists() {
        assert!(first.try_wait().unwrap().is_none(), "the first ended before its first frame");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let holder = format!("process {}", first.id());
    refused(d, &["simulate", "s.toml", "-o", "out", "--force"], &["out", &holder, "simulate"]);
    refused(d, &["demo", "-o", "out", "--force"], &["out", &holder]);
    first.kill().unwrap();
    first.wait().unwrap();
    // The lock ends with its holder.
    done(d, &["simulate", "s.toml", "-o", "out"]);
    assert!(!d.join(".out.lock").exists());
}

/// A script that keeps the help in a file learns when it could not be written.
#[cfg(target_os = "linux")]
#[test]
fn help_that_cannot_be_written_is_an_error() {
    let into = |file: &str, args: &[&str]| {
        let file = std::fs::File::options().write(true).open(file).unwrap();
        std::process::Command::new(env!("CARGO_BIN_EXE_catseye")).args(args).stdout(file).output().unwrap()
    };
    for args in [&["--help"] as &[&str], &["--version"], &["rcs", "--help"]] {
        let full = into("/dev/full", args);
        assert_eq!(full.status.code(), Some(1), "{args:?}");
        assert!(String::from_utf8_lossy(&full.stderr).contains("stdout"), "{args:?}");
        assert_eq!(into("/dev/null", args).status.code(), Some(0), "{args:?}");
    }
}

/// What others made is not ours to replace, whatever is asked.
#[test]
fn no_command_replaces_what_others_made() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    let site = d.join("site");
    std::fs::create_dir(&site).unwrap();
    std::fs::write(site.join("manifest.json"), r#"{"name": "app", "start_url": "/"}"#).unwrap();
    std::fs::write(site.join("index.html"), "<html>").unwrap();
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let cube = "run/frame_000000/adc.npy";
    for words in [
        &["demo", "-o", "site"][..],
        &["demo", "-o", "site", "--force"],
        &["simulate", "s.toml", "-o", "site", "--force"],
        &["process", cube, "--radar", "radar.toml", "-o", "site", "--force"],
        &["export", "run", "--format", "pcd", "-o", "site", "--force"],
        &["lane", "markers", "s.toml", "-o", "site", "--force"],
    ] {
        refused(d, words, &["site", "did not write"]);
    }
    assert_eq!(std::fs::read(site.join("index.html")).unwrap(), b"<html>");
    // Our own of another kind, and with something added.
    refused(d, &["process", cube, "--radar", "radar.toml", "-o", "run", "--force"], &["run"]);
    std::fs::write(d.join("run/notes.txt"), "mine").unwrap();
    refused(d, &["simulate", "s.toml", "-o", "run", "--force"], &["notes.txt"]);
    std::fs::remove_file(d.join("run/notes.txt")).unwrap();
    done(d, &["simulate", "s.toml", "-o", "run", "--force"]);
}

#[test]
fn no_output_goes_over_an_input() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    done(d, &["reflector", "plate", "-o", "m.glb", "--preview", "none"]);
    let mesh = std::fs::read(d.join("m.glb")).unwrap();
    for words in [
        &["rcs", "m.glb", "-o", "m.glb", "--force"][..],
        &["rcs", "m.glb", "-o", "./m.glb", "--force"],
        &["rcs", "plate", "--azimuth-deg", "0:9:1", "-o", "o.csv", "--plot", "o.csv"],
        &["rcs", "plate", "--azimuth-deg", "0:9:1", "-o", "o.csv", "--plot", "./o.csv", "--force"],
        &["calibrate", "--radar", "radar.toml", "-o", "radar.toml", "--force"],
        &["calibrate", "--radar", "radar.toml", "-o", "c.csv", "--plot", "c.csv"],
        &["reflector", "plate", "-o", "p.glb", "--preview", "p.glb"],
    ] {
        refused(d, words, &["another name"]);
    }
    assert_eq!(std::fs::read(d.join("m.glb")).unwrap(), mesh);
    assert!(!d.join("o.csv").exists() && !d.join("c.csv").exists() && !d.join("p.glb").exists());
}

#[test]
fn the_templates_run() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    done(d, &["init", "scenario"]);
    done(d, &["init", "radar"]);
    refused(d, &["init", "scenario"], &["scenario.toml", "--force"]);
    assert!(done(d, &["simulate", "scenario.toml", "--dry-run"]).contains("echoes a frame"));
    let remarks = |file: &str| -> Vec<String> {
        let said = done(d, &["simulate", file, "--dry-run", "--json"]);
        let v: serde_json::Value = serde_json::from_str(&said).unwrap();
        serde_json::from_value(v["remarks"].clone()).unwrap()
    };
    assert!(remarks("scenario.toml").is_empty(), "{:?}", remarks("scenario.toml"));
    // In the road's plane the marker stands on an edge.
    let text = std::fs::read_to_string(d.join("scenario.toml")).unwrap();
    assert!(text.contains("[17.5, 0, 0.002]"));
    std::fs::write(d.join("low.toml"), text.replace("[17.5, 0, 0.002]", "[17.5, 0, 0]")).unwrap();
    let said = remarks("low.toml");
    assert!(said.len() == 1 && said[0].contains("'marker'") && said[0].contains("'road'"), "{said:?}");
}

#[test]
fn devices_are_listed() {
    let t = tempfile::tempdir().unwrap();
    let json = done(t.path(), &["devices", "--json"]);
    let v: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(["cpu", "gpu"].contains(&v["auto"].as_str().unwrap()));
    assert!(v["adapters"].as_array().unwrap().iter().any(|a| a["self_test"] == "passed"), "{json}");
}

/// Kernels are compiled into the folder that is named; a cache that cannot be written is one sentence and no error.
#[test]
fn kernels_are_compiled_ahead() {
    let t = tempfile::tempdir().unwrap();
    let device = catseye::gpu::compare::test_device_name();
    let warm = |cache: &str, json: &[&str]| {
        let args = [&["devices", "--warm", "--device", device.as_str()][..], json].concat();
        let mut command = Command::new(env!("CARGO_BIN_EXE_catseye"));
        let out = command.env("CATSEYE_CACHE", cache).current_dir(t.path()).args(args).output().unwrap();
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    let at = t.path().join("deep/cache");
    for _ in 0..2 {
        let v: serde_json::Value = serde_json::from_str(&warm(at.to_str().unwrap(), &["--json"])).unwrap();
        assert_eq!(v["kernels"], catseye::engine::all_kernels().len());
        assert!(v["pipelines_s"].is_f64() && v["problem"].is_null(), "{v}");
        assert!(std::path::Path::new(v["cache_file"].as_str().unwrap()).starts_with(&at), "{v}");
        assert_eq!(std::fs::read_dir(&at).unwrap().count(), 1);
    }
    assert!(warm("off", &[]).contains("not kept: the cache is turned off"));
    std::fs::write(t.path().join("file"), "").unwrap();
    let said = warm("file", &[]);
    assert!(said.lines().count() == 1 && said.contains("not kept: "), "{said}");
    refused(t.path(), &["devices", "--warm", "--device", "cpu"], &["has no kernels to compile"]);
}

/// Without a cache, with an empty, a filled, a damaged and an unusable one, and in two processes at once.
#[test]
fn frames_have_the_same_bytes_with_and_without_a_cache() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    scenario(d);
    let device = catseye::gpu::compare::test_device_name();
    let start = |cache: &str, out: &str| {
        Command::new(env!("CARGO_BIN_EXE_catseye"))
            .env("CATSEYE_CACHE", cache)
            .current_dir(d)
            .args(["simulate", "s.toml", "--frames", "1", "--quiet", "--device", &device, "-o", out])
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap()
    };
    let end = |child: std::process::Child| {
        let out = child.wait_with_output().unwrap();
        assert!(out.status.success() && out.stderr.is_empty(), "{}", text(&out.stderr));
    };
    end(start("off", "off"));
    let at_once = [start("cache", "first"), start("cache", "second")];
    at_once.into_iter().for_each(end);
    end(start("cache", "warm"));
    let files: Vec<_> = std::fs::read_dir(d.join("cache")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    let mut damaged = std::fs::read(&files[0]).unwrap();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0xff;
    std::fs::write(&files[0], &damaged).unwrap();
    end(start("cache", "damaged"));
    assert!(std::fs::read(&files[0]).unwrap() != damaged, "it is replaced");
    end(start("s.toml", "unusable"));
    for file in ["adc.npy", "points.csv"] {
        let bytes = |run: &str| std::fs::read(d.join(run).join("frame_000000").join(file)).unwrap();
        for run in ["first", "second", "warm", "damaged", "unusable"] {
            assert!(bytes(run) == bytes("off"), "{run}: {file}");
        }
    }
}

#[test]
fn ground_and_polarisations_on_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    // The two rays cancel at 26.97 m: elevation atan(0.15 / 26.967), distance 26.9674 m.
    let at = |d: f64, ground: &str| -> serde_json::Value {
        let (e, r) = (0.15f64.atan2(d).to_degrees().to_string(), d.hypot(0.15).to_string());
        let args = [
            "--device",
            "cpu",
            "--json",
            "rcs",
            "point:rcs_dbsm=0",
            "--height-m",
            "0.35",
            "--ground",
            ground,
        ];
        let more = ["--elevation-deg", &e, "--range-m", &r, "--polarisation", "circular,linear45"];
        serde_json::from_str(&done(dir, &[&args[..], &more[..]].concat())).unwrap()
    };
    let level = |v: &serde_json::Value, key: &str| v["rows"][0][key].as_f64().unwrap_or(f64::NEG_INFINITY);
    let (null, peak) = (at(26.967, "pec"), at(53.9, "pec"));
    assert!(level(&null, "hh_dbsm") < -45.0, "{null}");
    assert!((level(&peak, "hh_dbsm") - 12.041).abs() < 0.02, "{peak}");
    assert!((level(&at(53.9, "none"), "hh_dbsm")).abs() < 0.02);
    // At the null the plane sends H away and doubles V, which holds half of each circular wave.
    let lr = null["rows"][0]["derived_dbsm"]["lr"].as_f64().unwrap();
    assert!((lr - 6.02).abs() < 0.05, "{null}");
    assert!((null["rows"][0]["derived_dbsm"]["p45p45"].as_f64().unwrap() - 6.02).abs() < 0.05, "{null}");

    let csv = |more: &[&str]| {
        let args = [
            "--device",
            "cpu",
            "--quiet",
            "--force",
            "rcs",
            "plate:width_m=0.02,height_m=0.004",
            "-o",
            "t.csv",
        ];
        done(dir, &[&args[..], more].concat());
        std::fs::read_to_string(dir.join("t.csv")).unwrap()
    };
    assert!(csv(&[]).contains("hh_re_m,hh_im_m\n"));
    let text = csv(&[
        "--polarisation",
        "circular",
        "--height-m",
        "0.002",
        "--ground",
        "pec",
        "--elevation-deg",
        "3",
    ]);
    assert!(text.contains("hh_re_m,hh_im_m,rr_dbsm,rl_dbsm,lr_dbsm,ll_dbsm\n"), "{text}");
    assert!(text.contains("# ground: pec, target raised by 0.002 m"), "{text}");
    assert!(text.contains("# warning: ground: at elevation 3.000 deg"), "{text}");
    refused(dir, &["rcs", "point", "--ground", "pece"], &["--ground", "pece", "did you mean 'pec'?"]);
    refused(
        dir,
        &["rcs", "point", "--ground", "pec", "--elevation-deg", "-1"],
        &["elevation", "below the ground"],
    );
    refused(dir, &["rcs", "point", "--height-m", "-1", "--ground", "pec"], &["is partly below the ground"]);
    refused(dir, &["rcs", "point", "--polarisation", "circular,circular"], &["--polarisation", "twice"]);
}

/// `study` on a road and `rcs` with angles from the target's foot give the same numbers for a raised target.
#[test]
fn a_raised_target_is_the_same_in_a_study_and_in_rcs() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    std::fs::write(
        d.join("p.toml"),
        "name = \"p\"\ntitle = \"p\"\n[set]\ntarget = \"plate:width_m=0.05,height_m=0.04\"\nradar_height_m = 0.5\n\
         ground = \"pec\"\nmarker_height_m = 0.3\n[[sweep]]\nparameter = \"longitudinal_m\"\nvalues = [20, 40]\n",
    )
    .unwrap();
    done(d, &["--device", "cpu", "--precision", "f64", "study", "p.toml", "-o", "out"]);
    let csv = std::fs::read_to_string(d.join("out/p.csv")).unwrap();
    let rows: Vec<&str> = csv.lines().filter(|l| l.starts_with("20,") || l.starts_with("40,")).collect();
    for (row, x) in rows.iter().zip([20.0f64, 40.0]) {
        let study: f64 = row.split(',').nth(1).unwrap().parse().unwrap();
        let (e, r) = (0.5f64.atan2(x).to_degrees().to_string(), x.hypot(0.5).to_string());
        let args =
            ["--device", "cpu", "--precision", "f64", "--json", "rcs", "plate:width_m=0.05,height_m=0.04"];
        let more = ["--ground", "pec", "--height-m", "0.3", "--elevation-deg", &e, "--range-m", &r];
        let text = done(d, &[&args[..], &more[..]].concat());
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let rcs = json["rows"][0]["vv_dbsm"].as_f64().unwrap();
        // `rcs` makes the cells at finite range smaller until 0.1 dB is reached, a study asks for the same 0.1 dB.
        assert!((study - rcs).abs() < 0.02, "{x} m: {study} {rcs}");
    }
    assert_eq!(rows.len(), 2, "{csv}");
    // However high, a point has its cross section.
    let high = done(d, &["--json", "rcs", "point:rcs_dbsm=0", "--height-m", "5", "--range-m", "10"]);
    let high: serde_json::Value = serde_json::from_str(&high).unwrap();
    assert!(high["rows"][0]["vv_dbsm"].as_f64().unwrap().abs() < 1e-9, "{high}");
    let help = done(d, &["rcs", "--help"]).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("from the point of the ground below"), "{help}");
    refused(d, &["rcs", "point", "--height-m", "2e6"], &["--height-m", "-1e6..1e6"]);
}

/// A file's target is turned by options, its header's boresight with it, and its parts take materials by their names.
#[test]
fn files_are_turned_and_their_parts_have_materials() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let square = |name: &str, y: f64, first: usize| {
        let corners = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)];
        let lines: String = corners.iter().map(|(a, b)| format!("v 0 {} {b}\n", a + y)).collect();
        format!("o {name}\nusemtl pec\n{lines}f {} {} {} {}\n", first, first + 1, first + 2, first + 3)
    };
    std::fs::write(d.join("two.obj"), square("left", 0.1, 1) + &square("right", -0.1, 5)).unwrap();
    let read = ["--unit", "m", "--up", "z", "--device", "cpu", "--json"];
    let rcs = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&done(d, &[&["rcs", "two.obj"], &read[..], more].concat())).unwrap()
    };
    let level = |v: &serde_json::Value| v["rows"][0]["vv_dbsm"].as_f64().unwrap();
    let ahead = level(&rcs(&[]));
    let turned = rcs(&[
        "--yaw-deg",
        "30",
        "--pitch-deg",
        "-10",
        "--roll-deg",
        "25",
        "--azimuth-deg",
        "30",
        "--elevation-deg",
        "10",
    ]);
    assert!((level(&turned) - ahead).abs() < 1e-6, "{turned} {ahead}");
    // The front looks up at a negative pitch; the roll about it moves no boresight.
    assert_eq!(turned["boresight"][0]["azimuth_deg"].as_f64(), Some(30.0), "{turned}");
    assert_eq!(turned["boresight"][0]["elevation_deg"].as_f64(), Some(10.0), "{turned}");
    assert!((turned["boresight"][0]["every"]["vv_dbsm"].as_f64().unwrap() - ahead).abs() < 1e-6, "{turned}");
    assert!(level(&rcs(&["--yaw-deg", "30"])) < ahead - 20.0);
    // One of two equal parts that reflects like asphalt: less than both of metal, more than one alone.
    let covered = level(&rcs(&["--part-material", "left=asphalt"]));
    assert!(covered < ahead - 1.0 && covered > ahead - 6.1, "{covered} {ahead}");
    let both = level(&rcs(&["--part-material", "left=asphalt", "--part-material", "right=asphalt"]));
    assert!((both - level(&rcs(&["--material", "pec=asphalt"]))).abs() < 1e-9);
    let files = ["rcs", "two.obj", "--unit", "m", "--up", "z"];
    refused(
        d,
        &[&files[..], &["--part-material", "lift=steel"]].concat(),
        &["--part-material = lift", "did you mean 'left'"],
    );
    refused(d, &[&files[..], &["--yaw-deg", "400"]].concat(), &["--yaw-deg = 400", "-360..360"]);
    let text = done(d, &["rcs", "trihedral:leg_m=0.1", "--pitch-deg", "35.26438968", "--azimuth-deg", "0"]);
    assert!(text.contains("# turned: yaw 0 deg, pitch 35.26438968 deg, roll 0 deg"), "{text}");
    assert!(
        text.contains("boresight (azimuth 0 deg, elevation 0.0000 deg)")
            || text.contains("elevation -0.0000 deg"),
        "{text}"
    );
}

/// Every output of a cross section says where physical optics ends, in one wording.
#[test]
fn where_physical_optics_ends_is_said_in_every_output() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    for (spec, frequency, size) in [
        ("type1:height_m=0.003", "24e9", "3.00 mm, 0.24 wavelengths"),
        ("plate:width_m=0.001,height_m=0.001", "77e9", "1.00 mm, 0.26 wavelengths"),
        ("trihedral:leg_m=0.005", "77e9", "wavelengths"),
    ] {
        let args =
            ["rcs", spec, "--frequency-hz", frequency, "--elevation-deg", "3", "-o", "t.csv", "--force"];
        let text = done(d, &args);
        let remark = text
            .lines()
            .find(|l| l.starts_with("# warning: size: "))
            .unwrap_or_else(|| panic!("{spec}: {text}"));
        assert!(remark.contains(size) && remark.contains("not a prediction"), "{remark}");
        assert!(std::fs::read_to_string(d.join("t.csv")).unwrap().contains(remark), "{spec}");
        let json: serde_json::Value =
            serde_json::from_str(&done(d, &[&["--json"], &args[..6]].concat())).unwrap();
        assert!(json["warnings"][0].as_str().unwrap().starts_with("size: "), "{json}");
    }
    let args = [
        "--json",
        "rcs",
        "plate",
        "--azimuth-deg",
        "86",
        "--ground",
        "pec",
        "--height-m",
        "0.06",
        "--range-m",
        "50",
    ];
    let json: serde_json::Value = serde_json::from_str(&done(d, &args)).unwrap();
    assert!(json["warnings"].to_string().contains("the minimum is 4.0 deg"), "{json}");
    let low = ["--json", "rcs", "type1:height_m=0.005", "--elevation-deg", "0.9", "--ground", "pec"];
    let low: serde_json::Value = serde_json::from_str(&done(d, &low)).unwrap();
    assert!(low["warnings"].to_string().contains("ground: at elevation 0.900 deg"), "{low}");
    assert_eq!((json["range_m"].as_f64(), json["height_m"].as_f64()), (Some(50.0), Some(0.06)));
    assert_eq!(
        (json["ground"].as_str(), json["version"].as_str()),
        (Some("pec"), Some(env!("CARGO_PKG_VERSION")))
    );
    let large = done(d, &["--json", "rcs", "plate:width_m=0.1,height_m=0.1"]);
    let large: serde_json::Value = serde_json::from_str(&large).unwrap();
    assert!(large["warnings"].as_array().unwrap().is_empty() && large["range_m"].is_null(), "{large}");
}

/// The same remarks stand in a study's table, report, manifest and on the terminal; a search says at which limits it ends.
#[test]
fn a_study_says_where_physical_optics_ends_and_where_its_range_did() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let set = "[set]\ntarget = \"plate:height_m=0.002\"\nground = \"pec\"\nmarker_height_m = 0.0015\n";
    std::fs::write(
        d.join("s.toml"),
        format!(
            "name = \"s\"\ntitle = \"s\"\n{set}[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 2]\n\
             [search]\ngoal = \"least-rcs\"\nfront = \"elevation_deg\"\nfront_values = [1.5]\nstarts = 2\nsteps = 40\n\
             [[search.parameter]]\nname = \"target.width_m\"\nmin = 0.003\nmax = 0.0123456789\n"
        ),
    )
    .unwrap();
    std::fs::write(
        d.join("t.toml"),
        format!(
            "name = \"t\"\ntitle = \"t\"\n{}[[sweep]]\nparameter = \"elevation_deg\"\nvalues = [1, 2]\n",
            set.replace("height_m=0.002", "height_m=0.002,width_m=0.05")
        ),
    )
    .unwrap();
    for (name, expected) in [
        (
            "t",
            &[
                "size: the narrowest surfaces that contribute to the echo measure 2.00 mm",
                "ground: at elevation 1.000 deg",
            ][..],
        ),
        (
            "s",
            &[
                "size: ",
                "ground: at elevation 1.500 deg",
                "the search ends at target.width_m = 0.0123",
                "the largest value of its range",
            ],
        ),
    ] {
        let terminal = done(d, &["--device", "cpu", "study", &format!("{name}.toml"), "-o", name]);
        let file = |f: &str| std::fs::read_to_string(d.join(name).join(f)).unwrap();
        for text in [terminal, file(&format!("{name}.csv")), file("REPORT.md"), file("manifest.json")] {
            for e in expected {
                assert!(text.contains(e), "{name}: no {e} in {text}");
            }
        }
    }
    // What was found has the digits of the search's grain.
    let csv = std::fs::read_to_string(d.join("s/s.csv")).unwrap();
    let width = csv.lines().last().unwrap().split(',').nth(1).unwrap();
    assert!(width.len() <= "0.01234568".len(), "{width}");
}

/// The accuracy that is asked for at finite range is reached or said to be missed, and edges and a receiver
/// elsewhere change the answer.
#[test]
fn accuracy_edges_and_receivers_on_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let spec = "type1:height_m=0.01";
    let near = done(
        d,
        &["rcs", spec, "--azimuth-deg", "-40:40:2", "--elevation-deg", "2.9", "--range-m", "3", "--json"],
    );
    let near: serde_json::Value = serde_json::from_str(&near).unwrap();
    let reached = near["convergence_db"].as_f64().unwrap();
    assert!(reached > 0.0 && reached <= 0.1, "{reached}");
    let plate = |more: &[&str]| {
        let all: Vec<&str> =
            ["rcs", "plate", "--azimuth-deg", "60", "--json"].iter().chain(more).copied().collect();
        let out: serde_json::Value = serde_json::from_str(&done(d, &all)).unwrap();
        out["rows"][0].clone()
    };
    let (alone, edges) = (plate(&[]), plate(&["--diffraction", "ptd"]));
    let level = |row: &serde_json::Value| row["vv_dbsm"].as_f64().unwrap();
    assert!((level(&alone) - level(&edges)).abs() > 0.5);
    // The mirror direction of 60 deg is -60 deg.
    let mirror = plate(&["--bistatic-azimuth-deg", "-60"]);
    assert_eq!(mirror["rx_azimuth_deg"].as_f64(), Some(-60.0));
    assert!(level(&mirror) > level(&alone) + 20.0);
}

/// The table on stdout says where the receiver stands, and what vanishes in words; the CSV keeps the numbers.
#[test]
fn a_bistatic_table_for_people_names_receivers_and_the_floor() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let args = ["rcs", "plate", "--azimuth-deg", "60", "--bistatic-azimuth-deg", "-60,-58.5", "-o", "t.csv"];
    let out = done(d, &args);
    let mut rows = out.lines().skip_while(|l| l.starts_with('#'));
    let header: Vec<&str> = rows.next().unwrap().split_whitespace().collect();
    assert_eq!(header[3..6], ["rx_azimuth_deg", "rx_elevation_deg", "vv_dbsm"], "{out}");
    let row = |line: &str| line.replace("< -200", "<-200").split_whitespace().map(String::from).collect();
    let rows: Vec<Vec<String>> = rows.take(2).map(row).collect();
    assert_eq!([rows[0][3].as_str(), rows[1][3].as_str()], ["-60.0000", "-58.5000"], "{out}");
    assert!(rows.iter().all(|r| r.len() == header.len()), "{out}");
    // A plate turned about the vertical does not change the polarisation.
    let vh = header.iter().position(|h| *h == "vh_dbsm").unwrap();
    assert_eq!(rows[0][vh], "<-200", "{out}");
    let csv = std::fs::read_to_string(d.join("t.csv")).unwrap();
    assert!(csv.lines().filter(|l| !l.starts_with('#')).all(|l| !l.contains('<')), "{csv}");
    // The receiver that sees most is named when the table is too long to show.
    let args = ["rcs", "plate", "--azimuth-deg", "60", "--bistatic-azimuth-deg", "-80:-40:0.5"];
    assert!(done(d, &args).contains("receiver at azimuth -60.0000 deg"));
    // One-station tables have no such columns.
    assert!(!done(d, &["rcs", "plate"]).contains("rx_azimuth"));
}

/// What a command does not heed is said, before its name and after it, and parameters of other kinds are refused; numbers of options are read in the words of files.
#[test]
fn options_that_change_nothing_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    for args in [&["init", "radar", "-o", "-", "--device", "cpu"][..], &["--seed", "3", "rcs", "plate"]] {
        let out = catseye(d, args);
        let err = text(&out.stderr);
        assert!(out.status.success() && err.contains("has no effect on '"), "{args:?}: {err}");
    }
    refused(d, &["reflector", "plate", "--leg-m", "1", "-o", "p.glb"], &["plate:leg_m", "width_m, height_m"]);
    refused(d, &["reflector", "plate", "--seed", "1", "-o", "p.glb"], &["plate:seed", "no such parameter"]);
    refused(d, &["reflector", "plate", "--widht-m", "1", "-o", "p.glb"], &["--widht-m", "'--width-m'"]);
    refused(
        d,
        &["rcs", "plate", "--range-m", "-5"],
        &["--range-m = -5", "allowed: a positive number, or inf"],
    );
    refused(d, &["rcs", "plate", "--bounces", "-1"], &["--bounces = '-1'", "0 or more"]);
    refused(d, &["rcs", "plate", "--bounces", "1.5"], &["--bounces = '1.5'", "is not a whole number"]);
    refused(d, &["rcs", "plate", "--accuracy-db", "x"], &["--accuracy-db = 'x'", "is not a number"]);
    assert_eq!(std::fs::read_dir(d).unwrap().count(), 0);
    // A parameter's name may be that of a global option, and its value may be negative.
    let file = |seed: &str| {
        let o =
            ["reflector", "chaff", "--seed", seed, "-o", "c.glb", "--preview", "none", "--force", "--quiet"];
        done(d, &o);
        std::fs::read(d.join("c.glb")).unwrap()
    };
    assert_ne!(file("1"), file("2"));
    assert!(done(d, &["reflector", "type1", "--slant-deg", "-5", "-o", "t.glb"]).contains("slant_deg=-5"));
    assert!(done(d, &["init", "radar", "--json"]).contains("\"file\": \"radar.toml\""));
}

/// Every kind with every parameter, its default and its unit, as the parser has them; and which features were built.
#[test]
fn help_lists_what_has_names() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let all = done(d, &["help", "reflectors"]);
    for kind in kinds() {
        let (_, own) = all.split_once(&format!("{}: {}\n", kind.name, kind.summary)).expect(kind.name);
        let own = own.split("\n\n").next().unwrap();
        for p in kind.params {
            let row = own.lines().find(|l| l.split_whitespace().next() == Some(p.name));
            let row = row.unwrap_or_else(|| panic!("{}: {} is not in\n{own}", kind.name, p.name));
            assert!(row.contains(&format!("[{}]", p.allowed())) && row.ends_with(p.doc), "{row}");
            assert!(!p.name.ends_with("_m") || p.allowed().ends_with(" m"), "{row}");
            // What is shown as the default is read as one.
            let shown = row.split_whitespace().nth(1).unwrap();
            let near = Reflector::from_pairs(kind.name, &[(p.name, shown)]).unwrap().value(p.name).unwrap();
            match (near, p.range.default_value()) {
                (Value::Number(a), Value::Number(b)) => assert!((a - b).abs() <= 1e-3 * b.abs(), "{row}"),
                (a, b) => assert_eq!(a, b, "{row}"),
            }
        }
        assert!(all.contains(&done(d, &["help", "reflectors", kind.name])));
    }
    assert!(done(d, &["help", "materials"]).contains("\nasphalt "));
    let radars = done(d, &["help", "radars"]);
    for name in radar_toml::PRESETS.map(|p| p.0) {
        assert!(radars.lines().any(|l| l.starts_with(&format!("{name} "))), "{name}");
    }
    // The table of the guide is what the command prints, without what the files say about themselves.
    let guide = include_str!("../../../../docs/guides/own-radar.md");
    for row in radars.lines().take_while(|l| !l.is_empty()) {
        let figures = row.get(..86).unwrap_or(row).trim_end();
        assert!(guide.contains(figures), "the guide has not: {figures}");
    }
    // 250 m lie in the 286 m of its cells; the row is that of the data sheet.
    let row = radars.lines().find(|l| l.starts_with("ars408-far ")).unwrap();
    assert_eq!(
        row.split_whitespace().skip(2).take(7).collect::<Vec<_>>(),
        ["2", "x", "6", "286.4", "1.79", "111.3", "0.10"]
    );
    assert!(done(d, &["help", "rcs"]).contains("\nGlobal options:\n"));
    assert!(done(d, &["help"]).contains("\nCommands:\n"));
    refused(d, &["help", "reflector5"], &["did you mean 'reflector'?"]);
    refused(d, &["help", "reflectors", "plat"], &["did you mean 'plate'?"]);
    for short in ["-V", "--version"] {
        let version = done(d, &[short]);
        assert_eq!(version.trim_end().lines().count(), 1);
        assert!(
            version.starts_with(concat!("catseye ", env!("CARGO_PKG_VERSION"), " (features: ")),
            "{version}"
        );
        assert_eq!(version.contains("hdf5"), cfg!(feature = "hdf5"), "{version}");
    }
}

/// All scenes come with the program: listed, written with what they name, and read where they then lie. Their commands hold.
#[test]
fn examples_run_where_they_are_written() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let list = done(d, &["examples"]);
    assert!(list.lines().count() > 100 && list.contains("lane/markers_turn  "), "{list}");
    done(d, &["examples", "markers_turn"]);
    assert!(d.join("scenes/lane/markers_turn.toml").is_file());
    assert!(done(d, &["examples", "lane/markers_turn"]).contains("all files exist already"));
    std::fs::write(d.join("scenes/lane/markers_turn.toml"), "mine").unwrap();
    refused(
        d,
        &["examples", "markers_turn"],
        &["markers_turn.toml", "exists already and has other contents", "--force"],
    );
    refused(d, &["examples", "marker_turn"], &["did you mean 'markers_turn'?"]);
    done(d, &["examples", "all", "--force"]);
    let of = |folder: &str| {
        let files = std::fs::read_dir(d.join("scenes").join(folder)).unwrap().map(|f| f.unwrap().path());
        files.filter(|f| f.extension().is_some_and(|e| e == "toml")).collect::<Vec<_>>()
    };
    for file in of("road") {
        catseye::road::scene_toml::load(&file).unwrap_or_else(|e| panic!("{e}"));
    }
    for file in of("recipes") {
        let text = std::fs::read_to_string(&file).unwrap();
        let read = text.contains("scenes = ").then(|| catseye_io::recipe::Recipe::parse(&file, &text, None));
        if let Some(Err(e)) = read {
            assert!(!cfg!(feature = "zarr") && e.to_string().contains("--features zarr"), "{e}");
        }
    }
    for file in of("lane") {
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(!text.contains("#:schema"));
        // Commands in the first remarks are complete: what they name is there.
        for line in text.lines().take_while(|l| l.starts_with('#')).filter(|l| l.contains("catseye ")) {
            let command = line.split_once("catseye ").unwrap().1.split("  ").next().unwrap();
            let named: Vec<&str> = command.split_whitespace().filter(|w| w.contains(".toml")).collect();
            for name in &named {
                let name = name.trim_end_matches([',', '.', ')', '`']);
                assert!(d.join(name).is_file(), "{}: {line}", file.display());
            }
        }
    }
    // Templates are good from the first.
    done(d, &["init", "road"]);
    done(d, &["init", "scenario"]);
    done(d, &["init", "recipe"]);
    assert!(done(d, &["scene", "road.toml", "-o", "road.glb"]).contains("2 lanes"));
    let recipe = std::fs::read_to_string(d.join("recipe.toml")).unwrap();
    catseye_io::recipe::Recipe::parse(&d.join("recipe.toml"), &recipe, None).unwrap();
    let run = done(d, &["simulate", "scenario.toml", "-o", "run", "--device", "cpu", "--quiet"]);
    let table = catseye::formats::csv::Table::read(d.join("run/frame_000000/points.csv")).unwrap();
    let state = table.text("ambiguity").unwrap();
    let settled = state.iter().filter(|s| ["resolved", "ego_speed", "unambiguous"].contains(&&***s)).count();
    assert!(10 * settled >= 9 * state.len() && state.len() > 10, "{settled} of {}: {run}", state.len());
}

/// Facts that do not agree with their document end `study` with 1 where that is asked for, and with 0 where not; results are written.
#[test]
fn strict_studies_end_with_1_where_facts_disagree() {
    let dir = tempfile::tempdir().unwrap();
    let study = |document: f64| {
        format!(
            "name = \"s\"\ntitle = \"s\"\nquantities = [\"rcs_dbsm\"]\n[set]\ntarget = \"sphere:radius_m=0.1\"\nelevation_deg = 0\n\
             [[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 10]\n\
             [[fact]]\ntext = \"a sphere\"\ndocument = {document}\nunit = \"dBsm\"\nof = \"maximum\"\nwhy = \"\"\n"
        )
    };
    let run = |document: f64, more: &[&str]| {
        std::fs::write(dir.path().join("s.toml"), study(document)).unwrap();
        let args = [&["study", "s.toml", "-o", "out", "--force", "--device", "cpu"], more].concat();
        let done = catseye(dir.path(), &args);
        assert!(dir.path().join("out/REPORT.md").is_file(), "{}", text(&done.stderr));
        (done.status.code(), text(&done.stderr))
    };
    // 10 lg(pi 0.1^2) = -15.03.
    assert_eq!(run(-15.0, &["--strict"]).0, Some(0));
    assert_eq!(run(-20.0, &[]).0, Some(0));
    let (code, said) = run(-20.0, &["--strict"]);
    assert_eq!(code, Some(1));
    assert!(
        said.contains("1 of 1 reference values do not agree with their documents: s: a sphere"),
        "{said}"
    );
}

/// A file that outgrows the limit of file sizes is an error that names it, and nothing of it is left; the signal does not end the program.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_file_sizes_is_told_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    for (file, command) in [
        ("recipe.toml", "init recipe"),
        ("rcs.csv", "rcs plate:width_m=0.1,height_m=0.1 --azimuth-deg=-30:30:0.5 --device cpu -o rcs.csv"),
    ] {
        let line = format!("ulimit -f 1; exec '{}' {command} --quiet", env!("CARGO_BIN_EXE_catseye"));
        let out =
            std::process::Command::new("sh").current_dir(dir.path()).args(["-c", &line]).output().unwrap();
        let err = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{command}: {:?} {err}", out.status);
        for part in ["error: ", file, "File too large", "ulimit -f"] {
            assert!(err.contains(part), "{command}: '{part}' is not in: {err}");
        }
        assert_eq!(err.lines().count(), 1, "{err}");
        let left: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|f| f.unwrap().path()).collect();
        assert!(left.is_empty(), "{command}: {left:?}");
    }
}
