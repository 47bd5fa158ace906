//! What several scans say together: joint probabilities over the last scans (Feng 2019, eq. 5.11 and figure 5.18), and the closing and
//! opening of what is then decided.

use catseye::road::mask::Grid;
use glam::DVec2;
use std::collections::VecDeque;

/// Smallest probability that a single scan may give to a class, so that no scan outweighs all others.
const LEAST: f32 = 1e-4;

/// Where the level frame of a radar stands in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The place under the radar, m.
    pub at_m: DVec2,
    /// Where the boresight points, of length 1.
    pub ahead: DVec2,
}

impl Place {
    fn to_world(self, p: DVec2) -> DVec2 {
        self.at_m + self.ahead * p.x + self.ahead.perp() * p.y
    }

    fn seen_from(self, p: DVec2) -> DVec2 {
        let d = p - self.at_m;
        DVec2::new(self.ahead.dot(d), self.ahead.perp_dot(d))
    }
}

/// Cells of a grid at a scale: squares of so many cells are one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledGrid {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Length of a cell ahead and across, m.
    cell_m: DVec2,
    /// Distance of the left edge from the middle, m.
    left_m: f64,
}

impl ScaledGrid {
    /// The cells of a grid at a scale. The last row and the last column may reach beyond the grid.
    pub fn new(grid: &Grid, scale: usize) -> ScaledGrid {
        let cell_m = DVec2::new(grid.ahead_m / grid.rows as f64, grid.across_m / grid.columns as f64);
        ScaledGrid {
            rows: grid.rows.div_ceil(scale),
            columns: grid.columns.div_ceil(scale),
            cell_m: cell_m * scale as f64,
            left_m: 0.5 * grid.across_m,
        }
    }

    fn cells(&self) -> usize {
        self.rows * self.columns
    }

    fn middle_m(&self, cell: usize) -> DVec2 {
        let (row, column) = ((cell / self.columns) as f64 + 0.5, (cell % self.columns) as f64 + 0.5);
        DVec2::new(row * self.cell_m.x, self.left_m - column * self.cell_m.y)
    }

    fn cell(&self, p: DVec2) -> Option<usize> {
        let (row, column) = (p.x / self.cell_m.x, (self.left_m - p.y) / self.cell_m.y);
        let inside = (0.0..self.rows as f64).contains(&row) && (0.0..self.columns as f64).contains(&column);
        inside.then(|| row as usize * self.columns + column as usize)
    }
}

/// The last scans of one radar.
#[derive(Debug, Clone)]
pub struct Joint {
    grid: ScaledGrid,
    classes: usize,
    most: usize,
    /// Of each scan where it was made, and the logarithm of each class's probability less their mean, `[class, cell]`.
    scans: VecDeque<(Place, Vec<f32>)>,
}

impl Joint {
    /// No scan yet; at most `most` are taken together.
    pub fn new(grid: ScaledGrid, classes: usize, most: usize) -> Joint {
        Joint { grid, classes, most: most.max(1), scans: VecDeque::new() }
    }

    /// Adds a scan and gives the joint probabilities in its cells, both `[class, cell]`. The logarithms of a class's probabilities add up
    /// over the scans that saw the place; of two classes that is the sum of the logarithms of the odds. A cell takes from an earlier
    /// scan what the cell said in which its middle lies; where an earlier scan did not look, it says nothing.
    pub fn add(&mut self, place: Place, probabilities: &[f32]) -> Vec<f32> {
        let cells = self.grid.cells();
        let mut logs: Vec<f32> = probabilities.iter().map(|p| p.max(LEAST).ln()).collect();
        for cell in 0..cells {
            let mean = (0..self.classes).map(|k| logs[k * cells + cell]).sum::<f32>() / self.classes as f32;
            (0..self.classes).for_each(|k| logs[k * cells + cell] -= mean);
        }
        if self.scans.len() == self.most {
            self.scans.pop_front();
        }
        let mut sums = logs.clone();
        for (from, said) in &self.scans {
            for cell in 0..cells {
                let there = from.seen_from(place.to_world(self.grid.middle_m(cell)));
                if let Some(at) = self.grid.cell(there) {
                    (0..self.classes).for_each(|k| sums[k * cells + cell] += said[k * cells + at]);
                }
            }
        }
        self.scans.push_back((place, logs));
        for cell in 0..cells {
            let of = |k: usize| k * cells + cell;
            let largest = (0..self.classes).map(|k| sums[of(k)]).fold(f32::NEG_INFINITY, f32::max);
            (0..self.classes).for_each(|k| sums[of(k)] = (sums[of(k)] - largest).exp());
            let all: f32 = (0..self.classes).map(|k| sums[of(k)]).sum();
            (0..self.classes).for_each(|k| sums[of(k)] /= all);
        }
        sums
    }
}

