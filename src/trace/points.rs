//! Echoes of point targets: no facets, so both engines take them from here.

use super::{MAX_BOUNCES, Return};
use crate::geom::Geometry;
use glam::DVec3;
use num_complex::Complex64;

/// Direct echoes of the point targets that nothing hides (S = sqrt(sigma / 4 pi) on both polarisations).
pub fn point_returns(
    geometry: &Geometry,
    origin: DVec3,
    radar_velocity: DVec3,
    to_sensor: glam::DQuat,
) -> Vec<Return> {
    geometry
        .points
        .iter()
        .filter_map(|p| {
            let d = p.position_m - origin;
            let r = d.length();
            if r <= geometry.t_min_m {
                return None;
            }
            let dir = d / r;
            if geometry.bvh.any_hit(&geometry.triangles, origin, dir, u32::MAX, r) {
                return None;
            }
            let s = (crate::units::power_from_db(p.rcs_dbsm) / (4.0 * std::f64::consts::PI)).sqrt() / (r * r);
            let mut ids = [0; MAX_BOUNCES];
            ids[0] = p.id;
            Some(Return {
                path_length_m: 2.0 * r,
                path_rate_mps: 2.0 * dir.dot(p.velocity_mps - radar_velocity),
                departure: to_sensor * dir,
                first_range_m: r,
                arrival: to_sensor * dir,
                last_range_m: r,
                spread: [[s.into(), Complex64::ZERO], [Complex64::ZERO, s.into()]],
                chain: ids,
                bounces: 1,
            })
        })
        .collect()
}
