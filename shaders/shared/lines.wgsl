// Visibility by lines: the data that the kernels read, and the decisions that they share. The f64 twin is src/trace/cpu/lines.rs, whose
// rules and tolerances hold here. Positions are numbers of at least 48 bits relative to the radar (numbers_f64.wgsl,
// numbers_df64.wgsl), so that a decision 6 nm beside a line is a decision; boxes, and signs beyond rounding, are decided in f32.
//
// `body`, in words of four u32, each part from the offset in the uniform on:
// - faces, 3 words: (normal, offset; upper halves), (the same; lower halves), (first corner, corners | one-sided << 8 | lit << 9, patch,
//   body). `lit`: rays from the radar can meet the face.
// - traits, 1 word a face: (rank by area and body, a face of the patch, 0, 0).
// - corners, 4 words: welded position (upper, lower), position in the file (upper, lower).
// - edges, 4 words: first end (upper, lower), second end (upper, lower). In w: first half-face, half-faces | free side << 30 (0 none,
//   1 positive, 2 negative, as the radar sees it), first piercing, piercings.
// - half-faces, 2 words: inward unit vector (upper; in w the face), (lower).
// - piercings, 1 word: (share of the edge, upper and lower).
// - nodes, 2 words, in the order of a walk: (centre, node behind the branch), (half size, first item | items << 24; 0 above the leaves).
// - scenes, 4 words: (nodes over faces, first and end; nodes over edges, first and end), (first window, windows, first run, 0),
//   (middle of all faces, radius), (flat_m, least height of a lit face, least height over a mirror, 0).
// - windows, 6 words: k, u, v (upper, lower).
// - runs of GROUPS groups of GROUP nodes over edges: boxes around the run and around each group, 2 words: (centre, 0), (half size, 0).
// `views`: 3 words each, (first leg, legs, first fragment of the outline, fragments), (scene, first half-space, half-spaces, first thread
// that asks for groups), (first hull, hulls, 0, 0); legs, 4 words: source (upper; in w the face of the mirror), (lower), normal of the
// mirror and offset (upper), (lower); half-spaces around what is ahead, 2 words: normal and offset (upper), (lower); fragments of
// outlines, 6 words: ends and inward vector (upper, lower), in w of the first the edge along which it runs; hulls, boxes around HULL of
// these each, 2 words: (centre, 0), (half size, 0). A view is one source of rays: the radar, or its image behind the last of a chain of
// mirrors.
// Segments and fragments, 2 words: (view, kind << 30 | number, state, face), (shares from and to, upper and lower).

const TOO_MANY_STEPS: u32 = 2u;
const TOO_MANY_HALVES: u32 = 8u;
var<private> trouble: u32;
// Tests of boxes, faces, edges and fragments of outlines that the thread has made.
var<private> tests: u32;

// ---- numbers ----

fn v_times(a: NumVec, s: f32) -> NumVec {
    return v_scale(a, num(s));
}

// a + b s
fn v_along(a: NumVec, b: NumVec, s: Num) -> NumVec {
    return v_add(a, v_scale(b, s));
}

// The vector at a length of one within rounding of f32; its direction keeps all its digits. Zero remains zero.
fn v_unit(a: NumVec) -> NumVec {
    let v = v_rough(a);
    let size = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if size == 0.0 {
        return a;
    }
    return v_times(a, 1.0 / (size * length(v / size)));
}

fn v_is_zero(a: NumVec) -> bool {
    return all(v_rough(a) == vec3<f32>());
}

// The difference of two positions, as f32.
fn from_to(a: NumVec, b: NumVec) -> vec3<f32> {
    return v_rough(v_sub(b, a));
}

// a - b as f32: its sign is exact.
fn excess(a: Num, b: Num) -> f32 {
    return rough(n_sub(a, b));
}

fn f32s(word: vec4<u32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(word);
}

// ---- the scene ----

fn body_vector(at: u32) -> NumVec {
    return v_of(f32s(body[at]).xyz, f32s(body[at + 1u]).xyz);
}

fn normal_of(face: u32) -> NumVec {
    return body_vector(3u * face);
}

// First corner, corners | one-sided << 8 | lit << 9, patch, body.
fn head_of(face: u32) -> vec4<u32> {
    return body[3u * face + 2u];
}

fn patch_of(face: u32) -> u32 {
    return body[3u * face + 2u].z;
}

