// One reflection map: a plain look-up about the central direction, whatever the view. The twin of prefiltered.rs.

fn prefiltered(surface: Surface) -> vec3f {
    return cube_blend(map, cube_taps(facts.edge, surface_central(surface, facts.centre)), 0u);
}
