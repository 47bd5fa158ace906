//! Scene and grids of rays as the shaders read them.

use crate::geom::upload::{GeometryArrays, split3};
use crate::gpu::{Buffer, Recorder};
use crate::trace::launch::{Cell, Fan};
use glam::{DMat3, DVec3};

/// The geometry on the device.
pub struct GeometryBuffers {
    /// Nodes of the tree.
    pub nodes: Buffer<[u32; 4]>,
    /// Triangles as the tree holds them.
    pub triangles: Buffer<[f32; 4]>,
    /// Planes of the triangles.
    pub planes: Buffer<[f32; 4]>,
    /// Surfaces of the triangles.
    pub surfaces: Buffer<[f32; 4]>,
}

impl GeometryBuffers {
    /// Uploads a scene's arrays.
    pub fn upload(recorder: &mut Recorder<'_>, arrays: &GeometryArrays) -> Self {
        GeometryBuffers {
            nodes: recorder.upload("bvh nodes", &arrays.nodes),
            triangles: recorder.upload("triangles", &arrays.triangles),
            planes: recorder.upload("planes", &arrays.planes),
            surfaces: recorder.upload("surfaces", &arrays.surfaces),
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
