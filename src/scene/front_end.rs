//! The receiver's front end: the keys of the radar file with their bounds. An effect that is left out is
//! off. What the effects do is in `adc/front_end/` (CONVENTIONS eq. 100-111).

use super::toml_file::{At, Document};
use crate::base::error::Result;
use crate::base::units::{dbm_from_w, w_from_dbm};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Phase noise of the oscillator that transmitters and mixers share.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseNoise {
    /// Offset frequencies from the carrier in ascending order, Hz.
    #[schemars(length(min = 1), inner(range(min = 1e-3, max = 1e12)))]
    pub offset_hz: Vec<f64>,
    /// Single-sideband power in 1 Hz relative to the carrier, dBc/Hz, for each offset frequency; interpolated
    /// linearly over lg f, constant outside.
    #[schemars(length(min = 1), inner(range(min = -250.0, max = 0.0)))]
    pub dbc_per_hz: Vec<f64>,
}

/// Leakage from the transmitters into the receivers inside the radar.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Leakage {
    /// Ratio of transmit power to leakage power, dB.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub isolation_db: f64,
    /// Delay of the leakage, s.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e-6))]
    pub delay_s: f64,
}

/// A flat radome perpendicular to the boresight.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bumper {
    /// Power reflection coefficient, dB.
    #[schemars(range(min = -200.0, max = 0.0))]
    pub reflection_db: f64,
    /// Distance of the radome from the antennas, m.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub distance_m: f64,
}

/// A Butterworth filter.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Butterworth {
    /// Order of the filter.
    #[schemars(range(min = 1, max = 16))]
    pub order: usize,
    /// Cut-off frequency (half power), Hz.
    #[schemars(range(max = 1e11), extend("exclusiveMinimum" = 0.0))]
    pub corner_hz: f64,
}

/// Filters between mixer and converter. Without a low-pass the ideal one of eq. 12 is used.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Filters {
    /// Filter that attenuates low beat frequencies.
    pub high_pass: Option<Butterworth>,
    /// Anti-aliasing filter.
    pub low_pass: Option<Butterworth>,
}

/// Saturation curve of an amplifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SaturationKind {
    /// A tanh(x / A).
    Soft,
    /// Clipping: x up to ±A.
    Hard,
}

/// Saturation of the amplifiers of the intermediate frequency.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Saturation {
    /// Saturation curve: "soft" (tanh) or "hard" (clipping).
    pub kind: SaturationKind,
    /// Saturation power: input power of a tone whose amplitude reaches the limit, dBm.
    #[schemars(range(min = -200.0, max = 100.0))]
    pub full_scale_dbm: f64,
}

/// Quantiser characteristic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum QuantiserKind {
    /// Zero is an output value: kΔ for k in −2^(N−1)..2^(N−1).
    #[default]
    MidTread,
    /// Zero is a decision threshold: (k + ½)Δ for the same k.
    MidRise,
}

/// Analogue-to-digital converter, for each of I and Q, or for the real sample.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adc {
    /// Resolution, bits per sample.
    #[schemars(range(min = 1, max = 24))]
    pub bits: u32,
    /// Full scale: input power of a tone that just fills the converter's range, dBm.
    #[schemars(range(min = -200.0, max = 100.0))]
    pub full_scale_dbm: f64,
    /// Quantiser: "mid-tread" (zero is an output value) or "mid-rise".
    #[serde(default)]
    pub kind: QuantiserKind,
}

/// Errors of a mixer with two outputs. Real sampling has but one, so they do nothing there.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct IqImbalance {
    /// Amplitude of Q over that of I.
    pub gain_db: f64,
    /// How far Q lags behind its quarter of a turn.
    pub phase_rad: f64,
}

/// A constant that the mixer adds, √W at the receiver's input.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct DcOffset {
    /// Constant in I, √W.
    pub i: f64,
    /// Constant in Q, √W.
    pub q: f64,
}

