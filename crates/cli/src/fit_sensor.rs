//! `catseye fit-sensor`: a front end like that of a measured cube, and how alike it is.

use super::bar::Kept;
use super::cube_args::radar_of_cfg;
use super::global::{Global, choice};
use catseye::adc::Cube;
use catseye::base::error::{BadInput, Error, Result};
use catseye::dsp::lost_chirps::LostChirps;
use catseye::formats::npy;
use catseye::formats::stage::{StagedDir, distinct};
use catseye::scene::{radar_toml, unusual};
use catseye_io::cube::{CubeOptions, Source, configuration_beside, open_cube};
use catseye_io::cube_layout::{Axis, axes_from};
use catseye_io::sensor_fit::compare::{
    Beside, Both, Effect, Levels, assumed_radar_toml, beside, effects, fitted,
};
use catseye_io::sensor_fit::estimate::{Fit, FitOptions, check, fit};
use catseye_io::ti_cfg::{BOARDS, Board};
use catseye_plot::{Curve, Panel, study_picture};
use clap::Args;
use num_complex::Complex64;
use std::path::{Path, PathBuf};

/// Fit a front end to a measured cube and compare a simulated cube with it
#[derive(Debug, Args)]
#[command(
    after_help = "Writes front_end.toml (a fragment of a radar file), fit.json, comparison.csv and comparison.png. Values that \
                  depend on the waveform (powers, delays, phase noise) are valid for the radar given by --radar; \
                  without it a waveform is assumed."
)]
pub struct FitSensor {
    /// Measured cube [chirp, rx_virtual, sample] or [chirp, sample] of I and Q: NumPy (.npy), TI recording (.bin with its .cfg), HDF5 (.h5)
    pub cube: PathBuf,
    /// Folder to write
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Preset or radar file (TOML) of the radar that recorded the cube (default: the .cfg of a recording, else an assumed radar)
    #[arg(long)]
    pub radar: Option<String>,
    /// Number format: plain, or unsigned 16-bit words that contain signed counts
    #[arg(long, default_value = "plain", action = clap::ArgAction::Set, value_name = "plain|unsigned16", value_parser = choice(&[("plain", false), ("unsigned16", true)]))]
    pub words: bool,
    /// Axes of a .npy or .h5 file, slowest first, from: frame, chirp, rx, sample, iq
    #[arg(long, value_name = "LIST")]
    pub axes: Option<String>,
    /// Index of the frame in a file with several frames
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub frame: usize,
    /// Full scale: power of a tone that just fills the converter; without it counts are scaled by the radar's noise figure
    #[arg(long, value_name = "DBM")]
    pub full_scale_dbm: Option<f64>,
    /// Resolution of the converter, bits (default: 16 for words, else the minimum that holds all samples)
    #[arg(long, value_name = "N")]
    pub bits: Option<u32>,
    /// Assume that the strongest static target is at boresight, so that all its phase differences are phase errors of the channels
    #[arg(long)]
    pub boresight: bool,
    /// Board of a .bin, which gives the antenna positions (default: the board named in the .cfg, else a board by the band)
    #[arg(long, value_name = "NAME", value_parser = choice(&BOARDS), conflicts_with = "radar")]
    pub board: Option<Board>,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    #[serde(serialize_with = "catseye::formats::path_text")]
    folder: PathBuf,
    /// Name of the radar; "assumed" where none was given.
    radar: &'a str,
    /// Whether powers, delays and phase noise rest on an assumed waveform.
    is_assumed: bool,
    /// What gives the samples their power: their own unit, the full scale, or the noise figure.
    levels: &'static str,
    /// Square root of W of one unit of the samples.
    scale: f64,
    noise_figure_db: Option<f64>,
    front_end: catseye::scene::front_end::FrontEndTable,
    remarks: &'a [String],
    /// Each effect, its deviation or limit, and whether it is in front_end.toml.
    effects: Vec<Effect>,
    fit: &'a Fit,
    comparison: &'a Beside,
}

