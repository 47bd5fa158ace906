//! What a radar sends. Synthesis and processing see every waveform as lines: values of the echoes'
//! frequency response at equidistant frequencies (CONVENTIONS eq. 12a).

use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// One linear ramp of the frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Swept during `time_s`; negative when the frequency falls.
    pub bandwidth_hz: f64,
    /// Length of the ramp, s.
    pub time_s: f64,
    /// Time from the start of this ramp to the start of what follows it, of any transmitter, s.
    pub period_s: f64,
}

/// In which order the chirps of several ramps are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RampOrder {
    /// One chirp of each ramp in every loop, as slopes that rise and fall in turn.
    #[default]
    InTurn,
    /// All chirps of a ramp before those of the next: bursts, whose periods may differ so that they fold range rates
    /// differently (staggered repetition).
    Bursts,
}

/// Several ramps. A fast-chirp radar has one, an FM-CW radar with a triangle two. Every ramp is sent by all
/// transmitters before the next one.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// The ramps, in the order in which they are sent.
    pub ramps: Vec<Ramp>,
    /// The ramp that this radar's range and Doppler scales speak of.
    pub this: usize,
    /// How their chirps follow each other.
    pub order: RampOrder,
}

/// Envelope of a pulse over its carrier, with a largest magnitude of 1.
#[derive(Debug, Clone, PartialEq)]
pub enum PulseShape {
    /// A Gaussian pulse exp(−t²/2s²).
    Gaussian {
        /// Full width of the spectrum at −10 dB.
        bandwidth_hz: f64,
    },
    /// Samples of the envelope, band-limited in between.
    Samples {
        /// Samples a second, Hz.
        rate_hz: f64,
        /// Samples of the envelope.
        envelope: Vec<Complex64>,
        /// The sample at time zero.
        zero: usize,
    },
}

/// Decay of a spectrum or an envelope beyond which it is taken for nothing, in amplitude.
const NOTHING: f64 = 1e-7;

impl PulseShape {
    /// Standard deviation in time of a Gaussian pulse.
    fn sigma_s(bandwidth_hz: f64) -> f64 {
        10f64.ln().sqrt() / (PI * bandwidth_hz)
    }

    /// Spectrum of the pulse, ∫ p(t) e^{−j2πft} dt, s.
    ///
    /// # Example
    /// ```
    /// use catseye::scene::waveform::PulseShape;
    ///
    /// // A UWB pulse that is 1.5 GHz wide at -10 dB.
    /// let pulse = PulseShape::Gaussian { bandwidth_hz: 1.5e9 };
    /// let ratio = pulse.spectrum(0.75e9).norm() / pulse.spectrum(0.0).norm();
    /// assert!((20.0 * ratio.log10() + 10.0).abs() < 1e-9);
    /// ```
    pub fn spectrum(&self, f_hz: f64) -> Complex64 {
        match self {
            PulseShape::Gaussian { bandwidth_hz } => {
                let s = Self::sigma_s(*bandwidth_hz);
                Complex64::from(s * TAU.sqrt() * (-2.0 * (PI * s * f_hz).powi(2)).exp())
            }
            PulseShape::Samples { rate_hz, envelope, zero } => {
                if f_hz.abs() > 0.5 * rate_hz {
                    return Complex64::ZERO;
                }
                let turn = f_hz / rate_hz;
                let sum: Complex64 = envelope
                    .iter()
                    .enumerate()
                    .map(|(i, p)| p * Complex64::cis(-TAU * turn * (i as f64 - *zero as f64)))
                    .sum();
                sum / *rate_hz
            }
        }
    }

    /// The envelope at time `t_s`.
    pub fn at(&self, t_s: f64) -> Complex64 {
        match self {
            PulseShape::Gaussian { bandwidth_hz } => {
                Complex64::from((-0.5 * (t_s / Self::sigma_s(*bandwidth_hz)).powi(2)).exp())
            }
            PulseShape::Samples { rate_hz, envelope, zero } => {
                let x = t_s * rate_hz + *zero as f64;
                let sinc = |d: f64| if d.abs() < 1e-12 { 1.0 } else { (PI * d).sin() / (PI * d) };
                envelope.iter().enumerate().map(|(i, p)| p * sinc(x - i as f64)).sum()
            }
        }
    }

