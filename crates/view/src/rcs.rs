//! Tables of cross sections.

use super::{Page, pack, scene};
use catseye::base::error::{BadInput, Result};
use catseye::formats::rcs_csv::{self, RawRow};
use catseye::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

/// A table that `catseye rcs` wrote, or one of measurements with the same columns.
pub fn table(path: &Path) -> Result<Value> {
    let (comments, rows) = rcs_csv::read(path)?;
    Ok(of_rows(&path.file_name().unwrap_or_default().to_string_lossy(), &comments, &rows))
}

/// The rows of a table by its name.
fn of_rows(name: &str, comments: &[String], rows: &[RawRow]) -> Value {
    let column = |f: &dyn Fn(&RawRow) -> f64| pack::f64s(rows.iter().map(f));
    let levels = |k: usize| pack::f64s(rows.iter().map(move |r| r.dbsm[k]));
    json!({
        "name": name,
        "comments": comments,
        "frequency_hz": column(&|r| r.frequency_hz),
        "azimuth_deg": column(&|r| r.azimuth_deg),
        "elevation_deg": column(&|r| r.elevation_deg),
        "vv_dbsm": levels(0), "vh_dbsm": levels(1), "hv_dbsm": levels(2), "hh_dbsm": levels(3),
        // S of the co-polarised pair, for images from sweeps of frequency and angle.
        "vv_re_m": column(&|r| r.s[0][0].re), "vv_im_m": column(&|r| r.s[0][0].im),
    })
}

/// The page of one table or of several laid over each other, beside the target itself where it is given.
///
/// # Errors
/// Returns `BadInput` for a file that is no table of cross sections, and for a target of too many triangles.
pub fn page(paths: &[&Path], target: Option<&Scene>) -> Result<Page> {
    of_tables(paths.iter().map(|p| table(p)).collect::<Result<Vec<Value>>>()?, target)
}

fn of_tables(tables: Vec<Value>, target: Option<&Scene>) -> Result<Page> {
    let names: Vec<&str> = tables.iter().filter_map(|t| t["name"].as_str()).collect();
    let title = names.join(", ");
    let target = target.map(|s| scene::small(&title, s).map(|()| scene::scene(s, &[0.0]))).transpose()?;
    let data = json!({ "kind": "rcs", "title": title, "rcs": tables, "scene": target });
    Ok(Page::still(title, data))
}

/// A table of cross sections in memory.
pub struct RcsTable {
    /// What the page calls it, as the name of a file.
    pub name: String,
    /// Lines about it, as those that begin a file.
    pub comments: Vec<String>,
    /// One row for each frequency and direction.
    pub rows: Vec<RawRow>,
}

impl Page {
    /// The page of tables of cross sections that lie in memory, laid over each other, beside the target itself where it is given.
    ///
    /// # Errors
    /// Returns `BadInput` where there is no table, or one without rows, and for a target of more triangles than a page takes.
    pub fn of_rcs(tables: &[RcsTable], target: Option<&Scene>) -> Result<Page> {
        if tables.is_empty() || tables.iter().any(|t| t.rows.is_empty()) {
            return Err(BadInput::new("there is no cross section to show")
                .allowed("tables with one row or more")
                .into());
        }
        of_tables(tables.iter().map(|t| of_rows(&t.name, &t.comments, &t.rows)).collect(), target)
    }
}
