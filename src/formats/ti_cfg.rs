//! Configuration files of Texas Instruments' mmWave devices: the commands of the mmWave SDK's demo, one a
//! line (mmWave SDK User's Guide, "Configuration (.cfg) File Format"). Fields that follow are in the
//! units of the commands; [`TiRadar`] is in SI units.
//!
//! `channelCfg rx_mask tx_mask cascading` · `adcCfg bits format` ·
//! `adcbufCfg [subframe] format sample_swap interleave threshold` ·
//! `profileCfg id start_GHz idle_µs adc_start_µs ramp_end_µs power_backoff phase_shifter slope_MHz/µs
//! tx_start_µs samples rate_ksps hpf1 hpf2 rx_gain` ·
//! `chirpCfg first last profile start_Hz slope_kHz/µs idle_µs adc_start_µs tx_mask` ·
//! `frameCfg first last loops frames period_ms trigger delay_ms` · `bpmCfg subframe on chirp0 chirp1` ·
//! `lvdsStreamCfg subframe header format software`.

use crate::error::{BadInput, Error, Result};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A configuration has some fifty short lines.
const MAX_BYTES: u64 = 1 << 20;
/// Chirps that the devices can tell apart (`chirpCfg`, mmWave interface control document).
const MAX_CHIRPS: usize = 512;
/// Receivers, and transmitters, of one device.
const MAX_ANTENNAS: u32 = 4;

/// How the transmitters share the chirps of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Multiplex {
    /// One transmitter in each chirp, each once in a loop.
    Tdm,
    /// Two transmitters in two chirps, S₁ + S₂ and S₁ − S₂ (TI SWRA554, section 4.2): see
    /// [`bpm_separate`].
    Bpm,
    /// Several transmitters in a chirp with equal signs: one beam.
    Together,
}

/// Order of the two words of a complex sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IqOrder {
    /// In phase first (`sample_swap` 0).
    Iq,
    /// Quadrature first (`sample_swap` 1, which the SDK's demo uses).
    Qi,
}

/// What a `.cfg` says of the radar. All chirps of a frame have one shape.
#[derive(Debug, Clone, PartialEq)]
pub struct TiRadar {
    /// Frequency where the ramp begins.
    pub start_hz: f64,
    /// Negative for a falling ramp.
    pub slope_hz_per_s: f64,
    /// From the end of a ramp to the start of the next.
    pub idle_s: f64,
    /// From the start of the ramp to the first sample.
    pub adc_start_s: f64,
    /// Length of the ramp.
    pub ramp_end_s: f64,
    /// When the transmitter is switched on, from the start of the ramp; negative is before it.
    pub tx_start_s: f64,
    /// Of one chirp.
    pub samples: usize,
    pub sample_rate_hz: f64,
    /// Times that the chirps of `tx_masks` are repeated in a frame.
    pub loops: usize,
    /// Transmitters (bit 0 is TX1) of each chirp of a loop, in order.
    pub tx_masks: Vec<u32>,
    pub multiplex: Multiplex,
    /// Receivers that are on, counted from 0, ascending.
    pub rx: Vec<u32>,
    /// `None` runs until it is stopped.
    pub frames: Option<usize>,
    pub frame_period_s: f64,
    /// I and Q; else real samples.
    pub complex: bool,
    /// The image band is kept ("complex 2x").
    pub image_band: bool,
    /// 12, 14 or 16.
    pub adc_bits: u32,
    pub iq_order: IqOrder,
    /// All receivers of a sample together (xWR14xx), else one receiver's chirp after another.
    pub interleaved: bool,
    /// Output power below the largest, in dB, of TX1, TX2, TX3.
    pub power_backoff_db: [u8; 3],
    /// As in `profileCfg`: bits 0 to 5 are the gain in dB.
    pub rx_gain: u32,
    /// Corner codes of the two high-pass filters, as in `profileCfg`.
    pub high_pass: [u32; 2],
    /// `[header, format, software]` of `lvdsStreamCfg`.
    pub lvds: Option<[u32; 3]>,
    /// Commands that say nothing of the samples, as they stood.
    pub others: Vec<String>,
}

impl TiRadar {
    /// Reads a `.cfg`.
    ///
    /// # Errors
    /// `BadInput` with the line for a value that is no number or out of range, a chirp without its
    /// profile, samples beyond the ramp, a frame shorter than its chirps, a mask of antennas that are off.
    pub fn read(path: impl AsRef<Path>) -> Result<TiRadar> {
        let path = path.as_ref();
        let bad = |problem: &str| Error::from(BadInput::new(problem).file(path));
        let meta = match std::fs::metadata(path) {
            Ok(m) => m,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Err(bad("no such file")),
            Err(e) => return Err(Error::io(path, e)),
        };
        if !meta.is_file() {
            return Err(bad("is not a file"));
        }
        if meta.len() > MAX_BYTES {
            return Err(BadInput::new("is too long for a .cfg file")
                .file(path)
                .value(format!("{} bytes", meta.len()))
                .allowed(format!("up to {MAX_BYTES} bytes"))
                .into());
        }
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        TiRadar::parse(path, &String::from_utf8(bytes).map_err(|_| bad("is not UTF-8 text"))?)
    }

    /// The radar of a text; `file` is named in errors.
    pub fn parse(file: impl AsRef<Path>, text: &str) -> Result<TiRadar> {
        Commands::parse(file.as_ref(), text)?.radar()
    }

    /// Chirps of a loop.
    pub fn slots(&self) -> usize {
        self.tx_masks.len()
    }

    /// Rows of samples in a loop: chirps times receivers, the chirp running slower. With TDM these are
    /// the virtual channels.
    pub fn channels(&self) -> usize {
        self.slots() * self.rx.len()
    }

    /// `[chirp, rx_virtual, sample]` of one frame.
    pub fn shape(&self) -> [usize; 3] {
        [self.loops, self.channels(), self.samples]
    }

