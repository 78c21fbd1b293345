//! `specula inspect FILE --shader`: a shader that looks up a reflection map in spherical harmonics or in
//! components, made for the degree, terms, view, layout and size that its file states.

use std::collections::BTreeMap;
use std::path::Path;

use brdf::Centre;
use containers::{Error, is_texture, read_exr_layers, read_texture, tensors};
use sh::Degree;
use shrm::shader::{ComponentShader, Language, MapShader};
use shrm::{MapLayout, Terms, View};

use engine::path_text;

use crate::arguments::ShaderName;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print;

/// Prints the shader of a map's file.
pub(crate) fn print_shader(file: &Path, language: ShaderName) -> Result<Exit, CommandError> {
    let place = path_text(file);
    let bytes = engine::read_file(file)
        .map_err(|error| CommandError::usage([format!("cannot read {place}: {error}")]))?;
    let Some(shader) = of_file(&bytes) else {
        let message =
            format!("{place} is not a reflection map in spherical harmonics, but --shader needs one");
        let help = "name a file of export-shrm: KTX2, OpenEXR or safetensors; of components, KTX2";
        return Err(CommandError::usage([message]).with_help(Some(help)));
    };
    let shader = shader.map_err(|error| CommandError::usage([format!("{place}: {error}")]))?;
    let language = match language {
        ShaderName::Glsl => Language::Glsl,
        ShaderName::Wgsl => Language::Wgsl,
        ShaderName::Hlsl => Language::Hlsl,
        ShaderName::Metal => Language::Metal,
    };
    Ok(print::data(&shader.text(language)))
}

/// A map that a shader looks up.
#[derive(Debug, PartialEq)]
enum LookUp {
    Harmonics(MapShader),
    Components(ComponentShader),
}

impl LookUp {
    fn text(&self, language: Language) -> String {
        match self {
            Self::Harmonics(shader) => shader.text(language),
            Self::Components(shader) => shader.text(language),
        }
    }
}

/// What a shader has to know of the map in a file; `None` if the file has no such map.
fn of_file(bytes: &[u8]) -> Option<Result<LookUp, Error>> {
    if is_texture(bytes) {
        let file = read_texture(bytes).ok()?;
        return of_texts(&file.metadata, file.texture.width).map(Ok);
    }
    if super::looks_like_safetensors(bytes) {
        let texts = tensors::describe(bytes).ok()?.metadata;
        let is_map = texts.get("kind").is_some_and(|kind| kind == "shrm");
        let decoded = || tensors::decode_shrm(bytes).map(|map| LookUp::Harmonics(MapShader::of(&map)));
        return is_map.then(decoded);
    }
    let file = read_exr_layers(bytes).ok()?;
    of_texts(&file.metadata, file.width).map(Ok)
}

/// What the texts of a texture or an image say of a map whose faces or rows have this width.
fn of_texts(texts: &BTreeMap<String, String>, width: usize) -> Option<LookUp> {
    let text = |key: &str| texts.get(&format!("specula.{key}")).map(String::as_str);
    let number = |key: &str| text(key)?.parse::<u16>().ok().map(usize::from);
    let centre = match text("centre")? {
        "reflection" => Centre::Reflection,
        "normal" => Centre::Normal,
        "tangent" => Centre::Tangent,
        _ => return None,
    };
    if let (Some(count), Some(edge), true) = (number("components"), number("edge"), centre != Centre::Tangent)
    {
        return Some(LookUp::Components(ComponentShader { centre, count, edge }));
    }
    let grid = match text("layout")? {
        "cube" => MapLayout::Cube.grid(width),
        "lat-long" => MapLayout::LatLong.grid(width / 2),
        _ => return None,
    };
    let view = match text("view")? {
        "local" => View::Local,
        "global" => View::Global,
        _ => return None,
    };
    let terms = match text("terms")? {
        "all" => Terms::All,
        "zonal" => Terms::Zonal,
        _ => return None,
    };
    let p = Degree::new(number("degree")?).ok()?;
    Some(LookUp::Harmonics(MapShader { grid, view, centre, p, terms }))
}

#[cfg(test)]
mod tests {
    use containers::{Precision, Texture, row_names, shrm_metadata, write_ktx2};
    use shrm::{MapGrid, Shrm};
    use sphere::{Cube, LatLong};

    use super::*;

    #[test]
    fn textures_of_components_say_what_their_shader_has_to_know() {
        let entries = [("specula.centre", "reflection"), ("specula.components", "9"), ("specula.edge", "2")];
        let texture = Texture {
            width: 4,
            height: 4,
            layers: 54,
            pixels: vec![[0.5; 3]; 16 * 54],
            ..Texture::default()
        };
        let ktx2 = write_ktx2(&texture, Precision::Half, None, &entries).unwrap().bytes;
        let found = of_file(&ktx2).unwrap().unwrap();
        let expected = ComponentShader { centre: Centre::Reflection, count: 9, edge: 2 };
        assert_eq!(found, LookUp::Components(expected));
        assert!(found.text(Language::Hlsl).contains("for (int k = 0; k < 9; k++) {"));
    }

    /// A texture and safetensors say the same of a map as the map itself.
    #[test]
    fn files_say_what_their_shader_has_to_know() {
        for (grid, view, terms, p) in [
            (MapGrid::Cube(Cube { edge: 2 }), View::Local, Terms::All, 3),
            (MapGrid::Cube(Cube { edge: 3 }), View::Local, Terms::Zonal, 4),
            (MapGrid::LatLong(LatLong { width: 4, height: 2 }), View::Global, Terms::All, 1),
        ] {
            let p = Degree::new(p).unwrap();
            let rows = if terms == Terms::All { p.rows() } else { p.get() + 1 };
            let values = vec![[0.5; 3]; grid.len() * rows];
            let map = Shrm::new(grid, view, Centre::Normal, p, terms, values).unwrap();
            let [faces, height, width] = grid.shape();
            let pixels = vec![[0.5; 3]; grid.len() * rows];
            let texture = Texture { width, height, layers: rows, faces, pixels, ..Texture::default() };
            let entries = shrm_metadata(&map).map(|(key, value)| (format!("specula.{key}"), value));
            let entries: Vec<(&str, &str)> =
                entries.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
            let ktx2 = write_ktx2(&texture, Precision::Half, None, &entries).unwrap().bytes;
            let safetensors = tensors::encode_shrm(&map, &[], None).unwrap();
            for bytes in [ktx2, safetensors] {
                let found = of_file(&bytes).unwrap().unwrap();
                assert_eq!(found, LookUp::Harmonics(MapShader::of(&map)));
                let last = row_names(p.get(), terms).len() - 1;
                let layer = if (view, faces) == (View::Local, 6) { 6 * last } else { last };
                let text = found.text(Language::Wgsl);
                assert!(text.contains(&format!("{layer})")), "{text}");
            }
        }
        assert!(of_file(b"model = \"lambert\"\n").is_none());
        assert!(
            of_file(
                &write_ktx2(
                    &Texture { width: 1, height: 1, pixels: vec![[0.0; 3]], ..Texture::default() },
                    Precision::Half,
                    None,
                    &[]
                )
                .unwrap()
                .bytes
            )
            .is_none()
        );
    }
}
