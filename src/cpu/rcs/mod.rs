//! Radar cross sections in f64.

pub mod po_sum;
pub mod ptd;