/// Random or given errors of the channels, the same in all frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ChannelErrors {
    /// Standard deviations of each transmitter and of each receiver.
    pub gain_rms_db: f64,
    /// Standard deviation of the channels' phases, rad.
    pub phase_rms_rad: f64,
    /// Standard deviation of each coordinate of each antenna.
    pub position_rms_m: f64,
    /// Seed of the draws above; other devices of one design have other seeds.
    pub seed: u64,
    /// Gain error of each channel, dB, on top of what is drawn; empty for none.
    pub gain_db: Vec<f64>,
    /// Phase of each channel, rad.
    pub phase_rad: Vec<f64>,
}

/// Settings of the whole front end; what is None is ideal.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrontEndSettings {
    /// Phase noise of the oscillator.
    pub phase_noise: Option<PhaseNoise>,
    /// Leakage from the transmitters into the receivers.
    pub leakage: Option<Leakage>,
    /// Radome: a flat cover in front of the antennas.
    pub bumper: Option<Bumper>,
    /// Filters between mixer and converter.
    pub filters: Filters,
    /// Saturation of the receiver's amplifiers.
    pub saturation: Option<Saturation>,
    /// Analogue-to-digital converter.
    pub adc: Option<Adc>,
    /// Standard deviation of the instants at which samples are taken.
    pub aperture_jitter_rms_s: Option<f64>,
    /// Standard deviation of the instants at which ramps start, against the converter's clock.
    pub chirp_jitter_rms_s: Option<f64>,
    /// I/Q imbalance.
    pub iq: Option<IqImbalance>,
    /// DC offset of the mixer.
    pub dc: Option<DcOffset>,
    /// Gain, phase and position errors of the channels.
    pub channels: Option<ChannelErrors>,
}

/// Front-end impairments. All keys are optional; without its key, a component is ideal.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrontEndTable {
    /// Phase noise of the oscillator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_noise: Option<At<PhaseNoise>>,
    /// Leakage from the transmitters into the receivers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leakage: Option<At<Leakage>>,
    /// Radome: a flat cover in front of the antennas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bumper: Option<At<Bumper>>,
    /// High-pass filter of the beat signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high_pass: Option<At<Butterworth>>,
    /// Anti-aliasing filter; default ideal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<At<Butterworth>>,
    /// Saturation of the receiver's amplifiers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation: Option<Saturation>,
    /// Analogue-to-digital converter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adc: Option<Adc>,
    /// I/Q imbalance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iq_imbalance: Option<IqTable>,
    /// DC offset of the mixer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_offset: Option<DcTable>,
    /// Timing jitter of chirps and samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<At<JitterTable>>,
    /// Gain, phase and position errors of the channels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<ChannelsTable>,
}

/// I/Q imbalance of a quadrature mixer.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IqTable {
    /// Gain imbalance: amplitude of Q relative to I, dB.
    #[serde(default)]
    #[schemars(range(min = -20.0, max = 20.0))]
    pub gain_db: f64,
    /// Phase imbalance: lag of Q relative to quadrature, degrees.
    #[serde(default)]
    #[schemars(range(min = -89.0, max = 89.0))]
    pub phase_deg: f64,
}

/// DC offset of the mixer's output.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DcTable {
    /// Power of the offset, referred to the receiver's input, dBm.
    #[schemars(range(min = -200.0, max = 100.0))]
    pub power_dbm: f64,
    /// Phase of the offset, degrees: 0 is I, 90 is Q.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub angle_deg: f64,
}

/// Timing jitter of chirps and samples.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JitterTable {
    /// RMS jitter of the sampling instants, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e-6), extend("exclusiveMinimum" = 0.0))]
    pub aperture_rms_s: Option<f64>,
    /// RMS jitter of the ramp starts relative to the converter's clock, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e-6), extend("exclusiveMinimum" = 0.0))]
    pub chirp_start_rms_s: Option<f64>,
}

