//! One folder per frame: `frame_000000/NAME.npy` for arrays, `NAME.npz` for those that are compressed (one member `NAME.npy`), `NAME.csv` for tables, and `frame.json` with the
//! length and SHA-256 of each, since these formats have no checksums of their own.

use super::files::{ShardFile, ShardWriter, broken, describe, missing, sync_name, write_parts};
use super::layout::{ArrayKind, ArraySpec, ColumnKind, Compression, DatasetLayout, FRAME, TableSpec};
use super::record::{Column, Data, Record, Table};
use crate::files::frame_name;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::formats::{csv, npy, stage};
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// Name of the file that lists the contents of a frame's folder.
const CONTENTS: &str = "frame.json";

#[derive(serde::Serialize, serde::Deserialize)]
struct Contents {
    frame: u64,
    /// Files by their names in the folder.
    files: Vec<ShardFile>,
}

pub(super) struct Writer<'a> {
    layout: &'a DatasetLayout,
    dir: &'a Path,
    files: Vec<ShardFile>,
}

/// Frames are counted in 32 bits ([`super::DatasetLayout::check`]).
fn folder_name(frame: u64) -> String {
    frame_name(frame as u32)
}

impl<'a> Writer<'a> {
    pub fn new(layout: &'a DatasetLayout, dir: &'a Path) -> Self {
        Writer { layout, dir, files: Vec::new() }
    }
}

/// A folder under construction, removed unless it is finished.
struct Unfinished(PathBuf);

impl Drop for Unfinished {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn remove_folder(path: &Path) -> Result<()> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, e)),
        _ => Ok(()),
    }
}

impl ShardWriter for Writer<'_> {
    fn push(&mut self, record: &Record) -> Result<()> {
        let name = folder_name(record.frame);
        let folder = self.dir.join(&name);
        // One name for all attempts, so that none leaves anything that the next does not remove.
        let temporary = self.dir.join(format!(".{name}.partial"));
        remove_folder(&temporary)?;
        fs::create_dir(&temporary).map_err(|e| Error::io(&temporary, e))?;
        let temporary = Unfinished(temporary);
        let mut files = Vec::new();
        for array in &record.arrays {
            let file = format!("{}.npy", array.name);
            let (head, body) = match &array.data {
                Data::C32(v) => npy::parts(&array.shape, v),
                Data::F32(v) => npy::parts(&array.shape, v),
                Data::U8(v) => npy::parts(&array.shape, v),
                Data::I32(v) => npy::parts(&array.shape, v),
            }?;
            files.push(match deflated(self.layout.array(&array.name)?) {
                Some(level) => {
                    let packed = format!("{}.npz", array.name);
                    let path = temporary.0.join(&packed);
                    pack(&[&head, body], &file, &path, level)?;
                    describe(&path, packed)?
                }
                None => write_parts(&temporary.0.join(&file), file, &[&head, body])?,
            });
        }
        for table in &record.tables {
            let file = format!("{}.csv", table.name);
            let path = temporary.0.join(&file);
            write_table(&path, record.frame, table).map_err(|e| Error::io(&path, e))?;
            files.push(describe(&temporary.0.join(&file), file)?);
        }
        let contents = Contents { frame: record.frame, files };
        let path = temporary.0.join(CONTENTS);
        let text = serde_json::to_string_pretty(&contents)
            .map_err(|e| Error::Failed(format!("{}: {e}", path.display())))?;
        fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
        let mut files = contents.files;
        files.push(describe(&path, CONTENTS.into())?);
        remove_folder(&folder)?;
        fs::rename(&temporary.0, &folder).map_err(|e| Error::io(&folder, e))?;
        sync_name(&folder)?;
        self.files.extend(files.into_iter().map(|f| ShardFile { path: format!("{name}/{}", f.path), ..f }));
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<ShardFile>> {
        Ok(self.files)
    }
}

/// Level of deflate of an array that is compressed.
fn deflated(spec: &ArraySpec) -> Option<u32> {
    match spec.compression {
        Some(Compression::Deflate(level)) => Some(level),
        _ => None,
    }
}

