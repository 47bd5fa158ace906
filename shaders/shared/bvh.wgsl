// Rays through a compressed wide BVH (Ylitie, Karras, Laine 2017; the node is obvhs' CwBvhNode). The
// entry point binds
//   bvh_nodes: array<vec4<u32>>, five a node:
//     box corner x, y, z as f32 bits, exponents of the grid x | y << 8 | z << 16 | inner mask << 24;
//     first child, first triangle, a byte of meta data for each child (two words);
//     of x, then y, then z: lower planes of the children in bytes (two words), upper planes (two words);
//   bvh_triangles: array<vec4<f32>>, three a triangle in the order of the leaves:
//     (v0, patch), (v1 - v0, ...), (v2 - v0, ...), patch as bits.
//
// A byte of meta data is 0 for no child; 001xxxxx with xxxxx = 24 + slot for an inner node; else
// uuuxxxxx, u as many ones as the leaf has triangles, the first of them xxxxx after the node's first.

struct Hit {
    // In units of the direction's length; t_max for a miss.
    t: f32,
    // The point is v0 + u (v1 - v0) + v (v2 - v0).
    u: f32,
    v: f32,
    // 0xffffffff: none.
    triangle: u32,
}

const NO_TRIANGLE: u32 = 0xffffffffu;

// One entry a level is enough: the host refuses deeper trees.
const BVH_STACK: u32 = 24u;

// Relative errors, in units of the largest term. Box: rounded difference to the corner, reciprocal (2.5
// units in the last place by the WGSL specification), product and sum. Edge: product of three and sums.
const BOX_SLACK: f32 = 1e-6;
// An entry point that would rather lose a ray than give it to the wrong facet sets it to zero.
var<private> edge_slack: f32 = 4e-7;

struct BoxRay {
    origin: vec3<f32>,
    inverse: vec3<f32>,
    negative: vec3<bool>,
    // Slots are visited in the order of their number xor this, in each byte.
    octant: u32,
}

fn box_ray(origin: vec3<f32>, dir: vec3<f32>) -> BoxRay {
    let negative = dir < vec3<f32>();
    // Finite for zero components: far larger than any distance, and no NaN from 0 * inf.
    let size = 1.0 / max(abs(dir), vec3<f32>(1e-18));
    let order = select(vec3<u32>(0x04040404u, 0x02020202u, 0x01010101u), vec3<u32>(), negative);
    return BoxRay(origin, select(size, -size, negative), negative, order.x | order.y | order.z);
}

fn bytes_as_f32(word: u32) -> vec4<f32> {
    return vec4<f32>((vec4<u32>(word) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu));
}

// Bits of the children whose boxes the ray meets within [t_min, t_max]: inner nodes in the upper byte in
// the order of the visit, triangles in the lower three.
fn box_hits(
    meta_word: u32,
    octant: u32,
    near_x: u32,
    far_x: u32,
    near_y: u32,
    far_y: u32,
    near_z: u32,
    far_z: u32,
    scale: vec3<f32>,
    near_shift: vec3<f32>,
    far_shift: vec3<f32>,
    t_min: f32,
    t_max: f32,
) -> u32 {
    let near = max(
        max(bytes_as_f32(near_x) * scale.x + near_shift.x, bytes_as_f32(near_y) * scale.y + near_shift.y),
        max(bytes_as_f32(near_z) * scale.z + near_shift.z, vec4<f32>(t_min)),
    );
    let far = min(
        min(bytes_as_f32(far_x) * scale.x + far_shift.x, bytes_as_f32(far_y) * scale.y + far_shift.y),
        min(bytes_as_f32(far_z) * scale.z + far_shift.z, vec4<f32>(t_max)),
    );
    let met = near <= far;
    // Only of inner nodes (24 + slot) are bits 3 and 4 both set.
    let inner = (((meta_word & (meta_word << 1u)) & 0x10101010u) >> 4u) * 0xffu;
    let position = (meta_word ^ (octant & inner)) & 0x1f1f1f1fu;
    let bits = (meta_word >> 5u) & 0x07070707u;
    return select(0u, (bits & 0xffu) << (position & 0xffu), met.x)
        | select(0u, ((bits >> 8u) & 0xffu) << ((position >> 8u) & 0xffu), met.y)
        | select(0u, ((bits >> 16u) & 0xffu) << ((position >> 16u) & 0xffu), met.z)
        | select(0u, (bits >> 24u) << (position >> 24u), met.w);
}

