//! The chain on the GPU: one submission from the cube to the detected cells, with the spectrum left
//! there.

use super::device_spectrum::DeviceSpectrum;
use super::peaks;
use super::transform::Transform;
use super::{
    Cell, Detection, PowerMap, RangeDoppler, Snapshots, Spectrum, cfar, cfar_noise, cfar_window, power,
    snapshot, spectrum,
};

use crate::adc::{Cube, DeviceCube};
use crate::base::error::{Error, Result};
use crate::gpu::{Buffer, Done, Gpu, Pending, Recorder};
use crate::scene::radar::{Cfar, Radar};
use num_complex::Complex32;

pub(super) fn too_many(count: usize, limit: usize) -> Error {
    Error::Failed(format!(
        "{count} cells are detected, but a buffer of the adapter holds the channels of {limit} only"
    ))
}

pub(super) fn detection(mask: Vec<u32>, columns: &[cfar_window::Column]) -> Detection<f32> {
    Detection { mask: mask.iter().map(|m| *m != 0).collect(), ratio: cfar::ratios(columns) }
}

/// The detector alone, on a map from the host: the twin of the cpu engine's `detect`.
///
/// # Errors
/// Returns an error for a map or cube that does not fit the settings, or if the adapter fails.
pub fn detect(gpu: &Gpu, map: &PowerMap<f32>, cfar: &Cfar, channels: usize) -> Result<Detection<f32>> {
    cfar::check_map(map)?;
    let columns = cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    let mut recorder = gpu.recorder("cfar");
    let buffer = recorder.upload("map", &map.data);
    let mask = cfar::record(&mut recorder, &buffer, [map.doppler_bins, map.range_bins], cfar, &columns)?;
    let mask = recorder.read(&mask);
    let mut done = recorder.submit()?;
    Ok(detection(done.take(mask), &columns))
}

/// The noise in W in these cells, on a map from the host: the twin of the cpu engine's `noise`.
///
/// # Errors
/// Returns an error for a map or cube that does not fit the settings, or if the adapter fails.
pub fn noise(
    gpu: &Gpu,
    map: &PowerMap<f32>,
    cfar: &Cfar,
    channels: usize,
    cells: &[Cell],
) -> Result<Vec<f32>> {
    cfar::check_map(map)?;
    cfar::check_cells(map, cells)?;
    cfar::check_window(cfar)?;
    let columns = cfar::columns(cfar, channels, map.doppler_bins, map.range_bins)?;
    let mut recorder = gpu.recorder("cfar noise");
    let buffer = recorder.upload("map", &map.data);
    let at = |c: &Cell| c.doppler * map.range_bins as u32 + c.range;
    let list: Vec<u32> = std::iter::once(cells.len() as u32).chain(cells.iter().map(at)).collect();
    let list = recorder.upload("cells", &list);
    let size = [map.doppler_bins, map.range_bins];
    let noise = cfar_noise::record(&mut recorder, &buffer, size, cfar, &columns, &list);
    let noise = recorder.read(&noise);
    Ok(recorder.submit()?.take(noise))
}

/// The power map of a spectrum from the host, to the bit as [`process`] makes it of its own.
///
/// # Errors
/// Returns an error for a spectrum that is not of the transform's shape, or if the adapter fails.
pub fn power(gpu: &Gpu, spectrum: &Spectrum<f32>, t: &Transform) -> Result<PowerMap<f32>> {
    let mut recorder = gpu.recorder("power");
    let on_device = DeviceSpectrum::upload(&mut recorder, gpu, spectrum, t)?;
    let map = power::record(&mut recorder, &on_device);
    let map = recorder.read(&map);
    let data = recorder.submit()?.take(map);
    Ok(PowerMap { doppler_bins: spectrum.doppler_bins, range_bins: spectrum.range_bins, data })
}

/// Room for this many detected cells; a frame with more costs a second, small submission.
pub const CELLS: usize = 4096;

/// Processes a cube to detected cells in one submission: the twin of the cpu engine's `process`.
///
/// # Errors
/// Returns an error if the cube's shape is not the radar's, a setting is out of its range, a sample is not finite, or
/// the adapter fails.
pub fn process(gpu: &Gpu, cube: &Cube<f32>, radar: &Radar) -> Result<(DeviceSpectrum, RangeDoppler<f32>)> {
    process_by(gpu, cube, &Transform::of_cube(cube, radar)?, &radar.processing.cfar)
}

/// Processes a cube as [`process`], with the transform and the detector that are given.
///
/// # Errors
/// Returns the errors of [`process`].
pub fn process_by(
    gpu: &Gpu,
    cube: &Cube<f32>,
    transform: &Transform,
    cfar: &Cfar,
) -> Result<(DeviceSpectrum, RangeDoppler<f32>)> {
    let mut recorder = gpu.recorder("processing");
    let spectrum = spectrum::record(&mut recorder, gpu, cube, transform)?;
    let recorded = Recorded::new(&mut recorder, gpu, spectrum, cfar, CELLS)?;
    recorded.take(gpu, &mut recorder.submit()?)
}

