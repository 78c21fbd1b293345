//! The picture of a material's base colour, beside the material: `base_color` [height, width, 3] u8, sRGB
//! codes from the top, and `base_color` in the metadata, how a mesh shows it:
//!
//! `{"factor": [1, 1, 1], "transform": [[1, 0, 0], [0, 1, 0]], "wrap": ["repeat", "mirror"], "filter":
//! "linear"}`, as [`brdf::TexturePlacement`] has it.

use brdf::{BaseColorTexture, TexturePlacement, Wrap};
use safetensors::tensor::Dtype;
use serde_json::{Value as Json, json};

use super::file::{TensorFile, Writer, wrong_shape};
use crate::error::Error;

/// The name of the tensor, and of the entry of the metadata.
const KEY: &str = "base_color";
const SHAPE: &str = "[height, width, 3]";
const WRAPS: [(&str, Wrap); 3] = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];
const FILTERS: [(&str, bool); 2] = [("linear", false), ("nearest", true)];

/// Adds a texture, the last tensor of a file.
pub(super) fn add(texture: &BaseColorTexture, file: &mut Writer) {
    let TexturePlacement { factor, transform, wrap, is_nearest } = texture.placement();
    let word = |wrap: Wrap| WRAPS.iter().find(|(_, known)| *known == wrap).map(|(word, _)| *word);
    let filter = FILTERS.iter().find(|(_, known)| known == is_nearest).map(|(word, _)| *word);
    let placement =
        json!({ "factor": factor, "transform": transform, "wrap": wrap.map(word), "filter": filter });
    file.entry(KEY, placement.to_string());
    let [width, height] = texture.size();
    file.data.extend_from_slice(texture.texels().as_flattened());
    file.tensor(KEY, "U8", &[height, width, 3]);
}

/// The texture of a file, if it has one.
pub(super) fn of(file: &TensorFile<'_>) -> Result<Option<BaseColorTexture>, Error> {
    let Some(text) = file.metadata.get(KEY) else { return Ok(None) };
    let wrong =
        || Error::damaged(format!("metadata `{KEY}`: expected the placement of a texture, found {text}"));
    let placement = placement(text).ok_or_else(wrong)?;
    let tensor = file.tensor(KEY, Dtype::U8, SHAPE)?;
    let &[height, width, 3] = tensor.shape() else { return Err(wrong_shape(KEY, SHAPE, tensor.shape())) };
    let (texels, _) = tensor.data().as_chunks::<3>();
    BaseColorTexture::new([width, height], texels.to_vec(), placement).map(Some).ok_or_else(|| {
        Error::damaged(format!("tensor `{KEY}`: expected a texture, found {width} x {height} with {text}"))
    })
}

fn placement(text: &str) -> Option<TexturePlacement> {
    let tree: Json = serde_json::from_str(text).ok()?;
    let object = tree.as_object().filter(|object| object.len() == 4)?;
    let wrap = |word: &str| WRAPS.iter().find(|(known, _)| *known == word).map(|(_, wrap)| *wrap);
    let words: [&str; 2] = array(object.get("wrap")?, Json::as_str)?;
    let filter = object.get("filter")?.as_str()?;
    Some(TexturePlacement {
        factor: array(object.get("factor")?, Json::as_f64)?,
        transform: array(object.get("transform")?, |row| array(row, Json::as_f64))?,
        wrap: [wrap(words[0])?, wrap(words[1])?],
        is_nearest: FILTERS.iter().find(|(known, _)| *known == filter)?.1,
    })
}

fn array<'a, T, const N: usize>(json: &'a Json, read: impl Fn(&'a Json) -> Option<T>) -> Option<[T; N]> {
    json.as_array()?.iter().map(read).collect::<Option<Vec<T>>>()?.try_into().ok()
}
