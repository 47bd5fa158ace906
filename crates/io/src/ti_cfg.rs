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

use catseye::base::error::{BadInput, Error, Result};
use catseye::scene::radar::Radar;
use std::fmt::Write as _;
use std::path::Path;

/// How the transmitters share the chirps of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Multiplex {
    /// One transmitter in each chirp, each once per loop.
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
    /// In-phase part first (`sample_swap` 0).
    Iq,
    /// Quadrature part first (`sample_swap` 1, which the SDK's demo uses).
    Qi,
}

/// The radar that a `.cfg` describes. All chirps of a frame have one shape.
#[derive(Debug, Clone, PartialEq)]
pub struct TiRadar {
    /// Frequency at the start of the ramp, Hz.
    pub start_hz: f64,
    /// Slope of the ramp, Hz/s, negative for a falling ramp.
    pub slope_hz_per_s: f64,
    /// Time from the end of a ramp to the start of the next, s.
    pub idle_s: f64,
    /// Time from the start of the ramp to the first sample, s.
    pub adc_start_s: f64,
    /// Duration of the ramp, s.
    pub ramp_end_s: f64,
    /// Time at which the transmitter is switched on, from the start of the ramp, s; negative is before it.
    pub tx_start_s: f64,
    /// Number of samples of one chirp.
    pub samples: usize,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Number of repetitions of the chirps of `tx_masks` in a frame.
    pub loops: usize,
    /// Transmitters (bit 0 is TX1) of each chirp of a loop, in order.
    pub tx_masks: Vec<u32>,
    /// How transmitters share the time.
    pub multiplex: Multiplex,
    /// Receivers that are on, counted from 0, ascending.
    pub rx: Vec<u32>,
    /// Number of frames; `None` runs until it is stopped.
    pub frames: Option<usize>,
    /// Time from frame to frame, s.
    pub frame_period_s: f64,
    /// Whether samples have I and Q; otherwise they are real.
    pub complex: bool,
    /// Whether the image band is kept ("complex 2x").
    pub image_band: bool,
    /// Number of bits of a sample: 12, 14 or 16.
    pub adc_bits: u32,
    /// Which of I and Q comes first.
    pub iq_order: IqOrder,
    /// Whether all receivers of a sample stand together (xWR14xx), rather than one receiver's chirp after
    /// another.
    pub interleaved: bool,
    /// Output power of TX1, TX2, TX3 below the largest, dB.
    pub power_backoff_db: [u8; 3],
    /// Receiver gain as in `profileCfg`: bits 0 to 5 are the gain in dB.
    pub rx_gain: u32,
    /// Corner codes of the two high-pass filters, as in `profileCfg`.
    pub high_pass: [u32; 2],
    /// Values `[header, format, software]` of `lvdsStreamCfg`.
    pub lvds: Option<[u32; 3]>,
    /// Commands that do not concern the samples, as they stood.
    pub others: Vec<String>,
    /// Phase shifters of TX1, TX2, TX3 as in `profileCfg`: in each byte bits 2 to 7, in steps of 5.625 degrees.
    pub phase_shifter: u32,
    /// Platform or device, where the file names it, as in `xWR68xx_AOP`.
    pub device: Option<String>,
    /// Where the antennas are, where the recording's sidecar has it.
    pub antennas: Option<Antennas>,
}

/// Positions `[forward, left, up]` of transmitters in the order of sending, and of receivers, in half wavelengths of the carrier.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Antennas {
    /// Transmitters.
    pub tx: Vec<[f64; 3]>,
    /// Receivers.
    pub rx: Vec<[f64; 3]>,
}

impl TiRadar {
    /// Number of chirps of a loop.
    pub fn slots(&self) -> usize {
        self.tx_masks.len()
    }

    /// Number of rows of samples in a loop: chirps times receivers, the chirp running slower. With TDM these
    /// are the virtual channels.
    pub fn channels(&self) -> usize {
        self.slots() * self.rx.len()
    }

    /// Shape `[chirp, rx_virtual, sample]` of one frame.
    pub fn shape(&self) -> [usize; 3] {
        [self.loops, self.channels(), self.samples]
    }

    /// Time from the start of one chirp to the start of the next, s.
    pub fn chirp_period_s(&self) -> f64 {
        self.idle_s + self.ramp_end_s
    }

    /// Frequency at the middle of the ramp, Hz.
    pub fn carrier_hz(&self) -> f64 {
        self.start_hz + 0.5 * self.slope_hz_per_s * self.ramp_end_s
    }

