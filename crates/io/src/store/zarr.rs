//! Zarr v3 (<https://zarr-specs.readthedocs.io/en/latest/v3/core/v3.0.html>) with the codecs `sharding_indexed`, `bytes`,
//! `zstd` and `crc32c`. A shard is the encoded chunks one after another, then where each lies (offset and length, 16 bytes a
//! chunk), then the CRC-32C of these places; so frames are written as they come, in one order, and the same frames make the
//! same bytes.

use super::files::{ShardFile, ShardWriter, broken};
use super::layout::{ArrayKind, ArraySpec, Compression, DatasetLayout};
use super::parquet_parts;
use super::part::{Part, open};
use super::record::{Data, Record};
use catseye::base::error::{Error, Result};
use catseye::formats::stage;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Offset and length of a chunk that is absent.
const ABSENT: u64 = u64::MAX;
const CRC_BYTES: usize = 4;
const PLACE_BYTES: u64 = 16;

fn codecs(compression: Compression) -> Value {
    let mut list = vec![json!({"name": "bytes", "configuration": {"endian": "little"}})];
    if let Compression::Zstd(level) = compression {
        // The checksum of the next codec covers the compressed bytes.
        list.push(json!({"name": "zstd", "configuration": {"level": level, "checksum": false}}));
    }
    list.push(json!({"name": "crc32c"}));
    Value::Array(list)
}

/// Metadata of an array.
fn metadata(layout: &DatasetLayout, spec: &ArraySpec) -> Value {
    let with = |first: u64| -> Vec<u64> {
        [first].into_iter().chain(spec.shape.iter().map(|n| *n as u64)).collect()
    };
    let dims: Vec<&str> = ["frame"].into_iter().chain(spec.dims.iter().map(String::as_str)).collect();
    // Value that a reader finds where a shard is not there yet.
    let fill = match spec.kind {
        ArrayKind::C32 => json!(["NaN", "NaN"]),
        ArrayKind::F32 => json!("NaN"),
        ArrayKind::U8 | ArrayKind::I32 => json!(0),
    };
    let mut attributes = json!({"units": spec.unit});
    if !spec.about.is_empty() {
        attributes["long_name"] = json!(spec.about);
    }
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": with(layout.frames),
        "data_type": spec.kind.name(),
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": with(layout.frames_per_shard)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": fill,
        "codecs": [{"name": "sharding_indexed", "configuration": {
            "chunk_shape": with(1),
            "codecs": codecs(layout.compression),
            "index_codecs": [
                {"name": "bytes", "configuration": {"endian": "little"}},
                {"name": "crc32c"}
            ],
            "index_location": "end"
        }}],
        "attributes": attributes,
        "dimension_names": dims
    })
}

/// Writes the group and its arrays without chunks. The group repeats the metadata of its arrays, so that a reader need not
/// search the folder, in which tables and other files lie too.
pub(super) fn create(layout: &DatasetLayout, dir: &Path) -> Result<()> {
    let mut arrays = serde_json::Map::new();
    for spec in &layout.arrays {
        let metadata = metadata(layout, spec);
        keep(&dir.join(&spec.name).join("zarr.json"), &metadata)?;
        arrays.insert(spec.name.clone(), metadata);
    }
    let group = json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": layout.attributes,
        "consolidated_metadata": {"kind": "inline", "must_understand": false, "metadata": arrays}
    });
    keep(&dir.join("zarr.json"), &group)
}

fn keep(path: &Path, value: &Value) -> Result<()> {
    let text =
        serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("zarr.json: {e}")))? + "\n";
    if std::fs::read_to_string(path).is_ok_and(|there| there == text) {
        return Ok(());
    }
    stage::write_file(path, true, text.as_bytes())?;
    Ok(())
}

/// Path of the file of a shard below the dataset's folder: the key of its chunk.
fn shard_name(spec: &ArraySpec, shard: u64) -> String {
    format!("{}/c/{shard}{}", spec.name, "/0".repeat(spec.shape.len()))
}

struct ArrayShard {
    part: Part,
    out: BufWriter<File>,
    /// Offset and length of each chunk.
    places: Vec<[u64; 2]>,
    end: u64,
}

impl ArrayShard {
    fn push(&mut self, slot: usize, bytes: &[u8]) -> Result<()> {
        let crc = crc32c::crc32c(bytes).to_le_bytes();
        let written = self.out.write_all(bytes).and_then(|()| self.out.write_all(&crc));
        written.map_err(|e| self.part.failed(e))?;
        let length = (bytes.len() + CRC_BYTES) as u64;
        if let Some(place) = self.places.get_mut(slot) {
            *place = [self.end, length];
        }
        self.end += length;
        Ok(())
    }

    fn finish(mut self) -> Result<ShardFile> {
        let places: Vec<u8> = self.places.iter().flatten().flat_map(|n| n.to_le_bytes()).collect();
        let crc = crc32c::crc32c(&places).to_le_bytes();
        let written = self.out.write_all(&places).and_then(|()| self.out.write_all(&crc));
        written.and_then(|()| self.out.flush()).map_err(|e| self.part.failed(e))?;
        drop(self.out);
        self.part.commit()
    }
}

pub(super) struct Writer<'a> {
    first: u64,
    arrays: Vec<(&'a str, ArrayShard)>,
    tables: Vec<parquet_parts::Writer<'a>>,
    zstd: Option<zstd::bulk::Compressor<'static>>,
}

