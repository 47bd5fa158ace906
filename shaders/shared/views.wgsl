// What a radar amid a scene sees, and what its beams see after each mirror, decided in f32. Coordinates (u, v) of a view say on which
// side of a line a corner is, and nothing else: a corner is the pair of lines that it lies on, and the host works its place out from
// these. The host's twin is src/trace/cpu/topology.rs, whose rules hold here.
//
// `body`: three words a face, (normal, offset), (first corner, corners | one-sided << 8, patch, body), (rank by area, area of the patch,
// 0, 0); then the corners (place, the edge that begins there), two words a node of the tree in the order of a walk, (centre, node behind
// the branch), (half size, first face | faces << 24, 0 above the leaves), the edges (from one end to the other, the corner where it
// begins) and a face of each patch, four to a word. Places are seen from the radar, along the axes (k, u, v) of the first window.
// Several scenes may stand behind one another, each with a tree of its own: numbers of faces, corners, nodes, edges and patches count
// through all of them, and no two scenes meet. `views`: six words each, the rows that take a place to (u, v, k), the origin with the view
// before the mirror, (level, first node, node behind the last, bounces) and (flatness of the scene's planes, padding of its boxes, 0, 0).
//
// A line is told by two words, (kind << 28 | level of the view in which it was seen << 24 | number, second number). A side has in bit 31
// of the first on which side of its line the polygon lies: that is known from how faces are wound and is never computed.

// What rounding makes of coordinates: this share of them, and of how far off the view's origin is beside the depth. Tangents nearer to a
// line than the larger of the two outlines' is on it; never less than LEAST_OFF nor more than MOST_OFF. (A fixed tolerance fails: above
// 2e-7 facets of millimetres at 20 m no longer hide, below 1.5e-7 mirrors at 5 m leave gaps.)
const ROUNDED: f32 = 4e-7;
const LEAST_OFF: f32 = 2e-8;
const MOST_OFF: f32 = 5e-7;
// Pieces of less area than this share of what they are cut from are dropped.
const SLIVER: f32 = 1e-11;
// Share of the distances that enter it by which a distance from a plane may be wrong.
const FLAT: f32 = 3e-7;
// What hides others is no narrower than this on the mean.
const THIN: f32 = 1e-7;
// Sine of the angle to the rays below which an edge is seen end-on.
const END_ON: f32 = 1e-5;
// Planes that differ by less in nearness, as a share of it, do not cross in view.
const PARALLEL: f32 = 1e-6;
// A plane of so many square metres, so many times larger than the next one, goes on as if it were endless.
const ENDLESS_M2: f32 = 1.0;
const ENDLESS_RATIO: f32 = 100.0;

const EDGE: u32 = 1u;
const CROSSING: u32 = 2u;
const WALL: u32 = 3u;
// A line along which a polygon of many corners is halved: u (number 0) or v (1) equals the second number, an f32.
const HALVING: u32 = 4u;
// What stands for a wall among the edges of a face.
const OF_WALL: u32 = 0xff0000u;
// Of a side: the polygon lies where its line is negative. Of an edge: it runs against the face's order.
const TURNED: u32 = 0x80000000u;

// Corners that a polygon may have while it is cut, when it is kept, and above which it is halved before it is cut again.
const CAP: u32 = 24u;
const MOST: u32 = 16u;
const MANY: u32 = 12u;
const NONE: u32 = 0xffffffffu;

// What a thread has no room for; the host refuses the result.
const TOO_MANY_CORNERS: u32 = 1u;
const TOO_MANY_STEPS: u32 = 2u;
const NOT_FINITE: u32 = 4u;
var<private> trouble: u32;

// Words of a view.
const VIEW: u32 = 6u;

struct View {
    u: vec4<f32>,
    v: vec4<f32>,
    k: vec4<f32>,
    origin: vec3<f32>,
    level: u32,
    // First node of the scene's tree, and the one behind its last.
    nodes: vec2<u32>,
    // Bounces above which only planes go on beside which the next one is small.
    bounces: u32,
    flat_m: f32,
    pad_m: f32,
}

struct Corner {
    at: vec2<f32>,
    on: vec2<u32>,
    also_on: vec2<u32>,
    side: vec2<u32>,
}

// A line that cuts, positive inside. One at infinity keeps everything (all = 1) or nothing (-1).
struct Cutter {
    at: vec2<f32>,
    normal: vec2<f32>,
    id: vec2<u32>,
    all: f32,
}

