precision highp float;
precision highp int;
struct MapPart {
    uint centre;
    uint edge;
    uint degree;
    uint zonal;
    uint slices;
    uint first;
    float weight;
    uint unused;
};
struct MapUniforms {
    MapPart parts[2];
    uint count;
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
struct Half {
    bool seen;
    vec3 sum;
    float length_squared;
    float across;
    float light;
    float view;
    float facet;
    float turn;
};
struct Cylinder {
    float phi;
    float cosine;
    vec2 arc;
    vec2 ground;
};
struct TextureUniforms {
    vec3 factor;
    uint nearest;
    uvec2 wrap;
    uint count;
    uvec4 levels[11];
};
struct TurnedAngles {
    vec2 alpha;
    vec2 beta;
    vec2 gamma;
};
struct TableUniforms {
    uint size;
    uint rows;
    uint channels;
    uint mirrored;
    uint light_rows;
    uint along;
    uint across;
};
struct TablePoint {
    vec2 place;
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
const float MATERIAL_NEAR = 0.1;
const float MATERIAL_TINY = 1e-30;
const float MATERIAL_HORIZON = 1e-12;
const float MATERIAL_OPPOSITE = 1e-20;
const float MATERIAL_GRAZING = 0.0001;
const float MATERIAL_STEEP = 80.0;
const float MATERIAL_MIN_COSINE = 0.001;
const uint TEXTURE_REPEAT = 0u;
const uint TEXTURE_MIRROR = 1u;
const uint TEXTURE_CLAMP = 2u;
const uint BASE_COLOR_NUMBERS = 13u;
const uint TURNED_WIDTH = 29u;
const uint BACKGROUND_LAT_LONG = 0u;
const uint BACKGROUND_CUBE = 1u;
const uint BACKGROUND_FLAT = 2u;
const vec3 CABRAL_POINTS[12] = vec3[12](vec3(0.0, 0.0, 1.0), vec3(0.8944272, 0.0, 0.4472136), vec3(0.2763932, 0.8506508, 0.4472136), vec3(-0.7236068, 0.5257311, 0.4472136), vec3(-0.7236068, -0.5257311, 0.4472136), vec3(0.2763932, -0.8506508, 0.4472136), vec3(0.7236068, 0.5257311, -0.4472136), vec3(-0.2763932, 0.8506508, -0.4472136), vec3(-0.8944272, 0.0, -0.4472136), vec3(-0.2763932, -0.8506508, -0.4472136), vec3(0.7236068, -0.5257311, -0.4472136), vec3(0.0, 0.0, -1.0));
const uvec3 CABRAL_TRIANGLES[20] = uvec3[20](uvec3(0u, 1u, 2u), uvec3(0u, 2u, 3u), uvec3(0u, 3u, 4u), uvec3(0u, 4u, 5u), uvec3(0u, 5u, 1u), uvec3(1u, 6u, 2u), uvec3(2u, 7u, 3u), uvec3(3u, 8u, 4u), uvec3(4u, 9u, 5u), uvec3(5u, 10u, 1u), uvec3(6u, 7u, 2u), uvec3(7u, 8u, 3u), uvec3(8u, 9u, 4u), uvec3(9u, 10u, 5u), uvec3(10u, 6u, 1u), uvec3(11u, 7u, 6u), uvec3(11u, 8u, 7u), uvec3(11u, 9u, 8u), uvec3(11u, 10u, 9u), uvec3(11u, 6u, 10u));
#if defined(MODE_CABRAL) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(SHOWS_SKY)
layout(std140) uniform map_uniforms_block { MapUniforms map_uniforms; };
#endif
#if defined(MODE_CABRAL) || defined(MODE_IRRADIANCE) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_LOCAL_SHRM) || defined(MODE_MIRROR) || defined(MODE_PREFILTERED) || defined(SHOWS_SKY)
uniform highp sampler2DArray map;
#endif
#if defined(MODE_IRRADIANCE) || defined(MODE_LOCAL_SHRM)
#ifdef HARMONICS_CONSTANTS_VECTORS
layout(std140) uniform harmonics_constants_block { vec4 harmonics_constants[HARMONICS_CONSTANTS_VECTORS]; };
#else
uniform highp sampler2D harmonics_constants;
#endif
#endif
#if defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(MODE_TABLE) || defined(MODE_TAPS)
#ifdef MATERIAL_VECTORS
layout(std140) uniform material_block { uvec4 material[MATERIAL_VECTORS]; };
#else
uniform highp usampler2D material;
#endif
#ifdef LAMPS_VECTORS
layout(std140) uniform lamps_block { vec4 lamps[LAMPS_VECTORS]; };
#else
uniform highp sampler2D lamps;
#endif
#endif
#if defined(TEXTURED)
layout(std140) uniform texture_uniforms_block { TextureUniforms texture_uniforms; };
uniform highp usampler2D texture_texels;
uniform highp sampler2D base_color_numbers;
#endif
#if defined(MODE_TABLE)
#ifdef QUARTER_TURNS_VECTORS
layout(std140) uniform quarter_turns_block { vec4 quarter_turns[QUARTER_TURNS_VECTORS]; };
#else
uniform highp sampler2D quarter_turns;
#endif
uniform highp sampler2DArray table_map;
#ifdef TABLE_LIGHT_VECTORS
layout(std140) uniform table_light_block { vec4 table_light[TABLE_LIGHT_VECTORS]; };
#else
uniform highp sampler2D table_light;
#endif
layout(std140) uniform table_uniforms_block { TableUniforms table_uniforms; };
#endif
#if defined(SHOWS_DIFFERENCE)
uniform highp sampler2D first_picture;
uniform highp sampler2D second_picture;
#endif
#if defined(SHOWS_DIFFERENCE) || defined(SHOWS_MESH) || defined(SHOWS_SKY)
layout(std140) uniform page_block { PageUniforms page; };
#endif
smooth in vec3 _vs2fs_location0;
smooth in vec3 _vs2fs_location1;
smooth in vec3 _vs2fs_location2;
smooth in vec2 _vs2fs_location3;
layout(location = 0) out vec4 _fs2p_location0;
#if defined(MODEL_10)
vec2 angles_circle(float turn) {
    float quarters = floor(((4.0 * turn) + 0.5));
    float x_7 = ((turn - (0.25 * quarters)) * 6.2831855);
    float z_1 = (x_7 * x_7);
    float sine_2 = (x_7 + ((x_7 * z_1) * (-0.16666655 + (z_1 * (0.008332161 - (z_1 * 0.00019515296))))));
    float cosine_9 = ((1.0 - (0.5 * z_1)) + ((z_1 * z_1) * (0.041666646 + (z_1 * (-0.0013887316 + (z_1 * 2.4433159e-5))))));
    switch((int(quarters) & 3)) {
        case 0: {
            return vec2(cosine_9, sine_2);
        }
        case 1: {
            return vec2(-(sine_2), cosine_9);
        }
        case 2: {
            return vec2(-(cosine_9), -(sine_2));
        }
        default: {
            return vec2(sine_2, -(cosine_9));
        }
    }
}
#endif
#if defined(MODEL_10) || defined(MODEL_13) || defined(MODEL_14) || defined(MODEL_5) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_MIRROR) || defined(SHOWS_SKY)
float angles_angle(float y, float x) {
    float low = min(abs(x), abs(y));
    float high = max(abs(x), abs(y));
    if ((high == 0.0)) {
        return 0.0;
    }
    bool is_far = (low > (0.41421357 * high));
    float t_1 = ((is_far ? (low - high) : low) / (is_far ? (low + high) : high));
    float z_2 = (t_1 * t_1);
    float series_1 = (-0.3333295 + (z_2 * (0.1997771 + (z_2 * (-0.13877685 + (z_2 * 0.08053745))))));
    float small = ((t_1 + ((t_1 * z_2) * series_1)) + (is_far ? 0.7853982 : 0.0));
    float right = ((abs(y) > abs(x)) ? (1.5707964 - small) : small);
    float upper = ((x < 0.0) ? (3.1415927 - right) : right);
    return ((y < 0.0) ? -(upper) : upper);
}
#endif
#if defined(SHOWS_MESH)
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
    vec3 view_22 = -(normalize(ray));
    vec3 _e8 = surface_unit_or((front_1 ? normal_1 : -(normal_1)), view_22);
    n = _e8;
    vec3 _e10 = n;
    float cosine_10 = dot(_e10, view_22);
    if ((cosine_10 < 0.001)) {
        vec3 _e14 = n;
        n = normalize((_e14 + (view_22 * (0.001 - cosine_10))));
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
        return Surface(_e37, _e39, view_22);
    }
    vec3 _e41 = n;
    return Surface(_e41, (rest / vec3(sqrt(square_1))), view_22);
}
#endif
#if defined(MODE_CABRAL) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_LOCAL_SHRM) || defined(MODE_MIRROR) || defined(MODE_PREFILTERED)
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
#endif
#if defined(MODE_CABRAL) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(SHOWS_SKY)
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
#endif
#if defined(MODE_LOCAL_SHRM)
vec3 cube_centre(uint edge, Texel texel) {
    vec2 at_102 = (vec2(uvec2(((2u * texel.column) + 1u), ((2u * texel.row) + 1u))) - vec2(float(edge)));
    vec3 _e19 = cube_point(texel.face, at_102, float(edge));
    return vec3(_e19.z, -(_e19.x), _e19.y);
}
#endif
#if defined(MODE_CABRAL) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(SHOWS_SKY)
Texel cube_continued(uint edge_1, uint face_1, int column, int row) {
    bool local_2 = false;
    bool local_3 = false;
    bool local_4 = false;
    int last = (int(edge_1) - 1);
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
    vec2 at_103 = vec2(ivec2(((2 * column) - last), ((2 * row) - last)));
    vec3 _e37 = cube_point(face_1, at_103, float(edge_1));
    OnFace _e38 = cube_on_face(_e37);
    ivec2 whole_1 = min(max(((ivec2(_e38.at) + ivec2(last)) / ivec2(2)), ivec2(0)), ivec2(last));
    return Texel(_e38.face, uint(whole_1.x), uint(whole_1.y));
}
Taps cube_taps(uint edge_2, vec3 direction) {
    Taps taps = Taps(Texel[4](Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u), Texel(0u, 0u, 0u)), vec4(0.0));
    bool local_5 = false;
    bool local_6 = false;
    bool local_7 = false;
    bool local_8 = false;
    OnFace _e7 = cube_on_face(vec3(-(direction.y), direction.z, direction.x));
    vec2 position = ((((_e7.at / vec2(_e7.distance_)) + vec2(1.0)) * (0.5 * float(edge_2))) - vec2(0.5));
    vec2 corner_1 = floor(position);
    int left = int(corner_1.x);
    int top = int(corner_1.y);
    vec2 share_2 = (position - corner_1);
    vec2 rest_1 = (vec2(1.0) - share_2);
    int last_1 = (int(edge_2) - 1);
    bvec4 inside = bvec4((left >= 0), (top >= 0), (left < last_1), (top < last_1));
    taps.weight = vec4((rest_1.x * rest_1.y), (share_2.x * rest_1.y), (rest_1.x * share_2.y), (share_2.x * share_2.y));
    if (all(inside)) {
        uint x_8 = uint(left);
        uint y_2 = uint(top);
        taps.texel[0] = Texel(_e7.face, x_8, y_2);
        taps.texel[1] = Texel(_e7.face, (x_8 + 1u), y_2);
        taps.texel[2] = Texel(_e7.face, x_8, (y_2 + 1u));
        taps.texel[3] = Texel(_e7.face, (x_8 + 1u), (y_2 + 1u));
        Taps _e83 = taps;
        return _e83;
    }
    Texel _e87 = cube_continued(edge_2, _e7.face, left, top);
    taps.texel[0] = _e87;
    Texel _e93 = cube_continued(edge_2, _e7.face, (left + 1), top);
    taps.texel[1] = _e93;
    Texel _e99 = cube_continued(edge_2, _e7.face, left, (top + 1));
    taps.texel[2] = _e99;
    Texel _e107 = cube_continued(edge_2, _e7.face, (left + 1), (top + 1));
    taps.texel[3] = _e107;
    bvec2 before_1 = not(inside.xy);
    bvec2 past = not(inside.zw);
    if (before_1.x) {
        local_5 = before_1.y;
    } else {
        local_5 = false;
    }
    bool _e117 = local_5;
    if (past.x) {
        local_6 = before_1.y;
    } else {
        local_6 = false;
    }
    bool _e123 = local_6;
    if (before_1.x) {
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
vec3 cube_load(highp sampler2DArray map, Texel texel_1, uint first) {
    vec4 _e9 = texelFetch(map, ivec3(uvec2(texel_1.column, texel_1.row), (first + texel_1.face)), 0);
    return _e9.xyz;
}
#endif
#if defined(MODE_CABRAL) || defined(MODE_KAUTZ_MCCOOL) || defined(MODE_PREFILTERED) || defined(SHOWS_SKY)
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
#endif
#if defined(MODE_MIRROR) || defined(SHOWS_SKY)
vec3 lat_long_sample(highp sampler2DArray map_2, vec3 direction_1) {
    vec3 sum_1 = vec3(0.0);
    int k_1 = 0;
    bool local_9 = false;
    ivec2 size = ivec2(uvec2(textureSize(map_2, 0).xy));
    float _e6 = angles_angle(direction_1.y, direction_1.x);
    float _e10 = angles_angle(length(direction_1.xy), direction_1.z);
    float x_9 = (((0.5 - (_e6 / 6.2831855)) * float(size.x)) - 0.5);
    float y_3 = (((_e10 / 3.1415927) * float(size.y)) - 0.5);
    float top_1 = floor(y_3);
    float lower = (y_3 - top_1);
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
            int row_11 = (int(top_1) + _e38);
            if (!((row_11 < 0))) {
                local_9 = (row_11 >= size.y);
            } else {
                local_9 = true;
            }
            bool past_1 = local_9;
            float across_2 = (past_1 ? (x_9 + (0.5 * float(size.x))) : x_9);
            float left_1 = floor(across_2);
            float share_3 = (across_2 - left_1);
            int column_3 = ((int(left_1) + size.x) % size.x);
            int next = ((column_3 + 1) % size.x);
            int inside_1 = min(max(row_11, 0), (size.y - 1));
            int _e73 = k_1;
            float weight = ((_e73 == 0) ? (1.0 - lower) : lower);
            vec3 _e77 = sum_1;
            vec4 _e81 = texelFetch(map_2, ivec3(ivec2(column_3, inside_1), 0), 0);
            sum_1 = (_e77 + (_e81.xyz * ((1.0 - share_3) * weight)));
            vec3 _e88 = sum_1;
            vec4 _e92 = texelFetch(map_2, ivec3(ivec2(next, inside_1), 0), 0);
            sum_1 = (_e88 + (_e92.xyz * (share_3 * weight)));
        }
    }
    vec3 _e100 = sum_1;
    return _e100;
}
#endif
#if defined(SHOWS_DIFFERENCE) || defined(SHOWS_MESH) || defined(SHOWS_SKY)
vec3 develop_between(vec3 value, float most) {
    return mix(vec3(0.0), min(value, vec3(most)), greaterThan(value, vec3(0.0)));
}
vec3 develop(vec3 radiance, float gain, uint tone) {
    if ((tone == DEVELOP_PLAIN)) {
        vec3 _e7 = develop_between((radiance * gain), 1.0);
        return _e7;
    }
    vec3 _e12 = develop_between(((radiance * gain) * 1.46193), 1000000.0);
    vec3 v_2 = (DEVELOP_INTO_ACES * _e12);
    vec3 curved = (((v_2 * (v_2 + vec3(0.0245786))) - vec3(9.0537e-5)) / ((v_2 * ((0.983729 * v_2) + vec3(0.432951))) + vec3(0.238081)));
    vec3 _e35 = develop_between((DEVELOP_FROM_ACES * curved), 1.0);
    return _e35;
}
vec3 develop_encode(vec3 linear) {
    vec3 curve = ((1.055 * pow(max(linear, vec3(0.0031308)), vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * linear), lessThanEqual(linear, vec3(0.0031308)));
}
#endif
#if defined(MODE_IRRADIANCE) || defined(MODE_LOCAL_SHRM)
vec2 harmonics_constants_element(uint i) {
#ifdef HARMONICS_CONSTANTS_VECTORS
    vec4 _e8 = harmonics_constants[i];
#else
    vec4 _e8 = texelFetch(harmonics_constants, ivec2(uvec2((i % 1024u), (i / 1024u))), 0);
#endif
    return _e8.xy;
}
vec2 harmonics_constant(uint p, uint q) {
    vec2 _e8 = harmonics_constants_element((((p * (p + 1u)) / 2u) + q));
    return _e8;
}
#endif
#if defined(MODEL_10)
float material_one_less_sinc(float x_1) {
    if ((x_1 >= 1.0)) {
        vec2 _e5 = angles_circle((x_1 / 6.2831855));
        return (1.0 - (_e5.y / x_1));
    }
    float x2_ = (x_1 * x_1);
    return ((x2_ / 6.0) * (1.0 - ((x2_ / 20.0) * (1.0 - ((x2_ / 42.0) * (1.0 - (x2_ / 72.0)))))));
}
#endif
#if defined(MODEL_0) || defined(MODEL_10) || defined(MODEL_4) || defined(MODEL_6) || defined(MODEL_7) || defined(MODEL_8) || defined(MODEL_9)
Half material_half(vec3 light, vec3 view) {
    bool local_10 = false;
    bool local_11 = false;
    vec3 sum_14 = (light + view);
    float length_squared = dot(sum_14, sum_14);
    if ((light.z > MATERIAL_HORIZON)) {
        local_10 = (sum_14.z > MATERIAL_HORIZON);
    } else {
        local_10 = false;
    }
    bool _e13 = local_10;
    if (_e13) {
        local_11 = (length_squared > MATERIAL_OPPOSITE);
    } else {
        local_11 = false;
    }
    bool seen = local_11;
    float across_3 = ((sum_14.x * sum_14.x) + (sum_14.y * sum_14.y));
    vec3 difference_1 = (light - view);
    float turn_2 = (0.25 * dot(difference_1, difference_1));
    float facet = (0.5 * sqrt(length_squared));
    return Half(seen, sum_14, length_squared, across_3, light.z, max(view.z, 0.0), facet, turn_2);
}
#endif
#if defined(MODEL_0)
float material_facets(float alpha2_, Half half_vector) {
    float sum_z = half_vector.sum.z;
    float across_4 = ((half_vector.across + ((alpha2_ * sum_z) * sum_z)) / half_vector.length_squared);
    float cos_i = half_vector.light;
    float cos_o = half_vector.view;
    float masked_light = sqrt((alpha2_ + (((1.0 - alpha2_) * cos_i) * cos_i)));
    float masked_view = sqrt((alpha2_ + (((1.0 - alpha2_) * cos_o) * cos_o)));
    float visible = (cos_i / ((cos_i * masked_view) + (cos_o * masked_light)));
    return (visible / (across_4 * across_4));
}
#endif
#if defined(MODEL_0) || defined(MODEL_10) || defined(MODEL_11) || defined(MODEL_12) || defined(MODEL_3) || defined(MODEL_4) || defined(MODEL_9)
float material_bounded_exp(float x_2) {
    return exp(clamp(x_2, -80.0, 80.0));
}
float material_ln_cosine(float x_3) {
    float series = 0.0;
    series = (0.16666667 + (x_3 * 0.14285715));
    float _e6 = series;
    series = (0.25 + (x_3 * (0.2 + (x_3 * _e6))));
    float _e15 = series;
    return ((-0.5 * x_3) * (1.0 + (x_3 * (0.5 + (x_3 * (0.33333334 + (x_3 * _e15)))))));
}
#endif
#if defined(MODEL_10) || defined(MODEL_4) || defined(MODEL_9)
float material_half_power(Half half_vector_1, float s) {
    float sin2_2 = (half_vector_1.across / half_vector_1.length_squared);
    float cos2_ = ((half_vector_1.sum.z * half_vector_1.sum.z) / half_vector_1.length_squared);
    if ((sin2_2 < MATERIAL_NEAR)) {
        float _e14 = material_ln_cosine(sin2_2);
        float _e18 = material_bounded_exp((s * (2.0 * _e14)));
        return _e18;
    }
    float _e23 = material_bounded_exp((s * log(max(cos2_, MATERIAL_TINY))));
    return _e23;
}
#endif
#if defined(MODEL_10) || defined(MODEL_12) || defined(MODEL_3)
float material_power(float cosine, float sin2_, float s_1) {
    if ((cosine <= 0.0)) {
        return 0.0;
    }
    if ((sin2_ < MATERIAL_NEAR)) {
        float _e8 = material_ln_cosine(sin2_);
        float _e10 = material_bounded_exp((s_1 * _e8));
        return _e10;
    }
    float _e15 = material_bounded_exp((s_1 * log(max(cosine, MATERIAL_TINY))));
    return _e15;
}
#endif
#if defined(MODEL_11)
float material_power_of(float base, float n_1) {
    if ((base <= 0.0)) {
        return 0.0;
    }
    float from_one = ((1.0 - base) * (1.0 + base));
    if ((abs(from_one) < MATERIAL_NEAR)) {
        float _e13 = material_ln_cosine(from_one);
        float _e15 = material_bounded_exp((n_1 * _e13));
        return _e15;
    }
    float _e20 = material_bounded_exp((n_1 * log(max(base, MATERIAL_TINY))));
    return _e20;
}
#endif
#if defined(MODEL_0) || defined(MODEL_9)
float material_fifth(float x_4) {
    float x2_1 = (x_4 * x_4);
    return ((x2_1 * x2_1) * x_4);
}
#endif
#if defined(MODEL_9)
float material_fade(float cosine_1) {
    float _e5 = material_fifth((1.0 - (0.5 * cosine_1)));
    return (1.0 - _e5);
}
#endif
#if defined(MODEL_6)
float material_lambda_cosine(float m, float cosine_2) {
    float slope = (m * sqrt(max((1.0 - (cosine_2 * cosine_2)), 0.0)));
    if ((cosine_2 >= (1.6 * slope))) {
        return 0.0;
    }
    float a_1 = (cosine_2 / slope);
    return ((slope * max(((1.0 - (1.259 * a_1)) + ((0.396 * a_1) * a_1)), 0.0)) / (3.535 + (2.181 * a_1)));
}
#endif
#if defined(MODEL_6) || defined(MODEL_7)
float material_dielectric(float ior, float c_1) {
    float excess = ((ior * ior) - 1.0);
    float sum_15 = (sqrt((excess + (c_1 * c_1))) + c_1);
    float difference_2 = (excess / sum_15);
    float parallel = (((c_1 * sum_15) - 1.0) / ((c_1 * difference_2) + 1.0));
    float share_4 = (difference_2 / sum_15);
    return (((0.5 * share_4) * share_4) * (1.0 + (parallel * parallel)));
}
float material_conductor(float n_2, float k_2, float c_2, float sin2_1) {
    float real = 0.0;
    float part = 0.0;
    float cos2_1 = (c_2 * c_2);
    float index_1 = ((n_2 * n_2) - (k_2 * k_2));
    real = (index_1 - sin2_1);
    if ((cos2_1 < 0.5)) {
        real = ((index_1 - 1.0) + cos2_1);
    }
    float imaginary = ((2.0 * n_2) * k_2);
    float _e18 = real;
    float _e19 = real;
    float size_1 = sqrt(((_e18 * _e19) + (imaginary * imaginary)));
    float _e24 = real;
    part = (0.5 * (size_1 + _e24));
    float _e29 = real;
    if ((_e29 < 0.0)) {
        float _e35 = real;
        part = (((0.5 * imaginary) * imaginary) / (size_1 - _e35));
    }
    float _e40 = part;
    float twice = ((2.0 * c_2) * sqrt(_e40));
    float s_3 = (max(((size_1 + cos2_1) - twice), 0.0) / ((size_1 + cos2_1) + twice));
    float sum_16 = ((cos2_1 * size_1) + (sin2_1 * sin2_1));
    float less = (twice * sin2_1);
    return ((0.5 * s_3) * (1.0 + ((sum_16 - less) / (sum_16 + less))));
}
#endif
#if defined(MODEL_13)
vec3 material_half_difference(vec3 light_1, vec3 view_1) {
    vec2 phi = vec2(1.0, 0.0);
    vec2 theta = vec2(1.0, 0.0);
    bool local_12 = false;
    bool local_13 = false;
    vec3 sum_17 = (light_1 + view_1);
    vec3 difference_3 = (light_1 - view_1);
    float across_5 = length(sum_17.xy);
    float size_2 = length(sum_17);
    if ((across_5 > 0.0)) {
        phi = (sum_17.xy / vec2(across_5));
    }
    if ((size_2 > 0.0)) {
        theta = (vec2(sum_17.z, across_5) / vec2(size_2));
    }
    float _e28 = phi.x;
    float _e32 = phi.y;
    float _e36 = theta.x;
    float _e40 = theta.y;
    float x_10 = ((((difference_3.x * _e28) + (difference_3.y * _e32)) * _e36) - (difference_3.z * _e40));
    float _e45 = phi.x;
    float _e49 = phi.y;
    float y_4 = ((difference_3.y * _e45) - (difference_3.x * _e49));
    if (!((y_4 < 0.0))) {
        if ((y_4 == 0.0)) {
            local_13 = (x_10 < 0.0);
        } else {
            local_13 = false;
        }
        bool _e64 = local_13;
        local_12 = _e64;
    } else {
        local_12 = true;
    }
    bool turned = local_12;
    float side = (turned ? -1.0 : 1.0);
    float _e72 = angles_angle((side * y_4), (side * x_10));
    float _e74 = angles_angle(across_5, sum_17.z);
    float _e76 = angles_angle(length(difference_3), size_2);
    return vec3(_e74, _e76, _e72);
}
#endif
#if defined(MODEL_14)
vec4 material_half_and_difference(vec3 light_2, vec3 view_2) {
    vec2 away = vec2(1.0, 0.0);
    vec2 theta_1 = vec2(1.0, 0.0);
    bool local_14 = false;
    bool local_15 = false;
    float phi_1 = 0.0;
    vec3 sum_18 = (light_2 + view_2);
    vec3 difference_4 = (light_2 - view_2);
    float across_6 = length(sum_18.xy);
    float size_3 = length(sum_18);
    if ((across_6 > 0.0)) {
        away = (sum_18.xy / vec2(across_6));
    }
    if ((size_3 > 0.0)) {
        theta_1 = (vec2(sum_18.z, across_6) / vec2(size_3));
    }
    float _e28 = away.x;
    float _e32 = away.y;
    float _e36 = theta_1.x;
    float _e40 = theta_1.y;
    float along = ((((difference_4.x * _e28) + (difference_4.y * _e32)) * _e36) - (difference_4.z * _e40));
    float _e45 = away.x;
    float _e49 = away.y;
    float beside = ((difference_4.y * _e45) - (difference_4.x * _e49));
    float _e53 = away.x;
    float _e56 = away.y;
    float x_11 = ((_e53 * along) - (_e56 * beside));
    float _e60 = away.y;
    float _e63 = away.x;
    float y_5 = ((_e60 * along) + (_e63 * beside));
    if (!((y_5 < 0.0))) {
        if ((y_5 == 0.0)) {
            local_15 = (x_11 < 0.0);
        } else {
            local_15 = false;
        }
        bool _e78 = local_15;
        local_14 = _e78;
    } else {
        local_14 = true;
    }
    bool turned_1 = local_14;
    float side_1 = (turned_1 ? -1.0 : 1.0);
    float _e85 = away.y;
    float _e87 = away.x;
    float _e88 = angles_angle(_e85, _e87);
    phi_1 = _e88;
    float _e90 = phi_1;
    if ((_e90 < 0.0)) {
        float _e93 = phi_1;
        phi_1 = (_e93 + 6.2831855);
    }
    float _e97 = angles_angle(across_6, sum_18.z);
    float _e98 = phi_1;
    float _e100 = angles_angle(length(difference_4), size_3);
    float _e103 = angles_angle((side_1 * y_5), (side_1 * x_11));
    return vec4(_e97, _e98, _e100, _e103);
}
#endif
#if defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(MODE_TABLE) || defined(MODE_TAPS)
uint material_element(uint i_1) {
#ifdef MATERIAL_VECTORS
    uvec4 _e8 = uvec4(material[i_1 >> 2u][i_1 & 3u]);
#else
    uvec4 _e8 = texelFetch(material, ivec2(uvec2((i_1 % 1024u), (i_1 / 1024u))), 0);
#endif
    return _e8.x;
}
#endif
#if defined(MODEL_0)
uint standard_tables_count(uint at_2) {
    uint _e3 = material_element((at_2 + 24u));
    return _e3;
}
vec4 standard_tables(uint at_3, uint k_3) {
    uint _e7 = material_element(((at_3 + 25u) + (4u * k_3)));
    uint _e14 = material_element(((at_3 + 26u) + (4u * k_3)));
    uint _e21 = material_element(((at_3 + 27u) + (4u * k_3)));
    uint _e28 = material_element(((at_3 + 28u) + (4u * k_3)));
    return vec4(uintBitsToFloat(_e7), uintBitsToFloat(_e14), uintBitsToFloat(_e21), uintBitsToFloat(_e28));
}
vec4 material_at_cosine(uint at_4, float cosine_3) {
    uint _e2 = standard_tables_count(at_4);
    uint last_2 = (_e2 - 1u);
    float place = (sqrt(min(cosine_3, 1.0)) * float(last_2));
    uint node_1 = min(uint(place), (last_2 - 1u));
    vec4 _e14 = standard_tables(at_4, node_1);
    vec4 _e17 = standard_tables(at_4, (node_1 + 1u));
    return (_e14 + ((_e17 - _e14) * (place - float(node_1))));
}
float standard_coat_0_(uint at_5) {
    uint _e3 = material_element((at_5 + 6u));
    return uintBitsToFloat(_e3);
}
float standard_coat_90_(uint at_6) {
    uint _e3 = material_element((at_6 + 7u));
    return uintBitsToFloat(_e3);
}
float standard_coat_alpha2_(uint at_7) {
    uint _e3 = material_element((at_7 + 5u));
    return uintBitsToFloat(_e3);
}
vec3 standard_f_0_(uint at_8) {
    uint _e3 = material_element((at_8 + 1u));
    uint _e7 = material_element((at_8 + 2u));
    uint _e11 = material_element((at_8 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
float standard_f_90_(uint at_9) {
    uint _e3 = material_element((at_9 + 4u));
    return uintBitsToFloat(_e3);
}
float standard_alpha2_(uint at_10) {
    uint _e3 = material_element((at_10 + 0u));
    return uintBitsToFloat(_e3);
}
vec3 standard_sheen(uint at_11) {
    uint _e3 = material_element((at_11 + 8u));
    uint _e7 = material_element((at_11 + 9u));
    uint _e11 = material_element((at_11 + 10u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
float charlie_c(uint at_12) {
    uint _e3 = material_element((at_12 + 3u));
    return uintBitsToFloat(_e3);
}
float charlie_a(uint at_13) {
    uint _e3 = material_element((at_13 + 1u));
    return uintBitsToFloat(_e3);
}
float charlie_b(uint at_14) {
    uint _e3 = material_element((at_14 + 2u));
    return uintBitsToFloat(_e3);
}
float charlie_d(uint at_15) {
    uint _e3 = material_element((at_15 + 4u));
    return uintBitsToFloat(_e3);
}
float charlie_e(uint at_16) {
    uint _e3 = material_element((at_16 + 5u));
    return uintBitsToFloat(_e3);
}
float material_charlie_ln(uint at_17, float x_5) {
    float _e2 = charlie_c(at_17);
    float _e7 = material_bounded_exp((_e2 * log(max(x_5, MATERIAL_TINY))));
    float _e8 = charlie_a(at_17);
    float _e9 = charlie_b(at_17);
    float share_5 = (_e8 / (1.0 + (_e9 * _e7)));
    float _e14 = charlie_d(at_17);
    float _e17 = charlie_e(at_17);
    return ((share_5 + (_e14 * x_5)) + _e17);
}
float charlie_twice_middle(uint at_18) {
    uint _e3 = material_element((at_18 + 6u));
    return uintBitsToFloat(_e3);
}
float material_charlie_lambda(uint at_19, float cosine_4) {
    if ((cosine_4 < 0.5)) {
        float _e4 = material_charlie_ln(at_19, cosine_4);
        float _e5 = material_bounded_exp(_e4);
        return _e5;
    }
    float _e6 = charlie_twice_middle(at_19);
    float _e11 = material_charlie_ln(at_19, max((1.0 - cosine_4), 0.0));
    float _e13 = material_bounded_exp((_e6 - _e11));
    return _e13;
}
float charlie_power(uint at_20) {
    uint _e3 = material_element((at_20 + 0u));
    return uintBitsToFloat(_e3);
}
float material_charlie(uint at_21, Half half_vector_2) {
    float ln = 0.0;
    float sin2_3 = (half_vector_2.across / half_vector_2.length_squared);
    float cos2_2 = ((half_vector_2.sum.z * half_vector_2.sum.z) / half_vector_2.length_squared);
    ln = log(max(sin2_3, MATERIAL_TINY));
    if ((cos2_2 < MATERIAL_NEAR)) {
        float _e18 = material_ln_cosine(cos2_2);
        ln = (2.0 * _e18);
    }
    float light_22 = max(half_vector_2.light, MATERIAL_GRAZING);
    float view_23 = max(half_vector_2.view, MATERIAL_GRAZING);
    float _e27 = material_charlie_lambda(at_21, light_22);
    float _e30 = material_charlie_lambda(at_21, view_23);
    float masked = ((((1.0 + _e27) + _e30) * light_22) * view_23);
    float _e34 = charlie_power(at_21);
    float _e35 = ln;
    float _e37 = material_bounded_exp((_e34 * _e35));
    return (_e37 / masked);
}
uint standard_charlie(uint at_22) {
    return (at_22 + 11u);
}
vec3 standard_multiple(uint at_23) {
    uint _e3 = material_element((at_23 + 18u));
    uint _e7 = material_element((at_23 + 19u));
    uint _e11 = material_element((at_23 + 20u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 standard_diffuse(uint at_24) {
    uint _e3 = material_element((at_24 + 21u));
    uint _e7 = material_element((at_24 + 22u));
    uint _e11 = material_element((at_24 + 23u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_standard(uint at_25, vec3 light_3, vec3 view_3) {
    vec3 sum_2 = vec3(0.0);
    Half _e3 = material_half(light_3, view_3);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float cos_i_1 = _e3.light;
    vec4 _e9 = material_at_cosine(at_25, cos_i_1);
    vec4 _e11 = material_at_cosine(at_25, _e3.view);
    float _e17 = material_fifth(max((1.0 - _e3.facet), 0.0));
    float _e18 = standard_coat_0_(at_25);
    float _e19 = standard_coat_90_(at_25);
    float _e20 = standard_coat_alpha2_(at_25);
    float _e21 = material_facets(_e20, _e3);
    float coat = ((_e18 + ((_e19 - _e18) * _e17)) * _e21);
    vec3 _e26 = standard_f_0_(at_25);
    float _e27 = standard_f_90_(at_25);
    vec3 f_90_ = vec3(_e27);
    float _e32 = standard_alpha2_(at_25);
    float _e33 = material_facets(_e32, _e3);
    float highlight = (min(_e9.y, _e11.y) * _e33);
    sum_2 = (vec3(coat) + ((_e26 + ((f_90_ - _e26) * _e17)) * highlight));
    vec3 _e42 = standard_sheen(at_25);
    if ((max(max(_e42.x, _e42.y), _e42.z) > 0.0)) {
        uint _e50 = standard_charlie(at_25);
        float _e51 = material_charlie(_e50, _e3);
        vec3 _e52 = sum_2;
        sum_2 = (_e52 + (_e42 * ((min(_e9.x, _e11.x) * _e51) * cos_i_1)));
    }
    vec3 _e60 = sum_2;
    vec3 _e61 = standard_multiple(at_25);
    vec3 _e68 = standard_diffuse(at_25);
    return ((_e60 + (_e61 * ((_e9.z * _e11.z) * cos_i_1))) + (_e68 * ((_e9.w * _e11.w) * cos_i_1)));
}
#endif
#if defined(MODEL_1)
vec3 lambert_brdf(uint at_26) {
    uint _e3 = material_element((at_26 + 0u));
    uint _e7 = material_element((at_26 + 1u));
    uint _e11 = material_element((at_26 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_lambert(uint at_27, vec3 light_4, vec3 view_4) {
    vec3 _e3 = lambert_brdf(at_27);
    return (_e3 * max(light_4.z, 0.0));
}
#endif
#if defined(MODEL_2)
vec3 oren_nayar_matte(uint at_28) {
    uint _e3 = material_element((at_28 + 0u));
    uint _e7 = material_element((at_28 + 1u));
    uint _e11 = material_element((at_28 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 oren_nayar_rough(uint at_29) {
    uint _e3 = material_element((at_29 + 3u));
    uint _e7 = material_element((at_29 + 4u));
    uint _e11 = material_element((at_29 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_oren_nayar(uint at_30, vec3 light_5, vec3 view_5) {
    if ((light_5.z <= 0.0)) {
        return vec3(0.0);
    }
    float across_7 = (max(((light_5.x * view_5.x) + (light_5.y * view_5.y)), 0.0) / max(light_5.z, abs(view_5.z)));
    vec3 _e22 = oren_nayar_matte(at_30);
    vec3 _e23 = oren_nayar_rough(at_30);
    return ((_e22 + (_e23 * across_7)) * light_5.z);
}
#endif
#if defined(MODEL_3)
float phong_exponent(uint at_31) {
    uint _e3 = material_element((at_31 + 0u));
    return uintBitsToFloat(_e3);
}
vec3 phong_peak(uint at_32) {
    uint _e3 = material_element((at_32 + 1u));
    uint _e7 = material_element((at_32 + 2u));
    uint _e11 = material_element((at_32 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_phong(uint at_33, vec3 light_6, vec3 view_6) {
    vec3 mirrored_1 = vec3(-(view_6.x), -(view_6.y), view_6.z);
    vec3 sine_3 = cross(light_6, mirrored_1);
    float _e12 = phong_exponent(at_33);
    float _e13 = material_power(dot(light_6, mirrored_1), dot(sine_3, sine_3), _e12);
    vec3 _e14 = phong_peak(at_33);
    return (_e14 * _e13);
}
#endif
#if defined(MODEL_4)
float blinn_phong_half_exponent(uint at_34) {
    uint _e3 = material_element((at_34 + 0u));
    return uintBitsToFloat(_e3);
}
vec3 blinn_phong_peak(uint at_35) {
    uint _e3 = material_element((at_35 + 1u));
    uint _e7 = material_element((at_35 + 2u));
    uint _e11 = material_element((at_35 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_blinn_phong(uint at_36, vec3 light_7, vec3 view_7) {
    Half _e3 = material_half(light_7, view_7);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = blinn_phong_half_exponent(at_36);
    float _e9 = material_half_power(_e3, _e8);
    vec3 _e10 = blinn_phong_peak(at_36);
    return (_e10 * (_e3.light * _e9));
}
#endif
#if defined(MODEL_5)
float microfacet_sigma(uint at_37) {
    uint _e3 = material_element((at_37 + 0u));
    return uintBitsToFloat(_e3);
}
vec3 microfacet_peak(uint at_38) {
    uint _e3 = material_element((at_38 + 1u));
    uint _e7 = material_element((at_38 + 2u));
    uint _e11 = material_element((at_38 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_microfacet(uint at_39, vec3 light_8, vec3 view_8) {
    bool local_16 = false;
    vec3 sum_19 = (light_8 + view_8);
    if (!((light_8.z <= 0.0))) {
        local_16 = (dot(sum_19, sum_19) <= 0.0);
    } else {
        local_16 = true;
    }
    bool _e14 = local_16;
    if (_e14) {
        return vec3(0.0);
    }
    float _e20 = angles_angle(length(sum_19.xy), sum_19.z);
    float _e21 = microfacet_sigma(at_39);
    float share_6 = (_e20 / _e21);
    vec3 _e23 = microfacet_peak(at_39);
    return (_e23 * exp(-(min((share_6 * share_6), MATERIAL_STEEP))));
}
#endif
#if defined(MODEL_6)
float torrance_sparrow_roughness(uint at_40) {
    uint _e3 = material_element((at_40 + 0u));
    return uintBitsToFloat(_e3);
}
#endif
#if defined(MODEL_6) || defined(MODEL_7)
vec3 fresnel_n(uint at_41) {
    uint _e3 = material_element((at_41 + 1u));
    uint _e7 = material_element((at_41 + 2u));
    uint _e11 = material_element((at_41 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
bool fresnel_is_conductor(uint at_42) {
    uint _e3 = material_element((at_42 + 0u));
    return (_e3 != 0u);
}
vec3 fresnel_k(uint at_43) {
    uint _e3 = material_element((at_43 + 4u));
    uint _e7 = material_element((at_43 + 5u));
    uint _e11 = material_element((at_43 + 6u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_fresnel(uint at_44, Half half_vector_3) {
    vec3 _e2 = fresnel_n(at_44);
    bool _e3 = fresnel_is_conductor(at_44);
    if (!(_e3)) {
        float _e7 = material_dielectric(_e2.x, half_vector_3.facet);
        return vec3(_e7);
    }
    vec3 _e9 = fresnel_k(at_44);
    float _e14 = material_conductor(_e2.x, _e9.x, half_vector_3.facet, half_vector_3.turn);
    float _e19 = material_conductor(_e2.y, _e9.y, half_vector_3.facet, half_vector_3.turn);
    float _e24 = material_conductor(_e2.z, _e9.z, half_vector_3.facet, half_vector_3.turn);
    return vec3(_e14, _e19, _e24);
}
#endif
#if defined(MODEL_6)
uint torrance_sparrow_fresnel(uint at_45) {
    return (at_45 + 4u);
}
vec3 torrance_sparrow_peak(uint at_46) {
    uint _e3 = material_element((at_46 + 1u));
    uint _e7 = material_element((at_46 + 2u));
    uint _e11 = material_element((at_46 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_torrance_sparrow(uint at_47, vec3 light_9, vec3 view_9) {
    Half _e3 = material_half(light_9, view_9);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = torrance_sparrow_roughness(at_47);
    float across_8 = (_e3.across / (_e8 * _e8));
    float z2_ = (_e3.sum.z * _e3.sum.z);
    if ((across_8 >= (MATERIAL_STEEP * z2_))) {
        return vec3(0.0);
    }
    float cos2_3 = (z2_ / _e3.length_squared);
    float d = (exp((-(across_8) / z2_)) / (cos2_3 * cos2_3));
    float cos_i_2 = _e3.light;
    float cos_o_1 = _e3.view;
    float _e32 = material_lambda_cosine(_e8, cos_i_2);
    float _e35 = material_lambda_cosine(_e8, cos_o_1);
    float masked_1 = (((cos_i_2 * cos_o_1) + (cos_o_1 * _e32)) + (cos_i_2 * _e35));
    uint _e38 = torrance_sparrow_fresnel(at_47);
    vec3 _e39 = material_fresnel(_e38, _e3);
    vec3 _e40 = torrance_sparrow_peak(at_47);
    return ((_e40 * _e39) * ((d * cos_i_2) / masked_1));
}
#endif
#if defined(MODEL_7)
float ggx_product(uint at_48) {
    uint _e3 = material_element((at_48 + 0u));
    return uintBitsToFloat(_e3);
}
float ggx_ratio(uint at_49) {
    uint _e3 = material_element((at_49 + 13u));
    return uintBitsToFloat(_e3);
}
vec2 ggx_squares(uint at_50) {
    uint _e3 = material_element((at_50 + 11u));
    uint _e7 = material_element((at_50 + 12u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}
float material_masked(vec2 squares, vec3 v_1, float cosine_5) {
    return sqrt(((((squares.x * v_1.x) * v_1.x) + ((squares.y * v_1.y) * v_1.y)) + (cosine_5 * cosine_5)));
}
vec3 ggx_peak(uint at_51) {
    uint _e3 = material_element((at_51 + 1u));
    uint _e7 = material_element((at_51 + 2u));
    uint _e11 = material_element((at_51 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
uint ggx_fresnel(uint at_52) {
    return (at_52 + 4u);
}
vec3 material_ggx(uint at_53, vec3 light_10, vec3 view_10) {
    float across = 0.0;
    Half _e3 = material_half(light_10, view_10);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = ggx_product(at_53);
    float _e9 = ggx_ratio(at_53);
    vec3 sum_20 = _e3.sum;
    across = ((((sum_20.x * sum_20.x) * _e9) + ((sum_20.y * sum_20.y) / _e9)) + ((_e8 * sum_20.z) * sum_20.z));
    float _e26 = across;
    across = (_e26 / _e3.length_squared);
    float cos_i_3 = _e3.light;
    float cos_o_2 = _e3.view;
    vec2 _e31 = ggx_squares(at_53);
    float _e32 = material_masked(_e31, view_10, cos_o_2);
    float _e34 = material_masked(_e31, light_10, cos_i_3);
    float masked_2 = ((cos_i_3 * _e32) + (cos_o_2 * _e34));
    float _e38 = across;
    float _e39 = across;
    float lobe_1 = ((cos_i_3 / masked_2) / (_e38 * _e39));
    vec3 _e42 = ggx_peak(at_53);
    uint _e43 = ggx_fresnel(at_53);
    vec3 _e44 = material_fresnel(_e43, _e3);
    return ((_e42 * _e44) * lobe_1);
}
#endif
#if defined(MODEL_8)
vec2 ward_roughness(uint at_54) {
    uint _e3 = material_element((at_54 + 0u));
    uint _e7 = material_element((at_54 + 1u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}
vec3 ward_peak(uint at_55) {
    uint _e3 = material_element((at_55 + 2u));
    uint _e7 = material_element((at_55 + 3u));
    uint _e11 = material_element((at_55 + 4u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_ward(uint at_56, vec3 light_11, vec3 view_11) {
    Half _e3 = material_half(light_11, view_11);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    vec2 _e8 = ward_roughness(at_56);
    float x_12 = (_e3.sum.x / _e8.x);
    float y_6 = (_e3.sum.y / _e8.y);
    float z_3 = _e3.sum.z;
    float across_9 = ((x_12 * x_12) + (y_6 * y_6));
    if ((across_9 >= ((MATERIAL_STEEP * z_3) * z_3))) {
        return vec3(0.0);
    }
    float slopes = (across_9 / (z_3 * z_3));
    float grazing = ((_e3.light / z_3) / max(z_3, MATERIAL_MIN_COSINE));
    vec3 _e35 = ward_peak(at_56);
    return (_e35 * ((exp(-(slopes)) * (_e3.length_squared / (z_3 * z_3))) * grazing));
}
#endif
#if defined(MODEL_9)
vec2 ashikhmin_shirley_half_exponent(uint at_57) {
    uint _e3 = material_element((at_57 + 0u));
    uint _e7 = material_element((at_57 + 1u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}
float ashikhmin_shirley_lobe(uint at_58) {
    uint _e3 = material_element((at_58 + 2u));
    return uintBitsToFloat(_e3);
}
vec3 ashikhmin_shirley_specular(uint at_59) {
    uint _e3 = material_element((at_59 + 3u));
    uint _e7 = material_element((at_59 + 4u));
    uint _e11 = material_element((at_59 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 ashikhmin_shirley_base(uint at_60) {
    uint _e3 = material_element((at_60 + 6u));
    uint _e7 = material_element((at_60 + 7u));
    uint _e11 = material_element((at_60 + 8u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_ashikhmin_shirley(uint at_61, vec3 light_12, vec3 view_12) {
    float exponent = 0.0;
    Half _e3 = material_half(light_12, view_12);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    vec3 sum_21 = _e3.sum;
    float facet_1 = _e3.facet;
    float cos_i_4 = _e3.light;
    float cos_o_3 = _e3.view;
    if ((_e3.across > 0.0)) {
        vec2 _e17 = ashikhmin_shirley_half_exponent(at_61);
        float turned_2 = (((_e17.x * sum_21.x) * sum_21.x) + ((_e17.y * sum_21.y) * sum_21.y));
        exponent = (turned_2 / _e3.across);
    }
    float _e31 = ashikhmin_shirley_lobe(at_61);
    float _e32 = exponent;
    float _e33 = material_half_power(_e3, _e32);
    float lobe_2 = (((_e31 * _e33) / max(facet_1, MATERIAL_MIN_COSINE)) * (cos_i_4 / max(cos_i_4, cos_o_3)));
    float _e45 = material_fifth(max((1.0 - facet_1), 0.0));
    float _e46 = material_fade(cos_i_4);
    float _e47 = material_fade(cos_o_3);
    float base_1 = ((_e46 * _e47) * cos_i_4);
    vec3 _e50 = ashikhmin_shirley_specular(at_61);
    vec3 _e57 = ashikhmin_shirley_base(at_61);
    return (((_e50 + ((vec3(1.0) - _e50) * _e45)) * lobe_2) + (_e57 * base_1));
}
#endif
#if defined(MODEL_10)
float poulin_fournier_distance(uint at_62) {
    uint _e3 = material_element((at_62 + 1u));
    return uintBitsToFloat(_e3);
}
float poulin_fournier_floor(uint at_63) {
    uint _e3 = material_element((at_63 + 2u));
    return uintBitsToFloat(_e3);
}
float poulin_fournier_edge(uint at_64) {
    uint _e3 = material_element((at_64 + 3u));
    return uintBitsToFloat(_e3);
}
float poulin_fournier_half_width(uint at_65) {
    uint _e3 = material_element((at_65 + 4u));
    return uintBitsToFloat(_e3);
}
Cylinder material_cylinder(uint at_66, vec3 direction_2) {
    float cosine_6 = 1.0;
    float first_2 = 0.0;
    float near = 0.0;
    float far = 0.0;
    float height = max(direction_2.z, 0.0);
    float size_4 = length(vec2(direction_2.y, height));
    if ((size_4 > 0.0)) {
        cosine_6 = max((height / size_4), MATERIAL_MIN_COSINE);
    }
    float _e15 = cosine_6;
    float _e16 = cosine_6;
    float sine_4 = sqrt(max((1.0 - (_e15 * _e16)), 0.0));
    float _e23 = poulin_fournier_distance(at_66);
    float _e24 = poulin_fournier_floor(at_66);
    float _e25 = poulin_fournier_edge(at_66);
    float _e26 = poulin_fournier_half_width(at_66);
    float _e29 = cosine_6;
    float hidden = min(((0.5 * _e23) * _e29), 1.0);
    float _e33 = cosine_6;
    float _e34 = angles_angle(_e33, sine_4);
    first_2 = -(_e34);
    float _e37 = first_2;
    float _e42 = angles_angle(sqrt(hidden), sqrt((1.0 - hidden)));
    float last_3 = min((_e37 + (2.0 * _e42)), _e25);
    float _e47 = first_2;
    first_2 = max(_e47, -(_e25));
    near = _e26;
    float _e53 = cosine_6;
    if (((_e26 * sine_4) < (-(_e24) * _e53))) {
        float _e59 = cosine_6;
        near = ((1.0 + (_e24 * sine_4)) / _e59);
    }
    far = (_e23 - _e26);
    if ((sine_4 > _e24)) {
        float _e67 = cosine_6;
        far = (_e23 - ((1.0 - (_e24 * sine_4)) / _e67));
    }
    float _e70 = cosine_6;
    float _e71 = angles_angle(sine_4, _e70);
    if ((direction_2.y < 0.0)) {
        float _e76 = cosine_6;
        float _e78 = first_2;
        float _e81 = far;
        float _e83 = near;
        return Cylinder(-(_e71), _e76, vec2(-(last_3), -(_e78)), vec2((_e23 - _e81), (_e23 - _e83)));
    }
    float _e87 = cosine_6;
    float _e88 = first_2;
    float _e90 = near;
    float _e91 = far;
    return Cylinder(_e71, _e87, vec2(_e88, last_3), vec2(_e90, _e91));
}
float poulin_fournier_exponent(uint at_67) {
    uint _e3 = material_element((at_67 + 0u));
    return uintBitsToFloat(_e3);
}
float poulin_fournier_reach(uint at_68) {
    uint _e3 = material_element((at_68 + 5u));
    return uintBitsToFloat(_e3);
}
float material_half_tangent(float angle) {
    vec2 _e8 = angles_circle((clamp((0.5 * angle), -0.7853982, 0.7853982) / 6.2831855));
    return (_e8.y / _e8.x);
}
vec2 poulin_fournier_gauss(uint at_69, uint k_4) {
    uint _e7 = material_element(((at_69 + 12u) + (2u * k_4)));
    uint _e14 = material_element(((at_69 + 13u) + (2u * k_4)));
    return vec2(uintBitsToFloat(_e7), uintBitsToFloat(_e14));
}
float material_on_cylinder(float t, vec2 light_13, vec2 view_13, float s_2) {
    float scale = (1.0 / (1.0 + (t * t)));
    float sine_5 = ((2.0 * t) * scale);
    float cosine_11 = (((1.0 - t) * (1.0 + t)) * scale);
    float cos_l = max(((cosine_11 * light_13.x) - (sine_5 * light_13.y)), 0.0);
    float cos_v = max(((cosine_11 * view_13.x) - (sine_5 * view_13.y)), 0.0);
    float _e35 = material_power(cosine_11, (sine_5 * sine_5), s_2);
    return ((((2.0 * scale) * _e35) * cos_l) * cos_v);
}
float material_cylinder_highlight(uint at_70, vec3 sum_3, float phi_l, float phi_v, vec2 arc) {
    float integral = 0.0;
    uint node = 0u;
    float _e7 = angles_angle(sum_3.y, sum_3.z);
    float _e8 = poulin_fournier_reach(at_70);
    float _e11 = material_half_tangent((arc.x - _e7));
    float start = max(_e11, -(_e8));
    float _e16 = material_half_tangent((arc.y - _e7));
    float end = min(_e16, _e8);
    if ((start >= end)) {
        return 0.0;
    }
    float middle = (0.5 * (start + end));
    float radius_1 = (0.5 * (end - start));
    vec2 _e29 = angles_circle(((_e7 - phi_l) / 6.2831855));
    vec2 _e33 = angles_circle(((_e7 - phi_v) / 6.2831855));
    float _e34 = poulin_fournier_exponent(at_70);
    bool loop_init_2 = true;
    while(true) {
        if (!loop_init_2) {
            uint _e56 = node;
            node = (_e56 + 1u);
        }
        loop_init_2 = false;
        uint _e39 = node;
        if ((_e39 < 8u)) {
        } else {
            break;
        }
        {
            uint _e42 = node;
            vec2 _e43 = poulin_fournier_gauss(at_70, _e42);
            float step_ = (radius_1 * _e43.x);
            float _e47 = material_on_cylinder((middle - step_), _e29, _e33, _e34);
            float _e49 = material_on_cylinder((middle + step_), _e29, _e33, _e34);
            float both = (_e47 + _e49);
            float _e51 = integral;
            integral = (_e51 + (_e43.y * both));
        }
    }
    float _e58 = integral;
    return (radius_1 * _e58);
}
vec3 poulin_fournier_diffuse(uint at_71) {
    uint _e3 = material_element((at_71 + 6u));
    uint _e7 = material_element((at_71 + 7u));
    uint _e11 = material_element((at_71 + 8u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 poulin_fournier_specular(uint at_72) {
    uint _e3 = material_element((at_72 + 9u));
    uint _e7 = material_element((at_72 + 10u));
    uint _e11 = material_element((at_72 + 11u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_poulin_fournier(uint at_73, vec3 light_14, vec3 view_14) {
    float diffuse = 0.0;
    float specular = 0.0;
    Half _e3 = material_half(light_14, view_14);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    Cylinder _e8 = material_cylinder(at_73, light_14);
    Cylinder _e9 = material_cylinder(at_73, view_14);
    vec2 arc_1 = vec2(max(_e8.arc.x, _e9.arc.x), min(_e8.arc.y, _e9.arc.y));
    vec2 ground = vec2(max(_e8.ground.x, _e9.ground.x), min(_e8.ground.y, _e9.ground.y));
    float _e32 = poulin_fournier_exponent(at_73);
    if ((arc_1.x < arc_1.y)) {
        float _e41 = poulin_fournier_distance(at_73);
        float scale_1 = ((_e3.light / _e41) / (_e8.cosine * _e9.cosine));
        float middle_1 = (0.5 * (arc_1.x + arc_1.y));
        float radius_2 = (0.5 * (arc_1.y - arc_1.x));
        vec2 _e61 = angles_circle(((middle_1 - _e8.phi) / 6.2831855));
        float from_light = _e61.x;
        vec2 _e67 = angles_circle(((middle_1 - _e9.phi) / 6.2831855));
        float from_view = _e67.x;
        vec2 _e77 = angles_circle(((((2.0 * middle_1) - _e8.phi) - _e9.phi) / 6.2831855));
        float twice_1 = _e77.x;
        float _e84 = material_one_less_sinc((2.0 * radius_2));
        float matte = (((2.0 * from_light) * from_view) - (_e84 * twice_1));
        float _e87 = diffuse;
        diffuse = (_e87 + (scale_1 * max((radius_2 * matte), 0.0)));
        vec3 sum_22 = _e3.sum;
        float along_1 = ((sum_22.x * sum_22.x) / _e3.length_squared);
        float _e104 = material_power(sqrt(max((1.0 - along_1), 0.0)), along_1, _e32);
        float _e105 = specular;
        float _e109 = material_cylinder_highlight(at_73, sum_22, _e8.phi, _e9.phi, arc_1);
        specular = (_e105 + ((scale_1 * _e104) * _e109));
    }
    if ((ground.x < ground.y)) {
        float _e116 = poulin_fournier_distance(at_73);
        float width = ((_e3.light / _e116) * (ground.y - ground.x));
        float _e122 = diffuse;
        diffuse = (_e122 + width);
        float _e124 = specular;
        float _e127 = material_half_power(_e3, (0.5 * _e32));
        specular = (_e124 + (width * _e127));
    }
    vec3 _e130 = poulin_fournier_diffuse(at_73);
    float _e131 = diffuse;
    vec3 _e133 = poulin_fournier_specular(at_73);
    float _e134 = specular;
    return ((_e130 * _e131) + (_e133 * _e134));
}
#endif
#if defined(MODEL_11)
vec3 lafortune_diffuse(uint at_74) {
    uint _e3 = material_element((at_74 + 0u));
    uint _e7 = material_element((at_74 + 1u));
    uint _e11 = material_element((at_74 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
uint lafortune_lobes_count(uint at_75) {
    uint _e3 = material_element((at_75 + 3u));
    return _e3;
}
uint lafortune_lobes(uint at_76, uint k_5) {
    return ((at_76 + 4u) + (6u * k_5));
}
float lafortune_lobe_cx(uint at_77) {
    uint _e3 = material_element((at_77 + 0u));
    return uintBitsToFloat(_e3);
}
float lafortune_lobe_cz(uint at_78) {
    uint _e3 = material_element((at_78 + 1u));
    return uintBitsToFloat(_e3);
}
vec3 lafortune_lobe_weight(uint at_79) {
    uint _e3 = material_element((at_79 + 3u));
    uint _e7 = material_element((at_79 + 4u));
    uint _e11 = material_element((at_79 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
float lafortune_lobe_n(uint at_80) {
    uint _e3 = material_element((at_80 + 2u));
    return uintBitsToFloat(_e3);
}
vec3 material_lafortune(uint at_81, vec3 light_15, vec3 view_15) {
    vec3 brdf = vec3(0.0);
    uint lobe = 0u;
    if ((light_15.z <= 0.0)) {
        return vec3(0.0);
    }
    float across_10 = ((light_15.x * view_15.x) + (light_15.y * view_15.y));
    float along_2 = (light_15.z * view_15.z);
    vec3 _e18 = lafortune_diffuse(at_81);
    brdf = _e18;
    bool loop_init_3 = true;
    while(true) {
        if (!loop_init_3) {
            uint _e39 = lobe;
            lobe = (_e39 + 1u);
        }
        loop_init_3 = false;
        uint _e22 = lobe;
        uint _e23 = lafortune_lobes_count(at_81);
        if ((_e22 < _e23)) {
        } else {
            break;
        }
        {
            uint _e25 = lobe;
            uint _e26 = lafortune_lobes(at_81, _e25);
            float _e27 = lafortune_lobe_cx(_e26);
            float _e29 = lafortune_lobe_cz(_e26);
            float base_2 = ((_e27 * across_10) + (_e29 * along_2));
            vec3 _e32 = brdf;
            vec3 _e33 = lafortune_lobe_weight(_e26);
            float _e34 = lafortune_lobe_n(_e26);
            float _e35 = material_power_of(base_2, _e34);
            brdf = (_e32 + (_e33 * _e35));
        }
    }
    vec3 _e41 = brdf;
    return (_e41 * light_15.z);
}
#endif
#if defined(MODEL_12)
vec3 kajiya_kay_specular(uint at_82) {
    uint _e3 = material_element((at_82 + 1u));
    uint _e7 = material_element((at_82 + 2u));
    uint _e11 = material_element((at_82 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
float kajiya_kay_exponent(uint at_83) {
    uint _e3 = material_element((at_83 + 0u));
    return uintBitsToFloat(_e3);
}
vec3 material_kajiya_kay(uint at_84, vec3 light_16, vec3 view_16) {
    float sin_i = length(light_16.yz);
    float sin_o = length(view_16.yz);
    float sine_6 = ((sin_i * view_16.x) - (light_16.x * sin_o));
    float cosine_12 = ((light_16.x * view_16.x) + (sin_i * sin_o));
    vec3 _e17 = kajiya_kay_specular(at_84);
    float _e19 = kajiya_kay_exponent(at_84);
    float _e20 = material_power(cosine_12, (sine_6 * sine_6), _e19);
    return (_e17 * _e20);
}
#endif
#if defined(MODEL_13)
uvec3 measured_shape(uint at_85) {
    uint _e3 = material_element((at_85 + 0u));
    uint _e6 = material_element((at_85 + 1u));
    uint _e9 = material_element((at_85 + 2u));
    return uvec3(_e3, _e6, _e9);
}
uint measured_table(uint at_86) {
    return (at_86 + 6u);
}
#endif
#if defined(MODEL_13) || defined(MODEL_14)
vec3 measured_table_values(uint at_87, uint k_6) {
    uint _e7 = material_element(((at_87 + 1u) + (3u * k_6)));
    uint _e14 = material_element(((at_87 + 2u) + (3u * k_6)));
    uint _e21 = material_element(((at_87 + 3u) + (3u * k_6)));
    return vec3(uintBitsToFloat(_e7), uintBitsToFloat(_e14), uintBitsToFloat(_e21));
}
vec3 material_row(uint table, uint row_1, uvec2 columns, float share) {
    vec3 _e6 = measured_table_values(table, (row_1 + columns.x));
    vec3 _e9 = measured_table_values(table, (row_1 + columns.y));
    return (_e6 + ((_e9 - _e6) * share));
}
#endif
#if defined(MODEL_13)
vec3 measured_scale(uint at_88) {
    uint _e3 = material_element((at_88 + 3u));
    uint _e7 = material_element((at_88 + 4u));
    uint _e11 = material_element((at_88 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_measured(uint at_89, vec3 light_17, vec3 view_17) {
    if ((light_17.z <= 0.0)) {
        return vec3(0.0);
    }
    vec3 _e8 = material_half_difference(light_17, view_17);
    uvec3 _e9 = measured_shape(at_89);
    float to_h = min((sqrt((_e8.x / 1.5707964)) * float(_e9.x)), float((_e9.x - 1u)));
    float to_d = min(((_e8.y / 1.5707964) * float(_e9.y)), float((_e9.y - 1u)));
    float turn_3 = ((_e8.z / 3.1415927) * float(_e9.z));
    uint h = uint(to_h);
    uint d_1 = uint(to_d);
    uint phi_2 = uint(turn_3);
    vec3 share_7 = vec3((to_h - float(h)), (to_d - float(d_1)), (turn_3 - float(phi_2)));
    uvec2 columns_1 = uvec2((phi_2 % _e9.z), ((phi_2 + 1u) % _e9.z));
    uint near_1 = ((h * _e9.y) + d_1);
    uint next_1 = ((h * _e9.y) + min((d_1 + 1u), (_e9.y - 1u)));
    uint step_1 = (((h + 1u) < _e9.x) ? _e9.y : 0u);
    uint _e75 = measured_table(at_89);
    vec3 _e79 = material_row(_e75, (near_1 * _e9.z), columns_1, share_7.z);
    vec3 _e87 = material_row(_e75, (next_1 * _e9.z), columns_1, share_7.z);
    vec3 low_1 = ((_e79 * (1.0 - share_7.y)) + (_e87 * share_7.y));
    vec3 _e95 = material_row(_e75, ((near_1 + step_1) * _e9.z), columns_1, share_7.z);
    vec3 _e104 = material_row(_e75, ((next_1 + step_1) * _e9.z), columns_1, share_7.z);
    vec3 high_1 = ((_e95 * (1.0 - share_7.y)) + (_e104 * share_7.y));
    vec3 _e108 = measured_scale(at_89);
    return ((_e108 * ((low_1 * (1.0 - share_7.x)) + (high_1 * share_7.x))) * light_17.z);
}
#endif
#if defined(MODEL_14)
uvec4 measured_anisotropic_shape(uint at_90) {
    uint _e3 = material_element((at_90 + 0u));
    uint _e6 = material_element((at_90 + 1u));
    uint _e9 = material_element((at_90 + 2u));
    uint _e12 = material_element((at_90 + 3u));
    return uvec4(_e3, _e6, _e9, _e12);
}
uint measured_anisotropic_table(uint at_91) {
    return (at_91 + 7u);
}
vec3 measured_anisotropic_scale(uint at_92) {
    uint _e3 = material_element((at_92 + 4u));
    uint _e7 = material_element((at_92 + 5u));
    uint _e11 = material_element((at_92 + 6u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}
vec3 material_measured_anisotropic(uint at_93, vec3 light_18, vec3 view_18) {
    vec3 sum_4 = vec3(0.0);
    uint corner = 0u;
    if ((light_18.z <= 0.0)) {
        return vec3(0.0);
    }
    vec4 _e8 = material_half_and_difference(light_18, view_18);
    uvec4 _e9 = measured_anisotropic_shape(at_93);
    float to_h_1 = min((sqrt((_e8.x / 1.5707964)) * float(_e9.x)), float((_e9.x - 1u)));
    float to_phi = ((_e8.y / 6.2831855) * float(_e9.y));
    float to_d_1 = min(((_e8.z / 1.5707964) * float(_e9.z)), float((_e9.z - 1u)));
    float to_psi = ((_e8.w / 3.1415927) * float(_e9.w));
    uvec4 first_3 = uvec4(uint(to_h_1), uint(to_phi), uint(to_d_1), uint(to_psi));
    vec4 share_8 = (vec4(to_h_1, to_phi, to_d_1, to_psi) - vec4(first_3));
    uvec2 columns_2 = uvec2((first_3.w % _e9.w), ((first_3.w + 1u) % _e9.w));
    uint _e62 = measured_anisotropic_table(at_93);
    bool loop_init_4 = true;
    while(true) {
        if (!loop_init_4) {
            uint _e142 = corner;
            corner = (_e142 + 1u);
        }
        loop_init_4 = false;
        uint _e68 = corner;
        if ((_e68 < 8u)) {
        } else {
            break;
        }
        {
            uint _e71 = corner;
            uint _e74 = corner;
            uint _e79 = corner;
            uvec3 far_1 = uvec3((_e71 >> 2u), ((_e74 >> 1u) & 1u), (_e79 & 1u));
            uint i_8 = min((first_3.x + far_1.x), (_e9.x - 1u));
            uint j = ((first_3.y + far_1.y) % _e9.y);
            uint k_14 = min((first_3.z + far_1.z), (_e9.z - 1u));
            float weight_1 = ((((far_1.x == 1u) ? share_8.x : (1.0 - share_8.x)) * ((far_1.y == 1u) ? share_8.y : (1.0 - share_8.y))) * ((far_1.z == 1u) ? share_8.z : (1.0 - share_8.z)));
            vec3 _e128 = sum_4;
            vec3 _e138 = material_row(_e62, (((((i_8 * _e9.y) + j) * _e9.z) + k_14) * _e9.w), columns_2, share_8.w);
            sum_4 = (_e128 + (_e138 * weight_1));
        }
    }
    vec3 _e144 = measured_anisotropic_scale(at_93);
    vec3 _e145 = sum_4;
    return ((_e144 * _e145) * light_18.z);
}
#endif
#if defined(MODE_LOCAL_SHRM) || defined(MODE_PREFILTERED) || defined(MODE_TABLE) || defined(MODE_TAPS)
vec3 material_layer(uint model, uint at_94, vec3 light_19, vec3 view_19) {
    switch(model) {
#ifdef MODEL_0
        case 0u: {
            vec3 _e4 = material_standard(at_94, light_19, view_19);
            return _e4;
        }
#endif
#ifdef MODEL_1
        case 1u: {
            vec3 _e5 = material_lambert(at_94, light_19, view_19);
            return _e5;
        }
#endif
#ifdef MODEL_2
        case 2u: {
            vec3 _e6 = material_oren_nayar(at_94, light_19, view_19);
            return _e6;
        }
#endif
#ifdef MODEL_3
        case 3u: {
            vec3 _e7 = material_phong(at_94, light_19, view_19);
            return _e7;
        }
#endif
#ifdef MODEL_4
        case 4u: {
            vec3 _e8 = material_blinn_phong(at_94, light_19, view_19);
            return _e8;
        }
#endif
#ifdef MODEL_5
        case 5u: {
            vec3 _e9 = material_microfacet(at_94, light_19, view_19);
            return _e9;
        }
#endif
#ifdef MODEL_6
        case 6u: {
            vec3 _e10 = material_torrance_sparrow(at_94, light_19, view_19);
            return _e10;
        }
#endif
#ifdef MODEL_7
        case 7u: {
            vec3 _e11 = material_ggx(at_94, light_19, view_19);
            return _e11;
        }
#endif
#ifdef MODEL_8
        case 8u: {
            vec3 _e12 = material_ward(at_94, light_19, view_19);
            return _e12;
        }
#endif
#ifdef MODEL_9
        case 9u: {
            vec3 _e13 = material_ashikhmin_shirley(at_94, light_19, view_19);
            return _e13;
        }
#endif
#ifdef MODEL_10
        case 10u: {
            vec3 _e14 = material_poulin_fournier(at_94, light_19, view_19);
            return _e14;
        }
#endif
#ifdef MODEL_11
        case 11u: {
            vec3 _e15 = material_lafortune(at_94, light_19, view_19);
            return _e15;
        }
#endif
#ifdef MODEL_12
        case 12u: {
            vec3 _e16 = material_kajiya_kay(at_94, light_19, view_19);
            return _e16;
        }
#endif
#ifdef MODEL_13
        case 13u: {
            vec3 _e17 = material_measured(at_94, light_19, view_19);
            return _e17;
        }
#endif
#ifdef MODEL_14
        case 14u: {
            vec3 _e18 = material_measured_anisotropic(at_94, light_19, view_19);
            return _e18;
        }
#endif
        default: {
            return vec3(0.0);
        }
    }
}
vec3 material_rho_hat(vec3 light_20, vec3 view_20) {
    vec3 sum_5 = vec3(0.0);
    uint at_95 = 1u;
    uint layer = 0u;
    bool loop_init_5 = true;
    while(true) {
        if (!loop_init_5) {
            uint _e30 = layer;
            layer = (_e30 + 1u);
        }
        loop_init_5 = false;
        uint _e9 = layer;
        uint _e11 = material_element(0u);
        if ((_e9 < _e11)) {
        } else {
            break;
        }
        {
            vec3 _e13 = sum_5;
            uint _e14 = at_95;
            uint _e15 = material_element(_e14);
            uint _e16 = at_95;
            vec3 _e19 = material_layer(_e15, (_e16 + 2u), light_20, view_20);
            sum_5 = (_e13 + _e19);
            uint _e21 = at_95;
            uint _e23 = at_95;
            uint _e26 = material_element((_e23 + 1u));
            at_95 = (_e21 + (2u + _e26));
        }
    }
    vec3 _e32 = sum_5;
    return _e32;
}
bool light_arrives(vec3 direction_3) {
    return true;
}
vec4 lamps_element(uint i_2) {
#ifdef LAMPS_VECTORS
    vec4 _e8 = lamps[i_2];
#else
    vec4 _e8 = texelFetch(lamps, ivec2(uvec2((i_2 % 1024u), (i_2 / 1024u))), 0);
#endif
    return _e8;
}
uint lamps_level(uint levels, float radius, vec3 centre_1, vec3 mirrored) {
    bool local_17 = false;
    if ((levels <= 2u)) {
        return 1u;
    }
    vec4 _e8 = lamps_element(1u);
    float width_1 = _e8.x;
    float away_1 = ((2.0 * asin(min((0.5 * distance(centre_1, mirrored)), 1.0))) - radius);
    vec4 _e20 = lamps_element(1u);
    vec4 _e24 = lamps_element(1u);
    float feature = min((_e20.y * away_1), _e24.z);
    bool is_whole = (abs(centre_1.z) > sin(radius));
    if (is_whole) {
        vec4 _e34 = lamps_element(1u);
        local_17 = (radius <= (_e34.w * feature));
    } else {
        local_17 = false;
    }
    bool _e39 = local_17;
    if (_e39) {
        return 0u;
    }
    if ((feature < (2.0 * width_1))) {
        return 1u;
    }
    return min((1u + uint(log2((feature / width_1)))), (levels - 1u));
}
vec3 lamps_some(Surface surface_1, vec3 before, uint first_lamp, uint count) {
    vec3 sum_6 = vec3(0.0);
    uint lamp = 0u;
    vec3 reflected = vec3(0.0);
    uint point = 0u;
    uint turn_1 = 0u;
    sum_6 = before;
    vec4 _e6 = lamps_element(0u);
    float turns = _e6.z;
    mat3x3 frame_2 = mat3x3(surface_1.tangent, cross(surface_1.normal, surface_1.tangent), surface_1.normal);
    mat3x3 to_surface = transpose(frame_2);
    vec3 view_24 = (to_surface * surface_1.view);
    vec3 mirrored_2 = vec3(-(view_24.xy), view_24.z);
    lamp = first_lamp;
    bool loop_init_6 = true;
    while(true) {
        if (!loop_init_6) {
            uint _e120 = lamp;
            lamp = (_e120 + 1u);
        }
        loop_init_6 = false;
        uint _e22 = lamp;
        if ((_e22 < (first_lamp + count))) {
        } else {
            break;
        }
        {
            uint _e27 = lamp;
            vec4 _e30 = lamps_element((2u + (3u * _e27)));
            uint _e33 = lamp;
            vec4 _e36 = lamps_element((4u + (3u * _e33)));
            uint _e44 = lamps_level(uint(_e36.y), _e30.w, (to_surface * _e30.xyz), mirrored_2);
            uint level_3 = (uint(_e36.x) + _e44);
            vec4 _e46 = lamps_element(level_3);
            uint first_4 = uint(_e46.x);
            vec4 _e49 = lamps_element(level_3);
            uint last_4 = (first_4 + uint(_e49.y));
            reflected = vec3(0.0);
            point = first_4;
            bool loop_init_7 = true;
            while(true) {
                if (!loop_init_7) {
                    uint _e106 = point;
                    point = (_e106 + 1u);
                }
                loop_init_7 = false;
                uint _e57 = point;
                if ((_e57 < last_4)) {
                } else {
                    break;
                }
                {
                    uint _e59 = point;
                    vec4 _e60 = lamps_element(_e59);
                    bool _e62 = light_arrives(_e60.xyz);
                    if (!(_e62)) {
                        continue;
                    }
                    uint _e64 = point;
                    vec4 _e65 = lamps_element(_e64);
                    vec3 incident = (to_surface * _e65.xyz);
                    turn_1 = 0u;
                    bool loop_init_8 = true;
                    while(true) {
                        if (!loop_init_8) {
                            uint _e103 = turn_1;
                            turn_1 = (_e103 + 1u);
                        }
                        loop_init_8 = false;
                        uint _e70 = turn_1;
                        if ((_e70 < uint(turns))) {
                        } else {
                            break;
                        }
                        {
                            uint _e73 = turn_1;
                            float angle_2 = ((6.2831855 * float(_e73)) / turns);
                            mat3x3 turned_3 = mat3x3(vec3(cos(angle_2), sin(angle_2), 0.0), vec3(-(sin(angle_2)), cos(angle_2), 0.0), vec3(0.0, 0.0, 1.0));
                            vec3 _e92 = reflected;
                            uint _e93 = point;
                            vec4 _e94 = lamps_element(_e93);
                            vec3 _e99 = material_rho_hat((turned_3 * incident), (turned_3 * view_24));
                            reflected = (_e92 + ((_e94.w / turns) * _e99));
                        }
                    }
                }
            }
            vec3 _e108 = sum_6;
            uint _e111 = lamp;
            vec4 _e114 = lamps_element((3u + (3u * _e111)));
            vec3 _e116 = reflected;
            sum_6 = (_e108 + (_e114.xyz * _e116));
        }
    }
    vec3 _e122 = sum_6;
    return _e122;
}
vec3 lamps_added(Surface surface_2, vec3 soft) {
    vec4 _e6 = lamps_element(0u);
    vec3 cut = ((_e6.y == 1.0) ? max(soft, vec3(0.0)) : soft);
    vec4 _e13 = lamps_element(0u);
    vec3 _e16 = lamps_some(surface_2, cut, 0u, uint(_e13.x));
    return _e16;
}
#endif
#if defined(TEXTURED)
uint texture_texels_element(uint i_3) {
    uvec4 _e8 = texelFetch(texture_texels, ivec2(uvec2((i_3 % 1024u), (i_3 / 1024u))), 0);
    return _e8.x;
}
vec3 texture_decode(vec3 encoded) {
    vec3 curve_1 = pow(((max(encoded, vec3(0.04045)) + vec3(0.055)) / vec3(1.055)), vec3(2.4));
    return mix(curve_1, (encoded / vec3(12.92)), lessThanEqual(encoded, vec3(0.04045)));
}
uint texture_wrapped(int index, int count_1, uint wrap) {
    if ((wrap == TEXTURE_CLAMP)) {
        return uint(min(max(index, 0), (count_1 - 1)));
    }
    int period = ((wrap == TEXTURE_MIRROR) ? (2 * count_1) : count_1);
    int inside_2 = (((index % period) + period) % period);
    return uint(min(inside_2, ((wrap == TEXTURE_MIRROR) ? ((period - 1) - inside_2) : inside_2)));
}
vec3 texture_texel(uvec4 level, int column_1, int row_2) {
    uint _e8 = texture_uniforms.wrap.x;
    uint _e9 = texture_wrapped(column_1, int(level.y), _e8);
    uint _e15 = texture_uniforms.wrap.y;
    uint _e16 = texture_wrapped(row_2, int(level.z), _e15);
    uint _e22 = texture_texels_element(((level.x + (_e16 * level.y)) + _e9));
    vec3 _e25 = texture_decode((vec4(_e22 & 0xFFu, _e22 >> 8 & 0xFFu, _e22 >> 16 & 0xFFu, _e22 >> 24) / 255.0).xyz);
    return _e25;
}
vec3 texture_level(uvec4 level_1, vec2 at_96, bool nearest) {
    vec2 place_1 = (at_96 * vec2(level_1.yz));
    if (nearest) {
        ivec2 first_5 = ivec2(floor(place_1));
        vec3 _e10 = texture_uniforms.factor;
        vec3 _e13 = texture_texel(level_1, first_5.x, first_5.y);
        return (_e10 * _e13);
    }
    vec2 middle_2 = (place_1 - vec2(0.5));
    vec2 floored = floor(middle_2);
    vec2 share_9 = (middle_2 - floored);
    ivec2 first_6 = ivec2(floored);
    ivec2 next_2 = (first_6 + ivec2(1));
    vec3 _e26 = texture_uniforms.factor;
    vec3 _e29 = texture_texel(level_1, first_6.x, first_6.y);
    vec3 _e32 = texture_texel(level_1, next_2.x, first_6.y);
    vec3 _e37 = texture_texel(level_1, first_6.x, next_2.y);
    vec3 _e40 = texture_texel(level_1, next_2.x, next_2.y);
    return (_e26 * mix(mix(_e29, _e32, share_9.x), mix(_e37, _e40, share_9.x), share_9.y));
}
vec3 texture_color(vec2 at_97, vec2 across_1, vec2 down) {
    float level_2 = 0.0;
    bool local_18 = false;
    uvec4 _e6 = texture_uniforms.levels[0];
    vec2 size_5 = vec2(_e6.yz);
    float square_2 = max(dot((across_1 * size_5), (across_1 * size_5)), dot((down * size_5), (down * size_5)));
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
            local_18 = (most_2 > 0u);
        } else {
            local_18 = false;
        }
        bool _e45 = local_18;
        vec3 _e46 = texture_level(_e34, at_97, _e45);
        return _e46;
    }
    float _e47 = level_2;
    if ((_e47 >= float(most_2))) {
        uvec4 _e53 = texture_uniforms.levels[most_2];
        vec3 _e55 = texture_level(_e53, at_97, false);
        return _e55;
    }
    float _e56 = level_2;
    uint fine = uint(_e56);
    uvec4 _e61 = texture_uniforms.levels[fine];
    vec3 _e63 = texture_level(_e61, at_97, false);
    uvec4 _e69 = texture_uniforms.levels[(fine + 1u)];
    vec3 _e71 = texture_level(_e69, at_97, false);
    float _e72 = level_2;
    return mix(_e63, _e71, (_e72 - float(fine)));
}
vec3 texture_at_fragment(vec2 coordinates, float nearness, float samples) {
    vec2 sum_23 = (coordinates * nearness);
    float scale_2 = (1.0 / (nearness * samples));
    vec2 _e7 = dFdx(sum_23);
    float _e8 = dFdx(nearness);
    vec2 across_11 = ((_e7 - (coordinates * _e8)) * scale_2);
    vec2 _e12 = dFdy(sum_23);
    float _e13 = dFdy(nearness);
    vec2 down_1 = ((_e12 - (coordinates * _e13)) * scale_2);
    vec3 _e17 = texture_color(coordinates, across_11, down_1);
    return _e17;
}
vec4 base_color_number(uint column_2, uint row_3) {
    vec4 _e5 = texelFetch(base_color_numbers, ivec2(uvec2(column_2, row_3)), 0);
    return _e5;
}
vec3 base_color_several(vec3 color, float whole) {
    vec3 average = (color + ((vec3(1.0) - color) / vec3(21.0)));
    return (((average * average) * whole) / (vec3(1.0) - (average * (1.0 - whole))));
}
vec3 base_color(uint row_4, vec3 color_1, vec3 radiance_1, Surface surface_3) {
    vec3 light_21 = vec3(0.0);
    uint nodes = ((uvec2(textureSize(base_color_numbers, 0).xy).x - BASE_COLOR_NUMBERS) / 2u);
    float place_2 = (sqrt(clamp(dot(surface_3.normal, surface_3.view), 0.0, 1.0)) * float((nodes - 1u)));
    uint node_2 = min(uint(place_2), (nodes - 2u));
    uint column_4 = (BASE_COLOR_NUMBERS + (2u * node_2));
    float share_10 = (place_2 - float(node_2));
    vec4 _e32 = base_color_number(column_4, row_4);
    vec4 _e35 = base_color_number((column_4 + 2u), row_4);
    vec4 facets = mix(_e32, _e35, share_10);
    vec4 _e39 = base_color_number((column_4 + 1u), row_4);
    vec4 _e42 = base_color_number((column_4 + 3u), row_4);
    vec4 layers = mix(_e39, _e42, share_10);
    vec3 n_3 = surface_3.normal;
    vec4 _e46 = base_color_number(0u, row_4);
    light_21 = _e46.xyz;
    vec3 _e49 = light_21;
    vec4 _e51 = base_color_number(1u, row_4);
    light_21 = (_e49 + (_e51.xyz * n_3.y));
    vec3 _e56 = light_21;
    vec4 _e58 = base_color_number(2u, row_4);
    light_21 = (_e56 + (_e58.xyz * n_3.z));
    vec3 _e63 = light_21;
    vec4 _e65 = base_color_number(3u, row_4);
    light_21 = (_e63 + (_e65.xyz * n_3.x));
    vec3 _e70 = light_21;
    vec4 _e72 = base_color_number(4u, row_4);
    light_21 = (_e70 + (_e72.xyz * (n_3.x * n_3.y)));
    vec3 _e79 = light_21;
    vec4 _e81 = base_color_number(5u, row_4);
    light_21 = (_e79 + (_e81.xyz * (n_3.y * n_3.z)));
    vec3 _e88 = light_21;
    vec4 _e90 = base_color_number(6u, row_4);
    light_21 = (_e88 + (_e90.xyz * (((3.0 * n_3.z) * n_3.z) - 1.0)));
    vec3 _e101 = light_21;
    vec4 _e103 = base_color_number(7u, row_4);
    light_21 = (_e101 + (_e103.xyz * (n_3.x * n_3.z)));
    vec3 _e110 = light_21;
    vec4 _e112 = base_color_number(8u, row_4);
    light_21 = (_e110 + (_e112.xyz * ((n_3.x * n_3.x) - (n_3.y * n_3.y))));
    vec4 _e124 = base_color_number(9u, row_4);
    vec3 _e125 = light_21;
    vec3 matte_1 = (max(_e125, vec3(0.0)) * (facets.x * (1.0 - _e124.w)));
    vec4 _e136 = base_color_number(10u, row_4);
    vec4 _e138 = base_color_number(11u, row_4);
    vec4 _e140 = base_color_number(12u, row_4);
    vec3 several = _e140.xyz;
    vec3 beside_1 = (((_e138.xyz * layers.y) + vec3(layers.x)) + vec3((_e136.w * facets.w)));
    vec3 _e162 = base_color_several(_e124.xyz, _e138.w);
    vec3 of_mean = ((beside_1 + (mix(_e136.xyz, _e124.xyz, _e124.w) * facets.z)) + (mix(several, _e162, _e124.w) * facets.y));
    vec3 _e175 = base_color_several(color_1, _e138.w);
    vec3 of_color = ((beside_1 + (mix(_e136.xyz, color_1, _e124.w) * facets.z)) + (mix(several, _e175, _e124.w) * facets.y));
    vec3 base_3 = (_e124.xyz * matte_1);
    vec3 rest_2 = max((radiance_1 - base_3), vec3(0.0));
    vec3 whole_2 = (base_3 + rest_2);
    vec3 ratio = mix(vec3(1.0), (of_color / max(of_mean, vec3(1e-30))), greaterThan(of_mean, vec3(0.0)));
    vec3 scale_3 = (((color_1 * matte_1) + (rest_2 * ratio)) / max(whole_2, vec3(1e-30)));
    return mix(radiance_1, (radiance_1 * scale_3), greaterThan(whole_2, vec3(0.0)));
}
#endif
#if defined(MODE_TABLE)
TurnedAngles turned_angles(mat3x3 frame) {
    vec3 x_13 = frame[0];
    vec3 n_4 = frame[2];
    float sine_7 = length(n_4.xy);
    vec2 alpha = ((sine_7 > 0.0) ? (n_4.xy / vec2(sine_7)) : vec2(1.0, 0.0));
    float along_3 = dot(alpha, x_13.xy);
    vec2 gamma = vec2(((n_4.z * along_3) - (sine_7 * x_13.z)), ((alpha.x * x_13.y) - (alpha.y * x_13.x)));
    return TurnedAngles(alpha, vec2(n_4.z, sine_7), gamma);
}
uint turned_entries(uint l) {
    return (((2u * l) + 1u) * ((l / 2u) + 1u));
}
uint quarter_turn_column(uint l_1, uint row_5, uint k_7) {
    uint odd = ((l_1 + ((row_5 < l_1) ? 1u : 0u)) % 2u);
    bool is_even = ((row_5 % 2u) == 0u);
    uint m_2 = ((is_even ? odd : (2u - odd)) + (2u * k_7));
    if ((m_2 > l_1)) {
        return ((2u * l_1) + 1u);
    }
    return (is_even ? (l_1 + m_2) : (l_1 - m_2));
}
void turn_about_z(uint l_2, vec2 angle_1, inout vec3 band[29]) {
    vec2 multiple = vec2(1.0, 0.0);
    uint m_1 = 1u;
    bool loop_init_9 = true;
    while(true) {
        if (!loop_init_9) {
            uint _e59 = m_1;
            m_1 = (_e59 + 1u);
        }
        loop_init_9 = false;
        uint _e9 = m_1;
        if ((_e9 <= l_2)) {
        } else {
            break;
        }
        {
            float _e12 = multiple.x;
            float _e16 = multiple.y;
            float _e21 = multiple.y;
            float _e25 = multiple.x;
            multiple = vec2(((_e12 * angle_1.x) + (_e16 * angle_1.y)), ((_e21 * angle_1.x) - (_e25 * angle_1.y)));
            uint _e30 = m_1;
            vec3 even = band[(l_2 + _e30)];
            uint _e34 = m_1;
            vec3 odd_1 = band[(l_2 - _e34)];
            uint _e38 = m_1;
            float _e42 = multiple.x;
            float _e45 = multiple.y;
            band[(l_2 + _e38)] = ((even * _e42) - (odd_1 * _e45));
            uint _e48 = m_1;
            float _e52 = multiple.y;
            float _e55 = multiple.x;
            band[(l_2 - _e48)] = ((even * _e52) + (odd_1 * _e55));
        }
    }
    return;
}
vec2 quarter_turns_element(uint i_4) {
#ifdef QUARTER_TURNS_VECTORS
    vec4 _e8 = quarter_turns[i_4];
#else
    vec4 _e8 = texelFetch(quarter_turns, ivec2(uvec2((i_4 % 1024u), (i_4 / 1024u))), 0);
#endif
    return _e8.xy;
}
void turn_about_x(uint l_3, uint entry, uint back, inout vec3 band_1[29]) {
    uint row_6 = 0u;
    vec3 sum_7 = vec3(0.0);
    uint k_8 = 0u;
    uint count_2 = ((l_3 / 2u) + 1u);
    vec3 before_2[29] = band_1;
    bool loop_init_10 = true;
    while(true) {
        if (!loop_init_10) {
            uint _e46 = row_6;
            row_6 = (_e46 + 1u);
        }
        loop_init_10 = false;
        uint _e11 = row_6;
        if ((_e11 <= (2u * l_3))) {
        } else {
            break;
        }
        {
            sum_7 = vec3(0.0);
            k_8 = 0u;
            bool loop_init_11 = true;
            while(true) {
                if (!loop_init_11) {
                    uint _e40 = k_8;
                    k_8 = (_e40 + 1u);
                }
                loop_init_11 = false;
                uint _e20 = k_8;
                if ((_e20 < count_2)) {
                } else {
                    break;
                }
                {
                    uint _e22 = row_6;
                    uint _e23 = k_8;
                    uint _e24 = quarter_turn_column(l_3, _e22, _e23);
                    if ((_e24 <= (2u * l_3))) {
                        vec3 _e28 = sum_7;
                        uint _e29 = row_6;
                        uint _e32 = k_8;
                        vec2 _e34 = quarter_turns_element(((entry + (_e29 * count_2)) + _e32));
                        sum_7 = (_e28 + (_e34[back] * before_2[_e24]));
                    }
                }
            }
            uint _e42 = row_6;
            vec3 _e44 = sum_7;
            band_1[_e42] = _e44;
        }
    }
    return;
}
void turn_band(uint l_4, uint entry_1, TurnedAngles angles, inout vec3 band_2[29]) {
    turn_about_z(l_4, angles.alpha, band_2);
    turn_about_x(l_4, entry_1, 0u, band_2);
    turn_about_z(l_4, angles.beta, band_2);
    turn_about_x(l_4, entry_1, 1u, band_2);
    turn_about_z(l_4, angles.gamma, band_2);
    return;
}
#endif
#if defined(SHOWS_SKY)
vec3 background(uint kind, vec3 flat_radiance, vec3 ray_1) {
    switch(kind) {
        case 0u: {
            vec3 _e4 = lat_long_sample(map, ray_1);
            return _e4;
        }
        case 1u: {
            uint _e10 = map_uniforms.parts[0].edge;
            Taps _e11 = cube_taps(_e10, ray_1);
            vec3 _e13 = cube_blend(map, _e11, 0u);
            return _e13;
        }
        default: {
            return flat_radiance;
        }
    }
}
#endif
#if defined(SHOWS_DIFFERENCE)
vec3 difference(vec3 value_1, vec3 compared) {
    return abs((value_1 - compared));
}
#endif
#if defined(MODE_TABLE)
vec2 table_place_of(TableUniforms table_1, vec3 view_21) {
    float z_4 = ((table_1.mirrored == 1u) ? abs(view_21.z) : max(view_21.z, 0.0));
    float across_12 = ((z_4 > 0.0) ? (1.0 + z_4) : max(length(view_21.xy), 1e-30));
    return (vec2(view_21.x, -(view_21.y)) / vec2(across_12));
}
vec3 table_coefficient_at(TableUniforms table_2, TablePoint at_98, uint i_5) {
    if ((table_2.channels == 1u)) {
        vec4 _e12 = textureLod(table_map, vec3(at_98.place, (i_5 / 4u)), 0.0);
        return vec3(_e12[(i_5 % 4u)]);
    }
    vec4 _e21 = textureLod(table_map, vec3(at_98.place, i_5), 0.0);
    return _e21.xyz;
}
vec4 table_light_element(uint i_6) {
#ifdef TABLE_LIGHT_VECTORS
    vec4 _e8 = table_light[i_6];
#else
    vec4 _e8 = texelFetch(table_light, ivec2(uvec2((i_6 % 1024u), (i_6 / 1024u))), 0);
#endif
    return _e8;
}
vec3 table_light_at(TableUniforms table_3, TablePoint at_99, uint i_7) {
    vec4 _e3 = table_light_element(i_7);
    return _e3.xyz;
}
vec3 table_radiance(TableUniforms table_4, TablePoint at_100, mat3x3 frame_1) {
    vec3 radiance_2 = vec3(0.0);
    uint entry_2 = 0u;
    uint l_5 = 1u;
    vec3 band_3[29] = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    uint row_7 = 0u;
    uint row_8 = 0u;
    uint known = min(table_4.rows, table_4.light_rows);
    vec3 _e7 = table_coefficient_at(table_4, at_100, 0u);
    vec3 _e9 = table_light_at(table_4, at_100, 0u);
    radiance_2 = (_e7 * _e9);
    TurnedAngles _e12 = turned_angles(frame_1);
    bool loop_init_12 = true;
    while(true) {
        if (!loop_init_12) {
            uint _e70 = l_5;
            l_5 = (_e70 + 1u);
        }
        loop_init_12 = false;
        uint _e17 = l_5;
        uint _e18 = l_5;
        if (((_e17 * _e18) < known)) {
        } else {
            break;
        }
        {
            band_3 = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
            row_7 = 0u;
            bool loop_init_13 = true;
            while(true) {
                if (!loop_init_13) {
                    uint _e39 = row_7;
                    row_7 = (_e39 + 1u);
                }
                loop_init_13 = false;
                uint _e25 = row_7;
                uint _e27 = l_5;
                if ((_e25 <= (2u * _e27))) {
                } else {
                    break;
                }
                {
                    uint _e30 = row_7;
                    uint _e32 = l_5;
                    uint _e33 = l_5;
                    uint _e35 = row_7;
                    vec3 _e37 = table_light_at(table_4, at_100, ((_e32 * _e33) + _e35));
                    band_3[_e30] = _e37;
                }
            }
            uint _e41 = l_5;
            uint _e42 = entry_2;
            turn_band(_e41, _e42, _e12, band_3);
            row_8 = 0u;
            bool loop_init_14 = true;
            while(true) {
                if (!loop_init_14) {
                    uint _e63 = row_8;
                    row_8 = (_e63 + 1u);
                }
                loop_init_14 = false;
                uint _e45 = row_8;
                uint _e47 = l_5;
                if ((_e45 <= (2u * _e47))) {
                } else {
                    break;
                }
                {
                    vec3 _e50 = radiance_2;
                    uint _e51 = l_5;
                    uint _e52 = l_5;
                    uint _e54 = row_8;
                    vec3 _e56 = table_coefficient_at(table_4, at_100, ((_e51 * _e52) + _e54));
                    uint _e57 = row_8;
                    vec3 _e59 = band_3[_e57];
                    radiance_2 = (_e50 + (_e56 * _e59));
                }
            }
            uint _e65 = entry_2;
            uint _e66 = l_5;
            uint _e67 = turned_entries(_e66);
            entry_2 = (_e65 + _e67);
        }
    }
    vec3 _e72 = radiance_2;
    return _e72;
}
vec3 table_reflected(Surface surface_4) {
    mat3x3 frame_3 = mat3x3(surface_4.tangent, cross(surface_4.normal, surface_4.tangent), surface_4.normal);
    TableUniforms _e8 = table_uniforms;
    vec2 _e11 = table_place_of(_e8, (surface_4.view * frame_3));
    TableUniforms _e13 = table_uniforms;
    vec3 _e20 = table_radiance(_e13, TablePoint(((0.5 * _e11) + vec2(0.5))), frame_3);
    return _e20;
}
#endif
#if defined(MODE_LOCAL_SHRM)
vec3 local_shrm_row(MapPart part_1, Taps taps_2, uint row_9, vec4 share_1) {
    uint first_7 = (part_1.first + (6u * row_9));
    vec3 _e11 = cube_load(map, taps_2.texel[0], first_7);
    vec3 _e17 = cube_load(map, taps_2.texel[1], first_7);
    vec3 _e24 = cube_load(map, taps_2.texel[2], first_7);
    vec3 _e31 = cube_load(map, taps_2.texel[3], first_7);
    return ((((_e11 * share_1.x) + (_e17 * share_1.y)) + (_e24 * share_1.z)) + (_e31 * share_1.w));
}
vec3 local_shrm(Surface surface_5, MapPart part_2) {
    vec4 x_6 = vec4(0.0);
    vec4 y_1 = vec4(0.0);
    vec4 z = vec4(0.0);
    uint k_9 = 0u;
    vec2 beta = vec2(0.0);
    vec3 sum_8 = vec3(0.0);
    vec4 cosine_7 = vec4(0.0);
    vec4 sine = vec4(0.0);
    uint q_1 = 0u;
    vec4 below = vec4(0.0);
    vec4 value_2 = vec4(0.0);
    uint p_1 = 0u;
    vec3 _e4 = surface_central(surface_5, part_2.centre);
    Taps _e5 = cube_taps(part_2.edge, _e4);
    vec3 v_3 = surface_5.view;
    bool loop_init_15 = true;
    while(true) {
        if (!loop_init_15) {
            uint _e66 = k_9;
            k_9 = (_e66 + 1u);
        }
        loop_init_15 = false;
        uint _e12 = k_9;
        if ((_e12 < 4u)) {
        } else {
            break;
        }
        {
            uint _e17 = k_9;
            vec3 _e19 = cube_centre(part_2.edge, _e5.texel[_e17]);
            vec3 c_3 = normalize(_e19);
            float sine_8 = sqrt(((c_3.x * c_3.x) + (c_3.y * c_3.y)));
            beta = vec2(1.0, 0.0);
            if ((sine_8 > 0.0)) {
                beta = (c_3.xy / vec2(sine_8));
            }
            uint _e38 = k_9;
            float _e42 = beta.x;
            float _e46 = beta.y;
            x_6[_e38] = dot(v_3, vec3((c_3.z * _e42), (c_3.z * _e46), -(sine_8)));
            uint _e51 = k_9;
            float _e55 = beta.x;
            float _e59 = beta.y;
            y_1[_e51] = ((v_3.y * _e55) - (v_3.x * _e59));
            uint _e62 = k_9;
            z[_e62] = dot(v_3, c_3);
        }
    }
    cosine_7 = _e5.weight;
    uint columns_3 = ((part_2.zonal == 1u) ? 0u : part_2.degree);
    bool loop_init_16 = true;
    while(true) {
        if (!loop_init_16) {
            uint _e173 = q_1;
            q_1 = (_e173 + 1u);
        }
        loop_init_16 = false;
        uint _e84 = q_1;
        if ((_e84 <= columns_3)) {
        } else {
            break;
        }
        {
            below = vec4(0.0);
            uint _e89 = q_1;
            uint _e90 = q_1;
            vec2 _e91 = harmonics_constant(_e89, _e90);
            value_2 = vec4(_e91.x);
            uint _e95 = q_1;
            p_1 = _e95;
            bool loop_init_17 = true;
            while(true) {
                if (!loop_init_17) {
                    uint _e156 = p_1;
                    p_1 = (_e156 + 1u);
                }
                loop_init_17 = false;
                uint _e97 = p_1;
                if ((_e97 <= part_2.degree)) {
                } else {
                    break;
                }
                {
                    uint _e100 = p_1;
                    uint _e101 = q_1;
                    if ((_e100 > _e101)) {
                        uint _e103 = p_1;
                        uint _e104 = q_1;
                        vec2 _e105 = harmonics_constant(_e103, _e104);
                        vec4 _e106 = z;
                        vec4 _e107 = value_2;
                        vec4 _e111 = below;
                        vec4 next_3 = (((_e106 * _e107) * _e105.x) - (_e111 * _e105.y));
                        vec4 _e115 = value_2;
                        below = _e115;
                        value_2 = next_3;
                    }
                    if ((part_2.zonal == 1u)) {
                        vec3 _e119 = sum_8;
                        uint _e120 = p_1;
                        vec4 _e121 = value_2;
                        vec4 _e122 = cosine_7;
                        vec3 _e124 = local_shrm_row(part_2, _e5, _e120, (_e121 * _e122));
                        sum_8 = (_e119 + _e124);
                    } else {
                        vec3 _e126 = sum_8;
                        uint _e127 = p_1;
                        uint _e128 = p_1;
                        uint _e130 = p_1;
                        uint _e132 = q_1;
                        vec4 _e134 = value_2;
                        vec4 _e135 = cosine_7;
                        vec3 _e137 = local_shrm_row(part_2, _e5, (((_e127 * _e128) + _e130) + _e132), (_e134 * _e135));
                        sum_8 = (_e126 + _e137);
                        uint _e139 = q_1;
                        if ((_e139 > 0u)) {
                            vec3 _e142 = sum_8;
                            uint _e143 = p_1;
                            uint _e144 = p_1;
                            uint _e146 = p_1;
                            uint _e148 = q_1;
                            vec4 _e150 = value_2;
                            vec4 _e151 = sine;
                            vec3 _e153 = local_shrm_row(part_2, _e5, (((_e143 * _e144) + _e146) - _e148), (_e150 * _e151));
                            sum_8 = (_e142 + _e153);
                        }
                    }
                }
            }
            vec4 _e158 = cosine_7;
            vec4 _e159 = x_6;
            vec4 _e161 = sine;
            vec4 _e162 = y_1;
            vec4 turned_4 = ((_e158 * _e159) - (_e161 * _e162));
            vec4 _e165 = cosine_7;
            vec4 _e166 = y_1;
            vec4 _e168 = sine;
            vec4 _e169 = x_6;
            sine = ((_e165 * _e166) + (_e168 * _e169));
            cosine_7 = turned_4;
        }
    }
    vec3 _e175 = sum_8;
    return _e175;
}
vec3 local_shrm_of_parts(Surface surface_6) {
    vec3 sum_9 = vec3(0.0);
    uint k_10 = 0u;
    bool loop_init_18 = true;
    while(true) {
        if (!loop_init_18) {
            uint _e27 = k_10;
            k_10 = (_e27 + 1u);
        }
        loop_init_18 = false;
        uint _e6 = k_10;
        uint _e9 = map_uniforms.count;
        if ((_e6 < _e9)) {
        } else {
            break;
        }
        {
            vec3 _e11 = sum_9;
            uint _e14 = k_10;
            float _e17 = map_uniforms.parts[_e14].weight;
            uint _e20 = k_10;
            MapPart _e22 = map_uniforms.parts[_e20];
            vec3 _e23 = local_shrm(surface_6, _e22);
            sum_9 = (_e11 + (_e17 * _e23));
        }
    }
    vec3 _e29 = sum_9;
    return _e29;
}
#endif
#if defined(MODE_CABRAL)
vec3 cabral(Surface surface_7, MapPart part_3) {
    vec3 points[12] = CABRAL_POINTS;
    uvec3 triangles[20] = CABRAL_TRIANGLES;
    uvec3 vertices = uvec3(0u);
    float most_1 = -4.0;
    uint triangle = 0u;
    vec3 v_4 = surface_7.view;
    bool loop_init_19 = true;
    while(true) {
        if (!loop_init_19) {
            uint _e37 = triangle;
            triangle = (_e37 + 1u);
        }
        loop_init_19 = false;
        uint _e14 = triangle;
        if ((_e14 < 20u)) {
        } else {
            break;
        }
        {
            uint _e17 = triangle;
            uvec3 corners = triangles[_e17];
            vec3 _e22 = points[corners.x];
            vec3 _e26 = points[corners.y];
            vec3 _e31 = points[corners.z];
            float middle_3 = ((dot(_e22, v_4) + dot(_e26, v_4)) + dot(_e31, v_4));
            float _e34 = most_1;
            if ((middle_3 > _e34)) {
                vertices = corners;
                most_1 = middle_3;
            }
        }
    }
    uint _e40 = vertices.x;
    vec3 a_2 = points[_e40];
    uint _e44 = vertices.y;
    vec3 b = points[_e44];
    uint _e48 = vertices.z;
    vec3 c_4 = points[_e48];
    vec3 volumes = max(vec3(dot(v_4, cross(b, c_4)), dot(v_4, cross(c_4, a_2)), dot(v_4, cross(a_2, b))), vec3(0.0));
    vec3 shares = (volumes / vec3(((volumes.x + volumes.y) + volumes.z)));
    vec3 _e70 = surface_central(surface_7, part_3.centre);
    Taps _e71 = cube_taps(part_3.edge, _e70);
    uint _e76 = vertices.x;
    vec3 _e79 = cube_blend(map, _e71, (part_3.first + (6u * _e76)));
    uint _e86 = vertices.y;
    vec3 _e89 = cube_blend(map, _e71, (part_3.first + (6u * _e86)));
    uint _e97 = vertices.z;
    vec3 _e100 = cube_blend(map, _e71, (part_3.first + (6u * _e97)));
    return (((_e79 * shares.x) + (_e89 * shares.y)) + (_e100 * shares.z));
}
vec3 cabral_of_parts(Surface surface_8) {
    vec3 sum_10 = vec3(0.0);
    uint k_11 = 0u;
    bool loop_init_20 = true;
    while(true) {
        if (!loop_init_20) {
            uint _e27 = k_11;
            k_11 = (_e27 + 1u);
        }
        loop_init_20 = false;
        uint _e6 = k_11;
        uint _e9 = map_uniforms.count;
        if ((_e6 < _e9)) {
        } else {
            break;
        }
        {
            vec3 _e11 = sum_10;
            uint _e14 = k_11;
            float _e17 = map_uniforms.parts[_e14].weight;
            uint _e20 = k_11;
            MapPart _e22 = map_uniforms.parts[_e20];
            vec3 _e23 = cabral(surface_8, _e22);
            sum_10 = (_e11 + (_e17 * _e23));
        }
    }
    vec3 _e29 = sum_10;
    return _e29;
}
#endif
#if defined(MODE_KAUTZ_MCCOOL)
vec3 kautz_mccool(Surface surface_9, MapPart part_4) {
    vec3 _e3 = surface_central(surface_9, part_4.centre);
    float _e9 = angles_angle(length(cross(_e3, surface_9.view)), dot(_e3, surface_9.view));
    uint last_5 = (part_4.slices - 1u);
    float position_1 = ((_e9 / 3.1415927) * float(last_5));
    uint low_2 = min(uint(position_1), last_5);
    uint high_2 = min((low_2 + 1u), last_5);
    float share_11 = (position_1 - float(low_2));
    Taps _e25 = cube_taps(part_4.edge, _e3);
    vec3 _e31 = cube_blend(map, _e25, (part_4.first + (6u * low_2)));
    vec3 _e37 = cube_blend(map, _e25, (part_4.first + (6u * high_2)));
    return (_e31 + ((_e37 - _e31) * share_11));
}
vec3 kautz_mccool_of_parts(Surface surface_10) {
    vec3 sum_11 = vec3(0.0);
    uint k_12 = 0u;
    bool loop_init_21 = true;
    while(true) {
        if (!loop_init_21) {
            uint _e27 = k_12;
            k_12 = (_e27 + 1u);
        }
        loop_init_21 = false;
        uint _e6 = k_12;
        uint _e9 = map_uniforms.count;
        if ((_e6 < _e9)) {
        } else {
            break;
        }
        {
            vec3 _e11 = sum_11;
            uint _e14 = k_12;
            float _e17 = map_uniforms.parts[_e14].weight;
            uint _e20 = k_12;
            MapPart _e22 = map_uniforms.parts[_e20];
            vec3 _e23 = kautz_mccool(surface_10, _e22);
            sum_11 = (_e11 + (_e17 * _e23));
        }
    }
    vec3 _e29 = sum_11;
    return _e29;
}
#endif
#if defined(MODE_PREFILTERED)
vec3 prefiltered(Surface surface_11, MapPart part_5) {
    vec3 _e5 = surface_central(surface_11, part_5.centre);
    Taps _e6 = cube_taps(part_5.edge, _e5);
    vec3 _e8 = cube_blend(map, _e6, part_5.first);
    return _e8;
}
vec3 prefiltered_of_parts(Surface surface_12) {
    vec3 sum_12 = vec3(0.0);
    uint k_13 = 0u;
    bool loop_init_22 = true;
    while(true) {
        if (!loop_init_22) {
            uint _e27 = k_13;
            k_13 = (_e27 + 1u);
        }
        loop_init_22 = false;
        uint _e6 = k_13;
        uint _e9 = map_uniforms.count;
        if ((_e6 < _e9)) {
        } else {
            break;
        }
        {
            vec3 _e11 = sum_12;
            uint _e14 = k_13;
            float _e17 = map_uniforms.parts[_e14].weight;
            uint _e20 = k_13;
            MapPart _e22 = map_uniforms.parts[_e20];
            vec3 _e23 = prefiltered(surface_12, _e22);
            sum_12 = (_e11 + (_e17 * _e23));
        }
    }
    vec3 _e29 = sum_12;
    return _e29;
}
#endif
#if defined(MODE_IRRADIANCE)
vec3 irradiance_row(uint row_10) {
    vec4 _e6 = texelFetch(map, ivec3(uvec2(row_10, 0u), 0), 0);
    return _e6.xyz;
}
vec3 irradiance(Surface surface_13) {
    vec3 sum_13 = vec3(0.0);
    float cosine_8 = 1.0;
    float sine_1 = 0.0;
    uint q_2 = 0u;
    float below_1 = 0.0;
    float value_3 = 0.0;
    uint p_2 = 0u;
    vec3 n_5 = surface_13.normal;
    bool loop_init_23 = true;
    while(true) {
        if (!loop_init_23) {
            uint _e91 = q_2;
            q_2 = (_e91 + 1u);
        }
        loop_init_23 = false;
        uint _e11 = q_2;
        if ((_e11 <= 2u)) {
        } else {
            break;
        }
        {
            below_1 = 0.0;
            uint _e16 = q_2;
            uint _e17 = q_2;
            vec2 _e18 = harmonics_constant(_e16, _e17);
            value_3 = _e18.x;
            uint _e21 = q_2;
            p_2 = _e21;
            bool loop_init_24 = true;
            while(true) {
                if (!loop_init_24) {
                    uint _e74 = p_2;
                    p_2 = (_e74 + 1u);
                }
                loop_init_24 = false;
                uint _e23 = p_2;
                if ((_e23 <= 2u)) {
                } else {
                    break;
                }
                {
                    uint _e26 = p_2;
                    uint _e27 = q_2;
                    if ((_e26 > _e27)) {
                        uint _e29 = p_2;
                        uint _e30 = q_2;
                        vec2 _e31 = harmonics_constant(_e29, _e30);
                        float _e33 = value_3;
                        float _e37 = below_1;
                        float next_4 = (((n_5.z * _e33) * _e31.x) - (_e37 * _e31.y));
                        float _e41 = value_3;
                        below_1 = _e41;
                        value_3 = next_4;
                    }
                    vec3 _e42 = sum_13;
                    uint _e43 = p_2;
                    uint _e44 = p_2;
                    uint _e46 = p_2;
                    uint _e48 = q_2;
                    vec3 _e50 = irradiance_row((((_e43 * _e44) + _e46) + _e48));
                    float _e51 = value_3;
                    float _e52 = cosine_8;
                    sum_13 = (_e42 + (_e50 * (_e51 * _e52)));
                    uint _e56 = q_2;
                    if ((_e56 > 0u)) {
                        vec3 _e59 = sum_13;
                        uint _e60 = p_2;
                        uint _e61 = p_2;
                        uint _e63 = p_2;
                        uint _e65 = q_2;
                        vec3 _e67 = irradiance_row((((_e60 * _e61) + _e63) - _e65));
                        float _e68 = value_3;
                        float _e69 = sine_1;
                        sum_13 = (_e59 + (_e67 * (_e68 * _e69)));
                    }
                }
            }
            float _e76 = cosine_8;
            float _e79 = sine_1;
            float turned_5 = ((_e76 * n_5.x) - (_e79 * n_5.y));
            float _e83 = cosine_8;
            float _e86 = sine_1;
            sine_1 = ((_e83 * n_5.y) + (_e86 * n_5.x));
            cosine_8 = turned_5;
        }
    }
    vec3 _e93 = sum_13;
    return _e93;
}
#endif
#if defined(MODE_MIRROR)
vec3 mirror(Surface surface_14) {
    vec3 _e3 = surface_central(surface_14, CENTRE_REFLECTION);
    vec3 _e4 = lat_long_sample(map, _e3);
    return _e4;
}
#endif
#if defined(MODE_TAPS)
vec3 taps_radiance(Surface surface_15);
#endif
#if defined(SHOWS_MESH)
vec3 shade_mode(Surface surface_16) {
    {
#ifdef MODE_LOCAL_SHRM
        {
            vec3 _e2 = local_shrm_of_parts(surface_16);
            vec3 _e3 = lamps_added(surface_16, _e2);
            return _e3;
        }
#endif
#ifdef MODE_CABRAL
        {
            vec3 _e4 = cabral_of_parts(surface_16);
            return _e4;
        }
#endif
#ifdef MODE_KAUTZ_MCCOOL
        {
            vec3 _e5 = kautz_mccool_of_parts(surface_16);
            return _e5;
        }
#endif
#ifdef MODE_PREFILTERED
        {
            vec3 _e6 = prefiltered_of_parts(surface_16);
            vec3 _e7 = lamps_added(surface_16, _e6);
            return _e7;
        }
#endif
#ifdef MODE_IRRADIANCE
        {
            vec3 _e8 = irradiance(surface_16);
            return _e8;
        }
#endif
#ifdef MODE_MIRROR
        {
            vec3 _e9 = mirror(surface_16);
            return _e9;
        }
#endif
#ifdef MODE_TAPS
        {
            vec3 _e10 = taps_radiance(surface_16);
            vec3 _e11 = lamps_added(surface_16, _e10);
            return _e11;
        }
#endif
#ifdef MODE_TABLE
        {
            vec3 _e12 = table_reflected(surface_16);
            vec3 _e13 = lamps_added(surface_16, _e12);
            return _e13;
        }
#endif
        {
            return vec3(0.0);
        }
    }
}
vec3 mesh_radiance(PageVertex at_101, Surface surface_17, vec3 radiance_3) {
    {
#ifdef TEXTURED
        {
            vec3 _e8 = texture_at_fragment(at_101.coordinates, at_101.position.w, 1.0);
            vec3 _e10 = base_color(0u, _e8, radiance_3, surface_17);
            return _e10;
        }
#endif
        {
            return radiance_3;
        }
    }
}
#endif
#if defined(SHOWS_DIFFERENCE)
vec4 difference_shown(uvec2 pixel) {
    vec4 value_4 = texelFetch(first_picture, ivec2(pixel), 0);
    if ((value_4.w == 0.0)) {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    vec4 _e15 = texelFetch(second_picture, ivec2(pixel), 0);
    vec3 _e17 = difference(value_4.xyz, _e15.xyz);
    float _e20 = page.amplify;
    vec3 shown = (_e17 * _e20);
    float _e24 = page.gain;
    uint _e27 = page.tone;
    vec3 _e28 = develop(shown, _e24, _e27);
    vec3 _e29 = develop_encode(_e28);
    return vec4(_e29, 1.0);
}
#endif
#if defined(SHOWS_MESH) || defined(SHOWS_SKY)
vec4 page_shown(vec3 radiance_4) {
    uint _e3 = page.raw;
    if ((_e3 == 1u)) {
        return vec4(radiance_4, 1.0);
    }
    float _e10 = page.gain;
    uint _e13 = page.tone;
    vec3 _e14 = develop(radiance_4, _e10, _e13);
    vec3 _e15 = develop_encode(_e14);
    return vec4(_e15, 1.0);
}
#endif
void main() {
    bool front = gl_FrontFacing;
    PageVertex at = PageVertex(gl_FragCoord, _vs2fs_location0, _vs2fs_location1, _vs2fs_location2, _vs2fs_location3);
    {
#ifdef SHOWS_SKY
        {
            vec3 _e7 = background(BACKGROUND_LAT_LONG, vec3(0.0), at.ray);
            vec4 _e8 = page_shown(_e7);
            _fs2p_location0 = _e8;
            return;
        }
#endif
#ifdef SHOWS_DIFFERENCE
        {
            vec4 _e12 = difference_shown(uvec2(at.position.xy));
            _fs2p_location0 = _e12;
            return;
        }
#endif
#ifdef SHOWS_MESH
        {
            Surface _e16 = surface_new(at.normal, at.tangent, at.ray, front);
            vec3 _e17 = shade_mode(_e16);
            vec3 _e18 = mesh_radiance(at, _e16, _e17);
            vec4 _e19 = page_shown(_e18);
            _fs2p_location0 = _e19;
            return;
        }
#endif
        {
            _fs2p_location0 = vec4(0.0);
            return;
        }
    }
}
