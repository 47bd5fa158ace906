//! What README.md shows is what the repository holds.

use std::fs;
use std::path::Path;

fn text(path: &str) -> String {
    fs::read_to_string(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path))
        .unwrap_or_else(|e| panic!("{path}: {e}"))
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

#[test]
fn linked_files_exist() {
    let mut links = 0;
    for file in ["README.md", "ARCHITECTURE.md"] {
        let page = text(file);
        let targets = page
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split_once(')'))
            .chain(page.split("src=\"").skip(1).filter_map(|rest| rest.split_once('"')));
        for (target, _) in targets.filter(|(t, _)| !t.starts_with("http") && !t.starts_with('#')) {
            assert!(
                Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(target).exists(),
                "{file} links to {target}"
            );
            links += 1;
        }
    }
    assert!(links > 5, "only {links} links found");
}
