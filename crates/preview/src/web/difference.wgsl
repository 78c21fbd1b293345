// The difference of two pictures of radiance, times a factor; black where there is no surface.
@group(2) @binding(0) var first: texture_2d<f32>;
@group(2) @binding(1) var second: texture_2d<f32>;

@fragment
fn difference_fragment(at: PageVertex) -> @location(0) vec4f {
    let pixel = vec2u(at.position.xy);
    let value = textureLoad(first, pixel, 0);
    if value.a == 0.0 {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let shown = difference(value.rgb, textureLoad(second, pixel, 0).rgb) * page.amplify;
    return vec4f(develop_encode(develop(shown, page.gain, page.tone)), 1.0);
}