// (first child, first triangle, bits of box_hits, mask of inner slots) of a node.
fn node_hits(node: u32, ray: BoxRay, t_min: f32, t_max: f32) -> vec4<u32> {
    let head = bvh_nodes[5u * node];
    let links = bvh_nodes[5u * node + 1u];
    let x = bvh_nodes[5u * node + 2u];
    let y = bvh_nodes[5u * node + 3u];
    let z = bvh_nodes[5u * node + 4u];
    let exponents = (vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu);
    let scale = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * ray.inverse;
    let shift = (bitcast<vec3<f32>>(head.xyz) - ray.origin) * ray.inverse;
    let slack = (abs(shift) + 255.0 * abs(scale)) * BOX_SLACK;
    let near = shift - slack;
    let far = shift + slack;
    // Lower planes come first where the ray goes up.
    let xs = select(x, x.zwxy, ray.negative.x);
    let ys = select(y, y.zwxy, ray.negative.y);
    let zs = select(z, z.zwxy, ray.negative.z);
    let hits = box_hits(links.z, ray.octant, xs.x, xs.z, ys.x, ys.z, zs.x, zs.z, scale, near, far, t_min, t_max)
        | box_hits(links.w, ray.octant, xs.y, xs.w, ys.y, ys.w, zs.y, zs.w, scale, near, far, t_min, t_max);
    return vec4<u32>(links.x, links.y, hits, head.w >> 24u);
}

// Where the ray meets a triangle, from either side. A miss has triangle NO_TRIANGLE. Edges give way by
// their rounding error, so that no ray slips between neighbours; but not for a ray that starts on a facet
// (`leaves`): one that starts beside an edge would meet the neighbour's widened outline behind it.
fn triangle_hit(origin: vec3<f32>, dir: vec3<f32>, triangle: u32, v0: vec3<f32>, leaves: bool) -> Hit {
    let e1 = bvh_triangles[3u * triangle + 1u].xyz;
    let e2 = bvh_triangles[3u * triangle + 2u].xyz;
    let start = origin - v0;
    let normal = cross(e1, e2);
    let along = -dot(dir, normal);
    // Everything below is a fraction of |along|.
    let side = sign(along);
    let size = abs(along);
    let u = side * dot(start, cross(dir, e2));
    let v = side * dot(start, cross(e1, dir));
    let edges = max(abs(e1), abs(e2));
    let slack = select(edge_slack, 0.0, leaves) * dot(abs(start), vec3<f32>(1.0)) * dot(abs(dir), vec3<f32>(1.0)) * max(edges.x, max(edges.y, edges.z));
    if size > 0.0 && u >= -slack && v >= -slack && u + v <= size + slack {
        return Hit(side * dot(start, normal) / size, u / size, v / size, triangle);
    }
    return Hit(0.0, 0.0, 0.0, NO_TRIANGLE);
}

fn bvh_hit(origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32, skip_patch: u32, any: bool) -> Hit {
    var best = Hit(t_max, 0.0, 0.0, NO_TRIANGLE);
    let ray = box_ray(origin, dir);
    var stack: array<vec2<u32>, BVH_STACK>;
    var depth = 0u;
    // First child of a node; its children still to be visited (upper byte) and its inner slots. The root is
    // taken for the only child of a node.
    var nodes = vec2<u32>(0u, 0x80000000u);
    loop {
        if nodes.y <= 0x00ffffffu {
            if depth == 0u {
                break;
            }
            depth -= 1u;
            nodes = stack[depth];
        }
        let position = firstLeadingBit(nodes.y);
        let slot = (position - 24u) ^ (ray.octant & 0xffu);
        let child = nodes.x + countOneBits(nodes.y & ((1u << slot) - 1u));
        nodes.y &= ~(1u << position);
        if nodes.y > 0x00ffffffu {
            stack[depth] = nodes;
            depth += 1u;
        }
        let node = node_hits(child, ray, t_min, best.t);
        nodes = vec2<u32>(node.x, (node.z & 0xff000000u) | node.w);
        var leaves = node.z & 0x00ffffffu;
        while leaves != 0u {
            let offset = firstTrailingBit(leaves);
            leaves &= leaves - 1u;
            let triangle = node.y + offset;
            let head = bvh_triangles[3u * triangle];
            if bitcast<u32>(head.w) == skip_patch {
                continue;
            }
            let hit = triangle_hit(origin, dir, triangle, head.xyz, skip_patch != 0xffffffffu);
            // The lower index wins a tie, whatever the order of the visit.
            if hit.triangle != NO_TRIANGLE && hit.t > t_min && (hit.t < best.t || (hit.t == best.t && triangle < best.triangle && best.triangle != NO_TRIANGLE)) {
                best = hit;
                if any {
                    return best;
                }
            }
        }
    }
    return best;
}

// Nearest triangle with t_min < t < t_max along `dir`, which need not be a unit vector. Triangles of
// `skip_patch` do not count: a ray that leaves a plane does not meet it again.
fn closest_hit(origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32, skip_patch: u32) -> Hit {
    return bvh_hit(origin, dir, t_min, t_max, skip_patch, false);
}

// Whether there is any.
fn any_hit(origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32, skip_patch: u32) -> bool {
    return bvh_hit(origin, dir, t_min, t_max, skip_patch, true).triangle != NO_TRIANGLE;
}
