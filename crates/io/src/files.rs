//! The files of one frame; their names, shapes and columns are a public interface.

use super::echo_file;
use catseye::base::error::{Error, Result};
use catseye::detect::files::{write_angle_cells, write_echoes, write_points, write_rows};
use catseye::detect::grid::PointGrid;
use catseye::detect::points::Point;
use catseye::detect::spectra::angle_spectra;
use catseye::dsp::cpu::threshold;
use catseye::dsp::doa_beamform::Grid as Directions;
use catseye::dsp::{PowerMap, RangeDoppler};
use catseye::engine::{AnyCube, Engine, Stage, StageCounts};
use catseye::formats::npy;
use catseye::road::labels::RoadTruth;
use catseye::road::mask::{self, CellClass, Grid};
use catseye::road::near::LaneTruth;
use catseye::scene::Scene;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::Output;
use catseye::scene::scenario::SitedScenario;
use catseye::simulate::lidar::{self, scan};
pub use catseye::simulate::truth::{PoseRecord, Truth};
use catseye::simulate::{Frame, Stages, TracedFrame};
use catseye::trace::Echoes;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Name of the folder of a frame.
pub fn frame_name(index: u32) -> String {
    format!("frame_{index:06}")
}

/// Writes `adc.npy`: complex64 `[chirp, rx_virtual, sample]`.
///
/// # Errors
/// Returns an error if the file cannot be written.
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

/// Writes values of a map's cells as float32 power in W, `[doppler, range]`, with zero Doppler in the middle row: as `NAME.npy` for the first
/// ramp, and as `NAME_1.npy` and so on for the others.
fn write_map(dir: &Path, name: &str, ramp: usize, map: &PowerMap<f64>, power_w: &[f64]) -> Result<()> {
    let file = match ramp {
        0 => format!("{name}.npy"),
        i => format!("{name}_{i}.npy"),
    };
    let data: Vec<f32> = power_w.iter().map(|p| *p as f32).collect();
    npy::write(dir.join(file), &[map.doppler_bins, map.range_bins], &data)
}

/// Writes `cfar_threshold.npy` and so on: the power that each cell has to exceed to be detected.
fn write_thresholds(dir: &Path, radar: &Radar, maps: &[RangeDoppler<f64>]) -> Result<()> {
    for (i, found) in maps.iter().enumerate() {
        let part = radar.part(i);
        let threshold_w = threshold(&found.map, &part.processing.cfar, found.snapshots.channels)?;
        write_map(dir, "cfar_threshold", i, &found.map, &threshold_w)?;
    }
    Ok(())
}

/// Writes `angle_spectra.npy`, float32 `[cell, elevation, azimuth]`, and `angle_cells.csv`, a row for each of its cells; and for the other
/// ramps `angle_spectra_1.npy`, `angle_cells_1.csv` and so on.
///
/// # Errors
/// Returns an error if the radar's angle method has no spectrum, if the engine fails or a file cannot be written.
pub fn write_spectra(dir: &Path, engine: &Engine, radar: &Radar, frame: &Frame) -> Result<()> {
    let own = frame.pose.inverse().direction(frame.velocity_mps);
    for (i, spectra) in angle_spectra(engine, radar, &frame.maps, Some(own))?.iter().enumerate() {
        let end = if i == 0 { String::new() } else { format!("_{i}") };
        let shape = [spectra.cells.len(), spectra.grid.elevation_rad.len(), spectra.grid.azimuth_rad.len()];
        let values: Vec<f32> = spectra.values.iter().map(|v| *v as f32).collect();
        npy::write(dir.join(format!("angle_spectra{end}.npy")), &shape, &values)?;
        let path = dir.join(format!("angle_cells{end}.csv"));
        let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
        write_angle_cells(BufWriter::new(file), &spectra.cells).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}

/// Writes `range_doppler.npy` for the first ramp, and `range_doppler_1.npy` and so on for the others.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write_maps(dir: &Path, maps: &[RangeDoppler<f64>]) -> Result<()> {
    for (i, map) in maps.iter().enumerate() {
        write_map(dir, "range_doppler", i, &map.map, &map.map.data)?;
    }
    Ok(())
}

/// Writes `points.csv`.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_point_file(dir: &Path, points: &[Point]) -> Result<()> {
    let path = dir.join("points.csv");
    let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
    write_points(BufWriter::new(file), points).map_err(|e| Error::io(&path, e))?;
    Ok(())
}