// A face of the same patch, in whose plane outlines are given.
fn lead_of(face: u32) -> u32 {
    return body[params.traits_at + face].y;
}

fn welded_corner(i: u32) -> NumVec {
    return body_vector(params.corners_at + 4u * i);
}

fn corner(i: u32) -> NumVec {
    return body_vector(params.corners_at + 4u * i + 2u);
}

// Height over the plane of a face on the side of its normal, m.
fn height(face: u32, p: NumVec) -> Num {
    let hi = f32s(body[3u * face]);
    let lo = f32s(body[3u * face + 1u]);
    return n_sub(v_dot(v_of(hi.xyz, lo.xyz), p), num_of(vec2<f32>(hi.w, lo.w)));
}

// The same in f32, and what it may be off.
fn rough_height(face: u32, p: vec3<f32>) -> vec2<f32> {
    let plane = f32s(body[3u * face]);
    return vec2<f32>(dot(plane.xyz, p) - plane.w, ROUNDED * (length(p) + abs(plane.w)));
}

struct Edge {
    a: NumVec,
    b: NumVec,
    // First and end.
    halves: vec2<u32>,
    piercings: vec2<u32>,
    free: u32,
}

fn edge_of(number: u32) -> Edge {
    let at = params.edges_at + 4u * number;
    let count = body[at + 1u].w;
    let first = body[at].w;
    let pierced = body[at + 2u].w;
    return Edge(
        body_vector(at),
        body_vector(at + 2u),
        vec2<u32>(first, first + (count & 0x3fffffffu)),
        vec2<u32>(pierced, pierced + body[at + 3u].w),
        count >> 30u,
    );
}

fn inward_of(half: u32) -> NumVec {
    return body_vector(params.halves_at + 2u * half);
}

fn face_of_half(half: u32) -> u32 {
    return body[params.halves_at + 2u * half].w;
}

fn is_half_of(halves: vec2<u32>, face: u32) -> bool {
    for (var h = halves.x; h < halves.y; h += 1u) {
        if face_of_half(h) == face {
            return true;
        }
    }
    return false;
}

// Whether a smaller face is on the plane of a larger one of another body: then it is lit and the other is not (CONVENTIONS eq. 65b).
fn lies_on(face: u32, other: u32) -> bool {
    let head = head_of(face);
    if head.w == head_of(other).w || body[params.traits_at + face].x >= body[params.traits_at + other].x {
        return false;
    }
    let count = head.y & 0xffu;
    for (var i = 0u; i < count; i += 1u) {
        let p = corner(head.x + i);
        let about = rough_height(other, v_rough(p));
        if abs(about.x) > LIES_M + about.y || abs(rough(height(other, p))) > LIES_M {
            return false;
        }
    }
    return true;
}

// ---- views ----

var<private> first_leg: u32;
var<private> last_leg: u32;
var<private> outline: vec2<u32>;
var<private> hulls: vec2<u32>;
var<private> face_nodes: vec2<u32>;
var<private> edge_nodes: vec2<u32>;
var<private> windows: vec2<u32>;
var<private> middle_of_all: vec3<f32>;
var<private> radius_m: f32;
var<private> flat_m: f32;
var<private> grazing_m: f32;
var<private> above_m: f32;

fn enter(view: u32) {
    let head = views[3u * view];
    first_leg = head.x;
    last_leg = head.y - 1u;
    outline = head.zw;
    hulls = views[3u * view + 2u].xy;
    let scene = params.scenes_at + 4u * views[3u * view + 1u].x;
    face_nodes = body[scene].xy;
    edge_nodes = body[scene].zw;
    windows = body[scene + 1u].xy;
    let all = f32s(body[scene + 2u]);
    middle_of_all = all.xyz;
    radius_m = all.w;
    let limits = f32s(body[scene + 3u]);
    flat_m = limits.x;
    grazing_m = limits.y;
    above_m = limits.z;
}

fn leg_at(leg: u32) -> u32 {
    return params.legs_at + 4u * (first_leg + leg);
}

fn source_of(leg: u32) -> NumVec {
    let at = leg_at(leg);
    return v_of(f32s(views[at]).xyz, f32s(views[at + 1u]).xyz);
}

// The face in whose plane the leg leaves its mirror; of legs but the first.
fn mirror_of(leg: u32) -> u32 {
    return views[leg_at(leg)].w;
}

