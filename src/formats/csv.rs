//! Comma-separated tables (RFC 4180) with one header line and comment lines that start with `#`.

use crate::base::error::{BadInput, Result, nearest};
use std::borrow::Cow;
use std::fmt::Display;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The complaint about a file that holds no line but comments.
pub fn no_header(path: &Path) -> BadInput {
    BadInput::new("no header line")
        .file(path)
        .line(1)
        .remedy("begin the table with the names of its columns, separated by commas")
}

/// A table in memory. Cells stay text until a column is asked for.
#[derive(Debug, Clone)]
pub struct Table {
    path: PathBuf,
    text: String,
    /// Comment lines without their `#`.
    pub comments: Vec<String>,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Row-major, `header.len()` cells a row.
    cells: Vec<Range<usize>>,
    lines: Vec<usize>,
}

impl Table {
    /// Reads a table from a file.
    ///
    /// # Errors
    /// Returns `BadInput` with the line for a row of another length, a missing header, text that is not UTF-8, a name
    /// that occurs twice.
    pub fn read(path: impl AsRef<Path>) -> Result<Table> {
        let path = path.as_ref();
        let bytes = super::input::read(path, "a CSV table", super::input::LARGEST_TEXT)?;
        let text = String::from_utf8(bytes).map_err(|_| BadInput::new("is not UTF-8 text").file(path))?;
        Table::parse(path, text)
    }

    /// Parses a table from a text; `path` is only named in errors.
    ///
    /// # Errors
    /// Returns an error for text that is no table, with its line.
    pub fn parse(path: impl AsRef<Path>, text: String) -> Result<Table> {
        let path = path.as_ref();
        let mut table = Table {
            path: path.to_path_buf(),
            text: String::new(),
            comments: Vec::new(),
            header: Vec::new(),
            cells: Vec::new(),
            lines: Vec::new(),
        };
        let mut at = text.strip_prefix('\u{feff}').map_or(0, |rest| text.len() - rest.len());
        let mut line_number = 0;
        let mut row = Vec::new();
        while at < text.len() {
            line_number += 1;
            let first_line = line_number;
            let end = text[at..].find('\n').map_or(text.len(), |i| at + i);
            let line = text[at..end].trim_end_matches('\r');
            if let Some(comment) = line.strip_prefix('#') {
                table.comments.push(comment.trim().to_string());
                at = end + 1;
                continue;
            }
            if line.trim().is_empty() {
                at = end + 1;
                continue;
            }
            row.clear();
            let (next, breaks) = record(&text, at, &mut row)
                .ok_or_else(|| BadInput::new("a quote that does not end").file(path).line(first_line))?;
            at = next;
            line_number += breaks;
            if table.header.is_empty() {
                table.header = row.iter().map(|r| unquoted(&text[r.clone()]).trim().to_string()).collect();
                if let Some(twice) =
                    table.header.iter().enumerate().find(|(i, n)| table.header[..*i].contains(n))
                {
                    return Err(BadInput::new("the column occurs twice")
                        .file(path)
                        .line(first_line)
                        .key(twice.1.clone())
                        .into());
                }
            } else if row.len() == table.header.len() {
                table.cells.append(&mut row);
                table.lines.push(first_line);
            } else {
                return Err(BadInput::new("the row has a wrong number of values")
                    .file(path)
                    .line(first_line)
                    .value(row.len())
                    .allowed(format!("{}, as in the header", table.header.len()))
                    .into());
            }
        }
        if table.header.is_empty() {
            return Err(no_header(path).into());
        }
        table.text = text;
        Ok(table)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether the table has no row.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Line of the file in which a row starts, from 1.
    pub fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    /// Whether there is a column of that name.
    pub fn has(&self, column: &str) -> bool {
        self.header.iter().any(|h| h == column)
    }

    /// Whether the file's name says that it is a table.
    fn is_csv(&self) -> bool {
        self.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))
    }

    fn index(&self, column: &str) -> Result<usize> {
        self.header.iter().position(|h| h == column).ok_or_else(|| {
            let known = self.header.iter().map(String::as_str);
            let hint = nearest(column, known).map_or(String::new(), |n| format!(" (nearest: {n})"));
            let b = BadInput::new("no such column").file(&self.path).key(column);
            // Another kind of file, given by mistake or by somebody else: its contents are not repeated.
            match self.is_csv() {
                true => BadInput {
                    problem: format!("no such column{hint}; the header has {}", self.header.join(", ")),
                    ..b
                }
                .line(1)
                .remedy("name a column so, and separate columns by commas"),
                false => b,
            }
            .into()
        })
    }

    /// Cells of a column as text, without quotes.
    ///
    /// # Errors
    /// Returns `BadInput` for a missing column or a cell that is not of its kind.
    pub fn text(&self, column: &str) -> Result<Vec<Cow<'_, str>>> {
        let c = self.index(column)?;
        let cells = self.cells.iter().skip(c).step_by(self.header.len());
        Ok(cells.map(|r| unquoted(&self.text[r.clone()])).collect())
    }

    /// Cells of a column as numbers; an empty cell is NaN, and `inf`, `-inf` and `nan` are read.
    ///
    /// # Errors
    /// Returns `BadInput` for a missing column or a cell that is not of its kind.
    pub fn numbers(&self, column: &str) -> Result<Vec<f64>> {
        self.text(column)?
            .iter()
            .zip(&self.lines)
            .map(|(cell, line)| match cell.trim() {
                "" => Ok(f64::NAN),
                word => word.parse().map_err(|_| {
                    let b = BadInput::new("not a number").file(&self.path).line(*line).key(column);
                    match self.is_csv() {
                        true => b.value(word.chars().take(40).collect::<String>()),
                        false => b,
                    }
                    .into()
                }),
            })
            .collect()
    }
}

