//! `catseye plot`: a picture of any file that the other commands write.

use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye::formats::{check_extension, stage};
use catseye_plot::{PICTURE_EXTENSIONS, PlotOptions, plot_file};
use clap::Args;
use std::path::PathBuf;

/// Draw result files as PNG, SVG or PDF
#[derive(Debug, Args)]
pub struct Plot {
    /// Files to plot: RCS tables (CSV), range_doppler.npy, adc.npy, points.csv, returns.csv
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Plot to write: F.png, F.svg or F.pdf (default: a PNG beside the file); with several files a folder for PNGs
    #[arg(short, long)]
    pub output: Option<PathBuf>,
}

impl Plot {
    pub fn run(&self, global: &Global) -> Result<()> {
        if let (Some(picture), 1) = (&self.output, self.files.len()) {
            check_extension(picture, &PICTURE_EXTENSIONS)?;
        }
        let (mut written, mut left_out) = (Vec::new(), Vec::new());
        for file in &self.files {
            let out = match &self.output {
                Some(o) if self.files.len() == 1 => o.clone(),
                Some(folder) => {
                    folder.join(file.file_name().unwrap_or(file.as_os_str())).with_extension("png")
                }
                None => file.with_extension("png"),
            };
            stage::distinct(&[&out], &self.files.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
            let options = PlotOptions { force: global.force, ..Default::default() };
            let gaps = plot_file(file, &out, &options)?.gaps;
            if gaps > 0 {
                global.say(&format!(
                    "note: {}: {gaps} values are not numbers; the chart has gaps there",
                    file.display()
                ));
            }
            left_out.push(gaps);
            if !global.json {
                print(&out.display().to_string())?;
            }
            written.push(out);
        }
        if global.json {
            print_json(&serde_json::json!({ "written": written, "values_left_out": left_out }))
        } else {
            Ok(())
        }
    }
}
