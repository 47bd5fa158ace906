//! The static points of a road as a signature: a map to find one's place in, and words written in its
//! markers.
//!
//! Feng, sections 4.3.2 and 4.3.4. [`map`] gathers the static points of a drive with known poses;
//! [`locate`] finds a later scan in it without GNSS, with covariance and with the other places that fit
//! about as well; [`codewords`] writes code words into the gaps or the sides of a marker row and reads them with
//! markers missing and points too many.
//!
//! The document names the tasks and gives no formulas: the methods are this project's. Metres, radians,
//! ISO 8855 axes.

pub mod codewords;
pub mod estimator;
pub mod locate;
pub mod map;
pub mod row;
