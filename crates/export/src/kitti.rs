//! The layout of KITTI's object detection (<https://www.cvlibs.net/datasets/kitti/eval_object.php>) with the radar points of
//! View-of-Delft (<https://github.com/tudelft-iv/view-of-delft-dataset>): what OpenPCDet, MMDetection3D and View-of-Delft's own
//! tools read. A run of several radars becomes a folder of this layout for each of them, by its name. A run with the points of an ideal
//! lidar (`[output] lidar = true`) has a folder `lidar` of this layout as well, whose `velodyne` holds four float32 for each point as
//! KITTI's own does: x, y, z in the lidar's axes, and the cosine of the angle of incidence in place of a reflectance, and whose `calib`
//! is that of the lidar.
//!
//! | file | content |
//! |---|---|
//! | `training/velodyne/NNNNNN.bin` | float32, little endian, seven for each point: x, y, z (m, the radar's axes), RCS (dBsm), `v_r` (range rate as measured, m/s, positive receding), `v_r_compensated` (range rate over the ground), time (0: the current scan) |
//! | `training/label_2/NNNNNN.txt` | for each object in the picture: type, truncated (0 to 1), occluded (0 to 2), alpha, left, top, right, bottom (pixels), height, width, length (m), x, y, z of the middle of the lower face (camera, m), `rotation_y` |
//! | `training/calib/NNNNNN.txt` | `P0` to `P3` (3 x 4, all of the one camera), `R0_rect` (identity), `Tr_velo_to_cam` (radar to camera), `Tr_imu_to_velo` (vehicle to radar) |
//! | `training/pose/NNNNNN.json` | three lines with a 4 x 4 matrix each, camera to: the vehicle at the first frame (`odomToCamera`), the world (`mapToCamera`), the world again (`UTMToCamera`) |
//! | `ImageSets/SPLIT.txt` | numbers of frames: the first four fifths of the run are `train`, the rest `val`, all of them `trainval`, and none `test` |
//!
//! The camera's axes are x right, y down, z ahead. `rotation_y` turns about its y axis and is 0 where the object's length lies along
//! x; `alpha` is `rotation_y` less the azimuth atan2(x, z) of the object. An object with pitch or roll against the camera loses them,
//! since the format has no place for them, and its middle stays where it is. `occluded` is 0 where other road users' boxes hide less
//! than a tenth of the box from the camera, 1 where they hide less than a half, else 2.

use super::class::{RoadUser, road_user};
use super::map_mask::within;
use super::tusimple::{Camera, NEAREST_M, Optical};
use super::{Exporter, Finished, LidarCloud, Order, Sweep, SweepBox, occlusion};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Sensor, Vehicle, World};
use catseye::formats::stage::{MANIFEST, StagedDir};
use glam::{DMat3, DVec2, DVec3};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Values of a point.
pub const POINT_VALUES: usize = 7;
/// The last number that six digits write.
const LAST_FRAME: u64 = 999_999;
/// Folder of the lidar, as View-of-Delft's tools expect it.
const LIDAR: &str = "lidar";
/// Tilts that are smaller are none, rad.
const LEVEL_RAD: f64 = 1e-4;

/// From the axes x ahead, y left, z up to KITTI's x right, y down, z ahead.
fn right_down_ahead(p: DVec3) -> DVec3 {
    DVec3::new(-p.y, -p.z, p.x)
}

/// KITTI's type of a class; None for what KITTI does not label.
fn kind(class: &str) -> Option<&'static str> {
    Some(match road_user(class)? {
        RoadUser::Car => "Car",
        RoadUser::Van => "Van",
        RoadUser::Truck if class.starts_with("truck") => "Truck",
        RoadUser::Train => "Tram",
        RoadUser::Cyclist if class.starts_with("cyclist") => "Cyclist",
        RoadUser::Pedestrian => "Pedestrian",
        _ => "Misc",
    })
}

