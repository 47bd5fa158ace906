//! Output that appears under its final name only when it is complete. Work goes into a sibling with
//! a hidden temporary name and is renamed on commit; until then an older result stays as it was.
//!
//! A folder carries a `manifest.json` that says which kind of result it is and lists every file in it. Only such a folder, of the
//! same kind and with nothing else in it, is ever replaced. While a folder is made a lock stands beside it.

use super::lock::Lock;
use crate::base::error::{BadInput, Error, Result};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// The file that marks a folder as a result of this program.
pub const MANIFEST: &str = "manifest.json";
/// Its keys that every folder has: the version that wrote it, the kind of result, SHA-256 of each file.
const VERSION: &str = "catseye";
const KIND: &str = "kind";
const CHECKSUMS: &str = "checksums";

/// A folder under construction. Dropped without [`commit`](StagedDir::commit), it leaves nothing, unless
/// it is [resumable](StagedDir::resumable).
#[derive(Debug)]
pub struct StagedDir {
    final_path: PathBuf,
    temporary: PathBuf,
    kind: &'static str,
    force: bool,
    done: bool,
    /// The hidden folder of a resumable stage, with all that a later start needs.
    workshop: Option<PathBuf>,
    /// Held to the end: no other process makes the same folder.
    _lock: Lock,
}

/// Names in the hidden folder: what is made there, the folder under construction, and notes on the way.
const IDENTITY: &str = "identity";
const RESULT: &str = "result";
const NOTES: &str = "notes";

impl StagedDir {
    /// Makes the temporary folder next to `final_path` (whose parents are made too). `kind` says what it will hold ("run",
    /// "study", ...) and is written into its manifest.
    ///
    /// # Errors
    /// Returns `BadInput` if a result is there already and `force` is not given, if another process writes it, or if
    /// something is there that is no result of this kind (a file; a folder without our manifest, or with a file that
    /// the manifest does not list): that is not replaced even with `force`.
    pub fn new(final_path: impl AsRef<Path>, force: bool, kind: &'static str) -> Result<Self> {
        let (final_path, lock) = begin(final_path.as_ref(), force, kind)?;
        let temporary = sibling(&final_path, PARTIAL)?;
        fs::create_dir(&temporary).map_err(|e| Error::io(&temporary, e))?;
        Ok(StagedDir { final_path, temporary, kind, force, done: false, workshop: None, _lock: lock })
    }

    /// A folder that survives an interruption, and another one for notes and finished parts that a later
    /// start needs: they are no part of the result, so that nothing has to be taken out of it before the
    /// commit. A later call with the same `identity` finds both as they were, one with another finds
    /// them empty.
    ///
    /// # Errors
    /// Returns the errors of [`StagedDir::new`].
    pub fn resumable(
        final_path: impl AsRef<Path>,
        force: bool,
        kind: &'static str,
        identity: &str,
    ) -> Result<(Self, PathBuf)> {
        let (final_path, lock) = begin(final_path.as_ref(), force, kind)?;
        let workshop = hidden(&final_path, UNFINISHED)?;
        let temporary = workshop.join(RESULT);
        let notes = workshop.join(NOTES);
        let mark = workshop.join(IDENTITY);
        let resumed = fs::read_to_string(&mark).is_ok_and(|found| found == identity);
        if !resumed {
            if workshop.exists() {
                fs::remove_dir_all(&workshop).map_err(|e| Error::io(&workshop, e))?;
            }
            for folder in [&workshop, &temporary, &notes] {
                fs::create_dir(folder).map_err(|e| Error::io(folder, e))?;
            }
            fs::write(&mark, identity).map_err(|e| Error::io(&mark, e))?;
        }
        let workshop = Some(workshop);
        Ok((StagedDir { final_path, temporary, kind, force, done: false, workshop, _lock: lock }, notes))
    }

    /// The folder to write into.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// The name under which the folder will stand.
    pub fn final_path(&self) -> &Path {
        &self.final_path
    }

    /// Puts the folder under its final name. An older result is moved aside first and deleted last,
    /// and comes back if the renaming fails.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, or the folder cannot be written or renamed.
    pub fn commit(self) -> Result<PathBuf> {
        let sums = checksums(&self.temporary)?;
        self.commit_with(sums)
    }

