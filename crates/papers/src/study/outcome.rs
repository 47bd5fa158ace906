//! Results of a study: quantities over the axes that remain after reduction.

use super::parameter::{Values, number_of, word_of};
use super::sigma_min::snr_db;
use super::solve::{Cache, Case, Source, Sources, SphereMarking, cross_section_m2, solve};
use super::spec::{Quantity, Reduce, Study, StudySweep};
use super::view::{View, view};
use catseye::base::error::{Error, Result};
use catseye::base::matrix::Matrix2;
use catseye::base::units::{db_from_power, power_from_db};
use catseye::engine::Purpose;
use catseye::engine::solver::Solver;
use catseye::rcs::Aspect;
use catseye::rcs::validity::{Faces, Validity};
use std::collections::HashMap;

/// One quantity over the axes, row-major, the last axis fastest; NaN where there is no value.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name of the quantity.
    pub name: String,
    /// Label in pictures, with the unit.
    pub label: String,
    /// Values over the axes.
    pub values: Vec<f64>,
}

/// Results of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The remaining axes.
    pub axes: Vec<StudySweep>,
    /// The quantities, one field each.
    pub fields: Vec<Field>,
    /// Number of different cross sections that were solved.
    pub solved: usize,
    /// Limits of physical optics that these reach, in words.
    pub remarks: Vec<String>,
    /// Descriptions of the targets.
    pub targets: Vec<String>,
}

/// Computes every quantity of `study`.
///
/// # Errors
/// Returns the errors of the points and of the solver, and an error if a quantity is NaN.
pub fn compute(
    solver: &dyn Solver,
    study: &Study,
    cache: Option<&Cache<'_>>,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Outcome> {
    let mut work = Work::collect(study, study.points(), &|i| study.values_at(i))?;
    let fields = work.fields(solver, study, &study.quantities, cache, progress)?;
    let field = |(q, values): (&Quantity, Vec<f64>)| {
        let (name, label) = (q.name().into(), q.label().into());
        Field { name, label, values }
    };
    let mut outcome = Outcome {
        axes: study.sweeps.clone(),
        fields: study.quantities.iter().zip(fields).map(field).collect(),
        solved: work.cases.len(),
        remarks: work.remarks(study)?,
        targets: work.sources.scenes.iter().map(|s| s.spec.clone()).collect(),
    };
    // From the last, so that the indices of the others stay.
    for (i, s) in study.sweeps.iter().enumerate().rev() {
        if let Some(r) = s.reduce {
            outcome.reduce(i, r);
        }
    }
    Ok(outcome)
}

/// The data of one point.
struct Point {
    views: Vec<View>,
    /// For each view the case to solve, or the marking of spheres.
    seen: Vec<PointCase>,
    polarisation: String,
    frequency_hz: f64,
    snr_db: f64,
}

enum PointCase {
    Case(usize),
    SphereMarking(SphereMarking),
    Nothing,
}

/// The points of a study and the different cases behind them.
pub struct Work {
    points: Vec<Point>,
    /// The different cases, each solved once.
    pub cases: Vec<Case>,
    /// The targets of the cases.
    pub sources: Sources,
}

impl Work {
    /// Collects the points `0..count`, whose parameters `values` gives.
    ///
    /// # Errors
    /// Returns an error for a point that is not valid.
    pub fn collect(study: &Study, count: usize, values: &dyn Fn(usize) -> Values) -> Result<Work> {
        let mut sources = Sources::new(&study.file, &study.import);
        let mut cases: Vec<Case> = Vec::new();
        let mut known: HashMap<(usize, u64, String, [u64; 4]), usize> = HashMap::new();
        let mut points = Vec::with_capacity(count);
        for i in 0..count {
            let values = values(i);
            let frequency_hz = number_of(&values, "frequency_hz").unwrap_or(f64::NAN);
            let ground = word_of(&values, "ground").unwrap_or("none");
            let source = study.needs_rcs().then(|| sources.of(&values)).transpose()?;
            let mut views = Vec::new();
            let mut seen = Vec::new();
            for m in &study.mounts {
                let v = view(study.place, &values, m)?;
                views.push(v);
                seen.push(match &source {
                    Some(Source::Scene(scene)) => {
                        let bits =
                            [v.foot_azimuth, v.foot_elevation, v.foot_range_m, v.height_m].map(f64::to_bits);
                        let key = (*scene, frequency_hz.to_bits(), ground.to_string(), bits);
                        PointCase::Case(*known.entry(key).or_insert_with(|| {
                            cases.push(Case::new(*scene, frequency_hz, ground, &v));
                            cases.len() - 1
                        }))
                    }
                    Some(Source::SphereMarking(b)) => PointCase::SphereMarking(*b),
                    None => PointCase::Nothing,
                });
            }
            points.push(Point {
                views,
                seen,
                polarisation: word_of(&values, "polarisation").unwrap_or("vv").to_string(),
                frequency_hz,
                snr_db: snr_db(&values).unwrap_or(f64::NAN),
            });
        }
        Ok(Work { points, cases, sources })
    }

