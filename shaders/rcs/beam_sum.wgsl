// What each polygon of a list radiates to the receiver (CONVENTIONS eq. 53, 54): the part of it that the
// receiver sees, cut into cells where the phase is curved, each integrated in closed form. A thread takes
// one polygon, or the share of it that its number tells: bit d says which half it follows at the d-th cut.

@group(0) @binding(0) var<uniform> params: BeamParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> aspects: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> records: array<vec4<u32>>;
// What the receiver sees, and where the pieces of each aspect and face begin.
@group(0) @binding(4) var<storage, read> seen: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> seen_from: array<u32>;
@group(0) @binding(6) var<storage, read> surfaces: array<vec4<f32>>;
// S_vv, S_hv; S_vh, S_hh; or (NO_SUM, what the thread had no room for, 0, 0) twice.
@group(0) @binding(7) var<storage, read_write> sums: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> scratch: array<vec2<f32>>;

// Stands where a thread has no sum: every adapter binds eight buffers, and a ninth for troubles is not among them. No
// sum is so large: its square is not a number of f32.
const NO_SUM: f32 = 3e38;
// Phase across a polygon below which its integral is taken from its moments, rad.
const SMALL_PHASE: f32 = 0.05;
// Cells are at most this share of the distance to the nearer port.
const CELL_TO_DISTANCE: f32 = 0.01;
const TURNS: f32 = 0.159154943;

struct Moments {
    area: f32,
    sense: f32,
    centroid: vec2<f32>,
    // Mean of xx, yy and xy about the centroid.
    second: vec3<f32>,
}

// Of the polygon at work.
fn moments() -> Moments {
    let o = ring[0];
    var area = 0.0;
    var first = vec2<f32>();
    var second = vec3<f32>();
    var a = ring[1] - o;
    for (var i = 2u; i < corners; i += 1u) {
        let b = ring[i] - o;
        let t = 0.5 * cross2(a, b);
        area += t;
        first += (a + b) * (t / 3.0);
        second += t * vec3<f32>(
            (a.x * a.x + b.x * b.x + a.x * b.x) / 6.0,
            (a.y * a.y + b.y * b.y + a.y * b.y) / 6.0,
            (2.0 * a.x * a.y + 2.0 * b.x * b.y + a.x * b.y + a.y * b.x) / 12.0,
        );
        a = b;
    }
    if area == 0.0 {
        return Moments(0.0, 1.0, o, vec3<f32>());
    }
    let c = first / area;
    return Moments(
        abs(area),
        sign(area),
        o + c,
        second / area - vec3<f32>(c.x * c.x, c.y * c.y, c.x * c.y),
    );
}

// Integral of exp(j g . (p - centroid)) over the polygon at work (Gordon 1975).
fn phase_integral(m: Moments, g: vec2<f32>) -> vec2<f32> {
    var reach = 0.0;
    var sum = vec2<f32>();
    var a = ring[corners - 1u] - m.centroid;
    for (var i = 0u; i < corners; i += 1u) {
        let b = ring[i] - m.centroid;
        let e = b - a;
        reach = max(reach, abs(dot(g, b)));
        sum += cis_turns_f(dot(g, 0.5 * (a + b)) * TURNS) * (cross2(g, e) * sinc(0.5 * dot(g, e)));
        a = b;
    }
    if reach < SMALL_PHASE {
        let q = g.x * g.x * m.second.x + g.y * g.y * m.second.y + 2.0 * g.x * g.y * m.second.z;
        return vec2<f32>(m.area * (1.0 - 0.5 * q), 0.0);
    }
    // 1/(j g^2) of the outline's flux; clockwise outlines count negative.
    return vec2<f32>(sum.y, -sum.x) * (m.sense / dot(g, g));
}

