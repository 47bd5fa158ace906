//! Raw samples as TI's DCA1000 capture card writes them: 16-bit words, little endian, frame after frame
//! without headers (TI SWRA581, "Mmwave Radar Device ADC Raw Data Capture", sections 5 and 6).
//!
//! * xWR12xx, xWR14xx (`ChanInterleave` 0): four lanes, one for each receiver. A sample is the words
//!   `I₀ I₁ I₂ I₃ Q₀ Q₁ Q₂ Q₃`; lanes of receivers that are off stay in the file.
//! * xWR16xx, xWR18xx, xWR68xx: of each chirp all samples of the first receiver, then of the next; words
//!   `I I Q Q` of two samples each.
//! * Real samples have no Q words. With `IqOrder::Qi` the words of Q come first.
//!
//! The value of a word in √W is not in the file. `full_scale_dbm` gives it: a sample of modulus 2^(bits−1) is
//! √P of that power. Files of catseye have it in a sidecar, `NAME.bin.json`. Without either, samples are
//! counts.

use super::cube_layout::{Axis, CubeLayout, Dim, Number};
use super::source::{Source, open_file};
use super::ti_cfg::{Antennas, IqOrder, TiRadar};
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::base::units::w_from_dbm;
use catseye::formats::stage::StagedFile;
use num_complex::Complex;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Number of lanes of xWR14xx, whether their receivers are on or not.
const LANES: usize = 4;
/// Largest size of a sidecar, which holds six short lines, bytes.
const MAX_SIDECAR_BYTES: u64 = 1 << 16;

/// Properties that the `.cfg` does not state; `None` takes them from the sidecar, or else from the `.cfg`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BinOptions {
    /// Whether there is one lane for each of four receivers, as in xWR14xx.
    pub four_lanes: Option<bool>,
    /// Which of I and Q comes first.
    pub iq_order: Option<IqOrder>,
    /// Power of a sample of modulus 2^(bits−1), dBm.
    pub full_scale_dbm: Option<f64>,
}

/// Content of `NAME.bin.json`, written beside a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// Name and version of the program that wrote it.
    pub written_by: String,
    /// Power of a full-scale tone, dBm.
    pub full_scale_dbm: f64,
    /// Amplitude of one count, √W: √P / 2^(bits−1).
    pub sqrt_watt_per_count: f64,
    /// Whether the card captured four lanes.
    pub four_lanes: bool,
    /// Which of I and Q comes first.
    pub iq_order: IqOrder,
    /// Number of frames.
    pub frames: usize,
    /// Number of words that were clipped to the largest or smallest count.
    pub clipped_words: u64,
    /// Where the antennas are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub antennas: Option<Antennas>,
}

