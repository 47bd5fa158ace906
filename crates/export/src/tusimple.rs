//! TuSimple lane labels (<https://github.com/TuSimple/tusimple-benchmark>, lane detection): one JSON object a line, with
//! `raw_file`, `h_samples` (rows of the picture) and `lanes` (for each lane line its column at each of those rows, −2 where it is
//! not in the picture), from the lane lines of the truth and a pinhole camera.
//!
//! There are no pictures: `raw_file` names the one that a renderer of the same frame would have to write. Nothing hides a line.

use super::{Exporter, Finished, Order, Sweep, SweepLane};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Vehicle};
use catseye::formats::stage::StagedFile;
use glam::{DVec2, DVec3};
use serde_json::json;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Column of a line that is not in the picture.
pub const ABSENT: i64 = -2;
/// What is nearer along the optical axis is not drawn.
pub(crate) const NEAREST_M: f64 = 0.1;

/// Axes of a camera: x along the optical axis, y left, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optical;

/// A pinhole camera without distortion. Columns count from the left, rows from the top, the first pixel's centre is at 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Where the optical axis meets the picture: column, row.
    pub centre_px: [f64; 2],
    /// Pose of the camera's optical frame in the vehicle.
    pub mounting: Pose<Optical, Vehicle>,
    /// The rows that are written.
    pub rows: Vec<u32>,
}

impl Default for Camera {
    /// 1280 x 720 pixels and rows from 160 to 710 by 10, as TuSimple's; focal length and place of nuScenes' front camera
    /// (1266.4 px at 1600 x 900; 1.70 m before the rear axle, 1.51 m up), which looks ahead.
    fn default() -> Self {
        Camera::new(1280, 720, 1266.4 * 1280.0 / 1600.0, DVec3::new(1.70, 0.0, 1.51), 0.0)
    }
}

impl Camera {
    /// A camera that looks ahead, `pitch_rad` down. The optical axis meets the middle of the picture.
    pub fn new(width_px: u32, height_px: u32, focal_px: f64, position_m: DVec3, pitch_rad: f64) -> Camera {
        Camera {
            width_px,
            height_px,
            focal_px,
            centre_px: [0.5 * f64::from(width_px), 0.5 * f64::from(height_px)],
            mounting: Pose::from_yaw_pitch_roll(position_m, 0.0, pitch_rad, 0.0),
            rows: (160..height_px).step_by(10).collect(),
        }
    }

    fn wrong(key: &str, value: String, allowed: &str) -> Result<()> {
        Err(BadInput::new("is not possible for a camera").key(key).value(value).allowed(allowed).into())
    }

    /// Checks that the camera makes a picture, whatever rows are asked for.
    ///
    /// # Errors
    /// `BadInput` for a size or a focal length that is not positive, and a place that is not a number.
    pub fn check_picture(&self) -> Result<()> {
        let wrong = Self::wrong;
        if self.width_px == 0 || self.height_px == 0 {
            return wrong(
                "camera size",
                format!("{} x {}", self.width_px, self.height_px),
                "1 pixel or more",
            );
        }
        if !(self.focal_px.is_finite() && self.focal_px > 0.0) {
            return wrong("focal_px", self.focal_px.to_string(), "a positive number of pixels");
        }
        let place = self.mounting.translation_m;
        if !place.is_finite() || !self.mounting.rotation.is_normalized() {
            return wrong("camera position_m", place.to_string(), "finite numbers");
        }
        Ok(())
    }

    /// Checks that the camera makes a picture with the rows that are asked for.
    ///
    /// # Errors
    /// Returns the errors of [`Self::check_picture`], and `BadInput` for no row or one outside the picture.
    pub fn check(&self) -> Result<()> {
        self.check_picture()?;
        let wrong = Self::wrong;
        match self.rows.iter().find(|r| **r >= self.height_px) {
            Some(row) => wrong("h_samples", row.to_string(), "rows of the image"),
            None if self.rows.is_empty() => wrong("h_samples", "none".into(), "an image of 161 rows or more"),
            None => Ok(()),
        }
    }

    /// Column and row of a point in the camera's axes, before the camera.
    pub(crate) fn project(&self, p: DVec3) -> DVec2 {
        DVec2::new(
            self.centre_px[0] - self.focal_px * p.y / p.x,
            self.centre_px[1] - self.focal_px * p.z / p.x,
        )
    }

