//! `simulate --from`: frames of another radar from echoes that a run kept.

use super::common::{done, refused, root};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const SCENARIO: &str = "name = \"s\"\nseed = 7\nradar = \"RADAR\"\n[scene]\nroad = \"road.toml\"\n\
    [ego]\nspeed_mps = 10\non_road = { lane = 1, s_m = 10 }\n\
    [[point]]\nposition_m = [30, 3, 0.5]\nrcs_dbsm = 10\nclass = \"car\"\nvelocity_mps = [4, 0, 0]\n\
    [frames]\ncount = 2\ninterval_s = 0.05\n[trace]\nrays = 2000\n[output]\nplots = false\nechoes = true\nreturn_places = true\n";

/// Radar and scenario files of this name, with what is replaced in them.
fn write(d: &Path, name: &str, radar: &[(&str, &str)], scenario: &[(&str, &str)]) -> String {
    let put = |text: &str, changes: &[(&str, &str)]| {
        changes.iter().fold(text.to_string(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        })
    };
    let preset = fs::read_to_string(root().join("scenes/presets/demo77.toml")).unwrap();
    let preset = preset.replace("chirps = 128", "chirps = 32").replace("samples = 256", "samples = 128");
    fs::write(d.join(format!("{name}_radar.toml")), put(&preset, radar)).unwrap();
    let text = put(SCENARIO, scenario).replace("RADAR", &format!("{name}_radar.toml"));
    fs::write(d.join(format!("{name}.toml")), text).unwrap();
    format!("{name}.toml")
}

/// Contents of the files of all frames, by name.
fn frames(run: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for index in 0..2 {
        let frame = format!("frame_{index:06}");
        for file in fs::read_dir(run.join(&frame)).unwrap() {
            let path = file.unwrap().path();
            let name = format!("{frame}/{}", path.file_name().unwrap().to_str().unwrap());
            found.insert(name, fs::read(path).unwrap());
        }
    }
    found
}

