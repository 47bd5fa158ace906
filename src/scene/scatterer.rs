//! Scattering tables: S(azimuth, elevation, frequency) of an object, computed elsewhere or measured, in the
//! format that `catseye rcs` writes (`formats::rcs_csv`).
//!
//! The rows must fill a grid: every azimuth with every elevation at every frequency, in any order. Steps
//! need not be equal. Between the grid's lines S is interpolated in its real and imaginary parts by Lagrange
//! polynomials through four lines of each axis (fewer on a shorter axis), which errs by about 0.024 Δ⁴ of the amplitude
//! where the phase turns by Δ radians from line to line. The phase is referred to the object's origin, so scatterers
//! that stand x from it across the line of sight turn it by 2kx a radian: steps of λ/(12 x) keep Δ at π/3. A table with
//! larger turns among its strong echoes gets a note with the error found by leaving lines out.
//!
//! * An axis with one value is a cut: S is taken as the same for all its angles, which is noted. A
//!   single frequency holds for that frequency alone.
//! * Azimuths that close a circle are interpolated across the seam.
//! * Outside the table's angles the object has no echo, which is noted. Outside its frequencies: error.
//! * At elevation ±90° rows have V and H of azimuth zero, whatever their azimuth (CONVENTIONS eq. 2).

use crate::base::error::{BadInput, Result};
use crate::base::matrix::Matrix2;
use crate::base::units::dbsm_from_amplitude;
use crate::formats::rcs_csv::{self, RawRow};
use crate::formats::stage::sha256_of_bytes;
use num_complex::Complex64;
use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};

/// Values of one axis that differ by less are one: 1e-6 degrees, or one part in 1e9 of a frequency.
const SAME_DEG: f64 = 1e-6;
const SAME_HZ: f64 = 1e-9;
/// A dBsm cell may differ from its amplitude by its own rounding and that of re and im.
const DBSM_TOLERANCE: f64 = 0.1;
/// Levels that matter: within 20 dB of the table's largest.
const STRONG: f64 = 0.1;

/// A scattering matrix over direction and frequency, referred to its object's origin.
#[derive(Clone, PartialEq)]
pub struct ScatteringTable {
    source: PathBuf,
    sha256: String,
    frequencies_hz: Vec<f64>,
    elevations_deg: Vec<f64>,
    azimuths_deg: Vec<f64>,
    /// The azimuths go round: after the last comes the first.
    closed: bool,
    /// `[frequency, elevation, azimuth]`; at the poles in the V and H of the row's own azimuth.
    values: Vec<Matrix2>,
    notes: Vec<String>,
}

impl fmt::Debug for ScatteringTable {
    /// Says what identifies the table, not its values.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ScatteringTable({}, sha256 {})", self.source.display(), self.sha256)
    }
}

/// Up to four positions on an axis and their weights, for interpolation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    index: [usize; 4],
    weight: [f64; 4],
    count: usize,
}

impl Stencil {
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..self.count).map(|i| (self.index[i], self.weight[i]))
    }

    /// The polynomial through the lines nearest to `x`, which lies between the first and the last.
    fn open(nodes: &[f64], x: f64) -> Stencil {
        let count = nodes.len().min(4);
        let cell = nodes.partition_point(|n| *n <= x).clamp(1, nodes.len().max(2) - 1) - 1;
        let first = cell.saturating_sub(1).min(nodes.len() - count);
        Self::lagrange(count, |i| (first + i, nodes[first + i]), x)
    }

    /// The same on a circle of 360 degrees; `x` lies in [first, first + 360).
    fn closed(nodes: &[f64], x: f64) -> Stencil {
        let (n, count) = (nodes.len(), nodes.len().min(4));
        let cell = nodes.partition_point(|v| *v <= x).max(1) - 1;
        let first = (cell + n - (count - 1) / 2) as i64 - n as i64;
        let at = |i: usize| {
            let k = first + i as i64;
            let index = k.rem_euclid(n as i64) as usize;
            (index, nodes[index] + 360.0 * k.div_euclid(n as i64) as f64)
        };
        Self::lagrange(count, at, x)
    }

    fn lagrange(count: usize, at: impl Fn(usize) -> (usize, f64), x: f64) -> Stencil {
        let mut s = Stencil { index: [0; 4], weight: [0.0; 4], count };
        for i in 0..count {
            let (index, xi) = at(i);
            s.index[i] = index;
            s.weight[i] = (0..count).filter(|j| *j != i).map(|j| (x - at(j).1) / (xi - at(j).1)).product();
        }
        s
    }
}

