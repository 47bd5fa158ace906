//! `catseye view --live`: a scenario that is changed in the browser and simulated anew by this program after each change. It serves
//! this machine alone.

use super::bar::{Bar, Kept, cancel};
use super::global::{Global, print, print_json};
use super::local_http::{Answer, Request, serve as serve_http};
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::{Engine, Purpose};
use catseye::scene::scenario::{self, Scenario};
use catseye::scene::toml_file::read_text;
use catseye_io::run::{RunOptions, run};
use catseye_view::{Page, Thing};
use serde_json::{Value, json};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;
use tempfile::TempDir;

/// Longest text of a scenario that a page sends, bytes.
const LONGEST_TEXT: usize = 16 << 20;

/// A scenario that is served.
struct Live<'a> {
    scenario: &'a Path,
    /// Number of frames of each simulation.
    frames: u32,
    engine: Engine,
    seed: Option<u64>,
    /// Where frames are made, by one simulation at a time.
    folder: Mutex<TempDir>,
}

/// What opens an address in the browser.
pub type Opener<'a> = &'a dyn Fn(&str) -> Result<()>;

/// Serves the page of a scenario until the program is ended. `open` opens it in the browser.
///
/// # Errors
/// Returns `BadInput` for a scenario that is none and for a port that is taken.
pub fn serve(
    scenario: &Path,
    port: u16,
    frames: u32,
    global: &Global,
    open: Option<Opener<'_>>,
) -> Result<()> {
    let text = read_text(scenario)?;
    // Told before a browser opens.
    scenario::parse(scenario, &text)?;
    let failed = |e: std::io::Error| Error::Failed(format!("the server: {e}"));
    let listener = TcpListener::bind(("127.0.0.1", port)).map_err(|e| {
        BadInput::new(format!("the server cannot use this port: {e}"))
            .key("--port")
            .value(port)
            .allowed("a port that no other program uses; 0 takes any free port")
            .remedy("give another port, or leave it out")
    })?;
    let address = listener.local_addr().map_err(failed)?;
    let live = Live {
        scenario,
        frames,
        engine: global.engine_for(Purpose::Frames)?.0,
        seed: global.seed,
        folder: Mutex::new(tempfile::tempdir().map_err(|e| Error::io(std::env::temp_dir(), e))?),
    };
    let page = Page::of_live(&file_name(scenario), &text).text()?;
    // Whoever does not know it gets nothing, which keeps other users of this machine and other pages out.
    let token = token()?;
    let url = format!("http://{address}/{token}/");
    match global.json {
        true => print_json(&json!({ "url": url }))?,
        false => print(&url)?,
    }
    global.say(
        "The page changes and simulates this scenario; its file stays as it is. Ctrl-C ends the server.",
    );
    if let Some(open) = open
        && let Err(e) = open(&url)
    {
        global.say(&format!("{e}; open the address yourself"));
    }
    let hosts = [format!("127.0.0.1:{}", address.port()), format!("localhost:{}", address.port())];
    // Without a line of its own: it lets the server end by itself, with its folder taken away.
    let _at_work = Bar::new("pages", 0, Kept::Itself, true);
    let is_over = || cancel().load(Relaxed);
    serve_http(&listener, LONGEST_TEXT, &is_over, &|request| live.answer(request, &token, &hosts, &page))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn token() -> Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|e| Error::Failed(format!("cannot read random numbers from the system: {e}")))?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

impl Live<'_> {
    fn answer(&self, request: &Request, token: &str, hosts: &[String], page: &str) -> Answer {
        // A name that someone makes lead to this machine is not this server's.
        if !request.host.as_ref().is_some_and(|h| hosts.contains(h)) {
            return Answer::refused(403, "the request names another host");
        }
        match (request.method.as_str(), request.path.strip_prefix(&format!("/{token}/"))) {
            ("GET", Some("")) => Answer { status: 200, kind: "text/html; charset=utf-8", body: page.into() },
            ("POST", Some("simulate")) => {
                let told = match self.simulated(&request.body) {
                    Ok(value) => value,
                    Err(e) => json!({ "error": e.to_string() }),
                };
                Answer { status: 200, kind: "application/json", body: told.to_string().into() }
            }
            _ => Answer::refused(404, "there is no page at this address"),
        }
    }

    /// What the page shows of the scenario of this text.
    fn simulated(&self, text: &[u8]) -> Result<Value> {
        let text = std::str::from_utf8(text).map_err(|e| {
            BadInput::new(format!("the scenario is not text: {e}")).remedy("write it in UTF-8")
        })?;
        // A simulation that failed leaves nothing that another one would read.
        let folder = self.folder.lock().unwrap_or_else(|e| e.into_inner());
        let began = Instant::now();
        let mut scenario = scenario::parse(self.scenario, text)?;
        self.prepare(&mut scenario);
        let out = folder.path().join("run");
        let report = run(
            &self.engine,
            &scenario,
            &out,
            &RunOptions {
                kind: "run",
                force: true,
                convergence: false,
                batch: None,
                from: None,
                rule: None,
                source: None,
                pictures: &|_, _, _, _, _| Ok(()),
                progress: &|_, _| {},
                add: None,
            },
        )?;
        let (data, frames) = Thing::Run(out).page()?.parts()?;
        Ok(json!({
            "data": data, "frames": frames, "remarks": report.remarks, "seconds": began.elapsed().as_secs_f64(),
        }))
    }

    /// What the page shows is kept, and nothing else.
    fn prepare(&self, scenario: &mut Scenario) {
        scenario.frames.count = self.frames.min(scenario.frames.count);
        if let Some(seed) = self.seed {
            scenario.seed = seed;
        }
        // Some methods find directions without a spectrum.
        let has_spectra = !scenario.radars.iter().any(|r| r.processing.angle.method.is_gridless());
        let o = &mut scenario.output;
        (o.adc, o.plots, o.masks, o.lidar, o.echoes) = (false, false, false, false, false);
        (o.range_doppler, o.points, o.returns, o.truth) = (true, true, true, true);
        (o.scene, o.return_places, o.cfar_threshold, o.angle_spectra) = (true, true, true, has_spectra);
    }
}

/// Whether `--live` serves this thing: the file of a scenario.
pub fn is_scenario(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The scenario among the things, where there is one alone.
///
/// # Errors
/// Returns `BadInput` for anything else.
pub fn of(things: &[PathBuf]) -> Result<&Path> {
    match things {
        [one] if is_scenario(one) => Ok(one),
        _ => Err(BadInput::new("only one scenario can be changed in its page")
            .key("--live")
            .value(things.iter().map(|t| t.display().to_string()).collect::<Vec<_>>().join(" "))
            .allowed("the .toml file of a scenario")
            .remedy("the page of a reflector needs no --live: it works out everything itself")
            .into()),
    }
}
