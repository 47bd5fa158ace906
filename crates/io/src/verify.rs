//! Checks whether a dataset is whole: every shard present, once, with the bytes that were written, and
//! nothing else beside. A run of `catseye simulate` is checked likewise, by its files.

use super::dataset::{DATASET, DatasetFile, Marker, SHARDS};
use super::datasheet::{DatasetManifest, is_own, is_unfinished};
use super::store::DatasetLayout;
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::formats::stage::{MANIFEST, files_of, sha256_of_file};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Number of names that a problem lists before it counts the rest.
const LISTED: usize = 3;

/// One class of problems.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// Description of the problem.
    pub problem: &'static str,
    /// Names of files, or numbers of shards.
    pub names: Vec<String>,
    /// Remedy of the problem.
    pub remedy: &'static str,
}

impl Problem {
    /// The problem as one line of text.
    pub fn line(&self) -> String {
        let listed = self.names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
        let more = match self.names.len().saturating_sub(LISTED) {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        format!("{}: {}: {listed}{more}; {}", self.problem, self.names.len(), self.remedy)
    }
}

/// Result of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Findings {
    /// Folder of the dataset.
    #[serde(serialize_with = "catseye::formats::path_text")]
    pub folder: PathBuf,
    /// Name of the dataset.
    pub name: String,
    /// Number of frames that it should hold.
    pub frames: u64,
    /// Number of shards; 0 for a run.
    pub shards: u64,
    /// Number of shards that are complete.
    pub shards_complete: u64,
    /// Number of files that were checked.
    pub files: u64,
    /// Size of these files, bytes.
    pub bytes: u64,
    /// Problems found; empty when all is well.
    pub problems: Vec<Problem>,
}

/// Problems by class: names and remedy.
#[derive(Default)]
struct Problems(BTreeMap<&'static str, (BTreeSet<String>, &'static str)>);

impl Problems {
    fn note(&mut self, problem: &'static str, name: String, remedy: &'static str) {
        self.0.entry(problem).or_insert_with(|| (BTreeSet::new(), remedy)).0.insert(name);
    }

    fn list(self) -> Vec<Problem> {
        let one = |(problem, (names, remedy)): (_, (BTreeSet<String>, _))| Problem {
            problem,
            names: names.into_iter().collect(),
            remedy,
        };
        self.0.into_iter().map(one).collect()
    }
}

/// Files with a known checksum, by path: length where it is known, and checksum.
type Vouched = BTreeMap<String, (Option<u64>, String)>;

/// Result of checking a file.
enum Found {
    /// The file is right and has this many bytes.
    Right(u64),
    Missing,
    Wrong,
}

fn compare<'a>(
    dir: &Path,
    vouched: &'a Vouched,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<(&'a String, Found)>> {
    let check = |(path, (bytes, sum)): (&'a String, &'a (Option<u64>, String))| {
        let file = dir.join(path);
        let found = match fs::metadata(&file) {
            Ok(m) if bytes.is_some_and(|b| b != m.len()) => Found::Wrong,
            Ok(m) if sha256_of_file(&file)? == *sum => Found::Right(m.len()),
            Ok(_) => Found::Wrong,
            Err(_) => Found::Missing,
        };
        progress(vouched.len() as u64);
        Ok((path, found))
    };
    vouched.par_iter().map(check).collect()
}

/// Content of a run's `manifest.json` that matters here.
#[derive(Deserialize)]
struct RunManifest {
    scenario_name: Option<String>,
    #[serde(default)]
    frames: Vec<RunFrame>,
    checksums: BTreeMap<String, String>,
}

#[derive(Deserialize)]
struct RunFrame {
    index: u32,
}

/// Verifies a folder with a manifest that is no dataset: every file that it names is present as written, and
/// no other.
fn verify_run(dir: &Path, progress: &(dyn Fn(u64) + Sync)) -> Result<Findings> {
    const AGAIN: &str = "copy the file back, or run the command again with --force";
    let path = dir.join(MANIFEST);
    let text = fs::read(&path).map_err(|e| match e.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => {
            BadInput::new("is neither a dataset nor a run: it has no dataset.json and no manifest.json")
                .file(dir)
                .remedy("name a folder that `catseye dataset` or `catseye simulate` wrote")
                .into()
        }
        _ => Error::io(&path, e),
    })?;
    let manifest: RunManifest = serde_json::from_slice(&text).map_err(|e| {
        BadInput::new(format!("damaged: {}", json_in_words(&e)))
            .file(&path)
            .remedy("bring back the file that was written")
    })?;
    let mut problems = Problems::default();
    let vouched: Vouched = manifest.checksums.into_iter().map(|(name, sum)| (name, (None, sum))).collect();
    let (mut files, mut bytes) = (0, 0);
    for (name, found) in compare(dir, &vouched, progress)? {
        match found {
            Found::Right(n) => (files, bytes) = (files + 1, bytes + n),
            Found::Missing => problems.note("missing files", name.clone(), AGAIN),
            Found::Wrong => problems.note("wrong checksums", name.clone(), AGAIN),
        }
    }
    for name in files_of(dir)? {
        if name != MANIFEST && !vouched.contains_key(&name) {
            problems.note("foreign files", name, "remove them");
        }
    }
    let indices: BTreeSet<u32> = manifest.frames.iter().map(|f| f.index).collect();
    Ok(Findings {
        folder: dir.to_path_buf(),
        name: manifest.scenario_name.unwrap_or_default(),
        frames: indices.len() as u64,
        shards: 0,
        shards_complete: 0,
        files,
        bytes,
        problems: problems.list(),
    })
}

