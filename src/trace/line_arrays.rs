//! Scenes and views as the kernels of visibility by lines read them (`shaders/shared/lines.wgsl`).

use super::cpu::lines::{NO_EDGE, Scene, View};
use crate::base::tasks::Tasks;
use crate::geom::faces::{Face, LIES_M};
use crate::geom::tree::Node;
use crate::gpu::numbers::df_from_f64;
use crate::gpu_struct;
use glam::DVec3;
use rayon::prelude::*;

gpu_struct! {
    /// Uniform of the kernels of visibility by lines (`shaders/shared/line_params.wgsl`).
    pub struct LineParams {
        pub count: u32,
        pub mode: u32,
        pub stage: u32,
        pub zero: u32,
        pub probe: u32,
        pub traits_at: u32,
        pub corners_at: u32,
        pub edges_at: u32,
        pub halves_at: u32,
        pub piercings_at: u32,
        pub nodes_at: u32,
        pub scenes_at: u32,
        pub windows_at: u32,
        pub groups_at: u32,
        pub legs_at: u32,
        pub spaces_at: u32,
        pub outlines_at: u32,
        pub hulls_at: u32,
        pub views: u32,
        pub list_in: u32,
        pub list_out: u32,
        pub room: u32,
        pub counts_work: u32,
    }
}

/// Kinds of segments, in the upper two bits of their second word.
pub(super) const OF_EDGE: u32 = 0;
pub(super) const OF_WALL: u32 = 1;
pub(super) const OF_OUTLINE: u32 = 2;

/// Items of one leaf, and items of a tree, that a node has bits for.
const MOST_OF_LEAF: u32 = 0xff;
const MOST_ITEMS: usize = 1 << 24;
/// Numbers that a segment has bits for.
const MOST_NUMBERS: usize = 1 << 30;

/// Nodes of the tree over edges that have one box together, groups of them that have another one together and are one thread's, and
/// fragments of an outline that have one box together.
pub(super) const GROUP: u32 = 64;
pub(super) const GROUPS: u32 = 8;
pub(super) const HULL: u32 = 16;

/// A word of the arrays.
pub(super) type Word = [u32; 4];

/// From where on what a scene has is numbered, among all scenes.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Numbers {
    pub faces: u32,
    pub corners: u32,
    pub edges: u32,
    pub halves: u32,
    pub piercings: u32,
    pub patches: u32,
    pub windows: u32,
    /// Runs of groups of nodes over edges.
    pub runs: u32,
}

/// Scenes one behind the other.
pub(super) struct LineArrays {
    pub body: Vec<Word>,
    /// Parameters that hold for every dispatch.
    pub params: LineParams,
    pub numbers: Vec<Numbers>,
}

/// The upper and the lower half of an f64, as the bits of f32.
fn halved(x: f64) -> [u32; 2] {
    df_from_f64(x).map(f32::to_bits)
}

/// A vector and one more number, in an upper and a lower word.
fn four(v: DVec3, w: f64) -> [Word; 2] {
    let [x, y, z, w] = [v.x, v.y, v.z, w].map(halved);
    [0, 1].map(|i| [x[i], y[i], z[i], w[i]])
}

/// A vector in an upper and a lower word, with bits behind each.
fn three(v: DVec3, bits: [u32; 2]) -> [Word; 2] {
    let [a, b] = four(v, 0.0);
    [[a[0], a[1], a[2], bits[0]], [b[0], b[1], b[2], bits[1]]]
}

fn f32s(v: DVec3, w: f64) -> Word {
    [v.x, v.y, v.z, w].map(|x| (x as f32).to_bits())
}

