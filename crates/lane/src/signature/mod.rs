//! The static points of a road as a signature: a map to find one's place in, and words written in its
//! markers.
//!
//! Document F, sections 4.3.2 and 4.3.4. [`map`] gathers the static points of a drive with known poses;
//! [`locate`] finds a later scan in it without GNSS, with covariance and with the other places that fit
//! about as well; [`words`] writes code words into the gaps or the sides of a marker row and reads them with
//! markers missing and points too many.
//!
//! The document names the tasks and gives no formulas: the methods are this project's. Metres, radians,
//! ISO 8855 axes.

use serde::{Deserialize, Serialize};
use std::fmt;

pub mod estimator;
pub mod locate;
pub mod map;
pub mod row;
pub mod words;

/// Why there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// A setting lies outside its range.
    Setting(&'static str),
    /// A pose, velocity or its standard deviation is not finite.
    BadPose,
    TooFewPoints {
        points: usize,
        needed: usize,
    },
    EmptyMap,
    /// The map or the search is too large for one call.
    TooLarge {
        places: usize,
        most: usize,
    },
    /// The best place explains fewer than half of the points.
    NoPlace {
        explained: f64,
        points: usize,
    },
    /// No word explains half of the points.
    NoWord {
        matched: usize,
        points: usize,
    },
    /// A message has more bits than the code carries, or no such value.
    BadMessage,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Setting(name) => write!(f, "the setting {name} lies outside its range"),
            Self::BadPose => write!(f, "a pose, velocity or its standard deviation is not finite"),
            Self::TooFewPoints { points, needed } => {
                write!(f, "{needed} usable points are needed and there are {points}")
            }
            Self::EmptyMap => write!(f, "the map holds no landmarks that are trusted"),
            Self::TooLarge { places, most } => {
                write!(f, "the search has {places} places and one call takes at most {most}")
            }
            Self::NoPlace { explained, points } => {
                write!(f, "the best place explains {explained:.1} of {points} points, fewer than half")
            }
            Self::NoWord { matched, points } => {
                write!(f, "the best word explains {matched} of {points} points, fewer than half")
            }
            Self::BadMessage => write!(f, "the message does not fit the code"),
        }
    }
}

impl std::error::Error for Refusal {}
