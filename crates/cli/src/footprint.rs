//! What an object covers seen from above, as polygons for a picture.

use catseye::scene::{Object, Scene, Shape};
use catseye_plot::Outline;
use glam::DVec3;
use std::collections::BTreeMap;

/// Above this width a box says little about a thing that may be bent: no vehicle is as wide.
const WIDEST_BOX_M: f64 = 6.0;
/// Side of the cells that a wide thing is cut to.
const CELL_M: f64 = 4.0;

/// The four corners of an upright box, or the pieces of a thing that fills little of its box, such as the rail along a bend.
pub fn footprint(scene: &Scene, object: &Object, time_s: f64, corners: [[f64; 2]; 4]) -> Vec<Outline> {
    let whole = Outline::whole(&object.class, corners.to_vec());
    let Shape::Mesh(mesh) = object.shape else { return vec![whole] };
    let side = |i: usize| {
        let (a, b) = (corners[i], corners[i + 1]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    };
    if side(0).min(side(1)) <= WIDEST_BOX_M {
        return vec![whole];
    }
    let (mesh, moving) = (&scene.meshes[mesh], object.at(time_s));
    let place = |p: DVec3| {
        let p = moving.translation_m + moving.rotation * p;
        [p.x, p.y]
    };
    let mut cells: BTreeMap<[i64; 2], Vec<[f64; 2]>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let at = triangle.map(|v| place(mesh.positions_m[v as usize]));
        let cell = [0, 1].map(|k| ((at[0][k] + at[1][k] + at[2][k]) / (3.0 * CELL_M)).floor() as i64);
        cells.entry(cell).or_default().extend(at);
    }
    let pieces: Vec<Vec<[f64; 2]>> = cells.into_values().map(convex_hull).filter(|h| h.len() > 2).collect();
    let covered: f64 = pieces.iter().map(|p| twice_area(p)).sum();
    if covered > 0.9 * 2.0 * side(0) * side(1) {
        return vec![whole];
    }
    let piece = |polygon| Outline { class: object.class.clone(), polygon, piece: true };
    pieces.into_iter().map(piece).collect()
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

fn twice_area(polygon: &[[f64; 2]]) -> f64 {
    polygon.windows(2).map(|w| cross(polygon[0], w[0], w[1])).sum()
}

/// Counter-clockwise, by Andrew's monotone chain.
fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut out: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while out.len() > 1 && cross(out[out.len() - 2], out[out.len() - 1], p) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_points_in_it() {
        let points = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0], [0.0, 0.0]];
        let hull = convex_hull(points);
        assert_eq!(hull, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(twice_area(&hull), 8.0);
        assert!(convex_hull(vec![[1.0, 1.0]]).is_empty() && twice_area(&[]) == 0.0);
    }
}
