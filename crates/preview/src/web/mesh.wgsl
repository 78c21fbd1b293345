@fragment
fn mesh_fragment(@builtin(front_facing) front: bool, at: PageVertex) -> @location(0) vec4f {
    return page_shown(shade_mode(surface_new(at.normal, at.tangent, at.ray, front)));
}
