//! A cache of the device's resources for the parts that scenes share.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use crate::RenderError;

/// A value for each of several shared objects, found by the identity of their `Arc`s.
///
/// A weak reference keeps the address of an object from being reused.
#[derive(Debug)]
pub(super) struct IdentityCache<T, R> {
    entries: HashMap<usize, (Weak<T>, R)>,
}

impl<T, R> Default for IdentityCache<T, R> {
    fn default() -> Self {
        Self { entries: HashMap::new() }
    }
}

impl<T, R> IdentityCache<T, R> {
    /// The value of an object.
    pub(super) fn get(&self, object: &Arc<T>) -> Option<&R> {
        self.entries.get(&address(object)).map(|(_, value)| value)
    }

    /// The value of an object, computed if it is missing.
    pub(super) fn get_or_make(
        &mut self,
        object: &Arc<T>,
        make: impl FnOnce() -> Result<R, RenderError>,
    ) -> Result<&mut R, RenderError> {
        use std::collections::hash_map::Entry;
        match self.entries.entry(address(object)) {
            Entry::Occupied(entry) => Ok(&mut entry.into_mut().1),
            Entry::Vacant(entry) => Ok(&mut entry.insert((Arc::downgrade(object), make()?)).1),
        }
    }

    /// Drops the values of all other objects.
    pub(super) fn retain<'a>(&mut self, objects: impl Iterator<Item = &'a Arc<T>>)
    where
        T: 'a,
    {
        let used: std::collections::HashSet<usize> = objects.map(address).collect();
        self.entries.retain(|address, _| used.contains(address));
    }

    /// The number of values.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }
}

/// The identity of a shared object, which remains unique after the object is dropped.
#[derive(Debug)]
pub(super) struct Identity<T>(Weak<T>);

impl<T> Identity<T> {
    pub(super) fn of(object: &Arc<T>) -> Self {
        Self(Arc::downgrade(object))
    }
}

impl<T> PartialEq for Identity<T> {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}

/// The address of a shared object.
pub(super) fn address<T>(object: &Arc<T>) -> usize {
    Arc::as_ptr(object) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_object_never_has_the_identity_of_a_dropped_one() {
        for _ in 0..100 {
            let first = Arc::new([0_u8; 64]);
            let identity = Identity::of(&first);
            assert!(identity == Identity::of(&Arc::clone(&first)));
            drop(first);
            let second = Arc::new([1_u8; 64]);
            assert!(identity != Identity::of(&second));
        }
    }
}
