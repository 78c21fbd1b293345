//! What the device keeps for things that scenes share.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use crate::RenderError;

/// Something on the device for each of some things, known by the identity of their `Arc`s.
///
/// A weak reference keeps an address from being given to another thing.
#[derive(Debug)]
pub(super) struct Kept<T, R> {
    entries: HashMap<usize, (Weak<T>, R)>,
}

impl<T, R> Default for Kept<T, R> {
    fn default() -> Self {
        Self { entries: HashMap::new() }
    }
}

impl<T, R> Kept<T, R> {
    /// What is kept for a thing.
    pub(super) fn get(&self, thing: &Arc<T>) -> Option<&R> {
        self.entries.get(&address(thing)).map(|(_, kept)| kept)
    }

    /// What is kept for a thing, made where there is nothing yet.
    pub(super) fn get_or_make(
        &mut self,
        thing: &Arc<T>,
        make: impl FnOnce() -> Result<R, RenderError>,
    ) -> Result<&mut R, RenderError> {
        use std::collections::hash_map::Entry;
        match self.entries.entry(address(thing)) {
            Entry::Occupied(entry) => Ok(&mut entry.into_mut().1),
            Entry::Vacant(entry) => Ok(&mut entry.insert((Arc::downgrade(thing), make()?)).1),
        }
    }

    /// Drops all that is not for one of these.
    pub(super) fn retain<'a>(&mut self, things: impl Iterator<Item = &'a Arc<T>>)
    where
        T: 'a,
    {
        let used: std::collections::HashSet<usize> = things.map(address).collect();
        self.entries.retain(|address, _| used.contains(address));
    }

    /// For how many things something is kept.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }
}

/// Which thing it was, as long as anybody remembers: no other is given its address meanwhile.
#[derive(Debug)]
pub(super) struct Identity<T>(Weak<T>);

impl<T> Identity<T> {
    pub(super) fn of(thing: &Arc<T>) -> Self {
        Self(Arc::downgrade(thing))
    }
}

impl<T> PartialEq for Identity<T> {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}

/// The address of a shared thing.
pub(super) fn address<T>(thing: &Arc<T>) -> usize {
    Arc::as_ptr(thing) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thing_that_has_gone_is_no_other() {
        for _ in 0..100 {
            let first = Arc::new([0_u8; 64]);
            let remembered = Identity::of(&first);
            assert!(remembered == Identity::of(&Arc::clone(&first)));
            drop(first);
            let second = Arc::new([1_u8; 64]);
            assert!(remembered != Identity::of(&second));
        }
    }
}