    /// Text of a `.cfg` with the commands that the mmWave SDK's demo (release 3) needs before it starts.
    /// Commands of `others` replace the demo's defaults. It reads back with the same numbers.
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
            "profileCfg 0 {} {} {} {} {} {} {} {} {} {} {} {} {}",
            shifted(self.start_hz, -9),
            shifted(self.idle_s, 6),
            shifted(self.adc_start_s, 6),
            shifted(self.ramp_end_s, 6),
            u32::from_le_bytes([b0, b1, b2, 0]),
            self.phase_shifter,
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
            let own = name == "lvdsStreamCfg" && self.lvds.is_some();
            if !(said || own) {
                line(format_args!("{default}"));
            }
        }
        for other in &self.others {
            line(format_args!("{other}"));
        }
        line(format_args!("sensorStart"));
        out
    }

    /// Checks that a stream over LVDS holds only plain samples.
    ///
    /// # Errors
    /// Returns `BadInput` for headers, chirp-quality words or the software's own stream.
    pub fn check_plain_stream(&self, cfg: &Path) -> Result<()> {
        let Some([header, format, software]) = self.lvds else { return Ok(()) };
        if header != 0 || format > 1 || software != 0 {
            return Err(BadInput::new("the recording contains data other than samples")
                .file(cfg)
                .key("lvdsStreamCfg")
                .value(format!("-1 {header} {format} {software}"))
                .allowed("-1 0 1 0: samples without headers")
                .remedy("record again with that line")
                .into());
        }
        Ok(())
    }

    /// Checks that a radar that was named for the recording is the one that the `.cfg` describes.
    ///
    /// # Errors
    /// Returns `BadInput` with both values for a slope, sample rate, chirp period, start frequency or delay of the samples that differ.
    pub fn check_agrees(&self, cfg: &Path, radar: &Radar) -> Result<()> {
        // Without the rounding errors of products.
        let short = |x: f64| (x * 1e6).round() / 1e6;
        let compared = [
            ("slope", self.slope_hz_per_s, radar.slope_hz_per_s(), 1e-3, 1e-12, "MHz/us"),
            ("sample rate", self.sample_rate_hz, radar.sample_rate_hz, 1e-3, 1e-3, "ksps"),
            ("chirp period", self.chirp_period_s(), radar.chirp_period_s(), 1e-3, 1e6, "us"),
            ("start frequency", self.start_hz, radar.start_hz(), 1e-3, 1e-9, "GHz"),
        ];
        for (what, own, named, share, scale, unit) in compared {
            if (own - named).abs() > share * own.abs() {
                return Err(BadInput::new(format!("the radar of --radar has another {what} than the .cfg"))
                    .file(cfg)
                    .key(format!("profileCfg {what}"))
                    .value(format!("{} {unit} of --radar", short(named * scale)))
                    .allowed(format!("{} {unit}, as in the .cfg", short(own * scale)))
                    .remedy("leave out --radar, or correct it")
                    .into());
            }
        }
        // Range rates and angles go by the frequency at the samples: it may differ by as much as the start frequency.
        let off_hz = self.slope_hz_per_s * (radar.adc_start_s - self.adc_start_s);
        if off_hz.abs() > 1e-3 * self.start_hz {
            return Err(BadInput::new("the radar of --radar samples at another time than the .cfg")
                .file(cfg)
                .key("profileCfg adc_start")
                .value(format!("{} us of --radar", short(radar.adc_start_s * 1e6)))
                .allowed(format!("{} us, as in the .cfg", short(self.adc_start_s * 1e6)))
                .remedy("leave out --radar, or correct it")
                .into());
        }
        Ok(())
    }

    /// What its radar rests on beside the file's commands, one line each; `board` is the one that the user names.
    pub fn assumptions(&self, board: Option<Board>) -> Vec<String> {
        let mut lines = Vec::new();
        if board.is_none() && self.antennas.is_none() {
            let board = Board::assumed(self);
            let place = match board {
                Board::Line => "on a filled line in the order of transmission".to_string(),
                _ => format!("where the board {} has them", board.name()),
            };
            let reason = match &self.device {
                Some(device) if board == Board::Line => {
                    format!("the board of the platform '{device}' is not known")
                }
                Some(device) => format!("the file names the platform '{device}'"),
                None => "the .cfg does not name the board".into(),
            };
            lines.push(format!("assumed: antennas {place}, for {reason} (--board NAME, or --radar FILE)"));
        }
        if self.phase_shifter != 0 {
            lines.push(format!(
                "not used: phase shifters of the transmitters (profileCfg phase_shifter {}); directions are \
                    correct only with a calibration",
                self.phase_shifter
            ));
        }
        let compensation = self.others.iter().find(|o| name_of(o) == "compRangeBiasAndRxChanPhase");
        if let Some(line) = compensation.filter(|l| compensates(l)) {
            lines.push(format!(
                "not used: {}; ranges and directions are without this compensation",
                line.chars().take(100).collect::<String>()
            ));
        }
        lines
    }

    /// Text of a catseye radar, whose `carrier_hz` is the centre of the ramp. Antennas are those of `board`, else those of the recording's
    /// sidecar, else those of [`Board::assumed`].
    ///
    /// # Errors
    /// Returns `BadInput` for a falling ramp, for transmitters that send together, which need a radar TOML of their own, and for an
    /// antenna that the board does not have.
    pub fn to_radar_toml(&self, name: &str, board: Option<Board>) -> Result<String> {
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
                "transmitters transmit simultaneously",
            ));
        }
        let tx: Vec<u32> = self.tx_masks.iter().map(|m| m.trailing_zeros()).collect();
        let power = POWER_DBM
            - tx.iter()
                .map(|t| f64::from(*self.power_backoff_db.get(*t as usize).unwrap_or(&0)))
                .fold(f64::INFINITY, f64::min);
        let (note, places) = match (board, &self.antennas) {
            (None, Some(own)) => {
                let counts = [own.tx.len(), own.rx.len()];
                if counts != [tx.len(), self.rx.len()] {
                    return Err(BadInput::new("the recording's sidecar has other antennas than its .cfg")
                        .key("antennas")
                        .value(format!("{} tx, {} rx", counts[0], counts[1]))
                        .allowed(format!("{} tx, {} rx", tx.len(), self.rx.len()))
                        .remedy("name the board of the recording with --board")
                        .into());
                }
                ("as the recording's sidecar has them", [own.tx.clone(), own.rx.clone()])
            }
            (board, _) => {
                let board = board.unwrap_or_else(|| Board::assumed(self));
                (board.note(), board.antennas(&tx, self)?)
            }
        };
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
            note,
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
        for (table, places) in ["tx", "rx"].into_iter().zip(places) {
            for [x, y, z] in places {
                let _ = write!(out, "\n[[{table}]]\nposition_half_wavelengths = [{x:?}, {y:?}, {z:?}]\n");
            }
        }
        Ok(out)
    }
}

