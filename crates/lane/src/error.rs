//! The error of all lane methods and their parts, with the checks that return it.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::RangeInclusive;

/// Serde takes a field of type `&'static str` for one that borrows from the file, also in variants that it
/// skips.
type Text = &'static str;

/// The reason why no lane is stated, or why a method or a part of one refuses its input. `Display` gives one
/// plain sentence.
///
/// In files an estimate without a lane holds one of the first seven; the others become [`LaneError::Refused`]
/// there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "reason")]
pub enum LaneError {
    /// The scan is empty.
    Empty,
    /// No point is finite.
    NotFinite {
        /// Number of points that were given.
        points: usize,
    },
    /// The vehicle's speed is not known, so that moving points cannot be told from resting ones.
    NoSpeed,
    /// No point is at rest.
    NothingAtRest,
    /// Points are at rest, but not in the markers' pattern.
    NoPattern {
        /// Number of points at rest.
        at_rest: usize,
    },
    /// The method needs something that the input does not hold.
    NotGiven {
        /// What is missing, in words.
        what: String,
    },
    /// The method states a reason of its own.
    Refused {
        /// The reason as one sentence.
        why: String,
    },
    /// The image shows no line that can be a lane's.
    #[serde(skip)]
    NoLaneLine,
    /// A list is empty.
    #[serde(skip)]
    Missing {
        /// What the list holds, in words.
        what: Text,
    },
    /// A value is NaN or infinite.
    #[serde(skip)]
    NotANumber {
        /// What the value is, in words.
        what: Text,
        /// Its index, where it stands in a list.
        index: Option<usize>,
    },
    /// A value lies outside its range.
    #[serde(skip)]
    OutOfRange {
        /// What the value is, in words.
        what: Text,
        /// The value.
        value: f64,
        /// The allowed range, in words.
        allowed: String,
    },
    /// A setting lies outside its range, or contradicts another.
    #[serde(skip)]
    Setting {
        /// Name of the setting.
        name: Text,
    },
    /// Two lists that belong together differ in length.
    #[serde(skip)]
    Lengths {
        /// What the list holds, in words.
        what: Text,
        /// Its length.
        found: usize,
        /// The length of the other list.
        expected: usize,
    },
    /// There are fewer things than a method needs.
    #[serde(skip)]
    TooFew {
        /// What is counted, in words.
        what: Text,
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The data do not determine the result.
    #[serde(skip)]
    Undetermined {
        /// What the data leave open, in words.
        what: Text,
    },
    /// The best answer explains fewer than half of the data.
    #[serde(skip)]
    Unexplained {
        /// What was fitted, in words.
        best: Text,
        /// How many of the data it explains.
        explained: f64,
        /// How many data there are.
        of: usize,
        /// What the data are, in words.
        what: Text,
    },
}

impl LaneError {
    /// Makes a method's own reason, as one sentence.
    pub fn refused(why: impl fmt::Display) -> LaneError {
        LaneError::Refused { why: why.to_string() }
    }

    /// Makes the error for a value that is NaN or infinite.
    pub fn not_finite(what: &'static str) -> LaneError {
        LaneError::NotANumber { what, index: None }
    }

    /// Makes the error for a value outside its range, with the range in words.
    pub fn out_of_range(what: &'static str, value: f64, allowed: &str) -> LaneError {
        LaneError::OutOfRange { what, value, allowed: allowed.into() }
    }

    /// Makes the error for fewer things than a method needs.
    pub fn too_few(what: &'static str, found: usize, needed: usize) -> LaneError {
        LaneError::TooFew { what, found, needed }
    }

    /// Makes the error for a search with more places than one call takes.
    pub fn too_large(places: usize, most: usize) -> LaneError {
        LaneError::refused(format!("the search has {places} positions, and one call allows at most {most}"))
    }

    /// Makes the error for data that do not determine the result.
    pub fn undetermined(what: &'static str) -> LaneError {
        LaneError::Undetermined { what }
    }

