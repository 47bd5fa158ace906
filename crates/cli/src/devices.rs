//! `catseye devices`: adapters, limits, drivers, which one `auto` takes, and the cache of compiled kernels.

use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye::engine::devices::{listing, warm};
use clap::Args;

/// List adapters with driver and limits, the device that `auto` selects, and the result of each adapter's self-test
#[derive(Debug, Args)]
pub struct Devices {
    /// Compile all kernels for the adapter of --device and cache them on disk, so that later starts need no compilation
    #[arg(long)]
    pub warm: bool,
}

impl Devices {
    pub fn run(&self, global: &Global) -> Result<()> {
        if self.warm {
            return warmed(global);
        }
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
        print(&match listing.auto == listing.auto_frames {
            true => format!("auto takes: {}", listing.auto),
            false => format!("auto takes: {}; for frames of scenes: {}", listing.auto, listing.auto_frames),
        })
    }
}

fn warmed(global: &Global) -> Result<()> {
    let engine = global.engine()?;
    let found = warm(&engine)?.ok_or_else(|| {
        BadInput::new("the cpu engine has no kernels to compile")
            .key("--device")
            .value(&global.device)
            .allowed("a GPU, or part of an adapter's name")
            .remedy("`catseye devices` lists the adapters")
    })?;
    global.answer(&found, || {
        let place = match (&found.cache_file, &found.problem) {
            (Some(file), _) => format!("kept in {}", file.display()),
            (None, problem) => format!("not kept: {}", problem.as_deref().unwrap_or("unknown")),
        };
        format!("{}: {} kernels in {:.3} s, {place}", found.adapter.name, found.kernels, found.pipelines_s)
    })
}
