//! The layout of a dataset: arrays and tables of a frame, the division of frames into shards, and the format.

use catseye::base::error::{BadInput, Error, Result, json_in_words, nearest};
use catseye::formats::stage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// Name of the file that states what a folder stores.
pub const LAYOUT: &str = "layout.json";
/// Version of [`LAYOUT`]; a change that an older reader would misread raises it.
/// Version 2 has compressed arrays in the format `frames`.
const VERSION: u32 = 2;
/// Name of the first column of every stored table.
pub const FRAME: &str = "frame";
/// Name of the offsets of frames among the rows of a table in an HDF5 shard.
pub const ROW_OFFSETS: &str = "row_offsets";
/// Names of folders that a dataset holds beside its arrays.
const TAKEN: [&str; 5] = ["tables", "data", "shards", "preview", "previews"];
/// Largest size of a frame's array, bytes: codecs of Zarr and chunks of HDF5 hold less than 2 GiB in one
/// piece.
const MOST_FRAME_BYTES: usize = i32::MAX as usize;
/// Largest number of frames of a shard, whose positions are read and written in one piece.
const MOST_FRAMES_OF_SHARD: u64 = 1 << 20;

/// Type of the numbers of an array, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum ArrayKind {
    /// Complex numbers of two f32.
    #[serde(rename = "complex64")]
    C32,
    /// 32-bit floating point.
    #[serde(rename = "float32")]
    F32,
    /// 8-bit unsigned integers.
    #[serde(rename = "uint8")]
    U8,
    /// 32-bit integers.
    #[serde(rename = "int32")]
    I32,
}

impl ArrayKind {
    /// Name of the type in NumPy.
    pub fn name(self) -> &'static str {
        match self {
            ArrayKind::C32 => "complex64",
            ArrayKind::F32 => "float32",
            ArrayKind::U8 => "uint8",
            ArrayKind::I32 => "int32",
        }
    }

    /// Size of one number, bytes.
    pub fn bytes(self) -> usize {
        match self {
            ArrayKind::C32 => 8,
            ArrayKind::F32 | ArrayKind::I32 => 4,
            ArrayKind::U8 => 1,
        }
    }
}

/// Type of a table's column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum ColumnKind {
    /// 64-bit integers.
    #[serde(rename = "int64")]
    I64,
    /// 32-bit unsigned integers.
    #[serde(rename = "uint32")]
    U32,
    /// 64-bit floating point.
    #[serde(rename = "float64")]
    F64,
    /// 32-bit floating point.
    #[serde(rename = "float32")]
    F32,
    /// True or false.
    #[serde(rename = "bool")]
    Bool,
    /// Text in UTF-8.
    #[serde(rename = "text")]
    Text,
}

/// An array of which every frame has one, of the same shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArraySpec {
    /// Name of the array.
    pub name: String,
    /// Names of a frame's axes, slowest first; the axis `frame` stands before them in the files.
    pub dims: Vec<String>,
    /// Shape of the array in one frame.
    pub shape: Vec<usize>,
    /// Type of its numbers.
    #[serde(rename = "type")]
    pub kind: ArrayKind,
    /// Unit of its numbers.
    pub unit: String,
    /// What it holds, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// Compression of the array in the format `frames`, in place of that of the dataset: the frame's file is then `NAME.npz`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compression: Option<Compression>,
}

impl ArraySpec {
    /// Number of values in one frame.
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Size of one frame before compression, bytes.
    pub fn bytes(&self) -> usize {
        self.count() * self.kind.bytes()
    }
}

/// A column of a table; its unit is the ending of its name (`range_m`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnSpec {
    /// Name of the column.
    pub name: String,
    /// Type of its values.
    #[serde(rename = "type")]
    pub kind: ColumnKind,
    /// What it holds, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
}

impl ColumnSpec {
    /// Makes a column without a description.
    pub fn new(name: &str, kind: ColumnKind) -> Self {
        ColumnSpec { name: name.into(), kind, about: String::new() }
    }
}

