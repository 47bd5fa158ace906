//! Networks: without their feature one line says how to get it.

use super::common::refused;

#[cfg(not(feature = "learn"))]
#[test]
fn networks_are_compiled_in_on_request() {
    let dir = tempfile::tempdir().unwrap();
    for args in [&["learn", "train", "t.toml", "-o", "net"][..], &["learn", "eval", "net", "run"]] {
        refused(dir.path(), args, &["built without networks", "--features learn"]);
    }
    // The table is known in every build; the method is not.
    let text = "name = \"bare\"\nradar = \"demo77\"\n[[point]]\nposition_m = [20, 3, 0.5]\nrcs_dbsm = 10\n\
                [ego]\nspeed_mps = 10\n[lane.segmentation]\nscans = 3\n";
    let args = ["lane", "segmentation", "s.toml", "-o", "out"];
    refused(dir.path(), &args, &["segmentation", "built without networks", "--features learn"]);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    std::fs::write(dir.path().join("s.toml"), text.replace("= 3", "= 0")).unwrap();
    refused(dir.path(), &["lane", "compare", "s.toml", "-o", "out"], &["lane.segmentation.scans = 0"]);
}

#[cfg(feature = "learn")]
#[test]
fn wrong_input_is_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    refused(dir.path(), &["learn", "train", "t.toml", "-o", "net"], &["t.toml", "no such file"]);
    refused(
        dir.path(),
        &["learn", "eval", "net", "run"],
        &["net", "does not contain a trained network", "shipped network: road"],
    );
    // The name of a shipped network stands for its folder; what is wrong is then the run.
    refused(dir.path(), &["learn", "eval", "road", "no_run"], &["no_run"]);
    // A folder of this name goes first.
    std::fs::create_dir(dir.path().join("road")).unwrap();
    refused(
        dir.path(),
        &["learn", "eval", "road", "no_run"],
        &["road", "does not contain a trained network"],
    );
    refused(dir.path(), &["learn", "predict", "net", "run", "-o", "x.txt"], &["x.txt"]);
    refused(dir.path(), &["learn", "eval", "net", "run", "--device", "abacus"], &["allowed: auto, cpu, gpu"]);
}
