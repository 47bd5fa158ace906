// Order-statistic CFAR: the rank-th smallest training cell, found by counting. Powers are not negative,
// so that their bits as whole numbers are in the same order. Between the smallest and the largest
// candidate a pivot is taken, the cells below it are counted, and the bound on the wrong side moves to
// the nearest cell; the bounds meet at the statistic itself, whatever the pivots (CONVENTIONS eq. 17).

struct Params {
    doppler_bins: u32,
    range_bins: u32,
    // Half heights and half widths of the two rectangles.
    guard_doppler: u32,
    half_doppler: u32,
    guard_range: u32,
    half_range: u32,
    // 1 when the tile of a workgroup fits into its memory, else the map is read as it is.
    tiled: u32,
}

// How a cell of this range column is judged.
struct Column {
    count: u32,
    rank: u32,
    factor: f32,
    scale: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> columns: array<Column>;
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;
@group(0) @binding(4) var<storage, read_write> noise: array<f32>;

const WIDTH = 16u;
const HEIGHT = 16u;

var<workgroup> tile: array<u32, 4096>;

// The cell in this row (of the map, or of the tile) and column of the map.
fn power(row: u32, column: u32, corner: u32, pitch: u32) -> u32 {
    if params.tiled == 1u {
        return tile[row * pitch + column + params.half_range - corner];
    }
    return bitcast<u32>(map[row * params.range_bins + column]);
}

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) workgroup_id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let corner = vec2<u32>(workgroup_id.x * WIDTH, workgroup_id.y * HEIGHT);
    let pitch = WIDTH + 2u * params.half_range;
    // The row half_doppler above the workgroup's first, wrapped. The window is not taller than the map.
    let top = corner.y + params.doppler_bins - params.half_doppler;
    if params.tiled == 1u {
        let words = pitch * (HEIGHT + 2u * params.half_doppler);
        for (var e = thread; e < words; e += WIDTH * HEIGHT) {
            let column = corner.x + e % pitch;
            if column >= params.half_range && column - params.half_range < params.range_bins {
                let row = (top + e / pitch) % params.doppler_bins;
                tile[e] = bitcast<u32>(map[row * params.range_bins + column - params.half_range]);
            }
        }
    }
    workgroupBarrier();
    let local = vec2<u32>(thread % WIDTH, thread / WIDTH);
    let cell = corner + local;
    if cell.x >= params.range_bins || cell.y >= params.doppler_bins {
        return;
    }
    let column = columns[cell.x];
    // Both rectangles, cut to the map.
    let left = cell.x - min(cell.x, params.half_range);
    let right = min(cell.x + params.half_range, params.range_bins - 1u);
    let guard_left = cell.x - min(cell.x, params.guard_range);
    let guard_right = min(cell.x + params.guard_range, params.range_bins - 1u);

    var low = 0u;
    var high = 0x7f7fffffu; // the largest finite power
    // The first pass, with no cell below its pivot, finds the smallest and the largest.
    var first = true;
    while low < high {
        let pivot = select(low + (high - low + 1u) / 2u, 0u, first);
        var below = 0u; // cells under the pivot, and the largest of them
        var under = 0u;
        var above = 0xffffffffu; // the smallest of the others, and the largest
        var highest = 0u;
        for (var i = 0u; i <= 2u * params.half_doppler; i++) {
            let row = select((top + local.y + i) % params.doppler_bins, local.y + i, params.tiled == 1u);
            // |i - half| <= guard: the middle of the row belongs to the guard rectangle.
            let middle = i + params.guard_doppler >= params.half_doppler
                && i <= params.half_doppler + params.guard_doppler;
            for (var c = left; c <= right; c++) {
                if middle && c == guard_left {
                    c = guard_right;
                    continue;
                }
                let x = power(row, c, corner.x, pitch);
                let is_below = x < pivot;
                below += select(0u, 1u, is_below);
                under = max(under, select(0u, x, is_below));
                above = min(above, select(x, 0xffffffffu, is_below));
                highest = max(highest, x);
            }
        }
        if first {
            first = false;
            low = above;
            high = highest;
        } else if below >= column.rank {
            high = under;
            if below == column.rank {
                low = under;
            }
        } else {
            low = above;
            if below + 1u == column.rank {
                high = above;
            }
        }
    }
    let statistic = bitcast<f32>(low);
    let at = cell.y * params.range_bins + cell.x;
    mask[at] = select(0u, 1u, map[at] > column.factor * statistic);
    noise[at] = column.scale * statistic;
}
