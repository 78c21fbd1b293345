// The local SHRM at a pixel [RH02, eqs. 6 and 7, sec. 7.5]: four texels around the central direction, each
// evaluated at the view in its own frame, are blended. The twin of local_shrm.rs.

// A row of the map is in the layers 6 row + face from the first on.
fn local_shrm_row(part: MapPart, taps: Taps, row: u32, share: vec4f) -> vec3f {
    let first = part.first + 6u * row;
    return cube_load(map, taps.texel[0], first) * share.x
        + cube_load(map, taps.texel[1], first) * share.y
        + cube_load(map, taps.texel[2], first) * share.z
        + cube_load(map, taps.texel[3], first) * share.w;
}

fn local_shrm(surface: Surface, part: MapPart) -> vec3f {
    let taps = cube_taps(part.edge, surface_central(surface, part.centre));
    let v = surface.view;
    var x: vec4f;
    var y: vec4f;
    var z: vec4f;
    for (var k = 0u; k < 4u; k++) {
        let c = normalize(cube_centre(part.edge, taps.texel[k]));
        let sine = sqrt(c.x * c.x + c.y * c.y);
        var beta = vec2f(1.0, 0.0);
        if sine > 0.0 {
            beta = c.xy / sine;
        }
        x[k] = dot(v, vec3f(c.z * beta.x, c.z * beta.y, -sine));
        y[k] = v.y * beta.x - v.x * beta.y;
        z[k] = dot(v, c);
    }
    var sum = vec3f(0.0);
    var cosine = taps.weight;
    var sine = vec4f(0.0);
    let columns = select(part.degree, 0u, part.zonal == 1u);
    for (var q = 0u; q <= columns; q++) {
        var below = vec4f(0.0);
        var value = vec4f(harmonics_constant(q, q).x);
        for (var p = q; p <= part.degree; p++) {
            if p > q {
                let climb = harmonics_constant(p, q);
                let next = z * value * climb.x - below * climb.y;
                below = value;
                value = next;
            }
            if part.zonal == 1u {
                sum += local_shrm_row(part, taps, p, value * cosine);
            } else {
                sum += local_shrm_row(part, taps, p * p + p + q, value * cosine);
                if q > 0u {
                    sum += local_shrm_row(part, taps, p * p + p - q, value * sine);
                }
            }
        }
        let turned = cosine * x - sine * y;
        sine = cosine * y + sine * x;
        cosine = turned;
    }
    return sum;
}