fn strength(m: &Matrix2) -> f64 {
    m.as_flattened().iter().map(|z| z.norm_sqr()).fold(0.0, f64::max).sqrt()
}

impl ScatteringTable {
    /// Reads a table.
    ///
    /// # Errors
    /// Returns `BadInput` with file and line for rows that do not fill a grid (it names the first that is missing),
    /// rows given twice, values that are not finite, dBsm that contradict re and im, and receivers apart from the
    /// transmitter.
    pub fn read(path: impl AsRef<Path>) -> Result<ScatteringTable> {
        let path = path.as_ref();
        let (_, rows) = rcs_csv::read(path)?;
        Self::from_rows(path, &rows)
    }

    /// Parses a text as [`read`](Self::read) does a file; `path` is only named.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read), except those of opening the file.
    pub fn parse(path: impl AsRef<Path>, text: String) -> Result<ScatteringTable> {
        let (_, rows) = rcs_csv::parse(&path, text)?;
        Self::from_rows(path.as_ref(), &rows)
    }

    fn from_rows(path: &Path, rows: &[RawRow]) -> Result<ScatteringTable> {
        let largest = rows.iter().map(|r| strength(&r.s)).fold(0.0, f64::max);
        for r in rows {
            check_row(path, r, largest)?;
        }
        let frequencies_hz = lines(rows.iter().map(|r| r.frequency_hz), |a| SAME_HZ * a);
        let elevations_deg = lines(rows.iter().map(|r| r.elevation_deg), |_| SAME_DEG);
        let azimuths_deg = lines(rows.iter().map(|r| r.azimuth_deg), |_| SAME_DEG);
        let (nf, ne, na) = (frequencies_hz.len(), elevations_deg.len(), azimuths_deg.len());
        let span = azimuths_deg[na - 1] - azimuths_deg[0];
        if span > 360.0 + SAME_DEG {
            return Err(BadInput::new("the azimuths cover more than a full turn")
                .file(path)
                .key("azimuth_deg")
                .value(format!("{} to {}", azimuths_deg[0], azimuths_deg[na - 1]))
                .allowed("at most 360 degrees from first to last")
                .into());
        }
        let mut present = HashSet::with_capacity(rows.len());
        let mut cells = Vec::with_capacity(rows.len());
        for r in rows {
            let cell = (
                nearest(&frequencies_hz, r.frequency_hz),
                nearest(&elevations_deg, r.elevation_deg),
                nearest(&azimuths_deg, r.azimuth_deg),
            );
            if !present.insert(cell) {
                return Err(BadInput::new("the direction occurs twice")
                    .file(path)
                    .line(r.line)
                    .value(place(r.frequency_hz, r.azimuth_deg, r.elevation_deg))
                    .remedy("keep one row for each frequency and direction")
                    .into());
            }
            cells.push(cell);
        }
        // At most one step more than there are rows.
        let missing = (0..nf)
            .flat_map(|f| (0..ne).flat_map(move |e| (0..na).map(move |a| (f, e, a))))
            .find(|cell| !present.contains(cell));
        if let Some((f, e, a)) = missing {
            return Err(BadInput::new(format!(
                "the rows do not fill a grid of {na} azimuths x {ne} elevations x {nf} frequencies: the one at {} is missing",
                place(frequencies_hz[f], azimuths_deg[a], elevations_deg[e])
            ))
            .file(path)
            .value(format!("{} rows", rows.len()))
            .allowed("every azimuth with every elevation at every frequency")
            .remedy("add the missing rows, or split the table")
            .into());
        }
        let mut values = vec![Matrix2::default(); rows.len()];
        for (r, (f, e, a)) in rows.iter().zip(&cells) {
            let at_pole = (r.elevation_deg.abs() - 90.0).abs() < SAME_DEG;
            let s = if at_pole { at_azimuth(r.s, r.azimuth_deg, r.elevation_deg) } else { r.s };
            values[(f * ne + e) * na + a] = s;
        }
        let mut table = ScatteringTable {
            source: path.to_path_buf(),
            sha256: String::new(),
            frequencies_hz,
            elevations_deg,
            azimuths_deg,
            closed: false,
            values,
            notes: Vec::new(),
        };
        table.close();
        table.sha256 = table.digest();
        table.notes = table.describe();
        Ok(table)
    }

