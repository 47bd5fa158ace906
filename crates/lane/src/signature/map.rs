//! A map of static points, collected along a drive with known poses.
//!
//! Each landmark is a Gaussian position with log odds of its existence (occupancy grids: Moravec and Elfes
//! 1985, here on points in place of cells). A hit raises the log odds, and a scan that should have seen the
//! landmark and did not lowers them, so that what was seen once fades. Feng, section 4.3.2.

use crate::Measured;
use crate::error::{self, LaneError};
use crate::numeric::{outer, wrapped};
use crate::standing::StandingGate;
use glam::{DMat2, DVec2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Pose of the radar in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position along the world's x axis, m.
    pub x_m: f64,
    /// Position along the world's y axis, m.
    pub y_m: f64,
    /// Direction from the world's x axis, rad, positive to the left.
    pub heading_rad: f64,
}

/// A point of a scan as seen from the radar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScanPoint {
    /// Range, m.
    pub range_m: f64,
    /// Azimuth from the radar's boresight, rad, positive left.
    pub azimuth_rad: f64,
    /// Standard deviation of the range, m.
    pub range_std_m: f64,
    /// Standard deviation of the azimuth, rad.
    pub azimuth_std_rad: f64,
    /// Range rate with its standard deviation, m/s; points without one are taken as static.
    pub range_rate_mps: Option<[f64; 2]>,
}

/// Velocity of the radar over ground in its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Velocity {
    /// Velocity along the boresight, m/s.
    pub forward_mps: f64,
    /// Velocity to the left, m/s.
    pub left_mps: f64,
}

/// Settings of a [`SignatureMap`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MapSettings {
    /// Least range of points that are used, m.
    pub near_m: f64,
    /// Largest range of points that are used, m.
    pub far_m: f64,
    /// Half the field of view about the radar's boresight, rad.
    pub half_view_rad: f64,
    /// Largest standard deviation of the position of points that are used, m.
    pub max_std_m: f64,
    /// Standard deviation that is added to every point, m: what does not average out (calibration, speckle of
    /// a body).
    pub floor_std_m: f64,
    /// Largest squared Mahalanobis distance at which a point counts as a known landmark.
    pub gate_chi2: f64,
    /// Largest deviation of a static point's range rate, in standard deviations.
    pub static_sigmas: f64,
    /// Amount that a hit adds to a landmark's log odds.
    pub hit_log_odds: f64,
    /// Amount that a miss adds to a landmark's log odds, 0 or less.
    pub miss_log_odds: f64,
    /// Largest magnitude of log odds.
    pub most_log_odds: f64,
}

impl Default for MapSettings {
    fn default() -> Self {
        Self {
            near_m: 0.5,
            far_m: 40.0,
            half_view_rad: 1.0,
            max_std_m: 0.5,
            floor_std_m: 0.03,
            gate_chi2: 13.8,
            static_sigmas: 4.0,
            hit_log_odds: 0.85,
            miss_log_odds: -0.6,
            most_log_odds: 4.0,
        }
    }
}

/// A static point of the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Position in the world, m.
    pub position_m: [f64; 2],
    /// Covariance of the position: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// Number of scans that saw it.
    pub hits: u32,
    /// Log odds that it exists.
    pub log_odds: f64,
}

impl Landmark {
    /// Probability that it exists, 0 to 1.
    pub fn occupancy(&self) -> f64 {
        1.0 / (1.0 + (-self.log_odds).exp())
    }

    pub(super) fn place(&self) -> DVec2 {
        DVec2::from_array(self.position_m)
    }

    pub(super) fn covariance(&self) -> DMat2 {
        let [xx, xy, yy] = self.covariance_m2;
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }

    /// Moves to the mean of both positions, weighted by their covariances.
    fn take_in(&mut self, place: DVec2, covariance: DMat2) {
        let own = self.covariance();
        let gain = own * (own + covariance).inverse();
        let c = own - gain * own;
        self.position_m = (self.place() + gain * (place - self.place())).to_array();
        self.covariance_m2 = [c.x_axis.x, 0.5 * (c.x_axis.y + c.y_axis.x), c.y_axis.y];
    }
}

