// What the formulas of materials share: the half vector, powers of cosines, Fresnel's shares and the masking
// of facets. terms.rs puts its constants before this text, and has a twin of what shaders of other files use.
// A shader has the text of angles.wgsl, too.

// Light nearer to the horizon than this counts as below it: products of two such cosines are still normal
// numbers.
const MATERIAL_HORIZON: f32 = 1e-12;
// The square of a sum of light and view below which they count as opposite.
const MATERIAL_OPPOSITE: f32 = 1e-20;

// 1 - sin(x) / x, x of 0 to 2 pi: a series below 1.
fn material_one_less_sinc(x: f32) -> f32 {
    if x >= 1.0 {
        return 1.0 - angles_circle(x / (2.0 * ANGLES_PI)).y / x;
    }
    let x2 = x * x;
    return x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0)));
}

// The half vector of light and view over the surface.
struct Half {
    // Whether the light is above the horizon, and light and view are not opposite.
    seen: bool,
    // L + V.
    sum: vec3f,
    // |L + V|^2.
    length_squared: f32,
    // The square of the part of L + V along the surface.
    across: f32,
    // N.L.
    light: f32,
    // N.V, 0 or more.
    view: f32,
    // L.h.
    facet: f32,
    // 1 - (L.h)^2 = |L - V|^2 / 4.
    turn: f32,
}

fn material_half(light: vec3f, view: vec3f) -> Half {
    let sum = light + view;
    let length_squared = dot(sum, sum);
    let seen = light.z > MATERIAL_HORIZON && sum.z > MATERIAL_HORIZON && length_squared > MATERIAL_OPPOSITE;
    let across = sum.x * sum.x + sum.y * sum.y;
    let difference = light - view;
    let turn = 0.25 * dot(difference, difference);
    let facet = 0.5 * sqrt(length_squared);
    return Half(seen, sum, length_squared, across, light.z, max(view.z, 0.0), facet, turn);
}

// What GGX's facets reflect if their Fresnel is 1, over alpha^2 / (2 pi).
fn material_facets(alpha2: f32, half_vector: Half) -> f32 {
    let sum_z = half_vector.sum.z;
    let across = (half_vector.across + alpha2 * sum_z * sum_z) / half_vector.length_squared;
    let cos_i = half_vector.light;
    let cos_o = half_vector.view;
    let masked_light = sqrt(alpha2 + (1.0 - alpha2) * cos_i * cos_i);
    let masked_view = sqrt(alpha2 + (1.0 - alpha2) * cos_o * cos_o);
    let visible = cos_i / (cos_i * masked_view + cos_o * masked_light);
    return visible / (across * across);
}

// (N.h)^(2 s).
fn material_half_power(half_vector: Half, s: f32) -> f32 {
    let sin2 = half_vector.across / half_vector.length_squared;
    let cos2 = half_vector.sum.z * half_vector.sum.z / half_vector.length_squared;
    if sin2 < MATERIAL_NEAR {
        return material_bounded_exp(s * (2.0 * material_ln_cosine(sin2)));
    }
    return material_bounded_exp(s * log(max(cos2, MATERIAL_TINY)));
}

// cos^s, or 0 if the cosine is not above 0; `sin2` is the square of the sine.
fn material_power(cosine: f32, sin2: f32, s: f32) -> f32 {
    if cosine <= 0.0 {
        return 0.0;
    }
    if sin2 < MATERIAL_NEAR {
        return material_bounded_exp(s * material_ln_cosine(sin2));
    }
    return material_bounded_exp(s * log(max(cosine, MATERIAL_TINY)));
}

// base^n, or 0 if the base is not above 0.
fn material_power_of(base: f32, n: f32) -> f32 {
    if base <= 0.0 {
        return 0.0;
    }
    let from_one = (1.0 - base) * (1.0 + base);
    if abs(from_one) < MATERIAL_NEAR {
        return material_bounded_exp(n * material_ln_cosine(from_one));
    }
    return material_bounded_exp(n * log(max(base, MATERIAL_TINY)));
}

// ln(sqrt(1 - x)), |x| below MATERIAL_NEAR: a series.
fn material_ln_cosine(x: f32) -> f32 {
    var series = 1.0 / 6.0 + x * (1.0 / 7.0);
    series = 0.25 + x * (0.2 + x * series);
    return -0.5 * x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * series)));
}

