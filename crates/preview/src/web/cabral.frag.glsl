#version 300 es

precision highp float;
precision highp int;

struct MapUniforms {
    uint centre;
    uint edge;
    uint degree;
    uint zonal;
    uint slices;
    uint coarse_edge;
    float share;
};
struct Surface {
    vec3 normal;
    vec3 tangent;
    vec3 view;
};
struct Texel {
    uint face;
    uint column;
    uint row;
};
struct Taps {
    Texel texel[4];
    vec4 weight;
};
struct OnFace {
    uint face;
    vec2 at;
    float distance_;
};
struct TextureUniforms {
    vec3 factor;
    uint nearest;
    uvec2 wrap;
    uint count;
    uvec4 levels[11];
};
struct PageVertex {
    vec4 position;
    vec3 normal;
    vec3 tangent;
    vec3 ray;
    vec2 coordinates;
};
struct PageUniforms {
    mat4x4 clip;
    mat3x3 to_light;
    vec3 eye;
    float gain;
    vec3 ray_right;
    uint tone;
    vec3 ray_up;
    uint raw;
    vec3 ray_forward;
    float amplify;
};
const uint CENTRE_REFLECTION = 0u;
const uint CENTRE_NORMAL = 1u;
const uint CENTRE_TANGENT = 2u;
const uint DEVELOP_PLAIN = 0u;
const uint DEVELOP_FILMIC = 1u;
const mat3x3 DEVELOP_INTO_ACES = mat3x3(vec3(0.59719, 0.076, 0.0284), vec3(0.35458, 0.90834, 0.13383), vec3(0.04823, 0.01566, 0.83777));
const mat3x3 DEVELOP_FROM_ACES = mat3x3(vec3(1.60475, -0.10208, -0.00327), vec3(-0.53108, 1.10813, -0.07276), vec3(-0.07367, -0.00605, 1.07602));
const vec3 CABRAL_POINTS[12] = vec3[12](vec3(0.0, 0.0, 1.0), vec3(0.8944272, 0.0, 0.4472136), vec3(0.2763932, 0.8506508, 0.4472136), vec3(-0.7236068, 0.5257311, 0.4472136), vec3(-0.7236068, -0.5257311, 0.4472136), vec3(0.2763932, -0.8506508, 0.4472136), vec3(0.7236068, 0.5257311, -0.4472136), vec3(-0.2763932, 0.8506508, -0.4472136), vec3(-0.8944272, 0.0, -0.4472136), vec3(-0.2763932, -0.8506508, -0.4472136), vec3(0.7236068, -0.5257311, -0.4472136), vec3(0.0, 0.0, -1.0));
const uvec3 CABRAL_TRIANGLES[20] = uvec3[20](uvec3(0u, 1u, 2u), uvec3(0u, 2u, 3u), uvec3(0u, 3u, 4u), uvec3(0u, 4u, 5u), uvec3(0u, 5u, 1u), uvec3(1u, 6u, 2u), uvec3(2u, 7u, 3u), uvec3(3u, 8u, 4u), uvec3(4u, 9u, 5u), uvec3(5u, 10u, 1u), uvec3(6u, 7u, 2u), uvec3(7u, 8u, 3u), uvec3(8u, 9u, 4u), uvec3(9u, 10u, 5u), uvec3(10u, 6u, 1u), uvec3(11u, 7u, 6u), uvec3(11u, 8u, 7u), uvec3(11u, 9u, 8u), uvec3(11u, 10u, 9u), uvec3(11u, 6u, 10u));
const uint TEXTURE_REPEAT = 0u;
const uint TEXTURE_MIRROR = 1u;
const uint TEXTURE_CLAMP = 2u;
const uint BASE_COLOR_NUMBERS = 13u;

layout(std140) uniform map_uniforms_block { MapUniforms map_uniforms; };

uniform highp sampler2DArray map;

layout(std140) uniform texture_uniforms_block { TextureUniforms texture_uniforms; };

