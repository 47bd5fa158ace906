//! Road furniture and vehicles. Each function gives a mesh in its object's own frame (target frame:
//! x forward, y left, z up, metres); material arguments are indices into a scene's materials.

use crate::base::frames::{Pose, Target};
use crate::road::shape::{Profile, append, cuboid, extrude_x, polygon, weld};
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, TAU};

/// Outline of a W-beam, (depth towards the traffic, height over its centre line): 312 mm high and
/// 83 mm deep (the outer size of AASHTO M 180), with its bends as sharp edges.
const W_BEAM: [(f64, f64); 8] = [
    (0.027, -0.156),
    (0.083, -0.118),
    (0.083, -0.080),
    (0.0, -0.025),
    (0.0, 0.025),
    (0.083, 0.080),
    (0.083, 0.118),
    (0.027, 0.156),
];

/// Half height and depth of the W-beam's section, the outer size of AASHTO M 180.
pub const W_BEAM_HALF_HEIGHT_M: f64 = 0.156;
/// Depth of a W-beam, m.
pub const W_BEAM_DEPTH_M: f64 = 0.083;

/// A point of a section, (depth towards the traffic, height), and the normal there on the side of the
/// traffic.
pub type SectionPoint = (DVec2, DVec2);

/// The face of a W-beam with its bends, from the lower edge to the upper. Facets of the bends lie at most
/// `sagitta_m` inside their arcs, on which the corners lie.
///
/// Outer size 312 x 83 mm (AASHTO M 180). Bends of 24 mm radius and flanks at 60 degrees; the waves'
/// distance of 194 mm follows from them and gives a developed width of 483 mm, which is that of the
/// strips such beams are rolled from (480 mm for 310 x 85 mm after JT/T 281).
///
/// # Example
/// ```
/// use catseye::road::objects::{W_BEAM_DEPTH_M, w_beam_section};
///
/// let sagitta_m = 1e-5;
/// let section = w_beam_section(sagitta_m);
/// let width_m: f64 = section.windows(2).map(|p| p[0].0.distance(p[1].0)).sum();
/// assert!((width_m - 0.483).abs() < 0.001);
/// let depth_m = section.iter().map(|(at, _)| at.x).fold(0.0, f64::max);
/// assert!((W_BEAM_DEPTH_M - depth_m).abs() <= sagitta_m);
/// ```
pub fn w_beam_section(sagitta_m: f64) -> Vec<SectionPoint> {
    const BEND: f64 = 0.024;
    const FLANK: f64 = FRAC_PI_3;
    let (sin, cos) = FLANK.sin_cos();
    let flank = (W_BEAM_DEPTH_M - 2.0 * BEND * (1.0 - cos)) / sin;
    let crest = 0.097;
    let flat = crest - 2.0 * BEND * sin - flank * cos;
    let outer = (W_BEAM_HALF_HEIGHT_M - crest - BEND * sin) / cos;
    // The upper half as a path from the middle of the trough: the angle of its direction from the
    // vertical towards the traffic.
    let (mut at, mut angle) = (DVec2::ZERO, 0.0f64);
    let mut half: Vec<SectionPoint> = Vec::new();
    let normal = |angle: f64| DVec2::new(angle.cos(), -angle.sin());
    let tangent = |angle: f64| DVec2::new(angle.sin(), angle.cos());
    // (length of a straight, turn of the arc after it).
    for (straight, turn) in [(flat, FLANK), (flank, -2.0 * FLANK), (outer, 0.0)] {
        at += straight * tangent(angle);
        half.push((at, normal(angle)));
        let step = 2.0 * (2.0 * (0.5 * sagitta_m / BEND).min(1.0).sqrt().asin());
        let n = (turn.abs() / step).ceil().max(1.0) as u32;
        let centre = at + turn.signum() * BEND * normal(angle);
        if turn != 0.0 {
            for i in 1..=n {
                let a = angle + turn * f64::from(i) / f64::from(n);
                half.push((centre - turn.signum() * BEND * normal(a), normal(a)));
            }
            angle += turn;
            at = half[half.len() - 1].0;
        }
    }
    let mirrored = half.iter().rev().map(|(p, n)| (DVec2::new(p.x, -p.y), DVec2::new(n.x, -n.y)));
    mirrored.chain(half.iter().copied()).collect()
}

