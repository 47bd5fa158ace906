//! A radar with other settings of its processing, named as the keys of its file name them.

use super::radar::Radar;
use super::radar_toml::{parse, to_toml};
use crate::base::error::{BadInput, Error, Result};
use serde_json::{Map, Value};
use std::path::Path;

/// The radar with some keys of `[processing]` changed. `changes` has the keys of a radar file: a window may be its name alone, and the
/// tables `angle` and `cfar` keep what is not named, but that the rank of an OS detector follows its window where no rank is given. What
/// is not changed stays as it is to the bit.
///
/// # Errors
/// Returns an error for an unknown key and for a value outside its range, as for a radar file.
pub fn with_processing(radar: &Radar, changes: &Map<String, Value>) -> Result<Radar> {
    if changes.is_empty() {
        return Ok(radar.clone());
    }
    let mut file: toml::Table = toml::from_str(&to_toml(radar)?)
        .map_err(|e| Error::Failed(format!("radar '{}' as TOML: {e}", radar.name)))?;
    let table = file
        .get_mut("processing")
        .and_then(toml::Value::as_table_mut)
        .ok_or_else(|| Error::Failed(format!("radar '{}' has no processing", radar.name)))?;
    // The file of a calibration lies wherever it was read, and is not read again.
    let calibration = part(table, "angle").and_then(|angle| angle.remove("calibration")).is_some()
        && !names(changes, "angle", "calibration");
    for (key, value) in changes {
        let value = match value {
            Value::String(name) if key.ends_with("_window") => serde_json::json!({ "kind": name }),
            other => other.clone(),
        };
        if let (Value::Object(some), Some(all)) = (&value, part(table, key)) {
            if key.ends_with("_window") {
                all.clear();
            }
            if key == "cfar" && some.keys().any(|k| k != "false_alarm_probability") {
                all.remove("rank");
            }
            for (key, value) in some {
                all.insert(key.clone(), converted(key, value)?);
            }
            continue;
        }
        table.insert(key.clone(), converted(key, &value)?);
    }
    let text = toml::to_string(&file).map_err(|e| Error::Failed(format!("processing as TOML: {e}")))?;
    let mut processing = match parse(Path::new(""), &text) {
        Ok(changed) => changed.processing,
        // The lines are those of a text that nobody wrote.
        Err(Error::Input(b)) => return Err(BadInput { file: None, line: None, ..*b }.into()),
        Err(e) => return Err(e),
    };
    // Degrees and radians do not turn into each other to the bit.
    if !changes.contains_key("azimuth_max_deg") {
        processing.azimuth_fov_rad = radar.processing.azimuth_fov_rad;
    }
    if !changes.contains_key("elevation_max_deg") && !changes.contains_key("elevation_bins") {
        processing.elevation_fov_rad = radar.processing.elevation_fov_rad;
    }
    if calibration {
        processing.angle.calibration = radar.processing.angle.calibration.clone();
    }
    Ok(Radar { processing, ..radar.clone() })
}

fn part<'a>(table: &'a mut toml::Table, key: &str) -> Option<&'a mut toml::Table> {
    table.get_mut(key).and_then(toml::Value::as_table_mut)
}

fn names(changes: &Map<String, Value>, table: &str, key: &str) -> bool {
    changes.get(table).and_then(Value::as_object).is_some_and(|t| t.contains_key(key))
}

fn converted(key: &str, value: &Value) -> Result<toml::Value> {
    toml::Value::try_from(value).map_err(|_| {
        BadInput::new("is not a value of a radar file")
            .key(format!("processing.{key}"))
            .value(value)
            .allowed("a number, a word, true or false, a list or a table of them")
            .remedy("leave out the key to use its default")
            .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::radar::{AngleMethod, CfarKind, Window};
    use crate::scene::radar_toml::preset;

    fn changed(changes: Value) -> Result<Radar> {
        let radar = preset("front77").unwrap();
        with_processing(&radar, changes.as_object().unwrap())
    }

    #[test]
    fn named_keys_change_and_others_stay() {
        let radar = preset("front77").unwrap();
        assert_eq!(changed(serde_json::json!({})).unwrap(), radar);
        let one = changed(serde_json::json!({ "range_window": "hamming" })).unwrap();
        assert_eq!(one.processing.range_window, Window::Hamming);
        let mut back = one.clone();
        back.processing.range_window = radar.processing.range_window;
        assert_eq!(back, radar);
        let window = serde_json::json!({ "kind": "dolph-chebyshev", "side_lobe_db": 70.0 });
        let one =
            changed(serde_json::json!({ "angle_window": window, "angle": { "method": "music" } })).unwrap();
        assert_eq!(one.processing.angle_window, Window::DolphChebyshev { side_lobe_db: 70.0 });
        assert_eq!(one.processing.angle.method, AngleMethod::Music);
        let again = with_processing(&one, serde_json::json!({ "angle_window": "hann" }).as_object().unwrap());
        assert_eq!(again.unwrap().processing.angle_window, Window::Hann);
    }

    #[test]
    fn the_rank_follows_the_window() {
        let cfar = |t: Value| changed(serde_json::json!({ "cfar": t })).unwrap().processing.cfar;
        let window = |kind: &str, train: usize| {
            serde_json::json!({ "kind": kind, "train_range_cells": train, "train_doppler_cells": 0,
                "guard_range_cells": 1, "guard_doppler_cells": 0 })
        };
        assert_eq!(cfar(window("os", 8)).kind, CfarKind::Os { rank: 12 });
        assert_eq!(cfar(window("ca", 4)).train, [0, 4]);
        let pfa = serde_json::json!({ "kind": "os", "rank": 3, "false_alarm_probability": 1e-3 });
        assert_eq!((cfar(pfa.clone()).kind, cfar(pfa).pfa), (CfarKind::Os { rank: 3 }, 1e-3));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (changes, part) in [
            (serde_json::json!({ "range_windows": "hann" }), "range_windows"),
            (serde_json::json!({ "range_window": "hat" }), "range_window.kind"),
            (serde_json::json!({ "angle": { "method": "matched" } }), "angle.method"),
            (serde_json::json!({ "range_fft": 2 }), "range_fft"),
            (serde_json::json!({ "range_fft": null }), "range_fft"),
        ] {
            let e = changed(changes).unwrap_err();
            assert!(e.exit_code() == 2 && e.to_string().contains(part), "{e}");
        }
    }
}
