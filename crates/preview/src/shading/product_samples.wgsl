// Samples of the product of light and material, and their density in a direction. The twin of
// product_samples.rs, which puts its constants and those of product_tables.rs before this text. It needs
// surface.wgsl and light_samples.wgsl.

// The tables of a view, which product_tables.rs explains; the first number is 0 without any.
@group(3) @binding(8) var<storage, read> product_samples: array<f32>;

// Where the table of a cell of normals is, and those of blocks.
struct ProductCell {
    // The rows and columns of blocks.
    blocks: vec2u,
    // The first number of the distributions of rows of texels.
    texel_rows: u32,
    // The first number of the cell.
    first: u32,
}

// Whether a light sample may follow the product.
fn product_samples_follow(sample: u32) -> bool {
    return sample >= PRODUCT_SAMPLES_FIRST && product_samples[0] > 0.0;
}

// The table for a surface, if there are any.
fn product_samples_cell(grid: LightGrid, surface: Surface) -> ProductCell {
    let blocks = vec2u(u32(product_samples[1]), u32(product_samples[2]));
    let toward = vec3f(product_samples[4], product_samples[5], product_samples[6]);
    let right = vec3f(product_samples[7], product_samples[8], product_samples[9]);
    let central = surface_central(surface, CENTRE_REFLECTION) + toward;
    let normal = select(surface.normal, central, product_samples[3] > 0.0);
    let z = dot(normal, toward);
    let x = dot(normal, right);
    let y = dot(normal, cross(toward, right));
    let size = length(vec3f(x, y, z));
    let level = 0.5 / sqrt(max(size * (size + max(z, 0.0)), 1e-20));
    let along = max((vec2f(x, y) * level + 0.5) * f32(PRODUCT_TABLES_CELLS), vec2f(0.0));
    let place = min(vec2u(along), vec2u(PRODUCT_TABLES_CELLS - 1u));
    let cell = place.y * PRODUCT_TABLES_CELLS + place.x;
    let lobes = PRODUCT_TABLES_ANGLES * PRODUCT_TABLES_SIDE * PRODUCT_TABLES_SIDE;
    let texel_rows = PRODUCT_TABLES_HEADER + lobes + 4u * blocks.x * blocks.y;
    let stride = blocks.x + 1u + blocks.x * (blocks.y + 1u);
    return ProductCell(blocks, texel_rows, texel_rows + blocks.y * (grid.size.y + blocks.x) + cell * stride);
}

// The sample for a point of the unit square.
fn product_samples_draw(grid: LightGrid, cell: ProductCell, point: vec2f) -> LightSample {
    let row = product_samples_place(cell.first, cell.blocks.x, point.y);
    let of_row = product_samples_row(cell, row.place);
    let column = product_samples_place(of_row, cell.blocks.y, point.x);
    let texels = product_samples_texels(grid, cell, vec2u(row.place, column.place));
    let of_texels = product_samples_texel_rows(grid, cell, vec2u(row.place, column.place), texels.first.y);
    let texel_row = product_samples_place(of_texels, texels.end.y - texels.first.y, row.inside);
    return light_samples_draw_between(
        grid,
        texels.first.y + texel_row.place,
        vec2u(texels.first.x, texels.end.x),
        vec2f(column.inside, texel_row.inside),
    );
}

// The density of `product_samples_draw` at the direction of a light sample, in 1/sr.
fn product_samples_density(grid: LightGrid, cell: ProductCell, lit: LightSample) -> f32 {
    // The row and column of the texel's block.
    let block = ((lit.texel + 1u) * cell.blocks - 1u) / grid.size.yx;
    let texels = product_samples_texels(grid, cell, block);
    let of_texels = product_samples_texel_rows(grid, cell, block, lit.texel.x);
    return product_samples_step(cell.first + block.x)
        * product_samples_step(product_samples_row(cell, block.x) + block.y)
        * product_samples_step(of_texels)
        * light_samples_density_between(grid, lit.texel.x, vec2u(texels.first.x, texels.end.x), lit.texel.y);
}

// The columns and rows of texels in a block.
struct ProductTexels {
    first: vec2u,
    end: vec2u,
}

fn product_samples_texels(grid: LightGrid, cell: ProductCell, block: vec2u) -> ProductTexels {
    return ProductTexels(block.yx * grid.size / cell.blocks.yx, (block.yx + 1u) * grid.size / cell.blocks.yx);
}

// The first number of the distribution of the blocks of a row.
fn product_samples_row(cell: ProductCell, row: u32) -> u32 {
    return cell.first + cell.blocks.x + 1u + row * (cell.blocks.y + 1u);
}

// The place of a row of texels in the distribution of a block's rows.
fn product_samples_texel_rows(grid: LightGrid, cell: ProductCell, block: vec2u, texel_row: u32) -> u32 {
    return cell.texel_rows + block.y * (grid.size.y + cell.blocks.x) + texel_row + block.x;
}

fn product_samples_step(place: u32) -> f32 {
    return product_samples[place + 1u] - product_samples[place];
}

// A place of a distribution, and the share inside it.
struct ProductPlace {
    place: u32,
    inside: f32,
}

// The last of `count` places whose distribution is at most `share`.
fn product_samples_place(first: u32, count: u32, share: f32) -> ProductPlace {
    var place = 0u;
    var left = count;
    while left > 1u {
        let middle = place + left / 2u;
        place = select(place, middle, product_samples[first + middle] <= share);
        left -= left / 2u;
    }
    let inside = (share - product_samples[first + place]) / max(product_samples_step(first + place), 1e-30);
    return ProductPlace(place, clamp(inside, 0.0, 0.99999994));
}