    /// Finds out whether the azimuths go all round, and takes a last one out that repeats the first.
    fn close(&mut self) {
        let na = self.azimuths_deg.len();
        let span = self.azimuths_deg[na - 1] - self.azimuths_deg[0];
        if span > 360.0 - SAME_DEG && na > 1 {
            let values = std::mem::take(&mut self.values);
            self.values = values.chunks(na).flat_map(|row| row[..na - 1].iter().copied()).collect();
            self.azimuths_deg.pop();
            self.closed = true;
        } else if na > 2 {
            let widest = self.azimuths_deg.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
            self.closed = 360.0 - span < 1.01 * widest;
        }
    }

    fn digest(&self) -> String {
        let numbers =
            [&self.frequencies_hz, &self.elevations_deg, &self.azimuths_deg].into_iter().flatten().copied();
        let amplitudes = self.values.iter().flat_map(|m| m.as_flattened()).flat_map(|z| [z.re, z.im]);
        let bytes: Vec<u8> = numbers.chain(amplitudes).flat_map(f64::to_le_bytes).collect();
        sha256_of_bytes(&bytes)
    }

    /// The file from which the table was read.
    pub fn source(&self) -> &Path {
        &self.source
    }

    /// Checksum of the axes and values.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// What the reader should tell the user: cuts, angles that are not covered, steps that are too wide.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Lowest and highest frequency, Hz.
    pub fn frequency_range_hz(&self) -> (f64, f64) {
        (self.frequencies_hz[0], self.frequencies_hz[self.frequencies_hz.len() - 1])
    }

    /// Finds where `freq_hz` lies among the table's frequencies.
    ///
    /// # Errors
    /// Returns an error if the frequency lies outside those of the table.
    pub fn band(&self, freq_hz: f64) -> Result<Stencil> {
        let (lo, hi) = self.frequency_range_hz();
        let slack = SAME_HZ * hi;
        if !(lo - slack..=hi + slack).contains(&freq_hz) {
            let allowed = if lo == hi { format!("{lo}") } else { format!("{lo}..{hi}") };
            return Err(BadInput::new("the scattering table has no value at this frequency")
                .file(&self.source)
                .key("frequency_hz")
                .value(freq_hz)
                .allowed(allowed)
                .remedy("give a table that holds the radar's carrier, or frequencies on both sides of it")
                .into());
        }
        Ok(Stencil::open(&self.frequencies_hz, freq_hz.clamp(lo, hi)))
    }

    /// Scattering matrix S towards (azimuth, elevation) in radians, m, with the V and H of that direction; zero outside
    /// the table's angles.
    pub fn scattering(&self, band: &Stencil, azimuth: f64, elevation: f64) -> Matrix2 {
        let (Some(az), Some(el)) =
            (self.azimuth(azimuth.to_degrees()), self.elevation(elevation.to_degrees()))
        else {
            return Matrix2::default();
        };
        let (ne, na) = (self.elevations_deg.len(), self.azimuths_deg.len());
        let mut sum = Matrix2::default();
        for (f, wf) in band.iter() {
            for (e, we) in el.iter() {
                for (a, wa) in az.iter() {
                    let w = wf * we * wa;
                    let m = &self.values[(f * ne + e) * na + a];
                    for (z, x) in sum.as_flattened_mut().iter_mut().zip(m.as_flattened()) {
                        *z += x * w;
                    }
                }
            }
        }
        sum
    }

    fn elevation(&self, degrees: f64) -> Option<Stencil> {
        let n = &self.elevations_deg;
        let (lo, hi) = (n[0], n[n.len() - 1]);
        let inside = n.len() == 1 || (lo - SAME_DEG..=hi + SAME_DEG).contains(&degrees);
        inside.then(|| Stencil::open(n, degrees.clamp(lo, hi)))
    }

