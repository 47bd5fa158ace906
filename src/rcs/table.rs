//! The RCS table and its CSV.
