// Frames of beams and the convex faces that they meet (CONVENTIONS eq. 50-52). Needs polygon.wgsl, the
// binding `records` of the entry point and `body`: three words a face, (normal, offset), (first axis,
// first corner), (second axis, corners | one-sided << 8 | surface << 16), then the corners (place, patch), then two
// words a node of the tree in the order of a walk, (centre, node behind the branch), (half size, first face
// | faces << 24, 0 above the leaves), and for few faces a table of sides; `aspects`: three words, (u, 1 / distance),
// (v, 0), (k, 0), of the transmitter's frame and as many of the receiver's. Places are measured from
// the centre of the target.

struct BeamParams {
    first: u32,
    count: u32,
    // 0 counts, 1 writes; `beam_clip` has a mode of its own.
    mode: u32,
    // 0: from a port to the faces; 1: from one face to another.
    level: u32,
    faces: u32,
    nodes_at: u32,
    go_on: u32,
    last: u32,
    // 1: the port is the receiver.
    port: u32,
    monostatic: u32,
    // More than one; not known to the compiler.
    probe: u32,
    flat: f32,
    eps: f32,
    wavenumber: f32,
    tau: f32,
    nodes: u32,
    // Of this dispatch.
    threads: u32,
    // 0 without a table.
    sides_at: u32,
    // Times that a polygon is halved among threads.
    halvings: u32,
    pad0: u32,
}

// Pieces below this share of the polygon that they were cut from are dropped.
const SLIVER: f32 = 1e-6;
// Cosine below which a face is edge-on.
const GRAZING: f32 = 1e-6;
// Words of a record: (aspect, corners | whole << 8 | bounce << 16), the faces met (8), free (2), the corners.
const RECORD: u32 = 9u;

// Rays through the plane at `c` across `k`, in which (u, v) are measured, from a source that is 1 / inv_d
// behind it; inv_d = 0 is a plane wave.
//
// A mirror takes the frame with it, and then the coordinates (u, v) of a place on the mirror are the same
// before and after, and so is the length of the path there.
struct Frame {
    c: vec3<f32>,
    inv_d: f32,
    u: vec3<f32>,
    v: vec3<f32>,
    k: vec3<f32>,
}

struct Face {
    normal: vec3<f32>,
    offset: f32,
    axis0: vec3<f32>,
    axis1: vec3<f32>,
    first: u32,
    count: u32,
    surface: u32,
    one_sided: bool,
}

fn face_at(i: u32) -> Face {
    let a = body[3u * i];
    let b = body[3u * i + 1u];
    let c = body[3u * i + 2u];
    return Face(
        bitcast<vec3<f32>>(a.xyz),
        bitcast<f32>(a.w),
        bitcast<vec3<f32>>(b.xyz),
        bitcast<vec3<f32>>(c.xyz),
        b.w,
        c.w & 0xffu,
        c.w >> 16u,
        (c.w & 0x100u) != 0u,
    );
}

fn corner_at(i: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(body[3u * params.faces + i].xyz);
}

// The flat patch of a face, by a corner of it.
fn patch_of(f: u32) -> u32 {
    return body[3u * params.faces + body[3u * f + 1u].w].w;
}

fn root_frame(aspect: u32, port: u32) -> Frame {
    let a = aspects[6u * aspect + 3u * port];
    let b = aspects[6u * aspect + 3u * port + 1u];
    let c = aspects[6u * aspect + 3u * port + 2u];
    return Frame(vec3<f32>(), a.w, a.xyz, b.xyz, c.xyz);
}

fn flip(d: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    return d - normal * (2.0 * dot(normal, d));
}

fn mirrored(f: Frame, normal: vec3<f32>, offset: f32) -> Frame {
    let c = f.c - normal * (2.0 * (dot(normal, f.c) - offset));
    return Frame(c, f.inv_d, flip(f.u, normal), flip(f.v, normal), flip(f.k, normal));
}

// The face that a record's beam met at its bounce `b`, counted from 0.
fn chain_at(record: u32, b: u32) -> u32 {
    return records[record + (2u + b) / 4u][(2u + b) & 3u];
}

// The frame behind the first `bounces` mirrors of a record.
fn frame_after(record: u32, bounces: u32) -> Frame {
    var f = root_frame(records[record].x, 0u);
    for (var b = 0u; b < bounces; b += 1u) {
        let w = body[3u * chain_at(record, b)];
        f = mirrored(f, bitcast<vec3<f32>>(w.xyz), bitcast<f32>(w.w));
    }
    return f;
}

fn record_corners(record: u32) -> u32 {
    return records[record].y & 0xffu;
}

fn record_bounce(record: u32) -> u32 {
    return records[record].y >> 16u;
}

fn record_corner(record: u32, i: u32) -> vec2<f32> {
    let w = bitcast<vec4<f32>>(records[record + 3u + i / 2u]);
    return select(w.xy, w.zw, (i & 1u) != 0u);
}

// Makes the record's polygon the one at work.
fn take_record(record: u32) {
    corners = record_corners(record);
    for (var i = 0u; i < corners; i += 1u) {
        ring[i] = record_corner(record, i);
    }
}

// Negative where the plane's front is lit: the cosine at the source, 0 when the face cannot be lit.
fn lit(f: Frame, face: Face) -> f32 {
    let cosine = dot(face.normal, f.k) + f.inv_d * (face.offset - dot(face.normal, f.c));
    let dark = abs(cosine) <= GRAZING || (face.one_sided && cosine > 0.0);
    return select(cosine, 0.0, dark);
}

// (normal, offset) with the normal on the lit side.
fn side_of(face: Face, cosine: f32) -> vec4<f32> {
    let s = vec4<f32>(face.normal, face.offset);
    return select(-s, s, cosine < 0.0);
}

