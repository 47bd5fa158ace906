//! Mie series against the Austin RCS Benchmark Suite, set I.A (see tests/data/austin_rcs).

use catseye::em::mie::SphereSeries;
use catseye::units::dbsm_from_amplitude;
use std::path::Path;

/// Greatest difference in dB over a file's 3601 directions, and its smallest value in dBsm.
fn worst_db(file: &str, radius_m: f64) -> (f64, f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/austin_rcs").join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    let vertical = file.contains(".V.");
    let (mut worst, mut least, mut rows) = (0.0f64, f64::INFINITY, 0);
    let mut series: Option<SphereSeries> = None;
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        let n: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let m = series.get_or_insert_with(|| SphereSeries::pec(radius_m, n[0]).unwrap());
        let (across, along) = m.bistatic_m(n[2].to_radians());
        let db = dbsm_from_amplitude(if vertical { across } else { along }.norm());
        worst = worst.max((db - n[3]).abs());
        least = least.min(n[3]);
        rows += 1;
    }
    assert_eq!(rows, 3601, "{file}");
    (worst, least)
}

#[test]
fn pec_spheres_of_the_austin_suite() {
    for (file, radius_m) in [
        ("ref_rcs.I.A.s2.f1.V.txt", 0.3),
        ("ref_rcs.I.A.s2.f6.H.txt", 0.3),
        ("ref_rcs.I.A.s7.f6.V.txt", 9.6),
        ("ref_rcs.I.A.s7.f6.H.txt", 9.6),
    ] {
        let (worst, least) = worst_db(file, radius_m);
        println!("{file}: worst difference {worst:.2e} dB, lowest value {least:.1} dBsm");
        assert!(worst < 1e-5, "{file}: {worst} dB");
    }
}

#[test]
fn the_comparison_notices_another_sphere() {
    // The comparison must notice the wrong sphere; a thousandth of its radius more is 0.0087 dB.
    assert!(worst_db("ref_rcs.I.A.s7.f6.V.txt", 9.6 * 1.001).0 > 0.0087);
}
