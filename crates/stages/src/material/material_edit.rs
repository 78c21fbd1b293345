//! Edits of material files: the parameters of a file as a form, and the file's text with other values.
//!
//! Comments, order and the form of all other values stay as they are.

use std::path::Path;

use brdf::{Absent, MODELS, Parameter, Value, ValueType, Values};
use engine::{Document, Table, Value as Toml, ValueKind};
use preview::{FormSection, MaterialForm};

use super::material_file::{GLTF, LAYERS, MATERIALX, MEASURED, is_gltf_file, is_measured_file};
use super::materialx_file::is_materialx_file;
use super::presets::{self, Preset};
use crate::values::{TomlText, is_integer, table_of, toml_text};

/// The one parameter of a measured table.
const SCALE: Parameter = Parameter {
    name: "scale",
    meaning: "the factor for the table",
    value_type: ValueType::Colour(brdf::WEIGHT),
    absent: Absent::Default(1.0),
};

/// The reason why the parameters of a file cannot be edited, by its name; `None` if the name says nothing
/// against it.
pub fn why_not_editable(file: &Path) -> Option<String> {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let reason = if is_gltf_file(&name) {
        "edit a material of a glTF file in the program that made it; a material file with the model standard \
         has the same parameters"
    } else if is_materialx_file(&name) {
        "edit a material of a MaterialX file in the program that made it; a material file with the model \
         standard has the same parameters"
    } else if is_measured_file(&name) {
        "a measured table has no parameters; a material file with model = \"measured\" can scale it"
    } else {
        return None;
    };
    Some(format!("{name}: {reason}"))
}

/// The parameters of a material file that can be edited.
///
/// Optional parameters that have no default and are not in the file are left out.
///
/// # Errors
/// Why there are none: one line.
pub fn material_form(name: &str, text: &str) -> Result<MaterialForm, String> {
    let document = Document::parse(name, text.as_bytes())
        .map_err(|errors| errors.to_string().lines().next().unwrap_or_default().to_owned())?;
    let mut sections = Vec::new();
    add_sections(&document.table, "", &mut Vec::new(), &mut sections)
        .ok_or_else(|| format!("{name} has errors"))?;
    if sections.iter().all(|section| section.parameters.is_empty()) {
        return Err(format!("{name} names another file and has no parameters of its own"));
    }
    Ok(MaterialForm { sections })
}

/// The text of a material file with the values of a form. Only values that differ are written.
///
/// # Errors
/// If the file has other parameters than the form.
pub fn material_with_form(name: &str, text: &str, form: &MaterialForm) -> Result<String, String> {
    let old = material_form(name, text)?;
    let changed_shape = || format!("{name} now has other parameters");
    if !old.has_same_parameters(form) {
        return Err(changed_shape());
    }
    if old == *form {
        return Ok(text.to_owned());
    }
    let (mark, body) = text.split_at(if text.starts_with('\u{feff}') { 3 } else { 0 });
    let mut edited = body.to_owned();
    for field in form.fields() {
        let (Some(parameter), Some(value)) = (form.parameter(field), form.value(field)) else { continue };
        if old.value(field) != Some(value) {
            let document = Document::parse(name, edited.as_bytes()).map_err(|_| changed_shape())?;
            let place = &form.sections[field.section].place;
            edited = with_value(&edited, &document.table, place, parameter.name, value)
                .ok_or_else(changed_shape)?;
        }
    }
    let edited = format!("{mark}{edited}");
    match material_form(name, &edited) {
        Ok(written) if written == *form => Ok(edited),
        _ => Err(format!("{name} cannot be edited in this form")),
    }
}

