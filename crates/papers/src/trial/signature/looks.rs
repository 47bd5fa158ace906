//! Positions and words found, with the true ones.

use crate::trial::kit::*;
use crate::trial::signature::settings::RowTable;
use catseye_lane::signature::codewords::Reading;
use catseye_lane::signature::estimator::MapPosition;
use catseye_lane::signature::map::Pose;
use catseye_lane::signature::row::Picked;
use glam::DMat3;

/// Standard deviations of the position along and across the vehicle, m.
pub fn stds(p: &MapPosition) -> [f64; 2] {
    let c = &p.covariance;
    [0.0, 0.5 * std::f64::consts::PI].map(|turn| {
        let u = DVec2::from_angle(p.vehicle.heading_rad + turn);
        (u.x * u.x * c[0][0] + 2.0 * u.x * u.y * c[0][1] + u.y * u.y * c[1][1]).max(0.0).sqrt()
    })
}

/// A look that was located, with the truth.
#[derive(Debug, Clone)]
pub struct Located {
    pub run: u32,
    pub time_s: f64,
    /// Distance along the true path from its beginning, m.
    pub way_m: f64,
    pub truth: Pose,
    pub place: Option<MapPosition>,
    /// Errors along and across (m) and in heading (rad).
    pub error: Option<[f64; 3]>,
    /// Normalised squared error, 3 on average.
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

/// How points were removed and added before a word was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worse {
    No,
    /// In the row as collected over all looks: missing markers, and other things that stand there.
    Row,
    /// In each look separately, before it is collected: echoes below the noise, false alarms.
    Looks,
}

/// A word that was read, with the one that is written.
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
