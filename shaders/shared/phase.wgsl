// Phase as a fraction of a turn in a u32: 2^32 is one turn, sums and differences wrap exactly.

// The fraction of a turn of x (in turns), to the nearest 2^-32.
fn turns_from_f32(x: f32) -> u32 {
    // The remainder is exact, and at most half a turn fits a u32 whatever its sign.
    let r = x - round(x);
    let m = u32(abs(r) * 4294967296.0 + 0.5);
    return select(m, 0u - m, r < 0.0);
}

// The same of a double-f32.
fn turns_from_df(x: vec2<f32>) -> u32 {
    return turns_from_f32(x.x) + turns_from_f32(x.y);
}

// (cos, sin) of `angle` radians within a quarter turn around zero, turned by `quadrant` quarter turns.
// Interpolation in x^2 at Chebyshev nodes of [0, (pi/4)^2]: within 1e-8 before rounding.
fn cis_quadrant(angle: f32, quadrant: u32) -> vec2<f32> {
    let z = angle * angle;
    let s = angle + angle * z * (-0.166666642 + z * (0.00833274797 + z * -0.000195878907));
    let c = 1.0 + z * (-0.5 + z * (0.0416666642 + z * (-0.00138883025 + z * 2.45479423e-5)));
    let swapped = select(vec2<f32>(c, s), vec2<f32>(-s, c), (quadrant & 1u) != 0u);
    return select(swapped, -swapped, (quadrant & 2u) != 0u);
}

// (cos, sin) of t / 2^32 turns, error below 3e-7. The built-in functions promise only 2^-11.
fn cis_turns(t: u32) -> vec2<f32> {
    let quadrant = (t + 0x20000000u) >> 30u;
    let rest = bitcast<i32>(t - (quadrant << 30u));
    return cis_quadrant(f32(rest) * 1.46291812e-9, quadrant);
}

// (cos, sin) of t turns. What t itself cannot resolve is lost: 2e-7 rad at half a turn, more beyond.
fn cis_turns_f(t: f32) -> vec2<f32> {
    let r = t - round(t);
    let quarters = round(4.0 * r);
    return cis_quadrant((r - 0.25 * quarters) * 6.28318548, bitcast<u32>(i32(quarters)) & 3u);
}
