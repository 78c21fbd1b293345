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
const uint BACKGROUND_LAT_LONG = 0u;
const uint BACKGROUND_CUBE = 1u;
const uint BACKGROUND_FLAT = 2u;

layout(std140) uniform map_uniforms_block { MapUniforms map_uniforms; };

uniform highp sampler2DArray map;

layout(std140) uniform page_block { PageUniforms page; };

smooth in vec3 _vs2fs_location0;
smooth in vec3 _vs2fs_location1;
smooth in vec3 _vs2fs_location2;
smooth in vec2 _vs2fs_location3;
layout(location = 0) out vec4 _fs2p_location0;

float angles_angle(float y, float x) {
    float low = min(abs(x), abs(y));
    float high = max(abs(x), abs(y));
    if ((high == 0.0)) {
        return 0.0;
    }
    bool is_far = (low > (0.41421357 * high));
    float t = ((is_far ? (low - high) : low) / (is_far ? (low + high) : high));
    float z = (t * t);
    float series = (-0.3333295 + (z * (0.1997771 + (z * (-0.13877685 + (z * 0.08053745))))));
    float small = ((t + ((t * z) * series)) + (is_far ? 0.7853982 : 0.0));
    float right = ((abs(y) > abs(x)) ? (1.5707964 - small) : small);
    float upper = ((x < 0.0) ? (3.1415927 - right) : right);
    return ((y < 0.0) ? -(upper) : upper);
}

OnFace cube_on_face(vec3 c) {
    bool local = false;
    vec3 a = abs(c);
    if ((a.x >= a.y)) {
        local = (a.x >= a.z);
    } else {
        local = false;
    }
    bool _e11 = local;
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
    bool local_1 = false;
    bool local_2 = false;
    bool local_3 = false;
    int last = (int(edge) - 1);
    if ((column >= 0)) {
        local_1 = (column <= last);
    } else {
        local_1 = false;
    }
    bool _e13 = local_1;
    if (_e13) {
        local_2 = (row >= 0);
    } else {
        local_2 = false;
    }
    bool _e19 = local_2;
    if (_e19) {
        local_3 = (row <= last);
    } else {
        local_3 = false;
    }
    bool _e24 = local_3;
    if (_e24) {
        return Texel(face_1, uint(column), uint(row));
    }
    vec2 at_2 = vec2(ivec2(((2 * column) - last), ((2 * row) - last)));
    vec3 _e37 = cube_point(face_1, at_2, float(edge));
    OnFace _e38 = cube_on_face(_e37);
    ivec2 whole = min(max(((ivec2(_e38.at) + ivec2(last)) / ivec2(2)), ivec2(0)), ivec2(last));
    return Texel(_e38.face, uint(whole.x), uint(whole.y));
}

Taps cube_taps(uint edge_1, vec3 direction) {
    Taps taps = Taps(Texel[4](Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u)), vec4(0.0));
    bool local_4 = false;
    bool local_5 = false;
    bool local_6 = false;
    bool local_7 = false;
    OnFace _e7 = cube_on_face(vec3(-(direction.y), direction.z, direction.x));
    vec2 position = ((((_e7.at / vec2(_e7.distance_)) + vec2(1.0)) * (0.5 * float(edge_1))) - vec2(0.5));
    vec2 corner = floor(position);
    int left = int(corner.x);
    int top = int(corner.y);
    vec2 share = (position - corner);
    vec2 rest = (vec2(1.0) - share);
    int last_1 = (int(edge_1) - 1);
    bvec4 inside = bvec4((left >= 0), (top >= 0), (left < last_1), (top < last_1));
    taps.weight = vec4((rest.x * rest.y), (share.x * rest.y), (rest.x * share.y), (share.x * share.y));
    if (all(inside)) {
        uint x_1 = uint(left);
        uint y_1 = uint(top);
        taps.texel[0] = Texel(_e7.face, x_1, y_1);
        taps.texel[1] = Texel(_e7.face, (x_1 + 1u), y_1);
        taps.texel[2] = Texel(_e7.face, x_1, (y_1 + 1u));
        taps.texel[3] = Texel(_e7.face, (x_1 + 1u), (y_1 + 1u));
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
        local_4 = before.y;
    } else {
        local_4 = false;
    }
    bool _e117 = local_4;
    if (past.x) {
        local_5 = before.y;
    } else {
        local_5 = false;
    }
    bool _e123 = local_5;
    if (before.x) {
        local_6 = past.y;
    } else {
        local_6 = false;
    }
    bool _e129 = local_6;
    if (past.x) {
        local_7 = past.y;
    } else {
        local_7 = false;
    }
    bool _e135 = local_7;
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

