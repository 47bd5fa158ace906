// Greatest-of and smallest-of CFAR: the means of the training cells before and after the cell, along range
// or, without training columns, along Doppler (CONVENTIONS eq. 85).
// Four neighbouring cells a thread: a load costs a CPU's driver more than the arithmetic on four. The map
// is read as it is: copying it to workgroup memory first takes twice as long there.

struct CfarGoSoParams {
    doppler_bins: u32,
    range_bins: u32,
    // Half heights and half widths of the two rectangles.
    guard_doppler: u32,
    half_doppler: u32,
    guard_range: u32,
    half_range: u32,
    // 0 cell-averaging, 1 greatest-of, 2 smallest-of, 3 order-statistic.
    kind: u32,
    // 1: the halves are rows.
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

@group(0) @binding(0) var<uniform> params: CfarGoSoParams;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> columns: array<Column>;
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;

const STEPS = vec4<u32>(0u, 1u, 2u, 3u);

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    // The first of this thread's cells, which read every power in reach of them once.
    let first = 4u * id.x;
    if first >= params.range_bins || id.y >= params.doppler_bins {
        return;
    }
    let cell = vec4<u32>(first) + STEPS;
    let inside = min(cell, vec4<u32>(params.range_bins - 1u));
    // The row half_doppler above, wrapped. The window is not taller than the map.
    let top = id.y + params.doppler_bins - params.half_doppler;
    let left = first - min(first, params.half_range);
    let right = min(first + 3u + params.half_range, params.range_bins - 1u);
    let here = id.y * params.range_bins;
    let power = vec4<f32>(map[here + inside.x], map[here + inside.y], map[here + inside.z], map[here + inside.w]);
    let factor = vec4<f32>(
        columns[inside.x].factor,
        columns[inside.y].factor,
        columns[inside.z].factor,
        columns[inside.w].factor,
    );
    let count = vec4<u32>(
        columns[inside.x].count,
        columns[inside.y].count,
        columns[inside.z].count,
        columns[inside.w].count,
    );
    let count_before = vec4<u32>(
        columns[inside.x].before,
        columns[inside.y].before,
        columns[inside.z].before,
        columns[inside.w].before,
    );
    var before = vec4<f32>(0.0);
    var after = vec4<f32>(0.0);
    for (var i = 0u; i <= 2u * params.half_doppler; i++) {
        let row = (top + i) % params.doppler_bins * params.range_bins;
        // |i - half| <= guard: the middle of the row belongs to the guard rectangle.
        let middle = i + params.guard_doppler >= params.half_doppler
            && i <= params.half_doppler + params.guard_doppler;
        var row_before = vec4<f32>(0.0);
        var row_after = vec4<f32>(0.0);
        for (var c = left; c <= right; c++) {
            let x = map[row + c];
            // From the left ends of the rectangles; wraps on their left.
            let at = vec4<u32>(c + params.half_range) - cell;
            let of_guard = vec4<u32>(c + params.guard_range) - cell;
            let trains = (at <= vec4<u32>(2u * params.half_range))
                & (vec4<bool>(!middle) | (of_guard > vec4<u32>(2u * params.guard_range)));
            var is_before = vec4<u32>(c) < cell;
            var is_after = vec4<u32>(c) > cell;
            if params.along_doppler == 1u {
                is_before = vec4<bool>(i < params.half_doppler);
                is_after = vec4<bool>(i > params.half_doppler);
            }
            row_before += select(vec4<f32>(0.0), vec4<f32>(x), trains & is_before);
            row_after += select(vec4<f32>(0.0), vec4<f32>(x), trains & is_after);
        }
        before += row_before;
        after += row_after;
    }
    before /= vec4<f32>(max(count_before, vec4<u32>(1u)));
    after /= vec4<f32>(max(count - count_before, vec4<u32>(1u)));
    var statistic = select(min(before, after), max(before, after), params.kind == 1u);
    // Next to the ends of the range axis one half may have no cells.
    statistic = select(statistic, before, count_before == count);
    statistic = select(statistic, after, count_before == vec4<u32>(0u));
    let found = power > factor * statistic;
    for (var i = 0u; i < 4u; i++) {
        if cell[i] < params.range_bins {
            mask[id.y * params.range_bins + cell[i]] = select(0u, 1u, found[i]);
        }
    }
}
