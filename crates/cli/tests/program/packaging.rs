//! What brings catseye to others: names of archives, and the shell steps of the GitHub action, run here.

use crate::common::root;
#[cfg(unix)]
use crate::common::{done, text};
use std::fs;
#[cfg(unix)]
use std::path::Path;
#[cfg(unix)]
use std::process::{Command, Output};

fn file(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The text after `start` to the end of its line.
fn after<'a>(text: &'a str, start: &str) -> &'a str {
    text.split(start).nth(1).unwrap_or_else(|| panic!("no {start}")).lines().next().unwrap()
}

/// A release's archives have the names that `cargo binstall` and the action ask for.
#[test]
fn archives_have_the_names_that_are_asked_for() {
    let (release, install, manifest) =
        (file(".github/workflows/release.yml"), file("packaging/install"), file("crates/cli/Cargo.toml"));
    let made = after(&release, "NAME: ")
        .replace("${{ github.ref_name }}", "v1.2.3")
        .replace("${{ matrix.target }}", "T");
    let expand = |text: &str| {
        let pairs =
            [("{ version }", "1.2.3"), ("{ target }", "T"), ("{ bin }", "catseye"), ("{ repo }", "R")];
        pairs.iter().fold(text.trim_matches('"').to_string(), |text, (from, to)| text.replace(from, to))
    };
    assert_eq!(made, "catseye-v1.2.3-T");
    let urls: Vec<String> =
        manifest.lines().filter_map(|l| l.strip_prefix("pkg-url = ")).map(expand).collect();
    let base = format!("R/releases/download/v1.2.3/{made}");
    assert_eq!(urls, [format!("{base}.tar.gz"), format!("{base}.zip")]);
    assert_eq!(expand(after(&manifest, "bin-dir = ")), format!("{made}/catseye{{ binary-ext }}"));
    assert!(install.contains("name=\"catseye-v$version-$target\""));
    let targets: Vec<&str> = release.split("target: ").skip(1).filter_map(|t| t.split(',').next()).collect();
    assert_eq!(targets.len(), 5);
    for target in targets {
        assert!(install.contains(&format!("target={target}")), "packaging/install does not know {target}");
    }
}

/// The citation, the action and the image are of this version, and of the scripts that are here.
#[test]
fn other_files_agree_with_the_workspace() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(after(&file("CITATION.cff"), "\nversion: ").trim_matches('"'), version);
    let action = file("action.yml");
    let scripts: Vec<&str> =
        action.split("$GITHUB_ACTION_PATH/").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(scripts, ["packaging/install", "packaging/golden", "packaging/comment"]);
    let docs = file("docs/guides/install.md");
    for input in action.split("inputs:\n").nth(1).unwrap().split("outputs:\n").next().unwrap().lines() {
        let Some(name) = input.strip_prefix("  ").filter(|n| !n.starts_with(' ')) else { continue };
        assert!(
            docs.contains(&format!("`{}`", name.trim_end_matches(':'))),
            "install.md does not tell {name}"
        );
    }
}

