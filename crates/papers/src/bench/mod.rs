//! The standard workloads: timed on any engine, counted, and compared with a more accurate computation.
//!
//! W1, W2: cross sections. W3: one frame of a road, at rest and moving. W4: processing of one cube; W4s: of
//! one that is larger than buffers are. W5: a sequence of frames. W6: closest hits on a million triangles.
//! W7, W8, W9, W12, W13: one frame of a road with bends, of a terrain, of a street with cars, with 192
//! virtual channels, and of a recipe for a small radar. W8-curve: time of W8's frame over its number of
//! triangles. W10, W11, W14: datasets of small frames, of curved cars
//! and of points.

mod agreement;
pub mod cross_section;
mod curve;
mod dataset;
pub mod frame;
pub mod processing;
pub mod ray_cast;
mod scenario;
mod scratch;
pub mod sequence;
mod sheet;
mod stages;
pub mod stream;

pub use agreement::{cells, noise_w};
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::Engine;
use catseye::engine::devices::{self, Starts};
use catseye::road::terrain::W8_QUADS;
use frame::Frame;
use sheet::Sheet;
pub use sheet::{LONG_S, Outcome, RUNS, Settings, Stage, WORKLOADS, relative_l2};

/// Runs the workloads of these names, all if there are no names, in the order of [`WORKLOADS`].
///
/// # Errors
/// Returns an error for an unknown name, and the errors of the stages.
pub fn run(
    engine: &Engine,
    only: &[String],
    settings: &Settings,
    say: &dyn Fn(&str),
) -> Result<Vec<Outcome>> {
    let names = WORKLOADS.map(|w| w.0);
    if let Some(bad) = only.iter().find(|n| !names.iter().any(|w| w.eq_ignore_ascii_case(n))) {
        let bad = BadInput::new("unknown workload").key("--only").value(format!("'{bad}'"));
        return Err(bad.allowed(names.join(", ")).into());
    }
    names
        .into_iter()
        .filter(|w| only.is_empty() || only.iter().any(|n| w.eq_ignore_ascii_case(n)))
        .map(|name| {
            let work = workload(name)
                .ok_or_else(|| Error::Failed(format!("the workload {name} is listed but not defined")))?;
            work(engine, settings, Sheet::new(name, engine, say))
        })
        .collect()
}

/// The frame of one of W3, W7, W8, W9, W12 and W13.
///
/// # Errors
/// Returns an error for a workload that is not one frame, and the errors of its scene and radar.
pub fn frame_of(workload: &str) -> Result<Frame> {
    match workload {
        "W3-static" => Frame::w3(false),
        "W3-moving" => Frame::w3(true),
        "W7" => scenario::everything(),
        "W8" => scenario::terrain(W8_QUADS),
        "W9" => scenario::street(),
        "W12" => scenario::imaging_frame(false),
        "W13" => scenario::awr1843(),
        _ => Err(Error::Failed(format!("the workload {workload} is not one frame"))),
    }
}

/// Times of a start of the engine's device without and with cached pipelines; None for the cpu engine.
///
/// # Errors
/// Returns an error if the device cannot be opened again, or if the temporary folder cannot be written.
pub fn starts(engine: &Engine, say: &dyn Fn(&str)) -> Result<Option<Starts>> {
    if let Engine::Cpu(_) = engine {
        return Ok(None);
    }
    say("start: the device with an empty cache, then with a filled one");
    let scratch = scratch::Scratch::with("start", &[])?;
    devices::starts(engine, scratch.path())
}

type Work = fn(&Engine, &Settings, Sheet<'_>) -> Result<Outcome>;

/// The function that runs the workload of a name.
fn workload(name: &str) -> Option<Work> {
    Some(match name {
        "W1" => cross_section::w1,
        "W2" => cross_section::w2,
        "W3-static" => |engine, settings, sheet| stages::w3(false, engine, settings, sheet),
        "W3-moving" => |engine, settings, sheet| stages::w3(true, engine, settings, sheet),
        "W4" => processing::w4,
        "W4s" => stream::w4s,
        "W5" => sequence::w5,
        "W6" => ray_cast::w6,
        "W7" => scenario::w7,
        "W8" => scenario::w8,
        "W8-curve" => curve::w8_curve,
        "W9" => scenario::w9,
        "W10" => dataset::w10,
        "W11" => dataset::w11,
        "W12" => scenario::w12,
        "W13" => scenario::w13,
        "W14" => dataset::w14,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::sheet::{median, relative_l2};
    use super::*;

    #[test]
    fn unknown_names_are_refused() {
        let settings = Settings { quick: true, seed: 1 };
        let engine = Engine::Cpu(catseye::engine::Precision::F32);
        let e = run(&engine, &["W99".into()], &settings, &|_| {}).unwrap_err().to_string();
        assert!(e.contains("W99") && e.contains("W3-static"), "{e}");
    }

    #[test]
    fn every_workload_of_the_list_is_there_once() {
        for (i, (name, title)) in WORKLOADS.iter().enumerate() {
            assert!(workload(name).is_some(), "{name}");
            if matches!(*name, "W3-static" | "W3-moving" | "W7" | "W9" | "W13") {
                assert!(frame_of(name).is_ok(), "{name}");
            }
            assert!(!title.is_empty() && WORKLOADS[..i].iter().all(|w| w.0 != *name), "{name}");
        }
        assert!(workload("W99").is_none() && frame_of("W99").is_err());
    }

    #[test]
    fn distances() {
        assert_eq!(relative_l2([3.0, 4.0], [3.0, 4.0]), 0.0);
        assert_eq!(relative_l2([0.0, 0.0], [3.0, 4.0]), 1.0);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert!(median(&mut []).is_nan());
    }
}