    /// From the start of one chirp to the start of the next.
    pub fn chirp_period_s(&self) -> f64 {
        self.idle_s + self.ramp_end_s
    }

    /// Frequency in the middle of the ramp.
    pub fn carrier_hz(&self) -> f64 {
        self.start_hz + 0.5 * self.slope_hz_per_s * self.ramp_end_s
    }

    /// The `.cfg` with the commands that the mmWave SDK's demo (release 3) needs before it starts. Commands
    /// of `others` take the place of the demo's defaults. Reads back with the same numbers.
    pub fn to_cfg(&self) -> String {
        let mask = |of: &[u32]| of.iter().fold(0, |m, r| m | 1u32 << r);
        let tx = self.tx_masks.iter().fold(0, |m, t| m | t);
        let bits = (self.adc_bits.saturating_sub(12)) / 2;
        let format = if self.complex { 1 + u32::from(self.image_band) } else { 0 };
        let [b0, b1, b2] = self.power_backoff_db;
        let mut out = String::from("% Written by catseye\nsensorStop\nflushCfg\ndfeDataOutputMode 1\n");
        let mut line = |l: std::fmt::Arguments<'_>| {
            // Writing to a string does not fail.
            let _ = writeln!(out, "{l}");
        };
        line(format_args!("channelCfg {} {tx} 0", mask(&self.rx)));
        line(format_args!("adcCfg {bits} {format}"));
        line(format_args!(
            "adcbufCfg -1 {} {} {} 1",
            u32::from(!self.complex),
            u32::from(self.iq_order == IqOrder::Qi),
            u32::from(!self.interleaved),
        ));
        line(format_args!(
            "profileCfg 0 {} {} {} {} {} 0 {} {} {} {} {} {} {}",
            shifted(self.start_hz, -9),
            shifted(self.idle_s, 6),
            shifted(self.adc_start_s, 6),
            shifted(self.ramp_end_s, 6),
            u32::from_le_bytes([b0, b1, b2, 0]),
            shifted(self.slope_hz_per_s, -12),
            shifted(self.tx_start_s, 6),
            self.samples,
            shifted(self.sample_rate_hz, -3),
            self.high_pass[0],
            self.high_pass[1],
            self.rx_gain,
        ));
        for (i, t) in self.tx_masks.iter().enumerate() {
            line(format_args!("chirpCfg {i} {i} 0 0 0 0 0 {t}"));
        }
        line(format_args!(
            "frameCfg 0 {} {} {} {} 1 0",
            self.slots() - 1,
            self.loops,
            self.frames.unwrap_or(0),
            shifted(self.frame_period_s, 3)
        ));
        line(format_args!("bpmCfg -1 {} 0 1", u32::from(self.multiplex == Multiplex::Bpm)));
        if let Some([header, format, software]) = self.lvds {
            line(format_args!("lvdsStreamCfg -1 {header} {format} {software}"));
        }
        for default in DEMO_DEFAULTS {
            let name = name_of(default);
            let said = self.others.iter().any(|o| name_of(o) == name);
            if !said && !(name == "lvdsStreamCfg" && self.lvds.is_some()) {
                line(format_args!("{default}"));
            }
        }
        for other in &self.others {
            line(format_args!("{other}"));
        }
        line(format_args!("sensorStart"));
        out
    }

    /// Refuses a stream over LVDS that holds more than plain samples.
    ///
    /// # Errors
    /// `BadInput` for headers, chirp-quality words or the software's own stream.
    pub fn check_plain_stream(&self, cfg: &Path) -> Result<()> {
        let Some([header, format, software]) = self.lvds else { return Ok(()) };
        if header != 0 || format > 1 || software != 0 {
            return Err(BadInput::new("the recording holds more than samples")
                .file(cfg)
                .key("lvdsStreamCfg")
                .value(format!("-1 {header} {format} {software}"))
                .allowed("-1 0 1 0: samples without headers")
                .remedy("record again with that line")
                .into());
        }
        Ok(())
    }

    /// The text of a catseye radar: `carrier_hz` is the centre of the ramp.
    ///
    /// # Errors
    /// `BadInput` for a falling ramp, and for transmitters that send together: those need a radar TOML of
    /// their own.
    pub fn to_radar_toml(&self, name: &str, board: Board) -> Result<String> {
        let bad = |key: &str, value: String, problem: &str| {
            Error::from(
                BadInput::new(problem)
                    .key(key)
                    .value(value)
                    .remedy("describe the radar in a TOML file and give it with --radar"),
            )
        };
        if self.slope_hz_per_s <= 0.0 {
            return Err(bad("profileCfg slope", format!("{:e} Hz/s", self.slope_hz_per_s), "the ramp falls"));
        }
        if self.multiplex != Multiplex::Tdm {
            return Err(bad(
                "chirpCfg tx_mask",
                format!("{:?}", self.tx_masks),
                "transmitters send together",
            ));
        }
        let tx: Vec<u32> = self.tx_masks.iter().map(|m| m.trailing_zeros()).collect();
        let power = POWER_DBM
            - tx.iter()
                .map(|t| f64::from(*self.power_backoff_db.get(*t as usize).unwrap_or(&0)))
                .fold(f64::INFINITY, f64::min);
        let name = name.replace(['\\', '"'], "'").replace(char::is_control, " ");
        let mut out = String::new();
        // Writing to a string does not fail.
        let _ = write!(
            out,
            "# From a TI mmWave configuration. Antennas: {}.\n\
             # Patterns are left isotropic, and counts of the converter have no level in dBm unless one is\n\
             # given: levels of this radar are relative.\n\
             name = \"{name}\"\n\n[waveform]\ncarrier_hz = {}\nbandwidth_hz = {}\nramp_time_s = {}\n\
             chirp_period_s = {}\nchirps = {}\n\n[receiver]\nsampling = \"{}\"\nsample_rate_hz = {}\n\
             samples = {}\nadc_start_s = {}\n\
             noise_figure_db = {NOISE_FIGURE_DB:?} # of the AWR1243 at 76 to 77 GHz (TI)\n\n\
             [transmitter]\npower_dbm = {power:?}\n",
            board.note(),
            number(self.carrier_hz()),
            number(self.slope_hz_per_s * self.ramp_end_s),
            number(self.ramp_end_s),
            number(self.chirp_period_s()),
            self.loops,
            if self.complex { "iq" } else { "real" },
            number(self.sample_rate_hz),
            self.samples,
            number(self.adc_start_s),
        );
        for (table, places) in [("tx", board.tx(&tx, self)), ("rx", board.rx(self))] {
            for [x, y, z] in places {
                let _ = write!(out, "\n[[{table}]]\nposition_half_wavelengths = [{x:?}, {y:?}, {z:?}]\n");
            }
        }
        Ok(out)
    }
}