/// Runs a script of the action in `dir` with these variables.
#[cfg(unix)]
fn script(dir: &Path, name: &str, variables: &[(&str, &str)]) -> Output {
    let mut command = Command::new("bash");
    command.arg(root().join("packaging").join(name)).current_dir(dir);
    command.env("CATSEYE_PROGRAM", env!("CARGO_BIN_EXE_catseye"));
    command.envs(variables.iter().copied()).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_golden_cross_section_is_held() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let (plate, sweep) = ("plate:width_m=0.1,height_m=0.1", "--azimuth-deg -3:3:0.5");
    let golden = |golden: &str, more: &[(&str, &str)]| {
        let given = [
            ("CATSEYE_COMMAND", "rcs"),
            ("CATSEYE_SCENE", plate),
            ("CATSEYE_ARGUMENTS", sweep),
            ("CATSEYE_GOLDEN", golden),
            ("GITHUB_STEP_SUMMARY", "summary.md"),
            ("GITHUB_OUTPUT", "outputs.txt"),
        ];
        let _ = (fs::remove_dir_all(d.join("catseye-golden")), fs::remove_file(d.join("outputs.txt")));
        script(d, "golden", &[&given, more].concat())
    };
    let said = |name: &str| fs::read_to_string(d.join(name)).unwrap();
    // Without a golden result: how to make it, which is then done.
    let out = golden("golden.csv", &[]);
    let complaint = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{complaint}");
    assert!(complaint.contains("rcs plate:width_m=0.1,height_m=0.1 --azimuth-deg -3:3:0.5"), "{complaint}");
    done(d, &["rcs", plate, "--azimuth-deg", "-3:3:0.5", "-o", "golden.csv", "--device", "cpu"]);
    let out = golden("golden.csv", &[]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert!(said("summary.md").contains("Within the tolerance: 52 values"), "{}", said("summary.md"));
    assert!(said("outputs.txt").starts_with(
        "status=0\npassed=true\nreport=catseye-golden/report.md\npicture=catseye-golden/overlay.png\n"
    ));
    assert!(fs::read(d.join("catseye-golden/overlay.png")).unwrap().starts_with(b"\x89PNG"));
    // A target that has changed.
    let out = golden("golden.csv", &[("CATSEYE_SCENE", "plate:width_m=0.11,height_m=0.1")]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    let summary = said("summary.md");
    assert!(
        summary.contains("**Outside the tolerance**") && summary.contains("| vv\\_dbsm | 13 |"),
        "{summary}"
    );
    assert!(summary.contains("To accept the new result, run `catseye rcs plate:width_m=0.11"), "{summary}");
    assert!(said("outputs.txt").contains("status=1\npassed=false\n"));
    let out = golden(
        "golden.csv",
        &[("CATSEYE_SCENE", "plate:width_m=0.11,height_m=0.1"), ("CATSEYE_TOLERANCE_DB", "60")],
    );
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stdout));
    // A single direction makes no picture, and is compared all the same.
    done(d, &["rcs", plate, "-o", "one.csv", "--device", "cpu"]);
    let out = golden("one.csv", &[("CATSEYE_ARGUMENTS", "")]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert!(said("outputs.txt").contains("\npicture=\n"));
    // What the program refuses keeps its exit code.
    for (name, value, part) in [
        ("CATSEYE_COMMAND", "lane", "rcs, pipeline"),
        ("CATSEYE_SCENE", "no-such-thing", "no-such-thing"),
        ("CATSEYE_TOLERANCE_DB", "-1", "tolerance_db"),
        ("CATSEYE_ARGUMENTS", "--azimuth-deg *", "*"),
    ] {
        let out = golden("golden.csv", &[(name, value)]);
        let complaint = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{name}: {complaint}");
        assert!(complaint.contains(part), "{name}: {complaint}");
    }
}

#[cfg(unix)]
#[test]
fn golden_frames_are_held() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let scenario = |rcs: f64| {
        let text = format!(
            "name = 's'\nradar = 'demo77'\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = {rcs}\n\
             [output]\nplots = false\nadc = false\nreturns = false\n"
        );
        fs::write(d.join("s.toml"), text).unwrap();
    };
    scenario(10.0);
    done(d, &["simulate", "s.toml", "-o", "golden", "--device", "cpu", "--quiet"]);
    let run = |out: &str| {
        let given = [
            ("CATSEYE_COMMAND", "pipeline"),
            ("CATSEYE_SCENE", "s.toml"),
            ("CATSEYE_GOLDEN", "golden"),
            ("CATSEYE_OUT", out),
        ];
        script(d, "golden", &given)
    };
    let out = run("x");
    assert_eq!(out.status.code(), Some(0), "{}{}", text(&out.stdout), text(&out.stderr));
    assert!(d.join("x/overlay.png").is_file());
    scenario(12.0);
    let out = run("y");
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains("points.csv"), "{}", text(&out.stdout));
}