    /// Commits as [`Self::commit`] with [`checksums`] that are known already.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, or the folder cannot be written or renamed.
    pub fn commit_with(mut self, checksums: BTreeMap<String, String>) -> Result<PathBuf> {
        seal(&self.temporary, self.kind, checksums)?;
        // Checked again: somebody may have written there meanwhile.
        check_dir(&self.final_path, self.force, self.kind)?;
        let old = if self.final_path.exists() {
            let old = sibling(&self.final_path, OLD)?;
            fs::rename(&self.final_path, &old).map_err(|e| Error::io(&self.final_path, e))?;
            Some(old)
        } else {
            None
        };
        if let Err(e) = fs::rename(&self.temporary, &self.final_path) {
            if let Some(old) = old {
                // Nothing better can be done when this fails too; the message names the new path.
                let _ = fs::rename(old, &self.final_path);
            }
            return Err(Error::io(&self.final_path, e));
        }
        self.done = true;
        sync_folder(&parent(&self.final_path))?;
        for rest in old.iter().chain(&self.workshop) {
            fs::remove_dir_all(rest).map_err(|e| Error::io(rest, e))?;
        }
        Ok(self.final_path.clone())
    }
}

/// Checks the place, makes its parents, takes the lock and clears up what killed runs left beside it.
fn begin(path: &Path, force: bool, kind: &'static str) -> Result<(PathBuf, Lock)> {
    let path = resolved(path)?;
    let take = || Lock::take(&path, hidden(&path, "lock")?);
    if let Err(refused) = check_dir(&path, force, kind) {
        // The run that made it may have been killed before it could tidy up. Who holds the lock still does so itself.
        let _ = take().and_then(|_lock| clear_up(&path));
        return Err(refused);
    }
    make_parents(&path)?;
    let lock = take()?;
    clear_up(&path)?;
    // What was there before the lock was ours may be another's result by now.
    check_dir(&path, force, kind)?;
    Ok((path, lock))
}

/// Takes away what killed runs left beside `path`, or gives it back. Only who holds the lock makes such things, so nobody works on
/// those that are there.
fn clear_up(path: &Path) -> Result<()> {
    let remove = |rest: &Path| fs::remove_dir_all(rest).map_err(|e| Error::io(rest, e));
    for old in leavings(path, OLD)? {
        // Killed between its two renames: what it wanted to replace is all there is.
        match path.exists() {
            false => fs::rename(&old, path).map_err(|e| Error::io(path, e))?,
            true => remove(&old)?,
        }
    }
    for partial in leavings(path, PARTIAL)?.into_iter().filter(|p| p.is_dir()) {
        remove(&partial)?;
    }
    // Killed after its result had been taken out.
    let workshop = hidden(path, UNFINISHED)?;
    match workshop.is_dir() && !workshop.join(RESULT).exists() {
        true => remove(&workshop),
        false => Ok(()),
    }
}

/// Hidden siblings of `path` of one kind, in order.
fn leavings(path: &Path, kind: &str) -> Result<Vec<PathBuf>> {
    let start = hidden(path, &format!("{kind}-"))?;
    let start = start.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = parent(path);
    let entries = fs::read_dir(&folder).map_err(|e| Error::io(&folder, e))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|e| e.ok())
        .filter(|e| e.file_name().to_string_lossy().starts_with(&start))
        .map(|e| e.path())
        .collect();
    found.sort();
    Ok(found)
}

/// Writes version, kind and checksums into the manifest, which is made where there is none.
fn seal(dir: &Path, kind: &str, checksums: BTreeMap<String, String>) -> Result<()> {
    let path = dir.join(MANIFEST);
    let wrong = |e: serde_json::Error| Error::Failed(format!("{}: {e}", path.display()));
    let mut manifest: Map<String, Value> = match fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes).map_err(wrong)?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Map::new(),
        Err(e) => return Err(Error::io(&path, e)),
    };
    manifest.entry(VERSION).or_insert_with(|| env!("CARGO_PKG_VERSION").into());
    manifest.insert(KIND.into(), kind.into());
    manifest.insert(CHECKSUMS.into(), serde_json::to_value(checksums).map_err(wrong)?);
    let text = serde_json::to_string_pretty(&manifest).map_err(wrong)?;
    fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
    sync_file(&path)?;
    sync_folder(dir)
}

