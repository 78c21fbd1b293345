// Another base colour than that of the material by which a surface was shaded. The twin of base_color.rs:
// L = L0 (c D + S R(c) / R(c0)) / (c0 D + S), S = max(0, L0 - c0 D).

// The numbers of each object, a row for each: `PackedResponse::texels`.
@group(2) @binding(8) var base_color_numbers: texture_2d<f32>;

// The texels before those of nodes.
const BASE_COLOR_NUMBERS = 13u;

fn base_color_number(column: u32, row: u32) -> vec4f {
    return textureLoad(base_color_numbers, vec2u(column, row), 0);
}

// M of a metal: what its facets reflect several times.
fn base_color_several(color: vec3f, whole: f32) -> vec3f {
    let average = color + (1.0 - color) / 21.0;
    return average * average * whole / (1.0 - average * (1.0 - whole));
}

// The radiance toward the viewer, if the base colour is `color` in place of the material's, by which it is
// `radiance`; `row` is that of the object.
fn base_color(row: u32, color: vec3f, radiance: vec3f, surface: Surface) -> vec3f {
    let nodes = (textureDimensions(base_color_numbers).x - BASE_COLOR_NUMBERS) / 2u;
    let place = sqrt(clamp(dot(surface.normal, surface.view), 0.0, 1.0)) * f32(nodes - 1u);
    let node = min(u32(place), nodes - 2u);
    let column = BASE_COLOR_NUMBERS + 2u * node;
    let share = place - f32(node);
    // t, w, A and B, and the albedos of coat and white sheen.
    let facets = mix(base_color_number(column, row), base_color_number(column + 2u, row), share);
    let layers = mix(base_color_number(column + 1u, row), base_color_number(column + 3u, row), share);

    let n = surface.normal;
    var light = base_color_number(0u, row).rgb;
    light += base_color_number(1u, row).rgb * n.y;
    light += base_color_number(2u, row).rgb * n.z;
    light += base_color_number(3u, row).rgb * n.x;
    light += base_color_number(4u, row).rgb * (n.x * n.y);
    light += base_color_number(5u, row).rgb * (n.y * n.z);
    light += base_color_number(6u, row).rgb * (3.0 * n.z * n.z - 1.0);
    light += base_color_number(7u, row).rgb * (n.x * n.z);
    light += base_color_number(8u, row).rgb * (n.x * n.x - n.y * n.y);
    let mean = base_color_number(9u, row);
    let matte = max(light, vec3f(0.0)) * (facets.x * (1.0 - mean.w));
    let dielectric = base_color_number(10u, row);
    let sheen = base_color_number(11u, row);
    let several = base_color_number(12u, row).rgb;
    let beside = sheen.rgb * layers.y + layers.x + dielectric.w * facets.w;
    let of_mean = beside + mix(dielectric.rgb, mean.rgb, mean.w) * facets.z
        + mix(several, base_color_several(mean.rgb, sheen.w), mean.w) * facets.y;
    let of_color = beside + mix(dielectric.rgb, color, mean.w) * facets.z
        + mix(several, base_color_several(color, sheen.w), mean.w) * facets.y;

    let base = mean.rgb * matte;
    let rest = max(radiance - base, vec3f(0.0));
    let whole = base + rest;
    let ratio = select(vec3f(1.0), of_color / max(of_mean, vec3f(1e-30)), of_mean > vec3f(0.0));
    let scale = (color * matte + rest * ratio) / max(whole, vec3f(1e-30));
    return select(radiance, radiance * scale, whole > vec3f(0.0));
}
