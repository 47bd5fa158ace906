// A tube's axis through the planes of the facets it meets, in double-f32, so that the path's length
// keeps its phase. Needs df64.wgsl and the binding `planes` of the entry point:
// planes[2 i] = (normal hi, offset hi), planes[2 i + 1] = (normal lo, offset lo): normal . p = offset.

struct Tube {
    origin: DfVec3,
    dir: DfVec3,
    // Edges across; of a spherical wave per metre of path.
    edge0: vec3<f32>,
    edge1: vec3<f32>,
}

struct Step {
    t: vec2<f32>,
    point: DfVec3,
    // After reflection.
    dir: DfVec3,
    // On the lit side.
    normal: vec3<f32>,
}

// A tube of a spherical wave. `cell` is (direction hi, width in azimuth), (direction lo, width in sine of
// elevation); the columns of `axes` are the fan's axes in the world.
fn fan_tube(origin: DfVec3, cell_hi: vec4<f32>, cell_lo: vec4<f32>, axes: mat3x3<f32>) -> Tube {
    let local = transpose(axes) * cell_hi.xyz;
    let c2 = local.x * local.x + local.y * local.y;
    let edge0 = vec3<f32>(-local.y, local.x, 0.0) * cell_hi.w;
    let edge1 = vec3<f32>(-local.z * local.x / c2, -local.z * local.y / c2, 1.0) * cell_lo.w;
    return Tube(origin, DfVec3(cell_hi.xyz, cell_lo.xyz), axes * edge0, axes * edge1);
}

fn facet_step(origin: DfVec3, dir: DfVec3, triangle: u32) -> Step {
    let hi = planes[2u * triangle];
    let lo = planes[2u * triangle + 1u];
    let normal = DfVec3(hi.xyz, lo.xyz);
    let along = dfv_dot(normal, dir);
    let t = df_div(df_sub(vec2<f32>(hi.w, lo.w), dfv_dot(normal, origin)), along);
    let point = dfv_add(origin, dfv_scale(dir, t));
    let mirrored = dfv_sub(dir, dfv_scale(normal, 2.0 * along));
    return Step(t, point, mirrored, select(hi.xyz, -hi.xyz, along.x > 0.0));
}
