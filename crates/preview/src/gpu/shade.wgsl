// A mode over the samples that see one object. `shade_mode` is the mode.

struct Part {
    // The pixels: those of the object, or more.
    origin: vec2u,
    extent: vec2u,
    // From 1.
    number: u32,
    // Of brute force: which light samples.
    first: u32,
    count: u32,
}

@group(2) @binding(0) var<uniform> part: Part;
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
