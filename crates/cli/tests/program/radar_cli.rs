//! Radars at the command line: cubes in other formats, several radars and their interference, calibration, tracks, and what
//! is refused.

use crate::common::{catseye, text};
use catseye::formats::csv::Table;
use catseye::scene::radar_toml::parse;
use std::path::Path;

fn done(dir: &Path, args: &[&str]) -> serde_json::Value {
    let mut all = args.to_vec();
    all.extend(["--json", "--quiet"]);
    // Only the others have a device.
    if args[0] != "convert" {
        all.extend(["--device", "cpu"]);
    }
    let out = catseye(dir, &all);
    assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

/// One line with all of `parts`, and nothing under the name of the result.
fn refused(dir: &Path, args: &[&str], parts: &[&str], result: &str) {
    super::common::refused(dir, args, parts);
    assert!(!dir.join(result).exists(), "{args:?} left {result}");
}

const POINTS: &str = r#"
[[point]]
position_m = [20, 3, 0.5]
velocity_mps = [-5, 0, 0]
rcs_dbsm = 10
class = "car"
[[point]]
position_m = [30, -4, 0.5]
rcs_dbsm = 10
class = "post"
"#;

fn scenario(dir: &Path, radar: &str, more: &str) {
    let text =
        format!("name = \"s\"\nseed = 7\nradar = \"r.toml\"\n{POINTS}\n{more}\n[output]\nplots = false\n");
    std::fs::write(dir.join("s.toml"), text).unwrap();
    std::fs::write(dir.join("r.toml"), radar).unwrap();
}

fn demo() -> String {
    include_str!("../../../../scenes/presets/demo77.toml").replace("chirps = 128", "chirps = 32")
}

/// A cube that goes out as a recording or HDF5 and comes back gives the same points.
#[test]
fn cubes_go_round() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    scenario(d, &demo(), "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let cube = "run/frame_000000/adc.npy";
    let first = done(d, &["process", cube, "--radar", "r.toml", "-o", "p0"]);
    let formats: &[&str] = if cfg!(feature = "hdf5") { &["c.bin", "c.h5"] } else { &["c.bin"] };
    for name in formats {
        let made = done(d, &["convert", cube, "--radar", "r.toml", "-o", name]);
        assert_eq!(made["shape"], serde_json::json!([32, 12, 256]));
        assert_eq!(made["clipped_words"], 0);
        let back = done(d, &["process", name, "--radar", "r.toml", "-o", &format!("{name}.d")]);
        assert_eq!(back["points"], first["points"], "{name}");
        assert_eq!(back["absolute_levels"], true, "{name}");
        assert_eq!(back["calibrated"], false, "{name}");
        let a = Table::read(d.join("p0/points.csv")).unwrap().numbers("power_dbm").unwrap();
        let b = Table::read(d.join(format!("{name}.d/points.csv"))).unwrap().numbers("power_dbm").unwrap();
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 0.05, "{name}: {a} {b}");
        }
    }
    // The recording's configuration is a radar of its own.
    let own = done(d, &["process", "c.bin", "-o", "own"]);
    assert!(own["points"].as_u64().unwrap() >= 2);
    done(d, &["convert", "c.bin", "--radar", "r.toml", "-o", "again.npy"]);
    // What contradicts is refused.
    let bytes = std::fs::read(d.join("c.bin")).unwrap();
    std::fs::write(d.join("cut.bin"), &bytes[..bytes.len() - 3]).unwrap();
    std::fs::copy(d.join("c.cfg"), d.join("cut.cfg")).unwrap();
    refused(d, &["process", "cut.bin", "-o", "no"], &["cut.bin"], "no");
    refused(d, &["process", cube, "-o", "no"], &["--radar"], "no");
    refused(d, &["process", cube, "--radar", "feng77", "-o", "no"], &["adc.npy", "shape"], "no");
    refused(
        d,
        &["process", cube, "--radar", "r.toml", "--frame", "3", "-o", "no"],
        &["--frame", "0..=0"],
        "no",
    );
    refused(d, &["convert", cube, "--radar", "r.toml", "-o", "x.wav"], &["x.wav"], "x.wav");
    refused(d, &["convert", cube, "--radar", "r.toml", "-o", "c.h5"], &["c.h5"], "no");
    let slow = include_str!("../../../../scenes/presets/fmcw76.toml");
    std::fs::write(d.join("two.toml"), slow).unwrap();
    scenario(d, slow, "");
    done(d, &["simulate", "s.toml", "-o", "slopes"]);
    let cube = "slopes/frame_000000/adc.npy";
    refused(d, &["convert", cube, "--radar", "r.toml", "-o", "t.bin"], &["one linear ramp"], "t.bin");
}

