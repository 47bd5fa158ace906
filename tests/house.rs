//! The rules of the house that a test can read off the files.

use catseye::engine::all_kernels;
use catseye::gpu::layout::{check_kernel, module_from_wgsl};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` with this extension, as paths relative to the repository's root with `/`.
fn files(folder: &str, extension: &str) -> Vec<String> {
    fn walk(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, extension, found);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join(folder), extension, &mut found);
    found.sort();
    assert!(!found.is_empty(), "no .{extension} file in {folder}: the test looks in the wrong place");
    let relative = |p: &PathBuf| p.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
    found.iter().map(relative).collect()
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn report(wrong: &[String]) {
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

// ---- shaders ----

/// Shaders that no cpu twin mirrors, and why.
const WITHOUT_CPU_TWIN: [(&str, &str); 7] = [
    ("gpu/selftest", "it examines an adapter and is part of no engine; its host twin holds the truth"),
    ("trace/beam_clip", "a level of what src/cpu/trace/beams.rs does depth first"),
    ("trace/beam_ahead", "a level of what src/cpu/trace/beams.rs does depth first"),
    ("dsp/fft_radix8", "a pass of what src/cpu/dsp/fft.rs leaves to rustfft"),
    ("dsp/fft_radix16", "a pass of what src/cpu/dsp/fft.rs leaves to rustfft"),
    ("dsp/fft_any", "a pass of what src/cpu/dsp/fft.rs leaves to rustfft"),
    ("dsp/fft_chirp", "a pass of what src/cpu/dsp/fft.rs leaves to rustfft"),
];

fn shader_stems() -> BTreeSet<String> {
    files("shaders", "wgsl")
        .iter()
        .filter_map(|f| Some(f.strip_prefix("shaders/")?.strip_suffix(".wgsl")?.to_string()))
        .filter(|stem| !stem.starts_with("shared/"))
        .collect()
}

/// What is missing around the shaders: host twins, cpu twins, rows; and rows without a shader.
fn orphans(stems: &BTreeSet<String>, rows: &[String], exists: impl Fn(&str) -> bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for stem in stems {
        if !exists(&format!("src/{stem}.rs")) {
            wrong.push(format!("shaders/{stem}.wgsl has no host twin src/{stem}.rs"));
        }
        let excused = WITHOUT_CPU_TWIN.iter().any(|(s, _)| s == stem);
        if !excused && !exists(&format!("src/cpu/{stem}.rs")) {
            wrong.push(format!("shaders/{stem}.wgsl has no cpu twin src/cpu/{stem}.rs"));
        }
        if !rows.contains(stem) {
            wrong.push(format!("shaders/{stem}.wgsl has no KERNEL row in engine::all_kernels()"));
        }
    }
    for (i, row) in rows.iter().enumerate() {
        if !stems.contains(row) {
            wrong.push(format!("the KERNEL row {row} has no shaders/{row}.wgsl"));
        }
        if rows[..i].contains(row) {
            wrong.push(format!("two KERNEL rows have the stem {row}"));
        }
    }
    wrong
}

#[test]
fn every_shader_has_its_twins_and_its_row() {
    let rows: Vec<String> = all_kernels().iter().map(|k| k.stem.to_string()).collect();
    report(&orphans(&shader_stems(), &rows, |path| root().join(path).is_file()));
}

#[test]
fn orphans_are_found() {
    let stems = BTreeSet::from(["dsp/fft".to_string(), "gpu/selftest".to_string()]);
    let rows = ["dsp/old".to_string(), "gpu/selftest".to_string(), "gpu/selftest".to_string()];
    let wrong = orphans(&stems, &rows, |path| path == "src/gpu/selftest.rs").join("\n");
    for expected in [
        "no host twin src/dsp/fft.rs",
        "no cpu twin src/cpu/dsp/fft.rs",
        "dsp/fft.wgsl has no KERNEL row",
        "row dsp/old has no",
        "two KERNEL rows",
    ] {
        assert!(wrong.contains(expected), "{wrong}");
    }
    assert_eq!(wrong.lines().count(), 5, "{wrong}");
}

#[test]
fn every_kernel_agrees_with_its_shader() {
    let shared: Vec<String> = files("shaders/shared", "wgsl").iter().map(|f| text(f)).collect();
    let mut wrong = Vec::new();
    for kernel in all_kernels() {
        wrong.extend(check_kernel(kernel).err());
        let entry = format!("shaders/{}.wgsl", kernel.stem);
        match kernel.sources.split_last() {
            Some((last, parts)) => {
                if *last != text(&entry) {
                    wrong.push(format!("{}: the last source is not {entry}", kernel.stem));
                }
                for part in parts {
                    if !shared.iter().any(|s| s == part) {
                        wrong.push(format!("{}: a source is not a file of shaders/shared/", kernel.stem));
                    }
                }
            }
            None => wrong.push(format!("{}: no sources", kernel.stem)),
        }
        if kernel.tolerance.reason.trim().is_empty() {
            wrong.push(format!("{}: the tolerance has no reason", kernel.stem));
        }
    }
    report(&wrong);
}

#[test]
fn shared_parts_hold_no_entry_points() {
    let mut wrong = Vec::new();
    for file in files("shaders/shared", "wgsl") {
        let source = text(&file);
        if source.contains("@compute") || source.contains("@workgroup_size") {
            wrong.push(format!("{file} holds an entry point"));
        }
        if source.contains("@group") {
            wrong.push(format!("{file} holds a binding, which belongs to the entry file"));
        }
    }
    report(&wrong);
    // one that stands alone, so that a fault in it has its own name
    module_from_wgsl("shared", &text("shaders/shared/df64.wgsl")).unwrap();
}

// ---- imports ----

/// Rooms in the order in which data flow. A room imports only those before it, except that the
/// first make one floor.
const ROOMS: [&[&str]; 22] = [
    &["error", "units", "frames", "rng", "machine"],
    &["gpu"],
    &["formats"],
    &["scene"],
    &["road"],
    &["em"],
    &["geom"],
    &["trace"],
    &["rcs"],
    &["adc"],
    &["dsp"],
    &["cpu"],
    &["engine"],
    &["study"],
    &["detect"],
    &["lane"],
    &["dataset"],
    &["validate"],
    &["bench"],
    &["plot"],
    &["trial"],
    &["cli"],
];

/// Arrows that may point back: (from, to, reason).
const EXCEPTIONS: [(&str, &str, &str); 0] = [];

fn floor(room: &str) -> Option<usize> {
    ROOMS.iter().position(|rooms| rooms.contains(&room))
}

/// Rust code without comments, strings and characters, each replaced by a space.
fn bare_code(source: &str) -> String {
    let c: Vec<char> = source.chars().collect();
    let mut out = String::new();
    let mut i = 0;
    let is_word = |ch: char| ch.is_alphanumeric() || ch == '_';
    while i < c.len() {
        let next = c.get(i + 1).copied().unwrap_or(' ');
        let starts_word = i == 0 || !is_word(c[i - 1]);
        if c[i] == '/' && next == '/' {
            while i < c.len() && c[i] != '\n' {
                i += 1;
            }
        } else if c[i] == '/' && next == '*' {
            let mut depth = 0;
            loop {
                match (c.get(i), c.get(i + 1)) {
                    (Some('/'), Some('*')) => (depth, i) = (depth + 1, i + 2),
                    (Some('*'), Some('/')) => (depth, i) = (depth - 1, i + 2),
                    (Some(_), _) => i += 1,
                    (None, _) => break,
                }
                if depth == 0 {
                    break;
                }
            }
        } else if c[i] == 'r' && starts_word && (next == '"' || next == '#') {
            let hashes = c[i + 1..].iter().take_while(|&&h| h == '#').count();
            if c.get(i + 1 + hashes) == Some(&'"') {
                let end: String = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
                i += 2 + hashes;
                let rest: String = c[i..].iter().collect();
                let length = rest.find(&end).map_or(rest.len(), |at| at + end.len());
                i += rest[..length].chars().count();
            } else {
                out.push('r');
                i += 1;
                continue;
            }
        } else if c[i] == '"' {
            i += 1;
            while i < c.len() && c[i] != '"' {
                i += if c[i] == '\\' { 2 } else { 1 };
            }
            i += 1;
        } else if c[i] == '\'' && (next == '\\' || c.get(i + 2) == Some(&'\'')) {
            // a character, not a lifetime
            i += if next == '\\' { 3 } else { 2 };
            while i < c.len() && c[i] != '\'' {
                i += 1;
            }
            i += 1;
        } else {
            out.push(c[i]);
            i += 1;
            continue;
        }
        out.push(' ');
    }
    out
}

/// Bare code without the modules that only tests see.
fn without_tests(code: &str) -> String {
    let mut rest = code;
    let mut out = String::new();
    while let Some(at) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..at]);
        let after = &rest[at + "#[cfg(test)]".len()..];
        let item = after.trim_start();
        if !(item.starts_with("mod ") || item.starts_with("pub mod ")) {
            rest = after;
            continue;
        }
        let mut depth = 0;
        let mut end = after.len();
        for (i, ch) in after.char_indices() {
            match ch {
                '{' => depth += 1,
                '}' => depth -= 1,
                ';' if depth == 0 => {}
                _ => continue,
            }
            if depth == 0 {
                end = i + 1;
                break;
            }
        }
        rest = &after[end..];
    }
    out.push_str(rest);
    out
}

/// Words and punctuation, with `::` as one.
fn tokens(code: &str) -> Vec<String> {
    let c: Vec<char> = code.chars().collect();
    let mut out = Vec::new();
    let mut i = 0;
    while i < c.len() {
        let start = i;
        if c[i].is_alphanumeric() || c[i] == '_' {
            while i < c.len() && (c[i].is_alphanumeric() || c[i] == '_') {
                i += 1;
            }
        } else if c[i] == ':' && c.get(i + 1) == Some(&':') {
            i += 2;
        } else {
            i += 1;
        }
        if !c[start].is_whitespace() {
            out.push(c[start..i].iter().collect());
        }
    }
    out
}

/// What a file in `src/` names at the root of the crate: `crate::x`, `crate::{x, y::z}`, and as many
/// `super::` as lead there.
fn imports(path: &str, source: &str) -> BTreeSet<String> {
    let inside = path.strip_prefix("src/").unwrap_or(path).trim_end_matches(".rs");
    let depth = inside.trim_end_matches("/mod").split('/').count();
    let t = tokens(&without_tests(&bare_code(source)));
    let mut found = BTreeSet::new();
    let mut i = 0;
    while i < t.len() {
        let mut at = i;
        if t[at] == "crate" {
            at += 1;
        } else {
            let mut supers = 0;
            while t.get(at).is_some_and(|w| w == "super") && t.get(at + 1).is_some_and(|w| w == "::") {
                supers += 1;
                at += if supers == depth { 1 } else { 2 };
                if supers == depth {
                    break;
                }
            }
            if supers < depth {
                i = at.max(i + 1);
                continue;
            }
        }
        i = at;
        if t.get(at).is_none_or(|w| w != "::") {
            continue;
        }
        at += 1;
        if t.get(at).is_some_and(|w| w == "{") {
            // the first word of each item of the group
            let mut level = 1;
            let mut first = true;
            at += 1;
            while let Some(word) = t.get(at).filter(|_| level > 0) {
                match word.as_str() {
                    "{" => level += 1,
                    "}" => level -= 1,
                    "," if level == 1 => first = true,
                    word if first => {
                        found.insert(word.to_string());
                        first = false;
                    }
                    _ => {}
                }
                at += 1;
            }
        } else if let Some(word) = t.get(at) {
            found.insert(word.clone());
        }
    }
    found
}

/// Arrows that point the wrong way, in words.
fn backward_imports(path: &str, source: &str) -> Vec<String> {
    let room = path.trim_start_matches("src/").split('/').next().unwrap_or("").trim_end_matches(".rs");
    let Some(from) = floor(room) else {
        return vec![format!("{path}: the room {room} is not in the list of tests/house.rs")];
    };
    let mut wrong = Vec::new();
    for name in imports(path, source) {
        // what lib.rs re-exports and the gpu room's macro stand at the crate's root
        let target = match name.as_str() {
            "Error" | "Result" => "error",
            "gpu_struct" => "gpu",
            other => other,
        };
        match floor(target) {
            None => wrong.push(format!("{path}: crate::{name} is no room of the list in tests/house.rs")),
            Some(to) if to > from && !EXCEPTIONS.iter().any(|(f, t, _)| *f == room && *t == target) => {
                wrong.push(format!("{path}: {room} imports {target}, which stands below it"));
            }
            Some(_) => {}
        }
    }
    wrong
}

#[test]
fn imports_point_one_way() {
    let mut wrong = Vec::new();
    let mut arrows = 0;
    for file in files("src", "rs") {
        if file == "src/lib.rs" || file == "src/main.rs" {
            continue;
        }
        let source = text(&file);
        arrows += imports(&file, &source).len();
        wrong.extend(backward_imports(&file, &source));
    }
    report(&wrong);
    assert!(arrows > 5, "only {arrows} imports found in src/: the reader of imports is blind");
}

#[test]
fn wrong_arrows_are_found() {
    for (path, source, expected) in [
        ("src/adc/synth.rs", "use crate::cpu::dsp;", "adc imports cpu"),
        ("src/adc/mod.rs", "use crate::{error::Error, units::{C0, T0_K}, dsp::Cell};", "adc imports dsp"),
        ("src/scene/gltf.rs", "fn f() { let x = crate::geom::bvh::build(); }", "scene imports geom"),
        ("src/units.rs", "pub(crate) use crate::engine as e;", "units imports engine"),
        ("src/trace/launch.rs", "use super::super::cli::run;", "trace imports cli"),
        ("src/trace/mod.rs", "use super::plot;", "trace imports plot"),
        ("src/cpu/adc/synth.rs", "use super::super::super::engine;", "cpu imports engine"),
        ("src/gpu/layout.rs", "macro_rules! m { () => { $crate::dsp::f() } }", "gpu imports dsp"),
        ("src/em/mie.rs", "#[cfg(test)] fn f() {} use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "#[cfg(test)] mod tests { fn f() {} } use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "const Q: char = '\"'; use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "fn f<'a>(x: &'a str) { crate :: rcs :: g(x) }", "em imports rcs"),
        ("src/em/mie.rs", "use crate::attic::x;", "crate::attic is no room"),
        ("src/attic/x.rs", "", "room attic is not in the list"),
    ] {
        let wrong = backward_imports(path, source).join("\n");
        assert!(wrong.contains(expected), "{path} {source:?}: {wrong:?} lacks {expected:?}");
    }
    for (path, source) in [
        ("src/dsp/fft.rs", "use crate::{Error, Result, adc::Cube}; use super::Cell;"),
        ("src/units.rs", "use crate::frames::World;"),
        (
            "src/em/mie.rs",
            "// use crate::rcs::T;\n/* crate::cli /* crate::plot */ */ const S: &str = \"crate::cli\";",
        ),
        ("src/em/mie.rs", "const S: &str = r#\"crate::cli \"quoted\" \"#; fn f() {}"),
        (
            "src/em/mie.rs",
            "pub fn f() {} #[cfg(test)] mod tests { use crate::cli::{a, b}; mod x { fn g() {} } }",
        ),
        ("src/cpu/adc/synth.rs", "use super::super::trace::closest; use crate::gpu_struct;"),
    ] {
        assert_eq!(backward_imports(path, source), Vec::<String>::new(), "{path} {source:?}");
    }
}

// ---- unsafe ----

fn is_unsafe_allowed(path: &str) -> bool {
    path.starts_with("src/gpu/") || path == "src/cpu/simd.rs"
}

fn holds_unsafe(source: &str) -> bool {
    tokens(&bare_code(source)).iter().any(|t| t == "unsafe")
}

#[test]
fn unsafe_only_where_allowed() {
    let wrong: Vec<String> = files("src", "rs")
        .into_iter()
        .filter(|f| !is_unsafe_allowed(f) && holds_unsafe(&text(f)))
        .map(|f| format!("{f} holds unsafe code"))
        .collect();
    report(&wrong);
    assert!(holds_unsafe("fn f() { unsafe { g() } }"));
    assert!(!holds_unsafe("#![deny(unsafe_code)] // unsafe\nconst S: &str = \"unsafe\";"));
}
