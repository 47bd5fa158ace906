//! How bodies move: a chain of joints from the body to the world, each a rigid motion whose rates are exact (CONVENTIONS eq. 140).

use super::turn::Turn;
use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Target, World};
use glam::{DQuat, DVec3};
use std::ops::{Add, Div, Mul, Sub};
use std::sync::Arc;

/// A frame that moves, seen from another one at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moving {
    /// Rotation from the moving frame to the other one.
    pub rotation: DQuat,
    /// Position of the frame's origin, m.
    pub translation_m: DVec3,
    /// Velocity of the origin, m/s.
    pub velocity_mps: DVec3,
    /// Right-handed about its direction.
    pub spin_rad_per_s: DVec3,
}

impl Moving {
    /// A frame that is the other one.
    pub const REST: Moving = Moving {
        rotation: DQuat::IDENTITY,
        translation_m: DVec3::ZERO,
        velocity_mps: DVec3::ZERO,
        spin_rad_per_s: DVec3::ZERO,
    };

    /// A frame at rest in this pose.
    pub fn at_rest<A, B>(pose: &Pose<A, B>) -> Moving {
        Moving { rotation: pose.rotation, translation_m: pose.translation_m, ..Moving::REST }
    }

    /// The motion of `self` as seen from the frame in which `outer` lies: first `self`, then `outer`.
    pub fn then(&self, outer: &Moving) -> Moving {
        let arm = outer.rotation * self.translation_m;
        Moving {
            rotation: (outer.rotation * self.rotation).normalize(),
            translation_m: outer.translation_m + arm,
            velocity_mps: outer.velocity_mps
                + outer.spin_rad_per_s.cross(arm)
                + outer.rotation * self.velocity_mps,
            spin_rad_per_s: outer.spin_rad_per_s + outer.rotation * self.spin_rad_per_s,
        }
    }

    /// The pose at that instant.
    pub fn pose(&self) -> Pose<Target, World> {
        Pose::new(self.rotation, self.translation_m)
    }

    /// Velocity, m/s, of the body's particle at a place of the outer frame, m.
    #[inline]
    pub fn velocity_at(&self, place_m: DVec3) -> DVec3 {
        self.velocity_mps + self.spin_rad_per_s.cross(place_m - self.translation_m)
    }
}

/// How values lie between their times, as glTF names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Each value holds until the next.
    Step,
    /// Along straight lines; rotations along great circles.
    Linear,
    /// Cubic Hermite with a tangent before and after each time.
    Cubic,
}

/// Values over time; before the first and after the last they stand still, or go on at the rate that they have there. One that
/// repeats is at any time what it is at that time modulo its period.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel<T> {
    times_s: Vec<f64>,
    values: Vec<T>,
    /// (into, out of) each value, per second; for [`Interpolation::Cubic`] only.
    tangents: Vec<(T, T)>,
    interpolation: Interpolation,
    repeat_s: Option<f64>,
    goes_on: bool,
}

/// Where a time lies: the interval's first value, the share of it that has passed, and its length.
enum TimeInterval {
    At(usize),
    Between(usize, f64, f64),
}

impl<T: Copy> Channel<T> {
    /// Makes a channel of values over time.
    ///
    /// # Errors
    /// Returns an error if there are no values, times do not increase, or a cubic does not have one pair of tangents
    /// for each value.
    pub fn new(
        times_s: Vec<f64>,
        values: Vec<T>,
        tangents: Vec<(T, T)>,
        interpolation: Interpolation,
    ) -> Result<Channel<T>> {
        let bad = |what: &str, value: String, allowed: &str| -> crate::base::error::Error {
            BadInput::new(what).key("keyframes").value(value).allowed(allowed).into()
        };
        if values.is_empty() || times_s.len() != values.len() {
            let counts = format!("{} times, {} values", times_s.len(), values.len());
            return Err(bad(
                "a motion needs one time for each value",
                counts,
                "one or more, as many times as values",
            ));
        }
        let wrong = |w: &[f64]| w[0].is_nan() || w[1].is_nan() || w[0] >= w[1];
        if let Some(i) = times_s.windows(2).position(wrong) {
            let pair = format!("{} s, {} s at {i}", times_s[i], times_s[i + 1]);
            return Err(bad("the times of a motion do not increase", pair, "each later than the one before"));
        }
        let wanted = if interpolation == Interpolation::Cubic { values.len() } else { 0 };
        if tangents.len() != wanted {
            let count = tangents.len().to_string();
            return Err(bad(
                "wrong number of tangents",
                count,
                "a pair for each value of a cubic, else none",
            ));
        }
        Ok(Channel { times_s, values, tangents, interpolation, repeat_s: None, goes_on: false })
    }

