//! The binary part of a GLB, and the accessors into it.

use serde_json::{Value, json};
use std::collections::HashMap;

/// What a vertex attribute's view is for, in the format's numbers.
pub(super) const ARRAY: u32 = 34962;

pub(super) const ELEMENT_ARRAY: u32 = 34963;

/// The binary chunk while it is written, with its views and accessors.
#[derive(Default)]
pub(super) struct Buffer {
    pub(super) bin: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
    /// Accessors of bytes that may come again.
    known: HashMap<(usize, Vec<u8>), usize>,
}

impl Buffer {
    fn push(&mut self, bytes: &[u8], view: Value, accessor: Value) -> usize {
        let with = |mut a: Value, b: Value| {
            if let (Value::Object(a), Value::Object(b)) = (&mut a, b) {
                a.extend(b);
            }
            a
        };
        let place = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.views.push(with(place, view));
        self.bin.extend(bytes);
        self.accessors.push(with(json!({"bufferView": self.views.len() - 1}), accessor));
        self.accessors.len() - 1
    }

    /// Index of the accessor of rows in single precision.
    pub(super) fn floats<const N: usize>(&mut self, rows: &[[f32; N]], view: Value, more: Value) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({"componentType": 5126, "type": kind, "count": rows.len()});
        if let (Value::Object(a), Value::Object(more)) = (&mut accessor, more) {
            a.extend(more);
        }
        self.push(&bytes, view, accessor)
    }

    pub(super) fn indices(&mut self, corners: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        let accessor = json!({"componentType": 5125, "type": "SCALAR", "count": corners.len() * 3});
        self.push(&bytes, json!({"target": ELEMENT_ARRAY}), accessor)
    }

    /// The same for rows of an animation, of which equal ones are written once; `bounds` as the times of keys need them.
    pub(super) fn shared_floats<const N: usize>(&mut self, rows: &[[f32; N]], bounds: bool) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        if let Some(accessor) = self.known.get(&(N, bytes.clone())) {
            return *accessor;
        }
        let more = match (bounds, rows.first(), rows.last()) {
            (true, Some(first), Some(last)) => json!({"min": first.to_vec(), "max": last.to_vec()}),
            _ => json!({}),
        };
        let accessor = self.floats(rows, json!({}), more);
        self.known.insert((N, bytes), accessor);
        accessor
    }
}
