//! From the analog sample to the converter's output, sample by sample: imbalance of I and Q, constant of the
//! mixer, saturation, quantiser (CONVENTIONS eq. 109-111).

use super::DeviceCube;
use crate::base::units::{power_from_db, w_from_dbm};
use crate::gpu::{Access, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::scene::front_end::{Adc, DcOffset, FrontEndSettings, IqImbalance, QuantiserKind, SaturationKind};
use crate::scene::radar::Sampling;
use num_complex::Complex64;
use std::f64::consts::SQRT_2;

/// The conversion that is applied to each sample; both engines apply the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convert {
    /// Whether samples are real (I alone).
    pub is_real: bool,
    /// Q becomes q_from_q Q + q_from_i I.
    pub q_from_q: f64,
    /// Share of I that leaks into Q.
    pub q_from_i: f64,
    /// Added to I and to Q, √W.
    pub offset: [f64; 2],
    /// Limit A, √W.
    pub saturation: Option<(SaturationKind, f64)>,
    /// The quantiser; None where samples are not quantised.
    pub quantiser: Option<Quantiser>,
}

/// A quantiser of 2^bits levels, one step apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    /// Δ = 2A/2^bits, √W.
    pub step: f64,
    /// Codes go from −2^(bits−1) to 2^(bits−1) − 1.
    pub bits: u32,
    /// How a level is chosen from the two next to a sample.
    pub kind: QuantiserKind,
}

impl Convert {
    /// The conversion for these settings; None when it would change nothing.
    pub fn new(settings: &FrontEndSettings, sampling: Sampling) -> Option<Convert> {
        let is_real = sampling == Sampling::Real;
        let iq = if is_real { None } else { settings.iq };
        if iq.is_none() && settings.dc.is_none() && settings.saturation.is_none() && settings.adc.is_none() {
            return None;
        }
        let IqImbalance { gain_db, phase_rad } = iq.unwrap_or_default();
        let gain = power_from_db(gain_db).sqrt();
        let DcOffset { i, q } = settings.dc.unwrap_or_default();
        Some(Convert {
            is_real,
            q_from_q: gain * phase_rad.cos(),
            q_from_i: -gain * phase_rad.sin(),
            offset: [i, if is_real { 0.0 } else { q }],
            saturation: settings.saturation.map(|s| (s.kind, peak(s.full_scale_dbm, sampling))),
            quantiser: settings.adc.map(|a| Quantiser::new(&a, sampling)),
        })
    }

    /// Records the map of every sample of the cube.
    pub fn record(&self, recorder: &mut Recorder, cube: &DeviceCube) {
        for piece in &cube.pieces {
            let (saturation, limit) = match self.saturation {
                None => (0, 1.0),
                Some((SaturationKind::Soft, a)) => (1, a),
                Some((SaturationKind::Hard, a)) => (2, a),
            };
            let quantiser = self.quantiser.map_or(0, |q| match q.kind {
                QuantiserKind::MidTread => 1,
                QuantiserKind::MidRise => 2,
            });
            let bits = self.quantiser.map_or(1, |q| q.bits);
            let params = ConvertParams {
                count: piece.data.len() as u32,
                is_real: u32::from(self.is_real),
                saturation,
                quantiser,
                q_from_q: self.q_from_q as f32,
                q_from_i: self.q_from_i as f32,
                offset_i: self.offset[0] as f32,
                offset_q: self.offset[1] as f32,
                limit: limit as f32,
                step: self.quantiser.map_or(1.0, |q| q.step) as f32,
                largest_code: ((1u32 << (bits - 1)) - 1) as f32,
            };
            recorder.dispatch(&KERNEL, &params, &[&piece.data], Threads::Linear(piece.data.len() as u64));
        }
    }
}

impl Quantiser {
    /// The quantiser of a converter for real or complex samples.
    pub fn new(adc: &Adc, sampling: Sampling) -> Quantiser {
        let step = 2.0 * peak(adc.full_scale_dbm, sampling) / 2f64.powi(adc.bits as i32);
        Quantiser { step, bits: adc.bits, kind: adc.kind }
    }

