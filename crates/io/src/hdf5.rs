//! Cubes in HDF5 files.
//!
//! Written: dataset `adc`, a compound of `r` and `i` (what h5py reads as complex64 or complex128), one block
//! in C order, `[chirp, rx_virtual, sample]` or `[frame, chirp, rx_virtual, sample]`, with the attributes
//! `units` and `axes`; attributes of the root: `catseye` (version), `radar` (its TOML) and `seed`.
//!
//! Read: any dataset of floats or integers, a compound of two of them named r and i, real and imag, or re
//! and im, or two datasets of equal shape.

use super::cube_layout::{Axis, Number, Real, array_layout};
use super::source::{Source, open_file};
use catseye::base::error::{BadInput, Error, Result};
use hdf5_pure::{
    AttrValue, CompoundTypeBuilder, Dataset, Datatype, DatatypeByteOrder, FileBuilder, FloatingPointLayout,
};
use num_complex::Complex;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Name of the dataset that catseye writes and looks for first.
pub const DATASET: &str = "adc";
/// Largest compression ratio of deflate, so that a larger cube means a damaged header.
const MOST_OF_A_BYTE: u64 = 1032;
const PARTS: [[&str; 2]; 3] = [["r", "i"], ["real", "imag"], ["re", "im"]];

fn wrong(path: &Path, what: &str, e: impl std::fmt::Display) -> Error {
    BadInput::new(format!("{what}: {e}")).file(path).into()
}

/// Opens a cube. `dataset` names the dataset, or those of the real and imaginary parts separated by a comma;
/// by default it is `adc`, or the only one. `axes` as in [`array_layout`].
///
/// # Errors
/// Returns `BadInput` for a file that is not HDF5, a missing dataset (with the names that exist), another
/// type, or axes that do not fit.
pub fn open(path: &Path, dataset: Option<&str>, axes: Option<&[Axis]>) -> Result<Source> {
    let size = open_file(path)?.metadata().map_err(|e| Error::io(path, e))?.len();
    let file = hdf5_pure::File::open_streaming(path).map_err(|e| wrong(path, "cannot be read as HDF5", e))?;
    let names = match dataset {
        Some(list) => list.split(',').map(|n| n.trim().to_string()).collect(),
        None => vec![only_dataset(path, &file)?],
    };
    if names.len() > 2 {
        return Err(BadInput::new("more than two datasets are named")
            .key("dataset")
            .value(names.join(","))
            .allowed("NAME, or REAL,IMAGINARY")
            .into());
    }
    let two = names.len() == 2;
    let mut parts = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let bad = |p: String| BadInput::new(p).file(path).key(name);
        let dataset = file.dataset(name).map_err(|e| {
            bad(format!("no such dataset ({e})")).allowed(
                file.root().datasets().map(|d| d.join(", ")).unwrap_or_else(|_| "names of datasets".into()),
            )
        })?;
        let shape = dataset.shape().map_err(|e| bad(format!("no shape: {e}")))?;
        let shape: Vec<usize> = shape.iter().map(|n| usize::try_from(*n).unwrap_or(usize::MAX)).collect();
        let datatype = dataset.datatype().map_err(|e| bad(format!("no type: {e}")))?;
        let (number, big, pair) = number_of(&datatype).map_err(&bad)?;
        if two && pair.is_some() {
            return Err(bad("the dataset is complex already".into()).remedy("name only this dataset").into());
        }
        let layout = array_layout(&shape, axes, false, number, big, pair)
            .map_err(|p| bad(p).key("shape").value(format!("{shape:?}")))?;
        if two && layout.is_complex() {
            return Err(bad("the dataset has an axis of real and imaginary parts already".into())
                .remedy("name only this dataset")
                .into());
        }
        if layout.bytes() > size.saturating_mul(MOST_OF_A_BYTE) {
            return Err(bad(format!(
                "{} bytes of samples do not fit into a file of {size} bytes",
                layout.bytes()
            ))
            .into());
        }
        // A chunk is assembled in memory as a whole.
        let chunk = dataset.chunk_shape().map_err(|e| bad(format!("no chunks: {e}")))?;
        let element = layout.bytes() / shape.iter().map(|n| *n as u64).product::<u64>().max(1);
        let chunk = chunk.unwrap_or_default().iter().fold(element, |n, d| n.saturating_mul(*d));
        if chunk > size.saturating_mul(MOST_OF_A_BYTE) {
            return Err(bad(format!("chunks of {chunk} bytes do not fit into a file of {size} bytes")).into());
        }
        parts.push((if i == 1 { layout.imaginary() } else { layout }, dataset));
    }
    if let [(a, _), (b, _)] = parts.as_slice()
        && (a.shape(), a.frames()) != (b.shape(), b.frames())
    {
        return Err(BadInput::new("the two datasets have different shapes")
            .file(path)
            .key(names.join(","))
            .value(format!("{:?} and {:?}", a.shape(), b.shape()))
            .into());
    }
    let arrays = parts.into_iter().map(|(layout, dataset)| {
        let fetch = rows_of(path.to_path_buf(), dataset, layout.slowest_bytes());
        (layout, Box::new(fetch) as _)
    });
    Ok(Source::new(path, arrays.collect()))
}

