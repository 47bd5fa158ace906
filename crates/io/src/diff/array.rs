//! Arrays: NumPy files, read side by side a piece at a time, and arrays in memory.

use super::differences::{Difference, DifferenceTally, Tolerances};
use crate::cube::{CubeOptions, open_cube};
use crate::store::Data;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::{input, npy};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Number of elements of each file that are held in memory.
const PIECE: usize = 1 << 16;

/// Real and imaginary part.
type Element = [f64; 2];

/// Sums over two arrays.
struct Sums {
    is_complex: bool,
    /// Whether the numbers are identifiers, which have to be equal.
    is_exact: bool,
    elements: u64,
    norm: [f64; 2],
    difference: f64,
    peak: f64,
    unequal: u64,
    broken: u64,
    /// Largest distance, with its index and the two elements.
    farthest: Option<(f64, u64, Element, Element)>,
    first_broken: Option<(u64, Element, Element)>,
}

impl Sums {
    fn new(is_complex: bool, is_exact: bool) -> Sums {
        Sums {
            is_complex,
            is_exact,
            elements: 0,
            norm: [0.0; 2],
            difference: 0.0,
            peak: 0.0,
            unequal: 0,
            broken: 0,
            farthest: None,
            first_broken: None,
        }
    }

    fn push(&mut self, a: Element, b: Element) {
        let index = self.elements;
        self.elements += 1;
        let same = |x: f64, y: f64| x == y || (x.is_nan() && y.is_nan());
        if a.iter().chain(&b).any(|x| !x.is_finite()) {
            if !(same(a[0], b[0]) && same(a[1], b[1])) {
                self.broken += 1;
                self.first_broken.get_or_insert((index, a, b));
            }
            return;
        }
        let (x, y) = (a[0].hypot(a[1]), b[0].hypot(b[1]));
        self.norm[0] += x * x;
        self.norm[1] += y * y;
        self.peak = self.peak.max(x).max(y);
        let d = (a[0] - b[0]).hypot(a[1] - b[1]);
        if d > 0.0 {
            self.difference += d * d;
            self.unequal += 1;
            if self.farthest.is_none_or(|f| d > f.0) {
                self.farthest = Some((d, index, a, b));
            }
        }
    }

    fn value(&self, z: Element) -> Value {
        match (self.is_complex, z.map(super::differences::number)) {
            (true, parts) => Value::Array(parts.to_vec()),
            (false, [re, _]) => re,
        }
    }

    /// Reports the differences. With `fortran_order` the first index runs fastest.
    fn end(
        self,
        file: &str,
        shape: &[usize],
        fortran_order: bool,
        t: &Tolerances,
        found: &mut DifferenceTally,
    ) {
        found.values += self.elements;
        let place = |flat: u64| {
            let (mut rest, mut index) = (flat, vec![0u64; shape.len()]);
            let mut axes: Vec<usize> = (0..shape.len()).collect();
            if !fortran_order {
                axes.reverse();
            }
            for axis in axes {
                let n = shape[axis] as u64;
                (index[axis], rest) = (rest % n, rest / n);
            }
            format!("index {index:?}")
        };
        if let Some((at, a, b)) = self.first_broken.filter(|_| t.relative.is_finite()) {
            let of = Difference::unequal(file, "not finite", place(at), self.value(a), self.value(b));
            found.note(Difference { places: self.broken, ..of });
        }
        let Some((d, at, a, b)) = self.farthest else { return };
        let at = Difference::unequal(file, "values", place(at), self.value(a), self.value(b));
        if self.is_exact {
            if t.relative.is_finite() {
                found.note(Difference { places: self.unequal, ..at.by(d, 0.0, "") });
            }
            return;
        }
        let norm = self.norm.map(f64::sqrt);
        let far = self.difference.sqrt() / norm[0].max(norm[1]);
        if far > t.relative {
            let of = Difference::unequal(file, "relative L2", "all", json!(norm[0]), json!(norm[1]));
            found.note(Difference { places: self.unequal, ..of.by(far, t.relative, "relative") });
        }
        if d / self.peak > t.relative {
            let of = Difference { what: "largest difference / peak".into(), ..at };
            found.note(of.by(d / self.peak, t.relative, "relative"));
        }
    }
}