    /// Half width of the band in which the spectrum lies, Hz.
    pub fn half_band_hz(&self) -> f64 {
        match self {
            PulseShape::Gaussian { bandwidth_hz } => {
                (-NOTHING.ln() / 2.0).sqrt() / (PI * Self::sigma_s(*bandwidth_hz))
            }
            PulseShape::Samples { rate_hz, .. } => 0.5 * rate_hz,
        }
    }

    /// Times (`.0`, `.1`), s, such that the envelope lies between −`.0` and +`.1`.
    pub fn extent_s(&self) -> (f64, f64) {
        match self {
            PulseShape::Gaussian { bandwidth_hz } => {
                let half = (-2.0 * NOTHING.ln()).sqrt() * Self::sigma_s(*bandwidth_hz);
                (half, half)
            }
            PulseShape::Samples { rate_hz, envelope, zero } => {
                (*zero as f64 / rate_hz, (envelope.len() - zero) as f64 / rate_hz)
            }
        }
    }

    /// Width of the band in which processing looks for echoes: at −10 dB, or all of the samples' band.
    pub fn band_hz(&self) -> f64 {
        match self {
            PulseShape::Gaussian { bandwidth_hz } => *bandwidth_hz,
            PulseShape::Samples { rate_hz, .. } => *rate_hz,
        }
    }
}

/// The signal that the radar sends.
#[derive(Debug, Clone, PartialEq)]
pub enum Waveform {
    /// Linear frequency modulation, mixed with what is sent.
    Fmcw(Slopes),
    /// One tone after another, one sample each: `sample_rate_hz` tones a second.
    Stepped {
        /// Distance from tone to tone, Hz.
        step_hz: f64,
        /// Time from the first tone of a run to the first tone of the next, s.
        period_s: f64,
    },
    /// Impulse radio: a pulse, and samples while its echoes come in.
    Pulse {
        /// Envelope of a pulse.
        shape: PulseShape,
        /// Time from pulse to pulse, s.
        period_s: f64,
    },
    /// Phase-modulated continuous wave: a code of ±1 over and over.
    Coded {
        /// Chips, each 1 or -1.
        code: Vec<i8>,
        /// Chips a second, Hz.
        chip_rate_hz: f64,
        /// Time from the code that is sampled to the next one, s.
        period_s: f64,
    },
}

impl Waveform {
    /// Fast chirps: one rising (or, with a negative bandwidth, falling) ramp.
    ///
    /// # Example
    /// ```
    /// use catseye::scene::waveform::Waveform;
    ///
    /// let chirps = Waveform::chirp(375e6, 12.8e-6, 16e-6);
    /// let slope_mhz_per_us = chirps.ramp().map(|r| r.bandwidth_hz / r.time_s * 1e-12);
    /// assert!(slope_mhz_per_us.is_some_and(|s| (s - 29.30).abs() < 0.01));
    /// assert_eq!((chirps.kind(), chirps.parts(), chirps.period_s()), ("fmcw", 1, 16e-6));
    /// ```
    pub fn chirp(bandwidth_hz: f64, ramp_time_s: f64, period_s: f64) -> Waveform {
        let ramps = vec![Ramp { bandwidth_hz, time_s: ramp_time_s, period_s }];
        Waveform::Fmcw(Slopes { ramps, this: 0, order: RampOrder::InTurn })
    }

    /// Number of times that a loop sends with each transmitter.
    pub fn parts(&self) -> usize {
        match self {
            Waveform::Fmcw(s) => s.ramps.len(),
            _ => 1,
        }
    }

    /// The ramp in question; None for a waveform without ramps.
    pub fn ramp(&self) -> Option<&Ramp> {
        match self {
            Waveform::Fmcw(s) => s.ramps.get(s.this),
            _ => None,
        }
    }

    /// Time from the start of one chirp, run, pulse or code to the start of the next, of any transmitter, s.
    pub fn period_s(&self) -> f64 {
        match self {
            Waveform::Fmcw(s) => s.ramps[s.this].period_s,
            Waveform::Stepped { period_s, .. }
            | Waveform::Pulse { period_s, .. }
            | Waveform::Coded { period_s, .. } => *period_s,
        }
    }

    /// Sum of the periods of all parts, and of those before the part in question.
    pub fn periods_s(&self) -> (f64, f64) {
        match self {
            Waveform::Fmcw(s) => {
                let sum = |r: &[Ramp]| r.iter().map(|r| r.period_s).sum();
                (sum(&s.ramps), sum(&s.ramps[..s.this]))
            }
            _ => (self.period_s(), 0.0),
        }
    }

