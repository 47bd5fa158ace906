//! `catseye calibrate`: a turntable run of a corner reflector, in simulation, to a calibration file.

use super::angles::parse_list;
use super::bar::Kept;
use super::global::Global;
use catseye::base::error::{BadInput, Error, Result};
use catseye::dsp::doa_calibration::TurntableOptions;
use catseye::formats::check_extension;
use catseye::formats::stage::{StagedFile, distinct};
use catseye::road::reflector::Reflector;
use catseye::scene::{material, radar_toml};
use catseye_io::turntable::{Turntable, run};
use catseye_plot::{ColourMap, PICTURE_EXTENSIONS, Scale, heat_map};
use clap::Args;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Calibrate an array on a simulated turntable: one steering vector for each angle, and the ambiguity of the array
#[derive(Debug, Args)]
pub struct Calibrate {
    /// Preset or radar file (TOML) with channel errors
    #[arg(long)]
    pub radar: String,
    /// Azimuths of the reflector in the radar's frame, positive to the left
    #[arg(long, default_value = "-60:60:1", value_name = "LIST", allow_hyphen_values = true)]
    pub azimuth_deg: String,
    /// Elevations of the reflector in the radar's frame, positive up
    #[arg(long, default_value = "0", value_name = "LIST", allow_hyphen_values = true)]
    pub elevation_deg: String,
    /// Distance of the reflector, m
    #[arg(long, default_value_t = 20.0, value_name = "R")]
    pub range_m: f64,
    /// Reflector, with its x axis towards the radar (catseye help reflectors lists all)
    #[arg(long, default_value = "point:rcs_dbsm=14.5")]
    pub target: String,
    /// Half width of the smoothing over neighbouring angles, degrees; 0: no smoothing
    #[arg(long, default_value_t = 0.0, value_name = "DEG")]
    pub smoothing_deg: f64,
    /// Calibrate the channels' amplitudes as well as their phases
    #[arg(long)]
    pub levels: bool,
    /// Calibration file to write (CSV)
    #[arg(short, long, value_name = "FILE.csv")]
    pub output: PathBuf,
    /// Plot of the ambiguity matrix |S^H S| to write
    #[arg(long, value_name = "FILE.png|FILE.svg|FILE.pdf")]
    pub plot: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct Report {
    #[serde(serialize_with = "catseye::formats::path_text")]
    file: PathBuf,
    angles: usize,
    channels: usize,
    /// Largest |S^H S| between angles farther apart than a tenth of the field.
    largest_ambiguity: f64,
}

impl Calibrate {
    pub fn run(&self, global: &Global) -> Result<()> {
        let radar = radar_toml::load(&self.radar, Path::new("."))?;
        let target = Reflector::parse(&self.target)?.to_scene(&material::by_name)?;
        let table = Turntable {
            range_m: self.range_m,
            azimuth_deg: parse_list("azimuth-deg", &self.azimuth_deg)?,
            elevation_deg: parse_list("elevation-deg", &self.elevation_deg)?,
            seed: global.seed.unwrap_or(0),
            options: TurntableOptions { unit_modulus: !self.levels, smoothing_deg: self.smoothing_deg },
        };
        let angles = table.azimuth_deg.len() * table.elevation_deg.len();
        if angles > 4096 {
            return Err(BadInput::new(format!("{angles} positions of the turntable"))
                .key("--azimuth-deg")
                .allowed("up to 4096, azimuths times elevations")
                .remedy("use larger steps")
                .into());
        }
        let outputs: Vec<&Path> =
            std::iter::once(&self.output).chain(&self.plot).map(PathBuf::as_path).collect();
        distinct(&outputs, &[Path::new(&self.radar)])?;
        check_extension(&self.output, &["csv"])?;
        self.plot.as_ref().map_or(Ok(()), |p| check_extension(p, &PICTURE_EXTENSIONS))?;
        let staged = StagedFile::new(&self.output, global.force)?;
        let engine = global.engine()?;
        let bar = global.bar("angles", angles as u64, Kept::Nothing);
        let calibration = run(&engine, &radar, &target, &table, &mut || bar.inc(1))?;
        drop(bar);
        let file = File::create(staged.path()).map_err(|e| Error::io(staged.path(), e))?;
        let comments = [
            format!("catseye {}, radar {}, {}", env!("CARGO_PKG_VERSION"), radar.name, engine.describe()),
            format!("turntable: {} at {} m, seed {}", self.target, self.range_m, table.seed),
        ];
        calibration.write(BufWriter::new(file), &comments).map_err(|e| Error::io(staged.final_path(), e))?;
        let matrix = calibration.ambiguity();
        if let Some(plot) = &self.plot {
            let (n, ends) = (angles, |v: &[f64]| (v[0], v[v.len() - 1]));
            let span = match table.elevation_deg.len() {
                1 => ends(&table.azimuth_deg),
                _ => (0.0, (n - 1) as f64),
            };
            let label = if table.elevation_deg.len() == 1 { "azimuth (deg)" } else { "angle" };
            let scale = Scale::new(ColourMap::Viridis, "|S^H S|", 0.0, 1.0);
            heat_map(
                &format!("{}: ambiguity between angles", radar.name),
                (label, span),
                (label, span),
                (n, n),
                matrix.clone(),
                scale,
            )
            .draw()?
            .write(plot, global.force)?;
        }
        let cols = table.azimuth_deg.len();
        let far = |a: usize, b: usize, of: usize| a.abs_diff(b) > of.div_ceil(10);
        let largest_ambiguity = (0..angles)
            .flat_map(|i| (0..angles).map(move |j| (i, j)))
            .filter(|(i, j)| {
                far(i % cols, j % cols, cols) || far(i / cols, j / cols, table.elevation_deg.len())
            })
            .map(|(i, j)| matrix[i * angles + j])
            .fold(0.0, f64::max);
        let report =
            Report { file: staged.commit()?, angles, channels: radar.virtual_channels(), largest_ambiguity };
        global.answer(&report, || {
            format!(
                "{} angles, {} channels; largest ambiguity between distant angles {:.3}; wrote {}",
                report.angles,
                report.channels,
                report.largest_ambiguity,
                report.file.display()
            )
        })
    }
}
