//! Tables of cross sections.

use super::{Frames, Page, pack, scene};
use catseye::base::error::Result;
use catseye::formats::rcs_csv;
use catseye::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

/// A table that `catseye rcs` wrote, or one of measurements with the same columns.
pub fn table(path: &Path) -> Result<Value> {
    let (comments, rows) = rcs_csv::read(path)?;
    let column = |f: &dyn Fn(&rcs_csv::RawRow) -> f64| pack::f64s(rows.iter().map(f));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let levels = |k: usize| pack::f64s(rows.iter().map(move |r| r.dbsm[k]));
    Ok(json!({
        "name": name,
        "comments": comments,
        "frequency_hz": column(&|r| r.frequency_hz),
        "azimuth_deg": column(&|r| r.azimuth_deg),
        "elevation_deg": column(&|r| r.elevation_deg),
        "vv_dbsm": levels(0), "vh_dbsm": levels(1), "hv_dbsm": levels(2), "hh_dbsm": levels(3),
        // S of the co-polarised pair, for images from sweeps of frequency and angle.
        "vv_re_m": column(&|r| r.s[0][0].re), "vv_im_m": column(&|r| r.s[0][0].im),
    }))
}

/// The page of one table or of several laid over each other, beside the target itself where it is given.
///
/// # Errors
/// Returns `BadInput` for a file that is no table of cross sections, and for a target of too many triangles.
pub fn page(paths: &[&Path], target: Option<&Scene>) -> Result<Page> {
    let tables = paths.iter().map(|p| table(p)).collect::<Result<Vec<Value>>>()?;
    let names: Vec<&str> = tables.iter().filter_map(|t| t["name"].as_str()).collect();
    let title = names.join(", ");
    let target = target.map(|s| scene::small(&title, s).map(|()| scene::scene(s, &[0.0]))).transpose()?;
    let data = json!({ "kind": "rcs", "title": title, "rcs": tables, "scene": target });
    Ok(Page { title, data, frames: Frames { count: 0, of: Box::new(|_| Ok(Value::Null)) } })
}
