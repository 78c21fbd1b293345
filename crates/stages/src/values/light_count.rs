//! How many lights stand beside a map or an image.

use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};

/// How many lights of an environment are lights of their own by default.
pub(crate) const LIGHTS: LightCount = LightCount::Most(8);

/// How many of the strongest suns and lamps are lights of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightCount {
    /// As many as there are.
    All,
    /// At most so many.
    Most(usize),
}

impl LightCount {
    /// The strongest, of lights in the order of their strength.
    pub(crate) fn of<T>(self, lights: &[T]) -> &[T] {
        match self {
            Self::All => lights,
            Self::Most(count) => &lights[..count.min(lights.len())],
        }
    }
}

impl Parameter for LightCount {
    fn expected() -> String {
        "a whole number of lights, 0 or more, or \"all\"".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let count = match &value.kind {
            ValueKind::String(word) if word == "all" => Some(Self::All),
            ValueKind::Integer(count) => usize::try_from(*count).ok().map(Self::Most),
            _ => None,
        };
        count.ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::All => "all".into(),
            Self::Most(count) => (*count).into(),
        }
    }

    fn schema() -> serde_json::Value {
        serde_json::json!({ "type": ["integer", "string"], "minimum": 0, "pattern": "^all$" })
    }
}
