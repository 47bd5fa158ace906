//! Lines of a grid from cells to samples, with rustfft (CONVENTIONS eq. 83).

use super::grid_spread::PAD;
use crate::adc::gridding::GridLayout;
use catseye_math::fft::Fft;
use num_complex::Complex32;
use std::sync::Arc;

/// Samples whose lines are added up together.
pub const TILE: usize = 64;

/// Real and imaginary parts of a tile.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Tile {
    /// Real parts.
    pub re: [f32; TILE],
    /// Imaginary parts.
    pub im: [f32; TILE],
}

/// A tile of zeros.
pub const SILENCE: Tile = Tile { re: [0.0; TILE], im: [0.0; TILE] };

/// Buffers of one thread.
pub struct Scratch {
    fft: Vec<Complex32>,
    samples: Vec<Complex32>,
    /// `[tile, line]`.
    pub tiles: Vec<Tile>,
}

impl Scratch {
    /// Scratch for lines of this layout and its transform.
    pub fn new(layout: &GridLayout, fft: &Arc<dyn Fft<f32>>) -> Scratch {
        let tiles = layout.samples.div_ceil(TILE);
        Scratch {
            fft: vec![Complex32::ZERO; fft.get_inplace_scratch_len()],
            samples: vec![Complex32::ZERO; tiles * TILE],
            tiles: vec![SILENCE; tiles * layout.lines],
        }
    }
}

/// Transforms each line from cells to samples. Lines on which nothing was spread stay zero.
pub fn transform(layout: &GridLayout, fft: &dyn Fft<f32>, grid: &mut [Complex32], scratch: &mut Scratch) {
    let (cells, samples, lines) = (layout.cells, layout.samples, layout.lines);
    // Samples are counted from the middle of the ramp, negative ones stand at the end.
    let before = samples / 2;
    for (l, line) in grid.chunks_exact_mut(cells + 2 * PAD).enumerate() {
        let line = &mut line[PAD..PAD + cells];
        if line.iter().any(|z| *z != Complex32::ZERO) {
            fft.process_with_scratch(line, &mut scratch.fft);
        }
        scratch.samples[..before].copy_from_slice(&line[cells - before..]);
        scratch.samples[before..samples].copy_from_slice(&line[..samples - before]);
        let tiles = scratch.tiles.iter_mut().skip(l).step_by(lines);
        for (tile, values) in tiles.zip(scratch.samples.as_chunks::<TILE>().0) {
            for ((re, im), z) in tile.re.iter_mut().zip(&mut tile.im).zip(values) {
                (*re, *im) = (z.re, z.im);
            }
        }
    }
}
