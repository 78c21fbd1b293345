//! The parameters of a material as JSON, and the values that come back.

use brdf::{Value, ValueType};
use preview::{FormField, MaterialForm};
use serde_json::{Value as Json, json};

/// The sections of a form, with the range, the meaning and the value of each field.
pub(super) fn form(form: &MaterialForm) -> Json {
    let section = |(section, of): (usize, &preview::FormSection)| {
        let field = |(parameter, of): (usize, &brdf::Parameter)| {
            let (range, is_colour) = match of.value_type {
                ValueType::Number(range) => (range, false),
                ValueType::Colour(range) => (range, true),
                ValueType::Records(_) => return None,
            };
            let value = json_of(form.value(FormField { section, parameter })?)?;
            Some(json!({
                "name": of.name,
                "meaning": of.meaning,
                "least": range.least,
                "most": range.most,
                "is_colour": is_colour,
                "value": value,
            }))
        };
        let fields: Vec<_> = of.parameters.iter().enumerate().filter_map(field).collect();
        json!({ "heading": of.heading, "fields": fields })
    };
    json!({ "sections": form.sections.iter().enumerate().map(section).collect::<Vec<_>>() })
}

/// The values of a form, section by section.
pub(super) fn values(form: &MaterialForm) -> Json {
    let section = |section: usize| {
        let parameters = 0..form.sections[section].parameters.len();
        let value = |parameter| form.value(FormField { section, parameter }).and_then(json_of);
        Json::Array(parameters.filter_map(value).collect())
    };
    Json::Array((0..form.sections.len()).map(section).collect())
}

/// The form with other values, in the order of [`values`]; each is brought into its range.
///
/// # Errors
/// If there are more or fewer, or one is of another type.
pub(super) fn with_values(form: &MaterialForm, values: &Json) -> Result<MaterialForm, String> {
    let mut edited = form.clone();
    let sections = values.as_array().filter(|sections| sections.len() == form.sections.len());
    let sections = sections.ok_or_else(|| format!("expected values of {} sections", form.sections.len()))?;
    for field in form.fields() {
        let FormField { section, parameter } = field;
        let of = &form.sections[section];
        let values = sections[section].as_array().filter(|values| values.len() == of.parameters.len());
        let name = of.parameters[parameter].name;
        let values =
            values.ok_or_else(|| format!("expected {} values of {}", of.parameters.len(), of.heading))?;
        let value =
            value_of(&values[parameter]).ok_or_else(|| format!("{name} is no number and no colour"))?;
        let is_same_type = |old: &Value| std::mem::discriminant(old) == std::mem::discriminant(&value);
        if !form.value(field).is_some_and(is_same_type) {
            return Err(format!("{name} has another type"));
        }
        edited.set(field, &value);
    }
    Ok(edited)
}

fn json_of(value: &Value) -> Option<Json> {
    match value {
        Value::Number(number) => Some(json!(number)),
        Value::Colour(rgb) => Some(json!(rgb)),
        Value::Records(_) => None,
    }
}

fn value_of(json: &Json) -> Option<Value> {
    if let Some(number) = json.as_f64() {
        return Some(Value::Number(number));
    }
    match json.as_array()?.as_slice() {
        [red, green, blue] => Some(Value::Colour([red.as_f64()?, green.as_f64()?, blue.as_f64()?])),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use brdf::{MODELS, Values};
    use preview::FormSection;

    use super::*;

    /// A form of two layers.
    fn layers() -> MaterialForm {
        let section = |model: &str| {
            let model = MODELS.iter().find(|known| known.name == model).unwrap();
            let parameters: Vec<_> = model.parameters.to_vec();
            let mut values = Values::default();
            for parameter in &parameters {
                values.set(
                    parameter.name,
                    match parameter.value_type {
                        ValueType::Colour(_) => Value::Colour([0.25, 0.5, 0.75]),
                        _ => Value::Number(0.5),
                    },
                );
            }
            FormSection { heading: model.name.into(), place: Vec::new(), parameters, values }
        };
        MaterialForm { sections: vec![section("lambert"), section("standard")] }
    }

    #[test]
    fn a_form_has_every_field_and_its_values_come_back() {
        let layers = layers();
        let json = form(&layers);
        assert_eq!(json["sections"][0]["heading"], "lambert");
        let albedo = &json["sections"][0]["fields"][0];
        assert_eq!((&albedo["name"], &albedo["is_colour"]), (&json!("albedo"), &json!(true)));
        assert_eq!(albedo["value"], json!([0.25, 0.5, 0.75]));
        let within_ranges = with_values(&layers, &values(&layers)).unwrap();
        assert_eq!(within_ranges.sections[0], layers.sections[0]);
        assert_eq!(with_values(&layers, &values(&within_ranges)), Ok(within_ranges));
        let mut other = values(&layers);
        other[1][0] = json!([7.0, 0.5, -1.0]);
        let edited = with_values(&layers, &other).unwrap();
        assert_eq!(
            edited.value(FormField { section: 1, parameter: 0 }),
            Some(&Value::Colour([1.0, 0.5, 0.0]))
        );
    }

    #[test]
    fn values_of_another_shape_are_refused() {
        let layers = layers();
        for wrong in [json!(null), json!([]), json!([[], []]), json!([[0.5], values(&layers)[1]]), json!("x")]
        {
            assert!(with_values(&layers, &wrong).is_err(), "{wrong}");
        }
        let mut text = values(&layers);
        text[1][0] = json!("red");
        assert!(with_values(&layers, &text).unwrap_err().contains("is no number"));
    }
}
