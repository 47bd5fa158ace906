//! `catseye completions` and `catseye man`: what shells and the system's manual take.

use crate::common::{catseye, done, refused, text};
use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

/// Names of the commands, from the program's own help.
fn commands() -> Vec<String> {
    let help = text(&catseye(&std::env::temp_dir(), &["--help"]).stdout);
    let list = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    let names: Vec<String> = list
        .lines()
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "))
        .map(|l| l.split_whitespace().next().unwrap().to_string())
        .collect();
    assert!(names.len() > 20, "{names:?}");
    names
}

/// What bash offers behind these words.
#[cfg(unix)]
fn completed(script: &str, words: &[&str]) -> Vec<String> {
    let list: Vec<String> = words.iter().map(|w| format!("'{w}'")).collect();
    let (at, last) = (words.len() - 1, words[words.len() - 1]);
    let driver = format!(
        "{script}\nCOMP_WORDS=({})\nCOMP_CWORD={at}\n_catseye catseye '{last}' '{}'\nprintf '%s\\n' \"${{COMPREPLY[@]}}\"\n",
        list.join(" "),
        words[at - 1],
    );
    let out = Command::new("bash").args(["--norc", "-c", &driver]).output().unwrap();
    assert!(out.status.success(), "{}", text(&out.stderr));
    text(&out.stdout).lines().map(str::to_string).collect()
}

#[cfg(unix)]
#[test]
fn bash_completes_commands_and_options() {
    let t = tempfile::tempdir().unwrap();
    let script = done(t.path(), &["completions", "bash"]);
    let file = t.path().join("catseye.bash");
    fs::write(&file, &script).unwrap();
    let checked = Command::new("bash").arg("-n").arg(&file).output().unwrap();
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    assert_eq!(completed(&script, &["catseye", "sim"]), ["simulate"]);
    assert_eq!(completed(&script, &["catseye", "diff", "--toler"]).len(), 4);
    assert_eq!(completed(&script, &["catseye", "rcs", "--precision", "f"]), ["f32", "f64"]);
    assert_eq!(completed(&script, &["catseye", "no-such"]), [""; 1]);
    let offered: BTreeSet<String> = completed(&script, &["catseye", ""]).into_iter().collect();
    for name in commands() {
        assert!(offered.contains(&name), "{name} is not offered: {offered:?}");
    }
}

#[test]
fn every_shell_has_a_script() {
    let t = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = done(t.path(), &["completions", shell]);
        for name in commands() {
            assert!(script.contains(&name), "{shell} lacks {name}");
        }
    }
    refused(t.path(), &["completions", "tcsh"], &["'tcsh'", "bash, elvish, fish, powershell, zsh"]);
    refused(t.path(), &["completions"], &["bash|zsh|fish|elvish|powershell"]);
}

#[test]
fn every_command_has_a_page() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::create_dir(d.join("man1")).unwrap();
    fs::write(d.join("man1/other.1"), "kept").unwrap();
    assert!(done(d, &["man", "--out", "man1"]).contains(" pages into man1"));
    let page = |name: &str| fs::read_to_string(d.join("man1").join(name)).unwrap();
    assert_eq!(page("other.1"), "kept");
    for name in commands() {
        let page = page(&format!("catseye-{name}.1"));
        for part in [".TH catseye-", ".SH NAME", ".SH SYNOPSIS", ".SH DESCRIPTION", ".SH OPTIONS"] {
            assert!(page.contains(part), "the page of {name} lacks {part}");
        }
    }
    // Commands below a command have a page, too; an option of all commands stands where it acts and only there.
    assert!(page("catseye-learn-train.1").contains("catseye learn train"));
    assert!(
        page("catseye-rcs.1").contains("\\-\\-device") && !page("catseye-diff.1").contains("\\-\\-device")
    );
    assert_eq!(done(d, &["man"]), page("catseye.1"));
    assert_eq!(done(d, &["man", "learn", "train"]), page("catseye-learn-train.1"));
    // Where there is a typesetter it has no complaint.
    if Command::new("groff").arg("--version").output().is_ok() {
        for entry in fs::read_dir(d.join("man1")).unwrap().map(|e| e.unwrap().path()) {
            let set = Command::new("groff").args(["-ww", "-Tutf8", "-man"]).arg(&entry).output().unwrap();
            let said = text(&set.stderr);
            assert!(set.status.success() && said.is_empty(), "{}: {said}", entry.display());
        }
    }
    refused(d, &["man", "-o", "man1"], &["catseye.1", "exists", "--force"]);
    done(d, &["man", "-o", "man1", "--force"]);
    refused(d, &["man", "simulat"], &["'simulat'", "did you mean 'simulate'?"]);
    refused(d, &["man", "plot", "x"], &["'x'", "nothing after 'plot'"]);
}
