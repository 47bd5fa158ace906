//! `catseye process`: a cube, from wherever, to range-Doppler map, detections and points.

use super::bar::Kept;
use super::cube_args::{CubeArgs, OpenedCube};
use super::frames::draw_map;
use super::global::Global;
use catseye::adc::Cube;
use catseye::base::error::{BadInput, Result};
use catseye::detect::Bodies;
use catseye::detect::conjugate::looks_conjugate;
use catseye::engine::{AnyCube, Engine, Precision, Purpose};
use catseye::formats::stage::{self, StagedDir};
use catseye::scene::radar::{Radar, Sampling};
use catseye::simulate::{Stages, detect, located};
use catseye::trace::Echoes;
use catseye_io::cube::{Checks, Source};
use catseye_io::files::{write_maps, write_point_file};
use catseye_io::manifest::{Axes, Manifest, PerRadar, keep_radars};
use clap::Args;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Process a cube of ADC samples: range-Doppler map, detections, points, plots
#[derive(Debug, Args)]
pub struct Process {
    /// Cube [chirp, rx_virtual, sample]: NumPy (.npy), TI DCA1000 recording (.bin with its .cfg), HDF5 (.h5)
    pub cube: PathBuf,
    /// Preset (catseye help radars lists them) or radar file (TOML); not needed for a recording with a .cfg
    #[arg(long)]
    pub radar: Option<String>,
    /// Folder to write
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Forward speed of the vehicle, m/s, which resolves the Doppler ambiguity of stationary objects
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    pub ego_speed_mps: Option<f64>,
    #[command(flatten)]
    pub input: CubeArgs,
}

#[derive(serde::Serialize)]
struct Report {
    #[serde(serialize_with = "catseye::formats::path_text")]
    folder: PathBuf,
    /// Whether levels are those at the receiver's input; counts of a converter have none.
    absolute_levels: bool,
    /// What was assumed of the recording and what looks wrong in it, one line each.
    assumed: Vec<String>,
    /// Number of chirps in which samples are lost.
    lost_chirps: usize,
    /// Whether directions are found with a calibration of the array (`processing.angle.calibration_file`).
    calibrated: bool,
    /// Read by blocks of channels, because the cube is large.
    streamed: bool,
    cells_over_threshold: usize,
    points: usize,
    seconds: Stages,
}

/// Samples beyond which a cube is read by blocks of channels (256 MiB in complex64).
const STREAMED: usize = 1 << 25;

impl Process {
    pub fn run(&self, global: &Global) -> Result<()> {
        stage::distinct(&[&self.output], &[&self.cube])?;
        let OpenedCube { mut source, radar, mut assumed } =
            self.input.open(&self.cube, self.radar.as_deref())?;
        assumed.iter().for_each(|line| global.say(line));
        let own = self.velocity_mps(&radar)?;
        let staged = StagedDir::new(&self.output, global.force, "process")?;
        let (engine, rule) = global.engine_for(Purpose::Cubes)?;
        let bar = global.bar("processing", 0, Kept::Nothing);
        let size: usize = source.shape().iter().product();
        let streamed = size > STREAMED && Engine::can_stream(&radar) && !is_f64(&engine);
        let mut seconds = Stages::default();
        let mut checks = Checks::default();
        let (maps, points) = match streamed {
            true => self.by_blocks(&engine, &radar, own, &mut source, &mut checks, &mut seconds)?,
            false => {
                engine.check_memory(&radar, 0)?;
                let (cube, found) = whole(&engine, &mut source, self.input.frame)?;
                check_parts(&self.cube, &radar, found.parts)?;
                checks = found;
                let nothing = (&Echoes::default(), &Bodies::default());
                detect(&engine, &radar, &cube, own, nothing, &mut seconds)?
            }
        };
        // Whole numbers are counts, whatever type of number holds them.
        let absolute_levels = source.has_levels() && !(source.ti_radar().is_none() && checks.are_counts);
        if !absolute_levels {
            let line = match source.ti_radar() {
                Some(_) => {
                    "the full scale of the recording is unknown: powers are relative (--full-scale-dbm sets it)"
                }
                None => {
                    "the samples are integers: powers are relative (samples in sqrt(W) give absolute ones)"
                }
            };
            bar.suspend(|| global.say(line));
        }
        let about = checks
            .lost
            .lines()
            .into_iter()
            .chain(checks.lines.clone())
            .chain(looks_conjugate(&radar, &maps[0].map).map(|l| l + " (--conjugate)"));
        for line in about {
            bar.suspend(|| global.say(&format!("warning: {line}")));
            assumed.push(line);
        }
        write_maps(staged.path(), &maps)?;
        write_point_file(staged.path(), &points)?;
        let title = self.cube.file_name().map_or("cube".into(), |n| n.to_string_lossy().into_owned());
        draw_map(&title, &radar, &maps[0], &points, staged.path())?;
        Manifest {
            catseye: env!("CARGO_PKG_VERSION"),
            engine: engine.report(),
            engine_rule: rule,
            trace: None,
            echoes_from: None,
            seed: 0,
            scenario: None,
            scenario_name: title,
            radar: keep_radars(staged.path(), std::slice::from_ref(&radar))?,
            axes: PerRadar::One(Axes::of(&radar)),
            import: None,
            remarks: assumed.clone(),
            frames: Vec::new(),
        }
        .write(staged.path())?;
        let report = Report {
            absolute_levels,
            lost_chirps: checks.lost.chirps(),
            assumed,
            calibrated: radar.processing.angle.calibration.is_some(),
            streamed,
            cells_over_threshold: maps.iter().map(|m| m.detection.mask.iter().filter(|m| **m).count()).sum(),
            points: points.len(),
            seconds,
            folder: staged.commit()?,
        };
        drop(bar);
        global.answer(&report, || {
            format!(
                "{} cells over the threshold, {} points, {:.2} s; wrote {}",
                report.cells_over_threshold,
                report.points,
                report.seconds.total_s(),
                report.folder.display()
            )
        })
    }

