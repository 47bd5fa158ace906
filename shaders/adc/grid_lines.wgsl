// Adds up the lines of a block at each of its samples (CONVENTIONS eq. 84): polynomials in e^(+-2 pi j t D) from the
// outermost lines to the middle one. A thread works on one sample of four chirps.
struct GridLinesParams {
    // Of the cube's piece.
    first_chirp: u32,
    chirps: u32,
    cube_channels: u32,
    // Of this dispatch.
    first_channel: u32,
    channels: u32,
    samples: u32,
    blocks: u32,
    // Chirps of a block.
    block: u32,
    lines: u32,
    // 1: add to what the cube holds. 0: overwrite it.
    accumulate: u32,
    // 1: real sampling.
    is_real: u32,
    // 1: the block has one chirp, which goes into every chirp of the piece.
    copies: u32,
}

@group(0) @binding(0) var<uniform> params: GridLinesParams;
// [channel, block, line, sample]
@group(0) @binding(1) var<storage, read> lines: array<vec2<f32>>;
// [chirp of a block, sample]: e^(2 pi j t D), then the factor of the sum.
@group(0) @binding(2) var<storage, read> steps: array<vec4<f32>>;
// [chirp, channel, sample]
@group(0) @binding(3) var<storage, read_write> cube: array<vec2<f32>>;

fn put(chirp: u32, channel: u32, sample: u32, value: vec2<f32>) {
    let at = (chirp * params.cube_channels + channel) * params.samples + sample;
    if params.accumulate != 0u {
        cube[at] += value;
    } else {
        cube[at] = value;
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    let fours = (params.block + 3u) / 4u;
    let sample = id % params.samples;
    let first = 4u * (id / params.samples % fours);
    let block = id / (params.samples * fours) % params.blocks;
    let channel = id / (params.samples * fours * params.blocks);
    if channel >= params.channels {
        return;
    }
    var c: vec4<f32>;
    var s: vec4<f32>;
    var factor: array<vec2<f32>, 4>;
    for (var k = 0u; k < 4u; k++) {
        let step = steps[min(first + k, params.block - 1u) * params.samples + sample];
        c[k] = step.x;
        s[k] = step.y;
        factor[k] = step.zw;
    }
    let base = (channel * params.blocks + block) * params.lines * params.samples + sample;
    let middle = params.lines / 2u;
    var x = vec4<f32>();
    var y = vec4<f32>();
    for (var l = params.lines; l > middle; l--) {
        let h = lines[base + (l - 1u) * params.samples];
        let next = x * c - y * s + h.x;
        y = x * s + y * c + h.y;
        x = next;
    }
    var u = vec4<f32>();
    var v = vec4<f32>();
    for (var l = 0u; l < middle; l++) {
        let h = lines[base + l * params.samples];
        let next = u * c + v * s + h.x;
        v = v * c - u * s + h.y;
        u = next;
    }
    x += u * c + v * s;
    y += v * c - u * s;

    for (var k = 0u; k < 4u; k++) {
        var z = cmul(vec2<f32>(x[k], y[k]), factor[k]);
        if params.is_real != 0u {
            z = vec2<f32>(1.41421356 * z.x, 0.0);
        }
        if params.copies != 0u {
            if k == 0u {
                for (var chirp = 0u; chirp < params.chirps; chirp++) {
                    put(chirp, params.first_channel + channel, sample, z);
                }
            }
            continue;
        }
        let chirp = block * params.block + first + k;
        if first + k < params.block && chirp >= params.first_chirp && chirp < params.first_chirp + params.chirps {
            put(chirp - params.first_chirp, params.first_channel + channel, sample, z);
        }
    }
}
