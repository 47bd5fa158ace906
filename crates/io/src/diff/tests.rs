//! Whatever is moved beyond its tolerance is found, in both directions, and nothing else.

use super::{Report, Tolerances, diff};
use crate::store::{Array, Column, Compression, Data, DatasetLayout, Format, Record, Table};
use catseye::formats::npy;
use num_complex::Complex32;
use proptest::prelude::*;
use std::fmt::Write;
use std::path::Path;

fn both(a: &Path, b: &Path, t: &Tolerances) -> Report {
    let (one, other) = (diff(a, b, t, &|_| ()).unwrap(), diff(b, a, t, &|_| ()).unwrap());
    assert_eq!(one.alike, other.alike, "{one:?} {other:?}");
    one
}

#[derive(Debug, Clone)]
struct P {
    range_m: f64,
    rate_mps: f64,
    azimuth_deg: f64,
    power_dbm: f64,
}

fn points() -> impl Strategy<Value = Vec<P>> {
    let one = (0.0..60.0, -20.0..20.0, -60.0..60.0, -90.0..-40.0).prop_map(|(r, v, a, p)| P {
        range_m: r,
        rate_mps: v,
        azimuth_deg: a,
        power_dbm: p,
    });
    proptest::collection::vec(one, 1..40)
}

fn write(path: &Path, points: &[P]) {
    let mut text = "range_m,range_rate_mps,azimuth_deg,power_dbm\n".to_string();
    for p in points {
        writeln!(text, "{},{},{},{}", p.range_m, p.rate_mps, p.azimuth_deg, p.power_dbm).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn arrays(at in 0usize..24, share in 1e-6f32..0.5, angle in 0.0f32..6.3) {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.npy"), dir.path().join("b.npy"));
        // The peak is 1, also of the other: the difference turns it to smaller values.
        let data: Vec<Complex32> = (0..24).map(|i| Complex32::new(0.3 * (i as f32).sin(), 0.4)).collect();
        let mut data = [&data[..], &[Complex32::new(1.0, 0.0)]].concat();
        npy::write(&a, &[5, 5], &data).unwrap();
        data[at] += Complex32::from_polar(share, angle);
        npy::write(&b, &[5, 5], &data).unwrap();
        // Rounded to f32 at a size below 1: 1e-7 at most.
        let beyond = Tolerances { relative: f64::from(share) - 2e-7, ..Default::default() };
        prop_assert!(!both(&a, &b, &beyond).alike);
        let within = Tolerances { relative: f64::from(share) + 2e-7, ..Default::default() };
        prop_assert!(both(&a, &b, &within).alike);
    }

    #[test]
    fn points_that_stay_and_points_that_move(list in points(), which in any::<prop::sample::Index>(), seed in any::<u64>()) {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.csv"), dir.path().join("b.csv"));
        write(&a, &list);
        // Another order, and each a little elsewhere.
        let mut other = list.clone();
        other.iter_mut().for_each(|p| { p.range_m += 0.009; p.power_dbm -= 0.09; p.azimuth_deg += 0.09; });
        let n = other.len();
        other.rotate_left((seed % n as u64) as usize);
        write(&b, &other);
        prop_assert!(both(&a, &b, &Tolerances::default()).alike);
        // Powers are those of no other point, so that none can stand in for it.
        let i = which.index(n);
        other[i].power_dbm += 200.0;
        write(&b, &other);
        let found = both(&a, &b, &Tolerances::default());
        prop_assert_eq!(found.differences.len(), 1);
        prop_assert_eq!((&*found.differences[0].what, found.differences[0].places), ("power_dbm", 1));
        other.remove(i);
        write(&b, &other);
        let found = both(&a, &b, &Tolerances::default());
        let missing = found.differences.iter().find(|d| d.what == "missing in B").unwrap();
        prop_assert_eq!(missing.places, 1);
    }

    #[test]
    fn tables(rows in proptest::collection::vec((-1e3f64..1e3, -60.0f64..0.0, 0u32..9), 1..20), which in any::<prop::sample::Index>(),
              column in 0usize..3, beyond in 1.01f64..50.0) {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.csv"), dir.path().join("b.csv"));
        let text = |rows: &[(f64, f64, u32)]| {
            let lines: Vec<String> = rows.iter().map(|(x, y, n)| format!("{x},{y},{n}\n")).collect();
            format!("x_m,level_dbsm,count\n{}", lines.concat())
        };
        std::fs::write(&a, text(&rows)).unwrap();
        let mut other = rows.clone();
        let row = &mut other[which.index(rows.len())];
        match column {
            0 => row.0 += 0.01 * beyond,
            1 => row.1 -= 0.1 * beyond,
            _ => row.2 += 1,
        }
        std::fs::write(&b, text(&other)).unwrap();
        let found = both(&a, &b, &Tolerances::default());
        prop_assert_eq!(found.differences.len(), 1);
        let place = format!("line {}", which.index(rows.len()) + 2);
        prop_assert_eq!((&*found.differences[0].what, &found.differences[0].place), (["x_m", "level_dbsm", "count"][column], &place));
        prop_assert!(both(&a, &a, &Tolerances::default()).alike);
    }
}

/// A dataset of one array and one table, in folders of frames.
fn store(dir: &Path, frames: u64, level: f32, count: u32) {
    let array = Array {
        name: "map".into(),
        dims: vec!["range".into()],
        shape: vec![3],
        data: Data::F32(vec![1.0, f32::NAN, level]),
        unit: "W".into(),
    };
    let columns = vec![
        ("level_dbm".to_string(), Column::F64(vec![f64::from(level), f64::NAN])),
        ("count".to_string(), Column::U32(vec![count, 0])),
    ];
    let table = Table { name: "rows".into(), columns };
    let layout = DatasetLayout {
        format: Format::Frames,
        compression: Compression::None,
        frames,
        frames_per_shard: 1,
        arrays: vec![array.spec()],
        tables: vec![table.spec()],
        attributes: Default::default(),
    };
    layout.create(dir).unwrap();
    for shard in 0..frames {
        let record = |frame| Ok(Record { frame, arrays: vec![array.clone()], tables: vec![table.clone()] });
        layout.write_shard(dir, shard, &mut |frame| record(frame)).unwrap();
    }
}

#[test]
fn datasets_by_frames() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    store(&at("a"), 3, 0.5, 7);
    store(&at("same"), 3, 0.5, 7);
    store(&at("near"), 3, 0.5004, 7);
    store(&at("far"), 3, 0.8, 8);
    store(&at("short"), 2, 0.5, 7);
    let t = Tolerances::default();
    let what = |b: &str| -> Vec<String> {
        both(&at("a"), &at(b), &t).differences.into_iter().map(|d| format!("{} {}", d.file, d.what)).collect()
    };
    assert!(what("same").is_empty() && what("near").is_empty());
    let found = what("far");
    assert_eq!(found.len(), 3 * 4, "{found:?}");
    for one in ["frame_000002/map relative L2", "frame_000000/rows level_dbm", "frame_000001/rows count"] {
        assert!(found.iter().any(|f| f == one), "{found:?}");
    }
    assert_eq!(what("short"), ["layout.json frames"]);
    // What is not what was written is an error.
    std::fs::write(at("near/frame_000001/rows.csv"), "frame,level_dbm,count\n").unwrap();
    let e = diff(&at("a"), &at("near"), &t, &|_| ()).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    assert!(e.to_string().contains("rows.csv: broken"), "{e}");
}

/// Of two manifests given as files, as of two folders, times and versions do not count, and figures do.
#[test]
fn manifests_are_compared_by_their_figures() {
    let dir = tempfile::tempdir().unwrap();
    let place = |name: &str, seconds: f64, points: u32| {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        let path = folder.join("manifest.json");
        std::fs::write(&path, format!("{{\"seconds\": {{ \"trace\": {seconds} }}, \"points\": {points}}}"))
            .unwrap();
        path
    };
    let (a, later, other) = (place("a", 1.0, 7), place("b", 2.0, 7), place("c", 1.0, 8));
    let t = Tolerances::default();
    assert!(both(&a, &later, &t).alike);
    assert!(!both(&a, &other, &t).alike);
}