/// Reads bytes of a dataset by places of its slowest axis, of `row` bytes each. Those read last are kept.
fn rows_of(path: PathBuf, dataset: Dataset, row: u64) -> impl FnMut(u64, &mut [u8]) -> Result<()> {
    let (mut rows, mut bytes) = (0..0, Vec::new());
    move |at, to| {
        let want = at / row..(at + to.len() as u64).div_ceil(row);
        if want.start < rows.start || want.end > rows.end {
            bytes = dataset
                .read_raw_rows(want.start, want.end - want.start)
                .map_err(|e| wrong(&path, "the samples cannot be read", e))?;
            rows = want;
        }
        let from = (at - rows.start * row) as usize;
        let here = bytes.get(from..from + to.len()).ok_or_else(|| {
            wrong(&path, "the samples cannot be read", "the dataset is shorter than its shape")
        })?;
        to.copy_from_slice(here);
        Ok(())
    }
}

fn only_dataset(path: &Path, file: &hdf5_pure::File) -> Result<String> {
    let names = file.root().datasets().map_err(|e| wrong(path, "has no readable root", e))?;
    if names.iter().any(|n| n == DATASET) {
        return Ok(DATASET.into());
    }
    match names.as_slice() {
        [one] => Ok(one.clone()),
        _ => Err(BadInput::new(format!(
            "the file has {} datasets, and none is known to be the cube",
            names.len()
        ))
        .file(path)
        .key("dataset")
        .allowed(if names.is_empty() { "a path such as group/name".into() } else { names.join(", ") })
        .remedy("name the dataset, or two as REAL,IMAGINARY")
        .into()),
    }
}

