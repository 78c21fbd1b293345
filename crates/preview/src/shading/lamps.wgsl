// The suns and lamps beside a reflected field: each of their points adds its flux times rho_hat of the reflection's
// own material, in the surface's frame and in the mean over turns of the surface, to the soft light of a map. The
// twin of lamps.rs, which has the layout of the elements.
// It needs surface.wgsl, angles.wgsl and material.wgsl. Its buffers come from `PackedLamps`.

// What lamps that are one point may miss, and what each misses: see lamps.rs.
const LAMPS_MISSED = 0.01;
const LAMPS_CURVED = 0.25;
const LAMPS_CLEAR = 4.0;

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
    let mirrored = vec3f(-view.xy, view.z);
    let width = lamps[1].x;
    var missed = vec3f(0.0);
    for (var lamp = 0u; lamp < count; lamp++) {
        let radius = lamps[2u + 3u * lamp].w;
        let centre = to_surface * lamps[2u + 3u * lamp].xyz;
        let flux = lamps[3u + 3u * lamp].rgb;
        let levels = u32(lamps[4u + 3u * lamp].y);
        let away = 2.0 * asin(min(0.5 * distance(centre, mirrored), 1.0)) - radius;
        let feature = min(lamps[1].y * away, lamps[1].z);
        var level = 2u;
        // A lamp that the horizon may cut has all its points, as has one that is a point anyway.
        if levels > 3u && abs(centre.z) > lamps[3u + 3u * lamp].w {
            let is_small = 2.0 * radius <= width;
            if radius <= lamps[1].w * feature {
                level = 0u;
            } else if is_small || away >= LAMPS_CLEAR * width {
                let at_centre = flux * lamps_rho(centre, view, turns);
                let curved = radius / max(width, lamps[1].y * (away + radius));
                let more = missed + min(LAMPS_CURVED * curved * curved, 1.0) * at_centre;
                if all(more <= LAMPS_MISSED * (sum + at_centre)) {
                    sum += at_centre;
                    missed = more;
                    continue;
                }
            }
            if level > 0u && is_small {
                level = 1u;
            } else if level > 0u && feature >= 2.0 * width {
                level = min(2u + u32(log2(feature / width)), levels - 1u);
            }
        }
        level += u32(lamps[4u + 3u * lamp].x);
        let first = u32(lamps[level].x);
        let last = first + u32(lamps[level].y);
        var reflected = vec3f(0.0);
        for (var point = first; point < last; point++) {
            reflected += lamps[point].w * lamps_rho(to_surface * lamps[point].xyz, view, turns);
        }
        sum += flux * reflected;
    }
    return sum;
}

// rho_hat in the mean over turns of the surface.
fn lamps_rho(incident: vec3f, view: vec3f, turns: f32) -> vec3f {
    var mean = vec3f(0.0);
    for (var turn = 0u; turn < u32(turns); turn++) {
        let angle = 6.2831853 * f32(turn) / turns;
        let turned = mat3x3f(cos(angle), sin(angle), 0.0, -sin(angle), cos(angle), 0.0, 0.0, 0.0, 1.0);
        mean += material_rho_hat(turned * incident, turned * view) / turns;
    }
    return mean;
}
