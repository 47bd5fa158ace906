//! NumPy `.npy` files of any rank (NEP 1; <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>).
//! Written as version 1.0, little-endian, C order. Read in versions 1 to 3, little-endian, C or
//! Fortran order (turned into C order).
//!
//! A cube to a file and back:
//!
//! ```
//! use catseye::formats::npy;
//! use num_complex::Complex32;
//!
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join("cube.npy");
//! // `[chirp, channel, sample]`, the last index fastest.
//! let samples: Vec<Complex32> = (0..24).map(|i| Complex32::new(i as f32, -1.0)).collect();
//! npy::write(&file, &[2, 3, 4], &samples)?;
//! assert_eq!(npy::read_header(&file)?.dtype(), "complex64");
//! let cube = npy::read::<Complex32>(&file)?;
//! assert_eq!((cube.shape, cube.data), (vec![2, 3, 4], samples));
//! // Another type is an error instead of a conversion that nobody asked for.
//! assert!(npy::read::<f64>(&file).is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::base::error::{BadInput, Error, Result};
use bytemuck::Pod;
use num_complex::{Complex32, Complex64};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

#[cfg(target_endian = "big")]
compile_error!("npy files are read and written by casting little-endian memory");

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// NumPy pads so that the data starts at a multiple of this.
const ALIGN: usize = 64;
/// A header holds one short dictionary; a longer one is not a plain array.
const MAX_HEADER_BYTES: usize = 1 << 16;
/// NumPy's own limit on the number of dimensions.
const MAX_RANK: usize = 64;

/// A type that has a NumPy dtype.
pub trait Element: Pod {
    /// The dtype string, e.g. `<c8`.
    const DESCR: &'static str;
    /// NumPy's name for it, e.g. `complex64`.
    const NAME: &'static str;
}

macro_rules! element {
    ($($t:ty, $descr:literal, $name:literal;)*) => {
        $(impl Element for $t { const DESCR: &'static str = $descr; const NAME: &'static str = $name; })*
        /// The name for a dtype string among those that can be read.
        fn name_of(descr: &str) -> Option<&'static str> {
            match descr { $($descr => Some($name),)* _ => None }
        }
    };
}
element! {
    Complex32, "<c8", "complex64";
    Complex64, "<c16", "complex128";
    f32, "<f4", "float32";
    f64, "<f8", "float64";
    i32, "<i4", "int32";
    u8, "|u1", "uint8";
}

/// An array in C order: the last index runs fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Array<T> {
    /// Lengths along each axis.
    pub shape: Vec<usize>,
    /// Elements, the last index fastest.
    pub data: Vec<T>,
}

/// Type, shape and place of the data, from the first bytes of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Type of the elements as NumPy writes it.
    pub descr: String,
    /// Whether the first index runs fastest.
    pub fortran_order: bool,
    /// Lengths along each axis.
    pub shape: Vec<usize>,
    /// Where the numbers begin, in bytes.
    pub data_at: usize,
}

impl Header {
    /// `complex64` and so on, or the raw dtype string of a type that is not read here.
    pub fn dtype(&self) -> &str {
        name_of(&self.descr).unwrap_or(&self.descr)
    }
}

/// Writes a whole array. `data.len()` must be the product of `shape`.
///
/// # Errors
/// Returns an error if the number of elements is not that of the shape, or if the file cannot be written.
pub fn write<T: Element>(path: impl AsRef<Path>, shape: &[usize], data: &[T]) -> Result<()> {
    let mut w = Writer::create(path, shape)?;
    w.push(data)?;
    w.finish()
}

/// The bytes of a whole array's file: its header and its data.
///
/// # Errors
/// Returns an error if the number of elements is not that of the shape.
pub fn parts<'a, T: Element>(shape: &[usize], data: &'a [T]) -> Result<(Vec<u8>, &'a [u8])> {
    if element_count(shape) != Some(data.len()) {
        return Err(Error::Failed(format!("{} elements for an array of shape {shape:?}", data.len())));
    }
    Ok((header_bytes::<T>(shape), bytemuck::cast_slice(data)))
}

/// Writes an array piece by piece, for cubes that do not fit into memory.
pub struct Writer<T> {
    path: PathBuf,
    file: BufWriter<File>,
    missing: usize,
    element: PhantomData<T>,
}

