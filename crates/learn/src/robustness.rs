//! Made-up scans of a lane between two rows of points, with what table 5.6 of Feng (2019) changes from set to set: the distances between
//! the points, the width of the lane, points of noise and points of other objects.

use crate::data::Example;
use crate::scan::{GridKind, Scan, ScanCell};
use catseye::base::rng::Draws;
use catseye::road::mask::{CellClass, Grid};
use glam::DVec2;
use std::collections::BTreeMap;

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustnessSet {
    /// Its number there.
    pub number: u32,
    /// Distances between the points of the left and of the right row, m.
    pub spacing_m: [f64; 2],
    /// Distance between the rows, m.
    pub width_m: f64,
    /// Points of noise anywhere in the grid.
    pub noise: usize,
    /// Points of objects in the lane, eight for each object.
    pub objects: usize,
    /// Precision, recall and F1 of the lane that the table gives.
    pub document: [f64; 3],
}

const fn set(
    number: u32,
    spacing_m: [f64; 2],
    width_m: f64,
    noise: usize,
    objects: usize,
    document: [f64; 3],
) -> RobustnessSet {
    RobustnessSet { number, spacing_m, width_m, noise, objects, document }
}

/// The sets of the table.
pub const SETS: [RobustnessSet; 17] = [
    set(1, [0.7, 0.7], 3.5, 0, 0, [1.00, 0.69, 0.82]),
    set(2, [1.5, 2.0], 3.5, 0, 0, [0.91, 0.93, 0.92]),
    set(3, [2.0, 1.5], 3.5, 0, 0, [0.95, 0.94, 0.95]),
    set(4, [4.0, 3.0], 3.5, 0, 0, [0.82, 0.79, 0.80]),
    set(5, [8.0, 6.0], 3.5, 0, 0, [0.85, 0.12, 0.21]),
    set(6, [2.0, 1.5], 2.6, 0, 0, [0.68, 0.74, 0.71]),
    set(7, [2.0, 1.5], 6.0, 0, 0, [0.98, 0.64, 0.77]),
    set(8, [2.0, 1.5], 8.0, 0, 0, [1.00, 0.80, 0.89]),
    set(9, [2.0, 1.5], 10.0, 0, 0, [0.77, 0.05, 0.09]),
    set(10, [2.0, 1.5], 14.0, 0, 0, [0.46, 0.03, 0.06]),
    set(11, [2.0, 1.5], 3.5, 16, 0, [0.95, 0.93, 0.94]),
    set(12, [2.0, 1.5], 3.5, 64, 0, [0.98, 0.90, 0.94]),
    set(13, [2.0, 1.5], 3.5, 256, 0, [0.49, 0.08, 0.14]),
    set(14, [2.0, 1.5], 3.5, 1024, 0, [0.11, 0.03, 0.05]),
    set(15, [2.0, 1.5], 3.5, 0, 8, [0.97, 0.91, 0.94]),
    set(16, [2.0, 1.5], 3.5, 0, 32, [0.93, 0.89, 0.91]),
    set(17, [2.0, 1.5], 3.5, 0, 128, [0.94, 0.66, 0.78]),
];

/// Standard deviation of a point's place along both axes, m.
const PLACE_STD_M: f64 = 0.05;

