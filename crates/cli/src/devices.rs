//! `catseye devices`: adapters, limits, drivers, and which one `auto` takes.

use super::global::{Global, print, print_json};
use catseye::base::error::Result;
use catseye::engine::devices::listing;
use clap::Args;

/// List adapters with driver and limits, what `auto` takes, and whether each passes the self-test
#[derive(Debug, Args)]
pub struct Devices {}

impl Devices {
    pub fn run(&self, global: &Global) -> Result<()> {
        let listing = listing();
        if global.json {
            return print_json(&listing);
        }
        print(&format!("cpu: {} threads, f64", listing.cpu_threads))?;
        for r in &listing.adapters {
            let a = &r.adapter;
            print(&format!(
                "{}: {} {}, driver {} {}",
                a.name, a.backend, a.device_type, a.driver, a.driver_info
            ))?;
            print(&format!(
                "    storage binding {} MiB, buffer {} MiB, workgroup {}, shared memory {} KiB, f64 {}, timestamps {}",
                a.max_storage_binding_bytes >> 20,
                a.max_buffer_bytes >> 20,
                a.max_workgroup_size,
                a.shared_bytes >> 10,
                if a.shader_f64 { "yes" } else { "no" },
                if a.timestamp { "yes" } else { "no" },
            ))?;
            print(&format!("    exact-phase self-test: {}", r.self_test))?;
        }
        if listing.adapters.is_empty() {
            print("no Vulkan, Metal or DirectX adapter was found")?;
        }
        print(&format!("auto takes: {}", listing.auto))
    }
}
