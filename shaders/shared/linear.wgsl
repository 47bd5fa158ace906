// One index per thread of a dispatch whose workgroups are spread over x and y (a dimension holds
// 65,535 of them at most). The last row can run past the count: compare with the count in the uniform.
fn linear_id(workgroup_id: vec3<u32>, num_workgroups: vec3<u32>, local_index: u32, workgroup_size: u32) -> u32 {
    return (workgroup_id.y * num_workgroups.x + workgroup_id.x) * workgroup_size + local_index;
}
