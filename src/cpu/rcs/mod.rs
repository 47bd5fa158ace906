//! Radar cross sections in f64.

pub mod beam_sum;
pub mod po_sum;