fn view_at(i: u32) -> View {
    let o = views[VIEW * i + 3u];
    let scene = views[VIEW * i + 4u];
    let sizes = bitcast<vec4<f32>>(views[VIEW * i + 5u]);
    return View(
        bitcast<vec4<f32>>(views[VIEW * i]),
        bitcast<vec4<f32>>(views[VIEW * i + 1u]),
        bitcast<vec4<f32>>(views[VIEW * i + 2u]),
        bitcast<vec3<f32>>(o.xyz),
        scene.x,
        scene.yz,
        scene.w,
        sizes.x,
        sizes.y,
    );
}

// The view of that level among `view` and those before it.
fn seen_in(view: u32, level: u32) -> u32 {
    var i = view;
    for (var steps = views[VIEW * view + 4u].x; steps > level; steps -= 1u) {
        i = views[VIEW * i + 3u].w;
    }
    return i;
}

fn along(f: View, d: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(f.u.xyz, d), dot(f.v.xyz, d), dot(f.k.xyz, d));
}

fn there(f: View, p: vec3<f32>) -> vec3<f32> {
    return along(f, p) + vec3<f32>(f.u.w, f.v.w, f.k.w);
}

fn plane_of(face: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(body[3u * face]);
}

fn first_corner(face: u32) -> u32 {
    return body[3u * face + 1u].x;
}

fn corners_of(face: u32) -> u32 {
    return body[3u * face + 1u].y & 0xffu;
}

fn patch_of(face: u32) -> u32 {
    return body[3u * face + 1u].z;
}

fn corner_of(i: u32) -> vec4<u32> {
    return body[3u * params.faces + i];
}

// Tells how a plane faces the view: negative where its front is lit. 0 where the face cannot be lit.
fn lit(f: View, face: u32) -> f32 {
    let plane = plane_of(face);
    let facing = plane.w - dot(plane.xyz, f.origin);
    let far = abs(plane.w) + length(f.origin);
    let one_sided = (body[3u * face + 1u].y & 0x100u) != 0u;
    let dark = abs(facing) <= 2.4e-7 * far + 1e-7 || (one_sided && facing > 0.0);
    return select(facing, 0.0, dark);
}

// 1 where a plane's front is lit.
fn front(facing: f32) -> f32 {
    return select(-1.0, 1.0, facing < 0.0);
}

const BEFORE: u32 = 0u;
const ACROSS: u32 = 1u;
const BEHIND: u32 = 2u;

// Where the corners of `face` lie against the plane of `other`, of which `lit_side` 1 says that its front is lit.
fn place(face: u32, other: u32, lit_side: f32, flat: f32) -> u32 {
    let plane = plane_of(other) * lit_side;
    let first = first_corner(face);
    let count = corners_of(face);
    var below = true;
    var above = true;
    for (var i = 0u; i < count; i += 1u) {
        let c = bitcast<vec3<f32>>(corner_of(first + i).xyz);
        let d = dot(plane.xyz, c) - plane.w;
        let near = flat + FLAT * (length(c) + abs(plane.w));
        below = below && d <= near;
        above = above && d >= -near;
    }
    return select(select(ACROSS, BEFORE, above), BEHIND, below);
}

// Whether two faces are of one flat patch: none hides the other, nor does what leaves one meet the other, though corners may be farther
// off their plane than `flat_m`.
fn of_one_patch(g: u32, f: u32) -> bool {
    return body[3u * g + 1u].z == body[3u * f + 1u].z;
}

// Whether a face lies on a larger one of another body.
fn lies_on(face: u32, other: u32) -> bool {
    if body[3u * face + 1u].w == body[3u * other + 1u].w || body[3u * face + 2u].x >= body[3u * other + 2u].x {
        return false;
    }
    let plane = plane_of(other);
    let first = first_corner(face);
    let count = corners_of(face);
    for (var i = 0u; i < count; i += 1u) {
        let c = bitcast<vec3<f32>>(corner_of(first + i).xyz);
        if abs(dot(plane.xyz, c) - plane.w) > params.lies_m {
            return false;
        }
    }
    return true;
}

fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// ---- the outline of a face in a view, cut to its window ----

