//! Cars and vans: a smooth skin with open wheel houses, recesses for lamps, grille and number plate,
//! mirrors, plates, axles under the floor, and turning wheels.
//!
//! Sizes: the middle of the range of today's European classes (C: 4.2 to 4.4 m, D: 4.5 to 4.8 m long, 1.75 to
//! 1.9 m wide without mirrors; compact SUV 4.3 to 4.75 m; vans of 3.5 t 5.9 to 6.0 m), wheels after their
//! tyres' ISO 4000-1 sizes, number plates 520 x 110 mm (Regulation (EU) 1003/2010).

use super::motion::{Joint, Turn};
use super::part::{Paint, Part};
use super::shell::{Arch, Band, Level, Recess, Shell};
use super::surface::{bar, block, limb};
use super::wheel::Wheel;
use crate::base::frames::{Pose, Target};
use crate::road::shape::{append, moved, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// z, front x, rear x, half width, radii of front, rear, side, front corner, rear corner.
type Row = [f64; 9];

pub(super) struct Shape {
    levels: &'static [Row],
    bands: &'static [Band],
    /// x of front and rear axle.
    axles: [f64; 2],
    wheel: Wheel,
    /// y of the wheels' outer faces.
    track_out_m: f64,
    arch_half_m: f64,
    arch_top_m: f64,
    /// Van: metal above the doors' windows.
    panel_sides: bool,
    /// Height and x of the mirrors, y of their root.
    mirror: DVec3,
    /// Heights of the number plates, front and rear, and how deep the latter's recess is.
    plates: [f64; 2],
    plate_rows: (usize, usize),
}

const fn band(from: usize, to: usize, rows: usize) -> Band {
    Band { from, to, rows }
}

pub(super) const SEDAN: Shape = Shape {
    levels: &[
        [0.18, 2.20, -2.20, 0.830, 2.2, 2.4, 18.0, 0.36, 0.34],
        [0.34, 2.31, -2.30, 0.885, 2.3, 2.5, 18.0, 0.37, 0.34],
        [0.52, 2.34, -2.34, 0.912, 2.4, 2.6, 18.0, 0.38, 0.34],
        [0.66, 2.32, -2.34, 0.912, 2.4, 2.6, 18.0, 0.38, 0.32],
        [0.77, 2.22, -2.31, 0.895, 2.4, 2.6, 18.0, 0.38, 0.30],
        [0.85, 1.92, -2.27, 0.870, 2.4, 2.6, 18.0, 0.34, 0.28],
        [0.92, 1.48, -2.22, 0.840, 2.4, 2.6, 18.0, 0.30, 0.26],
        [0.97, 1.05, -2.10, 0.800, 2.4, 2.6, 18.0, 0.24, 0.22],
        [1.02, 0.92, -1.70, 0.770, 2.0, 2.4, 18.0, 0.20, 0.20],
        [1.15, 0.64, -1.42, 0.735, 1.9, 2.2, 18.0, 0.19, 0.20],
        [1.30, 0.32, -1.12, 0.665, 1.8, 2.0, 18.0, 0.18, 0.18],
        [1.38, 0.10, -0.92, 0.600, 1.8, 1.8, 18.0, 0.18, 0.18],
        [1.43, -0.12, -0.66, 0.460, 1.6, 1.6, 18.0, 0.14, 0.14],
        [1.45, -0.30, -0.48, 0.200, 1.6, 1.6, 18.0, 0.06, 0.06],
    ],
    bands: &[band(0, 4, 10), band(4, 8, 8), band(8, 11, 7), band(11, 13, 4)],
    axles: [1.44, -1.30],
    wheel: Wheel::alloy(0.328, 0.225, 0.216),
    track_out_m: 0.895,
    arch_half_m: 0.375,
    arch_top_m: 0.705,
    panel_sides: false,
    mirror: DVec3::new(0.62, 0.80, 1.00),
    plates: [0.40, 0.52],
    plate_rows: (4, 6),
};

pub(super) const HATCHBACK: Shape = Shape {
    levels: &[
        [0.17, 2.02, -2.06, 0.810, 2.0, 2.2, 17.0, 0.36, 0.28],
        [0.34, 2.11, -2.10, 0.865, 2.1, 2.3, 17.0, 0.37, 0.32],
        [0.52, 2.14, -2.14, 0.893, 2.2, 2.4, 17.0, 0.38, 0.32],
        [0.66, 2.12, -2.14, 0.893, 2.2, 2.4, 17.0, 0.38, 0.30],
        [0.78, 2.03, -2.12, 0.878, 2.2, 2.4, 17.0, 0.38, 0.28],
        [0.86, 1.78, -2.11, 0.855, 2.2, 2.4, 17.0, 0.34, 0.27],
        [0.93, 1.40, -2.09, 0.825, 2.2, 2.4, 17.0, 0.30, 0.26],
        [0.98, 1.02, -2.07, 0.790, 2.2, 2.4, 17.0, 0.24, 0.25],
        [1.02, 0.92, -2.05, 0.765, 2.0, 2.3, 17.0, 0.20, 0.24],
        [1.17, 0.60, -1.95, 0.725, 1.9, 2.1, 17.0, 0.19, 0.22],
        [1.33, 0.26, -1.82, 0.655, 1.8, 2.0, 17.0, 0.18, 0.20],
        [1.41, 0.02, -1.70, 0.590, 1.8, 1.8, 17.0, 0.18, 0.18],
        [1.46, -0.20, -1.40, 0.450, 1.6, 1.6, 17.0, 0.14, 0.14],
        [1.48, -0.45, -1.00, 0.200, 1.6, 1.6, 17.0, 0.06, 0.06],
    ],
    bands: &[band(0, 4, 10), band(4, 8, 8), band(8, 11, 7), band(11, 13, 4)],
    axles: [1.27, -1.36],
    wheel: Wheel::alloy(0.316, 0.205, 0.203),
    track_out_m: 0.876,
    arch_half_m: 0.362,
    arch_top_m: 0.682,
    panel_sides: false,
    mirror: DVec3::new(0.60, 0.79, 1.01),
    plates: [0.40, 0.58],
    plate_rows: (5, 7),
};

pub(super) const SUV: Shape = Shape {
    levels: &[
        [0.21, 2.12, -2.10, 0.830, 2.2, 2.3, 18.0, 0.29, 0.32],
        [0.42, 2.22, -2.22, 0.890, 2.3, 2.4, 18.0, 0.36, 0.32],
        [0.62, 2.25, -2.25, 0.922, 2.4, 2.5, 18.0, 0.36, 0.32],
        [0.79, 2.23, -2.25, 0.922, 2.4, 2.5, 18.0, 0.36, 0.30],
        [0.92, 2.20, -2.23, 0.905, 2.4, 2.5, 18.0, 0.36, 0.28],
        [0.99, 1.94, -2.22, 0.885, 2.4, 2.5, 18.0, 0.33, 0.27],
        [1.06, 1.44, -2.20, 0.855, 2.4, 2.5, 18.0, 0.29, 0.26],
        [1.11, 1.08, -2.18, 0.820, 2.4, 2.5, 18.0, 0.24, 0.25],
        [1.15, 0.98, -2.16, 0.800, 2.1, 2.4, 18.0, 0.20, 0.24],
        [1.31, 0.68, -2.05, 0.760, 2.0, 2.2, 18.0, 0.19, 0.22],
        [1.49, 0.32, -1.92, 0.695, 1.9, 2.1, 18.0, 0.18, 0.20],
        [1.58, 0.06, -1.80, 0.630, 1.8, 1.9, 18.0, 0.18, 0.18],
        [1.64, -0.20, -1.50, 0.480, 1.6, 1.6, 18.0, 0.14, 0.14],
        [1.66, -0.45, -1.05, 0.200, 1.6, 1.6, 18.0, 0.06, 0.06],
    ],
    bands: &[band(0, 4, 10), band(4, 8, 8), band(8, 11, 7), band(11, 13, 4)],
    axles: [1.36, -1.32],
    wheel: Wheel::alloy(0.359, 0.235, 0.229),
    track_out_m: 0.905,
    arch_half_m: 0.410,
    arch_top_m: 0.775,
    panel_sides: false,
    mirror: DVec3::new(0.66, 0.82, 1.14),
    plates: [0.48, 0.72],
    plate_rows: (5, 7),
};

pub(super) const VAN: Shape = Shape {
    levels: &[
        [0.22, 2.80, -2.90, 0.950, 2.6, 9.0, 30.0, 0.36, 0.12],
        [0.44, 2.93, -2.96, 0.995, 2.7, 9.0, 30.0, 0.38, 0.12],
        [0.66, 2.96, -2.97, 1.015, 2.8, 9.0, 30.0, 0.38, 0.12],
        [0.86, 2.93, -2.97, 1.020, 2.8, 9.0, 30.0, 0.38, 0.12],
        [1.04, 2.84, -2.97, 1.015, 2.8, 9.0, 30.0, 0.38, 0.12],
        [1.14, 2.66, -2.97, 1.010, 2.8, 9.0, 30.0, 0.34, 0.12],
        [1.23, 2.44, -2.97, 1.005, 2.8, 9.0, 30.0, 0.30, 0.12],
        [1.31, 2.22, -2.97, 1.000, 2.6, 9.0, 30.0, 0.26, 0.12],
        [1.60, 1.94, -2.96, 0.985, 2.4, 9.0, 30.0, 0.24, 0.12],
        [1.95, 1.58, -2.95, 0.960, 2.3, 9.0, 30.0, 0.22, 0.12],
        [2.25, 1.24, -2.94, 0.930, 2.2, 9.0, 30.0, 0.22, 0.12],
        [2.42, 0.90, -2.88, 0.850, 2.2, 9.0, 30.0, 0.22, 0.12],
        [2.52, 0.40, -2.70, 0.600, 2.0, 9.0, 30.0, 0.20, 0.10],
        [2.55, 0.00, -2.50, 0.300, 2.0, 9.0, 30.0, 0.10, 0.08],
    ],
    bands: &[band(0, 4, 10), band(4, 7, 6), band(7, 10, 10), band(10, 13, 5)],
    axles: [1.98, -1.66],
    wheel: Wheel::alloy(0.358, 0.235, 0.203),
    track_out_m: 0.990,
    arch_half_m: 0.420,
    arch_top_m: 0.800,
    panel_sides: true,
    mirror: DVec3::new(1.86, 0.99, 1.45),
    plates: [0.50, 0.80],
    plate_rows: (5, 7),
};

impl Shape {
    /// None where the tables above do not fit together.
    fn skin(&self) -> Option<Mesh> {
        let levels: Vec<Level> = self.levels.iter().map(level).collect();
        let width_in = self.wheel.width_m + 0.07;
        let arches = self.axles.map(|x_m| Arch {
            x_m,
            half_m: self.arch_half_m,
            top_m: self.arch_top_m,
            inner_y_m: self.track_out_m - width_in,
        });
        let end = |rear, columns, rows, depth_m, narrowing, bowl, material: Paint| Recess {
            rear,
            columns,
            rows,
            depth_m,
            narrowing,
            bowl,
            material: material as u32,
        };
        let recesses = [
            end(false, (0, 5), (6, 8), 0.05, 0.9, 0.0, Paint::Aluminium),
            end(false, (0, 6), (1, 3), 0.06, 0.9, 0.0, Paint::Aluminium),
            end(false, (7, 12), (6, 9), 0.08, 0.85, 0.8, Paint::Aluminium),
            end(true, (0, 5), self.plate_rows, 0.05, 0.9, 0.0, Paint::Steel),
            end(true, (8, 12), (6, 9), 0.05, 0.85, 0.8, Paint::Aluminium),
        ];
        let bumper_top = 0.5 * (self.levels[2][0] + self.levels[3][0]);
        let zone = |band: usize, t: f64, z: f64| -> u32 {
            let at_end = !(1.9..=3.2).contains(&t);
            let paint = match band {
                0 if at_end && z < bumper_top => Paint::Bumper,
                2 if t < 1.25 => Paint::Glass,
                2 if self.panel_sides && !(2.05..2.3).contains(&t) => Paint::Steel,
                2 if (2.05..2.95).contains(&t) && (t - 2.5).abs() > 0.07 => Paint::Glass,
                2 if t > 3.75 => Paint::Glass,
                _ => Paint::Steel,
            };
            paint as u32
        };
        let shell = Shell {
            levels: &levels,
            bands: self.bands,
            arches: &arches,
            recesses: &recesses,
            zone: &zone,
            floor: Paint::Steel as u32,
            wheel_house: Paint::Steel as u32,
        };
        shell.mesh()
    }
}

pub(super) fn level(row: &Row) -> Level {
    let [z, front, rear, half_width, a, b, c, d, e] = *row;
    Level { z, front, rear, half_width, radii: [a, b, c, d, e] }
}

/// Body and four wheels.
pub(super) fn parts(shape: &Shape) -> Option<Vec<Part>> {
    let mut body = shape.skin()?;
    let wheel = &shape.wheel;
    for side in [1.0, -1.0] {
        let at = DVec3::new(shape.mirror.x, side * shape.mirror.y, shape.mirror.z);
        mirror(&mut body, at, side, if shape.panel_sides { 1.6 } else { 1.0 });
    }
    let [front, rear] = shape.plates;
    // In front of the bumper, and within the recess at the rear.
    plate(&mut body, DVec3::new(shape.levels[1][1] + 0.035, 0.0, front), 4.0);
    plate(&mut body, DVec3::new(shape.levels[2][2] + 0.030, 0.0, rear), 176.0);
    // Below the floor: cross members at the axles, the exhaust and its silencer.
    let floor = shape.levels[0][0];
    let inner = shape.track_out_m - wheel.width_m - 0.08;
    for x in shape.axles {
        bar(&mut body, DVec3::new(x, -inner, floor - 0.04), DVec3::new(x, inner, floor - 0.04), 0.03, 12, 0);
    }
    let tail = shape.levels[0][2];
    let below = |x: f64, z: f64| DVec3::new(tail + x, 0.30, floor - z);
    bar(&mut body, below(0.75, 0.06), below(0.30, 0.06), 0.055, 12, 0);
    bar(&mut body, below(0.29, 0.03), below(-0.04, 0.03), 0.025, 12, 0);
    let mut parts = vec![Part::still("body", "", weld(body))];
    parts.extend(wheels(wheel, &shape.axles, shape.track_out_m));
    Some(parts)
}

/// Two wheels on each axle, named from the front.
pub(super) fn wheels(wheel: &Wheel, axles: &[f64], track_out_m: f64) -> Vec<Part> {
    let left = weld(wheel.mesh());
    let right =
        weld(moved(left.clone(), &Pose::<Target, Target>::from_yaw_pitch_roll(DVec3::ZERO, PI, 0.0, 0.0)));
    let mut parts = Vec::new();
    for (i, x) in axles.iter().enumerate() {
        for (side, mesh) in [("left", &left), ("right", &right)] {
            let y = track_out_m - 0.5 * wheel.width_m;
            let y = if side == "left" { y } else { -y };
            let at = DVec3::new(*x, y, wheel.radius_m);
            let roll = Joint::about_y(DVec3::ZERO, Turn::Roll { radius_m: wheel.radius_m });
            parts.push(Part::hinged(format!("wheel {} {side}", i + 1), "wheel", mesh.clone(), at, &[roll]));
        }
    }
    parts
}

/// A smooth housing with a glass of metal at its back, on a stalk.
fn mirror(mesh: &mut Mesh, root: DVec3, side: f64, tall: f64) {
    let centre = root + DVec3::new(-0.02, side * 0.16, 0.06 * tall);
    // Its own z looks outwards: long across, flattened fore and aft.
    let mut housing = Mesh::default();
    let (half, height) = (0.10, 0.075 * tall);
    let rings = [
        [-half, 0.0, 0.0, 0.0],
        [-0.6 * half, 0.055, height, 0.0],
        [0.6 * half, 0.050, 0.95 * height, 0.0],
        [half, 0.0, 0.0, 0.0],
    ];
    limb(&mut housing, &rings, 16, 3, Paint::Steel as u32);
    let out = DQuat::from_rotation_x(-side * FRAC_PI_2);
    append(mesh, &housing, &Pose::<Target, Target>::new(out, centre));
    // The stalk ends inside the door and inside the housing's shell.
    let stalk = root + DVec3::new(0.0, -side * 0.02, -0.02);
    bar(mesh, stalk, centre - DVec3::Z * 0.02, 0.012, 8, Paint::Steel as u32);
    let glass = centre - DVec3::X * 0.066;
    let size = DVec3::new(0.002, 0.075, 0.75 * height);
    block(mesh, glass - size, glass + size, Paint::Aluminium as u32);
}

/// 520 x 110 mm, looking along +x turned about y by `pitch_deg`, upwards.
fn plate(mesh: &mut Mesh, at: DVec3, pitch_deg: f64) {
    let mut part = Mesh::default();
    let half = DVec3::new(0.001, 0.26, 0.055);
    block(&mut part, -half, half, Paint::Aluminium as u32);
    let turn = DQuat::from_rotation_y(-pitch_deg.to_radians());
    append(mesh, &part, &Pose::<Target, Target>::new(turn, at));
}
