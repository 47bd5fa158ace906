//! Compares catseye's results with the documents: drives of their lane methods, their studies and figures,
//! the comparison of all methods, the gates that a build has to pass, and the workloads that measure its
//! speed.
#![deny(unsafe_code)]

pub mod bench;
pub mod comparison;
pub mod measured;
pub mod study;
pub mod trial;
pub mod validate;
pub mod vehicles;
