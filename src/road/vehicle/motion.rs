//! Parts that hang on one another by hinges, in the frame of their body.

use crate::base::frames::{Pose, Target};
pub use crate::scene::turn::{HIP_HEIGHT, Turn, walk_cycle_s};
use glam::{DQuat, DVec3};

/// A hinge; place and axis in the frame that it hangs on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// A place on the axis, m.
    pub at_m: DVec3,
    /// Unit vector.
    pub axis: DVec3,
    /// How the angle runs with time.
    pub turn: Turn,
}

impl Joint {
    /// A joint that turns about the y axis through `at_m`.
    pub fn about_y(at_m: DVec3, turn: Turn) -> Joint {
        Joint { at_m, axis: DVec3::Y, turn }
    }
}

/// Pose of a part in its body's frame, and how it moves there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartMotion {
    /// The part's frame in the body's.
    pub pose: Pose<Target, Target>,
    /// Velocity of the part's origin in the body's frame and axes, m/s; the body's own velocity is added to
    /// it.
    pub velocity_mps: DVec3,
    /// rad/s, in the body's axes.
    pub angular_velocity_radps: DVec3,
}

impl PartMotion {
    /// Velocity of the point `p` of the part's frame, in the body's frame and axes, m/s.
    pub fn velocity_at(&self, p: DVec3) -> DVec3 {
        self.velocity_mps + self.angular_velocity_radps.cross(self.pose.direction(p))
    }
}