/// Type of the numbers, whether they are big-endian, and for a compound which member is which part.
fn number_of(t: &Datatype) -> Result<(Number, bool, Option<[usize; 2]>), String> {
    let allowed =
        "float32, float64, int8, uint8, int16, uint16, int32, or a compound of two, {r, i} or {real, imag}";
    let big = |order: &DatatypeByteOrder| match order {
        DatatypeByteOrder::LittleEndian => Ok(false),
        DatatypeByteOrder::BigEndian => Ok(true),
        _ => Err(format!("the byte order is not supported; allowed: {allowed}")),
    };
    match t {
        Datatype::FloatingPoint { size: 4, byte_order, layout }
            if *layout == FloatingPointLayout::IEEE754_BINARY32 =>
        {
            Ok((Number::F32, big(byte_order)?, None))
        }
        Datatype::FloatingPoint { size: 8, byte_order, layout }
            if *layout == FloatingPointLayout::IEEE754_BINARY64 =>
        {
            Ok((Number::F64, big(byte_order)?, None))
        }
        Datatype::FixedPoint { size, byte_order, layout }
            if layout.bit_offset == 0 && u32::from(layout.bit_precision) == 8 * size =>
        {
            let number = match (size, layout.signed) {
                (1, true) => Number::I8,
                (1, false) => Number::U8,
                (2, true) => Number::I16 { bits: 16 },
                (2, false) => Number::U16,
                (4, true) => Number::I32,
                _ => return Err(format!("the integer type is not supported; allowed: {allowed}")),
            };
            Ok((number, big(byte_order)?, None))
        }
        Datatype::Compound { size, members } if members.len() == 2 => {
            let place = |name: &str| members.iter().position(|m| m.name == name);
            let pair = PARTS.iter().find_map(|[r, i]| Some([place(r)?, place(i)?]));
            let [re, im] = pair.ok_or_else(|| {
                format!(
                    "a compound of {} and {} is not supported; allowed: {allowed}",
                    members[0].name, members[1].name
                )
            })?;
            let (number, big, nested) = number_of(&members[re].datatype)?;
            let same = members[re].datatype == members[im].datatype;
            let half = number.bytes() as u64;
            // Which half of the element each part fills.
            let (re_at, im_at) = (members[re].byte_offset, members[im].byte_offset);
            let filled = u64::from(*size) == 2 * half && re_at + im_at == half && re_at % half == 0;
            if !same || !filled || nested.is_some() {
                return Err(format!(
                    "a compound with gaps or different members is not supported; allowed: {allowed}"
                ));
            }
            Ok((number, big, Some([(re_at / half) as usize, (im_at / half) as usize])))
        }
        _ => Err(format!("the type is not supported; allowed: {allowed}")),
    }
}

