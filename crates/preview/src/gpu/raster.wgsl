// Draws meshes into the surface buffer: the nearest object at each sample, its normal and its tangent. Other
// entry points draw what single modes read as their map: the radiance of vertices, or positions in the mesh.

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

struct ShadedVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) radiance: vec3f,
}

@vertex
fn shaded_vertex(@location(0) position: vec3f, @location(3) radiance: vec4f) -> ShadedVertex {
    return ShadedVertex(placed.clip * vec4f(position, 1.0), radiance.rgb);
}

// The inner side is black: vertices do not know it.
@fragment
fn shaded_fragment(@builtin(front_facing) front: bool, at: ShadedVertex) -> @location(0) vec4f {
    let outside = front != (placed.mirrored == 1u);
    return vec4f(select(vec3f(0.0), at.radiance, outside), 1.0);
}

struct LocatedVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) in_mesh: vec3f,
}

@vertex
fn located_vertex(@location(0) position: vec3f) -> LocatedVertex {
    return LocatedVertex(placed.clip * vec4f(position, 1.0), position);
}

@fragment
fn located_fragment(at: LocatedVertex) -> @location(0) vec4f {
    return vec4f(at.in_mesh, 1.0);
}
