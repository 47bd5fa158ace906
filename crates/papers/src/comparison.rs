//! The common table in which numbers of this program stand beside the expected ones.

use crate::study::parameter::Value;

/// How close a number has to be to the expected one.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tolerance {
    /// The row passes if |ours − expected| ≤ this, in the row's unit.
    Within(f64),
    /// The row passes if |ours / expected − 1| ≤ this.
    Share(f64),
    /// The row passes if ours ≤ this, in the row's unit.
    AtMost(f64),
    /// The row is shown but not judged.
    Shown,
}

/// One row: a number of this program beside the expected one. As JSON it has the keys of a study's fact.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Name of the number.
    #[serde(rename = "text")]
    pub name: String,
    /// Expected value: a number, the words of a document, or None where nothing is stated.
    #[serde(rename = "document")]
    pub expected: Option<Value>,
    /// Value of this program; NaN, which JSON writes as null, where there is none.
    pub ours: f64,
    /// The unit of both numbers.
    pub unit: String,
    /// How far the numbers may be apart.
    #[serde(skip)]
    pub tolerance: Tolerance,
    /// Source of the expected value, or the reason why the two differ.
    #[serde(rename = "why")]
    pub source: String,
}

impl Comparison {
    /// Makes a row whose expected value is a number or missing.
    pub fn new(
        name: &str,
        unit: &str,
        expected: Option<f64>,
        tolerance: Tolerance,
        ours: f64,
        source: &str,
    ) -> Self {
        Comparison {
            name: name.into(),
            expected: expected.map(Value::Number),
            ours,
            unit: unit.into(),
            tolerance,
            source: source.into(),
        }
    }

    /// The expected value when it is a number.
    pub fn expected_number(&self) -> Option<f64> {
        self.expected.as_ref().and_then(Value::number)
    }

    /// Difference ours − expected in the row's unit; relative for [`Tolerance::Share`].
    pub fn error(&self) -> Option<f64> {
        self.expected_number().map(|e| match self.tolerance {
            Tolerance::Share(_) => self.ours / e - 1.0,
            _ => self.ours - e,
        })
    }

    /// Whether a fact of a document agrees: levels within 1 dB, other numbers within a tenth of the
    /// document's. None where the document gives no number; if this program has no number, the fact does not
    /// agree.
    pub fn agrees(&self) -> Option<bool> {
        let expected = self.expected_number()?;
        let limit = if self.unit.starts_with("dB") { 1.0 } else { 0.1 * expected.abs() };
        Some((self.ours - expected).abs() <= limit)
    }

    /// Whether the row passes; None for a row that is only shown. A number that is NaN fails.
    pub fn passes(&self) -> Option<bool> {
        match self.tolerance {
            Tolerance::Within(limit) | Tolerance::Share(limit) => {
                Some(self.error().is_some_and(|e| e.abs() <= limit))
            }
            Tolerance::AtMost(limit) => Some(self.ours <= limit),
            Tolerance::Shown => None,
        }
    }
}
