//! `catseye export`: a run or a dataset as files that other tools read.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::check_extension;
use catseye::formats::stage;
use catseye_export::sweeps::{Extras, Run, Sweeps};
use catseye_export::tusimple::{Camera, LaneFile};
use catseye_export::{Exporter, Finished, coco, dataset, kitti, nuscenes, pcd};
use catseye_io::dataset::DATASET;
use clap::{Args, ValueEnum};
use glam::DVec3;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Export the frames of a run or a dataset to nuScenes, KITTI and View-of-Delft, COCO, RadarScenes, MCAP, ASAM OSI, TuSimple
#[derive(Debug, Args)]
pub struct Export {
    /// Folder written by `catseye simulate` or `catseye dataset`, with points and truth
    pub run: PathBuf,
    /// Format to write
    #[arg(long)]
    pub format: Format,
    /// Folder (pcd, nuscenes, kitti, coco, radarscenes) or file (mcap, osi: a name that ends in _sd.osi
    /// identifies its contents to readers, tusimple) to write
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// radarscenes, nuscenes: name of the sequence or scene
    #[arg(long, default_value = "sequence_1")]
    pub sequence: String,
    /// nuscenes: time between key frames, s; 0: every frame is a key frame
    #[arg(long, value_name = "S", default_value_t = 0.5, allow_hyphen_values = true)]
    pub key_interval_s: f64,
    /// Dataset: scene to export (default: all scenes, as scene_000000 and so on, in formats that write a folder)
    #[arg(long, value_name = "N")]
    pub scene: Option<u32>,
    #[command(flatten)]
    pub camera: CameraArgs,
}

/// The camera of TuSimple's lane lines and KITTI's labels. Default focal length and place are those of nuScenes' front camera.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera of TuSimple's lane lines and KITTI's labels")]
pub struct CameraArgs {
    /// tusimple, kitti: width and height of the image, pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub camera_size: String,
    /// tusimple, kitti: focal length, pixels
    #[arg(long, value_name = "PX")]
    pub camera_focal_px: Option<f64>,
    /// tusimple, kitti: position on the vehicle, m (x forward from the rear axle, y left, z up)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera_position_m: Option<String>,
    /// tusimple, kitti: pitch of the optical axis, positive downwards
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub camera_pitch_deg: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// nuScenes radar point clouds, a PCD file for each sweep
    Pcd,
    /// A complete nuScenes dataset: thirteen tables, radar point clouds and a map; road users are annotated
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
    fn exporter(&self, run: &dyn Sweeps, output: &Path, force: bool) -> Result<Box<dyn Exporter>> {
        Ok(match self.format {
            Format::Pcd => Box::new(pcd::Clouds::create(output, force)?),
            Format::Nuscenes => {
                let settings =
                    nuscenes::Settings { scene: self.sequence.clone(), key_interval_s: self.key_interval_s };
                Box::new(nuscenes::Tables::create(output, settings, force)?)
            }
            Format::Kitti => Box::new(kitti::Folder::create(output, self.camera.camera()?, force)?),
            Format::Coco => Box::new(coco::Folder::create(output, force)?),
            Format::Tusimple => Box::new(LaneFile::create(output, self.camera.camera()?, force)?),
            #[cfg(feature = "hdf5")]
            Format::Radarscenes => {
                use catseye_export::radarscenes::Sequence;
                Box::new(Sequence::create(output, &self.sequence, force)?)
            }
            #[cfg(not(feature = "hdf5"))]
            Format::Radarscenes => return Err(left_out("radarscenes", "hdf5")),
            #[cfg(feature = "mcap")]
            Format::Mcap => {
                use catseye_export::mcap::Recording;
                // A run without maps has no pictures.
                let white_dbm = run.highest_dbm()?.unwrap_or(0.0);
                Box::new(Recording::create(output, white_dbm, force)?)
            }
            #[cfg(not(feature = "mcap"))]
            Format::Mcap => return Err(left_out("mcap", "mcap")),
            #[cfg(feature = "osi")]
            Format::Osi => Box::new(catseye_export::osi::Trace::create(output, force)?),
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
        if !self.run.join(DATASET).is_file() {
            if let Some(scene) = self.scene {
                return Err(BadInput::new("applies to datasets only, and this is a run")
                    .key("--scene")
                    .value(scene)
                    .remedy("leave it out")
                    .into());
            }
            return self.one(&Run::open(&self.run)?, global);
        }
        if let Some(scene) = self.scene {
            return self.one(&dataset::Scene::open(&self.run, scene)?, global);
        }
        let scenes = dataset::scenes(&self.run)?;
        if matches!(self.format, Format::Mcap | Format::Osi | Format::Tusimple) {
            if scenes == 1 {
                return self.one(&dataset::Scene::open(&self.run, 0)?, global);
            }
            return Err(BadInput::new("a file of this format holds one scene, and the dataset has several")
                .key("--scene")
                .allowed(format!("0 to {}", scenes.saturating_sub(1)))
                .remedy("choose one, as in --scene 0")
                .into());
        }
        std::fs::create_dir_all(&self.output).map_err(|e| Error::io(&self.output, e))?;
        let scene = |scene| {
            let output = self.output.join(format!("scene_{scene:06}"));
            self.write(&dataset::Scene::open(&self.run, scene)?, &output, global)
        };
        let reports = (0..scenes).map(scene).collect::<Result<Vec<_>>>()?;
        if global.json {
            let output = self.output.to_string_lossy();
            return print_json(&serde_json::json!({ "output": output, "scenes": reports }));
        }
        let count = |of: fn(&Finished) -> u64| reports.iter().map(of).sum::<u64>();
        print(&format!(
            "{scenes} scenes, {} sweeps, {} points; wrote {}",
            count(|r| r.sweeps as u64),
            count(|r| r.points as u64),
            self.output.display()
        ))
    }

    /// Writes the sweeps of a run or of a scene.
    fn write(&self, run: &dyn Sweeps, output: &Path, global: &Global) -> Result<Finished> {
        let mut exporter = self.exporter(run, output, global.force)?;
        let bar = global.bar("sweeps", run.len() as u64, Kept::Nothing);
        let extras = Extras {
            map: self.format == Format::Mcap,
            grids: self.format == Format::Coco,
            lidar: matches!(self.format, Format::Kitti | Format::Nuscenes),
        };
        let mut missing = BTreeSet::new();
        for at in 0..run.len() {
            let sweep = run.sweep(at, extras)?;
            missing.extend(sweep.missing_flags.iter().copied());
            exporter.push(&sweep)?;
            bar.inc(1);
        }
        drop(bar);
        let mut report = exporter.finish()?;
        if !missing.is_empty() {
            let names: Vec<&str> = missing.into_iter().collect();
            report.notes.push(format!(
                "made by an older version: points without {} count as on their objects",
                names.join(" and ")
            ));
        }
        if !global.json {
            report.notes.iter().for_each(|note| global.say(note));
        }
        Ok(report)
    }

    /// Writes one run or scene, and prints its report.
    fn one(&self, run: &dyn Sweeps, global: &Global) -> Result<()> {
        let report = self.write(run, &self.output, global)?;
        if global.json {
            return print_json(&report);
        }
        print(&format!(
            "{} sweeps, {} points; wrote {}",
            report.sweeps,
            report.points,
            report.output.display()
        ))
    }
}
