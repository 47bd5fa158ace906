//! Lorries: cab with open wheel houses, frame, axles, tanks, under-run guards, flat-sided box bodies, and
//! turning wheels.
//!
//! Sizes within Directive 96/53/EC (2.55 m wide, 4.00 m high, lorry 12 m, articulated 16.5 m with a
//! semi-trailer of 13.6 m); guards after UN Regulations 58 and 73; tyres 265/70 R 19.5 and 315/70 R 22.5.

use super::car::{level, wheels};
use super::part::{Paint, Part};
use super::shell::{Arch, Band, Level, Recess, Shell};
use super::surface::{bar, block, limb, tube};
use super::wheel::Wheel;
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};

const STEEL: u32 = Paint::Steel as u32;
const METAL: u32 = Paint::Aluminium as u32;

/// A cab over the front axle from `front_x` backwards.
struct Cab {
    front_x: f64,
    length_m: f64,
    axle_x: f64,
    height_m: f64,
    wheel: Wheel,
}

impl Cab {
    fn mesh(&self) -> Option<Mesh> {
        let (f, r, h) = (self.front_x, self.front_x - self.length_m, self.height_m);
        let row = |z, back, w, corner| [z, f - back, r, w, 5.0, 20.0, 40.0, corner, 0.10];
        let rows = [
            row(0.42, 0.06, 1.170, 0.24),
            row(0.65, 0.02, 1.215, 0.26),
            row(0.95, 0.00, 1.235, 0.26),
            row(1.25, 0.02, 1.240, 0.26),
            row(1.50, 0.05, 1.240, 0.26),
            row(1.50 + 0.5 * (h - 1.85), 0.12, 1.230, 0.26),
            row(h - 0.35, 0.22, 1.210, 0.26),
            row(h - 0.15, 0.40, 1.150, 0.25),
            row(h, 0.90, 0.900, 0.20),
        ];
        let levels: Vec<Level> = rows.iter().map(level).collect();
        let arches = [Arch {
            x_m: self.axle_x,
            half_m: self.wheel.radius_m + 0.08,
            top_m: 2.0 * self.wheel.radius_m + 0.10,
            inner_y_m: 1.22 - self.wheel.width_m - 0.12,
        }];
        let end = |columns, rows, depth_m, bowl| Recess {
            rear: false,
            columns,
            rows,
            depth_m,
            narrowing: 0.9,
            bowl,
            material: METAL,
        };
        let recesses =
            [end((0, 6), (6, 9), 0.06, 0.0), end((7, 12), (2, 5), 0.08, 0.8), end((0, 6), (2, 4), 0.06, 0.0)];
        let zone = |band: usize, t: f64, z: f64| -> u32 {
            let paint = match band {
                0 if t < 1.9 && z < 0.8 => Paint::Bumper,
                1 if t < 1.35 => Paint::Glass,
                1 if (2.05..2.6).contains(&t) => Paint::Glass,
                _ => Paint::Steel,
            };
            paint as u32
        };
        let bands = [
            Band { from: 0, to: 4, rows: 10 },
            Band { from: 4, to: 6, rows: 6 },
            Band { from: 6, to: 8, rows: 4 },
        ];
        let shell = Shell {
            levels: &levels,
            bands: &bands,
            arches: &arches,
            recesses: &recesses,
            zone: &zone,
            floor: STEEL,
            wheel_house: STEEL,
        };
        let mut mesh = shell.mesh()?;
        for side in [1.0, -1.0] {
            // Mirrors on their bracket: housing, glass of metal at its back.
            let at = DVec3::new(f - 0.12, side * 1.36, 1.95);
            let half = DVec3::new(0.05, 0.12, 0.30);
            block(&mut mesh, at - half, at + half, STEEL);
            let glass = DVec3::new(0.002, 0.10, 0.27);
            let back = at - DVec3::X * 0.056;
            block(&mut mesh, back - glass, back + glass, METAL);
            for z in [1.72, 2.18] {
                let (door, housing) =
                    (DVec3::new(f - 0.14, side * 1.20, z), DVec3::new(f - 0.12, side * 1.30, z));
                bar(&mut mesh, door, housing, 0.015, 8, STEEL);
            }
            // Steps below the door, before the wheel.
            let (x, y) = (self.axle_x + self.wheel.radius_m, side * 1.12);
            block(
                &mut mesh,
                DVec3::new(x + 0.10, y - 0.10, 0.33),
                DVec3::new(x + 0.40, y + 0.10, 0.36),
                METAL,
            );
        }
        // Plate on the bumper, leaning back by what the bumper does.
        block(&mut mesh, DVec3::new(f + 0.012, -0.26, 0.50), DVec3::new(f + 0.014, 0.26, 0.61), METAL);
        Some(mesh)
    }
}

