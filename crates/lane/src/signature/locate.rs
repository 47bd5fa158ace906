//! The pose of a scan in a map of static points, without GNSS.
//!
//! First comes a correlative search (Olson, "Real-time correlative scan matching", ICRA 2009): poses on a
//! grid along the mapped route or about a rough pose are scored in a picture of the landmarks. The best ones
//! are then refined by maximum likelihood, point to point: each point is one of the landmarks in view or none
//! of them, so a false point costs no more than a constant. Markers at equal distances fit again one spacing
//! farther: every pose that is about as likely is reported.

use super::map::{Landmark, Pose, ScanPoint, SignatureMap, bad_pose, largest_std_m};
use crate::error::{self, LaneError};
use crate::numeric::wrapped;
use glam::{DMat2, DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{SQRT_2, TAU};

/// Where poses are searched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Search {
    /// Anywhere along the mapped route, up to a distance beside it and an angle to it.
    Route {
        /// Largest distance from the route, m.
        beside_m: f64,
        /// Largest angle to the route, rad.
        turn_rad: f64,
    },
    /// About a rough pose.
    Near {
        /// The rough pose of the radar.
        pose: Pose,
        /// Half the side of the square that is searched, m.
        half_m: f64,
        /// Largest angle to the rough pose, rad.
        turn_rad: f64,
    },
}

/// Settings of [`locate`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocateSettings {
    /// Least range of points that are used, m.
    pub near_m: f64,
    /// Largest range of points that are used, m.
    pub far_m: f64,
    /// Half the field of view about the radar's boresight, rad.
    pub half_view_rad: f64,
    /// Largest standard deviation of the position of points that take part, m.
    pub max_std_m: f64,
    /// Standard deviation that is added to every point, m.
    pub floor_std_m: f64,
    /// Least occupancy of landmarks that are used.
    pub least_occupancy: f64,
    /// Probability that a landmark in view is detected.
    pub detection_probability: f64,
    /// Share of the points that are not landmarks.
    pub extra_share: f64,
    /// Step of the search in position, m.
    pub step_m: f64,
    /// Step of the search in heading, rad.
    pub step_rad: f64,
    /// Number of poses that are refined.
    pub candidates: usize,
    /// Largest difference in log odds of a rival pose.
    pub sure_log_odds: f64,
}

impl Default for LocateSettings {
    fn default() -> Self {
        Self {
            near_m: 0.5,
            far_m: 40.0,
            half_view_rad: 1.0,
            max_std_m: 0.6,
            floor_std_m: 0.03,
            least_occupancy: 0.5,
            detection_probability: 0.9,
            extra_share: 0.1,
            step_m: 0.4,
            step_rad: 0.0175,
            candidates: 24,
            sure_log_odds: 4.6,
        }
    }
}

/// Another pose that fits about as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlternativePose {
    /// The pose of the radar.
    pub pose: Pose,
    /// Log odds by which it is less likely.
    pub log_odds: f64,
    /// Distance from the reported pose along its heading, m.
    pub along_m: f64,
}

/// The location of a scan in a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Location {
    /// The likeliest pose of the radar.
    pub pose: Pose,
    /// Covariance of x, y (m) and heading (rad) of this pose alone, without its rivals.
    pub covariance: [[f64; 3]; 3],
    /// Expected number of points that are landmarks.
    pub explained: f64,
    /// Number of points that took part.
    pub points: usize,
    /// Rival poses, best first; empty where the pose is the only one.
    pub rivals: Vec<AlternativePose>,
    /// Probability that this pose is the true one among those found.
    pub probability: f64,
    /// Logarithm of the likelihood at the pose.
    pub log_likelihood: f64,
}

impl Location {
    /// Least distance along the heading to a rival, m: the spacing or a multiple of it, where the markers are
    /// periodic.
    pub fn period_m(&self) -> Option<f64> {
        self.rivals.iter().map(|r| r.along_m.abs()).min_by(f64::total_cmp)
    }
}

