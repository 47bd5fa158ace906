// Faces that may stand ahead of each reflected beam, by the boxes of the tree. A thread takes one beam and one of `params.parts` parts of
// the tree. Counts first; then, the counts being summed, writes pairs (beam, face) behind
// their number. Where there is no room for all of them the number is 0.

@group(0) @binding(0) var<uniform> params: ViewParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> beams: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> troubles: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = linear_id(workgroup, workgroups, local, 64u);
    let id = params.first + thread;
    if thread >= params.threads || id >= params.count {
        return;
    }
    let slot = counts[id];
    if params.mode == 1u {
        let total = counts[params.total_at];
        let fits = total <= params.room;
        if id == 0u {
            pairs[0] = vec2<u32>(select(0u, total, fits), 0u);
        }
        if !fits || counts[id + 1u] == slot {
            return;
        }
    }
    let index = id / params.parts;
    let part = id % params.parts;
    let beam = index * PIECE;
    let head = beams[beam];
    let from_word = beams[beam + 1u].z;
    let from_face = from_word & 0x7fffffffu;
    let from_side = select(1.0, -1.0, (from_word & 0x80000000u) != 0u);
    let f = view_at(head.y);
    let n = head.z & 0xffu;
    var box = vec4<f32>(1e30, 1e30, -1e30, -1e30);
    for (var i = 0u; i < n; i += 1u) {
        let p = bitcast<vec2<f32>>(beams[beam + 2u + 2u * i].xy);
        box = vec4<f32>(min(box.xy, p), max(box.zw, p));
    }
    let side = plane_of(from_face) * from_side;
    look_within(f, box, side, side);
    let nodes = (f.nodes.y - f.nodes.x + params.parts - 1u) / params.parts;
    node = f.nodes.x + part * nodes;
    last_node = min(node + nodes, f.nodes.y);
    faces_left = 0u;
    let area_m2 = bitcast<f32>(body[3u * from_face + 2u].y);
    var found = 0u;
    while find_next() {
        let g = found_face;
        if of_one_patch(g, from_face) || !reaches_in(g) || lit(f, g) == 0.0 {
            continue;
        }
        // The host looks again at what lies on the edge of the rule.
        let small = bitcast<f32>(body[3u * g + 2u].y);
        let most = max(ENDLESS_M2, ENDLESS_RATIO * small) * 0.99999;
        if params.level >= f.bounces && params.level == 1u && area_m2 < most {
            continue;
        }
        if place(g, from_face, from_side, max(f.flat_m, params.lies_m)) == BEHIND {
            continue;
        }
        if params.mode == 1u {
            pairs[1u + slot + found] = vec2<u32>(index, g);
        }
        found += 1u;
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&troubles[0], trouble);
    }
    if params.mode == 0u {
        counts[id] = found;
    }
}
