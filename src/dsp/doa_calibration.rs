//! Calibration of an array by measured steering vectors S_cal (CONVENTIONS eq. 96): from a turntable
//! run, as a file, between its angles, and its ambiguity matrix.

use super::doa_covariance::{covariance, eigen};
use super::doa_manifold::Manifold;
use super::doa_residual::Residual;
use crate::base::error::{BadInput, Result};
use crate::formats::csv::{Table, Writer};
use num_complex::Complex64;
use std::collections::HashMap;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;

const HEADER: [&str; 5] = ["azimuth_deg", "elevation_deg", "channel", "re", "im"];

const RANGE: &str = "range_m";

/// Table of measured steering vectors over the product of two axes of angles. The common phase of a
/// vector carries no meaning, and its mean square over channels is 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Azimuths, degrees, ascending.
    pub azimuth_deg: Vec<f64>,
    /// Ascending; one value for a run in azimuth alone, which then holds for all elevations.
    pub elevation_deg: Vec<f64>,
    /// Number of virtual channels.
    pub channels: usize,
    /// Steering vectors, `[elevation, azimuth, channel]`.
    pub vectors: Vec<Complex64>,
    /// Distance of the reflector, if its wave front was not flat.
    pub range_m: Option<f64>,
}

/// Settings with which a turntable run becomes a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurntableOptions {
    /// Keep the phases alone: every channel gets modulus 1.
    pub unit_modulus: bool,
    /// Half width of the local quadratic fit over azimuth that takes noise out, in degrees; 0: none.
    pub smoothing_deg: f64,
}

impl Default for TurntableOptions {
    /// Phases alone, as measured.
    fn default() -> Self {
        TurntableOptions { unit_modulus: true, smoothing_deg: 0.0 }
    }
}

impl Manifold {
    /// Uses measured vectors (eq. 96): between their angles the ratio to this manifold is interpolated.
    ///
    /// # Errors
    /// Returns an error for a table of another number of channels.
    pub fn with_calibration(self, calibration: &Calibration) -> Result<Self> {
        let mut there = self.unmeasured();
        if let Some(range_m) = calibration.range_m {
            there = there.at_range(range_m)?;
        }
        Ok(self.with_residual(calibration.residual(&there)?))
    }
}

impl Calibration {
    /// Measures a calibration from the snapshots of one reflector at each position of a turntable: the principal
    /// eigenvector of each, with the ratio to the manifold smoothed over azimuth (local quadratic regression with
    /// tricube weights, Cleveland, J. Am. Stat. Assoc. 74, 829, 1979).
    ///
    /// `snapshots`: for each elevation, each azimuth: `[snapshot, channel]`, one or more snapshots.
    /// `manifold`: the ideal array, at the reflector's distance `range_m` if that is near.
    ///
    /// # Errors
    /// Returns an error for axes that do not ascend, missing or silent positions, values that are not finite, or a
    /// window that holds fewer than three angles.
    pub fn from_turntable(
        manifold: &Manifold,
        azimuth_deg: Vec<f64>,
        elevation_deg: Vec<f64>,
        range_m: Option<f64>,
        snapshots: &[Vec<Complex64>],
        options: &TurntableOptions,
    ) -> Result<Self> {
        check_axis("azimuth_deg", &azimuth_deg)?;
        check_axis("elevation_deg", &elevation_deg)?;
        let (rows, cols, n) = (elevation_deg.len(), azimuth_deg.len(), manifold.channels());
        if snapshots.len() != rows * cols {
            return Err(BadInput::new("the turntable measurement does not have snapshots at each angle")
                .value(snapshots.len())
                .allowed((rows * cols).to_string())
                .into());
        }
        let ideal = match range_m {
            Some(r) => manifold.ideal().at_range(r)?,
            None => manifold.ideal(),
        };
        let mut ratio = Vec::with_capacity(rows * cols * n);
        for (i, x) in snapshots.iter().enumerate() {
            let place = || {
                let (a, e) = (azimuth_deg[i % cols], elevation_deg[i / cols]);
                format!("azimuth {a} deg, elevation {e} deg")
            };
            if x.is_empty() || x.len() % n != 0 {
                return Err(BadInput::new(format!("snapshots of {n} channels are expected"))
                    .key(place())
                    .value(format!("{} values", x.len()))
                    .into());
            }
            let e = eigen(&covariance(x, n))?;
            if e.values[0] <= 0.0 {
                return Err(BadInput::new("the reflector was not detected").key(place()).into());
            }
            let a = ideal.steering(azimuth_deg[i % cols].to_radians(), elevation_deg[i / cols].to_radians());
            ratio.extend((0..n).map(|c| e.vectors[(c, 0)] / a[c]));
        }
        align(&mut ratio, cols, n);
        for row in ratio.chunks_exact_mut(cols * n) {
            if options.smoothing_deg > 0.0 {
                smooth(row, &azimuth_deg, n, options.smoothing_deg)?;
            }
        }
        let mut vectors = Vec::with_capacity(ratio.len());
        for (i, g) in ratio.chunks_exact(n).enumerate() {
            let a = ideal.steering(azimuth_deg[i % cols].to_radians(), elevation_deg[i / cols].to_radians());
            vectors.extend(normalised(g.iter().zip(a).map(|(g, a)| g * a).collect(), options.unit_modulus));
        }
        Ok(Calibration { azimuth_deg, elevation_deg, channels: n, vectors, range_m })
    }

