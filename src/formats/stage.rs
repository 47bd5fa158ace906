//! Output that appears under its final name only when it is complete. Work goes into a sibling with
//! a hidden temporary name and is renamed on commit; until then an older result stays as it was.

use crate::error::{BadInput, Error, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// The file that marks a folder as a result of this program.
pub const MANIFEST: &str = "manifest.json";

/// A folder under construction. Dropped without [`commit`](StagedDir::commit), it leaves nothing, unless
/// it is [resumable](StagedDir::resumable).
#[derive(Debug)]
pub struct StagedDir {
    final_path: PathBuf,
    temporary: PathBuf,
    force: bool,
    done: bool,
    /// Of a resumable one: the hidden folder with all that a later start needs.
    workshop: Option<PathBuf>,
}

/// In a workshop: what is made there; the folder under construction; notes on the way.
const IDENTITY: &str = "identity";
const RESULT: &str = "result";
const NOTES: &str = "notes";

impl StagedDir {
    /// Makes the temporary folder next to `final_path` (whose parents are made too).
    ///
    /// # Errors
    /// `BadInput` when a result is there already and `force` is not given, or when something is
    /// there that is not a result (a folder that is not empty and has no `manifest.json`, or a
    /// file): that is not replaced even with `force`.
    pub fn new(final_path: impl AsRef<Path>, force: bool) -> Result<Self> {
        let final_path = resolved(final_path.as_ref())?;
        check_dir(&final_path, force)?;
        let temporary = sibling(&final_path, "partial")?;
        make_parents(&final_path)?;
        fs::create_dir(&temporary).map_err(|e| Error::io(&temporary, e))?;
        Ok(StagedDir { final_path, temporary, force, done: false, workshop: None })
    }

    /// A folder that survives an interruption, and another one for notes and finished parts that a later
    /// start needs: they are no part of the result, so that nothing has to be taken out of it before the
    /// commit. A later call with the same `identity` finds both as they were, one with another finds
    /// them empty.
    ///
    /// # Errors
    /// As [`StagedDir::new`].
    pub fn resumable(final_path: impl AsRef<Path>, force: bool, identity: &str) -> Result<(Self, PathBuf)> {
        let final_path = resolved(final_path.as_ref())?;
        check_dir(&final_path, force)?;
        make_parents(&final_path)?;
        let workshop = hidden(&final_path, "unfinished")?;
        let temporary = workshop.join(RESULT);
        let notes = workshop.join(NOTES);
        let mark = workshop.join(IDENTITY);
        // A workshop whose result has been taken out was left by a commit that could not tidy up.
        let resumed = temporary.is_dir() && fs::read_to_string(&mark).is_ok_and(|found| found == identity);
        if !resumed {
            if workshop.exists() {
                fs::remove_dir_all(&workshop).map_err(|e| Error::io(&workshop, e))?;
            }
            for folder in [&workshop, &temporary, &notes] {
                fs::create_dir(folder).map_err(|e| Error::io(folder, e))?;
            }
            fs::write(&mark, identity).map_err(|e| Error::io(&mark, e))?;
        }
        Ok((StagedDir { final_path, temporary, force, done: false, workshop: Some(workshop) }, notes))
    }

    /// The folder to write into.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// Where it will stand.
    pub fn final_path(&self) -> &Path {
        &self.final_path
    }

    /// Puts the folder under its final name. An older result is moved aside first and deleted last,
    /// and comes back if the renaming fails.
    pub fn commit(mut self) -> Result<PathBuf> {
        // Checked again: somebody may have written there meanwhile.
        check_dir(&self.final_path, self.force)?;
        let old = if self.final_path.exists() {
            let old = sibling(&self.final_path, "old")?;
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
        for rest in old.iter().chain(&self.workshop) {
            fs::remove_dir_all(rest).map_err(|e| Error::io(rest, e))?;
        }
        Ok(self.final_path.clone())
    }
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
    /// # Errors
    /// `BadInput` when the file exists and `force` is not given, or when a folder has its name.
    pub fn new(final_path: impl AsRef<Path>, force: bool) -> Result<Self> {
        let final_path = resolved(final_path.as_ref())?;
        check_file(&final_path, force)?;
        let temporary = sibling(&final_path, "partial")?;
        make_parents(&final_path)?;
        // Made at once, so that a place that cannot be written is known before the work.
        fs::File::create_new(&temporary).map_err(|e| Error::io(&temporary, e))?;
        Ok(StagedFile { final_path, temporary, force, done: false })
    }

    /// The name to write to.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    pub fn final_path(&self) -> &Path {
        &self.final_path
    }

    pub fn commit(mut self) -> Result<PathBuf> {
        check_file(&self.final_path, self.force)?;
        fs::rename(&self.temporary, &self.final_path).map_err(|e| Error::io(&self.final_path, e))?;
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
        Some(p) if !p.as_os_str().is_empty() => fs::create_dir_all(p).map_err(|e| Error::io(p, e)),
        _ => Ok(()),
    }
}

fn exists_without_force(path: &Path) -> Error {
    BadInput::new("exists already").file(path).remedy("give --force to replace it, or another name").into()
}

fn check_dir(path: &Path, force: bool) -> Result<()> {
    let Ok(meta) = fs::metadata(path) else {
        return Ok(());
    };
    let refuse = |problem: &str| {
        Err(BadInput::new(problem).file(path).remedy("give another name for the output").into())
    };
    if !meta.is_dir() {
        return refuse("is a file, and a folder is to be written");
    }
    let empty = fs::read_dir(path).map_err(|e| Error::io(path, e))?.next().is_none();
    if empty {
        return Ok(());
    }
    if !path.join(MANIFEST).is_file() {
        return refuse("is a folder that catseye did not write (no manifest.json), so it is not replaced");
    }
    if !force {
        return Err(exists_without_force(path));
    }
    Ok(())
}

fn check_file(path: &Path, force: bool) -> Result<()> {
    match fs::metadata(path) {
        Ok(m) if m.is_dir() => Err(BadInput::new("is a folder, and a file is to be written")
            .file(path)
            .remedy("give another name for the output")
            .into()),
        Ok(_) if !force => Err(exists_without_force(path)),
        _ => Ok(()),
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
        BadInput::new("cannot be written as an output").file(path).remedy("give a name for the output")
    })?;
    let mut file = OsString::from(".");
    file.push(name);
    file.push(format!(".{suffix}"));
    Ok(path.with_file_name(file))
}

