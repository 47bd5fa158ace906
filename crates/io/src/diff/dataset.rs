//! Datasets, whatever their formats: frames by their numbers, one array or table of a frame at a time.

use super::array;
use super::differences::{Difference, DifferenceTally, Tolerances};
use super::points::{self, Gate};
use super::table::{self, Grid};
use crate::dataset::{Marker, SHARDS};
use crate::files::frame_name;
use crate::store::DatasetLayout;
use catseye::base::error::Result;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;

/// Whether the shard of a frame is complete; a folder without markers is taken as complete.
fn has(dir: &Path, layout: &DatasetLayout, frame: u64) -> bool {
    let shard = layout.shard_of(frame);
    !dir.join(SHARDS).is_dir() || dir.join(Marker::name(shard)).is_file()
}

/// Size of the cells in which points match: the requested one, otherwise that of the frame's radars,
/// otherwise half a metre and half a metre per second. Of several radars, the largest.
fn gate(radars: Option<&Grid>, t: &Tolerances) -> Gate {
    let cell = |name: &str| {
        let cells = radars?.numbers(name)?;
        cells.iter().copied().filter(|x| x.is_finite()).reduce(f64::max)
    };
    let range_m = t.match_m.or_else(|| cell("range_bin_m"));
    let rate_mps = t.match_mps.or_else(|| cell("range_rate_bin_mps"));
    Gate([range_m.unwrap_or(0.5), rate_mps.unwrap_or(0.5), t.match_deg])
}

/// Function that is called for each file or frame that was compared, with the total number.
pub type Progress<'a> = &'a (dyn Fn(u64) + Sync);

/// Compares two datasets. `progress` is called for each frame, with the total number.
///
/// # Errors
/// Returns `BadInput` for a dataset that is damaged or of a format that this build cannot read.
pub fn compare(
    a: &Path,
    b: &Path,
    t: &Tolerances,
    found: &mut DifferenceTally,
    progress: Progress<'_>,
) -> Result<()> {
    const LAYOUT: &str = crate::store::LAYOUT;
    let (x, y) = (DatasetLayout::open(a)?, DatasetLayout::open(b)?);
    if x.frames != y.frames {
        found.note(Difference::unequal(LAYOUT, "frames", "frames", x.frames.into(), y.frames.into()));
    }
    let absent = |what: &str, name: &str, in_a: bool, found: &mut DifferenceTally| {
        let name = json!(name);
        let (a, b) = if in_a { (name, Value::Null) } else { (Value::Null, name) };
        found.note(Difference::unequal(LAYOUT, what, what, a, b));
    };
    for spec in x.arrays.iter().filter(|s| y.array(&s.name).is_err()) {
        absent(&format!("array {}", spec.name), &spec.name, true, found);
    }
    for spec in y.arrays.iter().filter(|s| x.array(&s.name).is_err()) {
        absent(&format!("array {}", spec.name), &spec.name, false, found);
    }
    for spec in x.tables.iter().filter(|s| y.table(&s.name).is_err()) {
        absent(&format!("table {}", spec.name), &spec.name, true, found);
    }
    for spec in y.tables.iter().filter(|s| x.table(&s.name).is_err()) {
        absent(&format!("table {}", spec.name), &spec.name, false, found);
    }
    let mut arrays = Vec::new();
    for spec in &x.arrays {
        let Ok(other) = y.array(&spec.name) else { continue };
        let told =
            |s: &crate::store::ArraySpec| json!(format!("{} {:?} in {}", s.kind.name(), s.shape, s.unit));
        match (spec.kind, &spec.shape, &spec.unit) == (other.kind, &other.shape, &other.unit) {
            true => arrays.push(spec),
            false => {
                let what = format!("array {}", spec.name);
                found.note(Difference::unequal(LAYOUT, &what, &*what, told(spec), told(other)));
            }
        }
    }
    let frames = x.frames.min(y.frames);
    let one = |frame: u64| -> Result<DifferenceTally> {
        let mut found = DifferenceTally::default();
        let folder = frame_name(frame as u32);
        progress(frames);
        let there = [has(a, &x, frame), has(b, &y, frame)];
        if there != [true; 2] {
            if there[0] != there[1] {
                let [p, q] = there.map(|is| if is { json!("there") } else { Value::Null });
                found.note(Difference::unequal(&folder, "frame", "its shard", p, q));
            }
            return Ok(found);
        }
        for spec in &arrays {
            let file = format!("{folder}/{}", spec.name);
            let (p, q) = (x.read_array(a, &spec.name, frame)?, y.read_array(b, &spec.name, frame)?);
            array::stored(&file, &spec.shape, &p.data, &q.data, t, &mut found);
            found.files += 1;
        }
        let radars = match x.table("radars") {
            Ok(_) => Some(Grid::of(x.read_table(a, "radars", frame)?)),
            Err(_) => None,
        };
        for spec in x.tables.iter().filter(|s| y.table(&s.name).is_ok()) {
            let file = format!("{folder}/{}", spec.name);
            let p = Grid::of(x.read_table(a, &spec.name, frame)?);
            let q = Grid::of(y.read_table(b, &spec.name, frame)?);
            match spec.name.as_str() {
                "points" => points::compare(&file, &p, &q, gate(radars.as_ref(), t), t, &mut found),
                "returns" => points::compare(&file, &p, &q, Gate::tight(t), t, &mut found),
                _ => table::rows(&file, &p, &q, t, &mut found),
            }
            found.files += 1;
        }
        Ok(found)
    };
    let all =
        (0..frames).into_par_iter().map(one).try_reduce(DifferenceTally::default, |mut all, more| {
            all.add(more);
            Ok(all)
        })?;
    found.add(all);
    Ok(())
}
