// The radiance of a surface with the normal N toward the viewer, who is at V; both in the world, of length 1.
// The lights beside the levels are not in it.
fn tap_reflected(N: vec3f, V: vec3f) -> vec3f {
    let cosine: f32 = max(dot(N, V), 0.0);
    let R: vec3f = normalize(2.0 * cosine * N - V);
    let beside: vec3f = N - cosine * R;
    let T: vec3f = beside * inverseSqrt(max(dot(beside, beside), 1e-12));
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var j: i32 = 0; j < TAP_COUNT; j++) {
        let shape: vec4f = tap_row(1.0 - cosine, 2 * j);  // the angle from R toward N, log2 of the width
        let weight: vec4f = tap_row(1.0 - cosine, 2 * j + 1);
        let d: vec3f = cos(shape.x) * R + sin(shape.x) * T;
        sum += weight.rgb * tap_blurred(d, shape.y);
    }
    for (var j: i32 = 0; j < TAP_NORMALS; j++) {
        let tap: vec4f = tap_row(1.0 - cosine, 2 * TAP_COUNT + j);  // the weight, y
        sum += tap.rgb * tap_about_normal(N, tap.w);
    }
    return sum;
}