/// A table to which every frame adds any number of rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSpec {
    /// Name of the table.
    pub name: String,
    /// Columns without `frame`, which the writer puts first.
    pub columns: Vec<ColumnSpec>,
    /// What it holds, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
}

/// Format of the shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// A Zarr v3 group: an array is a folder with one file per shard, a table a folder with one Parquet file
    /// per shard.
    Zarr,
    /// One HDF5 file per shard.
    Hdf5,
    /// One folder per frame, with NumPy arrays and CSV tables; in every build.
    #[default]
    Frames,
}

impl Format {
    /// Name of the format in recipes.
    pub fn name(self) -> &'static str {
        match self {
            Format::Zarr => "zarr",
            Format::Hdf5 => "hdf5",
            Format::Frames => "frames",
        }
    }

    /// Whether this build reads and writes the format.
    pub fn is_built(self) -> bool {
        match self {
            Format::Zarr => cfg!(feature = "zarr"),
            Format::Hdf5 => cfg!(feature = "hdf5"),
            Format::Frames => true,
        }
    }
}

/// Compression of arrays. As text: `none`, `zstd:LEVEL` (1 to 22), `deflate:LEVEL` (1 to 9).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Compression {
    /// No compression.
    #[default]
    None,
    /// Zstandard at this level, for Zarr.
    Zstd(i32),
    /// Deflate at this level after a byte shuffle, for HDF5.
    Deflate(u32),
}

impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Compression::None => write!(f, "none"),
            Compression::Zstd(level) => write!(f, "zstd:{level}"),
            Compression::Deflate(level) => write!(f, "deflate:{level}"),
        }
    }
}

impl From<Compression> for String {
    fn from(c: Compression) -> String {
        c.to_string()
    }
}

impl TryFrom<String> for Compression {
    type Error = BadInput;

    fn try_from(text: String) -> std::result::Result<Self, BadInput> {
        let (name, level) = match text.split_once(':') {
            Some((name, level)) => (name, level.parse::<u32>().ok()),
            None => (text.as_str(), Some(3)),
        };
        match (name, level) {
            ("none", _) if text == "none" => Ok(Compression::None),
            ("zstd", Some(level @ 1..=22)) => Ok(Compression::Zstd(level as i32)),
            ("deflate", Some(level @ 1..=9)) => Ok(Compression::Deflate(level)),
            _ => Err(BadInput::new("is no compression")
                .key("compression")
                .value(&text)
                .allowed("none, zstd:LEVEL (1 to 22), deflate:LEVEL (1 to 9)")),
        }
    }
}

impl schemars::JsonSchema for Compression {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Compression".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": "string",
            "description": "none, zstd:LEVEL (zarr, 1 to 22), deflate:LEVEL (hdf5, 1 to 9); without a level, 3",
            "pattern": "^(none|zstd(:([1-9]|1[0-9]|2[0-2]))?|deflate(:[1-9])?)$"
        })
    }
}

/// Layout of a dataset folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetLayout {
    /// Format of the shards.
    pub format: Format,
    /// Compression of arrays.
    pub compression: Compression,
    /// Number of frames of the whole dataset.
    pub frames: u64,
    /// Number of frames of a shard.
    pub frames_per_shard: u64,
    /// Arrays of each frame.
    pub arrays: Vec<ArraySpec>,
    /// Tables of each frame.
    pub tables: Vec<TableSpec>,
    /// User attributes of the whole dataset; in Zarr attributes of the group.
    #[serde(default)]
    pub attributes: serde_json::Map<String, serde_json::Value>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LayoutFile {
    store: u32,
    layout: DatasetLayout,
}