/// A tree in the order of a walk: two words a node, of which the first is numbered `first`; items are numbered from `first_item` on.
fn walked(nodes: &[Node], radar: DVec3, first: u32, first_item: u32, out: &mut Vec<Word>) {
    let start = out.len();
    let mut stack = if nodes.is_empty() { vec![] } else { vec![(0u32, true)] };
    let mut open: Vec<usize> = Vec::new();
    while let Some((i, enter)) = stack.pop() {
        if !enter {
            // Each node knows where the walk goes on when it skips the branch.
            let next = first + (out.len() - start) as u32 / 2;
            if let Some(at) = open.pop() {
                out[at][3] = next;
            }
            continue;
        }
        let n = &nodes[i as usize];
        let centre = n.centre - radar;
        let rounded = centre.as_vec3().as_dvec3();
        // Nothing leaves its box by rounding.
        let half = (n.half + (centre - rounded).abs()) * (1.0 + 1e-6);
        open.push(out.len());
        out.push(f32s(centre, 0.0));
        let mut size = f32s(half, 0.0);
        size[3] = if n.count > 0 { (first_item + n.first) | n.count << 24 } else { 0 };
        out.push(size);
        stack.push((i, false));
        if n.count == 0 {
            stack.extend([(n.first + 1, true), (n.first, true)]);
        }
    }
}

/// Runs of groups of the nodes over a scene's edges.
fn runs_of(scene: &Scene<'_>) -> u32 {
    scene.table.tree.nodes().len().div_ceil((GROUP * GROUPS) as usize) as u32
}

/// The box around the leaves among nodes.
fn around(nodes: &[Word]) -> [Word; 2] {
    let boxes = nodes.chunks_exact(2).filter(|n| n[1][3] != 0).map(|n| {
        let [centre, half] = [n[0], n[1]].map(|[x, y, z, _]| {
            let [x, y, z] = [x, y, z].map(|bits| f64::from(f32::from_bits(bits)));
            DVec3::new(x, y, z)
        });
        (centre - half, centre + half)
    });
    rounded_box(boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default())
}

/// A box by its centre and half its size, in f32, which nothing leaves by rounding.
fn rounded_box((lo, hi): (DVec3, DVec3)) -> [Word; 2] {
    let centre = 0.5 * (lo + hi);
    let half = 0.5 * (hi - lo) + (centre - centre.as_vec3().as_dvec3()).abs();
    [f32s(centre, 0.0), f32s(half * (1.0 + 1e-6), 0.0)]
}

