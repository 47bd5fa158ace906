//! `manifest.json`: what made a result, and its axes. Kind and checksums are added when the folder is
//! committed.

use catseye::adc::methods::Methods;
use catseye::adc::synthesis::EchoSummary;
use catseye::base::error::{Error, Result};
use catseye::dsp::doa_beamform::Grid;
use catseye::engine::{EngineReport, Stage, Tracing};
use catseye::formats::stage::MANIFEST;
use catseye::scene::ImportReport;
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml::to_toml;
use catseye::simulate::{Convergence, Frame, Stages};
use catseye::trace::Echoes;
use std::collections::BTreeMap;
use std::path::Path;

/// Evenly spaced values.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axis {
    /// First value.
    pub first: f64,
    /// Distance between values.
    pub step: f64,
    /// Number of values.
    pub count: usize,
}

impl Axis {
    /// All values.
    pub fn values(&self) -> Vec<f64> {
        (0..self.count).map(|i| self.first + i as f64 * self.step).collect()
    }
}

/// Axes of the range-Doppler map (CONVENTIONS eq. 15 and 16).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axes {
    /// Range of the columns, m.
    pub range_m: Axis,
    /// Range rate of the rows, m/s, positive receding.
    pub range_rate_mps: Axis,
    /// Range rates of the rows of each burst's map, `range_doppler.npy`, `range_doppler_1.npy` and so on, m/s, of a radar whose ramps are
    /// sent in bursts; empty for others, whose maps all have the rows above.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub range_rate_of_bursts_mps: Vec<Axis>,
    /// Azimuths of the columns of `angle_spectra.npy`, degrees, where that file is written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub azimuth_deg: Vec<f64>,
    /// Elevations of its rows, degrees.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elevation_deg: Vec<f64>,
}

impl Axes {
    /// The same with the directions of `angle_spectra.npy`.
    ///
    /// # Errors
    /// Returns an error if the radar's processing searches no directions.
    pub fn with_angles(self, radar: &Radar) -> Result<Axes> {
        let grid = Grid::new(radar)?;
        let degrees = |axis: Vec<f64>| axis.into_iter().map(f64::to_degrees).collect();
        Ok(Axes {
            azimuth_deg: degrees(grid.azimuth_rad),
            elevation_deg: degrees(grid.elevation_rad),
            ..self
        })
    }

    /// Axes of a radar's map.
    pub fn of(radar: &Radar) -> Axes {
        let rates = |radar: &Radar| {
            let (rows, step) = (radar.doppler_rows(), radar.velocity_bin_mps());
            Axis { first: -((rows / 2) as f64) * step, step, count: rows }
        };
        let bursts = if radar.waveform.is_in_bursts() { radar.waveform.parts() } else { 0 };
        Axes {
            range_m: Axis {
                first: radar.first_range_m(),
                step: radar.range_bin_m(),
                count: radar.range_bins(),
            },
            range_rate_mps: rates(radar),
            range_rate_of_bursts_mps: (0..bursts).map(|i| rates(&radar.part(i))).collect(),
            azimuth_deg: Vec::new(),
            elevation_deg: Vec::new(),
        }
    }
}

/// Data of a frame in the manifest.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FrameRecord {
    /// Number of the frame.
    pub index: u32,
    /// Name of the radar.
    pub radar: String,
    /// Time of the frame, s.
    pub time_s: f64,
    /// Number of triangles that were traced.
    pub triangles: usize,
    /// Number of rays that were traced.
    pub rays: u64,
    /// Number of echoes.
    pub returns: usize,
    /// Statistics of the front end.
    pub front_end: FrontEndRecord,
    /// Where the beams of the frame were followed. Runs made before December 2026 say nothing here; they had the host.
    #[serde(default = "FrameTrace::host")]
    pub trace: FrameTrace,
    /// Number of points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Convergence of each object, where it was requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub convergence: Vec<Convergence>,
    /// Times of the stages; not part of the result's identity.
    pub seconds: Stages,
}

/// Where the beams of a frame were followed.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FrameTrace {
    /// The place.
    pub on: Tracing,
    /// Why the device left the frame to the host; None where it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<String>,
}

impl FrameTrace {
    fn host() -> FrameTrace {
        FrameTrace { on: Tracing::Host, fallback: None }
    }

    /// Where the beams of these echoes were followed.
    pub fn of(echoes: &Echoes) -> FrameTrace {
        let on = if echoes.on_device { Tracing::Device } else { Tracing::Host };
        FrameTrace { on, fallback: echoes.fallback.as_deref().map(String::from) }
    }
}

/// Where the beams of all frames of a run were followed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RunTrace {
    /// The place that the engine was told.
    pub on: Tracing,
    /// Number of frames that the device traced.
    pub on_device: u64,
    /// Number of frames that the host traced.
    pub on_host: u64,
    /// Number of frames that the device left to the host, by the reason.
    pub fallbacks: BTreeMap<String, u64>,
}

impl RunTrace {
    /// Counts the frames of a run.
    pub fn of(on: Tracing, frames: &[FrameRecord]) -> RunTrace {
        let mut counted = RunTrace { on, on_device: 0, on_host: 0, fallbacks: BTreeMap::new() };
        for FrameTrace { on, fallback } in frames.iter().map(|f| &f.trace) {
            match on {
                Tracing::Device | Tracing::Lines => counted.on_device += 1,
                Tracing::Host => counted.on_host += 1,
            }
            if let Some(why) = fallback {
                *counted.fallbacks.entry(why.clone()).or_default() += 1;
            }
        }
        counted
    }
}

