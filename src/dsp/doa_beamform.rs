//! Bartlett beamformer over the virtual array: grid, steering matrix, peaks, and the host side of the
//! kernel (CONVENTIONS eq. 19).

use super::peaks::parabola;
use super::{Real, Snapshots, window};
use crate::base::error::{BadInput, Result};
use crate::base::frames::direction_from_angles;
use crate::base::units::wavenumber;
use crate::gpu::{Access, Gpu, Kernel, Pending, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::{Antenna, Radar};
use glam::DVec3;
use num_complex::{Complex, Complex32, Complex64};
use std::f64::consts::{FRAC_PI_2, TAU};

/// An array shorter than this, in wavelengths, does not tell directions apart.
const BLIND_APERTURE: f64 = 1e-3;

/// Directions that are looked at. Both axes are uniform in the *sine* of the angle, from -sin(fov)
/// to +sin(fov): a beam of a planar array is as wide in sines everywhere, so that no part of the
/// field of view is sampled finer than another. One bin stands at angle 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Azimuths of the columns, rad.
    pub azimuth_rad: Vec<f64>,
    /// Elevations of the rows, rad.
    pub elevation_rad: Vec<f64>,
}

impl Grid {
    /// An axis along which all channels of the radar stand at one place has one bin, at angle 0, however many are
    /// asked for: there every angle looks the same.
    ///
    /// # Errors
    /// Returns an error if there are no bins, or for a field of view outside 0..=90 degrees to each side.
    pub fn new(radar: &Radar) -> Result<Self> {
        let p = &radar.processing;
        let resolved = |bins: usize, along: fn(DVec3) -> f64| {
            let extent = |antennas: &[Antenna]| {
                let at = || antennas.iter().map(|a| along(a.position_m));
                at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
            };
            let blind = extent(&radar.tx) + extent(&radar.rx) < BLIND_APERTURE * radar.wavelength_m();
            if blind { bins.min(1) } else { bins }
        };
        let azimuth_bins = resolved(p.azimuth_bins, |p| p.y);
        let elevation_bins = resolved(p.elevation_bins, |p| p.z);
        Ok(Grid {
            azimuth_rad: sine_axis("azimuth", azimuth_bins, p.azimuth_fov_rad)?,
            elevation_rad: sine_axis("elevation", elevation_bins, p.elevation_fov_rad)?,
        })
    }

    /// Number of directions.
    pub fn len(&self) -> usize {
        self.azimuth_rad.len() * self.elevation_rad.len()
    }

    /// Whether there is no direction.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn sine_axis(name: &str, bins: usize, fov: f64) -> Result<Vec<f64>> {
    if bins == 0 {
        return Err(BadInput::new("the beamformer needs at least one bin")
            .key(format!("processing.{name}_bins"))
            .value(bins)
            .allowed("1 or more")
            .into());
    }
    if bins == 1 {
        return Ok(vec![0.0]);
    }
    if !(fov > 0.0 && fov <= FRAC_PI_2 + 1e-9) {
        return Err(BadInput::new("is not a field of view")
            .key(format!("processing.{name}_fov"))
            .value(format!("{:.3} deg", fov.to_degrees()))
            .allowed("0 to 90 deg to each side")
            .into());
    }
    let edge = fov.min(FRAC_PI_2).sin();
    Ok((0..bins)
        .map(|i| (edge * (2.0 * i as f64 / (bins - 1) as f64 - 1.0)).clamp(-1.0, 1.0).asin())
        .collect())
}

/// A direction in which the beamformer's power peaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angle {
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// Amplitude y of eq. 19 in that direction, sqrt(W).
    pub amplitude: Complex64,
}

/// A radar's array with the window and the grid of its beamformer.
#[derive(Debug, Clone, PartialEq)]
pub struct Beamformer {
    /// The directions that are looked at.
    pub grid: Grid,
    /// Position of each virtual channel, p_tx + p_rx, sensor frame.
    position_m: Vec<DVec3>,
    /// w_c / sum(w).
    weight: Vec<f64>,
    /// TDM slot of each channel: the transmitter's number.
    slot: Vec<usize>,
    wavenumber: f64,
    /// Phase that a channel gathers per slot and m/s of range rate: 2 pi (2/lambda) T_c.
    slot_phase: f64,
}

impl Beamformer {
    /// The beamformer of a radar. Its channel weights are the angle window at the channels' positions along y
    /// ([`window::at_positions`]).
    ///
    /// # Errors
    /// Returns the errors of [`Grid::new`] and of the window, and an error if there are no antennas.
    pub fn new(radar: &Radar) -> Result<Self> {
        let grid = Grid::new(radar)?;
        let (mut position_m, mut slot) = (Vec::new(), Vec::new());
        for (k, tx) in radar.tx.iter().enumerate() {
            for rx in &radar.rx {
                position_m.push(tx.position_m + rx.position_m);
                slot.push(k);
            }
        }
        if slot.is_empty() {
            return Err(BadInput::new("the radar has no channels").key("tx, rx").into());
        }
        let y: Vec<f64> = position_m.iter().map(|p| p.y).collect();
        let w = window::at_positions(radar.processing.angle_window, &y)?;
        let sum: f64 = w.iter().sum();
        Ok(Beamformer {
            grid,
            position_m,
            weight: w.iter().map(|v| v / sum).collect(),
            slot,
            wavenumber: wavenumber(radar.sample_centre_hz()),
            slot_phase: TAU * 2.0 / radar.sample_wavelength_m() * radar.chirp_period_s(),
        })
    }

