//! The fitted front end in the words of a radar file, and a cube that it makes beside the measured one.

use super::estimate::{Fit, SIGNIFICANT_IMAGE, hann, noise_samples, still_rows};
use catseye::adc::Cube;
use catseye::adc::cpu::front_end::{Inputs, apply};
use catseye::adc::front_end::Chain;
use catseye::adc::noise::Noise;
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::units::{BOLTZMANN, T0_K, db_from_power, dbm_from_w, power_from_db, w_from_dbm};
use catseye::scene::front_end::{
    Adc, ChannelErrors, DcOffset, FrontEndSettings, FrontEndTable, IqImbalance, Leakage, PhaseNoise,
    QuantiserKind,
};
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml;
use catseye::scene::waveform::Multiplex;
use num_complex::Complex64;
use serde::Serialize;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// How levels of the cube become powers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Levels {
    /// The samples are in √W at the receiver's input.
    Absolute,
    /// A tone of this power, dBm, just fills the range of the converter.
    FullScale(f64),
    /// The thermal noise is that of the radar's noise figure.
    NoiseFigure,
}

/// One effect: what was estimated, and whether an ideal radar with this thermal noise would show it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// Its key in `[front_end]`.
    pub name: &'static str,
    /// What `estimate`, `deviation` and `limit` are.
    pub quantity: &'static str,
    /// Empty where nothing could be estimated.
    pub estimate: Vec<f64>,
    /// Standard deviation of the estimates.
    pub deviation: Option<f64>,
    /// Detection limits.
    pub limit: Vec<f64>,
    /// Whether it is in front_end.toml.
    pub is_significant: bool,
}

/// Every effect that a fit looks for.
pub fn effects(fit: &Fit, found: &Fitted) -> Vec<Effect> {
    let f = &found.radar.front_end;
    let mut out = vec![Effect {
        name: "adc",
        quantity: "step, unit of the samples",
        estimate: fit.quantiser.iter().map(|q| q.step).collect(),
        deviation: None,
        limit: Vec::new(),
        is_significant: f.adc.is_some(),
    }];
    out.push(Effect {
        name: "dc_offset",
        quantity: "modulus of the mean constant, unit of the samples",
        estimate: vec![fit.mean_dc().norm()],
        deviation: Some(fit.dc_deviation),
        limit: vec![fit.dc_limit],
        is_significant: f.dc.is_some(),
    });
    out.push(Effect {
        name: "iq_imbalance",
        quantity: "amplitude of the image over its line",
        estimate: fit.imbalance.iter().map(|i| power_from_db(0.5 * i.image_db)).collect(),
        deviation: fit.imbalance.as_ref().map(|i| i.standard_error),
        limit: fit.imbalance.iter().map(|i| SIGNIFICANT_IMAGE * i.standard_error).collect(),
        is_significant: f.iq.is_some(),
    });
    out.push(Effect {
        name: "leakage",
        quantity: "rms amplitude of the channels, unit of the samples",
        estimate: fit.leak.iter().map(|l| l.rms).collect(),
        deviation: fit.leak.as_ref().map(|l| l.deviation),
        limit: fit.leak.iter().map(|l| 10.0 * 2f64.sqrt() * l.deviation).collect(),
        is_significant: f.leakage.is_some(),
    });
    let channels = fit.channels.as_ref();
    for (name, quantity, values, deviation) in [
        ("channels", "gain, dB", channels.map(|c| &c.gain_db), channels.map(|c| c.gain_deviation_db)),
        ("channels", "phase, deg", channels.map(|c| &c.phase_deg), channels.map(|c| c.phase_deviation_deg)),
    ] {
        out.push(Effect {
            name,
            quantity,
            estimate: values.cloned().unwrap_or_default(),
            deviation,
            limit: Vec::new(),
            is_significant: f.channels.is_some(),
        });
    }
    out.push(Effect {
        name: "phase_noise",
        quantity: "power a bin over the line's at offsets that double, dB",
        estimate: fit.sidebands.iter().filter_map(|s| s.excess_db).collect(),
        deviation: None,
        limit: fit.sidebands.iter().map(|s| s.bound_db).collect(),
        is_significant: f.phase_noise.is_some(),
    });
    out
}

/// What was fitted, in the units of a radar file.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The radar with the fitted front end and noise figure.
    pub radar: Radar,
    /// √W of one unit of the samples.
    pub scale: f64,
    /// What was found and has no key, or does not stand out; one line each.
    pub remarks: Vec<String>,
}