impl<'a> Writer<'a> {
    pub fn new(layout: &'a DatasetLayout, dir: &Path, shard: u64) -> Result<Self> {
        let arrays = layout.arrays.iter().map(|spec| {
            let part = Part::create(dir, &shard_name(spec, shard))?;
            let file = File::create(part.path()).map_err(|e| part.failed(e))?;
            let places = vec![[ABSENT; 2]; layout.frames_per_shard as usize];
            Ok((spec.name.as_str(), ArrayShard { part, out: BufWriter::new(file), places, end: 0 }))
        });
        let arrays = arrays.collect::<Result<_>>()?;
        let tables = layout.tables.iter().map(|spec| parquet_parts::Writer::new(spec, dir, shard));
        let zstd = match layout.compression {
            Compression::Zstd(level) => Some(
                zstd::bulk::Compressor::new(level)
                    .map_err(|e| Error::Failed(format!("zstd level {level}: {e}")))?,
            ),
            _ => None,
        };
        Ok(Writer {
            first: layout.frames_of(shard).start,
            arrays,
            tables: tables.collect::<Result<_>>()?,
            zstd,
        })
    }
}

impl ShardWriter for Writer<'_> {
    fn push(&mut self, record: &Record) -> Result<()> {
        let slot = (record.frame - self.first) as usize;
        for (name, shard) in &mut self.arrays {
            let Some(array) = record.array(name) else { continue };
            match &mut self.zstd {
                Some(zstd) => {
                    let bytes = zstd.compress(array.data.bytes()).map_err(|e| shard.part.failed(e))?;
                    shard.push(slot, &bytes)?;
                }
                None => shard.push(slot, array.data.bytes())?,
            }
        }
        for writer in &mut self.tables {
            if let Some(table) = record.table(writer.name()) {
                writer.push(record.frame, table)?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<ShardFile>> {
        let arrays = self.arrays.into_iter().map(|(_, shard)| shard.finish());
        let tables = self.tables.into_iter().map(parquet_parts::Writer::finish);
        arrays.chain(tables).collect()
    }
}

/// Reads one frame of one array.
pub(super) fn read(layout: &DatasetLayout, spec: &ArraySpec, dir: &Path, frame: u64) -> Result<Data> {
    let shard = layout.shard_of(frame);
    let path = dir.join(shard_name(spec, shard));
    let mut file = open(&path)?;
    let bad = |problem: String| broken(&path, problem);
    let failed = |e: std::io::Error| Error::io(&path, e);
    let size = file.metadata().map_err(failed)?.len();
    let index_bytes = layout.frames_per_shard * PLACE_BYTES + CRC_BYTES as u64;
    let Some(chunks_end) = size.checked_sub(index_bytes) else {
        return Err(bad(format!(
            "truncated: {size} bytes, and the index of its chunks alone takes {index_bytes}"
        )));
    };
    let mut index = vec![0; index_bytes as usize];
    file.seek(SeekFrom::Start(chunks_end)).and_then(|_| file.read_exact(&mut index)).map_err(failed)?;
    let Some(index) = checked(&index) else {
        return Err(bad("truncated, or the index of its chunks is damaged (CRC-32C)".into()));
    };
    let slot = (frame - layout.frames_of(shard).start) as usize;
    let number =
        |at: usize| index.get(8 * at..8 * at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
    let (Some(offset), Some(length)) = (number(2 * slot), number(2 * slot + 1)) else {
        return Err(bad(format!("frame {frame} is not in the index")));
    };
    if offset == ABSENT && length == ABSENT {
        return Err(bad(format!("frame {frame} is missing")));
    }
    // Zstd makes of n bytes at most n + n/256 + 64 (ZSTD_COMPRESSBOUND).
    let most = spec.bytes() as u64 + spec.bytes() as u64 / 256 + 64 + CRC_BYTES as u64;
    if length > most || offset.checked_add(length).is_none_or(|end| end > chunks_end) {
        return Err(bad(format!("the position of frame {frame} is outside the file")));
    }
    let mut chunk = vec![0; length as usize];
    file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut chunk)).map_err(failed)?;
    let chunk = checked(&chunk).ok_or_else(|| bad(format!("frame {frame} is damaged (CRC-32C)")))?;
    let bytes = match layout.compression {
        Compression::Zstd(_) => zstd::bulk::decompress(chunk, spec.bytes())
            .map_err(|e| bad(format!("frame {frame} cannot be decompressed ({e})")))?,
        _ => chunk.to_vec(),
    };
    if bytes.len() != spec.bytes() {
        return Err(bad(format!(
            "frame {frame} takes {} bytes, and the layout states {}",
            bytes.len(),
            spec.bytes()
        )));
    }
    Data::from_bytes(spec.kind, bytes)
        .ok_or_else(|| bad(format!("frame {frame} is not a whole number of elements")))
}

/// The bytes in front of their CRC-32C, if it is right.
fn checked(bytes: &[u8]) -> Option<&[u8]> {
    let (bytes, crc) = bytes.split_at_checked(bytes.len().checked_sub(CRC_BYTES)?)?;
    (crc == crc32c::crc32c(bytes).to_le_bytes()).then_some(bytes)
}
