// The radiance of a highlight with the normal N toward the viewer, who is at V; both in the world, of length
// 1. F0 is its reflectance head on. The lights beside the levels are not in it.
fn tap_reflected(N: vec3f, V: vec3f, roughness: f32, F0: vec3f) -> vec3f {
    let cosine: f32 = max(dot(N, V), 0.0);
    let R: vec3f = normalize(2.0 * cosine * N - V);
    let beside: vec3f = N - cosine * R;
    let T: vec3f = beside * inverseSqrt(max(dot(beside, beside), 1e-12));
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var j: i32 = 0; j < TAP_COUNT; j++) {
        let tap: vec4f = tap_row(1.0 - cosine, roughness, j);  // the angle from R toward N, log2 of the width
        let d: vec3f = cos(tap.x) * R + sin(tap.x) * T;
        sum += (tap.z * F0 + tap.w) * tap_blurred(d, tap.y);
    }
    for (var j: i32 = 0; j < TAP_NORMALS; j++) {
        let tap: vec4f = tap_row(1.0 - cosine, roughness, TAP_COUNT + j);  // y
        sum += (tap.z * F0 + tap.w) * tap_about_normal(N, tap.x);
    }
    return sum;
}

// The share of even light that the highlight reflects is F0 x + y: what a DFG table holds.
fn tap_albedo(cosine: f32, roughness: f32) -> vec2f {
    var sum: vec2f = vec2f(0.0, 0.0);
    for (var j: i32 = 0; j < TAP_COUNT + TAP_NORMALS; j++) {
        sum += tap_row(1.0 - cosine, roughness, j).zw;
    }
    return sum;
}
