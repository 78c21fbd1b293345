// The table of a cell of normals: the distribution of light times a lobe over blocks of the sphere. The twin
// of product_tables.rs, which explains the buffer and puts its constants before this text. It needs
// angles.wgsl.

@group(0) @binding(0) var<storage, read_write> product_tables: array<f32>;

// The frame of a cell's normal, whose tangent is on the viewer's side, and the nearest angle of lobes.
struct ProductCellFrame {
    tangent: vec3f,
    side: vec3f,
    normal: vec3f,
    angle: u32,
}

// The rows and columns of blocks.
fn product_tables_blocks() -> vec2u {
    return vec2u(u32(product_tables[1]), u32(product_tables[2]));
}

// The first number of a cell.
fn product_tables_cell(cell: u32) -> u32 {
    let blocks = product_tables_blocks();
    let lobes = PRODUCT_TABLES_ANGLES * PRODUCT_TABLES_SIDE * PRODUCT_TABLES_SIDE;
    let of_rows = blocks.y * (u32(product_tables[10]) + blocks.x);
    let stride = blocks.x + 1u + blocks.x * (blocks.y + 1u);
    return PRODUCT_TABLES_HEADER + lobes + 4u * blocks.x * blocks.y + of_rows + cell * stride;
}

fn product_tables_frame(cell: u32) -> ProductCellFrame {
    let toward = vec3f(product_tables[4], product_tables[5], product_tables[6]);
    let right = vec3f(product_tables[7], product_tables[8], product_tables[9]);
    let place = vec2f(vec2u(cell % PRODUCT_TABLES_CELLS, cell / PRODUCT_TABLES_CELLS));
    let at = (place + 0.5) * (2.0 / f32(PRODUCT_TABLES_CELLS)) - 1.0;
    let square = clamp(dot(at, at), 1e-6, 1.0);
    let outward = (right * at.x + cross(toward, right) * at.y) / max(length(at), 1e-3);
    let cosine = 1.0 - square;
    let sine = sqrt(square) * sqrt(2.0 - square);
    let normal = outward * sine + toward * cosine;
    let tangent = toward * sine - outward * cosine;
    let share = angles_angle(sine, cosine) * (2.0 / ANGLES_PI);
    let angle = min(u32(share * f32(PRODUCT_TABLES_ANGLES)), PRODUCT_TABLES_ANGLES - 1u);
    return ProductCellFrame(tangent, cross(normal, tangent), normal, angle);
}

// Whether a cell touches the disc of normals that face the viewer, or nearly.
fn product_tables_is_seen(cell: vec2u) -> bool {
    let middle = (vec2f(cell) + 0.5) * (2.0 / f32(PRODUCT_TABLES_CELLS)) - 1.0;
    let nearest = max(abs(middle) - 1.01 / f32(PRODUCT_TABLES_CELLS), vec2f(0.0));
    return dot(nearest, nearest) <= 1.0;
}

// The place of the texel of a direction on an octahedron whose lower half is folded outward.
fn product_tables_octahedron(direction: vec3f) -> u32 {
    let p = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p.xy >= vec2f(0.0));
    let at = select(folded, p.xy, p.z >= 0.0);
    let place = min(vec2u((0.5 * at + 0.5) * f32(PRODUCT_TABLES_SIDE)), vec2u(PRODUCT_TABLES_SIDE - 1u));
    return place.y * PRODUCT_TABLES_SIDE + place.x;
}

// The light in a block times the lobe of a cell.
fn product_tables_mass(frame: ProductCellFrame, block: u32) -> f32 {
    let of_lobe = PRODUCT_TABLES_SIDE * PRODUCT_TABLES_SIDE;
    let at = PRODUCT_TABLES_HEADER + PRODUCT_TABLES_ANGLES * of_lobe + 4u * block;
    let direction = vec3f(product_tables[at], product_tables[at + 1u], product_tables[at + 2u]);
    let local = direction * mat3x3f(frame.tangent, frame.side, frame.normal);
    let texel = PRODUCT_TABLES_HEADER + frame.angle * of_lobe + product_tables_octahedron(local);
    return product_tables[at + 3u] * product_tables[texel];
}

// Divides so many sums by the last, which becomes 1 exactly, as do those that equal it. Without any mass,
// only the last is 1.
fn product_tables_scale(first: u32, count: u32) {
    let total = product_tables[first + count - 1u];
    for (var k = first; k < first + count - 1u; k++) {
        let sum = product_tables[k];
        product_tables[k] = select(select(0.0, 1.0, total > 0.0), sum / total, sum < total);
    }
    product_tables[first + count - 1u] = 1.0;
}

// Fills the blocks of a row of a cell, and returns their mass.
fn product_tables_row(cell: u32, row: u32) -> f32 {
    let blocks = product_tables_blocks();
    let frame = product_tables_frame(cell);
    let first = product_tables_cell(cell) + blocks.x + 1u + row * (blocks.y + 1u);
    var sum = 0.0;
    product_tables[first] = 0.0;
    for (var column = 0u; column < blocks.y; column++) {
        sum += product_tables_mass(frame, row * blocks.y + column);
        product_tables[first + column + 1u] = sum;
    }
    product_tables_scale(first, blocks.y + 1u);
    return sum;
}

// Fills the rows of a cell, by their masses.
fn product_tables_rows(cell: u32, masses: array<f32, PRODUCT_TABLES_ROWS>) {
    let rows = product_tables_blocks().x;
    let first = product_tables_cell(cell);
    var sum = 0.0;
    product_tables[first] = 0.0;
    for (var row = 0u; row < rows; row++) {
        sum += masses[row];
        product_tables[first + row + 1u] = sum;
    }
    product_tables_scale(first, rows + 1u);
}
