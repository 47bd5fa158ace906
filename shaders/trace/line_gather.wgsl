// Puts side by side what the segments of a list have brought. Stage SIDES: their fragments along edges. Stage CASTERS: the silhouettes
// that throw shadows, as segments. Stage SHADOWS: the fragments of shadows. Counts first; then, the counts being summed, writes.

@group(0) @binding(0) var<uniform> params: LineParams;
@group(0) @binding(1) var<storage, read> body: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> segments: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;
@group(0) @binding(4) var<storage, read_write> gathered: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> sizes: array<atomic<u32>>;

const SIDES: u32 = 0u;
const CASTERS: u32 = 1u;
const SHADOWS: u32 = 2u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let id = linear_id(workgroup, workgroups, local, 64u);
    if params.mode == 1u {
        let total = counts[params.count];
        let fits = total <= params.room;
        if id == 0u {
            atomicStore(&sizes[1u + params.list_out], select(0u, total, fits));
            atomicStore(&sizes[NEEDED + 1u + params.list_out], total);
        }
        if !fits {
            return;
        }
    }
    if id >= atomicLoad(&sizes[1u + params.list_in]) {
        return;
    }
    let head = segments[2u * id];
    let is_dead = (head.z & DEAD) != 0u;
    if params.mode == 0u {
        var count = 0u;
        if params.stage == SIDES {
            count = countOneBits(head.z >> HALVES);
        } else if params.stage == CASTERS {
            count = select(0u, 1u, (head.z & (FREE_POSITIVE | FREE_NEGATIVE)) != 0u);
        } else {
            count = select(0u, 1u, (head.z & HIT) != 0u);
        }
        counts[id] = select(count, 0u, is_dead);
        return;
    }
    var to = counts[id];
    if counts[id + 1u] == to {
        return;
    }
    let shares = segments[2u * id + 1u];
    if params.stage != SIDES {
        gathered[2u * to] = vec4<u32>(head.xy, head.z & ((1u << HALVES) - 1u), head.w);
        gathered[2u * to + 1u] = shares;
        return;
    }
    let first = body[params.edges_at + 4u * (head.y & 0x3fffffffu)].w;
    var bits = head.z >> HALVES;
    while bits != 0u {
        let half = firstTrailingBit(bits);
        bits &= bits - 1u;
        let face = body[params.halves_at + 2u * (first + half)].w;
        gathered[2u * to] = vec4<u32>(head.xy, IS_SIDE | half << HALVES, face);
        gathered[2u * to + 1u] = shares;
        to += 1u;
    }
}
