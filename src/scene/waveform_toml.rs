//! `[waveform]` of a radar file: keys and checks.

use super::radar::Sampling;
use super::toml_file::{Above, At, Document, read_beside};
use super::waveform::{Multiplex, PulseShape, Ramp, RampOrder, Slopes, Waveform, m_sequence};
use crate::base::error::{BadInput, Result};
use crate::formats::csv::Table;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Waveforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WaveformName {
    /// FMCW: `bandwidth_hz` and `ramp_time_s`, or one `[[waveform.ramp]]` for each chirp type.
    #[default]
    Fmcw,
    /// Stepped frequency, one sample per tone: `step_hz`.
    SteppedFrequency,
    /// Impulse radio: `bandwidth_hz` of a Gaussian pulse, or `pulse_file`.
    Pulse,
    /// Phase-modulated continuous wave: `chip_rate_hz` and `code_degree` or `code`.
    Pmcw,
}

/// Order in which the chirps of several chirp types are transmitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RampOrderName {
    /// Chirp types interleaved: one chirp of each per loop.
    InTurn,
    /// All chirps of one type before those of the next.
    Bursts,
}

/// Multiplexing of the transmitters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MultiplexName {
    /// Time-division multiplexing: one transmitter after another.
    Tdm,
    /// Binary phase modulation: all transmitters at once, coded with the signs of a Hadamard matrix.
    Bpm,
    /// Doppler-division multiplexing: all transmitters at once, each in its own Doppler band.
    Ddm,
}

/// Sampling of the received signal.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReceiverTable {
    /// "iq": complex samples, N range cells for N samples; "real": real samples, N/2 range cells.
    pub sampling: Sampling,
    /// Sample rate, Hz.
    #[schemars(range(max = 1e11), extend("exclusiveMinimum" = 0.0))]
    pub sample_rate_hz: At<f64>,
    /// Number of samples of one chirp.
    #[schemars(range(min = 2, max = 65_536))]
    pub samples: At<usize>,
    /// Time from the start of the ramp to the first sample, s.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub adc_start_s: f64,
    /// Noise figure, dB.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub noise_figure_db: f64,
    /// true: thermal noise is added.
    #[serde(default = "yes")]
    pub thermal_noise: bool,
}

fn yes() -> bool {
    true
}

/// Transmitted waveform.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaveformTable {
    /// Waveform.
    #[serde(default)]
    pub kind: At<WaveformName>,
    /// Centre frequency of the sweep or band, Hz.
    #[schemars(range(min = 1e8, max = 3e12))]
    pub carrier_hz: At<f64>,
    /// "fmcw": bandwidth swept during `ramp_time_s`, Hz, negative for a falling ramp. "pulse": full width of
    /// the Gaussian pulse's spectrum at -10 dB, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<At<f64>>,
    /// "fmcw": duration of a ramp, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub ramp_time_s: Option<At<f64>>,
    /// Time from the start of one chirp, tone sequence, pulse or code to the start of the next, s, for any
    /// transmitter.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub chirp_period_s: Option<At<f64>>,
    /// "fmcw": several interleaved chirp types, in place of `bandwidth_hz`, `ramp_time_s` and `chirp_period_s`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub ramp: Vec<RampTable>,
    /// With several [[waveform.ramp]]: "in-turn" (default) interleaves the chirp types, one chirp of each per
    /// loop; "bursts" transmits all chirps of one type before those of the next. Bursts of one slope with
    /// different `chirp_period_s` (staggered repetition) resolve range rates that are ambiguous within one
    /// burst.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp_order: Option<At<RampOrderName>>,
    /// "stepped-frequency": step between adjacent tones, Hz; the number of tones equals the number of samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_hz: Option<At<f64>>,
    /// "pulse": CSV file, relative to the radar file, with the header time_s,re,im: the complex envelope at
    /// equidistant times, in place of `bandwidth_hz`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulse_file: Option<At<String>>,
    /// "pulse": samples of the complex envelope [re, im, re, im, ...], in order of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulse_samples: Option<At<Vec<f64>>>,
    /// "pulse": sample rate of `pulse_samples`, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub pulse_rate_hz: Option<At<f64>>,
    /// "pulse": index of the sample of `pulse_samples` that is transmitted at time zero, counted from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulse_zero: Option<At<usize>>,
    /// "pmcw": chip rate, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chip_rate_hz: Option<At<f64>>,
    /// "pmcw": degree of a maximum-length sequence of 2^degree - 1 chips.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 16))]
    pub code_degree: Option<At<u32>>,
    /// "pmcw": the code, an odd number of chips 1 and -1, in place of `code_degree`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1, max = 1)))]
    pub code: Option<At<Vec<i8>>>,
    /// Number of chirps in a frame for each chirp type and each transmitter slot.
    #[schemars(range(min = 1, max = 65_536))]
    pub chirps: At<usize>,
    /// Multiplexing of the transmitters; default "tdm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiplex: Option<At<MultiplexName>>,
    /// "ddm": number of Doppler bands without a transmitter; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 64))]
    pub empty_bands: Option<At<usize>>,
}

