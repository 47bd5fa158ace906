//! Tables of any columns, from CSV files and from a dataset's frames.

use super::differences::{Difference, DifferenceTally, Tolerances, number};
use super::measure::Measure;
use crate::store::{Column, Table};
use catseye::base::error::Result;
use catseye::formats::csv;
use serde_json::Value;
use std::path::Path;

/// A column of a table.
pub enum Cells {
    /// Numbers; empty cells are NaN.
    Numbers(Vec<f64>),
    /// Text, where at least one cell is not a number.
    Text(Vec<String>),
}

impl Cells {
    fn value(&self, row: usize) -> Value {
        match self {
            Cells::Numbers(v) => number(v[row]),
            Cells::Text(v) => Value::String(v[row].clone()),
        }
    }

    /// A cell as text, empty for NaN.
    pub fn text(&self, row: usize) -> String {
        match self {
            Cells::Numbers(v) if v[row].is_nan() => String::new(),
            Cells::Numbers(v) => v[row].to_string(),
            Cells::Text(v) => v[row].clone(),
        }
    }
}

/// A table in memory.
pub struct Grid {
    /// Columns with their names, in order.
    pub columns: Vec<(String, Cells)>,
    /// Number of rows.
    pub rows: usize,
    /// Line numbers in the file; empty for a dataset's tables.
    lines: Vec<usize>,
}

impl Grid {
    /// Reads a CSV file.
    ///
    /// # Errors
    /// Returns `BadInput` for text that is no table.
    pub fn read(path: &Path) -> Result<Grid> {
        let table = csv::Table::read(path)?;
        let column = |name: &String| {
            let cells = table.text(name)?;
            let numbers: Option<Vec<f64>> = cells
                .iter()
                .map(|c| match c.trim() {
                    "" => Some(f64::NAN),
                    word => word.parse().ok(),
                })
                .collect();
            let text = || Cells::Text(cells.iter().map(|c| c.to_string()).collect());
            Ok((name.clone(), numbers.map_or_else(text, Cells::Numbers)))
        };
        Ok(Grid {
            columns: table.header.iter().map(column).collect::<Result<_>>()?,
            rows: table.len(),
            lines: (0..table.len()).map(|i| table.line(i)).collect(),
        })
    }

    /// Makes a table of the rows of one frame of a dataset.
    pub fn of(table: Table) -> Grid {
        let rows = table.rows();
        let cells = |column| match column {
            Column::F64(v) => Cells::Numbers(v),
            Column::F32(v) => Cells::Numbers(v.into_iter().map(f64::from).collect()),
            Column::U32(v) => Cells::Numbers(v.into_iter().map(f64::from).collect()),
            Column::Bool(v) => Cells::Numbers(v.into_iter().map(|b| f64::from(u8::from(b))).collect()),
            // Seeds have more digits than f64.
            Column::I64(v) => Cells::Text(v.iter().map(i64::to_string).collect()),
            Column::Text(v) => Cells::Text(v),
        };
        let columns = table.columns.into_iter().map(|(name, column)| (name, cells(column)));
        Grid { columns: columns.collect(), rows, lines: Vec::new() }
    }

    /// The column of this name, if there is one.
    pub fn column(&self, name: &str) -> Option<&Cells> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c)
    }

    /// The numbers of the column of this name; None if it is missing or holds text.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        match self.column(name)? {
            Cells::Numbers(v) => Some(v),
            Cells::Text(_) => None,
        }
    }

    /// Position of a row, in words.
    pub fn place(&self, row: usize) -> String {
        match self.lines.get(row) {
            Some(line) => format!("line {line}"),
            None => format!("row {row}"),
        }
    }

    /// Position of a pair of rows, in words; the first's alone where both are the same.
    fn places(&self, row: usize, other: &Grid, other_row: usize) -> String {
        let (a, b) = (self.place(row), other.place(other_row));
        if a == b { a } else { format!("{a}, {b}") }
    }
}

/// Notes columns that only one of the two has.
pub fn headers(file: &str, a: &Grid, b: &Grid, found: &mut DifferenceTally) {
    let name = |n: &str| Value::String(n.into());
    for (column, _) in a.columns.iter().filter(|(n, _)| b.column(n).is_none()) {
        found.note(Difference::unequal(
            file,
            &format!("column {column}"),
            "header",
            name(column),
            Value::Null,
        ));
    }
    for (column, _) in b.columns.iter().filter(|(n, _)| a.column(n).is_none()) {
        found.note(Difference::unequal(
            file,
            &format!("column {column}"),
            "header",
            Value::Null,
            name(column),
        ));
    }
}

/// Compares the columns that both have over pairs of rows.
pub fn pairs(
    file: &str,
    a: &Grid,
    b: &Grid,
    pairs: &[(usize, usize)],
    t: &Tolerances,
    found: &mut DifferenceTally,
) {
    for (name, here) in &a.columns {
        let Some(there) = b.column(name) else { continue };
        found.values += pairs.len() as u64;
        let (Cells::Numbers(x), Cells::Numbers(y)) = (here, there) else {
            for &(i, j) in pairs.iter().filter(|&&(i, j)| here.text(i) != there.text(j)) {
                let place = a.places(i, b, j);
                found.note(Difference::unequal(file, name, place, here.value(i), there.value(j)));
            }
            continue;
        };
        let measure = Measure::of(name, t);
        for &(i, j) in pairs {
            let d = measure.apart(x[i], y[j], 0.0);
            found.measure(name, (d.apart, d.allowed), d.unit, || a.places(i, b, j));
            if d.is_too_far() {
                let place = a.places(i, b, j);
                let of = Difference::unequal(file, name, place, number(x[i]), number(y[j]));
                found.note(of.by(d.apart, d.allowed, d.unit));
            }
        }
    }
}

/// Compares tables row by row.
pub fn rows(file: &str, a: &Grid, b: &Grid, t: &Tolerances, found: &mut DifferenceTally) {
    headers(file, a, b, found);
    if a.rows != b.rows {
        found.note(Difference::unequal(file, "rows", "number of rows", a.rows.into(), b.rows.into()));
        return;
    }
    let all: Vec<(usize, usize)> = (0..a.rows).map(|i| (i, i)).collect();
    pairs(file, a, b, &all, t, found);
}
