// Exclusive prefix sums in blocks of 1024, by levels. mode 0: each block on its own, its total to `totals`;
// mode 1: adds the scanned totals to their blocks.

struct PrefixSumParams {
    count: u32,
    mode: u32,
}

@group(0) @binding(0) var<uniform> params: PrefixSumParams;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@group(0) @binding(2) var<storage, read_write> totals: array<u32>;

var<workgroup> sums: array<u32, 256>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = linear_id(workgroup, workgroups, local, 256u);
    let block = thread / 256u;
    let first = thread * 4u;
    if params.mode == 1u {
        for (var i = first; i < min(first + 4u, params.count); i += 1u) {
            values[i] += totals[block];
        }
        return;
    }
    var own = array<u32, 4>();
    var sum = 0u;
    for (var i = 0u; i < 4u; i += 1u) {
        own[i] = sum;
        if first + i < params.count {
            sum += values[first + i];
        }
    }
    sums[local] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < 256u; reach *= 2u) {
        var before = 0u;
        if local >= reach {
            before = sums[local - reach];
        }
        workgroupBarrier();
        sums[local] += before;
        workgroupBarrier();
    }
    let offset = sums[local] - sum;
    for (var i = 0u; i < 4u; i += 1u) {
        if first + i < params.count {
            values[first + i] = own[i] + offset;
        }
    }
    if local == 255u && block * 1024u < params.count {
        totals[block] = sums[255];
    }
}
