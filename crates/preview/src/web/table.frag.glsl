#version 300 es

precision highp float;
precision highp int;

struct Surface {
    vec3 normal;
    vec3 tangent;
    vec3 view;
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
const float MATERIAL_NEAR = 0.1;
const float MATERIAL_TINY = 1e-30;
const float MATERIAL_HORIZON = 1e-12;
const float MATERIAL_OPPOSITE = 1e-20;
const float MATERIAL_GRAZING = 0.0001;
const float MATERIAL_STEEP = 80.0;
const float MATERIAL_MIN_COSINE = 0.001;
const uint TURNED_WIDTH = 29u;
const uint TEXTURE_REPEAT = 0u;
const uint TEXTURE_MIRROR = 1u;
const uint TEXTURE_CLAMP = 2u;
const uint BASE_COLOR_NUMBERS = 13u;

uniform highp usampler2D material;

uniform highp sampler2D lamps;

uniform highp sampler2D quarter_turns;

uniform highp sampler2DArray table_map;

uniform highp sampler2D table_light;

layout(std140) uniform table_uniforms_block { TableUniforms table_uniforms; };

layout(std140) uniform texture_uniforms_block { TextureUniforms texture_uniforms; };

uniform highp usampler2D texture_texels;

uniform highp sampler2D base_color_numbers;

layout(std140) uniform page_block { PageUniforms page; };

smooth in vec3 _vs2fs_location0;
smooth in vec3 _vs2fs_location1;
smooth in vec3 _vs2fs_location2;
smooth in vec2 _vs2fs_location3;
layout(location = 0) out vec4 _fs2p_location0;

vec2 angles_circle(float turn) {
    float quarters = floor(((4.0 * turn) + 0.5));
    float x_6 = ((turn - (0.25 * quarters)) * 6.2831855);
    float z = (x_6 * x_6);
    float sine = (x_6 + ((x_6 * z) * (-0.16666655 + (z * (0.008332161 - (z * 0.00019515296))))));
    float cosine_7 = ((1.0 - (0.5 * z)) + ((z * z) * (0.041666646 + (z * (-0.0013887316 + (z * 2.4433159e-5))))));
    switch((int(quarters) & 3)) {
        case 0: {
            return vec2(cosine_7, sine);
        }
        case 1: {
            return vec2(-(sine), cosine_7);
        }
        case 2: {
            return vec2(-(cosine_7), -(sine));
        }
        default: {
            return vec2(sine, -(cosine_7));
        }
    }
}

float angles_angle(float y, float x) {
    float low = min(abs(x), abs(y));
    float high = max(abs(x), abs(y));
    if ((high == 0.0)) {
        return 0.0;
    }
    bool is_far = (low > (0.41421357 * high));
    float t_1 = ((is_far ? (low - high) : low) / (is_far ? (low + high) : high));
    float z_1 = (t_1 * t_1);
    float series_1 = (-0.3333295 + (z_1 * (0.1997771 + (z_1 * (-0.13877685 + (z_1 * 0.08053745))))));
    float small = ((t_1 + ((t_1 * z_1) * series_1)) + (is_far ? 0.7853982 : 0.0));
    float right = ((abs(y) > abs(x)) ? (1.5707964 - small) : small);
    float upper = ((x < 0.0) ? (3.1415927 - right) : right);
    return ((y < 0.0) ? -(upper) : upper);
}

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
    float cosine_8 = dot(_e10, view_22);
    if ((cosine_8 < 0.001)) {
        vec3 _e14 = n;
        n = normalize((_e14 + (view_22 * (0.001 - cosine_8))));
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

float material_one_less_sinc(float x_1) {
    if ((x_1 >= 1.0)) {
        vec2 _e5 = angles_circle((x_1 / 6.2831855));
        return (1.0 - (_e5.y / x_1));
    }
    float x2_ = (x_1 * x_1);
    return ((x2_ / 6.0) * (1.0 - ((x2_ / 20.0) * (1.0 - ((x2_ / 42.0) * (1.0 - (x2_ / 72.0)))))));
}

Half material_half(vec3 light, vec3 view) {
    bool local_1 = false;
    bool local_2 = false;
    vec3 sum_6 = (light + view);
    float length_squared = dot(sum_6, sum_6);
    if ((light.z > MATERIAL_HORIZON)) {
        local_1 = (sum_6.z > MATERIAL_HORIZON);
    } else {
        local_1 = false;
    }
    bool _e13 = local_1;
    if (_e13) {
        local_2 = (length_squared > MATERIAL_OPPOSITE);
    } else {
        local_2 = false;
    }
    bool seen = local_2;
    float across_2 = ((sum_6.x * sum_6.x) + (sum_6.y * sum_6.y));
    vec3 difference = (light - view);
    float turn_2 = (0.25 * dot(difference, difference));
    float facet = (0.5 * sqrt(length_squared));
    return Half(seen, sum_6, length_squared, across_2, light.z, max(view.z, 0.0), facet, turn_2);
}

float material_facets(float alpha2_, Half half_vector) {
    float sum_z = half_vector.sum.z;
    float across_3 = ((half_vector.across + ((alpha2_ * sum_z) * sum_z)) / half_vector.length_squared);
    float cos_i = half_vector.light;
    float cos_o = half_vector.view;
    float masked_light = sqrt((alpha2_ + (((1.0 - alpha2_) * cos_i) * cos_i)));
    float masked_view = sqrt((alpha2_ + (((1.0 - alpha2_) * cos_o) * cos_o)));
    float visible = (cos_i / ((cos_i * masked_view) + (cos_o * masked_light)));
    return (visible / (across_3 * across_3));
}

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

float material_fifth(float x_4) {
    float x2_1 = (x_4 * x_4);
    return ((x2_1 * x2_1) * x_4);
}

float material_fade(float cosine_1) {
    float _e5 = material_fifth((1.0 - (0.5 * cosine_1)));
    return (1.0 - _e5);
}

float material_lambda_cosine(float m, float cosine_2) {
    float slope = (m * sqrt(max((1.0 - (cosine_2 * cosine_2)), 0.0)));
    if ((cosine_2 >= (1.6 * slope))) {
        return 0.0;
    }
    float a = (cosine_2 / slope);
    return ((slope * max(((1.0 - (1.259 * a)) + ((0.396 * a) * a)), 0.0)) / (3.535 + (2.181 * a)));
}

float material_dielectric(float ior, float c) {
    float excess = ((ior * ior) - 1.0);
    float sum_7 = (sqrt((excess + (c * c))) + c);
    float difference_1 = (excess / sum_7);
    float parallel = (((c * sum_7) - 1.0) / ((c * difference_1) + 1.0));
    float share_1 = (difference_1 / sum_7);
    return (((0.5 * share_1) * share_1) * (1.0 + (parallel * parallel)));
}

float material_conductor(float n_2, float k, float c_1, float sin2_1) {
    float real = 0.0;
    float part = 0.0;
    float cos2_1 = (c_1 * c_1);
    float index_1 = ((n_2 * n_2) - (k * k));
    real = (index_1 - sin2_1);
    if ((cos2_1 < 0.5)) {
        real = ((index_1 - 1.0) + cos2_1);
    }
    float imaginary = ((2.0 * n_2) * k);
    float _e18 = real;
    float _e19 = real;
    float size = sqrt(((_e18 * _e19) + (imaginary * imaginary)));
    float _e24 = real;
    part = (0.5 * (size + _e24));
    float _e29 = real;
    if ((_e29 < 0.0)) {
        float _e35 = real;
        part = (((0.5 * imaginary) * imaginary) / (size - _e35));
    }
    float _e40 = part;
    float twice = ((2.0 * c_1) * sqrt(_e40));
    float s_3 = (max(((size + cos2_1) - twice), 0.0) / ((size + cos2_1) + twice));
    float sum_8 = ((cos2_1 * size) + (sin2_1 * sin2_1));
    float less = (twice * sin2_1);
    return ((0.5 * s_3) * (1.0 + ((sum_8 - less) / (sum_8 + less))));
}

vec3 material_half_difference(vec3 light_1, vec3 view_1) {
    vec2 phi = vec2(1.0, 0.0);
    vec2 theta = vec2(1.0, 0.0);
    bool local_3 = false;
    bool local_4 = false;
    vec3 sum_9 = (light_1 + view_1);
    vec3 difference_2 = (light_1 - view_1);
    float across_4 = length(sum_9.xy);
    float size_1 = length(sum_9);
    if ((across_4 > 0.0)) {
        phi = (sum_9.xy / vec2(across_4));
    }
    if ((size_1 > 0.0)) {
        theta = (vec2(sum_9.z, across_4) / vec2(size_1));
    }
    float _e28 = phi.x;
    float _e32 = phi.y;
    float _e36 = theta.x;
    float _e40 = theta.y;
    float x_7 = ((((difference_2.x * _e28) + (difference_2.y * _e32)) * _e36) - (difference_2.z * _e40));
    float _e45 = phi.x;
    float _e49 = phi.y;
    float y_1 = ((difference_2.y * _e45) - (difference_2.x * _e49));
    if (!((y_1 < 0.0))) {
        if ((y_1 == 0.0)) {
            local_4 = (x_7 < 0.0);
        } else {
            local_4 = false;
        }
        bool _e64 = local_4;
        local_3 = _e64;
    } else {
        local_3 = true;
    }
    bool turned = local_3;
    float side = (turned ? -1.0 : 1.0);
    float _e72 = angles_angle((side * y_1), (side * x_7));
    float _e74 = angles_angle(across_4, sum_9.z);
    float _e76 = angles_angle(length(difference_2), size_1);
    return vec3(_e74, _e76, _e72);
}

vec4 material_half_and_difference(vec3 light_2, vec3 view_2) {
    vec2 away = vec2(1.0, 0.0);
    vec2 theta_1 = vec2(1.0, 0.0);
    bool local_5 = false;
    bool local_6 = false;
    float phi_1 = 0.0;
    vec3 sum_10 = (light_2 + view_2);
    vec3 difference_3 = (light_2 - view_2);
    float across_5 = length(sum_10.xy);
    float size_2 = length(sum_10);
    if ((across_5 > 0.0)) {
        away = (sum_10.xy / vec2(across_5));
    }
    if ((size_2 > 0.0)) {
        theta_1 = (vec2(sum_10.z, across_5) / vec2(size_2));
    }
    float _e28 = away.x;
    float _e32 = away.y;
    float _e36 = theta_1.x;
    float _e40 = theta_1.y;
    float along = ((((difference_3.x * _e28) + (difference_3.y * _e32)) * _e36) - (difference_3.z * _e40));
    float _e45 = away.x;
    float _e49 = away.y;
    float beside = ((difference_3.y * _e45) - (difference_3.x * _e49));
    float _e53 = away.x;
    float _e56 = away.y;
    float x_8 = ((_e53 * along) - (_e56 * beside));
    float _e60 = away.y;
    float _e63 = away.x;
    float y_2 = ((_e60 * along) + (_e63 * beside));
    if (!((y_2 < 0.0))) {
        if ((y_2 == 0.0)) {
            local_6 = (x_8 < 0.0);
        } else {
            local_6 = false;
        }
        bool _e78 = local_6;
        local_5 = _e78;
    } else {
        local_5 = true;
    }
    bool turned_1 = local_5;
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
    float _e97 = angles_angle(across_5, sum_10.z);
    float _e98 = phi_1;
    float _e100 = angles_angle(length(difference_3), size_2);
    float _e103 = angles_angle((side_1 * y_2), (side_1 * x_8));
    return vec4(_e97, _e98, _e100, _e103);
}

uint material_element(uint i) {
    uvec4 _e8 = texelFetch(material, ivec2(uvec2((i % 1024u), (i / 1024u))), 0);
    return _e8.x;
}

uint standard_tables_count(uint at_1) {
    uint _e3 = material_element((at_1 + 24u));
    return _e3;
}

vec4 standard_tables(uint at_2, uint k_1) {
    uint _e7 = material_element(((at_2 + 25u) + (4u * k_1)));
    uint _e14 = material_element(((at_2 + 26u) + (4u * k_1)));
    uint _e21 = material_element(((at_2 + 27u) + (4u * k_1)));
    uint _e28 = material_element(((at_2 + 28u) + (4u * k_1)));
    return vec4(uintBitsToFloat(_e7), uintBitsToFloat(_e14), uintBitsToFloat(_e21), uintBitsToFloat(_e28));
}

vec4 material_at_cosine(uint at_3, float cosine_3) {
    uint _e2 = standard_tables_count(at_3);
    uint last = (_e2 - 1u);
    float place = (sqrt(min(cosine_3, 1.0)) * float(last));
    uint node_1 = min(uint(place), (last - 1u));
    vec4 _e14 = standard_tables(at_3, node_1);
    vec4 _e17 = standard_tables(at_3, (node_1 + 1u));
    return (_e14 + ((_e17 - _e14) * (place - float(node_1))));
}

float standard_coat_0_(uint at_4) {
    uint _e3 = material_element((at_4 + 6u));
    return uintBitsToFloat(_e3);
}

float standard_coat_90_(uint at_5) {
    uint _e3 = material_element((at_5 + 7u));
    return uintBitsToFloat(_e3);
}

float standard_coat_alpha2_(uint at_6) {
    uint _e3 = material_element((at_6 + 5u));
    return uintBitsToFloat(_e3);
}

vec3 standard_f_0_(uint at_7) {
    uint _e3 = material_element((at_7 + 1u));
    uint _e7 = material_element((at_7 + 2u));
    uint _e11 = material_element((at_7 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

float standard_f_90_(uint at_8) {
    uint _e3 = material_element((at_8 + 4u));
    return uintBitsToFloat(_e3);
}

float standard_alpha2_(uint at_9) {
    uint _e3 = material_element((at_9 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 standard_sheen(uint at_10) {
    uint _e3 = material_element((at_10 + 8u));
    uint _e7 = material_element((at_10 + 9u));
    uint _e11 = material_element((at_10 + 10u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

float charlie_c(uint at_11) {
    uint _e3 = material_element((at_11 + 3u));
    return uintBitsToFloat(_e3);
}

float charlie_a(uint at_12) {
    uint _e3 = material_element((at_12 + 1u));
    return uintBitsToFloat(_e3);
}

float charlie_b(uint at_13) {
    uint _e3 = material_element((at_13 + 2u));
    return uintBitsToFloat(_e3);
}

float charlie_d(uint at_14) {
    uint _e3 = material_element((at_14 + 4u));
    return uintBitsToFloat(_e3);
}

float charlie_e(uint at_15) {
    uint _e3 = material_element((at_15 + 5u));
    return uintBitsToFloat(_e3);
}

float material_charlie_ln(uint at_16, float x_5) {
    float _e2 = charlie_c(at_16);
    float _e7 = material_bounded_exp((_e2 * log(max(x_5, MATERIAL_TINY))));
    float _e8 = charlie_a(at_16);
    float _e9 = charlie_b(at_16);
    float share_2 = (_e8 / (1.0 + (_e9 * _e7)));
    float _e14 = charlie_d(at_16);
    float _e17 = charlie_e(at_16);
    return ((share_2 + (_e14 * x_5)) + _e17);
}

float charlie_twice_middle(uint at_17) {
    uint _e3 = material_element((at_17 + 6u));
    return uintBitsToFloat(_e3);
}

float material_charlie_lambda(uint at_18, float cosine_4) {
    if ((cosine_4 < 0.5)) {
        float _e4 = material_charlie_ln(at_18, cosine_4);
        float _e5 = material_bounded_exp(_e4);
        return _e5;
    }
    float _e6 = charlie_twice_middle(at_18);
    float _e11 = material_charlie_ln(at_18, max((1.0 - cosine_4), 0.0));
    float _e13 = material_bounded_exp((_e6 - _e11));
    return _e13;
}

float charlie_power(uint at_19) {
    uint _e3 = material_element((at_19 + 0u));
    return uintBitsToFloat(_e3);
}

float material_charlie(uint at_20, Half half_vector_2) {
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
    float _e27 = material_charlie_lambda(at_20, light_22);
    float _e30 = material_charlie_lambda(at_20, view_23);
    float masked = ((((1.0 + _e27) + _e30) * light_22) * view_23);
    float _e34 = charlie_power(at_20);
    float _e35 = ln;
    float _e37 = material_bounded_exp((_e34 * _e35));
    return (_e37 / masked);
}

uint standard_charlie(uint at_21) {
    return (at_21 + 11u);
}

vec3 standard_multiple(uint at_22) {
    uint _e3 = material_element((at_22 + 18u));
    uint _e7 = material_element((at_22 + 19u));
    uint _e11 = material_element((at_22 + 20u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 standard_diffuse(uint at_23) {
    uint _e3 = material_element((at_23 + 21u));
    uint _e7 = material_element((at_23 + 22u));
    uint _e11 = material_element((at_23 + 23u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_standard(uint at_24, vec3 light_3, vec3 view_3) {
    vec3 sum = vec3(0.0);
    Half _e3 = material_half(light_3, view_3);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float cos_i_1 = _e3.light;
    vec4 _e9 = material_at_cosine(at_24, cos_i_1);
    vec4 _e11 = material_at_cosine(at_24, _e3.view);
    float _e17 = material_fifth(max((1.0 - _e3.facet), 0.0));
    float _e18 = standard_coat_0_(at_24);
    float _e19 = standard_coat_90_(at_24);
    float _e20 = standard_coat_alpha2_(at_24);
    float _e21 = material_facets(_e20, _e3);
    float coat = ((_e18 + ((_e19 - _e18) * _e17)) * _e21);
    vec3 _e26 = standard_f_0_(at_24);
    float _e27 = standard_f_90_(at_24);
    vec3 f_90_ = vec3(_e27);
    float _e32 = standard_alpha2_(at_24);
    float _e33 = material_facets(_e32, _e3);
    float highlight = (min(_e9.y, _e11.y) * _e33);
    sum = (vec3(coat) + ((_e26 + ((f_90_ - _e26) * _e17)) * highlight));
    vec3 _e42 = standard_sheen(at_24);
    if ((max(max(_e42.x, _e42.y), _e42.z) > 0.0)) {
        uint _e50 = standard_charlie(at_24);
        float _e51 = material_charlie(_e50, _e3);
        vec3 _e52 = sum;
        sum = (_e52 + (_e42 * ((min(_e9.x, _e11.x) * _e51) * cos_i_1)));
    }
    vec3 _e60 = sum;
    vec3 _e61 = standard_multiple(at_24);
    vec3 _e68 = standard_diffuse(at_24);
    return ((_e60 + (_e61 * ((_e9.z * _e11.z) * cos_i_1))) + (_e68 * ((_e9.w * _e11.w) * cos_i_1)));
}

vec3 lambert_brdf(uint at_25) {
    uint _e3 = material_element((at_25 + 0u));
    uint _e7 = material_element((at_25 + 1u));
    uint _e11 = material_element((at_25 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_lambert(uint at_26, vec3 light_4, vec3 view_4) {
    vec3 _e3 = lambert_brdf(at_26);
    return (_e3 * max(light_4.z, 0.0));
}

vec3 oren_nayar_matte(uint at_27) {
    uint _e3 = material_element((at_27 + 0u));
    uint _e7 = material_element((at_27 + 1u));
    uint _e11 = material_element((at_27 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 oren_nayar_rough(uint at_28) {
    uint _e3 = material_element((at_28 + 3u));
    uint _e7 = material_element((at_28 + 4u));
    uint _e11 = material_element((at_28 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_oren_nayar(uint at_29, vec3 light_5, vec3 view_5) {
    if ((light_5.z <= 0.0)) {
        return vec3(0.0);
    }
    float across_6 = (max(((light_5.x * view_5.x) + (light_5.y * view_5.y)), 0.0) / max(light_5.z, abs(view_5.z)));
    vec3 _e22 = oren_nayar_matte(at_29);
    vec3 _e23 = oren_nayar_rough(at_29);
    return ((_e22 + (_e23 * across_6)) * light_5.z);
}

float phong_exponent(uint at_30) {
    uint _e3 = material_element((at_30 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 phong_peak(uint at_31) {
    uint _e3 = material_element((at_31 + 1u));
    uint _e7 = material_element((at_31 + 2u));
    uint _e11 = material_element((at_31 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_phong(uint at_32, vec3 light_6, vec3 view_6) {
    vec3 mirrored_1 = vec3(-(view_6.x), -(view_6.y), view_6.z);
    vec3 sine_1 = cross(light_6, mirrored_1);
    float _e12 = phong_exponent(at_32);
    float _e13 = material_power(dot(light_6, mirrored_1), dot(sine_1, sine_1), _e12);
    vec3 _e14 = phong_peak(at_32);
    return (_e14 * _e13);
}

float blinn_phong_half_exponent(uint at_33) {
    uint _e3 = material_element((at_33 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 blinn_phong_peak(uint at_34) {
    uint _e3 = material_element((at_34 + 1u));
    uint _e7 = material_element((at_34 + 2u));
    uint _e11 = material_element((at_34 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_blinn_phong(uint at_35, vec3 light_7, vec3 view_7) {
    Half _e3 = material_half(light_7, view_7);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = blinn_phong_half_exponent(at_35);
    float _e9 = material_half_power(_e3, _e8);
    vec3 _e10 = blinn_phong_peak(at_35);
    return (_e10 * (_e3.light * _e9));
}

float microfacet_sigma(uint at_36) {
    uint _e3 = material_element((at_36 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 microfacet_peak(uint at_37) {
    uint _e3 = material_element((at_37 + 1u));
    uint _e7 = material_element((at_37 + 2u));
    uint _e11 = material_element((at_37 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_microfacet(uint at_38, vec3 light_8, vec3 view_8) {
    bool local_7 = false;
    vec3 sum_11 = (light_8 + view_8);
    if (!((light_8.z <= 0.0))) {
        local_7 = (dot(sum_11, sum_11) <= 0.0);
    } else {
        local_7 = true;
    }
    bool _e14 = local_7;
    if (_e14) {
        return vec3(0.0);
    }
    float _e20 = angles_angle(length(sum_11.xy), sum_11.z);
    float _e21 = microfacet_sigma(at_38);
    float share_3 = (_e20 / _e21);
    vec3 _e23 = microfacet_peak(at_38);
    return (_e23 * exp(-(min((share_3 * share_3), MATERIAL_STEEP))));
}

float torrance_sparrow_roughness(uint at_39) {
    uint _e3 = material_element((at_39 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 fresnel_n(uint at_40) {
    uint _e3 = material_element((at_40 + 1u));
    uint _e7 = material_element((at_40 + 2u));
    uint _e11 = material_element((at_40 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

bool fresnel_is_conductor(uint at_41) {
    uint _e3 = material_element((at_41 + 0u));
    return (_e3 != 0u);
}

vec3 fresnel_k(uint at_42) {
    uint _e3 = material_element((at_42 + 4u));
    uint _e7 = material_element((at_42 + 5u));
    uint _e11 = material_element((at_42 + 6u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_fresnel(uint at_43, Half half_vector_3) {
    vec3 _e2 = fresnel_n(at_43);
    bool _e3 = fresnel_is_conductor(at_43);
    if (!(_e3)) {
        float _e7 = material_dielectric(_e2.x, half_vector_3.facet);
        return vec3(_e7);
    }
    vec3 _e9 = fresnel_k(at_43);
    float _e14 = material_conductor(_e2.x, _e9.x, half_vector_3.facet, half_vector_3.turn);
    float _e19 = material_conductor(_e2.y, _e9.y, half_vector_3.facet, half_vector_3.turn);
    float _e24 = material_conductor(_e2.z, _e9.z, half_vector_3.facet, half_vector_3.turn);
    return vec3(_e14, _e19, _e24);
}

uint torrance_sparrow_fresnel(uint at_44) {
    return (at_44 + 4u);
}

vec3 torrance_sparrow_peak(uint at_45) {
    uint _e3 = material_element((at_45 + 1u));
    uint _e7 = material_element((at_45 + 2u));
    uint _e11 = material_element((at_45 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_torrance_sparrow(uint at_46, vec3 light_9, vec3 view_9) {
    Half _e3 = material_half(light_9, view_9);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = torrance_sparrow_roughness(at_46);
    float across_7 = (_e3.across / (_e8 * _e8));
    float z2_ = (_e3.sum.z * _e3.sum.z);
    if ((across_7 >= (MATERIAL_STEEP * z2_))) {
        return vec3(0.0);
    }
    float cos2_3 = (z2_ / _e3.length_squared);
    float d = (exp((-(across_7) / z2_)) / (cos2_3 * cos2_3));
    float cos_i_2 = _e3.light;
    float cos_o_1 = _e3.view;
    float _e32 = material_lambda_cosine(_e8, cos_i_2);
    float _e35 = material_lambda_cosine(_e8, cos_o_1);
    float masked_1 = (((cos_i_2 * cos_o_1) + (cos_o_1 * _e32)) + (cos_i_2 * _e35));
    uint _e38 = torrance_sparrow_fresnel(at_46);
    vec3 _e39 = material_fresnel(_e38, _e3);
    vec3 _e40 = torrance_sparrow_peak(at_46);
    return ((_e40 * _e39) * ((d * cos_i_2) / masked_1));
}

float ggx_product(uint at_47) {
    uint _e3 = material_element((at_47 + 0u));
    return uintBitsToFloat(_e3);
}

float ggx_ratio(uint at_48) {
    uint _e3 = material_element((at_48 + 13u));
    return uintBitsToFloat(_e3);
}

vec2 ggx_squares(uint at_49) {
    uint _e3 = material_element((at_49 + 11u));
    uint _e7 = material_element((at_49 + 12u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}

float material_masked(vec2 squares, vec3 v_1, float cosine_5) {
    return sqrt(((((squares.x * v_1.x) * v_1.x) + ((squares.y * v_1.y) * v_1.y)) + (cosine_5 * cosine_5)));
}

vec3 ggx_peak(uint at_50) {
    uint _e3 = material_element((at_50 + 1u));
    uint _e7 = material_element((at_50 + 2u));
    uint _e11 = material_element((at_50 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

uint ggx_fresnel(uint at_51) {
    return (at_51 + 4u);
}

vec3 material_ggx(uint at_52, vec3 light_10, vec3 view_10) {
    float across = 0.0;
    Half _e3 = material_half(light_10, view_10);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    float _e8 = ggx_product(at_52);
    float _e9 = ggx_ratio(at_52);
    vec3 sum_12 = _e3.sum;
    across = ((((sum_12.x * sum_12.x) * _e9) + ((sum_12.y * sum_12.y) / _e9)) + ((_e8 * sum_12.z) * sum_12.z));
    float _e26 = across;
    across = (_e26 / _e3.length_squared);
    float cos_i_3 = _e3.light;
    float cos_o_2 = _e3.view;
    vec2 _e31 = ggx_squares(at_52);
    float _e32 = material_masked(_e31, view_10, cos_o_2);
    float _e34 = material_masked(_e31, light_10, cos_i_3);
    float masked_2 = ((cos_i_3 * _e32) + (cos_o_2 * _e34));
    float _e38 = across;
    float _e39 = across;
    float lobe_1 = ((cos_i_3 / masked_2) / (_e38 * _e39));
    vec3 _e42 = ggx_peak(at_52);
    uint _e43 = ggx_fresnel(at_52);
    vec3 _e44 = material_fresnel(_e43, _e3);
    return ((_e42 * _e44) * lobe_1);
}

vec2 ward_roughness(uint at_53) {
    uint _e3 = material_element((at_53 + 0u));
    uint _e7 = material_element((at_53 + 1u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}

vec3 ward_peak(uint at_54) {
    uint _e3 = material_element((at_54 + 2u));
    uint _e7 = material_element((at_54 + 3u));
    uint _e11 = material_element((at_54 + 4u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_ward(uint at_55, vec3 light_11, vec3 view_11) {
    Half _e3 = material_half(light_11, view_11);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    vec2 _e8 = ward_roughness(at_55);
    float x_9 = (_e3.sum.x / _e8.x);
    float y_3 = (_e3.sum.y / _e8.y);
    float z_2 = _e3.sum.z;
    float across_8 = ((x_9 * x_9) + (y_3 * y_3));
    if ((across_8 >= ((MATERIAL_STEEP * z_2) * z_2))) {
        return vec3(0.0);
    }
    float slopes = (across_8 / (z_2 * z_2));
    float grazing = ((_e3.light / z_2) / max(z_2, MATERIAL_MIN_COSINE));
    vec3 _e35 = ward_peak(at_55);
    return (_e35 * ((exp(-(slopes)) * (_e3.length_squared / (z_2 * z_2))) * grazing));
}

vec2 ashikhmin_shirley_half_exponent(uint at_56) {
    uint _e3 = material_element((at_56 + 0u));
    uint _e7 = material_element((at_56 + 1u));
    return vec2(uintBitsToFloat(_e3), uintBitsToFloat(_e7));
}

float ashikhmin_shirley_lobe(uint at_57) {
    uint _e3 = material_element((at_57 + 2u));
    return uintBitsToFloat(_e3);
}

vec3 ashikhmin_shirley_specular(uint at_58) {
    uint _e3 = material_element((at_58 + 3u));
    uint _e7 = material_element((at_58 + 4u));
    uint _e11 = material_element((at_58 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 ashikhmin_shirley_base(uint at_59) {
    uint _e3 = material_element((at_59 + 6u));
    uint _e7 = material_element((at_59 + 7u));
    uint _e11 = material_element((at_59 + 8u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_ashikhmin_shirley(uint at_60, vec3 light_12, vec3 view_12) {
    float exponent = 0.0;
    Half _e3 = material_half(light_12, view_12);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    vec3 sum_13 = _e3.sum;
    float facet_1 = _e3.facet;
    float cos_i_4 = _e3.light;
    float cos_o_3 = _e3.view;
    if ((_e3.across > 0.0)) {
        vec2 _e17 = ashikhmin_shirley_half_exponent(at_60);
        float turned_2 = (((_e17.x * sum_13.x) * sum_13.x) + ((_e17.y * sum_13.y) * sum_13.y));
        exponent = (turned_2 / _e3.across);
    }
    float _e31 = ashikhmin_shirley_lobe(at_60);
    float _e32 = exponent;
    float _e33 = material_half_power(_e3, _e32);
    float lobe_2 = (((_e31 * _e33) / max(facet_1, MATERIAL_MIN_COSINE)) * (cos_i_4 / max(cos_i_4, cos_o_3)));
    float _e45 = material_fifth(max((1.0 - facet_1), 0.0));
    float _e46 = material_fade(cos_i_4);
    float _e47 = material_fade(cos_o_3);
    float base_1 = ((_e46 * _e47) * cos_i_4);
    vec3 _e50 = ashikhmin_shirley_specular(at_60);
    vec3 _e57 = ashikhmin_shirley_base(at_60);
    return (((_e50 + ((vec3(1.0) - _e50) * _e45)) * lobe_2) + (_e57 * base_1));
}

float poulin_fournier_distance(uint at_61) {
    uint _e3 = material_element((at_61 + 1u));
    return uintBitsToFloat(_e3);
}

float poulin_fournier_floor(uint at_62) {
    uint _e3 = material_element((at_62 + 2u));
    return uintBitsToFloat(_e3);
}

float poulin_fournier_edge(uint at_63) {
    uint _e3 = material_element((at_63 + 3u));
    return uintBitsToFloat(_e3);
}

float poulin_fournier_half_width(uint at_64) {
    uint _e3 = material_element((at_64 + 4u));
    return uintBitsToFloat(_e3);
}

Cylinder material_cylinder(uint at_65, vec3 direction) {
    float cosine_6 = 1.0;
    float first = 0.0;
    float near = 0.0;
    float far = 0.0;
    float height = max(direction.z, 0.0);
    float size_3 = length(vec2(direction.y, height));
    if ((size_3 > 0.0)) {
        cosine_6 = max((height / size_3), MATERIAL_MIN_COSINE);
    }
    float _e15 = cosine_6;
    float _e16 = cosine_6;
    float sine_2 = sqrt(max((1.0 - (_e15 * _e16)), 0.0));
    float _e23 = poulin_fournier_distance(at_65);
    float _e24 = poulin_fournier_floor(at_65);
    float _e25 = poulin_fournier_edge(at_65);
    float _e26 = poulin_fournier_half_width(at_65);
    float _e29 = cosine_6;
    float hidden = min(((0.5 * _e23) * _e29), 1.0);
    float _e33 = cosine_6;
    float _e34 = angles_angle(_e33, sine_2);
    first = -(_e34);
    float _e37 = first;
    float _e42 = angles_angle(sqrt(hidden), sqrt((1.0 - hidden)));
    float last_1 = min((_e37 + (2.0 * _e42)), _e25);
    float _e47 = first;
    first = max(_e47, -(_e25));
    near = _e26;
    float _e53 = cosine_6;
    if (((_e26 * sine_2) < (-(_e24) * _e53))) {
        float _e59 = cosine_6;
        near = ((1.0 + (_e24 * sine_2)) / _e59);
    }
    far = (_e23 - _e26);
    if ((sine_2 > _e24)) {
        float _e67 = cosine_6;
        far = (_e23 - ((1.0 - (_e24 * sine_2)) / _e67));
    }
    float _e70 = cosine_6;
    float _e71 = angles_angle(sine_2, _e70);
    if ((direction.y < 0.0)) {
        float _e76 = cosine_6;
        float _e78 = first;
        float _e81 = far;
        float _e83 = near;
        return Cylinder(-(_e71), _e76, vec2(-(last_1), -(_e78)), vec2((_e23 - _e81), (_e23 - _e83)));
    }
    float _e87 = cosine_6;
    float _e88 = first;
    float _e90 = near;
    float _e91 = far;
    return Cylinder(_e71, _e87, vec2(_e88, last_1), vec2(_e90, _e91));
}

float poulin_fournier_exponent(uint at_66) {
    uint _e3 = material_element((at_66 + 0u));
    return uintBitsToFloat(_e3);
}

float poulin_fournier_reach(uint at_67) {
    uint _e3 = material_element((at_67 + 5u));
    return uintBitsToFloat(_e3);
}

float material_half_tangent(float angle) {
    vec2 _e8 = angles_circle((clamp((0.5 * angle), -0.7853982, 0.7853982) / 6.2831855));
    return (_e8.y / _e8.x);
}

vec2 poulin_fournier_gauss(uint at_68, uint k_2) {
    uint _e7 = material_element(((at_68 + 12u) + (2u * k_2)));
    uint _e14 = material_element(((at_68 + 13u) + (2u * k_2)));
    return vec2(uintBitsToFloat(_e7), uintBitsToFloat(_e14));
}

float material_on_cylinder(float t, vec2 light_13, vec2 view_13, float s_2) {
    float scale = (1.0 / (1.0 + (t * t)));
    float sine_3 = ((2.0 * t) * scale);
    float cosine_9 = (((1.0 - t) * (1.0 + t)) * scale);
    float cos_l = max(((cosine_9 * light_13.x) - (sine_3 * light_13.y)), 0.0);
    float cos_v = max(((cosine_9 * view_13.x) - (sine_3 * view_13.y)), 0.0);
    float _e35 = material_power(cosine_9, (sine_3 * sine_3), s_2);
    return ((((2.0 * scale) * _e35) * cos_l) * cos_v);
}

float material_cylinder_highlight(uint at_69, vec3 sum_1, float phi_l, float phi_v, vec2 arc) {
    float integral = 0.0;
    uint node = 0u;
    float _e7 = angles_angle(sum_1.y, sum_1.z);
    float _e8 = poulin_fournier_reach(at_69);
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
    float _e34 = poulin_fournier_exponent(at_69);
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e56 = node;
            node = (_e56 + 1u);
        }
        loop_init = false;
        uint _e39 = node;
        if ((_e39 < 8u)) {
        } else {
            break;
        }
        {
            uint _e42 = node;
            vec2 _e43 = poulin_fournier_gauss(at_69, _e42);
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

vec3 poulin_fournier_diffuse(uint at_70) {
    uint _e3 = material_element((at_70 + 6u));
    uint _e7 = material_element((at_70 + 7u));
    uint _e11 = material_element((at_70 + 8u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 poulin_fournier_specular(uint at_71) {
    uint _e3 = material_element((at_71 + 9u));
    uint _e7 = material_element((at_71 + 10u));
    uint _e11 = material_element((at_71 + 11u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_poulin_fournier(uint at_72, vec3 light_14, vec3 view_14) {
    float diffuse = 0.0;
    float specular = 0.0;
    Half _e3 = material_half(light_14, view_14);
    if (!(_e3.seen)) {
        return vec3(0.0);
    }
    Cylinder _e8 = material_cylinder(at_72, light_14);
    Cylinder _e9 = material_cylinder(at_72, view_14);
    vec2 arc_1 = vec2(max(_e8.arc.x, _e9.arc.x), min(_e8.arc.y, _e9.arc.y));
    vec2 ground = vec2(max(_e8.ground.x, _e9.ground.x), min(_e8.ground.y, _e9.ground.y));
    float _e32 = poulin_fournier_exponent(at_72);
    if ((arc_1.x < arc_1.y)) {
        float _e41 = poulin_fournier_distance(at_72);
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
        vec3 sum_14 = _e3.sum;
        float along_1 = ((sum_14.x * sum_14.x) / _e3.length_squared);
        float _e104 = material_power(sqrt(max((1.0 - along_1), 0.0)), along_1, _e32);
        float _e105 = specular;
        float _e109 = material_cylinder_highlight(at_72, sum_14, _e8.phi, _e9.phi, arc_1);
        specular = (_e105 + ((scale_1 * _e104) * _e109));
    }
    if ((ground.x < ground.y)) {
        float _e116 = poulin_fournier_distance(at_72);
        float width = ((_e3.light / _e116) * (ground.y - ground.x));
        float _e122 = diffuse;
        diffuse = (_e122 + width);
        float _e124 = specular;
        float _e127 = material_half_power(_e3, (0.5 * _e32));
        specular = (_e124 + (width * _e127));
    }
    vec3 _e130 = poulin_fournier_diffuse(at_72);
    float _e131 = diffuse;
    vec3 _e133 = poulin_fournier_specular(at_72);
    float _e134 = specular;
    return ((_e130 * _e131) + (_e133 * _e134));
}

vec3 lafortune_diffuse(uint at_73) {
    uint _e3 = material_element((at_73 + 0u));
    uint _e7 = material_element((at_73 + 1u));
    uint _e11 = material_element((at_73 + 2u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

uint lafortune_lobes_count(uint at_74) {
    uint _e3 = material_element((at_74 + 3u));
    return _e3;
}

uint lafortune_lobes(uint at_75, uint k_3) {
    return ((at_75 + 4u) + (6u * k_3));
}

float lafortune_lobe_cx(uint at_76) {
    uint _e3 = material_element((at_76 + 0u));
    return uintBitsToFloat(_e3);
}

float lafortune_lobe_cz(uint at_77) {
    uint _e3 = material_element((at_77 + 1u));
    return uintBitsToFloat(_e3);
}

vec3 lafortune_lobe_weight(uint at_78) {
    uint _e3 = material_element((at_78 + 3u));
    uint _e7 = material_element((at_78 + 4u));
    uint _e11 = material_element((at_78 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

float lafortune_lobe_n(uint at_79) {
    uint _e3 = material_element((at_79 + 2u));
    return uintBitsToFloat(_e3);
}

vec3 material_lafortune(uint at_80, vec3 light_15, vec3 view_15) {
    vec3 brdf = vec3(0.0);
    uint lobe = 0u;
    if ((light_15.z <= 0.0)) {
        return vec3(0.0);
    }
    float across_9 = ((light_15.x * view_15.x) + (light_15.y * view_15.y));
    float along_2 = (light_15.z * view_15.z);
    vec3 _e18 = lafortune_diffuse(at_80);
    brdf = _e18;
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            uint _e39 = lobe;
            lobe = (_e39 + 1u);
        }
        loop_init_1 = false;
        uint _e22 = lobe;
        uint _e23 = lafortune_lobes_count(at_80);
        if ((_e22 < _e23)) {
        } else {
            break;
        }
        {
            uint _e25 = lobe;
            uint _e26 = lafortune_lobes(at_80, _e25);
            float _e27 = lafortune_lobe_cx(_e26);
            float _e29 = lafortune_lobe_cz(_e26);
            float base_2 = ((_e27 * across_9) + (_e29 * along_2));
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

vec3 kajiya_kay_specular(uint at_81) {
    uint _e3 = material_element((at_81 + 1u));
    uint _e7 = material_element((at_81 + 2u));
    uint _e11 = material_element((at_81 + 3u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

float kajiya_kay_exponent(uint at_82) {
    uint _e3 = material_element((at_82 + 0u));
    return uintBitsToFloat(_e3);
}

vec3 material_kajiya_kay(uint at_83, vec3 light_16, vec3 view_16) {
    float sin_i = length(light_16.yz);
    float sin_o = length(view_16.yz);
    float sine_4 = ((sin_i * view_16.x) - (light_16.x * sin_o));
    float cosine_10 = ((light_16.x * view_16.x) + (sin_i * sin_o));
    vec3 _e17 = kajiya_kay_specular(at_83);
    float _e19 = kajiya_kay_exponent(at_83);
    float _e20 = material_power(cosine_10, (sine_4 * sine_4), _e19);
    return (_e17 * _e20);
}

uvec3 measured_shape(uint at_84) {
    uint _e3 = material_element((at_84 + 0u));
    uint _e6 = material_element((at_84 + 1u));
    uint _e9 = material_element((at_84 + 2u));
    return uvec3(_e3, _e6, _e9);
}

uint measured_table(uint at_85) {
    return (at_85 + 6u);
}

vec3 measured_table_values(uint at_86, uint k_4) {
    uint _e7 = material_element(((at_86 + 1u) + (3u * k_4)));
    uint _e14 = material_element(((at_86 + 2u) + (3u * k_4)));
    uint _e21 = material_element(((at_86 + 3u) + (3u * k_4)));
    return vec3(uintBitsToFloat(_e7), uintBitsToFloat(_e14), uintBitsToFloat(_e21));
}

vec3 material_row(uint table, uint row, uvec2 columns, float share) {
    vec3 _e6 = measured_table_values(table, (row + columns.x));
    vec3 _e9 = measured_table_values(table, (row + columns.y));
    return (_e6 + ((_e9 - _e6) * share));
}

vec3 measured_scale(uint at_87) {
    uint _e3 = material_element((at_87 + 3u));
    uint _e7 = material_element((at_87 + 4u));
    uint _e11 = material_element((at_87 + 5u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_measured(uint at_88, vec3 light_17, vec3 view_17) {
    if ((light_17.z <= 0.0)) {
        return vec3(0.0);
    }
    vec3 _e8 = material_half_difference(light_17, view_17);
    uvec3 _e9 = measured_shape(at_88);
    float to_h = min((sqrt((_e8.x / 1.5707964)) * float(_e9.x)), float((_e9.x - 1u)));
    float to_d = min(((_e8.y / 1.5707964) * float(_e9.y)), float((_e9.y - 1u)));
    float turn_3 = ((_e8.z / 3.1415927) * float(_e9.z));
    uint h = uint(to_h);
    uint d_1 = uint(to_d);
    uint phi_2 = uint(turn_3);
    vec3 share_4 = vec3((to_h - float(h)), (to_d - float(d_1)), (turn_3 - float(phi_2)));
    uvec2 columns_1 = uvec2((phi_2 % _e9.z), ((phi_2 + 1u) % _e9.z));
    uint near_1 = ((h * _e9.y) + d_1);
    uint next = ((h * _e9.y) + min((d_1 + 1u), (_e9.y - 1u)));
    uint step_1 = (((h + 1u) < _e9.x) ? _e9.y : 0u);
    uint _e75 = measured_table(at_88);
    vec3 _e79 = material_row(_e75, (near_1 * _e9.z), columns_1, share_4.z);
    vec3 _e87 = material_row(_e75, (next * _e9.z), columns_1, share_4.z);
    vec3 low_1 = ((_e79 * (1.0 - share_4.y)) + (_e87 * share_4.y));
    vec3 _e95 = material_row(_e75, ((near_1 + step_1) * _e9.z), columns_1, share_4.z);
    vec3 _e104 = material_row(_e75, ((next + step_1) * _e9.z), columns_1, share_4.z);
    vec3 high_1 = ((_e95 * (1.0 - share_4.y)) + (_e104 * share_4.y));
    vec3 _e108 = measured_scale(at_88);
    return ((_e108 * ((low_1 * (1.0 - share_4.x)) + (high_1 * share_4.x))) * light_17.z);
}

uvec4 measured_anisotropic_shape(uint at_89) {
    uint _e3 = material_element((at_89 + 0u));
    uint _e6 = material_element((at_89 + 1u));
    uint _e9 = material_element((at_89 + 2u));
    uint _e12 = material_element((at_89 + 3u));
    return uvec4(_e3, _e6, _e9, _e12);
}

uint measured_anisotropic_table(uint at_90) {
    return (at_90 + 7u);
}

vec3 measured_anisotropic_scale(uint at_91) {
    uint _e3 = material_element((at_91 + 4u));
    uint _e7 = material_element((at_91 + 5u));
    uint _e11 = material_element((at_91 + 6u));
    return vec3(uintBitsToFloat(_e3), uintBitsToFloat(_e7), uintBitsToFloat(_e11));
}

vec3 material_measured_anisotropic(uint at_92, vec3 light_18, vec3 view_18) {
    vec3 sum_2 = vec3(0.0);
    uint corner = 0u;
    if ((light_18.z <= 0.0)) {
        return vec3(0.0);
    }
    vec4 _e8 = material_half_and_difference(light_18, view_18);
    uvec4 _e9 = measured_anisotropic_shape(at_92);
    float to_h_1 = min((sqrt((_e8.x / 1.5707964)) * float(_e9.x)), float((_e9.x - 1u)));
    float to_phi = ((_e8.y / 6.2831855) * float(_e9.y));
    float to_d_1 = min(((_e8.z / 1.5707964) * float(_e9.z)), float((_e9.z - 1u)));
    float to_psi = ((_e8.w / 3.1415927) * float(_e9.w));
    uvec4 first_1 = uvec4(uint(to_h_1), uint(to_phi), uint(to_d_1), uint(to_psi));
    vec4 share_5 = (vec4(to_h_1, to_phi, to_d_1, to_psi) - vec4(first_1));
    uvec2 columns_2 = uvec2((first_1.w % _e9.w), ((first_1.w + 1u) % _e9.w));
    uint _e62 = measured_anisotropic_table(at_92);
    bool loop_init_2 = true;
    while(true) {
        if (!loop_init_2) {
            uint _e142 = corner;
            corner = (_e142 + 1u);
        }
        loop_init_2 = false;
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
            uint i_7 = min((first_1.x + far_1.x), (_e9.x - 1u));
            uint j = ((first_1.y + far_1.y) % _e9.y);
            uint k_7 = min((first_1.z + far_1.z), (_e9.z - 1u));
            float weight = ((((far_1.x == 1u) ? share_5.x : (1.0 - share_5.x)) * ((far_1.y == 1u) ? share_5.y : (1.0 - share_5.y))) * ((far_1.z == 1u) ? share_5.z : (1.0 - share_5.z)));
            vec3 _e128 = sum_2;
            vec3 _e138 = material_row(_e62, (((((i_7 * _e9.y) + j) * _e9.z) + k_7) * _e9.w), columns_2, share_5.w);
            sum_2 = (_e128 + (_e138 * weight));
        }
    }
    vec3 _e144 = measured_anisotropic_scale(at_92);
    vec3 _e145 = sum_2;
    return ((_e144 * _e145) * light_18.z);
}

vec3 material_layer(uint model, uint at_93, vec3 light_19, vec3 view_19) {
    switch(model) {
        case 0u: {
            vec3 _e4 = material_standard(at_93, light_19, view_19);
            return _e4;
        }
        case 1u: {
            vec3 _e5 = material_lambert(at_93, light_19, view_19);
            return _e5;
        }
        case 2u: {
            vec3 _e6 = material_oren_nayar(at_93, light_19, view_19);
            return _e6;
        }
        case 3u: {
            vec3 _e7 = material_phong(at_93, light_19, view_19);
            return _e7;
        }
        case 4u: {
            vec3 _e8 = material_blinn_phong(at_93, light_19, view_19);
            return _e8;
        }
        case 5u: {
            vec3 _e9 = material_microfacet(at_93, light_19, view_19);
            return _e9;
        }
        case 6u: {
            vec3 _e10 = material_torrance_sparrow(at_93, light_19, view_19);
            return _e10;
        }
        case 7u: {
            vec3 _e11 = material_ggx(at_93, light_19, view_19);
            return _e11;
        }
        case 8u: {
            vec3 _e12 = material_ward(at_93, light_19, view_19);
            return _e12;
        }
        case 9u: {
            vec3 _e13 = material_ashikhmin_shirley(at_93, light_19, view_19);
            return _e13;
        }
        case 10u: {
            vec3 _e14 = material_poulin_fournier(at_93, light_19, view_19);
            return _e14;
        }
        case 11u: {
            vec3 _e15 = material_lafortune(at_93, light_19, view_19);
            return _e15;
        }
        case 12u: {
            vec3 _e16 = material_kajiya_kay(at_93, light_19, view_19);
            return _e16;
        }
        case 13u: {
            vec3 _e17 = material_measured(at_93, light_19, view_19);
            return _e17;
        }
        case 14u: {
            vec3 _e18 = material_measured_anisotropic(at_93, light_19, view_19);
            return _e18;
        }
        default: {
            return vec3(0.0);
        }
    }
}

vec3 material_rho_hat(vec3 light_20, vec3 view_20) {
    vec3 sum_3 = vec3(0.0);
    uint at_94 = 1u;
    uint layer = 0u;
    bool loop_init_3 = true;
    while(true) {
        if (!loop_init_3) {
            uint _e30 = layer;
            layer = (_e30 + 1u);
        }
        loop_init_3 = false;
        uint _e9 = layer;
        uint _e11 = material_element(0u);
        if ((_e9 < _e11)) {
        } else {
            break;
        }
        {
            vec3 _e13 = sum_3;
            uint _e14 = at_94;
            uint _e15 = material_element(_e14);
            uint _e16 = at_94;
            vec3 _e19 = material_layer(_e15, (_e16 + 2u), light_20, view_20);
            sum_3 = (_e13 + _e19);
            uint _e21 = at_94;
            uint _e23 = at_94;
            uint _e26 = material_element((_e23 + 1u));
            at_94 = (_e21 + (2u + _e26));
        }
    }
    vec3 _e32 = sum_3;
    return _e32;
}

bool light_arrives(vec3 direction_1) {
    return true;
}

vec4 lamps_element(uint i_1) {
    vec4 _e8 = texelFetch(lamps, ivec2(uvec2((i_1 % 1024u), (i_1 / 1024u))), 0);
    return _e8;
}

uint lamps_level(uint levels, float radius, vec3 centre, vec3 mirrored) {
    bool local_8 = false;
    if ((levels <= 2u)) {
        return 1u;
    }
    vec4 _e8 = lamps_element(1u);
    float width_1 = _e8.x;
    float away_1 = ((2.0 * asin(min((0.5 * distance(centre, mirrored)), 1.0))) - radius);
    vec4 _e20 = lamps_element(1u);
    vec4 _e24 = lamps_element(1u);
    float feature = min((_e20.y * away_1), _e24.z);
    bool is_whole = (abs(centre.z) > sin(radius));
    if (is_whole) {
        vec4 _e34 = lamps_element(1u);
        local_8 = (radius <= (_e34.w * feature));
    } else {
        local_8 = false;
    }
    bool _e39 = local_8;
    if (_e39) {
        return 0u;
    }
    if ((feature < (2.0 * width_1))) {
        return 1u;
    }
    return min((1u + uint(log2((feature / width_1)))), (levels - 1u));
}

vec3 lamps_some(Surface surface, vec3 before, uint first_lamp, uint count) {
    vec3 sum_4 = vec3(0.0);
    uint lamp = 0u;
    vec3 reflected = vec3(0.0);
    uint point = 0u;
    uint turn_1 = 0u;
    sum_4 = before;
    vec4 _e6 = lamps_element(0u);
    float turns = _e6.z;
    mat3x3 frame_2 = mat3x3(surface.tangent, cross(surface.normal, surface.tangent), surface.normal);
    mat3x3 to_surface = transpose(frame_2);
    vec3 view_24 = (to_surface * surface.view);
    vec3 mirrored_2 = vec3(-(view_24.xy), view_24.z);
    lamp = first_lamp;
    bool loop_init_4 = true;
    while(true) {
        if (!loop_init_4) {
            uint _e120 = lamp;
            lamp = (_e120 + 1u);
        }
        loop_init_4 = false;
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
            uint first_2 = uint(_e46.x);
            vec4 _e49 = lamps_element(level_3);
            uint last_2 = (first_2 + uint(_e49.y));
            reflected = vec3(0.0);
            point = first_2;
            bool loop_init_5 = true;
            while(true) {
                if (!loop_init_5) {
                    uint _e106 = point;
                    point = (_e106 + 1u);
                }
                loop_init_5 = false;
                uint _e57 = point;
                if ((_e57 < last_2)) {
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
                    bool loop_init_6 = true;
                    while(true) {
                        if (!loop_init_6) {
                            uint _e103 = turn_1;
                            turn_1 = (_e103 + 1u);
                        }
                        loop_init_6 = false;
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
            vec3 _e108 = sum_4;
            uint _e111 = lamp;
            vec4 _e114 = lamps_element((3u + (3u * _e111)));
            vec3 _e116 = reflected;
            sum_4 = (_e108 + (_e114.xyz * _e116));
        }
    }
    vec3 _e122 = sum_4;
    return _e122;
}

vec3 lamps_added(Surface surface_1, vec3 soft) {
    vec4 _e6 = lamps_element(0u);
    vec3 cut = ((_e6.y == 1.0) ? max(soft, vec3(0.0)) : soft);
    vec4 _e13 = lamps_element(0u);
    vec3 _e16 = lamps_some(surface_1, cut, 0u, uint(_e13.x));
    return _e16;
}

TurnedAngles turned_angles(mat3x3 frame) {
    vec3 x_10 = frame[0];
    vec3 n_3 = frame[2];
    float sine_5 = length(n_3.xy);
    vec2 alpha = ((sine_5 > 0.0) ? (n_3.xy / vec2(sine_5)) : vec2(1.0, 0.0));
    float along_3 = dot(alpha, x_10.xy);
    vec2 gamma = vec2(((n_3.z * along_3) - (sine_5 * x_10.z)), ((alpha.x * x_10.y) - (alpha.y * x_10.x)));
    return TurnedAngles(alpha, vec2(n_3.z, sine_5), gamma);
}

uint turned_entries(uint l) {
    return (((2u * l) + 1u) * ((l / 2u) + 1u));
}

uint quarter_turn_column(uint l_1, uint row_1, uint k_5) {
    uint odd = ((l_1 + ((row_1 < l_1) ? 1u : 0u)) % 2u);
    bool is_even = ((row_1 % 2u) == 0u);
    uint m_2 = ((is_even ? odd : (2u - odd)) + (2u * k_5));
    if ((m_2 > l_1)) {
        return ((2u * l_1) + 1u);
    }
    return (is_even ? (l_1 + m_2) : (l_1 - m_2));
}

void turn_about_z(uint l_2, vec2 angle_1, inout vec3 band[29]) {
    vec2 multiple = vec2(1.0, 0.0);
    uint m_1 = 1u;
    bool loop_init_7 = true;
    while(true) {
        if (!loop_init_7) {
            uint _e59 = m_1;
            m_1 = (_e59 + 1u);
        }
        loop_init_7 = false;
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

vec2 quarter_turns_element(uint i_2) {
    vec4 _e8 = texelFetch(quarter_turns, ivec2(uvec2((i_2 % 1024u), (i_2 / 1024u))), 0);
    return _e8.xy;
}

void turn_about_x(uint l_3, uint entry, uint back, inout vec3 band_1[29]) {
    uint row_2 = 0u;
    vec3 sum_5 = vec3(0.0);
    uint k_6 = 0u;
    uint count_2 = ((l_3 / 2u) + 1u);
    vec3 before_1[29] = band_1;
    bool loop_init_8 = true;
    while(true) {
        if (!loop_init_8) {
            uint _e46 = row_2;
            row_2 = (_e46 + 1u);
        }
        loop_init_8 = false;
        uint _e11 = row_2;
        if ((_e11 <= (2u * l_3))) {
        } else {
            break;
        }
        {
            sum_5 = vec3(0.0);
            k_6 = 0u;
            bool loop_init_9 = true;
            while(true) {
                if (!loop_init_9) {
                    uint _e40 = k_6;
                    k_6 = (_e40 + 1u);
                }
                loop_init_9 = false;
                uint _e20 = k_6;
                if ((_e20 < count_2)) {
                } else {
                    break;
                }
                {
                    uint _e22 = row_2;
                    uint _e23 = k_6;
                    uint _e24 = quarter_turn_column(l_3, _e22, _e23);
                    if ((_e24 <= (2u * l_3))) {
                        vec3 _e28 = sum_5;
                        uint _e29 = row_2;
                        uint _e32 = k_6;
                        vec2 _e34 = quarter_turns_element(((entry + (_e29 * count_2)) + _e32));
                        sum_5 = (_e28 + (_e34[back] * before_1[_e24]));
                    }
                }
            }
            uint _e42 = row_2;
            vec3 _e44 = sum_5;
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

vec2 table_place_of(TableUniforms table_1, vec3 view_21) {
    float z_3 = ((table_1.mirrored == 1u) ? abs(view_21.z) : max(view_21.z, 0.0));
    float across_10 = ((z_3 > 0.0) ? (1.0 + z_3) : max(length(view_21.xy), 1e-30));
    return (vec2(view_21.x, -(view_21.y)) / vec2(across_10));
}

vec3 table_coefficient_at(TableUniforms table_2, TablePoint at_95, uint i_3) {
    if ((table_2.channels == 1u)) {
        vec4 _e12 = textureLod(table_map, vec3(at_95.place, (i_3 / 4u)), 0.0);
        return vec3(_e12[(i_3 % 4u)]);
    }
    vec4 _e21 = textureLod(table_map, vec3(at_95.place, i_3), 0.0);
    return _e21.xyz;
}

vec4 table_light_element(uint i_4) {
    vec4 _e8 = texelFetch(table_light, ivec2(uvec2((i_4 % 1024u), (i_4 / 1024u))), 0);
    return _e8;
}

vec3 table_light_at(TableUniforms table_3, TablePoint at_96, uint i_5) {
    vec4 _e3 = table_light_element(i_5);
    return _e3.xyz;
}

vec3 table_radiance(TableUniforms table_4, TablePoint at_97, mat3x3 frame_1) {
    vec3 radiance_1 = vec3(0.0);
    uint entry_2 = 0u;
    uint l_5 = 1u;
    vec3 band_3[29] = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    uint row_3 = 0u;
    uint row_4 = 0u;
    uint known = min(table_4.rows, table_4.light_rows);
    vec3 _e7 = table_coefficient_at(table_4, at_97, 0u);
    vec3 _e9 = table_light_at(table_4, at_97, 0u);
    radiance_1 = (_e7 * _e9);
    TurnedAngles _e12 = turned_angles(frame_1);
    bool loop_init_10 = true;
    while(true) {
        if (!loop_init_10) {
            uint _e70 = l_5;
            l_5 = (_e70 + 1u);
        }
        loop_init_10 = false;
        uint _e17 = l_5;
        uint _e18 = l_5;
        if (((_e17 * _e18) < known)) {
        } else {
            break;
        }
        {
            band_3 = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
            row_3 = 0u;
            bool loop_init_11 = true;
            while(true) {
                if (!loop_init_11) {
                    uint _e39 = row_3;
                    row_3 = (_e39 + 1u);
                }
                loop_init_11 = false;
                uint _e25 = row_3;
                uint _e27 = l_5;
                if ((_e25 <= (2u * _e27))) {
                } else {
                    break;
                }
                {
                    uint _e30 = row_3;
                    uint _e32 = l_5;
                    uint _e33 = l_5;
                    uint _e35 = row_3;
                    vec3 _e37 = table_light_at(table_4, at_97, ((_e32 * _e33) + _e35));
                    band_3[_e30] = _e37;
                }
            }
            uint _e41 = l_5;
            uint _e42 = entry_2;
            turn_band(_e41, _e42, _e12, band_3);
            row_4 = 0u;
            bool loop_init_12 = true;
            while(true) {
                if (!loop_init_12) {
                    uint _e63 = row_4;
                    row_4 = (_e63 + 1u);
                }
                loop_init_12 = false;
                uint _e45 = row_4;
                uint _e47 = l_5;
                if ((_e45 <= (2u * _e47))) {
                } else {
                    break;
                }
                {
                    vec3 _e50 = radiance_1;
                    uint _e51 = l_5;
                    uint _e52 = l_5;
                    uint _e54 = row_4;
                    vec3 _e56 = table_coefficient_at(table_4, at_97, ((_e51 * _e52) + _e54));
                    uint _e57 = row_4;
                    vec3 _e59 = band_3[_e57];
                    radiance_1 = (_e50 + (_e56 * _e59));
                }
            }
            uint _e65 = entry_2;
            uint _e66 = l_5;
            uint _e67 = turned_entries(_e66);
            entry_2 = (_e65 + _e67);
        }
    }
    vec3 _e72 = radiance_1;
    return _e72;
}

vec3 table_reflected(Surface surface_2) {
    mat3x3 frame_3 = mat3x3(surface_2.tangent, cross(surface_2.normal, surface_2.tangent), surface_2.normal);
    TableUniforms _e8 = table_uniforms;
    vec2 _e11 = table_place_of(_e8, (surface_2.view * frame_3));
    TableUniforms _e13 = table_uniforms;
    vec3 _e20 = table_radiance(_e13, TablePoint(((0.5 * _e11) + vec2(0.5))), frame_3);
    return _e20;
}

vec3 shade_mode(Surface surface_3) {
    vec3 _e1 = table_reflected(surface_3);
    vec3 _e2 = lamps_added(surface_3, _e1);
    return _e2;
}

uint texture_texels_element(uint i_6) {
    uvec4 _e8 = texelFetch(texture_texels, ivec2(uvec2((i_6 % 1024u), (i_6 / 1024u))), 0);
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
    int inside = (((index % period) + period) % period);
    return uint(min(inside, ((wrap == TEXTURE_MIRROR) ? ((period - 1) - inside) : inside)));
}

vec3 texture_texel(uvec4 level, int column, int row_5) {
    uint _e8 = texture_uniforms.wrap.x;
    uint _e9 = texture_wrapped(column, int(level.y), _e8);
    uint _e15 = texture_uniforms.wrap.y;
    uint _e16 = texture_wrapped(row_5, int(level.z), _e15);
    uint _e22 = texture_texels_element(((level.x + (_e16 * level.y)) + _e9));
    vec3 _e25 = texture_decode((vec4(_e22 & 0xFFu, _e22 >> 8 & 0xFFu, _e22 >> 16 & 0xFFu, _e22 >> 24) / 255.0).xyz);
    return _e25;
}

vec3 texture_level(uvec4 level_1, vec2 at_98, bool nearest) {
    vec2 place_1 = (at_98 * vec2(level_1.yz));
    if (nearest) {
        ivec2 first_3 = ivec2(floor(place_1));
        vec3 _e10 = texture_uniforms.factor;
        vec3 _e13 = texture_texel(level_1, first_3.x, first_3.y);
        return (_e10 * _e13);
    }
    vec2 middle_2 = (place_1 - vec2(0.5));
    vec2 floored = floor(middle_2);
    vec2 share_6 = (middle_2 - floored);
    ivec2 first_4 = ivec2(floored);
    ivec2 next_1 = (first_4 + ivec2(1));
    vec3 _e26 = texture_uniforms.factor;
    vec3 _e29 = texture_texel(level_1, first_4.x, first_4.y);
    vec3 _e32 = texture_texel(level_1, next_1.x, first_4.y);
    vec3 _e37 = texture_texel(level_1, first_4.x, next_1.y);
    vec3 _e40 = texture_texel(level_1, next_1.x, next_1.y);
    return (_e26 * mix(mix(_e29, _e32, share_6.x), mix(_e37, _e40, share_6.x), share_6.y));
}

vec3 texture_color(vec2 at_99, vec2 across_1, vec2 down) {
    float level_2 = 0.0;
    bool local_9 = false;
    uvec4 _e6 = texture_uniforms.levels[0];
    vec2 size_4 = vec2(_e6.yz);
    float square_2 = max(dot((across_1 * size_4), (across_1 * size_4)), dot((down * size_4), (down * size_4)));
    uint _e18 = texture_uniforms.count;
    uint most_1 = (_e18 - 1u);
    if ((square_2 > 1.0)) {
        level_2 = (0.5 * log2(square_2));
    }
    float _e28 = level_2;
    if ((_e28 == 0.0)) {
        uvec4 _e34 = texture_uniforms.levels[0];
        uint _e37 = texture_uniforms.nearest;
        if ((_e37 == 1u)) {
            local_9 = (most_1 > 0u);
        } else {
            local_9 = false;
        }
        bool _e45 = local_9;
        vec3 _e46 = texture_level(_e34, at_99, _e45);
        return _e46;
    }
    float _e47 = level_2;
    if ((_e47 >= float(most_1))) {
        uvec4 _e53 = texture_uniforms.levels[most_1];
        vec3 _e55 = texture_level(_e53, at_99, false);
        return _e55;
    }
    float _e56 = level_2;
    uint fine = uint(_e56);
    uvec4 _e61 = texture_uniforms.levels[fine];
    vec3 _e63 = texture_level(_e61, at_99, false);
    uvec4 _e69 = texture_uniforms.levels[(fine + 1u)];
    vec3 _e71 = texture_level(_e69, at_99, false);
    float _e72 = level_2;
    return mix(_e63, _e71, (_e72 - float(fine)));
}

vec3 texture_at_fragment(vec2 coordinates, float nearness, float samples) {
    vec2 sum_15 = (coordinates * nearness);
    float scale_2 = (1.0 / (nearness * samples));
    vec2 _e7 = dFdx(sum_15);
    float _e8 = dFdx(nearness);
    vec2 across_11 = ((_e7 - (coordinates * _e8)) * scale_2);
    vec2 _e12 = dFdy(sum_15);
    float _e13 = dFdy(nearness);
    vec2 down_1 = ((_e12 - (coordinates * _e13)) * scale_2);
    vec3 _e17 = texture_color(coordinates, across_11, down_1);
    return _e17;
}

vec4 base_color_number(uint column_1, uint row_6) {
    vec4 _e5 = texelFetch(base_color_numbers, ivec2(uvec2(column_1, row_6)), 0);
    return _e5;
}

vec3 base_color_several(vec3 color, float whole) {
    vec3 average = (color + ((vec3(1.0) - color) / vec3(21.0)));
    return (((average * average) * whole) / (vec3(1.0) - (average * (1.0 - whole))));
}

vec3 base_color(uint row_7, vec3 color_1, vec3 radiance_2, Surface surface_4) {
    vec3 light_21 = vec3(0.0);
    uint nodes = ((uvec2(textureSize(base_color_numbers, 0).xy).x - BASE_COLOR_NUMBERS) / 2u);
    float place_2 = (sqrt(clamp(dot(surface_4.normal, surface_4.view), 0.0, 1.0)) * float((nodes - 1u)));
    uint node_2 = min(uint(place_2), (nodes - 2u));
    uint column_2 = (BASE_COLOR_NUMBERS + (2u * node_2));
    float share_7 = (place_2 - float(node_2));
    vec4 _e32 = base_color_number(column_2, row_7);
    vec4 _e35 = base_color_number((column_2 + 2u), row_7);
    vec4 facets = mix(_e32, _e35, share_7);
    vec4 _e39 = base_color_number((column_2 + 1u), row_7);
    vec4 _e42 = base_color_number((column_2 + 3u), row_7);
    vec4 layers = mix(_e39, _e42, share_7);
    vec3 n_4 = surface_4.normal;
    vec4 _e46 = base_color_number(0u, row_7);
    light_21 = _e46.xyz;
    vec3 _e49 = light_21;
    vec4 _e51 = base_color_number(1u, row_7);
    light_21 = (_e49 + (_e51.xyz * n_4.y));
    vec3 _e56 = light_21;
    vec4 _e58 = base_color_number(2u, row_7);
    light_21 = (_e56 + (_e58.xyz * n_4.z));
    vec3 _e63 = light_21;
    vec4 _e65 = base_color_number(3u, row_7);
    light_21 = (_e63 + (_e65.xyz * n_4.x));
    vec3 _e70 = light_21;
    vec4 _e72 = base_color_number(4u, row_7);
    light_21 = (_e70 + (_e72.xyz * (n_4.x * n_4.y)));
    vec3 _e79 = light_21;
    vec4 _e81 = base_color_number(5u, row_7);
    light_21 = (_e79 + (_e81.xyz * (n_4.y * n_4.z)));
    vec3 _e88 = light_21;
    vec4 _e90 = base_color_number(6u, row_7);
    light_21 = (_e88 + (_e90.xyz * (((3.0 * n_4.z) * n_4.z) - 1.0)));
    vec3 _e101 = light_21;
    vec4 _e103 = base_color_number(7u, row_7);
    light_21 = (_e101 + (_e103.xyz * (n_4.x * n_4.z)));
    vec3 _e110 = light_21;
    vec4 _e112 = base_color_number(8u, row_7);
    light_21 = (_e110 + (_e112.xyz * ((n_4.x * n_4.x) - (n_4.y * n_4.y))));
    vec4 _e124 = base_color_number(9u, row_7);
    vec3 _e125 = light_21;
    vec3 matte_1 = (max(_e125, vec3(0.0)) * (facets.x * (1.0 - _e124.w)));
    vec4 _e136 = base_color_number(10u, row_7);
    vec4 _e138 = base_color_number(11u, row_7);
    vec4 _e140 = base_color_number(12u, row_7);
    vec3 several = _e140.xyz;
    vec3 beside_1 = (((_e138.xyz * layers.y) + vec3(layers.x)) + vec3((_e136.w * facets.w)));
    vec3 _e162 = base_color_several(_e124.xyz, _e138.w);
    vec3 of_mean = ((beside_1 + (mix(_e136.xyz, _e124.xyz, _e124.w) * facets.z)) + (mix(several, _e162, _e124.w) * facets.y));
    vec3 _e175 = base_color_several(color_1, _e138.w);
    vec3 of_color = ((beside_1 + (mix(_e136.xyz, color_1, _e124.w) * facets.z)) + (mix(several, _e175, _e124.w) * facets.y));
    vec3 base_3 = (_e124.xyz * matte_1);
    vec3 rest_1 = max((radiance_2 - base_3), vec3(0.0));
    vec3 whole_1 = (base_3 + rest_1);
    vec3 ratio = mix(vec3(1.0), (of_color / max(of_mean, vec3(1e-30))), greaterThan(of_mean, vec3(0.0)));
    vec3 scale_3 = (((color_1 * matte_1) + (rest_1 * ratio)) / max(whole_1, vec3(1e-30)));
    return mix(radiance_2, (radiance_2 * scale_3), greaterThan(whole_1, vec3(0.0)));
}

vec3 mesh_radiance(PageVertex at_100, Surface surface_5, vec3 radiance_3) {
    vec3 _e7 = texture_at_fragment(at_100.coordinates, at_100.position.w, 1.0);
    vec3 _e9 = base_color(0u, _e7, radiance_3, surface_5);
    return _e9;
}

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

