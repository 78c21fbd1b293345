//! What an engine needs to look taps up: a shader, and the code that loads its textures.
//!
//! The shaders are files of the folder `tap_shaders`, whose places `__FUNCTIONS__` (or `__CONSTANTS__` and
//! `__FUNCTIONS__`), `__LEVELS__`, `__NORMALS__`, `__TABLE__` and `__LIGHTS__` are filled in. What is between
//! `__TANGENT__` and `__END__` is there only if the material depends on its tangent: the look-up then takes
//! it between the normal and the view. `__MESH_TANGENT__` is the function for WebGL that has it from the
//! mesh.

use taps::{Language, LookUp, Source, TableShape};

/// How an engine looks taps up.
pub(crate) struct TapPreset {
    /// The language of its shaders.
    pub(crate) language: Language,
    /// The textures of the scale space that it samples.
    pub(crate) source: Source,
    /// The ending of these textures and of the table.
    pub(crate) textures: &'static str,
    /// Whether it turns pictures over when it loads them.
    pub(crate) rows_from_bottom: bool,
    /// What follows the stem in the name of the shader.
    pub(crate) ending: &'static str,
    /// What the functions are indented by in the shader.
    pub(crate) indent: &'static str,
    /// The shader, with places to fill in.
    pub(crate) shader: &'static str,
    /// The text of `README.txt`, with places to fill in; `__SHADER__` is the shader's name.
    pub(crate) readme: &'static str,
}

/// The names, without folders, of the files that a shader and its loader read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TapFileNames<'a> {
    /// The levels of the scale space.
    pub(crate) levels: &'a str,
    /// The light about normals.
    pub(crate) normals: &'a str,
    /// The table of the material.
    pub(crate) table: &'a str,
    /// The lights beside the levels, in JSON: `{"lights": [{"direction": [x, y, z], "radius": r,
    /// "irradiance": [r, g, b]}]}` in Specula's frame.
    pub(crate) lights: &'a str,
}

/// The texts beside the textures, with a look-up in them: what follows the stem in the name of each, and its
/// content. The last is `-README.txt`.
pub(crate) fn tap_texts(
    preset: &TapPreset,
    stem: &str,
    names: TapFileNames<'_>,
    look_up: &LookUp,
) -> Vec<(&'static str, String)> {
    let functions = look_up.functions();
    let (constants, functions) = if preset.shader.contains("__CONSTANTS__") {
        functions.split_once("\n\n").unwrap_or(("", &functions))
    } else {
        ("", functions.as_str())
    };
    let indent = preset.indent;
    let indented = |text: &str| {
        let line = |line: &str| if line.is_empty() { "\n".into() } else { format!("{indent}{line}\n") };
        text.lines().map(line).collect::<String>()
    };
    let shader_name = format!("{stem}{}", preset.ending);
    let has_tangent = matches!(look_up.table, TableShape::Facets { .. });
    let fill = |text: &str| {
        let text = if_tangent(text, has_tangent);
        text.replace("__CONSTANTS__", &format!("{constants}\n"))
            .replace("__FUNCTIONS__", &indented(functions))
            .replace("__MESH_TANGENT__", include_str!("tap_shaders/tangent.glsl"))
            .replace("__LEVELS__", names.levels)
            .replace("__NORMALS__", names.normals)
            .replace("__TABLE__", names.table)
            .replace("__LIGHTS__", names.lights)
            .replace("__SHADER__", &shader_name)
    };
    vec![(preset.ending, fill(preset.shader)), ("-README.txt", fill(preset.readme))]
}

/// A text with or without what is between `__TANGENT__` and `__END__`.
fn if_tangent(text: &str, has_tangent: bool) -> String {
    let mut parts = text.split("__TANGENT__");
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (inside, after) = part.split_once("__END__").unwrap_or((part, ""));
        kept += if has_tangent { inside } else { "" };
        kept += after;
    }
    kept
}