impl FitSensor {
    pub fn run(&self, global: &Global) -> Result<()> {
        distinct(&[&self.output], &[&self.cube])?;
        if self.bits.is_some_and(|b| !(1..=24).contains(&b)) {
            let bad = BadInput::new("is not a number of bits").key("--bits").value(self.bits.unwrap_or(0));
            return Err(bad.allowed("1..=24").into());
        }
        if let Some(x) = self.full_scale_dbm.filter(|x| !(-200.0..=100.0).contains(x)) {
            return Err(BadInput::new("is out of range")
                .key("--full-scale-dbm")
                .value(x)
                .allowed("-200..=100")
                .into());
        }
        let mut source = self.source()?;
        let shape = source.shape();
        let mut data = source.frame::<f64>(self.frame)?;
        let lost = LostChirps::find(shape, &data);
        let is_whole = |z: &Complex64| z.re.fract() == 0.0 && z.im.fract() == 0.0;
        let are_counts = data.iter().all(is_whole);
        lost.fill(&mut data);
        if are_counts {
            // The converter's steps are found in all samples.
            data.iter_mut().for_each(|z| *z = Complex64::new(z.re.round(), z.im.round()));
        }
        lost.lines().iter().for_each(|line| global.say(&format!("warning: {line}")));
        let cube = Cube { chirps: shape[0], channels: shape[1], samples: shape[2], data };
        check(&self.cube, &cube)?;
        let named = self.radar.as_deref().map(|r| radar_toml::load(r, Path::new("."))).transpose()?;
        let options = FitOptions { is_boresight: self.boresight, knows_antennas: named.is_some() };
        let is_assumed = named.is_none() && source.ti_radar().is_none();
        let cfg = configuration_beside(&self.cube);
        let radar = match (named, source.ti_radar()) {
            (Some(r), Some(ti)) => {
                ti.check_agrees(&cfg, &r)?;
                r
            }
            (Some(r), None) => r,
            (None, Some(ti)) => {
                let (radar, assumed) = radar_of_cfg(ti, &cfg, "ti", self.board)?;
                assumed.iter().for_each(|line| global.say(line));
                radar
            }
            (None, None) => radar_toml::parse(&self.cube, &assumed_radar_toml(shape))?,
        };
        unusual::of_radar(&radar).iter().for_each(|line| global.say(&format!("warning: {line}")));
        let found = fit(&self.cube, &cube, &radar, options)?;
        // Whole counts are no powers, whatever type of number holds them.
        let is_counts = self.words || !source.has_levels() || found.quantiser.is_some_and(|q| q.step >= 1.0);
        let (levels, how) = match self.full_scale_dbm {
            Some(dbm) => (Levels::FullScale(dbm), "full scale"),
            None if is_counts => (Levels::NoiseFigure, "noise figure"),
            None => (Levels::Absolute, "samples in sqrt(W)"),
        };
        let bits = self.bits.or(self.words.then_some(16));
        let made = fitted(&self.cube, &found, &radar, levels, bits)?;
        let staged = StagedDir::new(&self.output, global.force, "sensor-fit")?;
        let bar = global.bar("fitting", 0, Kept::Nothing);
        let simulated = made.simulated(&self.cube, &found, global.seed.unwrap_or(0))?;
        let again = fit(&self.cube, &simulated, &radar, options)?;
        let comparison = beside([&cube, &simulated], [&found, &again]);
        drop(bar);
        let name = self.cube.file_name().map_or("cube".into(), |n| n.to_string_lossy().into_owned());
        let head = [
            format!("Front end fitted to {name} by catseye {}", env!("CARGO_PKG_VERSION")),
            format!(
                "Powers, delays and phase noise are valid for the radar '{}'{}; powers by {how}",
                radar.name,
                if is_assumed { ", whose waveform is an assumption" } else { "" }
            ),
        ];
        let write = |file: &str, bytes: &[u8]| {
            let path = staged.path().join(file);
            std::fs::write(&path, bytes).map_err(|e| Error::io(&path, e))
        };
        write("front_end.toml", made.toml(&head)?.as_bytes())?;
        write("comparison.csv", table(&found, &again, &comparison).as_bytes())?;
        write("comparison.png", &picture(&name, &comparison)?)?;
        let front_end = catseye::scene::front_end::FrontEndTable::from(&made.radar.front_end);
        let mut report = Report {
            folder: staged.final_path().to_path_buf(),
            radar: &radar.name,
            is_assumed,
            levels: how,
            scale: made.scale,
            noise_figure_db: made.radar.thermal_noise.then_some(made.radar.noise_figure_db),
            front_end,
            remarks: &made.remarks,
            effects: effects(&found, &made),
            fit: &found,
            comparison: &comparison,
        };
        let text =
            serde_json::to_string_pretty(&report).map_err(|e| Error::Failed(format!("fit.json: {e}")))?;
        write("fit.json", text.as_bytes())?;
        report.folder = staged.commit()?;
        global.answer(&report, || summary(&report))
    }