/// A radar of the cube's shape where none is given: one transmitter, all channels receivers in a row. Its waveform is an assumption; all
/// that depends on it is marked so.
pub fn assumed_radar_toml(shape: [usize; 3]) -> String {
    let [chirps, channels, samples] = shape;
    let sample_rate_hz = 10e6;
    let ramp_time_s = (samples as f64 + 32.0) / sample_rate_hz;
    let mut text = format!(
        "name = \"assumed\"\n\n[waveform]\nkind = \"fmcw\"\ncarrier_hz = 77e9\nbandwidth_hz = {:e}\nramp_time_s = {ramp_time_s:e}\n\
         chirp_period_s = {:e}\nchirps = {chirps}\nmultiplex = \"tdm\"\n\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = {sample_rate_hz:e}\n\
         samples = {samples}\nnoise_figure_db = 15\nthermal_noise = true\n\n[transmitter]\npower_dbm = 12\n\n[antenna]\npolarisation = \"V\"\n\
         gain_dbi = 10\npattern = \"isotropic\"\n\n[[tx]]\nposition_half_wavelengths = [0, 0, 0]\n",
        30e12 * ramp_time_s,
        ramp_time_s + 10e-6,
    );
    for k in 0..channels {
        text += &format!("\n[[rx]]\nposition_half_wavelengths = [0, {k}, 0]\n");
    }
    text
}

