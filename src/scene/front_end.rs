//! The receiver's front end: what the TOML says of it, checked. Every effect may be left out, and then it
//! is off. What the effects do is in `adc/front_end/` (CONVENTIONS eq. 100-111).

use super::toml_file::{Above, At, Document};
use crate::base::error::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Phase noise of the oscillator that transmitters and mixers share.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseNoise {
    /// Distances from the carrier, rising, in Hz.
    pub offset_hz: Vec<f64>,
    /// L(f) there: noise in one sideband of 1 Hz over the carrier.
    pub dbc_per_hz: Vec<f64>,
}

/// Leakage from the transmitters into the receivers inside the radar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Leakage {
    /// Power of a transmitter over that of its leakage in a receiver.
    pub isolation_db: f64,
    /// Delay of the leakage, s.
    pub delay_s: f64,
}

/// A flat radome perpendicular to the boresight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bumper {
    /// |R|² of the cover, at most 0 dB.
    pub reflection_db: f64,
    /// Distance from the radar's phase centre along the boresight, m.
    pub distance_m: f64,
}

/// A Butterworth filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Butterworth {
    /// Order of the filter.
    pub order: usize,
    /// Cut-off frequency (half power), Hz.
    pub corner_hz: f64,
}

/// Filters between mixer and converter. Without a low-pass the ideal one of eq. 12 stands there.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Filters {
    /// Filter that takes low beat frequencies away.
    pub high_pass: Option<Butterworth>,
    /// Filter against aliases.
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Saturation {
    /// How it stops following.
    pub kind: SaturationKind,
    /// Power at the receiver's input of a tone that just reaches the limit A.
    pub full_scale_dbm: f64,
}

/// Quantiser characteristic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum QuantiserKind {
    /// Zero is an output value: kΔ for k in −2^(N−1)..2^(N−1).
    MidTread,
    /// Zero is a decision threshold: (k + ½)Δ for the same k.
    MidRise,
}

/// The converter: each of I and Q, or the real sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Adc {
    /// Bits of a sample.
    pub bits: u32,
    /// Power at the receiver's input of a tone that just fills the range.
    pub full_scale_dbm: f64,
    /// How levels are chosen.
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
    pub phase_noise: Option<PhaseNoiseTable>,
    /// Leakage from the transmitters into the receivers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leakage: Option<LeakageTable>,
    /// Radome: a flat cover in front of the antennas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bumper: Option<BumperTable>,
    /// High-pass filter of the beat signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high_pass: Option<FilterTable>,
    /// Anti-aliasing filter; default ideal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<FilterTable>,
    /// Saturation of the receiver's amplifiers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation: Option<SaturationTable>,
    /// Analogue-to-digital converter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adc: Option<AdcTable>,
    /// I/Q imbalance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iq_imbalance: Option<IqTable>,
    /// DC offset of the mixer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dc_offset: Option<DcTable>,
    /// Timing jitter of chirps and samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<JitterTable>,
    /// Gain, phase and position errors of the channels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<ChannelsTable>,
}

/// Phase noise of the oscillator that transmitters and mixers share.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseNoiseTable {
    /// Offset frequencies from the carrier in ascending order, Hz.
    pub offset_hz: At<Vec<f64>>,
    /// Single-sideband power in 1 Hz relative to the carrier, dBc/Hz, for each offset frequency; interpolated
    /// linearly over lg f, constant outside.
    pub dbc_per_hz: At<Vec<f64>>,
}

/// Leakage from the transmitters into the receivers inside the radar.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeakageTable {
    /// Ratio of transmit power to leakage power, dB.
    pub isolation_db: At<f64>,
    /// Delay of the leakage, s.
    #[serde(default)]
    pub delay_s: At<f64>,
}

/// A flat radome perpendicular to the boresight.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BumperTable {
    /// Power reflection coefficient, dB.
    pub reflection_db: At<f64>,
    /// Distance of the radome from the antennas, m.
    pub distance_m: At<f64>,
}

/// A Butterworth filter.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterTable {
    /// Order of the filter.
    pub order: At<usize>,
    /// Cut-off frequency (half power), Hz.
    pub corner_hz: At<f64>,
}

