// Numbers of some 48 bits as pairs of f32 (df64.wgsl), for adapters that do not compute in f64: the same names as in numbers_f64.wgsl.

alias Num = vec2<f32>;
alias NumVec = DfVec3;

fn begin_numbers(zero: u32) {
    barrier_zero = zero;
}

fn num(x: f32) -> Num {
    return vec2<f32>(x, 0.0);
}

// A number from its upper and its lower half, and back.
fn num_of(halves: vec2<f32>) -> Num {
    return halves;
}

fn halves_of(x: Num) -> vec2<f32> {
    return x;
}

// Rounded to f32; the sign is exact.
fn rough(x: Num) -> f32 {
    return x.x;
}

fn n_neg(a: Num) -> Num {
    return -a;
}

fn n_add(a: Num, b: Num) -> Num {
    return df_add(a, b);
}

fn n_sub(a: Num, b: Num) -> Num {
    return df_sub(a, b);
}

fn n_mul(a: Num, b: Num) -> Num {
    return df_mul(a, b);
}

fn n_div(a: Num, b: Num) -> Num {
    return df_div(a, b);
}

fn v_zero() -> NumVec {
    return DfVec3();
}

fn v_of(upper: vec3<f32>, lower: vec3<f32>) -> NumVec {
    return DfVec3(upper, lower);
}

fn v_rough(v: NumVec) -> vec3<f32> {
    return v.hi;
}

fn v_neg(a: NumVec) -> NumVec {
    return DfVec3(-a.hi, -a.lo);
}

fn v_add(a: NumVec, b: NumVec) -> NumVec {
    return dfv_add(a, b);
}

fn v_sub(a: NumVec, b: NumVec) -> NumVec {
    return dfv_sub(a, b);
}

fn v_scale(a: NumVec, s: Num) -> NumVec {
    return dfv_scale(a, s);
}

fn v_dot(a: NumVec, b: NumVec) -> Num {
    return dfv_dot(a, b);
}

fn v_cross(a: NumVec, b: NumVec) -> NumVec {
    let ax = vec2<f32>(a.hi.x, a.lo.x);
    let ay = vec2<f32>(a.hi.y, a.lo.y);
    let az = vec2<f32>(a.hi.z, a.lo.z);
    let bx = vec2<f32>(b.hi.x, b.lo.x);
    let by = vec2<f32>(b.hi.y, b.lo.y);
    let bz = vec2<f32>(b.hi.z, b.lo.z);
    let x = df_sub(df_mul(ay, bz), df_mul(az, by));
    let y = df_sub(df_mul(az, bx), df_mul(ax, bz));
    let z = df_sub(df_mul(ax, by), df_mul(ay, bx));
    return DfVec3(vec3<f32>(x.x, y.x, z.x), vec3<f32>(x.y, y.y, z.y));
}
