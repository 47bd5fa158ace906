//! The radars that a dataset contains: their full TOML texts, and the comparison of a given radar with the one that took the samples.
//!
//! `dataset.json` holds the radars of scene 0. The marker of a shard holds those of every scene whose radars have another text, so a
//! dataset whose radars are not drawn holds one text for each.

use catseye::base::error::{BadInput, Error, Result};
use catseye::scene::radar::{CalibrationFile, Radar};
use catseye::scene::radar_toml::{parse, to_toml};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A radar as a dataset contains it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptRadar {
    /// Name of the radar in the scenario.
    pub name: String,
    /// The radar in full as TOML, without its calibration.
    pub toml: String,
    /// Text of the calibration that its angle method reads; None where it reads none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
}

/// Radars of the scenes that differ from those of `dataset.json`, by number of the scene.
pub type RadarsOfScenes = BTreeMap<u32, Vec<KeptRadar>>;

impl KeptRadar {
    /// The text of a radar.
    ///
    /// # Errors
    /// Returns an error for a radar that no TOML describes.
    pub fn of(radar: &Radar) -> Result<KeptRadar> {
        let mut bare = radar.clone();
        let calibration = bare.processing.angle.calibration.take().map(|file| file.text);
        Ok(KeptRadar { name: radar.name.clone(), toml: to_toml(&bare)?, calibration })
    }

    /// The texts of radars.
    ///
    /// # Errors
    /// Returns the errors of [`KeptRadar::of`].
    pub fn all(radars: &[Radar]) -> Result<Vec<KeptRadar>> {
        radars.iter().map(KeptRadar::of).collect()
    }

    /// The radar of the text; `file` is named in errors.
    ///
    /// # Errors
    /// Returns the errors of a radar file for a text that was changed.
    pub fn radar(&self, file: &Path) -> Result<Radar> {
        let mut radar = parse(file, &self.toml)?;
        radar.processing.angle.calibration = self.calibration.as_ref().map(|text| CalibrationFile {
            path: format!("calibration of radar {}", self.name).into(),
            text: text.clone(),
        });
        Ok(radar)
    }
}

/// Keys whose values change no tensor of stored samples: what the simulation alone reads, and what each reader chooses. A key stands for all
/// keys below it.
const FREE: [&str; 21] = [
    "name",
    "mounting",
    "transmitter",
    "front_end",
    "receiver.noise_figure_db",
    "receiver.thermal_noise",
    "tx[].polarisation",
    "tx[].gain_dbi",
    "rx[].polarisation",
    "rx[].gain_dbi",
    "processing.azimuth_bins",
    "processing.azimuth_max_deg",
    "processing.elevation_bins",
    "processing.elevation_max_deg",
    "processing.max_points",
    "processing.group_range_cells",
    "processing.group_doppler_cells",
    "processing.angle",
    "processing.cfar",
    "processing.cluster",
    "antenna",
];
/// Keys of an antenna's pattern, which changes no tensor either.
const PATTERN: [&str; 6] = [
    "pattern",
    "azimuth_exponent",
    "elevation_exponent",
    "table_azimuth_deg",
    "table_elevation_deg",
    "table_gain_db",
];
/// Largest relative difference of numbers that are the same; a text holds angles to rounding.
const SAME: f64 = 1e-9;

/// A key in which two radars differ, with both values; empty where a radar does not have the key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Key as in a radar file, such as `rx[0].position_m`.
    pub key: String,
    /// Value of the first radar.
    pub one: String,
    /// Value of the second radar.
    pub other: String,
}

fn is_free(key: &str) -> bool {
    let mut general = String::new();
    let mut inside = false;
    for c in key.chars() {
        inside = (inside && c != ']') || c == '[';
        if !inside || c == '[' {
            general.push(c);
        }
    }
    let below =
        |free: &str| general.strip_prefix(free).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    let of_pattern = general.split_once("[].").is_some_and(|(_, rest)| PATTERN.contains(&rest));
    of_pattern || FREE.iter().any(|free| below(free))
}