    /// Whether all chirps of a ramp are sent before those of the next.
    pub fn is_in_bursts(&self) -> bool {
        matches!(self, Waveform::Fmcw(s) if s.order == RampOrder::Bursts)
    }

    /// The name that `waveform.kind` has in a radar file.
    pub fn kind(&self) -> &'static str {
        match self {
            Waveform::Fmcw(_) => "fmcw",
            Waveform::Stepped { .. } => "stepped-frequency",
            Waveform::Pulse { .. } => "pulse",
            Waveform::Coded { .. } => "pmcw",
        }
    }
}

/// Lines of one chirp: line n is taken at `start_s` + n `step_s` after the chirp's start and is the response at
/// `first_hz` + n `step_hz` (CONVENTIONS eq. 12a).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrequencySamples {
    /// Number of lines.
    pub count: usize,
    /// Frequency of the first line, Hz.
    pub first_hz: f64,
    /// Step from one sample to the next, Hz; negative when the frequency falls.
    pub step_hz: f64,
    /// Time from line to line, s.
    pub step_s: f64,
    /// Time of the first line after the chirp's start, s.
    pub start_s: f64,
    /// Mixed with the sweep itself: the phase has the term −½Sτ².
    pub dechirped: bool,
}

impl FrequencySamples {
    /// The same samples with `margin` more at either end.
    pub fn wider(self, margin: usize) -> FrequencySamples {
        let m = margin as f64;
        FrequencySamples {
            count: self.count + 2 * margin,
            first_hz: self.first_hz - m * self.step_hz,
            start_s: self.start_s - m * self.step_s,
            ..self
        }
    }
}

/// How several transmitters share a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Multiplex {
    /// Transmitters send one after another.
    Tdm,
    /// Transmitters send all at once with signs from a Hadamard matrix, in as many slots as the next power of two.
    Bpm,
    /// Transmitters send all at once, transmitter k turned by k/`bands` of a turn from chirp to chirp; bands that no
    /// transmitter has tell the folds of the range rate apart.
    Ddm {
        /// Doppler bands, of which each transmitter takes one.
        bands: usize,
    },
}

impl Multiplex {
    /// Number of chirps of one loop of one ramp.
    pub fn slots(&self, transmitters: usize) -> usize {
        match self {
            Multiplex::Tdm => transmitters,
            Multiplex::Bpm => transmitters.next_power_of_two(),
            Multiplex::Ddm { .. } => 1,
        }
    }

    /// Sign with which `tx` sends in `slot` (0 when it is silent).
    ///
    /// # Example
    /// With BPM two transmitters send at once. The signs of a Hadamard matrix are orthogonal, so that the sum of both
    /// slots holds the first transmitter alone and their difference the second, each 3 dB stronger over the noise than
    /// with TDM.
    ///
    /// ```
    /// use catseye::scene::waveform::Multiplex;
    ///
    /// let echo_of = [1.0, 0.25];
    /// let slot = |s: usize| (0..2).map(|tx| Multiplex::Bpm.weight(s, tx) * echo_of[tx]).sum::<f64>();
    /// let separated = |tx: usize| (0..2).map(|s| Multiplex::Bpm.weight(s, tx) * slot(s)).sum::<f64>() / 2.0;
    /// assert_eq!([separated(0), separated(1)], echo_of);
    /// assert_eq!(Multiplex::Tdm.weight(0, 1), 0.0);
    /// ```
    pub fn weight(&self, slot: usize, tx: usize) -> f64 {
        match self {
            Multiplex::Tdm => f64::from(u8::from(slot == tx)),
            // Sylvester's matrix.
            Multiplex::Bpm => 1.0 - 2.0 * f64::from((slot & tx).count_ones() % 2),
            Multiplex::Ddm { .. } => 1.0,
        }
    }
}

