//! Isotropic point scatterer that keeps the polarisation, at the origin.

use super::kind::{Built, Kind, number};

/// The point in the registry.
pub static KIND: Kind = Kind {
    name: "point",
    summary: "isotropic point scatterer",
    pose: "at the origin",
    params: &[number("rcs_dbsm", 0.0, -200.0, 200.0, "radar cross section, equal in all directions")],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build: |v| Ok(Built::Point { rcs_dbsm: v.number("rcs_dbsm") }),
};