uniform highp usampler2D texture_texels;

uniform highp sampler2D base_color_numbers;

layout(std140) uniform page_block { PageUniforms page; };

smooth in vec3 _vs2fs_location0;
smooth in vec3 _vs2fs_location1;
smooth in vec3 _vs2fs_location2;
smooth in vec2 _vs2fs_location3;
layout(location = 0) out vec4 _fs2p_location0;

vec3 surface_unit_or(vec3 v, vec3 other) {
    float square = dot(v, v);
    if ((square > 1e-24)) {
        return (v / vec3(sqrt(square)));
    }
    return other;
}

vec3 surface_across(vec3 normal) {
    vec3 other_1 = ((abs(normal.z) < 0.9) ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0));
    return normalize(cross(other_1, normal));
}

Surface surface_new(vec3 normal_1, vec3 tangent, vec3 ray, bool front_1) {
    vec3 n = vec3(0.0);
    bool local = false;
    vec3 view = -(normalize(ray));
    vec3 _e8 = surface_unit_or((front_1 ? normal_1 : -(normal_1)), view);
    n = _e8;
    vec3 _e10 = n;
    float cosine = dot(_e10, view);
    if ((cosine < 0.001)) {
        vec3 _e14 = n;
        n = normalize((_e14 + (view * (0.001 - cosine))));
    }
    vec3 _e20 = n;
    vec3 _e21 = n;
    vec3 rest = (tangent - (_e20 * dot(_e21, tangent)));
    float square_1 = dot(rest, rest);
    if (!((square_1 <= 1e-24))) {
        local = (square_1 <= (1e-6 * dot(tangent, tangent)));
    } else {
        local = true;
    }
    bool _e36 = local;
    if (_e36) {
        vec3 _e37 = n;
        vec3 _e38 = n;
        vec3 _e39 = surface_across(_e38);
        return Surface(_e37, _e39, view);
    }
    vec3 _e41 = n;
    return Surface(_e41, (rest / vec3(sqrt(square_1))), view);
}

vec3 surface_central(Surface surface, uint centre) {
    switch(centre) {
        case 0u: {
            return ((surface.normal * (2.0 * dot(surface.normal, surface.view))) - surface.view);
        }
        case 1u: {
            return surface.normal;
        }
        default: {
            return surface.tangent;
        }
    }
}

OnFace cube_on_face(vec3 c) {
    bool local_1 = false;
    vec3 a = abs(c);
    if ((a.x >= a.y)) {
        local_1 = (a.x >= a.z);
    } else {
        local_1 = false;
    }
    bool _e11 = local_1;
    if (_e11) {
        bool positive = (c.x > 0.0);
        return OnFace((positive ? 0u : 1u), vec2((positive ? -(c.z) : c.z), -(c.y)), a.x);
    }
    if ((a.y >= a.z)) {
        bool positive_1 = (c.y > 0.0);
        return OnFace((positive_1 ? 2u : 3u), vec2(c.x, (positive_1 ? c.z : -(c.z))), a.y);
    }
    bool positive_2 = (c.z > 0.0);
    return OnFace((positive_2 ? 4u : 5u), vec2((positive_2 ? c.x : -(c.x)), -(c.y)), a.z);
}

vec3 cube_point(uint face, vec2 at_1, float distance_) {
    switch(face) {
        case 0u: {
            return vec3(distance_, -(at_1.y), -(at_1.x));
        }
        case 1u: {
            return vec3(-(distance_), -(at_1.y), at_1.x);
        }
        case 2u: {
            return vec3(at_1.x, distance_, at_1.y);
        }
        case 3u: {
            return vec3(at_1.x, -(distance_), -(at_1.y));
        }
        case 4u: {
            return vec3(at_1.x, -(at_1.y), distance_);
        }
        default: {
            return vec3(-(at_1.x), -(at_1.y), -(distance_));
        }
    }
}

