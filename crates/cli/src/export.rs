//! `catseye export`: a run as files that other tools read.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye::formats::check_extension;
use catseye::formats::stage;
use catseye_export::sweeps::{Extras, Run};
use catseye_export::tusimple::{Camera, LaneFile};
use catseye_export::{Exporter, coco, kitti, nuscenes, pcd};
use clap::{Args, ValueEnum};
use glam::DVec3;
use std::path::PathBuf;

/// Export the frames of a run: nuScenes, KITTI and View-of-Delft, COCO, RadarScenes, MCAP, ASAM OSI, TuSimple
#[derive(Debug, Args)]
pub struct Export {
    /// Folder that `catseye simulate` wrote, with points and truth
    pub run: PathBuf,
    /// What to write
    #[arg(long)]
    pub format: Format,
    /// Folder (pcd, nuscenes, kitti, coco, radarscenes) or file (mcap, osi: a name in _sd.osi tells readers what it is,
    /// tusimple) to write
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// radarscenes, nuscenes: name of the sequence or scene
    #[arg(long, default_value = "sequence_1")]
    pub sequence: String,
    /// nuscenes: time between key frames, s; 0 makes every frame one
    #[arg(long, value_name = "S", default_value_t = 0.5, allow_hyphen_values = true)]
    pub key_interval_s: f64,
    #[command(flatten)]
    pub camera: CameraArgs,
}

/// The camera of TuSimple's lane lines and KITTI's labels. Default focal length and place are those of nuScenes' front camera.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera of TuSimple's lane lines and KITTI's labels")]
pub struct CameraArgs {
    /// tusimple, kitti: width and height of the picture, pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub camera_size: String,
    /// tusimple, kitti: focal length, pixels
    #[arg(long, value_name = "PX")]
    pub camera_focal_px: Option<f64>,
    /// tusimple, kitti: place in the vehicle (x forward from the rear axle, y left, z up)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera_position_m: Option<String>,
    /// tusimple, kitti: how far the optical axis points down
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub camera_pitch_deg: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// nuScenes radar point clouds, a PCD file for each sweep
    Pcd,
    /// A whole nuScenes data set: its thirteen tables, radar point clouds and a map; road users are annotated
    Nuscenes,
    /// KITTI's folders with View-of-Delft's radar points: points, labels in a camera, calibration, poses, splits
    Kitti,
    /// COCO annotations of the grids and masks that `[output] masks = true` writes
    Coco,
    /// radar_data.h5 and scenes.json
    Radarscenes,
    /// Foxglove point clouds, transforms, boxes and maps
    Mcap,
    /// ASAM OSI 3.8 SensorData, binary trace
    Osi,
    /// TuSimple lane lines, JSON lines
    Tusimple,
}

impl CameraArgs {
    fn camera(&self) -> Result<Camera> {
        let wrong = |key: &str, value: &str, allowed: &str| {
            BadInput::new("cannot be read").key(key).value(value).allowed(allowed)
        };
        let usual = Camera::default();
        let size =
            self.camera_size.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        let (width, height): (u32, u32) =
            size.ok_or_else(|| wrong("--camera-size", &self.camera_size, "WIDTHxHEIGHT, such as 1280x720"))?;
        let position = match &self.camera_position_m {
            None => usual.mounting.translation_m,
            Some(text) => {
                let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
                match numbers.as_deref() {
                    Some([x, y, z]) => DVec3::new(*x, *y, *z),
                    _ => return Err(wrong("--camera-position-m", text, "X,Y,Z, such as 1.7,0,1.5").into()),
                }
            }
        };
        // The same field of view at another size.
        let focal = usual.focal_px * f64::from(width) / f64::from(usual.width_px);
        let pitch = self.camera_pitch_deg.to_radians();
        Ok(Camera::new(width, height, self.camera_focal_px.unwrap_or(focal), position, pitch))
    }
}

/// What a build without a feature says.
#[cfg(not(all(feature = "hdf5", feature = "mcap", feature = "osi")))]
fn left_out(format: &str, feature: &str) -> catseye::base::error::Error {
    BadInput::new("this build does not have the format")
        .key("--format")
        .value(format)
        .remedy(format!("build with --features {feature}"))
        .into()
}

impl Export {
    // Only the pictures of maps look ahead into the run.
    #[cfg_attr(not(feature = "mcap"), allow(unused_variables))]
    fn exporter(&self, run: &Run, force: bool) -> Result<Box<dyn Exporter>> {
        Ok(match self.format {
            Format::Pcd => Box::new(pcd::Clouds::create(&self.output, force)?),
            Format::Nuscenes => {
                let settings =
                    nuscenes::Settings { scene: self.sequence.clone(), key_interval_s: self.key_interval_s };
                Box::new(nuscenes::Tables::create(&self.output, settings, force)?)
            }
            Format::Kitti => Box::new(kitti::Folder::create(&self.output, self.camera.camera()?, force)?),
            Format::Coco => Box::new(coco::Folder::create(&self.output, force)?),
            Format::Tusimple => Box::new(LaneFile::create(&self.output, self.camera.camera()?, force)?),
            #[cfg(feature = "hdf5")]
            Format::Radarscenes => {
                use catseye_export::radarscenes::Sequence;
                Box::new(Sequence::create(&self.output, &self.sequence, force)?)
            }
            #[cfg(not(feature = "hdf5"))]
            Format::Radarscenes => return Err(left_out("radarscenes", "hdf5")),
            #[cfg(feature = "mcap")]
            Format::Mcap => {
                use catseye_export::mcap::Recording;
                // A run without maps has no pictures.
                let white_dbm = run.highest_dbm()?.unwrap_or(0.0);
                Box::new(Recording::create(&self.output, white_dbm, force)?)
            }
            #[cfg(not(feature = "mcap"))]
            Format::Mcap => return Err(left_out("mcap", "mcap")),
            #[cfg(feature = "osi")]
            Format::Osi => Box::new(catseye_export::osi::Trace::create(&self.output, force)?),
            #[cfg(not(feature = "osi"))]
            Format::Osi => return Err(left_out("osi", "osi")),
        })
    }

    pub fn run(&self, global: &Global) -> Result<()> {
        stage::distinct(&[&self.output], &[&self.run])?;
        match self.format {
            Format::Pcd | Format::Nuscenes | Format::Kitti | Format::Coco | Format::Radarscenes => {}
            Format::Mcap => check_extension(&self.output, &["mcap"])?,
            Format::Osi => check_extension(&self.output, &["osi"])?,
            Format::Tusimple => check_extension(&self.output, &["json", "jsonl"])?,
        }
        let run = Run::open(&self.run)?;
        let mut exporter = self.exporter(&run, global.force)?;
        let bar = global.bar("sweeps", run.len() as u64, Kept::Nothing);
        let extras = Extras {
            map: self.format == Format::Mcap,
            grids: self.format == Format::Coco,
            lidar: matches!(self.format, Format::Kitti | Format::Nuscenes),
        };
        for at in 0..run.len() {
            exporter.push(&run.sweep(at, extras)?)?;
            bar.inc(1);
        }
        drop(bar);
        let report = exporter.finish()?;
        if global.json {
            return print_json(&report);
        }
        for note in &report.notes {
            global.say(note);
        }
        print(&format!(
            "{} sweeps, {} points; wrote {}",
            report.sweeps,
            report.points,
            report.output.display()
        ))
    }
}