/// Number of poses of the picture that are tried for each one that is refined in full: the picture
/// distinguishes the places of a periodic row badly.
const TRIALS: usize = 10;
/// Number of those trials that go on for each.
const SHARPER: usize = 3;
const MOST_PLACES: usize = 4_000_000;
const MOST_PIXELS: usize = 80_000_000;

/// The landmarks as a picture of ln(1 + likelihood ratio) in steps of a byte, for ranking.
struct Picture {
    origin: DVec2,
    step_m: f64,
    width: usize,
    height: usize,
    value: Vec<u8>,
    /// Largest distance of a group's poses from its central one, pixels.
    shift: i32,
}

impl Picture {
    /// Likelihood ratio of a landmark to none, where a point falls on one.
    const RATIO: f64 = 20.0;
    /// Number of pixels in a blur.
    const PER_BLUR: f64 = 4.0;

    fn new(landmarks: &[Landmark], blur_m: f64, shift_m: f64) -> Result<Self, LaneError> {
        let step_m = blur_m / Picture::PER_BLUR;
        let shift = (shift_m / step_m).ceil() + 2.0;
        let reach = (3.0 * Picture::PER_BLUR).ceil();
        // What begins within a shift of the edge finds nothing there, wherever it is shifted.
        let margin = (reach + 2.0 * shift + 2.0) * step_m;
        let (low, high) = bounds(landmarks);
        let (low, high) = (low - margin, high + margin);
        let size = ((high - low) / step_m).ceil() + 1.0;
        let pixels = size.x * size.y;
        if pixels.is_nan() || pixels > MOST_PIXELS as f64 {
            return Err(LaneError::too_large(pixels as usize, MOST_PIXELS));
        }
        let (width, height) = (size.x as usize, size.y as usize);
        let mut value = vec![0u8; width * height];
        let reach = reach as usize;
        let side = 2 * reach + 1;
        let stamp: Vec<u8> = (0..side * side)
            .map(|i| {
                let off = |i: usize| (i as f64 - reach as f64) / Picture::PER_BLUR;
                let z2 = off(i % side).powi(2) + off(i / side).powi(2);
                let ln = (1.0 + Picture::RATIO * (-0.5 * z2).exp()).ln();
                (255.0 * ln / (1.0 + Picture::RATIO).ln()).round() as u8
            })
            .collect();
        for l in landmarks {
            let c = ((l.place() - low) / step_m).round();
            let corner = (c.y as usize - reach) * width + c.x as usize - reach;
            for (j, row) in stamp.chunks(side).enumerate() {
                for (v, s) in value[corner + j * width..][..side].iter_mut().zip(row) {
                    *v = (*v).max(*s);
                }
            }
        }
        Ok(Self { origin: low, step_m, width, height, value, shift: shift as i32 })
    }

    /// Scores each pose by the sum over the points, and returns it with the pose's index. Poses of a group
    /// have one heading: the points are turned and converted to pixels once for all of them (Olson).
    fn scores(&self, points: &[Point], poses: &[Pose], group: usize) -> Vec<(u32, u32)> {
        let mut out = Vec::with_capacity(poses.len());
        let mut seen: Vec<usize> = Vec::with_capacity(points.len());
        for of_group in poses.chunks(group) {
            let middle = of_group[of_group.len() / 2];
            let at = (middle.place() - self.origin) / self.step_m + 0.5;
            let turn = DMat2::from_angle(middle.heading_rad) * (1.0 / self.step_m);
            seen.clear();
            for q in points {
                let p = at + turn * q.place;
                let [x, y] = [p.x as i32, p.y as i32];
                let inside = |x: i32, size: usize| x >= self.shift && x < size as i32 - self.shift;
                if inside(x, self.width) && inside(y, self.height) {
                    seen.push(y as usize * self.width + x as usize);
                }
            }
            for p in of_group {
                let off = ((p.place() - middle.place()) / self.step_m).round();
                let by = off.y as isize * self.width as isize + off.x as isize;
                let sum = seen.iter().map(|i| u32::from(self.value[i.wrapping_add_signed(by)])).sum();
                out.push((sum, out.len() as u32));
            }
        }
        out
    }
}

