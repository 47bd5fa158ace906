//! The axis of a road: a plan of straights, arcs and clothoids, a profile of grades and parabolas, a cross
//! slope. `s` is the arc length in plan, `t` the distance from the axis in plan, positive to the left, `h` the
//! height straight up over the road's surface; metres and radians.
//!
//! A straight of 100 m, a clothoid of 50 m and an arc of 200 m radius. The heading is the integral of the curvature,
//! and road coordinates turn into world coordinates and back:
//!
//! ```
//! use catseye::road::axis::{Course, RoadAxis, RoadPoint};
//! use glam::DVec3;
//!
//! let curvature_per_m = 1.0 / 200.0;
//! let courses = [
//!     Course::Straight { length_m: 100.0 },
//!     Course::Clothoid { length_m: 50.0, from_per_m: 0.0, to_per_m: curvature_per_m },
//!     Course::Arc { length_m: 100.0, curvature_per_m },
//! ];
//! let axis = RoadAxis::new(DVec3::ZERO, 0.0, &courses)?;
//! assert_eq!(axis.length_m(), 250.0);
//! let heading_rad = 0.5 * 50.0 * curvature_per_m + 100.0 * curvature_per_m;
//! assert!((axis.at(250.0).heading_rad - heading_rad).abs() < 1e-12);
//! let lane = RoadPoint { s_m: 180.0, t_m: -1.75, h_m: 0.5 };
//! let back = axis.project(axis.world(lane));
//! assert!((back.s_m - 180.0).abs() < 1e-6 && (back.t_m + 1.75).abs() < 1e-6 && (back.h_m - 0.5).abs() < 1e-6);
//! # Ok::<(), catseye::Error>(())
//! ```

use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Target, World};
use crate::road::profile::{Piece, Profile};
use glam::{DMat3, DQuat, DVec2, DVec3};
use std::sync::OnceLock;

/// One element of the plan. Curvature is positive to the left, 1/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// A straight.
    Straight {
        /// Length, m.
        length_m: f64,
    },
    /// An arc of a circle.
    Arc {
        /// Length, m.
        length_m: f64,
        /// Curvature, 1/m.
        curvature_per_m: f64,
    },
    /// Curvature that changes in proportion to the length.
    Clothoid {
        /// Length, m.
        length_m: f64,
        /// Curvature at its beginning, 1/m.
        from_per_m: f64,
        /// Curvature at its end, 1/m.
        to_per_m: f64,
    },
    /// (u, v)(p) = sum of `u`, `v` times p^k in the axes of its beginning, p from 0 to `p_end`, run through with
    /// constant speed over `length_m` (paramPoly3 of OpenDRIVE).
    Cubic {
        /// Length, m.
        length_m: f64,
        /// Coefficients along the beginning's direction, m.
        u: [f64; 4],
        /// Coefficients to the left of it, m.
        v: [f64; 4],
        /// The parameter at its end.
        p_end: f64,
    },
}

impl Course {
    /// Length of the element, m.
    pub fn length_m(&self) -> f64 {
        match *self {
            Course::Straight { length_m }
            | Course::Arc { length_m, .. }
            | Course::Clothoid { length_m, .. }
            | Course::Cubic { length_m, .. } => length_m,
        }
    }
}

/// Where two grades meet: their lines intersect at `s_m`, and a parabola of length K |g1 - g2| about it joins
/// them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradeChange {
    /// Where the two grades intersect, m along the road.
    pub s_m: f64,
    /// Rise over run behind it, 0.05 = 5 %.
    pub grade: f64,
    /// Length of the curve for each percent of change, m; 0 is a kink.
    pub k_m_per_percent: f64,
}

/// Place and direction at which an element begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Place, m.
    pub at_m: DVec2,
    /// Heading, rad.
    pub heading_rad: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Element {
    s0_m: f64,
    start: Start,
    course: Course,
}

/// A place on the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPoint {
    /// Position, m.
    pub position_m: DVec3,
    /// Direction of the axis in plan, rad, from world x to the left; not wrapped.
    pub heading_rad: f64,
    /// Rise over run along the axis.
    pub grade: f64,
    /// Curvature of the plan, 1/m, positive to the left.
    pub curvature_per_m: f64,
    /// Rise over run to the left, on the left of the axis.
    pub cross_slope: f64,
}

/// Road coordinates of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoadPoint {
    /// Station along the axis, m.
    pub s_m: f64,
    /// Distance to the left of the axis, m.
    pub t_m: f64,
    /// Height above the road, m.
    pub h_m: f64,
}

/// The axis. Before its beginning and behind its end it goes straight on with the grade and cross slope there.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadAxis {
    elements: Vec<Element>,
    height: Profile,
    cross_slope: Profile,
    /// To the right of the axis, where it differs.
    right_slope: Option<Profile>,
    length_m: f64,
    /// Seeds of the projection: s and place, close enough for one minimum between two.
    seeds: Vec<(f64, DVec2)>,
}

/// Length of the longest axis, m.
pub const MAX_LENGTH_M: f64 = 1e6;