    /// Column of a lane line at each row, [`ABSENT`] where it is not in the picture. Where a row shows the line several times (behind
    /// a crest), the nearest place counts.
    pub fn columns(&self, lane: &SweepLane) -> Vec<i64> {
        let into = self.mounting.inverse();
        let points: Vec<DVec3> = lane.points_m.iter().map(|p| into.point(*p)).collect();
        // Straight pieces before the camera, in the picture, with their inverse depths, which are linear there.
        let pieces: Vec<[(DVec2, f64); 2]> = points
            .windows(2)
            .filter_map(|w| {
                let [a, b] = [w[0], w[1]];
                let cut =
                    |from: DVec3, to: DVec3| from + (to - from) * ((NEAREST_M - from.x) / (to.x - from.x));
                let (a, b) = match (a.x >= NEAREST_M, b.x >= NEAREST_M) {
                    (true, true) => (a, b),
                    (true, false) => (a, cut(a, b)),
                    (false, true) => (cut(a, b), b),
                    (false, false) => return None,
                };
                Some([(self.project(a), 1.0 / a.x), (self.project(b), 1.0 / b.x)])
            })
            .collect();
        let at = |row: f64| -> Option<f64> {
            let crossings = pieces.iter().filter_map(|[(a, near_a), (b, near_b)]| {
                let t = (row - a.y) / (b.y - a.y);
                // A piece along the row gives no place.
                (0.0..=1.0).contains(&t).then(|| (a.x + t * (b.x - a.x), near_a + t * (near_b - near_a)))
            });
            let nearest = crossings.max_by(|a, b| a.1.total_cmp(&b.1))?;
            Some(nearest.0)
        };
        let inside = |x: f64| (0.0..f64::from(self.width_px) - 0.5).contains(&x);
        self.rows
            .iter()
            .map(|row| at(f64::from(*row)).filter(|x| inside(*x)).map_or(ABSENT, |x| x.round() as i64))
            .collect()
    }

    /// The lane lines that two rows or more show, from left to right at the lowest row they share with the picture.
    pub fn lanes(&self, lanes: &[SweepLane]) -> Vec<Vec<i64>> {
        let mut seen: Vec<Vec<i64>> = lanes
            .iter()
            .map(|l| self.columns(l))
            .filter(|c| c.iter().filter(|x| **x != ABSENT).count() >= 2)
            .collect();
        // Lines leave the picture at its sides: the farther left, the smaller the slope of column against row.
        let slope = |c: &[i64]| {
            let known: Vec<(f64, f64)> = c
                .iter()
                .zip(&self.rows)
                .filter(|(x, _)| **x != ABSENT)
                .map(|(x, row)| (*x as f64, f64::from(*row)))
                .collect();
            let (first, last) = (known[0], known[known.len() - 1]);
            (last.0 - first.0) / (last.1 - first.1)
        };
        seen.sort_by(|a, b| slope(a).total_cmp(&slope(b)));
        seen
    }
}

/// A file of labels, one line for each instant.
pub struct LaneFile {
    staged: StagedFile,
    out: BufWriter<File>,
    camera: Camera,
    order: Order,
    frames: usize,
    without: usize,
}

impl LaneFile {
    /// Begins a file of labels.
    ///
    /// # Errors
    /// `BadInput` for a camera that is none, and when there is a file already and `force` is not given.
    pub fn create(path: &Path, camera: Camera, force: bool) -> Result<LaneFile> {
        camera.check()?;
        let staged = StagedFile::new(path, force)?;
        let out = File::create(staged.path()).map_err(|e| Error::io(path, e))?;
        Ok(LaneFile {
            staged,
            out: BufWriter::new(out),
            camera,
            order: Order::default(),
            frames: 0,
            without: 0,
        })
    }
}

impl Exporter for LaneFile {
    /// Sweeps of other radars at the same time add nothing.
    fn push(&mut self, sweep: &Sweep) -> Result<()> {
        sweep.check()?;
        let last = self.order.0;
        self.order.next(sweep)?;
        if last == Some(sweep.time_ns) {
            return Ok(());
        }
        let lanes = self.camera.lanes(&sweep.lanes);
        self.frames += 1;
        self.without += usize::from(lanes.is_empty());
        let line = json!({
            "raw_file": format!("frame_{:06}/camera.jpg", sweep.frame),
            "lanes": lanes,
            "h_samples": self.camera.rows,
        });
        writeln!(self.out, "{line}").map_err(|e| Error::io(self.staged.final_path(), e))
    }

