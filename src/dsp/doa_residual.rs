//! What a measured array has over its ideal one, between the angles of the measurement.

use num_complex::Complex64;

/// Smooth part of a calibration: measured vectors over those of the manifold.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    pub(super) azimuth_rad: Vec<f64>,
    pub(super) elevation_rad: Vec<f64>,
    pub(super) channels: usize,
    pub(super) ratio: Vec<Complex64>,
}

impl Residual {
    /// An axis of one angle holds for all.
    pub(super) fn covers(&self, azimuth_rad: f64, elevation_rad: f64) -> bool {
        let within = |axis: &[f64], x: f64| {
            axis.len() == 1 || (x >= axis[0] - 1e-9 && x <= axis[axis.len() - 1] + 1e-9)
        };
        within(&self.azimuth_rad, azimuth_rad) && within(&self.elevation_rad, elevation_rad)
    }

    /// Linear between the angles in both axes, constant beyond them.
    pub(super) fn at(&self, azimuth_rad: f64, elevation_rad: f64) -> Vec<Complex64> {
        let (i, u) = bracket(&self.azimuth_rad, azimuth_rad);
        let (j, v) = bracket(&self.elevation_rad, elevation_rad);
        let cols = self.azimuth_rad.len();
        let (i1, j1) = ((i + 1).min(cols - 1), (j + 1).min(self.elevation_rad.len() - 1));
        let at = |j: usize, i: usize, c: usize| self.ratio[(j * cols + i) * self.channels + c];
        (0..self.channels)
            .map(|c| {
                (at(j, i, c) * (1.0 - u) + at(j, i1, c) * u) * (1.0 - v)
                    + (at(j1, i, c) * (1.0 - u) + at(j1, i1, c) * u) * v
            })
            .collect()
    }

    /// Mean over all angles, for each channel.
    pub(super) fn mean(&self) -> Vec<Complex64> {
        let places = (self.ratio.len() / self.channels) as f64;
        (0..self.channels)
            .map(|c| self.ratio.iter().skip(c).step_by(self.channels).sum::<Complex64>() / places)
            .collect()
    }
}

fn bracket(axis: &[f64], x: f64) -> (usize, f64) {
    let last = axis.len() - 1;
    if last == 0 || x <= axis[0] {
        return (0, 0.0);
    }
    if x >= axis[last] {
        return (last, 0.0);
    }
    let i = axis.partition_point(|a| *a <= x) - 1;
    (i, (x - axis[i]) / (axis[i + 1] - axis[i]))
}
