//! Networks: without their feature one line says how to get it.

use super::common::refused;

#[cfg(not(feature = "learn"))]
#[test]
fn networks_are_compiled_in_on_request() {
    let dir = tempfile::tempdir().unwrap();
    for args in [&["learn", "train", "t.toml", "-o", "net"][..], &["learn", "eval", "net", "run"]] {
        refused(dir.path(), args, &["built without networks", "--features learn"]);
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[cfg(feature = "learn")]
#[test]
fn wrong_input_is_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    refused(dir.path(), &["learn", "train", "t.toml", "-o", "net"], &["t.toml", "no such file"]);
    refused(dir.path(), &["learn", "eval", "net", "run"], &["net", "holds no trained network"]);
    refused(dir.path(), &["learn", "predict", "net", "run", "-o", "x.txt"], &["x.txt"]);
    refused(dir.path(), &["learn", "eval", "net", "run", "--device", "abacus"], &["allowed: auto, cpu, gpu"]);
}
