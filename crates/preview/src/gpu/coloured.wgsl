// Draws the base colours of textures: linear RGB and 1; 0 where the nearest object has no texture.

struct ColouredVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) coordinates: vec2f,
}

@vertex
fn coloured_vertex(@location(0) position: vec3f, @location(3) coordinates: vec2f) -> ColouredVertex {
    return ColouredVertex(placed.clip * vec4f(position, 1.0), coordinates);
}

// The coordinates u and 1 / w, the fourth part of the position here, are such that u / w and 1 / w are linear
// on the screen: their steps are exact, and the derivatives of u follow from them.
@fragment
fn coloured_fragment(at: ColouredVertex) -> @location(0) vec4f {
    let nearness = at.position.w;
    let sum = at.coordinates * nearness;
    let scale = 1.0 / (nearness * placed.samples);
    let across = (dpdx(sum) - at.coordinates * dpdx(nearness)) * scale;
    let down = (dpdy(sum) - at.coordinates * dpdy(nearness)) * scale;
    return vec4f(texture_color(at.coordinates, across, down), 1.0);
}

struct UncolouredVertex {
    @invariant @builtin(position) position: vec4f,
}

@vertex
fn uncoloured_vertex(@location(0) position: vec3f) -> UncolouredVertex {
    return UncolouredVertex(placed.clip * vec4f(position, 1.0));
}

@fragment
fn uncoloured_fragment() -> @location(0) vec4f {
    return vec4f(0.0);
}
