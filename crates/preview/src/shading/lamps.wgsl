// The suns and lamps beside a reflected field: each of their points adds its flux times rho_hat of the reflection's
// own material, in the surface's frame and in the mean over turns of the surface, to the soft light of a map. The
// twin of lamps.rs, which has the layout of the elements.
// It needs surface.wgsl, angles.wgsl and material.wgsl. Its buffers come from `PackedLamps`.

// `PackedLamps::elements`.
@group(3) @binding(3) var<storage, read> lamps: array<vec4f>;

// The radiance toward the viewer of a surface whose map shows `soft`.
fn lamps_added(surface: Surface, soft: vec3f) -> vec3f {
    var sum = select(soft, max(soft, vec3f(0.0)), lamps[0].y == 1.0);
    let count = u32(lamps[0].x);
    let turns = lamps[0].z;
    let frame = mat3x3f(surface.tangent, cross(surface.normal, surface.tangent), surface.normal);
    let to_surface = transpose(frame);
    let view = to_surface * surface.view;
    for (var lamp = 0u; lamp < count; lamp++) {
        let direction = lamps[1u + 2u * lamp].xyz;
        let flux = lamps[2u + 2u * lamp].rgb;
        let incident = to_surface * direction;
        for (var turn = 0u; turn < u32(turns); turn++) {
            let angle = 6.2831853 * f32(turn) / turns;
            let turned = mat3x3f(cos(angle), sin(angle), 0.0, -sin(angle), cos(angle), 0.0, 0.0, 0.0, 1.0);
            sum += flux * material_rho_hat(turned * incident, turned * view) / turns;
        }
    }
    return sum;
}