fn mirror_normal(leg: u32) -> NumVec {
    let at = leg_at(leg);
    return v_of(f32s(views[at + 2u]).xyz, f32s(views[at + 3u]).xyz);
}

// Height over the mirror that a leg leaves, on its lit side, m.
fn mirror_height(leg: u32, p: NumVec) -> Num {
    let at = leg_at(leg);
    let hi = f32s(views[at + 2u]);
    let lo = f32s(views[at + 3u]);
    return n_sub(v_dot(v_of(hi.xyz, lo.xyz), p), num_of(vec2<f32>(hi.w, lo.w)));
}

fn can_meet(leg: u32, face: u32) -> bool {
    let h = rough(height(face, source_of(leg)));
    let head = head_of(face);
    if abs(h) <= grazing_m || ((head.y & 0x100u) != 0u && h < 0.0) {
        return false;
    }
    if leg == 0u {
        return true;
    }
    if patch_of(mirror_of(leg)) == head.z {
        return false;
    }
    let count = head.y & 0xffu;
    for (var i = 0u; i < count; i += 1u) {
        if rough(mirror_height(leg, corner(head.x + i))) > above_m {
            return true;
        }
    }
    return false;
}

// Whether rays of a leg can meet a face.
fn is_lit(leg: u32, face: u32) -> bool {
    if leg == 0u {
        return (head_of(face).y & 0x200u) != 0u;
    }
    return can_meet(leg, face);
}

fn has_lit_half(leg: u32, halves: vec2<u32>) -> bool {
    for (var h = halves.x; h < halves.y; h += 1u) {
        if is_lit(leg, face_of_half(h)) {
            return true;
        }
    }
    return false;
}

// The side of the plane through the source and an edge that nothing at the edge covers: 1 and -1 of (a - source) x (b - source), 0 where
// the edge is no silhouette.
fn free_side(edge: Edge) -> f32 {
    if last_leg == 0u {
        return select(select(0.0, -1.0, edge.free == 2u), 1.0, edge.free == 1u);
    }
    let s = source_of(last_leg);
    let normal = v_unit(v_cross(v_sub(edge.a, s), v_sub(edge.b, edge.a)));
    if v_is_zero(normal) {
        return 0.0;
    }
    let in_plane =
        abs(rough(mirror_height(last_leg, edge.a))) <= flat_m
            && abs(rough(mirror_height(last_leg, edge.b))) <= flat_m;
    var above = false;
    var below = false;
    for (var h = edge.halves.x; h < edge.halves.y; h += 1u) {
        let inward = inward_of(h);
        // In the plane of the mirror only what rises from it counts.
        let rises = !in_plane || rough(v_dot(mirror_normal(last_leg), inward)) > EDGE_ON;
        if rises && is_lit(last_leg, face_of_half(h)) {
            let sine = rough(v_dot(normal, inward));
            above = above || sine > EDGE_ON;
            below = below || sine < -EDGE_ON;
        }
    }
    if above == below {
        return 0.0;
    }
    return select(1.0, -1.0, above);
}

fn touches(edge: Edge, face: u32, leg: u32) -> bool {
    if abs(rough(height(face, edge.a))) <= flat_m && abs(rough(height(face, edge.b))) <= flat_m {
        return true;
    }
    for (var h = edge.halves.x; h < edge.halves.y; h += 1u) {
        let other = face_of_half(h);
        if is_lit(leg, other) && lies_on(other, face) {
            return true;
        }
    }
    return false;
}

fn is_in_window(p: NumVec) -> bool {
    let about = v_rough(p);
    let off = ROUNDED * length(about);
    for (var w = windows.x; w < windows.x + windows.y; w += 1u) {
        let at = params.windows_at + 6u * w;
        let k = dot(f32s(body[at]).xyz, about);
        let side = max(abs(dot(f32s(body[at + 2u]).xyz, about)), abs(dot(f32s(body[at + 4u]).xyz, about)));
        if k < -off || k - side < -2.0 * off {
            continue;
        }
        if k > off && k - side > 2.0 * off {
            return true;
        }
        let along = v_dot(body_vector(at), p);
        let u = v_dot(body_vector(at + 2u), p);
        let v = v_dot(body_vector(at + 4u), p);
        let in_u = min(excess(along, u), excess(along, n_neg(u)));
        let in_v = min(excess(along, v), excess(along, n_neg(v)));
        if rough(along) > 0.0 && min(in_u, in_v) >= 0.0 {
            return true;
        }
    }
    return false;
}