impl RoadAxis {
    /// An axis at the height `start_m.z`, level. Each element begins where and as the one before ends.
    ///
    /// # Errors
    /// Returns an error if there is no element, for lengths that are not positive or more than [`MAX_LENGTH_M`], or for
    /// an element that turns more than ten times.
    pub fn new(start_m: DVec3, heading_rad: f64, courses: &[Course]) -> Result<RoadAxis> {
        let mut start = Start { at_m: start_m.truncate(), heading_rad };
        let mut placed = Vec::with_capacity(courses.len());
        for (i, course) in courses.iter().enumerate() {
            check(i, course)?;
            placed.push((start, *course));
            let (at_m, heading_rad, _) = run(&start, course, course.length_m());
            start = Start { at_m, heading_rad };
        }
        Self::placed(&placed, Profile::constant(start_m.z))
    }

    /// An axis whose elements say themselves where they begin, with its heights.
    ///
    /// # Errors
    /// Returns the errors of [`RoadAxis::new`].
    pub fn placed(elements: &[(Start, Course)], height: Profile) -> Result<RoadAxis> {
        if elements.is_empty() {
            return Err(BadInput::new("the axis of a road has no element").into());
        }
        let mut s0_m = 0.0;
        let mut list = Vec::with_capacity(elements.len());
        for (i, (start, course)) in elements.iter().enumerate() {
            check(i, course)?;
            if !(start.at_m.is_finite() && start.heading_rad.is_finite()) {
                return Err(BadInput::new("has a start that is not finite")
                    .key(format!("element {i}"))
                    .into());
            }
            list.push(Element { s0_m, start: *start, course: *course });
            s0_m += course.length_m();
        }
        if s0_m > MAX_LENGTH_M {
            return Err(BadInput::new("the axis is too long")
                .value(format!("{s0_m} m"))
                .allowed(format!("up to {MAX_LENGTH_M} m"))
                .into());
        }
        let mut axis = RoadAxis {
            elements: list,
            height,
            cross_slope: Profile::constant(0.0),
            right_slope: None,
            length_m: s0_m,
            seeds: Vec::new(),
        };
        // Two seeds a fifth of a radian apart at most: between them the distance to a point on the inner side
        // has one minimum.
        for e in &axis.elements {
            let length = e.course.length_m();
            let n =
                (length * curvature_bound(&e.course, 0.0, length) / 0.2).max(length / 50.0).ceil().max(1.0);
            for i in 0..n as usize {
                let u = length * i as f64 / n;
                axis.seeds.push((e.s0_m + u, run(&e.start, &e.course, u).0));
            }
        }
        axis.seeds.push((s0_m, axis.plan(s0_m).0));
        Ok(axis)
    }

    /// The axis with the grade `first` at the beginning and the changes in their order; the plan stays the same.
    ///
    /// # Errors
    /// Returns an error for changes out of order or off the road, curves that overlap or reach beyond the road, or
    /// grades above 100 %.
    pub fn with_grades(mut self, first: f64, changes: &[GradeChange]) -> Result<RoadAxis> {
        let bad =
            |i: usize, problem: &str| BadInput::new(problem.to_string()).key(format!("change of grade {i}"));
        let z0 = self.at(0.0).position_m.z;
        let (mut s, mut z, mut grade) = (0.0, z0, first);
        let mut pieces = Vec::new();
        let straight = |s0_m: f64, z: f64, g: f64| Piece { s0_m, coefficients: [z, g, 0.0, 0.0] };
        for (i, c) in changes.iter().enumerate() {
            if !(c.grade.abs() <= 1.0 && grade.abs() <= 1.0) {
                return Err(bad(i, "the grade is steeper than 100 %")
                    .value(format!("{} %", 100.0 * c.grade))
                    .into());
            }
            if !(c.k_m_per_percent.is_finite() && c.k_m_per_percent >= 0.0) {
                return Err(bad(i, "K is negative").value(c.k_m_per_percent).into());
            }
            let length = c.k_m_per_percent * 100.0 * (c.grade - grade).abs();
            let (from, to) = (c.s_m - 0.5 * length, c.s_m + 0.5 * length);
            if from < s - 1e-9 || to > self.length_m + 1e-9 || !c.s_m.is_finite() {
                return Err(bad(i, "the vertical curve overlaps the one before it or leaves the road")
                    .value(format!("{from:.3}..{to:.3} m"))
                    .allowed(format!("between {s:.3} and {:.3} m", self.length_m))
                    .remedy("give a smaller K, or move the change of grade")
                    .into());
            }
            if from > s {
                pieces.push(straight(s, z, grade));
                z += grade * (from - s);
            }
            if length > 0.0 {
                let half_bend = 0.5 * (c.grade - grade) / length;
                pieces.push(Piece { s0_m: from, coefficients: [z, grade, half_bend, 0.0] });
                z += 0.5 * (grade + c.grade) * length;
            }
            (s, grade) = (to, c.grade);
        }
        pieces.push(straight(s, z, grade));
        self.height = Profile::cubics(pieces)?;
        Ok(self)
    }