    fn finish(mut self: Box<Self>) -> Result<Finished> {
        self.out.flush().map_err(|e| Error::io(self.staged.final_path(), e))?;
        let mut notes =
            vec!["there are no images: raw_file names those that a renderer would write".to_string()];
        if self.without > 0 {
            notes.push(format!("{} of {} frames show no lane line", self.without, self.frames));
        }
        Ok(Finished { output: self.staged.commit()?, sweeps: self.frames, points: 0, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane(points: &[[f64; 3]]) -> SweepLane {
        SweepLane {
            id: 1,
            name: "l".into(),
            points_m: points.iter().map(|p| DVec3::from_array(*p)).collect(),
        }
    }

    /// A straight line on level ground at y is at column c − f y/X where the ground's row is v₀ + f h/X.
    #[test]
    fn straight_line_on_level_ground() {
        let camera = Camera::default();
        let columns = camera.columns(&lane(&[[-20.0, 1.75, 0.0], [500.0, 1.75, 0.0]]));
        for (row, column) in camera.rows.iter().zip(columns) {
            let depth = camera.focal_px * 1.51 / (f64::from(*row) - 360.0);
            let exact = 640.0 - camera.focal_px * 1.75 / depth;
            if depth > 0.0 && depth < 498.0 && exact >= 0.0 {
                assert!((column as f64 - exact).abs() <= 0.5, "{row}: {column}, {exact}");
            } else {
                assert_eq!(column, ABSENT, "{row}");
            }
        }
    }

    #[test]
    fn pitch_moves_the_horizon() {
        // Level ground far away: the horizon, f tan(pitch) above the middle when the camera looks down.
        let mut camera = Camera::new(1280, 720, 1000.0, DVec3::new(0.0, 0.0, 1.5), 0.1);
        camera.rows = (0..720).collect();
        let columns = camera.columns(&lane(&[[20.0, 0.0, 0.0], [1e6, 0.0, 0.0]]));
        let shown: Vec<u32> =
            camera.rows.iter().copied().filter(|r| columns[*r as usize] != ABSENT).collect();
        let horizon = 360.0 - 1000.0 * 0.1f64.tan();
        assert_eq!(shown[0], horizon.ceil() as u32);
        // 20 m away: the angle below the horizon is that of the camera's height.
        let nearest = 360.0 - 1000.0 * (0.1 - (1.5f64 / 20.0).atan()).tan();
        assert_eq!(*shown.last().unwrap(), nearest as u32);
    }

    #[test]
    fn nearest_place_behind_a_crest() {
        // Up 1 m at 20 m, down to 0 at 40 m, and a wall of line at 60 m up to 3 m.
        let camera = Camera::default();
        let l = lane(&[[5.0, 0.0, 0.0], [20.0, 0.0, 1.0], [40.0, 1.0, 0.0], [60.0, 4.0, 3.0]]);
        let row = camera.rows.iter().position(|r| *r == 460).unwrap();
        // The ray of row 460 meets the rise first, where y = 0.
        assert_eq!(camera.columns(&l)[row], 640);
    }

    #[test]
    fn order_and_what_is_behind() {
        let camera = Camera::default();
        let at = |y: f64| lane(&[[-50.0, y, 0.0], [80.0, y, 0.0]]);
        let behind = lane(&[[-50.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
        let lanes = camera.lanes(&[at(-5.25), behind, at(5.25), at(1.75), at(-1.75)]);
        assert_eq!(lanes.len(), 4);
        let row = camera.rows.iter().position(|r| *r == 420).unwrap();
        let columns: Vec<i64> = lanes.iter().map(|l| l[row]).collect();
        assert!(columns.is_sorted() && columns[0] > 0, "{columns:?}");
    }

    #[test]
    fn cameras_that_are_none() {
        for broken in [
            Camera { focal_px: 0.0, ..Camera::default() },
            Camera { width_px: 0, ..Camera::default() },
            Camera { rows: vec![720], ..Camera::default() },
            Camera::new(640, 100, 500.0, DVec3::ZERO, 0.0),
            Camera::new(640, 480, 500.0, DVec3::new(f64::NAN, 0.0, 0.0), 0.0),
        ] {
            assert_eq!(broken.check().unwrap_err().exit_code(), 2, "{broken:?}");
        }
        Camera::default().check().unwrap();
    }
}