impl RobustnessSet {
    /// A scan of this set with its truth. The lane is straight, passes within 1 m of the radar's middle and runs within 5° of ahead; where
    /// the rows begin is drawn. All points have the amplitude 1.
    pub fn example(&self, kind: GridKind, seed: u32, picture: u32) -> Example {
        let grid = kind.grid();
        let mut draws = Draws::new(seed, self.number << 16 | picture);
        let mut between = |lo: f64, hi: f64| lo + (hi - lo) * draws.uniform();
        let (aside_m, heading_rad) = (between(-1.0, 1.0), between(-5.0, 5.0).to_radians());
        let ahead = DVec2::from_angle(heading_rad);
        let lane = |along: f64, left: f64| DVec2::new(0.0, aside_m) + ahead * along + ahead.perp() * left;
        let mut places = Vec::new();
        for (spacing, side) in self.spacing_m.into_iter().zip([0.5, -0.5]) {
            let mut along = between(0.0, spacing);
            while along < 1.1 * grid.ahead_m {
                places.push(lane(along, side * self.width_m));
                along += spacing;
            }
        }
        for _ in 0..self.noise {
            places.push(DVec2::new(between(0.0, grid.ahead_m), between(-0.5, 0.5) * grid.across_m));
        }
        for _ in 0..self.objects / 8 {
            // The outline of a car that stands in the lane.
            let at = (between(8.0, grid.ahead_m - 4.0), between(-0.5, 0.5) * (self.width_m - 2.0).max(0.0));
            for _ in 0..8 {
                let (along, left) = (between(0.0, 4.5), between(-0.9, 0.9));
                places.push(lane(at.0 + along, at.1 + left));
            }
        }
        let mut cells: BTreeMap<u32, (f32, DVec2)> = BTreeMap::new();
        for place in places {
            let off = PLACE_STD_M * DVec2::new(draws.normal(), draws.normal());
            let at = place + off;
            if let Some(cell) = grid.cell(at.x, at.y) {
                let held = cells.entry(cell as u32).or_insert((0.0, at));
                held.0 += 1.0;
            }
        }
        let cell = |(cell, (count, at)): (u32, (f32, DVec2))| ScanCell {
            cell,
            count,
            amplitude: 1.0,
            range_m: at.length() as f32,
            azimuth_rad: at.y.atan2(at.x) as f32,
        };
        let scan = Scan { grid, cells: cells.into_iter().map(cell).collect() };
        Example::new(
            scan,
            truth(&grid, |at| {
                let d = at - DVec2::new(0.0, aside_m);
                ahead.perp().dot(d).abs() <= 0.5 * self.width_m
            }),
        )
    }
}

/// The classes of the cells: a lane where its middle lies in it.
fn truth(grid: &Grid, is_lane: impl Fn(DVec2) -> bool) -> Vec<u8> {
    let class = |cell: usize| {
        let middle = grid.middle_m(cell / grid.columns, cell % grid.columns);
        if is_lane(DVec2::from_array(middle)) { CellClass::Lane } else { CellClass::Undefined }
    };
    (0..grid.cells()).map(|cell| class(cell) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::augment::Move;
    use crate::classes::Classes;
    use crate::scan::Input;

    /// As many points as the rows, the noise and the objects have, and a lane of the right width.
    #[test]
    fn sets_are_what_their_numbers_say() {
        let classes = Classes::named(&["undefined", "lane"].map(String::from)).unwrap();
        for set in SETS {
            let e = set.example(GridKind::Markers, 1, 0);
            let points: f32 = e.features(Input::C2, 1, &Move::NONE).values()[..227 * 227]
                .iter()
                .map(|full| if *full > 0.0 { 1.0 / (1.0 / full - 1.0) } else { 0.0 })
                .sum();
            let rows: f64 = set.spacing_m.iter().map(|s| 40.0 / s).sum();
            let wanted = rows + (set.noise + set.objects / 8 * 8) as f64;
            assert!(
                (f64::from(points) - wanted).abs() < 4.0 + 0.04 * wanted,
                "{set:?}: {points} of {wanted}"
            );
            let lane = e.labels(&classes, 1, &Move::NONE).places().iter().filter(|p| **p == 1).count();
            let share = set.width_m / 40.0 * 227.0 * 227.0;
            assert!((lane as f64 / share - 1.0).abs() < 0.03, "{set:?}: {lane} of {share}");
        }
        let same = |p| SETS[2].example(GridKind::Road, 7, p).features(Input::B, 1, &Move::NONE);
        assert_eq!(same(3), same(3));
        assert_ne!(same(3), same(4));
    }
}
