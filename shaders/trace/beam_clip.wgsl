// What the rays of a beam light of one face: the beam's polygon on the face less what nearer faces hide. A
// thread takes one beam and one face, or (level 0) one aspect and one face. Counts first, and keeps what is a
// single piece; then, the counts being summed, clips again what is more than one, and puts the single pieces
// between (mode 2, a dispatch of its own: every adapter binds eight buffers, and what was kept would be a ninth).

@group(0) @binding(0) var<uniform> params: BeamParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> aspects: array<vec4<f32>>;
// Beams that set out, or in mode 2 the single pieces, a record for each item; and (beam, face) of each item.
// Modes 0 and 1 read neither at level 0.
@group(0) @binding(3) var<storage, read> records: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> items: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
@group(0) @binding(6) var<storage, read_write> lit_records: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> scratch: array<vec2<f32>>;
@group(0) @binding(8) var<storage, read_write> troubles: array<atomic<u32>>;

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
    let slot = counts[id];
    if params.mode != 0u {
        let found = counts[id + 1u] - slot;
        if params.mode == 2u && found == 1u {
            for (var i = 0u; i < RECORD; i += 1u) {
                lit_records[slot * RECORD + i] = records[id * RECORD + i];
            }
        }
        if params.mode == 2u || found <= 1u {
            return;
        }
    }
    let onward = params.level != 0u;
    var aspect: u32;
    var target_face: u32;
    var parent = 0u;
    var bounce = 0u;
    var f: Frame;
    var source: vec4<f32>;
    var source_face = 0u;
    var source_turned = false;
    if onward {
        let item = items[id];
        parent = item.x * RECORD;
        target_face = item.y;
        aspect = records[parent].x;
        bounce = record_bounce(parent);
        f = frame_after(parent, bounce);
        source_face = chain_at(parent, bounce - 1u);
        let mirror = face_at(source_face);
        // Rays leave a mirror on the side on which they came.
        let away = dot(mirror.normal, towards(f, corner_at(mirror.first)));
        source = side_of(mirror, -away);
        source_turned = away < 0.0;
    } else {
        aspect = id / params.faces;
        target_face = id % params.faces;
        f = root_frame(aspect, params.port);
    }
    let face = face_at(target_face);
    let target_patch = patch_of(target_face);
    let source_patch = patch_of(source_face);
    let cosine = lit(f, face);
    var hidden = false;
    if cosine != 0.0 {
        let side = side_of(face, cosine);
        if onward {
            take_record(parent);
            outline(f, face, cosine);
            if place(target_face, source_face, source_turned) == ACROSS {
                add_crossing(f, source, vec4<f32>(face.normal, face.offset));
            }
            cut_outline(bounds(), params.eps);
        } else {
            corners = face.count;
            for (var i = 0u; i < corners; i += 1u) {
                ring[i] = project(f, corner_at(face.first + i));
            }
        }
        let least = SLIVER * abs(area());
        stash();
        look_within(f, bounds(), side, select(side, source, onward));
        loop {
            let leaf = next_leaf();
            if leaf.x == leaf.y || pieces == 0u {
                break;
            }
            for (var g = leaf.x; g < leaf.y; g += 1u) {
                let g_patch = patch_of(g);
                if pieces == 0u || g_patch == target_patch || onward && g_patch == source_patch {
                    continue;
                }
                let other = face_at(g);
                let other_cosine = lit(f, other);
                if other_cosine == 0.0 {
                    continue;
                }
                let here = place(g, target_face, cosine > 0.0);
                if here == BEHIND {
                    continue;
                }
                var crossing = false;
                if here == ACROSS {
                    let there = place(target_face, g, other_cosine > 0.0);
                    if there == BEFORE {
                        continue;
                    }
                    crossing = there == ACROSS;
                }
                var beyond = BEFORE;
                if onward {
                    beyond = place(g, source_face, source_turned);
                    if beyond == BEHIND {
                        continue;
                    }
                }
                outline(f, other, other_cosine);
                if crossing {
                    add_crossing(f, vec4<f32>(other.normal, other.offset), vec4<f32>(face.normal, face.offset));
                }
                if beyond == ACROSS {
                    add_crossing(f, source, vec4<f32>(other.normal, other.offset));
                }
                hidden = subtract(least, params.eps) || hidden;
            }
        }
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&troubles[0], trouble);
    }
    var first = slot;
    if params.mode == 0u {
        counts[id] = pieces;
        if pieces != 1u {
            return;
        }
        first = id;
    }
    for (var p = 0u; p < pieces; p += 1u) {
        let to = (first + p) * RECORD;
        let n = piece_corners(p);
        var head = vec4<u32>(aspect, n | ((bounce + 1u) << 16u), target_face, 0u);
        var more = vec4<u32>();
        var rest = vec4<u32>();
        if onward {
            head.z = records[parent].z;
            head.w = records[parent].w;
            more = records[parent + 1u];
            rest = records[parent + 2u];
            if bounce == 1u {
                head.w = target_face;
            } else if bounce < 6u {
                more[bounce - 2u] = target_face;
            } else {
                rest[bounce - 6u] = target_face;
            }
        } else if !hidden {
            head.y |= 0x100u;
        }
        lit_records[to] = head;
        lit_records[to + 1u] = more;
        lit_records[to + 2u] = rest;
        for (var i = 0u; i < MOST; i += 2u) {
            let pair = vec4<f32>(piece_corner(p, i), piece_corner(p, i + 1u));
            lit_records[to + 3u + i / 2u] = bitcast<vec4<u32>>(pair);
        }
    }
}