/// Statistics of the front end for the echoes of a frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FrontEndRecord {
    /// Number of moving echoes.
    pub moving: u64,
    /// Number of echoes that the anti-alias filter stopped.
    pub dropped: u64,
    /// Power of echoes out of the receiver's band, W.
    pub dropped_power_w: f64,
    /// Number of echoes that were merged into others of the same place and path.
    #[serde(default)]
    pub merged: u64,
    /// Number of echoes that were left out because all of them together cannot show.
    #[serde(default)]
    pub left_out: u64,
    /// Sum of their powers, mean over channels, W.
    #[serde(default)]
    pub left_out_power_w: f64,
    /// Number of bounces that were followed.
    #[serde(default)]
    pub bounces: u64,
    /// Power of the echoes, mean over channels, W; those of one chain in one range cell are added coherently.
    #[serde(default)]
    pub power_w: f64,
    /// Estimated power that one more bounce would have brought, W, seldom 6 dB too low or 20 dB too high
    /// (CONVENTIONS eq. 68).
    #[serde(default)]
    pub cut_power_w: f64,
    /// Number of echoes that were left out because they are non-finite.
    #[serde(default)]
    pub broken: u64,
    /// Method by which the echoes were summed.
    pub synthesis: Methods,
}

impl FrameRecord {
    /// The record of a frame.
    pub fn of(radar: &str, frame: &Frame, convergence: Vec<Convergence>) -> Self {
        let EchoSummary {
            moving,
            dropped,
            dropped_power_w,
            merged,
            left_out,
            left_out_power_w,
            bounces,
            power_w,
            cut_power_w,
            broken,
            synthesis,
            ..
        } = frame.echo_summary;
        FrameRecord {
            index: frame.index,
            radar: radar.into(),
            time_s: frame.time_s,
            triangles: frame.triangles,
            rays: frame.echoes.rays,
            returns: frame.echoes.list.len(),
            front_end: FrontEndRecord {
                moving,
                dropped,
                dropped_power_w,
                merged,
                left_out,
                left_out_power_w,
                bounces,
                power_w,
                cut_power_w,
                broken,
                synthesis,
            },
            trace: FrameTrace::of(&frame.echoes),
            points: (frame.ran.of(Stage::Angles) > 0).then_some(frame.points.len()),
            convergence,
            seconds: frame.stages,
        }
    }
}

/// A value of one radar as it is, or values of several radars under their names.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum PerRadar<T> {
    /// Value of the only radar.
    One(T),
    /// Values by names of radars.
    Several(BTreeMap<String, T>),
}

impl<T> PerRadar<T> {
    /// The value of the radar of this name.
    pub fn get(&self, name: &str) -> Option<&T> {
        match self {
            PerRadar::One(one) => Some(one),
            PerRadar::Several(by_name) => by_name.get(name),
        }
    }

    /// Collects the value of `what` for each radar.
    ///
    /// # Errors
    /// Returns the first error of `what`.
    pub fn of(radars: &[Radar], what: impl Fn(&Radar) -> Result<T>) -> Result<Self> {
        match radars {
            [one] => Ok(PerRadar::One(what(one)?)),
            several => {
                let list = several.iter().map(|r| Ok((r.name.clone(), what(r)?)));
                Ok(PerRadar::Several(list.collect::<Result<_>>()?))
            }
        }
    }
}

/// Returns the full radars as TOML, and copies the calibration that each reads into `dir`: `calibration.csv`,
/// with several radars `calibration_NAME.csv`. The TOML names the copy, so that beside it the same radar is
/// read.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn keep_radars(dir: &Path, radars: &[Radar]) -> Result<PerRadar<String>> {
    PerRadar::of(radars, |radar| {
        let mut kept = radar.clone();
        if let Some(calibration) = &mut kept.processing.angle.calibration {
            let name = match radars {
                [_] => "calibration.csv".to_string(),
                _ => format!("calibration_{}.csv", radar.name),
            };
            let path = dir.join(&name);
            std::fs::write(&path, &calibration.text).map_err(|e| Error::io(&path, e))?;
            calibration.path = name.into();
        }
        to_toml(&kept)
    })
}

/// Where the echoes of a run come from that traced nothing.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EchoSource {
    /// Name of the scenario that traced them.
    pub scenario_name: String,
    /// SHA-256 of that run's `manifest.json`.
    pub manifest_sha256: String,
}

/// Content of the `manifest.json` of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Manifest {
    /// Version of catseye.
    pub catseye: &'static str,
    /// Engine that made it.
    pub engine: EngineReport,
    /// Rule by which `auto` chose it, where it had a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine_rule: Option<&'static str>,
    /// Where the beams of its frames were followed; None where nothing was traced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trace: Option<RunTrace>,
    /// The run whose echoes these frames are made of; None where they were traced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub echoes_from: Option<EchoSource>,
    /// Seed of all draws.
    pub seed: u64,
    /// Text of the scenario file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// Name of the scenario.
    pub scenario_name: String,
    /// The radar in full, as TOML ([`keep_radars`]).
    pub radar: PerRadar<String>,
    /// Axes of its maps.
    pub axes: PerRadar<Axes>,
    /// Report on an imported file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub import: Option<ImportReport>,
    /// Properties of the scene's meshes that may show in the frames ([`catseye::simulate::Prepared::remarks`]), or what was assumed of a
    /// cube that was recorded elsewhere; one line each.
    pub remarks: Vec<String>,
    /// Records of the frames.
    pub frames: Vec<FrameRecord>,
}

impl Manifest {
    /// Writes the file into `dir`; `StagedDir::commit` adds kind and checksums.
    ///
    /// # Errors
    /// Returns an error if the manifest cannot be serialized or written.
    pub fn write(&self, dir: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        let path = dir.join(MANIFEST);
        std::fs::write(&path, text).map_err(|e| Error::io(&path, e))
    }
}
