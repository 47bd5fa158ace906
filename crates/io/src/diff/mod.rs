//! Compares two results of one kind within tolerances: files, runs, datasets, studies.
//!
//! A folder's files are compared each by its kind, and its manifest by its figures. Arrays are read side by side a piece at
//! a time, datasets an array of a frame at a time; tables are held in memory. Frames and files are compared in parallel.

mod array;
mod dataset;
mod differences;
mod document;
mod kind;
mod measure;
mod points;
mod rcs;
mod table;
#[cfg(test)]
mod tests;

pub use dataset::Progress;
pub use differences::{Difference, Quantity, Report, Tolerances};

use catseye::base::error::{BadInput, Result};
use catseye::formats::stage::{MANIFEST, files_of, sha256_of_file};
use differences::DifferenceTally;
use kind::Kind;
use points::Gate;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;
use table::Grid;

/// Compares two results. NaN equals NaN; what only one of them has is a difference.
///
/// # Errors
/// Returns `BadInput` for what is no result or is damaged, for two results of different kinds, and for an
/// invalid tolerance.
pub fn diff(a: &Path, b: &Path, t: &Tolerances, progress: Progress<'_>) -> Result<Report> {
    t.check()?;
    let (kind, other) = (Kind::of(a)?, Kind::of(b)?);
    let are_cubes = [&kind, &other].iter().all(|k| matches!(k, Kind::Array | Kind::Cube));
    if kind != other && !are_cubes {
        return Err(BadInput::new(format!(
            "is of the kind '{other}', and {} is of the kind '{kind}'",
            a.display()
        ))
        .file(b)
        .remedy("give two results of one kind")
        .into());
    }
    let mut found = match kind {
        Kind::Rcs | Kind::Points | Kind::Echoes | Kind::Study | Kind::Table => {
            DifferenceTally::with_distances()
        }
        _ => DifferenceTally::default(),
    };
    match kind {
        Kind::Dataset => dataset::compare(a, b, t, &mut found, progress)?,
        Kind::Folder(_) | Kind::Frame => folders(a, b, t, &mut found, progress)?,
        _ => {
            let name = a.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
            files(&name, [a, b], [&kind, &other], cells_beside(a), t, &mut found)?;
            progress(1);
        }
    }
    Ok(Report {
        a: a.to_path_buf(),
        b: b.to_path_buf(),
        kind: kind.to_string(),
        alike: found.is_alike(),
        files: found.files,
        values: found.values,
        tolerances: t.clone(),
        quantities: found.quantities(),
        differences: found.list(),
    })
}

/// Size of a cell in range (m) and in range rate (m/s).
type Cells = Option<[f64; 2]>;

/// Cells of the axes of a radar in a manifest; with a single radar it has no name there.
fn cells(manifest: &Value, radar: &str) -> Cells {
    let axes = manifest.get("axes")?;
    let axes = if axes.get("range_m").is_some() { axes } else { axes.get(radar)? };
    let step = |name: &str| axes.get(name)?.get("step")?.as_f64();
    Some([step("range_m")?, step("range_rate_mps")?])
}

fn folder_name(path: &Path) -> String {
    path.parent().and_then(Path::file_name).map_or(String::new(), |n| n.to_string_lossy().into_owned())
}

/// Cells from the manifest nearest to a file of points; its folder may be that of a frame or of a frame's
/// radar.
fn cells_beside(path: &Path) -> Cells {
    let manifest = path.ancestors().skip(1).take(3).map(|dir| dir.join(MANIFEST)).find(|m| m.is_file())?;
    cells(&document::read(&manifest).ok()?, &folder_name(path))
}

fn gate(cells: Cells, t: &Tolerances) -> Gate {
    let [range_m, rate_mps] = cells.unwrap_or([0.5; 2]);
    Gate([t.match_m.unwrap_or(range_m), t.match_mps.unwrap_or(rate_mps), t.match_deg])
}