    /// The cube's file. A NumPy array of two axes is [chirp, sample].
    fn source(&self) -> Result<Source> {
        let is_npy = self.cube.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
        let axes = match self.axes.as_deref() {
            Some(list) => Some(axes_from(list)?),
            None if is_npy && self.cube.is_file() && npy::read_header(&self.cube)?.shape.len() == 2 => {
                Some(vec![Axis::Chirp, Axis::Sample])
            }
            None => None,
        };
        let source = open_cube(
            &self.cube,
            &CubeOptions { axes, unsigned_words: self.words, ..Default::default() },
            None,
        )?;
        if !source.is_complex() {
            return Err(BadInput::new("the samples are real, but a fit needs I and Q")
                .file(&self.cube)
                .key("dtype")
                .allowed("complex numbers, or a last axis of I and Q")
                .into());
        }
        if self.frame >= source.frames() {
            return Err(BadInput::new("the file has no such frame")
                .file(&self.cube)
                .key("--frame")
                .value(self.frame)
                .allowed(format!("0..={}", source.frames().saturating_sub(1)))
                .into());
        }
        Ok(source)
    }
}

fn summary(report: &Report<'_>) -> String {
    let (f, c) = (report.fit, report.comparison);
    let mut lines = Vec::new();
    let [chirps, channels, samples] = f.shape;
    lines.push(format!(
        "{chirps} chirps, {channels} channels, {samples} samples; u is the unit of the samples"
    ));
    match f.quantiser {
        Some(q) => lines.push(format!("quantiser: step {} u, at least {} bits", q.step, q.least_bits)),
        None => lines.push("quantiser: the samples have no common step".into()),
    }
    let dc = f.mean_dc();
    lines.push(format!("constant: mean of the channels {:.3} u and {:.3} u", dc.re, dc.im));
    lines.push(format!(
        "noise: {:.3} u rms a part, {} of {} bins quiet, slope {:+.4} dB a bin",
        (0.5 * f.noise_variance).sqrt(),
        f.quiet.len(),
        samples,
        f.floor_slope_db
    ));
    if let Some(l) = &f.leak {
        lines.push(format!("spill-over: {:.3} u at bin {:.2}", l.rms, l.bin));
    }
    if let Some(l) = &f.line {
        lines.push(format!(
            "strongest line: bin {:.3}, {:.1} dB over the noise of a sample",
            l.bin, l.over_noise_db
        ));
    }
    if let Some(i) = &f.imbalance {
        let verdict = if i.is_significant { "" } else { ", not significant" };
        lines.push(format!(
            "I and Q: {:+.3} dB, {:+.2} deg, image {:.1} dB{verdict}",
            i.gain_db, i.phase_deg, i.image_db
        ));
    }
    if let Some([largest, mean]) = f.correlations() {
        lines.push(format!("noise of the channels: correlation up to {largest:.3}, mean {mean:.3}"));
    }
    lines.push(format!(
        "simulated beside it: noise KS distance {:.4} (p {:.1e}), samples KS distance {:.4}, floor rms {:.2} dB",
        c.noise_test.distance, c.noise_test.p_value, c.sample_test.distance, c.floor_db[0]
    ));
    if let (Some(main), Some(side)) = (c.main_lobe_db, c.side_lobe_db) {
        lines.push(format!(
            "strongest line: main lobe rms {:.2} dB, side lobes rms {:.2} dB",
            main[0], side[0]
        ));
    }
    if let Some([rms, worst]) = c.correlation_difference {
        lines.push(format!("correlation of the channels: rms difference {rms:.3}, largest {worst:.3}"));
    }
    lines.extend(report.remarks.iter().map(|r| format!("remark: {r}")));
    lines.push(format!("wrote {}", report.folder.display()));
    lines.join("\n")
}

