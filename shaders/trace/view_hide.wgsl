// Takes out of each piece what nearer faces hide of it. A thread takes one piece and walks the tree; where a face cuts it, the parts
// around that face go on from there by themselves. A thread hands on what it has when its room or its steps are used up: pieces that have
// seen all of the tree stand first in its slots, then those that go on, each with the place in the tree where it stopped.

@group(0) @binding(0) var<uniform> params: ViewParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> views: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> pieces: array<vec4<u32>>;
// Slots of each thread, of which thread t has every word that is t modulo their number.
@group(0) @binding(4) var<storage, read_write> scratch: array<vec4<u32>>;
// Of each thread, the words of the pieces that are through, and the number of those that go on.
@group(0) @binding(5) var<storage, read_write> done: array<u32>;
@group(0) @binding(6) var<storage, read_write> going: array<u32>;
// The number of pieces is its word `params.total_at`.
@group(0) @binding(7) var<storage, read> totals: array<u32>;
@group(0) @binding(8) var<storage, read_write> troubles: array<atomic<u32>>;

const SLOTS: u32 = 16u;

var<private> thread: u32;
var<private> slots: u32;

fn word(slot: u32, w: u32) -> u32 {
    return (slot * PIECE + w) * params.threads + thread;
}

fn move_slot(from_slot: u32, to_slot: u32) {
    let n = scratch[word(from_slot, 0u)].z & 0xffu;
    for (var w = 0u; w < 2u + 2u * n; w += 1u) {
        scratch[word(to_slot, w)] = scratch[word(from_slot, w)];
    }
}

fn take_slot(slot: u32) {
    corners = scratch[word(slot, 0u)].z & 0xffu;
    for (var i = 0u; i < corners; i += 1u) {
        let a = scratch[word(slot, 2u + 2u * i)];
        let b = scratch[word(slot, 3u + 2u * i)];
        ring[i] = Corner(bitcast<vec2<f32>>(a.xy), a.zw, b.xy, b.zw);
    }
}

// Writes the corners of the polygon at work into its slot.
fn put(slot: u32) {
    if corners > MOST {
        trouble |= TOO_MANY_CORNERS;
        return;
    }
    for (var i = 0u; i < corners; i += 1u) {
        let c = ring[i];
        scratch[word(slot, 2u + 2u * i)] = vec4<u32>(bitcast<vec2<u32>>(c.at), c.on);
        scratch[word(slot, 3u + 2u * i)] = vec4<u32>(c.also_on, c.side);
    }
    let head = scratch[word(slot, 0u)];
    scratch[word(slot, 0u)] = vec4<u32>(head.xy, (head.z & 0x100u) | corners, head.w);
}

var<private> lines: array<Cutter, 12>;
var<private> line_count: u32;

// Adds a line if it cuts the polygon at work; false when it leaves nothing but what it touches.
fn narrow(line: Cutter) -> bool {
    let side = sides(line);
    if side == KEEPS_ALL {
        // One that only touches it all around holds nothing either.
        var high = false;
        for (var i = 0u; i < corners; i += 1u) {
            high = high || distances[i] > 0.0;
        }
        return high;
    }
    lines[line_count] = line;
    line_count += 1u;
    return side == KEEPS_PART;
}