    /// Number of virtual channels.
    pub fn channels(&self) -> usize {
        self.slot.len()
    }

    /// w_c e^{+jk u.(p_tx + p_rx)} / sum(w) of one channel towards the unit vector `u`.
    fn steer(&self, channel: usize, u: DVec3) -> Complex64 {
        Complex64::cis(self.wavenumber * u.dot(self.position_m[channel])) * self.weight[channel]
    }

    /// The steering matrix of the grid, `[elevation, azimuth, channel]`.
    pub fn steering(&self) -> Vec<Complex64> {
        let mut out = Vec::with_capacity(self.grid.len() * self.channels());
        for e in &self.grid.elevation_rad {
            for a in &self.grid.azimuth_rad {
                let u = direction_from_angles(*a, *e);
                out.extend((0..self.channels()).map(|c| self.steer(c, u)));
            }
        }
        out
    }

    /// The factor that takes out of a channel the phase that a target of this range rate gathers
    /// between transmitters: e^{-j 2 pi (2v/lambda) k T_c}.
    pub fn correction(&self, channel: usize, range_rate_mps: f64) -> Complex64 {
        Complex64::cis(-self.slot_phase * range_rate_mps * self.slot[channel] as f64)
    }

    /// Amplitude y of eq. 19 in any direction, sqrt(W), in f64. `snapshot`: one value per channel.
    pub fn amplitude<T: Real>(
        &self,
        snapshot: &[Complex<T>],
        range_rate_mps: f64,
        azimuth_rad: f64,
        elevation_rad: f64,
    ) -> Complex64 {
        let u = direction_from_angles(azimuth_rad, elevation_rad);
        snapshot
            .iter()
            .enumerate()
            .map(|(c, x)| {
                Complex64::new(x.re.wide(), x.im.wide())
                    * self.correction(c, range_rate_mps)
                    * self.steer(c, u)
            })
            .sum()
    }

    /// The peaks of one cell's angular power, strongest first: local maxima over the grid (in the 3 x
    /// 3 neighbourhood) not more than `below_db` under the strongest, each moved to the top of a
    /// parabola through log power on each axis, with the amplitude computed there. Peaks on the
    /// border of the grid stay there. `below_db` = 0 leaves the strongest alone (of equals, the
    /// first). Side lobes count as peaks: keep `below_db` above the angle window's side lobes.
    ///
    /// `power`: `[elevation, azimuth]` of this cell.
    pub fn peaks<T: Real>(
        &self,
        power: &[T],
        snapshot: &[Complex<T>],
        range_rate_mps: f64,
        below_db: f64,
    ) -> Vec<Angle> {
        let (rows, cols) = (self.grid.elevation_rad.len(), self.grid.azimuth_rad.len());
        let p = |e: usize, a: usize| power[e * cols + a].wide();
        let mut tops: Vec<(f64, usize, usize)> = Vec::new();
        for e in 0..rows {
            for a in 0..cols {
                let here = p(e, a);
                let (e0, e1) = (e.saturating_sub(1), (e + 1).min(rows - 1));
                let (a0, a1) = (a.saturating_sub(1), (a + 1).min(cols - 1));
                let beaten = (e0..=e1).flat_map(|i| (a0..=a1).map(move |j| (i, j))).any(|(i, j)| {
                    (i, j) != (e, a) && (p(i, j) > here || (p(i, j) == here && (i, j) < (e, a)))
                });
                if !beaten {
                    tops.push((here, e, a));
                }
            }
        }
        tops.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let least = tops.first().map_or(0.0, |t| t.0) * crate::base::units::power_from_db(-below_db.max(0.0));
        if below_db <= 0.0 {
            tops.truncate(1);
        }
        tops.retain(|t| t.0 >= least);
        tops.iter()
            .map(|&(here, e, a)| {
                let refine = |axis: &[f64], i: usize, power: &dyn Fn(usize) -> f64| {
                    if i == 0 || i + 1 >= axis.len() {
                        return axis[i];
                    }
                    let (offset, _) = parabola(power(i - 1), here, power(i + 1));
                    let step = 0.5 * (axis[i + 1].sin() - axis[i - 1].sin());
                    (axis[i].sin() + offset * step).clamp(-1.0, 1.0).asin()
                };
                let azimuth_rad = refine(&self.grid.azimuth_rad, a, &|j| p(e, j));
                let elevation_rad = refine(&self.grid.elevation_rad, e, &|i| p(i, a));
                let amplitude = self.amplitude(snapshot, range_rate_mps, azimuth_rad, elevation_rad);
                Angle { azimuth_rad, elevation_rad, amplitude }
            })
            .collect()
    }