var<private> outline_count: u32;
var<private> outline_at: array<vec3<f32>, 13>;
// The edge of the side to the next corner, or OF_WALL and the number of a wall; and of the two lines through the corner.
var<private> outline_side: array<u32, 13>;
var<private> outline_on: array<vec2<u32>, 13>;
// False where walls cut something away.
var<private> outline_whole: bool;
// By how much its coordinates may be off.
var<private> outline_off: f32;
// Tangents nearer to a line than this are on it.
var<private> eps: f32;

fn wall(i: u32) -> vec3<f32> {
    let s = select(1.0, -1.0, (i & 1u) != 0u);
    return select(vec3<f32>(s, 0.0, 1.0), vec3<f32>(0.0, s, 1.0), i >= 2u);
}

fn outline_of(f: View, face: u32) {
    let first = first_corner(face);
    let count = corners_of(face);
    outline_count = 0u;
    outline_off = LEAST_OFF;
    outline_whole = true;
    var outside = 0xfu;
    var within = true;
    var last_edge = corner_of(first + count - 1u).w;
    for (var i = 0u; i < count; i += 1u) {
        let c = corner_of(first + i);
        let p = there(f, bitcast<vec3<f32>>(c.xyz));
        outline_at[i] = p;
        outline_side[i] = c.w;
        outline_on[i] = vec2<u32>(last_edge, c.w);
        last_edge = c.w;
        var out = 0u;
        for (var w = 0u; w < 4u; w += 1u) {
            let d = dot(wall(w), p);
            out |= select(0u, 1u << w, d < 0.0);
        }
        outside &= out;
        within = within && out == 0u;
    }
    if outside != 0u {
        return;
    }
    var n = count;
    if !within {
        outline_whole = false;
        for (var w = 0u; w < 4u && n >= 3u; w += 1u) {
            n = outline_within(n, w);
        }
        if n < 3u {
            return;
        }
    }
    // Places without nearness have no coordinates.
    var kept = 0u;
    for (var i = 0u; i < n; i += 1u) {
        let p = outline_at[i];
        if p.z > 0.0 {
            outline_off = max(outline_off, ROUNDED * (abs(p.x) + abs(p.y) + length(f.origin)) / p.z);
            outline_at[kept] = vec3<f32>(p.xy / p.z, 1.0);
            outline_side[kept] = outline_side[i];
            outline_on[kept] = outline_on[i];
            kept += 1u;
        }
    }
    outline_count = kept;
    outline_off = min(outline_off, MOST_OFF);
}

// Cuts `n` corners by a wall; how many are left.
fn outline_within(n: u32, w: u32) -> u32 {
    let normal = wall(w);
    let code = OF_WALL | w;
    let first_at = outline_at[0];
    let first_d = dot(normal, first_at);
    var p = first_at;
    var d = first_d;
    var side = outline_side[0];
    var on = outline_on[0];
    var kept = 0u;
    for (var i = 1u; i <= n; i += 1u) {
        var q = first_at;
        var e = first_d;
        var next_side = 0u;
        var next_on = vec2<u32>();
        if i < n {
            q = outline_at[i];
            e = dot(normal, q);
            next_side = outline_side[i];
            next_on = outline_on[i];
        }
        if d >= 0.0 {
            outline_at[kept] = p;
            outline_side[kept] = select(side, code, d == 0.0 && e < 0.0);
            outline_on[kept] = on;
            kept += 1u;
        }
        if (d < 0.0 && e > 0.0) || (d > 0.0 && e < 0.0) {
            outline_at[kept] = p + (q - p) * (d / (d - e));
            outline_side[kept] = select(side, code, d > 0.0);
            outline_on[kept] = vec2<u32>(side, code);
            kept += 1u;
        }
        // No convex polygon crosses a line more than twice.
        if kept > i + 1u || kept > 12u {
            trouble |= TOO_MANY_CORNERS;
            break;
        }
        p = q;
        d = e;
        side = next_side;
        on = next_on;
    }
    return kept;
}

fn line_id(code: u32, level: u32) -> vec2<u32> {
    let number = code & 0xffffffu;
    let is_wall = number >= OF_WALL;
    return vec2<u32>((select(EDGE, WALL, is_wall) << 28u) | (level << 24u) | select(number, number & 3u, is_wall), 0u);
}

// The same of a side of an outline that runs counter-clockwise where `turn` is positive.
fn side_id(code: u32, level: u32, turn: f32) -> vec2<u32> {
    let is_wall = (code & 0xffffffu) >= OF_WALL;
    let is_turned = !is_wall && ((code & TURNED) != 0u) != (turn < 0.0);
    return line_id(code, level) | vec2<u32>(select(0u, TURNED, is_turned), 0u);
}

