//! Values that kinds compute from an artifact, kept in memory for other items and later builds.

use std::any::Any;
use std::sync::Arc;

use crate::key::Digest;
use crate::storage::Memory;

/// Keeps values that kinds compute from artifacts, for other items that need the same ones and for later
/// builds of a watcher: an edit of a material leaves what was computed of the light as it was.
///
/// It is a memory of pure functions: a value depends on nothing but the artifact (or what else the digest is
/// of) and the numbers that name it, so that outputs have the same bytes with and without it. It keeps 128 MB
/// at most; of the values that were not used for the longest time the largest are dropped first.
#[derive(Clone, Copy, Default)]
pub struct DerivedValues<'a> {
    pub(crate) memory: Option<&'a Memory>,
}

impl DerivedValues<'_> {
    /// The value of a function of an artifact with this digest and of some numbers: computed by `make`, which
    /// also says how many bytes it takes, unless it is in memory. `function` names the function and the type
    /// of its values: no other function has that name.
    ///
    /// # Errors
    /// The errors of `make`; nothing is kept then.
    pub fn get<T: Any + Send + Sync, E>(
        &self,
        function: &'static str,
        artifact: Digest,
        numbers: &[u64],
        make: impl FnOnce() -> Result<(T, usize), E>,
    ) -> Result<Arc<T>, E> {
        let numbers = numbers.iter().flat_map(|number| number.to_le_bytes());
        let key = Digest::of(&artifact.0.into_iter().chain(numbers).collect::<Vec<_>>());
        let kept = self.memory.and_then(|memory| memory.get(function, key));
        if let Some(value) = kept.and_then(|value| value.downcast::<T>().ok()) {
            return Ok(value);
        }
        let (value, bytes) = make()?;
        let value = Arc::new(value);
        if let Some(memory) = self.memory {
            memory.put(function, key, bytes as u64, Arc::clone(&value) as Arc<dyn Any + Send + Sync>);
        }
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_computed_once_for_the_same_artifact_and_numbers() {
        let memory = Memory::new(100);
        let mut made = Vec::new();
        for (memory, artifact, number) in [
            (Some(&memory), 1, 7),
            (Some(&memory), 1, 7),
            (Some(&memory), 2, 7),
            (Some(&memory), 1, 8),
            (None, 1, 7),
            (Some(&memory), 1, 7),
        ] {
            let values = DerivedValues { memory };
            let make = || {
                made.push((memory.is_some(), artifact, number));
                Ok::<_, ()>((u64::from(artifact) + number, 10))
            };
            let value = values.get("sum", Digest([artifact; 32]), &[number], make).unwrap();
            assert_eq!(*value, u64::from(artifact) + number);
        }
        assert_eq!(made, [(true, 1, 7), (true, 2, 7), (true, 1, 8), (false, 1, 7)]);
    }

    #[test]
    fn an_error_is_not_kept() {
        let memory = Memory::new(100);
        let values = DerivedValues { memory: Some(&memory) };
        assert_eq!(values.get::<u64, _>("sum", Digest([1; 32]), &[], || Err("stopped")), Err("stopped"));
        assert_eq!(*values.get("sum", Digest([1; 32]), &[], || Ok::<_, ()>((3, 1))).unwrap(), 3);
    }
}
