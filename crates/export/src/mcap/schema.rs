//! Foxglove's message schemas (<https://docs.foxglove.dev/docs/sdk/schemas>) as protobuf descriptors, which an MCAP file carries so
//! that any reader can take its messages apart. The table is the whole of each message; the tests in `python/tests/readers` compare it
//! with the published package `foxglove-schemas-protobuf`.

use prost::Message;

/// A field: its name, number and type. Types are the scalar types of protobuf, full names of messages, or `enum ` and the name of
/// an enum of the message; `[]` before a type repeats it.
type Field = (&'static str, i32, &'static str);

const TIMESTAMP: &str = "google.protobuf.Timestamp";

const MESSAGES: &[(&str, &[Field])] = &[
    (TIMESTAMP, &[("seconds", 1, "int64"), ("nanos", 2, "int32")]),
    ("google.protobuf.Duration", &[("seconds", 1, "int64"), ("nanos", 2, "int32")]),
    ("foxglove.Vector3", &[("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double")]),
    ("foxglove.Point3", &[("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double")]),
    (
        "foxglove.Quaternion",
        &[("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double"), ("w", 4, "double")],
    ),
    ("foxglove.Color", &[("r", 1, "double"), ("g", 2, "double"), ("b", 3, "double"), ("a", 4, "double")]),
    ("foxglove.Pose", &[("position", 1, "foxglove.Vector3"), ("orientation", 2, "foxglove.Quaternion")]),
    ("foxglove.KeyValuePair", &[("key", 1, "string"), ("value", 2, "string")]),
    (
        "foxglove.PackedElementField",
        &[("name", 1, "string"), ("offset", 2, "fixed32"), ("type", 3, "enum NumericType")],
    ),
    (
        "foxglove.PointCloud",
        &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, "string"),
            ("pose", 3, "foxglove.Pose"),
            ("point_stride", 4, "fixed32"),
            ("fields", 5, "[]foxglove.PackedElementField"),
            ("data", 6, "bytes"),
        ],
    ),
    (
        "foxglove.FrameTransform",
        &[
            ("timestamp", 1, TIMESTAMP),
            ("parent_frame_id", 2, "string"),
            ("child_frame_id", 3, "string"),
            ("translation", 4, "foxglove.Vector3"),
            ("rotation", 5, "foxglove.Quaternion"),
        ],
    ),
    ("foxglove.FrameTransforms", &[("transforms", 1, "[]foxglove.FrameTransform")]),
    (
        "foxglove.CompressedImage",
        &[
            ("timestamp", 1, TIMESTAMP),
            ("data", 2, "bytes"),
            ("format", 3, "string"),
            ("frame_id", 4, "string"),
        ],
    ),
    (
        "foxglove.SceneEntityDeletion",
        &[("timestamp", 1, TIMESTAMP), ("type", 2, "enum Type"), ("id", 3, "string")],
    ),
    (
        "foxglove.ArrowPrimitive",
        &[
            ("pose", 1, "foxglove.Pose"),
            ("shaft_length", 2, "double"),
            ("shaft_diameter", 3, "double"),
            ("head_length", 4, "double"),
            ("head_diameter", 5, "double"),
            ("color", 6, "foxglove.Color"),
        ],
    ),
    (
        "foxglove.CubePrimitive",
        &[("pose", 1, "foxglove.Pose"), ("size", 2, "foxglove.Vector3"), ("color", 3, "foxglove.Color")],
    ),
    (
        "foxglove.SpherePrimitive",
        &[("pose", 1, "foxglove.Pose"), ("size", 2, "foxglove.Vector3"), ("color", 3, "foxglove.Color")],
    ),
    (
        "foxglove.CylinderPrimitive",
        &[
            ("pose", 1, "foxglove.Pose"),
            ("size", 2, "foxglove.Vector3"),
            ("bottom_scale", 3, "double"),
            ("top_scale", 4, "double"),
            ("color", 5, "foxglove.Color"),
        ],
    ),
    (
        "foxglove.LinePrimitive",
        &[
            ("type", 1, "enum Type"),
            ("pose", 2, "foxglove.Pose"),
            ("thickness", 3, "double"),
            ("scale_invariant", 4, "bool"),
            ("points", 5, "[]foxglove.Point3"),
            ("color", 6, "foxglove.Color"),
            ("colors", 7, "[]foxglove.Color"),
            ("indices", 8, "[]fixed32"),
        ],
    ),
    (
        "foxglove.TriangleListPrimitive",
        &[
            ("pose", 1, "foxglove.Pose"),
            ("points", 2, "[]foxglove.Point3"),
            ("color", 3, "foxglove.Color"),
            ("colors", 4, "[]foxglove.Color"),
            ("indices", 5, "[]fixed32"),
        ],
    ),
    (
        "foxglove.TextPrimitive",
        &[
            ("pose", 1, "foxglove.Pose"),
            ("billboard", 2, "bool"),
            ("font_size", 3, "double"),
            ("scale_invariant", 4, "bool"),
            ("color", 5, "foxglove.Color"),
            ("text", 6, "string"),
        ],
    ),
    (
        "foxglove.ModelPrimitive",
        &[
            ("pose", 1, "foxglove.Pose"),
            ("scale", 2, "foxglove.Vector3"),
            ("color", 3, "foxglove.Color"),
            ("override_color", 4, "bool"),
            ("url", 5, "string"),
            ("media_type", 6, "string"),
            ("data", 7, "bytes"),
        ],
    ),
    (
        "foxglove.SceneEntity",
        &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, "string"),
            ("id", 3, "string"),
            ("lifetime", 4, "google.protobuf.Duration"),
            ("frame_locked", 5, "bool"),
            ("metadata", 6, "[]foxglove.KeyValuePair"),
            ("arrows", 7, "[]foxglove.ArrowPrimitive"),
            ("cubes", 8, "[]foxglove.CubePrimitive"),
            ("spheres", 9, "[]foxglove.SpherePrimitive"),
            ("cylinders", 10, "[]foxglove.CylinderPrimitive"),
            ("lines", 11, "[]foxglove.LinePrimitive"),
            ("triangles", 12, "[]foxglove.TriangleListPrimitive"),
            ("texts", 13, "[]foxglove.TextPrimitive"),
            ("models", 14, "[]foxglove.ModelPrimitive"),
        ],
    ),
    (
        "foxglove.SceneUpdate",
        &[("deletions", 1, "[]foxglove.SceneEntityDeletion"), ("entities", 2, "[]foxglove.SceneEntity")],
    ),
];