impl Drop for StagedDir {
    fn drop(&mut self) {
        if !self.done && self.workshop.is_none() {
            let _ = fs::remove_dir_all(&self.temporary);
        }
    }
}

/// A single file under construction.
#[derive(Debug)]
pub struct StagedFile {
    final_path: PathBuf,
    temporary: PathBuf,
    force: bool,
    done: bool,
}

impl StagedFile {
    /// Begins output that will stand at `final_path`; `force` replaces what stands there.
    ///
    /// # Errors
    /// Returns `BadInput` if the file exists and `force` is not given, or if a folder has its name.
    pub fn new(final_path: impl AsRef<Path>, force: bool) -> Result<Self> {
        let final_path = resolved(final_path.as_ref())?;
        check_file(&final_path, force)?;
        let temporary = sibling(&final_path, PARTIAL)?;
        make_parents(&final_path)?;
        // Made at once, so that a place that cannot be written is known before the work.
        fs::File::create_new(&temporary).map_err(|e| Error::io(&temporary, e))?;
        Ok(StagedFile { final_path, temporary, force, done: false })
    }

    /// The name to write to.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// The name under which the file will appear.
    pub fn final_path(&self) -> &Path {
        &self.final_path
    }

    /// Gives the file its final name.
    ///
    /// # Errors
    /// Returns an error if the disk is full or the name cannot be taken.
    pub fn commit(mut self) -> Result<PathBuf> {
        check_file(&self.final_path, self.force)?;
        let io = |e| Error::io(&self.final_path, e);
        // A link is refused where something stands, also what appeared since the check; some file systems have none.
        let linked = match self.force {
            true => false,
            false => match fs::hard_link(&self.temporary, &self.final_path) {
                Ok(()) => true,
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
                    return Err(exists_without_force(&self.final_path));
                }
                Err(_) => false,
            },
        };
        match linked {
            true => fs::remove_file(&self.temporary).map_err(io)?,
            false => fs::rename(&self.temporary, &self.final_path).map_err(io)?,
        }
        self.done = true;
        Ok(self.final_path.clone())
    }
}