    fn azimuth(&self, degrees: f64) -> Option<Stencil> {
        let n = &self.azimuths_deg;
        let (lo, hi) = (n[0], n[n.len() - 1]);
        if n.len() == 1 {
            return Some(Stencil::open(n, lo));
        }
        // The turn that lies in the table, if there is one: its azimuths may run from 0 to 360 or about 180.
        let x = lo + (degrees - lo + SAME_DEG).rem_euclid(360.0) - SAME_DEG;
        if self.closed {
            return Some(Stencil::closed(n, x.max(lo)));
        }
        (x <= hi + SAME_DEG).then(|| Stencil::open(n, x.clamp(lo, hi)))
    }

    fn describe(&self) -> Vec<String> {
        let name = self.source.display();
        let mut notes = Vec::new();
        let (az, el) = (&self.azimuths_deg, &self.elevations_deg);
        for (axis, n) in [("azimuth", az), ("elevation", el)] {
            if n.len() == 1 {
                notes.push(format!(
                    "{name}: has one {axis}, {} deg; its values are used for every {axis}",
                    n[0]
                ));
            }
        }
        if az.len() > 1 && !self.closed {
            let (a, b) = (az[0], az[az.len() - 1]);
            notes.push(format!("{name}: outside azimuths {a} to {b} deg the object has no echo"));
        }
        if el.len() > 1 && (el[0] > -90.0 + SAME_DEG || el[el.len() - 1] < 90.0 - SAME_DEG) {
            let (a, b) = (el[0], el[el.len() - 1]);
            notes.push(format!("{name}: outside elevations {a} to {b} deg the object has no echo"));
        }
        for axis in 0..3 {
            notes.extend(self.coarse(axis));
        }
        notes
    }

    /// A note when strong neighbours along an axis (0 azimuth, 1 elevation, 2 frequency) turn by more than π/3.
    fn coarse(&self, axis: usize) -> Option<String> {
        let dims = [self.azimuths_deg.len(), self.elevations_deg.len(), self.frequencies_hz.len()];
        let strides = [1, dims[0], dims[0] * dims[1]];
        let (n, stride) = (dims[axis], strides[axis]);
        let nodes = [&self.azimuths_deg, &self.elevations_deg, &self.frequencies_hz][axis];
        let floor = STRONG * self.values.iter().map(strength).fold(0.0, f64::max);
        let mut worst = (0.0, 0);
        let mut error: f64 = 0.0;
        for (i, m) in self.values.iter().enumerate() {
            let at = i / stride % n;
            for k in 0..4 {
                let here = m.as_flattened()[k];
                if here.norm() <= floor {
                    continue;
                }
                let value = |j: usize| self.values[i + j * stride - at * stride].as_flattened()[k];
                if at + 1 < n && value(at + 1).norm() > floor {
                    let turn = (value(at + 1) * here.conj()).arg().abs();
                    if turn > worst.0 {
                        worst = (turn, i);
                    }
                }
                // The value from every second line: cubic has 16 times the error of the whole table, linear four.
                if at >= 1 && at + 1 < n {
                    let cubic = at >= 3 && at + 3 < n;
                    let (first, count, gain) = if cubic { (at - 3, 4, 16.0) } else { (at - 1, 2, 4.0) };
                    let pick = |p: usize| (first + 2 * p, nodes[first + 2 * p]);
                    let s = Stencil::lagrange(count, pick, nodes[at]);
                    let guess: Complex64 = s.iter().map(|(j, w)| value(j) * w).sum();
                    error = error.max((guess - here).norm() / here.norm() / gain);
                }
            }
        }
        if worst.0 <= std::f64::consts::FRAC_PI_3 {
            return None;
        }
        let i = worst.1;
        let (a, e, f) = (i % dims[0], i / strides[1] % dims[1], i / strides[2]);
        let step = nodes[i / stride % n + 1] - nodes[i / stride % n];
        let step = step * std::f64::consts::FRAC_PI_3 / worst.0;
        Some(format!(
            "{}: the phase turns by {:.0} deg from one {} to the next at {}; values between are wrong by \
             about {:.2} dB; use steps of {:.3} {} or less, or move the origin nearer to the scatterers",
            self.source.display(),
            worst.0.to_degrees(),
            ["azimuth", "elevation", "frequency"][axis],
            place(self.frequencies_hz[f], self.azimuths_deg[a], self.elevations_deg[e]),
            20.0 * (1.0 + error).log10(),
            if axis == 2 { step / 1e6 } else { step },
            if axis == 2 { "MHz" } else { "deg" },
        ))
    }
}