/// Writes an array's file of these parts into the archive `npz`, as its only member of this name. Its time is that of all archives, so that the bytes depend on the
/// array alone.
fn pack(parts: &[&[u8]], member: &str, npz: &Path, level: u32) -> Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(level.into()))
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let write = || -> zip::result::ZipResult<()> {
        let mut archive = ZipWriter::new(BufWriter::new(File::create(npz)?));
        archive.start_file(member, options)?;
        for part in parts {
            archive.write_all(part)?;
        }
        archive.finish()?.flush()?;
        Ok(())
    };
    write().map_err(|e| Error::io(npz, e.into()))
}

/// Numbers of the only member of an archive that [`pack`] wrote.
fn unpack<T: npy::Element>(path: &Path, spec: &ArraySpec) -> Result<Vec<T>> {
    let member = format!("{}.npy", spec.name);
    // The header of a plain array has 128 bytes.
    let most = spec.bytes() as u64 + (1 << 16);
    let read = || -> zip::result::ZipResult<Vec<u8>> {
        let mut archive = ZipArchive::new(BufReader::new(File::open(path)?))?;
        let mut bytes = Vec::new();
        archive.by_name(&member)?.take(most).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = read().map_err(|e| broken(path, e.to_string()))?;
    let wrong =
        || broken(path, format!("{member} is not an array of type {} and shape {:?}", T::NAME, spec.shape));
    // Magic, version 1.0, length of the header, header.
    let Some((b"\x93NUMPY\x01\x00", rest)) = bytes.split_first_chunk::<8>() else { return Err(wrong()) };
    let Some((length, rest)) = rest.split_first_chunk::<2>() else { return Err(wrong()) };
    let Some((header, data)) = rest.split_at_checked(u16::from_le_bytes(*length).into()) else {
        return Err(wrong());
    };
    let lengths: Vec<String> = spec.shape.iter().map(usize::to_string).collect();
    let shape = match &lengths[..] {
        [one] => format!("({one},)"),
        several => format!("({})", several.join(", ")),
    };
    let header = String::from_utf8_lossy(header);
    let plain =
        [format!("'descr': '{}'", T::DESCR), "'fortran_order': False".into(), format!("'shape': {shape}")];
    if data.len() != spec.bytes() || !plain.iter().all(|part| header.contains(part)) {
        return Err(wrong());
    }
    let mut numbers = vec![T::zeroed(); spec.count()];
    bytemuck::cast_slice_mut::<T, u8>(&mut numbers).copy_from_slice(data);
    Ok(numbers)
}

fn write_table(path: &Path, frame: u64, table: &Table) -> std::io::Result<()> {
    let header: Vec<&str> =
        [FRAME].into_iter().chain(table.columns.iter().map(|(n, _)| n.as_str())).collect();
    let mut out = csv::Writer::new(BufWriter::new(File::create(path)?), &[], &header)?;
    let cell = |column: &Column, row: usize| -> Box<dyn Display> {
        match column {
            Column::I64(v) => Box::new(v[row]),
            Column::U32(v) => Box::new(v[row]),
            Column::F64(v) => Box::new(v[row]),
            Column::F32(v) => Box::new(v[row]),
            Column::Bool(v) => Box::new(v[row]),
            Column::Text(v) => Box::new(v[row].clone()),
        }
    };
    for row in 0..table.rows() {
        let cells: Vec<Box<dyn Display>> = table.columns.iter().map(|(_, c)| cell(c, row)).collect();
        out.row([&frame as &dyn Display].into_iter().chain(cells.iter().map(|c| &**c)))?;
    }
    out.finish()?;
    Ok(())
}

/// Path of a file of a frame, after a check that its bytes are those that were written.
fn file_of(dir: &Path, frame: u64, file: String) -> Result<PathBuf> {
    let folder = dir.join(folder_name(frame));
    let list = folder.join(CONTENTS);
    let text = fs::read(&list).map_err(|e| missing(&list, e))?;
    let contents: Contents = serde_json::from_slice(&text).map_err(|e| broken(&list, json_in_words(&e)))?;
    if contents.frame != frame {
        return Err(broken(&list, format!("states that it is frame {}", contents.frame)));
    }
    let path = folder.join(&file);
    let wanted = contents.files.iter().find(|f| f.path == file);
    let wanted = wanted.ok_or_else(|| broken(&list, format!("does not name {file}")))?;
    let bytes = fs::metadata(&path).map_err(|e| missing(&path, e))?.len();
    if bytes != wanted.bytes {
        return Err(broken(
            &path,
            format!("holds {bytes} bytes instead of the {} that were written", wanted.bytes),
        ));
    }
    if stage::sha256_of_file(&path)? != wanted.sha256 {
        return Err(broken(&path, "its SHA-256 differs from that of the file that was written"));
    }
    Ok(path)
}

/// The same error with the remedy of a dataset.
fn as_broken(path: &Path, e: Error) -> Error {
    match e {
        Error::Input(b) => broken(path, BadInput { file: None, ..*b }.to_string()),
        other => other,
    }
}

pub(super) fn read_array(spec: &ArraySpec, dir: &Path, frame: u64) -> Result<Data> {
    if deflated(spec).is_some() {
        let path = file_of(dir, frame, format!("{}.npz", spec.name))?;
        return Ok(match spec.kind {
            ArrayKind::C32 => Data::C32(unpack(&path, spec)?),
            ArrayKind::F32 => Data::F32(unpack(&path, spec)?),
            ArrayKind::U8 => Data::U8(unpack(&path, spec)?),
            ArrayKind::I32 => Data::I32(unpack(&path, spec)?),
        });
    }
    let path = file_of(dir, frame, format!("{}.npy", spec.name))?;
    fn read<T: npy::Element>(path: &Path, shape: &[usize]) -> Result<Vec<T>> {
        let array = npy::read::<T>(path).map_err(|e| as_broken(path, e))?;
        if array.shape != shape {
            return Err(broken(
                path,
                format!("has the shape {:?}, and the layout states {shape:?}", array.shape),
            ));
        }
        Ok(array.data)
    }
    Ok(match spec.kind {
        ArrayKind::C32 => Data::C32(read(&path, &spec.shape)?),
        ArrayKind::F32 => Data::F32(read(&path, &spec.shape)?),
        ArrayKind::U8 => Data::U8(read(&path, &spec.shape)?),
        ArrayKind::I32 => Data::I32(read(&path, &spec.shape)?),
    })
}

pub(super) fn read_table(spec: &TableSpec, dir: &Path, frame: u64) -> Result<Table> {
    let path = file_of(dir, frame, format!("{}.csv", spec.name))?;
    let table = csv::Table::read(&path).map_err(|e| as_broken(&path, e))?;
    fn parse<T: FromStr>(path: &Path, table: &csv::Table, name: &str) -> Result<Vec<T>> {
        let cells = table.text(name).map_err(|e| as_broken(path, e))?;
        let numbers = cells.iter().enumerate().map(|(row, cell)| {
            cell.parse::<T>().map_err(|_| {
                let cell: String = cell.chars().take(40).collect();
                broken(path, format!("line {}: {name} = {cell} is not of its type", table.line(row)))
            })
        });
        numbers.collect()
    }
    let expected = [FRAME].into_iter().chain(spec.columns.iter().map(|c| c.name.as_str()));
    if !table.header.iter().map(String::as_str).eq(expected) {
        return Err(broken(
            &path,
            format!("the columns {} differ from those of the layout", table.header.join(", ")),
        ));
    }
    if let Some(other) = parse::<u64>(&path, &table, FRAME)?.iter().find(|f| **f != frame) {
        return Err(broken(&path, format!("holds rows of frame {other}")));
    }
    let columns = spec.columns.iter().map(|column| {
        let name = &column.name;
        let cells = match column.kind {
            ColumnKind::I64 => Column::I64(parse(&path, &table, name)?),
            ColumnKind::U32 => Column::U32(parse(&path, &table, name)?),
            ColumnKind::F64 => Column::F64(parse(&path, &table, name)?),
            ColumnKind::F32 => Column::F32(parse(&path, &table, name)?),
            ColumnKind::Bool => Column::Bool(parse(&path, &table, name)?),
            ColumnKind::Text => Column::Text(parse(&path, &table, name)?),
        };
        Ok((name.clone(), cells))
    });
    Ok(Table { name: spec.name.clone(), columns: columns.collect::<Result<_>>()? })
}