impl Drop for StagedFile {
    fn drop(&mut self) {
        if !self.done {
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// Writes `bytes` to `final_path` in one go.
///
/// # Errors
/// Returns an error if the file cannot be written, or exists and `force` is false.
pub fn write_file(final_path: impl AsRef<Path>, force: bool, bytes: &[u8]) -> Result<PathBuf> {
    let staged = StagedFile::new(final_path, force)?;
    fs::write(staged.path(), bytes).map_err(|e| Error::io(staged.final_path(), e))?;
    staged.commit()
}

/// A link is followed, so that what it points to is replaced and the link stays.
fn resolved(path: &Path) -> Result<PathBuf> {
    if path.exists() {
        return fs::canonicalize(path).map_err(|e| Error::io(path, e));
    }
    if path.as_os_str().is_empty() {
        return Err(BadInput::new("the output has no name").into());
    }
    Ok(path.to_path_buf())
}

fn make_parents(path: &Path) -> Result<()> {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => match p.ancestors().find(|a| a.is_file()) {
            Some(file) => Err(BadInput::new("is a file, but the output needs a folder of this name")
                .file(file)
                .remedy("give another name for the output")
                .into()),
            None => fs::create_dir_all(p).map_err(|e| Error::io(p, e)),
        },
        _ => Ok(()),
    }
}

fn exists_without_force(path: &Path) -> Error {
    BadInput::new("exists already").file(path).remedy("give --force to replace it, or another name").into()
}

fn check_dir(path: &Path, force: bool, kind: &str) -> Result<()> {
    let Ok(meta) = fs::metadata(path) else {
        return Ok(());
    };
    let refuse = |problem: String| {
        Err(BadInput::new(problem).file(path).remedy("give another name for the output").into())
    };
    if !meta.is_dir() {
        return refuse("is a file, and the output is a folder".into());
    }
    let empty = fs::read_dir(path).map_err(|e| Error::io(path, e))?.next().is_none();
    if empty {
        return Ok(());
    }
    let manifest: Option<Map<String, Value>> =
        fs::read(path.join(MANIFEST)).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let own = manifest.as_ref().and_then(|m| {
        m.get(VERSION)?.as_str()?;
        Some((m.get(KIND)?.as_str()?, m.get(CHECKSUMS)?.as_object()?))
    });
    let Some((found, listed)) = own else {
        return refuse(
            "is a folder that catseye did not write (no manifest.json of its own), so it is not replaced"
                .into(),
        );
    };
    if found != kind {
        return refuse(format!(
            "contains a result of another kind ('{found}' instead of '{kind}'), so it is not replaced"
        ));
    }
    let foreign = files_of(path)?.into_iter().find(|name| name != MANIFEST && !listed.contains_key(name));
    if let Some(foreign) = foreign {
        return refuse(format!("contains '{foreign}', which catseye did not write, so it is not replaced"));
    }
    if !force {
        return Err(exists_without_force(path));
    }
    Ok(())
}

fn check_file(path: &Path, force: bool) -> Result<()> {
    match fs::metadata(path) {
        Ok(m) if m.is_dir() => Err(BadInput::new("is a folder, and the output is a file")
            .file(path)
            .remedy("give another name for the output")
            .into()),
        Ok(_) if !force => Err(exists_without_force(path)),
        _ => Ok(()),
    }
}

/// Kinds of hidden siblings: what is being made, also over several starts, and a result that is being replaced.
const PARTIAL: &str = "partial";
const UNFINISHED: &str = "unfinished";
const OLD: &str = "old";

/// The folder that a path lies in.
fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// `DIR/.NAME.KIND-PROCESS-COUNT`, on the same file system so that a rename is atomic.
fn sibling(path: &Path, kind: &str) -> Result<PathBuf> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    hidden(path, &format!("{kind}-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)))
}

/// `DIR/.NAME.SUFFIX`.
fn hidden(path: &Path, suffix: &str) -> Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| {
        BadInput::new("is not a possible name of an output").file(path).remedy("give a name for the output")
    })?;
    let mut file = OsString::from(".");
    file.push(name);
    file.push(format!(".{suffix}"));
    Ok(path.with_file_name(file))
}

/// Computes SHA-256 (FIPS 180-4) of a file's bytes, 64 hexadecimal digits.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub fn sha256_of_file(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let mut file = super::input::open(path, "a file")?;
    let mut hash = Sha256::new();
    let mut block = vec![0u8; 1 << 16];
    loop {
        let n = file.read(&mut block).map_err(|e| Error::io(path, e))?;
        if n == 0 {
            return Ok(hex(&hash.finalize()));
        }
        hash.update(&block[..n]);
    }
}

/// Computes SHA-256 of bytes in memory that follow each other, 64 hexadecimal digits.
pub fn sha256_of_parts(parts: &[&[u8]]) -> String {
    let mut hash = Sha256::new();
    parts.iter().for_each(|part| hash.update(part));
    hex(&hash.finalize())
}

/// Computes SHA-256 of bytes in memory, 64 hexadecimal digits.
pub fn sha256_of_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Computes SHA-256 of every file under `dir` except its manifest, by path relative to `dir` with forward slashes, in
/// order.
///
/// # Errors
/// Returns an error if the folder or a file in it cannot be read.
pub fn checksums(dir: impl AsRef<Path>) -> Result<BTreeMap<String, String>> {
    let dir = dir.as_ref();
    let names = files_of(dir)?.into_iter().filter(|name| name != MANIFEST);
    names.map(|name| Ok((name.clone(), sha256_of_file(dir.join(name))?))).collect()
}

/// Lists every file under `dir`, relative to it with forward slashes, in order.
///
/// # Errors
/// Returns an error if a folder cannot be read.
pub fn files_of(dir: &Path) -> Result<Vec<String>> {
    fn walk(dir: &Path, prefix: &str, out: &mut Vec<String>) -> Result<()> {
        for entry in fs::read_dir(dir).map_err(|e| Error::io(dir, e))? {
            let entry = entry.map_err(|e| Error::io(dir, e))?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            match entry.file_type().map_err(|e| Error::io(entry.path(), e))?.is_dir() {
                true => walk(&entry.path(), &format!("{name}/"), out)?,
                false => out.push(name),
            }
        }
        Ok(())
    }
    let mut out = Vec::new();
    walk(dir, "", &mut out)?;
    out.sort();
    Ok(out)
}

