//! A training of seconds on grids that can be told apart: a block of "lane" under strong points, a block of "vehicle" under weak ones.

use catseye::base::control::Control;
use catseye::base::rng::Draws;
use catseye::formats::npy;
use catseye::road::mask::{CellClass, Grid};
use catseye_learn::config::Config;
use catseye_learn::model::Model;
use catseye_learn::study::{OWN_TEST, PAGE, Study, TABLE};
use catseye_learn::train::{EpochRow, train};
use catseye_learn::{Device, device};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Runs of two frames each: a square of 80 x 80 cells of each class, with a point in each third cell, at places of their own
/// that the scale of 10 leaves whole.
fn write_runs(folder: &Path, runs: usize) {
    let grid = Grid::ROAD;
    for run in 0..runs {
        for frame in 0..2 {
            let mut draws = Draws::new(run as u32, frame);
            let (mut mask, mut planes) = (vec![0u8; grid.cells()], vec![0f32; 4 * grid.cells()]);
            for (class, amplitude, left) in [(CellClass::Lane, 0.9, 20), (CellClass::Vehicle, 0.2, 170)] {
                let (row, column) =
                    (10 * (draws.uniform() * 36.0) as usize, left + 10 * (draws.uniform() * 4.0) as usize);
                for cell in 0..6400 {
                    let at = (row + cell / 80) * grid.columns + column + cell % 80;
                    mask[at] = class as u8;
                    if cell % 3 == 0 {
                        planes[at] = 1.0;
                        planes[grid.cells() + at] = amplitude;
                    }
                }
            }
            let at = folder.join(format!("run_{run}/frame_{frame:06}"));
            fs::create_dir_all(&at).unwrap();
            npy::write(at.join("mask_road.npy"), &[grid.rows, grid.columns], &mask).unwrap();
            npy::write(at.join("grid_road.npy"), &[4, grid.rows, grid.columns], &planes).unwrap();
        }
    }
}

fn config(folder: &Path, runs: usize, epochs: usize) -> Config {
    let names: Vec<String> = (0..runs).map(|k| format!("\"run_{k}\"")).collect();
    let text = format!(
        "[network]\nkind = \"segnet\"\nlayers = 2\nchannels = 6\nkernel = 3\ninput = \"A\"\n\n[training]\nepochs = {epochs}\n\
         batch = 2\nrate = 0.01\nseed = 5\npatience = 50\n\n[data]\ngrid = \"road\"\nruns = [{}]\nscale = 10\n\
         classes = [\"undefined\", \"lane\", \"vehicle\"]\n",
        names.join(", ")
    );
    let path = folder.join(format!("training_{epochs}.toml"));
    fs::write(&path, text).unwrap();
    Config::read(&path).unwrap()
}

fn cpu() -> Device {
    device(false).unwrap()
}

fn classes(
    found: catseye::base::error::Result<catseye_learn::model::Evaluation>,
) -> catseye_learn::class_aim::Judged {
    found.unwrap().classes().unwrap()
}

fn bytes(dir: &Path, file: &str) -> Vec<u8> {
    fs::read(dir.join(file)).unwrap()
}

