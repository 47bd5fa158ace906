//! What the tools do.

use super::arguments::{
    DescribeInput, ExamplesInput, KeysInput, Numbers, Options, RcsInput, SimulateInput, ValidateInput,
};
use super::program::{Answer, Program, in_words_of_inputs};
use super::root::Root;
use super::{check, describe, keys};
use crate::angles::parse_list;
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage;
use catseye::road::target;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Rows of a table that an answer holds; longer ones are files.
pub const MOST_ROWS: usize = 2000;

const RCS_NOTE: &str = "dBsm is 10 lg(sigma / 1 m2), sigma = 4 pi |S|2; the first letter of VV, VH, HV, HH is the received polarisation; \
                        azimuth positive left, elevation positive up, seen from the target (+x is its boresight); null is no echo";
const POINTS_NOTE: &str = "x_m forward, y_m left, z_m up in the sensor's frame; azimuth positive left; range_rate_mps positive when \
                           the target recedes; class and object_id are the truth of the strongest echo, empty and 0 where noise \
                           made the point";

/// What all tools share.
#[derive(Debug)]
pub struct Tools {
    /// Where files lie.
    pub root: Root,
    /// Who computes.
    pub program: Program,
}

/// What a call of `simulate` is about.
#[derive(Debug)]
pub struct Asked {
    scenario: PathBuf,
    output: PathBuf,
    /// Number of frames whose points the answer holds.
    shown: u32,
    dry_run: bool,
}

impl Tools {
    /// Radar cross sections as a table with its peaks.
    ///
    /// # Errors
    /// Returns the command's error, or `BadInput` for a path outside the root.
    pub async fn rcs(&self, input: RcsInput) -> Result<Value> {
        let word = input.target.trim();
        if word.starts_with('-') {
            return Err(BadInput::new("is not a target").key("target").value(word).into());
        }
        let target = match target::is_file(word) {
            true => self.root.inside("target", word)?.display().to_string(),
            false => {
                self.root.words("target", Path::new(""), word)?;
                word.to_string()
            }
        };
        for (key, words) in [("material", &input.material), ("polarisation", &input.polarisation)] {
            words.iter().flatten().try_for_each(|w| self.root.words(key, Path::new(""), w).map(drop))?;
        }
        for (key, word) in [("default_material", &input.default_material), ("ground", &input.ground)] {
            word.iter().try_for_each(|w| self.root.words(key, Path::new(""), w).map(drop))?;
        }
        let count = rows_of(&input);
        let mut output = input.output.as_ref().map(|o| self.root.inside("output", o)).transpose()?;
        if output.is_none() && count > MOST_ROWS as u128 {
            output = Some(self.unused("rcs", "csv"));
        }
        let plot = input.plot.as_ref().map(|p| self.root.inside("plot", p)).transpose()?;
        let mut options = Options(vec!["rcs".into(), target]);
        let list = |n: &Option<Numbers>| n.as_ref().map(Numbers::text);
        options.with("frequency-hz", list(&input.frequency_hz));
        options.with("azimuth-deg", list(&input.azimuth_deg));
        options.with("elevation-deg", list(&input.elevation_deg));
        options.with("bistatic-azimuth-deg", list(&input.bistatic_azimuth_deg));
        options.with("bistatic-elevation-deg", list(&input.bistatic_elevation_deg));
        options.with("range-m", input.range_m);
        options.with("bounces", input.bounces);
        options.with("convention", input.convention);
        options.with("polarisation", input.polarisation.filter(|p| !p.is_empty()).map(|p| p.join(",")));
        options.with("diffraction", input.diffraction);
        options.with("ground", input.ground);
        options.with("height-m", input.height_m);
        options.with("yaw-deg", input.yaw_deg);
        options.with("pitch-deg", input.pitch_deg);
        options.with("roll-deg", input.roll_deg);
        options.with("accuracy-db", input.accuracy_db);
        input.material.iter().flatten().for_each(|m| options.with("material", Some(m)));
        options.with("default-material", input.default_material);
        options.with("unit", input.unit);
        options.with("up", input.up);
        options.with("output", output.as_ref().map(|p| p.display()));
        options.with("plot", plot.as_ref().map(|p| p.display()));
        options.flag("force", input.force);
        let Answer { object: mut found, notes } = self.program.run(&options.0, true).await?;
        let rows = found["rows"].take();
        let table = RcsRows::of(rows.as_array().map(Vec::as_slice).unwrap_or_default());
        let object = found.as_object_mut().ok_or_else(|| Error::Failed("rcs printed no object".into()))?;
        object.shift_remove("rows");
        let mut answer = std::mem::take(object);
        answer.insert("count".into(), json!(table.rows.len()));
        answer.insert("peaks".into(), table.peaks());
        answer.insert("columns".into(), json!(table.columns));
        match table.rows.len() > MOST_ROWS {
            true => {
                _ = answer.insert(
                    "rows_left_out".into(),
                    json!("too many for one answer; the file contains all rows"),
                )
            }
            false => _ = answer.insert("rows".into(), json!(table.rows)),
        }
        answer.insert("output".into(), json!(output));
        answer.insert("plot".into(), json!(plot));
        answer.insert("notes".into(), json!(notes));
        answer.insert("note".into(), json!(RCS_NOTE));
        Ok(Value::Object(answer))
    }

