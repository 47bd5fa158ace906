// Adds thermal noise to every sample of a piece of the cube: Philox4x32-10, Box-Muller.
struct NoiseParams {
    count: u32,
    // Index in the whole cube of the first sample here.
    base_lo: u32,
    base_hi: u32,
    seed_lo: u32,
    seed_hi: u32,
    frame: u32,
    stream: u32,
    // 1: real sampling.
    is_real: u32,
    sigma: f32,
}

@group(0) @binding(0) var<uniform> params: NoiseParams;
@group(0) @binding(1) var<storage, read_write> cube: array<vec2<f32>>;

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
    let lo = params.base_lo + i;
    let hi = params.base_hi + select(0u, 1u, lo < i);
    let words = philox4x32_10(
        vec4<u32>(lo, hi, params.seed_hi, params.stream),
        vec2<u32>(params.seed_lo, params.frame),
    );
    // (0, 1] in steps of 2^-24, exact.
    let u = f32((words.x >> 8u) + 1u) * 5.9604645e-8;
    let r = params.sigma * sqrt(-2.0 * log(u));
    var z = r * cis_turns(words.y);
    if params.is_real != 0u {
        z.y = 0.0;
    }
    cube[i] += z;
}