/// Puts a fit into the keys of `[front_end]`. `bits`: of the converter; by default the fewest that hold all samples.
///
/// # Errors
/// Returns `BadInput` for noise below the quantiser's where it has to give the scale, or a noise figure
/// that no radar file takes.
pub fn fitted(path: &Path, fit: &Fit, radar: &Radar, levels: Levels, bits: Option<u32>) -> Result<Fitted> {
    let mut remarks = Vec::new();
    let iq = mixer(fit);
    let (k1, k2) = iq.unwrap_or_default().factors();
    // What the mixer makes of noise: K₁x + K₂x* (CONVENTIONS eq. 109).
    let thermal = fit.thermal_variance() / (k1.norm_sqr() + k2.norm_sqr());
    let per_figure = BOLTZMANN * T0_K * radar.sample_rate_hz;
    let bits = match (fit.quantiser, bits) {
        (Some(q), Some(b)) if b < q.least_bits => {
            return Err(BadInput::new("the samples do not fit into this number of bits")
                .file(path)
                .key("--bits")
                .value(b)
                .allowed(format!("{}..=24", q.least_bits))
                .into());
        }
        (Some(q), b) => Some((q, b.unwrap_or(q.least_bits))),
        (None, _) => None,
    };
    let scale = match levels {
        Levels::Absolute => 1.0,
        Levels::FullScale(dbm) => {
            let Some((q, bits)) = bits else {
                return Err(BadInput::new(
                    "the samples have no common quantisation step, so there is no full scale",
                )
                .file(path)
                .key("--full-scale-dbm")
                .value(dbm)
                .remedy("leave it out")
                .into());
            };
            w_from_dbm(dbm).sqrt() / (q.step * 2f64.powi(bits as i32 - 1))
        }
        Levels::NoiseFigure if thermal > 0.0 => {
            (per_figure * power_from_db(radar.noise_figure_db) / thermal).sqrt()
        }
        Levels::NoiseFigure => {
            return Err(BadInput::new(
                "the noise does not exceed that of the quantiser, so the scale cannot be derived from it",
            )
            .file(path)
            .key("--full-scale-dbm")
            .remedy("give the power of a full-scale tone")
            .into());
        }
    };
    let power = |variance: f64| variance * scale * scale;
    let figure_db = db_from_power(power(thermal) / per_figure);
    let has_noise = thermal > 0.0 && figure_db >= 0.0;
    if !has_noise {
        remarks.push("thermal noise: none beyond that of the quantiser and of k T0".into());
    }
    if figure_db > 60.0 {
        return Err(BadInput::new("the noise is far above that of any receiver")
            .file(path)
            .key("noise figure, dB")
            .value(format!("{figure_db:.1}"))
            .allowed("0..=60")
            .remedy("give the sample rate with --radar, or the level with --full-scale-dbm")
            .into());
    }
    let mut settings = FrontEndSettings::default();
    if let Some((q, bits)) = bits {
        let full_scale_dbm = dbm_from_w(power((q.step * 2f64.powi(bits as i32 - 1)).powi(2)));
        settings.adc = (bits <= 24 && (-200.0..=100.0).contains(&full_scale_dbm)).then_some(Adc {
            bits,
            full_scale_dbm,
            kind: q.kind,
        });
    } else {
        remarks.push("adc: the samples have no common quantisation step".into());
    }
    let dc = fit.mean_dc() * scale;
    let has_dc = fit.mean_dc().norm() > fit.dc_limit && dbm_from_w(dc.norm_sqr()) >= -200.0;
    if has_dc {
        settings.dc = Some(DcOffset { i: dc.re, q: dc.im });
    }
    if has_dc && fit.dc.len() > 1 {
        let each: Vec<String> = fit.dc.iter().map(|d| format!("({:.4}, {:.4})", d[0], d[1])).collect();
        remarks.push(format!(
            "dc_offset: the mean of the channels; each in units of the samples: {}",
            each.join(" ")
        ));
    }
    match &fit.imbalance {
        None => remarks.push("iq_imbalance: no line is strong enough to show an image".into()),
        Some(i) if !i.is_significant => remarks.push(format!(
            "iq_imbalance: no image above the limit of {:.1} dB, or other echoes at its position",
            db_from_power((SIGNIFICANT_IMAGE * i.standard_error).powi(2))
        )),
        Some(i) if iq.is_none() => {
            remarks.push(format!(
                "iq_imbalance: {:.1} dB and {:.1} deg are not those of a mixer",
                i.gain_db, i.phase_deg
            ));
        }
        Some(_) => settings.iq = iq,
    }
    let bin_hz = radar.sample_rate_hz / radar.samples as f64;
    if let Some(leak) = &fit.leak {
        let isolation_db = radar.tx_power_dbm - dbm_from_w(power(leak.rms * leak.rms / k1.norm_sqr()));
        let delay_s = leak.delay_s;
        if !leak.is_significant {
            remarks.push(format!(
                "leakage: the line at {:.2} bins ({delay_s:.2e} s, common share {:.2}) is an echo",
                leak.bin, leak.common_share
            ));
        } else if radar.multiplex != Multiplex::Tdm {
            remarks.push(format!(
                "leakage (no key where transmitters send at once): isolation {isolation_db:.1} dB, delay {delay_s:.2e} s"
            ));
        } else if (0.0..=200.0).contains(&isolation_db) {
            settings.leakage = Some(Leakage { isolation_db, delay_s });
        } else {
            remarks.push(format!(
                "leakage: {isolation_db:.1} dB and {delay_s:.2e} s are out of the keys' range"
            ));
        }
    }
    match fit.phase_noise_line {
        Some([bin, _]) if !fit.sidebands.is_empty() => {
            let delay_s = bin * bin_hz / radar.slope_hz_per_s().abs();
            settings.phase_noise = phase_noise(fit, radar, delay_s, &mut remarks);
        }
        Some(_) => remarks
            .push("phase_noise: lines fill so many Doppler cells that none shows the noise alone".into()),
        None => remarks.push("phase_noise: no line is strong enough".into()),
    }
    match &fit.channels {
        Some(c) if c.is_significant && c.gain_db.iter().all(|g| g.abs() <= 40.0) => {
            // DDM shows one transmitter at rest; its receivers' errors hold for all.
            let count = radar.virtual_channels();
            let repeated = |x: &[f64]| -> Vec<f64> { x.iter().copied().cycle().take(count).collect() };
            settings.channels = Some(ChannelErrors {
                gain_db: repeated(&c.gain_db),
                phase_rad: repeated(&c.phase_deg).iter().map(|p| p.to_radians()).collect(),
                ..Default::default()
            });
        }
        Some(c) if c.is_significant => {
            remarks.push("channels: a channel deviates by more than 40 dB, which is not a gain error".into());
        }
        Some(c) => remarks.push(format!("channels: {}", c.reason)),
        None if fit.shape[1] > 1 => remarks.push("channels: no static line is strong enough".into()),
        None => {}
    }
    remarks.push(format!("slope of the noise floor (no key): {:+.4} dB a bin", fit.floor_slope_db));
    if let Some([largest, mean]) = fit.correlations() {
        remarks.push(format!(
            "correlation of the channels' noise (no key): largest {largest:.3}, mean {mean:.3}, by chance {:.3}",
            fit.chance_correlation
        ));
    }
    let mut radar = radar.clone();
    radar.thermal_noise = has_noise;
    if has_noise {
        radar.noise_figure_db = figure_db;
    }
    radar.front_end = settings;
    Ok(Fitted { radar, scale, remarks })
}