/// Closes gaps of one class in what is class 0, then takes away what of it is narrower than three cells: a closing and an opening with
/// squares of 3 x 3 cells. Other classes stay as they are and count as neighbours that the class may reach.
pub fn smoothed(places: &[u8], rows: usize, columns: usize, class: u8) -> Vec<u8> {
    let around = |mask: &[bool], cell: usize, every: bool| -> bool {
        let (row, column) = (cell / columns, cell % columns);
        let rows = row.saturating_sub(1)..=(row + 1).min(rows - 1);
        let mut all = rows.flat_map(|r| {
            (column.saturating_sub(1)..=(column + 1).min(columns - 1)).map(move |c| r * columns + c)
        });
        if every { all.all(|at| mask[at]) } else { all.any(|at| mask[at]) }
    };
    let step = |mask: &[bool], every: bool| -> Vec<bool> {
        (0..mask.len()).map(|cell| around(mask, cell, every)).collect()
    };
    let is: Vec<bool> = places.iter().map(|p| *p == class).collect();
    let closed = step(&step(&is, false), true);
    // A cell of another class neither breaks the class nor becomes it.
    let joined: Vec<bool> = closed.iter().zip(places).map(|(c, p)| *c || (*p != 0 && *p != class)).collect();
    let opened = step(&step(&joined, true), false);
    places
        .iter()
        .enumerate()
        .map(|(cell, place)| match (*place, closed[cell] && opened[cell]) {
            (0, true) => class,
            (p, false) if p == class => 0,
            (p, _) => p,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Grid = Grid { rows: 10, columns: 10, ahead_m: 10.0, across_m: 10.0 };

    fn place(x_m: f64, y_m: f64, heading_rad: f64) -> Place {
        Place { at_m: DVec2::new(x_m, y_m), ahead: DVec2::from_angle(heading_rad) }
    }

    /// Probabilities of two classes: `p` of the second in one cell, one half elsewhere.
    fn said(cell: usize, p: f32) -> Vec<f32> {
        let mut all = vec![0.5; 200];
        (all[cell], all[100 + cell]) = (1.0 - p, p);
        all
    }

    fn near(a: f32, b: f64) {
        assert!((f64::from(a) - b).abs() < 1e-5, "{a} {b}");
    }

    /// At rest, odds multiply: 0.6 and 0.8 are odds of 1.5 and 4, together 6 to 1. The third scan drops the first.
    #[test]
    fn odds_multiply() {
        let mut joint = Joint::new(ScaledGrid::new(&SMALL, 1), 2, 2);
        let here = place(3.0, 4.0, 0.7);
        near(joint.add(here, &said(42, 0.6))[142], 0.6);
        let both = joint.add(here, &said(42, 0.8));
        near(both[142], 6.0 / 7.0);
        near(both[42], 1.0 / 7.0);
        near(both[120], 0.5);
        near(joint.add(here, &said(42, 0.5))[142], 0.8);
    }

    /// What lay in row 5 lies in row 3 after two metres ahead, and one column farther right after a metre to the left.
    #[test]
    fn earlier_scans_are_moved_along() {
        let mut joint = Joint::new(ScaledGrid::new(&SMALL, 1), 2, 5);
        let heading = 0.9;
        joint.add(place(1.0, 1.0, heading), &said(54, 0.9));
        let to = DVec2::new(1.0, 1.0) + DVec2::from_angle(heading) * 2.0 + DVec2::from_angle(heading).perp();
        let now = joint.add(place(to.x, to.y, heading), &said(0, 0.5));
        near(now[100 + 35], 0.9);
        near(now[100 + 54], 0.5);
        // A quarter turn to the left on the spot: what lay ahead lies to the right.
        let mut joint = Joint::new(ScaledGrid::new(&SMALL, 1), 2, 5);
        joint.add(place(0.0, 0.0, 0.0), &said(40, 0.9));
        // (4.5, 4.5) m ahead and left comes to lie at (4.5, -4.5).
        let now = joint.add(place(0.0, 0.0, std::f64::consts::FRAC_PI_2), &said(0, 0.5));
        near(now[100 + 49], 0.9);
    }

    /// Odd sizes keep the left edge where it is.
    #[test]
    fn scaled_cells_have_their_places() {
        let g = ScaledGrid::new(&Grid { rows: 5, columns: 5, ahead_m: 5.0, across_m: 5.0 }, 2);
        assert_eq!((g.rows, g.columns), (3, 3));
        assert_eq!(g.middle_m(0), DVec2::new(1.0, 1.5));
        for cell in 0..9 {
            assert_eq!(g.cell(g.middle_m(cell)), Some(cell));
        }
        assert_eq!(g.cell(DVec2::new(-0.1, 0.0)), None);
    }

    #[test]
    fn gaps_are_closed_and_outliers_taken_away() {
        let (rows, columns) = (8, 9);
        let mut places = vec![0u8; rows * columns];
        for row in 1..6 {
            (1..7).for_each(|c| places[row * columns + c] = 1);
        }
        let whole = places.clone();
        places[3 * columns + 3] = 0;
        places[7 * columns + 8] = 1;
        assert_eq!(smoothed(&places, rows, columns, 1), whole);
        // A vehicle in the lane stays one.
        places[3 * columns + 3] = 2;
        let mut with = whole.clone();
        with[3 * columns + 3] = 2;
        assert_eq!(smoothed(&places, rows, columns, 1), with);
    }
}