/// Largest output of one transmitter of the first-generation devices (TI, sensing estimator: 12 dBm).
const POWER_DBM: f64 = 12.0;
/// As TI's engineers reckon for the AWR1243 (E2E 870322: 14 dB, −160 dBm/Hz).
const NOISE_FIGURE_DB: f64 = 14.0;

/// Where the antennas stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Board {
    /// Receivers half a wavelength apart, transmitters in their order of sending as far apart as all
    /// receivers together, so that the virtual array is a filled line.
    #[default]
    Line,
    /// Receivers D = λ/2 apart; TX2 stands 2D to the side of TX1 and D above, TX3 2D further in TX1's row;
    /// λ at 62 GHz (TI SWRU585, IWR6843L EVM, section 4.1).
    Iwr6843,
}

impl Board {
    /// Wavelength at which the board's spacings are half of it.
    const IWR6843_DESIGN_HZ: f64 = 62e9;

    fn note(self) -> &'static str {
        match self {
            Board::Line => {
                "a filled half-wavelength line in the order of sending, an assumption: a .cfg says nothing of it"
            }
            Board::Iwr6843 => "IWR6843 evaluation module (TI SWRU585, section 4.1), spacings for 62 GHz",
        }
    }

    /// `[forward, left, up]` in half wavelengths of the carrier, the first receiver furthest to the right.
    fn rx(self, radar: &TiRadar) -> Vec<[f64; 3]> {
        match self {
            Board::Line => (0..radar.rx.len()).map(|i| [0.0, i as f64, 0.0]).collect(),
            Board::Iwr6843 => {
                radar.rx.iter().map(|r| [0.0, f64::from(*r) * self.scale(radar), 0.0]).collect()
            }
        }
    }

    /// The same of transmitters, in their order of sending.
    fn tx(self, order: &[u32], radar: &TiRadar) -> Vec<[f64; 3]> {
        match self {
            Board::Line => (0..order.len()).map(|i| [0.0, (i * radar.rx.len()) as f64, 0.0]).collect(),
            Board::Iwr6843 => {
                let k = self.scale(radar);
                order.iter().map(|t| [0.0, 2.0 * f64::from(*t) * k, if *t == 1 { k } else { 0.0 }]).collect()
            }
        }
    }

    fn scale(self, radar: &TiRadar) -> f64 {
        radar.carrier_hz() / Self::IWR6843_DESIGN_HZ
    }
}

/// Separates two transmitters of BPM: on return `a` holds (a + b)/2 and `b` (a − b)/2, the echoes of the
/// first and of the second (TI SWRA554, section 4.2). Exact for what stands still; a moving target turns by
/// f_d times the chirp period between the two.
pub fn bpm_separate<T>(a: &mut [num_complex::Complex<T>], b: &mut [num_complex::Complex<T>])
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Div<Output = T> + From<f32>,
{
    let two = T::from(2.0);
    for (a, b) in a.iter_mut().zip(b) {
        let (s, d) = ([a.re + b.re, a.im + b.im], [a.re - b.re, a.im - b.im]);
        *a = num_complex::Complex::new(s[0] / two, s[1] / two);
        *b = num_complex::Complex::new(d[0] / two, d[1] / two);
    }
}

/// What the demo will not start without (release 3), with the values of its own sample profiles; the last
/// but one lines keep every range and speed in its field of view.
const DEMO_DEFAULTS: [&str; 18] = [
    "lvdsStreamCfg -1 0 1 0",
    "lowPower 0 0",
    "guiMonitor -1 1 1 0 0 0 1",
    "cfarCfg -1 0 2 8 4 3 0 15 1",
    "cfarCfg -1 1 0 4 2 3 1 15 1",
    "multiObjBeamForming -1 1 0.5",
    "clutterRemoval -1 0",
    "calibDcRangeSig -1 0 -5 8 256",
    "extendedMaxVelocity -1 0",
    "compRangeBiasAndRxChanPhase 0.0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0",
    "measureRangeBiasAndRxChanPhase 0 1.5 0.2",
    "CQRxSatMonitor 0 3 4 63 0",
    "CQSigImgMonitor 0 63 4",
    "analogMonitor 0 0",
    "aoaFovCfg -1 -90 90 -90 90",
    "cfarFovCfg -1 0 0 1000",
    "cfarFovCfg -1 1 -100 100",
    "calibData 0 0 0",
];

fn name_of(line: &str) -> &str {
    line.split_whitespace().next().unwrap_or("")
}

/// The shortest decimal that reads back as `x`, its point moved by `power` places: exact both ways.
fn shifted(x: f64, power: i32) -> String {
    let text = format!("{x:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |m| ("-", m));
    let digits: String = mantissa.chars().filter(|c| *c != '.').collect();
    let point = exponent.parse::<i32>().unwrap_or(0) + power + 1;
    let n = digits.len() as i32;
    let plain = if point <= 0 {
        format!("0.{}{digits}", "0".repeat(-point as usize))
    } else if point >= n {
        format!("{digits}{}", "0".repeat((point - n) as usize))
    } else {
        format!("{}.{}", &digits[..point as usize], &digits[point as usize..])
    };
    if x == 0.0 { "0".into() } else { format!("{sign}{plain}") }
}

/// A TOML float: the shortest that reads back the same, rounded to fifteen digits where sums left dust.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.14e}").parse().unwrap_or(x);
    if rounded == 0.0 { "0.0".into() } else { format!("{rounded:e}") }
}

