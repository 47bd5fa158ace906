//! The static points of a road as a signature: a map for localization, and codewords written in its markers.
//!
//! Feng, sections 4.3.2 and 4.3.4. [`map`] collects the static points of a drive with known poses. [`locate`]
//! finds a later scan in it without GNSS, with covariance and with the other poses that fit about as well.
//! [`codewords`] writes codewords into the gaps or the sides of a marker row and reads them despite missing
//! and extra points.
//!
//! The document names the tasks and gives no formulas: the methods are this project's. Units are metres and
//! radians, axes those of ISO 8855.

pub mod codewords;
pub mod estimator;
pub mod locate;
pub mod map;
pub mod options;
pub mod row;

pub use options::{MappedScan, SignatureOptions, from_json};
