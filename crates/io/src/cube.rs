//! Cubes of samples in any format, with one way in ([`open_cube`]) and one out ([`write_cube`]), chosen by
//! the name's extension: `.npy`, `.bin` (a recording of a TI device with its `.cfg`), `.h5` or `.hdf5`.

use super::cube_layout::{Axis, Number, Real, array_layout};
#[cfg(feature = "hdf5")]
use super::hdf5;
use super::source::open_file;
pub use super::source::{Checks, Source};
use super::ti_bin::{self, BinOptions};
use super::ti_cfg::TiRadar;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::npy;
use catseye::formats::stage::StagedFile;
use num_complex::Complex;
use std::path::{Path, PathBuf};

const EXTENSIONS: &str = ".npy, .bin (with a .cfg), .h5, .hdf5";

/// Options for reading a cube from another program.
#[derive(Debug, Clone, Default)]
pub struct CubeOptions {
    /// Axes of the file, slowest first (see [`super::cube_layout::axes_from`]); by default
    /// `chirp,rx,sample`, with `frame` before where the rank says so.
    pub axes: Option<Vec<Axis>>,
    /// Path of the `.cfg` of a `.bin`; by default the one of the same name beside it.
    pub cfg: Option<PathBuf>,
    /// Properties of a `.bin` that its `.cfg` does not state.
    pub bin: BinOptions,
    /// Name of the dataset in an HDF5 file, or two as `REAL,IMAGINARY`.
    pub dataset: Option<String>,
    /// Whether each sample is replaced by its conjugate: for cubes whose phase has the other sign.
    pub conjugate: bool,
    /// Whether real and imaginary parts are unsigned 16-bit words of signed counts: 65535 is −1.
    pub unsigned_words: bool,
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown_extension(path: &Path) -> Error {
    BadInput::new("unknown kind of cube").file(path).allowed(EXTENSIONS).into()
}

#[cfg(not(feature = "hdf5"))]
fn no_hdf5(path: &Path) -> Error {
    BadInput::new("this build has no HDF5")
        .file(path)
        .remedy("build with --features hdf5, or save it as .npy")
        .into()
}

/// Opens a cube. `expected` is the shape `[chirp, rx_virtual, sample]` of the radar that recorded it.
///
/// # Errors
/// Returns `BadInput` for an unknown extension, a damaged or truncated file, another type or shape, options
/// that belong to another kind of file, or a `.bin` whose size contradicts its `.cfg`.
pub fn open_cube(
    path: impl AsRef<Path>,
    options: &CubeOptions,
    expected: Option<[usize; 3]>,
) -> Result<Source> {
    let path = path.as_ref();
    let extension = extension(path);
    let stray = |key: &str, set: bool, only: &str| {
        if set {
            return Err(Error::from(
                BadInput::new(format!("is for {only} files only")).file(path).key(key).remedy("leave it out"),
            ));
        }
        Ok(())
    };
    let bin = extension == "bin";
    stray("cfg", options.cfg.is_some() && !bin, ".bin")?;
    stray("four lanes, order or full scale", options.bin != BinOptions::default() && !bin, ".bin")?;
    stray("axes", options.axes.is_some() && bin, ".npy and .h5")?;
    let h5 = matches!(extension.as_str(), "h5" | "hdf5");
    stray("dataset", options.dataset.is_some() && !h5, ".h5")?;
    let mut source = match extension.as_str() {
        "npy" => open_npy(path, options)?,
        "bin" => open_bin(path, options)?,
        #[cfg(feature = "hdf5")]
        "h5" | "hdf5" => hdf5::open(path, options.dataset.as_deref(), options.axes.as_deref())?,
        #[cfg(not(feature = "hdf5"))]
        "h5" | "hdf5" => return Err(no_hdf5(path)),
        _ => return Err(unknown_extension(path)),
    };
    if options.conjugate && !source.is_complex() {
        return Err(BadInput::new("real samples cannot be conjugated")
            .file(path)
            .key("conjugate")
            .remedy("leave it out")
            .into());
    }
    source.conjugate = options.conjugate;
    source.unsigned_words = options.unsigned_words;
    if let Some(want) = expected.filter(|w| *w != source.shape()) {
        return Err(BadInput::new("the array is not a cube of this radar")
            .file(path)
            .key("shape")
            .value(format!("{:?}", source.shape()))
            .allowed(format!("{want:?}: [chirp, rx_virtual, sample]"))
            .remedy("give the radar that recorded it with --radar, or the file's axes with --axes")
            .into());
    }
    Ok(source)
}

/// The configuration of the same name beside a recording: `.cfg`, else what mmWave Studio saves; where there is none, the name of the first.
pub fn configuration_beside(bin: &Path) -> PathBuf {
    let first = bin.with_extension("cfg");
    if first.exists() {
        return first;
    }
    ["setup.json", "mmwave.json"].iter().map(|e| bin.with_extension(e)).find(|p| p.exists()).unwrap_or(first)
}

fn open_bin(path: &Path, options: &CubeOptions) -> Result<Source> {
    open_file(path)?;
    let cfg = options.cfg.clone().unwrap_or_else(|| configuration_beside(path));
    if options.cfg.is_none() && !cfg.exists() {
        return Err(BadInput::new("a recording can only be read with the .cfg or .mmwave.json of its radar")
            .file(path)
            .allowed(format!("--cfg FILE, or {} beside it", cfg.display()))
            .into());
    }
    let radar = TiRadar::read(&cfg)?;
    radar.check_plain_stream(&cfg)?;
    ti_bin::open(path, &radar, &options.bin)
}

fn open_npy(path: &Path, options: &CubeOptions) -> Result<Source> {
    let file = open_file(path)?;
    let header = npy::read_header(path)?;
    let bad = |problem: String| BadInput::new(problem).file(path);
    let (number, complex) = match header.descr.trim_start_matches(['<', '>', '|', '=']) {
        "c8" => (Number::F32, true),
        "c16" => (Number::F64, true),
        "f4" => (Number::F32, false),
        "f8" => (Number::F64, false),
        "i1" => (Number::I8, false),
        "u1" => (Number::U8, false),
        "i2" => (Number::I16 { bits: 16 }, false),
        "u2" => (Number::U16, false),
        "i4" => (Number::I32, false),
        _ => {
            return Err(bad("wrong type of numbers".into())
                .key("dtype")
                .value(header.dtype())
                .allowed("complex64, complex128, float32, float64, int8, int16, int32, uint8, uint16")
                .remedy("convert it with numpy's astype(\"complex64\")")
                .into());
        }
    };
    let layout = array_layout(
        &header.shape,
        options.axes.as_deref(),
        header.fortran_order,
        number,
        header.descr.starts_with('>'),
        complex.then_some([0, 1]),
    )
    .map_err(|p| {
        bad(p)
            .key("shape")
            .value(format!("{:?}", header.shape))
            .allowed("[chirp, rx_virtual, sample], or as --axes names them; real pairs [..., 2]")
    })?;
    let data_at = header.data_at as u64;
    let there = file.metadata().map_err(|e| Error::io(path, e))?.len().saturating_sub(data_at);
    if there != layout.bytes() {
        let problem = if there < layout.bytes() { "truncated" } else { "longer than the array" };
        return Err(bad(format!(
            "{problem}: the array takes {} bytes, the file holds {there}",
            layout.bytes()
        ))
        .key("shape")
        .value(format!("{:?}", header.shape))
        .into());
    }
    Ok(Source::plain(path, file, layout, data_at))
}

/// Data that are written beside the samples.
#[derive(Debug, Clone, Default)]
pub struct CubeAbout {
    /// Text of the radar TOML, stored in HDF5 only.
    pub radar_toml: Option<String>,
    /// Seed of the draws, stored in HDF5 only.
    pub seed: Option<u64>,
    /// The device of a `.bin` recording; its `.cfg` is written beside it.
    pub ti_radar: Option<TiRadar>,
    /// Full scale of a `.bin`, dBm; by default the lowest that clips nothing.
    pub full_scale_dbm: Option<f64>,
}

/// Result of writing a cube.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeWritten {
    /// Paths of the files that were written.
    pub files: Vec<PathBuf>,
    /// Number of words of a `.bin` that were clipped to the largest or smallest count.
    pub clipped_words: u64,
}

