// Physical-optics sum of the tubes of many aspects. One workgroup takes one block of tubes of one aspect
// and adds it up in a fixed order; the host adds the blocks in f64.

struct PoSumParams {
    inv_wavelength: vec2<f32>,
    wavenumber: f32,
    t_min: f32,
    bounces: u32,
    tubes_per_block: u32,
    // 0: plane waves from the aspects' grids; 1: a spherical wave from `first`, tubes in `cells`.
    spherical: u32,
    zero: u32,
}

struct Aspect {
    dir_hi: vec3<f32>,
    count0: u32,
    dir_lo: vec3<f32>,
    tubes: u32,
    first_hi: vec3<f32>,
    lead_hi: f32,
    first_lo: vec3<f32>,
    lead_lo: f32,
    step0_hi: vec3<f32>,
    // Nothing stands nearer to `first` than this (spherical waves).
    near: f32,
    step0_lo: vec3<f32>,
    pad1: f32,
    step1_hi: vec3<f32>,
    pad2: f32,
    step1_lo: vec3<f32>,
    pad3: f32,
    // Columns of the fan's axes.
    axis0: vec3<f32>,
    pad4: f32,
    axis1: vec3<f32>,
    pad5: f32,
    axis2: vec3<f32>,
    pad6: f32,
}

// S_vv, S_hv, S_vh, S_hh (xy real, zw ...): every bounce in 0..3, the last one alone in 4..7.
struct Sum {
    every_v: vec4<f32>,
    every_h: vec4<f32>,
    last_v: vec4<f32>,
    last_h: vec4<f32>,
}

@group(0) @binding(0) var<uniform> params: PoSumParams;
@group(0) @binding(1) var<storage, read> bvh_nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> bvh_triangles: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> surfaces: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> aspects: array<Aspect>;
// Aspect and first tube of each block.
@group(0) @binding(6) var<storage, read> blocks: array<vec2<u32>>;
@group(0) @binding(7) var<storage, read> cells: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> sums: array<Sum>;

var<workgroup> shared_sums: array<Sum, 64>;

fn plane_tube(a: Aspect, index: u32) -> Tube {
    let i = f32(index % a.count0);
    let j = f32(index / a.count0);
    let offset = dfv_add(
        dfv_scale(DfVec3(a.step0_hi, a.step0_lo), vec2<f32>(i, 0.0)),
        dfv_scale(DfVec3(a.step1_hi, a.step1_lo), vec2<f32>(j, 0.0)),
    );
    let origin = dfv_add(DfVec3(a.first_hi, a.first_lo), offset);
    return Tube(origin, DfVec3(a.dir_hi, a.dir_lo), a.step0_hi, a.step1_hi);
}

fn sum_add(a: Sum, b: Sum) -> Sum {
    return Sum(a.every_v + b.every_v, a.every_h + b.every_h, a.last_v + b.last_v, a.last_h + b.last_h);
}

