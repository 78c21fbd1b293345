//! The parameters of the models, as data: the keys of a material file, and the checks that every value
//! passes.
//!
//! A model lists its parameters once ([`Parameter`]), each with the range of its values. Readers of material
//! files, the manual, the encoding of a material and the constructors of the models use that list.

use std::collections::BTreeMap;
use std::fmt;

/// A parameter of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The parameter's name in material files.
    pub name: &'static str,
    /// The parameter's meaning, for the manual.
    pub meaning: &'static str,
    /// The type of the parameter's value.
    pub value_type: ValueType,
    /// The rule for a file without it.
    pub absent: Absent,
}

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueType {
    /// A number in the range.
    Number(Range),
    /// RGB, each channel in the range; one number means grey.
    Colour(Range),
    /// An array of tables with these parameters each.
    Records(&'static [Parameter]),
}

/// The numbers that a parameter accepts, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least number that is accepted.
    pub least: f64,
    /// The greatest number that is accepted.
    pub most: f64,
    /// Both ends in words: `a number from 0 to 1e6`.
    pub words: &'static str,
}

/// The rule for a parameter that a file leaves out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absent {
    /// The parameter is required.
    Required,
    /// The parameter is required, unless these are given, which are then used in its place.
    RequiredUnless([&'static str; 2]),
    /// The parameter is optional, and has no default.
    Optional,
    /// The parameter is optional, and this number, or this grey, is the default.
    Default(f64),
}

/// The range of weights. A weight above 1 makes light; the caller decides what to do about that.
pub const WEIGHT: Range = Range { least: 0.0, most: 1e6, words: "a number from 0 to 1e6" };
/// The range of exponents of a cosine.
pub(crate) const POWER: Range = Range { least: 0.0, most: 1e9, words: "a number from 0 to 1e9" };
/// The range of roughness. 0 would be a mirror, which has no finite expansion.
pub(crate) const ROUGHNESS: Range = Range { least: 0.01, most: 1.0, words: "a number from 0.01 to 1" };

/// The parameters of a roughness along and across the tangent.
pub(crate) const ROUGHNESSES: [&str; 2] = [ROUGHNESS_X.name, ROUGHNESS_Y.name];

/// The roughness of a stretched highlight along the tangent.
pub(crate) const ROUGHNESS_X: Parameter =
    Parameter::number("roughness_x", "the width along the tangent; default `roughness`", ROUGHNESS)
        .optional();

/// The roughness of a stretched highlight across the tangent.
pub(crate) const ROUGHNESS_Y: Parameter =
    Parameter::number("roughness_y", "the width across the tangent; default `roughness`", ROUGHNESS)
        .optional();

/// The weight of a highlight.
pub(crate) const SPECULAR: Parameter =
    Parameter::colour("specular", "the weight of the highlight", WEIGHT).or(1.0);

impl Parameter {
    /// A required number.
    pub(crate) const fn number(name: &'static str, meaning: &'static str, range: Range) -> Self {
        Self { name, meaning, value_type: ValueType::Number(range), absent: Absent::Required }
    }

    /// A required colour.
    pub(crate) const fn colour(name: &'static str, meaning: &'static str, range: Range) -> Self {
        Self { name, meaning, value_type: ValueType::Colour(range), absent: Absent::Required }
    }

    /// Returns this parameter with a default.
    pub(crate) const fn or(self, value: f64) -> Self {
        Self { absent: Absent::Default(value), ..self }
    }

    /// Returns this parameter, required only if one of `others` is not given.
    pub(crate) const fn unless(self, others: [&'static str; 2]) -> Self {
        Self { absent: Absent::RequiredUnless(others), ..self }
    }

    /// Returns this parameter, but optional.
    pub(crate) const fn optional(self) -> Self {
        Self { absent: Absent::Optional, ..self }
    }

    /// Returns the number, if it is in the range.
    pub(crate) fn checked(&self, value: f64) -> Result<f64, ParameterError> {
        match self.value_type {
            ValueType::Number(range) | ValueType::Colour(range)
                if !(range.least..=range.most).contains(&value) =>
            {
                Err(ParameterError::value(self.name, value, range.words))
            }
            _ => Ok(value),
        }
    }

    /// Returns the colour, if every channel is in the range.
    pub(crate) fn checked_colour(&self, rgb: [f64; 3]) -> Result<[f64; 3], ParameterError> {
        rgb.into_iter().try_for_each(|value| self.checked(value).map(|_| ()))?;
        Ok(rgb)
    }

    /// The default value of the parameter, if it has one.
    pub fn default(&self) -> Option<Value> {
        match (self.absent, self.value_type) {
            (Absent::Default(value), ValueType::Colour(_)) => Some(Value::Colour([value; 3])),
            (Absent::Default(value), _) => Some(Value::Number(value)),
            _ => None,
        }
    }
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A colour, RGB.
    Colour([f64; 3]),
    /// The tables of an array.
    Records(Vec<Values>),
}

/// The values of a model's parameters by name, with defaults filled in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values(BTreeMap<&'static str, Value>);

impl Values {
    /// Sets a value.
    pub fn set(&mut self, name: &'static str, value: Value) {
        self.0.insert(name, value);
    }

    /// Returns the same values with one more.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: Value) -> Self {
        self.set(name, value);
        self
    }

    /// Iterates over every name and value, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    /// A value, if it is given.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// A number.
    ///
    /// # Errors
    /// If it is missing.
    pub fn number(&self, parameter: &'static str) -> Result<f64, ParameterError> {
        self.optional_number(parameter)
            .ok_or(ParameterError::whole(parameter, "is missing; expected a number"))
    }

    /// An optional number.
    pub fn optional_number(&self, parameter: &str) -> Option<f64> {
        match self.get(parameter) {
            Some(Value::Number(value)) => Some(*value),
            _ => None,
        }
    }

    /// The numbers of a stretched highlight along and across the tangent: those of two parameters, or else of
    /// the parameter for both.
    ///
    /// # Errors
    /// If one is missing, or that for both is out of its range.
    pub(crate) fn stretched(&self, both: &Parameter, own: [&str; 2]) -> Result<[f64; 2], ParameterError> {
        let number = self.optional_number(both.name).map(|number| both.checked(number)).transpose()?;
        match (own.map(|name| self.optional_number(name)), number) {
            ([Some(x), Some(y)], _) => Ok([x, y]),
            (own, Some(number)) => Ok(own.map(|own| own.unwrap_or(number))),
            (_, None) => self.number(both.name).map(|number| [number; 2]),
        }
    }

    /// A colour.
    ///
    /// # Errors
    /// If it is missing.
    pub fn colour(&self, parameter: &'static str) -> Result<[f64; 3], ParameterError> {
        self.optional_colour(parameter)
            .ok_or(ParameterError::whole(parameter, "is missing; expected a colour"))
    }

    /// An optional colour.
    pub fn optional_colour(&self, parameter: &str) -> Option<[f64; 3]> {
        match self.get(parameter) {
            Some(Value::Colour(value)) => Some(*value),
            Some(Value::Number(grey)) => Some([*grey; 3]),
            _ => None,
        }
    }

    /// The tables of an array.
    ///
    /// # Errors
    /// If it is missing.
    pub fn records(&self, parameter: &'static str) -> Result<&[Values], ParameterError> {
        match self.get(parameter) {
            Some(Value::Records(records)) => Ok(records),
            _ => Err(ParameterError::whole(parameter, "is missing; expected an array of tables")),
        }
    }
}

/// An error in a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// The parameter's name in material files.
    pub parameter: &'static str,
    /// The array of tables that holds the parameter, and the index of its table.
    pub record: Option<(&'static str, usize)>,
    /// The value that was given, if a single value is wrong.
    pub value: Option<f64>,
    /// The form that the value should have had; if `value` is `None`, the fault of the parameter as a whole.
    pub expected: &'static str,
}

impl ParameterError {
    pub(crate) fn value(parameter: &'static str, value: f64, expected: &'static str) -> Self {
        Self { parameter, record: None, value: Some(value), expected }
    }

    pub(crate) fn whole(parameter: &'static str, wrong: &'static str) -> Self {
        Self { parameter, record: None, value: None, expected: wrong }
    }

    /// Returns the same error, as one in a table of an array.
    pub(crate) fn within(self, records: &'static str, index: usize) -> Self {
        Self { record: Some((records, index)), ..self }
    }
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((records, index)) = self.record {
            write!(f, "{records}[{index}].")?;
        }
        match self.value {
            Some(value) => write!(f, "{}: {value} is not {}", self.parameter, self.expected),
            None => write!(f, "{} {}", self.parameter, self.expected),
        }
    }
}

impl std::error::Error for ParameterError {}

/// Checks a weight: 0 or more in each channel.
pub(crate) fn colour(parameter: &'static str, rgb: [f64; 3]) -> Result<[f64; 3], ParameterError> {
    Parameter::colour(parameter, "", WEIGHT).checked_colour(rgb)
}
