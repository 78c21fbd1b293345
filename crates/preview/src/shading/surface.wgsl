// The point of a surface that a mode shades, in the light's frame. The twin of surface.rs, which explains how
// a normal that points away is bent: N' = N + (e - N.V) V, normalised.

struct Surface {
    // The normal, on the viewer's side.
    normal: vec3f,
    tangent: vec3f,
    // The direction toward the viewer.
    view: vec3f,
}

// The central direction of a map: `brdf::Centre`.
const CENTRE_REFLECTION = 0u;
const CENTRE_NORMAL = 1u;
const CENTRE_TANGENT = 2u;

// e: the smallest cosine between the normal and the view before the bent normal is normalised.
const GRAZING = 1e-3;
// The square of a length that counts as 0.
const NOTHING = 1e-24;
// If a smaller share of a tangent's square is perpendicular to the normal, that part is mostly rounding.
const ALONG = 1e-6;

fn surface_unit_or(v: vec3f, other: vec3f) -> vec3f {
    let square = dot(v, v);
    if square > NOTHING {
        return v / sqrt(square);
    }
    return other;
}

fn surface_across(normal: vec3f) -> vec3f {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0), abs(normal.z) < 0.9);
    return normalize(cross(other, normal));
}

fn surface_new(normal: vec3f, tangent: vec3f, ray: vec3f, front: bool) -> Surface {
    let view = -normalize(ray);
    var n = surface_unit_or(select(-normal, normal, front), view);
    let cosine = dot(n, view);
    if cosine < GRAZING {
        n = normalize(n + view * (GRAZING - cosine));
    }
    let rest = tangent - n * dot(n, tangent);
    let square = dot(rest, rest);
    if square <= NOTHING || square <= ALONG * dot(tangent, tangent) {
        return Surface(n, surface_across(n), view);
    }
    return Surface(n, rest / sqrt(square), view);
}

fn surface_central(surface: Surface, centre: u32) -> vec3f {
    switch centre {
        case CENTRE_REFLECTION: {
            return surface.normal * (2.0 * dot(surface.normal, surface.view)) - surface.view;
        }
        case CENTRE_NORMAL: {
            return surface.normal;
        }
        default: {
            return surface.tangent;
        }
    }
}
