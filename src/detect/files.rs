//! `points.csv` and `returns.csv`.

use super::columns::{POINTS, echoes as echo_columns, heard};
use super::points::Point;
use crate::formats::column::Column;
use crate::formats::csv::Writer;
use crate::scene::radar::Radar;
use crate::trace::Echoes;
use std::borrow::Cow;
use std::io::Write;

/// Writes points as CSV with a header; the columns are [`POINTS`].
///
/// # Errors
/// Returns an error if the output cannot be written.
pub fn write_points<W: Write>(out: W, points: &[Point]) -> std::io::Result<W> {
    write(out, &POINTS, points)
}

/// Writes echoes as CSV with a header; the columns are those of [`super::columns::echoes`].
///
/// # Errors
/// Returns an error if the output cannot be written.
pub fn write_echoes<W: Write>(out: W, radar: &Radar, echoes: &Echoes) -> std::io::Result<W> {
    write(out, &echo_columns(), &heard(radar, echoes))
}

fn write<W: Write, T>(out: W, columns: &[Column<T>], rows: &[T]) -> std::io::Result<W> {
    let header: Vec<&str> = columns.iter().map(|c| c.name).collect();
    let mut table = Writer::new(out, &[], &header)?;
    let mut cells: Vec<Cow<'_, str>> = Vec::with_capacity(columns.len());
    for row in rows {
        cells.clear();
        cells.extend(columns.iter().map(|c| c.cell(row)));
        table.row(cells.iter().map(|c| c as &dyn std::fmt::Display))?;
    }
    table.finish()
}