/// A point of the scan in the radar's axes.
struct Point {
    place: DVec2,
    cov: DMat2,
    largest_std_m: f64,
}

/// A landmark as used in a comparison.
struct Mark {
    place: DVec2,
    cov: DMat2,
    /// The largest variance, m².
    var: f64,
    /// Number of cells that a scan expects of it where it is in view.
    expected: f64,
}

/// Landmarks by square, row after row.
struct Marks {
    low: DVec2,
    square_m: f64,
    size: [usize; 2],
    /// Index of the first landmark of each square.
    from: Vec<u32>,
    marks: Vec<Mark>,
    largest_var: f64,
}

impl Marks {
    const SQUARE_M: f64 = 1.0;
    /// Number of squares from which on they grow with the map.
    const MOST_SQUARES: f64 = 4e6;

    fn new(landmarks: &[Landmark], s: &LocateSettings) -> Marks {
        let (low, high) = bounds(landmarks);
        let wide = high - low;
        let square_m = Marks::SQUARE_M.max((wide.x * wide.y / Marks::MOST_SQUARES).sqrt());
        let size = (wide / square_m).floor() + 1.0;
        let size = [size.x as usize, size.y as usize];
        let square = |p: DVec2| {
            let q = (p - low) / square_m;
            q.y as usize * size[0] + q.x as usize
        };
        let mut sorted: Vec<(usize, &Landmark)> = landmarks.iter().map(|l| (square(l.place()), l)).collect();
        sorted.sort_by_key(|l| l.0);
        let mut from = vec![0u32; size[0] * size[1] + 1];
        sorted.iter().for_each(|l| from[l.0 + 1] += 1);
        let mut sum = 0;
        for n in &mut from {
            sum += *n;
            *n = sum;
        }
        let mark = |l: &Landmark| {
            let cov = l.covariance();
            Mark {
                place: l.place(),
                cov,
                var: largest_std_m(&cov).powi(2),
                expected: s.detection_probability * l.occupancy(),
            }
        };
        let marks: Vec<Mark> = sorted.iter().map(|l| mark(l.1)).collect();
        let largest_var = marks.iter().map(|m| m.var).fold(0.0, f64::max);
        Marks { low, square_m, size, from, marks, largest_var }
    }

    /// Calls `each` for all within a radius, and some farther.
    fn near(&self, p: DVec2, radius_m: f64, mut each: impl FnMut(&Mark)) {
        let of = |x: f64, size: usize| (x / self.square_m).floor().clamp(-1.0, size as f64);
        let (a, b) = (p - self.low - radius_m, p - self.low + radius_m);
        let [x0, x1] = [of(a.x, self.size[0]).max(0.0), of(b.x, self.size[0]).min(self.size[0] as f64 - 1.0)];
        let [y0, y1] = [of(a.y, self.size[1]).max(0.0), of(b.y, self.size[1]).min(self.size[1] as f64 - 1.0)];
        if x0 > x1 || y0 > y1 {
            return;
        }
        for y in y0 as usize..=y1 as usize {
            let row = y * self.size[0];
            let (first, end) = (self.from[row + x0 as usize], self.from[row + x1 as usize + 1]);
            self.marks[first as usize..end as usize].iter().for_each(&mut each);
        }
    }
}

fn bounds(landmarks: &[Landmark]) -> (DVec2, DVec2) {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for l in landmarks {
        low = low.min(l.place());
        high = high.max(l.place());
    }
    (low, high)
}

struct Match<'a> {
    points: &'a [Point],
    marks: &'a Marks,
    s: &'a LocateSettings,
    /// Density of points that are not landmarks, 1/m².
    extra: f64,
}

