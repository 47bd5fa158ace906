//! Pages of runs: what they hold is what the run's files say, and runs that are cut short are told of.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use catseye::base::error::Result;
use catseye::engine::{Engine, Precision};
use catseye::formats::csv::Table;
use catseye::formats::npy;
use catseye::scene::scenario;
use catseye_io::run::{RunOptions, run};
use catseye_view::{INLINE_BYTES, Thing, Written};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const SCENARIO: &str = "name = \"corner & <b>wall</b>\"\nseed = 7\nradar = \"demo77\"\n\
    [scene]\nbuiltin = \"marked-road\"\n[ego]\nposition_m = [0, -1.75, 0]\nspeed_mps = 10\n\
    [frames]\ncount = 2\ninterval_s = 0.1\n[trace]\nbounces = 2\n\
    [output]\nadc = false\nplots = false\nscene = true\nreturn_places = true\ncfar_threshold = true\nangle_spectra = true\n";

fn simulated(folder: &Path, text: &str) -> PathBuf {
    let scenario = scenario::parse(&folder.join("s.toml"), text).unwrap();
    let options = RunOptions {
        kind: "run",
        force: false,
        convergence: false,
        batch: None,
        from: None,
        rule: None,
        source: Some(text.into()),
        pictures: &|_, _, _, _, _| Ok(()),
        progress: &|_, _| (),
        add: None,
    };
    run(&Engine::Cpu(Precision::F32), &scenario, &folder.join("run"), &options).unwrap().folder
}

fn paged(thing: &Path, out: &Path, inline: usize) -> Result<Written> {
    Thing::of(&[thing.to_path_buf()])?.page()?.write(out, true, inline, &|_| ())
}

/// The JSON in an element of a page.
fn element(page: &str, id: &str) -> Value {
    let from = page.find(&format!("id=\"{id}\">")).unwrap() + id.len() + 6;
    let to = from + page[from..].find("</script>").unwrap();
    serde_json::from_str(&page[from..to]).unwrap()
}

