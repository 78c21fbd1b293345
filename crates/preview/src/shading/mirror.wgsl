// A perfect mirror: the environment where the view is reflected to. The twin of mirror.rs.

fn mirror(surface: Surface) -> vec3f {
    return lat_long_sample(map, surface_central(surface, CENTRE_REFLECTION));
}