/// Types of numbers that can be read, by their names in NumPy.
struct Type {
    bytes: usize,
    is_complex: bool,
    is_exact: bool,
    decode: fn(&[u8]) -> Element,
}

impl Type {
    fn of(path: &Path, descr: &str) -> Result<Type> {
        macro_rules! real {
            ($t:ty, $exact:literal) => {
                Type {
                    bytes: size_of::<$t>(),
                    is_complex: false,
                    is_exact: $exact,
                    decode: |b| [bytemuck::pod_read_unaligned::<$t>(b) as f64, 0.0],
                }
            };
        }
        macro_rules! complex {
            ($t:ty) => {
                Type {
                    bytes: size_of::<[$t; 2]>(),
                    is_complex: true,
                    is_exact: false,
                    decode: |b| bytemuck::pod_read_unaligned::<[$t; 2]>(b).map(|x| x as f64),
                }
            };
        }
        Ok(match descr {
            "<c8" => complex!(f32),
            "<c16" => complex!(f64),
            "<f4" => real!(f32, false),
            "<f8" => real!(f64, false),
            // Counts of a converter.
            "<i2" => real!(i16, false),
            "<u2" => real!(u16, false),
            "|i1" => real!(i8, true),
            "|u1" | "|b1" => real!(u8, true),
            "<i4" => real!(i32, true),
            "<u4" => real!(u32, true),
            "<i8" => real!(i64, true),
            "<u8" => real!(u64, true),
            other => {
                return Err(BadInput::new("wrong type of numbers")
                    .file(path)
                    .key("dtype")
                    .value(other)
                    .allowed("complex64, complex128, float32, float64, integers and bool, little-endian")
                    .into());
            }
        })
    }
}

struct Open<'a> {
    path: &'a Path,
    file: File,
    header: npy::Header,
    of: Type,
    bytes: Vec<u8>,
}

impl<'a> Open<'a> {
    fn new(path: &'a Path) -> Result<Open<'a>> {
        let header = npy::read_header(path)?;
        let of = Type::of(path, &header.descr)?;
        let mut file = input::open(path, "a .npy file")?;
        let there =
            file.metadata().map_err(|e| Error::io(path, e))?.len().saturating_sub(header.data_at as u64);
        let wanted = header.shape.iter().try_fold(of.bytes as u64, |n, d| n.checked_mul(*d as u64));
        if wanted != Some(there) {
            let wanted = wanted.map_or("far more".to_string(), |n| n.to_string());
            return Err(BadInput::new(format!("the array takes {wanted} bytes, the file holds {there}"))
                .file(path)
                .key("shape")
                .value(format!("{:?}", header.shape))
                .remedy("bring back the file that was written")
                .into());
        }
        file.seek(SeekFrom::Start(header.data_at as u64)).map_err(|e| Error::io(path, e))?;
        Ok(Open { path, file, header, of, bytes: Vec::new() })
    }

    fn next(&mut self, elements: usize) -> Result<impl Iterator<Item = Element>> {
        self.bytes.resize(elements * self.of.bytes, 0);
        self.file.read_exact(&mut self.bytes).map_err(|e| Error::io(self.path, e))?;
        Ok(self.bytes.chunks_exact(self.of.bytes).map(self.of.decode))
    }
}

/// Notes differing shapes or kinds of numbers; returns true where values can be compared.
fn fit(file: &str, shapes: [&[usize]; 2], kinds: [&str; 2], found: &mut DifferenceTally) -> bool {
    if shapes[0] != shapes[1] {
        found.note(Difference::unequal(file, "shape", "header", json!(shapes[0]), json!(shapes[1])));
    } else if kinds[0] != kinds[1] {
        found.note(Difference::unequal(file, "kind of numbers", "header", json!(kinds[0]), json!(kinds[1])));
    } else {
        return true;
    }
    false
}

fn kind(is_complex: bool, is_exact: bool) -> &'static str {
    match (is_complex, is_exact) {
        (true, _) => "complex",
        (false, true) => "integer",
        (false, false) => "real",
    }
}

