// Splits segments where something may begin or end on them. Stage BOUNDS: where the outline of the last mirror, or the walls of the
// windows, bound what can be lit. Stage NEARER: where silhouettes cross them nearer to the source, and where they pierce faces.
// Stage BEYOND: where edges cross farther away. A thread takes one segment. It counts first; then, the counts being summed, writes
// its shares, sorts them, and writes the parts between them.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> segments: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> shares: array<vec2<f32>>;
@group(0) @binding(6) var<storage, read_write> parts: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> sizes: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> work: array<u32>;

const BOUNDS: u32 = 0u;
const NEARER: u32 = 1u;
const BEYOND: u32 = 2u;

var<private> slot: u32;
var<private> found: u32;
var<private> from_share: Num;
var<private> length_share: Num;

// Takes a share of the segment.
fn split_at(share: Num) {
    if params.mode == 1u {
        shares[slot + found] = halves_of(n_add(from_share, n_mul(share, length_share)));
    }
    found += 1u;
}

// The plane through the source and a segment, between the rays to its ends.
struct Wedge {
    source: NumVec,
    a: NumVec,
    b: NumVec,
    normal: NumVec,
    // Positive inside.
    side_a: NumVec,
    side_b: NumVec,
}

fn wedge_over(ends: Ends) -> Wedge {
    let s = source_of(last_leg);
    let normal = v_unit(v_cross(v_sub(ends.a, s), v_sub(ends.b, ends.a)));
    let side_a = v_cross(normal, v_sub(ends.a, s));
    let side_b = v_cross(v_sub(ends.b, s), normal);
    return Wedge(s, ends.a, ends.b, normal, side_a, side_b);
}

// The share of the segment at which the ray to a position crosses it; negative where it passes by.
fn wedge_share(w: Wedge, x: NumVec) -> Num {
    let a = v_dot(w.side_a, v_sub(x, w.a));
    let b = v_dot(w.side_b, v_sub(x, w.b));
    if !(rough(a) > 0.0 && rough(b) > 0.0) {
        return num(-1.0);
    }
    return n_div(a, n_add(a, b));
}

// Where a segment comes near to the plane of a wedge: in so many positions, none to two.
var<private> meetings: array<NumVec, 2>;

fn meet(w: Wedge, a: NumVec, b: NumVec) -> u32 {
    let from_a = from_to(w.source, a);
    let from_b = from_to(w.source, b);
    let off = TOUCHING_M + ROUNDED * (length(from_a) + length(from_b));
    let rough_u = dot(v_rough(w.normal), from_a);
    let rough_v = dot(v_rough(w.normal), from_b);
    if min(rough_u, rough_v) > off || max(rough_u, rough_v) < -off {
        return 0u;
    }
    let u = v_dot(w.normal, v_sub(a, w.source));
    let v = v_dot(w.normal, v_sub(b, w.source));
    if min(rough(u), rough(v)) > TOUCHING_M || max(rough(u), rough(v)) < -TOUCHING_M {
        return 0u;
    }
    if max(abs(rough(u)), abs(rough(v))) <= TOUCHING_M {
        meetings[0] = a;
        meetings[1] = b;
        return 2u;
    }
    var share = n_div(u, n_sub(u, v));
    if rough(share) <= 0.0 {
        share = num(0.0);
    } else if excess(share, num(1.0)) > 0.0 {
        share = num(1.0);
    }
    meetings[0] = v_along(a, v_sub(b, a), share);
    return 1u;
}

// Whether a box is beside a wedge, of whose plane and sides the unit normals are given, in f32.
fn misses_wedge(
    source: vec3<f32>,
    n: vec3<f32>,
    p: vec3<f32>,
    q: vec3<f32>,
    centre: vec3<f32>,
    half: vec3<f32>,
) -> bool {
    let d = centre - source;
    let pad = 1e-5 + 2.0 * ROUNDED * (length(d) + length(source) + length(half));
    return abs(dot(n, d)) > dot(abs(n), half) + pad
        || dot(p, d) < -dot(abs(p), half) - pad
        || dot(q, d) < -dot(abs(q), half) - pad;
}

