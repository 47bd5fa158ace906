//! Thermal noise of the receiver (CONVENTIONS eq. 13).
//!
//! Sample `i` of the cube, row-major, draws the four words of Philox4x32-10 with counter
//! (i lo, i hi, seed hi, stream) and key (seed lo, frame). The first two words w0, w1 give by
//! Box-Muller √(−2 ln u) (cos 2πv, sin 2πv) with u = (⌊w0/256⌋ + 1)/2²⁴ and v = w1/2³²; u is exact
//! in f32, so both engines start from the same numbers. Real sampling uses the cosine alone.

use super::DeviceCube;
use crate::base::units::{BOLTZMANN, T0_K, power_from_db};
use crate::gpu::{Access, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::radar::{Radar, Sampling};

/// Philox stream of the thermal noise.
pub const THERMAL_STREAM: u32 = 0;

/// The noise of one frame: both engines draw the same samples from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of I and of Q ("iq") or of the real sample ("real"), √W. The same
    /// number, √(k T0 F f_s / 2), for both.
    pub sigma: f64,
    /// Whether samples are real or complex.
    pub sampling: Sampling,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of the frame, which selects the random numbers.
    pub frame: u32,
}

impl Noise {
    /// The thermal noise of `radar`, or None when it is switched off.
    ///
    /// # Example
    /// kT₀ is −174 dBm/Hz; with 13 dB of noise figure over 20 MHz that makes −88 dBm in a complex sample.
    ///
    /// ```
    /// use catseye::adc::noise::Noise;
    /// use catseye::base::units::dbm_from_w;
    /// use catseye::scene::radar_toml::preset;
    ///
    /// let mut radar = preset("demo77")?;
    /// // I and Q have half the power each.
    /// let noise_dbm = Noise::thermal(&radar, 1, 0).map(|n| dbm_from_w(2.0 * n.sigma * n.sigma));
    /// assert!(noise_dbm.is_some_and(|p| (p + 173.98 - 13.0 - 73.01).abs() < 0.01));
    /// radar.thermal_noise = false;
    /// assert!(Noise::thermal(&radar, 1, 0).is_none());
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn thermal(radar: &Radar, seed: u64, frame: u32) -> Option<Noise> {
        let power = BOLTZMANN * T0_K * power_from_db(radar.noise_figure_db) * radar.sample_rate_hz;
        radar.thermal_noise.then(|| Noise {
            sigma: (0.5 * power).sqrt(),
            sampling: radar.sampling,
            seed,
            frame,
        })
    }

    /// Philox key of this frame.
    pub fn key(&self) -> [u32; 2] {
        [self.seed as u32, self.frame]
    }

    /// Philox counter of one sample of the cube.
    pub fn counter(&self, index: u64) -> [u32; 4] {
        [index as u32, (index >> 32) as u32, (self.seed >> 32) as u32, THERMAL_STREAM]
    }

    /// Records the addition of the noise to every sample of the cube.
    pub fn record(&self, recorder: &mut Recorder, cube: &DeviceCube) {
        for piece in &cube.pieces {
            let base = (piece.first_chirp * cube.channels * cube.samples) as u64;
            let params = NoiseParams {
                count: piece.data.len() as u32,
                base_lo: base as u32,
                base_hi: (base >> 32) as u32,
                seed_lo: self.seed as u32,
                seed_hi: (self.seed >> 32) as u32,
                frame: self.frame,
                stream: THERMAL_STREAM,
                is_real: u32::from(self.sampling == Sampling::Real),
                sigma: self.sigma as f32,
            };
            recorder.dispatch(&KERNEL, &params, &[&piece.data], Threads::Linear(piece.data.len() as u64));
        }
    }
}

gpu_struct! {
    /// Uniform of `shaders/adc/noise.wgsl`.
    pub struct NoiseParams {
        pub count: u32,
        pub base_lo: u32,
        pub base_hi: u32,
        pub seed_lo: u32,
        pub seed_hi: u32,
        pub frame: u32,
        pub stream: u32,
        pub is_real: u32,
        pub sigma: f32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/noise",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/shared/rng.wgsl"),
        include_str!("../../shaders/adc/noise.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(NoiseParams::LAYOUT),
    storage: &[Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-5,
        reason: "WGSL promises log to 2^-21 absolute near 1 and to 3 ulp elsewhere: 2e-6 in the radius",
    },
};
