//! Datasets as the program makes them: the same bytes whatever happens on the way, and damage that is found.

use crate::common::{catseye, refused, text};
use catseye::formats::npy;
use catseye_io::store::{Data, DatasetLayout};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SCENES: u32 = 12;

/// A folder with the test's recipe: `SCENES` scenes of three frames, two frames a shard.
fn place() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let recipes = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/recipes");
    let recipe = fs::read_to_string(recipes.join("tiny.toml")).unwrap();
    let recipe = recipe.replace("scenes = 4", &format!("scenes = {SCENES}"));
    let recipe = recipe.replace("train = [0, 2]\nvalidation = [1]\ntest = [3]", "train = 0.5\ntest = 0.5");
    fs::write(dir.path().join("r.toml"), recipe).unwrap();
    fs::copy(recipes.join("tiny_radar.toml"), dir.path().join("tiny_radar.toml")).unwrap();
    dir
}

fn make(dir: &Path, out: &str, more: &[&str]) -> String {
    let args = [&["dataset", "r.toml", "-o", out, "--device", "cpu"], more].concat();
    let done = catseye(dir, &args);
    assert_eq!(done.status.code(), Some(0), "{args:?}: {}", text(&done.stderr));
    text(&done.stdout)
}

/// All files with their bytes.
fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn walk(dir: &Path, top: &Path, all: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for e in fs::read_dir(dir).unwrap() {
            let path = e.unwrap().path();
            if path.is_dir() {
                walk(&path, top, all);
            } else {
                all.insert(path.strip_prefix(top).unwrap().into(), fs::read(&path).unwrap());
            }
        }
    }
    let mut all = BTreeMap::new();
    walk(dir, dir, &mut all);
    all
}

fn same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    let names = |m: &BTreeMap<PathBuf, Vec<u8>>| m.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{} differs", name.display());
    }
}

fn markers(out: &Path) -> usize {
    let count = |d: fs::ReadDir| {
        d.filter(|e| {
            let name = e.as_ref().unwrap().file_name();
            !name.to_string_lossy().starts_with('.')
        })
        .count()
    };
    fs::read_dir(out.join("shards")).map_or(0, count)
}

/// Runs of one recipe in one folder, as when a cluster's scheduler tries again, share the shards; all end with 0, `verify` passes, and the
/// bytes are those of a run alone. One that is killed leaves its shards to the others.
#[test]
fn several_runs_in_one_folder_share_its_shards() {
    let dir = place();
    let at = |name: &str| dir.path().join(name);
    make(dir.path(), "alone", &[]);
    for (attempt, victims) in [0, 0, 1, 0, 1].into_iter().enumerate() {
        let out = format!("together-{attempt}");
        let args = ["dataset", "r.toml", "-o", &out, "--device", "cpu", "--jobs", "1", "--json"];
        let mut children: Vec<Child> = (0..3).map(|_| start(dir.path(), &args)).collect();
        let mut made = 0;
        for (i, child) in children.iter_mut().enumerate() {
            if i < victims {
                let begun = Instant::now();
                while markers(&at(&out)) < 2 && begun.elapsed() < Duration::from_secs(60) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                child.kill().unwrap();
                child.wait().unwrap();
            }
        }
        for child in children.into_iter().skip(victims) {
            let done = child.wait_with_output().unwrap();
            let said = text(&done.stderr);
            assert_eq!(done.status.code(), Some(0), "{said}");
            assert!(!said.contains("os error"), "{said}");
            let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
            assert_eq!(report["complete"], true);
            made += report["frames_made"].as_u64().unwrap();
        }
        assert!(victims > 0 || made == u64::from(3 * SCENES), "{made} frames were made");
        let verified = catseye(dir.path(), &["verify", &out]);
        assert_eq!(verified.status.code(), Some(0), "{}", text(&verified.stderr));
        same(&at("alone"), &at(&out));
    }
}

#[test]
fn bytes_do_not_depend_on_kills_workers_and_shares() {
    let dir = place();
    let at = |name: &str| dir.path().join(name);
    make(dir.path(), "whole", &[]);
    let shards = (3 * SCENES).div_ceil(2) as usize;
    assert_eq!(markers(&at("whole")), shards);

    // Killed again and again, each time after some more shards.
    let mut kills = 0;
    for aim in [1, 4, 9] {
        let args = ["dataset", "r.toml", "-o", "killed", "--device", "cpu", "--jobs", "2"];
        let mut child = start(dir.path(), &args);
        let start = Instant::now();
        while markers(&at("killed")) < aim && child.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < Duration::from_secs(120), "no shard after two minutes");
            std::thread::sleep(Duration::from_millis(1));
        }
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!at("killed/manifest.json").exists() || markers(&at("killed")) == shards);
    }
    assert!(kills > 0, "the run was over before it could be killed");
    // What a kill at a worse moment leaves.
    fs::write(at("killed/shards/.000003.json.partial-1-0"), "{").unwrap();
    fs::create_dir_all(at("killed/.frame_000030.partial")).unwrap();
    fs::write(at("killed/.frame_000030.partial/adc.npy"), "half").unwrap();
    fs::write(at("killed/.layout.json.partial-1-0"), "{").unwrap();
    fs::create_dir_all(at("killed/previews/.frame_000000.partial-1")).unwrap();
    fs::write(at("killed/previews/.frame_000000.partial-1/birds_eye.png"), "half").unwrap();
    make(dir.path(), "killed", &[]);
    same(&at("whole"), &at("killed"));

    make(dir.path(), "one", &["--jobs", "1"]);
    same(&at("whole"), &at("one"));

    let half = shards / 2;
    let said = make(dir.path(), "shares", &["--shards", &format!("{half}:{shards}")]);
    assert!(said.contains(&format!("{} of {shards} shards are complete", shards - half)), "{said}");
    assert!(!at("shares/manifest.json").exists());
    make(dir.path(), "shares", &["--shards", &format!("0:{half}"), "--jobs", "3"]);
    same(&at("whole"), &at("shares"));

    // Complete already: nothing is made.
    assert!(make(dir.path(), "whole", &[]).contains("made 0 frames"));
    same(&at("whole"), &at("shares"));
}