impl LineArrays {
    /// The arrays of scenes; None if they have more faces or edges than the shaders can number.
    pub fn new(scenes: &[&Scene<'_>]) -> Option<LineArrays> {
        let mut behind = Numbers::default();
        let mut numbers = Vec::with_capacity(scenes.len());
        for scene in scenes {
            let (faces, table) = (scene.faces, scene.table);
            let nodes = faces.nodes.iter().chain(table.tree.nodes());
            if nodes.clone().any(|n| n.count > MOST_OF_LEAF) {
                return None;
            }
            numbers.push(behind);
            behind.faces += faces.faces.len() as u32;
            behind.corners += faces.corners.len() as u32;
            behind.edges += table.edges.len() as u32;
            for edge in &table.edges {
                behind.halves += table.halves(edge).len() as u32;
                behind.piercings += table.pierced(edge).len() as u32;
            }
            behind.patches += faces.patch_area_m2.len() as u32;
            behind.windows += scene.windows.len() as u32;
            behind.runs += runs_of(scene);
            if [behind.faces, behind.edges].iter().any(|n| *n as usize >= MOST_ITEMS) {
                return None;
            }
        }
        let mut body: Vec<Word> = Vec::new();
        for (scene, n) in scenes.iter().zip(&numbers) {
            for (i, f) in scene.faces.faces.iter().enumerate() {
                let offset = f.offset_m - f.normal.dot(scene.radar);
                body.extend(four(f.normal, offset));
                let flags = f.count | u32::from(f.one_sided) << 8 | u32::from(scene.lit[i]) << 9;
                body.push([n.corners + f.first, flags, n.patches + f.patch, f.body]);
            }
        }
        let mut params = LineParams { probe: 4, traits_at: body.len() as u32, ..Default::default() };
        for (scene, n) in scenes.iter().zip(&numbers) {
            let faces = scene.faces;
            // Larger patches of later bodies have higher ranks.
            let size = |f: &Face| (faces.patch_area_m2[f.patch as usize].to_bits(), f.body);
            let mut sizes: Vec<(u64, u32)> = faces.faces.iter().map(size).collect();
            sizes.sort_unstable();
            sizes.dedup();
            let rank = |f: &Face| sizes.partition_point(|s| *s < size(f)) as u32;
            body.extend(faces.faces.iter().map(|f| [rank(f), n.faces + scene.lead(f.patch), 0, 0]));
        }
        params.corners_at = body.len() as u32;
        for scene in scenes {
            for (welded, plain) in scene.table.all_corners().iter().zip(&scene.faces.corners) {
                body.extend([*welded, *plain].iter().flat_map(|p| three(*p - scene.radar, [0, 0])));
            }
        }
        params.edges_at = body.len() as u32;
        for (scene, n) in scenes.iter().zip(&numbers) {
            let (mut half, mut pierced) = (n.halves, n.piercings);
            for (edge, free) in scene.table.edges.iter().zip(&scene.free) {
                let halves = scene.table.halves(edge).len() as u32;
                let piercings = scene.table.pierced(edge).len() as u32;
                let free = if *free > 0.0 { 1 } else { u32::from(*free < 0.0) * 2 };
                let [a, b] = edge.ends_m.map(|p| p - scene.radar);
                body.extend(three(a, [half, halves | free << 30]));
                body.extend(three(b, [pierced, piercings]));
                half += halves;
                pierced += piercings;
            }
        }
        params.halves_at = body.len() as u32;
        for (scene, n) in scenes.iter().zip(&numbers) {
            let halves = scene.table.edges.iter().flat_map(|e| scene.table.halves(e));
            body.extend(halves.flat_map(|h| three(h.inward, [n.faces + h.face, 0])));
        }
        params.piercings_at = body.len() as u32;
        for scene in scenes {
            let piercings = scene.table.edges.iter().flat_map(|e| scene.table.pierced(e));
            body.extend(piercings.map(|t| {
                let [upper, lower] = halved(*t);
                [upper, lower, 0, 0]
            }));
        }
        params.nodes_at = body.len() as u32;
        let mut ranges = Vec::with_capacity(scenes.len());
        for (scene, n) in scenes.iter().zip(&numbers) {
            let node = |body: &Vec<Word>| (body.len() as u32 - params.nodes_at) / 2;
            let first = node(&body);
            walked(&scene.faces.nodes, scene.radar, first, n.faces, &mut body);
            let between = node(&body);
            walked(scene.table.tree.nodes(), scene.radar, between, n.edges, &mut body);
            ranges.push([first, between, between, node(&body)]);
        }
        params.scenes_at = body.len() as u32;
        for ((scene, n), range) in scenes.iter().zip(&numbers).zip(&ranges) {
            let faces = scene.faces;
            let centre = faces.centre_m - scene.radar;
            let limits = DVec3::new(
                faces.flat_m,
                super::cpu::beams::GRAZING * faces.radius_m,
                faces.flat_m.max(LIES_M),
            );
            body.extend([
                *range,
                [n.windows, scene.windows.len() as u32, n.runs, 0],
                f32s(centre, faces.radius_m * (1.0 + 1e-6)),
                f32s(limits, 0.0),
            ]);
        }
        params.windows_at = body.len() as u32;
        for window in scenes.iter().flat_map(|s| s.windows) {
            body.extend([window.k, window.u, window.v].iter().flat_map(|v| three(*v, [0, 0])));
        }
        params.groups_at = body.len() as u32;
        for [_, _, first, end] in ranges {
            let [first, end] = [first, end].map(|node| (params.nodes_at + 2 * node) as usize);
            let mut runs: Vec<[Word; 2]> = Vec::new();
            for run in body[first..end].chunks((2 * GROUP * GROUPS) as usize) {
                runs.push(around(run));
                runs.extend(run.chunks(2 * GROUP as usize).map(around));
                runs.resize(runs.len().next_multiple_of(GROUPS as usize + 1), [[0; 4]; 2]);
            }
            body.extend(runs.as_flattened());
        }
        Some(LineArrays { body, params, numbers })
    }
}

/// Views, each with the number of its scene, and where parts of their array begin; `count` of these is that of threads that ask for groups
/// ahead. None if they have more than the shaders can number.
pub(super) fn views(views: &[(u32, &View<'_>)], numbers: &[Numbers]) -> Option<(Vec<Word>, LineParams)> {
    let outlines: usize = views.iter().map(|(_, v)| v.outline().len()).sum();
    if outlines >= MOST_NUMBERS {
        return None;
    }
    let mut words = Vec::with_capacity(9 * views.len() + 7 * outlines);
    let (mut leg, mut fragment, mut space, mut thread, mut hull) = (0u32, 0u32, 0u32, 0u32, 0u32);
    let all_spaces: Vec<Vec<(DVec3, f64)>> = views.par_iter().map_tasks(|(_, view)| view.spaces()).collect();
    for ((scene, view), spaces) in views.iter().zip(&all_spaces) {
        let (legs, fragments) = (view.legs.len() as u32, view.outline().len() as u32);
        let spaces = spaces.len() as u32;
        let hulls = fragments.div_ceil(HULL);
        words.extend([
            [leg, legs, fragment, fragments],
            [*scene, space, spaces, thread],
            [hull, hulls, 0, 0],
        ]);
        thread = thread.checked_add(runs_of(view.scene))?;
        hull += hulls;
        leg += legs;
        fragment += fragments;
        space += spaces;
    }
    let mut extend = |of_views: Vec<Vec<Word>>| {
        let at = words.len() as u32;
        of_views.iter().for_each(|of| words.extend(of));
        at
    };
    let legs = |(scene, view): &(u32, &View<'_>)| {
        let radar = view.scene.radar;
        let words = view.legs.iter().flat_map(|leg| {
            let (normal, offset) = leg.mirror.map_or((DVec3::ZERO, 0.0), |m| m.plane());
            let lead = leg.mirror.map_or(0, |m| numbers[*scene as usize].faces + m.lead);
            [three(leg.source - radar, [lead, 0]), four(normal, offset - normal.dot(radar))]
        });
        words.flatten().collect()
    };
    let spaces = |((_, view), spaces): (&(u32, &View<'_>), &Vec<(DVec3, f64)>)| {
        let from_radar = view.source() - view.scene.radar;
        spaces.iter().flat_map(|(n, least)| four(*n, least + n.dot(from_radar))).collect()
    };
    let outlines = |(scene, view): &(u32, &View<'_>)| {
        let edges = numbers[*scene as usize].edges;
        let words = view.outline().iter().flat_map(|f| {
            let edge = if f.edge == NO_EDGE { NO_EDGE } else { edges + f.edge };
            let [a, b] = f.ends_m.map(|p| p - view.scene.radar);
            [three(a, [edge, 0]), three(b, [0; 2]), three(f.inward, [0; 2])]
        });
        words.flatten().collect()
    };
    let hulls = |(_, view): &(u32, &View<'_>)| {
        let words = view.outline().chunks(HULL as usize).flat_map(|fragments| {
            let ends = fragments.iter().flat_map(|f| f.ends_m).map(|p| p - view.scene.radar);
            let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            rounded_box(ends.fold(start, |(lo, hi), p| (lo.min(p), hi.max(p))))
        });
        words.collect()
    };
    let legs_at = extend(views.par_iter().map_tasks(legs).collect());
    let spaces_at = extend(views.par_iter().zip(&all_spaces).map_tasks(spaces).collect());
    let outlines_at = extend(views.par_iter().map_tasks(outlines).collect());
    let hulls_at = extend(views.par_iter().map_tasks(hulls).collect());
    let params = LineParams {
        legs_at,
        spaces_at,
        outlines_at,
        hulls_at,
        views: views.len() as u32,
        count: thread,
        ..Default::default()
    };
    Some((words, params))
}

/// A segment of a view with shares from and to.
pub(super) fn segment(view: u32, kind: u32, number: u32, shares: [f64; 2]) -> [Word; 2] {
    let [[a, b], [c, d]] = shares.map(halved);
    [[view, kind << 30 | number, 0, u32::MAX], [a, b, c, d]]
}

/// The shares of a segment.
pub(super) fn shares(word: Word) -> [f64; 2] {
    let [a, b, c, d] = word.map(|bits| f64::from(f32::from_bits(bits)));
    [a + b, c + d]
}
