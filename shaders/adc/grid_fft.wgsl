// Lines of a grid from cells to samples (CONVENTIONS eq. 83): Stockham transforms e^(+j 2 pi k n / cells) of
// powers of two from 16 to 2048 in workgroup memory, as many lines side by side as make 2048 values, the 16 KiB that every
// adapter has. Radix 16 as often as it goes, then 8, 4 or 2; unrolled, since software drivers are slow with arrays that loops
// index and with every access to memory. A line of 4096 cells is two transforms of 2048 values, which give its even and its odd
// cells. What only some lengths take are loops, since software drivers run through every branch. Only the samples around the middle of the ramp are kept.
struct GridFftParams {
    lines: u32,
    log2_cells: u32,
    samples: u32,
    // 1 where two workgroups share a line, else 0.
    log2_parts: u32,
}

@group(0) @binding(0) var<uniform> params: GridFftParams;
// [line, cell]
@group(0) @binding(1) var<storage, read> grid: array<vec2<f32>>;
// e^(+j 2 pi i / cells)
@group(0) @binding(2) var<storage, read> turns: array<vec2<f32>>;
// [line, sample]
@group(0) @binding(3) var<storage, read_write> out: array<vec2<f32>>;

const THREADS = 128u;
const LOG2_TILE = 11u;

var<workgroup> tile: array<vec2<f32>, 2048>;
// The line of the tile's first value, and which of its parts the workgroup has.
var<private> first_line: u32;
var<private> part: u32;

fn fft4(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>, w: vec2<f32>) -> array<vec2<f32>, 4> {
    let even = x + z;
    let odd = x - z;
    let sum = y + w;
    let turned = cmul_j(y - w);
    return array<vec2<f32>, 4>(even + sum, odd + turned, even - sum, odd - turned);
}

fn fft16(v: array<vec2<f32>, 16>) -> array<vec2<f32>, 16> {
    // Cosine and sine of pi/8, and of pi/4.
    let c = 0.923879533;
    let s = 0.382683432;
    let h = 0.707106781;
    let p = fft4(v[0], v[4], v[8], v[12]);
    let q = fft4(v[1], v[5], v[9], v[13]);
    let r = fft4(v[2], v[6], v[10], v[14]);
    let t = fft4(v[3], v[7], v[11], v[15]);
    let w1 = vec2<f32>(c, s);
    let w2 = vec2<f32>(h, h);
    let w3 = vec2<f32>(s, c);
    let w6 = vec2<f32>(-h, h);
    let k0 = fft4(p[0], q[0], r[0], t[0]);
    let k1 = fft4(p[1], cmul(q[1], w1), cmul(r[1], w2), cmul(t[1], w3));
    let k2 = fft4(p[2], cmul(q[2], w2), cmul_j(r[2]), cmul(t[2], w6));
    let k3 = fft4(p[3], cmul(q[3], w3), cmul(r[3], w6), -cmul(t[3], w1));
    return array<vec2<f32>, 16>(
        k0[0], k1[0], k2[0], k3[0],
        k0[1], k1[1], k2[1], k3[1],
        k0[2], k1[2], k2[2], k3[2],
        k0[3], k1[3], k2[3], k3[3],
    );
}

fn fft8(v: array<vec2<f32>, 8>) -> array<vec2<f32>, 8> {
    let h = 0.707106781;
    let e = fft4(v[0], v[2], v[4], v[6]);
    let o = fft4(v[1], v[3], v[5], v[7]);
    let o1 = cmul(o[1], vec2<f32>(h, h));
    let o2 = cmul_j(o[2]);
    let o3 = cmul(o[3], vec2<f32>(-h, h));
    return array<vec2<f32>, 8>(
        e[0] + o[0], e[1] + o1, e[2] + o2, e[3] + o3,
        e[0] - o[0], e[1] - o1, e[2] - o2, e[3] - o3,
    );
}