Texel cube_continued(uint edge, uint face_1, int column, int row) {
    bool local_2 = false;
    bool local_3 = false;
    bool local_4 = false;
    int last = (int(edge) - 1);
    if ((column >= 0)) {
        local_2 = (column <= last);
    } else {
        local_2 = false;
    }
    bool _e13 = local_2;
    if (_e13) {
        local_3 = (row >= 0);
    } else {
        local_3 = false;
    }
    bool _e19 = local_3;
    if (_e19) {
        local_4 = (row <= last);
    } else {
        local_4 = false;
    }
    bool _e24 = local_4;
    if (_e24) {
        return Texel(face_1, uint(column), uint(row));
    }
    vec2 at_5 = vec2(ivec2(((2 * column) - last), ((2 * row) - last)));
    vec3 _e37 = cube_point(face_1, at_5, float(edge));
    OnFace _e38 = cube_on_face(_e37);
    ivec2 whole_1 = min(max(((ivec2(_e38.at) + ivec2(last)) / ivec2(2)), ivec2(0)), ivec2(last));
    return Texel(_e38.face, uint(whole_1.x), uint(whole_1.y));
}

Taps cube_taps(uint edge_1, vec3 direction) {
    Taps taps = Taps(Texel[4](Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u)), vec4(0.0));
    bool local_5 = false;
    bool local_6 = false;
    bool local_7 = false;
    bool local_8 = false;
    OnFace _e7 = cube_on_face(vec3(-(direction.y), direction.z, direction.x));
    vec2 position = ((((_e7.at / vec2(_e7.distance_)) + vec2(1.0)) * (0.5 * float(edge_1))) - vec2(0.5));
    vec2 corner = floor(position);
    int left = int(corner.x);
    int top = int(corner.y);
    vec2 share = (position - corner);
    vec2 rest_1 = (vec2(1.0) - share);
    int last_1 = (int(edge_1) - 1);
    bvec4 inside = bvec4((left >= 0), (top >= 0), (left < last_1), (top < last_1));
    taps.weight = vec4((rest_1.x * rest_1.y), (share.x * rest_1.y), (rest_1.x * share.y), (share.x * share.y));
    if (all(inside)) {
        uint x = uint(left);
        uint y = uint(top);
        taps.texel[0] = Texel(_e7.face, x, y);
        taps.texel[1] = Texel(_e7.face, (x + 1u), y);
        taps.texel[2] = Texel(_e7.face, x, (y + 1u));
        taps.texel[3] = Texel(_e7.face, (x + 1u), (y + 1u));
        Taps _e83 = taps;
        return _e83;
    }
    Texel _e87 = cube_continued(edge_1, _e7.face, left, top);
    taps.texel[0] = _e87;
    Texel _e93 = cube_continued(edge_1, _e7.face, (left + 1), top);
    taps.texel[1] = _e93;
    Texel _e99 = cube_continued(edge_1, _e7.face, left, (top + 1));
    taps.texel[2] = _e99;
    Texel _e107 = cube_continued(edge_1, _e7.face, (left + 1), (top + 1));
    taps.texel[3] = _e107;
    bvec2 before = not(inside.xy);
    bvec2 past = not(inside.zw);
    if (before.x) {
        local_5 = before.y;
    } else {
        local_5 = false;
    }
    bool _e117 = local_5;
    if (past.x) {
        local_6 = before.y;
    } else {
        local_6 = false;
    }
    bool _e123 = local_6;
    if (before.x) {
        local_7 = past.y;
    } else {
        local_7 = false;
    }
    bool _e129 = local_7;
    if (past.x) {
        local_8 = past.y;
    } else {
        local_8 = false;
    }
    bool _e135 = local_8;
    bvec4 missing = bvec4(_e117, _e123, _e129, _e135);
    if (any(missing)) {
        vec4 _e141 = taps.weight;
        vec4 none = mix(vec4(0.0), _e141, missing);
        float third = ((((none.x + none.y) + none.z) + none.w) / 3.0);
        vec4 _e154 = taps.weight;
        taps.weight = mix((_e154 + vec4(third)), vec4(0.0), missing);
    }
    Taps _e160 = taps;
    return _e160;
}

