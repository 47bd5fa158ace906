//! Plans of Fourier transforms of any length in f32 and f64, by rustfft.

use rustfft::FftPlanner;
pub use rustfft::{Fft, FftDirection, FftNum, num_traits};
use std::sync::Arc;

/// Number types that transforms run in.
pub trait Plan: FftNum {
    /// The plan of a transform of this length and direction.
    fn plan(length: usize, direction: FftDirection) -> Arc<dyn Fft<Self>>;
}

impl Plan for f32 {
    fn plan(length: usize, direction: FftDirection) -> Arc<dyn Fft<f32>> {
        FftPlanner::new().plan_fft(length, direction)
    }
}

impl Plan for f64 {
    fn plan(length: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
        FftPlanner::new().plan_fft(length, direction)
    }
}

/// X_k = sum_n x_n e^{-j 2 pi k n/length}, not scaled.
pub fn forward<T: Plan>(length: usize) -> Arc<dyn Fft<T>> {
    T::plan(length, FftDirection::Forward)
}

/// The same with e^{+j 2 pi k n/length}, not scaled either.
pub fn inverse<T: Plan>(length: usize) -> Arc<dyn Fft<T>> {
    T::plan(length, FftDirection::Inverse)
}