/// Largest output power of one transmitter of the first-generation devices, dBm (TI, sensing estimator: 12
/// dBm).
const POWER_DBM: f64 = 12.0;
/// Noise figure as TI's engineers calculate it for the AWR1243, dB (E2E 870322: 14 dB, −160 dBm/Hz).
const NOISE_FIGURE_DB: f64 = 14.0;

/// Board of a device, which says where the antennas are. Transmitters and receivers that a `.cfg` switches off are left out, and the
/// others stand where they are on the board, in the order in which they send.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Receivers half a wavelength apart; transmitters, in their order of sending, spaced by the length of
    /// all receivers together, so that the virtual array is a filled line.
    Line,
    /// TX3 four half wavelengths beside TX1, TX2 halfway between them and one half wavelength higher (TI SPRUIM4, "PCB Antennas").
    Awr1843,
    /// The same places for λ at 62 GHz (TI SWRU585, IWR6843L EVM, section 4.1).
    Iwr6843,
    /// Antennas on the package, in two dimensions (TI SWRS237; `gAntDef_IWR6843AOP` of the mmWave SDK 3).
    Iwr6843Aop,
}

/// Boards by name.
pub const BOARDS: [(&str, Board); 4] = [
    ("awr1843", Board::Awr1843),
    ("iwr6843", Board::Iwr6843),
    ("iwr6843aop", Board::Iwr6843Aop),
    ("line", Board::Line),
];

/// Place of an antenna, left and up, in half wavelengths.
type Places = &'static [[f64; 2]];

impl Board {
    /// Frequency whose half wavelength is the spacing of [`Board::Iwr6843`], Hz.
    const IWR6843_DESIGN_HZ: f64 = 62e9;
    /// Carriers below this are of the 60 GHz devices, Hz.
    const LOW_BAND_HZ: f64 = 70e9;