vec3 cube_load(highp sampler2DArray map, Texel texel, uint first) {
    vec4 _e9 = texelFetch(map, ivec3(uvec2(texel.column, texel.row), (first + texel.face)), 0);
    return _e9.xyz;
}

vec3 cube_blend(highp sampler2DArray map_1, Taps taps_1, uint first_1) {
    vec3 sum = vec3(0.0);
    uint k = 0u;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e22 = k;
            k = (_e22 + 1u);
        }
        loop_init = false;
        uint _e8 = k;
        if ((_e8 < 4u)) {
        } else {
            break;
        }
        {
            vec3 _e11 = sum;
            uint _e13 = k;
            vec3 _e15 = cube_load(map_1, taps_1.texel[_e13], first_1);
            uint _e17 = k;
            sum = (_e11 + (_e15 * taps_1.weight[_e17]));
        }
    }
    vec3 _e24 = sum;
    return _e24;
}

vec3 develop_between(vec3 value, float most) {
    return mix(vec3(0.0), min(value, vec3(most)), greaterThan(value, vec3(0.0)));
}

vec3 develop(vec3 radiance, float gain, uint tone) {
    if ((tone == DEVELOP_PLAIN)) {
        vec3 _e7 = develop_between((radiance * gain), 1.0);
        return _e7;
    }
    vec3 _e12 = develop_between(((radiance * gain) * 1.46193), 1000000.0);
    vec3 v_1 = (DEVELOP_INTO_ACES * _e12);
    vec3 curved = (((v_1 * (v_1 + vec3(0.0245786))) - vec3(9.0537e-5)) / ((v_1 * ((0.983729 * v_1) + vec3(0.432951))) + vec3(0.238081)));
    vec3 _e35 = develop_between((DEVELOP_FROM_ACES * curved), 1.0);
    return _e35;
}

vec3 develop_encode(vec3 linear) {
    vec3 curve = ((1.055 * pow(max(linear, vec3(0.0031308)), vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * linear), lessThanEqual(linear, vec3(0.0031308)));
}

vec3 cabral(Surface surface_1) {
    vec3 points[12] = CABRAL_POINTS;
    uvec3 triangles[20] = CABRAL_TRIANGLES;
    uvec3 vertices = uvec3(0u);
    float most_1 = -4.0;
    uint triangle = 0u;
    vec3 v_2 = surface_1.view;
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            uint _e36 = triangle;
            triangle = (_e36 + 1u);
        }
        loop_init_1 = false;
        uint _e13 = triangle;
        if ((_e13 < 20u)) {
        } else {
            break;
        }
        {
            uint _e16 = triangle;
            uvec3 corners = triangles[_e16];
            vec3 _e21 = points[corners.x];
            vec3 _e25 = points[corners.y];
            vec3 _e30 = points[corners.z];
            float middle = ((dot(_e21, v_2) + dot(_e25, v_2)) + dot(_e30, v_2));
            float _e33 = most_1;
            if ((middle > _e33)) {
                vertices = corners;
                most_1 = middle;
            }
        }
    }
    uint _e39 = vertices.x;
    vec3 a_1 = points[_e39];
    uint _e43 = vertices.y;
    vec3 b = points[_e43];
    uint _e47 = vertices.z;
    vec3 c_1 = points[_e47];
    vec3 parts = max(vec3(dot(v_2, cross(b, c_1)), dot(v_2, cross(c_1, a_1)), dot(v_2, cross(a_1, b))), vec3(0.0));
    vec3 shares = (parts / vec3(((parts.x + parts.y) + parts.z)));
    uint _e69 = map_uniforms.edge;
    uint _e72 = map_uniforms.centre;
    vec3 _e73 = surface_central(surface_1, _e72);
    Taps _e74 = cube_taps(_e69, _e73);
    uint _e78 = vertices.x;
    vec3 _e80 = cube_blend(map, _e74, (6u * _e78));
    uint _e86 = vertices.y;
    vec3 _e88 = cube_blend(map, _e74, (6u * _e86));
    uint _e95 = vertices.z;
    vec3 _e97 = cube_blend(map, _e74, (6u * _e95));
    return (((_e80 * shares.x) + (_e88 * shares.y)) + (_e97 * shares.z));
}

