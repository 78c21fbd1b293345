// Samples of an environment by its radiance, and how dense they lie in a direction. The twin of light_samples.rs. It
// needs angles.wgsl.

// `LightSamples::elements`, whose file says what is in it: columns, rows and whether there is light; per row cos(theta) at
// its upper edge, how far that falls, 1 / solid angle of a texel, the distribution at its upper edge; per texel RGB and
// the row's distribution at its left edge.
@group(3) @binding(0) var<storage, read> light_samples: array<vec4f>;

// A direction, what comes from there, and the density of `light_samples_draw` there, in 1/sr.
struct Lit {
    direction: vec3f,
    radiance: vec3f,
    density: f32,
}

// The direction for a point of the unit square, where there is light.
fn light_samples_draw(point: vec2f) -> Lit {
    let size = vec2u(light_samples[0].xy);
    let row = light_samples_last(1u, size.y, point.y);
    let first = 1u + size.y + row * size.x;
    let column = light_samples_last(first, size.x, point.x);
    let rows = light_samples_step(1u, size.y, row);
    let columns = light_samples_step(first, size.x, column);
    let of_row = light_samples[1u + row];
    let z = of_row.x - (point.y - rows.x) / (rows.y - rows.x) * of_row.y;
    let across = (point.x - columns.x) / (columns.y - columns.x);
    let circle = angles_circle(0.5 - (f32(column) + across) / f32(size.x));
    let level = sqrt(max(1.0 - z * z, 0.0));
    let direction = vec3f(level * circle, z);
    let density = (rows.y - rows.x) * (columns.y - columns.x) * of_row.z;
    return Lit(direction, light_samples[first + column].rgb, density);
}

// What comes from a direction, a unit vector.
fn light_samples_at(direction: vec3f) -> Lit {
    let size = vec2u(light_samples[0].xy);
    let level = length(direction.xy);
    let phi = angles_angle(direction.y, direction.x);
    let theta = angles_angle(level, direction.z);
    let row = min(u32(theta / ANGLES_PI * f32(size.y)), size.y - 1u);
    let column = min(u32((0.5 - phi / (2.0 * ANGLES_PI)) * f32(size.x)), size.x - 1u);
    let first = 1u + size.y + row * size.x;
    let rows = light_samples_step(1u, size.y, row);
    let columns = light_samples_step(first, size.x, column);
    let density = (rows.y - rows.x) * (columns.y - columns.x) * light_samples[1u + row].z;
    return Lit(direction, light_samples[first + column].rgb, density);
}

// The last of `count` elements from `first` on whose distribution is at most `share`, which is below 1.
fn light_samples_last(first: u32, count: u32, share: f32) -> u32 {
    var low = 0u;
    var high = count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if light_samples[first + middle].w <= share {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// The distribution at both edges of one of `count` elements from `first` on.
fn light_samples_step(first: u32, count: u32, at: u32) -> vec2f {
    var after = 1.0;
    if at + 1u < count {
        after = light_samples[first + at + 1u].w;
    }
    return vec2f(light_samples[first + at].w, after);
}