impl<T: Element> Writer<T> {
    /// Begins a file for an array of this shape.
    ///
    /// # Errors
    /// Returns an error for a file that cannot be created or written.
    pub fn create(path: impl AsRef<Path>, shape: &[usize]) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let count = element_count(shape)
            .ok_or_else(|| Error::Failed(format!("{}: shape {shape:?} is too large", path.display())))?;
        let mut file = BufWriter::new(File::create(&path).map_err(|e| Error::io(&path, e))?);
        file.write_all(&header_bytes::<T>(shape)).map_err(|e| Error::io(&path, e))?;
        Ok(Writer { path, file, missing: count, element: PhantomData })
    }

    /// Appends elements in C order.
    ///
    /// # Errors
    /// Returns an error if the number of elements is not that of the shape, or if the file cannot be written.
    pub fn push(&mut self, data: &[T]) -> Result<()> {
        self.missing = self.missing.checked_sub(data.len()).ok_or_else(|| {
            Error::Failed(format!("{}: more elements than the shape holds", self.path.display()))
        })?;
        self.file.write_all(bytemuck::cast_slice(data)).map_err(|e| Error::io(&self.path, e))
    }

    /// Finishes the file, whose elements must be as many as the shape says.
    ///
    /// # Errors
    /// Returns an error if the number of elements is not that of the shape, or if the file cannot be written.
    pub fn finish(mut self) -> Result<()> {
        if self.missing != 0 {
            return Err(Error::Failed(format!(
                "{}: {} elements are missing from the shape",
                self.path.display(),
                self.missing
            )));
        }
        self.file.flush().map_err(|e| Error::io(&self.path, e))
    }
}

fn header_bytes<T: Element>(shape: &[usize]) -> Vec<u8> {
    let mut dims = shape.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 {
        dims.push(',');
    }
    let mut dict = format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({dims}), }}", T::DESCR);
    let unpadded = MAGIC.len() + 2 + 2 + dict.len() + 1;
    dict.push_str(&" ".repeat(unpadded.next_multiple_of(ALIGN) - unpadded));
    dict.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes
}

fn element_count(shape: &[usize]) -> Option<usize> {
    shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d))
}

/// Reads the header only.
///
/// # Errors
/// Returns `BadInput` if the file is no `.npy` file or its header is damaged.
pub fn read_header(path: impl AsRef<Path>) -> Result<Header> {
    let path = path.as_ref();
    let mut file = open(path)?;
    header_from(&mut file, path)
}

fn open(path: &Path) -> Result<BufReader<File>> {
    Ok(BufReader::new(super::input::open(path, "a .npy file")?))
}

fn header_from(file: &mut impl Read, path: &Path) -> Result<Header> {
    let bad = |problem: &str| Error::from(BadInput::new(problem).file(path));
    let mut fixed = [0u8; 8];
    file.read_exact(&mut fixed).map_err(|_| bad("is too short for a .npy file"))?;
    if &fixed[..6] != MAGIC {
        return Err(bad("is not a .npy file (its first bytes are not \\x93NUMPY)"));
    }
    let length_bytes = match fixed[6] {
        1 => 2,
        2 | 3 => 4,
        v => {
            return Err(BadInput::new("the version of the .npy file is unknown")
                .file(path)
                .value(v)
                .allowed("1, 2, 3")
                .remedy("save it again with numpy.save")
                .into());
        }
    };
    let mut length = [0u8; 4];
    file.read_exact(&mut length[..length_bytes]).map_err(|_| bad("the header is truncated"))?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_HEADER_BYTES {
        return Err(BadInput::new("the header is too long for a plain array")
            .file(path)
            .value(format!("{length} bytes"))
            .allowed(format!("up to {MAX_HEADER_BYTES}"))
            .into());
    }
    let mut text = vec![0u8; length];
    file.read_exact(&mut text).map_err(|_| bad("the header is truncated"))?;
    let text = String::from_utf8(text).map_err(|_| bad("the header is not text"))?;
    let mut header =
        parse_header(&text).map_err(|problem| bad(&format!("the header is damaged: {problem}")))?;
    header.data_at = 8 + length_bytes + length;
    Ok(header)
}