/// Adds the sections of a table; `None` if the table has errors.
fn add_sections(
    table: &Table,
    layer: &str,
    place: &mut Vec<(&'static str, usize)>,
    sections: &mut Vec<FormSection>,
) -> Option<()> {
    let model = match table.get("model") {
        Some(entry) => match &entry.value.kind {
            ValueKind::String(name) => name.as_str(),
            _ => return None,
        },
        None => match table.get(presets::KEY).map(|entry| &entry.value.kind) {
            Some(ValueKind::String(name)) => {
                return add_sections(&Preset::named(name).ok()?.with(table)?, layer, place, sections);
            }
            _ => LAYERS,
        },
    };
    let heading =
        |model: &str| if layer.is_empty() { model.to_owned() } else { format!("layer {layer}: {model}") };
    match model {
        LAYERS => {
            let ValueKind::Array(items) = &table.get(LAYERS)?.value.kind else { return None };
            for (index, item) in items.iter().enumerate() {
                let ValueKind::Table(table) = &item.kind else { return None };
                let number = index + 1;
                let layer = if layer.is_empty() { number.to_string() } else { format!("{layer}.{number}") };
                place.push((LAYERS, index));
                add_sections(table, &layer, place, sections)?;
                place.pop();
            }
            Some(())
        }
        GLTF | MATERIALX => Some(()),
        MEASURED => add_section(table, &[SCALE], heading(model), place, sections),
        _ => {
            let model = MODELS.iter().find(|known| known.name == model)?;
            add_section(table, model.parameters, heading(model.name), place, sections)
        }
    }
}

/// Adds the section of a table with these parameters, and those of the tables in it.
fn add_section(
    table: &Table,
    parameters: &'static [Parameter],
    heading: String,
    place: &mut Vec<(&'static str, usize)>,
    sections: &mut Vec<FormSection>,
) -> Option<()> {
    let at = sections.len();
    let section = FormSection {
        heading: heading.clone(),
        place: place.clone(),
        parameters: Vec::new(),
        values: Values::default(),
    };
    sections.push(section);
    for parameter in parameters {
        let entry = table.get(parameter.name);
        let value = match (parameter.value_type, entry.map(|entry| &entry.value)) {
            (ValueType::Records(inner), Some(records)) => {
                let ValueKind::Array(records) = &records.kind else { return None };
                for (index, record) in records.iter().enumerate() {
                    let ValueKind::Table(record) = &record.kind else { return None };
                    let heading = format!("{heading}, {} {}", parameter.name, index + 1);
                    place.push((parameter.name, index));
                    add_section(record, inner, heading, place, sections)?;
                    place.pop();
                }
                continue;
            }
            (ValueType::Number(_), Some(value)) => Value::Number(number(value)?),
            (ValueType::Colour(_), Some(value)) => Value::Colour(colour(value)?),
            (_, None) => match parameter.default() {
                Some(default) => default,
                None => continue,
            },
        };
        sections[at].parameters.push(*parameter);
        sections[at].values.set(parameter.name, value);
    }
    Some(())
}

fn number(value: &Toml) -> Option<f64> {
    match value.kind {
        ValueKind::Float(number) => Some(number),
        ValueKind::Integer(number) => Some(number as f64),
        _ => None,
    }
}

fn colour(value: &Toml) -> Option<[f64; 3]> {
    match &value.kind {
        ValueKind::Array(channels) => match channels.as_slice() {
            [red, green, blue] => Some([number(red)?, number(green)?, number(blue)?]),
            _ => None,
        },
        _ => number(value).map(|grey| [grey; 3]),
    }
}

/// A text with another value of a parameter, written as the one before it. Of a colour, only the channels
/// that differ are replaced; a grey stays one number as long as it is grey.
fn with_value(
    text: &str,
    mut table: &Table,
    place: &[(&'static str, usize)],
    name: &str,
    value: &Value,
) -> Option<String> {
    let text = TomlText(text);
    let mut is_inline = false;
    for (name, index) in place {
        let ValueKind::Array(tables) = &table.get(name)?.value.kind else { return None };
        table = table_of(tables.get(*index)?)?;
        is_inline |= text.is_inline(table);
    }
    let old = table.get(name).map(|entry| &entry.value);
    let is_whole = old.is_some_and(is_integer);
    let new = match (value, old.map(|old| &old.kind)) {
        (Value::Colour(rgb), Some(ValueKind::Array(channels))) => {
            let mut edited = text.0.to_owned();
            // From the last to the first, so that the places of the others stay.
            for (channel, new) in channels.iter().zip(rgb).rev() {
                if number(channel) != Some(*new) {
                    edited.replace_range(channel.span.clone(), &toml_text::number(*new, is_integer(channel)));
                }
            }
            return Some(edited);
        }
        (Value::Colour([red, green, blue]), _) if red == green && green == blue => {
            toml_text::number(*red, is_whole)
        }
        (Value::Colour(rgb), _) => format!("{rgb:?}"),
        (Value::Number(number), _) => toml_text::number(*number, is_whole),
        (Value::Records(_), _) => return None,
    };
    match old {
        Some(old) => Some(text.replaced(old.span.clone(), &new)),
        None => text.with_entry(table, is_inline, name, &new),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use engine::Failure;

    use super::*;
    use crate::material::material_file::read_material;

    /// The form of a text with some values set, and the text with it.
    fn edited(text: &str, values: &[(usize, &str, Value)]) -> String {
        let mut form = material_form("paint.toml", text).unwrap();
        for (section, name, value) in values {
            let mut fields = form.fields();
            let field = fields.find(|field| {
                field.section == *section && form.parameter(*field).is_some_and(|known| known.name == *name)
            });
            let field = field.unwrap_or_else(|| panic!("no {name} in {form:?}"));
            drop(fields);
            form.set(field, value);
        }
        material_with_form("paint.toml", text, &form).unwrap()
    }

    #[test]
    fn a_preset_gets_the_keys_that_differ_from_it() {
        let text = "# Polished.\nmaterial = \"copper\" # as measured\n";
        let form = material_form("pot.toml", text).unwrap();
        assert_eq!(form.sections[0].heading, "standard");
        let new = edited(text, &[(0, "roughness", Value::Number(0.1))]);
        assert_eq!(new, format!("{text}roughness = 0.1\n"));
    }

    #[test]
    fn comments_order_and_the_form_of_other_values_stay() {
        let text = "# Gold, brushed.\n\nroughness=0.350   # as measured\n model = \"standard\"\nbase_color = [ 1, 0.770,0.34 ] # warm\nmetallic = 1\n# the end\n";
        let new = edited(
            text,
            &[
                (0, "roughness", Value::Number(0.5)),
                (0, "base_color", Value::Colour([1.0, 0.5, 0.34])),
                (0, "metallic", Value::Number(0.0)),
            ],
        );
        assert_eq!(
            new,
            "# Gold, brushed.\n\nroughness=0.5   # as measured\n model = \"standard\"\nbase_color = [ 1, 0.5,0.34 ] # warm\nmetallic = 0\n# the end\n"
        );
        assert_eq!(edited(text, &[]), text);
    }

    #[test]
    fn a_parameter_that_the_file_leaves_out_is_added_behind_the_others() {
        let text = "model = \"standard\"\nroughness = 0.3 # smooth\n\n# the end\n";
        let new =
            edited(text, &[(0, "metallic", Value::Number(0.25)), (0, "sheen", Value::Colour([0.1; 3]))]);
        assert_eq!(
            new,
            "model = \"standard\"\nroughness = 0.3 # smooth\nmetallic = 0.25\nsheen = 0.1\n\n# the end\n"
        );
        let inline =
            "layers = [{ model = \"lambert\", albedo = 0.5 }, { model = \"phong\", exponent = 4 }]\n";
        let new = edited(inline, &[(1, "specular", Value::Colour([0.5, 0.25, 1.0]))]);
        assert_eq!(
            new,
            "layers = [{ model = \"lambert\", albedo = 0.5 }, { model = \"phong\", exponent = 4, specular = [0.5, 0.25, 1.0] }]\n"
        );
    }

    #[test]
    fn layers_in_both_notations_and_the_lobes_in_them_have_sections() {
        let inline = "layers = [\n    { model = \"lambert\", albedo = [0.4, 0.05, 0.02] }, # ground\n    { layers = [{ model = \"ggx\", roughness = 0.1, ior = 1.5 }] },\n]\n";
        let headings = |text: &str| {
            let form = material_form("paint.toml", text).unwrap();
            form.sections.into_iter().map(|section| section.heading).collect::<Vec<_>>()
        };
        assert_eq!(headings(inline), ["layer 1: lambert", "layer 2.1: ggx"]);
        let new = edited(inline, &[(1, "ior", Value::Number(1.4)), (0, "albedo", Value::Colour([0.5; 3]))]);
        assert_eq!(new, inline.replace("1.5", "1.4").replace("[0.4, 0.05, 0.02]", "[0.5, 0.5, 0.5]"));
        let tables = "[[layers]] # ground\nmodel = \"lambert\"\nalbedo = 0.5\n\n[[layers]]\nmodel = \"lafortune\"\n[[layers.lobes]]\ncx = -1\ncz = 1\nn = 4\n[[layers.lobes]]\ncx = -1.5\ncz = 1\nn = 40\n";
        let names = [
            "layer 1: lambert",
            "layer 2: lafortune",
            "layer 2: lafortune, lobes 1",
            "layer 2: lafortune, lobes 2",
        ];
        assert_eq!(headings(tables), names);
        assert_eq!(edited(tables, &[(3, "n", Value::Number(55.0))]), tables.replace("40", "55"));
        let grey = edited(tables, &[(0, "albedo", Value::Colour([0.25; 3]))]);
        assert_eq!(grey, tables.replace("0.5\n", "0.25\n"));
        let coloured = edited(tables, &[(0, "albedo", Value::Colour([0.25, 0.5, 1.0]))]);
        assert_eq!(coloured, tables.replace("0.5\n", "[0.25, 0.5, 1.0]\n"));
    }

    #[test]
    fn line_ends_and_the_byte_order_mark_stay() {
        let text = "\u{feff}# mark\r\nmodel = \"lambert\"\r\nalbedo = 0.5 # grey\r\n";
        assert_eq!(edited(text, &[(0, "albedo", Value::Colour([0.75; 3]))]), text.replace("0.5", "0.75"));
        // Also if they differ, and without one at the end.
        let mixed = "# mark\r\nmodel = \"ggx\"\nroughness = 0.5\r\nior = 1.5 # glass";
        let new =
            edited(mixed, &[(0, "roughness", Value::Number(0.25)), (0, "specular", Value::Colour([0.5; 3]))]);
        assert_eq!(new, mixed.replace("0.5", "0.25") + "\r\nspecular = 0.5");
        assert_eq!(
            edited(&new, &[(0, "specular", Value::Colour([0.75; 3]))]),
            new.replace("specular = 0.5", "specular = 0.75")
        );
    }

    #[test]
    fn optional_parameters_without_a_default_are_offered_if_the_file_has_them() {
        let names = |text: &str| {
            let form = material_form("paint.toml", text).unwrap();
            form.sections[0].parameters.iter().map(|parameter| parameter.name).collect::<Vec<_>>()
        };
        assert_eq!(names("model = \"ggx\"\nroughness = 0.5\nior = 1.5\n"), ["roughness", "ior", "specular"]);
        let stretched = names("model = \"ggx\"\nroughness_x = 0.5\nroughness_y = 0.2\nior = 1.5\n");
        assert_eq!(stretched, ["roughness_x", "roughness_y", "ior", "specular"]);
        assert_eq!(names("model = \"measured\"\nfile = \"a.binary\"\n"), ["scale"]);
    }

    #[test]
    fn a_file_without_parameters_says_why() {
        let why = |text: &str| material_form("paint.toml", text).unwrap_err();
        assert_eq!(
            why("model = \"gltf\"\nfile = \"a.glb\"\n"),
            "paint.toml names another file and has no parameters of its own"
        );
        assert_eq!(why("model = \"glass\"\n"), "paint.toml has errors");
        assert!(why("model = \n").starts_with("paint.toml:1:"), "{}", why("model = \n"));
        let reason = |name: &str| why_not_editable(Path::new(name));
        assert!(reason("a/gold.binary").unwrap().starts_with("gold.binary: a measured table"));
        assert!(reason("knot.glb").unwrap().starts_with("knot.glb: edit a material of a glTF file"));
        assert_eq!(reason("gold.toml"), None);
    }

    #[test]
    fn a_form_of_other_parameters_is_refused() {
        let form = material_form("paint.toml", "model = \"lambert\"\nalbedo = 0.5\n").unwrap();
        let other = "model = \"phong\"\nexponent = 4\n";
        assert_eq!(
            material_with_form("paint.toml", other, &form).unwrap_err(),
            "paint.toml now has other parameters"
        );
    }

    /// Every number and colour of every sample is changed and read back by the kind's own reader; what is not
    /// changed is the same, byte by byte, outside the values.
    #[test]
    fn every_sample_material_is_edited_and_read_back() {
        let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
        let read = |_: &Path| -> Result<Arc<Vec<u8>>, Failure> { Err(Failure::new("no file")) };
        let mut seen = 0;
        for folder in ["materials", "finishes", "."] {
            for entry in fs::read_dir(assets.join(folder)).unwrap() {
                let path = entry.unwrap().path();
                if path.extension().is_none_or(|ending| ending != "toml") {
                    continue;
                }
                let text = fs::read_to_string(&path).unwrap();
                let mut form = material_form("a.toml", &text).unwrap();
                for field in form.fields().collect::<Vec<_>>() {
                    let new = match form.value(field) {
                        Some(Value::Number(number)) => Value::Number(number * 0.9 + 0.05),
                        Some(Value::Colour(rgb)) => Value::Colour(rgb.map(|channel| channel * 0.9 + 0.05)),
                        other => panic!("{other:?}"),
                    };
                    form.set(field, &new);
                }
                let new = material_with_form("a.toml", &text, &form).unwrap();
                assert_ne!(new, text);
                assert!(read_material("a.toml", new.as_bytes(), None, &read).is_ok(), "{new}");
                assert_eq!(material_form("a.toml", &new), Ok(form), "{new}");
                let comments = |text: &str| {
                    let lines = text.lines().filter_map(|line| line.split_once('#'));
                    lines.map(|(_, comment)| comment.to_owned()).collect::<Vec<_>>()
                };
                assert_eq!(comments(&new), comments(&text));
                let keys = |text: &str| {
                    let lines = text.lines().filter_map(|line| line.split_once(" = "));
                    lines.map(|(key, _)| key.to_owned()).collect::<Vec<_>>()
                };
                assert!(keys(&new).starts_with(&keys(&text)), "{new}");
                let original = material_form("a.toml", &text).unwrap();
                assert_eq!(material_with_form("a.toml", &text, &original).as_ref(), Ok(&text));
                seen += 1;
            }
        }
        assert_eq!(seen, 8);
    }
}
