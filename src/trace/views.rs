//! A scene as the kernels read it that follow what a radar amid it sees (`shaders/shared/views.wgsl`).

use super::cpu::levels::Numbers;
use super::cpu::topology::Shared;
use crate::geom::faces::{Face, LIES_M};
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
        pub edges_at: u32,
        pub level: u32,
        pub budget: u32,
        pub probe: u32,
        pub lies_m: f32,
        pub total_at: u32,
        pub parts: u32,
        pub patches_at: u32,
        pub room: u32,
        pub room_on: u32,
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

/// Faces of scenes one behind the other, their corners and edges, and the trees over them.
pub(crate) struct ViewArrays {
    /// The arrays, packed.
    pub body: Vec<[u32; 4]>,
    /// Parameters that hold for every dispatch.
    pub params: ViewParams,
    /// Of each scene, from where on its faces, corners, nodes, edges and patches are numbered.
    pub numbers: Vec<Numbers>,
}

/// A scene's tree in the order of a walk, two words a node, of which the first is numbered `first`.
fn walked(shared: &Shared<'_>, first: u32, first_face: u32, body: &mut Vec<[u32; 4]>) {
    let (faces, start) = (shared.faces, body.len());
    let boxes = boxes(shared);
    let mut stack = if faces.nodes.is_empty() { vec![] } else { vec![(0usize, true)] };
    let mut open: Vec<usize> = Vec::new();
    while let Some((i, enter)) = stack.pop() {
        if !enter {
            // Each node knows where the walk goes on when it skips the branch.
            let next = first + (body.len() - start) as u32 / 2;
            if let Some(at) = open.pop() {
                body[at][3] = next;
            }
            continue;
        }
        let (n, (lo, hi)) = (&faces.nodes[i], boxes[i]);
        open.push(body.len());
        body.push(word(0.5 * (lo + hi), 0));
        let leaf = if n.count > 0 { (first_face + n.first) | n.count << 24 } else { 0 };
        body.push(word(0.5 * (hi - lo), leaf));
        stack.push((i, false));
        if n.count == 0 {
            stack.extend([(n.first as usize + 1, true), (n.first as usize, true)]);
        }
    }
}

fn word(v: Vec3, bits: u32) -> [u32; 4] {
    let [x, y, z] = v.to_array().map(f32::to_bits);
    [x, y, z, bits]
}

impl ViewArrays {
    /// The arrays of scenes; None if they have more faces than the shaders can tell apart.
    pub fn new(scenes: &[&Shared<'_>]) -> Option<ViewArrays> {
        let mut behind = Numbers::default();
        let mut numbers = Vec::with_capacity(scenes.len());
        for shared in scenes {
            let faces = shared.faces;
            if faces.nodes.iter().any(|n| n.count > MOST_OF_LEAF) {
                return None;
            }
            numbers.push(behind);
            behind.faces += faces.faces.len() as u32;
            behind.corners += faces.corners.len() as u32;
            behind.edges += shared.along.len() as u32;
            behind.patches += shared.face_of_patch.len() as u32;
            let all = [behind.faces, behind.corners, behind.edges, behind.patches];
            if all.iter().any(|n| *n as usize > MOST) {
                return None;
            }
        }
        let nodes: usize = scenes.iter().map(|s| s.faces.nodes.len()).sum();
        let words = 3 * behind.faces + behind.corners + behind.edges + behind.patches / 4 + 1;
        let mut body = Vec::with_capacity(words as usize + 2 * nodes);
        for (shared, n) in scenes.iter().zip(&numbers) {
            let faces = shared.faces;
            // Larger patches of later bodies have higher ranks.
            let size = |f: &Face| (faces.patch_area_m2[f.patch as usize].to_bits(), f.body);
            let mut sizes: Vec<(u64, u32)> = faces.faces.iter().map(size).collect();
            sizes.sort_unstable();
            sizes.dedup();
            for (i, f) in faces.faces.iter().enumerate() {
                let rank = sizes.partition_point(|s| *s < size(f)) as u32;
                let area_m2 = faces.patch_area_m2[f.patch as usize] as f32;
                body.push(word(shared.normals[i], shared.offsets[i].to_bits()));
                let corners = f.count | u32::from(f.one_sided) << 8;
                body.push([n.corners + f.first, corners, n.patches + f.patch, f.body]);
                body.push([rank, area_m2.to_bits(), 0, 0]);
            }
        }
        for (shared, n) in scenes.iter().zip(&numbers) {
            let start = body.len();
            body.resize(start + shared.faces.corners.len(), [0; 4]);
            for f in &shared.faces.faces {
                for i in 0..f.count {
                    let at = (f.first + i) as usize;
                    let edge = (n.edges + shared.edge_of[at]) | u32::from(shared.runs_back(f, i)) << 31;
                    body[start + at] = word(shared.corners[at], edge);
                }
            }
        }
        let nodes_at = body.len() as u32;
        let mut first = 0;
        for (shared, n) in scenes.iter().zip(&mut numbers) {
            walked(shared, first, n.faces, &mut body);
            n.nodes = [first, (body.len() as u32 - nodes_at) / 2];
            first = n.nodes[1];
        }
        let edges_at = body.len() as u32;
        for (shared, n) in scenes.iter().zip(&numbers) {
            // A corner of some face where each edge begins.
            let mut begins = vec![0; shared.along.len()];
            for f in &shared.faces.faces {
                for i in 0..f.count {
                    let next = f.first + if shared.runs_back(f, i) { (i + 1) % f.count } else { i };
                    begins[shared.edge_of[(f.first + i) as usize] as usize] = n.corners + next;
                }
            }
            body.extend(shared.along.iter().zip(begins).map(|(d, begins)| word(*d, begins)));
        }
        let patches_at = body.len() as u32;
        let of_patch = |(shared, n): (&&Shared<'_>, &Numbers)| {
            let first = n.faces;
            // A patch all of whose faces are beyond reach has none.
            shared.face_of_patch.iter().map(move |f| f.saturating_add(first)).collect::<Vec<u32>>()
        };
        let of_patches: Vec<u32> = scenes.iter().zip(&numbers).flat_map(of_patch).collect();
        body.extend(of_patches.chunks(4).map(|of| {
            let mut word = [0; 4];
            word[..of.len()].copy_from_slice(of);
            word
        }));
        let params = ViewParams {
            faces: behind.faces,
            nodes_at,
            edges_at,
            patches_at,
            probe: 4,
            lies_m: LIES_M as f32,
            ..Default::default()
        };
        Some(ViewArrays { body, params, numbers })
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