/// A `.cfg` names the transmitters and not where they are: the board does, the one that is assumed or the one that is named.
#[test]
fn a_recording_has_the_antennas_of_its_board() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let awr1843 =
        include_str!("../../../../scenes/presets/awr1843.toml").replace("chirps = 256", "chirps = 32");
    scenario(d, &awr1843, "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let cube = "run/frame_000000/adc.npy";
    done(d, &["convert", cube, "--radar", "r.toml", "-o", "c.bin"]);
    let azimuths = |folder: &str| {
        let table = Table::read(d.join(folder).join("points.csv")).unwrap();
        table.numbers("azimuth_deg").unwrap()
    };
    let own = done(d, &["process", cube, "--radar", "r.toml", "-o", "own"]);
    assert_eq!(own["assumed"], serde_json::json!([]));
    // A recording of catseye's has them beside it; those of others do not.
    let written = done(d, &["process", "c.bin", "-o", "written"]);
    assert_eq!(written["assumed"], serde_json::json!([]));
    std::fs::remove_file(d.join("c.bin.json")).unwrap();
    let assumed = done(d, &["process", "c.bin", "-o", "assumed"]);
    assert!(assumed["assumed"][0].as_str().unwrap().contains("the board awr1843"), "{assumed}");
    let manifest = std::fs::read_to_string(d.join("assumed/manifest.json")).unwrap();
    assert!(manifest.contains("assumed: antennas where the board awr1843"), "{manifest}");
    let named = done(d, &["process", "c.bin", "--board", "awr1843", "-o", "named"]);
    assert_eq!(named["assumed"], serde_json::json!([]));
    for folder in ["written", "assumed", "named"] {
        let pairs = azimuths("own").into_iter().zip(azimuths(folder));
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 0.3, "{folder}: {off} degrees off");
    }
    done(d, &["process", "c.bin", "--board", "line", "-o", "line"]);
    assert!((azimuths("own")[0] - azimuths("line")[0]).abs() > 2.0);
    refused(d, &["process", "c.bin", "--board", "awr1642", "-o", "no"], &["awr1642", "--board"], "no");
    // The line on stderr.
    let out = catseye(d, &["process", "c.bin", "-o", "spoken", "--device", "cpu"]);
    assert!(text(&out.stderr).contains("assumed: antennas"), "{}", text(&out.stderr));
    // Another slope than the recording's.
    std::fs::write(d.join("other.toml"), awr1843.replace("bandwidth_hz = 176e6", "bandwidth_hz = 352e6"))
        .unwrap();
    refused(
        d,
        &["process", "c.bin", "--radar", "other.toml", "-o", "no"],
        &["c.cfg", "another slope", "40 MHz/us", "20 MHz/us, as in the .cfg"],
        "no",
    );
}

/// What TI's visualizer writes into a comment names the board, and what the samples have been through that is not undone is said.
#[test]
fn a_configuration_says_more_than_its_commands() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let awr1843 =
        include_str!("../../../../scenes/presets/awr1843.toml").replace("chirps = 256", "chirps = 32");
    scenario(d, &awr1843, "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    done(d, &["convert", "run/frame_000000/adc.npy", "--radar", "r.toml", "-o", "c.bin"]);
    std::fs::remove_file(d.join("c.bin.json")).unwrap();
    let cfg = std::fs::read_to_string(d.join("c.cfg")).unwrap();
    let said = |text: &str, folder: &str| {
        std::fs::write(d.join("c.cfg"), text).unwrap();
        done(d, &["process", "c.bin", "-o", folder])["assumed"].to_string()
    };
    let lines = said(&format!("% Platform:xWR18xx\n{cfg}"), "a");
    assert!(
        lines.contains("the board awr1843 has them, for the file names the platform 'xWR18xx'"),
        "{lines}"
    );
    let lines = said(&format!("% Platform:xWR16xx\n{cfg}"), "b");
    assert!(lines.contains("a filled line") && lines.contains("xWR16xx' is not known"), "{lines}");
    let bias = "compRangeBiasAndRxChanPhase 0.0 1";
    assert!(cfg.contains(bias));
    let lines = said(&cfg.replace(bias, "compRangeBiasAndRxChanPhase 0.07 1"), "c");
    assert!(lines.contains("not used: compRangeBiasAndRxChanPhase 0.07"), "{lines}");
    let profile = cfg.lines().find(|l| l.starts_with("profileCfg")).unwrap();
    let mut words: Vec<&str> = profile.split(' ').collect();
    words[7] = "8192";
    let lines = said(&cfg.replace(profile, &words.join(" ")), "d");
    assert!(lines.contains("phase_shifter 8192"), "{lines}");
    // The commands of the low-power family.
    std::fs::write(d.join("c.cfg"), "channelCfg 7 3 0\nchirpComnCfg 10 0 0 128 4 28 0\n").unwrap();
    refused(d, &["process", "c.bin", "-o", "no"], &["c.cfg:2", "chirpComnCfg", "xWRL"], "no");
}