/// Path of the sidecar of a recording.
pub fn sidecar_path(bin: &Path) -> PathBuf {
    let mut name = bin.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

fn sidecar_of(bin: &Path) -> Result<Option<Sidecar>> {
    let path = sidecar_path(bin);
    if matches!(std::fs::metadata(&path), Err(e) if e.kind() == std::io::ErrorKind::NotFound) {
        return Ok(None);
    }
    let text = catseye::formats::input::read(&path, "a sidecar", MAX_SIDECAR_BYTES)?;
    let s: Sidecar = serde_json::from_slice(&text).map_err(|e| {
        BadInput::new(format!("is not the sidecar file of a recording: {}", json_in_words(&e)))
            .file(&path)
            .remedy("remove it, and give full scale and order on the command line")
    })?;
    Ok(Some(s))
}

/// Amplitude of one count, √W.
fn scale(full_scale_dbm: f64, bits: u32) -> Result<f64> {
    if !(-300.0..=300.0).contains(&full_scale_dbm) {
        return Err(BadInput::new("is out of range")
            .key("full_scale_dbm")
            .value(full_scale_dbm)
            .allowed("-300..=300")
            .remedy("give the power of a sample at full scale in dBm, as in -10")
            .into());
    }
    Ok(w_from_dbm(full_scale_dbm).sqrt() / f64::from(1u32 << (bits - 1)))
}

/// Layout of the words of `frames` frames. A frame has `loops × chirps × receivers × samples`.
fn layout(radar: &TiRadar, frames: usize, four_lanes: bool, iq: IqOrder) -> Result<CubeLayout, String> {
    let map = Some(match iq {
        IqOrder::Iq => vec![Some(0), Some(1)],
        IqOrder::Qi => vec![Some(1), Some(0)],
    });
    let parts = Dim { axis: Axis::Iq, size: 2, factor: 1, map };
    let mut dims = vec![
        Dim::new(Axis::Frame, frames),
        Dim::new(Axis::Chirp, radar.loops),
        Dim::new(Axis::Tx, radar.slots()),
    ];
    if four_lanes {
        let lane = |l: usize| radar.rx.iter().position(|r| *r as usize == l);
        let map = Some((0..LANES).map(lane).collect());
        dims.push(Dim::new(Axis::Sample, radar.samples));
        dims.extend(radar.complex.then_some(parts));
        dims.push(Dim { axis: Axis::Rx, size: LANES, factor: 1, map });
    } else if radar.complex {
        if !radar.samples.is_multiple_of(2) {
            return Err("the number of samples is odd, but the words come in pairs of samples".into());
        }
        dims.push(Dim::new(Axis::Rx, radar.rx.len()));
        dims.push(Dim { axis: Axis::Sample, size: radar.samples / 2, factor: 2, map: None });
        dims.push(parts);
        dims.push(Dim::new(Axis::Sample, 2));
    } else {
        dims.push(Dim::new(Axis::Rx, radar.rx.len()));
        dims.push(Dim::new(Axis::Sample, radar.samples));
    }
    CubeLayout::new(dims, Number::I16 { bits: radar.adc_bits }, false)
}

/// Opens a recording for reading in √W, or in counts where no full scale is known.
///
/// # Errors
/// Returns `BadInput` if the file is missing, empty, or does not hold a whole number of the frames that
/// `radar` describes, or if a sidecar contradicts it.
pub fn open(path: &Path, radar: &TiRadar, options: &BinOptions) -> Result<Source> {
    let file = open_file(path)?;
    let bytes = file.metadata().map_err(|e| Error::io(path, e))?.len();
    let sidecar = sidecar_of(path)?;
    let s = sidecar.as_ref();
    let four_lanes = options.four_lanes.or(s.map(|s| s.four_lanes)).unwrap_or(radar.interleaved);
    let iq = options.iq_order.or(s.map(|s| s.iq_order)).unwrap_or(radar.iq_order);
    let full_scale_dbm = options.full_scale_dbm.or(s.map(|s| s.full_scale_dbm));
    let bad = |problem: String| BadInput::new(problem).file(path);
    let one = layout(radar, 1, four_lanes, iq).map_err(&bad)?;
    let frame = one.bytes();
    let frames = bytes / frame;
    if frames == 0 || bytes % frame != 0 {
        let [chirps, channels, samples] = one.shape();
        return Err(bad(format!(
            "{} frames of {frame} bytes and {} bytes more: truncated, or of another configuration",
            frames,
            bytes % frame
        ))
        .key("size")
        .value(format!("{bytes} bytes"))
        .allowed(format!(
            "a multiple of {frame}: {chirps} loops x {channels} rows x {samples} {} samples",
            if radar.complex { "complex" } else { "real" }
        ))
        .remedy("give the .cfg with which it was recorded")
        .into());
    }
    let said = s.map(|s| s.frames).or(radar.frames);
    if let Some(n) = said.filter(|n| (frames as usize) > *n) {
        return Err(bad(format!("holds {frames} frames, but {n} were recorded"))
            .key("size")
            .value(format!("{bytes} bytes"))
            .remedy("give the .cfg with which it was recorded")
            .into());
    }
    let mut layout = layout(radar, frames as usize, four_lanes, iq).map_err(&bad)?;
    if let Some(dbm) = full_scale_dbm {
        layout = layout.scaled(scale(dbm, radar.adc_bits)?);
    }
    let mut source = Source::plain(path, file, layout, 0);
    let antennas = sidecar.and_then(|s| s.antennas);
    source.ti_radar =
        Some(TiRadar { antennas: antennas.or_else(|| radar.antennas.clone()), ..radar.clone() });
    Ok(source)
}

/// Result of writing a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Path of the recording.
    pub bin: PathBuf,
    /// Path of the sidecar.
    pub sidecar: PathBuf,
    /// Content of the sidecar.
    pub said: Sidecar,
}

/// Writes a recording chirp by chirp, rounded to counts. Nothing is left unless it is finished.
pub struct Writer {
    radar: TiRadar,
    bin: StagedFile,
    sidecar: StagedFile,
    file: BufWriter<File>,
    said: Sidecar,
    chirps: usize,
    words: Vec<u8>,
}

