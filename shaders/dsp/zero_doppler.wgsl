// Takes out of every column of a cube what rests (CONVENTIONS eq. 88): of chirps that are a period apart, a
// projection of the sums over such chirps; with a period of one the mean. A cube lies in pieces of some
// chirps: each adds its sums to what those before it left, in order, and then gives up what rests.

struct ZeroDopplerParams {
    chirps: u32,
    columns: u32,
    // 0 sums, 1 subtracts.
    phase: u32,
    // 1: the first piece.
    start: u32,
    // Of the piece in the cube.
    first_chirp: u32,
    period: u32,
}

@group(0) @binding(0) var<uniform> params: ZeroDopplerParams;
@group(0) @binding(1) var<storage, read_write> cube: array<vec2<f32>>;
// [chirp of a period, column]
@group(0) @binding(2) var<storage, read_write> sums: array<vec2<f32>>;
// [chirp of a period, chirp of a period]
@group(0) @binding(3) var<storage, read> projection: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, thread, 64u);
    if id >= params.columns * params.period {
        return;
    }
    let column = id % params.columns;
    let chirp = id / params.columns;
    // The first of the piece that lies whole periods from this one.
    let first = (chirp + params.period - params.first_chirp % params.period) % params.period;
    var at = first * params.columns + column;
    let step = params.period * params.columns;
    if params.phase == 0u {
        var sum = vec2<f32>(0.0);
        for (var m = first; m < params.chirps; m += params.period) {
            sum += cube[at];
            at += step;
        }
        if params.start == 0u {
            sum += sums[id];
        }
        sums[id] = sum;
    } else {
        var rest = vec2<f32>(0.0);
        for (var j = 0u; j < params.period; j++) {
            rest += cmul(projection[chirp * params.period + j], sums[j * params.columns + column]);
        }
        for (var m = first; m < params.chirps; m += params.period) {
            cube[at] -= rest;
            at += step;
        }
    }
}
