// Follows the axis of each tube of a fan and writes the chain of facets that it meets: word 0 holds the
// number of facets (bits 0-7), whether the tube then left the scene (bit 8) and, from bit 16 on, which
// bounces make an echo; word 1 beyond which lower (bits 0-7) and upper (bits 8-15) ends of their footprints
// the lit patch goes on; then one triangle a word. Also counts the echoes that each tube makes.

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

// As in src/trace/ends.rs.
const STEEP: f32 = 0.1;
const STANDS: f32 = 0.70710678;

// Direction of the middle of a border of the cell: axis 0 is azimuth, 1 sine of elevation.
fn border(hi: vec4<f32>, lo: vec4<f32>, axes: mat3x3<f32>, axis: u32, half: f32) -> vec3<f32> {
    let d = transpose(axes) * hi.xyz;
    if axis == 0u {
        // A turn by a small angle, to third order.
        let t = half * hi.w;
        let c = 1.0 - 0.5 * t * t;
        let s = t - t * t * t / 6.0;
        return axes * vec3<f32>(c * d.x - s * d.y, c * d.y + s * d.x, d.z);
    }
    let z = d.z + half * lo.w;
    return axes * vec3<f32>(d.xy * sqrt(max(1.0 - z * z, 0.0) / (d.x * d.x + d.y * d.y)), z);
}

fn patch_of(triangle: u32) -> u32 {
    return bitcast<u32>(bvh_triangles[3u * triangle].w);
}

fn sees_radar(point: vec3<f32>, radar: vec3<f32>, own_patch: u32) -> bool {
    let back = radar - point;
    let distance = length(back);
    return !any_hit(point, back / distance, params.t_min, distance, own_patch);
}

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
    let axes = mat3x3<f32>(params.axis0, params.axis1, params.axis2);
    let radar = DfVec3(params.origin_hi, params.origin_lo);
    let cell_hi = cells[2u * index];
    let cell_lo = cells[2u * index + 1u];
    let tube = fan_tube(radar, cell_hi, cell_lo, axes);
    var origin = radar;
    var dir = tube.dir;
    var edge0 = tube.edge0;
    var edge1 = tube.edge1;
    let base = index * (params.bounces + 2u);
    var skip = 0xffffffffu;
    var bounce = 0u;
    var seen = 0u;
    var left = 0u;
    // Bounces far from the mirror direction, by the axis of their end terms.
    var steep = array<u32, 2>();
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
        skip = patch_of(hit.triangle);
        let back = radar.hi - step.point.hi;
        if dot(step.normal, back) > 0.0 && (bounce == 0u || sees_radar(step.point.hi, radar.hi, skip)) {
            seen |= 1u << bounce;
        }
        let axis = select(0u, 1u, abs(step.normal.z) > STANDS);
        let edge = select(edge0, edge1, axis == 1u);
        let foot = edge - dir.hi * (dot(step.normal, edge) / dot(step.normal, dir.hi));
        if abs(dot(dir.hi - normalize(back), foot)) > STEEP * length(foot) {
            steep[axis] |= 1u << bounce;
        }
        edge0 -= step.normal * (2.0 * dot(step.normal, edge0));
        edge1 -= step.normal * (2.0 * dot(step.normal, edge1));
        bounce += 1u;
        chains[base + 1u + bounce] = hit.triangle;
        origin = step.point;
        dir = step.dir;
    }
    for (var b = bounce; b < params.bounces; b += 1u) {
        chains[base + 2u + b] = 0xffffffffu;
    }
    if params.last_only != 0u {
        // Nothing but the last bounce, and only when the tube leaves.
        seen &= select(0u, 1u << (bounce - 1u), left != 0u && bounce > 0u);
    }

    var goes_on = array<u32, 2>();
    for (var axis = 0u; axis < 2u; axis += 1u) {
        let asked = steep[axis] & seen;
        if asked == 0u {
            continue;
        }
        for (var side = 0u; side < 2u; side += 1u) {
            origin = radar;
            dir = DfVec3(border(cell_hi, cell_lo, axes, axis, select(-0.5, 0.5, side == 1u)), vec3<f32>());
            skip = 0xffffffffu;
            var same = 0u;
            var b = 0u;
            loop {
                if b == bounce && params.last_only == 0u {
                    break;
                }
                let hit = closest_hit(origin.hi, dir.hi, params.t_min, 1e30, skip);
                let none = hit.triangle == 0xffffffffu;
                if b == bounce {
                    // With "last", both have to leave after the same facet.
                    if none != (left != 0u) {
                        same = 0u;
                    }
                    break;
                }
                if none || patch_of(hit.triangle) != patch_of(chains[base + 2u + b]) {
                    if params.last_only != 0u {
                        same = 0u;
                    }
                    break;
                }
                let step = facet_step(origin, dir, hit.triangle);
                skip = patch_of(hit.triangle);
                if ((asked >> b) & 1u) != 0u && (b == 0u || sees_radar(step.point.hi, radar.hi, skip)) {
                    same |= 1u << b;
                }
                b += 1u;
                if (asked >> b) == 0u && params.last_only == 0u {
                    break;
                }
                origin = step.point;
                dir = step.dir;
            }
            goes_on[side] |= same;
        }
    }
    seen &= ~(goes_on[0] & goes_on[1]);
    chains[base] = bounce | (left << 8u) | (seen << 16u);
    chains[base + 1u] = goes_on[0] | (goes_on[1] << 8u);
    counts[index] = countOneBits(seen);
}
