//! Frames that share submissions of a device leave the same files as frames that are made singly.

use catseye::base::error::Error;
use catseye::engine::{Engine, Precision};
use catseye::formats::stage::files_of;
use catseye::gpu::compare::opened_for_tests;
use catseye::scene::scenario;
use catseye_io::datasheet::DatasetManifest;
use catseye_io::produce::{Options, Report, produce};
use catseye_io::recipe::Recipe;
use catseye_io::run::{RunOptions, RunReport, run};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

const BATCHES: [usize; 3] = [1, 3, 64];

fn recipes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/recipes")
}

/// All files of a folder but those that tell how long it took.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let names = files_of(folder).unwrap().into_iter().filter(|name| name != "manifest.json");
    names.map(|name| (name.clone(), fs::read(folder.join(&name)).unwrap())).collect()
}

fn submits(engine: &Engine) -> u64 {
    engine.device_counts().unwrap().submits
}

/// The tiny recipe with all its frames in one shard.
fn recipe(folder: &Path) -> Recipe {
    recipe_of(folder, 12)
}

/// The tiny recipe with so many of its twelve frames in a shard.
fn recipe_of(folder: &Path, frames_per_shard: u32) -> Recipe {
    let text = fs::read_to_string(recipes().join("tiny.toml")).unwrap();
    let text = text.replace("frames_per_shard = 2", &format!("frames_per_shard = {frames_per_shard}"));
    fs::copy(recipes().join("tiny_radar.toml"), folder.join("tiny_radar.toml")).unwrap();
    let path = folder.join("recipe.toml");
    fs::write(&path, text).unwrap();
    Recipe::load(&path, None).unwrap()
}

