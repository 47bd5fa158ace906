// What the shared parts compute on this adapter, for the host to check before it is trusted.
// An item is 16 words, the first of which says what to do; its answer is 4 words.
struct SelfTestParams {
    count: u32,
    zero: u32,
}

@group(0) @binding(0) var<uniform> params: SelfTestParams;
@group(0) @binding(1) var<storage, read> items: array<u32>;
@group(0) @binding(2) var<storage, read_write> answers: array<u32>;

fn item_f32(at: u32) -> f32 {
    return bitcast<f32>(items[at]);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    barrier_zero = params.zero;
    let i = linear_id(workgroup_id, num_workgroups, local_index, 64u);
    if i >= params.count {
        return;
    }
    let at = 16u * i;
    var answer = vec4<u32>();
    switch items[at] {
        case 0u: {
            let a = item_f32(at + 1u);
            let b = item_f32(at + 2u);
            answer = bitcast<vec4<u32>>(vec4<f32>(two_sum(a, b), two_prod(a, b)));
        }
        case 1u: {
            let a_hi = vec3<f32>(item_f32(at + 1u), item_f32(at + 2u), item_f32(at + 3u));
            let a_lo = vec3<f32>(item_f32(at + 4u), item_f32(at + 5u), item_f32(at + 6u));
            let b_hi = vec3<f32>(item_f32(at + 7u), item_f32(at + 8u), item_f32(at + 9u));
            let b_lo = vec3<f32>(item_f32(at + 10u), item_f32(at + 11u), item_f32(at + 12u));
            let wavelength = vec2<f32>(item_f32(at + 13u), item_f32(at + 14u));
            let length = dfv_length(dfv_sub(DfVec3(a_hi, a_lo), DfVec3(b_hi, b_lo)));
            answer.x = turns_from_df(df_div(length, wavelength));
        }
        case 2u: {
            let counter = vec4<u32>(items[at + 1u], items[at + 2u], items[at + 3u], items[at + 4u]);
            answer = philox4x32_10(counter, vec2<u32>(items[at + 5u], items[at + 6u]));
        }
        case 3u: {
            let t = items[at + 1u];
            answer = bitcast<vec4<u32>>(vec4<f32>(cis_turns(t), cis_turns_f(item_f32(at + 2u))));
        }
        default: {}
    }
    answers[4u * i] = answer.x;
    answers[4u * i + 1u] = answer.y;
    answers[4u * i + 2u] = answer.z;
    answers[4u * i + 3u] = answer.w;
}