/// Counts of what became of the points of a scan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScanCount {
    /// Number of points that are landmarks seen again.
    pub merged: usize,
    /// Number of points that began landmarks.
    pub new: usize,
    /// Number of moving points.
    pub moving: usize,
    /// Number of points that are non-finite, out of range or view, or too uncertain in position.
    pub unusable: usize,
    /// Number of landmarks in view that the scan did not see.
    pub missed: usize,
}

/// Landmarks grouped by square.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Index(BTreeMap<(i32, i32), Vec<usize>>);

const SQUARE_M: f64 = 2.0;

fn square(p: DVec2) -> (i32, i32) {
    let q = (p / SQUARE_M).floor();
    // `as` saturates: positions beyond the planet share a square.
    (q.x as i32, q.y as i32)
}

impl Index {
    pub(super) fn new(landmarks: &[Landmark]) -> Self {
        let mut out = Self::default();
        for (i, l) in landmarks.iter().enumerate() {
            out.add(i, l.place());
        }
        out
    }

    fn add(&mut self, i: usize, p: DVec2) {
        self.0.entry(square(p)).or_default().push(i);
    }

    fn shift(&mut self, i: usize, from: DVec2, to: DVec2) {
        let (a, b) = (square(from), square(to));
        if a != b {
            if let Some(list) = self.0.get_mut(&a) {
                list.retain(|j| *j != i);
            }
            self.0.entry(b).or_default().push(i);
        }
    }

    /// Calls `each` for all within `radius_m`, and some farther.
    pub(super) fn near(&self, p: DVec2, radius_m: f64, mut each: impl FnMut(usize)) {
        let (low, high) = (square(p - radius_m), square(p + radius_m));
        for x in low.0..=high.0 {
            for (_, list) in self.0.range((x, low.1)..=(x, high.1)) {
                list.iter().for_each(|i| each(*i));
            }
        }
    }
}

/// Landmarks together with the poses of the drive along which they were collected.
#[derive(Debug, Clone, PartialEq)]
pub struct SignatureMap {
    settings: MapSettings,
    landmarks: Vec<Landmark>,
    route: Vec<Pose>,
    index: Index,
}

impl Pose {
    pub(super) fn is_finite(&self) -> bool {
        [self.x_m, self.y_m, self.heading_rad].iter().all(|x| x.is_finite() && x.abs() < 1e9)
    }

    pub(super) fn place(&self) -> DVec2 {
        DVec2::new(self.x_m, self.y_m)
    }
}

impl ScanPoint {
    /// Position in the radar's axes and its covariance; None for a point that cannot be used.
    pub(super) fn place(&self, floor_std_m: f64) -> Option<(DVec2, DMat2)> {
        let stds = [self.range_std_m, self.azimuth_std_rad];
        let good = self.range_m.is_finite()
            && self.range_m > 0.0
            && self.azimuth_rad.is_finite()
            && stds.iter().all(|s| s.is_finite() && *s > 0.0);
        if !good {
            return None;
        }
        let u = DVec2::from_angle(self.azimuth_rad);
        let across = self.range_m * self.azimuth_std_rad;
        let cov = outer(u) * self.range_std_m.powi(2)
            + outer(u.perp()) * across.powi(2)
            + DMat2::IDENTITY * floor_std_m.powi(2);
        Some((self.range_m * u, cov))
    }

    fn moves(&self, v: &Velocity, sigmas: f64) -> bool {
        let Some([value, std]) = self.range_rate_mps else { return false };
        let velocity_mps = DVec2::new(v.forward_mps, v.left_mps);
        let gate = StandingGate { velocity_mps, sigmas, ..StandingGate::default() };
        !std.is_finite() || !gate.passes(self.azimuth_rad, self.azimuth_std_rad, Measured { value, std })
    }
}

