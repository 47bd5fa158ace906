//! The record of one frame in a dataset.

use super::layout::{ArrayKind, ArraySpec, ColumnKind, ColumnSpec, DatasetLayout, TableSpec, check_once};
use catseye::base::error::{BadInput, Error, Result};
use num_complex::Complex32;

/// Numbers of an array in C order: the last index runs fastest.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Complex numbers of two f32.
    C32(Vec<Complex32>),
    /// 32-bit floating point.
    F32(Vec<f32>),
    /// 8-bit unsigned integers.
    U8(Vec<u8>),
    /// 32-bit integers.
    I32(Vec<i32>),
}

impl Data {
    /// Type of the numbers.
    pub fn kind(&self) -> ArrayKind {
        match self {
            Data::C32(_) => ArrayKind::C32,
            Data::F32(_) => ArrayKind::F32,
            Data::U8(_) => ArrayKind::U8,
            Data::I32(_) => ArrayKind::I32,
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Data::C32(v) => v.len(),
            Data::F32(v) => v.len(),
            Data::U8(v) => v.len(),
            Data::I32(v) => v.len(),
        }
    }

    /// Whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of the numbers as they are stored, little-endian.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Data::C32(v) => bytemuck::cast_slice(v),
            Data::F32(v) => bytemuck::cast_slice(v),
            Data::U8(v) => v,
            Data::I32(v) => bytemuck::cast_slice(v),
        }
    }

    #[cfg(any(feature = "zarr", feature = "hdf5"))]
    /// Converts stored bytes; `None` if they are no whole number of elements.
    pub(super) fn from_bytes(kind: ArrayKind, bytes: Vec<u8>) -> Option<Data> {
        fn cast<T: bytemuck::Pod>(bytes: &[u8]) -> Option<Vec<T>> {
            bytes.len().is_multiple_of(size_of::<T>()).then(|| bytemuck::pod_collect_to_vec(bytes))
        }
        Some(match kind {
            ArrayKind::C32 => Data::C32(cast(&bytes)?),
            ArrayKind::F32 => Data::F32(cast(&bytes)?),
            ArrayKind::U8 => Data::U8(bytes),
            ArrayKind::I32 => Data::I32(cast(&bytes)?),
        })
    }
}

/// An array of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name of the array.
    pub name: String,
    /// Names of the axes, slowest first, without `frame`.
    pub dims: Vec<String>,
    /// Lengths along each axis.
    pub shape: Vec<usize>,
    /// Elements, the last index fastest.
    pub data: Data,
    /// Unit of the elements.
    pub unit: String,
}

impl Array {
    pub(super) fn of(spec: &ArraySpec, data: Data) -> Array {
        let ArraySpec { name, dims, shape, unit, .. } = spec.clone();
        Array { name, dims, shape, data, unit }
    }

    /// The layout's description of the array.
    pub fn spec(&self) -> ArraySpec {
        let Array { name, dims, shape, data, unit } = self;
        ArraySpec {
            name: name.clone(),
            dims: dims.clone(),
            shape: shape.clone(),
            kind: data.kind(),
            unit: unit.clone(),
            compression: None,
            about: String::new(),
        }
    }
}

/// A column of a frame's rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// 64-bit integers.
    I64(Vec<i64>),
    /// 32-bit unsigned integers.
    U32(Vec<u32>),
    /// 64-bit floating point.
    F64(Vec<f64>),
    /// 32-bit floating point.
    F32(Vec<f32>),
    /// True or false.
    Bool(Vec<bool>),
    /// Text without zero bytes.
    Text(Vec<String>),
}

impl Column {
    /// Makes a column without rows.
    pub fn new(kind: ColumnKind) -> Column {
        match kind {
            ColumnKind::I64 => Column::I64(Vec::new()),
            ColumnKind::U32 => Column::U32(Vec::new()),
            ColumnKind::F64 => Column::F64(Vec::new()),
            ColumnKind::F32 => Column::F32(Vec::new()),
            ColumnKind::Bool => Column::Bool(Vec::new()),
            ColumnKind::Text => Column::Text(Vec::new()),
        }
    }

    /// Type of its values.
    pub fn kind(&self) -> ColumnKind {
        match self {
            Column::I64(_) => ColumnKind::I64,
            Column::U32(_) => ColumnKind::U32,
            Column::F64(_) => ColumnKind::F64,
            Column::F32(_) => ColumnKind::F32,
            Column::Bool(_) => ColumnKind::Bool,
            Column::Text(_) => ColumnKind::Text,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Column::I64(v) => v.len(),
            Column::U32(v) => v.len(),
            Column::F64(v) => v.len(),
            Column::F32(v) => v.len(),
            Column::Bool(v) => v.len(),
            Column::Text(v) => v.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends the rows of `other`; returns false and does nothing if it is of another type.
    pub fn extend(&mut self, other: &Column) -> bool {
        match (self, other) {
            (Column::I64(a), Column::I64(b)) => a.extend_from_slice(b),
            (Column::U32(a), Column::U32(b)) => a.extend_from_slice(b),
            (Column::F64(a), Column::F64(b)) => a.extend_from_slice(b),
            (Column::F32(a), Column::F32(b)) => a.extend_from_slice(b),
            (Column::Bool(a), Column::Bool(b)) => a.extend_from_slice(b),
            (Column::Text(a), Column::Text(b)) => a.extend_from_slice(b),
            _ => return false,
        }
        true
    }
}

/// The rows that one frame adds to a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the table.
    pub name: String,
    /// Columns of equal length, in the layout's order, without `frame`.
    pub columns: Vec<(String, Column)>,
}

impl Table {
    /// Makes a table without rows.
    pub fn new(spec: &TableSpec) -> Table {
        let columns = spec.columns.iter().map(|c| (c.name.clone(), Column::new(c.kind)));
        Table { name: spec.name.clone(), columns: columns.collect() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, c)| c.len())
    }