/// Words of one line.
struct Line<'a> {
    file: &'a Path,
    number: usize,
    name: &'a str,
    words: Vec<&'a str>,
}

impl Line<'_> {
    fn bad(&self, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(self.file).line(self.number).key(self.name)
    }

    fn at_least(&self, n: usize, fields: &str) -> Result<()> {
        if self.words.len() < n {
            return Err(self
                .bad("has too few numbers")
                .value(clipped(&self.words.join(" ")))
                .allowed(format!("{n}: {fields}"))
                .into());
        }
        Ok(())
    }

    /// The number in place `i`, times ten to `power`, without rounding twice.
    fn number(&self, i: usize, field: &str, power: i32, low: f64, high: f64) -> Result<f64> {
        let word = self.words[i];
        let wrong = |problem: &str| {
            Error::from(
                BadInput::new(problem)
                    .file(self.file)
                    .line(self.number)
                    .key(format!("{} {field}", self.name))
                    .value(clipped(word)),
            )
        };
        let plain = word.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+'));
        let scaled = if plain { format!("{word}e{power}").parse::<f64>() } else { word.parse::<f64>() };
        let x = scaled.map_err(|_| wrong("is not a number"))?;
        let x = if plain { x } else { x * 10f64.powi(power) };
        if !(x >= low && x <= high) {
            let unit = 10f64.powi(-power);
            return Err(match wrong("is out of range") {
                Error::Input(b) => b.allowed(format!("{}..={}", low * unit, high * unit)).into(),
                e => e,
            });
        }
        Ok(x)
    }

    fn count(&self, i: usize, field: &str, low: u32, high: u32) -> Result<u32> {
        // The demo reads integers with atoi, and files write "15.0" here and there.
        let x = self.number(i, field, 0, f64::from(low), f64::from(high))?;
        if x.fract() != 0.0 {
            return Err(self
                .bad(format!("{field} is not a whole number"))
                .value(clipped(self.words[i]))
                .into());
        }
        Ok(x as u32)
    }
}

/// Enough of a hostile line to recognise it.
fn clipped(text: &str) -> String {
    let short: String = text.chars().take(40).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if short.len() < text.len() { short + "…" } else { short }
}

#[derive(Clone)]
struct Profile {
    line: usize,
    radar: [f64; 7],
    samples: u32,
    backoff: u32,
    high_pass: [u32; 2],
    rx_gain: u32,
}

#[derive(Clone, PartialEq)]
struct Chirp {
    line: usize,
    profile: u32,
    /// Start, slope, idle, ADC start: added to the profile's.
    vary: [f64; 4],
    tx_mask: u32,
}

struct Frame {
    line: usize,
    first: u32,
    last: u32,
    loops: u32,
    frames: u32,
    period_s: f64,
}

/// A file's commands before they are put together.
struct Commands {
    file: PathBuf,
    channel: Option<(usize, u32, u32)>,
    adc: Option<(u32, u32)>,
    buffer: Option<(usize, u32, u32, u32)>,
    profiles: [Option<Profile>; 4],
    chirps: Vec<Option<Chirp>>,
    frame: Option<Frame>,
    bpm: Option<[u32; 3]>,
    lvds: Option<[u32; 3]>,
    others: Vec<String>,
}

impl Commands {
    fn new(file: &Path) -> Commands {
        Commands {
            file: file.to_path_buf(),
            channel: None,
            adc: None,
            buffer: None,
            profiles: [None, None, None, None],
            chirps: vec![None; MAX_CHIRPS],
            frame: None,
            bpm: None,
            lvds: None,
            others: Vec::new(),
        }
    }