    /// The calibration with the vectors that a manifold has at these angles, as if measured without error.
    ///
    /// # Errors
    /// Returns an error for axes that are empty or do not ascend.
    pub fn of_manifold(manifold: &Manifold, azimuth_deg: Vec<f64>, elevation_deg: Vec<f64>) -> Result<Self> {
        check_axis("azimuth_deg", &azimuth_deg)?;
        check_axis("elevation_deg", &elevation_deg)?;
        let mut vectors = Vec::new();
        for e in &elevation_deg {
            for a in &azimuth_deg {
                vectors.extend(manifold.steering(a.to_radians(), e.to_radians()));
            }
        }
        Ok(Calibration {
            azimuth_deg,
            elevation_deg,
            channels: manifold.channels(),
            vectors,
            range_m: manifold.range_m(),
        })
    }

    /// Reads a table from a file.
    ///
    /// # Errors
    /// Returns an error for a file that is missing or no table of steering vectors, with its line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::from_table(&Table::read(&path)?, path.as_ref())
    }

    /// Reads the table with columns `azimuth_deg,elevation_deg,channel,re,im`, in any order of rows. A
    /// comment line `range_m = R` gives the distance of the reflector.
    ///
    /// # Errors
    /// Returns an error for other columns, angles that do not form a full product of two axes, a channel missing or
    /// given twice, numbers that are not finite, a vector of zeros: with file and line.
    pub fn from_table(table: &Table, path: &Path) -> Result<Self> {
        let bad = |problem: String| BadInput::new(problem).file(path);
        if let Some(extra) = table.header.iter().find(|h| !HEADER.contains(&h.as_str())) {
            return Err(bad("unknown column".into()).key(extra.clone()).allowed(HEADER.join(", ")).into());
        }
        let columns = HEADER.map(|h| table.numbers(h));
        let [azimuth, elevation, channel, re, im] = columns;
        let (azimuth, elevation, channel, re, im) = (azimuth?, elevation?, channel?, re?, im?);
        if table.is_empty() {
            return Err(bad("the calibration has no rows".into()).into());
        }
        for i in 0..table.len() {
            for (name, v) in HEADER.iter().zip([azimuth[i], elevation[i], channel[i], re[i], im[i]]) {
                if !v.is_finite() {
                    return Err(bad("not a finite number".into())
                        .line(table.line(i))
                        .key(*name)
                        .value(v)
                        .into());
                }
            }
            if channel[i] < 0.0 || channel[i].fract() != 0.0 || channel[i] >= table.len() as f64 {
                return Err(bad("is not a channel number".into())
                    .line(table.line(i))
                    .key("channel")
                    .value(channel[i])
                    .allowed("0, 1, 2, … without gaps")
                    .into());
            }
        }
        let axis = |values: &[f64]| {
            let mut axis = values.to_vec();
            axis.sort_by(f64::total_cmp);
            axis.dedup();
            axis
        };
        let (azimuth_deg, elevation_deg) = (axis(&azimuth), axis(&elevation));
        let channels = channel.iter().fold(0.0f64, |a, b| a.max(*b)) as usize + 1;
        // Angles of one axis each are told apart exactly; -0 and 0 are the same place.
        let index = |axis: &[f64]| -> HashMap<u64, usize> {
            axis.iter().enumerate().map(|(i, v)| ((v + 0.0).to_bits(), i)).collect()
        };
        let (col, row) = (index(&azimuth_deg), index(&elevation_deg));
        let size = azimuth_deg.len().checked_mul(elevation_deg.len()).and_then(|s| s.checked_mul(channels));
        // A file of n rows cannot fill a larger table: say what is missing without building it.
        if size.is_none_or(|s| s > table.len().saturating_mul(2).max(1 << 16)) {
            return Err(bad(format!(
                "rows of {} azimuths x {} elevations x {channels} channels are missing",
                azimuth_deg.len(),
                elevation_deg.len()
            ))
            .value(format!("{} rows", table.len()))
            .into());
        }
        let mut from = vec![None; size.unwrap_or(0)];
        for i in 0..table.len() {
            let (r, c) = (row[&(elevation[i] + 0.0).to_bits()], col[&(azimuth[i] + 0.0).to_bits()]);
            let at = (r * azimuth_deg.len() + c) * channels + channel[i] as usize;
            if let Some(before) = from[at].replace(i) {
                return Err(bad(format!(
                    "the channel has a row for this angle in line {} already",
                    table.line(before)
                ))
                .line(table.line(i))
                .key("channel")
                .value(channel[i])
                .into());
            }
        }
        if let Some(gap) = from.iter().position(Option::is_none) {
            let place = gap / channels;
            let (a, e) = (azimuth_deg[place % azimuth_deg.len()], elevation_deg[place / azimuth_deg.len()]);
            return Err(bad(format!("missing at azimuth {a} deg, elevation {e} deg"))
                .key("channel")
                .value(gap % channels)
                .remedy("add a row for every channel at every pair of azimuth and elevation")
                .into());
        }
        let mut vectors: Vec<Complex64> =
            from.iter().flatten().map(|i| Complex64::new(re[*i], im[*i])).collect();
        for (place, v) in vectors.chunks_exact_mut(channels).enumerate() {
            let mean = v.iter().map(|z| z.norm_sqr()).sum::<f64>() / channels as f64;
            if !(mean > 0.0 && mean.is_finite()) {
                let line = from[place * channels].map_or(0, |i| table.line(i));
                return Err(bad("the steering vector is zero or not finite".into())
                    .line(line)
                    .key("re, im")
                    .into());
            }
            // A vector that is normalised already keeps its digits.
            if (mean - 1.0).abs() > 1e-12 {
                v.iter_mut().for_each(|z| *z /= mean.sqrt());
            }
        }
        let range_m = range_comment(table, path)?;
        Ok(Calibration { azimuth_deg, elevation_deg, channels, vectors, range_m })
    }

    /// Writes the table that [`Self::from_table`] reads. `comments` come first.
    ///
    /// # Errors
    /// Returns an error if the output cannot be written.
    pub fn write(&self, out: impl Write, comments: &[String]) -> std::io::Result<()> {
        let mut comments = comments.to_vec();
        comments.extend(self.range_m.map(|r| format!("{RANGE} = {r}")));
        let mut w = Writer::new(out, &comments, &HEADER)?;
        for (i, z) in self.vectors.iter().enumerate() {
            let (place, channel) = (i / self.channels, i % self.channels);
            let a = self.azimuth_deg[place % self.azimuth_deg.len()];
            let e = self.elevation_deg[place / self.azimuth_deg.len()];
            w.row([&a as &dyn Display, &e, &channel, &z.re, &z.im])?;
        }
        w.finish().map(|_| ())
    }

    /// Ratio to a manifold: what is left to interpolate.
    fn residual(&self, manifold: &Manifold) -> Result<Residual> {
        let n = self.channels;
        if manifold.channels() != n {
            return Err(BadInput::new("the calibration belongs to another array")
                .key("channels")
                .value(n)
                .allowed(manifold.channels().to_string())
                .into());
        }
        let cols = self.azimuth_deg.len();
        let mut ratio = self.vectors.clone();
        for (i, v) in ratio.chunks_exact_mut(n).enumerate() {
            let a = manifold
                .steering(self.azimuth_deg[i % cols].to_radians(), self.elevation_deg[i / cols].to_radians());
            for (v, a) in v.iter_mut().zip(a) {
                *v /= a;
            }
        }
        align(&mut ratio, cols, n);
        let radians = |v: &[f64]| v.iter().map(|d| d.to_radians()).collect();
        Ok(Residual {
            azimuth_rad: radians(&self.azimuth_deg),
            elevation_rad: radians(&self.elevation_deg),
            channels: n,
            ratio,
        })
    }

    /// Ambiguity |S^H S| between all angles, `[angle, angle]`, 1 on the diagonal (eq. 99; Feng 2019, Fig 2.6c). Angles
    /// are in the order of `vectors`.
    pub fn ambiguity(&self) -> Vec<f64> {
        ambiguity(&self.vectors, self.channels)
    }
}

