//! The RCS table and its CSV (the columns of the file format that users rely on).

use super::polarisation::Derived;
use super::{Aspect, BistaticAspect};
use crate::base::error::{Error, Result};
use crate::base::matrix::Matrix2;
use crate::base::units::dbsm_from_amplitude;
use crate::formats::csv::Writer;
use crate::formats::rcs_csv;
pub use crate::formats::rcs_csv::{COLUMNS, RECEIVE_COLUMNS};
use std::path::Path;

/// One row: a frequency, directions and the scattering matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Where the transmitter stands, and the receiver unless `receive` says otherwise.
    pub aspect: Aspect,
    /// Where the receiver stands, when it stands apart.
    pub receive: Option<Aspect>,
    /// `S[rx][tx]` in m.
    pub s: Matrix2,
}

/// Degrees, rounded to a billionth, so that angles that were given in degrees come back as they were.
fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e9).round() / 1e9
}

impl Row {
    /// Azimuth of the transmitter, degrees.
    pub fn azimuth_deg(&self) -> f64 {
        degrees(self.aspect.azimuth)
    }

    /// Elevation of the transmitter, degrees.
    pub fn elevation_deg(&self) -> f64 {
        degrees(self.aspect.elevation)
    }

    /// Directions of transmitter and receiver.
    pub fn bistatic(&self) -> BistaticAspect {
        BistaticAspect { transmit: self.aspect, receive: self.receive.unwrap_or(self.aspect) }
    }

    /// Cross section 10 lg(4 pi |S|^2 / 1 m^2), dBsm, of one entry; -inf for no echo.
    pub fn dbsm(&self, rx: usize, tx: usize) -> f64 {
        dbsm_from_amplitude(self.s[rx][tx].norm())
    }
}

/// A table of cross sections with what stands above it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RcsTable {
    /// Comment lines above the table: target, convention, bounces, engine, version.
    pub comments: Vec<String>,
    /// Rows in their order.
    pub rows: Vec<Row>,
}

