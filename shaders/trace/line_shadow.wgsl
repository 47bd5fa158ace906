// The shadow of a segment: the first face behind its free side, on which the plane through source and segment bounds what is lit. A thread
// takes one segment, in which no edge crosses beyond it, and writes the face and its state.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> segments: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> sizes: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> work: array<u32>;

// Whether one of the half-faces at an edge on the outline of the last mirror is met by the rays that leave the mirror beside the edge along
// `d`, where `free` leads to its lit side.
fn rises_into(halves: vec2<u32>, along: NumVec, free: NumVec, d: NumVec) -> bool {
    if last_leg == 0u || halves.x == halves.y {
        return false;
    }
    let axis = v_unit(along);
    let normal = mirror_normal(last_leg);
    let inner = v_unit(v_sub(free, v_scale(normal, v_dot(normal, free))));
    let ray = v_unit(v_sub(d, v_scale(axis, v_dot(d, axis))));
    let sign = select(-1.0, 1.0, rough(v_dot(v_cross(inner, ray), axis)) >= 0.0);
    for (var h = halves.x; h < halves.y; h += 1u) {
        let inward = inward_of(h);
        if is_lit(last_leg, face_of_half(h))
            && sign * rough(v_dot(v_cross(inner, inward), axis)) > EDGE_ON
            && sign * rough(v_dot(v_cross(inward, ray), axis)) > EDGE_ON {
            return true;
        }
    }
    return false;
}

// Unit vector to the lit side of a segment, at right angles to it and to the rays.
fn free_of(segment: Segment, whole: Ends) -> NumVec {
    if segment.kind == OF_WALL {
        let at = params.windows_at + 6u * (segment.number / 4u);
        let u = select(4u, 2u, (segment.number & 2u) == 0u);
        let sign = select(1.0, -1.0, (segment.number & 1u) == 0u);
        return v_unit(v_along(body_vector(at), body_vector(at + u), num(sign)));
    }
    let s = source_of(last_leg);
    let normal = v_unit(v_cross(v_sub(whole.a, s), v_sub(whole.b, whole.a)));
    if segment.kind == OF_EDGE {
        return v_times(normal, select(-1.0, 1.0, (segment.state & FREE_POSITIVE) != 0u));
    }
    let inward = outline_vector(outline_at(segment.number) + 4u);
    return v_times(normal, select(-1.0, 1.0, rough(v_dot(normal, inward)) >= 0.0));
}

fn is_of_patches(halves: vec2<u32>, patch_number: u32) -> bool {
    for (var h = halves.x; h < halves.y; h += 1u) {
        if patch_of(face_of_half(h)) == patch_number {
            return true;
        }
    }
    return false;
}

