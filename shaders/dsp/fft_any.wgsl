// Pass of any radix as a plain sum, one output a thread (see shaders/shared/fft_pass.wgsl): for the factors
// that radices 8 and 16 leave.

@group(0) @binding(0) var<uniform> params: FftPassParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> multipliers: array<vec2<f32>>;
// e^(-j 2 pi i / length)
@group(0) @binding(3) var<storage, read> twiddles: array<vec2<f32>>;
@group(0) @binding(4) var<storage, read_write> spectrum: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = place(id);
    if at.x >= params.lines || at.y >= params.length {
        return;
    }
    let line = at.x;
    let radix = params.length / params.butterflies;
    let j = at.y / radix;
    let output = at.y % radix;
    let k = j % params.done;
    var sum = vec2<f32>(0.0);
    var turn = 0u; // i * output mod radix
    for (var i = 0u; i < radix; i++) {
        sum += cmul(factor(line, j, k, i), twiddles[turn * params.butterflies]);
        turn += output;
        turn -= select(0u, radix, turn >= radix);
    }
    put(line, (j - k) * radix + k + output * params.done, sum);
}
