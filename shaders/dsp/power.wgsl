// Power summed over the channels of one chunk of the spectrum, on top of what the chunks before it
// left in the map; the last chunk turns the sum into the mean. Channels are added in their order, each with
// its Doppler bands, so that chunking does not change a bit.

struct PowerMapParams {
    doppler_bins: u32,
    // of this chunk
    channels: u32,
    ranges: u32,
    first_range: u32,
    // of the map
    range_bins: u32,
    // 1 for the first channels: the map holds nothing yet.
    start: u32,
    // 1 / all channels and bands with the last ones, else 1.
    scale: f32,
    bands: u32,
}

@group(0) @binding(0) var<uniform> params: PowerMapParams;
@group(0) @binding(1) var<storage, read> spectrum: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> map: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, thread, 64u);
    if id >= params.doppler_bins * params.ranges {
        return;
    }
    let row = id / params.ranges;
    let range = id % params.ranges;
    let at = row * params.range_bins + params.first_range + range;
    var sum = 0.0;
    if params.start == 0u {
        sum = map[at];
    }
    let band_size = params.doppler_bins * params.channels * params.ranges;
    for (var c = 0u; c < params.channels; c++) {
        var place = (row * params.channels + c) * params.ranges + range;
        for (var b = 0u; b < params.bands; b++) {
            sum += norm_sqr(spectrum[place]);
            place += band_size;
        }
    }
    map[at] = sum * params.scale;
}