/// The imbalance that stands out and that a radar file takes.
fn mixer(fit: &Fit) -> Option<IqImbalance> {
    let i = fit.imbalance.as_ref()?;
    let is_taken = i.is_significant && i.gain_db.abs() <= 20.0 && i.phase_deg.abs() <= 89.0;
    is_taken.then(|| IqImbalance { gain_db: i.gain_db, phase_rad: i.phase_deg.to_radians() })
}

/// L(f) from the sidebands of the line: excess power a bin over 4 sin²(πfτ) and the sample rate (CONVENTIONS eq. 101), at the geometric mean
/// of a band.
fn phase_noise(fit: &Fit, radar: &Radar, delay_s: f64, remarks: &mut Vec<String>) -> Option<PhaseNoise> {
    let bin_hz = radar.sample_rate_hz / radar.samples as f64;
    let level = |excess_db: f64, offset_hz: f64| {
        excess_db - db_from_power(radar.sample_rate_hz * 4.0 * (PI * offset_hz * delay_s).sin().powi(2))
    };
    let (mut offset_hz, mut dbc_per_hz, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
    for s in &fit.sidebands {
        let f = (s.from as f64 * s.to as f64).sqrt() * bin_hz;
        match s.excess_db.map(|e| level(e, f)).filter(|l| (-250.0..=0.0).contains(l)) {
            Some(l) => {
                offset_hz.push(f);
                dbc_per_hz.push(l);
            }
            None => bounds.push(format!("{:.1} dBc/Hz at {f:.2e} Hz", level(s.bound_db, f))),
        }
    }
    if !bounds.is_empty() {
        remarks.push(format!("phase_noise: not detected; it is below {}", bounds.join(", ")));
    }
    (!offset_hz.is_empty()).then_some(PhaseNoise { offset_hz, dbc_per_hz })
}

#[derive(Serialize)]
struct Fragment {
    front_end: FrontEndTable,
}

impl Fitted {
    /// The fragment of a radar file, with the noise figure and all remarks as comments.
    ///
    /// # Errors
    /// Returns an error if a value cannot be written.
    pub fn toml(&self, head: &[String]) -> Result<String> {
        let mut text: String = head.iter().chain(&self.remarks).map(|l| format!("# {l}\n")).collect();
        if self.radar.thermal_noise {
            text += &format!("# [receiver] noise_figure_db = {:.3}\n", self.radar.noise_figure_db);
        }
        let fragment = Fragment { front_end: FrontEndTable::from(&self.radar.front_end) };
        let body = toml::to_string(&fragment).map_err(|e| Error::Failed(format!("front end: {e}")))?;
        Ok(text + "\n" + &body)
    }

    /// A cube of this front end with one target, the strongest line, in the unit of the measured samples.
    ///
    /// # Errors
    /// Returns an error for phase noise on a sweep that is too slow for it, or a front end that no radar file takes.
    pub fn simulated(&self, path: &Path, fit: &Fit, seed: u64) -> Result<Cube<f64>> {
        let radar = &self.radar;
        // Read back as a user's file is, so that no value leaves the range of its key.
        radar_toml::parse(path, &radar_toml::to_toml(radar)?)?;
        let chain = Chain::new(radar, &radar.front_end);
        let margin = chain.margin();
        let mut cube = Cube::<f64>::zeros(fit.shape[0], fit.shape[1], fit.shape[2] + 2 * margin);
        if let Some(line) = &fit.line {
            let bin_hz = radar.sample_rate_hz / radar.samples as f64;
            let samples = cube.samples;
            let (k1, _) = mixer(fit).unwrap_or_default().factors();
            let mean_square = line.amplitude.iter().map(|a| a[0] * a[0] + a[1] * a[1]).sum::<f64>()
                / line.amplitude.len() as f64;
            for (row, data) in cube.data.chunks_mut(samples).enumerate() {
                let channel = row % fit.shape[1];
                let turn = line.progression_deg.to_radians() * channel as f64;
                let gain =
                    chain.echo_gain(channel, line.bin * bin_hz) * self.scale * mean_square.sqrt() / k1.norm();
                for (n, z) in data.iter_mut().enumerate() {
                    let time = (n as f64 - margin as f64) / radar.samples as f64;
                    *z = gain * Complex64::cis(TAU * line.bin * time + turn);
                }
            }
        }
        let noise = Noise::thermal(radar, seed, 0);
        let mut made =
            apply(cube, margin, &chain, Inputs { noise: noise.as_ref(), seed, ..Default::default() })?;
        made.data.iter_mut().for_each(|z| *z /= self.scale);
        // Levels of the quantiser come back as the levels that were measured, without the rounding of the scale.
        if let (Some(q), true) = (fit.quantiser, radar.front_end.adc.is_some()) {
            let half = if q.kind == QuantiserKind::MidRise { 0.5 } else { 0.0 };
            let on_grid = |x: f64| ((x / q.step - half).round() + half) * q.step;
            made.data.iter_mut().for_each(|z| *z = Complex64::new(on_grid(z.re), on_grid(z.im)));
        }
        Ok(made)
    }
}

/// Two-sample Kolmogorov–Smirnov test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KsTest {
    /// Largest distance of the two distribution functions.
    pub distance: f64,
    /// Probability of so large a distance between samples of one distribution (asymptotic; Stephens 1970).
    pub p_value: f64,
    /// Numbers of values.
    pub counts: [usize; 2],
}

