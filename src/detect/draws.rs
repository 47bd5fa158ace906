//! Random numbers of the tests.

use crate::rng::philox4x32_10;
use std::f64::consts::TAU;

/// A stream of its own for each (seed, stream).
pub struct Draws {
    key: [u32; 2],
    next: u32,
}

impl Draws {
    pub fn new(seed: u32, stream: u32) -> Draws {
        Draws { key: [seed, stream], next: 0 }
    }

    /// Above 0, below 1.
    pub fn uniform(&mut self) -> f64 {
        let [w, ..] = philox4x32_10([self.next, 0, 0, 0], self.key);
        self.next += 1;
        (f64::from(w) + 0.5) / 4_294_967_296.0
    }

    /// Mean 0, variance 1 (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}
