//! `catseye view`: pages for the browser.

use super::bar::Kept;
use super::global::{Global, print, print_json};
use super::live;
use super::target::ImportArgs;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::{check_extension, stage};
use catseye_view::{Page, Written};
use clap::Args;
use std::path::{Path, PathBuf};

/// Show a run, one of its frames, a dataset, studies, a scene, a reflector or RCS tables as one HTML page that needs no network
#[derive(Debug, Args)]
#[command(
    after_help = "A run shows its scene if it was written ([output] scene = true), else boxes. Paths of echoes need return_places = true, \
                  detection thresholds cfar_threshold = true, and angular spectra angle_spectra = true. The frames of a long run are \
                  in a folder beside the page, which loads them on demand. The page of a reflector lets the user edit the reflector and \
                  computes its cross section."
)]
pub struct View {
    /// Folder of a run, a frame, a dataset or studies; scene (.glb, .gltf, .stl, .obj); reflector
    /// ("type1:width_m=0.16"); RCS tables (.csv; several are overlaid); a reflector or mesh before its RCS
    /// tables; a run before its lane estimates
    #[arg(required = true, value_name = "THING")]
    pub things: Vec<String>,
    /// HTML page to write (default: beside the input, with its name)
    #[arg(short, long, value_name = "F.html")]
    pub output: Option<PathBuf>,
    /// Maximum size of a run's frames that are embedded in the page, MiB; frames of a longer run are in a folder beside it
    #[arg(long, value_name = "MIB", default_value_t = 24.0)]
    pub inline_mib: f64,
    /// Open the page in the browser
    #[arg(long)]
    pub open: bool,
    /// Serve a page on this machine in which a scenario (.toml) is edited and simulated after each change, until Ctrl-C
    #[arg(long, conflicts_with_all = ["output", "inline_mib"])]
    pub live: bool,
    /// With --live: port of the server (default: any free port)
    #[arg(long, value_name = "PORT", default_value_t = 0, requires = "live")]
    pub port: u16,
    /// With --live: number of frames of each simulation
    #[arg(long, value_name = "N", default_value_t = 1, requires = "live", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub frames: u32,
    #[command(flatten)]
    pub import: ImportArgs,
}

impl View {
    pub fn run(&self, global: &Global) -> Result<()> {
        let paths: Vec<PathBuf> = self.things.iter().map(PathBuf::from).collect();
        if self.live {
            let open: live::Opener<'_> = &|url| open(Path::new(url));
            return live::serve(live::of(&paths)?, self.port, self.frames, global, self.open.then_some(open));
        }
        let output = match &self.output {
            Some(o) => o.clone(),
            None => self.beside(),
        };
        check_extension(&output, &["html"])?;
        stage::distinct(&[&output], &paths.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        let page = Page::of(&paths, &self.import.options()?, &|note| global.say(&format!("note: {note}")))?;
        let bar = global.bar("frames", page.frames() as u64, Kept::All);
        let written =
            page.write(&output, global.force, self.inline_bytes()?, &|done| bar.set_position(done as u64))?;
        drop(bar);
        if global.json {
            print_json(&written)?;
        } else {
            tell(&written)?;
        }
        if self.open { open(&written.page) } else { Ok(()) }
    }

    fn inline_bytes(&self) -> Result<usize> {
        if !(0.0..=2048.0).contains(&self.inline_mib) {
            let bad = BadInput::new("is out of range").key("--inline-mib").value(self.inline_mib);
            return Err(bad
                .allowed("0..=2048")
                .remedy("browsers can load pages of up to some hundred MiB")
                .into());
        }
        Ok((self.inline_mib * f64::from(1 << 20)) as usize)
    }

    /// The page's place where none is given.
    fn beside(&self) -> PathBuf {
        let thing = Path::new(&self.things[0]);
        match thing.is_dir() {
            // The name of a folder has no ending, whatever dots it has.
            true => {
                let whole = std::path::absolute(thing).unwrap_or_else(|_| thing.to_path_buf());
                let mut name = whole.file_name().unwrap_or_default().to_os_string();
                name.push(".html");
                whole.with_file_name(name)
            }
            false if thing.is_file() => thing.with_extension("html"),
            false => PathBuf::from(self.things[0].split(':').next().unwrap_or("page")).with_extension("html"),
        }
    }
}

fn tell(written: &Written) -> Result<()> {
    let beside = match &written.beside {
        Some(folder) => format!(" with {} frames in {}", written.frames, folder.display()),
        None => String::new(),
    };
    print(&format!("{} ({:.1} MiB{beside})", written.page.display(), written.bytes as f64 / (1 << 20) as f64))
}

/// Opens a file or an address as the desktop does.
fn open(page: &Path) -> Result<()> {
    let (program, before): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    std::process::Command::new(program)
        .args(before)
        .arg(page)
        .status()
        .ok()
        .filter(std::process::ExitStatus::success)
        .map(drop)
        .ok_or_else(|| {
            Error::Failed(format!(
                "the page was written, but '{program}' did not open it: {}",
                page.display()
            ))
        })
}
