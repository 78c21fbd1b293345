//! The tables and lists of engines in manuals. A manual has a place for each, a name in braces.

use super::definition::{Engine, EngineCube, EngineLight, IRRADIANCE};
use super::engine_format::EngineFormat;

/// Fills the tables and lists of these engines into a manual.
pub(crate) fn fill_in(manual: &str, engines: &[&Engine]) -> String {
    let cubes: Vec<_> =
        engines.iter().filter(|engine| engine.loads_cube()).map(|engine| word(engine)).collect();
    manual
        .replace("{rows: files of engines}", &files(engines))
        .replace("{rows: directions of engines}", &directions(engines))
        .replace("{rows: levels of engines}", &levels(engines))
        .replace("{list: engines that load a cube}", &cubes.join(", "))
}

/// An engine's word, as manuals print it.
fn word(engine: &Engine) -> String {
    format!("`{}`", engine.name)
}

/// The engines whose cells are equal, in the order of the first of each.
fn grouped<T: PartialEq>(rows: impl IntoIterator<Item = (String, T)>) -> Vec<(String, T)> {
    let mut groups = Vec::<(String, T)>::new();
    for (name, cells) in rows {
        match groups.iter_mut().find(|(_, others)| *others == cells) {
            Some((names, _)) => *names += &format!(", {name}"),
            None => groups.push((name, cells)),
        }
    }
    groups
}

/// The text of a cell that need not repeat what stands above it.
#[derive(PartialEq)]
struct Cell {
    text: String,
    /// What stands in place of the text if the cell above has the same.
    same: &'static str,
    /// What follows in either case.
    remark: String,
}

impl Cell {
    fn under(&self, above: Option<&Self>) -> String {
        let is_same = above.is_some_and(|above| above.text == self.text);
        format!("{}{}", if is_same { self.same } else { &self.text }, self.remark)
    }
}

/// The rows of engine, files, levels and formats.
fn files(engines: &[&Engine]) -> String {
    let rows = grouped(engines.iter().map(|engine| {
        let versions = match engine.versions {
            "" => String::new(),
            versions => format!(" ({versions})"),
        };
        let formats = engine.formats().into_iter().map(|format| format!("`{}`", format.name()));
        (
            word(engine) + &versions,
            (files_cell(engine), levels_cell(engine), formats.collect::<Vec<_>>().join(", ")),
        )
    }));
    let line = |row: usize| {
        let (names, (files, levels, formats)) = &rows[row];
        let above = row.checked_sub(1).map(|above| &rows[above].1);
        let (files, levels) =
            (files.under(above.map(|above| &above.0)), levels.under(above.map(|above| &above.1)));
        format!("| {names} | {files} | {levels} | {formats} |")
    };
    (0..rows.len()).map(line).collect::<Vec<_>>().join("\n")
}

fn files_cell(engine: &Engine) -> Cell {
    let (text, remark) = match &engine.light {
        EngineLight::Cube(cube) => (cube.endings.to_owned(), String::new()),
        EngineLight::LatLong(image) => {
            let endings = image.formats.iter().copied().filter_map(EngineFormat::image_ending);
            let endings: Vec<_> = endings.map(|ending| format!("`{ending}`")).collect();
            let irradiance = image.irradiance.map(|_| format!(", and `{IRRADIANCE}`"));
            (endings.join(" or ") + ", lat-long", irradiance.unwrap_or_default())
        }
    };
    Cell { text, same: "the same", remark }
}

fn levels_cell(engine: &Engine) -> Cell {
    const FILTERS: &str = "the engine filters";
    match &engine.light {
        EngineLight::Cube(cube) => {
            let texels = if cube.last == 1 { "texel" } else { "texels" };
            let remark = format!(", to {} {texels}{}", cube.last, cube.levels_remark);
            Cell { text: cube.levels.formula.replace("{size}", "size"), same: "the same r", remark }
        }
        EngineLight::LatLong(_) => Cell { text: FILTERS.into(), same: FILTERS, remark: String::new() },
    }
}

/// The engines that load a cube, with what they load.
fn cubes<'a>(engines: &'a [&Engine]) -> impl Iterator<Item = (String, &'a EngineCube)> {
    engines.iter().filter_map(|engine| Some((word(engine), engine.cube()?)))
}

