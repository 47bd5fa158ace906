//! Options for reading cubes of others.

use super::global::choice;
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::{Radar, Sampling};
use catseye::scene::radar_toml;
use catseye_io::cube::{CubeOptions, Source, open_cube};
use catseye_io::cube_layout::axes_from;
use catseye_io::ti_bin::BinOptions;
use catseye_io::ti_cfg::{Board, IqOrder};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Reading the cube")]
pub struct CubeArgs {
    /// Axes of a .npy or .h5 file, slowest first, of frame, chirp, rx, sample, iq
    #[arg(long, value_name = "LIST")]
    pub axes: Option<String>,
    /// Frame of a file that holds several
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub frame: usize,
    /// TI configuration of a .bin (default: the .cfg of the same name)
    #[arg(long, value_name = "FILE")]
    pub cfg: Option<PathBuf>,
    /// Dataset of an .h5 file, or REAL,IMAGINARY
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Power of a sample of modulus 2^(bits-1) of a .bin; without it samples stay counts
    #[arg(long, value_name = "DBM")]
    pub full_scale_dbm: Option<f64>,
    /// Which of I and Q a .bin has first (default: what the .cfg says)
    #[arg(long, value_name = "iq|qi", value_parser = choice(&[("iq", IqOrder::Iq), ("qi", IqOrder::Qi)]))]
    pub iq_order: Option<IqOrder>,
    /// A .bin with one lane for each receiver, as of xWR14xx
    #[arg(long)]
    pub four_lanes: bool,
}

impl CubeArgs {
    /// The cube and its radar: the one that is named, or what the .cfg of a recording says. Errors: those of either; a cube of
    /// another shape; real samples for a radar with I and Q.
    pub fn open(&self, path: &Path, radar: Option<&str>) -> Result<(Source, Radar)> {
        let options = CubeOptions {
            axes: self.axes.as_deref().map(axes_from).transpose()?,
            cfg: self.cfg.clone(),
            bin: BinOptions {
                four_lanes: self.four_lanes.then_some(true),
                iq_order: self.iq_order,
                full_scale_dbm: self.full_scale_dbm,
            },
            dataset: self.dataset.clone(),
        };
        let named = radar.map(|r| radar_toml::load(r, Path::new("."))).transpose()?;
        let shape = named.as_ref().map(|r| [r.rows(), r.channels(), r.samples]);
        let source = open_cube(path, &options, shape)?;
        let radar = match (named, source.ti_radar()) {
            (Some(r), _) => r,
            (None, Some(ti)) => {
                let cfg = self.cfg.clone().unwrap_or_else(|| path.with_extension("cfg"));
                let name = path.file_stem().map_or_else(|| "ti".into(), |n| n.to_string_lossy().into_owned());
                radar_toml::parse(&cfg, &ti.to_radar_toml(&name, Board::Line)?)?
            }
            (None, None) => {
                return Err(BadInput::new("the cube does not say which radar it is of")
                    .file(path)
                    .key("--radar")
                    .remedy("give a preset or a radar TOML with --radar")
                    .into());
            }
        };
        if self.frame >= source.frames() {
            return Err(BadInput::new("the file has no such frame")
                .file(path)
                .key("--frame")
                .value(self.frame)
                .allowed(format!("0..={}", source.frames().saturating_sub(1)))
                .into());
        }
        if radar.sampling == Sampling::Iq && !source.is_complex() {
            return Err(BadInput::new("the samples are real, but the radar has I and Q")
                .file(path)
                .remedy("set receiver.sampling = \"real\" in the radar file")
                .into());
        }
        Ok((source, radar))
    }
}
