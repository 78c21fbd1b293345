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

invariant gl_Position;
smooth out vec3 _vs2fs_location0;
smooth out vec3 _vs2fs_location1;
smooth out vec3 _vs2fs_location2;
smooth out vec2 _vs2fs_location3;

void main() {
    uint corner = uint(gl_VertexID);
    float x = ((corner == 1u) ? 3.0 : -1.0);
    float y = ((corner == 2u) ? 3.0 : -1.0);
    vec3 _e13 = page.ray_forward;
    vec3 _e16 = page.ray_right;
    vec3 _e21 = page.ray_up;
    vec3 ray = ((_e13 + (_e16 * x)) + (_e21 * y));
    mat3x3 _e33 = page.to_light;
    PageVertex _tmp_return = PageVertex(vec4(x, y, 1.0, 1.0), vec3(0.0), vec3(0.0), (_e33 * ray), vec2(0.0));
    gl_Position = _tmp_return.position;
    _vs2fs_location0 = _tmp_return.normal;
    _vs2fs_location1 = _tmp_return.tangent;
    _vs2fs_location2 = _tmp_return.ray;
    _vs2fs_location3 = _tmp_return.coordinates;
    return;
}

