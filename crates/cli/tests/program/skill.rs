//! `SKILL.md`: what assistants read before they use the program. Each of its commands runs here, and prints what it says.

use crate::common::{root, text};
use std::fs;
use std::process::Command;

fn skill() -> String {
    fs::read_to_string(root().join("SKILL.md")).unwrap()
}

/// Commands of a page's blocks, in their order, each with the words behind `# prints`.
fn commands(page: &str) -> Vec<(String, Vec<String>)> {
    let blocks = page.split("```sh\n").skip(1).map(|b| b.split("```").next().unwrap());
    let line = |l: &str| {
        let (command, prints) = l.split_once("# prints ").unwrap_or((l, ""));
        (command.trim().to_string(), prints.split_whitespace().map(String::from).collect())
    };
    blocks.flat_map(str::lines).filter(|l| !l.trim().is_empty()).map(line).collect()
}

#[test]
fn the_front_matter_is_that_of_a_skill() {
    let page = skill();
    let front = page.strip_prefix("---\n").unwrap().split_once("\n---\n").unwrap().0;
    let value = |key: &str| {
        let line = front.lines().find_map(|l| l.strip_prefix(&format!("{key}: ")));
        line.unwrap_or_else(|| panic!("no {key}")).to_string()
    };
    assert_eq!(front.lines().count(), 2, "name and description, each on one line");
    let name = value("name");
    assert!(name.len() <= 64 && name.bytes().all(|b| b.is_ascii_lowercase() || b == b'-'), "{name}");
    let description = value("description");
    assert!((100..=1024).contains(&description.len()) && !description.contains(": "), "{description}");
    assert!(page.lines().count() < 150, "{} lines", page.lines().count());
}

#[cfg(unix)]
#[test]
fn every_command_runs_and_prints_what_the_page_says() {
    let t = tempfile::tempdir().unwrap();
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_catseye"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let commands = commands(&skill());
    assert!(commands.len() >= 15, "{}", commands.len());
    for (command, prints) in &commands {
        assert!(command.starts_with("catseye "), "{command}");
        let line = format!("{command} --device cpu");
        let out =
            Command::new("sh").args(["-c", &line]).env("PATH", &path).current_dir(t.path()).output().unwrap();
        assert!(out.status.success(), "{command}: {}", text(&out.stderr));
        for word in prints {
            assert!(
                text(&out.stdout).contains(word.as_str()),
                "{command} does not print {word}: {}",
                text(&out.stdout)
            );
        }
    }
    for file in
        ["plate.csv", "plate.png", "run/manifest.json", "demo-run/frame_000000/points.csv", "run.html"]
    {
        assert!(t.path().join(file).is_file(), "{file}");
    }
}

#[test]
fn commands_are_found() {
    let found = commands(
        "```sh\ncatseye a b   # prints 1.5 dB\n\ncatseye c\n```\ntext `catseye d`\n```text\ncatseye e\n```\n",
    );
    assert_eq!(
        found,
        [("catseye a b".into(), vec!["1.5".into(), "dB".into()]), ("catseye c".into(), Vec::<String>::new())]
    );
}
