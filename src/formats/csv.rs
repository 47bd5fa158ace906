//! Comma-separated tables (RFC 4180) with one header line. Outside quotes a `#` at the beginning of a line or after white space begins
//! a comment.
//!
//! A table with a comment and a quoted cell, written and read:
//!
//! ```
//! use catseye::formats::csv::{Table, Writer};
//!
//! let mut writer = Writer::new(Vec::new(), &["measured at 23 °C".into()], &["range_m", "class"])?;
//! writer.row([&30.5 as &dyn std::fmt::Display, &"car, parked"])?;
//! let text = String::from_utf8(writer.finish()?)?;
//! assert_eq!(text, "# measured at 23 °C\nrange_m,class\n30.5,\"car, parked\"\n");
//! let table = Table::parse("points.csv", text)?;
//! assert_eq!((table.numbers("range_m")?, table.text("class")?[0].as_ref()), (vec![30.5], "car, parked"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::text;
use crate::base::error::{BadInput, Result, nearest};
use std::borrow::Cow;
use std::fmt::Display;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The complaint about a file that holds no line but comments.
pub fn no_header(path: &Path) -> BadInput {
    BadInput::new("the table has no header line")
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
    /// Line of the header, from 1.
    header_line: usize,
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
        Table::parse(path, text::read(path, "a CSV table", super::input::LARGEST_TEXT)?)
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
            header_line: 1,
            header: Vec::new(),
            cells: Vec::new(),
            lines: Vec::new(),
        };
        let (mut at, mut line_number) = (0, 0);
        let mut row = Vec::new();
        while at < text.len() {
            line_number += 1;
            let first_line = line_number;
            let end = text[at..].find('\n').map_or(text.len(), |i| at + i);
            let line = text[at..end].trim();
            if let Some(comment) = line.strip_prefix('#') {
                table.comments.push(comment.trim().to_string());
                at = end + 1;
                continue;
            }
            if line.is_empty() {
                at = end + 1;
                continue;
            }
            row.clear();
            let (next, breaks) = record(&text, at, &mut row).ok_or_else(|| {
                BadInput::new("a quoted value has no closing quote").file(path).line(first_line)
            })?;
            at = next;
            line_number += breaks;
            if table.header.is_empty() {
                if let Some(b) = other_separator(&text[row[0].clone()]).filter(|_| row.len() == 1) {
                    return Err(b.file(path).line(first_line).into());
                }
                table.header_line = first_line;
                table.header = row.iter().map(|r| unquoted(&text[r.clone()]).trim().to_string()).collect();
                if let Some(twice) =
                    table.header.iter().enumerate().find(|(i, n)| table.header[..*i].contains(n))
                {
                    return Err(BadInput::new("the header has the column twice")
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
                    .remedy(match row.len() > table.header.len() {
                        true => "write decimals with a point, and put text with commas in quotes, because a comma separates columns",
                        false => "complete the row; an empty value keeps its comma",
                    })
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
            let known = || self.header.iter().map(String::as_str);
            let hint = nearest(column, known()).map_or(String::new(), |n| format!(" (nearest: {n})"));
            let quantity = |name: &str| name.rsplit_once('_').map(|(q, _)| q.to_ascii_lowercase());
            let b = BadInput::new("no such column").file(&self.path).key(column);
            // Another kind of file, given by mistake or by somebody else: its contents are not repeated.
            let b = match self.is_csv() {
                true => BadInput {
                    problem: format!("no such column{hint}; the header has {}", self.header.join(", ")),
                    ..b
                }
                .line(self.header_line),
                false => b,
            };
            let other_unit = known().find(|h| quantity(column).is_some() && quantity(h) == quantity(column));
            match other_unit.filter(|_| self.is_csv()) {
                Some(h) if h.eq_ignore_ascii_case(column) => {
                    b.remedy(format!("name it {column}; upper and lower case differ"))
                }
                Some(h) => b.remedy(format!("convert {h} and name it {column}")),
                None => b.remedy("give a column this name, and separate columns by commas"),
            }
            .into()
        })
    }

    /// Checks that there is no column that nothing reads.
    ///
    /// # Errors
    /// Returns `BadInput` for a column besides `columns`.
    pub fn only(&self, columns: &[&str]) -> Result<()> {
        match self.header.iter().find(|h| !columns.contains(&h.as_str())) {
            None => Ok(()),
            Some(h) => Err(BadInput::new("has a column that is not read")
                .file(&self.path)
                .line(self.header_line)
                .key(if self.is_csv() { h } else { "header" })
                .allowed(columns.join(","))
                .remedy("use these column names, and remove the other columns")
                .into()),
        }
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
                    let b = match self.is_csv() {
                        true => b.value(word.chars().take(40).collect::<String>()),
                        false => b,
                    };
                    match text::number_hint(word) {
                        Some(hint) => b.remedy(hint),
                        None => b,
                    }
                    .into()
                }),
            })
            .collect()
    }
}