/// One of several chirp types.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RampTable {
    /// Bandwidth swept during `ramp_time_s`, Hz, negative for a falling ramp.
    pub bandwidth_hz: At<f64>,
    /// Duration of the ramp, s.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub ramp_time_s: At<f64>,
    /// Time from the start of this ramp to the start of the next ramp, s.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub chirp_period_s: At<f64>,
}

/// The waveform and how transmitters share it.
///
/// # Errors
/// Returns an error for keys that are missing, belong to another kind or contradict each other.
pub fn build(
    doc: &Document<'_>,
    w: &WaveformTable,
    r: &ReceiverTable,
    transmitters: usize,
) -> Result<(Waveform, Multiplex)> {
    let carrier_hz = w.carrier_hz.value;
    only(doc, w)?;
    let period = || need(doc, w, &w.chirp_period_s, "chirp_period_s", "as in 55e-6").map(|p| p.value);
    let waveform = match w.kind.value {
        WaveformName::Fmcw => {
            let ramps = match w.ramp.is_empty() {
                true => vec![ramp(
                    doc,
                    need(doc, w, &w.bandwidth_hz, "bandwidth_hz", "as in 1e9")?,
                    need(doc, w, &w.ramp_time_s, "ramp_time_s", "as in 40e-6")?,
                    need(doc, w, &w.chirp_period_s, "chirp_period_s", "as in 55e-6")?,
                    carrier_hz,
                    r,
                )?],
                false => w
                    .ramp
                    .iter()
                    .map(|t| ramp(doc, &t.bandwidth_hz, &t.ramp_time_s, &t.chirp_period_s, carrier_hz, r))
                    .collect::<Result<Vec<_>>>()?,
            };
            let order = match &w.ramp_order {
                Some(o) if ramps.len() < 2 => {
                    return Err(doc
                        .bad(&o.span, "a single ramp has no order")
                        .remedy("remove ramp_order or give a [[waveform.ramp]] for each burst")
                        .into());
                }
                Some(o) if o.value == RampOrderName::Bursts => RampOrder::Bursts,
                _ => RampOrder::InTurn,
            };
            Waveform::Fmcw(Slopes { ramps, this: 0, order })
        }
        WaveformName::SteppedFrequency => {
            let at = need(doc, w, &w.step_hz, "step_hz", "as in 2e6")?;
            let step_hz =
                doc.in_range(at, -carrier_hz..=carrier_hz, "from one tone to the next, as in 2e6")?;
            let band = step_hz.abs() * r.samples.value as f64;
            if band < LEAST_BANDWIDTH_HZ || band >= carrier_hz {
                let each = |band: f64| band / r.samples.value as f64;
                return Err(doc
                    .bad(&at.span, "steps of this size give no bandwidth or reach zero frequency")
                    .allowed(format!("{:e} <= |step| < {:e}", each(LEAST_BANDWIDTH_HZ), each(carrier_hz)))
                    .into());
            }
            let period_s = period()?;
            fits(doc, w, r, period_s, "the tones")?;
            Waveform::Stepped { step_hz, period_s }
        }
        WaveformName::Pulse => {
            let shape = pulse(doc, w)?;
            let (rate, half) = (r.sample_rate_hz.value, shape.half_band_hz());
            if half >= carrier_hz {
                return Err(doc
                    .bad(
                        &w.carrier_hz.span,
                        format!("the pulse's band of +-{half:.3e} Hz reaches zero frequency"),
                    )
                    .allowed(format!("half bands below {carrier_hz:e} Hz"))
                    .remedy("raise the carrier or take a narrower pulse")
                    .into());
            }
            let fits_rate = match r.sampling {
                super::radar::Sampling::Iq => 2.0 * half <= rate * (1.0 + 1e-9),
                super::radar::Sampling::Real => carrier_hz + half <= 0.5 * rate * (1.0 + 1e-9),
            };
            if !fits_rate {
                let least = match r.sampling {
                    super::radar::Sampling::Iq => 2.0 * half,
                    super::radar::Sampling::Real => 2.0 * (carrier_hz + half),
                };
                return Err(doc
                    .bad(&r.sample_rate_hz.span, "does not cover the pulse's band down to -140 dB")
                    .allowed(format!("{least:.4e} or more here"))
                    .remedy("sample faster or take a narrower pulse")
                    .into());
            }
            let period_s = period()?;
            fits(doc, w, r, period_s, "the samples")?;
            Waveform::Pulse { shape, period_s }
        }
        WaveformName::Pmcw => {
            let at = need(doc, w, &w.chip_rate_hz, "chip_rate_hz", "as in 1e9")?;
            let chip_rate_hz = doc.in_range(at, LEAST_BANDWIDTH_HZ..=carrier_hz, "chips a second")?;
            let code = code(doc, w)?;
            let rate = r.sample_rate_hz.value;
            let want = code.len() as f64 * rate / chip_rate_hz;
            if rate < chip_rate_hz * (1.0 - 1e-12)
                || (want - want.round()).abs() > 1e-6
                || want.round() as usize != r.samples.value
            {
                return Err(doc
                    .bad(
                        &r.samples.span,
                        format!("the samples are not exactly one code of {} chips", code.len()),
                    )
                    .allowed(format!("code length x sample_rate_hz / chip_rate_hz, here {want}"))
                    .remedy("sample one code at the chip rate or a multiple of it")
                    .into());
            }
            if r.sampling == super::radar::Sampling::Real {
                return Err(doc
                    .bad(&w.kind.span, "a phase code needs both quadratures")
                    .allowed("sampling = \"iq\"")
                    .into());
            }
            let period_s = period()?;
            fits(doc, w, r, period_s, "the code")?;
            Waveform::Coded { code, chip_rate_hz, period_s }
        }
    };
    Ok((waveform, multiplex(doc, w, transmitters)?))
}

