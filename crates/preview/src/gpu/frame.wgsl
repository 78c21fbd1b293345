// The uniforms and inputs of all passes over the samples of a picture: one sample of each pixel.

struct FrameUniforms {
    // The ray through the picture's upper left corner, and the steps between samples: `ViewTransform`.
    corner: vec3f,
    // Samples along each side of a pixel.
    samples: u32,
    across: vec3f,
    pad_across: u32,
    down: vec3f,
    pad_down: u32,
    // In pixels.
    size: vec2u,
    // The sample's column and row in its pixel.
    chosen: vec2u,
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
// The normal, of any length, and the object's number from 1, negative on inner sides; 0 without a surface.
@group(0) @binding(1) var normals: texture_2d<f32>;
// The tangent, of any length.
@group(0) @binding(2) var tangents: texture_2d<f32>;

// The sample's place among all samples of the picture.
fn frame_sample(pixel: vec2u) -> vec2u {
    return pixel * frame.samples + frame.chosen;
}

// The sample's number among them.
fn frame_number(pixel: vec2u) -> u32 {
    let at = frame_sample(pixel);
    return at.y * (frame.size.x * frame.samples) + at.x;
}

fn frame_ray(pixel: vec2u) -> vec3f {
    let at = vec2f(frame_sample(pixel)) + 0.5;
    return frame.corner + frame.across * at.x + frame.down * at.y;
}

fn frame_index(pixel: vec2u) -> u32 {
    return pixel.y * frame.size.x + pixel.x;
}
