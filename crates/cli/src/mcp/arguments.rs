//! The inputs of the tools: their JSON schemas, and how a call's inputs become options of a command.

use catseye::base::error::{BadInput, Result, json_in_words, nearest};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// One number, a list of numbers, or a string as on the command line: "-45:45:0.5" (both ends included) or "1,2,5".
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Numbers {
    /// One number.
    One(f64),
    /// Several numbers.
    Many(Vec<f64>),
    /// START:STOP:STEP with both ends included, or numbers separated by commas.
    Text(String),
}

impl Numbers {
    /// As the command line has it.
    pub fn text(&self) -> String {
        match self {
            Numbers::One(x) => x.to_string(),
            Numbers::Many(list) => list.iter().map(f64::to_string).collect::<Vec<_>>().join(","),
            Numbers::Text(text) => text.clone(),
        }
    }
}

/// Inputs of `rcs`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RcsInput {
    /// Target: a .glb, .gltf, .stl or .obj file, or a reflector KIND:name=value,... such as
    /// trihedral:leg_m=0.1, plate:width_m=0.2,height_m=0.1, sphere:radius_m=0.05,
    /// cylinder:radius_m=0.03,length_m=0.3, point:rcs_dbsm=10.
    pub target: String,
    /// Frequencies, Hz; default 77e9.
    pub frequency_hz: Option<Numbers>,
    /// Azimuths of the radar as seen from the target, degrees, positive to the left; default 0.
    pub azimuth_deg: Option<Numbers>,
    /// Elevations of the radar as seen from the target, degrees, positive up; default 0. Elevation is the outer loop of the rows.
    pub elevation_deg: Option<Numbers>,
    /// Bistatic: azimuths of the receiver, degrees; default: monostatic, unless `bistatic_elevation_deg` is given.
    pub bistatic_azimuth_deg: Option<Numbers>,
    /// Bistatic: elevations of the receiver, degrees.
    pub bistatic_elevation_deg: Option<Numbers>,
    /// Distance of the radar, m; default: plane wave (far field).
    pub range_m: Option<f64>,
    /// Maximum number of bounces of one beam; default 3.
    pub bounces: Option<u32>,
    /// Bounces that radiate: "every" (default) or "last".
    pub convention: Option<String>,
    /// Further polarisations in addition to VV, VH, HV, HH: "linear45", "circular".
    pub polarisation: Option<Vec<String>>,
    /// Edge diffraction of metal: "none" (default) or "ptd".
    pub diffraction: Option<String>,
    /// Infinite ground plane z = 0: "none" (default), "pec" or a material.
    pub ground: Option<String>,
    /// Height of the target's origin above the ground, m; default 0.
    pub height_m: Option<f64>,
    /// Yaw: rotates the target to the left about its z axis, degrees; default 0.
    pub yaw_deg: Option<f64>,
    /// Pitch: then rotates its front down, degrees; default 0.
    pub pitch_deg: Option<f64>,
    /// Roll: then rotates its right side down, degrees; default 0.
    pub roll_deg: Option<f64>,
    /// Error allowed for curved surfaces and finite range, dB; default 0.1.
    pub accuracy_db: Option<f64>,
    /// Radar materials for material names of the file, each as NAME=MATERIAL.
    pub material: Option<Vec<String>>,
    /// Radar material of surfaces without a known material.
    pub default_material: Option<String>,
    /// Unit of the file's coordinates: m, cm, mm, in, ft.
    pub unit: Option<String>,
    /// Up axis of the file: y or z.
    pub up: Option<String>,
    /// Table to write (.csv), with the complex amplitudes S. Tables with more rows than an answer holds are always written.
    pub output: Option<String>,
    /// Plot to write (.png, .svg or .pdf).
    pub plot: Option<String>,
    /// true: existing files are replaced; default false.
    pub force: Option<bool>,
}

/// Inputs of `simulate`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulateInput {
    /// Scenario file (.toml); alternative to `scenario_toml`.
    pub scenario: Option<String>,
    /// Text of a scenario. It is stored as OUTPUT.toml beside the folder of the run; file names in it are relative to that folder's parent.
    pub scenario_toml: Option<String>,
    /// Folder to write.
    pub output: String,
    /// Number of frames; default as in the scenario.
    pub frames: Option<u32>,
    /// Seed of the random numbers; default as in the scenario.
    pub seed: Option<u64>,
    /// true: only estimate time, memory and disk space, and write no run; default false.
    pub dry_run: Option<bool>,
    /// Number of frames, from the first, whose points the answer contains; 0 to 20, default 1.
    pub points_of_frames: Option<u32>,
    /// true: an existing run is replaced; default false.
    pub force: Option<bool>,
}

/// Inputs of `describe`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DescribeInput {
    /// Folder of a run, a frame or a dataset; or a table (.csv), an array (.npy), a mesh (.glb, .gltf, .stl, .obj) or a TOML file.
    pub path: String,
    /// Unit of a mesh's coordinates (required for STL and OBJ): m, cm, mm, in, ft.
    pub unit: Option<String>,
    /// Up axis of a mesh (required for STL and OBJ): y or z.
    pub up: Option<String>,
}

