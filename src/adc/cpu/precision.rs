//! Complex samples in the precision of the cube and in that of the front end.

use super::synthesis::Precision;
use catseye_math::Real;
use num_complex::{Complex, Complex64};

pub fn wide<T: Real>(z: Complex<T>) -> Complex64 {
    Complex64::new(z.re.wide(), z.im.wide())
}

/// Rounds to the type `T`. It has a name of its own because number types have other ways to round.
pub fn narrow<T: Precision>(z: Complex64) -> Complex<T> {
    T::round(z)
}