/// Ambiguity |a_i^H a_j| / (|a_i||a_j|) (eq. 99) of vectors `[angle, channel]`, as `[angle, angle]`.
pub fn ambiguity(vectors: &[Complex64], channels: usize) -> Vec<f64> {
    let norm = |v: &[Complex64]| v.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
    let mut out = Vec::new();
    for a in vectors.chunks_exact(channels) {
        out.extend(vectors.chunks_exact(channels).map(|b| {
            let dot: Complex64 = a.iter().zip(b).map(|(a, b)| a.conj() * b).sum();
            dot.norm() / (norm(a) * norm(b))
        }));
    }
    out
}

/// Takes out of the vectors the common phases by which neighbours differ, along each row and from
/// the first of a row to the next.
fn align(vectors: &mut [Complex64], cols: usize, channels: usize) {
    for i in 0..vectors.len() / channels {
        let phase = if i == 0 {
            vectors[..channels].iter().sum::<Complex64>()
        } else {
            let before = if i % cols == 0 { i - cols } else { i - 1 };
            let (done, rest) = vectors.split_at(i * channels);
            let before = &done[before * channels..(before + 1) * channels];
            rest[..channels].iter().zip(before).map(|(a, b)| a * b.conj()).sum()
        };
        if phase.norm() > 0.0 {
            let turn = phase.conj() / phase.norm();
            vectors[i * channels..(i + 1) * channels].iter_mut().for_each(|z| *z *= turn);
        }
    }
}

