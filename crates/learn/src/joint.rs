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
    pub cell_m: DVec2,
    /// Distance of the left edge from the middle, m.
    pub left_m: f64,
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

    /// The middle of a cell, (x forward, y left), m.
    pub fn middle_m(&self, cell: usize) -> DVec2 {
        let (row, column) = ((cell / self.columns) as f64 + 0.5, (cell % self.columns) as f64 + 0.5);
        DVec2::new(row * self.cell_m.x, self.left_m - column * self.cell_m.y)
    }

    /// The cell that holds a place (x forward, y left), m; None outside.
    pub fn cell(&self, p: DVec2) -> Option<usize> {
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
    /// Of each scan where it was made, and the logarithm of each class's probability less their mean, `[cell, class]`.
    scans: VecDeque<(Place, Vec<f32>)>,
}

impl Joint {
    /// No scan yet; at most `most` are taken together.
    pub fn new(grid: ScaledGrid, classes: usize, most: usize) -> Joint {
        Joint { grid, classes, most: most.max(1), scans: VecDeque::new() }
    }

    /// Adds a scan and gives the joint probabilities in its cells, both `[cell, class]`. The logarithms of a class's probabilities add up
    /// over the scans that saw the place; of two classes that is the sum of the logarithms of the odds. A cell takes from an earlier
    /// scan what the cell said in which its middle lies; where an earlier scan did not look, it says nothing.
    pub fn add(&mut self, place: Place, probabilities: &[f32]) -> Vec<f32> {
        let classes = self.classes;
        let mut logs: Vec<f32> = probabilities.iter().map(|p| p.max(LEAST).ln()).collect();
        for of in logs.chunks_exact_mut(classes) {
            let mean = of.iter().sum::<f32>() / classes as f32;
            of.iter_mut().for_each(|l| *l -= mean);
        }
        if self.scans.len() == self.most {
            self.scans.pop_front();
        }
        let mut sums = logs.clone();
        for (from, said) in &self.scans {
            for (cell, sum) in sums.chunks_exact_mut(classes).enumerate() {
                let there = from.seen_from(place.to_world(self.grid.middle_m(cell)));
                if let Some(at) = self.grid.cell(there) {
                    sum.iter_mut().zip(&said[at * classes..]).for_each(|(s, l)| *s += l);
                }
            }
        }
        self.scans.push_back((place, logs));
        for of in sums.chunks_exact_mut(classes) {
            let largest = of.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            of.iter_mut().for_each(|s| *s = (*s - largest).exp());
            let all: f32 = of.iter().sum();
            of.iter_mut().for_each(|s| *s /= all);
        }
        sums
    }
}

/// Cells around the grid that repeat its edge, so that what touches the edge counts as going on there.
const RIM: usize = 4;

/// Whether any cell of the 3 x 3 cells around each is set, or every one.
fn around(mask: &[bool], rows: usize, columns: usize, every: bool) -> Vec<bool> {
    let of = |cell: usize| {
        let (row, column) = (cell / columns, cell % columns);
        let rows = row.saturating_sub(1)..=(row + 1).min(rows - 1);
        let mut all = rows.flat_map(|r| {
            (column.saturating_sub(1)..=(column + 1).min(columns - 1)).map(move |c| r * columns + c)
        });
        if every { all.all(|at| mask[at]) } else { all.any(|at| mask[at]) }
    };
    (0..mask.len()).map(of).collect()
}

/// Closes gaps of one class in what is class 0, then takes away what of it is narrower than three cells: a closing and an opening with
/// squares of 3 x 3 cells. Other classes stay as they are and count as neighbours that the class may reach. At least one cell.
pub fn smoothed(places: &[u8], rows: usize, columns: usize, class: u8) -> Vec<u8> {
    let (high, wide) = (rows + 2 * RIM, columns + 2 * RIM);
    // The cell of the grid that a cell of the larger one repeats.
    let inner = |cell: usize| {
        let (row, column) = ((cell / wide).saturating_sub(RIM), (cell % wide).saturating_sub(RIM));
        row.min(rows - 1) * columns + column.min(columns - 1)
    };
    let larger =
        |of: &dyn Fn(usize) -> bool| -> Vec<bool> { (0..high * wide).map(|c| of(inner(c))).collect() };
    let is = larger(&|c| places[c] == class);
    let closed = around(&around(&is, high, wide, false), high, wide, true);
    // A cell of another class neither breaks the class nor becomes it.
    let others = larger(&|c| places[c] != 0 && places[c] != class);
    let joined: Vec<bool> = closed.iter().zip(&others).map(|(c, o)| *c || *o).collect();
    let opened = around(&around(&joined, high, wide, true), high, wide, false);
    let decide = |cell: usize| {
        let at = (cell / columns + RIM) * wide + cell % columns + RIM;
        match (places[cell], closed[at] && opened[at]) {
            (0, true) => class,
            (p, false) if p == class => 0,
            (p, _) => p,
        }
    };
    (0..places.len()).map(decide).collect()
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
        (all[2 * cell], all[2 * cell + 1]) = (1.0 - p, p);
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
        near(joint.add(here, &said(42, 0.6))[85], 0.6);
        let both = joint.add(here, &said(42, 0.8));
        near(both[85], 6.0 / 7.0);
        near(both[84], 1.0 / 7.0);
        near(both[41], 0.5);
        near(joint.add(here, &said(42, 0.5))[85], 0.8);
    }

    /// What lay in row 5 lies in row 3 after two metres ahead, and one column farther right after a metre to the left.
    #[test]
    fn earlier_scans_are_moved_along() {
        let mut joint = Joint::new(ScaledGrid::new(&SMALL, 1), 2, 5);
        let heading = 0.9;
        joint.add(place(1.0, 1.0, heading), &said(54, 0.9));
        let to = DVec2::new(1.0, 1.0) + DVec2::from_angle(heading) * 2.0 + DVec2::from_angle(heading).perp();
        let now = joint.add(place(to.x, to.y, heading), &said(0, 0.5));
        near(now[71], 0.9);
        near(now[109], 0.5);
        // A quarter turn to the left on the spot: what lay ahead lies to the right.
        let mut joint = Joint::new(ScaledGrid::new(&SMALL, 1), 2, 5);
        joint.add(place(0.0, 0.0, 0.0), &said(40, 0.9));
        // (4.5, 4.5) m ahead and left comes to lie at (4.5, -4.5).
        let now = joint.add(place(0.0, 0.0, std::f64::consts::FRAC_PI_2), &said(0, 0.5));
        near(now[99], 0.9);
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
        places[7 * columns + 7] = 1;
        assert_eq!(smoothed(&places, rows, columns, 1), whole);
        // What touches the edge stays, and nothing grows to it.
        let edge: Vec<u8> = (0..rows * columns).map(|c| u8::from(c % columns < 4)).collect();
        assert_eq!(smoothed(&edge, rows, columns, 1), edge);
        // A vehicle in the lane stays one.
        places[3 * columns + 3] = 2;
        let mut with = whole.clone();
        with[3 * columns + 3] = 2;
        assert_eq!(smoothed(&places, rows, columns, 1), with);
    }
}
