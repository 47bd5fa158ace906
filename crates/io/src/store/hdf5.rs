//! A shard as an HDF5 file, `data/part-000000.h5`. Arrays are datasets of the root, `[frame, …]`, in chunks of a frame; a table
//! is a group `/tables/NAME` with a dataset for each column and `row_offsets`: the rows of the file's frame k are
//! `row_offsets[k]..row_offsets[k + 1]`. Every chunk has a Fletcher-32 checksum. Text is UTF-8 of fixed width, filled up with
//! zeros; truth values are h5py's, an enumeration of FALSE and TRUE.

use super::files::{ShardFile, ShardWriter, broken};
use super::layout::{
    ArrayKind, ArraySpec, ColumnKind, Compression, DatasetLayout, FRAME, ROW_OFFSETS, TableSpec,
};
use super::part::{Part, open};
use super::record::{Column, Data, Record, Rows, Table};
use catseye::base::error::{Error, Result};
use hdf5_pure::{
    AttrValue, CharacterSet, CompoundTypeBuilder, Datatype, EnumTypeBuilder, File, FileBuilder, GroupBuilder,
    StringPadding,
};
use std::path::Path;

/// Number of rows of a column in one chunk.
const ROWS_OF_CHUNK: u64 = 4096;
const TABLES: &str = "tables";
/// Largest compression ratio of deflate.
const MOST_OF_A_BYTE: u64 = 1032;

fn shard_name(shard: u64) -> String {
    format!("data/part-{shard:06}.h5")
}

fn number_type(kind: ArrayKind) -> Result<Datatype> {
    Ok(match kind {
        ArrayKind::C32 => CompoundTypeBuilder::new()
            .f32_field("r")
            .f32_field("i")
            .build()
            .map_err(|e| Error::Failed(format!("hdf5: {e}")))?,
        ArrayKind::F32 => hdf5_pure::make_f32_type(),
        ArrayKind::U8 => hdf5_pure::make_u8_type(),
        ArrayKind::I32 => hdf5_pure::make_i32_type(),
    })
}

/// Type of a column; `width` is that of text, in bytes.
fn column_type(kind: ColumnKind, width: u32) -> Result<Datatype> {
    Ok(match kind {
        ColumnKind::I64 => hdf5_pure::make_i64_type(),
        ColumnKind::U32 => hdf5_pure::make_u32_type(),
        ColumnKind::F64 => hdf5_pure::make_f64_type(),
        ColumnKind::F32 => hdf5_pure::make_f32_type(),
        ColumnKind::Bool => EnumTypeBuilder::with_base(hdf5_pure::make_i8_type())
            .raw_value("FALSE", &[0])
            .raw_value("TRUE", &[1])
            .build()
            .map_err(|e| Error::Failed(format!("hdf5: {e}")))?,
        ColumnKind::Text => {
            Datatype::String { size: width, padding: StringPadding::NullPad, charset: CharacterSet::Utf8 }
        }
    })
}

/// Bytes of a column as they are stored, and the width of text.
fn column_bytes(column: &Column) -> (Vec<u8>, u32) {
    match column {
        Column::I64(v) => (bytemuck::cast_slice(v).to_vec(), 0),
        Column::U32(v) => (bytemuck::cast_slice(v).to_vec(), 0),
        Column::F64(v) => (bytemuck::cast_slice(v).to_vec(), 0),
        Column::F32(v) => (bytemuck::cast_slice(v).to_vec(), 0),
        Column::Bool(v) => (v.iter().map(|b| u8::from(*b)).collect(), 0),
        Column::Text(v) => {
            // HDF5 has no text of width 0.
            let width = v.iter().map(String::len).max().unwrap_or(0).max(1);
            let mut bytes = vec![0; width * v.len()];
            for (slot, text) in bytes.chunks_exact_mut(width).zip(v) {
                slot[..text.len()].copy_from_slice(text.as_bytes());
            }
            (bytes, width as u32)
        }
    }
}

