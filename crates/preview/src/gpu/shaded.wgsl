// Draws meshes shaded by a BRDF table: light, viewer and frames are in the coordinates of the mesh, and the
// table is looked up at each sample.

struct ShadedUniforms {
    // The viewer's place.
    viewer: vec3f,
    // 1 if each vertex has a light of its own, 0 if all have the first.
    lights_of_vertices: u32,
    table: TableUniforms,
}

@group(1) @binding(0) var<uniform> shaded: ShadedUniforms;
// Four for each vertex: its position, and the axes x, y and N of its frame. The last components of the first
// two are its place among the materials of the table.
@group(1) @binding(1) var<storage, read> frames: array<vec4f>;
@group(1) @binding(2) var<storage, read> table_values: array<f32>;
@group(1) @binding(3) var<storage, read> table_light: array<f32>;
// The vertices of the triangles.
@group(1) @binding(4) var<storage, read> corners: array<u32>;
@group(1) @binding(5) var<storage, read> quarter_turns: array<vec2f>;

struct ShadedVertex {
    @invariant @builtin(position) position: vec4f,
    // The shares of the triangle's vertices.
    @location(0) shares: vec3f,
    // The axes x and N of the frame, of any length between vertices.
    @location(1) tangent: vec3f,
    @location(2) normal: vec3f,
    // Toward the viewer, of any length.
    @location(3) toward: vec3f,
    // The place among the materials.
    @location(4) blend: vec2f,
    @location(5) @interpolate(flat) triangle: u32,
}

@vertex
fn shaded_vertex(@builtin(vertex_index) corner: u32) -> ShadedVertex {
    let frame = 4u * corners[corner];
    let position = frames[frame].xyz;
    return ShadedVertex(
        placed.clip * vec4f(position, 1.0),
        vec3f(vec3u(corner % 3u) == vec3u(0u, 1u, 2u)),
        frames[frame + 1u].xyz,
        frames[frame + 3u].xyz,
        shaded.viewer - position,
        vec2f(frames[frame].w, frames[frame + 1u].w),
        corner / 3u,
    );
}

// The inner side is black and has a last value of 0: a table has no light there.
@fragment
fn shaded_fragment(@builtin(front_facing) front: bool, at: ShadedVertex) -> @location(0) vec4f {
    if front == (placed.mirrored == 1u) {
        return vec4f(0.0);
    }
    let first = 3u * at.triangle;
    let vertices = shaded.lights_of_vertices * vec3u(corners[first], corners[first + 1u], corners[first + 2u]);
    let frame = frame_at(at.tangent, at.normal);
    let distance = length(at.toward);
    let view = select(vec3f(0.0, 0.0, 1.0), at.toward * frame / distance, distance > 0.0);
    let point = TablePoint(table_lookup(shaded.table, view, at.blend), vertices, at.shares);
    return vec4f(table_radiance(shaded.table, point, frame), 1.0);
}
