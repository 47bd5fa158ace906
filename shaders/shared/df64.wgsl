// Double-f32 numbers: vec2(hi, lo) stands for hi + lo with |lo| <= ulp(hi)/2, about 48 bits
// (Dekker 1971; error bounds in Joldes, Muller, Popescu 2017).
//
// Compilers simplify (a + b) - a to b although that is wrong for floats. `opaque` hides a value from
// them: the entry point sets barrier_zero from a uniform that is zero at run time.
var<private> barrier_zero: u32;

struct DfVec3 {
    hi: vec3<f32>,
    lo: vec3<f32>,
}

fn opaque(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ barrier_zero);
}

// a + b exactly, whatever their order (Knuth).
fn two_sum(a: f32, b: f32) -> vec2<f32> {
    let s = opaque(a + b);
    let b_part = opaque(s - a);
    let a_part = opaque(s - b_part);
    return vec2<f32>(s, opaque(a - a_part) + opaque(b - b_part));
}

// a + b exactly for |a| >= |b| (Dekker).
fn quick_two_sum(a: f32, b: f32) -> vec2<f32> {
    let s = opaque(a + b);
    return vec2<f32>(s, b - opaque(s - a));
}

// The upper 12 significant bits. What is left over has 12 too, so products of halves are exact, fused
// into an addition or not.
fn upper_half(a: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(a) & 0xfffff000u);
}

// a * b exactly (Dekker's product; split by masking, which cannot overflow), barring underflow.
fn two_prod(a: f32, b: f32) -> vec2<f32> {
    let a_hi = upper_half(a);
    let b_hi = upper_half(b);
    let a_lo = a - a_hi;
    let b_lo = b - b_hi;
    let p = opaque(a * b);
    let e1 = opaque(a_hi * b_hi - p);
    let e2 = opaque(e1 + a_hi * b_lo);
    let e3 = opaque(e2 + a_lo * b_hi);
    return vec2<f32>(p, e3 + a_lo * b_lo);
}

fn df_from_f32(x: f32) -> vec2<f32> {
    return vec2<f32>(x, 0.0);
}

fn df_add(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let s = two_sum(a.x, b.x);
    let t = two_sum(a.y, b.y);
    let v = quick_two_sum(s.x, s.y + t.x);
    return quick_two_sum(v.x, t.y + v.y);
}

fn df_sub(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return df_add(a, -b);
}

fn df_mul(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let p = two_prod(a.x, b.x);
    return quick_two_sum(p.x, p.y + (a.x * b.y + a.y * b.x));
}

fn df_div(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let q1 = a.x / b.x;
    let r1 = df_sub(a, df_mul(df_from_f32(q1), b));
    let q2 = r1.x / b.x;
    let r2 = df_sub(r1, df_mul(df_from_f32(q2), b));
    let q = quick_two_sum(q1, q2);
    return df_add(q, df_from_f32(r2.x / b.x));
}

// Square root of a >= 0: one step of Newton's method from the f32 root.
fn df_sqrt(a: vec2<f32>) -> vec2<f32> {
    if a.x <= 0.0 {
        return vec2<f32>(0.0, 0.0);
    }
    let y = sqrt(a.x);
    let r = df_sub(a, two_prod(y, y));
    return quick_two_sum(y, r.x / (2.0 * y));
}

fn dfv_from_vec3(v: vec3<f32>) -> DfVec3 {
    return DfVec3(v, vec3<f32>());
}

fn dfv_add(a: DfVec3, b: DfVec3) -> DfVec3 {
    let x = df_add(vec2<f32>(a.hi.x, a.lo.x), vec2<f32>(b.hi.x, b.lo.x));
    let y = df_add(vec2<f32>(a.hi.y, a.lo.y), vec2<f32>(b.hi.y, b.lo.y));
    let z = df_add(vec2<f32>(a.hi.z, a.lo.z), vec2<f32>(b.hi.z, b.lo.z));
    return DfVec3(vec3<f32>(x.x, y.x, z.x), vec3<f32>(x.y, y.y, z.y));
}

fn dfv_sub(a: DfVec3, b: DfVec3) -> DfVec3 {
    return dfv_add(a, DfVec3(-b.hi, -b.lo));
}

fn dfv_scale(a: DfVec3, s: vec2<f32>) -> DfVec3 {
    let x = df_mul(vec2<f32>(a.hi.x, a.lo.x), s);
    let y = df_mul(vec2<f32>(a.hi.y, a.lo.y), s);
    let z = df_mul(vec2<f32>(a.hi.z, a.lo.z), s);
    return DfVec3(vec3<f32>(x.x, y.x, z.x), vec3<f32>(x.y, y.y, z.y));
}

fn dfv_dot(a: DfVec3, b: DfVec3) -> vec2<f32> {
    let x = df_mul(vec2<f32>(a.hi.x, a.lo.x), vec2<f32>(b.hi.x, b.lo.x));
    let y = df_mul(vec2<f32>(a.hi.y, a.lo.y), vec2<f32>(b.hi.y, b.lo.y));
    let z = df_mul(vec2<f32>(a.hi.z, a.lo.z), vec2<f32>(b.hi.z, b.lo.z));
    return df_add(df_add(x, y), z);
}

fn dfv_length(a: DfVec3) -> vec2<f32> {
    return df_sqrt(dfv_dot(a, a));
}
