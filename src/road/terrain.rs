//! Hills: of a million triangles for the ray-casting workload W6, and beside the road of W8.

use crate::scene::Mesh;
use glam::DVec3;

/// Quads along each side of W6's terrain: 2 x 708² = 1,002,528 triangles.
pub const W6_QUADS: u32 = 708;
/// Edge of W6's quads.
pub const W6_CELL_M: f64 = 0.25;
/// Greatest height over the mean in W6.
pub const W6_RELIEF_M: f64 = 4.0;

/// The terrain of W6, 177 x 177 m.
pub fn w6(material: u32) -> Mesh {
    terrain(W6_QUADS, W6_CELL_M, W6_RELIEF_M, 1, material)
}

/// Quads along each side of W8's terrain: 2 x 300² = 180,000 triangles.
pub const W8_QUADS: u32 = 300;
/// Length of each side of W8's terrain.
pub const W8_SIDE_M: f64 = 120.0;
/// Edge of W8's quads, and of the cells of the noise that its hills are made of however finely they are cut.
pub const W8_CELL_M: f64 = 0.4;
/// Greatest height over the road in W8.
pub const W8_RELIEF_M: f64 = 1.0;
/// Half the width of W8's flat road, which lies along x.
pub const W8_ROAD_HALF_M: f64 = 4.0;
/// Distance from the edge of W8's road to where its hills have their full height, m.
const W8_RISE_M: f64 = 8.0;

/// The terrain of W8, 120 x 120 m about the origin: flat and at height 0 on the road, hills beside it. It is cut into
/// 2 x `quads`² triangles, whose vertices lie on the same hills for every number; W8 has [`W8_QUADS`].
pub fn w8(quads: u32, material: u32) -> Mesh {
    let cell_m = W8_SIDE_M / f64::from(quads);
    let at = |i: u32| (f64::from(i) - 0.5 * f64::from(quads)) * cell_m;
    sheet(quads, cell_m, |i, j| w8_height_m(at(i), at(j)), material)
}

/// Height of W8's terrain over a place from its centre, m; its meshes have it at their vertices.
pub fn w8_height_m(x: f64, y: f64) -> f64 {
    let t = ((y.abs() - W8_ROAD_HALF_M - 1e-9) / W8_RISE_M).clamp(0.0, 1.0);
    let rise = t * t * (3.0 - 2.0 * t);
    if rise == 0.0 {
        return 0.0;
    }
    let half = 0.5 * f64::from(W8_QUADS);
    W8_RELIEF_M * rise * height(x / W8_CELL_M + half, y / W8_CELL_M + half, 8)
}

/// A square sheet of `quads`² cells of edge `cell_m`, centred at the origin, looking up; heights are
/// value noise in six octaves, below `relief_m` in amount, and depend on nothing but `seed` and the
/// place.
pub fn terrain(quads: u32, cell_m: f64, relief_m: f64, seed: u32, material: u32) -> Mesh {
    sheet(quads, cell_m, |i, j| relief_m * height(f64::from(i), f64::from(j), seed), material)
}

/// A square sheet of `quads`² cells of edge `cell_m`, centred at the origin, with the heights of its vertices (i, j).
fn sheet(quads: u32, cell_m: f64, height_m: impl Fn(u32, u32) -> f64, material: u32) -> Mesh {
    let side = quads + 1;
    let half = 0.5 * f64::from(quads) * cell_m;
    let mut mesh = Mesh::default();
    mesh.positions_m.reserve((side * side) as usize);
    for j in 0..side {
        for i in 0..side {
            let (x, y) = (f64::from(i) * cell_m - half, f64::from(j) * cell_m - half);
            mesh.positions_m.push(DVec3::new(x, y, height_m(i, j)));
        }
    }
    for j in 0..quads {
        for i in 0..quads {
            let a = j * side + i;
            mesh.triangles.push([a, a + 1, a + side + 1]);
            mesh.triangles.push([a, a + side + 1, a + side]);
        }
    }
    mesh.material = vec![material; mesh.triangles.len()];
    mesh
}

