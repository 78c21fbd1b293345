//! The names of contents and of items.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// A BLAKE3 digest of some bytes.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// The digest of some bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// The digest of parts that follow each other; `None` if one is missing.
    pub(crate) fn of_parts<'b>(parts: impl IntoIterator<Item = Option<&'b [u8]>>) -> Option<Self> {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(part?);
        }
        Some(Self(*hasher.finalize().as_bytes()))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(blake3::Hash::from_bytes(self.0).to_hex().as_str())
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Digest({self})")
    }
}

impl Serialize for Digest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <Cow<'de, str>>::deserialize(deserializer)?;
        let hash = blake3::Hash::from_hex(text.as_bytes()).map_err(serde::de::Error::custom)?;
        Ok(Self(*hash.as_bytes()))
    }
}

impl JsonSchema for Digest {
    fn schema_name() -> Cow<'static, str> {
        "Digest".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A BLAKE3 digest of some bytes.",
            "type": "string",
            "pattern": "^[0-9a-f]{64}$",
        })
    }
}

/// What distinguishes an item of a stage from the others: source stage name to file stem, sorted by name.
///
/// `{environment: "sky", material: "gold"}`; empty for a stage that has one item. Clones share their memory.
#[derive(Clone, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ItemKey(Arc<[Pair]>);

/// The name of a source stage, and the stem of one of its files.
type Pair = (Arc<str>, Arc<str>);

impl ItemKey {
    /// The stem of the file of a source stage.
    pub fn get(&self, stage: &str) -> Option<&str> {
        self.iter().find(|(name, _)| *name == stage).map(|(_, stem)| stem)
    }

    /// The source stages, each with the stem of its file.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (&str, &str)> + ExactSizeIterator {
        self.0.iter().map(|(stage, stem)| (&**stage, &**stem))
    }

    /// The stems, in order of their source stages' names.
    pub fn stems(&self) -> impl Iterator<Item = &str> {
        self.iter().map(|(_, stem)| stem)
    }

    /// Whether it names no source stage.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<Stage: Into<Arc<str>>, Stem: Into<Arc<str>>> FromIterator<(Stage, Stem)> for ItemKey {
    /// A key of these pairs, in any order; of two pairs with the same stage the last counts.
    fn from_iter<I: IntoIterator<Item = (Stage, Stem)>>(pairs: I) -> Self {
        let mut sorted = Vec::<Pair>::new();
        for (stage, stem) in pairs.into_iter().map(|(stage, stem)| (stage.into(), stem.into())) {
            match sorted.binary_search_by(|(known, _)| known.cmp(&stage)) {
                Ok(place) => sorted[place].1 = stem,
                Err(place) => sorted.insert(place, (stage, stem)),
            }
        }
        Self(sorted.into())
    }
}

impl Serialize for ItemKey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}

impl<'de> Deserialize<'de> for ItemKey {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(BTreeMap::<String, String>::deserialize(deserializer)?.into_iter().collect())
    }
}

impl JsonSchema for ItemKey {
    fn schema_name() -> Cow<'static, str> {
        "ItemKey".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = BTreeMap::<String, String>::json_schema(generator);
        let description = "What distinguishes an item of a stage from the others: source stage name to file stem.\n\n\
                           `{environment: \"sky\", material: \"gold\"}`; empty for a stage that has one item.";
        schema.insert("description".into(), description.into());
        schema
    }
}

impl fmt::Debug for ItemKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl fmt::Display for ItemKey {
    /// The stems in order of their source stages' names: `sky, gold`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, stem) in self.stems().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{stem}")?;
        }
        Ok(())
    }
}