vec3 shade_mode(Surface surface_2) {
    vec3 _e1 = cabral(surface_2);
    return _e1;
}

uint texture_texels_element(uint i) {
    uvec4 _e8 = texelFetch(texture_texels, ivec2(uvec2((i % 1024u), (i / 1024u))), 0);
    return _e8.x;
}

vec3 texture_decode(vec3 encoded) {
    vec3 curve_1 = pow(((max(encoded, vec3(0.04045)) + vec3(0.055)) / vec3(1.055)), vec3(2.4));
    return mix(curve_1, (encoded / vec3(12.92)), lessThanEqual(encoded, vec3(0.04045)));
}

uint texture_wrapped(int index, int count, uint wrap) {
    if ((wrap == TEXTURE_CLAMP)) {
        return uint(min(max(index, 0), (count - 1)));
    }
    int period = ((wrap == TEXTURE_MIRROR) ? (2 * count) : count);
    int inside_1 = (((index % period) + period) % period);
    return uint(min(inside_1, ((wrap == TEXTURE_MIRROR) ? ((period - 1) - inside_1) : inside_1)));
}

vec3 texture_texel(uvec4 level, int column_1, int row_1) {
    uint _e8 = texture_uniforms.wrap.x;
    uint _e9 = texture_wrapped(column_1, int(level.y), _e8);
    uint _e15 = texture_uniforms.wrap.y;
    uint _e16 = texture_wrapped(row_1, int(level.z), _e15);
    uint _e22 = texture_texels_element(((level.x + (_e16 * level.y)) + _e9));
    vec3 _e25 = texture_decode((vec4(_e22 & 0xFFu, _e22 >> 8 & 0xFFu, _e22 >> 16 & 0xFFu, _e22 >> 24) / 255.0).xyz);
    return _e25;
}

vec3 texture_level(uvec4 level_1, vec2 at_2, bool nearest) {
    vec2 place = (at_2 * vec2(level_1.yz));
    if (nearest) {
        ivec2 first_2 = ivec2(floor(place));
        vec3 _e10 = texture_uniforms.factor;
        vec3 _e13 = texture_texel(level_1, first_2.x, first_2.y);
        return (_e10 * _e13);
    }
    vec2 middle_1 = (place - vec2(0.5));
    vec2 floored = floor(middle_1);
    vec2 share_1 = (middle_1 - floored);
    ivec2 first_3 = ivec2(floored);
    ivec2 next = (first_3 + ivec2(1));
    vec3 _e26 = texture_uniforms.factor;
    vec3 _e29 = texture_texel(level_1, first_3.x, first_3.y);
    vec3 _e32 = texture_texel(level_1, next.x, first_3.y);
    vec3 _e37 = texture_texel(level_1, first_3.x, next.y);
    vec3 _e40 = texture_texel(level_1, next.x, next.y);
    return (_e26 * mix(mix(_e29, _e32, share_1.x), mix(_e37, _e40, share_1.x), share_1.y));
}

