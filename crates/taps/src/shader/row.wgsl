// A row of the table; its columns go from a view along the normal (u = 0) to the horizon (u = 1).
fn tap_row(u: f32, row: i32) -> vec4f {
    let place: vec2f = vec2f((64.0 * u + 0.5) / 65.0, (f32(row) + 0.5) / f32(TAP_ROWS));
    return sample_2d(tap_table, place);
}
