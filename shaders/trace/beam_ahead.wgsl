// What stands ahead of each reflected beam: the faces that it meets, and the parts of it that meet none. A
// thread takes one beam. Counts first; then, the counts being summed, writes.

@group(0) @binding(0) var<uniform> params: BeamParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> aspects: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> records: array<vec4<u32>>;
// Faces met by each beam and a zero, then the parts of each that leave and a zero. They are summed in one go, so
// that the sums of the latter begin with the number of all faces met.
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> items: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> exits: array<vec4<u32>>;
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
    let leaving = params.count + 1u;
    let item_slot = counts[id];
    let exit_slot = counts[leaving + id] - counts[leaving];
    if params.mode == 1u && counts[id + 1u] == item_slot && counts[leaving + id + 1u] == counts[leaving + id] {
        return;
    }
    let record = id * RECORD;
    let bounce = record_bounce(record);
    let from_index = chain_at(record, bounce - 1u);
    let from_face = face_at(from_index);
    let from_patch = patch_of(from_index);
    let f = frame_after(record, bounce);
    let away = dot(from_face.normal, towards(f, corner_at(from_face.first)));
    let source = side_of(from_face, -away);
    take_record(record);
    let least = SLIVER * abs(area());
    let box = bounds();
    if params.last != 0u {
        stash();
    }
    look_within(f, box, source, source);
    var targets = 0u;
    loop {
        let leaf = next_leaf();
        if leaf.x == leaf.y {
            break;
        }
        for (var g = leaf.x; g < leaf.y; g += 1u) {
            if patch_of(g) == from_patch {
                continue;
            }
            let face = face_at(g);
            let cosine = lit(f, face);
            if cosine == 0.0 {
                continue;
            }
            let beyond = place(g, from_index, away < 0.0);
            if beyond == BEHIND {
                continue;
            }
            outline(f, face, cosine);
            if beyond == ACROSS {
                add_crossing(f, source, vec4<f32>(face.normal, face.offset));
            }
            // Parts that leave are cut where the polygon at work stands.
            if apart(box, params.eps) || (params.last == 0u && parted(params.eps)) {
                continue;
            }
            // Whether the beam meets the face or only its box does shows when it is clipped to it.
            if params.go_on != 0u {
                if params.mode == 1u {
                    items[item_slot + targets] = vec2<u32>(id, g);
                }
                targets += 1u;
            }
            if params.last != 0u {
                _ = subtract(least, params.eps);
            }
        }
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&troubles[0], trouble);
    }
    if params.mode == 0u {
        counts[id] = targets;
        counts[leaving + id] = pieces;
        return;
    }
    for (var p = 0u; p < pieces; p += 1u) {
        let to = (exit_slot + p) * RECORD;
        let head = records[record];
        exits[to] = vec4<u32>(head.x, (head.y & 0xffff0000u) | piece_corners(p), head.zw);
        exits[to + 1u] = records[record + 1u];
        exits[to + 2u] = records[record + 2u];
        for (var i = 0u; i < MOST; i += 2u) {
            let pair = vec4<f32>(piece_corner(p, i), piece_corner(p, i + 1u));
            exits[to + 3u + i / 2u] = bitcast<vec4<u32>>(pair);
        }
    }
}
