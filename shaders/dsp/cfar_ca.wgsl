// Cell-averaging CFAR: the mean of the training cells, by rows (CONVENTIONS eq. 17).

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

var<workgroup> tile: array<f32, 4096>;

// The cell in this row (of the map, or of the tile) and column of the map.
fn power(row: u32, column: u32, corner: u32, pitch: u32) -> f32 {
    if params.tiled == 1u {
        return tile[row * pitch + column + params.half_range - corner];
    }
    return map[row * params.range_bins + column];
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
                tile[e] = map[row * params.range_bins + column - params.half_range];
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

    var sum = 0.0;
    for (var i = 0u; i <= 2u * params.half_doppler; i++) {
        let row = select((top + local.y + i) % params.doppler_bins, local.y + i, params.tiled == 1u);
        // |i - half| <= guard: the middle of the row belongs to the guard rectangle.
        let middle = i + params.guard_doppler >= params.half_doppler
            && i <= params.half_doppler + params.guard_doppler;
        var row_sum = 0.0;
        for (var c = left; c <= right; c++) {
            if middle && c == guard_left {
                c = guard_right;
                continue;
            }
            row_sum += power(row, c, corner.x, pitch);
        }
        sum += row_sum;
    }
    let mean = sum / f32(column.count);
    let at = cell.y * params.range_bins + cell.x;
    mask[at] = select(0u, 1u, map[at] > column.factor * mean);
    noise[at] = column.scale * mean;
}
