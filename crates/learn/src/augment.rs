//! Pictures that are moved before they are learned: points and truth together, so that a few scenes teach more.

use crate::scan::{Scan, ScanCell};
use catseye::base::rng::Draws;
use catseye::road::mask::{CellClass, Grid};
use glam::{DMat2, DVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Random changes of the examples, new in each epoch.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Augment {
    /// true: every second example is mirrored left to right.
    pub mirror: bool,
    /// Maximum rotation about the radar in either direction, degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub turn_deg: f64,
    /// Maximum shift forward, backward and to either side, m.
    #[schemars(range(min = 0.0, max = 30.0))]
    pub shift_m: f64,
    /// Points nearer than this are left out of examples that are rotated or shifted, m: they include echoes of the ground, which
    /// would not move with the road (Feng 2019, section 5.2.8).
    #[schemars(range(min = 0.0, max = 60.0))]
    pub near_m: f64,
    /// Maximum share of the points that are left out.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub drop: f64,
    /// Maximum number of noise points that are added at random positions, for networks of grids. The logarithm of their number is
    /// uniformly distributed. They have the power of a random point of the example and no true class.
    #[schemars(range(max = 10_000))]
    pub noise: u32,
}

impl Default for Augment {
    fn default() -> Augment {
        Augment { mirror: false, turn_deg: 0.0, shift_m: 0.0, near_m: 0.0, drop: 0.0, noise: 0 }
    }
}

impl Augment {
    /// Whether places move, so that amplitudes, ranges and azimuths no longer fit them.
    pub fn moves(&self) -> bool {
        self.turn_deg > 0.0 || self.shift_m > 0.0
    }

    /// Why the numbers cannot be used with a network: key, value and the range. `fixed` is the range for a network that uses
    /// quantities which depend on the positions of points and would not move with them.
    pub fn wrong(&self, fixed: Option<&'static str>) -> Option<(&'static str, String, &'static str)> {
        // The power of a point depends on its position.
        fixed.filter(|_| self.moves()).map(|allowed| {
            let key = if self.turn_deg > 0.0 { "turn_deg" } else { "shift_m" };
            let value = if self.turn_deg > 0.0 { self.turn_deg } else { self.shift_m };
            (key, value.to_string(), allowed)
        })
    }

    /// Draws how one picture is moved. Where nothing is asked for, nothing is drawn.
    pub fn draw(&self, draws: &mut Draws) -> Move {
        let either = |draws: &mut Draws, most: f64| {
            if most > 0.0 { most * (2.0 * draws.uniform() - 1.0) } else { 0.0 }
        };
        let mirror = self.mirror && draws.uniform() < 0.5;
        let turn_rad = either(draws, self.turn_deg.to_radians());
        let shift_m = DVec2::new(either(draws, self.shift_m), either(draws, self.shift_m));
        let keep = if self.drop > 0.0 { 1.0 - self.drop * draws.uniform() } else { 1.0 };
        let noise = match self.noise {
            0 => 0,
            most => (f64::from(most) + 1.0).powf(draws.uniform()) as u32 - 1,
        };
        let seed = if keep < 1.0 || noise > 0 { (draws.uniform() * f64::from(u32::MAX)) as u32 } else { 0 };
        Move {
            mirror,
            turn_rad,
            shift_m,
            near_m: if self.moves() { self.near_m } else { 0.0 },
            keep,
            noise,
            seed,
        }
    }
}

/// How one picture is moved: mirrored, then turned around the radar, then shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    mirror: bool,
    turn_rad: f64,
    shift_m: DVec2,
    near_m: f64,
    keep: f64,
    noise: u32,
    seed: u32,
}

impl Move {
    /// Nothing is moved.
    pub const NONE: Move = Move {
        mirror: false,
        turn_rad: 0.0,
        shift_m: DVec2::ZERO,
        near_m: 0.0,
        keep: 1.0,
        noise: 0,
        seed: 0,
    };

    /// Whether left and right change places.
    pub fn mirrors(&self) -> bool {
        self.mirror
    }

