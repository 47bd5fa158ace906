//! Whether a TOML file can be read as what it is meant to be.

use super::keys;
use catseye::base::error::{BadInput, Error, Result};
use catseye::road::site::Site;
use catseye::road::{build, scene_toml};
use catseye::scene::{radar_toml, scenario};
use catseye_io::recipe::Recipe;
use catseye_papers::study;
use serde_json::{Value, json};
use std::path::Path;

/// The kind of file whose top keys a text has, as far as they tell one from the others.
///
/// # Errors
/// Returns `BadInput` for a text whose keys do not tell.
pub fn kind_of(file: &Path, text: &str) -> Result<&'static str> {
    let asked = |problem: &str| -> Error {
        let bad = BadInput::new(problem).file(file).key("kind").allowed(keys::kinds().join(", "));
        bad.remedy("state the kind").into()
    };
    let Ok(table) = text.parse::<toml::Table>() else {
        return Err(asked("the keys cannot be read, so the kind of the file is unknown"));
    };
    let mut known: Vec<(usize, &'static str)> = Vec::new();
    for kind in keys::kinds() {
        let top = keys::top(kind)?;
        known.push((table.keys().filter(|k| top.contains(k)).count(), kind));
    }
    known.sort_by_key(|k| std::cmp::Reverse(k.0));
    match known[..] {
        [(most, kind), (next, _), ..] if most > next => Ok(kind),
        _ => Err(asked("the keys do not determine the kind of the file")),
    }
}

/// Reads a text as a file of this kind, with all that it names, and builds what it describes. Returns what it holds.
///
/// # Errors
/// Returns the error of the reader: file, line, key, value, what is allowed, and the remedy.
pub fn read(kind: &str, file: &Path, text: &str) -> Result<Value> {
    Ok(match kind {
        "scenario" => {
            let scenario = scenario::parse(file, text)?;
            let site = Site::new(&scenario)?;
            json!({
                "name": scenario.name,
                "frames": scenario.frames.count,
                "radars": site.scenario.radars.iter().map(radar_json).collect::<Vec<_>>(),
                "objects": site.scene.objects.len(),
                "triangles": site.scene.triangle_count(),
            })
        }
        "road" => {
            let plan = scene_toml::parse(file, text)?;
            let (scene, _) = build::build(&plan)?;
            json!({
                "name": plan.name,
                "roads": plan.roads.len(),
                "objects": scene.objects.len(),
                "triangles": scene.triangle_count(),
            })
        }
        "radar" => radar_json(&radar_toml::parse(file, text)?),
        "recipe" => {
            let recipe = Recipe::parse(file, text, None)?;
            recipe.check_built()?;
            let [train, validation, test] = recipe.split_counts();
            json!({ "frames": recipe.frames(), "scenes": { "train": train, "validation": validation, "test": test } })
        }
        _ => {
            study::file::parse(file, text, false)?;
            json!({})
        }
    })
}

/// What a radar is, by the figures that follow from its file.
pub fn radar_json(radar: &catseye::scene::radar::Radar) -> Value {
    json!({
        "name": radar.name,
        "carrier_hz": radar.carrier_hz,
        "bandwidth_hz": radar.bandwidth_hz(),
        "max_range_m": radar.max_range_m(),
        "range_bin_m": radar.range_bin_m(),
        "max_range_rate_mps": radar.max_velocity_mps(),
        "range_rate_bin_mps": radar.velocity_bin_mps(),
        "samples": radar.samples,
        "chirps": radar.chirps,
        "transmitters": radar.tx.len(),
        "receivers": radar.rx.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::scene::scenario::template;

    #[test]
    fn files_are_told_apart_and_read() {
        for kind in keys::kinds() {
            let text = template(kind).unwrap();
            assert_eq!(kind_of(Path::new("f.toml"), text).unwrap(), kind);
        }
        let radar = read("radar", Path::new("r.toml"), template("radar").unwrap()).unwrap();
        let parsed = radar_toml::parse(Path::new("r.toml"), template("radar").unwrap()).unwrap();
        assert_eq!(radar["max_range_m"], json!(parsed.max_range_m()));
        let e = read("road", Path::new("r.toml"), "name = \"x\"\nrode = 1\n").unwrap_err().to_string();
        assert!(e.starts_with("r.toml:2: ") && e.contains("rode"), "{e}");
        assert!(kind_of(Path::new("f.toml"), "name = \"x\"").is_err());
    }
}