fn check_name(what: &str, name: &str) -> Result<()> {
    let first = name.bytes().next().is_some_and(|b| b.is_ascii_lowercase());
    let rest = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_');
    if first && rest && name.len() <= 64 {
        return Ok(());
    }
    Err(BadInput::new("is not a valid name")
        .key(what)
        .value(name.escape_default())
        .allowed("a lower-case letter, then letters, digits and _, up to 64")
        .into())
}

pub(super) fn check_once<'a>(what: &str, names: impl IntoIterator<Item = &'a str>) -> Result<()> {
    let mut seen = BTreeSet::new();
    match names.into_iter().find(|n| !seen.insert(*n)) {
        Some(twice) => Err(BadInput::new("occurs twice").key(what).value(twice).into()),
        None => Ok(()),
    }
}

impl DatasetLayout {
    /// Checks that some build can store this layout.
    ///
    /// # Errors
    /// Returns an error for the first thing that cannot be stored, with what can.
    pub fn check(&self) -> Result<()> {
        let bad = |problem: &str| BadInput::new(problem);
        let counts = [
            ("frames", self.frames, u32::MAX.into()),
            ("frames_per_shard", self.frames_per_shard, MOST_FRAMES_OF_SHARD),
        ];
        for (key, n, most) in counts {
            if n == 0 || n > most {
                return Err(bad("is out of range").key(key).value(n).allowed(format!("1 to {most}")).into());
            }
        }
        if self.arrays.is_empty() && self.tables.is_empty() {
            return Err(bad("there is nothing to store: no array and no table")
                .remedy("keep at least one")
                .into());
        }
        check_once("array", self.arrays.iter().map(|a| a.name.as_str()))?;
        for array in &self.arrays {
            check_name("array", &array.name)?;
            if TAKEN.contains(&array.name.as_str()) {
                return Err(bad("is the name of a folder of the dataset")
                    .key("array")
                    .value(&array.name)
                    .remedy("give the array another name")
                    .into());
            }
            let of = |problem: &str| bad(problem).key(format!("array {}", array.name));
            for dim in &array.dims {
                check_name("axis", dim)?;
            }
            check_once("axis", array.dims.iter().map(String::as_str).chain([FRAME]))?;
            let shape = format!("{:?}", array.shape);
            if array.dims.len() != array.shape.len() {
                return Err(of("the number of axis names differs from the number of axes")
                    .value(format!("{:?} for shape {shape}", array.dims))
                    .into());
            }
            if let Some(compression) = array.compression
                && !(self.format == Format::Frames
                    && matches!(compression, Compression::None | Compression::Deflate(1..=9)))
            {
                return Err(of("the array cannot be compressed in this way")
                    .value(compression)
                    .allowed("deflate:1 to deflate:9 in the format frames")
                    .into());
            }
            let bytes = array.shape.iter().try_fold(array.kind.bytes(), |n, d| n.checked_mul(*d));
            if !matches!(bytes, Some(1..=MOST_FRAME_BYTES)) {
                return Err(of("a frame of it cannot be stored")
                    .value(format!("shape {shape} of {}", array.kind.name()))
                    .allowed(format!("1 to {MOST_FRAME_BYTES} bytes a frame"))
                    .into());
            }
        }
        check_once("table", self.tables.iter().map(|t| t.name.as_str()))?;
        for table in &self.tables {
            check_name("table", &table.name)?;
            if table.columns.is_empty() {
                return Err(bad("has no columns").key(format!("table {}", table.name)).into());
            }
            for column in &table.columns {
                check_name("column", &column.name)?;
            }
            let names = table.columns.iter().map(|c| c.name.as_str());
            check_once(&format!("column of table {}", table.name), names.chain([FRAME, ROW_OFFSETS]))?;
        }
        let fits = match self.compression {
            Compression::None => true,
            Compression::Zstd(level) => self.format == Format::Zarr && (1..=22).contains(&level),
            Compression::Deflate(level) => self.format == Format::Hdf5 && (1..=9).contains(&level),
        };
        if !fits {
            let allowed = match self.format {
                Format::Zarr => "none, zstd:1 to zstd:22",
                Format::Hdf5 => "none, deflate:1 to deflate:9",
                Format::Frames => "none",
            };
            return Err(bad(&format!("cannot be had in the format {}", self.format.name()))
                .key("compression")
                .value(self.compression)
                .allowed(allowed)
                .into());
        }
        Ok(())
    }

