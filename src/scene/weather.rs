//! The weather of a scenario: rain, fog, and water on the road.

use super::material::{self, Layer};
use super::toml_file::{At, Document};
use super::{Scene, material::Material};
use crate::base::error::{BadInput, Result};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// Rain, fog and wet roads; without this table the air is dry and lossless.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WeatherTable {
    /// Rain rate, mm/h; rain attenuates all echoes and adds backscatter. The range is about that of the rates behind ITU-R P.838.
    /// Default 0.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub rain_mm_per_h: f64,
    /// Liquid water content of fog, g/m³.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub fog_g_per_m3: Option<f64>,
    /// Visibility in fog, m; alternative to `fog_g_per_m3`.
    #[schemars(range(min = 10.0, max = 100_000.0))]
    pub visibility_m: Option<At<f64>>,
    /// Air temperature, °C. Default 20.
    #[schemars(range(min = -8.0, max = 50.0))]
    pub temperature_c: Option<f64>,
    /// Wind velocity in the world, m/s; it moves the rain drops. Default 0.
    pub wind_mps: At<[f64; 3]>,
    /// Thickness of the water film on `wet_materials`, mm. Default 0.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub wet_film_mm: f64,
    /// Names of the scene's materials that carry the water film. Default asphalt, concrete and concrete-pavement.
    pub wet_materials: Option<At<Vec<String>>>,
}

/// Weather that has been checked. The default is dry.
#[derive(Debug, Clone, PartialEq)]
pub struct Weather {
    /// Rain, mm/h.
    pub rain_mm_per_h: f64,
    /// Liquid water content of fog, g/m³.
    pub liquid_g_per_m3: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Wind in the world, m/s.
    pub wind_mps: DVec3,
    /// Thickness of the water on wet materials, m.
    pub wet_film_m: f64,
    /// Materials that are wet.
    pub wet_materials: Vec<String>,
    /// Whether the file named them: one that the scene does not have is an error then.
    pub named: bool,
}

impl Default for Weather {
    fn default() -> Self {
        Weather {
            rain_mm_per_h: 0.0,
            liquid_g_per_m3: 0.0,
            temperature_c: 20.0,
            wind_mps: DVec3::ZERO,
            wet_film_m: 0.0,
            wet_materials: ["asphalt", "concrete", "concrete-pavement"].map(String::from).to_vec(),
            named: false,
        }
    }
}

/// Liquid water of fog in g/m^3 through which one sees `visibility_m`: a power law through the two values that ITU-R P.840 gives
/// for fog, 0.05 g/m^3 at 300 m and 0.5 g/m^3 at 50 m.
pub fn liquid_of_visibility_g_per_m3(visibility_m: f64) -> f64 {
    let exponent = 10f64.ln() / 6f64.ln();
    0.05 * (300.0 / visibility_m).powf(exponent)
}

/// Reads the table.
///
/// # Errors
/// Returns an error for numbers out of range, or fog given twice.
pub fn build(doc: &Document<'_>, t: &WeatherTable) -> Result<Weather> {
    let dry = Weather::default();
    let mut w = Weather {
        rain_mm_per_h: t.rain_mm_per_h,
        wind_mps: doc.vector(&t.wind_mps)?,
        wet_film_m: 1e-3 * t.wet_film_mm,
        temperature_c: t.temperature_c.unwrap_or(dry.temperature_c),
        ..dry
    };
    match (&t.fog_g_per_m3, &t.visibility_m) {
        (Some(_), Some(v)) => {
            return Err(doc
                .bad(&v.span, "fog_g_per_m3 and visibility_m exclude each other")
                .remedy("keep one of them")
                .into());
        }
        (Some(m), None) => w.liquid_g_per_m3 = *m,
        (None, Some(v)) => w.liquid_g_per_m3 = liquid_of_visibility_g_per_m3(v.value),
        (None, None) => {}
    }
    if w.wind_mps.length() > 100.0 {
        return Err(doc
            .bad(&t.wind_mps.span, "is too fast")
            .allowed("up to 100 m/s")
            .remedy("give the wind in m/s")
            .into());
    }
    if let Some(names) = &t.wet_materials {
        (w.wet_materials, w.named) = (names.value.clone(), true);
    }
    Ok(w)
}

