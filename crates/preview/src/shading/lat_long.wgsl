// Look-ups on a lat-long image: four texels around a direction, across the seam and the poles.
// The twin of lat_long.rs; the grid is `sphere::LatLong`. It needs angles.wgsl.

// The bilinear value of a lat-long image, in layer 0, in a direction of any length.
fn lat_long_sample(map: texture_2d_array<f32>, direction: vec3f) -> vec3f {
    let size = vec2i(textureDimensions(map));
    let phi = angles_angle(direction.y, direction.x);
    let theta = angles_angle(length(direction.xy), direction.z);
    let x = (0.5 - phi / (2.0 * ANGLES_PI)) * f32(size.x) - 0.5;
    let y = theta / ANGLES_PI * f32(size.y) - 0.5;
    let top = floor(y);
    let lower = y - top;
    var sum = vec3f(0.0);
    for (var k = 0; k < 2; k++) {
        let row = i32(top) + k;
        // A row beyond a pole is the first row half a turn away.
        let past = row < 0 || row >= size.y;
        let across = select(x, x + 0.5 * f32(size.x), past);
        let left = floor(across);
        let share = across - left;
        let column = (i32(left) + size.x) % size.x;
        let next = (column + 1) % size.x;
        let inside = clamp(row, 0, size.y - 1);
        let weight = select(lower, 1.0 - lower, k == 0);
        sum += textureLoad(map, vec2i(column, inside), 0, 0).rgb * ((1.0 - share) * weight);
        sum += textureLoad(map, vec2i(next, inside), 0, 0).rgb * (share * weight);
    }
    return sum;
}
