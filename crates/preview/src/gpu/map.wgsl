// The map that a mode reads: faces of cubes in layers, or one lat-long image.

struct Facts {
    // What the texels' directions are: `CENTRE_REFLECTION` and so on.
    centre: u32,
    // Texels along the edge of a face.
    edge: u32,
    // P.
    degree: u32,
    // 1 where the coefficients are those of q = 0 alone.
    zonal: u32,
    // Of Kautz and McCool's texture.
    slices: u32,
}

@group(1) @binding(0) var<uniform> facts: Facts;
@group(1) @binding(1) var map: texture_2d_array<f32>;