    /// The purpose for which an engine is opened that can take all cases.
    ///
    /// # Errors
    /// Returns the errors of [`Purpose::of_target`].
    pub fn purpose(&self, accuracy_db: f64) -> Result<Purpose> {
        for (i, source) in self.sources.scenes.iter().enumerate() {
            let mut frequencies_hz: Vec<f64> =
                self.cases.iter().filter(|c| c.scene == i).map(|c| c.frequency_hz).collect();
            frequencies_hz.sort_by(f64::total_cmp);
            frequencies_hz.dedup();
            let purpose = source.purpose(&frequencies_hz, accuracy_db)?;
            if purpose != Purpose::General {
                return Ok(purpose);
            }
        }
        Ok(Purpose::General)
    }

    /// Limits of physical optics that these cases reach, the worst of each kind, in words.
    ///
    /// # Errors
    /// Returns an error if a ground names no material.
    pub fn remarks(&self, study: &Study) -> Result<Vec<String>> {
        let mut all = Validity::default();
        let faces: Vec<Faces> = self.sources.scenes.iter().map(|s| s.faces()).collect();
        for c in &self.cases {
            let options = study.options(&c.ground, c.range_m, c.height_m)?;
            let aspect = Aspect { azimuth: c.azimuth, elevation: c.elevation };
            all.add(&faces[c.scene].validity(&[c.frequency_hz], &[aspect], false, &options));
        }
        Ok(all.lines())
    }

    /// Computes each quantity at each point.
    ///
    /// # Errors
    /// Returns the errors of the solver, and an error if a value is NaN.
    pub fn fields(
        &mut self,
        solver: &dyn Solver,
        study: &Study,
        quantities: &[Quantity],
        cache: Option<&Cache<'_>>,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Vec<Vec<f64>>> {
        let total = self.cases.len() as u64;
        progress(0, total);
        let solved = solve(
            solver,
            &self.sources,
            &self.cases,
            study.convention,
            &|c| study.options(&c.ground, c.range_m, c.height_m),
            cache,
            &|n| progress(n, total),
        )?;
        quantities
            .iter()
            .map(|&q| self.points.iter().map(|p| p.quantity(q, study, &solved)).collect::<Result<Vec<f64>>>())
            .collect()
    }
}

impl Point {
    fn rcs_dbsm(&self, mount: usize, solved: &[Matrix2]) -> Result<f64> {
        Ok(db_from_power(match &self.seen[mount] {
            PointCase::Case(i) => cross_section_m2(&solved[*i], &self.polarisation),
            // SphereMarking turn no polarisation.
            PointCase::SphereMarking(_) if matches!(self.polarisation.as_str(), "vh" | "hv") => 0.0,
            PointCase::SphereMarking(b) => b.total_m2(self.frequency_hz, self.views[mount].elevation)?,
            PointCase::Nothing => f64::NAN,
        }))
    }

    fn quantity(&self, quantity: Quantity, study: &Study, solved: &[Matrix2]) -> Result<f64> {
        let detection = || {
            study
                .detection
                .as_ref()
                .ok_or_else(|| Error::Failed("a study without [detection] asks for it".into()))
        };
        let first = &self.views[0];
        let value = match quantity {
            Quantity::Rcs => self.rcs_dbsm(0, solved)?,
            Quantity::SigmaMin => {
                let d = detection()?;
                self.views.iter().map(|v| d.sigma_min_dbsm(v, self.snr_db)).fold(f64::INFINITY, f64::min)
            }
            Quantity::Margin => {
                let d = detection()?;
                let mut best = f64::NEG_INFINITY;
                for (i, v) in self.views.iter().enumerate() {
                    let least = d.sigma_min_dbsm(v, self.snr_db);
                    // A radar that looks away needs an infinite cross section.
                    if least < f64::INFINITY {
                        best = best.max(self.rcs_dbsm(i, solved)? - least);
                    }
                }
                best
            }
            Quantity::ViewAzimuth => first.azimuth.to_degrees(),
            Quantity::ViewElevation => first.elevation.to_degrees(),
            Quantity::ViewRange => first.range_m,
            Quantity::BallRcs => match &self.seen[0] {
                PointCase::SphereMarking(b) => db_from_power(b.one_m2(self.frequency_hz)?),
                _ => f64::NAN,
            },
            Quantity::BallCount => match &self.seen[0] {
                PointCase::SphereMarking(b) => b.count(),
                _ => f64::NAN,
            },
        };
        if value.is_nan() && !matches!(quantity, Quantity::BallRcs | Quantity::BallCount) {
            return Err(Error::Failed(format!(
                "{} of study {} is not a number",
                quantity.name(),
                study.name
            )));
        }
        Ok(value)
    }
}

impl Outcome {
    /// Number of values on each axis.
    pub fn shape(&self) -> Vec<usize> {
        self.axes.iter().map(|a| a.values.len()).collect()
    }

