// Runs a mode, `shade_mode`, over the samples that hit one object.

struct PartUniforms {
    // A rectangle that contains the object's pixels.
    origin: vec2u,
    extent: vec2u,
    // The object's number, from 1.
    number: u32,
    // The range of light samples of brute force, or of lamps with shadows.
    first: u32,
    count: u32,
    // The set of their points.
    points: u32,
}

@group(2) @binding(0) var<uniform> part: PartUniforms;
@group(2) @binding(1) var<storage, read_write> radiance: array<vec4f>;

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= part.extent) {
        return;
    }
    let pixel = part.origin + id.xy;
    let seen = textureLoad(normals, pixel, 0);
    if u32(abs(seen.w)) != part.number {
        return;
    }
    let tangent = textureLoad(tangents, pixel, 0).xyz;
    let surface = surface_new(seen.xyz, tangent, frame_ray(pixel), seen.w > 0.0);
    let index = frame_index(pixel);
    radiance[index] = vec4f(shade_mode(surface, pixel, radiance[index].rgb), 1.0);
}
