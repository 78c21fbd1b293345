// rho_hat of every reflection model, in the frame of the surface: +Z the normal, +X the tangent. The twins of
// the formulas are the models of `brdf`. material.rs has the layout of the words; it puts before this text
// terms.wgsl, `material_layer` (the choice of a model's formula, material_ and the name of its module) and
// the functions of material/readers.rs: `ward_peak(at)` is the member `peak` of `brdf::WardConstants`, whose
// words begin at `at`. It needs angles.wgsl.

// A Gaussian of a squared slope over a squared roughness is 0 in f32 from here on, with room for its factors.
const MATERIAL_STEEP: f32 = 80.0;
// The least cosine in factors that have no bound at grazing: see ashikhmin-shirley and ward.
const MATERIAL_MIN_COSINE: f32 = 1e-3;
// The least cosine of light and view in the masking of fibres.
const MATERIAL_GRAZING: f32 = 1e-4;

// `PackedMaterial::words`: the number of layers; per layer its model, the number of its constants, and these.
@group(3) @binding(1) var<storage, read> material: array<u32>;

// rho_hat(light, view), RGB, in 1/sr: both unit vectors, away from the surface.
fn material_rho_hat(light: vec3f, view: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    var at = 1u;
    for (var layer = 0u; layer < material[0]; layer++) {
        sum += material_layer(material[at], at + 2u, light, view);
        at += 2u + material[at + 1u];
    }
    return sum;
}

fn material_standard(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let cos_i = half_vector.light;
    let of_light = material_at_cosine(at, cos_i);
    let of_view = material_at_cosine(at, half_vector.view);
    let grazing = material_fifth(max(1.0 - half_vector.facet, 0.0));
    let coat_0 = standard_coat_0(at);
    let coat_90 = standard_coat_90(at);
    let coat_facets = material_facets(standard_coat_alpha2(at), half_vector);
    let coat = (coat_0 + (coat_90 - coat_0) * grazing) * coat_facets;
    let f_0 = standard_f_0(at);
    let f_90 = vec3f(standard_f_90(at));
    let highlight = min(of_light.y, of_view.y) * material_facets(standard_alpha2(at), half_vector);
    var sum = vec3f(coat) + (f_0 + (f_90 - f_0) * grazing) * highlight;
    let sheen = standard_sheen(at);
    if max(max(sheen.x, sheen.y), sheen.z) > 0.0 {
        let lobe = material_charlie(standard_charlie(at), half_vector);
        sum += sheen * (min(of_light.x, of_view.x) * lobe * cos_i);
    }
    return sum
        + standard_multiple(at) * (of_light.z * of_view.z * cos_i)
        + standard_diffuse(at) * (of_light.w * of_view.w * cos_i);
}

fn material_lambert(at: u32, light: vec3f, view: vec3f) -> vec3f {
    return lambert_brdf(at) * max(light.z, 0.0);
}

fn material_oren_nayar(at: u32, light: vec3f, view: vec3f) -> vec3f {
    if light.z <= 0.0 {
        return vec3f(0.0);
    }
    let across = max(light.x * view.x + light.y * view.y, 0.0) / max(light.z, abs(view.z));
    return (oren_nayar_matte(at) + oren_nayar_rough(at) * across) * light.z;
}

fn material_phong(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let mirrored = vec3f(-view.x, -view.y, view.z);
    let sine = cross(light, mirrored);
    let lobe = material_power(dot(light, mirrored), dot(sine, sine), phong_exponent(at));
    return phong_peak(at) * lobe;
}

fn material_blinn_phong(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let lobe = material_half_power(half_vector, blinn_phong_half_exponent(at));
    return blinn_phong_peak(at) * (half_vector.light * lobe);
}

fn material_microfacet(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let sum = light + view;
    if light.z <= 0.0 || dot(sum, sum) <= 0.0 {
        return vec3f(0.0);
    }
    let share = angles_angle(length(sum.xy), sum.z) / microfacet_sigma(at);
    return microfacet_peak(at) * exp(-min(share * share, MATERIAL_STEEP));
}

