//! What was laid on the reflectors of Feng 2019, section 4.2.5 and Tables 4.2 and 4.3, as plane layers.
//!
//! Thickness is mass over density and area, permittivity comes from sourced values and mixing formulas; no
//! loss is fitted to the measurements. What plane layers cannot do: a sponge that stands higher than
//! the standing plates, the step at a covering's edge, grains and leaves that lie singly, scattering between
//! grains that are not small against the wavelength (see [`mixing`](super::mixing)), and waves that run inside
//! the covering from one plate to another. A grazing wave sees a layer mainly through the phase of its
//! reflection, which these do not spoil.

use super::mixing::{grain_limit_m, independent_scattering_eps, looyenga};
use crate::base::error::{BadInput, Result};
use crate::scene::material::{Layer, Material, MaterialKind, by_name};
use num_complex::Complex64;

/// The document's measurements are at this frequency.
const FREQ_HZ: f64 = 77e9;
/// Permittivities of coverings are given for this band.
const VALID_HZ: (f64, f64) = (76e9, 81e9);

/// Water at 20 deg C, kg/m^3 (CRC Handbook of Chemistry and Physics).
pub const WATER_KG_M3: f64 = 998.2;
/// Quartz, kg/m^3 (CRC Handbook).
pub const GRAIN_KG_M3: f64 = 2650.0;
/// Permittivity of quartz sand grains: eps' 4.7 (Robinson and Friedman, J. Geophys. Res. 108(B2) (2003) 2076)
/// with the loss tangent 0.015 of dry rock at 16 GHz (Ulaby et al. 1990); neither at 77 GHz.
pub const GRAIN_EPS: Complex64 = Complex64::new(4.7, -0.0705);
/// Volume fraction of grains, between loose (0.56, Onoda and Liniger 1990) and close random packing (0.64,
/// Scott and Kilgour 1969) of spheres.
pub const GRAIN_PACKING: f64 = 0.60;
/// Middle of the document's 0.7-1.2 mm.
pub const GRAIN_DIAMETER_M: f64 = 0.95e-3;
/// Fresh leaf tissue, kg/m^3: close to that of water (Vile et al., Annals of Botany 96 (2005) 1129, whose
/// leaf thickness 1/(SLA LDMC) rests on it).
pub const LEAF_KG_M3: f64 = 1000.0;
/// Traffic paint: 15 mil wet (Louisiana Administrative Code 73:III.303) with 60 % solids by volume (a usual
/// least value of such specifications).
pub const PAINT_THICKNESS_M: f64 = 0.6 * 0.375e-3;

/// The part of the sample on which the covering lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// The whole bottom plate of sample G(N).
    Plate,
    /// The triangle between the standing plates, which the document's water and gravel cover.
    Corner,
}

/// Sample G(N) of Table 4.1: W 160 mm, L 117 mm.
pub const SAMPLE_WIDTH_M: f64 = 0.160;
/// Length of the covered samples, m.
pub const SAMPLE_LENGTH_M: f64 = 0.117;

impl Region {
    /// Area of the region, m²: a right-angled isosceles triangle on W, and the rectangle L x W before it.
    pub fn area_m2(self) -> f64 {
        let corner = 0.25 * SAMPLE_WIDTH_M * SAMPLE_WIDTH_M;
        match self {
            Region::Plate => corner + SAMPLE_LENGTH_M * SAMPLE_WIDTH_M,
            Region::Corner => corner,
        }
    }
}

/// A covering and what the document measured with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Covering {
    /// Name that the document gives it.
    pub name: String,
    /// What part of the reflector it lies on.
    pub region: Region,
    /// Mass that was laid on, kg, where the document states one.
    pub mass_kg: Option<f64>,
    /// Thickness of the layer, m.
    pub thickness_m: f64,
    /// Relative permittivity of the layer at 77 GHz.
    pub eps_r: Complex64,
    /// Aluminium under the layer.
    pub material: Material,
    /// Change of the reflection against the bare sample, dB (Table 4.2; paint: section 4.3.3).
    pub measured_change_db: Option<f64>,
    /// Greatest range of detection, m (Table 4.3; 29 m without covering).
    pub measured_range_m: Option<f64>,
    /// Where the layer comes from, and where it does not hold.
    pub remark: String,
}

fn thickness_m(mass_kg: f64, density_kg_m3: f64, area_m2: f64) -> Result<f64> {
    for (key, value) in [("mass_kg", mass_kg), ("area_m2", area_m2)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(BadInput::new("is not positive").key(key).value(value).into());
        }
    }
    Ok(mass_kg / (density_kg_m3 * area_m2))
}

