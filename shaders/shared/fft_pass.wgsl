// One pass of a Stockham transform over global memory: what its radices have in common. Butterfly j of a
// line takes values j, j + butterflies, ... and leaves them in order. The first pass multiplies by weights
// and fills with zeros, later ones multiply by twiddles; the last one shifts and keeps a range of
// positions. The entry file binds `params`, `values`, `multipliers` and `spectrum`.

struct FftPassParams {
    lines: u32,
    length: u32,
    // Of a line.
    butterflies: u32,
    // Length of the transforms that are finished.
    done: u32,
    // Twiddles between those of neighbouring factors; 0 in the first pass, whose multipliers are weights.
    turn: u32,
    // Values of a line; the rest is zero.
    count: u32,
    // Steps may be negative: addresses wrap.
    in_base: u32,
    in_line: u32,
    in_step: u32,
    out_base: u32,
    out_line: u32,
    out_step: u32,
    // Bin k goes to position (k + shift) mod length; positions first .. first + kept are stored.
    shift: u32,
    first: u32,
    kept: u32,
    // 1: neighbouring threads take neighbouring lines; 0: neighbouring butterflies.
    lines_first: u32,
}

// (line, butterfly) of a thread; more than 32,768 along y go on in z.
fn place(id: vec3<u32>) -> vec2<u32> {
    let slow = id.y + (id.z << 15u);
    return select(vec2<u32>(slow, id.x), vec2<u32>(id.x, slow), params.lines_first == 1u);
}

// Factor i of butterfly j, multiplied; k = j mod done.
fn factor(line: u32, j: u32, k: u32, i: u32) -> vec2<f32> {
    let position = j + i * params.butterflies;
    let inside = min(position, params.count - 1u);
    let x = values[params.in_base + line * params.in_line + inside * params.in_step];
    let y = cmul(x, multipliers[select(i * k * params.turn, inside, params.turn == 0u)]);
    return select(vec2<f32>(0.0), y, position < params.count);
}

fn put(line: u32, bin: u32, value: vec2<f32>) {
    let turned = bin + params.shift;
    // Wraps below first, and is then not less than kept.
    let position = turned - select(0u, params.length, turned >= params.length) - params.first;
    if position < params.kept {
        spectrum[params.out_base + line * params.out_line + position * params.out_step] = value;
    }
}

fn dft4(a: vec2<f32>, b: vec2<f32>, c: vec2<f32>, d: vec2<f32>) -> array<vec2<f32>, 4> {
    let even = a + c;
    let odd = a - c;
    let sum = b + d;
    let turned = cmul_j(b - d);
    return array<vec2<f32>, 4>(even + sum, odd - turned, even - sum, odd + turned);
}