fn material_torrance_sparrow(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let m = torrance_sparrow_roughness(at);
    let across = half_vector.across / (m * m);
    let z2 = half_vector.sum.z * half_vector.sum.z;
    if across >= MATERIAL_STEEP * z2 {
        return vec3f(0.0);
    }
    let cos2 = z2 / half_vector.length_squared;
    let d = exp(-across / z2) / (cos2 * cos2);
    let cos_i = half_vector.light;
    let cos_o = half_vector.view;
    let masked = cos_i * cos_o
        + cos_o * material_lambda_cosine(m, cos_i)
        + cos_i * material_lambda_cosine(m, cos_o);
    let fresnel = material_fresnel(torrance_sparrow_fresnel(at), half_vector);
    return torrance_sparrow_peak(at) * fresnel * (d * cos_i / masked);
}

fn material_ggx(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    // Facets of one width have the same formula: alpha_x alpha_y is alpha^2, and their ratio 1.
    let product = ggx_product(at);
    let ratio = ggx_ratio(at);
    let sum = half_vector.sum;
    var across = sum.x * sum.x * ratio + sum.y * sum.y / ratio + product * sum.z * sum.z;
    across = across / half_vector.length_squared;
    let cos_i = half_vector.light;
    let cos_o = half_vector.view;
    let squares = ggx_squares(at);
    let masked = cos_i * material_masked(squares, view, cos_o) + cos_o * material_masked(squares, light, cos_i);
    let lobe = cos_i / masked / (across * across);
    return ggx_peak(at) * material_fresnel(ggx_fresnel(at), half_vector) * lobe;
}

// The masking of GGX's facets of these alpha_x^2 and alpha_y^2.
fn material_masked(squares: vec2f, v: vec3f, cosine: f32) -> f32 {
    return sqrt(squares.x * v.x * v.x + squares.y * v.y * v.y + cosine * cosine);
}

fn material_ward(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let roughness = ward_roughness(at);
    let x = half_vector.sum.x / roughness.x;
    let y = half_vector.sum.y / roughness.y;
    let z = half_vector.sum.z;
    let across = x * x + y * y;
    if across >= MATERIAL_STEEP * z * z {
        return vec3f(0.0);
    }
    let slopes = across / (z * z);
    let grazing = half_vector.light / z / max(z, MATERIAL_MIN_COSINE);
    return ward_peak(at) * (exp(-slopes) * (half_vector.length_squared / (z * z)) * grazing);
}

fn material_ashikhmin_shirley(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let sum = half_vector.sum;
    let facet = half_vector.facet;
    let cos_i = half_vector.light;
    let cos_o = half_vector.view;
    var exponent = 0.0;
    if half_vector.across > 0.0 {
        let half_exponent = ashikhmin_shirley_half_exponent(at);
        let turned = half_exponent.x * sum.x * sum.x + half_exponent.y * sum.y * sum.y;
        exponent = turned / half_vector.across;
    }
    let lobe = ashikhmin_shirley_lobe(at) * material_half_power(half_vector, exponent)
        / max(facet, MATERIAL_MIN_COSINE) * (cos_i / max(cos_i, cos_o));
    let grazing = material_fifth(max(1.0 - facet, 0.0));
    let base = material_fade(cos_i) * material_fade(cos_o) * cos_i;
    let specular = ashikhmin_shirley_specular(at);
    return (specular + (vec3f(1.0) - specular) * grazing) * lobe + ashikhmin_shirley_base(at) * base;
}

