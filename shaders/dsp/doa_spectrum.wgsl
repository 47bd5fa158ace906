// Quadratic forms a^H F F^H a over the grid of directions for each cell (CONVENTIONS eq. 94).

struct DoaSpectrumParams {
    cells: u32,
    directions: u32,
    channels: u32,
    // Columns of each factor.
    rank: u32,
}

@group(0) @binding(0) var<uniform> params: DoaSpectrumParams;
// [cell, column, channel]
@group(0) @binding(1) var<storage, read> factors: array<vec2<f32>>;
// [channel, direction]
@group(0) @binding(2) var<storage, read> steering: array<vec2<f32>>;
// [cell, direction]
@group(0) @binding(3) var<storage, read_write> forms: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, thread, 64u);
    if id >= params.cells * params.directions {
        return;
    }
    let cell = id / params.directions;
    let direction = id % params.directions;
    var sum = 0.0;
    for (var column = 0u; column < params.rank; column++) {
        let first = (cell * params.rank + column) * params.channels;
        var y = vec2<f32>(0.0);
        for (var c = 0u; c < params.channels; c++) {
            y += cmul_conj(steering[c * params.directions + direction], factors[first + c]);
        }
        sum += norm_sqr(y);
    }
    forms[id] = sum;
}
