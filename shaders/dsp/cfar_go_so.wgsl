// Greatest-of and smallest-of CFAR: the means of the training cells before and after the cell, along range
// or, without training columns, along Doppler (CONVENTIONS eq. 85).

struct Params {
    doppler_bins: u32,
    range_bins: u32,
    // Half heights and half widths of the two rectangles.
    guard_doppler: u32,
    half_doppler: u32,
    guard_range: u32,
    half_range: u32,
    // 0 cell-averaging, 1 greatest-of, 2 smallest-of, 3 order-statistic.
    kind: u32,
    // 1: the halves of 1 and 2 are rows.
    along_doppler: u32,
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

    var before = 0.0;
    var after = 0.0;
    for (var i = 0u; i <= 2u * params.half_doppler; i++) {
        let row = (top + i) % params.doppler_bins * params.range_bins;
        // |i - half| <= guard: the middle of the row belongs to the guard rectangle and is skipped.
        let middle = i + params.guard_doppler >= params.half_doppler
            && i <= params.half_doppler + params.guard_doppler;
        let skip = select(0u, guard_right + 1u - guard_left, middle);
        let end = right + 1u - skip;
        var row_before = 0.0;
        var row_after = 0.0;
        for (var c = left; c < end; c++) {
            let at = c + select(0u, skip, c >= guard_left);
            let x = map[row + at];
            if params.along_doppler == 1u {
                row_before += select(0.0, x, i < params.half_doppler);
                row_after += select(0.0, x, i > params.half_doppler);
            } else {
                row_before += select(0.0, x, at < cell.x);
                row_after += select(0.0, x, at > cell.x);
            }
        }
        before += row_before;
        after += row_after;
    }
    before /= f32(max(column.before, 1u));
    after /= f32(max(column.count - column.before, 1u));
    var statistic = select(min(before, after), max(before, after), params.kind == 1u);
    // Next to the ends of the range axis one half may have no cells.
    if column.before == 0u {
        statistic = after;
    } else if column.before == column.count {
        statistic = before;
    }
    let at = cell.y * params.range_bins + cell.x;
    mask[at] = select(0u, 1u, map[at] > column.factor * statistic);
}
