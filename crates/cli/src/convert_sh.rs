//! `specula convert-sh`: lighting in spherical harmonics from the convention of one engine to another's.

use std::path::Path;

use containers::lighting_json::{self, Preset};
use containers::{GltfLighting, is_babylon_env, read_babylon_polynomial, read_gltf_lighting};
use sh::Lighting;

use engine::path_text;

use crate::arguments::ConvertShArguments;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::{self, say};

pub(crate) fn run(arguments: &ConvertShArguments) -> Result<Exit, CommandError> {
    let failed = |chain: &[String], help: Option<&str>| CommandError::usage(chain).with_help(help);
    let ConvertShArguments { input, from, to, output } = arguments;
    let known = || Preset::ALL.map(Preset::name).join(", ");
    let preset = |name: &str| {
        let error =
            || failed(&[format!("{name:?} is not a preset"), format!("expected one of {}", known())], None);
        Preset::from_name(name).ok_or_else(error)
    };
    let (from, to) = (from.as_deref().map(preset).transpose()?, preset(to)?);
    let bytes = engine::read_file(input)
        .map_err(|error| failed(&[format!("cannot read {}: {error}", path_text(input))], None))?;
    let is_gltf = is_gltf(input, &bytes);
    let found = if is_gltf { read_gltf(&bytes, from) } else { read(&bytes, from).map(|found| (found, None)) };
    let ((from, mut lighting), light) = found.map_err(|error| {
        let help = match is_gltf {
            true => {
                "from a glTF file, convert-sh reads the light of EXT_lights_image_based that the scene \
                     uses, or the first one: irradianceCoefficients (9 rows of 3 numbers), intensity and \
                     rotation"
            }
            false => {
                "convert-sh reads the JSON of export-sh, .env, glTF with EXT_lights_image_based, and \
                      text with 27 numbers such as cmgen's sh.txt; for text, --from sets the convention"
            }
        };
        failed(&[format!("{}: {error}", path_text(input))], Some(help))
    })?;
    if let Some(light) = light {
        say!("Read {light}.");
    }
    let (given, kept) = (lighting.series.degree(), to.degree(lighting.series.degree()));
    if kept < given.get() {
        say!("Degree {} becomes {kept}, the degree of preset {}.", given.get(), to.name());
    }
    for (label, preset) in [("from", from), ("to", to)] {
        let definition = preset.definition();
        say!("{label:<5} {}", preset.name());
        say!("  frame  {}", definition.frame);
        say!("  signs  {}", definition.signs);
        say!("  scale  {}", definition.scale);
    }
    if to.is_irradiance() {
        lighting.series = lighting.series.to_degree(sh::Degree::new(kept).unwrap_or(given));
    }
    let written = match output {
        Some(output) if is_text(output) => text_of(&lighting, to),
        _ => lighting_json::encode(&lighting, to, None),
    };
    let written = written.map_err(|error| failed(&[error.to_string()], None))?;
    let Some(output) = output else { return Ok(print::data(&String::from_utf8_lossy(&written))) };
    engine::replace_file(output, &written)
        .map_err(|error| CommandError::system(format!("cannot write {}", path_text(output)), &error))?;
    say!("Wrote {}.", path_text(output));
    Ok(Exit::Success)
}

fn is_text(output: &Path) -> bool {
    output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"))
}

/// The text of a lighting: rows of three numbers, as Filament reads them.
fn text_of(lighting: &Lighting, to: Preset) -> Result<Vec<u8>, containers::Error> {
    // The JSON's encoder checks that every number is finite.
    lighting_json::encode(lighting, to, None)?;
    let tables = to.convert(&lighting.series);
    let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ") + "\n";
    Ok(tables.iter().flat_map(|table| &table.rows).map(line).collect::<String>().into_bytes())
}

/// Whether a file is glTF: by its name, or because it is one whatever its name is.
fn is_gltf(file: &Path, bytes: &[u8]) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let is_document = || {
        let document = serde_json::from_slice::<serde_json::Map<String, serde_json::Value>>(bytes);
        document.is_ok_and(|document| document.contains_key("asset") || document.contains_key("extensions"))
    };
    stages::is_gltf_file(&name) || bytes.starts_with(b"glTF") || is_document()
}

/// The lighting in a file, and its convention.
type Converted = (Preset, Lighting);

/// The lighting in a glTF file, and which light of the file it is.
fn read_gltf(bytes: &[u8], from: Option<Preset>) -> Result<(Converted, Option<String>), String> {
    check_preset(Preset::Gltf, from)?;
    let GltfLighting { series, light } = read_gltf_lighting(bytes).map_err(|error| error.to_string())?;
    Ok(((Preset::Gltf, series.into()), Some(light)))
}

/// Refuses a file that is of another convention than the one that was named.
fn check_preset(found: Preset, from: Option<Preset>) -> Result<(), String> {
    match from.filter(|from| *from != found) {
        Some(from) => Err(format!("the file has the preset {}, not {}", found.name(), from.name())),
        None => Ok(()),
    }
}

/// The lighting in a file that is not glTF.
fn read(bytes: &[u8], from: Option<Preset>) -> Result<Converted, String> {
    if is_babylon_env(bytes) {
        check_preset(Preset::BabylonEnv, from)?;
        let polynomial = read_babylon_polynomial(bytes).map_err(|error| error.to_string())?;
        let polynomial = polynomial.ok_or("the file has no irradiance")?;
        let tables: Vec<_> = polynomial.rows().iter().map(|row| vec![row.to_vec()]).collect();
        let series = Preset::BabylonEnv.revert(&tables).map_err(|error| error.to_string())?;
        return Ok((Preset::BabylonEnv, series.into()));
    }
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    if first == Some(&b'{') {
        return lighting_json::decode_any(bytes, from).map_err(|error| error.to_string());
    }
    let text = str::from_utf8(bytes).map_err(|_| "expected JSON, .env, glTF or text")?;
    let numbers = numbers(text)?;
    if numbers.is_empty() || !numbers.len().is_multiple_of(3) {
        return Err(format!("expected 27 numbers, found {}", numbers.len()));
    }
    let preset = from.ok_or("plain text does not name its convention; set it with --from")?;
    let rows: Vec<Vec<f64>> = numbers.chunks_exact(3).map(<[f64]>::to_vec).collect();
    let tables = match preset {
        Preset::BabylonEnv => rows.into_iter().map(|row| vec![row]).collect(),
        Preset::Unity => return Err("Unity's rows have four numbers; use JSON for them".into()),
        _ => vec![rows],
    };
    Ok((preset, preset.revert(&tables).map_err(|error| error.to_string())?.into()))
}

/// The numbers of a text; from `//` or `#` to the end of a line is a comment.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let mut numbers = Vec::new();
    for (line, text) in text.lines().enumerate() {
        let text = text.split("//").next().unwrap_or_default().split('#').next().unwrap_or_default();
        let words = text.split(|c: char| c.is_whitespace() || "()[]{},;".contains(c));
        for word in words.filter(|word| !word.is_empty()) {
            let number = word.parse().map_err(|_| format!("line {}: {word:?} is not a number", line + 1))?;
            numbers.push(number);
        }
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_cmgen_is_read() {
        let text = "( 0.5,  0.25, -1e-3); // L00, irradiance, pre-scaled base\n(1, 2, 3); // L1-1\n";
        assert_eq!(numbers(text).unwrap(), [0.5, 0.25, -1e-3, 1.0, 2.0, 3.0]);
        assert_eq!(numbers("1 2\n3 x").unwrap_err(), "line 2: \"x\" is not a number");
    }
}
