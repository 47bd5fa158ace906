//! A motorcycle of the middle class with its rider: 2.1 m long, wheelbase 1.42 m, tyres 120/70 and 160/60 on
//! 17 inches (ISO 4249-1).

use super::cyclist::rider;
use super::motion::{HIP_HEIGHT, Joint, Turn};
use super::part::{Paint, Part};
use super::pedestrian::{HIP_Y, KNEE, shank, thigh};
use super::surface::{bar, block, ovoid};
use super::wheel::Wheel;
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};

const STATURE_M: f64 = 1.75;
/// Axles' x; hips; grips (left).
const AXLES: [f64; 2] = [0.72, -0.70];
const RADII_M: [f64; 2] = [0.300, 0.312];
const HIP: DVec3 = DVec3::new(-0.24, 0.0, 0.88);
const GRIP: DVec3 = DVec3::new(0.30, 0.36, 1.05);

const STEEL: u32 = Paint::Steel as u32;
const METAL: u32 = Paint::Aluminium as u32;

fn machine() -> Mesh {
    let mut mesh = Mesh::default();
    let p = DVec3::new;
    // Tank, seat, tail, cowl of the lamp.
    ovoid(&mut mesh, p(0.10, 0.0, 0.86), p(0.27, 0.16, 0.14), 24, 8, STEEL);
    ovoid(&mut mesh, p(-0.38, 0.0, 0.80), p(0.34, 0.15, 0.07), 24, 6, METAL);
    ovoid(&mut mesh, p(0.50, 0.0, 0.92), p(0.11, 0.12, 0.13), 24, 6, METAL);
    // Engine: case and two finned cylinders leaning forwards, radiator before it.
    block(&mut mesh, p(-0.22, -0.17, 0.26), p(0.26, 0.17, 0.48), METAL);
    for k in 0..7 {
        let z = 0.49 + 0.03 * f64::from(k);
        let x = 0.09 + 0.012 * f64::from(k);
        block(&mut mesh, p(x - 0.10, -0.16, z), p(x + 0.10, 0.16, z + 0.008), METAL);
    }
    block(&mut mesh, p(0.00, -0.13, 0.482), p(0.17, 0.13, 0.70), METAL);
    let mut pipe = |a: DVec3, b: DVec3, r: f64, m: u32| bar(&mut mesh, a, b, r, 12, m);
    for side in [1.0, -1.0] {
        let y = side;
        // Fork, frame, swing arm, handlebar, mirrors' stalks, foot rests.
        pipe(p(0.44, y * 0.105, 0.98), p(AXLES[0], y * 0.105, RADII_M[0]), 0.025, METAL);
        pipe(p(0.42, y * 0.05, 0.93), p(-0.24, y * 0.13, 0.56), 0.03, STEEL);
        pipe(p(-0.24, y * 0.13, 0.56), p(-0.70, y * 0.12, 0.78), 0.015, STEEL);
        pipe(p(-0.24, y * 0.13, 0.42), p(AXLES[1], y * 0.13, RADII_M[1]), 0.028, METAL);
        pipe(p(0.40, 0.0, 1.02), p(GRIP.x, y * GRIP.y, GRIP.z), 0.012, STEEL);
        pipe(p(0.33, y * 0.26, 1.04), p(0.38, y * 0.34, 1.20), 0.006, STEEL);
        pipe(p(-0.16, y * 0.16, 0.36), p(-0.16, y * 0.27, 0.36), 0.012, METAL);
    }
    // Exhaust: down from the engine, along, and a silencer on the right.
    pipe(p(0.22, -0.10, 0.60), p(0.30, -0.10, 0.26), 0.02, STEEL);
    pipe(p(0.30, -0.10, 0.22), p(-0.35, -0.17, 0.26), 0.02, STEEL);
    pipe(p(-0.35, -0.19, 0.30), p(-0.85, -0.21, 0.48), 0.055, STEEL);
    for side in [1.0, -1.0] {
        ovoid(&mut mesh, p(0.38, side * 0.37, 1.22), p(0.025, 0.07, 0.04), 16, 4, STEEL);
    }
    // Number plate, 220 x 200 mm, leaning by 15 degrees.
    let mut plate = Mesh::default();
    block(&mut plate, p(-0.001, -0.11, -0.10), p(0.001, 0.11, 0.10), METAL);
    let lean = DQuat::from_rotation_y(15f64.to_radians());
    append(&mut mesh, &plate, &Pose::<Target, Target>::new(lean, p(-0.92, 0.0, 0.62)));
    mesh
}

pub(super) fn parts() -> Vec<Part> {
    let mut sitting = rider(HIP, 0.35, GRIP, STATURE_M);
    for side in [1.0, -1.0] {
        // Thighs along the tank, shanks down to the rests.
        let hip = HIP + DVec3::Y * side * HIP_Y * STATURE_M;
        let (up, out) = (DQuat::from_rotation_y(-1.15), DQuat::from_rotation_z(side * 0.25));
        append(&mut sitting, &thigh(STATURE_M), &Pose::<Target, Target>::new(out * up, hip));
        let knee = hip + out * up * (DVec3::Z * -(HIP_HEIGHT - KNEE) * STATURE_M);
        let down = out * DQuat::from_rotation_y(0.62);
        append(&mut sitting, &shank(STATURE_M, KNEE - 0.026), &Pose::<Target, Target>::new(down, knee));
    }
    let mut parts =
        vec![Part::still("motorcycle", "", weld(machine())), Part::still("rider", "rider", weld(sitting))];
    for (name, i, width_m) in [("wheel front", 0, 0.12), ("wheel rear", 1, 0.16)] {
        let roll = Joint::about_y(DVec3::ZERO, Turn::Roll { radius_m: RADII_M[i] });
        let (mesh, at) =
            (weld(Wheel::alloy(RADII_M[i], width_m, 0.216).mesh()), DVec3::new(AXLES[i], 0.0, RADII_M[i]));
        parts.push(Part::hinged(name, "wheel", mesh, at, &[roll]));
    }
    parts
}
