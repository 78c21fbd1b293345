//! The degrees of a BRDF in manifests.

use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use serde_json::json;
use sh::Degree;

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
                [f, p] => Ok(Self { f: degree(f)?, p: degree(p)? }),
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

fn degree(value: &Value) -> Result<Degree, Diagnostic> {
    let expected = format!("a degree from 0 to {}", Degree::MAX.get());
    let number = usize::parse(value).ok().and_then(|number| Degree::new(number).ok());
    number.ok_or_else(|| unexpected(value, &expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(kind: ValueKind) -> Value {
        Value { span: 0..1, kind }
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