/// The header is a Python dictionary with exactly three keys; this reads that much Python.
fn parse_header(text: &str) -> Result<Header, &'static str> {
    let mut rest = text.trim().strip_prefix('{').ok_or("no dictionary")?;
    let (mut descr, mut fortran_order, mut shape) = (None, None, None);
    loop {
        rest = rest.trim_start();
        if let Some(after) = rest.strip_prefix('}') {
            if !after.trim().is_empty() {
                return Err("text after the dictionary");
            }
            break;
        }
        let (key, after) = quoted(rest)?;
        let value = after.trim_start().strip_prefix(':').ok_or("no colon after a key")?.trim_start();
        rest = match key {
            "descr" => {
                let (d, after) =
                    quoted(value).map_err(|_| "a structured dtype; only plain arrays are supported")?;
                descr = Some(d.to_string());
                after
            }
            "fortran_order" => {
                let flag = [("True", true), ("False", false)]
                    .into_iter()
                    .find_map(|(word, flag)| value.strip_prefix(word).map(|after| (flag, after)));
                let (flag, after) = flag.ok_or("fortran_order is neither True nor False")?;
                fortran_order = Some(flag);
                after
            }
            "shape" => {
                let inner = value.strip_prefix('(').ok_or("shape is not a tuple")?;
                let (inner, after) = inner.split_once(')').ok_or("shape is not a tuple")?;
                let mut dims = Vec::new();
                for part in inner.split(',').map(str::trim).filter(|p| !p.is_empty()) {
                    // Python 2 wrote long integers with an L.
                    let n = part.strip_suffix('L').unwrap_or(part);
                    dims.push(
                        n.parse::<usize>().map_err(|_| "shape contains something that is not a count")?,
                    );
                }
                if dims.len() > MAX_RANK {
                    return Err("more than 64 dimensions");
                }
                shape = Some(dims);
                after
            }
            _ => return Err("an unknown key"),
        };
        rest = rest.trim_start();
        rest = match rest.strip_prefix(',') {
            Some(after) => after,
            None if rest.starts_with('}') => rest,
            None => return Err("no comma between its entries"),
        };
    }
    Ok(Header {
        descr: descr.ok_or("no descr")?,
        fortran_order: fortran_order.ok_or("no fortran_order")?,
        shape: shape.ok_or("no shape")?,
        data_at: 0,
    })
}

fn quoted(text: &str) -> Result<(&str, &str), &'static str> {
    let quote = text.chars().next().filter(|c| *c == '\'' || *c == '"').ok_or("a key without quotes")?;
    text[1..].split_once(quote).ok_or("a quote that does not end")
}

/// Reads an array whose dtype is exactly that of `T`.
///
/// # Errors
/// Returns `BadInput` for another dtype, a damaged or truncated file.
pub fn read<T: Element>(path: impl AsRef<Path>) -> Result<Array<T>> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let header = header_from(&mut file, path)?;
    if header.descr != T::DESCR {
        return Err(wrong_dtype(path, &header, T::NAME));
    }
    body(&mut file, path, header)
}

/// Reads complex64 or complex128 (rounded), or float32 or float64 as the real part.
///
/// # Errors
/// Returns an error for a file that is missing, cut short, not NPY, or of another type.
pub fn read_complex32(path: impl AsRef<Path>) -> Result<Array<Complex32>> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let header = header_from(&mut file, path)?;
    match header.descr.as_str() {
        "<c8" => body(&mut file, path, header),
        "<c16" => {
            Ok(map(body::<Complex64>(&mut file, path, header)?, |z| Complex32::new(z.re as f32, z.im as f32)))
        }
        "<f4" => Ok(map(body::<f32>(&mut file, path, header)?, |x| Complex32::new(x, 0.0))),
        "<f8" => Ok(map(body::<f64>(&mut file, path, header)?, |x| Complex32::new(x as f32, 0.0))),
        _ => Err(wrong_dtype(path, &header, "complex64, complex128, float32, float64")),
    }
}

