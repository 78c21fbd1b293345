// Shades the vertices of a mesh with a BRDF table, in the mesh's coordinates.

struct VertexUniforms {
    // The viewer's place.
    viewer: vec3f,
    // The number of vertices.
    count: u32,
    table: TableUniforms,
}

@group(0) @binding(0) var<uniform> vertices: VertexUniforms;
// Four for each vertex: its position, with its place between the materials of the table, and the axes x, y
// and N of its frame.
@group(0) @binding(1) var<storage, read> frames: array<vec4f>;
@group(0) @binding(2) var<storage, read> table_values: array<f32>;
@group(0) @binding(3) var<storage, read> table_light: array<f32>;
@group(0) @binding(4) var<storage, read_write> vertex_radiance: array<vec4f>;

@compute @workgroup_size(64)
fn shade_vertices(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let vertex = id.y * groups.x * 64u + id.x;
    if vertex >= vertices.count {
        return;
    }
    let away = vertices.viewer - frames[4u * vertex].xyz;
    let normal = frames[4u * vertex + 3u].xyz;
    let distance = length(away);
    let view = select(normal, away / distance, distance > 0.0);
    let local = vec3f(dot(frames[4u * vertex + 1u].xyz, view), dot(frames[4u * vertex + 2u].xyz, view), dot(normal, view));
    vertex_radiance[vertex] = vec4f(table_radiance(vertices.table, vertex, local, frames[4u * vertex].w), 1.0);
}
