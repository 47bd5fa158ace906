//! `catseye validate --vehicles` as a user meets it.

use crate::common::{done, refused};

/// A small grid writes its tables and its picture, of which the numbers agree with each other.
#[test]
fn vehicles_beside_published_ones() {
    let t = tempfile::tempdir().unwrap();
    let mut args = vec!["validate", "--vehicles", "--kinds", "pedestrian,cyclist", "--distances", "7,12"];
    args.extend(["--aspects", "4", "--bodies", "1", "-o", "out", "--device", "cpu", "--quiet"]);
    let text = done(t.path(), &args);
    assert!(text.contains("16 looks") && text.contains("3GPP TR 38.901"), "{text}");
    let read = |file: &str| std::fs::read_to_string(t.path().join("out").join(file)).unwrap();
    let looks = read("looks.csv");
    assert_eq!(looks.lines().count(), 17, "{looks}");
    let of = |kind: &str, distance: &str| -> Vec<f64> {
        let rows = looks.lines().map(|l| l.split(',').collect::<Vec<_>>());
        rows.filter(|r| r[0] == kind && r[2] == distance).filter_map(|r| r[5].parse().ok()).collect()
    };
    let powers: Vec<f64> = of("pedestrian", "7").iter().map(|db| 10f64.powf(0.1 * db)).collect();
    let mean = 10.0 * (powers.iter().sum::<f64>() / powers.len() as f64).log10();
    let statistics = read("statistics.csv");
    let row = statistics.lines().find(|l| l.starts_with("pedestrian,7,all,body,mean,")).unwrap();
    let columns: Vec<&str> = row.split(',').collect();
    assert_eq!(columns[6], "4");
    assert!((columns[7].parse::<f64>().unwrap() - mean).abs() < 1e-3, "{row} {mean}");
    let published: f64 = columns[8].parse().unwrap();
    assert!((published + 1.37).abs() < 1e-3, "{row}");
    assert!(statistics.starts_with("# source 1: "), "{statistics}");
    let png = std::fs::read(t.path().join("out/scatter.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
    refused(t.path(), &args, &["exists already"]);
}

#[test]
fn grids_that_cannot_be_are_one_line() {
    let t = tempfile::tempdir().unwrap();
    for (more, parts) in [
        (["--kinds", "sedn"], ["sedn", "did you mean 'sedan'?"]),
        (["--distances", "7,70"], ["--distances", "3..=50"]),
        (["--aspects", "2"], ["--aspects", "4..=360"]),
        (["--bodies", "0"], ["--bodies", "1..=100"]),
    ] {
        let args = [&["validate", "--vehicles", "-o", "out"][..], &more[..]].concat();
        refused(t.path(), &args, &parts);
        assert!(!t.path().join("out").exists(), "{more:?}");
    }
}
