//! The folder below which all files of the tools lie.

use catseye::base::error::{BadInput, Result};
use catseye::formats::input;
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

/// Largest TOML file whose names of other files are followed, bytes; the readers refuse larger ones themselves.
const LARGEST_TOML: u64 = 16 << 20;

/// A folder, which is also the working directory.
#[derive(Debug, Clone)]
pub struct Root {
    /// Without links.
    folder: PathBuf,
}

impl Root {
    /// Makes `folder` the working directory and the root.
    ///
    /// # Errors
    /// Returns `BadInput` if it is no folder.
    pub fn enter(folder: &Path) -> Result<Root> {
        let no_folder = |why: String| {
            BadInput::new(why).key("--root").value(folder.display()).remedy("give a folder that exists")
        };
        let real = folder.canonicalize().map_err(|e| no_folder(e.to_string()))?;
        std::env::set_current_dir(&real).map_err(|e| no_folder(e.to_string()))?;
        Ok(Root { folder: real })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The path that the input `key` gives, relative to the root. What of it exists is followed through its links.
    ///
    /// # Errors
    /// Returns `BadInput` for a path that leads out of the root.
    pub fn inside(&self, key: &str, path: impl AsRef<Path>) -> Result<PathBuf> {
        let path = path.as_ref();
        let outside = || {
            BadInput::new("leads out of the folder of this server")
                .key(key)
                .value(path.display())
                .allowed(format!("paths below {}", self.folder.display()))
                .remedy("give a path below it, or start the server with --root DIR")
        };
        // Without links first: what `..` means must not depend on what exists.
        let mut plain = PathBuf::new();
        for part in self.folder.join(path).components() {
            match part {
                Component::ParentDir => _ = plain.pop(),
                Component::CurDir => {}
                part => plain.push(part),
            }
        }
        if !plain.starts_with(&self.folder) {
            return Err(outside().into());
        }
        // The nearest that exists, or is a link to what does not exist, decides where the rest would be.
        let there = plain.ancestors().find(|p| p.symlink_metadata().is_ok()).unwrap_or(&self.folder);
        let real = there.canonicalize().map_err(|_| outside())?;
        if !real.starts_with(&self.folder) {
            return Err(outside().into());
        }
        let relative = plain.strip_prefix(&self.folder).unwrap_or(&plain);
        Ok(if relative.as_os_str().is_empty() { ".".into() } else { relative.to_path_buf() })
    }

    /// The file that `key` names, for a reader that follows the names in it: it and all that it names, and those name, lie below
    /// the root. (Readers of glTF and OpenDRIVE keep to the folder of their file by themselves.)
    ///
    /// # Errors
    /// Returns `BadInput` for a path that leads out of the root, in `path` or in a file that is named.
    pub fn inside_with_named(&self, key: &str, path: impl AsRef<Path>) -> Result<PathBuf> {
        let path = self.inside(key, path)?;
        self.follow(vec![path.clone()])?;
        Ok(path)
    }

    /// Checks the names of files in a text, which stands for the file that it will be, and those in the files that it names.
    ///
    /// # Errors
    /// Returns `BadInput` for a path that leads out of the root.
    pub fn named_by(&self, key: &str, file: &Path, text: &str) -> Result<()> {
        self.inside(key, file)?;
        self.follow(self.named(file, text)?)
    }

    fn follow(&self, mut open: Vec<PathBuf>) -> Result<()> {
        let mut seen = BTreeSet::new();
        while let Some(file) = open.pop() {
            // A file of another ending may be read as TOML, too. Larger ones are refused by their readers.
            let small = file.metadata().is_ok_and(|m| m.is_file() && m.len() <= LARGEST_TOML);
            if !seen.insert(file.clone()) || !small || holds_no_names(&file) {
                continue;
            }
            let bytes = input::read(&file, "a TOML file", LARGEST_TOML)?;
            open.extend(self.named(&file, &String::from_utf8_lossy(&bytes))?);
        }
        Ok(())
    }

    /// Files that the TOML text of `file` names, as far as they exist, by paths from the root.
    ///
    /// # Errors
    /// Returns `BadInput` for a name that leads out of the root.
    fn named(&self, file: &Path, text: &str) -> Result<Vec<PathBuf>> {
        // What is no TOML is complained about by its reader.
        let Ok(table) = text.parse::<toml::Table>() else { return Ok(Vec::new()) };
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut words = Vec::new();
        strings(&toml::Value::Table(table), "", &mut words);
        let mut found = Vec::new();
        for (key, word) in words {
            found.extend(self.words(&key, folder, &word).map_err(|e| e.in_file(file))?);
        }
        Ok(found)
    }

    /// Files below `folder` that a value names, as far as they exist: by itself, or in the words of a reflector or a material.
    ///
    /// # Errors
    /// Returns `BadInput` for a name that leads out of the root.
    pub fn words(&self, key: &str, folder: &Path, value: &str) -> Result<Vec<PathBuf>> {
        let mut found = Vec::new();
        for piece in pieces(value) {
            let path = Path::new(piece);
            let leaves = piece.starts_with('/')
                || piece.contains('\\')
                || path.is_absolute()
                || path.components().any(|c| c == Component::ParentDir);
            let at = folder.join(path);
            if leaves || self.folder.join(&at).symlink_metadata().is_ok() {
                found.push(self.inside(key, &at)?);
            }
        }
        Ok(found)
    }
}

/// Whether the file is of a kind that is not TOML.
fn holds_no_names(path: &Path) -> bool {
    const OTHERS: [&str; 11] =
        ["glb", "gltf", "stl", "obj", "csv", "npy", "parquet", "pdf", "png", "svg", "xodr"];
    path.extension().is_some_and(|e| OTHERS.iter().any(|other| e.eq_ignore_ascii_case(other)))
}

/// What in a value may be a path: the whole, and the values of a reflector's or material's words.
fn pieces(word: &str) -> Vec<&str> {
    // An address of the web is none.
    let is_address = (word.starts_with("https://") || word.starts_with("http://")) && !word.contains("..");
    if word.is_empty() || is_address {
        return Vec::new();
    }
    let mut pieces = vec![word];
    pieces.extend(word.split([':', ',', '=']).filter(|p| !p.is_empty() && p.len() < word.len()));
    pieces
}

/// All texts of a document with their keys.
fn strings(value: &toml::Value, key: &str, out: &mut Vec<(String, String)>) {
    match value {
        toml::Value::String(text) => out.push((key.into(), text.clone())),
        toml::Value::Array(list) => list.iter().for_each(|v| strings(v, key, out)),
        toml::Value::Table(table) => {
            for (name, v) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                strings(v, &key, out);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(folder: &Path) -> Root {
        Root { folder: folder.canonicalize().unwrap() }
    }

    #[test]
    fn paths_stay_below_the_root() {
        let t = tempfile::tempdir().unwrap();
        let here = t.path().join("here");
        std::fs::create_dir_all(here.join("a")).unwrap();
        std::fs::write(t.path().join("secret.toml"), "").unwrap();
        let root = root(&here);
        for (given, inside) in
            [("a/b.toml", "a/b.toml"), ("./a/../c", "c"), (".", "."), ("new/deep/x.csv", "new/deep/x.csv")]
        {
            assert_eq!(root.inside("file", given).unwrap(), Path::new(inside), "{given}");
        }
        let absolute = root.folder().join("a/x");
        assert_eq!(root.inside("file", &absolute).unwrap(), Path::new("a/x"));
        for given in
            ["..", "../secret.toml", "a/../../secret.toml", "no/../../secret.toml", "/etc/passwd", "../here2"]
        {
            let e = root.inside("file", given).unwrap_err().to_string();
            assert!(e.contains("leads out of the folder") && e.contains("file = "), "{given}: {e}");
        }
        assert!(root.inside("file", "../here/a").is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        use std::os::unix::fs::symlink;
        let t = tempfile::tempdir().unwrap();
        let here = t.path().join("here");
        std::fs::create_dir_all(here.join("a")).unwrap();
        symlink(t.path(), here.join("out")).unwrap();
        symlink(t.path().join("not-there"), here.join("dangling")).unwrap();
        symlink(here.join("a"), here.join("in")).unwrap();
        let root = root(&here);
        for given in ["out", "out/new.csv", "out/x/y.csv", "dangling", "dangling/x"] {
            assert!(root.inside("output", given).is_err(), "{given}");
        }
        assert_eq!(root.inside("output", "in/x").unwrap(), Path::new("in/x"));
    }

    #[test]
    fn names_in_files_stay_below_the_root() {
        let t = tempfile::tempdir().unwrap();
        let here = t.path().join("here");
        std::fs::create_dir_all(here.join("a")).unwrap();
        std::fs::write(t.path().join("secret.toml"), "").unwrap();
        let root = root(&here);
        let file = Path::new("a/s.toml");
        for (text, key) in [
            ("radar = \"../../secret.toml\"", "radar"),
            ("[scene]\nroad = \"/etc/x.toml\"", "scene.road"),
            ("[[object]]\nfile = \"x:table=../../s.csv\"", "object.file"),
        ] {
            let e = root.named(file, text).unwrap_err().to_string();
            assert!(e.contains(&format!("{key} = ")) && e.starts_with("a/s.toml"), "{e}");
        }
        for text in
            ["radar = \"../demo.toml\"", "name = \"a/b, c: d\"", "licence = \"https://x.org/l\"", "wrong ="]
        {
            assert!(root.named(file, text).is_ok(), "{text}");
        }
    }
}
