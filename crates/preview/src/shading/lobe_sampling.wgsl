// Samples of the directions that a material reflects from, and their density. The twin of lobe_sampling.rs,
// which cites the sources and puts the lobes' numbers before this text. It needs angles.wgsl, surface.wgsl
// and material.wgsl.

// `LobeSampling::words`: the share of light samples, the number of lobes; per lobe its number, its share,
// three parameters.
@group(3) @binding(2) var<storage, read> lobe_sampling: array<u32>;

const LOBE_SAMPLING_TAU = 6.28318531;

struct Lobe {
    number: u32,
    share: f32,
    parameters: vec3f,
}

fn lobe_sampling_lobe(k: u32) -> Lobe {
    let at = 2u + 5u * k;
    let parameters = vec3u(lobe_sampling[at + 2u], lobe_sampling[at + 3u], lobe_sampling[at + 4u]);
    return Lobe(lobe_sampling[at], bitcast<f32>(lobe_sampling[at + 1u]), bitcast<vec3f>(parameters));
}

// The share of samples that are of the light.
fn lobe_sampling_light() -> f32 {
    return bitcast<f32>(lobe_sampling[0]);
}

// The incident direction for a point of the unit square, in the frame of the surface; it may lie below the
// horizon.
fn lobe_sampling_draw(point: vec2f, view: vec3f) -> vec3f {
    var left = point.x;
    let count = lobe_sampling[1];
    for (var k = 0u; k < count; k++) {
        let lobe = lobe_sampling_lobe(k);
        if left < lobe.share {
            return lobe_sampling_draw_lobe(lobe, vec2f(left / lobe.share, point.y), view);
        }
        left -= lobe.share;
    }
    // Rounding may keep the sum of the shares below 1.
    return lobe_sampling_draw_lobe(lobe_sampling_lobe(count - 1u), vec2f(0.0, point.y), view);
}

// The density of `lobe_sampling_draw` at an incident direction, in 1/sr.
fn lobe_sampling_density(incident: vec3f, view: vec3f) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < lobe_sampling[1]; k++) {
        let lobe = lobe_sampling_lobe(k);
        sum += lobe.share * lobe_sampling_lobe_density(lobe, incident, view);
    }
    return sum;
}

fn lobe_sampling_draw_lobe(lobe: Lobe, point: vec2f, view: vec3f) -> vec3f {
    let turn = angles_circle(point.x);
    switch lobe.number {
        case LOBE_SAMPLING_COSINE: {
            return vec3f(turn * sqrt(point.y), sqrt(1.0 - point.y));
        }
        case LOBE_SAMPLING_POWER: {
            let sin2 = lobe_sampling_one_less_exp(2.0 * log(1.0 - point.y) / (lobe.parameters.z + 1.0));
            let level = turn * sqrt(sin2);
            let axis = lobe_sampling_axis(lobe, view);
            // Duff et al. 2017.
            let side = select(-1.0, 1.0, axis.z >= 0.0);
            let a = -1.0 / (side + axis.z);
            let b = axis.x * axis.y * a;
            let right = vec3f(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x);
            let up = vec3f(b, side + axis.y * axis.y * a, -axis.y);
            return right * level.x + up * level.y + axis * sqrt(max(1.0 - sin2, 0.0));
        }
        case LOBE_SAMPLING_FACETS: {
            let widths = lobe.parameters.xy;
            let pole = vec3f(0.0, 0.0, 1.0);
            let flat_view = surface_unit_or(vec3f(widths * view.xy, max(view.z, 0.0)), pole);
            let z = (1.0 - point.y) * (1.0 + flat_view.z) - flat_view.z;
            let cap = vec3f(turn * sqrt(max(1.0 - z * z, 0.0)), z);
            let sum = cap + flat_view;
            let facet = surface_unit_or(vec3f(widths * sum.xy, sum.z), pole);
            return facet * (2.0 * dot(facet, view)) - view;
        }
        default: {
            let width = lobe.parameters.x;
            let theta_o = lobe_sampling_angle_from_tangent(view);
            let ends = lobe_sampling_band_ends(width, theta_o);
            let away = angles_circle((ends.x + (ends.y - ends.x) * point.y) / LOBE_SAMPLING_TAU);
            let theta = clamp(theta_o + width * (away.y / max(away.x, 1e-6)), 0.0, ANGLES_PI);
            let around = angles_circle(theta / LOBE_SAMPLING_TAU);
            return vec3f(around.x, around.y * turn);
        }
    }
}

fn lobe_sampling_lobe_density(lobe: Lobe, incident: vec3f, view: vec3f) -> f32 {
    switch lobe.number {
        case LOBE_SAMPLING_COSINE: {
            return max(incident.z, 0.0) * (1.0 / ANGLES_PI);
        }
        case LOBE_SAMPLING_POWER: {
            let n = lobe.parameters.z;
            let axis = lobe_sampling_axis(lobe, view);
            let sine = cross(incident, axis);
            return (n + 1.0) / LOBE_SAMPLING_TAU * material_power(dot(incident, axis), dot(sine, sine), n);
        }
        case LOBE_SAMPLING_FACETS: {
            let widths = lobe.parameters.xy;
            let sum = incident + view;
            let length_squared = dot(sum, sum);
            if sum.z <= 0.0 || length_squared <= 1e-20 {
                return 0.0;
            }
            let slope = sum.xy / widths;
            let spread = (slope.x * slope.x + slope.y * slope.y + sum.z * sum.z) / length_squared;
            let d = 1.0 / (ANGLES_PI * widths.x * widths.y * spread * spread);
            let height = max(view.z, 0.0);
            return d / max(2.0 * (height + length(vec3f(widths * view.xy, height))), 1e-12);
        }
        default: {
            let width = lobe.parameters.x;
            let theta_o = lobe_sampling_angle_from_tangent(view);
            let ends = lobe_sampling_band_ends(width, theta_o);
            let away = (lobe_sampling_angle_from_tangent(incident) - theta_o) / width;
            let sine = max(length(incident.yz), 1e-6);
            return 1.0 / (width * (1.0 + away * away) * (ends.y - ends.x) * LOBE_SAMPLING_TAU * sine);
        }
    }
}

// The axis of a power lobe; the normal if it has none.
fn lobe_sampling_axis(lobe: Lobe, view: vec3f) -> vec3f {
    return surface_unit_or(lobe.parameters.xxy * view, vec3f(0.0, 0.0, 1.0));
}

// 1 - e^x for x of 0 or less, without cancellation.
fn lobe_sampling_one_less_exp(x: f32) -> f32 {
    if x > -0.1 {
        return -x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))));
    }
    return 1.0 - exp(x);
}

fn lobe_sampling_angle_from_tangent(direction: vec3f) -> f32 {
    return angles_angle(length(direction.yz), direction.x);
}

// The arc tangents of the ends of the band, where theta_i is 0 and pi.
fn lobe_sampling_band_ends(width: f32, theta_o: f32) -> vec2f {
    return vec2f(-angles_angle(theta_o, width), angles_angle(ANGLES_PI - theta_o, width));
}