fn material_poulin_fournier(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let half_vector = material_half(light, view);
    if !half_vector.seen {
        return vec3f(0.0);
    }
    let of_light = material_cylinder(at, light);
    let of_view = material_cylinder(at, view);
    let arc = vec2f(max(of_light.arc.x, of_view.arc.x), min(of_light.arc.y, of_view.arc.y));
    let ground = vec2f(max(of_light.ground.x, of_view.ground.x), min(of_light.ground.y, of_view.ground.y));
    let s = poulin_fournier_exponent(at);
    var diffuse = 0.0;
    var specular = 0.0;
    if arc.x < arc.y {
        let scale = half_vector.light / poulin_fournier_distance(at) / (of_light.cosine * of_view.cosine);
        let middle = 0.5 * (arc.x + arc.y);
        let radius = 0.5 * (arc.y - arc.x);
        let from_light = angles_circle((middle - of_light.phi) / (2.0 * ANGLES_PI)).x;
        let from_view = angles_circle((middle - of_view.phi) / (2.0 * ANGLES_PI)).x;
        let twice = angles_circle((2.0 * middle - of_light.phi - of_view.phi) / (2.0 * ANGLES_PI)).x;
        let matte = 2.0 * from_light * from_view - material_one_less_sinc(2.0 * radius) * twice;
        diffuse += scale * max(radius * matte, 0.0);
        let sum = half_vector.sum;
        let along = sum.x * sum.x / half_vector.length_squared;
        let across = material_power(sqrt(max(1.0 - along, 0.0)), along, s);
        specular += scale * across * material_cylinder_highlight(at, sum, of_light.phi, of_view.phi, arc);
    }
    if ground.x < ground.y {
        let width = half_vector.light / poulin_fournier_distance(at) * (ground.y - ground.x);
        diffuse += width;
        specular += width * material_half_power(half_vector, 0.5 * s);
    }
    return poulin_fournier_diffuse(at) * diffuse + poulin_fournier_specular(at) * specular;
}

// What a direction sees of a cylinder, and of the floor beside it.
struct Cylinder {
    // Its angle in the plane across the cylinder, from +Z toward +Y.
    phi: f32,
    // Of phi.
    cosine: f32,
    // The ends of the arc.
    arc: vec2f,
    // The ends of the floor.
    ground: vec2f,
}

fn material_cylinder(at: u32, direction: vec3f) -> Cylinder {
    let height = max(direction.z, 0.0);
    let size = length(vec2f(direction.y, height));
    var cosine = 1.0;
    if size > 0.0 {
        cosine = max(height / size, MATERIAL_MIN_COSINE);
    }
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let d = poulin_fournier_distance(at);
    let z = poulin_fournier_floor(at);
    let edge = poulin_fournier_edge(at);
    let b = poulin_fournier_half_width(at);
    let hidden = min(0.5 * d * cosine, 1.0);
    var first = -angles_angle(cosine, sine);
    let last = min(first + 2.0 * angles_angle(sqrt(hidden), sqrt(1.0 - hidden)), edge);
    first = max(first, -edge);
    var near = b;
    if b * sine < -z * cosine {
        near = (1.0 + z * sine) / cosine;
    }
    var far = d - b;
    if sine > z {
        far = d - (1.0 - z * sine) / cosine;
    }
    let phi = angles_angle(sine, cosine);
    if direction.y < 0.0 {
        return Cylinder(-phi, cosine, vec2f(-last, -first), vec2f(d - far, d - near));
    }
    return Cylinder(phi, cosine, vec2f(first, last), vec2f(near, far));
}

// The integral of cos^s(psi) and both cosines over an arc, psi from the half vector.
fn material_cylinder_highlight(at: u32, sum: vec3f, phi_l: f32, phi_v: f32, arc: vec2f) -> f32 {
    let phi_h = angles_angle(sum.y, sum.z);
    let reach = poulin_fournier_reach(at);
    let start = max(material_half_tangent(arc.x - phi_h), -reach);
    let end = min(material_half_tangent(arc.y - phi_h), reach);
    if start >= end {
        return 0.0;
    }
    let middle = 0.5 * (start + end);
    let radius = 0.5 * (end - start);
    let light = angles_circle((phi_h - phi_l) / (2.0 * ANGLES_PI));
    let view = angles_circle((phi_h - phi_v) / (2.0 * ANGLES_PI));
    let s = poulin_fournier_exponent(at);
    var integral = 0.0;
    for (var node = 0u; node < 8u; node++) {
        let gauss = poulin_fournier_gauss(at, node);
        let step = radius * gauss.x;
        let both = material_on_cylinder(middle - step, light, view, s)
            + material_on_cylinder(middle + step, light, view, s);
        integral += gauss.y * both;
    }
    return radius * integral;
}