/// Writes a cube of shape `[chirp, rx_virtual, sample]`, or with frames in front. The file is assembled in
/// memory, which holds a copy of the samples.
///
/// # Errors
/// Returns an error if the shape does not hold the samples, or if the file cannot be written.
pub fn write<T: Real + bytemuck::Pod>(
    path: &Path,
    shape: &[usize],
    data: &[Complex<T>],
    radar_toml: Option<&str>,
    seed: Option<u64>,
) -> Result<()> {
    let count = shape.iter().try_fold(1usize, |n, d| n.checked_mul(*d));
    if count != Some(data.len()) || !matches!(shape.len(), 3 | 4) {
        return Err(Error::Failed(format!(
            "{}: {} samples do not make a cube of shape {shape:?}",
            path.display(),
            data.len()
        )));
    }
    let mut bytes = Vec::with_capacity(std::mem::size_of_val(data));
    for z in data {
        bytes.extend_from_slice(bytemuck::bytes_of(&z.re));
        bytes.extend_from_slice(bytemuck::bytes_of(&z.im));
    }
    let failed = |e: hdf5_pure::Error| Error::Failed(format!("{}: {e}", path.display()));
    let part = match size_of::<T>() {
        4 => hdf5_pure::make_f32_type(),
        _ => hdf5_pure::make_f64_type(),
    };
    let complex = CompoundTypeBuilder::new()
        .field("r", part.clone())
        .field("i", part)
        .build()
        .map_err(|e| Error::Failed(format!("{}: {e}", path.display())))?;
    let axes = ["frame", "chirp", "rx_virtual", "sample"][4 - shape.len()..].iter().map(|s| s.to_string());
    let mut file = FileBuilder::new();
    file.create_dataset(DATASET)
        .with_compound_data(complex, bytes, data.len() as u64)
        .with_shape(&shape.iter().map(|n| *n as u64).collect::<Vec<_>>())
        .set_attr("units", AttrValue::String("sqrt(W)".into()))
        .set_attr("axes", AttrValue::StringArray(axes.collect()));
    file.set_attr("catseye", AttrValue::String(env!("CARGO_PKG_VERSION").into()));
    if let Some(radar) = radar_toml {
        file.set_attr("radar", AttrValue::String(radar.into()));
    }
    if let Some(seed) = seed {
        file.set_attr("seed", AttrValue::U64(seed));
    }
    let out = File::create(path).map_err(|e| Error::io(path, e))?;
    file.finish_to(BufWriter::new(out)).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::{Complex32, Complex64};
    use proptest::prelude::*;

    fn all<T: Real>(path: &Path, dataset: Option<&str>, frame: usize) -> Vec<Complex<T>> {
        let mut r = open(path, dataset, None).unwrap();
        let n = r.shape()[1];
        r.channels(frame, 0..n).unwrap()
    }

    fn message(path: &Path, dataset: Option<&str>) -> String {
        let e = open(path, dataset, None).err().unwrap();
        let s = e.to_string();
        assert_eq!((e.exit_code(), s.lines().count()), (2, 1), "{s}");
        s
    }

    fn built(f: impl FnOnce(&mut FileBuilder)) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut b = FileBuilder::new();
        f(&mut b);
        std::fs::write(file.path(), b.finish().unwrap()).unwrap();
        file
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn round_trip(frames in 1usize..3, chirps in 1usize..5, channels in 1usize..5, samples in 1usize..40, seed in any::<u64>()) {
            let shape = [frames, chirps, channels, samples];
            let n = shape.iter().product::<usize>() as u64;
            let x = |i: u64| (i.wrapping_mul(seed | 1) >> 11) as f64 * 1e-12 - 4.0;
            let f64s: Vec<Complex64> = (0..n).map(|i| Complex64::new(x(2 * i), x(2 * i + 1))).collect();
            let f32s: Vec<Complex32> = f64s.iter().map(|z| Complex32::new(z.re as f32, z.im as f32)).collect();
            let file = tempfile::NamedTempFile::new().unwrap();
            let radar = Some("name = \"ü\"\n");
            let one = chirps * channels * samples;
            write(file.path(), &shape, &f64s, radar, Some(seed)).unwrap();
            for f in 0..frames {
                prop_assert_eq!(&all::<f64>(file.path(), None, f), &f64s[f * one..][..one]);
            }
            write(file.path(), &shape[1..], &f32s[..one], radar, Some(seed)).unwrap();
            prop_assert_eq!(&all::<f32>(file.path(), Some("adc"), 0), &f32s[..one]);
            let mut r = open(file.path(), None, None).unwrap();
            let last: Vec<Complex32> = r.channels(0, channels - 1..channels).unwrap();
            for c in 0..chirps {
                let want = &f32s[(c * channels + channels - 1) * samples..][..samples];
                prop_assert_eq!(&last[c * samples..][..samples], want);
            }
            let read = hdf5_pure::File::open_streaming(file.path()).unwrap();
            let units = &read.dataset(DATASET).unwrap().attrs().unwrap()["units"];
            prop_assert!(matches!(units, AttrValue::String(s) | AttrValue::AsciiString(s) if s == "sqrt(W)"));
            let root = read.root().attrs().unwrap();
            prop_assert!(matches!(&root["radar"], AttrValue::String(s) if Some(s.as_str()) == radar));
            prop_assert!(matches!(root["seed"], AttrValue::U64(n) if n == seed));
        }
    }

    #[test]
    fn what_others_write() {
        let n = 2 * 3 * 4;
        let re: Vec<i16> = (0..n).collect();
        let im: Vec<f64> = (0..n).map(|i| -0.5 * f64::from(i)).collect();
        let pairs: Vec<(f64, f64)> = re.iter().zip(&im).map(|(r, i)| (f64::from(*r), *i)).collect();
        let want: Vec<Complex64> = pairs.iter().map(|(r, i)| Complex64::new(*r, *i)).collect();
        let file = built(|b| {
            b.create_dataset("i_data").with_i16_data(&re).with_shape(&[2, 3, 4]);
            b.create_dataset("q_data").with_f64_data(&im).with_shape(&[2, 3, 4]).with_chunks(&[1, 2, 3]);
            b.create_dataset("matlab").with_complex64_data(&pairs).with_shape(&[2, 3, 4]);
            b.create_dataset("flat").with_f64_data(&im).with_shape(&[6, 4]);
            b.create_dataset("bytes").with_u64_data(&[1; 24]).with_shape(&[2, 3, 4]);
            let odd = CompoundTypeBuilder::new().f64_field("x").f64_field("y").build().unwrap();
            b.create_dataset("xy").with_compound_data(odd, vec![0; 24 * 16], 24).with_shape(&[2, 3, 4]);
            // Imaginary part first.
            let turned = CompoundTypeBuilder::new().f64_field("imag").f64_field("real").build().unwrap();
            let raw = pairs.iter().flat_map(|(r, i)| [i.to_le_bytes(), r.to_le_bytes()].concat()).collect();
            b.create_dataset("turned").with_compound_data(turned, raw, 24).with_shape(&[2, 3, 4]);
        });
        let p = file.path();
        assert_eq!(all::<f64>(p, Some("i_data, q_data"), 0), want);
        assert_eq!(all::<f64>(p, Some("matlab"), 0), want);
        assert_eq!(all::<f64>(p, Some("turned"), 0), want);
        let real = open(p, Some("i_data"), None).unwrap();
        assert_eq!((real.is_complex(), real.shape()), (false, [2, 3, 4]));
        for (dataset, expect) in [
            (None, "the file has 7 datasets, and none is known to be the cube"),
            (Some("gone"), "no such dataset"),
            (Some("flat"), "the array has 2 axes, not 3"),
            (Some("bytes"), "integer type is not supported"),
            (Some("xy"), "a compound of x and y"),
            (Some("matlab,q_data"), "the dataset is complex already"),
            (Some("a,b,c"), "more than two"),
        ] {
            let s = message(p, dataset);
            assert!(s.contains(expect), "{s}");
        }
        // Only one there: it is the cube.
        let file = built(|b| {
            b.create_dataset("x").with_f64_data(&im).with_shape(&[2, 3, 4]);
        });
        assert_eq!(all::<f64>(file.path(), None, 0)[1], Complex64::new(-0.5, 0.0));
    }

    #[test]
    fn hostile_files() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let data: Vec<Complex32> = (0..24).map(|i| Complex32::new(i as f32, 1.0)).collect();
        write(file.path(), &[2, 3, 4], &data, None, None).unwrap();
        let good = std::fs::read(file.path()).unwrap();
        // Cut off anywhere: an error, at opening or at reading, never other samples.
        for n in 0..good.len() {
            std::fs::write(file.path(), &good[..n]).unwrap();
            let read = open(file.path(), None, None).and_then(|mut r| r.channels::<f32>(0, 0..3));
            assert!(read.as_ref().map_or(true, |z| *z == data), "{n} of {} bytes", good.len());
            if n + 200 < good.len() {
                assert!(read.is_err(), "{n} of {} bytes", good.len());
            }
        }
        for bytes in [&b"not HDF5 at all, but long enough for a superblock"[..], &[]] {
            std::fs::write(file.path(), bytes).unwrap();
            assert!(message(file.path(), None).contains("cannot be read as HDF5"));
        }
        let mut nan = data.clone();
        nan[17].im = f32::NAN;
        write(file.path(), &[2, 3, 4], &nan, None, None).unwrap();
        let e = open(file.path(), None, None).unwrap().channels::<f32>(0, 0..3).unwrap_err();
        assert!(e.to_string().contains("index [chirp 1, rx_virtual 1, sample 1]"), "{e}");
        assert!(write(file.path(), &[2, 3, 5], &nan, None, None).is_err());
        assert!(open(Path::new("/nonexistent.h5"), None, None).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        /// Any damage: samples or one line, no panic.
        #[test]
        fn damaged_bytes(at in 0usize..700, byte in any::<u8>(), more in 0usize..700, other in any::<u8>()) {
            let file = tempfile::NamedTempFile::new().unwrap();
            let data: Vec<Complex32> = (0..24).map(|i| Complex32::new(i as f32, 1.0)).collect();
            write(file.path(), &[2, 3, 4], &data, None, None).unwrap();
            let mut bytes = std::fs::read(file.path()).unwrap();
            let n = bytes.len();
            bytes[at % n] = byte;
            bytes[more % n] = other;
            std::fs::write(file.path(), &bytes).unwrap();
            if let Ok(mut r) = open(file.path(), None, None) {
                let n = r.shape()[1];
                if let Err(e) = r.channels::<f32>(0, 0..n) {
                    prop_assert_eq!(e.to_string().lines().count(), 1);
                }
            }
        }
    }
}
