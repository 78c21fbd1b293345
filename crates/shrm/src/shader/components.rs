//! The look-up of a map of components.

use brdf::Centre;
use shading_language::{Language, Resource, ResourceKind, Source};

use super::glsl::PRECISION;

/// What a shader has to know of a map of components ([`crate::components`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentShader {
    /// What the directions of the texels are.
    pub centre: Centre,
    /// The number of components.
    pub count: usize,
    /// The texels along the edge of a face, without its border.
    pub edge: usize,
}

impl ComponentShader {
    /// The text: a function `reflected(normal, view)`, what it calls, and the textures that it reads.
    pub fn text(&self, language: Language) -> String {
        let Self { centre, count, edge } = *self;
        let (central, other) = match centre {
            Centre::Reflection => ("reflection", "normal"),
            Centre::Normal | Centre::Tangent => ("normal", "view"),
        };
        let functions = COMPONENTS
            .replace("COUNT", &count.to_string())
            .replace("SIDE", &format!("{}.0", edge + 2))
            .replace("CENTRAL", central)
            .replace("OTHER", other);
        let textures = ["map", "weights"].map(|name| Resource { name, kind: ResourceKind::Layers });
        let sampler = ResourceKind::Sampler("linear, clamped at edges");
        let resources = textures.into_iter().chain([Resource { name: "filtering", kind: sampler }]).collect();
        let source = Source { functions, resources, rows_from_bottom: false };
        let precision = match language {
            Language::Glsl => PRECISION,
            Language::Hlsl | Language::Metal | Language::Wgsl => "",
        };
        format!(
            "// {count} components on a cube of {edge}: reflected(normal, view) is the radiance toward the view.\n\
             // Both directions point to the outside, have length 1 and are right-handed with +Z up.\n\
             // `map` is a 2D array with layer 6 * k + face, and a border of a texel about each face.\n\
             // `weights` is a 2D array of four components a layer: the texture `-weights` of export-shrm.\n\
             {precision}{}",
            source.text(language)
        )
    }
}

const COMPONENTS: &str = "\
fn cube_coordinates(d: vec3f) -> vec3f {
    return vec3f(-d.y, d.z, d.x);
}

fn reflected(normal: vec3f, view: vec3f) -> vec3f {
    let reflection: vec3f = 2.0 * dot(normal, view) * normal - view;
    let c: vec3f = cube_coordinates(CENTRAL);
    let d: vec3f = cube_coordinates(OTHER);
    let m: vec3f = abs(c);
    // The face, its centre, and where its columns and rows go.
    var face: i32 = 4;
    var a: vec3f = vec3f(0.0, 0.0, sign(c.z));
    var s: vec3f = vec3f(a.z, 0.0, 0.0);
    var t: vec3f = vec3f(0.0, -1.0, 0.0);
    if (m.y >= m.z) {
        face = 2;
        a = vec3f(0.0, sign(c.y), 0.0);
        s = vec3f(1.0, 0.0, 0.0);
        t = vec3f(0.0, 0.0, a.y);
    }
    if (m.x >= m.y && m.x >= m.z) {
        face = 0;
        a = vec3f(sign(c.x), 0.0, 0.0);
        s = vec3f(0.0, 0.0, -a.x);
        t = vec3f(0.0, -1.0, 0.0);
    }
    if (a.x + a.y + a.z < 0.0) {
        face += 1;
    }
    // The axes are carried to c by the least rotation; the place of d is on a disc about c.
    let cosine: f32 = dot(c, a);
    let up: f32 = max(dot(d, c), 0.0);
    let turn: f32 = (dot(d, a) + up) / (1.0 + cosine);
    let x: f32 = (dot(d, s) - dot(c, s) * turn) * inverseSqrt(1.0 + up);
    let y: f32 = (dot(d, t) - dot(c, t) * turn) * inverseSqrt(1.0 + up);
    let place: vec2f = vec2f(0.5 * x + 0.5, 0.5 * y + 0.5);
    let column: f32 = (0.5 * dot(c, s) / cosine + 0.5) * (SIDE - 2.0) + 1.0;
    let row: f32 = (0.5 * dot(c, t) / cosine + 0.5) * (SIDE - 2.0) + 1.0;
    let at: vec2f = vec2f(column, row) / SIDE;
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var k: i32 = 0; k < COUNT; k++) {
        let four: i32 = k / 4;
        let layer: i32 = 6 * k + face;
        let w: vec4f = sample_layer(weights, place, four);
        sum += w[k % 4] * sample_layer(map, at, layer).rgb;
    }
    return max(sum, vec3f(0.0, 0.0, 0.0));
}
";
