//! Colour spaces in manifests.

use containers::ColourSpace;
use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use serde_json::json;

/// The spellings of colour spaces in OCIO's configurations and `colorInteropID`. An editor offers these; the
/// parser knows further spellings of the same words.
const SPELLINGS: [&str; 16] = [
    "ACEScg",
    "ACES - ACEScg",
    "ACES2065-1",
    "ACES - ACES2065-1",
    "Linear Rec.709 (sRGB)",
    "Linear Rec.2020",
    "Linear P3-D65",
    "Linear AdobeRGB",
    "CIE XYZ-D65",
    "lin_ap0_scene",
    "lin_ap1_scene",
    "lin_rec709_scene",
    "lin_rec2020_scene",
    "lin_p3d65_scene",
    "lin_adobergb_scene",
    "lin_ciexyzd65_scene",
];

/// A colour space by its name, or by one that OCIO or `colorInteropID` has for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ColourSpaceName(pub(crate) ColourSpace);

impl Parameter for ColourSpaceName {
    fn expected() -> String {
        let names = ColourSpace::ALL.map(|space| format!("{:?}", space.name()));
        format!("{}, or the name of such a space in OCIO or colorInteropID", names.join(", "))
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
        let names: Vec<_> = ColourSpace::ALL.map(ColourSpace::name).into_iter().chain(SPELLINGS).collect();
        json!({ "type": "string", "enum": names })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_that_editors_offer_are_known() {
        let unknown: Vec<_> =
            SPELLINGS.into_iter().filter(|name| ColourSpace::from_name(name).is_none()).collect();
        assert!(unknown.is_empty(), "{unknown:?}");
    }
}
