// A layer of the table; its columns go from a view along the normal (u = 0) to the horizon (u = 1), its rows
// over the parameter, from the first value (v = 0) to the last (v = 1).
fn tap_row(u: f32, v: f32, layer: i32) -> vec4f {
    let rows: f32 = f32(TAP_ROWS);
    let place: vec2f = vec2f((64.0 * u + 0.5) / 65.0, ((rows - 1.0) * v + 0.5) / rows);
    return sample_layer(tap_table, place, layer);
}
