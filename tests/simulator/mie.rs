//! Mie series against the Austin RCS Benchmark Suite, sets I.A (metal) and I.C (water); see
//! tests/data/austin_rcs.

use catseye::base::units::dbsm_from_amplitude;
use catseye::em::mie::SphereSeries;
use num_complex::Complex64;
use std::path::Path;

/// Rows (frequency in Hz, bistatic angle in degrees, dBsm) of a file.
fn rows(file: &str) -> Vec<[f64; 3]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/austin_rcs").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{file}: {e}"));
    let rows: Vec<[f64; 3]> = text
        .lines()
        .filter(|l| !l.trim().is_empty())
        .map(|l| {
            let n: Vec<f64> = l.split_whitespace().map(|w| w.parse().unwrap()).collect();
            assert_eq!((n.len(), n[1]), (4, 90.0), "{file}: {l}");
            [n[0], n[2], n[3]]
        })
        .collect();
    assert_eq!(rows.len(), 3601, "{file}");
    rows
}

/// Greatest difference in dB over a file's 3601 directions, and its smallest value in dBsm. `across`:
/// polarisation normal to the plane of the cut.
fn worst_db(rows: &[[f64; 3]], across: bool, series: &SphereSeries) -> (f64, f64) {
    rows.iter().fold((0.0, f64::INFINITY), |(worst, least), [_, angle, reference]| {
        let s = series.bistatic_m(angle.to_radians());
        let db = dbsm_from_amplitude(if across { s.0 } else { s.1 }.norm());
        (f64::max(worst, (db - reference).abs()), f64::min(least, *reference))
    })
}

/// Radius of the suite's sizes.
fn radius_m(file: &str) -> f64 {
    if file.contains(".s7.") { 9.6 } else { 0.3 }
}

#[test]
fn pec_spheres_of_the_austin_suite() {
    for size in ["s2", "s7"] {
        for frequency in ["f1", "f6"] {
            for polarisation in ["V", "H"] {
                let file = format!("ref_rcs.I.A.{size}.{frequency}.{polarisation}.txt");
                let rows = rows(&file);
                let series = SphereSeries::pec(radius_m(&file), rows[0][0]).unwrap();
                let (worst, least) = worst_db(&rows, polarisation == "V", &series);
                println!("{file}: worst difference {worst:.2e} dB, lowest value {least:.1} dBsm");
                assert!(worst < 1e-5, "{file}: {worst} dB");
            }
        }
    }
}

/// The suite's permittivity table; its "unusual" case has its own value. Labels H and V are swapped
/// against the suite's own definition: H is the polarisation normal to the cut here.
#[test]
fn water_spheres_of_the_austin_suite() {
    let water = |real: f64, loss: f64| Complex64::new(real, -loss);
    for (case, eps) in [
        ("s2.f1", water(78.44, 0.038)),
        ("s2.f4", water(78.44, 0.306)),
        ("s2.f4.unusual", water(78.98, 0.2)),
        ("s2.f6", water(78.44, 1.225)),
        ("s7.f1", water(78.44, 0.038)),
        ("s7.f6", water(78.44, 1.225)),
    ] {
        for label in ["H", "V"] {
            let (stem, rest) = case.split_at(5);
            let file = format!("ref_rcs.I.C.{stem}.{label}{rest}.txt");
            let rows = rows(&file);
            let series = SphereSeries::dielectric(radius_m(&file), eps, rows[0][0]).unwrap();
            let (worst, least) = worst_db(&rows, label == "H", &series);
            println!("{file}: worst difference {worst:.2e} dB, lowest value {least:.1} dBsm");
            assert!(worst < 1e-4, "{file}: {worst} dB");
            let (swapped, _) = worst_db(&rows, label == "V", &series);
            assert!(swapped > 1.0, "{file}: the labels do not matter");
        }
    }
}

#[test]
fn the_comparison_notices_another_sphere() {
    // The comparison must notice the wrong sphere; a thousandth of its radius more is 0.0087 dB.
    let rows = rows("ref_rcs.I.A.s7.f6.V.txt");
    let other = SphereSeries::pec(9.6 * 1.001, rows[0][0]).unwrap();
    assert!(worst_db(&rows, true, &other).0 > 0.0087);
}