/// Reads complex64 or complex128, or float32 or float64 as the real part.
///
/// # Errors
/// Returns an error for a file that is missing, cut short, not NPY, or of another type.
pub fn read_complex64(path: impl AsRef<Path>) -> Result<Array<Complex64>> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let header = header_from(&mut file, path)?;
    match header.descr.as_str() {
        "<c16" => body(&mut file, path, header),
        "<c8" => {
            Ok(map(body::<Complex32>(&mut file, path, header)?, |z| Complex64::new(z.re.into(), z.im.into())))
        }
        "<f4" => Ok(map(body::<f32>(&mut file, path, header)?, |x| Complex64::new(x.into(), 0.0))),
        "<f8" => Ok(map(body::<f64>(&mut file, path, header)?, |x| Complex64::new(x, 0.0))),
        _ => Err(wrong_dtype(path, &header, "complex64, complex128, float32, float64")),
    }
}

/// Reads float32 or float64 (rounded).
///
/// # Errors
/// Returns an error for a file that is missing, cut short, not NPY, or of another type.
pub fn read_f32(path: impl AsRef<Path>) -> Result<Array<f32>> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let header = header_from(&mut file, path)?;
    match header.descr.as_str() {
        "<f4" => body(&mut file, path, header),
        "<f8" => Ok(map(body::<f64>(&mut file, path, header)?, |x| x as f32)),
        _ => Err(wrong_dtype(path, &header, "float32, float64")),
    }
}

fn map<A, B>(a: Array<A>, f: impl Fn(A) -> B) -> Array<B> {
    Array { shape: a.shape, data: a.data.into_iter().map(f).collect() }
}

fn wrong_dtype(path: &Path, header: &Header, allowed: &str) -> Error {
    let first = allowed.split(',').next().unwrap_or(allowed);
    BadInput::new("wrong type of numbers")
        .file(path)
        .key("dtype")
        .value(header.dtype())
        .allowed(allowed)
        .remedy(format!("convert it with numpy's astype(\"{first}\")"))
        .into()
}

fn body<T: Element>(file: &mut BufReader<File>, path: &Path, header: Header) -> Result<Array<T>> {
    let size = std::mem::size_of::<T>();
    let shape = header.shape;
    let bad = |problem: String| {
        Error::from(BadInput::new(problem).file(path).key("shape").value(format!("{shape:?}")))
    };
    let total = file.get_ref().metadata().map_err(|e| Error::io(path, e))?.len();
    let there = total.saturating_sub(header.data_at as u64);
    // Compared with the file before anything is allocated, so a header cannot ask for the moon.
    let count = element_count(&shape);
    let wanted = count.and_then(|n| n.checked_mul(size)).map(|n| n as u64);
    match wanted {
        Some(n) if n == there => {}
        Some(n) if n < there => {
            return Err(bad(format!("the file has {} bytes more than the array", there - n)));
        }
        _ => {
            let n = wanted.map_or("far more".to_string(), |n| n.to_string());
            return Err(bad(format!("truncated: the array takes {n} bytes, the file holds {there}")));
        }
    }
    let mut data = vec![T::zeroed(); count.unwrap_or(0)];
    file.read_exact(bytemuck::cast_slice_mut(&mut data)).map_err(|e| Error::io(path, e))?;
    if header.fortran_order {
        data = c_order_from_fortran(&shape, &data);
    }
    Ok(Array { shape, data })
}

fn c_order_from_fortran<T: Copy>(shape: &[usize], data: &[T]) -> Vec<T> {
    // Strides of Fortran order, walked with an index that counts in C order.
    let mut strides = vec![1usize; shape.len()];
    for i in 1..shape.len() {
        strides[i] = strides[i - 1] * shape[i - 1];
    }
    let mut index = vec![0usize; shape.len()];
    let mut at = 0;
    let mut out = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        out.push(data[at]);
        for d in (0..shape.len()).rev() {
            index[d] += 1;
            at += strides[d];
            if index[d] < shape[d] {
                break;
            }
            at -= strides[d] * index[d];
            index[d] = 0;
        }
    }
    out
}

