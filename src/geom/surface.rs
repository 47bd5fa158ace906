//! Materials at one frequency.

use crate::base::error::{BadInput, Result};
use crate::em::clutter::{self, Front, Sigma0};
use crate::em::fresnel::{rayleigh_factor, transmission_roughness_factor};
use crate::em::layers::{Backing, Layer, Stack};
use crate::em::roughness::{Lobe, Shares};
use crate::scene::backscatter::{Backscatter, Law};
use crate::scene::{Material, MaterialKind, Scene};
use num_complex::Complex64;

/// A material at one frequency: a conductor, a half-space, or layers on one of these or on air.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Its layers and what lies behind them.
    pub stack: Stack,
    /// Standard deviation of the front's height, m; 0 is smooth.
    pub roughness_rms_m: f64,
    /// Law of backscatter; None takes Lambert's lobe of what the roughness takes from the mirror reflection.
    pub backscatter: Option<Backscatter>,
}

impl Surface {
    /// A material at a frequency.
    ///
    /// # Errors
    /// Returns an error for a material without a value at this frequency, or a perfect conductor as a layer.
    pub fn of(material: &Material, freq_hz: f64) -> Result<Surface> {
        let backing = match (&material.kind, material.eps_r(freq_hz)?) {
            (_, None) => Backing::Pec,
            (MaterialKind::Air, _) => Backing::Air,
            // However it is written: what is like air bounds nothing.
            (_, Some(eps)) if eps == Complex64::ONE => Backing::Air,
            (_, Some(eps)) => Backing::HalfSpace(eps),
        };
        let layers = material.layers.iter().map(|l| match l.material.eps_r(freq_hz)? {
            Some(eps_r) => Ok(Layer { eps_r, thickness_m: l.thickness_m }),
            None => Err(BadInput::new("a perfect conductor hides the layers under it")
                .key(format!("layer of '{}'", material.name))
                .value(&l.material.name)
                .remedy("make it the base, and remove the layers under it")
                .into()),
        });
        let stack = Stack { layers: layers.collect::<Result<_>>()?, backing };
        if material.backscatter.is_some_and(|b| b.law == Law::Oh) && material.roughness_rms_m == 0.0 {
            return Err(BadInput::new(format!(
                "material '{}' has no roughness, from which its backscatter is computed",
                material.name
            ))
            .key("backscatter")
            .value("oh")
            .remedy("give roughness_rms_m, or use another law")
            .into());
        }
        let backscatter = material.backscatter;
        Ok(Surface { stack, roughness_rms_m: material.roughness_rms_m, backscatter })
    }

    /// Reflection coefficients (R_perp, R_par) of the coherent field at incidence cosine `cos_i` in (0, 1] and
    /// `wavenumber` rad/m (CONVENTIONS eq. 4 and 22), with the phase on the front.
    #[inline]
    pub fn reflection(&self, wavenumber: f64, cos_i: f64) -> (Complex64, Complex64) {
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        if self.roughness_rms_m == 0.0 {
            return (perp, par);
        }
        let loss = rayleigh_factor(wavenumber, self.roughness_rms_m, cos_i);
        (perp * loss, par * loss)
    }

    /// Shares of the incident power that the roughness turns from coherent into diffuse scattering,
    /// [perpendicular, parallel] (CONVENTIONS eq. 27).
    pub fn diffuse_share(&self, wavenumber: f64, cos_i: f64) -> [f64; 2] {
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        [perp, par].map(|r| Shares::of(r, wavenumber, self.roughness_rms_m, cos_i).diffuse)
    }

    /// Whether the surface scatters diffusely.
    pub fn is_rough(&self) -> bool {
        self.roughness_rms_m > 0.0 || self.backscatter.is_some()
    }

    /// Backscatter per area beside the mirror reflection (CONVENTIONS eq. 27, 145-147), and the correlation of VV
    /// with HH. Where the material says no more than its roughness it is that of Lambert's law with facets that
    /// turn no polarisation (correlation 1, nothing across).
    pub fn sigma0(&self, wavenumber: f64, cos_i: f64) -> (Sigma0, f64) {
        let Some(backscatter) = &self.backscatter else {
            let [hh, vv] =
                self.diffuse_share(wavenumber, cos_i).map(|s| Lobe::Lambert.backscatter_sigma0(s, cos_i));
            return (Sigma0 { vv, hh, hv: 0.0 }, 1.0);
        };
        let (perp, par) = self.stack.reflection(wavenumber, cos_i);
        let front = Front {
            reflectivity: [perp, par].map(|r| r.norm_sqr()),
            nadir_reflectivity: self.stack.reflection(wavenumber, 1.0).0.norm_sqr(),
            roughness_rms_m: self.roughness_rms_m,
        };
        (clutter::sigma0(backscatter, wavenumber, &front, cos_i), backscatter.copolar_correlation)
    }

    /// Transmission coefficients (T_perp, T_par) of a free-standing sheet: the coherent field behind it over that
    /// without it (CONVENTIONS eq. 23 and 24). None when nothing passes, or not into air.
    pub fn transmission(&self, wavenumber: f64, cos_i: f64) -> Option<(Complex64, Complex64)> {
        if self.stack.backing != Backing::Air {
            return None;
        }
        let (perp, par) = self.stack.response(wavenumber, cos_i).transmission;
        let loss =
            self.stack.layers.first().map_or(1.0, |l| {
                transmission_roughness_factor(wavenumber, self.roughness_rms_m, l.eps_r, cos_i)
            });
        Some((perp * loss, par * loss))
    }
}

/// The scene's materials at a frequency, in their order.
///
/// # Errors
/// Returns an error if a material has no value at that frequency.
pub fn surfaces_at(scene: &Scene, freq_hz: f64) -> Result<Vec<Surface>> {
    of_materials(&scene.materials, freq_hz)
}

pub(super) fn of_materials(materials: &[Material], freq_hz: f64) -> Result<Vec<Surface>> {
    materials.iter().map(|m| Surface::of(m, freq_hz)).collect()
}