impl MapSettings {
    fn check(&self) -> Result<(), LaneError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let rules: [(&'static str, bool); 10] = [
            ("near_m", self.near_m.is_finite() && self.near_m >= 0.0),
            ("far_m", positive(self.far_m) && self.far_m > self.near_m),
            ("half_view_rad", positive(self.half_view_rad) && self.half_view_rad <= std::f64::consts::PI),
            ("max_std_m", positive(self.max_std_m) && self.max_std_m <= 10.0),
            ("floor_std_m", self.floor_std_m.is_finite() && self.floor_std_m >= 0.0),
            ("gate_chi2", positive(self.gate_chi2) && self.gate_chi2 <= 100.0),
            ("static_sigmas", positive(self.static_sigmas)),
            ("hit_log_odds", positive(self.hit_log_odds)),
            ("miss_log_odds", self.miss_log_odds.is_finite() && self.miss_log_odds <= 0.0),
            ("most_log_odds", positive(self.most_log_odds)),
        ];
        error::settings(&rules)
    }
}

impl SignatureMap {
    /// Makes an empty map.
    ///
    /// # Errors
    /// Returns an error for a setting outside its range.
    pub fn new(settings: MapSettings) -> Result<Self, LaneError> {
        settings.check()?;
        Ok(Self { settings, landmarks: Vec::new(), route: Vec::new(), index: Index::default() })
    }

    /// Makes a map from stored landmarks and poses.
    ///
    /// # Errors
    /// Returns an error for a setting outside its range, for a landmark whose values are non-finite or whose
    /// covariance is not positive definite, or for a non-finite pose.
    pub fn from_parts(
        settings: MapSettings,
        landmarks: Vec<Landmark>,
        route: Vec<Pose>,
    ) -> Result<Self, LaneError> {
        settings.check()?;
        let is_good = |l: &Landmark| {
            let all = l.position_m.iter().chain(&l.covariance_m2).chain([&l.log_odds]);
            all.copied().all(f64::is_finite) && l.covariance().determinant() > 0.0 && l.covariance_m2[0] > 0.0
        };
        if !landmarks.iter().all(is_good) || !route.iter().all(Pose::is_finite) {
            return Err(bad_pose());
        }
        let index = Index::new(&landmarks);
        Ok(Self { settings, landmarks, route, index })
    }

    /// The landmarks, in the order in which they were first seen.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// The poses of the drive, in order.
    pub fn route(&self) -> &[Pose] {
        &self.route
    }

    /// The settings that the map was made with.
    pub fn settings(&self) -> &MapSettings {
        &self.settings
    }

