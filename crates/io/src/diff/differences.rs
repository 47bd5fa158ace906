//! Tolerances, and the differences that were found.

use catseye::base::error::{BadInput, Result};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;

/// Tolerances of a comparison. Each may be infinite, which lets anything pass, except those that match
/// points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tolerances {
    /// Largest difference of levels (columns and keys that end in `_db`, `_dbm`, `_dbsm`) and of powers in W
    /// by their ratio, dB.
    pub tolerance_db: f64,
    /// Depth below the greatest cross section of both tables down to which cross sections count, dB.
    pub above_db: f64,
    /// Largest difference of the phases of the amplitudes in RCS tables where their levels count, degrees;
    /// None: phases are not compared.
    pub phase_deg: Option<f64>,
    /// Largest relative difference. Arrays: the norm of the difference over the norm, and the largest
    /// difference over the largest value. Other numbers: the difference over the larger of the two.
    pub relative: f64,
    /// Largest difference of lengths (`_m`), m.
    pub tolerance_m: f64,
    /// Largest difference of velocities (`_mps`), m/s.
    pub tolerance_mps: f64,
    /// Largest difference of angles (`_deg`), degrees.
    pub tolerance_deg: f64,
    /// Largest difference in range of matching points, m; None: the range cell of the manifest beside them,
    /// or else 0.5 m.
    pub match_m: Option<f64>,
    /// Largest difference in range rate of matching points, m/s; None: the cell of the manifest beside them,
    /// or else 0.5 m/s.
    pub match_mps: Option<f64>,
    /// Largest difference in azimuth of matching points, degrees.
    pub match_deg: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Tolerances {
            tolerance_db: 0.1,
            above_db: 40.0,
            phase_deg: None,
            relative: 1e-3,
            tolerance_m: 0.01,
            tolerance_mps: 0.01,
            tolerance_deg: 0.1,
            match_m: None,
            match_mps: None,
            match_deg: 2.0,
        }
    }
}

impl Tolerances {
    /// Checks that every value can serve as a tolerance.
    ///
    /// # Errors
    /// Returns `BadInput` with the name of a value that is negative or NaN, or that is infinite where points
    /// are matched.
    pub fn check(&self) -> Result<()> {
        let any = [
            ("tolerance_db", Some(self.tolerance_db)),
            ("above_db", Some(self.above_db)),
            ("phase_deg", self.phase_deg),
            ("relative", Some(self.relative)),
            ("tolerance_m", Some(self.tolerance_m)),
            ("tolerance_mps", Some(self.tolerance_mps)),
            ("tolerance_deg", Some(self.tolerance_deg)),
        ];
        let finite =
            [("match_m", self.match_m), ("match_mps", self.match_mps), ("match_deg", Some(self.match_deg))];
        let refuse = |name: &str, value: f64, allowed: &str| {
            BadInput::new("a tolerance must not be negative or infinite")
                .key(name)
                .value(value)
                .allowed(allowed)
        };
        for (name, value) in any {
            if let Some(x) = value.filter(|x| x.is_nan() || *x < 0.0) {
                return Err(refuse(name, x, "0 or more, or inf").into());
            }
        }
        for (name, value) in finite {
            if let Some(x) = value.filter(|x| !x.is_finite() || *x < 0.0) {
                return Err(refuse(name, x, "0 or more, finite").into());
            }
        }
        Ok(())
    }
}

/// Differences in one file or array, represented by the place where the two are farthest apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Path of the file below the folders, or the frame and name in a dataset.
    pub file: String,
    /// The column, key or measure that differs.
    pub what: String,
    /// Number of places where it differs.
    pub places: u64,
    /// The place where the two are farthest apart: line, index, key or point.
    pub place: String,
    /// Value of the first result there; null where it has none.
    pub a: Value,
    /// Value of the second result there; null where it has none.
    pub b: Value,
    /// Distance of the two, in `unit`; null where no number states it.
    pub apart: Option<f64>,
    /// Allowed distance, in `unit`; null where they have to be equal.
    pub allowed: Option<f64>,
    /// Unit of both distances.
    pub unit: String,
}

impl Difference {
    /// Makes the difference of two values that should be equal.
    pub fn unequal(file: &str, what: &str, place: impl Into<String>, a: Value, b: Value) -> Self {
        Difference {
            file: file.into(),
            what: what.into(),
            places: 1,
            place: place.into(),
            a,
            b,
            apart: None,
            allowed: None,
            unit: String::new(),
        }
    }

    /// Adds the distance of the two and the allowed distance.
    pub fn by(self, apart: f64, allowed: f64, unit: &str) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        Difference { apart: finite(apart), allowed: finite(allowed), unit: unit.into(), ..self }
    }

    /// A missing number ranks above all numbers.
    fn rank(&self) -> f64 {
        self.apart.unwrap_or(f64::INFINITY)
    }
}

/// Converts a number to JSON; to text where JSON cannot hold it.
pub fn number(x: f64) -> Value {
    match serde_json::Number::from_f64(x) {
        Some(n) => Value::Number(n),
        None => Value::String(x.to_string()),
    }
}

