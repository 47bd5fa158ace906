//! What lies in each cell of a grid before the radar, seen from above, as a picture of class numbers (CONVENTIONS
//! eq. 163).

use crate::base::frames::{Pose, Sensor, World};
use crate::road::actors::{base_class, is_vehicle};
use crate::road::near::LaneTruth;
use crate::scene::{Scene, Shape};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Square-edged cells in the radar's level axes. Row `i` spans x from `i·ahead_m/rows` to the next: row 0 lies at the
/// radar, the last one farthest ahead. Column 0 lies farthest to the **left**, y = +½·across_m; columns go to the right.
/// Arrays are `[row, column]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Number of rows, ahead.
    pub rows: usize,
    /// Number of columns, across.
    pub columns: usize,
    /// Extent of the grid from the radar forwards, m.
    pub ahead_m: f64,
    /// Extent from side to side, m, with the radar in the middle.
    pub across_m: f64,
}

impl Grid {
    /// 300 x 450 cells over 40 x 60 m: the road between guard rails.
    pub const ROAD: Grid = Grid { rows: 450, columns: 300, ahead_m: 60.0, across_m: 40.0 };
    /// 227 x 227 cells over 40 x 40 m: markers.
    pub const MARKERS: Grid = Grid { rows: 227, columns: 227, ahead_m: 40.0, across_m: 40.0 };

    /// (row, column) with fractions of a place; a cell's middle is at halves.
    fn place(&self, at_m: DVec2) -> DVec2 {
        DVec2::new(
            at_m.x / self.ahead_m * self.rows as f64,
            (0.5 - at_m.y / self.across_m) * self.columns as f64,
        )
    }

    /// Index into the array of the cell that holds (x forward, y left); None outside.
    pub fn cell(&self, x_m: f64, y_m: f64) -> Option<usize> {
        let p = self.place(DVec2::new(x_m, y_m));
        let inside = (0.0..self.rows as f64).contains(&p.x) && (0.0..self.columns as f64).contains(&p.y);
        inside.then(|| p.x as usize * self.columns + p.y as usize)
    }

    /// Middle of a cell, (x forward, y left), m.
    pub fn middle_m(&self, row: usize, column: usize) -> [f64; 2] {
        [
            (row as f64 + 0.5) / self.rows as f64 * self.ahead_m,
            (0.5 - (column as f64 + 0.5) / self.columns as f64) * self.across_m,
        ]
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.rows * self.columns
    }
}

/// The radar's level axes: origin under it, x along its boresight in plan, y left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    origin_m: DVec3,
    heading: DVec2,
}

impl Level {
    /// The level frame of a radar.
    pub fn of(radar: &Pose<Sensor, World>) -> Level {
        let ahead = radar.direction(DVec3::X).truncate();
        Level { origin_m: radar.translation_m, heading: ahead.normalize_or(DVec2::X) }
    }

    /// Place of the world in the radar's level frame, (x forward, y left), m.
    pub fn from_world(&self, p: DVec3) -> DVec2 {
        let d = (p - self.origin_m).truncate();
        DVec2::new(self.heading.dot(d), self.heading.perp_dot(d))
    }
}

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum CellClass {
    /// Nothing that is known.
    Undefined = 0,
    /// A drivable lane.
    Lane = 1,
    /// A vehicle.
    Vehicle = 2,
    /// Guard rails with their posts, and walls.
    GuardRail = 3,
    /// A marker.
    Marker = 4,
    /// A person on foot.
    Pedestrian = 5,
    /// A bicycle, with its rider or without.
    Cyclist = 6,
}

impl CellClass {
    /// All classes in the order of their numbers.
    pub const ALL: [CellClass; 7] = [
        CellClass::Undefined,
        CellClass::Lane,
        CellClass::Vehicle,
        CellClass::GuardRail,
        CellClass::Marker,
        CellClass::Pedestrian,
        CellClass::Cyclist,
    ];