/// A guard rail's beam as one sheet of 14 triangles: along x, centred at the origin, its back in the
/// plane y = 0 and the side of the traffic towards +y.
pub fn w_beam(length_m: f64, material: u32) -> Mesh {
    let outline = W_BEAM.map(|(y, z)| DVec2::new(y, z));
    let mut mesh = Mesh::default();
    extrude_x(&mut mesh, &outline, (-0.5 * length_m, 0.5 * length_m), Profile::Open, material);
    weld(mesh)
}

/// A guard rail's post of U section as sheets of 6 triangles: web of `width_m` in the plane x = 0, two
/// flanges of `depth_m`, open to +x, standing on z = 0. Its two inner right angles return a radar's
/// signal over a wide sector in azimuth, which a box's flat face does not.
pub fn u_post(width_m: f64, depth_m: f64, height_m: f64, material: u32) -> Mesh {
    let (y, d, h) = (0.5 * width_m, depth_m, DVec3::Z * height_m);
    let (right, left) = (DVec3::new(0.0, -y, 0.0), DVec3::new(0.0, y, 0.0));
    let ahead = DVec3::X * d;
    let mut mesh = Mesh::default();
    polygon(&mut mesh, &[right, left, left + h, right + h], material);
    polygon(&mut mesh, &[left, left + ahead, left + ahead + h, left + h], material);
    polygon(&mut mesh, &[right + ahead, right, right + h, right + ahead + h], material);
    weld(mesh)
}

/// A level rectangle from `lo_m` to `hi_m` (x, y) at height `z_m`, looking up: 2 triangles.
pub fn ground(lo_m: DVec2, hi_m: DVec2, z_m: f64, material: u32) -> Mesh {
    let at = |x, y| DVec3::new(x, y, z_m);
    let mut mesh = Mesh::default();
    polygon(
        &mut mesh,
        &[at(lo_m.x, lo_m.y), at(hi_m.x, lo_m.y), at(hi_m.x, hi_m.y), at(lo_m.x, hi_m.y)],
        material,
    );
    mesh
}

/// A grass verge beside a road: from (`x_m.0`, `inner_y_m`) it falls by 12 cm over its first metre and
/// runs on level to `outer_y_m`, on either side of the road; looking up.
pub fn verge(x_m: (f64, f64), inner_y_m: f64, outer_y_m: f64, material: u32) -> Mesh {
    let side = outer_y_m.signum();
    let foot = inner_y_m + side * 1.0f64.min(0.5 * (outer_y_m - inner_y_m).abs());
    let mut outline = vec![(inner_y_m, 0.0), (foot, -0.12), (outer_y_m, -0.12)];
    // `extrude_x` puts the normal below an outline that runs towards +y.
    if side > 0.0 {
        outline.reverse();
    }
    let outline: Vec<DVec2> = outline.into_iter().map(|(y, z)| DVec2::new(y, z)).collect();
    let mut mesh = Mesh::default();
    extrude_x(&mut mesh, &outline, x_m, Profile::Open, material);
    weld(mesh)
}

/// Material indices of a car.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CarMaterials {
    /// Material of the body.
    pub body: u32,
    /// Material of the windows.
    pub glass: u32,
    /// Material of the tyres.
    pub tyre: u32,
}

/// One cross section of the body: position along x, half widths and heights of the four corners of
/// its left half (underbody, widest line, shoulder, deck).
type Section = (f64, [(f64, f64); 4]);

const BODY: [Section; 9] = [
    (-2.21, [(0.62, 0.36), (0.68, 0.55), (0.65, 0.72), (0.56, 0.78)]),
    (-2.12, [(0.72, 0.29), (0.79, 0.55), (0.75, 0.84), (0.63, 0.93)]),
    (-1.90, [(0.78, 0.22), (0.86, 0.56), (0.82, 0.89), (0.69, 0.98)]),
    (-1.30, [(0.80, 0.20), (0.89, 0.57), (0.85, 0.91), (0.72, 1.00)]),
    (0.90, [(0.80, 0.20), (0.89, 0.56), (0.84, 0.88), (0.71, 0.96)]),
    (1.60, [(0.79, 0.20), (0.87, 0.53), (0.80, 0.79), (0.64, 0.86)]),
    (1.98, [(0.76, 0.23), (0.83, 0.50), (0.75, 0.70), (0.58, 0.77)]),
    (2.14, [(0.68, 0.28), (0.75, 0.47), (0.68, 0.60), (0.52, 0.66)]),
    (2.21, [(0.58, 0.34), (0.64, 0.45), (0.59, 0.53), (0.46, 0.57)]),
];

/// The bulge of the bumpers beyond the first and last section: tip and height.
const BUMPER: [(f64, f64); 2] = [(-2.25, 0.56), (2.25, 0.45)];