/// Records [`process`] for a cube that earlier commands of the recorder leave on the device. When the recorder has been submitted,
/// [`Recorded::take`] gives the results.
///
/// # Errors
/// Returns an error for a map or cube that does not fit the settings, or if the adapter fails.
pub fn record<'a>(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &DeviceCube,
    transform: &Transform,
    cfar: &'a Cfar,
) -> Result<Recorded<'a>> {
    let spectrum = spectrum::record_device(recorder, gpu, cube, transform)?;
    Recorded::new(recorder, gpu, spectrum, cfar, CELLS)
}

/// Records as [`record`], with room for `cells` detected cells, and gives up what the frame has on the device: its memory serves later
/// commands of the recorder.
///
/// # Errors
/// Returns the errors of [`record`].
pub fn record_with_room(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &DeviceCube,
    transform: &Transform,
    cfar: &Cfar,
    cells: usize,
) -> Result<PendingFrame> {
    let spectrum = spectrum::record_device(recorder, gpu, cube, transform)?;
    Ok(Recorded::new(recorder, gpu, spectrum, cfar, cells)?.pending)
}

/// [`process_by`] to the power map alone, without a detector.
///
/// # Errors
/// Returns the errors of [`process`].
pub fn map_by(gpu: &Gpu, cube: &Cube<f32>, transform: &Transform) -> Result<RangeDoppler<f32>> {
    let mut recorder = gpu.recorder("map");
    let spectrum = spectrum::record(&mut recorder, gpu, cube, transform)?;
    let pending = PendingMap::new(&mut recorder, &spectrum);
    pending.take(&mut recorder.submit()?)
}

/// Records the power map of a cube that earlier commands of the recorder leave on the device.
///
/// # Errors
/// Returns an error for a cube that does not fit the transform.
pub fn record_map(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    cube: &DeviceCube,
    transform: &Transform,
) -> Result<PendingMap> {
    let spectrum = spectrum::record_device(recorder, gpu, cube, transform)?;
    Ok(PendingMap::new(recorder, &spectrum))
}

/// A power map without cells, recorded and not yet submitted.
pub struct PendingMap {
    size: [usize; 2],
    channels: usize,
    map: Pending<f32>,
}

impl PendingMap {
    fn new(recorder: &mut Recorder<'_>, spectrum: &DeviceSpectrum) -> PendingMap {
        let map = power::record(recorder, spectrum);
        let size = [spectrum.doppler_bins, spectrum.range_bins];
        PendingMap { size, channels: spectrum.channels, map: recorder.read(&map) }
    }

    /// Takes the map from the submission of the recorder.
    ///
    /// # Errors
    /// Returns an error for samples that are not finite.
    pub fn take(self, done: &mut Done) -> Result<RangeDoppler<f32>> {
        let PendingMap { size: [doppler_bins, range_bins], channels, map } = self;
        let map = PowerMap { doppler_bins, range_bins, data: done.take(map) };
        cfar::check_map(&map)?;
        Ok(RangeDoppler::of_map(map, channels))
    }
}

/// A frame's processing, recorded and not yet submitted.
pub struct Recorded<'a> {
    found: DetectionRun<'a>,
    pending: PendingFrame,
}

impl<'a> Recorded<'a> {
    fn new(
        recorder: &mut Recorder<'_>,
        gpu: &Gpu,
        spectrum: DeviceSpectrum,
        cfar: &'a Cfar,
        cells: usize,
    ) -> Result<Recorded<'a>> {
        let size = [spectrum.doppler_bins, spectrum.range_bins];
        let channels = spectrum.channels;
        let columns = cfar::columns(cfar, channels, size[0], size[1])?;
        let map = power::record(recorder, &spectrum);
        let mask = cfar::record(recorder, &map, size, cfar, &columns)?;
        let limit = (gpu.max_binding_bytes() as usize / (8 * channels)).max(1);
        let found = DetectionRun { cfar, columns: columns.clone(), spectrum, map, mask };
        let cells = found.record(recorder, cells.min(limit));
        let (map, mask) = (recorder.read(&found.map), recorder.read(&found.mask));
        Ok(Recorded { found, pending: PendingFrame { columns, size, channels, cells, map, mask, limit } })
    }

    /// Takes the results from the submission of the recorder. More cells than there was room for take a second, small submission.
    ///
    /// # Errors
    /// Returns an error for samples that are not finite, or if the adapter fails.
    pub fn take(self, gpu: &Gpu, done: &mut Done) -> Result<(DeviceSpectrum, RangeDoppler<f32>)> {
        let Recorded { found, pending } = self;
        let mut frame = pending.read_back(done)?;
        if frame.is_short() {
            let mut recorder = gpu.recorder("detected cells");
            let pending = found.record(&mut recorder, frame.count());
            frame.cells = pending.take(&mut recorder.submit()?);
        }
        Ok((found.spectrum, frame.complete()))
    }
}

