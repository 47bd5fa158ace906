// Batched FFT of power-of-two lengths up to 4096: Stockham autosort, radix 4, with a last radix-2
// pass for odd powers. A workgroup works on a tile of 1024 to 4096 values, as many whole lines as that
// makes: large tiles let neighbouring threads load neighbouring values on a strided axis, small ones
// stay in a CPU's cache. The load applies the window and fills with zeros; the store shifts and keeps a
// range of positions (CONVENTIONS eq. 14).

struct WorkgroupFftParams {
    lines: u32,
    log2_length: u32,
    // Input values a line; the rest is zero.
    count: u32,
    // Steps may be negative: addresses wrap.
    in_base: u32,
    in_line: u32,
    in_step: u32,
    out_base: u32,
    out_line: u32,
    out_step: u32,
    // Bin k goes to position (k + shift) mod length; positions first .. first + kept are stored.
    shift: u32,
    first: u32,
    kept: u32,
    // 1 where lines lie side by side in memory (in_line = 1), 0 where values of a line do.
    side_by_side: u32,
    // 10 to 12, and not less than log2_length.
    log2_tile: u32,
}

@group(0) @binding(0) var<uniform> params: WorkgroupFftParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> weights: array<f32>;
// e^(-j 2 pi i / length)
@group(0) @binding(3) var<storage, read> twiddles: array<vec2<f32>>;
@group(0) @binding(4) var<storage, read_write> spectrum: array<vec2<f32>>;

const THREADS = 256u;

var<workgroup> tile: array<vec2<f32>, 4096>;

// (line, place in the line) of element e of the tile, in the order that suits the memory.
fn place(e: u32) -> vec2<u32> {
    let log2_lines = params.log2_tile - params.log2_length;
    if params.side_by_side == 1u {
        return vec2<u32>(e & ((1u << log2_lines) - 1u), e >> log2_lines);
    }
    return vec2<u32>(e >> params.log2_length, e & ((1u << params.log2_length) - 1u));
}

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let length = 1u << params.log2_length;
    let tile_length = 1u << params.log2_tile;
    let butterflies = tile_length / (4u * THREADS);
    let first_line = linear_id(workgroup_id, num_workgroups, 0u, 1u) << (params.log2_tile - params.log2_length);

    for (var e = thread; e < tile_length; e += THREADS) {
        let at = place(e);
        let line = first_line + at.x;
        var x = vec2<f32>(0.0);
        if line < params.lines && at.y < params.count {
            x = values[params.in_base + line * params.in_line + at.y * params.in_step] * weights[at.y];
        }
        tile[(at.x << params.log2_length) + at.y] = x;
    }
    workgroupBarrier();

    var done = 1u; // length of the transforms that are finished
    let quarter = length >> 2u;
    for (var pass_ = 0u; pass_ < params.log2_length / 2u; pass_++) {
        var v: array<vec2<f32>, 16>;
        let step = quarter / done;
        for (var b = 0u; b < butterflies; b++) {
            let q = thread + b * THREADS;
            let j = q & (quarter - 1u);
            let at = ((q - j) << 2u) + j;
            let turn = (j & (done - 1u)) * step;
            let x0 = tile[at];
            let x1 = cmul(tile[at + quarter], twiddles[turn]);
            let x2 = cmul(tile[at + 2u * quarter], twiddles[2u * turn]);
            let x3 = cmul(tile[at + 3u * quarter], twiddles[3u * turn]);
            let even = x0 + x2;
            let odd = x0 - x2;
            let sum = x1 + x3;
            let turned = cmul_j(x1 - x3);
            v[4u * b] = even + sum;
            v[4u * b + 1u] = odd - turned;
            v[4u * b + 2u] = even - sum;
            v[4u * b + 3u] = odd + turned;
        }
        workgroupBarrier();
        for (var b = 0u; b < butterflies; b++) {
            let q = thread + b * THREADS;
            let j = q & (quarter - 1u);
            let k = j & (done - 1u);
            let at = ((q - k) << 2u) + k;
            tile[at] = v[4u * b];
            tile[at + done] = v[4u * b + 1u];
            tile[at + 2u * done] = v[4u * b + 2u];
            tile[at + 3u * done] = v[4u * b + 3u];
        }
        workgroupBarrier();
        done <<= 2u;
    }
    if (params.log2_length & 1u) == 1u {
        // done = length / 2: each butterfly goes back where it came from.
        for (var q = thread; q < tile_length / 2u; q += THREADS) {
            let j = q & (done - 1u);
            let at = ((q - j) << 1u) + j;
            let x0 = tile[at];
            let x1 = cmul(tile[at + done], twiddles[j]);
            tile[at] = x0 + x1;
            tile[at + done] = x0 - x1;
        }
        workgroupBarrier();
    }

    for (var e = thread; e < tile_length; e += THREADS) {
        let at = place(e);
        let line = first_line + at.x;
        let position = at.y - params.first; // wraps below first, and is then not less than kept
        if line < params.lines && position < params.kept {
            let k = (at.y - params.shift) & (length - 1u);
            spectrum[params.out_base + line * params.out_line + position * params.out_step] =
                tile[(at.x << params.log2_length) + k];
        }
    }
}
