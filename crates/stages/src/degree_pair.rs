//! Degrees in manifests: a number, or the word `"auto"`; for a BRDF, a pair.

use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use serde_json::json;
use sh::Degree;

/// A degree, or `"auto"`: the least one that meets a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DegreeChoice {
    /// The least degree that meets the tolerance.
    Auto,
    /// This degree.
    Fixed(Degree),
}

impl Parameter for DegreeChoice {
    fn expected() -> String {
        format!("a degree from 0 to {} or \"auto\"", Degree::MAX.get())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(word) if word == "auto" => Ok(Self::Auto),
            ValueKind::String(_) => Err(unexpected(value, &Self::expected()).help("did you mean \"auto\"?")),
            _ => degree(value, &Self::expected()).map(Self::Fixed),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Auto => "auto".into(),
            Self::Fixed(degree) => degree.get().into(),
        }
    }

    fn schema() -> serde_json::Value {
        let most = Degree::MAX.get();
        json!({ "type": ["integer", "string"], "minimum": 0, "maximum": most, "pattern": "^auto$" })
    }
}

/// The degrees of a BRDF: `[F, P]`, in the incident and the outgoing direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DegreePair {
    /// The degree in the incident direction.
    pub(crate) f: Degree,
    /// The degree in the outgoing direction.
    pub(crate) p: Degree,
}

impl Parameter for DegreePair {
    fn expected() -> String {
        format!("[F, P], two degrees from 0 to {}", Degree::MAX.get())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::Array(values) => match values.as_slice() {
                [f, p] => Ok(Self { f: degree(f, &expected_degree())?, p: degree(p, &expected_degree())? }),
                _ => Err(Diagnostic::at(
                    value.span.clone(),
                    format!("{} numbers are not [F, P]", values.len()),
                )
                .expected(format!("expected {}", Self::expected()))),
            },
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        vec![self.f.get(), self.p.get()].into()
    }

    fn schema() -> serde_json::Value {
        let degree = json!({ "type": "integer", "minimum": 0, "maximum": Degree::MAX.get() });
        json!({ "type": "array", "items": degree, "minItems": 2, "maxItems": 2 })
    }
}

fn expected_degree() -> String {
    format!("a degree from 0 to {}", Degree::MAX.get())
}

fn degree(value: &Value, expected: &str) -> Result<Degree, Diagnostic> {
    let number = match value.kind {
        ValueKind::Integer(number) => usize::try_from(number).ok(),
        _ => None,
    };
    number.and_then(|number| Degree::new(number).ok()).ok_or_else(|| unexpected(value, expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(kind: ValueKind) -> Value {
        Value { span: 0..1, kind }
    }

    #[test]
    fn a_degree_is_a_number_or_auto() {
        let degree = |kind| DegreeChoice::parse(&value(kind));
        assert_eq!(degree(ValueKind::String("auto".into())).unwrap(), DegreeChoice::Auto);
        assert_eq!(degree(ValueKind::Integer(30)).unwrap(), DegreeChoice::Fixed(Degree::new(30).unwrap()));
        for bad in [ValueKind::Integer(-1), ValueKind::Integer(2049), ValueKind::Float(3.0)] {
            assert!(degree(bad.clone()).unwrap_err().message.contains("0 to 2048"), "{bad:?}");
        }
    }

    #[test]
    fn a_pair_has_two_degrees() {
        let pair = |numbers: &[i64]| {
            let values = numbers.iter().map(|&number| value(ValueKind::Integer(number))).collect();
            DegreePair::parse(&value(ValueKind::Array(values)))
        };
        assert_eq!(pair(&[23, 2]).unwrap().canonical(), serde_json::json!([23, 2]));
        assert!(pair(&[23]).is_err());
        assert!(pair(&[23, 9999]).is_err());
    }
}
