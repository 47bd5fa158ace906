//! The files of one frame (their names, shapes and columns are what users rely on).

use catseye::detect::files::{write_echoes, write_points};
use catseye::detect::grid::PointGrid;
use catseye::detect::points::Point;
use catseye::dsp::{PowerMap, RangeDoppler};
use catseye::engine::AnyCube;
use catseye::error::{Error, Result};
use catseye::formats::npy;
use catseye::road::mask::{self, Grid};
use catseye::scene::Scene;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::Output;
use catseye::simulate::Frame;
pub use catseye::simulate::truth::{PoseRecord, Truth};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Folder of a frame.
pub fn frame_name(index: u32) -> String {
    format!("frame_{index:06}")
}

/// `adc.npy`: complex64 `[chirp, rx_virtual, sample]`.
///
/// # Errors
/// What the disk says.
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
///
/// # Errors
/// What the disk says.
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
///
/// # Errors
/// What the disk says.
pub fn write_point_file(dir: &Path, points: &[Point]) -> Result<()> {
    let path = dir.join("points.csv");
    let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
    write_points(BufWriter::new(file), points).map_err(|e| Error::io(&path, e))?;
    Ok(())
}

/// `mask_road.npy` and `mask_markers.npy`: uint8 `[row, column]`, the classes of [`CellClass`](mask::CellClass) on the grids that [`Grid`] describes;
/// `grid_road.npy` and `grid_markers.npy`: float32 `[plane, row, column]`, the frame's points on the same grids as
/// [`PointGrid::planes`] orders them.
///
/// # Errors
/// What the disk says.
pub fn write_masks(dir: &Path, scene: &Scene, frame: &Frame, truth: &Truth) -> Result<()> {
    for (name, grid, classes) in
        [("road", Grid::ROAD, &mask::ROAD_CLASSES), ("markers", Grid::MARKERS, &mask::MARKER_CLASSES)]
    {
        let cells = mask::mask(&grid, scene, frame.time_s, &frame.pose, &truth.lanes, classes);
        npy::write(dir.join(format!("mask_{name}.npy")), &[grid.rows, grid.columns], &cells)?;
        let planes = PointGrid::new(grid, &frame.points, &frame.pose).planes();
        npy::write(dir.join(format!("grid_{name}.npy")), &[4, grid.rows, grid.columns], &planes)?;
    }
    Ok(())
}

/// Writes the files that `output` asks for, but the pictures and what [`write_masks`] writes.
///
/// # Errors
/// What the disk says.
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
        write_echoes(BufWriter::new(file), radar, &frame.echoes).map_err(|e| Error::io(&path, e))?;
    }
    if output.truth {
        let path = dir.join("truth.json");
        let text = serde_json::to_string_pretty(truth).map_err(|e| Error::Failed(format!("truth: {e}")))?;
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}
