// A BRDF table at a point of a triangle: B = sum of c_i(v) L_i [KSS02, eq. 1]. The twin of table.rs, which
// says how the views lie on the map.
//
// It needs turned_light.wgsl, and the buffers table_values, [Q, N, N, rows, channels], and table_light,
// [vertices, rows of the light, 3].

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
    // The materials of the table along the first parameter, and along the second.
    along: u32,
    across: u32,
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

// The values about a view and a place among the materials.
struct TableLookup {
    // Four texels and their weights.
    texels: array<u32, 4>,
    weights: array<f32, 4>,
    // The first of four materials, and the others with the shares that they have in the blend of those up to
    // them.
    material: u32,
    others: array<u32, 3>,
    shares: array<f32, 3>,
}

fn table_lookup(table: TableUniforms, view: vec3f, blend: vec2f) -> TableLookup {
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
    let last = vec2f(f32(table.along - 1u), f32(table.across - 1u));
    let q = clamp(blend * last, vec2f(0.0), last);
    let first = vec2u(q);
    let share = q - vec2f(first);
    let both = share.x * share.y;
    let material = first.x * table.across + first.y;
    return TableLookup(
        texels,
        weights,
        material,
        array<u32, 3>(material + table.across, material + 1u, material + table.across + 1u),
        array<f32, 3>(share.x, (share.y - both) / (1.0 - both), both),
    );
}

// Coefficient i of a material, between four texels; grey in every channel if the table is.
fn table_coefficient(table: TableUniforms, at: TableLookup, material: u32, i: u32) -> vec3f {
    let map = material * table.size * table.size;
    var c = vec3f(0.0);
    for (var tap = 0u; tap < 4u; tap++) {
        let value = ((map + at.texels[tap]) * table.rows + i) * table.channels;
        if table.channels == 1u {
            c += at.weights[tap] * table_values[value];
        } else {
            c += at.weights[tap] * vec3f(table_values[value], table_values[value + 1u], table_values[value + 2u]);
        }
    }
    return c;
}

// Coefficient i between four materials.
fn table_blended(table: TableUniforms, at: TableLookup, i: u32) -> vec3f {
    var c = table_coefficient(table, at, at.material, i);
    for (var k = 0u; k < 3u; k++) {
        if at.shares[k] > 0.0 {
            c += at.shares[k] * (table_coefficient(table, at, at.others[k], i) - c);
        }
    }
    return c;
}

// A coefficient of the light of a vertex.
fn table_light_of(table: TableUniforms, vertex: u32, i: u32) -> vec3f {
    let at = 3u * (vertex * table.light_rows + i);
    return vec3f(table_light[at], table_light[at + 1u], table_light[at + 2u]);
}

// A coefficient of the light of a point between vertices.
fn table_light_at(table: TableUniforms, vertices: vec3u, shares: vec3f, i: u32) -> vec3f {
    return shares.x * table_light_of(table, vertices.x, i)
        + shares.y * table_light_of(table, vertices.y, i)
        + shares.z * table_light_of(table, vertices.z, i);
}

// The radiance of a point of a triangle toward a view, a unit vector in the frame there. The point has these
// shares of the lights of three vertices; `blend` is where it is between the first material, 0, and the last,
// 1, along both parameters.
fn table_radiance(
    table: TableUniforms,
    vertices: vec3u,
    shares: vec3f,
    frame: mat3x3f,
    view: vec3f,
    blend: vec2f,
) -> vec3f {
    let at = table_lookup(table, view, blend);
    let known = min(table.rows, table.light_rows);
    var radiance = table_blended(table, at, 0u) * table_light_at(table, vertices, shares, 0u);
    let angles = turned_angles(frame);
    var entry = 0u;
    for (var l = 1u; l * l < known; l++) {
        var band: array<vec3f, TURNED_WIDTH>;
        for (var row = 0u; row <= 2u * l; row++) {
            band[row] = table_light_at(table, vertices, shares, l * l + row);
        }
        turn_band(l, entry, angles, &band);
        for (var row = 0u; row <= 2u * l; row++) {
            radiance += table_blended(table, at, l * l + row) * band[row];
        }
        entry += turned_entries(l);
    }
    return radiance;
}
