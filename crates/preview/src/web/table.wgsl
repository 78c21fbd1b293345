// A BRDF table of one material under distant light, whose views lie on a texture that the device filters. It
// needs surface.wgsl, turned_light.wgsl and table.wgsl.

@group(1) @binding(2) var<uniform> table_uniforms: TableUniforms;
// Layer i has coefficient i in its three colours; of a grey table, layer i / 4 has it as component i % 4.
@group(1) @binding(3) var table_map: texture_2d_array<f32>;
@group(1) @binding(4) var table_sampler: sampler;
// A coefficient of the light each.
@group(1) @binding(5) var<storage, read> table_light: array<vec4f>;
@group(1) @binding(6) var<storage, read> quarter_turns: array<vec2f>;

// The place of the view on the map, from 0 to 1 to the right, and down.
struct TablePoint {
    place: vec2f,
}

fn table_coefficient_at(table: TableUniforms, at: TablePoint, i: u32) -> vec3f {
    if table.channels == 1u {
        return vec3f(textureSampleLevel(table_map, table_sampler, at.place, i / 4u, 0.0)[i % 4u]);
    }
    return textureSampleLevel(table_map, table_sampler, at.place, i, 0.0).rgb;
}

fn table_light_at(table: TableUniforms, at: TablePoint, i: u32) -> vec3f {
    return table_light[i].rgb;
}

// The radiance of a surface toward the viewer.
fn table_reflected(surface: Surface) -> vec3f {
    let frame = mat3x3f(surface.tangent, cross(surface.normal, surface.tangent), surface.normal);
    let place = table_place_of(table_uniforms, surface.view * frame);
    return table_radiance(table_uniforms, TablePoint(0.5 * place + 0.5), frame);
}
