//! Cubes of samples as other programs store them: numbers of any type with any order of axes, read block by
//! block into `[chirp, channel, sample]`. The kind of file (NumPy, HDF5, a recording of a TI device) only
//! determines the [`CubeLayout`].

use catseye::base::error::{BadInput, Error, Result, nearest};
use num_complex::Complex;
use std::ops::Range;
use std::path::Path;

/// Largest number of places along one axis.
const MAX_EXTENT: usize = 1 << 20;
/// Number of values that are looked up together; at least a whole innermost axis.
const BLOCK: usize = 4096;
/// Number of bytes that are fetched at once.
const RUN_BYTES: usize = 1 << 20;

/// Meaning of an axis of the file. A channel is `tx · n_rx + rx`; without a `Tx` axis `Rx` counts virtual
/// channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Frames.
    Frame,
    /// Chirps of a frame.
    Chirp,
    /// Transmitters.
    Tx,
    /// Receivers.
    Rx,
    /// Samples of a chirp.
    Sample,
    /// Real part, then imaginary part.
    Iq,
}

const NAMES: [(&str, Axis); 7] = [
    ("frame", Axis::Frame),
    ("chirp", Axis::Chirp),
    ("tx", Axis::Tx),
    ("rx", Axis::Rx),
    ("rx_virtual", Axis::Rx),
    ("sample", Axis::Sample),
    ("iq", Axis::Iq),
];

/// Parses axes from a list such as `chirp,rx,sample`, slowest first (as NumPy and HDF5 print shapes).
///
/// # Errors
/// Returns an error for an unknown name (with the nearest), a name that occurs twice, or a missing `chirp`,
/// `rx` or `sample`.
pub fn axes_from(list: &str) -> Result<Vec<Axis>> {
    let bad =
        |problem: String| BadInput::new(problem).key("axes").value(list.chars().take(60).collect::<String>());
    let mut axes = Vec::new();
    for word in list.split(',').map(str::trim) {
        let Some((_, axis)) = NAMES.iter().find(|(n, _)| *n == word) else {
            let known = || NAMES.iter().map(|(n, _)| *n);
            let b = bad(format!("'{}' is not an axis", word.chars().take(20).collect::<String>()))
                .allowed(known().collect::<Vec<_>>().join(", "));
            return Err(match nearest(word, known()) {
                Some(n) => b.remedy(format!("did you mean '{n}'?")).into(),
                None => b.into(),
            });
        };
        if axes.contains(axis) {
            return Err(bad(format!("'{word}' is listed twice")).into());
        }
        axes.push(*axis);
    }
    for (name, axis) in [("chirp", Axis::Chirp), ("rx", Axis::Rx), ("sample", Axis::Sample)] {
        if !axes.contains(&axis) {
            return Err(bad(format!("'{name}' is missing")).allowed("each of chirp, rx, sample once").into());
        }
    }
    Ok(axes)
}

/// Type in which a number is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 32-bit floating point.
    F32,
    /// 64-bit floating point.
    F64,
    /// 8-bit integer.
    I8,
    /// 8-bit unsigned integer.
    U8,
    /// 16-bit word of which the lowest `bits` bits count, with their sign.
    I16 {
        /// Number of bits that count.
        bits: u32,
    },
    /// 16-bit unsigned integer.
    U16,
    /// 32-bit integer.
    I32,
}

impl Number {
    /// Size of one number, bytes.
    pub fn bytes(self) -> usize {
        match self {
            Number::F64 => 8,
            Number::F32 | Number::I32 => 4,
            Number::I16 { .. } | Number::U16 => 2,
            Number::I8 | Number::U8 => 1,
        }
    }
}

/// Largest magnitude of a sample, √W: powers of larger ones would overflow.
const LARGEST: f64 = 1e12;

/// A floating-point type of samples: f32 or f64.
pub trait Real: Copy + Default + Send + Sync + 'static {
    /// The nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// The value as f64.
    fn to_f64(self) -> f64;
}
impl Real for f32 {
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}
impl Real for f64 {
    fn from_f64(x: f64) -> f64 {
        x
    }
    fn to_f64(self) -> f64 {
        self
    }
}