fn normalised(mut v: Vec<Complex64>, unit_modulus: bool) -> Vec<Complex64> {
    if unit_modulus {
        v.iter_mut().for_each(|z| *z = if z.norm() > 0.0 { *z / z.norm() } else { Complex64::ONE });
        return v;
    }
    let mean = v.iter().map(|z| z.norm_sqr()).sum::<f64>() / v.len() as f64;
    v.iter_mut().for_each(|z| *z /= mean.sqrt());
    v
}

/// Local quadratic fit over one row of angles, channel by channel.
fn smooth(row: &mut [Complex64], axis: &[f64], channels: usize, half_width: f64) -> Result<()> {
    let raw = row.to_vec();
    for (i, here) in axis.iter().enumerate() {
        let near: Vec<(usize, f64, f64)> = axis
            .iter()
            .enumerate()
            .map(|(k, x)| (k, (x - here) / half_width))
            .filter(|(_, t)| t.abs() < 1.0)
            .map(|(k, t)| (k, t, (1.0 - t.abs().powi(3)).powi(3)))
            .collect();
        if near.len() < 3 {
            return Err(BadInput::new("the smoothing window has fewer than three angles")
                .key("smoothing_deg")
                .value(half_width)
                .remedy("enlarge the window, or set it to 0 for no smoothing")
                .into());
        }
        // Weights of the fit's value at t = 0, from the normal equations of 1, t, t^2.
        let moment = |p: i32| near.iter().map(|(_, t, w)| w * t.powi(p)).sum::<f64>();
        let m: [f64; 5] = std::array::from_fn(|p| moment(p as i32));
        let cofactor = [m[2] * m[4] - m[3] * m[3], m[2] * m[3] - m[1] * m[4], m[1] * m[3] - m[2] * m[2]];
        let det = m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
        for c in 0..channels {
            row[i * channels + c] = near
                .iter()
                .map(|(k, t, w)| {
                    let weight = w * (cofactor[0] + cofactor[1] * t + cofactor[2] * t * t) / det;
                    raw[k * channels + c] * weight
                })
                .sum();
        }
    }
    Ok(())
}

