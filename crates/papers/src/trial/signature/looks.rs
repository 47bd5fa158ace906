//! Places and words found, beside the true ones.

use crate::trial::kit::*;
use crate::trial::signature::settings::RowTable;
use catseye_lane::signature::codewords::Reading;
use catseye_lane::signature::estimator::MapPosition;
use catseye_lane::signature::map::Pose;
use catseye_lane::signature::row::Picked;
use glam::DMat3;

/// Standard deviations along and across the vehicle.
pub fn stds(p: &MapPosition) -> [f64; 2] {
    let c = &p.covariance;
    [0.0, 0.5 * std::f64::consts::PI].map(|turn| {
        let u = DVec2::from_angle(p.vehicle.heading_rad + turn);
        (u.x * u.x * c[0][0] + 2.0 * u.x * u.y * c[0][1] + u.y * u.y * c[1][1]).max(0.0).sqrt()
    })
}

/// A look that was located, beside the truth.
#[derive(Debug, Clone)]
pub struct Located {
    pub run: u32,
    pub time_s: f64,
    /// Along the truth's way from its beginning, m.
    pub way_m: f64,
    pub truth: Pose,
    pub place: Option<MapPosition>,
    /// Along, across (m), heading (rad).
    pub error: Option<[f64; 3]>,
    /// Squared error over its covariance, 3 on the mean.
    pub nees: Option<f64>,
}

pub fn compared(truth: &Pose, place: &MapPosition) -> ([f64; 3], Option<f64>) {
    let v = &place.vehicle;
    let turn = (v.heading_rad - truth.heading_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
        - std::f64::consts::PI;
    let off = DVec2::new(v.x_m - truth.x_m, v.y_m - truth.y_m);
    let local = DVec2::from_angle(-truth.heading_rad).rotate(off);
    let e = DVec3::new(off.x, off.y, turn);
    let nees = e.dot(DMat3::from_cols_array_2d(&place.covariance).inverse() * e);
    ([local.x, local.y, turn], nees.is_finite().then_some(nees))
}

/// How points were taken away and added before a word was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worse {
    No,
    /// In the row as gathered over all looks: markers that are gone, things that stand there.
    Row,
    /// In each look by itself, before it is gathered: echoes under the noise, false alarms.
    Looks,
}

/// A word read, beside the one that is written.
#[derive(Debug, Clone)]
pub struct WordRead {
    pub run: u32,
    pub frame: u32,
    pub row: usize,
    pub worse: Worse,
    pub points: usize,
    pub reading: Option<Reading>,
    pub right: Option<bool>,
}

/// A row as read last, for its picture.
pub struct RowPicture {
    pub table: RowTable,
    pub picked: Picked,
    pub reading: Reading,
}
