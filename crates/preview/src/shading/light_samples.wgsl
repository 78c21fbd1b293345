// Samples of an environment in proportion to its radiance, and their density in a direction. The twin of
// light_samples.rs. It needs angles.wgsl.

// `LightSamples::elements`: the size; rows with their distribution, and its guide; texels with their rows'
// distributions, and their guides.
@group(3) @binding(0) var<storage, read> light_samples: array<vec4f>;

// A direction, the radiance from there, and the density of `light_samples_draw` there, in 1/sr.
struct LightSample {
    direction: vec3f,
    radiance: vec3f,
    density: f32,
    // The row and the column of the texel.
    texel: vec2u,
}

struct LightGrid {
    // Columns and rows.
    size: vec2u,
    // The lengths of their guides.
    guides: vec2u,
}

fn light_samples_grid() -> LightGrid {
    let header = vec4u(light_samples[0]);
    return LightGrid(header.xy, header.wz);
}

// The sample for a point of the unit square, if there is light.
fn light_samples_draw(point: vec2f) -> LightSample {
    let grid = light_samples_grid();
    let row = light_samples_place(1u, 2u + grid.size.y, grid.guides.y, point.y);
    let guide = light_samples_texels(grid, grid.size.y) + row * (grid.guides.x / 4u + 1u);
    let texels = light_samples_texels(grid, row);
    let column = light_samples_place(texels, guide, grid.guides.x, point.x);
    let of_row = light_samples[1u + row];
    let left = light_samples[texels + column].w;
    let steps = light_samples_steps(grid, row, column);
    let z = of_row.x - (point.y - of_row.w) / steps.y * of_row.y;
    let across = (point.x - left) / steps.x;
    let direction = light_samples_direction(z, (f32(column) + across) / f32(grid.size.x));
    return light_samples_lit(grid, direction, row, column);
}

// The sample between two columns of a row that have light between them, for a share of that light and one of
// the row's height.
fn light_samples_draw_between(grid: LightGrid, row: u32, columns: vec2u, point: vec2f) -> LightSample {
    let texels = light_samples_texels(grid, row);
    let first = light_samples[texels + columns.x].w;
    let share = first + point.x * (light_samples[texels + columns.y].w - first);
    var column = columns.x;
    var left = columns.y - columns.x;
    while left > 1u {
        let middle = column + left / 2u;
        column = select(column, middle, light_samples[texels + middle].w <= share);
        left -= left / 2u;
    }
    let before = light_samples[texels + column].w;
    let step = light_samples[texels + column + 1u].w - before;
    let across = clamp((share - before) / max(step, 1e-30), 0.0, 1.0);
    let of_row = light_samples[1u + row];
    let z = of_row.x - point.y * of_row.y;
    let direction = light_samples_direction(z, (f32(column) + across) / f32(grid.size.x));
    return light_samples_lit(grid, direction, row, column);
}

// The density of `light_samples_draw_between` in a texel, in 1/sr.
fn light_samples_density_between(grid: LightGrid, row: u32, columns: vec2u, column: u32) -> f32 {
    let texels = light_samples_texels(grid, row);
    let step = light_samples[texels + column + 1u].w - light_samples[texels + column].w;
    let all = light_samples[texels + columns.y].w - light_samples[texels + columns.x].w;
    return step / max(all, 1e-30) * light_samples[1u + row].z;
}

// The direction at a height, so far around from the left edge of the grid, in turns.
fn light_samples_direction(z: f32, around: f32) -> vec3f {
    let level = sqrt(max(1.0 - z * z, 0.0));
    return vec3f(angles_circle(0.5 - around) * level, z);
}

// The light from a direction, a unit vector.
fn light_samples_at(direction: vec3f) -> LightSample {
    let grid = light_samples_grid();
    let theta = angles_angle(length(direction.xy), direction.z);
    let phi = angles_angle(direction.y, direction.x);
    let row = u32(theta / ANGLES_PI * f32(grid.size.y));
    let column = u32((0.5 - phi / (2.0 * ANGLES_PI)) * f32(grid.size.x));
    return light_samples_lit(grid, direction, min(row, grid.size.y - 1u), min(column, grid.size.x - 1u));
}

// The light from a direction inside a texel.
fn light_samples_lit(grid: LightGrid, direction: vec3f, row: u32, column: u32) -> LightSample {
    let steps = light_samples_steps(grid, row, column);
    let per_solid_angle = light_samples[1u + row].z;
    let radiance = light_samples[light_samples_texels(grid, row) + column].rgb;
    return LightSample(direction, radiance, steps.y * steps.x * per_solid_angle, vec2u(row, column));
}

// The steps of the distributions of columns and rows over a texel.
fn light_samples_steps(grid: LightGrid, row: u32, column: u32) -> vec2f {
    let texel = light_samples_texels(grid, row) + column;
    return vec2f(
        light_samples[texel + 1u].w - light_samples[texel].w,
        light_samples[row + 2u].w - light_samples[row + 1u].w,
    );
}

// The index of a row's first texel; after the last row, that of the first guide.
fn light_samples_texels(grid: LightGrid, row: u32) -> u32 {
    return 2u + grid.size.y + grid.guides.y / 4u + 1u + row * (grid.size.x + 1u);
}

// The last place whose distribution is at most `share`, which is below 1. The distribution starts at `first`,
// and its guide, of this length, at `guide`.
fn light_samples_place(first: u32, guide: u32, length: u32, share: f32) -> u32 {
    let hint = u32(share * f32(length));
    var place = u32(light_samples[guide + hint / 4u][hint % 4u]);
    var left = u32(light_samples[guide + (hint + 1u) / 4u][(hint + 1u) % 4u]) - place + 1u;
    while left > 1u {
        let middle = place + left / 2u;
        place = select(place, middle, light_samples[first + middle].w <= share);
        left -= left / 2u;
    }
    return place;
}