    /// The error as an estimate states it.
    pub(crate) fn stated(self) -> LaneError {
        use LaneError::{Empty, NoPattern, NoSpeed, NotFinite, NotGiven, NothingAtRest, Refused};
        match self {
            Empty
            | NotFinite { .. }
            | NoSpeed
            | NothingAtRest
            | NoPattern { .. }
            | NotGiven { .. }
            | Refused { .. } => self,
            other => LaneError::refused(other),
        }
    }
}

impl fmt::Display for LaneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LaneError::Empty => write!(f, "the scan has no points"),
            LaneError::NotFinite { points } => write!(f, "none of {points} points is finite"),
            LaneError::NoSpeed => write!(f, "the speed of the vehicle is unknown"),
            LaneError::NothingAtRest => write!(f, "no point is static"),
            LaneError::NoPattern { at_rest } => {
                write!(f, "{at_rest} static points do not have the spacing of the markers")
            }
            LaneError::NotGiven { what } => write!(f, "the method needs {what}, and there is none"),
            LaneError::Refused { why } => write!(f, "{why}"),
            LaneError::NoLaneLine => write!(f, "the image shows no line that can belong to a lane"),
            LaneError::Missing { what } => write!(f, "no {what} given"),
            LaneError::NotANumber { what, index: Some(i) } => write!(f, "{what} {i} is not a finite number"),
            LaneError::NotANumber { what, index: None } => write!(f, "{what} is not a finite number"),
            LaneError::OutOfRange { what, value, allowed } => {
                write!(f, "{what} is {value}; allowed: {allowed}")
            }
            LaneError::Setting { name } => write!(f, "the setting {name} is out of range"),
            LaneError::Lengths { what, found, expected } => {
                write!(f, "{what}: {found} values where {expected} are expected")
            }
            LaneError::TooFew { what, found, needed } => {
                write!(f, "{found} {what} are too few; at least {needed} are needed")
            }
            LaneError::Undetermined { what } => write!(f, "the data do not determine {what}"),
            LaneError::Unexplained { best, explained, of, what } => {
                write!(f, "the best {best} explains {explained:.1} of {of} {what}, fewer than half")
            }
        }
    }
}

impl std::error::Error for LaneError {}

/// A result with the error of this crate.
pub type Result<T> = std::result::Result<T, LaneError>;

/// Returns the value itself when it is finite and `ok` holds.
pub(crate) fn checked(what: &'static str, value: f64, ok: bool, allowed: &str) -> Result<f64> {
    match (value.is_finite(), ok) {
        (false, _) => Err(LaneError::not_finite(what)),
        (true, false) => Err(LaneError::out_of_range(what, value, allowed)),
        (true, true) => Ok(value),
    }
}

/// Returns the value itself when it is finite and within a range, whose ends the error names.
pub(crate) fn within(what: &'static str, value: f64, allowed: RangeInclusive<f64>) -> Result<f64> {
    let words = format!("{} to {}", allowed.start(), allowed.end());
    checked(what, value, allowed.contains(&value), &words)
}

pub(crate) fn finite(what: &'static str, value: f64) -> Result<f64> {
    checked(what, value, true, "")
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64> {
    checked(what, value, value > 0.0, "above 0")
}

pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<f64> {
    checked(what, value, value >= 0.0, "0 or more")
}

/// Refuses an empty list and a list with a non-finite value.
pub(crate) fn all_finite(what: &'static str, values: &[f64]) -> Result<()> {
    if values.is_empty() {
        return Err(LaneError::Missing { what });
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(LaneError::NotANumber { what, index: Some(i) }),
        None => Ok(()),
    }
}

/// Returns an error for the first setting, by name, that breaks its rule.
pub(crate) fn settings(rules: &[(&'static str, bool)]) -> Result<()> {
    match rules.iter().find(|r| !r.1) {
        Some((name, _)) => Err(LaneError::Setting { name }),
        None => Ok(()),
    }
}