fn place(frequency_hz: f64, azimuth_deg: f64, elevation_deg: f64) -> String {
    format!("azimuth {azimuth_deg} deg, elevation {elevation_deg} deg, {frequency_hz} Hz")
}

fn check_row(path: &Path, r: &RawRow, largest: f64) -> Result<()> {
    let bad = |key: &str, value: f64, problem: &str| {
        BadInput::new(problem).file(path).line(r.line).key(key).value(value)
    };
    for (key, value, range) in [
        ("frequency_hz", r.frequency_hz, 1e6..=1e13),
        ("azimuth_deg", r.azimuth_deg, -360.0..=360.0),
        ("elevation_deg", r.elevation_deg, -90.0..=90.0),
    ] {
        if !range.contains(&value) {
            return Err(bad(key, value, "out of range")
                .allowed(format!("{}..{}", range.start(), range.end()))
                .into());
        }
    }
    if let Some((a, e)) = r.receive_deg
        && !((a - r.azimuth_deg).abs() < SAME_DEG && (e - r.elevation_deg).abs() < SAME_DEG)
    {
        return Err(bad("rx_azimuth_deg", a, "the receiver is not in the direction of the transmitter")
            .remedy("leave out the rx_ columns, since an object needs a monostatic table")
            .into());
    }
    for (k, (z, dbsm)) in r.s.as_flattened().iter().zip(r.dbsm).enumerate() {
        let name = ["vv", "vh", "hv", "hh"][k];
        for (part, x) in [("re", z.re), ("im", z.im)] {
            if !(x.is_finite() && x.abs() < 1e9) {
                return Err(bad(&format!("{name}_{part}_m"), x, "is not an amplitude in metres")
                    .remedy("give all amplitudes in every row; 0 means no echo")
                    .into());
            }
        }
        // Far below the largest, re and im may be rounded away; an empty cell says nothing.
        let here = dbsm_from_amplitude(z.norm());
        let matters = here.max(dbsm) > dbsm_from_amplitude(largest) - 80.0;
        if !dbsm.is_nan() && matters && (here - dbsm).abs() > DBSM_TOLERANCE {
            return Err(bad(&format!("{name}_dbsm"), dbsm, "contradicts the amplitude in re and im")
                .allowed(format!("{here:.3}, which is 10 lg(4 pi |S|^2)"))
                .remedy("amplitudes are in metres with sigma = 4 pi |S|^2")
                .into());
        }
    }
    Ok(())
}

/// The distinct values, rising. Values that differ by rounding are one.
fn lines(values: impl Iterator<Item = f64>, same: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|b, a| *b - *a < same(*a));
    all
}

fn nearest(nodes: &[f64], x: f64) -> usize {
    let i = nodes.partition_point(|n| *n < x).min(nodes.len() - 1);
    if i > 0 && x - nodes[i - 1] < nodes[i] - x { i - 1 } else { i }
}

/// S of a pole, given with V and H of azimuth zero, in those of `azimuth_deg`.
fn at_azimuth(s: Matrix2, azimuth_deg: f64, elevation_deg: f64) -> Matrix2 {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let up = elevation_deg.signum();
    // V = (-up cos a, -up sin a), H = (-sin a, cos a); rows: the new vectors in the old ones.
    turned(&s, [[cos, -up * sin], [up * sin, cos]])
}