// Finds the shadow; NONE without.
fn face_behind(segment: Segment, ends: Ends) -> vec2<u32> {
    let nothing = vec2<u32>(NONE, segment.state);
    let s = source_of(last_leg);
    let free = free_of(segment, whole_of(segment));
    if v_is_zero(free) {
        return nothing;
    }
    let beside_m = beside(ends);
    let middle = middle_of(ends);
    let off = v_times(free, beside_m);
    let is_edge = segment.kind == OF_EDGE;
    if segment.kind == OF_WALL && is_in_window(v_sub(middle, v_times(free, BESIDE_M))) {
        return nothing;
    }
    let d = v_sub(v_add(middle, off), s);
    let one = num(1.0);
    let from_s = v_rough(s);
    let to_d = v_rough(d);
    let distance_m = length(to_d);
    let rounding = ROUNDING_M / distance_m;
    var edge = Edge();
    var halves = vec2<u32>();
    // Where the outline of a mirror runs along an edge, what rises there is met by all rays beside it or by none.
    var at_outline = vec2<u32>();
    var along_edge = NONE;
    if is_edge {
        along_edge = segment.number;
        edge = edge_of(segment.number);
        halves = edge.halves;
    } else if segment.kind == OF_OUTLINE {
        along_edge = views[outline_at(segment.number)].w;
        if along_edge != NONE {
            at_outline = edge_of(along_edge).halves;
        }
    }
    if rises_into(at_outline, v_sub(ends.b, ends.a), free, d) {
        return nothing;
    }
    let reach = (length(from_s - middle_of_all) + radius_m) / distance_m * (1.0 + 4.0 * ROUNDED);
    let leaves = start_of(last_leg, d);
    var start = rough(leaves);
    if is_edge {
        start = max(start, 1.0 - SLACK_M / distance_m);
    }
    var best = NONE;
    var best_t = num(0.0);
    // The share up to which one that lies on the best is looked for.
    var best_end = num(reach);
    begin_walk(beam(from_s + to_d * start, from_s + to_d * reach));
    for (var i = next_face(); i != NONE; i = next_face()) {
        if !is_seen_at(last_leg, i, d)
            || is_half_of(halves, i)
            || is_of_patches(at_outline, patch_of(i))
            || !is_lit(last_leg, i) {
            continue;
        }
        let t = meeting_share(last_leg, i, d);
        if !is_share(t) {
            continue;
        }
        let thick = LIES_M / abs(rough(v_dot(normal_of(i), d)));
        var least = leaves;
        if is_edge {
            least = one;
            if excess(t, one) <= rounding {
                least = n_add(one, num(rounding));
                if touches(edge, i, last_leg) {
                    least = n_add(one, num(-2.0 * thick));
                }
            }
        }
        if excess(t, least) < 0.0 || (last_leg > 0u && excess(t, leaves) <= 0.0) {
            continue;
        }
        var is_nearer = best == NONE;
        if !is_nearer && excess(t, best_end) < 0.0 {
            is_nearer = lies_on(i, best) || (excess(t, best_t) < 0.0 && !lies_on(best, i));
        }
        if is_nearer {
            best = i;
            best_t = t;
            best_end = n_add(t, num(thick));
            walked = beam(from_s + to_d * start, from_s + to_d * min(rough(best_end) * (1.0 + 4.0 * ROUNDED), reach));
        }
    }
    if best == NONE {
        return nothing;
    }
    if is_edge {
        // What does not hide the face shades it neither: a line on the road that a smaller one lies on.
        var beyond = 0.0;
        if excess(best_t, one) > 0.0 {
            beyond = excess(n_div(one, best_t), one);
        }
        var is_hidden = false;
        for (var h = halves.x; h < halves.y && !is_hidden; h += 1u) {
            let other = face_of_half(h);
            is_hidden = is_lit(last_leg, other) && hides(last_leg, other, best, beyond, rounding);
        }
        if !is_hidden {
            return nothing;
        }
    }
    var state = segment.state | HIT;
    let is_near = excess(best_t, one) <= rounding;
    if along_edge != NONE && (is_near || (is_edge && touches(edge, best, last_leg))) {
        state |= ALONG;
    }
    // Where the patch ends at the line it is the patch's own edge that bounds it.
    let covered = v_sub(v_sub(middle, off), s);
    if !is_seen_at(last_leg, best, covered) && face_of_patch(last_leg, best, covered) == NONE {
        return nothing;
    }
    return vec2<u32>(best, state);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    begin_numbers(params.zero);
    let id = linear_id(workgroup, workgroups, local, 64u);
    if id >= atomicLoad(&sizes[1u + params.list_in]) {
        return;
    }
    let segment = segment_of(segments[2u * id], segments[2u * id + 1u]);
    if (segment.state & DEAD) != 0u {
        return;
    }
    enter(segment.view);
    let found = face_behind(segment, ends_of(segment));
    segments[2u * id].z = found.y;
    segments[2u * id].w = found.x;
    if params.counts_work != 0u {
        work[id] = tests;
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&sizes[0], trouble);
    }
}
