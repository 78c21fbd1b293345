// A texture at a sample of a surface: linear between texels and between levels. The twin of texture.rs.

struct TextureUniforms {
    factor: vec3f,
    // 1 if enlarged texels are squares.
    nearest: u32,
    // `TEXTURE_REPEAT` and so on, along u and v.
    wrap: vec2u,
    count: u32,
    // The place of the first texel of each level, its width and its height.
    levels: array<vec4u, 11>,
}

const TEXTURE_REPEAT = 0u;
const TEXTURE_MIRROR = 1u;
const TEXTURE_CLAMP = 2u;

@group(1) @binding(0) var<uniform> texture_uniforms: TextureUniforms;
// Red, the lowest byte, green and blue of each texel, level after level, rows from the top.
@group(1) @binding(1) var<storage, read> texture_texels: array<u32>;

// The inverse of the sRGB transfer function (IEC 61966-2-1).
fn texture_decode(encoded: vec3f) -> vec3f {
    let curve = pow((max(encoded, vec3f(0.04045)) + 0.055) / 1.055, vec3f(2.4));
    return select(curve, encoded / 12.92, encoded <= vec3f(0.04045));
}

fn texture_wrapped(index: i32, count: i32, wrap: u32) -> u32 {
    if wrap == TEXTURE_CLAMP {
        return u32(clamp(index, 0, count - 1));
    }
    let period = select(count, 2 * count, wrap == TEXTURE_MIRROR);
    let inside = ((index % period) + period) % period;
    return u32(min(inside, select(inside, period - 1 - inside, wrap == TEXTURE_MIRROR)));
}

fn texture_texel(level: vec4u, column: i32, row: i32) -> vec3f {
    let x = texture_wrapped(column, i32(level.y), texture_uniforms.wrap.x);
    let y = texture_wrapped(row, i32(level.z), texture_uniforms.wrap.y);
    return texture_decode(unpack4x8unorm(texture_texels[level.x + y * level.y + x]).rgb);
}

// The colour of one level.
fn texture_level(level: vec4u, at: vec2f, nearest: bool) -> vec3f {
    let place = at * vec2f(level.yz);
    if nearest {
        let first = vec2i(floor(place));
        return texture_uniforms.factor * texture_texel(level, first.x, first.y);
    }
    let middle = place - 0.5;
    let floored = floor(middle);
    let share = middle - floored;
    let first = vec2i(floored);
    let next = first + 1;
    return texture_uniforms.factor * mix(
        mix(texture_texel(level, first.x, first.y), texture_texel(level, next.x, first.y), share.x),
        mix(texture_texel(level, first.x, next.y), texture_texel(level, next.x, next.y), share.x),
        share.y,
    );
}

// The linear colour at coordinates, times the factor; `across` and `down` are their steps to the next
// samples.
fn texture_color(at: vec2f, across: vec2f, down: vec2f) -> vec3f {
    let size = vec2f(texture_uniforms.levels[0].yz);
    let square = max(dot(across * size, across * size), dot(down * size, down * size));
    let most = texture_uniforms.count - 1u;
    // A step that is not a number is none.
    var level = 0.0;
    if square > 1.0 {
        level = 0.5 * log2(square);
    }
    if level == 0.0 {
        return texture_level(texture_uniforms.levels[0], at, texture_uniforms.nearest == 1u && most > 0u);
    }
    if level >= f32(most) {
        return texture_level(texture_uniforms.levels[most], at, false);
    }
    let fine = u32(level);
    let one = texture_level(texture_uniforms.levels[fine], at, false);
    return mix(one, texture_level(texture_uniforms.levels[fine + 1u], at, false), level - f32(fine));
}

// The linear colour at a fragment's coordinates u, with so many samples along each side of a pixel.
// `nearness` is 1 / w, the fourth part of a fragment's position. u / w and 1 / w are linear on the screen:
// their steps are exact, and the derivatives of u follow from them.
fn texture_at_fragment(coordinates: vec2f, nearness: f32, samples: f32) -> vec3f {
    let sum = coordinates * nearness;
    let scale = 1.0 / (nearness * samples);
    let across = (dpdx(sum) - coordinates * dpdx(nearness)) * scale;
    let down = (dpdy(sum) - coordinates * dpdy(nearness)) * scale;
    return texture_color(coordinates, across, down);
}
