//! The parameters of a material, as a window edits them.
//!
//! A material file has a table of parameters for its model, or one for each of its layers, and some
//! parameters are arrays of tables themselves. A [`MaterialForm`] has a section for each of these tables. The
//! models say which parameters there are, with their ranges and meanings ([`brdf::MODELS`]).

use brdf::{Parameter, Value, ValueType, Values};

/// The parameters of a material, and their values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialForm {
    /// A section for each table of parameters, in the order of the file.
    pub sections: Vec<FormSection>,
}

/// A table of parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FormSection {
    /// The heading of the section: `phong`, or `layer 2: phong`.
    pub heading: String,
    /// The place of the table in the file: the arrays around it, the outermost first, and its index in each.
    pub place: Vec<(&'static str, usize)>,
    /// The parameters that can be edited, numbers and colours, in the order of the model.
    pub parameters: Vec<Parameter>,
    /// The values of the parameters, with the defaults of those that the file leaves out.
    pub values: Values,
}

/// A parameter in a form: the index of its section, and its index there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormField {
    /// The index of the section.
    pub section: usize,
    /// The index of the parameter in its section.
    pub parameter: usize,
}

impl MaterialForm {
    /// Every parameter.
    pub fn fields(&self) -> impl Iterator<Item = FormField> {
        let sections = self.sections.iter().enumerate();
        sections.flat_map(|(section, of)| {
            (0..of.parameters.len()).map(move |parameter| FormField { section, parameter })
        })
    }

    /// The description of a parameter; `None` if there is no such field.
    pub fn parameter(&self, field: FormField) -> Option<&Parameter> {
        self.sections.get(field.section)?.parameters.get(field.parameter)
    }

    /// The value of a parameter.
    pub fn value(&self, field: FormField) -> Option<&Value> {
        self.sections[field.section].values.get(self.parameter(field)?.name)
    }

    /// Sets a parameter to the nearest value in its range. A value of another type, and one that is NaN,
    /// change nothing.
    pub fn set(&mut self, field: FormField, value: &Value) {
        let Some(parameter) = self.parameter(field).copied() else { return };
        let value = match (parameter.value_type, value) {
            (ValueType::Number(range), Value::Number(number)) if !number.is_nan() => {
                Value::Number(number.clamp(range.least, range.most))
            }
            (ValueType::Colour(range), Value::Colour(rgb)) if rgb.iter().all(|channel| !channel.is_nan()) => {
                Value::Colour(rgb.map(|channel| channel.clamp(range.least, range.most)))
            }
            _ => return,
        };
        self.sections[field.section].values.set(parameter.name, value);
    }

    /// Whether both forms have the same parameters, perhaps with other values.
    pub fn has_same_parameters(&self, other: &Self) -> bool {
        let parameters = |form: &Self| {
            let of = |section: &FormSection| {
                (section.heading.clone(), section.place.clone(), section.parameters.clone())
            };
            form.sections.iter().map(of).collect::<Vec<_>>()
        };
        parameters(self) == parameters(other)
    }
}

#[cfg(test)]
mod tests {
    use brdf::MODELS;

    use super::*;

    fn form(model: &str) -> MaterialForm {
        let model = MODELS.iter().find(|known| known.name == model).unwrap();
        let mut values = Values::default();
        for parameter in model.parameters {
            let default = match parameter.value_type {
                ValueType::Colour(_) => Value::Colour([0.5; 3]),
                _ => Value::Number(0.5),
            };
            values.set(parameter.name, default);
        }
        let parameters = model.parameters.to_vec();
        let section = FormSection { heading: model.name.into(), place: Vec::new(), parameters, values };
        MaterialForm { sections: vec![section] }
    }

    #[test]
    fn values_stay_in_their_ranges_and_keep_their_types() {
        let mut form = form("standard");
        let find = |form: &MaterialForm, name: &str| {
            let mut fields = form.fields();
            fields.find(|field| form.parameter(*field).unwrap().name == name).unwrap()
        };
        let (roughness, colour) = (find(&form, "roughness"), find(&form, "base_color"));
        form.set(roughness, &Value::Number(7.0));
        assert_eq!(form.value(roughness), Some(&Value::Number(1.0)));
        form.set(roughness, &Value::Number(f64::NAN));
        form.set(roughness, &Value::Colour([0.1; 3]));
        assert_eq!(form.value(roughness), Some(&Value::Number(1.0)));
        form.set(colour, &Value::Colour([-1.0, 0.25, 2.0]));
        assert_eq!(form.value(colour), Some(&Value::Colour([0.0, 0.25, 1.0])));
        let nowhere = FormField { section: 9, parameter: 0 };
        form.set(nowhere, &Value::Number(1.0));
        assert_eq!(form.parameter(nowhere), None);
    }

    #[test]
    fn forms_of_one_model_have_the_same_parameters() {
        let (first, mut other) = (form("phong"), form("phong"));
        other.set(FormField { section: 0, parameter: 0 }, &Value::Number(3.0));
        assert!(first != other && first.has_same_parameters(&other));
        assert!(!first.has_same_parameters(&form("lambert")));
    }
}