fn start(dir: &Path, args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_catseye"))
        .current_dir(dir)
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Killed at any moment, also in the middle of the datasheet, and completed by the same command: whole, and the same bytes.
#[test]
fn what_dead_runs_leave_is_cleared_up() {
    let dir = place();
    let begin = Instant::now();
    make(dir.path(), "whole", &[]);
    let mut whole = begin.elapsed();
    let mut kills = 0;
    for share in [0.1, 0.25, 0.4, 0.55, 0.65, 0.75, 0.85, 0.95] {
        let out = format!("d{share}");
        let mut child = start(dir.path(), &["dataset", "r.toml", "-o", &out, "--device", "cpu"]);
        // The machine may have become faster since; a run that ends before its time says how long a whole one takes now.
        let begin = Instant::now();
        while begin.elapsed() < whole.mul_f64(share) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        match child.try_wait().unwrap() {
            None => kills += 1,
            Some(_) => whole = begin.elapsed(),
        }
        child.kill().unwrap();
        child.wait().unwrap();
        make(dir.path(), &out, &[]);
        let found = catseye(dir.path(), &["verify", &out]);
        assert_eq!(found.status.code(), Some(0), "{share}: {}{}", text(&found.stdout), text(&found.stderr));
        same(&dir.path().join("whole"), &dir.path().join(&out));
    }
    assert!(kills > 3, "{kills} of 8 runs were killed");
}

/// The frames of one scene in one shard are made by all workers, and the bytes are those of one worker.
#[test]
fn one_shard_of_one_scene_is_shared_out() {
    let dir = place();
    let recipe = fs::read_to_string(dir.path().join("r.toml")).unwrap();
    let recipe =
        recipe.replace("scenes = 12", "scenes = 1").replace("frames_per_scene = 3", "frames_per_scene = 21");
    let recipe = recipe.replace("frames_per_shard = 2", "frames_per_shard = 100");
    fs::write(dir.path().join("r.toml"), recipe.replace("train = 0.5\ntest = 0.5", "train = 1")).unwrap();
    make(dir.path(), "one", &["--jobs", "1"]);
    make(dir.path(), "four", &["--jobs", "4"]);
    same(&dir.path().join("one"), &dir.path().join("four"));
}

/// Every scene is drawn and read before the first frame; a mended recipe keeps the shards that are the same, and the
/// dataset is then that of the mended one.
#[test]
fn recipes_are_checked_first_and_can_be_mended() {
    let dir = place();
    let at = |name: &str| dir.path().join(name);
    let recipe = fs::read_to_string(at("r.toml")).unwrap();
    let write = |from: &str, to: &str| fs::write(at("r.toml"), recipe.replace(from, to)).unwrap();
    let rcs = "rcs_dbsm = { uniform = [0, 10] }";

    write(rcs, "rcs_dbsm = { normal = [0, 150] }");
    let args = ["dataset", "r.toml", "-o", "d", "--device", "cpu"];
    let says = [
        "r.toml:",
        "scenario.point[0].rcs_dbsm = ",
        "(drawn from { normal = [0, 150] }) in scene ",
        "allowed: ",
    ];
    refused(dir.path(), &args, &says);
    assert!(!at("d").exists(), "something was made");

    let made = |out: &str| -> (u64, u64) {
        let report = make(dir.path(), out, &["--json"]);
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["complete"], true);
        (report["shards_kept"].as_u64().unwrap(), report["frames_made"].as_u64().unwrap())
    };
    write(rcs, "rcs_dbsm = { choice = [5, 6], weights = [3, 1] }");
    assert_eq!(made("d"), (0, 36));
    // Scenes that draw the second value change, the others stay.
    write(rcs, "rcs_dbsm = { choice = [5, 7], weights = [3, 1] }");
    let (kept, frames) = made("d");
    assert!((1..18).contains(&kept) && frames == 36 - 2 * kept, "{kept} {frames}");
    made("fresh");
    same(&at("d"), &at("fresh"));
    // Fewer scenes, and more: none moves between train and test, so every shard of whole scenes stays.
    for scenes in [8, 12, 13] {
        let text = fs::read_to_string(at("r.toml")).unwrap();
        let line = text.lines().find(|l| l.starts_with("scenes = ")).unwrap().to_string();
        fs::write(at("r.toml"), text.replace(&line, &format!("scenes = {scenes}"))).unwrap();
        assert!(made("d").0 >= 12);
        made(&format!("fresh{scenes}"));
        same(&at("d"), &at(&format!("fresh{scenes}")));
    }
    let whole = catseye(dir.path(), &["verify", "d"]);
    assert_eq!(whole.status.code(), Some(0), "{}", text(&whole.stdout));
    // Where no shard was complete there is nothing to lose, and frames of it do not stay.
    make(dir.path(), "e", &["--shards", "19:20"]);
    fs::remove_file(at("e/shards/000019.json")).unwrap();
    write(rcs, "rcs_dbsm = 3");
    assert_eq!(made("e"), (0, 36));
    made("f");
    same(&at("e"), &at("f"));
}