vec3 lat_long_sample(highp sampler2DArray map_2, vec3 direction_1) {
    vec3 sum_1 = vec3(0.0);
    int k_1 = 0;
    bool local_8 = false;
    ivec2 size = ivec2(uvec2(textureSize(map_2, 0).xy));
    float _e6 = angles_angle(direction_1.y, direction_1.x);
    float _e10 = angles_angle(length(direction_1.xy), direction_1.z);
    float x_2 = (((0.5 - (_e6 / 6.2831855)) * float(size.x)) - 0.5);
    float y_2 = (((_e10 / 3.1415927) * float(size.y)) - 0.5);
    float top_1 = floor(y_2);
    float lower = (y_2 - top_1);
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            int _e98 = k_1;
            k_1 = (_e98 + 1);
        }
        loop_init_1 = false;
        int _e34 = k_1;
        if ((_e34 < 2)) {
        } else {
            break;
        }
        {
            int _e38 = k_1;
            int row_1 = (int(top_1) + _e38);
            if (!((row_1 < 0))) {
                local_8 = (row_1 >= size.y);
            } else {
                local_8 = true;
            }
            bool past_1 = local_8;
            float across = (past_1 ? (x_2 + (0.5 * float(size.x))) : x_2);
            float left_1 = floor(across);
            float share_1 = (across - left_1);
            int column_1 = ((int(left_1) + size.x) % size.x);
            int next = ((column_1 + 1) % size.x);
            int inside_1 = min(max(row_1, 0), (size.y - 1));
            int _e73 = k_1;
            float weight = ((_e73 == 0) ? (1.0 - lower) : lower);
            vec3 _e77 = sum_1;
            vec4 _e81 = texelFetch(map_2, ivec3(ivec2(column_1, inside_1), 0), 0);
            sum_1 = (_e77 + (_e81.xyz * ((1.0 - share_1) * weight)));
            vec3 _e88 = sum_1;
            vec4 _e92 = texelFetch(map_2, ivec3(ivec2(next, inside_1), 0), 0);
            sum_1 = (_e88 + (_e92.xyz * (share_1 * weight)));
        }
    }
    vec3 _e100 = sum_1;
    return _e100;
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
    vec3 v = (DEVELOP_INTO_ACES * _e12);
    vec3 curved = (((v * (v + vec3(0.0245786))) - vec3(9.0537e-5)) / ((v * ((0.983729 * v) + vec3(0.432951))) + vec3(0.238081)));
    vec3 _e35 = develop_between((DEVELOP_FROM_ACES * curved), 1.0);
    return _e35;
}

vec3 develop_encode(vec3 linear) {
    vec3 curve = ((1.055 * pow(max(linear, vec3(0.0031308)), vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * linear), lessThanEqual(linear, vec3(0.0031308)));
}

vec3 background(uint kind, vec3 flat_radiance, vec3 ray) {
    switch(kind) {
        case 0u: {
            vec3 _e4 = lat_long_sample(map, ray);
            return _e4;
        }
        case 1u: {
            uint _e8 = map_uniforms.edge;
            Taps _e9 = cube_taps(_e8, ray);
            vec3 _e11 = cube_blend(map, _e9, 0u);
            return _e11;
        }
        default: {
            return flat_radiance;
        }
    }
}

vec4 page_shown(vec3 radiance_1) {
    uint _e3 = page.raw;
    if ((_e3 == 1u)) {
        return vec4(radiance_1, 1.0);
    }
    float _e10 = page.gain;
    uint _e13 = page.tone;
    vec3 _e14 = develop(radiance_1, _e10, _e13);
    vec3 _e15 = develop_encode(_e14);
    return vec4(_e15, 1.0);
}

void main() {
    PageVertex at = PageVertex(gl_FragCoord, _vs2fs_location0, _vs2fs_location1, _vs2fs_location2, _vs2fs_location3);
    vec3 _e5 = background(BACKGROUND_LAT_LONG, vec3(0.0), at.ray);
    vec4 _e6 = page_shown(_e5);
    _fs2p_location0 = _e6;
    return;
}