fn points(d: &Path, folder: &str) -> Vec<[f64; 3]> {
    let table = Table::read(d.join(folder).join("points.csv")).unwrap();
    let column = |name: &str| table.numbers(name).unwrap();
    let (r, v, a) = (column("range_m"), column("range_rate_mps"), column("azimuth_deg"));
    (0..r.len()).map(|i| [r[i], v[i], a[i]]).collect()
}

/// Packets that a capture card missed are zeros in the file: they are found and filled, and the points are those of the whole recording.
#[test]
fn lost_packets_are_said_and_filled() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    scenario(d, &demo().replace("chirps = 32", "chirps = 64"), "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let cube = "run/frame_000000/adc.npy";
    done(d, &["convert", cube, "--radar", "r.toml", "-o", "c.bin"]);
    let whole = done(d, &["process", "c.bin", "--radar", "r.toml", "-o", "whole"]);
    assert_eq!(whole["lost_chirps"], 0);
    let mut bytes = std::fs::read(d.join("c.bin")).unwrap();
    // Payloads of 1456 bytes (TI SWRU546, "DCA1000EVM Data Capture Card", packet format).
    for packet in [7, 200, 201, 410] {
        bytes[packet * 1456..(packet + 1) * 1456].fill(0);
    }
    std::fs::write(d.join("c.bin"), bytes).unwrap();
    let lost = done(d, &["process", "c.bin", "--radar", "r.toml", "-o", "lost"]);
    assert!((3..=5).contains(&lost["lost_chirps"].as_u64().unwrap()), "{lost}");
    assert!(lost["assumed"].to_string().contains("runs of zeros"), "{lost}");
    let (a, b) = (points(d, "whole"), points(d, "lost"));
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    for (a, b) in a.iter().zip(&b) {
        assert!(
            (a[0] - b[0]).abs() < 0.01 && (a[1] - b[1]).abs() < 0.01 && (a[2] - b[2]).abs() < 0.2,
            "{a:?} {b:?}"
        );
    }
    let again = done(d, &["convert", "c.bin", "--radar", "r.toml", "-o", "again.npy"]);
    assert_eq!(again["lost_chirps"], lost["lost_chirps"]);
}

/// A cube with the other sign of phase has its echoes at the far end: that is said, and the option puts it right.
#[test]
fn conjugate_cubes_are_said_and_read() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    scenario(d, &demo(), "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let cube = d.join("run/frame_000000/adc.npy");
    let first = done(d, &["process", "run/frame_000000/adc.npy", "--radar", "r.toml", "-o", "first"]);
    assert_eq!(first["assumed"], serde_json::json!([]));
    let options = catseye_io::cube::CubeOptions { conjugate: true, ..Default::default() };
    let mut source = catseye_io::cube::open_cube(&cube, &options, None).unwrap();
    let (shape, data) = (source.shape(), source.frame::<f32>(0).unwrap());
    catseye_io::cube::write_cube(d.join("conj.npy"), shape, &data, &Default::default(), false).unwrap();
    let wrong = done(d, &["process", "conj.npy", "--radar", "r.toml", "-o", "wrong"]);
    let line = wrong["assumed"].to_string();
    assert!(line.contains("opposite sign of phase") && line.contains("--conjugate"), "{line}");
    let right = done(d, &["process", "conj.npy", "--radar", "r.toml", "--conjugate", "-o", "right"]);
    assert_eq!(right["assumed"], serde_json::json!([]));
    assert_eq!(points(d, "right"), points(d, "first"));
    let real = demo().replace("sampling = \"iq\"", "sampling = \"real\"");
    scenario(d, &real, "");
    done(d, &["simulate", "s.toml", "-o", "reals"]);
    let reals = "reals/frame_000000/adc.npy";
    refused(
        d,
        &["process", reals, "--radar", "r.toml", "--conjugate", "-o", "no"],
        &["adc.npy", "cannot be conjugated"],
        "no",
    );
}

