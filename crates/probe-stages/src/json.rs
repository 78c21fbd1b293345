//! JSON files that say how they were made.

use engine::Failure;
use serde::Serialize;
use serde_json::value::RawValue;

/// The members of a file, and after them its recipe, as `specula inspect` finds it.
#[derive(Serialize)]
struct Document<'a, T> {
    #[serde(flatten)]
    members: &'a T,
    specula: &'a RawValue,
}

/// A JSON file with the members of a value and the recipe.
///
/// # Errors
/// If the recipe is not JSON, which never happens, or the value has none.
pub(crate) fn document<T: Serialize>(members: &T, recipe: &str) -> Result<Vec<u8>, Failure> {
    let specula: &RawValue = serde_json::from_str(recipe)?;
    let mut text = serde_json::to_string_pretty(&Document { members, specula })?;
    text.push('\n');
    Ok(text.into_bytes())
}
