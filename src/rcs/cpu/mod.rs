//! Radar cross sections in f64.

pub mod beam_sum;
pub mod po_sum;
pub mod ptd;
pub mod refract_sum;