/// What lies in the cells of a grid before a radar, and what its points tell of them.
pub struct FrameMask {
    /// `road` or `markers`.
    pub name: &'static str,
    /// The cells.
    pub grid: Grid,
    /// Numbers of [`CellClass`], `[row, column]`.
    pub classes: Vec<u8>,
    /// The frame's points in the order of [`PointGrid::planes`], `[plane, row, column]`.
    pub points: Vec<f32>,
}

/// The two grids of a frame; `lanes` as [`Truth`] has them.
pub fn masks(scene: &Scene, frame: &Frame, lanes: &[LaneTruth]) -> [FrameMask; 2] {
    let of = |name, grid, shown: &[CellClass]| FrameMask {
        name,
        grid,
        classes: mask::mask(&grid, scene, frame.time_s, &frame.pose, lanes, shown),
        points: PointGrid::new(grid, &frame.points, &frame.pose).planes(),
    };
    [of("road", Grid::ROAD, &mask::ROAD_CLASSES), of("markers", Grid::MARKERS, &mask::MARKER_CLASSES)]
}

/// Writes `mask_road.npy` and `mask_markers.npy`: uint8 `[row, column]`, the classes of
/// [`CellClass`] on the grids that [`Grid`] describes; and `grid_road.npy` and
/// `grid_markers.npy`: float32 `[plane, row, column]`, the frame's points on the same grids in the order of
/// [`PointGrid::planes`].
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write_masks(dir: &Path, scene: &Scene, frame: &Frame, truth: &Truth) -> Result<()> {
    for FrameMask { name, grid, classes, points } in masks(scene, frame, &truth.lanes) {
        npy::write(dir.join(format!("mask_{name}.npy")), &[grid.rows, grid.columns], &classes)?;
        npy::write(dir.join(format!("grid_{name}.npy")), &[4, grid.rows, grid.columns], &points)?;
    }
    Ok(())
}

/// Writes `lidar.csv`: what the scenario's ideal lidar sees at a time from the middle of frame 0, a row for each point with the
/// columns of [`lidar::columns`].
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_lidar(dir: &Path, scenario: &SitedScenario, scene: &Scene, time_s: f64) -> Result<()> {
    let path = dir.join("lidar.csv");
    let points = scan(&scenario.lidar, scene, &scenario.ego, time_s);
    let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
    write_rows(BufWriter::new(file), &lidar::columns(), &points).map_err(|e| Error::io(&path, e))?;
    Ok(())
}

/// Writes `return_places.npy`, float32 `[echo, bounce, 3]`: a row for each row of `returns.csv`, the places of its bounces in the order met,
/// sensor frame, m, and not a number after the last.
fn write_places(dir: &Path, echoes: &Echoes) -> Result<()> {
    let most = echoes.list.iter().map(|e| usize::from(e.bounces)).max().unwrap_or(0);
    let mut data = vec![f32::NAN; echoes.list.len() * most * 3];
    for (row, echo) in data.chunks_exact_mut((3 * most).max(1)).zip(&echoes.list) {
        let places = echo.places_m().unwrap_or_default();
        for (at, place) in row.chunks_exact_mut(3).zip(places) {
            at.copy_from_slice(&place.as_vec3().to_array());
        }
    }
    npy::write(dir.join("return_places.npy"), &[echoes.list.len(), most, 3], &data)
}

/// Writes the files that `output` selects, except the pictures and what [`write_masks`] and [`write_lidar`] write.
///
/// # Errors
/// Returns an error if a folder or file cannot be written.
pub fn write_frame(dir: &Path, output: &Output, radar: &Radar, frame: &Frame, truth: &Truth) -> Result<()> {
    if output.adc {
        write_cube(dir, frame.samples()?)?;
    }
    if output.range_doppler {
        write_maps(dir, &frame.maps)?;
    }
    if output.cfar_threshold {
        write_thresholds(dir, radar, &frame.maps)?;
    }
    if output.points {
        write_point_file(dir, &frame.points)?;
    }
    if output.returns {
        let path = dir.join("returns.csv");
        let file = File::create(&path).map_err(|e| Error::io(&path, e))?;
        write_echoes(BufWriter::new(file), radar, &frame.echoes).map_err(|e| Error::io(&path, e))?;
    }
    if output.return_places {
        write_places(dir, &frame.echoes)?;
    }
    if let Some(kept) = &frame.kept {
        echo_file::write(dir, kept)?;
    }
    if output.truth {
        let path = dir.join("truth.json");
        let text = serde_json::to_string_pretty(truth).map_err(|e| Error::Failed(format!("truth: {e}")))?;
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}

/// Sizes of the files of one radar's frame, bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameBytes {
    /// Size of samples, maps and masks.
    pub arrays: u64,
    /// Size of `points.csv`, `returns.csv` and `truth.json`.
    pub tables: u64,
    /// Size of the pictures.
    pub pictures: u64,
}

