//! Room: rcs.

pub mod closed_form;