/// A release that is a folder here: the archive is unpacked and put on the path, unless its checksum is wrong.
#[cfg(unix)]
#[test]
fn the_action_takes_the_archive_of_the_release() {
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    let version = env!("CARGO_PKG_VERSION");
    let name = format!("catseye-v{version}-x86_64-unknown-linux-gnu");
    let release = d.join(format!("releases/v{version}"));
    fs::create_dir_all(release.join(&name)).unwrap();
    fs::copy(env!("CARGO_BIN_EXE_catseye"), release.join(&name).join("catseye")).unwrap();
    let archive = format!("{name}.tar.gz");
    let packed = Command::new("tar").current_dir(&release).args(["-czf", &archive, &name]).status().unwrap();
    assert!(packed.success());
    let sum = catseye::formats::stage::sha256_of_file(release.join(&archive)).unwrap();
    let sums = |sum: &str| fs::write(release.join("SHA256SUMS"), format!("{sum}  {archive}\n")).unwrap();
    let releases = format!("file://{}", d.join("releases").display());
    let path_file = d.join("path.txt");
    let install = |temporary: &str, releases: &str| {
        let given = [
            ("RUNNER_OS", "Linux"),
            ("RUNNER_ARCH", "X64"),
            ("RUNNER_TEMP", temporary),
            ("GITHUB_PATH", path_file.to_str().unwrap()),
            ("CATSEYE_RELEASES", releases),
        ];
        script(d, "install", &given)
    };
    sums(&sum);
    let out = install(d.join("temp").to_str().unwrap(), &releases);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains(&format!("catseye {version} from the release")));
    let path = fs::read_to_string(&path_file).unwrap();
    let program = Command::new(Path::new(path.trim()).join("catseye")).arg("--version").output().unwrap();
    assert!(text(&program.stdout).starts_with(&format!("catseye {version}")));
    sums(&sum.chars().rev().collect::<String>());
    let out = install(d.join("other").to_str().unwrap(), &releases);
    assert_eq!(out.status.code(), Some(1));
    assert!(text(&out.stderr).contains("checksum"), "{}", text(&out.stderr));
    assert!(!d.join("other/catseye-bin/catseye").exists());
}

/// The comment is made once and renewed after that; a token that may not write is no error.
#[cfg(unix)]
#[test]
fn the_action_comments_once() {
    use std::os::unix::fs::PermissionsExt;
    let t = tempfile::tempdir().unwrap();
    let d = t.path();
    fs::create_dir(d.join("bin")).unwrap();
    // It stands for GitHub's program: it writes down what it is asked, and answers the list of comments from a file.
    let gh = "#!/bin/sh\nprintf '%s\\n' \"$*\" >>calls.txt\n[ ! -e forbidden ] || exit 1\ncase \"$*\" in\n\
              *--paginate*) cat old.txt ;;\n*) cat \"${6#body=@}\" >body.md ;;\nesac\n";
    fs::write(d.join("bin/gh"), gh).unwrap();
    fs::set_permissions(d.join("bin/gh"), fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(d.join("report.md"), "### a report\n").unwrap();
    let path = format!("{}:{}", d.join("bin").display(), std::env::var("PATH").unwrap());
    let comment = || {
        let given = [
            ("PATH", path.as_str()),
            ("CATSEYE_REPOSITORY", "o/r"),
            ("CATSEYE_PULL_REQUEST", "7"),
            ("CATSEYE_GOLDEN", "g.csv"),
            ("CATSEYE_REPORT", "report.md"),
            ("CATSEYE_PICTURE_URL", "https://example.org/p"),
        ];
        let _ = fs::remove_file(d.join("calls.txt"));
        let out = script(d, "comment", &given);
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        (fs::read_to_string(d.join("calls.txt")).unwrap(), text(&out.stdout))
    };
    fs::write(d.join("old.txt"), "").unwrap();
    assert!(comment().0.contains("--method POST repos/o/r/issues/7/comments"));
    let body = fs::read_to_string(d.join("body.md")).unwrap();
    assert!(body.starts_with("<!-- catseye golden: g.csv -->\n### a report\n"), "{body}");
    assert!(body.contains("(https://example.org/p)"), "{body}");
    fs::write(d.join("old.txt"), "41\n42\n").unwrap();
    assert!(comment().0.contains("--method PATCH repos/o/r/issues/comments/41 "));
    fs::write(d.join("forbidden"), "").unwrap();
    assert!(comment().1.starts_with("::notice::"));
}

/// A machine without an adapter, such as an image whose driver is gone, does not pass the check of its shaders.
#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_nothing_is_validated() {
    let out = Command::new(env!("CARGO_BIN_EXE_catseye"))
        .args(["validate", "--device", "llvmpipe"])
        .envs([("VK_DRIVER_FILES", "/none"), ("VK_ICD_FILENAMES", "/none")])
        .output()
        .unwrap();
    let complaint = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{complaint}");
    assert!(complaint.contains("llvmpipe: the name of no adapter contains this text"), "{complaint}");
    assert!(out.stdout.is_empty(), "{}", text(&out.stdout));
}