    /// Adds the static points of a scan. `pose_std` holds the standard deviations of the pose in x, y (m) and
    /// heading (rad). Without a velocity every point is taken as static.
    ///
    /// # Errors
    /// Returns an error if the pose or the velocity is non-finite, or a standard deviation of the pose is
    /// non-finite or negative. Non-finite points are counted as unusable.
    pub fn add_scan(
        &mut self,
        pose: Pose,
        pose_std: [f64; 3],
        velocity: Option<Velocity>,
        points: &[ScanPoint],
    ) -> Result<ScanCount, LaneError> {
        let stds_good = pose_std.iter().all(|s| s.is_finite() && *s >= 0.0);
        let velocity_good = velocity.is_none_or(|v| v.forward_mps.is_finite() && v.left_mps.is_finite());
        if !pose.is_finite() || !stds_good || !velocity_good {
            return Err(bad_pose());
        }
        let s = self.settings;
        let mut count = ScanCount::default();
        let turn = DMat2::from_angle(pose.heading_rad);
        let mut seen: Vec<(DVec2, DMat2)> = Vec::new();
        for p in points {
            let Some((place, cov)) = p.place(s.floor_std_m).filter(|_| {
                p.range_m >= s.near_m
                    && p.range_m <= s.far_m
                    && wrapped(p.azimuth_rad).abs() <= s.half_view_rad
            }) else {
                count.unusable += 1;
                continue;
            };
            if velocity.is_some_and(|v| p.moves(&v, s.static_sigmas)) {
                count.moving += 1;
                continue;
            }
            let out = turn * place;
            let cov = turn * cov * turn.transpose()
                + DMat2::from_diagonal(DVec2::new(pose_std[0].powi(2), pose_std[1].powi(2)))
                + outer(out.perp()) * pose_std[2].powi(2);
            if largest_std_m(&cov) > s.max_std_m {
                count.unusable += 1;
                continue;
            }
            seen.push((pose.place() + out, cov));
        }
        // Nearest pairs first; a landmark takes one point of a scan.
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (i, (place, cov)) in seen.iter().enumerate() {
            let radius = s.gate_chi2.sqrt() * (largest_std_m(cov) + s.max_std_m);
            self.index.near(*place, radius, |j| {
                let l = &self.landmarks[j];
                let d = *place - l.place();
                let chi2 = d.dot((*cov + l.covariance()).inverse() * d);
                if chi2 <= s.gate_chi2 {
                    pairs.push((chi2, i, j));
                }
            });
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let old = self.landmarks.len();
        let mut landmark_seen = vec![false; old];
        let mut point_used = vec![false; seen.len()];
        for (_, i, j) in pairs {
            if point_used[i] || landmark_seen[j] {
                continue;
            }
            (point_used[i], landmark_seen[j]) = (true, true);
            let (place, cov) = seen[i];
            let l = &mut self.landmarks[j];
            let before = l.place();
            l.take_in(place, cov);
            l.hits = l.hits.saturating_add(1);
            l.log_odds = (l.log_odds + s.hit_log_odds).min(s.most_log_odds);
            self.index.shift(j, before, l.place());
            count.merged += 1;
        }
        // Landmarks in view that were not seen fade.
        let mut missed = Vec::new();
        self.index.near(pose.place(), s.far_m, |j| {
            let d = turn.transpose() * (self.landmarks[j].place() - pose.place());
            let in_view =
                d.length() >= s.near_m && d.length() <= s.far_m && d.to_angle().abs() <= s.half_view_rad;
            if in_view && !landmark_seen[j] {
                missed.push(j);
            }
        });
        for j in missed {
            let l = &mut self.landmarks[j];
            l.log_odds = (l.log_odds + s.miss_log_odds).max(-s.most_log_odds);
            count.missed += 1;
        }
        for (i, (place, cov)) in seen.iter().enumerate() {
            if !point_used[i] {
                self.index.add(self.landmarks.len(), *place);
                self.landmarks.push(Landmark {
                    position_m: place.to_array(),
                    covariance_m2: [cov.x_axis.x, cov.x_axis.y, cov.y_axis.y],
                    hits: 1,
                    log_odds: s.hit_log_odds,
                });
                count.new += 1;
            }
        }
        self.route.push(pose);
        Ok(count)
    }

    /// Merges landmarks that lie within each other's gate (an outlier has begun a second one), then removes
    /// those with fewer than `least_hits` hits or an occupancy (0 to 1) below `least_occupancy`.
    pub fn prune(&mut self, least_hits: u32, least_occupancy: f64) {
        let mut order: Vec<usize> = (0..self.landmarks.len()).collect();
        order.sort_by_key(|i| std::cmp::Reverse(self.landmarks[*i].hits));
        let mut gone = vec![false; order.len()];
        for i in order {
            if gone[i] {
                continue;
            }
            let mut close = Vec::new();
            let radius = self.settings.gate_chi2.sqrt() * 2.0 * self.settings.max_std_m;
            self.index.near(self.landmarks[i].place(), radius, |j| close.push(j));
            for j in close {
                let (a, b) = (self.landmarks[i], self.landmarks[j]);
                let d = b.place() - a.place();
                let sum = a.covariance() + b.covariance();
                if i == j || gone[j] || d.dot(sum.inverse() * d) > self.settings.gate_chi2 {
                    continue;
                }
                let joined = &mut self.landmarks[i];
                joined.take_in(b.place(), b.covariance());
                joined.hits = a.hits.saturating_add(b.hits);
                joined.log_odds = a.log_odds.max(b.log_odds);
                gone[j] = true;
            }
        }
        let mut keep = gone.iter().map(|g| !g);
        self.landmarks.retain(|_| keep.next().unwrap_or(true));
        self.landmarks.retain(|l| l.hits >= least_hits && l.occupancy() >= least_occupancy);
        self.index = Index::new(&self.landmarks);
    }
}

pub(super) fn bad_pose() -> LaneError {
    LaneError::refused("a pose, velocity or its standard deviation is not finite")
}

pub(super) fn largest_std_m(c: &DMat2) -> f64 {
    let (mean, half) = (0.5 * (c.x_axis.x + c.y_axis.y), 0.5 * (c.x_axis.x - c.y_axis.y));
    (mean + (half * half + c.x_axis.y * c.y_axis.x).max(0.0).sqrt()).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::rng::Draws;

    fn point(from: &Pose, at: DVec2, d: &mut Draws, noise: f64) -> ScanPoint {
        let v = DVec2::from_angle(-from.heading_rad).rotate(at - from.place());
        ScanPoint {
            range_m: v.length() + 0.1 * noise * d.normal(),
            azimuth_rad: v.to_angle() + 0.01 * noise * d.normal(),
            range_std_m: 0.1,
            azimuth_std_rad: 0.01,
            range_rate_mps: None,
        }
    }

    fn pose(x_m: f64) -> Pose {
        Pose { x_m, y_m: 0.0, heading_rad: 0.0 }
    }

    #[test]
    fn a_landmark_seen_often_is_sharp_and_unbiased() {
        let mut d = Draws::new(3, 1);
        let truth = DVec2::new(20.0, 1.5);
        let mut chi2 = 0.0;
        for _ in 0..100 {
            let mut map = SignatureMap::new(MapSettings { floor_std_m: 0.0, ..Default::default() }).unwrap();
            for i in 0..20 {
                let from = pose(0.5 * f64::from(i));
                let p = point(&from, truth, &mut d, 1.0);
                map.add_scan(from, [0.0; 3], None, &[p]).unwrap();
            }
            map.prune(10, 0.5);
            assert_eq!(map.landmarks().len(), 1);
            let e = map.landmarks()[0].place() - truth;
            assert!(largest_std_m(&map.landmarks()[0].covariance()) < 0.06);
            chi2 += e.dot(map.landmarks()[0].covariance().inverse() * e);
        }
        // Mean of 100 draws of chi² with 2 degrees: 2 ± 4·0.2. The gate takes the worst 1 % away.
        assert!((1.2..2.8).contains(&(chi2 / 100.0)), "{}", chi2 / 100.0);
    }

    #[test]
    fn what_moves_stays_out_and_ghosts_fade() {
        let mut map = SignatureMap::new(MapSettings::default()).unwrap();
        let v = Velocity { forward_mps: 10.0, left_mps: 0.0 };
        let still = ScanPoint {
            range_m: 20.0,
            azimuth_rad: 0.3,
            range_std_m: 0.1,
            azimuth_std_rad: 0.01,
            range_rate_mps: Some([-10.0 * 0.3f64.cos(), 0.05]),
        };
        let car = ScanPoint { azimuth_rad: -0.1, range_rate_mps: Some([-3.0, 0.05]), ..still };
        let odd = ScanPoint { azimuth_rad: 0.1, range_rate_mps: Some([f64::NAN, 0.05]), ..still };
        let c = map.add_scan(pose(0.0), [0.0; 3], Some(v), &[still, car, odd]).unwrap();
        assert_eq!((c.new, c.moving), (1, 2));
        for _ in 0..5 {
            map.add_scan(pose(0.0), [0.0; 3], Some(v), &[]).unwrap();
        }
        assert!(map.landmarks()[0].occupancy() < 0.2);
        map.prune(1, 0.5);
        assert!(map.landmarks().is_empty());
    }

    #[test]
    fn hostile_input() {
        let mut map = SignatureMap::new(MapSettings::default()).unwrap();
        let bad = ScanPoint {
            range_m: f64::NAN,
            azimuth_rad: 0.0,
            range_std_m: 0.1,
            azimuth_std_rad: 0.01,
            range_rate_mps: None,
        };
        let infinite = ScanPoint { range_m: f64::INFINITY, ..bad };
        let unsure = ScanPoint { range_m: 5.0, range_std_m: 0.0, ..bad };
        let c = map.add_scan(pose(0.0), [0.0; 3], None, &[bad, infinite, unsure]).unwrap();
        assert_eq!((c.unusable, c.new), (3, 0));
        assert_eq!(map.add_scan(pose(f64::NAN), [0.0; 3], None, &[]), Err(bad_pose()));
        assert_eq!(map.add_scan(pose(0.0), [-1.0, 0.0, 0.0], None, &[]), Err(bad_pose()));
        assert!(SignatureMap::new(MapSettings { far_m: 0.1, ..Default::default() }).is_err());
    }
}
