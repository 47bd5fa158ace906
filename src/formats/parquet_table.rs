//! Tables of numbers as Parquet: one column of doubles for each name, comments in the file's key-value
//! metadata under `comments`, one to a line.

use super::csv::Columns;
use crate::base::error::{BadInput, Error, Result};
use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::types::Type;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const COMMENTS: &str = "comments";

/// A Parquet file in memory.
pub struct Table {
    path: PathBuf,
    comments: Vec<String>,
    names: Vec<String>,
    /// Cells by column; NaN where a cell is no number.
    cells: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a table.
    ///
    /// # Errors
    /// Returns `BadInput` for a file that is missing, not Parquet, or compressed in a way that this build does not
    /// read.
    pub fn read(path: impl AsRef<Path>) -> Result<Table> {
        let path = path.as_ref();
        let bad = |e: ParquetError| -> Error {
            BadInput::new("is not a Parquet table that can be read")
                .file(path)
                .value(e)
                .remedy("write it with columns of doubles, uncompressed or with snappy or zstd")
                .into()
        };
        let file = super::input::open(path, "a Parquet table")?;
        let reader = SerializedFileReader::new(file).map_err(bad)?;
        let meta = reader.metadata().file_metadata();
        let of_key = |kv: &KeyValue| (kv.key == COMMENTS).then(|| kv.value.clone()).flatten();
        let comments = meta.key_value_metadata().and_then(|list| list.iter().find_map(of_key));
        let names: Vec<String> = meta.schema().get_fields().iter().map(|f| f.name().to_string()).collect();
        let mut cells = vec![Vec::new(); names.len()];
        for row in reader.get_row_iter(None).map_err(bad)? {
            let row = row.map_err(bad)?;
            for (column, (_, field)) in cells.iter_mut().zip(row.get_column_iter()) {
                column.push(number(field));
            }
        }
        Ok(Table {
            path: path.to_path_buf(),
            comments: comments.iter().flat_map(|c| c.lines()).map(String::from).collect(),
            names,
            cells,
        })
    }
}

fn number(field: &Field) -> f64 {
    match *field {
        Field::Double(x) => x,
        Field::Float(x) => x.into(),
        Field::Byte(x) => x.into(),
        Field::Short(x) => x.into(),
        Field::Int(x) => x.into(),
        Field::Long(x) => x as f64,
        Field::UByte(x) => x.into(),
        Field::UShort(x) => x.into(),
        Field::UInt(x) => x.into(),
        Field::ULong(x) => x as f64,
        _ => f64::NAN,
    }
}

impl Columns for Table {
    fn comments(&self) -> &[String] {
        &self.comments
    }

    fn has(&self, column: &str) -> bool {
        self.names.iter().any(|n| n == column)
    }

    fn len(&self) -> usize {
        self.cells.first().map_or(0, Vec::len)
    }

    fn line(&self, row: usize) -> usize {
        row + 1
    }

    fn numbers(&self, column: &str) -> Result<Vec<f64>> {
        let bad = |what| BadInput::new(what).file(&self.path).key(column);
        let i =
            self.names.iter().position(|n| n == column).ok_or_else(|| {
                bad("the column is missing").allowed(self.names.join(", ")).remedy("add it")
            })?;
        match self.cells[i].iter().position(|x| x.is_nan()) {
            None => Ok(self.cells[i].clone()),
            Some(row) => Err(bad("is not a number").line(row + 1).into()),
        }
    }
}

/// Writes columns of equal length.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(path: impl AsRef<Path>, comments: &[String], columns: &[(&str, Vec<f64>)]) -> Result<()> {
    let path = path.as_ref();
    let failed = |e: ParquetError| Error::io(path, std::io::Error::other(e));
    let fields = columns.iter().map(|(name, _)| {
        let builder = Type::primitive_type_builder(name, Physical::DOUBLE);
        Ok(Arc::new(builder.with_repetition(Repetition::REQUIRED).build()?))
    });
    let fields = fields.collect::<std::result::Result<Vec<_>, ParquetError>>().map_err(failed)?;
    let schema = Type::group_type_builder("schema").with_fields(fields).build().map_err(failed)?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(vec![KeyValue::new(COMMENTS.to_string(), comments.join("\n"))]))
        .build();
    let file = std::fs::File::create(path).map_err(|e| Error::io(path, e))?;
    let written = || -> std::result::Result<(), ParquetError> {
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for (_, values) in columns {
            if let Some(mut column) = group.next_column()? {
                column.typed::<DoubleType>().write_batch(values, None, None)?;
                column.close()?;
            }
        }
        group.close()?;
        writer.close()?;
        Ok(())
    };
    written().map_err(failed)
}
