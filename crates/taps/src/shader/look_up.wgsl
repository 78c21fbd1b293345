// A row of the table; its columns go from a view along the normal (u = 0) to the horizon (u = 1).
fn tap_row(u: f32, row: i32) -> vec4f {
    let place: vec2f = vec2f((64.0 * u + 0.5) / 65.0, (f32(row) + 0.5) / f32(TAP_ROWS));
    return sample_2d(tap_table, place);
}

// The light about a direction, blurred by a Gaussian with a standard deviation of 2^log_std radians: linear
// in the variance between two levels, which are a fourth of an octave apart.
fn tap_blurred(d: vec3f, log_std: f32) -> vec3f {
    let p: vec3f = tap_cube(d);
    let x: f32 = clamp(4.0 * (log_std - TAP_SHARPEST), 0.0, TAP_LAST - 0.001);
    let k: f32 = floor(x);
    let share: f32 = (exp2(0.5 * (x - k)) - 1.0) * 2.41421356;
    return mix(tap_level(p, k), tap_level(p, k + 1.0), share);
}

// The light about the normal, from all of its hemisphere alike (y = 0) to the cosine (y = 1).
fn tap_about_normal(N: vec3f, y: f32) -> vec3f {
    let p: vec3f = tap_cube(N);
    let x: f32 = clamp(3.0 * y, 0.0, 2.99999);
    let k: f32 = floor(x);
    return mix(tap_normal_level(p, k), tap_normal_level(p, k + 1.0), x - k);
}

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