    /// The axis with a cross slope along s: rise over run to the left, turned about the axis.
    pub fn with_cross_slope(mut self, slope: Profile) -> RoadAxis {
        (self.cross_slope, self.right_slope) = (slope, None);
        self
    }

    /// The axis with a cross slope to its left and another to its right, both rise over run to the left: a roof or a
    /// valley whose ridge is the axis.
    pub fn with_cross_slopes(mut self, left: Profile, right: Profile) -> RoadAxis {
        self.right_slope = (left != right).then_some(right);
        self.cross_slope = left;
        self
    }

    /// Length of the axis, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Height over the length.
    pub fn height(&self) -> &Profile {
        &self.height
    }

    /// Cross slope over the length, to the left of the axis.
    pub fn cross_slope(&self) -> &Profile {
        &self.cross_slope
    }

    /// Cross slope to the right of the axis, where it is another.
    pub fn right_slope(&self) -> Option<&Profile> {
        self.right_slope.as_ref()
    }

    /// Cross slope on the side of a lateral distance.
    fn slope_at(&self, t_m: f64) -> &Profile {
        self.right_slope.as_ref().filter(|_| t_m < 0.0).unwrap_or(&self.cross_slope)
    }

    /// Cross slope at a point; beyond the ends of the axis that of the end.
    fn cross_slope_at(&self, s_m: f64, t_m: f64) -> f64 {
        self.slope_at(t_m).value(s_m.clamp(0.0, self.length_m))
    }

    /// (place, heading, curvature) in plan.
    fn plan(&self, s_m: f64) -> (DVec2, f64, f64) {
        let s = s_m.clamp(0.0, self.length_m);
        let i = self.elements.partition_point(|e| e.s0_m <= s).saturating_sub(1);
        let e = &self.elements[i];
        let (at, heading, curvature) = run(&e.start, &e.course, (s - e.s0_m).min(e.course.length_m()));
        if s == s_m {
            return (at, heading, curvature);
        }
        (at + (s_m - s) * DVec2::from_angle(heading), heading, 0.0)
    }

    /// Place and direction of the axis at `s_m`.
    pub fn at(&self, s_m: f64) -> AxisPoint {
        let (at, heading_rad, curvature_per_m) = self.plan(s_m);
        let s = s_m.clamp(0.0, self.length_m);
        let grade = self.height.slope(s);
        AxisPoint {
            position_m: at.extend(self.height.value(s) + grade * (s_m - s)),
            heading_rad,
            grade,
            curvature_per_m,
            cross_slope: self.cross_slope.value(s),
        }
    }

    /// The world point of road coordinates.
    pub fn world(&self, p: RoadPoint) -> DVec3 {
        let a = self.at(p.s_m);
        let left = DVec2::from_angle(a.heading_rad).perp();
        a.position_m + (p.t_m * left).extend(p.t_m * self.cross_slope_at(p.s_m, p.t_m) + p.h_m)
    }

    /// The pose of what stands on the road: x along the axis, turned by `yaw_rad` to the left; `lying` follows the
    /// grade and cross slope of the surface, otherwise z is straight up.
    pub fn pose(&self, p: RoadPoint, yaw_rad: f64, lying: bool) -> Pose<Target, World> {
        let a = self.at(p.s_m);
        let turn = DQuat::from_rotation_z(a.heading_rad + yaw_rad);
        let at = self.world(p);
        if !lying {
            return Pose::new(turn, at);
        }
        Pose::new(tilt(self.normal(p.s_m, p.t_m)) * turn, at)
    }

    /// Upward unit normal of the road's surface.
    pub fn normal(&self, s_m: f64, t_m: f64) -> DVec3 {
        let a = self.at(s_m);
        let ahead = DVec2::from_angle(a.heading_rad);
        let twist = if (0.0..=self.length_m).contains(&s_m) { self.slope_at(t_m).slope(s_m) } else { 0.0 };
        // d(world)/ds and d(world)/dt.
        let along = ((1.0 - a.curvature_per_m * t_m) * ahead).extend(a.grade + t_m * twist);
        let across = ahead.perp().extend(self.cross_slope_at(s_m, t_m));
        along.cross(across).normalize_or(DVec3::Z)
    }