/// Returns an error for a key of another kind of waveform.
fn only(doc: &Document<'_>, w: &WaveformTable) -> Result<()> {
    use WaveformName::{Fmcw, Pmcw, Pulse, SteppedFrequency};
    let one_ramp = w.ramp.is_empty();
    let list = [
        ("bandwidth_hz", w.bandwidth_hz.as_ref().map(|a| &a.span), &[Fmcw, Pulse][..], one_ramp),
        ("ramp_time_s", w.ramp_time_s.as_ref().map(|a| &a.span), &[Fmcw], one_ramp),
        (
            "chirp_period_s",
            w.chirp_period_s.as_ref().map(|a| &a.span),
            &[Fmcw, SteppedFrequency, Pulse, Pmcw],
            one_ramp,
        ),
        ("ramp", w.ramp.first().map(|r| &r.bandwidth_hz.span), &[Fmcw], true),
        ("ramp_order", w.ramp_order.as_ref().map(|a| &a.span), &[Fmcw], true),
        ("step_hz", w.step_hz.as_ref().map(|a| &a.span), &[SteppedFrequency], true),
        ("pulse_file", w.pulse_file.as_ref().map(|a| &a.span), &[Pulse], true),
        ("pulse_samples", w.pulse_samples.as_ref().map(|a| &a.span), &[Pulse], true),
        ("pulse_rate_hz", w.pulse_rate_hz.as_ref().map(|a| &a.span), &[Pulse], true),
        ("pulse_zero", w.pulse_zero.as_ref().map(|a| &a.span), &[Pulse], true),
        ("chip_rate_hz", w.chip_rate_hz.as_ref().map(|a| &a.span), &[Pmcw], true),
        ("code_degree", w.code_degree.as_ref().map(|a| &a.span), &[Pmcw], true),
        ("code", w.code.as_ref().map(|a| &a.span), &[Pmcw], true),
    ];
    for (key, span, kinds, alone) in list {
        let Some(span) = span else { continue };
        if !kinds.contains(&w.kind.value) {
            return Err(doc
                .bad(span, format!("waveform.{key} does not belong to this kind of waveform"))
                .remedy(format!("remove {key} or change waveform.kind"))
                .into());
        }
        if !alone {
            return Err(doc
                .bad(span, "belongs to each [[waveform.ramp]]")
                .remedy(format!("remove {key}"))
                .into());
        }
    }
    Ok(())
}