/// A label, in the camera's axes.
#[derive(Debug, Clone, PartialEq)]
struct Label {
    kind: &'static str,
    truncated: f64,
    occluded: u8,
    alpha: f64,
    /// Left, top, right, bottom, pixels.
    bounds_px: [f64; 4],
    /// Height, width, length, m.
    size_m: [f64; 3],
    /// Middle of the lower face, m.
    place_m: DVec3,
    rotation_y: f64,
    /// Angle between the object's and the camera's upward axes, which the format cannot hold, rad.
    tilt_rad: f64,
}

impl Label {
    /// The label of box number `at`; None for what has no type, and for what is not in the picture.
    fn of(boxes: &[SweepBox], at: usize, camera: &Camera, in_world: &Pose<Optical, World>) -> Option<Label> {
        let b = &boxes[at];
        let kind = kind(&b.class)?;
        let into = in_world.inverse();
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
            into.point(b.centre_m + b.rotation * (b.size_m * DVec3::new(sign(0), sign(1), sign(2))))
        };
        let (low, high) = outline(camera, std::array::from_fn(corner))?;
        let last = DVec2::new(f64::from(camera.width_px - 1), f64::from(camera.height_px - 1));
        let (shown_low, shown_high) = (low.clamp(DVec2::ZERO, last), high.clamp(DVec2::ZERO, last));
        let (shown, all) = (shown_high - shown_low, high - low);
        if shown.min_element() <= 0.0 {
            return None;
        }
        let middle = right_down_ahead(into.point(b.centre_m));
        let ahead = right_down_ahead(into.direction(b.rotation * DVec3::X));
        let up = right_down_ahead(into.direction(b.rotation * DVec3::Z));
        let rotation_y = (-ahead.z).atan2(ahead.x);
        Some(Label {
            kind,
            truncated: 1.0 - shown.x * shown.y / (all.x * all.y),
            occluded: match occlusion::share_seen(boxes, at, in_world.translation_m) {
                share if share > 0.9 => 0,
                share if share > 0.5 => 1,
                _ => 2,
            },
            alpha: turned(rotation_y - middle.x.atan2(middle.z)),
            bounds_px: [shown_low.x, shown_low.y, shown_high.x, shown_high.y],
            size_m: [b.size_m.z, b.size_m.y, b.size_m.x],
            place_m: middle + DVec3::new(0.0, 0.5 * b.size_m.z, 0.0),
            rotation_y,
            tilt_rad: (-up.y).clamp(-1.0, 1.0).acos(),
        })
    }

    fn line(&self) -> String {
        let mut out = format!("{} {:.4} {} {:.6}", self.kind, self.truncated, self.occluded, self.alpha);
        for x in self.bounds_px {
            let _ = write!(out, " {x:.2}");
        }
        for x in self.size_m.into_iter().chain(self.place_m.to_array()).chain([self.rotation_y]) {
            let _ = write!(out, " {x:.6}");
        }
        out + "\n"
    }
}

