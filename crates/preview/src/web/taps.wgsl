// The place of the look-up of a compact map, which `web::with_look_up` fills in.
fn taps_radiance(surface: Surface) -> vec3f {
    return surface.normal + surface.tangent + surface.view;
}
