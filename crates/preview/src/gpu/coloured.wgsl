// Draws the base colours of textures: linear RGB and 1; 0 where the nearest object has no texture.

struct ColouredVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) coordinates: vec2f,
}

@vertex
fn coloured_vertex(@location(0) position: vec3f, @location(3) coordinates: vec2f) -> ColouredVertex {
    return ColouredVertex(placed.clip * vec4f(position, 1.0), coordinates);
}

@fragment
fn coloured_fragment(at: ColouredVertex) -> @location(0) vec4f {
    return vec4f(texture_at_fragment(at.coordinates, at.position.w, placed.samples), 1.0);
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
