// The suns and lamps beside a reflected field: each of their points adds its flux times rho_hat of the reflection's
// own material, in the surface's frame and in the mean over turns of the surface, to the soft light of a map. The
// twin of lamps.rs, which has the layout of the elements.
// It needs surface.wgsl, angles.wgsl and material.wgsl. Its buffers come from `PackedLamps`. `light_arrives`
// says whether light from a direction does: it is in shadows.wgsl, or always true.

// `PackedLamps::elements`.
@group(3) @binding(3) var<storage, read> lamps: array<vec4f>;

// The radiance toward the viewer of a surface whose map shows `soft`.
fn lamps_added(surface: Surface, soft: vec3f) -> vec3f {
    let cut = select(soft, max(soft, vec3f(0.0)), lamps[0].y == 1.0);
    return lamps_some(surface, cut, 0u, u32(lamps[0].x));
}

// The radiance `before`, and that of `count` lamps from `first_lamp` on.
fn lamps_some(surface: Surface, before: vec3f, first_lamp: u32, count: u32) -> vec3f {
    var sum = before;
    let turns = lamps[0].z;
    let frame = mat3x3f(surface.tangent, cross(surface.normal, surface.tangent), surface.normal);
    let to_surface = transpose(frame);
    let view = to_surface * surface.view;
    let mirrored = vec3f(-view.xy, view.z);
    for (var lamp = first_lamp; lamp < first_lamp + count; lamp++) {
        let centre = lamps[2u + 3u * lamp];
        let levels = lamps[4u + 3u * lamp];
        let level = u32(levels.x) + lamps_level(u32(levels.y), centre.w, to_surface * centre.xyz, mirrored);
        let first = u32(lamps[level].x);
        let last = first + u32(lamps[level].y);
        var reflected = vec3f(0.0);
        for (var point = first; point < last; point++) {
            if !light_arrives(lamps[point].xyz) {
                continue;
            }
            let incident = to_surface * lamps[point].xyz;
            for (var turn = 0u; turn < u32(turns); turn++) {
                let angle = 6.2831853 * f32(turn) / turns;
                let turned = mat3x3f(cos(angle), sin(angle), 0.0, -sin(angle), cos(angle), 0.0, 0.0, 0.0, 1.0);
                reflected += lamps[point].w / turns * material_rho_hat(turned * incident, turned * view);
            }
        }
        sum += lamps[3u + 3u * lamp].rgb * reflected;
    }
    return sum;
}

// The index of the level of a lamp that is seen, of so many: its centre alone is the first. The directions of the
// lamp's centre and of the view's mirror image are in the surface's frame.
fn lamps_level(levels: u32, radius: f32, centre: vec3f, mirrored: vec3f) -> u32 {
    if levels <= 2u {
        return 1u;
    }
    let width = lamps[1].x;
    let away = 2.0 * asin(min(0.5 * distance(centre, mirrored), 1.0)) - radius;
    let feature = min(lamps[1].y * away, lamps[1].z);
    let is_whole = abs(centre.z) > sin(radius);
    if is_whole && radius <= lamps[1].w * feature {
        return 0u;
    }
    if feature < 2.0 * width {
        return 1u;
    }
    return min(1u + u32(log2(feature / width)), levels - 1u);
}
