// Follows the axis of each tube of a fan and writes the chain of facets that it meets: word 0 holds the
// number of facets (bits 0-7), whether the tube then left the scene (bit 8) and, from bit 16 on, which
// bounces the radar sees; then one triangle a word. Also counts the echoes that each tube makes.

struct Params {
    origin_hi: vec3<f32>,
    t_min: f32,
    origin_lo: vec3<f32>,
    bounces: u32,
    // Columns of the fan's axes.
    axis0: vec3<f32>,
    // Only the bounce from which a tube leaves radiates.
    last_only: u32,
    axis1: vec3<f32>,
    tubes: u32,
    axis2: vec3<f32>,
    zero: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> bvh_nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> bvh_triangles: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> cells: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> chains: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = linear_id(workgroup, workgroups, local, 64u);
    if index >= params.tubes {
        return;
    }
    barrier_zero = params.zero;
    let radar = DfVec3(params.origin_hi, params.origin_lo);
    var origin = radar;
    var dir = DfVec3(cells[2u * index].xyz, cells[2u * index + 1u].xyz);
    let base = index * (params.bounces + 1u);
    var skip = 0xffffffffu;
    var bounce = 0u;
    var seen = 0u;
    var left = 0u;
    loop {
        if bounce == params.bounces && params.last_only == 0u {
            break;
        }
        let hit = closest_hit(origin.hi, dir.hi, params.t_min, 1e30, skip);
        if hit.triangle == 0xffffffffu {
            left = 1u;
            break;
        }
        if bounce == params.bounces {
            break;
        }
        let step = facet_step(origin, dir, hit.triangle);
        skip = bitcast<u32>(bvh_triangles[3u * hit.triangle].w);
        let back = radar.hi - step.point.hi;
        let distance = length(back);
        if dot(step.normal, back) > 0.0
            && (bounce == 0u || !any_hit(step.point.hi, back / distance, params.t_min, distance, skip)) {
            seen |= 1u << bounce;
        }
        bounce += 1u;
        chains[base + bounce] = hit.triangle;
        origin = step.point;
        dir = step.dir;
    }
    for (var b = bounce; b < params.bounces; b += 1u) {
        chains[base + b + 1u] = 0xffffffffu;
    }
    if params.last_only != 0u {
        // Nothing but the last bounce, and only when the tube leaves.
        seen &= select(0u, 1u << (bounce - 1u), left != 0u && bounce > 0u);
    }
    chains[base] = bounce | (left << 8u) | (seen << 16u);
    counts[index] = countOneBits(seen);
}