/// Saturation of the amplifiers of the intermediate frequency.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SaturationTable {
    /// Saturation curve: "soft" (tanh) or "hard" (clipping).
    pub kind: SaturationKind,
    /// Saturation power: input power of a tone whose amplitude reaches the limit, dBm.
    pub full_scale_dbm: At<f64>,
}

/// Analogue-to-digital converter.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdcTable {
    /// Resolution, bits per sample.
    pub bits: At<u32>,
    /// Full scale: input power of a tone that just fills the converter's range, dBm.
    pub full_scale_dbm: At<f64>,
    /// Quantiser: "mid-tread" (default: zero is an output value) or "mid-rise".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<QuantiserKind>,
}

/// I/Q imbalance of a quadrature mixer.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IqTable {
    /// Gain imbalance: amplitude of Q relative to I, dB.
    #[serde(default)]
    pub gain_db: At<f64>,
    /// Phase imbalance: lag of Q relative to quadrature, degrees.
    #[serde(default)]
    pub phase_deg: At<f64>,
}

/// DC offset of the mixer's output.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DcTable {
    /// Power of the offset, referred to the receiver's input, dBm.
    pub power_dbm: At<f64>,
    /// Phase of the offset, degrees: 0 is I, 90 is Q.
    #[serde(default)]
    pub angle_deg: At<f64>,
}

/// Timing jitter of chirps and samples.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JitterTable {
    /// RMS jitter of the sampling instants, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_rms_s: Option<At<f64>>,
    /// RMS jitter of the ramp starts relative to the converter's clock, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chirp_start_rms_s: Option<At<f64>>,
}

/// Channel errors, the same in all frames.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsTable {
    /// RMS gain error of each transmitter and of each receiver, dB.
    #[serde(default)]
    pub gain_rms_db: At<f64>,
    /// Standard deviation of the channel phases, degrees.
    #[serde(default)]
    pub phase_rms_deg: At<f64>,
    /// RMS error of each coordinate of each antenna position, m.
    #[serde(default)]
    pub position_rms_m: At<f64>,
    /// Seed of the random channel errors: each seed is another device of the series.
    #[serde(default)]
    pub seed: At<u64>,
    /// Gain of each channel (transmitter by transmitter), dB, added to the random errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain_db: Option<At<Vec<f64>>>,
    /// Phase of each channel, degrees, added to the random errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_deg: Option<At<Vec<f64>>>,
}

/// Checks a front end that was read as part of `doc`, of a radar with `channels` channels.
///
/// # Errors
/// Returns an error for the first value that is missing, unknown or outside its range, with file, line, key and remedy.
pub fn build(doc: &Document<'_>, t: &FrontEndTable, channels: usize) -> Result<FrontEndSettings> {
    let jitter = t.jitter.clone().unwrap_or_default();
    let seconds = |a: &Option<At<f64>>| -> Result<Option<f64>> {
        let Some(a) = a else { return Ok(None) };
        doc.in_range(a, Above { low: 0.0, high: 1e-6 }, "give seconds, as in 1e-12; leave it out for none")
            .map(Some)
    };
    let dbm = |a: &At<f64>| doc.in_range(a, -200.0..=100.0, "give dBm at the receiver's input, as in -30");
    Ok(FrontEndSettings {
        phase_noise: t.phase_noise.as_ref().map(|p| phase_noise(doc, p)).transpose()?,
        leakage: match &t.leakage {
            None => None,
            Some(l) => Some(Leakage {
                isolation_db: doc.in_range(&l.isolation_db, 0.0..=200.0, "decibels, positive, as in 30")?,
                delay_s: doc.in_range(&l.delay_s, 0.0..=1e-6, "give seconds, as in 0.2e-9")?,
            }),
        },
        bumper: match &t.bumper {
            None => None,
            Some(b) => Some(Bumper {
                reflection_db: doc.in_range(
                    &b.reflection_db,
                    -200.0..=0.0,
                    "decibels of power, negative, as in -15",
                )?,
                distance_m: doc.in_range(
                    &b.distance_m,
                    Above { low: 0.0, high: 10.0 },
                    "metres in front of the radar, as in 0.05",
                )?,
            }),
        },
        filters: Filters {
            high_pass: t.high_pass.as_ref().map(|f| filter(doc, f)).transpose()?,
            low_pass: t.low_pass.as_ref().map(|f| filter(doc, f)).transpose()?,
        },
        saturation: match &t.saturation {
            None => None,
            Some(s) => Some(Saturation { kind: s.kind, full_scale_dbm: dbm(&s.full_scale_dbm)? }),
        },
        adc: match &t.adc {
            None => None,
            Some(a) => Some(Adc {
                bits: doc.in_range(&a.bits, 1..=24, "bits of the converter, as in 12")?,
                full_scale_dbm: dbm(&a.full_scale_dbm)?,
                kind: a.kind.unwrap_or(QuantiserKind::MidTread),
            }),
        },
        aperture_jitter_rms_s: seconds(&jitter.aperture_rms_s)?,
        chirp_jitter_rms_s: seconds(&jitter.chirp_start_rms_s)?,
        iq: match &t.iq_imbalance {
            None => None,
            Some(i) => Some(IqImbalance {
                gain_db: doc.in_range(&i.gain_db, -20.0..=20.0, "decibels, as in 0.5")?,
                phase_rad: doc.in_range(&i.phase_deg, -89.0..=89.0, "degrees, as in 2")?.to_radians(),
            }),
        },
        dc: match &t.dc_offset {
            None => None,
            Some(d) => {
                let amplitude = crate::base::units::w_from_dbm(dbm(&d.power_dbm)?).sqrt();
                let angle = doc.in_range(&d.angle_deg, -360.0..=360.0, "degrees: 0 is I, 90 is Q")?;
                let (sin, cos) = angle.to_radians().sin_cos();
                Some(DcOffset { i: amplitude * cos, q: amplitude * sin })
            }
        },
        channels: t.channels.as_ref().map(|c| channel_errors(doc, c, channels)).transpose()?,
    })
}