    fn parse(file: &Path, text: &str) -> Result<Commands> {
        let mut c = Commands::new(file);
        for (i, raw) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let trimmed = raw.trim();
            if trimmed.is_empty() || trimmed.starts_with(['%', '#']) {
                continue;
            }
            let said = trimmed.split(['%', '#']).next().unwrap_or("").trim();
            let mut words = said.split_whitespace();
            let name = words.next().unwrap_or("");
            let line = Line { file, number: i + 1, name, words: words.collect() };
            c.command(&line, said)?;
        }
        Ok(c)
    }

    fn command(&mut self, l: &Line<'_>, said: &str) -> Result<()> {
        let masks = (1u32 << MAX_ANTENNAS) - 1;
        match l.name {
            // The device forgets what it was told before.
            "flushCfg" => *self = Commands::new(l.file),
            "sensorStop" | "sensorStart" => {}
            "dfeDataOutputMode" => {
                l.at_least(1, "mode")?;
                let mode = l.count(0, "mode", 1, 4)?;
                if mode != 1 {
                    return Err(l
                        .bad("only frames of chirps are read")
                        .value(mode)
                        .allowed("1")
                        .remedy("describe advanced frames in a radar TOML, or record one subframe")
                        .into());
                }
            }
            "channelCfg" => {
                l.at_least(2, "rx_mask tx_mask cascading")?;
                self.channel =
                    Some((l.number, l.count(0, "rx_mask", 1, masks)?, l.count(1, "tx_mask", 1, masks)?));
            }
            "adcCfg" => {
                l.at_least(2, "bits format")?;
                self.adc = Some((l.count(0, "bits", 0, 2)?, l.count(1, "format", 0, 3)?));
            }
            "adcbufCfg" => {
                // xWR14xx of SDK 1 and 2 has no index of the subframe.
                l.at_least(4, "[subframe] format sample_swap interleave threshold")?;
                let at = usize::from(l.words.len() > 4);
                self.buffer = Some((
                    l.number,
                    l.count(at, "format", 0, 1)?,
                    l.count(at + 1, "sample_swap", 0, 1)?,
                    l.count(at + 2, "interleave", 0, 1)?,
                ));
            }
            "profileCfg" => self.profile(l)?,
            "chirpCfg" => {
                l.at_least(8, "first last profile start_Hz slope_kHz/us idle_us adc_start_us tx_mask")?;
                let last_chirp = MAX_CHIRPS as u32 - 1;
                let first = l.count(0, "first", 0, last_chirp)?;
                let last = l.count(1, "last", first, last_chirp)?;
                let vary = |i, field, power| l.number(i, field, power, -1e12, 1e15);
                let chirp = Chirp {
                    line: l.number,
                    profile: l.count(2, "profile", 0, 3)?,
                    vary: [
                        vary(3, "start", 0)?,
                        vary(4, "slope", 9)?,
                        vary(5, "idle", -6)?,
                        vary(6, "adc_start", -6)?,
                    ],
                    tx_mask: l.count(7, "tx_mask", 0, masks)?,
                };
                for c in &mut self.chirps[first as usize..=last as usize] {
                    *c = Some(chirp.clone());
                }
            }
            "frameCfg" => {
                l.at_least(5, "first last loops frames period_ms trigger delay_ms")?;
                let first = l.count(0, "first", 0, MAX_CHIRPS as u32 - 1)?;
                self.frame = Some(Frame {
                    line: l.number,
                    first,
                    last: l.count(1, "last", first, MAX_CHIRPS as u32 - 1)?,
                    loops: l.count(2, "loops", 1, 65536)?,
                    frames: l.count(3, "frames", 0, 65535)?,
                    period_s: l.number(4, "period", -3, 1e-6, 100.0)?,
                });
            }
            "bpmCfg" => {
                l.at_least(2, "subframe on chirp0 chirp1")?;
                let on = l.count(1, "on", 0, 1)?;
                let chirp = |i: usize, field| {
                    if l.words.len() > i { l.count(i, field, 0, MAX_CHIRPS as u32 - 1) } else { Ok(0) }
                };
                self.bpm = Some([on, chirp(2, "chirp0")?, chirp(3, "chirp1")?]);
            }
            "lvdsStreamCfg" => {
                l.at_least(4, "subframe header format software")?;
                self.lvds = Some([
                    l.count(1, "header", 0, 1)?,
                    l.count(2, "format", 0, 10)?,
                    l.count(3, "software", 0, 1)?,
                ]);
            }
            _ => self.others.push(said.to_string()),
        }
        Ok(())
    }

    fn profile(&mut self, l: &Line<'_>) -> Result<()> {
        l.at_least(
            14,
            "id start_GHz idle_us adc_start_us ramp_end_us power_backoff phase_shifter slope_MHz/us \
             tx_start_us samples rate_ksps hpf1 hpf2 rx_gain",
        )?;
        let id = l.count(0, "id", 0, 3)? as usize;
        let slope = l.number(7, "slope", 12, -1e18, 1e18)?;
        if slope == 0.0 {
            return Err(l.bad("slope: a ramp of slope zero measures no range").value(l.words[7]).into());
        }
        self.profiles[id] = Some(Profile {
            line: l.number,
            radar: [
                l.number(1, "start", 9, 1e9, 1e12)?,
                slope,
                l.number(2, "idle", -6, 0.0, 1.0)?,
                l.number(3, "adc_start", -6, 0.0, 1.0)?,
                l.number(4, "ramp_end", -6, 1e-9, 1.0)?,
                l.number(8, "tx_start", -6, -1.0, 1.0)?,
                l.number(10, "rate", 3, 1.0, 1e11)?,
            ],
            samples: l.count(9, "samples", 2, 65536)?,
            backoff: l.count(5, "power_backoff", 0, 0x00ff_ffff)?,
            high_pass: [l.count(11, "hpf1", 0, 255)?, l.count(12, "hpf2", 0, 255)?],
            rx_gain: l.count(13, "rx_gain", 0, 65535)?,
        });
        Ok(())
    }

    fn missing(&self, command: &str) -> Error {
        BadInput::new(format!("has no {command}"))
            .file(&self.file)
            .remedy("give the .cfg with which the radar was run")
            .into()
    }

    fn at(&self, line: usize, key: &str, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(&self.file).line(line).key(key)
    }

    fn radar(self) -> Result<TiRadar> {
        let (channel_line, rx_mask, tx_mask) = self.channel.ok_or_else(|| self.missing("channelCfg"))?;
        let (bits, format) = self.adc.ok_or_else(|| self.missing("adcCfg"))?;
        if self.profiles.iter().all(Option::is_none) {
            return Err(self.missing("profileCfg"));
        }
        let frame = self.frame.as_ref().ok_or_else(|| self.missing("frameCfg"))?;
        let complex = format != 0;
        if let Some((line, buffer, ..)) = self.buffer
            && (buffer == 0) != complex
        {
            return Err(self
                .at(line, "adcbufCfg format", "contradicts adcCfg")
                .value(buffer)
                .allowed(if complex { "0: complex, as adcCfg says" } else { "1: real, as adcCfg says" })
                .into());
        }
        let (chirp, tx_masks) = self.frame_chirps(frame, channel_line, tx_mask)?;
        let profile = self.profiles[chirp.profile as usize].as_ref().ok_or_else(|| {
            let known: Vec<String> =
                (0..4).filter(|i| self.profiles[*i].is_some()).map(|i| i.to_string()).collect();
            self.at(chirp.line, "chirpCfg profile", "no such profileCfg")
                .value(chirp.profile)
                .allowed(known.join(", "))
        })?;
        let [start, slope, idle, adc_start, ramp_end, tx_start, rate] = profile.radar;
        let [d_start, d_slope, d_idle, d_adc] = chirp.vary;
        let (period, tx_masks) = smallest_period(tx_masks);
        let radar = TiRadar {
            start_hz: start + d_start,
            slope_hz_per_s: slope + d_slope,
            idle_s: idle + d_idle,
            adc_start_s: adc_start + d_adc,
            ramp_end_s: ramp_end,
            tx_start_s: tx_start,
            samples: profile.samples as usize,
            sample_rate_hz: rate,
            loops: frame.loops as usize * period,
            multiplex: self.multiplex(frame, &tx_masks)?,
            tx_masks,
            rx: (0..MAX_ANTENNAS).filter(|i| rx_mask >> i & 1 == 1).collect(),
            frames: (frame.frames > 0).then_some(frame.frames as usize),
            frame_period_s: frame.period_s,
            complex,
            image_band: format == 2,
            adc_bits: 12 + 2 * bits,
            iq_order: if self.buffer.is_some_and(|b| b.2 == 1) { IqOrder::Qi } else { IqOrder::Iq },
            interleaved: self.buffer.is_some_and(|b| b.3 == 0),
            power_backoff_db: {
                let [a, b, c, _] = profile.backoff.to_le_bytes();
                [a, b, c]
            },
            rx_gain: profile.rx_gain,
            high_pass: profile.high_pass,
            lvds: self.lvds,
            others: self.others.clone(),
        };
        self.timing(&radar, profile, frame)?;
        Ok(radar)
    }

    /// The shape that all chirps of the frame have, and who sends in each.
    fn frame_chirps(&self, frame: &Frame, channel_line: usize, tx_mask: u32) -> Result<(Chirp, Vec<u32>)> {
        let mut masks = Vec::new();
        let mut shape: Option<&Chirp> = None;
        for i in frame.first..=frame.last {
            let Some(c) = &self.chirps[i as usize] else {
                return Err(self
                    .at(frame.line, "frameCfg", format!("chirp {i} has no chirpCfg"))
                    .value(format!("{} {}", frame.first, frame.last))
                    .remedy(format!("add a chirpCfg for chirp {i} or change the frame's first and last"))
                    .into());
            };
            if c.tx_mask & !tx_mask != 0 || c.tx_mask == 0 {
                return Err(self
                    .at(c.line, "chirpCfg tx_mask", "sends from transmitters that are off, or from none")
                    .value(c.tx_mask)
                    .allowed(format!("bits of the mask {tx_mask} of channelCfg in line {channel_line}"))
                    .into());
            }
            let first = *shape.get_or_insert(c);
            if (first.profile, first.vary) != (c.profile, c.vary) {
                return Err(self
                    .at(c.line, "chirpCfg", "the chirps of the frame differ in more than their transmitter")
                    .remedy("only frames whose chirps have one shape make a cube")
                    .into());
            }
            masks.push(c.tx_mask);
        }
        let shape = shape.ok_or_else(|| self.missing("chirpCfg"))?;
        Ok((shape.clone(), masks))
    }

    fn multiplex(&self, frame: &Frame, masks: &[u32]) -> Result<Multiplex> {
        if let Some([1, chirp0, chirp1]) = self.bpm {
            let two = masks.iter().all(|m| m.count_ones() == 2);
            // Both chirps send the same two transmitters, so that the loop was taken as one chirp.
            if !two || frame.last - frame.first != 1 || [chirp0, chirp1] != [frame.first, frame.last] {
                return Err(BadInput::new("BPM is two transmitters together in the frame's two chirps")
                    .file(&self.file)
                    .key("bpmCfg")
                    .value(format!("-1 1 {chirp0} {chirp1}"))
                    .into());
            }
            return Ok(Multiplex::Bpm);
        }
        if masks.iter().any(|m| m.count_ones() > 1) {
            return Ok(Multiplex::Together);
        }
        for (i, m) in masks.iter().enumerate() {
            if masks[..i].contains(m) {
                return Err(self
                    .at(
                        frame.line,
                        "frameCfg",
                        format!("TX{} sends twice in a loop, not evenly", m.trailing_zeros() + 1),
                    )
                    .remedy("let each transmitter send once in a loop")
                    .into());
            }
        }
        Ok(Multiplex::Tdm)
    }

    fn timing(&self, r: &TiRadar, profile: &Profile, frame: &Frame) -> Result<()> {
        if !(r.adc_start_s >= 0.0 && r.idle_s >= 0.0 && r.start_hz > 0.0) || r.slope_hz_per_s == 0.0 {
            return Err(self.at(profile.line, "profileCfg", "chirpCfg takes its values below zero").into());
        }
        let end = r.adc_start_s + r.samples as f64 / r.sample_rate_hz;
        if end > r.ramp_end_s * (1.0 + 1e-9) {
            let fit = ((r.ramp_end_s - r.adc_start_s) * r.sample_rate_hz * (1.0 + 1e-9)).max(0.0) as u64;
            return Err(self
                .at(
                    profile.line,
                    "profileCfg samples",
                    format!(
                        "the samples end {} us after the ramp's start, but the ramp lasts {} us",
                        shifted(end, 6),
                        shifted(r.ramp_end_s, 6)
                    ),
                )
                .value(r.samples)
                .allowed(format!("at most {fit} samples here"))
                .into());
        }
        let active = r.chirp_period_s() * (r.loops * r.slots().max(1)) as f64;
        if active > r.frame_period_s * (1.0 + 1e-9) {
            return Err(self
                .at(frame.line, "frameCfg period", format!("the chirps take {:.6} ms", active * 1e3))
                .value(shifted(r.frame_period_s, 3))
                .allowed(format!("at least {:.6} ms", active * 1e3))
                .into());
        }
        Ok(())
    }
}

