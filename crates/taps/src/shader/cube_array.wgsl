// Where a direction of the world looks into the cubes.
fn tap_cube(d: vec3f) -> vec3f {
    return CUBE_COORDINATES;
}

// Level k of the light, which is mip k / 4 of layer k % 4.
fn tap_level(c: vec3f, k: f32) -> vec3f {
    let mip: f32 = floor(0.25 * k);
    let layer: f32 = k - 4.0 * mip;
    return sample_cube(tap_levels, c, layer, mip).rgb;
}

// The light about normals by kernel k, which is layer k.
fn tap_normal_level(c: vec3f, k: f32) -> vec3f {
    let mip: f32 = 0.0;
    return sample_cube(tap_normals, c, k, mip).rgb;
}
