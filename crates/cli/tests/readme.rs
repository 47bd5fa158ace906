//! What README.md shows is what the repository holds, and links of the documents lead somewhere.

use std::fs;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The library example of the README compiles, because it is the one that `cargo test` builds.
#[test]
fn library_use_is_the_quickstart() {
    let example = text("examples/quickstart.rs");
    let (head, body) = example.split_once("fn main() -> catseye::Result<()> {\n").unwrap();
    let uses: Vec<&str> = head.lines().filter(|l| l.starts_with("use ")).collect();
    let body = body.split_once("    Ok(())").unwrap().0;
    let body: Vec<&str> = body.lines().map(|l| l.strip_prefix("    ").unwrap_or(l)).collect();
    let shown = format!("```rust\n{}\n\n{}\n```", uses.join("\n"), body.join("\n"));
    assert!(text("README.md").contains(&shown), "README.md does not show\n{shown}");
}

/// Markdown files below `folder`, as paths from the repository's root.
fn pages_of(folder: &str) -> Vec<String> {
    let mut pages = Vec::new();
    for entry in fs::read_dir(root().join(folder)).unwrap() {
        let path = format!("{folder}/{}", entry.unwrap().file_name().to_str().unwrap());
        if root().join(&path).is_dir() {
            pages.extend(pages_of(&path));
        } else if path.ends_with(".md") {
            pages.push(path);
        }
    }
    pages.sort();
    pages
}

/// The text without its blocks of code.
fn prose(page: &str) -> String {
    page.split("```").step_by(2).collect()
}

/// What a page links to and shows: targets in round brackets and sources of pictures, those of the web left out.
fn links(page: &str) -> Vec<String> {
    let page = prose(page);
    let round = page.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let sources = page.split("src=\"").skip(1).filter_map(|rest| rest.split_once('"'));
    let targets = round.chain(sources).map(|(target, _)| target.to_string());
    targets.filter(|t| !t.starts_with("http")).collect()
}

/// Names of a page's headings as links give them.
fn anchors(page: &str) -> Vec<String> {
    let headings = prose(page);
    let headings = headings.lines().filter(|l| l.starts_with('#')).map(|l| l.trim_matches('#').trim());
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    headings.map(|h| h.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")).collect()
}

/// Links of a page that lead nowhere.
fn broken(path: &str, page: &str) -> Vec<String> {
    let folder = Path::new(path).parent().unwrap();
    let leads = |target: &String| {
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let linked = if file.is_empty() { path.into() } else { folder.join(file) };
        root().join(&linked).exists()
            && (anchor.is_empty() || anchors(&text(linked.to_str().unwrap())).iter().any(|a| a == anchor))
    };
    links(page).into_iter().filter(|t| !leads(t)).map(|t| format!("{path} links to {t}")).collect()
}

#[test]
fn links_lead_somewhere() {
    let mut pages = pages_of("docs");
    pages.extend(["README.md", "SKILL.md", "python/README.md"].map(String::from));
    let wrong: Vec<String> = pages.iter().flat_map(|p| broken(p, &text(p))).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let count: usize = pages.iter().map(|p| links(&text(p)).len()).sum();
    assert!(count > 100, "only {count} links found");
    let bad = "[a](reference/radar.md) [b](nowhere.md) [c](datasets.md#nothing) ```[d](e.md)```";
    assert_eq!(broken("docs/x.md", bad).len(), 2);
}

/// The book has every page once; what is included from elsewhere exists and has no links, which would hold in one place only.
#[test]
fn pages_are_in_the_book() {
    let summary = links(&text("docs/SUMMARY.md"));
    for page in pages_of("docs").iter().filter(|p| *p != "docs/SUMMARY.md") {
        let name = page.strip_prefix("docs/").unwrap();
        assert_eq!(summary.iter().filter(|l| *l == name).count(), 1, "{page} in docs/SUMMARY.md");
        for include in text(page).split("{{#include ").skip(1) {
            let file = include.split(['}', ':']).next().unwrap();
            let path = Path::new(page).parent().unwrap().join(file);
            let included = text(path.to_str().unwrap());
            assert_eq!(links(&included), Vec::<String>::new(), "{file} is included by {page}");
        }
    }
}

/// A radar engineer reads the README in four minutes.
#[test]
fn readme_is_short() {
    let words = text("README.md").split_whitespace().count();
    assert!(words <= 1300, "README.md has {words} words");
}
