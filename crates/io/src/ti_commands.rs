//! The commands of a `.cfg`, read line by line and combined to a [`TiRadar`].

use super::ti_cfg::{IqOrder, Multiplex, TiRadar, shifted};
use catseye::base::error::{BadInput, Error, Result};
use std::path::{Path, PathBuf};

/// Number of chirps that the devices can distinguish (`chirpCfg`, mmWave interface control document).
const MAX_CHIRPS: usize = 512;
/// Largest number of receivers, and of transmitters, of one device.
const MAX_ANTENNAS: u32 = 4;

impl TiRadar {
    /// Parses the radar of a text; `file` is named in errors.
    ///
    /// # Errors
    /// Returns an error with the line for a command that is unknown, missing, or has other arguments.
    pub fn parse(file: impl AsRef<Path>, text: &str) -> Result<TiRadar> {
        let file = file.as_ref();
        let lines: Vec<&str> = text.trim_start_matches('\u{feff}').lines().collect();
        let mut radar = Commands::parse(file, lines.iter().enumerate().map(|(i, l)| (i + 1, *l)))?.radar()?;
        radar.device = lines.iter().find_map(|l| platform(l));
        Ok(radar)
    }
}

/// Commands that only the low-power devices have (TI, xWRL6432 and xWRL1432, mmWave low power SDK 5).
const LOW_POWER_COMMANDS: [&str; 8] = [
    "chirpComnCfg",
    "chirpTimingCfg",
    "sigProcChainCfg",
    "factoryCalibCfg",
    "adcDataSource",
    "antGeometryCfg",
    "lowPowerCfg",
    "apllFreqShiftEn",
];

/// The platform that a comment of TI's visualizer names, as in `% Platform:xWR68xx_AOP`.
fn platform(line: &str) -> Option<String> {
    let comment = line.trim().strip_prefix(['%', '#'])?.trim_start_matches(['%', '#', ' ', '\t']);
    let (key, value) = comment.split_once(':')?;
    let value = value.split_whitespace().next()?;
    ["platform", "device"].iter().any(|k| key.trim().eq_ignore_ascii_case(k)).then(|| value.to_string())
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

    /// The number at position `i`, times ten to the power `power`, without rounding twice.
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

/// The beginning of a line, enough to recognise it.
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
    phase_shifter: u32,
    high_pass: [u32; 2],
    rx_gain: u32,
}

#[derive(Clone, PartialEq)]
struct Chirp {
    line: usize,
    profile: u32,
    /// Start, slope, idle and ADC start, which are added to the profile's.
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

/// A file's commands before they are combined.
pub(super) struct Commands {
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

    /// Reads commands from lines with their numbers.
    pub(super) fn parse<'a>(
        file: &Path,
        lines: impl Iterator<Item = (usize, &'a str)> + Clone,
    ) -> Result<Commands> {
        let mut c = Commands::new(file);
        // Commands of one name differ between the families, so that this comes before any of them is read.
        for (number, raw) in lines.clone() {
            let name = raw.split_whitespace().next().unwrap_or("");
            if LOW_POWER_COMMANDS.contains(&name) {
                return Err(BadInput::new(
                    "is a command of xWRL devices (xWRL1432, xWRL6432), whose recordings are not supported",
                )
                .file(file)
                .line(number)
                .key(name)
                .allowed("commands of the mmWave SDK 1 to 3: xWR14xx, xWR16xx, xWR18xx, xWR68xx")
                .remedy("describe the radar in a TOML file and give its samples as .npy with --radar")
                .into());
            }
        }
        for (number, raw) in lines {
            let trimmed = raw.trim();
            if trimmed.is_empty() || trimmed.starts_with(['%', '#']) {
                continue;
            }
            let said = trimmed.split(['%', '#']).next().unwrap_or("").trim();
            let mut words = said.split_whitespace();
            let name = words.next().unwrap_or("");
            let line = Line { file, number, name, words: words.collect() };
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
                        .bad("only frames of chirps are supported")
                        .value(mode)
                        .allowed("1")
                        .remedy("describe advanced frames in a radar TOML, or record one subframe")
                        .into());
                }
            }
            "channelCfg" => {
                l.at_least(2, "rx_mask tx_mask cascading")?;
                if l.words.len() > 2 && l.count(2, "cascading", 0, 2)? != 0 {
                    return Err(l
                        .bad("cascading: recordings of several devices are not supported")
                        .value(clipped(l.words[2]))
                        .allowed("0")
                        .remedy("describe the radar in a TOML file and give its samples as .npy with --radar")
                        .into());
                }
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
            phase_shifter: l.count(6, "phase_shifter", 0, 0x00ff_ffff)?,
            high_pass: [l.count(11, "hpf1", 0, 255)?, l.count(12, "hpf2", 0, 255)?],
            rx_gain: l.count(13, "rx_gain", 0, 65535)?,
        });
        Ok(())
    }

    fn missing(&self, command: &str) -> Error {
        BadInput::new(format!("the file has no {command}"))
            .file(&self.file)
            .remedy("give the .cfg with which the radar was run")
            .into()
    }

    fn at(&self, line: usize, key: &str, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).file(&self.file).line(line).key(key)
    }

    /// The radar that the commands describe together.
    pub(super) fn radar(self) -> Result<TiRadar> {
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
            phase_shifter: profile.phase_shifter,
            device: None,
            antennas: None,
        };
        self.timing(&radar, profile, frame)?;
        Ok(radar)
    }

    /// The shape that all chirps of the frame have, and the transmitters of each.
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
                    .at(c.line, "chirpCfg tx_mask", "the mask selects transmitters that are off, or none")
                    .value(c.tx_mask)
                    .allowed(format!("bits of the mask {tx_mask} of channelCfg in line {channel_line}"))
                    .into());
            }
            let first = *shape.get_or_insert(c);
            if (first.profile, first.vary) != (c.profile, c.vary) {
                return Err(self
                    .at(c.line, "chirpCfg", "the chirps of the frame differ in more than their transmitter")
                    .remedy("give all chirps of the frame the same profile and offsets")
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
                return Err(BadInput::new("BPM needs the same two transmitters in both chirps of the frame")
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
                        format!("TX{} transmits twice in a loop at uneven intervals", m.trailing_zeros() + 1),
                    )
                    .remedy("let each transmitter transmit once in a loop")
                    .into());
            }
        }
        Ok(Multiplex::Tdm)
    }

    fn timing(&self, r: &TiRadar, profile: &Profile, frame: &Frame) -> Result<()> {
        if !(r.adc_start_s >= 0.0 && r.idle_s >= 0.0 && r.start_hz > 0.0) || r.slope_hz_per_s == 0.0 {
            return Err(self
                .at(profile.line, "profileCfg", "the offsets of chirpCfg make its values negative")
                .into());
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

/// Finds how often `masks` repeats a shorter list: that number, and the shortest such list. Two chirps of BPM
/// have equal masks and stay two.
fn smallest_period(masks: Vec<u32>) -> (usize, Vec<u32>) {
    let n = masks.len();
    for p in 1..n {
        if n.is_multiple_of(p)
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

    proptest! {
        #[test]
        fn any_number_survives(x in 1e-9f64..1e-2) {
            let text = shifted(x, 6);
            let line = Line { file: Path::new("x"), number: 1, name: "n", words: vec![&text] };
            prop_assert_eq!(line.number(0, "f", -6, 0.0, 1.0).unwrap(), x);
        }
    }
}