/// Frame rails from `x.0` to `x.1`, and round cross members between them. Flat ones would make right angles of
/// a wavelength's precision, which riveted channels with their gussets do not.
fn frame(mesh: &mut Mesh, x: (f64, f64), z: (f64, f64)) {
    for side in [1.0, -1.0] {
        let (a, b) = (side * 0.43 - 0.035, side * 0.43 + 0.035);
        block(mesh, DVec3::new(x.0, a, z.0), DVec3::new(x.1, b, z.1), STEEL);
    }
    let count = ((x.1 - x.0) / 1.2).floor() as usize;
    for k in 0..count {
        let (at, z) = (x.0 + 0.3 + 1.2 * k as f64, 0.5 * (z.0 + z.1));
        bar(mesh, DVec3::new(at, -0.39, z), DVec3::new(at, 0.39, z), 0.06, 16, STEEL);
    }
}

fn axle(mesh: &mut Mesh, x: f64, z: f64, half_m: f64) {
    bar(mesh, DVec3::new(x, -half_m, z), DVec3::new(x, half_m, z), 0.065, 16, STEEL);
    tube(mesh, (DVec3::new(x, 0.0, z - 0.01), 0.17), (DVec3::new(x - 0.25, 0.0, z), 0.07), 16, STEEL);
}

/// A guard across the rear: a closed bar of 2.3 m on two arms.
fn rear_guard(mesh: &mut Mesh, x: f64, frame_z: f64) {
    block(mesh, DVec3::new(x, -1.15, 0.45), DVec3::new(x + 0.06, 1.15, 0.57), STEEL);
    for y in [-0.43, 0.43] {
        bar(mesh, DVec3::new(x + 0.095, y, 0.48), DVec3::new(x + 0.095, y, frame_z), 0.03, 12, STEEL);
    }
    // Plate, hanging from it.
    block(mesh, DVec3::new(x - 0.012, 0.30, 0.455), DVec3::new(x - 0.010, 0.82, 0.565), METAL);
}

/// A tank that lies along x, with dished ends.
fn tank(mesh: &mut Mesh, middle: DVec3, half_length: f64, radius_m: f64) {
    let (h, r) = (half_length, radius_m);
    let rings = [[-h, 0.0, 0.0, 0.0], [-h + 0.10, r, r, 0.0], [h - 0.10, r, r, 0.0], [h, 0.0, 0.0, 0.0]];
    let mut part = Mesh::default();
    limb(&mut part, &rings, 24, 3, METAL);
    let lie = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    append(mesh, &part, &Pose::<Target, Target>::new(lie, middle));
}

/// A guard along a side: two boards of 100 mm.
fn side_guard(mesh: &mut Mesh, x: (f64, f64)) {
    for side in [1.0, -1.0] {
        for z in [0.50, 0.78] {
            let y = side * 1.20;
            block(mesh, DVec3::new(x.0, y - 0.0125, z), DVec3::new(x.1, y + 0.0125, z + 0.10), METAL);
        }
        for at in [x.0 + 0.3, x.1 - 0.3] {
            let foot = DVec3::new(at, side * 1.16, 0.48);
            bar(mesh, foot, foot + DVec3::Z * 0.5, 0.02, 12, STEEL);
        }
    }
}

/// A box body with posts at its rear corners and a sill below its doors.
fn box_body(mesh: &mut Mesh, x: (f64, f64), z: (f64, f64), half_width: f64) {
    block(mesh, DVec3::new(x.0, -half_width, z.0), DVec3::new(x.1, half_width, z.1), METAL);
    for side in [1.0, -1.0] {
        let y = side * (half_width - 0.05);
        block(mesh, DVec3::new(x.0 - 0.031, y - 0.05, z.0), DVec3::new(x.0 - 0.001, y + 0.05, z.1), STEEL);
        // Lock bars of the doors, and their hinges' bosses.
        for bar_y in [0.25, 0.85] {
            let y = side * bar_y;
            let at = |z: f64| DVec3::new(x.0 - 0.03, y, z);
            bar(mesh, at(z.0 + 0.05), at(z.1 - 0.05), 0.014, 12, STEEL);
        }
    }
    let sill = DVec3::new(x.0 - 0.031, -half_width, z.0 - 0.035);
    block(mesh, sill, DVec3::new(x.0 + 0.05, half_width, z.0 - 0.001), STEEL);
}