// Makes the outline the polygon at work.
fn take_outline(level: u32, turn: f32) {
    corners = outline_count;
    for (var i = 0u; i < corners; i += 1u) {
        let on = outline_on[i];
        let side = side_id(outline_side[i], level, turn);
        ring[i] = Corner(outline_at[i].xy, line_id(on.x, level), line_id(on.y, level), side);
    }
}

// 1 where a lit face runs counter-clockwise in a view, which each mirror turns over; else -1.
fn turn_of(f: View, facing: f32) -> f32 {
    return select(-front(facing), front(facing), (f.level & 1u) != 0u);
}

// ---- lines ----

// A side of a convex polygon, between its neighbours, and whether it runs counter-clockwise (1) or not (-1).
struct Stretch {
    before: vec2<f32>,
    p: vec2<f32>,
    q: vec2<f32>,
    after: vec2<f32>,
    turn: f32,
}

// The line of a side that is an edge. Its plane of view holds the edge, and the ray at `p`: the normal comes from where the edge begins or,
// where that is nearer to end-on, from the ray, so that stretches of one edge have one line. Beyond the vanishing point of an edge the
// ray's has the other sign. An edge that is seen end-on has no direction in f32; then the line is one that leaves the polygon whole.
fn edge_cutter(f: View, id: vec2<u32>, s: Stretch) -> Cutter {
    let edge = body[params.edges_at + (id.x & 0xffffffu)];
    let e = along(f, bitcast<vec3<f32>>(edge.xyz));
    let begins = there(f, bitcast<vec3<f32>>(corner_of(edge.w).xyz));
    let ray = vec3<f32>(s.p, 1.0);
    let here = cross(ray, e) / length(ray);
    let origin = cross(begins, e) / length(begins);
    let size = length(e);
    var m = select(origin, select(here, -here, dot(here, origin) < 0.0), dot(here, here) > dot(origin, origin)).xy;
    let l = length(m);
    if l > END_ON * size {
        return Cutter(s.p, select(m, -m, (id.x & TURNED) != 0u) / l, id, 0.0);
    }
    let d = s.q - s.p;
    let chord = select(s.after - s.before, d, length(d) > 8.0 * eps);
    var inward = vec2<f32>(-chord.y, chord.x) * s.turn;
    if dot(inward, inward) == 0.0 {
        // Of a triangle.
        inward = s.after - s.p;
    }
    let far = length(inward);
    if far < 1e-12 {
        return Cutter(s.p, vec2<f32>(), id, 1.0);
    }
    return Cutter(s.p, inward / far, id, 0.0);
}

// The line of any side of a beam's polygon, as it was seen in the view of its own level.
fn line_of(seen: View, id: vec2<u32>, stretch: Stretch) -> Cutter {
    let kind = (id.x >> 28u) & 7u;
    if kind == EDGE {
        return edge_cutter(seen, id, stretch);
    }
    if kind == CROSSING {
        return crossing(seen, face_of_patch(id.x & 0xffffffu), face_of_patch(id.y), (id.x & TURNED) != 0u);
    }
    let s = select(1.0, -1.0, (id.x & TURNED) != 0u);
    if kind == HALVING {
        let at = bitcast<f32>(id.y);
        let is_u = (id.x & 1u) == 0u;
        return Cutter(select(vec2<f32>(0.0, at), vec2<f32>(at, 0.0), is_u), select(vec2<f32>(0.0, s), vec2<f32>(s, 0.0), is_u), id, 0.0);
    }
    let normal = wall(id.x & 3u).xy;
    return Cutter(-normal, normal * s, id, 0.0);
}

fn face_of_patch(p: u32) -> u32 {
    return body[params.patches_at + p / 4u][p & 3u];
}

// Positive where plane `f` is nearer than plane `g`, or else where it is not.
fn crossing(view: View, f: u32, g: u32, is_turned: bool) -> Cutter {
    let a = plane_of(f);
    let b = plane_of(g);
    let q = along(view, a.xyz) / (a.w - dot(a.xyz, view.origin)) - along(view, b.xyz) / (b.w - dot(b.xyz, view.origin));
    let p0 = patch_of(f);
    let p1 = patch_of(g);
    let turned = select(0u, TURNED, (p0 > p1) != is_turned);
    let id = vec2<u32>(turned | (CROSSING << 28u) | (view.level << 24u) | min(p0, p1), max(p0, p1));
    let s = select(1.0, -1.0, is_turned);
    let across = length(q.xy);
    if across <= PARALLEL * abs(q.z) {
        return Cutter(vec2<f32>(), vec2<f32>(), id, select(-s, s, q.z >= 0.0));
    }
    let normal = q.xy / across;
    return Cutter(normal * (-q.z / across), normal * s, id, 0.0);
}

