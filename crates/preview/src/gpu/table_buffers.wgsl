// A BRDF table and light in buffers, for points of triangles: table_values, [Q, N, N, rows, channels], and
// table_light, [vertices, rows of the light, 3]. It needs table.wgsl.

// The place of a coordinate between two texels: the first, the second, and the share of the second.
struct TablePlace {
    first: u32,
    second: u32,
    share: f32,
}

fn table_place(table: TableUniforms, along: f32) -> TablePlace {
    let last = f32(table.size - 1u);
    let at = clamp(0.5 * (along + 1.0) * f32(table.size) - 0.5, 0.0, last);
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

// A view, a unit vector in the frame of the point; and where the point is between the first material, 0, and
// the last, 1, along both parameters.
fn table_lookup(table: TableUniforms, view: vec3f, blend: vec2f) -> TableLookup {
    let place = table_place_of(table, view);
    let column = table_place(table, place.x);
    let row = table_place(table, place.y);
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

// What is looked up at a point of a triangle.
struct TablePoint {
    lookup: TableLookup,
    // The vertices of the triangle, and the shares that the point has of their lights.
    vertices: vec3u,
    shares: vec3f,
}

// Coefficient i of the table, between four materials.
fn table_coefficient_at(table: TableUniforms, at: TablePoint, i: u32) -> vec3f {
    let lookup = at.lookup;
    var c = table_coefficient(table, lookup, lookup.material, i);
    for (var k = 0u; k < 3u; k++) {
        if lookup.shares[k] > 0.0 {
            c += lookup.shares[k] * (table_coefficient(table, lookup, lookup.others[k], i) - c);
        }
    }
    return c;
}

// A coefficient of the light of a vertex.
fn table_light_of(table: TableUniforms, vertex: u32, i: u32) -> vec3f {
    let at = 3u * (vertex * table.light_rows + i);
    return vec3f(table_light[at], table_light[at + 1u], table_light[at + 2u]);
}

// A coefficient of the light between vertices.
fn table_light_at(table: TableUniforms, at: TablePoint, i: u32) -> vec3f {
    return at.shares.x * table_light_of(table, at.vertices.x, i)
        + at.shares.y * table_light_of(table, at.vertices.y, i)
        + at.shares.z * table_light_of(table, at.vertices.z, i);
}
