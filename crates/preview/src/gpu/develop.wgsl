// Develops one sample of each pixel, from radiance to display light, and adds it to the pixel's sums.

struct DevelopUniforms {
    flat_radiance: vec3f,
    background: u32,
    gain: f32,
    tone: u32,
    // `SHOW_ONE` and so on.
    show: u32,
    // The first column of the second mode of a split.
    divider: u32,
    amplify: f32,
    // The divisors of the two modes' sums.
    first_count: f32,
    second_count: f32,
    // 1 at the first sample of each pixel, which starts the sums.
    begins: u32,
    // 1 at the last sample, after which the codes are computed.
    ends: u32,
    // The index of this sample's first square.
    first_square: u32,
    // 1 if the mode shows the material, so that a texture changes it.
    first_shows_material: u32,
    second_shows_material: u32,
}

const SHOW_ONE = 0u;
const SHOW_SPLIT = 1u;
const SHOW_DIFFERENCE = 2u;

@group(2) @binding(0) var<uniform> settings: DevelopUniforms;
@group(2) @binding(1) var<storage, read> first_mode: array<vec4f>;
@group(2) @binding(2) var<storage, read> second_mode: array<vec4f>;
// Sums over the samples of each pixel: radiance, and the number that hit a surface.
@group(2) @binding(3) var<storage, read_write> radiances: array<vec4f>;
// Sums over the samples of each pixel: linear display light, and the number of samples.
@group(2) @binding(4) var<storage, read_write> displays: array<vec4f>;
// For each workgroup the sums of squared differences and of squares of the reference, and the number of
// samples that hit a surface.
@group(2) @binding(5) var<storage, read_write> squares: array<vec4f>;

// Four bytes: red, the lowest, green, blue and 255.
@group(2) @binding(6) var<storage, read_write> codes: array<u32>;

var<workgroup> of_group: array<vec4f, 64>;

@compute @workgroup_size(8, 8)
fn develop_samples(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    var square = vec4f(0.0);
    if all(id.xy < frame.size) {
        square = develop_sample(id.xy);
    }
    if settings.show != SHOW_DIFFERENCE {
        return;
    }
    of_group[local] = square;
    for (var reach = 32u; reach > 0u; reach /= 2u) {
        workgroupBarrier();
        if local < reach {
            of_group[local] += of_group[local + reach];
        }
    }
    if local == 0u {
        squares[settings.first_square + group.y * groups.x + group.x] = of_group[0];
    }
}

fn develop_sample(pixel: vec2u) -> vec4f {
    let index = frame_index(pixel);
    var square = vec4f(0.0);
    var radiance: vec4f;
    var display = vec4f(1.0);
    if textureLoad(normals, pixel, 0).w == 0.0 {
        // Both modes have the same background, so their difference is black there.
        if settings.show != SHOW_DIFFERENCE {
            radiance = vec4f(background(settings.background, settings.flat_radiance, frame_ray(pixel)), 0.0);
        }
        let gain = select(settings.gain, 1.0, settings.background == BACKGROUND_FLAT);
        display = vec4f(develop(radiance.rgb, gain, settings.tone), 1.0);
    } else {
        var value = shown_radiance(pixel, 0u, first_mode[index].rgb / settings.first_count);
        var shown = 1.0;
        if settings.show == SHOW_DIFFERENCE {
            let compared = shown_radiance(pixel, 1u, second_mode[index].rgb / settings.second_count);
            value = difference(value, compared);
            shown = settings.amplify;
            square = vec4f(dot(value, value), dot(compared, compared), 1.0, 0.0);
        } else if settings.show == SHOW_SPLIT && pixel.x >= settings.divider {
            value = shown_radiance(pixel, 1u, second_mode[index].rgb / settings.second_count);
        }
        radiance = vec4f(value, 1.0);
        display = vec4f(develop(value * shown, settings.gain, settings.tone), 1.0);
    }
    if settings.begins == 0u {
        radiance += radiances[index];
        display += displays[index];
    }
    radiances[index] = radiance;
    displays[index] = display;
    if settings.ends == 1u {
        codes[index] = pack4x8unorm(vec4f(develop_encode(display.rgb / display.w), 1.0));
    }
    return square;
}