// The line through the middle of a box, across its longer side.
fn halving(level: u32, box: vec4<f32>) -> Cutter {
    let size = box.zw - box.xy;
    let middle = 0.5 * (box.xy + box.zw);
    let first = (HALVING << 28u) | (level << 24u);
    if size.x >= size.y {
        return Cutter(middle, vec2<f32>(1.0, 0.0), vec2<u32>(first, bitcast<u32>(middle.x)), 0.0);
    }
    return Cutter(middle, vec2<f32>(0.0, 1.0), vec2<u32>(first | 1u, bitcast<u32>(middle.y)), 0.0);
}

fn distance_from(line: Cutter, p: vec2<f32>) -> f32 {
    let d = dot(line.normal, p - line.at);
    return select(select(d, 0.0, abs(d) <= eps), line.all, line.all != 0.0);
}

// ---- the polygon at work ----

var<private> ring: array<Corner, 24>;
var<private> corners: u32;
var<private> distances: array<f32, 24>;

fn area() -> f32 {
    var twice = 0.0;
    let o = ring[0].at;
    for (var i = 2u; i < corners; i += 1u) {
        twice += cross2(ring[i - 1u].at - o, ring[i].at - o);
    }
    return 0.5 * twice;
}

fn bounds() -> vec4<f32> {
    var box = vec4<f32>(ring[0].at, ring[0].at);
    for (var i = 1u; i < corners; i += 1u) {
        let p = ring[i].at;
        box = vec4<f32>(min(box.xy, p), max(box.zw, p));
    }
    return box;
}

const KEEPS_ALL: u32 = 0u;
const KEEPS_NOTHING: u32 = 1u;
const KEEPS_PART: u32 = 2u;

// On which sides of a line the polygon at work lies; `distances` are there for `cut`.
fn sides(line: Cutter) -> u32 {
    var lowest = 0.0;
    var highest = 0.0;
    var low = 0u;
    var high = 0u;
    var changes = 0u;
    var last = 0.0;
    var first = 0.0;
    for (var i = 0u; i < corners; i += 1u) {
        let d = distance_from(line, ring[i].at);
        distances[i] = d;
        if d < lowest {
            lowest = d;
            low = i;
        }
        if d > highest {
            highest = d;
            high = i;
        }
        if d != 0.0 {
            changes += select(0u, 1u, last * d < 0.0);
            last = sign(d);
            first = select(first, last, first == 0.0);
        }
    }
    changes += select(0u, 1u, last * first < 0.0);
    if changes > 2u {
        // Rounding left the polygon not quite convex: what lies on the wrong side between the farthest corners is on the line.
        smooth_distances(high, low, 1.0);
        smooth_distances(low, high, -1.0);
    }
    return select(KEEPS_ALL, select(KEEPS_NOTHING, KEEPS_PART, highest > 0.0), lowest < 0.0);
}

// From one corner on to another the distances fall below zero once, or rise above it with -1.
fn smooth_distances(from_corner: u32, to_corner: u32, way: f32) {
    var i = from_corner;
    var is_across = false;
    for (var n = 0u; n < corners && i != to_corner; n += 1u) {
        let d = distances[i] * way;
        if is_across && d > 0.0 {
            distances[i] = 0.0;
        }
        is_across = is_across || d < 0.0;
        i = select(i + 1u, 0u, i + 1u == corners);
    }
}

// A line whatever lies beside it.
fn untold(id: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(id.x & ~TURNED, id.y);
}

// Keeps the part where the line of `sides` is positive.
fn cut(id: vec2<u32>) {
    let n = corners;
    let first = ring[0];
    var p = first;
    var kept = 0u;
    for (var i = 0u; i < n; i += 1u) {
        let d = distances[i];
        var q = first;
        var e = distances[0];
        if i + 1u < n {
            q = ring[i + 1u];
            e = distances[i + 1u];
        }
        if d >= 0.0 {
            ring[kept] = Corner(p.at, p.on, p.also_on, select(p.side, id, d == 0.0 && e < 0.0));
            kept += 1u;
        }
        if (d < 0.0 && e > 0.0) || (d > 0.0 && e < 0.0) {
            let x = p.at + (q.at - p.at) * (d / (d - e));
            ring[kept] = Corner(x, untold(p.side), untold(id), select(p.side, id, d > 0.0));
            kept += 1u;
        }
        if kept > i + 2u || kept >= CAP {
            trouble |= TOO_MANY_CORNERS;
            break;
        }
        p = q;
    }
    corners = kept;
}

