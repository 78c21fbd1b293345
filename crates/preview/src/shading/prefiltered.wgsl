// One reflection map: a look-up in the central direction, for every view. It may lie between two levels of
// detail, which are blended: the second is in the upper left corner of the layers from 6 on. The twin of
// prefiltered.rs.

fn prefiltered(surface: Surface) -> vec3f {
    let central = surface_central(surface, map_uniforms.centre);
    let fine = cube_blend(map, cube_taps(map_uniforms.edge, central), 0u);
    if map_uniforms.share == 0.0 {
        return fine;
    }
    let coarse = cube_blend(map, cube_taps(map_uniforms.coarse_edge, central), 6u);
    return fine + (coarse - fine) * map_uniforms.share;
}
