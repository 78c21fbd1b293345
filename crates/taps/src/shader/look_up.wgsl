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
