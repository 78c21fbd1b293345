// The radiance of a surface with the normal N and the tangent T toward the viewer, who is at V; all in the
// world, N and V of length 1. The lights beside the levels are not in it.
fn tap_reflected(N: vec3f, T: vec3f, V: vec3f) -> vec3f {
    let across: vec3f = T - dot(N, T) * N;
    let X: vec3f = across * inverseSqrt(max(dot(across, across), 1e-12));
    let Y: vec3f = ACROSS;
    let v: vec3f = normalize(vec3f(dot(V, X), dot(V, Y), max(dot(V, N), 0.0)));
    let disc: vec2f = v.xy * inverseSqrt((1.0 + v.z) * (1.0 + sqrt(v.z)));
    let mirror: vec2f = MIRROR;
    let p: vec2f = (mirror * disc - TAP_FIRST) / (1.0 - TAP_FIRST);
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var j: i32 = 0; j < TAP_COUNT; j++) {
        let shape: vec4f = tap_node(p, 2 * j);  // the slopes of a facet, log2 of the width
        let weight: vec4f = tap_node(p, 2 * j + 1);
        let h: vec3f = vec3f(mirror * shape.xy, 1.0);
        let l: vec3f = 2.0 * dot(v, h) / dot(h, h) * h - v;
        let d: vec3f = l.x * X + l.y * Y + l.z * N;
        sum += weight.rgb * tap_blurred(d, shape.z);
    }
    for (var j: i32 = 0; j < TAP_NORMALS; j++) {
        let tap: vec4f = tap_node(p, 2 * TAP_COUNT + j);  // the weight, y
        sum += tap.rgb * tap_about_normal(N, tap.w);
    }
    return sum;
}
