//! Files that other tools read: nuScenes point clouds ([`pcd`]) and whole nuScenes tables ([`nuscenes`]), the layout of KITTI and
//! View-of-Delft ([`kitti`]), COCO annotations of grids ([`coco`]), RadarScenes sequences (`radarscenes`), MCAP recordings for
//! Foxglove and Lichtblick (`mcap`), ASAM OSI traces (`osi`) and TuSimple lane lines ([`tusimple`]).
//!
//! All of them are written from [`Sweep`]s, which know nothing of the chain that made them. Axes are those of ISO 8855 and range
//! rates are positive receding; an exporter whose format differs turns signs, each with a test. Every exporter takes the sweeps
//! one after the other ([`Exporter`]), so that a run of any length needs the memory of one.

pub mod class;
pub mod coco;
pub mod dataset;
pub mod kitti;
mod map_mask;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod nuscenes;
mod occlusion;
#[cfg(feature = "osi")]
pub mod osi;
pub mod pcd;
#[cfg(feature = "hdf5")]
pub mod radarscenes;
#[cfg(test)]
mod samples;
pub mod sweeps;
pub mod tusimple;

use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Sensor, Vehicle, World, direction_from_angles};
use glam::{DQuat, DVec3, EulerRot};
use std::path::PathBuf;

/// The data of one radar in one frame, and the truth at that instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Middle of the frame, ns from the start of the run.
    pub time_ns: i64,
    /// Number of the frame.
    pub frame: u64,
    /// Name of the radar: letters, digits, `_` and `-`.
    pub radar: String,
    /// Pose of the sensor in the vehicle.
    pub sensor_in_vehicle: Pose<Sensor, Vehicle>,
    /// Pose of the vehicle in the world.
    pub vehicle_in_world: Pose<Vehicle, World>,
    /// Velocity of the vehicle's origin in the world, m/s.
    pub vehicle_velocity_mps: DVec3,
    /// Yaw rate about z, rad/s, positive to the left.
    pub yaw_rate_rad_per_s: f64,
    /// Velocity of the radar in the world, m/s.
    pub sensor_velocity_mps: DVec3,
    /// Detections.
    pub points: Vec<SweepPoint>,
    /// Flags of points that the source, of an older version, does not have; they are taken as not set.
    pub missing_flags: Vec<&'static str>,
    /// Boxes of all objects.
    pub boxes: Vec<SweepBox>,
    /// The map, where it was stored.
    pub range_doppler: Option<PowerImage>,
    /// Lane lines, from left to right where that is known.
    pub lanes: Vec<SweepLane>,
    /// Pieces of drivable lanes near the vehicle.
    pub drivable: Vec<LaneArea>,
    /// Grids of points with their masks, where they were stored and asked for.
    pub grids: Vec<MaskedGrid>,
    /// What the vehicle's ideal lidar sees in the frame, where it was stored and asked for; the same for all radars of a frame.
    pub lidar: Option<LidarCloud>,
}

/// What an ideal lidar sees at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct LidarCloud {
    /// Pose of the lidar in the vehicle.
    pub in_vehicle: Pose<Sensor, Vehicle>,
    /// Points, in the order of their rays.
    pub points: Vec<LidarPlace>,
}

/// A place on a surface that a lidar sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarPlace {
    /// Position in the lidar's axes, m.
    pub position_m: DVec3,
    /// Cosine of the angle between the ray and the surface's normal, 0 to 1: what a matt white surface returns.
    pub cos_incidence: f64,
    /// Number of the channel, from the lowest.
    pub channel: u32,
}

/// A detection.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint {
    /// Position in the sensor's axes, m.
    pub position_m: DVec3,
    /// Range, m.
    pub range_m: f64,
    /// Azimuth, rad, positive to the left.
    pub azimuth_rad: f64,
    /// Elevation, rad, positive upwards.
    pub elevation_rad: f64,
    /// Range rate, m/s, positive when receding, as measured: it includes the radar's own motion.
    pub range_rate_mps: f64,
    /// Radar cross section, dBsm.
    pub rcs_dbsm: f64,
    /// Signal-to-noise ratio, dB.
    pub snr_db: f64,
    /// Received power, dBm.
    pub power_dbm: f64,
    /// Standard deviations; of angles only where the array tells them.
    pub range_std_m: f64,
    /// Standard deviation of the azimuth, rad.
    pub azimuth_std_rad: Option<f64>,
    /// Standard deviation of the elevation, rad.
    pub elevation_std_rad: Option<f64>,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// Number of the object whose echo it is; 0 for none.
    pub object_id: u32,
    /// Class of that object, "" for none.
    pub class: String,
    /// Whether the point is not where its object is: a mirror image or a sidelobe.
    pub ghost: bool,
    /// Whether the object moves over the ground; unknown where no object is known.
    pub moving: Option<bool>,
}