// Keeps what lies in a piece of `seen`. Edges of no length have no direction and are passed over.
fn overlap(piece: u32) {
    let n = seen[piece].y & 0xffu;
    var twice = 0.0;
    let o = seen_corner(piece, 0u);
    var a = seen_corner(piece, 1u) - o;
    for (var i = 2u; i < n; i += 1u) {
        let b = seen_corner(piece, i) - o;
        twice += cross2(a, b);
        a = b;
    }
    let sense = sign(twice);
    var p = seen_corner(piece, n - 1u);
    for (var i = 0u; i < n; i += 1u) {
        let q = seen_corner(piece, i);
        let e = (q - p) * sense;
        if length(e) > 10.0 * params.eps {
            // Left of an edge is inside when the polygon runs counter-clockwise.
            cut(line_from(-e.y, e.x, e.y * p.x - e.x * p.y), params.eps, false);
        }
        p = q;
    }
}

fn seen_corner(piece: u32, i: u32) -> vec2<f32> {
    let w = bitcast<vec4<f32>>(seen[piece + 3u + i / 2u]);
    return select(w.xy, w.zw, (i & 1u) != 0u);
}

// What a place radiates per area and phase: S_vv, S_hv; S_vh, S_hh.
struct Matrix {
    v: vec4<f32>,
    h: vec4<f32>,
}

// At `uv` of the record's beam, to the receiver in direction `s`.
fn matrix(record: u32, uv: vec2<f32>, s: vec3<f32>) -> Matrix {
    let bounces = record_bounce(record);
    let root = root_frame(records[record].x, 0u);
    var dir = normalize(root.k + root.inv_d * (root.u * uv.x + root.v * uv.y));
    var field_v = CVec3(v_of(-dir), vec3<f32>());
    var field_h = CVec3(h_of(-dir), vec3<f32>());
    let v = v_of(s);
    let h = h_of(s);
    var out = Matrix();
    for (var b = 0u; b < bounces; b += 1u) {
        let face = face_at(chain_at(record, b));
        let normal = select(face.normal, -face.normal, dot(face.normal, dir) > 0.0);
        let next = flip(dir, normal);
        let m = mirror(dir, next, normal, face.surface, params.wavenumber);
        let after_v = reflected(m, field_v);
        let after_h = reflected(m, field_h);
        if b + 1u == bounces {
            out = Matrix(
                radiated(m, field_v, after_v, s, v, h),
                radiated(m, field_h, after_h, s, v, h),
            );
        }
        dir = next;
        field_v = after_v;
        field_h = after_h;
    }
    return out;
}

