//! How wheels and limbs move while their owner goes along at a steady speed: closed forms of time, with
//! their exact rates.

use crate::frames::{Pose, Target};
use glam::{DQuat, DVec3};
use std::f64::consts::{PI, TAU};

/// Hip height over stature (Drillis and Contini 1966, in Winter, *Biomechanics and Motor Control of Human
/// Movement*, fig. 4.1).
pub const HIP_HEIGHT: f64 = 0.530;

/// Greatest flexion of the knee in the swing of a walk, about 60 degrees (Murray, Drought and Kory, J. Bone
/// Joint Surg. 46-A (1964) 335).
const KNEE_SWING_RAD: f64 = PI / 3.0;

/// Swing of the shoulder, degrees for each hip height a second (Boulic, Thalmann and Thalmann, *The Visual
/// Computer* 6 (1990) 344).
const SHOULDER_DEG: f64 = 9.88;

/// How an angle about a joint's axis runs with time, positive by the right hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// A wheel that rolls on the road without slip, about +y.
    Roll { radius_m: f64 },
    /// A pedal crank, about +y: one turn for each `development_m` of road.
    Crank { development_m: f64 },
    /// Turns back what [`Turn::Crank`] does, so that a pedal stays level.
    Level { development_m: f64 },
    /// A walker's leg at the hip, about +y; `leg_m` from hip to sole, `phase` in cycles.
    Hip { leg_m: f64, phase: f64 },
    /// The knee of that leg.
    Knee { leg_m: f64, phase: f64 },
    /// The arm at the shoulder, `phase` that of the leg on the other side.
    Shoulder { leg_m: f64, phase: f64 },
    /// A cyclist's thigh and, with `knee`, the shank against it, about +y. The sole's joint follows the
    /// crank about `crank_m`, seen from the hip.
    Pedal {
        crank_m: DVec3,
        arm_m: f64,
        thigh_m: f64,
        shank_m: f64,
        development_m: f64,
        half: bool,
        knee: bool,
    },
}

/// Cycle of a walk, s: cycle length = 1.346 sqrt(speed x hip height) (Boulic, Thalmann and Thalmann 1990,
/// from data up to 2.3 hip heights a second). Infinite at rest.
pub fn walk_cycle_s(speed_mps: f64, hip_m: f64) -> f64 {
    1.346 * (hip_m / speed_mps.abs()).sqrt()
}

impl Turn {
    /// Angle, rad, and its rate, rad/s, after `time_s` at `speed_mps`.
    pub fn at(&self, speed_mps: f64, time_s: f64) -> (f64, f64) {
        match *self {
            Turn::Roll { radius_m } => {
                let rate = speed_mps / radius_m;
                (turned(rate, time_s), rate)
            }
            Turn::Crank { development_m } | Turn::Level { development_m } => {
                let rate = TAU * speed_mps / development_m;
                let sign = if matches!(self, Turn::Level { .. }) { -1.0 } else { 1.0 };
                (sign * turned(rate, time_s), sign * rate)
            }
            Turn::Hip { leg_m, phase } => {
                // As wide as makes the sole stand still on the road in the middle of its stance, phase 0.
                let (cycle, rate) = gait(speed_mps, time_s, leg_m, phase);
                let swing = if rate == 0.0 { 0.0 } else { speed_mps / (leg_m * rate) };
                (swing * cycle.sin(), swing * rate * cycle.cos())
            }
            Turn::Knee { leg_m, phase } => {
                let (cycle, rate) = gait(speed_mps, time_s, leg_m, phase);
                let rise = 0.5 * (1.0 - cycle.cos());
                (KNEE_SWING_RAD * rise * rise, KNEE_SWING_RAD * rise * rate * cycle.sin())
            }
            Turn::Shoulder { leg_m, phase } => {
                let (cycle, rate) = gait(speed_mps, time_s, leg_m, phase);
                let swing = (SHOULDER_DEG * speed_mps / leg_m).to_radians();
                (swing * cycle.sin(), swing * rate * cycle.cos())
            }
            Turn::Pedal { crank_m, arm_m, thigh_m, shank_m, development_m, half, knee } => {
                let rate = TAU * speed_mps / development_m;
                let turn = turned(rate, time_s) + if half { PI } else { 0.0 };
                let (sin, cos) = turn.sin_cos();
                let foot = crank_m + arm_m * DVec3::new(cos, 0.0, -sin);
                let moves = arm_m * rate * DVec3::new(-sin, 0.0, -cos);
                two_bones(foot, moves, thigh_m, shank_m, knee)
            }
        }
    }
}

/// Angle after a time at a constant rate, within a turn.
fn turned(rate: f64, time_s: f64) -> f64 {
    (rate * time_s) % TAU
}

fn gait(speed_mps: f64, time_s: f64, leg_m: f64, phase: f64) -> (f64, f64) {
    let rate = TAU / walk_cycle_s(speed_mps, leg_m) * speed_mps.signum();
    if speed_mps == 0.0 { (0.0, 0.0) } else { (turned(rate, time_s) + TAU * phase, rate) }
}

/// Angle of the thigh, or of the shank against it, whose end is at `foot` from the hip in the plane of x and
/// z; hanging down is zero, and knees point forwards.
fn two_bones(foot: DVec3, moves: DVec3, thigh_m: f64, shank_m: f64, knee: bool) -> (f64, f64) {
    let d = foot.x.hypot(foot.z);
    let d_rate = (foot.x * moves.x + foot.z * moves.z) / d;
    if knee {
        let bend = ((thigh_m * thigh_m + shank_m * shank_m - d * d) / (2.0 * thigh_m * shank_m)).acos();
        return (PI - bend, -d * d_rate / (thigh_m * shank_m * bend.sin()));
    }
    let (a, b) = (thigh_m, (thigh_m * thigh_m - shank_m * shank_m) / (2.0 * thigh_m));
    let before = (b / d + d / (2.0 * a)).acos();
    let before_rate = -d_rate * (1.0 / (2.0 * a) - b / (d * d)) / before.sin();
    let line = (-foot.x).atan2(-foot.z);
    let line_rate = (moves.x * foot.z - foot.x * moves.z) / (d * d);
    (line - before, line_rate - before_rate)
}

/// A hinge; place and axis in the frame that it hangs on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    pub at_m: DVec3,
    /// Unit vector.
    pub axis: DVec3,
    pub turn: Turn,
}

/// Where a part is in its body's frame, and how it moves there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartMotion {
    pub pose: Pose<Target, Target>,
    /// Of the part's origin, in the body's frame and axes, m/s; the body's own velocity comes on top.
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
