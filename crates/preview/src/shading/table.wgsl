// A BRDF table: B = sum of c_i(v) L_i [KSS02, eq. 1]. The twin of table.rs, which says how the views lie on
// the map.
//
// It needs turned_light.wgsl, and a file that says how the table and the light are kept: the struct
// `TablePoint`, what is looked up at a point, and the functions `table_coefficient_at` and `table_light_at`,
// coefficients of the table and of the light there: gpu/table_buffers.wgsl or web/table.wgsl.

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

// The place of a view, a unit vector in the frame of a point, on the map: from -1 to 1 to the right, and down.
fn table_place_of(table: TableUniforms, view: vec3f) -> vec2f {
    let z = select(max(view.z, 0.0), abs(view.z), table.mirrored == 1u);
    let across = select(max(length(view.xy), 1e-30), 1.0 + z, z > 0.0);
    return vec2f(view.x, -view.y) / across;
}

// The radiance of a point that has this frame.
fn table_radiance(table: TableUniforms, at: TablePoint, frame: mat3x3f) -> vec3f {
    let known = min(table.rows, table.light_rows);
    var radiance = table_coefficient_at(table, at, 0u) * table_light_at(table, at, 0u);
    let angles = turned_angles(frame);
    var entry = 0u;
    for (var l = 1u; l * l < known; l++) {
        var band: array<vec3f, TURNED_WIDTH>;
        for (var row = 0u; row <= 2u * l; row++) {
            band[row] = table_light_at(table, at, l * l + row);
        }
        turn_band(l, entry, angles, &band);
        for (var row = 0u; row <= 2u * l; row++) {
            radiance += table_coefficient_at(table, at, l * l + row) * band[row];
        }
        entry += turned_entries(l);
    }
    return radiance;
}
