//! A scene as the kernels read it that follow what a radar amid it sees (`shaders/shared/views.wgsl`).

use super::cpu::topology::{PAD, Shared};
use crate::geom::faces::LIES_M;
use crate::gpu_struct;
use glam::Vec3;

gpu_struct! {
    /// Uniform of the kernels that follow views (`shaders/shared/view_params.wgsl`).
    pub struct ViewParams {
        pub first: u32,
        pub count: u32,
        pub threads: u32,
        pub mode: u32,
        pub faces: u32,
        pub nodes_at: u32,
        pub nodes: u32,
        pub edges_at: u32,
        pub level: u32,
        pub endless: u32,
        pub budget: u32,
        pub probe: u32,
        pub flat_m: f32,
        pub lies_m: f32,
        pub pad_m: f32,
        pub total_at: u32,
        pub parts: u32,
        pub patches_at: u32,
        pub pad0: u32,
        pub pad1: u32,
    }
}

/// Words of a piece in `shaders/shared/view_params.wgsl`.
pub const PIECE: usize = 34;
/// Pieces that a thread of `view_hide` has room for.
pub const SLOTS: usize = 16;
/// Faces, edges and patches that the shaders can tell apart; walls take the numbers above.
pub const MOST: usize = 0xff_0000;
/// Faces of one leaf.
const MOST_OF_LEAF: u32 = 255;

/// Faces, their corners and edges, and the tree over them.
pub(crate) struct ViewArrays {
    /// Index of the body of each face, packed.
    pub body: Vec<[u32; 4]>,
    /// Parameters that hold for every dispatch.
    pub params: ViewParams,
}

impl ViewArrays {
    /// The arrays of a scene; None if it has more faces than the shaders can tell apart.
    pub fn new(shared: &Shared<'_>) -> Option<ViewArrays> {
        let faces = shared.faces;
        let too_many = [faces.faces.len(), shared.along.len(), faces.corners.len()].iter().any(|n| *n > MOST);
        if too_many || faces.nodes.iter().any(|n| n.count > MOST_OF_LEAF) {
            return None;
        }
        let word = |v: Vec3, bits: u32| {
            let [x, y, z] = v.to_array().map(f32::to_bits);
            [x, y, z, bits]
        };
        // Larger patches of later bodies have higher ranks.
        let size = |f: &crate::geom::faces::Face| (faces.patch_area_m2[f.patch as usize].to_bits(), f.body);
        let mut sizes: Vec<(u64, u32)> = faces.faces.iter().map(size).collect();
        sizes.sort_unstable();
        sizes.dedup();
        let mut body = Vec::with_capacity(
            3 * faces.faces.len() + faces.corners.len() + 2 * faces.nodes.len() + shared.along.len(),
        );
        for (i, f) in faces.faces.iter().enumerate() {
            let rank = sizes.partition_point(|s| *s < size(f)) as u32;
            let area_m2 = faces.patch_area_m2[f.patch as usize] as f32;
            body.push(word(shared.normals[i], shared.offsets[i].to_bits()));
            body.push([f.first, f.count | u32::from(f.one_sided) << 8, f.patch, f.body]);
            body.push([rank, area_m2.to_bits(), 0, 0]);
        }
        let corners_at = body.len();
        body.resize(corners_at + faces.corners.len(), [0; 4]);
        for f in &faces.faces {
            for i in 0..f.count {
                let at = (f.first + i) as usize;
                let edge = shared.edge_of[at] | u32::from(shared.runs_back(f, i)) << 31;
                body[corners_at + at] = word(shared.corners[at], edge);
            }
        }
        let nodes_at = body.len() as u32;
        let boxes = boxes(shared);
        let mut stack = if faces.nodes.is_empty() { vec![] } else { vec![(0usize, true)] };
        let mut open: Vec<usize> = Vec::new();
        while let Some((i, enter)) = stack.pop() {
            if !enter {
                // Each node knows where the walk goes on when it skips the branch.
                let next = (body.len() - nodes_at as usize) as u32 / 2;
                if let Some(at) = open.pop() {
                    body[at][3] = next;
                }
                continue;
            }
            let (n, (lo, hi)) = (&faces.nodes[i], boxes[i]);
            open.push(body.len());
            body.push(word(0.5 * (lo + hi), 0));
            body.push(word(0.5 * (hi - lo), if n.count > 0 { n.first | n.count << 24 } else { 0 }));
            stack.push((i, false));
            if n.count == 0 {
                stack.extend([(n.first as usize + 1, true), (n.first as usize, true)]);
            }
        }
        let nodes = (body.len() as u32 - nodes_at) / 2;
        let edges_at = body.len() as u32;
        // A corner of some face where each edge begins.
        let mut begins = vec![0; shared.along.len()];
        for f in &faces.faces {
            for i in 0..f.count {
                let next = f.first + if shared.runs_back(f, i) { (i + 1) % f.count } else { i };
                begins[shared.edge_of[(f.first + i) as usize] as usize] = next;
            }
        }
        body.extend(shared.along.iter().zip(begins).map(|(d, begins)| word(*d, begins)));
        let patches_at = body.len() as u32;
        body.extend(shared.face_of_patch.chunks(4).map(|of| {
            let mut word = [0; 4];
            word[..of.len()].copy_from_slice(of);
            word
        }));
        let params = ViewParams {
            faces: faces.faces.len() as u32,
            nodes_at,
            nodes,
            edges_at,
            patches_at,
            probe: 4,
            flat_m: faces.flat_m as f32,
            lies_m: LIES_M as f32,
            pad_m: (PAD * faces.radius_m) as f32,
            ..Default::default()
        };
        Some(ViewArrays { body, params })
    }
}

/// Lowest and highest corner of what each node holds, along the axes of the first window.
fn boxes(shared: &Shared<'_>) -> Vec<(Vec3, Vec3)> {
    let faces = shared.faces;
    let none = (Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY));
    let mut boxes = vec![none; faces.nodes.len()];
    let mut stack = if faces.nodes.is_empty() { vec![] } else { vec![(0usize, true)] };
    while let Some((i, enter)) = stack.pop() {
        let n = &faces.nodes[i];
        let (first, second) = (n.first as usize, n.first as usize + 1);
        if n.count > 0 {
            let of = &faces.faces[first..first + n.count as usize];
            let corners = of.iter().flat_map(|f| &shared.corners[f.first as usize..][..f.count as usize]);
            boxes[i] = corners.fold(none, |(lo, hi), c| (lo.min(*c), hi.max(*c)));
        } else if enter {
            stack.extend([(i, false), (first, true), (second, true)]);
        } else {
            let (a, b) = (boxes[first], boxes[second]);
            boxes[i] = (a.0.min(b.0), a.1.max(b.1));
        }
    }
    boxes
}
