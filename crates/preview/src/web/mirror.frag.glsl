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

vec3 lat_long_sample(highp sampler2DArray map, vec3 direction) {
    vec3 sum = vec3(0.0);
    int k = 0;
    bool local_1 = false;
    ivec2 size = ivec2(uvec2(textureSize(map, 0).xy));
    float _e6 = angles_angle(direction.y, direction.x);
    float _e10 = angles_angle(length(direction.xy), direction.z);
    float x_1 = (((0.5 - (_e6 / 6.2831855)) * float(size.x)) - 0.5);
    float y_1 = (((_e10 / 3.1415927) * float(size.y)) - 0.5);
    float top = floor(y_1);
    float lower = (y_1 - top);
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            int _e98 = k;
            k = (_e98 + 1);
        }
        loop_init = false;
        int _e34 = k;
        if ((_e34 < 2)) {
        } else {
            break;
        }
        {
            int _e38 = k;
            int row = (int(top) + _e38);
            if (!((row < 0))) {
                local_1 = (row >= size.y);
            } else {
                local_1 = true;
            }
            bool past = local_1;
            float across = (past ? (x_1 + (0.5 * float(size.x))) : x_1);
            float left = floor(across);
            float share = (across - left);
            int column = ((int(left) + size.x) % size.x);
            int next = ((column + 1) % size.x);
            int inside = min(max(row, 0), (size.y - 1));
            int _e73 = k;
            float weight = ((_e73 == 0) ? (1.0 - lower) : lower);
            vec3 _e77 = sum;
            vec4 _e81 = texelFetch(map, ivec3(ivec2(column, inside), 0), 0);
            sum = (_e77 + (_e81.xyz * ((1.0 - share) * weight)));
            vec3 _e88 = sum;
            vec4 _e92 = texelFetch(map, ivec3(ivec2(next, inside), 0), 0);
            sum = (_e88 + (_e92.xyz * (share * weight)));
        }
    }
    vec3 _e100 = sum;
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
    vec3 v_1 = (DEVELOP_INTO_ACES * _e12);
    vec3 curved = (((v_1 * (v_1 + vec3(0.0245786))) - vec3(9.0537e-5)) / ((v_1 * ((0.983729 * v_1) + vec3(0.432951))) + vec3(0.238081)));
    vec3 _e35 = develop_between((DEVELOP_FROM_ACES * curved), 1.0);
    return _e35;
}

vec3 develop_encode(vec3 linear) {
    vec3 curve = ((1.055 * pow(max(linear, vec3(0.0031308)), vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * linear), lessThanEqual(linear, vec3(0.0031308)));
}

vec3 mirror(Surface surface_1) {
    vec3 _e3 = surface_central(surface_1, CENTRE_REFLECTION);
    vec3 _e4 = lat_long_sample(map, _e3);
    return _e4;
}

vec3 shade_mode(Surface surface_2) {
    vec3 _e1 = mirror(surface_2);
    return _e1;
}

vec3 mesh_radiance(PageVertex at_1, Surface surface_3, vec3 radiance_1) {
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