impl Writer {
    /// Begins a recording; `radar` gives layout, order and bits (its `interleaved`, `iq_order`, `adc_bits`).
    ///
    /// # Errors
    /// Returns an error for a name that exists (without `force`), an odd number of samples, or an invalid
    /// full scale.
    pub fn create(
        path: impl AsRef<Path>,
        radar: &TiRadar,
        full_scale_dbm: f64,
        force: bool,
    ) -> Result<Writer> {
        let path = path.as_ref();
        layout(radar, 1, radar.interleaved, radar.iq_order).map_err(|p| BadInput::new(p).file(path))?;
        let said = Sidecar {
            written_by: concat!("catseye ", env!("CARGO_PKG_VERSION")).into(),
            full_scale_dbm,
            sqrt_watt_per_count: scale(full_scale_dbm, radar.adc_bits)?,
            four_lanes: radar.interleaved,
            iq_order: radar.iq_order,
            frames: 0,
            clipped_words: 0,
            antennas: radar.antennas.clone(),
        };
        let bin = StagedFile::new(path, force)?;
        let sidecar = StagedFile::new(sidecar_path(path), force)?;
        let file = File::create(bin.path()).map_err(|e| Error::io(path, e))?;
        Ok(Writer {
            radar: radar.clone(),
            bin,
            sidecar,
            file: BufWriter::new(file),
            said,
            chirps: 0,
            words: Vec::new(),
        })
    }

    /// Appends the next chirp of any transmitter, `[rx, sample]`, in √W.
    ///
    /// # Errors
    /// Returns an error for another number of samples, or a NaN or infinite one.
    pub fn push_chirp<T: Copy + Into<f64>>(&mut self, rows: &[Complex<T>]) -> Result<()> {
        let (n, rx) = (self.radar.samples, self.radar.rx.len());
        let path = self.bin.final_path();
        if rows.len() != n * rx {
            return Err(Error::Failed(format!(
                "{}: a chirp has {} samples, but {rx} receivers with {n} samples each are expected",
                path.display(),
                rows.len()
            )));
        }
        let largest = (1i32 << (self.radar.adc_bits - 1)) - 1;
        let per_count = 1.0 / self.said.sqrt_watt_per_count;
        let mut clipped = 0;
        let mut bad = None;
        let mut count = |i: usize, part: usize| -> [u8; 2] {
            let z = rows[i];
            let x: f64 = if part == 0 { z.re.into() } else { z.im.into() };
            if !x.is_finite() {
                bad = Some(i);
            }
            let c = (x * per_count).round();
            let held = c.clamp(f64::from(-largest - 1), f64::from(largest));
            clipped += u64::from(c != held);
            (held as i16).to_le_bytes()
        };
        let parts: &[usize] = match (self.radar.complex, self.radar.iq_order) {
            (false, _) => &[0],
            (true, IqOrder::Iq) => &[0, 1],
            (true, IqOrder::Qi) => &[1, 0],
        };
        self.words.clear();
        if self.radar.interleaved {
            for s in 0..n {
                for part in parts {
                    for lane in 0..LANES {
                        let word = match self.radar.rx.iter().position(|r| *r as usize == lane) {
                            Some(r) => count(r * n + s, *part),
                            None => [0, 0],
                        };
                        self.words.extend(word);
                    }
                }
            }
        } else {
            let together = if self.radar.complex { 2 } else { 1 };
            for i in (0..n * rx).step_by(together) {
                for part in parts {
                    for k in 0..together {
                        self.words.extend(count(i + k, *part));
                    }
                }
            }
        }
        if let Some(i) = bad {
            return Err(BadInput::new("NaN or infinite value")
                .file(path)
                .key(format!("chirp {}, rx {}, sample {}", self.chirps, i / n, i % n))
                .allowed("finite numbers")
                .into());
        }
        self.said.clipped_words += clipped;
        self.chirps += 1;
        self.file.write_all(&self.words).map_err(|e| Error::io(path, e))
    }

