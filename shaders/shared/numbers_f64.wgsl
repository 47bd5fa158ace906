// Numbers in f64, for adapters that compute in it: the same names as in numbers_df64.wgsl.

alias Num = f64;
alias NumVec = vec3<f64>;

fn begin_numbers(zero: u32) {
}

fn num(x: f32) -> Num {
    return f64(x);
}

// A number from its upper and its lower half, and back.
fn num_of(halves: vec2<f32>) -> Num {
    return f64(halves.x) + f64(halves.y);
}

fn halves_of(x: Num) -> vec2<f32> {
    let upper = f32(x);
    return vec2<f32>(upper, f32(x - f64(upper)));
}

// Rounded to f32; the sign is exact.
fn rough(x: Num) -> f32 {
    return f32(x);
}

fn n_neg(a: Num) -> Num {
    return -a;
}

fn n_add(a: Num, b: Num) -> Num {
    return a + b;
}

fn n_sub(a: Num, b: Num) -> Num {
    return a - b;
}

fn n_mul(a: Num, b: Num) -> Num {
    return a * b;
}

fn n_div(a: Num, b: Num) -> Num {
    return a / b;
}

fn v_zero() -> NumVec {
    return NumVec();
}

fn v_of(upper: vec3<f32>, lower: vec3<f32>) -> NumVec {
    return vec3<f64>(upper) + vec3<f64>(lower);
}

fn v_rough(v: NumVec) -> vec3<f32> {
    return vec3<f32>(v);
}

fn v_neg(a: NumVec) -> NumVec {
    return -a;
}

fn v_add(a: NumVec, b: NumVec) -> NumVec {
    return a + b;
}

fn v_sub(a: NumVec, b: NumVec) -> NumVec {
    return a - b;
}

fn v_scale(a: NumVec, s: Num) -> NumVec {
    return a * s;
}

fn v_dot(a: NumVec, b: NumVec) -> Num {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn v_cross(a: NumVec, b: NumVec) -> NumVec {
    return a.yzx * b.zxy - a.zxy * b.yzx;
}