impl Weather {
    /// Whether neither rain nor fog is in the air.
    pub fn is_dry_air(&self) -> bool {
        self.rain_mm_per_h == 0.0 && self.liquid_g_per_m3 == 0.0
    }

    /// Lays the film of water on the scene's wet materials, over the layers that they have.
    ///
    /// # Errors
    /// Returns an error if the scene does not have a material that is named, or if it would have too many layers.
    pub fn wet(&self, scene: &mut Scene) -> Result<()> {
        if self.wet_film_m == 0.0 {
            return Ok(());
        }
        for name in self.wet_materials.iter().filter(|_| self.named) {
            if !scene.materials.iter().any(|m| is_named(m, name)) {
                let all: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
                return Err(BadInput::new("the scene has no such material")
                    .key("weather.wet_materials")
                    .value(name)
                    .allowed(all.join(", "))
                    .remedy("name one of them")
                    .into());
            }
        }
        let water = material::by_name("water")?;
        for m in &mut scene.materials {
            if self.wet_materials.iter().any(|name| is_named(m, name)) {
                let mut layers = vec![Layer::new(water.clone(), self.wet_film_m)?];
                layers.append(&mut m.layers);
                *m = m.clone().with_layers(layers)?;
            }
        }
        Ok(())
    }
}

/// Whether a material has this name or, with layers on it, its base has it.
fn is_named(m: &Material, name: &str) -> bool {
    m.name == name || m.name.split('+').next() == Some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Weather> {
        let doc = Document::parse("weather.toml", text)?;
        let table: WeatherTable = doc.read()?;
        build(&doc, &table)
    }

    #[test]
    fn reads_and_complains() {
        assert_eq!(read("").unwrap(), Weather::default());
        let w =
            read("rain_mm_per_h = 12.5\nvisibility_m = 50\ntemperature_c = 5\nwet_film_mm = 0.3").unwrap();
        assert!((w.liquid_g_per_m3 - 0.5).abs() < 1e-12 && (w.wet_film_m - 3e-4).abs() < 1e-18);
        assert!((liquid_of_visibility_g_per_m3(300.0) - 0.05).abs() < 1e-15);
        for (text, part) in [
            ("rain_mm_per_h = -1", "weather.toml:1"),
            ("rain_mm_per_h = 300", "0..=200"),
            ("fog_g_per_m3 = 0.1\nvisibility_m = 100", "weather.toml:2"),
            ("visibility_m = 0", "10..=100000"),
            ("temperature_c = -30", "-8..=50"),
            ("wind_mps = [200, 0, 0]", "up to 100 m/s"),
            ("wet_film_mm = 20", "0..=10"),
            ("hail = 1", "hail"),
        ] {
            let e = read(text).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(part), "{text}: {e}");
        }
    }

    #[test]
    fn water_lies_on_what_is_wet() {
        let mut scene = Scene::default();
        for spec in ["asphalt", "asphalt+paint-white:0.0003", "steel"] {
            scene.materials.push(material::parse_spec(spec).unwrap());
        }
        read("wet_film_mm = 0.5").unwrap().wet(&mut scene).unwrap();
        let names = |m: &Material| m.layers.iter().map(|l| l.material.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&scene.materials[0]), ["water"]);
        assert_eq!(names(&scene.materials[1]), ["water", "paint-white"]);
        assert!(scene.materials[2].layers.is_empty());
        let e = read("wet_film_mm = 0.5\nwet_materials = [\"mud\"]").unwrap().wet(&mut scene).unwrap_err();
        assert!(
            e.exit_code() == 2 && e.to_string().contains("'mud'") || e.to_string().contains("mud"),
            "{e}"
        );
    }
}
