// The noise in the cells of a list, as the detector estimates it (CONVENTIONS eq. 17, 85): a mean, the
// greater or smaller of two, or the rank-th smallest training cell. That one is found by counting. Powers
// are not negative, so that their bits as whole numbers are in the same order. Between the smallest and
// the largest candidate a pivot is taken, the cells below it are counted, and the bound on the wrong side
// moves to the nearest cell; the bounds meet at the statistic itself, whatever the pivots.

struct CfarNoiseParams {
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
    // Cells that the list has room for.
    capacity: u32,
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

@group(0) @binding(0) var<uniform> params: CfarNoiseParams;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> columns: array<Column>;
// How many cells there are, then each as doppler * range_bins + range.
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read_write> noise: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, thread, 64u);
    if id >= min(cells[0], params.capacity) {
        return;
    }
    let cell = vec2<u32>(cells[1u + id] % params.range_bins, cells[1u + id] / params.range_bins);
    let column = columns[cell.x];
    // The row half_doppler above, wrapped. The window is not taller than the map.
    let top = cell.y + params.doppler_bins - params.half_doppler;
    // Both rectangles, cut to the map.
    let left = cell.x - min(cell.x, params.half_range);
    let right = min(cell.x + params.half_range, params.range_bins - 1u);
    let guard_left = cell.x - min(cell.x, params.guard_range);
    let guard_right = min(cell.x + params.guard_range, params.range_bins - 1u);

    var low = 0u;
    var high = 0x7f7fffffu; // the largest finite power
    // The first pass, with no cell below its pivot, finds the smallest and the largest.
    var first = true;
    var before = 0.0;
    var after = 0.0;
    while low < high {
        let pivot = select(low + (high - low + 1u) / 2u, 0u, first);
        var below = 0u; // cells under the pivot, and the largest of them
        var under = 0u;
        var above = 0xffffffffu; // the smallest of the others, and the largest
        var highest = 0u;
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
                let power = map[row + at];
                if params.kind == 3u {
                    let x = bitcast<u32>(power);
                    let is_below = x < pivot;
                    below += select(0u, 1u, is_below);
                    under = max(under, select(0u, x, is_below));
                    above = min(above, select(x, 0xffffffffu, is_below));
                    highest = max(highest, x);
                } else if params.kind == 0u {
                    row_after += power;
                } else if params.along_doppler == 1u {
                    row_before += select(0.0, power, i < params.half_doppler);
                    row_after += select(0.0, power, i > params.half_doppler);
                } else {
                    row_before += select(0.0, power, at < cell.x);
                    row_after += select(0.0, power, at > cell.x);
                }
            }
            before += row_before;
            after += row_after;
        }
        if params.kind != 3u {
            break;
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
    before /= f32(max(column.before, 1u));
    after /= f32(max(column.count - column.before, 1u));
    var statistic = select(min(before, after), max(before, after), params.kind == 1u);
    if column.before == 0u {
        statistic = after;
    } else if column.before == column.count {
        statistic = before;
    }
    if params.kind == 3u {
        statistic = bitcast<f32>(low);
    }
    noise[id] = column.scale * statistic;
}
