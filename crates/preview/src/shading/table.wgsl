// A BRDF table at a vertex: B = sum of c_i(v) L_i [KSS02, eq. 1]. The twin of table.rs, which says how the
// views lie on the map.
//
// It needs the buffers table_values, [Q, N, N, rows, channels], and table_light,
// [vertices, 3, rows of the light].

struct TableUniforms {
    // N: the map has N x N views.
    size: u32,
    // Coefficients of a view.
    rows: u32,
    // 1 if the table is grey, else 3.
    channels: u32,
    // 1 if a view from below the horizon is looked up at its mirror image, 0 if at the horizon.
    mirrored: u32,
    // Coefficients of a channel of the light.
    light_rows: u32,
    // Q: the materials of the table.
    count: u32,
}

// The place of a coordinate between two texels: the first, the second, and the share of the second.
struct TablePlace {
    first: u32,
    second: u32,
    share: f32,
}

fn table_place(table: TableUniforms, along: f32, across: f32) -> TablePlace {
    let last = f32(table.size - 1u);
    let at = clamp(0.5 * (along / across + 1.0) * f32(table.size) - 0.5, 0.0, last);
    let first = u32(at);
    return TablePlace(first, min(first + 1u, table.size - 1u), at - f32(first));
}

// A coefficient between four texels of a material; grey in every channel if the table is.
fn table_coefficient(
    table: TableUniforms,
    material: u32,
    i: u32,
    texels: array<u32, 4>,
    weights: array<f32, 4>,
) -> vec3f {
    let map = material * table.size * table.size;
    var c = vec3f(0.0);
    for (var tap = 0u; tap < 4u; tap++) {
        let at = ((map + texels[tap]) * table.rows + i) * table.channels;
        if table.channels == 1u {
            c += weights[tap] * table_values[at];
        } else {
            c += weights[tap] * vec3f(table_values[at], table_values[at + 1u], table_values[at + 2u]);
        }
    }
    return c;
}

// The radiance of a vertex toward a view, a unit vector in its frame; `blend` is where it is between the first
// material, 0, and the last, 1.
fn table_radiance(table: TableUniforms, vertex: u32, view: vec3f, blend: f32) -> vec3f {
    let z = select(max(view.z, 0.0), abs(view.z), table.mirrored == 1u);
    let across = select(max(length(view.xy), 1e-30), 1.0 + z, z > 0.0);
    let column = table_place(table, view.x, across);
    let row = table_place(table, -view.y, across);
    let texels = array<u32, 4>(
        row.first * table.size + column.first,
        row.first * table.size + column.second,
        row.second * table.size + column.first,
        row.second * table.size + column.second,
    );
    let weights = array<f32, 4>(
        (1.0 - column.share) * (1.0 - row.share),
        column.share * (1.0 - row.share),
        (1.0 - column.share) * row.share,
        column.share * row.share,
    );
    let last = f32(table.count - 1u);
    let q = clamp(blend * last, 0.0, last);
    let first = u32(q);
    let share = q - f32(first);
    let light = vertex * 3u * table.light_rows;
    var radiance = vec3f(0.0);
    for (var i = 0u; i < min(table.rows, table.light_rows); i++) {
        var c = table_coefficient(table, first, i, texels, weights);
        if share > 0.0 {
            c += share * (table_coefficient(table, first + 1u, i, texels, weights) - c);
        }
        radiance += c * vec3f(
            table_light[light + i],
            table_light[light + table.light_rows + i],
            table_light[light + 2u * table.light_rows + i],
        );
    }
    return radiance;
}
