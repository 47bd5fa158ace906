//! Points of one scan as pictures for learning: what a network sees of each cell of a grid (CONVENTIONS eq. 164).

use super::points::Point;
use crate::base::frames::{Pose, Sensor, World};
use crate::road::mask::{Grid, Level};
use glam::DVec2;

/// Points in cells: one value for each cell and plane, `[row, column]` as [`Grid`] says. Cells without a point are 0 in
/// every plane.
#[derive(Debug, Clone, PartialEq)]
pub struct PointGrid {
    /// The cells.
    pub grid: Grid,
    /// Points in the cell.
    pub count: Vec<f32>,
    /// The largest √power in the cell over the largest in the grid, 0 to 1.
    pub amplitude: Vec<f32>,
    /// Mean range of its points, m.
    pub range_m: Vec<f32>,
    /// Mean azimuth of its points, rad, positive to the left.
    pub azimuth_rad: Vec<f32>,
}

/// A point in a radar's level axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedPoint {
    /// Place, x along the boresight in plan and y to the left of it, m.
    pub at_m: DVec2,
    /// Power over any reference that all points of the scan share, dB.
    pub power_db: f64,
    /// Range from the radar, m.
    pub range_m: f64,
    /// Azimuth from the boresight, rad, positive to the left.
    pub azimuth_rad: f64,
}

impl PointGrid {
    /// Puts the points of a scan, whose places are in the sensor's frame, into the cells of its level axes. Points whose direction
    /// is at an edge of the search are left out: nothing was measured there.
    pub fn new(grid: Grid, points: &[Point], radar: &Pose<Sensor, World>) -> PointGrid {
        let level = Level::of(radar);
        let placed = |p: &Point| PlacedPoint {
            at_m: level.from_world(radar.point(p.position_m)),
            power_db: p.power_dbm,
            range_m: p.range_m,
            azimuth_rad: p.azimuth_rad,
        };
        PointGrid::of_placed(grid, points.iter().filter(|p| !p.at_search_edge).map(placed))
    }

    /// Puts points that are in the radar's level axes already into the cells. Powers count by their differences alone, so
    /// any reference will do that all points share.
    pub fn of_placed(grid: Grid, points: impl IntoIterator<Item = PlacedPoint>) -> PointGrid {
        let zero = vec![0f64; grid.cells()];
        let (mut count, mut power_db) = (zero.clone(), vec![f64::NEG_INFINITY; grid.cells()]);
        let (mut range, mut azimuth) = (zero.clone(), zero);
        for p in points {
            if let Some(cell) = grid.cell(p.at_m.x, p.at_m.y) {
                count[cell] += 1.0;
                power_db[cell] = power_db[cell].max(p.power_db);
                range[cell] += p.range_m;
                azimuth[cell] += p.azimuth_rad;
            }
        }
        let strongest = power_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = |sums: &[f64]| sums.iter().zip(&count).map(|(s, n)| (s / n.max(1.0)) as f32).collect();
        PointGrid {
            grid,
            amplitude: power_db
                .iter()
                .map(|p| if p.is_finite() { 10f64.powf((p - strongest) / 20.0) as f32 } else { 0.0 })
                .collect(),
            range_m: mean(&range),
            azimuth_rad: mean(&azimuth),
            count: count.iter().map(|n| *n as f32).collect(),
        }
    }

    /// The grid as input "B": 1 where there is a point, `[1, row, column]`.
    pub fn binary(&self) -> Vec<f32> {
        self.count.iter().map(|n| f32::from(u8::from(*n > 0.0))).collect()
    }

    /// The grid as input "C4": count, amplitude, range, azimuth, `[4, row, column]`. Its second plane is input "A", its
    /// first two are input "C2".
    pub fn planes(&self) -> Vec<f32> {
        [&self.count, &self.amplitude, &self.range_m, &self.azimuth_rad]
            .into_iter()
            .flatten()
            .copied()
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frames::direction_from_angles;
    use crate::detect::{accuracy::PointStd, ambiguity::Ambiguity};
    use glam::DVec3;

    fn point(range_m: f64, azimuth_rad: f64, power_dbm: f64) -> Point {
        Point {
            range_m,
            range_rate_mps: 0.0,
            azimuth_rad,
            elevation_rad: 0.0,
            position_m: direction_from_angles(azimuth_rad, 0.0) * range_m,
            power_dbm,
            snr_db: 20.0,
            rcs_dbsm: 0.0,
            std: PointStd::default(),
            beat_std_cells: 0.0,
            ambiguity: Ambiguity::Unresolved,
            modulo_mps: f64::INFINITY,
            object_id: 0,
            class: String::new(),
            bounces: 0,
            ghost: false,
            side_lobe: false,
            folded: false,
            aliased: false,
            share: 0.0,
            angle_ambiguity: None,
            other_angles_rad: vec![],
            at_search_edge: false,
            others_std_rad: [0.0; 2],
            cell: None,
        }
    }

    #[test]
    fn planes_hold_what_the_points_say() {
        // Two points in one cell ahead on the left, a stronger one on the right, one behind.
        let points = [
            point(20.0, 0.30, -90.0),
            point(20.02, 0.301, -86.0),
            point(30.0, -0.2, -80.0),
            point(5.0, 3.0, -20.0),
            Point { at_search_edge: true, ..point(25.0, 0.1, -70.0) },
        ];
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(7.0, 8.0, 0.5), 1.0, 0.0, 0.0);
        let g = PointGrid::new(Grid::ROAD, &points, &pose);
        let cell = |p: &Point| Grid::ROAD.cell(p.position_m.x, p.position_m.y).unwrap();
        let (left, right) = (cell(&points[0]), cell(&points[2]));
        assert_eq!(left, cell(&points[1]));
        assert!(left % 300 < 150 && right % 300 > 150, "left of the middle column is left");
        assert_eq!((g.count[left], g.count[right], g.count.iter().sum::<f32>()), (2.0, 1.0, 3.0));
        let near = |a: f32, b: f64| assert!((f64::from(a) - b).abs() < 1e-6, "{a} {b}");
        near(g.amplitude[left], 10f64.powf(-6.0 / 20.0));
        near(g.amplitude[right], 1.0);
        near(g.range_m[left] / 10.0, 2.001);
        near(g.azimuth_rad[left], 0.3005);
        assert_eq!(g.binary().iter().sum::<f32>(), 2.0);
        let planes = g.planes();
        assert_eq!(planes.len(), 4 * 450 * 300);
        assert_eq!(planes[300 * 450 + left], g.amplitude[left]);
        let empty = PointGrid::new(Grid::MARKERS, &[], &pose);
        assert!(empty.planes().iter().all(|x| *x == 0.0));
    }
}