vec3 texture_color(vec2 at_3, vec2 across, vec2 down) {
    float level_2 = 0.0;
    bool local_9 = false;
    uvec4 _e6 = texture_uniforms.levels[0];
    vec2 size = vec2(_e6.yz);
    float square_2 = max(dot((across * size), (across * size)), dot((down * size), (down * size)));
    uint _e18 = texture_uniforms.count;
    uint most_2 = (_e18 - 1u);
    if ((square_2 > 1.0)) {
        level_2 = (0.5 * log2(square_2));
    }
    float _e28 = level_2;
    if ((_e28 == 0.0)) {
        uvec4 _e34 = texture_uniforms.levels[0];
        uint _e37 = texture_uniforms.nearest;
        if ((_e37 == 1u)) {
            local_9 = (most_2 > 0u);
        } else {
            local_9 = false;
        }
        bool _e45 = local_9;
        vec3 _e46 = texture_level(_e34, at_3, _e45);
        return _e46;
    }
    float _e47 = level_2;
    if ((_e47 >= float(most_2))) {
        uvec4 _e53 = texture_uniforms.levels[most_2];
        vec3 _e55 = texture_level(_e53, at_3, false);
        return _e55;
    }
    float _e56 = level_2;
    uint fine = uint(_e56);
    uvec4 _e61 = texture_uniforms.levels[fine];
    vec3 _e63 = texture_level(_e61, at_3, false);
    uvec4 _e69 = texture_uniforms.levels[(fine + 1u)];
    vec3 _e71 = texture_level(_e69, at_3, false);
    float _e72 = level_2;
    return mix(_e63, _e71, (_e72 - float(fine)));
}

vec3 texture_at_fragment(vec2 coordinates, float nearness, float samples) {
    vec2 sum_1 = (coordinates * nearness);
    float scale = (1.0 / (nearness * samples));
    vec2 _e7 = dFdx(sum_1);
    float _e8 = dFdx(nearness);
    vec2 across_1 = ((_e7 - (coordinates * _e8)) * scale);
    vec2 _e12 = dFdy(sum_1);
    float _e13 = dFdy(nearness);
    vec2 down_1 = ((_e12 - (coordinates * _e13)) * scale);
    vec3 _e17 = texture_color(coordinates, across_1, down_1);
    return _e17;
}

vec4 base_color_number(uint column_2, uint row_2) {
    vec4 _e5 = texelFetch(base_color_numbers, ivec2(uvec2(column_2, row_2)), 0);
    return _e5;
}

vec3 base_color_several(vec3 color, float whole) {
    vec3 average = (color + ((vec3(1.0) - color) / vec3(21.0)));
    return (((average * average) * whole) / (vec3(1.0) - (average * (1.0 - whole))));
}