fn phase_noise(doc: &Document<'_>, p: &PhaseNoiseTable) -> Result<PhaseNoise> {
    let (f, l) = (&p.offset_hz, &p.dbc_per_hz);
    if f.value.is_empty() || f.value.len() != l.value.len() {
        return Err(doc
            .bad(&l.span, format!("{} levels for {} offsets", l.value.len(), f.value.len()))
            .allowed("one for each of offset_hz, at least one")
            .remedy("give both lists with the same length")
            .into());
    }
    let rising = f.value.windows(2).all(|w| w[0] < w[1]);
    if !rising || !f.value.iter().all(|x| (1e-3..=1e12).contains(x)) {
        return Err(doc
            .bad(&f.span, "must rise")
            .allowed("1e-3..=1e12 Hz")
            .remedy("sort the offsets from the carrier outwards")
            .into());
    }
    if !l.value.iter().all(|x| (-250.0..=0.0).contains(x)) {
        return Err(doc
            .bad(&l.span, "is out of range")
            .allowed("-250..=0 dBc/Hz")
            .remedy("give one sideband over the carrier, as in -90")
            .into());
    }
    Ok(PhaseNoise { offset_hz: f.value.clone(), dbc_per_hz: l.value.clone() })
}

fn filter(doc: &Document<'_>, f: &FilterTable) -> Result<Butterworth> {
    Ok(Butterworth {
        order: doc.in_range(&f.order, 1..=16, "order of the filter, as in 4")?,
        corner_hz: doc.in_range(
            &f.corner_hz,
            Above { low: 0.0, high: 1e11 },
            "half-power frequency in hertz, as in 5e6",
        )?,
    })
}

fn channel_errors(doc: &Document<'_>, c: &ChannelsTable, channels: usize) -> Result<ChannelErrors> {
    let list = |l: &Option<At<Vec<f64>>>, limit: f64| -> Result<Vec<f64>> {
        let Some(l) = l else { return Ok(Vec::new()) };
        if l.value.len() != channels || l.value.iter().any(|x| x.is_nan() || x.abs() > limit) {
            return Err(doc
                .bad(&l.span, format!("{} values for {channels} channels", l.value.len()))
                .allowed(format!("{channels} values in -{limit}..={limit}"))
                .remedy("give one for each channel, all receivers of the first transmitter first")
                .into());
        }
        Ok(l.value.clone())
    };
    Ok(ChannelErrors {
        gain_rms_db: doc.in_range(&c.gain_rms_db, 0.0..=20.0, "decibels, as in 0.5")?,
        phase_rms_rad: doc.in_range(&c.phase_rms_deg, 0.0..=180.0, "degrees, as in 5")?.to_radians(),
        position_rms_m: doc.in_range(&c.position_rms_m, 0.0..=0.1, "metres, as in 50e-6")?,
        seed: c.seed.value,
        gain_db: list(&c.gain_db, 40.0)?,
        phase_rad: list(&c.phase_deg, 360.0)?.iter().map(|d| d.to_radians()).collect(),
    })
}

