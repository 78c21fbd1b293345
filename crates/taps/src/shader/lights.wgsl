// The radiance toward the viewer that the lights beside the levels add. Of each light there are the direction
// toward it and its radius in radians, and the irradiance of a surface that faces it. tap_brdf is your
// renderer's own BRDF in 1/sr, without the cosine; it may widen its highlight by the radius.
fn tap_lights(N: vec3f, V: vec3f) -> vec3f {
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var j: i32 = 0; j < TAP_LIGHTS; j++) {
        let toward: vec4f = tap_light_directions[j];
        let received: vec3f = tap_light_irradiances[j].rgb * max(dot(N, toward.xyz), 0.0);
        sum += received * tap_brdf(N, V, toward.xyz, toward.w);
    }
    return sum;
}