/// Cuts one record that starts at `at` into cells; returns where the next begins and how many line
/// breaks its quotes hold. None for a quote without end.
fn record(text: &str, mut at: usize, cells: &mut Vec<Range<usize>>) -> Option<(usize, usize)> {
    let bytes = text.as_bytes();
    let mut breaks = 0;
    loop {
        let start = at;
        if bytes.get(at) == Some(&b'"') {
            at += 1;
            loop {
                match bytes.get(at)? {
                    b'"' if bytes.get(at + 1) == Some(&b'"') => at += 2,
                    b'"' => break,
                    b => {
                        breaks += usize::from(*b == b'\n');
                        at += 1;
                    }
                }
            }
        }
        while at < bytes.len() && bytes[at] != b',' && bytes[at] != b'\n' {
            at += 1;
        }
        let mut end = at;
        if end > start && bytes[end - 1] == b'\r' && bytes.get(at) != Some(&b',') {
            end -= 1;
        }
        cells.push(start..end);
        if bytes.get(at) != Some(&b',') {
            return Some((at + 1, breaks));
        }
        at += 1;
    }
}

fn unquoted(cell: &str) -> Cow<'_, str> {
    match cell.strip_prefix('"').and_then(|c| c.strip_suffix('"')) {
        Some(inner) if inner.contains("\"\"") => Cow::Owned(inner.replace("\"\"", "\"")),
        Some(inner) => Cow::Borrowed(inner),
        None => Cow::Borrowed(cell),
    }
}

/// Writes a table of the same kind, row by row.
pub struct Writer<W> {
    out: W,
    columns: usize,
}

impl<W: Write> Writer<W> {
    /// Begins a table: writes the comments, one line each, then the header.
    ///
    /// # Errors
    /// Returns an error if the output cannot be written.
    pub fn new(mut out: W, comments: &[String], header: &[&str]) -> std::io::Result<Self> {
        for c in comments {
            for line in c.lines() {
                writeln!(out, "# {line}")?;
            }
        }
        let mut w = Writer { out, columns: header.len() };
        w.row(header.iter().map(|h| h as &dyn Display))?;
        Ok(w)
    }

    /// Writes a row of as many cells as the header has; text is quoted where it must be.
    ///
    /// # Errors
    /// Returns an error if the output cannot be written.
    pub fn row<'a>(&mut self, cells: impl IntoIterator<Item = &'a dyn Display>) -> std::io::Result<()> {
        let mut n = 0;
        for cell in cells {
            if n > 0 {
                self.out.write_all(b",")?;
            }
            let text = cell.to_string();
            // A first cell that starts with # would be read as a comment.
            if text.contains([',', '"', '\n', '\r']) || (n == 0 && text.starts_with('#')) {
                write!(self.out, "\"{}\"", text.replace('"', "\"\""))?;
            } else {
                self.out.write_all(text.as_bytes())?;
            }
            n += 1;
        }
        if n != self.columns {
            let problem = format!("a row of {n} cells under {} columns", self.columns);
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, problem));
        }
        self.out.write_all(b"\n")
    }

    /// Writes what is still held and gives the output back.
    ///
    /// # Errors
    /// Returns an error if the output cannot be written.
    pub fn finish(mut self) -> std::io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// A table of numbers by columns, whatever its format.