/// The rows of engine and direction.
fn directions(engines: &[&Engine]) -> String {
    let rows = grouped(cubes(engines).map(|(name, cube)| (name, cube.direction)));
    rows.into_iter()
        .map(|(names, direction)| format!("| {names} | {direction} |"))
        .collect::<Vec<_>>()
        .join("\n")
}

/// The rows of engine, levels and the last level.
fn levels(engines: &[&Engine]) -> String {
    let formula =
        |cube: &EngineCube| cube.levels.formula.replace("{size}", "`resolution`") + cube.levels.remark;
    let rows = grouped(cubes(engines).map(|(name, cube)| (name, formula(cube))));
    let line = |(row, (names, levels)): (usize, (String, String))| {
        let same = cubes(engines).filter(|(_, cube)| formula(cube) == levels);
        let last: Vec<_> = same.map(|(_, cube)| cube.last.to_string()).collect();
        let unit = if row == 0 { " texels" } else { "" };
        format!("| {names} | {levels} | {}{unit} |", last.join(", "))
    };
    rows.into_iter().enumerate().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engines::ENGINES;

    /// The tables of the first nine engines, which a new engine does not change.
    #[test]
    fn equal_rows_are_one_and_nothing_is_said_twice() {
        let table = |place: &str| fill_in(place, &ENGINES[..9]);
        let files = "\
| `three` (r187 or later) | `.ktx2`, or `.dds` for BC6H; `-irradiance.json` | r = 1 - sqrt(1 - l / n), to 8 texels | `rgba16f`, `bc6h` |
| `filament` | `.ktx`, with the irradiance under the key `sh`; `-sh.txt` | the same r, to 16 texels | `r11g11b10f`, `rgba16f` |
| `babylon` | `.env`, with the irradiance; or `.dds` and `-irradiance.json` | r^2 = 2^(l / 0.8) / size, to 1 texel | `rgbd`, `rgba16f`, `rgba32f` |
| `bevy` | `-specular.ktx2`, `-diffuse.ktx2` | r = l / n, to 16 texels; one level of irradiance over pi | `rgb9e5`, `rgba16f`, `bc6h` |
| `gltf` | `.gltf` with EXT_lights_image_based | r^2 = size^(l / n - 1), to 16 texels | `rgbd` |
| `godot`, `blender` | `.exr` or `.hdr`, lat-long | the engine filters | `exr`, `hdr` |
| `unity` | the same, and `-irradiance.json` | the engine filters | `exr`, `hdr` |
| `unreal` | `.hdr`, lat-long, and `-irradiance.json` | the engine filters | `hdr` |";
        assert_eq!(table("{rows: files of engines}"), files);
        let directions = "\
| `three` | (-c.z, c.y, -c.x) |
| `filament` | (c.x, c.y, c.z): mirrored in relation to KTX2, as the engine wants it |
| `babylon`, `gltf` | (-c.x, c.y, c.z) |
| `bevy` | (c.z, c.y, c.x) |";
        assert_eq!(table("{rows: directions of engines}"), directions);
        let levels = "\
| `three`, `filament` | r = 1 - sqrt(1 - l / n) | 8, 16 texels |
| `babylon` | r^2 = 2^(l / 0.8) / `resolution`, at most 1; a mirror first | 1 |
| `bevy` | r = l / n | 16 |
| `gltf` | r^2 = `resolution`^(l / n - 1); a mirror first | 16 |";
        assert_eq!(table("{rows: levels of engines}"), levels);
        let cubes = "`three`, `filament`, `babylon`, `bevy`, `gltf`";
        assert_eq!(table("{list: engines that load a cube}"), cubes);
    }

    /// The manuals of these kinds have places for all of it, and no other manual has one.
    #[test]
    fn every_place_in_a_manual_is_filled_in() {
        for kind in crate::kinds().iter() {
            let manual = kind.manual();
            assert!(!manual.contains("{rows: ") && !manual.contains("{list: "), "{}", kind.name());
        }
        for (kind, place) in [
            ("export-engine", "{rows: files of engines}"),
            ("export-engine", "{rows: directions of engines}"),
            ("prefilter", "{rows: levels of engines}"),
            ("import-environment", "{list: engines that load a cube}"),
        ] {
            let manual = crate::kinds().get(kind).map(|kind| kind.manual()).unwrap();
            assert!(manual.contains(&fill_in(place, ENGINES)), "{kind}: {place}");
        }
    }
}