/// Where nothing changes, all files are the same; another front end, array, seed and shorter frame hear what a trace of their own would
/// have brought them.
#[test]
fn kept_echoes_serve_other_radars() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::copy(root().join("scenes/road/road_lane_3m.toml"), d.join("road.toml")).unwrap();
    let first = write(d, "first", &[], &[]);
    done(d, &["simulate", &first, "-o", "run"]);
    done(d, &["simulate", &first, "--from", "run", "-o", "same"]);
    let (run, same) = (frames(&d.join("run")), frames(&d.join("same")));
    assert!(run.len() == 2 * 8 && run.contains_key("frame_000001/echoes.npy"), "{:?}", run.keys());
    assert!(run == same);
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(d.join("same/manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["echoes_from"]["scenario_name"], "s");
    assert!(manifest["frames"][0]["triangles"].as_u64().unwrap() > 100);

    // What does not change the trace gives the samples of a trace of its own.
    let other = write(
        d,
        "other",
        &[
            ("noise_figure_db = 13", "noise_figure_db = 16"),
            ("power_dbm = 12", "power_dbm = 9"),
            ("[[rx]]\nposition_half_wavelengths = [0, 1.5, 0]\n", ""),
            ("kind = \"hann\"", "kind = \"hamming\""),
        ],
        &[("[trace]\n", "[trace]\nbounces = 3\n")],
    );
    let first = write(d, "again", &[], &[("[trace]\n", "[trace]\nbounces = 3\n")]);
    done(d, &["simulate", &first, "-o", "deep"]);
    done(d, &["simulate", &other, "-o", "whole"]);
    done(d, &["simulate", &other, "--from", "deep", "-o", "listened"]);
    let (whole, listened) = (frames(&d.join("whole")), frames(&d.join("listened")));
    for name in
        ["adc.npy", "range_doppler.npy", "points.csv", "returns.csv", "return_places.npy", "echoes.npy"]
    {
        let name = format!("frame_000001/{name}");
        assert!(whole[&name] == listened[&name], "{name}");
    }
    assert!(whole["frame_000001/adc.npy"] != run["frame_000001/adc.npy"]);
    // Another seed draws other noise and keeps the rest.
    done(d, &["simulate", &other, "--from", "deep", "--seed", "8", "-o", "seed"]);
    let seed = frames(&d.join("seed"));
    assert!(seed["frame_000000/adc.npy"] != listened["frame_000000/adc.npy"]);
    assert!(seed["frame_000000/returns.csv"] == listened["frame_000000/returns.csv"]);
    // A frame of half the chirps and half the band hears the same strongest echo.
    let short = write(
        d,
        "short",
        &[("chirps = 32", "chirps = 16"), ("bandwidth_hz = 375e6", "bandwidth_hz = 250e6")],
        &[],
    );
    let e = refused(d, &["simulate", &short, "--from", "run", "-o", "no"], &["waveform", "exceeds"]);
    assert!(!d.join("no").exists(), "{e}");
    let short = write(
        d,
        "short",
        &[
            ("chirps = 32", "chirps = 16"),
            ("bandwidth_hz = 375e6", "bandwidth_hz = 250e6"),
            ("sample_rate_hz = 20e6", "sample_rate_hz = 10e6"),
            ("samples = 128", "samples = 64"),
        ],
        &[],
    );
    done(d, &["simulate", &short, "--from", "run", "-o", "short"]);
    done(d, &["simulate", &short, "-o", "short_whole"]);
    let read = |run: &str| {
        catseye::formats::npy::read_f32(d.join(run).join("frame_000001/range_doppler.npy")).unwrap()
    };
    let (a, b) = (read("short"), read("short_whole"));
    let (peak, error) =
        a.data.iter().zip(&b.data).fold((0f32, 0f32), |(p, e), (a, b)| (p.max(*b), e.max((a - b).abs())));
    assert!(a.shape == [16, 64] && error < 1e-2 * peak, "{error} of {peak}");
}

/// What a trace does not hold is refused, with the key and the reason.
#[test]
fn what_kept_echoes_do_not_hold_is_refused() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::copy(root().join("scenes/road/road_lane_3m.toml"), d.join("road.toml")).unwrap();
    let first = write(d, "first", &[], &[]);
    done(d, &["simulate", &first, "-o", "run"]);
    let as_it_is = ("", "");
    for (radar, scenario, parts) in [
        (
            ("position_m = [3.6, 0, 0.5]", "position_m = [3.6, 0, 0.6]"),
            as_it_is,
            ["mounting", "another position"],
        ),
        (("bandwidth_hz = 375e6", "bandwidth_hz = 500e6"), as_it_is, ["waveform", "band is not within"]),
        (("carrier_hz = 77e9", "carrier_hz = 76.5e9"), as_it_is, ["waveform", "not within"]),
        (("chirps = 32", "chirps = 64"), as_it_is, ["waveform", "is longer"]),
        (("sample_rate_hz = 20e6", "sample_rate_hz = 25e6"), as_it_is, ["waveform", "exceeds"]),
        (as_it_is, ("speed_mps = 10", "speed_mps = 11"), ["ego", "another ego"]),
        (as_it_is, ("rcs_dbsm = 10", "rcs_dbsm = 11"), ["scene", "another scene"]),
        (as_it_is, ("interval_s = 0.05", "interval_s = 0.06"), ["frames.interval_s", "another time"]),
        (as_it_is, ("count = 2", "count = 3"), ["frames.count", "more frames than the run"]),
        (as_it_is, ("[trace]", "[weather]\nrain_mm_per_h = 4\n[trace]"), ["weather", "another weather"]),
        (as_it_is, ("[trace]", "[trace]\nbounces = 7"), ["trace.bounces", "fewer bounces"]),
        (as_it_is, ("[trace]", "[trace]\nbounces = 1"), ["trace.bounces", "more bounces"]),
        (as_it_is, ("[trace]", "[trace]\nconvention = \"last\""), ["trace.convention", "every"]),
        (as_it_is, ("[trace]", "[trace]\naccuracy_db = 0.1"), ["trace.accuracy_db", "less finely"]),
        (as_it_is, ("[trace]", "[trace]\nexact = true"), ["trace.exact", "were summed"]),
        (as_it_is, ("rays = 2000", "rays = 3000"), ["trace.rays", "less finely"]),
    ] {
        let name = write(d, "asked", &[radar], &[scenario]);
        let e = refused(d, &["simulate", &name, "--from", "run", "-o", "no"], &parts);
        assert!(e.contains("error: run"), "{e}");
        assert!(!d.join("no").exists(), "{parts:?}");
    }
    refused(d, &["simulate", &first, "--from", "missing", "-o", "no"], &["missing", "is not a run"]);
    refused(d, &["simulate", &first, "--from", "run", "-o", "run"], &["run"]);
    refused(d, &["simulate", &first, "--from", "run", "-o", "no", "--convergence"], &["--convergence"]);
    // Files of another version, changed ones, and a run that kept none.
    let origin = d.join("run/frame_000000/echoes.json");
    let text = fs::read_to_string(&origin).unwrap();
    fs::write(&origin, text.replace("\"version\":1", "\"version\":2")).unwrap();
    refused(d, &["simulate", &first, "--from", "run", "-o", "no"], &["echoes.json", "has changed"]);
    let manifest = d.join("run/manifest.json");
    let sums = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, sums.replace("frame_000000/echoes.json", "frame_000000/elsewhere")).unwrap();
    refused(d, &["simulate", &first, "--from", "run", "-o", "no"], &["version = 2", "allowed: 1"]);
    let none = write(d, "none", &[], &[("echoes = true\n", "")]);
    done(d, &["simulate", &none, "-o", "without"]);
    refused(d, &["simulate", &none, "--from", "without", "-o", "no"], &["output.echoes = true"]);
    assert!(!d.join("no").exists());
}

