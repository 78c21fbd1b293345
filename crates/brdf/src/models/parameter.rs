//! The parameters of the models, as data: what a material file may say, and the checks that every value passes.
//!
//! A model lists its parameters once ([`Parameter`]); readers of material files, the manual and the bytes of a
//! material are made from that list.

use std::collections::BTreeMap;

/// A parameter of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name in material files.
    pub name: &'static str,
    /// What it means and which values it takes, for the manual.
    pub meaning: &'static str,
    /// What its value looks like.
    pub shape: Shape,
    /// What holds where a file leaves it out.
    pub absent: Absent,
}

/// What a value looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A number.
    Number,
    /// RGB; one number means grey.
    Colour,
    /// An array of tables with these parameters each.
    Records(&'static [Parameter]),
}

/// What holds where a parameter is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absent {
    /// It must be given.
    Required,
    /// The model does without.
    Optional,
    /// This number, or this grey.
    Is(f64),
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// RGB.
    Colour([f64; 3]),
    /// The tables of an array.
    Records(Vec<Values>),
}

/// The values of a model's parameters by name, defaults filled in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values(BTreeMap<&'static str, Value>);

impl Values {
    /// Sets a value.
    pub fn set(&mut self, name: &'static str, value: Value) {
        self.0.insert(name, value);
    }

    /// The same with one more value.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: Value) -> Self {
        self.set(name, value);
        self
    }

    /// Every name and value, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    /// A value, where it is given.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// A number.
    ///
    /// # Errors
    /// Where it is not given.
    pub fn number(&self, parameter: &'static str) -> Result<f64, ParameterError> {
        match self.get(parameter) {
            Some(Value::Number(value)) => Ok(*value),
            _ => Err(ParameterError::missing(parameter, "a number")),
        }
    }

    /// A colour.
    ///
    /// # Errors
    /// Where it is not given.
    pub fn colour(&self, parameter: &'static str) -> Result<[f64; 3], ParameterError> {
        match self.get(parameter) {
            Some(Value::Colour(value)) => Ok(*value),
            Some(Value::Number(grey)) => Ok([*grey; 3]),
            _ => Err(ParameterError::missing(parameter, "a colour")),
        }
    }

    /// The tables of an array.
    ///
    /// # Errors
    /// Where it is not given.
    pub fn records(&self, parameter: &'static str) -> Result<&[Values], ParameterError> {
        match self.get(parameter) {
            Some(Value::Records(records)) => Ok(records),
            _ => Err(ParameterError::missing(parameter, "an array of tables")),
        }
    }
}

/// A parameter that no material can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{parameter}: {value} is not {expected}")]
pub struct ParameterError {
    /// The parameter's name in material files.
    pub parameter: &'static str,
    /// What was given; NaN where nothing was.
    pub value: f64,
    /// What was expected.
    pub expected: &'static str,
}

impl ParameterError {
    fn missing(parameter: &'static str, expected: &'static str) -> Self {
        Self { parameter, value: f64::NAN, expected }
    }
}

/// A weight: 0 or more in each channel. More than 1 makes light and is left to the caller to judge.
pub(crate) fn colour(parameter: &'static str, rgb: [f64; 3]) -> Result<[f64; 3], ParameterError> {
    let bad = rgb.into_iter().find(|value| !(0.0..=1e6).contains(value));
    bad.map_or(Ok(rgb), |value| Err(ParameterError { parameter, value, expected: "a number from 0 to 1e6" }))
}

/// The exponent of a cosine.
pub(crate) fn exponent(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    if (0.0..=1e9).contains(&value) {
        Ok(value)
    } else {
        Err(ParameterError { parameter, value, expected: "a number from 0 to 1e9" })
    }
}