fn compare(key: &str, one: Option<&toml::Value>, other: Option<&toml::Value>) -> Option<Difference> {
    use toml::Value;
    if is_free(key) {
        return None;
    }
    let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    match (one, other) {
        (Some(Value::Table(a)), Some(Value::Table(b))) => {
            let below = |name: &str| if key.is_empty() { name.to_string() } else { format!("{key}.{name}") };
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            names.into_iter().find_map(|name| compare(&below(name), a.get(name), b.get(name)))
        }
        (Some(Value::Array(a)), Some(Value::Array(b)))
            if a.len() == b.len() && a.iter().chain(b).all(Value::is_table) =>
        {
            (0..a.len()).find_map(|i| compare(&format!("{key}[{i}]"), a.get(i), b.get(i)))
        }
        (one, other) => {
            let same = match (one, other) {
                (Some(Value::Array(a)), Some(Value::Array(b))) => {
                    let alike = |(a, b): (&Value, &Value)| compare("", Some(a), Some(b)).is_none();
                    a.len() == b.len() && a.iter().zip(b).all(alike)
                }
                (Some(a), Some(b)) => match (number(a), number(b)) {
                    (Some(a), Some(b)) => a == b || (a - b).abs() <= SAME * a.abs().max(b.abs()),
                    _ => a == b,
                },
                (a, b) => a == b,
            };
            let text = |v: Option<&Value>| match v {
                Some(Value::Array(list)) if list.iter().any(Value::is_table) => list.len().to_string(),
                Some(v) => v.to_string(),
                None => "absent".into(),
            };
            (!same).then(|| Difference { key: key.into(), one: text(one), other: text(other) })
        }
    }
}

/// The first key in which two radars differ and which changes the tensors of samples: waveform, multiplex, sampling, antenna positions and
/// their order, windows and transform lengths. None where they give the same tensors.
///
/// # Errors
/// Returns an error for a radar that no TOML describes.
pub fn difference(one: &Radar, other: &Radar) -> Result<Option<Difference>> {
    let table = |radar: &Radar| -> Result<toml::Value> {
        let text = KeptRadar::of(radar)?.toml;
        let table: toml::Table = toml::from_str(&text)
            .map_err(|e| Error::Failed(format!("radar '{}' as TOML: {e}", radar.name)))?;
        Ok(table.into())
    };
    let (one, other) = (table(one)?, table(other)?);
    // The waveform first: from its carrier follow positions that a file gives in wavelengths.
    let of = |key: &str| compare(key, one.get(key), other.get(key));
    Ok(["waveform", "receiver", "tx", "rx"]
        .into_iter()
        .find_map(of)
        .or_else(|| compare("", Some(&one), Some(&other))))
}

