//! `catseye convert`: a cube from one file format to another.

use super::bar::Kept;
use super::cube_args::{CubeArgs, OpenedCube};
use super::global::{Global, print, print_json};
use super::process::check_parts;
use catseye::base::error::Result;
use catseye::dsp::lost_chirps::LostChirps;
use catseye::dsp::sample_checks;
use catseye::formats::stage;
use catseye::scene::radar_toml;
use catseye_io::cube::{CubeAbout, write_cube};
use catseye_io::recording;
use clap::Args;
use std::path::{Path, PathBuf};

/// Convert a cube of ADC samples between formats: NumPy, TI DCA1000 recording with its .cfg, HDF5
#[derive(Debug, Args)]
pub struct Convert {
    /// Cube to read: a .npy, .bin (with its .cfg) or .h5 file
    pub cube: PathBuf,
    /// Preset or radar file (TOML); not needed for a recording with a .cfg
    #[arg(long)]
    pub radar: Option<String>,
    /// Cube to write: a .npy, .bin or .h5 file
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Full scale of a .bin to write (default: the lowest at which no sample is clipped)
    #[arg(long, value_name = "DBM")]
    pub output_full_scale_dbm: Option<f64>,
    #[command(flatten)]
    pub input: CubeArgs,
}

#[derive(serde::Serialize)]
struct Report {
    files: Vec<String>,
    shape: [usize; 3],
    clipped_words: u64,
    /// Number of chirps in which samples are lost.
    lost_chirps: usize,
}

impl Convert {
    pub fn run(&self, global: &Global) -> Result<()> {
        let radar_file = self.radar.as_deref().map(Path::new);
        let inputs: Vec<&Path> = std::iter::once(self.cube.as_path()).chain(radar_file).collect();
        stage::distinct(&[&self.output], &inputs)?;
        let OpenedCube { mut source, radar, assumed } = self.input.open(&self.cube, self.radar.as_deref())?;
        assumed.iter().for_each(|line| global.say(line));
        let is_bin = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("bin"));
        let ti_radar = match (is_bin, source.ti_radar()) {
            (false, _) => None,
            (true, Some(ti)) => Some(ti.clone()),
            (true, None) => Some(recording::ti_radar(&radar)?),
        };
        let about = CubeAbout {
            radar_toml: Some(radar_toml::to_toml(&radar)?),
            seed: None,
            ti_radar,
            full_scale_dbm: self.output_full_scale_dbm,
        };
        let shape = source.shape();
        let bar = global.bar("converting", 0, Kept::Nothing);
        let data = source.frame::<f32>(self.input.frame)?;
        check_parts(&self.cube, &radar, sample_checks::parts(&data))?;
        // The file gets what was recorded: whoever processes it fills them.
        let lost = LostChirps::find(shape, &data).chirps();
        if lost > 0 {
            let line = format!(
                "warning: {lost} of {} chirps hold runs of zeros, as lost packets leave them; they are \
                    written unchanged",
                shape[0]
            );
            bar.suspend(|| global.say(&line));
        }
        let written = write_cube(&self.output, shape, &data, &about, global.force)?;
        let files = written.files.iter().map(|f| f.display().to_string()).collect();
        let report = Report { files, shape, clipped_words: written.clipped_words, lost_chirps: lost };
        drop(bar);
        if global.json {
            return print_json(&report);
        }
        print(&format!(
            "{} x {} x {} samples; wrote {}",
            shape[0],
            shape[1],
            shape[2],
            report.files.join(", ")
        ))?;
        match report.clipped_words {
            0 => Ok(()),
            n => print(&format!("{n} words were limited to the converter's range")),
        }
    }
}