    /// Reduces axis `i` to one number.
    fn reduce(&mut self, i: usize, how: Reduce) {
        let axis = self.axes.remove(i);
        let n = axis.values.len();
        let inner: usize = self.axes[i..].iter().map(|a| a.values.len()).product();
        let numbers = axis.numbers().unwrap_or_else(|| vec![f64::NAN; n]);
        for f in &mut self.fields {
            f.values = lines_along(&f.values, n, inner).map(|y| one(how, &numbers, &y)).collect();
            match how {
                Reduce::DetectionRange => {
                    f.name = "detection_range_m".into();
                    f.label = "detection range (m)".into();
                }
                Reduce::UnbrokenRange => {
                    f.name = "unbroken_range_m".into();
                    f.label = "range of unbroken detection (m)".into();
                }
                _ => {}
            }
        }
    }
}

/// Values along an axis of `n` places, for every place on the other axes in order; `inner` is the number of
/// places on the axes after it.
pub fn lines_along(values: &[f64], n: usize, inner: usize) -> impl Iterator<Item = Vec<f64>> {
    let outer = values.len() / (n * inner);
    let starts = (0..outer).flat_map(move |o| (0..inner).map(move |k| o * n * inner + k));
    starts.map(move |start| (0..n).map(|j| values[start + j * inner]).collect())
}

fn one(how: Reduce, x: &[f64], y: &[f64]) -> f64 {
    let n = y.len() as f64;
    match how {
        Reduce::MeanDb => y.iter().sum::<f64>() / n,
        Reduce::MeanPower => db_from_power(y.iter().map(|v| power_from_db(*v)).sum::<f64>() / n),
        Reduce::Maximum => y.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        Reduce::Minimum => y.iter().copied().fold(f64::INFINITY, f64::min),
        Reduce::DetectionRange => detection_range(x, y),
        Reduce::UnbrokenRange => unbroken_range(x, y),
    }
}

/// Largest distance at which the margin is not negative: NaN if it always is negative, the last distance if
/// it still is not there ("at least"), otherwise interpolated.
pub fn detection_range(x: &[f64], margin: &[f64]) -> f64 {
    match margin.iter().rposition(|m| *m >= 0.0) {
        None => f64::NAN,
        Some(i) => crossing(x, margin, i),
    }
}

/// Distance at which the margin first turns negative after it was not; NaN if it never was non-negative.
pub fn unbroken_range(x: &[f64], margin: &[f64]) -> f64 {
    let Some(first) = margin.iter().position(|m| *m >= 0.0) else { return f64::NAN };
    let run = margin[first..].iter().take_while(|m| **m >= 0.0).count();
    crossing(x, margin, first + run - 1)
}

/// Distance of the crossing between point `i`, where the margin is not negative, and the next.
fn crossing(x: &[f64], margin: &[f64], i: usize) -> f64 {
    match (x.get(i + 1), margin.get(i + 1)) {
        (Some(next), Some(m)) if m.is_finite() && margin[i].is_finite() => {
            x[i] + (next - x[i]) * margin[i] / (margin[i] - m)
        }
        _ => x[i],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::parameter::Value;

    #[test]
    fn ranges_of_detection() {
        let x = [10.0, 20.0, 30.0, 40.0];
        assert_eq!(detection_range(&x, &[5.0, -5.0, 10.0, -10.0]), 35.0);
        assert_eq!(unbroken_range(&x, &[5.0, -5.0, 10.0, -10.0]), 15.0);
        assert_eq!(unbroken_range(&x, &[-5.0, 5.0, 0.0, -10.0]), 30.0);
        assert_eq!(detection_range(&x, &[1.0, 1.0, 1.0, 1.0]), 40.0);
        assert!(detection_range(&x, &[-1.0; 4]).is_nan() && unbroken_range(&x, &[-1.0; 4]).is_nan());
        assert_eq!(
            detection_range(&x, &[1.0, f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY]),
            10.0
        );
    }

    #[test]
    fn an_axis_is_reduced_in_place() {
        let axis = |name: &str, v: &[f64]| StudySweep {
            parameter: name.into(),
            label: name.into(),
            values: v.iter().map(|x| Value::Number(*x)).collect(),
            names: v.iter().map(f64::to_string).collect(),
            reduce: None,
        };
        let mut o = Outcome {
            axes: vec![axis("a", &[0.0, 1.0]), axis("b", &[0.0, 1.0, 2.0]), axis("c", &[0.0, 1.0])],
            fields: vec![Field {
                name: "rcs_dbsm".into(),
                label: String::new(),
                values: (0..12).map(f64::from).collect(),
            }],
            solved: 0,
            remarks: vec![],
            targets: vec![],
        };
        o.reduce(1, Reduce::MeanDb);
        // Index 6 a + 2 b + c, mean over b.
        assert_eq!(o.fields[0].values, [2.0, 3.0, 8.0, 9.0]);
        assert_eq!(o.shape(), [2, 2]);
        o.reduce(0, Reduce::Maximum);
        assert_eq!(o.fields[0].values, [8.0, 9.0]);
        // 0 and 10 dB: half of 11.
        assert!((one(Reduce::MeanPower, &[], &[0.0, 10.0]) - 10.0 * 5.5f64.log10()).abs() < 1e-12);
    }
}
