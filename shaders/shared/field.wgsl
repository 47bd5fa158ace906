// Reflection of the field and what a bounce radiates (CONVENTIONS eq. 4-6, 21-22). Needs complex.wgsl,
// phase.wgsl and the binding `surfaces` of the entry point: one word a surface, then tables, as
// src/geom/upload.rs lays them out.

// A complex vector in space.
struct CVec3 {
    re: vec3<f32>,
    im: vec3<f32>,
}

fn cv_dot(a: CVec3, v: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot(a.re, v), dot(a.im, v));
}

fn cv_along(v: vec3<f32>, z: vec2<f32>) -> CVec3 {
    return CVec3(v * z.x, v * z.y);
}

fn cv_add(a: CVec3, b: CVec3) -> CVec3 {
    return CVec3(a.re + b.re, a.im + b.im);
}

// v x a
fn cv_crossed(v: vec3<f32>, a: CVec3) -> CVec3 {
    return CVec3(cross(v, a.re), cross(v, a.im));
}

fn csqrt_decaying(z: vec2<f32>) -> vec2<f32> {
    let m = sqrt(0.5 * (length(z) + abs(z.x)));
    if m == 0.0 {
        return vec2<f32>();
    }
    let other = abs(z.y) / (2.0 * m);
    let root = select(vec2<f32>(other, m), vec2<f32>(m, other), z.x >= 0.0);
    // The branch with Im <= 0: for Im z > 0 that is the negative of the principal root.
    return select(vec2<f32>(root.x, -root.y), vec2<f32>(-root.x, -root.y), z.y > 0.0);
}

// (A, B) of both polarisations between two entries of a table.
fn front_pairs(surface: vec4<f32>, cos_i: f32) -> array<vec4<f32>, 2> {
    let x = clamp(cos_i, 0.0, 1.0) * surface.y;
    let i = min(floor(x), surface.y - 1.0);
    let at = u32(surface.x) + 2u * u32(i);
    let t = x - i;
    return array<vec4<f32>, 2>(mix(surfaces[at], surfaces[at + 2u], t), mix(surfaces[at + 1u], surfaces[at + 3u], t));
}

// (R across, R in the plane of incidence) times the coherent loss of a rough surface.
fn reflection(index: u32, cos_i: f32, wavenumber: f32) -> vec4<f32> {
    let surface = surfaces[index];
    let x = wavenumber * surface.z * cos_i;
    let loss = exp(-2.0 * x * x);
    if surface.w == 1.0 {
        return vec4<f32>(-loss, 0.0, loss, 0.0);
    }
    let c = vec2<f32>(cos_i, 0.0);
    if surface.w == 2.0 {
        let pairs = front_pairs(surface, cos_i);
        let s = pairs[0].xy * cos_i;
        let p = pairs[1].xy * cos_i;
        return vec4<f32>(cdiv(s - pairs[0].zw, s + pairs[0].zw), cdiv(p - pairs[1].zw, p + pairs[1].zw)) * loss;
    }
    let q = csqrt_decaying(surface.xy - vec2<f32>(1.0 - cos_i * cos_i, 0.0));
    let e = surface.xy * cos_i;
    return vec4<f32>(cdiv(c - q, c + q), cdiv(e - q, e + q)) * loss;
}

fn cdiv(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    // Scaled: the permittivity of a metal squared would overflow.
    let s = 1.0 / max(abs(b.x), abs(b.y));
    let d = b * s;
    return cmul_conj(a * s, d) / dot(d, d);
}

struct Mirror {
    dir_in: vec3<f32>,
    dir_out: vec3<f32>,
    normal: vec3<f32>,
    e_perp: vec3<f32>,
    r: vec4<f32>,
}

fn mirror(dir_in: vec3<f32>, dir_out: vec3<f32>, normal: vec3<f32>, surface: u32, wavenumber: f32) -> Mirror {
    let across = cross(dir_in, normal);
    let sin_i = length(across);
    var e_perp = across / sin_i;
    if sin_i < 1e-5 {
        // Any vector along the surface will do.
        let helper = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(normal.x) > 0.7);
        e_perp = normalize(cross(normal, helper));
    }
    return Mirror(dir_in, dir_out, normal, e_perp, reflection(surface, -dot(dir_in, normal), wavenumber));
}

fn reflected(m: Mirror, e: CVec3) -> CVec3 {
    let e_in = cross(m.dir_in, m.e_perp);
    let e_out = cross(m.dir_out, m.e_perp);
    return cv_add(
        cv_along(m.e_perp, cmul(m.r.xy, cv_dot(e, m.e_perp))),
        cv_along(e_out, cmul(m.r.zw, cv_dot(e, e_in))),
    );
}

fn sinc(x: f32) -> f32 {
    if abs(x) < 1e-2 {
        return 1.0 - x * x * (1.0 / 6.0 - x * x / 120.0);
    }
    return cis_turns_f(x * 0.159154943).y / x;
}

// The integral over the footprint without the axis' phase: x is k / 4 pi times the area, y and z are half
// the phase along its two edges, of which the sincs are to be multiplied (or the end terms taken).
fn footprint(m: Mirror, edge0: vec3<f32>, edge1: vec3<f32>, to_receiver: vec3<f32>, wavenumber: f32) -> vec3<f32> {
    let cos_i = -dot(m.dir_in, m.normal);
    let f0 = edge0 + m.dir_in * (dot(m.normal, edge0) / cos_i);
    let f1 = edge1 + m.dir_in * (dot(m.normal, edge1) / cos_i);
    let w = (m.dir_in - to_receiver) * wavenumber;
    return vec3<f32>(length(cross(f0, f1)) * wavenumber * 0.0795774715, 0.5 * dot(w, f0), 0.5 * dot(w, f1));
}

// -j (eta J + M x s) on the receiver's V (xy) and H (zw), for the incident field e and its reflection r.
fn radiated(m: Mirror, e: CVec3, r: CVec3, to_receiver: vec3<f32>, v: vec3<f32>, h: vec3<f32>) -> vec4<f32> {
    let magnetic = cv_add(cv_crossed(m.dir_in, e), cv_crossed(m.dir_out, r));
    let j = cv_crossed(m.normal, magnetic);
    let current_m = cv_crossed(-m.normal, cv_add(e, r));
    let f = cv_add(j, cv_crossed(-to_receiver, current_m));
    let on_v = cv_dot(f, v);
    let on_h = cv_dot(f, h);
    return vec4<f32>(on_v.y, -on_v.x, on_h.y, -on_h.x);
}

// V = minus theta-hat of the direction d (CONVENTIONS eq. 2); H = h_of(d).
fn v_of(d: vec3<f32>) -> vec3<f32> {
    let rho = length(d.xy);
    if rho < 1e-6 {
        return vec3<f32>(-d.z, 0.0, rho);
    }
    return vec3<f32>(-d.z * d.xy / rho, rho);
}

fn h_of(d: vec3<f32>) -> vec3<f32> {
    let rho = length(d.xy);
    if rho < 1e-6 {
        return vec3<f32>(0.0, 1.0, 0.0);
    }
    return vec3<f32>(-d.y / rho, d.x / rho, 0.0);
}
