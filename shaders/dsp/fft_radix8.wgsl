// Pass of radix 8 (see shaders/shared/fft_pass.wgsl).

@group(0) @binding(0) var<uniform> params: FftPassParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> multipliers: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> spectrum: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = place(id);
    if at.x >= params.lines || at.y >= params.butterflies {
        return;
    }
    let line = at.x;
    let j = at.y;
    let k = j % params.done;
    let x0 = factor(line, j, k, 0u);
    let x1 = factor(line, j, k, 1u);
    let x2 = factor(line, j, k, 2u);
    let x3 = factor(line, j, k, 3u);
    let x4 = factor(line, j, k, 4u);
    let x5 = factor(line, j, k, 5u);
    let x6 = factor(line, j, k, 6u);
    let x7 = factor(line, j, k, 7u);
    let e = dft4(x0, x2, x4, x6);
    let o = dft4(x1, x3, x5, x7);
    let half = 0.70710678118654752;
    let o1 = vec2<f32>(o[1].x + o[1].y, o[1].y - o[1].x) * half;
    let o2 = vec2<f32>(o[2].y, -o[2].x);
    let o3 = vec2<f32>(o[3].y - o[3].x, -(o[3].x + o[3].y)) * half;
    let bin = (j - k) * 8u + k;
    put(line, bin, e[0] + o[0]);
    put(line, bin + 1u * params.done, e[1] + o1);
    put(line, bin + 2u * params.done, e[2] + o2);
    put(line, bin + 3u * params.done, e[3] + o3);
    put(line, bin + 4u * params.done, e[0] - o[0]);
    put(line, bin + 5u * params.done, e[1] - o1);
    put(line, bin + 6u * params.done, e[2] - o2);
    put(line, bin + 7u * params.done, e[3] - o3);
}
