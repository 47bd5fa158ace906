// What a part of an edge that is seen brings: a fragment of each face that meets in it, and whether it throws a shadow. A thread takes one
// part and writes its state: a bit for each half-face with a fragment, and the free side of a silhouette that is lit on both sides.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> segments: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> sizes: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> work: array<u32>;

// The sine of the angle between two unit vectors about an axis, as they turn from the first to the second.
fn turn(a: NumVec, b: NumVec, axis: NumVec) -> f32 {
    return rough(v_dot(v_cross(a, b), axis));
}

// Whether nothing else that meets in an edge hides one of its half-faces next to it.
fn is_lit_beside(edge: Edge, number: u32, at: NumVec) -> bool {
    if edge.halves.y - edge.halves.x == 1u {
        return true;
    }
    let axis = v_unit(v_sub(edge.b, edge.a));
    // What it has along the edge does not count in any turn about the edge, but in its length.
    let d = v_sub(source_of(last_leg), at);
    let to_source = v_unit(v_sub(d, v_scale(axis, v_dot(d, axis))));
    let own = inward_of(number);
    let is_positive = turn(own, to_source, axis) > 0.0;
    let sign = select(-1.0, 1.0, is_positive);
    for (var h = edge.halves.x; h < edge.halves.y; h += 1u) {
        if h == number || !is_lit(last_leg, face_of_half(h)) {
            continue;
        }
        let other = inward_of(h);
        if sign * turn(own, other, axis) > EDGE_ON && sign * turn(other, to_source, axis) > EDGE_ON {
            return false;
        }
    }
    return true;
}

// Where rays leave the last mirror that meet a half-face just off an edge in its plane: beside the edge, on the side that decides, since the
// way from the mirror to the half-face is as good as none. False where the half-face does not rise.
var<private> leaving: NumVec;

fn find_leaving(p: NumVec, edge: Edge, half: NumVec, beside_m: f32) -> bool {
    let normal = mirror_normal(last_leg);
    let rise = v_dot(half, normal);
    let across = v_unit(v_cross(normal, v_sub(edge.b, edge.a)));
    if rough(rise) < EDGE_ON || v_is_zero(across) {
        return false;
    }
    let s = source_of(last_leg);
    let d = v_sub(p, s);
    let back = v_sub(half, v_scale(d, n_div(rise, v_dot(d, normal))));
    let side = select(-beside_m, beside_m, rough(v_dot(back, across)) >= 0.0);
    let on_mirror = v_along(s, d, start_of(last_leg, d));
    leaving = v_add(on_mirror, v_times(across, side));
    return true;
}

fn state_of(segment: Segment) -> u32 {
    let edge = edge_of(segment.number);
    let ends = ends_of(segment);
    let beside_m = beside(ends);
    let is_side = is_side_of_mirror(edge.halves);
    var reached = middle_of(ends);
    if is_side {
        reached = seen_on_mirror(reached);
    }
    var middle = reached;
    // What is as good as in the mirror's plane, and below it, begins where its face comes out of that.
    var is_in_plane = is_side;
    var below = num(0.0);
    if last_leg == 0u {
        if !is_in_window(middle) {
            return segment.state;
        }
    } else {
        let h = mirror_height(last_leg, middle);
        if rough(h) < -flat_m {
            return segment.state;
        }
        is_in_plane = is_in_plane || rough(h) <= flat_m;
        if rough(h) < 0.0 {
            below = h;
            middle = v_sub(middle, v_scale(mirror_normal(last_leg), h));
        }
    }
    var state = segment.state;
    let count = edge.halves.y - edge.halves.x;
    if count > 32u - HALVES {
        trouble |= TOO_MANY_HALVES;
        return state;
    }
    let s = source_of(last_leg);
    let normal = v_unit(v_cross(v_sub(edge.a, s), v_sub(edge.b, edge.a)));
    let free = free_side(edge);
    let has_free = free != 0.0 && !v_is_zero(normal);
    // Every half-face, and then both sides of a silhouette: where only one is lit a nearer one coincides, and its shadow is the same.
    for (var probe = 0u; probe < count + 2u; probe += 1u) {
        var by = middle;
        var p = middle;
        var goal = Goal(NONE, segment.number, edge.halves);
        if probe < count {
            let h = edge.halves.x + probe;
            let face = face_of_half(h);
            if !is_lit(last_leg, face) || !is_lit_beside(edge, h, middle) {
                continue;
            }
            let inward = inward_of(h);
            var base = middle;
            if rough(below) < 0.0 && !is_side {
                let rise = v_dot(mirror_normal(last_leg), inward);
                if rough(rise) > STEEP {
                    base = v_sub(reached, v_scale(inward, n_div(below, rise)));
                }
            }
            p = v_add(base, v_times(inward, beside_m));
            by = p;
            if is_in_plane {
                if !find_leaving(base, edge, inward, beside_m) {
                    continue;
                }
                by = leaving;
            }
            goal = Goal(face, NONE, edge.halves);
        } else {
            if !has_free {
                break;
            }
            p = v_add(middle, v_times(normal, select(-beside_m, beside_m, probe == count)));
            by = p;
        }
        let is_reached = is_path(by, p, goal);
        if probe >= count && !is_reached {
            break;
        }
        if is_reached && probe < count {
            state |= 1u << (HALVES + probe);
        } else if is_reached && probe == count + 1u {
            state |= select(FREE_NEGATIVE, FREE_POSITIVE, free > 0.0);
        }
    }
    return state;
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
    segments[2u * id].z = state_of(segment);
    if params.counts_work != 0u {
        work[id] = tests;
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&sizes[0], trouble);
    }
}
