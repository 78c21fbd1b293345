// The difference of two modes. The twin of difference.rs.

// The absolute difference, not amplified.
fn difference(value: vec3f, compared: vec3f) -> vec3f {
    return abs(value - compared);
}