    /// Road coordinates of a world point: those of the nearest point of the axis in plan.
    ///
    /// A point as far to the inner side as the radius has no unique nearest point; any of them is returned.
    pub fn project(&self, p: DVec3) -> RoadPoint {
        let q = p.truncate();
        let mut best = (f64::INFINITY, 0.0);
        let mut offer = |s: f64, at: DVec2| {
            let d = (q - at).length();
            if d < best.0 {
                best = (d, s);
            }
        };
        let reach: Vec<f64> = self.seeds.iter().map(|(_, at)| (q - *at).length()).collect();
        let nearest = reach.iter().copied().fold(f64::INFINITY, f64::min);
        for (i, (s, at)) in self.seeds.iter().enumerate() {
            if reach[i] == nearest {
                offer(*s, *at);
            }
        }
        for i in 0..self.seeds.len() - 1 {
            let (a, b) = (self.seeds[i].0, self.seeds[i + 1].0);
            // The axis has unit speed, so no point between lies nearer than this.
            if 0.5 * (reach[i] + reach[i + 1] - (b - a)) > nearest {
                continue;
            }
            if let Some(s) = self.foot(q, a, b) {
                offer(s, self.plan(s).0);
            }
        }
        for (s, sign) in [(0.0, -1.0), (self.length_m, 1.0)] {
            let (at, heading, _) = self.plan(s);
            let beyond = sign * (q - at).dot(DVec2::from_angle(heading));
            if beyond > 0.0 {
                let s = s + sign * beyond;
                offer(s, self.plan(s).0);
            }
        }
        let s_m = best.1;
        let a = self.at(s_m);
        let t_m = (q - a.position_m.truncate()).dot(DVec2::from_angle(a.heading_rad).perp());
        RoadPoint { s_m, t_m, h_m: p.z - a.position_m.z - t_m * self.cross_slope_at(s_m, t_m) }
    }

    /// Where the perpendicular from `q` meets the axis between `a` and `b`: Newton's method within a bracket.
    fn foot(&self, q: DVec2, mut a: f64, mut b: f64) -> Option<f64> {
        let ahead = |s: f64| {
            let (at, heading, curvature) = self.plan(s);
            let t = DVec2::from_angle(heading);
            ((q - at).dot(t), curvature * (q - at).dot(t.perp()) - 1.0)
        };
        // A little beyond the seeds, so that rounding loses no foot at a seed.
        (a, b) = ((a - 1e-9).max(0.0), (b + 1e-9).min(self.length_m));
        if ahead(a).0 < 0.0 || ahead(b).0 > 0.0 {
            return None;
        }
        let mut s = 0.5 * (a + b);
        for _ in 0..100 {
            let (f, df) = ahead(s);
            if f > 0.0 {
                a = s
            } else {
                b = s
            }
            let step = if df < 0.0 { -f / df } else { f64::INFINITY };
            let next = s + step;
            if step.abs() <= 1e-15 * (1.0 + s.abs()) {
                return Some(s);
            }
            s = if next > a && next < b { next } else { 0.5 * (a + b) };
            if b - a <= 1e-13 * (1.0 + s.abs()) {
                return Some(s);
            }
        }
        Some(s)
    }

    /// Places between `from_m` and `to_m`, both included, such that chords between neighbours stay within
    /// `sagitta_m` of every line of the surface no farther than `reach_m` from the axis, and facets of sheets of
    /// the width `sheet_m` within it of a warped surface. Joints of elements, of grades and of the cross slope are
    /// among them.
    pub fn stations_m(&self, from_m: f64, to_m: f64, sagitta_m: f64, reach_m: f64, sheet_m: f64) -> Vec<f64> {
        let mut marks: Vec<f64> = (self.elements.iter().map(|e| e.s0_m))
            .chain(self.height.breaks_m())
            .chain(self.cross_slope.breaks_m())
            .chain(self.right_slope.iter().flat_map(Profile::breaks_m))
            .chain([self.length_m])
            .filter(|s| *s > from_m + 1e-9 && *s < to_m - 1e-9)
            .chain([from_m, to_m])
            .collect();
        marks.sort_by(f64::total_cmp);
        marks.dedup_by(|b, a| *b - *a < 1e-9);
        let mut out = vec![from_m];
        for w in marks.windows(2) {
            self.divide((w[0], w[1]), sagitta_m, (reach_m, sheet_m), &mut out);
        }
        out
    }

    fn divide(&self, (a, b): (f64, f64), sagitta_m: f64, (reach_m, sheet_m): (f64, f64), out: &mut Vec<f64>) {
        let mid = 0.5 * (a + b);
        let inside = (0.0..=self.length_m).contains(&mid);
        let i = self.elements.partition_point(|e| e.s0_m <= mid).saturating_sub(1);
        let e = &self.elements[i];
        let k = if inside { curvature_bound(&e.course, a - e.s0_m, b - e.s0_m) } else { 0.0 };
        let slopes = || [Some(&self.cross_slope), self.right_slope.as_ref()].into_iter().flatten();
        let steepest = |f: &dyn Fn(&Profile) -> f64| slopes().map(f).fold(0.0, f64::max);
        let bend = if inside { self.height.bend(a, b) + reach_m * steepest(&|p| p.bend(a, b)) } else { 0.0 };
        let sideways = k * (1.0 + k * reach_m) / 8.0;
        // A line at a lateral distance of a curve in a grade bends with both.
        let upwards = bend / 8.0;
        let twist = if inside { steepest(&|p| (p.value(b - 1e-9) - p.value(a)).abs()) } else { 0.0 };
        let chords = (b - a) * (sideways.hypot(upwards) / sagitta_m).sqrt();
        // Two triangles are off a quadrangle with turned ends by up to a quarter of its warp.
        let n = chords.max(0.25 * twist * sheet_m / sagitta_m);
        if n <= 1.0 + 1e-12 {
            out.push(b);
        } else if matches!(e.course, Course::Straight { .. } | Course::Arc { .. }) || !inside {
            let n = (n - 1e-12).ceil();
            out.extend((1..=n as usize).map(|j| a + (b - a) * j as f64 / n));
        } else {
            self.divide((a, mid), sagitta_m, (reach_m, sheet_m), out);
            self.divide((mid, b), sagitta_m, (reach_m, sheet_m), out);
        }
    }
}