impl Match<'_> {
    /// Calls `each` with (density, offset of the point from the landmark, inverse covariance) for the
    /// landmarks near a point of the scan that lies there, turned by `turn`; returns the sum of the
    /// densities.
    fn near(
        &self,
        point: &Point,
        place: DVec2,
        turn: DMat2,
        widen: f64,
        mut each: impl FnMut(f64, DVec2, DMat2),
    ) -> f64 {
        /// Chi-squares from here on count as nothing.
        const MOST: f64 = 25.0;
        let mut sum = 0.0;
        let cov = turn * point.cov * turn.transpose();
        let (var, wide) = (point.largest_std_m.powi(2), widen * widen);
        let radius = (MOST * wide * (var + self.marks.largest_var)).sqrt();
        self.marks.near(place, radius, |l| {
            let d = place - l.place;
            if d.length_squared() >= MOST * wide * (var + l.var) {
                return;
            }
            let total = (cov + l.cov) * wide;
            let inverse = total.inverse();
            let chi2 = d.dot(inverse * d);
            if chi2 < MOST {
                let density = l.expected * (-0.5 * chi2).exp() / (TAU * total.determinant().sqrt());
                sum += density;
                each(density, d, inverse);
            }
        });
        sum
    }

    fn smooth_log_likelihood(&self, p: &Pose, widen: f64) -> f64 {
        let turn = DMat2::from_angle(p.heading_rad);
        let density =
            |q: &Point| self.extra + self.near(q, p.place() + turn * q.place, turn, widen, |_, _, _| ());
        // Products of a few stay in range and spare logarithms.
        let of_few = |few: &[Point]| few.iter().map(density).product::<f64>().ln();
        self.points.chunks(8).map(of_few).sum()
    }

    /// Log-likelihood including the landmarks that should have been seen.
    fn log_likelihood(&self, p: &Pose) -> f64 {
        let turn = DMat2::from_angle(-p.heading_rad);
        let mut expected = 0.0;
        self.marks.near(p.place(), self.s.far_m, |l| {
            if self.s.sees(turn * (l.place - p.place())) {
                expected += l.expected;
            }
        });
        self.smooth_log_likelihood(p, 1.0) - expected
    }

    fn gradient(&self, p: &Pose, widen: f64) -> (DVec3, DMat3, f64) {
        let turn = DMat2::from_angle(p.heading_rad);
        let (mut g, mut info, mut explained) = (DVec3::ZERO, DMat3::ZERO, 0.0);
        let mut close = Vec::new();
        for q in self.points {
            let arm = turn * q.place;
            close.clear();
            let sum = self.near(q, p.place() + arm, turn, widen, |w, d, inverse| close.push((w, d, inverse)));
            explained += sum / (sum + self.extra);
            for (density, d, inverse) in &close {
                let share = density / (sum + self.extra);
                // The place moves by one in x and y, and across the arm with the heading.
                let across = arm.perp();
                let pull = *inverse * *d;
                g -= share * DVec3::new(pull.x, pull.y, across.dot(pull));
                let t = *inverse * across;
                info += DMat3::from_cols(
                    DVec3::new(inverse.x_axis.x, inverse.x_axis.y, t.x),
                    DVec3::new(inverse.y_axis.x, inverse.y_axis.y, t.y),
                    DVec3::new(t.x, t.y, across.dot(t)),
                ) * share;
            }
        }
        (g, info, explained)
    }

    /// Damped Gauss-Newton through stages of (widening of the points' standard deviations, number of
    /// iterations).
    fn refine(&self, start: Pose, stages: &[(f64, usize)]) -> Pose {
        let mut p = start;
        for &(widen, rounds) in stages {
            let mut best = self.smooth_log_likelihood(&p, widen);
            for _ in 0..rounds {
                let (g, info, _) = self.gradient(&p, widen);
                let mut gain = 0.0;
                let mut damping = 1e-3;
                while damping < 1e4 {
                    let scaled = DVec3::new(info.x_axis.x, info.y_axis.y, info.z_axis.z) * damping + 1e-9;
                    let step = (info + DMat3::from_diagonal(scaled)).inverse() * g;
                    if !step.is_finite() {
                        break;
                    }
                    let q = moved(&p, step);
                    let value = self.smooth_log_likelihood(&q, widen);
                    if value > best {
                        gain = value - best;
                        (p, best) = (q, value);
                        break;
                    }
                    damping *= 10.0;
                }
                if gain < 1e-6 {
                    break;
                }
            }
        }
        p.heading_rad = wrapped(p.heading_rad);
        p
    }

    /// Inverse of the derivative of the gradient, or of the Gauss-Newton information where that is not
    /// positive.
    fn covariance(&self, p: &Pose) -> Option<DMat3> {
        let (_, info, _) = self.gradient(p, 1.0);
        let mut columns = [DVec3::ZERO; 3];
        for (i, axis) in DVec3::AXES.into_iter().enumerate() {
            let step = 0.1 / info.col(i)[i].max(1e-12).sqrt();
            let low = self.gradient(&moved(p, -step * axis), 1.0).0;
            let high = self.gradient(&moved(p, step * axis), 1.0).0;
            columns[i] = (low - high) / (2.0 * step);
        }
        let observed = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let observed = (observed + observed.transpose()) * 0.5;
        [observed, info].into_iter().find_map(|m| {
            let c = m.inverse();
            let positive = (0..3).all(|i| c.col(i)[i] > 0.0) && m.determinant() > 0.0 && c.is_finite();
            positive.then_some(c)
        })
    }
}

