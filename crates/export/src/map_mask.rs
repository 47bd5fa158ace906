//! A picture of where the drivable lanes of a run lie, as nuScenes' `MapMask` reads it.

use super::LaneArea;
use catseye::base::error::{BadInput, Error, Result};
use glam::{DVec2, DVec3, IVec2};
use image::GrayImage;
use std::collections::HashMap;

/// Distance of neighbouring places of the finest picture, m: the least that nuScenes' reader takes.
pub const STEP_M: f64 = 0.1;
/// Places along the side of a tile.
const SIDE: i64 = 64;
/// Tiles that are kept: 10.7 square kilometres of lanes.
const MOST_TILES: usize = 1 << 18;
/// Largest picture, pixels.
const MOST_PIXELS: i64 = 1 << 26;
/// Edges lie within this distance of the world's origin, m.
const FARTHEST_M: f64 = 1e6;

/// The places of a lattice over the world, [`STEP_M`] apart and the origin one of them, that lie in a lane. Only tiles with lanes
/// in them need memory.
#[derive(Debug, Default)]
pub struct Lattice {
    tiles: HashMap<(i64, i64), [u64; SIDE as usize]>,
}

/// A picture of the lattice.
pub struct Mask {
    /// 255 in a lane, 0 elsewhere. The place (x, y) is the pixel of column x/step and row height − y/step, rounded.
    pub picture: GrayImage,
    /// Distance of neighbouring pixels, m.
    pub step_m: f64,
}

impl Lattice {
    /// Adds the places of a piece of a lane, seen from above.
    ///
    /// # Errors
    /// Returns `BadInput` for edges that are not numbers or lie 1,000 km away, and for lanes of more than 10.7 km².
    pub fn add(&mut self, area: &LaneArea) -> Result<()> {
        let plan = |edge: &[DVec3]| -> Result<Vec<DVec2>> {
            edge.iter().map(|p| within(*p).map(|p| p.truncate() / STEP_M)).collect()
        };
        let (left, right) = (plan(&area.left_m)?, plan(&area.right_m)?);
        for (l, r) in left.windows(2).zip(right.windows(2)) {
            self.fill([l[0], r[0], r[1]])?;
            self.fill([l[0], r[1], l[1]])?;
        }
        Ok(())
    }

    /// Marks the places in a triangle, whose corners are in steps.
    fn fill(&mut self, t: [DVec2; 3]) -> Result<()> {
        let low = t[0].y.min(t[1].y).min(t[2].y);
        let high = t[0].y.max(t[1].y).max(t[2].y);
        for row in low.ceil() as i64..=high.floor() as i64 {
            let y = row as f64;
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let (below, above) = if a.y <= b.y { (a, b) } else { (b, a) };
                if y < below.y || y > above.y {
                    continue;
                }
                let flat = above.y == below.y;
                for share in if flat { [0.0, 1.0] } else { [(y - below.y) / (above.y - below.y); 2] } {
                    let x = below.x + share * (above.x - below.x);
                    (from, to) = (from.min(x), to.max(x));
                }
            }
            if from <= to {
                self.mark(row, from.ceil() as i64, to.floor() as i64)?;
            }
        }
        Ok(())
    }

    fn mark(&mut self, row: i64, from: i64, to: i64) -> Result<()> {
        let mut at = from;
        while at <= to {
            let tile = at.div_euclid(SIDE);
            let end = to.min(tile * SIDE + SIDE - 1);
            let ones = u64::MAX >> (SIDE - 1 - (end - at));
            let key = (tile, row.div_euclid(SIDE));
            if self.tiles.len() >= MOST_TILES && !self.tiles.contains_key(&key) {
                return Err(BadInput::new("the lanes cover a larger area than the image of a map can show")
                    .key("lanes")
                    .allowed("up to 10.7 square kilometres")
                    .remedy("export a shorter run")
                    .into());
            }
            let rows = self.tiles.entry(key).or_insert([0; SIDE as usize]);
            rows[row.rem_euclid(SIDE) as usize] |= ones << at.rem_euclid(SIDE);
            at = end + 1;
        }
        Ok(())
    }

    /// The lowest and the highest place in a lane, m; None where there is no lane.
    pub fn extent_m(&self) -> Option<(DVec2, DVec2)> {
        let mut places = self.places();
        let first = places.next()?;
        let (low, high) = places.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        Some((low.as_dvec2() * STEP_M, high.as_dvec2() * STEP_M))
    }

    fn places(&self) -> impl Iterator<Item = IVec2> + '_ {
        self.tiles.iter().flat_map(|((tile_x, tile_y), rows)| {
            (0..SIDE * SIDE).filter(|i| rows[(i / SIDE) as usize] >> (i % SIDE) & 1 == 1).map(move |i| {
                IVec2::new((tile_x * SIDE + i % SIDE) as i32, (tile_y * SIDE + i / SIDE) as i32)
            })
        })
    }

    /// The picture of the places from the origin to (`width_m`, `height_m`), after all of the world is moved by `move_m`, whole
    /// metres. Where it would have more than 2²⁶ pixels, their distance is doubled until it has not.
    pub fn mask(&self, move_m: IVec2, width_m: u32, height_m: u32) -> Mask {
        let per_metre = (1.0 / STEP_M).round() as i64;
        let mut coarse = 1;
        let size = |coarse: i64| [width_m, height_m].map(|m| i64::from(m) * per_metre / coarse + 1);
        while size(coarse).iter().product::<i64>() > MOST_PIXELS {
            coarse *= 2;
        }
        let [columns, rows] = size(coarse);
        let mut picture = GrayImage::new(columns as u32, rows as u32);
        for p in self.places() {
            let x = i64::from(p.x) + i64::from(move_m.x) * per_metre;
            let y = i64::from(p.y) + i64::from(move_m.y) * per_metre;
            let (column, row) = (x / coarse, rows - y / coarse);
            let shown = x % coarse == 0 && y % coarse == 0;
            if shown && (0..columns).contains(&column) && (0..rows).contains(&row) {
                picture.put_pixel(column as u32, row as u32, image::Luma([255]));
            }
        }
        Mask { picture, step_m: STEP_M * coarse as f64 }
    }
}

