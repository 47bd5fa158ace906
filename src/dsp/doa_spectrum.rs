//! Quadratic forms a^H B a of many cells over a grid of directions, which Bartlett, Capon, maximum
//! likelihood and MUSIC share (CONVENTIONS eq. 94), and the host side of their kernel.
//!
//! B is given by a factor, B = F F^H, and the form is the sum of |f^H a|^2 over its columns: squares
//! do not cancel, so that the depth of a null of MUSIC survives f32. The decompositions behind the
//! factors are small and stay on the host for both engines.

use super::doa_beamform::Grid;
use super::doa_manifold::{Manifold, Matrix};
use crate::base::error::Result;
use crate::gpu::{Access, Gpu, Kernel, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::{Complex32, Complex64};

/// Steering vectors of a grid, `[direction, channel]`, direction = elevation x azimuths + azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct Steering {
    /// Number of virtual channels.
    pub channels: usize,
    /// Values, `[direction, channel]`.
    pub data: Vec<Complex64>,
}

impl Steering {
    /// The steering vectors of every direction of a grid.
    pub fn new(manifold: &Manifold, grid: &Grid) -> Self {
        let angles = grid.elevation_rad.iter().flat_map(|e| grid.azimuth_rad.iter().map(move |a| (*a, *e)));
        let data = angles.flat_map(|(a, e)| manifold.steering(a, e)).collect();
        Steering { channels: manifold.channels(), data }
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        self.data.len() / self.channels.max(1)
    }
}

/// Factors of many cells, `[cell, column, channel]`. Cells of fewer columns are filled with zeros.
#[derive(Debug, Clone, PartialEq)]
pub struct Forms {
    /// Number of cells.
    pub cells: usize,
    /// Columns of the factor of a cell.
    pub rank: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Values, `[cell, column, channel]`.
    pub data: Vec<Complex64>,
}

impl Forms {
    /// The factors of cells, `[channel, column]` each, filled up to one number of columns.
    pub fn new(factors: &[&Matrix], channels: usize) -> Self {
        let rank = factors.iter().map(|f| f.ncols()).max().unwrap_or(0);
        let mut data = Vec::with_capacity(factors.len() * rank * channels);
        for f in factors {
            for j in 0..rank {
                if j < f.ncols() {
                    data.extend_from_slice(&f.column(j)[..channels]);
                } else {
                    data.extend(std::iter::repeat_n(Complex64::ZERO, channels));
                }
            }
        }
        Forms { cells: factors.len(), rank, channels, data }
    }
}

/// One form in one direction.
pub(super) fn form(factor: &Matrix, a: &[Complex64]) -> f64 {
    (0..factor.ncols())
        .map(|j| factor.column(j).iter().zip(a).map(|(f, a)| f.conj() * a).sum::<Complex64>().norm_sqr())
        .sum()
}

gpu_struct! {
    /// Uniform of `shaders/dsp/doa_spectrum.wgsl`.
    pub struct DoaSpectrumParams {
        pub cells: u32,
        pub directions: u32,
        pub channels: u32,
        pub rank: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/doa_spectrum",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/doa_spectrum.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(DoaSpectrumParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 2e-6,
        reason: "factors and steering vectors are rounded once (eps each); a sum over K channels adds eps/2 sqrt K, 1e-6 \
                 at 192, the square doubles it, and columns add without cancelling",
    },
};

/// The forms over the grid, `[cell, direction]`: the twin of the cpu engine's `spectra`, in as many
/// pieces as the adapter's bindings ask for.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn spectra(gpu: &Gpu, steering: &Steering, forms: &Forms) -> Result<Vec<f32>> {
    let narrow = |z: &Complex64| Complex32::new(z.re as f32, z.im as f32);
    let (directions, channels) = (steering.directions(), forms.channels);
    if forms.cells == 0 || directions == 0 {
        return Ok(Vec::new());
    }
    if forms.rank == 0 {
        return Ok(vec![0.0; forms.cells * directions]);
    }
    let mut recorder = gpu.recorder("spectra of angle");
    // Neighbouring threads take neighbouring directions: the channel is the slow axis here.
    let turned: Vec<Complex32> = (0..channels)
        .flat_map(|c| (0..directions).map(move |d| narrow(&steering.data[d * channels + c])))
        .collect();
    let turned = recorder.upload("steering vectors", &turned);
    let cell_values = forms.rank * channels;
    let cell_bytes = (8 * cell_values).max(4 * directions) as u64;
    let together = (gpu.max_binding_bytes() / cell_bytes).max(1) as usize;
    let mut pending = Vec::new();
    for first in (0..forms.cells).step_by(together) {
        let cells = together.min(forms.cells - first);
        let part = &forms.data[first * cell_values..(first + cells) * cell_values];
        let part: Vec<Complex32> = part.iter().map(narrow).collect();
        let part = recorder.upload("factors", &part);
        let out = recorder.buffer::<f32>("forms", cells * directions);
        let params = DoaSpectrumParams {
            cells: cells as u32,
            directions: directions as u32,
            channels: channels as u32,
            rank: forms.rank as u32,
        };
        let threads = Threads::Linear((cells * directions) as u64);
        recorder.dispatch(&KERNEL, &params, &[&part, &turned, &out], threads);
        pending.push(recorder.read(&out));
    }
    let mut done = recorder.submit()?;
    Ok(pending.into_iter().flat_map(|p| done.take(p)).collect())
}
