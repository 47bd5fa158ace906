// Takes out of every column of a cube its mean over the chirps (CONVENTIONS eq. 88). A cube lies in pieces
// of some chirps: each adds its sums to what those before it left, in order, and then gives up the mean.

struct Params {
    chirps: u32,
    columns: u32,
    // 0 sums, 1 subtracts.
    phase: u32,
    // 1: the first piece.
    start: u32,
    // 1 / all chirps.
    share: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> cube: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> sums: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let column = linear_id(workgroup_id, num_workgroups, thread, 64u);
    if column >= params.columns {
        return;
    }
    if params.phase == 0u {
        var sum = vec2<f32>(0.0);
        var at = column;
        for (var m = 0u; m < params.chirps; m++) {
            sum += cube[at];
            at += params.columns;
        }
        if params.start == 0u {
            sum += sums[column];
        }
        sums[column] = sum;
    } else {
        let mean = sums[column] * params.share;
        var at = column;
        for (var m = 0u; m < params.chirps; m++) {
            cube[at] -= mean;
            at += params.columns;
        }
    }
}
