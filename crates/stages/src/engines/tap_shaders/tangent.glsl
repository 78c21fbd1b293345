varying vec3 tap_mesh_tangent;
varying vec2 tap_uv;

// The tangent of the mesh at the place p or, if it has none, the direction in which u grows.
vec3 tap_tangent(vec3 p) {
    vec3 along_x = dFdx(p);
    vec3 along_y = dFdy(p);
    vec2 u = vec2(dFdx(tap_uv.x), dFdy(tap_uv.x));
    vec2 v = vec2(dFdx(tap_uv.y), dFdy(tap_uv.y));
    vec3 grows = (along_x * v.y - along_y * v.x) * sign(u.x * v.y - u.y * v.x);
    vec3 T = dot(tap_mesh_tangent, tap_mesh_tangent) > 0.0 ? tap_mesh_tangent : grows;
    return T / max(length(T), 1e-18);
}