fn need<'t, T>(
    doc: &Document<'_>,
    w: &WaveformTable,
    value: &'t Option<At<T>>,
    key: &str,
    example: &str,
) -> Result<&'t At<T>> {
    value.as_ref().ok_or_else(|| {
        doc.bad(&w.carrier_hz.span, format!("this kind of waveform needs {key}"))
            .remedy(format!("add {key}, {example}"))
            .into()
    })
}

/// Narrower than any radar's: below it range cells become longer than numbers.
const LEAST_BANDWIDTH_HZ: f64 = 1.0;

fn ramp(
    doc: &Document<'_>,
    bandwidth: &At<f64>,
    time: &At<f64>,
    period: &At<f64>,
    carrier_hz: f64,
    r: &ReceiverTable,
) -> Result<Ramp> {
    let band = doc.in_range(
        bandwidth,
        -carrier_hz..=carrier_hz,
        "give the swept bandwidth in hertz, as in 1e9; negative when the frequency falls",
    )?;
    if band.abs() < LEAST_BANDWIDTH_HZ || band.abs() >= carrier_hz {
        return Err(doc
            .bad(&bandwidth.span, "is out of range")
            .allowed(format!(
                "at least {LEAST_BANDWIDTH_HZ} and below {carrier_hz}, or the same with a minus"
            ))
            .remedy("give the swept bandwidth in hertz, as in 1e9")
            .into());
    }
    let time_s = time.value;
    let period_s = doc.in_range(period, Above { low: 0.0, high: 1.0 }, "give seconds, as in 55e-6")?;
    if period_s < time_s * (1.0 - 1e-9) {
        return Err(doc
            .bad(&period.span, "is shorter than the ramp")
            .allowed(format!("at least ramp_time_s = {time_s:e}"))
            .remedy("lengthen the period or shorten the ramp")
            .into());
    }
    let (samples, rate, start) = (r.samples.value, r.sample_rate_hz.value, r.adc_start_s);
    let last = start + samples as f64 / rate;
    if last > time_s * (1.0 + 1e-9) {
        return Err(doc
            .bad(
                &r.samples.span,
                format!("the samples end {last:e} s after the ramp's start, but the ramp lasts {time_s:e} s"),
            )
            .allowed(format!(
                "at most {} samples here",
                (((time_s - start) * rate * (1.0 + 1e-9)).max(0.0)) as u64
            ))
            .remedy("use fewer samples, sample faster or lengthen ramp_time_s")
            .into());
    }
    Ok(Ramp { bandwidth_hz: band, time_s, period_s })
}