// Input of radix-16 butterfly `i` after passes that finished transforms of length 2^log2_done.
fn take16(i: u32, log2_done: u32) -> array<vec2<f32>, 16> {
    let log2_length = params.log2_cells - params.log2_parts;
    let sixteenth = 1u << (log2_length - 4u);
    let j = i & (sixteenth - 1u);
    let start = ((i - j) << 4u) + j;
    let turn = (j & ((1u << log2_done) - 1u)) << (params.log2_cells - 4u - log2_done);
    var v: array<vec2<f32>, 16>;
    v[0] = tile[start];
    v[1] = cmul(tile[start + 1u * sixteenth], turns[1u * turn]);
    v[2] = cmul(tile[start + 2u * sixteenth], turns[2u * turn]);
    v[3] = cmul(tile[start + 3u * sixteenth], turns[3u * turn]);
    v[4] = cmul(tile[start + 4u * sixteenth], turns[4u * turn]);
    v[5] = cmul(tile[start + 5u * sixteenth], turns[5u * turn]);
    v[6] = cmul(tile[start + 6u * sixteenth], turns[6u * turn]);
    v[7] = cmul(tile[start + 7u * sixteenth], turns[7u * turn]);
    v[8] = cmul(tile[start + 8u * sixteenth], turns[8u * turn]);
    v[9] = cmul(tile[start + 9u * sixteenth], turns[9u * turn]);
    v[10] = cmul(tile[start + 10u * sixteenth], turns[10u * turn]);
    v[11] = cmul(tile[start + 11u * sixteenth], turns[11u * turn]);
    v[12] = cmul(tile[start + 12u * sixteenth], turns[12u * turn]);
    v[13] = cmul(tile[start + 13u * sixteenth], turns[13u * turn]);
    v[14] = cmul(tile[start + 14u * sixteenth], turns[14u * turn]);
    v[15] = cmul(tile[start + 15u * sixteenth], turns[15u * turn]);
    return v;
}

fn put16(i: u32, log2_done: u32, v: array<vec2<f32>, 16>) {
    let done = 1u << log2_done;
    let k = i & (done - 1u);
    let to = ((i - k) << 4u) + k;
    tile[to] = v[0];
    tile[to + 1u * done] = v[1];
    tile[to + 2u * done] = v[2];
    tile[to + 3u * done] = v[3];
    tile[to + 4u * done] = v[4];
    tile[to + 5u * done] = v[5];
    tile[to + 6u * done] = v[6];
    tile[to + 7u * done] = v[7];
    tile[to + 8u * done] = v[8];
    tile[to + 9u * done] = v[9];
    tile[to + 10u * done] = v[10];
    tile[to + 11u * done] = v[11];
    tile[to + 12u * done] = v[12];
    tile[to + 13u * done] = v[13];
    tile[to + 14u * done] = v[14];
    tile[to + 15u * done] = v[15];
}

// Value n of the transform that gives even cells, or of the other, of the line that begins at `start`.
fn half(start: u32, n: u32) -> vec2<f32> {
    let a = grid[start + n];
    let b = grid[start + n + (1u << LOG2_TILE)];
    return select(a + b, cmul(a - b, turns[n]), part == 1u);
}

// The last passes: each butterfly goes back where it came from.
fn last8(i: u32, log2_done: u32) {
    let eighth = 1u << log2_done;
    let k = i & (eighth - 1u);
    let start = ((i - k) << 3u) + k;
    let turn = k << params.log2_parts;
    let v = fft8(array<vec2<f32>, 8>(
        tile[start],
        cmul(tile[start + 1u * eighth], turns[1u * turn]),
        cmul(tile[start + 2u * eighth], turns[2u * turn]),
        cmul(tile[start + 3u * eighth], turns[3u * turn]),
        cmul(tile[start + 4u * eighth], turns[4u * turn]),
        cmul(tile[start + 5u * eighth], turns[5u * turn]),
        cmul(tile[start + 6u * eighth], turns[6u * turn]),
        cmul(tile[start + 7u * eighth], turns[7u * turn]),
    ));
    tile[start + 0u * eighth] = v[0];
    tile[start + 1u * eighth] = v[1];
    tile[start + 2u * eighth] = v[2];
    tile[start + 3u * eighth] = v[3];
    tile[start + 4u * eighth] = v[4];
    tile[start + 5u * eighth] = v[5];
    tile[start + 6u * eighth] = v[6];
    tile[start + 7u * eighth] = v[7];
}

fn last4(i: u32, log2_done: u32) {
    let quarter = 1u << log2_done;
    let k = i & (quarter - 1u);
    let start = ((i - k) << 2u) + k;
    let turn = k << params.log2_parts;
    let v = fft4(
        tile[start],
        cmul(tile[start + quarter], turns[turn]),
        cmul(tile[start + 2u * quarter], turns[2u * turn]),
        cmul(tile[start + 3u * quarter], turns[3u * turn]),
    );
    tile[start] = v[0];
    tile[start + quarter] = v[1];
    tile[start + 2u * quarter] = v[2];
    tile[start + 3u * quarter] = v[3];
}

fn last2(i: u32, log2_done: u32) {
    let half_length = 1u << log2_done;
    let k = i & (half_length - 1u);
    let start = ((i - k) << 1u) + k;
    let x = tile[start];
    let y = cmul(tile[start + half_length], turns[k << params.log2_parts]);
    tile[start] = x + y;
    tile[start + half_length] = x - y;
}

