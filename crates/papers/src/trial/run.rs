//! `catseye lane`: one method on one scenario, into one folder, resumable.

use crate::trial::context::TrialContext;
use crate::trial::lane_table::LaneTable;
use crate::trial::method::Method;
use crate::trial::result_folder::{ResultFolder, RunOptions, RunReport, scenario};
use catseye::engine::Engine;
use catseye::error::Result;
use std::path::Path;

/// Runs a method on a scenario file into `out`. An interrupted run goes on when the same is asked for again.
///
/// Errors: those of the files; a scenario that the method cannot take, with what it lacks.
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
    let results = ResultFolder::open(&command, &[path], engine, out, o)?;
    let given = TrialContext {
        scenario: &scenario,
        path,
        engine,
        runs,
        keep: Some(results.keep.clone()),
        watch: o.watch,
    };
    let trial = table.method(method).trial(&given)?;
    trial.write(results.path())?;
    let trials = [(method.name().to_string(), &trial)];
    let folder = results.finish(engine, &command, (scenario.seed, runs), &[path], &trials)?;
    Ok(RunReport { folder, method: trial.method, title: trial.title, rows: trial.rows, notes: trial.notes })
}
