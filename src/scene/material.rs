//! Radar materials: a sourced table for 77 GHz, by name, with validity ranges.

use crate::error::{BadInput, Result};
use crate::units::EPS0;
use num_complex::Complex64;

/// What the surface is made of. Time convention e^{+j omega t}, so eps = eps' - j eps''.
#[derive(Debug, Clone, PartialEq)]
pub enum MaterialKind {
    /// Perfect electric conductor.
    Pec,
    /// Good conductor: eps = 1 - j sigma / (omega eps0).
    Conductor { conductivity_s_per_m: f64 },
    /// Half-space of relative permittivity eps' - j eps'' (both given positive), plus conductivity.
    Dielectric { eps_real: f64, eps_loss: f64, conductivity_s_per_m: f64 },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub kind: MaterialKind,
    /// Standard deviation of the surface's height; 0 is smooth.
    pub roughness_rms_m: f64,
    pub correlation_length_m: f64,
    /// Frequencies for which the value holds; outside it the material is an error.
    pub valid_hz: (f64, f64),
    /// Where the value comes from.
    pub source: String,
}

impl Material {
    pub fn pec() -> Self {
        Material {
            name: "pec".into(),
            kind: MaterialKind::Pec,
            roughness_rms_m: 0.0,
            correlation_length_m: 0.0,
            valid_hz: (0.0, f64::INFINITY),
            source: "definition".into(),
        }
    }

    /// Complex relative permittivity eps' - j eps''; None for a perfect conductor.
    pub fn eps_r(&self, freq_hz: f64) -> Result<Option<Complex64>> {
        let (lo, hi) = self.valid_hz;
        if !(lo..=hi).contains(&freq_hz) {
            return Err(BadInput::new(format!(
                "material '{}' has no value at {:.4} GHz",
                self.name,
                freq_hz / 1e9
            ))
            .allowed(format!("{:.3}..{:.3} GHz", lo / 1e9, hi / 1e9))
            .remedy("give eps_r or conductivity_s_per_m in the material's extras.catseye")
            .into());
        }
        let loss = |s: f64| s / (std::f64::consts::TAU * freq_hz * EPS0);
        Ok(match self.kind {
            MaterialKind::Pec => None,
            MaterialKind::Conductor { conductivity_s_per_m } => {
                Some(Complex64::new(1.0, -loss(conductivity_s_per_m)))
            }
            MaterialKind::Dielectric { eps_real, eps_loss, conductivity_s_per_m } => {
                Some(Complex64::new(eps_real, -(eps_loss + loss(conductivity_s_per_m))))
            }
        })
    }
}