fn mixture(name: &str, eps: Complex64, source: &str) -> Material {
    Material {
        name: name.into(),
        kind: MaterialKind::Dielectric {
            eps_real: eps.re,
            eps_loss: (-eps.im).max(0.0),
            conductivity_s_per_m: 0.0,
        },
        valid_hz: VALID_HZ,
        source: source.into(),
        ..Material::pec()
    }
}

/// A film of water. Fails on a mass or area that is not positive.
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn water(mass_kg: f64, area_m2: f64) -> Result<Layer> {
    Layer::new(by_name("water")?, thickness_m(mass_kg, WATER_KG_M3, area_m2)?)
}

/// How gravel's loss by scattering is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GrainScattering {
    /// Quasi-static mixture: only absorption, the least loss.
    None,
    /// Each grain scatters as if alone: the most.
    Independent,
}

/// Grains of stone with air between (Looyenga). The mean thickness may be less than a grain. Fails on a
/// mass or area that is not positive.
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn gravel(mass_kg: f64, area_m2: f64, scattering: GrainScattering) -> Result<Layer> {
    let air = Complex64::ONE;
    let mix = looyenga(&[(GRAIN_EPS, GRAIN_PACKING), (air, 1.0 - GRAIN_PACKING)])?;
    let eps = match scattering {
        GrainScattering::None => mix,
        GrainScattering::Independent => {
            independent_scattering_eps(mix, GRAIN_EPS, GRAIN_PACKING, GRAIN_DIAMETER_M, FREQ_HZ)?
        }
    };
    let source = "Looyenga mixture of 60 % quartz grains and air, as em::covering";
    Layer::new(
        mixture("gravel-mixture", eps, source),
        thickness_m(mass_kg, GRAIN_KG_M3 * GRAIN_PACKING, area_m2)?,
    )
}

/// Leaves of which tissue fills `tissue_fraction` of the layer, air the rest (Looyenga); 1 is flat and
/// close. Fails on a mass or area that is not positive, or a fraction outside (0, 1].
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn leaves(mass_kg: f64, area_m2: f64, tissue_fraction: f64) -> Result<Layer> {
    let leaf = by_name("leaves")?;
    if !(tissue_fraction > 0.0 && tissue_fraction <= 1.0) {
        return Err(BadInput::new("is not a share of tissue")
            .key("tissue_fraction")
            .value(tissue_fraction)
            .allowed("above 0, up to 1")
            .remedy("1 means leaves without air between them")
            .into());
    }
    let thickness = thickness_m(mass_kg, LEAF_KG_M3 * tissue_fraction, area_m2)?;
    if tissue_fraction == 1.0 {
        return Layer::new(leaf, thickness);
    }
    let tissue = leaf.eps_r(FREQ_HZ)?.unwrap_or(Complex64::ONE);
    let eps = looyenga(&[(tissue, tissue_fraction), (Complex64::ONE, 1.0 - tissue_fraction)])?;
    Layer::new(mixture("leaves-and-air", eps, "Looyenga mixture of leaf tissue and air"), thickness)
}

/// A coat of white traffic paint.
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn white_paint() -> Result<Layer> {
    Layer::new(by_name("paint-white")?, PAINT_THICKNESS_M)
}

/// The document's coverings, spread over the whole plate.
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn coverings() -> Result<Vec<Covering>> {
    coverings_on(Region::Plate)
}

