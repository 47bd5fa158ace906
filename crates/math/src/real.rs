//! Number types.

/// The two number types that the chain runs in: f32 as on the GPU, f64 as the truth.
pub trait Real: crate::fft::Plan + crate::fft::num_traits::Float + Default + std::iter::Sum {
    /// Rounds to this type.
    fn of(x: f64) -> Self;
    /// The same value in f64.
    fn wide(self) -> f64;
}

impl Real for f32 {
    fn of(x: f64) -> f32 {
        x as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn of(x: f64) -> f64 {
        x
    }
    fn wide(self) -> f64 {
        self
    }
}