    /// Checks that this build writes and reads the format.
    ///
    /// # Errors
    /// Returns `BadInput` with the formats that the build has and the feature to build with.
    pub fn check_built(&self) -> Result<()> {
        if !self.format.is_built() {
            let feature = self.format.name();
            return Err(BadInput::new("this build does not have the format")
                .key("format")
                .value(feature)
                .allowed(
                    [Format::Zarr, Format::Hdf5, Format::Frames]
                        .into_iter()
                        .filter(|f| f.is_built())
                        .map(Format::name)
                        .collect::<Vec<_>>()
                        .join(", "),
                )
                .remedy(format!("build with --features {feature}"))
                .into());
        }
        Ok(())
    }

    /// Number of shards; the last may hold fewer frames.
    pub fn shards(&self) -> u64 {
        self.frames.div_ceil(self.frames_per_shard.max(1))
    }

    /// Range of frames of a shard; empty beyond the last.
    pub fn frames_of(&self, shard: u64) -> Range<u64> {
        let end = |k: u64| k.saturating_mul(self.frames_per_shard).min(self.frames);
        end(shard)..end(shard.saturating_add(1))
    }

    /// Number of the shard that holds a frame.
    pub fn shard_of(&self, frame: u64) -> u64 {
        frame / self.frames_per_shard.max(1)
    }

    /// Size of a frame's arrays before compression, bytes.
    pub fn array_bytes(&self) -> usize {
        self.arrays.iter().map(ArraySpec::bytes).sum()
    }

    /// Finds the array of this name.
    ///
    /// # Errors
    /// Returns `BadInput` with the existing names.
    pub fn array(&self, name: &str) -> Result<&ArraySpec> {
        self.arrays
            .iter()
            .find(|a| a.name == name)
            .ok_or_else(|| absent("array", name, self.arrays.iter().map(|a| a.name.as_str())))
    }

    /// Finds the table of this name.
    ///
    /// # Errors
    /// Returns `BadInput` with the existing names.
    pub fn table(&self, name: &str) -> Result<&TableSpec> {
        self.tables
            .iter()
            .find(|t| t.name == name)
            .ok_or_else(|| absent("table", name, self.tables.iter().map(|t| t.name.as_str())))
    }

    /// Reads `layout.json` of `dir`.
    ///
    /// # Errors
    /// Returns the errors of [`describe`](DatasetLayout::describe), and `BadInput` for a format that this build
    /// cannot read.
    pub fn open(dir: &Path) -> Result<DatasetLayout> {
        let layout = DatasetLayout::describe(dir)?;
        layout.check_built()?;
        Ok(layout)
    }

    /// Reads `layout.json` of `dir`, also of a format that this build cannot read.
    ///
    /// # Errors
    /// Returns `BadInput` for a file that is missing, damaged or of a later version.
    pub fn describe(dir: &Path) -> Result<DatasetLayout> {
        let layout = DatasetLayout::find(dir)?.ok_or_else(|| {
            BadInput::new("is not a dataset: it has no layout.json")
                .file(dir)
                .remedy("name the folder that `catseye dataset` wrote")
        })?;
        layout.check()?;
        Ok(layout)
    }

