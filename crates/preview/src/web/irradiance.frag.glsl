#version 300 es

precision highp float;
precision highp int;

struct Surface {
    vec3 normal;
    vec3 tangent;
    vec3 view;
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

uniform highp sampler2DArray map;

uniform highp sampler2D harmonics_constants;

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
    float cosine_1 = dot(_e10, view);
    if ((cosine_1 < 0.001)) {
        vec3 _e14 = n;
        n = normalize((_e14 + (view * (0.001 - cosine_1))));
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

vec2 harmonics_constants_element(uint i) {
    vec4 _e8 = texelFetch(harmonics_constants, ivec2(uvec2((i % 1024u), (i / 1024u))), 0);
    return _e8.xy;
}

vec2 harmonics_constant(uint p, uint q) {
    vec2 _e8 = harmonics_constants_element((((p * (p + 1u)) / 2u) + q));
    return _e8;
}

vec3 irradiance_row(uint row) {
    vec4 _e6 = texelFetch(map, ivec3(uvec2(row, 0u), 0), 0);
    return _e6.xyz;
}

vec3 irradiance(Surface surface) {
    vec3 sum = vec3(0.0);
    float cosine = 1.0;
    float sine = 0.0;
    uint q_1 = 0u;
    float below = 0.0;
    float value_1 = 0.0;
    uint p_1 = 0u;
    vec3 n_1 = surface.normal;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e91 = q_1;
            q_1 = (_e91 + 1u);
        }
        loop_init = false;
        uint _e11 = q_1;
        if ((_e11 <= 2u)) {
        } else {
            break;
        }
        {
            below = 0.0;
            uint _e16 = q_1;
            uint _e17 = q_1;
            vec2 _e18 = harmonics_constant(_e16, _e17);
            value_1 = _e18.x;
            uint _e21 = q_1;
            p_1 = _e21;
            bool loop_init_1 = true;
            while(true) {
                if (!loop_init_1) {
                    uint _e74 = p_1;
                    p_1 = (_e74 + 1u);
                }
                loop_init_1 = false;
                uint _e23 = p_1;
                if ((_e23 <= 2u)) {
                } else {
                    break;
                }
                {
                    uint _e26 = p_1;
                    uint _e27 = q_1;
                    if ((_e26 > _e27)) {
                        uint _e29 = p_1;
                        uint _e30 = q_1;
                        vec2 _e31 = harmonics_constant(_e29, _e30);
                        float _e33 = value_1;
                        float _e37 = below;
                        float next = (((n_1.z * _e33) * _e31.x) - (_e37 * _e31.y));
                        float _e41 = value_1;
                        below = _e41;
                        value_1 = next;
                    }
                    vec3 _e42 = sum;
                    uint _e43 = p_1;
                    uint _e44 = p_1;
                    uint _e46 = p_1;
                    uint _e48 = q_1;
                    vec3 _e50 = irradiance_row((((_e43 * _e44) + _e46) + _e48));
                    float _e51 = value_1;
                    float _e52 = cosine;
                    sum = (_e42 + (_e50 * (_e51 * _e52)));
                    uint _e56 = q_1;
                    if ((_e56 > 0u)) {
                        vec3 _e59 = sum;
                        uint _e60 = p_1;
                        uint _e61 = p_1;
                        uint _e63 = p_1;
                        uint _e65 = q_1;
                        vec3 _e67 = irradiance_row((((_e60 * _e61) + _e63) - _e65));
                        float _e68 = value_1;
                        float _e69 = sine;
                        sum = (_e59 + (_e67 * (_e68 * _e69)));
                    }
                }
            }
            float _e76 = cosine;
            float _e79 = sine;
            float turned = ((_e76 * n_1.x) - (_e79 * n_1.y));
            float _e83 = cosine;
            float _e86 = sine;
            sine = ((_e83 * n_1.y) + (_e86 * n_1.x));
            cosine = turned;
        }
    }
    vec3 _e93 = sum;
    return _e93;
}

vec3 shade_mode(Surface surface_1) {
    vec3 _e1 = irradiance(surface_1);
    return _e1;
}

vec3 mesh_radiance(PageVertex at_1, Surface surface_2, vec3 radiance_1) {
    return radiance_1;
}

vec4 page_shown(vec3 radiance_2) {
    uint _e3 = page.raw;
    if ((_e3 == 1u)) {
        return vec4(radiance_2, 1.0);
    }
    float _e10 = page.gain;
    uint _e13 = page.tone;
    vec3 _e14 = develop(radiance_2, _e10, _e13);
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

