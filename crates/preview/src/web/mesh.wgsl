@fragment
fn mesh_fragment(@builtin(front_facing) front: bool, at: PageVertex) -> @location(0) vec4f {
    let surface = surface_new(at.normal, at.tangent, at.ray, front);
    return page_shown(mesh_radiance(at, surface, shade_mode(surface)));
}
