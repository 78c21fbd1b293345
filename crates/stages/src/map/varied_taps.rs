//! Tables of taps over a parameter: the materials that they are fitted to, for `fit-taps`, and their files,
//! for `dfg` and `export-taps`.

use std::ops::RangeInclusive;

use brdf::{MODELS, Material, Parameter, Range, Value, ValueType};
use containers::{Precision, Texture, write_dds_rgba, write_ktx2_rgba};
use engine::Failure;
use taps::{ROWS, VariedTable, varied_texels};

/// The rows of a table over roughness: between them, look-ups are nearly as good as at them.
pub(crate) const STEPS: usize = 33;

/// A texture of a table over a parameter: an array of pictures in halves, which says its numbers in KTX2's
/// metadata.
pub(crate) fn texture(varied: &VariedTable, is_dds: bool, recipe: &str) -> Result<Vec<u8>, Failure> {
    let (layers, texels) = varied_texels(varied);
    let sizes = Texture { width: ROWS, height: varied.tables().len(), layers, ..Texture::default() };
    if is_dds {
        return Ok(write_dds_rgba(&sizes, &texels, Precision::Half)?.bytes);
    }
    let [first, last] = varied.range();
    let entries = [
        ("specula.taps", varied.taps().to_string()),
        ("specula.normals", varied.normals().to_string()),
        ("specula.range", format!("[{first}, {last}]")),
    ];
    let entries = entries.each_ref().map(|(key, text)| (*key, text.as_str()));
    Ok(write_ktx2_rgba(&sizes, &texels, Precision::Half, Some(recipe), &entries)?.bytes)
}

/// The material with `rows` values of a parameter, in even steps over a range. All its layers that have the
/// parameter get the value; the ends of what a model takes are the ends here, too.
pub(crate) fn members(
    material: &Material,
    parameter: &str,
    range: &RangeInclusive<f64>,
    rows: usize,
) -> Result<Vec<Material>, Failure> {
    let is_varied = |layer: &&Material| number(layer, parameter).is_some();
    if !material.leaves().iter().any(is_varied) {
        let numbers = |layer: &Material| -> Vec<&str> {
            let model = MODELS.iter().find(|model| model.name == layer.name());
            let parameters = model.map_or(&[][..], |model| model.parameters);
            let numbers = parameters.iter().filter(|parameter| range_of(parameter).is_some());
            numbers.map(|parameter| parameter.name).collect()
        };
        let known: Vec<&str> = material.leaves().into_iter().flat_map(numbers).collect();
        return Err(match known.as_slice() {
            [] => Failure::new(format!(
                "the material has no numeric parameter, and so none named {parameter:?}"
            )),
            known => Failure::new(format!("the material has no numeric parameter {parameter:?}"))
                .help(format!("expected {}", known.join(", "))),
        });
    }
    let value =
        |row: usize| range.start() + (range.end() - range.start()) * row as f64 / (rows - 1).max(1) as f64;
    (0..rows).map(|row| with_number(material, parameter, value(row))).collect()
}

/// The range of a parameter that is a number.
fn range_of(parameter: &Parameter) -> Option<Range> {
    match parameter.value_type {
        ValueType::Number(range) => Some(range),
        ValueType::Colour(_) | ValueType::Records(_) => None,
    }
}

/// The parameter of a layer with this name, if it is a number.
fn number(layer: &Material, name: &str) -> Option<(&'static str, Range)> {
    let model = MODELS.iter().find(|model| model.name == layer.name())?;
    let parameter = model.parameters.iter().find(|parameter| parameter.name == name)?;
    Some((parameter.name, range_of(parameter)?))
}

fn with_number(material: &Material, name: &str, value: f64) -> Result<Material, Failure> {
    let layer = |layer: &Material| -> Result<Material, Failure> {
        let Some((name, range)) = number(layer, name) else { return Ok(layer.clone()) };
        let values = layer.values().with(name, Value::Number(value.clamp(range.least, range.most)));
        let changed = Material::analytic(layer.name(), &values);
        changed.ok_or_else(|| Failure::new("the model is unknown"))?.map_err(Failure::from)
    };
    let mut layers = material.leaves().into_iter().map(layer).collect::<Result<Vec<_>, _>>()?;
    if layers.len() == 1 {
        return layers.pop().ok_or_else(|| Failure::new("the material has no layer"));
    }
    Ok(Material::layers(layers)?)
}
