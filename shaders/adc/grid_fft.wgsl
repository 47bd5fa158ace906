// Lines of a grid from cells to samples (CONVENTIONS eq. 83): Stockham transforms e^(+j 2 pi k n / cells) of
// powers of two up to 4096 in workgroup memory, radix 4 with a last radix-2 pass for odd powers, as many
// lines side by side as make 1024 values. Only the samples around the middle of the ramp are kept.
struct Params {
    lines: u32,
    log2_cells: u32,
    samples: u32,
    // Not less than log2_cells, 10 to 12.
    log2_tile: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// [line, cell]
@group(0) @binding(1) var<storage, read> grid: array<vec2<f32>>;
// e^(+j 2 pi i / cells)
@group(0) @binding(2) var<storage, read> turns: array<vec2<f32>>;
// [line, sample]
@group(0) @binding(3) var<storage, read_write> out: array<vec2<f32>>;

const THREADS = 256u;

var<workgroup> tile: array<vec2<f32>, 4096>;

// Radix-4 butterfly `i` of the pass after `log2_done`.
fn butterfly(i: u32, log2_done: u32) -> array<vec2<f32>, 4> {
    let quarter = 1u << (params.log2_cells - 2u);
    let j = i & (quarter - 1u);
    let start = ((i - j) << 2u) + j;
    let turn = (j & ((1u << log2_done) - 1u)) << (params.log2_cells - 2u - log2_done);
    let x = tile[start];
    let y = cmul(tile[start + quarter], turns[turn]);
    let z = cmul(tile[start + 2u * quarter], turns[2u * turn]);
    let w = cmul(tile[start + 3u * quarter], turns[3u * turn]);
    let even = x + z;
    let odd = x - z;
    let sum = y + w;
    let turned = cmul_j(y - w);
    return array<vec2<f32>, 4>(even + sum, odd + turned, even - sum, odd - turned);
}

fn put(i: u32, log2_done: u32, v: array<vec2<f32>, 4>) {
    let done = 1u << log2_done;
    let k = i & (done - 1u);
    let to = ((i - k) << 2u) + k;
    tile[to] = v[0];
    tile[to + done] = v[1];
    tile[to + 2u * done] = v[2];
    tile[to + 3u * done] = v[3];
}

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let cells = 1u << params.log2_cells;
    let values = 1u << params.log2_tile;
    let first_line = linear_id(workgroup_id, num_workgroups, 0u, 1u) << (params.log2_tile - params.log2_cells);
    for (var i = thread; i < values; i += THREADS) {
        var x = vec2<f32>();
        if first_line + (i >> params.log2_cells) < params.lines {
            x = grid[(first_line << params.log2_cells) + i];
        }
        tile[i] = x;
    }
    workgroupBarrier();

    // Up to four butterflies a thread, by name: software drivers are slow with arrays that loops index.
    let several = params.log2_tile > 10u;
    let many = params.log2_tile > 11u;
    var log2_done = 0u; // of the length of the transforms that are finished
    while log2_done + 2u <= params.log2_cells {
        let a = butterfly(thread, log2_done);
        var b = a;
        var c = a;
        var d = a;
        if several {
            b = butterfly(thread + THREADS, log2_done);
        }
        if many {
            c = butterfly(thread + 2u * THREADS, log2_done);
            d = butterfly(thread + 3u * THREADS, log2_done);
        }
        workgroupBarrier();
        put(thread, log2_done, a);
        if several {
            put(thread + THREADS, log2_done, b);
        }
        if many {
            put(thread + 2u * THREADS, log2_done, c);
            put(thread + 3u * THREADS, log2_done, d);
        }
        workgroupBarrier();
        log2_done += 2u;
    }
    if log2_done < params.log2_cells {
        let half = cells >> 1u;
        for (var i = thread; i < values / 2u; i += THREADS) {
            let j = i & (half - 1u);
            let at = ((i - j) << 1u) + j;
            let x = tile[at];
            let y = cmul(tile[at + half], turns[j]);
            tile[at] = x + y;
            tile[at + half] = x - y;
        }
        workgroupBarrier();
    }

    let kept = params.samples << (params.log2_tile - params.log2_cells);
    for (var i = thread; i < kept; i += THREADS) {
        let local = i / params.samples;
        let sample = i % params.samples;
        if first_line + local < params.lines {
            let cell = (sample - params.samples / 2u) & (cells - 1u);
            out[(first_line + local) * params.samples + sample] = tile[(local << params.log2_cells) + cell];
        }
    }
}
