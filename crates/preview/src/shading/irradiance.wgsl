// A white diffuse surface from nine coefficients (Ramamoorthi and Hanrahan 2001): irradiance over pi about
// the normal. The twin of irradiance.rs. The coefficients include A_l / pi; row l*l + l + m is in that column
// of the map.

fn irradiance_row(row: u32) -> vec3f {
    return textureLoad(map, vec2u(row, 0u), 0, 0).rgb;
}

fn irradiance(surface: Surface) -> vec3f {
    let n = surface.normal;
    var sum = vec3f(0.0);
    var cosine = 1.0;
    var sine = 0.0;
    for (var q = 0u; q <= 2u; q++) {
        var below = 0.0;
        var value = harmonics_constant(q, q).x;
        for (var p = q; p <= 2u; p++) {
            if p > q {
                let climb = harmonics_constant(p, q);
                let next = n.z * value * climb.x - below * climb.y;
                below = value;
                value = next;
            }
            sum += irradiance_row(p * p + p + q) * (value * cosine);
            if q > 0u {
                sum += irradiance_row(p * p + p - q) * (value * sine);
            }
        }
        let turned = cosine * n.x - sine * n.y;
        sine = cosine * n.y + sine * n.x;
        cosine = turned;
    }
    return sum;
}