    /// The strongest peak of one cell: [`Self::peaks`] with nothing below it.
    pub fn strongest<T: Real>(
        &self,
        power: &[T],
        snapshot: &[Complex<T>],
        range_rate_mps: f64,
    ) -> Option<Angle> {
        self.peaks(power, snapshot, range_rate_mps, 0.0).into_iter().next()
    }
}

gpu_struct! {
    /// Uniform of `shaders/dsp/doa_beamform.wgsl`.
    pub struct BeamformParams {
        pub cells: u32,
        pub directions: u32,
        pub channels: u32,
        pub slot_channels: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/doa_beamform",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/doa_beamform.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(BeamformParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 2e-6,
        reason: "the phases are rounded once, in the tables (eps each); a sum over K channels adds eps/2 sqrt K, \
                 1e-6 at 192, and the square doubles it",
    },
};

/// Cells of which a beamformer's power is asked for.
pub struct BeamCells<'a> {
    /// The beamformer.
    pub beam: &'a Beamformer,
    /// Snapshots of the cells, of as many channels as the beamformer has.
    pub snapshots: Snapshots<f64>,
    /// Range rate of each cell, m/s.
    pub range_rates_mps: Vec<f64>,
}

/// |y|^2 in W, `[cell, elevation, azimuth]`: the twin of the cpu engine's `spectra`, in as many
/// chunks of cells as the adapter's bindings ask for. `range_rates_mps`: one for each cell.
///
/// # Errors
/// Returns an error for snapshots of another number of channels, or if the adapter fails.
pub fn spectra(
    gpu: &Gpu,
    beam: &Beamformer,
    snapshots: &Snapshots<f32>,
    range_rates_mps: &[f64],
) -> Result<Vec<f32>> {
    let mut recorder = gpu.recorder("beamformer");
    let pending = record(&mut recorder, gpu, beam, snapshots, range_rates_mps);
    let mut done = recorder.submit()?;
    Ok(pending.into_iter().flat_map(|p| done.take(p)).collect())
}

/// [`spectra`] of several beamformers in one submission.
///
/// # Errors
/// Returns the errors of [`spectra`].
pub fn spectra_of_all(gpu: &Gpu, all: &[BeamCells<'_>]) -> Result<Vec<Vec<f32>>> {
    let mut recorder = gpu.recorder("beamformers");
    let pending: Vec<Vec<Pending<f32>>> = all
        .iter()
        .map(|c| record(&mut recorder, gpu, c.beam, &c.snapshots.narrowed(), &c.range_rates_mps))
        .collect();
    let mut done = recorder.submit()?;
    Ok(pending.into_iter().map(|list| list.into_iter().flat_map(|p| done.take(p)).collect()).collect())
}

fn record(
    recorder: &mut Recorder<'_>,
    gpu: &Gpu,
    beam: &Beamformer,
    snapshots: &Snapshots<f32>,
    range_rates_mps: &[f64],
) -> Vec<Pending<f32>> {
    let narrow = |z: Complex64| Complex32::new(z.re as f32, z.im as f32);
    let channels = beam.channels();
    let slot_channels = beam.slot.iter().filter(|s| **s == 0).count();
    let directions = beam.grid.len();
    let steering: Vec<Complex32> = beam.steering().into_iter().map(narrow).collect();
    let steering = recorder.upload("steering", &steering);
    let corrections: Vec<Complex32> = range_rates_mps
        .iter()
        .flat_map(|v| (0..channels).step_by(slot_channels).map(|c| narrow(beam.correction(c, *v))))
        .collect();
    let slots = channels / slot_channels;
    let cell_bytes = (8 * channels).max(4 * directions) as u64;
    let together = (gpu.max_binding_bytes() / cell_bytes).max(1) as usize;
    let mut pending = Vec::new();
    for first in (0..range_rates_mps.len()).step_by(together) {
        let cells = first..(first + together).min(range_rates_mps.len());
        let part =
            recorder.upload("snapshots", &snapshots.data[cells.start * channels..cells.end * channels]);
        let turn = recorder.upload("tdm corrections", &corrections[cells.start * slots..cells.end * slots]);
        let power = recorder.buffer::<f32>("angular power", cells.len() * directions);
        let params = BeamformParams {
            cells: cells.len() as u32,
            directions: directions as u32,
            channels: channels as u32,
            slot_channels: slot_channels as u32,
        };
        let threads = Threads::Linear((cells.len() * directions) as u64);
        recorder.dispatch(&KERNEL, &params, &[&part, &turn, &steering, &power], threads);
        pending.push(recorder.read(&power));
    }
    pending
}
