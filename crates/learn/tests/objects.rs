//! A detector learns contours of made-up scenes in a minute: a lane between two rows of points, and cars on it.

use catseye::base::control::Control;
use catseye::base::rng::Draws;
use catseye::formats::npy;
use catseye::road::mask::{CellClass, Grid};
use catseye_learn::classes::Classes;
use catseye_learn::config::Config;
use catseye_learn::detection::{Detected, Detection};
use catseye_learn::model::Model;
use catseye_learn::objects::Objects;
use catseye_learn::quad::Quad;
use catseye_learn::task::Verdict;
use catseye_learn::train::{EpochRow, train};
use catseye_learn::{Device, device};
use glam::DVec2;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

const FRAMES: usize = 12;

/// A run of frames: a lane 5 to 9 m wide that passes within 6 m of the radar and ends between 30 and 60 m, in its middle a car that is 6 m
/// long and 3 m wide. Points stand each 1.5 m along both edges of the lane, and around the car, where they are stronger.
fn write_run(folder: &Path, run: u32) {
    let grid = Grid::ROAD;
    for frame in 0..FRAMES {
        let mut draws = Draws::new(run, frame as u32);
        let mut between = |lo: f64, hi: f64| lo + (hi - lo) * draws.uniform();
        let (aside, wide, long) = (between(-6.0, 6.0), between(5.0, 9.0), between(30.0, 60.0));
        let car = DVec2::new(between(6.0, 25.0), aside + between(-1.0, 1.0));
        let (mut mask, mut planes) = (vec![0u8; grid.cells()], vec![0f32; 4 * grid.cells()]);
        for (cell, class) in mask.iter_mut().enumerate() {
            let p = DVec2::from_array(grid.middle_m(cell / grid.columns, cell % grid.columns));
            let d = (p - car).abs();
            if d.x < 3.0 && d.y < 1.5 {
                *class = CellClass::Vehicle as u8;
            } else if p.x < long && (p.y - aside).abs() < 0.5 * wide {
                *class = CellClass::Lane as u8;
            }
        }
        let mut point = |x: f64, y: f64, amplitude: f32| {
            if let Some(cell) = grid.cell(x, y) {
                planes[cell] = 1.0;
                planes[grid.cells() + cell] = amplitude;
            }
        };
        for k in 0..(long / 1.5) as usize {
            for side in [-0.5, 0.5] {
                point(1.5 * k as f64 + 0.7, aside + side * wide, 0.3);
            }
        }
        for k in 0..7 {
            let along = k as f64 - 3.0;
            for side in [-1.5, 1.5] {
                point(car.x + along, car.y + side, 0.9);
                point(car.x + 2.0 * side, car.y + 0.5 * along, 0.9);
            }
        }
        let at = folder.join(format!("run_{run}/frame_{frame:06}"));
        fs::create_dir_all(&at).unwrap();
        npy::write(at.join("mask_road.npy"), &[grid.rows, grid.columns], &mask).unwrap();
        npy::write(at.join("grid_road.npy"), &[4, grid.rows, grid.columns], &planes).unwrap();
    }
}

fn config(folder: &Path, runs: u32, epochs: usize, channels: usize) -> Config {
    let names: Vec<String> = (0..runs).map(|k| format!("\"run_{k}\"")).collect();
    let text = format!(
        "[network]\nkind = \"detector\"\nlayers = 2\nchannels = {channels}\nkernel = 5\ninput = \"A\"\n\n[training]\nepochs = {epochs}\n\
         batch = 4\nrate = 0.005\nseed = 5\npatience = 200\naugment = {{ mirror = true }}\n\n[data]\ngrid = \"road\"\nruns = [{}]\n\
         scale = 10\nclasses = [\"undefined\", \"lane\", \"vehicle\"]\n",
        names.join(", ")
    );
    let path = folder.join(format!("training_{epochs}.toml"));
    fs::write(&path, text).unwrap();
    Config::read(&path).unwrap()
}

fn cpu() -> Device {
    device(false).unwrap()
}

fn objects_of(folder: &Path, run: u32) -> Vec<Objects> {
    let classes = Classes::named(&["undefined", "lane", "vehicle"].map(String::from)).unwrap();
    let of = |frame: usize| {
        let path = folder.join(format!("run_{run}/frame_{frame:06}/mask_road.npy"));
        Objects::new(&classes, &Grid::ROAD, &npy::read::<u8>(path).unwrap().data)
    };
    (0..FRAMES).map(of).collect()
}

/// What a detector says that sees nothing: in every frame the mean contour of each class.
fn constant_answer(seen: &[Objects]) -> Vec<Detection> {
    let mean = |class: u8| {
        let of: Vec<&Quad> =
            seen.iter().flat_map(|o| o.all()).filter(|o| o.class == class).map(|o| &o.quad).collect();
        let corner = |k: usize| of.iter().map(|q| q.corners()[k]).sum::<DVec2>() / of.len() as f64;
        Detection { class, confidence: 1.0, quad: Quad::of(std::array::from_fn(corner)).unwrap() }
    };
    vec![mean(1), mean(2)]
}

