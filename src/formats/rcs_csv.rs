//! The columns of the RCS table, as every reader and writer of it sees them: one row for each
//! frequency and direction, angles in degrees, amplitudes in metres (CONVENTIONS eq. 3).

use super::csv::{Columns, Table};
use crate::base::error::{BadInput, Result};
use crate::base::matrix::Matrix2;
use num_complex::Complex64;
use std::path::Path;

/// Columns of the CSV, in order.
pub const COLUMNS: [&str; 15] = [
    "frequency_hz",
    "azimuth_deg",
    "elevation_deg",
    "vv_dbsm",
    "vh_dbsm",
    "hv_dbsm",
    "hh_dbsm",
    "vv_re_m",
    "vv_im_m",
    "vh_re_m",
    "vh_im_m",
    "hv_re_m",
    "hv_im_m",
    "hh_re_m",
    "hh_im_m",
];

/// Columns after those when transmitter and receiver stand apart: where the receiver is.
pub const RECEIVE_COLUMNS: [&str; 2] = ["rx_azimuth_deg", "rx_elevation_deg"];

/// One row as it stands in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawRow {
    /// Line in the file, from 1.
    pub line: usize,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Azimuth, degrees.
    pub azimuth_deg: f64,
    /// Elevation, degrees.
    pub elevation_deg: f64,
    /// Azimuth and elevation of the receiver, degrees, in files that give them.
    pub receive_deg: Option<(f64, f64)>,
    /// VV, VH, HV, HH.
    pub dbsm: [f64; 4],
    /// `S[rx][tx]` in m, index 0 is V.
    pub s: Matrix2,
}

/// Whether a file of this name is Parquet.
///
/// # Errors
/// Returns an error if the file is Parquet and this build does not read it.
pub fn is_parquet(path: impl AsRef<Path>) -> Result<bool> {
    let path = path.as_ref();
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
    if named && cfg!(not(feature = "parquet")) {
        return Err(BadInput::new("this build has no Parquet")
            .file(path)
            .remedy("use a .csv file, or build with `--features parquet`")
            .into());
    }
    Ok(named)
}

/// Reads comments and rows of a file, as Parquet when it is named so, else as CSV. Further columns are allowed and
/// ignored.
///
/// # Errors
/// Returns `BadInput` for a missing column, a cell that is not a number, a table without rows.
pub fn read(path: impl AsRef<Path>) -> Result<(Vec<String>, Vec<RawRow>)> {
    if is_parquet(&path)? {
        #[cfg(feature = "parquet")]
        return rows(&path, &super::parquet_table::Table::read(&path)?);
    }
    rows(&path, &Table::read(&path)?)
}

/// Parses a text as [`read`] does a file; `path` is only named in errors.
///
/// # Errors
/// Returns `BadInput` for a missing column, a cell that is not a number, or a table without rows.
pub fn parse(path: impl AsRef<Path>, text: String) -> Result<(Vec<String>, Vec<RawRow>)> {
    rows(&path, &Table::parse(&path, text)?)
}

fn rows(path: impl AsRef<Path>, table: &impl Columns) -> Result<(Vec<String>, Vec<RawRow>)> {
    let columns = COLUMNS.iter().map(|c| table.numbers(c)).collect::<Result<Vec<_>>>()?;
    let [rx_azimuth, rx_elevation] = RECEIVE_COLUMNS;
    let receive = if table.has(rx_azimuth) || table.has(rx_elevation) {
        Some((table.numbers(rx_azimuth)?, table.numbers(rx_elevation)?))
    } else {
        None
    };
    if table.is_empty() {
        return Err(BadInput::new("the table has no rows").file(path).into());
    }
    let rows = (0..table.len())
        .map(|i| {
            let z = |c: usize| Complex64::new(columns[c][i], columns[c + 1][i]);
            RawRow {
                line: table.line(i),
                frequency_hz: columns[0][i],
                azimuth_deg: columns[1][i],
                elevation_deg: columns[2][i],
                receive_deg: receive.as_ref().map(|(a, e)| (a[i], e[i])),
                dbsm: [3, 4, 5, 6].map(|c| columns[c][i]),
                s: [[z(7), z(9)], [z(11), z(13)]],
            }
        })
        .collect();
    Ok((table.comments().to_vec(), rows))
}
