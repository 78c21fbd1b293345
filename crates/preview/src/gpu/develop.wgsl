// One sample of each pixel from radiance to display light, added to the pixel's sums.

struct Develop {
    flat_radiance: vec3f,
    background: u32,
    gain: f32,
    tone: u32,
    // `SHOW_ONE` and so on.
    show: u32,
    // Of a split: the first column of the second mode.
    divider: u32,
    amplify: f32,
    // What the two modes' sums are divided by.
    first_count: f32,
    second_count: f32,
    // 1 at the first sample of each pixel: sums begin with it. 1 at the last: codes are made.
    begins: u32,
    ends: u32,
    // Where this sample's squares lie.
    first_square: u32,
}

const SHOW_ONE = 0u;
const SHOW_SPLIT = 1u;
const SHOW_DIFFERENCE = 2u;

@group(2) @binding(0) var<uniform> settings: Develop;
@group(2) @binding(1) var<storage, read> first_mode: array<vec4f>;
@group(2) @binding(2) var<storage, read> second_mode: array<vec4f>;
// Sums over the samples of each pixel: radiance, and how many see a surface; linear display light, and how many there are.
@group(2) @binding(3) var<storage, read_write> radiances: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> displays: array<vec4f>;
// Of each workgroup: the sum of squared differences, of squares of what is compared with, and how many samples see a surface.
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
        // Two modes have the same background: their difference is black there.
        if settings.show != SHOW_DIFFERENCE {
            radiance = vec4f(background(settings.background, settings.flat_radiance, frame_ray(pixel)), 0.0);
        }
        let gain = select(settings.gain, 1.0, settings.background == BACKGROUND_FLAT);
        display = vec4f(develop(radiance.rgb, gain, settings.tone), 1.0);
    } else {
        var value = first_mode[index].rgb / settings.first_count;
        var shown = 1.0;
        if settings.show == SHOW_DIFFERENCE {
            let compared = second_mode[index].rgb / settings.second_count;
            value = difference(value, compared);
            shown = settings.amplify;
            square = vec4f(dot(value, value), dot(compared, compared), 1.0, 0.0);
        } else if settings.show == SHOW_SPLIT && pixel.x >= settings.divider {
            value = second_mode[index].rgb / settings.second_count;
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