// A walk over the edges that may come near to a wedge: its box, the source, and the normals of its plane and of its two sides, in f32.
var<private> wedge_lo: vec3<f32>;
var<private> wedge_hi: vec3<f32>;
var<private> wedge_source: vec3<f32>;
var<private> wedge_planes: array<vec3<f32>, 3>;

// The next edge but `own`, or NONE.
fn next_edge(own: u32, needs_silhouettes: bool) -> u32 {
    loop {
        tests += 1u;
        if walk_left > 0u {
            let number = walk_face;
            walk_face += 1u;
            walk_left -= 1u;
            let at = params.edges_at + 4u * number;
            let a = f32s(body[at]).xyz - wedge_source;
            let b = f32s(body[at + 2u]).xyz - wedge_source;
            let off = 1e-5 + 2.0 * ROUNDED * (length(a) + length(b) + length(wedge_source));
            let u = dot(wedge_planes[0], a);
            let v = dot(wedge_planes[0], b);
            let is_far = min(u, v) > off || max(u, v) < -off;
            if !is_far && number != own && !(needs_silhouettes && body[at + 1u].w >> 30u == 0u) {
                return number;
            }
            continue;
        }
        if walk_node >= edge_nodes.y {
            return NONE;
        }
        let at = params.nodes_at + 2u * walk_node;
        let head = body[at];
        let leaf = body[at + 1u];
        let centre = f32s(head).xyz;
        let half = f32s(leaf).xyz;
        if any(centre - half > wedge_hi)
            || any(centre + half < wedge_lo)
            || misses_wedge(wedge_source, wedge_planes[0], wedge_planes[1], wedge_planes[2], centre, half) {
            walk_node = head.w;
        } else {
            walk_node += 1u;
            walk_face = leaf.w & 0xffffffu;
            walk_left = leaf.w >> 24u;
        }
    }
    return NONE;
}

// Splits at edges that cross the segment in view; `own` is its edge, or NONE.
fn split_at_edges(ends: Ends, own: u32, stage: u32) {
    let w = wedge_over(ends);
    if v_is_zero(w.normal) {
        return;
    }
    let s = v_rough(w.source);
    let out_of = v_unit(v_cross(w.normal, v_sub(ends.b, ends.a)));
    let is_behind = rough(v_dot(out_of, v_sub(ends.a, w.source))) < 0.0;
    // The direction beyond the segment.
    var far = out_of;
    if is_behind {
        far = v_neg(out_of);
    }
    let to_a = from_to(w.source, ends.a);
    let to_b = from_to(w.source, ends.b);
    var scale_a = 0.0;
    var scale_b = 0.0;
    if stage == NEARER {
        if last_leg > 0u {
            scale_a = clamp(rough(start_of(last_leg, v_sub(ends.a, w.source))), 0.0, 1.0);
            scale_b = clamp(rough(start_of(last_leg, v_sub(ends.b, w.source))), 0.0, 1.0);
        }
    } else {
        let most = length(s - middle_of_all) + radius_m;
        scale_a = max(most / length(to_a), 1.0);
        scale_b = max(most / length(to_b), 1.0);
    }
    let end_a = s + to_a * scale_a;
    let end_b = s + to_b * scale_b;
    let slack = SLACK_M + 2.0 * ROUNDED * (length(s) + length(end_a - s) + length(end_b - s));
    let lo = min(min(v_rough(ends.a), v_rough(ends.b)), min(end_a, end_b)) - slack;
    let hi = max(max(v_rough(ends.a), v_rough(ends.b)), max(end_a, end_b)) + slack;
    wedge_lo = lo;
    wedge_hi = hi;
    wedge_source = s;
    wedge_planes[0] = v_rough(w.normal);
    wedge_planes[1] = normalize(v_rough(w.side_a));
    wedge_planes[2] = normalize(v_rough(w.side_b));
    walk_node = edge_nodes.x;
    walk_left = 0u;
    let needs_silhouettes = last_leg == 0u && stage == NEARER;
    for (var i = next_edge(own, needs_silhouettes); i != NONE; i = next_edge(own, needs_silhouettes)) {
        let edge = edge_of(i);
        let count = meet(w, edge.a, edge.b);
        for (var k = 0u; k < count; k += 1u) {
            let x = meetings[k];
            let depth = rough(v_dot(far, v_sub(x, ends.a)));
            if select(depth <= -ROUNDING_M, depth >= SLACK_M, stage == NEARER) {
                continue;
            }
            let share = wedge_share(w, x);
            if rough(share) < 0.0 || (last_leg > 0u && rough(mirror_height(last_leg, x)) <= -LIES_M) {
                continue;
            }
            var counts_here = false;
            if stage == NEARER {
                counts_here = free_side(edge) != 0.0;
            } else {
                counts_here = has_lit_half(last_leg, edge.halves);
            }
            if counts_here {
                split_at(share);
            }
        }
    }
}