#[test]
fn classes_that_can_be_told_apart_are_learned() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 10);
    let out = t.path().join("net");
    let config = config(t.path(), 10, 40);
    let report = train(&config, &out, false, &cpu(), Control::default(), &|_| {}).unwrap();
    assert_eq!(report.frames, [12, 4, 4]);
    assert!(report.test.iter().all(|f| f.unwrap() > 0.9), "{:?}", report.test);
    let first = report.epochs[0].loss;
    assert!(report.epochs[report.epochs.len() - 1].loss < 0.5 * first);
    for file in
        ["weights.bpk", "config.toml", "scores.csv", "confusion.csv", "model_card.md", "manifest.json"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    let scores = String::from_utf8(bytes(&out, "scores.csv")).unwrap();
    assert_eq!(scores.lines().next(), Some("epoch,loss,mean_f1,f1_undefined,f1_lane,f1_vehicle"));
    assert_eq!(scores.lines().count(), 1 + report.epochs.len());
    let card = String::from_utf8(bytes(&out, "model_card.md")).unwrap();
    assert!(
        card.contains("The seed is 5.") && card.contains("* test: ") && card.contains("| vehicle | "),
        "{card}"
    );
    // Opened again, it says the same of all runs, and a prediction needs no mask.
    let model = Model::load(&out, &cpu()).unwrap();
    let runs: Vec<PathBuf> = (0..10).map(|k| t.path().join(format!("run_{k}"))).collect();
    assert!(classes(model.evaluate(&runs)).confusion.mean_f1() > 0.9);
    // Scans are taken together where the run tells where the radar stood; two equal ones at rest say the same, only louder.
    let two = || Model::load(&out, &cpu()).unwrap().with_scans(2).unwrap();
    let e = two().evaluate(&runs[..1]).unwrap_err();
    assert!(e.exit_code() == 2 && e.to_string().contains("truth.json"), "{e}");
    for name in ["mask_road.npy", "grid_road.npy"] {
        fs::copy(runs[0].join("frame_000000").join(name), runs[0].join("frame_000001").join(name)).unwrap();
    }
    let standing = r#"{"radar": {"position_m": [5, 6, 0.5], "rotation_xyzw": [0, 0, 0.6, 0.8]}, "frame": 0}"#;
    for frame in ["frame_000000", "frame_000001"] {
        fs::write(runs[0].join(frame).join("truth.json"), standing).unwrap();
    }
    let (one, joint) = (classes(model.evaluate(&runs[..1])), classes(two().evaluate(&runs[..1])));
    let lane = |j: &catseye_learn::class_aim::Judged| j.confusion.f1(1).unwrap();
    assert!(lane(&joint) > 0.9 && lane(&one) > 0.9, "{} {}", lane(&joint), lane(&one));
    assert_ne!(one.curves, joint.curves);
    fs::write(runs[0].join("frame_000001/truth.json"), r#"{"radar": {"position_m": [1, 2]}}"#).unwrap();
    assert!(two().evaluate(&runs[..1]).unwrap_err().to_string().contains("is damaged"));
    assert!(two().with_scans(0).err().unwrap().to_string().contains("--scans = 0"));
    let frame = runs[0].join("frame_000000");
    let truth = npy::read::<u8>(frame.join("mask_road.npy")).unwrap();
    fs::remove_file(frame.join("mask_road.npy")).unwrap();
    let file = t.path().join("classes.npy");
    assert_eq!(model.predict(&runs[0], &file, false).unwrap(), 2);
    let found = npy::read::<u8>(&file).unwrap();
    assert_eq!(found.shape, [2, 45, 30]);
    let hits =
        (0..45 * 30).filter(|k| found.data[*k] == truth.data[(k / 30 * 10 + 5) * 300 + k % 30 * 10 + 5]);
    assert!(hits.count() > 1250);
    let gone = model.evaluate(&runs[..1]).unwrap_err().to_string();
    assert!(gone.contains("masks = false"), "{gone}");
    let foreign = Model::load(t.path(), &cpu()).err().unwrap().to_string();
    assert!(foreign.contains("does not contain a trained network"), "{foreign}");
}

#[test]
fn a_training_that_goes_on_ends_with_the_same_bytes() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 5);
    let config = config(t.path(), 5, 3);
    let at_once = |name: &str| {
        let out = t.path().join(name);
        train(&config, &out, false, &cpu(), Control::default(), &|_| {}).unwrap();
        out
    };
    let (whole, again) = (at_once("whole"), at_once("again"));
    // Interrupted after its first epoch, in the middle of the second, and after the second.
    let broken = t.path().join("broken");
    for (stop_after, stop_within) in [(Some(1), None), (None, Some(2)), (Some(2), None)] {
        let stop = AtomicBool::new(false);
        let progress = |done: u64, _: u64| {
            if Some(done) == stop_within {
                stop.store(true, Relaxed);
            }
        };
        let tell = |row: &EpochRow| {
            if Some(row.epoch) == stop_after {
                stop.store(true, Relaxed);
            }
        };
        let control = Control { progress: Some(&progress), cancel: Some(&stop) };
        let e = train(&config, &broken, false, &cpu(), control, &tell).unwrap_err();
        assert!(e.exit_code() == 130 && e.to_string().contains("the same command continues"), "{e}");
        assert!(!broken.exists());
    }
    let told = std::sync::atomic::AtomicUsize::new(0);
    let tell = |_: &EpochRow| {
        told.fetch_add(1, Relaxed);
    };
    let report = train(&config, &broken, false, &cpu(), Control::default(), &tell).unwrap();
    assert_eq!((report.epochs.len(), told.load(Relaxed)), (3, 3));
    for file in ["weights.bpk", "scores.csv", "confusion.csv", "model_card.md"] {
        assert!(bytes(&whole, file) == bytes(&again, file), "{file}: the same seed gave other bytes");
        assert!(bytes(&whole, file) == bytes(&broken, file), "{file}: resumed, it gave other bytes");
    }
}

/// The network that comes with the source opens, and says the same of a run whatever it is asked together with.
#[test]
fn the_shipped_network_opens() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 1);
    let weights = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights/road");
    let model = Model::load(&weights, &cpu()).unwrap();
    assert_eq!(model.config.data.classes.value, ["undefined", "lane", "vehicle", "guard rail"]);
    let file = t.path().join("classes.npy");
    assert_eq!(model.predict(&t.path().join("run_0"), &file, false).unwrap(), 2);
    let found = npy::read::<u8>(&file).unwrap();
    assert_eq!(found.shape, [2, 113, 75]);
    assert!(found.data.contains(&0) && found.data.iter().any(|c| *c != 0));
    let size = |dir: PathBuf| -> u64 {
        fs::read_dir(dir).unwrap().map(|f| f.unwrap().metadata().unwrap().len()).sum()
    };
    let all = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights");
    let bytes: u64 = fs::read_dir(all).unwrap().map(|f| size(f.unwrap().path())).sum();
    assert!(bytes < 3_000_000, "{bytes}");
}