    /// Whether places stay where they were, but for the mirror.
    pub fn stays(&self) -> bool {
        self.turn_rad == 0.0 && self.shift_m == DVec2::ZERO
    }

    /// The points of a moved scan. Points that leave the grid are gone; points that come to lie in one cell are one cell.
    pub fn scan(&self, scan: &Scan) -> Scan {
        if *self == Move::NONE {
            return scan.clone();
        }
        let g = scan.grid;
        let turn = DMat2::from_angle(self.turn_rad);
        let mut draws = Draws::new(self.seed, 0);
        let mut cells: Vec<ScanCell> = Vec::with_capacity(scan.cells.len());
        for c in &scan.cells {
            if self.keep < 1.0 && draws.uniform() >= self.keep {
                continue;
            }
            let (row, column) = (c.cell as usize / g.columns, c.cell as usize % g.columns);
            let column = if self.mirror { g.columns - 1 - column } else { column };
            let azimuth_rad = if self.mirror { -c.azimuth_rad } else { c.azimuth_rad };
            if self.stays() {
                cells.push(ScanCell { cell: (row * g.columns + column) as u32, azimuth_rad, ..*c });
                continue;
            }
            let at = DVec2::from_array(g.middle_m(row, column));
            let to = turn * at + self.shift_m;
            if let Some(cell) = g.cell(to.x, to.y).filter(|_| at.length() >= self.near_m) {
                let range_m = to.length() as f32;
                cells.push(ScanCell {
                    cell: cell as u32,
                    range_m,
                    azimuth_rad: to.y.atan2(to.x) as f32,
                    ..*c
                });
            }
        }
        for _ in 0..self.noise {
            let pick = |u: f64, n: usize| ((u * n as f64) as usize).min(n.saturating_sub(1));
            let cell = pick(draws.uniform(), g.cells());
            let amplitude =
                scan.cells.get(pick(draws.uniform(), scan.cells.len())).map_or(1.0, |c| c.amplitude);
            let at = DVec2::from_array(g.middle_m(cell / g.columns, cell % g.columns));
            let (range_m, azimuth_rad) = (at.length() as f32, at.y.atan2(at.x) as f32);
            cells.push(ScanCell { cell: cell as u32, count: 1.0, amplitude, range_m, azimuth_rad });
        }
        // In the order of cells, as a scan has them.
        cells.sort_by_key(|c| c.cell);
        cells.dedup_by(|later, first| {
            let same = later.cell == first.cell;
            if same {
                first.count += later.count;
                first.amplitude = first.amplitude.max(later.amplitude);
            }
            same
        });
        Scan { grid: g, cells }
    }

    /// The points of a list that stay, by their numbers, and where they come to lie; places are in level axes, m.
    pub fn places(&self, at_m: impl IntoIterator<Item = DVec2>) -> Vec<(usize, DVec2)> {
        let turn = DMat2::from_angle(self.turn_rad);
        let mut draws = Draws::new(self.seed, 0);
        let mut kept = Vec::new();
        for (k, at) in at_m.into_iter().enumerate() {
            let dropped = self.keep < 1.0 && draws.uniform() >= self.keep;
            if dropped || at.length() < self.near_m {
                continue;
            }
            let at = if self.mirror { DVec2::new(at.x, -at.y) } else { at };
            kept.push((k, turn * at + self.shift_m));
        }
        kept
    }