/// Refuses an array that holds a NaN or an infinity, saying at which index.
///
/// # Errors
/// Returns an error with the index of the first element that is not finite.
pub fn check_finite<T: Copy>(
    path: impl AsRef<Path>,
    array: &Array<T>,
    finite: impl Fn(T) -> bool,
) -> Result<()> {
    let Some(mut flat) = array.data.iter().position(|x| !finite(*x)) else {
        return Ok(());
    };
    let mut index = vec![0usize; array.shape.len()];
    for (i, n) in index.iter_mut().zip(&array.shape).rev() {
        *i = flat % n;
        flat /= n;
    }
    Err(BadInput::new("NaN or infinite value")
        .file(path)
        .key(format!("index {index:?}"))
        .allowed("finite numbers")
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn file_with(bytes: &[u8]) -> tempfile::NamedTempFile {
        let f = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(f.path(), bytes).unwrap();
        f
    }

    /// `numpy.save` of `np.array([[1+2j, 3+0j, 0-1j]], dtype=np.complex64)`, typed by hand from
    /// the format's description.
    fn known_bytes(order: &str, shape: &str) -> Vec<u8> {
        let mut dict = format!("{{'descr': '<c8', 'fortran_order': {order}, 'shape': {shape}, }}");
        while (10 + dict.len() + 1) % 64 != 0 {
            dict.push(' ');
        }
        dict.push('\n');
        let mut b = b"\x93NUMPY\x01\x00".to_vec();
        b.push((dict.len() % 256) as u8);
        b.push((dict.len() / 256) as u8);
        b.extend(dict.as_bytes());
        for x in [1f32, 2.0, 3.0, 0.0, 0.0, -1.0] {
            b.extend(x.to_le_bytes());
        }
        b
    }

    #[test]
    fn writes_the_bytes_that_numpy_writes() {
        let f = tempfile::NamedTempFile::new().unwrap();
        let data = [Complex32::new(1.0, 2.0), Complex32::new(3.0, 0.0), Complex32::new(0.0, -1.0)];
        write(f.path(), &[1, 3], &data).unwrap();
        let bytes = std::fs::read(f.path()).unwrap();
        assert_eq!(bytes, known_bytes("False", "(1, 3)"));
        assert_eq!(bytes.len(), 128 + 24);
        write(f.path(), &[3], &data).unwrap();
        assert_eq!(std::fs::read(f.path()).unwrap(), known_bytes("False", "(3,)"));
    }

    #[test]
    fn fortran_order_is_transposed() {
        let f = tempfile::NamedTempFile::new().unwrap();
        // a[i][j][k] = 100 i + 10 j + k with the first index running fastest.
        let mut b = b"\x93NUMPY\x02\x00".to_vec();
        let dict = "{'shape': (2, 3, 4), 'fortran_order': True, 'descr': '<i4'}";
        b.extend((dict.len() as u32).to_le_bytes());
        b.extend(dict.as_bytes());
        for k in 0..4i32 {
            for j in 0..3 {
                for i in 0..2 {
                    b.extend((100 * i + 10 * j + k).to_le_bytes());
                }
            }
        }
        std::fs::write(f.path(), b).unwrap();
        let a: Array<i32> = read(f.path()).unwrap();
        let expected: Vec<i32> = (0..24).map(|n| 100 * (n / 12) + 10 * (n / 4 % 3) + n % 4).collect();
        assert_eq!(a, Array { shape: vec![2, 3, 4], data: expected });
    }

    #[test]
    fn streaming_equals_whole_and_counts() {
        let (a, b) = (tempfile::NamedTempFile::new().unwrap(), tempfile::NamedTempFile::new().unwrap());
        let data: Vec<f64> = (0..35).map(|i| i as f64 * 0.1).collect();
        write(a.path(), &[5, 7], &data).unwrap();
        let mut w = Writer::create(b.path(), &[5, 7]).unwrap();
        for row in data.chunks(7) {
            w.push(row).unwrap();
        }
        w.finish().unwrap();
        assert_eq!(std::fs::read(a.path()).unwrap(), std::fs::read(b.path()).unwrap());
        let mut short = Writer::create(b.path(), &[5, 7]).unwrap();
        short.push(&data[..34]).unwrap();
        assert!(short.finish().is_err());
        let mut long = Writer::create(b.path(), &[5, 6]).unwrap();
        assert!(long.push(&data).is_err());
    }

    #[test]
    fn other_types_are_converted() {
        let f = tempfile::NamedTempFile::new().unwrap();
        write(f.path(), &[2], &[Complex64::new(0.5, -1.0), Complex64::new(2.0, 0.25)]).unwrap();
        let a = read_complex32(f.path()).unwrap();
        assert_eq!(a.data, vec![Complex32::new(0.5, -1.0), Complex32::new(2.0, 0.25)]);
        write(f.path(), &[2, 1], &[1.5f32, -2.0]).unwrap();
        let a = read_complex32(f.path()).unwrap();
        assert_eq!(
            a,
            Array { shape: vec![2, 1], data: vec![Complex32::new(1.5, 0.0), Complex32::new(-2.0, 0.0)] }
        );
        assert_eq!(read_complex64(f.path()).unwrap().data[1], Complex64::new(-2.0, 0.0));
        assert_eq!(read_f32(f.path()).unwrap().data, vec![1.5, -2.0]);
        assert_eq!(read_header(f.path()).unwrap().dtype(), "float32");
    }

    fn message(bytes: &[u8]) -> String {
        let f = file_with(bytes);
        let e = read::<Complex32>(f.path()).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{e}");
        let s = e.to_string();
        assert_eq!(s.lines().count(), 1);
        s
    }

    #[test]
    fn hostile_files_are_named() {
        let good = known_bytes("False", "(1, 3)");
        assert!(read::<Complex32>(file_with(&good).path()).is_ok());
        assert!(message(&[]).contains("too short"));
        assert!(message(b"\x89PNG\r\n\x1a\n\0\0\0\0").contains("not a .npy"));
        assert!(message(&good[..40]).contains("the header is truncated"));
        assert!(message(&good[..good.len() - 1]).contains("truncated"));
        assert!(message(&[&good[..], &[0]].concat()).contains("1 bytes more"));
        assert!(message(b"\x93NUMPY\x09\x00....").contains("version"));
        assert!(message(b"\x93NUMPY\x02\x00\xff\xff\xff\x7f").contains("too long"));
        // 2^62 elements: neither an overflow nor an allocation.
        let huge = known_bytes("False", "(1073741824, 4294967296)");
        assert!(message(&huge).contains("truncated"));
        let overflow = known_bytes("False", "(18446744073709551615, 18446744073709551615)");
        assert!(message(&overflow).contains("truncated"));
        assert!(message(&known_bytes("Maybe", "(1, 3)")).contains("fortran_order"));
        assert!(message(&known_bytes("False", "(1, -3)")).contains("shape"));
        let f = tempfile::NamedTempFile::new().unwrap();
        write(f.path(), &[1], &[1u8]).unwrap();
        let s = read::<Complex32>(f.path()).unwrap_err().to_string();
        assert!(s.contains("dtype = uint8") && s.contains("complex64"), "{s}");
        let missing = read::<f32>("/nonexistent.npy").unwrap_err();
        assert_eq!((missing.exit_code(), missing.to_string().contains("no such file")), (2, true));
        assert_eq!(read::<f32>("/").unwrap_err().exit_code(), 2);
    }

    #[test]
    fn nan_is_found_at_its_index() {
        let mut a = Array { shape: vec![2, 3], data: vec![0f32; 6] };
        assert!(check_finite("a.npy", &a, f32::is_finite).is_ok());
        a.data[5] = f32::NAN;
        let s = check_finite("a.npy", &a, f32::is_finite).unwrap_err().to_string();
        assert!(s.contains("index [1, 2]"), "{s}");
    }

    proptest! {
        #[test]
        fn round_trip(shape in proptest::collection::vec(0usize..5, 0..5), seed in any::<u32>()) {
            let n: usize = shape.iter().product();
            let data: Vec<f32> = (0..n).map(|i| ((i as u32).wrapping_mul(seed) as f32).sqrt()).collect();
            let f = tempfile::NamedTempFile::new().unwrap();
            write(f.path(), &shape, &data).unwrap();
            prop_assert_eq!(read::<f32>(f.path()).unwrap(), Array { shape, data });
        }

        #[test]
        fn damaged_bytes_never_panic(at in 0usize..152, byte in any::<u8>(), cut in 0usize..152) {
            let mut b = known_bytes("False", "(1, 3)");
            b[at] = byte;
            b.truncate(cut.max(8));
            let _ = read::<Complex32>(file_with(&b).path());
        }
    }
}