/// Channel errors, the same in all frames.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsTable {
    /// RMS gain error of each transmitter and of each receiver, dB.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub gain_rms_db: f64,
    /// Standard deviation of the channel phases, degrees.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 180.0))]
    pub phase_rms_deg: f64,
    /// RMS error of each coordinate of each antenna position, m.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.1))]
    pub position_rms_m: f64,
    /// Seed of the random channel errors: each seed is another device of the series.
    #[serde(default)]
    pub seed: u64,
    /// Gain of each channel (transmitter by transmitter), dB, added to the random errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -40.0, max = 40.0)))]
    pub gain_db: Option<At<Vec<f64>>>,
    /// Phase of each channel, degrees, added to the random errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -360.0, max = 360.0)))]
    pub phase_deg: Option<At<Vec<f64>>>,
}

/// Checks a front end that was read as part of `doc`, of a radar with `channels` channels.
///
/// # Errors
/// Returns an error for lists that do not have the same length, do not ascend or do not fit the channels, with file, line, key
/// and remedy. The bounds of single values are those of the schema, which [`Document::read`] has checked.
pub fn build(doc: &Document<'_>, t: &FrontEndTable, channels: usize) -> Result<FrontEndSettings> {
    if let Some(p) = &t.phase_noise {
        check_phase_noise(doc, p)?;
    }
    let jitter = t.jitter.as_ref().map(|j| j.value.clone()).unwrap_or_default();
    Ok(FrontEndSettings {
        phase_noise: t.phase_noise.as_ref().map(|p| p.value.clone()),
        leakage: t.leakage.as_ref().map(|l| l.value),
        bumper: t.bumper.as_ref().map(|b| b.value),
        filters: Filters {
            high_pass: t.high_pass.as_ref().map(|f| f.value),
            low_pass: t.low_pass.as_ref().map(|f| f.value),
        },
        saturation: t.saturation,
        adc: t.adc,
        aperture_jitter_rms_s: jitter.aperture_rms_s,
        chirp_jitter_rms_s: jitter.chirp_start_rms_s,
        iq: (t.iq_imbalance.as_ref())
            .map(|i| IqImbalance { gain_db: i.gain_db, phase_rad: i.phase_deg.to_radians() }),
        dc: t.dc_offset.as_ref().map(|d| {
            let amplitude = w_from_dbm(d.power_dbm).sqrt();
            let (sin, cos) = d.angle_deg.to_radians().sin_cos();
            DcOffset { i: amplitude * cos, q: amplitude * sin }
        }),
        channels: t.channels.as_ref().map(|c| channel_errors(doc, c, channels)).transpose()?,
    })
}

fn check_phase_noise(doc: &Document<'_>, p: &At<PhaseNoise>) -> Result<()> {
    let PhaseNoise { offset_hz, dbc_per_hz } = &p.value;
    if offset_hz.len() != dbc_per_hz.len() {
        return Err(doc
            .bad(
                &p.span,
                format!("has {} values for {} offset frequencies", dbc_per_hz.len(), offset_hz.len()),
            )
            .allowed("one value of dbc_per_hz for each of offset_hz")
            .remedy("give both lists with the same length")
            .into());
    }
    if !offset_hz.windows(2).all(|w| w[0] < w[1]) {
        return Err(doc
            .bad(&p.span, "offset_hz is not in ascending order")
            .remedy("sort the offset frequencies, the smallest first")
            .into());
    }
    Ok(())
}

fn channel_errors(doc: &Document<'_>, c: &ChannelsTable, channels: usize) -> Result<ChannelErrors> {
    let list = |l: &Option<At<Vec<f64>>>| -> Result<Vec<f64>> {
        let Some(l) = l else { return Ok(Vec::new()) };
        if l.value.len() != channels {
            return Err(doc
                .bad(&l.span, format!("has {} values for {channels} channels", l.value.len()))
                .allowed(format!("{channels} values"))
                .remedy("give one value for each channel, all receivers of the first transmitter first")
                .into());
        }
        Ok(l.value.clone())
    };
    Ok(ChannelErrors {
        gain_rms_db: c.gain_rms_db,
        phase_rms_rad: c.phase_rms_deg.to_radians(),
        position_rms_m: c.position_rms_m,
        seed: c.seed,
        gain_db: list(&c.gain_db)?,
        phase_rad: list(&c.phase_deg)?.iter().map(|d| d.to_radians()).collect(),
    })
}