    /// The channel that repeats itself after `period_s`.
    ///
    /// # Errors
    /// Returns an error for a period that is not above zero and finite.
    ///
    /// # Example
    /// A body that goes to and fro over 4 m with a period of 4 s.
    ///
    /// ```
    /// use catseye::scene::motion::{Channel, Interpolation};
    /// use glam::DVec3;
    ///
    /// let ends_m = vec![DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::ZERO];
    /// let to_and_fro = Channel::new(vec![0.0, 2.0, 4.0], ends_m, Vec::new(), Interpolation::Linear)?.repeated(4.0)?;
    /// // Position in m and velocity in m/s, half a second after the fifth start and after the turn that follows it.
    /// assert_eq!(to_and_fro.at(16.5), (DVec3::new(1.0, 0.0, 0.0), DVec3::new(2.0, 0.0, 0.0)));
    /// assert_eq!(to_and_fro.at(18.5), (DVec3::new(3.0, 0.0, 0.0), DVec3::new(-2.0, 0.0, 0.0)));
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn repeated(self, period_s: f64) -> Result<Channel<T>> {
        if !(period_s.is_finite() && period_s > 0.0) {
            return Err(BadInput::new("is not a period of a motion")
                .key("repeat_s")
                .value(period_s)
                .allowed("above 0 s")
                .into());
        }
        Ok(Channel { repeat_s: Some(period_s), ..self })
    }

    /// The channel that goes on beyond its ends at the rate that it has there. Rotations stand still all the same.
    pub fn going_on(self) -> Channel<T> {
        Channel { goes_on: true, ..self }
    }

    /// Whether the channel goes on beyond its ends.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Times, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Values at the times; of cubic curves tangents stand between them.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Tangents (into, out of) each value, per second; empty unless [`Interpolation::Cubic`].
    pub fn tangents(&self) -> &[(T, T)] {
        &self.tangents
    }

    /// How values lie between their times.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Period of the channel, s, if it repeats.
    pub fn repeat_s(&self) -> Option<f64> {
        self.repeat_s
    }

    fn place(&self, time_s: f64) -> TimeInterval {
        let time_s = self.repeat_s.map_or(time_s, |period| time_s.rem_euclid(period));
        let after = self.times_s.partition_point(|t| *t <= time_s);
        if after == 0 {
            return TimeInterval::At(0);
        }
        let i = after - 1;
        if after == self.times_s.len() || self.interpolation == Interpolation::Step {
            return TimeInterval::At(i);
        }
        let length = self.times_s[after] - self.times_s[i];
        TimeInterval::Between(i, (time_s - self.times_s[i]) / length, length)
    }
}

/// Weights of (value, out-tangent, in-tangent, next value) of a cubic Hermite, and their derivatives by the share `u`; tangents
/// already times the interval.
fn hermite(u: f64) -> ([f64; 4], [f64; 4]) {
    let (u2, u3) = (u * u, u * u * u);
    (
        [2.0 * u3 - 3.0 * u2 + 1.0, u3 - 2.0 * u2 + u, u3 - u2, -2.0 * u3 + 3.0 * u2],
        [6.0 * u2 - 6.0 * u, 3.0 * u2 - 4.0 * u + 1.0, 3.0 * u2 - 2.0 * u, -6.0 * u2 + 6.0 * u],
    )
}