/// Sum of octaves from 64 cells down to 2 cells; each half the height of the one before; within ±1.
fn height(x: f64, y: f64, seed: u32) -> f64 {
    let (mut sum, mut weight, mut scale) = (0.0, 0.5, 64.0);
    for octave in 0..6 {
        sum += weight * value_noise(x / scale, y / scale, seed ^ (octave << 24));
        weight *= 0.5;
        scale *= 0.5;
    }
    sum
}

/// Smoothly interpolated hash values on the integer lattice, within ±1.
fn value_noise(x: f64, y: f64, seed: u32) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (smooth(x - i), smooth(y - j));
    let at = |di: u32, dj: u32| {
        let h = hash((i as u32).wrapping_add(di), (j as u32).wrapping_add(dj), seed);
        f64::from(h) / f64::from(u32::MAX) * 2.0 - 1.0
    };
    let low = at(0, 0) * (1.0 - u) + at(1, 0) * u;
    let high = at(0, 1) * (1.0 - u) + at(1, 1) * u;
    low * (1.0 - v) + high * v
}

/// Murmur3's 32-bit finaliser over the three words.
fn hash(a: u32, b: u32, c: u32) -> u32 {
    let mut h = c;
    for word in [a, b] {
        h = (h ^ word).wrapping_mul(0x9e37_79b1);
        h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
        h ^= h >> 16;
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::area_vector_m2;

    #[test]
    fn a_million_triangles_looking_up() {
        let m = w6(3);
        assert_eq!(m.triangles.len(), 1_002_528);
        assert_eq!(m.positions_m.len(), 709 * 709);
        assert!(m.material.iter().all(|&i| i == 3));
        let cell = 0.5 * W6_CELL_M * W6_CELL_M;
        assert!((0..m.triangles.len()).all(|t| (area_vector_m2(&m, t).z - cell).abs() < 1e-9));
        let (lo, hi) =
            m.positions_m.iter().fold((f64::MAX, f64::MIN), |(lo, hi), p| (lo.min(p.z), hi.max(p.z)));
        assert!(lo > -W6_RELIEF_M && hi < W6_RELIEF_M && hi - lo > W6_RELIEF_M, "{lo} {hi}");
    }

    #[test]
    fn a_flat_road_between_hills() {
        assert_eq!(W8_SIDE_M / f64::from(W8_QUADS), W8_CELL_M);
        let m = w8(W8_QUADS, 2);
        assert_eq!(m.triangles.len(), 180_000);
        let (mut on_road, mut least, mut most) = (0, f64::MAX, f64::MIN);
        for p in &m.positions_m {
            assert!(p.x.abs() <= 60.0 + 1e-9 && p.y.abs() <= 60.0 + 1e-9);
            if p.y.abs() < W8_ROAD_HALF_M + 1e-6 {
                assert_eq!(p.z, 0.0);
                on_road += 1;
            }
            (least, most) = (least.min(p.z), most.max(p.z));
        }
        // The edges of the road lie on rows of vertices, so it is as wide as it is said to be.
        assert_eq!(on_road, 21 * 301);
        assert!(least > -W8_RELIEF_M && most < W8_RELIEF_M && most - least > W8_RELIEF_M, "{least} {most}");
        let up = (0..m.triangles.len()).all(|t| area_vector_m2(&m, t).z > 0.0);
        assert!(up);
    }

    #[test]
    fn finer_cuts_have_the_same_hills() {
        let (coarse, fine) = (w8(30, 2), w8(60, 2));
        assert_eq!([coarse.triangles.len(), fine.triangles.len()], [1800, 7200]);
        for (k, p) in coarse.positions_m.iter().enumerate() {
            let (i, j) = (k % 31, k / 31);
            assert!((*p - fine.positions_m[2 * j * 61 + 2 * i]).length() < 1e-9);
        }
    }

    #[test]
    fn same_seed_same_hills() {
        let m = |seed| terrain(20, 1.0, 2.0, seed, 0);
        assert_eq!(m(5), m(5));
        assert_ne!(m(5), m(6));
    }
}
