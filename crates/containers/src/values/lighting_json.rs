//! Lighting as JSON, for people and engines: one file per preset of [`Preset`].
//!
//! ```json
//! {
//!   "preset": "three",
//!   "frame": "right-handed, +Y up: x = x, y = z, z = -y of Specula's frame",
//!   "yaw": "...", "signs": "...", "scale": "...", "source": "...",
//!   "degree": 2,
//!   "coefficients": [[r, g, b], ...],
//!   "lights": [[x, y, z, angular radius, r, g, b], ...],
//!   "specula": { the recipe }
//! }
//! ```
//!
//! `lights` is there if lights are beside the series: directions in the preset's frame, angular radii in
//! radians, and the irradiance of a surface that faces them. Numbers are the shortest that read back as the
//! same f64. Presets differ in the members that hold them.

mod frame;
mod preset;

use serde::Deserialize;
use serde_json::{json, value::RawValue};
use sh::{Degree, Expansion, Lighting};

use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::recipe;
use crate::recipe::KEY;

pub use preset::{Preset, Table};

/// Lighting in the convention of an engine, as JSON.
///
/// Every preset but `specula` has a fixed degree: higher ones are cut off, missing ones are zero.
///
/// # Errors
/// If a number is not finite, or the recipe is not JSON on one line.
pub fn encode(lighting: &Lighting, preset: Preset, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let unwritable = |message: &str| Error::new(ErrorKind::Unwritable, message).within("JSON");
    recipe::check(recipe).map_err(|error| error.within("JSON"))?;
    if recipe.is_some_and(|recipe| serde_json::from_str::<&RawValue>(recipe).is_err()) {
        return Err(unwritable("the recipe is not JSON"));
    }
    let Lighting { series, lights } = lighting;
    if !series.coefficients().as_flattened().iter().all(|value| value.is_finite()) {
        return Err(unwritable("a coefficient is not finite"));
    }
    if !lights.iter().all(|light| light.irradiance.iter().all(|value| value.is_finite())) {
        return Err(unwritable("a light's irradiance is not finite"));
    }
    let mut members = vec![("preset", json!(preset.name()).to_string())];
    members.extend(preset.definition().members().map(|(name, text)| (name, json!(text).to_string())));
    members.push(("degree", preset.degree(series.degree()).to_string()));
    members.extend(preset.convert(series).iter().map(|table| (table.name, layout(table))));
    if !lights.is_empty() {
        members.push(("lights", layout(&preset.lights(lights))));
    }
    members.extend(recipe.map(|recipe| (KEY, recipe.to_owned())));
    let members: Vec<String> = members.iter().map(|(name, value)| format!("  \"{name}\": {value}")).collect();
    Ok(format!("{{\n{}\n}}\n", members.join(",\n")).into_bytes())
}

/// Lighting from JSON of the preset `specula`, the only one of any degree and without loss.
///
/// # Errors
/// If the bytes are not JSON, are of another preset, or the rows are not (degree + 1)^2 times three finite
/// numbers.
pub fn decode(bytes: &[u8]) -> Result<Expansion, Error> {
    #[derive(Deserialize)]
    struct File {
        preset: String,
        degree: usize,
        coefficients: Vec<[f64; 3]>,
    }
    refuse_non_files(bytes)?;
    let file: File = serde_json::from_slice(bytes).map_err(|error| match error.is_eof() {
        true => Error::truncated(format!("the JSON ends too early: {error}")),
        false => Error::damaged(format!("not the JSON of lighting: {error}")),
    })?;
    if file.preset != Preset::Specula.name() {
        return Err(Error::damaged(format!("`preset`: expected `specula`, found `{}`", file.preset)));
    }
    let degree =
        Degree::new(file.degree).map_err(|error| Error::new(ErrorKind::TooLarge, error.to_string()))?;
    let rows = file.coefficients.len();
    if !file.coefficients.as_flattened().iter().all(|value| value.is_finite()) {
        return Err(Error::damaged("`coefficients`: expected finite numbers"));
    }
    Expansion::from_coefficients(degree, file.coefficients).ok_or_else(|| {
        Error::damaged(format!(
            "`coefficients`: expected {} rows for degree {}, found {rows}",
            degree.rows(),
            file.degree
        ))
    })
}

