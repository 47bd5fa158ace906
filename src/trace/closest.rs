//! The nearest triangle along given rays, on the gpu engine.

use crate::base::error::Result;
use crate::gpu::{Access, Buffer, Gpu, Kernel, Recorder, Threads, Tolerance, gpu_struct};

gpu_struct! {
    /// Uniform of `shaders/trace/closest.wgsl`.
    pub struct ClosestHitParams {
        pub count: u32,
        pub any: u32,
    }
}

gpu_struct! {
    /// A ray and the part of it that counts, in units of the length of `dir`, which is that of a unit
    /// vector within some orders of magnitude.
    pub struct Ray {
        pub origin: [f32; 3],
        pub t_min: f32,
        pub dir: [f32; 3],
        pub t_max: f32,
    }
}

gpu_struct! {
    /// Where a ray ends: at v0 + u (v1 - v0) + v (v2 - v0) of a triangle.
    pub struct Hit {
        /// Distance in units of the direction's length; the ray's `t_max` for a miss.
        pub t: f32,
        pub u: f32,
        pub v: f32,
        /// Triangle in the order of the tree's leaves; [`NO_TRIANGLE`] for a miss.
        pub triangle: u32,
    }
}

/// What a ray gives that meets nothing.
pub const NO_TRIANGLE: u32 = u32::MAX;
/// Number of the patch of a ray that starts on none.
pub const NO_PATCH: u32 = u32::MAX;

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "trace/closest",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/bvh.wgsl"),
        include_str!("../../shaders/trace/closest.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(ClosestHitParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::Read, Access::ReadWrite],
    structs: &[Ray::LAYOUT, Hit::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-5,
        reason: "of t, where both engines choose the same triangle: f32 plane distance, cancelling at grazing \
                 incidence; the others pass within rounding of an edge",
    },
};

/// What the rays are to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Find {
    /// The nearest triangle.
    Closest,
    /// Any triangle: which one is not specified.
    Any,
}

/// The tree and its triangles on the device, as `shaders/shared/bvh.wgsl` reads them.
#[derive(Clone)]
pub struct Tree {
    /// Nodes of the tree, five words each.
    pub nodes: Buffer<[u32; 4]>,
    /// Triangles, three words each.
    pub triangles: Buffer<[f32; 4]>,
}

/// Records one pass over `rays`; `skip_patches` and `hits` have their length. The tree is at most 24 levels deep.
pub fn record(
    recorder: &mut Recorder<'_>,
    tree: &Tree,
    find: Find,
    rays: &Buffer<Ray>,
    skip_patches: &Buffer<u32>,
    hits: &Buffer<Hit>,
) {
    let params = ClosestHitParams { count: rays.len() as u32, any: u32::from(find == Find::Any) };
    let threads = Threads::Linear(rays.len() as u64);
    recorder.dispatch(&KERNEL, &params, &[&tree.nodes, &tree.triangles, rays, skip_patches, hits], threads);
}

/// The hits of all rays, and the seconds that the device took. `skip_patches` holds for each ray the patch
/// that it leaves, or [`NO_PATCH`].
///
/// # Panics
/// If the two differ in length.
///
/// # Errors
/// Returns an error if the adapter fails.
pub fn hits(
    gpu: &Gpu,
    tree: &Tree,
    find: Find,
    rays: &[Ray],
    skip_patches: &[u32],
) -> Result<(Vec<Hit>, f64)> {
    assert_eq!(rays.len(), skip_patches.len());
    let at_once = (gpu.max_binding_bytes() as usize / size_of::<Ray>()).max(1);
    let (mut found, mut seconds) = (Vec::with_capacity(rays.len()), 0.0);
    for (rays, skips) in rays.chunks(at_once).zip(skip_patches.chunks(at_once)) {
        // The rays first, so that the time is that of the kernel and not of the way to the device.
        let mut upload = gpu.recorder("rays");
        let ray_buffer = upload.upload("rays", rays);
        let skip_buffer = upload.upload("skip patches", skips);
        upload.submit()?;
        let mut recorder = gpu.recorder("closest hits");
        let hit_buffer = recorder.buffer::<Hit>("hits", rays.len());
        record(&mut recorder, tree, find, &ray_buffer, &skip_buffer, &hit_buffer);
        let pending = recorder.read(&hit_buffer);
        let mut done = recorder.submit()?;
        seconds += done.seconds();
        found.append(&mut done.take(pending));
    }
    Ok((found, seconds))
}
