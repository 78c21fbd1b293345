// A picture of the table at a place in it, each coordinate from 0 to 1; the pictures lie below each other.
fn tap_node(p: vec2f, picture: i32) -> vec4f {
    let texel: vec2f = (TAP_SIDE - 1.0) * p + vec2f(0.5, f32(picture) * TAP_SIDE + 0.5);
    let place: vec2f = texel / vec2f(TAP_SIDE, f32(TAP_ROWS) * TAP_SIDE);
    return sample_2d(tap_table, place);
}