    /// The classes of a moved mask: each cell has the class of the cell from which its middle came, and none where that lies outside.
    pub fn mask(&self, grid: &Grid, mask: &[u8]) -> Vec<u8> {
        if self.stays() && !self.mirror {
            return mask.to_vec();
        }
        let back = DMat2::from_angle(-self.turn_rad);
        let mut moved = vec![CellClass::Undefined as u8; mask.len()];
        for (at, class) in moved.iter_mut().enumerate() {
            let (row, column) = (at / grid.columns, at % grid.columns);
            let from = match self.stays() {
                true => Some(at),
                false => {
                    let p = back * (DVec2::from_array(grid.middle_m(row, column)) - self.shift_m);
                    grid.cell(p.x, p.y)
                }
            };
            let Some(from) = from else { continue };
            let (row, column) = (from / grid.columns, from % grid.columns);
            let column = if self.mirror { grid.columns - 1 - column } else { column };
            *class = mask[row * grid.columns + column];
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Input;
    use catseye::scene::toml_file::Document;

    /// 10 x 10 cells of 1 m.
    const SMALL: Grid = Grid { rows: 10, columns: 10, ahead_m: 10.0, across_m: 10.0 };

    fn scan(cells: &[(usize, usize)]) -> Scan {
        let cell = |(row, column): &(usize, usize)| ScanCell {
            cell: (row * 10 + column) as u32,
            count: 1.0,
            amplitude: 0.5,
            range_m: 4.0,
            azimuth_rad: 0.25,
        };
        Scan { grid: SMALL, cells: cells.iter().map(cell).collect() }
    }

    fn mask_of(cells: &[(usize, usize)]) -> Vec<u8> {
        let mut mask = vec![0u8; 100];
        cells.iter().for_each(|(r, c)| mask[r * 10 + c] = 1);
        mask
    }

    fn at(scan: &Scan) -> Vec<(usize, usize)> {
        scan.cells.iter().map(|c| (c.cell as usize / 10, c.cell as usize % 10)).collect()
    }

    #[test]
    fn a_mirror_changes_sides_and_twice_nothing() {
        let mirror = Move { mirror: true, ..Move::NONE };
        let s = scan(&[(2, 1), (5, 7)]);
        let m = mirror.scan(&s);
        assert_eq!(at(&m), [(2, 8), (5, 2)]);
        assert_eq!((m.cells[0].azimuth_rad, m.cells[0].range_m, m.cells[0].amplitude), (-0.25, 4.0, 0.5));
        assert_eq!(mirror.scan(&m), s);
        let mask = mask_of(&[(2, 1), (5, 7), (5, 8)]);
        assert_eq!(mirror.mask(&SMALL, &mask), mask_of(&[(2, 8), (5, 2), (5, 1)]));
    }

    /// A quarter turn to the left carries what lies ahead to the left; a shift carries it along. Truth goes with the points.
    #[test]
    fn turns_and_shifts_by_hand() {
        // Row 4 ahead of the radar, column 5: (4.5, -0.5) m. Turned: (0.5, 4.5), row 0, column 0.
        let turn = Move { turn_rad: std::f64::consts::FRAC_PI_2, ..Move::NONE };
        let m = turn.scan(&scan(&[(4, 5)]));
        assert_eq!(at(&m), [(0, 0)]);
        assert!((m.cells[0].azimuth_rad - 4.5f32.atan2(0.5)).abs() < 1e-6);
        assert_eq!(turn.mask(&SMALL, &mask_of(&[(4, 5)])), mask_of(&[(0, 0)]));
        let shift = Move { shift_m: DVec2::new(3.0, -2.0), ..Move::NONE };
        assert_eq!(at(&shift.scan(&scan(&[(4, 5), (8, 5)]))), [(7, 7)], "the other left the grid");
        assert_eq!(shift.mask(&SMALL, &mask_of(&[(4, 5), (8, 5)])), mask_of(&[(7, 7)]));
        // Points that are too near do not move along.
        let near = Move { near_m: 3.0, ..shift };
        assert_eq!(at(&near.scan(&scan(&[(1, 5), (4, 5)]))), [(7, 7)]);
    }

    #[test]
    fn draws_stay_in_their_ranges_and_change() {
        let a = Augment { mirror: true, turn_deg: 10.0, shift_m: 2.0, near_m: 1.0, drop: 0.5, noise: 0 };
        let mut draws = Draws::new(3, 9);
        let all: Vec<Move> = (0..400).map(|_| a.draw(&mut draws)).collect();
        let mirrored = all.iter().filter(|m| m.mirror).count();
        assert!((150..250).contains(&mirrored), "{mirrored}");
        assert!(
            all.iter()
                .all(|m| m.turn_rad.abs() <= 10f64.to_radians() && m.shift_m.abs().max_element() <= 2.0)
        );
        assert!(all.iter().any(|m| m.turn_rad < -0.1) && all.iter().any(|m| m.turn_rad > 0.1));
        assert!(all.iter().all(|m| (0.5..=1.0).contains(&m.keep)));
        let full = scan(&(0..100).map(|k| (k / 10, k % 10)).collect::<Vec<_>>());
        let half = Move { keep: 0.5, seed: 4, ..Move::NONE }.scan(&full);
        assert!((30..70).contains(&half.cells.len()), "{}", half.cells.len());
        // What is not asked for draws nothing.
        let (mut one, mut other) = (Draws::new(1, 1), Draws::new(1, 1));
        assert_eq!(Augment::default().draw(&mut one), Move::NONE);
        assert_eq!(one.uniform(), other.uniform());
    }

    #[test]
    fn noise_is_anywhere_and_few_points_are_as_likely_as_many() {
        let a = Augment { noise: 999, ..Augment::default() };
        let mut draws = Draws::new(5, 2);
        let moves: Vec<Move> = (0..600).map(|_| a.draw(&mut draws)).collect();
        // A third each of 0 to 9, 10 to 99 and 100 to 999, within four standard deviations.
        for (from, to) in [(0, 9), (9, 99), (99, 999)] {
            let n = moves.iter().filter(|m| (from..to).contains(&m.noise)).count();
            assert!((150..250).contains(&n), "{from}: {n}");
        }
        let noisy = Move { noise: 400, seed: 8, ..Move::NONE };
        let s = noisy.scan(&scan(&[(2, 1)]));
        assert!(s.cells.len() > 90 && s.cells.iter().all(|c| c.amplitude == 0.5), "{}", s.cells.len());
        assert_eq!(s.cells.iter().map(|c| c.count).sum::<f32>(), 401.0);
        let corner = s.cells.iter().find(|c| c.cell == 99).unwrap();
        assert!((corner.range_m - 9.5f32.hypot(4.5)).abs() < 1e-6 && corner.azimuth_rad < 0.0);
        // Truth stays.
        let mask = mask_of(&[(2, 1)]);
        assert_eq!(noisy.mask(&SMALL, &mask), mask);
    }

    #[test]
    fn wrong_numbers_are_named() {
        let wrong = |a: Augment, input: Input| a.wrong(input.fixed()).map(|w| w.0);
        let turn = Augment { turn_deg: 5.0, ..Augment::default() };
        assert_eq!(wrong(turn, Input::B), None);
        assert_eq!(wrong(turn, Input::A), Some("turn_deg"));
        for (key, a) in [
            ("turn_deg", Augment { turn_deg: 200.0, ..turn }),
            ("drop", Augment { drop: 1.0, ..turn }),
            ("noise", Augment { noise: 10_001, ..turn }),
            ("shift_m", Augment { shift_m: f64::NAN, ..turn }),
        ] {
            let e = Document::check_bounds("training.augment", &a).unwrap_err().to_string();
            assert!(e.starts_with(&format!("training.augment.{key} = ")), "{e}");
        }
        assert_eq!(wrong(Augment { mirror: true, ..Augment::default() }, Input::C4), None);
    }

    /// A mirrored point at (4, 3) lies at (4, -3), a quarter turn to the left puts it to (3, 4), and a shift carries it on.
    #[test]
    fn points_of_a_list_move() {
        let moved = Move {
            mirror: true,
            turn_rad: std::f64::consts::FRAC_PI_2,
            shift_m: DVec2::new(1.0, -2.0),
            near_m: 2.0,
            ..Move::NONE
        };
        let kept = moved.places([DVec2::new(1.0, 0.5), DVec2::new(4.0, 3.0)]);
        assert_eq!((kept.len(), kept[0].0), (1, 1));
        assert!((kept[0].1 - DVec2::new(4.0, 2.0)).length() < 1e-12, "{kept:?}");
        let places: Vec<DVec2> = (0..400).map(|k| DVec2::new(k as f64, 1.0)).collect();
        let half = Move { keep: 0.5, seed: 3, ..Move::NONE }.places(places.iter().copied());
        assert!((150..250).contains(&half.len()) && half.iter().all(|(k, at)| *at == places[*k]));
    }
}
