//! Samples of other radars, each with its exact phase in f64 (CONVENTIONS eq. 112).

use super::precision::{narrow, wide};
use super::synthesis::Precision;
use crate::adc::Cube;
use crate::adc::front_end::Chain;
use crate::adc::front_end::draws::{INTERFERENCE_STREAM, words};
use crate::adc::interference::Arrival;
use crate::base::error::{Error, Result};
use crate::base::tasks::Tasks;
use crate::base::units::C0;
use catseye_math::Real;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Adds what arrives to loops `first_loop..` of a frame. Samples whose momentary frequency lies outside the band are
/// left alone.
///
/// # Errors
/// Returns an error for a cube that does not fit the chain, or an arrival for another number of receivers.
pub fn add<T: Precision + Real>(
    cube: &mut Cube<T>,
    first_loop: usize,
    arrivals: &[Arrival],
    chain: &Chain,
    seed: u64,
    frame: u32,
) -> Result<()> {
    if arrivals.is_empty() {
        return Ok(());
    }
    let slots = chain.timing.slots.max(1);
    let rx = cube.channels / slots;
    if !cube.channels.is_multiple_of(slots)
        || (first_loop + cube.chirps) * slots > chain.timing.starts_s.len()
    {
        return Err(Error::Failed(format!(
            "a cube of {} loops and {} channels for {} ramps in {slots} slots",
            cube.chirps,
            cube.channels,
            chain.timing.starts_s.len()
        )));
    }
    if let Some(a) = arrivals.iter().find(|a| a.receivers.is_empty() || !rx.is_multiple_of(a.receivers.len()))
    {
        let text = format!("interference for {} receivers, a cube of {rx} in each slot", a.receivers.len());
        return Err(Error::Failed(text));
    }
    let sources: Vec<Source> = arrivals.iter().map(|a| Source::new(a, chain, seed, frame)).collect();
    let samples = cube.samples;
    let channels = cube.channels;
    cube.data.par_chunks_mut(samples).enumerate().for_each_tasks(|(row, data)| {
        let (loop_, channel) = (row / channels, row % channels);
        let ramp = (first_loop + loop_) * slots + channel / rx;
        for s in &sources {
            s.add(ramp, channel, rx, data);
        }
    });
    Ok(())
}

struct Source<'a> {
    arrival: &'a Arrival,
    chain: &'a Chain,
    /// Start of ramp 0.
    start_s: f64,
    seed: u64,
    frame: u32,
}

impl<'a> Source<'a> {
    fn new(arrival: &'a Arrival, chain: &'a Chain, seed: u64, frame: u32) -> Source<'a> {
        // Counters below 2^32 are starts, those above phases of ramps.
        let w = words(seed, frame, INTERFERENCE_STREAM, u64::from(arrival.interferer));
        let drawn = f64::from(w[0]) * 2f64.powi(-32) * arrival.period_s;
        Source { arrival, chain, start_s: arrival.start_s.unwrap_or(drawn), seed, frame }
    }

    /// Phase at the start of ramp `k`, turns.
    fn first_turns(&self, k: i64) -> f64 {
        let ramp = if self.arrival.coherent { 0 } else { k as i32 as u32 };
        let index = u64::from(self.arrival.interferer + 1) << 32 | u64::from(ramp);
        f64::from(words(self.seed, self.frame, INTERFERENCE_STREAM, index)[0]) * 2f64.powi(-32)
    }

    fn add<T: Precision + Real>(
        &self,
        ramp: usize,
        channel: usize,
        rx: usize,
        data: &mut [num_complex::Complex<T>],
    ) {
        let (a, t) = (self.arrival, &self.chain.timing);
        let filters = &self.chain.settings.filters;
        let (amplitude, length_m) = a.receivers[channel % rx % a.receivers.len()];
        let beta = a.path_rate_mps / C0;
        let begin = t.starts_s[ramp];
        // Emission time less ramp 0's start is (since + ramp time)(1 − β) + rest: small numbers apart.
        let rest = -length_m / C0 - self.start_s;
        let mut known = None;
        for (n, z) in data.iter_mut().enumerate() {
            let time = t.adc_start_s + n as f64 / t.sample_rate_hz;
            let since = (begin + rest - beta * begin) + time * (1.0 - beta);
            let k = (since / a.period_s).floor();
            let u = since - k * a.period_s;
            if u >= a.ramp_time_s {
                continue;
            }
            let beat_hz =
                t.start_hz + t.slope_hz_per_s * time - (a.start_hz + a.slope_hz_per_s * u) * (1.0 - beta);
            // The ideal filter of a falling ramp passes negative beats (eq. 12).
            let mirrored = filters.low_pass.is_none() && t.slope_hz_per_s < 0.0;
            let at_hz = if mirrored { -beat_hz } else { beat_hz };
            if filters.stops(t.sampling, t.sample_rate_hz, at_hz) {
                continue;
            }
            let first = match known {
                Some((of, turns)) if of == k => turns,
                _ => {
                    let turns = self.first_turns(k as i64);
                    known = Some((k, turns));
                    turns
                }
            };
            let own = time * (t.start_hz + 0.5 * t.slope_hz_per_s * time);
            let other = u * (a.start_hz + 0.5 * a.slope_hz_per_s * u);
            let turns = (own - own.round()) - (other - other.round()) - first;
            let gain = self.chain.echo_gain(channel, beat_hz);
            let x = t.sampled(gain * amplitude.conj() * Complex64::cis(TAU * turns));
            *z = narrow(wide(*z) + x);
        }
    }
}
