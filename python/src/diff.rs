//! `catseye.diff`.

use crate::arrays::plain;
use crate::work;
use catseye_io::diff::{self as results, Tolerances};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Compares two results of one kind within tolerances, as `catseye diff --json` does: RCS tables, arrays, points, runs, datasets or studies. The kind
/// is detected from the files. A keyword that is not given has the default of the command line.
///
/// a, b: folders or files. tolerance_db: tolerance of powers and cross sections, dB. above_db: compare a cross section only where one of the two
/// exceeds the maximum minus this value, dB. phase_deg: tolerance of phases in RCS tables, degrees (default: phases are not compared). relative:
/// relative tolerance of arrays and other numbers. tolerance_m, tolerance_mps, tolerance_deg: tolerances of lengths, velocities and angles. match_m,
/// match_mps, match_deg: two points match when they differ by less. progress: called with the number of files or frames compared and the total.
///
/// Returns a dictionary: alike, kind, files, values, tolerances, a, b, differences: [{"file", "what", "places", "place", "a", "b", "apart",
/// "allowed", "unit"}, ...], and, for two tables, quantities: [{"what", "unit", "places", "beyond", "largest", "median", "place", "allowed"}, ...],
/// one for each numeric column. Raises BadInput for a file or folder that is not a result or is damaged, and for results of different kinds.
#[pyfunction]
#[pyo3(signature = (a, b, *, tolerance_db = None, above_db = None, phase_deg = None, relative = None, tolerance_m = None, tolerance_mps = None,
    tolerance_deg = None, match_m = None, match_mps = None, match_deg = None, progress = None))]
#[allow(clippy::too_many_arguments)] // keywords
pub fn diff(
    py: Python<'_>,
    a: PathBuf,
    b: PathBuf,
    tolerance_db: Option<f64>,
    above_db: Option<f64>,
    phase_deg: Option<f64>,
    relative: Option<f64>,
    tolerance_m: Option<f64>,
    tolerance_mps: Option<f64>,
    tolerance_deg: Option<f64>,
    match_m: Option<f64>,
    match_mps: Option<f64>,
    match_deg: Option<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let default = Tolerances::default();
    let tolerances = Tolerances {
        tolerance_db: tolerance_db.unwrap_or(default.tolerance_db),
        above_db: above_db.unwrap_or(default.above_db),
        phase_deg,
        relative: relative.unwrap_or(default.relative),
        tolerance_m: tolerance_m.unwrap_or(default.tolerance_m),
        tolerance_mps: tolerance_mps.unwrap_or(default.tolerance_mps),
        tolerance_deg: tolerance_deg.unwrap_or(default.tolerance_deg),
        match_m,
        match_mps,
        match_deg: match_deg.unwrap_or(default.match_deg),
    };
    let report = work::run(py, progress, move |watch| {
        results::diff(&a, &b, &tolerances, &|all| {
            watch.expect(all);
            watch.step(1);
        })
    })?;
    plain(py, &report)
}