// tan(angle / 2), of half angles within pi / 4.
fn material_half_tangent(angle: f32) -> f32 {
    let turn = angles_circle(clamp(0.5 * angle, -0.25 * ANGLES_PI, 0.25 * ANGLES_PI) / (2.0 * ANGLES_PI));
    return turn.y / turn.x;
}

fn material_on_cylinder(t: f32, light: vec2f, view: vec2f, s: f32) -> f32 {
    let scale = 1.0 / (1.0 + t * t);
    let sine = 2.0 * t * scale;
    let cosine = (1.0 - t) * (1.0 + t) * scale;
    let cos_l = max(cosine * light.x - sine * light.y, 0.0);
    let cos_v = max(cosine * view.x - sine * view.y, 0.0);
    return 2.0 * scale * material_power(cosine, sine * sine, s) * cos_l * cos_v;
}

fn material_lafortune(at: u32, light: vec3f, view: vec3f) -> vec3f {
    if light.z <= 0.0 {
        return vec3f(0.0);
    }
    let across = light.x * view.x + light.y * view.y;
    let along = light.z * view.z;
    var brdf = lafortune_diffuse(at);
    for (var lobe = 0u; lobe < lafortune_lobes_count(at); lobe++) {
        let one = lafortune_lobes(at, lobe);
        let base = lafortune_lobe_cx(one) * across + lafortune_lobe_cz(one) * along;
        brdf += lafortune_lobe_weight(one) * material_power_of(base, lafortune_lobe_n(one));
    }
    return brdf * light.z;
}

fn material_kajiya_kay(at: u32, light: vec3f, view: vec3f) -> vec3f {
    let sin_i = length(light.yz);
    let sin_o = length(view.yz);
    let sine = sin_i * view.x - light.x * sin_o;
    let cosine = light.x * view.x + sin_i * sin_o;
    return kajiya_kay_specular(at) * material_power(cosine, sine * sine, kajiya_kay_exponent(at));
}

fn material_measured(at: u32, light: vec3f, view: vec3f) -> vec3f {
    if light.z <= 0.0 {
        return vec3f(0.0);
    }
    // theta_h, theta_d and phi_d.
    let angles = material_half_difference(light, view);
    let n = measured_shape(at);
    let to_h = min(sqrt(angles.x / (0.5 * ANGLES_PI)) * f32(n.x), f32(n.x - 1u));
    let to_d = min(angles.y / (0.5 * ANGLES_PI) * f32(n.y), f32(n.y - 1u));
    let turn = angles.z / ANGLES_PI * f32(n.z);
    let h = u32(to_h);
    let d = u32(to_d);
    let phi = u32(turn);
    let share = vec3f(to_h - f32(h), to_d - f32(d), turn - f32(phi));
    let columns = vec2u(phi % n.z, (phi + 1u) % n.z);
    let near = h * n.y + d;
    let next = h * n.y + min(d + 1u, n.y - 1u);
    let step = select(0u, n.y, h + 1u < n.x);
    let table = measured_table(at);
    let low = material_row(table, near * n.z, columns, share.z) * (1.0 - share.y)
        + material_row(table, next * n.z, columns, share.z) * share.y;
    let high = material_row(table, (near + step) * n.z, columns, share.z) * (1.0 - share.y)
        + material_row(table, (next + step) * n.z, columns, share.z) * share.y;
    return measured_scale(at) * (low * (1.0 - share.x) + high * share.x) * light.z;
}

