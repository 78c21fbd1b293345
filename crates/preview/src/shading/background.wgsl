// The background: the radiance along rays that hit no surface. The twin of background.rs.

const BACKGROUND_LAT_LONG = 0u;
const BACKGROUND_CUBE = 1u;
const BACKGROUND_FLAT = 2u;

// The radiance along a ray of any length; `kind` is the kind of the map.
fn background(kind: u32, flat_radiance: vec3f, ray: vec3f) -> vec3f {
    switch kind {
        case BACKGROUND_LAT_LONG: {
            return lat_long_sample(map, ray);
        }
        case BACKGROUND_CUBE: {
            return cube_blend(map, cube_taps(map_uniforms.parts[0].edge, ray), 0u);
        }
        default: {
            return flat_radiance;
        }
    }
}
