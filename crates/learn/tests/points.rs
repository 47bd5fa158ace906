//! Trainings of seconds on points that can be told apart: rails are rows of even steps, vehicles are dense heaps, all else is scattered.

use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::base::rng::Draws;
use catseye_io::dataset::DATASET;
use catseye_io::store::{Column, Compression, DatasetLayout, Format, Record, Table};
use catseye_learn::config::Config;
use catseye_learn::frame_points::{read_cloud, read_truth};
use catseye_learn::model::Model;
use catseye_learn::source::point_sources;
use catseye_learn::train::{EpochRow, train};
use catseye_learn::{Device, device};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

fn cpu() -> Device {
    device(false).unwrap()
}

const HEADER: &str = "x_m,y_m,z_m,range_rate_mps,power_dbm,class,ghost,side_lobe";
const TRUTH: &str = r#"{"radar":{"position_m":[5,2,0.5],"rotation_xyzw":[0,0,0,1],"velocity_mps":[0,0,0]}}"#;

/// Points of a frame: place, power and class.
fn points(scene: u32, frame: u32) -> Vec<([f64; 2], f64, &'static str)> {
    let mut d = Draws::new(scene, frame);
    let mut all = Vec::new();
    let (side, from) = (if d.uniform() < 0.5 { -7.0 } else { 7.0 }, 4.0 * d.uniform());
    all.extend((0..14).map(|k| ([5.0 + from + 3.0 * f64::from(k), side], -60.0, "guard_rail.post")));
    for _ in 0..2 {
        let at = [10.0 + 30.0 * d.uniform(), 6.0 * d.uniform() - 3.0];
        let near = |d: &mut Draws| 1.2 * (d.uniform() - 0.5);
        all.extend((0..10).map(|_| ([at[0] + near(&mut d), at[1] + near(&mut d)], -50.0, "car")));
    }
    all.extend((0..12).map(|_| ([50.0 * d.uniform(), 12.0 + 30.0 * d.uniform()], -65.0, "noise")));
    // In no order that would tell anything.
    catseye_learn::data::shuffle(&mut all, &mut d);
    all
}

fn csv(points: &[([f64; 2], f64, &str)]) -> String {
    let row = |(at, power, class): &([f64; 2], f64, &str)| {
        format!("{},{},0.1,-3,{power},{class},0,0\n", at[0], at[1])
    };
    format!("{HEADER}\n{}", points.iter().map(row).collect::<String>())
}

fn write_runs(folder: &Path, runs: u32) {
    for run in 0..runs {
        for frame in 0..3 {
            let at = folder.join(format!("run_{run}/frame_{frame:06}"));
            fs::create_dir_all(&at).unwrap();
            fs::write(at.join("points.csv"), csv(&points(run, frame))).unwrap();
            fs::write(at.join("truth.json"), TRUTH).unwrap();
        }
    }
}

const PLUS: &str = "kind = \"pointnet++\"\nchannels = 12\nradii_m = [4, 12]\ncentroids = [24, 8]\nsamples = 12\n\
                    features = [\"counts\", \"covariance\", \"r_min\"]\ncircles_m = [1.5, 4.0]";
const FLAT: &str =
    "kind = \"pointnet\"\nchannels = 12\nfeatures = [\"amplitude\", \"counts\"]\ncircles_m = [1.5]";

fn config(folder: &Path, network: &str, runs: usize, epochs: usize, data: &str) -> Result<Config> {
    let names: Vec<String> = (0..runs).map(|k| format!("\"run_{k}\"")).collect();
    let text = format!(
        "[network]\n{network}\n\n[training]\nepochs = {epochs}\nbatch = 4\nrate = 0.01\nseed = 5\npatience = 50\n\
         augment = {{ mirror = true, drop = 0.1 }}\n\n[data]\nruns = [{}]\n\
         classes = [\"others\", \"vehicle\", \"guard rail\"]\n{data}\n",
        names.join(", ")
    );
    let path = folder.join("training.toml");
    fs::write(&path, text).unwrap();
    Config::read(&path)
}

