//! The files of one frame (their names, shapes and columns are what users rely on).

use super::frame::Frame;
use crate::detect::files::{write_points, write_returns};
use crate::detect::points::Point;
use crate::dsp::{PowerMap, RangeDoppler};
use crate::engine::AnyCube;
use crate::error::{Error, Result};
use crate::formats::npy;
use crate::road::{LaneLine, TruthBox, truth_boxes};
use crate::scene::Scene;
use crate::scene::radar::Radar;
use crate::scene::scenario::{Output, Scenario};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Folder of a frame.
pub fn frame_name(index: u32) -> String {
    format!("frame_{index:06}")
}

/// `adc.npy`: complex64 `[chirp, rx_virtual, sample]`.
pub fn write_cube(dir: &Path, cube: &AnyCube) -> Result<()> {
    let rounded;
    let cube = match cube {
        AnyCube::F32(c) => c,
        AnyCube::F64(c) => {
            rounded = c.to_f32();
            &rounded
        }
    };
    npy::write(dir.join("adc.npy"), &[cube.chirps, cube.channels, cube.samples], &cube.data)
}

/// float32 power in W, `[doppler, range]`, zero Doppler in the middle row.
fn write_map(path: &Path, map: &PowerMap<f64>) -> Result<()> {
    let data: Vec<f32> = map.data.iter().map(|p| *p as f32).collect();
    npy::write(path, &[map.doppler_bins, map.range_bins], &data)
}

/// `range_doppler.npy` of the first ramp, `range_doppler_1.npy` and so on of the others.
pub fn write_maps(dir: &Path, maps: &[RangeDoppler<f64>]) -> Result<()> {
    for (i, map) in maps.iter().enumerate() {
        let name = match i {
            0 => "range_doppler.npy".to_string(),
            i => format!("range_doppler_{i}.npy"),
        };
        write_map(&dir.join(name), &map.map)?;
    }
    Ok(())
}

/// `points.csv`.
pub fn write_point_file(dir: &Path, points: &[Point]) -> Result<()> {
    let path = dir.join("points.csv");
    let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
    write_points(BufWriter::new(file), points).map_err(|e| Error::io(&path, e))?;
    Ok(())
}

/// Position and rotation of a frame of reference in the world.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PoseRecord {
    pub position_m: [f64; 3],
    /// Quaternion x, y, z, w: rotates from the frame to the world.
    pub rotation_xyzw: [f64; 4],
    pub velocity_mps: [f64; 3],
}

/// `truth.json`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Truth {
    pub frame: u32,
    /// Middle of the frame, from the middle of frame 0.
    pub time_s: f64,
    pub ego: PoseRecord,
    pub radar: PoseRecord,
    /// Boxes of all objects, in the world.
    pub boxes: Vec<TruthBox>,
    /// Known for built-in roads.
    pub lanes: Vec<LaneLine>,
    /// Ids of the objects of class `marker`.
    pub markers: Vec<u32>,
}

impl Truth {
    pub fn new(scenario: &Scenario, scene: &Scene, frame: &Frame, lanes: &[LaneLine]) -> Truth {
        let ego = scenario.ego.pose(frame.time_s);
        let velocity_mps = frame.velocity_mps.to_array();
        Truth {
            frame: frame.index,
            time_s: frame.time_s,
            ego: PoseRecord {
                position_m: ego.translation_m.to_array(),
                rotation_xyzw: ego.rotation.to_array(),
                velocity_mps,
            },
            radar: PoseRecord {
                position_m: frame.pose.translation_m.to_array(),
                rotation_xyzw: frame.pose.rotation.to_array(),
                velocity_mps,
            },
            boxes: truth_boxes(scene, frame.time_s),
            lanes: lanes.to_vec(),
            markers: scene.objects.iter().filter(|o| o.class == "marker").map(|o| o.id).collect(),
        }
    }
}

/// Writes the files that `output` asks for, but the pictures.
pub fn write_frame(dir: &Path, output: &Output, radar: &Radar, frame: &Frame, truth: &Truth) -> Result<()> {
    if output.adc {
        write_cube(dir, &frame.cube)?;
    }
    if output.range_doppler {
        write_maps(dir, &frame.maps)?;
    }
    if output.points {
        write_point_file(dir, &frame.points)?;
    }
    if output.returns {
        let path = dir.join("returns.csv");
        let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
        write_returns(BufWriter::new(file), radar, &frame.returns).map_err(|e| Error::io(&path, e))?;
    }
    if output.truth {
        let path = dir.join("truth.json");
        let text = serde_json::to_string_pretty(truth).map_err(|e| Error::Failed(format!("truth: {e}")))?;
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}