    /// Variance of the error of one real sample while the range is not left, W: Δ²/12.
    pub fn noise_w(&self) -> f64 {
        self.step * self.step / 12.0
    }
}

/// Largest sample of a tone of this power, √W: √P of each of I and Q, √2P of a real sample (eq. 12).
pub fn peak(full_scale_dbm: f64, sampling: Sampling) -> f64 {
    let amplitude = w_from_dbm(full_scale_dbm).sqrt();
    match sampling {
        Sampling::Iq => amplitude,
        Sampling::Real => SQRT_2 * amplitude,
    }
}

/// Signal to quantisation noise of a tone that fills the range, dB: 3/2 · 4^bits, 6.02 bits + 1.76 dB.
///
/// # Example
/// ```
/// use catseye::adc::convert::full_scale_snr_db;
///
/// assert!((full_scale_snr_db(12) - 74.0).abs() < 0.05);
/// // Each bit adds 6 dB.
/// assert!((full_scale_snr_db(13) - full_scale_snr_db(12) - 6.02).abs() < 0.01);
/// ```
pub fn full_scale_snr_db(bits: u32) -> f64 {
    10.0 * (1.5 * 4f64.powi(bits as i32)).log10()
}

impl IqImbalance {
    /// The factors (K₁, K₂) of y = K₁ x + K₂ x* that the imbalance makes: K₁ = ½(1 + g e^{−jψ}), K₂ = ½(1 − g e^{jψ}).
    pub fn factors(&self) -> (Complex64, Complex64) {
        let g = Complex64::from_polar(power_from_db(self.gain_db).sqrt(), self.phase_rad);
        (0.5 * (1.0 + g.conj()), 0.5 * (1.0 - g))
    }

    /// Power of a tone over that of its image, (1 + 2g cos ψ + g²)/(1 − 2g cos ψ + g²), in dB.
    pub fn image_rejection_db(&self) -> f64 {
        let (k1, k2) = self.factors();
        10.0 * (k1.norm_sqr() / k2.norm_sqr()).log10()
    }
}

gpu_struct! {
    /// Uniform of `shaders/adc/convert.wgsl`.
    pub struct ConvertParams {
        pub count: u32,
        pub is_real: u32,
        pub saturation: u32,
        pub quantiser: u32,
        pub q_from_q: f32,
        pub q_from_i: f32,
        pub offset_i: f32,
        pub offset_q: f32,
        pub limit: f32,
        pub step: f32,
        pub largest_code: f32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "adc/convert",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/adc/convert.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(ConvertParams::LAYOUT),
    storage: &[Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "a sample within rounding of a threshold may take the neighbouring level: at 12 bits a share of 2^-12 of them, each by 2^-11 of the range: 1e-5",
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms() {
        assert!((full_scale_snr_db(12) - (6.0206 * 12.0 + 1.7609)).abs() < 1e-3);
        let iq = IqImbalance { gain_db: 0.5, phase_rad: 2f64.to_radians() };
        let g = 10f64.powf(0.025);
        let c = 2.0 * g * iq.phase_rad.cos();
        let irr = 10.0 * ((1.0 + c + g * g) / (1.0 - c + g * g)).log10();
        assert!((iq.image_rejection_db() - irr).abs() < 1e-9, "{irr}");
        let adc = Adc { bits: 8, full_scale_dbm: 30.0, kind: QuantiserKind::MidTread };
        assert!((Quantiser::new(&adc, Sampling::Iq).step - 2.0 / 256.0).abs() < 1e-15);
        assert!((Quantiser::new(&adc, Sampling::Real).step - 2.0 * SQRT_2 / 256.0).abs() < 1e-15);
        assert_eq!(Convert::new(&FrontEndSettings::default(), Sampling::Iq), None);
    }
}
