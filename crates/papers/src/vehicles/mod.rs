//! The scatter of cross sections and of the places that return them, over many vehicles and people of the library and all directions,
//! beside published statistics (`catseye validate --vehicles`).
//!
//! [`look`] simulates one frame of one body and takes its levels and places, [`numbers`] describes lists of levels, [`published`] holds
//! the laws with their sources, [`scatter`] puts both side by side, and [`report`] writes the tables and the picture.

pub mod look;
pub mod numbers;
pub mod published;
pub mod report;
pub mod scatter;
