//! `catseye lane`: one method on one scenario, into one folder, resumable.

use crate::trial::context::TrialContext;
use crate::trial::lane_table::LaneTable;
use crate::trial::method::Method;
use crate::trial::result_folder::{ResultFolder, RunOptions, RunReport, scenario};
use catseye::base::error::Result;
use catseye::engine::Engine;
use std::path::Path;

/// Runs a method on a scenario file and writes the result to `out`. An interrupted run continues when it is
/// started again with the same arguments.
///
/// # Errors
/// Returns the errors of the files and frames, and an error for a scenario that the method cannot use, with
/// what it lacks.
pub fn run(
    engine: &Engine,
    method: Method,
    path: &Path,
    out: &Path,
    o: &RunOptions<'_>,
) -> Result<RunReport> {
    let table = LaneTable::load(path)?;
    let scenario = scenario(path, o)?;
    let runs = o.runs.or(table.runs).unwrap_or(1);
    let command = format!("lane {}", method.name());
    let paths = [path];
    let results = ResultFolder::open(&command, &paths, engine, out, o)?;
    let keep = Some(results.keep.clone());
    let given = TrialContext { scenario: &scenario, path, engine, runs, keep, watch: o.watch };
    let trial = table.method(method).trial(&given).map_err(|e| e.in_file(path))?;
    let seconds = trial.steps.iter().map(|s| s.seconds).collect();
    results.finish((scenario.seed, runs), trial, [(method.name().to_string(), seconds)].into())
}
