//! `catseye fit-sensor` as a user meets it.

use crate::common::{done, refused, root};
use catseye::formats::npy;
use num_complex::Complex64;

#[test]
fn a_measured_frame_is_fitted_and_the_fragment_is_a_front_end() {
    let t = tempfile::tempdir().unwrap();
    let cube = root().join("tests/data/openradar/simple_frame_1.npy");
    let cube = cube.to_str().unwrap();
    let text =
        done(t.path(), &["fit-sensor", cube, "--words", "unsigned16", "-o", "fit", "--quiet", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&report["is_assumed"], &report["fit"]["quantiser"]["step"]), (&true.into(), &1.0.into()));
    let read = |file: &str| std::fs::read_to_string(t.path().join("fit").join(file)).unwrap();
    let fragment = read("front_end.toml");
    let preset = std::fs::read_to_string(root().join("scenes/presets/demo77.toml")).unwrap();
    assert!(!preset.contains("[front_end"), "the preset has a front end of its own");
    let radar = catseye::scene::radar_toml::parse(t.path(), &format!("{preset}\n{fragment}")).unwrap();
    assert_eq!(radar.front_end.adc.unwrap().bits, 16);
    let csv = read("comparison.csv");
    assert!(csv.starts_with("quantity,at,unit,measured,simulated\n"));
    assert_eq!(csv.lines().filter(|l| l.starts_with("floor,")).count(), 128);
    let again: serde_json::Value = serde_json::from_str(&read("fit.json")).unwrap();
    assert_eq!(again["fit"], report["fit"]);
    refused(t.path(), &["fit-sensor", cube, "--words", "unsigned16", "-o", "fit"], &["exists already"]);
    done(t.path(), &["fit-sensor", cube, "--words", "unsigned16", "-o", "fit", "--force", "--quiet"]);
}

#[test]
fn hostile_cubes_are_one_line() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let write =
        |name: &str, shape: &[usize], data: &[Complex64]| npy::write(d.join(name), shape, data).unwrap();
    let zeros = vec![Complex64::ZERO; 16 * 64];
    let some: Vec<Complex64> = (0..16 * 64).map(|i| Complex64::cis((i * i) as f64)).collect();
    let mut nan = some.clone();
    nan[70] = Complex64::new(f64::NAN, 0.0);
    write("zeros.npy", &[16, 64], &zeros);
    write("nan.npy", &[16, 64], &nan);
    write("one.npy", &[1, 64], &some[..64]);
    write("flat.npy", &[1024], &some);
    let row: Vec<Complex64> = some[..64].iter().cycle().take(16 * 64).copied().collect();
    write("same.npy", &[16, 64], &row);
    write("good.npy", &[16, 64], &some);
    let real: Vec<f32> = (0..1024).map(|i| i as f32).collect();
    npy::write(d.join("real.npy"), &[16, 64], &real).unwrap();
    for (file, part) in [
        ("zeros.npy", "all samples are the same"),
        ("nan.npy", "NaN"),
        ("one.npy", "at least 8 chirps"),
        ("flat.npy", "shape"),
        ("same.npy", "repeat without noise"),
        ("real.npy", "needs I and Q"),
        ("none.npy", "no such file"),
    ] {
        refused(d, &["fit-sensor", file, "-o", "out"], &[file, part]);
        assert!(!d.join("out").exists(), "{file}");
    }
    refused(d, &["fit-sensor", "good.npy", "-o", "out", "--words", "unsigned16"], &["--words", "0..=65535"]);
    refused(d, &["fit-sensor", "good.npy", "-o", "out", "--radar", "demo77"], &["does not fit the cube"]);
    refused(d, &["fit-sensor", "good.npy", "-o", "out", "--frame", "1"], &["--frame", "0..=0"]);
    refused(d, &["fit-sensor", "good.npy", "-o", "out", "--bits", "40"], &["--bits", "1..=24"]);
    refused(
        d,
        &["fit-sensor", "good.npy", "-o", "out", "--full-scale-dbm", "-20"],
        &["no common quantisation step"],
    );
}
