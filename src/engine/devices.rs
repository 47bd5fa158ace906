//! The adapters of this machine, and which one `auto` takes.

use crate::gpu::{AdapterReport, Gpu, Want, adapters};

/// An adapter and what it says to the self-test.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Device {
    /// The adapter.
    #[serde(flatten)]
    pub adapter: AdapterReport,
    /// "passed", or what is wrong.
    pub self_test: String,
}

/// All devices of this machine.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Listing {
    /// "gpu" or "cpu".
    pub auto: String,
    /// Threads that the cpu engine would use.
    pub cpu_threads: usize,
    /// Adapters in the order in which `auto` prefers them.
    pub adapters: Vec<Device>,
}

/// Opens every adapter once.
pub fn listing() -> Listing {
    let found = adapters();
    let auto = if found.iter().any(|a| a.is_hardware) { "gpu" } else { "cpu" };
    let adapters = found
        .into_iter()
        .map(|adapter| Device {
            self_test: match Gpu::open(Want::Named(&adapter.name)) {
                Ok(_) => "passed".into(),
                Err(e) => e.to_string(),
            },
            adapter,
        })
        .collect();
    Listing { auto: auto.into(), cpu_threads: rayon::current_num_threads(), adapters }
}