fn f32s(v: &Value) -> Vec<f32> {
    let bytes = STANDARD.decode(v["f32"].as_str().unwrap()).unwrap();
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn a_page_says_what_the_files_say() {
    let t = tempfile::tempdir().unwrap();
    let folder = simulated(t.path(), SCENARIO);
    let out = t.path().join("run.html");
    let written = paged(&folder, &out, INLINE_BYTES).unwrap();
    assert_eq!((written.frames, written.beside), (2, None));
    let page = fs::read_to_string(&out).unwrap();
    assert!(page.contains("<title>corner &amp; &lt;b&gt;wall&lt;/b&gt;</title>"));
    let (data, frames) = (element(&page, "data"), element(&page, "frames"));
    assert_eq!(data["title"], "corner & <b>wall</b>");
    assert_eq!(data["frames"][1]["time_s"], 0.1);
    for (i, frame) in frames.as_array().unwrap().iter().enumerate() {
        let dir = folder.join(format!("frame_{i:06}"));
        let points = Table::read(dir.join("points.csv")).unwrap();
        let own = &frame["radars"][0];
        for name in ["range_m", "range_rate_mps", "snr_db", "share"] {
            let want = points.numbers(name).unwrap();
            let got: Vec<f64> =
                own["points"][name].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            assert_eq!(got, want, "{name}");
        }
        // Levels of the map to the hundredth of a decibel.
        let map = npy::read_f32(dir.join("range_doppler.npy")).unwrap();
        let codes = STANDARD.decode(own["map"]["u16"].as_str().unwrap()).unwrap();
        let (low, step) = (own["map"]["low"].as_f64().unwrap(), own["map"]["step"].as_f64().unwrap());
        for (c, w) in codes.chunks_exact(2).zip(&map.data) {
            let level = low + step * f64::from(u16::from_le_bytes([c[0], c[1]]));
            let want = 10.0 * f64::from(*w).log10() + 30.0;
            assert!((level - want).abs() < 0.005, "{level} {want}");
        }
        // The echoes behind each point lie in its cell, and each has the places of its bounces. The echo of the object that
        // the point is labelled with is among them, where it has most of the power.
        let causes = own["causes"].as_array().unwrap();
        assert_eq!(causes.len(), points.len());
        let (ids, shares) = (points.numbers("object_id").unwrap(), points.numbers("share").unwrap());
        let ghosts = points.numbers("ghost").unwrap();
        let lobes = points.numbers("side_lobe").unwrap();
        let mut told = 0;
        for (k, cause) in causes.iter().enumerate() {
            let echoes = cause["echoes"].as_array().unwrap();
            for e in echoes {
                let (n, chain) = (e["bounces"].as_u64().unwrap(), e["chain"].as_array().unwrap());
                assert_eq!(chain.len() as u64, n);
                let places = e["places"].as_array().unwrap();
                assert_eq!(places.len() as u64, n);
                assert!(places.iter().all(|p| p.is_array()), "{e}");
                // A way from the radar over its places and back is as long as the echo says.
                let mut at = [0.0; 3];
                let mut length = 0.0;
                let back = serde_json::json!([0.0, 0.0, 0.0]);
                for p in places.iter().chain([&back]) {
                    let to = [0, 1, 2].map(|i| p[i].as_f64().unwrap());
                    length += to.iter().zip(at).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
                    at = to;
                }
                // Half a wavelength: places are f32, and those of another bounce or face lie farther off.
                assert!((0.5 * length - e["range_m"].as_f64().unwrap()).abs() < 0.002, "{e}");
            }
            if ids[k] > 0.0 && shares[k] > 0.9 && ghosts[k] == 0.0 && lobes[k] == 0.0 {
                let named = echoes
                    .iter()
                    .flat_map(|e| e["chain"].as_array().unwrap())
                    .any(|id| id.as_f64() == Some(ids[k]));
                assert!(named, "point {k} of object {} has {echoes:?}", ids[k]);
                told += 1;
            }
        }
        assert!(told > 10, "{told}");
    }
    // Moving bodies have a pose for each frame: the ego drives, and one of the two cars does.
    let objects = data["scene"]["objects"].as_array().unwrap();
    let moving: Vec<&Value> = objects.iter().filter(|o| f32s(&o["poses"]).len() == 14).collect();
    assert!(!moving.is_empty() && moving.len() < objects.len());
    let poses = f32s(&moving[0]["poses"]);
    assert!((poses[7] - poses[0]).abs() > 0.5, "{poses:?}");
    // Frames beside the page are the same frames.
    let written = paged(&folder, &out, 0).unwrap();
    let beside = written.beside.unwrap();
    let page = fs::read_to_string(&out).unwrap();
    assert_eq!(element(&page, "data")["beside"], "run_frames");
    assert_eq!(element(&page, "frames"), serde_json::json!([]));
    for (i, frame) in frames.as_array().unwrap().iter().enumerate() {
        let text = fs::read_to_string(beside.join(format!("{i:06}.js"))).unwrap();
        let json = text.strip_prefix(&format!("catseyeFrame({i},")).unwrap().strip_suffix(");\n").unwrap();
        assert_eq!(serde_json::from_str::<Value>(json).unwrap(), *frame);
    }
    // One frame by itself.
    let written = paged(&folder.join("frame_000001"), &t.path().join("one.html"), INLINE_BYTES).unwrap();
    assert_eq!(written.frames, 1);
    let page = fs::read_to_string(t.path().join("one.html")).unwrap();
    assert_eq!(element(&page, "frames")[0], frames[1]);
}

#[test]
fn what_is_cut_short_is_told_and_leaves_nothing() {
    let t = tempfile::tempdir().unwrap();
    let folder = simulated(t.path(), SCENARIO);
    let out = t.path().join("run.html");
    let complaint = || {
        let told = paged(&folder, &out, INLINE_BYTES).unwrap_err().to_string();
        assert!(!out.exists() && !told.contains('\n'), "{told}");
        told
    };
    let broken = |file: &str, bytes: &[u8]| {
        let path = folder.join("frame_000001").join(file);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, bytes).unwrap();
        let told = complaint();
        fs::write(&path, whole).unwrap();
        told
    };
    let small = {
        npy::write(t.path().join("small.npy"), &[2, 3], &[0f32; 6]).unwrap();
        fs::read(t.path().join("small.npy")).unwrap()
    };
    let told = broken("range_doppler.npy", &small);
    assert!(told.contains("range_doppler.npy") && told.contains("shape differs from"), "{told}");
    let told = broken("return_places.npy", &small);
    assert!(told.contains("return_places.npy") && told.contains("shape does not fit"), "{told}");
    let told = broken("points.csv", b"range_m\nx,y\n");
    assert!(told.contains("points.csv:2"), "{told}");
    let told = broken("truth.json", b"{\"frame\": 1");
    assert!(told.contains("truth.json"), "{told}");
    fs::rename(folder.join("frame_000001"), t.path().join("gone")).unwrap();
    let told = complaint();
    assert!(told.contains("frame_000001") && told.contains("is missing"), "{told}");
    fs::write(folder.join("manifest.json"), b"{}").unwrap();
    let told = complaint();
    assert!(told.contains("manifest.json") && told.contains("is not a manifest of a run"), "{told}");
    fs::remove_file(folder.join("manifest.json")).unwrap();
    assert!(complaint().contains("a page cannot show this folder"));
    // What is nothing that a page shows, and things that do not go together.
    let alone = |paths: &[&str]| {
        let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
        Thing::of(&paths).unwrap_err().to_string()
    };
    assert!(alone(&["notes.txt"]).contains("a page cannot show this kind of file"));
    assert!(alone(&["a.csv", "scene.glb"]).contains("cannot be shown together"));
}