pub(super) struct Writer<'a> {
    layout: &'a DatasetLayout,
    part: Part,
    first: u64,
    frames: u64,
    arrays: Vec<Vec<u8>>,
    /// Tables with the row at which each frame begins, and the end.
    tables: Vec<(Rows, Vec<u64>)>,
}

impl<'a> Writer<'a> {
    pub fn new(layout: &'a DatasetLayout, dir: &Path, shard: u64) -> Result<Self> {
        let tables = layout.tables.iter().map(|spec| (Rows::new(spec), vec![0]));
        Ok(Writer {
            layout,
            part: Part::create(dir, &shard_name(shard))?,
            first: layout.frames_of(shard).start,
            frames: 0,
            arrays: vec![Vec::new(); layout.arrays.len()],
            tables: tables.collect(),
        })
    }

    fn compress<'b>(
        &self,
        dataset: &'b mut hdf5_pure::DatasetBuilder,
        chunk: &[u64],
    ) -> &'b mut hdf5_pure::DatasetBuilder {
        let dataset = dataset.with_chunks(chunk).with_fletcher32();
        match self.layout.compression {
            Compression::Deflate(level) => dataset.with_shuffle().with_deflate(level),
            _ => dataset,
        }
    }

    fn put_column(&self, group: &mut GroupBuilder, name: &str, about: &str, column: &Column) -> Result<()> {
        let (bytes, width) = column_bytes(column);
        self.put_rows(
            group,
            name,
            about,
            column_type(column.kind(), width.max(1))?,
            bytes,
            column.len() as u64,
        );
        Ok(())
    }

    fn put_rows(
        &self,
        group: &mut GroupBuilder,
        name: &str,
        about: &str,
        t: Datatype,
        bytes: Vec<u8>,
        rows: u64,
    ) {
        let dataset = group.create_dataset(name);
        if rows == 0 {
            dataset.with_dtype(t).with_shape(&[0]);
        } else {
            let dataset = dataset.with_raw_data(t, bytes, rows).with_shape(&[rows]);
            self.compress(dataset, &[rows.min(ROWS_OF_CHUNK)]);
        }
        if !about.is_empty() {
            dataset.set_attr("about", AttrValue::VarLenString(about.into()));
        }
    }
}

