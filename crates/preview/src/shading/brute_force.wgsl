// The integral over all light [RH02, eq. 2] with samples of the light and of the material's lobes, weighted
// by the balance heuristic. The twin of brute_force.rs, with the same samples.
//
// It needs surface.wgsl, angles.wgsl, sequence.wgsl, light_samples.wgsl, material.wgsl, lobe_sampling.wgsl and
// product_samples.wgsl. Their buffers come from `Prepared`: light_samples from `Prepared::light`, material
// from the `PackedMaterial` of `Prepared::material`, lobe_sampling from `Prepared::lobes`; product_samples
// from `ProductTables`. `light_arrives` says whether light from a direction arrives: it is in shadows.wgsl,
// or always true.

// The sum over `count` light samples from `first` on: the reflected radiance times the samples' number.
fn brute_force(surface: Surface, sequence: Sequence, first: u32, count: u32) -> vec3f {
    let frame = mat3x3f(surface.tangent, cross(surface.normal, surface.tangent), surface.normal);
    let to_surface = transpose(frame);
    let view = to_surface * surface.view;
    let share = lobe_sampling_light();
    let grid = light_samples_grid();
    let cell = product_samples_cell(grid, surface);
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let point = sequence_point(sequence, first + i);
        var lit: LightSample;
        var incident: vec3f;
        let by_product = select(0.0, PRODUCT_SAMPLES_SHARE, product_samples_follow(first + i));
        let rest = brute_force_below_1((point.x - by_product) / (1.0 - by_product));
        if point.x < by_product {
            lit = product_samples_draw(
                grid, cell, vec2f(brute_force_below_1(point.x / by_product), point.y));
            incident = to_surface * lit.direction;
        } else if rest < share {
            lit = light_samples_draw(vec2f(brute_force_below_1(rest / share), point.y));
            incident = to_surface * lit.direction;
        } else {
            let choice = brute_force_below_1((rest - share) / (1.0 - share));
            incident = lobe_sampling_draw(vec2f(choice, point.y), view);
            lit = light_samples_at(frame * incident);
        }
        let rho_hat = material_rho_hat(incident, view);
        if all(rho_hat == vec3f(0.0)) || !light_arrives(frame * incident) {
            continue;
        }
        var density = share * lit.density + (1.0 - share) * lobe_sampling_density(incident, view);
        if by_product > 0.0 {
            let of_product = product_samples_density(grid, cell, lit);
            density = by_product * of_product + (1.0 - by_product) * density;
        }
        if density > 0.0 {
            sum += lit.radiance * rho_hat / density;
        }
    }
    return sum;
}

// Keeps a coordinate below 1 that rounding brought to 1.
fn brute_force_below_1(coordinate: f32) -> f32 {
    return min(coordinate, 0.99999994);
}
