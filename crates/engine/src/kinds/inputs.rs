//! The artifacts that arrive at the ports of a running item.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::artifact::{Artifact, Handle};
use super::failure::Failure;
use crate::key::{Digest, ItemKey};

/// The artifacts at a port, sorted by the keys of the items that made them.
pub(crate) type KeyedHandles = Vec<(ItemKey, Arc<Handle>)>;

/// The artifacts that arrive at the ports of a running item.
#[derive(Default)]
pub struct Inputs {
    pub(super) ports: BTreeMap<String, KeyedHandles>,
}

impl Inputs {
    /// The artifact at a single port.
    ///
    /// # Errors
    /// If it cannot be read, or the port is not connected.
    pub fn get<T: Artifact>(&self, port: &str) -> Result<Arc<T>, Failure> {
        self.optional(port)?.ok_or_else(|| unconnected(port))
    }

    /// The artifact at an optional port.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn optional<T: Artifact>(&self, port: &str) -> Result<Option<Arc<T>>, Failure> {
        self.first(port).map(Handle::get).transpose()
    }

    /// The artifacts at a `many` port, sorted by key.
    ///
    /// Only a kind that shows names (`SHOWS_KEYS`) gets the keys; for other kinds they are empty.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn many<T: Artifact>(&self, port: &str) -> Result<Vec<(ItemKey, Arc<T>)>, Failure> {
        let items = self.ports.get(port).map_or(&[][..], Vec::as_slice);
        items.iter().map(|(key, handle)| Ok((key.clone(), handle.get::<T>()?))).collect()
    }

    /// The encoded bytes of the artifacts at a `many` port, in the order of [`Inputs::many`].
    ///
    /// # Errors
    /// If those of one cannot be read.
    pub fn many_bytes(&self, port: &str) -> Result<Vec<Vec<u8>>, Failure> {
        let items = self.ports.get(port).map_or(&[][..], Vec::as_slice);
        items.iter().map(|(_, handle)| handle.bytes()).collect()
    }

    /// The encoded bytes of the artifact at a single port, for a kind that passes them to another program.
    ///
    /// # Errors
    /// If they cannot be read, or the port is not connected.
    pub fn bytes(&self, port: &str) -> Result<Vec<u8>, Failure> {
        self.first(port).ok_or_else(|| unconnected(port))?.bytes()
    }

    /// The digest of the artifact at a single port: the identity of its value.
    ///
    /// # Errors
    /// If the port is not connected.
    pub fn digest(&self, port: &str) -> Result<Digest, Failure> {
        self.first(port).map(Handle::digest).ok_or_else(|| unconnected(port))
    }

    /// The bytes of the exported files at a port of [`Port::many_files`](super::Port::many_files), sorted by
    /// key.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn many_files(&self, port: &str) -> Result<Vec<(ItemKey, Vec<u8>)>, Failure> {
        let items = self.ports.get(port).map_or(&[][..], Vec::as_slice);
        items.iter().map(|(key, handle)| Ok((key.clone(), handle.bytes()?))).collect()
    }

    /// The digests of the artifacts at a `many` port, in the order of [`Inputs::many`].
    pub fn many_digests(&self, port: &str) -> Vec<Digest> {
        let items = self.ports.get(port).map_or(&[][..], Vec::as_slice);
        items.iter().map(|(_, handle)| handle.digest()).collect()
    }

    /// The type of the artifact at a port, for a port that takes several types.
    pub fn type_at(&self, port: &str) -> Option<&'static str> {
        self.first(port).map(Handle::type_name)
    }

    fn first(&self, port: &str) -> Option<&Handle> {
        let (_, handle) = self.ports.get(port)?.first()?;
        Some(handle)
    }
}

fn unconnected(port: &str) -> Failure {
    Failure::new(format!("port {port} is not connected"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Number, Text};

    fn handle<T: Artifact>(value: T) -> Arc<Handle> {
        let bytes = value.encode().unwrap();
        let stored = Handle::new(T::TYPE, Digest::of(&bytes), move || Ok(bytes.clone()));
        Arc::new(stored.with_value(Arc::new(value)))
    }

    /// A port with two texts, one with a number, and one that is connected to no item.
    fn inputs() -> Inputs {
        let key = |name: &str| ItemKey::from_iter([("text", name)]);
        let texts = ["one", "two"].map(|text| (key(text), handle(Text(text.into()))));
        let ports = [
            ("texts", texts.into()),
            ("number", vec![(ItemKey::default(), handle(Number(3)))]),
            ("none", Vec::new()),
        ];
        Inputs { ports: ports.map(|(port, items)| (port.into(), items)).into() }
    }

    #[test]
    fn a_port_gives_its_artifacts_as_values_bytes_and_types() {
        let inputs = inputs();
        assert_eq!(inputs.get::<Number>("number").unwrap().0, 3);
        assert_eq!(inputs.bytes("number").unwrap(), 3_u64.to_le_bytes());
        assert_eq!(inputs.type_at("number"), Some(Number::TYPE));
        let texts = inputs.many::<Text>("texts").unwrap();
        let texts = texts.iter().map(|(key, text)| format!("{key} {}", text.0)).collect::<Vec<_>>();
        assert_eq!(texts, ["one one", "two two"]);
        let bytes = ["one", "two"].map(|text| Text(text.into()).encode().unwrap());
        assert_eq!(inputs.many_bytes("texts").unwrap(), bytes);
        assert!(inputs.many_bytes("none").unwrap().is_empty());
    }

    #[test]
    fn an_artifact_of_another_type_is_an_error() {
        let failure = inputs().get::<Text>("number").unwrap_err();
        assert_eq!(failure.to_string(), "the artifact is of type number, not text");
    }

    #[test]
    fn only_a_port_that_is_not_optional_has_to_be_connected() {
        let inputs = inputs();
        for port in ["none", "unknown"] {
            let message = format!("port {port} is not connected");
            assert_eq!(inputs.get::<Text>(port).unwrap_err().to_string(), message);
            assert_eq!(inputs.bytes(port).unwrap_err().to_string(), message);
            assert!(inputs.optional::<Text>(port).unwrap().is_none());
            assert!(inputs.many::<Text>(port).unwrap().is_empty());
            assert_eq!(inputs.type_at(port), None);
        }
    }
}