/// Two trainings with two seeds, judged on a run that none has seen: the table follows from their folders, and an interrupted study goes on
/// to the same bytes without training twice.
#[test]
fn a_study_tells_what_its_trainings_reached() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 10);
    fs::rename(t.path().join("run_9"), t.path().join("unlike")).unwrap();
    let text = config(t.path(), 9, 3).text;
    let files =
        [("amplitude", text.clone()), ("binary", text.replace("\"A\"", "\"B\""))].map(|(name, text)| {
            let path = t.path().join(format!("{name}.toml"));
            fs::write(&path, text).unwrap();
            path
        });
    let on = [t.path().join("unlike")];
    let study = Study::new(&files, 2, &on).unwrap();
    let whole = t.path().join("whole");
    let (_, rows) = study.run(&whole, false, &cpu(), &Control::default(), &|_, _, _| {}).unwrap();

    let f1 = |training: &str, seed: u32| {
        let net = Model::load(&whole.join(training).join(format!("seed_{seed}")), &cpu()).unwrap();
        net.evaluate(&on).unwrap().figures()
    };
    for (k, class) in ["undefined", "lane", "vehicle"].iter().enumerate() {
        let of = |training: &str| [1, 2].map(|seed| f1(training, seed)[k].unwrap());
        let (a, b) = (of("amplitude"), of("binary"));
        let row = |training: &str| {
            rows.iter().find(|r| r.training == training && r.data == "unlike" && r.class == *class).unwrap()
        };
        for (values, training) in [(a, "amplitude"), (b, "binary")] {
            let r = row(training);
            assert_eq!((r.figure.as_str(), r.seeds), ("F1", 2));
            assert!((r.mean - 0.5 * (values[0] + values[1])).abs() < 1e-12);
            // Student's t of one degree of freedom at 97.5 % is tan(0.475 pi).
            let half = (0.475 * std::f64::consts::PI).tan() * 0.5 * (values[0] - values[1]).abs();
            assert!((r.half.unwrap() - half).abs() < 1e-6 * half.max(1e-3), "{half} {:?}", r.half);
        }
        assert_eq!(row("amplitude").difference, None);
        let difference = row("binary").difference.unwrap()[0].unwrap();
        assert!((difference - 0.5 * (b[0] - a[0] + b[1] - a[1])).abs() < 1e-12);
    }
    assert!(rows.iter().any(|r| r.data == OWN_TEST && r.training == "binary" && r.difference.is_some()));
    let lines = fs::read_to_string(whole.join(TABLE)).unwrap().lines().count();
    assert_eq!(lines, 1 + rows.len());
    assert!(whole.join("study_unlike.png").is_file() && whole.join("study_test.png").is_file());

    // Cancelled in the second training, and taken up again.
    let broken = t.path().join("broken");
    let cancel = AtomicBool::new(false);
    let control = Control { cancel: Some(&cancel), ..Control::default() };
    let tell = |_: &str, seed: u32, _: Option<&EpochRow>| cancel.store(seed == 2, Relaxed);
    let e = study.run(&broken, false, &cpu(), &control, &tell).unwrap_err();
    assert_eq!(e.exit_code(), 130, "{e}");
    assert!(!broken.exists());
    let again = std::cell::RefCell::new(Vec::new());
    let tell = |name: &str, seed: u32, row: Option<&EpochRow>| {
        row.iter().for_each(|r| again.borrow_mut().push((name.to_string(), seed, r.epoch)));
    };
    study.run(&broken, false, &cpu(), &Control::default(), &tell).unwrap();
    assert!(!again.borrow().iter().any(|(name, seed, _)| name == "amplitude" && *seed == 1));
    for file in [TABLE, PAGE, "study_unlike.png", "binary/seed_2/weights.bpk"] {
        assert_eq!(bytes(&broken, file), bytes(&whole, file), "{file}");
    }

    let refused =
        |files: &[PathBuf], seeds, on: &[PathBuf]| Study::new(files, seeds, on).unwrap_err().to_string();
    assert!(refused(&files, 0, &on).contains("allowed: 1 to 100"));
    assert!(
        refused(&[files[0].clone(), files[0].clone()], 2, &on)
            .contains("has the same name as another training")
    );
    let both = [on[0].clone(), on[0].clone()];
    assert!(refused(&files, 2, &both).contains("has the same name as another set of frames"));
    assert!(refused(&[], 2, &on).contains("no training is given"));
}
