//! Tables of a Zarr dataset: one Parquet file per shard, zstd, `tables/NAME/part-000000.parquet`. A row group
//! holds whole frames and has statistics, so that a reader of one frame skips the others by the column
//! `frame`. The key-value metadata `catseye` states the number of rows of each frame, and the CRC-32C of each
//! row group.

use super::files::{ShardFile, broken};
use super::layout::{ColumnKind, DatasetLayout, FRAME, TableSpec};
use super::part::{Part, open};
use super::record::{Column, Rows, Table};
use catseye::base::error::{Error, Result, json_in_words};
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::reader::get_typed_column_reader;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, RowGroupMetaData, SortingColumn};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

/// Number of rows at which a row group is closed with the frame that fills it: few enough that one frame is
/// found quickly, enough that its metadata (some 100 bytes per column) do not matter.
const ROWS_OF_GROUP: usize = 1 << 15;
const CATSEYE: &str = "catseye";

/// Content of the file's metadata under [`CATSEYE`].
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    first_frame: u64,
    rows: Vec<u64>,
    /// CRC32C of the bytes of each row group.
    crc32c: Vec<u32>,
}

fn table_name(spec: &TableSpec, shard: u64) -> String {
    format!("tables/{}/part-{shard:06}.parquet", spec.name)
}