/// The maximum-length sequence of 2^`degree` − 1 chips, from a primitive polynomial over GF(2) (Peterson and Weldon,
/// *Error-Correcting Codes*, 1972, appendix C). Its periodic autocorrelation is −1 beside the peak. None when there is no
/// polynomial of this degree here (2 to 16).
///
/// # Example
/// ```
/// use catseye::scene::waveform::m_sequence;
///
/// let code = m_sequence(7).unwrap_or_default();
/// assert_eq!(code.len(), 127);
/// let autocorrelation = |lag: usize| -> i32 {
///     (0..127).map(|i| i32::from(code[i]) * i32::from(code[(i + lag) % 127])).sum()
/// };
/// // 42 dB between the peak and the side lobes of the periodic code.
/// assert_eq!(autocorrelation(0), 127);
/// assert!((1..127).all(|lag| autocorrelation(lag) == -1));
/// ```
pub fn m_sequence(degree: u32) -> Option<Vec<i8>> {
    // Exponents of the polynomial apart from the degree and zero.
    const TAPS: [&[u32]; 15] = [
        &[1],
        &[1],
        &[1],
        &[2],
        &[1],
        &[1],
        &[2, 3, 4],
        &[4],
        &[3],
        &[2],
        &[1, 4, 6],
        &[1, 3, 4],
        &[1, 6, 10],
        &[1],
        &[1, 3, 12],
    ];
    let taps = TAPS.get(degree.checked_sub(2)? as usize)?;
    let mut state: u32 = 1;
    let chips = (1u32 << degree) - 1;
    Some(
        (0..chips)
            .map(|_| {
                let out = state & 1;
                // x^degree = 1 + Σ x^t: the bit that enters is the sum of the bits at 0 and t.
                let feedback = taps.iter().fold(out, |f, t| f ^ (state >> t & 1));
                state = state >> 1 | feedback << (degree - 1);
                if out == 1 { -1 } else { 1 }
            })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_are_of_maximum_length() {
        for degree in 2..=16 {
            let code = m_sequence(degree).unwrap();
            let n = code.len();
            assert_eq!(n, (1 << degree) - 1);
            assert_eq!(code.iter().map(|c| i32::from(*c)).sum::<i32>().abs(), 1, "degree {degree}");
            for lag in [1, 2, 3, n / 2, n - 1] {
                let sum: i32 = (0..n).map(|i| i32::from(code[i]) * i32::from(code[(i + lag) % n])).sum();
                assert_eq!(if lag % n == 0 { n as i32 } else { -1 }, sum, "degree {degree}, lag {lag}");
            }
        }
        assert!(m_sequence(1).is_none() && m_sequence(17).is_none());
    }

    /// The spectrum of a pulse is the Fourier integral of its envelope, and both end where they say.
    #[test]
    fn a_pulse_has_its_spectrum() {
        let samples: Vec<Complex64> = (0..9)
            .map(|i| Complex64::new((-0.3 * (i as f64 - 4.0).powi(2)).exp(), 0.05 * i as f64))
            .collect();
        for shape in [
            PulseShape::Gaussian { bandwidth_hz: 1.5e9 },
            PulseShape::Samples { rate_hz: 4e9, envelope: samples, zero: 4 },
        ] {
            let dt = 1e-12;
            let reach = if matches!(shape, PulseShape::Gaussian { .. }) { 4e-9 } else { 400e-9 };
            let n = (reach / dt) as i64;
            for f in [0.0, 0.4e9, -0.75e9] {
                let sum: Complex64 = (-n..n)
                    .step_by(if reach > 1e-8 { 20 } else { 1 })
                    .map(|i| {
                        let t = i as f64 * dt;
                        shape.at(t) * Complex64::cis(-TAU * f * t)
                    })
                    .sum::<Complex64>()
                    * dt
                    * if reach > 1e-8 { 20.0 } else { 1.0 };
                let error = (sum - shape.spectrum(f)).norm() / shape.spectrum(0.0).norm();
                assert!(error < 2e-3, "{shape:?} at {f}: {error}");
            }
        }
        let g = PulseShape::Gaussian { bandwidth_hz: 1.5e9 };
        let db = |f: f64| 20.0 * (g.spectrum(f).norm() / g.spectrum(0.0).norm()).log10();
        assert!((db(0.75e9) + 10.0).abs() < 1e-9);
        assert!((db(g.half_band_hz()) + 140.0).abs() < 1e-6);
        assert!((g.at(g.extent_s().0).norm() - NOTHING).abs() < 1e-12);
    }

    #[test]
    fn hadamard_signs_are_orthogonal() {
        for n in [1usize, 2, 3, 4, 5, 8] {
            let slots = Multiplex::Bpm.slots(n);
            for a in 0..n {
                for b in 0..n {
                    let dot: f64 =
                        (0..slots).map(|s| Multiplex::Bpm.weight(s, a) * Multiplex::Bpm.weight(s, b)).sum();
                    assert_eq!(dot, if a == b { slots as f64 } else { 0.0 });
                }
            }
        }
    }
}