/// SHA-256 (FIPS 180-4) of a file's bytes, 64 hexadecimal digits.
pub fn sha256_of_file(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let mut file = fs::File::open(path).map_err(|e| Error::io(path, e))?;
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

/// SHA-256 of bytes in memory.
pub fn sha256_of_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of every file under `dir` except its manifest, by path relative to `dir` with forward slashes,
/// in order.
pub fn checksums(dir: impl AsRef<Path>) -> Result<BTreeMap<String, String>> {
    fn walk(dir: &Path, prefix: &str, out: &mut BTreeMap<String, String>) -> Result<()> {
        for entry in fs::read_dir(dir).map_err(|e| Error::io(dir, e))? {
            let entry = entry.map_err(|e| Error::io(dir, e))?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            let kind = entry.file_type().map_err(|e| Error::io(entry.path(), e))?;
            if kind.is_dir() {
                walk(&entry.path(), &format!("{name}/"), out)?;
            } else if name != MANIFEST {
                out.insert(name, sha256_of_file(entry.path())?);
            }
        }
        Ok(())
    }
    let mut out = BTreeMap::new();
    walk(dir.as_ref(), "", &mut out)?;
    Ok(out)
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
        let s = StagedDir::new(&target, false).unwrap();
        fs::write(s.path().join(MANIFEST), "{}").unwrap();
        fs::create_dir(s.path().join("frame_000000")).unwrap();
        assert!(!target.exists());
        assert_eq!(s.commit().unwrap(), target);
        assert_eq!(names(&t.path().join("deep")), ["run"]);
        assert_eq!(names(&target), ["frame_000000", MANIFEST]);
    }

    #[test]
    fn dropping_cleans_up_and_keeps_the_old_result() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        fs::create_dir(&target).unwrap();
        fs::write(target.join(MANIFEST), "old").unwrap();
        {
            let s = StagedDir::new(&target, true).unwrap();
            fs::write(s.path().join("half"), "x").unwrap();
            assert_eq!(fs::read_to_string(target.join(MANIFEST)).unwrap(), "old");
        }
        assert_eq!(names(t.path()), ["run"]);
        assert_eq!(fs::read_to_string(target.join(MANIFEST)).unwrap(), "old");
    }

    #[test]
    fn existing_results_need_force() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        fs::create_dir(&target).unwrap();
        // An empty folder is nothing to lose.
        drop(StagedDir::new(&target, false).unwrap());
        fs::write(target.join(MANIFEST), "old").unwrap();
        fs::write(target.join("left_over"), "old").unwrap();
        let e = StagedDir::new(&target, false).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("--force"), "{e}");
        let s = StagedDir::new(&target, true).unwrap();
        fs::write(s.path().join(MANIFEST), "new").unwrap();
        s.commit().unwrap();
        assert_eq!(names(&target), [MANIFEST]);
        assert_eq!(names(t.path()), ["run"]);
    }

    #[test]
    fn foreign_folders_are_never_replaced() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("thesis");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("chapter.tex"), "years").unwrap();
        let e = StagedDir::new(&target, true).unwrap_err();
        assert!(e.exit_code() == 2 && e.to_string().contains("manifest.json"), "{e}");
        let e = StagedDir::new(target.join("chapter.tex"), true).unwrap_err();
        assert_eq!(e.exit_code(), 2);
        assert_eq!(StagedDir::new("/", true).unwrap_err().exit_code(), 2);
        assert_eq!(StagedDir::new("", true).unwrap_err().exit_code(), 2);
        assert_eq!(names(t.path()), ["thesis"]);
    }

    #[test]
    fn a_result_that_appeared_meanwhile_is_kept() {
        let t = tempfile::tempdir().unwrap();
        let target = t.path().join("run");
        let s = StagedDir::new(&target, false).unwrap();
        fs::create_dir(&target).unwrap();
        fs::write(target.join(MANIFEST), "theirs").unwrap();
        assert_eq!(s.commit().unwrap_err().exit_code(), 2);
        assert_eq!(fs::read_to_string(target.join(MANIFEST)).unwrap(), "theirs");
        assert_eq!(names(t.path()), ["run"]);
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
