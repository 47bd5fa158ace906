//! Dense complex matrices of a few to some hundred rows, with the decompositions that estimators of
//! angle take.
//!
//! faer's algorithms are generic: whoever calls them compiles them. This crate calls them for one type
//! and offers functions without type parameters, so that the crates above compile none of it. No type
//! of faer stands in a signature.
//!
//! Everything runs on the calling thread, in a fixed order: the same input gives the same bytes.
#![forbid(unsafe_code)]

mod decompose;
mod matrix;

pub use matrix::Matrix;

/// An iteration did not settle: the matrix holds values that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoConvergence;

impl std::fmt::Display for NoConvergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the decomposition does not converge")
    }
}

impl std::error::Error for NoConvergence {}
