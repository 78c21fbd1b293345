// The taps of a material into a scale space of the light: the twin of taps.rs, which has the layout of the
// elements. It needs surface.wgsl and cube.wgsl.

// `Levels::elements`.
@group(3) @binding(6) var<storage, read> taps_levels: array<vec4f>;
// `PackedTaps::elements`.
@group(3) @binding(7) var<storage, read> taps_table: array<vec4f>;

// The bilinear value of a cube.
fn taps_cube(cube: u32, direction: vec3f) -> vec3f {
    let first = u32(taps_levels[1u + cube].x);
    let edge = u32(taps_levels[1u + cube].y);
    let around = cube_taps(edge, direction);
    var sum = vec3f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let texel = around.texel[k];
        let place = first + (texel.face * edge + texel.row) * edge + texel.column;
        sum += taps_levels[place].rgb * around.weight[k];
    }
    return sum;
}

// The light about a normal: linear between two kernels.
fn taps_about_normal(normal: vec3f, y: f32) -> vec3f {
    let last = taps_levels[0].y - 1.0;
    let place = clamp(y * last, 0.0, last - 1e-6);
    let low = u32(place);
    let a = taps_cube(low, normal);
    return a + (taps_cube(low + 1u, normal) - a) * (place - f32(low));
}

// The light, blurred by a Gaussian with the logarithm `width` of its standard deviation: linear in the
// variance between two levels.
fn taps_blurred(direction: vec3f, width: f32) -> vec3f {
    let last = taps_levels[0].z - 1.0;
    let place = clamp(4.0 * (width - taps_levels[0].x), 0.0, last - 1e-3);
    let low = u32(place);
    let share = (exp2(0.5 * (place - f32(low))) - 1.0) * 2.41421356;
    let first = u32(taps_levels[0].y) + low;
    let a = taps_cube(first, direction);
    return a + (taps_cube(first + 1u, direction) - a) * share;
}

// Radiance by a table over the angles of views.
fn taps_by_angle(surface: Surface) -> vec3f {
    let n = surface.normal;
    let cosine = max(dot(n, surface.view), 0.0);
    let r = normalize(n * (2.0 * cosine) - surface.view);
    let aside = n - r * cosine;
    let square = dot(aside, aside);
    var toward = vec3f(0.0);
    if square > 1e-24 {
        toward = aside / sqrt(square);
    }
    let count = u32(taps_table[0].x);
    let normals = u32(taps_table[0].y);
    let last = u32(taps_table[0].z) - 1u;
    let position = clamp(1.0 - cosine, 0.0, 1.0) * f32(last);
    let row = min(u32(position), last - 1u);
    let share = position - f32(row);
    let width = 2u * count + normals;
    let low = 1u + row * width;
    var sum = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let at = low + 2u * k;
        let place = mix(taps_table[at], taps_table[at + width], share);
        let weight = mix(taps_table[at + 1u], taps_table[at + 1u + width], share);
        sum += weight.rgb * taps_blurred(cos(place.x) * r + sin(place.x) * toward, place.y);
    }
    for (var k = 0u; k < normals; k++) {
        let at = low + 2u * count + k;
        let tap = mix(taps_table[at], taps_table[at + width], share);
        sum += tap.rgb * taps_about_normal(n, tap.w);
    }
    return sum;
}

// Part k of a node, mixed with that of the three others around a view.
fn taps_node(first: u32, width: u32, rows: u32, share: vec2f, k: u32) -> vec4f {
    let low = 1u + first * width + k;
    let high = low + rows * width;
    let a = mix(taps_table[low], taps_table[low + width], share.x);
    let b = mix(taps_table[high], taps_table[high + width], share.x);
    return mix(a, b, share.y);
}

// Radiance by a table over the disc of views, or over a quarter of it, in which mirrors change nothing.
fn taps_by_view(surface: Surface, is_quarter: bool) -> vec3f {
    let n = surface.normal;
    let frame = mat3x3f(surface.tangent, cross(n, surface.tangent), n);
    let local = transpose(frame) * surface.view;
    let v = normalize(vec3f(local.xy, max(local.z, 0.0)));
    let disc = v.xy / sqrt((1.0 + v.z) * (1.0 + sqrt(v.z)));
    var mirror = vec2f(1.0);
    var first = -1.0;
    if is_quarter {
        mirror = select(vec2f(1.0), vec2f(-1.0), disc < vec2f(0.0));
        first = 0.0;
    }
    let count = u32(taps_table[0].x);
    let normals = u32(taps_table[0].y);
    let rows = u32(taps_table[0].z);
    let last = f32(rows) - 1.0;
    let position = clamp((mirror * disc - first) / (1.0 - first), vec2f(0.0), vec2f(1.0)) * last;
    let node = min(floor(position), vec2f(last - 1.0));
    let share = position - node;
    let width = 2u * count + normals;
    let at = u32(node.y) * rows + u32(node.x);
    var sum = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let place = taps_node(at, width, rows, share, 2u * k);
        let weight = taps_node(at, width, rows, share, 2u * k + 1u);
        let h = vec3f(mirror * place.xy, 1.0);
        let toward = h * (2.0 * dot(v, h) / dot(h, h)) - v;
        sum += weight.rgb * taps_blurred(frame * toward, place.z);
    }
    for (var k = 0u; k < normals; k++) {
        let tap = taps_node(at, width, rows, share, 2u * count + k);
        sum += tap.rgb * taps_about_normal(n, tap.w);
    }
    return sum;
}

// Radiance toward the viewer, without the lights beside the scale space.
fn taps_radiance(surface: Surface) -> vec3f {
    let views = taps_table[0].w;
    if views == 0.0 {
        return taps_by_angle(surface);
    }
    return taps_by_view(surface, views == 1.0);
}
