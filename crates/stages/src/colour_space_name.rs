//! Colour spaces in manifests.

use containers::ColourSpace;
use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use serde_json::json;

/// A colour space by its name, or by one that OCIO or `colorInteropID` has for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ColourSpaceName(pub(crate) ColourSpace);

impl Parameter for ColourSpaceName {
    fn expected() -> String {
        let names = ColourSpace::ALL.map(|space| format!("{:?}", space.name()));
        format!("{}, or such a space's name in OCIO or colorInteropID", names.join(", "))
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let space = match &value.kind {
            ValueKind::String(name) if !name.trim().is_empty() => ColourSpace::from_name(name),
            _ => None,
        };
        space.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.name().into()
    }

    fn schema() -> serde_json::Value {
        let names = ColourSpace::ALL.map(ColourSpace::name);
        json!({ "anyOf": [{ "type": "string", "enum": names }, { "type": "string" }] })
    }
}
