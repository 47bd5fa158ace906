// Batched FFT of power-of-two lengths up to 4096: Stockham autosort, radix 4, with a last radix-2
// pass for odd powers. A workgroup works on a tile of 1024 to 4096 values, as many whole lines as that
// makes: large tiles let neighbouring threads load neighbouring values on a strided axis, small ones
// stay in a CPU's cache. Values stay with their threads; between passes real parts and then imaginary
// parts change places through workgroup memory, so that 4096 values need the 16 KiB that every adapter
// has. The load applies the window and fills with zeros; the store shifts and keeps a range of positions
// (CONVENTIONS eq. 14).

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

var<workgroup> tile: array<f32, 4096>;

// Values 0 .. radix - 1 of the thread's first butterfly, then those of its next ones. Loops over them have constant
// bounds, so that drivers unroll them and keep the values in registers.
var<private> v: array<vec2<f32>, 16>;

// (line of the tile, place in the line) of butterfly `q`, of which a line has 2^log2_butterflies, in the order that suits
// the memory of the cube.
fn place(q: u32, log2_butterflies: u32) -> vec2<u32> {
    let log2_lines = params.log2_tile - params.log2_length;
    if params.side_by_side == 1u {
        return vec2<u32>(q & ((1u << log2_lines) - 1u), q >> log2_lines);
    }
    return vec2<u32>(q >> log2_butterflies, q & ((1u << log2_butterflies) - 1u));
}

// Where a value of a line changes places; neighbouring threads have neighbouring words.
fn slot(line: u32, position: u32) -> u32 {
    let log2_lines = params.log2_tile - params.log2_length;
    return select(
        (line << params.log2_length) + position,
        (position << log2_lines) + line,
        params.side_by_side == 1u,
    );
}

// Where value i of the thread goes after a pass of radix 2^log2_radix.
fn slot_after(thread: u32, i: u32, log2_radix: u32, log2_done: u32) -> u32 {
    let at = place(thread + (i >> log2_radix) * THREADS, params.log2_length - log2_radix);
    let k = at.y & ((1u << log2_done) - 1u);
    let r = i & ((1u << log2_radix) - 1u);
    return slot(at.x, ((at.y - k) << log2_radix) + k + (r << log2_done));
}

// Where value i of the thread comes from before a pass of radix 2^log2_radix.
fn slot_before(thread: u32, i: u32, log2_radix: u32) -> u32 {
    let log2_butterflies = params.log2_length - log2_radix;
    let at = place(thread + (i >> log2_radix) * THREADS, log2_butterflies);
    let r = i & ((1u << log2_radix) - 1u);
    return slot(at.x, at.y + (r << log2_butterflies));
}

fn load(first_line: u32, line_of_tile: u32, position: u32) -> vec2<f32> {
    let line = first_line + line_of_tile;
    if line < params.lines && position < params.count {
        return values[params.in_base + line * params.in_line + position * params.in_step] * weights[position];
    }
    return vec2<f32>(0.0);
}

fn store(first_line: u32, line_of_tile: u32, bin: u32, value: vec2<f32>) {
    let line = first_line + line_of_tile;
    // Wraps below first, and is then not less than kept.
    let position = ((bin + params.shift) & ((1u << params.log2_length) - 1u)) - params.first;
    if line < params.lines && position < params.kept {
        spectrum[params.out_base + line * params.out_line + position * params.out_step] = value;
    }
}

// The thread's butterflies, after passes that finished transforms of length 2^log2_done.
fn butterflies4(thread: u32, count: u32, log2_done: u32) {
    let log2_quarter = params.log2_length - 2u;
    for (var b = 0u; b < 4u; b++) {
        if 4u * b < count {
            let j = place(thread + b * THREADS, log2_quarter).y;
            let turn = (j & ((1u << log2_done) - 1u)) << (log2_quarter - log2_done);
            let x0 = v[4u * b];
            let x1 = cmul(v[4u * b + 1u], twiddles[turn]);
            let x2 = cmul(v[4u * b + 2u], twiddles[2u * turn]);
            let x3 = cmul(v[4u * b + 3u], twiddles[3u * turn]);
            let even = x0 + x2;
            let odd = x0 - x2;
            let sum = x1 + x3;
            let turned = cmul_j(x1 - x3);
            v[4u * b] = even + sum;
            v[4u * b + 1u] = odd - turned;
            v[4u * b + 2u] = even - sum;
            v[4u * b + 3u] = odd + turned;
        }
    }
}

// The last pass of odd powers, with length / 2 done.
fn butterflies2(thread: u32, count: u32) {
    for (var b = 0u; b < 8u; b++) {
        if 2u * b < count {
            let j = place(thread + b * THREADS, params.log2_length - 1u).y;
            let x0 = v[2u * b];
            let x1 = cmul(v[2u * b + 1u], twiddles[j]);
            v[2u * b] = x0 + x1;
            v[2u * b + 1u] = x0 - x1;
        }
    }
}

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let first_line = linear_id(workgroup_id, num_workgroups, 0u, 1u) << (params.log2_tile - params.log2_length);
    // Values of a thread.
    let count = (1u << params.log2_tile) / THREADS;
    var log2_done = 0u;
    var log2_radix = min(params.log2_length, 2u);
    for (var i = 0u; i < 16u; i++) {
        if i < count {
            let log2_butterflies = params.log2_length - log2_radix;
            let at = place(thread + (i >> log2_radix) * THREADS, log2_butterflies);
            let r = i & ((1u << log2_radix) - 1u);
            v[i] = load(first_line, at.x, at.y + (r << log2_butterflies));
        }
    }
    loop {
        if log2_radix == 2u {
            butterflies4(thread, count, log2_done);
        } else if log2_radix == 1u {
            butterflies2(thread, count);
        }
        if log2_done + log2_radix == params.log2_length {
            break;
        }
        let next_radix = min(params.log2_length - log2_done - log2_radix, 2u);
        for (var i = 0u; i < 16u; i++) {
            if i < count {
                tile[slot_after(thread, i, log2_radix, log2_done)] = v[i].x;
            }
        }
        workgroupBarrier();
        // Each value keeps the imaginary part of the one that it was until that has its place.
        for (var i = 0u; i < 16u; i++) {
            if i < count {
                v[i].x = tile[slot_before(thread, i, next_radix)];
            }
        }
        workgroupBarrier();
        for (var i = 0u; i < 16u; i++) {
            if i < count {
                tile[slot_after(thread, i, log2_radix, log2_done)] = v[i].y;
            }
        }
        workgroupBarrier();
        for (var i = 0u; i < 16u; i++) {
            if i < count {
                v[i].y = tile[slot_before(thread, i, next_radix)];
            }
        }
        workgroupBarrier();
        log2_done += log2_radix;
        log2_radix = next_radix;
    }
    for (var i = 0u; i < 16u; i++) {
        if i < count {
            let at = place(thread + (i >> log2_radix) * THREADS, params.log2_length - log2_radix);
            let r = i & ((1u << log2_radix) - 1u);
            store(first_line, at.x, at.y + (r << log2_done), v[i]);
        }
    }
}
