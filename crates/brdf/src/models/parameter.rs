//! The check that every model's parameters pass.

/// A parameter that no material can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{parameter}: {value} is not {expected}")]
pub struct ParameterError {
    /// The parameter's name in material files.
    pub parameter: &'static str,
    /// What was given.
    pub value: f64,
    /// What was expected.
    pub expected: &'static str,
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
