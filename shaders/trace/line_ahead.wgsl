// Edges of lit faces ahead of each view, and the share of each that may be lit. A thread takes one view and one chunk of the tree over the
// edges of its scene. Counts first; then, the counts being summed, writes segments.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
// The view and the first node of each thread's chunk.
@group(0) @binding(3) var<storage, read> chunks: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> segments: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> sizes: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> work: array<u32>;

struct Space {
    normal: NumVec,
    offset: Num,
}

fn space_of(number: u32) -> Space {
    let at = params.spaces_at + 2u * number;
    let hi = f32s(views[at]);
    let lo = f32s(views[at + 1u]);
    return Space(v_of(hi.xyz, lo.xyz), num_of(vec2<f32>(hi.w, lo.w)));
}

fn misses_spaces(spaces: vec2<u32>, centre: vec3<f32>, half: vec3<f32>) -> bool {
    let pad = 1e-5 + 2.0 * ROUNDED * (length(centre) + length(half));
    for (var i = spaces.x; i < spaces.x + spaces.y; i += 1u) {
        let space = f32s(views[params.spaces_at + 2u * i]);
        let off = pad * length(space.xyz) + 2.0 * ROUNDED * abs(space.w);
        if dot(space.xyz, centre) + dot(abs(space.xyz), half) < space.w - off {
            return true;
        }
    }
    return false;
}

// The share of an edge that is in all half-spaces; none where it does not rise.
fn share_within(spaces: vec2<u32>, edge: Edge) -> vec4<f32> {
    var from_share = num(0.0);
    var to_share = num(1.0);
    for (var i = spaces.x; i < spaces.x + spaces.y; i += 1u) {
        let space = space_of(i);
        let p = n_sub(v_dot(space.normal, edge.a), space.offset);
        let q = n_sub(v_dot(space.normal, edge.b), space.offset);
        let is_out_a = rough(p) < 0.0;
        let is_out_b = rough(q) < 0.0;
        if is_out_a && is_out_b {
            return vec4<f32>();
        }
        if is_out_a != is_out_b {
            let share = n_div(p, n_sub(p, q));
            if is_out_a && excess(share, from_share) > 0.0 {
                from_share = share;
            }
            if is_out_b && excess(share, to_share) < 0.0 {
                to_share = share;
            }
        }
    }
    if excess(to_share, from_share) <= 0.0 {
        return vec4<f32>();
    }
    return vec4<f32>(halves_of(from_share), halves_of(to_share));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    begin_numbers(params.zero);
    let id = linear_id(workgroup, workgroups, local, 64u);
    if id >= params.count {
        return;
    }
    let slot = counts[id];
    if params.mode == 1u {
        let total = counts[params.count];
        let fits = total <= params.room;
        if id == 0u {
            atomicStore(&sizes[1u + params.list_out], select(0u, total, fits));
            atomicStore(&sizes[NEEDED + 1u + params.list_out], total);
        }
        if !fits || counts[id + 1u] == slot {
            return;
        }
    }
    let view = chunks[id].x;
    enter(view);
    let spaces = views[2u * view + 1u].yz;
    var node = chunks[id].y;
    let end = min(node + params.stage, edge_nodes.y);
    var found = 0u;
    while node < end {
        tests += 1u;
        let a = body[params.nodes_at + 2u * node];
        let b = body[params.nodes_at + 2u * node + 1u];
        if misses_spaces(spaces, f32s(a).xyz, f32s(b).xyz) {
            node = a.w;
            continue;
        }
        node += 1u;
        let first = b.w & 0xffffffu;
        for (var i = first; i < first + (b.w >> 24u); i += 1u) {
            tests += 1u;
            let edge = edge_of(i);
            let shares = share_within(spaces, edge);
            if shares.z == 0.0 || !has_lit_half(last_leg, edge.halves) {
                continue;
            }
            if params.mode == 1u {
                let to = 2u * (slot + found);
                segments[to] = vec4<u32>(view, OF_EDGE << 30u | i, 0u, NONE);
                segments[to + 1u] = bitcast<vec4<u32>>(shares);
            }
            found += 1u;
        }
    }
    if params.mode == 0u {
        check_steps();
        if trouble != 0u {
            atomicOr(&sizes[0], trouble);
        }
        counts[id] = found;
        if params.counts_work != 0u {
            work[id] = tests;
        }
    }
}