/// Follows the joints one after the other from the frame `root` of the body.
pub fn follow(root: &Pose<Target, Target>, joints: &[Joint], speed_mps: f64, time_s: f64) -> PartMotion {
    let (mut rotation, mut at) = (root.rotation, root.translation_m);
    let (mut velocity, mut spin) = (DVec3::ZERO, DVec3::ZERO);
    for joint in joints {
        let arm = rotation * joint.at_m;
        at += arm;
        velocity += spin.cross(arm);
        let (angle, rate) = joint.turn.at(speed_mps, time_s);
        spin += rate * (rotation * joint.axis);
        rotation *= DQuat::from_axis_angle(joint.axis, angle);
    }
    PartMotion { pose: Pose::new(rotation, at), velocity_mps: velocity, angular_velocity_radps: spin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn joint(at_m: DVec3, turn: Turn) -> Joint {
        Joint { at_m, axis: DVec3::Y, turn }
    }

    /// Poses, differenced, give the velocities.
    fn check_rates(root: &Pose<Target, Target>, joints: &[Joint], speed: f64) {
        const H: f64 = 1e-5;
        for i in 0..40 {
            let t = 0.037 * f64::from(i);
            let now = follow(root, joints, speed, t);
            let (a, b) = (follow(root, joints, speed, t - H), follow(root, joints, speed, t + H));
            for p in [DVec3::ZERO, DVec3::new(0.1, 0.2, -0.4)] {
                let slope = (b.pose.point(p) - a.pose.point(p)) / (2.0 * H);
                assert!((slope - now.velocity_at(p)).length() < 1e-6 * (1.0 + slope.length()), "{t} {p}");
            }
        }
    }

    #[test]
    fn a_rolling_wheel_stands_on_the_road() {
        let root = Pose::new(DQuat::IDENTITY, DVec3::new(1.4, 0.8, 0.33));
        let wheel = [joint(DVec3::ZERO, Turn::Roll { radius_m: 0.33 })];
        for (speed, time) in [(0.0, 3.0), (13.9, 0.0), (13.9, 1.7), (-5.0, 0.4)] {
            let m = follow(&root, &wheel, speed, time);
            let down = m.pose.rotation.inverse() * DVec3::new(0.0, 0.0, -0.33);
            // v - omega r = 0 at the road, 2 v at the top.
            assert!((m.velocity_at(down) + DVec3::X * speed).length() < 1e-12 * (1.0 + speed.abs()));
            assert!((m.velocity_at(-down) - DVec3::X * speed).length() < 1e-12 * (1.0 + speed.abs()));
            assert_eq!(m.velocity_at(DVec3::ZERO), DVec3::ZERO);
        }
        // After one circumference it has turned once.
        let (angle, _) = Turn::Roll { radius_m: 0.33 }.at(1.0, TAU * 0.33 * (1.0 + 1e-12));
        assert!(angle.abs() < 1e-9);
    }

    #[test]
    fn rates_are_the_slopes_of_poses() {
        let root = Pose::from_yaw_pitch_roll(DVec3::new(0.1, 0.2, 0.9), 0.3, 0.2, 0.1);
        check_rates(&root, &[joint(DVec3::ZERO, Turn::Roll { radius_m: 0.3 })], 8.0);
        let leg_m = 0.93;
        for phase in [0.0, 0.5, 0.2] {
            let thigh = joint(DVec3::ZERO, Turn::Hip { leg_m, phase });
            let shank = joint(DVec3::new(0.0, 0.0, -0.43), Turn::Knee { leg_m, phase });
            check_rates(&root, &[thigh, shank], 1.4);
            check_rates(&root, &[joint(DVec3::ZERO, Turn::Shoulder { leg_m, phase })], 0.7);
        }
        for half in [false, true] {
            let pedal = |knee| Turn::Pedal {
                crank_m: DVec3::new(0.22, 0.0, -0.68),
                arm_m: 0.17,
                thigh_m: 0.44,
                shank_m: 0.46,
                development_m: 5.0,
                half,
                knee,
            };
            let legs = [joint(DVec3::ZERO, pedal(false)), joint(DVec3::new(0.0, 0.0, -0.44), pedal(true))];
            check_rates(&root, &legs, 5.0);
            // The end of the shank is on the pedal.
            let m = follow(&Pose::IDENTITY, &legs, 5.0, 0.21);
            let sole = m.pose.point(DVec3::new(0.0, 0.0, -0.46));
            let (turn, _) = Turn::Crank { development_m: 5.0 }.at(5.0, 0.21);
            let turn = turn + if half { PI } else { 0.0 };
            let expected = DVec3::new(0.22 + 0.17 * turn.cos(), 0.0, -0.68 - 0.17 * turn.sin());
            assert!((sole - expected).length() < 1e-12, "{sole} {expected}");
        }
    }

    #[test]
    fn the_walk_has_boulics_cycle_and_a_standing_sole() {
        let (leg_m, speed) = (0.93, 1.4);
        let cycle = walk_cycle_s(speed, leg_m);
        // Cycle length 1.346 sqrt(v H) = 1.536 m.
        assert!((cycle * speed - 1.346 * (speed * leg_m).sqrt()).abs() < 1e-12);
        assert!((cycle - 1.0970).abs() < 1e-3, "{cycle}");
        let hip = joint(DVec3::ZERO, Turn::Hip { leg_m, phase: 0.0 });
        let knee = joint(DVec3::new(0.0, 0.0, -0.43), Turn::Knee { leg_m, phase: 0.0 });
        let sole = DVec3::new(0.0, 0.0, -(leg_m - 0.43));
        let m = follow(&Pose::IDENTITY, &[hip, knee], speed, 0.0);
        assert!((m.velocity_at(sole) + DVec3::X * speed).length() < 1e-12);
        // In the middle of its swing the foot is lifted; later it is up to three times as fast as the body.
        let m = follow(&Pose::IDENTITY, &[hip, knee], speed, 0.5 * cycle);
        assert!(m.pose.point(sole).z > -0.8 * leg_m);
        let fastest = (0..200)
            .map(|i| {
                follow(&Pose::IDENTITY, &[hip, knee], speed, cycle * f64::from(i) / 200.0).velocity_at(sole).x
            })
            .fold(0.0, f64::max);
        assert!((2.3..3.3).contains(&((fastest + speed) / speed)), "{fastest}");
        // The same place one cycle later; hips swing as far as people's do, 15 to 25 degrees.
        let (a, b) = (hip.turn.at(speed, 0.3), hip.turn.at(speed, 0.3 + cycle));
        assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9);
        let reach = hip.turn.at(speed, 0.25 * cycle).0.to_degrees();
        assert!((14.0..25.0).contains(&reach), "{reach}");
        // At rest nothing moves.
        assert_eq!(hip.turn.at(0.0, 7.0), (0.0, 0.0));
        assert_eq!(knee.turn.at(0.0, 7.0), (0.0, 0.0));
    }
}