/// The error about a header of one cell that another mark than a comma divides.
fn other_separator(cell: &str) -> Option<BadInput> {
    let (_, name) =
        [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(mark, _)| cell.contains(*mark))?;
    Some(
        BadInput::new(format!("the columns are separated by {name}"))
            .allowed("commas")
            .remedy("export it with commas between the columns and points in the numbers"),
    )
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
        let comment = |i: usize| bytes[i] == b'#' && i > start && matches!(bytes[i - 1], b' ' | b'\t');
        while at < bytes.len() && bytes[at] != b',' && bytes[at] != b'\n' && !comment(at) {
            at += 1;
        }
        let mut end = at;
        if bytes.get(at) == Some(&b'#') {
            end = start + text[start..at].trim_end().len();
            at = text[at..].find('\n').map_or(text.len(), |i| at + i);
        }
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
            // A # would begin a comment.
            if text.contains([',', '"', '\n', '\r', '#']) {
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
        std::fs::write(&path, "# drive\ntime_ms,x_m\n1,2\n").unwrap();
        let e = Table::read(&path).unwrap().numbers("time_s").unwrap_err().to_string();
        assert!(e.contains("w.csv:2: time_s: no such column (nearest: time_ms)"), "{e}");
        assert!(e.ends_with("the header has time_ms, x_m; convert time_ms and name it time_s"), "{e}");
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

    /// One change of a table, and what it makes of the column x_m, or of the error.
    #[test]
    fn each_change_changes_the_result_or_is_reported() {
        let plain = "time_s,x_m,name\n0,1.5,car\n1,2,bus\n";
        let x = [1.5, 2.0];
        type Case<'a> = (&'a str, &'a str, &'a str, Result<&'a [f64], &'a str>);
        let cases: [Case<'_>; 22] = [
            ("a value", "1.5", "15", Ok(&[15.0, 2.0])),
            ("columns in another order", plain, "x_m,name,time_s\n1.5,car,0\n2,bus,1\n", Ok(&x)),
            ("values in another order", "0,1.5,", "1.5,0,", Ok(&[0.0, 2.0])),
            ("CRLF", "\n", "\r\n", Ok(&x)),
            ("no last line end", "bus\n", "bus", Ok(&x)),
            ("a comment line", "\n1", "\n# x\n \t# y\n1", Ok(&x)),
            ("a comment in the header", "name", "name # class, free", Ok(&x)),
            ("a comment behind text", "car", "car # c, d", Ok(&x)),
            ("a comment behind quotes", "car", "\"car\"\t# c", Ok(&x)),
            ("a # in a word", "car", "car#2", Ok(&x)),
            ("a # in quotes", "car", "\"car #2, red\"", Ok(&x)),
            ("spaces", "1.5", " 1.5 ", Ok(&x)),
            ("an empty value", "1.5", "", Ok(&[f64::NAN, 2.0])),
            (
                "another unit",
                "x_m",
                "x_mm",
                Err("(nearest: x_mm); the header has time_s, x_mm, name; convert x_mm and"),
            ),
            (
                "another case",
                "x_m",
                "X_M",
                Err(
                    "1: x_m: no such column (nearest: X_M); the header has time_s, X_M, name; name it x_m; upper and lower case differ",
                ),
            ),
            (
                "a decimal comma",
                "1.5",
                "1,5",
                Err(
                    "2: 4: the row has a wrong number of values; allowed: 3, as in the header; write decimals with a point",
                ),
            ),
            (
                "a quoted decimal comma",
                "1.5",
                "\"1,5\"",
                Err("2: x_m = 1,5: not a number; write the decimal mark as a point"),
            ),
            ("a unit", "1.5", "1.5 m", Err("2: x_m = 1.5 m: not a number; leave out the unit")),
            ("semicolons", ",", ";", Err("1: the columns are separated by semicolons; allowed: commas")),
            ("tabs", ",", "\t", Err("1: the columns are separated by tabs")),
            (
                "a short row",
                ",bus",
                "",
                Err("3: 2: the row has a wrong number of values; allowed: 3, as in the header; complete"),
            ),
            ("a name twice", "name", "x_m", Err("1: x_m: the header has the column twice")),
        ];
        for (name, from, to, want) in cases {
            let got = Table::parse("a.csv", plain.replace(from, to)).and_then(|t| t.numbers("x_m"));
            match (got, want) {
                (Ok(got), Ok(want)) => assert_eq!(format!("{got:?}"), format!("{want:?}"), "{name}"),
                (Err(e), Err(part)) => {
                    let e = e.to_string();
                    assert!(e.contains(&format!("a.csv:{part}")) || e.contains(part), "{name}: {e}");
                }
                (got, want) => panic!("{name}: {got:?}, not {want:?}"),
            }
        }
        let names = Table::parse("a.csv", plain.replace("car", "car # red")).unwrap();
        assert_eq!(names.text("name").unwrap(), ["car", "bus"]);
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