/// As it is written to a file: what is not ideal.
impl From<&FrontEndSettings> for FrontEndTable {
    fn from(s: &FrontEndSettings) -> Self {
        let jitter =
            JitterTable { aperture_rms_s: s.aperture_jitter_rms_s, chirp_start_rms_s: s.chirp_jitter_rms_s };
        let is_on = |d: &DcOffset| d.i != 0.0 || d.q != 0.0;
        FrontEndTable {
            phase_noise: s.phase_noise.clone().map(At::from),
            leakage: s.leakage.map(At::from),
            bumper: s.bumper.map(At::from),
            high_pass: s.filters.high_pass.map(At::from),
            low_pass: s.filters.low_pass.map(At::from),
            saturation: s.saturation,
            adc: s.adc,
            iq_imbalance: (s.iq).map(|i| IqTable { gain_db: i.gain_db, phase_deg: i.phase_rad.to_degrees() }),
            dc_offset: s.dc.filter(is_on).map(|d| DcTable {
                power_dbm: dbm_from_w(d.i * d.i + d.q * d.q),
                angle_deg: d.q.atan2(d.i).to_degrees(),
            }),
            jitter: (jitter != JitterTable::default()).then(|| jitter.into()),
            channels: s.channels.as_ref().map(|c| {
                let list = |l: &[f64]| (!l.is_empty()).then(|| l.to_vec().into());
                let degrees: Vec<f64> = c.phase_rad.iter().map(|p| p.to_degrees()).collect();
                ChannelsTable {
                    gain_rms_db: c.gain_rms_db,
                    phase_rms_deg: c.phase_rms_rad.to_degrees(),
                    position_rms_m: c.position_rms_m,
                    seed: c.seed,
                    gain_db: list(&c.gain_db),
                    phase_deg: list(&degrees),
                }
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct File {
        #[serde(default)]
        front_end: FrontEndTable,
    }

    fn read(text: &str) -> Result<FrontEndSettings> {
        let doc = Document::parse("r.toml", text)?;
        build(&doc, &doc.read::<File>()?.front_end, 2)
    }

    const ALL: &str = r#"
[front_end.phase_noise]
offset_hz = [1e4, 1e6]
dbc_per_hz = [-80, -100]
[front_end.leakage]
isolation_db = 30
delay_s = 0.2e-9
[front_end.bumper]
reflection_db = -15
distance_m = 0.05
[front_end.high_pass]
order = 2
corner_hz = 300e3
[front_end.low_pass]
order = 5
corner_hz = 6e6
[front_end.saturation]
kind = "soft"
full_scale_dbm = -20
[front_end.adc]
bits = 12
full_scale_dbm = -20
kind = "mid-rise"
[front_end.iq_imbalance]
gain_db = 0.5
phase_deg = 2
[front_end.dc_offset]
power_dbm = -60
angle_deg = 90
[front_end.jitter]
aperture_rms_s = 1e-12
chirp_start_rms_s = 1e-10
[front_end.channels]
gain_rms_db = 0.5
phase_rms_deg = 5
position_rms_m = 1e-5
seed = 7
gain_db = [0, 1]
phase_deg = [0, 180]
"#;

    #[test]
    fn nothing_is_said_and_nothing_is_done() {
        assert_eq!(read("").unwrap(), FrontEndSettings::default());
    }

    #[test]
    fn everything_is_read_in_si() {
        let s = read(ALL).unwrap();
        assert_eq!(s.phase_noise.unwrap().dbc_per_hz, [-80.0, -100.0]);
        assert_eq!(s.leakage, Some(Leakage { isolation_db: 30.0, delay_s: 0.2e-9 }));
        assert_eq!(s.filters.low_pass, Some(Butterworth { order: 5, corner_hz: 6e6 }));
        assert_eq!(s.adc.unwrap().kind, QuantiserKind::MidRise);
        assert!((s.iq.unwrap().phase_rad - 2f64.to_radians()).abs() < 1e-15);
        let dc = s.dc.unwrap();
        assert!((dc.q - 1e-9f64.sqrt()).abs() < 1e-18 && dc.i.abs() < 1e-18, "{dc:?}");
        let c = s.channels.unwrap();
        assert_eq!((c.seed, c.gain_db, c.phase_rad[1]), (7, vec![0.0, 1.0], std::f64::consts::PI));
        assert_eq!((s.aperture_jitter_rms_s, s.chirp_jitter_rms_s), (Some(1e-12), Some(1e-10)));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let once = read(ALL).unwrap();
        let text = |s: &FrontEndSettings| {
            let lines = toml::to_string(&FrontEndTable::from(s)).unwrap();
            lines.replace('[', "[front_end.").replace("= [front_end.", "= [")
        };
        let twice = read(&text(&once)).unwrap();
        // Degrees and decibels may cost a last place; the rest is the same to the bit.
        let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
        near(once.dc.unwrap().q, twice.dc.unwrap().q);
        near(once.iq.unwrap().phase_rad, twice.iq.unwrap().phase_rad);
        let (a, b) = (once.channels.clone().unwrap(), twice.channels.clone().unwrap());
        near(a.phase_rms_rad, b.phase_rms_rad);
        let plain = |s: FrontEndSettings| FrontEndSettings { dc: None, iq: None, channels: None, ..s };
        assert_eq!(plain(once), plain(twice));
        assert_eq!(read(&text(&FrontEndSettings::default())).unwrap(), FrontEndSettings::default());
        assert!(a.gain_db == b.gain_db && a.seed == b.seed && a.position_rms_m == b.position_rms_m);
    }

    #[test]
    fn every_key_is_checked() {
        for (from, to, says) in [
            ("bits = 12", "bits = 0", "r.toml:21: front_end.adc.bits = 0: is out of range; allowed: 1..=24"),
            ("bits = 12", "bits = 99", "allowed: 1..=24"),
            ("bits = 12", "bitz = 12", "did you mean 'bits'?"),
            ("[-80, -100]", "[-80]", "1 values for 2 offset frequencies"),
            (
                "[-80, -100]",
                "[-80, 3]",
                "front_end.phase_noise.dbc_per_hz[1] = 3: is out of range; allowed: -250..=0",
            ),
            (
                "[1e4, 1e6]",
                "[1e6, 1e4]",
                "r.toml:2: front_end.phase_noise: offset_hz is not in ascending order",
            ),
            ("[1e4, 1e6]", "[0, 1e4]", "offset_hz[0] = 0: is out of range; allowed: 0.001..=1e12"),
            ("[1e4, 1e6]", "[nan, 1e4]", "offset_hz[0] = nan: is out of range"),
            ("order = 5", "order = 0", "front_end.low_pass.order = 0"),
            ("corner_hz = 6e6", "corner_hz = 0", "front_end.low_pass.corner_hz"),
            (
                "isolation_db = 30",
                "isolation_db = -30",
                "allowed: 0..=200; ratio of transmit power to leakage power, dB",
            ),
            ("reflection_db = -15", "reflection_db = 15", "-200..=0"),
            ("distance_m = 0.05", "distance_m = inf", "distance_m"),
            ("kind = \"soft\"", "kind = \"sof\"", "did you mean 'soft'?"),
            ("aperture_rms_s = 1e-12", "aperture_rms_s = 1", "allowed: more than 0, at most 1e-6"),
            ("gain_db = [0, 1]", "gain_db = [0, 1, 2]", "3 values for 2 channels"),
            ("phase_deg = 2", "phase_deg = 90", "-89..=89"),
            ("power_dbm = -60", "power_dbm = nan", "dc_offset.power_dbm"),
        ] {
            assert!(ALL.contains(from), "{from}");
            let e = read(&ALL.replace(from, to)).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(says), "{to}: {e}");
        }
    }
}