/// A passenger car, 4.5 x 1.8 x 1.5 m, heading +x, its origin on the road below its middle. A lofted
/// body with bumpers, bonnet and boot, a glazed cabin with a metal roof, and four wheels of 12
/// facets; each of these is a closed shell. The shells are coarse (facets of 20 to 200 cm), so the
/// cross section has lobes that a rounded body would spread out.
pub fn passenger_car(m: CarMaterials) -> Mesh {
    let mut mesh = Mesh::default();
    loft(&mut mesh, &BODY, m.body);
    cabin(&mut mesh, m);
    let wheel = wheel(0.32, 0.20, m);
    for (x, y) in [(-1.35, 0.80), (1.35, 0.80), (-1.35, -0.80), (1.35, -0.80)] {
        // The wheel's outer side looks along its own +x.
        let yaw = if y > 0.0 { FRAC_PI_2 } else { -FRAC_PI_2 };
        let pose = Pose::<Target, Target>::from_yaw_pitch_roll(DVec3::new(x, y, 0.32), yaw, 0.0, 0.0);
        append(&mut mesh, &wheel, &pose);
    }
    weld(mesh)
}

fn loft(mesh: &mut Mesh, sections: &[Section], material: u32) {
    // Counter-clockwise with y to the right and z up, beginning at the lower right.
    let ring = |s: &Section| -> Vec<DVec3> {
        let left = s.1.iter().map(|&(y, z)| DVec3::new(s.0, y, z));
        let right = s.1.iter().rev().map(|&(y, z)| DVec3::new(s.0, -y, z));
        left.chain(right).collect()
    };
    for pair in sections.windows(2) {
        let (a, b) = (ring(&pair[0]), ring(&pair[1]));
        for i in 0..a.len() {
            let j = (i + 1) % a.len();
            polygon(mesh, &[a[i], a[j], b[j], b[i]], material);
        }
    }
    let (rear, front) = (ring(&sections[0]), ring(&sections[sections.len() - 1]));
    let tips = BUMPER.map(|(x, z)| DVec3::new(x, 0.0, z));
    for i in 0..rear.len() {
        let j = (i + 1) % rear.len();
        polygon(mesh, &[rear[j], rear[i], tips[0]], material);
        polygon(mesh, &[front[i], front[j], tips[1]], material);
    }
}

/// Windscreen, rear window and side windows under a ridged roof, on a floor inside the body.
fn cabin(mesh: &mut Mesh, m: CarMaterials) {
    let p = DVec3::new;
    let base = [(0.95, -0.70), (0.95, 0.70), (-1.60, 0.70), (-1.60, -0.70)].map(|(x, y)| p(x, y, 0.93));
    let roof = [(0.10, -0.56), (0.10, 0.56), (-1.00, 0.56), (-1.00, -0.56)].map(|(x, y)| p(x, y, 1.44));
    let ridge = [p(0.05, 0.0, 1.50), p(-0.95, 0.0, 1.50)];
    polygon(mesh, &[base[0], base[1], roof[1], roof[0]], m.glass);
    polygon(mesh, &[base[1], base[2], roof[2], roof[1]], m.glass);
    polygon(mesh, &[base[2], base[3], roof[3], roof[2]], m.glass);
    polygon(mesh, &[base[3], base[0], roof[0], roof[3]], m.glass);
    polygon(mesh, &[roof[0], roof[1], ridge[0]], m.body);
    polygon(mesh, &[roof[1], roof[2], ridge[1], ridge[0]], m.body);
    polygon(mesh, &[roof[2], roof[3], ridge[1]], m.body);
    polygon(mesh, &[roof[3], roof[0], ridge[0], ridge[1]], m.body);
    polygon(mesh, &[base[3], base[2], base[1], base[0]], m.body);
}

/// A wheel with its axle along x: tyre tread, and discs of body metal (rims).
fn wheel(radius_m: f64, width_m: f64, m: CarMaterials) -> Mesh {
    let outline: Vec<DVec2> =
        (0..12).map(|i| radius_m * DVec2::from_angle(TAU * (f64::from(i) + 0.5) / 12.0)).collect();
    let mut mesh = Mesh::default();
    extrude_x(&mut mesh, &outline, (-0.5 * width_m, 0.5 * width_m), Profile::Closed, m.body);
    mesh.material[..24].fill(m.tyre);
    mesh
}