/// Compares two files; `name` is their path below their folders.
fn files(
    name: &str,
    [a, b]: [&Path; 2],
    kinds: [&Kind; 2],
    cells: Cells,
    t: &Tolerances,
    found: &mut DifferenceTally,
) -> Result<()> {
    let are_cubes = kinds.iter().all(|k| matches!(k, Kind::Array | Kind::Cube));
    if kinds[0] != kinds[1] && !are_cubes {
        let [kind, other] = kinds.map(|k| json!(k.to_string()));
        found.note(Difference::unequal(name, "kind of file", "all", kind, other));
        return Ok(());
    }
    match kinds[0] {
        Kind::Array if kinds[1] == kinds[0] => array::npy(name, a, b, t, found)?,
        Kind::Array | Kind::Cube => array::cubes(name, a, b, t, found)?,
        Kind::Rcs => rcs::compare(name, a, b, t, found)?,
        Kind::Points | Kind::Echoes => {
            let gate = if *kinds[0] == Kind::Echoes { Gate::tight(t) } else { gate(cells, t) };
            let (a, b) = (Grid::read(a)?, Grid::read(b)?);
            match points::is_points(&a) && points::is_points(&b) {
                true => points::compare(name, &a, &b, gate, t, found),
                // A position is not finite, so there is nothing to match by.
                false => table::rows(name, &a, &b, t, found),
            }
        }
        Kind::Study | Kind::Table => table::rows(name, &Grid::read(a)?, &Grid::read(b)?, t, found),
        Kind::Report => document::compare_figures(name, &document::read(a)?, &document::read(b)?, t, found),
        // Times and versions, which no two runs share, are left out as they are within folders.
        Kind::Document if [a, b].iter().all(|p| p.ends_with(MANIFEST)) => {
            document::compare_figures(name, &document::read(a)?, &document::read(b)?, t, found);
        }
        Kind::Document => document::compare(name, &document::read(a)?, &document::read(b)?, t, found),
        Kind::Shown => return Ok(()),
        Kind::Other | Kind::Dataset | Kind::Frame | Kind::Folder(_) => {
            let sums = [sha256_of_file(a)?, sha256_of_file(b)?];
            if sums[0] != sums[1] {
                let [a, b] = sums.map(|s| json!(&s[..12]));
                found.note(Difference::unequal(name, "bytes", "SHA-256", a, b));
            }
        }
    }
    found.files += 1;
    Ok(())
}

/// Compares all files of two folders, and their manifests.
fn folders(
    a: &Path,
    b: &Path,
    t: &Tolerances,
    found: &mut DifferenceTally,
    progress: Progress<'_>,
) -> Result<()> {
    let list = |dir: &Path| -> Result<BTreeSet<String>> { Ok(files_of(dir)?.into_iter().collect()) };
    let (here, there) = (list(a)?, list(b)?);
    let manifests = match here.contains(MANIFEST) && there.contains(MANIFEST) {
        true => Some([document::read(&a.join(MANIFEST))?, document::read(&b.join(MANIFEST))?]),
        false => None,
    };
    let all: Vec<&String> = here.union(&there).filter(|name| *name != MANIFEST).collect();
    let one = |name: &&String| -> Result<DifferenceTally> {
        let mut found = DifferenceTally::default();
        progress(all.len() as u64);
        let paths = [a.join(name), b.join(name)];
        if !here.contains(*name) || !there.contains(*name) {
            let word = |is: bool| if is { json!("there") } else { Value::Null };
            let (a, b) = (word(here.contains(*name)), word(there.contains(*name)));
            found.note(Difference::unequal(name, "file", "all", a, b));
            return Ok(found);
        }
        let kinds = [Kind::of_file(&paths[0])?, Kind::of_file(&paths[1])?];
        let cells = match &manifests {
            Some([first, _]) => cells(first, &folder_name(&paths[0])),
            None => cells_beside(&paths[0]),
        };
        files(name, [&paths[0], &paths[1]], [&kinds[0], &kinds[1]], cells, t, &mut found)?;
        Ok(found)
    };
    let compared = all.par_iter().map(one).try_reduce(DifferenceTally::default, |mut all, more| {
        all.add(more);
        Ok(all)
    })?;
    found.add(compared);
    if let Some([first, second]) = &manifests {
        document::compare_figures(MANIFEST, first, second, t, found);
        found.files += 1;
    }
    Ok(())
}
