//! The 2 × 2 complex matrix of two polarisations.

use num_complex::Complex64;

/// What one of two polarisations becomes of another: the row is that of the receiver, the column that of the transmitter, each V and
/// then H. Scattering matrices are in m (σ = 4π |S|²), gains of paths in 1/m.
pub type Matrix2 = [[Complex64; 2]; 2];

/// A matrix of values that nobody has worked out.
pub const UNKNOWN: Matrix2 = [[Complex64::new(f64::NAN, f64::NAN); 2]; 2];

/// Adds `m` times `factor` to `sum`.
#[inline]
pub fn add_scaled(sum: &mut Matrix2, m: &Matrix2, factor: Complex64) {
    for (to, from) in sum.iter_mut().flatten().zip(m.iter().flatten()) {
        *to += from * factor;
    }
}
