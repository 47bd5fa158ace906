//! Fourier transforms of any length, and dense complex matrices of a few to some hundred rows with the
//! decompositions that estimators of angle take.
//!
//! The algorithms of rustfft and nalgebra are generic: whoever calls them compiles them, for a minute. This crate
//! calls them for the types in use, so that the crates above compile none of it. No type of nalgebra stands in a
//! signature, and plans of rustfft are trait objects.
//!
//! Everything runs on the calling thread, in a fixed order: the same input gives the same bytes.
#![forbid(unsafe_code)]

mod decompose;
pub mod fft;
mod matrix;
mod real;

pub use matrix::Matrix;
pub use real::Real;

/// An iteration did not settle: the matrix holds values that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoConvergence;

impl std::fmt::Display for NoConvergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the decomposition does not converge")
    }
}

impl std::error::Error for NoConvergence {}