/// What can be added and multiplied by numbers.
pub trait Linear:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> + Div<f64, Output = Self>
{
    /// Nothing.
    const ZERO: Self;
}

impl Linear for f64 {
    const ZERO: f64 = 0.0;
}

impl Linear for DVec3 {
    const ZERO: DVec3 = DVec3::ZERO;
}

impl<T: Linear> Channel<T> {
    /// Value and its rate at a time.
    pub fn at(&self, time_s: f64) -> (T, T) {
        if let Some(end) = self.beyond(time_s) {
            return end;
        }
        match self.place(time_s) {
            TimeInterval::At(i) => (self.values[i], T::ZERO),
            TimeInterval::Between(i, u, length) => {
                let (a, b) = (self.values[i], self.values[i + 1]);
                if self.interpolation == Interpolation::Linear {
                    return (a + (b - a) * u, (b - a) / length);
                }
                let (out, into) = (self.tangents[i].1 * length, self.tangents[i + 1].0 * length);
                let (w, d) = hermite(u);
                (
                    a * w[0] + out * w[1] + into * w[2] + b * w[3],
                    (a * d[0] + out * d[1] + into * d[2] + b * d[3]) / length,
                )
            }
        }
    }

    /// Value and rate at a time beyond the ends of one that goes on; the last key itself counts as beyond.
    fn beyond(&self, time_s: f64) -> Option<(T, T)> {
        let last = self.times_s.len() - 1;
        let i = match time_s {
            _ if !self.goes_on || self.repeat_s.is_some() => return None,
            t if t < self.times_s[0] => 0,
            t if t >= self.times_s[last] => last,
            _ => return None,
        };
        let rate = match self.interpolation {
            Interpolation::Cubic if i == 0 => self.tangents[0].0,
            Interpolation::Cubic => self.tangents[last].1,
            Interpolation::Linear if last > 0 => {
                let k = i.min(last - 1);
                (self.values[k + 1] - self.values[k]) / (self.times_s[k + 1] - self.times_s[k])
            }
            Interpolation::Linear | Interpolation::Step => T::ZERO,
        };
        Some((self.values[i] + rate * (time_s - self.times_s[i]), rate))
    }
}

impl Channel<DQuat> {
    /// Rotation at a time, and its spin in rad/s along the outer axes. Linear interpolation is at a constant spin, the
    /// short way round.
    pub fn at(&self, time_s: f64) -> (DQuat, DVec3) {
        match self.place(time_s) {
            TimeInterval::At(i) => (self.values[i], DVec3::ZERO),
            TimeInterval::Between(i, u, length) => {
                let (a, b) = (self.values[i], self.values[i + 1]);
                if self.interpolation == Interpolation::Linear {
                    let mut turn = b * a.inverse();
                    if turn.w < 0.0 {
                        turn = -turn;
                    }
                    let turned = turn.to_scaled_axis();
                    return (DQuat::from_scaled_axis(turned * u) * a, turned / length);
                }
                let (out, into) = (self.tangents[i].1 * length, self.tangents[i + 1].0 * length);
                let (w, d) = hermite(u);
                let sum = |w: [f64; 4]| a * w[0] + out * w[1] + into * w[2] + b * w[3];
                let (q, dq) = (sum(w), sum(d) * (1.0 / length));
                let size = q.length();
                // What changes the length drops out of the vector part of q' q*.
                let rate = dq * q.conjugate() * (2.0 / (size * size));
                (q * (1.0 / size), DVec3::new(rate.x, rate.y, rate.z))
            }
        }
    }
}

