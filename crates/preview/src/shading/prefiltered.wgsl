// One reflection map: a look-up in the central direction, for every view. The twin of prefiltered.rs.

fn prefiltered(surface: Surface) -> vec3f {
    return cube_blend(map, cube_taps(map_uniforms.edge, surface_central(surface, map_uniforms.centre)), 0u);
}
