// Sum of echoes at every sample of the cube. A thread owns 16 samples of one chirp of one channel
// and walks over all echoes: the phase in the middle of the block, exact in turns, then cosine and
// sine at ±1/2, ±3/2 ... ±15/2 samples from there, which two samples share.
struct SynthesisParams {
    // Rows that are computed, and in how many further chirps each is written (for echoes at rest).
    chirps: u32,
    copies: u32,
    channels: u32,
    samples: u32,
    echoes: u32,
    // Chirps and samples are counted from here: the middle of the frame and of the ramp.
    chirp_origin: i32,
    sample_origin: i32,
    // 1: add to what the cube holds. 0: overwrite it.
    accumulate: u32,
    // 1: real sampling.
    is_real: u32,
}

// Phase in turns: a0 + a1 m + a2 m² + a3 m³ + n (2 half_step + b1 m + b2 m²) + n² (c + c1 m). The u32 wrap at one turn.
struct DeviceEcho {
    amplitude: vec2<f32>,
    a0: u32,
    a1: u32,
    half_step: u32,
    b1: f32,
    a2: f32,
    c: f32,
    a3: f32,
    b2: f32,
    c1: f32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> params: SynthesisParams;
// [channel, echo]
@group(0) @binding(1) var<storage, read> echoes: array<DeviceEcho>;
// [chirp, channel, sample]
@group(0) @binding(2) var<storage, read_write> cube: array<vec2<f32>>;

const TAU = 6.28318531;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let id = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    let blocks = (params.samples + 15u) / 16u;
    let block = id % blocks;
    let chirp = id / blocks;
    if chirp >= params.chirps {
        return;
    }
    // The same in the whole workgroup, and so are the echoes that it reads.
    let channel = workgroup_id.z;
    let dm = i32(chirp) + params.chirp_origin;
    let m = f32(dm);
    // Twice the distance to the middle of the block, which lies between two samples.
    let twice = 2 * (i32(16u * block) + params.sample_origin) + 15;
    let n = 0.5 * f32(twice);

    // Sums over echoes at distances k + 1/2, k = 0..7, of x cos, y sin, y cos, x sin.
    var xc0 = vec4<f32>();
    var xc1 = vec4<f32>();
    var ys0 = vec4<f32>();
    var ys1 = vec4<f32>();
    var yc0 = vec4<f32>();
    var yc1 = vec4<f32>();
    var xs0 = vec4<f32>();
    var xs1 = vec4<f32>();
    let squares0 = vec4<f32>(0.25, 2.25, 6.25, 12.25);
    let squares1 = vec4<f32>(20.25, 30.25, 42.25, 56.25);

    let first = channel * params.echoes;
    for (var i = first; i < first + params.echoes; i++) {
        let e = echoes[i];
        let bend = m * (e.b1 + m * e.b2);
        let c = e.c + m * e.c1;
        let turns = e.a0 + bitcast<u32>(dm) * e.a1 + bitcast<u32>(twice) * e.half_step
            + turns_from_f32(m * m * (e.a2 + m * e.a3) + n * (bend + n * c));
        let middle = cmul(e.amplitude, cis_turns(turns));
        let z0 = cis_turns(e.half_step + turns_from_f32(0.5 * bend + n * c));
        let w = cmul(z0, z0);
        let z1 = cmul(z0, w);
        let z2 = cmul(z1, w);
        let z3 = cmul(z2, w);
        let w2 = cmul(w, w);
        // 2 cos of four steps: cosines four steps ahead from these and those four steps back.
        let t = 2.0 - 4.0 * w2.y * w2.y;
        let c0 = vec4<f32>(z0.x, z1.x, z2.x, z3.x);
        let s0 = vec4<f32>(z0.y, z1.y, z2.y, z3.y);
        let c1 = t * c0 - c0.wzyx;
        let s1 = t * s0 + s0.wzyx;
        // The frequency drifts: the phase gains c k² on both sides.
        let drift = TAU * c;
        let x0 = middle.x - drift * middle.y * squares0;
        let x1 = middle.x - drift * middle.y * squares1;
        let y0 = middle.y + drift * middle.x * squares0;
        let y1 = middle.y + drift * middle.x * squares1;
        xc0 += x0 * c0;
        xc1 += x1 * c1;
        ys0 += y0 * s0;
        ys1 += y1 * s1;
        yc0 += y0 * c0;
        yc1 += y1 * c1;
        xs0 += x0 * s0;
        xs1 += x1 * s1;
    }

    var out: array<vec2<f32>, 16>;
    for (var k = 0u; k < 4u; k++) {
        out[7u - k] = vec2<f32>(xc0[k] + ys0[k], yc0[k] - xs0[k]);
        out[8u + k] = vec2<f32>(xc0[k] - ys0[k], yc0[k] + xs0[k]);
        out[3u - k] = vec2<f32>(xc1[k] + ys1[k], yc1[k] - xs1[k]);
        out[12u + k] = vec2<f32>(xc1[k] - ys1[k], yc1[k] + xs1[k]);
    }
    for (var k = 0u; k < 16u; k++) {
        let sample = 16u * block + k;
        if sample >= params.samples {
            break;
        }
        var z = out[k];
        if params.is_real != 0u {
            z = vec2<f32>(1.41421356 * z.x, 0.0);
        }
        for (var copy = 0u; copy <= params.copies; copy++) {
            let at = ((chirp + copy) * params.channels + channel) * params.samples + sample;
            if params.accumulate != 0u {
                cube[at] += z;
            } else {
                cube[at] = z;
            }
        }
    }
}
