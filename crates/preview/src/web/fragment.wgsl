// What a pixel of a page shows. gpu/web_shaders.rs turns the cases of switches over `SHOWN`, `MODE` and
// `TEXTURED` into conditions of the preprocessor, so that a program has one of each; it also writes
// `shade_mode`, which has a case for each mode.

const SHOWN: u32 = 0u;
const MODE: u32 = 0u;
const TEXTURED: u32 = 0u;

// The two pictures of radiance whose difference is shown; transparent where there is no surface.
@group(2) @binding(0) var first_picture: texture_2d<f32>;
@group(2) @binding(1) var second_picture: texture_2d<f32>;

// The radiance by the base colour of the material's texture, if there is one.
fn mesh_radiance(at: PageVertex, surface: Surface, radiance: vec3f) -> vec3f {
    switch TEXTURED {
        case 0u: {
            let colour = texture_at_fragment(at.coordinates, at.position.w, 1.0);
            return base_color(0u, colour, radiance, surface);
        }
        default: {
            return radiance;
        }
    }
}

// The difference, times a factor.
fn difference_shown(pixel: vec2u) -> vec4f {
    let value = textureLoad(first_picture, pixel, 0);
    if value.a == 0.0 {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let shown = difference(value.rgb, textureLoad(second_picture, pixel, 0).rgb) * page.amplify;
    return vec4f(develop_encode(develop(shown, page.gain, page.tone)), 1.0);
}

@fragment
fn page_fragment(@builtin(front_facing) front: bool, at: PageVertex) -> @location(0) vec4f {
    switch SHOWN {
        case 0u: {
            return page_shown(background(BACKGROUND_LAT_LONG, vec3f(0.0), at.ray));
        }
        case 1u: {
            return difference_shown(vec2u(at.position.xy));
        }
        case 2u: {
            let surface = surface_new(at.normal, at.tangent, at.ray, front);
            return page_shown(mesh_radiance(at, surface, shade_mode(surface)));
        }
        default: {
            return vec4f();
        }
    }
}