/// Whole numbers are counts in any type; samples of another kind than the radar's are refused, for half of them would be lost.
#[test]
fn what_samples_say_of_themselves_counts() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    scenario(d, &demo(), "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let options = catseye_io::cube::CubeOptions::default();
    let mut source = catseye_io::cube::open_cube(d.join("run/frame_000000/adc.npy"), &options, None).unwrap();
    let (shape, data) = (source.shape(), source.frame::<f32>(0).unwrap());
    let largest = data.iter().map(|z| z.norm()).fold(0.0, f32::max);
    let write = |name: &str, change: &dyn Fn(num_complex::Complex32) -> num_complex::Complex32| {
        let data: Vec<_> = data.iter().map(|z| change(*z)).collect();
        catseye_io::cube::write_cube(d.join(name), shape, &data, &Default::default(), false).unwrap();
    };
    let count = |x: f32| (x / largest * 20_000.0).round();
    write("counts.npy", &|z| num_complex::Complex::new(count(z.re), count(z.im)));
    let counts = done(d, &["process", "counts.npy", "--radar", "r.toml", "-o", "counts"]);
    assert_eq!((&counts["absolute_levels"], &counts["assumed"]), (&false.into(), &serde_json::json!([])));
    let word = |x: f32| if count(x) < 0.0 { count(x) + 65536.0 } else { count(x) };
    write("words.npy", &|z| num_complex::Complex::new(word(z.re), word(z.im)));
    let said = done(d, &["process", "words.npy", "--radar", "r.toml", "-o", "said"]);
    assert!(said["assumed"].to_string().contains("--words unsigned16"), "{said}");
    let read =
        done(d, &["process", "words.npy", "--radar", "r.toml", "--words", "unsigned16", "-o", "words"]);
    assert_eq!(read["assumed"], serde_json::json!([]));
    assert_eq!(points(d, "words"), points(d, "counts"));
    write("clipped.npy", &|z| {
        let cut = |x: f32| x.clamp(-0.1 * largest, 0.1 * largest);
        num_complex::Complex::new(cut(z.re), cut(z.im))
    });
    let cut = done(d, &["process", "clipped.npy", "--radar", "r.toml", "-o", "cut"]);
    assert!(cut["assumed"].to_string().contains("driven beyond its range"), "{cut}");
    write("real.npy", &|z| num_complex::Complex::new(z.re, 0.0));
    refused(
        d,
        &["process", "real.npy", "--radar", "r.toml", "-o", "no"],
        &["real.npy", "all imaginary parts are zero"],
        "no",
    );
    std::fs::write(d.join("real.toml"), demo().replace("sampling = \"iq\"", "sampling = \"real\"")).unwrap();
    let cube = "run/frame_000000/adc.npy";
    refused(
        d,
        &["process", cube, "--radar", "real.toml", "-o", "no"],
        &["adc.npy", "the radar samples real signals"],
        "no",
    );
    refused(
        d,
        &["convert", cube, "--radar", "real.toml", "-o", "no.bin"],
        &["adc.npy", "the radar samples real signals"],
        "no.bin",
    );
}

/// Slopes up and down: both bodies with range and speed from the pair of their peaks.
#[test]
fn slopes_give_range_and_speed() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    scenario(d, include_str!("../../../../scenes/presets/fmcw76.toml"), "");
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let frame = d.join("run/frame_000000");
    assert!(frame.join("range_doppler_1.npy").exists());
    let table = Table::read(frame.join("points.csv")).unwrap();
    let (range, rate) = (table.numbers("range_m").unwrap(), table.numbers("range_rate_mps").unwrap());
    let class = table.text("class").unwrap();
    // The radar stands 3.6 m forward and 0.5 m up.
    for (x, y, v, name) in [(16.4f64, 3.0f64, -5.0, "car"), (26.4, -4.0, 0.0, "post")] {
        let (r, v) = (x.hypot(y), v * x / x.hypot(y));
        let near = (0..range.len()).find(|i| (range[*i] - r).abs() < 0.15 && (rate[*i] - v).abs() < 0.25);
        let i =
            near.unwrap_or_else(|| panic!("{name} at {r:.2} m, {v:.2} m/s is not in {range:?}, {rate:?}"));
        assert_eq!(class[i], name);
    }
}