fn material_measured_anisotropic(at: u32, light: vec3f, view: vec3f) -> vec3f {
    if light.z <= 0.0 {
        return vec3f(0.0);
    }
    // theta_h, phi_h, theta_d and psi.
    let angles = material_half_and_difference(light, view);
    let n = measured_anisotropic_shape(at);
    let to_h = min(sqrt(angles.x / (0.5 * ANGLES_PI)) * f32(n.x), f32(n.x - 1u));
    let to_phi = angles.y / (2.0 * ANGLES_PI) * f32(n.y);
    let to_d = min(angles.z / (0.5 * ANGLES_PI) * f32(n.z), f32(n.z - 1u));
    let to_psi = angles.w / ANGLES_PI * f32(n.w);
    let first = vec4u(u32(to_h), u32(to_phi), u32(to_d), u32(to_psi));
    let share = vec4f(to_h, to_phi, to_d, to_psi) - vec4f(first);
    let columns = vec2u(first.w % n.w, (first.w + 1u) % n.w);
    let table = measured_anisotropic_table(at);
    var sum = vec3f(0.0);
    // Each corner takes the nearer or the farther node of three axes.
    for (var corner = 0u; corner < 8u; corner++) {
        let far = vec3u(corner >> 2u, (corner >> 1u) & 1u, corner & 1u);
        let i = min(first.x + far.x, n.x - 1u);
        let j = (first.y + far.y) % n.y;
        let k = min(first.z + far.z, n.z - 1u);
        let weight = select(1.0 - share.x, share.x, far.x == 1u)
            * select(1.0 - share.y, share.y, far.y == 1u)
            * select(1.0 - share.z, share.z, far.z == 1u);
        sum += material_row(table, ((i * n.y + j) * n.z + k) * n.w, columns, share.w) * weight;
    }
    return measured_anisotropic_scale(at) * sum * light.z;
}

// Between two entries of a row of a table.
fn material_row(table: u32, row: u32, columns: vec2u, share: f32) -> vec3f {
    let before = measured_table_values(table, row + columns.x);
    let after = measured_table_values(table, row + columns.y);
    return before + (after - before) * share;
}

// The four functions of `standard` at a cosine: between the nodes of its tables.
fn material_at_cosine(at: u32, cosine: f32) -> vec4f {
    let last = standard_tables_count(at) - 1u;
    let place = sqrt(min(cosine, 1.0)) * f32(last);
    let node = min(u32(place), last - 1u);
    let low = standard_tables(at, node);
    let high = standard_tables(at, node + 1u);
    return low + (high - low) * (place - f32(node));
}

// The sheen of fibres: a power of sin(theta_h) and the masking of light and view.
fn material_charlie(at: u32, half_vector: Half) -> f32 {
    let sin2 = half_vector.across / half_vector.length_squared;
    let cos2 = half_vector.sum.z * half_vector.sum.z / half_vector.length_squared;
    var ln = log(max(sin2, MATERIAL_TINY));
    if cos2 < MATERIAL_NEAR {
        ln = 2.0 * material_ln_cosine(cos2);
    }
    let light = max(half_vector.light, MATERIAL_GRAZING);
    let view = max(half_vector.view, MATERIAL_GRAZING);
    let masked = (1.0 + material_charlie_lambda(at, light) + material_charlie_lambda(at, view)) * light * view;
    return material_bounded_exp(charlie_power(at) * ln) / masked;
}

fn material_charlie_lambda(at: u32, cosine: f32) -> f32 {
    if cosine < 0.5 {
        return material_bounded_exp(material_charlie_ln(at, cosine));
    }
    return material_bounded_exp(charlie_twice_middle(at) - material_charlie_ln(at, max(1.0 - cosine, 0.0)));
}

fn material_charlie_ln(at: u32, x: f32) -> f32 {
    let power = material_bounded_exp(charlie_c(at) * log(max(x, MATERIAL_TINY)));
    let share = charlie_a(at) / (1.0 + charlie_b(at) * power);
    return share + charlie_d(at) * x + charlie_e(at);
}

// The share that a smooth facet reflects.
fn material_fresnel(at: u32, half_vector: Half) -> vec3f {
    let n = fresnel_n(at);
    if !fresnel_is_conductor(at) {
        return vec3f(material_dielectric(n.x, half_vector.facet));
    }
    let k = fresnel_k(at);
    return vec3f(
        material_conductor(n.x, k.x, half_vector.facet, half_vector.turn),
        material_conductor(n.y, k.y, half_vector.facet, half_vector.turn),
        material_conductor(n.z, k.z, half_vector.facet, half_vector.turn),
    );
}
