//! A cyclist: bicycle with spoked wheels and cranks, and a rider whose legs follow the pedals.
//!
//! Wheels 622 mm (ISO 5775) with 37 mm tyres, wheelbase 1.06 m, cranks 170 mm; 5.6 m of road for a turn of
//! the cranks (40 teeth to 15). The tyre is taken as the metal of its rim under rubber.

use super::motion::{HIP_HEIGHT, Joint, Turn};
use super::part::{Paint, Part};
use super::pedestrian::{HIP_Y, KNEE, SHOULDER, shank, thigh, trunk};
use super::surface::{bar, hoop, limb, ovoid, tube};
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::TAU;

const STATURE_M: f64 = 1.75;
const WHEEL_RADIUS_M: f64 = 0.340;
const AXLE_X_M: f64 = 0.53;
const CRANK_M: f64 = 0.17;
const DEVELOPMENT_M: f64 = 5.6;
const SPOKES: usize = 28;
/// Bottom bracket, saddle, hips, head tube's ends, grips (left).
const BRACKET: DVec3 = DVec3::new(-0.11, 0.0, 0.285);
const SADDLE: DVec3 = DVec3::new(-0.29, 0.0, 0.90);
const HIP: DVec3 = DVec3::new(-0.27, 0.0, 0.975);
const HEAD: [DVec3; 2] = [DVec3::new(0.335, 0.0, 0.86), DVec3::new(0.375, 0.0, 0.70)];
const GRIP: DVec3 = DVec3::new(0.33, 0.27, 1.03);
/// Lean of the trunk from upright, rad.
const LEAN_RAD: f64 = 0.55;

const METAL: u32 = Paint::Aluminium as u32;
const SKIN: u32 = Paint::Skin as u32;

/// A bar along y about `middle`, `half_m` long to either side.
fn axle(mesh: &mut Mesh, middle: DVec3, half_m: f64, radius_m: f64) {
    let end = DVec3::Y * half_m;
    bar(mesh, middle - end, middle + end, radius_m, 12, METAL);
}

/// A pedal about the y axis, 90 x 90 x 24 mm: a barrel with round edges.
fn pedal() -> Mesh {
    let rings = [
        [-0.045, 0.0, 0.0, 0.0],
        [-0.036, 0.041, 0.0105, 0.0],
        [0.0, 0.045, 0.012, 0.0],
        [0.036, 0.041, 0.0105, 0.0],
        [0.045, 0.0, 0.0, 0.0],
    ];
    let (mut upright, mut mesh) = (Mesh::default(), Mesh::default());
    limb(&mut upright, &rings, 32, 4, METAL);
    let lie = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    append(&mut mesh, &upright, &Pose::<Target, Target>::new(lie, DVec3::ZERO));
    mesh
}

/// Cranks with the chainring, which is a toothed rim on four arms and no disc.
fn cranks() -> Mesh {
    let mut mesh = Mesh::default();
    axle(&mut mesh, DVec3::ZERO, 0.06, 0.01);
    let y = -0.043;
    let mut rim = Mesh::default();
    hoop(&mut rim, 0.074, DVec2::new(0.008, 0.002), (40, 8), METAL);
    append(&mut mesh, &rim, &Pose::<Target, Target>::new(DQuat::IDENTITY, DVec3::Y * y));
    for k in 0..4 {
        let (sin, cos) = (0.25 * TAU * (f64::from(k) + 0.5)).sin_cos();
        let out = |r: f64| DVec3::new(r * cos, y, r * sin);
        bar(&mut mesh, out(0.008), out(0.068), 0.004, 8, METAL);
    }
    for side in [1.0, -1.0] {
        let (a, b) = (DVec3::Y * side * 0.06, DVec3::new(side * CRANK_M, side * 0.07, 0.0));
        bar(&mut mesh, a, b, 0.011, 12, METAL);
    }
    mesh
}

/// Spoked wheel about the y axis.
fn wheel() -> Mesh {
    let mut mesh = Mesh::default();
    // Tyre and rim. Their sections bulge: the flat flanks of a polygon's would be cones, each a mirror to the side of its own angle.
    hoop(&mut mesh, 0.3215, DVec2::new(0.0185, 0.0185), (40, 8), Paint::Tyre as u32);
    hoop(&mut mesh, 0.2945, DVec2::new(0.0085, 0.012), (40, 8), METAL);
    for k in 0..SPOKES {
        let (sin, cos) = (TAU * k as f64 / SPOKES as f64).sin_cos();
        let side = if k % 2 == 0 { 0.03 } else { -0.03 };
        let out = |r: f64, y: f64| DVec3::new(r * cos, y, r * sin);
        tube(&mut mesh, (out(0.022, side), 0.001), (out(0.288, 0.0), 0.001), 6, Paint::Steel as u32);
    }
    axle(&mut mesh, DVec3::ZERO, 0.045, 0.02);
    mesh
}