fn made(
    engine: &Engine,
    recipe: &Recipe,
    out: &Path,
    batch: usize,
    cancel: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Report {
    tried(engine, recipe, out, batch, cancel, progress).unwrap()
}

fn tried(
    engine: &Engine,
    recipe: &Recipe,
    out: &Path,
    batch: usize,
    cancel: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Report, Error> {
    let options = Options {
        jobs: None,
        batch: Some(batch),
        shards: None,
        mixed_devices: false,
        force: false,
        cancel,
        progress: &|p| progress(p.done),
        pictures: &|_, _, _, _, _| Ok(()),
        say: &|_| (),
        rule: None,
    };
    produce(engine, recipe, out, &options)
}

/// Whether the error says that the device was lost, in one line, and what to do.
fn tells_of_a_loss(e: &Error) {
    let text = e.to_string();
    assert_eq!(e.exit_code(), 1, "{text}");
    let parts =
        ["gpu: the device was lost", "run the same command again", "(kernel ", ", adapter ", ", driver "];
    assert!(parts.iter().all(|part| text.contains(part)) && !text.contains('\n'), "{text}");
}

/// A dataset whose device is lost in the middle of a batch ends with one error that says so. Shards that are complete stay, what is there
/// under its final name is whole, and the same call with a new device makes the rest: the same bytes as without a loss.
#[test]
fn a_lost_device_leaves_whole_shards() {
    let t = tempfile::tempdir().unwrap();
    let recipe = recipe_of(t.path(), 2);
    let opened = || opened_for_tests().with_tracing_on_host(true);
    let whole = t.path().join("whole");
    let go_on = AtomicBool::new(false);
    let engine = Engine::Gpu(Box::new(opened()));
    let before = submits(&engine);
    made(&engine, &recipe, &whole, 2, &go_on, &|_| ());
    let all = submits(&engine) - before;
    let whole = files(&whole);
    let mut kept = Vec::new();
    for at in [1, 2, all / 2, all - 4, all] {
        let out = t.path().join(format!("lost-in-{at}"));
        let engine = Engine::Gpu(Box::new(opened().with_loss_in_submission(at)));
        tells_of_a_loss(&tried(&engine, &recipe, &out, 2, &go_on, &|_| ()).unwrap_err());
        let shards = match out.exists() {
            false => 0,
            true => {
                let left = files(&out);
                let is_final = |name: &str| !name.split('/').any(|part| part.starts_with('.'));
                for (name, bytes) in left.iter().filter(|(name, _)| is_final(name)) {
                    assert!(whole.get(name) == Some(bytes), "{at}: {name}");
                }
                left.keys().filter(|name| name.starts_with("shards/") && is_final(name)).count() as u64
            }
        };
        kept.push(shards);
        let report = made(&Engine::Gpu(Box::new(opened())), &recipe, &out, 2, &go_on, &|_| ());
        assert!(report.complete && report.shards_resumed == shards, "{at}: {report:?}");
        assert_eq!(report.frames_made, 12 - 2 * shards, "{at} of {all}");
        assert!(files(&out) == whole, "{at}");
    }
    assert!(kept[0] == 0 && kept[3] > 0, "{kept:?} of losses among {all} submissions");
}

/// A dataset of four scenes, whose frames are made across scenes, has the same bytes for any number of frames at a time.
#[test]
fn datasets_do_not_depend_on_the_batch() {
    let t = tempfile::tempdir().unwrap();
    let recipe = recipe(t.path());
    let engine = Engine::Gpu(Box::new(opened_for_tests().with_tracing_on_host(true)));
    let mut found: Vec<BTreeMap<String, Vec<u8>>> = Vec::new();
    let mut waited = Vec::new();
    for batch in BATCHES {
        let out = t.path().join(format!("of-{batch}"));
        let before = submits(&engine);
        let report = made(&engine, &recipe, &out, batch, &AtomicBool::new(false), &|_| ());
        assert!(report.complete && report.frames_made == 12);
        waited.push(submits(&engine) - before);
        found.push(files(&out));
    }
    assert!(found[0].keys().any(|name| name.contains("adc")), "{:?}", found[0].keys());
    for (one, batch) in found.iter().zip(BATCHES) {
        let names: Vec<&String> = one
            .iter()
            .filter(|(name, bytes)| found[0].get(*name) != Some(bytes))
            .map(|(name, _)| name)
            .collect();
        assert!(names.is_empty() && one.len() == found[0].len(), "{batch}: {names:?}");
    }
    // The layout and the pictures take frames of their own.
    assert!(waited[0] >= 20 && waited[2] + 18 <= waited[0], "{waited:?}");
}

/// A dataset that is cancelled within a batch has no shard, and the same call completes it with the same bytes.
#[test]
fn a_cancelled_batch_leaves_no_half_shard() {
    let t = tempfile::tempdir().unwrap();
    let recipe = recipe(t.path());
    let engine = Engine::Gpu(Box::new(opened_for_tests()));
    let (whole, cut) = (t.path().join("whole"), t.path().join("cut"));
    made(&engine, &recipe, &whole, 4, &AtomicBool::new(false), &|_| ());
    let (cancel, seen) = (AtomicBool::new(false), AtomicU64::new(0));
    let report = made(&engine, &recipe, &cut, 4, &cancel, &|done| {
        // Scenes are counted first, then frames.
        if done == 1 && seen.fetch_add(1, Ordering::Relaxed) == 1 {
            cancel.store(true, Ordering::Relaxed);
        }
    });
    assert!(report.cancelled && !report.complete && report.shards_complete == 0, "{report:?}");
    let report = made(&engine, &recipe, &cut, 64, &AtomicBool::new(false), &|_| ());
    assert!(report.complete);
    assert_eq!(files(&cut), files(&whole));
}

/// A run of two radars writes the same frames for any number at a time; one that fails keeps what is complete and goes on from there.
#[test]
fn runs_do_not_depend_on_the_batch() {
    let t = tempfile::tempdir().unwrap();
    fs::copy(recipes().join("tiny_radar.toml"), t.path().join("tiny_radar.toml")).unwrap();
    let text = "name = \"s\"\nseed = 7\n\
        [[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\nclass = \"car\"\nvelocity_mps = [3, 0, 0]\n\
        [frames]\ncount = 5\ninterval_s = 0.1\n\
        [[radars]]\nname = \"left\"\nradar = \"tiny_radar.toml\"\n[[radars]]\nname = \"right\"\nradar = \"tiny_radar.toml\"\n";
    let scenario = scenario::parse(&t.path().join("s.toml"), text).unwrap();
    let engine = Engine::Gpu(Box::new(opened_for_tests()));
    let made_on = |engine: &Engine, batch: usize, stop: bool| -> Result<RunReport, Error> {
        let options = RunOptions {
            kind: "run",
            force: true,
            convergence: false,
            batch: Some(batch),
            from: None,
            rule: None,
            source: None,
            pictures: &|_, _, frame, _, _| match (stop, frame.index) {
                (true, 3) => Err(Error::Failed("stopped".into())),
                _ => Ok(()),
            },
            progress: &|_, _| (),
            add: None,
        };
        run(engine, &scenario, &t.path().join(format!("of-{batch}")), &options)
    };
    let made = |batch: usize, stop: bool| made_on(&engine, batch, stop);
    let found: Vec<_> = BATCHES.map(|batch| files(&made(batch, false).unwrap().folder)).into();
    assert!(found[0].keys().any(|name| name.contains("left") && name.contains("points")));
    for (one, batch) in found.iter().zip(BATCHES) {
        assert!(one == &found[0], "{batch}");
    }
    fs::remove_dir_all(t.path().join("of-64")).unwrap();
    made(64, true).unwrap_err();
    let report = made(64, false).unwrap();
    assert_eq!((report.resumed, report.frames.len()), (3, 10));
    assert!(files(&report.folder) == found[0]);
    // A device that is lost keeps what is complete as well.
    fs::remove_dir_all(t.path().join("of-3")).unwrap();
    let before = submits(&engine);
    made(3, false).unwrap();
    let all = submits(&engine) - before;
    fs::remove_dir_all(t.path().join("of-3")).unwrap();
    let lost = Engine::Gpu(Box::new(opened_for_tests().with_loss_in_submission(all)));
    tells_of_a_loss(&made_on(&lost, 3, false).unwrap_err());
    let report = made(3, false).unwrap();
    // The first three frames, since the last submission is of the other two.
    assert_eq!((report.resumed, report.frames.len()), (3, 10));
    assert!(files(&report.folder) == found[0]);
}

/// Two runs that chose their engines by different rules make the halves of a dataset. The manifest has both in the order of the shards,
/// whoever ends it.
#[test]
fn the_manifest_lists_the_rules_of_all_runs() {
    let t = tempfile::tempdir().unwrap();
    let (recipe, engine) = (recipe_of(t.path(), 2), Engine::open("cpu", Precision::F32).unwrap());
    let make = |name: &str, runs: &[(std::ops::Range<u64>, &'static str)]| {
        let out = t.path().join(name);
        for (shards, rule) in runs {
            let options = Options {
                jobs: None,
                batch: None,
                shards: Some(shards.clone()),
                mixed_devices: false,
                force: false,
                cancel: &AtomicBool::new(false),
                progress: &|_| (),
                pictures: &|_, _, _, _, _| Ok(()),
                say: &|_| (),
                rule: (!rule.is_empty()).then_some(*rule),
            };
            produce(&engine, &recipe, &out, &options).unwrap();
        }
        let manifest: DatasetManifest =
            serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap();
        manifest.engine_rule
    };
    assert_eq!(make("forwards", &[(0..3, "one"), (3..6, "two")]), ["one", "two"]);
    assert_eq!(make("backwards", &[(3..6, "two"), (0..3, "one")]), ["one", "two"]);
    // Rules that agree are one, and a run that names its engine follows none, also where it finds nothing left to make.
    assert_eq!(make("equal", &[(0..3, "one"), (3..6, "one")]), ["one"]);
    assert_eq!(make("named", &[(3..6, "one"), (0..3, ""), (0..6, "")]), ["one"]);
    assert_eq!(make("none", &[(0..6, ""), (0..6, "one")]), [""; 0]);
}