/// Three radars in one run, which hear each other and another car's; the same bytes again.
#[test]
fn radars_side_by_side() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    std::fs::write(d.join("r.toml"), demo()).unwrap();
    let head = |more: &str| {
        format!(
            "name = \"s\"\n{more}\n[[radars]]\nname = \"front\"\nradar = \"r.toml\"\n[[radars]]\nname = \"left\"\n\
             radar = \"r.toml\"\nmounting = {{ position_m = [3.5, 0.9, 0.5], yaw_deg = 40 }}\n{POINTS}\n\
             [output]\nplots = false\n"
        )
    };
    let other = "\n[[interferer]]\nname = \"oncoming\"\ncarrier_hz = 77e9\nbandwidth_hz = 0.6e9\nramp_time_s = 20e-6\n\
                 chirp_period_s = 25e-6\npower_dbm = 12\nposition_m = [50, 2, 0.5]\nyaw_deg = 180\n";
    std::fs::write(d.join("quiet.toml"), head("")).unwrap();
    std::fs::write(d.join("loud.toml"), head("mutual_interference = true") + other).unwrap();
    for (file, out) in [("quiet.toml", "quiet"), ("loud.toml", "loud"), ("loud.toml", "loud2")] {
        done(d, &["simulate", file, "-o", out]);
    }
    let adc = |run: &str, radar: &str| {
        std::fs::read(d.join(format!("{run}/frame_000000/{radar}/adc.npy"))).unwrap()
    };
    for radar in ["front", "left"] {
        assert!(adc("loud", radar) == adc("loud2", radar), "{radar} repeats");
        assert!(adc("loud", radar) != adc("quiet", radar), "{radar} hears nobody");
    }
    assert!(adc("quiet", "front") != adc("quiet", "left"));
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(d.join("quiet/manifest.json")).unwrap()).unwrap();
    assert!(manifest["axes"]["left"]["range_m"]["step"].is_number());
    assert_eq!(manifest["frames"].as_array().unwrap().len(), 2);
    // Both see the post of 10 dBsm, in places that agree in the vehicle's frame.
    let place = |radar: &str, yaw: f64, at: [f64; 2]| {
        let t = Table::read(d.join(format!("quiet/frame_000000/{radar}/points.csv"))).unwrap();
        let i = t.text("class").unwrap().iter().position(|c| c == "post").unwrap();
        let (x, y) = (t.numbers("x_m").unwrap()[i], t.numbers("y_m").unwrap()[i]);
        let (s, c) = yaw.sin_cos();
        [at[0] + c * x - s * y, at[1] + s * x + c * y]
    };
    let front = place("front", 0.0, [3.6, 0.0]);
    assert!((front[0] - 30.0).abs() < 0.3 && (front[1] + 4.0).abs() < 0.4, "{front:?}");
    let left = place("left", 40f64.to_radians(), [3.5, 0.9]);
    assert!((left[0] - 30.0).abs() < 0.6 && (left[1] + 4.0).abs() < 0.9, "{left:?}");
    for (text, parts) in [
        (head("radar = \"r.toml\""), vec!["radar and [[radars]] exclude each other"]),
        (head("").replace("name = \"left\"", "name = \"front\""), vec!["is the name of two radars"]),
        (head("").replace("name = \"left\"", "name = \"a/b\""), vec!["cannot name a folder"]),
        ("name = \"s\"\n".to_string(), vec!["has no radar"]),
    ] {
        std::fs::write(d.join("bad.toml"), text).unwrap();
        refused(d, &["simulate", "bad.toml", "-o", "bad"], &parts, "bad");
    }
}

/// A moving body is followed under one identity; the ego speed comes from the posts; a resumed run has the same files.
#[test]
fn runs_have_tracks() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let posts: String = (0..8)
        .map(|i| {
            let (x, y) = (14.0 + 5.0 * f64::from(i), if i % 2 == 0 { 7.0 } else { -7.0 });
            format!("[[point]]\nposition_m = [{x}, {y}, 0.5]\nrcs_dbsm = 5\nclass = \"post\"\n")
        })
        .collect();
    let more = format!("{posts}[ego]\nspeed_mps = 6\n[frames]\ncount = 6\ninterval_s = 0.1\n");
    scenario(d, &demo(), &more);
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let ego = Table::read(d.join("run/ego_motion.csv")).unwrap();
    assert_eq!(ego.len(), 6);
    for (v, std) in ego.numbers("vx_mps").unwrap().iter().zip(ego.numbers("vx_std_mps").unwrap()) {
        assert!((v - 6.0).abs() < 0.3 + 3.0 * std, "{v} +- {std}");
    }
    let tracks = Table::read(d.join("run/tracks.csv")).unwrap();
    let column = |name: &str| tracks.numbers(name).unwrap();
    let (frame, id) = (column("frame"), column("track_id"));
    let last: Vec<usize> = (0..tracks.len()).filter(|i| frame[*i] == 5.0).collect();
    let (x, y, v) = (column("x_m"), column("y_m"), column("vx_mps"));
    // At 20 m, 3 m to the left, approaching at 5 m/s for half a second.
    let car = last.iter().find(|i| (x[**i] - 17.5).abs() < 0.5 && (y[**i] - 3.0).abs() < 0.6);
    let car = *car.unwrap_or_else(|| panic!("no track at the car: {x:?} {y:?}"));
    assert!((v[car] + 5.0).abs() < 1.0, "{}", v[car]);
    assert!((0..tracks.len()).filter(|i| id[*i] == id[car]).count() >= 3, "it was not followed");
}