/// Returns an error for samples that do not end before the next chirp.
fn fits(doc: &Document<'_>, w: &WaveformTable, r: &ReceiverTable, period_s: f64, what: &str) -> Result<()> {
    let last = r.adc_start_s + r.samples.value as f64 / r.sample_rate_hz.value;
    if last > period_s * (1.0 + 1e-9) {
        let span = w.chirp_period_s.as_ref().map_or(&w.carrier_hz.span, |p| &p.span);
        return Err(doc
            .bad(span, format!("{what} end {last:e} s after the start, beyond the period"))
            .allowed(format!("a period of at least {last:e} s"))
            .remedy("lengthen the period, sample faster or use fewer samples")
            .into());
    }
    Ok(())
}

fn pulse(doc: &Document<'_>, w: &WaveformTable) -> Result<PulseShape> {
    let given = [w.bandwidth_hz.is_some(), w.pulse_file.is_some(), w.pulse_samples.is_some()];
    if given.iter().filter(|g| **g).count() != 1 {
        return Err(doc
            .bad(&w.carrier_hz.span, "a pulse needs one shape")
            .allowed("bandwidth_hz, or pulse_file, or pulse_samples with pulse_rate_hz and pulse_zero")
            .into());
    }
    let stray = w.pulse_rate_hz.as_ref().map(|a| &a.span).or(w.pulse_zero.as_ref().map(|a| &a.span));
    if let (None, Some(span)) = (&w.pulse_samples, stray) {
        return Err(doc.bad(span, "belongs to pulse_samples").remedy("remove it").into());
    }
    if let Some(b) = &w.bandwidth_hz {
        let bandwidth_hz = doc.in_range(
            b,
            LEAST_BANDWIDTH_HZ..=w.carrier_hz.value,
            "full width of the spectrum at -10 dB, as in 1.5e9",
        )?;
        return Ok(PulseShape::Gaussian { bandwidth_hz });
    }
    if let Some(f) = &w.pulse_file {
        let (path, text) = read_beside(doc, f)?;
        return pulse_csv(&path, &text);
    }
    let samples = need(doc, w, &w.pulse_samples, "pulse_samples", "as in [1, 0]")?;
    let rate = need(doc, w, &w.pulse_rate_hz, "pulse_rate_hz", "as in 10e9")?;
    let rate_hz = rate.value;
    let pairs = samples.value.chunks_exact(2);
    let envelope: Vec<Complex64> = pairs.map(|p| Complex64::new(p[0], p[1])).collect();
    if samples.value.is_empty()
        || !samples.value.len().is_multiple_of(2)
        || !samples.value.iter().all(|x| x.is_finite())
    {
        return Err(doc
            .bad(&samples.span, "is not a list of pairs of finite numbers")
            .allowed("[re, im, re, im, ...]")
            .into());
    }
    let zero = need(doc, w, &w.pulse_zero, "pulse_zero", "as in 0")?;
    let zero = doc.in_range(zero, 0..=envelope.len() - 1, "index of the sample at time zero")?;
    scaled(rate_hz, envelope, zero).map_err(|problem| doc.bad(&samples.span, problem).into())
}

/// With a peak of 1. Errors: nothing but zeros.
fn scaled(
    rate_hz: f64,
    mut envelope: Vec<Complex64>,
    zero: usize,
) -> std::result::Result<PulseShape, String> {
    let peak = envelope.iter().map(|p| p.norm()).fold(0.0, f64::max);
    if peak <= 0.0 {
        return Err("the pulse is zero throughout".into());
    }
    if peak != 1.0 {
        envelope.iter_mut().for_each(|p| *p /= peak);
    }
    Ok(PulseShape::Samples { rate_hz, envelope, zero })
}