/// Compares two lists of values; ties count once for both.
pub fn kolmogorov_smirnov(a: &[f64], b: &[f64]) -> KsTest {
    let sorted = |x: &[f64]| {
        let mut x = x.to_vec();
        x.sort_unstable_by(f64::total_cmp);
        x
    };
    let (x, y) = (sorted(a), sorted(b));
    let (mut i, mut j, mut distance) = (0, 0, 0.0f64);
    while i < x.len() && j < y.len() {
        let least = x[i].min(y[j]);
        while i < x.len() && x[i] <= least {
            i += 1;
        }
        while j < y.len() && y[j] <= least {
            j += 1;
        }
        distance = distance.max((i as f64 / x.len() as f64 - j as f64 / y.len() as f64).abs());
    }
    let (n, m) = (x.len() as f64, y.len() as f64);
    let p_value = ks_p_value(distance, n * m / (n + m).max(1.0));
    KsTest { distance, p_value, counts: [x.len(), y.len()] }
}

/// Probability of a Kolmogorov–Smirnov distance of at least `distance` where the distributions are the same (asymptotic; Stephens
/// 1970). `count` is the number of values of one sample, or n m / (n + m) of two.
pub fn ks_p_value(distance: f64, count: f64) -> f64 {
    let root = count.sqrt();
    let z = (root + 0.12 + 0.11 / root.max(1.0)) * distance;
    match z {
        // The series converges slowly there, and the probability is one within 1e-10.
        z if z < 0.2 => 1.0,
        z => {
            let term = |k: i32| f64::from(1 - 2 * ((k + 1) % 2)) * (-2.0 * f64::from(k * k) * z * z).exp();
            (2.0 * (1..=100).map(term).sum::<f64>()).clamp(0.0, 1.0)
        }
    }
}

/// One curve of both cubes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Both {
    /// Place: level over the noise's standard deviation, bin, offset from the line in bins, or number of the pair of channels.
    pub at: Vec<f64>,
    /// Values of the measured cube.
    pub measured: Vec<f64>,
    /// Values of the simulated cube.
    pub simulated: Vec<f64>,
}

impl Both {
    /// Root mean square and largest modulus of the differences at the places that `keep` takes; None where it takes none.
    pub fn difference(&self, keep: impl Fn(f64) -> bool) -> Option<[f64; 2]> {
        let pairs = self.at.iter().zip(self.measured.iter().zip(&self.simulated));
        let all: Vec<f64> = pairs.filter(|(at, _)| keep(**at)).map(|(_, (m, s))| m - s).collect();
        let worst = all.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        let square = all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64;
        (!all.is_empty()).then(|| [square.sqrt(), worst])
    }
}

/// Measured beside simulated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Beside {
    /// Share of I and Q of the noise in steps of a quarter of its standard deviation.
    pub histogram: Both,
    /// Test of the noise of I and Q.
    pub noise_test: KsTest,
    /// Test of the samples as they are, with constant, spill-over and scene.
    pub sample_test: KsTest,
    /// Noise floor, dB over the measured mean.
    pub floor: Both,
    /// Root mean square and worst difference of the floors over the quiet bins, dB.
    pub floor_db: [f64; 2],
    /// The same over all bins, with moving echoes and the edges of the filters, dB.
    pub floor_everywhere_db: [f64; 2],
    /// Strongest line through a Hann window, dB under its peak, at least −60; None without a line.
    pub side_lobes: Option<Both>,
    /// Root mean square and worst difference up to a bin from the peak: the main lobe, dB.
    pub main_lobe_db: Option<[f64; 2]>,
    /// The same from there to 8 bins, dB: side lobes, and whatever else stands there.
    pub side_lobe_db: Option<[f64; 2]>,
    /// Correlation of the noise of each two channels.
    pub correlation: Both,
    /// Root mean square and largest difference of the correlations; None for one channel.
    pub correlation_difference: Option<[f64; 2]>,
}

