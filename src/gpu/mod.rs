//! wgpu: the only room that touches it. A stage writes its commands into a [`Recorder`], whose
//! `submit` runs them.

/// llvmpipe ends every loop of a thread, silently, once the iterations of all its loops together reach this
/// number (Mesa's gallivm, seen with 22.3.6): a kernel has to stay below it.
pub const LOOP_LIMIT: usize = 65_535;

mod arena;
mod cache;
pub mod compare;
pub mod context;
pub mod kernel;
pub mod layout;
pub mod numbers;
pub mod profile;
pub mod recorder;
pub mod selftest;
mod spirv;
mod validation;
mod wgsl;

pub use crate::gpu_struct;
pub use arena::GpuCounts;
pub use cache::{CACHE_VARIABLE, cache_folder};
pub use context::{AdapterReport, Gpu, Want, adapters, quieten_loader};
pub use kernel::{Access, Kernel, StructLayout, Tolerance};
pub use profile::{KernelUse, Profile};
pub use recorder::{AnyBuffer, Buffer, Done, Pending, Recorder, Threads};
#[cfg(test)]
pub(crate) use wgsl::shader_constant;
