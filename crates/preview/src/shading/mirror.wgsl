// A perfect mirror: the environment in the direction of the reflected view. The twin of mirror.rs.

fn mirror(surface: Surface) -> vec3f {
    return lat_long_sample(map, surface_central(surface, CENTRE_REFLECTION));
}
