// Copies the pieces of each thread of `view_hide` to where prefix sums put them: those that are through one behind the other, without
// the words that they do not need, and those that go on as `view_hide` takes them. What has no room is left out.

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
    var slot = 0u;
    var to = done[thread];
    let behind = done[thread + 1u];
    while to < behind {
        let n = 2u + 2u * (scratch[(slot * PIECE) * params.threads + thread].z & 0xffu);
        for (var w = 0u; w < n && to + w < params.room; w += 1u) {
            finished[to + w] = scratch[(slot * PIECE + w) * params.threads + thread];
        }
        to += n;
        slot += 1u;
    }
    for (var i = going[thread]; i < min(going[thread + 1u], params.room_on); i += 1u) {
        let n = 2u + 2u * (scratch[(slot * PIECE) * params.threads + thread].z & 0xffu);
        for (var w = 0u; w < n; w += 1u) {
            pieces[i * PIECE + w] = scratch[(slot * PIECE + w) * params.threads + thread];
        }
        slot += 1u;
    }
}
