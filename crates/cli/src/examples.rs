//! `catseye examples`: the scenes that come with the program, written out with all that they name.

use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result, nearest};
use catseye::formats::stage;
use catseye::scene::scenario::without_schema;
use clap::Args;
use include_dir::{Dir, include_dir};
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

static SCENES: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../../scenes");

/// List the built-in example scenarios, roads, radars, recipes and studies, or write one with all files that it refers to
#[derive(Debug, Args)]
pub struct Examples {
    /// Name from the list, such as lane/markers_turn, or its last part; all writes all examples
    pub name: Option<String>,
    /// Folder to write into
    #[arg(short, long, value_name = "DIR", default_value = "scenes")]
    pub output: PathBuf,
}

/// Path below the folder of scenes, and text.
type File = (&'static str, &'static str);

fn all() -> Vec<File> {
    fn walk(dir: &'static Dir<'static>, out: &mut Vec<File>) {
        let text = |f: &'static include_dir::File<'static>| Some((f.path().to_str()?, f.contents_utf8()?));
        out.extend(dir.files().filter_map(text).filter(|(path, _)| !path.ends_with(".md")));
        dir.dirs().for_each(|d| walk(d, out));
    }
    let mut out = Vec::new();
    walk(&SCENES, &mut out);
    out.sort_unstable();
    out
}

fn name_of(path: &str) -> &str {
    path.strip_suffix(".toml").unwrap_or(path)
}

/// The first sentence of a file's first remark.
fn about(text: &str) -> String {
    let remarks = text.lines().filter(|l| !l.starts_with("#:")).map_while(|l| l.strip_prefix('#'));
    let mut remark = remarks.map(str::trim).take(2).collect::<Vec<_>>().join(" ");
    if remark.is_empty() {
        let title = text.lines().find_map(|l| l.strip_prefix("title = "));
        remark = title.unwrap_or("").trim_matches('"').into();
    }
    match remark.split_once(". ") {
        Some((first, _)) => first.to_string(),
        None => remark.trim_end_matches('.').to_string(),
    }
}

/// A file and all that it and those name, in quotes and relative to their folders.
fn with_named(first: File, all: &[File]) -> BTreeSet<File> {
    let mut found = BTreeSet::from([first]);
    let mut open = vec![first];
    while let Some((path, text)) = open.pop() {
        let folder = Path::new(path).parent().unwrap_or(Path::new(""));
        for word in text.lines().filter(|l| !l.trim_start().starts_with('#')).flat_map(|l| l.split('"')) {
            let at = normal(&folder.join(word));
            if let Some(file) = all.iter().find(|f| Path::new(f.0) == at)
                && found.insert(*file)
            {
                open.push(*file);
            }
        }
    }
    found
}

fn normal(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut out, part| {
        match part {
            Component::ParentDir => _ = out.pop(),
            Component::Normal(name) => out.push(name),
            _ => {}
        }
        out
    })
}

fn find(name: &str, all: &[File]) -> Result<File> {
    let wanted = name_of(name.strip_prefix("scenes/").unwrap_or(name));
    let last = |path: &'static str| name_of(path).rsplit('/').next().unwrap_or(path);
    let mut found = all.iter().filter(|(path, _)| name_of(path) == wanted || last(path) == wanted);
    match (found.next(), found.next()) {
        (Some(one), None) => Ok(*one),
        (Some((a, _)), Some((b, _))) => Err(BadInput::new("several examples have this name")
            .key("NAME")
            .value(name)
            .allowed(format!("{}, {}", name_of(a), name_of(b)))
            .into()),
        (None, _) => {
            let e = BadInput::new("is not the name of an example").key("NAME").value(name);
            let near = nearest(wanted, all.iter().flat_map(|(path, _)| [name_of(path), last(path)]));
            Err(match near {
                Some(n) => e.remedy(format!("did you mean '{n}'? `catseye examples` lists all")),
                None => e.remedy("`catseye examples` lists all"),
            }
            .into())
        }
    }
}

impl Examples {
    pub fn run(&self, global: &Global) -> Result<()> {
        let all = all();
        let Some(name) = &self.name else {
            if global.json {
                let list = all.iter().map(|(path, text)| (name_of(path), about(text)));
                return print_json(&list.collect::<std::collections::BTreeMap<_, _>>());
            }
            let width = all.iter().map(|(path, _)| name_of(path).len()).max().unwrap_or(0);
            return all.iter().try_for_each(|(path, text)| {
                let line = format!("{:width$}  {}", name_of(path), about(text));
                print(&line.chars().take(140).collect::<String>())
            });
        };
        let files = match name.as_str() {
            "all" => all.iter().copied().collect(),
            name => with_named(find(name, &all)?, &all),
        };
        // What stands there already as it is to be written stays.
        let mut missing = Vec::new();
        for (path, text) in files {
            let to = self.output.join(path);
            let text = without_schema(text);
            if std::fs::read_to_string(&to).is_ok_and(|there| there == text) {
                continue;
            }
            if to.exists() && !global.force {
                return Err(BadInput::new("exists already and has other contents")
                    .file(&to)
                    .remedy("give --force to replace it, or another folder with -o")
                    .into());
            }
            missing.push((to, text));
        }
        let mut written = Vec::new();
        for (to, text) in missing {
            written.push(stage::write_file(&to, global.force, text.as_bytes())?);
        }
        if global.json {
            return print_json(&serde_json::json!({ "files": written }));
        }
        written.iter().try_for_each(|f| print(&format!("wrote {}", f.display())))?;
        match written.is_empty() {
            true => print("all files exist already"),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_found_by_its_name_and_says_what_it_is() {
        let all = all();
        assert!(all.len() > 100, "{}", all.len());
        for (path, text) in &all {
            assert_eq!(find(path, &all).unwrap().0, *path);
            assert!(about(text).len() > 10, "{path}: {}", about(text));
        }
        assert!(find("lane/marker_turn", &all).unwrap_err().to_string().contains("'lane/markers_turn'"));
    }

    #[test]
    fn an_example_brings_what_it_names() {
        let all = all();
        for file in &all {
            let with: Vec<&str> = with_named(*file, &all).iter().map(|f| f.0).collect();
            let folder = Path::new(file.0).parent().unwrap();
            for word in file.1.lines().filter(|l| !l.starts_with('#')).flat_map(|l| l.split('"')) {
                if word.ends_with(".toml") {
                    let at = normal(&folder.join(word));
                    assert!(with.iter().any(|p| Path::new(p) == at), "{}: {word}", file.0);
                }
            }
        }
    }
}