/// One rigid motion of a chain.
#[derive(Debug, Clone, PartialEq)]
pub enum Joint {
    /// A rotation and a translation in m that do not change.
    Fixed(DQuat, DVec3),
    /// Away from where it is at time zero, m/s.
    Line(DVec3),
    /// A steady turn about an axis (unit vector) through the origin: `angle_rad` at time zero.
    Spin {
        /// Unit vector of the axis.
        axis: DVec3,
        /// Rate, rad/s.
        rate_rad_per_s: f64,
        /// Angle at time zero, rad.
        angle_rad: f64,
    },
    /// A swing to and fro about an axis: angle amplitude × sin(rate t + phase).
    Swing {
        /// Unit vector of the axis.
        axis: DVec3,
        /// Amplitude, rad.
        amplitude_rad: f64,
        /// Rate, rad/s.
        rate_rad_per_s: f64,
        /// Phase at time zero, rad.
        phase_rad: f64,
    },
    /// A turn about an axis through a place: a wheel or a limb of what goes at a steady speed, whose clock is ahead by
    /// `clock_s`.
    Hinge {
        /// A place on the axis, m.
        at_m: DVec3,
        /// Unit vector of the axis.
        axis: DVec3,
        /// How the angle runs with time.
        turn: Turn,
        /// Speed of the owner, m/s.
        speed_mps: f64,
        /// How far its clock is ahead, s.
        clock_s: f64,
        /// Way that the owner has gone, m, where its speed changes: the limb then keeps to the way, at the stride of `speed_mps`.
        way_m: Option<Arc<Channel<f64>>>,
    },
    /// A turn about an axis by the distance that was travelled over the radius: a wheel.
    Roll {
        /// Unit vector of the axis.
        axis: DVec3,
        /// Radius of the wheel, m.
        radius_m: f64,
        /// Distance that was travelled, m.
        distance_m: Arc<Channel<f64>>,
    },
    /// A motion that is given by positions and rotations over time.
    Track {
        /// Positions, m.
        position_m: Option<Arc<Channel<DVec3>>>,
        /// Rotations.
        rotation: Option<Arc<Channel<DQuat>>>,
    },
}

impl Joint {
    fn at(&self, time_s: f64) -> Moving {
        let turned = |axis: DVec3, angle: f64, rate: f64| Moving {
            rotation: DQuat::from_axis_angle(axis, angle),
            spin_rad_per_s: axis * rate,
            ..Moving::REST
        };
        match self {
            Joint::Fixed(rotation, translation_m) => {
                Moving { rotation: *rotation, translation_m: *translation_m, ..Moving::REST }
            }
            Joint::Line(v) => Moving { translation_m: *v * time_s, velocity_mps: *v, ..Moving::REST },
            Joint::Spin { axis, rate_rad_per_s, angle_rad } => {
                turned(*axis, angle_rad + rate_rad_per_s * time_s, *rate_rad_per_s)
            }
            Joint::Swing { axis, amplitude_rad, rate_rad_per_s, phase_rad } => {
                let (s, c) = (rate_rad_per_s * time_s + phase_rad).sin_cos();
                turned(*axis, amplitude_rad * s, amplitude_rad * rate_rad_per_s * c)
            }
            Joint::Hinge { at_m, axis, turn, speed_mps, clock_s, way_m } => {
                let (gone_s, pace) = match way_m {
                    None => (time_s, 1.0),
                    Some(_) if *speed_mps == 0.0 => (0.0, 0.0),
                    Some(way) => {
                        let (way_m, rate_mps) = way.at(time_s);
                        (way_m / speed_mps, rate_mps / speed_mps)
                    }
                };
                let (angle, rate) = turn.at(*speed_mps, gone_s + clock_s);
                Moving { translation_m: *at_m, ..turned(*axis, angle, rate * pace) }
            }
            Joint::Roll { axis, radius_m, distance_m } => {
                let (s, rate) = distance_m.at(time_s);
                turned(*axis, s / radius_m, rate / radius_m)
            }
            Joint::Track { position_m, rotation } => {
                let (translation_m, velocity_mps) =
                    position_m.as_ref().map_or((DVec3::ZERO, DVec3::ZERO), |c| c.at(time_s));
                let (rotation, spin_rad_per_s) =
                    rotation.as_ref().map_or((DQuat::IDENTITY, DVec3::ZERO), |c| c.at(time_s));
                Moving { rotation, translation_m, velocity_mps, spin_rad_per_s }
            }
        }
    }

