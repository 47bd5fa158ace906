//! Studies: a quantity (radar cross section, least detectable cross section, detection range) over sweeps of
//! any parameter of reflector, ground, radar and road, compared with the facts of a document.
//!
//! A study file ([`file`](mod@file)) fixes some parameters and sweeps others. Each point of the sweeps becomes a
//! [`view::View`]; the cross sections that all of them need are solved in batches ([`solve`]), turned into
//! quantities ([`outcome`]), compared with the file's facts ([`fact`]) and reported ([`report`]).

// A complaint is made once in a run, and its caller says where in the file.
#![allow(clippy::result_large_err)]

pub mod fact;
pub mod file;
pub mod outcome;
pub mod parameter;
pub mod report;
pub mod run;
pub mod search;
pub mod sigma_min;
pub mod solve;
pub mod spec;
pub mod view;

pub use file::StudyFile;
pub use outcome::Outcome;
pub use spec::{Quantity, Study, StudySweep};
