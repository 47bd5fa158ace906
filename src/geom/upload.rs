//! The geometry as the arrays that the shaders read.

use super::{Geometry, Surface};
use crate::base::error::{BadInput, Result};
use crate::base::units::wavenumber;
use crate::em::layers::Backing;
use glam::DVec3;
use num_complex::Complex64;

/// Bodies are packed two to a word in the shaders' returns.
const MAX_BODIES: usize = 65_536;
/// Stack entries of the WGSL traversal; one entry a level of the tree is an upper bound.
const MAX_DEPTH: usize = 24;

/// Arrays for the bindings `bvh_nodes`, `bvh_triangles`, `planes`, `surfaces`.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometryArrays {
    /// Nodes of the tree, five words of four each (obvhs' CWBVH node).
    pub nodes: Vec<[u32; 4]>,
    /// Three words for each triangle, (v0, patch), (e1, body), (e2, surface), integers as bits.
    pub triangles: Vec<[f32; 4]>,
    /// High and low parts of (normal, offset) of each plane normal . p = offset.
    pub planes: Vec<[f32; 4]>,
    /// [`surface_words`] of the surfaces.
    pub surfaces: Vec<[f32; 4]>,
}

/// Splits `x` into the nearest f32 and the f32 nearest to what is left.
pub fn split(x: f64) -> [f32; 2] {
    let hi = x as f32;
    [hi, (x - hi as f64) as f32]
}

/// Splits a vector into its high and low parts.
pub fn split3(v: DVec3) -> [[f32; 3]; 2] {
    let high = v.as_vec3();
    [high.to_array(), (v - high.as_dvec3()).as_vec3().to_array()]
}

impl GeometryArrays {
    /// Packs a geometry into the arrays that shaders read.
    ///
    /// # Errors
    /// Returns an error for more bodies or a deeper tree than the shaders can hold.
    pub fn new(geometry: &Geometry) -> Result<Self> {
        if geometry.bodies.len() > MAX_BODIES {
            return Err(BadInput::new("too many objects for the gpu engine")
                .key("objects")
                .value(geometry.bodies.len())
                .allowed(format!("at most {MAX_BODIES}"))
                .remedy("join objects or use --device cpu")
                .into());
        }
        let cwbvh = &geometry.bvh.cwbvh;
        let depth = depth(cwbvh);
        if depth > MAX_DEPTH {
            return Err(BadInput::new("the scene's tree is too deep for the gpu engine")
                .key("depth")
                .value(depth)
                .allowed(format!("at most {MAX_DEPTH}"))
                .remedy("use --device cpu")
                .into());
        }
        let mut arrays = GeometryArrays {
            nodes: bytemuck::cast_slice(&cwbvh.nodes).to_vec(),
            triangles: Vec::with_capacity(3 * geometry.triangles.len()),
            planes: Vec::with_capacity(2 * geometry.triangles.len()),
            surfaces: surface_words(&geometry.surfaces, geometry.freq_hz)?,
        };
        for t in geometry.triangles.iter() {
            for (v, bits) in [(t.v0, t.patch), (t.e1, t.body), (t.e2, t.surface)] {
                arrays.triangles.push(v.as_vec3().extend(f32::from_bits(bits)).to_array());
            }
            let [n_hi, n_lo] = split3(t.normal);
            let [d_hi, d_lo] = split(t.normal.dot(t.v0));
            arrays.planes.push([n_hi[0], n_hi[1], n_hi[2], d_hi]);
            arrays.planes.push([n_lo[0], n_lo[1], n_lo[2], d_lo]);
        }
        Ok(arrays)
    }
}

/// Linear interpolation of a layered surface's reflection errs by less than this.
pub const TABLE_ERROR: f64 = 1e-5;
/// Most intervals of a surface's table.
const TABLE_MAX: usize = 1 << 15;

/// The words of `surfaces` in the shaders: one for each surface, then the tables of the layered ones.
///
/// The word of a half-space is (eps', -eps'', height deviation in m, 0), of a perfect conductor (0, 0,
/// deviation, 1), of layers (first word of the table, intervals, deviation, 2). A table has two words (A,
/// B) for each incidence cosine from 0 to 1 in even steps: those of
/// [`Stack::front`](crate::em::layers::Stack::front) for E perpendicular to the plane of incidence, then
/// in it.
///
/// # Errors
/// Returns an error for layers so thick and clear that the table would not reach [`TABLE_ERROR`].
pub fn surface_words(surfaces: &[Surface], freq_hz: f64) -> Result<Vec<[f32; 4]>> {
    let mut words = Vec::with_capacity(surfaces.len());
    let mut tables: Vec<[f32; 4]> = Vec::new();
    for s in surfaces {
        let rough = s.roughness_rms_m as f32;
        words.push(match (s.stack.layers.is_empty(), s.stack.backing) {
            (true, Backing::Pec) => [0.0, 0.0, rough, 1.0],
            (true, Backing::HalfSpace(e)) => [e.re as f32, e.im as f32, rough, 0.0],
            (true, Backing::Air) => [1.0, 0.0, rough, 0.0],
            (false, _) => {
                let table = table(s, freq_hz)?;
                let first = surfaces.len() + tables.len();
                let intervals = table.len() / 2 - 1;
                tables.extend(table);
                // Small integers as f32: exact, and no bits that a driver could flush to zero.
                [first as f32, intervals as f32, rough, 2.0]
            }
        });
    }
    words.append(&mut tables);
    if words.len() > 1 << 24 {
        return Err(BadInput::new("too many layered materials for the gpu engine")
            .key("words of reflection tables")
            .value(words.len())
            .allowed(format!("at most {}", 1 << 24))
            .remedy("use --device cpu")
            .into());
    }
    Ok(words)
}