impl ShardWriter for Writer<'_> {
    fn push(&mut self, record: &Record) -> Result<()> {
        self.frames += 1;
        for (spec, bytes) in self.layout.arrays.iter().zip(&mut self.arrays) {
            if let Some(array) = record.array(&spec.name) {
                bytes.extend_from_slice(array.data.bytes());
            }
        }
        for (spec, (rows, offsets)) in self.layout.tables.iter().zip(&mut self.tables) {
            let Some(table) = record.table(&spec.name) else { continue };
            rows.push(record.frame, table)?;
            offsets.push(rows.len() as u64);
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<ShardFile>> {
        let mut file = FileBuilder::new();
        file.set_attr("first_frame", AttrValue::U64(self.first));
        if !self.layout.attributes.is_empty() {
            let text = serde_json::to_string(&self.layout.attributes)
                .map_err(|e| Error::Failed(format!("attributes: {e}")))?;
            file.set_attr("attributes", AttrValue::VarLenString(text));
        }
        for (spec, bytes) in self.layout.arrays.iter().zip(std::mem::take(&mut self.arrays)) {
            let shape = with_frames(spec, self.frames);
            let dims: Vec<String> =
                [FRAME.to_string()].into_iter().chain(spec.dims.iter().cloned()).collect();
            let dataset = file
                .create_dataset(&spec.name)
                .with_raw_data(number_type(spec.kind)?, bytes, shape.iter().product())
                .with_shape(&shape)
                .set_attr("units", AttrValue::VarLenString(spec.unit.clone()))
                .set_attr("axes", AttrValue::StringArray(dims.clone()))
                .set_attr("DIMENSION_LABELS", AttrValue::VarLenStringArray(dims));
            if !spec.about.is_empty() {
                dataset.set_attr("about", AttrValue::VarLenString(spec.about.clone()));
            }
            self.compress(dataset, &with_frames(spec, 1));
        }
        let mut tables = file.create_group(TABLES);
        for (spec, (rows, offsets)) in self.layout.tables.iter().zip(std::mem::take(&mut self.tables)) {
            let mut group = tables.create_group(&spec.name);
            if !spec.about.is_empty() {
                group.set_attr("about", AttrValue::VarLenString(spec.about.clone()));
            }
            let (bytes, count) = (bytemuck::cast_slice(&offsets).to_vec(), offsets.len() as u64);
            self.put_rows(&mut group, ROW_OFFSETS, "", hdf5_pure::make_u64_type(), bytes, count);
            let named = spec.columns.iter().map(|c| (c.name.as_str(), c.about.as_str()));
            for ((name, about), cells) in [(FRAME, "")].into_iter().chain(named).zip(&rows.columns) {
                self.put_column(&mut group, name, about, cells)?;
            }
            tables.add_group(group.finish());
        }
        file.add_group(tables.finish());
        let out = std::fs::File::create(self.part.path()).map_err(|e| self.part.failed(e))?;
        file.finish_to(out).map_err(|e| self.part.failed(std::io::Error::other(e)))?;
        Ok(vec![self.part.commit()?])
    }
}

fn with_frames(spec: &ArraySpec, frames: u64) -> Vec<u64> {
    [frames].into_iter().chain(spec.shape.iter().map(|n| *n as u64)).collect()
}

/// A shard opened for reading, with the position of a frame in it.
struct Shard {
    path: std::path::PathBuf,
    size: u64,
    file: File,
    frames: u64,
    slot: u64,
}

impl Shard {
    fn open(layout: &DatasetLayout, dir: &Path, frame: u64) -> Result<Shard> {
        let shard = layout.shard_of(frame);
        let path = dir.join(shard_name(shard));
        let size = open(&path)?.metadata().map_err(|e| Error::io(&path, e))?.len();
        let file = File::open_streaming(&path)
            .map_err(|e| broken(&path, format!("is not the HDF5 file that was written ({e})")))?;
        let end = file.superblock().eof_address;
        if size != end {
            return Err(broken(&path, format!("truncated: {size} bytes where {end} were written")));
        }
        let frames = layout.frames_of(shard);
        let attributes = file.root().attrs().map_err(|e| broken(&path, e.to_string()))?;
        match attributes.get("first_frame") {
            Some(AttrValue::U64(first)) if *first == frames.start => {}
            other => {
                return Err(broken(&path, format!("its first frame is {other:?}, not {}", frames.start)));
            }
        }
        Ok(Shard { path, size, file, frames: frames.end - frames.start, slot: frame - frames.start })
    }

    /// Reads rows of a dataset after a check that it is as written.
    fn rows(
        &self,
        name: &str,
        t: &Datatype,
        shape: &[u64],
        chunk: &[u64],
        at: u64,
        rows: u64,
    ) -> Result<Vec<u8>> {
        let bad = |e: hdf5_pure::Error| broken(&self.path, format!("{name}: {e}"));
        let dataset = self.file.dataset(name).map_err(bad)?;
        let here = (dataset.datatype().map_err(bad)?, dataset.shape().map_err(bad)?);
        if here.0 != *t || here.1 != shape {
            return Err(broken(
                &self.path,
                format!("{name}: has the shape {:?}, and the layout states {shape:?}", here.1),
            ));
        }
        if rows == 0 {
            return Ok(Vec::new());
        }
        // A chunk is assembled in memory as a whole.
        if dataset.chunk_shape().map_err(bad)?.as_deref() != Some(chunk) {
            return Err(broken(&self.path, format!("{name}: its chunks are not {chunk:?}")));
        }
        dataset.read_raw_rows(at, rows).map_err(bad)
    }
}

pub(super) fn read_array(layout: &DatasetLayout, spec: &ArraySpec, dir: &Path, frame: u64) -> Result<Data> {
    let shard = Shard::open(layout, dir, frame)?;
    let shape = with_frames(spec, shard.frames);
    let bytes =
        shard.rows(&spec.name, &number_type(spec.kind)?, &shape, &with_frames(spec, 1), shard.slot, 1)?;
    if bytes.len() != spec.bytes() {
        return Err(broken(&shard.path, format!("{}: {} bytes of frame {frame}", spec.name, bytes.len())));
    }
    Data::from_bytes(spec.kind, bytes)
        .ok_or_else(|| broken(&shard.path, format!("{}: not a whole number of elements", spec.name)))
}

pub(super) fn read_table(layout: &DatasetLayout, spec: &TableSpec, dir: &Path, frame: u64) -> Result<Table> {
    let shard = Shard::open(layout, dir, frame)?;
    let bad = |problem: String| broken(&shard.path, format!("table {}: {problem}", spec.name));
    let place = |name: &str| format!("{TABLES}/{}/{name}", spec.name);
    let count = shard.frames + 1;
    let chunk = [count.min(ROWS_OF_CHUNK)];
    let offsets = shard.rows(&place(ROW_OFFSETS), &hdf5_pure::make_u64_type(), &[count], &chunk, 0, count)?;
    let offsets: Vec<u64> = bytemuck::pod_collect_to_vec(&offsets);
    let slot = shard.slot as usize;
    if offsets.len() as u64 != count || !offsets.is_sorted() {
        return Err(bad(format!("its {ROW_OFFSETS} do not ascend")));
    }
    let (first, rows) = (offsets[slot], offsets[slot + 1] - offsets[slot]);
    let all = offsets.last().copied().unwrap_or(0);
    if all > shard.size.saturating_mul(MOST_OF_A_BYTE) {
        return Err(bad(format!("{all} rows in a file of {} bytes", shard.size)));
    }
    let column = |name: &str, kind: ColumnKind| -> Result<Column> {
        let name = place(name);
        let width = match shard.file.dataset(&name).and_then(|d| d.datatype()) {
            Ok(Datatype::String { size, .. }) => size,
            _ => 1,
        };
        let t = column_type(kind, width)?;
        let bytes = shard.rows(&name, &t, &[all], &[all.min(ROWS_OF_CHUNK)], first, rows)?;
        let size = match kind {
            ColumnKind::I64 | ColumnKind::F64 => 8,
            ColumnKind::U32 | ColumnKind::F32 => 4,
            ColumnKind::Bool => 1,
            ColumnKind::Text => width as usize,
        };
        if bytes.len() as u64 != rows * size as u64 {
            return Err(bad(format!("{name}: {} bytes in {rows} rows", bytes.len())));
        }
        column_from_bytes(kind, &bytes, size).ok_or_else(|| bad(format!("{name}: is not of its type")))
    };
    if !matches!(column(FRAME, ColumnKind::I64)?, Column::I64(v) if v.iter().all(|n| *n == frame as i64)) {
        return Err(bad(format!("the rows of frame {frame} are not where they should be")));
    }
    let columns = spec.columns.iter().map(|c| Ok((c.name.clone(), column(&c.name, c.kind)?)));
    Ok(Table { name: spec.name.clone(), columns: columns.collect::<Result<_>>()? })
}

fn column_from_bytes(kind: ColumnKind, bytes: &[u8], width: usize) -> Option<Column> {
    Some(match kind {
        ColumnKind::I64 => Column::I64(bytemuck::pod_collect_to_vec(bytes)),
        ColumnKind::U32 => Column::U32(bytemuck::pod_collect_to_vec(bytes)),
        ColumnKind::F64 => Column::F64(bytemuck::pod_collect_to_vec(bytes)),
        ColumnKind::F32 => Column::F32(bytemuck::pod_collect_to_vec(bytes)),
        ColumnKind::Bool => {
            let truth = |b: &u8| matches!(b, 0 | 1).then_some(*b == 1);
            Column::Bool(bytes.iter().map(truth).collect::<Option<_>>()?)
        }
        ColumnKind::Text => {
            let text = |slot: &[u8]| {
                let end = slot.iter().position(|b| *b == 0).unwrap_or(slot.len());
                String::from_utf8(slot[..end].to_vec()).ok()
            };
            Column::Text(bytes.chunks_exact(width.max(1)).map(text).collect::<Option<_>>()?)
        }
    })
}