// One tube: follow, reflect, radiate.
fn tube_sum(a: Aspect, index: u32) -> Sum {
    let spherical = params.spherical != 0u;
    var tube: Tube;
    if spherical {
        let axes = mat3x3<f32>(a.axis0, a.axis1, a.axis2);
        tube = fan_tube(DfVec3(a.first_hi, a.first_lo), cells[2u * index], cells[2u * index + 1u], axes);
    } else {
        tube = plane_tube(a, index);
    }
    var sum = Sum();
    var origin = tube.origin;
    var dir = tube.dir;
    var edge0 = tube.edge0;
    var edge1 = tube.edge1;
    var field_v = CVec3(v_of(-dir.hi), vec3<f32>());
    var field_h = CVec3(h_of(-dir.hi), vec3<f32>());
    // Tracing starts close to the target: f32 resolves its edges better there.
    var path = vec2<f32>(select(0.0, a.near, spherical), 0.0);
    if spherical {
        origin = dfv_add(origin, dfv_scale(dir, path));
    }
    var skip = 0xffffffffu;
    var bounce = 0u;
    var pending_v = vec4<f32>();
    var pending_h = vec4<f32>();
    loop {
        let hit = closest_hit(origin.hi, dir.hi, params.t_min, 1e30, skip);
        if hit.triangle == 0xffffffffu {
            // The tube leaves the scene: what the bounce before it radiated is the last one's.
            sum.last_v += pending_v;
            sum.last_h += pending_h;
            break;
        }
        if bounce == params.bounces {
            break;
        }
        let patch_bits = bitcast<u32>(bvh_triangles[3u * hit.triangle].w);
        let surface = bitcast<u32>(bvh_triangles[3u * hit.triangle + 2u].w);
        let step = facet_step(origin, dir, hit.triangle);
        path = df_add(path, step.t);
        let m = mirror(dir.hi, step.dir.hi, step.normal, surface, params.wavenumber);
        let after_v = reflected(m, field_v);
        let after_h = reflected(m, field_h);

        var to_receiver = -a.dir_hi;
        var distance = 1e30;
        // Path from the tube's start to the receiver, less the reference.
        var length = df_sub(path, vec2<f32>(a.lead_hi, a.lead_lo));
        var amplitude = 1.0;
        if spherical {
            let back = dfv_sub(tube.origin, step.point);
            let range = dfv_length(back);
            to_receiver = back.hi / range.x;
            distance = range.x;
            length = df_add(length, range);
        } else {
            length = df_add(length, dfv_dot(DfVec3(a.dir_hi, a.dir_lo), step.point));
        }
        pending_v = vec4<f32>();
        pending_h = vec4<f32>();
        if dot(step.normal, to_receiver) > 0.0
            && (bounce == 0u || !any_hit(step.point.hi, to_receiver, params.t_min, distance, patch_bits)) {
            let grow = select(1.0, path.x, spherical);
            let foot = footprint(m, edge0 * grow, edge1 * grow, to_receiver, params.wavenumber);
            amplitude = foot.x * sinc(foot.y) * sinc(foot.z);
            if spherical {
                amplitude /= path.x * distance;
            }
            let cis = conj(cis_turns(turns_from_df(df_mul(length, params.inv_wavelength)))) * amplitude;
            let v = v_of(to_receiver);
            let h = h_of(to_receiver);
            let s_v = radiated(m, field_v, after_v, to_receiver, v, h);
            let s_h = radiated(m, field_h, after_h, to_receiver, v, h);
            pending_v = vec4<f32>(cmul(s_v.xy, cis), cmul(s_v.zw, cis));
            pending_h = vec4<f32>(cmul(s_h.xy, cis), cmul(s_h.zw, cis));
            sum.every_v += pending_v;
            sum.every_h += pending_h;
        }
        edge0 -= step.normal * (2.0 * dot(step.normal, edge0));
        edge1 -= step.normal * (2.0 * dot(step.normal, edge1));
        field_v = after_v;
        field_h = after_h;
        origin = step.point;
        dir = step.dir;
        skip = patch_bits;
        bounce += 1u;
    }
    return sum;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    barrier_zero = params.zero;
    // Tubes that run along an edge, as those of a symmetric target do, belong to one side of it.
    edge_slack = 0.0;
    let block_index = workgroup.x;
    let block = blocks[block_index];
    let a = aspects[block.x];
    var sum = Sum();
    for (var i = local; i < params.tubes_per_block; i += 64u) {
        let index = block.y + i;
        if index < a.tubes {
            sum = sum_add(sum, tube_sum(a, index));
        }
    }
    shared_sums[local] = sum;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if local < half {
            shared_sums[local] = sum_add(shared_sums[local], shared_sums[local + half]);
        }
        workgroupBarrier();
    }
    if local == 0u {
        sums[block_index] = shared_sums[0];
    }
}