fn schema(spec: &TableSpec) -> std::result::Result<Type, ParquetError> {
    let field = |name: &str, kind: ColumnKind| {
        let (physical, logical) = match kind {
            ColumnKind::I64 => (Physical::INT64, None),
            ColumnKind::U32 => (Physical::INT32, Some(LogicalType::integer(32, false))),
            ColumnKind::F64 => (Physical::DOUBLE, None),
            ColumnKind::F32 => (Physical::FLOAT, None),
            ColumnKind::Bool => (Physical::BOOLEAN, None),
            ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let builder = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        Ok(Arc::new(builder.with_repetition(Repetition::REQUIRED).build()?))
    };
    let columns = spec.columns.iter().map(|c| field(&c.name, c.kind));
    let fields = [field(FRAME, ColumnKind::I64)].into_iter().chain(columns);
    Type::group_type_builder("schema")
        .with_fields(fields.collect::<std::result::Result<_, ParquetError>>()?)
        .build()
}

/// A writer that passes bytes on and computes their CRC-32C.
struct Checked {
    file: File,
    crc: u32,
}

impl Write for Checked {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.crc = crc32c::crc32c_append(self.crc, &bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

pub(super) struct Writer<'a> {
    spec: &'a TableSpec,
    part: Part,
    out: SerializedFileWriter<Checked>,
    rows: Rows,
    about: About,
}

impl<'a> Writer<'a> {
    pub fn new(spec: &'a TableSpec, dir: &Path, shard: u64) -> Result<Self> {
        let part = Part::create(dir, &table_name(spec, shard))?;
        let file = File::create(part.path()).map_err(|e| part.failed(e))?;
        let failed = |e: ParquetError| part.failed(std::io::Error::other(e));
        let by_frame = SortingColumn { column_idx: 0, descending: false, nulls_first: false };
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_sorting_columns(Some(vec![by_frame]))
            .set_max_row_group_row_count(None)
            .build();
        let schema = Arc::new(schema(spec).map_err(failed)?);
        let out = SerializedFileWriter::new(Checked { file, crc: 0 }, schema, Arc::new(properties));
        let mut out = out.map_err(failed)?;
        start_group(&mut out).map_err(|e| part.failed(e))?;
        let about = About { first_frame: 0, rows: Vec::new(), crc32c: Vec::new() };
        Ok(Writer { spec, part, out, rows: Rows::new(spec), about })
    }

    pub fn name(&self) -> &str {
        &self.spec.name
    }

    /// Appends the rows of a frame.
    pub fn push(&mut self, frame: u64, table: &Table) -> Result<()> {
        if self.about.rows.is_empty() {
            self.about.first_frame = frame;
        }
        self.about.rows.push(table.rows() as u64);
        self.rows.push(frame, table)?;
        if self.rows.len() >= ROWS_OF_GROUP { self.write_group() } else { Ok(()) }
    }

    fn write_group(&mut self) -> Result<()> {
        if self.rows.len() == 0 {
            return Ok(());
        }
        let rows = std::mem::replace(&mut self.rows, Rows::new(self.spec));
        let written = (|| {
            let mut group = self.out.next_row_group()?;
            for column in &rows.columns {
                if let Some(mut writer) = group.next_column()? {
                    write_column(writer.untyped(), column)?;
                    writer.close()?;
                }
            }
            group.close()?;
            Ok(())
        })();
        written.map_err(|e: ParquetError| self.part.failed(std::io::Error::other(e)))?;
        self.about.crc32c.push(start_group(&mut self.out).map_err(|e| self.part.failed(e))?);
        Ok(())
    }

    pub fn finish(mut self) -> Result<ShardFile> {
        self.write_group()?;
        let about = serde_json::to_string(&self.about)
            .map_err(|e| Error::Failed(format!("{}: {e}", self.part.path().display())))?;
        self.out.append_key_value_metadata(KeyValue::new(CATSEYE.to_string(), about));
        let closed = self.out.into_inner().and_then(|mut out| Ok(out.flush()?));
        closed.map_err(|e| self.part.failed(std::io::Error::other(e)))?;
        self.part.commit()
    }
}

/// Takes the checksum of what was written since the last call.
fn start_group(out: &mut SerializedFileWriter<Checked>) -> std::io::Result<u32> {
    out.flush()?;
    Ok(std::mem::take(&mut out.inner_mut().crc))
}

fn write_column(writer: &mut ColumnWriter<'_>, column: &Column) -> std::result::Result<(), ParquetError> {
    match (writer, column) {
        (ColumnWriter::Int64ColumnWriter(w), Column::I64(v)) => w.write_batch(v, None, None),
        (ColumnWriter::Int32ColumnWriter(w), Column::U32(v)) => {
            w.write_batch(bytemuck::cast_slice(v), None, None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Column::F64(v)) => w.write_batch(v, None, None),
        (ColumnWriter::FloatColumnWriter(w), Column::F32(v)) => w.write_batch(v, None, None),
        (ColumnWriter::BoolColumnWriter(w), Column::Bool(v)) => w.write_batch(v, None, None),
        (ColumnWriter::ByteArrayColumnWriter(w), Column::Text(v)) => {
            let v: Vec<ByteArray> = v.iter().map(|s| s.as_str().into()).collect();
            w.write_batch(&v, None, None)
        }
        _ => Err(ParquetError::General("a column of another type than the schema says".into())),
    }?;
    Ok(())
}

/// Reads the rows of one frame.
pub(super) fn read(layout: &DatasetLayout, spec: &TableSpec, dir: &Path, frame: u64) -> Result<Table> {
    let shard = layout.shard_of(frame);
    let path = dir.join(table_name(spec, shard));
    let mut file = open(&path)?;
    let bad = |problem: String| broken(&path, problem);
    let failed = |e: ParquetError| bad(format!("is not the Parquet table that was written ({e})"));
    let copy = file.try_clone().map_err(|e| Error::io(&path, e))?;
    let reader = SerializedFileReader::new(copy).map_err(failed)?;
    let meta = reader.metadata();
    let about =
        meta.file_metadata().key_value_metadata().and_then(|list| list.iter().find(|kv| kv.key == CATSEYE));
    let about = about.and_then(|kv| kv.value.as_deref()).unwrap_or_default();
    let about: About = serde_json::from_str(about)
        .map_err(|e| bad(format!("its {CATSEYE} metadata: {}", json_in_words(&e))))?;
    let frames = layout.frames_of(shard);
    let sizes: Vec<u64> = meta.row_groups().iter().map(|g| g.num_rows().max(0) as u64).collect();
    let all: Option<u64> = about.rows.iter().try_fold(0u64, |n, rows| n.checked_add(*rows));
    let expected = schema(spec).map_err(failed)?;
    if meta.file_metadata().schema() != &expected {
        return Err(bad("does not have the columns of the layout".into()));
    }
    if about.first_frame != frames.start || about.rows.len() as u64 != frames.end - frames.start {
        return Err(bad(format!("holds {} frames from {}", about.rows.len(), about.first_frame)));
    }
    if all != Some(sizes.iter().sum()) || about.crc32c.len() != sizes.len() {
        return Err(bad("its row groups do not hold the rows of its frames".into()));
    }
    let slot = (frame - frames.start) as usize;
    let mut skip: u64 = about.rows[..slot].iter().sum();
    let mut table = Table::new(spec);
    if about.rows[slot] == 0 {
        return Ok(table);
    }
    // A group holds whole frames.
    let mut group = 0;
    while group < sizes.len() && skip >= sizes[group] {
        skip -= sizes[group];
        group += 1;
    }
    if group == sizes.len() || skip + about.rows[slot] > sizes[group] {
        return Err(bad(format!("the rows of frame {frame} are in no row group")));
    }
    let range = byte_range(meta.row_group(group), &file)
        .ok_or_else(|| bad("a row group is outside the file".into()))?;
    let mut bytes = vec![0; (range.1 - range.0) as usize];
    file.seek(SeekFrom::Start(range.0))
        .and_then(|_| file.read_exact(&mut bytes))
        .map_err(|e| Error::io(&path, e))?;
    if crc32c::crc32c(&bytes) != about.crc32c[group] {
        return Err(bad(format!("the rows of frame {frame} are damaged (CRC-32C)")));
    }
    let (skip, rows) = (skip as usize, about.rows[slot] as usize);
    let group = reader.get_row_group(group).map_err(failed)?;
    let numbers = read_column(&*group, 0, ColumnKind::I64, skip, rows).map_err(failed)?;
    if !matches!(numbers, Column::I64(v) if v.iter().all(|n| *n == frame as i64)) {
        return Err(bad(format!("the rows of frame {frame} are not where they should be")));
    }
    for (i, (column, (_, cells))) in spec.columns.iter().zip(&mut table.columns).enumerate() {
        *cells = read_column(&*group, i + 1, column.kind, skip, rows).map_err(failed)?;
    }
    Ok(table)
}

/// Offsets of the first byte and of the end; `None` where they are not in the file.
fn byte_range(group: &RowGroupMetaData, file: &File) -> Option<(u64, u64)> {
    let size = file.metadata().ok()?.len();
    let (mut first, mut end) = (u64::MAX, 0);
    for column in group.columns() {
        let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
        let (start, length) = (u64::try_from(start).ok()?, u64::try_from(column.compressed_size()).ok()?);
        first = first.min(start);
        end = end.max(start.checked_add(length)?);
    }
    (first <= end && end <= size).then_some((first, end))
}

fn read_column(
    group: &dyn RowGroupReader,
    index: usize,
    kind: ColumnKind,
    skip: usize,
    rows: usize,
) -> std::result::Result<Column, ParquetError> {
    fn cells<T: DataType>(
        group: &dyn RowGroupReader,
        index: usize,
        skip: usize,
        rows: usize,
    ) -> std::result::Result<Vec<T::T>, ParquetError> {
        let mut reader = get_typed_column_reader::<T>(group.get_column_reader(index)?);
        let mut cells = Vec::new();
        let skipped = reader.skip_records(skip)?;
        while cells.len() < rows {
            let (records, _, _) = reader.read_records(rows - cells.len(), None, None, &mut cells)?;
            if records == 0 {
                break;
            }
        }
        if skipped != skip || cells.len() != rows {
            return Err(ParquetError::EOF(format!("column {index} ends before row {}", skip + rows)));
        }
        Ok(cells)
    }
    Ok(match kind {
        ColumnKind::I64 => Column::I64(cells::<Int64Type>(group, index, skip, rows)?),
        ColumnKind::U32 => Column::U32(bytemuck::cast_vec(cells::<Int32Type>(group, index, skip, rows)?)),
        ColumnKind::F64 => Column::F64(cells::<DoubleType>(group, index, skip, rows)?),
        ColumnKind::F32 => Column::F32(cells::<FloatType>(group, index, skip, rows)?),
        ColumnKind::Bool => Column::Bool(cells::<BoolType>(group, index, skip, rows)?),
        ColumnKind::Text => {
            let text = cells::<ByteArrayType>(group, index, skip, rows)?;
            let text = text.iter().map(|b| b.as_utf8().map(String::from));
            Column::Text(text.collect::<std::result::Result<_, ParquetError>>()?)
        }
    })
}
