// Edges of lit faces ahead of each view, and the share of each that may be lit. Stage GROUPS_AHEAD: a thread takes one view and a run
// of GROUPS groups of nodes of the tree over the edges of its scene, and lists those groups that the cone of rays does not miss. Stage EDGES_AHEAD: a
// thread takes one of these groups and writes its edges as segments. Each counts first; then, the counts being summed, writes.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
// Groups ahead, a word each: (view, first node, 0, 0).
@group(0) @binding(3) var<storage, read> groups: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
// Groups, or segments of two words.
@group(0) @binding(5) var<storage, read_write> ahead: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> sizes: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> work: array<u32>;

const GROUPS_AHEAD: u32 = 0u;
const EDGES_AHEAD: u32 = 1u;

var<private> slot: u32;
var<private> found: u32;

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

// The view of a thread that asks for groups: the last whose first thread is not behind it.
fn view_of_thread(id: u32) -> u32 {
    var view = 0u;
    var end = params.views;
    while end - view > 1u {
        let middle = (view + end) / 2u;
        if views[3u * middle + 1u].w <= id {
            view = middle;
        } else {
            end = middle;
        }
    }
    return view;
}

fn groups_ahead(id: u32) {
    let view = view_of_thread(id);
    enter(view);
    let head = views[3u * view + 1u];
    let all = (edge_nodes.y - edge_nodes.x + GROUP - 1u) / GROUP;
    let run = id - head.w;
    let boxes = params.groups_at + 2u * (GROUPS + 1u) * (body[params.scenes_at + 4u * head.x + 1u].z + run);
    tests += 1u;
    if misses_spaces(head.yz, f32s(body[boxes]).xyz, f32s(body[boxes + 1u]).xyz) {
        return;
    }
    let first = GROUPS * run;
    for (var group = first; group < min(first + GROUPS, all); group += 1u) {
        tests += 1u;
        let at = boxes + 2u * (group - first + 1u);
        if misses_spaces(head.yz, f32s(body[at]).xyz, f32s(body[at + 1u]).xyz) {
            continue;
        }
        if params.mode == 1u {
            ahead[slot + found] = vec4<u32>(view, edge_nodes.x + GROUP * group, 0u, 0u);
        }
        found += 1u;
    }
}

// In how many equal parts an edge is cut between two shares: as many as it spans WIDEST in view.
fn parts_of(edge: Edge, from_share: Num, to_share: Num) -> u32 {
    let s = source_of(last_leg);
    let along = v_sub(edge.b, edge.a);
    let a = from_to(s, v_along(edge.a, along, from_share));
    let b = from_to(s, v_along(edge.a, along, to_share));
    let angle = atan2(length(cross(a, b)), dot(a, b));
    return clamp(u32(ceil(angle / WIDEST)), 1u, 32u);
}

fn edges_ahead(group: vec4<u32>) {
    let view = group.x;
    enter(view);
    let spaces = views[3u * view + 1u].yz;
    var node = group.y;
    let end = min(node + GROUP, edge_nodes.y);
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
            let from_share = num_of(shares.xy);
            let whole = n_sub(num_of(shares.zw), from_share);
            let count = parts_of(edge, from_share, num_of(shares.zw));
            var before = shares.xy;
            for (var k = 1u; params.mode == 1u && k <= count; k += 1u) {
                var next = shares.zw;
                if k < count {
                    next = halves_of(n_add(from_share, n_mul(whole, num(f32(k) / f32(count)))));
                }
                let to = 2u * (slot + found + k - 1u);
                ahead[to] = vec4<u32>(view, OF_EDGE << 30u | i, 0u, NONE);
                ahead[to + 1u] = bitcast<vec4<u32>>(vec4<f32>(before, next));
                before = next;
            }
            found += count;
        }
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    begin_numbers(params.zero);
    let id = linear_id(workgroup, workgroups, local, 64u);
    if params.mode == 1u {
        let total = counts[params.count];
        let fits = total <= params.room;
        if id == 0u {
            atomicStore(&sizes[1u + params.list_out], select(0u, total, fits));
            atomicStore(&sizes[NEEDED + 1u + params.list_out], total);
        }
        if !fits {
            return;
        }
    }
    var count = params.count;
    if params.stage == EDGES_AHEAD {
        count = atomicLoad(&sizes[1u + params.list_in]);
    }
    if id >= count {
        return;
    }
    slot = counts[id];
    found = 0u;
    if params.mode == 0u || counts[id + 1u] > slot {
        if params.stage == GROUPS_AHEAD {
            groups_ahead(id);
        } else {
            edges_ahead(groups[id]);
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
