//! wgpu: the only room that touches it, and (with `cpu/simd.rs`) the only one that may use `unsafe`.
