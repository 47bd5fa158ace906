//! The standard workloads: timed on any engine, counted, and checked against a better computation.
//!
//! W1, W2: cross sections. W3: one frame of a road, at rest and moving. W4: processing of one cube,
//! W4s: of one that is larger than buffers are. W5: many frames in a row. W6: closest hits on a million triangles.

pub mod cross_section;
pub mod frame;
pub mod processing;
pub mod ray_cast;
pub mod sequence;
mod sheet;
pub mod stream;

use catseye::engine::Engine;
use catseye::error::{BadInput, Result};
use sheet::Sheet;
pub use sheet::{LONG_S, Outcome, RUNS, Settings, Stage, WORKLOADS};

/// Runs the workloads of these names, all when there are none, in the order of [`WORKLOADS`].
///
/// # Errors
/// An unknown name; whatever a stage reports.
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
            let sheet = Sheet::new(name, engine, say);
            match name {
                "W1" => cross_section::w1(engine, settings, sheet),
                "W2" => cross_section::w2(engine, settings, sheet),
                "W3-static" => frame::w3(false, engine, settings, sheet),
                "W3-moving" => frame::w3(true, engine, settings, sheet),
                "W4" => processing::w4(engine, settings, sheet),
                "W4s" => stream::w4s(engine, settings, sheet),
                "W5" => sequence::w5(engine, settings, sheet),
                _ => ray_cast::w6(engine, settings, sheet),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::sheet::{median, relative_l2};
    use super::*;

    #[test]
    fn unknown_names_are_refused() {
        let settings = Settings { quick: true, seed: 1 };
        let engine = Engine::Cpu(catseye::engine::Precision::F32);
        let e = run(&engine, &["W9".into()], &settings, &|_| {}).unwrap_err().to_string();
        assert!(e.contains("W9") && e.contains("W3-static"), "{e}");
    }

    #[test]
    fn distances() {
        assert_eq!(relative_l2([3.0, 4.0], [3.0, 4.0]), 0.0);
        assert_eq!(relative_l2([0.0, 0.0], [3.0, 4.0]), 1.0);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert!(median(&mut []).is_nan());
    }
}
