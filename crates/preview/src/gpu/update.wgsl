// Equation 12 at every texel of a cube, from coefficients to a reflection map.

@group(2) @binding(0) var reflection: texture_storage_2d_array<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn update(@builtin(global_invocation_id) id: vec3u) {
    // Six layers for each part, one for each face.
    let part = map_uniforms.parts[id.z / 6u];
    if any(id.xy >= vec2u(part.edge)) {
        return;
    }
    let radiance = global_update(Texel(id.z % 6u, id.x, id.y), part);
    textureStore(reflection, id.xy, id.z, vec4f(radiance, 1.0));
}