// e^x, in the range of f32.
fn material_bounded_exp(x: f32) -> f32 {
    return exp(clamp(x, -80.0, 80.0));
}

fn material_fifth(x: f32) -> f32 {
    let x2 = x * x;
    return x2 * x2 * x;
}

fn material_fade(cosine: f32) -> f32 {
    return 1.0 - material_fifth(1.0 - 0.5 * cosine);
}

// Smith's Lambda for Beckmann's facets, times the cosine.
fn material_lambda_cosine(m: f32, cosine: f32) -> f32 {
    let slope = m * sqrt(max(1.0 - cosine * cosine, 0.0));
    if cosine >= 1.6 * slope {
        return 0.0;
    }
    let a = cosine / slope;
    return slope * max(1.0 - 1.259 * a + 0.396 * a * a, 0.0) / (3.535 + 2.181 * a);
}

fn material_dielectric(ior: f32, c: f32) -> f32 {
    let excess = ior * ior - 1.0;
    let sum = sqrt(excess + c * c) + c;
    // g - c without cancellation.
    let difference = excess / sum;
    let parallel = (c * sum - 1.0) / (c * difference + 1.0);
    let share = difference / sum;
    return 0.5 * share * share * (1.0 + parallel * parallel);
}

fn material_conductor(n: f32, k: f32, c: f32, sin2: f32) -> f32 {
    let cos2 = c * c;
    let index = n * n - k * k;
    var real = index - sin2;
    if cos2 < 0.5 {
        real = index - 1.0 + cos2;
    }
    let imaginary = 2.0 * n * k;
    let size = sqrt(real * real + imaginary * imaginary);
    // (size + real) / 2 without cancellation.
    var part = 0.5 * (size + real);
    if real < 0.0 {
        part = 0.5 * imaginary * imaginary / (size - real);
    }
    let twice = 2.0 * c * sqrt(part);
    let s = max(size + cos2 - twice, 0.0) / (size + cos2 + twice);
    let sum = cos2 * size + sin2 * sin2;
    let less = twice * sin2;
    return 0.5 * s * (1.0 + (sum - less) / (sum + less));
}

// theta_h, theta_d and phi_d, 0 to pi.
fn material_half_difference(light: vec3f, view: vec3f) -> vec3f {
    let sum = light + view;
    let difference = light - view;
    let across = length(sum.xy);
    let size = length(sum);
    var phi = vec2f(1.0, 0.0);
    if across > 0.0 {
        phi = sum.xy / across;
    }
    var theta = vec2f(1.0, 0.0);
    if size > 0.0 {
        theta = vec2f(sum.z, across) / size;
    }
    let x = (difference.x * phi.x + difference.y * phi.y) * theta.x - difference.z * theta.y;
    let y = difference.y * phi.x - difference.x * phi.y;
    let turned = y < 0.0 || (y == 0.0 && x < 0.0);
    let side = select(1.0, -1.0, turned);
    let phi_d = angles_angle(side * y, side * x);
    return vec3f(angles_angle(across, sum.z), angles_angle(length(difference), size), phi_d);
}

// theta_h, phi_h, 0 to 2 pi, theta_d and psi, 0 to pi.
fn material_half_and_difference(light: vec3f, view: vec3f) -> vec4f {
    let sum = light + view;
    let difference = light - view;
    let across = length(sum.xy);
    let size = length(sum);
    var away = vec2f(1.0, 0.0);
    if across > 0.0 {
        away = sum.xy / across;
    }
    var theta = vec2f(1.0, 0.0);
    if size > 0.0 {
        theta = vec2f(sum.z, across) / size;
    }
    let along = (difference.x * away.x + difference.y * away.y) * theta.x - difference.z * theta.y;
    let beside = difference.y * away.x - difference.x * away.y;
    let x = away.x * along - away.y * beside;
    let y = away.y * along + away.x * beside;
    let turned = y < 0.0 || (y == 0.0 && x < 0.0);
    let side = select(1.0, -1.0, turned);
    var phi = angles_angle(away.y, away.x);
    if phi < 0.0 {
        phi += 2.0 * ANGLES_PI;
    }
    return vec4f(
        angles_angle(across, sum.z),
        phi,
        angles_angle(length(difference), size),
        angles_angle(side * y, side * x),
    );
}