/// Returns when what was written to the file would survive a loss of power.
///
/// # Errors
/// Returns an error if the file cannot be opened or synchronised.
pub fn sync_file(path: &Path) -> Result<()> {
    fs::File::open(path).and_then(|f| f.sync_all()).map_err(|e| Error::io(path, e))
}

/// Returns when the names in a folder would survive a loss of power, where the system opens folders.
///
/// # Errors
/// Returns an error if the folder cannot be opened or synchronised.
pub fn sync_folder(path: &Path) -> Result<()> {
    match cfg!(unix) {
        true => sync_file(path),
        false => Ok(()),
    }
}

/// Returns when everything under `dir`, and its own name, would survive a loss of power.
///
/// # Errors
/// Returns an error if a file or folder cannot be opened or synchronised.
pub fn sync_tree(dir: &Path) -> Result<()> {
    let mut folders = std::collections::BTreeSet::from([dir.to_path_buf()]);
    for name in files_of(dir)? {
        let path = dir.join(name);
        sync_file(&path)?;
        folders.extend(path.parent().map(Path::to_path_buf));
    }
    folders.iter().try_for_each(|folder| sync_folder(folder))
}

/// Refuses outputs of one command that are its inputs, lie in a folder that is one, or are one file under two names.
///
/// # Errors
/// Returns `BadInput` with the output's name.
pub fn distinct(outputs: &[&Path], inputs: &[&Path]) -> Result<()> {
    let places: Vec<PathBuf> = outputs.iter().map(|p| place(p)).collect();
    for (i, (output, at)) in outputs.iter().zip(&places).enumerate() {
        let bad =
            |problem: String| BadInput::new(problem).file(output).remedy("give another name for the output");
        if places[..i].contains(at) {
            return Err(bad("two outputs have this name".into()).into());
        }
        for input in inputs.iter().filter(|p| p.exists()) {
            let from = place(input);
            if *at == from || (input.is_dir() && at.starts_with(&from)) {
                return Err(bad(format!("would overwrite the input {}", input.display())).into());
            }
        }
    }
    Ok(())
}