/// A place of the world that a map can show.
pub fn within(p: DVec3) -> Result<DVec3> {
    match p.is_finite() && p.abs().max_element() <= FARTHEST_M {
        true => Ok(p),
        false => Err(Error::from(
            BadInput::new("is too far away for a map")
                .key("place in the world")
                .value(p)
                .allowed("-1000000 to 1000000 m"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane(left: &[[f64; 2]], right: &[[f64; 2]]) -> LaneArea {
        let line = |l: &[[f64; 2]]| l.iter().map(|p| DVec3::new(p[0], p[1], 3.0)).collect();
        LaneArea { left_m: line(left), right_m: line(right) }
    }

    /// Every place of a lane along an axis, and none beside it, whatever tile it is in.
    #[test]
    fn places_of_a_straight_lane() {
        let mut lattice = Lattice::default();
        lattice.add(&lane(&[[-3.05, 1.75], [20.05, 1.75]], &[[-3.05, -1.75], [20.05, -1.75]])).unwrap();
        // x from -3.0 to 20.0, y from -1.7 to 1.7.
        assert_eq!(lattice.places().count(), 231 * 35);
        let (low, high) = lattice.extent_m().unwrap();
        assert!(
            (low - DVec2::new(-3.0, -1.7)).length() < 1e-9 && (high - DVec2::new(20.0, 1.7)).length() < 1e-9
        );
        let mask = lattice.mask(IVec2::new(4, 2), 30, 5);
        assert_eq!(mask.picture.dimensions(), (301, 51));
        let shown = |x: f64, y: f64| {
            let column = ((x + 4.0) / 0.1).round() as u32;
            let row = (51.0 - (y + 2.0) / 0.1).round() as u32;
            mask.picture.get_pixel(column, row).0[0] == 255
        };
        for (x, y, inside) in
            [(-3.0, 0.0, true), (-3.1, 0.0, false), (20.0, 1.7, true), (20.1, 1.7, false), (5.0, -1.8, false)]
        {
            assert_eq!(shown(x, y), inside, "{x} {y}");
        }
        assert_eq!(mask.picture.pixels().filter(|p| p.0[0] == 255).count(), 231 * 35);
    }

    /// The area of a lane that is turned is that of its places, to the width of one along its edge.
    #[test]
    fn area_of_a_turned_lane() {
        let along = DVec2::from_angle(0.6);
        let across = along.perp();
        let at = |s: f64, t: f64| (along * s + across * t).to_array();
        let mut lattice = Lattice::default();
        lattice.add(&lane(&[at(0.0, 2.0), at(50.0, 2.0)], &[at(0.0, -2.0), at(50.0, -2.0)])).unwrap();
        let area = lattice.places().count() as f64 * STEP_M * STEP_M;
        assert!((area - 200.0).abs() < 108.0 * 0.5 * STEP_M, "{area}");
    }

    #[test]
    fn large_maps_get_coarse_and_larger_ones_are_refused() {
        let mut lattice = Lattice::default();
        lattice.add(&lane(&[[0.0, 3.0], [2000.0, 3.0]], &[[0.0, 0.0], [2000.0, 0.0]])).unwrap();
        let mask = lattice.mask(IVec2::new(0, 1), 2000, 2000);
        assert_eq!((mask.step_m, mask.picture.width()), (0.4, 5001));
        let huge = lane(&[[0.0, 9e5], [9e5, 9e5]], &[[0.0, -9e5], [9e5, -9e5]]);
        assert_eq!(lattice.add(&huge).unwrap_err().exit_code(), 2);
        let nowhere = lane(&[[0.0, f64::NAN], [9.0, 0.0]], &[[0.0, -1.0], [9.0, -1.0]]);
        assert_eq!(lattice.add(&nowhere).unwrap_err().exit_code(), 2);
    }
}