fn check(i: usize, course: &Course) -> Result<()> {
    let bad = |problem: &str| BadInput::new(problem.to_string()).key(format!("element {i}"));
    let length = course.length_m();
    if !(length > 0.0 && length <= MAX_LENGTH_M) {
        return Err(bad("its length is not positive, or too long")
            .value(format!("{length} m"))
            .allowed(format!("more than 0, up to {MAX_LENGTH_M} m"))
            .into());
    }
    let turn = length * curvature_bound(course, 0.0, length);
    if !turn.is_finite() {
        return Err(bad("its curvature is not finite").into());
    }
    if turn > 20.0 * std::f64::consts::PI {
        return Err(bad("turns more than ten times").value(format!("{turn:.1} rad")).into());
    }
    Ok(())
}

/// The least turn that takes z to `normal`.
pub fn tilt(normal: DVec3) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, normal)
}

/// The pose whose z is `normal` and whose x points along `ahead` as far as it can.
pub fn pose_on(at_m: DVec3, normal: DVec3, heading_rad: f64) -> Pose<Target, World> {
    let ahead = DVec2::from_angle(heading_rad).extend(0.0);
    let left = normal.cross(ahead).normalize_or(DVec3::Y);
    Pose::new(DQuat::from_mat3(&DMat3::from_cols(left.cross(normal), left, normal)), at_m)
}

/// The greatest amount of curvature of an element between two lengths of it.
fn curvature_bound(course: &Course, from_m: f64, to_m: f64) -> f64 {
    match *course {
        Course::Straight { .. } => 0.0,
        Course::Arc { curvature_per_m, .. } => curvature_per_m.abs(),
        Course::Clothoid { length_m, from_per_m, to_per_m } => {
            let at = |u: f64| (from_per_m + (to_per_m - from_per_m) * (u / length_m).clamp(0.0, 1.0)).abs();
            at(from_m).max(at(to_m))
        }
        Course::Cubic { length_m, u, v, p_end } => {
            // Speed is close to constant in any sane element, so places in p stand for places in length.
            let at = |i: i32| {
                let x = from_m + (to_m - from_m) * f64::from(i) / 16.0;
                cubic_frame(&u, &v, p_end * (x / length_m).clamp(0.0, 1.0)).2.abs()
            };
            1.1 * (0..=16).map(at).fold(0.0, f64::max)
        }
    }
}

/// (place, heading, curvature) after `u` metres of an element.
fn run(start: &Start, course: &Course, u: f64) -> (DVec2, f64, f64) {
    let along = DVec2::from_angle(start.heading_rad);
    let place = |local: DVec2| start.at_m + along.rotate(local);
    match *course {
        Course::Straight { .. } => (place(DVec2::new(u, 0.0)), start.heading_rad, 0.0),
        Course::Arc { curvature_per_m: k, .. } => {
            // Chord of length u sinc(ku/2) at half the turn, which is good for any curvature.
            let half = 0.5 * k * u;
            let sinc = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
            (place(u * sinc * DVec2::from_angle(half)), start.heading_rad + k * u, k)
        }
        Course::Clothoid { length_m, from_per_m, to_per_m } => {
            let rate = (to_per_m - from_per_m) / length_m;
            let angle = |x: f64| x * (from_per_m + 0.5 * rate * x);
            let turn = u * from_per_m.abs().max((from_per_m + rate * u).abs());
            let local = integral(u, turn, |x| DVec2::from_angle(angle(x)));
            (place(local), start.heading_rad + angle(u), from_per_m + rate * u)
        }
        Course::Cubic { length_m, u: cu, v: cv, p_end } => {
            let speed = |p: f64| cubic_frame(&cu, &cv, p).3;
            let arc = |p: f64| integral(p, 4.0, |x| DVec2::new(speed(x), 0.0)).x;
            let wanted = arc(p_end) * (u / length_m).clamp(0.0, 1.0);
            let (mut low, mut high, mut p) = (0.0, p_end, p_end * (u / length_m).clamp(0.0, 1.0));
            for _ in 0..60 {
                let miss = arc(p) - wanted;
                if miss > 0.0 {
                    high = p
                } else {
                    low = p
                }
                let next = p - miss / speed(p);
                let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
                if (next - p).abs() <= 1e-15 * p_end.abs() {
                    break;
                }
                p = next;
            }
            let (local, heading, curvature, _) = cubic_frame(&cu, &cv, p);
            (place(local), start.heading_rad + heading, curvature)
        }
    }
}