// Splits where two heights of the ends differ in sign.
fn split_between(p: Num, q: Num) {
    if (rough(p) > 0.0) != (rough(q) > 0.0) {
        split_at(n_div(p, n_sub(p, q)));
    }
}

fn split_at_bounds(ends: Ends) {
    if last_leg == 0u {
        for (var w = windows.x; w < windows.x + windows.y; w += 1u) {
            let at = params.windows_at + 6u * w;
            let k = body_vector(at);
            for (var side = 0u; side < 2u; side += 1u) {
                let u = body_vector(at + 2u + 2u * side);
                let minus = v_sub(k, u);
                let plus = v_add(k, u);
                split_between(v_dot(minus, ends.a), v_dot(minus, ends.b));
                split_between(v_dot(plus, ends.a), v_dot(plus, ends.b));
            }
        }
        return;
    }
    split_between(mirror_height(last_leg, ends.a), mirror_height(last_leg, ends.b));
    let w = wedge_over(ends);
    if v_is_zero(w.normal) {
        return;
    }
    let s = v_rough(w.source);
    let n = v_rough(w.normal);
    let p = normalize(v_rough(w.side_a));
    let q = normalize(v_rough(w.side_b));
    for (var hull = 0u; hull < hulls.y; hull += 1u) {
        tests += 1u;
        let box = params.hulls_at + 2u * (hulls.x + hull);
        if misses_wedge(s, n, p, q, f32s(views[box]).xyz, f32s(views[box + 1u]).xyz) {
            continue;
        }
        let end = outline.x + min(HULL * (hull + 1u), outline.y);
        for (var i = outline.x + HULL * hull; i < end; i += 1u) {
            tests += 1u;
            let at = outline_at(i);
            let count = meet(w, outline_vector(at), outline_vector(at + 2u));
            for (var k = 0u; k < count; k += 1u) {
                let share = wedge_share(w, meetings[k]);
                if rough(share) >= 0.0 {
                    split_at(share);
                }
            }
        }
    }
}

// Whether a part of an edge is beside what the last mirror lights. In the mirror's plane its two sides are distinguished later.
fn is_dark(edge: Edge, ends: Ends) -> bool {
    if last_leg == 0u || is_side_of_mirror(edge.halves) {
        return false;
    }
    let middle = middle_of(ends);
    if abs(rough(mirror_height(last_leg, middle))) <= flat_m {
        return false;
    }
    let s = source_of(last_leg);
    let normal = v_unit(v_cross(v_sub(edge.a, s), v_sub(edge.b, edge.a)));
    var off = v_times(normal, beside(ends));
    for (var side = 0u; side < 2u; side += 1u) {
        let p = v_add(middle, off);
        if is_path(p, p, Goal(NONE, NONE, vec2<u32>())) {
            return false;
        }
        off = v_neg(off);
    }
    return true;
}