/// A dataset keeps its echoes in every format that is built; another radar makes the dataset that it would have made by traces of its own.
#[test]
fn datasets_serve_other_radars() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let recipes = root().join("scenes/recipes");
    let recipe = fs::read_to_string(recipes.join("tiny.toml")).unwrap();
    let radar = fs::read_to_string(recipes.join("tiny_radar.toml")).unwrap();
    assert!(radar.contains("noise_figure_db"), "{radar}");
    let noisier: String = radar
        .lines()
        .map(|l| {
            if l.starts_with("noise_figure_db") { "noise_figure_db = 21\n".into() } else { format!("{l}\n") }
        })
        .collect();
    fs::write(d.join("tiny_radar.toml"), &radar).unwrap();
    fs::write(d.join("other_radar.toml"), noisier).unwrap();
    let built = [("frames", true), ("zarr", cfg!(feature = "zarr")), ("hdf5", cfg!(feature = "hdf5"))];
    for (format, _) in built.into_iter().filter(|b| b.1) {
        let put = |name: &str, changes: &[(&str, &str)]| {
            let text = recipe.replace("format = \"frames\"", &format!("format = \"{format}\""));
            let text = text.replace("rays = 500", "rays = 500\nbounces = 2");
            let text = changes.iter().fold(text, |text, (from, to)| text.replace(from, to));
            fs::write(d.join(name), text).unwrap();
        };
        put("kept.toml", &[("[keep]", "[keep]\nechoes = true")]);
        put("other.toml", &[("tiny_radar", "other_radar")]);
        put("more.toml", &[("scenes = 4", "scenes = 5"), ("test = [3]", "test = [3, 4]")]);
        put("moved.toml", &[("uniform = [-5, 5]", "uniform = [-5, 6]")]);
        let of = |name: &str| format!("{format}_{name}");
        let made = |recipe: &str, out: &str, more: &[&str]| {
            let out = of(out);
            done(d, &[&["dataset", recipe, "-o", &out, "--device", "cpu"], more].concat());
        };
        let kept = of("kept");
        made("kept.toml", "kept", &[]);
        made("other.toml", "whole", &[]);
        made("other.toml", "listened", &["--from", &kept]);
        let out = done(d, &["diff", &of("whole"), &of("listened"), "--json"]);
        let report: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert!(report["alike"] == true && report["values"].as_u64() > Some(100_000), "{report}");
        if format == "frames" {
            let cube = |name: &str| fs::read(d.join(of(name)).join("frame_000005/adc.npy")).unwrap();
            assert!(cube("whole") == cube("listened") && cube("whole") != cube("kept"));
        }
        done(d, &["verify", &of("listened")]);
        // It is the dataset of another recipe, so that neither goes on from the other.
        let refuse = |recipe: &str, more: &[&str], parts: &[&str]| {
            let args = [&["dataset", recipe, "-o", "no", "--from", &kept], more].concat();
            refused(d, &args, parts);
        };
        refuse("more.toml", &[], &["scenes = 5", "fewer scenes"]);
        refuse("other.toml", &["--seed", "4"], &["seed = 4", "draws scenes other than"]);
        refuse("moved.toml", &[], &["scene", "another scene"]);
        refused(d, &["dataset", "other.toml", "-o", "no", "--from", &of("whole")], &["keep.echoes = true"]);
        refused(
            d,
            &["dataset", "other.toml", "-o", "no", "--from", "missing"],
            &["missing", "no dataset.json"],
        );
        refused(d, &["dataset", "other.toml", "-o", &of("whole"), "--from", &kept], &["whole"]);
    }
}
