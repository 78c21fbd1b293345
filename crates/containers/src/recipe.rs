//! The recipe: the canonical JSON, on one line, that says how a file was made.
//!
//! | format | where the recipe is |
//! | --- | --- |
//! | OpenEXR | a `string` attribute `specula` |
//! | Radiance | comment lines `#SPECULA=`, each with a part of it |
//! | PNG | an uncompressed iTXt chunk `specula` |
//! | safetensors | the entry `specula` of `__metadata__` |
//! | JSON | the member `specula` of the top object |
//! | HTML | the `meta` element `specula` |
//! | KTX2, KTX | the key/value entry `specula` |
//! | `.env` | the member `specula` of its JSON |
//! | glTF | the member `specula` of `asset.extras` |
//! | USD text | the string `specula` of `customLayerData` |
//! | DDS, CSV | no place: a JSON file beside it, [`texture_sidecar`] |

use std::collections::BTreeMap;

use serde_json::json;
use serde_json::value::RawValue;

use crate::error::{Error, ErrorKind};

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

/// The JSON file that goes beside a file whose format holds no texts: `specula`, the recipe, and
/// `metadata`.
///
/// # Errors
/// If the recipe is not JSON, or two entries have the same name.
pub fn texture_sidecar(recipe: Option<&str>, metadata: &[(&str, &str)]) -> Result<Vec<u8>, Error> {
    let unwritable = |message| Error::new(ErrorKind::Unwritable, message);
    let mut entries = BTreeMap::new();
    if let Some(recipe) = recipe {
        let value = RawValue::from_string(recipe.to_owned())
            .map_err(|error| unwritable(format!("the recipe is not JSON: {error}")))?;
        entries.insert(KEY, value.get().to_owned());
    }
    for (key, value) in metadata {
        if entries.insert(key, json!(value).to_string()).is_some() {
            return Err(unwritable(format!("two entries are named `{key}`")));
        }
    }
    let lines: Vec<String> =
        entries.iter().map(|(key, value)| format!("  {}: {value}", json!(key))).collect();
    Ok(format!("{{\n{}\n}}\n", lines.join(",\n")).into_bytes())
}