/// Checks that a given radar makes the same tensors as the one that took the samples.
///
/// # Errors
/// Returns `BadInput` with the first key that differs and both values.
pub fn check_same(dataset: &Radar, given: &Radar) -> Result<()> {
    let Some(d) = difference(dataset, given)? else { return Ok(()) };
    let remedy = match d.key.starts_with("processing.") {
        true => "leave out radar= to use the dataset's radar, or set this key when you ask for a tensor",
        false => "leave out radar= to use the dataset's radar",
    };
    Err(BadInput::new(format!("radar '{}' is not the radar of the samples, '{}'", given.name, dataset.name))
        .key(format!("radar.{}", d.key))
        .value(d.other)
        .allowed(d.one)
        .remedy(remedy)
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TINY: &str = include_str!("../../../scenes/recipes/tiny_radar.toml");

    fn radar(text: &str) -> Radar {
        parse(Path::new("r.toml"), text).unwrap()
    }

    #[test]
    fn a_kept_radar_is_read_back() {
        let first = radar(TINY);
        let kept = KeptRadar::of(&first).unwrap();
        let back = kept.radar(Path::new("dataset.json")).unwrap();
        assert_eq!(KeptRadar::of(&back).unwrap(), kept);
        assert_eq!(difference(&first, &back).unwrap(), None);
        let mut calibrated = first.clone();
        let file = CalibrationFile { path: "deep/cal.csv".into(), text: "# measured\n".into() };
        calibrated.processing.angle.calibration = Some(file);
        let kept = KeptRadar::of(&calibrated).unwrap();
        assert_eq!(kept.calibration.as_deref(), Some("# measured\n"));
        let back = kept.radar(Path::new("dataset.json")).unwrap();
        assert_eq!(back.processing.angle.calibration.unwrap().text, "# measured\n");
    }

    /// Each change that moves a target in a tensor is refused by its key, and what only the reader chooses is not.
    #[test]
    fn radars_differ_where_tensors_do() {
        let tiny = radar(TINY);
        for (old, new, key) in [
            ("bandwidth_hz = 375e6", "bandwidth_hz = 750e6", "waveform.bandwidth_hz"),
            ("carrier_hz = 77e9", "carrier_hz = 77.1e9", "waveform.carrier_hz"),
            ("chirp_period_s = 16e-6", "chirp_period_s = 32e-6", "waveform.chirp_period_s"),
            ("ramp_time_s = 12.8e-6", "ramp_time_s = 13e-6", "waveform."),
            ("chirps = 16", "chirps = 32", "waveform.chirps"),
            ("samples = 64", "samples = 128", "receiver.samples"),
            ("sample_rate_hz = 20e6", "sample_rate_hz = 10e6", "receiver.sample_rate_hz"),
            ("sampling = \"iq\"", "sampling = \"real\"", "receiver.sampling"),
            ("[0, -1.5, 0]", "[0, -3, 0]", "rx[0].position_m"),
            ("[0, 1.5, 0]", "[0.1, 1.5, 0]", "rx[3].position_m"),
            ("[[rx]]\nposition_half_wavelengths = [0, 1.5, 0]\n", "", "rx"),
            (
                "range_window = { kind = \"hann\" }",
                "range_window = { kind = \"hamming\" }",
                "processing.range_window",
            ),
            (
                "doppler_window = { kind = \"hann\" }",
                "doppler_window = { kind = \"blackman\" }",
                "processing.doppler_window",
            ),
            (
                "angle_window = { kind = \"hann\" }",
                "angle_window = { kind = \"rectangle\" }",
                "processing.angle_window",
            ),
            ("azimuth_bins = 64", "azimuth_bins = 64\nrange_fft = 256", "processing.range_fft"),
            ("azimuth_bins = 64", "azimuth_bins = 64\ndoppler_fft = 64", "processing.doppler_fft"),
        ] {
            let text = TINY.replace(old, new);
            assert_ne!(text, TINY, "{old}");
            let other = radar(&text);
            let d = difference(&tiny, &other).unwrap().unwrap_or_else(|| panic!("{new}"));
            assert!(d.key.starts_with(key), "{new}: {d:?}");
            let e = check_same(&tiny, &other).unwrap_err().to_string();
            assert!(e.contains(&d.key) && e.contains(&d.one) && e.contains(&d.other), "{e}");
        }
        // The same antennas in another order.
        let swapped = TINY.replace("-1.5", "other").replace("-0.5", "-1.5").replace("other", "-0.5");
        assert_eq!(difference(&tiny, &radar(&swapped)).unwrap().unwrap().key, "rx[0].position_m");
        for (old, new) in [
            ("name = \"tiny\"", "name = \"front\""),
            ("azimuth_bins = 64", "azimuth_bins = 32"),
            ("azimuth_max_deg = 60", "azimuth_max_deg = 45"),
            ("probability = 1e-5", "probability = 1e-3"),
            ("noise_figure_db = 13", "noise_figure_db = 10"),
            ("position_m = [3.6, 0, 0.5]", "position_m = [3.6, 0, 0.8]"),
            ("azimuth_exponent = 1.6", "azimuth_exponent = 2"),
        ] {
            assert_eq!(difference(&tiny, &radar(&TINY.replace(old, new))).unwrap(), None, "{new}");
        }
    }
}
