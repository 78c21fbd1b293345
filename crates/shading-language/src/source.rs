//! Functions with what they read.

use super::language::Language;
use super::metal::{self, with_resources};
use super::resource::{Resource, ResourceKind};
use super::translation::{Reading, translate};

/// Functions, and what they read.
///
/// # Example
/// ```
/// use shading_language::{Language, Resource, ResourceKind, Source};
/// let source = Source {
///     functions: "fn half_of(at: vec2i) -> vec3f {\n    return 0.5 * load_layer(map, at, 0).rgb;\n}\n".into(),
///     resources: vec![Resource { name: "map", kind: ResourceKind::Layers }],
///     rows_from_bottom: false,
/// };
/// assert!(source.text(Language::Glsl).ends_with(
///     "vec3 half_of(ivec2 at) {\n    return 0.5 * texelFetch(map, ivec3(at, 0), 0).rgb;\n}\n"
/// ));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The functions and constants.
    pub functions: String,
    /// What they read, in the order of WGSL's bindings.
    pub resources: Vec<Resource>,
    /// Whether pictures are turned over, so that a place of 0 is at the bottom.
    pub rows_from_bottom: bool,
}

impl Source {
    /// A whole text: declarations and functions.
    pub fn text(&self, language: Language) -> String {
        format!("{}\n{}", self.declarations(language), self.functions(language))
    }

    /// The functions and constants.
    pub fn functions(&self, language: Language) -> String {
        let sampler =
            self.resources.iter().find(|resource| matches!(resource.kind, ResourceKind::Sampler(_)));
        let sampler = sampler.map_or("", |resource| resource.name);
        let reading = Reading { sampler, rows_from_bottom: self.rows_from_bottom };
        let text = translate(&self.functions, language, &reading);
        match language {
            Language::Metal => with_resources(&text, &self.resources),
            Language::Glsl | Language::Hlsl | Language::Wgsl => text,
        }
    }

    /// The declarations of textures and vectors; in Metal, where they are parameters, the parameters in a
    /// comment.
    pub fn declarations(&self, language: Language) -> String {
        let each = self.resources.iter();
        match language {
            Language::Glsl => each.filter_map(Resource::glsl).collect(),
            Language::Hlsl => each.map(Resource::hlsl).collect(),
            Language::Wgsl => each.zip(0..).map(|(resource, binding)| resource.wgsl(binding)).collect(),
            Language::Metal => metal::declarations(&self.resources),
        }
    }
}