    /// A name that no file has yet.
    fn unused(&self, stem: &str, extension: &str) -> PathBuf {
        let names = (1..).map(|n| PathBuf::from(format!("{stem}_{n:04}.{extension}")));
        let free = |p: &PathBuf| self.root.folder().join(p).symlink_metadata().is_err();
        names.into_iter().find(free).unwrap_or_else(|| format!("{stem}.{extension}").into())
    }

    /// What a call of `simulate` is about: its paths, checked. The text of a scenario is checked whole, and kept.
    ///
    /// # Errors
    /// Returns `BadInput` for inputs that are wrong, a path outside the root, or a text that is no scenario.
    pub fn asked(&self, input: &SimulateInput) -> Result<Asked> {
        let shown = input.points_of_frames.unwrap_or(1);
        if shown > 20 {
            return Err(BadInput::new("is out of range")
                .key("points_of_frames")
                .value(shown)
                .allowed("0..20")
                .into());
        }
        let output = self.root.inside("output", &input.output)?;
        if output == Path::new(".") {
            let bad = BadInput::new("is the server's own folder").key("output").value(&input.output);
            return Err(bad.remedy("give the name of a new folder").into());
        }
        let scenario = match (&input.scenario, &input.scenario_toml) {
            (Some(path), None) => self.root.inside_with_named("scenario", path)?,
            (None, Some(text)) => self.keep(&output, text, input.force.unwrap_or(false))?,
            _ => {
                return Err(BadInput::new("exactly one of the two is needed")
                    .key("scenario or scenario_toml")
                    .remedy("give the path of a scenario file, or its text")
                    .into());
            }
        };
        Ok(Asked { scenario, output, shown, dry_run: input.dry_run.unwrap_or(false) })
    }

    /// Runs the command of a call.
    ///
    /// # Errors
    /// Returns the command's error.
    pub async fn simulate(&self, input: &SimulateInput, asked: &Asked) -> Result<Answer> {
        let mut options = Options(vec!["simulate".into(), word(&asked.scenario)]);
        options.with("output", (!asked.dry_run).then(|| asked.output.display()));
        options.with("frames", input.frames);
        options.with("seed", input.seed);
        options.flag("dry-run", input.dry_run);
        options.flag("force", input.force.filter(|_| !asked.dry_run));
        self.program.run(&options.0, true).await
    }