// ---- rays ----

// Whether the ray from a source in a direction meets a face, by the sides of the face as the source sees them.
fn is_seen_at(leg: u32, face: u32, d: NumVec) -> bool {
    let s = source_of(leg);
    let about_height = rough_height(face, v_rough(s));
    var sign = -about_height.x;
    if abs(sign) <= about_height.y {
        sign = -rough(height(face, s));
    }
    sign = select(-1.0, 1.0, sign >= 0.0);
    let head = head_of(face);
    let count = head.y & 0xffu;
    var before = welded_corner(head.x + count - 1u);
    for (var i = 0u; i < count; i += 1u) {
        let next = welded_corner(head.x + i);
        let a = from_to(s, before);
        let b = from_to(s, next);
        let about = sign * dot(cross(a, b), v_rough(d));
        let off = ROUNDED * length(a) * length(b) * length(v_rough(d));
        if about < -off {
            return false;
        }
        if about <= off {
            let normal = v_cross(v_sub(before, s), v_sub(next, before));
            if sign * rough(v_dot(normal, d)) < 0.0 {
                return false;
            }
        }
        before = next;
    }
    return true;
}

// Share of `d` at which rays of a leg leave their mirror.
fn start_of(leg: u32, d: NumVec) -> Num {
    if leg == 0u {
        return num(0.0);
    }
    return n_neg(n_div(mirror_height(leg, source_of(leg)), v_dot(mirror_normal(leg), d)));
}

// Share of `d` at which a ray from a source meets the plane of a face.
fn meeting_share(leg: u32, face: u32, d: NumVec) -> Num {
    return n_neg(n_div(height(face, source_of(leg)), v_dot(normal_of(face), d)));
}

fn is_share(t: Num) -> bool {
    return rough(t) > 0.0 && rough(t) < 1e30;
}

// Min and max height of a face's corners over another's plane, m, on the side from which a leg's source sees that one.
fn heights(leg: u32, face: u32, plane: u32) -> vec2<f32> {
    let side = select(-1.0, 1.0, rough(height(plane, source_of(leg))) > 0.0);
    let head = head_of(face);
    let count = head.y & 0xffu;
    var found = vec2<f32>(1e30, -1e30);
    for (var i = 0u; i < count; i += 1u) {
        let h = side * rough(height(plane, corner(head.x + i)));
        found = vec2<f32>(min(found.x, h), max(found.y, h));
    }
    return found;
}

// Whether a face that a ray of a leg meets hides the target. `beyond` is the share of the distance to the target at which it is met, less
// one.
fn hides(leg: u32, other: u32, target_face: u32, beyond: f32, rounding: f32) -> bool {
    if lies_on(target_face, other) {
        return false;
    }
    if lies_on(other, target_face) {
        return true;
    }
    let over = heights(leg, other, target_face);
    if over.y <= flat_m {
        return false;
    }
    if over.x >= -flat_m {
        // Where it stands on the target it may reach behind that by rounding.
        return beyond <= 0.0;
    }
    let under = heights(leg, target_face, other);
    return under.x < -flat_m && (under.y <= flat_m || beyond < -rounding);
}

// A segment in f32, and how much larger boxes are taken so that rounding loses none.
struct Beam {
    middle: vec3<f32>,
    half: vec3<f32>,
    pad: f32,
}

fn beam(a: vec3<f32>, b: vec3<f32>) -> Beam {
    let middle = 0.5 * (a + b);
    let half = 0.5 * (b - a);
    return Beam(middle, half, 1e-5 + 2.0 * ROUNDED * (length(middle) + length(half)));
}

// Whether the plane of a face may cross a segment.
fn is_crossed(s: Beam, face: u32) -> bool {
    let plane = f32s(body[3u * face]);
    let h = dot(plane.xyz, s.middle) - plane.w;
    return abs(h) <= abs(dot(plane.xyz, s.half)) + s.pad + ROUNDED * abs(plane.w);
}

fn misses_beam(s: Beam, centre: vec3<f32>, size: vec3<f32>) -> bool {
    let d = s.middle - centre;
    let reach = abs(s.half);
    let padded = size + s.pad;
    let turned = padded.yzx * reach.zxy + padded.zxy * reach.yzx;
    return any(abs(d) > padded + reach) || any(abs(cross(s.half, d)) > turned);
}

