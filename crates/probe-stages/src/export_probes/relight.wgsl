// Adds the light of a section of transport.bin to all probes: a thread for each row, 9 a probe. Dispatch
// ceil( 9 * probes / 64 ) workgroups for the sky, and again for emission and for lamps, with the section's columns.
//
// If the section of the sky has `cpca`, `relight` makes the light of its clusters first: dispatch it with
// rows = 9 * clusters * ( 1 + components ) and a buffer of 3 * rows zeros as `light`. `blend` then adds the light of
// probes, with that buffer as `clusters`.

struct Section {
    rows: u32, // 9 times the probes, or the matrices of clusters
    columns: u32,
    channels: u32, // 1 or 3
    first: u32, // `offset` of transport.json / 2
}

@group(0) @binding(0) var<uniform> section: Section;
@group(0) @binding(1) var<storage, read> halves: array<u32>; // the bytes of transport.bin
@group(0) @binding(2) var<storage, read> colours: array<vec4f>; // a coefficient of the sky or a colour for each column
@group(0) @binding(3) var<storage, read_write> light: array<f32>; // 27 a probe, 0 before the first section

fn half_at(index: u32) -> f32 {
    let pair = unpack2x16float(halves[index / 2u]);
    return select(pair.x, pair.y, index % 2u == 1u);
}

@compute @workgroup_size(64)
fn relight(@builtin(global_invocation_id) id: vec3u) {
    let row = id.x;
    if row >= section.rows {
        return;
    }
    var sum = vec3f(0.0);
    var at = section.first + row * section.columns * section.channels;
    for (var column = 0u; column < section.columns; column += 1u) {
        var t = vec3f(half_at(at));
        if section.channels == 3u {
            t = vec3f(t.x, half_at(at + 1u), half_at(at + 2u));
        }
        sum += t * colours[column].rgb;
        at += section.channels;
    }
    light[3u * row] += sum.r;
    light[3u * row + 1u] += sum.g;
    light[3u * row + 2u] += sum.b;
}

struct Blend {
    rows: u32, // 9 times the probes
    components: u32,
    weights: u32, // `weights` of `cpca` / 2
    cluster_of: u32, // `cluster_of` of `cpca`
}

@group(0) @binding(4) var<uniform> blended: Blend;
@group(0) @binding(5) var<storage, read> clusters: array<f32>; // what `relight` made

@compute @workgroup_size(64)
fn blend(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= blended.rows {
        return;
    }
    let probe = id.x / 9u;
    let byte = blended.cluster_of + probe;
    let cluster = (halves[byte / 4u] >> (8u * (byte % 4u))) & 255u;
    var at = 27u * (1u + blended.components) * cluster + 3u * (id.x % 9u);
    var sum = vec3f(clusters[at], clusters[at + 1u], clusters[at + 2u]);
    for (var k = 0u; k < blended.components; k += 1u) {
        at += 27u;
        let weight = half_at(blended.weights + probe * blended.components + k);
        sum += weight * vec3f(clusters[at], clusters[at + 1u], clusters[at + 2u]);
    }
    light[3u * id.x] += sum.r;
    light[3u * id.x + 1u] += sum.g;
    light[3u * id.x + 2u] += sum.b;
}
