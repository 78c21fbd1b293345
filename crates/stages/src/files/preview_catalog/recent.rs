//! A few values that were made last, each found again by what it was made of.

use std::sync::Arc;

use engine::Failure;

/// The values that were used last, the latest first.
pub(super) struct Recent<K, V>(Vec<(K, Arc<V>)>);

impl<K, V> Default for Recent<K, V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: PartialEq, V> Recent<K, V> {
    /// The latest value of such a key.
    pub(super) fn find(&self, matches: impl Fn(&K) -> bool) -> Option<Arc<V>> {
        self.0.iter().find(|(key, _)| matches(key)).map(|(_, value)| Arc::clone(value))
    }

    /// The value of a key, made if it is not there; at most `most` values are kept.
    pub(super) fn get(
        &mut self,
        most: usize,
        key: K,
        make: impl FnOnce() -> Result<V, Failure>,
    ) -> Result<Arc<V>, Failure> {
        let found = self.0.iter().position(|(known, _)| *known == key);
        let entry = match found {
            Some(place) => self.0.remove(place),
            None => (key, Arc::new(make()?)),
        };
        self.0.insert(0, entry);
        self.0.truncate(most);
        Ok(Arc::clone(&self.0[0].1))
    }
}
