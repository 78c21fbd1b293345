@fragment
fn sky_fragment(at: PageVertex) -> @location(0) vec4f {
    return page_shown(background(BACKGROUND_LAT_LONG, vec3f(0.0), at.ray));
}