/// `masks` is some number of repetitions of a shorter list: that number, and the shortest such list. Two
/// chirps of BPM are alike in their masks and stay two.
fn smallest_period(masks: Vec<u32>) -> (usize, Vec<u32>) {
    let n = masks.len();
    for p in 1..n {
        if n % p == 0
            && (p..n).all(|i| masks[i] == masks[i - p])
            && masks[..p].iter().all(|m| m.count_ones() == 1)
        {
            return (n / p, masks[..p].to_vec());
        }
    }
    (1, masks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The demo's commands for an xWR1843 with three transmitters (SDK 3).
    const XWR18: &str = "% a comment\n\
        sensorStop\nflushCfg\ndfeDataOutputMode 1\nchannelCfg 15 7 0\nadcCfg 2 1\nadcbufCfg -1 0 1 1 1\n\
        profileCfg 0 77 429 7 57.14 0 0 70 1 256 5209 0 0 30\n\
        chirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 0 0 0 0 0 4\nchirpCfg 2 2 0 0 0 0 0 2\n\
        frameCfg 0 2 16 0 100 1 0\nlowPower 0 0 # kept\nguiMonitor -1 1 1 0 0 0 1\n\
        lvdsStreamCfg -1 0 1 0\nsensorStart\n";

    fn parsed(text: &str) -> TiRadar {
        TiRadar::parse("a.cfg", text).unwrap()
    }

    fn message(text: &str) -> String {
        let e = TiRadar::parse("a.cfg", text).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        let s = e.to_string();
        assert_eq!(s.lines().count(), 1, "{s}");
        assert!(s.starts_with("a.cfg:"), "{s}");
        s
    }

    #[test]
    fn the_demo_profile_in_si_units() {
        let r = parsed(XWR18);
        assert_eq!(r.start_hz, 77e9);
        assert_eq!(r.slope_hz_per_s, 70e12);
        assert_eq!(r.idle_s, 429e-6);
        assert_eq!(r.adc_start_s, 7e-6);
        assert_eq!(r.ramp_end_s, 57.14e-6);
        assert_eq!(r.tx_start_s, 1e-6);
        assert_eq!((r.samples, r.sample_rate_hz), (256, 5.209e6));
        assert_eq!((r.loops, r.tx_masks.as_slice()), (16, &[1, 4, 2][..]));
        assert_eq!((r.multiplex, r.frames, r.frame_period_s), (Multiplex::Tdm, None, 0.1));
        assert_eq!((r.rx.as_slice(), r.adc_bits), (&[0, 1, 2, 3][..], 16));
        assert!(r.complex && !r.image_band && !r.interleaved);
        assert_eq!((r.iq_order, r.lvds), (IqOrder::Qi, Some([0, 1, 0])));
        assert_eq!(r.others, ["lowPower 0 0", "guiMonitor -1 1 1 0 0 0 1"]);
        assert_eq!(r.shape(), [16, 12, 256]);
        // 77 GHz + 70 MHz/us * 57.14 us / 2 = 78.9999 GHz.
        assert!((r.carrier_hz() - 78.9999e9).abs() < 1.0);
    }

    #[test]
    fn other_generations_and_orders() {
        // xWR14xx: no subframe in adcbufCfg, channels together, real samples of 12 bits.
        let r = parsed(
            &XWR18.replace("adcbufCfg -1 0 1 1 1", "adcbufCfg 1 0 0 1").replace("adcCfg 2 1", "adcCfg 0 0"),
        );
        assert!(r.interleaved && !r.complex);
        assert_eq!((r.iq_order, r.adc_bits), (IqOrder::Iq, 12));
        // One transmitter in every chirp of the loop: as many chirps of one channel group.
        let one = XWR18.replace("0 0 0 0 4\n", "0 0 0 0 1\n").replace("0 0 0 0 2\n", "0 0 0 0 1\n");
        let r = parsed(&one);
        assert_eq!((r.loops, r.tx_masks.as_slice()), (48, &[1][..]));
        // Windows line ends, a byte-order mark, spaces.
        let r = parsed(&format!("\u{feff}{}", XWR18.replace('\n', "  \r\n")));
        assert_eq!(r, parsed(XWR18));
        // Later commands count, and flushCfg forgets.
        let r = parsed(&format!("profileCfg 1 60 1 1 1 0 0 1 1 2 9999 0 0 30\n{XWR18}"));
        assert_eq!(r, parsed(XWR18));
        // Variations of chirps are added.
        let r = parsed(&["1", "4", "2"].iter().fold(XWR18.to_string(), |t, tx| {
            t.replace(&format!("0 0 0 0 0 {tx}\n"), &format!("0 1000 0.5 1 0.5 {tx}\n"))
        }));
        assert_eq!(r.start_hz, 77e9 + 1e3);
        assert_eq!(r.slope_hz_per_s, 70e12 + 0.5e9);
        assert_eq!(r.idle_s, 429e-6 + 1e-6);
        assert_eq!(r.adc_start_s, 7e-6 + 0.5e-6);
    }

    const BPM: &str = "channelCfg 15 5 0\nadcCfg 2 1\nadcbufCfg -1 0 1 1 1\n\
        profileCfg 0 60 100 7 57 0 0 70 1 128 3000 0 0 30\nchirpCfg 0 1 0 0 0 0 0 5\n\
        frameCfg 0 1 32 10 100 1 0\nbpmCfg -1 1 0 1\n";

    #[test]
    fn bpm_is_told_from_tdm_and_separates() {
        let r = parsed(BPM);
        assert_eq!((r.multiplex, r.loops, r.slots(), r.frames), (Multiplex::Bpm, 32, 2, Some(10)));
        assert_eq!(parsed(&BPM.replace("bpmCfg -1 1", "bpmCfg -1 0")).multiplex, Multiplex::Together);
        assert!(message(&BPM.replace("bpmCfg -1 1 0 1", "bpmCfg -1 1 2 3")).contains("BPM is two"));
        let c = num_complex::Complex32::new;
        let (s1, s2) = (c(1.0, 2.0), c(-3.0, 0.5));
        let (mut a, mut b) = ([s1 + s2], [s1 - s2]);
        bpm_separate(&mut a, &mut b);
        assert_eq!((a[0], b[0]), (s1, s2));
    }

    #[test]
    fn what_is_written_reads_back() {
        for text in [XWR18, BPM, &XWR18.replace("adcCfg 2 1", "adcCfg 1 2").replace("0 1 1 1\n", "0 0 0 1\n")]
        {
            let a = parsed(text);
            let written = a.to_cfg();
            let mut b = parsed(&written);
            assert!(a.others.iter().all(|o| b.others.contains(o)), "{written}");
            b.others.clone_from(&a.others);
            b.lvds = a.lvds;
            assert_eq!(a, b);
            // The demo counts a command twice as a contradiction, except per direction or chirp.
            for name in ["guiMonitor", "lvdsStreamCfg", "bpmCfg", "lowPower"] {
                assert_eq!(written.lines().filter(|l| name_of(l) == name).count(), 1, "{name}: {written}");
            }
        }
    }

    #[test]
    fn mistakes_name_the_line() {
        for (from, to, expect) in [
            ("profileCfg 0 77 429 7 57.14 0 0 70 1 256 5209 0 0 30\n", "", "a.cfg: has no profileCfg"),
            ("channelCfg 15 7 0\n", "", "has no channelCfg"),
            ("adcCfg 2 1\n", "", "has no adcCfg"),
            ("frameCfg 0 2 16 0 100 1 0\n", "", "has no frameCfg"),
            ("chirpCfg 1 1 0", "chirpCfg 1 1 3", "differ in more than their transmitter"),
            ("chirpCfg 2 2 0 0 0 0 0 2\n", "", "a.cfg:11: frameCfg = 0 2: chirp 2 has no chirpCfg"),
            ("256 5209", "262 5209", "samples end 57.29"),
            ("256 5209", "262 5209", "allowed: at most 261 samples here"),
            ("16 0 100 1", "16 0 100000000 1", "allowed: 0.001..=100000"),
            ("16 0 100 1", "16 0 23 1", "allowed: at least 23.33"),
            ("channelCfg 15 7 0", "channelCfg 16 7 0", "a.cfg:5: channelCfg rx_mask = 16: is out of range"),
            ("channelCfg 15 7 0", "channelCfg 0 7 0", "channelCfg rx_mask = 0: is out of range"),
            ("channelCfg 15 7 0", "channelCfg 15 3 0", "bits of the mask 3 of channelCfg in line 5"),
            ("dfeDataOutputMode 1", "dfeDataOutputMode 3", "only frames of chirps are read"),
            ("0 77 429", "0 seventy 429", "profileCfg start = seventy: is not a number"),
            ("0 77 429", "0 nan 429", "profileCfg start = nan: is out of range; allowed: 1"),
            ("0 0 70 1", "0 0 0 1", "measures no range"),
            (" 0 0 30\n", "\n", "has too few numbers"),
            ("adcbufCfg -1 0", "adcbufCfg -1 1", "contradicts adcCfg"),
            ("256 5209", "256.5 5209", "samples is not a whole number"),
        ] {
            assert!(XWR18.contains(from));
            let e = message(&XWR18.replacen(from, to, 1));
            assert!(e.contains(expect), "{from} -> {to}: {e}");
        }
        let all = XWR18.replace(" 0 0 0 0 0 1\n", " 3 0 0 0 0 1\n");
        let all = all.replace(" 0 0 0 0 0 4\n", " 3 0 0 0 0 4\n").replace(" 0 0 0 0 0 2\n", " 3 0 0 0 0 2\n");
        let e = message(&all);
        assert!(e.contains("a.cfg:9: chirpCfg profile = 3: no such profileCfg; allowed: 0"), "{e}");
        let uneven = XWR18.replace("0 0 0 0 2\n", "0 0 0 0 1\n");
        assert!(message(&uneven).contains("TX1 sends twice"));
        assert_eq!(TiRadar::read("/nonexistent.cfg").unwrap_err().exit_code(), 2);
        assert_eq!(TiRadar::read("/").unwrap_err().exit_code(), 2);
        let f = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(f.path(), b"channelCfg \xff\n").unwrap();
        assert!(TiRadar::read(f.path()).unwrap_err().to_string().contains("UTF-8"));
        for (line, fine) in [("-1 0 1 0", true), ("-1 0 0 0", true), ("-1 1 1 0", false), ("-1 0 4 0", false)]
        {
            let r = parsed(&XWR18.replace("lvdsStreamCfg -1 0 1 0", &format!("lvdsStreamCfg {line}")));
            assert_eq!(r.check_plain_stream(Path::new("a.cfg")).is_ok(), fine, "{line}");
        }
    }

    #[test]
    fn decimals_move_without_rounding() {
        for (x, power, text) in [
            (77e9, -9, "77"),
            (57.14e-6, 6, "57.14"),
            (0.0, 6, "0"),
            (-1.5e-6, 6, "-1.5"),
            (1e-9, 6, "0.001"),
            (5.209e6, -3, "5209"),
        ] {
            assert_eq!(shifted(x, power), text);
        }
    }

    proptest! {
        #[test]
        fn any_number_survives(x in 1e-9f64..1e-2) {
            let text = shifted(x, 6);
            let line = Line { file: Path::new("x"), number: 1, name: "n", words: vec![&text] };
            prop_assert_eq!(line.number(0, "f", -6, 0.0, 1.0).unwrap(), x);
        }

        #[test]
        fn hostile_words_never_panic(at in 0usize..90, word in "[-0-9.e+a]{0,12}", cut in 0usize..500) {
            let mut words: Vec<String> = XWR18.split(' ').map(String::from).collect();
            let n = words.len();
            words[at % n] = word;
            let text = words.join(" ");
            for t in [text.as_str(), &text[..cut.min(text.len())]] {
                match TiRadar::parse("a.cfg", t) {
                    Ok(r) => prop_assert!(r.channels() > 0 && r.samples > 0),
                    Err(e) => prop_assert_eq!(e.to_string().lines().count(), 1),
                }
            }
        }
    }
}