    fn find(dir: &Path) -> Result<Option<DatasetLayout>> {
        let path = dir.join(LAYOUT);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e)
                if matches!(e.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) =>
            {
                return Ok(None);
            }
            Err(e) => return Err(Error::io(path, e)),
        };
        let damaged = |e: serde_json::Error| {
            BadInput::new(format!("damaged: {}", json_in_words(&e)))
                .file(&path)
                .line(e.line())
                .remedy("bring back the file that `catseye dataset` wrote")
        };
        let value: serde_json::Value = serde_json::from_str(&text).map_err(damaged)?;
        let version = value.get("store").and_then(serde_json::Value::as_u64);
        if version.is_some_and(|v| v > VERSION.into()) {
            return Err(BadInput::new("written by a later version")
                .file(&path)
                .key("store")
                .value(version.unwrap_or_default())
                .allowed(format!("up to {VERSION}"))
                .remedy("read it with that version of catseye")
                .into());
        }
        let file: LayoutFile = serde_json::from_str(&text).map_err(damaged)?;
        Ok(Some(file.layout))
    }

    /// Writes `layout.json` into `dir`, or checks the one there.
    ///
    /// # Errors
    /// Returns `BadInput` if the folder holds another layout.
    pub(super) fn keep(&self, dir: &Path) -> Result<()> {
        let path = dir.join(LAYOUT);
        if let Some(there) = DatasetLayout::find(dir)? {
            let (there, here) = (there.without_descriptions(), self.without_descriptions());
            if there == here {
                return Ok(());
            }
            return Err(BadInput::new(format!(
                "holds a dataset of another layout ({})",
                there.unlike(&here)
            ))
            .file(dir)
            .remedy("give another folder, or the recipe with which this one was begun")
            .into());
        }
        let file = LayoutFile { store: VERSION, layout: self.clone() };
        let mut text =
            serde_json::to_string_pretty(&file).map_err(|e| Error::Failed(format!("{LAYOUT}: {e}")))?;
        text.push('\n');
        stage::write_file(path, true, text.as_bytes())?;
        Ok(())
    }

    /// The same layout without the descriptions of its arrays, tables and columns, which another version of catseye may word differently.
    fn without_descriptions(&self) -> DatasetLayout {
        let mut bare = self.clone();
        bare.arrays.iter_mut().for_each(|a| a.about.clear());
        for table in &mut bare.tables {
            table.about.clear();
            table.columns.iter_mut().for_each(|c| c.about.clear());
        }
        bare
    }

    /// The first thing in which `self` differs from `other`, in words.
    fn unlike(&self, other: &DatasetLayout) -> String {
        let names = |l: &DatasetLayout| -> Vec<String> {
            l.arrays.iter().map(|a| &a.name).chain(l.tables.iter().map(|t| &t.name)).cloned().collect()
        };
        if self.format != other.format {
            format!("format {}, not {}", self.format.name(), other.format.name())
        } else if self.compression != other.compression {
            format!("compression {}, not {}", self.compression, other.compression)
        } else if self.frames != other.frames {
            format!("{} frames, not {}", self.frames, other.frames)
        } else if self.frames_per_shard != other.frames_per_shard {
            format!("{} frames a shard, not {}", self.frames_per_shard, other.frames_per_shard)
        } else if names(self) != names(other) {
            format!("it holds {}, not {}", names(self).join(", "), names(other).join(", "))
        } else if let Some((a, b)) = self.arrays.iter().zip(&other.arrays).find(|(a, b)| a != b) {
            format!("array {} is {:?} {:?}, not {:?} {:?}", a.name, a.kind, a.shape, b.kind, b.shape)
        } else if let Some((a, _)) = self.tables.iter().zip(&other.tables).find(|(a, b)| a != b) {
            format!("table {} has other columns", a.name)
        } else {
            "other attributes".into()
        }
    }
}

fn absent<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Error {
    let hint = nearest(name, known.clone()).map_or(String::new(), |n| format!(" (nearest: {n})"));
    let all: Vec<&str> = known.collect();
    BadInput::new(format!("no such {what} in the dataset{hint}"))
        .key(what)
        .value(name)
        .allowed(if all.is_empty() { "none".into() } else { all.join(", ") })
        .into()
}