/// Writes one cube `[chirp, rx_virtual, sample]` in √W, in the format of its extension. Files appear when
/// they are complete.
///
/// # Errors
/// Returns an error for an unknown extension, a name that exists (without `force`), a `.bin` without its
/// device or of another shape, or a non-finite sample.
pub fn write_cube<T: Real + Into<f64> + bytemuck::Pod>(
    path: impl AsRef<Path>,
    shape: [usize; 3],
    data: &[Complex<T>],
    about: &CubeAbout,
    force: bool,
) -> Result<CubeWritten>
where
    Complex<T>: npy::Element,
{
    let path = path.as_ref();
    if shape.iter().try_fold(1usize, |n, d| n.checked_mul(*d)) != Some(data.len()) {
        return Err(Error::Failed(format!(
            "{}: {} samples do not make a cube of shape {shape:?}",
            path.display(),
            data.len()
        )));
    }
    if let Some(i) = data.iter().position(|z| !(z.re.to_f64().is_finite() && z.im.to_f64().is_finite())) {
        let [_, channels, samples] = shape;
        let (chirp, channel) = (i / samples / channels, i / samples % channels);
        return Err(BadInput::new("NaN or infinite value")
            .file(path)
            .key(format!("index [chirp {chirp}, rx_virtual {channel}, sample {}]", i % samples))
            .allowed("finite numbers")
            .into());
    }
    let one = |file: PathBuf| Ok(CubeWritten { files: vec![file], clipped_words: 0 });
    match extension(path).as_str() {
        "npy" => {
            let staged = StagedFile::new(path, force)?;
            npy::write(staged.path(), &shape, data)?;
            one(staged.commit()?)
        }
        #[cfg(feature = "hdf5")]
        "h5" | "hdf5" => {
            let staged = StagedFile::new(path, force)?;
            hdf5::write(staged.path(), &shape, data, about.radar_toml.as_deref(), about.seed)?;
            one(staged.commit()?)
        }
        #[cfg(not(feature = "hdf5"))]
        "h5" | "hdf5" => Err(no_hdf5(path)),
        "bin" => {
            let radar = about.ti_radar.as_ref().ok_or_else(|| {
                BadInput::new("a .bin can only be written for a TI device")
                    .file(path)
                    .remedy("give the .cfg of the device")
            })?;
            if radar.shape() != shape {
                return Err(BadInput::new("the cube does not fit this .cfg")
                    .file(path)
                    .key("shape")
                    .value(format!("{shape:?}"))
                    .allowed(format!("{:?}: [chirp, rx_virtual, sample]", radar.shape()))
                    .into());
            }
            let full_scale =
                about.full_scale_dbm.unwrap_or_else(|| ti_bin::fitting_full_scale_dbm(data, radar.adc_bits));
            let mut writer = ti_bin::Writer::create(path, radar, full_scale, force)?;
            // If the name is taken, nothing is written at all.
            let cfg = StagedFile::new(path.with_extension("cfg"), force)?;
            std::fs::write(cfg.path(), radar.to_cfg()).map_err(|e| Error::io(cfg.final_path(), e))?;
            writer.push_frame(data)?;
            let done = writer.finish()?;
            Ok(CubeWritten {
                files: vec![done.bin, done.sidecar, cfg.commit()?],
                clipped_words: done.said.clipped_words,
            })
        }
        _ => Err(unknown_extension(path)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::{Complex32, Complex64};

    const CFG: &str = "channelCfg 3 3 0\nadcCfg 2 1\nadcbufCfg -1 0 1 1 1\n\
        profileCfg 0 77 10 5 90 0 0 10 1 8 10000 0 0 30\nchirpCfg 0 0 0 0 0 0 0 1\n\
        chirpCfg 1 1 0 0 0 0 0 2\nframeCfg 0 1 3 0 100 1 0\n";
    const SHAPE: [usize; 3] = [3, 4, 8];

    fn cube() -> Vec<Complex32> {
        (0..96).map(|i| Complex32::new(i as f32 / 64.0, -(i as f32) / 128.0)).collect()
    }

    fn about() -> CubeAbout {
        CubeAbout {
            ti_radar: Some(TiRadar::parse("a.cfg", CFG).unwrap()),
            radar_toml: Some("name = \"x\"".into()),
            ..Default::default()
        }
    }

    fn npy_bytes(descr: &str, fortran: &str, shape: &str, body: &[u8]) -> Vec<u8> {
        let dict = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        let mut b = b"\x93NUMPY\x01\x00".to_vec();
        b.extend((dict.len() as u16).to_le_bytes());
        b.extend(dict.as_bytes());
        b.extend(body);
        b
    }

    fn message(path: &Path, options: &CubeOptions, expected: Option<[usize; 3]>) -> String {
        let e = open_cube(path, options, expected).err().unwrap();
        let s = e.to_string();
        assert_eq!((e.exit_code(), s.lines().count()), (2, 1), "{s}");
        s
    }

    #[test]
    fn every_kind_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let cube = cube();
        let f64s: Vec<Complex64> = cube.iter().map(|z| Complex64::new(z.re.into(), z.im.into())).collect();
        let mut names = vec!["a.npy", "a.bin"];
        if cfg!(feature = "hdf5") {
            names.extend(["a.h5", "a.HDF5"]);
        }
        for name in names {
            let path = dir.path().join(name);
            let written = write_cube(&path, SHAPE, &cube, &about(), false).unwrap();
            assert_eq!((written.clipped_words, written.files[0].as_path()), (0, path.as_path()));
            assert!(written.files.iter().all(|f| f.is_file()));
            let mut s = open_cube(&path, &CubeOptions::default(), Some(SHAPE)).unwrap();
            assert_eq!((s.frames(), s.shape(), s.is_complex(), s.has_levels()), (1, SHAPE, true, true));
            assert_eq!(s.ti_radar().is_some(), name == "a.bin");
            // A recording is rounded to counts: half of one, of a full scale at most 1 dB over the peak.
            let peak = 95.0 / 64.0;
            let allowed =
                if name == "a.bin" { 0.5 * 10f64.powf(0.05) * peak / 32767.0 * 2f64.sqrt() } else { 0.0 };
            let all: Vec<Complex64> = s.frame(0).unwrap();
            let part: Vec<Complex32> = s.channels(0, 1..3).unwrap();
            for (i, (a, b)) in all.iter().zip(&f64s).enumerate() {
                assert!((a - b).norm() <= allowed, "{name} {i}: {a} {b}");
                let (chirp, channel, sample) = (i / 32, i / 8 % 4, i % 8);
                if (1..3).contains(&channel) {
                    let z = part[(chirp * 2 + channel - 1) * 8 + sample];
                    assert_eq!(z, Complex32::new(a.re as f32, a.im as f32));
                }
            }
            let s = message(&path, &CubeOptions::default(), Some([3, 8, 4]));
            assert!(
                s.contains("shape = [3, 4, 8]: the array is not a cube of this radar; allowed: [3, 8, 4]"),
                "{s}"
            );
            let e = write_cube(&path, SHAPE, &f64s, &about(), false).unwrap_err().to_string();
            assert!(e.contains("exists already"), "{e}");
            write_cube(&path, SHAPE, &f64s, &about(), true).unwrap();
        }
        // Three files of the recording, and nothing half-written.
        let count = std::fs::read_dir(dir.path()).unwrap().count();
        assert_eq!(count, if cfg!(feature = "hdf5") { 6 } else { 4 });
    }

    #[test]
    fn arrays_of_others() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        // int16 pairs, big-endian, Fortran order: [sample, chirp, rx, 2] of 2 x 3 x 1.
        let shape = [2, 3, 1, 2];
        let mut body = vec![0u8; 24];
        for (i, b) in body.chunks_mut(2).enumerate() {
            let (sample, chirp, part) = (i % 2, i / 2 % 3, i / 6);
            b.copy_from_slice(&(((part * 100 + chirp * 10 + sample) as i16) - 50).to_be_bytes());
        }
        std::fs::write(
            &path,
            npy_bytes(
                ">i2",
                "True",
                &format!("({}, {}, {}, {})", shape[0], shape[1], shape[2], shape[3]),
                &body,
            ),
        )
        .unwrap();
        let options = CubeOptions {
            axes: Some(crate::cube_layout::axes_from("sample,chirp,rx").unwrap()),
            ..Default::default()
        };
        let mut s = open_cube(&path, &options, Some([3, 1, 2])).unwrap();
        assert!(!s.has_levels());
        let z: Vec<Complex32> = s.frame(0).unwrap();
        for (i, z) in z.iter().enumerate() {
            let told = (i / 2 * 10 + i % 2) as f32 - 50.0;
            assert_eq!(*z, Complex32::new(told, told + 100.0));
        }
        // Real, then several frames.
        npy::write(&path, &[1, 2, 3], &[1.5f32; 6]).unwrap();
        let mut s = open_cube(&path, &CubeOptions::default(), None).unwrap();
        assert!(s.has_levels());
        assert!(!s.is_complex() && s.frame::<f64>(0).unwrap()[5] == Complex64::new(1.5, 0.0));
        let data: Vec<Complex64> = (0..24).map(|i| Complex64::new(f64::from(i), 0.0)).collect();
        npy::write(&path, &[4, 1, 2, 3], &data).unwrap();
        let mut s = open_cube(&path, &CubeOptions::default(), Some([1, 2, 3])).unwrap();
        assert_eq!(s.frames(), 4);
        assert_eq!(s.frame::<f64>(3).unwrap(), data[18..]);
        assert!(s.frame::<f64>(4).is_err() && s.channels::<f64>(0, 1..3).is_err());
    }

    #[test]
    fn hostile_arrays() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        write_cube(&path, SHAPE, &cube(), &about(), false).unwrap();
        let good = std::fs::read(&path).unwrap();
        let plain = CubeOptions::default();
        for n in (0..good.len()).step_by(7).chain([good.len() - 1]) {
            std::fs::write(&path, &good[..n]).unwrap();
            message(&path, &plain, None);
        }
        std::fs::write(&path, [&good[..], &[0]].concat()).unwrap();
        assert!(message(&path, &plain, None).contains("longer than the array"));
        for (descr, shape, expect) in [
            ("<c8", "(1048576, 1048576, 1048576)", "truncated"),
            ("<c8", "(1048576, 1048576, 1048576, 1048576)", "the array has too many elements"),
            ("<c8", "(18446744073709551615, 2, 2)", "one axis has"),
            ("<c8", "(4, 2)", "2 axes, not 3"),
            ("<c8", "()", "0 axes, not 3"),
            ("<c8", "(0, 4, 4)", "one axis has 0 elements"),
            ("<u8", "(1, 1, 1)", "dtype = <u8: wrong type of numbers"),
            ("<U4", "(1, 1, 1)", "dtype = <U4: wrong type of numbers"),
            ("<c8", "(1, 1, 1)", "truncated: the array takes 8 bytes, the file holds 0"),
        ] {
            std::fs::write(&path, npy_bytes(descr, "False", shape, &[])).unwrap();
            let s = message(&path, &plain, None);
            assert!(s.contains(expect), "{s}");
        }
        let mut nan = cube();
        nan[50].im = f32::NEG_INFINITY;
        npy::write(&path, &SHAPE, &nan).unwrap();
        let mut s = open_cube(&path, &plain, Some(SHAPE)).unwrap();
        // Channel 2 of chirp 1, sample 2: other channels are well.
        assert!(s.channels::<f32>(0, 0..2).is_ok());
        let e = s.frame::<f32>(0).unwrap_err().to_string();
        assert!(e.contains("index [chirp 1, rx_virtual 2, sample 2]: NaN"), "{e}");
        for name in ["b.npy", "b.bin"] {
            let e = write_cube(dir.path().join(name), SHAPE, &nan, &about(), false).unwrap_err().to_string();
            assert!(e.contains("index [chirp 1, rx_virtual 2, sample 2]"), "{e}");
        }
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn options_have_to_fit() {
        let dir = tempfile::tempdir().unwrap();
        let at = |n: &str| dir.path().join(n);
        write_cube(at("a.bin"), SHAPE, &cube(), &about(), false).unwrap();
        write_cube(at("a.npy"), SHAPE, &cube(), &about(), false).unwrap();
        let plain = CubeOptions::default;
        let axes = CubeOptions { axes: Some(vec![Axis::Chirp, Axis::Rx, Axis::Sample]), ..plain() };
        let cfg = CubeOptions { cfg: Some(at("a.cfg")), ..plain() };
        let dataset = CubeOptions { dataset: Some("x".into()), ..plain() };
        let scale = BinOptions { full_scale_dbm: Some(0.0), ..Default::default() };
        let scale = CubeOptions { bin: scale, ..plain() };
        assert!(message(&at("a.bin"), &axes, None).contains("axes: is for .npy and .h5 files only"));
        assert!(message(&at("a.npy"), &cfg, None).contains("cfg: is for .bin files only"));
        assert!(message(&at("a.npy"), &scale, None).contains("is for .bin files only"));
        assert!(message(&at("a.npy"), &dataset, None).contains("dataset: is for .h5 files only"));
        assert!(open_cube(at("a.bin"), &cfg, Some(SHAPE)).is_ok());
        assert!(message(&at("a.mat"), &plain(), None).contains("allowed: .npy, .bin (with a .cfg)"));
        assert!(message(&at("gone.npy"), &plain(), None).contains("no such file"));
        assert!(message(&at("gone.bin"), &plain(), None).contains("no such file"));
        std::fs::rename(at("a.bin"), at("b.bin")).unwrap();
        assert!(message(&at("b.bin"), &plain(), None).contains("can only be read with the .cfg"));
        // Without the sidecar the samples are counts, and half a recording is refused.
        let s = open_cube(at("b.bin"), &cfg, None).unwrap();
        assert!(!s.has_levels());
        let bytes = std::fs::read(at("b.bin")).unwrap();
        std::fs::write(at("b.bin"), &bytes[..bytes.len() / 2]).unwrap();
        assert!(message(&at("b.bin"), &cfg, None).contains("truncated"));
        let text =
            std::fs::read_to_string(at("a.cfg")).unwrap().replace("lvdsStreamCfg -1 0", "lvdsStreamCfg -1 1");
        std::fs::write(at("b.cfg"), text).unwrap();
        assert!(message(&at("b.bin"), &plain(), None).contains("contains data other than samples"));
        assert!(write_cube(at("c.bin"), SHAPE, &cube(), &CubeAbout::default(), false).is_err());
        assert!(write_cube(at("c.bin"), [3, 8, 4], &cube(), &about(), false).is_err());
        assert!(write_cube(at("c.mat"), SHAPE, &cube(), &about(), false).is_err());
    }
}
