// Detected cells that no neighbour (3 x 3, Doppler wraps) exceeds, in the order of the map. Three
// dispatches: each workgroup counts in its block of the map; one workgroup turns the counts into
// places in the list; each workgroup writes from its place on. The count goes on beyond the list's
// capacity, which the host reads as overflow.

struct PeakParams {
    doppler_bins: u32,
    range_bins: u32,
    capacity: u32,
    // 0 counts, 1 sums, 2 writes.
    phase: u32,
    blocks: u32,
}

@group(0) @binding(0) var<uniform> params: PeakParams;
@group(0) @binding(1) var<storage, read> map: array<f32>;
@group(0) @binding(2) var<storage, read> mask: array<u32>;
// Of each block: first how many peaks it has, then its place in the list.
@group(0) @binding(3) var<storage, read_write> places: array<u32>;
// [0]: how many there are; then the cells as doppler * range_bins + range.
@group(0) @binding(4) var<storage, read_write> cells: array<u32>;

const THREADS = 256u;
// Neighbouring cells that one thread looks at.
const STRETCH = 16u;

var<workgroup> sums: array<u32, 256>;

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

// The sum over this thread and those before it.
fn sum_until(thread: u32, value: u32) -> u32 {
    sums[thread] = value;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step <<= 1u) {
        var sum = sums[thread];
        if thread >= step {
            sum += sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] = sum;
        workgroupBarrier();
    }
    return sums[thread];
}

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if params.phase == 1u {
        let stretch = (params.blocks + THREADS - 1u) / THREADS;
        let begin = min(thread * stretch, params.blocks);
        let end = min(begin + stretch, params.blocks);
        var sum = 0u;
        for (var b = begin; b < end; b++) {
            sum += places[b];
        }
        let until = sum_until(thread, sum);
        var place = until - sum;
        for (var b = begin; b < end; b++) {
            let count = places[b];
            places[b] = place;
            place += count;
        }
        if thread == THREADS - 1u {
            cells[0] = until;
        }
        return;
    }
    let block = linear_id(workgroup_id, num_workgroups, 0u, 1u);
    let total = params.doppler_bins * params.range_bins;
    let begin = min((block * THREADS + thread) * STRETCH, total);
    let end = min(begin + STRETCH, total);
    var found = 0u; // one bit a cell
    for (var at = begin; at < end; at++) {
        if mask[at] == 1u && stands(at) {
            found |= 1u << (at - begin);
        }
    }
    let count = countOneBits(found);
    let until = sum_until(thread, count);
    if block >= params.blocks {
        return;
    }
    if params.phase == 0u {
        if thread == THREADS - 1u {
            places[block] = until;
        }
        return;
    }
    var place = places[block] + until - count;
    for (; found != 0u && place < params.capacity; place++) {
        let bit = countTrailingZeros(found);
        cells[1u + place] = begin + bit;
        found &= found - 1u;
    }
}