    /// What a call of `simulate` is answered: what the run is, the points of its first frames, its pictures.
    ///
    /// # Errors
    /// Returns an error for files of the run that cannot be read.
    pub fn answer(&self, asked: &Asked, answer: Answer) -> Result<Value> {
        let Answer { object: report, notes } = answer;
        if asked.dry_run {
            return Ok(json!({ "scenario": asked.scenario, "dry_run": report, "notes": notes }));
        }
        let (run, manifest) = describe::run_in(&self.root, &asked.output)?;
        let mut columns: Vec<String> = Vec::new();
        let (mut rows, mut files, mut left_out, mut pictures) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (index, radar, folder) in describe::frames(&manifest, &asked.output) {
            let points = folder.join("points.csv");
            if index < u64::from(asked.shown) && points.is_file() {
                let (header, of_frame) = describe::rows(&points)?;
                if rows.len() + of_frame.len() > MOST_ROWS {
                    left_out.push(points);
                } else {
                    columns = ["frame", "radar"].map(String::from).into_iter().chain(header).collect();
                    let place = [json!(index), json!(radar)];
                    rows.extend(
                        of_frame.into_iter().map(|r| place.iter().cloned().chain(r).collect::<Vec<Value>>()),
                    );
                    files.push(points);
                }
            }
            if index == 0 {
                pictures.extend(pictures_in(&folder)?);
            }
        }
        let points = json!({ "columns": columns, "rows": rows, "files": files, "files_left_out": left_out, "note": POINTS_NOTE });
        Ok(json!({
            "scenario": asked.scenario,
            "run": run,
            "resumed": report["resumed"],
            "points": points,
            "pictures": pictures,
            "notes": notes,
        }))
    }

    /// Checks a scenario's text, with the scene that it describes, and keeps it beside the folder of its run.
    fn keep(&self, output: &Path, text: &str, force: bool) -> Result<PathBuf> {
        let mut name = output.as_os_str().to_os_string();
        name.push(".toml");
        let file = self.root.inside("output", PathBuf::from(name))?;
        self.root.named_by("scenario_toml", &file, text)?;
        check::read("scenario", &file, text)?;
        if std::fs::read(&file).is_ok_and(|there| there == text.as_bytes()) {
            return Ok(file);
        }
        stage::write_file(&file, force, text.as_bytes()).map_err(in_words_of_inputs)?;
        Ok(file)
    }

    /// What a file or folder is.
    ///
    /// # Errors
    /// Returns an error for what is no result, or lies outside the root.
    pub fn describe(&self, input: &DescribeInput) -> Result<Value> {
        describe::describe(&self.root, input)
    }

    /// Keys of files.
    ///
    /// # Errors
    /// Returns `BadInput` for an unknown kind.
    pub fn list_keys(&self, input: &KeysInput) -> Result<Value> {
        keys::table(input.kind.as_deref(), input.word.as_deref(), MOST_ROWS)
    }

    /// Whether a file is right: `valid`, and what it holds or the error.
    ///
    /// # Errors
    /// Returns `BadInput` for a path outside the root, a file that is not there, or a kind that is not known.
    pub fn validate_file(&self, input: &ValidateInput) -> Result<Value> {
        let (file, text) = match (&input.path, &input.text) {
            (Some(path), None) => {
                let file = self.root.inside_with_named("path", path)?;
                let text = catseye::scene::toml_file::read_text(&file)?;
                (file, text)
            }
            (None, Some(text)) => {
                let file = PathBuf::from("text.toml");
                self.root.named_by("text", &file, text)?;
                (file, text.clone())
            }
            _ => {
                let bad = BadInput::new("exactly one of the two is needed").key("path or text");
                return Err(bad.remedy("give the path of a file, or a text").into());
            }
        };
        let kind = match &input.kind {
            Some(kind) => keys::kind(kind)?,
            None => check::kind_of(&file, &text)?,
        };
        Ok(match check::read(kind, &file, &text) {
            Ok(holds) => json!({ "valid": true, "kind": kind, "holds": holds }),
            Err(e) => json!({ "valid": false, "kind": kind, "error": e.json()["error"] }),
        })
    }