/// Compares two NumPy files, of which only two pieces are in memory.
///
/// # Errors
/// Returns `BadInput` for a file that is damaged, truncated or of an unsupported type, and for files with
/// different orders of indices.
pub fn npy(file: &str, a: &Path, b: &Path, t: &Tolerances, found: &mut DifferenceTally) -> Result<()> {
    let (mut a, mut b) = (Open::new(a)?, Open::new(b)?);
    let kinds = [&a.of, &b.of].map(|t| kind(t.is_complex, t.is_exact));
    if !fit(file, [&a.header.shape, &b.header.shape], kinds, found) {
        return Ok(());
    }
    let shape = a.header.shape.clone();
    if a.header.fortran_order != b.header.fortran_order && shape.len() > 1 {
        return Err(BadInput::new("the order of the indices differs from that of the other file")
            .file(b.path)
            .key("fortran_order")
            .value(b.header.fortran_order)
            .remedy("save it with numpy.ascontiguousarray")
            .into());
    }
    let mut sums = Sums::new(a.of.is_complex, a.of.is_exact);
    let mut left: usize = shape.iter().product();
    while left > 0 {
        let n = left.min(PIECE);
        left -= n;
        for (x, y) in a.next(n)?.zip(b.next(n)?) {
            sums.push(x, y);
        }
    }
    sums.end(file, &shape, a.header.fortran_order, t, found);
    Ok(())
}

/// Compares two files of cubes, of which at least one is no NumPy file; only two frames are in memory.
///
/// # Errors
/// Returns the errors of [`open_cube`] and of reading a frame, such as non-finite samples.
pub fn cubes(file: &str, a: &Path, b: &Path, t: &Tolerances, found: &mut DifferenceTally) -> Result<()> {
    let options = CubeOptions::default();
    let (mut a, mut b) = (open_cube(a, &options, None)?, open_cube(b, &options, None)?);
    let shape = |frames: usize, [chirps, channels, samples]: [usize; 3]| [frames, chirps, channels, samples];
    let shapes = [shape(a.frames(), a.shape()), shape(b.frames(), b.shape())];
    let kinds = [a.is_complex(), b.is_complex()].map(|c| kind(c, false));
    if !fit(file, [&shapes[0], &shapes[1]], kinds, found) {
        return Ok(());
    }
    let mut sums = Sums::new(a.is_complex(), false);
    for frame in 0..a.frames() {
        for (x, y) in a.frame::<f64>(frame)?.iter().zip(b.frame::<f64>(frame)?) {
            sums.push([x.re, x.im], [y.re, y.im]);
        }
    }
    sums.end(file, &shapes[0], false, t, found);
    Ok(())
}

/// Compares two arrays of a dataset's frame.
pub fn stored(file: &str, shape: &[usize], a: &Data, b: &Data, t: &Tolerances, found: &mut DifferenceTally) {
    let is_exact = matches!(a, Data::U8(_) | Data::I32(_));
    let mut sums = Sums::new(matches!(a, Data::C32(_)), is_exact);
    match (a, b) {
        (Data::C32(a), Data::C32(b)) => {
            a.iter()
                .zip(b)
                .for_each(|(x, y)| sums.push([x.re.into(), x.im.into()], [y.re.into(), y.im.into()]));
        }
        (Data::F32(a), Data::F32(b)) => {
            a.iter().zip(b).for_each(|(x, y)| sums.push([(*x).into(), 0.0], [(*y).into(), 0.0]));
        }
        (Data::U8(a), Data::U8(b)) => {
            a.iter().zip(b).for_each(|(x, y)| sums.push([(*x).into(), 0.0], [(*y).into(), 0.0]));
        }
        (Data::I32(a), Data::I32(b)) => {
            a.iter().zip(b).for_each(|(x, y)| sums.push([(*x).into(), 0.0], [(*y).into(), 0.0]));
        }
        _ => {
            let kinds = [a, b].map(|d| json!(d.kind().name()));
            let [a, b] = kinds;
            found.note(Difference::unequal(file, "kind of numbers", "layout", a, b));
            return;
        }
    }
    sums.end(file, shape, false, t, found);
}