/// The network of points that comes with the source opens by its name, and gives each point of a run a class.
#[test]
fn the_shipped_network_of_points_opens() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 1);
    let model = Model::open(t.path(), Path::new("points"), &cpu()).unwrap();
    assert_eq!(model.config.data.classes.value, ["others", "vehicle", "guard rail"]);
    let file = t.path().join("classes.csv");
    assert_eq!(model.predict(&t.path().join("run_0"), &file, false).unwrap(), 3);
    let text = fs::read_to_string(&file).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).count();
    assert_eq!(rows, 1 + (0..3).map(|frame| points(0, frame).len()).sum::<usize>());
    // It tells things apart, though these are none of its roads.
    assert!(["others", "guard rail"].iter().all(|class| text.contains(class)), "{text}");
}

#[test]
fn points_that_can_be_told_apart_are_learned() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 12);
    for (name, network, words) in [
        ("plus", PLUS, "A PointNet++ of 12 channels and 2 levels (radii 4, 12 m, at most 24, 8 centroids"),
        ("flat", FLAT, "A PointNet of 12 channels that gives each point of a frame a class"),
    ] {
        let out = t.path().join(name);
        let config = config(t.path(), network, 10, 20, "").unwrap();
        let report = train(&config, &out, false, &cpu(), Control::default(), &|_| {}).unwrap();
        assert_eq!(report.frames, [18, 6, 6]);
        assert_eq!(report.classes, ["others", "vehicle", "guard rail"]);
        assert!(report.test.iter().all(|f| f.unwrap() > 0.9), "{name}: {:?}", report.test);
        let card = fs::read_to_string(out.join("model_card.md")).unwrap();
        assert!(card.contains(words) && card.contains("| guard rail | "), "{card}");
        for file in ["confusion.csv", "precision_recall.csv", "confusion.png", "scores.csv"] {
            assert!(out.join(file).is_file(), "{file}");
        }

        // Opened again, it says the same of frames that no set held, and a prediction needs no truth.
        let model = Model::load(&out, &cpu()).unwrap();
        let unseen: Vec<PathBuf> = (10..12).map(|k| t.path().join(format!("run_{k}"))).collect();
        let judged = model.evaluate(&unseen).unwrap().classes().unwrap();
        assert!(
            (0..3).all(|k| judged.confusion.f1(k).unwrap() > 0.9),
            "{name}: {}",
            judged.confusion.words()
        );
        let frame = unseen[0].join("frame_000001");
        let known = fs::read_to_string(frame.join("points.csv")).unwrap();
        let bare: String = known
            .lines()
            .map(|l| format!("{}\n", l.split(',').take(5).collect::<Vec<_>>().join(",")))
            .collect();
        fs::write(frame.join("points.csv"), bare).unwrap();
        let file = t.path().join(format!("{name}.csv"));
        assert_eq!(model.predict(&unseen[0], &file, false).unwrap(), 3);
        let text = fs::read_to_string(&file).unwrap();
        assert_eq!(text.lines().next(), Some("frame,radar,point,class,probability"));
        assert_eq!(text.lines().count(), 1 + 3 * 46);
        let made = points(10, 1);
        let right = made.iter().enumerate().filter(|(k, p)| {
            let class = ["guard rail", "vehicle", "others"]
                [["guard_rail.post", "car", "noise"].iter().position(|c| *c == p.2).unwrap()];
            text.contains(&format!("\n1,,{k},{class},"))
        });
        assert!(right.count() > 40, "{text}");
        let gone = model.evaluate(&unseen[..1]).unwrap_err().to_string();
        assert!(gone.contains("points.csv") && gone.contains("class"), "{gone}");
        let other = model.predict(&unseen[0], &t.path().join("x.npy"), false).unwrap_err().to_string();
        assert!(other.contains("x.npy") && other.contains("csv"), "{other}");
        fs::write(frame.join("points.csv"), known).unwrap();
    }
}

