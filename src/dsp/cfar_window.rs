//! The training region of the CFAR detectors, on the host and as the kernels read it (CONVENTIONS eq. 17, 85).

use crate::gpu::{Buffer, Recorder};
use crate::gpu_struct;
use crate::scene::radar::{Cfar, CfarKind};

/// How a cell is judged in one range column: detected when power > factor x statistic, where the
/// statistic is the mean (CA), the greater or smaller of the means of two halves (GO, SO), or the
/// `rank`-th smallest (OS) of `count` training cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Number of training cells.
    pub count: u32,
    /// Number of them in the half before (GO, SO); else 0.
    pub before: u32,
    /// Rank from 1 (OS); else 0.
    pub rank: u32,
    /// Factor on the statistic.
    pub factor: f64,
    /// Noise power / statistic: 1 for CA, else 1/E[statistic on unit-mean noise].
    pub scale: f64,
}

/// The halves of GO and SO (eq. 85).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Halves {
    /// The training cells at smaller and at larger range than the cell's own column, whose training cells
    /// belong to neither.
    AlongRange,
    /// There are no training columns: the halves are the rows before and after.
    AlongDoppler,
}

pub(crate) fn halves(cfar: &Cfar) -> Halves {
    if cfar.train[1] == 0 { Halves::AlongDoppler } else { Halves::AlongRange }
}

/// The columns `lo..=hi` that the training rectangle and the guard rectangle around `range` have,
/// both cut to the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    pub outer: (usize, usize),
    pub inner: (usize, usize),
}

pub(crate) fn reach(cfar: &Cfar, range: usize, range_bins: usize) -> Reach {
    let cut = |half: usize| (range.saturating_sub(half), (range + half).min(range_bins - 1));
    Reach { outer: cut(cfar.guard[1] + cfar.train[1]), inner: cut(cfar.guard[1]) }
}

gpu_struct! {
    /// Uniform of the CFAR shaders that need only the window: size of the map, and half heights and half widths of the
    /// guard and training rectangles.
    pub struct CfarWindowParams {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub guard_doppler: u32,
        pub half_doppler: u32,
        pub guard_range: u32,
        pub half_range: u32,
    }
}

/// [`Column`] as the shaders have it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DeviceColumn {
    count: u32,
    before: u32,
    rank: u32,
    factor: f32,
    scale: f32,
}

impl DeviceColumn {
    /// Offsets of the members, which a test compares with the shader's.
    pub const LAYOUT: crate::gpu::StructLayout = crate::gpu::StructLayout {
        name: "Column",
        size: size_of::<DeviceColumn>(),
        fields: &[
            ("count", std::mem::offset_of!(DeviceColumn, count)),
            ("before", std::mem::offset_of!(DeviceColumn, before)),
            ("rank", std::mem::offset_of!(DeviceColumn, rank)),
            ("factor", std::mem::offset_of!(DeviceColumn, factor)),
            ("scale", std::mem::offset_of!(DeviceColumn, scale)),
        ],
    };
}

/// The window on a map of `[doppler bins, range bins]`.
pub(crate) type Window = CfarWindowParams;

impl CfarWindowParams {
    pub(crate) fn new(size: [usize; 2], cfar: &Cfar) -> CfarWindowParams {
        let half = [0, 1].map(|i| cfar.guard[i] + cfar.train[i]);
        CfarWindowParams {
            doppler_bins: size[0] as u32,
            range_bins: size[1] as u32,
            guard_doppler: cfar.guard[0] as u32,
            half_doppler: half[0] as u32,
            guard_range: cfar.guard[1] as u32,
            half_range: half[1] as u32,
        }
    }
}

/// As the shaders have it.
pub(crate) fn kind_number(kind: CfarKind) -> u32 {
    match kind {
        CfarKind::Ca => 0,
        CfarKind::Go => 1,
        CfarKind::So => 2,
        CfarKind::Os { .. } => 3,
    }
}

pub(crate) fn upload_columns(recorder: &mut Recorder<'_>, columns: &[Column]) -> Buffer<DeviceColumn> {
    let columns: Vec<DeviceColumn> = columns
        .iter()
        .map(|c| DeviceColumn {
            count: c.count,
            before: c.before,
            rank: c.rank,
            factor: c.factor as f32,
            scale: c.scale as f32,
        })
        .collect();
    recorder.upload("cfar columns", &columns)
}
