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
        self.get_enough(function, key, |_| true, |_: Option<&T>| make())
    }

    /// A value of an artifact that is enough for its caller: the one in memory, if it `is_enough`, otherwise
    /// what `make` computes, which takes its place. `make` is given the value that was not enough, so that
    /// the new one can serve the earlier callers too. A caller computes the same from every value that is
    /// enough for it: which one it gets depends on what others needed before.
    ///
    /// # Errors
    /// The errors of `make`; the value in memory is left then.
    pub fn get_enough<T: Any + Send + Sync, E>(
        &self,
        function: &'static str,
        artifact: Digest,
        is_enough: impl FnOnce(&T) -> bool,
        make: impl FnOnce(Option<&T>) -> Result<(T, usize), E>,
    ) -> Result<Arc<T>, E> {
        let kept = self.memory.and_then(|memory| memory.get(function, artifact));
        let kept = kept.and_then(|value| value.downcast::<T>().ok());
        if let Some(value) = kept.as_ref().filter(|value| is_enough(value)) {
            return Ok(Arc::clone(value));
        }
        let (value, bytes) = make(kept.as_deref())?;
        let value = Arc::new(value);
        if let Some(memory) = self.memory {
            memory.put(function, artifact, bytes as u64, Arc::clone(&value) as Arc<dyn Any + Send + Sync>);
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
    fn a_value_that_is_not_enough_is_replaced_by_one_that_serves_both() {
        let memory = Memory::new(100);
        let values = DerivedValues { memory: Some(&memory) };
        let mut made = Vec::new();
        for needed in [3, 2, 7, 5, 3] {
            let make = |kept: Option<&u64>| {
                made.push((kept.copied(), needed));
                Ok::<_, ()>((kept.copied().unwrap_or(0).max(needed), 10))
            };
            let is_enough = |kept: &u64| *kept >= needed;
            assert!(*values.get_enough("up to", Digest([1; 32]), is_enough, make).unwrap() >= needed);
        }
        assert_eq!(made, [(None, 3), (Some(3), 7)]);
    }

    #[test]
    fn an_error_is_not_kept() {
        let memory = Memory::new(100);
        let values = DerivedValues { memory: Some(&memory) };
        assert_eq!(values.get::<u64, _>("sum", Digest([1; 32]), &[], || Err("stopped")), Err("stopped"));
        assert_eq!(*values.get("sum", Digest([1; 32]), &[], || Ok::<_, ()>((3, 1))).unwrap(), 3);
    }
}