/// Size of the header of a NumPy file, bytes.
const HEADER_BYTES: u64 = 128;
/// A typical number of points of a road frame, as without samples the number is unknown.
const TYPICAL_POINTS: u64 = 64;
/// Size of the points of a frame: row size of `points.csv` times their number.
const POINTS_BYTES: u64 = 280 * TYPICAL_POINTS;
/// Size of the four pictures of a radar's frame of a road, bytes; each is 150 to 260 kB.
pub const PICTURES_BYTES: u64 = 740_000;

/// The counts of a frame whose points are labelled.
fn labelled() -> StageCounts {
    let mut ran = StageCounts::default();
    ran.count(Stage::Labels);
    ran
}

/// A writer that counts bytes and keeps nothing.
struct Counter(u64);

impl Write for Counter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Estimates the size on disk of the files of a frame from its echoes alone: arrays and echoes exactly, truth
/// nearly so, points and pictures as is typical for road frames.
///
/// # Errors
/// Returns an error if the truth cannot be serialized.
pub fn expected_bytes(
    scenario: &SitedScenario,
    scene: &Scene,
    which: usize,
    received: TracedFrame,
    road: Option<&RoadTruth>,
) -> Result<FrameBytes> {
    let (radar, o) = (&scenario.radars[which], &scenario.output);
    let mut bytes = FrameBytes::default();
    if o.adc {
        bytes.arrays += HEADER_BYTES + 8 * (radar.rows() * radar.channels() * radar.samples) as u64;
    }
    let map_bytes = HEADER_BYTES + 4 * (radar.doppler_rows() * radar.range_bins()) as u64;
    let maps = u64::from(o.range_doppler) + u64::from(o.cfar_threshold);
    bytes.arrays += maps * radar.waveform.parts() as u64 * map_bytes;
    if o.angle_spectra {
        let grid = Directions::new(radar)?;
        let directions = grid.azimuth_rad.len() * grid.elevation_rad.len();
        bytes.arrays +=
            radar.waveform.parts() as u64 * (HEADER_BYTES + 4 * TYPICAL_POINTS * directions as u64);
        bytes.tables += radar.waveform.parts() as u64 * 48 * TYPICAL_POINTS;
    }
    if o.masks {
        // A byte of the mask and four planes of f32.
        let cells = |g: &Grid| 2 * HEADER_BYTES + 17 * (g.rows * g.columns) as u64;
        bytes.arrays += cells(&Grid::ROAD) + cells(&Grid::MARKERS);
    }
    if o.points {
        bytes.tables += POINTS_BYTES;
    }
    if o.return_places {
        let most = received.echoes.list.iter().map(|e| u64::from(e.bounces)).max().unwrap_or(0);
        bytes.arrays += HEADER_BYTES + 12 * most * received.echoes.list.len() as u64;
    }
    if let Some(kept) = &received.kept {
        bytes.arrays += echo_file::table_bytes(kept);
    }
    // One lidar stands on the vehicle, however many radars there are.
    if o.lidar && which == 0 {
        let points = scan(&scenario.lidar, scene, &scenario.ego, received.time_s);
        let counter = write_rows(Counter(0), &lidar::columns(), &points);
        bytes.tables += counter.map_err(|e| Error::Failed(format!("lidar: {e}")))?.0;
    }
    if o.returns {
        let counter = write_echoes(Counter(0), radar, &received.echoes);
        bytes.tables += counter.map_err(|e| Error::Failed(format!("returns: {e}")))?.0;
    }
    if o.truth {
        let frame = Frame {
            index: 0,
            radar: which,
            time_s: received.time_s,
            pose: received.pose,
            velocity_mps: received.velocity_mps,
            triangles: received.triangles,
            echoes: received.echoes,
            kept: None,
            echo_summary: Default::default(),
            cube: None,
            maps: Vec::new(),
            points: Vec::new(),
            stages: Stages::default(),
            ran: match o.points {
                true => labelled(),
                false => StageCounts::default(),
            },
        };
        let mut counter = Counter(0);
        serde_json::to_writer_pretty(&mut counter, &Truth::new(scenario, scene, &frame, road))
            .map_err(|e| Error::Failed(format!("truth: {e}")))?;
        bytes.tables += counter.0;
    }
    if o.plots {
        bytes.pictures = PICTURES_BYTES;
    }
    Ok(bytes)
}
