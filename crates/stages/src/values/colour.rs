//! Colours in manifests: one number means grey.

use engine::{Diagnostic, Parameter, Range, Ranged, Value, ValueKind, unexpected};
use serde_json::json;

/// A linear Rec. 709 colour, each channel 0 or more.
///
/// Written as `[0.95, 0.6, 0.2]`, or as one number for a grey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rgb(pub [f64; 3]);

impl Rgb {
    /// Makes a grey.
    pub const fn grey(value: f64) -> Self {
        Self([value; 3])
    }
}

impl Parameter for Rgb {
    fn expected() -> String {
        "a colour: [red, green, blue] or one number for a grey, each 0 or more".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let channel = |value: &Value| f64::parse_in(value, Range::of::<f64>(0.0..));
        match &value.kind {
            ValueKind::Array(channels) => match channels.as_slice() {
                [red, green, blue] => Ok(Self([channel(red)?, channel(green)?, channel(blue)?])),
                _ => Err(Diagnostic::at(
                    value.span.clone(),
                    format!("{} numbers are not a colour", channels.len()),
                )
                .expected(format!("expected {}", Self::expected()))),
            },
            ValueKind::Float(_) | ValueKind::Integer(_) => channel(value).map(Self::grey),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    /// Writes always three channels, so that a grey has one form only.
    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(Parameter::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        let channel = json!({ "type": "number", "minimum": 0 });
        json!({ "type": ["array", "number"], "items": channel, "minItems": 3, "maxItems": 3, "minimum": 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(kind: ValueKind) -> Value {
        Value { span: 3..7, kind }
    }

    fn numbers(numbers: &[f64]) -> Value {
        value(ValueKind::Array(numbers.iter().map(|&number| value(ValueKind::Float(number))).collect()))
    }

    #[test]
    fn one_number_means_grey() {
        let grey = Rgb::parse(&value(ValueKind::Integer(1))).unwrap();
        assert_eq!(grey, Rgb([1.0; 3]));
        assert_eq!(grey.canonical(), Rgb::parse(&numbers(&[1.0; 3])).unwrap().canonical());
    }

    #[test]
    fn a_colour_has_three_channels_that_are_not_negative() {
        assert_eq!(Rgb::parse(&numbers(&[0.1, 0.2, 0.3])).unwrap(), Rgb([0.1, 0.2, 0.3]));
        for bad in [numbers(&[0.1, 0.2]), numbers(&[0.1, -0.2, 0.3]), value(ValueKind::Float(-1.0))] {
            assert_eq!(Rgb::parse(&bad).unwrap_err().span, Some(3..7));
        }
        assert!(Rgb::parse(&value(ValueKind::String("gold".into()))).is_err());
    }
}
