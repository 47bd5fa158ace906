//! Vertices that are one place but for rounding, put together: bodies of files are closed only then.

use super::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// Vertices nearer to one another than this share of the mesh's size are one place ...
const SHARE: f64 = 1e-6;
/// ... but never farther apart than the second of these, nor apart at all within the first, m.
const LEAST_M: f64 = 1e-6;
const MOST_M: f64 = 2e-5;
/// Width of the cells in which neighbours are looked for, in tolerances.
const CELL: f64 = 8.0;

/// How near vertices of a mesh of this size are one place, m.
pub fn tolerance_m(size_m: f64) -> f64 {
    (SHARE * size_m).clamp(LEAST_M, MOST_M)
}

/// Moves vertices that lie within the tolerance of an earlier one to its place. Gives the number of places that were given up.
pub fn weld(mesh: &mut Mesh) -> usize {
    let (lo, hi) =
        mesh.positions_m.iter().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let near_m = tolerance_m((hi - lo).length());
    let width_m = CELL * near_m;
    let mut exact: HashMap<[u64; 3], DVec3> = HashMap::with_capacity(mesh.positions_m.len());
    let mut cells: HashMap<[i64; 3], Vec<DVec3>> = HashMap::with_capacity(mesh.positions_m.len());
    let mut moved = 0;
    for p in &mut mesh.positions_m {
        let place = *exact.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
            let at = |q: DVec3| (q / width_m).floor().to_array().map(|x| x as i64);
            let (first, last) = (at(*p - near_m), at(*p + near_m));
            for x in first[0]..=last[0] {
                for y in first[1]..=last[1] {
                    for z in first[2]..=last[2] {
                        let known = cells.get(&[x, y, z]).into_iter().flatten();
                        if let Some(q) = known.copied().find(|q| q.distance(*p) <= near_m) {
                            moved += 1;
                            return q;
                        }
                    }
                }
            }
            cells.entry(at(*p)).or_default().push(*p);
            *p
        });
        *p = place;
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_within_the_tolerance_become_one_place_and_no_others() {
        let places = [0.0, 3e-7, 0.9e-6, 2.1e-6, 0.5].map(|x| DVec3::new(x, -x, 0.1));
        let mut mesh = Mesh { positions_m: places.to_vec(), ..Mesh::default() };
        // Of half a metre: 1 µm. The third is 1.3 µm from the first.
        assert_eq!(weld(&mut mesh), 1);
        assert_eq!(mesh.positions_m, [places[0], places[0], places[2], places[3], places[4]]);
        assert_eq!(weld(&mut mesh), 0);
        assert_eq!([0.01, 4.0, 500.0].map(tolerance_m), [1e-6, 4.0 * SHARE, 2e-5]);
    }

    #[test]
    fn places_on_both_sides_of_a_cell_are_found() {
        let at = CELL * tolerance_m(1.0);
        let mut mesh = Mesh {
            positions_m: vec![
                DVec3::splat(at - 1e-7),
                DVec3::splat(at + 1e-7),
                DVec3::splat(1.0 / 3f64.sqrt()),
            ],
            ..Mesh::default()
        };
        assert_eq!(weld(&mut mesh), 1);
    }
}
