// The part of a face that a beam's own lines hold, before anything hides it: of pairs of a window and a face (level 0), or of a beam and
// a face ahead of it, whose number stands before them. Counts first; then, the counts being summed, writes pieces.

@group(0) @binding(0) var<uniform> params: ViewParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> beams: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> pairs: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
@group(0) @binding(6) var<storage, read_write> pieces: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> troubles: array<atomic<u32>>;

// Cuts the polygon at work; false where nothing is left.
fn keeps(line: Cutter) -> bool {
    let side = sides(line);
    if side == KEEPS_NOTHING {
        return false;
    }
    if side == KEEPS_PART {
        cut(line.id);
    }
    return corners >= 3u;
}

// Keeps what of a face, whose outline is the polygon at work, lies before the mirror. Where all of the face is in the window this is
// decided in space: a face that is seen at grazing is so narrow in view that all of it may lie on the line of the crossing.
fn keeps_before(f: View, face: u32, mirror: u32, mirror_side: f32) -> bool {
    let line = crossing(f, mirror, face, false);
    if !outline_whole || corners != corners_of(face) {
        return keeps(line);
    }
    let plane = plane_of(mirror) * mirror_side;
    let first = first_corner(face);
    var low = false;
    var high = false;
    for (var i = 0u; i < corners; i += 1u) {
        let c = bitcast<vec3<f32>>(corner_of(first + i).xyz);
        let above = dot(plane.xyz, c) - plane.w;
        // The share of a side at which it crosses is one in view, where what is far is small.
        let d = select(above / there(f, c).z, 0.0, abs(above) <= FLAT * (length(c) + abs(plane.w)));
        distances[i] = d;
        low = low || d < 0.0;
        high = high || d > 0.0;
    }
    if low && high {
        cut(line.id);
    }
    return high && corners >= 3u;
}

fn beam_corner(beam: u32, i: u32, n: u32) -> vec2<f32> {
    return bitcast<vec2<f32>>(beams[beam + 2u + 2u * (i % n)].xy);
}

// Cuts the polygon at work by the lines of the beam's sides.
fn keeps_beam(beam: u32, view: u32, n: u32, turn: f32) -> bool {
    for (var i = 0u; i < n; i += 1u) {
        let ends = Stretch(
            beam_corner(beam, i + n - 1u, n),
            beam_corner(beam, i, n),
            beam_corner(beam, i + 1u, n),
            beam_corner(beam, i + 2u, n),
            turn,
        );
        let id = beams[beam + 3u + 2u * i].zw;
        if !keeps(line_of(view_at(seen_in(view, (id.x >> 24u) & 0xfu)), id, ends)) {
            return false;
        }
    }
    return true;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = linear_id(workgroup, workgroups, local, 64u);
    let id = params.first + thread;
    if thread >= params.threads || id >= min(params.count, pairs[0].x) {
        return;
    }
    let slot = counts[thread];
    if params.mode == 1u && counts[thread + 1u] == slot {
        return;
    }
    var view: u32;
    var source = NONE;
    let pair = pairs[1u + id];
    let beam_index = pair.x;
    let target_face = pair.y;
    if params.level == 0u {
        view = pair.x;
    } else {
        view = beams[pair.x * PIECE].y;
        source = beams[pair.x * PIECE + 1u].z;
    }
    let f = view_at(view);
    var is_kept = false;
    let facing = lit(f, target_face);
    if facing != 0.0 {
        eps = 0.0;
        if params.level != 0u {
            // The beam's own corners, as they were seen before the mirror.
            outline_of(view_at(views[VIEW * view + 3u].w), source & 0x7fffffffu);
            eps = outline_off;
        }
        outline_of(f, target_face);
        eps = max(eps, outline_off);
        if outline_count >= 3u {
            take_outline(f.level, turn_of(f, facing));
            is_kept = true;
            if params.level != 0u {
                let beam = beam_index * PIECE;
                let from_face = source & 0x7fffffffu;
                let from_side = select(1.0, -1.0, (source & 0x80000000u) != 0u);
                if place(target_face, from_face, from_side, max(f.flat_m, params.lies_m)) == ACROSS {
                    is_kept = keeps_before(f, target_face, from_face, from_side);
                }
                // As it was seen before the mirror.
                let turn = select(from_side, -from_side, (f.level & 1u) != 0u);
                is_kept = is_kept && keeps_beam(beam, view, beams[beam].z & 0xffu, turn);
            }
        }
    }
    let size = select(0.0, abs(area()), is_kept);
    if corners > MOST && is_kept {
        trouble |= TOO_MANY_CORNERS;
    }
    if !(size >= 0.0 && size < 1e30) {
        trouble |= NOT_FINITE;
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&troubles[0], trouble);
    }
    is_kept = is_kept && trouble == 0u && size > select(SLIVER * SLIVER, 0.0, params.level == 0u);
    if params.mode == 0u {
        counts[thread] = select(0u, 1u, is_kept);
        return;
    }
    if !is_kept {
        return;
    }
    let to = slot * PIECE;
    pieces[to] = vec4<u32>(target_face, view, corners | select(0u, 0x100u, outline_whole), f.nodes.x);
    pieces[to + 1u] = vec4<u32>(0u, bitcast<u32>(SLIVER * size), source, beam_index);
    for (var i = 0u; i < corners; i += 1u) {
        let c = ring[i];
        pieces[to + 2u + 2u * i] = vec4<u32>(bitcast<vec2<u32>>(c.at), c.on);
        pieces[to + 3u + 2u * i] = vec4<u32>(c.also_on, c.side);
    }
}