/// Two wheels side by side that turn as one.
fn twins(one: &Wheel, axles: &[f64], first: usize) -> Vec<Part> {
    let mut parts = wheels(one, axles, 1.22);
    for part in &mut parts {
        let inwards = if part.pose.translation_m.y > 0.0 { -1.0 } else { 1.0 };
        let single = part.mesh.clone();
        let beside = DVec3::Y * inwards * (one.width_m + 0.03);
        append(&mut part.mesh, &single, &Pose::<Target, Target>::new(DQuat::IDENTITY, beside));
    }
    numbered(parts, first)
}

/// The names of axles counted on from `first`.
fn numbered(mut parts: Vec<Part>, first: usize) -> Vec<Part> {
    for (i, part) in parts.iter_mut().enumerate() {
        let side = if i % 2 == 0 { "left" } else { "right" };
        part.name = format!("wheel {} {side}", first + i / 2);
    }
    parts
}

/// A lorry of 12 t: 8.5 m long, 3.6 m high, wheelbase 4.6 m.
pub(super) fn rigid() -> Option<Vec<Part>> {
    let tyre = Wheel::steel(0.430, 0.265, 0.262);
    let cab = Cab { front_x: 4.25, length_m: 2.05, axle_x: 2.95, height_m: 2.75, wheel: tyre };
    let mut body = cab.mesh()?;
    frame(&mut body, (-4.0, 2.1), (0.72, 0.96));
    box_body(&mut body, (-4.21, 2.02), (1.02, 3.60), 1.25);
    axle(&mut body, -1.65, 0.43, 0.60);
    rear_guard(&mut body, -4.20, 0.72);
    side_guard(&mut body, (-1.0, 1.4));
    tank(&mut body, DVec3::new(0.95, 0.78, 0.70), 0.45, 0.27);
    let mut parts = vec![Part::still("body", "", weld(body))];
    parts.extend(wheels(&tyre, &[2.95], 1.22));
    parts.extend(twins(&tyre, &[-1.65], 2));
    Some(parts)
}

/// Tractor with two axles and a box semi-trailer with three: 16.5 m long, 4.0 m high.
pub(super) fn semi_trailer() -> Option<Vec<Part>> {
    let tyre = Wheel::steel(0.500, 0.315, 0.300);
    let cab = Cab { front_x: 8.22, length_m: 2.25, axle_x: 6.83, height_m: 3.55, wheel: tyre };
    let mut body = cab.mesh()?;
    frame(&mut body, (2.2, 6.0), (0.75, 1.00));
    frame(&mut body, (-8.0, 4.9), (1.01, 1.16));
    box_body(&mut body, (-8.20, 5.37), (1.20, 4.00), 1.275);
    for (x, half) in [(3.13, 0.55), (-3.55, 0.85), (-4.86, 0.85), (-6.17, 0.85)] {
        axle(&mut body, x, 0.50, half);
    }
    rear_guard(&mut body, -8.15, 1.01);
    side_guard(&mut body, (-2.7, 1.2));
    for side in [1.0, -1.0] {
        // Landing legs of the trailer, fuel tank and air tanks of the tractor.
        let (y, z) = (side * 0.65, 1.01);
        block(&mut body, DVec3::new(2.05, y - 0.06, 0.45), DVec3::new(2.17, y + 0.06, z), STEEL);
        tank(&mut body, DVec3::new(4.9, side * 0.80, 0.72), 0.70, 0.30);
    }
    let mut parts = vec![Part::still("body", "", weld(body))];
    parts.extend(wheels(&tyre, &[6.83], 1.22));
    parts.extend(twins(&tyre, &[3.13], 2));
    parts.extend(numbered(wheels(&tyre, &[-3.55, -4.86, -6.17], 1.26), 3));
    Some(parts)
}