/// Lighting from the JSON of any preset, and that preset. `from` is what the file is if it does not say so
/// itself.
///
/// # Errors
/// If the bytes are not JSON, name no preset or another one, lack a table, or hold what the preset cannot
/// ([`Preset::revert`]).
pub fn decode_any(bytes: &[u8], from: Option<Preset>) -> Result<(Preset, Lighting), Error> {
    refuse_non_files(bytes)?;
    let file: serde_json::Value = serde_json::from_slice(bytes).map_err(|error| match error.is_eof() {
        true => Error::truncated(format!("the JSON ends too early: {error}")),
        false => Error::damaged(format!("not JSON: {error}")),
    })?;
    let named = file["preset"].as_str();
    let preset = match (named, from) {
        (Some(name), _) => Some(
            Preset::from_name(name)
                .ok_or_else(|| Error::unsupported(format!("`preset`: {name:?} is not known")))?,
        ),
        (None, from) => from,
    };
    let preset = preset.ok_or_else(|| Error::damaged("expected a member `preset`, found none"))?;
    if let Some(from) = from.filter(|from| *from != preset) {
        let (found, expected) = (preset.name(), from.name());
        return Err(Error::damaged(format!("`preset`: expected `{expected}`, found `{found}`")));
    }
    let numbers = |value: &serde_json::Value| -> Option<Vec<f64>> {
        value.as_array()?.iter().map(serde_json::Value::as_f64).collect()
    };
    let table = |(name, _): (&'static str, usize)| -> Result<Vec<Vec<f64>>, Error> {
        let rows =
            file[name].as_array().ok_or_else(|| Error::damaged(format!("expected a member `{name}`")))?;
        let single = || numbers(&file[name]).map(|row| vec![row]);
        let rows = rows.iter().map(numbers).collect::<Option<Vec<_>>>().or_else(single);
        rows.ok_or_else(|| Error::damaged(format!("`{name}`: expected rows of numbers")))
    };
    let tables = preset.tables(Degree::ZERO).into_iter().map(table).collect::<Result<Vec<_>, _>>()?;
    let series = preset.revert(&tables)?;
    let row = |value: &serde_json::Value| {
        let row = numbers(value).and_then(|row| <[f64; 7]>::try_from(row).ok());
        let light = row.and_then(|row| Preset::light(row, preset));
        light.ok_or_else(|| Error::damaged("`lights`: expected rows of seven finite numbers"))
    };
    let lights = file["lights"].as_array().map_or(Ok(Vec::new()), |rows| rows.iter().map(row).collect())?;
    Ok((preset, Lighting { series, lights }))
}

pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    #[derive(Deserialize)]
    struct FileWithRecipe<'a> {
        #[serde(borrow)]
        specula: &'a RawValue,
    }
    let recipe = serde_json::from_slice::<FileWithRecipe<'_>>(bytes).ok()?.specula.get();
    // A file that is laid out for people has it on several lines; a recipe is one.
    match recipe.contains('\n') {
        true => serde_json::from_str::<serde_json::Value>(recipe).ok().map(|recipe| recipe.to_string()),
        false => Some(recipe.to_owned()),
    }
}

/// A table as JSON: a row on each line, or the one row alone.
fn layout(table: &Table) -> String {
    let row = |row: &Vec<f64>| {
        let numbers: Vec<String> = row.iter().map(|value| json!(value).to_string()).collect();
        format!("[{}]", numbers.join(", "))
    };
    match table.rows.as_slice() {
        [only] if table.single => row(only),
        rows => {
            let rows: Vec<String> = rows.iter().map(|values| format!("    {}", row(values))).collect();
            format!("[\n{}\n  ]", rows.join(",\n"))
        }
    }
}