/// Reads a table of `time_s`, `re` and `im` at equidistant, rising times; the one next to zero is time zero.
///
/// # Errors
/// Returns an error of one line with the line number if a row is wrong or the times are not equidistant.
pub fn pulse_csv(file: &Path, text: &str) -> Result<PulseShape> {
    const COLUMNS: [&str; 3] = ["time_s", "re", "im"];
    let bad = |line: usize, problem: &str| BadInput::new(problem).file(file).line(line);
    let table = Table::parse(file, text.into())?;
    let columns = COLUMNS.map(|c| table.numbers(c));
    let [times, re, im] = columns;
    let (times, re, im) = (times?, re?, im?);
    table.only(&COLUMNS)?;
    let mut rows: Vec<[f64; 3]> = Vec::with_capacity(table.len());
    for (i, t) in times.into_iter().enumerate() {
        let row = [t, re[i], im[i]];
        if let Some(k) = row.iter().position(|x| !x.is_finite()) {
            let e = bad(table.line(i), "is empty or not finite").key(COLUMNS[k]).value(row[k]);
            return Err(e.remedy("give a number in each row").into());
        }
        if let Some(before) = rows.last() {
            let step = t - before[0];
            let first = rows.get(1).map_or(step, |r| r[0] - rows[0][0]);
            if step <= 0.0 || (step - first).abs() > 1e-3 * first {
                let e = bad(table.line(i), "the times are not equidistant and rising").key("time_s").value(t);
                return Err(e.remedy("sort and resample them").into());
            }
        }
        rows.push(row);
    }
    if rows.len() < 2 || rows.len() > 1 << 16 {
        return Err(BadInput::new(format!("has {} samples of a pulse", rows.len()))
            .file(file)
            .allowed("2..=65536")
            .into());
    }
    let step = (rows[rows.len() - 1][0] - rows[0][0]) / (rows.len() - 1) as f64;
    let zero = (-rows[0][0] / step).round();
    if zero < 0.0 || zero >= rows.len() as f64 {
        return Err(BadInput::new("the pulse does not include time zero, at which it leaves the antenna")
            .file(file)
            .remedy("shift the times")
            .into());
    }
    let envelope = rows.iter().map(|r| Complex64::new(r[1], r[2])).collect();
    scaled(1.0 / step, envelope, zero as usize).map_err(|problem| BadInput::new(problem).file(file).into())
}

fn code(doc: &Document<'_>, w: &WaveformTable) -> Result<Vec<i8>> {
    match (&w.code_degree, &w.code) {
        (Some(d), None) => {
            m_sequence(d.value).ok_or_else(|| doc.bad(&d.span, "there is no sequence of this degree").into())
        }
        (None, Some(c)) => {
            let odd = c.value.len() % 2 == 1 && c.value.len() >= 3 && c.value.len() <= 65536;
            if !odd || c.value.iter().any(|x| x.abs() != 1) {
                return Err(doc
                    .bad(&c.span, format!("is not a code ({} values)", c.value.len()))
                    .allowed("an odd number, 3 to 65535, of 1 and -1")
                    .into());
            }
            Ok(c.value.clone())
        }
        (Some(d), Some(_)) => {
            Err(doc.bad(&d.span, "code_degree and code exclude each other").remedy("keep one of them").into())
        }
        (None, None) => Err(doc
            .bad(&w.carrier_hz.span, "a phase code needs code_degree or code")
            .remedy("add code_degree, as in 9")
            .into()),
    }
}

