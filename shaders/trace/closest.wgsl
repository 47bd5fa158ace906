// The nearest triangle along each of the given rays, or whether there is one.

struct ClosestHitParams {
    count: u32,
    // Non-zero: any triangle will do.
    any: u32,
}

struct Ray {
    origin: vec3<f32>,
    t_min: f32,
    dir: vec3<f32>,
    t_max: f32,
}

@group(0) @binding(0) var<uniform> params: ClosestHitParams;
@group(0) @binding(1) var<storage, read> bvh_nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> bvh_triangles: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> rays: array<Ray>;
@group(0) @binding(4) var<storage, read> skip_patches: array<u32>;
@group(0) @binding(5) var<storage, read_write> hits: array<Hit>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    if i >= params.count {
        return;
    }
    let ray = rays[i];
    hits[i] = bvh_hit(ray.origin, ray.dir, ray.t_min, ray.t_max, skip_patches[i], params.any != 0u);
}