/// The true box around an object, in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepBox {
    /// Number of the object.
    pub id: u32,
    /// Class of the object.
    pub class: String,
    /// Centre of the box, m.
    pub centre_m: DVec3,
    /// Full lengths along the object's axes, m.
    pub size_m: DVec3,
    /// Rotation from the object's axes to the world.
    pub rotation: DQuat,
    /// Velocity of the centre, m/s.
    pub velocity_mps: DVec3,
    /// Whether it moves over the ground.
    pub moving: bool,
}

/// A range-Doppler map, `[doppler, range]`, mean power in W.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerImage {
    /// Number of Doppler rows.
    pub doppler_rows: usize,
    /// Number of range columns.
    pub range_columns: usize,
    /// Mean power of each cell, W.
    pub power_w: Vec<f32>,
    /// Range of column 0, m.
    pub first_range_m: f64,
    /// Distance between columns, m.
    pub range_step_m: f64,
    /// Range rate of row 0, m/s, positive receding.
    pub first_range_rate_mps: f64,
    /// Distance between rows, m/s.
    pub range_rate_step_mps: f64,
}

/// A lane line in the vehicle's axes.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepLane {
    /// Number of the line.
    pub id: u32,
    /// Name of the line.
    pub name: String,
    /// Points along the line, through its gaps, m.
    pub points_m: Vec<DVec3>,
}

/// A piece of a drivable lane in the world. Both edges have as many points; those with the same index face each other.
#[derive(Debug, Clone, PartialEq)]
pub struct LaneArea {
    /// Left edge, m.
    pub left_m: Vec<DVec3>,
    /// Right edge, m.
    pub right_m: Vec<DVec3>,
}

/// The points of a sweep in the cells of a grid, and what lies in each cell. Arrays are `[row, column]` as
/// [`Grid`](catseye::road::mask::Grid) says.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskedGrid {
    /// Name of the grid: letters, digits, `_` and `-`.
    pub name: String,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Extent of a cell along a column and along a row, m.
    pub cell_m: [f64; 2],
    /// Number of the [`CellClass`](catseye::road::mask::CellClass) of each cell.
    pub mask: Vec<u8>,
    /// The classes that this grid's mask shows besides lanes.
    pub classes: Vec<catseye::road::mask::CellClass>,
    /// Number of points, amplitude (0 to 1), mean range (m) and mean azimuth (rad): `[plane, row, column]`.
    pub planes: Vec<f32>,
}

impl Sweep {
    /// Pose of the sensor in the world.
    pub fn sensor_in_world(&self) -> Pose<Sensor, World> {
        self.sensor_in_vehicle.then(&self.vehicle_in_world)
    }

    /// Unit vector from the radar to a point, sensor axes.
    pub fn direction(point: &SweepPoint) -> DVec3 {
        direction_from_angles(point.azimuth_rad, point.elevation_rad)
    }

    /// Range rate over the ground: what a radar that stands here would measure. A thing that stands has 0.
    pub fn range_rate_over_ground_mps(&self, point: &SweepPoint) -> f64 {
        let own = self.sensor_in_world().rotation.inverse() * self.sensor_velocity_mps;
        point.range_rate_mps + Self::direction(point).dot(own)
    }