/// What comes back of a frame's processing, recorded and not yet submitted.
pub struct PendingFrame {
    columns: Vec<cfar_window::Column>,
    /// Rows and columns of the map.
    size: [usize; 2],
    channels: usize,
    cells: PendingCells,
    map: Pending<f32>,
    mask: Pending<u32>,
    /// Most cells whose channels fit a buffer of the adapter.
    limit: usize,
}

/// What [`PendingFrame::take`] finds.
pub enum TakenFrame {
    /// The frame's map and cells.
    Whole(Box<RangeDoppler<f32>>),
    /// More cells than there was room for: their number, with which the frame has to be recorded again.
    Crowded(usize),
}

impl PendingFrame {
    /// Takes the results from the submission of the recorder.
    ///
    /// # Errors
    /// Returns an error for samples that are not finite, or for more cells than the adapter can hold.
    pub fn take(self, done: &mut Done) -> Result<TakenFrame> {
        let frame = self.read_back(done)?;
        Ok(match frame.is_short() {
            true => TakenFrame::Crowded(frame.count()),
            false => TakenFrame::Whole(Box::new(frame.complete())),
        })
    }

    fn read_back(self, done: &mut Done) -> Result<DetectedFrame> {
        let PendingFrame { columns, size, channels, cells, map, mask, limit } = self;
        let map = PowerMap { doppler_bins: size[0], range_bins: size[1], data: done.take(map) };
        cfar::check_map(&map)?;
        let (cells, mask) = (cells.take(done), done.take(mask));
        match cells.list[0] as usize {
            count if count > limit.max(cells.list.len() - 1) => Err(too_many(count, limit)),
            _ => Ok(DetectedFrame { columns, channels, map, mask, cells }),
        }
    }
}

/// What came back of a frame.
struct DetectedFrame {
    columns: Vec<cfar_window::Column>,
    channels: usize,
    map: PowerMap<f32>,
    mask: Vec<u32>,
    cells: ListedCells,
}

impl DetectedFrame {
    /// Number of cells that the detector found.
    fn count(&self) -> usize {
        self.cells.list[0] as usize
    }

    /// Whether there was no room for all cells.
    fn is_short(&self) -> bool {
        self.count() > self.cells.list.len() - 1
    }

    fn complete(self) -> RangeDoppler<f32> {
        let DetectedFrame { columns, channels, map, mask, cells } = self;
        let detection = detection(mask, &columns);
        let (cells, noise, snapshots) = cells.sorted(&map, channels);
        RangeDoppler { map, detection, cells, noise, snapshots }
    }
}

/// Buffers and settings of one detection, from which the list of cells is made.
struct DetectionRun<'a> {
    cfar: &'a Cfar,
    columns: Vec<cfar_window::Column>,
    spectrum: DeviceSpectrum,
    map: Buffer<f32>,
    mask: Buffer<u32>,
}

struct PendingCells {
    list: Pending<u32>,
    noise: Pending<f32>,
    channels: Pending<Complex32>,
}

impl DetectionRun<'_> {
    fn record(&self, recorder: &mut Recorder<'_>, capacity: usize) -> PendingCells {
        let size = [self.spectrum.doppler_bins, self.spectrum.range_bins];
        let list = peaks::record(recorder, &self.map, &self.mask, size, capacity);
        let noise = cfar_noise::record(recorder, &self.map, size, self.cfar, &self.columns, &list);
        let channels = snapshot::record(recorder, &self.spectrum, &list);
        PendingCells {
            list: recorder.read(&list),
            noise: recorder.read(&noise),
            channels: recorder.read(&channels),
        }
    }
}

impl PendingCells {
    fn take(self, done: &mut Done) -> ListedCells {
        ListedCells {
            list: done.take(self.list),
            noise: done.take(self.noise),
            channels: done.take(self.channels),
        }
    }
}

/// Cells in the order of the map.
pub(super) struct ListedCells {
    /// How many there are, then doppler x range bins + range of each.
    pub list: Vec<u32>,
    pub noise: Vec<f32>,
    pub channels: Vec<Complex32>,
}

impl ListedCells {
    /// The cells with their powers and snapshots, strongest first.
    pub fn sorted(&self, map: &PowerMap<f32>, channels: usize) -> (Vec<Cell>, Vec<f32>, Snapshots<f32>) {
        let list = &self.list[1..=self.list[0] as usize];
        let mut order: Vec<usize> = (0..list.len()).collect();
        // The list is in the order of the map, which a stable sort keeps among equals.
        order.sort_by(|a, b| map.data[list[*b] as usize].total_cmp(&map.data[list[*a] as usize]));
        let columns = map.range_bins as u32;
        let cell = |at: u32| Cell { doppler: at / columns, range: at % columns };
        let row = |i: &usize| self.channels[i * channels..(i + 1) * channels].iter().copied();
        (
            order.iter().map(|i| cell(list[*i])).collect(),
            order.iter().map(|i| self.noise[*i]).collect(),
            Snapshots { channels, data: order.iter().flat_map(row).collect() },
        )
    }
}
