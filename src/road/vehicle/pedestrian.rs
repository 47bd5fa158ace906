//! People: a torso with a head, swinging arms, and legs with knees, as closed smooth bodies of skin.
//!
//! Lengths of segments are shares of the stature after Drillis and Contini 1966 (in Winter, *Biomechanics and
//! Motor Control of Human Movement*, fig. 4.1); depths and breadths are those of a slim adult (chest 230 x
//! 320 mm, hips 220 x 340 mm, head 195 x 155 mm at 1.75 m).

use super::motion::{HIP_HEIGHT, Joint, Turn};
use super::part::{Paint, Part};
use super::surface::{limb, ovoid};
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};

/// Shares of the stature.
pub(super) const KNEE: f64 = 0.285;
pub(super) const SHOULDER: f64 = 0.818;
const UPPER_ARM: f64 = 0.186;
const FOREARM: f64 = 0.146;
/// The hip joints' and the shoulders' distance from the middle.
pub(super) const HIP_Y: f64 = 0.052;
const SHOULDER_Y: f64 = 0.133;
/// An arm that walks is bent by about this much at the elbow.
const ELBOW_RAD: f64 = 0.35;

const SKIN: u32 = Paint::Skin as u32;
const SEGMENTS: usize = 20;

fn scaled<const N: usize>(rings: [[f64; 4]; N], stature_m: f64) -> [[f64; 4]; N] {
    rings.map(|r| r.map(|x| x * stature_m))
}

/// Torso, neck and head, upright over the middle between the hips at z = 0.
pub(super) fn trunk(stature_m: f64, head: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let torso = [
        [-0.060, 0.0, 0.0, 0.0],
        [0.000, 0.062, 0.096, 0.0],
        [0.095, 0.056, 0.080, 0.0],
        [0.200, 0.066, 0.091, 0.0],
        [0.262, 0.055, 0.103, -0.004],
        [0.305, 0.0, 0.0, 0.0],
    ];
    limb(&mut mesh, &scaled(torso, stature_m), 28, 4, SKIN);
    if head {
        let neck = [
            [0.285, 0.0, 0.0, 0.0],
            [0.292, 0.034, 0.034, 0.0],
            [0.350, 0.033, 0.033, 0.004],
            [0.358, 0.0, 0.0, 0.0],
        ];
        limb(&mut mesh, &scaled(neck, stature_m), SEGMENTS, 3, SKIN);
        let centre = DVec3::new(0.006, 0.0, 1.0 - 0.0665 - HIP_HEIGHT);
        let half = DVec3::new(0.0555, 0.0440, 0.0665);
        ovoid(&mut mesh, centre * stature_m, half * stature_m, 24, 8, SKIN);
    }
    mesh
}

/// A thigh that hangs from the hip at the origin down to the knee.
pub(super) fn thigh(stature_m: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let length = HIP_HEIGHT - KNEE;
    let rings = [
        [-length - 0.024, 0.0, 0.0, 0.0],
        [-length, 0.033, 0.032, 0.002],
        [-0.130, 0.043, 0.042, 0.003],
        [-0.010, 0.050, 0.047, 0.0],
        [0.030, 0.0, 0.0, 0.0],
    ];
    limb(&mut mesh, &scaled(rings, stature_m), SEGMENTS, 4, SKIN);
    mesh
}

/// A shank with its foot, hanging from the knee at the origin; `foot_z` is the share of the stature by
/// which the foot's middle lies below the knee.
pub(super) fn shank(stature_m: f64, foot_z: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let rings = [
        [-0.262, 0.0, 0.0, 0.0],
        [-0.240, 0.022, 0.020, -0.004],
        [-0.090, 0.033, 0.032, -0.008],
        [-0.004, 0.030, 0.030, 0.0],
        [0.018, 0.0, 0.0, 0.0],
    ];
    limb(&mut mesh, &scaled(rings, stature_m), SEGMENTS, 4, SKIN);
    // The foot lies along x: 0.152 of the stature long.
    let mut foot = Mesh::default();
    let along = [
        [-0.045, 0.0, 0.0, 0.0],
        [-0.020, 0.022, 0.018, -0.002],
        [0.030, 0.026, 0.023, 0.0],
        [0.080, 0.016, 0.026, 0.009],
        [0.107, 0.0, 0.0, 0.0],
    ];
    limb(&mut foot, &scaled(along, stature_m), SEGMENTS, 3, SKIN);
    let lie = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    append(&mut mesh, &foot, &Pose::<Target, Target>::new(lie, DVec3::Z * -foot_z * stature_m));
    mesh
}

/// An arm that hangs from the shoulder at the origin, bent at the elbow.
fn arm(stature_m: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let upper = [
        [-UPPER_ARM - 0.014, 0.0, 0.0, 0.0],
        [-UPPER_ARM, 0.022, 0.021, 0.0],
        [-0.090, 0.027, 0.025, 0.0],
        [-0.010, 0.030, 0.029, 0.0],
        [0.022, 0.0, 0.0, 0.0],
    ];
    limb(&mut mesh, &scaled(upper, stature_m), SEGMENTS, 3, SKIN);
    let mut lower = Mesh::default();
    let fore = [
        [-FOREARM - 0.100, 0.0, 0.0, 0.0],
        [-FOREARM - 0.045, 0.022, 0.010, 0.0],
        [-FOREARM, 0.016, 0.013, 0.0],
        [-0.040, 0.023, 0.022, 0.0],
        [0.000, 0.021, 0.021, 0.0],
        [0.014, 0.0, 0.0, 0.0],
    ];
    limb(&mut lower, &scaled(fore, stature_m), SEGMENTS, 3, SKIN);
    let bend = DQuat::from_rotation_y(-ELBOW_RAD);
    append(&mut mesh, &lower, &Pose::<Target, Target>::new(bend, DVec3::Z * -UPPER_ARM * stature_m));
    mesh
}

/// A walker: trunk, two arms, two thighs, two shanks with feet.
pub(super) fn parts(stature_m: f64) -> Vec<Part> {
    let hip_z = HIP_HEIGHT * stature_m;
    let at = |y: f64, z: f64| DVec3::new(0.0, y, z) * stature_m;
    let joint = Joint::about_y;
    let trunk = weld(trunk(stature_m, true));
    let mut parts = vec![Part::hinged("trunk", "", trunk, at(0.0, HIP_HEIGHT), &[])];
    for (name, side, phase) in [("left", 1.0, 0.0), ("right", -1.0, 0.5)] {
        // The arm swings with the other leg.
        let shoulder = Turn::Shoulder { leg_m: hip_z, phase: phase + 0.5 };
        let (mesh, place) = (weld(arm(stature_m)), at(side * SHOULDER_Y, SHOULDER));
        parts.push(Part::hinged(format!("arm {name}"), "arm", mesh, place, &[joint(DVec3::ZERO, shoulder)]));
        let hip = joint(DVec3::ZERO, Turn::Hip { leg_m: hip_z, phase });
        let place = at(side * HIP_Y, HIP_HEIGHT);
        parts.push(Part::hinged(format!("thigh {name}"), "leg", weld(thigh(stature_m)), place, &[hip]));
        let knee = DVec3::Z * -(HIP_HEIGHT - KNEE) * stature_m;
        let knee = joint(knee, Turn::Knee { leg_m: hip_z, phase });
        let shank = weld(shank(stature_m, KNEE - 0.026));
        parts.push(Part::hinged(format!("shank {name}"), "leg", shank, place, &[hip, knee]));
    }
    parts
}
