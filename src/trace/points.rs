//! Echoes of point targets and of objects with a scattering table: no facets, so both engines take them from
//! here.

use super::{MAX_BOUNCES, Return};
use crate::frames::polarisation_basis;
use crate::geom::Geometry;
use glam::DVec3;
use num_complex::Complex64;

/// Direct echoes of the point targets (S = sqrt(sigma / 4 pi) on both polarisations) and of the scattering
/// tables whose origins nothing hides. They come from the origin, they do not bounce, and they hide
/// nothing.
pub fn point_returns(
    geometry: &Geometry,
    origin: DVec3,
    radar_velocity: DVec3,
    to_sensor: glam::DQuat,
) -> Vec<Return> {
    let echo = |id: u32, position: DVec3, velocity: DVec3, s: &dyn Fn(DVec3) -> [[Complex64; 2]; 2]| {
        let d = position - origin;
        let r = d.length();
        if r <= geometry.t_min_m {
            return None;
        }
        let dir = d / r;
        if geometry.bvh.any_hit(&geometry.triangles, origin, dir, u32::MAX, r) {
            return None;
        }
        let mut ids = [0; MAX_BOUNCES];
        ids[0] = id;
        Some(Return {
            path_length_m: 2.0 * r,
            path_rate_mps: 2.0 * dir.dot(velocity - radar_velocity),
            departure: to_sensor * dir,
            first_range_m: r,
            arrival: to_sensor * dir,
            last_range_m: r,
            spread: s(dir).map(|row| row.map(|z| z / (r * r))),
            chain: ids,
            bounces: 1,
        })
    };
    let points = geometry.points.iter().filter_map(|p| {
        let s = (crate::units::power_from_db(p.rcs_dbsm) / (4.0 * std::f64::consts::PI)).sqrt();
        let s = [[s.into(), Complex64::ZERO], [Complex64::ZERO, s.into()]];
        echo(p.id, p.position_m, p.velocity_mps, &|_| s)
    });
    let tables = geometry.tables.iter().filter_map(|t| {
        echo(t.id, t.position_m, t.velocity_mps, &|dir| {
            let (v, h) = polarisation_basis(to_sensor * dir);
            let to_world = to_sensor.inverse();
            t.scattering(&t.band, -dir, (to_world * v, to_world * h))
        })
    });
    points.chain(tables).collect()
}
