// Where a direction of the world looks: the face as z, in the order +X -X +Y -Y +Z -Z, and the place there as
// xy, from the top left (0) to the bottom right (1).
fn tap_cube(d: vec3f) -> vec3f {
    let c: vec3f = CUBE_COORDINATES;
    let a: vec3f = abs(c);
    if (a.x >= a.y && a.x >= a.z) {
        return vec3f(0.5 + 0.5 * vec2f(-sign(c.x) * c.z, -c.y) / a.x, 0.5 - 0.5 * sign(c.x));
    }
    if (a.y >= a.z) {
        return vec3f(0.5 + 0.5 * vec2f(c.x, sign(c.y) * c.z) / a.y, 2.5 - 0.5 * sign(c.y));
    }
    return vec3f(0.5 + 0.5 * vec2f(sign(c.z) * c.x, -c.y) / a.z, 4.5 - 0.5 * sign(c.z));
}

// The texel of level k in a picture whose first level has faces of so many texels along an edge. Four levels
// have the same size and lie side by side, their faces below each other, each with a border of one texel. The
// first four are at the left; the others are to the right of them, one size below the other.
fn tap_texel(p: vec3f, edge: f32, k: f32) -> vec2f {
    let octave: f32 = floor(0.25 * k);
    let n: f32 = exp2(-octave) * edge;
    let left: f32 = min(octave, 1.0) * 4.0 * (edge + 2.0) + (k - 4.0 * octave) * (n + 2.0);
    let top: f32 = 6.0 * max(edge - 2.0 * n + 2.0 * (octave - 1.0), 0.0) + p.z * (n + 2.0);
    return vec2f(left + 1.0 + n * p.x, top + 1.0 + n * p.y);
}

// Level k of the light.
fn tap_level(p: vec3f, k: f32) -> vec3f {
    let place: vec2f = tap_texel(p, TAP_EDGE, k) / TAP_SIZE;
    return sample_2d(tap_levels, place).rgb;
}

// The light about normals by kernel k, in a picture of its own.
fn tap_normal_level(p: vec3f, k: f32) -> vec3f {
    let place: vec2f = tap_texel(p, 16.0, k) / vec2f(72.0, 108.0);
    return sample_2d(tap_normals, place).rgb;
}
