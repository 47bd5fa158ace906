//! A radar with other settings of its processing, named as the keys of its file name them.

use super::radar::Radar;
use super::radar_toml::{ProcessingTable, processing, processing_table};
use super::toml_file::Document;
use crate::base::error::{BadInput, Error, Result};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

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
    let failed = |e: toml::ser::Error| Error::Failed(format!("radar '{}' as TOML: {e}", radar.name));
    let mut table = toml::Table::try_from(processing_table(radar)).map_err(failed)?;
    // The file of a calibration is wherever it was read, and is not read again.
    let calibration = part(&mut table, "angle").and_then(|angle| angle.remove("calibration_file")).is_some()
        && !names(changes, "angle", "calibration_file");
    for (key, value) in changes {
        let value = match value {
            Value::String(name) if key.ends_with("_window") => serde_json::json!({ "kind": name }),
            other => other.clone(),
        };
        if let (Value::Object(some), Some(all)) = (&value, part(&mut table, key)) {
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
    let text = toml::to_string(&toml::Table::from_iter([("processing".to_string(), table.into())]));
    let text = text.map_err(failed)?;
    let mut changed = radar.clone();
    let made = Document::parse("", &text)
        .and_then(|doc| processing(&doc, &doc.read::<File>()?.processing, &mut changed));
    made.map_err(|e| match e {
        // The lines are those of a text that the user did not write.
        Error::Input(b) => BadInput { file: None, line: None, ..*b }.into(),
        e => e,
    })?;
    // Degrees and radians do not turn into each other to the bit.
    if !changes.contains_key("azimuth_max_deg") {
        changed.processing.azimuth_fov_rad = radar.processing.azimuth_fov_rad;
    }
    if !changes.contains_key("elevation_max_deg") && !changes.contains_key("elevation_bins") {
        changed.processing.elevation_fov_rad = radar.processing.elevation_fov_rad;
    }
    if calibration {
        changed.processing.angle.calibration = radar.processing.angle.calibration.clone();
    }
    Ok(changed)
}

/// A radar file of which only the processing is read.
#[derive(Deserialize, JsonSchema)]
struct File {
    processing: ProcessingTable,
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
    use crate::scene::radar::{AngleMethod, CalibrationFile, CfarKind, Window};
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
    fn a_calibration_is_kept_and_not_read_again() {
        let mut radar = preset("front77").unwrap();
        let calibration = CalibrationFile { path: "gone/array.csv".into(), text: "as it was read".into() };
        radar.processing.angle.calibration = Some(calibration);
        let changes = serde_json::json!({ "cfar": { "false_alarm_probability": 1e-3 } });
        let changed = with_processing(&radar, changes.as_object().unwrap()).unwrap();
        assert_eq!(changed.processing.angle, radar.processing.angle);
        assert_eq!(changed.processing.cfar.pfa, 1e-3);
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
