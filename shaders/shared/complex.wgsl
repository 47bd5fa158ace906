// Complex numbers as vec2: x real, y imaginary.

fn cmul(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

fn conj(a: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x, -a.y);
}

// a times the conjugate of b
fn cmul_conj(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y);
}

// |a|^2
fn norm_sqr(a: vec2<f32>) -> f32 {
    return a.x * a.x + a.y * a.y;
}

// j a
fn cmul_j(a: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-a.y, a.x);
}
