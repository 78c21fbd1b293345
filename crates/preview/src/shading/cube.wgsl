// Look-ups on a cube: four texels around a direction, across edges and corners.
// The twin of cube.rs, which explains how the texel across an edge is found; faces as in `sphere::Cube`.

struct Texel {
    // 0 to 5: +X -X +Y -Y +Z -Z of the cube coordinates.
    face: u32,
    column: u32,
    row: u32,
}

struct Taps {
    texel: array<Texel, 4>,
    weight: vec4f,
}

// A point of a face's plane: (s, t), t downward, times the plane's distance.
struct OnFace {
    face: u32,
    at: vec2f,
    distance: f32,
}

fn cube_on_face(c: vec3f) -> OnFace {
    let a = abs(c);
    if a.x >= a.y && a.x >= a.z {
        let positive = c.x > 0.0;
        return OnFace(select(1u, 0u, positive), vec2f(select(c.z, -c.z, positive), -c.y), a.x);
    }
    if a.y >= a.z {
        let positive = c.y > 0.0;
        return OnFace(select(3u, 2u, positive), vec2f(c.x, select(-c.z, c.z, positive)), a.y);
    }
    let positive = c.z > 0.0;
    return OnFace(select(5u, 4u, positive), vec2f(select(-c.x, c.x, positive), -c.y), a.z);
}

fn cube_point(face: u32, at: vec2f, distance: f32) -> vec3f {
    switch face {
        case 0u: { return vec3f(distance, -at.y, -at.x); }
        case 1u: { return vec3f(-distance, -at.y, at.x); }
        case 2u: { return vec3f(at.x, distance, at.y); }
        case 3u: { return vec3f(at.x, -distance, -at.y); }
        case 4u: { return vec3f(at.x, -at.y, distance); }
        default: { return vec3f(-at.x, -at.y, -distance); }
    }
}

// A texel's centre on a cube with corners at (+-edge, +-edge, +-edge), in the light's frame, not normalised.
fn cube_centre(edge: u32, texel: Texel) -> vec3f {
    let at = vec2f(vec2u(2u * texel.column + 1u, 2u * texel.row + 1u)) - f32(edge);
    let c = cube_point(texel.face, at, f32(edge));
    return vec3f(c.z, -c.x, c.y);
}

// The texel at a column and row, one of which may lie one step outside the face; if both do, any texel.
fn cube_continued(edge: u32, face: u32, column: i32, row: i32) -> Texel {
    let last = i32(edge) - 1;
    if column >= 0 && column <= last && row >= 0 && row <= last {
        return Texel(face, u32(column), u32(row));
    }
    let at = vec2f(vec2i(2 * column - last, 2 * row - last));
    let beside = cube_on_face(cube_point(face, at, f32(edge)));
    let whole = clamp((vec2i(beside.at) + last) / 2, vec2i(0), vec2i(last));
    return Texel(beside.face, u32(whole.x), u32(whole.y));
}

// The four texels around a direction of the light's frame, of any length.
fn cube_taps(edge: u32, direction: vec3f) -> Taps {
    let on = cube_on_face(vec3f(-direction.y, direction.z, direction.x));
    let position = (on.at / on.distance + 1.0) * (0.5 * f32(edge)) - 0.5;
    let corner = floor(position);
    let left = i32(corner.x);
    let top = i32(corner.y);
    let share = position - corner;
    let rest = 1.0 - share;
    let last = i32(edge) - 1;
    let inside = vec4<bool>(left >= 0, top >= 0, left < last, top < last);
    var taps: Taps;
    taps.weight = vec4f(rest.x * rest.y, share.x * rest.y, rest.x * share.y, share.x * share.y);
    if all(inside) {
        let x = u32(left);
        let y = u32(top);
        taps.texel[0] = Texel(on.face, x, y);
        taps.texel[1] = Texel(on.face, x + 1u, y);
        taps.texel[2] = Texel(on.face, x, y + 1u);
        taps.texel[3] = Texel(on.face, x + 1u, y + 1u);
        return taps;
    }
    taps.texel[0] = cube_continued(edge, on.face, left, top);
    taps.texel[1] = cube_continued(edge, on.face, left + 1, top);
    taps.texel[2] = cube_continued(edge, on.face, left, top + 1);
    taps.texel[3] = cube_continued(edge, on.face, left + 1, top + 1);
    // Three faces meet at a corner: the mean of their texels replaces the fourth, which has weight 0.
    let before = !inside.xy;
    let past = !inside.zw;
    let missing = vec4<bool>(
        before.x && before.y,
        past.x && before.y,
        before.x && past.y,
        past.x && past.y,
    );
    if any(missing) {
        let none = select(vec4f(0.0), taps.weight, missing);
        let third = (none.x + none.y + none.z + none.w) / 3.0;
        taps.weight = select(taps.weight + third, vec4f(0.0), missing);
    }
    return taps;
}

// A texel of a map whose layers are faces; `first` is the layer of the first face.
fn cube_load(map: texture_2d_array<f32>, texel: Texel, first: u32) -> vec3f {
    return textureLoad(map, vec2u(texel.column, texel.row), first + texel.face, 0).rgb;
}

// The bilinear value of a cube map.
fn cube_blend(map: texture_2d_array<f32>, taps: Taps, first: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = 0u; k < 4u; k++) {
        sum += cube_load(map, taps.texel[k], first) * taps.weight[k];
    }
    return sum;
}
