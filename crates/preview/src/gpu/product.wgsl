// Makes the tables of the product of light and material: a workgroup for each cell of normals, an invocation
// for each row of its blocks.

var<workgroup> masses: array<f32, PRODUCT_TABLES_ROWS>;

@compute @workgroup_size(PRODUCT_TABLES_ROWS)
fn make_product_tables(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) row: u32,
) {
    if !product_tables_is_seen(group.xy) {
        return;
    }
    let cell = group.y * PRODUCT_TABLES_CELLS + group.x;
    if row < product_tables_blocks().x {
        masses[row] = product_tables_row(cell, row);
    }
    workgroupBarrier();
    if row == 0u {
        product_tables_rows(cell, masses);
    }
}
