//! `points.csv`, `returns.csv` and `angle_cells.csv`.

use super::columns::{ANGLE_CELLS, POINTS, echoes as echo_columns, received};
use super::points::Point;
use super::spectra::SpectrumCell;
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
    write_rows(out, &POINTS, points)
}

/// Writes echoes as CSV with a header; the columns are those of [`super::columns::echoes`].
///
/// # Errors
/// Returns an error if the output cannot be written.
pub fn write_echoes<W: Write>(out: W, radar: &Radar, echoes: &Echoes) -> std::io::Result<W> {
    write_rows(out, &echo_columns(), &received(radar, echoes))
}

/// Writes the cells of angular spectra as CSV with a header; the columns are [`ANGLE_CELLS`].
///
/// # Errors
/// Returns the error of the writer.
pub fn write_angle_cells<W: Write>(out: W, cells: &[SpectrumCell]) -> std::io::Result<W> {
    write_rows(out, &ANGLE_CELLS, cells)
}

/// Writes rows as CSV with a header of the columns' names.
///
/// # Errors
/// Returns the error of the writer.
pub fn write_rows<W: Write, T>(out: W, columns: &[Column<T>], rows: &[T]) -> std::io::Result<W> {
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