impl RcsTable {
    /// Writes the table. The receiver's columns follow the others when some row has one.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        self.write_with(path, &[])
    }

    /// Writes the table as [`write`](Self::write) does, with the columns of `derived` polarisations after all others.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_with(&self, path: impl AsRef<Path>, derived: &[Derived]) -> Result<()> {
        let path = path.as_ref();
        let io = |e| Error::io(path, e);
        let file = std::io::BufWriter::new(std::fs::File::create(path).map_err(io)?);
        let names = self.names(derived);
        let header: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut csv = Writer::new(file, &self.comments, &header).map_err(io)?;
        for r in &self.rows {
            let cells = self.cells(r, derived);
            csv.row(cells.iter().map(|c| c as &dyn std::fmt::Display)).map_err(io)?;
        }
        csv.finish().map_err(io)?;
        Ok(())
    }

    /// Writes the same columns as Parquet.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    #[cfg(feature = "parquet")]
    pub fn write_parquet(&self, path: impl AsRef<Path>, derived: &[Derived]) -> Result<()> {
        let names = self.names(derived);
        let mut columns: Vec<(&str, Vec<f64>)> = names.iter().map(|n| (n.as_str(), Vec::new())).collect();
        for r in &self.rows {
            columns.iter_mut().zip(self.cells(r, derived)).for_each(|((_, column), x)| column.push(x));
        }
        crate::formats::parquet_table::write(path, &self.comments, &columns)
    }

    fn is_bistatic(&self) -> bool {
        self.rows.iter().any(|r| r.receive.is_some())
    }

    fn names(&self, derived: &[Derived]) -> Vec<String> {
        let receive = if self.is_bistatic() { &RECEIVE_COLUMNS[..] } else { &[] };
        let own = COLUMNS.iter().chain(receive).map(|n| n.to_string());
        own.chain(derived.iter().flat_map(|d| d.names()).map(|n| format!("{n}_dbsm"))).collect()
    }

    fn cells(&self, r: &Row, derived: &[Derived]) -> Vec<f64> {
        let micro = |x: f64| (x * 1e6).round() / 1e6;
        let mut cells = vec![r.frequency_hz, r.azimuth_deg(), r.elevation_deg()];
        let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
        cells.extend(pairs.map(|(rx, tx)| micro(r.dbsm(rx, tx))));
        cells.extend(pairs.iter().flat_map(|&(rx, tx)| [r.s[rx][tx].re, r.s[rx][tx].im]));
        if self.is_bistatic() {
            let to = r.bistatic().receive;
            cells.extend([degrees(to.azimuth), degrees(to.elevation)]);
        }
        for d in derived {
            cells.extend(d.of(&r.s).as_flattened().iter().map(|z| micro(dbsm_from_amplitude(z.norm()))));
        }
        cells
    }

    /// Reads a table.
    ///
    /// # Errors
    /// Returns `BadInput` if a column is missing or a value is not a number.
    pub fn read(path: impl AsRef<Path>) -> Result<RcsTable> {
        let (comments, raw) = rcs_csv::read(path)?;
        let aspect = |azimuth: f64, elevation: f64| Aspect {
            azimuth: azimuth.to_radians(),
            elevation: elevation.to_radians(),
        };
        let rows = raw
            .iter()
            .map(|r| Row {
                frequency_hz: r.frequency_hz,
                aspect: aspect(r.azimuth_deg, r.elevation_deg),
                receive: r.receive_deg.map(|(a, e)| aspect(a, e)),
                s: r.s,
            })
            .collect();
        Ok(RcsTable { comments, rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

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
                receive: None,
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
    #[test]
    fn bistatic_rows_and_derived_columns() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.csv");
        let row = |receive| Row {
            frequency_hz: 77e9,
            aspect: Aspect { azimuth: 0.0, elevation: 0.1f64.to_radians() },
            receive,
            s: [[Complex64::ONE, Complex64::ZERO], [Complex64::ZERO, Complex64::ONE]],
        };
        let to = Aspect { azimuth: 7.5f64.to_radians(), elevation: (-0.25f64).to_radians() };
        let table = RcsTable { comments: vec![], rows: vec![row(None), row(Some(to))] };
        table.write_with(&path, &[Derived::Circular]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        assert!(header.starts_with(&COLUMNS.join(",")), "{header}");
        assert!(
            header.ends_with("rx_azimuth_deg,rx_elevation_deg,rr_dbsm,rl_dbsm,lr_dbsm,ll_dbsm"),
            "{header}"
        );
        assert!(lines.next().unwrap().ends_with(",0,0.1,-inf,10.992099,10.992099,-inf"), "{text}");
        assert!(lines.next().unwrap().contains(",7.5,-0.25,"), "{text}");
        let back = RcsTable::read(&path).unwrap();
        assert_eq!(
            (back.rows[0].bistatic(), back.rows[1].bistatic()),
            (table.rows[0].bistatic(), table.rows[1].bistatic())
        );
        assert_eq!(back.rows[1].s, table.rows[1].s);
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn parquet_holds_the_same_table() {
        let dir = tempfile::tempdir().unwrap();
        let row = |azimuth: f64| Row {
            frequency_hz: 77e9,
            aspect: Aspect { azimuth: azimuth.to_radians(), elevation: 0.1f64.to_radians() },
            receive: None,
            s: [[Complex64::new(azimuth, -0.25), Complex64::ZERO], [Complex64::ZERO, Complex64::ONE]],
        };
        let comments = vec!["target: plate".to_string(), "a second line".into()];
        let table = RcsTable { comments, rows: (0..1000).map(|i| row(0.1 * f64::from(i))).collect() };
        let (a, b) = (dir.path().join("t.csv"), dir.path().join("t.parquet"));
        table.write_with(&a, &[Derived::Circular]).unwrap();
        table.write_parquet(&b, &[Derived::Circular]).unwrap();
        assert_eq!(RcsTable::read(&a).unwrap(), RcsTable::read(&b).unwrap());
        std::fs::write(&b, "PAR1 but no more").unwrap();
        let e = RcsTable::read(&b).unwrap_err().to_string();
        assert!(e.contains("t.parquet") && e.contains("is not a Parquet table"), "{e}");
    }
}