    /// The class by its name in files.
    pub fn name(self) -> &'static str {
        match self {
            CellClass::Undefined => "undefined",
            CellClass::Lane => "lane",
            CellClass::Vehicle => "vehicle",
            CellClass::GuardRail => "guard rail",
            CellClass::Marker => "marker",
            CellClass::Pedestrian => "pedestrian",
            CellClass::Cyclist => "cyclist",
        }
    }

    /// The class of the cells of an object of this class, such as `car` or `car.wheel`; None for what masks do not show.
    pub fn of(class: &str) -> Option<CellClass> {
        match base_class(class) {
            "guard_rail" | "post" | "wall" => Some(CellClass::GuardRail),
            "marker" => Some(CellClass::Marker),
            "pedestrian" | "person" => Some(CellClass::Pedestrian),
            "cyclist" | "bicycle" => Some(CellClass::Cyclist),
            class if is_vehicle(class) => Some(CellClass::Vehicle),
            _ => None,
        }
    }
}

/// Numbers of [`CellClass`], `[row, column]`. `lanes` as [`super::near::lanes_near`] cuts them; of the scene's objects those of
/// the classes in `shown`. What is listed later covers what is listed earlier; lanes lie lowest.
///
/// A cell is of a lane or a vehicle when its middle lies in the lane or under the vehicle; of a rail, a marker, a
/// person or a bicycle, which are narrower than some cells, when any of it lies in the cell. Heights play no part.
pub fn mask(
    grid: &Grid,
    scene: &Scene,
    time_s: f64,
    radar: &Pose<Sensor, World>,
    lanes: &[LaneTruth],
    shown: &[CellClass],
) -> Vec<u8> {
    let level = Level::of(radar);
    let place = |p: DVec3| grid.place(level.from_world(p));
    let mut cells = vec![CellClass::Undefined as u8; grid.cells()];
    for lane in lanes.iter().filter(|l| l.kind.is_drivable()) {
        let side =
            |line: &[[f64; 3]]| -> Vec<DVec2> { line.iter().map(|p| place(DVec3::from_array(*p))).collect() };
        let (left, right) = (side(&lane.left_m), side(&lane.right_m));
        for (l, r) in left.windows(2).zip(right.windows(2)) {
            for t in [[l[0], r[0], r[1]], [l[0], r[1], l[1]]] {
                fill(grid, &mut cells, t, true, CellClass::Lane as u8);
            }
        }
    }
    let far = grid.ahead_m.hypot(grid.across_m);
    for class in shown {
        let middles = *class == CellClass::Vehicle;
        for o in scene.objects.iter().filter(|o| CellClass::of(&o.class) == Some(*class)) {
            let pose = o.at(time_s).pose();
            let Shape::Mesh(m) = o.shape else {
                let p = place(pose.translation_m);
                fill(grid, &mut cells, [p; 3], false, *class as u8);
                continue;
            };
            let mesh = &scene.meshes[m];
            let reach = mesh.positions_m.iter().map(|p| p.length()).fold(0.0, f64::max);
            if level.from_world(pose.translation_m).length() > far + reach {
                continue;
            }
            let seen: Vec<DVec2> = mesh.positions_m.iter().map(|p| place(pose.point(*p))).collect();
            for t in &mesh.triangles {
                fill(grid, &mut cells, t.map(|i| seen[i as usize]), middles, *class as u8);
            }
        }
    }
    cells
}

/// The classes of `mask_road.npy`.
pub const ROAD_CLASSES: [CellClass; 4] =
    [CellClass::GuardRail, CellClass::Vehicle, CellClass::Cyclist, CellClass::Pedestrian];
/// The classes of `mask_markers.npy`.
pub const MARKER_CLASSES: [CellClass; 4] =
    [CellClass::Marker, CellClass::Vehicle, CellClass::Cyclist, CellClass::Pedestrian];

/// Whole cells between two places, cut to the grid.
fn span(lo: f64, hi: f64, count: usize) -> Range<usize> {
    let end = count as f64;
    lo.floor().clamp(0.0, end) as usize..(hi.floor() + 1.0).clamp(0.0, end) as usize
}

