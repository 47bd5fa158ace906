//! Options for reading cubes of others.

use super::global::choice;
use catseye::base::error::{BadInput, Result};
use catseye::scene::radar::{Radar, Sampling};
use catseye::scene::{radar_toml, unusual};
use catseye_io::cube::{CubeOptions, Source, configuration_beside, open_cube};
use catseye_io::cube_layout::axes_from;
use catseye_io::ti_bin::BinOptions;
use catseye_io::ti_cfg::{BOARDS, Board, IqOrder, TiRadar};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Reading the cube")]
pub struct CubeArgs {
    /// Axes of a .npy or .h5 file, slowest first, from: frame, chirp, rx, sample, iq
    #[arg(long, value_name = "LIST")]
    pub axes: Option<String>,
    /// Index of the frame in a file with several frames
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub frame: usize,
    /// TI configuration of a .bin: .cfg, .mmwave.json or .setup.json (default: the file of the same name)
    #[arg(long, value_name = "FILE")]
    pub cfg: Option<PathBuf>,
    /// Dataset of an .h5 file, or REAL,IMAGINARY
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Power of a sample of modulus 2^(bits-1) of a .bin; without it samples stay in counts
    #[arg(long, value_name = "DBM")]
    pub full_scale_dbm: Option<f64>,
    /// Order of I and Q in a .bin (default: as the .cfg states)
    #[arg(long, value_name = "iq|qi", value_parser = choice(&[("iq", IqOrder::Iq), ("qi", IqOrder::Qi)]))]
    pub iq_order: Option<IqOrder>,
    /// The .bin has one lane for each receiver, as from xWR14xx
    #[arg(long)]
    pub four_lanes: bool,
    /// Number format: plain, or unsigned 16-bit words that contain signed counts
    #[arg(long, default_value = "plain", action = clap::ArgAction::Set, value_name = "plain|unsigned16", value_parser = choice(&[("plain", false), ("unsigned16", true)]))]
    pub words: bool,
    /// Conjugate every sample, for cubes with the opposite sign of phase
    #[arg(long)]
    pub conjugate: bool,
    /// Board of a .bin, which gives the antenna positions (default: the board named in the .cfg, else awr1843, below 70 GHz iwr6843)
    #[arg(long, value_name = "NAME", value_parser = choice(&BOARDS), conflicts_with = "radar")]
    pub board: Option<Board>,
}

/// A cube that is open, its radar, and what was assumed of it, one line each.
pub struct OpenedCube {
    pub source: Source,
    pub radar: Radar,
    pub assumed: Vec<String>,
}

/// The radar of a recording's .cfg, with what was assumed.
pub fn radar_of_cfg(
    ti: &TiRadar,
    cfg: &Path,
    name: &str,
    board: Option<Board>,
) -> Result<(Radar, Vec<String>)> {
    Ok((radar_toml::parse(cfg, &ti.to_radar_toml(name, board)?)?, ti.assumptions(board)))
}

impl CubeArgs {
    /// The cube and its radar: the one that is named, or what the .cfg of a recording says. Errors: those of either; a radar that the
    /// .cfg contradicts; a cube of another shape; real samples for a radar with I and Q.
    pub fn open(&self, path: &Path, radar: Option<&str>) -> Result<OpenedCube> {
        let options = CubeOptions {
            axes: self.axes.as_deref().map(axes_from).transpose()?,
            cfg: self.cfg.clone(),
            bin: BinOptions {
                four_lanes: self.four_lanes.then_some(true),
                iq_order: self.iq_order,
                full_scale_dbm: self.full_scale_dbm,
            },
            dataset: self.dataset.clone(),
            conjugate: self.conjugate,
            unsigned_words: self.words,
        };
        let named = radar.map(|r| radar_toml::load(r, Path::new("."))).transpose()?;
        let shape = named.as_ref().map(|r| [r.rows(), r.channels(), r.samples]);
        let source = open_cube(path, &options, shape)?;
        let cfg = self.cfg.clone().unwrap_or_else(|| configuration_beside(path));
        let (radar, mut assumed) = match (named, source.ti_radar()) {
            (Some(r), Some(ti)) => {
                ti.check_agrees(&cfg, &r)?;
                (r, Vec::new())
            }
            (Some(r), None) => (r, Vec::new()),
            (None, Some(ti)) => {
                let name = path.file_stem().map_or_else(|| "ti".into(), |n| n.to_string_lossy().into_owned());
                radar_of_cfg(ti, &cfg, &name, self.board)?
            }
            (None, None) => {
                return Err(BadInput::new("the cube does not state which radar recorded it")
                    .file(path)
                    .key("--radar")
                    .remedy("give a preset or a radar TOML with --radar")
                    .into());
            }
        };
        if source.frames() > 1 {
            assumed.push(format!(
                "frame {} of {} is used (--frame N selects another)",
                self.frame,
                source.frames()
            ));
        }
        assumed.extend(unusual::of_radar(&radar).into_iter().map(|line| format!("warning: {line}")));
        if self.frame >= source.frames() {
            return Err(BadInput::new("the file has no such frame")
                .file(path)
                .key("--frame")
                .value(self.frame)
                .allowed(format!("0..={}", source.frames().saturating_sub(1)))
                .into());
        }
        if self.conjugate && radar.sampling == Sampling::Real {
            return Err(BadInput::new("real samples cannot be conjugated")
                .file(path)
                .key("--conjugate")
                .remedy("leave it out")
                .into());
        }
        if radar.sampling == Sampling::Iq && !source.is_complex() {
            return Err(BadInput::new("the samples are real, but the radar has I and Q")
                .file(path)
                .remedy("set receiver.sampling = \"real\" in the radar file")
                .into());
        }
        Ok(OpenedCube { source, radar, assumed })
    }
}