/// (place, heading, curvature, speed) of a parametric cubic.
fn cubic_frame(u: &[f64; 4], v: &[f64; 4], p: f64) -> (DVec2, f64, f64, f64) {
    let value = |c: &[f64; 4]| c[0] + p * (c[1] + p * (c[2] + p * c[3]));
    let first = |c: &[f64; 4]| c[1] + p * (2.0 * c[2] + 3.0 * p * c[3]);
    let second = |c: &[f64; 4]| 2.0 * c[2] + 6.0 * p * c[3];
    let d = DVec2::new(first(u), first(v));
    let curvature = d.perp_dot(DVec2::new(second(u), second(v))) / d.length().powi(3);
    (DVec2::new(value(u), value(v)), d.y.atan2(d.x), curvature, d.length())
}

/// Integral from 0 to `length` of something that turns by about `turn` radians over it: 16-point
/// Gauss-Legendre rules on pieces of at most half a radian.
fn integral(length: f64, turn: f64, f: impl Fn(f64) -> DVec2) -> DVec2 {
    let pieces = (2.0 * turn.abs()).ceil().max(1.0);
    let half = 0.5 * length / pieces;
    let mut sum = DVec2::ZERO;
    for i in 0..pieces as usize {
        let middle = half * (2 * i + 1) as f64;
        for (x, w) in rule() {
            sum += *w * (f(middle - half * x) + f(middle + half * x));
        }
    }
    half * sum
}

