// The global SHRM for a distant viewer [RH02, eq. 12, sec. 7.5]: once per frame every texel is evaluated at
// the one view V, the sum of B~_pq Y_pq(V), into a plain reflection map. The twin of global_shrm.rs.

// A look-up of the central direction in the map that `global_update` made.
fn global_shrm(surface: Surface, part: MapPart) -> vec3f {
    return cube_blend(map, cube_taps(part.edge, surface_central(surface, part.centre)), part.first);
}

// Y_pq(V), row p*p + p + q.
@group(2) @binding(2) var<storage, read> global_shrm_harmonics: array<f32>;

// A texel of that map, from coefficients in the layers 6 row + face from the first on.
fn global_update(texel: Texel, part: MapPart) -> vec3f {
    var sum = vec3f(0.0);
    for (var row = 0u; row < harmonics_rows(part.degree); row++) {
        sum += global_shrm_harmonics[row] * cube_load(map, texel, part.first + 6u * row);
    }
    return sum;
}
