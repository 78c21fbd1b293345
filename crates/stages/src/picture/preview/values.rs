//! Types of the parameters of a preview.

use engine::{Diagnostic, Parameter, Range, Ranged, Value, ValueKind, choice, unexpected};
use preview::Background;
use serde_json::json;

use crate::values::Rgb;

choice! {
    /// What draws.
    pub(crate) enum Backend {
        /// The CPU, with bit-identical output.
        Cpu = "cpu",
        /// A graphics device, if there is one.
        Gpu = "gpu",
    }
}

choice! {
    /// A built-in mesh.
    pub(crate) enum BuiltInMesh {
        /// A sphere.
        Sphere = "sphere",
        /// A trefoil knot, which shows every direction of the normal at several depths.
        TorusKnot = "torus-knot",
        /// A square that lies on the ground.
        Plane = "plane",
    }
}

/// The width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size(pub(crate) [usize; 2]);

const MIN_SIZE: usize = 16;
const MAX_SIZE: usize = 4096;

impl Parameter for Size {
    fn expected() -> String {
        format!("the edge of a square or [width, height], each from {MIN_SIZE} to {MAX_SIZE}")
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let side = |value: &Value| usize::parse_in(value, Range::of::<usize>(MIN_SIZE..=MAX_SIZE));
        match &value.kind {
            ValueKind::Array(sides) => match sides.as_slice() {
                [width, height] => Ok(Self([side(width)?, side(height)?])),
                _ => Err(unexpected(value, &Self::expected())),
            },
            ValueKind::Integer(_) => side(value).map(|side| Self([side; 2])),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    /// Writes always two numbers: a square has one form only.
    fn canonical(&self) -> serde_json::Value {
        self.0.to_vec().into()
    }

    fn schema() -> serde_json::Value {
        let side = json!({ "type": "integer", "minimum": MIN_SIZE, "maximum": MAX_SIZE });
        json!({
            "type": ["integer", "array"], "minimum": MIN_SIZE, "maximum": MAX_SIZE,
            "items": side, "minItems": 2, "maxItems": 2
        })
    }
}

/// The background of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BackgroundChoice {
    Environment,
    Harmonics,
    Flat(Rgb),
}

impl BackgroundChoice {
    pub(crate) fn background(self) -> Background {
        match self {
            Self::Environment => Background::Environment,
            Self::Harmonics => Background::Harmonics,
            Self::Flat(Rgb(colour)) => Background::Flat(colour.map(|channel| channel as f32)),
        }
    }
}

impl Parameter for BackgroundChoice {
    fn expected() -> String {
        format!("\"environment\", \"harmonics\" or {}", Rgb::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(word) if word == "environment" => Ok(Self::Environment),
            ValueKind::String(word) if word == "harmonics" => Ok(Self::Harmonics),
            ValueKind::String(_) => Err(unexpected(value, &Self::expected())),
            _ => Rgb::parse(value).map(Self::Flat),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Environment => "environment".into(),
            Self::Harmonics => "harmonics".into(),
            Self::Flat(colour) => colour.canonical(),
        }
    }

    fn schema() -> serde_json::Value {
        let channel = json!({ "type": "number", "minimum": 0 });
        json!({
            "type": ["string", "number", "array"], "pattern": "^(environment|harmonics)$", "minimum": 0,
            "items": channel, "minItems": 3, "maxItems": 3
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(kind: ValueKind) -> Value {
        Value { span: 0..1, kind }
    }

    fn integers(numbers: &[i64]) -> Value {
        value(ValueKind::Array(numbers.iter().map(|&number| value(ValueKind::Integer(number))).collect()))
    }

    #[test]
    fn one_number_is_a_square() {
        let square = Size::parse(&value(ValueKind::Integer(64))).unwrap();
        assert_eq!(square, Size([64; 2]));
        assert_eq!(square.canonical(), Size::parse(&integers(&[64, 64])).unwrap().canonical());
        for bad in
            [integers(&[64]), integers(&[64, 4097]), integers(&[15, 64]), value(ValueKind::Float(64.0))]
        {
            assert!(Size::parse(&bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn a_background_is_a_word_or_a_colour() {
        assert_eq!(
            BackgroundChoice::parse(&value(ValueKind::String("harmonics".into()))),
            Ok(BackgroundChoice::Harmonics)
        );
        assert_eq!(
            BackgroundChoice::parse(&integers(&[0, 1, 2])),
            Ok(BackgroundChoice::Flat(Rgb([0.0, 1.0, 2.0])))
        );
        assert_eq!(
            BackgroundChoice::parse(&value(ValueKind::Float(0.5))),
            Ok(BackgroundChoice::Flat(Rgb::grey(0.5)))
        );
        for bad in [value(ValueKind::String("sky".into())), integers(&[1, 2])] {
            assert!(BackgroundChoice::parse(&bad).is_err(), "{bad:?}");
        }
    }
}