// A walk over the faces whose boxes and planes a segment may cross. Boxes and planes are all that it asks, so that threads that are at
// different nodes do the same work.
var<private> walked: Beam;
var<private> walk_node: u32;
var<private> walk_face: u32;
var<private> walk_left: u32;

fn begin_walk(along: Beam) {
    walked = along;
    walk_node = face_nodes.x;
    walk_left = 0u;
}

// The next face, or NONE.
fn next_face() -> u32 {
    loop {
        tests += 1u;
        if walk_left > 0u {
            let face = walk_face;
            walk_face += 1u;
            walk_left -= 1u;
            if is_crossed(walked, face) {
                return face;
            }
            continue;
        }
        if walk_node >= face_nodes.y {
            return NONE;
        }
        let a = body[params.nodes_at + 2u * walk_node];
        let b = body[params.nodes_at + 2u * walk_node + 1u];
        if misses_beam(walked, f32s(a).xyz, f32s(b).xyz) {
            walk_node = a.w;
        } else {
            walk_node += 1u;
            walk_face = b.w & 0xffffffu;
            walk_left = b.w >> 24u;
        }
    }
    return NONE;
}

// What a ray is to reach: a position on a face, or beside the edge `edge` where the face is NONE. Half-faces at `skip` do not hide it.
struct Goal {
    face: u32,
    edge: u32,
    skip: vec2<u32>,
}

// Whether a ray of a leg reaches its goal.
fn reaches(leg: u32, p: NumVec, goal: Goal) -> bool {
    let s = source_of(leg);
    let d = v_sub(p, s);
    let start = start_of(leg, d);
    let rounding = ROUNDING_M / length(v_rough(d));
    var own = NONE;
    // The share of the distance behind the goal at which something still may hide it: what lies on a face may be a little behind it.
    var margin = -rounding;
    if goal.face != NONE {
        own = patch_of(goal.face);
        margin = LIES_M / abs(rough(v_dot(normal_of(goal.face), d)));
    }
    begin_walk(beam(
        v_rough(s) + v_rough(d) * rough(start),
        v_rough(p) + v_rough(d) * clamp(margin, 0.0, 1e6),
    ));
    for (var i = next_face(); i != NONE; i = next_face()) {
        if patch_of(i) == own || !is_seen_at(leg, i, d) || is_half_of(goal.skip, i) || !is_lit(leg, i) {
            continue;
        }
        let t = meeting_share(leg, i, d);
        let beyond = excess(t, num(1.0));
        if !is_share(t) || excess(t, start) <= 0.0 || beyond >= margin {
            continue;
        }
        var is_hidden = false;
        if goal.face != NONE {
            is_hidden = hides(leg, i, goal.face, beyond, rounding);
        } else {
            is_hidden = !touches(edge_of(goal.edge), i, leg);
        }
        if is_hidden {
            return false;
        }
    }
    return true;
}

// The face of the patch of `on` that the ray from a leg's source in a direction meets, or NONE.
fn face_of_patch(leg: u32, on: u32, d: NumVec) -> u32 {
    let s = source_of(leg);
    let p = v_rough(v_along(s, d, meeting_share(leg, on, d)));
    let pad = LIES_M + 1e-5 + 2.0 * ROUNDED * length(p);
    let own = patch_of(on);
    var node = face_nodes.x;
    while node < face_nodes.y {
        tests += 1u;
        let a = body[params.nodes_at + 2u * node];
        let b = body[params.nodes_at + 2u * node + 1u];
        if any(abs(p - f32s(a).xyz) > f32s(b).xyz + pad) {
            node = a.w;
            continue;
        }
        node += 1u;
        let first = b.w & 0xffffffu;
        for (var i = first; i < first + (b.w >> 24u); i += 1u) {
            if patch_of(i) == own && is_seen_at(leg, i, d) {
                return i;
            }
        }
    }
    return NONE;
}

// Where the path to a position of the last leg meets the mirror that each leg leaves.
var<private> on_mirrors: array<NumVec, 9>;

