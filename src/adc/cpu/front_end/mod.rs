//! The front end on a cube, in the physical order of `adc::front_end`.

pub mod oscillator;

use super::convert;
use super::interference;
use super::noise;
use super::precision::{narrow, wide};
use super::synthesis::Precision;
use crate::adc::Cube;
use crate::adc::convert::Convert;
use crate::adc::front_end::Chain;
use crate::adc::interference::Arrival;
use crate::adc::noise::Noise;
use crate::base::error::{Error, Result};
use crate::base::tasks::Tasks;
use crate::scene::radar::Sampling;
use catseye_math::Real;
use num_complex::Complex64;
use oscillator::Oscillator;
use rayon::prelude::*;

/// What comes from outside the front end.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<'a> {
    /// Thermal noise; None without it.
    pub noise: Option<&'a Noise>,
    /// Signals of other radars.
    pub interference: &'a [Arrival],
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of the frame, which selects the random numbers.
    pub frame: u32,
    /// Seed of the starts and phases of other radars, which are the same for all ramps of a frame.
    pub interference_seed: u64,
}

/// The samples that the converter delivers, from the cube of a whole frame without noise, whose rows are `margin`
/// samples longer at both ends (`Chain::margin`; 0 for a cube that has none). Echoes must have been multiplied by
/// `Chain::echo_gain` already.
///
/// # Errors
/// Returns an error for a cube that does not fit the chain.
pub fn apply<T: Precision + Real + noise::Precision>(
    cube: Cube<T>,
    margin: usize,
    chain: &Chain,
    with: Inputs,
) -> Result<Cube<T>> {
    Runner::new(chain, cube.samples, margin, with)?.block(cube, 0)
}

/// The front end of one frame, for cubes that come loop by loop.
pub struct Runner<'a> {
    chain: &'a Chain,
    with: Inputs<'a>,
    margin: usize,
    oscillator: Oscillator<'a>,
}

impl<'a> Runner<'a> {
    /// `samples`: of a row, with its margins.
    ///
    /// # Errors
    /// Returns an error for a margin as long as the row, or a sweep too slow for phase noise.
    pub fn new(chain: &'a Chain, samples: usize, margin: usize, with: Inputs<'a>) -> Result<Runner<'a>> {
        let oscillator = Oscillator::new(chain, samples, margin, with.seed, with.frame)?;
        Ok(Runner { chain, with, margin, oscillator })
    }

    /// Loops `first_loop..first_loop + cube.chirps` of the frame: the same samples as in one piece.
    ///
    /// # Errors
    /// Returns an error for a margin as long as the row, or a sweep too slow for phase noise.
    pub fn block<T: Precision + Real + noise::Precision>(
        &self,
        mut cube: Cube<T>,
        first_loop: usize,
    ) -> Result<Cube<T>> {
        let (chain, with) = (self.chain, &self.with);
        let loops = chain.timing.starts_s.len() / chain.timing.slots.max(1);
        if chain.timing.slots == 0
            || !cube.channels.is_multiple_of(chain.timing.slots)
            || first_loop + cube.chirps > loops
        {
            return Err(Error::Failed(format!(
                "loops {first_loop}..{} of {} channels for a front end of {loops} loops with {} slots each",
                first_loop + cube.chirps,
                cube.channels,
                chain.timing.slots
            )));
        }
        add_spills(&mut cube, self.margin, chain)?;
        let mut cube = self.oscillator.block(cube, first_loop)?;
        interference::add(
            &mut cube,
            first_loop,
            with.interference,
            chain,
            with.interference_seed,
            with.frame,
        )?;
        if let Some(n) = with.noise {
            let first_row = first_loop * cube.channels;
            match chain.settings.filters.noise_shape(&chain.timing, cube.samples) {
                None => add_white(&mut cube, first_row, n),
                Some(shape) => add_shaped(&mut cube, first_row, n, &shape),
            }
        }
        if let Some(c) = Convert::new(&chain.settings, chain.timing.sampling) {
            convert::apply(&mut cube, &c);
        }
        Ok(cube)
    }
}

/// Adds leakage and cover, through filters and channels, to all loops.
fn add_spills<T: Precision + Real>(cube: &mut Cube<T>, margin: usize, chain: &Chain) -> Result<()> {
    let t = &chain.timing;
    for spill in &chain.spills {
        if spill.channels.len() != cube.channels {
            return Err(channels_differ(spill.channels.len(), cube.channels));
        }
        let row = |c: usize| -> Vec<Complex64> {
            let gain = chain.echo_gain(c, t.beat_hz(spill.channels[c].1));
            let time = |n: usize| t.adc_start_s + (n as f64 - margin as f64) / t.sample_rate_hz;
            (0..cube.samples).map(|n| t.sampled(gain * spill.tone(t, c, time(n)))).collect()
        };
        let rows: Vec<Vec<Complex64>> = (0..cube.channels).map(row).collect();
        let (samples, channels) = (cube.samples, cube.channels);
        cube.data.par_chunks_mut(samples).enumerate().for_each_tasks(|(number, data)| {
            for (z, x) in data.iter_mut().zip(&rows[number % channels]) {
                *z = narrow(wide(*z) + x);
            }
        });
    }
    Ok(())
}

fn channels_differ(given: usize, cube: usize) -> Error {
    Error::Failed(format!("{given} channels given for a cube of {cube}"))
}

/// Adds thermal noise as `adc::cpu::noise` does to a whole cube; this one begins at row `first_row` of it.
fn add_white<T: noise::Precision>(cube: &mut Cube<T>, first_row: usize, noise: &Noise) {
    let n = cube.samples;
    cube.data
        .par_chunks_mut(n)
        .enumerate()
        .for_each_tasks(|(number, data)| T::add_from(noise, ((first_row + number) * n) as u64, data));
}

/// Adds thermal noise that went through the filters: the draws of eq. 13, multiplied in the transform of each
/// record by `shape` (`Filters::noise_shape`), so that the noise is stationary on the record's circle.
fn add_shaped<T: Precision + Real>(cube: &mut Cube<T>, first_row: usize, noise: &Noise, shape: &[f64]) {
    let n = cube.samples;
    let (forward, inverse) = (catseye_math::fft::forward(n), catseye_math::fft::inverse(n));
    let scratch = forward.get_inplace_scratch_len().max(inverse.get_inplace_scratch_len());
    cube.data.par_chunks_mut(n).enumerate().for_each_init_tasks(
        || (vec![Complex64::ZERO; n], vec![Complex64::ZERO; scratch]),
        |(row, scratch), (number, data)| {
            for (i, z) in row.iter_mut().enumerate() {
                *z = noise::sample(noise, ((first_row + number) * n + i) as u64);
            }
            forward.process_with_scratch(row, scratch);
            row.iter_mut().zip(shape).for_each(|(z, s)| *z *= s / n as f64);
            inverse.process_with_scratch(row, scratch);
            for (z, x) in data.iter_mut().zip(row) {
                // The transform's rounding leaves a trace in the imaginary part.
                let x = if noise.sampling == Sampling::Real { Complex64::from(x.re) } else { *x };
                *z = narrow(wide(*z) + x);
            }
        },
    );
}