/// The same angle from −π to π.
fn turned(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// Bounds of a box's picture, before they are cut to the picture's size; None for what lies behind the camera. The corners are in
/// the camera's optical axes, bit 0 of their number for x, 1 for y, 2 for z.
fn outline(camera: &Camera, corners: [DVec3; 8]) -> Option<(DVec2, DVec2)> {
    let mut bounds: Option<(DVec2, DVec2)> = None;
    let mut add = |p: DVec3| {
        let at = camera.project(p);
        bounds = Some(bounds.map_or((at, at), |(low, high)| (low.min(at), high.max(at))));
    };
    for (i, a) in corners.iter().enumerate() {
        if a.x >= NEAREST_M {
            add(*a);
        }
        for bit in 0..3 {
            let b = corners[i ^ (1 << bit)];
            // An edge that comes from behind the camera is cut before it.
            if a.x < NEAREST_M && b.x > NEAREST_M {
                add(*a + (b - *a) * ((NEAREST_M - a.x) / (b.x - a.x)));
            }
        }
    }
    bounds
}

/// Rows of a 3 x 4 matrix from a frame to KITTI's camera, or of a 4 x 4 one from the camera, one after the other.
fn rows(turn: DMat3, shift: DVec3) -> Vec<f64> {
    (0..3).flat_map(|i| turn.row(i).to_array().into_iter().chain([shift[i]])).collect()
}

/// The turn from x ahead, y left, z up to KITTI's camera.
fn turn_to_camera() -> DMat3 {
    DMat3::from_cols(right_down_ahead(DVec3::X), right_down_ahead(DVec3::Y), right_down_ahead(DVec3::Z))
}

fn matrix_line(key: &str, values: &[f64]) -> String {
    let mut out = format!("{key}:");
    for x in values {
        // A zero never has a sign.
        let _ = write!(out, " {:.12e}", x + 0.0);
    }
    out + "\n"
}

/// A folder of this layout under construction.
pub struct Folder {
    staged: StagedDir,
    camera: Camera,
    order: Order,
    /// Numbers of the frames of each radar, in the order of time.
    frames: BTreeMap<String, Vec<u64>>,
    /// Numbers of the frames of the lidar, in the order of time.
    lidar_frames: Vec<u64>,
    /// The vehicle at the first frame.
    start: Option<Pose<Vehicle, World>>,
    sweeps: usize,
    points: usize,
    labels: usize,
    outside: usize,
    tilt_rad: f64,
}

impl Folder {
    /// Begins a folder.
    ///
    /// # Errors
    /// Returns `BadInput` for a camera that is none, and if the folder already exists and `force` is not given
    /// ([`StagedDir::new`]).
    pub fn create(folder: &Path, camera: Camera, force: bool) -> Result<Folder> {
        camera.check_picture()?;
        Ok(Folder {
            staged: StagedDir::new(folder, force, "kitti")?,
            camera,
            order: Order::default(),
            frames: BTreeMap::new(),
            lidar_frames: Vec::new(),
            start: None,
            sweeps: 0,
            points: 0,
            labels: 0,
            outside: 0,
            tilt_rad: 0.0,
        })
    }

    /// The text of `calib` for a sensor with this pose in the vehicle.
    fn calibration(&self, sensor_in_vehicle: &Pose<Sensor, Vehicle>) -> String {
        let c = &self.camera;
        let [cx, cy] = c.centre_px;
        let projection = [c.focal_px, 0.0, cx, 0.0, 0.0, c.focal_px, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut out: String = (0..4).map(|i| matrix_line(&format!("P{i}"), &projection)).collect();
        out += &matrix_line("R0_rect", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let sensor = sensor_in_vehicle.then(&c.mounting.inverse());
        let turn = turn_to_camera() * DMat3::from_quat(sensor.rotation);
        out += &matrix_line("Tr_velo_to_cam", &rows(turn, right_down_ahead(sensor.translation_m)));
        let vehicle = sensor_in_vehicle.inverse();
        out + &matrix_line("Tr_imu_to_velo", &rows(DMat3::from_quat(vehicle.rotation), vehicle.translation_m))
    }

    fn poses(&self, sweep: &Sweep, start: &Pose<Vehicle, World>) -> String {
        let in_world = self.camera.mounting.then(&sweep.vehicle_in_world);
        let from_camera = turn_to_camera().transpose();
        let line = |key: &str, turn: glam::DQuat, place: DVec3| {
            let mut matrix = rows(DMat3::from_quat(turn) * from_camera, place);
            matrix.extend([0.0, 0.0, 0.0, 1.0]);
            json!({ key: matrix }).to_string() + "\n"
        };
        let odometry = in_world.then(&start.inverse());
        [
            line("odomToCamera", odometry.rotation, odometry.translation_m),
            line("mapToCamera", in_world.rotation, in_world.translation_m),
            line("UTMToCamera", in_world.rotation, in_world.translation_m),
        ]
        .concat()
    }
}

/// The points as the bytes of a file.
fn cloud(sweep: &Sweep) -> Vec<u8> {
    let values = sweep.points.iter().flat_map(|p| {
        let [x, y, z] = p.position_m.to_array();
        [x, y, z, p.rcs_dbsm, p.range_rate_mps, sweep.range_rate_over_ground_mps(p), 0.0]
    });
    values.flat_map(|x| (x as f32).to_le_bytes()).collect()
}

/// The lidar's points as the bytes of a file.
fn lidar_cloud(lidar: &LidarCloud) -> Vec<u8> {
    let values = lidar.points.iter().flat_map(|p| {
        let [x, y, z] = p.position_m.to_array();
        [x, y, z, p.cos_incidence]
    });
    values.flat_map(|x| (x as f32).to_le_bytes()).collect()
}

fn save(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    fs::write(path, bytes).map_err(|e| Error::io(path, e))
}

impl Exporter for Folder {
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        self.order.next(sweep)?;
        if sweep.frame > LAST_FRAME {
            return Err(BadInput::new("the frame number is too large for KITTI's file names")
                .key("frame")
                .value(sweep.frame)
                .allowed(format!("0 to {LAST_FRAME}"))
                .into());
        }
        if self.frames.get(&sweep.radar).is_some_and(|frames| frames.contains(&sweep.frame)) {
            return Err(Error::Failed(format!(
                "frame {} of radar {} occurs twice",
                sweep.frame, sweep.radar
            )));
        }
        if sweep.lidar.is_some() && sweep.radar == LIDAR {
            return Err(BadInput::new("the name is reserved for the folder of the lidar")
                .key("radar")
                .value(LIDAR)
                .remedy("rename the radar")
                .into());
        }
        let start = *self.start.get_or_insert(sweep.vehicle_in_world);
        let in_world = self.camera.mounting.then(&sweep.vehicle_in_world);
        let mut text = String::new();
        let labelled = |i: &usize| kind(&sweep.boxes[*i].class).is_some();
        for i in (0..sweep.boxes.len()).filter(labelled) {
            within(sweep.boxes[i].centre_m)?;
            within(sweep.boxes[i].size_m)?;
            let Some(label) = Label::of(&sweep.boxes, i, &self.camera, &in_world) else {
                self.outside += 1;
                continue;
            };
            text += &label.line();
            self.labels += 1;
            self.tilt_rad = self.tilt_rad.max(label.tilt_rad);
        }
        let root = self.staged.path();
        let save_all = |sensor: &str, points: Vec<u8>, mounting: &Pose<Sensor, Vehicle>| -> Result<()> {
            let folder = root.join(sensor).join("training");
            let file = |kind: &str, end: &str| folder.join(kind).join(format!("{:06}.{end}", sweep.frame));
            save(&file("velodyne", "bin"), points)?;
            save(&file("label_2", "txt"), &text)?;
            save(&file("calib", "txt"), self.calibration(mounting))?;
            save(&file("pose", "json"), self.poses(sweep, &start))
        };
        save_all(&sweep.radar, cloud(sweep), &sweep.sensor_in_vehicle)?;
        // All radars of a frame see the same lidar.
        if let Some(lidar) = sweep.lidar.as_ref().filter(|_| self.lidar_frames.last() != Some(&sweep.frame)) {
            save_all(LIDAR, lidar_cloud(lidar), &lidar.in_vehicle)?;
            self.lidar_frames.push(sweep.frame);
        }
        self.frames.entry(sweep.radar.clone()).or_default().push(sweep.frame);
        self.sweeps += 1;
        self.points += sweep.points.len();
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Finished> {
        let root = self.staged.path();
        let lidar = Some((LIDAR, &self.lidar_frames)).filter(|(_, frames)| !frames.is_empty());
        for (sensor, frames) in self.frames.iter().map(|(r, f)| (r.as_str(), f)).chain(lidar) {
            let list = |frames: &[u64]| frames.iter().map(|f| format!("{f:06}\n")).collect::<String>();
            // A whole block of time, so that no frame of one split stands between two of the other.
            let (train, val) = frames.split_at((4 * frames.len()).div_ceil(5));
            for (split, of) in [("train", train), ("val", val), ("trainval", frames), ("test", &[])] {
                save(&root.join(sensor).join("ImageSets").join(format!("{split}.txt")), list(of))?;
            }
        }
        let mut notes = vec!["there are no images: a renderer of the camera would write image_2".to_string()];
        if let Some(radar) = self.frames.keys().next().filter(|_| self.frames.len() == 1 && lidar.is_none()) {
            // One radar needs no folder of its own.
            let from = root.join(radar);
            for part in ["training", "ImageSets"] {
                fs::rename(from.join(part), root.join(part)).map_err(|e| Error::io(root.join(part), e))?;
            }
            fs::remove_dir(&from).map_err(|e| Error::io(&from, e))?;
        } else {
            notes.push("each sensor has a folder of its own".into());
        }
        if self.outside > 0 {
            notes.push(format!("{} boxes are outside the image and have no label", self.outside));
        }
        if self.tilt_rad > LEVEL_RAD {
            notes.push(format!(
                "labels leave out tilts of up to {:.2} degrees between objects and the camera",
                self.tilt_rad.to_degrees()
            ));
        }
        let c = &self.camera;
        let manifest = json!({
            "catseye": env!("CARGO_PKG_VERSION"),
            "format": "KITTI object detection, points of View-of-Delft's radar",
            "radars": self.frames.keys().collect::<Vec<_>>(),
            "lidar": lidar.map(|(folder, _)| folder),
            "labels": self.labels,
            "camera": {
                "width_px": c.width_px, "height_px": c.height_px, "focal_px": c.focal_px, "centre_px": c.centre_px,
                "position_m": c.mounting.translation_m.to_array(), "rotation_xyzw": c.mounting.rotation.to_array(),
            },
        });
        let text =
            serde_json::to_string_pretty(&manifest).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        save(&root.join(MANIFEST), text + "\n")?;
        Ok(Finished { output: self.staged.commit()?, sweeps: self.sweeps, points: self.points, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;
    use glam::DQuat;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn car(centre: DVec3, yaw: f64) -> SweepBox {
        SweepBox {
            id: 1,
            class: "car".into(),
            centre_m: centre,
            size_m: DVec3::new(4.0, 2.0, 1.5),
            rotation: DQuat::from_rotation_z(yaw),
            velocity_mps: DVec3::ZERO,
            moving: false,
        }
    }

    fn camera() -> Camera {
        Camera::new(1000, 600, 500.0, DVec3::new(1.0, 0.0, 1.5), 0.0)
    }

    fn label(b: SweepBox, camera: &Camera) -> Option<Label> {
        let in_world = camera.mounting.then(&Pose::IDENTITY);
        Label::of(&[b], 0, camera, &in_world)
    }

    /// A car that drives away straight ahead, 20 m before the camera: its rear face is nearest.
    #[test]
    fn a_car_straight_ahead() {
        let l = label(car(DVec3::new(21.0, 0.0, 0.75), 0.0), &camera()).unwrap();
        assert!((l.rotation_y + FRAC_PI_2).abs() < 1e-12 && (l.alpha + FRAC_PI_2).abs() < 1e-12);
        assert!((l.place_m - DVec3::new(0.0, 1.5, 20.0)).length() < 1e-12, "{}", l.place_m);
        assert_eq!(l.size_m, [1.5, 2.0, 4.0]);
        // 500 px over 18 m.
        let half = 500.0 / 18.0;
        // The upper edge lies at the camera's height.
        let expected = [500.0 - half, 300.0, 500.0 + half, 300.0 + 1.5 * half];
        assert!(l.bounds_px.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", l.bounds_px);
        assert_eq!((l.truncated, l.occluded, l.tilt_rad), (0.0, 0, 0.0));
        // Length along the camera's x, then towards the camera, then a car on the left that is seen from its side.
        for (yaw, rotation_y) in [(-FRAC_PI_2, 0.0), (PI, FRAC_PI_2), (FRAC_PI_2, PI)] {
            let l = label(car(DVec3::new(21.0, 0.0, 0.75), yaw), &camera()).unwrap();
            assert!((l.rotation_y.abs() - rotation_y).abs() < 1e-12, "{yaw}: {}", l.rotation_y);
        }
        let l = label(car(DVec3::new(11.0, 5.0, 0.75), 0.0), &camera()).unwrap();
        assert!((l.alpha - (-FRAC_PI_2 + 0.5f64.atan())).abs() < 1e-12, "{}", l.alpha);
    }

    #[test]
    fn what_the_picture_cuts_off() {
        // Half of a car across the road at the left edge, where y/X = 1.
        let l = label(car(DVec3::new(11.0, 9.0, 0.75), FRAC_PI_2), &camera()).unwrap();
        let left = 500.0 - 500.0 * 11.0 / 9.0;
        let right = 500.0 - 500.0 * 7.0 / 11.0;
        assert!((l.truncated - (0.0 - left) / (right - left)).abs() < 1e-12, "{}", l.truncated);
        assert_eq!(l.bounds_px[0], 0.0);
        // One that stands beside the camera is seen as far as it is before it.
        let l = label(car(DVec3::new(2.0, 2.0, 0.75), 0.0), &camera()).unwrap();
        assert!(l.truncated > 0.9, "{}", l.truncated);
        for centre in [DVec3::new(-20.0, 0.0, 0.75), DVec3::new(10.0, 60.0, 0.75)] {
            assert_eq!(label(car(centre, 0.0), &camera()), None);
        }
        // A tilted camera: the car's upward axis differs from its own by the tilt, and the middle stays.
        let tilted = Camera::new(1000, 600, 500.0, DVec3::new(1.0, 0.0, 1.5), 0.1);
        let l = label(car(DVec3::new(21.0, 0.0, 0.75), 0.0), &tilted).unwrap();
        assert!((l.tilt_rad - 0.1).abs() < 1e-9, "{}", l.tilt_rad);
        let (s, c) = 0.1f64.sin_cos();
        let middle = l.place_m - DVec3::new(0.0, 0.75, 0.0);
        let exact = DVec3::new(0.0, 0.75 * c - 20.0 * s, 20.0 * c + 0.75 * s);
        assert!((middle - exact).length() < 1e-12, "{middle}");
    }

    #[test]
    fn types() {
        let names =
            ["car.wheel", "truck", "trailer", "bus", "bicycle", "cyclist", "tram", "guard_rail"].map(kind);
        let expected = [
            Some("Car"),
            Some("Truck"),
            Some("Misc"),
            Some("Misc"),
            Some("Misc"),
            Some("Cyclist"),
            Some("Tram"),
            None,
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn splits_folders_and_refusals() {
        let t = tempfile::tempdir().unwrap();
        let folder = t.path().join("out");
        let mut out = Folder::create(&folder, camera(), false).unwrap();
        for frame in 0..6u64 {
            out.push(&samples::empty("front", frame, frame as i64)).unwrap();
        }
        assert!(out.push(&samples::empty("front", 5, 9)).unwrap_err().to_string().contains("twice"));
        let mut broken = samples::empty("front", 6, 9);
        broken.boxes = vec![car(DVec3::new(1e300, 0.0, 0.0), 0.0)];
        assert_eq!(out.push(&broken).unwrap_err().exit_code(), 2);
        let far = samples::empty("front", 1_000_000, 9);
        assert_eq!(out.push(&far).unwrap_err().exit_code(), 2);
        Box::new(out).finish().unwrap();
        let split = |name: &str| fs::read_to_string(folder.join(format!("ImageSets/{name}.txt"))).unwrap();
        assert_eq!(split("train"), "000000\n000001\n000002\n000003\n000004\n");
        assert_eq!((split("val").as_str(), split("test").as_str()), ("000005\n", ""));
        // A sweep without points is a file without bytes.
        assert_eq!(fs::read(folder.join("training/velodyne/000003.bin")).unwrap(), [0u8; 0]);
        let broken = Camera { focal_px: f64::NAN, ..camera() };
        assert_eq!(Folder::create(&t.path().join("b"), broken, false).err().unwrap().exit_code(), 2);
        // A small picture without the rows of TuSimple is a camera here.
        let mut two =
            Folder::create(&t.path().join("two"), Camera::new(64, 32, 40.0, DVec3::Z, 0.0), false).unwrap();
        for radar in ["left", "right"] {
            two.push(&samples::empty(radar, 0, 0)).unwrap();
        }
        Box::new(two).finish().unwrap();
        assert!(t.path().join("two/left/training/calib/000000.txt").is_file());
        assert!(t.path().join("two/right/ImageSets/train.txt").is_file());
    }
}
