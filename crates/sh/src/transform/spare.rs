//! Memory that finished work leaves to later work.

use std::mem;
use std::ops::{Deref, DerefMut};

use parking_lot::Mutex;

/// Values that nobody uses now, with arbitrary contents.
#[derive(Default)]
pub(super) struct Spare<T>(Mutex<Vec<T>>);

/// A value in use, which becomes spare when it is dropped.
pub(super) struct InUse<'a, T: Default> {
    spare: &'a Spare<T>,
    value: T,
}

impl<T: Default> Spare<T> {
    /// A spare value, or a new one if there is none.
    pub(super) fn take(&self) -> InUse<'_, T> {
        InUse { value: self.0.lock().pop().unwrap_or_default(), spare: self }
    }
}

impl<T: Default> Deref for InUse<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Default> DerefMut for InUse<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Drop for InUse<'_, T> {
    fn drop(&mut self) {
        self.spare.0.lock().push(mem::take(&mut self.value));
    }
}