fn check_axis(name: &str, axis: &[f64]) -> Result<()> {
    let ascends = axis.windows(2).all(|w| w[0] < w[1]);
    if axis.is_empty() || !ascends || !axis.iter().all(|v| v.is_finite()) {
        return Err(BadInput::new("the angles must be finite and ascend").key(name).into());
    }
    Ok(())
}

/// `range_m = R` among the comments.
fn range_comment(table: &Table, path: &Path) -> Result<Option<f64>> {
    let mut found = None;
    for comment in &table.comments {
        let Some((key, value)) = comment.split_once('=') else { continue };
        if key.trim() != RANGE {
            continue;
        }
        match value.trim().parse::<f64>() {
            Ok(r) if r > 0.0 && r.is_finite() && found.is_none() => found = Some(r),
            _ => {
                return Err(BadInput::new(
                    "the distance of the reflector is not a positive number, or occurs twice",
                )
                .file(path)
                .key(RANGE)
                .value(value.trim())
                .allowed("above 0 m")
                .into());
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const LAMBDA: f64 = 3.8934e-3;

    fn table(text: &str) -> Result<Calibration> {
        let t = Table::parse("cal.csv", text.to_string())?;
        Calibration::from_table(&t, Path::new("cal.csv"))
    }

    fn array() -> Manifold {
        let y = [0.0, 0.5, 1.0, 2.0, 3.5].map(|y| DVec3::Y * (y * LAMBDA));
        Manifold::receivers(y.to_vec(), LAMBDA).unwrap()
    }

    /// Elements off their places by up to a twentieth of a wavelength, gains and phases off.
    pub fn spoilt() -> Manifold {
        let off = [0.03, -0.05, 0.02, 0.04, -0.03];
        let ahead = [0.02, 0.0, -0.04, 0.05, 0.01];
        let p = (0..5).map(|c| array().position_m(c) + DVec3::new(ahead[c], off[c], 0.0) * LAMBDA).collect();
        let gain = [(1.0, 0.0), (0.8, 0.5), (1.1, -0.4), (0.9, 1.0), (1.2, 0.2)];
        let gain = gain.map(|(m, p)| Complex64::from_polar(m, p)).to_vec();
        Manifold::receivers(p, LAMBDA).unwrap().with_gains(gain).unwrap()
    }

    #[test]
    fn file_round_trip_is_exact() {
        let mut c = Calibration::of_manifold(&spoilt(), vec![-10.1, -0.3, 7.7], vec![-1.0, 2.5]).unwrap();
        c.range_m = Some(5.25);
        let mut bytes = Vec::new();
        c.write(&mut bytes, &["turntable".into()]).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.starts_with("# turntable\n# range_m = 5.25\nazimuth_deg,elevation_deg,channel,re,im\n"));
        assert_eq!(table(&text).unwrap(), c);
    }

    #[test]
    fn damage_is_named() {
        let head = "azimuth_deg,elevation_deg,channel,re,im\n";
        let message = |rows: &str| table(&format!("{head}{rows}")).unwrap_err().to_string();
        assert_eq!(message(""), "cal.csv: the calibration has no rows");
        assert_eq!(
            message("0,0,0,1,0\n0,0,1,1,0\n1,0,0,1,0\n"),
            "cal.csv: channel = 1: missing at azimuth 1 deg, elevation 0 deg; add a row for every channel at every pair of azimuth and elevation"
        );
        assert_eq!(
            message("0,0,0,1,0\n0,0,0,1,0\n"),
            "cal.csv:3: channel = 0: the channel has a row for this angle in line 2 already"
        );
        assert_eq!(message("0,0,0,x,0\n"), "cal.csv:2: re = x: not a number");
        assert_eq!(message("0,0,0,,0\n"), "cal.csv:2: re = NaN: not a finite number");
        assert_eq!(
            message("0,0,0.5,1,0\n"),
            "cal.csv:2: channel = 0.5: is not a channel number; allowed: 0, 1, 2, … without gaps"
        );
        assert_eq!(message("0,0,0,0,0\n"), "cal.csv:2: re, im: the steering vector is zero or not finite");
        let e = table("azimuth_deg,elevation_deg,chan,re,im\n").unwrap_err().to_string();
        assert!(e.contains("unknown column") && !e.contains('\n'), "{e}");
        let e = table(&format!("# range_m = -3\n{head}0,0,0,1,0\n")).unwrap_err().to_string();
        assert_eq!(
            e,
            "cal.csv: range_m = -3: the distance of the reflector is not a positive number, or occurs twice; allowed: above 0 m"
        );
    }

    #[test]
    fn between_the_angles_the_true_vectors_are_found() {
        let az: Vec<f64> = (-30..=30).map(|i| 2.0 * i as f64).collect();
        let c = Calibration::of_manifold(&spoilt(), az, vec![0.0]).unwrap();
        let m = array().with_calibration(&c).unwrap();
        for deg in [-55.3f64, -20.0, 0.7, 13.0, 58.9] {
            let (got, want) = (m.steering(deg.to_radians(), 0.0), spoilt().steering(deg.to_radians(), 0.0));
            let dot: Complex64 = got.iter().zip(&want).map(|(a, b)| a.conj() * b).sum();
            // Linear over 2 deg of a phase that turns by 2 pi 0.05 in a radian: (0.3 x 0.035)^2/8.
            assert!(1.0 - dot.norm() / 5.0 < 1e-9, "{deg}: {}", 1.0 - dot.norm() / 5.0);
        }
        assert!(m.covers(1.0, 0.3) && !m.covers(1.2, 0.0));
        let two = Manifold::receivers(vec![DVec3::ZERO, DVec3::Y * 0.1], LAMBDA).unwrap();
        let e = two.with_calibration(&c).unwrap_err().to_string();
        assert_eq!(e, "channels = 5: the calibration belongs to another array; allowed: 2");
    }

    #[test]
    fn a_near_turntable_serves_far_targets() {
        let az: Vec<f64> = (-20..=20).map(|i| 3.0 * i as f64).collect();
        let near = spoilt().at_range(0.4).unwrap();
        let mut c = Calibration::of_manifold(&near, az, vec![0.0]).unwrap();
        assert_eq!(c.range_m, Some(0.4));
        let loss = |c: &Calibration| {
            let got = array().with_calibration(c).unwrap().steering(0.2, 0.0);
            let want = spoilt().steering(0.2, 0.0);
            let dot: Complex64 = got.iter().zip(&want).map(|(a, b)| a.conj() * b).sum();
            1.0 - dot.norm() / 5.0
        };
        // The errors of place stand under another angle from near: 2 pi 0.05 x 3.5 lambda/0.4 m = 0.011
        // rad.
        assert!(loss(&c) < 0.5 * 0.011 * 0.011, "{}", loss(&c));
        // Taken for far, the run's curved front is wrong by up to 0.37 rad.
        c.range_m = None;
        assert!(loss(&c) > 1e-3, "{}", loss(&c));
    }

    #[test]
    fn smoothing_takes_noise_out_of_a_turntable() {
        let az: Vec<f64> = (-60..=60).map(f64::from).collect();
        let truth = spoilt();
        let mut state = 7u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let snapshots: Vec<Vec<Complex64>> = az
            .iter()
            .map(|a| {
                let s = Complex64::from_polar(3.0, 40.0 * noise());
                let v = truth.steering(a.to_radians(), 0.0);
                v.iter().map(|z| z * s + Complex64::new(noise(), noise()) * 0.3).collect()
            })
            .collect();
        let error = |smoothing_deg: f64, unit_modulus: bool| {
            let o = TurntableOptions { unit_modulus, smoothing_deg };
            let c =
                Calibration::from_turntable(&array(), az.clone(), vec![0.0], None, &snapshots, &o).unwrap();
            let loss: f64 = az
                .iter()
                .zip(c.vectors.chunks(5))
                .map(|(a, v)| {
                    let w = truth.steering(a.to_radians(), 0.0);
                    let w = if unit_modulus { w.iter().map(|z| z / z.norm()).collect() } else { w };
                    let dot: Complex64 = v.iter().zip(&w).map(|(a, b)| a.conj() * b).sum();
                    1.0 - (dot.norm() / 5.0).powi(2)
                })
                .sum();
            (loss / az.len() as f64).sqrt()
        };
        let (raw, smooth) = (error(0.0, false), error(12.0, false));
        // A window of 23 angles with tricube weights holds some ten independent ones per fitted value.
        assert!(smooth < 0.5 * raw && raw < 0.1, "{raw} {smooth}");
        assert!(error(12.0, true) < raw);
        let o = TurntableOptions { unit_modulus: false, smoothing_deg: 0.5 };
        let e = Calibration::from_turntable(&array(), az.clone(), vec![0.0], None, &snapshots, &o);
        assert!(e.unwrap_err().to_string().contains("fewer than three"));
        let e = Calibration::from_turntable(&array(), vec![1.0, 0.0], vec![0.0], None, &[], &o);
        assert!(e.unwrap_err().to_string().contains("ascend"));
    }

    #[test]
    fn ambiguity_of_a_uniform_line_is_the_array_factor() {
        let p = (0..8).map(|i| DVec3::Y * (0.5 * LAMBDA * i as f64)).collect();
        let m = Manifold::receivers(p, LAMBDA).unwrap();
        let az = vec![-40.0, -5.0, 0.0, 12.0, 33.0];
        let c = Calibration::of_manifold(&m, az.clone(), vec![0.0]).unwrap();
        let s = c.ambiguity();
        for (i, a) in az.iter().enumerate() {
            for (j, b) in az.iter().enumerate() {
                let x = std::f64::consts::FRAC_PI_2 * (a.to_radians().sin() - b.to_radians().sin());
                let want = if i == j { 1.0 } else { ((8.0 * x).sin() / (8.0 * x.sin())).abs() };
                assert!((s[i * 5 + j] - want).abs() < 1e-12);
            }
        }
    }
}