fn multiplex(doc: &Document<'_>, w: &WaveformTable, transmitters: usize) -> Result<Multiplex> {
    let name = w.multiplex.as_ref().map_or(MultiplexName::Tdm, |m| m.value);
    if let Some(e) = &w.empty_bands
        && name != MultiplexName::Ddm
    {
        return Err(doc
            .bad(&e.span, "only \"ddm\" has Doppler bands")
            .remedy("remove empty_bands or set multiplex = \"ddm\"")
            .into());
    }
    Ok(match name {
        MultiplexName::Tdm => Multiplex::Tdm,
        MultiplexName::Bpm => Multiplex::Bpm,
        MultiplexName::Ddm => {
            let empty = w.empty_bands.as_ref().map_or(1, |e| e.value);
            let bands = transmitters + empty;
            if !w.chirps.value.is_multiple_of(bands) {
                return Err(doc
                    .bad(
                        &w.chirps.span,
                        format!("the number of chirps is not a multiple of the {bands} Doppler bands"),
                    )
                    .allowed(format!("a multiple of {bands}"))
                    .remedy("change chirps or empty_bands")
                    .into());
            }
            Multiplex::Ddm { bands }
        }
    })
}

/// The table that [`build`] reads back to this waveform.
pub fn table(
    carrier_hz: f64,
    waveform: &Waveform,
    multiplex: Multiplex,
    chirps: usize,
    transmitters: usize,
) -> WaveformTable {
    let mut t = WaveformTable {
        kind: WaveformName::Fmcw.into(),
        carrier_hz: carrier_hz.into(),
        bandwidth_hz: None,
        ramp_time_s: None,
        chirp_period_s: Some(waveform.period_s().into()),
        ramp: Vec::new(),
        ramp_order: None,
        step_hz: None,
        pulse_file: None,
        pulse_samples: None,
        pulse_rate_hz: None,
        pulse_zero: None,
        chip_rate_hz: None,
        code_degree: None,
        code: None,
        chirps: chirps.into(),
        multiplex: None,
        empty_bands: None,
    };
    match waveform {
        Waveform::Fmcw(s) => match &s.ramps[..] {
            [r] => {
                t.bandwidth_hz = Some(r.bandwidth_hz.into());
                t.ramp_time_s = Some(r.time_s.into());
            }
            several => {
                t.chirp_period_s = None;
                t.ramp = several
                    .iter()
                    .map(|r| RampTable {
                        bandwidth_hz: r.bandwidth_hz.into(),
                        ramp_time_s: r.time_s.into(),
                        chirp_period_s: r.period_s.into(),
                    })
                    .collect();
                if s.order == RampOrder::Bursts {
                    t.ramp_order = Some(RampOrderName::Bursts.into());
                }
            }
        },
        Waveform::Stepped { step_hz, .. } => {
            t.kind = WaveformName::SteppedFrequency.into();
            t.step_hz = Some((*step_hz).into());
        }
        Waveform::Pulse { shape, .. } => {
            t.kind = WaveformName::Pulse.into();
            match shape {
                PulseShape::Gaussian { bandwidth_hz } => t.bandwidth_hz = Some((*bandwidth_hz).into()),
                PulseShape::Samples { rate_hz, envelope, zero } => {
                    t.pulse_samples =
                        Some(envelope.iter().flat_map(|p| [p.re, p.im]).collect::<Vec<_>>().into());
                    t.pulse_rate_hz = Some((*rate_hz).into());
                    t.pulse_zero = Some((*zero).into());
                }
            }
        }
        Waveform::Coded { code, chip_rate_hz, .. } => {
            t.kind = WaveformName::Pmcw.into();
            t.chip_rate_hz = Some((*chip_rate_hz).into());
            t.code = Some(code.clone().into());
        }
    }
    match multiplex {
        Multiplex::Tdm => {}
        Multiplex::Bpm => t.multiplex = Some(MultiplexName::Bpm.into()),
        Multiplex::Ddm { bands } => {
            t.multiplex = Some(MultiplexName::Ddm.into());
            t.empty_bands = Some((bands - transmitters).into());
        }
    }
    t
}