/// Verifies `dir`, a dataset or a run, by reading all of it. `progress` is called for each file whose
/// checksum was taken, with the total number.
///
/// # Errors
/// Returns an error for a folder that is neither, a damaged description, or a file that cannot be read.
pub fn verify(dir: &Path, progress: &(dyn Fn(u64) + Sync)) -> Result<Findings> {
    if !dir.join(DATASET).exists() {
        return verify_run(dir, progress);
    }
    let dataset = DatasetFile::read(dir)?;
    let mut problems = Problems::default();
    let mut note = |problem, name, remedy| problems.note(problem, name, remedy);
    const AGAIN: &str = "run the same `catseye dataset` command, which makes it again";
    const DELETE: &str = "delete it, then run the same `catseye dataset` command, which makes it again";

    let layout = DatasetLayout::describe(dir)?;
    let shards = layout.shards();
    let present: BTreeSet<String> = files_of(dir)?.into_iter().collect();

    let mut vouched = Vouched::new();
    let mut owner: BTreeMap<String, u64> = BTreeMap::new();
    let mut complete = 0;
    for shard in 0..shards {
        let name = Marker::name(shard);
        if !present.contains(&name) {
            note(
                "missing shards",
                format!("{shard}"),
                "run the same `catseye dataset` command, which makes the others",
            );
            continue;
        }
        let Some(marker) = Marker::read(dir, shard) else {
            note("damaged markers", name, DELETE);
            continue;
        };
        let frames = layout.frames_of(shard);
        if marker.recipe != dataset.recipe {
            note("shards of another recipe", name, DELETE);
            continue;
        }
        if (marker.shard, marker.first_frame, marker.frames)
            != (shard, frames.start, frames.end - frames.start)
        {
            note("shards that overlap others", name, DELETE);
            continue;
        }
        complete += 1;
        for file in &marker.files {
            if let Some(other) = owner.insert(file.path.clone(), shard) {
                note("shards that overlap others", format!("{} (of {other} and {shard})", file.path), DELETE);
            }
            vouched.insert(file.path.clone(), (Some(file.bytes), file.sha256.clone()));
        }
    }
    match fs::read(dir.join(MANIFEST)) {
        Ok(bytes) => match serde_json::from_slice::<DatasetManifest>(&bytes) {
            Ok(m) => {
                if m.recipe != dataset.recipe {
                    note("manifest of another recipe", MANIFEST.into(), DELETE);
                }
                for (path, sum) in m.checksums {
                    match vouched.get(&path) {
                        Some((_, other)) if *other != sum => {
                            note("files on which manifest and marker differ", path, DELETE);
                        }
                        Some(_) => {}
                        None => _ = vouched.insert(path, (None, sum)),
                    }
                }
            }
            Err(_) => note("damaged manifest", MANIFEST.into(), DELETE),
        },
        Err(e) if e.kind() == ErrorKind::NotFound => {
            note(
                "missing manifest",
                MANIFEST.into(),
                "run the same `catseye dataset` command, which completes the dataset",
            );
        }
        Err(e) => return Err(Error::io(dir.join(MANIFEST), e)),
    }

    let (mut files, mut bytes) = (0, 0);
    for (path, found) in compare(dir, &vouched, progress)? {
        match found {
            Found::Right(n) => (files, bytes) = (files + 1, bytes + n),
            Found::Missing => note("missing files", path.clone(), AGAIN),
            Found::Wrong => note("wrong checksums", path.clone(), DELETE),
        }
    }
    for name in &present {
        if name.split('/').any(is_unfinished) {
            note(
                "unfinished files",
                name.clone(),
                "if no run is working, run the same `catseye dataset` command, which removes them",
            );
        } else if name.starts_with(SHARDS) && !is_own(name, shards) {
            note("foreign shards", name.clone(), "remove them");
        } else if !vouched.contains_key(name) && !is_own(name, shards) {
            match complete == shards {
                true => note("foreign files", name.clone(), "remove them"),
                // An interrupted run leaves files before their marker.
                false => note(
                    "files of incomplete shards",
                    name.clone(),
                    "run the same `catseye dataset` command, which makes the shards again, or remove the files",
                ),
            }
        }
    }
    Ok(Findings {
        folder: dir.to_path_buf(),
        name: dataset.name,
        frames: layout.frames,
        shards,
        shards_complete: complete,
        files,
        bytes,
        problems: problems.list(),
    })
}
