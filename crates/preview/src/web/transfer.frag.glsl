precision highp float;
precision highp int;
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
layout(std140) uniform page_block { PageUniforms page; };
smooth in vec3 _vs2fs_location0;
layout(location = 0) out vec4 _fs2p_location0;
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
    TransferVertex at = TransferVertex(gl_FragCoord, _vs2fs_location0);
    vec4 _e2 = page_shown(at.radiance);
    _fs2p_location0 = _e2;
    return;
}
