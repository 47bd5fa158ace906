//! The parameters that a study may fix or sweep.

use catseye::base::error::{BadInput, nearest};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;

/// Value of a parameter: a number, or a word such as a material's name.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
}

impl Value {
    /// The number; None for a word.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Number(x) => Some(*x),
            Value::Word(_) => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(x) => write!(f, "{x}"),
            Value::Word(w) => f.write_str(w),
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = Value;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a word")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Value, E> {
                Ok(Value::Number(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Value, E> {
                Ok(Value::Number(v as f64))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Value, E> {
                Ok(Value::Number(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Value, E> {
                Ok(Value::Word(v.to_string()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Number(x) => serializer.serialize_f64(*x),
            Value::Word(w) => serializer.serialize_str(w),
        }
    }
}

impl schemars::JsonSchema for Value {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Value".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": ["number", "string"] })
    }
}

/// Rounds `x` to a power of ten and returns the number with the fewest digits: 0.3 and not
/// 0.30000000000000004.
pub fn rounded_to(x: f64, exponent: i32) -> f64 {
    // Powers of ten with a positive exponent are exact, so what is divided by one is written shortly.
    let rounded = match exponent < 0 {
        true => (x * 10f64.powi(-exponent)).round() / 10f64.powi(-exponent),
        false => (x / 10f64.powi(exponent)).round() * 10f64.powi(exponent),
    };
    // A power of ten outside the range of f64 rounds nothing.
    if rounded.is_finite() { rounded } else { x }
}

/// Splits a label into name and unit: "frequency (Hz)" gives ("frequency", "Hz").
fn parted(label: &str) -> (&str, &str) {
    match label.split_once(" (") {
        Some((what, rest)) => (what, rest.split(')').next().unwrap_or("")),
        None => (label, ""),
    }
}

/// SI prefix that shortens the largest value in Hz or m, with its factor: ("G", 1e-9).
fn prefix(unit: &str, largest: f64) -> (&'static str, f64) {
    match unit {
        "Hz" if largest >= 1e9 => ("G", 1e-9),
        "Hz" if largest >= 1e6 => ("M", 1e-6),
        "Hz" if largest >= 1e3 => ("k", 1e-3),
        "m" if largest > 0.0 && largest < 0.1 => ("m", 1e3),
        _ => ("", 1.0),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().map(|x| x.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max)
}

/// Multiplies `x` by the factor of a prefix and rounds to twelve digits.
fn scaled(x: f64, factor: f64) -> f64 {
    let y = x * factor;
    match y == 0.0 || !y.is_finite() {
        true => y,
        false => rounded_to(y, y.abs().log10().floor() as i32 - 11),
    }
}

/// Converts an axis of frequencies to GHz, MHz or kHz: returns its label and values; any other axis is
/// unchanged.
pub fn axis_in_si(label: &str, values: &[f64]) -> (String, Vec<f64>) {
    let (_, unit) = parted(label);
    match (unit, prefix(unit, largest(values))) {
        ("Hz", (name, factor)) => (
            label.replacen("(Hz)", &format!("({name}Hz)"), 1),
            values.iter().map(|x| scaled(*x, factor)).collect(),
        ),
        _ => (label.to_string(), values.to_vec()),
    }
}

/// Text "frequency = 24 GHz": value `k` of `values` with the label's words and unit, in one prefix for all of
/// them.
pub fn value_in_si(label: &str, values: &[f64], k: usize) -> String {
    let (what, unit) = parted(label);
    let (name, factor) = prefix(unit, largest(values));
    let text = format!("{what} = {} {name}{unit}", scaled(values[k], factor));
    match unit {
        "percent" => text.replace(" percent", " %"),
        _ => text.trim_end().to_string(),
    }
}

/// One row of [`PARAMETERS`].
pub struct Parameter {
    /// Name, which ends with the unit.
    pub name: &'static str,
    /// Label for axes and the help text, with the unit.
    pub label: &'static str,
    /// Kind of its values.
    pub kind: Kind,
}

/// Kind of values that a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A number in `min..=max`.
    Number {
        /// Minimum.
        min: f64,
        /// Maximum.
        max: f64,
    },
    /// One of the words.
    Choice(&'static [&'static str]),
    /// Any word; it is checked where it is used.
    Word,
}

const fn number(name: &'static str, min: f64, max: f64, label: &'static str) -> Parameter {
    Parameter { name, label, kind: Kind::Number { min, max } }
}

/// Polarisations, received before transmitted: elements of S, 45 degrees linear on both sides, or 45 degrees
/// transmitted and the sum of the powers in V and H received.
pub const POLARISATIONS: [&str; 6] = ["vv", "hh", "45", "45-total", "vh", "hv"];

/// All parameters except those of the target, which are `target.NAME` with the parameter names of its kind.
pub static PARAMETERS: [Parameter; 27] = [
    Parameter { name: "target", label: "target", kind: Kind::Word },
    Parameter { name: "ground", label: "ground", kind: Kind::Word },
    Parameter { name: "polarisation", label: "polarisation", kind: Kind::Choice(&POLARISATIONS) },
    number("frequency_hz", 1e8, 1e12, "frequency (Hz)"),
    // Seen from the target, as in `catseye rcs`.
    number("azimuth_deg", -360.0, 360.0, "azimuth (deg), positive left"),
    number("elevation_deg", -90.0, 90.0, "elevation (deg)"),
    number("range_m", 1e-2, f64::INFINITY, "range (m)"),
    // Seen from the radar on a road.
    number("longitudinal_m", -1e4, 1e4, "longitudinal distance (m)"),
    number("lateral_m", -1e4, 1e4, "lateral distance (m), positive left"),
    number("radar_height_m", 0.0, 1e4, "radar height (m)"),
    number("radar_azimuth_deg", -180.0, 180.0, "turn of the radar (deg), positive left"),
    number("radar_elevation_deg", -90.0, 90.0, "tilt of the radar (deg), positive up"),
    number("marker_height_m", 0.0, 1e3, "height of the marker (m)"),
    number("marker_yaw_deg", -360.0, 360.0, "turn of the marker (deg), positive left"),
    number("marker_raise_deg", -45.0, 45.0, "raise of the marker's far side (deg)"),
    number("view_m", 1e-2, 1e4, "distance from radar to marker (m)"),
    number("curve_radius_m", 1e-1, 1e7, "radius of the road (m)"),
    number("road_position_m", -1e5, 1e5, "position of the radar (m) from the start of the curve"),
    number("grade_start_percent", -50.0, 50.0, "grade before the curve (percent)"),
    number("grade_end_percent", -50.0, 50.0, "grade after the curve (percent)"),
    number("curve_k_m", 1e-3, 1e4, "length of the curve for one percent of grade (m)"),
    // Detection.
    number("snr_db", -100.0, 100.0, "signal-to-noise ratio (dB)"),
    // The target "balls": metal spheres spread over a marking.
    Parameter { name: "ball_model", label: "balls counted", kind: Kind::Choice(&["all", "lit"]) },
    number("ball_radius_m", 1e-6, 1.0, "radius of the balls (m)"),
    number("marking_width_m", 1e-3, 1e3, "width of the marking (m)"),
    number("marking_length_m", 1e-3, 1e3, "length of the marking (m)"),
    number("range_cell_m", 1e-4, 1e3, "length of a range cell (m)"),
];

/// Prefix of the reflector's own parameters, as in `target.NAME`.
pub const TARGET_PREFIX: &str = "target.";

/// Finds the parameter of this name.
pub fn find(name: &str) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|p| p.name == name)
}

/// Makes the error for a name that is no parameter.
pub fn unknown(name: &str) -> BadInput {
    let names = || PARAMETERS.iter().map(|p| p.name);
    let b = BadInput::new("is not a parameter of a study")
        .allowed(format!("{}, target.NAME", names().collect::<Vec<_>>().join(", ")));
    match nearest(name, names()) {
        Some(n) => b.remedy(format!("did you mean '{n}'?")),
        None => b.remedy("a parameter of the reflector is written target.NAME, as in target.height_m"),
    }
}

/// Checks whether a parameter may have this value.
///
/// # Errors
/// Returns an error that says what is wrong, without its place in a file.
pub fn check(name: &str, value: &Value) -> Result<(), BadInput> {
    if name.starts_with(TARGET_PREFIX) {
        return Ok(());
    }
    let p = find(name).ok_or_else(|| unknown(name))?;
    match (p.kind, value) {
        (Kind::Number { min, max }, Value::Number(x)) => {
            // NaN is in no range.
            if (min..=max).contains(x) {
                return Ok(());
            }
            Err(BadInput::new("is out of range").allowed(format!("{min}..={max}")))
        }
        (Kind::Number { .. }, Value::Word(_)) => Err(BadInput::new("must be a number")),
        (Kind::Choice(words), Value::Word(w)) if words.contains(&w.as_str()) => Ok(()),
        (Kind::Choice(words), _) => {
            Err(BadInput::new("is not one of the choices").allowed(format!("\"{}\"", words.join("\", \""))))
        }
        (Kind::Word, Value::Word(_)) => Ok(()),
        (Kind::Word, Value::Number(_)) => Err(BadInput::new("must be a word in quotes")),
    }
}

/// Label of an axis.
pub fn label(name: &str) -> String {
    match find(name) {
        Some(p) => p.label.to_string(),
        None => match name.strip_prefix(TARGET_PREFIX) {
            Some(n) => match n.rsplit_once('_') {
                Some((what, "hz")) => format!("{} (Hz)", what.replace('_', " ")),
                Some((what, unit @ ("m" | "deg"))) => format!("{} ({unit})", what.replace('_', " ")),
                _ => n.replace('_', " "),
            },
            None => name.to_string(),
        },
    }
}

/// Values of the parameters at one point of a study.
pub type Values = BTreeMap<String, Value>;

/// The number of a parameter; None if it is not set or is a word.
pub fn number_of(values: &Values, name: &str) -> Option<f64> {
    values.get(name).and_then(Value::number)
}

/// The word of a parameter; None if it is not set or is a number.
pub fn word_of<'a>(values: &'a Values, name: &str) -> Option<&'a str> {
    match values.get(name) {
        Some(Value::Word(w)) => Some(w),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_they_deserve() {
        assert_eq!(rounded_to(0.14564892000000002, -6).to_string(), "0.145649");
        assert_eq!(rounded_to(3.0 * 0.1, -11).to_string(), "0.3");
        assert_eq!(rounded_to(77.123_456_789e9, 4), 77.12346e9);
        assert_eq!(rounded_to(-1234.5, 0), -1235.0);
        assert_eq!(rounded_to(0.5, -320), 0.5);
    }

    #[test]
    fn values_have_units_and_one_prefix() {
        let f = [24e9, 76.5e9];
        assert_eq!(value_in_si("frequency (Hz)", &f, 0), "frequency = 24 GHz");
        assert_eq!(value_in_si("frequency (Hz)", &f, 1), "frequency = 76.5 GHz");
        assert_eq!(value_in_si("height (m)", &[0.001, 0.0345], 1), "height = 34.5 mm");
        assert_eq!(value_in_si("height (m)", &[0.001, 0.5], 0), "height = 0.001 m");
        assert_eq!(value_in_si("azimuth (deg), positive left", &[-7.0], 0), "azimuth = -7 deg");
        assert_eq!(
            value_in_si("grade before the curve (percent)", &[5.0], 0),
            "grade before the curve = 5 %"
        );
        assert_eq!(value_in_si("plates", &[2.0], 0), "plates = 2");
        assert_eq!(axis_in_si("frequency (Hz)", &f), ("frequency (GHz)".to_string(), vec![24.0, 76.5]));
        assert_eq!(axis_in_si("height (m)", &[0.001]), ("height (m)".to_string(), vec![0.001]));
    }
}