/// Standing objects have tracks however many there are and whatever the ego's motion can be estimated from; the motion is that of the
/// vehicle, whichever way the radar looks, and directions that are only a bound make no track and no motion.
#[test]
fn standing_objects_have_tracks_and_motion_is_the_vehicles() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let at = [[26.0, -13.0], [30.0, 9.0], [22.0, 15.0], [40.0, 3.0], [15.0, 21.0]];
    let points = |n: usize| -> String {
        at[..n]
            .iter()
            .map(|[x, y]| format!("[[point]]\nposition_m = [{x}, {y}, 0.6]\nrcs_dbsm = 15\n"))
            .collect()
    };
    let front = "[[radars]]\nname = \"front\"\nradar = \"corner77\"\nmounting = { position_m = [3.6, 0, 0.6], yaw_deg = 0 }\n";
    let side = "[[radars]]\nname = \"side\"\nradar = \"corner77\"\nmounting = { position_m = [3.3, 0.8, 0.6], yaw_deg = 45 }\n";
    let rest = "[ego]\nspeed_mps = 10\n[frames]\ncount = 8\ninterval_s = 0.05\n[output]\nadc = false\nplots = false\nreturns = false\n";
    for (name, radars, n) in [
        ("four", front.to_string(), 4),
        ("five", front.to_string(), 5),
        ("both", front.to_string() + side, 5),
    ] {
        std::fs::write(d.join("s.toml"), format!("name = \"{name}\"\n{radars}{}{rest}", points(n))).unwrap();
        done(d, &["simulate", "s.toml", "-o", name]);
        let tracks = Table::read(d.join(name).join("tracks.csv")).unwrap();
        let column = |c: &str| tracks.numbers(c).unwrap();
        let (frame, x, y, moving) = (column("frame"), column("x_m"), column("y_m"), column("moving"));
        for [px, py] in &at[..n] {
            let near =
                (0..tracks.len()).filter(|i| (x[*i] - px).hypot(y[*i] - py) < 0.3 && moving[*i] == 0.0);
            // The nearest leaves the front radar's sector.
            assert!(near.filter(|i| frame[*i] >= 2.0).count() >= 3, "{name}: no track at ({px}, {py})");
        }
        // No track elsewhere: targets outside of a radar's sector are points at its edge.
        for i in (0..tracks.len()).filter(|i| moving[*i] == 0.0) {
            let nearest =
                at[..n].iter().map(|[px, py]| (x[i] - px).hypot(y[i] - py)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.5, "{name}: a standing track at ({}, {})", x[i], y[i]);
        }
        let ego = Table::read(d.join(name).join("ego_motion.csv")).unwrap();
        assert!(ego.text("reason").unwrap().iter().all(|r| r.is_empty()), "{name}");
        let radars = ego.text("radar").unwrap();
        let number = |c: &str| ego.numbers(c).unwrap();
        let (vx, vy, yaw) = (number("vx_mps"), number("vy_mps"), number("yaw_rate_rad_per_s"));
        let (sx, sy, sw) = (number("vx_std_mps"), number("vy_std_mps"), number("yaw_rate_std_rad_per_s"));
        for i in 0..ego.len() {
            let within = |value: f64, want: f64, std: f64| (value - want).abs() < 0.02 + 3.0 * std;
            let right = within(vx[i], 10.0, sx[i]) && within(vy[i], 0.0, sy[i]) && within(yaw[i], 0.0, sw[i]);
            assert!(right, "{name}, {}: {} {} {}", radars[i], vx[i], vy[i], yaw[i]);
        }
        assert_eq!(radars.iter().any(|r| r == "all"), name == "both");
    }
}

/// A long-range radar that resolves its range rates has an estimate on a motorway, though few directions fit into its sector.
#[test]
fn resolved_range_rates_give_the_ego_motion() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let posts: String = (0..16)
        .map(|i| {
            let (x, y) = (40.0 + 12.0 * f64::from(i), if i % 2 == 0 { 7.0 } else { -7.0 });
            format!("[[point]]\nposition_m = [{x}, {y}, 0.5]\nrcs_dbsm = 15\n")
        })
        .collect();
    let text = format!(
        "name = \"m\"\nradar = \"lrr77\"\n{posts}[ego]\nspeed_mps = 30\n[frames]\ncount = 2\ninterval_s = 0.06\n\
         [output]\nadc = false\nplots = false\nreturns = false\n"
    );
    std::fs::write(d.join("s.toml"), text).unwrap();
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let ego = Table::read(d.join("run/ego_motion.csv")).unwrap();
    for (v, std) in ego.numbers("vx_mps").unwrap().iter().zip(ego.numbers("vx_std_mps").unwrap()) {
        assert!((v - 30.0).abs() < 0.05 + 3.0 * std, "{v} +- {std}");
    }
}

