// Development, from radiance to sRGB codes: exposure and tone curve for each sample, the mean of a pixel's
// samples in linear display light, and the nearest code. The twin of develop.rs. The curves are those of
// `envmap::ToneMap`: plain, and Stephen Hill's fit of the ACES RRT and sRGB ODT (`ACES.hlsl` in MJP's
// BakingLab), scaled so that 0.18 stays 0.18.

const DEVELOP_PLAIN = 0u;
const DEVELOP_FILMIC = 1u;

// The columns are the rows of the matrices in `envmap`.
const DEVELOP_INTO_ACES = mat3x3f(
    0.59719, 0.07600, 0.02840,
    0.35458, 0.90834, 0.13383,
    0.04823, 0.01566, 0.83777,
);
const DEVELOP_FROM_ACES = mat3x3f(
    1.60475, -0.10208, -0.00327,
    -0.53108, 1.10813, -0.07276,
    -0.07367, -0.00605, 1.07602,
);
// The fit maps 0.18 times this to 0.18.
const DEVELOP_MIDDLE_GREY = 1.46193;

// NaN is black: the comparison fails.
fn develop_between(value: vec3f, most: f32) -> vec3f {
    return select(vec3f(0.0), min(value, vec3f(most)), value > vec3f(0.0));
}

// The linear display value of a sample, each channel 0 to 1. `gain` is 2^exposure.
fn develop(radiance: vec3f, gain: f32, tone: u32) -> vec3f {
    if tone == DEVELOP_PLAIN {
        return develop_between(radiance * gain, 1.0);
    }
    let exposed = develop_between(radiance * gain * DEVELOP_MIDDLE_GREY, 1e6);
    let v = DEVELOP_INTO_ACES * exposed;
    let curved = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    return develop_between(DEVELOP_FROM_ACES * curved, 1.0);
}

// The sRGB transfer function (IEC 61966-2-1), from linear 0 to 1 to encoded 0 to 1.
fn develop_encode(linear: vec3f) -> vec3f {
    let curve = 1.055 * pow(max(linear, vec3f(0.0031308)), vec3f(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * linear, linear <= vec3f(0.0031308));
}
