// Imbalance of I and Q, constant, saturation and quantiser of every sample of a piece of the cube.
struct ConvertParams {
    count: u32,
    // 1: real sampling, the second part stays 0.
    is_real: u32,
    // 0 none, 1 tanh, 2 clip.
    saturation: u32,
    // 0 none, 1 mid-tread, 2 mid-rise.
    quantiser: u32,
    q_from_q: f32,
    q_from_i: f32,
    offset_i: f32,
    offset_q: f32,
    limit: f32,
    step: f32,
    // 2^(bits - 1) - 1.
    largest_code: f32,
}

@group(0) @binding(0) var<uniform> params: ConvertParams;
@group(0) @binding(1) var<storage, read_write> cube: array<vec2<f32>>;

// The builtin tanh may take sinh/cosh and lose all digits of a small argument.
fn tanh_of(x: f32) -> f32 {
    let a = abs(x);
    if a < 0.3 {
        let y = x * x;
        return x * (1.0 + y * (-1.0 / 3.0 + y * (2.0 / 15.0 + y * (-17.0 / 315.0 + y * (62.0 / 2835.0 - y * (1382.0 / 155925.0))))));
    }
    let e = exp(-2.0 * min(a, 20.0));
    return sign(x) * (1.0 - e) / (1.0 + e);
}

fn limited(x: f32) -> f32 {
    if params.saturation == 1u {
        return params.limit * tanh_of(x / params.limit);
    }
    if params.saturation == 2u {
        return clamp(x, -params.limit, params.limit);
    }
    return x;
}

fn quantised(x: f32) -> f32 {
    if params.quantiser == 0u {
        return x;
    }
    let half = select(0.0, 0.5, params.quantiser == 1u);
    let code = clamp(floor(x / params.step + half), -params.largest_code - 1.0, params.largest_code);
    return (code + 0.5 - half) * params.step;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    if i >= params.count {
        return;
    }
    let z = cube[i];
    let re = quantised(limited(z.x + params.offset_i));
    let q = params.q_from_q * z.y + params.q_from_i * z.x + params.offset_q;
    let im = quantised(limited(q));
    cube[i] = vec2<f32>(re, select(im, 0.0, params.is_real != 0u));
}
