// Spreads echoes over a grid: a thread owns one line of one block of one channel and walks over the
// echoes that can reach it, in a fixed order (CONVENTIONS eq. 83).
struct GridSpreadParams {
    // Polynomials of the bell across cells and of the one across lines, lowest order first.
    cell_a: vec4<f32>,
    cell_b: vec4<f32>,
    cell_c: vec4<f32>,
    cell_d: vec4<f32>,
    line_a: vec4<f32>,
    line_b: vec4<f32>,
    line_c: vec4<f32>,
    line_d: vec4<f32>,
    // In each channel.
    echoes: u32,
    channels: u32,
    blocks: u32,
    lines: u32,
    log2_cells: u32,
    // Chirps of a block, and the middle of the first block from the middle of the frame.
    block: u32,
    first_middle: i32,
    // Lines a turn.
    per_step: f32,
    // 1: each echo belongs to one line with its whole weight.
    whole: u32,
    // Slopes of a2 and b1 over a1 in the warp.
    bend_slope: f32,
    mixed_slope: f32,
}

// About the middle of frame and ramp. Phases in 2^-32 turns.
struct DeviceEcho {
    amplitude: vec2<f32>,
    a0: u32,
    a1: u32,
    b0: u32,
    // Turns.
    b1: f32,
    a2: f32,
    // Place among the lines: a whole number and what goes beyond it.
    line: i32,
    beyond: f32,
    // Of a bent path.
    a3: f32,
    b2: f32,
    // a2 and b1 without what the warp follows.
    bend: f32,
    mixed: f32,
}

// First and last but one of the echoes of a line.
struct Span {
    first: u32,
    end: u32,
}

@group(0) @binding(0) var<uniform> params: GridSpreadParams;
// [channel, echo]
@group(0) @binding(1) var<storage, read> echoes: array<DeviceEcho>;
@group(0) @binding(2) var<storage, read> spans: array<Span>;
// [channel, block, line, cell], zero before.
@group(0) @binding(3) var<storage, read_write> grid: array<vec2<f32>>;

// Bell at `d` cells from its middle, for |d| <= 4. Unrolled, since a driver counts the rounds of loops.
fn bell(d: vec4<f32>, p: vec4<f32>, q: vec4<f32>, r: vec4<f32>, t: vec2<f32>) -> vec4<f32> {
    let s = max(1.0 - d * d * 0.0625, vec4<f32>());
    let high = ((t.y * s + t.x) * s + r.w) * s + r.z;
    let middle = ((((high * s + r.y) * s + r.x) * s + q.w) * s + q.z) * s + q.y;
    return ((((middle * s + q.x) * s + p.w) * s + p.z) * s + p.y) * s + p.x;
}

fn cell_bell(d: vec4<f32>) -> vec4<f32> {
    return bell(d, params.cell_a, params.cell_b, params.cell_c, params.cell_d.xy);
}

fn line_bell(d: f32) -> f32 {
    return bell(vec4<f32>(d), params.line_a, params.line_b, params.line_c, params.line_d.xy).x;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    if id >= params.channels * params.blocks * params.lines {
        return;
    }
    let line = id % params.lines;
    let block = id / params.lines % params.blocks;
    let channel = id / (params.lines * params.blocks);
    let middle = params.first_middle + i32(block * params.block);
    let m = f32(middle);
    // The straight line that is nearest to the square of the chirp over a block is mean + 2 centre m.
    let centre = select(-0.5, 0.0, (params.block & 1u) == 1u);
    let mean = (f32(params.block * params.block) - 1.0) / 12.0 - centre * centre;
    let span = spans[line];
    let base = id << params.log2_cells;
    let last = (1u << params.log2_cells) - 1u;

    for (var i = span.first; i < span.end; i++) {
        let e = echoes[channel * params.echoes + i];
        let turned = m * (2.0 * e.a2 + 3.0 * m * e.a3);
        let bend = e.bend + 3.0 * m * e.a3 - params.bend_slope * turned;
        let mixed = e.mixed + 2.0 * m * e.b2 - params.mixed_slope * turned;
        var weight = 1.0;
        if params.whole == 0u {
            let d = f32(i32(line) - e.line) - e.beyond
                - (turned + 2.0 * centre * bend) * params.per_step;
            if abs(d) > 4.0 {
                continue;
            }
            weight = line_bell(d);
        }
        let turns = e.a0 + bitcast<u32>(middle) * e.a1 + turns_from_f32(m * m * (e.a2 + m * e.a3) + mean * bend);
        let x = cmul(weight * e.amplitude, cis_turns(turns));
        let place = e.b0 + turns_from_f32(m * (e.b1 + m * e.b2) + centre * mixed);
        let beyond = f32(place << params.log2_cells) * 2.3283064e-10;
        let first = (place >> (32u - params.log2_cells)) + last - 2u; // three cells before, wrapping
        let near = cell_bell(vec4<f32>(-3.0, -2.0, -1.0, 0.0) - beyond);
        let far = cell_bell(vec4<f32>(1.0, 2.0, 3.0, 4.0) - beyond);
        grid[base + (first & last)] += near.x * x;
        grid[base + ((first + 1u) & last)] += near.y * x;
        grid[base + ((first + 2u) & last)] += near.z * x;
        grid[base + ((first + 3u) & last)] += near.w * x;
        grid[base + ((first + 4u) & last)] += far.x * x;
        grid[base + ((first + 5u) & last)] += far.y * x;
        grid[base + ((first + 6u) & last)] += far.z * x;
        grid[base + ((first + 7u) & last)] += far.w * x;
    }
}