/// Positive nodes and weights of the 16-point Gauss-Legendre rule on -1..1.
fn rule() -> &'static [(f64, f64); 8] {
    static RULE: OnceLock<[(f64, f64); 8]> = OnceLock::new();
    RULE.get_or_init(|| {
        const N: usize = 16;
        std::array::from_fn(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (N as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                let (mut p, mut before) = (x, 1.0);
                for k in 2..=N {
                    let k = k as f64;
                    (p, before) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k, p);
                }
                slope = N as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn straight(length_m: f64) -> Course {
        Course::Straight { length_m }
    }
    fn arc(length_m: f64, radius_m: f64) -> Course {
        Course::Arc { length_m, curvature_per_m: 1.0 / radius_m }
    }
    fn clothoid(length_m: f64, from_per_m: f64, to_per_m: f64) -> Course {
        Course::Clothoid { length_m, from_per_m, to_per_m }
    }
    fn axis(courses: &[Course]) -> RoadAxis {
        RoadAxis::new(DVec3::ZERO, 0.0, courses).unwrap()
    }

    /// Fresnel integrals C and S by their power series (Abramowitz and Stegun 7.3.11, 7.3.13).
    fn fresnel(x: f64) -> (f64, f64) {
        let (mut c, mut s) = (0.0, 0.0);
        let half = FRAC_PI_2 * x * x;
        // (pi/2 x²)^n / n!
        let mut term = 1.0;
        for n in 0..60 {
            let sign = if n / 2 % 2 == 0 { 1.0 } else { -1.0 };
            let value = sign * term * x / (2 * n + 1) as f64;
            if n % 2 == 0 {
                c += value
            } else {
                s += value
            }
            term *= half / (n + 1) as f64;
        }
        (c, s)
    }

    #[test]
    fn series_agrees_with_the_printed_table() {
        // Abramowitz and Stegun, table 7.7.
        for (x, c, s) in
            [(0.5, 0.4923442, 0.0647324), (1.0, 0.7798934, 0.4382591), (2.0, 0.4882534, 0.3434157)]
        {
            let (a, b) = fresnel(x);
            assert!((a - c).abs() < 1e-7 && (b - s).abs() < 1e-7, "{x}: {a} {b}");
        }
    }

    #[test]
    fn clothoid_is_the_fresnel_integrals() {
        // Heading u²/(2 A²): x = A sqrt(pi) C(u / (A sqrt(pi))).
        for (length, end_radius) in [(1000.0, 500.0), (1000.0, 120.0), (60.0, -40.0)] {
            let a = axis(&[clothoid(length, 0.0, 1.0 / end_radius)]);
            let scale = (length * f64::abs(end_radius) * PI).sqrt();
            for i in 0..=20 {
                let s = length * f64::from(i) / 20.0;
                let (c, f) = fresnel(s / scale);
                let expected = DVec3::new(scale * c, end_radius.signum() * scale * f, 0.0);
                let got = a.at(s);
                assert!((got.position_m - expected).length() < 1e-9, "{s}: {} {expected}", got.position_m);
                assert!((got.curvature_per_m - s / length / end_radius).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn arc_is_a_circle_and_a_nearly_straight_one_is_no_trap() {
        let a = axis(&[arc(150.0 * PI, -100.0)]);
        let end = a.at(50.0 * PI);
        assert!(
            (end.position_m - DVec3::new(100.0, -100.0, 0.0)).length() < 1e-12
                && (end.heading_rad + FRAC_PI_2).abs() < 1e-14
        );
        for k in [1e-3, 1e-7, 1e-12, -1e-9] {
            let a = RoadAxis::new(DVec3::ZERO, 0.3, &[Course::Arc { length_m: 1000.0, curvature_per_m: k }])
                .unwrap();
            let b = RoadAxis::new(DVec3::ZERO, 0.3, &[clothoid(1000.0, k, k)]).unwrap();
            assert!((a.at(777.0).position_m - b.at(777.0).position_m).length() < 1e-10, "{k}");
        }
    }

    #[test]
    fn elements_join_without_steps() {
        let a = axis(&[
            straight(50.0),
            clothoid(60.0, 0.0, 1.0 / 160.0),
            arc(100.0, 160.0),
            clothoid(60.0, 1.0 / 160.0, -0.01),
            straight(30.0),
        ]);
        assert_eq!(a.length_m(), 300.0);
        for s in [0.0, 50.0, 110.0, 210.0, 270.0, 300.0] {
            let (p, q) = (a.at(s - 1e-7), a.at(s + 1e-7));
            assert!((p.position_m - q.position_m).length() < 2.1e-7, "{s}");
            assert!((p.heading_rad - q.heading_rad).abs() < 1e-8, "{s}");
        }
        assert!(
            (a.at(270.0 - 1e-9).curvature_per_m + 0.01).abs() < 1e-9 && a.at(280.0).curvature_per_m == 0.0
        );
        // Unit speed: the chord of a short step is as long as the step.
        for i in 0..300 {
            let s = f64::from(i);
            assert!(((a.at(s + 0.01).position_m - a.at(s).position_m).length() - 0.01).abs() < 1e-9);
        }
    }

    #[test]
    fn vertical_curve_has_its_length_and_middle_ordinate() {
        // +15 % to -15 % with K = 10: 300 m, centred on the point of intersection.
        let change = GradeChange { s_m: 200.0, grade: -0.15, k_m_per_percent: 10.0 };
        let a = axis(&[straight(400.0)]).with_grades(0.15, &[change]).unwrap();
        assert_eq!((a.at(50.0).grade, a.at(350.0).grade), (0.15, -0.15));
        assert!(a.at(200.0).grade.abs() < 1e-15);
        // Middle ordinate A L / 800 with A in percent, below the point of intersection at 30 m.
        assert!((a.at(200.0).position_m.z - (30.0 - 30.0 * 300.0 / 800.0)).abs() < 1e-12);
        assert!(a.at(400.0).position_m.z.abs() < 1e-12, "the tangents are symmetric");
        assert!((a.at(410.0).position_m.z + 1.5).abs() < 1e-12, "and go on straight");
        let short = axis(&[straight(300.0)]);
        assert!(short.with_grades(0.15, &[change]).unwrap_err().to_string().contains("overlaps"));
    }

    #[test]
    fn coordinates_of_a_banked_grade() {
        let a =
            axis(&[straight(100.0)]).with_grades(0.1, &[]).unwrap().with_cross_slope(Profile::constant(0.05));
        let p = a.world(RoadPoint { s_m: 40.0, t_m: 6.0, h_m: 1.0 });
        assert!((p - DVec3::new(40.0, 6.0, 4.0 + 0.3 + 1.0)).length() < 1e-12);
        let n = a.normal(40.0, 6.0);
        assert!((n - DVec3::new(-0.1, -0.05, 1.0).normalize()).length() < 1e-12);
        let pose = a.pose(RoadPoint { s_m: 40.0, t_m: 0.0, h_m: 0.0 }, 0.0, true);
        assert!((pose.direction(DVec3::Z) - n).length() < 1e-12);
        let on = pose_on(DVec3::ZERO, n, 0.4);
        let x = on.direction(DVec3::X);
        assert!(
            (on.direction(DVec3::Z) - n).length() < 1e-12
                && (x.y.atan2(x.x) - 0.4).abs() < 1e-2
                && x.dot(n).abs() < 1e-12
        );
    }

    #[test]
    fn a_roof_falls_to_both_sides() {
        let (left, right) = (Profile::constant(-0.02), Profile::constant(0.03));
        let a = axis(&[straight(100.0)]).with_cross_slopes(left, right);
        for (t_m, z) in [(4.0, -0.08), (0.0, 0.0), (-5.0, -0.15)] {
            let p = RoadPoint { s_m: 40.0, t_m, h_m: 0.5 };
            let world = a.world(p);
            assert!((world - DVec3::new(40.0, t_m, z + 0.5)).length() < 1e-12, "{world}");
            let back = a.project(world);
            assert!((back.t_m - t_m).abs() < 1e-12 && (back.h_m - 0.5).abs() < 1e-12, "{back:?}");
        }
        assert!((a.normal(40.0, -1.0) - DVec3::new(0.0, -0.03, 1.0).normalize()).length() < 1e-12);
        assert!((a.normal(40.0, 1.0) - DVec3::new(0.0, 0.02, 1.0).normalize()).length() < 1e-12);
    }

    #[test]
    fn cubic_element_runs_at_constant_speed() {
        // A quarter of a circle as a Bezier-like cubic is good to 3e-4 of the radius.
        let k = 0.551_915_024_49;
        let (u, v) =
            ([0.0, 3.0 * k, 3.0 - 6.0 * k + 0.0, 3.0 * k - 2.0], [0.0, 0.0, 3.0 - 3.0 * k, 3.0 * k - 2.0]);
        let scale = |c: [f64; 4]| c.map(|x| 50.0 * x);
        let length_m = 25.0 * PI;
        let course = Course::Cubic { length_m, u: scale(u), v: scale(v), p_end: 1.0 };
        let a = axis(&[course, straight(10.0)]);
        for i in 1..10 {
            let s = length_m * f64::from(i) / 10.0;
            let angle = s / 50.0;
            let circle = DVec3::new(50.0 * angle.sin(), 50.0 * (1.0 - angle.cos()), 0.0);
            let p = a.at(s);
            assert!((p.position_m - circle).length() < 0.05 && (p.heading_rad - angle).abs() < 2e-3, "{s}");
        }
        assert!((a.at(length_m).heading_rad - FRAC_PI_2).abs() < 1e-6);
    }

    fn any_axis() -> impl Strategy<Value = RoadAxis> {
        let course = (1.0f64..200.0, -0.008f64..0.008, -0.008f64..0.008, 0..3);
        (prop::collection::vec(course, 1..5), -3.0f64..3.0, -0.1f64..0.1, -0.08f64..0.08).prop_map(
            |(list, heading, grade, slope)| {
                let courses: Vec<Course> = list
                    .into_iter()
                    .map(|(length_m, a, b, kind)| match kind {
                        0 => straight(length_m),
                        1 => Course::Arc { length_m, curvature_per_m: a },
                        _ => clothoid(length_m, a, b),
                    })
                    .collect();
                let axis = RoadAxis::new(DVec3::new(100.0, -50.0, 3.0), heading, &courses).unwrap();
                let end = axis.length_m();
                let change = GradeChange { s_m: 0.5 * end, grade: -grade, k_m_per_percent: 0.04 * end };
                let slope = Profile::linear(&[[0.0, 0.0], [end, slope]]).unwrap();
                axis.with_grades(grade, &[change]).unwrap().with_cross_slope(slope)
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn projection_inverts(axis in any_axis(), part in -0.05f64..1.05, t_m in -20.0f64..20.0, h_m in -1.0f64..5.0) {
            let p = axis.world(RoadPoint { s_m: part * axis.length_m(), t_m, h_m });
            let q = axis.project(p);
            // A road may meet itself again; then the nearest part counts.
            prop_assert!(q.t_m.abs() <= t_m.abs() + 1e-9);
            prop_assert!((axis.world(q) - p).length() < 1e-9, "{p} {q:?}");
            // No sampled point of the axis lies nearer.
            let n = 500;
            for i in 0..=n {
                let s = axis.length_m() * f64::from(i) / f64::from(n);
                let d = (axis.at(s).position_m - p).truncate().length();
                prop_assert!(d >= q.t_m.abs() - 1e-9, "{d} {q:?}");
            }
        }

        #[test]
        fn chords_stay_within_the_bound(axis in any_axis(), sagitta in 0.001f64..0.1) {
            let reach = 15.0;
            let stations = axis.stations_m(0.0, axis.length_m(), sagitta, reach, 0.0);
            for w in stations.windows(2) {
                prop_assert!(w[1] > w[0]);
                for t_m in [-reach, 0.0, reach] {
                    let at = |s_m: f64| axis.world(RoadPoint { s_m, t_m, h_m: 0.0 });
                    let (a, b) = (at(w[0]), at(w[1]));
                    let along = (b - a).normalize();
                    for i in 1..8 {
                        let p = at(w[0] + (w[1] - w[0]) * f64::from(i) / 8.0) - a;
                        let off = (p - along * p.dot(along)).length();
                        prop_assert!(off <= sagitta * 1.02 + 1e-9, "{off} > {sagitta} at {w:?} {t_m}");
                    }
                }
            }
        }
    }

    #[test]
    fn few_stations_where_the_road_is_straight() {
        let a = axis(&[straight(500.0), arc(100.0, 200.0), straight(500.0)]);
        let s = a.stations_m(0.0, a.length_m(), 0.005, 10.0, 20.0);
        // Chords of an arc: sqrt(8 R sagitta / (1 + t/R)) = 2.76 m.
        assert!((38..=42).contains(&s.len()), "{}", s.len());
        assert_eq!(a.stations_m(10.0, 400.0, 0.005, 10.0, 20.0), [10.0, 400.0]);
    }

    #[test]
    fn refuses_nonsense() {
        let e = |c: &[Course]| RoadAxis::new(DVec3::ZERO, 0.0, c).unwrap_err().to_string();
        assert!(e(&[]).contains("no element"));
        assert!(e(&[straight(-1.0)]).contains("not positive"));
        assert!(e(&[straight(f64::NAN)]).contains("not positive"));
        assert!(e(&[arc(1000.0, 0.5)]).contains("turns more than ten times"));
        assert!(e(&[straight(2e6)]).contains("too long"));
        assert!(e(&[clothoid(10.0, f64::INFINITY, 0.0)]).contains("not finite"));
    }
}