    /// Finds the column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c)
    }

    /// The layout's description of the table.
    pub fn spec(&self) -> TableSpec {
        let columns = self.columns.iter().map(|(name, c)| ColumnSpec::new(name, c.kind()));
        TableSpec { name: self.name.clone(), columns: columns.collect(), about: String::new() }
    }
}

/// Rows of several frames, the column `frame` first.
#[cfg(any(feature = "zarr", feature = "hdf5"))]
pub(super) struct Rows {
    pub columns: Vec<Column>,
}

#[cfg(any(feature = "zarr", feature = "hdf5"))]
impl Rows {
    pub fn new(spec: &TableSpec) -> Rows {
        let kinds = std::iter::once(ColumnKind::I64).chain(spec.columns.iter().map(|c| c.kind));
        Rows { columns: kinds.map(Column::new).collect() }
    }

    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// Appends the rows of a frame.
    pub fn push(&mut self, frame: u64, table: &Table) -> Result<()> {
        let frames = Column::I64(vec![frame as i64; table.rows()]);
        let more = std::iter::once((super::layout::FRAME, &frames))
            .chain(table.columns.iter().map(|(n, c)| (n.as_str(), c)));
        for (column, (name, rows)) in self.columns.iter_mut().zip(more) {
            if !column.extend(rows) {
                return Err(Error::Failed(format!("column {name} of frame {frame} has another type")));
            }
        }
        Ok(())
    }
}

/// All that is stored of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Number of the frame.
    pub frame: u64,
    /// Its arrays, in the layout's order.
    pub arrays: Vec<Array>,
    /// Its tables, in the layout's order.
    pub tables: Vec<Table>,
}

impl Record {
    /// Finds the array of this name.
    pub fn array(&self, name: &str) -> Option<&Array> {
        self.arrays.iter().find(|a| a.name == name)
    }

    /// Finds the table of this name.
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|t| t.name == name)
    }
}

impl DatasetLayout {
    /// Checks that a record matches this layout.
    pub(super) fn check_record(&self, frame: u64, record: &Record) -> Result<()> {
        let bad =
            |what: String, problem: &str| BadInput::new(problem).key(format!("{what} of frame {frame}"));
        if record.frame != frame {
            return Err(Error::Failed(format!("frame {} arrived instead of frame {frame}", record.frame)));
        }
        check_once("array", record.arrays.iter().map(|a| a.name.as_str()))?;
        check_once("table", record.tables.iter().map(|t| t.name.as_str()))?;
        for array in &record.arrays {
            let spec = self.array(&array.name)?;
            let here = (array.data.kind(), &array.shape, &array.dims, &array.unit);
            if here != (spec.kind, &spec.shape, &spec.dims, &spec.unit) {
                let text = |kind: ArrayKind, shape: &[usize], dims: &[String], unit: &str| {
                    format!("{} {shape:?} [{}] in {unit}", kind.name(), dims.join(", "))
                };
                return Err(bad(format!("array {}", array.name), "differs from the layout")
                    .value(text(here.0, here.1, here.2, here.3))
                    .allowed(text(spec.kind, &spec.shape, &spec.dims, &spec.unit))
                    .remedy(
                        "draw no value that changes the shape: all frames of a dataset have the same shapes",
                    )
                    .into());
            }
            if array.data.len() != spec.count() {
                return Err(bad(
                    format!("array {}", array.name),
                    "the number of values does not fit the shape",
                )
                .value(array.data.len())
                .allowed(spec.count().to_string())
                .into());
            }
        }
        for spec in &self.arrays {
            if !record.arrays.iter().any(|a| a.name == spec.name) {
                return Err(bad(format!("array {}", spec.name), "is missing").into());
            }
        }
        for table in &record.tables {
            let spec = self.table(&table.name)?;
            let here = table.columns.iter().map(|(name, column)| (name.as_str(), column.kind()));
            if !here.clone().eq(spec.columns.iter().map(|c| (c.name.as_str(), c.kind))) {
                let text =
                    |list: Vec<(&str, ColumnKind)>| list.iter().map(|(n, k)| format!("{n} {k:?}")).collect();
                let join = |list: Vec<String>| list.join(", ");
                return Err(bad(format!("table {}", table.name), "does not have the columns of the layout")
                    .value(join(text(here.collect())))
                    .allowed(join(text(spec.columns.iter().map(|c| (c.name.as_str(), c.kind)).collect())))
                    .remedy("complete the dataset with the build of catseye that began it, or make it again with --force")
                    .into());
            }
            let rows = table.rows();
            if let Some((name, column)) = table.columns.iter().find(|(_, c)| c.len() != rows) {
                return Err(bad(format!("table {}", table.name), "its columns differ in length")
                    .value(format!("{} in {name}", column.len()))
                    .allowed(rows.to_string())
                    .into());
            }
            // Text of fixed width, as in HDF5, ends at its zeros.
            let zero =
                |column: &Column| matches!(column, Column::Text(t) if t.iter().any(|s| s.contains('\0')));
            if let Some((name, _)) = table.columns.iter().find(|(_, c)| zero(c)) {
                return Err(bad(format!("table {}", table.name), "a text contains a zero byte")
                    .value(name)
                    .into());
            }
        }
        for spec in &self.tables {
            if !record.tables.iter().any(|t| t.name == spec.name) {
                return Err(bad(format!("table {}", spec.name), "is missing").into());
            }
        }
        Ok(())
    }
}