#[test]
fn calibration_makes_a_spoilt_array_right() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let spoilt = demo() + "\n[front_end]\nchannels = { phase_rms_deg = 40, gain_rms_db = 1, seed = 3 }\n";
    scenario(d, &spoilt, "");
    let made = done(
        d,
        &["calibrate", "--radar", "r.toml", "--azimuth-deg=-50:50:2", "-o", "cal.csv", "--plot", "cal.png"],
    );
    assert_eq!((made["angles"].as_u64(), made["channels"].as_u64()), (Some(51), Some(12)));
    assert!(d.join("cal.png").exists());
    // How far the two bodies are off in azimuth, from the radar 3.6 m ahead of the origin, in degrees.
    let off = |out: &str| -> [f64; 2] {
        done(d, &["simulate", "s.toml", "-o", out]);
        let t = Table::read(d.join(out).join("frame_000000/points.csv")).unwrap();
        let (class, azimuth) = (t.text("class").unwrap(), t.numbers("azimuth_deg").unwrap());
        [("car", 3.0, 16.4), ("post", -4.0, 26.4)].map(|(name, y, x)| {
            let i =
                class.iter().position(|c| c == name).unwrap_or_else(|| panic!("{out}: no {name}: {class:?}"));
            let off = (azimuth[i] - f64::atan2(y, x).to_degrees()).abs();
            assert!(off.is_finite(), "{out}: {name} at {}", azimuth[i]);
            off
        })
    };
    let without = off("without");
    let with = spoilt.replace(
        "azimuth_bins",
        "angle = { method = \"ml\", sources = 1, calibration_file = \"cal.csv\" }\nazimuth_bins",
    );
    assert_ne!(with, spoilt, "the preset has no azimuth_bins");
    let with = with.replace("azimuth_max_deg = 60", "azimuth_max_deg = 45");
    std::fs::write(d.join("r.toml"), with).unwrap();
    let calibrated = off("with");
    println!("{without:.3?} deg off without, {calibrated:.3?} deg with calibration");
    // Errors of 40 deg in each antenna move a beam of 12 channels by some tenths of a degree (0.41 with this seed).
    assert!(without.iter().all(|e| (0.2..2.0).contains(e)), "{without:?}");
    assert!(calibrated.iter().all(|e| *e < 0.05), "{calibrated:?}");
    // That of another array is named.
    let all = std::fs::read_to_string(d.join("cal.csv")).unwrap();
    let fewer = |line: &&str| line.split(',').nth(2).and_then(|c| c.parse().ok()).is_none_or(|c: u32| c < 8);
    let other: Vec<&str> = all.lines().filter(fewer).collect();
    std::fs::write(d.join("other.csv"), other.join("\n") + "\n").unwrap();
    let radar = std::fs::read_to_string(d.join("r.toml")).unwrap();
    std::fs::write(d.join("r2.toml"), radar.replace("cal.csv", "other.csv")).unwrap();
    let args = ["process", "with/frame_000000/adc.npy", "--radar", "r2.toml", "-o", "no"];
    refused(d, &args, &["other.csv", "another array", "channels"], "no");
    let again = done(d, &["process", "with/frame_000000/adc.npy", "--radar", "r.toml", "-o", "again"]);
    assert_eq!((&again["calibrated"], &again["absolute_levels"]), (&true.into(), &true.into()));
    // The run's folder holds what its radar reads: beside the copy, the manifest's radar is the same.
    let run = d.join("with");
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(run.join("manifest.json")).unwrap()).unwrap();
    let kept = parse(&run.join("radar.toml"), manifest["radar"].as_str().unwrap()).unwrap();
    let text = std::fs::read_to_string(d.join("cal.csv")).unwrap();
    assert_eq!(kept.processing.angle.calibration.unwrap().text, text);
    assert!(manifest["checksums"]["calibration.csv"].is_string(), "{manifest}");
    refused(
        d,
        &["calibrate", "--radar", "r.toml", "--range-m", "1e5", "-o", "no.csv"],
        &["range_m", "below"],
        "no.csv",
    );
}

