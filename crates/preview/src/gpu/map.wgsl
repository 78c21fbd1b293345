// The map of a mode: faces of cubes in layers, or one lat-long image.

struct MapUniforms {
    // The central direction of the texels: `CENTRE_REFLECTION` and so on.
    centre: u32,
    // Texels along the edge of a face.
    edge: u32,
    // P.
    degree: u32,
    // 1 if there are only coefficients of q = 0.
    zonal: u32,
    // The slices of Kautz and McCool's texture.
    slices: u32,
    // Texels along the edge of a face of the next level of detail.
    coarse_edge: u32,
    // The share of that level.
    share: f32,
}

@group(1) @binding(0) var<uniform> map_uniforms: MapUniforms;
@group(1) @binding(1) var map: texture_2d_array<f32>;
