//! The RCS table and its CSV (the columns of the file format that users rely on).

use super::Aspect;
use crate::error::{BadInput, Error, Result};
use crate::formats::csv::{Table, Writer};
use crate::units::dbsm_from_amplitude;
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

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    pub frequency_hz: f64,
    pub aspect: Aspect,
    /// S[rx][tx] in m.
    pub s: [[Complex64; 2]; 2],
}

impl Row {
    /// To a billionth of a degree: angles that were given in degrees come back as they were.
    pub fn azimuth_deg(&self) -> f64 {
        (self.aspect.azimuth.to_degrees() * 1e9).round() / 1e9
    }

    pub fn elevation_deg(&self) -> f64 {
        (self.aspect.elevation.to_degrees() * 1e9).round() / 1e9
    }

    /// 10 lg(4 pi |S|^2 / 1 m^2); -inf for no echo.
    pub fn dbsm(&self, rx: usize, tx: usize) -> f64 {
        dbsm_from_amplitude(self.s[rx][tx].norm())
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct RcsTable {
    /// Target, convention, bounces, engine, version: the comment lines.
    pub comments: Vec<String>,
    pub rows: Vec<Row>,
}

impl RcsTable {
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let io = |e| Error::io(path, e);
        let file = std::io::BufWriter::new(std::fs::File::create(path).map_err(io)?);
        let mut csv = Writer::new(file, &self.comments, &COLUMNS).map_err(io)?;
        for r in &self.rows {
            let mut cells = vec![r.frequency_hz, r.azimuth_deg(), r.elevation_deg()];
            let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
            cells.extend(pairs.map(|(rx, tx)| (r.dbsm(rx, tx) * 1e6).round() / 1e6));
            cells.extend(pairs.iter().flat_map(|&(rx, tx)| [r.s[rx][tx].re, r.s[rx][tx].im]));
            csv.row(cells.iter().map(|c| c as &dyn std::fmt::Display)).map_err(io)?;
        }
        csv.finish().map_err(io)?;
        Ok(())
    }

    /// Errors: `BadInput` for a missing column or a value that is not a number.
    pub fn read(path: impl AsRef<Path>) -> Result<RcsTable> {
        let table = Table::read(&path)?;
        let columns = COLUMNS.iter().map(|c| table.numbers(c)).collect::<Result<Vec<_>>>()?;
        if table.is_empty() {
            return Err(BadInput::new("the table has no rows").file(&path).into());
        }
        let rows = (0..table.len())
            .map(|i| {
                let z = |c: usize| Complex64::new(columns[c][i], columns[c + 1][i]);
                Row {
                    frequency_hz: columns[0][i],
                    aspect: Aspect {
                        azimuth: columns[1][i].to_radians(),
                        elevation: columns[2][i].to_radians(),
                    },
                    s: [[z(7), z(9)], [z(11), z(13)]],
                }
            })
            .collect();
        Ok(RcsTable { comments: table.comments.clone(), rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_what_it_wrote() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.csv");
        let z = |re: f64, im: f64| Complex64::new(re, im);
        let table = RcsTable {
            comments: vec!["target: plate".into()],
            rows: vec![Row {
                frequency_hz: 77e9,
                aspect: Aspect { azimuth: (-12.3f64).to_radians(), elevation: 0.0 },
                s: [[z(0.1, -0.2), z(0.0, 0.0)], [z(1e-9, 3.0), z(-4.0, 0.25)]],
            }],
        };
        table.write(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("77000000000,-12.3,0,-2.0182"), "{text}");
        let back = RcsTable::read(&path).unwrap();
        assert_eq!(back.comments, table.comments);
        assert_eq!(back.rows[0].s, table.rows[0].s);
    }
}