vec3 base_color(uint row_3, vec3 color_1, vec3 radiance_1, Surface surface_3) {
    vec3 light = vec3(0.0);
    uint nodes = ((uvec2(textureSize(base_color_numbers, 0).xy).x - BASE_COLOR_NUMBERS) / 2u);
    float place_1 = (sqrt(clamp(dot(surface_3.normal, surface_3.view), 0.0, 1.0)) * float((nodes - 1u)));
    uint node = min(uint(place_1), (nodes - 2u));
    uint column_3 = (BASE_COLOR_NUMBERS + (2u * node));
    float share_2 = (place_1 - float(node));
    vec4 _e32 = base_color_number(column_3, row_3);
    vec4 _e35 = base_color_number((column_3 + 2u), row_3);
    vec4 facets = mix(_e32, _e35, share_2);
    vec4 _e39 = base_color_number((column_3 + 1u), row_3);
    vec4 _e42 = base_color_number((column_3 + 3u), row_3);
    vec4 layers = mix(_e39, _e42, share_2);
    vec3 n_1 = surface_3.normal;
    vec4 _e46 = base_color_number(0u, row_3);
    light = _e46.xyz;
    vec3 _e49 = light;
    vec4 _e51 = base_color_number(1u, row_3);
    light = (_e49 + (_e51.xyz * n_1.y));
    vec3 _e56 = light;
    vec4 _e58 = base_color_number(2u, row_3);
    light = (_e56 + (_e58.xyz * n_1.z));
    vec3 _e63 = light;
    vec4 _e65 = base_color_number(3u, row_3);
    light = (_e63 + (_e65.xyz * n_1.x));
    vec3 _e70 = light;
    vec4 _e72 = base_color_number(4u, row_3);
    light = (_e70 + (_e72.xyz * (n_1.x * n_1.y)));
    vec3 _e79 = light;
    vec4 _e81 = base_color_number(5u, row_3);
    light = (_e79 + (_e81.xyz * (n_1.y * n_1.z)));
    vec3 _e88 = light;
    vec4 _e90 = base_color_number(6u, row_3);
    light = (_e88 + (_e90.xyz * (((3.0 * n_1.z) * n_1.z) - 1.0)));
    vec3 _e101 = light;
    vec4 _e103 = base_color_number(7u, row_3);
    light = (_e101 + (_e103.xyz * (n_1.x * n_1.z)));
    vec3 _e110 = light;
    vec4 _e112 = base_color_number(8u, row_3);
    light = (_e110 + (_e112.xyz * ((n_1.x * n_1.x) - (n_1.y * n_1.y))));
    vec4 _e124 = base_color_number(9u, row_3);
    vec3 _e125 = light;
    vec3 matte = (max(_e125, vec3(0.0)) * (facets.x * (1.0 - _e124.w)));
    vec4 _e136 = base_color_number(10u, row_3);
    vec4 _e138 = base_color_number(11u, row_3);
    vec4 _e140 = base_color_number(12u, row_3);
    vec3 several = _e140.xyz;
    vec3 beside = (((_e138.xyz * layers.y) + vec3(layers.x)) + vec3((_e136.w * facets.w)));
    vec3 _e162 = base_color_several(_e124.xyz, _e138.w);
    vec3 of_mean = ((beside + (mix(_e136.xyz, _e124.xyz, _e124.w) * facets.z)) + (mix(several, _e162, _e124.w) * facets.y));
    vec3 _e175 = base_color_several(color_1, _e138.w);
    vec3 of_color = ((beside + (mix(_e136.xyz, color_1, _e124.w) * facets.z)) + (mix(several, _e175, _e124.w) * facets.y));
    vec3 base = (_e124.xyz * matte);
    vec3 rest_2 = max((radiance_1 - base), vec3(0.0));
    vec3 whole_2 = (base + rest_2);
    vec3 ratio = mix(vec3(1.0), (of_color / max(of_mean, vec3(1e-30))), greaterThan(of_mean, vec3(0.0)));
    vec3 scale_1 = (((color_1 * matte) + (rest_2 * ratio)) / max(whole_2, vec3(1e-30)));
    return mix(radiance_1, (radiance_1 * scale_1), greaterThan(whole_2, vec3(0.0)));
}

vec3 mesh_radiance(PageVertex at_4, Surface surface_4, vec3 radiance_2) {
    vec3 _e7 = texture_at_fragment(at_4.coordinates, at_4.position.w, 1.0);
    vec3 _e9 = base_color(0u, _e7, radiance_2, surface_4);
    return _e9;
}

vec4 page_shown(vec3 radiance_3) {
    uint _e3 = page.raw;
    if ((_e3 == 1u)) {
        return vec4(radiance_3, 1.0);
    }
    float _e10 = page.gain;
    uint _e13 = page.tone;
    vec3 _e14 = develop(radiance_3, _e10, _e13);
    vec3 _e15 = develop_encode(_e14);
    return vec4(_e15, 1.0);
}

void main() {
    bool front = gl_FrontFacing;
    PageVertex at = PageVertex(gl_FragCoord, _vs2fs_location0, _vs2fs_location1, _vs2fs_location2, _vs2fs_location3);
    Surface _e5 = surface_new(at.normal, at.tangent, at.ray, front);
    vec3 _e6 = shade_mode(_e5);
    vec3 _e7 = mesh_radiance(at, _e5, _e6);
    vec4 _e8 = page_shown(_e7);
    _fs2p_location0 = _e8;
    return;
}

