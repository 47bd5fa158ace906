// Copies the pieces of each thread of `view_hide` to where prefix sums put them: those that are through, and those that go on.

@group(0) @binding(0) var<uniform> params: ViewParams;
@group(0) @binding(1) var<storage, read> scratch: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> done: array<u32>;
@group(0) @binding(3) var<storage, read> going: array<u32>;
@group(0) @binding(4) var<storage, read_write> finished: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> pieces: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = linear_id(workgroup, workgroups, local, 64u);
    if thread >= params.threads {
        return;
    }
    let through = done[thread + 1u] - done[thread];
    let on = going[thread + 1u] - going[thread];
    for (var i = 0u; i < through + on; i += 1u) {
        let n = 2u + 2u * (scratch[(i * PIECE) * params.threads + thread].z & 0xffu);
        for (var w = 0u; w < n; w += 1u) {
            let word = scratch[(i * PIECE + w) * params.threads + thread];
            if i < through {
                finished[(done[thread] + i) * PIECE + w] = word;
            } else {
                pieces[(going[thread] + i - through) * PIECE + w] = word;
            }
        }
    }
}
