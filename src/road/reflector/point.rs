//! Isotropic point scatterer.

use super::{Built, Kind, number};

/// An isotropic scatterer at the origin that keeps the polarisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub rcs_dbsm: f64,
}

pub static KIND: Kind = Kind {
    name: "point",
    summary: "isotropic point scatterer",
    pose: "at the origin",
    params: &[number("rcs_dbsm", 0.0, -200.0, 200.0, "radar cross section from every direction")],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| Ok(Built::Point(Point { rcs_dbsm: v.number("rcs_dbsm") })),
};