/// Enums by message and name; values count from 0.
const ENUMS: &[(&str, &str, &[&str])] = &[
    (
        "foxglove.PackedElementField",
        "NumericType",
        &["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"],
    ),
    ("foxglove.SceneEntityDeletion", "Type", &["MATCHING_ID", "ALL"]),
    ("foxglove.LinePrimitive", "Type", &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"]),
];

// The part of google/protobuf/descriptor.proto that these need.

#[derive(Clone, PartialEq, Message)]
struct FileDescriptorSet {
    #[prost(message, repeated, tag = "1")]
    file: Vec<FileDescriptor>,
}

#[derive(Clone, PartialEq, Message)]
struct FileDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(string, tag = "2")]
    package: String,
    #[prost(string, repeated, tag = "3")]
    dependency: Vec<String>,
    #[prost(message, repeated, tag = "4")]
    message_type: Vec<Descriptor>,
    #[prost(string, tag = "12")]
    syntax: String,
}

#[derive(Clone, PartialEq, Message)]
struct Descriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    field: Vec<FieldDescriptor>,
    #[prost(message, repeated, tag = "4")]
    enum_type: Vec<EnumDescriptor>,
}

#[derive(Clone, PartialEq, Message)]
struct FieldDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(int32, tag = "3")]
    number: i32,
    /// 1 optional, 3 repeated.
    #[prost(int32, tag = "4")]
    label: i32,
    #[prost(int32, tag = "5")]
    kind: i32,
    #[prost(string, optional, tag = "6")]
    type_name: Option<String>,
}

#[derive(Clone, PartialEq, Message)]
struct EnumDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    value: Vec<EnumValue>,
}

#[derive(Clone, PartialEq, Message)]
struct EnumValue {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(int32, optional, tag = "2")]
    number: Option<i32>,
}

/// Numbers of `FieldDescriptorProto.Type`.
const MESSAGE: i32 = 11;
const ENUM: i32 = 14;