/// As it is written to a file: what is on.
impl From<&FrontEndSettings> for FrontEndTable {
    fn from(s: &FrontEndSettings) -> Self {
        let filter = |f: Butterworth| FilterTable { order: f.order.into(), corner_hz: f.corner_hz.into() };
        let jitter = JitterTable {
            aperture_rms_s: s.aperture_jitter_rms_s.map(At::from),
            chirp_start_rms_s: s.chirp_jitter_rms_s.map(At::from),
        };
        let is_on = |d: &DcOffset| d.i != 0.0 || d.q != 0.0;
        FrontEndTable {
            phase_noise: s.phase_noise.as_ref().map(|p| PhaseNoiseTable {
                offset_hz: p.offset_hz.clone().into(),
                dbc_per_hz: p.dbc_per_hz.clone().into(),
            }),
            leakage: s
                .leakage
                .map(|l| LeakageTable { isolation_db: l.isolation_db.into(), delay_s: l.delay_s.into() }),
            bumper: s.bumper.map(|b| BumperTable {
                reflection_db: b.reflection_db.into(),
                distance_m: b.distance_m.into(),
            }),
            high_pass: s.filters.high_pass.map(filter),
            low_pass: s.filters.low_pass.map(filter),
            saturation: s
                .saturation
                .map(|s| SaturationTable { kind: s.kind, full_scale_dbm: s.full_scale_dbm.into() }),
            adc: s.adc.map(|a| AdcTable {
                bits: a.bits.into(),
                full_scale_dbm: a.full_scale_dbm.into(),
                kind: Some(a.kind),
            }),
            iq_imbalance: s
                .iq
                .map(|i| IqTable { gain_db: i.gain_db.into(), phase_deg: i.phase_rad.to_degrees().into() }),
            dc_offset: s.dc.filter(is_on).map(|d| DcTable {
                power_dbm: crate::base::units::dbm_from_w(d.i * d.i + d.q * d.q).into(),
                angle_deg: d.q.atan2(d.i).to_degrees().into(),
            }),
            jitter: (s.aperture_jitter_rms_s.is_some() || s.chirp_jitter_rms_s.is_some()).then_some(jitter),
            channels: s.channels.as_ref().map(|c| {
                let list = |l: &[f64]| (!l.is_empty()).then(|| l.to_vec().into());
                let degrees: Vec<f64> = c.phase_rad.iter().map(|p| p.to_degrees()).collect();
                ChannelsTable {
                    gain_rms_db: c.gain_rms_db.into(),
                    phase_rms_deg: c.phase_rms_rad.to_degrees().into(),
                    position_rms_m: c.position_rms_m.into(),
                    seed: c.seed.into(),
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

    #[derive(Deserialize)]
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
            ("[-80, -100]", "[-80]", "1 levels for 2 offsets"),
            ("[-80, -100]", "[-80, 3]", "-250..=0"),
            ("[1e4, 1e6]", "[1e6, 1e4]", "must rise"),
            ("[1e4, 1e6]", "[0, 1e4]", "1e-3..=1e12"),
            ("[1e4, 1e6]", "[nan, 1e4]", "must rise"),
            ("order = 5", "order = 0", "front_end.low_pass.order = 0"),
            ("corner_hz = 6e6", "corner_hz = 0", "front_end.low_pass.corner_hz"),
            ("isolation_db = 30", "isolation_db = -30", "positive"),
            ("reflection_db = -15", "reflection_db = 15", "-200..=0"),
            ("distance_m = 0.05", "distance_m = inf", "distance_m"),
            ("kind = \"soft\"", "kind = \"sof\"", "did you mean 'soft'?"),
            ("aperture_rms_s = 1e-12", "aperture_rms_s = 1", "as in 1e-12"),
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