@compute @workgroup_size(128)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let log2_length = params.log2_cells - params.log2_parts;
    let first_transform = linear_id(workgroup_id, num_workgroups, 0u, 1u) << (LOG2_TILE - log2_length);
    first_line = first_transform >> params.log2_parts;
    part = first_transform & ((1u << params.log2_parts) - 1u);
    {
        // The first pass has nothing to turn.
        let sixteenth = 1u << (log2_length - 4u);
        let j = thread & (sixteenth - 1u);
        let local_line = thread >> (log2_length - 4u);
        var v: array<vec2<f32>, 16>;
        if params.log2_parts == 0u && first_line + local_line < params.lines {
            let start = ((first_line + local_line) << params.log2_cells) + j;
            v[0] = grid[start + 0u * sixteenth];
            v[1] = grid[start + 1u * sixteenth];
            v[2] = grid[start + 2u * sixteenth];
            v[3] = grid[start + 3u * sixteenth];
            v[4] = grid[start + 4u * sixteenth];
            v[5] = grid[start + 5u * sixteenth];
            v[6] = grid[start + 6u * sixteenth];
            v[7] = grid[start + 7u * sixteenth];
            v[8] = grid[start + 8u * sixteenth];
            v[9] = grid[start + 9u * sixteenth];
            v[10] = grid[start + 10u * sixteenth];
            v[11] = grid[start + 11u * sixteenth];
            v[12] = grid[start + 12u * sixteenth];
            v[13] = grid[start + 13u * sixteenth];
            v[14] = grid[start + 14u * sixteenth];
            v[15] = grid[start + 15u * sixteenth];
        }
        // A tile is then part of one line.
        for (var once = 0u; once < select(0u, params.log2_parts, first_line < params.lines); once++) {
            let start = first_line << params.log2_cells;
            v[0] = half(start, j + 0u * sixteenth);
            v[1] = half(start, j + 1u * sixteenth);
            v[2] = half(start, j + 2u * sixteenth);
            v[3] = half(start, j + 3u * sixteenth);
            v[4] = half(start, j + 4u * sixteenth);
            v[5] = half(start, j + 5u * sixteenth);
            v[6] = half(start, j + 6u * sixteenth);
            v[7] = half(start, j + 7u * sixteenth);
            v[8] = half(start, j + 8u * sixteenth);
            v[9] = half(start, j + 9u * sixteenth);
            v[10] = half(start, j + 10u * sixteenth);
            v[11] = half(start, j + 11u * sixteenth);
            v[12] = half(start, j + 12u * sixteenth);
            v[13] = half(start, j + 13u * sixteenth);
            v[14] = half(start, j + 14u * sixteenth);
            v[15] = half(start, j + 15u * sixteenth);
        }
        put16(thread, 0u, fft16(v));
    }
    workgroupBarrier();
    var log2_done = 4u;
    while log2_done + 4u <= log2_length {
        let v = fft16(take16(thread, log2_done));
        workgroupBarrier();
        put16(thread, log2_done, v);
        workgroupBarrier();
        log2_done += 4u;
    }
    // A tile has so many butterflies of radix 8, 4 and 2.
    let radix = log2_length - log2_done;
    for (var i = thread; i < select(0u, 2u * THREADS, radix == 3u); i += THREADS) {
        last8(i, log2_done);
    }
    for (var i = thread; i < select(0u, 4u * THREADS, radix == 2u); i += THREADS) {
        last4(i, log2_done);
    }
    for (var i = thread; i < select(0u, 8u * THREADS, radix == 1u); i += THREADS) {
        last2(i, log2_done);
    }
    workgroupBarrier();

    let cells = 1u << params.log2_cells;
    for (var i = thread; i < params.log2_parts << LOG2_TILE; i += THREADS) {
        let sample = (2u * i + part + params.samples / 2u) & (cells - 1u);
        if first_line < params.lines && sample < params.samples {
            out[first_line * params.samples + sample] = tile[i];
        }
    }
    let kept = select(0u, params.samples << (LOG2_TILE - log2_length), params.log2_parts == 0u);
    for (var i = thread; i < kept; i += THREADS) {
        let local = i / params.samples;
        let sample = i % params.samples;
        if first_line + local < params.lines {
            let cell = (sample - params.samples / 2u) & (cells - 1u);
            out[(first_line + local) * params.samples + sample] = tile[(local << params.log2_cells) + cell];
        }
    }
}