/// Doubles the number of intervals until the reflection in their middles is close enough.
fn table(surface: &Surface, freq_hz: f64) -> Result<Vec<[f32; 4]>> {
    let k = wavenumber(freq_hz);
    let word = |(a, b): (Complex64, Complex64)| [a.re, a.im, b.re, b.im].map(|x| x as f32);
    let mut worst = f64::INFINITY;
    let mut intervals = 64;
    while intervals <= TABLE_MAX {
        let table: Vec<[f32; 4]> = (0..=intervals)
            .flat_map(|i| surface.stack.front(k, i as f64 / intervals as f64).map(word))
            .collect();
        worst = (0..intervals)
            .map(|i| {
                let cos_i = (i as f64 + 0.5) / intervals as f64;
                let (perp, par) = surface.stack.reflection(k, cos_i);
                let [p, q] = reflection_from_table(&table, cos_i);
                (p - perp).norm().max((q - par).norm())
            })
            .fold(0.0, f64::max);
        if worst < TABLE_ERROR {
            return Ok(table);
        }
        intervals *= 2;
    }
    Err(BadInput::new(
        "the reflection of a layered material varies too rapidly with the angle for the gpu engine",
    )
    .key("thickness_m")
    .value(surface.stack.thickness_m())
    .allowed(format!("an interpolation error below {TABLE_ERROR:e}; {TABLE_MAX} steps give {worst:.1e}"))
    .remedy("use --device cpu, or model a thick layer as a half-space")
    .into())
}

/// (R_perp, R_par) at `cos_i` as the shaders read them from a table.
fn reflection_from_table(table: &[[f32; 4]], cos_i: f64) -> [Complex64; 2] {
    let intervals = table.len() / 2 - 1;
    let x = cos_i * intervals as f64;
    let i = (x as usize).min(intervals - 1);
    let t = x - i as f64;
    [0, 1].map(|p| {
        let [a, b] = [0, 2].map(|c| {
            let z = |w: [f32; 4]| Complex64::new(w[c] as f64, w[c + 1] as f64);
            z(table[2 * i + p]) * (1.0 - t) + z(table[2 * i + 2 + p]) * t
        });
        (a * cos_i - b) / (a * cos_i + b)
    })
}

/// Levels of the tree.
fn depth(bvh: &obvhs::cwbvh::CwBvh) -> usize {
    let mut deepest = 0;
    let mut stack = if bvh.nodes.is_empty() { vec![] } else { vec![(0usize, 1usize)] };
    while let Some((node, level)) = stack.pop() {
        deepest = deepest.max(level);
        let n = &bvh.nodes[node];
        for child in 0..n.imask.count_ones() as usize {
            stack.push((n.child_base_idx as usize + child, level + 1));
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material;

    fn surface(spec: &str) -> Surface {
        Surface::of(&material::parse_spec(spec).unwrap(), 77e9).unwrap()
    }

    /// At every angle, not only in the middles where the table was judged.
    #[test]
    fn tables_of_usual_stacks() {
        let mut sizes = Vec::new();
        for spec in [
            "aluminium+water:0.0002",
            "steel+paint-white:0.0003",
            "pec+leaves:0.0005+water:0.0001",
            "air+glass:0.004",
            "air+polypropylene:0.003+paint-white:0.00005",
            "concrete+water:0.001",
            "steel+ice:0.01",
            "pec+paint-white:0.000001",
        ] {
            let s = surface(spec);
            let words = surface_words(&[surface("steel"), s.clone()], 77e9).unwrap();
            assert_eq!((words[1][0], words[1][3]), (2.0, 2.0));
            let table = &words[2..];
            sizes.push((spec, table.len() / 2 - 1));
            let k = wavenumber(77e9);
            let worst = (1..=9973)
                .map(|i| {
                    let c = i as f64 / 9973.0;
                    let [p, q] = reflection_from_table(table, c);
                    let (perp, par) = s.reflection(k, c);
                    (p - perp).norm().max((q - par).norm())
                })
                .fold(0.0, f64::max);
            assert!(worst < 1.2 * TABLE_ERROR, "{spec}: {worst:e}");
        }
        println!("{sizes:?}");
        let e = surface_words(&[surface("pec+air:2")], 77e9).unwrap_err().to_string();
        assert!(e.contains("thickness_m = 2") && e.contains("--device cpu"), "{e}");
    }
}
