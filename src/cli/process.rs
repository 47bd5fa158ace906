//! `catseye process`: a cube, from wherever, to range-Doppler map, detections and points.

use super::frames::draw_map;
use super::{Global, print, print_json};
use crate::adc::Cube;
use crate::dataset::files::{write_maps, write_point_file};
use crate::dataset::frame::{Stages, detect};
use crate::dataset::manifest::{Axes, Manifest, PerRadar};
use crate::engine::{AnyCube, Engine, Precision};
use crate::error::{BadInput, Result};
use crate::formats::npy;
use crate::formats::stage::StagedDir;
use crate::scene::radar::Radar;
use crate::scene::radar_toml;
use crate::trace::Returns;
use clap::Args;
use std::path::{Path, PathBuf};

/// Process a cube of samples: range-Doppler map, detections, points, pictures
#[derive(Debug, Args)]
pub struct Process {
    /// complex64 (or complex128, or real) NumPy file, [chirp, rx_virtual, sample]
    pub cube: PathBuf,
    /// Preset (feng77, front77, demo77, fmcw76, uwb9) or radar TOML
    #[arg(long)]
    pub radar: String,
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
}

#[derive(serde::Serialize)]
struct Report {
    folder: PathBuf,
    cells_over_threshold: usize,
    points: usize,
    seconds: Stages,
}

impl Process {
    pub fn run(&self, global: &Global) -> Result<()> {
        let radar = radar_toml::load(&self.radar, Path::new("."))?;
        let staged = StagedDir::new(&self.output, global.force)?;
        let engine = global.engine()?;
        let cube = match engine {
            Engine::Cpu(Precision::F64) => {
                let a = npy::read_complex64(&self.cube)?;
                npy::check_finite(&self.cube, &a, |z| z.re.is_finite() && z.im.is_finite())?;
                AnyCube::F64(shaped(&self.cube, &radar, a.shape, a.data)?)
            }
            _ => {
                let a = npy::read_complex32(&self.cube)?;
                npy::check_finite(&self.cube, &a, |z| z.re.is_finite() && z.im.is_finite())?;
                AnyCube::F32(shaped(&self.cube, &radar, a.shape, a.data)?)
            }
        };
        let mut seconds = Stages::default();
        let (maps, points) = detect(&engine, &radar, &cube, &Returns::default(), &[], &mut seconds)?;
        write_maps(staged.path(), &maps)?;
        write_point_file(staged.path(), &points)?;
        let title = self.cube.file_name().map_or("cube".into(), |n| n.to_string_lossy().into_owned());
        draw_map(&title, &radar, &maps[0], &points, staged.path())?;
        Manifest {
            catseye: env!("CARGO_PKG_VERSION"),
            engine: engine.report(),
            seed: 0,
            scenario: None,
            scenario_name: title,
            radar: PerRadar::One(radar_toml::to_toml(&radar)?),
            axes: PerRadar::One(Axes::of(&radar)),
            import: None,
            frames: Vec::new(),
            checksums: Default::default(),
        }
        .write(staged.path())?;
        let report = Report {
            cells_over_threshold: maps.iter().map(|m| m.detection.mask.iter().filter(|m| **m).count()).sum(),
            points: points.len(),
            seconds,
            folder: staged.commit()?,
        };
        if global.json {
            return print_json(&report);
        }
        print(&format!(
            "{} cells over the threshold, {} points, {:.2} s; wrote {}",
            report.cells_over_threshold,
            report.points,
            report.seconds.total_s(),
            report.folder.display()
        ))
    }
}

/// The array as a cube of this radar.
fn shaped<T>(
    file: &Path,
    radar: &Radar,
    shape: Vec<usize>,
    data: Vec<num_complex::Complex<T>>,
) -> Result<Cube<T>> {
    let want = [radar.rows(), radar.channels(), radar.samples];
    if shape != want {
        return Err(BadInput::new("the array is not a cube of this radar")
            .file(file)
            .key("shape")
            .value(format!("{shape:?}"))
            .allowed(format!("{want:?}: [chirp, rx_virtual, sample]"))
            .remedy("give the radar that recorded it with --radar")
            .into());
    }
    Ok(Cube { chirps: want[0], channels: want[1], samples: want[2], data })
}
