// Products of the keystone transform's chirp-z transforms over chirps, one for each sample and channel, around
// the transforms that convolve (CONVENTIONS eq. 89, 86). Phases are whole multiples of steps of 2^-64 turns, so
// that no count is too large. Lines lie side by side: line = channel * samples + sample of a block.

const BEFORE = 0u;
const KERNEL = 1u;
const PRODUCT = 2u;

struct KeystoneParams {
    // 0 values by the first chirp, 1 the chirp to convolve with, 2 product of spectra, 3 rows by the last chirp.
    step: u32,
    lines: u32,
    // Of each channel in the block, and the first of them in the cube.
    samples: u32,
    first_sample: u32,
    // Of the convolution.
    length: u32,
    // Positions first .. first + count of a line are made.
    first: u32,
    count: u32,
    // Of the frame.
    chirps: u32,
    // Of the result, q = row - half.
    rows: u32,
    half: u32,
    // Value of channel c, position p, sample n of the cube (before) or the result (after), in wrapping steps.
    base: u32,
    position_step: u32,
    channel_step: u32,
    // Fraction of a turn that all chirps have in common.
    turn: u32,
    // Turns from chirp to chirp that are added (before) or from row to row that are taken off (after).
    ramp_low: u32,
    ramp_high: u32,
}

@group(0) @binding(0) var<uniform> params: KeystoneParams;
@group(0) @binding(1) var<storage, read> values: array<vec2<f32>>;
// Weights of the chirps (x), or the spectrum of the chirp of each sample.
@group(0) @binding(2) var<storage, read> factors: array<vec2<f32>>;
// Of each sample: turns of a (2u)^2 / 8, and of the fold at 2u; low words first.
@group(0) @binding(3) var<storage, read> steps: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> products: array<vec2<f32>>;

// Turns of `count` steps, both of 64 bits.
fn turns(step: vec2<u32>, count: vec2<u32>) -> u32 {
    return mul_wide(step.x, count.x).y + step.x * count.y + step.y * count.x;
}

fn turns_signed(step: vec2<u32>, count: i32) -> u32 {
    let t = turns(step, vec2<u32>(u32(abs(count)), 0u));
    return select(t, 0u - t, count < 0);
}

fn turns_square(step: vec2<u32>, count: i32) -> u32 {
    return turns(step, mul_wide(u32(abs(count)), u32(abs(count))));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let line = id.x;
    let inside = id.y + (id.z << 15u);
    if line >= params.lines || inside >= params.count {
        return;
    }
    let position = params.first + inside;
    let at = position * params.lines + line;
    let sample = line % params.samples;
    let table = steps[params.first_sample + sample];
    let ramp = vec2<u32>(params.ramp_low, params.ramp_high);
    // Of channel and sample; position * position_step is added.
    let place = params.base + line / params.samples * params.channel_step + params.first_sample + sample;
    // Twice the chirp that is the middle of the frame.
    let middle = i32(params.chirps - 1u);
    if params.step == BEFORE {
        var y = vec2<f32>(0.0);
        if position < params.chirps {
            let u = 2 * i32(position) - middle;
            let t = turns(ramp, vec2<u32>(position, 0u)) - turns_square(table.xy, u) - turns_signed(table.zw, u);
            y = cmul(values[place + position * params.position_step], cis_turns(t - params.turn));
            y *= factors[position].x;
        }
        products[at] = y;
    } else if params.step == KERNEL {
        // Row r takes from chirp m the value at d = r - m, wrapped around.
        let wraps = position >= params.rows;
        let d = i32(position) - select(0, i32(params.length), wraps);
        let t = turns_square(table.xy, 2 * (d - i32(params.half)) + middle);
        let used = !wraps || params.length - position < params.chirps;
        products[at] = select(vec2<f32>(0.0), cis_turns(t) / f32(params.length), used);
    } else if params.step == PRODUCT {
        // Conjugated, so that a forward transform takes it back.
        products[at] = conj(cmul(values[at], factors[position * params.samples + sample]));
    } else {
        let q = i32(position) - i32(params.half);
        let t = turns_square(table.xy, 2 * q) + turns_signed(ramp, q);
        products[place + position * params.position_step] = cmul_conj(cis_turns(0u - t), values[at]);
    }
}
