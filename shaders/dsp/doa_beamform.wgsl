// Bartlett beamformer: power over the grid of directions for each cell (CONVENTIONS eq. 19).

struct BeamformParams {
    cells: u32,
    directions: u32,
    channels: u32,
    // Channels of each transmitter, which share a TDM slot.
    slot_channels: u32,
}

@group(0) @binding(0) var<uniform> params: BeamformParams;
// [cell, channel]
@group(0) @binding(1) var<storage, read> snapshots: array<vec2<f32>>;
// [cell, slot]: takes out the phase gathered between transmitters.
@group(0) @binding(2) var<storage, read> corrections: array<vec2<f32>>;
// [direction, channel], weighted
@group(0) @binding(3) var<storage, read> steering: array<vec2<f32>>;
// [cell, direction]
@group(0) @binding(4) var<storage, read_write> power: array<f32>;

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
    let slots = params.channels / params.slot_channels;
    var y = vec2<f32>(0.0);
    for (var slot = 0u; slot < slots; slot++) {
        var sum = vec2<f32>(0.0);
        for (var c = slot * params.slot_channels; c < (slot + 1u) * params.slot_channels; c++) {
            sum += cmul(snapshots[cell * params.channels + c], steering[direction * params.channels + c]);
        }
        y += cmul(sum, corrections[cell * slots + slot]);
    }
    power[id] = norm_sqr(y);
}