    /// Appends a whole frame, `[chirp, rx_virtual, sample]`, in √W.
    ///
    /// # Errors
    /// Returns an error for a cube of another shape, a non-finite sample, or a failed write.
    pub fn push_frame<T: Copy + Into<f64>>(&mut self, cube: &[Complex<T>]) -> Result<()> {
        let chirp = self.radar.samples * self.radar.rx.len();
        let [a, b, c] = self.radar.shape();
        if cube.len() != a * b * c {
            return Err(Error::Failed(format!(
                "{}: a frame has {} samples, but the shape [{a}, {b}, {c}] is expected",
                self.bin.final_path().display(),
                cube.len()
            )));
        }
        cube.chunks_exact(chirp).try_for_each(|rows| self.push_chirp(rows))
    }

    /// Gives both files their final names.
    ///
    /// # Errors
    /// Returns an error if the last frame is not complete, or if the file cannot be finished.
    pub fn finish(mut self) -> Result<Written> {
        let a_frame = self.radar.loops * self.radar.slots();
        if self.chirps == 0 || !self.chirps.is_multiple_of(a_frame) {
            return Err(Error::Failed(format!(
                "{}: {} chirps are not a whole number of frames of {a_frame}",
                self.bin.final_path().display(),
                self.chirps
            )));
        }
        self.said.frames = self.chirps / a_frame;
        self.file.flush().map_err(|e| Error::io(self.bin.final_path(), e))?;
        drop(self.file);
        let text = serde_json::to_string_pretty(&self.said).map_err(|e| Error::Failed(e.to_string()))?;
        std::fs::write(self.sidecar.path(), text + "\n")
            .map_err(|e| Error::io(self.sidecar.final_path(), e))?;
        let sidecar = self.sidecar.commit()?;
        Ok(Written { bin: self.bin.commit()?, sidecar, said: self.said })
    }
}