fn split(segment: Segment, ends: Ends) {
    var seen = ends;
    var own = NONE;
    var piercings = vec2<u32>();
    if segment.kind == OF_WALL {
        // Near the radar the wedge has no segment to be beyond.
        seen = Ends(v_times(ends.a, 1e-6), v_times(ends.b, 1e-6));
    } else if segment.kind == OF_EDGE {
        let edge = edge_of(segment.number);
        own = segment.number;
        piercings = edge.piercings;
        if params.stage != BEYOND && is_side_of_mirror(edge.halves) {
            seen = Ends(seen_on_mirror(ends.a), seen_on_mirror(ends.b));
        }
    }
    if params.stage == BOUNDS {
        split_at_bounds(seen);
        return;
    }
    split_at_edges(seen, own, params.stage);
    if params.stage == NEARER {
        for (var i = piercings.x; i < piercings.y; i += 1u) {
            let share = f32s(body[params.piercings_at + i]).xy;
            if is_before(segment.shares.xy, share) && is_before(share, segment.shares.zw) {
                if params.mode == 1u {
                    shares[slot + found] = share;
                }
                found += 1u;
            }
        }
    }
}

fn is_before(a: vec2<f32>, b: vec2<f32>) -> bool {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
}

// Moves the value at the root of a heap of `count` shares down to where it belongs.
fn sift(root: u32, count: u32) {
    let value = shares[slot + root];
    var at = root;
    while 2u * at + 1u < count {
        var child = 2u * at + 1u;
        if child + 1u < count && is_before(shares[slot + child], shares[slot + child + 1u]) {
            child += 1u;
        }
        if !is_before(value, shares[slot + child]) {
            break;
        }
        shares[slot + at] = shares[slot + child];
        at = child;
    }
    shares[slot + at] = value;
}

fn sort(count: u32) {
    for (var i = count / 2u; i > 0u; i -= 1u) {
        sift(i - 1u, count);
    }
    for (var end = count; end > 1u; end -= 1u) {
        let last = shares[slot + end - 1u];
        shares[slot + end - 1u] = shares[slot];
        shares[slot] = last;
        sift(0u, end - 1u);
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
    let size = atomicLoad(&sizes[1u + params.list_in]);
    if params.mode == 1u {
        let total = counts[params.count];
        let fits = total + size <= params.room;
        if id == 0u {
            atomicStore(&sizes[1u + params.list_out], select(0u, total + size, fits));
            atomicStore(&sizes[NEEDED + 1u + params.list_out], total + size);
        }
        if !fits {
            return;
        }
    }
    if id >= size {
        return;
    }
    var segment = segment_of(segments[2u * id], segments[2u * id + 1u]);
    enter(segment.view);
    from_share = num_of(segment.shares.xy);
    length_share = n_sub(num_of(segment.shares.zw), from_share);
    let ends = ends_of(segment);
    slot = counts[id];
    found = 0u;
    var count = 0u;
    if params.mode == 1u {
        count = counts[id + 1u] - slot;
    } else if (segment.state & DEAD) == 0u && params.stage == NEARER && is_dark(edge_of(segment.number), ends) {
        segment.state |= DEAD;
        segments[2u * id].z = segment.state;
    }
    if (segment.state & DEAD) == 0u && (params.mode == 0u || count > 0u) {
        split(segment, ends);
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
        return;
    }
    sort(count);
    let whole = whole_of(segment);
    let length_m = length(from_to(whole.a, whole.b));
    var before = segment.shares.xy;
    for (var i = 0u; i <= count; i += 1u) {
        var next = segment.shares.zw;
        if i < count {
            next = shares[slot + i];
        }
        var state = segment.state;
        if excess(num_of(next), num_of(before)) * length_m <= SHORTEST_M {
            state |= DEAD;
        }
        let to = 2u * (slot + id + i);
        parts[to] = vec4<u32>(segment.view, segment.kind << 30u | segment.number, state, segment.face);
        parts[to + 1u] = bitcast<vec4<u32>>(vec4<f32>(before, next));
        before = next;
    }
}
