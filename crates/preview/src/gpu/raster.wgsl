// Draws meshes into the surface buffer: the nearest object at each sample, its normal and its tangent. Others
// draw positions in the mesh, which shadows read as their map.

struct PlacedUniforms {
    clip: mat4x4f,
    normal: mat3x3f,
    tangent: mat3x3f,
    // The object's number, from 1.
    number: f32,
    mirrored: u32,
    // Samples along each side of a pixel.
    samples: f32,
}

@group(0) @binding(0) var<uniform> placed: PlacedUniforms;

struct Vertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) tangent: vec3f,
}

struct FragmentOutput {
    @location(0) normal: vec4f,
    @location(1) tangent: vec4f,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec3f,
) -> Vertex {
    return Vertex(placed.clip * vec4f(position, 1.0), placed.normal * normal, placed.tangent * tangent);
}

@fragment
fn fragment(@builtin(front_facing) front: bool, at: Vertex) -> FragmentOutput {
    let outside = front != (placed.mirrored == 1u);
    return FragmentOutput(vec4f(at.normal, select(-placed.number, placed.number, outside)), vec4f(at.tangent, 0.0));
}

struct LocatedVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) in_mesh: vec3f,
}

@vertex
fn located_vertex(@location(0) position: vec3f) -> LocatedVertex {
    return LocatedVertex(placed.clip * vec4f(position, 1.0), position);
}

// The last value is 0 on the inner side.
@fragment
fn located_fragment(@builtin(front_facing) front: bool, at: LocatedVertex) -> @location(0) vec4f {
    return vec4f(at.in_mesh, select(0.0, 1.0, front != (placed.mirrored == 1u)));
}
