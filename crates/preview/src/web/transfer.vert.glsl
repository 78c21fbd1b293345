precision highp float;
precision highp int;
struct TurnedAngles {
    vec2 alpha;
    vec2 beta;
    vec2 gamma;
};
struct TransferUniforms {
    uint rows;
    uint light_rows;
    uint channels;
};
struct TransferVertex {
    vec4 position;
    vec3 radiance;
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
const uint TURNED_WIDTH = 29u;
#ifdef QUARTER_TURNS_VECTORS
layout(std140) uniform quarter_turns_block { vec4 quarter_turns[QUARTER_TURNS_VECTORS]; };
#else
uniform highp sampler2D quarter_turns;
#endif
layout(std140) uniform transfer_uniforms_block { TransferUniforms transfer_uniforms; };
#ifdef TRANSFER_LIGHT_VECTORS
layout(std140) uniform transfer_light_block { vec4 transfer_light[TRANSFER_LIGHT_VECTORS]; };
#else
uniform highp sampler2D transfer_light;
#endif
uniform highp sampler2D transfer_vectors;
layout(std140) uniform page_block { PageUniforms page; };
layout(location = 0) in vec3 _p2vs_location0;
invariant gl_Position;
smooth out vec3 _vs2fs_location0;
TurnedAngles turned_angles(mat3x3 frame) {
    vec3 x = frame[0];
    vec3 n = frame[2];
    float sine = length(n.xy);
    vec2 alpha = ((sine > 0.0) ? (n.xy / vec2(sine)) : vec2(1.0, 0.0));
    float along = dot(alpha, x.xy);
    vec2 gamma = vec2(((n.z * along) - (sine * x.z)), ((alpha.x * x.y) - (alpha.y * x.x)));
    return TurnedAngles(alpha, vec2(n.z, sine), gamma);
}
uint turned_entries(uint l_1) {
    return (((2u * l_1) + 1u) * ((l_1 / 2u) + 1u));
}
uint quarter_turn_column(uint l_2, uint row_2, uint k) {
    uint odd = ((l_2 + ((row_2 < l_2) ? 1u : 0u)) % 2u);
    bool is_even = ((row_2 % 2u) == 0u);
    uint m_1 = ((is_even ? odd : (2u - odd)) + (2u * k));
    if ((m_1 > l_2)) {
        return ((2u * l_2) + 1u);
    }
    return (is_even ? (l_2 + m_1) : (l_2 - m_1));
}
void turn_about_z(uint l_3, vec2 angle, inout vec3 band_1[29]) {
    vec2 multiple = vec2(1.0, 0.0);
    uint m = 1u;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e59 = m;
            m = (_e59 + 1u);
        }
        loop_init = false;
        uint _e9 = m;
        if ((_e9 <= l_3)) {
        } else {
            break;
        }
        {
            float _e12 = multiple.x;
            float _e16 = multiple.y;
            float _e21 = multiple.y;
            float _e25 = multiple.x;
            multiple = vec2(((_e12 * angle.x) + (_e16 * angle.y)), ((_e21 * angle.x) - (_e25 * angle.y)));
            uint _e30 = m;
            vec3 even = band_1[(l_3 + _e30)];
            uint _e34 = m;
            vec3 odd_1 = band_1[(l_3 - _e34)];
            uint _e38 = m;
            float _e42 = multiple.x;
            float _e45 = multiple.y;
            band_1[(l_3 + _e38)] = ((even * _e42) - (odd_1 * _e45));
            uint _e48 = m;
            float _e52 = multiple.y;
            float _e55 = multiple.x;
            band_1[(l_3 - _e48)] = ((even * _e52) + (odd_1 * _e55));
        }
    }
    return;
}
vec2 quarter_turns_element(uint i) {
#ifdef QUARTER_TURNS_VECTORS
    vec4 _e8 = quarter_turns[i];
#else
    vec4 _e8 = texelFetch(quarter_turns, ivec2(uvec2((i % 1024u), (i / 1024u))), 0);
#endif
    return _e8.xy;
}
void turn_about_x(uint l_4, uint entry_1, uint back, inout vec3 band_2[29]) {
    uint row_3 = 0u;
    vec3 sum = vec3(0.0);
    uint k_1 = 0u;
    uint count = ((l_4 / 2u) + 1u);
    vec3 before[29] = band_2;
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            uint _e46 = row_3;
            row_3 = (_e46 + 1u);
        }
        loop_init_1 = false;
        uint _e11 = row_3;
        if ((_e11 <= (2u * l_4))) {
        } else {
            break;
        }
        {
            sum = vec3(0.0);
            k_1 = 0u;
            bool loop_init_2 = true;
            while(true) {
                if (!loop_init_2) {
                    uint _e40 = k_1;
                    k_1 = (_e40 + 1u);
                }
                loop_init_2 = false;
                uint _e20 = k_1;
                if ((_e20 < count)) {
                } else {
                    break;
                }
                {
                    uint _e22 = row_3;
                    uint _e23 = k_1;
                    uint _e24 = quarter_turn_column(l_4, _e22, _e23);
                    if ((_e24 <= (2u * l_4))) {
                        vec3 _e28 = sum;
                        uint _e29 = row_3;
                        uint _e32 = k_1;
                        vec2 _e34 = quarter_turns_element(((entry_1 + (_e29 * count)) + _e32));
                        sum = (_e28 + (_e34[back] * before[_e24]));
                    }
                }
            }
            uint _e42 = row_3;
            vec3 _e44 = sum;
            band_2[_e42] = _e44;
        }
    }
    return;
}
void turn_band(uint l_5, uint entry_2, TurnedAngles angles, inout vec3 band_3[29]) {
    turn_about_z(l_5, angles.alpha, band_3);
    turn_about_x(l_5, entry_2, 0u, band_3);
    turn_about_z(l_5, angles.beta, band_3);
    turn_about_x(l_5, entry_2, 1u, band_3);
    turn_about_z(l_5, angles.gamma, band_3);
    return;
}
vec4 transfer_light_element(uint i_1) {
#ifdef TRANSFER_LIGHT_VECTORS
    vec4 _e8 = transfer_light[i_1];
#else
    vec4 _e8 = texelFetch(transfer_light, ivec2(uvec2((i_1 % 1024u), (i_1 / 1024u))), 0);
#endif
    return _e8;
}
vec4 transfer_vectors_element(uint i_2) {
    vec4 _e8 = texelFetch(transfer_vectors, ivec2(uvec2((i_2 % 1024u), (i_2 / 1024u))), 0);
    return _e8;
}
float transfer_coefficient(uint vertex_1, uint channel, uint i_3) {
    uint _e5 = transfer_uniforms.channels;
    uint vector = ((vertex_1 * _e5) + channel);
    uint _e10 = transfer_uniforms.rows;
    vec4 _e19 = transfer_vectors_element(((vector * ((_e10 + 3u) / 4u)) + (i_3 / 4u)));
    return _e19[(i_3 % 4u)];
}
vec3 transfer_coefficients(uint vertex_2, uint i_4) {
    float _e3 = transfer_coefficient(vertex_2, 0u, i_4);
    uint _e6 = transfer_uniforms.channels;
    if ((_e6 == 1u)) {
        return vec3(_e3);
    }
    float _e11 = transfer_coefficient(vertex_2, 1u, i_4);
    float _e13 = transfer_coefficient(vertex_2, 2u, i_4);
    return vec3(_e3, _e11, _e13);
}
void main() {
    uint vertex = uint(gl_VertexID);
    vec3 position = _p2vs_location0;
    vec3 radiance = vec3(0.0);
    uint entry = 0u;
    uint l = 1u;
    vec3 band[29] = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    uint row = 0u;
    uint row_1 = 0u;
    uint _e4 = transfer_uniforms.rows;
    uint _e7 = transfer_uniforms.light_rows;
    uint known = min(_e4, _e7);
    vec3 _e10 = transfer_coefficients(vertex, 0u);
    vec4 _e12 = transfer_light_element(0u);
    radiance = (_e10 * _e12.xyz);
    mat3x3 _e18 = page.to_light;
    TurnedAngles _e19 = turned_angles(_e18);
    bool loop_init_3 = true;
    while(true) {
        if (!loop_init_3) {
            uint _e78 = l;
            l = (_e78 + 1u);
        }
        loop_init_3 = false;
        uint _e24 = l;
        uint _e25 = l;
        if (((_e24 * _e25) < known)) {
        } else {
            break;
        }
        {
            band = vec3[29](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
            row = 0u;
            bool loop_init_4 = true;
            while(true) {
                if (!loop_init_4) {
                    uint _e47 = row;
                    row = (_e47 + 1u);
                }
                loop_init_4 = false;
                uint _e32 = row;
                uint _e34 = l;
                if ((_e32 <= (2u * _e34))) {
                } else {
                    break;
                }
                {
                    uint _e37 = row;
                    uint _e39 = l;
                    uint _e40 = l;
                    uint _e42 = row;
                    vec4 _e44 = transfer_light_element(((_e39 * _e40) + _e42));
                    band[_e37] = _e44.xyz;
                }
            }
            uint _e49 = l;
            uint _e50 = entry;
            turn_band(_e49, _e50, _e19, band);
            row_1 = 0u;
            bool loop_init_5 = true;
            while(true) {
                if (!loop_init_5) {
                    uint _e71 = row_1;
                    row_1 = (_e71 + 1u);
                }
                loop_init_5 = false;
                uint _e53 = row_1;
                uint _e55 = l;
                if ((_e53 <= (2u * _e55))) {
                } else {
                    break;
                }
                {
                    vec3 _e58 = radiance;
                    uint _e59 = l;
                    uint _e60 = l;
                    uint _e62 = row_1;
                    vec3 _e64 = transfer_coefficients(vertex, ((_e59 * _e60) + _e62));
                    uint _e65 = row_1;
                    vec3 _e67 = band[_e65];
                    radiance = (_e58 + (_e64 * _e67));
                }
            }
            uint _e73 = entry;
            uint _e74 = l;
            uint _e75 = turned_entries(_e74);
            entry = (_e73 + _e75);
        }
    }
    mat4x4 _e82 = page.clip;
    vec3 _e86 = radiance;
    TransferVertex _tmp_return = TransferVertex((_e82 * vec4(position, 1.0)), _e86);
    gl_Position = _tmp_return.position;
    _vs2fs_location0 = _tmp_return.radiance;
    return;
}