/// How far the two are apart over all compared places of one column, whether that is allowed or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// The column.
    pub what: String,
    /// Unit of the distances.
    pub unit: String,
    /// Number of places that were compared.
    pub places: u64,
    /// Number of places that are farther apart than is allowed.
    pub beyond: u64,
    /// Greatest distance, in `unit`; null where one of the two is not finite.
    pub largest: Option<f64>,
    /// Median of the distances, in `unit`; null where it is not finite.
    pub median: Option<f64>,
    /// The place where the two are farthest apart; empty where they are equal everywhere.
    pub place: String,
    /// Allowed distance, in `unit`; null where anything passes.
    pub allowed: Option<f64>,
}

/// Distances of one column as they come in.
#[derive(Debug, Default)]
struct Distances {
    unit: &'static str,
    allowed: f64,
    all: Vec<f64>,
    beyond: u64,
    largest: f64,
    place: String,
}

/// Counts of what was compared, and the differences found.
#[derive(Debug, Default)]
pub struct DifferenceTally {
    differences: BTreeMap<(String, String), Difference>,
    /// Distances of each column, in the order of the columns; None where they are not kept.
    distances: Option<Vec<(String, Distances)>>,
    /// Number of files and arrays that were compared.
    pub files: u64,
    /// Number of values that were compared.
    pub values: u64,
}

impl DifferenceTally {
    /// A tally that keeps the distance of every value of tables, 8 bytes each. Comparisons of many files do without.
    pub fn with_distances() -> Self {
        DifferenceTally { distances: Some(Vec::new()), ..Default::default() }
    }

    /// An empty tally that keeps what this one keeps.
    pub fn empty_like(&self) -> Self {
        DifferenceTally { distances: self.distances.as_ref().map(|_| Vec::new()), ..Default::default() }
    }

    /// Counts a distance of a column, in `unit`. `place` is asked for the greatest ones only.
    pub fn measure(
        &mut self,
        what: &str,
        (apart, allowed): (f64, f64),
        unit: &'static str,
        place: impl FnOnce() -> String,
    ) {
        let Some(columns) = &mut self.distances else { return };
        let at = columns.iter().position(|(name, _)| name == what).unwrap_or_else(|| {
            columns.push((what.into(), Distances::default()));
            columns.len() - 1
        });
        let column = &mut columns[at].1;
        // Whole numbers of a column may have to be equal where others need not: the strictest is told.
        column.allowed = if column.all.is_empty() { allowed } else { column.allowed.min(allowed) };
        column.unit = unit;
        column.beyond += u64::from(apart > allowed);
        if apart > column.largest {
            (column.largest, column.place) = (apart, place());
        }
        column.all.push(apart);
    }

    /// The distances of each column in figures, in the order of the columns.
    pub fn quantities(&mut self) -> Vec<Quantity> {
        let finite = |x: f64| x.is_finite().then_some(x);
        let figures = |(what, mut column): (String, Distances)| {
            column.all.sort_by(f64::total_cmp);
            let n = column.all.len();
            let median = 0.5 * (column.all[(n - 1) / 2] + column.all[n / 2]);
            Quantity {
                what,
                unit: column.unit.into(),
                places: n as u64,
                beyond: column.beyond,
                largest: finite(column.largest),
                median: finite(median),
                place: column.place,
                allowed: finite(column.allowed),
            }
        };
        self.distances.take().unwrap_or_default().into_iter().map(figures).collect()
    }

    /// Whether nothing differs.
    pub fn is_alike(&self) -> bool {
        self.differences.is_empty()
    }

    /// Adds a difference to those of its file and column.
    pub fn note(&mut self, d: Difference) {
        match self.differences.entry((d.file.clone(), d.what.clone())) {
            Entry::Vacant(e) => _ = e.insert(d),
            Entry::Occupied(mut e) => {
                let here = e.get_mut();
                let places = here.places + d.places;
                if d.rank() > here.rank() {
                    *here = d;
                }
                here.places = places;
            }
        }
    }

    /// Adds the counts and differences of another comparison.
    pub fn add(&mut self, other: DifferenceTally) {
        self.files += other.files;
        self.values += other.values;
        other.differences.into_values().for_each(|d| self.note(d));
        // One table is compared by one tally, so no column is in both.
        if let (Some(here), Some(more)) = (&mut self.distances, other.distances) {
            here.extend(more);
        }
    }

    /// Lists the differences by file, then by column, key or measure.
    pub fn list(self) -> Vec<Difference> {
        self.differences.into_values().collect()
    }
}

/// Report of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The first result.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub a: PathBuf,
    /// The second result.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub b: PathBuf,
    /// Kind of both results.
    pub kind: String,
    /// Whether nothing differs.
    pub alike: bool,
    /// Number of files and arrays that were compared.
    pub files: u64,
    /// Number of values that were compared.
    pub values: u64,
    /// The tolerances that were used.
    pub tolerances: Tolerances,
    /// The differences, by file.
    pub differences: Vec<Difference>,
    /// Distances of each column of numbers, where two tables were compared; empty for all other kinds.
    pub quantities: Vec<Quantity>,
}