    /// Lists the examples, or writes one.
    ///
    /// # Errors
    /// Returns the command's error, or `BadInput` for a path outside the root.
    pub async fn examples(&self, input: ExamplesInput) -> Result<Value> {
        let Some(name) = &input.name else {
            let Answer { object, .. } = self.program.run(&["examples".into()], false).await?;
            let word = input.word.unwrap_or_default().to_lowercase();
            let has = |k: &String, v: &Value| {
                k.to_lowercase().contains(&word)
                    || v.as_str().is_some_and(|v| v.to_lowercase().contains(&word))
            };
            let all = object.as_object().cloned().unwrap_or_default();
            let found: Map<String, Value> = all.into_iter().filter(|(k, v)| has(k, v)).collect();
            return Ok(json!({ "count": found.len(), "examples": found }));
        };
        if name.starts_with('-') {
            return Err(BadInput::new("is not the name of an example").key("name").value(name).into());
        }
        let output = self.root.inside("output", input.output.as_deref().unwrap_or("scenes"))?;
        // The folders in it may be links that lead out.
        if let Ok(inside) = std::fs::read_dir(self.root.folder().join(&output)) {
            for entry in inside.flatten() {
                self.root.inside("output", entry.path())?;
            }
        }
        let mut options = Options(vec!["examples".into(), name.clone()]);
        options.with("output", Some(output.display()));
        options.flag("force", input.force);
        let Answer { object, .. } = self.program.run(&options.0, false).await?;
        Ok(json!({ "folder": output, "written": object["files"] }))
    }
}

/// A path as an argument that no one takes for an option.
fn word(path: &Path) -> String {
    let text = path.display().to_string();
    if text.starts_with('-') { format!("./{text}") } else { text }
}

/// How many rows the answer has; 0 for lists that cannot be read, about which the command complains.
fn rows_of(input: &RcsInput) -> u128 {
    let lists = [
        &input.frequency_hz,
        &input.azimuth_deg,
        &input.elevation_deg,
        &input.bistatic_azimuth_deg,
        &input.bistatic_elevation_deg,
    ];
    let count = |n: &Numbers| parse_list("list", &n.text()).map_or(0, |l| l.len() as u128);
    lists.into_iter().flatten().map(count).product()
}

fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))? {
        let path = entry.map_err(|e| Error::io(folder, e))?.path();
        if path.extension().is_some_and(|e| e == "png") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The rows of `catseye rcs --json` as a table.
struct RcsRows {
    columns: Vec<String>,
    rows: Vec<Vec<Value>>,
}

impl RcsRows {
    fn of(rows: &[Value]) -> RcsRows {
        let plain = |r: &Value| -> Vec<(String, Value)> {
            let object = r.as_object().into_iter().flatten();
            let mut out: Vec<(String, Value)> = object
                .filter(|(_, v)| v.is_number() || v.is_null())
                .map(|(k, v)| (k.clone(), v.clone()))
                .collect();
            let more = r["derived_dbsm"].as_object().into_iter().flatten();
            out.extend(more.map(|(k, v)| (k.clone(), v.clone())));
            out
        };
        let columns = rows.first().map(|r| plain(r).into_iter().map(|c| c.0).collect()).unwrap_or_default();
        RcsRows { columns, rows: rows.iter().map(|r| plain(r).into_iter().map(|c| c.1).collect()).collect() }
    }

    /// The largest value of each polarisation and where it is.
    fn peaks(&self) -> Value {
        let is_level = |name: &String| name.ends_with("_dbsm");
        let is_place = |name: &String| name.ends_with("_hz") || name.ends_with("_deg");
        let mut out = Map::new();
        for (k, name) in self.columns.iter().enumerate().filter(|(_, n)| is_level(n)) {
            let received = self.rows.iter().filter_map(|r| r[k].as_f64().map(|x| (x, r)));
            let Some((dbsm, row)) = received.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let mut at = Map::from_iter([("dbsm".to_string(), json!(dbsm))]);
            let places = self.columns.iter().zip(row).filter(|(n, _)| is_place(n));
            at.extend(places.map(|(n, v)| (n.clone(), v.clone())));
            out.insert(name.clone(), Value::Object(at));
        }
        Value::Object(out)
    }
}
