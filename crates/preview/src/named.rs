//! Settings with a few values, each known by a name in lists and in saved settings.

use envmap::ToneMap;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

use crate::Background;

/// A setting whose values have names.
pub trait Named: Copy + PartialEq + 'static {
    /// The values, in the order of lists.
    const ALL: &'static [Self];

    /// The name of a value.
    fn name(self) -> &'static str;
}

impl Named for Background {
    const ALL: &'static [Self] = &[Self::Environment, Self::Harmonics, Self::MIDDLE_GREY];

    fn name(self) -> &'static str {
        match self {
            Self::Environment => "environment",
            Self::Harmonics => "harmonics",
            Self::Flat(_) => "flat",
        }
    }
}

impl Named for ToneMap {
    const ALL: &'static [Self] = &[Self::Filmic, Self::Plain];

    fn name(self) -> &'static str {
        match self {
            Self::Filmic => "filmic",
            Self::Plain => "plain",
        }
    }
}

/// Writes a value by its name, for `#[serde(with = "crate::named")]`.
pub(crate) fn serialize<T: Named, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(value.name())
}

/// Reads a value by its name, for `#[serde(with = "crate::named")]`.
pub(crate) fn deserialize<'de, T: Named, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let name = String::deserialize(deserializer)?;
    let found = T::ALL.iter().copied().find(|value| value.name() == name);
    found.ok_or_else(|| D::Error::custom(format_args!("unknown value `{name}`")))
}