fn empty_map() -> LaneError {
    LaneError::refused("the map contains no trusted landmarks")
}

fn unexplained(explained: f64, points: usize) -> LaneError {
    LaneError::Unexplained { best: "place", explained, of: points, what: "points" }
}

fn moved(p: &Pose, step: DVec3) -> Pose {
    Pose { x_m: p.x_m + step.x, y_m: p.y_m + step.y, heading_rad: p.heading_rad + step.z }
}

impl LocateSettings {
    fn sees(&self, d: DVec2) -> bool {
        let range = d.length();
        range >= self.near_m && range <= self.far_m && d.to_angle().abs() <= self.half_view_rad
    }

    fn check(&self) -> Result<(), LaneError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let open = |x: f64| x > 0.0 && x < 1.0;
        let rules: [(&'static str, bool); 12] = [
            ("near_m", self.near_m.is_finite() && self.near_m >= 0.0),
            ("far_m", positive(self.far_m) && self.far_m > self.near_m && self.far_m <= 1000.0),
            ("half_view_rad", positive(self.half_view_rad) && self.half_view_rad <= std::f64::consts::PI),
            ("max_std_m", positive(self.max_std_m) && self.max_std_m <= 10.0),
            ("floor_std_m", self.floor_std_m.is_finite() && self.floor_std_m >= 0.0),
            ("least_occupancy", (0.0..=1.0).contains(&self.least_occupancy)),
            ("detection_probability", open(self.detection_probability)),
            ("extra_share", open(self.extra_share)),
            ("step_m", self.step_m >= 0.02 && self.step_m <= 10.0),
            ("step_rad", self.step_rad >= 1e-4 && self.step_rad <= 1.0),
            ("candidates", (1..=200).contains(&self.candidates)),
            ("sure_log_odds", positive(self.sure_log_odds)),
        ];
        error::settings(&rules)
    }
}

/// Steps to either side that keep within `half`.
fn steps(half: f64, step: f64) -> i32 {
    (half / step + 1e-9).floor().min(1e6) as i32
}