    /// Checks what every exporter relies on.
    ///
    /// # Errors
    /// Returns `BadInput` for a radar's name that is no file name, and `Failed` for a non-finite value
    /// (levels may be infinite) or a map whose size is not the stated one.
    pub fn check(&self) -> Result<()> {
        check_name("radar", &self.radar)?;
        let wrong = |what: String| {
            Err(Error::Failed(format!("frame {}, radar {}: {what} is not a number", self.frame, self.radar)))
        };
        for (i, p) in self.points.iter().enumerate() {
            let finite = p.position_m.is_finite()
                && [p.range_m, p.azimuth_rad, p.elevation_rad, p.range_rate_mps]
                    .iter()
                    .all(|x| x.is_finite());
            // Infinite where there is no noise or the antennas have no gain.
            let known = [p.rcs_dbsm, p.snr_db, p.power_dbm].iter().all(|x| !x.is_nan());
            if !finite || !known {
                return wrong(format!("a value of point {i}"));
            }
        }
        for b in &self.boxes {
            let finite = b.centre_m.is_finite() && b.size_m.is_finite() && b.velocity_mps.is_finite();
            if !finite || b.size_m.min_element() < 0.0 || !b.rotation.is_normalized() {
                return wrong(format!("a value of the box of object {}", b.id));
            }
        }
        for l in &self.lanes {
            if !l.points_m.iter().all(|p| p.is_finite()) {
                return wrong(format!("a point of lane line {}", l.name));
            }
        }
        let poses = [self.sensor_in_vehicle.translation_m, self.vehicle_in_world.translation_m];
        let motion = [self.vehicle_velocity_mps, self.sensor_velocity_mps];
        if !poses.iter().chain(&motion).all(|v| v.is_finite()) || !self.yaw_rate_rad_per_s.is_finite() {
            return wrong("the pose or its motion".into());
        }
        if let Some(map) = &self.range_doppler
            && map.doppler_rows.checked_mul(map.range_columns) != Some(map.power_w.len())
        {
            return Err(Error::Failed(format!(
                "frame {}, radar {}: a map of {} x {} with {} values",
                self.frame,
                self.radar,
                map.doppler_rows,
                map.range_columns,
                map.power_w.len()
            )));
        }
        if let Some(lidar) = &self.lidar {
            let finite = |p: &LidarPlace| p.position_m.is_finite() && (0.0..=1.0).contains(&p.cos_incidence);
            if let Some(i) = lidar.points.iter().position(|p| !finite(p)) {
                return wrong(format!("a value of lidar point {i}"));
            }
            if !lidar.in_vehicle.translation_m.is_finite() || !lidar.in_vehicle.rotation.is_normalized() {
                return wrong("the pose of the lidar".into());
            }
        }
        for grid in &self.grids {
            check_name("grid", &grid.name)?;
            let cells = grid.rows.checked_mul(grid.columns);
            if cells != Some(grid.mask.len())
                || cells.and_then(|c| c.checked_mul(4)) != Some(grid.planes.len())
            {
                return Err(Error::Failed(format!(
                    "frame {}, radar {}: the grid '{}' of {} x {} has {} classes and {} values",
                    self.frame,
                    self.radar,
                    grid.name,
                    grid.rows,
                    grid.columns,
                    grid.mask.len(),
                    grid.planes.len()
                )));
            }
        }
        Ok(())
    }
}

/// Names become those of files and topics.
fn check_name(key: &str, name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || !name.chars().all(plain) {
        return Err(BadInput::new("cannot be used in names of files and topics")
            .key(key)
            .value(format!("{name:?}"))
            .allowed("letters, digits, _ and -")
            .into());
    }
    Ok(())
}

impl SweepPoint {
    /// Standard deviations along the sensor's x and y, metres, to first order from those of range and angles. `None` where an angle
    /// that matters is not measured.
    pub fn horizontal_std_m(&self) -> [Option<f64>; 2] {
        let (sa, ca) = self.azimuth_rad.sin_cos();
        let (se, ce) = self.elevation_rad.sin_cos();
        // Rates of x and y with range, azimuth and elevation. A radar without an elevation takes it as zero.
        let along = |by_range: f64, by_azimuth: f64, by_elevation: f64| {
            let azimuth = match self.azimuth_std_rad {
                Some(s) => by_azimuth * s,
                None if by_azimuth == 0.0 => 0.0,
                None => return None,
            };
            let elevation = by_elevation * self.elevation_std_rad.unwrap_or(0.0);
            Some((by_range * self.range_std_m).hypot(azimuth).hypot(elevation))
        };
        let r = self.range_m;
        [along(ce * ca, -r * ce * sa, -r * se * ca), along(ce * sa, r * ce * ca, -r * se * sa)]
    }
}

/// Where sweeps go. They come in the order of time, those of one instant in any order.
pub trait Exporter {
    /// Takes the next sweep.
    ///
    /// # Errors
    /// Returns the errors of [`Sweep::check`], and an error for what the format cannot hold or a failed
    /// write. The output is then not written.
    fn push(&mut self, sweep: &Sweep) -> Result<()>;

    /// Puts the output under its name.
    ///
    /// # Errors
    /// Returns an error if the output cannot be written; nothing then stays under the final name.
    fn finish(self: Box<Self>) -> Result<Finished>;
}

/// What an exporter wrote.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Finished {
    /// File or folder that was written.
    pub output: PathBuf,
    /// Number of sweeps in it.
    pub sweeps: usize,
    /// Number of points in it.
    pub points: usize,
    /// What the format could not hold, and what stands for it.
    pub notes: Vec<String>,
}

/// Sweeps of a sequence come in the order of time.
#[derive(Debug, Clone, Default)]
struct Order(Option<i64>);

impl Order {
    fn next(&mut self, sweep: &Sweep) -> Result<()> {
        if self.0.is_some_and(|last| sweep.time_ns < last) {
            return Err(Error::Failed(format!(
                "frame {}, radar {}: the sweep is earlier than the one before it",
                sweep.frame, sweep.radar
            )));
        }
        self.0 = Some(sweep.time_ns);
        Ok(())
    }
}

/// Yaw, pitch, roll in radians: yaw about z, pitch about the new y (positive: nose down), roll about the new x: ISO 8855, and the inverse of
/// [`Pose::from_yaw_pitch_roll`].
pub fn yaw_pitch_roll(rotation: DQuat) -> [f64; 3] {
    let (yaw, pitch, roll) = rotation.to_euler(EulerRot::ZYX);
    [yaw, pitch, roll]
}

