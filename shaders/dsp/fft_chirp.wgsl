// Multiplies lines by a vector: the steps of Bluestein's transform between its two convolving ones
// (Bluestein, IEEE Trans. AU-18 (1970) 451), with the placing of shaders/shared/fft_pass.wgsl.

struct FftChirpParams {
    lines: u32,
    length: u32,
    // Values of a line; the rest is zero.
    count: u32,
    in_base: u32,
    in_line: u32,
    in_step: u32,
    out_base: u32,
    out_line: u32,
    out_step: u32,
    // Value k goes to position (k + shift) mod length; positions first .. first + kept are stored.
    shift: u32,
    first: u32,
    kept: u32,
    lines_first: u32,
    // 1: the value, or the product, is conjugated.
    conjugate_in: u32,
    conjugate_out: u32,
}

@group(0) @binding(0) var<uniform> params: FftChirpParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> multipliers: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> products: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slow = id.y + (id.z << 15u);
    let at = select(vec2<u32>(slow, id.x), vec2<u32>(id.x, slow), params.lines_first == 1u);
    if at.x >= params.lines || at.y >= params.length {
        return;
    }
    let inside = min(at.y, params.count - 1u);
    var x = values[params.in_base + at.x * params.in_line + inside * params.in_step];
    x = select(x, conj(x), params.conjugate_in == 1u);
    var y = cmul(x, multipliers[inside]);
    y = select(y, conj(y), params.conjugate_out == 1u);
    y = select(vec2<f32>(0.0), y, at.y < params.count);
    let turned = at.y + params.shift;
    // Wraps below first, and is then not less than kept.
    let position = turned - select(0u, params.length, turned >= params.length) - params.first;
    if position < params.kept {
        products[params.out_base + at.x * params.out_line + position * params.out_step] = y;
    }
}