/// Turns S to another basis, R S R^T: the basis vectors have the components `r[new][old]`.
pub fn turned(s: &Matrix2, r: [[f64; 2]; 2]) -> Matrix2 {
    let mut out = Matrix2::default();
    for (i, row) in out.iter_mut().enumerate() {
        for (j, z) in row.iter_mut().enumerate() {
            *z = s[0][0] * (r[i][0] * r[j][0])
                + s[0][1] * (r[i][0] * r[j][1])
                + s[1][0] * (r[i][1] * r[j][0])
                + s[1][1] * (r[i][1] * r[j][1]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::{direction_from_angles, polarisation_basis};
    use crate::base::units::wavenumber;
    use glam::DVec3;
    use proptest::prelude::*;

    const HEAD: &str = "frequency_hz,azimuth_deg,elevation_deg,vv_dbsm,vh_dbsm,hv_dbsm,hh_dbsm,\
                        vv_re_m,vv_im_m,vh_re_m,vh_im_m,hv_re_m,hv_im_m,hh_re_m,hh_im_m\n";

    /// CSV over a grid; the dBsm cells stay empty.
    fn csv(f: &[f64], az: &[f64], el: &[f64], s: impl Fn(f64, f64, f64) -> Matrix2) -> String {
        let mut text = HEAD.to_string();
        for &f in f {
            for &e in el {
                for &a in az {
                    let z: Vec<String> =
                        s(f, a, e).as_flattened().iter().map(|z| format!("{},{}", z.re, z.im)).collect();
                    text += &format!("{f},{a},{e},,,,,{}\n", z.join(","));
                }
            }
        }
        text
    }

    fn table(text: String) -> ScatteringTable {
        ScatteringTable::parse("t.csv", text).unwrap()
    }

    fn steps(from: f64, to: f64, n: usize) -> Vec<f64> {
        (0..n).map(|i| from + (to - from) * i as f64 / (n - 1) as f64).collect()
    }

    /// A small dipole at `place` that keeps only the field along `axis`: smooth over the whole sphere, but not in V and H.
    fn dipole(axis: DVec3, place: DVec3) -> impl Fn(f64, f64, f64) -> Matrix2 {
        move |f, a, e| {
            let u = direction_from_angles(a.to_radians(), e.to_radians());
            let (v, h) = polarisation_basis(u);
            let c = [v.dot(axis), h.dot(axis)];
            let phase = Complex64::cis(2.0 * wavenumber(f) * u.dot(place));
            [0, 1].map(|i| [0, 1].map(|j| phase * (c[i] * c[j])))
        }
    }

    fn distance(a: &Matrix2, b: &Matrix2) -> f64 {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn lines_of_the_grid_come_back_and_the_error_between_falls_with_the_fourth_power() {
        let truth = dipole(DVec3::new(0.3, 0.8, 0.5), DVec3::new(0.002, 0.006, -0.005));
        let errors: Vec<f64> = [1, 2]
            .map(|fine| {
                let n = 20 * fine + 1;
                let (az, el) = (steps(-30.0, 30.0, n), steps(-20.0, 40.0, n));
                let t = table(csv(&[76e9, 77e9, 78e9], &az, &el, &truth));
                let at = |f: f64, a: f64, e: f64| {
                    let s = t.scattering(&t.band(f).unwrap(), a.to_radians(), e.to_radians());
                    distance(&s, &truth(f, a, e))
                };
                assert!(at(77e9, az[3], el[17]) < 1e-12 && at(78e9, az[n - 1], el[0]) < 1e-12);
                let grid = 60.0 / (n - 1) as f64;
                (2..18).map(|i| at(77e9, az[i] + 0.5 * grid, el[i + 1] + 0.5 * grid)).fold(0.0, f64::max)
            })
            .into();
        // Turns of 1 rad a line on the coarse grid: the bound of the module's text in two axes.
        assert!(errors[0] < 2.0 * 0.024 && errors[0] > 1e-3, "{errors:?}");
        assert!((10.0..22.0).contains(&(errors[0] / errors[1])), "{errors:?}");
        // Between frequencies, with three lines: quadratic, over a small turn.
        let t = table(csv(&[76e9, 77e9, 78e9], &steps(-4.0, 4.0, 9), &steps(-4.0, 4.0, 9), &truth));
        let s = t.scattering(&t.band(76.5e9).unwrap(), 0.0, 0.0);
        assert!(distance(&s, &truth(76.5e9, 0.0, 0.0)) < 1e-3);
    }

    #[test]
    fn seam_and_poles() {
        let truth = dipole(DVec3::new(0.6, -0.3, 0.74), DVec3::new(1e-3, 2e-3, 1e-3));
        for az in [steps(-180.0, 180.0, 73), steps(-180.0, 175.0, 72), steps(0.0, 360.0, 73)] {
            let t = table(csv(&[77e9], &az, &steps(-90.0, 90.0, 37), &truth));
            assert!(t.notes().is_empty(), "{:?}", t.notes());
            let band = t.band(77e9).unwrap();
            for a in [-179.0f64, 177.6, 359.0, -2.4, 3.0, 181.0] {
                for e in [-90.0f64, -87.7, -40.0, 2.4, 86.3, 88.8, 90.0] {
                    let (ar, er) = (a.to_radians(), e.to_radians());
                    // At the pole itself the caller's azimuth is zero.
                    let ar = if e.abs() == 90.0 { 0.0 } else { ar };
                    let d = distance(&t.scattering(&band, ar, er), &truth(77e9, ar.to_degrees(), e));
                    assert!(d < 2e-3, "{a} {e}: {d}");
                }
            }
        }
    }

    #[test]
    fn cuts_limits_and_frequencies() {
        let one =
            |_: f64, _: f64, _: f64| [[Complex64::ONE, Complex64::ZERO], [Complex64::ZERO, Complex64::I]];
        let t = table(csv(&[77e9], &steps(-45.0, 45.0, 91), &[5.0], one));
        assert_eq!(t.notes().len(), 2, "{:?}", t.notes());
        assert!(t.notes()[0].contains("has one elevation, 5 deg") && t.notes()[1].contains("-45 to 45"));
        let band = t.band(77e9).unwrap();
        assert!(distance(&t.scattering(&band, 0.7, -1.2), &one(0.0, 0.0, 0.0)) < 1e-15);
        assert_eq!(t.scattering(&band, 0.8, 0.0), Matrix2::default());
        let e = t.band(76.9e9).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert!(
            e.to_string().contains("t.csv: frequency_hz = 76900000000")
                && e.to_string().contains("allowed: 77000000000;"),
            "{e}"
        );
        let t = table(csv(&[76e9, 78e9], &[0.0], &[0.0], one));
        assert!(t.band(77e9).is_ok() && t.band(78.1e9).is_err());
    }

    #[test]
    fn coarse_steps_are_noted_with_their_error() {
        // 30 mm off the origin: 2 k x = 96.8 rad a radian, so 1 deg turns by 96.8 deg and 0.25 deg by 24 deg.
        let truth = dipole(DVec3::Z, DVec3::new(0.0, 0.03, 0.0));
        let coarse = table(csv(&[77e9], &steps(-10.0, 10.0, 21), &[0.0], &truth));
        let note = coarse.notes().last().unwrap();
        assert!(note.contains("from one azimuth to the next") && note.contains("97 deg"), "{note}");
        assert!(note.contains("steps of 0.62"), "{note}");
        let said: f64 = note.split("about ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let band = coarse.band(77e9).unwrap();
        let worst = (0..18)
            .map(|i| {
                let a = -8.5f64 + i as f64;
                distance(&coarse.scattering(&band, a.to_radians(), 0.0), &truth(77e9, a, 0.0))
            })
            .fold(0.0, f64::max);
        let found = 20.0 * (1.0 + worst).log10();
        assert!(said > 0.5 * found && said < 2.5 * found, "said {said}, found {found}");
        let fine = table(csv(&[77e9], &steps(-10.0, 10.0, 81), &[0.0], &truth));
        assert!(!fine.notes().iter().any(|n| n.contains("the phase turns")), "{:?}", fine.notes());
    }

    #[test]
    fn order_and_rounding_do_not_matter() {
        let truth = dipole(DVec3::X, DVec3::new(0.0, 1e-3, 0.0));
        let text = csv(&[77e9], &steps(-3.0, 3.0, 7), &steps(-3.0, 3.0, 7), &truth);
        let mut rows: Vec<&str> = text.lines().skip(1).collect();
        rows.reverse();
        rows.swap(3, 30);
        let other = format!("# made elsewhere\n{HEAD}{}\n", rows.join("\n").replace(",1,", ",1.00000001,"));
        assert_eq!(table(text).values, table(other).values);
    }

    #[test]
    fn broken_tables_are_named_with_their_line() {
        let good = csv(&[77e9], &[0.0, 1.0], &[0.0, 1.0], |_, _, _| [[Complex64::ONE; 2]; 2]);
        let complaint = |text: String| {
            let e = ScatteringTable::parse("t.csv", text).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            let e = e.to_string();
            assert!(e.starts_with("t.csv") && !e.contains('\n'), "{e}");
            e
        };
        let row = |n: usize, a: &str, b: &str| {
            let mut lines: Vec<String> = good.lines().map(String::from).collect();
            assert!(lines[n].contains(a));
            lines[n] = lines[n].replacen(a, b, 1);
            complaint(lines.join("\n"))
        };
        for (e, expect) in [
            (complaint(HEAD.into()), "the table has no rows"),
            (complaint(good.replace("vv_re_m", "vv_real")), "vv_re_m: no such column"),
            (
                complaint(good.lines().take(4).collect::<Vec<_>>().join("\n")),
                "the one at azimuth 1 deg, elevation 1 deg",
            ),
            (
                row(4, ",1,1,,", ",1,0,,"),
                "t.csv:5: azimuth 1 deg, elevation 0 deg, 77000000000 Hz: the direction occurs twice",
            ),
            (row(2, ",1,0,1,0", ",1,0,nan,0"), "t.csv:3: vh_re_m = NaN: is not an amplitude"),
            (row(2, ",1,0,1,0", ",1,0,,0"), "t.csv:3: vh_re_m = NaN: is not an amplitude"),
            (row(3, ",,,,1,0", ",3.5,,,,1,0"), "t.csv:4: 16: the row has a wrong number"),
            (row(3, ",,,,,1,0", ",,,,,1e300,0"), "is not an amplitude"),
            (
                row(3, ",,,,,1,0", ",30,,,,1,0"),
                "t.csv:4: vv_dbsm = 30: contradicts the amplitude in re and im; allowed: 10.992",
            ),
            (row(1, "77000000000", "77"), "frequency_hz = 77: out of range"),
            (row(1, ",0,0,", ",0,91,"), "elevation_deg = 91: out of range"),
            (row(1, ",0,0,", ",361,0,"), "azimuth_deg = 361: out of range"),
            (row(1, ",0,0,", ",-360,0,"), "cover more than a full turn"),
        ] {
            assert!(e.contains(expect), "{e}\n not {expect}");
        }
        let apart: String =
            good.lines()
                .enumerate()
                .map(|(i, l)| {
                    if i == 0 {
                        format!("{l},rx_azimuth_deg,rx_elevation_deg\n")
                    } else {
                        format!("{l},5,0\n")
                    }
                })
                .collect();
        assert!(complaint(apart).contains(
            "t.csv:2: rx_azimuth_deg = 5: the receiver is not in the direction of the transmitter"
        ));
        // Scattered directions: a grid of 1e6 x 1e6 is not built to find that out.
        let scattered =
            (0..2000).map(|i| format!("77e9,{},{},,,,,1,0,0,0,0,0,1,0\n", i as f64 * 0.01, i as f64 * 0.02));
        assert!(
            complaint(HEAD.to_string() + &scattered.collect::<String>())
                .contains("do not fill a grid of 2000 azimuths x 2000")
        );
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[-0-9.,naife\n]{0,80}") {
            let _ = ScatteringTable::parse("t.csv", HEAD.to_string() + &text);
        }

        /// Constants are interpolated to themselves everywhere within the table.
        #[test]
        fn weights_add_up(a in -30.0f64..30.0, e in -20.0f64..40.0, n in 2usize..7) {
            let one = |_: f64, _: f64, _: f64| [[Complex64::I; 2]; 2];
            let t = table(csv(&[77e9], &steps(-30.0, 30.0, n), &steps(-20.0, 40.0, n + 1), one));
            let s = t.scattering(&t.band(77e9).unwrap(), a.to_radians(), e.to_radians());
            prop_assert!(distance(&s, &one(0.0, 0.0, 0.0)) < 1e-12);
        }
    }
}
