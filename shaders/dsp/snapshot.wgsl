// The channels of the listed cells, out of one chunk of the spectrum.

struct SnapshotParams {
    capacity: u32,
    // of all the cube
    channels: u32,
    range_bins: u32,
    // of this chunk
    first_channel: u32,
    chunk_channels: u32,
    first_range: u32,
    ranges: u32,
    // Doppler bands: as channels in front of the others, in the spectrum the first, then from the last down.
    bands: u32,
    doppler_bins: u32,
}

@group(0) @binding(0) var<uniform> params: SnapshotParams;
@group(0) @binding(1) var<storage, read> spectrum: array<vec2<f32>>;
// [0]: how many there are; then the cells as doppler * range_bins + range.
@group(0) @binding(2) var<storage, read> cells: array<u32>;
@group(0) @binding(3) var<storage, read_write> snapshots: array<vec2<f32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, thread, 64u);
    let channels = params.bands * params.chunk_channels;
    let slot = id / channels;
    let band = id % channels / params.chunk_channels;
    let c = id % params.chunk_channels;
    if slot >= min(params.capacity, cells[0]) {
        return;
    }
    let row = cells[1u + slot] / params.range_bins;
    // Wraps below first_range, and is then not less than ranges.
    let range = cells[1u + slot] % params.range_bins - params.first_range;
    if range < params.ranges {
        let stored = select(params.bands - band, 0u, band == 0u);
        let line = (stored * params.doppler_bins + row) * params.chunk_channels + c;
        snapshots[(slot * params.bands + band) * params.channels + params.first_channel + c] =
            spectrum[line * params.ranges + range];
    }
}