fn scalar(kind: &str) -> Option<i32> {
    Some(match kind {
        "double" => 1,
        "int64" => 3,
        "int32" => 5,
        "fixed32" => 7,
        "bool" => 8,
        "string" => 9,
        "bytes" => 12,
        _ => return None,
    })
}

/// The file that a message is published in.
fn file_of(message: &str) -> String {
    match message.rsplit_once('.') {
        Some(("google.protobuf", name)) => format!("google/protobuf/{}.proto", name.to_lowercase()),
        Some((package, name)) => format!("{}/{name}.proto", package.replace('.', "/")),
        None => format!("{message}.proto"),
    }
}

fn fields_of(message: &str) -> &'static [Field] {
    MESSAGES.iter().find(|(name, _)| *name == message).map_or(&[], |(_, fields)| fields)
}

fn file(message: &str) -> FileDescriptor {
    let (package, name) = message.rsplit_once('.').unwrap_or(("", message));
    let mut dependency = Vec::new();
    let field = fields_of(message).iter().map(|(name, number, kind)| {
        let (label, kind) = match kind.strip_prefix("[]") {
            Some(kind) => (3, kind),
            None => (1, *kind),
        };
        let (number_of_kind, type_name) = match (scalar(kind), kind.strip_prefix("enum ")) {
            (Some(k), _) => (k, None),
            (None, Some(own)) => (ENUM, Some(format!(".{message}.{own}"))),
            (None, None) => {
                let other = file_of(kind);
                if !dependency.contains(&other) {
                    dependency.push(other);
                }
                (MESSAGE, Some(format!(".{kind}")))
            }
        };
        FieldDescriptor { name: (*name).into(), number: *number, label, kind: number_of_kind, type_name }
    });
    let field = field.collect();
    let enum_type = ENUMS
        .iter()
        .filter(|(of, ..)| *of == message)
        .map(|(_, name, values)| EnumDescriptor {
            name: (*name).into(),
            value: values
                .iter()
                .zip(0..)
                .map(|(name, number)| EnumValue { name: (*name).into(), number: Some(number) })
                .collect(),
        })
        .collect();
    FileDescriptor {
        name: file_of(message),
        package: package.into(),
        dependency,
        message_type: vec![Descriptor { name: name.into(), field, enum_type }],
        syntax: "proto3".into(),
    }
}

/// The serialised `FileDescriptorSet` of a message and all that it holds, what is held first.
pub(super) fn descriptor_set(message: &str) -> Vec<u8> {
    fn gather(message: &'static str, found: &mut Vec<&'static str>) {
        for (_, _, kind) in fields_of(message) {
            let kind = kind.trim_start_matches("[]");
            if let Some((name, _)) = MESSAGES.iter().find(|(name, _)| *name == kind)
                && !found.contains(name)
            {
                gather(name, found);
            }
        }
        if !found.contains(&message) {
            found.push(message);
        }
    }
    let mut found = Vec::new();
    if let Some((name, _)) = MESSAGES.iter().find(|(name, _)| *name == message) {
        gather(name, &mut found);
    }
    FileDescriptorSet { file: found.into_iter().map(file).collect() }.encode_to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dump() {
        for m in ["PointCloud", "FrameTransforms", "SceneUpdate", "CompressedImage"] {
            let there = std::fs::read(format!("src/mcap/foxglove/{m}.binpb")).unwrap();
            assert!(there == descriptor_set(&format!("foxglove.{m}")), "{m}");
        }
    }

    #[test]
    fn every_type_is_known_and_stands_before_its_use() {
        for (message, fields) in MESSAGES {
            for (name, number, kind) in *fields {
                let kind = kind.trim_start_matches("[]");
                let known = scalar(kind).is_some()
                    || MESSAGES.iter().any(|(m, _)| *m == kind)
                    || ENUMS.iter().any(|(m, e, _)| m == message && kind == format!("enum {e}"));
                assert!(known && *number > 0, "{message}.{name}: {kind}");
            }
            let set = FileDescriptorSet::decode(descriptor_set(message).as_slice()).unwrap();
            assert_eq!(set.file.last().unwrap().name, file_of(message));
            for (i, f) in set.file.iter().enumerate() {
                for d in &f.dependency {
                    assert!(set.file[..i].iter().any(|g| g.name == *d), "{message}: {d}");
                }
            }
        }
        assert!(descriptor_set("foxglove.Nothing").is_empty());
    }
}
