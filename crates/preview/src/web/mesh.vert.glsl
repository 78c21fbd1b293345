#version 300 es

precision highp float;
precision highp int;

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
struct PageVertex {
    vec4 position;
    vec3 normal;
    vec3 tangent;
    vec3 ray;
    vec2 coordinates;
};
const uint CENTRE_REFLECTION = 0u;
const uint CENTRE_NORMAL = 1u;
const uint CENTRE_TANGENT = 2u;
const uint DEVELOP_PLAIN = 0u;
const uint DEVELOP_FILMIC = 1u;
const mat3x3 DEVELOP_INTO_ACES = mat3x3(vec3(0.59719, 0.076, 0.0284), vec3(0.35458, 0.90834, 0.13383), vec3(0.04823, 0.01566, 0.83777));
const mat3x3 DEVELOP_FROM_ACES = mat3x3(vec3(1.60475, -0.10208, -0.00327), vec3(-0.53108, 1.10813, -0.07276), vec3(-0.07367, -0.00605, 1.07602));

layout(std140) uniform page_block { PageUniforms page; };

layout(location = 0) in vec3 _p2vs_location0;
layout(location = 1) in vec3 _p2vs_location1;
layout(location = 2) in vec3 _p2vs_location2;
layout(location = 3) in vec2 _p2vs_location3;
invariant gl_Position;
smooth out vec3 _vs2fs_location0;
smooth out vec3 _vs2fs_location1;
smooth out vec3 _vs2fs_location2;
smooth out vec2 _vs2fs_location3;

void main() {
    vec3 position = _p2vs_location0;
    vec3 normal = _p2vs_location1;
    vec3 tangent = _p2vs_location2;
    vec2 coordinates = _p2vs_location3;
    mat4x4 _e6 = page.clip;
    mat3x3 _e12 = page.to_light;
    mat3x3 _e16 = page.to_light;
    mat3x3 _e20 = page.to_light;
    vec3 _e23 = page.eye;
    PageVertex _tmp_return = PageVertex((_e6 * vec4(position, 1.0)), (_e12 * normal), (_e16 * tangent), (_e20 * (position - _e23)), coordinates);
    gl_Position = _tmp_return.position;
    _vs2fs_location0 = _tmp_return.normal;
    _vs2fs_location1 = _tmp_return.tangent;
    _vs2fs_location2 = _tmp_return.ray;
    _vs2fs_location3 = _tmp_return.coordinates;
    return;
}