fn frame() -> Mesh {
    let mut mesh = Mesh::default();
    let mut pipe = |a: DVec3, b: DVec3, r: f64| bar(&mut mesh, a, b, r, 12, METAL);
    let top_of_seat = BRACKET + 0.78 * (SADDLE - BRACKET);
    let rear = DVec3::new(-AXLE_X_M, 0.0, WHEEL_RADIUS_M);
    let front = DVec3::new(AXLE_X_M, 0.0, WHEEL_RADIUS_M);
    pipe(BRACKET, top_of_seat, 0.016);
    pipe(top_of_seat, SADDLE, 0.014);
    pipe(HEAD[0], HEAD[1], 0.018);
    pipe(top_of_seat, 0.9 * HEAD[0] + 0.1 * HEAD[1], 0.015);
    pipe(BRACKET, 0.1 * HEAD[0] + 0.9 * HEAD[1], 0.018);
    for side in [1.0, -1.0] {
        let y = DVec3::Y * side;
        pipe(BRACKET + 0.03 * y, rear + 0.06 * y, 0.009);
        pipe(top_of_seat + 0.02 * y, rear + 0.06 * y, 0.008);
        pipe(HEAD[1] + 0.05 * y - DVec3::Z * 0.02, front + 0.055 * y, 0.011);
        // The handlebar, swept back by 7 degrees from the stem, and its ends, back to the grips.
        let bend = DVec3::new(0.375, side * 0.20, 1.035);
        pipe(DVec3::new(0.40, 0.0, 1.03), bend, 0.012);
        pipe(bend, DVec3::new(GRIP.x, side * GRIP.y, GRIP.z), 0.012);
    }
    pipe(HEAD[1] - 0.06 * DVec3::Y - DVec3::Z * 0.02, HEAD[1] + 0.06 * DVec3::Y - DVec3::Z * 0.02, 0.012);
    pipe(HEAD[0], DVec3::new(0.40, 0.0, 1.03), 0.014);
    axle(&mut mesh, BRACKET, 0.035, 0.021);
    ovoid(&mut mesh, SADDLE, DVec3::new(0.13, 0.075, 0.03), 16, 4, METAL);
    mesh
}

/// Trunk, head and arms of a rider from the hips at `hip`, leaning forwards, with the hands at `grip`.
pub(super) fn rider(hip: DVec3, lean_rad: f64, grip: DVec3, stature_m: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let lean = DQuat::from_rotation_y(lean_rad);
    append(&mut mesh, &trunk(stature_m, false), &Pose::<Target, Target>::new(lean, hip));
    let neck = hip + lean * DVec3::Z * 0.285 * stature_m;
    let head = neck + DVec3::new(0.05, 0.0, 0.085) * stature_m;
    tube(&mut mesh, (neck, 0.036 * stature_m), (head, 0.032 * stature_m), 16, SKIN);
    ovoid(&mut mesh, head + DVec3::Z * 0.03, DVec3::new(0.0555, 0.044, 0.0665) * stature_m, 24, 8, SKIN);
    for side in [1.0, -1.0] {
        let shoulder = hip + lean * DVec3::new(0.0, side * 0.115, SHOULDER - HIP_HEIGHT) * stature_m;
        let hand = DVec3::new(grip.x, side * grip.y, grip.z);
        // The elbow, a little outwards and down from the line between.
        let elbow = 0.5 * (shoulder + hand) + DVec3::new(-0.03, side * 0.07, -0.05);
        tube(&mut mesh, (shoulder, 0.029 * stature_m), (elbow, 0.022 * stature_m), 16, SKIN);
        ovoid(&mut mesh, shoulder, DVec3::splat(0.0305 * stature_m), 16, 4, SKIN);
        ovoid(&mut mesh, elbow, DVec3::splat(0.0235 * stature_m), 16, 4, SKIN);
        tube(&mut mesh, (elbow, 0.022 * stature_m), (hand, 0.016 * stature_m), 16, SKIN);
        ovoid(&mut mesh, hand, DVec3::new(0.05, 0.045, 0.035), 16, 4, SKIN);
    }
    mesh
}

pub(super) fn parts() -> Vec<Part> {
    let turn = Joint::about_y;
    let mut parts = vec![
        Part::still("bicycle", "", weld(frame())),
        Part::still("rider", "rider", weld(rider(HIP, LEAN_RAD, GRIP, STATURE_M))),
    ];
    for (name, x) in [("wheel front", AXLE_X_M), ("wheel rear", -AXLE_X_M)] {
        let roll = turn(DVec3::ZERO, Turn::Roll { radius_m: WHEEL_RADIUS_M });
        let at = DVec3::new(x, 0.0, WHEEL_RADIUS_M);
        parts.push(Part::hinged(name, "wheel", weld(wheel()), at, &[roll]));
    }
    let crank = turn(DVec3::ZERO, Turn::Crank { development_m: DEVELOPMENT_M });
    parts.push(Part::hinged("cranks", "crank", weld(cranks()), BRACKET, &[crank]));
    let thigh_m = (HIP_HEIGHT - KNEE) * STATURE_M;
    // From the knee to the pedal's axle.
    let shank_m = 0.272 * STATURE_M;
    for (name, side) in [("left", 1.0), ("right", -1.0)] {
        let axle = DVec3::new(side * CRANK_M, side * 0.12, 0.0);
        let level = turn(axle, Turn::Level { development_m: DEVELOPMENT_M });
        parts.push(Part::hinged(format!("pedal {name}"), "crank", weld(pedal()), BRACKET, &[crank, level]));
        let hip = HIP + DVec3::Y * side * HIP_Y * STATURE_M;
        let law = |knee: bool| Turn::Pedal {
            crank_m: BRACKET - HIP,
            arm_m: CRANK_M,
            thigh_m,
            shank_m,
            development_m: DEVELOPMENT_M,
            half: side < 0.0,
            knee,
        };
        let at_hip = turn(DVec3::ZERO, law(false));
        let at_knee = turn(DVec3::Z * -thigh_m, law(true));
        let shank = weld(shank(STATURE_M, KNEE - 0.032));
        parts.push(Part::hinged(format!("thigh {name}"), "leg", weld(thigh(STATURE_M)), hip, &[at_hip]));
        parts.push(Part::hinged(format!("shank {name}"), "leg", shank, hip, &[at_hip, at_knee]));
    }
    parts
}
