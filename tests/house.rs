//! The rules of the house that a test can read off the files.

use catseye::engine::all_kernels;
use catseye::gpu::layout::{check_kernel, module_from_wgsl};
use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
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
const WITHOUT_CPU_TWIN: [(&str, &str); 16] = [
    ("gpu/selftest", "it examines an adapter and is part of no engine; its host twin holds the truth"),
    ("trace/beam_clip", "a level of what src/trace/cpu/beams.rs does depth first"),
    ("trace/beam_ahead", "a level of what src/trace/cpu/beams.rs does depth first"),
    ("trace/view_ahead", "a step of what src/trace/cpu/topology.rs does depth first"),
    ("trace/view_target", "a step of what src/trace/cpu/topology.rs does depth first"),
    ("trace/view_hide", "a step of what src/trace/cpu/topology.rs does depth first"),
    ("trace/view_gather", "it copies what view_hide leaves"),
    ("trace/line_ahead", "a step of what src/trace/cpu/lines.rs does edge by edge"),
    ("trace/line_split", "a step of what src/trace/cpu/lines.rs does edge by edge"),
    ("trace/line_sides", "a step of what src/trace/cpu/lines.rs does edge by edge"),
    ("trace/line_shadow", "a step of what src/trace/cpu/lines.rs does edge by edge"),
    ("trace/line_gather", "it copies what the other kernels of lines leave"),
    ("dsp/fft_radix8", "a pass of what src/dsp/cpu/fft.rs leaves to rustfft"),
    ("dsp/fft_radix16", "a pass of what src/dsp/cpu/fft.rs leaves to rustfft"),
    ("dsp/fft_any", "a pass of what src/dsp/cpu/fft.rs leaves to rustfft"),
    ("dsp/fft_chirp", "a pass of what src/dsp/cpu/fft.rs leaves to rustfft"),
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
        let twin = stem.replacen('/', "/cpu/", 1);
        if !excused && !exists(&format!("src/{twin}.rs")) {
            wrong.push(format!("shaders/{stem}.wgsl has no cpu twin src/{twin}.rs"));
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
        "no cpu twin src/dsp/cpu/fft.rs",
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

/// Metal and Direct3D get their shaders from naga, which has to know how to write each of them: with the entry point, and the size of a
/// workgroup where the language has it in the source.
#[test]
fn every_shader_can_be_written_for_metal_and_direct3d() {
    use naga::back::{hlsl, msl};
    let mut wrong = Vec::new();
    for kernel in all_kernels() {
        let (module, info) = module_from_wgsl(kernel.stem, &kernel.source()).unwrap();
        let options = msl::Options { lang_version: (2, 4), ..Default::default() };
        match msl::write_string(&module, &info, &options, &Default::default()) {
            Err(e) => wrong.push(format!("{}: MSL: {e}", kernel.stem)),
            Ok((text, info)) => {
                let entry = info.entry_point_names.first().and_then(|n| n.as_ref().ok());
                if entry.is_none_or(|name| !text.contains(&format!("kernel void {name}("))) {
                    wrong.push(format!("{}: MSL has no entry point", kernel.stem));
                }
            }
        }
        let options = hlsl::Options { shader_model: hlsl::ShaderModel::V6_0, ..Default::default() };
        let mut text = String::new();
        match hlsl::Writer::new(&mut text, &options, &Default::default()).write(&module, &info, None) {
            Err(e) => wrong.push(format!("{}: HLSL: {e}", kernel.stem)),
            Ok(_) => {
                let [x, y, z] = kernel.workgroup;
                if !text.contains(&format!("[numthreads({x}, {y}, {z})]")) {
                    wrong.push(format!("{}: HLSL has another workgroup", kernel.stem));
                }
            }
        }
    }
    report(&wrong);
}

/// Limits that every WebGPU device keeps (W3C, WebGPU, section 3.6.2, column "default").
const STORAGE_BUFFERS: usize = 8;
const WORKGROUP_BYTES: u32 = 16_384;
const WORKGROUP_THREADS: u32 = 256;

#[test]
fn kernels_stay_within_webgpus_default_limits() {
    let mut wrong = Vec::new();
    for kernel in all_kernels() {
        let (module, _) = module_from_wgsl(kernel.stem, &kernel.source()).unwrap();
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        let bytes: u32 = module
            .global_variables
            .iter()
            .filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup)
            .map(|(_, v)| layouter[v.ty].size)
            .sum();
        let threads: u32 = kernel.workgroup.iter().product();
        let mut too_much = Vec::new();
        if kernel.storage.len() > STORAGE_BUFFERS {
            too_much.push(format!("{} storage buffers of {STORAGE_BUFFERS}", kernel.storage.len()));
        }
        if bytes > WORKGROUP_BYTES {
            too_much.push(format!("{bytes} bytes of workgroup memory of {WORKGROUP_BYTES}"));
        }
        if threads > WORKGROUP_THREADS {
            too_much.push(format!("{threads} threads of {WORKGROUP_THREADS}"));
        }
        if !too_much.is_empty() {
            wrong.push(format!("{}: {}", kernel.stem, too_much.join(", ")));
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

// ---- what files name ----

/// A name that code mentions: `crate::dsp::Cell` as its words, the last of them `*` for all of a module.
type Name = Vec<String>;

/// The names in code outside of modules that only tests see. `uses` are those of `use` items, with the name under which each is known
/// then; the flag says that others see it too. `body` are the rest, in code and in the arguments of macros.
#[derive(Default)]
struct Names {
    uses: Vec<(Name, String, bool)>,
    body: Vec<Name>,
}

fn names_in(source: &str) -> Names {
    let tokens: TokenStream = source.parse().unwrap_or_else(|e| panic!("{e}: {source}"));
    let mut names = Names::default();
    collect(tokens, &mut names);
    names
}

fn is_punct(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == c)
}

fn word(token: Option<&TokenTree>) -> Option<String> {
    match token {
        Some(TokenTree::Ident(i)) => Some(i.to_string()),
        _ => None,
    }
}

fn collect(tokens: TokenStream, names: &mut Names) {
    let t: Vec<TokenTree> = tokens.into_iter().collect();
    let mut only_tests = false;
    let mut is_public = false;
    let mut i = 0;
    while i < t.len() {
        let Some(first) = word(t.get(i)) else {
            if let TokenTree::Group(group) = &t[i] {
                let text = group.stream().to_string().replace(' ', "");
                if is_punct(i.checked_sub(1).and_then(|k| t.get(k)), '#') {
                    only_tests = text == "cfg(test)";
                } else {
                    collect(group.stream(), names);
                }
            } else if is_punct(t.get(i), ';') {
                (only_tests, is_public) = (false, false);
            }
            i += 1;
            continue;
        };
        if first == "mod" && only_tests {
            // what stands between its braces, or in its file
            i += 3;
            (only_tests, is_public) = (false, false);
        } else if first == "use" {
            let end = (i..t.len()).find(|k| is_punct(t.get(*k), ';')).unwrap_or(t.len());
            use_tree(&[], &t[i + 1..end], is_public, &mut names.uses);
            i = end;
        } else {
            is_public = first == "pub" || (is_public && first == "crate");
            if ["fn", "struct", "enum", "impl", "trait", "const", "static", "type"].contains(&first.as_str())
            {
                only_tests = false;
            }
            // a path that begins with `::` is another crate's, a word after a dot a method or field
            let before = i.checked_sub(1).and_then(|k| t.get(k));
            let begins = !is_punct(before, '.') && !is_punct(before, ':') || is_lone_colon(&t, i);
            let mut name = vec![first];
            while is_punct(t.get(i + 1), ':') && is_punct(t.get(i + 2), ':') {
                let Some(next) = word(t.get(i + 3)) else { break };
                name.push(next);
                i += 3;
            }
            if begins {
                names.body.push(name);
            }
            i += 1;
        }
    }
}

/// Of `a: T` and not of `a::T`.
fn is_lone_colon(t: &[TokenTree], at: usize) -> bool {
    is_punct(t.get(at - 1), ':') && !(at >= 2 && is_punct(t.get(at - 2), ':'))
}

/// `a::{b, c::d as e}` and so on, one name each.
fn use_tree(prefix: &[String], t: &[TokenTree], is_public: bool, out: &mut Vec<(Name, String, bool)>) {
    let mut name = prefix.to_vec();
    let mut alias = None;
    let mut i = 0;
    while i < t.len() {
        match &t[i] {
            TokenTree::Group(group) => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                for part in inner.split(|t| is_punct(Some(t), ',')).filter(|p| !p.is_empty()) {
                    use_tree(&name, part, is_public, out);
                }
                return;
            }
            TokenTree::Ident(w) if w == "as" => {
                alias = word(t.get(i + 1));
                i += 1;
            }
            TokenTree::Ident(w) if w == "self" && !prefix.is_empty() => {}
            TokenTree::Ident(w) => name.push(w.to_string()),
            TokenTree::Punct(p) if p.as_char() == '*' => name.push("*".into()),
            _ => {}
        }
        i += 1;
    }
    if let Some(last) = name.last().cloned() {
        out.push((name, alias.unwrap_or(last), is_public));
    }
}

// ---- arrows between rooms and members ----

/// Rooms of the library in the order in which data flow. A room imports only those before it.
const ROOMS: [&str; 14] = [
    "base", "formats", "gpu", "scene", "road", "em", "geom", "trace", "rcs", "adc", "dsp", "engine",
    "detect", "simulate",
];

/// Members of the workspace, each with the folder of its sources: one names only those before it.
const MEMBERS: [(&str, &str); 12] = [
    ("catseye-math", "crates/math"),
    ("catseye", ""),
    ("catseye-io", "crates/io"),
    ("catseye-export", "crates/export"),
    ("catseye-lane", "crates/lane"),
    ("catseye-plot", "crates/plot"),
    ("catseye-design", "crates/design"),
    ("catseye-view", "crates/view"),
    ("catseye-learn", "crates/learn"),
    ("catseye-papers", "crates/papers"),
    ("catseye-cli", "crates/cli"),
    ("catseye-python", "python"),
];

fn floor(room: &str) -> Option<usize> {
    ROOMS.iter().position(|r| *r == room)
}

/// The module that a file of `folder` is, as words: `src/dsp/fft.rs` is `dsp`, `fft`.
fn module_of(folder: &str, path: &str) -> Name {
    let inside = path.strip_prefix(folder).unwrap_or(path).trim_start_matches('/').trim_end_matches(".rs");
    let mut words: Name = inside.split('/').map(String::from).collect();
    if words.last().is_some_and(|w| w == "mod") || words == ["lib"] {
        words.pop();
    }
    words
}

/// From the crate's root, what a name means in module `at` that begins with `crate`, `self` or `super`.
fn absolute(at: &[String], name: &[String]) -> Option<Name> {
    let mut base = match name.first()?.as_str() {
        "crate" => Vec::new(),
        "self" | "super" => at.to_vec(),
        _ => return None,
    };
    let mut rest = name;
    while let Some(w) = rest.first().filter(|w| ["crate", "self", "super"].contains(&w.as_str())) {
        if w == "super" {
            base.pop();
        }
        rest = &rest[1..];
    }
    base.extend_from_slice(rest);
    Some(base)
}

/// The rooms that a file of the library names.
fn rooms_named(path: &str, source: &str) -> BTreeSet<String> {
    let at = module_of("src", path);
    let names = names_in(source);
    let all = names.uses.iter().map(|u| &u.0).chain(&names.body);
    all.filter_map(|n| absolute(&at, n)?.into_iter().next()).collect()
}

/// Arrows that point the wrong way, in words.
fn backward_imports(path: &str, source: &str) -> Vec<String> {
    let room = path.trim_start_matches("src/").split('/').next().unwrap_or("").trim_end_matches(".rs");
    let Some(from) = floor(room) else {
        return vec![format!("{path}: the room {room} is not in the list of tests/house.rs")];
    };
    let mut wrong = Vec::new();
    for name in rooms_named(path, source) {
        // what lib.rs re-exports and the gpu room's macro stand at the crate's root
        let target = match name.as_str() {
            "Error" | "Result" => "base",
            "gpu_struct" => "gpu",
            other => other,
        };
        match floor(target) {
            None => wrong.push(format!("{path}: crate::{name} is no room of the list in tests/house.rs")),
            Some(to) if to > from => {
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
        if file == "src/lib.rs" {
            continue;
        }
        let source = text(&file);
        arrows += rooms_named(&file, &source).len();
        wrong.extend(backward_imports(&file, &source));
    }
    report(&wrong);
    assert!(arrows > 500, "only {arrows} imports found in src/: the reader of imports is blind");
}

#[test]
fn wrong_arrows_are_found() {
    for (path, source, expected) in [
        ("src/adc/synth.rs", "use crate::dsp::cpu;", "adc imports dsp"),
        ("src/adc/mod.rs", "use crate::{base::{error::Error, units::C0}, dsp::Cell};", "adc imports dsp"),
        ("src/scene/gltf.rs", "fn f() { let x = crate::geom::bvh::build(); }", "scene imports geom"),
        ("src/base/units.rs", "pub(crate) use crate::engine as e;", "base imports engine"),
        ("src/trace/launch.rs", "use super::super::engine::run;", "trace imports engine"),
        ("src/trace/mod.rs", "use super::rcs;", "trace imports rcs"),
        ("src/adc/cpu/synth.rs", "use super::super::super::engine;", "adc imports engine"),
        ("src/gpu/layout.rs", "macro_rules! m { () => { $crate::dsp::f() } }", "gpu imports dsp"),
        ("src/em/mie.rs", "#[cfg(test)] fn f() {} use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "#[cfg(test)] mod tests { fn f() {} } use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "const Q: char = '\"'; use crate::rcs::T;", "em imports rcs"),
        ("src/em/mie.rs", "fn f<'a>(x: &'a str) { crate :: rcs :: g(x) }", "em imports rcs"),
        ("src/em/mie.rs", "fn f() { println!(\"{}\", crate::rcs::g()) }", "em imports rcs"),
        ("src/em/mie.rs", "struct S { a: crate::rcs::T }", "em imports rcs"),
        ("src/em/mie.rs", "use crate::attic::x;", "crate::attic is no room"),
        ("src/attic/x.rs", "", "room attic is not in the list"),
    ] {
        let wrong = backward_imports(path, source).join("\n");
        assert!(wrong.contains(expected), "{path} {source:?}: {wrong:?} lacks {expected:?}");
    }
    for (path, source) in [
        ("src/dsp/fft.rs", "use crate::{Error, Result, adc::Cube}; use super::Cell;"),
        ("src/base/units.rs", "use crate::base::frames::World;"),
        (
            "src/em/mie.rs",
            "// use crate::rcs::T;\n/* crate::adc /* crate::dsp */ */ const S: &str = \"crate::adc\";",
        ),
        ("src/em/mie.rs", "const S: &str = r#\"crate::adc \"quoted\" \"#; fn f() {}"),
        (
            "src/em/mie.rs",
            "pub fn f() {} #[cfg(test)] mod tests { use crate::adc::{a, b}; mod x { fn g() {} } }",
        ),
        ("src/adc/cpu/synth.rs", "use super::super::super::trace::closest; use crate::gpu_struct;"),
        ("src/em/mie.rs", "fn f() { ::wgpu::rcs::f(); }"),
    ] {
        assert_eq!(backward_imports(path, source), Vec::<String>::new(), "{path} {source:?}");
    }
}

/// Members that a manifest takes as dependencies and that do not stand before it.
fn backward_members(member: &str, manifest: &str) -> Vec<String> {
    let place = |name: &str| MEMBERS.iter().position(|m| m.0 == name);
    let manifest: toml::Table = manifest.parse().unwrap();
    let taken = manifest.get("dependencies").and_then(|d| d.as_table()).into_iter().flat_map(|d| d.keys());
    taken
        .filter(|name| *name == "catseye" || name.starts_with("catseye-"))
        .filter(|name| place(name).is_none() || place(name) >= place(member))
        .map(|name| format!("{member} takes {name}, which does not stand before it"))
        .collect()
}

#[test]
fn members_point_one_way() {
    let manifest = |folder: &str| text([folder, "Cargo.toml"].join("/").trim_start_matches('/'));
    for entry in fs::read_dir(root().join("crates")).unwrap() {
        let folder = format!("crates/{}", entry.unwrap().file_name().to_str().unwrap());
        assert!(MEMBERS.iter().any(|m| m.1 == folder), "{folder} is not in the list of tests/house.rs");
    }
    report(
        &MEMBERS
            .iter()
            .flat_map(|(name, folder)| backward_members(name, &manifest(folder)))
            .collect::<Vec<_>>(),
    );
    assert_eq!(
        backward_members("catseye-io", "[dependencies]\ncatseye-lane = \"1\"\nserde = \"1\"").len(),
        1
    );
}

// ---- circles of files ----

/// Files of one member and which names of which others each of them uses.
type Graph = BTreeMap<Name, BTreeMap<Name, BTreeSet<String>>>;

/// What each file uses, by its modules. A name that a module only hands on (`pub use`) counts as its origin's, and handing on is no use.
fn uses_of_files(sources: &BTreeMap<Name, String>) -> Graph {
    let names: BTreeMap<&Name, Names> = sources.iter().map(|(m, s)| (m, names_in(s))).collect();
    // the module in which a name stands, and the first word in it
    let located = |at: &Name| {
        let known = (0..=at.len()).rev().find(|n| sources.contains_key(&at[..*n]))?;
        Some((at[..known].to_vec(), at.get(known)?.clone()))
    };
    let resolved = |module: &Name, name: &[String], imported: &BTreeMap<&String, Name>| {
        absolute(module, name).or_else(|| {
            let mut child = module.clone();
            child.push(name[0].clone());
            let base = if sources.contains_key(&child) { child } else { imported.get(&name[0])?.clone() };
            Some(base.into_iter().chain(name[1..].iter().cloned()).collect())
        })
    };
    let none = BTreeMap::new();
    let mut handed_on = BTreeMap::new();
    for (module, names) in &names {
        for (name, known_as, _) in names.uses.iter().filter(|u| u.2) {
            if let Some(origin) = resolved(module, name, &none).and_then(|n| located(&n)) {
                handed_on.insert(((*module).clone(), known_as.clone()), origin);
            }
        }
    }
    let mut graph = Graph::new();
    for (module, names) in &names {
        let mut imported = BTreeMap::new();
        for (name, known_as, _) in &names.uses {
            if let Some(full) = resolved(module, name, &none) {
                imported.insert(known_as, full);
            }
        }
        let mut all: Vec<Name> = names.body.iter().filter_map(|n| resolved(module, n, &imported)).collect();
        let told = |name: &str| names.body.iter().any(|n| n[0] == name);
        let kept = names.uses.iter().filter(|u| !u.2 || told(&u.1));
        all.extend(kept.filter_map(|(n, _, _)| resolved(module, n, &none)));
        let row = graph.entry((*module).clone()).or_default();
        for mut at in all.iter().filter_map(located) {
            while let Some(origin) = handed_on.get(&at) {
                at = origin.clone();
            }
            if at.0 != **module {
                row.entry(at.0).or_default().insert(at.1);
            }
        }
    }
    graph
}

/// For each group of files that use each other in a ring, one shortest ring in words.
fn rings(graph: &Graph) -> Vec<String> {
    let say = |m: &Name| if m.is_empty() { "lib".into() } else { m.join("::") };
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for start in graph.keys() {
        // breadth first, back to the start
        let mut from: BTreeMap<&Name, &Name> = BTreeMap::new();
        let mut queue = VecDeque::from([start]);
        while let Some(m) = queue.pop_front() {
            for next in graph[m].keys() {
                if from.contains_key(next) {
                    continue;
                }
                from.insert(next, m);
                queue.push_back(next);
            }
        }
        if seen.contains(start) || !from.contains_key(start) {
            continue;
        }
        let mut ring = vec![start];
        let mut at = from[start];
        while at != start {
            ring.push(at);
            at = from[at];
        }
        seen.extend(ring.iter().copied());
        ring.reverse();
        let arrow = |k: usize| {
            let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
            let names: Vec<&str> = graph[a][b].iter().map(String::as_str).collect();
            format!("{} uses {} ({})", say(a), say(b), names.join(", "))
        };
        found.push((0..ring.len()).map(arrow).collect::<Vec<_>>().join("; "));
    }
    found
}

#[test]
fn no_circle_of_files() {
    let mut wrong = Vec::new();
    let mut arrows = 0;
    for (member, folder) in MEMBERS {
        let sources = [folder, "src"].join("/").trim_start_matches('/').to_string();
        let is_library = |f: &String| !f.ends_with("/main.rs") && !f.ends_with("/tests.rs");
        let all = files(&sources, "rs").into_iter().filter(is_library);
        let graph = uses_of_files(&all.map(|f| (module_of(&sources, &f), text(&f))).collect());
        arrows += graph.values().map(BTreeMap::len).sum::<usize>();
        wrong.extend(rings(&graph).into_iter().map(|ring| format!("{member}: {ring}")));
    }
    report(&wrong);
    assert!(arrows > 1000, "only {arrows} arrows between files found: the reader of names is blind");
}

#[test]
fn circles_are_found() {
    let ring = |sources: &[(&str, &str)]| {
        let sources = sources.iter().map(|(m, s)| (module_of("", m), s.to_string())).collect();
        rings(&uses_of_files(&sources)).join("\n")
    };
    // by `super`, through an imported module, through a name handed on, inside of a macro
    let parent = ("a/mod.rs", "mod b; mod c; use b::f; pub fn g() { f() }");
    assert!(ring(&[parent, ("a/b.rs", "pub fn f() { super::g() }")]).contains("a uses a::b (f)"));
    let third = ("c.rs", "pub use crate::a::b::f;");
    assert!(
        ring(&[
            ("a/b.rs", "use crate::d; pub fn f() { d::x() }"),
            third,
            ("d.rs", "use crate::c; fn x() { c::f() }")
        ])
        .contains("d uses a::b (f)")
    );
    assert!(
        ring(&[
            ("a.rs", "fn f() { println!(\"{}\", crate::b::x) }"),
            ("b.rs", "use crate::a::f; fn g() { f() }")
        ])
        .contains("a uses b (x)")
    );
    // a parent that hands a child's names on, tests, and a method of the same name make none
    let child = ("a/b.rs", "use super::T; pub struct F(T);");
    assert_eq!(ring(&[("a/mod.rs", "mod b; pub use b::F; pub struct T;"), child]), "");
    let tested = ("a/mod.rs", "mod b; pub struct T; #[cfg(test)] mod tests { use super::b::F; }");
    assert_eq!(ring(&[tested, child]), "");
    assert_eq!(ring(&[("a.rs", "fn f(x: T) { x.b() }"), ("b.rs", "fn g() { crate::a::f() }")]), "");
}

// ---- unsafe ----

fn is_unsafe_allowed(path: &str) -> bool {
    path.starts_with("src/gpu/") || path == "src/base/simd.rs"
}

fn holds_unsafe(tokens: TokenStream) -> bool {
    tokens.into_iter().any(|t| match t {
        TokenTree::Ident(i) => i == "unsafe",
        TokenTree::Group(g) => holds_unsafe(g.stream()),
        _ => false,
    })
}

#[test]
fn unsafe_only_where_allowed() {
    let holds = |source: &str| holds_unsafe(source.parse().unwrap());
    let all = ["src", "crates", "python/src"].into_iter().flat_map(|folder| files(folder, "rs"));
    let wrong: Vec<String> = all
        .filter(|f| !is_unsafe_allowed(f) && holds(&text(f)))
        .map(|f| format!("{f} holds unsafe code"))
        .collect();
    report(&wrong);
    assert!(holds("fn f() { unsafe { g() } }"));
    assert!(!holds("#![deny(unsafe_code)] // unsafe\nconst S: &str = \"unsafe\";"));
}

// ---- words ----

/// Words of this project's past, for which the glossary of CONTRIBUTING.md has the field's. Of several words each is one run of text.
const RETIRED: [&str; 35] = [
    "complaint",
    "complaints",
    "fact",
    "facts",
    "hear",
    "heard",
    "hears",
    "judge",
    "judged",
    "judges",
    "kept echoes",
    "picture",
    "pictures",
    "piece",
    "pieces",
    "place of mirror reflection",
    "places of mirror reflection",
    "remark",
    "remarks",
    "remedies",
    "remedy",
    "skirt",
    "skirts",
    "slopes in turn",
    "spill-over",
    "stand there",
    "stands there",
    "tell apart",
    "tells apart",
    "told",
    "told apart",
    "transmitters in turn",
    "trial",
    "trials",
    "unhidden",
];

/// Names of public items that are as old.
const RETIRED_NAMES: [&str; 5] = ["complaint", "heard", "skirt", "told", "unhidden"];

/// Retired words in prose, with what is around them; what stands in code is left out.
fn retired(prose: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let without_blocks: String = prose.split("```").step_by(2).collect();
    let without_code: String = without_blocks.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    for c in without_code.to_lowercase().chars() {
        match c.is_alphanumeric() || c == '-' {
            true => words.last_mut().unwrap().push(c),
            false if words.last().unwrap().is_empty() => {}
            false => words.push(String::new()),
        }
    }
    let of = |phrase: &&str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        let found = words.windows(phrase.len()).position(|w| w.iter().zip(&phrase).all(|(a, b)| a == b));
        found.map(|at| words[at.saturating_sub(4)..(at + 5).min(words.len())].join(" "))
    };
    RETIRED.iter().filter_map(|phrase| Some(format!("'{phrase}' in \"{}\"", of(phrase)?))).collect()
}

/// Names of public items in a source that have a retired word.
fn retired_names(source: &str) -> Vec<String> {
    let kinds = ["fn ", "struct ", "enum ", "trait ", "type ", "mod ", "const ", "static "];
    let lines = source.lines().map(str::trim_start).filter(|l| l.starts_with("pub"));
    let names = lines.filter_map(|l| {
        let rest = kinds.iter().filter_map(|k| l.split_once(k)).map(|x| x.1).min_by_key(|x| x.len())?;
        Some(rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default())
    });
    let is_retired = |name: &str| {
        // Words of snake_case and of CamelCase.
        let mut spaced = String::new();
        for c in name.chars() {
            if c.is_uppercase() {
                spaced.push('_');
            }
            spaced.extend(c.to_lowercase());
        }
        spaced.split('_').any(|w| RETIRED_NAMES.contains(&w))
    };
    names.filter(|n| is_retired(n)).map(String::from).collect()
}

#[test]
fn public_text_has_the_fields_words() {
    let mut pages = files("docs", "md");
    let more = ["README.md", "SKILL.md", "CONVENTIONS.md", "ARCHITECTURE.md", "python/README.md"];
    pages.extend(more.map(String::from));
    let mut wrong = Vec::new();
    for page in &pages {
        wrong.extend(retired(&text(page)).into_iter().map(|w| format!("{page}: {w}")));
    }
    // Keys and columns, which the reference pages show.
    for schema in files("schema", "json") {
        for line in text(&schema).lines().map(str::trim_start) {
            if line.starts_with("\"description\"") || line.starts_with("\"about\"") {
                wrong.extend(retired(line).into_iter().map(|w| format!("{schema}: {w}")));
            }
        }
    }
    let mut sources = files("src", "rs");
    sources.extend(files("crates", "rs"));
    for path in sources.iter().filter(|p| !p.contains("/tests/")) {
        wrong.extend(retired_names(&text(path)).into_iter().map(|n| format!("{path}: {n}")));
    }
    report(&wrong);
}

#[test]
fn retired_words_are_found() {
    assert_eq!(retired("The room holds what `told` says, ```pieces``` included."), Vec::<String>::new());
    assert_eq!(retired("Echoes that\nnobody heard."), ["'heard' in \"echoes that nobody heard \""]);
    assert_eq!(
        retired("A place of mirror reflection."),
        ["'place of mirror reflection' in \"a place of mirror reflection \""]
    );
    assert_eq!(retired("A pieced quilt stands in the trialled theatre."), Vec::<String>::new());
    assert_eq!(
        retired_names("    pub(super) fn unhidden_by(&self) {}\npub struct ToldApart;\nfn told() {}"),
        ["unhidden_by", "ToldApart"]
    );
}
