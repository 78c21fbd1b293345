//! The recipe: the canonical JSON, on one line, that says how a file was made.
//!
//! | format | where it stands |
//! | --- | --- |
//! | OpenEXR | a `string` attribute `specula` |
//! | Radiance | a header line `SPECULA=` |
//! | PNG | an uncompressed iTXt chunk `specula` |
//! | safetensors | the entry `specula` of `__metadata__` |
//! | JSON | the member `specula` of the top object |

use crate::error::{Error, ErrorKind};
use crate::{Format, lighting_json, open_exr, png, radiance, tensors};

/// The name that the recipe goes by in every format.
pub(crate) const KEY: &str = "specula";

/// Refuses what would break a line or a text chunk.
pub(crate) fn check(recipe: Option<&str>) -> Result<(), Error> {
    if recipe.is_some_and(|recipe| recipe.chars().any(char::is_control)) {
        return Err(Error::new(
            ErrorKind::Unwritable,
            "a recipe must be one line without control characters",
        ));
    }
    Ok(())
}

/// The recipe in a file of any format that is written here; `None` where there is none.
pub fn read_recipe(bytes: &[u8]) -> Option<String> {
    match Format::sniff(bytes) {
        Some(Format::OpenExr) => open_exr::read_recipe(bytes),
        Some(Format::Radiance) => radiance::read_recipe(bytes),
        Some(Format::Png) => png::read_recipe(bytes),
        Some(Format::Jpeg) => None,
        None if bytes.first() == Some(&b'{') => lighting_json::read_recipe(bytes),
        None => tensors::read_recipe(bytes),
    }
}