/// Lowest level of a side lobe, dB.
const LOWEST_DB: f64 = -60.0;

/// Puts the figures of two cubes and their fits side by side; the second is the simulated one.
pub fn beside(cubes: [&Cube<f64>; 2], fits: [&Fit; 2]) -> Beside {
    let noise = cubes.map(noise_samples);
    let sigma = (0.5 * fits[0].noise_variance).sqrt();
    let edges: Vec<f64> = (-16..16).map(|i| 0.25 * f64::from(i)).collect();
    let shares = |x: &[f64]| -> Vec<f64> {
        let mut counts = vec![0usize; edges.len()];
        for v in x {
            let i = ((v / sigma + 4.0) / 0.25).floor();
            if (0.0..edges.len() as f64).contains(&i) {
                counts[i as usize] += 1;
            }
        }
        counts.iter().map(|c| *c as f64 / x.len() as f64).collect()
    };
    let parts = |c: &Cube<f64>| -> Vec<f64> { c.data.iter().flat_map(|z| [z.re, z.im]).collect() };
    let level =
        |f: &Fit| f.floor.iter().map(|p| db_from_power(p / fits[0].noise_variance).max(-100.0)).collect();
    let floor = Both {
        at: (0..fits[0].floor.len()).map(|i| i as f64).collect(),
        measured: level(fits[0]),
        simulated: level(fits[1]),
    };
    let is_quiet = |at: f64| fits[0].quiet.binary_search(&(at as usize)).is_ok();
    let side_lobes = fits[0].line.as_ref().map(|line| {
        let at: Vec<f64> = (-32..=32).map(|i| 0.25 * f64::from(i)).collect();
        let of = |c: &Cube<f64>, f: &Fit| profile(c, f, line.bin, &at);
        Both { measured: of(cubes[0], fits[0]), simulated: of(cubes[1], fits[1]), at }
    });
    let k = fits[0].shape[1];
    let pairs = |f: &Fit| -> Vec<f64> {
        (0..k).flat_map(|a| (0..a).map(move |b| a * k + b)).map(|i| f.correlation[i]).collect()
    };
    let correlation = Both {
        at: (0..k * (k - 1) / 2).map(|i| i as f64).collect(),
        measured: pairs(fits[0]),
        simulated: pairs(fits[1]),
    };
    let lobes = |from: f64, to: f64| {
        side_lobes.as_ref().and_then(|s| s.difference(|at| (from..=to).contains(&at.abs())))
    };
    Beside {
        histogram: Both {
            at: edges.iter().map(|e| e + 0.125).collect(),
            measured: shares(&noise[0]),
            simulated: shares(&noise[1]),
        },
        noise_test: kolmogorov_smirnov(&noise[0], &noise[1]),
        sample_test: kolmogorov_smirnov(&parts(cubes[0]), &parts(cubes[1])),
        floor_db: floor.difference(is_quiet).unwrap_or_default(),
        floor_everywhere_db: floor.difference(|_| true).unwrap_or_default(),
        floor,
        main_lobe_db: lobes(0.0, 1.0),
        side_lobe_db: lobes(1.0 + 1e-9, 8.0),
        side_lobes,
        correlation_difference: correlation.difference(|_| true),
        correlation,
    }
}

/// Power of what stands still, over channels, around `bin` through a Hann window, dB under its value there.
fn profile(cube: &Cube<f64>, fit: &Fit, bin: f64, at: &[f64]) -> Vec<f64> {
    let rows = still_rows(cube);
    let window = hann(cube.samples);
    let power = |offset: f64| -> f64 {
        let step = -TAU * (bin + offset) / cube.samples as f64;
        let of = |(row, dc): (&Vec<Complex64>, &[f64; 2])| {
            let dc = Complex64::new(dc[0], dc[1]);
            let all = row.iter().zip(&window).enumerate();
            all.map(|(n, (z, w))| (z - dc) * w * Complex64::cis(step * n as f64))
                .sum::<Complex64>()
                .norm_sqr()
        };
        rows.iter().zip(&fit.dc).map(of).sum()
    };
    let peak = power(0.0);
    at.iter().map(|a| db_from_power(power(*a) / peak).max(LOWEST_DB)).collect()
}