#[test]
fn a_training_of_points_that_goes_on_ends_with_the_same_bytes() {
    let t = tempfile::tempdir().unwrap();
    write_runs(t.path(), 4);
    // A frame without points teaches nothing and harms nothing.
    fs::write(t.path().join("run_1/frame_000002/points.csv"), format!("{HEADER}\n")).unwrap();
    for (name, network) in [("plus", PLUS), ("flat", FLAT)] {
        let config = config(t.path(), network, 4, 3, "").unwrap();
        let at = |kind: &str| t.path().join(format!("{name}_{kind}"));
        for kind in ["whole", "again"] {
            train(&config, &at(kind), false, &cpu(), Control::default(), &|_| {}).unwrap();
        }
        for (stop_after, stop_within) in [(Some(1), None), (None, Some(4))] {
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
            let e = train(&config, &at("broken"), false, &cpu(), control, &tell).unwrap_err();
            assert!(e.exit_code() == 130 && !at("broken").exists(), "{e}");
        }
        train(&config, &at("broken"), false, &cpu(), Control::default(), &|_| {}).unwrap();
        for file in ["weights.bpk", "scores.csv", "confusion.csv", "model_card.md"] {
            let bytes = |kind: &str| fs::read(at(kind).join(file)).unwrap();
            assert!(bytes("whole") == bytes("again"), "{name}, {file}: the same seed gave other bytes");
            assert!(bytes("whole") == bytes("broken"), "{name}, {file}: resumed, it gave other bytes");
        }
    }
}

/// A dataset with two radars, of which the second looks to the left and 30 degrees up; scenes have two frames.
fn record(frame: u64) -> Record {
    let split = ["train", "train", "train", "validation", "test"][(frame / 2) as usize];
    let made = points((frame / 2) as u32, frame as u32);
    let n = made.len();
    let half = 0.5f64.sqrt();
    let tilt = (15f64.to_radians().cos(), -(15f64.to_radians().sin()));
    let numbers = |f: &dyn Fn(usize) -> f64| Column::F64((0..2 * n).map(|k| f(k % n)).collect());
    let text = |names: &[&str]| Column::Text(names.iter().map(|s| s.to_string()).collect());
    let table = |name: &str, columns: Vec<(&str, Column)>| Table {
        name: name.into(),
        columns: columns.into_iter().map(|(n, c)| (n.to_string(), c)).collect(),
    };
    let radars: Vec<&str> = (0..2 * n).map(|k| if k < n { "front" } else { "left" }).collect();
    let classes: Vec<&str> = (0..2 * n).map(|k| made[k % n].2).collect();
    let pose = |values: [f64; 2]| Column::F64(values.to_vec());
    Record {
        frame,
        arrays: Vec::new(),
        tables: vec![
            table(
                "frames",
                vec![("scene", Column::U32(vec![(frame / 2) as u32])), ("split", text(&[split]))],
            ),
            table(
                "radars",
                vec![
                    ("radar", text(&["front", "left"])),
                    ("x_m", pose([1.0, 2.0])),
                    ("y_m", pose([0.0, 5.0])),
                    ("z_m", pose([0.5, 0.7])),
                    ("rotation_x", pose([0.0, -half * tilt.1])),
                    ("rotation_y", pose([0.0, half * tilt.1])),
                    ("rotation_z", pose([0.0, half * tilt.0])),
                    ("rotation_w", pose([1.0, half * tilt.0])),
                ],
            ),
            table(
                "points",
                vec![
                    ("radar", text(&radars)),
                    ("x_m", numbers(&|k| made[k].0[0])),
                    ("y_m", numbers(&|k| made[k].0[1])),
                    ("z_m", numbers(&|_| 0.0)),
                    ("range_rate_mps", numbers(&|_| -3.0)),
                    ("power_dbm", numbers(&|k| made[k].1)),
                    ("class", text(&classes)),
                    ("ghost", Column::Bool((0..2 * n).map(|k| k == n).collect())),
                ],
            ),
        ],
    }
}

fn write_dataset(dir: &Path) {
    let layout = DatasetLayout {
        format: Format::Frames,
        compression: Compression::None,
        frames: 10,
        frames_per_shard: 10,
        arrays: Vec::new(),
        tables: record(0).tables.iter().map(Table::spec).collect(),
        attributes: serde_json::Map::new(),
    };
    layout.create(dir).unwrap();
    layout.write_shard(dir, 0, &mut |f| Ok(record(f))).unwrap();
    fs::write(dir.join(DATASET), "{}").unwrap();
}