    /// When it changes how it moves.
    fn times_s(&self) -> Vec<f64> {
        match self {
            Joint::Roll { distance_m, .. } | Joint::Hinge { way_m: Some(distance_m), .. } => {
                distance_m.times_s.clone()
            }
            Joint::Track { position_m, rotation } => {
                let p = position_m.iter().flat_map(|c| c.times_s.iter().copied());
                p.chain(rotation.iter().flat_map(|c| c.times_s.iter().copied())).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Joints from the body outwards to the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// The joints.
    pub joints: Vec<Joint>,
}

impl Motion {
    /// Pose and velocity of the body in the world at a time.
    pub fn at(&self, time_s: f64) -> Moving {
        self.joints.iter().fold(Moving::REST, |inner, joint| inner.then(&joint.at(time_s)))
    }

    /// First and last time at which any of its keyed motions has a key (of the first round, where it repeats); None
    /// without any.
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let times: Vec<f64> = self.joints.iter().flat_map(Joint::times_s).collect();
        let first = times.iter().copied().min_by(f64::total_cmp)?;
        Some((first, times.iter().copied().max_by(f64::total_cmp)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn track() -> Joint {
        let p = DVec3::new;
        let position = Channel::new(
            vec![0.0, 1.0, 2.5],
            vec![p(0.0, 0.0, 0.0), p(10.0, 1.0, 0.2), p(20.0, -3.0, 0.0)],
            vec![
                (p(9.0, 0.0, 0.0), p(9.0, 0.0, 0.0)),
                (p(9.0, 1.0, 0.1), p(9.0, 1.0, 0.1)),
                (p(5.0, 0.0, 0.0), p(5.0, 0.0, 0.0)),
            ],
            Interpolation::Cubic,
        );
        let q = |yaw: f64, pitch: f64| DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch);
        let rotation = Channel::new(
            vec![0.0, 1.2, 2.5],
            vec![q(0.1, 0.0), -q(1.0, 0.3), q(-0.4, 0.1)],
            vec![],
            Interpolation::Linear,
        );
        Joint::Track {
            position_m: Some(Arc::new(position.unwrap())),
            rotation: Some(Arc::new(rotation.unwrap())),
        }
    }

    fn distance() -> Arc<Channel<f64>> {
        let c = Channel::new(
            vec![0.0, 1.0, 2.5],
            vec![0.0, 10.0, 22.0],
            vec![(9.0, 9.0), (9.1, 9.1), (5.0, 5.0)],
            Interpolation::Cubic,
        );
        Arc::new(c.unwrap())
    }

    fn cubic_turn() -> Joint {
        let q = DQuat::from_axis_angle;
        let (a, b) = (q(DVec3::Z, 0.2), q(DVec3::new(0.6, 0.0, 0.8), 1.1));
        let slope = (b + a * -1.0) * 0.4;
        let c = Channel::new(
            vec![0.0, 2.5],
            vec![a, b],
            vec![(slope, slope), (slope, slope)],
            Interpolation::Cubic,
        );
        Joint::Track { position_m: None, rotation: Some(Arc::new(c.unwrap())) }
    }

    fn chains() -> Vec<Motion> {
        let wheel = Joint::Roll { axis: DVec3::Y, radius_m: 0.3, distance_m: distance() };
        let hub = Joint::Fixed(DQuat::from_rotation_x(0.02), DVec3::new(1.3, 0.8, 0.3));
        let swing = Joint::Swing { axis: DVec3::Y, amplitude_rad: 0.6, rate_rad_per_s: 7.0, phase_rad: 0.4 };
        let spin = Joint::Spin { axis: DVec3::Z, rate_rad_per_s: -3.0, angle_rad: 1.0 };
        vec![
            Motion { joints: vec![Joint::Line(DVec3::new(3.0, -1.0, 0.0))] },
            Motion { joints: vec![wheel, hub.clone(), track()] },
            Motion { joints: vec![swing, hub.clone(), spin, Joint::Line(DVec3::X)] },
            Motion { joints: vec![hub, cubic_turn(), track()] },
        ]
    }

    proptest! {
        /// Rates are what differences of places say, for any particle of the body.
        #[test]
        fn rates_are_derivatives(which in 0usize..4, t in 0.05f64..2.4, x in -1.0f64..1.0, y in -1.0f64..1.0) {
            prop_assume!((t - 1.0).abs() > 1e-3 && (t - 1.2).abs() > 1e-3);
            let motion = &chains()[which];
            let particle = DVec3::new(x, y, 0.3);
            let at = |t: f64| motion.at(t).pose().point(particle);
            let h = 1e-5;
            let now = motion.at(t);
            let slope = (at(t + h) - at(t - h)) / (2.0 * h);
            let rate = now.velocity_at(at(t));
            prop_assert!((slope - rate).length() < 1e-6, "{slope} {rate}");
        }
    }

    #[test]
    fn a_wheel_does_not_slip() {
        let forward =
            Channel::new(vec![0.0, 2.0], vec![DVec3::ZERO, DVec3::X * 30.0], vec![], Interpolation::Linear);
        let distance = Channel::new(vec![0.0, 2.0], vec![0.0, 30.0], vec![], Interpolation::Linear).unwrap();
        let wheel = Motion {
            joints: vec![
                Joint::Roll { axis: DVec3::Y, radius_m: 0.32, distance_m: Arc::new(distance) },
                Joint::Fixed(DQuat::IDENTITY, DVec3::Z * 0.32),
                Joint::Track { position_m: Some(Arc::new(forward.unwrap())), rotation: None },
            ],
        };
        for t in [0.1, 0.7, 1.9] {
            let m = wheel.at(t);
            let touches = m.translation_m - DVec3::Z * 0.32;
            assert!(m.velocity_at(touches).length() < 1e-12);
            assert!((m.velocity_at(m.translation_m + DVec3::Z * 0.32) - DVec3::X * 30.0).length() < 1e-12);
        }
        assert_eq!(wheel.span_s(), Some((0.0, 2.0)));
        assert_eq!(wheel.at(5.0).velocity_mps, DVec3::ZERO);
    }

    #[test]
    fn what_repeats_starts_again() {
        let there = vec![DVec3::ZERO, DVec3::X * 3.0];
        let once = Channel::new(vec![0.5, 2.0], there, vec![], Interpolation::Linear).unwrap();
        let again = once.clone().repeated(2.0).unwrap();
        assert_eq!(again.repeat_s(), Some(2.0));
        for t in [0.0, 0.3, 0.6, 1.25, 1.75] {
            for round in [-4.0, -2.0, 0.0, 2.0, 200.0] {
                let ((a, da), (b, db)) = (again.at(t + round), once.at(t));
                assert!((a - b).length() < 1e-12 && da == db, "{t} {round}");
            }
        }
        assert_eq!(once.at(2.5), (DVec3::X * 3.0, DVec3::ZERO));
        for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(once.clone().repeated(period).is_err());
        }
    }

    #[test]
    fn wrong_keys_are_refused() {
        let linear = |t: Vec<f64>, v: Vec<f64>| Channel::new(t, v, vec![], Interpolation::Linear);
        assert!(linear(vec![], vec![]).is_err());
        assert!(linear(vec![0.0, 0.0], vec![1.0, 2.0]).is_err());
        assert!(linear(vec![0.0, f64::NAN], vec![1.0, 2.0]).is_err());
        assert!(linear(vec![0.0], vec![1.0, 2.0]).is_err());
        assert!(Channel::new(vec![0.0], vec![1.0], vec![], Interpolation::Cubic).is_err());
    }
}