/// Poses to try, and how many of them share a heading and a neighbourhood.
fn grid(search: &Search, route: &[Pose], s: &LocateSettings) -> Result<(Vec<Pose>, usize), LaneError> {
    let (half_m, turn_rad) = match search {
        Search::Route { beside_m, turn_rad } => (*beside_m, *turn_rad),
        Search::Near { half_m, turn_rad, .. } => (*half_m, *turn_rad),
    };
    let good = |x: f64| x.is_finite() && x >= 0.0;
    if !good(half_m) || !good(turn_rad) {
        return Err(LaneError::Setting { name: "search" });
    }
    let (across, turns) = (steps(half_m, s.step_m), steps(turn_rad.min(std::f64::consts::PI), s.step_rad));
    let per_pose = (2 * i64::from(across) + 1) * (2 * i64::from(turns) + 1);
    let mut centres: Vec<Pose> = Vec::new();
    let (along, is_route) = match search {
        Search::Near { pose, .. } => {
            if !pose.is_finite() {
                return Err(bad_pose());
            }
            centres.push(*pose);
            (across, false)
        }
        Search::Route { .. } => {
            let most = (MOST_PLACES as i64 / per_pose).max(1) as usize;
            for w in route.windows(2) {
                let length = w[0].place().distance(w[1].place());
                let n = (length / s.step_m).ceil().clamp(1.0, 1e6) as usize;
                if centres.len() + n > most {
                    return Err(LaneError::refused(format!(
                        "the search has {} positions, and one call allows at most {MOST_PLACES}",
                        (centres.len() + n) * per_pose as usize
                    )));
                }
                for i in 0..n {
                    let part = i as f64 / n as f64;
                    let place = w[0].place().lerp(w[1].place(), part);
                    let turn = wrapped(w[1].heading_rad - w[0].heading_rad);
                    let heading_rad = w[0].heading_rad + part * turn;
                    centres.push(Pose { x_m: place.x, y_m: place.y, heading_rad });
                }
            }
            centres.extend(route.last());
            if centres.is_empty() {
                return Err(empty_map());
            }
            (0, true)
        }
    };
    let places = centres.len() as i64 * per_pose * (2 * i64::from(along) + 1);
    if places > MOST_PLACES as i64 {
        return Err(LaneError::too_large(places as usize, MOST_PLACES));
    }
    let mut out = Vec::with_capacity(places as usize);
    for c in &centres {
        let forward = if is_route { DVec2::from_angle(c.heading_rad) } else { DVec2::X };
        for t in -turns..=turns {
            for i in -along..=along {
                for j in -across..=across {
                    let place =
                        c.place() + s.step_m * (f64::from(i) * forward + f64::from(j) * forward.perp());
                    let heading_rad = c.heading_rad + s.step_rad * f64::from(t);
                    out.push(Pose { x_m: place.x, y_m: place.y, heading_rad });
                }
            }
        }
    }
    Ok((out, ((2 * along + 1) * (2 * across + 1)) as usize))
}

