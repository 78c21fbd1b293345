use super::*;

fn source(functions: &str, resources: &[Resource]) -> Source {
    Source { functions: functions.to_owned(), resources: resources.to_vec(), rows_from_bottom: false }
}

#[test]
fn lines_are_translated_word_by_word() {
    for (wgsl, glsl, hlsl, metal) in [
        (
            "fn texel(at: vec2i, view: vec3f) -> vec3f {",
            "vec3 texel(ivec2 at, vec3 view) {",
            "float3 texel(int2 at, float3 view) {",
            "float3 texel(int2 at, float3 view) {",
        ),
        (
            "    let part: vec2f = fract(place);",
            "    vec2 part = fract(place);",
            "    float2 part = frac(place);",
            "    float2 part = fract(place);",
        ),
        (
            "    for (var k: i32 = 0; k < 4; k++) {",
            "    for (int k = 0; k < 4; k++) {",
            "    for (int k = 0; k < 4; k++) {",
            "    for (int k = 0; k < 4; k++) {",
        ),
        (
            "    let u: f32 = mix(a, atan2(y, x), inverseSqrt(z)); // f32",
            "    float u = mix(a, atan(y, x), inversesqrt(z)); // f32",
            "    float u = lerp(a, atan2(y, x), rsqrt(z)); // f32",
            "    float u = mix(a, atan2(y, x), rsqrt(z)); // f32",
        ),
        (
            "const COUNT: i32 = 3;  // let it be",
            "const int COUNT = 3;  // let it be",
            "static const int COUNT = 3;  // let it be",
            "constant int COUNT = 3;  // let it be",
        ),
    ] {
        let found = Language::ALL.map(|language| source(wgsl, &[]).functions(language));
        assert_eq!(found.each_ref().map(|line| line.trim_end()), [glsl, hlsl, metal, wgsl]);
    }
}

const ALL_READINGS: &str = "\
fn nothing(x: f32) -> f32 {
    return x;
}

fn of_picture(place: vec2f) -> vec3f {
    return nothing(2.0) * sample_2d(picture, place).rgb;
}

fn of_layers(at: vec2i, place: vec2f) -> vec3f {
    return load_layer(layers, at, 1).rgb + sample_layer(layers, place, 1).rgb;
}

fn of_cubes(c: vec3f, mip: f32) -> vec3f {
    return sample_cube(cubes, c, 2, mip).rgb * vectors[1].xyz;
}

fn all_of_them(c: vec3f) -> vec3f {
    return of_picture(c.xy) + of_layers(vec2i(c.xy), c.xy) + of_cubes(c, 0.0);
}
";

fn all_readings() -> Source {
    use ResourceKind::{Cubes, Layers, Picture, Sampler, Vectors};
    let kinds = [Picture, Layers, Cubes, Sampler("linear"), Vectors(2)];
    let names = ["picture", "layers", "cubes", "linear_sampler", "vectors"];
    let resources: Vec<_> =
        names.into_iter().zip(kinds).map(|(name, kind)| Resource { name, kind }).collect();
    source(ALL_READINGS, &resources)
}

#[test]
fn the_text_in_wgsl_is_valid() {
    for rows_from_bottom in [false, true] {
        let text = Source { rows_from_bottom, ..all_readings() }.text(Language::Wgsl);
        let main = "@fragment fn main(@location(0) c: vec3f) -> @location(0) vec4f { return vec4f(all_of_them(c), 1.0); }";
        let text = text + main;
        let module = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
        let capabilities = naga::valid::Capabilities::CUBE_ARRAY_TEXTURES;
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
        validator.validate(&module).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    }
}

#[test]
fn textures_are_read_as_the_language_does() {
    let source = all_readings();
    for (language, lines) in [
        (
            Language::Glsl,
            [
                "uniform highp samplerCubeArray cubes;\nuniform vec4 vectors[2];\n",
                "texelFetch(layers, ivec3(at, 1), 0).rgb + textureLod(layers, vec3(place, 1), 0.0).rgb;",
                "textureLod(cubes, vec4(c, 2), mip).rgb * vectors[1].xyz;",
            ],
        ),
        (
            Language::Hlsl,
            [
                "TextureCubeArray cubes;\nSamplerState linear_sampler;  // linear\nfloat4 vectors[2];\n",
                "layers.Load(int4(at, 1, 0)).rgb + layers.SampleLevel(linear_sampler, float3(place, 1), 0.0).rgb;",
                "cubes.SampleLevel(linear_sampler, float4(c, 2), mip).rgb * vectors[1].xyz;",
            ],
        ),
        (
            Language::Metal,
            [
                "//   texturecube_array<float> cubes\n//   sampler linear_sampler  // linear\n//   constant float4 *vectors\n",
                "layers.read(uint2(at), uint(1)).rgb + layers.sample(linear_sampler, place, uint(1), level(0.0)).rgb;",
                "cubes.sample(linear_sampler, c, uint(2), level(mip)).rgb * vectors[1].xyz;",
            ],
        ),
    ] {
        let text = source.text(language);
        for line in lines {
            assert!(text.contains(line), "{line} in\n{text}");
        }
    }
    let turned = Source { rows_from_bottom: true, ..source }.text(Language::Glsl);
    assert!(turned.contains("textureLod(picture, vec2(place.x, 1.0 - place.y), 0.0)"), "{turned}");
}

#[test]
fn functions_of_metal_take_what_they_read_and_what_those_read_that_they_call() {
    let text = all_readings().functions(Language::Metal);
    let parameters = "texture2d<float> picture, texture2d_array<float> layers, texturecube_array<float> cubes, \
                      sampler linear_sampler, constant float4 *vectors";
    let arguments = "picture, layers, cubes, linear_sampler, vectors";
    for line in [
        "float nothing(float x) {".to_owned(),
        "    return nothing(2.0) * picture.sample(linear_sampler, place, level(0.0)).rgb;".to_owned(),
        format!("float3 of_picture({parameters}, float2 place) {{"),
        format!("float3 all_of_them({parameters}, float3 c) {{"),
        format!("    return of_picture({arguments}, c.xy) + of_layers({arguments}, int2(c.xy), c.xy)"),
    ] {
        assert!(text.contains(&line), "{line} in\n{text}");
    }
}