/// A box that stands on z = 0 with edges `size_m` along x, y, z, centred over the origin.
pub fn standing_box(size_m: DVec3, material: u32) -> Mesh {
    cuboid(size_m, DVec3::new(0.0, 0.0, 0.5 * size_m.z), material)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_vector_m2, is_watertight, volume_m3};

    fn bounds(m: &Mesh) -> (DVec3, DVec3) {
        m.positions_m.iter().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    }

    #[test]
    fn car_is_closed_and_of_its_size() {
        let m = passenger_car(CarMaterials { body: 0, glass: 1, tyre: 2 });
        assert!((100..=400).contains(&m.triangles.len()), "{}", m.triangles.len());
        assert!(is_watertight(&m));
        let (lo, hi) = bounds(&m);
        assert!((hi - lo - DVec3::new(4.5, 1.8, 1.5)).abs().max_element() < 0.011, "{lo} {hi}");
        // The lowest corners of a twelve-sided tyre lie on its flat: just above the road.
        assert!((0.0..0.02).contains(&lo.z));
        let v = volume_m3(&m);
        assert!((5.0..9.0).contains(&v), "{v}");
        let used: std::collections::BTreeSet<u32> = m.material.iter().copied().collect();
        assert_eq!(used.len(), 3);
        for t in 0..m.triangles.len() {
            assert!(area_vector_m2(&m, t).length() > 1e-4);
        }
        // Mirror image of itself.
        for p in &m.positions_m {
            let q = DVec3::new(p.x, -p.y, p.z);
            assert!(m.positions_m.iter().any(|r| (*r - q).length() < 1e-9));
        }
    }

    #[test]
    fn sheets_look_at_the_traffic() {
        let beam = w_beam(10.0, 0);
        assert_eq!(beam.triangles.len(), 14);
        let (lo, hi) = bounds(&beam);
        assert!((hi - lo - DVec3::new(10.0, 0.083, 0.312)).length() < 1e-12);
        assert!((0..14).all(|t| area_vector_m2(&beam, t).y > 0.0));
        let post = u_post(0.1, 0.06, 0.75, 0);
        assert_eq!(post.triangles.len(), 6);
        let n: Vec<DVec3> = (0..6).map(|t| area_vector_m2(&post, t).normalize()).collect();
        assert!((n[0] - DVec3::X).length() < 1e-12, "{}", n[0]);
        // Flanges look at each other: +y is the side of the left flange, so its normal is -y.
        assert!((n[2] + DVec3::Y).length() < 1e-12 && (n[4] - DVec3::Y).length() < 1e-12);
        let plane = ground(DVec2::new(0.0, -2.0), DVec2::new(5.0, 2.0), 0.1, 0);
        assert!((0..2).all(|t| (area_vector_m2(&plane, t) - DVec3::Z * 10.0).length() < 1e-12));
        for (inner, outer) in [(4.5, 20.0), (-4.5, -20.0)] {
            let v = verge((0.0, 100.0), inner, outer, 0);
            assert!((0..v.triangles.len()).all(|t| area_vector_m2(&v, t).z > 0.0));
        }
    }

    #[test]
    fn w_beam_section_has_its_size_and_length() {
        let s = w_beam_section(1e-5);
        let fold = |f: fn(f64, f64) -> f64, of: fn(&DVec2) -> f64, start: f64| {
            s.iter().map(|p| of(&p.0)).fold(start, f)
        };
        assert!((fold(f64::max, |p| p.y, -1.0) - 0.156).abs() < 1e-12);
        assert!((fold(f64::min, |p| p.y, 1.0) + 0.156).abs() < 1e-12);
        assert!((fold(f64::max, |p| p.x, -1.0) - 0.083).abs() < 2e-5);
        assert!(fold(f64::min, |p| p.x, 1.0).abs() < 1e-15);
        let developed: f64 = s.windows(2).map(|p| (p[1].0 - p[0].0).length()).sum();
        assert!((developed - 0.483).abs() < 0.001, "{developed}");
        for pair in s.windows(2) {
            let along = (pair[1].0 - pair[0].0).normalize();
            assert!(pair[1].0.y > pair[0].0.y, "it never turns back");
            for (_, n) in pair {
                assert!((n.length() - 1.0).abs() < 1e-12 && n.dot(along).abs() < 0.03 && n.x > 0.4);
            }
        }
    }

    #[test]
    fn standing_box_stands() {
        let b = standing_box(DVec3::new(0.1, 0.06, 0.75), 0);
        let (lo, hi) = bounds(&b);
        assert_eq!((lo.z, hi.z), (0.0, 0.75));
        assert!(is_watertight(&b));
    }
}