/// Finds the pose from which a scan was taken. The points must be static (see [`SignatureMap::add_scan`] for
/// the test by range rate). The result is deterministic.
///
/// # Errors
/// Returns an error for an invalid setting or search, too few usable points, a map without trusted landmarks,
/// a search that is too large, or if no pose explains the points.
pub fn locate(
    map: &SignatureMap,
    points: &[ScanPoint],
    search: &Search,
    settings: &LocateSettings,
) -> Result<Location, LaneError> {
    const NEEDED: usize = 3;
    settings.check()?;
    let used: Vec<Point> = points
        .iter()
        .filter_map(|p| p.place(settings.floor_std_m))
        .map(|(place, cov)| Point { place, cov, largest_std_m: largest_std_m(&cov) })
        .filter(|p| settings.sees(p.place) && p.largest_std_m <= settings.max_std_m)
        .collect();
    if used.len() < NEEDED {
        return Err(LaneError::too_few("usable points", used.len(), NEEDED));
    }
    if let Search::Near { pose, .. } = search
        && !pose.is_finite()
    {
        return Err(bad_pose());
    }
    // About a rough pose, what it cannot see does not matter.
    let within = |l: &Landmark| match search {
        Search::Near { pose, half_m, .. } => {
            l.place().distance(pose.place()) <= settings.far_m + 2.0 * half_m + 5.0
        }
        Search::Route { .. } => true,
    };
    let landmarks: Vec<Landmark> = map
        .landmarks()
        .iter()
        .filter(|l| l.occupancy() >= settings.least_occupancy && within(l))
        .copied()
        .collect();
    if landmarks.is_empty() {
        return Err(match map.landmarks().iter().any(|l| l.occupancy() >= settings.least_occupancy) {
            true => unexplained(0.0, used.len()),
            false => empty_map(),
        });
    }
    // Points fall up to half a step beside their landmarks in either axis, the far ones by half a turn too.
    let blur_m = settings.step_m.max(0.4 * settings.step_rad * settings.far_m).max(0.1);
    let (poses, group) = grid(search, map.route(), settings)?;
    let (Search::Route { beside_m: half_m, .. } | Search::Near { half_m, .. }) = search;
    let picture = Picture::new(&landmarks, blur_m, half_m * SQRT_2)?;
    let mut scored = picture.scores(&used, &poses, group);
    let kept = scored.len().min(40 * TRIALS * settings.candidates);
    scored.select_nth_unstable_by(kept - 1, |a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    scored.truncate(kept);
    scored.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut starts: Vec<Pose> = Vec::new();
    for (_, i) in &scored {
        let p = poses[*i as usize];
        let is_new = starts.iter().all(|q| {
            q.place().distance(p.place()) > 1.6 * settings.step_m
                || wrapped(q.heading_rad - p.heading_rad).abs() > 4.5 * settings.step_rad
        });
        if is_new {
            starts.push(p);
            if starts.len() == TRIALS * settings.candidates {
                break;
            }
        }
    }
    let area = settings.half_view_rad * (settings.far_m.powi(2) - settings.near_m.powi(2));
    let marks = Marks::new(&landmarks, settings);
    let fit = Match {
        points: &used,
        marks: &marks,
        s: settings,
        extra: settings.extra_share * used.len() as f64 / area,
    };
    // Wide points draw each a little nearer; the best third is told apart by sharper ones.
    let mut found: Vec<(f64, Pose)> = starts
        .into_iter()
        .map(|p| {
            let q = fit.refine(p, &[(2.0, 1)]);
            (fit.smooth_log_likelihood(&q, 2.0), q)
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(SHARPER * settings.candidates);
    for (value, p) in &mut found {
        *p = fit.refine(*p, &[(2.0, 2), (1.0, 2)]);
        *value = fit.log_likelihood(p);
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(settings.candidates);
    for (value, p) in &mut found {
        *p = fit.refine(*p, &[(1.5, 4), (1.0, 15)]);
        *value = fit.log_likelihood(p);
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let none = unexplained(0.0, used.len());
    let (log_likelihood, pose) = *found.first().ok_or(none)?;
    let explained = fit.gradient(&pose, 1.0).2;
    if explained.is_nan() || explained < 0.5 * used.len() as f64 {
        return Err(unexplained(explained, used.len()));
    }
    let c = fit.covariance(&pose).ok_or(unexplained(explained, used.len()))?;
    let mut rivals: Vec<AlternativePose> = Vec::new();
    let mut weight = 1.0;
    for (value, q) in &found[1..] {
        let d = q.place() - pose.place();
        let others = rivals.iter().map(|r| r.pose).chain([pose]);
        let is_new = others.into_iter().all(|o| {
            o.place().distance(q.place()) > 0.3 || wrapped(o.heading_rad - q.heading_rad).abs() > 0.05
        });
        let log_odds = log_likelihood - value;
        if is_new && log_odds < settings.sure_log_odds {
            weight += (-log_odds).exp();
            rivals.push(AlternativePose {
                pose: *q,
                log_odds,
                along_m: d.dot(DVec2::from_angle(pose.heading_rad)),
            });
        }
    }
    Ok(Location {
        pose,
        covariance: c.to_cols_array_2d(),
        explained,
        points: used.len(),
        rivals,
        probability: 1.0 / weight,
        log_likelihood,
    })
}

#[cfg(test)]
#[path = "tests/locate.rs"]
mod tests;
