// What develop.wgsl develops where objects have textures: the radiance by the base colour of the texture.

// What coloured.wgsl draws.
@group(2) @binding(7) var colours: texture_2d<f32>;

// The radiance of a side's mode.
fn shown_radiance(pixel: vec2u, side: u32, radiance: vec3f) -> vec3f {
    let colour = textureLoad(colours, pixel, 0);
    let shows = select(settings.first_shows_material, settings.second_shows_material, side == 1u);
    if colour.a == 0.0 || shows == 0u {
        return radiance;
    }
    let seen = textureLoad(normals, pixel, 0);
    let tangent = textureLoad(tangents, pixel, 0).xyz;
    let surface = surface_new(seen.xyz, tangent, frame_ray(pixel), seen.w > 0.0);
    return base_color(u32(abs(seen.w)) - 1u, colour.rgb, radiance, surface);
}
