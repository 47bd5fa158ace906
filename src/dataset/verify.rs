//! Whether a dataset is whole: every shard there, once, with the bytes that were written, and nothing else beside.

use super::datasheet::{DatasetManifest, files_below, is_own, is_unfinished};
use super::produce::{DatasetFile, Marker, SHARDS};
use super::store::Layout;
use crate::error::{Error, Result};
use crate::formats::stage::{MANIFEST, sha256_of_file};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Names that a problem lists before it counts the rest.
const LISTED: usize = 3;

/// One class of what is wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    pub problem: &'static str,
    /// Files, or numbers of shards.
    pub names: Vec<String>,
    pub remedy: &'static str,
}

impl Problem {
    /// One line.
    pub fn line(&self) -> String {
        let listed = self.names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
        let more = match self.names.len().saturating_sub(LISTED) {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        format!("{}: {}: {listed}{more}; {}", self.problem, self.names.len(), self.remedy)
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Findings {
    pub folder: PathBuf,
    pub name: String,
    pub frames: u64,
    pub shards: u64,
    pub shards_complete: u64,
    pub files: u64,
    pub bytes: u64,
    /// Empty when all is well.
    pub problems: Vec<Problem>,
}

/// Reads all of `dir`. `progress` is told of each file whose checksum was taken, and how many there are.
///
/// Errors: a folder that is no dataset, or whose description is damaged; what the disk says.
pub fn verify(dir: &Path, progress: &(dyn Fn(u64) + Sync)) -> Result<Findings> {
    let dataset = DatasetFile::read(dir)?;
    let mut problems: BTreeMap<&'static str, (BTreeSet<String>, &'static str)> = BTreeMap::new();
    let mut note = |problem: &'static str, name: String, remedy: &'static str| {
        problems.entry(problem).or_insert_with(|| (BTreeSet::new(), remedy)).0.insert(name);
    };
    const AGAIN: &str = "the same `catseye dataset` command makes it again";
    const DELETE: &str = "delete it, then the same `catseye dataset` command makes it again";

    let layout = Layout::open(dir)?;
    let shards = layout.shards();
    let present = files_below(dir)?;

    // Every file that something vouches for: by its path, length where it is known, and checksum.
    let mut vouched: BTreeMap<String, (Option<u64>, String)> = BTreeMap::new();
    let mut owner: BTreeMap<String, u64> = BTreeMap::new();
    let mut complete = 0;
    for shard in 0..shards {
        let name = Marker::name(shard);
        if !present.contains(&name) {
            note(
                "missing shards",
                format!("{shard}"),
                "the same `catseye dataset` command goes on with them",
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
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            note("missing manifest", MANIFEST.into(), "the same `catseye dataset` command ends the dataset");
        }
        Err(e) => return Err(Error::io(dir.join(MANIFEST), e)),
    }

    /// What a file turned out to be.
    enum Found {
        Right(u64),
        Missing,
        Wrong,
    }
    let checked: Vec<(&String, Found)> = vouched
        .par_iter()
        .map(|(path, (bytes, sum))| {
            let file = dir.join(path);
            let found = match fs::metadata(&file) {
                Ok(m) if bytes.is_some_and(|b| b != m.len()) => Found::Wrong,
                Ok(m) if sha256_of_file(&file)? == *sum => Found::Right(m.len()),
                Ok(_) => Found::Wrong,
                Err(_) => Found::Missing,
            };
            progress(vouched.len() as u64);
            Ok((path, found))
        })
        .collect::<Result<_>>()?;
    let (mut files, mut bytes) = (0, 0);
    for (path, found) in checked {
        match found {
            Found::Right(n) => (files, bytes) = (files + 1, bytes + n),
            Found::Missing => note("missing files", path.clone(), AGAIN),
            Found::Wrong => note("wrong checksums", path.clone(), DELETE),
        }
    }
    for name in &present {
        if name.split('/').any(is_unfinished) {
            note("unfinished files", name.clone(), "of a run at work or one that was interrupted");
        } else if name.starts_with(SHARDS) && !is_own(name, shards) {
            note("foreign shards", name.clone(), "take them out");
        } else if !vouched.contains_key(name) && !is_own(name, shards) {
            match complete == shards {
                true => note("foreign files", name.clone(), "take them out"),
                // An interrupted run leaves files before their marker.
                false => note(
                    "files of no complete shard",
                    name.clone(),
                    "the shards are made again, or take them out",
                ),
            }
        }
    }
    let problems = problems
        .into_iter()
        .map(|(problem, (names, remedy))| Problem { problem, names: names.into_iter().collect(), remedy })
        .collect();
    Ok(Findings {
        folder: dir.to_path_buf(),
        name: dataset.name,
        frames: layout.frames,
        shards,
        shards_complete: complete,
        files,
        bytes,
        problems,
    })
}