    /// Memory holds one block of channels at a time.
    fn by_blocks(
        &self,
        engine: &Engine,
        radar: &Radar,
        own: Option<DVec3>,
        source: &mut Source,
        checks: &mut Checks,
        seconds: &mut Stages,
    ) -> Result<(Vec<catseye::dsp::RangeDoppler<f64>>, Vec<catseye::detect::Point>)> {
        let start = Instant::now();
        let frame = self.input.frame;
        // Blocks may be read again: each counts once.
        let mut seen = 0;
        let mut maps = vec![engine.range_doppler_streamed(radar, &mut |channels, out| {
            let (data, found) = source.repaired::<f32>(frame, channels.clone())?;
            out.copy_from_slice(&data);
            if channels.start == seen {
                if seen == 0 {
                    *checks = found
                } else {
                    checks.append(&found)
                }
                seen = channels.end;
            }
            Ok(())
        })?];
        seconds.processing_s = start.elapsed().as_secs_f64();
        check_parts(source.path(), radar, checks.parts)?;
        let points = located(engine, radar, &mut maps, own, (&Echoes::default(), &Bodies::default()))?;
        seconds.angles_s = start.elapsed().as_secs_f64() - seconds.processing_s;
        Ok((maps, points))
    }

    /// The radar's velocity in its own frame, where the vehicle's speed is given. Errors: a speed of no vehicle.
    fn velocity_mps(&self, radar: &Radar) -> Result<Option<DVec3>> {
        let Some(v) = self.ego_speed_mps else { return Ok(None) };
        if v.is_nan() || v.abs() > 150.0 {
            let e = BadInput::new("is out of range").key("--ego-speed-mps").value(v);
            return Err(e.allowed("-150..=150 m/s").into());
        }
        Ok(Some(radar.mounting.inverse().direction(v * DVec3::X)))
    }
}

/// Samples of one kind for a radar of the other: half of them would be left out, or each echo would have an image.
pub fn check_parts(cube: &Path, radar: &Radar, [real, imaginary]: [bool; 2]) -> Result<()> {
    let bad = |problem: &str, remedy: &str| Err(BadInput::new(problem).file(cube).remedy(remedy).into());
    match (radar.sampling, real, imaginary) {
        (Sampling::Iq, true, false) => bad(
            "all imaginary parts are zero, but the radar has I and Q",
            "set receiver.sampling = \"real\" in the radar file",
        ),
        (Sampling::Real, _, true) => bad(
            "the samples have imaginary parts, but the radar samples real signals",
            "set receiver.sampling = \"iq\" in the radar file",
        ),
        _ => Ok(()),
    }
}

fn is_f64(engine: &Engine) -> bool {
    matches!(engine, Engine::Cpu(Precision::F64))
}

/// All samples of one frame in the engine's precision, with lost chirps filled.
fn whole(engine: &Engine, source: &mut Source, frame: usize) -> Result<(AnyCube, Checks)> {
    let [chirps, channels, samples] = source.shape();
    Ok(match is_f64(engine) {
        true => {
            let (data, lost) = source.repaired::<f64>(frame, 0..channels)?;
            (AnyCube::F64(Cube { chirps, channels, samples, data }), lost)
        }
        false => {
            let (data, lost) = source.repaired::<f32>(frame, 0..channels)?;
            (AnyCube::F32(Cube { chirps, channels, samples, data }), lost)
        }
    })
}
