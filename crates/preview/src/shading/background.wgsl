// What is seen along a ray that meets no surface. The twin of background.rs.

const BACKGROUND_LAT_LONG = 0u;
const BACKGROUND_CUBE = 1u;
const BACKGROUND_FLAT = 2u;

// Radiance along a ray of any length; `kind` says what the map is.
fn background(kind: u32, flat_radiance: vec3f, ray: vec3f) -> vec3f {
    switch kind {
        case BACKGROUND_LAT_LONG: {
            return lat_long_sample(map, ray);
        }
        case BACKGROUND_CUBE: {
            return cube_blend(map, cube_taps(facts.edge, ray), 0u);
        }
        default: {
            return flat_radiance;
        }
    }
}