/// One axis of the file. Several may have the same meaning: pairs of samples, then samples in a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Dim {
    /// Meaning of the axis.
    pub axis: Axis,
    /// Number of places along it.
    pub size: usize,
    /// Number of steps in the meaning for one step along this axis.
    pub factor: usize,
    /// Index that each place stands for, where it is not the place's own; `None` for a place that is not
    /// used.
    pub map: Option<Vec<Option<usize>>>,
}

impl Dim {
    /// Makes an axis whose places are indices.
    pub fn new(axis: Axis, size: usize) -> Dim {
        Dim { axis, size, factor: 1, map: None }
    }

    fn coordinate(&self, index: usize) -> Option<usize> {
        match &self.map {
            None => Some(index * self.factor),
            Some(m) => m.get(index).copied().flatten().map(|i| i * self.factor),
        }
    }

    fn largest(&self) -> usize {
        (0..self.size).filter_map(|i| self.coordinate(i)).max().unwrap_or(0)
    }
}

/// Arrangement of a file's numbers, counted from the first, in cubes.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeLayout {
    /// Axes, slowest first.
    dims: Vec<Dim>,
    number: Number,
    big_endian: bool,
    scale: Option<f64>,
    /// Without an `Iq` axis: 0 where the numbers are real parts, 1 where they are imaginary parts.
    part: usize,
    /// Number of frames, chirps, transmitters, receivers and samples.
    extent: [usize; 5],
}

#[derive(Clone, Copy, Default)]
struct CellIndex {
    frame: usize,
    chirp: usize,
    channel: usize,
    sample: usize,
    part: usize,
    unused: bool,
}

/// Destination of a number of the innermost axes, relative to that of their first.
struct Entry {
    /// Twice the sample's index, plus one for its imaginary part.
    slot: usize,
    channel: u32,
    frame: u32,
}

const UNUSED: u32 = u32::MAX;

/// The error for the first non-finite sample of `out`.
fn not_finite<T: Real>(file: &Path, out: &[Complex<T>], channels: &Range<usize>, samples: usize) -> Error {
    let is_sound = |z: &Complex<T>| z.re.to_f64().abs() <= LARGEST && z.im.to_f64().abs() <= LARGEST;
    let at = out.iter().position(|z| !is_sound(z)).unwrap_or(0);
    let (row, sample) = (at / samples, at % samples);
    let (chirp, channel) = (row / channels.len(), channels.start + row % channels.len());
    BadInput::new("NaN, infinite or too large a value")
        .file(file)
        .key(format!("index [chirp {chirp}, rx_virtual {channel}, sample {sample}]"))
        .allowed(format!("finite numbers up to {LARGEST:e}"))
        .into()
}

impl CubeLayout {
    /// Makes the layout of a file with these axes and numbers.
    ///
    /// # Errors
    /// Returns a text, for a file's own message, for an axis of no or too many places, or more numbers than
    /// can be counted.
    pub fn new(dims: Vec<Dim>, number: Number, big_endian: bool) -> Result<CubeLayout, String> {
        let mut extent = [0usize; 5];
        for d in &dims {
            if d.size == 0 || d.size > MAX_EXTENT {
                return Err(format!("one axis has {} elements; a cube has 1 to {MAX_EXTENT}", d.size));
            }
            if d.axis == Axis::Iq && d.largest() > 1 {
                return Err("an axis of real and imaginary parts has two elements".into());
            }
            if d.axis != Axis::Iq {
                extent[d.axis as usize] += d.largest();
            }
        }
        let extent = extent.map(|e| e + 1);
        let all = dims.iter().try_fold(number.bytes(), |n, d| n.checked_mul(d.size));
        if all.is_none() || extent.iter().any(|e| *e > MAX_EXTENT) || extent[2] * extent[3] > MAX_EXTENT {
            return Err("the array has too many elements".into());
        }
        Ok(CubeLayout { dims, number, big_endian, scale: None, part: 0, extent })
    }

    /// Sets a factor by which the file's numbers are multiplied.
    pub fn scaled(mut self, scale: f64) -> CubeLayout {
        self.scale = Some(scale);
        self
    }