/// The smallest full scale, in whole dBm, at which no word of `samples` is clipped; −300 for silence.
pub fn fitting_full_scale_dbm<T: Copy + Into<f64>>(samples: &[Complex<T>], adc_bits: u32) -> f64 {
    let peak = samples.iter().fold(0f64, |m, z| {
        let (re, im): (f64, f64) = (z.re.into(), z.im.into());
        m.max(re.abs()).max(im.abs())
    });
    // The largest count is one below 2^(bits−1).
    let full = f64::from(1u32 << (adc_bits - 1));
    let dbm = catseye::base::units::dbm_from_w((peak * full / (full - 1.0)).powi(2));
    if dbm.is_finite() { dbm.ceil().clamp(-300.0, 300.0) } else { -300.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::{Complex32, Complex64};
    use proptest::prelude::*;

    fn radar(
        rx_mask: u32,
        loops: usize,
        samples: usize,
        tx: &[u32],
        interleaved: bool,
        complex: bool,
    ) -> TiRadar {
        let mut text = format!(
            "channelCfg {rx_mask} 7 0\nadcCfg 2 {}\nadcbufCfg -1 {} 0 {} 1\n\
             profileCfg 0 77 10 5 90 0 0 10 1 {samples} 10000 0 0 30\nframeCfg 0 {} {loops} 0 100 1 0\n",
            u32::from(complex),
            u32::from(!complex),
            u32::from(!interleaved),
            tx.len() - 1
        );
        for (i, t) in tx.iter().enumerate() {
            text.push_str(&format!("chirpCfg {i} {i} 0 0 0 0 0 {t}\n"));
        }
        TiRadar::parse("a.cfg", &text).unwrap()
    }

    fn words(path: &Path, words: &[i16]) {
        std::fs::write(path, words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    }

    fn all<T: crate::cube_layout::Real>(r: &mut Source, frame: usize) -> Vec<Complex<T>> {
        let n = r.shape()[1];
        r.channels(frame, 0..n).unwrap()
    }

    /// SWRA581, its MATLAB for xWR16xx: every four words are I, I, Q, Q of two samples, rows of receivers
    /// one after another in a chirp.
    #[test]
    fn two_lanes_as_the_application_report_reads_them() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        // Receivers 1 and 3 (mask 5), two transmitters, two loops, four samples, two frames.
        let radar = radar(5, 2, 4, &[1, 2], false, true);
        let total = 2 * 2 * 2 * 2 * 4;
        let file: Vec<i16> = (0..2 * total as i16).collect();
        words(&path, &file);
        let mut lvds = Vec::new();
        for q in file.chunks(4) {
            lvds.push(Complex64::new(q[0].into(), q[2].into()));
            lvds.push(Complex64::new(q[1].into(), q[3].into()));
        }
        let mut r = open(&path, &radar, &BinOptions::default()).unwrap();
        assert_eq!((r.frames(), r.shape(), r.has_levels()), (2, [2, 4, 4], false));
        for frame in 0..2 {
            // Chirps of a frame, receivers in a chirp, samples: already the cube's own order.
            assert_eq!(all::<f64>(&mut r, frame), lvds[frame * 32..(frame + 1) * 32]);
        }
        let part: Vec<Complex32> = r.channels(1, 1..3).unwrap();
        assert_eq!(part[0], Complex32::new(lvds[36].re as f32, lvds[36].im as f32));
        // Q first.
        let options = BinOptions { iq_order: Some(IqOrder::Qi), ..Default::default() };
        let mut r = open(&path, &radar, &options).unwrap();
        assert_eq!(all::<f64>(&mut r, 0)[0], Complex64::new(2.0, 0.0));
    }

    /// SWRA581, its MATLAB for xWR14xx: columns of eight words, four of I and four of Q.
    #[test]
    fn four_lanes_as_the_application_report_reads_them() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        let radar = radar(0b1101, 2, 3, &[4], true, true);
        let file: Vec<i16> = (0..2 * 3 * 8).collect();
        words(&path, &file);
        let mut r = open(&path, &radar, &BinOptions::default()).unwrap();
        assert_eq!((r.frames(), r.shape()), (1, [2, 3, 3]));
        let out = all::<f64>(&mut r, 0);
        for chirp in 0..2 {
            for (i, lane) in [0, 2, 3].into_iter().enumerate() {
                for s in 0..3 {
                    let column = &file[(chirp * 3 + s) * 8..][..8];
                    let z = Complex64::new(column[lane].into(), column[lane + 4].into());
                    assert_eq!(out[(chirp * 3 + i) * 3 + s], z);
                }
            }
        }
        // The same bytes as real samples of two lanes: all receivers of a chirp one after another.
        let radar = self::radar(0b1101, 8, 2, &[4], false, false);
        let mut r = open(&path, &radar, &BinOptions::default()).unwrap();
        let out = all::<f64>(&mut r, 0);
        assert!(out.iter().zip(&file).all(|(z, w)| *z == Complex64::new((*w).into(), 0.0)));
    }

    #[test]
    fn counts_become_square_roots_of_watts() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        words(&path, &[-32768, 0, 0, 16384]);
        let radar = radar(1, 1, 2, &[1], false, true);
        let options = BinOptions { full_scale_dbm: Some(-10.0), ..Default::default() };
        let mut r = open(&path, &radar, &options).unwrap();
        let out = all::<f64>(&mut r, 0);
        // -10 dBm is 0.1 mW.
        assert!((out[0] - Complex64::new(-(1e-4f64.sqrt()), 0.0)).norm() < 1e-17);
        assert!((out[1] - Complex64::new(0.0, 0.5e-2)).norm() < 1e-17);
        let options = BinOptions { full_scale_dbm: Some(f64::NAN), ..Default::default() };
        assert!(open(&path, &radar, &options).is_err());
    }

    #[test]
    fn writing_rounds_and_reports_what_it_cuts() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        let radar = radar(1, 1, 4, &[1], false, true);
        // Full scale 0 dBm: one count is sqrt(1 mW) / 32768.
        let lsb = 1e-3f64.sqrt() / 32768.0;
        let z = |a: f64, b: f64| Complex64::new(a * lsb, b * lsb);
        let mut w = Writer::create(&path, &radar, 0.0, false).unwrap();
        w.push_frame(&[z(1.4, -1.6), z(32767.2, -32768.4), z(32768.0, -40000.0), z(0.0, 7.0)]).unwrap();
        let done = w.finish().unwrap();
        assert_eq!((done.said.clipped_words, done.said.frames), (2, 1));
        assert!((done.said.sqrt_watt_per_count - lsb).abs() < 1e-15 * lsb);
        let bytes = std::fs::read(&path).unwrap();
        let read: Vec<i16> = bytes.chunks(2).map(|b| i16::from_le_bytes([b[0], b[1]])).collect();
        assert_eq!(read, [1, 32767, -2, -32768, 32767, 0, -32768, 7]);
        // Read back with the sidecar: each within half a count, but where it was cut.
        let mut r = open(&path, &radar, &BinOptions::default()).unwrap();
        assert!(r.has_levels());
        assert!((all::<f64>(&mut r, 0)[0] - z(1.4, -1.6)).norm() < 0.6 * lsb);
        // An existing recording stays, and nothing half-written is left.
        assert!(Writer::create(&path, &radar, 0.0, false).is_err());
        let mut w = Writer::create(&path, &radar, 0.0, true).unwrap();
        assert!(w.push_frame(&[z(0.0, 0.0); 3]).is_err());
        assert!(w.push_frame(&[z(f64::NAN, 0.0); 4]).unwrap_err().to_string().contains("NaN"));
        drop(w);
        assert!(Writer::create(&path, &radar, 0.0, true).unwrap().finish().is_err());
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[test]
    fn sizes_that_contradict_the_configuration() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        let radar = radar(3, 2, 4, &[1], false, true);
        let frame = 2 * 2 * 4 * 2;
        for length in [0, 1, 7, frame - 1, frame + 1, 2 * frame - 1] {
            words(&path, &vec![5i16; length]);
            let e = open(&path, &radar, &BinOptions::default()).err().unwrap();
            let s = e.to_string();
            assert!(s.contains("a multiple of 64: 2 loops x 2 rows x 4 complex samples"), "{s}");
            assert_eq!((e.exit_code(), s.lines().count()), (2, 1));
        }
        // A byte too many, and frames that were never recorded.
        std::fs::write(&path, vec![0; 2 * frame + 1]).unwrap();
        assert!(open(&path, &radar, &BinOptions::default()).is_err());
        words(&path, &vec![5i16; 3 * frame]);
        let two = TiRadar { frames: Some(2), ..radar.clone() };
        let e = open(&path, &two, &BinOptions::default()).err().unwrap();
        assert!(e.to_string().contains("holds 3 frames, but 2 were recorded"), "{e}");
        // A recording that was stopped early is whole frames all the same.
        words(&path, &vec![5i16; frame]);
        assert_eq!(open(&path, &two, &BinOptions::default()).unwrap().frames(), 1);
        let odd = TiRadar { samples: 3, ..radar.clone() };
        let e = open(&path, &odd, &BinOptions::default()).err().unwrap();
        assert!(e.to_string().contains("number of samples is odd"), "{e}");
        std::fs::write(sidecar_path(&path), "{}").unwrap();
        let e = open(&path, &radar, &BinOptions::default()).err().unwrap();
        assert!(e.to_string().contains("not the sidecar") && e.exit_code() == 2, "{e}");
        assert!(open(Path::new("/nonexistent.bin"), &radar, &BinOptions::default()).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Cubes of whole counts come back to the bit, in every layout.
        #[test]
        fn round_trip(rx in 1u32..16, loops in 1usize..4, pairs in 1usize..20, two in any::<bool>(), lanes in any::<bool>(),
            complex in any::<bool>(), qi in any::<bool>(), frames in 1usize..3, seed in any::<u32>(), bits in 0u32..3)
        {
            let mut radar = radar(rx, loops, 2 * pairs, if two { &[2, 1] } else { &[1] }, lanes, complex);
            if qi { radar.iq_order = IqOrder::Qi; }
            radar.adc_bits = 12 + 2 * bits;
            let [a, b, c] = radar.shape();
            let lsb = scale(-7.0, radar.adc_bits).unwrap();
            let count = |i: usize| {
                let w = (i as u32).wrapping_mul(2654435761).wrapping_add(seed) as i16;
                f64::from((w << (16 - radar.adc_bits)) >> (16 - radar.adc_bits)) * lsb
            };
            let cube: Vec<Complex64> = (0..frames * a * b * c)
                .map(|i| Complex64::new(count(2 * i), if complex { count(2 * i + 1) } else { 0.0 })).collect();
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("a.bin");
            let mut w = Writer::create(&path, &radar, -7.0, false).unwrap();
            for f in cube.chunks(a * b * c) { w.push_frame(f).unwrap(); }
            prop_assert_eq!(w.finish().unwrap().said.clipped_words, 0);
            let mut r = open(&path, &radar, &BinOptions::default()).unwrap();
            for (f, want) in cube.chunks(a * b * c).enumerate() {
                prop_assert_eq!(&all::<f64>(&mut r, f), want);
            }
            let dbm = fitting_full_scale_dbm(&cube, radar.adc_bits);
            prop_assert!((-80.0..=-6.0).contains(&dbm) || dbm == -300.0);
        }
    }
}
