//! Typed values on the edges of the graph.

use std::any::Any;
use std::sync::{Arc, OnceLock};

use super::failure::Failure;
use crate::key::Digest;

/// A value that travels between stages.
///
/// Equal values encode to equal bytes: the digest of the bytes is the value's identity. The bytes contain no
/// provenance, so that an edit which leaves a value unchanged reruns nothing further.
pub trait Artifact: Any + Send + Sync + Sized {
    /// The type's name in messages and manual pages: `environment`.
    const TYPE: &'static str;

    /// The bytes, in a documented container.
    ///
    /// # Errors
    /// If the container cannot represent the value.
    fn encode(&self) -> Result<Vec<u8>, Failure>;

    /// The value of bytes that [`Artifact::encode`] made, perhaps by another version.
    ///
    /// # Errors
    /// If the bytes are not valid for the container.
    fn decode(bytes: &[u8]) -> Result<Self, Failure>;
}

/// A stored artifact, decoded at most once for all its consumers.
pub struct Handle {
    type_name: &'static str,
    digest: Digest,
    value: OnceLock<Arc<dyn Any + Send + Sync>>,
    load: Box<dyn Fn() -> Result<Vec<u8>, Failure> + Send + Sync>,
}

impl Handle {
    /// A handle on stored bytes, which `load` reads (and verifies) when the value is first needed.
    pub fn new(
        type_name: &'static str,
        digest: Digest,
        load: impl Fn() -> Result<Vec<u8>, Failure> + Send + Sync + 'static,
    ) -> Self {
        Self { type_name, digest, value: OnceLock::new(), load: Box::new(load) }
    }

    /// Returns the handle with its value, which was just made or decoded.
    #[must_use]
    pub fn with_value(self, value: Arc<dyn Any + Send + Sync>) -> Self {
        let _ = self.value.set(value);
        self
    }

    /// The name of the artifact's type.
    pub fn type_name(&self) -> &'static str {
        self.type_name
    }

    /// The digest of the artifact's bytes.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// The encoded bytes, as [`Artifact::encode`] made them.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn bytes(&self) -> Result<Vec<u8>, Failure> {
        (self.load)()
    }

    /// The value.
    ///
    /// # Errors
    /// If the bytes cannot be read or decoded, or are of another type.
    pub fn get<T: Artifact>(&self) -> Result<Arc<T>, Failure> {
        if self.value.get().is_none() {
            let decoded: Arc<dyn Any + Send + Sync> = Arc::new(T::decode(&(self.load)()?)?);
            let _ = self.value.set(decoded);
        }
        let value = self.value.get().cloned();
        value.and_then(|value| value.downcast::<T>().ok()).ok_or_else(|| {
            Failure::new(format!("the artifact is of type {}, not {}", self.type_name, T::TYPE))
        })
    }
}
