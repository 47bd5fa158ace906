//! An open file of cubes: the arrangement of its numbers ([`CubeLayout`]), and the reading of their bytes.

use super::cube_layout::{CubeLayout, Real};
use super::ti_cfg::TiRadar;
use catseye::base::error::{BadInput, Error, Result};
use catseye::dsp::lost_chirps::LostChirps;
use catseye::dsp::sample_checks;
use num_complex::Complex;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Function that fills the slice with the bytes from the given offset into the numbers.
type Fetch = Box<dyn FnMut(u64, &mut [u8]) -> Result<()>>;

/// An open file of one or more cubes of equal shape. Samples are read on request and are finite. Memory is
/// that of the result plus a megabyte, or one place of the slowest axis.
pub struct Source {
    path: PathBuf,
    /// One array, or separate real and imaginary parts.
    arrays: Vec<(CubeLayout, Fetch)>,
    pub(super) ti_radar: Option<TiRadar>,
    /// Whether samples are read as their conjugates.
    pub(super) conjugate: bool,
    /// Whether parts of samples are unsigned 16-bit words of signed counts: 65535 is −1.
    pub(super) unsigned_words: bool,
}

/// What the samples of a frame say about its cube.
#[derive(Debug, Clone, Default)]
pub struct Checks {
    /// Samples that were lost.
    pub lost: LostChirps,
    /// Whether all are whole numbers, as the counts of a converter are.
    pub are_counts: bool,
    /// Whether some real parts, and whether some imaginary parts are not zero.
    pub parts: [bool; 2],
    /// What looks wrong, one line each.
    pub lines: Vec<String>,
}

impl Checks {
    /// Adds what was found in further channels of the same frame; lines are those of the first.
    pub fn append(&mut self, next: &Checks) {
        self.lost.append(&next.lost);
        self.are_counts &= next.are_counts;
        self.parts = [0, 1].map(|i| self.parts[i] || next.parts[i]);
    }
}

/// Takes real and imaginary parts as unsigned 16-bit words of two's complement.
fn signed_words<T: Real>(path: &Path, data: &mut [Complex<T>]) -> Result<()> {
    let signed = |x: T| -> Option<T> {
        let x = x.to_f64();
        let is_word = (0.0..=65535.0).contains(&x) && x.fract() == 0.0;
        is_word.then(|| T::from_f64(if x >= 32768.0 { x - 65536.0 } else { x }))
    };
    for (i, z) in data.iter_mut().enumerate() {
        let (Some(re), Some(im)) = (signed(z.re), signed(z.im)) else {
            return Err(BadInput::new(format!("sample {i} is not a pair of unsigned 16-bit words"))
                .file(path)
                .key("--words")
                .value(format!("{} and {}", z.re.to_f64(), z.im.to_f64()))
                .allowed("whole numbers in 0..=65535")
                .remedy("leave out --words for a cube of signed numbers")
                .into());
        };
        *z = Complex::new(re, im);
    }
    Ok(())
}

impl Source {
    pub(super) fn new(path: &Path, arrays: Vec<(CubeLayout, Fetch)>) -> Source {
        Source { path: path.to_path_buf(), arrays, ti_radar: None, conjugate: false, unsigned_words: false }
    }

    /// Makes a source of a plain file whose numbers begin at byte `data_at`.
    pub(super) fn plain(path: &Path, mut file: File, layout: CubeLayout, data_at: u64) -> Source {
        let own = path.to_path_buf();
        let fetch = move |at, to: &mut [u8]| {
            file.seek(SeekFrom::Start(data_at + at))
                .and_then(|_| file.read_exact(to))
                .map_err(|e| Error::io(&own, e))
        };
        Source::new(path, vec![(layout, Box::new(fetch))])
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.arrays[0].0.frames()
    }

    /// Shape `[chirp, rx_virtual, sample]` of one frame.
    pub fn shape(&self) -> [usize; 3] {
        self.arrays[0].0.shape()
    }

    /// Whether the file has imaginary parts; otherwise they read as 0.
    pub fn is_complex(&self) -> bool {
        self.arrays.iter().any(|(layout, _)| layout.is_complex())
    }

    /// The radar of the `.cfg` of a `.bin`.
    pub fn ti_radar(&self) -> Option<&TiRadar> {
        self.ti_radar.as_ref()
    }

    /// Whether samples are in √W: not those of a recording without a full scale, nor integers, which are
    /// counts.
    pub fn has_levels(&self) -> bool {
        !self.arrays.iter().any(|(layout, _)| layout.is_counts())
    }

    /// Reads channels of one frame, `[chirp, channel of the range, sample]`; memory beyond the result is
    /// small.
    ///
    /// # Errors
    /// Returns `BadInput` with the index for NaN, infinity or a number too large for `T`.
    pub fn channels<T: Real>(&mut self, frame: usize, channels: Range<usize>) -> Result<Vec<Complex<T>>> {
        let [chirps, _, samples] = self.shape();
        let mut out = vec![Complex::<T>::default(); chirps * channels.len() * samples];
        for (layout, fetch) in &mut self.arrays {
            layout.read(&self.path, frame, channels.clone(), &mut out, fetch)?;
        }
        if self.unsigned_words {
            signed_words(&self.path, &mut out)?;
        }
        if self.conjugate {
            out.iter_mut().for_each(|z| z.im = T::from_f64(-z.im.to_f64()));
        }
        Ok(out)
    }

    /// As [`Source::channels`], with lost chirps found and filled, and what the samples say about the cube; channels in the latter count from
    /// the range's first.
    ///
    /// # Errors
    /// Returns the errors of [`Source::channels`].
    pub fn repaired<T: Real + catseye::dsp::Real>(
        &mut self,
        frame: usize,
        channels: Range<usize>,
    ) -> Result<(Vec<Complex<T>>, Checks)> {
        let [chirps, _, samples] = self.shape();
        let shape = [chirps, channels.len(), samples];
        let mut data = self.channels::<T>(frame, channels)?;
        let lost = LostChirps::find(shape, &data);
        let checks = Checks {
            are_counts: sample_checks::are_counts(&data),
            parts: sample_checks::parts(&data),
            lines: sample_checks::lines(shape, &data),
            lost,
        };
        checks.lost.fill(&mut data);
        Ok((data, checks))
    }

    /// Reads all channels of one frame, `[chirp, rx_virtual, sample]`.
    ///
    /// # Errors
    /// Returns an error for a frame that does not exist, a truncated file, or a non-finite sample.
    pub fn frame<T: Real>(&mut self, frame: usize) -> Result<Vec<Complex<T>>> {
        let channels = self.shape()[1];
        self.channels(frame, 0..channels)
    }
}

/// Opens a file that must exist.
pub(super) fn open_file(path: &Path) -> Result<File> {
    catseye::formats::input::open(path, "a file of samples")
}