    /// Declares the numbers to be imaginary parts.
    pub fn imaginary(mut self) -> CubeLayout {
        self.part = 1;
        self
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.extent[0]
    }

    /// Shape `[chirp, channel, sample]` of one frame.
    pub fn shape(&self) -> [usize; 3] {
        let [_, chirps, tx, rx, samples] = self.extent;
        [chirps, tx * rx, samples]
    }

    /// Size of the file's numbers, bytes.
    pub fn bytes(&self) -> u64 {
        self.dims.iter().map(|d| d.size as u64).product::<u64>() * self.number.bytes() as u64
    }

    /// Size of one place along the slowest axis, bytes.
    pub fn slowest_bytes(&self) -> u64 {
        self.bytes() / self.dims.first().map_or(1, |d| d.size as u64)
    }

    /// Whether there is an imaginary part.
    pub fn is_complex(&self) -> bool {
        self.part == 1 || self.dims.iter().any(|d| d.axis == Axis::Iq)
    }

    /// Whether the numbers are integers of a converter without a stated scale.
    pub fn is_counts(&self) -> bool {
        !matches!(self.number, Number::F32 | Number::F64) && self.scale.is_none()
    }

    fn step(&self, place: &mut CellIndex, dim: &Dim, index: usize) {
        let Some(c) = dim.coordinate(index) else {
            place.unused = true;
            return;
        };
        match dim.axis {
            Axis::Frame => place.frame += c,
            Axis::Chirp => place.chirp += c,
            Axis::Tx => place.channel += c * self.extent[3],
            Axis::Rx => place.channel += c,
            Axis::Sample => place.sample += c,
            Axis::Iq => place.part += c,
        }
    }

    /// Place of number `flat` among the numbers of `dims`.
    fn place(&self, dims: &[Dim], mut flat: usize) -> CellIndex {
        let mut place = CellIndex::default();
        for d in dims.iter().rev() {
            self.step(&mut place, d, flat % d.size);
            flat /= d.size;
        }
        place
    }

    /// Fills `out`, `[chirp, channel of the range, sample]`, with one frame. `fetch` reads bytes from the
    /// given offset into the numbers. Where the layout has no imaginary part, that of `out` is unchanged.
    ///
    /// # Errors
    /// Returns the errors of `fetch`, and `BadInput` with the index for NaN, infinity, or a number too large
    /// for `T`.
    pub fn read<T: Real>(
        &self,
        file: &Path,
        frame: usize,
        channels: Range<usize>,
        out: &mut [Complex<T>],
        fetch: &mut dyn FnMut(u64, &mut [u8]) -> Result<()>,
    ) -> Result<()> {
        let [chirps, all, samples] = self.shape();
        let count = channels.len();
        if frame >= self.frames() || channels.end > all || out.len() != chirps * count * samples {
            return Err(Error::Failed(format!(
                "{}: frame {frame}, channels {channels:?} of {all} into {} samples",
                file.display(),
                out.len()
            )));
        }
        // The innermost axes as a table.
        let mut split = self.dims.len();
        let mut block = 1;
        while split > 0 && (split == self.dims.len() || block * self.dims[split - 1].size <= BLOCK) {
            split -= 1;
            block *= self.dims[split].size;
        }
        let (outer, inner) = self.dims.split_at(split);
        let chirp_step = count * samples;
        let table: Vec<Entry> = (0..block)
            .map(|i| {
                let p = self.place(inner, i);
                Entry {
                    slot: 2 * (p.chirp * chirp_step + p.sample) + p.part,
                    channel: if p.unused { UNUSED } else { p.channel as u32 },
                    frame: p.frame as u32,
                }
            })
            .collect();
        let channel_inside = inner.iter().any(|d| matches!(d.axis, Axis::Tx | Axis::Rx));
        let all_used = table.iter().all(|e| e.channel != UNUSED);
        let frame_inside = inner.iter().any(|d| d.axis == Axis::Frame);
        let wanted = |p: &CellIndex| {
            !p.unused
                && (frame_inside || p.frame == frame)
                && (channel_inside || channels.contains(&p.channel))
        };

        let scale = self.scale.unwrap_or(1.0);
        let size = self.number.bytes();
        let blocks: usize = outer.iter().map(|d| d.size).product();
        let run_blocks = (RUN_BYTES / (block * size)).max(1);
        let (mut bytes, mut numbers) = (Vec::new(), vec![0f64; block]);
        let mut at = 0;
        while at < blocks {
            if !wanted(&self.place(outer, at)) {
                at += 1;
                continue;
            }
            let mut end = at + 1;
            while end < blocks && end - at < run_blocks && wanted(&self.place(outer, end)) {
                end += 1;
            }
            bytes.resize((end - at) * block * size, 0);
            fetch((at * block * size) as u64, &mut bytes)?;
            for (b, chunk) in (at..end).zip(bytes.chunks_exact(block * size)) {
                self.decode(chunk, &mut numbers);
                let base = self.place(outer, b);
                let first = 2 * (base.chirp * chirp_step + base.sample) + base.part + self.part;
                let mut all_finite = true;
                let mut put = |x: f64, slot: usize| {
                    let x = x * scale;
                    let value = T::from_f64(x);
                    all_finite &= x.abs() <= LARGEST;
                    let to = &mut out[slot >> 1];
                    if slot & 1 == 0 { to.re = value } else { to.im = value }
                };
                if !channel_inside && !frame_inside && all_used {
                    let first = first + 2 * (base.channel - channels.start) * samples;
                    for (x, e) in numbers.iter().zip(&table) {
                        put(*x, first + e.slot);
                    }
                } else {
                    for (x, e) in numbers.iter().zip(&table) {
                        let channel = base.channel + e.channel as usize;
                        let here = e.channel != UNUSED
                            && base.frame + e.frame as usize == frame
                            && channels.contains(&channel);
                        if here {
                            put(*x, first + 2 * (channel - channels.start) * samples + e.slot);
                        }
                    }
                }
                if !all_finite {
                    return Err(not_finite(file, out, &channels, samples));
                }
            }
            at = end;
        }
        Ok(())
    }