// Whether the legs before the last lead to a position `by`, and the last one reaches its goal at `p`. With a goal that names neither a face
// nor an edge the legs before are all that is asked.
fn is_path(by: NumVec, p: NumVec, goal: Goal) -> bool {
    var at = by;
    for (var leg = last_leg; leg > 0u; leg -= 1u) {
        let s = source_of(leg);
        let d = v_sub(at, s);
        let share = start_of(leg, d);
        if !(rough(share) > 0.0) || excess(share, num(1.0)) > ON_MIRROR {
            return false;
        }
        at = v_along(s, d, share);
        on_mirrors[leg] = at;
    }
    if !is_in_window(at) {
        return false;
    }
    for (var leg = 0u; leg <= last_leg; leg += 1u) {
        var end = p;
        var next = goal;
        if leg < last_leg {
            end = on_mirrors[leg + 1u];
            next = Goal(face_of_patch(leg, mirror_of(leg + 1u), v_sub(end, source_of(leg))), NONE, vec2<u32>());
        }
        if next.face == NONE && next.edge == NONE {
            return leg == last_leg;
        }
        if !reaches(leg, end, next) {
            return false;
        }
    }
    return true;
}

// ---- segments ----

struct Segment {
    view: u32,
    kind: u32,
    number: u32,
    state: u32,
    face: u32,
    shares: vec4<f32>,
}

fn segment_of(head: vec4<u32>, shares: vec4<u32>) -> Segment {
    return Segment(head.x, head.y >> 30u, head.y & 0x3fffffffu, head.z, head.w, f32s(shares));
}

struct Ends {
    a: NumVec,
    b: NumVec,
}

fn outline_vector(at: u32) -> NumVec {
    return v_of(f32s(views[at]).xyz, f32s(views[at + 1u]).xyz);
}

fn outline_at(number: u32) -> u32 {
    return params.outlines_at + 6u * number;
}

// Both ends of what a segment is a part of.
fn whole_of(segment: Segment) -> Ends {
    if segment.kind == OF_EDGE {
        let at = params.edges_at + 4u * segment.number;
        return Ends(body_vector(at), body_vector(at + 2u));
    }
    if segment.kind == OF_OUTLINE {
        let at = outline_at(segment.number);
        return Ends(outline_vector(at), outline_vector(at + 2u));
    }
    // A wall of a window: the number is 4 times the window's, and 0 and 1 for its sides at +u and -u, 2 and 3 for +v and -v.
    let at = params.windows_at + 6u * (segment.number / 4u);
    let u = select(4u, 2u, (segment.number & 2u) == 0u);
    let sign = select(-1.0, 1.0, (segment.number & 1u) == 0u);
    let side = v_along(body_vector(at), body_vector(at + u), num(sign));
    let v = body_vector(at + 6u - u);
    return Ends(v_add(side, v), v_sub(side, v));
}

fn ends_of(segment: Segment) -> Ends {
    let whole = whole_of(segment);
    let along = v_sub(whole.b, whole.a);
    let from_share = num_of(segment.shares.xy);
    let to_share = num_of(segment.shares.zw);
    return Ends(v_along(whole.a, along, from_share), v_along(whole.a, along, to_share));
}

fn length_of(ends: Ends) -> f32 {
    return length(from_to(ends.a, ends.b));
}

fn middle_of(ends: Ends) -> NumVec {
    return v_times(v_add(ends.a, ends.b), 0.5);
}

// How far beside a segment a ray decides, m.
fn beside(ends: Ends) -> f32 {
    return min(BESIDE_M, BESIDE * length_of(ends));
}

// Whether an edge is a side of the last mirror.
fn is_side_of_mirror(halves: vec2<u32>) -> bool {
    if last_leg == 0u {
        return false;
    }
    let own = patch_of(mirror_of(last_leg));
    for (var h = halves.x; h < halves.y; h += 1u) {
        if patch_of(face_of_half(h)) == own {
            return true;
        }
    }
    return false;
}

// Where the ray from the source before the last mirror to a position meets the mirror's plane.
fn seen_on_mirror(p: NumVec) -> NumVec {
    let s = source_of(last_leg - 1u);
    let start = mirror_height(last_leg, s);
    let end = mirror_height(last_leg, p);
    return v_along(s, v_sub(p, s), n_div(start, n_sub(start, end)));
}

// A driver that ends loops after so many steps of the thread ends this one too early as well.
fn check_steps() {
    var taken = 0u;
    while taken < params.probe {
        taken += 1u;
    }
    if taken != params.probe {
        trouble |= TOO_MANY_STEPS;
    }
}