/// Ctrl-C ends a run with 130 and says how to go on; SIGTERM does the same.
#[cfg(unix)]
#[test]
fn interruptions_say_how_to_go_on() {
    let dir = place();
    let interrupt = |child: Child, signal: &str| -> Option<String> {
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let out = child.wait_with_output().unwrap();
        assert!(sent.success());
        match out.status.code() {
            // Over already, or not yet listening.
            Some(0) | None => None,
            code => {
                assert_eq!(code, Some(130), "{}", text(&out.stderr));
                Some(text(&out.stderr))
            }
        }
    };
    // On a busy machine a run may be over before the signal reaches it; such a run is no trial.
    let trial = || {
        let _ = fs::remove_dir_all(dir.path().join("d"));
        let args = ["dataset", "r.toml", "-o", "d", "--device", "cpu", "--jobs", "1"];
        let mut child = start(dir.path(), &args);
        while markers(&dir.path().join("d")) < 2 {
            // Of one that is over and was waited for no process is left to take a signal.
            if child.try_wait().unwrap().is_some() {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        interrupt(child, "-INT")
    };
    let said = (0..50).find_map(|_| trial()).expect("every run was over before it could be interrupted");
    let line = said.lines().find(|l| l.starts_with("interrupted: ")).unwrap();
    assert!(line.ends_with(" of 36 frames are complete; the same command continues"), "{line}");
    let frames: usize = line["interrupted: ".len()..].split(' ').next().unwrap().parse().unwrap();
    assert_eq!(frames, 2 * markers(&dir.path().join("d")));
    make(dir.path(), "d", &[]);
    make(dir.path(), "whole", &[]);
    same(&dir.path().join("d"), &dir.path().join("whole"));

    // How long it takes to begin and to end depends on the machine.
    let trial = |k: u64| {
        let child = start(dir.path(), &["validate", "--device", "cpu"]);
        std::thread::sleep(Duration::from_millis(40 * k));
        interrupt(child, "-TERM")
    };
    let said = (1..50).find_map(trial).expect("every one was over before it could be interrupted");
    assert!(said.contains("nothing is kept; the same command starts again from the beginning"), "{said}");
}

/// `verify` takes what `simulate` wrote too.
#[test]
fn runs_are_verified() {
    let dir = place();
    let run = |args: &[&str]| {
        let out = catseye(dir.path(), args);
        assert_eq!(out.status.code(), Some(0), "{}{}", text(&out.stdout), text(&out.stderr));
        text(&out.stdout)
    };
    run(&["dataset", "r.toml", "--scene", "0", "-o", "s"]);
    run(&["simulate", "s/scenario.toml", "-o", "run", "--device", "cpu"]);
    assert!(run(&["verify", "run"]).contains("is complete: 3 frames, "));
    let file = dir.path().join("run/frame_000001/points.csv");
    fs::write(dir.path().join("run/notes.txt"), "mine").unwrap();
    fs::write(&file, fs::read_to_string(&file).unwrap() + "\n").unwrap();
    fs::remove_file(dir.path().join("run/frame_000002/points.csv")).unwrap();
    let found = catseye(dir.path(), &["verify", "run"]);
    assert_eq!(found.status.code(), Some(2));
    let lines = text(&found.stdout);
    for says in [
        "foreign files: 1: notes.txt",
        "missing files: 1: frame_000002/points.csv",
        "wrong checksums: 1: frame_000001/points.csv",
    ] {
        assert!(lines.contains(says), "{says}: {lines}");
    }
}

#[test]
fn a_scene_by_itself_is_that_of_the_dataset() {
    let dir = place();
    make(dir.path(), "all", &[]);
    let out = catseye(dir.path(), &["dataset", "r.toml", "--scene", "5", "-o", "five"]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let scenario = fs::read_to_string(dir.path().join("five/scenario.toml")).unwrap();
    assert!(scenario.contains("count = 3") && scenario.contains("road = \"road.toml\""), "{scenario}");
    assert!(dir.path().join("five/road.toml").exists() && dir.path().join("five/tiny_radar.toml").exists());
    // Its seed is the one of the table.
    let frames = fs::read_to_string(dir.path().join("all/frame_000015/frames.csv")).unwrap();
    let seed = scenario.lines().find_map(|l| l.strip_prefix("seed = ")).unwrap();
    assert!(frames.contains(&format!(",{seed},")), "{frames} {seed}");
    refused(dir.path(), &["dataset", "r.toml", "--scene", "12", "-o", "no"], &["scene = 12", "0..=11"]);
}

/// Masks and grids of a dataset are those that a run of the same scene writes.
#[test]
fn masks_of_a_dataset_are_those_of_its_scenes() {
    let dir = place();
    let recipe = fs::read_to_string(dir.path().join("r.toml")).unwrap();
    fs::write(dir.path().join("r.toml"), recipe.replace("[keep]\n", "[keep]\nmasks = true\n")).unwrap();
    make(dir.path(), "d", &["--shards", "0:5"]);
    let out = catseye(dir.path(), &["dataset", "r.toml", "--scene", "2", "-o", "two"]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let scenario = dir.path().join("two/scenario.toml");
    let mut said = fs::read_to_string(&scenario).unwrap();
    assert!(!said.contains("[output]"), "{said}");
    said += "\n[output]\nmasks = true\nplots = false\n";
    fs::write(&scenario, said).unwrap();
    let run = catseye(dir.path(), &["simulate", "two/scenario.toml", "-o", "run", "--device", "cpu"]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    // A scene of the dataset is exported as its run is.
    let two = ["export", "d", "--scene", "2", "--format"];
    let formats = [("pcd", "clouds"), ("coco", "coco"), ("kitti", "kitti"), ("osi", "a_sd.osi")];
    for (format, name) in formats.into_iter().filter(|(format, _)| cfg!(feature = "osi") || *format != "osi")
    {
        let (run, scene) = (format!("run_{name}"), format!("scene_{name}"));
        for (args, to) in [(&["export", "run", "--format"][..], &run), (&two[..], &scene)] {
            let args = [args, &[format, "-o", to]].concat();
            let out = catseye(dir.path(), &args);
            assert_eq!(out.status.code(), Some(0), "{args:?}: {}", text(&out.stderr));
        }
        match dir.path().join(&run).is_dir() {
            true => same(&dir.path().join(&run), &dir.path().join(&scene)),
            false => assert!(
                fs::read(dir.path().join(&run)).unwrap() == fs::read(dir.path().join(&scene)).unwrap()
            ),
        }
    }
    if cfg!(feature = "osi") {
        refused(dir.path(), &["export", "d", "--format", "osi", "-o", "b_sd.osi"], &["--scene", "0 to 11"]);
    }
    refused(dir.path(), &["export", "d", "--scene", "12", "--format", "pcd", "-o", "c"], &["no such scene"]);
    let folder = dir.path().join("d");
    let layout = DatasetLayout::open(&folder).unwrap();
    for (frame, of_scene) in [(6, 0), (8, 2)] {
        for name in ["grid_road", "mask_road", "grid_markers", "mask_markers"] {
            let stored = layout.read_array(&folder, name, frame).unwrap();
            let file = dir.path().join(format!("run/frame_{of_scene:06}/{name}.npy"));
            let same = match &stored.data {
                Data::F32(planes) => *planes == npy::read::<f32>(&file).unwrap().data,
                Data::U8(classes) => *classes == npy::read::<u8>(&file).unwrap().data,
                _ => false,
            };
            assert!(same, "{name} of frame {frame}");
            let packed = folder.join(format!("frame_{frame:06}/{name}.npz"));
            assert!(20 * fs::metadata(packed).unwrap().len() < fs::metadata(file).unwrap().len(), "{name}");
        }
    }
    let Data::U8(mask) = layout.read_array(&folder, "mask_road", 6).unwrap().data else { panic!("a mask") };
    assert!(mask.contains(&1), "no cell is of a lane");
    let layout = fs::read_to_string(dir.path().join("d/layout.json")).unwrap();
    assert!(layout.contains("0 undefined, 1 lane, 2 vehicle, 3 guard rail, 4 marker"), "{layout}");
}

#[test]
fn foreign_folders_and_recipes_are_left_alone() {
    let dir = place();
    let run = |more: &[&'static str]| [&["dataset", "r.toml", "--device", "cpu"], more].concat();
    make(dir.path(), "d", &["--shards", "0:1"]);
    let before = files(&dir.path().join("d"));
    let recipe = fs::read_to_string(dir.path().join("r.toml")).unwrap();
    fs::write(dir.path().join("r.toml"), recipe.replace("seed = 3", "seed = 4")).unwrap();
    refused(dir.path(), &run(&["-o", "d"]), &["holds a dataset of another recipe ('tiny')", "--force"]);
    fs::write(dir.path().join("r.toml"), &recipe).unwrap();
    refused(dir.path(), &run(&["-o", "d", "--seed", "9"]), &["holds a dataset of seed 3"]);
    refused(dir.path(), &run(&["-o", "d", "--precision", "f64"]), &["another device", "--mixed-devices"]);
    refused(dir.path(), &run(&["-o", "d", "--shards", "5:99"]), &["--shards = 5:99", "0:18"]);
    refused(dir.path(), &run(&["-o", "d", "--shards", "3:3"]), &["no such shards"]);
    refused(dir.path(), &run(&["-o", "d", "--shards", "x"]), &["is not a range of shards", "0:16"]);
    refused(dir.path(), &run(&["-o", "d", "--shards", "0:1", "--force"]), &["--force"]);
    refused(dir.path(), &run(&["-o", "d", "--jobs", "0"]), &["--jobs = 0"]);
    let radar = fs::read_to_string(dir.path().join("tiny_radar.toml")).unwrap();
    fs::write(dir.path().join("tiny_radar.toml"), radar.replace("power_dbm = 12", "power_dbm = 9")).unwrap();
    refused(dir.path(), &run(&["-o", "d"]), &["a file that it names has changed"]);
    fs::write(dir.path().join("tiny_radar.toml"), radar).unwrap();
    assert_eq!(files(&dir.path().join("d")), before, "something was changed");

    fs::create_dir(dir.path().join("thesis")).unwrap();
    fs::write(dir.path().join("thesis/chapter.tex"), "years").unwrap();
    refused(dir.path(), &run(&["-o", "thesis"]), &["holds something other than a dataset", "another name"]);
    refused(dir.path(), &run(&["-o", "thesis", "--force"]), &["holds something other than a dataset"]);
    refused(dir.path(), &run(&["-o", "r.toml"]), &["is a file"]);
    refused(dir.path(), &["verify", "thesis"], &["no dataset.json"]);
    refused(dir.path(), &["verify", "nowhere"], &["no dataset.json"]);

    // Another recipe by force: nothing of the first stays.
    fs::write(dir.path().join("r.toml"), recipe.replace("seed = 3", "seed = 4")).unwrap();
    fs::write(dir.path().join("d/shards/mine.txt"), "years").unwrap();
    refused(
        dir.path(),
        &run(&["-o", "d", "--force"]),
        &["holds 'shards/mine.txt', which catseye did not write"],
    );
    fs::remove_file(dir.path().join("d/shards/mine.txt")).unwrap();
    make(dir.path(), "d", &["--force"]);
    make(dir.path(), "e", &[]);
    same(&dir.path().join("d"), &dir.path().join("e"));
}

#[test]
fn damage_is_found_and_mended() {
    let dir = place();
    make(dir.path(), "d", &[]);
    make(dir.path(), "good", &[]);
    let d = dir.path().join("d");
    let whole = catseye(dir.path(), &["verify", "d"]);
    assert_eq!(whole.status.code(), Some(0), "{}{}", text(&whole.stdout), text(&whole.stderr));
    assert!(text(&whole.stdout).contains("is complete: 36 frames in 18 shards"), "{}", text(&whole.stdout));

    let found = |says: &[&str]| {
        let out = catseye(dir.path(), &["verify", "d"]);
        assert_eq!(out.status.code(), Some(2), "{says:?}");
        let lines = text(&out.stdout);
        for s in says {
            assert!(lines.lines().any(|l| l.starts_with(s)), "{s}: {lines}");
        }
        assert_eq!(lines.lines().count(), says.len(), "{lines}");
        let json = catseye(dir.path(), &["verify", "d", "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
        assert_eq!(json["problems"].as_array().unwrap().len(), says.len());
    };
    let flip = |name: &str| {
        let mut bytes = fs::read(d.join(name)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(d.join(name), bytes).unwrap();
    };
    flip("frame_000004/adc.npy");
    found(&["wrong checksums: 1: frame_000004/adc.npy"]);
    flip("frame_000004/adc.npy");
    flip("README.md");
    found(&["wrong checksums: 1: README.md"]);
    flip("README.md");
    fs::remove_file(d.join("frame_000007/points.csv")).unwrap();
    fs::write(d.join("frame_000002/notes.txt"), "mine").unwrap();
    found(&["foreign files: 1: frame_000002/notes.txt", "missing files: 1: frame_000007/points.csv"]);
    fs::remove_file(d.join("frame_000002/notes.txt")).unwrap();
    // A run makes the shard again that has lost a file.
    make(dir.path(), "d", &[]);
    same(&d, &dir.path().join("good"));

    let marker = fs::read_to_string(d.join("shards/000003.json")).unwrap();
    fs::write(d.join("shards/000099.json"), &marker).unwrap();
    found(&["foreign shards: 1: shards/000099.json"]);
    fs::remove_file(d.join("shards/000099.json")).unwrap();
    fs::copy(d.join("shards/000003.json"), d.join("shards/000004.json")).unwrap();
    found(&["shards that overlap others: 1: shards/000004.json", "wrong checksums: 1: shards/000004.json"]);
    make(dir.path(), "d", &[]);
    same(&d, &dir.path().join("good"));
    let hash = marker.find("\"recipe\": \"").unwrap() + 11;
    let mut other = marker.clone().into_bytes();
    other[hash] = if other[hash] == b'0' { b'1' } else { b'0' };
    fs::write(d.join("shards/000003.json"), other).unwrap();
    found(&["shards of another recipe: 1: shards/000003.json", "wrong checksums: 1: shards/000003.json"]);
    fs::write(d.join("shards/000003.json"), "{").unwrap();
    found(&["damaged markers: 1: shards/000003.json", "wrong checksums: 1: shards/000003.json"]);
    fs::remove_file(d.join("shards/000003.json")).unwrap();
    found(&["missing files: 1: shards/000003.json", "missing shards: 1: 3"]);
    make(dir.path(), "d", &[]);
    same(&d, &dir.path().join("good"));
    fs::write(d.join("dataset.json"), "{").unwrap();
    refused(dir.path(), &["verify", "d"], &["dataset.json", "damaged"]);
    refused(dir.path(), &["dataset", "r.toml", "-o", "d", "--device", "cpu"], &["dataset.json", "damaged"]);
}

/// A disk that takes no more: what is complete stays, and a later run ends the dataset.
#[test]
fn a_failed_write_loses_nothing() {
    let dir = place();
    make(dir.path(), "good", &[]);
    make(dir.path(), "d", &["--shards", "0:4"]);
    // A file stands where a folder has to be made.
    fs::write(dir.path().join("d/.frame_000013.partial"), "in the way").unwrap();
    let out = catseye(dir.path(), &["dataset", "r.toml", "-o", "d", "--device", "cpu", "--jobs", "1"]);
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    let line = said.lines().find(|l| l.starts_with("error:")).unwrap();
    // Those of the first command, and those that were in work when it failed.
    let complete = markers(&dir.path().join("d"));
    let told = format!("{complete} of 18 shards are complete");
    assert!((4..18).contains(&complete), "{line}");
    assert!(!dir.path().join("d/shards/000006.json").exists(), "{line}");
    assert!(line.contains(".frame_000013.partial") && line.contains(&told), "{line}");
    fs::remove_file(dir.path().join("d/.frame_000013.partial")).unwrap();
    make(dir.path(), "d", &[]);
    same(&dir.path().join("d"), &dir.path().join("good"));
}

#[test]
fn every_frame_is_described() {
    let dir = place();
    make(dir.path(), "d", &[]);
    let d = dir.path().join("d");
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(d.join(name)).unwrap()).unwrap()
    };
    let statistics = json("statistics.json");
    assert_eq!((&statistics["frames"], &statistics["scenes"]), (&36.into(), &12.into()));
    // Counted again from the files.
    let rows = |name: &str| -> usize {
        (0..36)
            .map(|f| {
                fs::read_to_string(d.join(format!("frame_{f:06}/{name}.csv"))).unwrap().lines().count() - 1
            })
            .sum()
    };
    assert_eq!(statistics["points"].as_u64(), Some(rows("points") as u64));
    assert!(rows("points") > 36);
    let binned: u64 = statistics["points_by_range_m"]["counts"]
        .as_object()
        .unwrap()
        .values()
        .map(|n| n.as_u64().unwrap())
        .sum();
    assert_eq!(binned, rows("points") as u64);
    assert_eq!(rows("frames"), 36);
    let schema = json("schema.json");
    assert_eq!(schema["arrays"]["adc"]["shape"], serde_json::json!([36, 16, 4, 64]));
    for table in ["frames", "radars", "points", "returns", "boxes", "lanes", "lines", "markers"] {
        let header = fs::read_to_string(d.join(format!("frame_000000/{table}.csv"))).unwrap();
        let columns: Vec<&str> = header.lines().next().unwrap().split(',').collect();
        let known: Vec<&str> =
            schema["tables"][table]["columns"].as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(columns, known, "{table}");
    }
    let readme = fs::read_to_string(d.join("README.md")).unwrap();
    for says in [
        "# tiny",
        "36 frames",
        "| train | 6 | 18 |",
        "| test | 6 | 18 |",
        "| car |",
        "Not stated",
        "previews/frame_000000/",
    ] {
        assert!(readme.contains(says), "{says}: {readme}");
    }
    for picture in ["range_doppler.png", "birds_eye.png"] {
        assert!(d.join("previews/frame_000018").join(picture).exists());
    }
    let manifest = json("manifest.json");
    assert_eq!(manifest["checksums"].as_object().unwrap().len() + 1, files(&d).len());
}

/// Bytes of all files below a folder.
fn bytes(dir: &Path) -> f64 {
    files(dir).values().map(Vec::len).sum::<usize>() as f64
}

fn number(json: &str, key: &str) -> f64 {
    let at = json.find(&format!("\"{key}\":")).unwrap_or_else(|| panic!("{key} in {json}")) + key.len() + 3;
    json[at..].split([',', '}', '\n']).next().unwrap().trim().parse().unwrap()
}

/// What a dataset will take is told beforehand, with its tables: of the recipe that `init` writes and of an unlike one, which keeps
/// samples and echoes and has other sizes of frames.
#[test]
fn a_dry_run_tells_the_bytes_of_a_dataset() {
    let dir = place();
    let recipe = catseye(dir.path(), &["init", "recipe"]);
    assert_eq!(recipe.status.code(), Some(0), "{}", text(&recipe.stderr));
    let recipe = fs::read_to_string(dir.path().join("recipe.toml")).unwrap();
    let few =
        recipe.replace("scenes = 100", "scenes = 4").replace("frames_per_scene = 4", "frames_per_scene = 1");
    assert_ne!(few, recipe);
    fs::write(dir.path().join("recipe.toml"), few).unwrap();
    for file in ["recipe.toml", "r.toml"] {
        let run = |more: &[&str]| {
            let done = catseye(dir.path(), &[&["dataset", file, "--device", "cpu"], more].concat());
            assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
            text(&done.stdout)
        };
        let told = run(&["--dry-run", "--json"]);
        // Words as well as numbers; of the small recipe, for a dry run makes frames.
        if file == "r.toml" {
            assert!(run(&["--dry-run"]).contains("MiB a frame with its tables"));
        }
        run(&["-o", "made"]);
        let (told_bytes, made) = (number(&told, "bytes"), bytes(&dir.path().join("made")));
        assert!((told_bytes / made - 1.0).abs() < 0.3, "{file}: told {told_bytes}, made {made}");
        let frames = fs::read_dir(dir.path().join("made")).unwrap().filter_map(|e| {
            let e = e.unwrap();
            e.file_name().to_string_lossy().starts_with("frame_").then(|| bytes(&e.path()))
        });
        let (n, sum) = frames.fold((0, 0.0), |(n, sum), b| (n + 1, sum + b));
        let (told_frame, frame) = (number(&told, "bytes_a_frame"), sum / f64::from(n));
        assert!((told_frame / frame - 1.0).abs() < 0.3, "{file}: told {told_frame}, a frame has {frame}");
        fs::remove_dir_all(dir.path().join("made")).unwrap();
    }
    refused(dir.path(), &["dataset", "r.toml"], &["--output"]);
}

/// A run's bytes are told with its tables: where samples and pictures are the most, and where the echoes are.
#[test]
fn a_dry_run_tells_the_bytes_of_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let done = catseye(dir.path(), &[args, &["--device", "cpu"]].concat());
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        text(&done.stdout)
    };
    run(&["init", "scenario"]);
    let scenario = fs::read_to_string(dir.path().join("scenario.toml")).unwrap();
    let bare: String =
        scenario.lines().take_while(|l| !l.starts_with("[output]")).map(|l| format!("{l}\n")).collect();
    fs::write(dir.path().join("bare.toml"), bare + "[output]\nadc = false\nplots = false\n").unwrap();
    for file in ["scenario.toml", "bare.toml"] {
        let told = number(&run(&["simulate", file, "--dry-run", "--json"]), "disk_bytes_per_frame");
        run(&["simulate", file, "-o", "run", "--force"]);
        let made = bytes(&dir.path().join("run/frame_000000"));
        assert!((told / made - 1.0).abs() < 0.3, "{file}: told {told}, made {made}");
    }
}

/// A recipe that names no format is made by every build, and in the same format.
#[test]
fn a_recipe_without_a_format_works_in_every_build() {
    let dir = place();
    let path = dir.path().join("r.toml");
    let recipe = fs::read_to_string(&path).unwrap();
    assert!(recipe.contains("format = \"frames\"\n"));
    fs::write(&path, recipe.replace("format = \"frames\"\n", "")).unwrap();
    make(dir.path(), "d", &[]);
    let layout = fs::read_to_string(dir.path().join("d/layout.json")).unwrap();
    assert!(layout.contains("\"frames\","), "{layout}");
    assert_eq!(catseye(dir.path(), &["verify", "d"]).status.code(), Some(0));
}

/// A recipe of a format that this build does not write can be looked at, and a dataset in it can be checked.
#[test]
fn formats_of_other_builds_can_be_drawn_and_verified() {
    let dir = place();
    make(dir.path(), "d", &[]);
    let recipe = fs::read_to_string(dir.path().join("r.toml")).unwrap();
    fs::write(dir.path().join("z.toml"), recipe.replace("format = \"frames\"", "format = \"zarr\"")).unwrap();
    let drawn = catseye(dir.path(), &["dataset", "z.toml", "--scene", "2", "-o", "s2"]);
    assert_eq!(drawn.status.code(), Some(0), "{}", text(&drawn.stderr));
    assert!(dir.path().join("s2/scenario.toml").is_file());
    if !cfg!(feature = "zarr") {
        refused(
            dir.path(),
            &["dataset", "z.toml", "-o", "z"],
            &["z.toml:", "store.format", "--features zarr"],
        );
    }
    // A layout of Zarr is none that is refused; here it is only not the one that was written.
    let layout = dir.path().join("d/layout.json");
    let text_of = fs::read_to_string(&layout).unwrap();
    fs::write(&layout, text_of.replace("\"frames\",", "\"zarr\",")).unwrap();
    let found = catseye(dir.path(), &["verify", "d"]);
    let said = text(&found.stdout);
    assert!(said.starts_with("wrong checksums: 1: layout.json"), "{said} {}", text(&found.stderr));
}

/// A folder whose name is no text is one like any other.
#[cfg(unix)]
#[test]
fn a_folder_may_have_any_name() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let dir = place();
    let name = OsStr::from_bytes(b"\xff\xfedata");
    let mut run = Command::new(env!("CARGO_BIN_EXE_catseye"));
    let done =
        run.current_dir(dir.path()).args(["dataset", "r.toml", "--device", "cpu", "-o"]).arg(name).output();
    let done = done.unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(dir.path().join(name).join("dataset.json").exists());
    // JSON cannot hold the name as it is, and that is no failure.
    let mut verify = Command::new(env!("CARGO_BIN_EXE_catseye"));
    let done = verify.current_dir(dir.path()).arg("verify").arg(name).arg("--json").output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("\u{fffd}data"), "{}", text(&done.stdout));
}

/// A CSV table by its columns.
fn columns(path: &Path) -> BTreeMap<String, Vec<String>> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<String> = lines.next().unwrap().split(',').map(String::from).collect();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    let column = |i: usize| rows.iter().map(|r| r[i].to_string()).collect();
    names.into_iter().enumerate().map(|(i, name)| (name, column(i))).collect()
}

/// Cars of many parts in place of the recipe's plain ones.
fn with_parts(dir: &Path) {
    let recipe = fs::read_to_string(dir.join("r.toml")).unwrap();
    let mended = recipe.replace("passenger-car", "sedan").replace("scenes = 12", "scenes = 4");
    assert_ne!(recipe, mended);
    fs::write(dir.join("r.toml"), mended).unwrap();
}

/// One filter leaves one row for each car; counts of points are those of the table of points.
#[test]
fn boxes_name_their_whole_and_count_its_points() {
    let dir = place();
    with_parts(dir.path());
    make(dir.path(), "d", &[]);
    let (mut cars, mut parts, mut on, mut lobes) = (0, 0, 0, 0);
    for f in 0..12 {
        let frame = dir.path().join(format!("d/frame_{f:06}"));
        let (boxes, points) = (columns(&frame.join("boxes.csv")), columns(&frame.join("points.csv")));
        let (ids, parents) = (&boxes["id"], &boxes["parent_id"]);
        let row: BTreeMap<&str, usize> = ids.iter().enumerate().map(|(i, id)| (id.as_str(), i)).collect();
        assert_eq!(row.len(), ids.len());
        let number = |name: &str, i: usize| boxes[name][i].parse::<f64>().unwrap_or(f64::NAN);
        for i in 0..ids.len() {
            let whole = row[parents[i].as_str()];
            assert_eq!(parents[whole], ids[whole]);
            assert_eq!(whole == i, boxes["part"][i].is_empty());
            let class = boxes["class"][i].split('.').next().unwrap();
            assert_eq!(class, boxes["class"][whole].split('.').next().unwrap());
            // What it is called as a part is the end of its class.
            if whole != i {
                parts += 1;
                assert!(
                    boxes["class"][i].ends_with(&format!(".{}", boxes["part"][i])),
                    "{}",
                    boxes["class"][i]
                );
                assert!(number("length_m", i) <= number("length_m", whole));
                assert!(number("returns", i) <= number("returns", whole));
            } else if boxes["class"][i] == "car" {
                cars += 1;
                assert!((3.5..5.5).contains(&number("length_m", i)), "{}", number("length_m", i));
            }
            assert_eq!(number("power_dbm", i).is_nan(), boxes["returns"][i] == "0");
            // Counted again from the points: of a whole with its parts, of a part alone.
            let mine = |k: &usize| {
                let object = &points["object_id"][*k];
                row.get(object.as_str()).is_some_and(|o| *o == i || (whole == i && parents[*o] == ids[i]))
            };
            let count = |ghost: &str, side_lobe: &str| {
                let all = (0..points["ghost"].len()).filter(mine);
                let flags = |k: &usize| points["ghost"][*k] == ghost && points["side_lobe"][*k] == side_lobe;
                all.filter(flags).count() as f64
            };
            let told = [number("points", i), number("ghosts", i), number("side_lobes", i)];
            assert_eq!(told, [count("false", "false"), count("true", "false"), count("false", "true")]);
            if whole == i {
                (on, lobes) = (on + told[0] as usize, lobes + told[2] as usize);
            }
        }
        for (class, object) in points["class"].iter().zip(&points["object_id"]) {
            // There is no point without a label.
            assert_eq!(object == "0", ["leakage", "noise", "weather"].contains(&class.as_str()), "{class}");
        }
    }
    println!("{cars} cars, {parts} parts, {on} points on objects, {lobes} in side lobes");
    assert!(cars > 3 && parts > cars && on > 12, "{cars} {parts} {on}");
    // The datasheet counts the same side lobes.
    let read = fs::read(dir.path().join("d/statistics.json")).unwrap();
    let statistics: serde_json::Value = serde_json::from_slice(&read).unwrap();
    let told = statistics["classes"].as_object().unwrap().values().map(|c| c["side_lobes"].as_u64().unwrap());
    assert_eq!(told.sum::<u64>(), lobes as u64);
}

/// A dataset from before the newest columns is whole, and is compared with a new one by the columns that both have.
#[test]
fn datasets_without_the_newest_columns_are_read() {
    const NEW: [&str; 9] = [
        "parent_id",
        "part",
        "visible",
        "returns",
        "power_dbm",
        "points",
        "ghosts",
        "side_lobes",
        "side_lobe",
    ];
    let dir = place();
    with_parts(dir.path());
    make(dir.path(), "new", &[]);
    make(dir.path(), "old", &[]);
    let d = dir.path().join("old");
    let is_new = |table: &str, column: &str| {
        NEW.contains(&column) && (table == "boxes" || (table == "points" && column == "side_lobe"))
    };
    let edit = |name: &str, change: &dyn Fn(&mut serde_json::Value)| {
        let mut v: serde_json::Value = serde_json::from_slice(&fs::read(d.join(name)).unwrap()).unwrap();
        change(&mut v);
        fs::write(d.join(name), serde_json::to_string_pretty(&v).unwrap()).unwrap();
    };
    edit("layout.json", &|v| {
        for table in v["layout"]["tables"].as_array_mut().unwrap() {
            let name = table["name"].as_str().unwrap().to_string();
            let list = table["columns"].as_array_mut().unwrap();
            list.retain(|c| !is_new(&name, c["name"].as_str().unwrap()));
        }
    });
    for f in 0..12 {
        for table in ["boxes", "points"] {
            let path = d.join(format!("frame_{f:06}/{table}.csv"));
            let text = fs::read_to_string(&path).unwrap();
            let keep: Vec<bool> =
                text.lines().next().unwrap().split(',').map(|c| !is_new(table, c)).collect();
            assert!(keep.contains(&false));
            let line = |l: &str| {
                let cells: Vec<&str> = l.split(',').zip(&keep).filter(|(_, k)| **k).map(|(c, _)| c).collect();
                cells.join(",") + "\n"
            };
            fs::write(&path, text.lines().map(line).collect::<String>()).unwrap();
        }
    }
    // As the one that made it would have noted it.
    let sum = |name: &str| catseye::formats::stage::sha256_of_file(d.join(name)).unwrap();
    for f in 0..12 {
        edit(&format!("frame_{f:06}/frame.json"), &|v| {
            for file in v["files"].as_array_mut().unwrap() {
                let name = format!("frame_{f:06}/{}", file["path"].as_str().unwrap());
                file["bytes"] = fs::metadata(d.join(&name)).unwrap().len().into();
                file["sha256"] = sum(&name).into();
            }
        });
    }
    for shard in 0..6 {
        edit(&format!("shards/{shard:06}.json"), &|v| {
            for file in v["files"].as_array_mut().unwrap() {
                let name = file["path"].as_str().unwrap().to_string();
                file["bytes"] = fs::metadata(d.join(&name)).unwrap().len().into();
                file["sha256"] = sum(&name).into();
            }
            for class in v["tally"]["classes"].as_object_mut().unwrap().values_mut() {
                class.as_object_mut().unwrap().retain(|key, _| key == "objects" || key == "points");
            }
        });
    }
    edit("manifest.json", &|v| {
        for (name, old) in v["checksums"].as_object_mut().unwrap() {
            *old = sum(name).into();
        }
    });
    let verified = catseye(dir.path(), &["verify", "old"]);
    assert_eq!(verified.status.code(), Some(0), "{}", text(&verified.stdout));
    let apart = catseye(dir.path(), &["diff", "old", "new", "--json"]);
    assert_eq!(apart.status.code(), Some(1), "{}", text(&apart.stderr));
    let found: serde_json::Value = serde_json::from_str(&text(&apart.stdout)).unwrap();
    let list = found["differences"].as_array().unwrap();
    let header = |d: &serde_json::Value| d["place"] == "header" && d["a"].is_null();
    assert!(!list.is_empty() && list.iter().all(header), "{}", text(&apart.stdout));
}