/// Inputs of `list_keys`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeysInput {
    /// Kind of file: scenario, road, radar, recipe or study; default all.
    pub kind: Option<String>,
    /// Only keys with this word in name or description, case-insensitive.
    pub word: Option<String>,
}

/// Inputs of `validate_file`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ValidateInput {
    /// File to check; alternative to `text`.
    pub path: Option<String>,
    /// Text to check; file names in it are relative to the server's folder.
    pub text: Option<String>,
    /// Kind of file: scenario, road, radar, recipe or study; default: inferred from its keys.
    pub kind: Option<String>,
}

/// Inputs of `examples`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExamplesInput {
    /// Name of the example to write, from the list, with all files that it refers to; default: list all examples.
    pub name: Option<String>,
    /// Only list examples with this word in name or description.
    pub word: Option<String>,
    /// Folder to write into; default scenes.
    pub output: Option<String>,
    /// true: existing files are replaced; default false.
    pub force: Option<bool>,
}

/// A call's inputs as `T`.
///
/// # Errors
/// Returns `BadInput` with the input's name for one that is unknown, missing, or of another type.
pub fn read<T: DeserializeOwned + JsonSchema>(given: Option<Map<String, Value>>) -> Result<T> {
    let given = given.unwrap_or_default();
    let schema = schemars::schema_for!(T).to_value();
    let known: Vec<&str> =
        schema["properties"].as_object().map(|p| p.keys().map(String::as_str).collect()).unwrap_or_default();
    if let Some(key) = given.keys().find(|k| !known.contains(&k.as_str())) {
        let bad = BadInput::new("is not an input of this tool").key(key).allowed(known.join(", "));
        return Err(match nearest(key, known.iter().copied()) {
            Some(near) => bad.remedy(format!("did you mean '{near}'?")),
            None => bad,
        }
        .into());
    }
    let required = schema["required"].as_array().map(Vec::as_slice).unwrap_or_default();
    if let Some(key) = required.iter().filter_map(Value::as_str).find(|k| !given.contains_key(*k)) {
        let about = schema["properties"][key]["description"].as_str().unwrap_or_default();
        return Err(BadInput::new("is missing").key(key).allowed(about.replace('\n', " ")).into());
    }
    let whole = |given: Map<String, Value>| serde_json::from_value::<T>(Value::Object(given));
    whole(given.clone()).map_err(|e| {
        // serde does not say which input it is: the one without which the rest can be read, or else one that has to be there.
        let optional = given.keys().find(|k| {
            let mut rest = given.clone();
            rest.shift_remove(*k);
            !required.iter().any(|r| r == *k) && whole(rest).is_ok()
        });
        let key = optional
            .cloned()
            .unwrap_or_else(|| required.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" or "));
        let value = given.get(&key).map(Value::to_string).unwrap_or_default();
        BadInput::new(json_in_words(&e)).key(key).value(value).remedy("see the tool's input schema").into()
    })
}

/// Options of a command.
#[derive(Debug, Default)]
pub struct Options(pub Vec<String>);

impl Options {
    /// The option with its value, where there is one. The two are one word, so that a value may begin with a minus.
    pub fn with(&mut self, option: &str, value: Option<impl ToString>) {
        self.0.extend(value.map(|v| format!("--{option}={}", v.to_string())));
    }

    /// The option without a value, where it is asked for.
    pub fn flag(&mut self, option: &str, given: Option<bool>) {
        self.0.extend(given.filter(|g| *g).map(|_| format!("--{option}")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn refused<T: DeserializeOwned + JsonSchema + std::fmt::Debug>(given: Value) -> String {
        read::<T>(given.as_object().cloned()).unwrap_err().to_string()
    }

    #[test]
    fn wrong_inputs_are_named() {
        let e = refused::<RcsInput>(json!({ "target": "plate", "azimut_deg": 1 }));
        assert!(
            e.contains("azimut_deg: is not an input") && e.contains("did you mean 'azimuth_deg'?"),
            "{e}"
        );
        let e = refused::<RcsInput>(json!({ "azimuth_deg": 1 }));
        assert!(e.contains("target: is missing"), "{e}");
        let e = refused::<RcsInput>(json!({ "target": "plate", "bounces": "three", "azimuth_deg": 1 }));
        assert!(e.contains("bounces = \"three\": ") && e.contains("a whole number"), "{e}");
        let e = refused::<DescribeInput>(json!({ "path": 7 }));
        assert!(e.contains("path = 7: "), "{e}");
    }

    #[test]
    fn numbers_are_those_of_the_command_line() {
        let given = json!({ "target": "plate", "frequency_hz": 77e9, "azimuth_deg": [-1, 0.5], "elevation_deg": "0:2:1" });
        let input: RcsInput = read(given.as_object().cloned()).unwrap();
        assert_eq!(input.frequency_hz.unwrap().text(), "77000000000");
        assert_eq!(input.azimuth_deg.unwrap().text(), "-1,0.5");
        assert_eq!(input.elevation_deg.unwrap().text(), "0:2:1");
    }
}