    /// The board that is assumed where the user names none: that of the platform or device that the file names, a line where its board is not
    /// known, else one for each band.
    pub fn assumed(radar: &TiRadar) -> Board {
        let Some(device) = &radar.device else {
            return if radar.carrier_hz() < Board::LOW_BAND_HZ { Board::Iwr6843 } else { Board::Awr1843 };
        };
        let device = device.to_ascii_lowercase();
        let is_aop = device.contains("aop");
        let is = |families: [&str; 2]| families.iter().any(|f| device.contains(f));
        match () {
            () if is(["68xx", "6843"]) && is_aop => Board::Iwr6843Aop,
            () if is(["68xx", "6843"]) => Board::Iwr6843,
            () if is(["18xx", "1843"]) && !is_aop => Board::Awr1843,
            () => Board::Line,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        BOARDS.iter().find(|(_, b)| *b == self).map_or("line", |(name, _)| name)
    }

    fn note(self) -> &'static str {
        match self {
            Board::Line => "a filled half-wavelength line in the order of transmission",
            Board::Awr1843 => "AWR1843BOOST (TI SPRUIM4)",
            Board::Iwr6843 => "IWR6843 evaluation module (TI SWRU585, section 4.1), spacings for 62 GHz",
            Board::Iwr6843Aop => "IWR6843AOP (TI SWRS237)",
        }
    }

    /// Transmitters TX1, TX2, ... and receivers RX1, RX2, ... of the board; None for a line, which has as many as are on.
    fn places(self) -> Option<(Places, Places)> {
        const ROW: Places = &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]];
        match self {
            Board::Line => None,
            Board::Awr1843 | Board::Iwr6843 => Some((&[[0.0, 0.0], [2.0, 1.0], [4.0, 0.0]], ROW)),
            Board::Iwr6843Aop => Some((
                &[[-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]],
                &[[0.5, -0.5], [0.5, 0.5], [-0.5, -0.5], [-0.5, 0.5]],
            )),
        }
    }

    /// Positions of the transmitters in their `order` of sending, and of the receivers, `[forward, left, up]` in half wavelengths of the
    /// carrier.
    fn antennas(self, order: &[u32], radar: &TiRadar) -> Result<[Vec<[f64; 3]>; 2]> {
        let Some((tx, rx)) = self.places() else {
            let line = |n: usize, step: usize| (0..n).map(|i| [0.0, (i * step) as f64, 0.0]).collect();
            return Ok([line(order.len(), radar.rx.len()), line(radar.rx.len(), 1)]);
        };
        let scale = match self {
            Board::Iwr6843 => radar.carrier_hz() / Board::IWR6843_DESIGN_HZ,
            _ => 1.0,
        };
        let chosen = |what: &str, key: &str, list: &[u32], places: Places| {
            let place = |i: &u32| {
                let p = places.get(*i as usize).ok_or_else(|| {
                    BadInput::new(format!("the board {} has no {what}{}", self.name(), i + 1))
                        .key(key)
                        .value(format!("{what}{}", i + 1))
                        .allowed(format!("{what}1 to {what}{}", places.len()))
                        .remedy("name the board of the recording with --board")
                })?;
                Ok([0.0, p[0] * scale, p[1] * scale])
            };
            list.iter().map(place).collect::<Result<Vec<_>>>()
        };
        Ok([chosen("TX", "chirpCfg tx_mask", order, tx)?, chosen("RX", "channelCfg rx_mask", &radar.rx, rx)?])
    }
}

/// Separates two transmitters of BPM: on return `a` holds (a + b)/2 and `b` (a − b)/2, the echoes of the
/// first and of the second (TI SWRA554, section 4.2). It is exact for what is stationary; the phase of a
/// moving target turns by f_d times the chirp period between the two.
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

/// Commands without which the demo does not start (release 3), with the values of its own sample profiles;
/// the last but one keep every range and speed in its field of view.
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

/// Whether a line of `compRangeBiasAndRxChanPhase` changes anything: a bias that is not 0, or a factor that is not 1.
fn compensates(line: &str) -> bool {
    let numbers: Vec<f64> = line.split_whitespace().skip(1).filter_map(|w| w.parse().ok()).collect();
    let Some((bias, factors)) = numbers.split_first() else { return false };
    *bias != 0.0 || factors.chunks_exact(2).any(|f| f != [1.0, 0.0])
}

