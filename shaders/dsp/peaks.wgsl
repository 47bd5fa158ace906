// Detected cells that no neighbour (3 x 3, Doppler wraps) exceeds, in the order of the map. One
// workgroup: each thread counts in its own stretch of the map, a prefix sum gives it its place in the
// list, and it writes. The count goes on beyond the list's capacity, which the host reads as overflow.

struct Params {
    doppler_bins: u32,
    range_bins: u32,
    capacity: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> mask: array<u32>;
// [0]: how many there are; then the cells as doppler * range_bins + range.
@group(0) @binding(3) var<storage, read_write> cells: array<u32>;

const THREADS = 256u;

var<workgroup> counts: array<u32, 256>;

// Of equal neighbours the first in the map stands.
fn stands(at: u32) -> bool {
    let row = at / params.range_bins;
    let column = at % params.range_bins;
    let here = map[at];
    let left = column - min(column, 1u);
    let right = min(column + 1u, params.range_bins - 1u);
    for (var i = 0u; i < 3u; i++) {
        let start = (row + params.doppler_bins + i - 1u) % params.doppler_bins * params.range_bins;
        for (var c = left; c <= right; c++) {
            let other = start + c;
            if map[other] > here || (map[other] == here && other < at) {
                return false;
            }
        }
    }
    return true;
}

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) thread: u32) {
    let total = params.doppler_bins * params.range_bins;
    let stretch = (total + THREADS - 1u) / THREADS;
    let begin = min(thread * stretch, total);
    let end = min(begin + stretch, total);
    var count = 0u;
    for (var at = begin; at < end; at++) {
        if mask[at] == 1u && stands(at) {
            count++;
        }
    }
    counts[thread] = count;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step <<= 1u) {
        var sum = counts[thread];
        if thread >= step {
            sum += counts[thread - step];
        }
        workgroupBarrier();
        counts[thread] = sum;
        workgroupBarrier();
    }
    if thread == THREADS - 1u {
        cells[0] = counts[thread];
    }
    var slot = counts[thread] - count;
    for (var at = begin; at < end && slot < params.capacity; at++) {
        if mask[at] == 1u && stands(at) {
            cells[1u + slot] = at;
            slot++;
        }
    }
}
