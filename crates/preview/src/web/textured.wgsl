// The radiance by the base colour of the texture; views without one have none of this.
fn mesh_radiance(at: PageVertex, surface: Surface, radiance: vec3f) -> vec3f {
    let colour = texture_at_fragment(at.coordinates, at.position.w, 1.0);
    return base_color(0u, colour, radiance, surface);
}
