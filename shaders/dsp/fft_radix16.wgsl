// Pass of radix 16 as four by four (see shaders/shared/fft_pass.wgsl).

@group(0) @binding(0) var<uniform> params: FftPassParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> multipliers: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> spectrum: array<vec2<f32>>;

const C = 0.92387953251128674; // cos(pi/8)
const S = 0.38268343236508977; // sin(pi/8)
const H = 0.70710678118654752; // cos(pi/4)

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = place(id);
    if at.x >= params.lines || at.y >= params.butterflies {
        return;
    }
    let line = at.x;
    let j = at.y;
    let k = j % params.done;
    let a0 = dft4(
        factor(line, j, k, 0u),
        factor(line, j, k, 4u),
        factor(line, j, k, 8u),
        factor(line, j, k, 12u),
    );
    let a1 = dft4(
        factor(line, j, k, 1u),
        factor(line, j, k, 5u),
        factor(line, j, k, 9u),
        factor(line, j, k, 13u),
    );
    let a2 = dft4(
        factor(line, j, k, 2u),
        factor(line, j, k, 6u),
        factor(line, j, k, 10u),
        factor(line, j, k, 14u),
    );
    let a3 = dft4(
        factor(line, j, k, 3u),
        factor(line, j, k, 7u),
        factor(line, j, k, 11u),
        factor(line, j, k, 15u),
    );
    let bin = (j - k) * 16u + k;
    let b0 = dft4(a0[0], a1[0], a2[0], a3[0]);
    let b1 = dft4(a0[1], cmul(a1[1], vec2<f32>(C, -S)), cmul(a2[1], vec2<f32>(H, -H)), cmul(a3[1], vec2<f32>(S, -C)));
    let b2 = dft4(a0[2], cmul(a1[2], vec2<f32>(H, -H)), cmul(a2[2], vec2<f32>(0.0, -1.0)), cmul(a3[2], vec2<f32>(-H, -H)));
    let b3 = dft4(a0[3], cmul(a1[3], vec2<f32>(S, -C)), cmul(a2[3], vec2<f32>(-H, -H)), cmul(a3[3], vec2<f32>(-C, S)));
    put(line, bin, b0[0]);
    put(line, bin + 4u * params.done, b0[1]);
    put(line, bin + 8u * params.done, b0[2]);
    put(line, bin + 12u * params.done, b0[3]);
    put(line, bin + 1u * params.done, b1[0]);
    put(line, bin + 5u * params.done, b1[1]);
    put(line, bin + 9u * params.done, b1[2]);
    put(line, bin + 13u * params.done, b1[3]);
    put(line, bin + 2u * params.done, b2[0]);
    put(line, bin + 6u * params.done, b2[1]);
    put(line, bin + 10u * params.done, b2[2]);
    put(line, bin + 14u * params.done, b2[3]);
    put(line, bin + 3u * params.done, b3[0]);
    put(line, bin + 7u * params.done, b3[1]);
    put(line, bin + 11u * params.done, b3[2]);
    put(line, bin + 15u * params.done, b3[3]);
}