fn project(f: Frame, p: vec3<f32>) -> vec2<f32> {
    let d = p - f.c;
    return vec2<f32>(dot(f.u, d), dot(f.v, d)) / (1.0 + f.inv_d * dot(f.k, d));
}

// Coefficients of nearness a u + b v + c of a plane: the larger, the nearer to the source.
fn nearness(f: Frame, plane: vec4<f32>) -> vec3<f32> {
    let h = plane.w - dot(plane.xyz, f.c);
    let c = vec3<f32>(dot(plane.xyz, f.u), dot(plane.xyz, f.v), -h);
    return c / (dot(plane.xyz, f.k) + f.inv_d * h);
}

// Where the ray at `uv` meets the plane.
fn lift(f: Frame, uv: vec2<f32>, near: vec3<f32>) -> vec3<f32> {
    let q = dot(near.xy, uv) + near.z;
    return f.c + (f.u * uv.x + f.v * uv.y - f.k * q) / (1.0 + f.inv_d * q);
}

// Along the rays, of length 1 at infinity and of distance from the source over that of the plane else.
fn towards(f: Frame, p: vec3<f32>) -> vec3<f32> {
    return f.k + f.inv_d * (p - f.c);
}

// Length of the path to `p` less the distance of the source from its plane.
fn way(f: Frame, p: vec3<f32>) -> f32 {
    let d = p - f.c;
    return (2.0 * dot(f.k, d) + f.inv_d * dot(d, d)) / (length(f.k + f.inv_d * d) + 1.0);
}

const BEFORE: u32 = 0u;
const ACROSS: u32 = 1u;
const BEHIND: u32 = 2u;

// Where face `g` lies against the plane of face `f`, of which `turned` lights the back. BEFORE: wholly on
// the lit side or in the plane.
fn place(g: u32, f: u32, turned: bool) -> u32 {
    var below: bool;
    var above: bool;
    if params.sides_at != 0u {
        let bit = 2u * (f * params.faces + g);
        let sides = body[params.sides_at + bit / 128u][(bit / 32u) & 3u] >> (bit & 31u);
        below = (sides & 1u) != 0u;
        above = (sides & 2u) != 0u;
    } else {
        let plane = bitcast<vec4<f32>>(body[3u * f]);
        let first = body[3u * g + 1u].w;
        let count = body[3u * g + 2u].w & 0xffu;
        var lo = 1e30;
        var hi = -1e30;
        for (var i = 0u; i < count; i += 1u) {
            let d = dot(plane.xyz, corner_at(first + i)) - plane.w;
            lo = min(lo, d);
            hi = max(hi, d);
        }
        below = hi <= params.flat;
        above = lo >= -params.flat;
    }
    if select(below, above, turned) {
        return BEHIND;
    }
    return select(ACROSS, BEFORE, select(above, below, turned));
}

// The edges of a face into `lines`, inside positive.
fn outline(f: Frame, face: Face, cosine: f32) {
    let sense = sign(cosine);
    var a = corner_at(face.first + face.count - 1u);
    for (var i = 0u; i < face.count; i += 1u) {
        let b = corner_at(face.first + i);
        let e = (b - a) * sense;
        let m = cross(towards(f, a), e);
        lines[i] = line_from(dot(m, f.u), dot(m, f.v), dot(f.k, cross(a - f.c, e)));
        a = b;
    }
    line_count = face.count;
}

// Adds the line on whose positive side the rays meet `near` before `far`.
fn add_crossing(f: Frame, near: vec4<f32>, far: vec4<f32>) {
    let q = nearness(f, near) - nearness(f, far);
    lines[line_count] = line_from(q.x, q.y, q.z);
    line_count += 1u;
}

// Half-spaces (normal, offset), where normal . p >= offset, in which faces are looked for.
var<private> walls: mat4x4<f32>;
var<private> ahead_of: vec4<f32>;
var<private> also_ahead_of: vec4<f32>;
var<private> node: u32;

fn wall(f: Frame, axis: vec3<f32>, x: f32, inward: f32) -> vec4<f32> {
    let normal = (axis - f.k * (x * f.inv_d)) * inward;
    return vec4<f32>(normal, dot(normal, f.c) + inward * x - params.flat);
}

// Looks for faces around the rays through the box, on the lit side of two planes.
fn look_within(f: Frame, box: vec4<f32>, side: vec4<f32>, other: vec4<f32>) {
    walls = mat4x4<f32>(
        wall(f, f.u, box.x, 1.0),
        wall(f, f.u, box.z, -1.0),
        wall(f, f.v, box.y, 1.0),
        wall(f, f.v, box.w, -1.0),
    );
    ahead_of = side + vec4<f32>(0.0, 0.0, 0.0, params.flat);
    also_ahead_of = other + vec4<f32>(0.0, 0.0, 0.0, params.flat);
    node = 0u;
}

fn reaches(space: vec4<f32>, centre: vec3<f32>, half: vec3<f32>) -> bool {
    return dot(space.xyz, centre) + dot(abs(space.xyz), half) >= space.w;
}

// The faces (first, behind the last) of the next leaf that reaches into all half-spaces; none when first
// and last agree.
fn next_leaf() -> vec2<u32> {
    while node < params.nodes {
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
            let first = b.w & 0xffffffu;
            return vec2<u32>(first, first + (b.w >> 24u));
        }
    }
    return vec2<u32>();
}

// A driver that ends loops after so many steps of the thread ends this one too early as well.
fn check_steps() {
    var steps = 0u;
    while steps < params.probe {
        steps += 1u;
    }
    if steps != params.probe {
        trouble |= TOO_MANY_STEPS;
    }
}
