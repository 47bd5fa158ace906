//! The engines that a bench runs on.

use catseye::engine::{Engine, Precision};
use catseye::gpu::adapters;

/// Short name and engine of each device.
///
/// # Panics
/// If the one that `CATSEYE_BENCH_DEVICE` names cannot be opened.
pub fn engines() -> Vec<(String, Engine)> {
    let names = match std::env::var("CATSEYE_BENCH_DEVICE") {
        Ok(name) => vec![name],
        Err(_) => {
            let software = adapters().into_iter().any(|a| a.name.contains("llvmpipe"));
            std::iter::once("cpu").chain(software.then_some("llvmpipe")).map(String::from).collect()
        }
    };
    let open = |name: String| match Engine::open(&name, Precision::F32) {
        Ok(engine) => (name, engine),
        Err(e) => panic!("CATSEYE_BENCH_DEVICE={name}: {e}"),
    };
    names.into_iter().map(open).collect()
}
