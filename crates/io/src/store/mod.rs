//! Frames in shards: a dataset folder's arrays and tables in one of three formats behind one interface.
//!
//! | format | arrays | tables |
//! |---|---|---|
//! | `zarr` | Zarr v3 arrays `NAME`, `[frame, …]`: one chunk a frame, one file a shard | `tables/NAME/part-000000.parquet` a shard |
//! | `hdf5` | `data/part-000000.h5` a shard, datasets `/NAME`, `[frame, …]`, chunks of a frame | groups `/tables/NAME`, a dataset a column |
//! | `frames` | `frame_000000/NAME.npy`, compressed ones `NAME.npz` | `frame_000000/NAME.csv` |
//!
//! `layout.json` describes what is stored in all of them. Numbers are little-endian. Complex numbers are
//! complex64, in HDF5 a compound of `r` and `i`. Every table begins with the column `frame` (int64).
//!
//! A shard is a function of its records alone: whoever writes it, it has the same bytes. Its files appear
//! under their names only when the disk holds them completely. Chunks carry checksums (CRC-32C, in HDF5
//! Fletcher-32), so that a reader distinguishes a damaged shard from data; the SHA-256 tells that a shard is
//! the one that was written ([`ShardFile`]).

mod files;
mod frames;
#[cfg(feature = "hdf5")]
mod hdf5;
mod layout;
#[cfg(feature = "zarr")]
mod parquet_parts;
#[cfg(any(feature = "zarr", feature = "hdf5"))]
mod part;
mod record;
#[cfg(test)]
mod tests;
#[cfg(feature = "zarr")]
mod zarr;

pub use files::ShardFile;
pub use layout::{
    ArrayKind, ArraySpec, ColumnKind, ColumnSpec, Compression, DatasetLayout, FRAME, Format, LAYOUT,
    TableSpec,
};

use files::ShardWriter;
pub use record::{Array, Column, Data, Record, Table};

use catseye::base::error::{BadInput, Error, Result};
use std::path::Path;

impl DatasetLayout {
    /// Makes `dir` a dataset of this layout without frames; if it already is one, nothing is changed.
    ///
    /// # Errors
    /// Returns `BadInput` for a layout that cannot be stored, or a folder that holds another one.
    pub fn create(&self, dir: &Path) -> Result<()> {
        self.check()?;
        self.check_built()?;
        std::fs::create_dir_all(dir).map_err(|e| Error::io(dir, e))?;
        self.keep(dir)?;
        #[cfg(feature = "zarr")]
        if self.format == Format::Zarr {
            zarr::create(self, dir)?;
        }
        Ok(())
    }

    /// Writes one shard into a folder that [`create`](DatasetLayout::create) made. `frames` is called for each of
    /// its frames in order. One is held at a time, with HDF5 the whole shard, and of tables in Zarr a group
    /// of rows. Files of an earlier attempt are replaced.
    ///
    /// # Errors
    /// Returns the errors of `frames`, `BadInput` for a record that does not match the layout or a shard that
    /// does not exist, and an error if a file cannot be written. Nothing of the shard then stands under its
    /// name, except frames in the format `frames`.
    pub fn write_shard(
        &self,
        dir: &Path,
        shard: u64,
        frames: &mut dyn FnMut(u64) -> Result<Record>,
    ) -> Result<Vec<ShardFile>> {
        self.check()?;
        self.check_built()?;
        self.check_shard(shard)?;
        let mut writer: Box<dyn ShardWriter + '_> = match self.format {
            #[cfg(feature = "zarr")]
            Format::Zarr => Box::new(zarr::Writer::new(self, dir, shard)?),
            #[cfg(feature = "hdf5")]
            Format::Hdf5 => Box::new(hdf5::Writer::new(self, dir, shard)?),
            Format::Frames => Box::new(frames::Writer::new(self, dir)),
            #[cfg(not(all(feature = "zarr", feature = "hdf5")))]
            _ => return Err(Error::Failed(format!("no format {} in this build", self.format.name()))),
        };
        for frame in self.frames_of(shard) {
            let record = frames(frame)?;
            self.check_record(frame, &record)?;
            writer.push(&record)?;
        }
        writer.finish()
    }

    /// Reads the whole record of one frame.
    ///
    /// # Errors
    /// Returns `BadInput` for a frame that the dataset does not have, or a shard that is missing, damaged or
    /// of another layout.
    pub fn read(&self, dir: &Path, frame: u64) -> Result<Record> {
        let arrays = self.arrays.iter().map(|a| self.read_array(dir, &a.name, frame));
        let tables = self.tables.iter().map(|t| self.read_table(dir, &t.name, frame));
        Ok(Record { frame, arrays: arrays.collect::<Result<_>>()?, tables: tables.collect::<Result<_>>()? })
    }

    /// Reads one array of a frame.
    ///
    /// # Errors
    /// Returns the errors of [`read`](DatasetLayout::read), and `BadInput` for a name that the dataset does not
    /// have.
    pub fn read_array(&self, dir: &Path, name: &str, frame: u64) -> Result<Array> {
        self.check_frame(frame)?;
        let spec = self.array(name)?;
        let data = match self.format {
            #[cfg(feature = "zarr")]
            Format::Zarr => zarr::read(self, spec, dir, frame)?,
            #[cfg(feature = "hdf5")]
            Format::Hdf5 => hdf5::read_array(self, spec, dir, frame)?,
            Format::Frames => frames::read_array(spec, dir, frame)?,
            #[cfg(not(all(feature = "zarr", feature = "hdf5")))]
            _ => return Err(Error::Failed(format!("no format {} in this build", self.format.name()))),
        };
        Ok(Array::of(spec, data))
    }

    /// Reads the rows of one table that belong to a frame.
    ///
    /// # Errors
    /// Returns the errors of [`read_array`](DatasetLayout::read_array).
    pub fn read_table(&self, dir: &Path, name: &str, frame: u64) -> Result<Table> {
        self.check_frame(frame)?;
        let spec = self.table(name)?;
        match self.format {
            #[cfg(feature = "zarr")]
            Format::Zarr => parquet_parts::read(self, spec, dir, frame),
            #[cfg(feature = "hdf5")]
            Format::Hdf5 => hdf5::read_table(self, spec, dir, frame),
            Format::Frames => frames::read_table(spec, dir, frame),
            #[cfg(not(all(feature = "zarr", feature = "hdf5")))]
            _ => Err(Error::Failed(format!("no format {} in this build", self.format.name()))),
        }
    }

    fn check_frame(&self, frame: u64) -> Result<()> {
        if frame < self.frames {
            return Ok(());
        }
        Err(BadInput::new("the dataset has no such frame")
            .key("frame")
            .value(frame)
            .allowed(format!("0 to {}", self.frames.saturating_sub(1)))
            .into())
    }

    fn check_shard(&self, shard: u64) -> Result<()> {
        if shard < self.shards() {
            return Ok(());
        }
        Err(BadInput::new("the dataset has no such shard")
            .key("shard")
            .value(shard)
            .allowed(format!("0 to {}", self.shards().saturating_sub(1)))
            .into())
    }
}