#[test]
fn impossible_radars_are_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let base = demo();
    let fmcw = "bandwidth_hz";
    for (from, to, parts) in [
        (fmcw, "kind = \"pulse\"\nbandwidth_hz", vec!["does not belong"]),
        (fmcw, "step_hz = 1e6\nbandwidth_hz", vec!["step_hz", "does not belong"]),
        (fmcw, "multiplex = \"xdm\"\nbandwidth_hz", vec!["multiplex"]),
        (fmcw, "multiplex = \"ddm\"\nempty_bands = 2\nbandwidth_hz", vec!["multiple of 5"]),
        (fmcw, "empty_bands = 1\nbandwidth_hz", vec!["only \"ddm\""]),
        ("[receiver]", "[front_end]\nadc = { bits = 99, full_scale_dbm = -20 }\n[receiver]", vec!["bits"]),
        ("[receiver]", "[front_end]\nadcs = 1\n[receiver]", vec!["unknown key"]),
        ("azimuth_bins", "angle = { method = \"music\", sources = 50 }\nazimuth_bins", vec!["sources"]),
        (
            "azimuth_bins",
            "angle = { method = \"ml\", calibration_file = \"x.csv\" }\nazimuth_bins",
            vec!["x.csv"],
        ),
    ] {
        assert!(base.contains(from), "{from}");
        scenario(d, &base.replacen(from, to, 1), "");
        refused(d, &["simulate", "s.toml", "-o", "no", "--device", "cpu"], &parts, "no");
    }
}

/// Of a standing road at 20 m/s front77 sees rates that its chirps, 55 us apart, fold at 17.7 m/s: the flag says modulo what, and
/// only the vehicle's speed decides.
#[test]
fn folds_beyond_the_cycle_are_decided_by_the_speed_alone() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let places: [[f64; 3]; 5] =
        [[20.0, 0.0, 0.5], [28.0, 4.0, 0.5], [37.0, -6.0, 0.5], [46.0, 3.0, 0.5], [16.0, -5.0, 0.5]];
    let mut text =
        "name = \"s\"\nradar = \"front77\"\n[ego]\nposition_m = [0, 0, 0]\nspeed_mps = 20\n".to_string();
    for p in places {
        text += &format!("[[point]]\nposition_m = {p:?}\nrcs_dbsm = 10\n");
    }
    // Ahead, and drawing away at 5 m/s.
    text += "[[point]]\nposition_m = [60, -2, 0.5]\nrcs_dbsm = 20\nvelocity_mps = [25, 0, 0]\n";
    std::fs::write(d.join("s.toml"), text).unwrap();
    done(d, &["simulate", "s.toml", "-o", "run"]);
    let read = |file: &str| -> Vec<(f64, f64, f64, String, String)> {
        let table = catseye::formats::csv::Table::read(d.join(file)).unwrap();
        let n = |name: &str| table.numbers(name).unwrap();
        let (r, v, a) = (n("range_m"), n("range_rate_mps"), n("azimuth_deg"));
        let (state, modulo) =
            (table.text("ambiguity").unwrap(), table.text("range_rate_modulo_mps").unwrap());
        (0..table.len()).map(|i| (r[i], v[i], a[i], state[i].to_string(), modulo[i].to_string())).collect()
    };
    let cycle_mps = 299_792_458.0 / 77e9 / (2.0 * 55e-6);
    let check = |file: &str, known: bool| {
        let points = read(file);
        for p in places {
            // The preset's radar stands 3.6 m ahead of the vehicle's origin.
            let range = (p[0] - 3.6).hypot(p[1]);
            let found = points
                .iter()
                .filter(|q| (q.0 - range).abs() < 1.0)
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let (_, rate, azimuth, state, modulo) =
                found.unwrap_or_else(|| panic!("{file}: nothing at {range}"));
            let stands = -20.0 * azimuth.to_radians().cos();
            let modulo: f64 = modulo.parse().unwrap();
            match known {
                true => {
                    assert!((rate - stands).abs() < 0.5 && state == "ego_speed", "{file}: {rate} {state}")
                }
                false => {
                    assert!(
                        (rate - stands - cycle_mps).abs() < 0.5 && state == "ambiguous",
                        "{file}: {rate} {state}"
                    );
                    assert!((modulo - cycle_mps).abs() < 0.1, "{modulo}");
                }
            }
        }
        let car = points.iter().find(|q| (q.0 - 56.4).abs() < 1.0).unwrap();
        assert!((car.1 - 5.0).abs() < 0.5 && car.3 == "ambiguous", "{file}: {car:?}");
    };
    check("run/frame_000000/points.csv", true);
    let cube = "run/frame_000000/adc.npy";
    done(d, &["process", cube, "--radar", "front77", "-o", "bare"]);
    done(d, &["process", cube, "--radar", "front77", "-o", "told", "--ego-speed-mps", "20"]);
    check("bare/points.csv", false);
    check("told/points.csv", true);
}