// ---- the tree of faces ----

// Half-spaces (normal, offset), where normal . p >= offset, in which faces are looked for.
var<private> walls: mat4x4<f32>;
var<private> ahead_of: vec4<f32>;
var<private> also_ahead_of: vec4<f32>;
// The next node, the one to stop at, the next face of the last leaf, and how many are left of it.
var<private> node: u32;
var<private> last_node: u32;
var<private> next_face: u32;
var<private> faces_left: u32;
var<private> steps: u32;

fn prism_wall(f: View, axis: vec4<f32>, x: f32, inward: f32) -> vec4<f32> {
    let a = (axis - f.k * x) * inward;
    return vec4<f32>(a.xyz, -a.w - f.pad_m);
}

// Looks for faces around the rays through the box, on the lit side of two planes.
fn look_within(f: View, box: vec4<f32>, side: vec4<f32>, other: vec4<f32>) {
    walls = mat4x4<f32>(
        prism_wall(f, f.u, box.x - 1e-6, 1.0),
        prism_wall(f, f.u, box.z + 1e-6, -1.0),
        prism_wall(f, f.v, box.y - 1e-6, 1.0),
        prism_wall(f, f.v, box.w + 1e-6, -1.0),
    );
    ahead_of = side - vec4<f32>(0.0, 0.0, 0.0, f.pad_m);
    also_ahead_of = other - vec4<f32>(0.0, 0.0, 0.0, f.pad_m);
}

fn reaches(space: vec4<f32>, centre: vec3<f32>, half: vec3<f32>) -> bool {
    return dot(space.xyz, centre) + dot(abs(space.xyz), half) >= space.w;
}

// Whether a face reaches into all half-spaces, as its leaf does.
fn reaches_in(face: u32) -> bool {
    let first = first_corner(face);
    let count = corners_of(face);
    var inside = 0u;
    for (var i = 0u; i < count; i += 1u) {
        let c = bitcast<vec3<f32>>(corner_of(first + i).xyz);
        inside |= select(0u, 1u, dot(walls[0].xyz, c) >= walls[0].w)
            | select(0u, 2u, dot(walls[1].xyz, c) >= walls[1].w)
            | select(0u, 4u, dot(walls[2].xyz, c) >= walls[2].w)
            | select(0u, 8u, dot(walls[3].xyz, c) >= walls[3].w)
            | select(0u, 16u, dot(ahead_of.xyz, c) >= ahead_of.w)
            | select(0u, 32u, dot(also_ahead_of.xyz, c) >= also_ahead_of.w);
    }
    return inside == 63u;
}

// A face is worth so many nodes.
const STEPS_OF_FACE: u32 = 20u;

// Finds the next face whose leaf reaches into all half-spaces into `found_face`. False at the end, and when the thread has taken as many
// steps as it may: then `steps` has come to the budget.
var<private> found_face: u32;
fn find_next() -> bool {
    while faces_left == 0u {
        if node >= last_node || steps >= params.budget {
            return false;
        }
        steps += 1u;
        let a = body[params.nodes_at + 2u * node];
        let b = body[params.nodes_at + 2u * node + 1u];
        let centre = bitcast<vec3<f32>>(a.xyz);
        let half = bitcast<vec3<f32>>(b.xyz);
        let inside = reaches(walls[0], centre, half)
            && reaches(walls[1], centre, half)
            && reaches(walls[2], centre, half)
            && reaches(walls[3], centre, half)
            && reaches(ahead_of, centre, half)
            && reaches(also_ahead_of, centre, half);
        node = select(a.w, node + 1u, inside);
        if inside && b.w != 0u {
            next_face = b.w & 0xffffffu;
            faces_left = b.w >> 24u;
        }
    }
    if steps >= params.budget {
        return false;
    }
    steps += STEPS_OF_FACE;
    found_face = next_face;
    next_face += 1u;
    faces_left -= 1u;
    return true;
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