/// Marks the cells whose middle lies in a triangle (rows, columns), or those that it touches.
fn fill(grid: &Grid, cells: &mut [u8], t: [DVec2; 3], middles: bool, value: u8) {
    let lo = t[0].min(t[1]).min(t[2]);
    let hi = t[0].max(t[1]).max(t[2]);
    // Directions across which the triangle and a cell may be apart: its sides' normals.
    let normals = [0, 1, 2].map(|i| (t[(i + 1) % 3] - t[i]).perp());
    let extent = normals.map(|n| {
        let p = t.map(|v| n.dot(v));
        (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]))
    });
    for row in span(lo.x, hi.x, grid.rows) {
        for column in span(lo.y, hi.y, grid.columns) {
            let middle = DVec2::new(row as f64 + 0.5, column as f64 + 0.5);
            let met = normals.iter().zip(&extent).all(|(n, (from, to))| {
                let half = if middles { 0.0 } else { 0.5 * (n.x.abs() + n.y.abs()) };
                let at = n.dot(middle);
                at + half >= *from && at - half <= *to
            });
            // A side on edge has no inside.
            if met && (!middles || extent.iter().all(|(from, to)| to > from)) {
                cells[row * grid.columns + column] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::layout::{Driven, LaneKind};
    use crate::road::shape::cuboid;

    const GRID: Grid = Grid { rows: 60, columns: 40, ahead_m: 60.0, across_m: 40.0 };

    fn lane(left: f64, right: f64) -> LaneTruth {
        let line = |y: f64| vec![[-50.0, y, 0.0], [500.0, y, 0.0]];
        LaneTruth {
            road: "r".into(),
            number: 1,
            kind: LaneKind::Driving,
            driven: Driven::Forward,
            left_m: line(left),
            centre_m: line(0.5 * (left + right)),
            right_m: line(right),
        }
    }

    /// A car ahead on the left, one on the right nearer, a rail far right, a marker.
    fn scene() -> Scene {
        let mut s = Scene::default();
        let at = |x, y| Pose::new(glam::DQuat::IDENTITY, DVec3::new(x, y, 0.0));
        let block = |x, y, z| cuboid(DVec3::new(x, y, z), DVec3::Z, 0);
        s.add_mesh("car", "car", block(4.0, 2.0, 1.5), at(30.2, 6.0));
        s.add_mesh("van", "van", block(6.0, 2.0, 2.0), at(12.3, -3.0));
        s.add_mesh("rail", "guard_rail", block(200.0, 0.08, 0.3), at(50.0, -9.9));
        s.add_mesh("marker", "marker", block(0.1, 0.1, 0.1), at(20.3, 0.2));
        s.add_mesh("walker", "pedestrian", block(0.3, 0.5, 1.7), at(15.4, 8.4));
        s.add_mesh("walker left arm", "pedestrian.limb", block(0.1, 0.1, 0.5), at(15.4, 9.2));
        s.add_mesh("rider", "cyclist", block(1.7, 0.5, 1.7), at(18.5, -6.5));
        s
    }

    #[test]
    fn left_is_left_and_ahead_is_up() {
        let s = scene();
        let m = mask(&GRID, &s, 0.0, &Pose::IDENTITY, &[lane(3.5, -3.5)], &CellClass::ALL[2..]);
        let at = |x: f64, y: f64| m[GRID.cell(x, y).unwrap()];
        assert_eq!(at(30.5, 6.2), CellClass::Vehicle as u8);
        assert_eq!(at(30.5, -6.2), CellClass::Undefined as u8);
        assert_eq!(at(12.5, -2.9), CellClass::Vehicle as u8);
        assert_eq!(at(12.5, 2.9), CellClass::Lane as u8);
        assert_eq!(at(40.0, -9.9), CellClass::GuardRail as u8);
        assert_eq!(at(20.9, 0.9), CellClass::Marker as u8);
        assert_eq!(
            (at(15.5, 8.5), at(15.5, 9.5)),
            (CellClass::Pedestrian as u8, CellClass::Pedestrian as u8)
        );
        assert_eq!((at(18.5, -6.5), at(16.5, -6.5)), (CellClass::Cyclist as u8, CellClass::Undefined as u8));
        // By rows and columns: middles from 28.5 to 31.5 m ahead, 5.5 and 6.5 m to the left.
        let vehicle = (0..GRID.cells()).filter(|i| m[*i] == CellClass::Vehicle as u8);
        let car: Vec<(usize, usize)> =
            vehicle.map(|i| (i / GRID.columns, i % GRID.columns)).filter(|c| c.1 < 20).collect();
        assert_eq!(car, (28..=31).flat_map(|r| [(r, 13), (r, 14)]).collect::<Vec<_>>());
        for i in 0..GRID.cells() {
            let [x, y] = GRID.middle_m(i / GRID.columns, i % GRID.columns);
            assert_eq!(GRID.cell(x, y), Some(i));
        }
        assert_eq!((GRID.cell(-0.1, 0.0), GRID.cell(0.0, 20.1), GRID.cell(60.0, 0.0)), (None, None, None));
    }

    #[test]
    fn the_mask_turns_with_the_radar() {
        // The whole world turned about the radar: the same mask.
        let straight = mask(&GRID, &scene(), 0.0, &Pose::IDENTITY, &[lane(3.3, -3.6)], &CellClass::ALL[2..]);
        let yaw = 2.2;
        let turn = Pose::<World, World>::from_yaw_pitch_roll(DVec3::new(100.0, -40.0, 3.0), yaw, 0.0, 0.0);
        let mut s = scene();
        for o in &mut s.objects {
            o.pose = o.pose.then(&turn);
        }
        let mut l = lane(3.3, -3.6);
        for line in [&mut l.left_m, &mut l.centre_m, &mut l.right_m] {
            line.iter_mut().for_each(|p| *p = turn.point(DVec3::from_array(*p)).to_array());
        }
        // A nick of pitch does not matter.
        let radar = Pose::from_yaw_pitch_roll(turn.translation_m, yaw, 0.02, 0.0);
        let turned = mask(&GRID, &s, 0.0, &radar, &[l], &CellClass::ALL[2..]);
        let differ = straight.iter().zip(&turned).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0);
        let mirrored: Vec<u8> = straight.chunks(GRID.columns).flat_map(|r| r.iter().rev().copied()).collect();
        let other = mirrored.iter().zip(&turned).filter(|(a, b)| a != b).count();
        assert!(other > 40, "{other}");
    }

    /// Every cell against the definition, for triangles at random.
    #[test]
    fn triangles_by_brute_force() {
        let mut state = 1u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let small = Grid { rows: 12, columns: 9, ahead_m: 12.0, across_m: 9.0 };
        for _ in 0..200 {
            let t = [0; 3].map(|_| DVec2::new(16.0 * draw() - 2.0, 13.0 * draw() - 2.0));
            let (mut by_middle, mut by_touch) = (vec![0; small.cells()], vec![0; small.cells()]);
            fill(&small, &mut by_middle, t, true, 1);
            fill(&small, &mut by_touch, t, false, 1);
            let sign = (t[1] - t[0]).perp_dot(t[2] - t[0]).signum();
            let inside = |p: DVec2| (0..3).all(|i| sign * (t[(i + 1) % 3] - t[i]).perp_dot(p - t[i]) > 0.0);
            for i in 0..small.cells() {
                let (r, c) = ((i / 9) as f64, (i % 9) as f64);
                assert_eq!(by_middle[i] == 1, inside(DVec2::new(r + 0.5, c + 0.5)));
                let sampled = (0..400).any(|k| {
                    inside(DVec2::new(
                        r + (f64::from(k / 20) + 0.5) / 20.0,
                        c + (f64::from(k % 20) + 0.5) / 20.0,
                    ))
                });
                assert!(by_touch[i] == 1 || !sampled, "missed {i}");
                // What is marked without a sample inside is a corner that is grazed.
                if by_touch[i] == 1 && !sampled {
                    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
                        .map(|(a, b)| DVec2::new(r + a, c + b));
                    let crosses = (0..3).any(|k| {
                        let (a, d) = (t[k], t[(k + 1) % 3] - t[k]);
                        let sides = corners.map(|q| d.perp_dot(q - a) > 0.0);
                        sides.iter().any(|s| *s) && sides.iter().any(|s| !*s)
                    });
                    assert!(crosses, "{i} is not touched");
                }
            }
        }
    }
}
