//! The physics of `catseye rcs` as a page of the browser calls it: kinds of reflectors with their parameters, their meshes, and their
//! scattering over direction. `crates/view` embeds the module that this crate becomes for wasm32.

use catseye::base::error::{BadInput, Result};
use catseye::engine::{Engine, Precision};
use catseye::rcs::{Aspect, BistaticAspect, Diffraction, RcsOptions};
use catseye::road::reflector::{self, Kind, Param, Range, Reflector};
use catseye::scene::{Scene, Shape, gltf, material};
use serde_json::{Value, json};

#[cfg(target_arch = "wasm32")]
mod page;

/// Most directions of one cut: what a page still draws while a slider moves.
pub const MOST_DIRECTIONS: usize = 20_000;

/// All kinds of reflectors as JSON: name, summary, pose, boresight in degrees, and of each parameter its name, doc, default and range.
pub fn kinds() -> Value {
    reflector::kinds().iter().filter(|k| k.name != "point").map(|k| kind(k)).collect()
}

fn kind(k: &Kind) -> Value {
    let (azimuth, elevation) = k.boresight_deg;
    json!({
        "name": k.name, "summary": k.summary, "pose": k.pose, "boresight_deg": [azimuth, elevation],
        "material": k.material, "parameters": k.params.iter().map(parameter).collect::<Vec<_>>(),
    })
}

fn parameter(p: &Param) -> Value {
    let range = match p.range {
        Range::Number { default, min, max } => {
            json!({ "number": true, "default": default, "min": min, "max": max })
        }
        Range::Whole { default, min, max } => {
            json!({ "whole": true, "default": default, "min": min, "max": max })
        }
        Range::Material(default) => json!({ "material": true, "default": default }),
        Range::Choice(words) => json!({ "choice": words, "default": words[0] }),
    };
    let mut out = json!({ "name": p.name, "doc": p.doc, "allowed": p.allowed() });
    if let (Some(out), Some(range)) = (out.as_object_mut(), range.as_object()) {
        out.extend(range.clone());
    }
    out
}

/// Names of all radar materials.
pub fn materials() -> Vec<&'static str> {
    material::names().collect()
}

/// The scene of a specification such as `type1:width_m=0.16,height_m=0.004`.
///
/// # Errors
/// Returns `BadInput` of one line for an unknown kind or parameter, a value out of range, or parameters that do not go together.
pub fn scene(spec: &str) -> Result<Scene> {
    Reflector::parse(spec)?.to_scene(&material::parse_spec)
}

/// Corners of all triangles of a scene, `[triangle, corner, 3]`, m.
pub fn corners(scene: &Scene) -> Vec<f32> {
    let mut out = Vec::new();
    for o in &scene.objects {
        let Shape::Mesh(m) = o.shape else { continue };
        let mesh = &scene.meshes[m];
        for i in mesh.triangles.iter().flatten() {
            out.extend(o.pose.point(mesh.positions_m[*i as usize]).as_vec3().to_array());
        }
    }
    out
}

/// The scene as binary glTF.
///
/// # Errors
/// Returns an error if a material cannot be written.
pub fn glb(scene: &Scene) -> Result<Vec<u8>> {
    gltf::to_glb(scene)
}

/// What a cut is taken at.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut<'a> {
    /// Hz.
    pub frequency_hz: f64,
    /// Azimuth of each direction, degrees.
    pub azimuth_deg: &'a [f64],
    /// Elevation of each direction, degrees.
    pub elevation_deg: &'a [f64],
    /// Reflections that are followed.
    pub bounces: usize,
    /// Whether edges diffract (PTD).
    pub ptd: bool,
}

/// S towards each direction by exact beams: re and im of VV, VH, HV and HH in m, `[direction, 8]`, as the columns of an RCS table have
/// them (first letter receive).
///
/// # Errors
/// Returns `BadInput` for lists of unequal length or of too many directions, for numbers that are out of range, and for bodies that
/// waves cannot be followed through.
pub fn cut(scene: &Scene, cut: &Cut<'_>) -> Result<Vec<f64>> {
    let n = cut.azimuth_deg.len();
    if n != cut.elevation_deg.len() || n > MOST_DIRECTIONS {
        let bad =
            BadInput::new("the numbers of azimuths and elevations must be equal").key("directions").value(n);
        return Err(bad.allowed(format!("up to {MOST_DIRECTIONS}")).remedy("use larger steps").into());
    }
    let looks: Vec<BistaticAspect> = cut
        .azimuth_deg
        .iter()
        .zip(cut.elevation_deg)
        .map(|(a, e)| {
            BistaticAspect::monostatic(Aspect { azimuth: a.to_radians(), elevation: e.to_radians() })
        })
        .collect();
    let diffraction = if cut.ptd { Diffraction::Ptd } else { Diffraction::None };
    let options = RcsOptions { bounces: cut.bounces, diffraction, last: false, ..RcsOptions::default() };
    let found = Engine::Cpu(Precision::F64).rcs(scene, &[cut.frequency_hz], &looks, &options)?;
    Ok(found.iter().flat_map(|s| s.every.into_iter().flatten()).flat_map(|z| [z.re, z.im]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_has_its_closed_form() {
        // sigma = 4 pi (ab)^2 / lambda^2 towards the normal.
        let s = scene("plate:width_m=0.1,height_m=0.05").unwrap();
        let at = Cut {
            frequency_hz: 77e9,
            azimuth_deg: &[0.0, 3.0],
            elevation_deg: &[0.0, 0.0],
            bounces: 1,
            ptd: false,
        };
        let found = cut(&s, &at).unwrap();
        assert_eq!(found.len(), 16);
        let sigma = 4.0 * std::f64::consts::PI * (found[0] * found[0] + found[1] * found[1]);
        let lambda: f64 = 299_792_458.0 / 77e9;
        let want = 4.0 * std::f64::consts::PI * (0.1f64 * 0.05).powi(2) / lambda.powi(2);
        assert!((sigma / want - 1.0).abs() < 1e-6, "{sigma} {want}");
        assert!(found[8].hypot(found[9]) < found[0].hypot(found[1]));
    }

    #[test]
    fn kinds_have_ranges_and_bad_values_are_told() {
        let all = kinds();
        let type1 = all.as_array().unwrap().iter().find(|k| k["name"] == "type1").unwrap();
        let width = &type1["parameters"][0];
        assert_eq!(width["name"], "width_m");
        assert!(
            width["min"].as_f64() < width["default"].as_f64()
                && width["default"].as_f64() < width["max"].as_f64()
        );
        let told = scene("type1:width_m=-1").unwrap_err().to_string();
        assert!(told.contains("width_m") && told.contains("allowed"), "{told}");
        assert!(materials().contains(&"aluminium"));
        // Every kind builds as it is.
        for k in all.as_array().unwrap() {
            let s = scene(k["name"].as_str().unwrap()).unwrap();
            assert!(corners(&s).len().is_multiple_of(9) && !glb(&s).unwrap().is_empty(), "{}", k["name"]);
        }
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let s = scene("sphere").unwrap();
        let at = Cut { frequency_hz: 77e9, azimuth_deg: &[0.0], elevation_deg: &[], bounces: 1, ptd: false };
        assert!(
            cut(&s, &at)
                .unwrap_err()
                .to_string()
                .contains("the numbers of azimuths and elevations must be equal")
        );
    }
}