#[test]
fn points_of_datasets_lie_in_the_level_axes_of_their_radar() {
    let t = tempfile::tempdir().unwrap();
    let dir = t.path().join("run_0");
    write_dataset(&dir);
    let found = point_sources(std::slice::from_ref(&dir)).unwrap();
    assert_eq!(found.len(), 20);
    assert_eq!((found[3].name(), found[3].scene), ((1, "left".into()), 0));
    let (front, left) = (read_cloud(&found[2]).unwrap(), read_cloud(&found[3]).unwrap());
    let made = points(0, 1);
    assert_eq!(front.points.len(), made.len());
    let up = 30f64.to_radians();
    for ((f, l), p) in front.points.iter().zip(&left.points).zip(&made) {
        assert!((f.at_m.x - p.0[0]).abs() < 1e-9 && (f.at_m.y - p.0[1]).abs() < 1e-9);
        // What lies ahead of a radar that looks up is nearer in plan by the cosine.
        assert!(
            (l.at_m.x - p.0[0] * up.cos()).abs() < 1e-9 && (l.at_m.y - p.0[1]).abs() < 1e-9,
            "{l:?} {p:?}"
        );
        let wanted = 10f64.powf((p.1 + 50.0) / 20.0);
        assert!((f.amplitude - wanted).abs() < 1e-12);
    }
    // The first point of the second radar is a ghost, and lies on nothing.
    let (truth, other) = (read_truth(&found[2]).unwrap(), read_truth(&found[3]).unwrap());
    assert_eq!(truth[1..], other[1..]);
    assert_eq!(other[0] as u8, 0);

    let own = config(t.path(), FLAT, 1, 2, "split = \"dataset\"").unwrap();
    let out = t.path().join("net");
    let report = train(&own, &out, false, &cpu(), Control::default(), &|_| {}).unwrap();
    assert_eq!(report.frames, [12, 4, 4]);
    let file = t.path().join("said.csv");
    assert_eq!(Model::load(&out, &cpu()).unwrap().predict(&dir, &file, false).unwrap(), 20);
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains("\n0,front,0,") && text.contains("\n9,left,45,"), "{text}");
}

#[test]
fn wrong_points_are_refused_in_one_line() {
    let t = tempfile::tempdir().unwrap();
    let ask = |change: &dyn Fn(&Path)| {
        let _ = fs::remove_dir_all(t.path().join("run_0"));
        write_runs(t.path(), 3);
        change(&t.path().join("run_0/frame_000000"));
        let config = config(t.path(), FLAT, 3, 1, "").unwrap();
        let e =
            train(&config, &t.path().join("net"), false, &cpu(), Control::default(), &|_| {}).unwrap_err();
        assert!(e.exit_code() == 2, "{e}");
        e.to_string()
    };
    let rows = |row: &str| {
        let text = format!("{HEADER}\n{row}\n");
        move |frame: &Path| fs::write(frame.join("points.csv"), &text).unwrap()
    };
    for (said, words) in [
        (ask(&rows("1,nan,0,0,-60,car,0,0")), "points.csv:2: y_m = NaN: is not finite"),
        (ask(&rows("1,2,0,0,-60,,0,0")), "class: a point has no class"),
        (ask(&rows("1,2,0,fast,-60,car,0,0")), "not a number"),
        (
            ask(&|frame| fs::remove_file(frame.join("truth.json")).unwrap()),
            "truth.json: radar: the frame does not state the pose of its radar",
        ),
        (ask(&|frame| fs::write(frame.join("truth.json"), "{}").unwrap()), "is not the truth of a frame"),
        (
            ask(&|frame| {
                let text = TRUTH.replace("[0,0,0,1]", "[0,0,0,0]");
                fs::write(frame.join("truth.json"), text).unwrap();
            }),
            "is not a pose of a radar",
        ),
        (
            ask(&|frame| {
                let run = frame.parent().unwrap();
                (0..3).for_each(|k| fs::remove_file(run.join(format!("frame_{k:06}/points.csv"))).unwrap());
            }),
            "points = false: the run has no points; allowed: true",
        ),
        (
            ask(&|frame| {
                let runs = frame.ancestors().nth(2).unwrap();
                for (run, k) in (0..9).map(|k| (k / 3, k % 3)) {
                    let at = runs.join(format!("run_{run}/frame_{k:06}/points.csv"));
                    fs::write(at, format!("{HEADER}\n")).unwrap();
                }
            }),
            "data.runs: no frame of the training set contains a point",
        ),
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!t.path().join("net").exists());
}