fn times(m: vec4<f32>, z: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(cmul(m.xy, z), cmul(m.zw, z));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    scratch_thread = linear_id(workgroup, workgroups, local, 64u);
    scratch_threads = params.threads;
    let id = params.first + scratch_thread;
    if scratch_thread >= params.threads || id >= params.count {
        return;
    }
    let record = (id >> params.halvings) * RECORD;
    let share = id & ((1u << params.halvings) - 1u);
    let bounce = record_bounce(record);
    let aspect = records[record].x;
    let index = chain_at(record, bounce - 1u);
    let face = face_at(index);
    let f = frame_after(record, bounce - 1u);
    let receiver = root_frame(aspect, 1u);
    let corner = corner_at(face.first);
    let near = nearness(f, vec4<f32>(face.normal, face.offset));
    let side = side_of(face, dot(face.normal, towards(f, corner)));

    var first_piece = 0u;
    var last_piece = 1u;
    var direct = bounce == 1u && params.monostatic != 0u;
    if !direct {
        first_piece = seen_from[aspect * params.faces + index];
        last_piece = seen_from[aspect * params.faces + index + 1u];
        if first_piece == last_piece || dot(side.xyz, towards(receiver, corner)) >= 0.0 {
            last_piece = first_piece;
        } else if (seen[first_piece * RECORD].y & 0x100u) != 0u {
            direct = true;
            last_piece = first_piece + 1u;
        }
    }
    let receiver_near = nearness(receiver, vec4<f32>(face.normal, face.offset));
    let k = params.wavenumber;
    var sum_v = vec4<f32>();
    var sum_h = vec4<f32>();
    for (var piece = first_piece; piece < last_piece; piece += 1u) {
        take_record(record);
        if !direct {
            for (var i = 0u; i < corners; i += 1u) {
                ring[i] = project(receiver, lift(f, ring[i], near));
            }
            let least = SLIVER * abs(area());
            overlap(piece * RECORD);
            if abs(area()) <= least {
                continue;
            }
        }
        for (var i = 0u; i < corners; i += 1u) {
            var p: vec3<f32>;
            if direct {
                p = lift(f, ring[i], near);
            } else {
                p = lift(receiver, ring[i], receiver_near);
            }
            ring[i] = vec2<f32>(dot(face.axis0, p - corner), dot(face.axis1, p - corner));
        }
        // The pool is a stack of cells, halved until the quadratic phase across each is below tau.
        pieces = 0u;
        var depth = 0u;
        loop {
            let m = moments();
            let p = corner + face.axis0 * m.centroid.x + face.axis1 * m.centroid.y;
            let there = towards(f, p);
            let back = towards(receiver, p);
            let bends = vec2<f32>(f.inv_d / length(there), receiver.inv_d / length(back));
            let a = normalize(there);
            let b = normalize(back);
            let a2 = vec2<f32>(dot(a, face.axis0), dot(a, face.axis1));
            let b2 = vec2<f32>(dot(b, face.axis0), dot(b, face.axis1));
            let bend = bends.x * (1.0 - a2 * a2) + bends.y * (1.0 - b2 * b2);
            let mixed = -(bends.x * a2.x * a2.y + bends.y * b2.x * b2.y);
            let nearest = max(bends.x, bends.y);
            if nearest > 0.0 {
                var worst = 0.0;
                var worst_across = vec2<f32>();
                var farthest = 0.0;
                var farthest_across = vec2<f32>();
                for (var i = 0u; i < corners; i += 1u) {
                    let d = ring[i] - m.centroid;
                    let curved = bend * d + mixed * d.yx;
                    // A corner is off along both axes at once, so it may have twice the phase of one.
                    let phase = 0.25 * k * abs(dot(d, curved));
                    if phase > worst {
                        worst = phase;
                        worst_across = curved;
                    }
                    if length(d) > farthest {
                        farthest = length(d);
                        farthest_across = d;
                    }
                }
                if worst > params.tau || farthest * nearest > CELL_TO_DISTANCE {
                    let across = select(farthest_across, worst_across, worst > params.tau);
                    if corners > MOST {
                        stash();
                        pieces -= 1u;
                        take(pieces);
                    } else {
                        cut(line_from(across.x, across.y, -dot(across, m.centroid)), 0.0, true);
                        append(0.0);
                    }
                    if depth < params.halvings {
                        if (share >> depth & 1u) != 0u && pieces > 0u {
                            take(pieces - 1u);
                        }
                        pieces = 0u;
                        depth += 1u;
                    }
                    continue;
                }
            }
            let curvature = bend.x * m.second.x + bend.y * m.second.y + 2.0 * mixed * m.second.z;
            let length_m = way(f, p) + way(receiver, p) + 0.5 * curvature;
            let amplitude = k * 0.0795774715 / (length(there) * length(back));
            let z = cmul(conj(cis_turns_f(length_m * k * TURNS)), phase_integral(m, (a2 + b2) * -k)) * amplitude;
            // A polygon that is not cut so often belongs to the first who have it.
            if depth == params.halvings || (share >> depth) == 0u {
                let r = matrix(record, project(f, p), -b);
                sum_v += times(r.v, z);
                sum_h += times(r.h, z);
            }
            if pieces == 0u {
                break;
            }
            pieces -= 1u;
            take(pieces);
        }
    }
    check_steps();
    if trouble != 0u {
        sum_v = vec4<f32>(NO_SUM, f32(trouble), 0.0, 0.0);
        sum_h = sum_v;
    }
    sums[2u * id] = sum_v;
    sums[2u * id + 1u] = sum_h;
}
