//! Why there is no lane, and the checks that say so: one error for all methods and their parts.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::RangeInclusive;

/// Serde takes a field of type `&'static str` for one that borrows from the file, also in variants that it skips.
type Text = &'static str;

/// Why no lane is stated, or why a method or a part of one refuses its input. `Display` gives one plain sentence.
///
/// In files an estimate without a lane holds the first seven; the others become [`LaneError::Refused`] there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "reason")]
pub enum LaneError {
    /// The scan is empty.
    Empty,
    /// So many points were not finite, and nothing was left.
    NotFinite { points: usize },
    /// The vehicle's speed is not known, and nothing tells what moves.
    NoSpeed,
    /// Nothing stands still.
    NothingAtRest,
    /// Points at rest, but not in the markers' pattern.
    NoPattern { at_rest: usize },
    /// The method needs what the input does not hold.
    NotGiven { what: String },
    /// The method's own reason.
    Refused { why: String },
    /// The image shows no line that can be a lane's.
    #[serde(skip)]
    NoLaneLine,
    /// An empty list.
    #[serde(skip)]
    Missing { what: Text },
    /// A value is NaN or infinite; with its place in a list.
    #[serde(skip)]
    NotANumber { what: Text, index: Option<usize> },
    #[serde(skip)]
    OutOfRange { what: Text, value: f64, allowed: String },
    /// A setting lies outside its range, or contradicts another.
    #[serde(skip)]
    Setting { name: Text },
    /// Two lists that belong together differ in length.
    #[serde(skip)]
    Lengths { what: Text, found: usize, expected: usize },
    #[serde(skip)]
    TooFew { what: Text, found: usize, needed: usize },
    /// The data do not determine the result.
    #[serde(skip)]
    Undetermined { what: Text },
    /// The best answer explains fewer than half of the data.
    #[serde(skip)]
    Unexplained { best: Text, explained: f64, of: usize, what: Text },
}

impl LaneError {
    /// A reason of a method's own, as one sentence.
    pub fn refused(why: impl fmt::Display) -> LaneError {
        LaneError::Refused { why: why.to_string() }
    }

    pub fn not_finite(what: &'static str) -> LaneError {
        LaneError::NotANumber { what, index: None }
    }

    pub fn out_of_range(what: &'static str, value: f64, allowed: &str) -> LaneError {
        LaneError::OutOfRange { what, value, allowed: allowed.into() }
    }

    pub fn too_few(what: &'static str, found: usize, needed: usize) -> LaneError {
        LaneError::TooFew { what, found, needed }
    }

    pub fn too_large(places: usize, most: usize) -> LaneError {
        LaneError::refused(format!("the search has {places} places and one call takes at most {most}"))
    }

    pub fn undetermined(what: &'static str) -> LaneError {
        LaneError::Undetermined { what }
    }

    /// As an estimate states it.
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
            LaneError::NotFinite { points } => write!(f, "none of {points} points is a finite number"),
            LaneError::NoSpeed => write!(f, "the vehicle's speed is not known"),
            LaneError::NothingAtRest => write!(f, "no point stands still"),
            LaneError::NoPattern { at_rest } => {
                write!(f, "{at_rest} points at rest do not stand at the markers' spacing")
            }
            LaneError::NotGiven { what } => write!(f, "the method needs {what}, and there is none"),
            LaneError::Refused { why } => write!(f, "{why}"),
            LaneError::NoLaneLine => write!(f, "the image shows no line that can be a lane's"),
            LaneError::Missing { what } => write!(f, "no {what} given"),
            LaneError::NotANumber { what, index: Some(i) } => write!(f, "{what} {i} is not a finite number"),
            LaneError::NotANumber { what, index: None } => write!(f, "{what} is not a finite number"),
            LaneError::OutOfRange { what, value, allowed } => {
                write!(f, "{what} is {value}; allowed: {allowed}")
            }
            LaneError::Setting { name } => write!(f, "the setting {name} lies outside its range"),
            LaneError::Lengths { what, found, expected } => {
                write!(f, "{what}: {found} values where {expected} are expected")
            }
            LaneError::TooFew { what, found, needed } => {
                write!(f, "{found} {what} are too few; at least {needed} are needed")
            }
            LaneError::Undetermined { what } => write!(f, "the data leave open {what}"),
            LaneError::Unexplained { best, explained, of, what } => {
                write!(f, "the best {best} explains {explained:.1} of {of} {what}, fewer than half")
            }
        }
    }
}

impl std::error::Error for LaneError {}

pub type Result<T> = std::result::Result<T, LaneError>;

/// The value itself when it is finite and `ok` holds.
pub(crate) fn checked(what: &'static str, value: f64, ok: bool, allowed: &str) -> Result<f64> {
    match (value.is_finite(), ok) {
        (false, _) => Err(LaneError::not_finite(what)),
        (true, false) => Err(LaneError::out_of_range(what, value, allowed)),
        (true, true) => Ok(value),
    }
}

/// The value itself when it is finite and within a range, whose ends the error names.
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

/// Refuses an empty list and a list with a value that is not finite.
pub(crate) fn all_finite(what: &'static str, values: &[f64]) -> Result<()> {
    if values.is_empty() {
        return Err(LaneError::Missing { what });
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(LaneError::NotANumber { what, index: Some(i) }),
        None => Ok(()),
    }
}

/// The first setting, by name, that breaks its rule.
pub(crate) fn settings(rules: &[(&'static str, bool)]) -> Result<()> {
    match rules.iter().find(|r| !r.1) {
        Some((name, _)) => Err(LaneError::Setting { name }),
        None => Ok(()),
    }
}
