//! Removal of everything at rest: what is taken out, and the host side of the kernel (CONVENTIONS eq. 88).

use crate::adc::DeviceCube;
use crate::gpu::{Access, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

/// What echoes at rest look like over chirps: the same in all, or with Doppler bands (DDM) any sum of the turns of
/// the transmitters, which come round after as many chirps as there are bands.
#[derive(Debug, Clone, PartialEq)]
pub struct AtRest {
    /// Number of chirps after which the projection repeats.
    pub period: usize,
    /// The orthogonal projection `[chirp, chirp]` of one period, from sums over all chirps that are a period apart to
    /// what rests.
    pub projection: Vec<Complex64>,
}

impl AtRest {
    /// The projection for this radar's chirps.
    pub fn of(radar: &Radar) -> AtRest {
        match radar.multiplex {
            Multiplex::Ddm { bands } => AtRest::turning(radar.chirps, bands, radar.tx.len()),
            _ => AtRest::turning(radar.chirps, 1, 1),
        }
    }

    /// The projection for transmitters k of which each is turned by -k / `bands` of a turn from chirp to chirp.
    pub fn turning(chirps: usize, bands: usize, transmitters: usize) -> AtRest {
        let count = |j: usize| (chirps + bands - 1 - j) / bands;
        let dot = |a: &[Complex64], b: &[Complex64]| -> Complex64 {
            a.iter().zip(b).enumerate().map(|(j, (a, b))| a.conj() * b * count(j) as f64).sum()
        };
        // Where the frame is no whole number of periods they are not orthogonal.
        let mut basis: Vec<Vec<Complex64>> = Vec::with_capacity(transmitters);
        for k in 0..transmitters {
            let turn = |j: usize| Complex64::cis(-TAU * (k * j % bands) as f64 / bands as f64);
            let mut ramp: Vec<Complex64> = (0..bands).map(turn).collect();
            // Twice is enough (Giraud et al., Numer. Math. 101, 87, 2005).
            for _ in 0..2 {
                for b in &basis {
                    let along = dot(b, &ramp);
                    ramp.iter_mut().zip(b).for_each(|(x, b)| *x -= along * b);
                }
            }
            let norm = dot(&ramp, &ramp).re.sqrt();
            // Fewer chirps than transmitters tell no more apart.
            if norm > 1e-9 * (chirps as f64).sqrt() {
                basis.push(ramp.iter().map(|x| x / norm).collect());
            }
        }
        let entry = |i: usize| basis.iter().map(|b| b[i / bands] * b[i % bands].conj()).sum();
        AtRest { period: bands, projection: (0..bands * bands).map(entry).collect() }
    }
}

gpu_struct! {
    /// Uniform of `shaders/dsp/zero_doppler.wgsl`.
    pub struct ZeroDopplerParams {
        pub chirps: u32,
        pub columns: u32,
        pub phase: u32,
        pub start: u32,
        pub first_chirp: u32,
        pub period: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/zero_doppler",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/dsp/zero_doppler.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(ZeroDopplerParams::LAYOUT),
    storage: &[Access::ReadWrite, Access::ReadWrite, Access::Read],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 2e-6,
        reason: "a running sum over chirps, whose rounding grows like their square root: eps/2 sqrt(512) of the \
                 mean; relative to the samples before the removal",
    },
};

/// Records the subtraction of what rests from a cube, in place.
pub fn record(recorder: &mut Recorder<'_>, cube: &DeviceCube, rest: &AtRest) {
    let columns = cube.channels * cube.samples;
    let sums = recorder.buffer::<[f32; 2]>("sums over chirps", rest.period * columns);
    let narrow = |z: &Complex64| Complex32::new(z.re as f32, z.im as f32);
    let projection: Vec<Complex32> = rest.projection.iter().map(narrow).collect();
    let projection = recorder.upload("projection", &projection);
    for phase in [0, 1] {
        for (i, piece) in cube.pieces.iter().enumerate() {
            let params = ZeroDopplerParams {
                chirps: piece.chirps as u32,
                columns: columns as u32,
                phase,
                start: u32::from(i == 0),
                first_chirp: piece.first_chirp as u32,
                period: rest.period as u32,
            };
            let threads = Threads::Linear((rest.period * columns) as u64);
            recorder.dispatch(&KERNEL, &params, &[&piece.data, &sums, &projection], threads);
        }
    }
}