pub trait Columns {
    /// Comment lines without their `#`.
    fn comments(&self) -> &[String];
    /// Whether there is a column of that name.
    fn has(&self, column: &str) -> bool;
    /// Number of rows.
    fn len(&self) -> usize;
    /// Whether there is no row.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Where a row stands in the file, for messages.
    fn line(&self, row: usize) -> usize;
    /// A column of numbers.
    ///
    /// # Errors
    /// Returns `BadInput` for a missing column or a cell that is not a number.
    fn numbers(&self, column: &str) -> Result<Vec<f64>>;
}

impl Columns for Table {
    fn comments(&self) -> &[String] {
        &self.comments
    }
    fn has(&self, column: &str) -> bool {
        Table::has(self, column)
    }
    fn len(&self) -> usize {
        Table::len(self)
    }
    fn line(&self, row: usize) -> usize {
        Table::line(self, row)
    }
    fn numbers(&self, column: &str) -> Result<Vec<f64>> {
        Table::numbers(self, column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn comments_header_and_columns() {
        let t = Table::parse(
            "a.csv",
            "# target: plate\r\nrange_m,class,power_dbm\r\n1.5,car,-80\r\n\r\n2,\"a, \"\"b\"\"\",\r\n".into(),
        )
        .unwrap();
        assert_eq!(t.comments, ["target: plate"]);
        assert_eq!(t.numbers("range_m").unwrap(), [1.5, 2.0]);
        assert_eq!(t.text("class").unwrap(), ["car", "a, \"b\""]);
        let p = t.numbers("power_dbm").unwrap();
        assert!(p[0] == -80.0 && p[1].is_nan());
        let e = t.numbers("range").unwrap_err().to_string();
        assert!(e.contains("nearest: range_m"), "{e}");
        let e = t.numbers("class").unwrap_err().to_string();
        assert_eq!(e, "a.csv:3: class = car: not a number");
    }

    #[test]
    fn a_missing_column_is_told_beside_the_header() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("w.csv");
        std::fs::write(&path, "time_ms;x_m\n1;2\n").unwrap();
        let e = Table::read(&path).unwrap().numbers("time_s").unwrap_err().to_string();
        assert!(e.contains("w.csv:1: time_s: no such column") && e.contains("time_ms;x_m"), "{e}");
        assert!(e.contains("commas") && !e.contains("allowed"), "{e}");
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let message = |text: &str| {
            let e = Table::parse("a.csv", text.into()).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            e.to_string()
        };
        assert!(message("").contains("no header"));
        assert!(message("# only\n").contains("no header"));
        assert!(message("a,b\n1,2\n1,2,3\n").starts_with("a.csv:3:"));
        assert!(message("a,b\n1,\"2\n").contains("quote"));
        assert!(message("a,a\n").contains("twice"));
        // A quoted line break moves the count of the lines after it.
        assert!(message("a,b\n\"x\ny\",2\n1\n").starts_with("a.csv:4:"));
    }

    proptest! {
        #[test]
        fn round_trip(rows in proptest::collection::vec((".*", any::<f64>()), 0..8)) {
            let mut w = Writer::new(Vec::new(), &["made here".into()], &["name", "x"]).unwrap();
            for (name, x) in &rows {
                w.row([name as &dyn Display, x]).unwrap();
            }
            let text = String::from_utf8(w.finish().unwrap()).unwrap();
            let t = Table::parse("p.csv", text).unwrap();
            prop_assert_eq!(t.len(), rows.len());
            for ((name, x), (n, y)) in
                rows.iter().zip(t.text("name").unwrap().iter().zip(t.numbers("x").unwrap()))
            {
                prop_assert_eq!(name, n);
                prop_assert!(*x == y || (x.is_nan() && y.is_nan()));
            }
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[\"#,\\r\\na1 ]{0,40}") {
            let _ = Table::parse("p.csv", text);
        }
    }
}
