//! Arrays of numbers as the page takes them: little-endian bytes in base64, which its script views as typed arrays.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Values as float32.
pub fn f32s(values: impl IntoIterator<Item = f32>) -> Value {
    json!({ "f32": bytes(values.into_iter().flat_map(f32::to_le_bytes)) })
}

/// Values as float64, so that what the page shows is what the file says.
pub fn f64s(values: impl IntoIterator<Item = f64>) -> Value {
    json!({ "f64": bytes(values.into_iter().flat_map(f64::to_le_bytes)) })
}

/// Bytes.
pub fn u8s(values: &[u8]) -> Value {
    json!({ "u8": STANDARD.encode(values) })
}

/// Values as uint32.
pub fn u32s(values: impl IntoIterator<Item = u32>) -> Value {
    json!({ "u32": bytes(values.into_iter().flat_map(u32::to_le_bytes)) })
}

fn bytes(values: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(values.collect::<Vec<u8>>())
}

/// Levels in decibels as uint16 between their least and largest: `low + step · value`; 65535 where a level is not a number.
///
/// A step is a 65534th of the span, below 0.01 dB for spans up to 650 dB.
pub fn levels(values: &[f64]) -> Value {
    let known = || values.iter().copied().filter(|v| v.is_finite());
    let low = known().fold(f64::INFINITY, f64::min);
    let high = known().fold(f64::NEG_INFINITY, f64::max);
    let low = if low.is_finite() { low } else { 0.0 };
    let step = ((high - low) / 65534.0).max(f64::MIN_POSITIVE);
    let code = |v: &f64| match v.is_finite() {
        true => ((v - low) / step).round().clamp(0.0, 65534.0) as u16,
        false => u16::MAX,
    };
    let codes = values.iter().flat_map(|v| code(v).to_le_bytes());
    json!({ "low": low, "step": if step.is_normal() && step > 1e-300 { step } else { 0.0 }, "u16": bytes(codes) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(v: &Value) -> Vec<f64> {
        let (low, step) = (v["low"].as_f64().unwrap(), v["step"].as_f64().unwrap());
        let codes = STANDARD.decode(v["u16"].as_str().unwrap()).unwrap();
        let code = |c: &[u8]| u16::from_le_bytes([c[0], c[1]]);
        codes
            .chunks_exact(2)
            .map(code)
            .map(|c| if c == u16::MAX { f64::NAN } else { low + step * f64::from(c) })
            .collect()
    }

    #[test]
    fn levels_come_back_within_half_a_step() {
        let values: Vec<f64> = (0..1000).map(|i| -180.0 + 0.137 * f64::from(i)).collect();
        let back = read(&levels(&values));
        assert!(values.iter().zip(&back).all(|(a, b)| (a - b).abs() < 0.0011), "{back:?}");
        let back = read(&levels(&[f64::NEG_INFINITY, -3.0, f64::NAN, 4.0]));
        assert!(
            back[0].is_nan()
                && back[2].is_nan()
                && (back[1] + 3.0).abs() < 1e-9
                && (back[3] - 4.0).abs() < 1e-9
        );
        // Nothing but one value, and nothing at all.
        assert_eq!(read(&levels(&[-7.5; 3])), [-7.5; 3]);
        assert!(read(&levels(&[f64::NAN])).iter().all(|v| v.is_nan()));
    }

    #[test]
    fn arrays_are_little_endian() {
        assert_eq!(u32s([1, 256]), json!({"u32": "AQAAAAABAAA="}));
        assert_eq!(f32s([1.0]), json!({"f32": "AACAPw=="}));
        assert_eq!(f64s([1.0]), json!({"f64": "AAAAAAAA8D8="}));
    }
}
