// From chains of facets to echoes: goes along each chain again in double-f32, carries the field, and
// writes one return for each bounce that the radar sees, at the slot that the prefix sums gave.

struct Params {
    origin_hi: vec3<f32>,
    wavenumber: f32,
    origin_lo: vec3<f32>,
    bounces: u32,
    axis0: vec3<f32>,
    tubes: u32,
    axis1: vec3<f32>,
    zero: u32,
    axis2: vec3<f32>,
    pad0: u32,
    // The radar's velocity, and the columns of its axes, in the world.
    velocity: vec3<f32>,
    pad1: u32,
    sensor0: vec3<f32>,
    pad2: u32,
    sensor1: vec3<f32>,
    pad3: u32,
    sensor2: vec3<f32>,
    pad4: u32,
}

struct Echo {
    // S over R_t R_r: received V, H of the V-launched wave, then of the H-launched one; without the sinc of
    // half_phase, which the host turns into end terms.
    spread_v: vec4<f32>,
    spread_h: vec4<f32>,
    // World.
    departure: vec3<f32>,
    first_range: f32,
    arrival: vec3<f32>,
    last_range: f32,
    path_hi: f32,
    path_lo: f32,
    path_rate: f32,
    bounces: u32,
    // Two bodies a word.
    chain: vec4<u32>,
    // Half the phase across the footprint along its end axis, and which ends go on (1 lower, 2 upper).
    half_phase: f32,
    goes_on: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> bvh_triangles: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> surfaces: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> body_velocities: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> cells: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> chains: array<u32>;
@group(0) @binding(7) var<storage, read> slots: array<u32>;
@group(0) @binding(8) var<storage, read_write> echoes: array<Echo>;

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
    let base = index * (params.bounces + 2u);
    let seen = chains[base] >> 16u;
    let goes_on = chains[base + 1u];
    if seen == 0u {
        return;
    }
    barrier_zero = params.zero;
    let axes = mat3x3<f32>(params.axis0, params.axis1, params.axis2);
    let sensor = mat3x3<f32>(params.sensor0, params.sensor1, params.sensor2);
    let radar = DfVec3(params.origin_hi, params.origin_lo);
    let tube = fan_tube(radar, cells[2u * index], cells[2u * index + 1u], axes);
    var origin = tube.origin;
    var dir = tube.dir;
    var edge0 = tube.edge0;
    var edge1 = tube.edge1;
    let departure = transpose(sensor) * dir.hi;
    var field_v = CVec3(sensor * v_of(departure), vec3<f32>());
    var field_h = CVec3(sensor * h_of(departure), vec3<f32>());
    var path = vec2<f32>();
    var first_range = 0.0;
    // dL/dt up to the ray that arrives at the present facet.
    var rate = -dot(params.velocity, dir.hi);
    var chain = vec4<u32>();
    var slot = slots[index];
    for (var b = 0u; b < params.bounces; b += 1u) {
        if (seen >> b) == 0u {
            break;
        }
        let triangle = chains[base + 2u + b];
        let body = bitcast<u32>(bvh_triangles[3u * triangle + 1u].w);
        let surface = bitcast<u32>(bvh_triangles[3u * triangle + 2u].w);
        let body_velocity = body_velocities[body].xyz;
        let step = facet_step(origin, dir, triangle);
        path = df_add(path, step.t);
        if b == 0u {
            first_range = path.x;
        }
        chain[b / 2u] |= body << (16u * (b % 2u));
        let m = mirror(dir.hi, step.dir.hi, step.normal, surface, params.wavenumber);
        let after_v = reflected(m, field_v);
        let after_h = reflected(m, field_h);
        if ((seen >> b) & 1u) != 0u {
            let back = dfv_sub(radar, step.point);
            let range = dfv_length(back);
            let to_receiver = back.hi / range.x;
            let foot = footprint(m, edge0 * path.x, edge1 * path.x, to_receiver, params.wavenumber);
            // As in src/trace/ends.rs.
            let lies = abs(step.normal.z) > 0.70710678;
            let across = select(foot.z, foot.y, lies);
            let amplitude = foot.x * sinc(across) / (path.x * range.x);
            let arrival = transpose(sensor) * -to_receiver;
            let v = sensor * v_of(arrival);
            let h = sensor * h_of(arrival);
            let total = df_add(path, range);
            var echo: Echo;
            echo.spread_v = radiated(m, field_v, after_v, to_receiver, v, h) * amplitude;
            echo.spread_h = radiated(m, field_h, after_h, to_receiver, v, h) * amplitude;
            echo.departure = tube.dir.hi;
            echo.first_range = first_range;
            echo.arrival = -to_receiver;
            echo.last_range = range.x;
            echo.path_hi = total.x;
            echo.path_lo = total.y;
            echo.path_rate = rate + dot(body_velocity, dir.hi - to_receiver) + dot(params.velocity, to_receiver);
            echo.bounces = b + 1u;
            echo.chain = chain;
            echo.half_phase = select(foot.y, foot.z, lies);
            echo.goes_on = ((goes_on >> b) & 1u) | (((goes_on >> (8u + b)) & 1u) << 1u);
            echoes[slot] = echo;
            slot += 1u;
        }
        rate += dot(body_velocity, dir.hi - step.dir.hi);
        edge0 -= step.normal * (2.0 * dot(step.normal, edge0));
        edge1 -= step.normal * (2.0 * dot(step.normal, edge1));
        field_v = after_v;
        field_h = after_h;
        origin = step.point;
        dir = step.dir;
    }
}