/// Heading of a frame's x axis in the ground plane, radians, positive to the left.
pub fn heading(rotation: DQuat) -> f64 {
    let ahead = rotation * DVec3::X;
    ahead.y.atan2(ahead.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(azimuth: f64, elevation: f64, rate: f64) -> SweepPoint {
        SweepPoint {
            position_m: direction_from_angles(azimuth, elevation) * 20.0,
            range_m: 20.0,
            azimuth_rad: azimuth,
            elevation_rad: elevation,
            range_rate_mps: rate,
            rcs_dbsm: 0.0,
            snr_db: 20.0,
            power_dbm: -90.0,
            range_std_m: 0.05,
            azimuth_std_rad: Some(0.01),
            elevation_std_rad: None,
            range_rate_std_mps: 0.1,
            object_id: 0,
            class: String::new(),
            ghost: false,
            moving: None,
        }
    }

    proptest! {
        /// Whatever way radar and vehicle look, a thing that stands has no range rate over the ground.
        #[test]
        fn standing_things_stand(
            (az, el) in (-1.2..1.2f64, -0.5..0.5f64), yaw in -3.1..3.1f64, mount in -3.1..3.1f64, pitch in -0.3..0.3f64,
            v in (-30.0..30.0f64, -3.0..3.0f64),
        ) {
            let mut s = samples::empty("r", 0, 0);
            s.sensor_in_vehicle = Pose::from_yaw_pitch_roll(DVec3::new(3.5, 0.4, 0.5), mount, pitch, 0.0);
            s.vehicle_in_world = Pose::from_yaw_pitch_roll(DVec3::new(9.0, 1.0, 0.0), yaw, 0.0, 0.0);
            s.sensor_velocity_mps = DVec3::new(v.0, v.1, 0.0);
            let p = point(az, el, 0.0);
            // Range rate of a standing scatterer: minus the radar's own speed towards it.
            let towards = (s.sensor_in_world().point(p.position_m) - s.sensor_in_world().translation_m).normalize();
            let p = SweepPoint { range_rate_mps: -s.sensor_velocity_mps.dot(towards), ..p };
            prop_assert!(s.range_rate_over_ground_mps(&p).abs() < 1e-10);
        }

        #[test]
        fn angles_of_a_rotation(yaw in -3.1..3.1f64, pitch in -1.5..1.5f64, roll in -3.1..3.1f64) {
            let q = Pose::<Sensor, Vehicle>::from_yaw_pitch_roll(DVec3::ZERO, yaw, pitch, roll).rotation;
            let [y, p, r] = yaw_pitch_roll(q);
            prop_assert!((y - yaw).abs() < 1e-9 && (p - pitch).abs() < 1e-9 && (r - roll).abs() < 1e-9);
        }
    }

    #[test]
    fn deviations_turn_with_the_azimuth() {
        let [x, y] = point(0.0, 0.0, 0.0).horizontal_std_m();
        assert!((x.unwrap() - 0.05).abs() < 1e-12 && (y.unwrap() - 0.2).abs() < 1e-12);
        let [x, y] = point(0.5 * std::f64::consts::PI, 0.0, 0.0).horizontal_std_m();
        assert!((x.unwrap() - 0.2).abs() < 1e-12 && (y.unwrap() - 0.05).abs() < 1e-12);
        let unknown = SweepPoint { azimuth_std_rad: None, ..point(0.3, 0.0, 0.0) };
        assert_eq!(unknown.horizontal_std_m(), [None, None]);
    }

    #[test]
    fn refused() {
        let mut s = samples::empty("front", 0, 0);
        s.check().unwrap();
        s.points = vec![SweepPoint { rcs_dbsm: f64::NAN, ..point(0.0, 0.0, 0.0) }];
        assert!(s.check().unwrap_err().to_string().contains("point 0"));
        s.points[0].rcs_dbsm = f64::INFINITY;
        s.check().unwrap();
        let good = samples::sweeps()[0].boxes[0].clone();
        s.boxes =
            vec![SweepBox { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0).normalize(), ..good.clone() }];
        assert!(s.check().unwrap_err().to_string().contains("object 7"));
        s.boxes = vec![SweepBox { size_m: DVec3::new(4.0, -1.0, 1.0), ..good }];
        assert!(s.check().unwrap_err().to_string().contains("object 7"));
        s.boxes.clear();
        s.radar = "../front".into();
        assert_eq!(s.check().unwrap_err().exit_code(), 2);
        let mut order = Order::default();
        let mut s = samples::empty("front", 1, 5);
        order.next(&s).unwrap();
        order.next(&s).unwrap();
        s.time_ns = 4;
        assert!(order.next(&s).is_err());
    }
}
