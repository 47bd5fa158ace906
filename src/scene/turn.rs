//! How wheels and limbs turn while their owner goes along at a steady speed: closed forms of time, with their exact rates.

use glam::DVec3;
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
    Roll {
        /// Radius, m.
        radius_m: f64,
    },
    /// A pedal crank, about +y: one turn for each `development_m` of road.
    Crank {
        /// Way of one turn, m.
        development_m: f64,
    },
    /// Turns back what [`Turn::Crank`] does, so that a pedal stays level.
    Level {
        /// Way of one turn, m.
        development_m: f64,
    },
    /// A walker's leg at the hip, about +y; `leg_m` from hip to sole, `phase` in cycles.
    Hip {
        /// Length of the leg, m.
        leg_m: f64,
        /// Phase of the step at time zero, cycles.
        phase: f64,
    },
    /// The knee of that leg.
    Knee {
        /// Length of the leg, m.
        leg_m: f64,
        /// Phase of the step at time zero, cycles.
        phase: f64,
    },
    /// The arm at the shoulder, `phase` that of the leg on the other side.
    Shoulder {
        /// Length of the leg, m.
        leg_m: f64,
        /// Phase of the step at time zero, cycles.
        phase: f64,
    },
    /// A cyclist's thigh and, with `knee`, the shank against it, about +y. The sole's joint follows the
    /// crank about `crank_m`, seen from the hip.
    Pedal {
        /// Centre of the crank, m.
        crank_m: DVec3,
        /// Length of the crank, m.
        arm_m: f64,
        /// Length of the thigh, m.
        thigh_m: f64,
        /// Length of the shank, m.
        shank_m: f64,
        /// Way of one turn, m.
        development_m: f64,
        /// Whether it is the pedal half a turn behind.
        half: bool,
        /// Whether it is the shank.
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
