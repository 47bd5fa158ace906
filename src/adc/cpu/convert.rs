//! Imbalance, constant, saturation and quantiser, sample by sample in f64 (CONVENTIONS eq. 109-111).

use super::precision::{narrow, wide};
use super::synthesis::Precision;
use crate::adc::Cube;
use crate::adc::convert::{Convert, Quantiser};
use crate::base::tasks::Tasks;
use crate::scene::front_end::{QuantiserKind, SaturationKind};
use catseye_math::Real;
use num_complex::Complex64;
use rayon::prelude::*;

/// Maps every sample.
pub fn apply<T: Precision + Real>(cube: &mut Cube<T>, convert: &Convert) {
    cube.data.par_chunks_mut(4096).for_each_tasks(|samples| {
        for z in samples {
            *z = narrow(sample(convert, wide(*z)));
        }
    });
}

/// What becomes of one sample.
pub fn sample(c: &Convert, z: Complex64) -> Complex64 {
    let one = |x: f64| {
        let x = match c.saturation {
            None => x,
            Some((SaturationKind::Soft, a)) => a * (x / a).tanh(),
            Some((SaturationKind::Hard, a)) => x.clamp(-a, a),
        };
        c.quantiser.map_or(x, |q| quantised(&q, x))
    };
    let re = one(z.re + c.offset[0]);
    if c.is_real {
        return Complex64::from(re);
    }
    Complex64::new(re, one(c.q_from_q * z.im + c.q_from_i * z.re + c.offset[1]))
}

fn quantised(q: &Quantiser, x: f64) -> f64 {
    let most = 2f64.powi(q.bits as i32 - 1);
    let code = |x: f64| x.floor().clamp(-most, most - 1.0);
    match q.kind {
        QuantiserKind::MidTread => q.step * code(x / q.step + 0.5),
        QuantiserKind::MidRise => q.step * (code(x / q.step) + 0.5),
    }
}
