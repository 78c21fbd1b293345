// Draws a mesh, or the sky behind it, into the picture of a page in a browser: what a mode shows, developed.
// The files of shading/ stand before it, and `shade_mode`, or `sky_mode` of the sky.

struct PageUniforms {
    // From the world to clip coordinates.
    clip: mat4x4f,
    // From the world to the light's frame.
    to_light: mat3x3f,
    // The viewer's place, in the world.
    eye: vec3f,
    gain: f32,
    // The rays through a picture, in the world: forward + x right + y up, for x and y from -1 to 1.
    ray_right: vec3f,
    tone: u32,
    ray_up: vec3f,
    // 1 if radiance is drawn, and not what a display shows.
    raw: u32,
    ray_forward: vec3f,
    amplify: f32,
}

@group(0) @binding(0) var<uniform> page: PageUniforms;

struct PageVertex {
    // The same for all shaders of fragments, so that depth that was drawn before hides nothing seen.
    @invariant @builtin(position) position: vec4f,
    // In the light's frame, of any length.
    @location(0) normal: vec3f,
    @location(1) tangent: vec3f,
    @location(2) ray: vec3f,
    // In the texture of the base colour; (0, 0) of meshes without one.
    @location(3) coordinates: vec2f,
}

@vertex
fn mesh_vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec3f,
    @location(3) coordinates: vec2f,
) -> PageVertex {
    return PageVertex(
        page.clip * vec4f(position, 1.0),
        page.to_light * normal,
        page.to_light * tangent,
        page.to_light * (position - page.eye),
        coordinates,
    );
}

// One triangle that covers the picture.
@vertex
fn sky_vertex(@builtin(vertex_index) corner: u32) -> PageVertex {
    let x = select(-1.0, 3.0, corner == 1u);
    let y = select(-1.0, 3.0, corner == 2u);
    let ray = page.ray_forward + page.ray_right * x + page.ray_up * y;
    return PageVertex(vec4f(x, y, 1.0, 1.0), vec3f(0.0), vec3f(0.0), page.to_light * ray, vec2f(0.0));
}

fn page_shown(radiance: vec3f) -> vec4f {
    if page.raw == 1u {
        return vec4f(radiance, 1.0);
    }
    return vec4f(develop_encode(develop(radiance, page.gain, page.tone)), 1.0);
}
