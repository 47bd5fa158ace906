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

    let quarter = cells >> 2u;
    let butterflies = values / (4u * THREADS);
    var log2_done = 0u; // of the length of the transforms that are finished
    while log2_done + 2u <= params.log2_cells {
        let done = 1u << log2_done;
        var v: array<vec2<f32>, 16>;
        for (var b = 0u; b < butterflies; b++) {
            let i = thread + b * THREADS;
            let j = i & (quarter - 1u);
            let start = ((i - j) << 2u) + j;
            let turn = (j & (done - 1u)) << (params.log2_cells - 2u - log2_done);
            let x = tile[start];
            let y = cmul(tile[start + quarter], turns[turn]);
            let z = cmul(tile[start + 2u * quarter], turns[2u * turn]);
            let w = cmul(tile[start + 3u * quarter], turns[3u * turn]);
            v[4u * b] = (x + z) + (y + w);
            v[4u * b + 1u] = (x - z) + cmul_j(y - w);
            v[4u * b + 2u] = (x + z) - (y + w);
            v[4u * b + 3u] = (x - z) - cmul_j(y - w);
        }
        workgroupBarrier();
        for (var b = 0u; b < butterflies; b++) {
            let i = thread + b * THREADS;
            let k = i & (done - 1u);
            let to = ((i - k) << 2u) + k;
            for (var r = 0u; r < 4u; r++) {
                tile[to + r * done] = v[4u * b + r];
            }
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
