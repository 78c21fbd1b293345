// The radiance of a matte surface at each vertex of a mesh that hides light from itself: the sum over j of t_j
// L_j (Sloan, Kautz and Snyder 2002). The light is turned into the mesh's coordinates, which are the world's.
// It needs turned_light.wgsl and page.wgsl.

struct TransferUniforms {
    // Coefficients of a vector, and of a channel of the light.
    rows: u32,
    light_rows: u32,
    // 1 if all channels have the same vector, else 3.
    channels: u32,
}

@group(1) @binding(2) var<uniform> transfer_uniforms: TransferUniforms;
// A coefficient of the light each.
@group(1) @binding(3) var<storage, read> transfer_light: array<vec4f>;
@group(1) @binding(4) var<storage, read> quarter_turns: array<vec2f>;
// Four coefficients each: vertex by vertex, channel by channel.
@group(1) @binding(5) var<storage, read> transfer_vectors: array<vec4f>;

struct TransferVertex {
    @invariant @builtin(position) position: vec4f,
    @location(0) radiance: vec3f,
}

fn transfer_coefficient(vertex: u32, channel: u32, i: u32) -> f32 {
    let vector = vertex * transfer_uniforms.channels + channel;
    return transfer_vectors[vector * ((transfer_uniforms.rows + 3u) / 4u) + i / 4u][i % 4u];
}

fn transfer_coefficients(vertex: u32, i: u32) -> vec3f {
    let first = transfer_coefficient(vertex, 0u, i);
    if transfer_uniforms.channels == 1u {
        return vec3f(first);
    }
    return vec3f(first, transfer_coefficient(vertex, 1u, i), transfer_coefficient(vertex, 2u, i));
}

@vertex
fn transfer_vertex(@builtin(vertex_index) vertex: u32, @location(0) position: vec3f) -> TransferVertex {
    let known = min(transfer_uniforms.rows, transfer_uniforms.light_rows);
    var radiance = transfer_coefficients(vertex, 0u) * transfer_light[0].rgb;
    let angles = turned_angles(page.to_light);
    var entry = 0u;
    for (var l = 1u; l * l < known; l++) {
        var band: array<vec3f, TURNED_WIDTH>;
        for (var row = 0u; row <= 2u * l; row++) {
            band[row] = transfer_light[l * l + row].rgb;
        }
        turn_band(l, entry, angles, &band);
        for (var row = 0u; row <= 2u * l; row++) {
            radiance += transfer_coefficients(vertex, l * l + row) * band[row];
        }
        entry += turned_entries(l);
    }
    return TransferVertex(page.clip * vec4f(position, 1.0), radiance);
}

@fragment
fn transfer_fragment(at: TransferVertex) -> @location(0) vec4f {
    return page_shown(at.radiance);
}