// Writes what the line of `sides` cuts off into a slot, if it is more than a sliver.
fn put_off(line: vec2<u32>, slot: u32, least: f32) -> bool {
    let id = vec2<u32>(line.x ^ TURNED, line.y);
    var n = 0u;
    var twice = 0.0;
    var origin = vec2<f32>();
    var last = vec2<f32>();
    for (var i = 0u; i < corners; i += 1u) {
        let d = distances[i];
        let j = select(i + 1u, 0u, i + 1u == corners);
        let e = distances[j];
        let p = ring[i];
        let crosses = (d < 0.0 && e > 0.0) || (d > 0.0 && e < 0.0);
        for (var part = 0u; part < 2u; part += 1u) {
            var c = Corner(p.at, p.on, p.also_on, select(p.side, id, d == 0.0 && e > 0.0));
            if part == 1u {
                if !crosses {
                    break;
                }
                let x = p.at + (ring[j].at - p.at) * (d / (d - e));
                c = Corner(x, untold(p.side), untold(id), select(id, p.side, d > 0.0));
            } else if d > 0.0 {
                continue;
            }
            if n == MOST {
                trouble |= TOO_MANY_CORNERS;
                return false;
            }
            scratch[word(slot, 2u + 2u * n)] = vec4<u32>(bitcast<vec2<u32>>(c.at), c.on);
            scratch[word(slot, 3u + 2u * n)] = vec4<u32>(c.also_on, c.side);
            if n == 0u {
                origin = c.at;
            } else {
                twice += cross2(last - origin, c.at - origin);
            }
            last = c.at;
            n += 1u;
        }
    }
    if n < 3u || 0.5 * abs(twice) <= least {
        return false;
    }
    scratch[word(slot, 0u)] = vec4<u32>(scratch[word(0u, 0u)].x, scratch[word(0u, 0u)].y, n, node);
    let rest = scratch[word(0u, 1u)];
    scratch[word(slot, 1u)] = vec4<u32>(next_face | (faces_left << 24u), rest.yzw);
    return true;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    thread = linear_id(workgroup, workgroups, local, 64u);
    let id = params.first + thread;
    if thread >= params.threads || id >= min(params.count, totals[params.total_at]) {
        return;
    }
    let from_word = id * PIECE;
    let head = pieces[from_word];
    let more = pieces[from_word + 1u];
    for (var w = 0u; w < 2u + 2u * (head.z & 0xffu); w += 1u) {
        scratch[word(0u, w)] = pieces[from_word + w];
    }
    slots = 1u;
    var finished = 0u;
    steps = 0u;
    let target_face = head.x;
    let f = view_at(head.y);
    let least = bitcast<f32>(more.y);
    let facing = lit(f, target_face);
    let lit_side = front(facing);
    let onward = more.z != NONE;
    let from_face = more.z & 0x7fffffffu;
    let from_side = select(1.0, -1.0, (more.z & 0x80000000u) != 0u);
    // What lies on the target may stand a little behind its plane.
    let near = plane_of(target_face) * lit_side - vec4<f32>(0.0, 0.0, 0.0, params.lies_m);
    var source_side = near;
    if onward {
        source_side = plane_of(from_face) * from_side;
    }
    outline_of(f, target_face);
    let own_off = outline_off;
    eps = own_off;
    while finished < slots && trouble == 0u {
        let place_word = scratch[word(finished, 0u)];
        let leaf = scratch[word(finished, 1u)].x;
        node = place_word.w;
        next_face = leaf & 0xffffffu;
        faces_left = leaf >> 24u;
        take_slot(finished);
        last_node = f.nodes.y;
        let box = bounds();
        if corners > MANY {
            if slots == SLOTS {
                break;
            }
            let line = halving(f.level, box);
            if sides(line) != KEEPS_PART {
                trouble |= TOO_MANY_CORNERS;
                break;
            }
            if put_off(line.id, slots, 0.0) {
                slots += 1u;
            }
            cut(line.id);
            put(finished);
            steps += 4u * corners;
            continue;
        }
        look_within(f, box, near, source_side);
        var is_cut = false;
        var is_full = false;
        while find_next() {
            let g = found_face;
            if of_one_patch(g, target_face) || onward && of_one_patch(g, from_face) || !reaches_in(g) {
                continue;
            }
            let other_facing = lit(f, g);
            if other_facing == 0.0 || lies_on(target_face, g) {
                continue;
            }
            let other_side = front(other_facing);
            var crosses = false;
            let here = place(g, target_face, lit_side, f.flat_m);
            if here != BEFORE && !lies_on(g, target_face) {
                if here == BEHIND {
                    continue;
                }
                let back = place(target_face, g, other_side, f.flat_m);
                if back == BEFORE {
                    continue;
                }
                crosses = back == ACROSS;
            }
            var beyond = BEFORE;
            if onward {
                beyond = place(g, from_face, from_side, max(f.flat_m, params.lies_m));
                if beyond == BEHIND {
                    continue;
                }
            }
            outline_of(f, g);
            // Steps of the loops here, of which drivers on the cpu allow so many.
            steps += 3u * STEPS_OF_FACE + 8u * outline_count + outline_count * corners;
            if outline_count < 3u {
                continue;
            }
            var lo = outline_at[0].xy;
            var hi = lo;
            var twice = 0.0;
            for (var i = 1u; i < outline_count; i += 1u) {
                let p = outline_at[i].xy;
                lo = min(lo, p);
                hi = max(hi, p);
                if i > 1u {
                    twice += cross2(outline_at[i - 1u].xy - outline_at[0].xy, p - outline_at[0].xy);
                }
            }
            let apart = any(lo > box.zw) || any(hi < box.xy);
            if apart || 0.5 * abs(twice) <= THIN * length(hi - lo) {
                continue;
            }
            let turn = turn_of(f, other_facing);
            line_count = 0u;
            eps = max(own_off, outline_off);
            var meets = true;
            for (var i = 0u; i < outline_count && meets; i += 1u) {
                let id = side_id(outline_side[i], f.level, turn);
                if ((id.x >> 28u) & 7u) == EDGE {
                    let j = select(i + 1u, 0u, i + 1u == outline_count);
                    let k = select(j + 1u, 0u, j + 1u == outline_count);
                    let h = select(i, outline_count, i == 0u) - 1u;
                    let ends = Stretch(outline_at[h].xy, outline_at[i].xy, outline_at[j].xy, outline_at[k].xy, turn);
                    meets = narrow(edge_cutter(f, id, ends));
                }
            }
            if meets && crosses {
                meets = narrow(crossing(f, g, target_face, false));
            }
            if meets && beyond == ACROSS {
                meets = narrow(crossing(f, from_face, g, false));
            }
            if !meets {
                continue;
            }
            if slots + line_count > SLOTS {
                // This face comes again when there is room.
                next_face -= 1u;
                faces_left += 1u;
                is_full = true;
                break;
            }
            let mark = slots;
            steps += 4u * line_count * corners;
            for (var l = 0u; l < line_count; l += 1u) {
                let line = lines[l];
                let side = sides(line);
                if side == KEEPS_NOTHING {
                    corners = 0u;
                    break;
                }
                if side == KEEPS_PART {
                    if put_off(line.id, slots, least) {
                        slots += 1u;
                    }
                    cut(line.id);
                    if corners < 3u {
                        break;
                    }
                }
            }
            if corners < 3u || abs(area()) <= least {
                // It was only touched, and stays whole.
                slots = mark;
                take_slot(finished);
                continue;
            }
            is_cut = true;
            break;
        }
        if is_cut {
            // The last part takes the place of what was cut.
            slots -= 1u;
            if slots > finished {
                move_slot(slots, finished);
            }
            continue;
        }
        let at_rest = scratch[word(finished, 1u)];
        scratch[word(finished, 0u)] = vec4<u32>(place_word.xyz, node);
        scratch[word(finished, 1u)] = vec4<u32>(next_face | (faces_left << 24u), at_rest.yzw);
        if is_full || steps >= params.budget {
            break;
        }
        finished += 1u;
    }
    check_steps();
    if trouble != 0u {
        atomicOr(&troubles[0], trouble);
    }
    var words = 0u;
    for (var i = 0u; i < finished; i += 1u) {
        words += 2u + 2u * (scratch[word(i, 0u)].z & 0xffu);
    }
    done[thread] = words;
    going[thread] = slots - finished;
}