fn name_of(line: &str) -> &str {
    line.split_whitespace().next().unwrap_or("")
}

/// The shortest decimal that reads back as `x`, with its point moved by `power` places: exact both ways.
pub(super) fn shifted(x: f64, power: i32) -> String {
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

/// A TOML float: the shortest that reads back the same, rounded to fifteen digits to remove rounding errors
/// of sums.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.14e}").parse().unwrap_or(x);
    if rounded == 0.0 { "0.0".into() } else { format!("{rounded:e}") }
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

    /// Every number of the commands that concern samples changes the radar, or is refused, or has a reason here why it need not.
    #[test]
    fn no_number_is_passed_over() {
        // xWR18 with values that can be raised and lowered.
        let text = "channelCfg 7 7 0\nadcCfg 1 1\nadcbufCfg -1 0 1 1 1\n\
            profileCfg 0 77 429 7 57.14 1 4 70 1 256 5209 1 1 30\n\
            chirpCfg 0 0 0 10 0.5 1 0.5 1\nchirpCfg 1 1 0 10 0.5 1 0.5 4\n\
            frameCfg 0 1 16 8 100 1 0\nbpmCfg -1 0 0 1\nlvdsStreamCfg -1 0 1 0\n";
        let first = parsed(text);
        let same = [
            ("adcbufCfg", 1, "only one subframe is read, whichever its index"),
            ("adcbufCfg", 5, "chirps that are buffered together: the order of the words is the same"),
            ("chirpCfg", 2, "chirps beyond are set by the next line, or not sent"),
            ("frameCfg", 6, "what starts a frame"),
            ("frameCfg", 7, "time from that to the first chirp"),
            ("bpmCfg", 1, "the subframe"),
            ("bpmCfg", 3, "BPM is off"),
            ("bpmCfg", 4, "BPM is off"),
            ("lvdsStreamCfg", 1, "the subframe"),
        ];
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            for at in 1..words.len() {
                let number: f64 = words[at].parse().unwrap();
                let changed = [number + 1.0, (number - 1.0).abs(), number * 2.0];
                let differs = changed.iter().filter(|x| **x != number).all(|x| {
                    let mut other = words.clone();
                    let x = x.to_string();
                    other[at] = &x;
                    let changed = text.replace(line, &other.join(" "));
                    TiRadar::parse("a.cfg", &changed).map_or(true, |r| r != first)
                });
                let excused = same.iter().any(|(name, i, _)| *name == words[0] && *i == at);
                assert_eq!(differs, !excused, "{line}: number {at}");
            }
        }
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
        assert!(
            message(&BPM.replace("bpmCfg -1 1 0 1", "bpmCfg -1 1 2 3")).contains("BPM needs the same two")
        );
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
            (
                "profileCfg 0 77 429 7 57.14 0 0 70 1 256 5209 0 0 30\n",
                "",
                "a.cfg: the file has no profileCfg",
            ),
            ("channelCfg 15 7 0\n", "", "the file has no channelCfg"),
            ("adcCfg 2 1\n", "", "the file has no adcCfg"),
            ("frameCfg 0 2 16 0 100 1 0\n", "", "the file has no frameCfg"),
            ("chirpCfg 1 1 0", "chirpCfg 1 1 3", "differ in more than their transmitter"),
            ("chirpCfg 2 2 0 0 0 0 0 2\n", "", "a.cfg:11: frameCfg = 0 2: chirp 2 has no chirpCfg"),
            ("256 5209", "262 5209", "samples end 57.29"),
            ("256 5209", "262 5209", "allowed: at most 261 samples here"),
            ("16 0 100 1", "16 0 100000000 1", "allowed: 0.001..=100000"),
            ("16 0 100 1", "16 0 23 1", "allowed: at least 23.33"),
            ("channelCfg 15 7 0", "channelCfg 16 7 0", "a.cfg:5: channelCfg rx_mask = 16: is out of range"),
            ("channelCfg 15 7 0", "channelCfg 0 7 0", "channelCfg rx_mask = 0: is out of range"),
            ("channelCfg 15 7 0", "channelCfg 15 3 0", "bits of the mask 3 of channelCfg in line 5"),
            ("dfeDataOutputMode 1", "dfeDataOutputMode 3", "only frames of chirps are supported"),
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
        assert!(message(&uneven).contains("TX1 transmits twice"));
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
