// The map of a mode: faces of cubes in layers, or one lat-long image.

// A map whose radiance is a part of what is seen.
struct MapPart {
    // The central direction of the texels: `CENTRE_REFLECTION` and so on.
    centre: u32,
    // Texels along the edge of a face. Faces are in the upper left corner of their layers.
    edge: u32,
    // P.
    degree: u32,
    // 1 if there are only coefficients of q = 0.
    zonal: u32,
    // The slices of Kautz and McCool's texture.
    slices: u32,
    // The first of its layers.
    first: u32,
    // What its radiance is multiplied by.
    weight: f32,
    // Elements of arrays of uniforms have a multiple of 16 bytes.
    unused: u32,
}

struct MapUniforms {
    parts: array<MapPart, 2>,
    // How many there are.
    count: u32,
}

@group(1) @binding(0) var<uniform> map_uniforms: MapUniforms;
@group(1) @binding(1) var map: texture_2d_array<f32>;