    fn decode(&self, bytes: &[u8], out: &mut [f64]) {
        macro_rules! numbers {
            ($t:ty, $n:literal, $f:expr) => {{
                let f = $f;
                for (x, b) in out.iter_mut().zip(bytes.chunks_exact($n)) {
                    let mut a = [0u8; $n];
                    a.copy_from_slice(b);
                    *x = f(if self.big_endian { <$t>::from_be_bytes(a) } else { <$t>::from_le_bytes(a) });
                }
            }};
        }
        match self.number {
            Number::F32 => numbers!(f32, 4, f64::from),
            Number::F64 => numbers!(f64, 8, |x| x),
            Number::I8 => numbers!(i8, 1, f64::from),
            Number::U8 => numbers!(u8, 1, f64::from),
            Number::U16 => numbers!(u16, 2, f64::from),
            Number::I32 => numbers!(i32, 4, f64::from),
            Number::I16 { bits } => {
                let up = 16u32.saturating_sub(bits);
                numbers!(i16, 2, |x: i16| f64::from((x << up) >> up));
            }
        }
    }
}

/// Layout of an array of rank `shape.len()`. Without `axes` it is `[chirp, rx, sample]`, with `frame` in
/// front and an axis of two parts at the end where the rank requires so. `parts` states that the numbers are
/// already stored as pairs.
///
/// # Errors
/// Returns a text for axes that do not fit the rank, or an `iq` axis whose length is not two.
pub fn array_layout(
    shape: &[usize],
    axes: Option<&[Axis]>,
    fortran_order: bool,
    number: Number,
    big_endian: bool,
    parts: Option<[usize; 2]>,
) -> Result<CubeLayout, String> {
    let rank = shape.len();
    let pairs = parts.is_none() && shape.last() == Some(&2);
    let mut named: Vec<Axis> = match axes {
        Some(a) => a.to_vec(),
        None => {
            let mut a = vec![Axis::Chirp, Axis::Rx, Axis::Sample];
            if rank - usize::from(pairs && rank > 3) == 4 {
                a.insert(0, Axis::Frame);
            }
            a
        }
    };
    if pairs && rank == named.len() + 1 && !named.contains(&Axis::Iq) {
        named.push(Axis::Iq);
    }
    let list = |a: &[Axis]| {
        let name = |x: &Axis| NAMES.iter().find(|(_, y)| x == y).map_or("", |(n, _)| n);
        a.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    if named.len() != rank {
        return Err(format!("the array has {rank} axes, not {}: {}", named.len(), list(&named)));
    }
    let mut dims: Vec<Dim> = named.iter().zip(shape).map(|(a, n)| Dim::new(*a, *n)).collect();
    if dims.iter().any(|d| d.axis == Axis::Iq && (d.size != 2 || parts.is_some())) {
        return Err("an iq axis has two elements, and the numbers are real".into());
    }
    if fortran_order {
        dims.reverse();
    }
    if let Some([re, im]) = parts {
        let mut map = vec![None; 2];
        map[re.min(1)] = Some(0);
        map[im.min(1)] = Some(1);
        dims.push(Dim { axis: Axis::Iq, size: 2, factor: 1, map: Some(map) });
    }
    CubeLayout::new(dims, number, big_endian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The layout's bytes with a number that tells its own place, by brute force.
    fn told(frame: usize, chirp: usize, channel: usize, sample: usize, part: usize) -> f64 {
        (part * 100_000 + frame * 10_000 + chirp * 1000 + channel * 100 + sample) as f64
    }

    fn read_all(
        layout: &CubeLayout,
        bytes: &[u8],
        frame: usize,
        channels: Range<usize>,
    ) -> Result<Vec<Complex<f64>>> {
        let [chirps, _, samples] = layout.shape();
        let mut out = vec![Complex::default(); chirps * channels.len() * samples];
        layout.read(Path::new("x"), frame, channels, &mut out, &mut |at, to| {
            to.copy_from_slice(&bytes[at as usize..at as usize + to.len()]);
            Ok(())
        })?;
        Ok(out)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        /// Any order of the axes, either byte order, any range of channels.
        #[test]
        fn every_order_reads_the_same(
            order in Just([Axis::Frame, Axis::Chirp, Axis::Tx, Axis::Rx, Axis::Sample, Axis::Iq]).prop_shuffle(),
            sizes in [1usize..4, 1..5, 1..3, 1..4, 1..70, 2..3], fortran in any::<bool>(), big in any::<bool>(),
            from in 0usize..4, long in 1usize..5,
        ) {
            let size = |a: Axis| sizes[a as usize];
            let shape: Vec<usize> = order.iter().map(|a| size(*a)).collect();
            let layout = array_layout(&shape, Some(&order), fortran, Number::F64, big, None).unwrap();
            let [chirps, channels, samples] = layout.shape();
            prop_assert_eq!([chirps, channels, samples], [sizes[1], sizes[2] * sizes[3], sizes[4]]);
            let total: usize = shape.iter().product();
            let mut bytes = Vec::new();
            for flat in 0..total {
                // Coordinates of this place of the file.
                let mut c = [0usize; 6];
                let mut rest = flat;
                let fastest_first: Vec<usize> = if fortran { (0..6).collect() } else { (0..6).rev().collect() };
                for d in fastest_first {
                    c[order[d] as usize] = rest % shape[d];
                    rest /= shape[d];
                }
                let x = told(c[0], c[1], c[2] * sizes[3] + c[3], c[4], c[5]);
                bytes.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() });
            }
            let range = from.min(channels - 1)..(from.min(channels - 1) + long).min(channels);
            for frame in 0..layout.frames() {
                let out = read_all(&layout, &bytes, frame, range.clone()).unwrap();
                let mut i = 0;
                for chirp in 0..chirps {
                    for channel in range.clone() {
                        for sample in 0..samples {
                            let z = Complex::new(
                                told(frame, chirp, channel, sample, 0), told(frame, chirp, channel, sample, 1));
                            prop_assert_eq!(out[i], z);
                            i += 1;
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn blocks_longer_than_the_table_and_runs_longer_than_a_fetch() {
        // 300 chirps x 3 channels x 5000 samples of bytes: several fetches, several tables.
        let layout = array_layout(&[300, 3, 5000], None, false, Number::U8, false, None).unwrap();
        let value = |i: usize| (i * 7 % 251) as u8;
        let bytes: Vec<u8> = (0..300 * 3 * 5000).map(value).collect();
        let out = read_all(&layout, &bytes, 0, 1..3).unwrap();
        for (i, z) in out.iter().enumerate() {
            let (chirp, channel, sample) = (i / 10_000, 1 + i / 5000 % 2, i % 5000);
            assert_eq!(z.re, f64::from(value((chirp * 3 + channel) * 5000 + sample)));
            assert_eq!(z.im, 0.0);
        }
        assert!(!layout.is_complex());
    }

    #[test]
    fn unused_places_signs_and_scale() {
        // Four lanes of which the first and third hold receivers; 12 bits with dirt above.
        let map = Some(vec![Some(0), None, Some(1), None]);
        let dims = vec![Dim::new(Axis::Sample, 2), Dim { axis: Axis::Rx, size: 4, factor: 1, map }];
        let layout = CubeLayout::new(dims, Number::I16 { bits: 12 }, false).unwrap().scaled(0.5);
        assert_eq!(layout.shape(), [1, 2, 2]);
        let words: [u16; 8] = [0x0fff, 9, 0x1001, 9, 0x0800, 9, 0x07ff, 9];
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let out = read_all(&layout, &bytes, 0, 0..2).unwrap();
        let re: Vec<f64> = out.iter().map(|z| z.re).collect();
        assert_eq!(re, [-0.5, -1024.0, 0.5, 1023.5]);
        assert!(read_all(&layout.imaginary(), &bytes, 0, 1..2).unwrap()[0] == Complex::new(0.0, 0.5));
    }

    #[test]
    fn not_finite_is_named() {
        let layout = array_layout(&[2, 3, 4], None, false, Number::F64, false, None).unwrap();
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let mut x = [1f64; 24];
            x[17] = bad;
            let bytes: Vec<u8> = x.iter().flat_map(|x| x.to_le_bytes()).collect();
            let mut out = vec![Complex::<f32>::default(); 24];
            let e = layout
                .read(Path::new("a.npy"), 0, 0..3, &mut out, &mut |at, to| {
                    to.copy_from_slice(&bytes[at as usize..at as usize + to.len()]);
                    Ok(())
                })
                .unwrap_err();
            assert!(e.to_string().contains("a.npy: index [chirp 1, rx_virtual 1, sample 1]"), "{e}");
            assert_eq!(e.exit_code(), 2);
        }
    }

    #[test]
    fn axes_are_checked() {
        assert_eq!(axes_from("sample, rx_virtual,chirp").unwrap(), [Axis::Sample, Axis::Rx, Axis::Chirp]);
        for (list, expect) in [
            ("chirp,rx", "'sample' is missing"),
            ("chirp,chirp,rx,sample", "'chirp' is listed twice"),
            ("chirp,rx,rx_virtual,sample", "'rx_virtual' is listed twice"),
            ("chrip,rx,sample", "did you mean 'chirp'?"),
            ("", "'' is not an axis"),
        ] {
            let e = axes_from(list).unwrap_err().to_string();
            assert!(e.contains(expect), "{e}");
        }
        let layout = |shape: &[usize], parts| array_layout(shape, None, false, Number::F32, false, parts);
        assert_eq!(layout(&[5, 2, 3, 4], None).unwrap().frames(), 5);
        assert!(layout(&[5, 3, 4, 2], None).unwrap().is_complex());
        assert_eq!(layout(&[5, 3, 4, 2], Some([0, 1])).unwrap().shape(), [3, 4, 2]);
        assert_eq!(layout(&[9, 5, 3, 4, 2], None).unwrap().shape(), [5, 3, 4]);
        assert!(layout(&[5, 3], None).unwrap_err().contains("2 axes"));
        assert!(layout(&[5, 3, 0], None).unwrap_err().contains("one axis has 0 elements"));
        assert!(layout(&[1 << 21, 1, 1], None).unwrap_err().contains("one axis has"));
        assert!(
            layout(&[1 << 20, 1 << 20, 1 << 20, 1 << 20], None)
                .unwrap_err()
                .contains("the array has too many elements")
        );
    }
}