/// Every figure of both cubes.
fn table(measured: &Fit, simulated: &Fit, c: &Beside) -> String {
    let mut text = String::from("quantity,at,unit,measured,simulated\n");
    let mut row = |name: &str, at: f64, unit: &str, a: Option<f64>, b: Option<f64>| {
        let show = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
        text += &format!("{name},{at},{unit},{},{}\n", show(a), show(b));
    };
    let both = |f: &dyn Fn(&Fit) -> Option<f64>| (f(measured), f(simulated));
    let one = |name: &str, unit: &str, f: &dyn Fn(&Fit) -> Option<f64>| {
        let (a, b) = both(f);
        (name.to_string(), unit.to_string(), a, b)
    };
    for (name, unit, a, b) in [
        one("quantiser_step", "u", &|f| f.quantiser.map(|q| q.step)),
        one("dc_i", "u", &|f| Some(f.mean_dc().re)),
        one("dc_q", "u", &|f| Some(f.mean_dc().im)),
        one("noise_variance", "u^2", &|f| Some(f.noise_variance)),
        one("leak_bin", "bin", &|f| f.leak.as_ref().map(|l| l.bin)),
        one("leak_rms", "u", &|f| f.leak.as_ref().map(|l| l.rms)),
        one("line_bin", "bin", &|f| f.line.as_ref().map(|l| l.bin)),
        one("line_over_noise", "dB", &|f| f.line.as_ref().map(|l| l.over_noise_db)),
        one("iq_gain", "dB", &|f| f.imbalance.as_ref().map(|i| i.gain_db)),
        one("iq_phase", "deg", &|f| f.imbalance.as_ref().map(|i| i.phase_deg)),
        one("floor_slope", "dB/bin", &|f| Some(f.floor_slope_db)),
    ] {
        row(&name, 0.0, &unit, a, b);
    }
    let curves: [(&str, &str, Option<&Both>); 4] = [
        ("noise_histogram", "share", Some(&c.histogram)),
        ("floor", "dB", Some(&c.floor)),
        ("side_lobes", "dB", c.side_lobes.as_ref()),
        ("correlation", "1", Some(&c.correlation)),
    ];
    for (name, unit, curve) in curves {
        for (i, at) in curve.iter().flat_map(|b| b.at.iter().enumerate()) {
            row(name, *at, unit, curve.map(|b| b.measured[i]), curve.map(|b| b.simulated[i]));
        }
    }
    text
}

/// Noise, floor, side lobes and correlation of both cubes.
fn picture(name: &str, c: &Beside) -> Result<Vec<u8>> {
    let panel = |title: &str, x_label: &str, y_label: &str, both: &Both, limits: Option<[f64; 2]>| {
        let curve = |label: &str, y: &[f64]| Curve {
            label: label.into(),
            points: both.at.iter().zip(y).map(|(x, y)| [*x, *y]).collect(),
        };
        Panel::Curves {
            title: format!("{name}: {title}"),
            x_label: x_label.into(),
            y_label: y_label.into(),
            curves: vec![curve("measured", &both.measured), curve("simulated", &both.simulated)],
            limits,
            decibels: false,
        }
    };
    let mut panels = vec![
        panel("noise of I and Q", "level over the standard deviation", "share", &c.histogram, None),
        panel("noise floor", "range bin", "over the mean (dB)", &c.floor, None),
    ];
    if let Some(s) = &c.side_lobes {
        panels.push(panel("strongest line", "offset (bins)", "under the peak (dB)", s, Some([-60.0, 5.0])));
    }
    if !c.correlation.at.is_empty() {
        let limits = Some([0.0, 1.0]);
        panels.push(panel("correlation of the noise", "pair of channels", "modulus", &c.correlation, limits));
    }
    study_picture(&panels, 2)?.png()
}