/// Where a name leads, also one that does not exist yet.
fn place(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| {
        let folder = fs::canonicalize(parent(path)).unwrap_or_else(|_| parent(path));
        path.file_name().map_or(folder.clone(), |name| folder.join(name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut v: Vec<_> = fs::read_dir(dir)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        v.sort();
        v
    }

    #[test]
    fn nothing_under_the_final_name_before_commit() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("deep/run");
        let s = StagedDir::new(&target, false, "run").unwrap();
        fs::write(s.path().join(MANIFEST), "{\"seed\": 1}").unwrap();
        fs::create_dir(s.path().join("frame_000000")).unwrap();
        assert!(!target.exists());
        assert_eq!(s.commit().unwrap(), target);
        assert_eq!(names(&t.path().join("deep")), ["run"]);
        assert_eq!(names(&target), ["frame_000000", MANIFEST]);
        let manifest: Value = serde_json::from_slice(&fs::read(target.join(MANIFEST)).unwrap()).unwrap();
        assert_eq!(manifest["kind"], "run");
        assert_eq!(manifest["seed"], 1);
        assert!(manifest["catseye"].is_string() && manifest["checksums"].is_object());
    }

    /// A finished result of a kind with one file.
    fn result(target: &Path, kind: &'static str, content: &str) {
        let s = StagedDir::new(target, true, kind).unwrap();
        fs::write(s.path().join("points.csv"), content).unwrap();
        s.commit().unwrap();
    }

    /// Why it is not replaced, though --force is given.
    fn refusal(target: &Path, kind: &'static str) -> String {
        let e = StagedDir::new(target, true, kind).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        e.to_string()
    }

    #[test]
    fn dropping_cleans_up_and_keeps_the_old_result() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        result(&target, "run", "old");
        {
            let s = StagedDir::new(&target, true, "run").unwrap();
            fs::write(s.path().join("half"), "x").unwrap();
            assert_eq!(fs::read_to_string(target.join("points.csv")).unwrap(), "old");
        }
        assert_eq!(names(t.path()), ["run"]);
        assert_eq!(fs::read_to_string(target.join("points.csv")).unwrap(), "old");
    }

    #[test]
    fn existing_results_need_force() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        fs::create_dir(&target).unwrap();
        // An empty folder is nothing to lose.
        drop(StagedDir::new(&target, false, "run").unwrap());
        result(&target, "run", "old");
        let e = StagedDir::new(&target, false, "run").unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("--force"), "{e}");
        let s = StagedDir::new(&target, true, "run").unwrap();
        fs::write(s.path().join("new"), "new").unwrap();
        s.commit().unwrap();
        assert_eq!(names(&target), [MANIFEST, "new"]);
        assert_eq!(names(t.path()), ["run"]);
    }

    #[test]
    fn foreign_folders_are_never_replaced() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("thesis");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("chapter.tex"), "years").unwrap();
        assert!(refusal(&target, "run").contains("manifest.json"));
        // A manifest of others, such as that of a web application, or what is no JSON.
        for text in ["{}", "{\"name\": \"app\"}", "{\"catseye\": 1, \"kind\": \"run\"}", "no json", "[]"] {
            fs::write(target.join(MANIFEST), text).unwrap();
            assert!(refusal(&target, "run").contains("did not write"), "{text}");
        }
        assert_eq!(names(&target), ["chapter.tex", MANIFEST]);
        let e = StagedDir::new(target.join("chapter.tex"), true, "run").unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert_eq!(StagedDir::new("/", true, "run").unwrap_err().exit_code(), 2);
        assert_eq!(StagedDir::new("", true, "run").unwrap_err().exit_code(), 2);
        assert_eq!(names(t.path()), ["thesis"]);
    }

    #[test]
    fn results_with_more_in_them_or_of_another_kind_are_kept() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        result(&target, "run", "old");
        assert!(refusal(&target, "process").contains("'run'"));
        fs::create_dir(target.join("deep")).unwrap();
        fs::write(target.join("deep/notes.txt"), "mine").unwrap();
        assert!(refusal(&target, "run").contains("'deep/notes.txt'"));
        fs::remove_file(target.join("deep/notes.txt")).unwrap();
        // What is missing or changed is nobody's but ours.
        fs::write(target.join("points.csv"), "changed").unwrap();
        result(&target, "run", "new");
        assert_eq!(names(&target), [MANIFEST, "points.csv"]);
        assert_eq!(names(t.path()), ["run"]);
    }

    #[test]
    fn a_result_that_appeared_meanwhile_is_kept() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        let s = StagedDir::new(&target, false, "run").unwrap();
        fs::create_dir(&target).unwrap();
        fs::write(target.join(MANIFEST), "theirs").unwrap();
        assert_eq!(s.commit().unwrap_err().exit_code(), 2);
        assert_eq!(fs::read_to_string(target.join(MANIFEST)).unwrap(), "theirs");
        assert_eq!(names(t.path()), ["run"]);
    }

    #[test]
    fn a_second_writer_is_told() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        let (first, _) = StagedDir::resumable(&target, false, "run", "a").unwrap();
        fs::write(first.path().join("kept"), "kept").unwrap();
        for e in [
            StagedDir::new(&target, true, "run").unwrap_err(),
            // With another identity it would throw away what the first makes.
            StagedDir::resumable(&target, true, "run", "b").unwrap_err(),
        ] {
            assert!(e.exit_code() == 2 && e.to_string().contains("is being written by process"), "{e}");
        }
        first.commit().unwrap();
        assert_eq!(names(&target), ["kept", MANIFEST]);
        assert_eq!(names(t.path()), ["run"]);
    }

    #[test]
    fn what_killed_runs_left_is_cleared_up_or_taken_back() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        result(&target, "run", "old");
        fs::create_dir(t.path().join(".run.partial-1-0")).unwrap();
        fs::create_dir(t.path().join(".run2.partial-1-0")).unwrap();
        drop(StagedDir::new(&target, true, "run").unwrap());
        assert_eq!(names(t.path()), [".run2.partial-1-0", "run"]);
        // Killed after the old result was moved aside and before the new one had its name.
        fs::rename(&target, t.path().join(".run.old-1-0")).unwrap();
        let e = StagedDir::new(&target, false, "run").unwrap_err();
        assert!(e.to_string().contains("--force"), "{e}");
        assert_eq!(fs::read_to_string(target.join("points.csv")).unwrap(), "old");
        fs::create_dir(t.path().join(".run.old-2-0")).unwrap();
        drop(StagedDir::new(&target, true, "run").unwrap());
        assert_eq!(names(t.path()), [".run2.partial-1-0", "run"]);
    }

    #[test]
    fn what_a_run_left_that_was_killed_after_its_result_stood_is_cleared_up() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        let start = |force| StagedDir::resumable(&target, force, "run", "a");
        start(false).unwrap().0.commit().unwrap();
        for force in [false, true] {
            fs::create_dir_all(t.path().join(".run.unfinished/notes")).unwrap();
            fs::write(t.path().join(".run.lock"), "").unwrap();
            assert_eq!(start(force).is_ok(), force);
            assert_eq!(names(t.path()).len(), if force { 2 } else { 1 }, "{:?}", names(t.path()));
        }
        // A refusal takes nothing from a run that goes on, nor from one that can be resumed.
        let (first, _) = start(true).unwrap();
        fs::write(first.path().join("kept"), "kept").unwrap();
        start(false).unwrap_err();
        drop(first);
        start(false).unwrap_err();
        assert!(start(true).unwrap().0.path().join("kept").exists());
    }

    #[test]
    fn outputs_over_inputs() {
        let t = tempfile::tempdir().unwrap();
        let at = |name: &str| t.path().join(name);
        fs::write(at("m.glb"), "mesh").unwrap();
        fs::create_dir(at("run")).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(at("m.glb"), at("link.glb")).unwrap();
        distinct(&[&at("o.csv"), &at("o.png")], &[&at("m.glb"), Path::new("a kind of reflector")]).unwrap();
        for (outputs, input) in [
            (vec![at("m.glb")], "m.glb"),
            (vec![at("run/../m.glb")], "m.glb"),
            (vec![at("m.glb")], "link.glb"),
            (vec![at("run/deep.csv")], "run"),
            (vec![at("o.csv"), at("o.csv")], "m.glb"),
            (vec![at("o.csv"), at("run/../o.csv")], "m.glb"),
        ] {
            let outputs: Vec<&Path> = outputs.iter().map(PathBuf::as_path).collect();
            let refused = distinct(&outputs, &[&at(input)]);
            assert!(refused.is_err() || cfg!(not(unix)), "{outputs:?} {input}");
        }
    }

    #[test]
    fn single_files() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("a.csv");
        {
            let s = StagedFile::new(&target, false).unwrap();
            fs::write(s.path(), "half").unwrap();
        }
        assert!(names(t.path()).is_empty());
        write_file(&target, false, b"one").unwrap();
        let e = write_file(&target, false, b"two").unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("--force"), "{e}");
        assert_eq!(fs::read(&target).unwrap(), b"one");
        write_file(&target, true, b"two").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"two");
        assert_eq!(write_file(t.path(), true, b"x").unwrap_err().exit_code(), 2);
        assert_eq!(names(t.path()), ["a.csv"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let t = tempfile::tempdir().unwrap();
        let (real, link) = (t.path().join("real.csv"), t.path().join("link.csv"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_file(&link, true, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }

    #[test]
    fn checksums_of_known_bytes() {
        // FIPS 180-4 examples: "abc" and the empty message.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(sha256_of_bytes(b"abc"), abc);
        let t = tempfile::tempdir().unwrap();
        fs::create_dir(t.path().join("frame_000000")).unwrap();
        fs::write(t.path().join("frame_000000/adc.npy"), "abc").unwrap();
        fs::write(t.path().join("frame_000000/manifest.json"), "").unwrap();
        fs::write(t.path().join(MANIFEST), "self").unwrap();
        let sums = checksums(t.path()).unwrap();
        let expected = BTreeMap::from([
            ("frame_000000/adc.npy".to_string(), abc.to_string()),
            ("frame_000000/manifest.json".to_string(), empty.to_string()),
        ]);
        assert_eq!(sums, expected);
    }
}
