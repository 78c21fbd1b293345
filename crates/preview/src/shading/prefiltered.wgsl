// A plain reflection map: a look-up in the central direction, the same for every view. The twin of
// prefiltered.rs.

fn prefiltered(surface: Surface, part: MapPart) -> vec3f {
    return cube_blend(map, cube_taps(part.edge, surface_central(surface, part.centre)), part.first);
}
