//! The chain of facets that each tube of a fan meets, on the gpu engine.

use super::{Convention, TraceOptions};
use crate::geom::upload::{GeometryArrays, split3};
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use crate::trace::launch::{Cell, Fan};
use glam::{DMat3, DVec3};

gpu_struct! {
    /// Uniform of `shaders/trace/rays.wgsl`.
    pub struct Params {
        pub origin_hi: [f32; 3],
        pub t_min: f32,
        pub origin_lo: [f32; 3],
        pub bounces: u32,
        pub axis0: [f32; 3],
        pub last_only: u32,
        pub axis1: [f32; 3],
        pub tubes: u32,
        pub axis2: [f32; 3],
        pub zero: u32,
    }
}

pub static KERNEL: Kernel = Kernel {
    stem: "trace/rays",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/df64.wgsl"),
        include_str!("../../shaders/shared/bvh.wgsl"),
        include_str!("../../shaders/shared/facet.wgsl"),
        include_str!("../../shaders/trace/rays.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(Params::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 0.0,
        reason: "same facets as in f64 but for axes that run within rounding of an edge; counted, not measured",
    },
};

/// The geometry on the device.
pub struct GeometryBuffers {
    pub nodes: Buffer<[u32; 4]>,
    pub triangles: Buffer<[f32; 4]>,
    pub planes: Buffer<[f32; 4]>,
    pub surfaces: Buffer<[f32; 4]>,
    pub body_velocities: Buffer<[f32; 4]>,
}

impl GeometryBuffers {
    pub fn upload(recorder: &mut Recorder<'_>, arrays: &GeometryArrays) -> Self {
        GeometryBuffers {
            nodes: recorder.upload("bvh nodes", &arrays.nodes),
            triangles: recorder.upload("triangles", &arrays.triangles),
            planes: recorder.upload("planes", &arrays.planes),
            surfaces: recorder.upload("surfaces", &arrays.surfaces),
            body_velocities: recorder.upload("body velocities", &arrays.body_velocities),
        }
    }
}

/// Directions of the tubes as the shaders read them: (direction hi, width in azimuth), (direction lo,
/// width in sine of elevation), two words a tube, in the world.
pub fn cell_words(fan: &Fan, cells: &[Cell]) -> Vec<[f32; 4]> {
    use rayon::prelude::*;
    cells
        .par_iter()
        .flat_map_iter(|c| {
            let [hi, lo] = split3(fan.rotation * c.axis_and_edges().0);
            [[hi[0], hi[1], hi[2], c.d_azimuth as f32], [lo[0], lo[1], lo[2], c.d_sin as f32]]
        })
        .collect()
}

/// Columns of a rotation in f32.
pub fn columns(rotation: glam::DQuat) -> [[f32; 3]; 3] {
    let m = DMat3::from_quat(rotation);
    [m.x_axis, m.y_axis, m.z_axis].map(|c: DVec3| c.as_vec3().to_array())
}

/// `chains` has `bounces + 2` words a tube, `counts` one.
#[allow(clippy::too_many_arguments)] // the stage's buffers
pub fn record(
    recorder: &mut Recorder<'_>,
    geometry: &GeometryBuffers,
    fan: &Fan,
    tubes: usize,
    options: &TraceOptions,
    t_min_m: f64,
    cells: &Buffer<[f32; 4]>,
    chains: &Buffer<u32>,
    counts: &Buffer<u32>,
) {
    let [origin_hi, origin_lo] = split3(fan.origin_m);
    let [axis0, axis1, axis2] = columns(fan.rotation);
    let params = Params {
        origin_hi,
        t_min: t_min_m as f32,
        origin_lo,
        bounces: options.bounces as u32,
        axis0,
        last_only: (options.convention == Convention::Last) as u32,
        axis1,
        tubes: tubes as u32,
        axis2,
        zero: 0,
    };
    recorder.dispatch(
        &KERNEL,
        &params,
        &[&geometry.nodes, &geometry.triangles, &geometry.planes, cells, chains, counts],
        Threads::Linear(tubes as u64),
    );
}