#[test]
fn contours_are_learned() {
    let t = tempfile::tempdir().unwrap();
    (0..11).for_each(|run| write_run(t.path(), run));
    let out = t.path().join("net");
    let config = config(t.path(), 10, 50, 12);
    let report = train(&config, &out, false, &cpu(), Control::default(), &|_| {}).unwrap();
    assert_eq!((report.figure, report.classes.join(" ")), ("AP50", "lane vehicle".to_string()));
    let last = &report.epochs[report.epochs.len() - 1];
    assert!(last.loss < 0.3 * report.epochs[0].loss, "{} {}", report.epochs[0].loss, last.loss);
    // The eleventh run was never looked at.
    let model = Model::load(&out, &cpu()).unwrap();
    let unseen = t.path().join("run_10");
    let found = model.evaluate(std::slice::from_ref(&unseen)).unwrap().objects().unwrap();
    let mut constant = Detected::new(&config.data.classes.value);
    let seen: Vec<Objects> = (0..10).flat_map(|run| objects_of(t.path(), run)).collect();
    objects_of(t.path(), 10).iter().for_each(|o| constant.add(o, &constant_answer(&seen)));
    assert_eq!((constant.objects(0), constant.objects(1)), (FRAMES, FRAMES));
    let told = format!(
        "{:?} and {:?}, constant {:?} and {:?}",
        found.row(0),
        found.row(1),
        constant.row(0),
        constant.row(1)
    );
    println!("{told}");
    for (k, least) in [(0, 0.8), (1, 0.6)] {
        let [found, constant] = [found.row(k)[0].unwrap(), constant.row(k)[0].unwrap()];
        assert!(found > least && constant < 0.5 * found, "{told}");
    }
    for file in
        ["weights.bpk", "detection.csv", "precision_recall.csv", "precision_recall.png", "model_card.md"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    let scores = fs::read_to_string(out.join("scores.csv")).unwrap();
    assert!(scores.starts_with("epoch,loss,mean_ap50,ap50_lane,ap50_vehicle\n"), "{scores}");
    let card = fs::read_to_string(out.join("model_card.md")).unwrap();
    assert!(card.contains("A detector of 2 layers") && card.contains("| lane | "), "{card}");
    // A prediction needs no masks, and its table holds the corners that were judged.
    (0..FRAMES).for_each(|k| fs::remove_file(unseen.join(format!("frame_{k:06}/mask_road.npy"))).unwrap());
    let file = t.path().join("objects.csv");
    assert_eq!(model.predict(&unseen, &file, false).unwrap(), FRAMES);
    let text = fs::read_to_string(&file).unwrap();
    let rows: Vec<Vec<&str>> =
        text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), "frame,radar,class,confidence,x1_m,y1_m,x2_m,y2_m,x3_m,y3_m,x4_m,y4_m");
    let wide = Classes::named(&["undefined", "lane", "vehicle"].map(String::from)).unwrap().names();
    let mut again = Detected::new(&wide);
    // The masks are gone; what was drawn is drawn again.
    write_run(t.path(), 10);
    for (frame, truth) in objects_of(t.path(), 10).iter().enumerate() {
        let of_frame = rows[1..].iter().filter(|r| r[0] == frame.to_string());
        let said: Vec<Detection> = of_frame
            .map(|r| {
                let n: Vec<f64> = r[3..].iter().map(|v| v.parse().unwrap()).collect();
                let class = if r[2] == "lane" { 1 } else { 2 };
                let quad = Quad::of(std::array::from_fn(|k| DVec2::new(n[1 + 2 * k], n[2 + 2 * k]))).unwrap();
                Detection { class, confidence: n[0] as f32, quad }
            })
            .collect();
        again.add(truth, &said);
    }
    for (a, b) in again.figures().iter().zip(found.figures()) {
        assert!((a.unwrap() - b.unwrap()).abs() < 0.02, "{again:?}");
    }
    let e = model.robustness(1, 1).err().unwrap().to_string();
    assert!(e.contains("allowed: segnet"), "{e}");
    let e = model.with_scans(3).err().unwrap().to_string();
    assert!(e.contains("a detector uses one scan"), "{e}");
}

#[test]
fn a_detector_that_goes_on_ends_with_the_same_bytes() {
    let t = tempfile::tempdir().unwrap();
    (0..4).for_each(|run| write_run(t.path(), run));
    let config = config(t.path(), 4, 3, 4);
    let [whole, broken] = ["whole", "broken"].map(|name| t.path().join(name));
    train(&config, &whole, false, &cpu(), Control::default(), &|_| {}).unwrap();
    let stop = AtomicBool::new(false);
    let tell = |row: &EpochRow| stop.store(row.epoch == 1, Relaxed);
    let control = Control { progress: None, cancel: Some(&stop) };
    let e = train(&config, &broken, false, &cpu(), control, &tell).unwrap_err();
    assert!(e.exit_code() == 130 && !broken.exists(), "{e}");
    train(&config, &broken, false, &cpu(), Control::default(), &|_| {}).unwrap();
    let bytes = |dir: &PathBuf, file: &str| fs::read(dir.join(file)).unwrap();
    for file in ["weights.bpk", "scores.csv", "detection.csv", "precision_recall.csv", "model_card.md"] {
        assert!(bytes(&whole, file) == bytes(&broken, file), "{file}: resumed, it gave other bytes");
    }
}