/// The document's coverings, spread over a region of its sample. Gravel stands twice: with the least and
/// the most loss that its grains can cause.
///
/// # Errors
/// Returns an error for amounts that are not positive and finite, or that no layer holds.
pub fn coverings_on(region: Region) -> Result<Vec<Covering>> {
    let area = region.area_m2();
    let mut all = Vec::new();
    let mut add = |name: String,
                   mass_kg: Option<f64>,
                   layer: Layer,
                   (measured_change_db, measured_range_m): (Option<f64>, Option<f64>),
                   remark: String|
     -> Result<()> {
        let eps_r = layer.material.eps_r(FREQ_HZ)?.unwrap_or(Complex64::ONE);
        let thickness_m = layer.thickness_m;
        let base = Material { name: name.clone(), ..by_name("aluminium")? };
        let material = base.with_layers(vec![layer])?;
        all.push(Covering {
            name,
            region,
            mass_kg,
            thickness_m,
            eps_r,
            material,
            measured_change_db,
            measured_range_m,
            remark,
        });
        Ok(())
    };
    for (g, measured) in
        [(20, (Some(-23.0), Some(16.0))), (30, (Some(-25.0), Some(15.0))), (54, (Some(-30.0), Some(11.0)))]
    {
        let mass = 1e-3 * f64::from(g);
        let remark = "a film of pure water, opaque from half a millimetre on, so its mass hardly matters; it was held in a sponge of \
                      unknown size in the corner";
        add(format!("{g} g water"), Some(mass), water(mass, area)?, measured, remark.into())?;
    }
    for (g, measured) in
        [(50, (Some(-27.0), Some(16.0))), (100, (None, Some(15.0))), (150, (None, Some(15.0)))]
    {
        for (scattering, label) in [
            (GrainScattering::None, "gravel"),
            (GrainScattering::Independent, "gravel, grains scattering independently"),
        ] {
            let mass = 1e-3 * f64::from(g);
            let layer = gravel(mass, area, scattering)?;
            let eps = layer.material.eps_r(FREQ_HZ)?.unwrap_or(Complex64::ONE);
            let remark = format!(
                "grains of {:.2} mm, above the {:.2} mm up to which the mixture is sure; the two rows are the least \
                 and the most loss",
                1e3 * GRAIN_DIAMETER_M,
                1e3 * grain_limit_m(eps, FREQ_HZ)
            );
            add(format!("{g} g {label}"), Some(mass), layer, measured, remark)?;
        }
    }
    for (g, measured) in [(8, Some(-27.0)), (16, Some(-32.0))] {
        let mass = 1e-3 * f64::from(g);
        let remark = "fresh tissue without air, lying flat; real leaves lie singly and higher";
        add(format!("{g} g leaves"), Some(mass), leaves(mass, area, 1.0)?, (measured, None), remark.into())?;
    }
    let remark = "usual film of traffic paint, thickness not in the document; loss tangent 0.02 is assumed";
    add("white paint".into(), None, white_paint()?, (Some(-2.5), None), remark.into())?;
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thickness_is_mass_over_area_and_density() {
        // 20 g on 251.2 cm2 is 0.798 mm; the corner's 64 cm2 take four times as much.
        assert!((Region::Plate.area_m2() - 0.02512).abs() < 1e-9);
        assert!((Region::Corner.area_m2() - 0.0064).abs() < 1e-12);
        let all = coverings().unwrap();
        let at = |name: &str| all.iter().find(|c| c.name == name).unwrap();
        assert!((at("20 g water").thickness_m - 0.7976e-3).abs() < 1e-7);
        assert!((at("50 g gravel").thickness_m - 1.2519e-3).abs() < 1e-7);
        assert!((at("8 g leaves").thickness_m - 0.3185e-3).abs() < 1e-7);
        assert_eq!(at("white paint").thickness_m, 0.225e-3);
        let corner = coverings_on(Region::Corner).unwrap();
        let ratio = corner[0].thickness_m / all[0].thickness_m;
        assert!((ratio - 0.02512 / 0.0064).abs() < 1e-12);
    }

    #[test]
    fn every_covering_is_a_passive_layer_on_aluminium() {
        let all = coverings().unwrap();
        assert_eq!(all.len(), 12);
        for c in &all {
            println!(
                "{:45} {:.3} mm eps {:.3} measured {:?}",
                c.name,
                1e3 * c.thickness_m,
                c.eps_r,
                c.measured_change_db
            );
            assert_eq!(c.material.layers.len(), 1);
            assert_eq!(c.material.kind, by_name("aluminium").unwrap().kind);
            assert!(c.eps_r.re >= 1.0 && c.eps_r.im < 0.0, "{} {}", c.name, c.eps_r);
            let e = c.material.layers[0].material.eps_r(FREQ_HZ).unwrap().unwrap();
            assert_eq!(e, c.eps_r);
        }
        // Scattering only adds loss.
        let gravel: Vec<&Covering> = all.iter().filter(|c| c.name.starts_with("50 g gravel")).collect();
        assert!(gravel[1].eps_r.im < gravel[0].eps_r.im && gravel[0].eps_r.re - gravel[1].eps_r.re < 0.5);
    }

    #[test]
    fn air_between_leaves_makes_them_thicker_and_thinner() {
        let (close, loose) = (leaves(8e-3, 0.02, 1.0).unwrap(), leaves(8e-3, 0.02, 0.1).unwrap());
        assert!((loose.thickness_m / close.thickness_m - 10.0).abs() < 1e-9);
        let eps = |l: &Layer| l.material.eps_r(77e9).unwrap().unwrap();
        assert!(eps(&loose).re < 1.6 && eps(&close).re > 3.0);
        for bad in [leaves(8e-3, 0.02, 0.0), water(-1.0, 0.02), water(1.0, f64::NAN)] {
            assert_eq!(bad.unwrap_err().exit_code(), 2);
        }
    }
}
