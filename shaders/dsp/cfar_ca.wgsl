// Cell-averaging CFAR: the mean of the training cells, by rows (CONVENTIONS eq. 17). The map is read as it
// is: copying it to workgroup memory first takes twice as long on a CPU's driver.

struct Params {
    doppler_bins: u32,
    range_bins: u32,
    // Half heights and half widths of the two rectangles.
    guard_doppler: u32,
    half_doppler: u32,
    guard_range: u32,
    half_range: u32,
}

// How a cell of this range column is judged.
struct Column {
    count: u32,
    // Of the half before.
    before: u32,
    rank: u32,
    factor: f32,
    scale: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> columns: array<Column>;
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) cell: vec3<u32>) {
    if cell.x >= params.range_bins || cell.y >= params.doppler_bins {
        return;
    }
    let column = columns[cell.x];
    // The row half_doppler above, wrapped. The window is not taller than the map.
    let top = cell.y + params.doppler_bins - params.half_doppler;
    // Both rectangles, cut to the map.
    let left = cell.x - min(cell.x, params.half_range);
    let right = min(cell.x + params.half_range, params.range_bins - 1u);
    let guard_left = cell.x - min(cell.x, params.guard_range);
    let guard_right = min(cell.x + params.guard_range, params.range_bins - 1u);

    var sum = 0.0;
    for (var i = 0u; i <= 2u * params.half_doppler; i++) {
        let row = (top + i) % params.doppler_bins * params.range_bins;
        // |i - half| <= guard: the middle of the row belongs to the guard rectangle and is skipped.
        let middle = i + params.guard_doppler >= params.half_doppler
            && i <= params.half_doppler + params.guard_doppler;
        let skip = select(0u, guard_right + 1u - guard_left, middle);
        let end = right + 1u - skip;
        var row_sum = 0.0;
        for (var c = left; c < end; c++) {
            row_sum += map[row + c + select(0u, skip, c >= guard_left)];
        }
        sum += row_sum;
    }
    let mean = sum / f32(column.count);
    let at = cell.y * params.range_bins + cell.x;
    mask[at] = select(0u, 1u, map[at] > column.factor * mean);
}
